"""The distinct trajectories of a plan: points with the same dimensionless problem share one trajectory.

The values of a law depend only on some of the axes. They are evaluated on the cells, the product of those axes; up
to MAX_CELLS cells, equal values are found in the whole plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..array_types import AnyArray, Indices, Int8Array, Mask
from ..contact.dimensionless import dimensionless_values, exponent_names
from ..contact.friction import Pair, check_friction, friction_values
from ..contact.frictions.multibody_codes import MUJOCO_ELLIPTIC
from ..contact.impacts import CHECKS, Impacts, check_inputs
from ..contact.model import ForceModel
from ..contact.records import CollisionResult, Record, deduplicate
from ..contact.status import STATUS_OK
from ..contact.tangential import TangentialResult
from .inputs import Index, Inputs, build_impacts, build_oblique, dimensions, fixed_steps_at, index_of

# cells up to which equal values are found in the whole plan; with more, only within a range of trajectories
MAX_CELLS = 2**22
# trajectories integrated at a time: many, to amortise the interpreter's overhead, and few enough to stay in cache
RANGE_TRAJECTORIES = 32768

# the dimensionless problems of trajectories: the exponent `n`, the `status` after the checks of inputs, and by
# name the arguments of the law and the fixed step of a scheme
Columns = dict[str, AnyArray]
# what a trajectory is of: a model, or its pair with a friction law
PlanLaw = ForceModel | Pair
# a mask of the trajectories of a range that are reused from another result, and the results of these
ReusedPart = tuple[Mask, Record]


@dataclass(frozen=True)
class TrajectoryMap:
    """The trajectories of a model or a pair, and the trajectory of each point of the grid.

    Parameters
    ----------
    model : index of the law in the plan, see `Plan.laws`
    axes : the axes of the grid on which the values of the law depend
    shape : their sizes; a cell is an index into these axes
    first : the first cell of each trajectory, shape (count,); None if each cell has its own trajectory
    of_cell : the trajectory of each cell, shape (cells,); None if each cell has its own trajectory
    record : what its trajectories are, collisions or tangential motions
    """

    model: int
    axes: tuple[int, ...]
    shape: tuple[int, ...]
    first: Indices | None = None
    of_cell: NDArray[np.int32] | None = None
    record: type[Record] = CollisionResult

    @property
    def cells(self) -> int:
        return math.prod(self.shape)

    @property
    def count(self) -> int:
        return self.cells if self.first is None else self.first.size

    @property
    def is_shared(self) -> bool:
        """Whether several cells may take one trajectory."""
        return self.of_cell is not None

    def index_along(self, cells: Indices) -> dict[int, Indices]:
        """Convert cells to indices along each axis on which the values of the law depend."""
        return dict(zip(self.axes, index_of(cells, self.shape), strict=True))

    def rows(self, index: Index) -> Indices:
        """Look up the trajectories of cells; of length 1 along axes on which they do not depend."""
        cell = np.zeros((1,) * dimensions(index), np.intp)
        for axis, size in zip(self.axes, self.shape, strict=True):
            cell = cell * size + index[axis]
        return cell if self.of_cell is None else self.of_cell[cell].astype(np.intp)


@dataclass(frozen=True)
class TrajectoryRange:
    """Trajectories `start` to `stop` of a model or a pair, a law of the plan; `number` counts its ranges."""

    number: int
    model: int
    start: int
    stop: int
    record: type[Record] = CollisionResult

    @property
    def size(self) -> int:
        return self.stop - self.start

    @property
    def rows(self) -> Indices:
        """The numbers of its trajectories among those of the model."""
        return np.arange(self.start, self.stop)


def model_of(law: PlanLaw) -> ForceModel:
    """The contact force model of a law of a plan."""
    return law.model if isinstance(law, Pair) else law


def keys_of(law: PlanLaw) -> tuple[str, ...]:
    """The key of a model, or the keys of the model and the friction law of a pair."""
    return (law.model.key, law.friction.key) if isinstance(law, Pair) else (law.key,)


def law_axes(inputs: Inputs, law: PlanLaw, collapse: bool) -> tuple[int, ...]:
    """Find the axes on which a law and its fixed step depend; all of its axes without `collapse`."""
    if not collapse:
        return inputs.axes_of_law(*keys_of(law))
    _, values, status = _values_at(inputs, law, _probe_index(inputs, law))
    return tuple(sorted(axes_of_arrays([status, *values.values()])))


def build_map(inputs: Inputs, number: int, law: PlanLaw, collapse: bool) -> TrajectoryMap:
    """Find the distinct trajectories of a law, which has this number in the plan."""
    axes = law_axes(inputs, law, collapse)
    shape = tuple(inputs.shape[axis] for axis in axes)
    record = TangentialResult if isinstance(law, Pair) else CollisionResult
    trajectory_map = TrajectoryMap(number, axes, shape, record=record)
    if not collapse or trajectory_map.cells > MAX_CELLS:
        return trajectory_map
    # the other axes are at their first value
    shape = tuple(size if axis in axes else 1 for axis, size in enumerate(inputs.shape))
    columns = columns_at(inputs, law, axes, np.ix_(*map(np.arange, shape)))
    first, of_cell = deduplicate(list(columns.values()), shape or (1,))
    return replace(trajectory_map, first=first, of_cell=of_cell.astype(np.int32))


def trajectory_ranges(maps: Sequence[TrajectoryMap], size: int = RANGE_TRAJECTORIES) -> Iterator[TrajectoryRange]:
    """Divide all trajectories, in order, into ranges of at most `size`."""
    number = 0
    for trajectory_map in maps:
        step = even_size(trajectory_map.count, size)
        for start in range(0, trajectory_map.count, step):
            stop = min(start + step, trajectory_map.count)
            yield TrajectoryRange(number, trajectory_map.model, start, stop, trajectory_map.record)
            number += 1


def even_size(count: int, most: int) -> int:
    """Divide `count` evenly into ranges of at most `most`, since a small last range would be slow; their size.

    >>> even_size(20_000, 16_384), even_size(100, 16_384)
    (10000, 100)
    """
    return -(-count // -(-count // most))


def columns_at(inputs: Inputs, law: PlanLaw, axes: Sequence[int], index: Index) -> Columns:
    """Build the problems of a law at cells, arrays that broadcast; only inputs along `axes` are checked."""
    model = model_of(law)
    probed = checked_arrays(build_impacts(inputs, model, _probe_index(inputs, model)))
    checks = frozenset(check for check in CHECKS if axes_of_arrays(probed[check]) <= {*axes})
    impacts, values, own_status = _values_at(inputs, law, index)
    with np.errstate(all="ignore"):
        status = check_inputs(model, impacts, checks)
    # in this order: that of trajectories follows from it
    return {"n": values.pop("n"), "status": np.where(status == STATUS_OK, own_status, status), **values}


def _values_at(inputs: Inputs, law: PlanLaw, index: Index) -> tuple[Impacts, Columns, Int8Array]:
    """Build the impacts of a law at cells, with their problems, and the status by friction alone."""
    model = model_of(law)
    impacts, status = build_impacts(inputs, model, index), np.full((1,) * dimensions(index), STATUS_OK, np.int8)
    with np.errstate(all="ignore"):
        values = {"n": impacts.n, **dimensionless_values(model, impacts), **fixed_steps_at(inputs, impacts, index)}
        # the friction law that changes the normal motion of a model in the scheme of the inputs
        is_coupled = {"phase", f"friction.{MUJOCO_ELLIPTIC.key}.impratio"} <= {*inputs.names()}
        if is_coupled or isinstance(law, Pair):
            pair = law if isinstance(law, Pair) else Pair(law, MUJOCO_ELLIPTIC)
            oblique = build_oblique(inputs, impacts, index, pair.friction)
            values |= friction_values(pair, oblique)
            status = check_friction(pair, oblique)
    return impacts, values, status


def probe_index(inputs: Inputs, swept_names: Iterable[str] = ()) -> Index:
    """Cells at two values of every axis, and at all values of the axes on which some names vary.

    Values computed there have length 1 along the axes on which they do not depend: the shape shows which.
    """
    names = (*swept_names, "inertia_factor1", "inertia_factor2")
    full_axes = {axis for name in names for axis in inputs.axes_of(name)}

    def positions_on(axis: int, size: int) -> Indices:
        if axis in full_axes:
            return np.arange(size)
        # beside a wall, a plane or another factor of inertia the masses may or may not change m_t/m
        sizes = (name for name in ("m1", "m2", "R1", "R2") if axis in inputs.axes_of(name))
        infinite = sum(np.isinf(inputs.values(name)) * np.int8(2**bit) for bit, name in enumerate(sizes))
        return np.union1d(np.unique(infinite, return_index=True)[1], np.arange(min(size, 2)))

    return np.ix_(*(positions_on(axis, size) for axis, size in enumerate(inputs.shape)))


def axes_of_arrays(arrays: Iterable[AnyArray]) -> frozenset[int]:
    """Find the axes along which any of the arrays varies; the arrays have as many axes as the grid."""
    return frozenset(axis for array in arrays for axis, size in enumerate(array.shape) if size > 1)


def checked_arrays(impacts: Impacts) -> Mapping[str, list[AnyArray]]:
    """List the arrays on which each check of `check_inputs` depends."""
    with np.errstate(all="ignore"):
        scales = [impacts.v0, impacts.length, impacts.energy, impacts.time]
    return {"e": [impacts.e], "v0": [impacts.v0], "length": scales}


def _probe_index(inputs: Inputs, law: PlanLaw) -> Index:
    model = model_of(law)
    # an exponent of a unit may be zero at some values, where the unit drops out: all values of exponents are used
    names = exponent_names(model)
    exponents = {"n", *names, *(f"{model.key}.{name}" for name in names)}
    return probe_index(inputs, exponents)
