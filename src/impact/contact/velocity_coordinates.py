"""Velocity coordinates: the second component of the motion, v or its substitute for strong damping.

In the coordinate "log" a force F = xⁿ (1 + χ v) gives, with dt = p sᵖ⁻¹ dσ and x = sᵖ,

    u = ln(1 + χ v),  du/dσ = −χ p sᵖ⁻¹ xⁿ,

which is not stiff for any χ. In "force" a force F = xⁿ + c x^q v gives

    w = v + x^(n−q)/c,  F = c x^q w,  dw/dσ = −p sᵖ⁻¹ F + (p(n − q)/c) s^(p(n−q)−1) v,

in which the force keeps its digits down to its zero, although spring and dashpot nearly cancel on the way there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..array_types import Array, Mask
from .formula_calls import call_by_name
from .model import COORDINATE_COEFFICIENTS, ForceModel
from .powers import integer_power, power

# damping above which an impact is integrated in the coordinate of its law; below it v is faster, although it takes
# up to a third more steps
STRONG_DAMPING = {"log": 5.0, "force": 2.0}


class VelocityCoordinate:
    """The coordinate v, and the interface of the others; arrays are of shape (n,), y is (2, n) and k is (5, n).

    `strength` is the coefficient that measures the damping: its name in the class, its values in the methods.
    """

    strength = ""

    def of(self, s: Array, v: Array | float, strength: Array) -> Array | float:
        """The coordinate at s for a velocity, that all trajectories may have."""
        return v

    def velocity(self, y: Array, strength: Array) -> Array:
        """v from the components."""
        return np.asarray(y[1])

    def stop(self, y: Array, k: Array) -> tuple[Array, Array]:
        """Compute a function that falls to zero with the velocity, and its rate, from components y and rates k."""
        return y[1], k[1]

    def force(self, y: Array, force: Array, strength: Array) -> Array:
        """F from the components; `force` is that from v."""
        return force

    def rate(self, out: Array, y: Array, v: Array, weight: Array, force: Array, elastic: Array, c: Array) -> None:
        """Write the rate of the second component to `out`, which contains p sᵖ⁻¹ F; c is the strength."""
        np.negative(out, out)


class LogCoordinate(VelocityCoordinate):
    """The coordinate u = ln(1 + χ v)."""

    strength = COORDINATE_COEFFICIENTS["log"][0]

    def of(self, s: Array, v: Array | float, strength: Array) -> Array:
        return np.asarray(np.log1p(strength * v))

    def velocity(self, y: Array, strength: Array) -> Array:
        return np.asarray(np.expm1(y[1]) / strength)

    def rate(self, out: Array, y: Array, v: Array, weight: Array, force: Array, elastic: Array, c: Array) -> None:
        out[:] = rate_of_log(weight, elastic, c)


def rate_of_log(weight: Array, elastic: Array | float, chi: Array) -> Array:
    """du/dσ; for arrays and for numbers."""
    return -weight * elastic * chi


def velocity_of_force(w: Array, power_of_s: Array, c: Array) -> Array:
    """v = w − s^(p(n−q))/c; for arrays and for numbers."""
    return w - power_of_s / c


def rate_of_force(v: Array, power_of_s: Array, factor: Array, weight: Array, force: Array) -> Array:
    """dw/dσ, with factor = p(n − q)/c and power_of_s = s^(p(n−q)−1); for arrays and for numbers."""
    return factor * power_of_s * v - weight * force


@dataclass(frozen=True)
class ForceCoordinate(VelocityCoordinate):
    """The coordinate w; `drag` and `spring` are exponents of s: x^q = s^drag and x^(n−q) = s^spring."""

    drag: float
    spring: float
    strength = COORDINATE_COEFFICIENTS["force"][0]

    def of(self, s: Array, v: Array | float, strength: Array) -> Array:
        return np.asarray(v + signed_power(s, self.spring) / strength)

    def velocity(self, y: Array, strength: Array) -> Array:
        return velocity_of_force(y[1], signed_power(y[0], self.spring), strength)

    def stop(self, y: Array, k: Array) -> tuple[Array, Array]:
        return k[0], -k[2] * k[4]

    def force(self, y: Array, force: Array, strength: Array) -> Array:
        # the same as the force from v, without the loss of digits near its zero
        return np.asarray(strength * signed_power(y[0], self.drag) * y[1])

    def rate(self, out: Array, y: Array, v: Array, weight: Array, force: Array, elastic: Array, c: Array) -> None:
        out[:] = rate_of_force(v, signed_power(y[0], self.spring - 1.0), self.spring / c, weight, force)


def is_strong(model: ForceModel, values: Mapping[str, Array | float], count: int) -> Mask:
    """Find which impacts the coordinate of their law suits, by their own damping alone; shape (count,)."""
    kind = model.velocity_coordinate
    if kind not in STRONG_DAMPING:
        return np.zeros(count, bool)
    strength = np.asarray(values[COORDINATE_COEFFICIENTS[kind][0]])
    return np.broadcast_to(strength > STRONG_DAMPING[kind], count)


def coordinate(model: ForceModel, n: float) -> VelocityCoordinate:
    """Find the coordinate that a law declares for strong damping."""
    if model.velocity_coordinate == "log":
        return LogCoordinate()
    if model.velocity_coordinate == "force":
        return force_form(model, n)
    return VelocityCoordinate()


def force_form(model: ForceModel, n: float) -> ForceCoordinate:
    """Find the coordinate w of a law that declares the form K δⁿ + c δ^q δ̇."""
    q = float(call_by_name(model.coefficients["q"], {"n": n}))
    return ForceCoordinate(model.coordinate_power * q, model.coordinate_power * (n - q))


def signed_power(s: Array, exponent: float) -> Array:
    """s to a power; a whole power is continued to negative s, so that a step across the release is smooth."""
    return integer_power(s, int(exponent)) if float(exponent).is_integer() else power(np.abs(s), exponent)
