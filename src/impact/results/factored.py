"""The factored layout: a file of axes, trajectory table and law metadata, for any number of points.

Some points, the witnesses, are stored in full. When a file is opened they are computed again: if they differ, the
file was written by a version that computes other numbers, and is refused.
"""

from __future__ import annotations

import json
import math
import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._version import __version__
from ..array_types import Array
from ..config.grid import Axis
from ..config.input_names import is_input
from ..contact.formula import Formula
from ..contact.materials import Material
from ..contact.model import Law, Parameter
from ..contact.simulate import TABLE_COLUMNS, CollisionResult
from ..contact.status import STATUSES, Status
from ..contact.variables import OUTPUTS, Variable
from ..engine.build_impacts import Stiffness, has_stiffness_rule, mass_at, values_at
from ..engine.plan import Index, Inputs
from ..engine.trajectories import TrajectoryMap
from ..errors import ResultError, UsageError
from ..formatting import number
from ..text import safe_text
from .attributes import SummaryRecord, read_attribute
from .schema import attributes_of, count_points, derived_names, scale_of
from .trajectory_table import MAX_STIFFNESS_VALUES, TrajectoryRows, TrajectoryTable, expand, whole_stiffness

N_WITNESSES = 1_000
# tolerance of a witness, relative to the scale that `compare` uses for its variable
WITNESS_TOLERANCE = 1e-12
SLAB_ROWS = 2**16
# by the bits of a status, whether it is one
IS_STATUS = np.isin(np.arange(2**8), STATUSES)
# fields of a law in the JSON attribute `laws`, and their types
LAW_FIELD_TYPES: Mapping[str, type] = {
    "parameters": list,
    "domain": dict,
    "asks_for_e": bool,
    "is_permanent": bool,
    "axes": list,
    "trajectories": int,
    "is_shared": bool,
}

ReadVariable = Callable[[str, slice], NDArray[Any]]
TakeRows = Callable[[str, NDArray[np.intp]], NDArray[Any]]


@dataclass(frozen=True)
class StoredLaw:
    """A law as stored in a file: everything that outputs depend on besides the trajectory, without formulas."""

    key: str
    exponent: float | None
    parameters: tuple[Parameter, ...]
    domain: Mapping[str, tuple[float, float]]
    quantities: frozenset[str]
    is_permanent: bool
    stiffness: Formula | None = None


def factored_template(
    result_template: xr.Dataset, table: TrajectoryTable, variables: Sequence[Variable]
) -> xr.Dataset:
    """The dataset of a factored file: coordinates, attributes, and variables with placeholder values.

    Parameters
    ----------
    result_template : coordinates and attributes of the result
    table : of the sweep
    variables : of the result

    Raises
    ------
    UsageError : a law's rule of K takes too many values to be stored
    """
    laws, stiffness = {}, 0
    for law, trajectory_map, rule in zip(table.laws, table.maps, table.stiffness, strict=True):
        about: dict[str, Any] = {
            "exponent": law.exponent,
            "parameters": [parameter.name for parameter in law.parameters],
            "domain": {name: list(ends) for name, ends in law.domain.items()},
            "asks_for_e": "e" in law.quantities,
            "is_permanent": law.is_permanent,
            "axes": [table.inputs.axes[axis].name for axis in trajectory_map.axes],
            "trajectories": trajectory_map.count,
            "is_shared": trajectory_map.is_shared,
            "stiffness_axes": None,
        }
        if rule is not None or has_stiffness_rule(table.inputs, law):
            axes, K = whole_stiffness(table.inputs, law, rule)
            if K is None:
                raise _too_many_stiffness_values(law)
            about["stiffness_axes"] = [table.inputs.axes[axis].name for axis in axes]
            stiffness += K.size
        laws[law.key] = about
    rows = sum(trajectory_map.count for trajectory_map in table.maps)
    cells = sum(trajectory_map.cells for trajectory_map in table.maps if trajectory_map.is_shared)
    witnesses = len(witness_indices(len(table.laws) * table.inputs.cells))
    blank = CollisionResult.blank(1)
    variables_of_file: dict[str, Any] = {
        f"trajectory_{name}": _placeholder(
            "trajectory", rows, getattr(blank, name).dtype, f"{name} of a trajectory"
        )
        for name in TABLE_COLUMNS
    }
    if cells:
        variables_of_file["trajectory_of_cell"] = _placeholder(
            "cell", cells, np.dtype("i4"), "number of the trajectory of a cell"
        )
    if stiffness:
        variables_of_file["law_stiffness"] = _placeholder(
            "stiffness_value", stiffness, np.dtype("f8"), "K by the rules of the laws"
        )
    variables_of_file["witness_index"] = _placeholder(
        "witness", witnesses, np.dtype("i8"), "place in C order of (model, axes)"
    )
    for variable in variables:
        attributes = attributes_of(variable)
        variables_of_file[f"witness_{variable.name}"] = (
            "witness",
            np.broadcast_to(np.zeros((), variable.dtype), witnesses),
            attributes,
        )
    order = [axis.name for axis in table.inputs.axes]
    attributes = {**result_template.attrs, "axes": json.dumps(order), "laws": json.dumps(laws)}
    template = xr.Dataset(variables_of_file, result_template.coords, attributes)
    # readers of netCDF take coordinates that no variable names for variables
    names = [str(name) for name in result_template.coords if name not in result_template.dims]
    return template.assign_attrs(coordinates=" ".join(names))


