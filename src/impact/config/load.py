"""Read and check a config: from a TOML file or a mapping to a frozen `Config`, or a list of all problems."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cache, partial
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError

from ..contact.fixed_step import EXACT, SCHEMES
from ..contact.friction import FrictionLaw
from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.numba.dispatch import is_installed
from ..contact.variables import OUTPUTS, default_variables
from ..errors import ConfigError, MissingFileError, did_you_mean
from . import measurements, quantities, tables
from .columns import csv_files, expand_cases, read_csv_of, without_replaced_inputs
from .draft import Draft, Measurements, Overrides, Setting, add_library_materials, open_config, open_text
from .files import as_table, override_text, set_value
from .grid import MAX_POINTS, Axis, build_grid, chunk_problems, design_problems, draw_columns, unit_samples
from .input_names import InputName, paths_with
from .library import library
from .quantities import VALUE_FORMS, Column, ConfigProblem, Distribution, FitRange, KeyPath, Values, as_text
from .rules import check_rules, materials_of

# what a config is read for: only a calibration has measurements and parameters to fit, only a sweep has axes
Purpose = Literal["sweep", "calibrate"]
EXPECTED_BY_KEY = {
    "sweep": "a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...",
    "models": tables.LAWS_EXPECTED["model"],
    **{name: f"{quantity.expected}: {quantity.meaning}" for name, quantity in tables.MATERIAL_QUANTITIES.items()},
    **{name: str(info.description) for name, info in Column.model_fields.items()},
    "n": f"the number of {tables.Design.model_fields['n'].description}, such as 1024",
}
# of the config itself, which choose its laws
LAW_KEYS = ("models", "frictions")
# where keys that are in another table belong
HOMES: Mapping[str, Iterable[str]] = {
    **{f"under [{table}]": tables.KEYS_BY_TABLE[table] for table in ("sweep", "solver", "output")},
    "under [materials.NAME]": tables.MaterialTable.model_fields,
    "before all tables": (*LAW_KEYS, "title"),
}
# of a table that is a value, by its form
KEYS_BY_FORM: Mapping[str | int, Iterable[str]] = {
    quantities.RANGE: VALUE_FORMS,
    quantities.FIT: ("fit",),
    quantities.DISTRIBUTION: quantities.DISTRIBUTION_FORMS,
    quantities.COLUMN: Column.model_fields,
}
# other words that users may write for a key
KEY_SYNONYMS = {
    "restitution": "e",
    "cor": "e",
    "stiffness": "K",
    "exponent": "n",
    "youngs_modulus": "E",
    "poisson": "nu",
    "poissons_ratio": "nu",
    "density": "rho",
    "friction": "mu",
    "friction_coefficient": "mu",
    "impact_angle": "angle",
    "logspace": "geomspace",
}
WORDS_OF_BALLS = {
    "mass": "m",
    "speed": "v",
    "velocity": "v",
    "radius": "R",
    "spin": "omega",
    "tangential_velocity": "u",
}
KEY_SYNONYMS |= {f"{word}{ball}": f"{key}{ball}" for word, key in WORDS_OF_BALLS.items() for ball in "12"}


@dataclass(frozen=True)
class Config:
    """A valid config of a sweep or a calibration, in SI units; text and settings define it without any file."""

    title: str
    models: tuple[ForceModel, ...]
    # values that do not vary, by config name ("v1", "material1", "KEY.name" for a parameter of a model), including
    # defaults; a mass or radius that is not in the config is derived from the other and the density. A parameter
    # to fit has a value between its bounds here, and an input that is measured its first value
    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]  # in config order: those of [sweep], of materials ("materials.steel.E"), of models
    # including library materials; a property that is an axis or fitted is NaN for E and nu, else None
    materials: Mapping[str, Material]
    solver: tables.Solver
    output: tables.Output
    text: str  # the TOML text verbatim, or a mapping as JSON, without settings
    # first the library materials that are used, then those of the caller, then the values of CSV files
    settings: tuple[Setting, ...] = field(repr=False, compare=False)
    # bounds of the parameters to fit; NaN where `fit = true` leaves them to the size of the contact
    fits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    data: Measurements | None = None
    design: tables.Design | None = None
    distributions: Mapping[str, Distribution] = field(default_factory=dict)  # of the uncertain inputs
    files: tuple[Path, ...] = field(default=(), repr=False, compare=False)
    frictions: tuple[FrictionLaw, ...] = ()  # without one, impacts are central
    notes: tuple[str, ...] = field(default=(), repr=False, compare=False)  # on what was left out of measurements

    @property
    def overrides(self) -> tuple[str, ...]:
        """The settings as PATH=VALUE."""
        return tuple(setting.override for setting in self.settings)

    @property
    def sets_material(self) -> bool:
        """Whether a setting names a material or gives a property of one."""
        return any("material" in override for override in self.overrides)


def read_config(
    source: str | Path | Mapping[str, object] | None,
    overrides: Overrides = (),
    plugins: Sequence[ForceModel] = (),
    max_points: int = MAX_POINTS,
    purpose: Purpose = "sweep",
) -> Config:
    """Read the config of a TOML file or a mapping, with overrides such as "sweep.e.linspace=[0,1,11]".

    Without a source it is the starter config, without inputs that the overrides replace by others. Names of CSV
    files are relative to the folder of the TOML file, else to the working directory.

    >>> steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    >>> sweep = {"e": [0.5, 1], "v1": 1, "m1": 1, "m2": 1, "material": "steel"}
    >>> read_config({"models": "hertz", "sweep": sweep, "materials": {"steel": steel}}).axes
    (Axis(columns={'e': (0.5, 1.0)}, numbered='', numbers=()),)
    """
    draft = open_config(source, plugins).with_settings(overrides)
    if source is None:
        draft = without_replaced_inputs(inline_files(draft), {})
    return build(draft, max_points, purpose)


def parse_config(
    text: str,
    overrides: Overrides = (),
    plugins: Sequence[ForceModel] = (),
    name: str = "<text>",
    purpose: Purpose = "sweep",
) -> Config:
    """Read the config of a TOML text, or of a JSON text, which starts with a brace; see `read_config`.

    No file is read, because the text may come from a result of unknown origin.
    """
    return build(open_text(text, name, plugins).with_settings(overrides), purpose=purpose)


def build(draft: Draft, max_points: int = MAX_POINTS, purpose: Purpose = "sweep") -> Config:
    """Check a draft and build its config, or raise a ConfigError with all problems, one per line.

    The limit of points, of all models together, is checked before any array is allocated.
    """
    if purpose == "sweep" and not draft.problems:
        draft = draft.with_problems(measurements.purpose_problems(draft.data))
    if draft.problems:
        raise draft.error()
    first = (inline_files, measurements.add_fits, add_library_materials)
    for step in (*first, expand_cases, measurements.read_measurements):
        draft = step(draft)
    document, invalid_values = _validate(draft)
    draft = check_rules(draft.with_problems(invalid_values))
    if document is None:
        raise draft.error()
    values = _valid_values(document, draft)
    fits, unbounded = _fit_bounds(values, draft)
    draft = draft.with_problems(unbounded)
    for name, (least, most) in fits.items():
        values[name] = 1.0 if math.isnan(least) else quantities.middle_of(least, most)
    if purpose == "calibrate":
        draft = draft.with_problems(_calibration_problems(draft.data, values, fits, are_valid=not invalid_values))
        values = {name: value for name, value in values.items() if isinstance(value, float | str)}
    else:
        draft = draft.with_problems(design_problems(draft.data))
    distributions = {name: value for name, value in values.items() if isinstance(value, Distribution)}
    if distributions and document.design is not None:
        u = unit_samples(document.design, len(distributions))
        drawn, refused = draw_columns(distributions, draft.known_models, u)
        draft = draft.with_problems((InputName.parse(name).path, message) for name, message in refused.items())
        values |= {name: tuple(column.tolist()) for name, column in drawn.items()}
    groups = document.sweep.zip if purpose == "sweep" else ()
    limit = max_points if document.output.is_full else None
    axes, problems = build_grid(draft, values, groups, list(distributions), limit)
    draft = draft.with_problems(problems)
    if not draft.problems:
        draft = draft.with_problems(_settings_problems(document, axes, draft))
    if not draft.problems:
        draft = draft.with_problems(measurements.count_problems(draft, fits))
    if draft.problems or draft.lines:
        raise draft.error()
    measured = draft.measurements.inputs if draft.measurements is not None else {}
    defaults = _default_scalars(draft, document.solver)
    return Config(
        title=document.title,
        models=tuple(draft.models),
        scalars={
            **{name: value for name, value in values.items() if isinstance(value, float | str)},
            **{name: column[0] for name, column in measured.items()},
            **{name: value for name, value in defaults.items() if name not in values},
        },
        axes=axes,
        # without the properties that are axes
        materials={
            name: Material(**{"E": math.nan, "nu": math.nan} | _values_by_key(table, float))
            for name, table in document.materials.items()
        },
        solver=document.solver,
        output=document.output,
        text=draft.text,
        settings=draft.settings,
        fits=fits,
        data=draft.measurements,
        design=document.design,
        distributions=distributions,
        files=draft.files or (),
        frictions=tuple(draft.frictions),
        notes=draft.notes,
    )


def inline_files(draft: Draft) -> Draft:
    """Replace the names of CSV files by the values in them."""
    if draft.files is not None:
        return draft
    open_csv, files, lines = cache(partial(read_csv_of, draft)), list[Path](), list[str]()
    for files_of in (csv_files, measurements.csv_files):
        for file, wanted, form, read in files_of(draft):
            files.append((draft.folder or Path()) / file)
            try:
                values, notes = read(open_csv(file, wanted, **form))
            except ConfigError as error:
                lines += error.problems
                draft = replace(draft, misses_file=draft.misses_file or isinstance(error, MissingFileError))
            except KeyError:
                continue  # an unknown key is reported with the others
            else:
                draft = replace(draft, notes=(*draft.notes, *notes))
                for path, value in values.items():
                    setting = Setting(path, value, "", override_text(path, value))
                    data, _ = set_value(draft.data, path, value)
                    draft = replace(draft, data=data, settings=(*draft.settings, setting))
    # several columns may be of one file, and of one that cannot be read
    return replace(draft, files=tuple(dict.fromkeys(files)), lines=(*draft.lines, *dict.fromkeys(lines)))


def _validate(draft: Draft) -> tuple[tables.Document | None, list[ConfigProblem]]:
    """Build the document of the valid part, or None, and list the problems of single values."""
    document = tables.document_type(draft.known_models, {name: draft.table(name) for name in draft.laws})
    materials = tuple({**draft.table("materials"), **library()})
    context = quantities.ValidationContext(draft.exponent, materials, draft.known_models)
    try:
        return document.model_validate(draft.data, context=context), []
    except ValidationError as error:
        problems = list(validation_problems(error, draft.known_models))
    # a second pass, so that one message also holds the problems between valid values
    try:
        return document.model_validate(_remove_invalid(draft.data, problems), context=context), problems
    except ValidationError:
        return None, problems


def _default_scalars(draft: Draft, solver: tables.Solver) -> dict[str, float]:
    """List the defaults of inputs and of parameters by config name."""
    defaults = {**tables.SWEEP_DEFAULTS, **({} if solver.integrator == EXACT else tables.FIXED_STEP_DEFAULTS)}
    if draft.frictions:
        # with an angle or a speed, u1 follows from it
        has_angle = bool({"angle", "speed"} & draft.table("sweep").keys())
        defaults |= {**tables.OBLIQUE_DEFAULTS, **({"u2": 0.0} if has_angle else {"u1": 0.0, "u2": 0.0})}
    of_laws = {str(name): parameter.default for name, parameter in draft.parameters}
    return defaults | {name: default for name, default in of_laws.items() if default is not None}


def _remove_invalid(data: Mapping[str, Any], problems: Iterable[ConfigProblem]) -> dict[str, Any]:
    """Remove keys that have problems: [solver] and [output] whole, and of the table of a law the parameter."""
    lengths = {"solver": 1, "output": 1, "model": 3, "friction": 3}
    invalid = {path[: lengths.get(str(path[0]), 2)] for path, _ in problems if path}

    def valid_part(value: Any, path: KeyPath) -> Any:
        if not isinstance(value, dict) or len(path) > 2:
            return value
        return {
            key: valid_part(inner, (*path, key)) for key, inner in value.items() if (*path, key) not in invalid
        }

    valid_data: dict[str, Any] = valid_part(data, ())
    return valid_data


def _valid_values(document: tables.Document, draft: Draft) -> dict[str, quantities.Numbers | quantities.Names]:
    """List valid values by config name: keys of [sweep], varying or fitted properties of balls, and parameters."""
    sweep = _values_by_key(document.sweep)
    values = {name: sweep[name] for name in draft.table("sweep") if name in sweep and name not in ("zip", "cases")}
    used_materials = {name for ball in "12" for name in materials_of(draft, ball)}
    for material, table in document.materials.items():
        for name, value in _values_by_key(table).items() if material in used_materials else ():
            if not isinstance(value, float):
                values[f"materials.{material}.{name}"] = value
    for table_name, laws in draft.laws.items():
        parameter_tables = _values_by_key(getattr(document, table_name))
        selected = {law.key for law in laws}
        for key in draft.table(table_name):
            # parameters of models that are not selected are checked, but are not part of the grid
            parameters = _values_by_key(parameter_tables.get(key)) if key in selected else {}
            values |= {str(InputName(table_name, key, name)): value for name, value in parameters.items()}
    # a file that is left cannot be read
    return {
        name: value
        for name, value in values.items()
        if not isinstance(value, Column)
        and not (isinstance(value, Distribution) and isinstance(value.numbers[0], str))
    }


def _fit_bounds(values: Values, draft: Draft) -> tuple[dict[str, tuple[float, float]], list[ConfigProblem]]:
    """Find the bounds of the parameters to fit; NaN for those that the size of the contact gives."""
    fits: dict[str, tuple[float, float]] = {}
    problems: list[ConfigProblem] = []
    for name, bounds in ((name, value.fit) for name, value in values.items() if isinstance(value, FitRange)):
        if bounds is not True:
            fits[name] = bounds
            continue
        parsed = InputName.parse(name)
        quantity = parsed.quantity(draft.known_models)
        assert quantity is not None
        is_bounded = math.isfinite(quantity.least) and math.isfinite(quantity.most)
        fits[name] = (float(quantity.least), float(quantity.most)) if is_bounded else (math.nan, math.nan)
        if not is_bounded and parsed.table not in ("model", "friction") and name not in ("K", "mu"):
            problems.append((parsed.path, "got fit = true, expected fit = [least, most]: it has no natural range"))
    return fits, problems


def _values_by_key(table: quantities.Table | None, kind: type = object) -> dict[str, Any]:
    """List the values of a kind that are set in a table, by key, in the order of definition."""
    if table is None:
        return {}
    fields, is_set = type(table).model_fields, table.model_fields_set
    values = {fields[name].alias or name: getattr(table, name) for name in fields if name in is_set}
    return {key: value for key, value in values.items() if isinstance(value, kind)}


def _calibration_problems(
    data: Mapping[str, Any], values: Values, fits: Mapping[str, tuple[float, float]], *, are_valid: bool
) -> Iterator[ConfigProblem]:
    """Check that a calibration has measurements, a parameter to fit and no axes, given its valid values.

    Unless all values are valid, a fit may be missing among `fits` because it is invalid.
    """
    single = "expected a single value, a column of [data] or { fit = [least, most] }"
    if "data" not in data:
        yield ("data",), 'missing, expected a table [data] of measurements, such as file = "drops.csv"'
    fit_paths = paths_with(data, ["fit"])
    if not fit_paths:
        yield ("sweep",), "got no parameter to fit, expected at least one { fit = [least, most] }"
    for path in fit_paths if are_valid and not fits else ():
        yield path, "got a fit, expected a value: no model and no ball of this config uses it"
    for name, value in values.items():
        if isinstance(value, tuple | quantities.Range):
            yield InputName.parse(name).path, f"got an axis, {single}"
    uncertain = [*paths_with(data, quantities.DISTRIBUTION_FORMS), *([("design",)] if "design" in data else [])]
    if uncertain:
        yield uncertain[0], "got an uncertain input, which impact sweep and impact sensitivity take"
    if as_table(data.get("sweep")).get("zip"):
        yield ("sweep", "zip"), f"got axes that vary together, {single} for each name"
    integrator = as_table(data.get("solver")).get("integrator", EXACT)
    if isinstance(integrator, str) and integrator in SCHEMES:
        yield ("solver", "integrator"), f'got "{integrator}", expected "{EXACT}": measurements have no time step'


def _settings_problems(document: tables.Document, axes: Sequence[Axis], draft: Draft) -> Iterator[ConfigProblem]:
    """Check [solver] and [output] against the grid and the installed packages."""
    output = document.output
    if document.solver.core == "numba" and not is_installed():
        expected = 'numba, which is not installed (pip install "impact-sweep[fast]"), or "auto"'
        yield ("solver", "core"), f'got "numba", expected {expected}'
    n_frictions = len(draft.frictions)
    stored = {"status", *(output.variables or default_variables(bool(n_frictions)))}
    per_model = sum(n_frictions if OUTPUTS[name].of_friction else 1 for name in stored)
    yield from chunk_problems(output.chunks, axes, len(draft.models), per_model)
    for position, name in enumerate(output.variables or ()):
        if OUTPUTS[name].of_friction and not n_frictions:
            yield ("output", "variables", position), f'got "{name}", which needs frictions = [...]'
    if output.chunks and output.layout == "factored":
        yield ("output", "chunks"), 'set together with layout = "factored", expected layout = "full"'


def validation_problems(error: ValidationError, models: Mapping[str, ForceModel]) -> Iterable[ConfigProblem]:
    """List the problems that pydantic reports, with the path of each value."""
    for n_problems, detail in enumerate(error.errors(include_url=False)):
        # the tags of unions are not keys
        path: KeyPath = tuple(part for part in detail["loc"] if not (isinstance(part, str) and "\0" in part))
        match detail["type"]:
            case quantities.PROBLEM_TYPE:
                yield path, detail["msg"]
            case "missing":
                yield path, f"missing, expected {EXPECTED_BY_KEY[str(path[-1])]}"
            case "extra_forbidden" | "unexpected_keyword_argument":
                # hints take time, and later lines are not printed
                hint = _unknown_key_hint(detail["loc"], models) if n_problems < quantities.MAX_PROBLEMS else ""
                yield path, f"unknown key; {hint}"
            case "literal_error":
                choices = ", ".join(re.findall("'([^']*)'", detail["ctx"]["expected"]))
                yield path, f"got {as_text(detail['input'])}, expected one of {choices}"
            case _:
                yield path, f"got {as_text(detail['input'])}, expected a table"


def _unknown_key_hint(location: KeyPath, models: Mapping[str, ForceModel]) -> str:
    """Suggest a known key for an unknown one; `location` is its path, with tags."""
    name = str(location[-1])
    home = next((home for home, keys in HOMES.items() if name in keys), None)
    if home is not None and (len(location) < 3 or location[0] in ("materials", "model", "friction")):
        return f"it belongs {home}"
    keys: Iterable[str]
    match location[:-1]:
        case (*_, form) if form in KEYS_BY_FORM:
            keys = KEYS_BY_FORM[form]
        case ():
            keys = tables.Document.model_fields
        case ("materials", _):
            keys = tables.MaterialTable.model_fields
        case ("model" | "friction" as table,):
            keys = tables.laws_of(table, models)
        case ("model" | "friction" as table, key):
            keys = tables.law_quantities(tables.laws_of(table, models)[str(key)])
        case ("sweep",) if name not in KEY_SYNONYMS and (meant := get_close_matches(name[:64], LAW_KEYS, 1, 0.8)):
            return f'did you mean "{meant[0]}", before all tables?'
        case ("sweep",) if owners := [
            table
            for table in tables.LAW_TABLES
            if any(name in tables.law_quantities(law) for law in tables.laws_of(table, models).values())
        ]:
            return f"it belongs under [{owners[0]}.KEY], where KEY is that of its law"
        case (table, *_):
            keys = tables.KEYS_BY_TABLE[str(table)]
    return did_you_mean(name, list(keys), KEY_SYNONYMS)
