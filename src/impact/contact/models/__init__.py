"""The catalogue: every `ForceModel` in the modules of this package, by name or in their tuples MODELS."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType

from ...errors import ModelError, did_you_mean
from ...text import safe_text
from ..model import ForceModel

# families in the order of the paper; a family that is not named comes after these
FAMILIES = (
    "elastic",
    "hysteresis",
    "dashpot",
    "rate-dependent",
    "asymmetric",
    "permanent",
    "elastic-plastic",
    "adhesive",
    "codes",
)


@cache
def _built_in() -> tuple[ForceModel, ...]:
    modules = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    values = [v for m in modules for v in (*vars(m).values(), *getattr(m, "MODELS", ()))]
    found = {id(v): v for v in values if isinstance(v, ForceModel)}
    rank = {family: place for place, family in enumerate(FAMILIES)}
    return tuple(sorted(found.values(), key=lambda m: (rank.get(m.family, len(rank)), m.year, m.key)))


def built_in() -> frozenset[str]:
    """The keys of the models that are built in."""
    return frozenset(model.key for model in _built_in())


def catalogue(plugins: Sequence[ForceModel] = ()) -> Mapping[str, ForceModel]:
    """All models by key: the built-in ones, then those given.

    Raises
    ------
    ModelError : two models have the same key

    >>> list(catalogue())[:3]
    ['hertz', 'hunt-crossley-1975', 'herbert-mcwhannell-1977']
    """
    models: dict[str, ForceModel] = {}
    for model in (*_built_in(), *plugins):
        if model.key in models:
            raise ModelError(f"model {model.key}: there are two models of this key")
        models[model.key] = model
    return MappingProxyType(models)


def find(key: str, plugins: Sequence[ForceModel] = ()) -> ForceModel:
    """The model of a key.

    Raises
    ------
    ModelError : there is none; the message names the nearest one
    """
    known = catalogue(plugins)
    if key not in known:
        raise ModelError(f'no model "{safe_text(key)}"; {did_you_mean(key, list(known))}')
    return known[key]
