"""Closed forms of F = K δⁿ (1 + χ δ̇/v₀): equation (18), damping by the elastic force, and none, (10) and (31)."""

from __future__ import annotations

import numpy as np

from ...array_types import Array
from ..powers import integer_power

# e = Σ aₖ χᵏ, from χ (1 + e) = ln[(1 + χ)/(1 − χ e)] order by order in exact fractions.
# Below this χ Newton's iteration has lost more digits than the truncated series.
SERIES_BELOW_CHI = 0.06
# likewise of χ − ln(1 + χ)
WORK_SERIES_BELOW_CHI = 0.01
# Newton's iterations for e: the start is within 2 %, the third iteration is exact to rounding
RESTITUTION_ITERATIONS = 4
RESTITUTION_SERIES = (
    1, -2 / 3, 4 / 9, -44 / 135, 104 / 405, -40 / 189, 7648 / 42525, -2848 / 18225, 31712 / 229635,
    -23429344 / 189448875, 89072576 / 795685275, -1441952704 / 14105329875, 893393408 / 9499507875,
)  # fmt: skip

# χ = Σ bₖ (1 − e)ᵏ, the reversion of the same series; from this e on Newton's iteration has lost more digits
SERIES_FROM_E = 0.92
DAMPING_SERIES = (
    0, 3 / 2, 3 / 2, 27 / 20, 6 / 5, 759 / 700, 351 / 350, 6639 / 7000, 1599 / 1750, 192537 / 215600,
    190221 / 215600, 10993971 / 12512500, 308346453 / 350350000, 6203405379 / 7007000000,
)  # fmt: skip


def peak_indentation(m: Array, v0: Array, K: Array, n: float | Array) -> Array:
    """Peak indentation δₘ [m] without damping, equation (31): ((n + 1) m v₀²/(2 K))^(1/(n + 1)).

    >>> print(peak_indentation(np.array([0.5]), np.array([1.0]), np.array([6.118486349e9]), 1.5)[0].round(13))
    0.0001008542975
    """
    return np.power((n + 1.0) * 0.5 * m * v0 / K * v0, 1.0 / (n + 1.0))


def delivered_restitution(chi: Array | float) -> Array:
    """The restitution that F = K δⁿ (1 + χ δ̇/v₀) delivers, independent of K, n, m and v₀.

    v dv/(1 + χ v/v₀) = −(K/m) δⁿ dδ integrates in closed form; the left side vanishes between v = v₀ and
    v = −e v₀, so that χ (1 + e) = ln[(1 + χ)/(1 − χ e)]. With a = 1 + χ that is e = (1 + W₀(−a exp(−a)))/χ,
    W₀ the principal Lambert function. In z = χ e and t = χ − ln(1 + χ) it is z = 1 − exp(−z − t), which
    Newton's iteration solves without a loss of digits; the right side is concave: it converges from one side.

    >>> delivered_restitution(np.array([0.0, 0.75, 1.0, 1.5])).round(9)
    array([1.        , 0.6629622 , 0.59362426, 0.48774126])
    """
    chi = np.asarray(chi, dtype=float)
    small = chi < SERIES_BELOW_CHI
    inner = np.where(small | np.isinf(chi), 1.0, chi)
    t = inner - np.log1p(inner)
    z = np.minimum(inner / (1.0 + inner * (2.0 / 3.0)), 1.0)
    for _ in range(RESTITUTION_ITERATIONS):
        slope = np.expm1(-(z + t))
        z = z + (z + slope) / slope
    e = np.where(np.isinf(chi), 0.0, z / inner)
    e[small] = np.polyval(RESTITUTION_SERIES[::-1], chi[small])
    return e


def exact_damping_ratio(e: Array | float) -> Array:
    """The damping ratio χ with which F = K δⁿ (1 + χ δ̇/v₀) delivers exactly e: equation (23), corrected.

    The inverse of `delivered_restitution`. With y = 1 − e χ the relation reads y = (1 + χ) exp(−(1 + e) χ),
    which keeps its digits where y is small; Newton's iteration starts from 3(1 − e)/(2 e^0.89), within 1 % of
    the root; the number of iterations is fixed, so that a value does not depend on the other elements.

    >>> exact_damping_ratio(np.array([0.0, 0.5, 1.0])).round(6)
    array([     inf, 1.432751, 0.      ])
    """
    e = np.asarray(e, dtype=float)
    near_one = e >= SERIES_FROM_E
    inner = np.where(near_one | ~(e > 0.0), 0.5, e)
    # below this e the root is 1/e to the last bit; the start is capped there, where the guess overshoots
    chi = np.minimum(1.5 * (1.0 - inner) / np.power(inner, 0.89), 1.0 / inner)
    for _ in range(6):
        decay = np.exp(-(1.0 + inner) * chi)
        value = inner * chi - 1.0 + (1.0 + chi) * decay
        chi = chi - value / (inner - decay * (inner + (1.0 + inner) * chi))
    chi = np.where(e == 0.0, np.inf, np.where(e > 0.0, chi, np.nan))
    chi[near_one] = np.polyval(DAMPING_SERIES[::-1], 1.0 - e[near_one])
    return chi


def approach_damped_restitution(chi: Array | float) -> Array:
    """The restitution delivered where F = K δⁿ (1 + χ δ̇/v₀) on approach only, and F = K δⁿ on restitution.

    All elastic work up to the peak is returned: e²/2 = xₘ^(n+1)/(n+1), so that e = √(2(χ − ln(1 + χ)))/χ.

    >>> approach_damped_restitution(np.array([0.0, 1.0])).round(9)
    array([1.        , 0.78339367])
    """
    chi = np.asarray(chi, dtype=float)
    small = chi < WORK_SERIES_BELOW_CHI
    safe = np.where(small | np.isinf(chi), 1.0, chi)
    series = np.polyval((-1 / 9, 1 / 8, -1 / 7, 1 / 6, -1 / 5, 1 / 4, -1 / 3, 1 / 2), np.where(small, chi, 0.0))
    work = np.where(small, series, (safe - np.log1p(safe)) / integer_power(safe, 2))
    return np.asarray(np.sqrt(2.0 * np.where(np.isinf(chi), 0.0, work)))
