"""Expand the trajectory table of a sweep into the outputs of any part of its grid.

A sweep integrates a table of distinct trajectories per model, in dimensionless form. Everything else in a result
is a pure function of the inputs, this table and an index of the grid, and is computed in this module only.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from ..array_types import Array
from ..config.grid import Axis
from ..config.input_names import InputName
from ..config.tables import FIXED_STEP_INPUTS, OBLIQUE_INPUTS
from ..contact.impacts import CHECKS, check_inputs
from ..contact.model import Law
from ..contact.output_formulas import Outputs, outputs
from ..contact.records import CollisionResult, Record
from ..contact.slip_motion import FrictionKind
from ..contact.status import FrictionStatus, Status
from ..contact.tangential import TangentialResult
from ..contact.variables import AXES, Variable
from ..engine.inputs import Index, Inputs, build_impacts, build_oblique, dimensions, has_stiffness_rule
from ..engine.plan import Plan
from ..engine.trajectories import (
    RANGE_TRAJECTORIES,
    TrajectoryMap,
    TrajectoryRange,
    axes_of_arrays,
    checked_arrays,
    even_size,
    probe_index,
)
from .attributes import SummaryRecord
from .schema import attributes_of
from .slabs import ORIGINAL_DIMS, VARIES_ALONG, slabs

# a law's rule of K is evaluated as a whole, and stored in a file, up to this many values
MAX_STIFFNESS_VALUES = 10**6
# rows that are read one by one: fewer than one of this many
FEW_ROWS = 100
# magnitudes within these limits are far from overflow and underflow, whatever the rounding
SAFE_MAGNITUDES = (1e-250, 1e250)
# at most this many bytes are computed or read by one indexing operation
MAX_INDEXED_BYTES = 16 * 2**30


@dataclass(frozen=True)
class TrajectoryTable:
    """The trajectories of a sweep, with everything else that the outputs depend on.

    laws : the models; those of a file have no formulas
    maps : of each model, then of the pairs of each model with each friction law
    read : returns a segment of the integrated trajectories of a map, by its number, when they are needed
    summary : of all points, if the file contains one
    frictions : the kinds of the friction laws by key
    pick : returns a few trajectories of a map by their increasing row numbers; None if there are only segments
    """

    inputs: Inputs
    laws: tuple[Law, ...]
    maps: tuple[TrajectoryMap, ...]
    read: Callable[[int, slice], Record]
    summary: SummaryRecord | None = None
    frictions: Mapping[str, FrictionKind] = field(default_factory=dict)
    pick: Callable[[int, NDArray[np.intp]], Record] | None = None
    segment: int = RANGE_TRAJECTORIES
    # of each type, the map whose trajectories were read last, and all of them, if its cells share them
    _whole: dict[type[Record], tuple[int, Record]] = field(default_factory=dict, init=False)

    def numbers(self, of_friction: bool) -> range:
        """The numbers of the maps of the models, or of the pairs."""
        models = len(self.laws)
        return range(models, models * (1 + len(self.frictions))) if of_friction else range(models)

    def place(self, number: int) -> tuple[int, ...]:
        """The model of a map, or the model and the friction law of the map of a pair."""
        models = len(self.laws)
        return (number,) if number < models else divmod(number - models, len(self.frictions))

    def keys(self, number: int) -> tuple[str, ...]:
        """The key of the model of a map, and that of the friction law of a pair."""
        model, *friction = self.place(number)
        return (self.laws[model].key, *([*self.frictions][law] for law in friction))

    @cached_property
    def checks(self) -> tuple[frozenset[str], ...]:
        """Find, by model, the checks of `impact.contact.impacts.check_inputs` that are necessary at each point."""
        return tuple(checks_that_may_fail(self.inputs, law) for law in self.laws)

    def take(self, number: int, rows: NDArray[np.intp]) -> Any:
        """Read trajectories of a map by their row numbers, a record of arrays of the shape of `rows`."""
        trajectory_map = self.maps[number]
        last, whole = self._whole.get(trajectory_map.record, (None, trajectory_map.record.blank(0)))
        if self.pick is not None and last != number and rows.size < trajectory_map.count // FEW_ROWS:
            distinct, position = np.unique(rows, return_inverse=True)
            return self.pick(number, distinct).take(position.reshape(rows.shape))
        if not trajectory_map.is_shared:
            flat = self._segments(number, rows.reshape(-1))
            return flat.take(np.arange(rows.size).reshape(rows.shape))
        if last != number:
            # cells share trajectories in any order: keep all of them
            whole = self._segments(number, np.arange(trajectory_map.count))
            self._whole[trajectory_map.record] = number, whole
        return whole.take(rows)

    def _segments(self, number: int, rows: NDArray[np.intp]) -> Record:
        count = self.maps[number].count
        size = even_size(count, self.segment)
        trajectories, segments = self.maps[number].record.blank(rows.size), rows // size
        for segment in np.unique(segments).tolist():
            positions, start = np.flatnonzero(segments == segment), segment * size
            read = self.read(number, slice(start, min(start + size, count)))
            trajectories.put(positions, read.take(rows[positions] - start))
        return trajectories


def table_of_ranges(plan: Plan, load: Callable[[TrajectoryRange], Record]) -> TrajectoryTable:
    """Build the trajectory table of a plan from its finished ranges."""
    range_at = {(finished.model, finished.start): finished for finished in plan.ranges}
    frictions = {friction.key: friction.kind for friction in plan.frictions}
    return TrajectoryTable(
        plan.inputs, plan.models, plan.maps, lambda law, part: load(range_at[law, part.start]), None, frictions
    )


def expand(table: TrajectoryTable, number: int, index: Index, names: Sequence[str]) -> Outputs:
    """Compute some outputs of a model, or of a pair by the number of its map, at cells of the grid.

    `index` has an integer array for each axis, which broadcast against each other; a plan without axes has one
    cell. The outputs have the shape of the index; along axes on which they do not vary they are views.
    """
    model, *friction = table.place(number)
    law = table.laws[model]
    impacts = build_impacts(table.inputs, law, index)
    with np.errstate(all="ignore"):
        checked = check_inputs(law, impacts, table.checks[model])
    result = table.take(model, table.maps[model].rows(index))
    of_friction = None
    if friction:
        tangential = table.take(number, table.maps[number].rows(index))
        kind = table.frictions[table.keys(number)[1]]
        of_friction = (build_oblique(table.inputs, impacts, index), tangential, kind)
    values = outputs(law, impacts, result, names, checked, of_friction)
    shape = np.broadcast_shapes(*(positions.shape for positions in index))
    # without axes, an array has one of length one
    return {name: np.broadcast_to(a if index else a.reshape(()), shape) for name, a in values.items()}


def varies_along(table: TrajectoryTable, number: int, names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Find the axes of the grid along which outputs of a model, or of a pair, vary at most."""
    model, *friction = table.place(number)
    law, inputs = table.laws[model], table.inputs
    # K may depend on the value of n: Hertz's K is for n = 3/2
    index = probe_index(inputs, {"n"})
    impacts = build_impacts(inputs, law, index)
    # assume that every check that may fail does, so that the masks have all axes that they may have
    arrays = checked_arrays(impacts)
    shapes = [array.shape for check in table.checks[model] for array in arrays[check]]
    checked = np.broadcast_shapes((1,) * dimensions(index), *shapes)
    status = _alternating_statuses(checked, Status.NO_IMPACT, Status.OUT_OF_RANGE)

    def blank(record: type[Record], number: int, *statuses: IntEnum) -> Any:
        shape = table.maps[number].rows(index).shape
        one = record.blank(1).take(np.zeros(shape, np.intp))
        return replace(one, status=_alternating_statuses(shape, *statuses))

    collisions, of_friction = blank(CollisionResult, model, Status.MAX_STEPS), None
    if friction:
        tangential = blank(TangentialResult, number, FrictionStatus.MAX_STEPS, FrictionStatus.LIMIT)
        of_friction = (build_oblique(inputs, impacts, index), tangential, table.frictions[table.keys(number)[1]])
    values = outputs(law, impacts, collisions, names, status, of_friction)
    return {name: tuple(sorted(axes_of_arrays([values[name]]))) for name in names}


