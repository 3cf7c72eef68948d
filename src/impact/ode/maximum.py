"""The maximum of the watched quantity, at or beside the largest value at the end of a step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .problem import COMPONENTS, INTEGRATED, WATCHED, Array, Columns, Mask, Problem
from .step import Space, attempt

if TYPE_CHECKING:
    from .lanes import Lanes, Trial

# step of the difference that gives the slope of the watched quantity, relative to the step beside it
DIFFERENCE = 1e-5
# a slope that over that step is less than this of the value is none
FLAT = 1e-10
# a maximum is flat, so that a crude location of it is enough
GUESSES = 2


@dataclass(frozen=True)
class Top:
    """Where the watched quantity was largest at a step's end, shape (2, n), and the steps behind and ahead."""

    y: Array
    behind: Array
    ahead: Array

    @classmethod
    def of(cls, start: Array) -> Top:
        """The starts, beside which there is no step yet."""
        return cls(start.copy(), np.zeros(start.shape[1]), np.zeros(start.shape[1]))

    def put(self, where: NDArray[np.intp], y: Array, behind: Array, ahead: Array | float) -> None:
        """Write down new ones at their places."""
        for row, mine in zip(self.y, y, strict=True):
            row[where] = mine
        self.behind[where], self.ahead[where] = behind, ahead


def watch(lanes: Lanes, trial: Trial, accepted: Mask, home: NDArray[np.intp]) -> None:
    """Note where the watched quantity begins to fall, or a lane lands, above all that was noted before."""
    seen, watched = lanes.k[WATCHED], trial.k[WATCHED]
    at = ((watched < seen) & accepted & (seen > lanes.best)).nonzero()[0]
    if at.size:
        lanes.best[at] = seen[at]
        lanes.top.put(lanes.index[at], lanes.y[:COMPONENTS, at], lanes.last[at], lanes.h[at])
    home = home[watched[home] > lanes.best[home]]
    if home.size:
        lanes.best[home] = watched[home]
        lanes.top.put(lanes.index[home], trial.new[:COMPONENTS, home], lanes.h[home], 0.0)


def search(problem: Problem, columns: Columns, top: Top, best: Array, space: Space) -> None:
    """Raise the values at the tops, shape (n,), to the maxima beside them.

    The secant rule finds where the slope along the trajectory vanishes, by true steps from the top into the step
    that is ahead of it or, where it falls there already, back into the one behind.
    """
    small = DIFFERENCE * np.maximum(top.behind, top.ahead)

    def slope(y: Array, k: Array) -> Array:
        ahead = problem.rates(y[:COMPONENTS] + small * k[:COMPONENTS], columns)
        return np.asarray((ahead[WATCHED] - k[WATCHED]) / small)

    k = problem.rates(top.y, columns, space.k)
    d_top = slope(top.y, k)
    h = np.where(d_top > 0.0, top.ahead, -top.behind)
    at = np.flatnonzero(np.abs(d_top * h) > FLAT * np.abs(best))
    if not at.size:
        return
    small, columns, space = small[at], tuple(column[at] for column in columns), space.narrow(at.size)
    h, k, d_top = h[at], k.take(at, 1), d_top[at]
    y = np.zeros((INTEGRATED, at.size))
    y[:COMPONENTS] = top.y[:, at]

    def slope_after(part: Array) -> Array:
        new, stages = attempt(problem, y, k, part * h, columns, space)
        best[at] = np.fmax(best[at], stages[-1][WATCHED])
        return slope(new, stages[-1])

    left, right = np.zeros(at.size), np.ones(at.size)
    d_left, d_right = d_top, slope_after(right)
    for _ in range(GUESSES):
        guess = right - d_right * (right - left) / (d_right - d_left)
        guess = np.where((guess >= 0.0) & (guess <= 1.0), guess, right)
        left, d_left, right, d_right = right, d_right, guess, slope_after(guess)
