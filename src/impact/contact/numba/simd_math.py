"""Arithmetic that numba makes vector instructions of, where that of its own library is one number at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic, overload

from ...ode import events, rk45
from .compile_cache import compiled

# products and sums may be fused, which only makes them more exact; the arithmetic is else that of IEEE
OPTIONS: Any = {"fastmath": {"contract"}, "error_model": "numpy"}
JIT_OPTIONS: Any = {"forceinline": True, **OPTIONS}
inlined = njit(**JIT_OPTIONS)
kept_on_disk = compiled(nogil=True, **OPTIONS)


def shared(formula):
    """A formula of the NumPy back end, for numbers: compiled into its callers, which may be such formulas too."""
    overload(formula, jit_options=JIT_OPTIONS, strict=False)(lambda *arguments: formula)
    return inlined(formula)


def _reinterpreted(there, here):
    """A function that takes the bits of a number for one of another type."""

    @intrinsic
    def reinterpret(typing, number):
        def generate(context, builder, signature, arguments):
            return builder.bitcast(arguments[0], context.get_value_type(there))

        return there(here), generate

    return reinterpret


_integer_of, _number_of = _reinterpreted(types.int64, types.float64), _reinterpreted(types.float64, types.int64)


# what the shared formulas are written with, in its version for numbers
@overload(events.choose, jit_options={"forceinline": True})
def _compiled_choose(condition, this, other):
    return lambda condition, this, other: this if condition else other


@overload(events.smaller, jit_options={"forceinline": True})
def _compiled_smaller(one, other):
    return lambda one, other: one if one < other else other


@overload(rk45.larger, jit_options={"forceinline": True})
def _compiled_larger(one, other):
    return lambda one, other: one if one > other else other


@overload(rk45.larger_quotient, jit_options=JIT_OPTIONS)
def _compiled_larger_quotient(one, divisor, other, other_divisor):
    def by_one_division(one, divisor, other, other_divisor):
        one, other = one * other_divisor, other * divisor
        # a sum, since the larger of NaN and a number need not be NaN
        return ((one if one > other else other) + 0.0 * (one + other)) / (divisor * other_divisor)

    return by_one_division


@overload(rk45.bits, jit_options={"forceinline": True})
def _compiled_bits(number):
    return lambda number: _integer_of(number)


@overload(rk45.from_bits, jit_options={"forceinline": True})
def _compiled_from_bits(whole):
    return lambda whole: _number_of(whole)


ONE_BITS = int(np.float64(1.0).view(np.int64))
# a number so large that its last bit is worth 1, ln 2 in two parts, the series of the exponential from its end
INTEGER_SHIFT, PER_LN2 = 6755399441055744.0, 1.4426950408889634
LN2_HIGH, LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10
# of even powers and of odd ones, each from its end, so that a processor can go along both at once
EVEN_SERIES = tuple(1.0 / math.factorial(power) for power in range(12, -1, -2))
ODD_SERIES = tuple(1.0 / math.factorial(power) for power in range(13, 0, -2))
LEAST_EXPONENT = -700.0


@inlined
def exponential(x):
    """eˣ, as a vector too: that of the C library is one number at a time."""
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
    """s to a whole power from 0 to 31, which is the same for all lanes."""
    square = s * s
    fourth = square * square
    eighth = fourth * fourth
    result = s if exponent & 1 else 1.0
    result = result * square if exponent & 2 else result
    result = result * fourth if exponent & 4 else result
    result = result * eighth if exponent & 8 else result
    return result * (eighth * eighth) if exponent & 16 else result
