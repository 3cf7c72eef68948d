"""The trajectories of a plan: which points are the same physics, and what is to be integrated once for them.

A law's values come from some of the axes only. Over the product of those, the cells, they are evaluated; where
the cells are not too many, equal values are found over the whole plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.deduplicate import deduplicate
from ..contact.impacts import CHECKS, Impacts, check_inputs
from ..contact.model import ForceModel
from ..contact.scaling import dimensionless_values, exponent_names
from ..errors import UsageError
from ..text import safe_text
from .build_impacts import build_impacts
from .plan import Index, Inputs, Plan, dimensions

# cells up to which equal values are found over the whole plan; beyond, within a range of trajectories
MAX_CELLS = 2**22
# trajectories that are integrated at a time: enough to pay for the interpreter, few enough to stay in cache
RANGE_TRAJECTORIES = 32768

# the dimensionless problems of some trajectories: the exponent `n`, the `status` that is known beforehand, and by
# name what the law asks for
Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class TrajectoryMap:
    """The trajectories of a model, and which of them each point of the grid takes.

    Parameters
    ----------
    model : its place in the plan
    axes : the axes of the grid that the law's values come from
    shape : their sizes; a cell is a place on these axes
    first : the cell from which each trajectory is taken, shape (count,); None where every cell is one of its own
    of_cell : the trajectory of each cell, shape (cells,); None likewise
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
        """The trajectories at some places of the grid; of length one along the axes on which they do not vary."""
        cell = np.zeros((1,) * dimensions(index), np.intp)
        for axis, size in zip(self.axes, self.shape, strict=True):
            cell = cell * size + index[axis]
        return cell if self.of_cell is None else self.of_cell[cell].astype(np.intp)


@dataclass(frozen=True)
class TrajectoryRange:
    """The trajectories of a model from one to another; `number` counts the ranges of a plan."""

    number: int
    model: int
    start: int
    stop: int

    @property
    def size(self) -> int:
        return self.stop - self.start


def trajectory_maps(plan: Plan) -> tuple[TrajectoryMap, ...]:
    """The trajectories of every model of a plan, in its order."""
    return tuple(_map_of(plan, place, model) for place, model in enumerate(plan.models))


def check_count(plan: Plan, most: int, name: str) -> None:
    """Refuse a plan of more trajectories than some, before there is an array of them.

    Raises
    ------
    UsageError : so it is; `name` is that of the config, for the message
    """
    if plan.points <= most:
        return
    total = 0
    for model in plan.models:
        collapse = plan.config.solver.collapse
        axes = axes_of_law(plan.inputs, model) if collapse else plan.inputs.axes_of_model(model.key)
        # what is the same is found where the cells are not too many
        cells = math.prod(plan.shape[axis] for axis in axes)
        total += cells if cells > MAX_CELLS else 0
    if total > most:
        raise UsageError(
            f"{safe_text(name)}: sweep: got {total:,} trajectories to integrate, expected at most {most:,} "
            "(--max-points)"
        )


def _map_of(plan: Plan, place: int, model: ForceModel) -> TrajectoryMap:
    collapse = plan.config.solver.collapse
    axes = axes_of_law(plan.inputs, model) if collapse else plan.inputs.axes_of_model(model.key)
    found = TrajectoryMap(place, axes, tuple(plan.shape[axis] for axis in axes))
    if not collapse or found.cells > MAX_CELLS:
        return found
    # the other axes are at their first value
    shape = tuple(size if axis in axes else 1 for axis, size in enumerate(plan.shape))
    columns = columns_at(plan, model, axes, np.ix_(*map(np.arange, shape)))
    first, of_cell = deduplicate(list(columns.values()), shape or (1,))
    return replace(found, first=first, of_cell=of_cell.astype(np.int32))


