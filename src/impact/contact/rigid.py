"""Oblique impacts of rigid balls: effective tangential mass, slip, and the motion after an impulse."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..array_types import Array
from .impacts import Impacts
from .materials import effective_mass


@dataclass(frozen=True)
class ObliqueImpacts:
    """The tangential inputs of impacts; arrays that broadcast with those of the impacts.

    Parameters
    ----------
    impacts : the normal inputs, with masses and radii
    u1, u2 : tangential velocities of the centres [m/s]
    omega1, omega2 : spins [rad/s]
    inertia_factor1, inertia_factor2 : q in the moment of inertia I = q m R^2 [-]; infinity does not turn
    mu : coefficient of friction [-]
    tangent : (u1 - u2)/v0, the tangent of the angle of the impact, where that is given
    parameters : those of the friction law by name, in the units it declares
    """

    impacts: Impacts
    u1: Array
    u2: Array
    omega1: Array
    omega2: Array
    inertia_factor1: Array
    inertia_factor2: Array
    mu: Array
    tangent: Array | None = None
    parameters: Mapping[str, Array] = field(default_factory=dict)

    @cached_property
    def m_t(self) -> Array:
        """Effective tangential mass [kg]: 1/((1 + 1/q1)/m1 + (1 + 1/q2)/m2)."""
        share1, share2 = (1.0 + 1.0 / q for q in (self.inertia_factor1, self.inertia_factor2))
        return effective_mass(self.impacts.m1 / share1, self.impacts.m2 / share2)

    @cached_property
    def slip_ratio(self) -> Array:
        """g0/v0; of the same bits at the same angle, whatever the speed is."""
        if self.tangent is None:
            return self.slip / self.impacts.v0
        spinning = _rim(self.impacts.R1, self.omega1) + _rim(self.impacts.R2, self.omega2)
        return self.tangent + spinning / self.impacts.v0

    @cached_property
    def G0(self) -> Array:
        """The slip before the impact in units in which friction of mu changes it at the rate of the force."""
        return self.m_t / self.impacts.m * self.slip_ratio / self.mu

    @cached_property
    def slip(self) -> Array:
        """Slip speed of the contact points before the impact [m/s], g0 = (u1 + R1 omega1) - (u2 - R2 omega2)."""
        return (self.u1 + _rim(self.impacts.R1, self.omega1)) - (self.u2 - _rim(self.impacts.R2, self.omega2))


def _rim(radius: Array, omega: Array) -> Array:
    """R omega; 0 where nothing turns, also for a plane or an unknown radius."""
    return np.where(omega == 0.0, 0.0, radius * omega)
