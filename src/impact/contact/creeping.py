"""Creeping: balls whose damping pulls until the gap closes, so strongly that they part with no speed."""

from __future__ import annotations

import numpy as np

from ..ode.problem import Mask
from .model import ForceModel
from .power import Array, power

# a damping is critical from this of its square on, which rounding may have made smaller
CRITICAL = 1.0 + 1e-12
# a speed that is none beside v0
NOTHING = 1e-10


def may_creep(model: ForceModel) -> bool:
    """Whether the balls may part with no speed, by a damping that pulls until the gap closes."""
    return model.momentum == "force" and model.release == "gap" and model.unloading is None


def creeps(x: Array, speed: Array, c: Array, n: float, q: float) -> Mask:
    """Which balls are sure to part with no speed, where F = xⁿ + c x^q v.

    Once speed ≤ b(x) = c x^(q+1)/(2(q + 1)) it stays so where x^(n−2q−1) ≤ c²/(4(q + 1)), for it changes at the
    rate xⁿ − c x^q speed. With n ≥ 2q + 1 that is for ever, and x stays above zero. Else it is as far as the x*
    that makes it an equation; beyond it no more than the energy is left, speed² ≤ b(x*)² + 2 x*^(n+1)/(n + 1).
    """
    bound, rest = c / (2.0 * (q + 1.0)), c * c / (4.0 * (q + 1.0))
    order = n - 2.0 * q - 1.0
    slow = speed <= bound * power(x, q + 1.0)
    if order == 0.0:
        return np.asarray(speed <= creeping_speed(c, n, q) * power(x, q + 1.0))
    if order > 0.0:
        return np.asarray(slow & (power(x, order) <= CRITICAL * rest))
    far = power(rest, 1.0 / order)
    left = np.square(bound * power(far, q + 1.0)) + 2.0 / (n + 1.0) * power(far, n + 1.0)
    return np.asarray(slow & (x >= far) & (left <= NOTHING * NOTHING))


def creeping_speed(c: Array, n: float, q: float) -> Array:
    """What a speed of balls that part with none is below, over x^(q+1), where n = 2q + 1; -inf where none is."""
    return np.where(CRITICAL * c * c >= 4.0 * (q + 1.0), c / (2.0 * (q + 1.0)), -np.inf)
