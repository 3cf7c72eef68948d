"""The maximum of the watched quantity, at or beside the largest value at the end of a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .events import choose
from .problem import N_COMPONENTS, N_INTEGRATED, WATCHED_ROW, Array, Mask, Params, Problem

if TYPE_CHECKING:
    from .rk45 import State, TrialStep

# step of the difference quotient for the slope of the watched quantity, relative to the step beside it
SLOPE_STEP = 1e-5
# a slope that over that step is less than this of the value counts as zero
FLAT_SLOPE = 1e-10
# a maximum is flat, so that a crude location of it is enough
SECANT_STEPS = 2

# (positions, rows, rates, lengths of the step) -> rows and rates at its end
TakeStep = Callable[[NDArray[np.intp], Array, Array, Array], tuple[Array, Array]]


@dataclass(frozen=True)
class PeakCandidate:
    """Where the watched quantity was largest at a step's end, shape (2, n), and the steps behind and ahead."""

    y: Array
    behind: Array
    ahead: Array

    @classmethod
    def of(cls, start: Array) -> PeakCandidate:
        """The starts, beside which there is no step yet."""
        return cls(start.copy(), np.zeros(start.shape[1]), np.zeros(start.shape[1]))

    def put(self, where: NDArray[np.intp], y: Array, behind: Array, ahead: Array | float) -> None:
        """Replace the candidates at some positions."""
        for row, new in zip(self.y, y, strict=True):
            row[where] = new
        self.behind[where], self.ahead[where] = behind, ahead


def begins_to_fall(before: Array, after: Array, best: Array) -> Mask:
    """Whether the watched quantity falls over a step, from a value above the best one so far."""
    return (after < before) & (before > best)


def secant_update(left: Array, d_left: Array, right: Array, d_right: Array) -> Array:
    """The root of the secant through two slopes, as a fraction of the step; the right end where it is outside."""
    root = right - d_right * (right - left) / (d_right - d_left)
    return choose((root >= 0.0) & (root <= 1.0), root, right)


def note_peaks(state: State, trial: TrialStep, accepted: Mask, ended: NDArray[np.intp]) -> None:
    """Note where the watched quantity begins to fall, or a trajectory ends, above all that was noted before."""
    before, after = state.k[WATCHED_ROW], trial.k[WATCHED_ROW]
    at = (begins_to_fall(before, after, state.best) & accepted).nonzero()[0]
    if at.size:
        state.best[at] = before[at]
        state.peak.put(state.index[at], state.y[:N_COMPONENTS, at], state.h_last[at], state.h[at])
    ended = ended[after[ended] > state.best[ended]]
    if ended.size:
        state.best[ended] = after[ended]
        state.peak.put(state.index[ended], trial.y[:N_COMPONENTS, ended], state.h[ended], 0.0)


def refine_maximum(
    problem: Problem, params: Params, peak: PeakCandidate, best: Array, take_step: TakeStep
) -> None:
    """Raise the values at the candidates, shape (n,), to the maxima beside them.

    The secant rule finds where the slope along the trajectory vanishes, by true steps from the candidate into the
    step ahead of it or, where the slope is negative there already, back into the one behind.
    """
    small = SLOPE_STEP * np.maximum(peak.behind, peak.ahead)

    def slope(y: Array, k: Array) -> Array:
        ahead = problem.rates(y[:N_COMPONENTS] + small * k[:N_COMPONENTS], params)
        return np.asarray((ahead[WATCHED_ROW] - k[WATCHED_ROW]) / small)

    k = problem.rates(peak.y, params)
    d_peak = slope(peak.y, k)
    h = np.where(d_peak > 0.0, peak.ahead, -peak.behind)
    at = np.flatnonzero(np.abs(d_peak * h) > FLAT_SLOPE * np.abs(best))
    if not at.size:
        return
    small, params = small[at], tuple(column[at] for column in params)
    h, k, d_peak = h[at], k.take(at, 1), d_peak[at]
    y = np.zeros((N_INTEGRATED, at.size))
    y[:N_COMPONENTS] = peak.y[:, at]

    def slope_after(fraction: Array) -> Array:
        y_end, k_end = take_step(at, y, k, fraction * h)
        best[at] = np.fmax(best[at], k_end[WATCHED_ROW])
        return slope(y_end, k_end)

    left, right = np.zeros(at.size), np.ones(at.size)
    d_left, d_right = d_peak, slope_after(right)
    for _ in range(SECANT_STEPS):
        root = secant_update(left, d_left, right, d_right)
        left, d_left, right, d_right = right, d_right, root, slope_after(root)
