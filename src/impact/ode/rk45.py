"""Adaptive Dormand-Prince 5(4) over many lanes: every lane has its own step, all are advanced as arrays.

A lane is one initial value problem of two components that ends where an event function falls through zero.
Beside the two, rates that depend on them alone are integrated as quadratures with the same weights, and one
quantity is watched for its maximum. All arithmetic is elementwise and in a fixed order, so that a lane has the
same bits alone, in any crowd and in any order.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from .event import land
from .lanes import RUNNING, Lanes, Trial
from .maximum import search, watch
from .problem import Array, Columns, End, Outcome, Problem, Step
from .step import Space, attempt, local_error

# the controller: a step is multiplied by SAFETY/error^GAIN, within bounds; exponents are in parts of 256. The
# order would have it a FIFTH, but steps that follow the error by less are smoother, and hardly any is rejected
SAFETY, SMALLEST, LARGEST, GAIN, FIFTH = 0.87, 0.2, 3.0, 36, 51
LAST_STEP = 1e-16
# after so many halvings a rate is taken to be not finite for good; they are counted over the whole lane, since
# towards a point beyond which there is no rate every halved step is accepted
HALVINGS = 20
# lanes that are done are taken out when they are more than this fraction
COMPACT_ABOVE = 0.125


def integrate(
    problem: Problem,
    start: Array,
    columns: Columns,
    *,
    rtol: float,
    max_steps: int,
    record: bool = False,
    space: Space | None = None,
) -> Outcome:
    """Integrate every lane from its start to its event.

    Parameters
    ----------
    problem : rates, event and error scale
    start : components at the start, shape (2, n); or all rows, of shape (4, n), where it goes on
    columns : what the rates need per lane, each of shape (n,)
    rtol : local error per step, relative to max(|y|, floor)
    max_steps : attempted steps after which a lane is given up
    record : keep every accepted step for the interpolant; for a single lane
    space : room of an earlier call for as many lanes or more

    Returns
    -------
    Outcome : a failed lane has NaN for its state, and its reason in `end`
    """
    n = start.shape[1]
    outcome = Outcome.blank(n)
    recorded: list[Step] = []
    space = Space.of(n) if space is None else space.narrow(n)
    with np.errstate(all="ignore"):
        lanes = Lanes.begin(problem, start, columns, space.narrow(n), first_step(problem, rtol))
        for count in range(1, max_steps + 1):
            step = _advance(problem, lanes, rtol, record)
            if step is not None:
                recorded.append(step)
            if count == max_steps:
                lanes.end[lanes.end == RUNNING] = End.MAX_STEPS
            if np.count_nonzero(lanes.end) <= COMPACT_ABOVE * lanes.end.size and count < max_steps:
                continue
            lanes.put(outcome)
            lanes = lanes.compacted()
            if not lanes.index.size:
                break
        if problem.watch:
            search(problem, columns, lanes.top, outcome.maximum, space)
    return replace(outcome, recorded=tuple(recorded))


def _advance(problem: Problem, lanes: Lanes, rtol: float, record: bool) -> Step | None:
    """Try one step in every running lane; accept, land or shorten it. Returns a step to be recorded."""
    y, h, space, running = lanes.y, lanes.h, lanes.space, lanes.end == RUNNING
    new, stages = attempt(problem, y, lanes.k, h, lanes.columns, space)
    worst = local_error(problem, stages, y, new, h, space)
    trial = Trial(new, stages[-1], worst <= rtol, _following(h, worst, rtol))
    if np.count_nonzero(trial.within) < worst.size:
        _halve(lanes, trial, worst)
    accepted = trial.within & running
    home, rest = land(problem, lanes, trial, accepted)
    accepted &= trial.within

    if problem.watch:
        watch(lanes, trial, accepted, home)
    lost = problem.lost(new, trial.k, lanes.columns)
    if np.count_nonzero(lost):
        lanes.end[lost & accepted & (lanes.end == RUNNING)] = End.LOST
    small = trial.following < LAST_STEP
    if np.count_nonzero(small):
        lanes.end[small & (lanes.end == RUNNING)] = End.STEP_UNDERFLOW
    lanes.steps += accepted
    end = 1.0 + rest if home.size else np.ones(1)
    step = Step.of(y, h, stages, end) if record and accepted[0] else None
    _move(lanes, trial)
    return step


def first_step(problem: Problem, rtol: float) -> float:
    """The length of the first step, by which none of an ordinary impact is rejected."""
    return problem.first * _of_tolerance(rtol)


@cache
def _of_tolerance(rtol: float) -> float:
    """What the step of an error of 1 is to be multiplied by, in full."""
    return float(_factor(np.ones(1), rtol, FIFTH)[0])


def _following(h: Array, worst: Array, rtol: float) -> Array:
    """The length of the next step by the controller."""
    following = _factor(worst, rtol, GAIN)
    np.minimum(following, LARGEST, out=following)
    np.maximum(following, SMALLEST, out=following)
    following *= h
    return following


def _factor(worst: Array, rtol: float, exponent: int) -> Array:
    """What the step of an error is to be multiplied by."""
    # the bits of a number taken for an integer are its logarithm, but for a few per cent; unlike those of a power
    # they are the same on every processor
    bits = worst.view(np.int64) >> 8
    bits *= exponent
    np.subtract(_bits(SAFETY) + (_bits(rtol) >> 8) * exponent, bits, bits)
    return bits.view(np.float64)


def _bits(number: float) -> int:
    return int(np.float64(number).view(np.int64))


def _halve(lanes: Lanes, trial: Trial, worst: Array) -> None:
    """Halve a step with a rate that is not finite."""
    at = np.flatnonzero(~trial.within)
    at = at[~np.isfinite(worst[at]) & (lanes.end[at] == RUNNING)]
    trial.following[at] = 0.5 * lanes.h[at]
    lanes.halvings[at] += 1
    lanes.end[at[lanes.halvings[at] > HALVINGS]] = End.NOT_FINITE


def _move(lanes: Lanes, trial: Trial) -> None:
    """Go to the ends of the steps accepted; a lane that has ended stands still until it is taken out."""
    stay = (~trial.within).nonzero()[0]
    if stay.size:
        for row, before in (*zip(trial.new, lanes.y, strict=True), *zip(trial.k, lanes.k, strict=True)):
            row[stay] = before[stay]
        lanes.h[stay] = lanes.last[stay]
    lanes.space.new, lanes.y = lanes.y, trial.new
    lanes.space.stages[-1], lanes.k = lanes.k, trial.k
    trial.following[lanes.end != RUNNING] = 0.0
    lanes.last, lanes.h = lanes.h, trial.following
