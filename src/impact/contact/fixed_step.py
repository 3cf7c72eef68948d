"""Collisions and slips as codes with a fixed time step integrate them, with one evaluation of the force per step.

A step first changes the velocity, then the position with the new velocity, see `SCHEMES`: "kick-drift" takes the
force at the start of the step, the schemes of Drake and PyBullet the force at its end, whose root is known in
closed form for the laws that they take. The restitution depends on the phase, the part of a step at which the
contact begins.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ..array_types import AnyArray, Array, Int8Array, Mask
from ..errors import ModelError, UsageError, require_known
from .dimensionless import with_coefficients, with_units
from .formula_calls import Formula, argument_names
from .model import UNLOADING_ARGUMENTS, ForceModel
from .motion import MotionLaw, unloading_arguments
from .powers import power
from .records import CollisionResult
from .slip_motion import SLIDES, STICKS, TangentialForm
from .status import Status
from .velocity_coordinates import force_form

# the integration of the continuous law with error control; all other integrators are schemes with a fixed step
EXACT = "exact"
# the update of one step, by the name of the scheme
KICK_DRIFT, DRAKE_TAMSI, DRAKE_SAP, MUJOCO_CONE = "kick-drift", "drake-tamsi", "drake-sap", "mujoco-cone"
PYBULLET = "pybullet"
# those that take the force at the end of the step
END_OF_STEP = (DRAKE_TAMSI, DRAKE_SAP, PYBULLET)
SCHEMES = {
    KICK_DRIFT: "u <- u - h F(x, u)/m, then x <- x + h u; the force is evaluated at the position and velocity "
    "before the step",
    DRAKE_TAMSI: "u <- u', the root of u' = u - (h/m) K max(0, x + h u') max(0, 1 + chi u'/v0), then "
    "x <- x + h u'; the force is that at the end of the step",
    DRAKE_SAP: "u <- u', the root of u' = u - (h/m) max(0, K (x + h u') + C u'), then x <- x + h u'; the force is "
    "that at the end of the step",
    PYBULLET: "as drake-sap; friction, up to μ times the impulse of the step, leaves the restitution as it is",
    MUJOCO_CONE: "u <- u - h f_n/m, then x <- x + h u; the force before the step is that of a friction cone, "
    "f_n = F while friction is in it, else max(0, F + μ f)/(1 + μ² D), where f is the friction that would stop "
    "the slip as asked, and D that of a unit of it; without friction it is kick-drift",
}
# the laws of the schemes that take only some
LAWS_OF_SCHEME = {
    DRAKE_TAMSI: "F = K δ (1 + χ δ̇/v₀), n = 1, in both phases, such as drake-point-contact",
    **dict.fromkeys(
        (DRAKE_SAP, PYBULLET), "F = K δ + C δ̇ to F = 0, in both phases, such as kelvin-voigt-no-tension"
    ),
    MUJOCO_CONE: "of MuJoCo, such as mujoco-solref",
}
# the kinds of friction laws with which codes of a scheme were run, and in words which it takes
FRICTION_OF_SCHEME: Mapping[str, tuple[tuple[str, ...], str]] = {
    KICK_DRIFT: (
        ("coulomb", "spring", "dashpot"),
        "coulomb-1785 or one with a spring or a dashpot, such as cundall-strack-1979",
    ),
    DRAKE_TAMSI: (("coulomb",), "coulomb-1785"),
    DRAKE_SAP: ((), "none: friction changes the restitution that it delivers"),
    PYBULLET: (("coulomb",), "coulomb-1785"),
    MUJOCO_CONE: (("cone",), "mujoco-elliptic"),
}
# names of the values of a tangential problem, which no value of a law has: the size of the slip at first contact,
# stiffness and damping of the tangential spring per power of x, 1 where only a pressing force limits friction, the
# factor from G to the slip y of a coefficient of friction that depends on it, and what only schemes know
PREFIX = "friction."
SLIP, TANGENTIAL_STIFFNESS, TANGENTIAL_DAMPING, LIMIT_POSITIVE, SLIP_SCALE, RADIUS, COUPLING = (
    f"{PREFIX}{name}" for name in ("G0", "k", "c", "positive", "slip_scale", "radius", "coupling")
)

# a contact that takes more steps, in units of its steps at the continuous contact time, never ends
MAX_CONTACTS = 50
# more steps per contact are refused
MAX_STEPS_PER_CONTACT = 2**17
# A rebound faster than this, relative to the approach, is a failure of the step. For a linear spring of frequency
# omega the kick-drift step conserves u^2 - h omega^2 x u + omega^2 x^2. It is v0^2 (1 - s (1 - s) h^2 omega^2) <=
# v0^2 at the first step that sees the contact, and at the step that ends it at least e^2 v0^2 (1 - h^2 omega^2/4):
# thus e^2 <= 1/(1 - h^2 omega^2/4), which is 4 at h omega = sqrt(3); from h omega = 2 on there is no bound
MAX_RESTITUTION = 2.0
# trajectories that have ended are removed when they are this share
COMPACTION_SHARE = 0.25


def default_scheme(model: ForceModel) -> str:
    """Find the scheme of the codes that a law is of: "drake-tamsi" for Drake's, else "kick-drift"."""
    is_of_drake = model.family == "codes" and model.key.startswith("drake-")
    return DRAKE_TAMSI if is_of_drake else KICK_DRIFT


