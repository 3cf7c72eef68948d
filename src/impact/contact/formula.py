"""Formulas that ask by the names of their arguments for what they need."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from ..errors import NOT_OF_A_PLUGIN, ModelError
from ..text import safe_text
from .powers import Array

# whose own lines say nothing about where a formula is wrong
LIBRARIES = (Path(__file__).parents[1], Path(np.__file__).parent)

Formula = Callable[..., object]


@cache
def argument_names(formula: Formula | None) -> tuple[str, ...]:
    """The names that a formula asks for; an argument with a default is its own.

    >>> argument_names(lambda elastic, v, chi: elastic * (1 + chi * v))
    ('elastic', 'v', 'chi')
    """
    if formula is None:
        return ()
    arguments = inspect.signature(formula).parameters.values()
    return tuple(one.name for one in arguments if one.default is inspect.Parameter.empty)


def call_by_name(formula: Formula, known: Mapping[str, Array | float]) -> Array:
    """The value of a formula, given what it asks for by name, in arrays that it cannot write to.

    Raises
    ------
    ModelError : the formula raised an error, whatever it was, or returned something other than real numbers
    """
    given = [_read_only(known[wish]) for wish in argument_names(formula)]
    try:
        return _real(formula(*given))
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        # a formula that ends the program would take the other impacts with it
        raise ModelError(f"a formula raised {type(error).__name__}: {error}") from error


def explained(key: str, error: ModelError) -> tuple[str, str]:
    """A key that identifies an error of a law, and one line about it: place, type, text, and a hint.

    Parameters
    ----------
    key : of the model
    error : that `call_by_name` raised, or whoever found its answer to be of a wrong shape
    """
    cause = error.__cause__
    if cause is None:
        return key, safe_text(f"model {key}: {str(error).removeprefix(f'{key}: ')}", 1000)
    own = [
        f"{Path(frame.f_code.co_filename).name}:{line}: "
        for frame, line in traceback.walk_tb(cause.__traceback__)
        if not any(Path(frame.f_code.co_filename).is_relative_to(folder) for folder in LIBRARIES)
    ]
    place, kind = own[-1] if own else "", type(cause).__name__
    is_branch = isinstance(cause, ValueError) and "truth value of an array" in str(cause)
    hint = "; formulas work on arrays: use np.where instead of if" if is_branch else ""
    return f"{place}{key}: {kind}", safe_text(f"{place}model {key}: {kind}: {str(cause).rstrip('.')}{hint}", 1000)


def _read_only(value: Array | float) -> Array | float:
    """The value; an array as a view that cannot be written to."""
    if not isinstance(value, np.ndarray):
        return value
    view = value.view()
    view.setflags(write=False)
    return view


def _real(value: object) -> Array:
    """The value as an array of float64; no text, date or complex number is taken for a real one."""
    array = np.asarray(value)
    if array.dtype == float:
        return array
    if array.dtype.kind == "O":
        # NumPy takes None for NaN
        return np.array([float(element) for element in array.flat]).reshape(array.shape)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"it returned {array.dtype}, expected real numbers")
    return array.astype(float)
