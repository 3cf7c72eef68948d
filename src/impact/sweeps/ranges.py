"""The entries of an axis: lists and ranges, which are counted before anything is allocated."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np

from .values import Fault, Problem, Quantity, nearest, read_number, refuse, show

MAX_AXIS = 10**7  # values on one axis, which are held in memory
MAX_COUNTED = 10**18  # what a message writes out
MAX_FAULTS = 100  # of one entry; the rest of a hostile list is not worth its time

Kind = Literal["linspace", "geomspace", "arange"]
RANGES: dict[Kind, str] = {
    "linspace": "[first, last, count]",
    "geomspace": "[first, last, count]",
    "arange": "[first, stop, step]",
}


@dataclass(frozen=True)
class Entry:
    """An entry as it was given: a range is not written out yet, so that its points can be counted first."""

    kind: Literal["scalar", "list"] | Kind
    given: tuple[float, ...] | tuple[str, ...]
    size: int = 1


def read_entry(value: object, quantity: Quantity, n: float | None = math.nan) -> Entry:
    """A number, a list of numbers or a range.

    Raises
    ------
    Problem : with every fault of the list or range

    >>> read_entry({"linspace": [0, 1, 3]}, Quantity("1", "restitution", 0, 1))
    Entry(kind='linspace', given=(0.0, 1.0), size=3)
    """
    if isinstance(value, list):
        return read_list(value, lambda item: read_number(item, quantity, n), quantity.wants)
    if isinstance(value, dict):
        return _read_range(value, quantity, n)
    return Entry("scalar", (read_number(value, quantity, n),))


Item = TypeVar("Item", float, str)


def read_list(values: list[object], read: Callable[[object], Item], wants: str) -> Entry:
    """A list, each item of which is read by `read`."""
    if not values:
        raise refuse(values, f"a list of at least one: {wants}")
    found: list[Item] = []
    faults: list[Fault] = []
    for place, value in enumerate(values):
        try:
            found.append(read(value))
        except Problem as problem:
            faults += problem.under(place)
            if len(faults) >= MAX_FAULTS:
                break
    if faults:
        raise Problem(*faults)
    return Entry("list", tuple(found), len(found))


def read_texts(value: object, wants: str = "a list of names", least: int = 1) -> tuple[str, ...]:
    """A list of at least some texts."""
    if not isinstance(value, list) or len(value) < least:
        raise refuse(value, wants)
    return tuple(str(text) for text in read_list(value, _text, wants).given)


def read_groups(value: object) -> list[tuple[str, ...]]:
    """A list of groups of at least two names."""
    if not isinstance(value, list):
        raise refuse(value, 'a list of groups of names, such as [["m1", "m2"]]')
    groups: list[tuple[str, ...]] = []
    faults: list[Fault] = []
    for place, group in enumerate(value[:MAX_FAULTS]):
        try:
            groups.append(read_texts(group, "a group of at least two names", 2))
        except Problem as problem:
            faults += problem.under(place)
    if faults:
        raise Problem(*faults)
    return groups


def read_names(value: object, known: Sequence[str], wants: str) -> Entry:
    """A name or a list of names, all of them known."""

    def read(name: object) -> str:
        if isinstance(name, str) and name in known:
            return name
        raise refuse(name, f"{wants}; {nearest(name, known)}" if isinstance(name, str) else f"the name of {wants}")

    return read_list(value, read, wants) if isinstance(value, list) else Entry("scalar", (read(value),))


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise refuse(value, "a name")
    return value


def _read_range(table: dict[str, object], quantity: Quantity, n: float | None) -> Entry:
    strange = [key for key in table if key not in RANGES]
    if strange:
        raise Problem(*(((key,), f"unknown key; {nearest(key, list(RANGES))}") for key in strange[:MAX_FAULTS]))
    if len(table) != 1:
        got = " and ".join(table) or "an empty table"
        choices = ", ".join(f"{name} = {form}" for name, form in RANGES.items())
        raise Problem(((), f"got {got}, wants one of {choices}"))
    kind = next(name for name in RANGES if name in table)
    given = table[kind]
    if not isinstance(given, list) or len(given) != 3:
        got = f"a list of {len(given)}" if isinstance(given, list) else show(given)
        raise Problem(((kind,), f"got {got}, wants {RANGES[kind]}"))
    end = replace(quantity, infinite=False)
    # what arange stops before, and its step, need not be values themselves
    free = Quantity(quantity.unit, quantity.meaning)
    readers: list[Callable[[object], float]] = [lambda value: read_number(value, end, n)]
    if kind == "arange":
        readers += [lambda value: read_number(value, free, n)] * 2
    else:
        readers += [*readers, _count]
    numbers: list[float] = []
    faults: list[Fault] = []
    for place, (value, read) in enumerate(zip(given, readers, strict=True)):
        try:
            numbers.append(read(value))
        except Problem as problem:
            faults += problem.under(kind, place)
    if faults:
        raise Problem(*faults)
    first, last, third = numbers
    size = _arange_size(first, last, third) if kind == "arange" else int(third)
    if kind == "geomspace" and min(first, last) <= 0 <= max(first, last):
        raise Problem(((kind,), f"got {first:g} to {last:g}, wants two ends of one sign, neither of them 0"))
    if size > MAX_AXIS:
        raise Problem(((kind,), f"got {_counted(size)} values, wants at most {MAX_AXIS:,} on an axis"))
    return Entry(kind, (first, last, third) if kind == "arange" else (first, last), size)


def _count(value: object) -> int:
    whole = int(value) if isinstance(value, float) and value.is_integer() else value
    if isinstance(whole, bool) or not isinstance(whole, int) or whole < 1:
        raise refuse(value, "a whole number of at least 1")
    return whole


def _arange_size(first: float, stop: float, step: float) -> int:
    if step == 0:
        raise Problem((("arange", 2), "got 0, wants a step other than 0"))
    size = (stop - first) / step
    if not size > 0:
        raise Problem((("arange",), f"got no value from {first:g} to {stop:g} by {step:g}, wants at least one"))
    return math.ceil(size) if math.isfinite(size) else 2 * MAX_COUNTED


def _counted(size: int) -> str:
    return f"{size:,}" if size <= MAX_COUNTED else f"more than {MAX_COUNTED:,}"


def written_out(entry: Entry, quantity: Quantity) -> tuple[float, ...]:
    """The values of a range.

    Raises
    ------
    Problem : a range leaves the interval by rounding, overflows, or is finer than numbers are

    >>> written_out(Entry("linspace", (0.0, 1.0), 3), Quantity("1", "restitution", 0, 1))
    (0.0, 0.5, 1.0)
    """
    first, last, *step = (float(number) for number in entry.given)
    with np.errstate(all="ignore"):
        match entry.kind:
            case "linspace":
                values = np.linspace(first, last, entry.size)
            case "geomspace":
                values = np.geomspace(first, last, entry.size)
            case _:
                values = np.arange(first, last, *step)
        same = np.flatnonzero(np.diff(values) == 0)
    if not np.isfinite(values).all():
        raise Problem(((entry.kind,), f"got {first:g} to {last:g}, wants a range that does not overflow"))
    for extreme in (float(values.min()), float(values.max())):
        if not quantity.allows(extreme):
            raise Problem(((entry.kind,), f"got a value {extreme!r}, wants {quantity.wants}"))
    if same.size:
        raise Problem(((entry.kind,), f"got {float(values[same[0]])!r} twice, wants each value once"))
    return tuple((values + 0.0).tolist())


def number_schema(quantity: Quantity) -> dict[str, object]:
    """JSON Schema of a number, bare or with its unit."""
    number: dict[str, object] = {"type": "number"}
    if math.isfinite(quantity.least):
        number["exclusiveMinimum" if quantity.above else "minimum"] = quantity.least
    if math.isfinite(quantity.most):
        number["maximum"] = quantity.most
    unit = "%" if quantity.unit == "1" else quantity.unit
    text = {"type": "string", "pattern": r"^\s*[-+]?([0-9.]|inf)", "examples": [f"1 {unit}"]}
    return {"anyOf": [number, text]}


def entry_schema(quantity: Quantity) -> dict[str, object]:
    """JSON Schema of an entry: a number, a list of numbers or one range."""
    number = number_schema(quantity)
    free = number_schema(Quantity(quantity.unit, quantity.meaning))
    count: dict[str, object] = {"type": "integer", "minimum": 1}
    ranges: dict[Kind, list[dict[str, object]]] = {
        "linspace": [number, number, count],
        "geomspace": [number, number, count],
        "arange": [number, free, free],
    }
    forms = [
        {
            "type": "object",
            "properties": {
                kind: {
                    "type": "array",
                    "prefixItems": items,
                    "minItems": 3,
                    "maxItems": 3,
                    "description": RANGES[kind],
                }
            },
            "required": [kind],
            "additionalProperties": False,
        }
        for kind, items in ranges.items()
    ]
    return {"anyOf": [number, {"type": "array", "items": number, "minItems": 1}, *forms]}
