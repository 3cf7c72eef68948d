"""Values from CSV files: cases, a table of points whose columns vary together, and single columns.

The values replace the name of the file, and are stored with the config as an override such as
`sweep.cases={v1 = [1.0, 2.0], m1 = [0.1, 0.2]}`, so that a stored config needs no other file.
"""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from ..contact.model import ForceModel
from ..contact.variables import OUTPUTS
from ..errors import ConfigError
from ..text import safe_text
from .files import as_table, override_text, read_text, set_value
from .input_names import InputName, input_values
from .quantities import MAX_PROBLEMS, ConfigProblem, KeyPath, Quantity, mismatch_error, show, suggest

MAX_CSV_BYTES = 2_000_000  # size of a CSV file, whose values a result stores
COLUMN_HEADER = re.compile(r"\s*(.*?)\s*(?:\[\s*(.*?)\s*\])?\s*", re.DOTALL)
ROUND_BRACKETS = re.compile(r"(.*\S)\s*\(\s*(.*?)\s*\)", re.DOTALL)


@dataclass(frozen=True)
class CsvTable:
    """The columns of a CSV file, whose first line names them.

    Parameters
    ----------
    name : of the file, for messages
    units : unit of each column, in brackets in its header; empty for SI
    cells : line and text of each cell, by column
    is_known : whether a column has the name of an input or an output. Otherwise it may be any file, such as one
        with passwords, that a config of unknown origin names: messages contain nothing of it
    """

    name: str
    units: Mapping[str, str]
    cells: Mapping[str, list[tuple[int, str]]]
    is_known: bool = True


def read_csv(
    path: Path, quantity_of: Callable[[str], Quantity | None], *, with_any_names: bool = False
) -> CsvTable:
    """The columns of a CSV file.

    Parameters
    ----------
    path : the file
    quantity_of : the quantity of a column by its name, or KeyError for an unknown name
    with_any_names : accept a file in which no column has a known name

    Raises
    ------
    ConfigError : the file cannot be read, is too large, has no rows or no known names, or has rows of another
        length than the header
    """
    name = safe_text(str(path))
    rows = csv.reader(io.StringIO(read_text(path, "CSV", MAX_CSV_BYTES), newline=""), strict=True)
    try:
        lines = [(rows.line_num, row) for row in rows if row]
    except csv.Error as error:
        raise ConfigError(f"{name}:{rows.line_num}: not CSV: {safe_text(str(error))}") from None
    if len(lines) < 2:
        raise ConfigError(f"{name}: got {len(lines)} lines, expected a line of names and at least one of values")
    first, header = lines[0]
    location = f"{name}:{first}"
    if header[0].lstrip().startswith("#"):
        raise ConfigError(f"{location}: got a comment, expected the names of the columns")
    separator = next((mark for mark in ";\t" if mark in header[0]), "")
    if len(header) == 1 and separator:
        got = f'columns separated by {show(separator)}, expected ","'
        raise ConfigError(f"{location}: got {got}, and a point in numbers, such as 0.5")
    matches = [match for match in map(COLUMN_HEADER.fullmatch, header) if match is not None]
    units = {match[1]: match[2] or "" for match in matches}
    with_square_brackets = {column: _with_square_brackets(column, quantity_of) for column in units}
    is_known = any(_is_known(column, quantity_of) or with_square_brackets[column] for column in units)
    if not (is_known or with_any_names):
        expected = "names of inputs or outputs, such as v1 [m/s] or e_out"
        raise ConfigError(f"{location}: got no known column, expected {expected}")
    problems = [
        f"{location}: {safe_text(column, 60)}: got round brackets, expected {show(expected)}"
        for column, expected in with_square_brackets.items()
        if expected
    ]
    for column, count in Counter(match[1] for match in matches).items():
        if count > 1:
            got = f"{show(column) if is_known else 'a name'} {'twice' if count == 2 else f'{count} times'}"
            problems.append(f"{location}: got {got}, expected each column once")
    problems += _length_problems(name, lines[1:], len(header))
    if problems:
        raise ConfigError(*problems[:MAX_PROBLEMS])
    columns = zip(*(row for _, row in lines[1:]), strict=True)
    numbers = [line for line, _ in lines[1:]]
    return CsvTable(
        name,
        units,
        {key: list(zip(numbers, cells, strict=True)) for key, cells in zip(units, columns, strict=True)},
        is_known,
    )


def _is_known(column: str, quantity_of: Callable[[str], Quantity | None]) -> bool:
    """Whether a column has the name of an input or an output."""
    try:
        quantity_of(column)
    except KeyError:
        return False
    return True