def _alternating_statuses(shape: tuple[int, ...], *statuses: IntEnum) -> NDArray[np.int8]:
    """Build an array in which OK and each of some statuses alternate; OK only if it has one element."""
    status_array = np.full(shape, Status.OK, np.int8)
    if status_array.size > 1:
        for offset, status in enumerate(statuses):
            status_array.reshape(-1)[offset :: len(statuses) + 1] = status
    return status_array


def checks_that_may_fail(inputs: Inputs, law: Law) -> frozenset[str]:
    """Find the checks of `check_inputs` that may fail at some point of the grid; the others hold at all of them.

    The scales of a contact are monotonic, or nearly so, in each of closing speed, masses, radii, K and n: they are
    safe at all points if they are far from overflow and underflow at all combinations of the extreme values.
    """
    slowest, fastest, slowest_approach = _closing_speeds(inputs)
    if not fastest > 0.0:
        return CHECKS
    speeds = np.array([slowest_approach, fastest])
    failing = {"v0"} if slowest <= 0.0 else set()
    ends: dict[str, tuple[Any, ...]] = {"v1": tuple(speeds.tolist())}
    for axis in inputs.axes:
        for name, values in axis.columns.items():
            is_used = InputName.parse(name).applies_to(law.key)
            if is_used and name not in ("v1", "v2", "e", "alpha", *FIXED_STEP_INPUTS, *OBLIQUE_INPUTS):
                is_text = isinstance(values[0], str)
                ends[name] = tuple(sorted({*values})) if is_text else tuple({min(values), max(values)})
    if f"{law.key}.K" in inputs.stiffness or has_stiffness_rule(inputs, law):
        K = whole_stiffness(inputs, law)[1]
        if K is None:
            return CHECKS
        ends[f"{law.key}.K"] = (float(K.min()), float(K.max()))
    if math.prod(map(len, ends.values())) > MAX_STIFFNESS_VALUES:
        return CHECKS
    scalars = {**inputs.scalars, "v2": 0.0, "e": 1.0}
    fixed = {name: scalars[name] for name in scalars.keys() - ends.keys() - {*OBLIQUE_INPUTS}}
    corners = Inputs(fixed, tuple(Axis({name: values}) for name, values in ends.items()), inputs.materials)
    with np.errstate(all="ignore"):
        impacts = build_impacts(corners, law, corners.index())
        sizes = [impacts.m, impacts.K, impacts.length, impacts.energy, impacts.time]
        if not all(np.all((size > SAFE_MAGNITUDES[0]) & (size < SAFE_MAGNITUDES[1])) for size in sizes):
            failing.add("length")
        if "alpha" in inputs.names():
            restitution = 1.0 - np.multiply.outer(
                np.asarray(inputs.values("alpha"), float), np.array([slowest, fastest])
            )
        else:
            restitution = np.asarray(inputs.values("e") if "e" in inputs.names() else np.nan, float)
    if "e" in law.quantities and not np.all((restitution >= 0.0) & (restitution <= 1.0)):
        failing.add("e")
    return frozenset(failing)


