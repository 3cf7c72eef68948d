"""Named columns of values with units: of CSV files, of tables of pandas and xarray, and of lists in a config.

The values of a file replace its name in a config, and are stored with it as an override such as
`sweep.cases={v1 = [1.0, 2.0], m1 = [0.1, 0.2]}`, so that a stored config needs no other file.
"""

from __future__ import annotations

import contextlib
import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from ..contact.model import ForceModel
from ..contact.variables import OUTPUTS
from ..errors import ConfigError, did_you_mean
from ..formatting import safe_text
from .draft import Draft
from .files import as_table, read_text, set_value
from .input_names import SWEEP_INPUTS, InputName, input_values
from .quantities import (
    DECIMALS,
    MAX_PROBLEMS,
    SEPARATORS,
    ConfigProblem,
    KeyPath,
    Quantity,
    UnitError,
    as_text,
    is_unit,
    mismatch_error,
)
from .tables import LABORATORY

MAX_CSV_BYTES = 2_000_000  # size of a CSV file, whose values a result stores
# the unit in a header: "v1 [m/s]", "v1 / (m/s)", "v1 in m/s" or "v1 (m/s)"
UNIT_FORMS = [
    re.compile(rf"(.*?)\s*{unit}", re.DOTALL)
    for unit in (r"\[(.*)\]", r"(?:/|\bin\s)\s*\((.*)\)", r"(?:/|\bin\s)\s*([^()]*)", r"\((.*)\)")
]
# a cell of a number with each decimal sign, which may have a unit; and one whose comma may separate thousands
NUMBER_WITH = {
    sign: re.compile(rf"[-+]?[0-9]*[{sign}][0-9]+(?:[eE][-+]?[0-9]+)?(?:\s*[^\s0-9.,].*)?") for sign in DECIMALS
}
# a line without words
NUMBERS = re.compile(r"[^A-DF-Za-df-z]*")
THOUSANDS = re.compile(r"[-+]?[1-9][0-9]{0,2}(?:,[0-9]{3})+")
LONG_NUMBER = re.compile(r"[-+]?[0-9]{1,3}(?:[.,' ][0-9]{3})+(?:[.,][0-9]+)?")
# keys that say how a CSV file is written, and their values; what is missing is recognised
CSV_KEYS = {"separator": SEPARATORS, "decimal": DECIMALS}
# what cells without a value contain
MISSING = ("", "na", "n/a", "n.a.", "k.a.", "nan", "none", "null", "<na>", "-", "–", "—")


# a column, or "" for all together; a row of it, or None for its header; and a message
ColumnProblem = tuple[str, int | None, str]


