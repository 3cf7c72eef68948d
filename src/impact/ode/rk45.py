"""Adaptive Dormand-Prince 5(4) for many trajectories, each with its own step size, advanced as arrays.

A trajectory is an initial value problem that ends where an event function falls through zero. Quadratures, whose
rates depend on the components alone, are integrated with the same weights, and the maximum of one watched quantity
is located. All arithmetic is elementwise and in a fixed order, so that a trajectory has the same bits alone, in
any batch and in any order. The pair and its interpolant are those of `impact.ode.tableau` (Dormand and Prince
1980, Shampine 1986); an event ends a trajectory inside a step, see `impact.ode.events`.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Indices
from .events import choose, locate_event
from .maximum import refine_maximum, update_peaks
from .problem import Params, Problem, Solution, Step, Termination
from .state import RUNNING, State, TrialStep, Workspace
from .switches import locate_switches
from .tableau import A, E

# the controller: a step is multiplied by SAFETY/error^CONTROLLER_EXPONENT, within
# bounds; exponents are in parts of 256. The order of the method suggests 1/5 (51/256), but with a smaller exponent
# steps vary less, and few are rejected
SAFETY, MIN_FACTOR, MAX_FACTOR, CONTROLLER_EXPONENT, FIRST_STEP_EXPONENT = 0.87, 0.2, 3.0, 36, 51
MIN_STEP = 1e-16
# halvings of steps with a rate that is not finite, after which a trajectory fails; they are counted over the whole
# trajectory, since near a point beyond which no rate is finite every halved step is accepted
MAX_HALVINGS = 20
# ended trajectories are removed when they are more than this fraction of all
COMPACT_ABOVE = 0.125

NestedWeights = tuple[tuple[int, Array], ...]


def _nested_weights(row: tuple[Fraction, ...]) -> NestedWeights:
    """Write a row of weights for `_weighted_sum`: each relative to the next, zeros left out."""
    stages = [stage for stage, weight in enumerate(row) if weight]
    next_weights = [*(row[stage] for stage in stages[1:]), Fraction(1)][: len(stages)]
    ratios = (float(row[stage] / other) for stage, other in zip(stages, next_weights, strict=True))
    # as arrays: NumPy converts a float on every call
    return tuple((stage, np.array(ratio)) for stage, ratio in zip(stages, ratios, strict=True))


STAGE_WEIGHTS, ERROR_WEIGHTS = tuple(map(_nested_weights, A[1:])), _nested_weights(E)


# 16 MiB, once, so that glibc keeps freed arrays of that size: the first use of new pages is slow
np.empty(1 << 21)


def integrate(
    problem: Problem,
    start: Array,
    params: Params,
    *,
    rtol: float,
    max_steps: int,
    record: bool = False,
) -> Solution:
    """Integrate every trajectory from its start to its event; the state of a failed trajectory is NaN.

    Parameters
    ----------
    start : components at the start, shape (components, n); or all rows, where it continues
    params : arguments of the rates per trajectory, each of shape (n,)
    rtol : local error per step, relative to max(|y|, floor)
    max_steps : attempted steps after which a trajectory fails
    record : whether to keep every accepted step for the interpolant; of the first trajectory, all are equal
    """
    n = start.shape[1]
    solution = Solution.blank(n, problem.n_integrated)
    recorded: list[Step] = []
    workspace = Workspace.of(problem, n)
    with np.errstate(all="ignore"):
        state = State.begin(problem, start, params, workspace.narrow(n), first_step(problem, rtol))
        for count in range(1, max_steps + 1):
            step = _advance(problem, state, rtol, record)
            if step is not None:
                recorded.append(step)
            if count == max_steps:
                state.termination[state.termination == RUNNING] = Termination.MAX_STEPS
            if np.count_nonzero(state.termination) <= COMPACT_ABOVE * state.termination.size and count < max_steps:
                continue
            state.put(solution)
            state = state.compacted()
            if not state.index.size:
                break
        if problem.watch:

            def take_step(positions: Indices, y: Array, k: Array, h: Array) -> tuple[Array, Array]:
                step_params = tuple(column[positions] for column in params)
                y_end, stages = rk_step(problem, y, k, h, step_params, workspace.narrow(positions.size))
                return y_end, stages[-1]

            refine_maximum(problem, params, state.peak, solution.maximum, take_step)
    return replace(solution, recorded=tuple(recorded))


def _advance(problem: Problem, state: State, rtol: float, record: bool) -> Step | None:
    """Try a step of every running trajectory; accept, end or shorten it. Returns the step if it is recorded."""
    y, h, workspace, running = state.y, state.h, state.workspace, state.termination == RUNNING
    y_end, stages = rk_step(problem, y, state.k, h, state.params, workspace)
    # copied here: a switch changes params and the last stage
    step = Step.of(y, h, stages, state.params) if record else None
    error = local_error(problem, stages, y, y_end, h, workspace)
    trial = TrialStep(y_end, stages[-1], error <= rtol, next_step(h, error, rtol))
    if np.count_nonzero(trial.is_accurate) < error.size:
        _halve_non_finite_steps(state, trial, error)
    accepted = trial.is_accurate & running
    ended, offset = locate_event(problem, state, trial, accepted)
    accepted &= trial.is_accurate
    if problem.switch is not None:
        beyond = locate_switches(problem, problem.switch, state, trial, accepted)
        accepted &= trial.is_accurate
        remain = accepted[ended]
        ended, offset = ended[remain], offset[remain]
        if step is not None and beyond.size:
            step = replace(step, end=1.0 + beyond[:1])

    if problem.watch:
        update_peaks(problem, state, trial, accepted, ended)
    unreachable = problem.unreachable(y_end, trial.k, state.params)
    if np.count_nonzero(unreachable):
        unreachable &= accepted & (state.termination == RUNNING)
        state.termination[unreachable] = Termination.EVENT_UNREACHABLE
    small = trial.h_next < MIN_STEP
    if np.count_nonzero(small):
        state.termination[small & (state.termination == RUNNING)] = Termination.STEP_UNDERFLOW
    state.steps += accepted
    if step is not None and ended.size:
        step = replace(step, end=1.0 + offset[:1])
    _move_to_ends(state, trial)
    return step if step is not None and accepted[0] else None


def rk_step(
    problem: Problem, y: Array, k: Array, h: Array, params: Params, workspace: Workspace
) -> tuple[Array, list[Array]]:
    """Take a step of length h from rows y with rates k: rows at its end and the seven stages, in the workspace."""
    components, integrated = problem.n_components, problem.n_integrated
    stages, slopes = [k], [k[:components]]
    part, y_end, start = workspace.part[:components], workspace.y_end, y[:components]
    for weights, rows in zip(STAGE_WEIGHTS[:-1], workspace.stages[:-1], strict=True):
        _weighted_sum(weights, slopes, part)
        np.multiply(part, h, part)
        np.add(part, start, part)
        stages.append(problem.rates(part, params, rows))
        slopes.append(stages[-1][:components])
    _weighted_sum(STAGE_WEIGHTS[-1], [stage[:integrated] for stage in stages], y_end)
    np.multiply(y_end, h, y_end)
    np.add(y_end, y, y_end)
    stages.append(problem.rates(y_end[:components], params, workspace.stages[-1]))
    return y_end, stages


def _weighted_sum(weights: NestedWeights, stages: list[Array], total: Array) -> None:
    """Write the weighted sum of the stages to `total`, in order, by Horner's scheme: it needs no other memory."""
    (first, weight), *rest = weights
    np.multiply(stages[first], weight, total)
    for stage, weight in rest:
        np.add(total, stages[stage], total)
        np.multiply(total, weight, total)


