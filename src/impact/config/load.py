"""Read and check a config: from a TOML file or a mapping to a frozen `Config`, or a list of all problems."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.numba.dispatch import is_installed
from ..contact.outputs import BY_DEFAULT
from ..contact.timestep import EXACT
from ..errors import ConfigError
from .cases import expand_cases, inline_files, named_files
from .design import design_problems, distribution_paths, draw_columns, unit_samples
from .files import (
    apply_overrides,
    as_table,
    override_text,
    parse_document,
    read_override,
    read_text,
    to_plain_data,
)
from .grid import MAX_POINTS, Axis, build_grid, chunk_problems
from .input_names import InputName
from .library import library
from .lines import SourceLocations, key_lines, problem_lines, validation_problems
from .measurements import (
    Measurements,
    count_problems,
    expand_measurements,
    fit_paths,
    inline_measurements,
    purpose_problems,
)
from .quantities import (
    Column,
    ConfigProblem,
    Distribution,
    FitRange,
    KeyPath,
    Names,
    Numbers,
    Range,
    Table,
    ValidationContext,
)
from .rules import RawConfig, listed_names, rule_problems
from .tables import (
    DEFAULT_RTOL,
    FIXED_STEP_DEFAULTS,
    MATERIAL_KEYS,
    SWEEP_DEFAULTS,
    SWEEP_QUANTITIES,
    Design,
    Document,
    MaterialTable,
    Output,
    Solver,
    document_type,
    expand_models,
    json_schema,
)

__all__ = [
    "DEFAULT_RTOL",
    "Axis",
    "Config",
    "Measurements",
    "Output",
    "Purpose",
    "Solver",
    "json_schema",
    "parse_config",
    "read_config",
]

# what a config is read for: only a calibration has measurements and parameters to fit, only a sweep has axes
Purpose = Literal["sweep", "calibrate"]


@dataclass(frozen=True)
class Config:
    """A valid config of a sweep or of a calibration, in SI units.

    Parameters
    ----------
    title : of the sweep
    models : the contact force models, in config order
    scalars : values that do not vary, by config name ("v1", "material1", "KEY.name" for a parameter of a model),
        including defaults; a mass or radius that is not in the config is derived from the other and the density.
        A parameter to fit has a value between its bounds here, and an input that is measured its first value
    axes : the dimensions of the grid in config order: those of [sweep], of materials ("materials.steel.E"), of
        models
    materials : by name, including the library materials that the config uses; a property that is an axis or fitted
        is NaN for E and nu, and None for rho and yield_strength
    solver : tolerances and core
    output : which variables are stored, and how
    text : the TOML text verbatim, or a mapping as JSON, without overrides
    overrides : PATH=VALUE strings in order: first the library materials that the config uses, then those of the
        caller, then the values of the CSV files that the config names. So text and overrides define the config
        without the library or any file
    fits : the least and the largest value of each parameter to fit, by config name; empty for a sweep
    data : the measurements to which they are fitted; None for a sweep
    design : how the samples of uncertain inputs are drawn; None without any
    distributions : of the uncertain inputs, by config name; their drawn values are an axis
    files : the CSV files that were read
    """

    title: str
    models: tuple[ForceModel, ...]
    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    materials: Mapping[str, Material]
    solver: Solver
    output: Output
    text: str
    overrides: tuple[str, ...]
    fits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    data: Measurements | None = None
    design: Design | None = None
    distributions: Mapping[str, Distribution] = field(default_factory=dict)
    files: tuple[Path, ...] = field(default=(), repr=False, compare=False)


def read_config(
    source: Path | Mapping[str, object],
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    max_points: int = MAX_POINTS,
    purpose: Purpose = "sweep",
) -> Config:
    """Read the config of a TOML file or a mapping.

    Parameters
    ----------
    source : path of a TOML file, or a mapping with the same keys; the names of CSV files are relative to the
        folder of the TOML file, or for a mapping to the working directory
    overrides : strings such as "sweep.e.linspace=[0,1,11]"
    plugins : models that are not built in
    max_points : limit of the points of all models together, checked before any array is allocated
    purpose : "sweep" refuses measurements and parameters to fit; "calibrate" requires them and refuses axes

    Raises
    ------
    ConfigError : with all problems, one per line

    >>> steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    >>> sweep = {"e": [0.5, 1], "v1": 1, "m1": 1, "m2": 1, "material": "steel"}
    >>> read_config({"models": "hertz", "sweep": sweep, "materials": {"steel": steel}}).axes
    (Axis(columns={'e': (0.5, 1.0)}, numbered='', numbers=()),)
    """
    reader = _Reader(catalogue(plugins), tuple(overrides), max_points, Path(), purpose)
    if isinstance(source, Mapping):
        return reader.read(source, None, "config")
    path = Path(source)
    text = read_text(path)
    return replace(reader, folder=path.parent).read(parse_document(text, str(path)), text, str(path))


def parse_config(
    text: str,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    name: str = "<text>",
    max_points: int = MAX_POINTS,
    purpose: Purpose = "sweep",
) -> Config:
    """Read the config of a TOML text, or of a JSON text, which starts with a brace; see `read_config`.

    No file is read, because the text may come from a result of unknown origin.
    """
    reader = _Reader(catalogue(plugins), tuple(overrides), max_points, None, purpose)
    return reader.read(parse_document(text, name), text, name)


@dataclass(frozen=True)
class _Reader:
    """Reads one config.

    Parameters
    ----------
    models : all models by key
    overrides, max_points, purpose : see `read_config`
    folder : of the files that the config names; None if no file may be read
    """

    models: Mapping[str, ForceModel]
    overrides: tuple[str, ...]
    max_points: int
    folder: Path | None
    purpose: Purpose

    def read(self, source: object, text: str | None, name: str) -> Config:
        """Read a config, or report every problem of its overrides, files and values.

        Parameters
        ----------
        source : data of the config
        text : of the file; None for a mapping
        name : of the source, for messages
        """
        source_data, problems = to_plain_data(source)
        locations, config = SourceLocations(name), None
        override_problems: list[str] = []
        file_problems: list[str] = []
        if not problems:
            overrides = (*_library_overrides(source_data, self.overrides), *self.overrides)
            data, overridden, override_problems = apply_overrides(source_data, overrides)
            locations = SourceLocations(name, overrides=overrides, overridden=overridden)
            data, problems = to_plain_data(data)
            if self.purpose == "sweep":
                problems = problems or purpose_problems(data)
        if not problems:
            if text is None:
                text = json.dumps(source_data, separators=(",", ":"), default=str)
            n = read_exponent(as_table(data.get("sweep")))
            files = tuple((self.folder or Path()) / file for file in named_files(data))
            data, file_overrides, file_problems = inline_files(data, self.folder, self.models, n)
            data, data_overrides, data_problems = inline_measurements(data, self.folder, self.models, n)
            file_problems += data_problems
            config, problems = self._build_config(data, text, (*overrides, *file_overrides, *data_overrides))
        if config is None or override_problems or file_problems:
            if text is not None and not text.lstrip().startswith("{"):
                locations = replace(locations, lines=key_lines(text))
            raise ConfigError(*problem_lines(problems, locations), *file_problems, *override_problems)
        return replace(config, files=files)

    def _build_config(
        self, data: Mapping[str, Any], text: str, overrides: Sequence[str]
    ) -> tuple[Config | None, list[ConfigProblem]]:
        """The config of plain data, or None and the problems of the data."""
        data, library_overrides = _add_library_materials(data)
        data, cases, problems = expand_cases(data, self.models)
        n = read_exponent(as_table(data.get("sweep")))
        data, measurements, data_problems = expand_measurements(data, self.models, n)
        problems += data_problems
        sweep, parameters = as_table(data.get("sweep")), as_table(data.get("model"))
        n = None if measurements is not None and "n" in measurements.inputs else n
        models, _ = expand_models(data.get("models"), self.models)
        integrator = as_table(data.get("solver")).get("integrator", EXACT)
        raw = RawConfig(
            sweep, as_table(data.get("materials")), parameters, models, data.get("models"), n, integrator
        )
        context = ValidationContext(n, tuple({**raw.materials, **library()}), self.models)
        document, invalid_values = self._validate(data, context)
        problems += invalid_values
        if isinstance(data.get("sweep"), dict):
            problems += rule_problems(raw)
        if "cases" in sweep or ("data" in data and measurements is None):
            # cases and measurements that cannot be read may contain the inputs that seem to be missing
            problems = [(path, message) for path, message in problems if not message.startswith("missing")]
        if document is None:
            return None, _locate_in_cases(problems, cases)
        values = _valid_values(document, raw)
        fits = {name: value.fit for name, value in values.items() if isinstance(value, FitRange)}
        values = {name: value.middle if isinstance(value, FitRange) else value for name, value in values.items()}
        if self.purpose == "calibrate":
            problems += _calibration_problems(data, values, fits, are_valid=not invalid_values)
            values = {name: value for name, value in values.items() if isinstance(value, float | str)}
        else:
            problems += design_problems(data)
        optional = {name: InputName.parse(name).quantity(self.models) for name in values}
        quantities = {name: quantity for name, quantity in optional.items() if quantity is not None}
        output = document.output
        distributions = {name: value for name, value in values.items() if isinstance(value, Distribution)}
        if distributions and document.design is not None:
            u = unit_samples(document.design, len(distributions))
            drawn, draw_problems = draw_columns(distributions, quantities, u)
            problems += [(InputName.parse(name).path, message) for name, message in draw_problems.items()]
            values |= {name: tuple(column.tolist()) for name, column in drawn.items()}
        grid = build_grid(
            values,
            quantities,
            document.sweep.zip if self.purpose == "sweep" else (),
            tuple(cases) if self.purpose == "sweep" else (),
            tuple(distributions),
            raw.names,
            len(models),
            self.max_points,
            in_full=output.layout == "full" or (output.layout == "auto" and bool(output.chunks)),
        )
        problems += grid.problems
        if not problems:
            problems += _settings_problems(document, grid.axes, len(models))
        if not problems and measurements is not None:
            problems += count_problems(measurements, fits, models)
        if problems:
            return None, _locate_in_cases(problems, cases)
        fixed_step_defaults = {} if document.solver.integrator == EXACT else FIXED_STEP_DEFAULTS
        defaults = {**SWEEP_DEFAULTS, **fixed_step_defaults} | {
            f"{model.key}.{parameter.name}": parameter.default
            for model in models
            for parameter in model.parameters
            if parameter.default is not None
        }
        return Config(
            title=document.title,
            models=tuple(models),
            scalars={
                **grid.scalars,
                **{name: column[0] for name, column in (measurements.inputs if measurements else {}).items()},
                **{name: value for name, value in defaults.items() if name not in values},
            },
            axes=grid.axes,
            materials={name: _build_material(table) for name, table in document.materials.items()},
            solver=document.solver,
            output=output,
            text=text,
            overrides=(*library_overrides, *overrides),
            fits=fits,
            data=measurements,
            design=document.design,
            distributions=distributions,
        ), []

    def _validate(
        self, data: Mapping[str, Any], context: ValidationContext
    ) -> tuple[Document | None, list[ConfigProblem]]:
        """The validated document, and problems; with problems it is the document of the valid part, or None."""
        with_tables = [key for key in as_table(data.get("model")) if key in self.models]
        document = document_type(self.models, with_tables)
        try:
            return document.model_validate(data, context=context), []
        except ValidationError as error:
            problems = list(validation_problems(error, self.models))
        valid_part = _remove_invalid(data, [path for path, _ in problems])
        try:
            return document.model_validate(valid_part, context=context), problems
        except ValidationError:
            return None, problems


def read_exponent(sweep: Mapping[str, Any]) -> float | None:
    """The exponent n of [sweep], which the unit of K contains: None if it varies, NaN where it cannot be read."""
    n = sweep.get("n", SWEEP_DEFAULTS["n"])
    if isinstance(n, list | dict) or "n" in as_table(sweep.get("cases")):
        return None
    try:
        return SWEEP_QUANTITIES["n"].read(n)
    except PydanticCustomError:
        return math.nan


def _library_overrides(data: Mapping[str, Any], overrides: Sequence[str]) -> list[str]:
    """Overrides that define the library materials of which other overrides change a property."""
    paths = [path for path, _ in map(read_override, overrides) if path[:1] == ("materials",)]
    names = dict.fromkeys(str(path[1]) for path in paths if len(path) > 2)
    return [
        override_text(("materials", name), library()[name])
        for name in names
        if _is_from_library(name, data) and ("materials", name) not in paths
    ]


def _is_from_library(name: str, data: Mapping[str, Any]) -> bool:
    """Whether a material is in the library, and no table of the config replaces it."""
    return name in library() and name not in as_table(data.get("materials"))


def _add_library_materials(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The data with tables for the library materials that a ball may have, and overrides that add those tables."""
    sweep = as_table(data.get("sweep"))
    cases = as_table(sweep.get("cases")) | as_table(as_table(data.get("data")).get("columns"))
    names = dict.fromkeys(
        name for key in MATERIAL_KEYS for table in (sweep, cases) for name in listed_names(table.get(key))
    )
    names |= {name.material: None for name in map(InputName.parse, cases) if name.material}
    materials = {
        # a column of cases or of measurements replaces a property
        name: {key: value for key, value in library()[name].items() if f"materials.{name}.{key}" not in cases}
        for name in names
        if _is_from_library(name, data) and isinstance(data.get("materials", {}), dict)
    }
    extended = {**data, "materials": {**data.get("materials", {}), **materials}} if materials else dict(data)
    return extended, [override_text(("materials", name), properties) for name, properties in materials.items()]


