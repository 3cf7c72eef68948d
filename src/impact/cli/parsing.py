"""Types of options and arguments: parsing and validation."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import typer

from ..formatting import safe_text


class NamedValue(NamedTuple):
    """A word NAME=VALUE; a tolerance of all has the name "all"."""

    name: str
    value: Any


def parse_setting(word: str) -> NamedValue:
    """Parse NAME=VALUE; a value that reads as a number is one.

    >>> parse_setting("m2=1e3"), parse_setting("material=steel")
    (NamedValue(name='m2', value=1000.0), NamedValue(name='material', value='steel'))
    """
    name, _, value = word.partition("=")
    if not name or not value:
        raise invalid_value(word, "NAME=VALUE, such as m2=1.0")
    try:
        return NamedValue(name, float(value))
    except ValueError:
        return NamedValue(name, value)


def parse_target(word: str) -> NamedValue:
    """Parse NAME=NUMBER, where the number may be in percent.

    >>> parse_target("e_out=0.6")
    NamedValue(name='e_out', value=0.6)
    """
    name, _, text = word.partition("=")
    value = _float_or_nan(text)
    if not name or math.isnan(value):
        raise invalid_value(word, "NAME=NUMBER, such as e_out=0.6")
    return NamedValue(name, value)


def parse_range(word: str) -> NamedValue:
    """Parse NAME=FIRST:LAST:COUNT, evenly spaced values, or NAME=VALUES with a TOML list or range.

    >>> parse_range("v1=0.1:3:30")
    NamedValue(name='v1', value={'linspace': [0.1, 3, 30]})
    >>> parse_range("v1={geomspace = [0.1, 3, 30]}").value, parse_range("m2=[1.0, 2.0]").value
    ({'geomspace': [0.1, 3, 30]}, [1.0, 2.0])
    """
    from ..config.files import read_value

    name, _, text = word.partition("=")
    parts = text.split(":")
    values = read_value(text if len(parts) != 3 else f"{{linspace = [{', '.join(parts)}]}}")
    if not name or not isinstance(values, list | dict):
        raise invalid_value(word, "NAME=FIRST:LAST:COUNT, such as v1=0.1:3:30, or NAME=[VALUE, ...]")
    return NamedValue(name, values)


def parse_tolerance(word: str) -> NamedValue:
    """Parse VALUE or NAME=VALUE, where VALUE may be in percent.

    >>> parse_tolerance("1e-8"), parse_tolerance("v1_post=5%")
    (NamedValue(name='all', value=1e-08), NamedValue(name='v1_post', value=0.05))
    """
    name, _, value = word.rpartition("=")
    read = _float_or_nan(value)
    if math.isnan(read):
        raise invalid_value(word, "VALUE or NAME=VALUE, such as 1e-8, 5% or v1_post=1e-6")
    return NamedValue(name or "all", read)


def reject_duplicates(settings: list[NamedValue] | None) -> list[NamedValue] | None:
    """Raise an error if a name occurs twice among the values of a repeated option."""
    names = [name for name, _ in settings or ()]
    for name in names:
        if names.count(name) > 1:
            raise typer.BadParameter(f"got {name} twice, expected each name once")
    return settings


def parse_whole_number(word: str | int) -> int:
    """Parse a whole number of at least 1; a default, which is a number, too.

    >>> parse_whole_number("8"), parse_whole_number("1e9")
    (8, 1000000000)
    """
    read = _float_or_nan(str(word))
    if not (read >= 1.0 and read.is_integer()):
        raise invalid_value(word, "a whole number of at least 1, such as 8 or 1e9")
    return int(read)


def parse_number(word: str | float) -> float:
    """Parse a number, which may be in percent; a default, which is one, too.

    >>> parse_number("0.02"), parse_number("5%")
    (0.02, 0.05)
    """
    read = _float_or_nan(str(word))
    if math.isnan(read):
        raise invalid_value(word, "a number, such as 0.02 or 2%")
    return read


def invalid_value(word: object, expected: str) -> typer.BadParameter:
    """The error of an invalid word."""
    return typer.BadParameter(f'got "{safe_text(str(word))}", expected {expected}')


def _float_or_nan(word: str) -> float:
    """A number, which may be in percent; NaN where a word is none."""
    try:
        return float(word.removesuffix("%")) / (100.0 if word.endswith("%") else 1.0)
    except ValueError:
        return math.nan
