"""Where in a config a key stands: dotted paths, the line of each key of a TOML text, and overrides."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..text import safe_text
from .values import KeyPath

MAX_PARTS = 64  # dots of a key: TOML parsers take quadratic time over longer ones
_BARE = r"[A-Za-z0-9_-]++"
_PART = rf"""(?:{_BARE}|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
_DOT = r"[ \t]*+\.[ \t]*+"
LONG_KEY = re.compile(rf"(?<![\w.-])(?:{_PART}{_DOT}){{{MAX_PARTS + 1}}}")
OVERRIDE = re.compile(rf"\s*({_PART}(?:{_DOT}{_PART})*+)\s*=(.*)", re.DOTALL)

TOKEN = re.compile(
    r"""(?P<newline>\n)
      | (?P<skip>[ \t\r]+ | \#[^\n]*)
      | (?P<long>\"{3} (?: \\. | [^\\] )*? \"{3,5} | '{3} .*? '{3,5})
      | (?P<name>" (?: \\. | [^"\\] )* " | '[^']*' | [^\s\[\]{}=,.\#"']+)
      | (?P<mark>.)""",
    re.DOTALL | re.VERBOSE,
)


def path_text(path: KeyPath) -> str:
    """A path as it is written in a message.

    >>> path_text(("materials", "my steel", "E")), path_text(("sweep", "e", 3))
    ('materials."my steel".E', 'sweep.e[3]')
    """
    shown = ""
    for part in path:
        if isinstance(part, int):
            shown += f"[{part}]"
        else:
            bare = re.fullmatch(_BARE, part)
            shown += ("." if shown else "") + (safe_text(part, 60) if bare else f'"{safe_text(part, 60)}"')
    return shown


def _name(token: str) -> str:
    """The name that a part of a key stands for."""
    if token.startswith("'"):
        return token[1:-1]
    if not token.startswith('"'):
        return token
    try:
        # TOML's escapes are JSON's and \UXXXXXXXX, the same for a name without one of those
        return str(json.loads(token))
    except ValueError:
        return token[1:-1]


def key_lines(text: str) -> dict[KeyPath, int]:
    """The line of every key of a valid TOML text, and of list items that do not stand on their list's line.

    >>> key_lines("a = 1\\n[b]\\nc.d = [\\n  1,\\n  2]")[("b", "c", "d", 1)]
    5
    """
    lines: dict[KeyPath, int] = {(): 1}
    table: KeyPath = ()
    path: KeyPath = ()  # of the key or item being read
    parts: list[str] = []
    opened: list[tuple[KeyPath, int | None]] = []  # inline tables, and lists with the place of their item
    reading_key, started, line = True, 1, 1
    for match in TOKEN.finditer(text):
        token, kind = match[0], match.lastgroup
        if kind == "newline" and not opened:
            reading_key, parts = True, []
        elif kind in ("newline", "skip"):
            pass
        elif reading_key and kind == "name":
            started = started if parts else line
            parts.append(_name(token))
        elif reading_key and (token == "=" or (token == "]" and parts)):
            base = () if token == "]" else opened[-1][0] if opened else table
            path = (*base, *parts)
            # a dotted key or header makes its parents too
            for end in range(len(base) + 1, len(path) + 1):
                lines.setdefault(path[:end], started)
            table, reading_key, parts = (path, True, []) if token == "]" else (table, False, [])
        elif reading_key and token == "}":
            path, reading_key = opened.pop()[0], False
        elif not reading_key and token in ("]", "}"):
            path = opened.pop()[0]
        elif not reading_key and token == ",":
            base, place = opened[-1]
            reading_key = place is None
            if place is not None:
                opened[-1] = (base, place + 1)
                path = (*base, place + 1)
        elif not reading_key:
            if opened and opened[-1][1] is not None and lines.get(opened[-1][0]) != line:
                lines.setdefault(path, line)
            if token in ("[", "{"):
                opened.append((path, 0 if token == "[" else None))
                path, reading_key = (*path, 0) if token == "[" else path, token == "{"
        line += token.count("\n")
    return lines


@dataclass(frozen=True)
class Places:
    """Where the value at a path was given, as a message says it.

    Parameters
    ----------
    name : the file, or another name of the source
    lines : the line of each path; empty for a source without lines
    overrides : the overrides in order
    overridden : for each path that overrides changed, which of them, and the path that it names
    """

    name: str
    lines: Mapping[KeyPath, int] = field(default_factory=dict)
    overrides: tuple[str, ...] = ()
    overridden: Mapping[KeyPath, tuple[int, KeyPath]] = field(default_factory=dict)

    def find(self, path: KeyPath) -> tuple[tuple[int, int], str]:
        """A rank, in the order of the file and then of the overrides, and the place in words."""
        for end in range(len(path), -1, -1):
            if path[:end] in self.overridden:
                which, named = self.overridden[path[:end]]
                shared = min(len(path), len(named))
                # a table made for one key is no place for another that is missing in it
                if path[:shared] == named[:shared]:
                    return (1, which), f"--set {safe_text(self.overrides[which])}"
                break
            if path[:end] in self.lines and not self._replaced(path[:end]):
                line = self.lines[path[:end]]
                return (0, line), f"{safe_text(self.name)}:{line}"
        return (0, 0), safe_text(self.name)

    def _replaced(self, path: KeyPath) -> bool:
        """Whether what the source says at a path was overridden."""
        return any(path[:end] in self.overridden for end in range(len(path) + 1))


def read_override(text: str) -> tuple[KeyPath, str] | None:
    """The path and the value's text of an override `PATH=VALUE`; None if it is not one.

    >>> read_override("sweep.e.linspace=[0,1,11]")
    (('sweep', 'e', 'linspace'), '[0,1,11]')
    """
    match = OVERRIDE.fullmatch(text)
    if match is None:
        return None
    path = tuple(_name(part) for part in re.findall(_PART, match[1]))
    return (path, match[2].strip()) if len(path) <= MAX_PARTS else None


def overriding(
    data: Mapping[str, object], path: KeyPath, value: object, new_range: bool
) -> tuple[dict[str, object], KeyPath]:
    """The data with the value at the path, and the part of the path that is new or replaced.

    `new_range` drops what else the innermost table holds: a range replaces another.

    >>> overriding({"sweep": {"e": 0.5}}, ("sweep", "e", "linspace"), [0, 1, 3], True)
    ({'sweep': {'e': {'linspace': [0, 1, 3]}}}, ('sweep', 'e'))
    """
    name, *rest = (str(part) for part in path)
    if not rest:
        return {**data, name: value}, (name,)
    inner = data.get(name)
    kept = inner if isinstance(inner, dict) and not (new_range and len(rest) == 1) else {}
    changed, start = overriding(kept, tuple(rest), value, new_range)
    whole = kept is not inner
    return {**data, name: changed}, (name,) if whole else (name, *start)
