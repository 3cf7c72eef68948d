"""Closed forms of elastic-plastic laws: the returned energy over that of the approach."""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Array


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
