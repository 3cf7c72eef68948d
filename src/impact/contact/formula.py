"""Formulas that ask by the names of their arguments for what they need."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np

from ..errors import ModelError
from .power import Array

Formula = Callable[..., object]


@cache
def wishes(formula: Formula | None) -> tuple[str, ...]:
    """The names that a formula asks for; an argument with a default is its own.

    >>> wishes(lambda elastic, v, chi: elastic * (1 + chi * v))
    ('elastic', 'v', 'chi')
    """
    if formula is None:
        return ()
    arguments = inspect.signature(formula).parameters.values()
    return tuple(one.name for one in arguments if one.default is inspect.Parameter.empty)


def ask(formula: Formula, known: Mapping[str, Array | float]) -> Array:
    """The value of a formula, given what it asks for by name.

    Raises
    ------
    ModelError : the formula raised an error, whatever it was
    """
    given = [known[wish] for wish in wishes(formula)]
    try:
        return np.asarray(formula(*given), dtype=float)
    except (Exception, SystemExit) as error:
        # a formula that ends the program would take the other impacts with it
        raise ModelError(f"a formula raised {type(error).__name__}: {error}") from error