def _closing_speeds(inputs: Inputs) -> tuple[float, float, float]:
    """Find the least and the greatest closing speed v1 - v2 [m/s], and a lower bound of the positive ones."""
    if "speed" in inputs.names():
        speeds = np.asarray(inputs.values("speed"), float)
        angles = np.asarray(inputs.values("angle") if "angle" in inputs.names() else 0.0, float)
        slowest, fastest = float(speeds.min() * np.cos(angles.max())), float(speeds.max() * np.cos(angles.min()))
        return slowest, fastest, slowest
    v1, v2 = (np.asarray(inputs.values(name), float) for name in ("v1", "v2"))
    slowest, fastest = float(v1.min() - v2.max()), float(v1.max() - v2.min())
    magnitudes = np.abs(np.concatenate([v1.reshape(-1), v2.reshape(-1)]))
    # a difference of two numbers is at least the spacing of numbers at the smaller one
    bound = float(magnitudes[magnitudes > 0.0].min(initial=np.inf)) * float(np.finfo(float).eps) / 2.0
    return slowest, fastest, slowest if slowest > 0.0 else bound


def whole_stiffness(inputs: Inputs, law: Law) -> tuple[tuple[int, ...], Array | None]:
    """Look up or evaluate K [N/m^n] of a law over the axes that it depends on; no K if the values are too many."""
    probed = build_impacts(inputs, law, probe_index(inputs, {"n"})).K
    axes = tuple(sorted(axes_of_arrays([probed])))
    if math.prod(inputs.shape[axis] for axis in axes) > MAX_STIFFNESS_VALUES:
        return axes, None
    region = [slice(None) if axis in axes else slice(1) for axis in range(len(inputs.shape))]
    return axes, build_impacts(inputs, law, inputs.index(region)).K