def _remove_invalid(data: Mapping[str, Any], paths: Sequence[KeyPath]) -> dict[str, Any]:
    """The data without the keys that have problems, and without materials that lack a property.

    [solver] and [output] are removed whole, of other tables the key, and of [model.KEY] the parameter.
    """
    lengths = {"solver": 1, "output": 1, "model": 3}
    invalid = {path[: lengths.get(str(path[0]), 2)] for path in paths if path}

    def valid_part(value: Any, path: KeyPath) -> Any:
        if not isinstance(value, dict) or len(path) > 2:
            return value
        return {
            key: valid_part(inner, (*path, key)) for key, inner in value.items() if (*path, key) not in invalid
        }

    valid_data: dict[str, Any] = valid_part(data, ())
    return valid_data


def _valid_values(document: Document, raw: RawConfig) -> dict[str, Numbers | Names]:
    """The valid values by config name: keys of [sweep], varying or fitted properties of balls, and parameters."""
    sweep = _values_by_key(document.sweep)
    values = {name: sweep[name] for name in raw.sweep if name in sweep and name not in ("zip", "cases")}
    used_materials = {name for ball in "12" for name in raw.materials_of(ball)}
    for material, table in document.materials.items():
        for name, value in _values_by_key(table).items() if material in used_materials else ():
            if not isinstance(value, float):
                values[f"materials.{material}.{name}"] = value
    tables = _values_by_key(document.model)
    selected = {model.key for model in raw.models}
    for key in raw.parameters:
        # parameters of models that are not selected are checked, but are not part of the grid
        parameters = _values_by_key(tables.get(key)) if key in selected else {}
        values |= {f"{key}.{name}": value for name, value in parameters.items()}
    # a file that is left cannot be read
    return {name: value for name, value in values.items() if not _names_file(value)}


