"""The slip of contacts under friction as codes with a fixed time step integrate it, with the force of each step.

In the contact's own units, see `impact.contact.tangential`, a step changes the memory of the spring, z <- z + h G,
or z <- z + h k X G for a law that remembers the force, where X = x^kp, at the indentation before the step. On
unloading the rescaled laws first change z by a power of X. Then the force follows with its limit N = abs(F) or
max(F, 0), and G <- G - h phi. The normal motion does not depend on it, but for that of a cone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Flags, Mask
from .powers import power
from .slip_motion import SLIDES, STICKS, TangentialForm

# names of the values of a tangential problem, which no value of a law has: the size of the slip at first contact,
# stiffness and damping of the tangential spring per power of x, 1 where only a pressing force limits friction, the
# factor from G to the slip y of a coefficient of friction that depends on it, and what only schemes know
PREFIX = "friction."
SLIP, TANGENTIAL_STIFFNESS, TANGENTIAL_DAMPING, LIMIT_POSITIVE, SLIP_SCALE, RADIUS, COUPLING = (
    f"{PREFIX}{name}" for name in ("G0", "k", "c", "positive", "slip_scale", "radius", "coupling")
)


@dataclass
class FixedStepSlip:
    """The slip of contacts at fixed steps; arrays of shape (n,), of which those of ended contacts are removed.

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
    regime: Flags
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

    def take(self, rows: NDArray[Any]) -> FixedStepSlip:
        """Take some of the contacts."""
        return FixedStepSlip(self.form, *(getattr(self, field.name)[rows] for field in fields(self)[1:]))

    def put(self, rows: NDArray[Any], part: FixedStepSlip) -> None:
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
