"""Catalogues: the laws that the modules of a package declare, by key."""

from __future__ import annotations

import copyreg
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType
from typing import Any, TypeVar

from ..errors import ModelError, did_you_mean
from .friction import FrictionLaw
from .model import ForceModel

Law = TypeVar("Law", bound=ForceModel | FrictionLaw)


def declared_laws(package: str, path: Iterable[str], kind: type[Law]) -> list[Law]:
    """Find each instance of a type that is a variable, or in a tuple, of a module of a package."""
    # a module imports the laws that it renames: each is collected once
    laws: dict[int, Law] = {}
    for module in iter_modules(path):
        for value in vars(import_module(f"{package}.{module.name}")).values():
            candidates = value if isinstance(value, tuple) else (value,)
            laws.update((id(law), law) for law in candidates if isinstance(law, kind))
    return list(laws.values())


def by_key(laws: Iterable[Law], noun: str) -> Mapping[str, Law]:
    """Index laws by their keys; two of the same key are an error, which calls them by the noun."""
    indexed: dict[str, Law] = {}
    for law in laws:
        if law.key in indexed:
            raise ModelError(f"{noun} {law.key}: two {noun}s have this key")
        indexed[law.key] = law
    return MappingProxyType(indexed)


def look_up(laws: Mapping[str, Law], key: str, noun: str) -> Law:
    """Return the law of a key; the error for an unknown one names the nearest key."""
    if key not in laws:
        other = other_kind(key, noun)
        raise ModelError(f'no {noun} "{key}"; {f"it is a {other}" if other else did_you_mean(key, list(laws))}')
    return laws[key]


def other_kind(key: str, noun: str) -> str:
    """Return what a key is if not what the noun says, "model" or "friction law", or "".

    >>> other_kind("coulomb-1785", "model"), other_kind("hertz", "friction law"), other_kind("hurtz", "model")
    ('friction law', 'model', '')
    """
    # both import this module
    from .frictions import frictions
    from .models import catalogue

    kinds = {"model": catalogue(), "friction law": frictions()}
    return next((kind for kind, laws in kinds.items() if kind != noun and key in laws), "")


def pickle_by_key(kind: type[Law], find: Callable[[str], Law]) -> None:
    """Let laws of a catalogue be pickled as their keys: their formulas are no functions of a module.

    A law that is read from a file has an attribute `read_again`, the function that does so and its arguments.
    """

    def reduce(law: Law) -> tuple[Any, ...]:
        try:
            is_declared = find(law.key) is law
        except ModelError:
            is_declared = False
        state = (find, (law.key,)) if is_declared else getattr(law, "read_again", object.__reduce_ex__(law, 2))
        assert isinstance(state, tuple)
        return state

    copyreg.pickle(kind, reduce)
