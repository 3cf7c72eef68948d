"""What a config is read from, made into plain data: files, texts, mappings, overrides; none is trusted."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError
from ..text import safe_text
from .lines import BARE
from .quantities import RANGES, Fault, KeyPath, show

MAX_BYTES = 1_000_000  # of a config file
MAX_OVERRIDE = 4_000_000  # characters of a value that is set
MAX_DEPTH = 8  # of nested tables and lists; the deepest key needs 5
MAX_TEXT = 64_000_000  # of a mapping as JSON, whose axes may have been written out
MAX_PARTS = 64  # dots of a key: TOML parsers take quadratic time over longer ones
_PART = rf"""(?:{BARE}|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
LONG_KEY = re.compile(rf"(?<![\w.-])(?:{_PART}[ \t]*+\.[ \t]*+){{{MAX_PARTS + 1}}}")


def read_text(path: Path, kind: str = "TOML", most: int = MAX_BYTES) -> str:
    """The text of a file.

    Raises
    ------
    ConfigError : it is not a regular file, cannot be read, is too large or is not UTF-8
    """
    name = safe_text(str(path))
    try:
        if path.exists() and not path.is_file():
            raise ConfigError([f"{name}: not a regular file, expected a {kind} file"])
        with path.open("rb") as file:
            content = file.read(most + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ConfigError([f"{name}: cannot be read: {safe_text(reason)}"]) from None
    if len(content) > most:
        raise ConfigError([f"{name}: larger than {most:,} bytes, which no config needs"])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ConfigError([f"{name}:{line}: not UTF-8: byte 0x{content[error.start]:02x}"]) from None


def load(text: str, name: str) -> Any:
    """What a TOML text, or a JSON text, which starts with a brace, says.

    Raises
    ------
    ConfigError : the text is not of the language, or costs the parser too much
    """
    name = safe_text(name)
    is_json = text.lstrip().startswith("{")
    if len(text) > (MAX_TEXT if is_json else MAX_BYTES):
        raise ConfigError([f"{name}: larger than any config"])
    return _parse(text, json.loads if is_json else tomllib.loads, "JSON" if is_json else "TOML", name)


def _parse(text: str, loads: Callable[[str], object], language: str, name: str) -> object:
    long = LONG_KEY.search(text) if language == "TOML" else None
    if long is not None:
        line = text.count("\n", 0, long.start()) + 1
        raise ConfigError([f"{name}:{line}: a key of more than {MAX_PARTS} dots: {safe_text(long[0], 40)}"])
    try:
        return loads(text)
    except RecursionError:
        line = max(range(1, text.count("\n") + 2), key=_nesting(text).__getitem__)
        raise ConfigError([f"{name}:{line}: nested too deeply, expected at most {MAX_DEPTH} levels"]) from None
    except ValueError as error:
        raise ConfigError([f"{name}:{_explained(text, language, str(error))}"]) from None


def _nesting(text: str) -> list[int]:
    """Opening brackets of each line, from line 1; a guess that is enough to find the absurd one."""
    return [0, *(line.count("[") + line.count("{") for line in text.split("\n"))]


def _explained(text: str, language: str, message: str) -> str:
    lines = text.split("\n")
    digits = re.search(r"[0-9_]{4000}", text)
    if "integer string conversion" in message and digits is not None:
        return f"{text.count(chr(10), 0, digits.start()) + 1}: not {language}: a number of thousands of digits"
    found = re.search(r"\(?at line (\d+), column \d+\)|: line (\d+) column.*$|\(at end of document\)", message)
    line = int(found[1] or found[2] or len(lines)) if found is not None else 1
    reason = message[: found.start()].strip() if found is not None else message
    shown = safe_text(lines[line - 1].strip(), 60)
    return f"{line}: not {language}: {safe_text(reason)}" + (f": {shown}" if shown else "")


def plain(value: object, path: KeyPath = ()) -> tuple[Any, list[Fault]]:
    """The value in dicts, lists and plain Python numbers, and what keeps it from being that.

    >>> plain({"e": np.linspace(0, 1, 3), "m2": (1, np.float64(2))})
    ({'e': [0.0, 0.5, 1.0], 'm2': [1, 2.0]}, [])
    """
    if type(value) in (float, int, bool):
        return value, []
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, str) and not _storable(value):
        return value, [(path, f"got {show(value)}, expected text without NUL and lone surrogates")]
    if not isinstance(value, Mapping | list | tuple):
        return value, []
    if len(path) >= MAX_DEPTH:
        return None, [(path, f"nested too deeply, expected at most {MAX_DEPTH} levels")]
    found: list[Fault] = []
    if isinstance(value, list | tuple):
        if all(type(item) is float for item in value):
            return list(value), []
        items: list[object] = []
        for place, item in enumerate(value):
            made, wrong = plain(item, (*path, place))
            items.append(made)
            found += wrong
        return items, found
    table: dict[str, object] = {}
    for key, item in value.items():
        if not isinstance(key, str) or not _storable(key):
            found.append((path, f"got the key {show(key)}, expected text without NUL and lone surrogates"))
        else:
            table[key], wrong = plain(item, (*path, key))
            found += wrong
    return table, found


def _storable(text: str) -> bool:
    return "\0" not in text and not re.search("[\ud800-\udfff]", text)


def toml_text(value: object) -> str:
    """A value of plain data as TOML on one line.

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
            return f"{{{', '.join(f'{toml_key(key)} = {toml_text(item)}' for key, item in value.items())}}}"
    return repr(value)


def toml_key(name: str) -> str:
    """A part of a TOML key."""
    return name if re.fullmatch(BARE, name) else toml_text(name)


def apply_overrides(
    data: dict[str, Any], overrides: Sequence[str]
) -> tuple[dict[str, Any], dict[KeyPath, tuple[int, KeyPath]], list[str]]:
    """The data after overrides such as `sweep.e.linspace=[0,1,11]`, which gave which path, and problems."""
    problems: list[str] = []
    overridden: dict[KeyPath, tuple[int, KeyPath]] = {}
    for which, text in enumerate(overrides):
        path, written = read_override(text)
        if not path:
            problems.append(f"--set {safe_text(text)}: expected PATH=VALUE, such as sweep.e=0.5")
            continue
        new_range = path[0] in ("sweep", "model", "materials") and len(path) > 2 and path[-1] in RANGES
        data, start = _replaced(data, path, _value(written), new_range)
        overridden = {old: by for old, by in overridden.items() if old[: len(start)] != start}
        overridden[start] = (which, path)
        other = "alpha" if path[:2] == ("sweep", "e") else "e" if path[:2] == ("sweep", "alpha") else None
        if other:
            # each says what the other would: what is set last takes the place of what was there before
            overridden = {old: by for old, by in overridden.items() if old[:2] != ("sweep", other)}
            data = {**data, "sweep": {key: item for key, item in data["sweep"].items() if key != other}}
    return data, overridden, problems


def read_override(text: str) -> tuple[KeyPath, str]:
    """The path and the value's text of an override PATH=VALUE; an empty path if it is not one.

    >>> read_override("sweep.e.linspace=[0,1,11]")
    (('sweep', 'e', 'linspace'), '[0,1,11]')
    """
    # a quoted part of a key may hold "="
    for match in list(re.finditer("=", text[:MAX_BYTES]))[:8]:
        try:
            table = load(f"{text[: match.start()]}=0", "--set")
        except ConfigError:
            continue
        path: list[str] = []
        while isinstance(table, dict) and len(table) == 1:
            ((name, table),) = table.items()
            path.append(name)
        return (tuple(path), text[match.end() :].strip()) if table == 0 and len(path) <= MAX_PARTS else ((), "")
    return (), ""


def _replaced(
    data: Mapping[str, object], path: KeyPath, value: object, new_range: bool
) -> tuple[dict[str, Any], KeyPath]:
    """The data with the value at the path, and the part of the path that is new or replaced.

    `new_range` drops what else the innermost table holds: a range replaces another.

    >>> _replaced({"sweep": {"e": 0.5}}, ("sweep", "e", "linspace"), [0, 1, 3], True)
    ({'sweep': {'e': {'linspace': [0, 1, 3]}}}, ('sweep', 'e'))
    """
    name, *rest = (str(part) for part in path)
    if not rest:
        return {**data, name: value}, (name,)
    inner = data.get(name)
    kept = inner if isinstance(inner, dict) and not (new_range and len(rest) == 1) else {}
    changed, start = _replaced(kept, tuple(rest), value, new_range)
    return {**data, name: changed}, (name,) if kept is not inner else (name, *start)


def _value(text: str) -> object:
    """A TOML value, or the text itself: `sweep.material=steel` needs no quotes."""
    if len(text) > MAX_OVERRIDE:
        return text
    try:
        table = _parse(f"value = {text}", tomllib.loads, "TOML", "--set")
    except ConfigError:
        return text
    return table["value"] if isinstance(table, dict) and table.keys() == {"value"} else text
