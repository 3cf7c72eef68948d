"""Where in a config a key stands, and its problems as lines: file:line: key: got X, expected Y."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from pydantic import ValidationError

from ..contact.model import ForceModel
from ..text import safe_text
from . import quantities
from .quantities import RANGES, Column, Fault, KeyPath, nearest, show
from .tables import MATERIAL_QUANTITIES, MODELS, Document, MaterialTable, Output, Solver, Sweep, model_quantities

MAX_LINES = 100
EXPECTED = {
    "sweep": "a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...",
    "models": MODELS,
    **{name: f"{quantity.expected}: {quantity.meaning}" for name, quantity in MATERIAL_QUANTITIES.items()},
    **{name: str(info.description) for name, info in Column.model_fields.items()},
}
# what else a key might be called
WORDS = {
    "restitution": "e", "cor": "e", "mass1": "m1", "mass2": "m2", "speed1": "v1", "speed2": "v2",
    "velocity1": "v1", "velocity2": "v2", "radius1": "R1", "radius2": "R2", "stiffness": "K", "exponent": "n",
    "youngs_modulus": "E", "poisson": "nu", "poissons_ratio": "nu", "density": "rho",
}  # fmt: skip

BARE = r"[A-Za-z0-9_-]++"
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
            bare = re.fullmatch(BARE, part)
            shown += ("." if shown else "") + (safe_text(part, 60) if bare else f'"{safe_text(part, 60)}"')
    return shown


def key_lines(text: str) -> dict[KeyPath, int]:
    """The line of every key of a valid TOML text, and of list items that do not stand on their list's line.

    >>> key_lines("a = 1\\n[b]\\nc.d = [\\n  1,\\n  2]")[("b", "c", "d", 1)]
    5
    """
    scanner = _Scanner()
    for match in TOKEN.finditer(text):
        scanner.read(match[0], str(match.lastgroup))
    return scanner.lines


class _Scanner:
    """Reads the tokens of a TOML text, and notes the line of each key."""

    def __init__(self) -> None:
        self.lines: dict[KeyPath, int] = {}
        self.line = 1
        self.table: KeyPath = ()
        self.path: KeyPath = ()  # of the key or item being read
        self.parts: list[str] = []  # of the key being read, from line `started` on
        self.started = 1
        self.is_key = True
        self.opened: list[tuple[KeyPath, int | None]] = []  # inline tables, and lists with the place of their item

    def read(self, token: str, kind: str) -> None:
        if kind == "newline" and not self.opened:
            self.is_key, self.parts = True, []
        elif kind not in ("newline", "skip"):
            if self.is_key:
                self._key(token, kind)
            else:
                self._value(token)
        self.line += token.count("\n")

    def _key(self, token: str, kind: str) -> None:
        if kind == "name":
            self.started = self.started if self.parts else self.line
            self.parts.append(_name(token))
        elif token == "=":
            self._named(self.opened[-1][0] if self.opened else self.table)
            self.is_key = False
        elif token == "]" and self.parts:
            self._named(())
            self.table = self.path
        elif token == "}":
            self.path, self.is_key = self.opened.pop()[0], False

    def _named(self, base: KeyPath) -> None:
        """A key or a header is whole; a dotted one makes its parents too."""
        self.path = (*base, *self.parts)
        self.parts = []
        for end in range(len(base) + 1, len(self.path) + 1):
            self.lines.setdefault(self.path[:end], self.started)

    def _value(self, token: str) -> None:
        if token in ("]", "}"):
            self.path = self.opened.pop()[0]
        elif token == ",":
            base, place = self.opened[-1]
            self.is_key = place is None
            if place is not None:
                self.opened[-1] = (base, place + 1)
                self.path = (*base, place + 1)
        else:
            if self.opened and self.opened[-1][1] is not None and self.lines.get(self.opened[-1][0]) != self.line:
                self.lines.setdefault(self.path, self.line)
            if token in ("[", "{"):
                self.opened.append((self.path, 0 if token == "[" else None))
                self.path, self.is_key = (*self.path, 0) if token == "[" else self.path, token == "{"


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
        for end in range(len(path), 0, -1):
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
        # what a model asks for, and has no table yet, is asked for where models are chosen
        return self.find(("models",)) if path[:1] == ("model",) else ((0, 0), safe_text(self.name))

    def _replaced(self, path: KeyPath) -> bool:
        """Whether what the source says at a path was overridden."""
        return any(path[:end] in self.overridden for end in range(len(path) + 1))


def faults_of(error: ValidationError, known: Mapping[str, ForceModel]) -> Iterable[Fault]:
    """What is wrong, with the path of each value, from what pydantic says."""
    for count, item in enumerate(error.errors(include_url=False)):
        # the tags of unions are no keys
        path: KeyPath = tuple(part for part in item["loc"] if not (isinstance(part, str) and "\0" in part))
        match item["type"]:
            case "fault":
                yield path, item["msg"]
            case "missing":
                yield path, f"missing, expected {EXPECTED[str(path[-1])]}"
            case "extra_forbidden" | "unexpected_keyword_argument":
                yield path, f"unknown key; {_hint(item['loc'], known) if count < MAX_LINES else ''}"
            case "literal_error":
                choices = ", ".join(re.findall("'([^']*)'", item["ctx"]["expected"]))
                yield path, f"got {show(item['input'])}, expected one of {choices}"
            case _:
                yield path, f"got {show(item['input'])}, expected a table"


def _hint(location: KeyPath, known: Mapping[str, ForceModel]) -> str:
    """What an unknown key might have been; `location` is its path, with tags."""
    name = str(location[-1])
    if len(location) == 1 and name in Sweep.model_fields:
        return "it belongs under [sweep]"
    keys: Iterable[str]
    match location[:-1]:
        case (*_, quantities.RANGE):
            keys = RANGES
        case (*_, quantities.COLUMN):
            keys = Column.model_fields
        case ():
            keys = Document.model_fields
        case ("sweep",):
            keys = Sweep.model_fields
        case ("materials", _):
            keys = MaterialTable.model_fields
        case ("model",):
            keys = known
        case ("model", key):
            keys = model_quantities(known[str(key)])
        case (table, *_):
            keys = vars(Solver() if table == "solver" else Output())
    return nearest(name, list(keys), WORDS)


def lines_of(found: Iterable[Fault], places: Places) -> list[str]:
    """One line for each fault, in the order of the file, then of the overrides."""
    located = sorted(((*places.find(path), path, message) for path, message in found), key=lambda item: item[0])
    lines = [
        ": ".join(part for part in (place, path_text(path), message) if part)
        for _, place, path, message in located
    ]
    if len(lines) > MAX_LINES:
        lines[MAX_LINES:] = [f"and {len(lines) - MAX_LINES} more"]
    return lines
