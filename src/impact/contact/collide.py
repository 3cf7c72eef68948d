"""Collide: from impacts in SI to where each ball leaves, by one law."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .impulse import velocities_after
from .lanes import Lanes
from .model import ForceModel, Law
from .power import Array, all_within
from .status import FIRST_FAILURE, LIMIT, NO_IMPACT, OK, Status
from .strike import Rebound
from .trajectories import integrate_all
from .values import own_values

Mask = NDArray[np.bool_]

# the outputs of an impact that a result has by default, in its order, and those that it has on request
BY_DEFAULT = (
    "v1_post", "v2_post", "v1_reference", "v2_reference", "v1_error", "v2_error", "e_out", "e_error",
    "peak_indentation", "permanent_indentation", "peak_force", "contact_time", "energy_loss", "stiffness",
    "damping_ratio", "energy_residual", "closed_form_error", "status", "in_domain", "steps",
)  # fmt: skip
OUTPUTS = (*BY_DEFAULT, "e_kinetic", "e_energetic", "lambda", "separation_time")
quiet = np.errstate(all="ignore")
# what of an impact is checked before it is integrated, see `first_look`
CHECKS = frozenset({"e", "v0", "length"})


@dataclass(frozen=True)
class Contact:
    """The outputs of struck impacts in SI, under the names of the result file, each computed when it is asked for.

    Its arrays have the shape of the lanes, or broadcast to it; an impact that failed has NaN.

    Parameters
    ----------
    model : the law
    lanes : the impacts
    rebound : what the law does with them, in the contact's own units, of shapes that broadcast to theirs
    known : what `first_look` says of them, where it has been asked
    """

    model: Law
    lanes: Lanes
    rebound: Rebound
    known: NDArray[np.int8] | None = None

    @cached_property
    @quiet
    def _first(self) -> NDArray[np.int8]:
        return first_look(self.model, self.lanes) if self.known is None else self.known

    @cached_property
    def status(self) -> NDArray[np.int8]:
        return _but(self.rebound.status, self._left_alone, self._first)

    @cached_property
    def _left_alone(self) -> Mask | None:
        return _if_any(self._first != OK)

    @cached_property
    def _failed(self) -> Mask | None:
        return _if_any(self.status >= FIRST_FAILURE)

    @cached_property
    def _missed(self) -> Mask | None:
        return _if_any(self._first == NO_IMPACT)

    @cached_property
    def _unknown(self) -> Mask | None:
        return self._failed if self._missed is None else _if_any(self._missed | (self.status >= FIRST_FAILURE))

    @cached_property
    @quiet
    def _posts(self) -> tuple[Array, Array]:
        return velocities_after(self.lanes, self.e_out)

    @cached_property
    def _asked(self) -> Array:
        e = self.lanes.e
        return e if all_within(e, 0.0, 1.0) else np.where((e >= 0.0) & (e <= 1.0), e, np.nan)

    @cached_property
    @quiet
    def _references(self) -> tuple[Array, Array]:
        return velocities_after(self.lanes, self._asked)

    @quiet
    def _si(self, value: Array, unit: Array) -> Array:
        """A value in a unit of the contact's own; nothing moves where the balls miss each other."""
        return _but(_but(value * unit, self._failed, np.nan), self._missed, 0.0)

    @cached_property
    def v1_post(self) -> Array:
        return self._posts[0]

    @cached_property
    def v2_post(self) -> Array:
        return self._posts[1]

    @cached_property
    def v1_reference(self) -> Array:
        return self._references[0]

    @cached_property
    def v2_reference(self) -> Array:
        return self._references[1]

    @cached_property
    @quiet
    def v1_error(self) -> Array:
        return self.v1_post - self.v1_reference

    @cached_property
    @quiet
    def v2_error(self) -> Array:
        return self.v2_post - self.v2_reference

    @cached_property
    def e_out(self) -> Array:
        return _but(self.rebound.e_out, self._unknown, np.nan)

    @cached_property
    def e_error(self) -> Array:
        return self.e_out - self._asked

    @cached_property
    def peak_indentation(self) -> Array:
        return self._si(self.rebound.peak, self.lanes.length)

    @cached_property
    def permanent_indentation(self) -> Array:
        return self._si(self.rebound.permanent, self.lanes.length)

    @cached_property
    @quiet
    def peak_force(self) -> Array:
        return self._si(self.rebound.force, self.lanes.energy / self.lanes.length)

    @cached_property
    @quiet
    def contact_time(self) -> Array:
        return self._si(self.rebound.contact_time, self.lanes.time)

    @cached_property
    @quiet
    def energy_loss(self) -> Array:
        return self._si(1.0 - self.rebound.e_out * self.rebound.e_out, 0.5 * self.lanes.energy)

    @cached_property
    def stiffness(self) -> Array:
        return _but(self.lanes.K, self._failed, np.nan)

    @cached_property
    def damping_ratio(self) -> Array:
        chi = self.rebound.chi
        return _but(_but(chi, self._left_alone, np.nan), _if_any(np.isinf(chi)), np.nan)

    @cached_property
    @quiet
    def energy_residual(self) -> Array:
        rebound = self.rebound
        work = rebound.approach_work + rebound.restitution_work
        return _but(work - (1.0 - rebound.e_out * rebound.e_out), self._unknown, np.nan)

    @cached_property
    @quiet
    def closed_form_error(self) -> Array:
        return self.e_out - self.rebound.exact

    @cached_property
    def in_domain(self) -> NDArray[np.int8]:
        inside = np.ones((1,) * max(1, len(self.lanes.shape)), bool)
        for name, (low, high) in self.model.domain.items():
            value = self.damping_ratio if name == "chi" else self.lanes.quantity(name)
            # what is not known, such as an e that was not asked for, is not claimed
            inside = inside & (value >= low) & (value <= high)
        return inside.astype(np.int8)

    @cached_property
    def steps(self) -> NDArray[np.int32]:
        return _but(self.rebound.steps, self._left_alone, np.int32(0))

    @property
    def e_kinetic(self) -> Array:
        """tau_r/tau_c, equation (2): the phases change the momentum by m v0 and e_out m v0, so this is e_out."""
        return self.e_out

    @cached_property
    @quiet
    def e_energetic(self) -> Array:
        """sqrt(-W_r/W_c), equation (3), from the works that were integrated; 0 where the balls stay together."""
        rebound = self.rebound
        e = np.sqrt(np.maximum(-rebound.restitution_work, 0.0) / rebound.approach_work)
        return _but(_but(e, _if_any(rebound.status == LIMIT), 0.0), self._unknown, np.nan)

    @cached_property
    @quiet
    def damping(self) -> Array:
        """lambda = chi K/v0 [N s/m^(n+1)]."""
        return self.damping_ratio * self.stiffness / self.lanes.v0

    @cached_property
    @quiet
    def separation_time(self) -> Array:
        """Time until the surfaces part: after the force has ended they move at e_out v0. NaN if they never do."""
        rebound = self.rebound
        if self.model.is_permanent:
            # a permanent indentation stays in the surfaces, which part at the release
            return self.contact_time
        rest = np.where(rebound.permanent > 0.0, rebound.permanent / rebound.e_out, 0.0)
        return self._si(rebound.contact_time + np.where(np.isinf(rest), np.nan, rest), self.lanes.time)


