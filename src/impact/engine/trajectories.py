"""The trajectories of a plan: which points are the same physics, and what is to be integrated once for them.

A law's values come from some of the axes only. Over the product of those, the cells, they are evaluated; where
the cells are not too many, equal values are found over the whole plan.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.collide import first_look
from ..contact.model import ForceModel
from ..contact.power import Array
from ..contact.values import made_of, own_values
from .blocks import Block
from .build_impacts import exponents, lanes_of, origins
from .plan import Index, Plan

# cells up to which equal values are found over the whole plan; beyond, within a block
MOST_CELLS = 2**22
# trajectories of a block: enough to pay for the interpreter, few enough to stay in cache
BLOCK = 32768


@dataclass(frozen=True)
class Trajectories:
    """The trajectories of a model, and which of them each cell takes.

    Parameters
    ----------
    model : its place in the plan
    axes : places of the axes that the law's values come from
    shape : their sizes
    first : the cell from which each trajectory is taken, shape (count,); None where every cell is one of its own
    back : the trajectory of each cell, shape (cells,); None likewise
    """

    model: int
    axes: tuple[int, ...]
    shape: tuple[int, ...]
    first: NDArray[np.intp] | None = None
    back: NDArray[np.int32] | None = None

    @property
    def cells(self) -> int:
        return math.prod(self.shape)

    @property
    def count(self) -> int:
        return self.cells if self.first is None else self.first.size

    def numbers(self, index: Index) -> NDArray[np.intp]:
        """The trajectories at some places of the grid; of length one along the axes on which they do not vary."""
        cell = np.zeros((1,) * (index[0].ndim if index else 1), np.intp)
        for place, size in zip(self.axes, self.shape, strict=True):
            cell = cell * size + index[place]
        return cell if self.back is None else self.back[cell].astype(np.intp)


@dataclass(frozen=True)
class Stretch:
    """Some trajectories of a model, from one to another; `number` counts the stretches of a plan."""

    number: int
    model: int
    start: int
    stop: int

    @property
    def size(self) -> int:
        return self.stop - self.start


def trajectories(plan: Plan) -> tuple[Trajectories, ...]:
    """Those of every model of a plan, in its order."""
    return tuple(_of_model(plan, place, model) for place, model in enumerate(plan.models))


def _of_model(plan: Plan, place: int, model: ForceModel) -> Trajectories:
    if not plan.config.solver.collapse:
        return Trajectories(place, tuple(range(len(plan.shape))), plan.shape)
    axes = varied(plan, model)
    found = Trajectories(place, axes, tuple(plan.shape[axis] for axis in axes))
    if found.cells > MOST_CELLS:
        return found
    # the other axes are pinned at their first value
    pinned = tuple(size if at in axes else 1 for at, size in enumerate(plan.shape))
    n, status, given = _asked(plan, model, np.ix_(*map(np.arange, pinned)))
    kind = np.zeros(1, np.intp)
    columns: tuple[NDArray[Any], ...] = (n, status, *given.values())
    for values in columns:
        kind = _kind(kind * values.size + _kind(values))
    _, first, back = np.unique(np.broadcast_to(kind, pinned or (1,)), return_index=True, return_inverse=True)
    return replace(found, first=first, back=back.reshape(-1).astype(np.int32))


def _kind(values: NDArray[Any]) -> NDArray[np.intp]:
    """A number for each value, the same where the values are, bit for bit; zero has one sign here."""
    return np.unique(values, return_inverse=True)[1].reshape(values.shape)


def stretches(found: Sequence[Trajectories], size: int = BLOCK) -> Iterator[Stretch]:
    """All trajectories in order, in stretches of at most `size`."""
    number = 0
    for one in found:
        own = even(one.count, size)
        for start in range(0, one.count, own):
            yield Stretch(number, one.model, start, min(start + own, one.count))
            number += 1


def even(count: int, most: int) -> int:
    """The size of blocks of at most so many that share a number evenly: a small last one would cost too much.

    >>> even(20_000, 16_384), even(100, 16_384)
    (10000, 100)
    """
    return -(-count // -(-count // most))


def block_of(plan: Plan, found: Sequence[Trajectories], stretch: Stretch) -> Block:
    """What is integrated of a stretch."""
    own, model = found[stretch.model], plan.models[stretch.model]
    cells = np.arange(stretch.start, stretch.stop)
    if own.first is not None:
        cells = own.first[cells]
    along = dict(zip(own.axes, np.unravel_index(cells, own.shape) if own.shape else (), strict=True))
    # the other axes are pinned at their first value
    index = tuple(along.get(axis, np.zeros(1, np.intp)) for axis in range(len(plan.shape)))
    n, status, given = _asked(plan, model, index)

    def each(values: NDArray[Any]) -> NDArray[Any]:
        return np.broadcast_to(values, cells.shape).copy()

    return Block(
        stretch.number, model.key, each(n), {name: each(one) for name, one in given.items()}, each(status)
    )


def _asked(plan: Plan, model: ForceModel, index: Index) -> tuple[Array, NDArray[np.int8], dict[str, Array]]:
    """Exponents, what is known beforehand, and the values that a law asks for, at some places of the grid."""
    lanes = lanes_of(plan, model, index)
    with np.errstate(all="ignore"):
        known = made_of(model, exponents(plan, model))
        return lanes.n, first_look(model, lanes, known), own_values(model, lanes)


def varied(plan: Plan, model: ForceModel) -> tuple[int, ...]:
    """The places of the axes that the values of a law come from."""
    names = {name for one in made_of(model, exponents(plan, model)) for name in origins(plan, model, one)}
    return tuple(place for place, axis in enumerate(plan.config.axes) if not names.isdisjoint(axis.columns))