def has_scheme(model: ForceModel, n: float, scheme: str) -> bool:
    """Return whether a scheme takes a law with an exponent n.

    >>> from impact.contact.models import find
    >>> [has_scheme(find(key), 1.0, "drake-sap") for key in ("kelvin-voigt-no-tension", "kelvin-voigt")]
    [True, False]
    """
    if scheme not in LAWS_OF_SCHEME:
        return True
    # the form that a law declares by its velocity coordinate is that of `force` alone
    if n != 1.0 or model.unloading is not None:
        return False
    if scheme == MUJOCO_CONE:
        return model.key.startswith("mujoco-solref")
    if scheme == DRAKE_TAMSI:
        return model.velocity_coordinate == "log"
    is_force = model.velocity_coordinate == "force" and model.release == "force"
    return is_force and force_form(model, n).drag == 0.0


def law_problem(model: ForceModel, scheme: str) -> str:
    """Write the message to a user who asks for a scheme that does not take the law."""
    return f'scheme "{scheme}" does not take {model.key}, expected a law {LAWS_OF_SCHEME[scheme]}'


def friction_problem(key: str, kind: str, scheme: str, only: str = "") -> str:
    """Write the message to a user who asks for a scheme that does not take a friction law; "" if it does.

    `only` is the one scheme that a law is of, which has no continuous answer then.

    >>> friction_problem("drake-regularized", "regularized", "drake-tamsi")
    'scheme "drake-tamsi" does not take the friction law drake-regularized, expected coulomb-1785'
    """
    if scheme == EXACT:
        message = f"the friction law {key} is that of a scheme, without a continuous answer"
        return f'{message}, expected solver.integrator = "{only}"' if only else ""
    kinds, expected = FRICTION_OF_SCHEME[scheme]
    return "" if kind in kinds else f'scheme "{scheme}" does not take the friction law {key}, expected {expected}'


def check_scheme(model: ForceModel, n: float, scheme: str) -> None:
    """Raise a UsageError if there is no such scheme, or if it does not take the law."""
    require_known([scheme], SCHEMES, "no scheme")
    if not has_scheme(model, n, scheme):
        raise UsageError(law_problem(model, scheme))


