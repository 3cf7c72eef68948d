"""One step of the pair for many lanes, elementwise and in a fixed order."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from .problem import COMPONENTS, INTEGRATED, WATCHED, Array, Columns, Problem
from .tableau import A, E

Nested = tuple[tuple[int, Array], ...]


def _nested(row: tuple[Fraction, ...]) -> Nested:
    """A row of weights for `_weighted`: each relative to the next, zeros left out."""
    places = [place for place, weight in enumerate(row) if weight]
    following = [*(row[place] for place in places[1:]), Fraction(1)][: len(places)]
    ratios = (float(row[place] / other) for place, other in zip(places, following, strict=True))
    # as arrays: a product with a float begins later
    return tuple((place, np.array(ratio)) for place, ratio in zip(places, ratios, strict=True))


STAGES, ERROR = tuple(map(_nested, A[1:])), _nested(E)
# rows that are wanted of the rates at each stage: the second has no part in the solution
ROWS = (WATCHED + 1, COMPONENTS, INTEGRATED, INTEGRATED, INTEGRATED, INTEGRATED, WATCHED + 1)

# an array that comes and goes: the C library (glibc) then keeps up to twice as much of what is freed for what
# comes next, where it would else return it to the system every few steps; the first use of new memory is slow
np.empty(1 << 21)


@dataclass
class Space:
    """Room for the rows and rates of lanes, and for one attempt: later stages, the rows at its end, three more."""

    y: Array
    k: Array
    stages: list[Array]
    new: Array
    part: Array
    scale: Array
    term: Array

    @classmethod
    def of(cls, n: int) -> Space:
        """Room for n lanes, in one block of memory."""
        rows = (INTEGRATED, WATCHED + 1, *ROWS[1:], INTEGRATED, COMPONENTS, COMPONENTS, COMPONENTS)
        block = np.empty((sum(rows), n))
        y, k, *stages, new, part, scale, term = np.split(block, np.cumsum(rows)[:-1])
        return cls(y, k, stages, new, part, scale, term)

    def narrow(self, n: int) -> Space:
        """The same memory for fewer lanes."""
        stages = [narrow(stage, n) for stage in self.stages]
        ends = (narrow(room, n) for room in (self.new, self.part, self.scale, self.term))
        return Space(narrow(self.y, n), narrow(self.k, n), stages, *ends)


def narrow(room: Array, n: int) -> Array:
    """The memory of an array of rows, for rows of n."""
    return room.reshape(-1)[: len(room) * n].reshape(len(room), n)


def attempt(
    problem: Problem, y: Array, k: Array, h: Array, columns: Columns, space: Space
) -> tuple[Array, list[Array]]:
    """One step of length h from rows y whose rates are k: the rows at its end and the seven stages, in `space`."""
    stages, slopes = [k], [k[:COMPONENTS]]
    part, new, start = space.part, space.new, y[:COMPONENTS]
    for weights, room in zip(STAGES[:-1], space.stages[:-1], strict=True):
        _weighted(weights, slopes, part)
        np.multiply(part, h, part)
        np.add(part, start, part)
        stages.append(problem.rates(part, columns, room))
        slopes.append(stages[-1][:COMPONENTS])
    _weighted(STAGES[-1], [stage[:INTEGRATED] for stage in stages], new)
    np.multiply(new, h, new)
    np.add(new, y, new)
    stages.append(problem.rates(new[:COMPONENTS], columns, space.stages[-1]))
    return new, stages


def _weighted(weights: Nested, stages: list[Array], total: Array) -> None:
    """The weighted sum of the stages, in order, by Horner's scheme: it needs no room for terms."""
    (first, weight), *rest = weights
    np.multiply(stages[first], weight, total)
    for stage, weight in rest:
        np.add(total, stages[stage], total)
        np.multiply(total, weight, total)


def local_error(problem: Problem, stages: list[Array], y: Array, new: Array, h: Array, space: Space) -> Array:
    """The larger of the local errors of the two components, relative to max(|y|, floor); shape (n,)."""
    error = space.part
    _weighted(ERROR, [stage[:COMPONENTS] for stage in stages], error)
    np.multiply(error, h, error)
    np.abs(error, error)
    scale = np.abs(y[:COMPONENTS], space.scale)
    np.maximum(scale, np.abs(new[:COMPONENTS], space.term), out=scale)
    for row, floor in zip(scale, problem.floor, strict=True):
        np.maximum(row, floor, out=row)
    np.divide(error, scale, error)
    return np.asarray(np.maximum(error[0], error[1], out=error[0]))
