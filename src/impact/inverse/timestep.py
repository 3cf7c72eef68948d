"""What a code with a fixed time step delivers, how small a step has to be, and which e to ask for.

A collision is integrated at every phase, the part of a step in which the contact begins, by the scheme of a code
(`impact.contact.fixed_step`), in one batch over all steps and phases. The e to ask for is a root of the mean over
the phases: a scan over e brackets it, and the method of Chandrupatla (1997), Advances in Engineering Software 28,
145-149, refines it. The number of steps needed is found by bisection. A parameter with which a contact lasts that
many steps of a given size is found by the secant method in the logarithms of the parameter and the contact time:
one is a power of the other for laws with a single time scale.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, SupportsFloat

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.optimize import elementwise

from ..arguments import require_counts
from ..array_types import AnyArray, Array
from ..config.files import read_number, read_numbers
from ..config.input_names import InputName, with_words
from ..config.load import Config
from ..config.tables import DEFAULT_RTOL, SWEEP_QUANTITIES, TOLERANCE
from ..contact import simulate
from ..contact.fixed_step import (
    DRAKE_SAP,
    LAWS_OF_SCHEME,
    MAX_CONTACTS,
    MAX_STEPS_PER_CONTACT,
    MUJOCO_CONE,
    SCHEMES,
    check_scheme,
    default_scheme,
    friction_problem,
)
from ..contact.formula_calls import argument_names
from ..contact.friction import Pair
from ..contact.impacts import Impacts
from ..contact.model import ForceModel, Parameter
from ..contact.models import find
from ..contact.output_formulas import collide
from ..contact.rigid import ObliqueImpacts
from ..contact.status import FIRST_FAILURE, FrictionStatus, Status
from ..contact.units import with_numbers
from ..contact.variables import CENTRAL_OUTPUTS
from ..display import Block, Displayed, Table
from ..engine.inputs import build_impacts, build_oblique, rayleigh_time_at
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..engine.trajectories import PlanLaw, model_of
from ..errors import ModelError, UsageError, warn
from ..formatting import argument, decimals, law_name, number, prefixed, quantity, rounded
from ..results.single_impact import PointSource, open_source, single_point, warn_of_ignored_e
from ..results.summary import depth_notes, turn_notes
from .solve import config_name, placeholder, solve_damping, unknown_of

# steps per contact if none are given
STEPS_PER_CONTACT = (10.0, 20.0, 50.0, 100.0)
# 0.4 GB for four steps of a law with an e
MAX_PHASES = 10_000
# the e to ask for is searched between so many values from here to 1; many laws take the logarithm of e
MIN_E, N_SCAN = 1e-6, 33
# collisions of this search that are followed at once
MAX_COLLISIONS = 2**17
# largest jump of the mean over the phases that is taken for a root
MAX_JUMP = 1e-2
# the effect of a parameter on the contact time is taken from a value larger by this factor; a smaller power of it
# than this is none
NEARBY, MIN_SLOPE = 1.1, 1e-2
# the secant method for a parameter ends at this relative distance from the contact time, or after so many values
SECANT_TOLERANCE, MAX_SECANTS = 1e-6, 20
# a contact of more steps than this is none that a parameter is looked for
MAX_SECANT_STEPS = 4096
# the error rises and falls with the fraction of a step in which a contact ends: a number of steps is judged by so
# many fractions and phases, which find at least this part of the largest error
FRACTIONS, JUDGED_PHASES, FOUND_SHARE = np.arange(64) / 64, 64, 0.98
# beyond the number that is found, up to this multiple of it, so many numbers are tried
SCAN_RANGE, SCANNED = 3.0, 200
# relative to the tolerance: an error of zero, for its logarithm
EXACT_ERROR = 1e-300
# e is kept within this distance
HELD_E = 1e-8
# largest logarithm of the factor by which a parameter changes
MAX_LOGARITHM = 50.0
# digits of the first value of an axis
FIRST_DIGITS = 6
# digits of a parameter that is found, and of the contact there
SHOWN_DIGITS = 4
# C/K, which Drake's SAP takes in place of C
RELAXATION_TIME = "relaxation_time"


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
    beta_mean, beta_least, beta_largest : tangential restitution over the phases; NaN without a friction law
    """

    dt: float
    steps_per_contact: float
    e_mean: float
    e_least: float
    e_largest: float
    e_to_ask: float
    status: str = Status.OK.name.lower()
    failed: int = 0
    beta_mean: float = math.nan
    beta_least: float = math.nan
    beta_largest: float = math.nan

    def warnings(self, phases: int) -> Iterator[str]:
        """Say that the step is longer than the contact, and that some of so many phases fail."""
        step = f"dt = {quantity(self.dt, 's')}"
        if self.steps_per_contact < 1.0:
            yield f"{step}: longer than the contact of {quantity(self.steps_per_contact * self.dt, 's')}"
        if self.failed:
            yield f"{step}: {self.failure(phases)}"

    def failure(self, phases: int) -> str:
        """Explain why there is no restitution."""
        status = self.status.replace("_", " ")
        return f"{status} at {self.failed} of {phases} phases, {Status[self.status.upper()].meaning}"

    def cells(self, rayleigh_time: float, has_friction: bool) -> dict[str, str]:
        """Format the row of a table, by its headings; a step at which a collision fails has its status."""
        cells = {"steps per contact": number(self.steps_per_contact), "dt [s]": number(self.dt)}
        if rayleigh_time == rayleigh_time:
            cells["dt / T_R"] = number(self.dt / rayleigh_time, 3)
        cells["e mean"] = self.status if self.failed else decimals(self.e_mean)
        numbers = {"e least": self.e_least, "e largest": self.e_largest, "e to enter": self.e_to_ask}
        if has_friction:
            numbers |= {"beta mean": self.beta_mean, "least": self.beta_least, "largest": self.beta_largest}
        return cells | {heading: decimals(value) for heading, value in numbers.items()}

    def as_dict(self, has_friction: bool) -> dict[str, Any]:
        """Convert to plain data, without a tangential restitution if there is no friction."""
        return {name: value for name, value in asdict(self).items() if has_friction or "beta" not in name}