def local_error(
    problem: Problem, stages: list[Array], y: Array, y_end: Array, h: Array, workspace: Workspace
) -> Array:
    """Compute the norm of the local error of a step, shape (n,)."""
    judged = len(problem.floor)
    error = workspace.part[:judged]
    # the stage that may lack quadratures has no weight in the error
    _weighted_sum(ERROR_WEIGHTS, [stage[:judged] for stage in stages], error)
    np.multiply(error, h, error)
    norm = error_norm(error[0], error[1], y[0], y[1], y_end[0], y_end[1], problem.floor)
    for row in range(2, judged):
        scale = larger(larger(np.abs(y[row]), np.abs(y_end[row])), problem.floor[row])
        norm = larger(norm, np.abs(error[row]) / scale)
    return norm


# The formulas from here to `next_step` hold for arrays and, compiled, for numbers; the compiled back end has its
# own versions of `larger`, `larger_quotient`, `bits` and `from_bits`.


def larger(this: Array, other: Array | float) -> Array:
    """The larger of two values."""
    return np.maximum(this, other)


def larger_quotient(this: Array, divisor: Array, other: Array, other_divisor: Array) -> Array:
    """The larger of two quotients; NaN if any is NaN."""
    return np.maximum(this / divisor, other / other_divisor)


