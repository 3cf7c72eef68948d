"""Measurements of a config: the table [data], from a CSV file or inline, and the parameters fitted to them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from pydantic_core import PydanticCustomError

from ..contact.friction import FrictionLaw
from ..contact.model import ForceModel, with_base_quantities
from ..contact.variables import OUTPUTS
from ..errors import ConfigError, did_you_mean
from ..formatting import number, safe_text
from .columns import Cells, Columns, contains_path, read_cells, read_csv_of
from .draft import Draft, Measurements
from .files import set_value
from .input_names import InputName, input_values
from .quantities import MAX_PROBLEMS, ConfigProblem, KeyPath, Quantity, as_text, value_error
from .tables import LOSSES, MAX_MEASURED, MIN_SIGMA, NOISES, SWEEP_QUANTITIES

SIGMA, SPECIMEN = "sigma", "specimen"
SPECIMEN_EXPECTED = "got nothing, expected the name of a specimen"
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

    kind: Literal["input", "output", "sigma", "specimen"]
    name: str  # of the input, of the output, or of the output whose standard deviations they are
    quantity: Quantity
    values: tuple[Any, ...] = ()  # in SI units, or names of specimens


# the header of a column, or "" for all together; the index of a cell, or None for the whole column; and a message
_Problem = tuple[str, int | None, str]


def fit_paths(data: Mapping[str, Any]) -> Iterator[KeyPath]:
    """Yield the path of every `{ fit = ... }`."""
    for name, value in input_values(data):
        if isinstance(value, dict) and "fit" in value:
            yield name.path


def purpose_problems(data: Mapping[str, Any]) -> list[ConfigProblem]:
    """Refuse measurements and parameters to fit in a sweep."""
    takes = "use impact calibrate, which takes [data] and { fit = [least, most] }"
    if "data" in data:
        return [(("data",), f"got measurements, expected a sweep; {takes}")]
    return [(path, f"got a fit, expected a value or an axis; {takes}") for path in fit_paths(data)][:1]


def _read_columns(columns: Columns, draft: Draft) -> tuple[list[_Column], list[_Problem]]:
    """Read columns of a file, which are text and have units, or lists of a config, and report all problems."""
    kinds: dict[str, _Column] = {}
    problems: list[_Problem] = []
    outputs = [header for header in columns.cells if header in MEASURED_OUTPUTS]
    for header in columns.cells:
        try:
            column = _column_of(header, outputs, draft.known_models)
            twin = next((key for key, c in kinds.items() if (c.kind, c.name) == (column.kind, column.name)), None)
            if twin is not None:
                raise value_error(f"got a second column of {column.name}, next to {as_text(twin)}, expected one")
            kinds[header] = column
            name = InputName.parse(column.name)
            if column.kind == "input" and contains_path(draft.data, name.path):
                raise value_error(f"set together with {name.config_key}, expected one of the two")
        except PydanticCustomError as error:
            problems.append((header, None, error.message()))
    if not outputs and not problems:
        problems.append(("", None, "got no column of an output, expected one, such as e_out or contact_time"))
    n = None if any(column.name == "n" for column in kinds.values()) else draft.exponent
    result: list[_Column] = []
    for header, column in kinds.items():
        # a standard deviation has the unit of its output
        unit = columns.units.get(header) or (columns.units.get(column.name, "") if column.kind == "sigma" else "")
        values, column_problems = _read_column(columns, column, header, unit, n)
        problems += [(header, index, message) for index, message in column_problems]
        result.append(replace(column, values=tuple(values)))
    return result, problems


def _read_column(
    columns: Columns, column: _Column, header: str, unit: str, n: float | None
) -> tuple[Sequence[object], Sequence[tuple[int | None, str]]]:
    """Read a column; problems have the index of a cell, or None for the header."""
    cells = columns.cells[header]
    if column.kind == SPECIMEN:
        specimens = [cell if isinstance(cell, str) else number(cell) for cell in cells]
        return specimens, [(index, SPECIMEN_EXPECTED) for index, name in enumerate(specimens) if not name]
    si_unit = column.quantity.unit
    if unit.lower() in ("%", "percent", "pct", "per cent"):
        expected = f'a fraction: divide the column by 100 and write "{safe_text(header, 60)}"'
        return (), [(None, f"got [{unit}], expected {expected}")]
    if columns.is_text and not unit and si_unit != "1":
        expected = f'one in brackets, such as "{safe_text(header, 60)} [{si_unit}]"'
        return (), [(None, f"got no unit, expected {expected}")]
    return _percent_problem(cells, column.quantity) or columns.read(header, column.quantity, n, unit)


def _percent_problem(cells: Sequence[object], quantity: Quantity) -> Cells | None:
    """Refuse values in percent; the first stands for the whole column."""
    for index, cell in enumerate(cells):
        if _is_in_percent(cell, quantity):
            return [], [(index, _percent_message(str(cell)))]
    return None


def _column_of(header: str, outputs: Sequence[str], models: Mapping[str, ForceModel]) -> _Column:
    """Find what the column with a header holds; `outputs` are the outputs that have a column."""
    if header in MEASURED_OUTPUTS:
        return _Column("output", header, MEASURED_OUTPUTS[header])
    if header == SPECIMEN:
        return _Column("specimen", header, Quantity("1", "name of a specimen"))
    if header == SIGMA or header.removeprefix(f"{SIGMA}_") in MEASURED_OUTPUTS:
        if header == SIGMA and len(outputs) > 1:
            expected = " or ".join(f"{SIGMA}_{output}" for output in outputs)
            raise value_error(f"got {len(outputs)} outputs, expected {expected}")
        output = header.removeprefix(f"{SIGMA}_") if header != SIGMA else next(iter(outputs), "e_out")
        if outputs and output not in outputs:
            raise value_error(f"got no column {output}, expected one next to its standard deviation")
        return _Column("sigma", output, _deviation(output))
    if not header:
        raise value_error("got a column without a name, expected that of an input or an output")
    name = InputName.parse(header)
    try:
        quantity = name.quantity(models)
    except KeyError:
        if name.owner:
            raise value_error(name.unknown_message(models)) from None
        deviations = [f"{SIGMA}_{output}" for output in outputs]
        choices = [*MEASURED_OUTPUTS, SIGMA, SPECIMEN, *SWEEP_QUANTITIES, *deviations]
        raise value_error(f"no such input or output; {did_you_mean(header, choices)}") from None
    if quantity is None:
        raise value_error("got names of materials, expected numbers; all points have the materials of [sweep]")
    if quantity.words:
        raise value_error(f"got words, expected numbers; all points have one {name.key}")
    return _Column("input", str(name), replace(quantity, infinite=False))


def _deviation(output: str) -> Quantity:
    return Quantity(OUTPUTS[output].unit, "standard deviation", least=MIN_SIGMA, most=MAX_MEASURED)


def read_data_file(draft: Draft) -> tuple[dict[KeyPath, object], list[str]]:
    """Read the file of [data], as `columns.read_files` reads others."""
    table = draft.table("data")
    if not isinstance(table.get("file"), str) or "columns" in table:
        return {}, []
    try:
        columns = read_csv_of(draft, table["file"])
    except ConfigError as error:
        return {}, [*error.problems]
    units = {header: "" if unit in ("-", "1") else unit for header, unit in columns.units.items()}
    read, problems = _read_columns(replace(columns, units=units), draft)
    if problems:
        return {}, [columns.problem(text, header, row) for header, row, text in problems[:MAX_PROBLEMS]]
    values = {header: list(column.values) for header, column in zip(columns.cells, read, strict=True)}
    return {("data", "columns"): values, ("data", "lines"): list(columns.lines)}, []


def _is_in_percent(cell: object, quantity: Quantity) -> bool:
    """Check whether a value has the sign %, or is too large for a fraction."""
    if not isinstance(cell, str | int | float):
        return False
    if "%" in str(cell):
        return True
    try:
        return quantity.most == _INTERVALS["fraction"]["most"] and float(cell) > quantity.most
    except (ValueError, OverflowError):
        return False


def _percent_message(text: str) -> str:
    """Describe a value in percent, and suggest the fraction."""
    try:
        fraction = f", such as {number(float(text.removesuffix('%')) / 100.0)}"
    except ValueError:
        fraction = ""
    return f"got {as_text(text)}, expected a fraction{fraction}"


def read_measurements(draft: Draft) -> Draft:
    """Read the measurements of a config in which their values replace the file."""
    table = draft.table("data")
    if isinstance(draft.data.get("data"), dict) and not {"file", "columns"} & table.keys():
        expected = 'got neither file nor columns, expected such as file = "drops.csv"'
        return draft.with_problems([(("data",), expected)])
    lists = table.get("columns")
    if not isinstance(lists, dict) or not lists or not all(isinstance(v, list) and v for v in lists.values()):
        return draft
    path: KeyPath = ("data", "columns")
    columns, column_problems = _read_columns(Columns("", 0, (), {}, lists, is_text=False), draft)
    problems: list[ConfigProblem] = [
        ((*path, *([header] if header else []), *([] if index is None else [index])), message)
        for header, index, message in column_problems
    ]
    n_points = len(next(iter(lists.values())))
    problems += [
        ((*path, name), f"got {len(cells)} values, expected {n_points}, as in the first column")
        for name, cells in lists.items()
        if len(cells) != n_points
    ]
    lines = table.get("lines")
    if "file" in table and lines is None:
        problems.append((path, "set together with file, expected one of the two"))
    if isinstance(lines, list) and len(lines) != n_points:
        problems.append((("data", "lines"), f"got {len(lines)} values, expected {n_points}, one for each point"))

    def of_kind(kind: str) -> dict[str, tuple[Any, ...]]:
        return {column.name: column.values for column in columns if column.kind == kind}

    outputs, sigma = of_kind("output"), of_kind("sigma")
    specimens = of_kind(SPECIMEN).get(SPECIMEN, ())
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
        lines=tuple(lines) if isinstance(lines, list) else tuple(range(1, n_points + 1)),
        inputs=of_kind("input"),
        outputs=outputs,
        sigma={name: sigma[name] for name in outputs if name in sigma},
        noise=noise,
        specimens=specimens,
        loss=loss,
    )
    data = draft.data
    for name, values in measurements.inputs.items():
        # rules between inputs apply to the first value
        data, _ = set_value(data, InputName.parse(name).path, values[0])
    return replace(draft, data=data, measurements=measurements)


def _read_sigma(value: object, output: str, n_points: int) -> tuple[tuple[Any, ...], list[ConfigProblem]]:
    """Read the key `sigma`, one number or one for each point; the validation of [data] reports invalid numbers."""
    path: KeyPath = ("data", "sigma")
    cells = value if isinstance(value, list) else [value]
    if cells is value and len(cells) != n_points:
        return (), [(path, f"got {len(cells)} values, expected {n_points}, one for each point")]
    values, problems = _percent_problem(cells, _deviation(output)) or read_cells(cells, _deviation(output), None)
    texts = [(index, message) for index, message in problems if isinstance(cells[index], str)]
    if cells is not value:
        return tuple(values) * n_points, [(path, message) for _, message in texts]
    return tuple(values), [((*path, index), message) for index, message in texts]


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
    if missing and noise in ("given", "excess"):
        expected = f'a column {SIGMA} or the key {SIGMA}, or noise = "scale"'
        return [(path, f'got "{noise}" without standard deviations, expected {expected}')]
    return []


def fitted_parameters(
    fits: Mapping[str, tuple[float, float]], model: ForceModel, friction: FrictionLaw | None = None
) -> tuple[str, ...]:
    """List the names of the fitted parameters that a law has, or its pair with a friction law."""
    used = with_base_quantities(model.quantities)

    def is_used(name: str) -> bool:
        if name in ("e", "alpha"):
            return "e" in used or (friction is not None and friction.may_use_e)
        if name == "n":
            return model.exponent is None
        input_name = InputName.parse(name)
        if input_name.key == "yield_strength":
            return bool(used & {"yield_strength1", "yield_strength2"})
        return input_name.applies_to(model.key, friction.key if friction else "")

    return tuple(filter(is_used, fits))


def count_problems(
    measurements: Measurements,
    fits: Mapping[str, tuple[float, float]],
    models: Sequence[ForceModel],
    frictions: Sequence[FrictionLaw] = (),
) -> list[ConfigProblem]:
    """Check that there are as many measured values as parameters of a law."""
    n_values = len(measurements.lines) * len(measurements.outputs)
    counts = {
        " with ".join(law.key for law in (model, friction) if law): len(fitted_parameters(fits, model, friction))
        for model in models
        for friction in frictions or (None,)
    }
    key = max(counts, key=lambda name: counts[name])
    if counts[key] <= n_values:
        return []
    got = f"{n_values} measured value{'s' * (n_values != 1)}"
    expected = f"at least {counts[key]}, the number of parameters to fit of {key}"
    return [(("data", "file" if measurements.file else "columns"), f"got {got}, expected {expected}")]