@np.errstate(all="ignore")
def collide_at_fixed_step(
    model: ForceModel,
    n: float,
    values: Mapping[str, Array],
    step: Array,
    phase: Array,
    max_steps: int | Array,
    scheme: str = KICK_DRIFT,
    slip: FixedStepSlip | None = None,
) -> CollisionResult:
    """Simulate collisions by a scheme with a fixed step.

    The contact begins with the overlap `phase * step * v0` at the first step that sees it. The contact ends with
    the first step after which the surfaces do not overlap. The force of a law that ends at zero force is never
    negative, nor is that of a scheme of Drake or PyBullet. A law with an unloading branch follows it from the
    first step after which the velocity is not positive.

    Parameters
    ----------
    values : `impact.contact.dimensionless.dimensionless_values`, each of shape (k,)
    step : in the contact's own unit of time, shape (k,)
    phase : where in its step the contact begins, 0 < phase <= 1, shape (k,)
    max_steps : for all or of shape (k,); a collision that takes more never separates
    slip : the slip under friction, which is advanced to the end of each contact

    Returns
    -------
    CollisionResult : without `chi` and `exact`; `e_out` is NaN for a collision that fails, `peak` the largest
        indentation at the end of a step, `force` the largest force before a step. The works are those against the
        force of the law, by the trapezoidal rule over the ends of the steps, from the first touch to the end of
        the contact, which are inside a step
    """
    check_scheme(model, n, scheme)
    count = step.size
    law = MotionLaw.of(model, n, strong=False)
    law_values = with_coefficients(model, with_units(values, n), count)
    columns = [np.broadcast_to(law_values[name], count) for name in law.names]
    params = np.array(columns).reshape(len(columns), count)
    limit = np.broadcast_to(np.asarray(max_steps, np.int64), count).copy()
    part = None if slip is None else slip.take(np.arange(count))
    contacts = _Contacts(law, params, step.copy(), phase * step, limit, scheme, part)
    result = CollisionResult.blank(count)
    result.steps[:], result.status[:] = limit, Status.NOT_SEPARATED
    active = np.ones(count, bool)
    for number in range(1, int(limit.max(initial=0)) + 1):
        contacts.advance()
        is_finite = np.isfinite(contacts.x) & np.isfinite(contacts.u)
        has_ended = active & ((contacts.x <= contacts.residual) | ~is_finite)
        is_over = has_ended | (contacts.limit <= number)
        if is_over.any():
            ended = copy(contacts)
            ended.keep(has_ended)
            rows = ended.rows
            status = np.where(-ended.u > MAX_RESTITUTION, Status.UNSTABLE, Status.OK)
            status[~is_finite[has_ended]] = Status.NOT_FINITE
            result.e_out[rows] = np.where(status == Status.OK, -ended.u, np.nan)
            result.peak[rows] = ended.peak
            result.permanent[rows] = ended.residual
            result.force[rows] = ended.largest_force
            result.approach_work[rows] = ended.approach_work
            result.restitution_work[rows] = ended.restitution_work()
            result.steps[rows] = number
            result.status[rows] = status
            if slip is not None and ended.slip is not None:
                slip.put(rows, ended.slip)
            active &= ~is_over
            if not active.any():
                break
            if np.count_nonzero(active) < (1.0 - COMPACTION_SHARE) * active.size:
                contacts.keep(active)
                active = np.ones(contacts.x.size, bool)
    return replace(result, contact_time=result.steps * step)


