"""How the commands print: plain text, whatever a file's strings hold, and as wide as there is room."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..formatting import number
from ..text import safe_text

# width of a table that no terminal limits
WIDE = 160


def console(stream: Any) -> Console:
    """A console that prints text as it is: no markup, no guessing, no wrapping at 80 in a pipe."""
    width = None if stream.isatty() else WIDE
    return Console(file=stream, markup=False, highlight=False, emoji=False, width=width)


def table(*headings: str) -> Table:
    """A table without lines; its first column is text, the others are numbers."""
    rows = Table(box=None, pad_edge=False, header_style="bold")
    for place, heading in enumerate(headings):
        rows.add_column(heading, justify="left" if place == 0 else "right", overflow="fold", no_wrap=place == 0)
    return rows


def cell(value: Any) -> Text:
    """A value as plain text that no markup and no control character can touch."""
    return Text(safe_text(number(value)))


def print_rows(rows: Mapping[str, Any]) -> None:
    """Names and what they are, a line each."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in rows.items():
        grid.add_row(cell(name), cell(value))
    console(sys.stdout).print(grid)


def dump(value: Any) -> str:
    """Strict JSON in ASCII: what is not a number is null, and a wall's mass is "inf"."""

    def plain(value: Any) -> Any:
        match value:
            case float():
                return value if abs(value) < float("inf") else None if value != value else str(value)
            case dict():
                return {str(name): plain(item) for name, item in value.items()}
            case list() | tuple():
                return [plain(item) for item in value]
        return value

    return json.dumps(plain(value), allow_nan=False)
