"""Numbers of a config as pydantic types: quantities with units and bounds, lists, ranges and columns of files."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from fractions import Fraction
from functools import cache, lru_cache
from typing import Annotated, Any, TypeAlias, cast

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    PlainValidator,
    Tag,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    create_model,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from ..contact.model import ForceModel
from ..contact.units import dimension, names_in
from ..errors import did_you_mean
from ..text import safe_text

KeyPath: TypeAlias = tuple[str | int, ...]
Fault: TypeAlias = tuple[KeyPath, str]

MAX_UNIT = 64  # characters of a string with a unit
MAX_AXIS_VALUES = 10**7  # values on one axis, which are held in memory
MAX_COUNTED = 10**18  # what a message writes out
MAX_FAULTS = 100  # of one list or table
MAX_REFUSED = 1000  # values of a config; the rest of a hostile list is not worth its time

_DIGITS = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
NUMBER = re.compile(rf"\s*([-+]?(?:{_DIGITS}|inf\b|nan\b))\s*(.*?)\s*")
# names with small exponents, one level of brackets: no expression whose value could take long to work out
_SIGNED = r"-?[0-9]{1,2}(?:\.[0-9]{1,6})?"
_POWER = rf"(?:\s*(?:\^|\*\*)\s*(?:{_SIGNED}|\(-?[0-9]{{1,2}}(?:[./][0-9]{{1,6}})?\))|-?[0-9]{{1,2}}|⁻?[⁰¹²³⁴-⁹])?"
_LETTERS = "A-Za-zµμΩ°Å%_"
_FACTOR = rf"(?:1|[{_LETTERS}]+{_POWER})"
_PRODUCT = rf"{_FACTOR}(?:\s*[*/·]\s*{_FACTOR}|\s+{_FACTOR})*+"
UNIT = re.compile(rf"/?\s*{_PRODUCT}(?:\s*[*/]\s*\(\s*{_PRODUCT}\s*\))?")

# tags of the forms that a value may have; no key of a config holds NUL, so that paths can be freed of them
SCALAR, LIST, RANGE, COLUMN = "\0scalar", "\0list", "\0range", "\0column"
RANGES = {
    "linspace": "[first, last, count]",
    "geomspace": "[first, last, count]",
    "arange": "[first, stop, step]",
}


@dataclass
class Context:
    """What values depend on besides themselves.

    Parameters
    ----------
    n : the sweep's exponent: None where it is an axis, NaN where it cannot be read
    materials : names of those that are known
    models : all models by key
    refused : how many values were refused so far
    """

    n: float | None
    materials: tuple[str, ...]
    models: Mapping[str, ForceModel]
    refused: int = 0


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


def refuse(value: object, expected: str) -> PydanticCustomError:
    """The error of a value that is not what it should be."""
    return fault(f"got {show(value)}, expected {expected}")


def fault(message: str) -> PydanticCustomError:
    """An error with a message of its own."""
    return PydanticCustomError("fault", "{message}", {"message": message})


def faults(found: Iterable[Fault]) -> ValidationError:
    """Several errors, each with its path inside the value."""
    errors = [InitErrorDetails(type=fault(message), loc=path, input=None) for path, message in found]
    return ValidationError.from_exception_data("config", errors)


def _refused(info: ValidationInfo, error: PydanticCustomError, value: Any) -> Any:
    """Raise the error; after a thousand in a config return the value, as the config is refused anyway."""
    context: Context | None = info.context
    if context is not None:
        context.refused += 1
        if context.refused > MAX_REFUSED:
            return value
    raise error


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


def expected(text: str) -> WrapValidator:
    """Words for what pydantic refuses about a value as a whole; errors inside it keep theirs.

    >>> from pydantic import TypeAdapter
    >>> TypeAdapter(Annotated[str, expected("text")]).validate_python(3)
    Traceback (most recent call last):
    pydantic_core._pydantic_core.ValidationError: 1 validation error for function-wrap[wrap()]
      got 3, expected text [type=fault, input_value=3, input_type=int]
    """

    def wrap(value: object, handler: Callable[[object], object], info: ValidationInfo) -> object:
        try:
            return handler(value)
        except ValidationError as error:
            if any(not item["loc"] and item["type"] != "fault" for item in error.errors(include_url=False)):
                return _refused(info, refuse(value, text), value)
            raise

    return WrapValidator(wrap)


def named(what: str, known: Callable[[ValidationInfo], Sequence[str]]) -> BeforeValidator:
    """A check that a text is one of some names; the message has the nearest."""

    def check(value: object, info: ValidationInfo) -> str:
        names = known(info)
        if isinstance(value, str) and value in names:
            return value
        words = f"{what}; {nearest(value, names)}" if isinstance(value, str) else f"the name of {what}"
        return str(_refused(info, refuse(value, words), ""))

    return BeforeValidator(check)


def tidy(schema: dict[str, Any]) -> None:
    """The schema of a table without null, which TOML does not have, and with the summary of its docstring."""
    schema["description"] = schema.get("description", "").split("\n")[0]
    for entry in schema.get("properties", {}).values():
        if entry.get("default", 0) is None:
            del entry["default"]


class Table(BaseModel):
    """A table of a config: these keys and no others."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, protected_namespaces=(), json_schema_extra=tidy
    )


