"""The time history of an impact, and three restitutions computed from it independently.

The history samples the interpolant of the integrator. Force and power are integrated over each step by Gauss
points, independently of the quadratures of the integrator, and give the restitutions of equations (2) and (3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..array_types import Array, Indices, Int8Array
from ..ode.problem import Params, Problem, Step
from . import motion
from .impacts import Impacts
from .rigid import ObliqueImpacts
from .simulate import Phases
from .slip_motion import LEAST_S, TIME_ROW
from .status import Status
from .tangential import SLIP_BOUNDS, RecordedSlip

# points at which a step is sampled, and Gauss points by which it is integrated
SAMPLES_PER_STEP, GAUSS_POINTS = 4, 5
# halvings of a step that locate a time in it to the last bit
BISECTIONS = 54


@dataclass(frozen=True)
class History:
    """The time history of an impact, in SI; arrays of shape (k,).

    `x1`, `x2` are the displacements of the balls since first contact, so that delta = x1 - x2. `tau_c` and `tau_r`
    [N s] are the impulses of approach and restitution, `W_c` and `W_r` [J] the works done against the force in
    them (the latter negative), by quadrature of the force. `e_kinetic` is tau_r/tau_c, equation (2), and
    `e_energetic` the root of -W_r/W_c, equation (3).

    Of an oblique impact there are also `slip` [m/s], `f`, the friction force on ball 2 [N], and `mode`, what the
    contact does, see `impact.contact.variables.HISTORY`.
    """

    t: Array
    delta: Array
    v: Array
    F: Array
    x1: Array
    x2: Array
    v1: Array
    v2: Array
    tau_c: float
    tau_r: float
    W_c: float
    W_r: float
    e_kinetic: float
    e_energetic: float
    slip: Array | None = None
    f: Array | None = None
    mode: Int8Array | None = None


def history_of(
    phases: Phases,
    impacts: Impacts,
    times: int | None = None,
    oblique: ObliqueImpacts | None = None,
    recorded_slip: Sequence[RecordedSlip] = (),
) -> History | None:
    """Find the history of one impact (a batch of length one) from its motion; None if the balls do not separate.

    `times` is the number of uniform points in time; by default there are SAMPLES_PER_STEP per step, of the joint
    motion where it has a slip. That by Coulomb's friction is of every slip, and has none of its own.
    `recorded_slip` is empty without slip or friction.
    """
    law = phases.law
    params, back_params = (tuple(column[:1] for column in columns) for columns in phases.params)
    if phases.restitution is None or phases.status[0] != Status.OK:
        return None
    # without params, of which the phases may have different numbers
    joint_steps = [replace(step, params=()) for part in recorded_slip for step in part.steps]
    has_slip = bool(recorded_slip) and recorded_slip[0].phase.form.kind != "coulomb"
    peak_time, duration = (float(phase.state[2, 0]) for phase in (phases.approach, phases.restitution))
    approach_times = restitution_times = None
    if times is not None or has_slip:
        if times is not None:
            grid = np.linspace(0.0, peak_time + duration, times)
        else:
            numbers, fractions = _fractions(joint_steps)
            grid = np.maximum.accumulate(Step.each(joint_steps, numbers).at(fractions)[TIME_ROW])
        approach_times = grid[grid <= peak_time]
        restitution_times = np.minimum(grid[grid > peak_time] - peak_time, duration)
    problem, steps = motion.approach_problem(law), phases.approach.recorded
    approach, tau_c, W_c = _phase(law, problem, steps, params, approach_times)
    back_law = motion.restitution_law(law)
    problem, steps = motion.restitution_problem(back_law), phases.restitution.recorded
    if back_law.model.release == "force":
        # the end at zero force may be within the last step
        (last,), end = _fractions_at(steps, np.array([duration]))
        steps = (*steps[:last], replace(steps[last], end=end))
    restitution, tau_r, W_r = _phase(back_law, problem, steps, back_params, restitution_times)

    restitution[:2] += [phases.approach.state[2, :1], phases.residual[:1]]
    units = [impacts.time, impacts.length, impacts.v0, impacts.m * impacts.v0 / impacts.time]
    t, delta, v, force = np.hstack([approach, restitution]) * units
    # the phases meet at the peak, and the last step can be shorter than rounding: each time appears once
    next_times = np.append(np.minimum.accumulate(t[::-1])[::-1][1:], np.inf)
    t, delta, v, force = (row[t < next_times] for row in (t, delta, v, force))
    momentum, energy = (impacts.m * impacts.v0).item(), impacts.energy.item()
    mass_share1, mass_share2 = impacts.m / impacts.m1, impacts.m / impacts.m2
    history = History(
        t=t,
        delta=delta,
        v=v,
        F=force,
        x1=impacts.v1 * t - mass_share1 * (impacts.v0 * t - delta),
        x2=impacts.v2 * t + mass_share2 * (impacts.v0 * t - delta),
        v1=impacts.v1 - mass_share1 * (impacts.v0 - v),
        v2=impacts.v2 + mass_share2 * (impacts.v0 - v),
        tau_c=tau_c * momentum,
        tau_r=tau_r * momentum,
        W_c=W_c * energy,
        W_r=W_r * energy,
        e_kinetic=tau_r / tau_c,
        e_energetic=math.sqrt(-W_r / W_c) if W_r <= 0.0 else math.nan,
    )
    if oblique is None:
        return history
    if has_slip:
        return _with_slip(history, oblique, recorded_slip, joint_steps)
    return _with_sliding(history, oblique, recorded_slip)


def _with_slip(
    history: History, oblique: ObliqueImpacts, recorded: Sequence[RecordedSlip], steps: Sequence[Step]
) -> History:
    """Add slip and friction, from the joint motion and the steps of all its phases."""
    g0, unit_t = oblique.slip.item(), oblique.impacts.time.item()
    numbers, fractions = _fractions_at(steps, history.t / unit_t, TIME_ROW)
    rows: list[Array] = []
    first = 0
    for part in recorded:
        within = (numbers >= first) & (numbers < first + len(part.steps))
        samples = Step.each(part.steps, numbers[within] - first)
        y = samples.at(fractions[within])
        # at first contact smooth time stands still
        y[0] = np.where(np.abs(y[0]) < LEAST_S, LEAST_S, y[0])
        with np.errstate(all="ignore"):
            mode = part.phase.columns(samples.params).mode
            slip_and_force = part.phase.slip_and_force(y[:TIME_ROW], samples.params)
            rows.append(np.array([*slip_and_force, np.where(mode, mode, 0.0)]))
        first += len(part.steps)
    slip, force, mode = np.concatenate(rows, axis=1)
    if recorded[0].phase.form.kind == "regularized":
        mode = np.sign(slip)
    if recorded[0].phase.form.has_modes:
        # the slip is integrated for a friction that is so small at least
        force *= min(1.0, SLIP_BOUNDS[1] / abs(oblique.G0.item()))
    f, mode = oblique.m_t.item() * g0 / unit_t * force, (np.sign(g0) * mode).astype(np.int8)
    return replace(history, slip=g0 * slip, f=f, mode=mode)


def _with_sliding(history: History, oblique: ObliqueImpacts, recorded: Sequence[RecordedSlip]) -> History:
    """Add slip until the impulse of the limiting normal force has stopped it; it stays without friction."""
    m_t, mu, g0 = oblique.m_t.item(), oblique.mu.item(), oblique.slip.item()
    sliding_impulse, is_positive = 0.0, False
    if recorded:
        phase, steps = recorded[0]
        sliding_impulse = phase.track.impulse[0].item()
        is_positive = bool(phase.columns(steps[0].params).is_positive[0])
    limit = mu * (np.maximum(history.F, 0.0) if is_positive else np.abs(history.F))
    # by the momentum of ball 1, between the samples of which the force may change its sign
    impulses = -np.diff(history.v)
    impulses = np.concatenate([[0.0], np.cumsum(np.maximum(impulses, 0.0) if is_positive else np.abs(impulses))])
    total = mu * sliding_impulse * (oblique.impacts.m * oblique.impacts.v0).item()
    slip = np.maximum(np.abs(g0) - total / m_t * impulses / impulses[-1], 0.0)
    slides = (slip > 0.0) | ((mu == 0.0) & (g0 != 0.0))
    sign = np.sign(g0)
    f, mode = (np.where(slides, sign * size, 0.0) for size in (limit, 1.0))
    return replace(history, slip=sign * slip, f=f, mode=mode.astype(np.int8))


def _phase(
    law: motion.MotionLaw, problem: Problem, steps: tuple[Step, ...], params: Params, times: Array | None
) -> tuple[Array, float, float]:
    """Sample t, x above the residual, v and F in a phase, shape (4, k), and integrate it by Gauss points.

    Returns also the impulse and the work, all in the contact's own units.
    """

    def rates_at(y: Array) -> Array:
        return problem.rates(y[:2], tuple(np.broadcast_to(column, y.shape[1]) for column in params))

    numbers, fractions = _fractions(steps) if times is None else _fractions_at(steps, times)
    y = Step.each(steps, numbers).at(fractions)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    samples = Step.each(steps, np.repeat(np.arange(len(steps)), GAUSS_POINTS))
    inside = rates_at(samples.at(samples.end * 0.5 * (1.0 + np.tile(nodes, len(steps)))))
    share = 0.5 * np.tile(weights, len(steps)) * (samples.end * samples.length)
    sampled = np.array([y[2], motion.indentation(law, y[0]), law.velocity(y, params), rates_at(y)[4]])
    return sampled, math.fsum(share * (inside[4] * inside[2])), math.fsum(share * inside[3])


def _fractions(steps: Sequence[Step]) -> tuple[Indices, Array]:
    """Make uniform fractions of each step, and the end of the last step; returns their steps' numbers, too."""
    numbers = np.append(np.repeat(np.arange(len(steps)), SAMPLES_PER_STEP), len(steps) - 1)
    inner = np.tile(np.arange(SAMPLES_PER_STEP) / SAMPLES_PER_STEP, len(steps))
    ends = np.array([step.end[0] for step in steps])
    return numbers, ends[numbers] * np.append(inner, 1.0)


def _fractions_at(steps: Sequence[Step], times: Array, time_row: int = 2) -> tuple[Indices, Array]:
    """Compute where the interpolated time equals increasing times: the numbers of steps, and the fractions."""
    whole = Step.each(steps, np.arange(len(steps)))
    ends = whole.at(whole.end)[time_row]
    numbers = np.minimum(np.searchsorted(ends, times), len(steps) - 1)
    # the row of the time alone
    samples = Step.each(steps, numbers)
    time_of = replace(samples, start=samples.start[time_row], stages=samples.stages[:, time_row]).at
    low, high = np.zeros(len(times)), samples.end
    # the time grows with the fraction: bisect to the last bit
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        is_early = time_of(middle) < times
        low, high = np.where(is_early, middle, low), np.where(is_early, high, middle)
    return numbers, high
