"""Simulate collisions: dimensionless impacts through both phases, each distinct one integrated once.

In units of m, v₀ and δ* = (m v₀²/K)^(1/(n+1)) the motion of every law is x'' = −f(x, x'; groups), x(0) = 0,
x'(0) = 1, where the groups are a few pure numbers, such as χ. Impacts with the same groups are one trajectory. It
ends its approach at zero velocity, where a law with an unloading branch changes to it, and its restitution at zero
indentation or zero force, as the law declares. For the coordinates see `impact.contact.motion`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import NamedTuple, NotRequired, TypedDict, TypeVar

import numpy as np

from ..array_types import Array, Indices, Int8Array, Mask
from ..errors import ModelError
from ..ode.problem import Params, Problem, Solution, Termination
from ..ode.rk45 import integrate
from . import motion
from .dimensionless import LawValues, chi_of, exact_restitution, with_coefficients, with_units
from .fixed_step import EXACT, MAX_CONTACTS, MUJOCO_CONE, PREFIX, SLIP, FixedStepSlip, collide_at_fixed_step
from .formula_calls import argument_names, describe_error
from .model import ForceModel
from .numba import dispatch
from .piecewise import in_parts
from .powers import distinct_values, integer_power, power
from .records import CollisionResult, Positions, Record, deduplicate, positions
from .slip_motion import TangentialForm
from .status import LIMIT, STATUS_OK, Status
from .velocity_coordinates import VelocityCoordinate, is_strong

# the status that belongs to each termination, by its number; no trajectory ends running
STATUS_OF_TERMINATION = np.array(
    [0, Status.OK, Status.NOT_SEPARATED, Status.MAX_STEPS, Status.STEP_UNDERFLOW, Status.NOT_FINITE], np.int8
)

# names of the values of a fixed step, which no value of a law has: steps in the contact time of the continuous
# law, or the step in the contact's unit of time; and the phase
STEPS_PER_CONTACT, STEP, PHASE = "sweep.steps_per_contact", "sweep.dt", "sweep.phase"
# the contact time of a linear spring, in the contact's unit of time
LINEAR_CONTACT_TIME = np.pi
# an end at zero force between two steps is searched for down to this part of the recovered indentation
HIDDEN_END, HIDDEN_END_BISECTIONS = 1e-12, 60
# parts of the s of that end at which the force beyond it is averaged
HIDDEN_PARTS = (np.arange(8.0) + 0.5) / 8.0

# arrays that a law needs, by name, in the contact's own units
ValueArrays = Mapping[str, Array]

T = TypeVar("T", bound=Record)

# computes the collisions of distinct impacts, see `integrate_collisions`
ComputeCollisions = Callable[..., CollisionResult]


class Part(NamedTuple):
    """Impacts with the same n: their values, their number, and whether equal ones are integrated once."""

    n: float
    values: ValueArrays
    size: int
    collapse: bool

    def at(self, rows: Positions, size: int) -> Part:
        """Choose some of the impacts."""
        return self._replace(values={name: array[rows] for name, array in self.values.items()}, size=size)


class Settings(TypedDict):
    """How impacts are integrated, see `impact.contact.output_formulas.collide`."""

    rtol: float
    max_steps: int
    collapse: NotRequired[bool]
    core: NotRequired[str]
    integrator: NotRequired[str]


def simulate(
    model: ForceModel,
    n: Array,
    values: ValueArrays,
    status: Int8Array,
    *,
    rtol: float,
    max_steps: int,
    collapse: bool = True,
    core: str = "numpy",
    integrator: str = EXACT,
    errors: dict[str, str] | None = None,
    compute: ComputeCollisions | None = None,
    recorded: list[Phases] | None = None,
) -> CollisionResult:
    """Integrate impacts by a law; one that fails has a status, and affects no other.

    Parameters
    ----------
    n : compliance exponents, shape (k,)
    values : `dimensionless_values` of the impacts, by name, each of shape (k,); for a scheme also `PHASE`, and
        `STEPS_PER_CONTACT` or `STEP`; with both, `STEPS_PER_CONTACT` only limits the number of steps
    status : by `check_inputs`, shape (k,); impacts that are not OK are not integrated
    compute : computes distinct collisions of the continuous law in place of the integration, such as an
        `InterpolatedCollisions`
    recorded : receives the motion, of a single impact
    """
    integrate = partial(integrate_collisions, rtol=rtol, max_steps=max_steps, core=core, recorded=recorded)
    simulate_part = partial(
        _simulate_distinct, model, compute=compute or integrate, separates_strong=compute is None
    )
    if integrator != EXACT:
        simulate_part = partial(
            collide_at_fixed_steps, model, scheme=integrator, compute=integrate, max_steps=max_steps
        )
    return simulate_parts(CollisionResult, model.key, n, values, status, simulate_part, collapse, errors)


def simulate_parts(
    record: type[T],
    key: str,
    n: Array,
    values: ValueArrays,
    status: Int8Array,
    simulate_part: Callable[[Part], T],
    collapse: bool,
    errors: dict[str, str] | None,
) -> T:
    """Simulate the impacts with status OK, those with the same n together; one that fails affects no other."""
    parts: list[tuple[Positions, T]] = []
    reported = {} if errors is None else errors

    def isolate_failures(part: Part) -> T:
        """Simulate impacts with the same n; those for which the law raises an error have the status MODEL_ERROR.

        After an error both halves are tried again, so that only the impacts that cause it fail. A single impact is
        tried together with a copy: a result of the wrong shape, or an `if`, raises no error for an array of
        length 1.
        """
        count = part.size
        try:
            if count == 1:
                twice = part.at(np.array([0, 0]), 2)._replace(collapse=False)
                return simulate_part(twice).take(np.array([0]))
            if collapse and PHASE in part.values:
                # at a fixed step problems are distinct by all values
                first, row_of_impact = deduplicate([part.values[name] for name in sorted(part.values)], (count,))
                if first.size < count:
                    return simulate_part(part.at(first, first.size)).take(row_of_impact)
            return simulate_part(part)
        except ModelError as error:
            result = record.blank(count)
            if count == 1:
                vars(result)["status"][:] = Status.MODEL_ERROR
                reported.setdefault(*describe_error(key, error))
                return result
            for half in np.array_split(np.arange(count), 2):
                result.put(half, isolate_failures(part.at(half, half.size)))
            return result

    with np.errstate(all="ignore"):
        for exponent in distinct_values(n):
            chosen = (status == STATUS_OK) & (n == exponent)
            count, rows = int(np.count_nonzero(chosen)), positions(chosen)
            if count:
                part = Part(float(exponent), values, n.size, collapse).at(rows, count)
                parts.append((rows, isolate_failures(part)))
    return record.joined(n.size, status, parts)


def _simulate_distinct(
    model: ForceModel, part: Part, *, compute: ComputeCollisions, separates_strong: bool = True
) -> CollisionResult:
    """Integrate each distinct dimensionless problem once, those with strong damping in their own coordinate."""
    n, values, count, collapse = part
    law_values = with_coefficients(model, with_units(values, n), count)
    status = check_coefficients(model, law_values, count)
    exact, chi = exact_restitution(model, law_values, count), chi_of(law_values, count)
    chosen = status == STATUS_OK
    parts = []
    for problems in distinct_problems(model, n, law_values, chosen, collapse, separates_strong=separates_strong):
        never_separates = exact[problems.rows][problems.first] == 0.0
        distinct = compute(problems.law, problems.params, never_separates.size, never_separates=never_separates)
        parts.append((problems.rows, distinct.take(problems.row_of_impact)))
    result = replace(CollisionResult.joined(count, status, parts), chi=chi, exact=exact)
    stopped = status == LIMIT
    if stopped.any():
        for array in (result.e_out, result.peak, result.permanent):
            array[stopped] = 0.0
    return result


class DistinctProblems(NamedTuple):
    """The distinct problems of impacts at `rows`: their law, and params and further columns of each.

    `first` are the positions among the rows of the first impact of each problem, and `row_of_impact` is the number
    of the problem of each row.
    """

    law: motion.MotionLaw
    rows: Positions
    first: Positions
    row_of_impact: Positions
    params: Params
    columns: Params


def distinct_problems(
    model: ForceModel,
    n: float,
    law_values: LawValues,
    chosen: Mask,
    collapse: bool,
    columns: Params = (),
    *,
    separates_strong: bool = True,
) -> Iterator[DistinctProblems]:
    """Find the distinct problems of the chosen impacts: those in the velocity, then those with strong damping.

    `columns` are further arrays of shape (count,) in which distinct problems may differ.
    """
    strong = is_strong(model, law_values, chosen.size) & separates_strong
    for is_strongly_damped in (False, True):
        part = chosen & (strong == is_strongly_damped)
        size = int(np.count_nonzero(part))
        if not size:
            continue
        rows = positions(part)
        law = motion.MotionLaw.of(model, n, is_strongly_damped)
        params = tuple(np.asarray(law_values[name])[rows] for name in law.names)
        others = tuple(column[rows] for column in columns)
        first, row_of_impact = deduplicate((*params, *others), (size,)) if collapse else (slice(None), slice(None))
        distinct_params, distinct_others = (tuple(column[first] for column in part) for part in (params, others))
        yield DistinctProblems(law, rows, first, row_of_impact, distinct_params, distinct_others)


def collide_at_fixed_steps(
    model: ForceModel,
    part: Part,
    *,
    scheme: str,
    compute: ComputeCollisions,
    max_steps: int,
    slip: FixedStepSlip | None = None,
) -> CollisionResult:
    """Integrate impacts at a fixed step; if it is a part of the contact time, the continuous law comes first.

    `slip`, of the same impacts under friction, is advanced to their ends. A scheme in which friction changes the
    restitution takes that of the values, if they have one.
    """
    n, values, count, _ = part
    if scheme == MUJOCO_CONE and slip is None and SLIP in values:
        slip = FixedStepSlip.of(TangentialForm("cone"), values, count)
    of_scheme = (STEPS_PER_CONTACT, STEP, PHASE, PREFIX)
    of_law = part._replace(values={name: a for name, a in values.items() if not name.startswith(of_scheme)})

    def contact_times(rows: Positions, size: int) -> tuple[Array, Int8Array]:
        """Compute the contact times of the continuous law, and statuses that are OK where there is one."""
        continuous = _simulate_distinct(model, of_law.at(rows, size), compute=compute)
        never_ends = continuous.status == LIMIT
        return continuous.contact_time, np.where(never_ends, np.int8(Status.NOT_SEPARATED), continuous.status)

    law_values = with_coefficients(model, with_units(of_law.values, n), count)
    status = check_coefficients(model, law_values, count)
    status[status == LIMIT] = Status.OK
    if STEP not in values:
        times, status = contact_times(slice(None), count)
        step = times / values[STEPS_PER_CONTACT]
    else:
        step = values[STEP]
        per_contact = values.get(STEPS_PER_CONTACT)
        times = np.full(count, LINEAR_CONTACT_TIME) if per_contact is None else step * per_contact
    result = replace(CollisionResult.blank(count), status=status)

    def collide(rows: Indices) -> None:
        # at least the contacts of one step
        limits = np.ceil(MAX_CONTACTS * np.maximum(times[rows] / step[rows], 1.0))
        limits = np.fmin(limits, max_steps).astype(np.int64)
        chosen, slip_at_rows = of_law.at(rows, rows.size), None if slip is None else slip.take(rows)
        fixed = collide_at_fixed_step(
            model, n, chosen.values, step[rows], values[PHASE][rows], limits, scheme, slip_at_rows
        )
        if slip is not None and slip_at_rows is not None:
            slip.put(rows, slip_at_rows)
        # where the user limits the steps
        unfinished = np.where(limits >= max_steps, np.int8(Status.MAX_STEPS), np.int8(Status.NOT_SEPARATED))
        status = np.where(fixed.status == Status.NOT_SEPARATED, unfinished, fixed.status)
        result.put(rows, replace(fixed, status=status))

    active = np.flatnonzero(status == STATUS_OK)
    if active.size:
        collide(active)
    if STEPS_PER_CONTACT not in values:
        # the contact time is needed only where the balls do not separate within many of those of a linear spring
        unfinished = np.flatnonzero(result.status == Status.NOT_SEPARATED)
        if unfinished.size:
            longer, has_time = contact_times(unfinished, unfinished.size)
            is_longer = (has_time == STATUS_OK) & (longer > LINEAR_CONTACT_TIME)
            times[unfinished] = longer
            if is_longer.any():
                collide(unfinished[is_longer])
    return replace(result, chi=chi_of(law_values, count), exact=exact_restitution(model, law_values, count))


def check_coefficients(model: ForceModel, law_values: LawValues, count: int) -> Int8Array:
    """Compute the status of impacts by the coefficients of their law, before integration; shape (count,)."""
    status = np.full(count, Status.OK, np.int8)
    coefficients = np.array([law_values[name] for name in model.coefficients]).reshape(-1, count)
    if np.isfinite(coefficients).all():
        return status
    is_e_zero = np.broadcast_to(law_values.get("e", np.nan), count) == 0.0
    status[(np.isinf(coefficients) & ~is_e_zero).any(axis=0)] = Status.OUT_OF_RANGE
    status[np.isnan(coefficients).any(axis=0)] = Status.INVALID_PARAMETER
    # with infinite damping the balls neither approach nor separate: force and time have no finite limit
    is_of_force = [name in argument_names(model.force) for name in model.coefficients]
    status[(np.isinf(coefficients[is_of_force]) & is_e_zero).any(axis=0)] = Status.LIMIT
    return status


def integrate_collisions(
    law: motion.MotionLaw,
    params: Params,
    n: int,
    *,
    rtol: float,
    max_steps: int,
    never_separates: Mask | bool = False,
    core: str = "numpy",
    recorded: list[Phases] | None = None,
) -> CollisionResult:
    """Integrate n impacts, with params of shape (n,), through approach and restitution.

    Impacts of the mask `never_separates` are known to stay together, where they do not part. The core "numba"
    integrates the phases that have a form for it compiled, unless they are recorded: `recorded` receives the
    motion of impacts that are all equal.
    """
    run = partial(integrate, rtol=rtol, max_steps=max_steps, record=recorded is not None)

    def solve(
        law: motion.MotionLaw, problem: Problem, start: Array, params: Params, recovery: Recovery | None
    ) -> Solution:
        form_of = dispatch.approach_form if recovery is None else dispatch.restitution_form
        form = form_of(law) if core == "numba" and recorded is None else None
        if form is not None:
            return dispatch.integrate_compiled(form, law, problem, start, params, rtol=rtol, max_steps=max_steps)
        _, residual = recovery or (None, None)
        params, breakpoints = motion.breakpoints(law, params, start, residual)
        return in_parts(run, problem, breakpoints, start, params)

    phases = solve_phases(law, params, n, solve, never_separates)
    _end_at_zero_force(phases)
    approach, restitution, rows = phases.approach, phases.restitution, phases.rows
    result = replace(
        CollisionResult.blank(n),
        e_out=phases.e_out,
        peak=phases.peak,
        permanent=phases.residual.copy(),
        force=np.maximum(approach.maximum, phases.force_at_peak),
        contact_time=approach.state[2].copy(),
        approach_work=2.0 * approach.state[3],
        restitution_work=np.zeros(n),
        steps=approach.steps.copy(),
        status=phases.status,
    )
    if restitution is not None:
        # balls that are held, or separate at zero speed after infinite time, lose all their energy
        at_limit = phases.status[rows] == LIMIT
        result.contact_time[rows] += restitution.state[2]
        result.restitution_work[rows] = np.where(at_limit, 0.0, 2.0 * restitution.state[3])
        result.steps[rows] += restitution.steps
        if law.model.release == "force":
            result.permanent[rows] += motion.indentation(law, restitution.state[0])
    if recorded is not None:
        recorded.append(phases)
    return result


class Phases(NamedTuple):
    """The motion through both phases; `rows` are the impacts that enter restitution.

    `params` are those of the approach, of all impacts, and those of restitution, of the impacts at `rows`.
    """

    law: motion.MotionLaw
    params: tuple[Params, Params]
    approach: Solution
    restitution: Solution | None
    rows: Positions
    peak: Array
    force_at_peak: Array
    residual: Array
    e_out: Array
    status: Int8Array


# the impacts that enter the restitution phase, and their permanent indentation
Recovery = tuple[Positions, Array]
# integrates a phase: its law, problem, start, params and, on restitution, the Recovery
SolvePhase = Callable[[motion.MotionLaw, Problem, Array, Params, Recovery | None], Solution]


def solve_phases(
    law: motion.MotionLaw,
    params: Params,
    n: int,
    solve: SolvePhase,
    never_separates: Mask | bool,
) -> Phases:
    """Solve approach and restitution of n impacts, see `integrate_collisions`."""
    back = motion.restitution_law(law)
    start = motion.components_at(law, params, np.zeros(n), 1.0)
    approach = solve(law, motion.approach_problem(law), start, params, None)
    peak, at_peak, residual, recovered = branch = motion.unloading_arguments(law, approach.state[0], params)
    back_params = params if law.model.unloading is None else (*params, *branch)
    e_out, status = np.full(n, np.nan), STATUS_OF_TERMINATION.take(approach.termination)
    # without a recovered indentation the balls stay at their peak
    stays = (status == STATUS_OK) & (recovered <= 0.0)
    if stays.any():
        status[stays], e_out[stays] = LIMIT, 0.0

    rows = positions(status == STATUS_OK)
    back_params, recovered = tuple(column[rows] for column in back_params), recovered[rows]
    restitution = None
    if recovered.size:
        start = motion.components_at(back, back_params, power(recovered, 1.0 / back.model.coordinate_power), 0.0)
        restitution = solve(back, motion.restitution_problem(back), start, back_params, (rows, residual[rows]))
        _mark_never_separating(back, restitution, back_params, recovered)
        velocity = -back.velocity(restitution.state, back_params)
        ended = STATUS_OF_TERMINATION.take(restitution.termination)
        # the balls are held, or separate at zero speed after infinite time
        at_limit = restitution.termination == Termination.EVENT_UNREACHABLE
        if at_limit.any():
            at_limit &= motion.may_be_overdamped(back.model) | np.broadcast_to(never_separates, n)[rows]
            velocity[at_limit], ended[at_limit] = 0.0, LIMIT
        e_out[rows], status[rows] = velocity, ended
    return Phases(law, (params, back_params), approach, restitution, rows, peak, at_peak, residual, e_out, status)


def _end_at_zero_force(phases: Phases) -> None:
    """Move ends at zero indentation to where the force vanished before, if that was inside the last step."""
    law, solution = motion.restitution_law(phases.law), phases.restitution
    if solution is None or law.model.release != "force":
        return
    p, back_params = law.model.coordinate_power, phases.params[1]
    recovered = (phases.peak - phases.residual)[phases.rows]
    is_at_gap = np.abs(motion.indentation(law, solution.state[0])) < HIDDEN_END * recovered
    rows = np.flatnonzero((solution.termination == Termination.EVENT_REACHED) & is_at_gap)
    if not rows.size:
        return
    of_velocity = replace(law, coordinate=VelocityCoordinate())
    force_at = motion.force_of(of_velocity, unloads=True)
    velocity = law.velocity(solution.state, back_params)[rows]
    params = tuple(column[rows] for column in back_params)

    def force(s: Array) -> Array:
        return np.broadcast_to(force_at(np.array([s, velocity]), params), s.shape)

    upper = power(recovered[rows], 1.0 / p)
    lower = upper * HIDDEN_END ** (1.0 / p)
    hidden = (force(lower) < 0.0) & (force(upper) >= 0.0)
    if not hidden.any():
        return
    for _ in range(HIDDEN_END_BISECTIONS):
        middle = np.sqrt(lower * upper)
        is_below = force(middle) < 0.0
        lower, upper = np.where(is_below, middle, lower), np.where(is_below, upper, middle)
    x = integer_power(lower, p)
    # the energy that the pull took from there on, by the midpoint rule in s
    work = np.mean([force(part * lower) * p * x * part ** (p - 1) for part in HIDDEN_PARTS], axis=0)
    speed = np.sqrt(velocity * velocity - 2.0 * work)
    solution.state[:2, rows[hidden]] = motion.components_at(law, params, lower, -speed)[:, hidden]
    solution.state[2, rows[hidden]] += (x / velocity)[hidden]
    solution.state[3, rows[hidden]] += work[hidden]
    e_out = phases.e_out[phases.rows]
    e_out[rows[hidden]] = speed[hidden]
    phases.e_out[phases.rows] = e_out


def _mark_never_separating(law: motion.MotionLaw, solution: Solution, params: Params, recovered: Array) -> None:
    """Set the termination of trajectories that never separate, unlike those that only take too many steps."""
    stopped = np.isin(solution.termination, (Termination.MAX_STEPS, Termination.STEP_UNDERFLOW))
    unfinished = np.flatnonzero(stopped)
    if not unfinished.size or law.model.release != "gap":
        return
    force_at = motion.force_of(replace(law, coordinate=VelocityCoordinate()), unloads=True)
    unfinished_params = tuple(column[unfinished] for column in params)
    never = motion.never_separates(force_at, unfinished_params, recovered[unfinished], law.model.coordinate_power)
    solution.termination[unfinished[never]] = Termination.EVENT_UNREACHABLE
