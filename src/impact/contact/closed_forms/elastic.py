"""Closed forms of F = K δⁿ: the undamped contact, equations (10) and (31)."""

from __future__ import annotations

import numpy as np

from ...array_types import Array


def peak_indentation(m: Array, v0: Array, K: Array, n: float | Array) -> Array:
    """Peak indentation δₘ [m] without damping, equation (31): ((n + 1) m v₀²/(2 K))^(1/(n + 1)).

    >>> print(peak_indentation(np.array([0.5]), np.array([1.0]), np.array([6.118486349e9]), 1.5)[0].round(13))
    0.0001008542975
    """
    return np.power((n + 1.0) * 0.5 * m * v0 / K * v0, 1.0 / (n + 1.0))
