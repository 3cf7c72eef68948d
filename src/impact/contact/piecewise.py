"""A phase of a contact, integrated in parts between the breakpoints of its force, which no step goes across."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ode.problem import N_COMPONENTS, N_INTEGRATED, Array, Event, Params, Problem, Solution, Step, Termination

# the force has one formula where this is positive, and another where it is negative; NaN is no breakpoint
Breakpoint = Callable[[Array, Params], Array]
IntegratePart = Callable[[Problem, Array, Params], Solution]

# a part has ended at a breakpoint that is nearer than this, in smooth time
BREAKPOINT_TOLERANCE = 1e-9
# step of the difference quotient for the rate of a breakpoint, relative to s
BREAKPOINT_RATE_STEP = 1e-7
# the next part begins so much later, in smooth time: where the other formula holds for sure
STEP_BEYOND = 1e-12
# parts per breakpoint after which a trajectory that crosses them back and forth fails
MAX_PARTS_PER_BREAKPOINT = 8


def in_parts(
    run: IntegratePart, problem: Problem, breakpoints: Sequence[Breakpoint], start: Array, params: Params
) -> Solution:
    """Integrate a phase.

    Parameters
    ----------
    run : integrates trajectories of a problem from their start, of shape (4, n), to their event
    problem : of the phase, without its breakpoints
    breakpoints : where the force goes over to another formula
    start : components at the start, shape (2, n)
    params : of the law, each of shape (n,)
    """
    if not breakpoints:
        return run(problem, start, params)
    n = start.shape[1]
    total = Solution.blank(n)
    total.maximum[:] = -np.inf
    total.termination[:] = Termination.MAX_STEPS
    state = np.vstack([start, np.zeros((2, n))])
    sides = np.array([np.sign(breakpoint(start, params)) for breakpoint in breakpoints])
    between = replace(problem, event=_first_event(problem, breakpoints))
    recorded: list[Step] = []
    where = np.arange(n)
    for _ in range(MAX_PARTS_PER_BREAKPOINT * len(breakpoints)):
        own_params = (*(column[where] for column in params), *sides[:, where])
        part = run(between, state[:, where], own_params)
        recorded += part.recorded
        total.maximum[where] = np.fmax(total.maximum[where], part.maximum)
        total.steps[where] += part.steps
        state[:, where] = part.state
        k = problem.rates(part.state[:N_COMPONENTS], own_params)
        met = _reached(problem, breakpoints, part.state[:N_COMPONENTS], k, own_params)
        further = (part.termination == Termination.EVENT_REACHED) & met.any(axis=0)
        sides[:, where] = np.where(met, -sides[:, where], sides[:, where])
        state[:, where] += STEP_BEYOND * np.minimum(part.state[0], 1.0) * k[:N_INTEGRATED]
        done = where[~further]
        total.termination[done], total.state[:, done] = part.termination[~further], part.state[:, ~further]
        where = where[further]
        if not where.size:
            break
    return replace(total, recorded=tuple(recorded))


def _distances(breakpoints: Sequence[Breakpoint], y: Array, k: Array, params: Params) -> list[tuple[Array, Array]]:
    """Each breakpoint on the side where the trajectory is, which falls through zero, and its rate."""
    small = BREAKPOINT_RATE_STEP * np.where(y[0] > 0.0, np.minimum(y[0], 1.0), 1.0)
    ahead = y + small * k[:N_COMPONENTS]
    distances = []
    for breakpoint, side in zip(breakpoints, params[-len(breakpoints) :], strict=True):
        left = side * breakpoint(y, params)
        distances.append((left, (side * breakpoint(ahead, params) - left) / small))
    return distances


def _first_event(problem: Problem, breakpoints: Sequence[Breakpoint]) -> Event:
    """The event of the phase, or a breakpoint, whichever comes first."""

    def event(y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        g, dg = problem.event(y, k, params)
        for left, rate in _distances(breakpoints, y, k, params):
            # of two that a step went across the first one, and likewise of two that are to come
            alike = (left < 0.0) == (g < 0.0)
            by_breakpoint = np.where(alike, left * dg > g * rate, left < 0.0)
            g, dg = np.where(by_breakpoint, left, g), np.where(by_breakpoint, rate, dg)
        return g, dg

    return event


def _reached(
    problem: Problem, breakpoints: Sequence[Breakpoint], y: Array, k: Array, params: Params
) -> NDArray[np.bool_]:
    """At which breakpoints trajectories have ended, not at the event of the phase; shape (breakpoints, n)."""
    g, dg = problem.event(y, k, params)
    away = np.array([np.abs(left / rate) for left, rate in _distances(breakpoints, y, k, params)])
    near = np.fmax(np.fmin.reduce(away), BREAKPOINT_TOLERANCE)
    return np.asarray((away <= near) & (np.abs(g / dg) > near))
