"""The points of a plan, from its finished trajectories: box after box of the grid, in order."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.collide import Contact
from ..contact.strike import Rebound
from .build_impacts import lanes_of
from .plan import Index, Plan
from .trajectories import Trajectories

# points of a box: enough to pay for the interpreter, few enough to stay in cache and in little memory
BOX = 2**17

# what became of the trajectories of a model, by its place, that have some numbers
Rows = Callable[[int, NDArray[np.intp]], Rebound]


@dataclass(frozen=True)
class Box:
    """Points of one model that lie side by side in C order; `where` are their places on the axes."""

    model: int
    where: tuple[slice, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        return tuple(one.stop - one.start for one in self.where)

    @property
    def size(self) -> int:
        return math.prod(self.shape)

    @property
    def index(self) -> Index:
        """The places as arrays, one along each axis."""
        return np.ix_(*(np.arange(one.start, one.stop) for one in self.where))


def boxes(models: int, shape: Sequence[int], size: int = BOX) -> Iterator[Box]:
    """All points in C order, in boxes of about `size`.

    >>> [box.where for box in boxes(1, (2, 3), 2)][:2]
    [(slice(0, 1, None), slice(0, 2, None)), (slice(0, 1, None), slice(2, 3, None))]
    """
    # the axes after `along` are whole in every box, those before it have one place
    along = next((at for at in range(len(shape)) if math.prod(shape[at + 1 :]) <= size), 0)
    whole = tuple(slice(0, one) for one in shape[along + 1 :])
    step = max(1, size // math.prod(shape[along + 1 :]))
    for model in range(models):
        if not shape:
            yield Box(model, ())
        for before in np.ndindex(*shape[:along]) if shape else ():
            fixed = tuple(slice(at, at + 1) for at in before)
            for start in range(0, shape[along], step):
                yield Box(model, (*fixed, slice(start, min(start + step, shape[along])), *whole))


def boxes_of(models: int, shape: Sequence[int], lengths: Sequence[int], size: int = BOX) -> Iterator[Box]:
    """All points, in boxes of whole pieces of some lengths along the axes, as many as make up about `size`.

    >>> [box.where for box in boxes_of(1, (2, 4), (2, 2), 4)]
    [(slice(0, 2, None), slice(0, 2, None)), (slice(0, 2, None), slice(2, 4, None))]
    """
    wide = list(lengths)
    for axis in reversed(range(len(shape))):
        room = max(1, size // math.prod(wide))
        wide[axis] = min(wide[axis] * room, shape[axis])
    steps = [range(0, whole, step) for whole, step in zip(shape, wide, strict=True)]
    for model in range(models):
        for start in itertools.product(*steps):
            ends = (min(at + step, whole) for at, step, whole in zip(start, wide, shape, strict=True))
            yield Box(model, tuple(slice(at, end) for at, end in zip(start, ends, strict=True)))


def contact_at(plan: Plan, found: Sequence[Trajectories], rows: Rows, box: Box) -> Contact:
    """The outputs of the points of a box, of shapes that broadcast to the box's; a plan without axes has one."""
    model, index = plan.models[box.model], box.index
    rebound = rows(box.model, found[box.model].numbers(index))
    return Contact(model, lanes_of(plan, model, index), rebound)
