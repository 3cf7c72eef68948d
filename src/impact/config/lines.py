"""Line numbers of keys, and problems of a config as lines: file:line: key: got X, expected Y."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping

from pydantic import ValidationError

from ..contact.model import ForceModel
from ..errors import did_you_mean
from ..formatting import safe_text
from . import quantities, tables
from .quantities import VALUE_FORMS, Column, ConfigProblem, KeyPath, as_text

MAX_PROBLEM_LINES = 100
EXPECTED_BY_KEY = {
    "sweep": "a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...",
    "models": tables.MODELS_EXPECTED,
    **{name: f"{quantity.expected}: {quantity.meaning}" for name, quantity in tables.MATERIAL_QUANTITIES.items()},
    **{name: str(info.description) for name, info in Column.model_fields.items()},
    "n": f"the number of {tables.Design.model_fields['n'].description}, such as 1024",
}
KEYS_BY_TABLE: Mapping[str, Iterable[str]] = {
    "sweep": tables.Sweep.model_fields,
    "design": tables.Design.model_fields,
    "data": tables.Data.model_fields,
    "solver": vars(tables.Solver()),
    "output": vars(tables.Output()),
}
# other words that users may write for a key
KEY_SYNONYMS = {
    "restitution": "e",
    "cor": "e",
    "stiffness": "K",
    "exponent": "n",
    "youngs_modulus": "E",
    "poisson": "nu",
    "poissons_ratio": "nu",
    "density": "rho",
    "friction": "mu",
    "friction_coefficient": "mu",
    "impact_angle": "angle",
}
WORDS_OF_BALLS = {
    "mass": "m",
    "speed": "v",
    "velocity": "v",
    "radius": "R",
    "spin": "omega",
    "tangential_velocity": "u",
}
KEY_SYNONYMS |= {f"{word}{ball}": f"{key}{ball}" for word, key in WORDS_OF_BALLS.items() for ball in "12"}

BARE_KEY = r"[A-Za-z0-9_-]++"
TOML_TOKEN = re.compile(
    r"""(?P<newline>\n)
      | (?P<skip>[ \t\r]+ | \#[^\n]*)
      | (?P<long>\"{3} (?: \\. | [^\\] )*? \"{3,5} | '{3} .*? '{3,5})
      | (?P<name>" (?: \\. | [^"\\] )* " | '[^']*' | [^\s\[\]{}=,.\#"']+)
      | (?P<mark>.)""",
    re.DOTALL | re.VERBOSE,
)


def path_text(path: KeyPath) -> str:
    """Write a path for a message.

    >>> path_text(("materials", "my steel", "E")), path_text(("sweep", "e", 3))
    ('materials."my steel".E', 'sweep.e[3]')
    """
    shown = ""
    for part in path:
        if isinstance(part, int):
            shown += f"[{part}]"
        else:
            bare = re.fullmatch(BARE_KEY, part)
            shown += ("." if shown else "") + (safe_text(part, 60) if bare else f'"{safe_text(part, 60)}"')
    return shown


def key_lines(text: str) -> dict[KeyPath, int]:
    """Find the line of every key of a valid TOML text, and of list elements on another line than their list.

    >>> key_lines("a = 1\\n[b]\\nc.d = [\\n  1,\\n  2]")[("b", "c", "d", 1)]
    5
    """
    scanner = _KeyScanner()
    for match in TOML_TOKEN.finditer(text):
        scanner.read(match[0], str(match.lastgroup))
    return scanner.lines


class _KeyScanner:
    """Reads the tokens of a TOML text and records the line of each key."""

    def __init__(self) -> None:
        self.lines: dict[KeyPath, int] = {}
        self.line = 1
        self.table: KeyPath = ()
        self.path: KeyPath = ()  # of the key or list element being read
        self.parts: list[str] = []  # of the key being read, which begins on line `started`
        self.started = 1
        self.is_key = True
        # open inline tables, with None, and open lists, with the index of the element being read
        self.opened: list[tuple[KeyPath, int | None]] = []

    def read(self, token: str, kind: str) -> None:
        if kind == "newline" and not self.opened:
            self.is_key, self.parts = True, []
        elif kind not in ("newline", "skip"):
            if self.is_key:
                self._read_key(token, kind)
            else:
                self._read_value(token)
        self.line += token.count("\n")

    def _read_key(self, token: str, kind: str) -> None:
        if kind == "name":
            self.started = self.started if self.parts else self.line
            self.parts.append(_unquoted(token))
        elif token == "=":
            self._end_key(self.opened[-1][0] if self.opened else self.table)
            self.is_key = False
        elif token == "]" and self.parts:
            self._end_key(())
            self.table = self.path
        elif token == "}":
            self.path, self.is_key = self.opened.pop()[0], False

    def _end_key(self, base: KeyPath) -> None:
        """Record the line of a complete key or header, and of the tables that a dotted one implies."""
        self.path = (*base, *self.parts)
        self.parts = []
        for end in range(len(base) + 1, len(self.path) + 1):
            self.lines.setdefault(self.path[:end], self.started)

    def _read_value(self, token: str) -> None:
        if token in ("]", "}"):
            self.path = self.opened.pop()[0]
        elif token == ",":
            base, index = self.opened[-1]
            self.is_key = index is None
            if index is not None:
                self.opened[-1] = (base, index + 1)
                self.path = (*base, index + 1)
        else:
            if self.opened and self.opened[-1][1] is not None and self.lines.get(self.opened[-1][0]) != self.line:
                self.lines.setdefault(self.path, self.line)
            if token in ("[", "{"):
                self.opened.append((self.path, 0 if token == "[" else None))
                self.path, self.is_key = (*self.path, 0) if token == "[" else self.path, token == "{"


def _unquoted(token: str) -> str:
    """Remove the quotes and escapes of a part of a key."""
    if not token.startswith(("'", '"')):
        return token
    (part,) = tomllib.loads(f"{token} = 0")
    return part


def validation_problems(error: ValidationError, models: Mapping[str, ForceModel]) -> Iterable[ConfigProblem]:
    """List the problems that pydantic reports, with the path of each value."""
    for n_problems, detail in enumerate(error.errors(include_url=False)):
        # the tags of unions are not keys
        path: KeyPath = tuple(part for part in detail["loc"] if not (isinstance(part, str) and "\0" in part))
        match detail["type"]:
            case quantities.PROBLEM_TYPE:
                yield path, detail["msg"]
            case "missing":
                yield path, f"missing, expected {EXPECTED_BY_KEY[str(path[-1])]}"
            case "extra_forbidden" | "unexpected_keyword_argument":
                # hints take time, and later lines are not printed
                hint = _unknown_key_hint(detail["loc"], models) if n_problems < MAX_PROBLEM_LINES else ""
                yield path, f"unknown key; {hint}"
            case "literal_error":
                choices = ", ".join(re.findall("'([^']*)'", detail["ctx"]["expected"]))
                yield path, f"got {as_text(detail['input'])}, expected one of {choices}"
            case _:
                yield path, f"got {as_text(detail['input'])}, expected a table"


def _unknown_key_hint(location: KeyPath, models: Mapping[str, ForceModel]) -> str:
    """Suggest a known key for an unknown one; `location` is its path, with tags."""
    name = str(location[-1])
    if len(location) == 1 and name in tables.Sweep.model_fields:
        return "it belongs under [sweep]"
    keys: Iterable[str]
    match location[:-1]:
        case (*_, quantities.RANGE):
            keys = VALUE_FORMS
        case (*_, quantities.FIT):
            keys = ("fit",)
        case (*_, quantities.DISTRIBUTION):
            keys = quantities.DISTRIBUTION_FORMS
        case (*_, quantities.COLUMN):
            keys = Column.model_fields
        case ():
            keys = tables.Document.model_fields
        case ("materials", _):
            keys = tables.MaterialTable.model_fields
        case ("model" | "friction" as table,):
            keys = tables.laws_of(table, models)
        case ("model" | "friction" as table, key):
            keys = tables.law_quantities(tables.laws_of(table, models)[str(key)])
        case (table, *_):
            keys = KEYS_BY_TABLE[str(table)]
    return did_you_mean(name, list(keys), KEY_SYNONYMS)