@dataclass(frozen=True)
class Columns:
    """Columns of values, by name."""

    source: str  # name of the file or the table
    header: int  # line of the names; 0 for a table
    lines: Sequence[int]  # of each row; for a table its number, from 1
    units: Mapping[str, str]  # of each column; empty for SI
    cells: Mapping[str, Sequence[object]]  # of each column
    # a column has the name of an input or an output. Otherwise it may be any file, such as one with passwords,
    # that a config of unknown origin names: messages contain nothing of it
    is_known: bool = True
    is_text: bool = True  # text without a unit may be a number

    def problem(self, message: str, column: str = "", row: int | None = None) -> str:
        """Prefix a message with the place of the problem: source, line and column."""
        line = self.header if row is None else self.lines[row]
        place = f"{self.source}:{line}" if line else self.source
        return ": ".join(part for part in (place, safe_text(column, 60), message) if part)

    def error(self, problems: Iterable[ColumnProblem]) -> ConfigError:
        """Build the exception with problems."""
        return ConfigError(*(self.problem(message, column, row) for column, row, message in problems))

    def notes(self, text: str, unused: Sequence[str] = ()) -> tuple[str, ...]:
        """Write notes: a text, such as that of `complete_rows`, and the columns without use."""
        names = ", ".join(safe_text(header, 60) for header in unused[:MAX_PROBLEMS])
        texts = (text, f"columns without use: {names}" if names else "")
        return tuple(f"{self.source}: {text}".removeprefix(": ") for text in texts if text)

    def take(self, rows: Sequence[int]) -> Columns:
        """Keep some rows."""
        cells = {name: [column[row] for row in rows] for name, column in self.cells.items()}
        return replace(self, lines=[self.lines[row] for row in rows], cells=cells)

    def find(self, text: str) -> tuple[str, str]:
        """Find a column by its name, with or without a unit; also returns the unit, which its header may lack."""
        name, unit = (text, "") if text in self.cells else split_header(text)
        if name not in self.cells:
            hint = f"; {did_you_mean(text, list(self.cells))}" if self.is_known else ""
            raise ConfigError(self.problem(f"got {as_text(text)}, expected one of its columns{hint}"))
        own = self.units.get(name, "")
        if unit and own and unit != own:
            raise ConfigError(self.problem(f"got {as_text(text)}, expected [{safe_text(own)}] as in its header"))
        return name, own or unit

    def read(
        self, column: str, quantity: Quantity | None, n: float | None, unit: str = ""
    ) -> tuple[list[float | str], list[ColumnProblem]]:
        """Convert a column, whose header may lack `unit`, to SI units or to names of materials, and list problems.

        Cells with the same fault are a single problem, that of the first cell.
        """
        unit = self.units.get(column) or unit
        try:
            if quantity is not None and unit:
                quantity.factor(unit, n)
        except UnitError as error:
            return [], [(column, None, f"got [{safe_text(unit)}], expected {error}")]
        values: list[float | str] = []
        problems: dict[str, tuple[int, str]] = {}
        others: Counter[str] = Counter()
        for row, cell in enumerate(self.cells[column]):
            try:
                values.append(_read_cell(cell, quantity, n, unit, is_text=self.is_text))
            except PydanticCustomError as error:
                reason = error.message().partition(", expected ")[2] or error.message()
                others[reason] += reason in problems
                problems.setdefault(reason, (row, error.message()))
        return values, [(column, row, text + also(others[reason])) for reason, (row, text) in problems.items()]


# the values that replace the name of a CSV file in a config, by path, and notes
CsvValues = tuple[dict[KeyPath, object], Sequence[str]]
# the name of such a file, what else is `wanted` of it, see `read_csv`, some of the CSV_KEYS, and what reads the
# values; a KeyError is that of an unknown key
CsvFile = tuple[str, tuple[str, ...] | None, dict[str, str], Callable[[Columns], CsvValues]]


def also(count: int) -> str:
    """End a message about a row that stands for others."""
    return f"; also in {count} other row{'s' * (count > 1)}" if count else ""


def _read_cell(
    cell: object, quantity: Quantity | None, n: float | None, unit: str, *, is_text: bool
) -> float | str:
    if is_text and cell in (None, ""):
        raise mismatch_error(None, "the name of a material" if quantity is None else quantity.expected)
    if quantity is None:
        return str(cell)
    if quantity.words:
        # the config holds the word
        quantity.read(cell)
        return str(cell)
    number = cell
    if is_text and isinstance(cell, str):
        try:
            number = float(cell)
        except ValueError:
            # a cell may have its own unit where its column has none
            if unit:
                if LONG_NUMBER.fullmatch(cell):
                    expected = "a number without marks between thousands"
                elif re.fullmatch(r"[-+.0-9]+(?:[eE][-+]?[0-9]+)?\s*[^\s0-9.].*", cell):
                    expected = f"a number without a unit: the column is in {safe_text(unit)}"
                else:
                    expected = quantity.expected
                raise mismatch_error(cell, expected) from None
    return quantity.read(f"{cell} {unit}" if unit else number, n)


