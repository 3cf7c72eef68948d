"""Closed forms of F = K δⁿ + α √(m K) δ^((n−1)/2) δ̇: a spring and dashpot of constant damping ratio.

In the contact's own units x'' = −xⁿ − α x^((n−1)/2) x'. With y = √(2/(n+1)) x^((n+1)/2) and the time
dτ = √((n+1)/2) x^((n−1)/2) dt the motion is linear for every n:

    dy/dτ = v,  dv/dτ = −y − 2 ζ v,  ζ = α/√(2(n+1)),

from y = 0, v = 1. With ω = √(1 − ζ²) that is y = exp(−ζτ) sin(ωτ)/ω. The indentation is largest, v = 0, at
τₘ = acos(ζ)/ω, where y = exp(−ζ τₘ); the force is zero, y + 2 ζ v = 0, at 2 τₘ, where v = −exp(−2 ζ τₘ); the gap
is zero at π/ω, where v = −exp(−π ζ/ω). The end of the contact is therefore part of the law. For ζ >= 1 replace
acos by acosh and ω by √(ζ² − 1): the force still has a zero, the gap has none, the balls never separate, e = 0.
"""

from __future__ import annotations

import numpy as np

from ...array_types import Array

# below this |t| the slope of h is taken from its series
SERIES_BELOW_T = 1e-3
# Newton's iterations for h(t) = L: the start is within a factor of 2, and the last iterations change nothing
DAMPING_ITERATIONS = 6


def _until_peak(zeta: Array) -> Array:
    """ζ τₘ = ζ acos(ζ)/√(1 − ζ²), or with acosh and √(ζ² − 1) for ζ > 1, without a loss of digits near 1."""
    half = np.sqrt(0.5 * np.abs(zeta - 1.0))
    under = np.arcsin(np.minimum(half, 1.0)) / np.where(zeta < 1.0, half * np.sqrt(np.abs(1.0 - half * half)), 1.0)
    over = np.arcsinh(half) / np.where(zeta > 1.0, half * np.sqrt(1.0 + half * half), 1.0)
    return np.asarray(zeta * np.where(zeta < 1.0, under, np.where(zeta > 1.0, over, 1.0)))


def gap_restitution(zeta: Array | float) -> Array:
    """The restitution where the contact ends at zero indentation: exp(−π ζ/√(1 − ζ²)), 0 from ζ = 1 on.

    >>> gap_restitution(np.array([0.0, 0.5, 1.0])).round(6)
    array([1.      , 0.163034, 0.      ])
    """
    zeta = np.asarray(zeta, dtype=float)
    under = np.where(zeta < 1.0, zeta, 0.0)
    return np.where(zeta < 1.0, np.exp(-np.pi * under / np.sqrt((1.0 - under) * (1.0 + under))), 0.0)


def force_restitution(zeta: Array | float) -> Array:
    """The restitution where the contact ends at zero force: exp(−2 ζ acos(ζ)/√(1 − ζ²)).

    >>> force_restitution(np.array([0.0, 0.5, 1.0, 2.0])).round(6)
    array([1.      , 0.298436, 0.135335, 0.047769])
    """
    zeta = np.asarray(zeta, dtype=float)
    finite = np.where(np.isinf(zeta), 1.0, zeta)
    return np.where(np.isinf(zeta), 0.0, np.exp(-2.0 * _until_peak(finite)))


def approach_restitution(zeta: Array | float) -> Array:
    """The restitution where the dashpot acts on approach only: exp(−ζ acos(ζ)/√(1 − ζ²)), which is yₘ.

    >>> approach_restitution(np.array([0.0, 0.5, 1.0])).round(6)
    array([1.      , 0.546293, 0.367879])
    """
    zeta = np.asarray(zeta, dtype=float)
    finite = np.where(np.isinf(zeta), 1.0, zeta)
    return np.where(np.isinf(zeta), 0.0, np.exp(-_until_peak(finite)))


def limited_restitution(zeta: Array | float) -> Array:
    """The restitution where the dashpot force is at most that of the spring, n = 1, to zero force.

    At first F = 2y: with ω = √2 that is y = sin(ωτ)/ω until y = 2ζ v, at v₁ = 1/√(1 + 8ζ²). From there the motion
    is that of the whole dashpot, which passes y = 2ζ v at τ₁ with tan(ωτ₁) = 2ζω/(1 + 2ζ²), ω = √(1 − ζ²), and
    ends at 2 τₘ: e = v₁ exp(−2ζτₘ)/v(τ₁), where v(τ₁) = exp(−ζτ₁)/√(1 + 8ζ²). So e = exp(−ζ(2τₘ − τ₁)).

    >>> limited_restitution(np.array([0.0, 0.5, 1.0])).round(6)
    array([1.      , 0.403774, 0.263597])
    """
    zeta = np.asarray(zeta, dtype=float)
    finite = np.where(np.isinf(zeta), 1.0, zeta)
    return np.where(np.isinf(zeta), 0.0, np.exp(_until_spring(finite) - 2.0 * _until_peak(finite)))


