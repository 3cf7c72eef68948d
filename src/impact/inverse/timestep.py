"""What a code with a fixed time step delivers, how small a step has to be, and which e to ask for.

A collision is integrated at every phase, the part of a step in which the contact begins, by the scheme of a code
(`impact.contact.fixed_step`), in one batch over all steps and phases. The e to ask for is a root of the mean over
the phases: a scan over e brackets it, and the method of Chandrupatla (1997), Advances in Engineering Software 28,
145-149, refines it. The number of steps needed is found by bisection.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import elementwise

from ..array_types import Array
from ..config.load import Config
from ..contact.dimensionless import dimensionless_values
from ..contact.fixed_step import (
    KICK_DRIFT,
    MAX_CONTACTS,
    MAX_STEPS_PER_CONTACT,
    FixedStepResult,
    check_scheme,
    collide_at_fixed_step,
    default_scheme,
)
from ..contact.impacts import Impacts
from ..contact.model import ForceModel
from ..contact.output_formulas import collide
from ..contact.status import FIRST_FAILURE, Status
from ..display import Block, Displayed, Table
from ..engine.build_impacts import build_impacts
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..errors import UsageError
from ..formatting import decimals, number, quantity
from ..results.single_impact import open_source, single_point

# steps per contact if none are given
STEPS_PER_CONTACT = (10.0, 20.0, 50.0, 100.0)
# the e to ask for is searched between so many values from here to 1; many laws take the logarithm of e
MIN_E, N_SCAN = 1e-6, 33
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
    e_to_ask : the e to ask for, so that the mean is the e wanted; NaN for a law without an e, or if there is none
    status : of `impact.contact.status.Status`: "ok", or that of most of the collisions that fail
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

    @property
    def cells(self) -> tuple[str, ...]:
        """Format the row of a table; a step at which a collision fails has its status."""
        mean = self.status if self.failed else decimals(self.e_mean)
        others = map(decimals, (self.e_least, self.e_largest, self.e_to_ask))
        return (number(self.steps_per_contact), number(self.dt), mean, *others)


@dataclass(frozen=True)
class NeededSteps:
    """The smallest number of steps per contact with which every phase is within `tol`, and its dt [s]."""

    tol: float
    steps_per_contact: int
    dt: float


@dataclass(frozen=True)
class TimestepResult(Displayed):
    """What a law delivers at fixed time steps.

    Parameters
    ----------
    scheme : name of the scheme, see `impact.contact.fixed_step.SCHEMES`
    e : the requested e; NaN for a law without one
    e_continuous, contact_time : of the continuous law [s]
    rows : one for each step
    needed : for `tol`; None without one, or if no number of steps up to `MAX_STEPS_PER_CONTACT` is enough
    phases : number of phases of each row
    """

    model: str
    scheme: str
    e: float
    e_continuous: float
    contact_time: float
    rows: tuple[TimestepRow, ...]
    needed: NeededSteps | None
    phases: int
    tol: float | None

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain data; numbers that do not apply are NaN."""
        return {name: value for name, value in asdict(self).items() if name not in ("phases", "tol")}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List the rows, one for each step."""
        return [asdict(row) for row in self.rows]

    def sections(self, width: int) -> Iterator[Block]:
        """Write the continuous law, a row for each step, the steps that fail, and the number of steps needed."""
        e = f"e = {number(self.e)}, " if self.e == self.e else ""
        contact_time = quantity(self.contact_time, "s")
        yield f"{self.model}: {e}e_out = {number(self.e_continuous)} in a contact time of {contact_time}"
        yield f"scheme: {self.scheme}"
        yield ""
        headings = ("steps per contact", "dt [s]", "e mean", "e least", "e largest", "e to ask")
        yield Table([row.cells for row in self.rows], headings, text=())
        failures = [row for row in self.rows if row.failed]
        if failures:
            yield ""
        for row in failures:
            count = (
                f"{row.failed} of {self.phases} phases fail at {number(row.steps_per_contact)} steps per contact"
            )
            yield f"{count}; {Status[row.status.upper()].meaning}"
        if self.tol is None:
            return
        yield ""
        percent = f"{number(100 * self.tol)} %"
        if self.needed is None:
            yield f"no number of steps per contact keeps every phase within {percent}"
        else:
            steps, dt = self.needed.steps_per_contact, quantity(self.needed.dt, "s")
            yield f"within {percent} at every phase: {steps} steps per contact, dt <= {dt}"


def timestep(
    model: str,
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    steps_per_contact: Sequence[float] = (),
    dt: Sequence[float] = (),
    phases: int = 400,
    tol: float | None = None,
    scheme: str | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> TimestepResult:
    """Show what a code with a fixed time step delivers: mean, smallest and largest restitution over the phase.

    The phase is the part of a step in which the contact begins: a code sees an overlap at its first step after it.
    The scheme "kick-drift" is that of LAMMPS, LIGGGHTS, YADE and MuJoCo, "drake-tamsi" and "drake-sap" are those
    of Drake's discrete solvers; `impact.contact.fixed_step.SCHEMES` has what they do in a step.

    Parameters
    ----------
    model : key of the law
    source, at, overrides, plugins : see `solve`
    steps_per_contact : contact times of the continuous law over dt; by default 10, 20, 50 and 100
    dt : further time steps [s]
    phases : number of phases, (i + 1/2)/phases
    tol : relative tolerance for which the smallest number of steps per contact is found
    scheme : its name; by default "drake-tamsi" for the laws of Drake, "kick-drift" for all others

    Returns
    -------
    TimestepResult : a row for each step, those of `steps_per_contact` first, and the number of steps needed; a row
        at which the collision fails at some phase has a status and no restitution

    Raises
    ------
    UsageError : a step is not positive, the scheme does not take the law, or the law has no rebound at these
        inputs
    ConfigError, ModelError : see `sweep`

    A linear spring and dashpot that is asked for 0.5, with twenty steps per contact:

    >>> import impact
    >>> (row,) = impact.timestep("anagnostopoulos-1988", at={"e": 0.5}, steps_per_contact=[20]).rows
    >>> round(row.e_mean, 4), round(row.e_least, 3), round(row.e_largest, 3), round(row.e_to_ask, 4)
    (0.4945, 0.48, 0.519, 0.5054)
    """
    if phases < 1:
        raise UsageError(f"--phases: got {phases}, expected a whole number >= 1")
    config, _ = single_point(open_source(source, overrides, read_plugins(plugins)), model, at)
    law, collision = fixed_step_law(config, phases, scheme)
    if not steps_per_contact and not dt:
        steps_per_contact = STEPS_PER_CONTACT
    steps = time_steps(law.contact_time, steps_per_contact, dt)
    return TimestepResult(
        model=law.model.key,
        scheme=law.scheme,
        e=law.e,
        e_continuous=collision["e_out"],
        contact_time=law.contact_time,
        rows=timestep_rows(law, steps),
        needed=None if tol is None else needed_steps(law, tol, collision["e_out"]),
        phases=phases,
        tol=tol,
    )


@dataclass(frozen=True)
class FixedStepLaw:
    """One impact of a law, whose e, step and phase vary."""

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
        """The requested e; NaN for a law without one."""
        return float(self.impact.e[0]) if self.has_e else math.nan

    def restitution(self, dt: Array, e: Array | None = None) -> Array:
        """Compute the delivered restitution at steps dt [s] over all phases, shape (k, phases)."""
        return self.collide(dt, e).e_out.reshape(dt.size, self.phases)

    def collide(self, dt: Array, e: Array | None = None) -> FixedStepResult:
        """Collide at steps dt [s] with the e to ask for at each, over all phases, shape (k,) to (k phases,)."""
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
    """Find what a law delivers at steps dt [s], and the e to ask for."""
    steps = np.array(dt)
    result = law.collide(steps)
    delivered = result.e_out.reshape(steps.size, law.phases)
    statuses = result.status.reshape(steps.size, law.phases)
    e_compensated = compensated_e(law, steps)
    return tuple(
        TimestepRow(
            dt=float(steps[row]),
            steps_per_contact=law.contact_time / float(steps[row]),
            e_mean=float(e.mean()),
            e_least=float(e.min()),
            e_largest=float(e.max()),
            e_to_ask=float(e_compensated[row]),
            status=_shared_status(statuses[row]).name.lower(),
            failed=int(np.count_nonzero(statuses[row] >= FIRST_FAILURE)),
        )
        for row, e in enumerate(delivered)
    )


def _shared_status(statuses: NDArray[np.int8]) -> Status:
    """Find the most frequent status of the collisions that fail; OK if none fails."""
    failures = statuses[statuses >= FIRST_FAILURE]
    return Status(int(np.bincount(failures).argmax())) if failures.size else Status.OK


def compensated_e(law: FixedStepLaw, dt: Array) -> Array:
    """Find the e to ask for at steps dt [s], so that the mean over the phases is e; NaN where there is none."""
    if not law.has_e:
        return np.full(dt.size, np.nan)
    target = law.e

    def distance(e: Array, steps: Array) -> Array:
        e, steps = np.broadcast_arrays(e, steps)
        means: Array = law.restitution(steps.ravel(), e.ravel()).mean(axis=1)
        return means.reshape(e.shape) - target

    scan = np.linspace(MIN_E, 1.0, N_SCAN)
    distances = distance(scan, dt[:, None])
    is_crossed = distances[:, :-1] * distances[:, 1:] <= 0.0
    # of several, the largest e
    last = N_SCAN - 2 - np.argmax(is_crossed[:, ::-1], axis=1)
    # where e changes the number of steps of a phase, its e_out jumps; the root may be such a jump
    solution = elementwise.find_root(distance, (scan[last], scan[last + 1]), args=(dt,))
    is_root = is_crossed.any(axis=1) & (np.abs(solution.f_x) <= MAX_JUMP)
    return np.where(is_root, solution.x, np.nan)


def needed_steps(law: FixedStepLaw, tol: float, e_continuous: float) -> NeededSteps | None:
    """Bisect for the smallest number of steps per contact with which every phase is within a tolerance."""
    target = law.e if law.has_e else e_continuous
    if not target > 0.0:
        raise UsageError("--tol is relative to e, expected e > 0")

    def is_within(steps: int) -> bool:
        e = law.restitution(np.array([law.contact_time / steps]))
        return bool((np.abs(e - target) <= tol * target).all())

    lower, upper = 1, 2
    while not is_within(upper):
        lower, upper = upper, 2 * upper
        if upper > MAX_STEPS_PER_CONTACT:
            return None
    while upper - lower > 1:
        middle = (lower + upper) // 2
        lower, upper = (lower, middle) if is_within(middle) else (middle, upper)
    return NeededSteps(tol, upper, law.contact_time / upper)


def fixed_step_law(
    config: Config, phases: int, scheme: str | None = None
) -> tuple[FixedStepLaw, dict[str, float]]:
    """Build the law and impact of a config without axes, and the outputs of the continuous law by name, in SI."""
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
    """List time steps [s], from numbers of steps per contact and from themselves."""
    for name, values in (("--steps-per-contact", steps_per_contact), ("--dt", dt)):
        for value in values:
            if not (math.isfinite(value) and value > 0.0):
                raise UsageError(f"{name}: got {number(value)}, expected a finite number > 0")
    steps = [*(contact_time / steps for steps in steps_per_contact), *dt]
    largest = contact_time / min(steps)
    if largest > MAX_STEPS_PER_CONTACT:
        raise UsageError(f"got {number(largest)} steps per contact, expected at most {MAX_STEPS_PER_CONTACT:,}")
    return steps