@dataclass
class _Contacts:
    """The collisions that go on; arrays with n along the last axis, without those that have ended."""

    law: MotionLaw
    params: Array
    step: Array
    x: Array
    limit: NDArray[np.int64]
    scheme: str
    slip: FixedStepSlip | None

    def __post_init__(self) -> None:
        x = self.x
        self.u, self.peak = np.ones_like(x), x.copy()
        self.largest_force = np.full_like(x, -np.inf)
        # the force before the last step, the displacement in it, and its growing part
        self.last_force, self.displacement, self.approach_displacement = np.zeros_like(x), x.copy(), x.copy()
        self.rows = np.arange(x.size)
        self.unloads = np.zeros(x.size, bool)
        # UNLOADING_ARGUMENTS, zero on approach
        self.branch = np.zeros((len(UNLOADING_ARGUMENTS), x.size))
        # twice the work against the force, and its part while the indentation grows: at first the work between the
        # first touch and the first step, half of it of the force at the touch
        self.work = 0.0 + self.force_at(np.zeros_like(x)) * x
        self.approach_work = 0.0 + self.work

    @property
    def residual(self) -> Array:
        """The permanent indentation."""
        return np.asarray(self.branch[UNLOADING_ARGUMENTS.index("residual")])

    def force(self) -> Array:
        """Compute the force at the position and velocity before the step."""
        law = self.law
        force = self._formula(law.model.force, {})
        unloading = law.model.unloading
        if unloading is not None and self.unloads.any():
            extra = dict(zip(UNLOADING_ARGUMENTS, self.branch, strict=True))
            extra["stretch"] = np.maximum(self.x - self.residual, 0.0)
            force = np.where(self.unloads, self._formula(unloading, extra), force)
        is_clamped = law.model.release == "force" or self.scheme != KICK_DRIFT
        # the sum of this force and of that of a cone is clamped
        return np.maximum(force, 0.0) if is_clamped and not self.is_coupled else force

    @property
    def is_coupled(self) -> bool:
        """Whether friction changes the normal force."""
        return self.scheme == MUJOCO_CONE and self.slip is not None

    def force_at(self, x: Array) -> Array:
        """Compute the force at other positions, zero where the law has no finite one."""
        other = copy(self)
        other.x, other.slip = x, None
        force = other.force()
        return np.where(np.isfinite(force), force, 0.0)

    def restitution_work(self) -> Array:
        """Twice the work while the indentation falls, of contacts that end in this step, inside it."""
        out = self.residual - (self.x - self.displacement)
        beyond = self.last_force * (out - self.displacement) + self.force_at(self.residual) * out
        return self.work - self.approach_work + beyond

    def _formula(self, formula: Formula, extra: Mapping[str, Array]) -> Array:
        arguments: dict[str, Array] = {"x": self.x, "v": self.u, **extra}
        if "elastic" in argument_names(formula):
            arguments["elastic"] = power(np.maximum(self.x, 0.0), self.law.n)
        value = self.law.call(formula, tuple(self.params), arguments)
        if value.shape not in ((), self.x.shape):
            raise ModelError(f"{self.law.model.key}: the force has shape {value.shape}, expected {self.x.shape}")
        return np.broadcast_to(value, self.x.shape)

    def advance(self) -> None:
        """Advance all collisions by a step."""
        force = self.force()
        if self.is_coupled and self.slip is not None:
            force = self.slip.normal_force(force)
        velocity = self.next_velocity(force)
        if self.slip is not None:
            acting = (self.u - velocity) / self.step if self.scheme in END_OF_STEP else force
            self.slip.advance(self.x, acting, self.step)
        self.u = velocity
        displacement = self.step * self.u
        self.x = self.x + displacement
        np.maximum(self.largest_force, force, out=self.largest_force)
        # half of the work of the force before a step is in the step before, half in the step itself
        approach_displacement = np.maximum(displacement, 0.0)
        self.work += force * (self.displacement + displacement)
        self.approach_work += force * (self.approach_displacement + approach_displacement)
        self.last_force, self.displacement, self.approach_displacement = force, displacement, approach_displacement
        np.maximum(self.peak, self.x, out=self.peak)
        if self.law.model.unloading is not None:
            turned = ~self.unloads & (self.u <= 0.0)
            if turned.any():
                self._turn(turned)

    def next_velocity(self, force: Array) -> Array:
        """Compute the velocity at the end of the step; `force` is that before it.

        The schemes of Drake and PyBullet take the force at the end of the step. The forces grow with u', so that
        the force is zero at the end if and only if it is zero with u' = u. Where it is not, u' is for TAMSI the
        larger root of
        h² χ u'² + (1 + h² + h χ x) u' + h x - u = 0, with which both factors of the force are positive, and
        for the other two that of a linear equation.
        """
        h, x, u, names = self.step, self.x, self.u, self.law.names
        if self.scheme == DRAKE_TAMSI:
            chi = self.params[names.index("chi")]
            half = 0.5 * (1.0 + h * (h + chi * x))
            implicit = (u - h * x) / (half + np.sqrt(half * half + h * h * chi * (u - h * x)))
            # in this order, so that a NaN is not taken for a contact without force
            return np.where((x + h * u <= 0.0) | (1.0 + chi * u <= 0.0), u, implicit)
        if self.scheme in (DRAKE_SAP, PYBULLET):
            reach = h + self.params[names.index("c")]
            return np.where(x + reach * u <= 0.0, u, (u - h * x) / (1.0 + h * reach))
        return u - h * force

    def _turn(self, turned: Mask) -> None:
        """Begin the unloading branch of some collisions at the largest indentation that they reached."""
        peak = self.peak[turned]
        s = power(peak, 1.0 / self.law.model.coordinate_power)
        # the first is the peak again, with the rounding errors of s
        _, *others = unloading_arguments(self.law, s, tuple(self.params[:, turned]))
        self.branch[:, turned] = peak, *others
        self.unloads |= turned

    def keep(self, active: Mask) -> None:
        """Remove the collisions that have ended."""
        # several times as fast as an index by the mask
        rows = np.flatnonzero(active)
        for name, value in list(vars(self).items()):
            if isinstance(value, np.ndarray):
                setattr(self, name, value.take(rows, axis=-1))
        self.slip = None if self.slip is None else self.slip.take(rows)


