"""Text for people: numbers, units and quantities, and text of files, escaped so that it is safe to print."""

from __future__ import annotations

import json
import math
import re
import shlex
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from pathlib import Path
from unicodedata import category

# control, format (bidi marks, zero-width), lone surrogate, private, unassigned, line and paragraph separator
UNSAFE = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})

NO_BREAK = "\N{NO-BREAK SPACE}"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
# prefixes of units, by the power of ten
PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}
# units whose first factor takes a prefix
PREFIXED = re.compile(r"(m|s|N|J|Pa|W|Hz)(?![\^A-Za-z])")

# parameters of public functions whose option has another name
OPTIONS = {
    "frictions": "friction",
    "kinds": "kind",
    "labels": "label",
    "models": "model",
    "name": "for",
    "overrides": "set",
    "parameter": "for",
    "plugins": "plugin",
    "sections": "section",
}
# between the keys of a model and a friction law in the name of a pair
WITH = " with "
_is_command_line = False


def name_options() -> None:
    """Name arguments as options from now on, for a process that is the command line."""
    global _is_command_line
    _is_command_line = True


def law_name(model: str, friction: str = "") -> str:
    """Name a model, a friction law or a pair of both, by their keys or by their titles.

    >>> law_name("hertz"), law_name("hertz", "coulomb-1785")
    ('hertz', 'hertz with coulomb-1785')
    """
    return WITH.join(filter(None, (model, friction)))


def law_keys(name: str) -> list[str]:
    """Find the keys in the name of a law.

    >>> law_keys("hertz with coulomb-1785")
    ['hertz', 'coulomb-1785']
    """
    return name.split(WITH)


def argument(name: str, value: object = None, *, key: str = "") -> str:
    """Name an argument of a public function, or with a value what to write, in the words of the user.

    On the command line these are `--at e=0.6`, `--kind loop`, `--overwrite` and `--sel e=0.5`.

    >>> argument("at", 0.6, key="e"), argument("kind", "loop"), argument("overwrite", True)
    ('at["e"]', 'kind="loop"', 'overwrite=True')
    >>> argument("max_points"), argument("sel", {"e": 0.5}), argument("plugins", ["FILE"])
    ('max_points', 'sel={"e": 0.5}', 'plugins=["FILE"]')
    """
    if not _is_command_line:
        if key:
            return f'{name}["{key}"]'
        return name if value is None else f"{name}={_python_text(value)}"
    if isinstance(value, dict):
        ((key, value),) = value.items()
    elif isinstance(value, list):
        value = shlex.quote(str(value[0]))
    words = [str(part) for part in (key or None, value) if part is not None and part is not True]
    return " ".join([f"--{OPTIONS.get(name, name).replace('_', '-')}", *(["=".join(words)] if words else [])])


def _python_text(value: object) -> str:
    """Write a value as Python code, with double quotes."""
    match value:
        case dict():
            return f"{{{', '.join(f'{_python_text(key)}: {_python_text(item)}' for key, item in value.items())}}}"
        case list():
            return f"[{', '.join(map(_python_text, value))}]"
        case str() | Path():
            return json.dumps(str(value), ensure_ascii=False)
    return repr(value)


def number(value: object, digits: int | None = 6) -> str:
    """Format a float with `digits` significant digits; NaN is a dash, and other types use `str`.

    None is for the value of an axis: enough digits to identify it, without rounding errors.

    >>> number(1 / 3), number(0.5), number(6e9), number(float("nan")), number(12)
    ('0.333333', '0.5', '6e+09', '–', '12')
    >>> number(0.1 + 0.2, None), number(6e9, None), number(1234567.0, None), number("steel", None)
    ('0.3', '6e+09', '1234567', 'steel')
    """
    if not isinstance(value, float):
        return str(value)
    if digits is None:
        digits = 6 if value != value or float(f"{value:.6g}") == float(f"{value:.12g}") else 12
    return "–" if value != value else f"{value:.{digits}g}"


