"""The tables of a config as pydantic models, and their JSON Schema."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import field
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, cast, get_args

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic.dataclasses import dataclass
from pydantic_core import PydanticCustomError

from ..atomic import write_file
from ..contact.catalogue import other_kind
from ..contact.fixed_step import EXACT, MAX_STEPS_PER_CONTACT, SCHEMES
from ..contact.friction import FrictionLaw
from ..contact.frictions import frictions
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..contact.variables import OUTPUTS
from ..errors import did_you_mean
from .quantities import (
    COLUMN,
    LIST,
    MAX_AXIS_VALUES,
    MAX_PROBLEMS,
    MAX_UNIT_LENGTH,
    RANGE,
    SCALAR,
    Column,
    ConfigProblem,
    DecimalKey,
    Names,
    Numbers,
    Quantity,
    SeparatorKey,
    Table,
    ValidationContext,
    bounded_int,
    expected,
    known_name,
    list_of,
    located_errors,
    mismatch_error,
    read_as,
    schema_simplifier,
    value_error,
    value_form,
)

DEFAULT_TITLE = "Impact sweep"
DEFAULT_RTOL = 1e-10
MAX_SOLVER_STEPS = 10**9
CORES = ("auto", "numpy", "numba")
INTEGRATORS = (EXACT, *SCHEMES)
Noise = Literal["given", "scale", "excess"]
# how a residual counts, see `scipy.optimize.least_squares`
Loss = Literal["linear", "huber", "cauchy"]
NOISES, LOSSES = get_args(Noise), get_args(Loss)
MISSING_ROWS = ("skip", "error")
# m/s^2, as scipy.constants.g
STANDARD_GRAVITY = 9.80665
GRAVITY = Quantity("m/s^2", "acceleration that turns heights and flight times into velocities", 0, above=True)
DESIGN_METHODS = ("sobol", "lhs", "halton", "random")
MAX_SAMPLES = 2**22
LAWS_EXPECTED = {
    "model": 'a model, or a list of models; "all" are all',
    "friction law": 'a friction law, or a list of friction laws; "all" are all but those of one scheme',
}
L = TypeVar("L", ForceModel, FrictionLaw)
Flag = Annotated[bool, Field(strict=True), expected("true or false")]


MATERIAL_EXPECTED = "a material of [materials]"
MaterialName: Any = Annotated[
    str, known_name(MATERIAL_EXPECTED, lambda info: cast(ValidationContext, info.context).materials)
]
MATERIAL_NAME = read_as(
    Annotated[
        Annotated[MaterialName, Tag(SCALAR)]
        | Annotated[list_of(MaterialName, MATERIAL_EXPECTED), Tag(LIST)]
        | Annotated[Column, Tag(COLUMN)],
        Discriminator(lambda value: form if (form := value_form(value)) in (LIST, COLUMN) else SCALAR),
    ]
)
ZipGroup = Annotated[
    list[Annotated[str, expected("a name")]], Field(min_length=2), expected("a group of at least two names")
]


def _lists_by_name(value: Any) -> Any:
    """Build the type of lists of values by name."""
    values: Any = Annotated[list[value], Field(min_length=1), expected("a list of values")]
    return Annotated[dict[str, values], Field(min_length=1)]


# those of measurements, in which values may be missing; or headers of a file by name
CellsByName: Any = _lists_by_name(
    Annotated[Any, read_as(float | str | None), expected("a number, a text, or nothing where a value is missing")]
)
HeadersByName = Annotated[dict[str, Annotated[str, expected("a header of the file")]], Field(min_length=1)]
DATA_COLUMNS_EXPECTED = (
    "a table of lists by name, such as { v1 = [1.0, 2.0], e_out = [0.8, 0.7] }, or of headers of a file, "
    'such as { e_out = "Restitution" }'
)


DataColumns = Annotated[
    Annotated[CellsByName, expected(DATA_COLUMNS_EXPECTED), Tag(RANGE)]
    | Annotated[HeadersByName, expected(DATA_COLUMNS_EXPECTED), Tag(SCALAR)],
    Discriminator(lambda value: SCALAR if isinstance(value, dict) and str in map(type, value.values()) else RANGE),
]
CASES_EXPECTED = "the name of a CSV file, or a table of lists by config name, such as { v1 = [1.0, 2.0] }"


class CasesFile(Table):
    """A CSV file of cases; reading replaces it by the lists of its values."""

    file: Annotated[str, expected("the name of a CSV file")] = Field(description="CSV file")
    separator: SeparatorKey = Field(None, description="of columns, where it is not recognised")
    decimal: DecimalKey = Field(None, description="sign, where it is not recognised")


CaseLists: Any = _lists_by_name(float | str)
CasesTable = Annotated[
    Annotated[str, expected(CASES_EXPECTED), Tag(SCALAR)]
    | Annotated[CaseLists, expected(CASES_EXPECTED), Tag(RANGE)]
    | Annotated[CasesFile, Tag(COLUMN)],
    Discriminator(
        lambda value: (
            (COLUMN if isinstance(value.get("file"), str) else RANGE) if isinstance(value, dict) else SCALAR
        )
    ),
]


RIGHT_ANGLE = 0.5 * math.pi
INERTIA = "moment of inertia over m R^2, 0.4 for a solid sphere and inf for one that does not turn, of ball"


class Sweep(Table):
    """What to sweep: single values, and lists and ranges, which are the axes of the grid."""

    e: Annotated[Numbers | None, Quantity("1", "coefficient of restitution", least=0, most=1)] = None
    alpha: Annotated[Numbers | None, Quantity("s/m", "slope of e = 1 - alpha v0", least=0)] = None
    v1: Annotated[Numbers | None, Quantity("m/s", "velocity of ball 1 before the impact")] = None
    v2: Annotated[Numbers, Quantity("m/s", "velocity of ball 2 before the impact")] = 0.0
    m1: Annotated[Numbers | None, Quantity("kg", "mass of ball 1", 0, above=True, infinite=True)] = None
    m2: Annotated[Numbers | None, Quantity("kg", "mass of ball 2", 0, above=True, infinite=True)] = None
    R1: Annotated[Numbers | None, Quantity("m", "radius of ball 1", 0, above=True, infinite=True)] = None
    R2: Annotated[Numbers | None, Quantity("m", "radius of ball 2", 0, above=True, infinite=True)] = None
    angle: Annotated[
        Numbers | None, Quantity("rad", "angle of the impact from the normal", 0, RIGHT_ANGLE, below=True)
    ] = None
    speed: Annotated[
        Numbers | None, Quantity("m/s", "relative speed of an oblique impact, in place of v1", 0, above=True)
    ] = None
    u1: Annotated[Numbers | None, Quantity("m/s", "tangential velocity of ball 1 before the impact")] = None
    u2: Annotated[Numbers | None, Quantity("m/s", "tangential velocity of ball 2 before the impact")] = None
    omega1: Annotated[Numbers | None, Quantity("rad/s", "spin of ball 1 before the impact")] = None
    omega2: Annotated[Numbers | None, Quantity("rad/s", "spin of ball 2 before the impact")] = None
    inertia_factor1: Annotated[Numbers | None, Quantity("1", f"{INERTIA} 1", 0, above=True, infinite=True)] = None
    inertia_factor2: Annotated[Numbers | None, Quantity("1", f"{INERTIA} 2", 0, above=True, infinite=True)] = None
    mu: Annotated[Numbers | None, Quantity("1", "coefficient of friction", 0)] = None
    K: Annotated[Numbers | None, Quantity("N/m^n", "stiffness of the contact; F = K x^n", 0, above=True)] = None
    n: Annotated[Numbers, Quantity("1", "compliance exponent", least=1, most=10)] = 1.5
    steps_per_contact: Annotated[
        Numbers | None,
        Quantity(
            "1", "fixed steps in the contact time of the continuous law", 0, MAX_STEPS_PER_CONTACT, above=True
        ),
    ] = None
    dt: Annotated[Numbers | None, Quantity("s", "fixed time step", 0, above=True)] = None
    phase: Annotated[
        Numbers | None, Quantity("1", "part of the first step in which the balls touch", 0, 1, above=True)
    ] = None
    material: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of both balls")
    material1: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of ball 1")
    material2: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of ball 2")
    zip: Annotated[list[ZipGroup], expected('a list of groups of names, such as [["m1", "m2"]]')] = Field(
        default=[], description="groups of axes that vary together"
    )
    cases: Annotated[Any, read_as(CasesTable)] = Field(
        None, description="a CSV file of points, whose columns are config names with units, or a table of lists"
    )


class MaterialTable(Table):
    """A material; its numbers may be axes too."""

    E: Annotated[Numbers, Quantity("Pa", "Young's modulus", 0, above=True)]
    nu: Annotated[Numbers, Quantity("1", "Poisson's ratio", least=-1, most=0.5, above=True)]
    rho: Annotated[Numbers | None, Quantity("kg/m^3", "density", 0, above=True)] = None
    yield_strength: Annotated[Numbers | None, Quantity("Pa", "yield strength", 0, above=True)] = None


def quantities_of(table: type[Table]) -> dict[str, Quantity]:
    """Find the quantities of a table by key."""
    return {
        name: annotation
        for name, field in table.model_fields.items()
        for annotation in field.metadata
        if isinstance(annotation, Quantity)
    }


SWEEP_QUANTITIES, MATERIAL_QUANTITIES = quantities_of(Sweep), quantities_of(MaterialTable)
MATERIAL_KEYS = {
    name: str(Sweep.model_fields[name].description) for name in ("material", "material1", "material2")
}


# of the options `--tol`
TOLERANCE = Quantity("1", "largest accepted difference, relative", 0, above=True)
SWEEP_DEFAULTS = {name: float(Sweep.model_fields[name].default) for name in ("v2", "n")}
# inputs of an integrator with a fixed step only, and their defaults
FIXED_STEP_INPUTS = ("steps_per_contact", "dt", "phase")
FIXED_STEP_DEFAULTS = {"phase": 0.5}
# inputs of oblique impacts, which need a friction law, and the defaults of some
OBLIQUE_INPUTS = ("angle", "speed", "u1", "u2", "omega1", "omega2", "inertia_factor1", "inertia_factor2", "mu")
OBLIQUE_DEFAULTS = {"omega1": 0.0, "omega2": 0.0, "inertia_factor1": 0.4, "inertia_factor2": 0.4}
# K of a model with a fixed exponent
LAW_STIFFNESS = Quantity("N/m^n", "stiffness of this law, in place of the sweep's", 0, above=True)


@dataclass(frozen=True, config=ConfigDict(extra="forbid", json_schema_extra=schema_simplifier()))
class Solver:
    """How impacts are integrated."""

    rtol: Annotated[float, Quantity("1", "relative tolerance of the integration", 1e-13, 1e-4)] = DEFAULT_RTOL
    max_steps: Annotated[int, bounded_int(1, MAX_SOLVER_STEPS)] = Field(
        default=10_000, description="steps that one impact may take"
    )
    collapse: Flag = Field(default=True, description="integrate impacts that are the same once")
    core: Annotated[str, read_as(Literal[CORES])] = Field(
        default="auto", description="NumPy, numba where it can, or the faster"
    )
    integrator: Annotated[
        str, read_as(Literal[INTEGRATORS]), known_name("an integrator", lambda info: INTEGRATORS)
    ] = Field(default=EXACT, description="the continuous law with error control, or a scheme with a fixed step")


OutputVariable = Annotated[Literal[*OUTPUTS], known_name("a variable of the result", lambda info: tuple(OUTPUTS))]  # type: ignore[valid-type]


def _list_or_none(value: object) -> object:
    """Accept a list, or None, which means all; other collections are not converted to lists."""
    if isinstance(value, list | tuple | None) and value != []:
        return value
    raise mismatch_error(value, "a list of names")


@dataclass(frozen=True, config=ConfigDict(extra="forbid", json_schema_extra=schema_simplifier()))
class Output:
    """What of a result is stored, and how."""

    variables: Annotated[
        tuple[OutputVariable, ...] | None,
        BeforeValidator(
            _list_or_none, json_schema_input_type=Annotated[list[OutputVariable], Field(min_length=1)]
        ),
    ] = Field(default=None, description="else all but those stored on request; the status is always among them")
    dtype: Literal["float64", "float32"] = Field(
        default="float64", description="of floating-point variables; coordinates are float64"
    )
    compression: Literal["none", "gzip"] = Field(default="none", description="of the variables")
    chunks: Annotated[
        Mapping[str, Annotated[int, bounded_int(1, MAX_AXIS_VALUES)]],
        Field(description="lengths along axes, by name, of the chunks in which variables are stored"),
        expected("a table of lengths by axis, such as { e = 50 }"),
    ] = field(default_factory=dict)
    layout: Literal["auto", "full", "factored"] = Field(
        default="auto",
        description="all values, or the trajectories from which they are computed when they are read",
    )

    @property
    def is_full(self) -> bool:
        """Whether all points are stored, whatever their number."""
        return self.layout == "full" or (self.layout == "auto" and bool(self.chunks))


# least standard deviation and largest measured value, in SI: squares of their ratio overflow beyond them
MIN_SIGMA, MAX_MEASURED = 1e-30, 1e100


# what is measured of a ball that falls on a body at rest, and what follows from it
LABORATORY = {
    "drop_height": (Quantity("m", "height of the drop", 0.0, MAX_MEASURED, above=True), ("v1",)),
    "rebound_height": (Quantity("m", "height of the rebound", 0.0, MAX_MEASURED), ("e_out",)),
    "flight_time": (Quantity("s", "time between two impacts", 0.0, MAX_MEASURED, above=True), ("v1", "e_out")),
}


DEVIATION = Quantity("1", "standard deviation", MIN_SIGMA, MAX_MEASURED)


def _sigma(value: object) -> object:
    """Check a standard deviation or a list of them; their unit is that of an output, see `measurements`."""
    deviations = value if isinstance(value, list) and value else [value]
    if isinstance(value, dict) and "fit" in value:
        raise value_error(
            'got a fit, expected noise = "scale", which estimates sigma, or "excess", which adds to it'
        )
    if any(not isinstance(each, str) and math.isnan(DEVIATION.read_or_nan(each)) for each in deviations):
        expectation = f"{DEVIATION.expected} in the unit of the output, or a list of one for each point"
        raise mismatch_error(value, expectation)
    return value


_Sigma: Any = Annotated[float, Field(ge=MIN_SIGMA, le=MAX_MEASURED)] | str


class Data(Table):
    """Measurements, to which `impact calibrate` fits the parameters that have bounds."""

    # the measurements are in a file or in the config
    model_config = ConfigDict(
        json_schema_extra=schema_simplifier(anyOf=[{"required": ["file"]}, {"required": ["columns"]}])
    )

    file: Annotated[Any, read_as(str), expected("the name of a CSV file")] = Field(
        None, description="CSV file, whose columns are inputs and outputs with units, and standard deviations"
    )
    columns: Annotated[Any, read_as(DataColumns)] = Field(
        None, description="the values, by name, or the headers of columns of the file"
    )
    separator: SeparatorKey = Field(None, description="of the columns of the file, where it is not recognised")
    decimal: DecimalKey = Field(None, description="sign of the file, where it is not recognised")
    missing: Annotated[
        Any, read_as(Literal[MISSING_ROWS]), known_name("what becomes of rows", lambda info: MISSING_ROWS)
    ] = Field(None, description="a row without a value is left out (skip, the default), or an error")
    g: Annotated[float, GRAVITY] = STANDARD_GRAVITY
    fit: Flag = Field(False, description="fit all parameters of the laws, and e, that the config does not have")
    lines: Annotated[
        Any, read_as(list[Annotated[int, bounded_int(1)]]), expected("a list of the numbers of lines")
    ] = Field(None, description="the line of each point in the file, if the values are in columns")
    noise: Annotated[Any, read_as(Noise), known_name("a kind of noise", lambda info: NOISES)] = Field(
        None,
        description="the standard deviations are given, have a common factor (scale), or an excess variance is "
        "added to theirs; excess by default with a column of specimens, given with standard deviations, "
        "otherwise scale",
    )
    loss: Annotated[Any, read_as(Loss), known_name("a loss", lambda info: LOSSES)] = Field(
        None, description="how a residual counts: squared (linear), or less beyond one standard deviation"
    )
    sigma: Annotated[
        Any, PlainValidator(_sigma, json_schema_input_type=_Sigma | Annotated[list[_Sigma], Field(min_length=1)])
    ] = Field(None, description="standard deviation of the first output, or a list of them")


class Design(Table):
    """How many samples of uncertain inputs are drawn, and by which method."""

    method: Annotated[
        str, read_as(Literal[DESIGN_METHODS]), known_name("a method", lambda info: DESIGN_METHODS)
    ] = Field("sobol", description="scrambled Sobol or Halton sequence, Latin hypercube, or independent samples")
    n: Annotated[int, bounded_int(1, MAX_SAMPLES)] = Field(description="samples; a power of two for sobol")
    seed: Annotated[int, bounded_int(0, 2**63 - 1)] = Field(0, description="of the random numbers")

    @model_validator(mode="after")
    def _check_n(self) -> Design:
        problem = power_of_two_problem(self.n, "for sobol")
        if self.method == "sobol" and problem:
            raise located_errors([(("n",), problem)])
        return self


def power_of_two_problem(n: int, purpose: str) -> str:
    """Name the two next powers of two, unless n is one; `purpose` says why it should be."""
    nearest = f"{1 << (n.bit_length() - 1)} or {1 << n.bit_length()}"
    return f"got {n}, expected a power of two {purpose}: {nearest}" if n & (n - 1) else ""


def law_quantities(law: ForceModel | FrictionLaw) -> dict[str, Quantity]:
    """List the quantities of [model.KEY] or [friction.KEY]: the parameters, and K of a model with its own n."""
    has_own_n = isinstance(law, ForceModel) and law.exponent is not None
    return ({"K": LAW_STIFFNESS} if has_own_n else {}) | {
        p.name: Quantity(p.unit, p.meaning, p.least, p.most, words=p.choices, default=p.default)
        for p in law.parameters
    }


def _table_type(name: str, parameters: ParameterTable) -> type[Table]:
    """Create the type of [model.KEY] or [friction.KEY]; keys are aliases, as not every name can name a field."""
    fields: dict[str, Any] = {}
    for index, (key, quantity) in enumerate(parameters):
        kind = Annotated[Any, _words(quantity)] if quantity.words else Annotated[Numbers | None, quantity]
        fields[f"field_{index}"] = (Annotated[kind, Field(alias=key)], quantity.default)
    return create_model(name, __base__=Table, **fields)


def _words(quantity: Quantity) -> Any:
    """Build the type of a word, or a list of words, whose value is the position of the word."""

    def read(value: object) -> float | tuple[float, ...]:
        if not isinstance(value, list) or not value:
            return quantity.read(value)
        wrong = [(index, word) for index, word in enumerate(value) if word not in quantity.words]
        if wrong:
            raise located_errors(
                ((index,), mismatch_error(word, quantity.expected).message())
                for index, word in wrong[:MAX_PROBLEMS]
            )
        return tuple(map(quantity.read, value))

    word: Any = Literal[quantity.words]
    schema = Annotated[word | Annotated[list[word], Field(min_length=1)], Field(description=quantity.meaning)]
    return PlainValidator(read, json_schema_input_type=schema)


def _check_laws(value: object, info: ValidationInfo) -> object:
    """Check the key `models` or `frictions`, of which `Draft` lists the laws."""
    if info.field_name == "frictions":
        _, problems = expand_laws(value, frictions(), "friction law")
    else:
        _, problems = expand_laws(value, cast(ValidationContext, info.context).models)
    if problems:
        raise located_errors(problems)
    return value


class Document(Table):
    """A whole config, except for the parts that depend on the catalogue; see `document_type`."""

    # not strict: the dataclasses Solver and Output are built from tables
    model_config = ConfigDict(strict=False)

    title: Annotated[str, Field(strict=True), expected("text")] = Field(
        DEFAULT_TITLE, description="title of the sweep"
    )
    models: Any = None
    frictions: Any = None
    sweep: Sweep
    materials: Annotated[dict[str, MaterialTable], expected("a table")] = Field(
        default_factory=dict, description="materials by name"
    )
    solver: Solver = Field(default_factory=lambda: Solver())
    output: Output = Field(default_factory=lambda: Output())
    data: Annotated[Any, read_as(Data)] = Field(None, description="measurements, for impact calibrate only")
    design: Annotated[Any, read_as(Design)] = Field(
        None, description="samples of the inputs that are distributions"
    )
    model: Any = None
    friction: Any = None


KEYS_BY_TABLE: Mapping[str, Iterable[str]] = {
    "sweep": Sweep.model_fields,
    "design": Design.model_fields,
    "data": Data.model_fields,
    "solver": vars(Solver()),
    "output": vars(Output()),
}
# tables of the parameters of laws, and what the keys that choose the laws, `models` and `frictions`, contain
LAW_TABLES = {
    "model": 'models by name, "all", "family:NAME" or a pattern; after "!" those left out',
    "friction": "friction laws, as models: each model is paired with each of them",
}
# the key and the quantity of each parameter
ParameterTable = tuple[tuple[str, Quantity], ...]


def laws_of(table: str, models: Mapping[str, ForceModel]) -> Mapping[str, ForceModel | FrictionLaw]:
    """The laws whose parameters the table [model] or [friction] of a config may have, by key."""
    return frictions() if table == "friction" else models


def document_type(
    models: Mapping[str, ForceModel], with_tables: Mapping[str, Iterable[str]] | None = None
) -> type[Document]:
    """Build the type of a whole config, in which some laws, by default all, have a table of parameters."""
    names, tables = [], []
    for name in LAW_TABLES:
        laws = laws_of(name, models)
        keys = laws if with_tables is None else [key for key in with_tables[name] if key in laws]
        families = {f"family:{m.family}" for m in laws.values() if isinstance(m, ForceModel) and not m.same_as}
        # the words that choose laws
        names.append((*laws, "all", *sorted(families)))
        tables.append(tuple((key, tuple(law_quantities(laws[key]).items())) for key in keys))
    return _document_type(tuple(names), tuple(tables))


# each point of a result that is integrated again has the config of its sweep
@lru_cache(maxsize=32)
def _document_type(
    names: tuple[tuple[str, ...], ...], tables: tuple[tuple[tuple[str, ParameterTable], ...], ...]
) -> type[Document]:
    """Build it from the words that choose laws, and the tables of parameters by key, for each of LAW_TABLES."""
    for table in (Sweep, MaterialTable, Data, Design):
        # built once; the type of each config then contains it
        table.model_rebuild()
    fields: dict[str, Any] = {}
    for (name, description), words, parameters_of in zip(LAW_TABLES.items(), names, tables, strict=True):
        # a contact force and a friction law may have one key
        prefix = "friction_" if name == "friction" else ""
        columns: dict[str, Any] = {
            f"field_{index}": (Annotated[_table_type(prefix + key, parameters), Field(alias=key)], None)
            for index, (key, parameters) in enumerate(parameters_of)
        }
        meaning = f"Parameters of {'friction laws' if name == 'friction' else 'models'}, by key."
        parameters_type = create_model(name, __base__=Table, __doc__=meaning, **columns)
        selection = PlainValidator(_check_laws, json_schema_input_type=_selection_type(words))
        default = ... if name == "model" else ()
        fields[f"{name}s"] = Annotated[Any, selection, Field(description=description)], default
        fields[name] = parameters_type, Field(default_factory=parameters_type)
    return create_model("config", __base__=Document, **fields)


def schema(output: str | Path | None = None, *, overwrite: bool = False) -> dict[str, Any]:
    """Describe a config by a JSON Schema (draft 2020-12), from which editors complete and check it.

    Except for required keys, it does not cover conditions between keys: the rules of `impact.config.rules`, names
    of materials and columns, numbers of points. Nor does it cover the dimension and value of a string with a unit,
    and the size and overflow of a range.

    Parameters
    ----------
    output : file to write it to as well
    overwrite : replace the output if it exists

    Returns
    -------
    dict : the schema

    Raises
    ------
    UsageError : the output exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact
    >>> impact.schema()["required"]
    ['models', 'sweep']
    """
    models = catalogue()
    # these inputs have alternative keys; measurements may contain them
    alternatives = (("v1", "speed", "cases"), ("m1", "R1", "cases"), ("m2", "R2", "cases"))
    required = [{"anyOf": [{"required": [key]} for key in keys]} for keys in alternatives]
    content = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **document_type(models).model_json_schema(),
        "if": {"not": {"required": ["data"]}},
        "then": {"properties": {"sweep": {"allOf": required}}},
    }
    if output is not None:
        text = json.dumps(content, indent=2) + "\n"
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return content


def _selection_type(words: tuple[str, ...]) -> Any:
    """Create the type of a choice of laws: words, patterns, and after "!" those left out."""
    # a pattern contains *, ? or [; no key begins with "!", and "family:" takes no pattern
    pattern = r"(?!!|family:).*[*?\[]"
    name: Any = Literal[words] | Annotated[str, Field(pattern=f"^{pattern}")]
    excluded: Any = Literal[tuple(f"!{word}" for word in words)] | Annotated[str, Field(pattern=f"^!{pattern}")]
    # the first element of a list cannot exclude models, since none precede it
    first: Any = {"allOf": [{"prefixItems": [{"not": {"type": "string", "pattern": "^!"}}]}]}
    return name | Annotated[list[name | excluded], Field(min_length=1, json_schema_extra=first)]


def expand_laws(
    selection: object, laws: Mapping[str, L], what: str = "model"
) -> tuple[list[L], list[ConfigProblem]]:
    """Find the laws of a key, "all", "family:NAME", a pattern, or a list of those, some excluded by "!"."""
    if not isinstance(selection, str | list | ForceModel) or not selection:
        return [], [((), mismatch_error(selection, LAWS_EXPECTED[what]).message())]
    selected: dict[str, L] = {}
    problems: list[ConfigProblem] = []
    for index, word in enumerate(selection if isinstance(selection, list) else [selection]):
        path = (index,) if isinstance(selection, list) else ()
        is_exclusion = isinstance(word, str) and word.startswith("!")
        try:
            matching = _laws_matching(str(word)[1:] if is_exclusion else word, laws, what)
        except PydanticCustomError as error:
            problems.append((path, f"{'after !: ' * is_exclusion}{error.message()}"))
        else:
            if is_exclusion and selected.keys().isdisjoint(matching):
                problems.append((path, mismatch_error(word, f"{what}s to exclude from those before it").message()))
            kept = {key: law for key, law in selected.items() if key not in matching}
            selected = kept if is_exclusion else selected | matching
        if len(problems) >= MAX_PROBLEMS:
            break
    if not selected and not problems:
        problems.append(((), mismatch_error(selection, f"{what}s that are not all left out again").message()))
    return list(selected.values()), problems


def _laws_matching(word: object, laws: Mapping[str, L], what: str) -> dict[str, L]:
    """Find the laws of a key, "all", "family:NAME" or a pattern, by key."""
    if isinstance(word, ForceModel):
        more = "" if word in laws.values() else ", and the law itself among the plugins"
        raise mismatch_error(word, f'its key, "{word.key}"{more}')
    if not isinstance(word, str):
        raise mismatch_error(word, f"the name of a {what}")
    # a law with two names is not run twice
    distinct = {key: law for key, law in laws.items() if not law.same_as and not getattr(law, "scheme", "")}
    if word == "all":
        built_in = catalogue()
        return {key: law for key, law in distinct.items() if isinstance(law, FrictionLaw) or key in built_in}
    if word.startswith("family:") and what == "model":
        family = word.removeprefix("family:")
        members = {key: law for key, law in distinct.items() if getattr(law, "family", "") == family}
        if not members:
            families = sorted({str(getattr(law, "family", "")) for law in distinct.values()})
            raise mismatch_error(word, f"a family of models; {did_you_mean(family, families)}")
        return members
    if any(letter in word for letter in "*?["):
        of_pattern = {key: law for key, law in laws.items() if fnmatchcase(key, word[:MAX_UNIT_LENGTH])}
        # a law of one scheme has to be named where a pattern finds others
        matching = {key: law for key, law in of_pattern.items() if key in distinct or law.same_as} or of_pattern
        if not matching:
            raise mismatch_error(word, f"a pattern that some {what} matches")
        return matching
    if word not in laws:
        other = other_kind(word, what)
        key = "models" if other == "model" else "frictions"
        hint = f"it is a {other}, of the key {key}" if other else did_you_mean(word, list(laws))
        raise mismatch_error(word, f"a {what}; {hint}")
    return {word: laws[word]}
