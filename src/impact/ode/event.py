"""Landing: the last steps of a lane before its event."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .lanes import LANDED, Lanes, Trial
from .problem import COMPONENTS, INTEGRATED, Array, Mask, Problem

# an event is reached when what remains is this fraction of the step, or this much: a linear step onto it is then
# exact to rounding
LANDING, NEAR = 1e-6, 1e-12
# a step towards the event ends SHORT of it, and seldom beyond; one of less than CLOSE of the last goes onto it
SHORT, CLOSE = 0.99, 0.05


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
    reach = np.where(sure, np.where(beyond <= CLOSE * h, beyond, SHORT * beyond), np.inf)
    trial.following[at] = np.fmin(trial.following[at], reach)

    landed = np.abs(beyond) <= LANDING * h + NEAR
    crossed = ((g < 0.0) & ~landed).nonzero()[0]
    if crossed.size:
        whole, onto = h[crossed], SHORT * (h[crossed] + beyond[crossed])
        trial.following[at[crossed]] = np.where((onto > 0.0) & (onto < whole), onto, 0.5 * whole)
        trial.within[at[crossed]] = False
    home, beyond = at[landed], beyond[landed]
    if home.size:
        for row, rate in zip(trial.new, trial.k[:INTEGRATED], strict=True):
            row[home] += beyond * rate[home]
        lanes.end[home] = LANDED
    return home, beyond / h[landed]


def beyond_end(g: Array, dg: Array, g_before: Array, dg_before: Array, h: Array) -> tuple[Array, Mask]:
    """How far beyond the end of a step of length h the event is, and whether it is sure to come.

    Of plain arithmetic, for arrays and for numbers.
    """
    # beyond the end the event function is taken for the parabola of the cubic through both ends; in units of h
    fall, bend = dg * h, 2.0 * (dg_before + 2.0 * dg) * h - 6.0 * (g - g_before)
    root = np.sqrt(fall * fall - 2.0 * bend * g)
    # one that fades away instead comes to no zero by its mean bend; it may be too stiff for the cubic
    sure = dg * fall >= 2.0 * g * (dg - dg_before)
    return choose(dg < 0.0, 2.0 * g * h / (root - fall), np.inf), sure


def choose(condition: Mask, this: Array | float, other: Array | float) -> Array:
    """One of two values; a compiled core has its own way for numbers."""
    return np.where(condition, this, other)