def read_csv(
    path: Path,
    is_known: Callable[[str], bool],
    wanted: Collection[str] | None = None,
    *,
    separator: str = "",
    decimal: str = "",
) -> Columns:
    """Read the columns of a CSV file, whose first line has their names and their units.

    Blank lines, those of separators alone, and those that begin with # have no meaning, except for names just
    before the first values, which `numpy.savetxt` writes as a comment. An empty separator or decimal sign is
    recognised. Unless further names are `wanted`, some name has to be known. A ConfigError shows nothing of the
    content of a file in which no name is.
    """
    looked_for = {split_header(name)[0] for name in wanted or ()} | {*(wanted or ())}

    def is_looked_for(header: str) -> bool:
        name, _ = split_header(header)
        return name in looked_for or header in looked_for or is_known(name)

    text = io.StringIO(read_text(path, "CSV", MAX_CSV_BYTES), newline=None)
    # Excel writes separators for a row that was cleared
    lines = [(number, line) for number, line in enumerate(text, 1) if re.sub("[,;]", "", line).strip()]
    numbered = [(number, line) for number, line in lines if not line.lstrip().startswith("#")]
    if numbered and numbered[0] != lines[0] and NUMBERS.fullmatch(numbered[0][1]):
        # numpy.savetxt writes names as a comment
        number, comment = lines[lines.index(numbered[0]) - 1]
        comment = comment.lstrip("# \t")
        if any(map(is_looked_for, re.split(r'[\s,;"]+', comment))):
            numbered.insert(0, (number, comment))
    # a line that Excel understands
    named = re.fullmatch(r"sep=([,;\t])\s*", numbered[0][1]) if numbered else None
    if named is not None:
        separator, numbered = separator or named[1], numbered[1:]
    if len(numbered) < 2:
        got = "one line" if numbered else "none"
        raise ConfigError(f"{path}: got {got}, expected a line of names and at least one of values")
    mark = separator or _find_separator(path, numbered, is_looked_for)
    rows = _split(path, numbered, mark)
    (first, headers), *_ = rows.items()
    del rows[first]
    names = [split_header(text) for text in headers]
    has_known = any(is_known(name) for name, _ in names)
    if not has_known and wanted is None:
        expected = "names of inputs or outputs, such as v1 [m/s] or e_out"
        raise ConfigError(f"{path}:{first}: got no known column, expected {expected}")
    problems = _length_problems(path, rows, len(headers), mark)
    for name, count in Counter(name for name, _ in names if name).items():
        if count > 1:
            got = f"{as_text(name) if has_known else 'a name'} {'twice' if count == 2 else f'{count} times'}"
            problems.append(f"{path}:{first}: got {got}, expected each column once")
    if problems:
        raise ConfigError(*problems[:MAX_PROBLEMS])
    units, cells = {}, {}
    for position, ((name, unit), column) in enumerate(
        zip(names, zip(*rows.values(), strict=True), strict=True), 1
    ):
        # a column without a name and values is that of a separator at the end of each line
        if name or any(column):
            label = name or f"column {position}"
            units[label], cells[label] = unit, list(column)
    columns = Columns(str(path), first, list(rows), units, cells, has_known)
    return _with_decimal_points(columns, decimal, [name for name in units if is_looked_for(name)])


def _split(path: Path, numbered: Sequence[tuple[int, str]], separator: str) -> dict[int, list[str]]:
    """Split lines into cells, by the number of the line."""
    # csv knows spaces before a quoted cell, and none after it
    space = re.compile(rf'(?<!")" +(?={separator}|$)')
    lines = (space.sub('"', line) if '"' in line else line for _, line in numbered)
    if separator == " ":
        lines = (" ".join(_words(line)) for _, line in numbered)
    reader = csv.reader(lines, delimiter=separator, strict=True, skipinitialspace=separator != "\t")
    rows = {}
    try:
        for row in reader:
            rows[numbered[reader.line_num - 1][0]] = [cell.strip() for cell in row]
        return rows
    except csv.Error as error:
        raise ConfigError(f"{path}:{numbered[reader.line_num - 1][0]}: not CSV: {error}") from None


def _words(line: str) -> list[str]:
    """Split a line at spaces, but not before a unit in brackets."""
    return re.sub(r"\s+(?=[\[(])", "", line).split()


