"""The layouts of a file: full, with all values, and factored, with trajectories that values are computed from.

A factored file has axes, trajectories and laws, for any number of points. Some points, the witnesses, are stored
in full. When a file is opened they are computed again: if they differ, the file was written by a version that
computes other numbers, and is refused.
"""

from __future__ import annotations

import itertools
import json
import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._version import __version__
from ..array_types import Array
from ..config.grid import Axis
from ..config.input_names import is_input
from ..contact.materials import Material
from ..contact.model import Law, Parameter, StoredLaw
from ..contact.records import CollisionResult, Record
from ..contact.slip_motion import FrictionKind
from ..contact.status import Status
from ..contact.tangential import TangentialResult
from ..contact.variables import OUTPUTS, Variable
from ..engine.inputs import Column, Inputs, has_stiffness_rule, index_of, input_at
from ..engine.plan import Plan
from ..engine.trajectories import TrajectoryMap
from ..errors import ResultError, UsageError
from ..formatting import number, safe_text
from .attributes import LawRecord, PairRecord, SummaryRecord, read_attribute
from .netcdf import RegionValues, StoredArray
from .schema import attributes_of, count_points, derived_names, inputs_of_scale, scale_of, stored_variables
from .trajectory_table import MAX_STIFFNESS_VALUES, TrajectoryTable, expand, lazy_dataset, whole_stiffness
from .validation import FACTORED_ATTRIBUTES, PREFIXES, TABLE_VARIABLES, WITNESSES, is_quantity

N_WITNESSES = 1_000
# tolerance of a witness, relative to the scale that `compare` uses for its variable
WITNESS_TOLERANCE = 1e-12
SLAB_ROWS = 2**16

# the variables of the table by name
Arrays = Mapping[str, StoredArray]


