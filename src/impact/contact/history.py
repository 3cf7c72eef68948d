"""One impact in time: its history, and the three restitutions computed from it independently."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..ode.problem import Params, Problem, Step
from . import motion
from .impacts import Impacts
from .model import ForceModel
from .powers import Array
from .scaling import dimensionless_values, with_coefficients, with_units
from .simulate import integrate_phases
from .status import Status
from .velocity_coordinates import is_strong

# points at which a step is shown, and at which it is integrated again
SAMPLES_PER_STEP, GAUSS_POINTS = 4, 5
# halvings of a step after which a moment in it is known to the last bit
BISECTIONS = 54


@dataclass(frozen=True)
class History:
    """The time history of one impact, in SI; arrays of shape (k,).

    `x1`, `x2` are the displacements of the balls since first contact, so that delta = x1 - x2. `tau_c` and `tau_r`
    [N s] are the impulses of approach and restitution, `W_c` and `W_r` [J] the works done against the force in
    them (the latter negative), by quadrature of the force. `e_kinetic` is tau_r/tau_c, equation (2), and
    `e_energetic` the root of -W_r/W_c, equation (3).
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


def follow(
    model: ForceModel, impacts: Impacts, *, rtol: float, max_steps: int, times: int | None = None
) -> History | None:
    """Follow a single impact through time.

    Parameters
    ----------
    model : the law
    impacts : one impact
    rtol, max_steps : see `impact.contact.outputs.collide`
    times : how many points in time, uniform from first contact to release; by default some in each step

    Returns
    -------
    History or None : None where there is no motion to follow, because the balls miss or a limit was taken
    """
    n = float(impacts.n[0])
    with np.errstate(all="ignore"):
        values = with_coefficients(model, with_units(dimensionless_values(model, impacts), n), 1)
        law = motion.MotionLaw.of(model, n, bool(is_strong(model, values, 1)[0]))
        params = tuple(np.asarray(values[name]) for name in law.names)
        collision = integrate_phases(law, params, 1, rtol, max_steps, record=True)
    if collision.restitution is None or collision.result.status[0] != Status.OK:
        return None
    turn, end = float(collision.approach.state[2, 0]), float(collision.restitution.state[2, 0])
    grid = None if times is None else np.linspace(0.0, turn + end, times)
    before = None if grid is None else grid[grid <= turn]
    after = None if grid is None else np.minimum(grid[grid > turn] - turn, end)
    approach = _phase(law, motion.approach_problem(law), collision.approach.recorded, params, before)
    back = motion.restitution_law(law)
    restitution = _phase(
        back, motion.restitution_problem(back), collision.restitution.recorded, collision.params, after
    )

    residual = (
        collision.params[motion.UNLOADING_PARAMS.index("residual") - len(motion.UNLOADING_PARAMS)]
        if model.unloading
        else np.zeros(1)
    )
    unit_t = impacts.length / impacts.v0
    t = np.concatenate([approach.t, collision.approach.state[2] + restitution.t]) * unit_t
    delta = np.concatenate([approach.x, residual + restitution.x]) * impacts.length
    v = np.concatenate([approach.v, restitution.v]) * impacts.v0
    force = np.concatenate([approach.F, restitution.F]) * (impacts.m * impacts.v0 / unit_t)
    # the phases meet at the peak, and a landing can be shorter than rounding: each moment is told once
    later = np.append(np.minimum.accumulate(t[::-1])[::-1][1:], np.inf)
    t, delta, v, force = (row[t < later] for row in (t, delta, v, force))
    momentum, energy = (impacts.m * impacts.v0).item(), impacts.energy.item()
    share1, share2 = impacts.m / impacts.m1, impacts.m / impacts.m2
    return History(
        t=t,
        delta=delta,
        v=v,
        F=force,
        x1=impacts.v1 * t - share1 * (impacts.v0 * t - delta),
        x2=impacts.v2 * t + share2 * (impacts.v0 * t - delta),
        v1=impacts.v1 - share1 * (impacts.v0 - v),
        v2=impacts.v2 + share2 * (impacts.v0 - v),
        tau_c=approach.impulse * momentum,
        tau_r=restitution.impulse * momentum,
        W_c=approach.work * energy,
        W_r=restitution.work * energy,
        e_kinetic=restitution.impulse / approach.impulse,
        e_energetic=math.sqrt(-restitution.work / approach.work) if restitution.work <= 0.0 else math.nan,
    )


@dataclass(frozen=True)
class _Phase:
    """A phase in the contact's own units; x above the residual indentation."""

    t: Array
    x: Array
    v: Array
    F: Array
    impulse: float
    work: float


def _phase(
    law: motion.MotionLaw, problem: Problem, steps: tuple[Step, ...], params: Params, times: Array | None
) -> _Phase:
    """Sample the interpolant of a phase, and integrate force and power over it by Gauss points."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    rows: list[Array] = []
    impulse, work = [], []
    fractions = _fractions(steps) if times is None else _fractions_at(steps, times)
    for step, within in zip(steps, fractions, strict=True):
        for theta in within:
            y = step.at(theta)
            rates = problem.rates(y[:2], params)
            rows.append(np.array([y[2], motion.indentation(law, y[0]), law.velocity(y, params), rates[4]]))
        for node, weight in zip(nodes, weights, strict=True):
            rates = problem.rates(step.at(step.end * 0.5 * (1.0 + node))[:2], params)
            share = 0.5 * weight * (step.end * step.length)[0]
            impulse.append(share * (rates[4] * rates[2])[0])
            work.append(share * rates[3][0])
    t, x, v, force = np.array(rows).reshape(-1, 4).T
    return _Phase(t, x, v, force, math.fsum(impulse), math.fsum(work))


def _fractions(steps: tuple[Step, ...]) -> list[Array]:
    """Some fractions of each step, with the end of the last."""
    inner = np.arange(SAMPLES_PER_STEP) / SAMPLES_PER_STEP
    return [step.end * (inner if step is not steps[-1] else np.append(inner, 1.0)) for step in steps]


def _fractions_at(steps: tuple[Step, ...], times: Array) -> list[Array]:
    """The fractions of each step at which the interpolated time is one of some times, which increase."""
    ends = np.array([step.at(step.end)[2, 0] for step in steps])
    place = np.minimum(np.searchsorted(ends, times), len(steps) - 1)
    found = []
    for at, step in enumerate(steps):
        wanted = times[place == at]
        many = wanted.size
        low, high = np.zeros(many), np.full(many, step.end[0])
        beside = Step(
            np.repeat(step.start, many, 1), np.repeat(step.length, many), np.repeat(step.stages, many, 2), high
        )
        # the time grows with the fraction: bisect to the last bit
        for _ in range(BISECTIONS if many else 0):
            middle = 0.5 * (low + high)
            is_early = beside.at(middle)[2] < wanted
            low, high = np.where(is_early, middle, low), np.where(is_early, high, middle)
        found.append(high)
    return found
