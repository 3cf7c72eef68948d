"""Switches: changes of the formulas within an integration, where a margin of the present mode vanishes.

A step across the zero of a margin is rejected and tried again with the length to it, as for an event that ends the
trajectory. The change takes place at the end of a step near enough to the zero: an error of its time is one of
second order in the solution where the rates are continuous, and of first order where they jump.
"""

from __future__ import annotations

import numpy as np

from ..array_types import Array, Indices, Mask
from .events import event_offset, is_event_ahead, step_of_order_two
from .problem import Margins, Problem, Switch, Termination
from .state import RUNNING, State, TrialStep, put_columns

# a mode changes at the end of a step within this part of the last two steps, or within this time, of the zero; or
# within the larger part, if the rate of the margin is known: a step of order two bridges it
SWITCH_RTOL, SWITCH_ATOL, NEAR_SWITCH = 1e-8, 3e-10, 1e-4
# a step ends at the least value of a margin in its inside if that is less than this part of those at its ends, and
# not as near to an end of the step as the second number, in steps: there is no change at a minimum above zero
LOW_MARGIN, NEAR_END = 0.05, 0.01
# the rates of a margin are computed at both ends of a step over which it changes by more than this part
LARGE_CHANGE = 0.5
# a margin of unknown rate has changed much if it is above this multiple of the one before
FAR_ABOVE = 2.0

# where margins vanish: the trajectories, which margin of each, and the offsets from the ends of their steps
Zeros = tuple[Indices, Indices, Array]


def locate_switches(problem: Problem, switch: Switch, state: State, trial: TrialStep, accepted: Mask) -> Array:
    """Change the modes of trajectories whose step ends where a margin vanishes; shorten steps to such an end.

    A step across the zero of a margin, or across a low minimum, is rejected and tried again with the length to it.
    Returns the offsets of the changes from the ends of the steps, as fractions of them.
    """
    # the end of a trajectory is not the end of the step
    ended = (state.termination == Termination.EVENT_REACHED).nonzero()[0]
    if ended.size:
        params = tuple(column[ended] for column in state.params)
        put_columns(trial.k, ended, problem.rates(trial.y[: problem.n_components].take(ended, 1), params))
    margins, rates = switch.margins(trial.y, trial.k, state.params)
    before, rates_before = state.margins
    # most margins are far from zero, and by a glance: one of an unknown rate may vanish soon only below this part
    # of the one before, where its secant vanishes within the next step
    vanishing = trial.h_next / (state.h + trial.h_next)
    may_vanish = np.fmin(trial.h_next * rates + margins, margins) < 0.0
    may_vanish |= (rates_before < 0.0) & (rates > 0.0)
    may_vanish |= np.isnan(rates) & ((margins < vanishing * before) | (margins > FAR_ABOVE * before))
    positions = (may_vanish.any(axis=0) & accepted).nonzero()[0]
    zeros: Zeros = positions[:0], positions[:0], np.zeros(0)
    if positions.size:
        zeros = _locate(switch, state, trial, positions, (margins, rates))
    stay = (~trial.is_accurate).nonzero()[0]
    for rows, rows_before in ((margins, before), (rates, rates_before)):
        put_columns(rows, stay, rows_before.take(stay, 1))
    state.margins = margins, rates
    reached, _, offset = zeros
    if reached.size:
        _change_modes(problem, switch, state, trial, zeros)
    return offset / state.h[reached]


def _locate(switch: Switch, state: State, trial: TrialStep, positions: Indices, ends: Margins) -> Zeros:
    """Shorten steps to zeros of margins; returns those that are reached."""
    all_margins, all_rates = ends
    margins, before = all_margins.take(positions, 1), state.margins[0].take(positions, 1)
    h, h_next = state.h[positions], trial.h_next[positions]
    changes = np.abs(margins - before) > LARGE_CHANGE * np.maximum(np.abs(margins), np.abs(before))
    # kept, since the end of a step is the start of the next one
    kept = (all_rates, state.margins[1])
    end, start = (positions[(changes & np.isnan(rates.take(positions, 1))).any(axis=0)] for rates in kept)
    at = np.concatenate([end, start])
    if at.size:
        params = tuple(column[at] for column in state.params)
        y = np.concatenate([trial.y.take(end, 1), state.y.take(start, 1)], axis=1)
        k = np.concatenate([trial.k.take(end, 1), state.k.take(start, 1)], axis=1)
        exact = switch.rates_of_margins(y, k, params)
        for rates, where, values in zip(kept, (end, start), np.split(exact, [end.size], axis=1), strict=True):
            known = rates.take(where, 1)
            put_columns(rates, where, np.where(np.isnan(known), values, known))
    slopes, slopes_before = all_rates.take(positions, 1), state.margins[1].take(positions, 1)
    secant, unknown = (margins - before) / h, np.isnan(slopes)
    slopes = np.where(unknown, secant, slopes)
    slopes_before = np.where(np.isnan(slopes_before), secant, slopes_before)
    # a trajectory that has ended has no next step, and its end may lie beyond where its rates are smooth
    goes_on = state.termination[positions] == RUNNING
    h_ahead = np.where(goes_on, h_next, 0.0)
    slopes = np.where(goes_on, slopes, np.fmin(slopes, 0.0))
    turns = (slopes_before < 0.0) & (slopes > 0.0)
    falls = (is_event_ahead(margins, slopes, h_ahead) | turns).any(axis=0)
    is_again = state.h_free[positions] > 0.0
    which, offset, is_smooth = _first_zero(margins, slopes, before, slopes_before, h, unknown, is_again)
    near = np.where(is_smooth, NEAR_SWITCH, SWITCH_RTOL) * (h + state.h_last[positions]) + SWITCH_ATOL
    reached = falls & (np.abs(offset) <= near) & goes_on
    crossed = falls & (offset < -near) & ~reached
    is_ahead = falls & (offset > near) & (offset < h_ahead)
    _shorten(state, trial, positions, offset, crossed, crossed | is_ahead)
    return positions[reached], which[reached], offset[reached]


