"""Measurements of a config: the table [data], from a CSV file or inline, and the parameters fitted to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from pydantic_core import PydanticCustomError

from ..contact.model import ForceModel, with_base_quantities
from ..contact.variables import OUTPUTS
from ..errors import ConfigError
from ..formatting import number
from ..text import safe_text
from .cases import (
    CsvTable,
    column_quantity,
    column_values,
    contains_path,
    read_csv,
)
from .files import as_table, override_text, set_value
from .input_names import InputName, input_values
from .quantities import MAX_PROBLEMS, ConfigProblem, KeyPath, Quantity, show, suggest, value_error
from .tables import LOSSES, MAX_MEASURED, MIN_SIGMA, NOISES, SWEEP_QUANTITIES

Noise = Literal["given", "scale", "excess"]
Loss = Literal["linear", "huber", "cauchy"]

SIGMA, SPECIMEN = "sigma", "specimen"
SPECIMEN_EXPECTED = "got nothing, expected the name of a specimen"
# intervals of measured values; a fraction may be below 0 or above 1 by its noise, farther off it is no fraction
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
class Measurements:
    """Measured points, in SI.

    Parameters
    ----------
    file : name of the CSV file as in the config; empty for values in the config
    lines : the line of each point in the file; its number, from 1, for values in the config
    inputs : values of the inputs that vary from point to point, by config name
    outputs : measured values, by the name of the output
    sigma : their standard deviations, by the name of the output; without the outputs that have none
    noise : "given", the standard deviations as they are; "scale", times a common factor, which also stands for
        the standard deviation of an output without one; or "excess", with a variance between specimens added
    specimens : the specimen of each point, for the noise "excess"; empty where each point has its own
    loss : how a residual counts
    """

    file: str
    lines: tuple[int, ...]
    inputs: Mapping[str, tuple[float, ...]]
    outputs: Mapping[str, tuple[float, ...]]
    sigma: Mapping[str, tuple[float, ...]]
    noise: Noise
    specimens: tuple[str, ...] = ()
    loss: Loss = "linear"


@dataclass(frozen=True)
class _DataColumn:
    """What a column holds: values of an input or an output, standard deviations of an output, or specimens."""

    kind: Literal["input", "output", "sigma", "specimen"]
    name: str
    quantity: Quantity


def fit_paths(data: Mapping[str, Any]) -> Iterator[KeyPath]:
    """The path of every `{ fit = ... }`."""
    for name, value in input_values(data):
        if isinstance(value, dict) and "fit" in value:
            yield name.path


def purpose_problems(data: Mapping[str, Any]) -> list[ConfigProblem]:
    """The problem of a sweep with measurements or with parameters to fit, which only a calibration takes."""
    takes = "use impact calibrate, which takes [data] and { fit = [least, most] }"
    if "data" in data:
        return [(("data",), f"got measurements, expected a sweep; {takes}")]
    return [(path, f"got a fit, expected a value or an axis; {takes}") for path in fit_paths(data)][:1]


def _columns_of(
    names: Sequence[str], data: Mapping[str, Any], models: Mapping[str, ForceModel]
) -> tuple[dict[str, _DataColumn], list[tuple[str, str]]]:
    """The columns with these names, and problems: messages with the name of a column, or "" for all together."""
    columns: dict[str, _DataColumn] = {}
    problems: list[tuple[str, str]] = []
    outputs = [name for name in names if name in MEASURED_OUTPUTS]
    for name in names:
        try:
            columns[name] = column = _column_of(name, outputs, models)
        except PydanticCustomError as error:
            problems.append((name, error.message()))
            continue
        other = next(
            key for key, before in columns.items() if (before.kind, before.name) == (column.kind, column.name)
        )
        if other != name:
            problems.append((name, f"got a second column of {column.name}, beside {show(other)}, expected one"))
        elif column.kind == "input" and contains_path(data, InputName.parse(name).path):
            problems.append(
                (name, f"set together with {InputName.parse(name).config_key}, expected one of the two")
            )
    if not outputs and not problems:
        problems.append(("", "got no column of an output, expected one, such as e_out or contact_time"))
    return columns, problems


def _column_of(name: str, outputs: Sequence[str], models: Mapping[str, ForceModel]) -> _DataColumn:
    """What the column with a name holds; `outputs` are the outputs that have a column."""
    if name in MEASURED_OUTPUTS:
        return _DataColumn("output", name, MEASURED_OUTPUTS[name])
    if name == SPECIMEN:
        return _DataColumn("specimen", name, Quantity("1", "name of a specimen"))
    if name == SIGMA or name.removeprefix(f"{SIGMA}_") in MEASURED_OUTPUTS:
        if name == SIGMA and len(outputs) > 1:
            expected = " or ".join(f"{SIGMA}_{output}" for output in outputs)
            raise value_error(f"got {len(outputs)} outputs, expected {expected}")
        output = name.removeprefix(f"{SIGMA}_") if name != SIGMA else next(iter(outputs), "e_out")
        if outputs and output not in outputs:
            raise value_error(f"got no column {output}, expected one beside its standard deviation")
        return _DataColumn(
            "sigma",
            output,
            Quantity(OUTPUTS[output].unit, "standard deviation", least=MIN_SIGMA, most=MAX_MEASURED),
        )
    if not name:
        raise value_error("got a column without a name, expected that of an input or an output")
    input_name = InputName.parse(name)
    try:
        quantity = input_name.quantity(models)
    except KeyError:
        if input_name.owner:
            raise value_error(input_name.unknown_message(models)) from None
        choices = [
            *MEASURED_OUTPUTS,
            SIGMA,
            SPECIMEN,
            *SWEEP_QUANTITIES,
            *(f"{SIGMA}_{output}" for output in outputs),
        ]
        raise value_error(f"no such input or output; {suggest(name, choices)}") from None
    if quantity is None:
        raise value_error("got names of materials, expected numbers; all points have the materials of [sweep]")
    return _DataColumn("input", str(input_name), replace(quantity, infinite=False))


def inline_measurements(
    data: Mapping[str, Any], folder: Path | None, models: Mapping[str, ForceModel], n: float | None
) -> tuple[dict[str, Any], list[str], list[str]]:
    """Replace the file of [data] by its values; parameters and returned values are those of `inline_files`."""
    table = as_table(data.get("data"))
    file = table.get("file")
    if not isinstance(file, str) or "columns" in table:
        return dict(data), [], []
    if folder is None:
        return dict(data), [], [f"{safe_text(file)}: not read; a stored config contains values, not file names"]
    try:
        table_of_file = read_csv(folder / file, partial(column_quantity, models=models))
        values, lines = _read_values(table_of_file, data, models, n)
        stored: dict[KeyPath, object] = {("data", "columns"): values, ("data", "lines"): lines}
        overrides = [override_text(path, value) for path, value in stored.items()]
    except ConfigError as error:
        return dict(data), [], list(error.problems)
    for path, value in stored.items():
        data, _ = set_value(data, path, value)
    return dict(data), overrides, []


def _read_values(
    table: CsvTable, data: Mapping[str, Any], models: Mapping[str, ForceModel], n: float | None
) -> tuple[dict[str, list[float | str]], list[int]]:
    """The values of all columns of a CSV file in SI units, and the lines of its points.

    Raises
    ------
    ConfigError : with the line of each problem
    """
    columns, named_problems = _columns_of(list(table.units), data, models)
    problems = [
        ": ".join(part for part in (f"{table.name}:1", safe_text(name, 60), message) if part)
        for name, message in named_problems
    ]
    n = None if "n" in table.units else n
    units = {name: "" if unit in ("-", "1") else unit for name, unit in table.units.items()}
    for name, column in columns.items():
        if column.kind == "sigma":
            units[name] = units[name] or units.get(column.name, "")
    values: dict[str, list[float | str]] = {}
    for name, column in columns.items():
        shown, unit, expected_unit = safe_text(name, 60), units[name], column.quantity.unit
        if column.kind == SPECIMEN:
            values[name] = [cell.strip() for _, cell in table.cells[name]]
            problems += [
                f"{table.name}:{line}: {shown}: {SPECIMEN_EXPECTED}"
                for line, cell in table.cells[name]
                if not cell.strip()
            ]
            continue
        percent = [(line, cell) for line, cell in table.cells[name] if _is_in_percent(cell, column.quantity)]
        if _is_percent(unit):
            expected = f'a fraction: divide the column by 100 and write "{shown}"'
            problems.append(f"{table.name}:1: {shown}: got [{safe_text(unit)}], expected {expected}")
        elif not unit and expected_unit != "1":
            expected = f'one in brackets, such as "{shown} [{expected_unit}]"'
            problems.append(f"{table.name}:1: {shown}: got no unit, expected {expected}")
        elif percent:
            # the first stands for the whole column
            problems += [f"{table.name}:{line}: {shown}: {_percent_message(cell)}" for line, cell in percent[:1]]
        else:
            try:
                values[name] = column_values(replace(table, units=units), name, column.quantity, n)
            except ConfigError as error:
                problems += error.problems
    if problems:
        raise ConfigError(*problems[:MAX_PROBLEMS])
    return values, [line for line, _ in next(iter(table.cells.values()))]


def _is_percent(unit: str) -> bool:
    return unit.lower() in ("%", "percent", "pct", "per cent")


def _is_in_percent(element: object, quantity: Quantity) -> bool:
    """Whether a value has the sign %, or is too large for a fraction."""
    if not isinstance(element, str | int | float):
        return False
    if "%" in str(element):
        return True
    try:
        return quantity.most == _INTERVALS["fraction"]["most"] and float(element) > quantity.most
    except (ValueError, OverflowError):
        return False


def _percent_message(text: str) -> str:
    """The message about a value in percent, with the fraction to write instead."""
    try:
        fraction = f", such as {number(float(text.strip().removesuffix('%')) / 100.0)}"
    except ValueError:
        fraction = ""
    return f"got {show(text.strip())}, expected a fraction{fraction}"


def expand_measurements(
    data: Mapping[str, Any], models: Mapping[str, ForceModel], n: float | None
) -> tuple[dict[str, Any], Measurements | None, list[ConfigProblem]]:
    """The measurements of a config.

    Parameters
    ----------
    data : plain data of a config, with the values of the file of [data]
    models : all models by key
    n : the exponent that units may contain

    Returns
    -------
    The data with the first value of each measured input at the path of the input, so that rules between inputs
    apply to it; the measurements; and problems. Without valid measurements the data is unchanged.
    """
    table = as_table(data.get("data"))
    if isinstance(data.get("data"), dict) and not {"file", "columns"} & table.keys():
        return dict(data), None, [(("data",), 'got neither file nor columns, expected such as file = "drops.csv"')]
    lists = table.get("columns")
    if not isinstance(lists, dict) or not lists or not all(isinstance(v, list) and v for v in lists.values()):
        return dict(data), None, []
    path: KeyPath = ("data", "columns")
    columns, named_problems = _columns_of(list(lists), data, models)
    problems: list[ConfigProblem] = [((*path, name) if name else path, text) for name, text in named_problems]
    if any(column.name == "n" for column in columns.values()):
        n = None
    n_points = len(next(iter(lists.values())))
    for name, elements in lists.items():
        if len(elements) != n_points:
            problems.append(
                ((*path, name), f"got {len(elements)} values, expected {n_points}, as in the first column")
            )
    values: dict[str, tuple[float, ...]] = {}
    specimens: tuple[str, ...] = ()
    for name, column in columns.items():
        if column.kind == SPECIMEN:
            specimens = tuple(element if isinstance(element, str) else f"{element:g}" for element in lists[name])
            problems += [((*path, name, index), SPECIMEN_EXPECTED) for index, s in enumerate(specimens) if not s]
            continue
        values[name], value_problems = _read_list(lists[name], (*path, name), column.quantity, n)
        problems += value_problems
    lines = table.get("lines")
    if "file" in table and lines is None:
        problems.append((path, "set together with file, expected one of the two"))
    if isinstance(lines, list) and len(lines) != n_points:
        problems.append((("data", "lines"), f"got {len(lines)} values, expected {n_points}, one for each point"))

    def of_kind(kind: str) -> dict[str, tuple[float, ...]]:
        return {column.name: values[name] for name, column in columns.items() if column.kind == kind}

    outputs, sigma = of_kind("output"), of_kind("sigma")
    if "sigma" in table and outputs:
        first = next(iter(outputs))
        deviations, sigma_problems = _read_sigma(table["sigma"], first, n_points)
        if first in sigma:
            sigma_problems = [
                (("data", "sigma"), f"set together with a column for {first}, expected one of the two")
            ]
        sigma[first] = deviations
        problems += sigma_problems
    noise = table.get("noise", "excess" if specimens else "given" if sigma else "scale")
    loss = table.get("loss", "linear")
    problems += _noise_problems(noise, list(outputs), list(sigma), specimens)
    if loss != "linear" and noise != "given":
        problems.append((("data", "loss"), f'got {show(loss)} with noise = "{noise}", expected noise = "given"'))
    if problems or noise not in NOISES or loss not in LOSSES:
        return dict(data), None, problems[:MAX_PROBLEMS]
    measurements = Measurements(
        file=str(table.get("file", "")),
        lines=tuple(lines) if isinstance(lines, list) else tuple(range(1, n_points + 1)),
        inputs=of_kind("input"),
        outputs=outputs,
        sigma={name: sigma[name] for name in outputs if name in sigma},
        noise=noise,
        specimens=specimens,
        loss=loss,
    )
    for name, column_of_input in measurements.inputs.items():
        data, _ = set_value(data, InputName.parse(name).path, column_of_input[0])
    return dict(data), measurements, []


def _read_list(
    elements: Sequence[object], path: KeyPath, quantity: Quantity, n: float | None
) -> tuple[tuple[float, ...], list[ConfigProblem]]:
    """The numbers of a list in SI units, and problems."""
    values: list[float] = []
    problems: list[ConfigProblem] = []
    for index, element in enumerate(elements):
        try:
            if _is_in_percent(element, quantity):
                problems.append(((*path, index), _percent_message(str(element))))
                break
            values.append(quantity.read(element, n))
        except PydanticCustomError as error:
            problems.append(((*path, index), error.message()))
            if len(problems) >= MAX_PROBLEMS:
                break
    return tuple(values), problems


def _deviation_of(output: str) -> Quantity:
    """Describe the standard deviation of a measured output."""
    return Quantity(OUTPUTS[output].unit, "standard deviation", least=MIN_SIGMA, most=MAX_MEASURED)


def _read_sigma(value: object, output: str, n_points: int) -> tuple[tuple[float, ...], list[ConfigProblem]]:
    """The standard deviations of an output from the key `sigma`, and problems that validation does not report."""
    path: KeyPath = ("data", "sigma")
    if isinstance(value, list) and len(value) != n_points:
        return (), [(path, f"got {len(value)} values, expected {n_points}, one for each point")]
    quantity = _deviation_of(output)
    elements = value if isinstance(value, list) else [value]
    deviations, problems = _read_list(elements, path, quantity, None)
    if not isinstance(value, list):
        problems = [(path, message) for _, message in problems]
    # invalid numbers are reported by the validation of the table
    problems = [(at, message) for at, message in problems if _is_text(value, at)]
    return deviations if isinstance(value, list) else deviations * n_points, problems


def _is_text(value: object, path: KeyPath) -> bool:
    index = path[-1]
    return isinstance(value[index] if isinstance(value, list) and isinstance(index, int) else value, str)


def _noise_problems(
    noise: object, outputs: Sequence[str], with_sigma: Sequence[str], specimens: Sequence[str]
) -> list[ConfigProblem]:
    """Problems of the noise with the outputs, with those that have standard deviations, and with the specimens."""
    path: KeyPath = ("data", "noise")
    if noise == "excess" and len(outputs) > 1:
        return [(path, f'got "excess" with {len(outputs)} outputs, expected one, whose unit the deviation has')]
    if specimens and noise != "excess":
        return [(path, f'got {show(noise)} with a column {SPECIMEN}, expected "excess" or no such column')]
    if specimens and len({*specimens}) < 2:
        return [(("data",), f"got one specimen, expected at least two in the column {SPECIMEN}")]
    missing = [name for name in outputs if name not in with_sigma]
    if missing and len(outputs) > 1:
        expected = f"a column {SIGMA}_{missing[0]}: each of several outputs needs one"
        return [(("data",), f"got no standard deviation of {missing[0]}, expected {expected}")]
    if missing and noise in ("given", "excess"):
        expected = f'a column {SIGMA} or the key {SIGMA}, or noise = "scale"'
        return [(path, f'got "{noise}" without standard deviations, expected {expected}')]
    return []


def fitted_parameters(fits: Mapping[str, tuple[float, float]], model: ForceModel) -> tuple[str, ...]:
    """The config names of the fitted parameters that a law has, in the order of the config.

    Parameters
    ----------
    fits : bounds by config name
    model : the law
    """
    used = with_base_quantities(model.quantities)

    def is_used(name: str) -> bool:
        if name in ("e", "alpha"):
            return "e" in used
        if name == "n":
            return model.exponent is None
        input_name = InputName.parse(name)
        if input_name.key == "yield_strength":
            return bool(used & {"yield_strength1", "yield_strength2"})
        return input_name.applies_to(model.key)

    return tuple(filter(is_used, fits))


def count_problems(
    measurements: Measurements, fits: Mapping[str, tuple[float, float]], models: Sequence[ForceModel]
) -> list[ConfigProblem]:
    """The problem of fewer measured values than parameters of a law."""
    n_values = len(measurements.lines) * len(measurements.outputs)
    counts = {model.key: len(fitted_parameters(fits, model)) for model in models}
    key = max(counts, key=lambda name: counts[name])
    if counts[key] <= n_values:
        return []
    got = f"{n_values} measured value{'s' * (n_values != 1)}"
    expected = f"at least {counts[key]}, the number of parameters to fit of {key}"
    return [(("data", "file" if measurements.file else "columns"), f"got {got}, expected {expected}")]