def _find_separator(path: Path, numbered: Sequence[tuple[int, str]], is_looked_for: Callable[[str], bool]) -> str:
    """Recognise the separator by the header: it separates all rows alike, and names that are looked for."""
    readings: dict[str, list[list[str]]] = {}
    errors: dict[str, ConfigError] = {}
    first_line = numbered[0][1]
    # a sign that the header lacks is no separator, and a long file takes a second to split; a header with an open
    # quote continues in the next line
    for mark in SEPARATORS if first_line.count('"') % 2 else filter(first_line.count, SEPARATORS):
        try:
            readings[mark] = list(_split(path, numbered, mark).values())
        except ConfigError as error:
            errors[mark] = error
    readings = {mark: rows for mark, rows in readings.items() if len(rows[0]) > 1}
    if errors and not readings:
        raise errors[max(errors, key=first_line.count)]
    regular = {mark: rows for mark, rows in readings.items() if len({*map(len, rows)}) == 1} or readings
    readings = {mark: rows for mark, rows in regular.items() if any(map(is_looked_for, rows[0]))} or regular
    if len(readings) > 1 and any(is_looked_for(header) for rows in readings.values() for header in rows[0]):
        each = " or ".join(f"by {as_text(mark)} into {len(rows[0])}" for mark, rows in readings.items())
        choice = " or ".join(f"separator = {as_text(mark)}" for mark in readings)
        raise ConfigError(
            f"{path}:{numbered[0][0]}: got columns separated {each}, expected one; {choice} settles it"
        )
    if readings:
        return next(iter(readings))
    # spaces separate what no other sign does, as those of numpy.savetxt; a file of one column has no separator
    header, *rows = (_words(line) for _, line in numbered)
    is_table = len(header) > 1 and all(len(row) == len(header) for row in rows)
    return " " if is_table and any(map(is_looked_for, header)) else ";"


def _with_decimal_points(columns: Columns, decimal: str, looked_for: Sequence[str]) -> Columns:
    """Write decimal commas as points; the sign is that of all numbers, else of those that are looked for."""
    for names in [looked_for] if decimal else [list(columns.cells), looked_for]:
        cells = [
            (line, str(cell))
            for name in names
            for line, cell in zip(columns.lines, columns.cells[name], strict=True)
        ]
        signs = {
            sign: numbers
            for sign, pattern in NUMBER_WITH.items()
            if (numbers := [(line, cell) for line, cell in cells if pattern.fullmatch(cell)])
        }
        if len(signs) == 1:
            break
    places = {sign: f"{columns.source}:{found[0][0]}" for sign, found in signs.items()}
    if not decimal and len(signs) > 1:
        got = f"got a decimal comma, and a point in line {signs['.'][0][0]}, expected one of them"
        raise ConfigError(f'{places[","]}: {got}; decimal = "," or decimal = "." settles it')
    for sign in signs:
        if decimal and sign != decimal:
            raise ConfigError(f"{places[sign]}: got a number with {as_text(sign)}, expected {as_text(decimal)}")
    if not decimal and "," in signs and all(THOUSANDS.fullmatch(cell) for _, cell in signs[","]):
        cell = signs[","][0][1] if columns.is_known else "a comma in a number"
        got = f"got {cell}, which may be decimal or separate thousands"
        raise ConfigError(f'{places[","]}: {got}; decimal = "," settles it, or numbers without commas')
    if "," not in signs:
        return columns
    comma = NUMBER_WITH[","]
    with_points = {
        name: [cell.replace(",", ".", 1) if comma.fullmatch(cell) else cell for cell in map(str, column)]
        for name, column in columns.cells.items()
    }
    return replace(columns, cells=with_points)


def split_header(text: str) -> tuple[str, str]:
    """Split a header into a name and a unit, which is in square brackets, or in another form if it is a known one.

    >>> split_header("v1 [mm/s]"), split_header("v1 (cm/s)"), split_header("e (mean)"), split_header("e_out [-]")
    (('v1', 'mm/s'), ('v1', 'cm/s'), ('e (mean)', ''), ('e_out', '1'))
    >>> split_header("v1 / (m/s)"), split_header("v1/m/s"), split_header("E in GPa"), split_header("m1/m2")
    (('v1', 'm/s'), ('v1', 'm/s'), ('E', 'GPa'), ('m1/m2', ''))
    """
    text = text.strip()
    for match in filter(None, (form.fullmatch(text) for form in UNIT_FORMS)):
        unit = match[2].strip()
        if unit.lower() in ("%", "percent", "per cent", "pct"):
            unit = "%"
        # m1/m2 is a ratio of masses
        if match[1] and (text.endswith("]") or unit == "-" or (is_unit(unit) and unit not in SWEEP_INPUTS)):
            return match[1], "1" if unit == "-" else unit
    return text, ""