def _first_zero(
    g: Array, dg: Array, g_before: Array, dg_before: Array, h: Array, unknown: Mask, is_again: Mask
) -> tuple[Indices, Array, Mask]:
    """Find the margin that vanishes first, the offset from the end of the step, and if it is that of a cubic.

    The arrays have the shape (margins, n), `h` and `is_again`, whether the step was shortened before, have (n,).
    """
    offset, certain = event_offset(g, dg, g_before, dg_before, h)
    inside = (offset < 0.0) & (offset > -h) & ~unknown
    crossing = np.where(g_before > 0.0, -h * g / (g - g_before), -h * (1.0 - NEAR_END))
    # secants across a jump, or onto a constant part, would approach the zero from beyond for ever
    crossing = np.where(is_again, -0.5 * h, crossing)
    crossing = np.where(inside, offset, crossing)
    ahead = np.where(certain & (offset >= 0.0), offset, np.inf)
    turns = (dg_before < 0.0) & (dg > 0.0)
    if turns.any():
        steps = np.broadcast_to(h, g.shape)
        ahead[turns] = _low_minimum(*(values[turns] for values in (g, dg, g_before, dg_before, steps)))
    offset = np.where(g < 0.0, crossing, ahead)
    which = offset.argmin(axis=0)
    first = which, np.arange(which.size)
    return which, offset[first], (inside | ((g >= 0.0) & ~unknown))[first]


def _low_minimum(g: Array, dg: Array, g_before: Array, dg_before: Array, h: Array) -> Array:
    """Compute the offset of a low minimum of the cubic from the end of the step; infinity without one."""
    rise, first, last = g - g_before, dg_before * h, dg * h
    cubic, square = first + last - 2.0 * rise, 3.0 * rise - 2.0 * first - last
    # the root of the derivative at which it grows
    theta = -first / (square + np.sqrt(square * square - 3.0 * cubic * first))
    least = g_before + theta * (first + theta * (square + theta * cubic))
    is_low = (least < LOW_MARGIN * np.maximum(g, g_before)) & (theta > NEAR_END) & (theta < 1.0 - NEAR_END)
    return np.where(is_low, (theta - 1.0) * h, np.inf)


def _shorten(
    state: State, trial: TrialStep, positions: Indices, offset: Array, crossed: Mask, is_shorter: Mask
) -> None:
    """Give steps the length to a zero; the present one is tried again where it crossed the zero."""
    h_next = trial.h_next[positions]
    state.h_free[positions] = np.where(
        is_shorter, np.fmax(state.h_free[positions], h_next), state.h_free[positions]
    )
    shorter = np.where(crossed, state.h[positions] + offset, offset)
    # a zero nearer to the start of the step is located at the end of one of this length
    trial.h_next[positions] = np.where(is_shorter, np.fmax(shorter, SWITCH_ATOL), h_next)
    back = positions[crossed]
    trial.is_accurate[back], state.termination[back] = False, RUNNING


def _change_modes(problem: Problem, switch: Switch, state: State, trial: TrialStep, zeros: Zeros) -> None:
    """Change the modes of trajectories next to the ends of their steps.

    They go on with the step of before they were shortened, or to the next zero.
    """
    positions, which, offset = zeros
    params = tuple(column[positions] for column in state.params)
    y, k = step_of_order_two(problem, trial.y.take(positions, 1), trial.k.take(positions, 1), offset, params)
    y, params = switch.change(which, y, k, params)
    for column, values in zip(state.params, params, strict=True):
        column[positions] = values
    k = problem.rates(y[: problem.n_components], params)
    put_columns(trial.y, positions, y)
    put_columns(trial.k, positions, k)
    margins, rates = switch.margins(y, k, params)
    for rows, values in zip(state.margins, (margins, rates), strict=True):
        put_columns(rows, positions, values)
    h_next = np.fmax(trial.h_next[positions], state.h_free[positions])
    # a margin that begins near zero and falls may grow again within the step of before
    zero = np.where(rates < 0.0, -margins / rates, np.inf).min(axis=0)
    trial.h_next[positions] = np.clip(zero, NEAR_END * h_next, h_next)
    state.h_free[positions] = np.where(zero < h_next, h_next, 0.0)
