"""Numbers of a config as pydantic types: quantities with units and bounds, lists, ranges, fits, distributions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache, lru_cache
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias, cast

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    GetPydanticSchema,
    PlainValidator,
    Tag,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    WrapValidator,
    create_model,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError
from pydantic_core.core_schema import with_info_plain_validator_function

from ..contact.model import ForceModel
from ..contact.units import dimension, names_in
from ..errors import did_you_mean
from ..formatting import safe_text, type_of

# keys and indices from the top of a config to a value
KeyPath: TypeAlias = tuple[str | int, ...]
# where something is wrong, and the message
ConfigProblem: TypeAlias = tuple[KeyPath, str]
# error type of pydantic errors that this package raises, whose messages are complete
PROBLEM_TYPE = "config_problem"

MAX_UNIT_LENGTH = 64  # characters of a string with a unit
MAX_AXIS_VALUES = 10**7  # values on one axis, which are held in memory
MAX_PRINTED_COUNT = 10**18  # larger counts are not written out in messages
MAX_PROBLEMS = 100  # reported for one list or table, and for a whole config
MAX_REPORTED_VALUES = 1000  # invalid values reported for a config; bounds the time that a hostile list takes

_DIGITS = r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
NUMBER_SYNTAX = re.compile(rf"\s*([-+]?(?:{_DIGITS}|inf\b|nan\b))\s*(.*?)\s*")
# names with small exponents and one level of brackets: no expression that takes long to evaluate
_SIGNED = r"-?[0-9]{1,2}(?:\.[0-9]{1,6})?"
_POWER = rf"(?:\s*(?:\^|\*\*)\s*(?:{_SIGNED}|\(-?[0-9]{{1,2}}(?:[./][0-9]{{1,6}})?\))|{_SIGNED}|⁻?[⁰¹²³⁴-⁹])?"
_LETTERS = "A-Za-zµμΩ°Å%_"
_FACTOR = rf"(?:1|[{_LETTERS}]+{_POWER})"
_PRODUCT = rf"{_FACTOR}(?:\s*[*/·]\s*{_FACTOR}|\s+{_FACTOR})*+"
UNIT_SYNTAX = re.compile(rf"/?\s*{_PRODUCT}(?:\s*[*/]\s*\(\s*{_PRODUCT}\s*\))?")

# tags of the forms that a value may have; no key of a config contains NUL, so tags can be removed from paths
SCALAR, LIST, RANGE, COLUMN, FIT = "\0scalar", "\0list", "\0range", "\0column", "\0fit"
DISTRIBUTION = "\0distribution"
RANGE_FORMS = {
    "linspace": "[first, last, count]",
    "geomspace": "[first, last, count]",
    "arange": "[first, stop, step]",
}
FIT_FORM = "[least, most]"
DISTRIBUTION_FORMS = {
    "uniform": "[least, most]",
    "normal": "[mean, standard_deviation]",
    "lognormal": "[median, geometric_standard_deviation]",
    "triangular": "[least, mode, most]",
    "empirical": "the name of a CSV file, or a list of numbers",
}
# keys of a table that is the value of an input
VALUE_FORMS = (*RANGE_FORMS, "fit", *DISTRIBUTION_FORMS)
# ratio of the bounds of a positive parameter from which its middle is the geometric mean
WIDE_BOUNDS_RATIO = 100.0


@dataclass
class ValidationContext:
    """What the validation of a value depends on besides the value."""

    n: float | None  # exponent of the sweep: None where it varies, NaN where it cannot be read
    materials: tuple[str, ...]  # names of those that a ball may have
    models: Mapping[str, ForceModel]  # all models by key
    n_errors: int = 0  # invalid values so far


def as_text(value: object) -> str:
    """Describe a value in a message: briefly, and without control characters.

    >>> as_text(True), as_text(0.5), as_text("steel"), as_text([1, 2]), as_text(16**6000)
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
    # dates and times of TOML
    isoformat = getattr(value, "isoformat", None)
    return safe_text(str(isoformat()) if callable(isoformat) else type_of(value), 60)


def mismatch_error(value: object, expected: str) -> PydanticCustomError:
    """Report a value that differs from what is expected."""
    return value_error(f"got {as_text(value)}, expected {expected}")


