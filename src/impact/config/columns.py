"""Named columns of values with units: of CSV files, of tables of pandas and xarray, and of lists in a config.

The values of a file replace its name in a config, and are stored with it as an override such as
`sweep.cases={v1 = [1.0, 2.0], m1 = [0.1, 0.2]}`, so that a stored config needs no other file.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from ..contact.variables import OUTPUTS
from ..errors import ConfigError, did_you_mean
from ..formatting import safe_text
from .draft import Draft
from .files import as_table, read_text, set_value
from .input_names import InputName, input_values
from .quantities import MAX_PROBLEMS, ConfigProblem, KeyPath, Quantity, UnitError, as_text, mismatch_error

MAX_CSV_BYTES = 2_000_000  # size of a CSV file, whose values a result stores
COLUMN_HEADER = re.compile(r"\s*(.*?)\s*(?:\[\s*(.*?)\s*\])?\s*", re.DOTALL)
ROUND_BRACKETS = re.compile(r"(.*\S)\s*\(\s*(.*?)\s*\)", re.DOTALL)

# the quantity of a column by its name, None for names of materials; KeyError for an unknown name
QuantityOf = Callable[[str], Quantity | None]
# values in SI units or names of materials, and problems: the index of a cell and a message
Cells = tuple[list[float | str], list[tuple[int, str]]]


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

    def read(
        self, column: str, quantity: Quantity | None, n: float | None, unit: str = ""
    ) -> tuple[Sequence[Any], Sequence[tuple[int | None, str]]]:
        """Convert a column, whose header may lack `unit`, and list problems: of a cell, or None for the header."""
        unit = self.units.get(column) or unit
        expected = unit_expected(quantity, unit, n)
        if expected:
            return [], [(None, f"got [{safe_text(unit)}], expected {expected}")]
        return read_cells(self.cells[column], quantity, n, unit, is_text=self.is_text)

    def values(self, column: str, quantity: Quantity | None, n: float | None, unit: str = "") -> list[Any]:
        """Convert a column as `read` does; its problems are a `ConfigError`."""
        if quantity is None and not self.is_known:
            raise ConfigError(self.problem("got no known column, expected such as material1 or v1 [m/s]"))
        values, problems = self.read(column, quantity, n, unit)
        if problems and quantity is not None and not self.is_known:
            raise ConfigError(self.problem(f"expected {quantity.expected}", row=problems[0][0]))
        if problems:
            raise ConfigError(*(self.problem(message, column, row) for row, message in problems))
        return list(values)


def read_cells(
    cells: Iterable[object], quantity: Quantity | None, n: float | None, unit: str = "", *, is_text: bool = False
) -> Cells:
    """Convert cells to SI units or to names of materials; text without a unit is a number only with `is_text`."""
    values: list[float | str] = []
    problems: list[tuple[int, str]] = []
    for index, cell in enumerate(cells):
        try:
            values.append(_read_cell(cell, quantity, n, unit, is_text=is_text))
        except PydanticCustomError as error:
            problems.append((index, error.message()))
            if len(problems) >= MAX_PROBLEMS:
                break
    return values, problems


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
                raise mismatch_error(cell, quantity.expected) from None
    return quantity.read(f"{cell} {unit}" if unit else number, n)


def unit_expected(quantity: Quantity | None, unit: str, n: float | None = math.nan) -> str:
    """Describe the units that a quantity may have; empty if `unit` is one of them."""
    try:
        if quantity is not None and unit:
            quantity.factor(unit, n)
    except UnitError as error:
        return str(error)
    return ""


def read_csv(path: Path, quantity_of: QuantityOf, *, with_any_names: bool = False) -> Columns:
    """Read the columns of a CSV file, whose first line has their names, some of them known, and their units."""
    reader = csv.reader(io.StringIO(read_text(path, "CSV", MAX_CSV_BYTES), newline=""), strict=True)
    try:
        numbered = [(reader.line_num, row) for row in reader if row]
    except csv.Error as error:
        raise ConfigError(f"{path}:{reader.line_num}: not CSV: {error}") from None
    if len(numbered) < 2:
        raise ConfigError(
            f"{path}: got {len(numbered)} lines, expected a line of names and at least one of values"
        )
    (first, headers), *numbered = numbered
    rows, header = dict(numbered), f"{path}:{first}"
    if headers[0].lstrip().startswith("#"):
        raise ConfigError(f"{header}: got a comment, expected the names of the columns")
    separator = next((mark for mark in ";\t" if mark in headers[0]), "")
    if len(headers) == 1 and separator:
        got = f'columns separated by {as_text(separator)}, expected ","'
        raise ConfigError(f"{header}: got {got}, and a point in numbers, such as 0.5")
    names = [split_header(text) for text in headers]
    with_square_brackets = {name: _with_square_brackets(name, quantity_of) for name, _ in names}
    is_known = any(_is_known(name, quantity_of) or with_square_brackets[name] for name, _ in names)
    if not (is_known or with_any_names):
        expected = "names of inputs or outputs, such as v1 [m/s] or e_out"
        raise ConfigError(f"{header}: got no known column, expected {expected}")
    problems = [
        f"{header}: {safe_text(name, 60)}: got round brackets, expected {as_text(expected)}"
        for name, expected in with_square_brackets.items()
        if expected
    ]
    for name, count in Counter(name for name, _ in names).items():
        if count > 1:
            got = f"{as_text(name) if is_known else 'a name'} {'twice' if count == 2 else f'{count} times'}"
            problems.append(f"{header}: got {got}, expected each column once")
    problems += _length_problems(path, rows, len(headers))
    if problems:
        raise ConfigError(*problems[:MAX_PROBLEMS])
    columns = zip(*rows.values(), strict=True)
    cells = {name: [cell.strip() for cell in column] for (name, _), column in zip(names, columns, strict=True)}
    return Columns(str(path), first, list(rows), dict(names), cells, is_known)


def split_header(text: str) -> tuple[str, str]:
    """Split the header of a column, such as "v1 [mm/s]", into its name and its unit."""
    match = COLUMN_HEADER.fullmatch(text)
    assert match is not None, "any text matches"
    return match[1], match[2] or ""


def _is_known(column: str, quantity_of: QuantityOf) -> bool:
    try:
        quantity_of(column)
    except KeyError:
        return False
    return True


def _with_square_brackets(column: str, quantity_of: QuantityOf) -> str:
    """Put the unit of a header in square brackets, if it is in round ones and the name is known; else empty."""
    match = ROUND_BRACKETS.fullmatch(column)
    if match is None or not _is_known(match[1], quantity_of):
        return ""
    quantity, unit = quantity_of(match[1]), match[2]
    return f"{match[1]} [{quantity.unit if quantity is not None and unit_expected(quantity, unit) else unit}]"


def _length_problems(path: Path, rows: Mapping[int, Sequence[str]], n_columns: int) -> list[str]:
    """List each wrong number of values in a row, with its first line, and each comment."""
    expected = f"expected {n_columns}, one for each column"
    problems: list[str] = []
    lines_by_length: dict[int, list[int]] = {}
    for line, row in rows.items():
        if len(row) != n_columns and row[0].lstrip().startswith("#"):
            problems.append(f"{path}:{line}: got a comment, {expected.replace(',', ' values,')}")
        elif len(row) != n_columns:
            lines_by_length.setdefault(len(row), []).append(line)
    for n_values, (line, *others) in lines_by_length.items():
        also = f"; also on {len(others)} other line{'s' * (len(others) > 1)}" if others else ""
        problems.append(f"{path}:{line}: got {n_values} values, {expected}{also}")
    return problems


def columns_of_table(table: Any, source: str) -> Columns:
    """Take the columns of a DataFrame, or of a dataset of xarray, whose units are attributes."""
    units: dict[str, str] = {}
    if hasattr(table, "data_vars"):
        units = {str(name): str(variable.attrs.get("units", "")) for name, variable in table.variables.items()}
        table = table.to_dataframe().reset_index()
    cells = {split_header(str(header)): values.tolist() for header, values in table.items()}
    return Columns(
        source,
        0,
        range(1, len(table) + 1),
        {name: unit or units.get(name, "") for name, unit in cells},
        {name: values for (name, _), values in cells.items()},
        is_text=False,
    )


def read_csv_of(draft: Draft, file: str, *, with_any_names: bool = False) -> Columns:
    """Read a CSV file that a config names."""
    if draft.folder is None:
        raise ConfigError(f"{file}: not read; a stored config contains values, not file names")

    def quantity_of(name: str) -> Quantity | None:
        if name in OUTPUTS:
            return Quantity(OUTPUTS[name].unit, "")
        return InputName.parse(name).quantity(draft.known_models)

    return read_csv(draft.folder / file, quantity_of, with_any_names=with_any_names)


def read_files(draft: Draft) -> tuple[dict[KeyPath, object], list[str]]:
    """Read the CSV files of cases and of single columns: the values that replace their names, and problems."""
    open_csv = cache(partial(read_csv_of, draft))
    values: dict[KeyPath, object] = {}
    problems: list[str] = []
    cases = draft.table("sweep").get("cases")
    if isinstance(cases, str):
        try:
            values["sweep", "cases"] = _read_cases(open_csv(cases), draft)
        except ConfigError as error:
            problems += error.problems
    for name, file, column in _file_columns(draft.data):
        try:
            columns = open_csv(file, with_any_names=True)
            found = _find_column(columns, column if column is not None else str(name), is_only=column is None)
            list_of_values = columns.values(found, name.quantity(draft.known_models), draft.exponent)
            values[name.path] = list_of_values if column is not None else {"empirical": list_of_values}
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            continue  # an unknown key is reported with the others
    return values, list(dict.fromkeys(problems))


def _find_column(columns: Columns, name: str, *, is_only: bool) -> str:
    """Find a column by its name; with `is_only`, the single column of a file may have any name."""
    if is_only and len(columns.units) == 1:
        return next(iter(columns.units))
    if name in columns.units:
        return name
    hint = f"; {did_you_mean(name, list(columns.units))}" if columns.is_known else ""
    if any(header.startswith(f"{name} (") for header in columns.units):
        hint = f'; a unit is in square brackets: "{safe_text(name, 60)} [UNIT]"'
    raise ConfigError(columns.problem(f"got {as_text(name)}, expected one of its columns{hint}"))


def _read_cases(columns: Columns, draft: Draft) -> dict[str, list[float | str]]:
    """Convert all columns of a table of cases to SI units."""
    problems: list[str] = []
    values: dict[str, list[float | str]] = {}
    # n may be one of the columns
    n = None if "n" in columns.units else draft.exponent
    for name in columns.units:
        try:
            values[name] = columns.values(name, InputName.parse(name).quantity(draft.known_models), n)
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            problems.append(columns.problem(InputName.parse(name).unknown_message(draft.known_models), name))
    if problems:
        raise ConfigError(*problems)
    return values


def _file_columns(data: Mapping[str, Any]) -> Iterator[tuple[InputName, str, str | None]]:
    """Yield name, file and column of every `{ file = ..., column = ... }` and `{ empirical = file }`."""
    for name, reference in input_values(data):
        match reference:
            case {"file": str(file), "column": str(column), **others} if not others:
                yield name, file, column
            case {"empirical": str(file), **others} if not others:
                yield name, file, None


def named_files(data: Mapping[str, Any]) -> list[str]:
    """List the names of all CSV files in the plain data of a config."""
    names = [as_table(data.get("sweep")).get("cases"), as_table(data.get("data")).get("file")]
    names += [file for _, file, _ in _file_columns(data)]
    return list(dict.fromkeys(name for name in names if isinstance(name, str)))


def expand_cases(draft: Draft) -> Draft:
    """Replace `sweep.cases` by its columns."""
    sweep = draft.table("sweep")
    cases = sweep.get("cases")
    if not isinstance(cases, dict) or not cases or not all(isinstance(values, list) for values in cases.values()):
        return draft
    problems: list[ConfigProblem] = []
    paths: dict[KeyPath, KeyPath] = {}
    # the columns that belong to [sweep] take the position of the table
    in_sweep = {column: values for column, values in cases.items() if not InputName.parse(column).owner}
    position, items = list(sweep).index("cases"), list(sweep.items())
    data = {**draft.data, "sweep": {**dict(items[:position]), **in_sweep, **dict(items[position + 1 :])}}
    n_cases = len(next(iter(cases.values())))
    for column, values in cases.items():
        name, path = InputName.parse(column), ("sweep", "cases", column)
        try:
            name.quantity(draft.known_models)
        except KeyError:
            problems.append((path, name.unknown_message(draft.known_models)))
            data["sweep"].pop(column, None)
            continue
        if contains_path(draft.data, name.path):
            problems.append((path, f"set together with {name.config_key}, expected one of the two"))
        if len(values) != n_cases or not values:
            expected = f"{n_cases or 'at least one'}, as in the first column"
            problems.append((path, f"got {len(values)} values, expected {expected}"))
        if name.owner:
            data, _ = set_value(data, name.path, values)
        paths[name.path] = path
    return replace(draft, data=data, cases=paths).with_problems(problems)


def contains_path(data: Mapping[str, Any], path: KeyPath) -> bool:
    """Check whether the data has a value at a path."""
    for key in path[:-1]:
        data = as_table(data.get(str(key)))
    return path[-1] in data
