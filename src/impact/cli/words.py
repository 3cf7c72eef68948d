"""Words in and out of a command: numbers, NAME=VALUE options, and JSON."""

from __future__ import annotations

import json
import math
from typing import Any

import typer

from ..errors import UsageError
from ..text import safe_text


def whole_number(given: str | int) -> int:
    """A whole number of at least 1, as a person writes it; a default, which is a number, too.

    >>> whole_number("8"), whole_number("1e9")
    (8, 1000000000)
    """
    found = _value(given)
    if not (found >= 1.0 and found.is_integer()):
        raise _refused(given, "a whole number of at least 1, such as 8 or 1e9")
    return int(found)


def number(given: str | float) -> float:
    """A number, as a person writes it; a default, which is one, too."""
    found = _value(given)
    if math.isnan(found):
        raise _refused(given, "a number, such as 8 or 0.02")
    return found


def _value(given: str | float) -> float:
    try:
        return float(given)
    except ValueError:
        return math.nan


def _refused(given: str | float, wants: str) -> typer.BadParameter:
    return typer.BadParameter(f'got "{safe_text(str(given))}", wants {wants}')


def pairs(option: str, words: list[str] | None) -> dict[str, float | str]:
    """NAME=VALUE options; a value that reads as a number is one."""
    found: dict[str, float | str] = {}
    for word in words or ():
        name, equals, value = word.partition("=")
        if not equals or not name or not value:
            raise UsageError(f"{option} {safe_text(word)}: wants NAME=VALUE, such as {option} m2=1.0")
        if name in found:
            raise UsageError(f"{option} {safe_text(name)}: given twice")
        try:
            found[name] = float(value)
        except ValueError:
            found[name] = value
    return found


def tolerances(words: list[str] | None) -> dict[str, float] | None:
    """VALUE for all variables, NAME=VALUE for one; None where none is given."""
    found: dict[str, float] = {}
    for word in words or ():
        name, _, value = word.rpartition("=")
        name = name or "all"
        if name in found:
            raise UsageError(f"--tol {safe_text(word)}: the second one for {safe_text(name)}, wants one")
        try:
            found[name] = float(value)
        except ValueError:
            wants = "wants VALUE or NAME=VALUE, such as --tol 1e-8 or --tol v1_post=1e-6"
            raise UsageError(f"--tol {safe_text(word)}: {wants}") from None
    return found or None


def dump(value: Any) -> str:
    """Strict JSON in ASCII: what is not a number is null, and a wall's mass is "inf"."""

    def plain(one: Any) -> Any:
        match one:
            case float():
                return one if abs(one) < float("inf") else None if one != one else str(one)
            case dict():
                return {str(name): plain(inner) for name, inner in one.items()}
            case list() | tuple():
                return [plain(inner) for inner in one]
        return one

    return json.dumps(plain(value), allow_nan=False)
