"""What a config is read from, made into plain data: a file, a text, a mapping, overrides; none is trusted."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError
from ..text import safe_text
from .places import LONG_KEY, MAX_PARTS, overriding, read_override
from .ranges import RANGES
from .values import Fault, KeyPath, show

MAX_BYTES = 1_000_000  # of a file
MAX_DEPTH = 8  # of nested tables and lists; the deepest key needs 5
MAX_TEXT = 64_000_000  # of a mapping as JSON, whose axes may have been written out

Loads = Callable[[str], object]


def read_text(path: Path) -> str:
    """The text of a config file.

    Raises
    ------
    ConfigError : it is not a regular file, cannot be read, is too large or is not UTF-8
    """
    name = safe_text(str(path))
    try:
        if path.exists() and not path.is_file():
            raise ConfigError([f"{name}: not a regular file, wants a TOML file"])
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ConfigError([f"{name}: cannot be read: {safe_text(reason)}"]) from None
    if len(content) > MAX_BYTES:
        raise ConfigError([f"{name}: larger than {MAX_BYTES:,} bytes, which no config needs"])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ConfigError([f"{name}:{line}: not UTF-8: byte 0x{content[error.start]:02x}"]) from None


def load(text: str, loads: Loads, language: str, name: str) -> object:
    """What a parser makes of a text.

    Raises
    ------
    ConfigError : the text is not of the language, or costs the parser too much
    """
    name = safe_text(name)
    if len(text) > (MAX_BYTES if language == "TOML" else MAX_TEXT):
        raise ConfigError([f"{name}: larger than any config"])
    long = LONG_KEY.search(text) if language == "TOML" else None
    if long is not None:
        line = text.count("\n", 0, long.start()) + 1
        raise ConfigError([f"{name}:{line}: a key of more than {MAX_PARTS} dots: {safe_text(long[0], 40)}"])
    try:
        return loads(text)
    except RecursionError:
        line = max(range(1, text.count("\n") + 2), key=_nesting(text).__getitem__)
        raise ConfigError([f"{name}:{line}: nested too deeply, wants at most {MAX_DEPTH} levels"]) from None
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
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, str) and not _storable(value):
        return value, [(path, f"got {show(value)}, wants text without NUL and lone surrogates")]
    if not isinstance(value, Mapping | list | tuple):
        return value, []
    if len(path) >= MAX_DEPTH:
        return None, [(path, f"nested too deeply, wants at most {MAX_DEPTH} levels")]
    faults: list[Fault] = []
    if isinstance(value, list | tuple):
        items: list[object] = []
        for place, item in enumerate(value):
            made, wrong = plain(item, (*path, place))
            items.append(made)
            faults += wrong
        return items, faults
    table: dict[str, object] = {}
    for key, item in value.items():
        if not isinstance(key, str) or not _storable(key):
            faults.append((path, f"got the key {show(key)}, wants text without NUL and lone surrogates"))
        else:
            table[key], wrong = plain(item, (*path, key))
            faults += wrong
    return table, faults


def _storable(text: str) -> bool:
    return "\0" not in text and not re.search("[\ud800-\udfff]", text)


def apply_overrides(
    data: dict[str, object], overrides: Sequence[str], loads: Loads
) -> tuple[dict[str, object], dict[KeyPath, tuple[int, KeyPath]], list[str]]:
    """The data after overrides such as `sweep.e.linspace=[0,1,11]`, which gave which path, and problems."""
    problems: list[str] = []
    overridden: dict[KeyPath, tuple[int, KeyPath]] = {}
    for which, text in enumerate(overrides):
        found = read_override(text)
        if found is None:
            problems.append(f"--set {safe_text(text)}: wants PATH=VALUE, such as sweep.e=0.5")
            continue
        path, written = found
        new_range = path[0] in ("sweep", "model") and len(path) > 2 and path[-1] in RANGES
        data, start = overriding(data, path, _value(written, loads), new_range)
        overridden = {old: by for old, by in overridden.items() if old[: len(start)] != start}
        overridden[start] = (which, path)
        other = "alpha" if path[:2] == ("sweep", "e") else "e" if path[:2] == ("sweep", "alpha") else None
        if other:
            # each says what the other would: what is set last takes the place of what was there before
            overridden = {old: by for old, by in overridden.items() if old[:2] != ("sweep", other)}
            data = {**data, "sweep": {k: v for k, v in _table(data["sweep"]).items() if k != other}}
    return data, overridden, problems


def _table(value: object) -> Mapping[str, object]:
    return value if isinstance(value, dict) else {}


def _value(text: str, loads: Loads) -> object:
    """A TOML value, or the text itself: `sweep.material=steel` needs no quotes."""
    try:
        table = load(f"value = {text}", loads, "TOML", "--set")
    except ConfigError:
        return text
    return table["value"] if isinstance(table, dict) and table.keys() == {"value"} else text