def check_factored(inputs: Inputs, laws: Sequence[Law]) -> None:
    """Refuse laws that cannot be stored in this layout, before integration.

    Raises
    ------
    UsageError : a law's rule of K takes too many values to be stored
    """
    for law in laws:
        if has_stiffness_rule(inputs, law) and whole_stiffness(inputs, law)[1] is None:
            raise _too_many_stiffness_values(law)


def _too_many_stiffness_values(law: Law) -> UsageError:
    return UsageError(
        f"output.layout: {law.key} has a rule of K that takes more than {MAX_STIFFNESS_VALUES:,} values, "
        'the limit of the factored layout; set output.layout = "full"'
    )


def _placeholder(dim: str, size: int, dtype: np.dtype[Any], meaning: str) -> tuple[Any, ...]:
    return dim, np.broadcast_to(np.zeros((), dtype), size), {"long_name": meaning}


def table_values(
    table: TrajectoryTable, variables: Sequence[Variable]
) -> Iterator[tuple[str, slice, NDArray[Any]]]:
    """The values of a factored file, a few at a time: name of the variable, region and values."""
    start = cell = 0
    for model, trajectory_map in enumerate(table.maps):
        for first in range(0, trajectory_map.count, SLAB_ROWS):
            rows = np.arange(first, min(first + SLAB_ROWS, trajectory_map.count))
            part = table.rows.take(model, rows)
            for name in TABLE_COLUMNS:
                yield f"trajectory_{name}", slice(start + first, start + first + rows.size), getattr(part, name)
        start += trajectory_map.count
        if trajectory_map.of_cell is not None:
            yield "trajectory_of_cell", slice(cell, cell + trajectory_map.cells), trajectory_map.of_cell
            cell += trajectory_map.cells
    value = 0
    for law, rule in zip(table.laws, table.stiffness, strict=True):
        if rule is not None or has_stiffness_rule(table.inputs, law):
            K = whole_stiffness(table.inputs, law, rule)[1]
            assert K is not None
            yield "law_stiffness", slice(value, value + K.size), K.reshape(-1)
            value += K.size
    indices = witness_indices(len(table.laws) * table.inputs.cells)
    yield "witness_index", slice(0, len(indices)), indices
    for name, values in witness_values(table, variables, indices).items():
        yield f"witness_{name}", slice(0, len(indices)), values


def witness_indices(points: int) -> NDArray[np.int64]:
    """Indices of witnesses, spread over all points by the golden section, with the first and the last point.

    >>> witness_indices(3).tolist()
    [0, 1, 2]
    """
    if points <= N_WITNESSES:
        return np.arange(points)
    step = int(points * 0.6180339887498949)
    # without a common factor all indices differ
    while math.gcd(step, points) > 1:
        step += 1
    return np.array(sorted({points - 1, *(number * step % points for number in range(N_WITNESSES - 1))}), np.int64)