def _until_spring(zeta: Array) -> Array:
    """ζ τ₁ = ζ atan(2ζω/(1 + 2ζ²))/ω, or with artanh and √(ζ² − 1) for ζ > 1."""
    square = zeta * zeta
    root, slope = np.sqrt(np.abs(zeta - 1.0) * (zeta + 1.0)), 2.0 * zeta / (1.0 + 2.0 * square)
    angle = slope * root
    # artanh; near 1 by its logarithm without the difference 1 − angle
    far = np.log((1.0 + angle) * (1.0 + 2.0 * square) / np.sqrt(1.0 + 8.0 * square))
    over = np.where(angle < 0.5, np.arctanh(np.minimum(angle, 0.5)), far)
    time = np.where(zeta < 1.0, np.arctan(angle), over) / np.where(zeta == 1.0, 1.0, root)
    return np.asarray(zeta * np.where(zeta == 1.0, slope, time))


def gap_damping(e: Array | float) -> Array:
    """The damping ratio ζ that delivers e where the contact ends at zero indentation: −ln e/√(π² + ln² e).

    >>> gap_damping(np.array([0.0, 0.5, 1.0])).round(6)
    array([1.      , 0.215454, 0.      ])
    """
    with np.errstate(divide="ignore"):
        decay = np.abs(np.log(np.asarray(e, dtype=float)))
    finite = np.where(np.isinf(decay), 1.0, decay)
    return np.where(np.isinf(decay), 1.0, finite / np.sqrt(np.pi * np.pi + finite * finite))


def force_damping(e: Array | float) -> Array:
    """The damping ratio ζ that delivers e where the contact ends at zero force, inverse to `force_restitution`.

    With ζ = cos √t, or cosh √−t for ζ > 1, the relation is h(t) = √t cot √t = −ln(e)/2 = L. As a function of t, h
    falls and is concave through t = 0, where h = 1 − t/3 − ..., so that Newton's iteration from beyond the root
    converges from one side; 3(1 − L) is beyond it, and for L > 1 so is 1 − L². Then ζ = L sin(√t)/√t.

    >>> force_damping(np.array([0.0, 0.5, 1.0])).round(6)
    array([     inf, 0.255276, 0.      ])
    """
    with np.errstate(divide="ignore"):
        return _damping(0.5 * np.abs(np.log(np.asarray(e, dtype=float))))


def approach_damping(e: Array | float) -> Array:
    """The damping ratio ζ that delivers e where the dashpot acts on approach only: L = −ln e in `force_damping`.

    >>> approach_restitution(approach_damping(np.array([0.1, 0.7]))).round(12)
    array([0.1, 0.7])
    """
    with np.errstate(divide="ignore"):
        return _damping(np.abs(np.log(np.asarray(e, dtype=float))))


def _damping(L: Array) -> Array:
    """ζ of ζ acos(ζ)/√(1 − ζ²) = L."""
    infinite = np.isinf(L)
    L = np.where(infinite, 1.0, L)
    t = np.where(L > 1.0, np.minimum(3.0 * (1.0 - L), 1.0 - L * L), 3.0 * (1.0 - L))
    for _ in range(DAMPING_ITERATIONS):
        value, slope = _root_cotangent(t)
        t = t - (value - L) / slope
    return np.where(infinite, np.inf, L * _root_sine(t))


def _root_cotangent(t: Array) -> tuple[Array, Array]:
    """h(t) = √t cot √t, continued to negative t by √−t coth √−t, and its slope."""
    root = np.sqrt(np.where(t == 0.0, 1.0, np.abs(t)))
    positive = t > 0.0
    tangent = np.where(positive, np.tan(np.where(positive, root, 1.0)), np.tanh(root))
    # limited, since sinh would overflow where 1/sinh² is negligible
    sine = np.where(positive, np.sin(root), np.sinh(np.minimum(root, 300.0)))
    value = np.where(t == 0.0, 1.0, root / tangent)
    slope = np.where(positive, 0.5, -0.5) * (1.0 / (tangent * root) - 1.0 / (sine * sine))
    return value, np.where(np.abs(t) < SERIES_BELOW_T, -1.0 / 3.0 - t * (2.0 / 45.0), slope)


def _root_sine(t: Array) -> Array:
    """sin(√t)/√t, continued to negative t by sinh(√−t)/√−t."""
    root = np.sqrt(np.where(t == 0.0, 1.0, np.abs(t)))
    sine = np.where(t > 0.0, np.sin(root), np.sinh(np.minimum(root, 700.0)))
    return np.where(t == 0.0, 1.0, sine / root)
