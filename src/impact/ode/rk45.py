"""Adaptive Dormand-Prince 5(4) over many lanes: every lane has its own step, all are advanced as arrays.

A lane is one initial value problem of two components that ends where an event function falls through zero.
Beside the two, rates that depend on them alone are integrated as quadratures with the same weights, and one
quantity is watched for its maximum. All arithmetic is elementwise and in a fixed order, so that a lane has the
same bits alone, in any crowd and in any order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problem import COMPONENTS, INTEGRATED, WATCHED, Array, Columns, End, Mask, Outcome, Problem, Step
from .step import Space, attempt, local_error

# the controller: a step is multiplied by SAFETY/error^(3/16), within bounds. 3/16 is nearly the 1/5 of the
# theory and takes square roots only, whose bits are the same on every processor
SAFETY, SMALLEST, LARGEST = 0.9, 0.2, 3.0
FIRST_STEP, LAST_STEP = 0.05, 1e-16
# after so many halvings a rate is taken to be not finite for good; they are counted over the whole lane, since
# towards a point beyond which there is no rate every halved step is accepted
HALVINGS = 20
# an event is reached when what remains is this fraction of the step, or this much: a linear step onto it is then
# exact to rounding. What remains after Newton's iteration fell short, and is less than SHORT of the step, is
# the next step
LANDING, NEAR, SHORT = 1e-8, 1e-12, 1e-2
# lanes that are done are taken out when they are more than this fraction
COMPACT_ABOVE = 0.125
# a maximum is flat, so that a crude location of it is enough
MAXIMUM_ITERATIONS, DIFFERENCE = 3, 1e-6


@dataclass
class _Lanes:
    """The lanes still running, in arrays that are compacted together; the last axis is the lane."""

    index: NDArray[np.intp]
    columns: Columns
    y: Array
    k: Array
    h: Array
    halvings: NDArray[np.int8]
    steps: NDArray[np.int32]
    end: NDArray[np.int8]
    # the largest watched value at the end of a step, and the start and length of that step
    best: Array
    before: Array
    span: Array

    # the arrays of one attempt, reused: fresh ones of this size would go back to the system after every step
    space: Space

    def keep(self, mask: Mask) -> _Lanes:
        kept: dict[str, Any] = {
            name: tuple(column[mask] for column in value) if name == "columns" else value[..., mask]
            for name, value in vars(self).items()
            if name != "space"
        }
        return _Lanes(**kept, space=Space.of(kept["h"].size))


def integrate(
    problem: Problem, start: Array, columns: Columns, *, rtol: float, max_steps: int, record: bool = False
) -> Outcome:
    """Integrate every lane from its start to its event.

    Parameters
    ----------
    problem : rates, event and error scale
    start : components at the start, shape (2, n)
    columns : what the rates need per lane, each of shape (n,)
    rtol : local error per step, relative to max(|y|, floor)
    max_steps : attempted steps after which a lane is given up
    record : keep every accepted step for the interpolant; for a single lane

    Returns
    -------
    Outcome : a failed lane has NaN for its state, and its reason in `end`
    """
    n = start.shape[1]
    state = np.full((INTEGRATED, n), np.nan)
    steps, end = np.zeros(n, np.int32), np.zeros(n, np.int8)
    best, span, before = np.full(n, np.nan), np.zeros(n), np.zeros((COMPONENTS, n))
    recorded: list[Step] = []
    with np.errstate(all="ignore"):
        lanes = _begin(problem, start, columns)
        for count in range(1, max_steps + 1):
            step = _advance(problem, lanes, rtol, record)
            if step is not None:
                recorded.append(step)
            if count == max_steps:
                lanes.end[lanes.end == End.RUNNING] = End.MAX_STEPS
            done = lanes.end != End.RUNNING
            if np.count_nonzero(done) <= COMPACT_ABOVE * done.size and count < max_steps:
                continue
            ended, lanes = lanes.keep(done), lanes.keep(~done)
            where = ended.index
            state[:, where] = np.where(ended.end == End.LANDED, ended.y, np.nan)
            steps[where], end[where] = ended.steps, ended.end
            best[where], span[where], before[:, where] = ended.best, ended.span, ended.before
            if not lanes.index.size:
                break
        maximum = _maximum(problem, columns, best, before, span) if problem.watch else best
    return Outcome(state, np.where(end == End.LANDED, maximum, np.nan), steps, end, tuple(recorded))


def _begin(problem: Problem, start: Array, columns: Columns) -> _Lanes:
    n = start.shape[1]
    y = np.zeros((INTEGRATED, n))
    y[:COMPONENTS] = start
    k = problem.rates(start, columns).copy()
    span = np.full(n, FIRST_STEP)
    return _Lanes(
        index=np.arange(n),
        columns=columns,
        y=y,
        k=k,
        h=span.copy(),
        halvings=np.zeros(n, np.int8),
        steps=np.zeros(n, np.int32),
        end=np.zeros(n, np.int8),
        best=k[WATCHED].copy(),
        before=start.copy(),
        span=span,
        space=Space.of(n),
    )


def _advance(problem: Problem, lanes: _Lanes, rtol: float, record: bool) -> Step | None:
    """Try one step in every running lane; accept, land or shorten it. Returns a step to be recorded."""
    y, h, running = lanes.y, lanes.h, lanes.end == End.RUNNING
    space = lanes.space
    new, stages = attempt(problem, y, lanes.k, h, lanes.columns, space)
    k = stages[-1]
    worst = local_error(problem, stages, y, new, h, space) / rtol
    accepted = running & (worst <= 1.0)

    # the next step by the controller; one with a rate that is not finite is halved
    eighth = np.sqrt(np.sqrt(np.sqrt(worst)))
    factor = np.clip(SAFETY / (eighth * np.sqrt(eighth)), SMALLEST, LARGEST)
    finite = np.isfinite(worst)
    if not finite.all():
        factor = np.where(finite, factor, 0.5)
        lanes.halvings += ~finite
        lanes.end[running & (lanes.halvings > HALVINGS)] = End.NOT_FINITE
    following = h * factor

    # a step across the event is not accepted but shortened onto it by Newton's iteration, so that the way to
    # the event is a true step of order five
    g, dg = problem.event(new[:COMPONENTS], k, lanes.columns)
    at = np.flatnonzero(accepted & ((g < 0.0) | (g < SHORT * h * np.abs(dg))))
    end = 1.0
    if at.size:
        beyond = np.where(dg[at] < 0.0, -g[at] / dg[at], np.inf)
        landed = np.abs(beyond) <= LANDING * h[at] + NEAR
        crossed = (g[at] < 0.0) & ~landed
        onto = h[at] + beyond
        back = np.where((onto > 0.05 * h[at]) & (onto < h[at]), onto, 0.5 * h[at])
        ahead = (beyond > 0.0) & np.isfinite(beyond)
        following[at] = np.where(crossed, back, np.where(ahead, beyond, following[at]))
        accepted[at[crossed]] = False
        home = at[landed]
        new[:, home] += beyond[landed] * k[:INTEGRATED, home]
        lanes.end[home] = End.LANDED
        end = onto[0] / h[0] if record and home.size else 1.0

    if problem.watch:
        better = accepted & (k[WATCHED] > lanes.best)
        np.copyto(lanes.best, k[WATCHED], where=better)
        np.copyto(lanes.before, y[:COMPONENTS], where=better)
        np.copyto(lanes.span, h, where=better)
    lost = accepted & problem.lost(new)
    if lost.any():
        lanes.end[lost & (lanes.end == End.RUNNING)] = End.LOST
    ended = lanes.end != End.RUNNING
    small = following < LAST_STEP
    if np.count_nonzero(small) > np.count_nonzero(ended):
        lanes.end[small & ~ended] = End.STEP_UNDERFLOW
        ended |= small
    step = Step(y.copy(), h, np.array(stages), np.array([end])) if record and accepted[0] else None
    lanes.steps += accepted
    stay = np.flatnonzero(~accepted)
    new[:, stay], k[:, stay] = y[:, stay], lanes.k[:, stay]
    lanes.y, space.new = new, y
    lanes.k, space.stages[-1] = k, lanes.k
    # a lane that has ended stands still until it is taken out
    following[ended] = 0.0
    lanes.h = following
    return step


def _maximum(problem: Problem, columns: Columns, seen: Array, before: Array, span: Array) -> Array:
    """The maximum of the watched quantity, at or beside the largest value seen at the end of a step.

    The secant rule finds where its rate along the trajectory vanishes, with true steps from the start of the
    step before it or, where it still rises there, of the step after it.

    Parameters
    ----------
    seen : the largest value at the end of a step, shape (n,)
    before, span : start (2, n) and length (n,) of that step
    """
    small = DIFFERENCE * span
    space = Space.of(span.size)
    start = np.zeros((INTEGRATED, span.size))
    start[:COMPONENTS] = before

    def slope(y: Array, k: Array) -> Array:
        ahead = problem.rates(y[:COMPONENTS] + small * k[:COMPONENTS], columns)
        return np.asarray((ahead[WATCHED] - k[WATCHED]) / small)

    def step(y: Array, k: Array, h: Array) -> tuple[Array, Array]:
        new, stages = attempt(problem, y, k, h, columns, space)
        return new, stages[-1]

    k = problem.rates(before, columns).copy()
    end, k_end = step(start, k, span)
    rising = slope(end, k_end) > 0.0
    y, k = np.where(rising, end, start), np.where(rising, k_end, k)

    best = np.fmax(seen, k[WATCHED])
    left, right = np.zeros_like(span), span
    d_left, d_right = slope(y, k), slope(*step(y, k, right))
    for _ in range(MAXIMUM_ITERATIONS):
        guess = right - d_right * (right - left) / (d_right - d_left)
        guess = np.where(np.isfinite(guess), np.clip(guess, 0.0, 2.0 * span), right)
        new, k_new = step(y, k, guess)
        best = np.fmax(best, k_new[WATCHED])
        left, d_left, right, d_right = right, d_right, guess, slope(new, k_new)
    return np.asarray(best)
