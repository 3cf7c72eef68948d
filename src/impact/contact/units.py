"""The dimension of a unit as a law declares it, so that its parameters can enter the contact's own units."""

from __future__ import annotations

import ast
import re
from typing import NamedTuple

from ..errors import ModelError


class Dimension(NamedTuple):
    """Exponents of mass, length and time."""

    mass: float
    length: float
    time: float


SYMBOLS = {
    "1": Dimension(0, 0, 0),
    "kg": Dimension(1, 0, 0),
    "m": Dimension(0, 1, 0),
    "s": Dimension(0, 0, 1),
    "N": Dimension(1, 1, -2),
    "Pa": Dimension(1, -1, -2),
    "J": Dimension(1, 2, -2),
    "Hz": Dimension(0, 0, -1),
}

FACTOR = re.compile(r"\s*([*/]?)\s*(1|[A-Za-z]+)(?:\^(-?[\d.]+|n|\([^()]*(?:\([^()]*\)[^()]*)*\)))?")


def dimension(unit: str, n: float) -> Dimension:
    """The dimension of an SI unit whose exponents may contain the compliance exponent n.

    >>> dimension("N/m^n", 1.5)
    Dimension(mass=1.0, length=-0.5, time=-2.0)
    >>> dimension("N s/m^(n+1)", 1.5)
    Dimension(mass=1.0, length=-1.5, time=-1.0)

    Raises
    ------
    ModelError : the unit is not a product of powers of kg, m, s, N, Pa, J, Hz, 1
    """
    total = [0.0, 0.0, 0.0]
    place = 0
    while place < len(unit):
        factor = FACTOR.match(unit, place)
        if factor is None or factor[2] not in SYMBOLS:
            raise ModelError(f'unit "{unit}": wants powers of {", ".join(SYMBOLS)}, such as "N/m^n"')
        exponent = _value(factor[3] or "1", n, unit) * (-1 if factor[1] == "/" else 1)
        for axis, one in enumerate(SYMBOLS[factor[2]]):
            total[axis] += one * exponent
        place = factor.end()
    return Dimension(*total)


def _value(text: str, n: float, unit: str) -> float:
    """The value of an exponent such as `2`, `n` or `(n+1)/2`."""

    def walk(node: ast.expr) -> float:
        match node:
            case ast.Constant(value=int() | float() as number):
                return float(number)
            case ast.Name(id="n"):
                return n
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -walk(inner)
            case ast.BinOp(left=left, op=ast.Add(), right=right):
                return walk(left) + walk(right)
            case ast.BinOp(left=left, op=ast.Sub(), right=right):
                return walk(left) - walk(right)
            case ast.BinOp(left=left, op=ast.Mult(), right=right):
                return walk(left) * walk(right)
            case ast.BinOp(left=left, op=ast.Div(), right=right):
                return walk(left) / walk(right)
        raise ModelError(f'unit "{unit}": the exponent "{text}" wants numbers, n and + - * /')

    try:
        return walk(ast.parse(text, mode="eval").body)
    except SyntaxError:
        raise ModelError(f'unit "{unit}": the exponent "{text}" cannot be read') from None