def type_of(value: object) -> str:
    """Name the type of a value, with its article.

    >>> type_of([]), type_of(5)
    ('a list', 'an int')
    """
    name = type(value).__name__
    return f"an {name}" if name[0].lower() in "aeiou" else f"a {name}"


def decimals(value: float, places: int = 4) -> str:
    """Format a number with `places` decimals, for columns whose numbers are compared; NaN is a dash.

    >>> decimals(0.5), decimals(float("nan"))
    ('0.5000', '–')
    """
    return "–" if value != value else f"{value:.{places}f}"


def percentage(share: float) -> str:
    """Format a share from 0 to 1 in percent; "0%" and "100%" mean exactly none and all.

    >>> [percentage(n / 3000) for n in (0, 1, 2000, 2999, 3000)]
    ['0%', '<0.1%', '66.7%', '>99.9%', '100%']
    """
    if share in (0.0, 1.0):
        return f"{share:.0%}"
    if share < 0.001:
        return "<0.1%"
    return ">99.9%" if share > 0.999 else f"{share:.1%}"


def rounded(value: float, digits: int, *, up: bool) -> float:
    """Round a number to digits, to the side where a bound of it still holds but for rounding errors.

    >>> rounded(1.16977e-05, 3, up=False), rounded(0.0242711, 4, up=True), rounded(0.3 - 1e-16, 3, up=False)
    (1.16e-05, 0.02428, 0.3)
    """
    rounding = ROUND_CEILING if up else ROUND_FLOOR
    return float(Context(prec=digits, rounding=rounding).create_decimal(f"{value:.13g}"))


def quantity(value: object, unit: str = "1", digits: int = 6) -> str:
    """Format a value with its unit, if it has one.

    >>> quantity(0.5, "m/s"), quantity(1.5), quantity(float("nan"), "N"), quantity(30.0, "°")
    ('0.5 m/s', '1.5', '–', '30°')
    """
    text = number(value, digits)
    return text if unit in ("", "1") or text == "–" else f"{text}{'' if unit == '°' else ' '}{unit}"


def prefixed(value: object, unit: str = "1", digits: int | None = None) -> str:
    """Format a value with its unit and the prefix that suits it, in print notation, by default with all digits.

    >>> prefixed(1e-6, "s"), prefixed(2.1e11, "Pa"), prefixed(7850.0, "kg/m^3"), prefixed(math.inf, "kg")
    ('1 µs', '210 GPa', '7850 kg/m³', 'inf kg')
    >>> prefixed(math.pi / 6.0, "rad"), prefixed("steel"), prefixed(0.3), prefixed(1.008542975e-4, "m", 4)
    ('30°', 'steel', '0.3', '100.9 µm')
    """
    if not isinstance(value, float) or unit in ("", "1") or value != value:
        return number(value, digits)
    size, shown = scaled_unit(unit, abs(value))
    superscript = re.sub(r"\^(-?\d+)(?![\d.])", lambda power: power[1].translate(SUPERSCRIPTS), shown)
    return f"{number(value / size, digits)}{'' if unit == 'rad' else ' '}{superscript}"


def polynomial(coefficients: Sequence[float], name: str) -> str:
    """Write a polynomial, from the constant term on.

    >>> polynomial([-6.9, 0.5, -796.4559], "e")
    '−6.9 + 0.5 e − 796.4559 e²'
    """
    powers = ["", f" {name}", *(f" {name}{str(n).translate(SUPERSCRIPTS)}" for n in range(2, len(coefficients)))]
    signed = zip(coefficients, powers, strict=False)
    text = " ".join(f"{'−' if c < 0.0 else '+'} {abs(c):.12g}{power}" for c, power in signed)
    return text.removeprefix("+ ") if coefficients[0] >= 0.0 else text.replace(" ", "", 1)


def heading(name: str, of: str = "", unit: str = "1") -> str:
    """Write the heading of a column: a name, the model or ball it belongs to, and its unit in brackets.

    >>> heading("v1_post", "hertz", "m/s"), heading("e")
    ('v1_post hertz [m/s]', 'e')
    """
    return " ".join(part for part in (name, of, "" if unit in ("", "1") else f"[{unit}]") if part)


