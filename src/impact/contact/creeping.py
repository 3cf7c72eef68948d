"""Creeping: balls whose damping pulls until the gap closes, so strongly that they part with no speed."""

from __future__ import annotations

import numpy as np

from ..errors import ModelError
from ..ode.problem import Columns, Mask, Rates
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


# bounds B x^k of a speed that are tried: the exponents k, and B peak^(k-1) in units of v0/length; and the
# indentations, relative to the peak, at which each has to hold
BOUND_EXPONENTS = (1.0, 1.25, 1.5, 2.0)
BOUND_RATES = np.geomspace(1e-4, 1e4, 65)
BOUND_INDENTATIONS = 10.0 ** -np.linspace(0.0, 40.0, 81)
# trajectories that are judged together
MAX_TOGETHER = 4096


def never_part(rates: Rates, columns: Columns, peak: Array, smooth: int) -> Mask:
    """Which balls at rest at their peak never part, by any law whose contact ends at zero indentation.

    If F(x, -B x^k) <= -k B^2 x^(2k-1) for all x from 0 to the peak, with some B and some k >= 1, the speed w of
    the rebound cannot grow beyond B x^k: at w = B x^k it falls faster than that bound does. Then
    dx/dt >= -B x^k, and x stays above zero for ever. Where no such bound is found nothing is claimed.

    Parameters
    ----------
    rates : of the restitution phase in s and v
    columns : what the rates need, each of shape (n,)
    peak : indentation at the begin of the phase, above the permanent one, shape (n,)
    smooth : p of x = s^p
    """
    found = np.zeros(peak.size, bool)
    for first in range(0, peak.size, MAX_TOGETHER):
        part = slice(first, first + MAX_TOGETHER)
        found[part] = _never_part(rates, tuple(column[part] for column in columns), peak[part], smooth)
    return found


def _never_part(rates: Rates, columns: Columns, peak: Array, smooth: int) -> Mask:
    found = np.zeros(peak.size, bool)
    x = (peak[:, None] * BOUND_INDENTATIONS).reshape(-1)
    s = power(x, 1.0 / smooth)
    repeated = tuple(np.repeat(column, BOUND_INDENTATIONS.size) for column in columns)
    for k in BOUND_EXPONENTS:
        for rate in BOUND_RATES:
            bound = np.repeat(rate * power(peak, 1.0 - k), BOUND_INDENTATIONS.size)
            try:
                force = rates(np.array([s, -bound * power(x, k)]), repeated)[4]
            except ModelError:
                # a formula need not know such a state
                return found
            falls = k * bound * bound * power(x, 2.0 * k - 1.0)
            holds = force + falls <= (CRITICAL - 1.0) * falls
            found |= holds.reshape(peak.size, -1).all(axis=1)
        if found.all():
            break
    return found
