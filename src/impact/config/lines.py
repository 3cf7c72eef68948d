"""Line numbers of keys, and problems of a config as lines: file:line: key: got X, expected Y."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from pydantic import ValidationError

from ..contact.model import ForceModel
from ..errors import did_you_mean
from ..formatting import safe_text
from . import quantities, tables
from .quantities import VALUE_FORMS, Column, ConfigProblem, KeyPath, as_text

MAX_PROBLEM_LINES = 100
EXPECTED_BY_KEY = {
    "sweep": "a table [sweep] of what to sweep: e or alpha, v1, m1, m2, material, ...",
    "models": tables.LAWS_EXPECTED["model"],
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
# where keys that are in another table belong
HOMES: Mapping[str, Iterable[str]] = {
    "under [sweep]": tables.Sweep.model_fields,
    "under [materials.NAME]": tables.MaterialTable.model_fields,
    "under [solver]": KEYS_BY_TABLE["solver"],
    "under [output]": KEYS_BY_TABLE["output"],
    "before all tables": ("models", "frictions", "title"),
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
    "logspace": "geomspace",
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
    r"""(?P<skip>[ \t\r]+ | \#[^\n]*)
      | \"{3} (?: \\. | [^\\] )*? \"{3,5} | '{3} .*? '{3,5}
      | " (?: \\. | [^"\\] )* " | '[^']*' | [^\s\[\]{}=,.\#"']+
      | .""",
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
    lines: dict[KeyPath, int] = {}
    tokens = _tokens(text)

    def read_key(token: _Token, base: KeyPath, end: str) -> KeyPath:
        """Read a key or header, and record its line, also that of the tables that a dotted one implies."""
        started, path = 0, base
        while token.text != end:
            if token.text not in ("[", "."):
                # without quotes and escapes
                is_quoted = token.text.startswith(("'", '"'))
                part = next(iter(tomllib.loads(f"{token.text} = 0"))) if is_quoted else token.text
                started, path = started or token.line, (*path, part)
                lines.setdefault(path, started)
            token = next(tokens)
        return path

    def read_value(token: _Token, path: KeyPath) -> _Token:
        """Read a value, and return the token after it."""
        if token.text not in ("[", "{"):
            while token.text not in (",", "]", "}", "\n"):
                token = next(tokens)
            return token
        first_line, index, element = token.line, 0, next(tokens)
        while element.text not in ("]", "}"):
            if token.text == "{":
                inner, element = read_key(element, path, "="), next(tokens)
            else:
                inner, index = (*path, index), index + 1
                if element.line != first_line:
                    lines[inner] = element.line
            element = read_value(element, inner)
            element = next(tokens) if element.text == "," else element
        return next(tokens)

    table: KeyPath = ()
    for token in tokens:
        if token.text == "[":
            table = read_key(token, (), "]")
        elif token.text not in ("]", "\n"):
            path = read_key(token, table, "=")
            read_value(next(tokens), path)
    return lines


class _Token(NamedTuple):
    """A part of a TOML text, and the line where it begins."""

    text: str
    line: int


def _tokens(text: str) -> Iterator[_Token]:
    """Split a TOML text, without spaces and comments, and without the line breaks in lists."""
    line, depth = 1, 0
    for match in TOML_TOKEN.finditer(f"{text}\n"):
        depth += (match[0] in ("[", "{")) - (match[0] in ("]", "}"))
        if match["skip"] is None and (match[0] != "\n" or depth == 0):
            yield _Token(match[0], line)
        line += match[0].count("\n")


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
    home = next((home for home, keys in HOMES.items() if name in keys), None)
    if home is not None and (len(location) < 3 or location[0] in ("materials", "model", "friction")):
        return f"it belongs {home}"
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
        case ("sweep",) if owners := [
            table
            for table in tables.LAW_TABLES
            if any(name in tables.law_quantities(law) for law in tables.laws_of(table, models).values())
        ]:
            return f"it belongs under [{owners[0]}.KEY], where KEY is that of its law"
        case (table, *_):
            keys = KEYS_BY_TABLE[str(table)]
    return did_you_mean(name, list(keys), KEY_SYNONYMS)
