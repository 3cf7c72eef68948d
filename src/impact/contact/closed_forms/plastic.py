"""Closed forms of elastic-plastic and adhesive laws: the returned energy over that of the approach."""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Array
from ..powers import integer_power, power

# Newton's iterations for the resolvent cubic, which converge from one side
CUBIC_ITERATIONS = 8
# halvings of an interval of indentations that locate the meeting of two branches to the last bit
BRANCH_HALVINGS = 60
# factor of the neck's work: ∫ (4t⁶/3 − 2t³)(4t³ − 1) dt, t = y/(b R)^(1/3), from the pull-off, t³ = 1/4, to t = 1
NECK_WORK = (8 / 15 - 4 / 3 + 1 / 2) - (8 / 15 * 4 ** (-10 / 3) - 4 / 3 * 4 ** (-7 / 3) + 1 / 2 * 4 ** (-4 / 3))


def thornton_restitution(q: Array | float) -> Array:
    """The restitution of elastic-perfectly plastic spheres, by q = V_y/V, the yield speed over the closing speed.

    e² = (6√3/5)(1 − q²/6) √(q/(q + 2√(6/5 − q²/5))); 1 where nothing yields, q >= 1.

    Parameters
    ----------
    q : V_y/V [-], >= 0, any shape

    >>> thornton_restitution(np.array([1.0, 0.1, 0.01])).round(6)
    array([1.      , 0.658558, 0.374299])
    """
    q = np.minimum(np.asarray(q, dtype=float), 1.0)
    share = np.sqrt(q / (q + 2.0 * np.sqrt(1.2 - 0.2 * q * q)))
    return np.asarray(np.sqrt(1.2 * math.sqrt(3.0) * (1.0 - q * q / 6.0) * share))


def luding_restitution(size: Array | float, k2: Array, kc: Array, shallow: Array) -> Array:
    """The restitution of Luding's law without a dashpot; 0 where the adhesion holds the balls.

    With K = 1 the approach stores size²/2 = δₘ²/2 up to the plastic depth δ*, beyond it δ*²/2 + δ* y + k₂ y²/2,
    y = δₘ − δ*. The unloading along k returns Fₘ²/(2k) down to F = 0 at δ₀, and from there the adhesion takes the
    triangle k k_c δ₀²/(2(k + k_c)).

    Parameters
    ----------
    size : v₀ √(m/K), the peak of an elastic impact, any shape
    k2, kc : largest unloading and adhesive stiffness over K
    shallow : 1/δ*

    >>> luding_restitution(1.0, np.array([1.0, 4.0, 4.0]), np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0]))
    array([1. , 0.5, 0. ])

    Beyond the plastic depth, where the unloading has the stiffness k₂:

    >>> luding_restitution(2.0, np.array([4.0]), np.array([0.0]), np.array([1.0])).round(6)
    array([0.901388])
    """
    with np.errstate(divide="ignore"):
        # the whole approach where nothing yields, and y = 0
        depth = np.minimum(np.divide(1.0, shallow), size)
    # y from the energy beyond δ*, δ* y + k₂ y²/2, by the form of the root without cancellation
    beyond = (size - depth) * (size + depth)
    y = beyond / (depth + np.sqrt(depth * depth + k2 * beyond))
    peak, force = depth + y, depth + k2 * y
    k = 1.0 + (k2 - 1.0) * np.minimum(peak * shallow, 1.0)
    rest = peak - force / k
    back = force * force / k - k * kc / (k + kc) * rest * rest
    return np.asarray(np.sqrt(np.maximum(back, 0.0)) / size)


def muthukumar_restitution(root: Array | float, K1: Array, K2: Array, depth: Array) -> Array:
    """The restitution of a bilinear loading, K₁ to a depth and then K₂, unloaded along K₁ to the line K₂ δ.

    The approach takes K₂ δₘ²/2 and, of the difference K₁ − K₂, depth²/2 + depth (δₘ − depth); what K₁ − K₂ gives
    back is the triangle of height (K₁ − K₂) depth on K₁'s way to the line, (K₁ − K₂) depth²/2. So δₘ follows from
    the energy, and the loss is (K₁ − K₂) depth (δₘ − depth).

    Parameters
    ----------
    root : v₀ √m, any shape
    K1, K2 : stiffnesses
    depth : indentation at which the stiffness of the loading changes

    >>> muthukumar_restitution(np.array([0.1, 10.0]), np.array(2.0), np.array(1.0), np.array(1.0)).round(6)
    array([1.      , 0.915429])
    """
    more = K1 - K2
    beyond = root * root - K1 * depth * depth
    # y = δₘ − depth from K₁ depth y + K₂ y²/2 = beyond/2
    y = np.maximum(beyond, 0.0) / (K1 * depth + np.sqrt(K1 * K1 * depth * depth + K2 * np.maximum(beyond, 0.0)))
    return np.asarray(np.sqrt(1.0 - 2.0 * more * depth * y / (root * root)))


