"""The keys of every table of a config: how each is read, and what an editor is told of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ..contact.collide import OUTPUTS
from ..contact.compiled import is_installed
from ..contact.model import ForceModel
from .ranges import MAX_AXIS, Entry, entry_schema, number_schema, read_entry, read_groups, read_names
from .rules import DEFAULTS, MATERIAL, MATERIALS, REQUIRED, SWEEP, expand_models, own_quantities
from .settings import COMPRESSIONS, CORES, DTYPES, LAYOUTS
from .values import Problem, Quantity, read_number, read_switch, read_whole, refuse

DEFAULT_TITLE = "Impact sweep"
RTOL = Quantity("1", "relative tolerance of the integration", least=1e-13, most=1e-4)
MOST_STEPS = 10**9

Schema = Mapping[str, Any]
TEXTS: Schema = {"type": "array", "items": {"type": "string"}, "minItems": 1}
GROUPS: Schema = {"type": "array", "items": {**TEXTS, "minItems": 2}}
CHUNKS: Schema = {"type": "object", "additionalProperties": {"type": "integer", "minimum": 1}}
STEPS: Schema = {"type": "integer", "minimum": 1, "maximum": MOST_STEPS}


@dataclass(frozen=True)
class Context:
    """What values depend on besides themselves, and the entries and zip groups that could be read.

    `n` is the sweep's exponent: None where it is an axis, NaN where it cannot be read.
    """

    n: float | None
    materials: tuple[str, ...]
    known: Mapping[str, ForceModel]
    entries: dict[str, Entry] = field(default_factory=dict)
    groups: list[tuple[str, ...]] = field(default_factory=list)


@dataclass(frozen=True)
class Key:
    """A key whose value is made by `read`, which raises `Problem`; an editor is told the rest."""

    read: Callable[[Any, Context], object]
    schema: Schema
    about: str
    required: bool = False


def number_key(name: str, quantity: Quantity) -> Key:
    """A key that is a number, and cannot be an axis."""
    schema = number_schema(quantity)
    return Key(lambda value, _: read_number(value, quantity), schema, quantity.about, name in REQUIRED)


def entry_key(name: str, quantity: Quantity, own_n: float | None = None, default: float | None = None) -> Key:
    """A key that may be an axis; its entry is kept in the context under its config name.

    Parameters
    ----------
    name, quantity : what it is
    own_n : the exponent in its unit, where it is not the sweep's
    default : its value where it is not given
    """

    def read(value: object, context: Context) -> Entry:
        entry = read_entry(value, quantity, context.n if own_n is None else own_n)
        context.entries[name] = entry
        return entry

    schema = entry_schema(quantity) | ({} if default is None else {"default": default})
    return Key(read, schema, quantity.about, name in REQUIRED)


def _material_key(name: str, about: str) -> Key:
    def read(value: object, context: Context) -> Entry:
        entry = read_names(value, context.materials, "a material of [materials]")
        context.entries[name] = entry
        return entry

    return Key(read, {"anyOf": [{"type": "string"}, TEXTS]}, about)


def _groups(value: object, context: Context) -> None:
    context.groups.extend(read_groups(value))


def _title(value: object, _: Context) -> str:
    if not isinstance(value, str):
        raise refuse(value, "text")
    return value


def _models(value: object, context: Context) -> list[ForceModel]:
    models, faults = expand_models(value, context.known)
    if faults:
        raise Problem(*faults)
    return models


def models_key(known: Mapping[str, ForceModel]) -> Key:
    """The key `models`, of which an editor is told all names."""
    families = {f"family:{model.family}" for model in known.values() if not model.same_as}
    names = [*known, "all", *sorted(families)]
    # a pattern holds *, ? or [; no key begins with "!", and "family:" takes no pattern
    pattern = r"(?!!|family:).*[*?\[]"
    name = {"anyOf": [{"enum": names}, {"type": "string", "pattern": f"^{pattern}"}]}
    excluded = [{"enum": [f"!{word}" for word in names]}, {"type": "string", "pattern": f"^!{pattern}"}]
    # the first entry of a list has no models before it to leave out
    models = {"type": "array", "prefixItems": [name], "items": {"anyOf": [name, *excluded]}, "minItems": 1}
    schema = {"anyOf": [name, models]}
    return Key(_models, schema, 'models by name, "all", "family:NAME" or a pattern', required=True)


def parameter_keys(model: ForceModel) -> dict[str, Key]:
    """The keys of [model.KEY]."""
    defaults = {one.name: one.default for one in model.parameters}
    return {
        name: entry_key(f"{model.key}.{name}", quantity, model.exponent, defaults.get(name))
        for name, quantity in own_quantities(model).items()
    }


def _word_key(words: tuple[str, ...], about: str) -> Key:
    """A key that is one of some words, of which the first is the default."""

    def read(value: object, _: Context) -> str:
        if value not in words:
            raise refuse(value, f"one of {', '.join(words)}")
        return str(value)

    return Key(read, {"enum": list(words), "default": words[0]}, about)


def _chunks(value: object, _: Context) -> dict[str, int]:
    if not isinstance(value, dict):
        raise refuse(value, "a table of lengths by axis, such as { e = 50 }")
    found, faults = {}, []
    for name, length in value.items():
        try:
            found[str(name)] = read_whole(length, 1, MAX_AXIS)
        except Problem as problem:
            faults += problem.under(str(name))
    if faults:
        raise Problem(*faults)
    return found


CORE = _word_key(CORES, "what integrates: NumPy, numba where it can, or whichever is sooner done")


def _core(value: object, context: Context) -> object:
    core = CORE.read(value, context)
    if core == "numba" and not is_installed():
        raise refuse(value, 'numba, which is not installed (pip install "impact-sweep[fast]"), or "auto"')
    return core


TITLE = Key(_title, {"type": "string", "default": DEFAULT_TITLE}, "title of the sweep")
SWEEP_KEYS = {
    **{name: entry_key(name, quantity, default=DEFAULTS.get(name)) for name, quantity in SWEEP.items()},
    **{name: _material_key(name, about) for name, about in MATERIALS.items()},
    "zip": Key(_groups, GROUPS, "groups of axes that vary together"),
}
MATERIAL_KEYS = {name: number_key(name, quantity) for name, quantity in MATERIAL.items()}
SOLVER_KEYS = {
    "rtol": number_key("rtol", RTOL),
    "max_steps": Key(lambda value, _: read_whole(value, 1, MOST_STEPS), STEPS, "steps that one impact may take"),
    "collapse": Key(
        lambda value, _: read_switch(value), {"type": "boolean"}, "integrate impacts that are the same once"
    ),
    "core": replace(CORE, read=_core),
}
OUTPUT_KEYS = {
    "variables": Key(
        lambda value, _: read_names(value, OUTPUTS, "a variable of the result").given,
        {"type": "array", "items": {"enum": list(OUTPUTS)}, "minItems": 1},
        "variables of the result, else all but those stored on request; the status is always among them",
    ),
    "dtype": _word_key(DTYPES, "of the floating-point variables; coordinates are float64"),
    "compression": _word_key(COMPRESSIONS, "of the variables"),
    "layout": _word_key(
        LAYOUTS, "all values, or the trajectories from which they are computed when they are read"
    ),
    "chunks": Key(_chunks, CHUNKS, "lengths along axes, by name, of the chunks in which variables are stored"),
}


def read_exponent(sweep: Mapping[str, object]) -> float | None:
    """The sweep's n, which the unit of K contains: None for an axis, NaN where it cannot be read."""
    try:
        entry = read_entry(sweep.get("n", DEFAULTS["n"]), SWEEP["n"])
    except Problem:
        return math.nan
    return float(entry.given[0]) if entry.kind == "scalar" else None


def key_tree(known: Mapping[str, ForceModel]) -> dict[str, Any]:
    """The keys of every table, nested, for the hint beside an unknown one; "*" is any name."""
    parameters = {key: dict.fromkeys(own_quantities(model)) for key, model in known.items()}
    tables = {
        "sweep": SWEEP_KEYS,
        "materials": {"*": MATERIAL_KEYS},
        "solver": SOLVER_KEYS,
        "output": OUTPUT_KEYS,
    }
    return {"title": {}, "models": {}, **tables, "model": parameters}
