"""Rigid balls: the impulse-momentum solution, and of oblique impacts effective tangential mass, slip and spin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from ..array_types import Array
from .impacts import Impacts
from .materials import effective_mass
from .powers import replace_where


def velocities_at(impacts: Impacts, impulse: Array) -> tuple[Array, Array]:
    """Compute v1, v2 [m/s] once an impulse tau [N s] has passed: equations (8) and (9), shape (n,).

    (9) as printed has a minus, an erratum. An infinite mass (a wall) keeps its velocity.
    """
    return impacts.v1 - impulse / impacts.m1, impacts.v2 + impulse / impacts.m2


def velocities_after(impacts: Impacts, e: Array) -> tuple[Array, Array]:
    """Compute v1+, v2+ [m/s] after an impact of restitution e, the reference for every law: equations (6), (7).

    Arrays of shape (n,). Balls that do not approach keep their velocities; an impulse that overflows gives NaN.
    """
    impulse = replace_where((1.0 + e) * impacts.m * impacts.v0, ~(impacts.v0 > 0.0), 0.0)
    return velocities_at(impacts, replace_where(impulse, ~np.isfinite(impulse), np.nan))


@dataclass(frozen=True)
class ObliqueImpacts:
    """The tangential inputs of impacts; arrays that broadcast with those of the impacts.

    Friction -f acts on ball 1 and f on ball 2, along the tangent, at the contact point; P is the integral of f. An
    infinite mass (a wall) has no tangential motion and no spin; a plane, of infinite radius, has no spin.

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
    def mass_ratio(self) -> Array:
        """m_t/m [-]; of the same bits for all masses against a wall, and for balls of the same inertia factor."""
        m1, m2 = self.impacts.m1, self.impacts.m2
        share1, share2 = (1.0 + 1.0 / self._inertia_factor(ball) for ball in ("1", "2"))
        if np.isinf(m1).any() or np.isinf(m2).any():
            share1, share2 = np.where(np.isinf(m1), share2, share1), np.where(np.isinf(m2), share1, share2)
        is_equal = share1 == share2
        if is_equal.all():
            return 1.0 / share1
        return np.where(is_equal, 1.0 / share1, effective_mass(m1 / share1, m2 / share2) / self.impacts.m)

    @cached_property
    def m_t(self) -> Array:
        """Effective tangential mass [kg]: 1/((1 + 1/q1)/m1 + (1 + 1/q2)/m2)."""
        return self.mass_ratio * self.impacts.m

    @cached_property
    def G0(self) -> Array:
        """The slip before the impact in units in which friction of mu changes it at the rate of the force.

        It has the same bits at the same angle, whatever the speed is.
        """
        slip_ratio = self.slip / self.impacts.v0 if self.tangent is None else self._tangent_of_slip
        return self.mass_ratio * slip_ratio / self.mu

    @cached_property
    def _tangent_of_slip(self) -> Array:
        """The slip over v0 before the impact, where the angle is given."""
        spinning = _rim(self.impacts.R1, self.omega1) + _rim(self.impacts.R2, self.omega2)
        return np.asarray(self.tangent) + spinning / self.impacts.v0

    @cached_property
    def slip(self) -> Array:
        """Slip speed of the contact points before the impact [m/s], g0 = (u1 + R1 omega1) - (u2 - R2 omega2)."""
        slip = (self.u1 + _rim(self.impacts.R1, self.omega1)) - (self.u2 - _rim(self.impacts.R2, self.omega2))
        # a spin may cancel the slip of one of them, and leave a rounding error of the other
        return slip if self.tangent is None else np.where(self._tangent_of_slip == 0.0, 0.0, slip)

    def spin_after(self, ball: Literal["1", "2"], impulse: Array) -> Array:
        """Compute the spin of a ball after an impulse P [N s]: omega - P/(q m R) [rad/s].

        It is NaN where a ball turns whose radius is unknown.
        """
        omega = getattr(self, f"omega{ball}")
        mass, R = (getattr(self.impacts, f"{name}{ball}") for name in ("m", "R"))
        inertia = self._inertia_factor(ball) * mass
        # R is not read where nothing turns, since it may be unknown there
        return np.asarray(omega - np.where(np.isinf(inertia), 0.0, impulse / (inertia * R)))

    def _inertia_factor(self, ball: Literal["1", "2"]) -> Array:
        """q, infinite for a plane."""
        mass, R = (getattr(self.impacts, f"{name}{ball}") for name in ("m", "R"))
        # a plane of infinite mass is a wall, of which no inertia matters
        q, is_plane = np.asarray(getattr(self, f"inertia_factor{ball}")), np.isinf(R) & np.isfinite(mass)
        return np.where(is_plane, np.inf, q) if is_plane.any() else q


def _rim(radius: Array, omega: Array) -> Array:
    """R omega; 0 where nothing turns, also for a plane or an unknown radius."""
    return np.where(omega == 0.0, 0.0, radius) * omega
