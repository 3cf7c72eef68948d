"""Results as text, HTML, JSON, data frames and files of tables; rich and pandas are imported when they are needed.

A result defines once what is shown of it, `sections`: lines of text and tables. All text is escaped here.
"""

from __future__ import annotations

import io
import itertools
import json
import locale
import math
import re
import sys
from abc import abstractmethod
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO, TypeAlias

from .arguments import require_counts
from .atomic import check_output, write_file
from .errors import UsageError
from .formatting import argument, number, safe_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from rich.console import Console

# width of a table of a command that is not printed on a terminal, and of a result as text
PIPE_WIDTH, TEXT_WIDTH = 160, 100
# characters of a word that is not broken, of a cell, and of a line, which may be a command that is copied
MAX_WORD, MAX_CELL, MAX_LINE = 40, 200, 4000
# files of tables, and their decimal separators
TABLE_SUFFIXES = (".csv", ".tex", ".parquet")
DECIMALS = {"point": ".", "comma": ","}
LATEX_CHARACTERS = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "^": r"\textasciicircum{}",
        "~": r"\textasciitilde{}",
        **{character: "\\" + character for character in "&%$#_{}"},
    }
)


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
    no_wrap : columns that are folded, at spaces, only where the others have no room otherwise
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

        rows = [
            [Text(safe_text(number(cell), self.max_cell), getattr(cell, "style", "")) for cell in row]
            for row in self.rows
        ]
        texts = ([cell.plain for cell in row] for row in rows)
        columns = list(itertools.zip_longest(self.headings, *texts, fillvalue=""))
        for index, part in enumerate(self._parts(columns, console.width)):
            table = RichTable(box=None, pad_edge=False, header_style="bold", show_header=bool(self.headings))
            for position, width in zip(part, self._widths(columns, part, console.width), strict=True):
                is_text = not self.headings or position in self.text or position - len(columns) in self.text
                table.add_column(
                    columns[position][0], justify="left" if is_text else "right", overflow="fold", width=width
                )
            for row in rows:
                table.add_row(*(row[position] for position in part if position < len(row)))
            if index:
                console.print()
            console.print(table)

    def _parts(self, columns: Sequence[Sequence[str]], width: int) -> Iterator[Sequence[int]]:
        """Split columns under headings that do not fit the width, as pandas does; the first is in each part."""
        from rich.cells import cell_len

        if not self.headings or None not in self._widths(columns, range(len(columns)), width):
            yield range(len(columns))
            return
        most = [max(map(cell_len, texts)) for texts in columns]
        part = [0]
        for position in range(1, len(columns)):
            if len(part) > 1 and sum(most[i] + 2 for i in (*part, position)) - 2 > width:
                yield part
                part = [0]
            part.append(position)
        yield part

    def _widths(self, columns: Sequence[Sequence[str]], part: Sequence[int], width: int) -> Sequence[int | None]:
        """Choose the widths of columns that fold at spaces, the widest first; None where words do not fit."""
        from rich.cells import cell_len

        texts = [columns[i] for i in part]
        most = [max(map(cell_len, column)) for column in texts]
        words = [max((cell_len(word) for text in column for word in text.split()), default=0) for column in texts]
        # headings keep their line, for which addresses may be broken
        kept = [max(cell_len(column[0]), min(word, MAX_WORD)) for column, word in zip(texts, words, strict=True)]
        whole = [full if i in self.no_wrap else least for i, full, least in zip(part, most, kept, strict=True)]
        for least in (whole, kept, words):
            # two spaces are between columns
            widths, room = most.copy(), width - 2 * (len(part) - 1)
            if sum(least) > room:
                continue
            while sum(widths) > room:
                widths[max((i for i in range(len(widths)) if widths[i] > least[i]), key=widths.__getitem__)] -= 1
            return widths
        return [None] * len(part)

    def html(self) -> str:
        """The table in HTML; texts are left-aligned.

        >>> Table([["<b>"]]).html()
        '<table><tbody><tr><td style="text-align:left">&lt;b&gt;</td></tr></tbody></table>'
        """

        def cells(tag: str, texts: Sequence[object]) -> str:
            shown = (escape(safe_text(number(text), 1000)) for text in texts)
            return "".join(f'<{tag} style="text-align:left">{text}</{tag}>' for text in shown)

        head = f"<thead><tr>{cells('th', self.headings)}</tr></thead>" if self.headings else ""
        body = "".join(f"<tr>{cells('td', row)}</tr>" for row in self.rows)
        return f"<table>{head}<tbody>{body}</tbody></table>"


