"""The tables of a config as pydantic models, and the JSON Schema that they make."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal, cast

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationInfo,
    create_model,
)
from pydantic.dataclasses import dataclass
from pydantic_core import PydanticCustomError

from ..contact.model import ForceModel
from ..contact.models import built_in, catalogue
from ..contact.outputs import OUTPUTS
from .quantities import (
    MAX_AXIS_VALUES,
    MAX_FAULTS,
    MAX_UNIT,
    RANGE,
    SCALAR,
    Context,
    Fault,
    Names,
    Numbers,
    Quantity,
    ReadAs,
    Table,
    expected,
    fault,
    faults,
    named,
    names,
    nearest,
    refuse,
    tidy,
    whole,
)

DEFAULT_TITLE = "Impact sweep"
DEFAULT_RTOL = 1e-10
MAX_STEPS = 10**9
CORES = ("auto", "numpy", "numba")
MODELS = 'a model, or a list of models; "all" are all'


MATERIAL_NAME = names("a material of [materials]", lambda info: cast(Context, info.context).materials)
Group = Annotated[
    list[Annotated[str, expected("a name")]], Field(min_length=2), expected("a group of at least two names")
]
CASES = "the name of a CSV file, or a table of lists by config name, such as { v1 = [1.0, 2.0] }"
Cases = Annotated[
    Annotated[str, expected(CASES), Tag(SCALAR)]
    | Annotated[
        dict[str, Annotated[list[float | str], Field(min_length=1), expected("a list of values")]],
        Field(min_length=1),
        expected(CASES),
        Tag(RANGE),
    ],
    Discriminator(lambda value: RANGE if isinstance(value, dict) else SCALAR),
]


def _sweep_schema(schema: dict[str, Any]) -> None:
    """What is asked for may be given in more than one way."""
    tidy(schema)
    ways = (("v1", "cases"), ("m1", "R1", "cases"), ("m2", "R2", "cases"))
    schema["allOf"] = [{"anyOf": [{"required": [key]} for key in keys]} for keys in ways]


class Sweep(Table):
    """What to sweep: single values, and lists and ranges, which are the axes of the grid."""

    model_config = ConfigDict(json_schema_extra=_sweep_schema)

    e: Annotated[Numbers | None, Quantity("1", "coefficient of restitution", least=0, most=1)] = None
    alpha: Annotated[Numbers | None, Quantity("s/m", "slope of e = 1 - alpha v0", least=0)] = None
    v1: Annotated[Numbers | None, Quantity("m/s", "velocity of ball 1 before the impact")] = None
    v2: Annotated[Numbers, Quantity("m/s", "velocity of ball 2 before the impact")] = 0.0
    m1: Annotated[Numbers | None, Quantity("kg", "mass of ball 1", 0, above=True, infinite=True)] = None
    m2: Annotated[Numbers | None, Quantity("kg", "mass of ball 2", 0, above=True, infinite=True)] = None
    R1: Annotated[Numbers | None, Quantity("m", "radius of ball 1", 0, above=True, infinite=True)] = None
    R2: Annotated[Numbers | None, Quantity("m", "radius of ball 2", 0, above=True, infinite=True)] = None
    K: Annotated[Numbers | None, Quantity("N/m^n", "stiffness of the contact, F = K x^n", 0, above=True)] = None
    n: Annotated[Numbers, Quantity("1", "compliance exponent", least=1, most=10)] = 1.5
    material: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of both balls")
    material1: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of ball 1")
    material2: Annotated[Names | None, MATERIAL_NAME] = Field(None, description="material of ball 2")
    zip: Annotated[list[Group], expected('a list of groups of names, such as [["m1", "m2"]]')] = Field(
        default=[], description="groups of axes that vary together"
    )
    cases: Annotated[Any, ReadAs(Cases)] = Field(
        None, description="a CSV file of points, whose columns are config names with units, or a table of lists"
    )


class MaterialTable(Table):
    """A material; its numbers may be axes too."""

    E: Annotated[Numbers, Quantity("Pa", "Young's modulus", 0, above=True)]
    nu: Annotated[Numbers, Quantity("1", "Poisson's ratio", least=-1, most=0.5, above=True)]
    rho: Annotated[Numbers | None, Quantity("kg/m^3", "density", 0, above=True)] = None
    yield_strength: Annotated[Numbers | None, Quantity("Pa", "yield strength", 0, above=True)] = None


def quantities_of(table: type[Table]) -> dict[str, Quantity]:
    """The quantities of a table by key."""
    return {
        name: item
        for name, key in table.model_fields.items()
        for item in key.metadata
        if isinstance(item, Quantity)
    }


SWEEP_QUANTITIES, MATERIAL_QUANTITIES = quantities_of(Sweep), quantities_of(MaterialTable)
MATERIAL_KEYS = {
    name: str(Sweep.model_fields[name].description) for name in ("material", "material1", "material2")
}
DEFAULTS = {name: float(Sweep.model_fields[name].default) for name in ("v2", "n")}
# of a law that has an exponent of its own
OWN_K = Quantity("N/m^n", "stiffness of this law, in place of the sweep's", 0, above=True)


@dataclass(frozen=True, config=ConfigDict(extra="forbid", json_schema_extra=tidy))
class Solver:
    """How impacts are integrated.

    Parameters
    ----------
    rtol : relative tolerance
    max_steps : steps that one impact may take
    collapse : integrate impacts that are the same in the contact's own units once; changes no bit
    core : "numpy"; "numba", which compiles what it can; or "auto", whichever is faster
    """

    rtol: Annotated[float, Quantity("1", "relative tolerance of the integration", 1e-13, 1e-4)] = DEFAULT_RTOL
    max_steps: Annotated[int, whole(1, MAX_STEPS), Field(description="steps that one impact may take")] = 10_000
    collapse: Annotated[
        bool, Field(strict=True, description="integrate impacts that are the same once"), expected("true or false")
    ] = True
    core: Annotated[str, ReadAs(Literal[CORES]), Field(description="NumPy, numba where it can, or the faster")] = (
        "auto"
    )


Variable = Annotated[Literal[*OUTPUTS], named("a variable of the result", lambda info: OUTPUTS)]  # type: ignore[valid-type]


def _listed(value: object) -> object:
    """A list, or nothing, which stands for all; other collections are not converted."""
    if isinstance(value, list | tuple | None) and value != []:
        return value
    raise refuse(value, "a list of names")


@dataclass(frozen=True, config=ConfigDict(extra="forbid", json_schema_extra=tidy))
class Output:
    """What of a result is stored, and how.

    Parameters
    ----------
    variables : of the result, or None for all
    dtype : of its floating-point numbers, "float64" or "float32"; coordinates are float64
    compression : "none" or "gzip"
    chunks : the lengths along the axes, by name, of the chunks in which it is stored; empty for one piece
    layout : "full", all values; "factored", the trajectories, from which they are computed when they are read; or
        "auto", in full up to 10^7 points
    """

    variables: Annotated[
        tuple[Variable, ...] | None,
        BeforeValidator(_listed, json_schema_input_type=Annotated[list[Variable], Field(min_length=1)]),
        Field(description="else all but those stored on request; the status is always among them"),
    ] = None
    dtype: Annotated[
        Literal["float64", "float32"], Field(description="of floating-point variables; coordinates are float64")
    ] = "float64"
    compression: Annotated[Literal["none", "gzip"], Field(description="of the variables")] = "none"
    chunks: Annotated[
        Mapping[str, Annotated[int, whole(1, MAX_AXIS_VALUES)]],
        Field(description="lengths along axes, by name, of the chunks in which variables are stored"),
        expected("a table of lengths by axis, such as { e = 50 }"),
    ] = field(default_factory=dict)
    layout: Annotated[
        Literal["auto", "full", "factored"],
        Field(description="all values, or the trajectories from which they are computed when they are read"),
    ] = "auto"


def model_quantities(model: ForceModel) -> dict[str, Quantity]:
    """What [model.KEY] may hold: the parameters, and K of a law that has an exponent of its own."""
    stiffness = {} if model.exponent is None else {"K": OWN_K}
    return stiffness | {
        parameter.name: Quantity(parameter.unit, parameter.meaning, parameter.least, parameter.most)
        for parameter in model.parameters
    }


def parameter_table(model: ForceModel) -> type[Table]:
    """The table [model.KEY]. Its keys are aliases: not every name of a parameter could name a field."""
    defaults = {parameter.name: parameter.default for parameter in model.parameters}
    fields: dict[str, Any] = {
        f"field_{place}": (Annotated[Numbers | None, quantity, Field(alias=name)], defaults.get(name))
        for place, (name, quantity) in enumerate(model_quantities(model).items())
    }
    return create_model(model.key, __base__=Table, **fields)


def _selected(value: object, info: ValidationInfo) -> tuple[ForceModel, ...]:
    models, found = expand_models(value, cast(Context, info.context).models)
    if found:
        raise faults(found)
    return tuple(models)


class Document(Table):
    """A whole config, without what depends on the catalogue; see `document_type`."""

    # a dataclass is made of a table
    model_config = ConfigDict(strict=False)

    title: Annotated[str, Field(strict=True), expected("text")] = Field(
        DEFAULT_TITLE, description="title of the sweep"
    )
    models: Annotated[tuple[ForceModel, ...], PlainValidator(_selected)] = ()
    sweep: Sweep
    materials: Annotated[dict[str, MaterialTable], expected("a table")] = Field(
        default_factory=dict, description="materials by name"
    )
    solver: Solver = Field(default_factory=lambda: Solver())
    output: Output = Field(default_factory=lambda: Output())
    model: Any = None


def document_type(known: Mapping[str, ForceModel], with_tables: Sequence[str]) -> type[Document]:
    """The type of a whole config: all models by name, and tables for the parameters of some of them."""
    fields: dict[str, Any] = {
        f"field_{place}": (Annotated[parameter_table(known[key]), Field(alias=key)], None)
        for place, key in enumerate(with_tables)
    }
    parameters = create_model("model", __base__=Table, __doc__="Parameters of models, by key.", **fields)
    models = PlainValidator(_selected, json_schema_input_type=_model_names(known))
    about = Field(description='models by name, "all", "family:NAME" or a pattern; after "!" those left out')
    return create_model(
        "config",
        __base__=Document,
        models=(Annotated[Any, models, about], ...),
        model=(parameters, Field(default_factory=parameters)),
    )


def json_schema() -> dict[str, object]:
    """JSON Schema (draft 2020-12) of a config, from which editors complete and check.

    It cannot say what depends on more than one key, but for `required`: the rules of `impact.config.rules`, names
    of materials and columns, numbers of points; nor the dimension and the value of a string with a unit, and the
    size and the overflow of a range.

    >>> json_schema()["required"]
    ['models', 'sweep']
    """
    known = catalogue()
    schema = document_type(known, list(known)).model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def _model_names(known: Mapping[str, ForceModel]) -> Any:
    """The type of the key `models`, with all names, for its JSON Schema."""
    families = {f"family:{model.family}" for model in known.values() if not model.same_as}
    words = (*known, "all", *sorted(families))
    # a pattern holds *, ? or [; no key begins with "!", and "family:" takes no pattern
    pattern = r"(?!!|family:).*[*?\[]"
    name: Any = Literal[words] | Annotated[str, Field(pattern=f"^{pattern}")]
    excluded: Any = Literal[tuple(f"!{word}" for word in words)] | Annotated[str, Field(pattern=f"^!{pattern}")]
    # the first entry of a list has no models before it to leave out
    first: Any = {"allOf": [{"prefixItems": [{"not": {"type": "string", "pattern": "^!"}}]}]}
    return name | Annotated[list[name | excluded], Field(min_length=1, json_schema_extra=first)]


def expand_models(selection: object, known: Mapping[str, ForceModel]) -> tuple[list[ForceModel], list[Fault]]:
    """The models of a key, "all", "family:NAME", a glob or a list of those, less those after "!"; and faults."""
    if not isinstance(selection, str | list) or not selection:
        return [], [((), refuse(selection, MODELS).message())]
    selected: dict[str, ForceModel] = {}
    found: list[Fault] = []
    for place, word in enumerate([selection] if isinstance(selection, str) else selection):
        try:
            if isinstance(word, str) and word.startswith("!"):
                _leave_out(selected, word, known)
            else:
                selected |= _models(word, known)
        except PydanticCustomError as error:
            found.append((() if isinstance(selection, str) else (place,), error.message()))
            if len(found) >= MAX_FAULTS:
                break
    if not selected and not found:
        found.append(((), refuse(selection, "models that are not all left out again").message()))
    return list(selected.values()), found


def _leave_out(selected: dict[str, ForceModel], word: str, known: Mapping[str, ForceModel]) -> None:
    """Take the models of "!..." out of those selected before it."""
    try:
        out = _models(word[1:], known)
    except PydanticCustomError as error:
        raise fault(f"after !: {error.message()}") from None
    if selected.keys().isdisjoint(out):
        raise refuse(word, "models to leave out of those before it")
    for key in out:
        selected.pop(key, None)


def _models(word: object, known: Mapping[str, ForceModel]) -> dict[str, ForceModel]:
    if not isinstance(word, str):
        raise refuse(word, "the name of a model")
    # a law is not run twice because it has two names
    laws = {key: model for key, model in known.items() if not model.same_as}
    if word == "all":
        return {key: model for key, model in laws.items() if key in built_in()}
    if word.startswith("family:"):
        family = word.removeprefix("family:")
        members = {key: model for key, model in laws.items() if model.family == family}
        if not members:
            families = sorted({model.family for model in laws.values()})
            raise refuse(word, f"a family of models; {nearest(family, families)}")
        return members
    if any(letter in word for letter in "*?["):
        matching = {key: model for key, model in known.items() if fnmatchcase(key, word[:MAX_UNIT])}
        if not matching:
            raise refuse(word, "a pattern that some model matches")
        return matching
    if word not in known:
        raise refuse(word, f"a model; {nearest(word, list(known))}")
    return {word: known[word]}