def witness_values(
    table: TrajectoryTable, variables: Sequence[Variable], indices: NDArray[np.int64]
) -> dict[str, NDArray[Any]]:
    """The values of some points of a result, by name; arrays of shape (len(indices),)."""
    models, cells = np.divmod(indices, table.inputs.cells)
    values_by_name = {variable.name: np.empty(indices.size, variable.dtype) for variable in variables}
    for model in np.unique(models).tolist():
        where = np.flatnonzero(models == model)
        values = expand(table, model, _unravel_cells(table.inputs, cells[where]), list(values_by_name))
        for name, array in values_by_name.items():
            array[where] = np.broadcast_to(values[name], where.shape)
    return values_by_name


def _unravel_cells(inputs: Inputs, cells: NDArray[np.int64]) -> Index:
    """The index of some cells along each axis, from their index in C order."""
    index = []
    for size in reversed(inputs.shape):
        cells, position = np.divmod(cells, size)
        index.append(position)
    return tuple(reversed(index))


def stored_table(
    dataset: xr.Dataset, sizes: Mapping[str, int], read: ReadVariable, take: TakeRows
) -> TrajectoryTable:
    """The trajectory table of a factored file.

    Parameters
    ----------
    dataset : coordinates and attributes of the file
    sizes : lengths of the variables of the table
    read : returns a slice of a variable of the table: `read(name, slice)`
    take : returns a few values of it at increasing positions: `take(name, rows)`

    Raises
    ------
    ResultError : the attribute `laws` does not fit the variables
    """
    laws = _read_laws(dataset)
    inputs = read_inputs(dataset)
    axis_numbers = {axis.name: number for number, axis in enumerate(inputs.axes)}
    maps, rules, stored = [], [], []
    starts = [0]
    cell = value = 0
    try:
        for model, (key, about) in enumerate(laws.items()):
            if any(type(about[name]) is not kind for name, kind in LAW_FIELD_TYPES.items()):
                raise TypeError
            axes = tuple(axis_numbers[name] for name in about["axes"])
            if len({*axes}) < len(axes):
                raise ValueError
            shape = tuple(inputs.shape[axis] for axis in axes)
            trajectory_map = TrajectoryMap(model, axes, shape)
            if about["is_shared"]:
                of_cell = read("trajectory_of_cell", slice(cell, cell + trajectory_map.cells))
                count = int(about["trajectories"])
                # the first cell of a trajectory is not needed to read it
                trajectory_map = TrajectoryMap(model, axes, shape, np.broadcast_to(np.intp(0), count), of_cell)
                cell += trajectory_map.cells
                if of_cell.dtype.kind != "i" or of_cell.shape != (trajectory_map.cells,):
                    raise ValueError
                if of_cell.min() < 0 or of_cell.max() >= count:
                    raise ValueError
            maps.append(trajectory_map)
            starts.append(starts[-1] + trajectory_map.count)
            rule = None
            if about["stiffness_axes"] is not None:
                chosen = tuple(axis_numbers[name] for name in about["stiffness_axes"])
                size = math.prod(inputs.shape[axis] for axis in chosen)
                rule = _stiffness_lookup(inputs, chosen, read("law_stiffness", slice(value, value + size)))
                value += size
            rules.append(rule)
            stored.append(_stored_law(key, about))
        expected_sizes = {f"trajectory_{name}": starts[-1] for name in TABLE_COLUMNS}
        expected_sizes |= {"trajectory_of_cell": cell} if cell else {}
        expected_sizes |= {"law_stiffness": value} if value else {}
        if expected_sizes != {name: size for name, size in sizes.items() if not name.startswith("witness_")}:
            raise ValueError
        _check_trajectory_statuses(sizes["trajectory_status"], read)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError):
        raise ResultError("is not a readable result (its laws do not fit its table)") from None

    def read_rows(model: int, start: int, stop: int) -> CollisionResult:
        part = slice(starts[model] + start, starts[model] + stop)
        return CollisionResult(**{name: read(f"trajectory_{name}", part) for name in TABLE_COLUMNS})

    def pick_rows(model: int, rows: NDArray[np.intp]) -> CollisionResult:
        return CollisionResult(
            **{name: take(f"trajectory_{name}", starts[model] + rows) for name in TABLE_COLUMNS}
        )

    rows = TrajectoryRows(maps, read_rows, pick=pick_rows)
    summary = read_attribute(dataset.attrs, "summary") or None
    if summary is not None:
        _check_summary(summary, dataset, inputs.shape)
    return TrajectoryTable(inputs, tuple(stored), tuple(maps), rows, tuple(rules), summary)