def near_miss(header: str, known: Iterable[str]) -> str:
    """Find the known name that a header seems to mean; empty for none.

    >>> known = ["sigma", "m2", "e_out", "e"]
    >>> near_miss("simga", known), near_miss("m2_", known), near_miss("E", known), near_miss("remark", known)
    ('sigma', 'm2', '', '')
    """
    plain = {_letters(name): name for name in known}
    letters = _letters(header)
    # a single letter means many things
    if len(letters) < 2:
        return ""
    close = get_close_matches(letters[:64], [name for name in plain if len(name) > 3], n=1, cutoff=0.8)
    return plain.get(letters) or (plain[close[0]] if close else "")


def _letters(header: str) -> str:
    return re.sub(r"[^a-z0-9]", "", re.sub(r"[(\[].*", "", header).lower())


def misspelt_column(header: str, known: Iterable[str], models: Mapping[str, ForceModel], what: str) -> str:
    """Describe a header that is nearly a known name, or a parameter that does not exist; empty for others."""
    name = InputName.parse(header)
    # a header such as "No. 1" has a dot as well
    if header.startswith(("materials.", "model.", "friction.")) or near_miss(name.owner, models):
        return name.unknown_message(models)
    meant = near_miss(header, known)
    return f'no such {what}; did you mean "{meant}"?' if meant else ""


def complete_rows(
    columns: Columns, names: Iterable[str], *, refuse: bool = False
) -> tuple[list[int], str, list[ColumnProblem]]:
    """Find the rows in which each column has a value.

    Returns them, a note that counts the others, and problems: the others are with `refuse`, or if there is no
    complete row.
    """
    empty = {
        name: [row for row, cell in enumerate(columns.cells[name]) if str(cell).strip().lower() in MISSING]
        for name in names
    }
    empty = {name: rows for name, rows in empty.items() if rows}
    left_out = {row for rows in empty.values() for row in rows}
    rows, total = [row for row in range(len(columns.lines)) if row not in left_out], len(columns.lines)
    if left_out and (refuse or not rows):
        expected = "expected a value" + ("" if refuse else " in each column of at least one row")
        return rows, "", [(name, r[0], f"got nothing, {expected}{also(len(r) - 1)}") for name, r in empty.items()]
    counts = [f"{len(r)} {'has' if len(r) == 1 else 'have'} no {name}" for name, r in empty.items()]
    note = ", ".join(counts).replace(" ha", f" of {total} rows ha", 1)
    return rows, f"{note}: left out" if note else "", []


def _length_problems(path: Path, rows: Mapping[int, Sequence[str]], n_columns: int, separator: str) -> list[str]:
    """List each wrong number of values in a row, with its first line."""
    lines_by_length: dict[int, list[int]] = {}
    for line, row in rows.items():
        if len(row) != n_columns:
            lines_by_length.setdefault(len(row), []).append(line)
    hint = "; a decimal comma needs another separator, or quotes" if separator == "," else ""
    return [
        f"{path}:{line}: got {n_values} value{'s' * (n_values > 1)}, expected {n_columns}, one for each column"
        f"{also(len(others))}{hint if n_values > n_columns else ''}"
        for n_values, (line, *others) in lines_by_length.items()
    ]


def columns_of_table(table: Any, source: str) -> Columns:
    """Take the columns of a mapping, a DataFrame, or a dataset of xarray, whose units are attributes."""
    units: dict[str, str] = {}
    if hasattr(table, "data_vars"):
        units = {str(name): str(variable.attrs.get("units", "")) for name, variable in table.variables.items()}
        table = table.to_dataframe().reset_index()
    headers = [split_header(str(header)) for header in table]
    cells = {
        header: getattr(values, "tolist", lambda v=values: v)()
        for header, (_, values) in zip(headers, table.items(), strict=True)
    }
    columns = Columns(
        source,
        0,
        range(1, max(map(len, cells.values()), default=0) + 1),
        {name: unit or units.get(name, "") for name, unit in cells},
        {name: values for (name, _), values in cells.items()},
        is_text=False,
    )
    twice = next((name for name, count in Counter(name for name, _ in headers).items() if count > 1), None)
    if twice is not None:
        raise ConfigError(columns.problem(f"got {as_text(twice)} twice, expected each column once"))
    return columns


