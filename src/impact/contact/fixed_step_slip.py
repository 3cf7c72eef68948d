"""The slip of contacts under friction as codes with a fixed time step integrate it, with the force of each step.

In the contact's own units, see `impact.contact.tangential`, a step changes the memory of the spring, z <- z + h G,
or z <- z + h k X G for a law that remembers the force, where X = x^kp, at the indentation before the step. On
unloading the rescaled laws first change z by a power of X. Then the force follows with its limit N = abs(F) or
max(F, 0), and G <- G - h phi. The normal motion does not depend on it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array
from .powers import power
from .slip_motion import TangentialForm


@dataclass
class FixedStepSlip:
    """The slip of contacts at fixed steps; arrays of shape (n,), of which those of ended contacts are removed.

    Parameters
    ----------
    form : of the tangential problems
    slip : G, positive at first contact
    stiffness, damping : k' and c' per power of x
    is_positive : whether only a pressing force limits friction
    memory : z, a displacement or a force
    last_power : X at the step before, NaN before the first
    impulse : the integral of the limiting normal force
    sticks, slips : whether the contact has stuck, and slipped
    slipped : whether it slipped in the last step
    changes : how often one followed the other
    """

    form: TangentialForm
    slip: Array
    stiffness: Array
    damping: Array
    is_positive: Array
    memory: Array
    last_power: Array
    impulse: Array
    sticks: NDArray[np.bool_]
    slips: NDArray[np.bool_]
    slipped: NDArray[np.bool_]
    changes: NDArray[np.int32]

    @classmethod
    def of(
        cls, form: TangentialForm, slip: Array, stiffness: Array, damping: Array, is_positive: Array
    ) -> FixedStepSlip:
        """Begin contacts with these slips."""
        zero = np.zeros(slip.size)
        return cls(
            form=form,
            slip=slip.copy(),
            stiffness=stiffness.copy(),
            damping=damping.copy(),
            is_positive=is_positive.copy(),
            memory=zero.copy(),
            last_power=np.full(slip.size, np.nan),
            impulse=zero.copy(),
            sticks=np.zeros(slip.size, bool),
            slips=np.zeros(slip.size, bool),
            slipped=np.zeros(slip.size, bool),
            changes=np.zeros(slip.size, np.int32),
        )

    def take(self, rows: NDArray[Any]) -> FixedStepSlip:
        """Take some of the contacts."""
        columns = (getattr(self, field.name) for field in fields(self)[1:])
        return FixedStepSlip(self.form, *(column[rows] for column in columns))

    def put(self, rows: NDArray[Any], part: FixedStepSlip) -> None:
        """Write contacts that have ended to their positions."""
        for field in fields(self)[1:]:
            getattr(self, field.name)[rows] = getattr(part, field.name)

    def advance(self, x: Array, force: Array, step: Array) -> None:
        """Advance by a step, with the indentation and the normal force before it."""
        form = self.form
        limit = np.where(self.is_positive > 0.0, np.maximum(force, 0.0), np.abs(force))
        self.impulse = self.impulse + step * limit
        if form.kind == "coulomb":
            return
        drag = self.damping * power(x, form.damping_power) * self.slip
        spring = self._spring(x, step) if form.kind == "spring" else np.zeros_like(drag)
        trial = spring + drag if form.kind == "dashpot" or form.cap == "total" else spring
        slips = np.abs(trial) > limit
        at_limit = np.copysign(limit, trial)
        phi = np.where(slips, at_limit, spring + drag)
        if form.kind == "spring":
            self._remember(x, np.where(slips, at_limit - (drag if form.cap == "total" else 0.0), spring))
        self.slip = self.slip - step * phi
        self.changes = self.changes + ((self.sticks | self.slips) & (slips != self.slipped)).astype(np.int32)
        self.sticks, self.slips, self.slipped = self.sticks | ~slips, self.slips | slips, slips

    @property
    def remembers_force(self) -> bool:
        """Whether z is the force of the spring, not its displacement."""
        return self.form.memory[0] == 0.0

    def _spring(self, x: Array, step: Array) -> Array:
        """Compute the force of the spring in a step, before its limit."""
        form, now = self.form, power(x, self.form.stiffness_power)
        rescaled = form.memory[1] - form.memory[0]
        if rescaled:
            self.memory = np.where(
                now < self.last_power, self.memory * power(now / self.last_power, rescaled), self.memory
            )
        self.last_power = now
        stiffness = self.stiffness * now
        if self.remembers_force:
            return self.memory + step * stiffness * self.slip
        return stiffness * (self.memory + step * self.slip)

    def _remember(self, x: Array, spring: Array) -> None:
        """Keep the force of the spring, or the displacement that belongs to it."""
        if self.remembers_force:
            self.memory = spring
            return
        stiffness = self.stiffness * power(x, self.form.stiffness_power)
        self.memory = np.where(stiffness > 0.0, spring / stiffness, 0.0)