@dataclass(frozen=True)
class ReadAs:
    """The annotation of a type that is made when the program runs, so that mypy sees the type of its value."""

    type: Any

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return handler.generate_schema(self.type)


def _whole(value: object) -> object:
    """A whole number that was written as a float, such as 1e6, as JSON has it."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def whole(least: int, most: int | None = None) -> ReadAs:
    """Whole numbers of an interval."""
    words = (
        f"a whole number of at least {least:,}" if most is None else f"a whole number from {least:,} to {most:,}"
    )
    return ReadAs(Annotated[int, Field(ge=least, le=most, strict=True), BeforeValidator(_whole), expected(words)])


class Column(Table):
    """A column of a CSV file; reading replaces it by the list of its values."""

    file: Annotated[str, expected("the name of a CSV file")] = Field(description="CSV file")
    column: Annotated[str, expected("the name of a column")] = Field(description="a name in its first line")


def _one_range(schema: dict[str, Any]) -> None:
    tidy(schema)
    schema.update(minProperties=1, maxProperties=1)


class Range(Table):
    """A range, which is counted before it is written out: exactly one of its fields is given."""

    model_config = ConfigDict(json_schema_extra=_one_range)

    linspace: tuple[float, float, int] | None = None
    geomspace: tuple[float, float, int] | None = None
    arange: tuple[float, float, float] | None = None

    @model_validator(mode="after")
    def _countable(self) -> Range:
        if len(self.model_fields_set) != 1:
            got = " and ".join(name for name in RANGES if name in self.model_fields_set) or "an empty table"
            choices = ", ".join(f"{name} = {form}" for name, form in RANGES.items())
            raise fault(f"got {got}, expected one of {choices}")
        first, last, third = self.numbers
        if self.kind == "geomspace" and min(first, last) <= 0 <= max(first, last):
            raise self._fault(f"got {first:g} to {last:g}, expected two ends of one sign, neither of them 0")
        if self.kind == "arange" and third == 0:
            raise faults([(("arange", 2), "got 0, expected a step other than 0")])
        if self.size < 1:
            raise self._fault(f"got no value from {first:g} to {last:g} by {third:g}, expected at least one")
        if self.size > MAX_AXIS_VALUES:
            size = f"{self.size:,}" if self.size <= MAX_COUNTED else f"more than {MAX_COUNTED:,}"
            raise self._fault(f"got {size} values, expected at most {MAX_AXIS_VALUES:,} on an axis")
        return self

    def _fault(self, message: str) -> ValidationError:
        return faults([((self.kind,), message)])

    @property
    def kind(self) -> str:
        """Name of its field."""
        return next(name for name in RANGES if getattr(self, name) is not None)

    @property
    def numbers(self) -> tuple[float, float, float]:
        numbers: tuple[float, float, float] = getattr(self, self.kind)
        return numbers

    @property
    def size(self) -> int:
        """Number of values."""
        first, last, third = self.numbers
        if self.kind != "arange":
            return int(third)
        size = (last - first) / third
        return max(math.ceil(size), 0) if math.isfinite(size) else 2 * MAX_COUNTED

    def values(self, quantity: Quantity) -> tuple[float, ...]:
        """Its values, those between the ends rounded to 15 significant digits, so that 0.3 is 0.3.

        Raises
        ------
        ValidationError : the range leaves the interval, overflows, or is finer than numbers are

        >>> Range(linspace=(0.0, 1.0, 11)).values(Quantity("1", "restitution", 0, 1))[3]
        0.3
        """
        first, last, third = self.numbers
        with np.errstate(all="ignore"):
            match self.kind:
                case "linspace":
                    array = np.linspace(first, last, int(third))
                case "geomspace":
                    array = np.geomspace(first, last, int(third))
                case _:
                    array = np.arange(first, last, third)
        if not np.isfinite(array).all():
            raise self._fault(f"got {first:g} to {last:g}, expected a range that does not overflow")
        # the ends were typed; the others get 15 significant digits
        inner = slice(1, None if self.kind == "arange" else -1)
        array[inner] = [float(f"{value:.15g}") for value in array[inner].tolist()]
        for extreme in (float(array.min()), float(array.max())):
            if not quantity.allows(extreme):
                raise self._fault(f"got a value {extreme!r}, expected {quantity.expected}")
        same = np.flatnonzero(np.diff(array) == 0)
        if same.size:
            raise self._fault(f"got {float(array[same[0]])!r} twice, expected each value once")
        return tuple((array + 0.0).tolist())


# what a key that may be an axis is read as
Numbers: TypeAlias = float | tuple[float, ...] | Range | Column
Names: TypeAlias = str | tuple[str, ...] | Column


def form_of(value: object) -> str:
    """The tag of the form that a value has: a number or text, a list, a range, or a column of a file."""
    match value:
        case list():
            return LIST
        case {"file": _} | {"column": _}:
            return COLUMN
        case dict() | Range():
            return RANGE
    return SCALAR


def _form_of_names(value: object) -> str:
    form = form_of(value)
    return SCALAR if form == RANGE else form


def _list_of(item: Any, what: str) -> Any:
    """A list of at least one item, as a tuple."""

    def filled(value: list[object]) -> list[object]:
        if not value:
            raise refuse(value, f"a list of at least one: {what}")
        return value

    return Annotated[list[item], Field(min_length=1), BeforeValidator(filled), AfterValidator(tuple)]


def names(what: str, known: Callable[[ValidationInfo], Sequence[str]]) -> ReadAs:
    """A name or a list of names, all of them known."""
    name = Annotated[str, named(what, known)]
    return ReadAs(
        Annotated[
            Annotated[name, Tag(SCALAR)]
            | Annotated[_list_of(name, what), Tag(LIST)]
            | Annotated[Column, Tag(COLUMN)],
            Discriminator(_form_of_names),
        ]
    )


@dataclass(frozen=True)
class Quantity:
    """A number that the config may give, which also is the annotation of its type.

    `Annotated[float, Quantity("1", "tolerance", 0, 1)]` is a number, bare or with its unit;
    `Annotated[Numbers, Quantity("kg", "mass", 0)]` may also be a list, a range or a column of a file.

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
    def expected(self) -> str:
        """The values it may have, in words.

        >>> Quantity("kg", "mass", least=0, above=True, infinite=True).expected
        'a number > 0 kg, or inf'
        """
        unit = "" if self.unit == "1" else f" {self.unit}"
        low, high = f"{'>' if self.above else '>='} {self.least:g}", f"<= {self.most:g}"
        match math.isfinite(self.least), math.isfinite(self.most):
            case True, True:
                both = f"{low} and {high}" if self.above else f"from {self.least:g} to {self.most:g}"
                return f"a number {both}{unit}"
            case True, False:
                return f"a number {low}{unit}{', or inf' if self.infinite else ''}"
            case False, True:
                return f"a number {high}{unit}"
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

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        # types of one unit and interval are one type, whatever they mean
        make = number_type if source is float else numbers_type
        return handler.generate_schema(Annotated[make(replace(self, meaning="")), Field(description=self.about)])

    def validate(self, value: object, info: ValidationInfo) -> float:
        """`read` for pydantic."""
        context: Context | None = info.context
        try:
            return self.read(value, math.nan if context is None else context.n)
        except PydanticCustomError as error:
            return float(_refused(info, error, math.nan))

    def read(self, value: object, n: float | None = math.nan) -> float:
        """The SI value of a number or a string with a unit.

        Parameters
        ----------
        value : what the config gives
        n : the exponent that the unit may contain; None where it is an axis, NaN where it is not known

        Raises
        ------
        PydanticCustomError : it is something else, is not in the interval, or its unit is of another dimension

        >>> Quantity("Pa", "Young's modulus", least=0, above=True).read("56 GPa")
        56000000000.0
        """
        if type(value) is float and self.least < value < self.most:
            return value + 0.0
        if isinstance(value, str):
            number = self._with_unit(value, n)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise refuse(value, self.expected)
        else:
            number = _float(lambda: float(value))
        if not self.allows(number):
            raise refuse(value, self.expected)
        # -0.0 and 0.0 are one value, and have one label
        return number + 0.0

    def _with_unit(self, text: str, n: float | None) -> float:
        if len(text) > MAX_UNIT:
            raise refuse(text, f"at most {MAX_UNIT} characters")
        parts = NUMBER.fullmatch(text)
        example = "" if self.exponents else f', such as "1 {self.unit}"'
        if parts is None or not parts[2]:
            with_unit = "" if self.unit == "1" else f", bare or with a unit{example}"
            raise refuse(text, f"{self.expected}{with_unit}")
        factor = self._factor(text, parts[2], n, example)
        number = float(parts[1])
        if number == 0.0 or not math.isfinite(number):
            return number
        # exact until the last step, so that "35 mm" is 0.035 to the bit
        return _float(lambda: float(Fraction(parts[1]) * factor))

    def _factor(self, text: str, unit: str, n: float | None, example: str) -> Fraction | float:
        """What a unit is in SI, if it is of this dimension."""
        others = sorted(self.exponents - {"n"})
        if others:
            raise refuse(text, f"a bare number: its unit {self.unit} depends on {' and '.join(others)}")
        if n is None and self.exponents:
            raise refuse(text, f"a bare number: its unit {self.unit} depends on n, which is an axis")
        of_n = f" with n = {n:g}" if self.exponents and n is not None else ""
        wanted = "a bare number" if self.unit == "1" else f"a unit of {self.unit}{of_n}{example}"
        scale = _scale(unit)
        if scale is None:
            raise refuse(text, f'{wanted}; "{safe_text(unit)}" is not a known unit')
        factor, powers = scale
        if self.exponents and n is not None and math.isnan(n):
            return factor
        own = map(float, dimension(self.unit, {"n": 0.0 if n is None or math.isnan(n) else n}))
        if powers is None or any(abs(a - b) > 1e-9 for a, b in zip(powers, own, strict=True)):
            raise refuse(text, wanted)
        return factor


