"""A phase of a contact, integrated in parts between the breakpoints of its force, which no step crosses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..array_types import Array, Mask
from ..ode.problem import Event, Params, Problem, Solution, Step, Termination

# the formula of the force changes where this changes its sign; NaN for no breakpoint
Breakpoint = Callable[[Array, Params], Array]
IntegratePart = Callable[[Problem, Array, Params], Solution]

# a part that ends within this distance of a breakpoint, in smooth time, ends at the breakpoint
BREAKPOINT_TOLERANCE = 1e-9
# step of the difference quotient for the rate of a breakpoint, relative to s
BREAKPOINT_RATE_STEP = 1e-7
# the next part begins this much later, in smooth time, where the other formula certainly holds
STEP_BEYOND = 1e-12
# parts per breakpoint after which a trajectory fails that crosses breakpoints back and forth
MAX_PARTS_PER_BREAKPOINT = 8


def in_parts(
    run: IntegratePart, problem: Problem, breakpoints: Sequence[Breakpoint], start: Array, params: Params
) -> Solution:
    """Integrate a phase from components at its start, or all rows, in parts between its breakpoints."""
    if not breakpoints:
        return run(problem, start, params)
    components, n = problem.n_components, start.shape[1]
    total = Solution.blank(n, problem.n_integrated)
    total.maximum[:] = -np.inf
    total.termination[:] = Termination.MAX_STEPS
    state = np.zeros((problem.n_integrated, n))
    state[: len(start)] = start
    sides = np.array([np.sign(breakpoint(start, params)) for breakpoint in breakpoints])
    between = replace(problem, event=_first_event(problem, breakpoints))
    recorded: list[Step] = []
    rows = np.arange(n)
    for _ in range(MAX_PARTS_PER_BREAKPOINT * len(breakpoints)):
        part_params = (*(column[rows] for column in params), *sides[:, rows])
        part = run(between, state[:, rows], part_params)
        recorded += part.recorded
        total.maximum[rows] = np.fmax(total.maximum[rows], part.maximum)
        total.steps[rows] += part.steps
        state[:, rows] = part.state
        k = problem.rates(part.state[:components], part_params)
        met = _reached(problem, breakpoints, part.state[:components], k, part_params)
        at_breakpoint = (part.termination == Termination.EVENT_REACHED) & met.any(axis=0)
        sides[:, rows] = np.where(met, -sides[:, rows], sides[:, rows])
        state[:, rows] += STEP_BEYOND * np.minimum(part.state[0], 1.0) * k[: problem.n_integrated]
        done = rows[~at_breakpoint]
        total.termination[done] = part.termination[~at_breakpoint]
        total.state[:, done] = part.state[:, ~at_breakpoint]
        rows = rows[at_breakpoint]
        if not rows.size:
            break
    return replace(total, recorded=tuple(recorded))


def _distances(breakpoints: Sequence[Breakpoint], y: Array, k: Array, params: Params) -> list[tuple[Array, Array]]:
    """Compute each breakpoint, positive on the current side by its sign, and its rate; shapes (n,)."""
    small = BREAKPOINT_RATE_STEP * np.where(y[0] > 0.0, np.minimum(y[0], 1.0), 1.0)
    ahead = y + small * k[: len(y)]
    distances = []
    for breakpoint, side in zip(breakpoints, params[-len(breakpoints) :], strict=True):
        distance = side * breakpoint(y, params)
        distances.append((distance, (side * breakpoint(ahead, params) - distance) / small))
    return distances


def _first_event(problem: Problem, breakpoints: Sequence[Breakpoint]) -> Event:
    """Make the event that is that of the phase, or a breakpoint, whichever comes first."""

    def event(y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        g, dg = problem.event(y, k, params)
        for distance, rate in _distances(breakpoints, y, k, params):
            # if a step crossed both, or neither, the earlier one; otherwise the one that it crossed
            same_sign = (distance < 0.0) == (g < 0.0)
            by_breakpoint = np.where(same_sign, distance * dg > g * rate, distance < 0.0)
            g, dg = np.where(by_breakpoint, distance, g), np.where(by_breakpoint, rate, dg)
        return g, dg

    return event


def _reached(problem: Problem, breakpoints: Sequence[Breakpoint], y: Array, k: Array, params: Params) -> Mask:
    """Mask of the breakpoints at which trajectories have ended, shape (breakpoints, n)."""
    g, dg = problem.event(y, k, params)
    times = np.array([np.abs(distance / rate) for distance, rate in _distances(breakpoints, y, k, params)])
    near = np.fmax(np.fmin.reduce(times), BREAKPOINT_TOLERANCE)
    return np.asarray((times <= near) & (np.abs(g / dg) > near))
