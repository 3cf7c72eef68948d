"""The distinct trajectories of a plan: points with the same dimensionless problem share one trajectory.

The values of a law depend only on some of the axes. They are evaluated on the cells, the product of those axes; up
to MAX_CELLS cells, equal values are found in the whole plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.deduplicate import deduplicate
from ..contact.dimensionless import dimensionless_values, exponent_names
from ..contact.impacts import CHECKS, check_inputs
from ..contact.model import ForceModel
from .build_impacts import build_impacts, fixed_steps_at
from .inputs import Index, Inputs, dimensions

# cells up to which equal values are found in the whole plan; with more, only within a range of trajectories
MAX_CELLS = 2**22
# trajectories integrated at a time: many, to amortise the interpreter's overhead, and few enough to stay in cache
RANGE_TRAJECTORIES = 32768

# the dimensionless problems of trajectories: the exponent `n`, the `status` after the checks of inputs, and by
# name the arguments of the law and the fixed step of a scheme
Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class TrajectoryMap:
    """The trajectories of a model, and the trajectory of each point of the grid.

    Parameters
    ----------
    model : index of the model in the plan
    axes : the axes of the grid on which the values of the law depend
    shape : their sizes; a cell is an index into these axes
    first : the first cell of each trajectory, shape (count,); None if each cell has its own trajectory
    of_cell : the trajectory of each cell, shape (cells,); None if each cell has its own trajectory
    """

    model: int
    axes: tuple[int, ...]
    shape: tuple[int, ...]
    first: NDArray[np.intp] | None = None
    of_cell: NDArray[np.int32] | None = None

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

    def rows(self, index: Index) -> NDArray[np.intp]:
        """Look up the trajectories of cells; of length 1 along axes on which they do not depend."""
        cell = np.zeros((1,) * dimensions(index), np.intp)
        for axis, size in zip(self.axes, self.shape, strict=True):
            cell = cell * size + index[axis]
        return cell if self.of_cell is None else self.of_cell[cell].astype(np.intp)


@dataclass(frozen=True)
class TrajectoryRange:
    """Trajectories `start` to `stop` of a model; `number` counts the ranges of a plan."""

    number: int
    model: int
    start: int
    stop: int

    @property
    def size(self) -> int:
        return self.stop - self.start

    @property
    def rows(self) -> NDArray[np.intp]:
        """The numbers of its trajectories among those of the model."""
        return np.arange(self.start, self.stop)


def law_axes(inputs: Inputs, model: ForceModel, collapse: bool) -> tuple[int, ...]:
    """Find the axes on which a law and its fixed step depend; all axes of the model without `collapse`."""
    if not collapse:
        return inputs.axes_of_model(model.key)
    index = _probe_index(inputs, model)
    impacts = build_impacts(inputs, model, index)
    with np.errstate(all="ignore"):
        values = dimensionless_values(model, impacts) | fixed_steps_at(inputs, impacts, index)
        return tuple(sorted(axes_of_arrays([impacts.n, *values.values()])))


def build_map(inputs: Inputs, number: int, model: ForceModel, collapse: bool) -> TrajectoryMap:
    """Find the distinct trajectories of a model, which has this number in the plan."""
    axes = law_axes(inputs, model, collapse)
    trajectory_map = TrajectoryMap(number, axes, tuple(inputs.shape[axis] for axis in axes))
    if not collapse or trajectory_map.cells > MAX_CELLS:
        return trajectory_map
    # the other axes are at their first value
    shape = tuple(size if axis in axes else 1 for axis, size in enumerate(inputs.shape))
    columns = columns_at(inputs, model, axes, np.ix_(*map(np.arange, shape)))
    first, of_cell = deduplicate(list(columns.values()), shape or (1,))
    return replace(trajectory_map, first=first, of_cell=of_cell.astype(np.int32))


def trajectory_ranges(maps: Sequence[TrajectoryMap], size: int = RANGE_TRAJECTORIES) -> Iterator[TrajectoryRange]:
    """Divide all trajectories, in order, into ranges of at most `size`."""
    number = 0
    for trajectory_map in maps:
        step = even_size(trajectory_map.count, size)
        for start in range(0, trajectory_map.count, step):
            yield TrajectoryRange(number, trajectory_map.model, start, min(start + step, trajectory_map.count))
            number += 1


def even_size(count: int, most: int) -> int:
    """Divide `count` evenly into ranges of at most `most`, since a small last range would be slow; their size.

    >>> even_size(20_000, 16_384), even_size(100, 16_384)
    (10000, 100)
    """
    return -(-count // -(-count // most))


def columns_at(inputs: Inputs, model: ForceModel, axes: Sequence[int], index: Index) -> Columns:
    """Build the problems of a model at cells, arrays that broadcast; only inputs along `axes` are checked."""
    impacts = build_impacts(inputs, model, index)
    with np.errstate(all="ignore"):
        checks = frozenset(check for check, varying in axes_of_checks(inputs, model).items() if varying <= {*axes})
        return {
            "n": impacts.n,
            "status": check_inputs(model, impacts, checks),
            **dimensionless_values(model, impacts),
            **fixed_steps_at(inputs, impacts, index),
        }


def probe_index(inputs: Inputs, swept_names: Iterable[str] = ()) -> Index:
    """Cells at two values of every axis, and at all values of the axes on which some names vary.

    Values computed there have length 1 along the axes on which they do not depend: the shape shows which.
    """
    full_axes = {axis for name in swept_names for axis in inputs.axes_of(name)}
    sizes = (size if axis in full_axes else min(size, 2) for axis, size in enumerate(inputs.shape))
    return np.ix_(*map(np.arange, sizes))


def axes_of_arrays(arrays: Iterable[NDArray[Any]]) -> frozenset[int]:
    """Find the axes along which any of the arrays varies; the arrays have as many axes as the grid."""
    return frozenset(axis for array in arrays for axis, size in enumerate(array.shape) if size > 1)


def axes_of_checks(inputs: Inputs, model: ForceModel) -> Mapping[str, frozenset[int]]:
    """Find the axes on which each check of `check_inputs` depends."""
    impacts = build_impacts(inputs, model, _probe_index(inputs, model))
    with np.errstate(all="ignore"):
        checked_arrays = {
            "e": [impacts.e],
            "v0": [impacts.v0],
            "length": [impacts.length, impacts.energy, impacts.time],
        }
    return {check: axes_of_arrays(checked_arrays[check]) for check in CHECKS}


def _probe_index(inputs: Inputs, model: ForceModel) -> Index:
    # an exponent of a unit may be zero at some values, where the unit drops out: all values of exponents are used
    names = exponent_names(model)
    exponents = {"n", *names, *(f"{model.key}.{name}" for name in names)}
    return probe_index(inputs, exponents)