def typographic(value: float, *, powers: bool = False) -> str:
    """Format a number with a minus sign and powers of ten as in print; with `powers` always with a power of ten.

    >>> [typographic(value) for value in (0.25, -3.0, -1e-9, 2.5e10, 1e-4)], typographic(1.0, powers=True)
    (['0.25', '−3', '−10⁻⁹', '2.5·10¹⁰', '0.0001'], '10⁰')
    >>> typographic(0.9999925)
    '0.9999925'
    """
    text = number(float(value), None)
    if powers and value:
        digits, _, exponent = f"{value:.5e}".partition("e")
        text = f"{float(digits):g}e{exponent}"
    mantissa, _, power = text.partition("e")
    text = f"{mantissa}·10{str(int(power)).translate(SUPERSCRIPTS)}" if power else mantissa
    return re.sub(r"^(-?)1·", r"\1", text).replace("-", "−")


def scaled_unit(unit: str, largest: float) -> tuple[float, str]:
    """Choose the prefix of a unit that suits a number: the size in the given unit, and the name; degrees for rad.

    Parameters
    ----------
    unit : in SI, such as "m/s"
    largest : magnitude of the largest number to show, in that unit

    >>> scaled_unit("m", 1.2e-4), scaled_unit("m/s", 0.5), scaled_unit("N", 6200.0), scaled_unit("kg", 2e-3)
    ((1e-06, 'µm'), (1.0, 'm/s'), (1000.0, 'kN'), (0.001, 'g'))
    >>> scaled_unit("rad", 1.5)
    (0.017453292519943295, '°')
    """
    if unit == "rad":
        return math.radians(1.0), "°"
    if unit.startswith("kg") and largest < 0.1 and not unit.startswith("kg^"):
        power, text = _prefixed(largest * 1e3)
        return 10.0 ** (power - 3), f"{text}g{unit[2:]}"
    if PREFIXED.match(unit) is None:
        return 1.0, unit
    power, text = _prefixed(largest)
    return 10.0**power, text + unit


def _prefixed(largest: float) -> tuple[int, str]:
    """Choose the power of ten of a prefix, and the prefix; 0 and "" for numbers that need none."""
    if not 0.0 < largest < float("inf") or 0.1 <= largest < 1000.0:
        return 0, ""
    exponent = int(f"{largest:.6e}".partition("e")[2])
    power = min(max(3 * (exponent // 3), min(PREFIXES)), max(PREFIXES))
    return power, PREFIXES[power]


def with_year(title: str, year: int | str) -> str:
    """Add the year to the title of a model, unless the title ends with versions in brackets.

    >>> with_year("Hertz", 1882), with_year("Modia3D (v0.4.0 to v0.5.2, 2019 to 2021)", 2019)
    ('Hertz (1882)', 'Modia3D (v0.4.0 to v0.5.2, 2019 to 2021)')
    """
    return title if title.endswith(")") else f"{title} ({year})"


def safe_text(text: str, limit: int = 200) -> str:
    r"""Escape control and invisible characters of a text, and cut it to at most `limit` characters.

    >>> safe_text("steel\x1b[31m")
    'steel\\x1b[31m'
    >>> safe_text("a\u202eb"), safe_text("abcdef", limit=4)
    ('a\\u202eb', 'abc…')
    """
    # an escape is never shorter than its character: characters beyond the limit are not needed
    shown = escape_controls(text[: limit + 1])
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def escape_controls(text: str) -> str:
    r"""Escape control and invisible characters; a second time changes nothing.

    >>> escape_controls("steel\n"), escape_controls(escape_controls("steel\n"))
    ('steel\\x0a', 'steel\\x0a')
    """
    return "".join(_escaped(letter) if category(letter) in UNSAFE else letter for letter in text)


def _escaped(letter: str) -> str:
    return f"\\x{ord(letter):02x}" if letter.isascii() else letter.encode("ascii", "backslashreplace").decode()