@dataclass
class FixedStepSlip:
    """The slip of contacts at fixed steps; arrays of shape (n,), of which those of ended contacts are removed.

    In the contact's own units, see `impact.contact.tangential`, a step changes the memory of the spring, z <- z +
    h G, or z <- z + h k X G for a law that remembers the force, where X = x^kp, at the indentation before the
    step. On unloading the rescaled laws first change z by a power of X. Then the force follows with its limit N =
    abs(F) or max(F, 0), and G <- G - h phi. The normal motion does not depend on it, but for that of a cone.

    Parameters
    ----------
    form : of the tangential problems
    slip : G, positive at first contact
    stiffness, damping : k' and c' per power of x
    is_positive : whether only a pressing force limits friction
    radius : radius of the contact over X [m], by which the classic styles of LAMMPS multiply the displacement that
        a slip leaves; 0 for others
    coupling : of a cone: how much the friction in it, over that which would be asked for, adds to the normal force
    memory : z, a displacement or a force
    last_power : X at the step before, NaN before the first
    impulse : the integral of the limiting normal force
    regime : what the contact has done, see `impact.contact.slip_motion.STICKS`
    slipped : whether it slipped in the last step
    changes : how often one followed the other
    """

    form: TangentialForm
    slip: Array
    stiffness: Array
    damping: Array
    is_positive: Array
    radius: Array
    coupling: Array
    memory: Array
    last_power: Array
    impulse: Array
    regime: Int8Array
    slipped: Mask
    changes: NDArray[np.int32]

    @classmethod
    def of(cls, form: TangentialForm, values: Mapping[str, Array], count: int) -> FixedStepSlip:
        """Begin contacts with the values of tangential problems; those without slip or friction have no slip."""

        def column(name: str, default: float = 0.0) -> Array:
            return np.array(np.broadcast_to(values.get(name, default), count), float)

        slip = np.abs(column(SLIP, 1.0))
        return cls(
            form=form,
            slip=np.where(np.isfinite(slip), slip, 0.0),
            stiffness=column(TANGENTIAL_STIFFNESS),
            damping=column(TANGENTIAL_DAMPING),
            is_positive=column(LIMIT_POSITIVE),
            radius=column(RADIUS),
            coupling=column(COUPLING),
            memory=np.zeros(count),
            last_power=np.full(count, np.nan),
            impulse=np.zeros(count),
            regime=np.zeros(count, np.int8),
            slipped=np.zeros(count, bool),
            changes=np.zeros(count, np.int32),
        )

    def take(self, rows: AnyArray) -> FixedStepSlip:
        """Take some of the contacts."""
        return FixedStepSlip(self.form, *(getattr(self, field.name)[rows] for field in fields(self)[1:]))

    def put(self, rows: AnyArray, part: FixedStepSlip) -> None:
        """Write contacts that have ended to their positions."""
        for field in fields(self)[1:]:
            getattr(self, field.name)[rows] = getattr(part, field.name)

    def normal_force(self, force: Array) -> Array:
        """Compute the normal force of a cone from that of the law alone, which may be negative.

        Friction within the cone leaves it as it is. At the cone it solves both equations of motion together.
        """
        asked = self.damping * np.abs(self.slip)
        coupled = np.maximum(force + self.coupling * asked, 0.0) / (1.0 + self.coupling)
        return np.where(asked <= force, force, coupled)

    def advance(self, x: Array, force: Array, step: Array) -> None:
        """Advance by a step, with the indentation and the normal force before it."""
        form = self.form
        limit = np.where(self.is_positive > 0.0, np.maximum(force, 0.0), np.abs(force))
        self.impulse = self.impulse + step * limit
        if form.kind == "coulomb":
            return
        drag = self.damping * power(x, form.damping_power) * self.slip
        spring, stiffness, keeps_force = np.zeros_like(drag), drag, form.memory[0] == 0.0
        if form.kind == "spring":
            now, rescaled = power(x, form.stiffness_power), form.memory[1] - form.memory[0]
            if rescaled:
                shrinks = now < self.last_power
                self.memory = np.where(shrinks, self.memory * power(now / self.last_power, rescaled), self.memory)
            self.last_power, stiffness = now, self.stiffness * now
            if keeps_force:
                spring = self.memory + step * stiffness * self.slip
            else:
                spring = stiffness * (self.memory + step * self.slip)
        trial = spring if form.cap == "spring" else spring + drag
        slips = np.abs(trial) > limit
        at_limit = np.copysign(limit, trial)
        phi = np.where(slips, at_limit, spring + drag)
        if form.kind == "spring":
            match form.cap:
                case "spring":
                    left = at_limit
                case "total":
                    left = at_limit - drag
                case "both":
                    # a dashpot that turns the force leaves the spring as it is
                    left = np.where(spring * at_limit > 0.0, np.clip(spring, -limit, limit), spring)
            self.memory = np.where(slips, left, spring)
            if not keeps_force:
                memory = np.where(stiffness > 0.0, self.memory / stiffness, 0.0)
                # where it slips, LAMMPS of 22 July 2025 divides the force by k, not by k a
                is_classic = slips & (self.radius > 0.0)
                self.memory = memory * np.where(is_classic, self.radius * self.last_power, 1.0)
        self.slip = self.slip - step * phi
        self.changes = self.changes + ((self.regime != 0) & (slips != self.slipped)).astype(np.int32)
        self.regime, self.slipped = self.regime | np.where(slips, SLIDES, STICKS), slips
