"""Dimensions of the units that laws declare, by which parameters are converted to the contact's own units."""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from ..array_types import Array
from ..errors import ModelError

# exponents of mass, length and time; arrays where the values in the exponents of the unit are arrays
Dimension = tuple[Array | float, Array | float, Array | float]

UNIT_DIMENSIONS: dict[str, Dimension] = {
    "1": (0, 0, 0),
    "rad": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "N": (1, 1, -2),
    "Pa": (1, -1, -2),
    "J": (1, 2, -2),
    "Hz": (0, 0, -1),
}

OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Array | float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
EXPONENT_PATTERN = r"\^(-?[\d.]+|[A-Za-z]\w*|\([^()]*(?:\([^()]*\)[^()]*)*\))"
FACTOR_PATTERN = re.compile(rf"\s*([*/]?)\s*(1|[A-Za-z]+)(?:{EXPONENT_PATTERN})?")


def dimension(unit: str, values: Mapping[str, Array | float]) -> Dimension:
    """Compute the dimension of an SI unit such as "N/m^n", with the values of the names in its exponents.

    >>> dimension("N/m^n", {"n": 1.5})
    (1.0, -0.5, -2.0)
    >>> dimension("N s^p/m^(n+p)", {"n": 1.5, "p": 2.0})
    (1.0, -2.5, 0.0)
    """
    total: list[Array | float] = [0.0, 0.0, 0.0]
    position = 0
    while position < len(unit):
        factor = FACTOR_PATTERN.match(unit, position)
        if factor is None or factor[2] not in UNIT_DIMENSIONS:
            raise ModelError(f'unit "{unit}": expected powers of {", ".join(UNIT_DIMENSIONS)}, such as "N/m^n"')
        exponent = _exponent_value(factor[3] or "1", values, unit) * (-1 if factor[1] == "/" else 1)
        for axis, base_exponent in enumerate(UNIT_DIMENSIONS[factor[2]]):
            # an exponent that is not finite must not change the dimensions that the factor does not have
            total[axis] += base_exponent * exponent if base_exponent else 0.0
        position = factor.end()
    mass, length, time = total
    return mass, length, time


def with_numbers(unit: str, values: Mapping[str, float]) -> str:
    """Put numbers for the names in the exponents of a unit.

    >>> with_numbers("N s^p/m^(n+p)", {"n": 1.5, "p": 2.0})
    'N s^2/m^3.5'
    """

    def power(exponent_match: re.Match[str]) -> str:
        exponent = _exponent_value(exponent_match[1], values, unit)
        return "" if exponent == 1.0 else f"^{exponent:g}"

    return re.sub(EXPONENT_PATTERN, power, unit)


@cache
def names_in(unit: str) -> frozenset[str]:
    """Find the names in the exponents of a unit: n and p in "N s^p/m^(n+p)"."""
    exponents = (factor[3] for factor in FACTOR_PATTERN.finditer(unit))
    return frozenset(name for exponent in exponents for name in re.findall(r"[A-Za-z]\w*", exponent or ""))


def _exponent_value(text: str, values: Mapping[str, Array | float], unit: str) -> Array | float:
    """Evaluate an exponent such as `2`, `n` or `(n+1)/2`."""

    def evaluate(node: ast.expr) -> Array | float:
        match node:
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id=name):
                return values[name]
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -evaluate(inner)
            case ast.BinOp(left=left, op=op, right=right):
                return OPERATORS[type(op)](evaluate(left), evaluate(right))
        raise KeyError(ast.unparse(node))

    try:
        return evaluate(ast.parse(text, mode="eval").body)
    except SyntaxError:
        raise ModelError(f'unit "{unit}": the exponent "{text}" cannot be parsed') from None
    except KeyError:
        names = ", ".join(values)
        raise ModelError(f'unit "{unit}": the exponent "{text}" expected numbers, {names} and + - * /') from None
