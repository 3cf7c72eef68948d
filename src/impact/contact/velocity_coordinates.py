"""Velocity coordinates: the second component of the motion, v or its substitute where the damping is strong.

In the coordinate "log" a force F = xⁿ (1 + χ v) gives, with dt = p sᵖ⁻¹ dσ and x = sᵖ,

    u = ln(1 + χ v),  du/dσ = −χ p sᵖ⁻¹ xⁿ,

which is not stiff for any χ. In "force" a force F = xⁿ + c x^q v gives

    w = v + x^(n−q)/c,  F = c x^q w,  dw/dσ = −p sᵖ⁻¹ F + (p(n − q)/c) s^(p(n−q)−1) v,

where the force keeps its digits down to its zero, though spring and dashpot cancel nearly all the way to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..ode.problem import Array
from .formula import call_by_name
from .model import COORDINATE_COEFFICIENTS, ForceModel
from .powers import integer_power, power

# an impact whose damping is above this takes its law's coordinate; below it v costs less, though it takes up to a
# third more steps
STRONG_DAMPING = {"log": 5.0, "force": 2.0}


class VelocityCoordinate:
    """v itself, and the interface of a coordinate; arrays are of shape (n,).

    `strength` is the coefficient, by name or its values, that measures the damping.
    """

    strength = ""

    def of(self, s: Array, v: float, strength: Array) -> Array | float:
        """The coordinate of a velocity that all have."""
        return v

    def velocity(self, y: Array, strength: Array) -> Array:
        """The velocity of the components."""
        return np.asarray(y[1])

    def stop(self, y: Array, k: Array) -> tuple[Array, Array]:
        """What falls to zero with the velocity, and its rate, from components and rates."""
        return y[1], k[1]

    def rates(self, out: Array, y: Array, weight: Array, elastic: Array, strength: Array) -> None:
        """Finish rates that have v, and p sᵖ⁻¹ F for the second component; a fifth row is F."""
        np.negative(out[1], out[1])


class LogCoordinate(VelocityCoordinate):
    """u."""

    strength = COORDINATE_COEFFICIENTS["log"][0]

    def of(self, s: Array, v: float, strength: Array) -> Array:
        return np.asarray(np.log1p(strength * v))

    def velocity(self, y: Array, strength: Array) -> Array:
        return np.asarray(np.expm1(y[1]) / strength)

    def rates(self, out: Array, y: Array, weight: Array, elastic: Array, strength: Array) -> None:
        out[1] = rate_of_log(weight, elastic, strength)


def rate_of_log(weight: Array, elastic: Array | float, chi: Array) -> Array:
    """du/dσ; for arrays and for numbers."""
    return -weight * elastic * chi


def velocity_of_force(w: Array, power_of_s: Array, c: Array) -> Array:
    """v = w − s^(p(n−q))/c; for arrays and for numbers."""
    return w - power_of_s / c


def rate_of_force(v: Array, power_of_s: Array, factor: Array, weight: Array, force: Array) -> Array:
    """dw/dσ, where the factor is p(n − q)/c and the power that of s^(p(n−q)−1); for arrays and for numbers."""
    return factor * power_of_s * v - weight * force


@dataclass(frozen=True)
class ForceCoordinate(VelocityCoordinate):
    """w; the exponents of s are those of the drag, x^q = s^drag, and of x^(n−q) = s^spring."""

    drag: float
    spring: float
    strength = COORDINATE_COEFFICIENTS["force"][0]

    def of(self, s: Array, v: float, strength: Array) -> Array:
        return np.asarray(v + signed_power(s, self.spring) / strength)

    def velocity(self, y: Array, strength: Array) -> Array:
        return velocity_of_force(y[1], signed_power(y[0], self.spring), strength)

    def stop(self, y: Array, k: Array) -> tuple[Array, Array]:
        return k[0], -k[2] * k[4]

    def rates(self, out: Array, y: Array, weight: Array, elastic: Array, strength: Array) -> None:
        # the force that did the work is the same, but for digits that it loses before its zero
        force = strength * signed_power(y[0], self.drag) * y[1]
        out[1] = rate_of_force(
            out[0], signed_power(y[0], self.spring - 1.0), self.spring / strength, weight, force
        )
        out[4:] = force


def is_strong(model: ForceModel, values: Mapping[str, Array | float], count: int) -> NDArray[np.bool_]:
    """Which impacts are integrated in their law's own coordinate: by their own damping, never by the batch."""
    if model.velocity_coordinate not in STRONG_DAMPING:
        return np.zeros(count, bool)
    return np.broadcast_to(
        np.asarray(values[COORDINATE_COEFFICIENTS[model.velocity_coordinate][0]])
        > STRONG_DAMPING[model.velocity_coordinate],
        count,
    )


def coordinate(model: ForceModel, n: float) -> VelocityCoordinate:
    """The coordinate for strong damping that a law declares."""
    if model.velocity_coordinate == "log":
        return LogCoordinate()
    if model.velocity_coordinate == "force":
        return force_form(model, n)
    return VelocityCoordinate()


def force_form(model: ForceModel, n: float) -> ForceCoordinate:
    """The coordinate of a law that declares the form K δⁿ + c δ^q δ̇."""
    q = float(call_by_name(model.coefficients["q"], {"n": n}))
    return ForceCoordinate(model.coordinate_power * q, model.coordinate_power * (n - q))


def signed_power(s: Array, exponent: float) -> Array:
    """s to a power. A whole power is continued through zero, so that a step across the release is smooth."""
    return integer_power(s, int(exponent)) if float(exponent).is_integer() else power(np.abs(s), exponent)