def _check_summary(summary: SummaryRecord, dataset: xr.Dataset, shape: tuple[int, ...]) -> None:
    """Refuse a summary of other statuses, models or points than the result has."""
    statuses = {*summary.status, *(status for status, _, _ in summary.failed_at)}
    models = {
        *(key for _, key, _ in summary.failed_at),
        *(key for worst in summary.worst.values() for key in worst),
    }
    indices = [index for _, _, index in summary.failed_at]
    points = sum(summary.status.values()) + summary.not_evaluated
    if (
        not statuses <= {status.name.lower() for status in Status}
        or not models <= {*dataset["model"].values.tolist()}
        or any(len(index) != len(shape) or any(map(operator.ge, index, shape)) for index in indices)
        or ("witness_status" in dataset and points != count_points(dataset.coords.to_dataset()))
    ):
        raise ResultError("is not a readable result (summary: not that of its points)")


def _check_trajectory_statuses(rows: int, read: ReadVariable) -> None:
    """Refuse unknown statuses, since the computed ones would be unknown as well."""
    for first in range(0, rows, SLAB_ROWS):
        values = read("trajectory_status", slice(first, min(first + SLAB_ROWS, rows)))
        if values.dtype != np.int8 or not IS_STATUS[values.view(np.uint8)].all():
            raise ValueError


def _read_laws(dataset: xr.Dataset) -> dict[str, dict[str, Any]]:
    laws: dict[str, dict[str, Any]] = read_attribute(dataset.attrs, "laws", required=True)
    if list(laws) != [str(key) for key in dataset["model"].values]:
        raise ResultError("is not a readable result (laws: not those of its models)")
    return laws


def _stored_law(key: str, about: Mapping[str, Any]) -> StoredLaw:
    return StoredLaw(
        key=key,
        exponent=None if about["exponent"] is None else float(about["exponent"]),
        parameters=tuple(Parameter(str(name), "1", "") for name in about["parameters"]),
        domain={str(name): (float(low), float(high)) for name, (low, high) in about["domain"].items()},
        quantities=frozenset({"e"} if about["asks_for_e"] else ()),
        is_permanent=bool(about["is_permanent"]),
    )


def _stiffness_lookup(inputs: Inputs, axes: tuple[int, ...], values: Array) -> Stiffness:
    """A function that looks K up at some cells, from its values over the axes that it depends on."""
    K = values.reshape([size if axis in axes else 1 for axis, size in enumerate(inputs.shape)] or (1,))

    def at(index: Index) -> Array:
        if not index:
            return K
        zero = np.zeros((1,) * index[0].ndim, np.intp)
        return np.asarray(K[tuple(positions if axis in axes else zero for axis, positions in enumerate(index))])

    return at