def read_csv_of(draft: Draft, file: str, wanted: tuple[str, ...] | None, **form: str) -> Columns:
    """Read a CSV file that a config names; `form` has some of the CSV_KEYS."""
    if draft.folder is None:
        raise ConfigError(f"{file}: not read; a stored config contains values, not file names")

    def is_known(name: str) -> bool:
        with contextlib.suppress(KeyError):
            InputName.parse(name).quantity(draft.known_models)
            return True
        return name in OUTPUTS or name in LABORATORY

    return read_csv(draft.folder / file, is_known, wanted, **form)


def csv_form(table: Mapping[Any, Any]) -> dict[str, str]:
    """Read the CSV_KEYS of a table; values that are wrong are reported with the others."""
    return {key: table[key] for key, choices in CSV_KEYS.items() if table.get(key) in choices}


def csv_files(draft: Draft) -> Iterator[CsvFile]:
    """Yield the CSV files of cases and of single columns."""
    cases = draft.table("sweep").get("cases")
    match {"file": cases} if isinstance(cases, str) else cases:
        # a table with other keys or values is left as it is, and reported
        case {"file": str(file), **form} if form == csv_form(form):
            yield file, None, csv_form(form), partial(_read_cases, draft)
    for name, reference in input_values(draft.data):
        match reference:
            case {"file": str(file), "column": str(column), **form} if form == csv_form(form):
                yield file, (column,), csv_form(form), partial(_read_column, draft, name, column)
            case {"empirical": str(file), **others} if not others:
                yield file, (), {}, partial(_read_column, draft, name, None)


def _read_column(draft: Draft, name: InputName, column: str | None, columns: Columns) -> CsvValues:
    """Convert a column, or without a name that of the input or the only one, which gives its distribution."""
    # the single column of a file that names none may have any name
    is_single = column is None and len(columns.units) == 1
    if is_single and NUMBERS.fullmatch(label := next(iter(columns.units))) and any(map(str.isdigit, label)):
        raise ConfigError(columns.problem("got a number, expected the name of the column"))
    header, unit = columns.find(next(iter(columns.units)) if is_single else column or str(name))
    # the values of axes that vary together stand in the same rows
    is_zipped = any(str(name) in group for group in draft.zip_groups)
    rows, count, gaps = complete_rows(columns, [header], refuse=is_zipped)
    if gaps:
        raise columns.error(gaps)
    quantity, complete = name.quantity(draft.known_models), columns.take(rows)
    if quantity is None and not columns.is_known:
        raise ConfigError(columns.problem("got no known column, expected such as material1 or v1 [m/s]"))
    values, problems = complete.read(header, quantity, draft.exponent, unit)
    if problems and quantity is not None and not columns.is_known:
        problems = [("", problems[0][1], f"expected {quantity.expected}")]
    if problems:
        raise complete.error(problems)
    return {name.path: {"empirical": values} if column is None else values}, columns.notes(count)


def _read_cases(draft: Draft, columns: Columns) -> CsvValues:
    """Convert the columns of a table of cases to SI units, without incomplete rows; also returns notes."""
    problems: list[str] = []
    unused: list[str] = []
    quantities: dict[str, Quantity | None] = {}
    for name in columns.units:
        try:
            quantities[name] = InputName.parse(name).quantity(draft.known_models)
        except KeyError:
            meant = misspelt_column(name, SWEEP_INPUTS, draft.known_models, "input")
            problems += [columns.problem(meant, name)] if meant else []
            unused.append(name)
    if not quantities and not problems:
        problems.append(columns.problem("got no column of an input, expected one, such as v1 [m/s]"))
    rows, count, gaps = complete_rows(columns, quantities)
    problems += [columns.problem(message, name, row) for name, row, message in gaps]
    complete, values = columns.take(rows), {}
    # n may be one of the columns
    n = None if "n" in columns.units else draft.exponent
    for name, quantity in quantities.items():
        values[name], of_column = complete.read(name, quantity, n)
        problems += [complete.problem(message, name, row) for _, row, message in of_column]
    if problems:
        raise ConfigError(*problems)
    return {("sweep", "cases"): values}, columns.notes(count, unused)