# the name in the result file is a keyword of Python
setattr(Contact, "lambda", Contact.damping)


def _if_any(found: Mask) -> Mask | None:
    """A mask, if there is anything in it: none is cheaper than an empty one."""
    return found if found.any() else None


def _but(value: NDArray[Any], where: Mask | None, otherwise: NDArray[Any] | float | np.int32) -> NDArray[Any]:
    """The value, but another one somewhere."""
    return value if where is None else np.where(where, otherwise, value)


def collide(
    model: ForceModel,
    lanes: Lanes,
    *,
    rtol: float,
    max_steps: int,
    collapse: bool = True,
    core: str = "numpy",
    errors: dict[str, str] | None = None,
) -> Contact:
    """Let every pair of balls collide by the law of a model.

    Parameters
    ----------
    model : the law
    lanes : the impacts, n of them
    rtol : local error of a step of the integrator, relative
    max_steps : attempted steps per phase after which an impact is given up
    collapse : integrate impacts that are the same in the contact's own units once; changes no bit
    core : "numpy", or "numba" for what that compiles; they agree within the tolerance
    errors : receives a line for each distinct error that the law raised, see `impact.contact.formula.explained`

    Returns
    -------
    Contact : arrays of shape (n,); an impact that fails has NaN and a status, and disturbs no other
    """
    with np.errstate(all="ignore"):
        given, status = own_values(model, lanes), first_look(model, lanes)
    rebound = integrate_all(
        model, lanes.n, given, status,
        rtol=rtol, max_steps=max_steps, collapse=collapse, core=core, errors=errors,
    )  # fmt: skip
    return Contact(model, lanes, rebound, status)


def first_look(model: Law, lanes: Lanes, checks: frozenset[str] = CHECKS) -> NDArray[np.int8]:
    """What can be said of impacts before they are integrated; of a shape that broadcasts to theirs.

    Parameters
    ----------
    model : the law
    lanes : the impacts
    checks : what is looked at: the restitution "e", the closing speed "v0", and the sizes of the contact,
        "length", the unit of which comes from all of them
    """
    status = np.asarray(Status.OK, np.int8)
    if "length" in checks:
        sizes = [lanes.m, lanes.K, lanes.length, lanes.energy, lanes.time]
        least, most = np.nextafter(0.0, 1.0), np.finfo(float).max
        for size in sizes:
            status = _unless(size, least, most, status, Status.OUT_OF_RANGE)
    if "e" in checks and "e" in model.quantities:
        status = _unless(lanes.e, 0.0, 1.0, status, Status.INVALID_PARAMETER)
    if "v0" in checks or "length" in checks:
        status = _unless(lanes.v0, np.nextafter(0.0, 1.0), np.inf, status, Status.NO_IMPACT)
    return status.astype(np.int8)


def _unless(
    values: Array, least: float, most: float, status: NDArray[np.int8], otherwise: Status
) -> NDArray[np.int8]:
    """The status, but another one where a value is not within bounds."""
    if all_within(values, least, most):
        return status
    return np.where((values >= least) & (values <= most), status, otherwise)
