"""Results as text, HTML, JSON and data frames; rich and pandas are imported when they are needed.

A result defines once what is shown of it, `sections`: lines of text and tables. All text is escaped here.
"""

from __future__ import annotations

import io
import json
import sys
from abc import abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO, TypeAlias

from .formatting import number, safe_text

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import Console

# width of a table that is not printed on a terminal
PIPE_WIDTH = 160
# characters of a cell, and of a line, which may be a command that is copied
MAX_CELL, MAX_LINE = 200, 4000


class Styled(NamedTuple):
    """A cell with a style of rich, such as "green"."""

    text: str
    style: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Table:
    """A table without lines.

    Parameters
    ----------
    rows : of cells; a float is shown with six digits
    headings : of the columns; a table without headings has names and values
    text : columns that are aligned left, negative ones from the end; the others are numbers
    no_wrap : columns that are not folded
    max_cell : characters of a cell
    """

    rows: Iterable[Sequence[object]]
    headings: Sequence[str] = ()
    text: Collection[int] = (0,)
    no_wrap: Collection[int] = (0,)
    max_cell: int = MAX_CELL

    def print_to(self, console: Console) -> None:
        """Print the table with rich."""
        from rich.table import Table as RichTable
        from rich.text import Text

        rows = [list(row) for row in self.rows]
        count = max(map(len, [self.headings, *rows]))
        table = RichTable(box=None, pad_edge=False, header_style="bold", show_header=bool(self.headings))
        for column in range(count):
            is_text = not self.headings or column in self.text or column - count in self.text
            table.add_column(
                self.headings[column] if self.headings else "",
                justify="left" if is_text else "right",
                overflow="fold",
                no_wrap=column in self.no_wrap,
            )
        for row in rows:
            styles = [cell.style if isinstance(cell, Styled) else "" for cell in row]
            texts = [safe_text(_cell_text(cell), self.max_cell) for cell in row]
            table.add_row(*map(Text, texts, styles))
        console.print(table)

    def html(self) -> str:
        """The table in HTML; texts are left-aligned.

        >>> Table([["<b>"]]).html()
        '<table><tbody><tr><td style="text-align:left">&lt;b&gt;</td></tr></tbody></table>'
        """

        def cells(tag: str, texts: Sequence[object]) -> str:
            shown = (escape(safe_text(_cell_text(text), 1000)) for text in texts)
            return "".join(f'<{tag} style="text-align:left">{text}</{tag}>' for text in shown)

        head = f"<thead><tr>{cells('th', self.headings)}</tr></thead>" if self.headings else ""
        body = "".join(f"<tr>{cells('td', row)}</tr>" for row in self.rows)
        return f"<table>{head}<tbody>{body}</tbody></table>"


class Wrapped(str):
    """A line that is wrapped at words to fit the terminal; other lines are not, so that commands can be copied."""


Block: TypeAlias = str | Table


class Displayed:
    """A result that a command prints: its plain data, its text, and what a notebook shows."""

    @abstractmethod
    def as_dict(self) -> dict[str, Any]:
        """The JSON object of the command."""

    @abstractmethod
    def sections(self, width: int) -> Iterable[Block]:
        """The lines and tables of the text of the command, `width` characters wide."""

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The rows of the data frame."""
        return [self.as_dict()]

    def to_dataframe(self) -> pd.DataFrame:
        """The rows of the result as a data frame of pandas."""
        import pandas as pd

        return pd.DataFrame.from_records(list(self.records()))

    def __str__(self) -> str:
        stream, width = io.StringIO(), _width(sys.stdout)
        print_blocks(self.sections(width), stream, width)
        return stream.getvalue().removesuffix("\n")

    def _repr_html_(self) -> str:
        return html_of(self.sections(PIPE_WIDTH))


def show(value: Displayed, *, as_json: bool = False, stream: TextIO | None = None) -> None:
    """Print a result on stdout or another stream: its text, with styles on a terminal, or its JSON."""
    if as_json:
        print(dump(value), file=stream)
    else:
        stream = stream or sys.stdout
        width = _width(stream)
        print_blocks(value.sections(width), stream, width)


def html_of(blocks: Iterable[Block]) -> str:
    """Write lines and tables in HTML."""
    return "".join(
        block.html() if isinstance(block, Table) else f"<p>{escape(safe_text(block, MAX_LINE))}</p>"
        for block in blocks
        if block
    )


def print_blocks(blocks: Iterable[Block], stream: TextIO | None = None, width: int | None = None) -> None:
    """Print lines and tables on stdout or another stream."""
    stream = stream or sys.stdout
    width = width or _width(stream)
    for block in blocks:
        if isinstance(block, Table):
            block.print_to(_console(stream, width))
        elif isinstance(block, Wrapped):
            _console(stream, width).print(safe_text(block, MAX_LINE))
        else:
            print(safe_text(block, MAX_LINE), file=stream)


def _width(stream: TextIO) -> int:
    """The columns of a terminal; of a pipe PIPE_WIDTH."""
    return _console(stream).width if stream.isatty() else PIPE_WIDTH


def _console(stream: TextIO, width: int | None = None) -> Console:
    from rich.console import Console

    # in a notebook rich would not write to the stream
    return Console(file=stream, markup=False, highlight=False, emoji=False, width=width, force_jupyter=False)


def _cell_text(value: object) -> str:
    return str(value) if isinstance(value, Styled) else number(value)


def dump(value: Any) -> str:
    """Strict JSON in ASCII: NaN is null, and an infinite mass is "inf"; a result is its plain data."""

    def to_json(value: Any) -> Any:
        match value:
            case Displayed():
                return to_json(value.as_dict())
            case float():
                return value if abs(value) < float("inf") else None if value != value else str(value)
            case dict():
                return {str(name): to_json(element) for name, element in value.items()}
            case list() | tuple():
                return [to_json(element) for element in value]
        return value

    return json.dumps(to_json(value), allow_nan=False)
