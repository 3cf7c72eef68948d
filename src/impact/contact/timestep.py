"""Collisions as codes with a fixed time step integrate them, with one evaluation of the force per step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array
from .formula import Formula, argument_names
from .model import ForceModel
from .motion import MotionLaw, force_at_peak, indentation, unloading_state
from .powers import power
from .scaling import with_coefficients, with_units
from .status import Status

# the update of one step, by the name of the scheme
KICK_DRIFT = "kick-drift"
SCHEMES = {
    KICK_DRIFT: "u <- u - h F(x, u)/m, then x <- x + h u; the force is evaluated at the position and velocity "
    "before the step",
}
# a contact that takes more steps, in units of its steps at the continuous contact time, never ends
MAX_CONTACTS = 50
# trajectories that have ended are removed when they are this share
COMPACTION_SHARE = 0.25


@dataclass(frozen=True)
class FixedStepResult:
    """Collisions at a fixed step, in the contact's own units; arrays of shape (n,).

    `e_out` is NaN for a collision that fails, `peak` the largest indentation at the end of a step, `steps` the
    number of steps, `status` a `Status`.
    """

    e_out: Array
    peak: Array
    steps: NDArray[np.int32]
    status: NDArray[np.int8]


def collide_at_fixed_step(
    model: ForceModel, n: float, values: Mapping[str, Array], step: Array, phase: Array, max_steps: int
) -> FixedStepResult:
    """Collisions by the scheme "kick-drift".

    The contact begins with the overlap `phase * step * v0` at the first step that sees it. The contact ends with
    the first step after which the surfaces do not overlap. The force of a law that ends at zero force is never
    negative. A law with an unloading branch follows it from the first step after which the velocity is not
    positive.

    Parameters
    ----------
    model : the law
    n : compliance exponent
    values : `impact.contact.scaling.dimensionless_values`, each of shape (k,)
    step : time step, in the contact's own unit of time, shape (k,)
    phase : where in its step the contact begins, 0 < phase <= 1, shape (k,)
    max_steps : steps that a collision may take

    Returns
    -------
    FixedStepResult : arrays of shape (k,)
    """
    count = step.size
    law = MotionLaw.of(model, n, strong=False)
    with np.errstate(all="ignore"):
        law_values = with_coefficients(model, with_units(values, n), count)
        params = tuple(np.broadcast_to(law_values[name], count).copy() for name in law.names)
        return _run(_Contacts(law, params, step.copy(), phase * step, np.ones(count)), max_steps)


class _Contacts:
    """The collisions that go on; arrays of shape (n,), of which those that have ended are removed."""

    def __init__(self, law: MotionLaw, params: tuple[Array, ...], step: Array, x: Array, u: Array) -> None:
        self.law, self.params, self.step, self.x, self.u = law, params, step, x, u
        self.peak, self.residual = x.copy(), np.zeros_like(x)
        self.rows = np.arange(x.size)
        self.unloads = np.zeros(x.size, bool)
        # what the unloading branch needs besides the law's own params
        self.branch: tuple[Array, ...] = ()
        if law.model.unloading is not None:
            self.branch = tuple(np.zeros_like(x) for _ in range(4))

    def force(self) -> Array:
        """The force at the position and velocity before the step."""
        law = self.law
        force = self._formula(law.model.force, self.params, {})
        unloading = law.model.unloading
        if unloading is not None and self.unloads.any():
            peak, at_peak, residual, recovered = self.branch
            extra = {
                "peak": peak,
                "force_at_peak": at_peak,
                "residual": residual,
                "recovered": recovered,
                "stretch": np.maximum(self.x - residual, 0.0),
            }
            force = np.where(self.unloads, self._formula(unloading, self.params, extra), force)
        return np.maximum(force, 0.0) if law.model.release == "force" else force

    def _formula(self, formula: Formula, params: tuple[Array, ...], extra: Mapping[str, Array]) -> Array:
        names = argument_names(formula)
        arguments: dict[str, Array] = {"x": self.x, "v": self.u, **extra}
        if "elastic" in names:
            arguments["elastic"] = power(np.maximum(self.x, 0.0), self.law.n)
        value = self.law.call(formula, params, arguments)
        return np.broadcast_to(value, self.x.shape)

    def advance(self) -> None:
        """One step of all collisions."""
        self.u = self.u - self.step * self.force()
        self.x = self.x + self.step * self.u
        np.maximum(self.peak, self.x, out=self.peak)
        if self.law.model.unloading is not None:
            turned = ~self.unloads & (self.u <= 0.0)
            if turned.any():
                self._turn(turned)

    def _turn(self, turned: NDArray[np.bool_]) -> None:
        """Begin the unloading branch of some collisions at the largest indentation that they reached."""
        peak = self.peak[turned]
        params = tuple(column[turned] for column in self.params)
        s = power(peak, 1.0 / self.law.model.coordinate_power)
        at_peak = force_at_peak(self.law, s, params)
        residual, recovered, _ = unloading_state(self.law, params, indentation(self.law, s), at_peak)
        for column, new in zip(self.branch, (peak, at_peak, residual, recovered), strict=True):
            column[turned] = new
        self.residual[turned] = residual
        self.unloads |= turned

    def keep(self, going: NDArray[np.bool_]) -> None:
        """Remove the collisions that have ended."""
        for name in ("step", "x", "u", "peak", "residual", "rows", "unloads"):
            setattr(self, name, getattr(self, name)[going])
        self.params = tuple(column[going] for column in self.params)
        self.branch = tuple(column[going] for column in self.branch)


def _run(contacts: _Contacts, max_steps: int) -> FixedStepResult:
    count = contacts.x.size
    result = FixedStepResult(
        e_out=np.full(count, np.nan),
        peak=np.full(count, np.nan),
        steps=np.full(count, max_steps, np.int32),
        status=np.full(count, Status.NOT_SEPARATED, np.int8),
    )
    going = np.ones(count, bool)
    for step in range(1, max_steps + 1):
        contacts.advance()
        is_finite = np.isfinite(contacts.x) & np.isfinite(contacts.u)
        has_ended = going & ((contacts.x <= contacts.residual) | ~is_finite)
        if has_ended.any():
            rows, ended_well = contacts.rows[has_ended], is_finite[has_ended]
            result.e_out[rows] = np.where(ended_well, -contacts.u[has_ended], np.nan)
            result.peak[rows] = contacts.peak[has_ended]
            result.steps[rows] = step
            result.status[rows] = np.where(ended_well, Status.OK, Status.NOT_FINITE)
            going &= ~has_ended
            if not going.any():
                break
            if np.count_nonzero(going) < (1.0 - COMPACTION_SHARE) * going.size:
                contacts.keep(going)
                going = np.ones(contacts.x.size, bool)
    return result
