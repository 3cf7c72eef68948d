"""Functions that numba compiles to vector instructions, which those of its own library prevent."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic, overload

from ...ode import events, rk45

# products and sums may be fused, which only makes them more exact; otherwise the arithmetic is that of IEEE 754
OPTIONS: Any = {"fastmath": {"contract"}, "error_model": "numpy"}
JIT_OPTIONS: Any = {"forceinline": True, **OPTIONS}
inlined = njit(**JIT_OPTIONS)


def share(formula, of_numbers=None):
    """Compile a formula of the NumPy back end, or another one for numbers in its place, into what calls it."""
    overload(formula, jit_options=JIT_OPTIONS, strict=False)(lambda *arguments: of_numbers or formula)


def _reinterpreted(target, source):
    """A function that reinterprets the bits of a number as one of another type."""

    @intrinsic
    def reinterpret(typing, number):
        def generate(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], context.get_value_type(target))

        return target(source), generate

    return reinterpret


_bits_of, _float_of = _reinterpreted(types.int64, types.float64), _reinterpreted(types.float64, types.int64)


def _larger_quotient(this, divisor, other, other_divisor):
    """The larger of two quotients, by one division."""
    this, other = this * other_divisor, other * divisor
    # the comparison may drop a NaN, which the sum keeps
    return ((this if this > other else other) + 0.0 * (this + other)) / (divisor * other_divisor)


# versions for numbers of the functions that the shared formulas call
share(events.choose, lambda condition, this, other: this if condition else other)
share(events.smaller, lambda this, other: this if this < other else other)
share(rk45.larger, lambda this, other: this if this > other else other)
share(rk45.larger_quotient, _larger_quotient)
share(rk45.bits, lambda number: _bits_of(number))
share(rk45.from_bits, lambda whole: _float_of(whole))

ONE_BITS = int(np.float64(1.0).view(np.int64))
# a number whose last bit has the value 1, so that adding it rounds to an integer
INTEGER_SHIFT, PER_LN2 = 6755399441055744.0, 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
# coefficients of the exponential series, even and odd powers from the highest on, as two independent sums
EVEN_SERIES = tuple(1.0 / math.factorial(power) for power in range(12, -1, -2))
ODD_SERIES = tuple(1.0 / math.factorial(power) for power in range(13, 0, -2))
LEAST_EXPONENT = -700.0


@inlined
def exponential(x):
    """eˣ, vectorised by the compiler, unlike that of the C library."""
    x = max(x, LEAST_EXPONENT)
    shifted = x * PER_LN2 + INTEGER_SHIFT
    times = shifted - INTEGER_SHIFT
    r = (x - times * LN2_HIGH) - times * LN2_LOW
    square, even, odd = r * r, EVEN_SERIES[0], ODD_SERIES[0]
    for weight in EVEN_SERIES[1:]:
        even = even * square + weight
    for weight in ODD_SERIES[1:]:
        odd = odd * square + weight
    return (odd * r + even) * rk45.from_bits((rk45.bits(shifted) << 52) + ONE_BITS)


@inlined
def whole_power(s, exponent):
    """s to a whole power from 0 to 31, a constant of the form."""
    square = s * s
    fourth = square * square
    eighth = fourth * fourth
    result = s if exponent & 1 else 1.0
    result = result * square if exponent & 2 else result
    result = result * fourth if exponent & 4 else result
    result = result * eighth if exponent & 8 else result
    return result * (eighth * eighth) if exponent & 16 else result
