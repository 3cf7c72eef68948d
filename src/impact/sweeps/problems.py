"""The problems of a config as lines for its user: where, what was got, what is wanted."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .places import Places, path_text
from .rules import MATERIAL, SWEEP, WORDS
from .values import Fault, KeyPath, nearest, show

MAX_LINES = 100
TABLES = {
    "sweep": "a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...",
    "models": 'a model, or a list of models; "all" are all',
}


def faults_of(errors: Iterable[Mapping[str, Any]], known: Mapping[str, object]) -> Iterable[Fault]:
    """The faults in a validator's errors.

    Parameters
    ----------
    errors : pydantic's error details
    known : the keys that each table may have, nested; "*" stands for any name
    """
    for count, error in enumerate(errors):
        path: KeyPath = error["loc"]
        if error["type"] == "value_error":
            yield from (((*path, *at), message) for at, message in error["ctx"]["error"].faults)
        elif error["type"] == "missing":
            yield path, f"missing, wants {_wanted(str(path[-1]))}"
        elif error["type"] == "extra_forbidden":
            # a file of nothing but strange keys is not worth looking for each of them
            hint = nearest(str(path[-1]), _known(path[:-1], known), WORDS) if count < MAX_LINES else ""
            if len(path) == 1 and path[0] in _known(("sweep",), known):
                hint = "it belongs under [sweep]"
            yield path, f"unknown key; {hint}"
        else:
            yield path, f"got {show(error['input'])}, wants a table"


def _wanted(key: str) -> str:
    quantity = SWEEP.get(key) or MATERIAL.get(key)
    return f"{quantity.wants}: {quantity.meaning}" if quantity else TABLES[key]


def _known(path: KeyPath, known: Mapping[str, object]) -> Sequence[str]:
    table: object = known
    for part in path:
        assert isinstance(table, Mapping)
        table = table.get(part, table.get("*", {}))
    assert isinstance(table, Mapping)
    return list(table)


def lines_of(faults: Iterable[Fault], places: Places) -> list[str]:
    """One line for each fault, in the order of the file, then of the overrides."""
    found = sorted(((*places.find(path), path, message) for path, message in faults), key=lambda one: one[0])
    lines = [
        ": ".join(part for part in (place, path_text(path), message) if part) for _, place, path, message in found
    ]
    if len(lines) > MAX_LINES:
        lines[MAX_LINES:] = [f"and {len(lines) - MAX_LINES} more"]
    return lines