def error_norm(
    error_0: Array, error_1: Array, y_0: Array, y_1: Array, end_0: Array, end_1: Array, floor: tuple[float, ...]
) -> Array:
    """The larger error of the first two components, each relative to the largest of |y|, |y_end| and its floor."""
    scale_0 = larger(larger(np.abs(y_0), np.abs(end_0)), floor[0])
    scale_1 = larger(larger(np.abs(y_1), np.abs(end_1)), floor[1])
    return larger_quotient(np.abs(error_0), scale_0, np.abs(error_1), scale_1)


def bits(number: Array | float) -> NDArray[np.int64]:
    """The bits of a number as an integer."""
    return np.asarray(number, float).view(np.int64)


def from_bits(whole: NDArray[np.int64]) -> Array:
    """The number that has these bits."""
    return np.asarray(whole, np.int64).view(np.float64)


SAFETY_BITS = int(bits(SAFETY))


def step_factor(error: Array, rtol: float, exponent: int) -> Array:
    """SAFETY (rtol/error)^(exponent/256), within a few per cent.

    The bits of a number, taken as an integer, are its logarithm within a few per cent. Unlike those of a power
    they are the same on every processor.
    """
    return from_bits(SAFETY_BITS + (bits(rtol) >> 8) * exponent - (bits(error) >> 8) * exponent)


def next_step(h: Array, error: Array, rtol: float) -> Array:
    """Choose the length of the next step by the controller."""
    factor = step_factor(error, rtol, CONTROLLER_EXPONENT)
    factor = choose(factor < MAX_FACTOR, factor, MAX_FACTOR)
    return h * choose(factor > MIN_FACTOR, factor, MIN_FACTOR)


def first_step(problem: Problem, rtol: float) -> float:
    """Choose the length of the first step, which is accepted in ordinary impacts."""
    return problem.step_at_unit_error * float(step_factor(np.ones(1), rtol, FIRST_STEP_EXPONENT)[0])


def _halve_non_finite_steps(state: State, trial: TrialStep, error: Array) -> None:
    """Halve the steps that have a rate which is not finite; end trajectories after too many halvings."""
    positions = np.flatnonzero(~trial.is_accurate)
    positions = positions[~np.isfinite(error[positions]) & (state.termination[positions] == RUNNING)]
    trial.h_next[positions] = 0.5 * state.h[positions]
    state.halvings[positions] += 1
    state.termination[positions[state.halvings[positions] > MAX_HALVINGS]] = Termination.NOT_FINITE


def _move_to_ends(state: State, trial: TrialStep) -> None:
    """Move to the ends of the accepted steps; an ended trajectory has steps of length 0 until it is removed."""
    stay = (~trial.is_accurate).nonzero()[0]
    if stay.size:
        for row, before in (*zip(trial.y, state.y, strict=True), *zip(trial.k, state.k, strict=True)):
            row[stay] = before[stay]
        state.h[stay] = state.h_last[stay]
    state.workspace.y_end, state.y = state.y, trial.y
    state.workspace.stages[-1], state.k = state.k, trial.k
    trial.h_next[state.termination != RUNNING] = 0.0
    state.h_last, state.h = state.h, trial.h_next