def _names_file(value: Numbers | Names) -> bool:
    return isinstance(value, Column) or (isinstance(value, Distribution) and isinstance(value.empirical, str))


def _values_by_key(table: Table | None) -> dict[str, Any]:
    """The values that are set in a table, by key, in the order of definition."""
    if table is None:
        return {}
    fields = type(table).model_fields
    return {fields[name].alias or name: getattr(table, name) for name in fields if name in table.model_fields_set}


def _build_material(table: MaterialTable) -> Material:
    """The material of a table, without the properties that are axes."""
    numbers = {name: value for name, value in _values_by_key(table).items() if isinstance(value, float)}
    return Material(**({"E": math.nan, "nu": math.nan} | numbers))


def _calibration_problems(
    data: Mapping[str, Any],
    values: Mapping[str, Numbers | Names],
    fits: Mapping[str, tuple[float, float]],
    *,
    are_valid: bool,
) -> list[ConfigProblem]:
    """Problems of a calibration: no measurements, no parameter to fit, or axes.

    Parameters
    ----------
    data : plain data of the config
    values : valid values by config name; parameters to fit have one
    fits : bounds of the parameters to fit
    are_valid : no value has a problem of its own; otherwise a fit may be missing because of it
    """
    problems: list[ConfigProblem] = []
    single = "expected a single value, a column of [data] or { fit = [least, most] }"
    if "data" not in data:
        problems.append(
            (("data",), 'missing, expected a table [data] of measurements, such as file = "drops.csv"')
        )
    if not fits and not list(fit_paths(data)):
        problems.append((("sweep",), "got no parameter to fit, expected at least one { fit = [least, most] }"))
    elif not fits and are_valid:
        problems += [
            (path, "got a fit, expected a value: no model and no ball of this config uses it")
            for path in fit_paths(data)
        ]
    for name, value in values.items():
        if isinstance(value, tuple | Range):
            problems.append((InputName.parse(name).path, f"got an axis, {single}"))
    uncertain = next(distribution_paths(data), ("design",) if "design" in data else ())
    if uncertain:
        problems.append((uncertain, "got an uncertain input, which impact sweep and impact sensitivity take"))
    if as_table(data.get("sweep")).get("zip"):
        problems.append((("sweep", "zip"), f"got axes that vary together, {single} for each name"))
    return problems