@dataclass(frozen=True)
class NeededSteps:
    """The number of steps per contact from which on every phase is within `tol`, and its dt [s]."""

    tol: float
    steps_per_contact: int
    dt: float


@dataclass(frozen=True)
class NeededParameter:
    """The value of a parameter from which on every phase is within `tol` at a step, and the contact there.

    Parameters
    ----------
    parameter, unit : its name, and its SI unit
    is_least : whether larger values are within the tolerance too, and not smaller ones
    companion : what changes with it and keeps e, with its value: the damping parameter or, beside a relaxation
        time, K; "" where e is not kept
    dt, contact_time : [s]
    peak_indentation : [m]
    relaxation_time : C/K [s], what Drake's SAP takes in place of C; NaN for other schemes
    K : beside a relaxation time that is the parameter [N/m], else NaN
    """

    parameter: str
    unit: str
    value: float
    is_least: bool
    companion: str
    dt: float
    contact_time: float
    peak_indentation: float
    tol: float
    relaxation_time: float = math.nan
    K: float = math.nan

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain data; without a relaxation time if the scheme has none."""
        names = ["parameter", "value", "contact_time", "peak_indentation", "tol"]
        names += [name for name in (RELAXATION_TIME, "K") if not math.isnan(getattr(self, name))]
        return {name: getattr(self, name) for name in names}

    def __str__(self) -> str:
        side = "from" if self.is_least else "up to"
        # rounded to the side of the values that are enough
        value = rounded(self.value, SHOWN_DIGITS, up=self.is_least)
        found = f"{self.parameter} = {quantity(value, self.unit, SHOWN_DIGITS)}"
        found += f" with {self.companion}" if self.companion else ""
        contact_time = quantity(self.contact_time, "s", SHOWN_DIGITS)
        indentation = quantity(self.peak_indentation, "m", SHOWN_DIGITS)
        relaxation = quantity(self.relaxation_time, "s", SHOWN_DIGITS)
        relaxation = "" if math.isnan(self.relaxation_time) else f", relaxation_time = C/K = {relaxation}"
        return (
            f"at dt = {quantity(self.dt, 's')} every phase is within {number(100.0 * self.tol)} % {side} "
            f"{found}: contact of {contact_time}, indentation of {indentation}{relaxation}"
        )


@dataclass(frozen=True)
class TimestepResult(Displayed):
    """What a law delivers at fixed time steps.

    Parameters
    ----------
    scheme : name of the scheme, see `impact.contact.fixed_step.SCHEMES`
    e : the requested e; NaN for a law without one, unless its damping was solved for
    solved : the value of the damping parameter that gives the e of a law without one; None if none was asked for
    e_continuous, contact_time : of the continuous law [s]
    rows : one for each step
    needed : for `tol`; None without one, or if no number of steps up to `MAX_STEPS_PER_CONTACT` is enough
    phases : number of phases of each row
    parameter, needed_parameter : what `tol` needs at a step, None if no value of the parameter is enough
    rayleigh_time : the smaller one of the two balls [s]; NaN if the law's stiffness does not follow from materials
    friction : key of the friction law; "" without one
    beta_continuous : tangential restitution of the continuous law
    first : names of axes of the source that are at their first value, with that value as text
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
    solved: Mapping[str, float] | None = None
    parameter: str = ""
    needed_parameter: NeededParameter | None = None
    rayleigh_time: float = math.nan
    friction: str = ""
    beta_continuous: float = math.nan
    first: Mapping[str, str] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user has to know of the steps: one is longer than the contact, or some of its phases fail."""
        return tuple(text for row in self.rows for text in row.warnings(self.phases))

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain data; numbers that do not apply are NaN."""
        options = {"phases", "tol", "parameter", "needed_parameter", "first"}
        options |= set() if self.friction else {"friction", "beta_continuous"}
        data = {name: value for name, value in asdict(self).items() if name not in options}
        data["rows"] = tuple(self.records())
        data["first_value_of"] = list(self.first)
        return {**data, "for": self.needed_parameter and self.needed_parameter.as_dict()}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List the rows, one for each step."""
        return [row.as_dict(bool(self.friction)) for row in self.rows]

    def sections(self, width: int) -> Iterator[Block]:
        """Write the continuous law, a row for each step, and the number of steps needed."""
        e = f"e = {number(self.e)}, " if self.e == self.e else ""
        e = "".join(f"{name} = {value!r}, " for name, value in self.solved.items()) if self.solved else e
        contact_time = quantity(self.contact_time, "s")
        beta = f", beta = {number(self.beta_continuous)}" if self.friction else ""
        law = law_name(self.model, self.friction)
        yield f"{law}: {e}e_out = {number(self.e_continuous)}{beta} in a contact time of {contact_time}"
        if self.first:
            yield first_values_line(self.first)
        yield f"scheme: {self.scheme}"
        yield ""
        cells = [row.cells(self.rayleigh_time, bool(self.friction)) for row in self.rows]
        yield Table([[*row.values()] for row in cells], [*cells[0]], text=())
        if self.rayleigh_time == self.rayleigh_time:
            yield f"T_R = {quantity(self.rayleigh_time, 's', 4)}: the smaller Rayleigh time of the two balls"
        if self.tol is None:
            return
        yield ""
        percent = f"{number(100 * self.tol)} %"
        if self.needed is None:
            yield f"no number of steps per contact keeps every phase within {percent}"
        else:
            steps, dt = self.needed.steps_per_contact, quantity(rounded(self.needed.dt, 6, up=False), "s")
            yield f"within {percent} at every phase: {steps} steps per contact, dt <= {dt}"
            yield from packing_notes(self.needed.dt, self.rayleigh_time)
        if self.parameter:
            yield str(self.needed_parameter or missing_parameter(self.parameter, self.tol))
        if self.friction:
            yield "the tolerance is that of e alone: beta may differ more from that of the continuous law"


def timestep(
    model: str,
    *,
    source: str | Path | Mapping[str, object] | xr.Dataset | None = None,
    at: Mapping[str, object] | None = None,
    steps_per_contact: ArrayLike = (),
    dt: ArrayLike = (),
    phases: int = 400,
    tol: SupportsFloat | str | None = None,
    parameter: str | None = None,
    scheme: str | None = None,
    friction: str | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> TimestepResult:
    """Show what a code with a fixed time step delivers: mean, smallest and largest restitution over the phase.

    The phase is the part of a step in which the contact begins: a code sees an overlap at its first step after it.
    The scheme "kick-drift" is that of LAMMPS, LIGGGHTS, YADE and MuJoCo, "drake-tamsi" and "drake-sap" are those
    of Drake's discrete solvers, "pybullet" is that of PyBullet; `impact.contact.fixed_step.SCHEMES` has what they
    do in a step.

    Parameters
    ----------
    model : key of the law
    source, overrides, plugins : see `solve`
    at : values of inputs by config name; an e for a law that takes none is reached by its damping parameter
    steps_per_contact : contact times of the continuous law over dt; by default 10, 20, 50 and 100
    dt : one or more further time steps [s], or texts such as "2 us"
    phases : number of phases, (i + 1/2)/phases, at most 10,000
    tol : relative tolerance of e for which the smallest number of steps per contact is found
    parameter : a parameter of the law, "K" or "materials.NAME.E", whose value from which on `tol` holds at the
        only `dt` is found, for a step that cannot be changed; with "drake-sap" and an e also "relaxation_time"
    scheme : its name; by default "drake-tamsi" for the laws of Drake, "kick-drift" for all others
    friction : key of the friction law of an oblique impact; by default the first one of the source, if any

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
    require_counts(phases=phases)
    if phases > MAX_PHASES:
        raise UsageError(f"{argument('phases')}: got {phases}, expected at most {MAX_PHASES:,}")
    given = read_numbers(dt, SWEEP_QUANTITIES["dt"], argument("dt"))
    counts = read_numbers(steps_per_contact, SWEEP_QUANTITIES["steps_per_contact"], argument("steps_per_contact"))
    tol = None if tol is None else read_number(tol, TOLERANCE, argument("tol"))
    if parameter is not None and (tol is None or len(given) != 1):
        raise UsageError(f"{argument('parameter')}: expected one {argument('dt')} and {argument('tol')} as well")
    plugin_set = read_plugins(plugins)
    if model in SCHEMES:
        expected = f"a law {LAWS_OF_SCHEME.get(model, 'such as hertz')}"
        origin, of = argument("model"), argument("scheme", model)
        raise UsageError(f'{origin}: got the scheme "{model}", expected {expected}, beside {of}')
    opened = open_source(source, overrides, plugin_set)
    point_source = replace(opened, config_draft=replace(opened.config_draft, has_own_scheme=True))
    law = law_at_point(point_source, find(model, plugin_set.models), at or {}, phases, scheme, friction)
    if law.continuous.get("friction_status") == FrictionStatus.SLOW_LIMIT:
        warn(f"{law_name(law.model.key, law.friction)}: beta is {FrictionStatus.SLOW_LIMIT.meaning}")
    steps = time_steps(law.contact_time, counts or (() if given else STEPS_PER_CONTACT), given)
    needed, found = None, None
    if tol is not None:
        needed = needed_steps(law, tol)
        if parameter is not None:
            found = needed_parameter(law, parameter, given[0], tol, needed)
    return TimestepResult(
        model=law.model.key,
        scheme=law.scheme,
        e=law.wanted_e,
        e_continuous=law.continuous["e_out"],
        contact_time=law.contact_time,
        rows=timestep_rows(law, steps),
        needed=needed,
        phases=phases,
        tol=tol,
        solved=law.solved,
        parameter=parameter or "",
        needed_parameter=found,
        rayleigh_time=law.rayleigh_time,
        friction=law.friction,
        beta_continuous=law.continuous.get("beta", math.nan),
        first=law.first,
    )


