"""Arithmetic that numba makes vector instructions of, where that of its own library is one number at a time."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from .compile_cache import compiled

# products and sums may be fused, which only makes them more exact; the arithmetic is else that of IEEE
inlined = njit(fastmath={"contract"}, error_model="numpy", forceinline=True)
kept_on_disk = compiled(fastmath={"contract"}, error_model="numpy", nogil=True)


def _reinterpreted(there, here):
    """A function that takes the bits of a number for one of another type."""

    @intrinsic
    def reinterpret(typing, number):
        def generate(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], context.get_value_type(there))

        return there(here), generate

    return reinterpret


# with NUMBA_DISABLE_JIT=1 it is all plain Python
if not hasattr(inlined(lambda: None), "py_func"):

    def bits(number):
        """The bits of a number as an integer."""
        return np.float64(number).view(np.int64)

    def from_bits(whole):
        """The number of some bits."""
        return np.int64(whole).view(np.float64)
else:
    bits, from_bits = _reinterpreted(types.int64, types.float64), _reinterpreted(types.float64, types.int64)

ONE = int(np.float64(1.0).view(np.int64))
# a number so large that its last bit is worth 1, ln 2 in two parts, the series of the exponential from its end
LARGE, PER_LN2 = 6755399441055744.0, 1.4426950408889634
LN2, REST_OF_LN2 = 0.6931471803691238, 1.9082149292705877e-10
# of even powers and of odd ones, each from its end, so that a processor can go along both at once
EVEN = tuple(1.0 / math.factorial(one) for one in range(12, -1, -2))
ODD = tuple(1.0 / math.factorial(one) for one in range(13, 0, -2))
LEAST_EXPONENT = -700.0


@inlined
def exponential(x):
    """eˣ, as a vector too: that of the C library is one number at a time."""
    x = max(x, LEAST_EXPONENT)
    shifted = x * PER_LN2 + LARGE
    times = shifted - LARGE
    r = (x - times * LN2) - times * REST_OF_LN2
    square, even, odd = r * r, EVEN[0], ODD[0]
    for weight in EVEN[1:]:
        even = even * square + weight
    for weight in ODD[1:]:
        odd = odd * square + weight
    return (odd * r + even) * from_bits((bits(shifted) << 52) + ONE)


@inlined
def whole_power(s, exponent):
    """s to a whole power from 0 to 31, which is the same for all lanes."""
    square = s * s
    fourth = square * square
    eighth = fourth * fourth
    result = s if exponent & 1 else 1.0
    result = result * square if exponent & 2 else result
    result = result * fourth if exponent & 4 else result
    result = result * eighth if exponent & 8 else result
    return result * (eighth * eighth) if exponent & 16 else result