def read_inputs(dataset: xr.Dataset) -> Inputs:
    """The inputs of a sweep, from the coordinates of its result."""
    derived = derived_names(dataset.coords)
    scalars: dict[str, Any] = {}
    axes: dict[str, dict[str, Any]] = {name: {} for name in read_axis_names(dataset)}
    for name, variable in dataset.coords.items():
        if not is_input(name) or name in derived:
            continue
        if variable.ndim == 0:
            scalars[str(name)] = variable.values.item()
        elif variable.dims[0] in axes and variable.ndim == 1:
            axes[str(variable.dims[0])][str(name)] = tuple(variable.values.tolist())
        else:
            raise ResultError(
                f"is not a readable result ({safe_text(str(name), 40)}: does not lie along one axis)"
            )
    try:
        stored = read_attribute(dataset.attrs, "materials", required=True)
        materials = {
            name: Material(**{"E": np.nan, "nu": np.nan, **_fixed_properties(about)})
            for name, about in stored.items()
        }
    except (TypeError, ValueError):
        raise ResultError("is not a readable result (materials: not JSON of the expected type)") from None
    # an axis that is not numbered has the name of its first column
    ordered = (
        Axis({name: columns[name], **columns}) if name in columns else Axis(columns, numbered=name)
        for name, columns in axes.items()
        if columns
    )
    return Inputs(scalars, tuple(ordered), materials)


def _fixed_properties(properties: Mapping[str, float | None]) -> dict[str, float]:
    """The properties of a material that are not axes."""
    return {key: value for key, value in properties.items() if value is not None}


def read_axis_names(dataset: xr.Dataset) -> list[str]:
    """The axes of the grid of a factored file, in their order."""
    names: list[str] = read_attribute(dataset.attrs, "axes", required=True)
    along = [name for name in names if name in dataset.coords and dataset.coords[name].dims == (name,)]
    if along != names or len({*names}) < len(names):
        raise ResultError("is not a readable result (axes: not those of its grid)")
    return names


def check_witnesses(table: TrajectoryTable, variables: Sequence[Variable], stored: xr.Dataset) -> None:
    """Refuse a file whose witnesses expand to other numbers than those stored.

    Parameters
    ----------
    table : of the file
    variables : of the result
    stored : the variables of the witnesses, and the attributes of the result

    Raises
    ------
    ResultError : a witness differs; the message names both versions
    """
    indices = np.asarray(stored["witness_index"].values, np.int64)
    points = len(table.laws) * table.inputs.cells
    if not np.array_equal(indices, witness_indices(points)):
        raise ResultError("is not a readable result (its witnesses are not at the expected positions)")
    expanded = witness_values(table, variables, indices)
    cells = indices % table.inputs.cells
    index = _unravel_cells(table.inputs, cells)
    inputs = {name: values_at(table.inputs, name, index) for name in ("v1", "v2")}
    inputs |= {f"m{ball}": mass_at(table.inputs, ball, index) for ball in "12"}
    for variable in variables:
        expected, got = stored[f"witness_{variable.name}"].values, expanded[variable.name]
        columns = {**inputs, variable.name: expected}
        has_peak = "witness_peak_indentation" in stored
        if has_peak:
            columns["peak_indentation"] = stored["witness_peak_indentation"].values
        with np.errstate(all="ignore"):
            scale = np.broadcast_to(scale_of(variable, columns.__getitem__, has_peak=has_peak), expected.shape)
            rounding = float(np.finfo(expected.dtype).eps) if expected.dtype.kind == "f" else 0.0
            allowed = np.maximum(WITNESS_TOLERANCE, 2.0 * rounding) * np.abs(scale)
            same = (got == expected) | (np.isnan(got) & np.isnan(expected)) | (np.abs(got - expected) <= allowed)
        if not same.all():
            at = int(np.argmin(same))
            version = safe_text(str(stored.attrs.get("impact_version", "unknown")), 40)
            raise ResultError(
                f"its witnesses have other values: {variable.name} is {number(got[at], 12)}, the file has "
                f"{number(expected[at], 12)}; it was written by impact {version}, this is {__version__}: sweep "
                "its config again, or expand it with that version (impact expand)"
            )


def witness_variables(stored: xr.Dataset) -> tuple[Variable, ...]:
    """The variables of a file's witnesses, with their dtypes in the file."""
    return tuple(
        replace(variable, dtype=stored[f"witness_{name}"].dtype.str[1:])
        for name, variable in OUTPUTS.items()
        if f"witness_{name}" in stored
    )
