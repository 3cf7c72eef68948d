"""Plain data from the sources of a config: files, texts, mappings and overrides, none of which is trusted.

Texts are TOML, in which the lines of keys are found for messages, and into which values are written.
"""

from __future__ import annotations

import contextlib
import json
import re
import shlex
import tomllib
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from pydantic_core import PydanticCustomError

from ..errors import ConfigError, ImpactError, MissingFileError, UsageError
from ..formatting import safe_text
from .quantities import ConfigProblem, KeyPath, Quantity, as_text, differs_from_si, is_unit

MAX_CONFIG_BYTES = 1_000_000  # size of a TOML file
MAX_OVERRIDE_LENGTH = 4_000_000  # characters of the value of an override
MAX_DEPTH = 8  # levels of nested tables and lists; the deepest key needs 5
MAX_JSON_LENGTH = 64_000_000  # characters of a mapping as JSON, which may hold all values of its axes
MAX_KEY_PARTS = 64  # dots of a key: TOML parsers take quadratic time for longer ones
# first bytes of a result
RESULT_MAGIC = b"impact result\n"
# workbooks of Excel and LibreOffice, old workbooks, and files of Parquet
NO_TEXT = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"PAR1")
BARE_KEY = r"[A-Za-z0-9_-]++"
_PART = rf"""(?:{BARE_KEY}|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![\w.-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_KEY_PARTS + 1}}}")
TOML_TOKEN = re.compile(
    r"""(?P<skip>[ \t\r]+ | \#[^\n]*)
      | \"{3} (?: \\. | [^\\] )*? \"{3,5} | '{3} .*? '{3,5}
      | " (?: \\. | [^"\\] )* " | '[^']*' | [^\s\[\]{}=,.\#"']+
      | .""",
    re.DOTALL | re.VERBOSE,
)


def file_hint(path: Path, content: bytes) -> str:
    """Describe a file that was given in place of another kind, and what to do with it; empty if unknown.

    >>> file_hint(Path("c.toml"), b"")
    'is a TOML file, not a result; sweep a config first: impact sweep c.toml -o RESULT.h5'
    """
    if content.startswith(RESULT_MAGIC):
        return "is a result, not a text file; impact info, plot, rerun, extend and expand read results"
    word = shlex.quote(str(path))
    if path.suffix.lower() == ".toml":
        return f"is a TOML file, not a result; sweep a config first: impact sweep {word} -o RESULT.h5"
    if path.suffix.lower() == ".csv":
        return f"is a CSV file, not a result; impact plot RESULT.h5 --points {word} draws its points"
    return ""


def read_bytes(path: Path, kind: str, most: int, kind_of_error: type[ImpactError]) -> bytes:
    """Read the first bytes of a regular file, or raise an error of some kind."""
    try:
        if path.is_file() or not path.exists():
            # of length 0 is also a file of the system such as /proc/kmsg, of which reading might never end
            with path.open("rb") as file:
                return file.read(most) if path.stat().st_size else b""
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raised = MissingFileError if isinstance(error, FileNotFoundError) else kind_of_error
        raise raised(f"{path}: cannot be read: {reason}") from None
    raise kind_of_error(f"{path}: not a regular file, expected a {kind} file")


def read_text(path: Path, kind: str = "TOML", most: int = MAX_CONFIG_BYTES) -> str:
    """Read a regular file of text that is not empty or too large, or raise a ConfigError.

    The text is in UTF-8, that of a table also in Windows-1252.
    """
    name, content = str(path), read_bytes(path, kind, most + 1, ConfigError)
    if not content:
        raise ConfigError(f"{name}: empty, expected a {kind} file")
    if content.startswith(RESULT_MAGIC):
        raise ConfigError(f"{name}: {file_hint(path, content)}")
    if content.startswith(NO_TEXT):
        raise ConfigError(f"{name}: not a text file, expected a {kind} file; save a table as CSV")
    if kind == "TOML" and path.suffix.lower() == ".csv":
        names = f'[data] file = "{path.name}" or [sweep] cases = "{path.name}"'
        raise ConfigError(f"{name}: is a CSV file, expected a TOML file, which may have {names}")
    if len(content) > most:
        raise ConfigError(f"{name}: larger than {most:,} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # Excel writes "CSV" in Windows-1252 in western Europe; a zero byte is one of UTF-16, or of no text at all
        if kind == "CSV" and b"\0" not in content:
            with contextlib.suppress(UnicodeDecodeError):
                return content.decode("cp1252")
        line = content.count(b"\n", 0, error.start) + 1
        hint = "; save it as UTF-8" if kind == "CSV" else ""
        raise ConfigError(f"{name}:{line}: not UTF-8: byte 0x{content[error.start]:02x}{hint}") from None


def parse_document(text: str, name: str) -> Any:
    """Parse a TOML text, or a JSON text, which starts with a brace, or raise a ConfigError."""
    is_json = text.lstrip().startswith("{")
    limit = MAX_JSON_LENGTH if is_json else MAX_CONFIG_BYTES
    if len(text) > limit:
        raise ConfigError(f"{name}: larger than {limit:,} characters")
    return _parse(text, json.loads if is_json else tomllib.loads, "JSON" if is_json else "TOML", name)


def _parse(text: str, loads: Callable[[str], object], language: str, name: str) -> object:
    long = LONG_KEY.search(text) if language == "TOML" else None
    if long is not None:
        line = text.count("\n", 0, long.start()) + 1
        raise ConfigError(f"{name}:{line}: a key of more than {MAX_KEY_PARTS} dots: {safe_text(long[0], 40)}")
    try:
        return loads(text)
    except RecursionError:
        # the line with the most opening brackets
        brackets = [line.count("[") + line.count("{") for line in text.split("\n")]
        line = brackets.index(max(brackets)) + 1
        raise ConfigError(f"{name}:{line}: nested too deeply, expected at most {MAX_DEPTH} levels") from None
    except ValueError as error:
        raise ConfigError(f"{name}:{_syntax_error_line(text, language, str(error))}") from None


def _syntax_error_line(text: str, language: str, message: str) -> str:
    """Describe a syntax error by its line number, the message of the parser and the line."""
    lines = text.split("\n")
    digits = re.search(r"[0-9_]{4000}", text)
    if "integer string conversion" in message and digits is not None:
        return f"{text.count(chr(10), 0, digits.start()) + 1}: not {language}: a number of thousands of digits"
    position = re.search(r"\(?at line (\d+), column \d+\)|: line (\d+) column.*$|\(at end of document\)", message)
    line = int(position[1] or position[2] or len(lines)) if position is not None else 1
    reason = message[: position.start()].strip() if position is not None else message
    shown = safe_text(lines[line - 1].strip(), 60)
    return f"{line}: not {language}: {reason}" + (f": {shown}" if shown else "")


def to_plain_data(value: Any, path: KeyPath = ()) -> tuple[Any, list[ConfigProblem]]:
    """Convert a value to dicts, lists and Python numbers; list invalid text and too many levels as problems.

    >>> import numpy as np
    >>> to_plain_data({"e": np.linspace(0, 1, 3), "m2": (1, np.float64(2))})
    ({'e': [0.0, 0.5, 1.0], 'm2': [1, 2.0]}, [])
    """
    if type(value) in (float, int, bool):
        return value, []
    columns: Any = getattr(value, "columns", None)
    if not getattr(columns, "is_unique", True):
        twice = as_text(columns[columns.duplicated()][0])
        return dict.fromkeys(columns), [(path, f"got the column {twice} twice, expected each once")]
    value = _from_library(value)
    if isinstance(value, str) and not _is_storable(value):
        return value, [(path, f"got {as_text(value)}, expected text without NUL and lone surrogates")]
    if not isinstance(value, Mapping | list | tuple | range):
        return value, []
    if len(path) >= MAX_DEPTH:
        return None, [(path, f"nested too deeply, expected at most {MAX_DEPTH} levels")]
    is_table = isinstance(value, Mapping)
    if not is_table and all(type(element) is float for element in value):
        return list(value), []
    problems: list[ConfigProblem] = []
    plain: dict[Any, object] = {}
    for key, element in value.items() if isinstance(value, Mapping) else enumerate(value):
        if is_table and not (isinstance(key, str) and _is_storable(key)):
            problems.append((path, f"got the key {as_text(key)}, expected text without NUL and lone surrogates"))
        else:
            plain[key], of_element = to_plain_data(element, (*path, key))
            problems += of_element
    return plain if is_table else list(plain.values()), problems


def _from_library(value: Any) -> object:
    """Convert a value of numpy, pandas, xarray or pint to numbers, texts and lists; others are unchanged.

    The libraries are not imported: pandas and pint are needed only where a value is theirs.

    >>> import numpy as np
    >>> _from_library(np.arange(2.0)), _from_library(Fraction(1, 2))
    ([0.0, 1.0], 0.5)
    """
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        # whatever the user's default format of pint is
        number, unit = _from_library(value.magnitude), format(value.units, "D")
        return number if unit == "dimensionless" else _with_unit(number, unit)
    if hasattr(value, "iloc") and hasattr(value, "columns"):
        return value.to_dict("list")
    if hasattr(value, "dims") and hasattr(getattr(value, "data", None), "magnitude"):
        # a data array of pint, whose `values` lack the unit
        return _from_library(value.data)
    if not isinstance(value, str | Mapping) and hasattr(value, "values") and hasattr(value, "dtype"):
        # a series, an index or a data array; texts of pandas are in an array of its own
        unit = str(value.attrs.get("units", "")) if hasattr(value, "dims") else ""
        value = value.values
        if differs_from_si(unit):
            return _with_unit(_from_library(value), unit)
        if is_unit(unit) and unit not in ("1", "dimensionless"):
            # numbers in SI are quick to read without a unit: it stays at the first, where its dimension is checked
            return _with_unit(_from_library(value), unit, first=True)
    if getattr(getattr(value, "dtype", None), "char", "") == "g":
        # a long double stays one where it is too large for a float
        with np.errstate(over="ignore"):
            narrow = value.astype(float)
        value = narrow if np.array_equal(np.isinf(narrow), np.isinf(value)) else value
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Fraction | Decimal):
        # one that no float holds, or a signaling NaN
        with contextlib.suppress(OverflowError, ValueError):
            return float(value)
    return value


def _with_unit(number: object, unit: str, *, first: bool = False) -> object:
    """Write numbers as texts with their unit, or only the first of them."""
    if isinstance(number, list):
        end = 1 if first else len(number)
        return [_with_unit(each, unit, first=first) for each in number[:end]] + number[end:]
    # a text has its unit
    return number if isinstance(number, str) else f"{number!r} {unit}"


def to_plain_value(value: object) -> Any:
    """Convert a value of which one is expected: an array of one element is that element.

    >>> import numpy as np
    >>> to_plain_value(np.array([0.5])), to_plain_value(np.arange(2))
    (0.5, [0, 1])
    """
    plain, _ = to_plain_data(value)
    return plain[0] if isinstance(plain, list) and len(plain) == 1 else plain


def read_number(value: object, quantity: Quantity, origin: str) -> float:
    """Read an argument that is one number, bare, with a unit, or of another library.

    >>> time = Quantity("s", "a time", 0)
    >>> read_number("2 us", time, "--dt"), read_number("1e-3", time, "--dt")
    (2e-06, 0.001)
    """
    plain = to_plain_value(value)
    if isinstance(plain, str):
        with contextlib.suppress(ValueError):
            plain = float(plain)
    try:
        return float(quantity.read(plain))
    except PydanticCustomError as error:
        raise UsageError(f"{origin}: {error.message()}") from None


def read_numbers(values: object, quantity: Quantity, origin: str) -> list[float]:
    """Read an argument that is a number or several."""
    plain, _ = to_plain_data(values)
    return [read_number(value, quantity, origin) for value in (plain if isinstance(plain, list) else [plain])]


def _is_storable(text: str) -> bool:
    return "\0" not in text and not re.search("[\ud800-\udfff]", text)


def as_table(value: object) -> dict[str, Any]:
    """Return the value if it is a table, otherwise an empty table."""
    return value if isinstance(value, dict) else {}


def toml_text(value: object) -> str:
    """Write plain data as TOML on one line.

    >>> toml_text({"v1": [1.0, float("inf")], "my steel": "a"})
    '{v1 = [1.0, inf], "my steel" = "a"}'
    """
    match value:
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case bool():
            return str(value).lower()
        case list():
            return f"[{', '.join(map(toml_text, value))}]"
        case dict():
            return f"{{{', '.join(f'{toml_key(key)} = {toml_text(element)}' for key, element in value.items())}}}"
    return repr(value)


def toml_key(name: str) -> str:
    """Write a part of a TOML key."""
    return name if re.fullmatch(BARE_KEY, name) else toml_text(name)


def toml_path(path: KeyPath) -> str:
    """Write a dotted TOML key.

    >>> toml_path(("materials", "steel.2", "E"))
    'materials."steel.2".E'
    """
    return ".".join(toml_key(str(part)) for part in path)


def toml_document(tables: Mapping[KeyPath, Mapping[str, object]]) -> str:
    """Write a table of values at each path as TOML; those at the path () come first, without a header.

    >>> print(toml_document({(): {"title": "a"}, ("model", "hertz"): {"K": 1e6}}), end="")
    title = "a"
    <BLANKLINE>
    [model.hertz]
    K = 1000000.0
    """
    blocks = []
    for path, values in tables.items():
        header = [f"[{toml_path(path)}]"] if path else []
        blocks.append([*header, *(f"{toml_key(name)} = {toml_text(value)}" for name, value in values.items())])
    return "\n\n".join(map("\n".join, blocks)) + "\n"


def override_text(path: KeyPath, value: object) -> str:
    """Write an override that sets a value; one that is too long is a ConfigError.

    >>> override_text(("materials", "steel.2", "E"), [2e11])
    'materials."steel.2".E=[200000000000.0]'
    """
    text = f"{toml_path(path)}={toml_text(value)}"
    if len(text) > MAX_OVERRIDE_LENGTH:
        raise ConfigError(f"{path[-1]}: larger than {MAX_OVERRIDE_LENGTH:,} characters")
    return text


def read_override(text: str) -> tuple[KeyPath, str]:
    """Split an override PATH=VALUE into its path and the text of its value; the path of other texts is empty.

    >>> read_override("sweep.e.linspace=[0,1,11]")
    (('sweep', 'e', 'linspace'), '[0,1,11]')
    """
    # a quoted part of a key may contain "="
    for match in list(re.finditer("=", text[:MAX_CONFIG_BYTES]))[:8]:
        try:
            table = parse_document(f"{text[: match.start()]}=0", "--set")
        except ConfigError:
            continue
        path: list[str] = []
        while isinstance(table, dict) and len(table) == 1:
            ((name, table),) = table.items()
            path.append(name)
        if table == 0 and len(path) <= MAX_KEY_PARTS:
            return tuple(path), text[match.end() :].strip()
        break
    return (), ""


def set_value(
    data: Mapping[str, object], path: KeyPath, value: object, *, new_range: bool = False
) -> tuple[dict[str, Any], KeyPath]:
    """Set the value at a path; also return the part of the path that is new or replaced.

    With `new_range`, one range, fit or distribution replaces another.

    >>> set_value({"sweep": {"e": 0.5}}, ("sweep", "e", "linspace"), [0, 1, 3], new_range=True)
    ({'sweep': {'e': {'linspace': [0, 1, 3]}}}, ('sweep', 'e'))
    """
    name, *rest = (str(part) for part in path)
    if not rest:
        return {**data, name: value}, (name,)
    inner = data.get(name)
    base = inner if isinstance(inner, dict) and not (new_range and len(rest) == 1) else {}
    changed, start = set_value(base, tuple(rest), value, new_range=new_range)
    return {**data, name: changed}, (name,) if base is not inner else (name, *start)


def read_value(text: str) -> object:
    """Read a TOML value, or take the text itself: `sweep.material=steel` needs no quotes."""
    if len(text) > MAX_OVERRIDE_LENGTH:
        return text
    try:
        table = _parse(f"value = {text}", tomllib.loads, "TOML", "--set")
    except ConfigError:
        return text
    return table["value"] if isinstance(table, dict) and table.keys() == {"value"} else text


def path_text(path: KeyPath) -> str:
    """Write a path for a message.

    >>> path_text(("materials", "my steel", "E")), path_text(("sweep", "e", 3))
    ('materials."my steel".E', 'sweep.e[3]')
    """

    def text_of(part: str | int) -> str:
        if isinstance(part, int):
            return f"[{part}]"
        return f".{safe_text(part, 60)}" if re.fullmatch(BARE_KEY, part) else f'."{safe_text(part, 60)}"'

    return "".join(map(text_of, path)).removeprefix(".")


def key_lines(text: str) -> dict[KeyPath, int]:
    """Find the line of every key of a valid TOML text, and of list elements on another line than their list.

    >>> key_lines("a = 1\\n[b]\\nc.d = [\\n  1,\\n  2]")[("b", "c", "d", 1)]
    5
    """
    lines: dict[KeyPath, int] = {}
    tokens = _tokens(text)

    def read_key(token: str, line: int, base: KeyPath, end: str) -> KeyPath:
        """Read a key or header, and record its line, also that of the tables that a dotted one implies."""
        path = base
        while token != end:
            if token not in ("[", "."):
                # without quotes and escapes
                part = next(iter(tomllib.loads(f"{token} = 0"))) if token.startswith(("'", '"')) else token
                path = (*path, part)
                lines.setdefault(path, line)
            token, _ = next(tokens)
        return path

    def read_value(token: str, line: int, path: KeyPath) -> tuple[str, int]:
        """Read a value, and return the token after it."""
        if token not in ("[", "{"):
            while token not in (",", "]", "}", "\n"):
                token, line = next(tokens)
            return token, line
        index, (element, start) = 0, next(tokens)
        while element not in ("]", "}"):
            if token == "{":
                inner = read_key(element, start, path, "=")
                element, start = next(tokens)
            else:
                inner, index = (*path, index), index + 1
                if start != line:
                    lines[inner] = start
            element, start = read_value(element, start, inner)
            if element == ",":
                element, start = next(tokens)
        return next(tokens)

    table: KeyPath = ()
    for token, line in tokens:
        if token == "[":
            table = read_key(token, line, (), "]")
        elif token not in ("]", "\n"):
            path = read_key(token, line, table, "=")
            read_value(*next(tokens), path)
    return lines


def _tokens(text: str) -> Iterator[tuple[str, int]]:
    """Split a TOML text, without spaces and comments, and without the line breaks in lists; with their lines."""
    line, depth = 1, 0
    for match in TOML_TOKEN.finditer(f"{text}\n"):
        depth += (match[0] in ("[", "{")) - (match[0] in ("]", "}"))
        if match["skip"] is None and (match[0] != "\n" or depth == 0):
            yield match[0], line
        line += match[0].count("\n")
