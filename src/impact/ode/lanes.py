"""The lanes that still run, side by side, and what becomes of those that have ended."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .maximum import Top
from .problem import COMPONENTS, Array, Columns, End, Mask, Outcome, Problem
from .step import Space, narrow

RUNNING, LANDED = int(End.RUNNING), int(End.LANDED)


@dataclass
class Lanes:
    """The lanes still running, in arrays that are compacted together; the last axis is the lane.

    `h` is the length of the next step, `last` that of the one before. `best` is the largest watched value at the
    end of a step from which it fell or at which the lane landed; `top`, of all lanes, is where that was.
    """

    index: NDArray[np.intp]
    columns: Columns
    y: Array
    k: Array
    h: Array
    last: Array
    halvings: NDArray[np.int8]
    steps: NDArray[np.int32]
    end: NDArray[np.int8]
    best: Array
    top: Top
    space: Space

    @classmethod
    def begin(cls, problem: Problem, start: Array, columns: Columns, space: Space, first_step: float) -> Lanes:
        """All lanes at their start, with room for as many; what the start does not tell of them is zero."""
        n = start.shape[1]
        y, k = space.y, space.k
        y[: len(start)], y[len(start) :] = start, 0.0
        start = start[:COMPONENTS]
        np.copyto(k, problem.rates(start, columns, k))
        return cls(
            index=np.arange(n),
            columns=columns,
            y=y,
            k=k,
            h=np.full(n, first_step),
            last=np.zeros(n),
            halvings=np.zeros(n, np.int8),
            steps=np.zeros(n, np.int32),
            end=np.full(n, RUNNING, np.int8),
            best=np.full(n, -np.inf),
            top=Top.of(start),
            space=space,
        )

    def put(self, outcome: Outcome) -> None:
        """Write down how the lanes that have ended did so."""
        at = np.flatnonzero(self.end != RUNNING)
        where, end = self.index[at], self.end[at]
        for row, mine in zip(outcome.state, self.y, strict=True):
            row[where] = np.where(end == LANDED, mine[at], np.nan)
        outcome.maximum[where] = np.where(end == LANDED, self.best[at], np.nan)
        outcome.steps[where], outcome.end[where] = self.steps[at], end

    def compacted(self) -> Lanes:
        """Those that still run, in the same memory: what is kept of a room goes to the other of its pair."""
        kept = np.flatnonzero(self.end == RUNNING)
        space = self.space.narrow(kept.size)
        y = self.y.take(kept, 1, space.new, "clip")
        k = self.k.take(kept, 1, space.stages[-1], "clip")
        space.new, space.stages[-1] = narrow(self.y, kept.size), narrow(self.k, kept.size)
        return Lanes(
            index=self.index[kept],
            columns=tuple(column[kept] for column in self.columns),
            y=y,
            k=k,
            h=self.h[kept],
            last=self.last[kept],
            halvings=self.halvings[kept],
            steps=self.steps[kept],
            end=self.end[kept],
            best=self.best[kept],
            top=self.top,
            space=space,
        )


@dataclass(frozen=True)
class Trial:
    """A step tried in all lanes: rows and rates at its end, whether it is accepted, and the next step's length."""

    new: Array
    k: Array
    within: Mask
    following: Array