def read_layout(variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> tuple[str, xr.Dataset]:
    """Make a dataset of the variables and attributes of a file, and name its layout.

    Its values are read or computed when they are indexed. A ResultError if they do not fit together.
    """
    coordinates = {
        name: variable.load()
        for name, variable in variables.items()
        if name not in TABLE_VARIABLES and not is_quantity(name, tuple(map(str, variable.dims)))
    }
    if "laws" not in attributes:
        values = {name: variable for name, variable in variables.items() if name not in coordinates}
        return "full", xr.Dataset(values, coordinates, attributes)
    stored = {name: variable for name, variable in variables.items() if name in TABLE_VARIABLES}
    witnesses = {name: variable.load() for name, variable in stored.items() if name.startswith("witness_")}
    dataset = xr.Dataset(witnesses, coordinates, attributes)
    # without xarray's indexing, which takes longer than to read a few values
    lazy: dict[str, Any] = {name: variable._data for name, variable in stored.items() if name not in witnesses}
    table = stored_table(dataset, {name: indexed.array for name, indexed in lazy.items()})
    quantities = [
        replace(variable, dtype=stored[f"witness_{name}"].dtype.str[1:])
        for name, variable in OUTPUTS.items()
        if f"witness_{name}" in stored
    ]
    check_witnesses(table, quantities, dataset)
    template = dataset.drop_vars(witnesses).drop_attrs(deep=False)
    described = {name: value for name, value in attributes.items() if name not in FACTORED_ATTRIBUTES}
    return "factored", lazy_dataset(template.assign_attrs(described), table, quantities)


def stiffness_to_store(inputs: Inputs, law: Law) -> tuple[tuple[int, ...], Array] | None:
    """Evaluate K [N/m^n] by a law's own rule, or return None; raise a UsageError for too many values."""
    if not has_stiffness_rule(inputs, law):
        return None
    axes, K = whole_stiffness(inputs, law)
    if K is None:
        raise UsageError(
            f"output.layout: {law.key} has a rule of K that takes more than {MAX_STIFFNESS_VALUES:,} values, "
            'the limit of the factored layout; set output.layout = "full"'
        )
    return axes, K


def file_template(result: xr.Dataset, plan: Plan, table: TrajectoryTable) -> xr.Dataset:
    """Build the dataset of the file, with placeholder values, from that of the result."""
    if plan.layout == "full":
        return result
    names = [axis.name for axis in table.inputs.axes]
    laws, stiffness = {}, [stiffness_to_store(table.inputs, law) for law in table.laws]
    for law, trajectory_map, rule in zip(table.laws, table.maps, stiffness, strict=False):
        record = LawRecord(
            exponent=law.exponent,
            parameters=[parameter.name for parameter in law.parameters],
            domain=dict(law.domain),
            asks_for_e="e" in law.quantities,
            is_permanent=law.is_permanent,
            axes=[names[axis] for axis in trajectory_map.axes],
            trajectories=trajectory_map.count,
            is_shared=trajectory_map.is_shared,
            stiffness_axes=None if rule is None else [names[axis] for axis in rule[0]],
        )
        laws[law.key] = vars(record)
    pairs = [
        vars(PairRecord([names[axis] for axis in pair.axes], pair.count, pair.is_shared))
        for pair in table.maps[len(table.laws) :]
    ]
    cells = sum(trajectory_map.cells for trajectory_map in table.maps if trajectory_map.is_shared)

    def placeholder(dim: str, size: int, dtype: Any, attributes: Mapping[str, object] | str) -> tuple[Any, ...]:
        described = {"long_name": attributes} if isinstance(attributes, str) else attributes
        return dim, np.broadcast_to(np.zeros((), dtype), size), described

    stored = {}
    for record_type, prefix in PREFIXES.items():
        if rows := sum(
            trajectory_map.count for trajectory_map in table.maps if trajectory_map.record is record_type
        ):
            for name, array in vars(record_type.blank(1)).items():
                stored[f"{prefix}_{name}"] = placeholder(prefix, rows, array.dtype, f"{name} of a trajectory")
    if cells:
        stored["trajectory_of_cell"] = placeholder("cell", cells, "i4", "number of the trajectory of a cell")
    if values := sum(rule[1].size for rule in stiffness if rule is not None):
        stored["law_stiffness"] = placeholder("stiffness_value", values, "f8", "K by the rules of the laws")
    for of_friction, indices, chosen in _witnesses(table, stored_variables(plan)):
        dim, index_name = WITNESSES[of_friction]
        stored[index_name] = placeholder(dim, indices.size, "i8", "place in C order of (model, axes)")
        for variable in chosen:
            stored[f"witness_{variable.name}"] = placeholder(
                dim, indices.size, variable.dtype, attributes_of(variable)
            )
    attributes = {**result.attrs, "axes": json.dumps(names), "laws": json.dumps(laws)}
    if pairs:
        attributes |= {"frictions": json.dumps(table.frictions), "pairs": json.dumps(pairs)}
    template = xr.Dataset(stored, result.coords, attributes)
    # readers of netCDF take coordinates that no variable names for variables
    others = [str(name) for name in result.coords if name not in result.dims]
    return template.assign_attrs(coordinates=" ".join(others))


def table_values(table: TrajectoryTable, variables: Sequence[Variable]) -> Iterator[RegionValues]:
    """Yield the values of a factored file, a few at a time: name of the variable, region and values."""
    starts = dict.fromkeys(PREFIXES, 0)
    for law, trajectory_map in enumerate(table.maps):
        start, prefix = starts[trajectory_map.record], PREFIXES[trajectory_map.record]
        for first in range(0, trajectory_map.count, SLAB_ROWS):
            rows = np.arange(first, min(first + SLAB_ROWS, trajectory_map.count))
            for name, array in vars(table.take(law, rows)).items():
                yield f"{prefix}_{name}", (slice(start + first, start + first + rows.size),), array
        starts[trajectory_map.record] += trajectory_map.count
    cells = [trajectory_map.of_cell for trajectory_map in table.maps if trajectory_map.of_cell is not None]
    rules = (stiffness_to_store(table.inputs, law) for law in table.laws)
    stiffness = [rule[1].reshape(-1) for rule in rules if rule is not None]
    stored: dict[str, Sequence[NDArray[Any]]] = {"trajectory_of_cell": cells, "law_stiffness": stiffness}
    for name, arrays in stored.items():
        for region, array in zip(_consecutive([array.size for array in arrays]), arrays, strict=True):
            yield name, (region,), array
    for of_friction, indices, chosen in _witnesses(table, variables):
        yield WITNESSES[of_friction][1], (slice(0, indices.size),), indices
        for name, values in witness_values(table, chosen, indices).items():
            yield f"witness_{name}", (slice(0, indices.size),), values


def _witnesses(
    table: TrajectoryTable, variables: Sequence[Variable]
) -> Iterator[tuple[bool, NDArray[np.int64], list[Variable]]]:
    """Choose witnesses of the models, and of the pairs if there are some: their places, and their variables."""
    for of_friction in (False, True):
        if numbers := table.numbers(of_friction):
            indices = witness_indices(len(numbers) * table.inputs.cells)
            yield of_friction, indices, [variable for variable in variables if variable.of_friction == of_friction]


def _consecutive(sizes: Sequence[int]) -> list[slice]:
    """Place parts of some sizes one after another.

    >>> _consecutive([2, 3])
    [slice(0, 2, None), slice(2, 5, None)]
    """
    return [slice(stop - size, stop) for size, stop in zip(sizes, itertools.accumulate(sizes), strict=True)]


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
    """Compute the values of some points of models, or of pairs, by name; arrays of shape (len(indices),)."""
    models, cells = np.divmod(indices, table.inputs.cells)
    numbers = table.numbers(any(variable.of_friction for variable in variables))
    values_by_name = {variable.name: np.empty(indices.size, variable.dtype) for variable in variables}
    for model in np.unique(models).tolist():
        rows = np.flatnonzero(models == model)
        index = index_of(cells[rows], table.inputs.shape)
        values = expand(table, numbers[model], index, list(values_by_name))
        for name, array in values_by_name.items():
            array[rows] = values[name]
    return values_by_name


def stored_table(dataset: xr.Dataset, arrays: Arrays) -> TrajectoryTable:
    """Read the trajectory table of a factored file; its rows are read when they are needed."""
    laws: dict[str, LawRecord] = read_attribute(dataset.attrs, "laws", required=True)
    if list(laws) != [str(key) for key in dataset["model"].values]:
        raise ResultError("is not a readable result (laws: not those of its models)")
    names: list[str] = read_attribute(dataset.attrs, "axes", required=True)
    along = [name for name in names if name in dataset.coords and dataset.coords[name].dims == (name,)]
    if along != names or len({*names}) < len(names):
        raise ResultError("is not a readable result (axes: not those of its grid)")
    inputs = read_inputs(dataset, names)
    pairs: list[PairRecord] = read_attribute(dataset.attrs, "pairs")
    frictions: dict[str, FrictionKind] = read_attribute(dataset.attrs, "frictions")
    keys = [str(key) for key in dataset["friction"].values] if "friction" in dataset else []
    if len(pairs) != len(laws) * len(frictions) or list(frictions) != keys:
        raise ResultError("is not a readable result (pairs: not those of its models and friction laws)")
    try:
        maps = _stored_maps(inputs, [*laws.values(), *pairs], len(laws), arrays)
        inputs = replace(inputs, stiffness=_read_stiffness(inputs, laws, arrays))
        rows: list[slice] = []
        for record_type, prefix in PREFIXES.items():
            of_type = [trajectory_map.count for trajectory_map in maps if trajectory_map.record is record_type]
            if of_type:
                rows += _consecutive(of_type)
                if {arrays[f"{prefix}_{name}"].shape for name in record_type.columns()} != {(sum(of_type),)}:
                    raise ValueError
                _check_trajectory_statuses(record_type, arrays[f"{prefix}_status"])
    except (KeyError, TypeError, ValueError, IndexError, OverflowError):
        raise ResultError("is not a readable result (its laws do not fit its table)") from None

    def read_rows(law: int, part: slice | NDArray[np.intp]) -> Record:
        start, record_type = rows[law].start, maps[law].record
        chosen = slice(start + part.start, start + part.stop) if isinstance(part, slice) else start + part
        prefix = PREFIXES[record_type]
        return record_type(**{name: arrays[f"{prefix}_{name}"].read((chosen,)) for name in record_type.columns()})

    summary = read_attribute(dataset.attrs, "summary") or None
    if summary is not None:
        _check_summary(summary, dataset, inputs.shape)
    stored_laws = tuple(_stored_law(key, law) for key, law in laws.items())
    return TrajectoryTable(inputs, stored_laws, tuple(maps), read_rows, summary, frictions, pick=read_rows)


def _axis_numbers(inputs: Inputs, names: Sequence[str]) -> tuple[int, ...]:
    """Find the numbers of axes; raise a ValueError for an unknown or a repeated one."""
    if len({*names}) < len(names):
        raise ValueError
    return tuple(map([axis.name for axis in inputs.axes].index, names))


def _parts(arrays: Arrays, name: str, lengths: Sequence[int]) -> Iterator[NDArray[Any]]:
    """Read the parts of some lengths that a variable consists of; a ValueError if it has another length."""
    if (arrays[name].shape[0] if name in arrays else 0) != sum(lengths):
        raise ValueError
    return (arrays[name].read((part,)) for part in _consecutive(lengths))


def _stored_maps(
    inputs: Inputs, laws: Sequence[LawRecord | PairRecord], models: int, arrays: Arrays
) -> list[TrajectoryMap]:
    """Read the trajectory of each cell, of each model and pair; raise a ValueError for one that does not exist."""
    maps = []
    for position, law in enumerate(laws):
        axes = _axis_numbers(inputs, law.axes)
        record = CollisionResult if position < models else TangentialResult
        maps.append(TrajectoryMap(position, axes, tuple(inputs.shape[axis] for axis in axes), record=record))
    shared = [model for model, law in enumerate(laws) if law.is_shared]
    cells = _parts(arrays, "trajectory_of_cell", [maps[model].cells for model in shared])
    for model, of_cell in zip(shared, cells, strict=True):
        count = laws[model].trajectories
        if of_cell.dtype.kind != "i" or of_cell.min() < 0 or of_cell.max() >= count:
            raise ValueError
        # the first cell of a trajectory is not needed to read it
        maps[model] = replace(maps[model], first=np.broadcast_to(np.intp(0), count), of_cell=of_cell)
    return maps


def _read_stiffness(inputs: Inputs, laws: Mapping[str, LawRecord], arrays: Arrays) -> dict[str, Column]:
    """Read K of each law with a rule for it, over the axes that it depends on; see `Inputs`."""
    axes = {
        f"{key}.K": _axis_numbers(inputs, law.stiffness_axes)
        for key, law in laws.items()
        if law.stiffness_axes is not None
    }
    shapes = [tuple(inputs.shape[axis] for axis in numbers) for numbers in axes.values()]
    values = _parts(arrays, "law_stiffness", [math.prod(shape) for shape in shapes])
    return {
        name: Column(numbers, np.reshape(K, shape))
        for (name, numbers), shape, K in zip(axes.items(), shapes, values, strict=True)
    }


def _check_summary(summary: SummaryRecord, dataset: xr.Dataset, shape: tuple[int, ...]) -> None:
    """Refuse a summary of other statuses, models or points than the result has."""
    statuses = {*summary.status, *(status for status, _, _ in summary.failed_at)}
    models = {key for _, key, _ in summary.failed_at}.union(*summary.worst.values())
    indices = [index for _, _, index in summary.failed_at]
    points = sum(summary.status.values()) + summary.not_evaluated
    if (
        not statuses <= {status.name.lower() for status in Status}
        or not models <= {*dataset["model"].values.tolist()}
        or any(len(index) != len(shape) or any(map(operator.ge, index, shape)) for index in indices)
        or ("witness_status" in dataset and points != count_points(dataset.coords.to_dataset()))
    ):
        raise ResultError("is not a readable result (summary: not that of its points)")


def _check_trajectory_statuses(record: type[Record], array: StoredArray) -> None:
    """Refuse unknown statuses, since the computed ones would be unknown as well."""
    for first in range(0, array.shape[0], SLAB_ROWS):
        values = array.read((slice(first, first + SLAB_ROWS),))
        if values.dtype != np.int8 or not np.isin(values, [*record.statuses]).all():
            raise ValueError


def _stored_law(key: str, law: LawRecord) -> StoredLaw:
    """Build a law without formulas from its record in a file."""
    parameters = tuple(Parameter(name, "1", "") for name in law.parameters)
    quantities = frozenset({"e"} if law.asks_for_e else ())
    return StoredLaw(key, law.exponent, parameters, law.domain, quantities, law.is_permanent)


def read_inputs(dataset: xr.Dataset, axis_names: Sequence[str]) -> Inputs:
    """Read the inputs of a sweep along some axes from the coordinates of its result."""
    derived = derived_names(dataset.coords)
    scalars: dict[str, Any] = {}
    axes: dict[str, dict[str, Any]] = {name: {} for name in axis_names}
    for name, variable in dataset.coords.items():
        name = str(name)
        if not is_input(name) or name in derived:
            continue
        if variable.ndim == 0:
            scalars[name] = variable.values.item()
        elif variable.dims[0] in axes and variable.ndim == 1:
            axes[str(variable.dims[0])][name] = tuple(variable.values.tolist())
        else:
            raise ResultError(f"is not a readable result ({safe_text(name, 40)}: does not lie along one axis)")
    try:
        materials = {
            # properties that are axes have no value
            name: Material(
                **{"E": np.nan, "nu": np.nan} | {key: v for key, v in properties.items() if v is not None}
            )
            for name, properties in read_attribute(dataset.attrs, "materials", required=True).items()
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


def check_witnesses(table: TrajectoryTable, variables: Sequence[Variable], stored: xr.Dataset) -> None:
    """Refuse a file whose witnesses, stored with their index, expand to other numbers; name both versions."""
    for of_friction, indices, chosen in _witnesses(table, variables):
        if not np.array_equal(stored[WITNESSES[of_friction][1]].values.astype(np.int64), indices):
            raise ResultError("is not a readable result (its witnesses are not at the expected positions)")
        expanded = witness_values(table, chosen, indices)
        index = index_of(indices % table.inputs.cells, table.inputs.shape)
        # those that the scales need, and that are stored or follow from others
        known = {"v1", "v2", "m1", "m2", "R1", "R2", *table.inputs.names()}
        needed = known.intersection(name for variable in chosen for name in inputs_of_scale(variable))
        inputs = {name: input_at(table.inputs, name, index) for name in needed}
        has_peak = "witness_peak_indentation" in stored
        if has_peak:
            inputs["peak_indentation"] = stored["witness_peak_indentation"].values
        for variable in chosen:
            expected, got = stored[f"witness_{variable.name}"].values, expanded[variable.name]
            columns = {**inputs, variable.name: expected}
            with np.errstate(all="ignore"):
                scale = np.abs(scale_of(variable, columns.__getitem__, has_peak=has_peak))
                rounding = float(np.finfo(expected.dtype).eps) if expected.dtype.kind == "f" else 0.0
                allowed = np.maximum(WITNESS_TOLERANCE, 2.0 * rounding) * np.broadcast_to(scale, expected.shape)
                same = (got == expected) | (np.isnan(got) & np.isnan(expected)) | (abs(got - expected) <= allowed)
            if not same.all():
                worst = int(np.argmin(same))
                version = safe_text(str(stored.attrs.get("impact_version", "unknown")), 40)
                raise ResultError(
                    f"its witnesses have other values: {variable.name} is {number(got[worst], 12)}, the file has "
                    f"{number(expected[worst], 12)}; it was written by impact {version}, this is {__version__}: "
                    "sweep its config again, or expand it with that version (impact expand)"
                )