def value_error(message: str) -> PydanticCustomError:
    """Report a message that `validation_problems` passes on unchanged."""
    return PydanticCustomError(PROBLEM_TYPE, "{message}", {"message": message})


def located_errors(problems: Iterable[ConfigProblem]) -> ValidationError:
    """Report several problems, each with its path inside the value."""
    errors = [InitErrorDetails(type=value_error(message), loc=path, input=None) for path, message in problems]
    return ValidationError.from_exception_data("config", errors)


def _raise_or_skip(info: ValidationInfo, error: PydanticCustomError, value: Any) -> Any:
    """Raise the error; after MAX_REPORTED_VALUES of them return `value`, as the config is refused anyway."""
    context: ValidationContext | None = info.context
    if context is not None:
        context.n_errors += 1
        if context.n_errors > MAX_REPORTED_VALUES:
            return value
    raise error


def expected(text: str) -> WrapValidator:
    """Replace the message of pydantic's own errors about a value; errors inside the value are not changed."""

    def wrap(value: object, handler: Callable[[object], object], info: ValidationInfo) -> object:
        try:
            return handler(value)
        except ValidationError as error:
            details = error.errors(include_url=False)
            if any(not detail["loc"] and detail["type"] != PROBLEM_TYPE for detail in details):
                return _raise_or_skip(info, mismatch_error(value, text), value)
            raise

    return WrapValidator(wrap)


def known_name(description: str, choices_of: Callable[[ValidationInfo], Sequence[str]]) -> BeforeValidator:
    """Check that a text is one of some names; the message suggests the nearest."""

    def check(value: object, info: ValidationInfo) -> str:
        choices = choices_of(info)
        if isinstance(value, str) and value in choices:
            return value
        expectation = f"the name of {description}"
        if isinstance(value, str):
            expectation = f"{description}; {did_you_mean(value, choices)}"
        return str(_raise_or_skip(info, mismatch_error(value, expectation), ""))

    return BeforeValidator(check)


def schema_simplifier(**extra: object) -> Callable[[dict[str, Any]], None]:
    """Return a function that simplifies a JSON schema.

    Null defaults, which TOML does not have, are removed, as is all but the first line of the description; `extra`
    keys are added.
    """

    def simplify(schema: dict[str, Any]) -> None:
        schema["description"] = schema.get("description", "").split("\n")[0]
        for key_schema in schema.get("properties", {}).values():
            if key_schema.get("default", 0) is None:
                del key_schema["default"]
        schema.update(extra)

    return simplify


