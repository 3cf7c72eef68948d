"""Measurements of a config: the table [data], from a CSV file or inline, and the parameters fitted to them."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
from pydantic_core import PydanticCustomError

from ..array_types import Array
from ..contact.friction import FrictionLaw
from ..contact.model import ForceModel, with_base_quantities
from ..contact.variables import OUTPUTS
from ..errors import ConfigError
from ..formatting import law_name, number, quantity, safe_text
from .columns import (
    CSV_KEYS,
    ColumnProblem,
    Columns,
    CsvFile,
    CsvValues,
    also,
    columns_of_table,
    complete_rows,
    csv_form,
    misspelt_column,
    split_header,
)
from .draft import Draft, Measurements
from .files import as_table, set_value
from .input_names import InputName, paths_with
from .quantities import MAX_PROBLEMS, ConfigProblem, KeyPath, Quantity, as_text, value_error
from .tables import (
    DEVIATION,
    GRAVITY,
    LABORATORY,
    LOSSES,
    MAX_MEASURED,
    NOISES,
    STANDARD_GRAVITY,
    SWEEP_DEFAULTS,
    SWEEP_QUANTITIES,
)

SIGMA, SPECIMEN = "sigma", "specimen"
# intervals of measured values; noise may move a fraction below 0 or above 1, but not farther than this
_INTERVALS: dict[str, dict[str, Any]] = {
    "any": {"least": -MAX_MEASURED, "most": MAX_MEASURED},
    "positive": {"least": 0.0, "above": True, "most": MAX_MEASURED},
    "fraction": {"least": -0.5, "most": 1.5},
}
MEASURED_OUTPUTS = {
    name: Quantity(output.unit, "measured", **_INTERVALS[output.measured])
    for name, output in OUTPUTS.items()
    if output.measured
}


@dataclass(frozen=True)
class _Column:
    """What a column of [data] holds."""

    kind: Literal["input", "output", "sigma", "specimen", "laboratory"]
    name: str  # of what it holds; of standard deviations, of what they are those
    quantity: Quantity
    values: tuple[Any, ...] = ()  # in SI units, or names of specimens

    @property
    def header(self) -> str:
        """Its name in [data]."""
        return f"{SIGMA}_{self.name}" if self.kind == SIGMA else self.name


# columns that are no inputs, by header
_COLUMNS = {
    column.header: column
    for column in (
        *(_Column("laboratory", name, quantity) for name, (quantity, _) in LABORATORY.items()),
        *(_Column("output", name, quantity) for name, quantity in MEASURED_OUTPUTS.items()),
        _Column("specimen", SPECIMEN, Quantity("1", "name of a specimen")),
        *(
            _Column("sigma", name, replace(q, meaning="standard deviation", above=True))
            for name, (q, _) in LABORATORY.items()
        ),
        *(_Column("sigma", name, replace(DEVIATION, unit=q.unit)) for name, q in MEASURED_OUTPUTS.items()),
    )
}


@dataclass(frozen=True)
class _Points:
    """Measured points as they are stored."""

    columns: tuple[_Column, ...] = ()
    lines: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    def of_kind(self, kind: str) -> dict[str, tuple[Any, ...]]:
        return {column.name: column.values for column in self.columns if column.kind == kind}


def purpose_problems(data: Mapping[str, Any]) -> list[ConfigProblem]:
    """Refuse measurements and parameters to fit in a sweep."""
    takes = "use impact calibrate, which takes [data] and { fit = [least, most] }"
    if "data" in data:
        return [(("data",), f"got measurements, expected a sweep; {takes}")]
    return [(path, f"got a fit, expected a value or an axis; {takes}") for path in paths_with(data, ["fit"])][:1]


def _read_columns(columns: Columns, draft: Draft) -> tuple[_Points, list[ColumnProblem]]:
    """Read columns of a file, which are text and have units, or lists of a config, and report all problems."""
    kinds, unused, problems = _used_columns(columns, draft)
    rows, count, gaps = complete_rows(columns, kinds, refuse=draft.table("data").get("missing") == "error")
    if problems or gaps:
        return _Points(), [*problems, *gaps]
    complete = columns.take(rows)
    n = None if any(column.name == "n" for column in kinds.values()) else draft.exponent
    read: list[_Column] = []
    notes = [*columns.notes(count, unused)]
    for header, column in kinds.items():
        unit = columns.units.get(header, "")
        if column.kind == SIGMA and not unit and columns.units.get(column.name):
            # a standard deviation has the unit of what it is one of
            unit = columns.units[column.name]
            notes += columns.notes(f"{safe_text(header, 60)}: got no unit, read in [{unit}] as {column.name}")
        values, found = _read_column(complete, column, header, unit, n)
        problems += [(header, None if row is None else rows[row], message) for _, row, message in found]
        read.append(replace(column, values=tuple(values)))
    points = _Points(tuple(read), tuple(complete.lines), tuple(notes))
    if not problems:
        problems = list(_approach_problems(points, rows, draft))
    if not problems and points.of_kind("laboratory"):
        g = GRAVITY.read_or_nan(draft.table("data").get("g", STANDARD_GRAVITY))
        points, problems = _with_derived(points, rows, STANDARD_GRAVITY if math.isnan(g) else g)
    elif not problems and "g" in draft.table("data") and "lines" not in draft.table("data"):
        # with lines, what follows from a file is in its place
        problems.append(("", None, "got data.g without heights and times of flight, which alone use it"))
    return points, problems


def _used_columns(columns: Columns, draft: Draft) -> tuple[dict[str, _Column], list[str], list[ColumnProblem]]:
    """Find what columns hold, by header; also returns the headers of those without use, and problems."""
    kinds: dict[str, _Column] = {}
    problems: list[ColumnProblem] = []
    unused: list[str] = []
    derived = {name: header for header in columns.cells for name in LABORATORY.get(header, (None, ()))[1]}
    outputs = list(dict.fromkeys(name for name in (*columns.cells, *derived) if name in MEASURED_OUTPUTS))
    for header in columns.cells:
        try:
            column = _column_of(header, outputs, draft.known_models)
            if column is None:
                unused.append(header)
                continue
            twin = next((key for key, c in kinds.items() if (c.kind, c.name) == (column.kind, column.name)), None)
            if twin is not None:
                raise value_error(f"got a second column of {column.name}, next to {as_text(twin)}, expected one")
            kinds[header] = column
            _check_conflict(column, derived, draft)
        except PydanticCustomError as error:
            problems.append((header, None, error.message()))
    if not outputs and not problems:
        problems.append(("", None, "got no column of an output, expected one, such as e_out or contact_time"))
    return kinds, unused, [*problems, *_laboratory_problems(kinds, draft)]


def _check_conflict(column: _Column, derived: Mapping[str, str], draft: Draft) -> None:
    """Check that what a column holds is given once; `derived` has what follows from heights and times."""
    name = InputName.parse(column.name)
    if column.kind == "input" and column.name in draft.input_names:
        hint = "; a measured restitution is e_out" if column.name == "e" else ""
        raise value_error(f"set together with {name.config_key}, expected one of the two{hint}")
    follows = LABORATORY[column.name][1] if column.kind == "laboratory" else ()
    others = [derived[key] for key in follows if derived[key] != column.name]
    others += [f"sweep.{key}" for key in ("v1", "speed") if "v1" in follows and key in draft.table("sweep")]
    others += [derived[column.name]] if column.kind in ("input", "output") and column.name in derived else []
    if others:
        raise value_error(f"set together with {others[0]}, from which it follows, expected one of the two")


def _laboratory_problems(kinds: Mapping[str, _Column], draft: Draft) -> Iterator[ColumnProblem]:
    """Check that heights and times are complete, and those of a ball on a body at rest."""
    of_lab = [column.name for column in kinds.values() if column.kind == "laboratory"]
    if not of_lab:
        return
    if "rebound_height" in of_lab and "drop_height" not in of_lab:
        yield "rebound_height", None, "got no column drop_height, expected one next to it"
    deviations = {column.name: header for header, column in kinds.items() if column.kind == SIGMA}
    if "e_out" in deviations and not deviations.keys().isdisjoint(of_lab):
        other = next(deviations[name] for name in of_lab if name in deviations)
        yield deviations["e_out"], None, f"set together with {other}, expected one of the two"
    for key, expected in (("m2", math.inf), ("v2", 0.0)):
        value = draft.table("sweep").get(key, SWEEP_DEFAULTS.get(key))
        if SWEEP_QUANTITIES[key].read_or_nan(value) != expected or key in kinds:
            got = f"got {key} = {'a column' if key in kinds else as_text(value)}, expected {key} = {expected:g}"
            yield of_lab[0], None, f"{got} in [sweep]: heights and times are those of a ball on a body at rest"


def _approach_problems(points: _Points, rows: Sequence[int], draft: Draft) -> Iterator[ColumnProblem]:
    """Refuse rows in which the balls do not meet."""
    inputs = points.of_kind("input")
    if "v1" not in inputs:
        return
    v1 = inputs["v1"]
    at_rest = SWEEP_QUANTITIES["v2"].read_or_nan(draft.table("sweep").get("v2", SWEEP_DEFAULTS["v2"]))
    v2 = inputs.get("v2", (at_rest,) * len(rows))
    apart = [index for index in range(len(rows)) if v1[index] <= v2[index]]
    if apart:
        got = f"got {quantity(v1[apart[0]], 'm/s')} with v2 = {quantity(v2[apart[0]], 'm/s')}"
        yield "v1", rows[apart[0]], f"{got}, expected v1 > v2{also(len(apart) - 1)}"


def derive_impacts(
    values: Mapping[str, Sequence[float]], rows: Sequence[int], specimens: Sequence[str], g: float
) -> tuple[dict[str, list[float]], list[int]]:
    """Compute velocities and restitutions of a ball that falls on a body at rest, from heights or times of flight.

    Derived here, for a motion without drag. A drop from h1 and a rebound to h2: v1 = sqrt(2 g h1), e_out =
    sqrt(h2/h1). Flights of t1 and t2 before and after an impact: v1 = g t1/2, e_out = t2/t1. Deviations are
    propagated to first order.

    Parameters
    ----------
    values : of each row [SI], by names of LABORATORY and, with the prefix `sigma_`, their standard deviations
    rows : number of each row; flights in successive rows of one specimen are successive ones of one ball
    specimens : of each row
    g : acceleration of gravity [m/s^2]

    Returns
    -------
    v1, e_out and sigma_e_out, as far as they follow, and the position of the row to which each value belongs; NaN
    for the deviation of a ball that does not rebound

    >>> derive_impacts({"flight_time": [0.5, 0.4, 0.2]}, [0, 1, 2], ["", "", ""], 10.0)
    ({'v1': [2.5, 2.0], 'e_out': [0.8, 0.5]}, [0, 1])
    """
    before = after = list(range(len(rows)))
    first, second, power = "drop_height", "rebound_height", 0.5
    if "flight_time" in values:
        first, second, power = "flight_time", "flight_time", 1.0
        before = [i for i in before[:-1] if rows[i + 1] == rows[i] + 1 and specimens[i] == specimens[i + 1]]
        after = [i + 1 for i in before]

    def column(name: str, at: list[int]) -> Array:
        return np.asarray(values[name], float)[at] if name in values else np.zeros(len(at))

    start, end = column(first, before), column(second, after)
    derived = {"v1": 0.5 * g * start if power == 1.0 else np.sqrt(2.0 * g * start)}
    if second in values:
        derived["e_out"] = (end / start) ** power
        deviations = [f"{SIGMA}_{first}", f"{SIGMA}_{second}"]
        if not values.keys().isdisjoint(deviations):
            # without a rebound there is none of first order
            with np.errstate(divide="ignore", invalid="ignore"):
                relative = np.hypot(column(deviations[0], before) / start, column(deviations[1], after) / end)
                derived[f"{SIGMA}_e_out"] = power * derived["e_out"] * relative
    return {name: array.tolist() for name, array in derived.items()}, before


def _with_derived(points: _Points, rows: Sequence[int], g: float) -> tuple[_Points, list[ColumnProblem]]:
    """Replace heights and times of flight by what follows from them, and report what cannot.

    That is a lone flight, a rebound that no noise explains, and a deviation that does not follow.
    """
    values = {column.header: column.values for column in points.columns if column.name in LABORATORY}
    specimens = points.of_kind(SPECIMEN).get(SPECIMEN, ("",) * len(rows))
    derived, kept = derive_impacts(values, rows, specimens, g)
    problems: list[ColumnProblem] = []
    is_flight = "flight_time" in values
    if is_flight and not kept:
        expected = "expected at least two rows of it"
        problems.append(("flight_time", rows[0], f"got no two successive flights of one ball, {expected}"))
    before, after = ("flight_time", "flight_time") if is_flight else ("drop_height", "rebound_height")
    unit = LABORATORY[before][0].unit
    most = MEASURED_OUTPUTS["e_out"].most
    large = [index for index, e in enumerate(derived.get("e_out", ())) if e > most]
    if large:
        first = kept[large[0]]
        second = first + is_flight
        got = f"got {quantity(values[after][second], unit)} after {quantity(values[before][first], unit)}"
        # flights of two balls follow each other only without a column that separates them
        hint = f"; a column {SPECIMEN} separates balls" if is_flight else ""
        got += f", an e_out of {number(derived['e_out'][large[0]])}"
        problems.append((after, rows[second], f"{got}, expected at most {most}{hint}{also(len(large) - 1)}"))
    undefined = [index for index, sigma in enumerate(derived.get(f"{SIGMA}_e_out", ())) if sigma != sigma]
    if undefined:
        got = "got 0 next to a standard deviation, from which none of e_out follows"
        expected = f"expected a column {SIGMA}_e_out in place of those of heights"
        problems.append((after, rows[kept[undefined[0]]], f"{got}, {expected}{also(len(undefined) - 1)}"))
    if problems:
        return points, problems
    kinds = {header: _column_of(header, ["e_out"], {}) for header in derived}
    columns = [replace(column, values=tuple(derived[header])) for header, column in kinds.items() if column]
    columns += [
        replace(column, values=tuple(column.values[i] for i in kept))
        for column in points.columns
        if column.name not in LABORATORY
    ]
    return replace(points, columns=tuple(columns), lines=tuple(points.lines[i] for i in kept)), []


def _read_column(
    columns: Columns, column: _Column, header: str, unit: str, n: float | None
) -> tuple[Sequence[object], Sequence[ColumnProblem]]:
    cells = columns.cells[header]
    if column.kind == SPECIMEN:
        return [cell if isinstance(cell, str) else number(cell) for cell in cells], []
    si_unit = column.quantity.unit
    if columns.is_text and not unit and si_unit != "1" and any(_as_float(cell) is not None for cell in cells):
        example = f'"{safe_text(header, 60)} [{si_unit}]"'
        return (), [(header, None, f"got no unit, expected one in brackets, such as {example}")]
    problem = None if unit else percent_problem(cells, column.quantity, header)
    return ((), [problem]) if problem else columns.read(header, column.quantity, n, unit)


def percent_problem(cells: Sequence[object], quantity: Quantity | None, header: str) -> ColumnProblem | None:
    """Describe the first value of a fraction without a unit that may be in percent; None if there is none."""
    most = _INTERVALS["fraction"]["most"]
    large = [index for index, cell in enumerate(cells) if (_as_float(cell) or 0.0) > most]
    if quantity is None or quantity.most != most or not large:
        return None
    hint = f'percent? name the unit, as in "{safe_text(header, 60)} [%]"{also(len(large) - 1)}'
    return header, large[0], f"got {as_text(cells[large[0]])}, expected a fraction: {hint}"


def _as_float(cell: object) -> float | None:
    """Convert a number without a unit; None if it is none."""
    try:
        return float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return None


def _column_of(header: str, outputs: Sequence[str], models: Mapping[str, ForceModel]) -> _Column | None:
    """Find what the column with a header holds, None for no use; `outputs` are the outputs that have a column."""
    if header == SIGMA and len(outputs) > 1:
        expected = " or ".join(f"{SIGMA}_{output}" for output in outputs)
        raise value_error(f"got {len(outputs)} outputs, expected {expected}")
    column = _COLUMNS.get(f"{SIGMA}_{next(iter(outputs), 'e_out')}" if header == SIGMA else header)
    if column is not None:
        is_of_output = column.kind == SIGMA and column.name in MEASURED_OUTPUTS
        if is_of_output and outputs and column.name not in outputs:
            raise value_error(f"got no column {column.name}, expected one next to its standard deviation")
        return column
    name = InputName.parse(header)
    try:
        quantity = name.quantity(models)
    except KeyError:
        meant = misspelt_column(header, [*_COLUMNS, SIGMA, *SWEEP_QUANTITIES], models, "input or output")
        if meant:
            raise value_error(meant) from None
        return None
    if quantity is None:
        raise value_error("got names of materials, expected numbers; all points have the materials of [sweep]")
    if quantity.words:
        raise value_error(f"got words, expected numbers; all points have one {name.key}")
    return _Column("input", str(name), replace(quantity, infinite=False))


def csv_files(draft: Draft) -> Iterator[CsvFile]:
    """Yield the file of [data], as `columns.csv_files` yields others."""
    table = draft.table("data")
    headers = table.get("columns", {})
    if isinstance(table.get("file"), str) and _are_headers(headers):
        wanted = tuple(headers.values()) or None
        yield table["file"], wanted, csv_form(table), partial(_read_file, draft, headers)


def _read_file(draft: Draft, headers: Mapping[str, str], columns: Columns) -> CsvValues:
    """Read the columns of a file, some of which have other names in [data]."""
    points, problems = _read_columns(_mapped(columns, headers), draft)
    if problems and not columns.is_known:
        # it may be any file, of which messages contain nothing
        problems = [(header, row, text[max(text.find("expected"), 0) :]) for header, row, text in problems]
    if problems:
        # a row is under the header of the file, which may have another name in [data]
        named = [(name if row is None else headers.get(name, name), row, text) for name, row, text in problems]
        raise columns.error(named[:MAX_PROBLEMS])
    values = {column.header: list(column.values) for column in points.columns}
    return {("data", "columns"): values, ("data", "lines"): list(points.lines)}, points.notes


def _are_headers(value: object) -> bool:
    """Check whether the key `columns` names headers of the file, instead of values."""
    return isinstance(value, dict) and all(isinstance(header, str) for header in value.values())


def _mapped(columns: Columns, headers: Mapping[str, str]) -> Columns:
    """Give the columns that [data] columns names the names that it gives them."""
    names, units = {}, dict(columns.units)
    for name, header in headers.items():
        found, unit = columns.find(header)
        names[found], units[found] = name, unit
    # a column that has such a name already is another one
    renamed = {
        header: names.get(header, f"{header} of the file" if header in headers else header)
        for header in columns.cells
    }
    return replace(
        columns,
        units={renamed[header]: unit for header, unit in units.items()},
        cells={renamed[header]: cells for header, cells in columns.cells.items()},
    )


def add_fits(draft: Draft) -> Draft:
    """Fit what the laws need and the config does not have, if [data] says so."""
    if draft.table("data").get("fit") is not True:
        return draft
    uses_e = any("e" in with_base_quantities(model.quantities) for model in draft.models)
    uses_e |= any(law.may_use_e for law in draft.frictions)
    has_e = not {"e", "alpha"}.isdisjoint({*draft.table("sweep"), *as_table(draft.table("data").get("columns"))})
    paths: list[KeyPath] = [("sweep", "e")] if uses_e and not has_e else []
    data = draft.data
    for path in (*paths, *(name.path for name in draft.missing_parameters)):
        data, _ = set_value(data, path, {"fit": True})
    return replace(draft, data=data)


def read_measurements(draft: Draft) -> Draft:
    """Read the measurements of a config in which their values replace the file."""
    table = draft.table("data")
    if isinstance(draft.data.get("data"), dict) and not {"file", "columns"} & table.keys():
        expected = 'got neither file nor columns, expected such as file = "drops.csv"'
        return draft.with_problems([(("data",), expected)])
    lists = table.get("columns")
    path: KeyPath = ("data", "columns")
    if isinstance(lists, dict) and lists and _are_headers(lists) and "file" not in table:
        return draft.with_problems([(path, 'got headers, expected a file as well, such as file = "drops.csv"')])
    if not isinstance(lists, dict) or not lists or not all(isinstance(v, list) and v for v in lists.values()):
        return draft
    n_rows = len(next(iter(lists.values())))
    lengths: list[ConfigProblem] = [
        ((*path, name), f"got {len(cells)} values, expected {n_rows}, as in the first column")
        for name, cells in lists.items()
        if len(cells) != n_rows
    ]
    if lengths:
        return draft.with_problems(lengths)
    try:
        points, column_problems = _read_columns(columns_of_table(lists, ""), draft)
    except ConfigError as error:
        return draft.with_problems((path, problem) for problem in error.problems)
    written = {split_header(header)[0]: header for header in lists}
    problems: list[ConfigProblem] = [
        ((*path, *([written[header]] if header else []), *([] if index is None else [index])), message)
        for header, index, message in column_problems
    ]
    lines, n_points = table.get("lines"), len(points.lines)
    if "file" in table and lines is None:
        problems.append((path, "set together with file, expected one of the two"))
    unused = () if "file" in table else CSV_KEYS.keys() & table.keys()
    problems += [(("data", key), "set without a file, whose form it is") for key in sorted(unused)]
    if isinstance(lines, list) and len(lines) != n_rows:
        problems.append((("data", "lines"), f"got {len(lines)} values, expected {n_rows}, one for each point"))
    elif isinstance(lines, list):
        points = replace(points, lines=tuple(lines[row - 1] for row in points.lines))
    outputs, sigma = points.of_kind("output"), points.of_kind(SIGMA)
    specimens = points.of_kind(SPECIMEN).get(SPECIMEN, ())
    if "sigma" in table and outputs:
        first = next(iter(outputs))
        if first in sigma:
            problems.append(
                (("data", "sigma"), f"set together with a column for {first}, expected one of the two")
            )
        else:
            sigma[first], sigma_problems = _read_sigma(table["sigma"], first, n_points)
            problems += sigma_problems
    if "frictions" not in draft.data:
        expected = 'expected frictions as well, such as frictions = ["coulomb-1785"]'
        of_friction = [name for name in outputs if OUTPUTS[name].of_friction]
        problems += [
            (("data",), f"got a measured {name} without a friction law, {expected}") for name in of_friction
        ]
    noise = table.get("noise", "excess" if specimens else "given" if sigma else "scale")
    loss = table.get("loss", "linear")
    problems += _noise_problems(noise, list(outputs), list(sigma), specimens)
    if loss != "linear" and noise != "given":
        problems.append(
            (("data", "loss"), f'got {as_text(loss)} with noise = "{noise}", expected noise = "given"')
        )
    if problems or noise not in NOISES or loss not in LOSSES:
        return draft.with_problems(problems[:MAX_PROBLEMS])
    measurements = Measurements(
        file=str(table.get("file", "")),
        lines=points.lines,
        inputs=points.of_kind("input"),
        outputs=outputs,
        sigma={name: sigma[name] for name in outputs if name in sigma},
        noise=noise,
        specimens=specimens,
        loss=loss,
    )
    data, columns = draft.data, dict(draft.columns)
    for name, values in measurements.inputs.items():
        # rules between inputs apply to the first value
        data, _ = set_value(data, InputName.parse(name).path, values[0])
        columns[InputName.parse(name).path] = ("data", "columns", name)
    notes = (*draft.notes, *points.notes, *_exchange_notes(measurements))
    return replace(draft, data=data, columns=columns, measurements=measurements, notes=notes)


def _exchange_notes(measured: Measurements) -> Iterator[str]:
    """Ask about restitutions that are all above 1, as those of a rebound height in the column of the drop."""
    restitutions = measured.outputs.get("e_out", ())
    if restitutions and min(restitutions) > 1.0:
        count = len(restitutions)
        text = f"all {count} restitutions are" if count > 1 else "the restitution is"
        file = f"{safe_text(measured.file)}: " if measured.file else ""
        yield f"{file}{text} above 1; are the columns exchanged?"


def _read_sigma(value: object, output: str, n_points: int) -> tuple[tuple[Any, ...], list[ConfigProblem]]:
    """Read the key `sigma`, one number or one for each point; the validation of [data] reports invalid numbers."""
    path: KeyPath = ("data", "sigma")
    cells = value if isinstance(value, list) else [value]
    if cells is value and len(cells) != n_points:
        return (), [(path, f"got {len(cells)} values, expected {n_points}, one for each point")]
    quantity = replace(DEVIATION, unit=OUTPUTS[output].unit)
    values, problems = columns_of_table({SIGMA: cells}, "").read(SIGMA, quantity, None)
    texts = [(row, message) for _, row, message in problems if row is not None and isinstance(cells[row], str)]
    if cells is not value:
        return tuple(values) * n_points, [(path, message) for _, message in texts]
    return tuple(values), [((*path, row), message) for row, message in texts]


def _noise_problems(
    noise: object, outputs: Sequence[str], with_sigma: Sequence[str], specimens: Sequence[str]
) -> list[ConfigProblem]:
    """Check the noise with the outputs, with those that have standard deviations, and with the specimens."""
    path: KeyPath = ("data", "noise")
    if noise == "excess" and len(outputs) > 1:
        return [(path, f'got "excess" with {len(outputs)} outputs, expected one, whose unit the deviation has')]
    if specimens and noise != "excess":
        return [(path, f'got {as_text(noise)} with a column {SPECIMEN}, expected "excess" or no such column')]
    if specimens and len({*specimens}) < 2:
        return [(("data",), f"got one specimen, expected at least two in the column {SPECIMEN}")]
    missing = [name for name in outputs if name not in with_sigma]
    if missing and len(outputs) > 1:
        expected = f"a column {SIGMA}_{missing[0]}: each of several outputs needs one"
        return [(("data",), f"got no standard deviation of {missing[0]}, expected {expected}")]
    if missing and specimens:
        # the noise "scale" takes no specimens
        expected = f"a column {SIGMA} or the key {SIGMA}, that of one measurement"
        return [(("data",), f"got a column {SPECIMEN} without standard deviations, expected {expected}")]
    if missing and noise in ("given", "excess"):
        expected = f'a column {SIGMA} or the key {SIGMA}, or noise = "scale"'
        return [(path, f'got "{noise}" without standard deviations, expected {expected}')]
    return []


def fitted_parameters(
    fits: Mapping[str, tuple[float, float]],
    model: ForceModel,
    friction: FrictionLaw | None = None,
    names: Collection[str] = (),
) -> tuple[str, ...]:
    """List the names of the fitted parameters that a law has, or its pair with a friction law.

    A law whose table has a K of its own takes neither that of the sweep nor that of its materials, one with that
    of the sweep not that of its materials; nor does the spring of a friction law beside a K. `names` are those of
    the inputs of the config.
    """
    used, has_own_K = with_base_quantities(model.quantities), f"{model.key}.K" in names

    def is_used(name: str) -> bool:
        if name in ("e", "alpha"):
            return "e" in used or (friction is not None and friction.may_use_e)
        if name == "n":
            return model.exponent is None
        if name == "K":
            return not has_own_K
        input_name = InputName.parse(name)
        if input_name.key == "yield_strength":
            return bool(used & {"yield_strength1", "yield_strength2"})
        if input_name.material and input_name.key in ("E", "nu") and (has_own_K or "K" in names):
            return bool(used & {f"{input_name.key}1", f"{input_name.key}2"})
        return input_name.applies_to(model.key, friction.key if friction else "")

    return tuple(filter(is_used, fits))


def count_problems(draft: Draft, fits: Mapping[str, tuple[float, float]]) -> Iterator[ConfigProblem]:
    """Check that there are as many measured values as parameters of a law."""
    if draft.measurements is None:
        return
    n_values = len(draft.measurements.lines) * len(draft.measurements.outputs)
    counts = {
        law_name(*(law.key for law in (model, friction) if law)): len(
            fitted_parameters(fits, model, friction, draft.input_names)
        )
        for model in draft.models
        for friction in draft.frictions or (None,)
    }
    key = max(counts, key=lambda name: counts[name])
    if counts[key] > n_values:
        got = f"{n_values} measured value{'s' * (n_values != 1)}"
        expected = f"at least {counts[key]}, the number of parameters to fit of {key}"
        yield ("data", "file" if draft.measurements.file else "columns"), f"got {got}, expected {expected}"
