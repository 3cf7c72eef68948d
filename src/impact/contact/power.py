"""Powers whose bits do not depend on the processor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def power(base: Array, exponent: float) -> Array:
    """`base` to a scalar power, for a base that is not negative.

    A multiple of a quarter is built from products and square roots, which IEEE arithmetic rounds the same
    everywhere; NumPy's own power changes its last bits with the processor's vector unit. Any other exponent
    goes to NumPy.

    Parameters
    ----------
    base : array of any shape, >= 0
    exponent : float

    >>> power(np.array([4.0, 16.0]), 1.5)
    array([ 8., 64.])
    >>> power(np.array([16.0]), 0.25)
    array([2.])
    """
    quarters = 4.0 * exponent
    if exponent < 0 or exponent > 16 or not quarters.is_integer():
        return np.power(base, exponent)
    whole, rest = divmod(int(quarters), 4)
    result = integer_power(base, whole)
    if rest:
        root = np.sqrt(base)
        if rest >= 2:
            result = result * root
        if rest % 2:
            result = result * np.sqrt(root)
    return result


def integer_power(base: Array, exponent: int) -> Array:
    """`base` (of either sign) to a whole power >= 0, by repeated squaring.

    >>> integer_power(np.array([-2.0, 3.0]), 5)
    array([-32., 243.])
    """
    if exponent == 0:
        return np.ones_like(base)
    square = base
    result: Array | None = None
    for bit in range(math.frexp(exponent)[1]):
        if bit:
            square = square * square
        if exponent >> bit & 1:
            result = square if result is None else result * square
    assert result is not None
    return result
