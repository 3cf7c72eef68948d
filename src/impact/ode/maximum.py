"""The maximum of the watched quantity, near its largest value at the end of a step."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..array_types import Array, Indices, Mask
from .events import choose
from .problem import Params, Problem
from .state import PeakCandidate, State, TrialStep

# step of the difference quotient for the slope of the watched quantity, relative to the adjacent step
SLOPE_STEP = 1e-5
# a slope that changes the value by less than this fraction over the adjacent step counts as zero
FLAT_SLOPE = 1e-10
# near a maximum the quantity is flat, so that an approximate location is sufficient
SECANT_STEPS = 2

# (positions, rows, rates, lengths of the step) -> rows and rates at its end
TakeStep = Callable[[Indices, Array, Array, Array], tuple[Array, Array]]


def begins_to_fall(value: Array, value_end: Array, best: Array) -> Mask:
    """Find whether the watched quantity falls over a step, from a value above the largest one so far."""
    return (value_end < value) & (value > best)


def secant_update(left: Array, d_left: Array, right: Array | float, d_right: Array) -> Array:
    """The root of the secant through two slopes, as a fraction of the step; `right` where it is outside."""
    root = right - d_right * (right - left) / (d_right - d_left)
    return choose((root >= 0.0) & (root <= 1.0), root, right)


def update_peaks(problem: Problem, state: State, trial: TrialStep, accepted: Mask, ended: Indices) -> None:
    """Update the candidates where the watched quantity begins to fall, or a trajectory ends, above `best`."""
    components, watched_row = problem.n_components, problem.n_integrated
    value, value_end = state.k[watched_row], trial.k[watched_row]
    falls = (begins_to_fall(value, value_end, state.best) & accepted).nonzero()[0]
    if falls.size:
        state.best[falls] = value[falls]
        state.peak.put(state.index[falls], state.y[:components, falls], state.h_last[falls], state.h[falls])
    ended = ended[value_end[ended] > state.best[ended]]
    if ended.size:
        state.best[ended] = value_end[ended]
        state.peak.put(state.index[ended], trial.y[:components, ended], state.h[ended], 0.0)


def refine_maximum(
    problem: Problem, params: Params, peak: PeakCandidate, best: Array, take_step: TakeStep
) -> None:
    """Raise the values at the candidates, `best` of shape (n,), to the maxima near them.

    The secant rule finds where the slope along the trajectory vanishes, by steps of order five from the candidate
    into the next step or, where the slope at the candidate is negative, back into the previous one.
    """
    components, watched_row = problem.n_components, problem.n_integrated
    small = SLOPE_STEP * np.maximum(peak.behind, peak.ahead)

    def slope(y: Array, k: Array) -> Array:
        ahead = problem.rates(y[:components] + small * k[:components], params)
        return np.asarray((ahead[watched_row] - k[watched_row]) / small)

    k = problem.rates(peak.y, params)
    d_peak = slope(peak.y, k)
    h = np.where(d_peak > 0.0, peak.ahead, -peak.behind)
    positions = np.flatnonzero(np.abs(d_peak * h) > FLAT_SLOPE * np.abs(best))
    if not positions.size:
        return
    small, params = small[positions], tuple(column[positions] for column in params)
    h, k, d_peak = h[positions], k.take(positions, 1), d_peak[positions]
    y = np.zeros((problem.n_integrated, positions.size))
    y[:components] = peak.y[:, positions]

    def slope_at(fraction: Array) -> Array:
        y_end, k_end = take_step(positions, y, k, fraction * h)
        best[positions] = np.fmax(best[positions], k_end[watched_row])
        return slope(y_end, k_end)

    left, right = np.zeros(positions.size), np.ones(positions.size)
    d_left, d_right = d_peak, slope_at(right)
    for _ in range(SECANT_STEPS):
        root = secant_update(left, d_left, right, d_right)
        left, d_left, right, d_right = right, d_right, root, slope_at(root)