def jkr_root(x: Array, R: Array, b: Array) -> Array:
    """The largest root y of y⁴/R − b y = x, the square root of the contact radius of Johnson, Kendall and Roberts.

    With the root m of the resolvent cubic m³ + x R m = (b R)²/8 it is y = (√(2m) + √(√2 b R/√m − 2m))/2.

    Parameters
    ----------
    x : indentation, at least that of the pull-off, −(3/4) b (b R/4)^(1/3); any shape
    R : effective radius
    b : √(2π Γ/E*); zero where there is no adhesion

    >>> jkr_root(np.array([0.0, -0.75 * 0.25 ** (1 / 3), 14.0]), 1.0, 1.0).round(6)
    array([1.      , 0.629961, 2.      ])
    """
    q = b * R
    adhesive = q > 0.0
    third = np.where(adhesive, q * q / 8.0, 1.0)
    linear = np.where(adhesive, x * R, 0.0)
    m = 1.6 * np.cbrt(third) * np.ones_like(linear)
    for _ in range(CUBIC_ITERATIONS):
        m = (2.0 * integer_power(m, 3) + third) / (3.0 * m * m + linear)
    inner = np.sqrt(2.0) * q / np.sqrt(m) - 2.0 * m
    y = 0.5 * (np.sqrt(2.0 * m) + np.sqrt(np.maximum(inner, 0.0)))
    return np.where(adhesive, y, np.sqrt(np.sqrt(np.maximum(x * R, 0.0))))


def jkr_restitution(energy: Array, E: Array, R: Array, b: Array) -> Array:
    """The restitution of elastic balls with adhesion: √(1 − (V_s/V)²), 0 up to the sticking speed V_s.

    The contact begins at δ = 0 and ends at the pull-off; the work between the two is lost. By Thornton and Ning
    (1998), equations (54) and (57), V_s = √(14.18/m) (Γ⁵ R⁴/E*²)^(1/6).

    Parameters
    ----------
    energy : m v₀², any shape
    E, R, b : effective modulus, effective radius and √(2π Γ/E*)

    >>> vs = 14.18439 * np.cbrt(0.3**5 * 2.0**4 / 5.0**2)
    >>> jkr_restitution(np.array([0.9 * vs, 2 * vs]), 5.0, 2.0, np.sqrt(2 * np.pi * 0.3 / 5.0)).round(5)
    array([0.     , 0.70711])
    """
    lost = -2.0 * E * b * b * R * b * np.cbrt(b * R) * NECK_WORK / energy
    return np.asarray(np.sqrt(np.maximum(1.0 - lost, 0.0)))


def edinburgh_adhesion(
    peak: Array, K: Array, n: float, k2: Array, gamma: Array, exponent: Array, R1: Array, R2: Array
) -> Array:
    """The stiffness k_a of the adhesive branch −k_a δ^χ of the Edinburgh law of LIGGGHTS.

    Parameters
    ----------
    peak : peak indentation, any shape
    K, n, k2, gamma, exponent : stiffness, its exponent, k₂/K, surface energy and χ
    R1, R2 : radii; infinity is a plane

    >>> edinburgh_adhesion(np.array([0.1]), 1.0, 1.0, 2.0, 1e9, 1.0, 1.0, np.inf).round(12)
    array([2.])
    """
    plastic = np.maximum((1 - 1 / k2) * power(peak, n), 0.0)
    depth = np.power(plastic, 1 / n)
    u, w = 1 / R1, 1 / R2
    both = u + w - depth * u * w
    square = depth * (2 - depth * u) * (2 - depth * w) * (u + w + both) / (4 * both * both)
    pull = 1.5 * np.pi * gamma * np.sqrt(np.maximum(square, 0.0))
    max_pull = 0.5 * K * k2 * plastic
    limited = pull > max_pull
    meeting = np.where(
        limited, 0.5 * depth, np.power(np.maximum(plastic - np.minimum(pull, max_pull) / (K * k2), 0.0), 1 / n)
    )
    yields = (depth > 0) & (gamma > 0)
    return np.where(yields, np.minimum(pull, max_pull) / np.power(np.where(yields, meeting, 1.0), exponent), 0.0)


def edinburgh_restitution(
    energy: Array, K: Array, n: float, k2: Array, gamma: Array, exponent: Array, R1: Array, R2: Array
) -> Array:
    """The restitution of the Edinburgh law of LIGGGHTS without a dashpot; 0 where the adhesion holds the balls.

    The unloading returns the work of k₂(δⁿ − δₚⁿ) from δₘ to its intersection with −k_a δ^χ, and of that to zero.

    Parameters
    ----------
    energy : m v₀², any shape
    K, n, k2, gamma, exponent, R1, R2 : see `edinburgh_adhesion`

    >>> edinburgh_restitution(np.array([1.0]), 1.0, 1.0, 4.0, 0.0, 1.0, 1.0, 1.0)
    array([0.5])
    """
    peak = np.power(0.5 * (n + 1) * energy / K, 1 / (n + 1))
    stiff, plastic = K * k2, (1 - 1 / k2) * power(peak, n)
    adhesion = edinburgh_adhesion(peak, K, n, k2, gamma, exponent, R1, R2)
    low, high = np.zeros_like(plastic), np.power(plastic, 1 / n)
    for _ in range(BRANCH_HALVINGS):
        middle = 0.5 * (low + high)
        below = stiff * (power(middle, n) - plastic) + adhesion * np.power(middle, exponent) < 0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    meeting = 0.5 * (low + high)
    returned = stiff * ((power(peak, n + 1) - power(meeting, n + 1)) / (n + 1) - plastic * (peak - meeting))
    returned = returned - adhesion * np.power(meeting, exponent + 1) / (exponent + 1)
    return np.asarray(np.sqrt(np.maximum(2 * returned / energy, 0.0)))
