"""A number of the config, bare or with a unit, checked by itself; and how values are shown in messages."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from fractions import Fraction
from functools import cache, lru_cache
from typing import Any

from ..contact.units import dimension, names_in
from ..errors import did_you_mean
from ..text import safe_text

KeyPath = tuple[str | int, ...]
Fault = tuple[KeyPath, str]

MAX_UNIT = 64  # characters of a string with a unit

NUMBER = re.compile(r"\s*([-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|inf\b|nan\b))\s*(.*?)\s*")
# names with small exponents, one level of brackets: no expression whose value could take long to work out
_POWER = r"(?:\s*(?:\^|\*\*)\s*(?:-?[0-9]{1,2}(?:\.[0-9]{1,6})?|\(-?[0-9]{1,2}(?:[./][0-9]{1,6})?\))|⁻?[⁰¹²³⁴-⁹])?"
_FACTOR = rf"(?:1|[A-Za-zµμΩ°Å%_]+{_POWER})"
_PRODUCT = rf"{_FACTOR}(?:\s*[*/·]\s*{_FACTOR}|\s+{_FACTOR})*+"
UNIT = re.compile(rf"/?\s*{_PRODUCT}(?:\s*[*/]\s*\(\s*{_PRODUCT}\s*\))?")


class Problem(ValueError):
    """What is wrong with an entry: each fault with its place inside the entry."""

    def __init__(self, *faults: Fault) -> None:
        self.faults = faults
        super().__init__(f"{len(faults)} faults")

    def under(self, *path: str | int) -> list[Fault]:
        """The faults, with places that start at a path."""
        return [((*path, *at), message) for at, message in self.faults]


@dataclass(frozen=True)
class Quantity:
    """A number that the config may give.

    Parameters
    ----------
    unit : SI unit, whose exponents may contain n
    meaning : what it is, in words
    least, most : the interval of its values, closed at finite ends
    above : `least` itself is left out
    infinite : inf is a value
    """

    unit: str
    meaning: str
    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    infinite: bool = False

    @property
    def wants(self) -> str:
        """The values it may have, in words.

        >>> Quantity("kg", "mass", least=0, above=True, infinite=True).wants
        'a number above 0 kg, or inf'
        """
        unit = "" if self.unit == "1" else f" {self.unit}"
        low = f"{'above' if self.above else 'of at least'} {self.least:g}"
        match math.isfinite(self.least), math.isfinite(self.most):
            case True, True:
                both = f"{low} and at most" if self.above else f"from {self.least:g} to"
                return f"a number {both} {self.most:g}{unit}"
            case True, False:
                return f"a number {low}{unit}{', or inf' if self.infinite else ''}"
            case False, True:
                return f"a number of at most {self.most:g}{unit}"
        return f"a finite number{unit and ' of'}{unit}"

    @property
    def about(self) -> str:
        """What it is, with its unit."""
        return f"{self.meaning} [{'-' if self.unit == '1' else self.unit}]"

    def allows(self, value: float) -> bool:
        """Whether a number is in the interval."""
        if math.isinf(value) and not self.infinite:
            return False
        return (self.least < value if self.above else self.least <= value) and value <= self.most

    @property
    def exponents(self) -> frozenset[str]:
        """The names that its unit depends on."""
        return names_in(self.unit)


def show(value: object) -> str:
    """A value in a message, short and safe.

    >>> show(True), show(0.5), show("steel"), show([1, 2]), show(16**6000)
    ('true', '0.5', '"steel"', 'a list', 'an integer of 24001 bits')
    """
    match value:
        case bool():
            return str(value).lower()
        case int() if value.bit_length() > 100:
            return f"an integer of {value.bit_length()} bits"
        case int() | float():
            return repr(value)
        case str():
            return '"' + safe_text(value, 60) + '"'
        case list():
            return "a list" if value else "an empty list"
        case dict():
            return "a table" if value else "an empty table"
        case None:
            return "nothing"
    moment = getattr(value, "isoformat", None)
    return safe_text(str(moment()) if callable(moment) else f"a {type(value).__name__}", 60)


def refuse(value: object, wants: str) -> Problem:
    """The problem of a value that is not what it should be."""
    return Problem(((), f"got {show(value)}, wants {wants}"))


def nearest(word: str, known: Sequence[str], words: Mapping[str, str] | None = None) -> str:
    """`did_you_mean` for a key, which also knows other cases and other words.

    >>> nearest("masss1", ["m1", "v1"], {"mass1": "m1"})
    'did you mean "m1"?'
    """
    other = {name.lower(): name for name in known[:1000]} | {w: k for w, k in (words or {}).items() if k in known}
    near = get_close_matches(word[:64].lower(), list(other), n=1, cutoff=0.6)
    if not known:
        return "none is known here"
    return safe_text(did_you_mean(other[near[0]] if near else word[:64], known[:1000]), 800)


def read_number(value: object, quantity: Quantity, n: float | None = math.nan) -> float:
    """The SI value of a number or a string with a unit.

    Parameters
    ----------
    value : what the config gives
    quantity : what it has to be
    n : the exponent that the unit may contain; None where it is an axis, NaN where it is not known

    Raises
    ------
    Problem : it is something else, is not in the interval, or its unit is not of the right dimension

    >>> read_number("56 GPa", Quantity("Pa", "Young's modulus", least=0, above=True))
    56000000000.0
    """
    if isinstance(value, str):
        number = _with_unit(value, quantity, n)
    elif isinstance(value, bool) or not isinstance(value, int | float):
        raise refuse(value, quantity.wants)
    else:
        number = _float(lambda: float(value))
    if not quantity.allows(number):
        raise refuse(value, quantity.wants)
    # -0.0 and 0.0 are one value, and have one label
    return number + 0.0


def read_whole(value: object, least: int, most: int) -> int:
    """A whole number of an interval."""
    if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
        raise refuse(value, f"a whole number from {least:,} to {most:,}")
    return value


def read_switch(value: object) -> bool:
    """True or false, and nothing that could be taken for them."""
    if not isinstance(value, bool):
        raise refuse(value, "true or false")
    return value


def _with_unit(text: str, quantity: Quantity, n: float | None) -> float:
    unit = quantity.unit
    example = "" if quantity.exponents else f', such as "1 {unit}"'
    of_n = f" with n = {n:g}" if quantity.exponents and n is not None else ""
    if len(text) > MAX_UNIT:
        raise refuse(text, f"at most {MAX_UNIT} characters")
    parts = NUMBER.fullmatch(text)
    if parts is None or not parts[2]:
        bare = quantity.wants if unit == "1" else f"{quantity.wants}, bare or with a unit{example}"
        raise refuse(text, bare)
    own = sorted(quantity.exponents - {"n"})
    if own:
        raise refuse(text, f"a bare number: its unit {unit} depends on {' and '.join(own)}")
    if n is None and quantity.exponents:
        raise refuse(text, f"a bare number: its unit {unit} depends on n, which is an axis")
    scale = _scale(parts[2])
    if scale is None:
        wants = "a bare number" if unit == "1" else f"a unit of {unit}{of_n}{example}"
        raise refuse(text, f'{wants}; "{safe_text(parts[2])}" is not a known unit')
    factor, got = scale
    if not (quantity.exponents and n is not None and math.isnan(n)):
        wanted = map(float, dimension(unit, {"n": 0.0 if n is None or math.isnan(n) else n}))
        if got is None or any(abs(a - b) > 1e-9 for a, b in zip(got, wanted, strict=True)):
            raise refuse(text, "a bare number" if unit == "1" else f"a unit of {unit}{of_n}{example}")
    number = float(parts[1])
    if number == 0.0 or not math.isfinite(number):
        return number
    # exact until the last step, so that "35 mm" is 0.035 to the bit
    return _float(lambda: float(Fraction(parts[1]) * factor))


def _float(convert: Callable[[], float]) -> float:
    try:
        return convert()
    except OverflowError:
        return math.inf


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(non_int_type=Fraction)


@lru_cache(maxsize=256)
def _scale(unit: str) -> tuple[Fraction | float, tuple[float, float, float] | None] | None:
    """The factor to SI and the exponents of mass, length and time; these are None for any other dimension."""
    if UNIT.fullmatch(unit) is None:
        return None
    registry = _registry()
    # pint leaves its parser by many kinds of exception (AttributeError, AssertionError, ZeroDivisionError)
    try:
        parsed = registry.parse_units(("1" if unit.startswith("/") else "") + unit)
        # a unit with an offset, or a logarithmic one, is no factor
        if registry.Quantity(Fraction(0), parsed).to_base_units().magnitude != 0:
            return None
        factor, _ = registry.get_base_units(parsed)
        exponents = {str(name): float(power) for name, power in parsed.dimensionality.items()}
    except Exception:
        return None
    known = ("[mass]", "[length]", "[time]")
    if not exponents.keys() <= set(known):
        return factor, None
    mass, length, time = (exponents.get(name, 0.0) for name in known)
    return factor, (mass, length, time)