class Table(BaseModel):
    """A table of a config: these keys and no others."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        protected_namespaces=(),
        # commands that read no config need no validators
        defer_build=True,
        json_schema_extra=schema_simplifier(),
    )


def read_as(value_type: Any) -> GetPydanticSchema:
    """Validate by a type that is built at run time; mypy sees the type of the value."""
    return GetPydanticSchema(lambda source, handler: handler.generate_schema(value_type))


def bounded_int(least: int, most: int | None = None) -> GetPydanticSchema:
    """Build the type of whole numbers in an interval."""
    interval = f"of at least {least:,}" if most is None else f"from {least:,} to {most:,}"
    bounds = Field(ge=least, le=most, strict=True)
    # a float may have no fraction, such as 1e6
    whole = BeforeValidator(lambda x: int(x) if isinstance(x, float) and x.is_integer() else x)
    return read_as(Annotated[int, bounds, whole, expected(f"a whole number {interval}")])


SEPARATORS, DECIMALS = (",", ";", "\t"), (".", ",")
SeparatorKey: TypeAlias = Annotated[Any, read_as(Literal[SEPARATORS]), expected('",", ";" or "\\t"')]
DecimalKey: TypeAlias = Annotated[Any, read_as(Literal[DECIMALS]), expected('"." or ","')]


class Column(Table):
    """A column of a CSV file; reading replaces it by the list of its values."""

    file: Annotated[str, expected("the name of a CSV file")] = Field(description="CSV file")
    column: Annotated[str, expected("the name of a column")] = Field(description="a name in its first line")
    separator: SeparatorKey = Field(None, description="of columns, where it is not recognised")
    decimal: DecimalKey = Field(None, description="sign, where it is not recognised")


class _OneForm(Table):
    """A table that describes several numbers in one of several forms: exactly one of its fields is given.

    The type of a quantity, see `numbers_type`, has the fields.
    """

    model_config = ConfigDict(json_schema_extra=schema_simplifier(minProperties=1, maxProperties=1))
    FORMS: ClassVar[Mapping[str, str]]
    EXPECTED: ClassVar[str]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.model_fields_set) != 1:
            got = " and ".join(name for name in self.FORMS if name in self.model_fields_set) or "an empty table"
            raise value_error(f"got {got}, expected {self.EXPECTED}")
        self._check_numbers()
        return self

    def _check_numbers(self) -> None:
        raise NotImplementedError

    @property
    def kind(self) -> str:
        """Name of the field that is set."""
        return next(name for name in self.FORMS if getattr(self, name) is not None)

    @property
    def numbers(self) -> tuple[Any, ...]:
        """The numbers of that field, or the name of a file that cannot be read."""
        value = getattr(self, self.kind)
        return (value,) if isinstance(value, str) else tuple(value)

    def _error(self, message: str, *path: int) -> ValidationError:
        return located_errors([((self.kind, *path), message)])


class Range(_OneForm):
    """A range of numpy, which is counted before it is written out: exactly one of its fields is given."""

    FORMS = RANGE_FORMS
    EXPECTED = f"one of {', '.join(f'{name} = {form}' for name, form in RANGE_FORMS.items())}"

    def _check_numbers(self) -> None:
        first, last, step_or_count = self.numbers
        ends = f"got {first:g} to {last:g}"
        if self.kind == "geomspace" and min(first, last) <= 0 <= max(first, last):
            raise self._error(f"{ends}, expected two ends of the same sign, neither of them 0")
        if self.kind == "arange" and step_or_count == 0:
            raise self._error("got 0, expected a step other than 0", 2)
        if self.size < 1:
            got = f"no value from {first:g} to {last:g} by {step_or_count:g}"
            raise self._error(f"got {got}, expected at least one")
        if self.size > MAX_AXIS_VALUES:
            size = f"{self.size:,}" if self.size <= MAX_PRINTED_COUNT else f"more than {MAX_PRINTED_COUNT:,}"
            raise self._error(f"got {size} values, expected at most {MAX_AXIS_VALUES:,} on an axis")

    @property
    def size(self) -> int:
        """Number of values."""
        first, last, step_or_count = self.numbers
        if self.kind != "arange":
            return int(step_or_count)
        size = (last - first) / step_or_count
        return max(math.ceil(size), 0) if math.isfinite(size) else 2 * MAX_PRINTED_COUNT

    def values(self, quantity: Quantity) -> tuple[float, ...]:
        """List the values; those between the ends are rounded to 15 significant digits, so that 0.3 is 0.3."""
        first, last, _ = self.numbers
        with np.errstate(all="ignore"):
            values = getattr(np, self.kind)(*self.numbers)
        if not np.isfinite(values).all():
            raise self._error(f"got {first:g} to {last:g}, expected a range that does not overflow")
        # the ends are kept as they were written
        inner = slice(1, None if self.kind == "arange" else -1)
        values[inner] = [float(f"{value:.15g}") for value in values[inner].tolist()]
        for extreme in (float(values.min()), float(values.max())):
            if not quantity.allows(extreme):
                raise self._error(quantity.refusal(extreme, extreme).replace("got", "got a value", 1))
        repeated = np.flatnonzero(np.diff(values) == 0)
        if repeated.size:
            raise self._error(f"got {float(values[repeated[0]])!r} twice, expected each value once")
        return tuple((values + 0.0).tolist())


class FitRange(Table):
    """A parameter that is fitted to measurements, with the least and the largest value that it may have.

    True is its natural range: all allowed values, or decades about its size in the contact's own units.
    """

    fit: tuple[float, float] | Literal[True]

    @model_validator(mode="after")
    def _check_order(self) -> FitRange:
        if self.fit is True:
            return self
        least, most = self.fit
        got = f"got {least:g} to {most:g}"
        if least >= most:
            raise located_errors([(("fit",), f"{got}, expected {FIT_FORM} with least < most")])
        if not math.isfinite(most - least) or (least > 0.0 and not math.isfinite(most / least)):
            raise located_errors([(("fit",), f"{got}, expected bounds that are closer together")])
        return self


def middle_of(least: float, most: float) -> float:
    """Find a value between bounds: the geometric mean of positive ones that are far apart, else the mean."""
    if least > 0.0 and most / least > WIDE_BOUNDS_RATIO:
        return min(max(math.sqrt(least) * math.sqrt(most), least), most)
    return 0.5 * least + 0.5 * most


class Distribution(_OneForm):
    """The distribution of an uncertain input, from which [design] draws: exactly one of its fields is given."""

    FORMS = DISTRIBUTION_FORMS
    EXPECTED = "one distribution"

    def _check_numbers(self) -> None:
        numbers = [number for number in self.numbers if isinstance(number, float)]
        is_ordered = numbers == sorted(numbers) and numbers[:1] < numbers[-1:]
        if self.kind in ("uniform", "triangular") and not is_ordered:
            got = " to ".join(f"{number:g}" for number in numbers)
            raise self._error(f"got {got}, expected {self.FORMS[self.kind]} in ascending order")
        if self.kind == "lognormal" and numbers[0] <= 0.0:
            raise self._error(f"got {numbers[0]:g}, expected a median > 0", 0)


# the values of keys that may be axes
Numbers: TypeAlias = float | tuple[float, ...] | Range | Column | FitRange | Distribution
Names: TypeAlias = str | tuple[str, ...] | Column
# the valid values of inputs by config name
Values: TypeAlias = Mapping[str, Numbers | Names]


def value_form(value: object) -> str:
    """Name the form of a value: a number or text, a list, a range, a column, a fit or a distribution."""
    match value:
        case list():
            return LIST
        case {"fit": _}:
            return FIT
        case dict() if not DISTRIBUTION_FORMS.keys().isdisjoint(value):
            return DISTRIBUTION
        case {"file": _} | {"column": _}:
            return COLUMN
        case dict():
            return RANGE
    return SCALAR


def list_of(element: Any, description: str) -> Any:
    """Build the type of a list of at least one element, which becomes a tuple."""

    def check_not_empty(value: list[object]) -> list[object]:
        if not value:
            raise mismatch_error(value, f"a list of at least one: {description}")
        return value

    return Annotated[list[element], Field(min_length=1), BeforeValidator(check_not_empty), AfterValidator(tuple)]


@dataclass(frozen=True)
class Quantity:
    """A number of the config, with its unit; the annotation of a `float`, or of `Numbers` of any form."""

    unit: str  # in SI; exponents may contain n
    meaning: str
    # ends of the interval of its values, which includes them if they are finite
    least: float = -math.inf
    most: float = math.inf
    above: bool = False  # the interval excludes `least`
    infinite: bool = False  # inf is allowed
    below: bool = False  # the interval excludes `most`
    words: tuple[str, ...] = ()  # it is one of these, and its number the position
    default: float | None = None  # of a parameter of a law

    @property
    def expected(self) -> str:
        """The allowed values in words, such as "a number > 0 kg, or inf"."""
        if self.words:
            return " or ".join(f'"{word}"' for word in self.words)
        unit = "" if self.unit == "1" else f" {self.unit}"
        low, high = f"{'>' if self.above else '>='} {self.least:g}", f"<= {self.most:g}"
        match math.isfinite(self.least), math.isfinite(self.most):
            case True, True if self.below:
                return f"an angle from {self.least:g} to below {math.degrees(self.most):g} deg"
            case True, True:
                both = f"{low} and {high}" if self.above else f"from {self.least:g} to {self.most:g}"
                return f"a number {both}{unit}"
            case True, False:
                return f"a number {low}{unit}{', or inf' if self.infinite else ''}"
            case False, True:
                return f"a number {high}{unit}"
        return f"a finite number{unit and ' of'}{unit}"

    @property
    def description(self) -> str:
        """The meaning with the unit in brackets."""
        return f"{self.meaning} [{'-' if self.unit == '1' else self.unit}]"

    def allows(self, value: float) -> bool:
        """Check whether a number is allowed."""
        return bool(self.contains(value)) and (self.infinite or not math.isinf(value))

    def contains(self, values: Any) -> Any:
        """Check whether a number, or each of an array, is in the interval."""
        above = values > self.least if self.above else values >= self.least
        return above & (values < self.most if self.below else values <= self.most)

    def refusal(self, value: object, number: float) -> str:
        """Say what is wrong with a number that is not allowed; one of radians may be an angle in degrees."""
        is_in_radians = not isinstance(value, str) or re.fullmatch(r"[^a-zA-Z]+rad\s*", value)
        if self.unit == "rad" and math.isfinite(number) and is_in_radians:
            # between pi/2 and pi only whole numbers seem to be degrees
            if 0.0 < number < math.degrees(self.most) and (number > math.pi or number.is_integer()):
                return f'got {number:.15g} rad; did you mean "{number:.15g} deg"?'
            return f"got {number:.15g} rad, expected {self.expected}"
        return f"got {as_text(value)}, expected {self.expected}"

    @property
    def exponents(self) -> frozenset[str]:
        """The names that occur in the exponents of the unit."""
        return names_in(self.unit)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        # quantities with the same unit and interval share a type, whatever their meaning
        of_any_meaning = replace(self, meaning="", default=None)
        validated = number_type(of_any_meaning) if source is float else Annotated[Any, _any_form(of_any_meaning)]
        return handler.generate_schema(Annotated[validated, Field(description=self.description)])

    def validate(self, value: object, info: ValidationInfo) -> float:
        """Call `read` with the exponent of the validation context."""
        context: ValidationContext | None = info.context
        try:
            return self.read(value, math.nan if context is None else context.n)
        except PydanticCustomError as error:
            return float(_raise_or_skip(info, error, math.nan))

    def read(self, value: object, n: float | None = math.nan) -> float:
        """Convert a number, or a text with a unit, whose exponent n is None if it varies and NaN if unknown.

        >>> Quantity("Pa", "Young's modulus", least=0, above=True).read("56 GPa")
        56000000000.0
        """
        if self.words:
            if value not in self.words:
                raise mismatch_error(value, self.expected)
            return float(self.words.index(str(value)))
        if type(value) is float and self.least < value < self.most:
            return value + 0.0
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise mismatch_error(value, self.expected)
        try:
            number = self._with_unit(value, n) if isinstance(value, str) else float(value)
        except OverflowError:
            number = math.inf
        if not self.allows(number):
            raise value_error(self.refusal(value, number))
        # -0.0 becomes 0.0: they are one value with one label
        return number + 0.0

    def read_or_nan(self, value: object) -> float:
        """Call `read`; NaN for an invalid value, which the validation of its table reports."""
        try:
            return self.read(value)
        except PydanticCustomError:
            return math.nan

    def _with_unit(self, text: str, n: float | None) -> float:
        if len(text) > MAX_UNIT_LENGTH:
            raise mismatch_error(text, f"at most {MAX_UNIT_LENGTH} characters")
        if re.match(r"\s*[-+]?[0-9]*,[0-9]", text):
            raise mismatch_error(text, "a number with a decimal point and no comma")
        parts = NUMBER_SYNTAX.fullmatch(text)
        if parts is None or not parts[2]:
            # a number as a text needs a unit, or to be no text
            bare = "without quotes" if parts else "bare"
            forms = f", {bare} or with a unit{self._example}" if self.unit != "1" else f", {bare}" if parts else ""
            raise mismatch_error(text, self.expected + forms)
        try:
            factor = self.factor(parts[2], n)
        except UnitError as error:
            raise mismatch_error(text, str(error)) from None
        number = float(parts[1])
        if number == 0.0 or not math.isfinite(number):
            return number
        # exact until it is converted to a float, so that "35 mm" equals 0.035 exactly
        return float(Fraction(parts[1]) * factor)

    @property
    def _example(self) -> str:
        return "" if self.exponents else f', such as "1 {self.unit}"'

    def factor(self, unit: str, n: float | None = math.nan) -> Fraction | float:
        """Find the factor from a unit to SI; a `UnitError` describes the units that the quantity may have."""
        varying = ["n, which varies"] if n is None and self.exponents else []
        if unknown := sorted(self.exponents - {"n"}) or varying:
            raise UnitError(f"a bare number: its unit {self.unit} depends on {' and '.join(unknown)}")
        of_n = f" with n = {n:g}" if self.exponents and n is not None else ""
        expected_unit = "a bare number" if self.unit == "1" else f"a unit of {self.unit}{of_n}{self._example}"
        scale = _si_scale(unit)
        if scale is None:
            raise UnitError(f'{expected_unit}; "{unit}" is not a known unit')
        factor, powers, angle = scale
        if self.exponents and n is not None and math.isnan(n):
            return factor
        own_powers = map(float, dimension(self.unit, {} if n is None else {"n": n}))
        if powers is None or any(abs(a - b) > 1e-9 for a, b in zip(powers, own_powers, strict=True)):
            raise UnitError(expected_unit)
        if angle != self.unit.startswith("rad"):
            is_spin = self.unit == "rad/s"
            raise UnitError(expected_unit + "; 1/s may be turns or radians per second" * is_spin)
        return factor


def is_unit(text: str) -> bool:
    """Check whether a text is a unit of any quantity."""
    return _si_scale(text) is not None


def differs_from_si(text: str) -> bool:
    """Check whether a text is a unit in which numbers are not those in SI, or no unit.

    Units of results with a name in an exponent, such as "N m-n", are in SI.

    >>> differs_from_si("cm/s"), differs_from_si("m s-1"), differs_from_si("N m-n"), differs_from_si("foo")
    (True, False, False, True)
    """
    scale = _si_scale(text)
    if scale is None:
        return text not in ("", "-") and re.search(r"[-^][A-Za-z(]", text) is None
    return scale[0] != 1


class UnitError(ValueError):
    """A unit is unknown or has another dimension; the message is what is expected."""


def _any_form(quantity: Quantity) -> GetPydanticSchema:
    """Validate a value of any form; a bare number does not need `numbers_type`, which takes long to build."""

    def validate(value: object, info: ValidationInfo) -> Any:
        if value_form(value) == SCALAR:
            return quantity.validate(value, info)
        return numbers_type(quantity).validate_python(value, context=info.context)

    return GetPydanticSchema(
        lambda source, handler: with_info_plain_validator_function(validate),
        lambda schema, handler: handler(numbers_type(quantity).core_schema),
    )


@cache
def number_type(quantity: Quantity) -> Any:
    """Build the type of a number, bare or with a unit."""
    bounds: dict[str, Any] = {}
    if math.isfinite(quantity.least):
        # a cached type does not tell 0 from 0.0, which the schema would write
        bounds["gt" if quantity.above else "ge"] = float(quantity.least)
    if math.isfinite(quantity.most):
        bounds["lt" if quantity.below else "le"] = float(quantity.most)
    bare: Any = Annotated[float, Field(**bounds)]
    if quantity.exponents <= {"n"}:
        infinity = r"|inf\b" if quantity.infinite else ""
        number = rf"\s*[-+]?({_DIGITS}{infinity})\s*"
        # a number without a unit must not be a string
        pattern = rf"^(?!{number}$){number}[{_LETTERS}/1]"
        example = f"1 {'%' if quantity.unit == '1' else quantity.unit}"
        bare |= Annotated[str, Field(pattern=pattern, max_length=MAX_UNIT_LENGTH, examples=[example])]
    return Annotated[float, PlainValidator(quantity.validate, json_schema_input_type=bare)]


@cache
def numbers_type(quantity: Quantity) -> TypeAdapter[Any]:
    """Build the type of a number, list, range, column, fit or distribution, which its form tells apart."""
    number, end = number_type(quantity), number_type(replace(quantity, infinite=False))
    any_number, count = number_type(Quantity(quantity.unit, "")), Annotated[int, bounded_int(1)]
    spread = number_type(Quantity(quantity.unit, "", 0.0, above=True))
    ratio = number_type(Quantity("1", "", 1.0, above=True))
    of_quantity = quantity.expected.removeprefix("a ")
    range_type = create_model(
        f"Range of {of_quantity}",
        __base__=Range,
        **_fields(
            RANGE_FORMS,
            linspace=(end, end, count),
            geomspace=(end, end, count),
            # the stop and the step of arange need not be allowed values
            arange=(end, any_number, any_number),
        ),
    )
    file: Any = Annotated[str, expected(DISTRIBUTION_FORMS["empirical"]), Tag(SCALAR)]
    values: Any = Annotated[list_of(end, quantity.expected), Tag(LIST)]
    either = Annotated[file | values, Discriminator(lambda value: LIST if isinstance(value, list) else SCALAR)]
    distributions = _fields(
        DISTRIBUTION_FORMS,
        uniform=(end, end),
        normal=(end, spread),
        lognormal=(end, ratio),
        triangular=(end, end, end),
    )
    distributions["empirical"] = Annotated[either, Field(description=DISTRIBUTION_FORMS["empirical"])], None
    distribution_type = create_model(f"Distribution of {of_quantity}", __base__=Distribution, **distributions)
    bounds = Field(description=f"{FIT_FORM}, between which impact calibrate fits it, or true")
    pair: Any = Annotated[_tuple_of((end, end), FIT_FORM), Tag(LIST)]
    natural: Any = Annotated[Literal[True], Tag(SCALAR)]
    fit: Any = Annotated[natural | pair, Discriminator(lambda value: SCALAR if value is True else LIST), bounds]
    fit_type = create_model(f"Fit of {of_quantity}", __base__=FitRange, fit=(fit, ...))
    any_form: Any = Annotated[
        Annotated[number, Tag(SCALAR)]
        | Annotated[list_of(number, quantity.expected), Tag(LIST)]
        | Annotated[range_type, Tag(RANGE)]
        | Annotated[Column, Tag(COLUMN)]
        | Annotated[fit_type, Tag(FIT)]
        | Annotated[distribution_type, Tag(DISTRIBUTION)],
        Discriminator(value_form),
    ]
    return TypeAdapter(any_form, config=ConfigDict(strict=True))


def _fields(forms: Mapping[str, str], **numbers: tuple[Any, ...]) -> dict[str, Any]:
    """Define optional fields, each a list of numbers of these types in its form."""
    return {
        name: (Annotated[_tuple_of(types, forms[name]), Field(description=forms[name])], None)
        for name, types in numbers.items()
    }


def _tuple_of(types: tuple[Any, ...], form: str) -> Any:
    """Build the type of a list of numbers in a form, such as that of a range, which becomes a tuple."""

    def check_length(value: object) -> object:
        if isinstance(value, list | tuple) and len(value) == len(types):
            return value
        got = f"a list of {len(value)}" if isinstance(value, list | tuple) else as_text(value)
        raise value_error(f"got {got}, expected {form}")

    return Annotated[cast(Any, tuple)[types], Field(strict=False), BeforeValidator(check_length)]


@cache
def _unit_registry() -> Any:
    import pint

    registry: Any = pint.UnitRegistry(non_int_type=Fraction)
    registry.define("@alias turn = rev")
    return registry


@lru_cache(maxsize=256)
def _si_scale(unit: str) -> tuple[Fraction | float, tuple[float, float, float] | None, float] | None:
    """Find the factor to SI, the powers of mass, length and time (None for another dimension), and of angle.

    It is None for an unknown unit.
    """
    if len(unit) > MAX_UNIT_LENGTH or UNIT_SYNTAX.fullmatch(unit) is None:
        return None
    # kg/m3 and kg m-3 are common spellings that pint does not accept
    unit = re.sub(rf"(?<=[{_LETTERS}])(-?[0-9])", r"^\1", unit)
    registry = _unit_registry()
    # pint's parser raises many kinds of exception (AttributeError, AssertionError, ZeroDivisionError)
    try:
        parsed = registry.parse_units(("1" if unit.startswith("/") else "") + unit)
        # units with an offset and logarithmic units have no factor
        zero = registry.Quantity(Fraction(0), parsed).to_base_units()
        if zero.magnitude != 0:
            return None
        angle = float(dict(zero.unit_items()).get("radian", 0.0))
        factor, _ = registry.get_base_units(parsed)
        powers = {str(dimension_name): float(power) for dimension_name, power in parsed.dimensionality.items()}
    except Exception:
        return None
    mass, length, time = (powers.pop(name, 0.0) for name in ("[mass]", "[length]", "[time]"))
    return factor, None if powers else (mass, length, time), angle