@dataclass(frozen=True)
class TableForm:
    """How a table is written to a file.

    Parameters
    ----------
    rows : at most this number of rows, evenly spread from the first to the last; by default all
    digits : significant digits; by default all, in .tex six
    decimal : "point", "comma" with columns that are separated by semicolons, or "locale" for that of LC_NUMERIC
    """

    rows: int | None = None
    digits: int | None = None
    decimal: str = "point"

    def __post_init__(self) -> None:
        require_counts(2, rows=self.rows)
        require_counts(digits=self.digits)
        object.__setattr__(self, "decimal", resolve_decimal(self.decimal))

    def check_used(self, path: Path | None, name: str) -> None:
        """Refuse what is set where the argument of a name writes no table."""
        if path is not None and path.suffix.lower() in TABLE_SUFFIXES:
            return
        for field in fields(self):
            if getattr(self, field.name) != field.default:
                table = argument(name, f"FILE{TABLE_SUFFIXES[0]}")
                raise UsageError(f"{argument(field.name)}: set without a table, expected {table}")


def resolve_decimal(decimal: str) -> str:
    """Check the name of a decimal separator; "locale" is that of LC_NUMERIC, of the process or the environment."""
    if decimal in DECIMALS:
        return decimal
    if decimal != "locale":
        raise UsageError(f"{argument('decimal')}: got {decimal}, expected {', '.join(DECIMALS)} or locale")
    before = locale.setlocale(locale.LC_NUMERIC)
    try:
        # a process has the locale of its environment only if it asks for it
        locale.setlocale(locale.LC_NUMERIC, "" if before == "C" else before)
        return "comma" if locale.localeconv()["decimal_point"] == "," else "point"
    except locale.Error:
        return "point"
    finally:
        locale.setlocale(locale.LC_NUMERIC, before)


def check_suffix(path: Path, name: str, suffixes: Sequence[str] = TABLE_SUFFIXES) -> None:
    """Check the suffix of a file, by default a table, that an argument names."""
    if path.suffix.lower() not in suffixes:
        *most, last = suffixes
        raise UsageError(f"{argument(name, path)}: expected a name that ends in {', '.join(most)} or {last}")


def encode_frame(frame: pd.DataFrame, suffix: str, form: TableForm | None = None) -> bytes:
    """Encode a table for a file of a suffix of TABLE_SUFFIXES.

    >>> import pandas as pd
    >>> print(encode_frame(pd.DataFrame({"law": ["a_b"], "t [s]": [1.25e-5]}), ".tex").decode())
    \\begin{tabular}{lS[table-format=1.2e-1]}
    \\toprule
    {law} & {t [\\unit{s}]} \\\\
    \\midrule
    a\\_b & 1.25e-5 \\\\
    \\bottomrule
    \\end{tabular}
    <BLANKLINE>
    """
    form = form or TableForm()
    if form.rows is not None and form.rows < len(frame):
        last = len(frame) - 1
        frame = frame.iloc[[round(last * row / (form.rows - 1)) for row in range(form.rows)]]
    if suffix == ".tex":
        return _latex(frame, form).encode()
    if form.digits is not None:
        frame = frame.map(lambda cell: float(f"{cell:.{form.digits}g}") if isinstance(cell, float) else cell)
    if suffix == ".parquet":
        try:
            return bytes(frame.to_parquet(index=False, engine="pyarrow"))
        except ImportError:
            needs = 'needs pyarrow, which is not installed: pip install "impact-sweep[parquet]"'
            raise UsageError(f".parquet {needs}") from None
    separator = "," if form.decimal == "point" else ";"
    text = frame.to_csv(index=False, lineterminator="\n", sep=separator, decimal=DECIMALS[form.decimal])
    return str(text).encode()


def check_table_output(path: Path | None, form: TableForm, *, overwrite: bool) -> None:
    """Check, before any work, the file of the option for a table, and its form."""
    form.check_used(path, "output")
    if path is not None:
        check_suffix(path, "output")
        check_output(path, overwrite=overwrite)


def write_table(value: Displayed, path: Path, form: TableForm, *, overwrite: bool) -> None:
    """Write the rows of a result to a file."""
    frame = value.to_dataframe().map(lambda cell: _flat_cell(cell, form.decimal))
    # such as the parameters of laws that have none
    frame = frame.loc[:, [not frame[name].eq("").all() for name in frame.columns]]
    write_file(path, encode_frame(frame, path.suffix.lower(), form), overwrite=overwrite)


def _flat_cell(cell: object, decimal: str) -> object:
    """Write values by name, and ranges, as text."""

    def write(value: object) -> str:
        text = number(value)
        return text.replace(".", DECIMALS[decimal]) if isinstance(value, float) else text

    separator = ", " if decimal == "point" else "; "
    match cell:
        case dict():
            return separator.join(f"{name} = {write(value)}" for name, value in cell.items())
        case (float() as low, float() as high):
            return f"{write(low)} to {write(high)}"
        case tuple() | list():
            return separator.join(str(_flat_cell(part, decimal)) for part in cell)
    return cell


