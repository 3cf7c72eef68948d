"""What a code with a fixed time step delivers, how small a step has to be, and which e to ask for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

from ..array_types import Array
from ..config.load import Config
from ..contact.impacts import Impacts
from ..contact.model import ForceModel
from ..contact.outputs import collide
from ..contact.scaling import dimensionless_values
from ..contact.status import FIRST_FAILURE, Status
from ..contact.timestep import (
    KICK_DRIFT,
    MAX_CONTACTS,
    MAX_STEPS_PER_CONTACT,
    FixedStepResult,
    check_scheme,
    collide_at_fixed_step,
    default_scheme,
)
from ..engine.build_impacts import build_impacts
from ..engine.plan import Plan
from ..errors import UsageError
from ..formatting import number

# steps per contact if none are given
STEPS_PER_CONTACT = (10.0, 20.0, 50.0, 100.0)
# values of e between which the one to ask for is searched; many laws take the logarithm of e
LEAST_E, TRIED_E = 1e-6, 33
# largest jump of the mean over the phases that is taken for a root
MAX_JUMP = 1e-2


@dataclass(frozen=True)
class TimestepRow:
    """What a law delivers at one step.

    Parameters
    ----------
    dt : time step [s]
    steps_per_contact : contact time of the continuous law over dt
    e_mean, e_least, e_largest : restitution over the phases; NaN if a collision fails
    e_to_ask : the e to ask for at this dt, so that the mean is the e wanted; NaN for a law without an e, or if
        there is none
    status : "ok", or what most of the collisions that fail have in common, such as "unstable": a name of
        `impact.contact.status.Status`, as the point of a sweep has it
    failed : number of phases at which the collision fails
    """

    dt: float
    steps_per_contact: float
    e_mean: float
    e_least: float
    e_largest: float
    e_to_ask: float
    status: str = Status.OK.name.lower()
    failed: int = 0


@dataclass(frozen=True)
class NeededSteps:
    """The smallest whole number of steps per contact with which every phase is within `tol`, and its dt [s]."""

    tol: float
    steps_per_contact: int
    dt: float


@dataclass(frozen=True)
class TimestepResult:
    """What a law delivers at fixed time steps.

    Parameters
    ----------
    model : key of the law
    scheme : name of the scheme, see `impact.contact.timestep.SCHEMES`
    e : the e that is asked for; NaN for a law without one
    e_continuous : restitution of the continuous law
    contact_time : of the continuous law, until its own end [s]
    rows : one for each step
    needed : for a tolerance; None without one, or if no number of steps up to `MAX_STEPS_PER_CONTACT` is enough
    """

    model: str
    scheme: str
    e: float
    e_continuous: float
    contact_time: float
    rows: tuple[TimestepRow, ...]
    needed: NeededSteps | None


@dataclass(frozen=True)
class FixedStepLaw:
    """One impact of a law, whose e, step and phase vary.

    Parameters
    ----------
    model : the law
    impact : the impact, one of them
    contact_time : of the continuous law [s]
    phases : number of phases, (i + 1/2)/phases
    scheme : name of the scheme, see `impact.contact.timestep.SCHEMES`
    """

    model: ForceModel
    impact: Impacts
    contact_time: float
    phases: int
    scheme: str = KICK_DRIFT

    @property
    def has_e(self) -> bool:
        return "e" in self.model.quantities

    @property
    def e(self) -> float:
        """The e that is asked for; NaN for a law without one."""
        return float(self.impact.e[0]) if self.has_e else math.nan

    def with_phases(self, phases: int) -> FixedStepLaw:
        return replace(self, phases=phases)

    def restitution(self, dt: Array, e: Array | None = None) -> Array:
        """The delivered restitution at steps dt [s] over all phases, shape (k, phases); see `collide`."""
        return self.collide(dt, e).e_out.reshape(dt.size, self.phases)

    def collide(self, dt: Array, e: Array | None = None) -> FixedStepResult:
        """The collisions at steps dt [s], each over all phases, shape (k phases,).

        Parameters
        ----------
        dt : time steps [s], shape (k,)
        e : the e to ask for at each, shape (k,); by default that of the impact
        """
        phase = (np.arange(self.phases) + 0.5) / self.phases
        count = dt.size * self.phases
        values = {
            name: np.broadcast_to(value, count)
            for name, value in dimensionless_values(self.model, self.impact).items()
        }
        if e is not None:
            values["e"] = np.repeat(e, self.phases)
        step = np.repeat(dt / self.impact.time[0], self.phases)
        max_steps = math.ceil(MAX_CONTACTS * max(self.contact_time / float(dt.min()), 1.0))
        return collide_at_fixed_step(
            self.model, float(self.impact.n[0]), values, step, np.tile(phase, dt.size), max_steps, self.scheme
        )


def timestep_rows(law: FixedStepLaw, dt: Sequence[float]) -> tuple[TimestepRow, ...]:
    """What a law delivers at steps dt [s], and the e to ask for."""
    steps = np.array(dt)
    result = law.collide(steps)
    delivered = result.e_out.reshape(steps.size, law.phases)
    statuses = result.status.reshape(steps.size, law.phases)
    to_ask = e_to_ask(law, steps)
    return tuple(
        TimestepRow(
            dt=float(steps[row]),
            steps_per_contact=law.contact_time / float(steps[row]),
            e_mean=float(e.mean()),
            e_least=float(e.min()),
            e_largest=float(e.max()),
            e_to_ask=float(to_ask[row]),
            status=_shared_status(statuses[row]).name.lower(),
            failed=int(np.count_nonzero(statuses[row] >= FIRST_FAILURE)),
        )
        for row, e in enumerate(delivered)
    )


def _shared_status(statuses: NDArray[np.int8]) -> Status:
    """The most frequent status of the collisions that fail; OK if none fails."""
    failures = statuses[statuses >= FIRST_FAILURE]
    return Status(int(np.bincount(failures).argmax())) if failures.size else Status.OK


def e_to_ask(law: FixedStepLaw, dt: Array) -> Array:
    """The e to ask for at each step dt [s] for a mean over the phases that is the e of the impact, shape (k,).

    NaN where there is none. Where e changes the number of steps of a phase, its e_out jumps: if the mean jumps
    across the e of the impact, the e of the jump is returned.
    """
    if not law.has_e:
        return np.full(dt.size, np.nan)
    wanted = law.e

    def distance(e: Array, steps: Array) -> Array:
        e, steps = np.broadcast_arrays(e, steps)
        means: Array = law.restitution(steps.ravel(), e.ravel()).mean(axis=1)
        return means.reshape(e.shape) - wanted

    tried = np.linspace(LEAST_E, 1.0, TRIED_E)
    distances = distance(tried, dt[:, None])
    is_crossed = distances[:, :-1] * distances[:, 1:] <= 0.0
    # of several, the largest e
    last = TRIED_E - 2 - np.argmax(is_crossed[:, ::-1], axis=1)
    solution = elementwise.find_root(distance, (tried[last], tried[last + 1]), args=(dt,))
    is_root = is_crossed.any(axis=1) & (np.abs(solution.f_x) <= MAX_JUMP)
    return np.where(is_root, solution.x, np.nan)


def needed_steps(law: FixedStepLaw, tol: float, e_continuous: float) -> NeededSteps | None:
    """The smallest whole number of steps per contact with which every phase is within a relative tolerance.

    It is found by bisection: with one step less, a phase is outside.

    Parameters
    ----------
    law : the impact
    tol : largest accepted |e_out - e|/e
    e_continuous : restitution of the continuous law, which replaces e for a law without one
    """
    wanted = law.e if law.has_e else e_continuous
    if not wanted > 0.0:
        raise UsageError("--tol is relative to e, expected e > 0")

    def is_within(steps: int) -> bool:
        e = law.restitution(np.array([law.contact_time / steps]))
        return bool((np.abs(e - wanted) <= tol * wanted).all())

    least, most = 1, 2
    while not is_within(most):
        least, most = most, 2 * most
        if most > MAX_STEPS_PER_CONTACT:
            return None
    while most - least > 1:
        middle = (least + most) // 2
        least, most = (least, middle) if is_within(middle) else (middle, most)
    return NeededSteps(tol, most, law.contact_time / most)


def fixed_step_law(
    config: Config, phases: int, scheme: str | None = None
) -> tuple[FixedStepLaw, dict[str, float]]:
    """The law and the impact of a config without axes, and the outputs of the continuous law by name, in SI.

    Parameters
    ----------
    config : of one impact
    phases : number of phases
    scheme : its name; None for that of the codes that the law is of, `default_scheme`

    Raises
    ------
    UsageError : the continuous law does not end with a rebound, or the scheme does not take the law
    """
    plan = Plan(config)
    model = config.models[0]
    impact = build_impacts(plan.inputs, model, ())
    scheme = default_scheme(model) if scheme is None else scheme
    check_scheme(model, float(impact.n[0]), scheme)
    outputs = collide(model, impact, rtol=config.solver.rtol, max_steps=config.solver.max_steps)
    collision = {name: array[0].item() for name, array in outputs.items()}
    status = Status(collision["status"])
    if status != Status.OK:
        raise UsageError(f"{model.key} has no rebound at these inputs: {status.meaning}")
    return FixedStepLaw(model, impact, collision["contact_time"], phases, scheme), collision


def time_steps(contact_time: float, steps_per_contact: Sequence[float], dt: Sequence[float]) -> list[float]:
    """Time steps [s] from numbers of steps per contact, and from themselves.

    Raises
    ------
    UsageError : a number is not positive, or there are too many steps per contact
    """
    for name, values in (("--steps-per-contact", steps_per_contact), ("--dt", dt)):
        for value in values:
            if not (math.isfinite(value) and value > 0.0):
                raise UsageError(f"{name}: got {number(value)}, expected a finite number > 0")
    steps = [*(contact_time / steps for steps in steps_per_contact), *dt]
    most = contact_time / min(steps)
    if most > MAX_STEPS_PER_CONTACT:
        raise UsageError(f"got {number(most)} steps per contact, expected at most {MAX_STEPS_PER_CONTACT:,}")
    return steps


def timestep_study(
    config: Config,
    *,
    steps_per_contact: Sequence[float],
    dt: Sequence[float],
    phases: int,
    tol: float | None,
    scheme: str | None = None,
) -> TimestepResult:
    """What the law of a config without axes delivers at fixed steps; see `impact.timestep`.

    Raises
    ------
    UsageError : a step is not positive, the scheme does not take the law, or the continuous law does not end with
        a rebound
    """
    if phases < 1:
        raise UsageError(f"--phases: got {phases}, expected a whole number >= 1")
    law, collision = fixed_step_law(config, phases, scheme)
    contact_time, e_continuous = law.contact_time, collision["e_out"]
    if not steps_per_contact and not dt:
        steps_per_contact = STEPS_PER_CONTACT
    steps = time_steps(contact_time, steps_per_contact, dt)
    return TimestepResult(
        model=law.model.key,
        scheme=law.scheme,
        e=law.e,
        e_continuous=e_continuous,
        contact_time=contact_time,
        rows=timestep_rows(law, steps),
        needed=None if tol is None else needed_steps(law, tol, e_continuous),
    )