@dataclass(frozen=True)
class FixedStepLaw:
    """One impact of a law, whose e, step and phase vary.

    Parameters
    ----------
    law : the model, or its pair with a friction law, which has the tangential inputs `oblique`
    continuous : outputs of the continuous law by name, in SI
    rayleigh_time, first, solved : see `TimestepResult`
    replaced : inputs that replace those of the source; None without any
    """

    config: Config
    law: PlanLaw
    impact: Impacts
    oblique: ObliqueImpacts | None
    continuous: Mapping[str, float]
    phases: int
    scheme: str
    rayleigh_time: float
    first: Mapping[str, str] = field(default_factory=dict)
    solved: Mapping[str, float] | None = None
    replaced: Mapping[str, float] | None = None

    @property
    def model(self) -> ForceModel:
        return model_of(self.law)

    @property
    def friction(self) -> str:
        """The key of the friction law; "" without one."""
        return self.law.friction.key if isinstance(self.law, Pair) else ""

    @property
    def contact_time(self) -> float:
        """Contact time of the continuous law [s]."""
        return self.continuous["contact_time"]

    @property
    def has_e(self) -> bool:
        return "e" in self.model.quantities

    @property
    def is_coupled(self) -> bool:
        """Whether friction changes the restitution."""
        return self.oblique is not None and self.scheme == MUJOCO_CONE

    @property
    def e(self) -> float:
        """The requested e; NaN for a law without one."""
        return float(self.impact.e[0]) if self.has_e else math.nan

    @property
    def target_e(self) -> float:
        """The e that steps are to deliver: the requested one, or that of the continuous law where none can be."""
        return self.e if self.has_e else self.continuous["e_out"]

    @property
    def wanted_e(self) -> float:
        """The requested e, also of a law without one whose damping was solved for."""
        return self.e if self.solved is None else float(self.config.scalars["e"])

    def outputs(self, dt: Array, *names: str, e: Array | None = None) -> list[AnyArray]:
        """Compute outputs by name at steps dt [s] with the e to ask for at each, of shape (k, phases)."""
        step, phase = np.repeat(dt / self.impact.time, self.phases), (np.arange(self.phases) + 0.5) / self.phases
        impact = self.impact if e is None else replace(self.impact, e=np.repeat(e, self.phases))
        impact = impact.broadcast(step.shape)
        # friction is not integrated for what does not depend on it
        oblique = self.oblique if self.is_coupled or "beta" in names else None
        fixed_step = {
            simulate.STEP: step,
            simulate.STEPS_PER_CONTACT: np.repeat(self.contact_time / dt, self.phases),
            simulate.PHASE: np.tile(phase, dt.size),
        }
        errors: dict[str, str] = {}
        outputs = collide(
            self.law,
            impact,
            rtol=DEFAULT_RTOL,
            # the steps in a contact limit their number
            max_steps=sys.maxsize,
            collapse=False,
            integrator=self.scheme,
            fixed_step=fixed_step,
            errors=errors,
            names=names,
            oblique=oblique and replace(oblique, impacts=impact),
        )
        for error in errors.values():
            raise ModelError(error)
        return [np.broadcast_to(outputs[name], step.shape).reshape(-1, self.phases) for name in names]


