"""The catalogue: every `ForceModel` that is a variable, or in a tuple, of a module of this package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

from ..catalogue import by_key, declared_laws, look_up, pickle_by_key
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
    rank = {family: position for position, family in enumerate(FAMILIES)}
    models = declared_laws(__name__, __path__, ForceModel)
    return tuple(sorted(models, key=lambda m: (rank.get(m.family, len(rank)), m.year, m.key)))


def catalogue(plugins: Sequence[ForceModel] = ()) -> Mapping[str, ForceModel]:
    """Collect all models by key: the built-in ones, then the plug-ins.

    >>> list(catalogue())[:3]
    ['hertz', 'hunt-crossley-1975', 'herbert-mcwhannell-1977']
    """
    return by_key((*_built_in(), *plugins), "model")


def find(key: str, plugins: Sequence[ForceModel] = ()) -> ForceModel:
    """Find the model of a key."""
    return look_up(catalogue(plugins), key, "model")


def original_key(key: str) -> str:
    """Return the key of the law that a key of the catalogue is another name for, else the key itself.

    >>> original_key("liggghts-hertz"), original_key("hertz"), original_key("mine-2026")
    ('tsuji-1992', 'hertz', 'mine-2026')
    """
    model = catalogue().get(key)
    return model.same_as if model is not None and model.same_as else key


pickle_by_key(ForceModel, find)
