"""A phase of a contact, integrated in parts between the bends of its force, which no step goes across."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..ode.problem import Array, Columns, End, Outcome, Problem, Step

# a part ended at its bend where what remains of s is this fraction of it; one that stops there stops for good
AT, STOPPED = 1e-9, 1e-9
# so far beyond it, of s, the next part begins: where the law is the other formula for sure
BEYOND = 1e-13

Run = Callable[[Problem, Array, Columns], Outcome]


def in_parts(
    run: Run,
    problem_of: Callable[[int], Problem],
    start: Array,
    columns: Columns,
    bends: Sequence[Array],
    ahead: int,
) -> Outcome:
    """Integrate a phase.

    Parameters
    ----------
    run : integrates lanes of a problem from their start, of shape (4, n), to their event
    problem_of : the problem that ends at a bend, whose s is the last column: ahead of it 1, -1; 0 without one
    start : components at the start, shape (2, n)
    columns : of the law, each of shape (n,)
    bends : s of the bends, each of shape (n,), in the order in which they are met; NaN is none
    ahead : 1 where s rises, -1 where it falls
    """
    if not bends:
        return run(problem_of(0), start, columns)
    n = start.shape[1]
    total = Outcome.blank(n)
    total.maximum[:] = -np.inf
    state, todo = np.vstack([start, np.zeros((2, n))]), np.ones(n, bool)
    recorded: list[Step] = []
    for bend in (*bends, None):
        where = np.flatnonzero(todo if bend is None else todo & (ahead * (bend - state[0]) > AT * np.abs(bend)))
        if not where.size:
            continue
        own = tuple(column[where] for column in columns)
        at = np.empty(0) if bend is None else bend[where]
        part = run(problem_of(0 if bend is None else ahead), state[:, where], own if bend is None else (*own, at))
        recorded += part.recorded
        total.maximum[where] = np.fmax(total.maximum[where], part.maximum)
        total.steps[where] += part.steps
        total.end[where] = part.end
        total.state[:, where] = part.state
        further = part.end == End.LANDED
        if bend is not None:
            further &= (np.abs(part.state[0] - at) <= AT * np.abs(at)) & (np.abs(part.state[1]) > STOPPED)
            part.state[0] = np.where(further, at * (1.0 + ahead * BEYOND), part.state[0])
            state[:, where] = part.state
            todo[where] = further
    return replace(total, recorded=tuple(recorded))
