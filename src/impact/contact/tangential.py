"""Tangential trajectories: the slip of impacts under friction, each distinct problem integrated once.

In the contact's own units, with G = (m_t/m) g/(mu v0) and phi = f/mu, the slip obeys G' = -phi, whatever mu, angle
and inertia are: they enter by the slip at first contact, G0, alone. Normal motion and slip are integrated
together, see `impact.contact.slip_motion`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..array_types import AnyArray, Array, Int8Array, Mask
from ..ode.problem import Params, Problem, Solution, Step
from ..ode.rk45 import integrate
from . import motion, simulate
from .dimensionless import exact_restitution, with_coefficients, with_units
from .fixed_step import (
    EXACT,
    LIMIT_POSITIVE,
    PREFIX,
    SLIP,
    SLIP_SCALE,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
    FixedStepSlip,
)
from .formula_calls import argument_names
from .friction import Pair
from .piecewise import in_parts
from .records import CollisionResult, Record
from .slip_motion import (
    ORDER_TOLERANCE,
    SLIDES,
    SLIP_ROW,
    STICKS,
    TIME_ROW,
    Columns,
    SlipPhase,
    TangentialForm,
    Track,
)
from .status import LIMIT, STATUS_OK, FrictionStatus, Status

# G0 below which the slip after is proportional to that before, and above which it is the same, up to rounding
SLIP_BOUNDS = (1e-12, 1e14)
# of a result
WORKS = ("slip_work", "damping_work", "memory_work", "elastic_left")


@dataclass(frozen=True)
class TangentialResult(Record):
    """Tangential trajectories, in the contact's own units; arrays of shape (n,).

    `slip` is G at the end for a positive G0; works are in units of mu^2 (m v0)^2/m_t; `sliding_impulse` is the
    integral of the limiting normal force, Lambda; `exact` is `slip` in closed form, NaN without one; `stiffness`
    is kappa m/m_t, where kappa is that of Maw, Barber and Fawcett, NaN for a kind without a spring. For the kind
    "coulomb" there is only `sliding_impulse`, from which the slip follows, and `exact` is its closed form.
    """

    statuses = FrictionStatus

    slip: Array
    sliding_impulse: Array
    slip_work: Array
    damping_work: Array
    memory_work: Array
    elastic_left: Array
    regime: Int8Array
    slip_changes: NDArray[np.int32]
    exact: Array
    stiffness: Array
    steps: NDArray[np.int32]
    status: Int8Array


class RecordedSlip(NamedTuple):
    """The joint motion of one impact in a phase, and its steps, with the modes of friction among their params."""

    phase: SlipPhase
    steps: tuple[Step, ...]


def simulate_friction(
    pair: Pair,
    n: Array,
    values: simulate.ValueArrays,
    status: Int8Array,
    *,
    rtol: float,
    max_steps: int,
    collapse: bool = True,
    core: str = "numpy",
    integrator: str = EXACT,
    errors: dict[str, str] | None = None,
    recorded: list[RecordedSlip] | None = None,
) -> TangentialResult:
    """Integrate the slip of impacts by a pair of laws; one that fails has a status, and affects no other.

    Parameters
    ----------
    n : compliance exponents, shape (k,)
    values : `dimensionless_values` of the impacts by the normal law, and `friction_values`, each of shape (k,);
        for a scheme also those of its step, see `simulate`
    status : `FrictionStatus` by `check_inputs` and `check_friction`, shape (k,); impacts that are not OK are not
        integrated, nor are those without slip, or without friction, whose G0 is 0 or infinite
    core : "numpy"; another core, which only integrates normal motions, is not used
    integrator : "exact", or a scheme with a fixed step, which has no works
    recorded : receives both phases of the slip of a single impact

    Raises
    ------
    ModelError : of the errors of a law, only what is raised outside its formulas
    """
    integrate_slip = partial(_integrate, rtol=rtol, max_steps=max_steps, recorded=recorded)
    simulate_part = partial(_simulate_distinct, pair, integrate_slip)
    if integrator != EXACT:
        compute = partial(simulate.integrate_collisions, rtol=rtol, max_steps=max_steps, core=core)
        collide = partial(
            simulate.collide_at_fixed_steps, pair.model, scheme=integrator, compute=compute, max_steps=max_steps
        )
        simulate_part = partial(_slip_at_fixed_steps, pair, collide)
    return simulate.simulate_parts(TangentialResult, pair.key, n, values, status, simulate_part, collapse, errors)


def _simulate_distinct(
    pair: Pair, integrate_slip: Callable[..., TangentialResult], part: simulate.Part
) -> TangentialResult:
    """Integrate each distinct dimensionless problem once."""
    n, values, count, collapse = part
    form = pair.form(n)
    # a coordinate in which the powers of x of the friction are smooth, too
    powers = (form.stiffness_power, form.damping_power)
    smooth = (p for p in (pair.model.coordinate_power, 4, 8) if all(float(p * q).is_integer() for q in powers))
    model = replace(pair.model, coordinate_power=next(smooth, pair.model.coordinate_power))
    law_values = with_coefficients(model, with_units(values, n), count)
    status = simulate.check_coefficients(model, law_values, count)
    slip = np.ones(count) if form.kind == "coulomb" else np.abs(values[SLIP])
    zero = np.zeros(count)
    stiffness = values[TANGENTIAL_STIFFNESS] if form.kind == "spring" else zero
    damping, is_positive = (values.get(name, zero) for name in (TANGENTIAL_DAMPING, LIMIT_POSITIVE))
    # without friction the slip is infinite in units of it
    has_friction = (slip != 0.0) & np.isfinite(slip)
    is_invalid = has_friction & ~(np.isfinite(stiffness) & np.isfinite(damping))
    status[(status == STATUS_OK) & is_invalid] = Status.OUT_OF_RANGE
    coefficient = (
        values[SLIP_SCALE] * slip if name == "y" else values[PREFIX + name]
        for name in argument_names(form.coefficient)
    )
    # modes are those of no slip, or of no friction, there; the limit of friction would vanish in rounding errors
    integrated = np.clip(slip, *SLIP_BOUNDS) if form.has_modes else slip
    columns = (integrated, stiffness, damping, is_positive, *coefficient)
    chosen = (status == STATUS_OK) & has_friction
    exact = exact_restitution(model, law_values, count)
    parts = []
    for problems in simulate.distinct_problems(model, n, law_values, chosen, collapse, columns):
        never_separates = exact[problems.rows][problems.first] == 0.0
        distinct = integrate_slip(form, problems, never_separates)
        parts.append((problems.rows, distinct.take(problems.row_of_impact)))
    result = TangentialResult.joined(count, status, parts)
    share = np.where(has_friction, slip / integrated, 1.0)
    for name in ("slip", "exact"):
        getattr(result, name)[:] *= share
    for name in WORKS:
        getattr(result, name)[:] *= np.where(share > 1.0, share, share * share)
    if form.kind == "coulomb":
        # with infinite damping the balls stop at first contact
        result.sliding_impulse[status == LIMIT] = 1.0
        result.exact[:] *= 1.0 + exact
    return result


def _slip_at_fixed_steps(
    pair: Pair, collide: Callable[..., CollisionResult], part: simulate.Part
) -> TangentialResult:
    """Integrate slips at a fixed step; those without slip or friction as contacts without slip."""
    n, values, count, _ = part
    form = pair.form(n)
    slip = FixedStepSlip.of(form, values, count)
    is_invalid = (slip.slip != 0.0) & ~(np.isfinite(slip.stiffness) & np.isfinite(slip.damping))
    collisions = collide(part, slip=slip)
    status = np.where(is_invalid & (collisions.status == STATUS_OK), Status.OUT_OF_RANGE, collisions.status)
    result = replace(TangentialResult.blank(count), steps=collisions.steps, status=status.astype(np.int8))
    answers: dict[str, AnyArray] = {"sliding_impulse": slip.impulse}
    if form.kind != "coulomb":
        answers |= {"slip": slip.slip, "regime": slip.regime, "slip_changes": slip.changes}
    for name, column in answers.items():
        np.copyto(getattr(result, name), column, where=status == STATUS_OK)
    return replace(result, stiffness=slip.stiffness / n) if form.kind == "spring" else result


def _integrate(
    form: TangentialForm,
    problems: simulate.DistinctProblems,
    never_separates: Mask,
    rtol: float,
    max_steps: int,
    recorded: list[RecordedSlip] | None,
) -> TangentialResult:
    """Integrate distinct problems through both phases."""
    law = problems.law
    slip, stiffness, damping, is_positive, *coefficient = (np.array(column, float) for column in problems.columns)
    n = slip.size
    track, form = Track.of(n), replace(form, has_dashpot=bool(damping.any()))
    unset, compliance = np.zeros(n), np.where(stiffness > 0.0, 1.0 / stiffness, 0.0)
    base = Columns(
        *(unset,) * 7, np.arange(n, dtype=float), np.sqrt(stiffness), compliance, damping, slip, is_positive, unset
    )
    states: list[Array] = []

    def solve(
        law: motion.MotionLaw, problem: Problem, start: Array, params: Params, recovery: simulate.Recovery | None
    ) -> Solution:
        index, residual = recovery or (slice(None), None)
        in_phase = Columns(*(column[index] for column in base))
        in_phase = in_phase if residual is None else in_phase._replace(residual=residual)
        columns = (*in_phase, *(column[index] for column in coefficient))
        rows = np.vstack([start, *(states[0][2:, index] if states else (np.ones(n), np.zeros(n)))])
        params, breakpoints = motion.breakpoints(law, params, rows, residual)
        phase = SlipPhase(form, law, problem, len(params), recovery is not None, track, breakpoints)

        def run(problem: Problem, start: Array, params: Params) -> Solution:
            y, params = phase.begin(start, params)
            solution = integrate(problem, y, params, rtol=rtol, max_steps=max_steps, record=recorded is not None)
            phase.finish(solution.state, params)
            return solution

        solution = in_parts(run, phase.problem(), breakpoints, rows, (*params, *columns))
        states.append(solution.state)
        if recorded is not None:
            recorded.append(RecordedSlip(phase, solution.recorded))
        return solution

    phases = simulate.solve_phases(law, problems.params, n, solve, never_separates)
    state, steps = states[0].copy(), phases.approach.steps.copy()
    if phases.restitution is not None:
        state[:, phases.rows] = states[1]
        steps[phases.rows] += phases.restitution.steps
    if law.model.release == "gap":
        track.touches[:] |= np.abs(track.mode) == 1.0
    result = _result(form, law.n, base, track, state)
    status = phases.status.copy()
    # at a limit the balls stop, sooner or later
    stopped = status == LIMIT
    press = np.sign(base.changed(track.mode, track.sign).share)
    result.sliding_impulse[stopped] = (track.impulse + press * track.v)[stopped]
    status[(status == STATUS_OK) & track.is_slow] = FrictionStatus.SLOW_LIMIT
    if form.kind != "coulomb":
        # whatever the reason, an answer is a number
        has_answer = (status == STATUS_OK) | (status == FrictionStatus.SLOW_LIMIT)
        status[has_answer & ~np.isfinite(result.slip)] = FrictionStatus.NOT_FINITE
    return replace(result, steps=steps, status=status)


def _result(form: TangentialForm, n: float, base: Columns, track: Track, state: Array) -> TangentialResult:
    """Compute what trajectories come to from their last rows, NaN where they have not ended."""
    scale, G0 = base.G0 * base.G0, base.G0
    mode, left = np.abs(track.mode), track.energy
    at_limit, work = form.integral("limit_memory", state), form.integral("work", state)
    held_memory = track.held_memory + np.where(mode == 2.0, at_limit, 0.0)
    slip_work = track.slip_work - np.where(mode == 1.0, left + work, 0.0) + held_memory
    rest = 0.5 * state[SLIP_ROW] ** 2 + left + at_limit
    damping_work = work + track.damping_work - np.where(mode == 2.0, rest, 0.0)
    memory_work = np.zeros_like(slip_work)
    if form.stiffness_power:
        stuck_work = form.integral("stick_work", state) - track.stick_energy - np.where(mode == 0.0, left, 0.0)
        # where N vanishes so slowly with x that both works are infinite at x = 0, the slip work is their sum, in
        # which the infinite part cancels: it is not added to either, since rounding would be left of it
        is_infinite = track.touches & (2.0 * track.order < form.stiffness_power + ORDER_TOLERANCE)
        slip_work += np.where(is_infinite, stuck_work, -at_limit)
        memory_work = np.where(is_infinite, 0.0, stuck_work + at_limit)
    if form.kind == "regularized":
        slip_work, damping_work = work, memory_work
    ended = np.isfinite(state[SLIP_ROW])
    nan = np.full(ended.size, np.nan)
    result = replace(TangentialResult.blank(ended.size), sliding_impulse=np.where(ended, track.impulse, np.nan))
    if form.kind == "coulomb":
        # without tension Lambda is 1 + e_out
        return replace(result, exact=np.where(ended & (track.sign > 0.0), 1.0, np.nan))
    regime = np.zeros_like(track.regime) if form.kind == "regularized" else track.regime
    exact = np.where(regime == SLIDES, G0 - track.signed, nan)
    if form.kind == "spring" and form.stiffness_power == 0.0:
        swing = G0 * np.cos(base.root * state[TIME_ROW])
        exact = np.where((regime == STICKS) & (base.damping == 0.0), swing, exact)
    return replace(
        result,
        slip=G0 * state[SLIP_ROW],
        slip_work=scale * slip_work,
        damping_work=scale * damping_work,
        memory_work=scale * memory_work,
        elastic_left=scale * np.where(ended, track.energy, np.nan),
        regime=np.where(ended, regime, np.int8(0)),
        slip_changes=np.where(ended, track.changes, 0).astype(np.int32),
        exact=np.where(ended, exact, np.nan),
        stiffness=base.root**2 / n if form.kind == "spring" else nan,
    )