def expand_cases(draft: Draft) -> Draft:
    """Replace `sweep.cases` by its columns, whose names may have a unit."""
    sweep = draft.table("sweep")
    table = sweep.get("cases")
    if not isinstance(table, dict) or not table or not all(isinstance(values, list) for values in table.values()):
        return draft
    problems: list[ConfigProblem] = []
    cases: dict[str, list[object]] = {}
    header_of: dict[str, str] = {}
    for header, values in table.items():
        column, unit = split_header(header)
        if column in header_of:
            message = f'set together with "{header_of[column]}", expected one of the two'
            problems.append((("sweep", "cases", header), message))
            continue
        header_of[column] = header
        # a text may have its own unit
        cases[column] = [v if isinstance(v, str) else f"{v!r} {unit}" for v in values] if unit else values
    paths: dict[KeyPath, KeyPath] = {}
    # the columns that belong to [sweep] take the position of the table
    in_sweep = {column: values for column, values in cases.items() if not InputName.parse(column).owner}
    position, items = list(sweep).index("cases"), list(sweep.items())
    data = {**draft.data, "sweep": {**dict(items[:position]), **in_sweep, **dict(items[position + 1 :])}}
    n_cases = len(next(iter(cases.values())))
    for column, values in cases.items():
        name, path = InputName.parse(column), ("sweep", "cases", header_of[column])
        try:
            is_word = name.quantity(draft.known_models) is None
        except KeyError:
            problems.append((path, name.unknown_message(draft.known_models)))
            data["sweep"].pop(column, None)
            continue
        if is_word and header_of[column] != column:
            problems.append((path, f'got a unit, expected "{column}"'))
        if str(name) in draft.input_names:
            problems.append((path, f"set together with {name.config_key}, expected one of the two"))
        if len(values) != n_cases or not values:
            expected = f"{n_cases or 'at least one'}, as in the first column"
            count = f"{len(values)} value{'s' * (len(values) != 1)}"
            problems.append((path, f"got {count}, expected {expected}"))
        if name.owner:
            data, _ = set_value(data, name.path, values)
        paths[name.path] = path
    return replace(draft, data=data, columns=paths).with_problems(problems)


def without_replaced_inputs(draft: Draft, fixed: Mapping[str, object]) -> Draft:
    """Leave out the inputs of the starter config that a user replaces by others.

    They are columns of cases; e beside a column alpha; the mass of a ball whose radius is given, which follows
    from that and the density; the density where masses and radii are given, which may contradict it; v1 beside the
    speed of an oblique impact; and the material of both beside a column of one: the other ball keeps it. The draft
    is that of the starter config; `fixed` has inputs that are set after its settings.
    """
    given = {**{str(path[1]): setting.value for path, setting in draft.origins.items() if len(path) > 1}, **fixed}
    cases = as_table(draft.table("sweep").get("cases"))
    columns = {split_header(header)[0]: values for header, values in cases.items()}
    inputs = {**given, **columns}
    replacing = {"alpha": "e", "speed": "v1"}
    replaced = {*columns, *(old for new, old in replacing.items() if new in inputs)}
    replaced |= {f"m{ball}" for ball in (1, 2) if str(inputs.get(f"R{ball}", "inf")).strip() != "inf"}
    replaced -= given.keys()
    sweep = {name: value for name, value in draft.table("sweep").items() if name not in replaced}
    # also in the text, from which a stored result is repeated
    text = re.sub(r"(?m)^(?=(\w+) = )", lambda key: "# " if key[1] in replaced else "", draft.text)
    balls = {"material1", "material2"}
    if balls & columns.keys():
        material = sweep.pop("material", None)
        others = balls - columns.keys() - given.keys()
        sweep |= dict.fromkeys(others, material)
        text = re.sub(r"(?m)^material(?= = )", others.pop() if others else "# material", text)
    data = {**draft.data, "sweep": sweep}
    sets_material = any(path[0] == "materials" for path in draft.origins)
    if {"m1", "R1", "m2", "R2"} <= {*sweep, *inputs} and not sets_material:
        text = re.sub(r"(?m)^(?=rho = )", "# ", text)
        tables = draft.table("materials").items()
        data["materials"] = {name: {key: table[key] for key in table if key != "rho"} for name, table in tables}
    return replace(draft, data=data, text=text)