def trajectory_ranges(maps: Sequence[TrajectoryMap], size: int = RANGE_TRAJECTORIES) -> Iterator[TrajectoryRange]:
    """All trajectories in order, in ranges of at most `size`."""
    number = 0
    for own in maps:
        step = even_size(own.count, size)
        for start in range(0, own.count, step):
            yield TrajectoryRange(number, own.model, start, min(start + step, own.count))
            number += 1


def even_size(count: int, most: int) -> int:
    """The size of ranges of at most so many that share a number evenly: a small last one would cost too much.

    >>> even_size(20_000, 16_384), even_size(100, 16_384)
    (10000, 100)
    """
    return -(-count // -(-count // most))


def columns_of(plan: Plan, maps: Sequence[TrajectoryMap], part: TrajectoryRange) -> Columns:
    """What is integrated of a range of trajectories, arrays of shape (part.size,)."""
    own, model = maps[part.model], plan.models[part.model]
    cells = np.arange(part.start, part.stop)
    if own.first is not None:
        cells = own.first[cells]
    along = dict(zip(own.axes, np.unravel_index(cells, own.shape) if own.shape else (), strict=True))
    # the other axes are at their first value
    index = tuple(along.get(axis, np.zeros(1, np.intp)) for axis in range(len(plan.shape)))
    columns = columns_at(plan, model, own.axes, index)
    return {name: np.broadcast_to(values, cells.shape).copy() for name, values in columns.items()}


def columns_at(plan: Plan, model: ForceModel, axes: Sequence[int], index: Index) -> Columns:
    """The dimensionless problems of a model at some places of the grid, arrays that broadcast against each other.

    Parameters
    ----------
    plan, model : whose problems
    axes : the axes that the law's values come from; what varies along others is not checked here
    index : the places
    """
    impacts = build_impacts(plan.inputs, model, index)
    with np.errstate(all="ignore"):
        checks = frozenset(
            check for check, varying in axes_of_checks(plan.inputs, model).items() if varying <= {*axes}
        )
        return {
            "n": impacts.n,
            "status": check_inputs(model, impacts, checks),
            **dimensionless_values(model, impacts),
        }


def probe_index(inputs: Inputs, whole: Iterable[str] = ()) -> Index:
    """Two places of every axis, but all of an axis on which some names vary.

    What is computed there has length one along an axis on which it does not depend: the shape tells.
    """
    kept = {axis for name in whole for axis in inputs.axes_of(name)}
    return np.ix_(*(np.arange(size if axis in kept else min(size, 2)) for axis, size in enumerate(inputs.shape)))


def axes_of_arrays(arrays: Iterable[NDArray[Any]]) -> frozenset[int]:
    """The axes along which any of some arrays of as many axes as the grid varies."""
    return frozenset(axis for array in arrays for axis, size in enumerate(array.shape) if size > 1)


def axes_of_law(inputs: Inputs, model: ForceModel) -> tuple[int, ...]:
    """The axes that the values of a law come from."""
    impacts = _probed(inputs, model)
    with np.errstate(all="ignore"):
        return tuple(sorted(axes_of_arrays([impacts.n, *dimensionless_values(model, impacts).values()])))


def axes_of_checks(inputs: Inputs, model: ForceModel) -> Mapping[str, frozenset[int]]:
    """The axes that each check of `check_inputs` comes from."""
    impacts = _probed(inputs, model)
    with np.errstate(all="ignore"):
        looked_at = {
            "e": [impacts.e],
            "v0": [impacts.v0],
            "length": [impacts.length, impacts.energy, impacts.time],
        }
    return {check: axes_of_arrays(looked_at[check]) for check in CHECKS}


def _probed(inputs: Inputs, model: ForceModel) -> Impacts:
    # an exponent may be zero by its value, and then leaves a unit out: all values of those are looked at
    names = exponent_names(model)
    return build_impacts(inputs, model, probe_index(inputs, {"n", *names, *(f"{model.key}.{n}" for n in names)}))