def _with_square_brackets(column: str, quantity_of: Callable[[str], Quantity | None]) -> str:
    """The header with its unit in square brackets, if it is in round ones and the name is known; else empty."""
    match = ROUND_BRACKETS.fullmatch(column)
    if match is None or not _is_known(match[1], quantity_of):
        return ""
    quantity, unit = quantity_of(match[1]), match[2]
    try:
        if quantity is not None:
            Quantity(quantity.unit, "").read(f"1 {unit}")
    except PydanticCustomError:
        unit = quantity.unit if quantity is not None else unit
    return f"{match[1]} [{unit}]"


def _length_problems(name: str, lines: list[tuple[int, list[str]]], n_columns: int) -> list[str]:
    """A problem for each wrong number of values in a row, with its first line, and for a comment."""
    expected = f"expected {n_columns}, one for each column"
    problems: list[str] = []
    first_lines: dict[int, list[int]] = {}
    for line, row in lines:
        if len(row) != n_columns and row[0].lstrip().startswith("#"):
            problems.append(f"{name}:{line}: got a comment, {expected.replace(',', ' values,')}")
        elif len(row) != n_columns:
            first_lines.setdefault(len(row), []).append(line)
    for n_values, (line, *others) in first_lines.items():
        also = f"; also on {len(others)} other line{'s' * (len(others) > 1)}" if others else ""
        problems.append(f"{name}:{line}: got {n_values} values, {expected}{also}")
    return problems


def column_quantity(name: str, models: Mapping[str, ForceModel]) -> Quantity | None:
    """The quantity of a column that has the name of an output or an input; None for names of materials.

    Raises
    ------
    KeyError : there is no such output or input
    """
    return Quantity(OUTPUTS[name].unit, "output") if name in OUTPUTS else InputName.parse(name).quantity(models)


def column_values(table: CsvTable, column: str, quantity: Quantity | None, n: float | None) -> list[float | str]:
    """The values of a column in SI units, or names of materials.

    Raises
    ------
    ConfigError : with a line for the unit, or for each cell that the quantity does not allow
    """
    if not table.is_known:
        return _values_of_unknown(table, column, quantity, n)
    cells, unit, shown = table.cells[column], table.units[column], safe_text(column, 60)
    if quantity is not None and unit:
        try:
            Quantity(quantity.unit, "").read(f"1 {unit}", n)
        except PydanticCustomError as error:
            expected = error.message().partition(", expected ")[2]
            raise ConfigError(f"{table.name}:1: {shown}: got [{safe_text(unit)}], expected {expected}") from None
    values: list[float | str] = []
    problems: list[str] = []
    for line, cell in cells:
        try:
            values.append(_cell_value(cell.strip(), unit, quantity, n))
        except PydanticCustomError as error:
            problems.append(f"{table.name}:{line}: {shown}: {error.message()}")
            if len(problems) >= MAX_PROBLEMS:
                break
    if problems:
        raise ConfigError(*problems)
    return values


def _values_of_unknown(
    table: CsvTable, column: str, quantity: Quantity | None, n: float | None
) -> list[float | str]:
    """The numbers of a column of a table without known names; problems contain nothing of the file."""
    if quantity is None:
        raise ConfigError(f"{table.name}:1: got no known column, expected such as material1 or v1 [m/s]")
    values: list[float | str] = []
    for line, cell in table.cells[column]:
        try:
            values.append(_cell_value(cell.strip(), table.units[column], quantity, n))
        except PydanticCustomError:
            raise ConfigError(f"{table.name}:{line}: expected {quantity.expected}") from None
    return values


def _cell_value(text: str, unit: str, quantity: Quantity | None, n: float | None) -> float | str:
    """The value of a cell in SI units, or the name of a material."""
    expected = "the name of a material" if quantity is None else quantity.expected
    if not text:
        raise mismatch_error(None, expected)
    if quantity is None:
        return text
    try:
        number = float(text)
    except ValueError:
        # a cell may have its own unit where its column has none
        if unit:
            raise mismatch_error(text, expected) from None
        return quantity.read(text, n)
    if not unit:
        return quantity.read(number)
    return quantity.read(f"{text} {unit}", n)