def _settings_problems(document: Document, axes: Sequence[Axis], n_models: int) -> list[ConfigProblem]:
    """Problems of [solver] and [output] with the rest of the config, or with the installed packages."""
    output = document.output
    problems: list[ConfigProblem] = []
    if document.solver.core == "numba" and not is_installed():
        expected = 'numba, which is not installed (pip install "impact-sweep[fast]"), or "auto"'
        problems.append((("solver", "core"), f'got "numba", expected {expected}'))
    n_variables = len({"status", *(output.variables or BY_DEFAULT)})
    problems += chunk_problems(output.chunks, axes, n_models, n_variables)
    if output.chunks and output.layout == "factored":
        message = 'set together with layout = "factored", expected layout = "full"'
        problems.append((("output", "chunks"), message))
    return problems


def _locate_in_cases(problems: Sequence[ConfigProblem], cases: Mapping[str, str]) -> list[ConfigProblem]:
    """The problems, with paths inside `sweep.cases` for inputs that are columns there.

    Parameters
    ----------
    problems : with the paths that the columns have after `expand_cases`
    cases : names of the columns by config name
    """

    def located(path: KeyPath) -> KeyPath:
        length = 2 if path[:1] == ("sweep",) else 3
        column = cases.get(str(InputName.of_path(path[:length]))) if len(path) >= length else None
        return path if column is None else ("sweep", "cases", column, *path[length:])

    return [(located(path), message) for path, message in problems]