class ExpandedArray(BackendArray):
    """A variable of a result that is computed from a trajectory table when it is indexed."""

    def __init__(self, table: TrajectoryTable, variable: Variable) -> None:
        self.table, self.variable = table, variable
        outer = {"model": len(table.laws), "friction": len(table.frictions)}
        self.outer = tuple(size for dim, size in outer.items() if dim in variable.dims)
        self.shape = self.outer + table.inputs.shape
        self.dtype = np.dtype(variable.dtype)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        positions = [np.atleast_1d(np.arange(size)[part]) for size, part in zip(self.shape, key, strict=True)]
        shape, name = tuple(part.size for part in positions), self.variable.name
        check_memory(name, shape, self.dtype)
        values = np.empty(shape, self.dtype)
        outer, axes = positions[: len(self.outer)], positions[len(self.outer) :]
        # what does not depend on the law is that of the first
        laws = self.table.numbers(self.variable.of_friction)[: math.prod(self.outer)]
        for row, number in np.ndenumerate(np.reshape(laws, self.outer)[np.ix_(*outer)]):
            # a view, also if there is no axis
            out = values[(*row, ...)]
            for slab in slabs(dict(enumerate(out.shape))):
                region = tuple(slab.values())
                index = np.ix_(*(axis[part] for axis, part in zip(axes, region, strict=True)))
                out[region or ...] = expand(self.table, int(number), index, [name])[name]
        selected = tuple(0 if isinstance(part, int | np.integer) else slice(None) for part in key)
        return np.asarray(values[selected])


def computed_array(variable: xr.Variable) -> ExpandedArray | None:
    """Find what computes a variable; None if it is stored or a selection."""
    data = variable._data
    if not isinstance(data, indexing.LazilyIndexedArray) or not isinstance(data.array, ExpandedArray):
        return None
    is_whole = all(isinstance(part, slice) and part == slice(None) for part in data.key.tuple)
    return data.array if is_whole else None


def table_of_result(dataset: xr.Dataset) -> TrajectoryTable | None:
    """Find the trajectory table that a whole result is computed from; None if its values are stored."""
    arrays = [computed_array(variable.variable) for variable in dataset.values()]
    tables = [None if array is None else array.table for array in arrays]
    return tables[0] if tables and all(table is tables[0] for table in tables) else None


def check_memory(name: str, shape: Sequence[int], dtype: np.dtype[Any]) -> None:
    """Raise a MemoryError for an array of more than half of the memory, or than MAX_INDEXED_BYTES."""
    size, limit = math.prod(shape) * dtype.itemsize, MAX_INDEXED_BYTES
    with contextlib.suppress(ValueError, OSError, AttributeError):
        limit = min(limit, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2)
    if size > limit:
        raise MemoryError(
            f"{name}: {math.prod(shape):,} values take {size:,} bytes, expected at most {limit:,}; select a part "
            "first, such as result.isel(...) or result.sel(...)"
        )