def inline_files(
    data: Mapping[str, Any], folder: Path | None, models: Mapping[str, ForceModel], n: float | None
) -> tuple[dict[str, Any], list[str], list[str]]:
    """Replace the names of CSV files in a config by the values in the files.

    Parameters
    ----------
    data : plain data of a config
    folder : of the files; None if no file may be read, as for a config stored in a result
    models : all models by key
    n : the exponent that units may contain

    Returns
    -------
    The new data, overrides that do the same, and problems. The name of a file that cannot be read is not replaced.
    """
    files: dict[tuple[str, bool], CsvTable] = {}
    overrides: list[str] = []
    problems: list[str] = []

    def open_csv(file: str, *, with_any_names: bool = False) -> CsvTable:
        if folder is None:
            raise ConfigError(f"{safe_text(file)}: not read; a stored config contains values, not file names")
        key = (file, with_any_names)
        if key not in files:
            of_column = partial(column_quantity, models=models)
            files[key] = read_csv(folder / file, of_column, with_any_names=with_any_names)
        return files[key]

    def store_values(path: KeyPath, value: object) -> None:
        nonlocal data
        overrides.append(override_text(path, value))
        data, _ = set_value(data, path, value)

    cases = as_table(data.get("sweep")).get("cases")
    if isinstance(cases, str):
        try:
            store_values(("sweep", "cases"), _read_cases(open_csv(cases), models, n))
        except ConfigError as error:
            problems += error.problems
    for name, file, column in list(_file_columns(data)):
        try:
            table = open_csv(file, with_any_names=True)
            is_sample = column is None
            if column is None:
                # the only column, or that of the input
                column = next(iter(table.units)) if len(table.units) == 1 else str(name)
            if column not in table.units:
                known = f"; {suggest(column, list(table.units))}" if table.is_known else ""
                if any(header.startswith(f"{column} (") for header in table.units):
                    known = f'; a unit is in square brackets: "{safe_text(column, 60)} [UNIT]"'
                raise ConfigError(f"{table.name}:1: got {show(column)}, expected one of its columns{known}")
            values = column_values(table, column, name.quantity(models), n)
            store_values(name.path, {"empirical": values} if is_sample else values)
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            continue  # an unknown key is reported with the others
    return dict(data), overrides, list(dict.fromkeys(problems))


def _read_cases(
    table: CsvTable, models: Mapping[str, ForceModel], n: float | None
) -> dict[str, list[float | str]]:
    """The values of all columns of a table of cases."""
    problems: list[str] = []
    values: dict[str, list[float | str]] = {}
    # n may be one of the columns
    n = None if "n" in table.units else n
    for column in table.units:
        try:
            values[column] = column_values(table, column, InputName.parse(column).quantity(models), n)
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            problems.append(
                f"{table.name}:1: {safe_text(column, 60)}: {InputName.parse(column).unknown_message(models)}"
            )
    if problems:
        raise ConfigError(*problems)
    return values


def _file_columns(data: Mapping[str, Any]) -> Iterator[tuple[InputName, str, str | None]]:
    """The name, the file and the column of every `{ file = ..., column = ... }` and `{ empirical = file }`."""
    for name, reference in input_values(data):
        match reference:
            case {"file": str(file), "column": str(column), **others} if not others:
                yield name, file, column
            case {"empirical": str(file), **others} if not others:
                yield name, file, None


def named_files(data: Mapping[str, Any]) -> list[str]:
    """The names of all CSV files in the plain data of a config."""
    names = [as_table(data.get("sweep")).get("cases"), as_table(data.get("data")).get("file")]
    names += [file for _, file, _ in _file_columns(data)]
    return list(dict.fromkeys(name for name in names if isinstance(name, str)))


def expand_cases(
    data: Mapping[str, Any], models: Mapping[str, ForceModel]
) -> tuple[dict[str, Any], dict[str, str], list[ConfigProblem]]:
    """Replace `sweep.cases` by its columns.

    Returns
    -------
    The data with each column at the path of its config name; the names of the columns by config name; and
    problems: names that are unknown or have another value, and columns of another length than the first.
    """
    sweep = as_table(data.get("sweep"))
    cases = sweep.get("cases")
    if not isinstance(cases, dict) or not cases or not all(isinstance(values, list) for values in cases.values()):
        return dict(data), {}, []
    problems: list[ConfigProblem] = []
    names: dict[str, str] = {}
    # the columns that belong to [sweep] take the position of the table
    columns = {name: values for name, values in cases.items() if not InputName.parse(name).owner}
    position = list(sweep).index("cases")
    sweep_items = list(sweep.items())
    new = {**data, "sweep": {**dict(sweep_items[:position]), **columns, **dict(sweep_items[position + 1 :])}}
    n_cases = len(next(iter(cases.values()), []))
    for name, values in cases.items():
        input_name, cases_path = InputName.parse(name), ("sweep", "cases", name)
        try:
            input_name.quantity(models)
        except KeyError:
            problems.append((cases_path, input_name.unknown_message(models)))
            new["sweep"].pop(name, None)
            continue
        if contains_path(data, input_name.path):
            problems.append((cases_path, f"set together with {input_name.config_key}, expected one of the two"))
        if len(values) != n_cases or not values:
            problems.append(
                (
                    cases_path,
                    f"got {len(values)} values, expected {n_cases or 'at least one'}, as in the first column",
                )
            )
        if input_name.owner:
            new, _ = set_value(new, input_name.path, values)
        names[str(input_name)] = name
    return new, names, problems


def contains_path(data: Mapping[str, Any], path: KeyPath) -> bool:
    """Whether the data has a value at a path."""
    for key in path[:-1]:
        data = as_table(data.get(str(key)))
    return path[-1] in data
