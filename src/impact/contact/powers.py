"""x**p with the same bits on every processor, where p is a multiple of a quarter: by products and square roots."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ..array_types import AnyArray, Array, Mask


def power(base: Array, exponent: float) -> Array:
    """`base` to a scalar power, for a base that is not negative.

    A multiple of a quarter is built from products, square roots and a quotient, which IEEE arithmetic rounds the
    same everywhere; NumPy's own power changes its last bits with the processor's vector unit. Any other exponent
    goes to NumPy.

    Parameters
    ----------
    base : array of any shape, >= 0
    exponent : float

    Returns
    -------
    array : of the shape of the base

    >>> power(np.array([4.0, 16.0]), 1.5)
    array([ 8., 64.])
    >>> power(np.array([16.0]), 0.25)
    array([2.])
    """
    quarters = _quarters(exponent)
    if quarters is None:
        return np.power(base, exponent)
    if exponent < 0:
        return 1.0 / power(base, -exponent)
    whole, rest = divmod(quarters, 4)
    if not rest:
        return integer_power(base, whole)
    # of the factors base^whole, base^(1/2) and base^(1/4), in this order
    root = np.sqrt(base)
    result = root if rest >= 2 else np.sqrt(root)
    if whole:
        result = integer_power(base, whole) * result
    return result * np.sqrt(root) if rest == 3 else result


@cache
def _quarters(exponent: float) -> int | None:
    """Four times an exponent where that makes it reproducible; the integrator asks at each stage."""
    return int(4.0 * exponent) if is_reproducible(exponent) else None


def is_reproducible(exponent: Array | float) -> Mask:
    """Return whether `power` computes an exponent from products and square roots; elementwise."""
    quarters = np.multiply(exponent, 4.0)
    return np.asarray((quarters == np.rint(quarters)) & (np.abs(quarters) <= 64.0))


def powers(base: Array, exponent: Array) -> Array:
    """Raise `base` to an array of exponents, which broadcast; an element has the bits of `power` at its exponent.

    >>> powers(np.array([4.0, 4.0]), np.array([0.5, 2.0]))
    array([ 2., 16.])
    """
    exponents = distinct_values(exponent)
    if exponents.size == 1:
        return power(base, float(exponents[0]))
    base, exponent = np.broadcast_arrays(base, exponent)
    result = np.power(base, exponent)
    for scalar in exponents[is_reproducible(exponents)]:
        mask = exponent == scalar
        result[mask] = power(base[mask], float(scalar))
    return result


def distinct_values(values: Array) -> Array:
    """Find the distinct values of an array, sorted.

    >>> distinct_values(np.array([1.5, 1.0, 1.5]))
    array([1. , 1.5])
    """
    values = values.reshape(-1)
    # in most cases all are equal
    return values[:1] if (values == values[:1]).all() else np.unique(values)


def replace_where(value: AnyArray, mask: Mask, otherwise: float | np.integer[Any] | AnyArray) -> AnyArray:
    """Replace the value by another one where the mask is True; the shape grows only if it is True somewhere."""
    return np.where(mask, otherwise, value) if mask.any() else value


def integer_power(base: Array, exponent: int) -> Array:
    """Raise `base` (of either sign) to a whole power >= 0, by repeated squaring.

    >>> integer_power(np.array([-2.0, 3.0]), 5)
    array([-32., 243.])
    """
    if exponent == 0:
        # faster than ones_like for the short arrays of a fit
        ones = np.empty_like(base)
        ones.fill(1.0)
        return ones
    square = base
    while exponent % 2 == 0:
        square = square * square
        exponent //= 2
    result = square
    while exponent > 1:
        square = square * square
        exponent //= 2
        if exponent % 2:
            result = result * square
    return result
