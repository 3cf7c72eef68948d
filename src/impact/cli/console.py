"""How the commands print: plain text, whatever a file's strings hold, and as wide as there is room."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..text import safe_text

# width of a table that no terminal limits
WIDE = 160


def console(stream: Any) -> Console:
    """A console that prints text as it is: no markup, no guessing, no wrapping at 80 in a pipe."""
    width = None if stream.isatty() else WIDE
    return Console(file=stream, markup=False, highlight=False, emoji=False, width=width)


def table(*headings: str) -> Table:
    """A table without lines; its first column is text, the others are numbers."""
    made = Table(box=None, pad_edge=False, header_style="bold")
    for place, heading in enumerate(headings):
        made.add_column(heading, justify="left" if place == 0 else "right", overflow="fold", no_wrap=place == 0)
    return made


def cell(value: Any) -> Text:
    """A value as plain text that no markup and no control character can touch."""
    return Text(f"{value:.6g}" if isinstance(value, float) else safe_text(str(value)))


def shown(value: Any) -> str:
    """A coordinate without the digits that rounding left."""
    return f"{value:.12g}" if isinstance(value, float) else str(value)
