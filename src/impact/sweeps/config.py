"""A config read and checked: from a TOML file or a mapping to a frozen `Config`, or all of its problems."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    WithJsonSchema,
    create_model,
)

from ..contact.collide import BY_DEFAULT
from ..contact.material import Material
from ..contact.model import ForceModel
from ..contact.models import catalogue
from ..errors import ConfigError
from .grid import MAX_POINTS, Axis, chunk_faults, lay_out
from .keys import (
    DEFAULT_TITLE,
    MATERIAL_KEYS,
    OUTPUT_KEYS,
    SOLVER_KEYS,
    SWEEP_KEYS,
    TITLE,
    Context,
    Key,
    key_tree,
    models_key,
    parameter_keys,
    read_exponent,
)
from .places import Places, key_lines
from .problems import faults_of, lines_of
from .rules import DEFAULTS, SWEEP, cross_faults, expand_models, own_quantities
from .settings import DEFAULT_RTOL, Output, Solver
from .source import apply_overrides, load, plain, read_text
from .values import Fault

__all__ = ["DEFAULT_RTOL", "Axis", "Config", "Output", "Solver", "json_schema", "parse_config", "read_config"]


@dataclass(frozen=True)
class Config:
    """A sweep as it was asked for, checked, in SI units.

    Parameters
    ----------
    title : of the sweep
    models : the contact force models, in the order asked for
    scalars : what does not vary, by config name ("v1", "material1", "KEY.name" for a model's parameter),
        with defaults filled in
    axes : the dimensions of the grid in config order, those of models last
    materials : by name
    solver : tolerances
    output : which variables are stored, and how
    text : the TOML text verbatim, or a mapping as JSON
    overrides : PATH=VALUE strings in order; `text` is without them
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


def _table(name: str, keys: Mapping[str, Key | type]) -> type[BaseModel]:
    """A table of these keys, or tables, and no others. They are aliases: not every key could name a field."""
    fields: dict[str, Any] = {}
    for place, (alias, key) in enumerate(keys.items()):
        kind: Any = key
        about, required = "", alias == "sweep"
        if isinstance(key, Key):
            reader = PlainValidator(lambda value, info, read=key.read: read(value, info.context))
            kind = Annotated[Any, reader, WithJsonSchema(dict(key.schema))]
            about, required = key.about, key.required
        default: dict[str, Any] = {} if required else {"default_factory": lambda: None}
        fields[f"field_{place}"] = (kind, Field(alias=alias, description=about or None, **default))
    return create_model(name, __config__=ConfigDict(extra="forbid", strict=True), **fields)


def _root(known: Mapping[str, ForceModel], with_tables: Iterable[str]) -> type[BaseModel]:
    """The whole config: all models by name, and tables for the parameters of some of them."""
    tables: dict[str, Key | type] = {
        "title": TITLE,
        "models": models_key(known),
        "sweep": _table("sweep", SWEEP_KEYS),
        "materials": dict[str, _table("material", MATERIAL_KEYS)],  # type: ignore[misc, dict-item]
        "solver": _table("solver", SOLVER_KEYS),
        "output": _table("output", OUTPUT_KEYS),
        "model": _table("model", {key: _table(key, parameter_keys(known[key])) for key in with_tables}),
    }
    return _table("config", tables)


def json_schema() -> dict[str, object]:
    """JSON Schema (draft 2020-12) of a config, from which editors complete and check.

    >>> json_schema()["required"]
    ['models', 'sweep']
    """
    known = catalogue()
    schema = _root(known, known).model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def read_config(
    source: Path | Mapping[str, object],
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    max_points: int = MAX_POINTS,
) -> Config:
    """The config of a TOML file or a mapping.

    Parameters
    ----------
    source : path of a TOML file, or what such a file says as a mapping
    overrides : strings such as "sweep.e.linspace=[0,1,11]"
    plugins : models that are not built in
    max_points : how many it may have, of all models together; more are refused before there is an array

    Raises
    ------
    ConfigError : with every problem, one a line

    >>> steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    >>> sweep = {"e": [0.5, 1], "v1": 1, "m1": 1, "m2": 1, "material": "steel"}
    >>> read_config({"models": "hertz", "sweep": sweep, "materials": {"steel": steel}}).axes
    (Axis(columns={'e': (0.5, 1.0)}),)
    """
    if not isinstance(source, Mapping):
        return parse_config(read_text(Path(source)), overrides, plugins, str(source), max_points)
    return _checked(source, None, Places("config", overrides=tuple(overrides)), plugins, max_points)


def parse_config(
    text: str,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
    name: str = "<text>",
    max_points: int = MAX_POINTS,
) -> Config:
    """The config of a TOML text, or of a JSON text, which starts with a brace; otherwise as `read_config`."""
    is_json = text.lstrip().startswith("{")
    data = load(text, json.loads if is_json else tomllib.loads, "JSON" if is_json else "TOML", name)
    return _checked(data, text, Places(name, overrides=tuple(overrides)), plugins, max_points)


def _checked(
    source: object, text: str | None, places: Places, plugins: Sequence[ForceModel], max_points: int
) -> Config:
    """The config, or every problem of its overrides and values; `text` is None for a mapping."""
    given, faults = plain(source)
    problems: list[str] = []
    if not faults:
        data, overridden, problems = apply_overrides(given, places.overrides, tomllib.loads)
        places = replace(places, overridden=overridden)
        data, faults = plain(data)
    config = None
    if not faults:
        if text is None:
            text = json.dumps(given, separators=(",", ":"), default=str)
        config, faults = _read(data, catalogue(plugins), text, places.overrides, max_points)
    if config is None or problems:
        if text is not None and not text.lstrip().startswith("{"):
            places = replace(places, lines=key_lines(text))
        raise ConfigError([*lines_of(faults, places), *problems])
    return config


def _read(
    data: Mapping[str, Any],
    known: Mapping[str, ForceModel],
    text: str,
    overrides: tuple[str, ...],
    max_points: int,
) -> tuple[Config | None, list[Fault]]:
    """The config that plain data gives, or what is wrong with it."""
    sweep, materials, own = (_dict(data.get(name)) for name in ("sweep", "materials", "model"))
    models, _ = expand_models(data.get("models"), known)
    context = Context(read_exponent(sweep), tuple(materials), known)
    faults: list[Fault] = []
    try:
        parsed = _values(_root(known, [key for key in own if key in known]).model_validate(data, context=context))
    except ValidationError as error:
        faults += faults_of(error.errors(include_url=False), key_tree(known))
    faults += cross_faults(data, models, context.n)
    swept = [name for name in sweep if name != "zip"]
    # what a model that is not chosen asks for was checked, and is not part of the grid
    chosen = {f"{model.key}.{name}": q for model in models for name, q in own_quantities(model).items()}
    names = [
        *swept,
        *(name for key in own for name in (f"{key}.{one}" for one in _dict(own[key])) if name in chosen),
    ]
    entries = {name: context.entries[name] for name in names if name in context.entries}
    stored = _dict(data.get("output"))
    in_full = stored.get("layout") == "full" or (
        stored.get("layout", "auto") == "auto" and bool(stored.get("chunks"))
    )
    grid = lay_out(entries, SWEEP | chosen, context.groups, swept, len(models), max_points, in_full=in_full)
    faults += grid.faults
    if not faults:
        output = _values(parsed["output"])
        count = len({"status", *(output.get("variables") or BY_DEFAULT)})
        faults += chunk_faults(output.get("chunks") or {}, grid.axes, len(models), count)
        if output.get("chunks") and output.get("layout") == "factored":
            faults.append(
                (("output", "chunks"), 'got chunks beside layout = "factored", expected layout = "full"')
            )
    if faults:
        return None, faults
    defaults = DEFAULTS | {
        f"{model.key}.{one.name}": one.default
        for model in models
        for one in model.parameters
        if one.default is not None
    }
    scalars = {**grid.scalars, **{name: value for name, value in defaults.items() if name not in entries}}
    return Config(
        title=DEFAULT_TITLE if parsed["title"] is None else parsed["title"],
        models=tuple(models),
        scalars=scalars,
        axes=grid.axes,
        materials={name: Material(**_values(table)) for name, table in (parsed["materials"] or {}).items()},
        solver=Solver(**_given(parsed["solver"])),
        output=Output(**_given(parsed["output"])),
        text=text,
        overrides=overrides,
    ), []


def _dict(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _given(table: BaseModel | None) -> dict[str, Any]:
    """Those that were given."""
    return {key: value for key, value in _values(table).items() if value is not None}


def _values(table: BaseModel | None) -> dict[str, Any]:
    """The values of a table by key."""
    fields = {} if table is None else type(table).model_fields
    return {str(info.alias): getattr(table, name) for name, info in fields.items()}
