"""Values from CSV files: cases, a table of points whose columns vary together, and single columns.

What is read is put in the place of the file's name, and kept with the config as an override such as
`sweep.cases={v1 = [1.0, 2.0], m1 = [0.1, 0.2]}`, so that a stored config needs no other file.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic_core import PydanticCustomError

from ..contact.model import ForceModel
from ..errors import ConfigError
from ..text import safe_text
from .files import MAX_OVERRIDE, read_text, toml_key, toml_text
from .grid import name_of, path_of
from .quantities import MAX_FAULTS, Fault, KeyPath, Quantity, nearest, refuse, show
from .tables import MATERIAL_KEYS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES, model_quantities

MAX_CSV = 2_000_000  # bytes of a file, whose values a result stores
HEADER = re.compile(r"\s*(.*?)\s*(?:\[\s*(.*?)\s*\])?\s*", re.DOTALL)


def quantity_at(path: KeyPath, known: Mapping[str, ForceModel]) -> Quantity | None:
    """The quantity at a path; None for the name of a material.

    Raises
    ------
    KeyError : there is no such input
    """
    match path:
        case ("sweep", str(name)):
            return None if name in MATERIAL_KEYS else SWEEP_QUANTITIES[name]
        case ("materials", _, str(key)):
            return MATERIAL_QUANTITIES[key]
        case ("model", str(model), str(key)):
            return model_quantities(known[model])[key]
    raise KeyError(path)


@dataclass(frozen=True)
class CsvTable:
    """The columns of a CSV file, whose first line names them.

    Parameters
    ----------
    name : of the file, for messages
    units : by column, as its header has it in brackets; empty for SI
    cells : by column, each with its line
    """

    name: str
    units: Mapping[str, str]
    cells: Mapping[str, list[tuple[int, str]]]


def read_csv(path: Path) -> CsvTable:
    """The columns of a CSV file.

    Raises
    ------
    ConfigError : it cannot be read, is too large, has no rows, or rows of another length than its first line
    """
    name = safe_text(str(path))
    rows = csv.reader(io.StringIO(read_text(path, "CSV", MAX_CSV), newline=""), strict=True)
    try:
        lines = [(rows.line_num, row) for row in rows if row]
    except csv.Error as error:
        raise ConfigError([f"{name}:{rows.line_num}: not CSV: {safe_text(str(error))}"]) from None
    if len(lines) < 2:
        raise ConfigError([f"{name}: got {len(lines)} lines, expected a line of names and at least one of values"])
    first, header = lines[0]
    units: dict[str, str] = {}
    problems = []
    for cell in header:
        match = HEADER.fullmatch(cell)
        assert match is not None
        if match[1] in units:
            problems.append(f"{name}:{first}: got {show(match[1])} twice, expected each column once")
        units[match[1]] = match[2] or ""
    for line, row in lines[1:]:
        if len(row) != len(header):
            problems.append(f"{name}:{line}: got {len(row)} values, expected {len(header)}, one for each column")
    if problems:
        raise ConfigError(problems[:MAX_FAULTS])
    columns = zip(*(row for _, row in lines[1:]), strict=True)
    numbers = [line for line, _ in lines[1:]]
    return CsvTable(
        name,
        units,
        {key: list(zip(numbers, cells, strict=True)) for key, cells in zip(units, columns, strict=True)},
    )


def column_values(table: CsvTable, column: str, quantity: Quantity | None, n: float | None) -> list[float | str]:
    """The values of a column in SI units, or names.

    Raises
    ------
    ConfigError : with a line for the unit, or for each cell that is no value of the quantity
    """
    cells, unit, shown = table.cells[column], table.units[column], safe_text(column, 60)
    if quantity is not None and unit:
        try:
            Quantity(quantity.unit, "").read(f"1 {unit}", n)
        except PydanticCustomError as error:
            expected = error.message().partition(", expected ")[2]
            raise ConfigError([f"{table.name}:1: {shown}: got [{safe_text(unit)}], expected {expected}"]) from None
    values: list[float | str] = []
    problems: list[str] = []
    for line, cell in cells:
        try:
            values.append(_value(cell.strip(), unit, quantity, n))
        except PydanticCustomError as error:
            problems.append(f"{table.name}:{line}: {shown}: {error.message()}")
            if len(problems) >= MAX_FAULTS:
                break
    if problems:
        raise ConfigError(problems)
    return values


def _value(text: str, unit: str, quantity: Quantity | None, n: float | None) -> float | str:
    """The value of a cell."""
    expected = "the name of a material" if quantity is None else quantity.expected
    if not text:
        raise refuse(None, expected)
    if quantity is None:
        return text
    try:
        number = float(text)
    except ValueError:
        # a cell may have its own unit where its column has none
        if unit:
            raise refuse(text, expected) from None
        return quantity.read(text, n)
    if not unit:
        return quantity.read(number)
    return quantity.read(f"{text} {unit}", n)


def inline_files(
    data: Mapping[str, Any], folder: Path | None, known: Mapping[str, ForceModel], n: float | None
) -> tuple[dict[str, Any], list[str], list[str]]:
    """The data with the values of the CSV files that it names.

    Parameters
    ----------
    data : plain data of a config
    folder : where the files are; None where none may be read, as in a config that somebody stored
    known : all models by key
    n : the exponent that units may contain

    Returns
    -------
    The data, the overrides that put the values there, and problems. A file that cannot be read stays a name.
    """
    files: dict[str, CsvTable] = {}
    overrides: list[str] = []
    problems: list[str] = []

    def opened(file: str) -> CsvTable:
        if folder is None:
            raise ConfigError([f"{safe_text(file)}: not read; a stored config has the values, not the file"])
        if file not in files:
            files[file] = read_csv(folder / file)
        return files[file]

    def put(path: KeyPath, value: object) -> None:
        text = f"{'.'.join(toml_key(str(part)) for part in path)}={toml_text(value)}"
        if len(text) > MAX_OVERRIDE:
            raise ConfigError([f"{path[-1]}: larger than {MAX_OVERRIDE:,} characters, which no config needs"])
        nonlocal data
        data, overrides[len(overrides) :] = _with(data, path, value), [text]

    cases = _table(data.get("sweep")).get("cases")
    if isinstance(cases, str):
        try:
            put(("sweep", "cases"), _read_cases(opened(cases), known, n))
        except ConfigError as error:
            problems += error.problems
    for path, entry in list(_columns(data)):
        try:
            table, column = opened(entry["file"]), entry["column"]
            if column not in table.units:
                expected = f"one of its columns; {nearest(column, list(table.units))}"
                raise ConfigError([f"{table.name}:1: got {show(column)}, expected {expected}"])
            quantity = quantity_at(path, known)
            put(path, column_values(table, column, quantity, n))
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            continue  # an unknown key is reported with the others
    return dict(data), overrides, list(dict.fromkeys(problems))


def _read_cases(table: CsvTable, known: Mapping[str, ForceModel], n: float | None) -> dict[str, list[float | str]]:
    """All columns of a table of cases."""
    problems: list[str] = []
    values: dict[str, list[float | str]] = {}
    # n may be a column itself
    n = None if "n" in table.units else n
    for column in table.units:
        try:
            values[column] = column_values(table, column, quantity_at(path_of(column), known), n)
        except ConfigError as error:
            problems += error.problems
        except KeyError:
            problems.append(f"{table.name}:1: {safe_text(column, 60)}: {_unknown(column, known)}")
    if problems:
        raise ConfigError(problems)
    return values


def _unknown(name: str, known: Mapping[str, ForceModel]) -> str:
    """A message about a name that is no input."""
    inputs = [*SWEEP_QUANTITIES, *MATERIAL_KEYS]
    key = path_of(name)[1]
    if path_of(name)[0] == "model":
        inputs = [f"{key}.{own}" for own in model_quantities(known[str(key)])] if key in known else list(known)
        name = name if key in known else str(key)
    elif path_of(name)[0] == "materials":
        inputs = [f"materials.{key}.{own}" for own in MATERIAL_QUANTITIES]
    return f"no such input; {nearest(name, inputs)}"


def _columns(data: Mapping[str, Any]) -> Iterator[tuple[KeyPath, Mapping[str, str]]]:
    """Every `{ file = ..., column = ... }` with its path."""
    tables: list[KeyPath] = [("sweep",)]
    tables += [(table, key) for table in ("materials", "model") for key in _table(data.get(table))]
    for path in tables:
        table: Any = data
        for part in path:
            table = _table(table.get(part))
        for key, entry in table.items():
            is_column = isinstance(entry, dict) and entry.keys() == {"file", "column"}
            if is_column and all(isinstance(text, str) for text in entry.values()):
                yield (*path, key), entry


def expand_cases(
    data: Mapping[str, Any], known: Mapping[str, ForceModel]
) -> tuple[dict[str, Any], dict[str, str], list[Fault]]:
    """The data with the columns of `sweep.cases` where single values would be, and these by config name.

    A name that is unknown, or is given elsewhere too, and columns of other lengths than the first are faults.
    """
    sweep = _table(data.get("sweep"))
    cases = sweep.get("cases")
    if not isinstance(cases, dict) or not cases or not all(isinstance(item, list) for item in cases.values()):
        return dict(data), {}, []
    found: list[Fault] = []
    names: dict[str, str] = {}
    # the columns under [sweep] stand where the table does
    columns = {name: values for name, values in cases.items() if path_of(name)[0] == "sweep"}
    place = list(sweep).index("cases")
    items = list(sweep.items())
    new = {**data, "sweep": {**dict(items[:place]), **columns, **dict(items[place + 1 :])}}
    size = len(next(iter(cases.values()), []))
    for name, values in cases.items():
        path, at = path_of(name), ("sweep", "cases", name)
        try:
            quantity_at(path, known)
        except KeyError:
            found.append((at, _unknown(name, known)))
            new["sweep"].pop(name, None)
            continue
        if not _missing(data, path):
            found.append((at, f"given beside {'.'.join(map(str, path))}, expected one of the two"))
        if len(values) != size or not values:
            found.append(
                (at, f"got {len(values)} values, expected {size or 'at least one'}, as in the first column")
            )
        if path[0] != "sweep":
            new = _with(new, path, values)
        names[name_of(path)] = name
    return new, names, found


def _table(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _missing(data: Mapping[str, Any], path: KeyPath) -> bool:
    """Whether there is nothing at a path."""
    for part in path:
        if part not in _table(data):
            return True
        data = data[str(part)]
    return False


def _with(data: Mapping[str, Any], path: KeyPath, value: object) -> dict[str, Any]:
    """The data with a value at a path."""
    name, *rest = map(str, path)
    return {**data, name: _with(_table(data.get(name)), tuple(rest), value) if rest else value}
