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
from .tableau import ERROR_WEIGHTS, STAGE_WEIGHTS

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

    def keep(self, mask: Mask) -> _Lanes:
        kept: dict[str, Any] = {
            name: tuple(column[mask] for column in value) if name == "columns" else value[..., mask]
            for name, value in vars(self).items()
        }
        return _Lanes(**kept)


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
        for attempt in range(1, max_steps + 1):
            step = _advance(problem, lanes, rtol, record)
            if step is not None:
                recorded.append(step)
            if attempt == max_steps:
                lanes.end[lanes.end == End.RUNNING] = End.MAX_STEPS
            done = lanes.end != End.RUNNING
            if np.count_nonzero(done) <= COMPACT_ABOVE * done.size and attempt < max_steps:
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
    k = problem.rates(start, columns)
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
    )


def _attempt(problem: Problem, y: Array, k: Array, h: Array, columns: Columns) -> tuple[Array, list[Array]]:
    """One step of length h from rows y whose rates are k: the rows (as many as y has) and the seven stages."""
    stages = [k]
    part = np.empty_like(y[:COMPONENTS])
    term = np.empty_like(part)
    for weights in STAGE_WEIGHTS[1:-1]:
        _weighted(weights, stages, COMPONENTS, part, term)
        part *= h
        part += y[:COMPONENTS]
        stages.append(problem.rates(part, columns))
    new, term = np.empty_like(y), np.empty_like(y)
    _weighted(STAGE_WEIGHTS[-1], stages, len(y), new, term)
    new *= h
    new += y
    stages.append(problem.rates(new[:COMPONENTS], columns))
    return new, stages


def _weighted(
    weights: tuple[tuple[int, float], ...], stages: list[Array], rows: int, total: Array, term: Array
) -> None:
    """The weighted sum of the first rows of the stages, term by term in order, into `total`."""
    (first, weight), *rest = weights
    np.multiply(stages[first][:rows], weight, out=total)
    for stage, weight in rest:
        np.multiply(stages[stage][:rows], weight, out=term)
        total += term


def _advance(problem: Problem, lanes: _Lanes, rtol: float, record: bool) -> Step | None:
    """Try one step in every running lane; accept, land or shorten it. Returns a step to be recorded."""
    y, h, running = lanes.y, lanes.h, lanes.end == End.RUNNING
    new, stages = _attempt(problem, y, lanes.k, h, lanes.columns)
    k = stages[-1]

    error, term = np.empty_like(y[:COMPONENTS]), np.empty_like(y[:COMPONENTS])
    _weighted(ERROR_WEIGHTS, stages, COMPONENTS, error, term)
    error *= h
    np.abs(error, out=error)
    scale = np.maximum(np.abs(y[:COMPONENTS]), np.abs(new[:COMPONENTS]), out=term)
    for row, floor in zip(scale, problem.floor, strict=True):
        np.maximum(row, floor, out=row)
    error /= scale
    worst = np.maximum(error[0], error[1]) / rtol
    finite = np.isfinite(worst)
    accepted = running & (worst <= 1.0)

    # the next step by the controller; one with a rate that is not finite is halved
    eighth = np.sqrt(np.sqrt(np.sqrt(worst)))
    factor = np.clip(SAFETY / (eighth * np.sqrt(eighth)), SMALLEST, LARGEST)
    following = h * np.where(finite, factor, 0.5)

    # a step across the event is not accepted but shortened onto it by Newton's iteration, so that the way to
    # the event is a true step of order five
    g, dg = problem.event(new[:COMPONENTS], k, lanes.columns)
    beyond = np.where(accepted & (dg < 0.0), -g / dg, np.inf)
    landed = np.abs(beyond) <= LANDING * h + NEAR
    crossed = accepted & (g < 0.0) & ~landed
    accepted &= ~crossed
    onto = h + beyond
    following = np.where(crossed, np.where((onto > 0.05 * h) & (onto < h), onto, 0.5 * h), following)
    following = np.where(accepted & (beyond > 0.0) & (beyond < SHORT * h), beyond, following)
    at = np.flatnonzero(landed)
    new[:, at] += beyond[at] * k[:INTEGRATED, at]

    if problem.watch:
        better = accepted & (k[WATCHED] > lanes.best)
        np.copyto(lanes.best, k[WATCHED], where=better)
        np.copyto(lanes.before, y[:COMPONENTS], where=better)
        np.copyto(lanes.span, h, where=better)
    lanes.halvings += ~finite
    lanes.end[running & (lanes.halvings > HALVINGS)] = End.NOT_FINITE
    lanes.end[running & finite & (following < LAST_STEP) & ~landed] = End.STEP_UNDERFLOW
    lanes.end[accepted & problem.lost(new)] = End.LOST
    lanes.end[landed] = End.LANDED
    step = None
    if record and accepted.all():
        step = Step(y.copy(), h, np.array(stages), np.where(landed, onto / h, 1.0))
    lanes.steps += accepted
    np.copyto(y, new, where=accepted)
    np.copyto(lanes.k, k, where=accepted)
    # a lane that has ended stands still until it is taken out
    lanes.h = np.where(lanes.end == End.RUNNING, following, 0.0)
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

    def slope(y: Array, k: Array) -> Array:
        ahead = problem.rates(y + small * k[:COMPONENTS], columns)
        return np.asarray((ahead[WATCHED] - k[WATCHED]) / small)

    def step(y: Array, k: Array, h: Array) -> tuple[Array, Array]:
        new, stages = _attempt(problem, y, k, h, columns)
        return new, stages[-1]

    k = problem.rates(before, columns)
    end, k_end = step(before, k, span)
    rising = slope(end, k_end) > 0.0
    y, k = np.where(rising, end, before), np.where(rising, k_end, k)

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
