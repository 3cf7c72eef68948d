"""Output of the commands: tables and JSON, with control characters of a file escaped."""

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

# width of a table that is not printed on a terminal
PIPE_WIDTH = 160


def console(stream: Any) -> Console:
    """A console without markup and highlighting, which does not wrap at 80 columns in a pipe."""
    width = None if stream.isatty() else PIPE_WIDTH
    return Console(file=stream, markup=False, highlight=False, emoji=False, width=width)


def table(*headings: str) -> Table:
    """A table without lines; its first column is text, the others are numbers."""
    rows = Table(box=None, pad_edge=False, header_style="bold")
    for index, heading in enumerate(headings):
        rows.add_column(heading, justify="left" if index == 0 else "right", overflow="fold", no_wrap=index == 0)
    return rows


def cell(value: Any, limit: int = 200) -> Text:
    """A value as plain text of at most `limit` characters, with control characters escaped and without markup."""
    return Text(safe_text(number(value), limit))


def print_rows(rows: Mapping[str, Any], limit: int = 200) -> None:
    """Print names and values of at most `limit` characters, one per line."""
    grid = Table.grid(padding=(0, 2))
    grid.add_column(no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in rows.items():
        grid.add_row(cell(name), cell(value, limit))
    console(sys.stdout).print(grid)


def dump(value: Any) -> str:
    """Strict JSON in ASCII: NaN is null, and an infinite mass is "inf"."""

    def to_json(value: Any) -> Any:
        match value:
            case float():
                return value if abs(value) < float("inf") else None if value != value else str(value)
            case dict():
                return {str(name): to_json(element) for name, element in value.items()}
            case list() | tuple():
                return [to_json(element) for element in value]
        return value

    return json.dumps(to_json(value), allow_nan=False)