@cache
def number_type(quantity: Quantity) -> Any:
    """The type of a number, bare or with its unit."""
    bounds: dict[str, Any] = {}
    if math.isfinite(quantity.least):
        bounds["gt" if quantity.above else "ge"] = quantity.least
    if math.isfinite(quantity.most):
        bounds["le"] = quantity.most
    bare: Any = Annotated[float, Field(**bounds)]
    if quantity.exponents <= {"n"}:
        number = rf"\s*[-+]?({_DIGITS}{'|inf' if quantity.infinite else ''})\s*"
        # a number without a unit is no text
        pattern = rf"^(?!{number}$){number}[{_LETTERS}/1]"
        example = f"1 {'%' if quantity.unit == '1' else quantity.unit}"
        bare |= Annotated[str, Field(pattern=pattern, max_length=MAX_UNIT, examples=[example])]
    return Annotated[float, PlainValidator(quantity.validate, json_schema_input_type=bare)]


@cache
def numbers_type(quantity: Quantity) -> Any:
    """The type of what may be an axis; its form decides how it is read."""
    number, end = number_type(quantity), number_type(replace(quantity, infinite=False))
    free, count, three = number_type(Quantity(quantity.unit, "")), whole(1).type, cast(Any, tuple)
    types = {
        "linspace": three[end, end, count],
        "geomspace": three[end, end, count],
        # what arange stops before, and its step, need not be values themselves
        "arange": three[end, free, free],
    }
    fields: dict[str, Any] = {
        name: (Annotated[kind, Field(description=RANGES[name], strict=False), BeforeValidator(_three(name))], None)
        for name, kind in types.items()
    }
    interval = create_model(f"Range of {quantity.expected.removeprefix('a ')}", __base__=Range, **fields)
    return Annotated[
        Annotated[number, Tag(SCALAR)]
        | Annotated[_list_of(number, quantity.expected), Tag(LIST)]
        | Annotated[interval, Tag(RANGE)]
        | Annotated[Column, Tag(COLUMN)],
        Discriminator(form_of),
    ]


def _three(kind: str) -> Callable[[object], object]:
    """A check that a range has its three numbers."""

    def check(value: object) -> object:
        if isinstance(value, list | tuple) and len(value) == 3:
            return value
        got = f"a list of {len(value)}" if isinstance(value, list | tuple) else show(value)
        raise fault(f"got {got}, expected {RANGES[kind]}")

    return check


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
    # kg/m3 and kg m-3 are common spellings, which pint does not know
    unit = re.sub(rf"(?<=[{_LETTERS}])(-?[0-9])", r"^\1", unit)
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
