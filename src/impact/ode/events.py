"""Event location: the final steps of a trajectory, at whose end the event function vanishes.

The formulas use only arithmetic, `choose` and `smaller`, so that they hold for arrays and, compiled, for numbers.
"""

from __future__ import annotations

import numpy as np

from ..array_types import Array, Indices, Mask
from .problem import Params, Problem, Termination
from .state import State, TrialStep, put_columns

# an offset up to NEAR_EVENT of a step is bridged by a step of order two, forwards or backwards; the event is
# located when the remaining offset is below EVENT_RTOL of the step, or EVENT_ATOL: a linear step is then exact to
# rounding
NEAR_EVENT, EVENT_RTOL, EVENT_ATOL = 1e-3, 1e-6, 1e-12


def choose(condition: Mask, this: Array | float, other: Array | float) -> Array:
    """`this` where the condition holds, else `other`; the compiled back end has its own version for numbers."""
    return np.where(condition, this, other)


def smaller(this: Array, other: Array) -> Array:
    """The smaller of two values; the compiled back end has its own version."""
    return np.minimum(this, other)


def trapezoid(h: Array, k: Array, k_end: Array) -> Array:
    """The increment over h by the trapezoidal rule, from the rates at both ends."""
    return 0.5 * h * (k + k_end)


def linear_offset(g: Array, dg: Array) -> Array:
    """Offset of the root of a linear event function with value g and rate dg; 0 where it does not fall."""
    return choose(dg < 0.0, -g / dg, 0.0)


def event_offset(g: Array, dg: Array, g_before: Array, dg_before: Array, h: Array) -> tuple[Array, Mask]:
    """Find the offset of the event from the end of a step of length h, and whether it is certain; shape (n,).

    The event function g and its rate dg are those at the end of the step, g_before and dg_before at its start.
    """
    # the event function as the cubic through both ends, in units of h: the root of its parabola at the end, then
    # one Newton step
    slope, curvature = dg * h, 2.0 * (dg_before + 2.0 * dg) * h - 6.0 * (g - g_before)
    cubic = (dg + dg_before) * h - 2.0 * (g - g_before)
    root = 2.0 * g / (np.sqrt(slope * slope - 2.0 * curvature * g) - slope)
    correction = cubic * root * root * root / (slope + root * (curvature + 3.0 * root * cubic))
    root = choose(2.0 * np.abs(correction) < np.abs(root), root - correction, root)
    # a function that decays without a root has none by its mean curvature; it may be too stiff for the cubic
    certain = dg * slope >= 2.0 * g * (dg - dg_before)
    return choose(dg < 0.0, root * h, np.inf), certain


def is_event_ahead(g: Array, dg: Array, h_next: Array) -> Mask:
    """Find whether the event lies before the end of the next step, by linear extrapolation."""
    return smaller(h_next * dg + g, g) < 0.0


def before_event(offset: Array, certain: Mask, h: Array, h_next: Array) -> tuple[Mask, Array]:
    """Find whether the event is near the end of a step, and the length of the next step, at most to the event."""
    near = np.abs(offset) <= NEAR_EVENT * h + EVENT_ATOL
    return near, choose(certain & (offset < h_next), offset, h_next)


def at_event(
    near: Mask, remaining: Array, g: Array, offset: Array, h: Array, h_next: Array
) -> tuple[Mask, Mask, Array]:
    """Find whether the event is located, whether the step crossed it instead, and the length of the next step.

    `remaining` is the offset after a step of order two; g at the end of the step is negative where it crossed.
    """
    located = near & (np.abs(remaining) <= EVENT_RTOL * h + EVENT_ATOL)
    crossed = (g < 0.0) & np.logical_not(located)
    # the zero of the linear step, where that of the cubic is not: the formula of the function may have changed
    shorter = h + choose(near, offset + remaining, offset)
    shorter = choose((shorter > 0.0) & (shorter < h), shorter, 0.5 * h)
    return located, crossed, choose(crossed, shorter, h_next)


def locate_event(problem: Problem, state: State, trial: TrialStep, accepted: Mask) -> tuple[Indices, Array]:
    """End trajectories at their event, and shorten the next step of those shortly before or beyond it.

    A step across the event is rejected and tried again with the length to the event, so that all steps up to the
    event are of order five. Returns the positions of the trajectories that ended, and the offsets of their events
    from the end of the step, as fractions of it.
    """
    components = problem.n_components
    g, dg = problem.event(trial.y[:components], trial.k, state.params)
    positions = (is_event_ahead(g, dg, trial.h_next) & accepted).nonzero()[0]
    if not positions.size:
        return positions, g[positions]
    g, dg, h = g[positions], dg[positions], state.h[positions]
    g_before, dg_before = problem.event(state.y[:components], state.k, state.params)
    offset, certain = event_offset(g, dg, g_before[positions], dg_before[positions], h)
    near, h_next = before_event(offset, certain, h, trial.h_next[positions])
    y, remaining = _step_to_event(problem, state, trial, positions, np.where(near, offset, 0.0))
    located, crossed, trial.h_next[positions] = at_event(near, remaining, g, offset, h, h_next)
    trial.is_accurate[positions[crossed]] = False
    ended = positions[located]
    if ended.size:
        put_columns(trial.y, ended, y.compress(located, 1))
        state.termination[ended] = Termination.EVENT_REACHED
    return ended, offset[located] / h[located]


def _step_to_event(
    problem: Problem, state: State, trial: TrialStep, positions: Indices, offset: Array
) -> tuple[Array, Array]:
    """Compute the rows at the event, by steps of order two and one, and the offset of the linear step."""
    params = tuple(column[positions] for column in state.params)
    y, k = step_of_order_two(problem, trial.y.take(positions, 1), trial.k.take(positions, 1), offset, params)
    remaining = linear_offset(*problem.event(y[: problem.n_components], k, params))
    return y + remaining * k[: problem.n_integrated], remaining


def step_of_order_two(problem: Problem, y: Array, k: Array, offset: Array, params: Params) -> tuple[Array, Array]:
    """Take a short step, forwards or backwards, from rows y with rates k: rows and rates at its end."""
    components = problem.n_components
    k_end = problem.rates(y[:components] + offset * k[:components], params)
    y = y + trapezoid(offset, k, k_end)[: problem.n_integrated]
    return y, problem.rates(y[:components], params)
