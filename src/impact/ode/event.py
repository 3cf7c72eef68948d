"""Landing: the last steps of a lane before its event."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .lanes import LANDED, Lanes, Trial
from .problem import COMPONENTS, INTEGRATED, Array, Mask, Problem

# a rest of up to REST of a step is gone by a step of order two, there or back; the event is reached when what then
# remains is LANDING of it, or NEAR: a linear step onto it is then exact to rounding
REST, LANDING, NEAR = 1e-3, 1e-6, 1e-12


def land(problem: Problem, lanes: Lanes, trial: Trial, accepted: Mask) -> tuple[NDArray[np.intp], Array]:
    """End lanes at their event, and shorten the next step of those that are just before or beyond it.

    A step across the event is not accepted but tried again, so that the way to it is one of true steps of order
    five. Returns the places of the lanes that landed, and what they still went, as a fraction of the step.
    """
    g, dg = problem.event(trial.new[:COMPONENTS], trial.k, lanes.columns)
    ahead = trial.following * dg
    ahead += g
    np.minimum(ahead, g, out=ahead)
    at = ((ahead < 0.0) & accepted).nonzero()[0]
    if not at.size:
        return at, ahead[at]
    g, dg, h = g[at], dg[at], lanes.h[at]
    before = problem.event(lanes.y[:COMPONENTS], lanes.k, lanes.columns)
    beyond, sure = beyond_end(g, dg, before[0][at], before[1][at], h)
    trial.following[at] = np.fmin(trial.following[at], np.where(sure, beyond, np.inf))

    near = np.abs(beyond) <= REST * h + NEAR
    rows, more = _glide(problem, lanes, trial, at, np.where(near, beyond, 0.0))
    landed = near & (np.abs(more) <= LANDING * h + NEAR)
    crossed = ((g < 0.0) & ~landed).nonzero()[0]
    if crossed.size:
        whole, onto = h[crossed], h[crossed] + beyond[crossed]
        trial.following[at[crossed]] = np.where((onto > 0.0) & (onto < whole), onto, 0.5 * whole)
        trial.within[at[crossed]] = False
    home, beyond = at[landed], beyond[landed]
    if home.size:
        trial.new[:, home] = rows[:, landed]
        lanes.end[home] = LANDED
    return home, beyond / h[landed]


def _glide(problem: Problem, lanes: Lanes, trial: Trial, at: NDArray[np.intp], rest: Array) -> tuple[Array, Array]:
    """The rows of lanes a rest beyond the end of their step and linearly on to the event, and how far that is."""
    y, k, columns = trial.new[:, at], trial.k[:, at], tuple(column[at] for column in lanes.columns)
    mean = 0.5 * (k + problem.rates(y[:COMPONENTS] + rest * k[:COMPONENTS], columns))
    y = y + rest * mean[:INTEGRATED]
    k = problem.rates(y[:COMPONENTS], columns)
    g, dg = problem.event(y[:COMPONENTS], k, columns)
    more = linear(g, dg)
    return y + more * k[:INTEGRATED], more


def linear(g: Array, dg: Array) -> Array:
    """How far an event is whose function is linear and falls, and none else; for arrays and for numbers."""
    return choose(dg < 0.0, -g / dg, 0.0)


def beyond_end(g: Array, dg: Array, g_before: Array, dg_before: Array, h: Array) -> tuple[Array, Mask]:
    """How far beyond the end of a step of length h the event is, and whether it is sure to come.

    Of plain arithmetic, for arrays and for numbers.
    """
    # the event function is taken for the cubic through both ends, in units of h: the root of its parabola at the
    # end, and a step of Newton's from there
    fall, bend = dg * h, 2.0 * (dg_before + 2.0 * dg) * h - 6.0 * (g - g_before)
    cubic = (dg + dg_before) * h - 2.0 * (g - g_before)
    root = 2.0 * g / (np.sqrt(fall * fall - 2.0 * bend * g) - fall)
    more = cubic * root * root * root / (fall + root * (bend + 3.0 * root * cubic))
    root = choose(2.0 * np.abs(more) < np.abs(root), root - more, root)
    # one that fades away instead comes to no zero by its mean bend; it may be too stiff for the cubic
    sure = dg * fall >= 2.0 * g * (dg - dg_before)
    return choose(dg < 0.0, root * h, np.inf), sure


def choose(condition: Mask, this: Array | float, other: Array | float) -> Array:
    """One of two values; a compiled core has its own way for numbers."""
    return np.where(condition, this, other)
