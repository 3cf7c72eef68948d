"""The catalogue: every `ForceModel` that is a variable, or in a tuple, of a module of this package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType

from ...errors import ModelError, did_you_mean
from ..model import ForceModel

# families in the order of the paper; other families follow
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
    # a module imports the laws that it renames: each is collected once
    models: dict[int, ForceModel] = {}
    for module in modules:
        for value in vars(module).values():
            candidates = value if isinstance(value, tuple) else (value,)
            models.update((id(model), model) for model in candidates if isinstance(model, ForceModel))
    rank = {family: position for position, family in enumerate(FAMILIES)}
    return tuple(sorted(models.values(), key=lambda m: (rank.get(m.family, len(rank)), m.year, m.key)))


def built_in() -> frozenset[str]:
    """Find the keys of the models that are built in."""
    return frozenset(model.key for model in _built_in())


def catalogue(plugins: Sequence[ForceModel] = ()) -> Mapping[str, ForceModel]:
    """Collect all models by key: the built-in ones, then the plug-ins.

    >>> list(catalogue())[:3]
    ['hertz', 'hunt-crossley-1975', 'herbert-mcwhannell-1977']
    """
    models: dict[str, ForceModel] = {}
    for model in (*_built_in(), *plugins):
        if model.key in models:
            raise ModelError(f"model {model.key}: two models have this key")
        models[model.key] = model
    return MappingProxyType(models)


def find(key: str, plugins: Sequence[ForceModel] = ()) -> ForceModel:
    """Find the model of a key."""
    models = catalogue(plugins)
    if key not in models:
        raise ModelError(f'no model "{key}"; {did_you_mean(key, list(models))}')
    return models[key]