def _latex(frame: pd.DataFrame, form: TableForm) -> str:
    """Write a tabular of booktabs, with an S column of siunitx for each column of numbers; angles in degrees."""
    frame, names = frame.copy(), [*map(str, frame.columns)]
    for index, name in enumerate(names):
        if name.endswith(" [rad]") and frame.dtypes.iloc[index].kind == "f":
            frame.isetitem(index, frame.iloc[:, index] * math.degrees(1.0))
            names[index] = name.removesuffix("rad]") + r"\degree]"
    texts, formats = frame.map(lambda cell: _latex_cell(cell, form.digits or 6)), ""
    for (_, column), (_, shown) in zip(frame.items(), texts.items(), strict=True):
        is_numeric = all(isinstance(cell, int | float) and not isinstance(cell, bool) for cell in column.tolist())
        formats += _siunitx_column(shown.tolist(), form.decimal) if is_numeric else "l"
    texts.columns = [*map(_latex_heading, names)]
    return str(texts.to_latex(index=False, column_format=formats, escape=False))


def _latex_heading(name: str) -> str:
    """Write a heading in braces, so that siunitx does not read it as a number; formulas in $ are kept."""
    words, bracket, unit = name.rpartition(" [")
    parts = re.split(r"(\$[^$]+\$)", words if bracket else name)
    text = "".join(part if part[:1] == "$" and part[1:] else part.translate(LATEX_CHARACTERS) for part in parts)
    if not bracket:
        return f"{{{text}}}"
    unit = re.sub(r"\^(-?[\d.]+|\([^)]*\))", r"^{\1}", unit.removesuffix("]"))
    return f"{{{text} [\\unit{{{unit}}}]}}"


def _latex_cell(cell: object, digits: int) -> str:
    if isinstance(cell, float) and not abs(cell) < float("inf"):
        return "" if cell != cell else r"{$\infty$}" if cell > 0.0 else r"{$-\infty$}"
    if isinstance(cell, int | float):
        return re.sub(r"e([+-])0*", lambda sign: f"e{sign[1].strip('+')}", number(cell, digits))
    return str(cell).translate(LATEX_CHARACTERS)


def _siunitx_column(texts: Sequence[str], decimal: str) -> str:
    """Describe a column by its widest number, so that siunitx aligns it at the decimal separator."""
    parts = [re.fullmatch(r"(-?)(\d+)(?:\.(\d+))?(?:e(-?)(\d+))?", text) for text in texts]
    numbers = [part.groups("") for part in parts if part]
    if not numbers:
        return "l"
    signs, whole, fraction, power_signs, powers = zip(*numbers, strict=True)
    exponent = f"e{max(power_signs)}{max(map(len, powers))}" if any(powers) else ""
    size = f"{max(signs)}{max(map(len, whole))}.{max(map(len, fraction))}{exponent}"
    return f"S[table-format={size}" + (", output-decimal-marker={,}]" if decimal == "comma" else "]")


class Wrapped(str):
    """A line that is wrapped at words to fit the terminal; other lines are not, so that commands can be copied."""


Block: TypeAlias = str | Table


class Displayed:
    """A result that a command prints: its plain data, its text, and what a notebook shows."""

    def __init_subclass__(cls) -> None:
        # at a prompt a dataclass, a dict, a list or a tuple would show its fields in place of its tables
        if cls.__repr__ in (object.__repr__, dict.__repr__, list.__repr__, tuple.__repr__):
            cls.__repr__ = cls.__str__  # type: ignore[assignment, method-assign]

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
        stream, width = io.StringIO(), _width(sys.stdout, TEXT_WIDTH)
        print_blocks(self.sections(width), stream, width)
        return stream.getvalue().removesuffix("\n")

    def _repr_html_(self) -> str:
        return html_of(self.sections(PIPE_WIDTH))


@dataclass(frozen=True, eq=False, repr=False)
class DisplayedDataset(Displayed):
    """A result that is kept as a dataset; two are equal if these are identical."""

    dataset: xr.Dataset

    def __eq__(self, other: object) -> bool:
        # == of datasets is a dataset, and that is true
        return type(other) is type(self) and self.dataset.identical(other.dataset)


def show(value: Displayed, *, as_json: bool = False, stream: TextIO | None = None) -> None:
    """Print a result on stdout or another stream: its text, with styles on a terminal, or its JSON."""
    if as_json:
        print(dump(value), file=stream)
    else:
        print_blocks(value.sections(_width(stream or sys.stdout)), stream)


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


def _width(stream: TextIO, other: int = PIPE_WIDTH) -> int:
    """The columns of a terminal; another width without one."""
    return _console(stream).width if stream.isatty() else other


def _console(stream: TextIO, width: int | None = None) -> Console:
    from rich.console import Console

    # a text has no styles, also where the environment forces colours
    is_styled = False if isinstance(stream, io.StringIO) else None
    # in a notebook rich would not write to the stream
    return Console(
        file=stream,
        width=width,
        force_terminal=is_styled,
        force_jupyter=False,
        markup=False,
        highlight=False,
        emoji=False,
    )


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