def lazy_dataset(template: xr.Dataset, table: TrajectoryTable, variables: Sequence[Variable]) -> xr.Dataset:
    """Build a result, from its coordinates and attributes, whose variables are computed when they are read."""
    axes = [axis.name for axis in table.inputs.axes]
    along = defaultdict[tuple[str, str], set[int]](set)
    for number in range(len(table.maps)):
        names = [v.name for v in variables if v.of_friction == (number >= len(table.laws))]
        for name, varying in varies_along(table, number, names).items():
            along[name, table.keys(number)[0]].update(varying)
    computed = {}
    for variable in variables:
        dims = [*(dim for dim in variable.dims if dim != AXES), *axes]
        friction = [dim for dim in variable.dims if dim == "friction"]
        by_model = {
            law.key: (*friction, *(axes[axis] for axis in sorted(along[variable.name, law.key])))
            for law in table.laws
        }
        array = indexing.LazilyIndexedArray(ExpandedArray(table, variable))
        encoding = {VARIES_ALONG: by_model, ORIGINAL_DIMS: tuple(dims)}
        computed[variable.name] = xr.Variable(dims, array, attributes_of(variable), encoding)
    dataset = template.drop_vars(list(template.data_vars)).assign(computed)
    for dim in map(str, dataset.dims):
        dataset = dataset if dim in dataset.xindexes else dataset.set_xindex(dim)
    return dataset


class ExpandedSlab(NamedTuple):
    """All values of a model, or of a pair, in a region of the grid, by name.

    `number` is that of the map, and `place` the model, or the model and the friction law, see `TrajectoryTable`.
    """

    number: int
    place: tuple[int, ...]
    region: tuple[slice, ...]
    values: dict[str, NDArray[Any]]

    def region_in(self, dims: Sequence[Hashable]) -> tuple[int | slice, ...]:
        """The region of these values in a variable with some dimensions."""
        return (*self.place, *self.region) if "model" in dims else self.region


def expanded_slabs(
    table: TrajectoryTable, variables: Sequence[Variable], chunks: Sequence[int] = ()
) -> Iterator[ExpandedSlab]:
    """Compute all values of a result, slab by slab; of whole chunks, if their lengths along the axes are given.

    Variables that do not depend on the model are in the slabs of the first model only.
    """
    sizes: dict[Hashable, int] = dict(enumerate(table.inputs.shape))
    for number in range(len(table.maps)):
        of_friction = number >= len(table.laws)
        chosen = [
            variable
            for variable in variables
            if variable.of_friction == of_friction and (variable.per_model or number == 0)
        ]
        for slab in slabs(sizes, chunks=chunks):
            region = tuple(slab.values())
            index = table.inputs.index(region)
            arrays = expand(table, number, index, [variable.name for variable in chosen])
            # copied only if it is a broadcast view or has another dtype
            values = {v.name: np.asarray(arrays.pop(v.name), v.dtype, order="C") for v in chosen}
            yield ExpandedSlab(number, table.place(number), region, values)


def in_memory(dataset: xr.Dataset) -> xr.Dataset:
    """Compute all values of a result that is computed from a trajectory table."""
    computed = [array for v in dataset.values() if (array := computed_array(v.variable)) is not None]
    values = {array.variable.name: np.empty(array.shape, array.dtype) for array in computed}
    # all variables of a slab together: they share most of the computation
    for slab in expanded_slabs(computed[0].table, [array.variable for array in computed]):
        for name, part in slab.values.items():
            values[name][slab.region_in(dataset[name].dims) or ...] = part
    return dataset.assign(
        {name: (dataset[name].dims, array, dataset[name].attrs) for name, array in values.items()}
    )
