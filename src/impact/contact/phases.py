"""A phase of a contact, integrated in parts between the bends of its force, which no step goes across."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..ode.problem import COMPONENTS, INTEGRATED, Array, Columns, End, Event, Outcome, Problem, Step

# the force has one formula where this is positive, and another where it is negative; NaN is no bend
Bend = Callable[[Array, Columns], Array]
Run = Callable[[Problem, Array, Columns], Outcome]

# a part has ended at what is nearer than this, of the smooth time
AT = 1e-9
# step of the difference that gives the rate of a bend, relative to s
DIFFERENCE = 1e-7
# so much later, in it, the next part begins: where the law is the other formula for sure
BEYOND = 1e-12
# parts after which a lane that goes to and fro over its bends is given up, for each of them
TIMES = 8


def in_parts(run: Run, problem: Problem, bends: Sequence[Bend], start: Array, columns: Columns) -> Outcome:
    """Integrate a phase.

    Parameters
    ----------
    run : integrates lanes of a problem from their start, of shape (4, n), to their event
    problem : of the phase, without its bends
    bends : where the force goes over to another formula
    start : components at the start, shape (2, n)
    columns : of the law, each of shape (n,)
    """
    if not bends:
        return run(problem, start, columns)
    n = start.shape[1]
    total = Outcome.blank(n)
    total.maximum[:] = -np.inf
    total.end[:] = End.MAX_STEPS
    state = np.vstack([start, np.zeros((2, n))])
    sides = np.array([np.sign(bend(start, columns)) for bend in bends])
    between = replace(problem, event=_sooner(problem, bends))
    recorded: list[Step] = []
    where = np.arange(n)
    for _ in range(TIMES * len(bends)):
        own = (*(column[where] for column in columns), *sides[:, where])
        part = run(between, state[:, where], own)
        recorded += part.recorded
        total.maximum[where] = np.fmax(total.maximum[where], part.maximum)
        total.steps[where] += part.steps
        state[:, where] = part.state
        k = problem.rates(part.state[:COMPONENTS], own)
        met = _met(problem, bends, part.state[:COMPONENTS], k, own)
        further = (part.end == End.LANDED) & met.any(axis=0)
        sides[:, where] = np.where(met, -sides[:, where], sides[:, where])
        state[:, where] += BEYOND * np.minimum(part.state[0], 1.0) * k[:INTEGRATED]
        done = where[~further]
        total.end[done], total.state[:, done] = part.end[~further], part.state[:, ~further]
        where = where[further]
        if not where.size:
            break
    return replace(total, recorded=tuple(recorded))


def _bends(bends: Sequence[Bend], y: Array, k: Array, columns: Columns) -> list[tuple[Array, Array]]:
    """Each bend on the side where the lane is, which falls through zero, and its rate."""
    small = DIFFERENCE * np.where(y[0] > 0.0, np.minimum(y[0], 1.0), 1.0)
    ahead = y + small * k[:COMPONENTS]
    found = []
    for bend, side in zip(bends, columns[-len(bends) :], strict=True):
        left = side * bend(y, columns)
        found.append((left, (side * bend(ahead, columns) - left) / small))
    return found


def _sooner(problem: Problem, bends: Sequence[Bend]) -> Event:
    """The event of the phase, or a bend, whichever is sooner."""

    def event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        g, dg = problem.event(y, k, columns)
        for left, rate in _bends(bends, y, k, columns):
            # of two that a step has gone across the one that was sooner, as of two that are to come
            alike = (left < 0.0) == (g < 0.0)
            by_bend = np.where(alike, left * dg > g * rate, left < 0.0)
            g, dg = np.where(by_bend, left, g), np.where(by_bend, rate, dg)
        return g, dg

    return event


def _met(problem: Problem, bends: Sequence[Bend], y: Array, k: Array, columns: Columns) -> NDArray[np.bool_]:
    """Which bends lanes have ended at, if not at the event of the phase, of shape (bends, n)."""
    g, dg = problem.event(y, k, columns)
    away = np.array([np.abs(left / rate) for left, rate in _bends(bends, y, k, columns)])
    near = np.fmax(np.fmin.reduce(away), AT)
    return np.asarray((away <= near) & (np.abs(g / dg) > near))
