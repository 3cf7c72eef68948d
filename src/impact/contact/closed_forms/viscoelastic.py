"""The restitution of viscoelastic spheres that separate at zero force, by its Padé form, and the inverse."""

from __future__ import annotations

import numpy as np

from ...array_types import Array

# Müller and Pöschel (2011), the form [3/6] in w = √g, g = (3/2) A (K/m)^(2/5) v^(1/5), from the zeroth power
PADE_NUMERATOR = (1.0, 1.07232, 0.574198, 0.141552)
PADE_DENOMINATOR = (1.0, 1.07232, 1.72765, 1.37842, 1.19449, 0.467273, 0.235585)
DAMPING_HALVINGS = 70


def pade_restitution(g: Array | float) -> Array:
    """The restitution of F = K(δ^(3/2) + (3/2) A δ^(1/2) δ̇) to F = 0, within 7e-4.

    Parameters
    ----------
    g : (3/2) A (K/m)^(2/5) v^(1/5) [-], >= 0, any shape

    >>> pade_restitution(np.array([0.0, 1.0, 1e9])).round(4)
    array([1.   , 0.394, 0.   ])
    """
    w = np.sqrt(np.asarray(g, dtype=float))
    # in powers of w, or of 1/w where w is large
    large = w > 1.0
    t = np.where(large, 1.0 / np.where(large, w, 1.0), w)
    small = np.polyval(PADE_NUMERATOR[::-1], t) / np.polyval(PADE_DENOMINATOR[::-1], t)
    return np.asarray(
        np.where(large, t * t * t * np.polyval(PADE_NUMERATOR, t) / np.polyval(PADE_DENOMINATOR, t), small)
    )


def pade_damping(e: Array | float) -> Array:
    """The g for which `pade_restitution` is e, by bisection; infinite for e = 0.

    >>> pade_restitution(pade_damping(np.array([0.1, 0.5, 1.0]))).round(12)
    array([0.1, 0.5, 1. ])
    """
    e = np.asarray(e, dtype=float)
    low = np.zeros_like(e)
    with np.errstate(divide="ignore"):
        high = 1.0 + 1.0 / np.cbrt(e)
    for _ in range(DAMPING_HALVINGS):
        middle = 0.5 * (low + high)
        above = pade_restitution(middle * middle) > e
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    w = 0.5 * (low + high)
    return np.where(e == 0.0, np.inf, np.where(e >= 1.0, 0.0, w * w))