def timestep_rows(law: FixedStepLaw, dt: Sequence[float]) -> tuple[TimestepRow, ...]:
    """Find what a law delivers at steps dt [s], and the e to ask for."""
    steps = np.array(dt)
    statuses, *delivered = law.outputs(steps, "status", "e_out", *(["beta"] if law.oblique else []))
    rows = []
    # in parts of little memory; no step depends on another
    parts = max(1, min(steps.size, steps.size * N_SCAN * law.phases // MAX_COLLISIONS))
    e_to_ask_of = np.concatenate([compensated_e(law, part) for part in np.array_split(steps, parts)]).tolist()
    for row, e_to_ask in enumerate(e_to_ask_of):
        failures = statuses[row][statuses[row] >= FIRST_FAILURE]
        # that of most of the collisions that fail
        status = Status(int(np.bincount(failures).argmax())) if failures.size else Status.OK
        values = {
            f"{name}_{statistic}": float(reduce(of_phase[row]))
            for name, of_phase in zip(("e", "beta"), delivered, strict=False)
            for statistic, reduce in (("mean", np.mean), ("least", np.min), ("largest", np.max))
        }
        step = float(steps[row])
        contact = {"dt": step, "steps_per_contact": law.contact_time / step, "e_to_ask": e_to_ask}
        rows.append(TimestepRow(**contact, **values, status=status.name.lower(), failed=failures.size))
    return tuple(rows)


def compensated_e(law: FixedStepLaw, dt: Array) -> Array:
    """Find the e to ask for at steps dt [s], so that the mean over the phases is e; NaN where there is none."""
    if not law.has_e:
        return np.full(dt.size, np.nan)

    def distance(e: Array, steps: Array) -> Array:
        e, steps = np.broadcast_arrays(e, steps)
        (delivered,) = law.outputs(steps.ravel(), "e_out", e=e.ravel())
        means: Array = delivered.mean(axis=1)
        return means.reshape(e.shape) - law.e

    scan = np.linspace(MIN_E, 1.0, N_SCAN)
    distances = distance(scan, dt[:, None])
    is_crossed = distances[:, :-1] * distances[:, 1:] <= 0.0
    # of several, the largest e
    last = N_SCAN - 2 - np.argmax(is_crossed[:, ::-1], axis=1)
    # where e changes the number of steps of a phase, its e_out jumps; the root may be such a jump
    solution = elementwise.find_root(distance, (scan[last], scan[last + 1]), args=(dt,))
    is_root = is_crossed.any(axis=1) & (np.abs(solution.f_x) <= MAX_JUMP)
    return np.where(is_root, solution.x, np.nan)


def needed_steps(
    law: FixedStepLaw, tol: float, most: int = MAX_STEPS_PER_CONTACT, nearby: NeededSteps | None = None
) -> NeededSteps | None:
    """Search for the number of steps per contact from which on every phase is within a tolerance.

    The search begins at the number that a similar law needs. That every larger number is enough is tried for many.
    """
    target = law.target_e
    if not target > 0.0:
        raise UsageError(f"{argument('tol')} is relative to e, expected e > 0")
    # the surfaces of an overdamped contact part later than a collision at a step is followed
    is_overdamped = law.continuous["separation_time"] > MAX_CONTACTS * law.contact_time
    # no step does what the continuous law does not
    margin = tol * target - abs(law.continuous["e_out"] - target)
    if margin <= 0.0 or is_overdamped:
        return None
    judged, allowed = replace(law, phases=JUDGED_PHASES), tol * target - (1.0 - FOUND_SHARE) * margin

    @cache
    def log_error(steps: int) -> float:
        """The logarithm of the largest error over what is allowed; inf where a phase has no rebound."""
        (e,) = judged.outputs(law.contact_time / (steps + FRACTIONS), "e_out")
        error = float(np.abs(e - target).max()) / allowed
        return math.log(error or EXACT_ERROR) if math.isfinite(error) else math.inf

    upper, turn = 2 if nearby is None else min(max(nearby.steps_per_contact, 2), most), 0
    lower = upper - 1
    if lower > 1 and log_error(lower) <= 0.0:
        lower, upper = 1, lower
    while log_error(upper) > 0.0:
        lower, upper = upper, 2 * upper
        if upper > most:
            return None
    while upper - lower > 1:
        # the error falls roughly as a power of the number of steps; every third time the middle is taken
        turn += 1
        is_known = lower > 1 and math.isfinite(log_error(lower)) and turn % 3
        share = 1.0 / (1.0 - log_error(upper) / log_error(lower)) if is_known else 0.5
        middle = min(max(round(lower * (upper / lower) ** share), lower + 1), upper - 1)
        lower, upper = (lower, middle) if log_error(middle) <= 0.0 else (middle, upper)
    while upper <= most:
        steps = upper * np.linspace(1.0, SCAN_RANGE, SCANNED)
        (e,) = judged.outputs(law.contact_time / steps, "e_out")
        beyond = steps[~(np.abs(e - target).max(axis=1) <= tol * target)]
        if not beyond.size:
            return NeededSteps(tol, upper, law.contact_time / upper)
        upper = math.floor(beyond.max()) + 1
    return None


def packing_notes(dt: float, rayleigh_time: float) -> Iterator[str]:
    """Yield a sentence if a recommended step is longer than the Rayleigh time [s], which may be unknown, NaN."""
    if dt > rayleigh_time:
        limit = f"longer than the Rayleigh time, {quantity(rayleigh_time, 's', 4)}"
        yield f"this dt is {limit}: for one impact alone; packings commonly take 0.1 to 0.3 of that time"


def first_values_line(first: Mapping[str, str]) -> str:
    """Name the axes of the source that are at their first value."""
    values = ", ".join(f"{name} = {value}" for name, value in first.items())
    return f"first value of each axis of the source: {values}"


def missing_parameter(name: str, tol: float) -> str:
    """Say that no value of a parameter is enough."""
    return f"no value of {name} keeps every phase within {number(100.0 * tol)} % at the step"


def needed_parameter(
    law: FixedStepLaw, name: str, dt: float, tol: float, needed: NeededSteps | None = None
) -> NeededParameter | None:
    """Find the value of a parameter from which on every phase is within a tolerance at a step dt [s].

    The needed steps are those of the law, where they are known. Where its damping was solved for, e is kept by the
    damping in the contact's own units, which is enough where the law has a single time scale, else by solving
    again.
    """
    if name == RELAXATION_TIME:
        return _needed_relaxation_time(law, dt, tol, needed)
    config, model = law.config, law.model
    e = None if law.solved is None else law.wanted_e
    unknown, path, value = _seek(law, name)
    base, damping_path = law, f"{model.key}.{model.damping}"
    law_of = partial(fixed_step_law, phases=base.phases, scheme=base.scheme, of_friction=base.is_coupled)

    def damping_of(impact: Impacts) -> float:
        return float(impact.dimensionless(model, model.damping)[0])

    def collide_at(value: float) -> FixedStepLaw:
        changed = replace(config, scalars={**config.scalars, path: value})
        if e is None:
            return law_of(changed)
        damping = damping_of(build_impacts(Plan(changed).inputs, model, ()))
        scaled = float(changed.scalars[damping_path]) * (damping_of(base.impact) / damping if damping else 1.0)
        changed = replace(changed, scalars={**changed.scalars, damping_path: scaled})
        law = law_of(changed)
        return law if abs(law.continuous["e_out"] - e) < HELD_E else law_of(solve_damping(changed, e))

    slope = 0.0
    # e is what the tolerance is of
    if name != "e":
        nearby = collide_at(NEARBY * value)
        slope = math.log(nearby.contact_time / law.contact_time) / math.log(NEARBY)
    if abs(slope) < MIN_SLOPE:
        expected = time_parameter(config, model) or "materials.NAME.E"
        message = f"{name} does not set the contact time of {model.key}, expected {expected}"
        raise UsageError(f"{argument('parameter')}: {message}")
    for _ in range(MAX_SECANTS):
        needed = needed_steps(law, tol, MAX_SECANT_STEPS, needed)
        if needed is None:
            return None
        distance = math.log(law.contact_time / (needed.steps_per_contact * dt))
        if abs(distance) < SECANT_TOLERANCE:
            companion = ""
            if e is not None:
                unit = with_numbers(model.unit_of(model.damping), {"n": model.exponent or math.nan})
                companion = f"{model.damping} = {quantity(float(law.config.scalars[damping_path]), unit, 4)}"
            return NeededParameter(
                parameter=name,
                value=value,
                unit=with_numbers(unknown.unit, {"n": float(law.impact.n[0])}),
                is_least=slope > 0.0,
                companion=companion,
                dt=dt,
                contact_time=law.contact_time,
                peak_indentation=law.continuous["peak_indentation"],
                tol=tol,
                relaxation_time=_relaxation_time(law),
            )
        logarithm = -distance / slope
        if not abs(logarithm) < MAX_LOGARITHM or not unknown.least <= value * math.exp(logarithm) <= unknown.most:
            return None
        before, value = law.contact_time, value * math.exp(logarithm)
        try:
            law = collide_at(value)
        except UsageError:
            # no rebound there
            return None
        slope = math.log(law.contact_time / before) / logarithm or slope
    return None


def _needed_relaxation_time(
    law: FixedStepLaw, dt: float, tol: float, known: NeededSteps | None
) -> NeededParameter | None:
    """Find the relaxation time of SAP, and the K with which it keeps e, from which it follows."""
    role = argument("parameter")
    relaxation_time = _relaxation_time(law)
    if math.isnan(relaxation_time):
        command = f"impact timestep --model kelvin-voigt-no-tension --scheme {DRAKE_SAP}"
        raise UsageError(f"{role}: {RELAXATION_TIME} is C/K of Drake's SAP: {command} finds it")
    if law.solved is None or relaxation_time == 0.0:
        raise UsageError(
            f"{role}: {RELAXATION_TIME} = C/K sets e at a given K, and not the contact time: expected "
            f"{argument('at', 0.8, key='e')} or another e < 1, which K and {RELAXATION_TIME} together keep"
        )
    needed = needed_parameter(law, "K", dt, tol, known)
    if needed is None:
        return None
    return replace(
        needed,
        parameter=RELAXATION_TIME,
        unit="s",
        value=needed.relaxation_time,
        is_least=not needed.is_least,
        companion=f"K = {quantity(needed.value, needed.unit, 4)}",
        relaxation_time=math.nan,
        K=needed.value,
    )


def _relaxation_time(law: FixedStepLaw) -> float:
    """Compute C/K [s], which Drake's SAP takes; NaN for other schemes and laws."""
    if law.scheme != DRAKE_SAP or "C" not in law.impact.parameters:
        return math.nan
    return float(law.impact.parameters["C"][0] / law.impact.K[0])


def _seek(law: FixedStepLaw, name: str) -> tuple[Parameter, str, float]:
    """Describe a parameter that may set the time scale: its bounds, its config name and its value."""
    config, parsed = law.config, InputName.parse(name)
    if parsed.material in config.materials and parsed.key == "E":
        modulus = config.materials[parsed.material].E
        return Parameter(name, "Pa", "Young's modulus"), name, float(config.scalars.get(name, modulus))
    moduli = [f'"materials.{material}.E"' for material in _materials(config) if _takes_moduli(config, law.model)]
    if name == "E" and moduli:
        raise UsageError(f"{argument('parameter')}: got E, expected that of a material: {' or '.join(moduli)}")
    unknown = unknown_of(law.model, name, origin="parameter")
    path = config_name(law.model, unknown)
    return unknown, path, float(law.impact.K[0] if name == "K" else config.scalars[path])


def time_parameter(config: Config, model: ForceModel) -> str:
    """Name the parameter that sets the time scale of a law, as `timestep` takes it; "" where two materials do."""
    if _takes_moduli(config, model):
        # rather than a characteristic speed, which is to be that of the contact
        materials = _materials(config)
        return f"materials.{materials[0]}.E" if len(materials) == 1 else ""
    arguments = argument_names(model.stiffness)
    names = [p.name for p in model.parameters if p.name in arguments and p.name != model.damping]
    return names[0] if len(names) == 1 else "K"


def _materials(config: Config) -> list[str]:
    """List the names of the materials of both balls, each once."""
    return list(
        dict.fromkeys(str(config.scalars.get(f"material{ball}", config.scalars.get("material"))) for ball in "12")
    )


def _takes_moduli(config: Config, model: ForceModel) -> bool:
    """Whether the stiffness of a law follows from Young's moduli."""
    is_given = not {"K", f"{model.key}.K"}.isdisjoint(config.scalars)
    return not is_given and (model.stiffness is None or "E_eff" in argument_names(model.stiffness))


def law_at_point(
    source: PointSource,
    model: ForceModel,
    at: Mapping[str, object],
    phases: int,
    scheme: str | None,
    friction: str | None,
    *,
    of_friction: bool = True,
    replacing: Callable[[Config], Mapping[str, float] | None] = lambda config: None,
) -> FixedStepLaw:
    """Reduce a source to one impact of a law, and replace inputs.

    An e for a law without one is reached by its damping. Warns of a large indentation, and of an e of the source
    that the law ignores.
    """
    is_solved = "e" in at and "e" not in model.quantities
    if is_solved:
        if not model.damping:
            raise UsageError(f"{argument('at', key='e')}: {model.key} has no e, and no parameter that sets it")
        if not {model.damping, f"{model.key}.{model.damping}"}.isdisjoint(at):
            raise UsageError(f"{argument('at')}: got e and {model.damping}, expected one of the two")
        at = {**at, **placeholder(model, unknown_of(model, model.damping), source)}
    config, defaulted_axes = single_point(source, model.key, at, friction=friction)
    values = with_words(config.scalars)
    first = {name: prefixed(values[name], InputName.parse(name).unit, FIRST_DIGITS) for name in defaulted_axes}
    replaced, solved = replacing(config), None
    config = replace(config, scalars={**config.scalars, **(replaced or {})})
    if is_solved:
        config = solve_damping(config, float(config.scalars["e"]))
        solved = {model.damping: float(config.scalars[f"{model.key}.{model.damping}"])}
    if of_friction:
        Plan(config).pair_notes("frictions")
    law = fixed_step_law(config, phases, scheme, of_friction=of_friction)
    if not is_solved and source.has_own_e and "e" not in defaulted_axes:
        warn_of_ignored_e(config, law.continuous["e_out"])
    radii = law.impact.R1.item(), law.impact.R2.item()
    warn(*depth_notes(law.continuous["peak_indentation"], *radii))
    # the radius that replaces that of a wall is none of a ball
    if law.oblique is not None and replaced is None:
        warn(*turn_notes((law.oblique.u1 - law.oblique.u2).item(), law.contact_time, *radii))
    return replace(law, first=first, solved=solved, replaced=replaced)


def fixed_step_law(
    config: Config, phases: int, scheme: str | None = None, *, of_friction: bool = False
) -> FixedStepLaw:
    """Build the law and impact of a config without axes; its friction law is left out unless it is asked for."""
    plan = Plan(config if of_friction else replace(config, frictions=()))
    model, law = plan.models[0], plan.laws[-1]
    impact = build_impacts(plan.inputs, model, ())
    friction = law.friction if isinstance(law, Pair) else None
    if scheme is None:
        scheme = (friction.scheme if friction else "") or default_scheme(model)
    check_scheme(model, float(impact.n[0]), scheme)
    oblique = None
    if friction is not None:
        if problem := friction_problem(friction.key, friction.kind, scheme):
            raise UsageError(problem)
        oblique = build_oblique(plan.inputs, impact, (), friction)
    continuous = oblique if friction is not None and not friction.scheme else None
    names = (*CENTRAL_OUTPUTS, *(("beta", "friction_status") if continuous else ()))
    rtol, max_steps = config.solver.rtol, config.solver.max_steps
    outputs = collide(law, impact, rtol=rtol, max_steps=max_steps, names=names, oblique=continuous)
    values = {name: array.ravel()[0].item() for name, array in outputs.items()}
    status = Status(values["status"])
    if status != Status.OK:
        raise UsageError(f"{model.key} has no rebound at these inputs: {status.meaning}")
    friction_status = FrictionStatus(values.get("friction_status", FrictionStatus.OK))
    if friction_status >= FIRST_FAILURE:
        raise UsageError(f"{law.key} has no answer at these inputs: {friction_status.meaning}")
    wave_time = float(rayleigh_time_at(plan.inputs, ()).item()) if _takes_moduli(config, model) else math.nan
    return FixedStepLaw(config, law, impact, oblique, values, phases, scheme, wave_time)


def time_steps(contact_time: float, steps_per_contact: Sequence[float], dt: Sequence[float]) -> list[float]:
    """List time steps [s], from numbers of steps per contact and from themselves."""
    steps = [*(contact_time / steps for steps in steps_per_contact), *dt]
    largest = contact_time / min(steps)
    if largest > MAX_STEPS_PER_CONTACT:
        got = f"{argument('dt')}: got {number(largest)} steps per contact"
        raise UsageError(f"{got}, expected at most {MAX_STEPS_PER_CONTACT:,}")
    return steps
