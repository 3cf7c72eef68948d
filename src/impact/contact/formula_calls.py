"""Formulas that are called by the names of their arguments."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

import numpy as np

from ..array_types import Array
from ..errors import NOT_OF_A_PLUGIN, ModelError
from ..formatting import safe_text

# frames of a traceback in these folders do not show where a formula is wrong
LIBRARIES = (Path(__file__).parents[1], Path(np.__file__).parent)

Formula = Callable[..., object]


@cache
def argument_names(formula: Formula | None) -> tuple[str, ...]:
    """Find the names of a formula's arguments, without those that have a default.

    >>> argument_names(lambda elastic, v, chi: elastic * (1 + chi * v))
    ('elastic', 'v', 'chi')
    """
    if formula is None:
        return ()
    arguments = inspect.signature(formula).parameters.values()
    return tuple(argument.name for argument in arguments if argument.default is inspect.Parameter.empty)


def call_by_name(formula: Formula, values: Mapping[str, Array | float]) -> Array:
    """Call a formula with values by name; arrays are passed as read-only views."""
    arguments = [_read_only(values[name]) for name in argument_names(formula)]
    try:
        return _real(formula(*arguments))
    except NOT_OF_A_PLUGIN:
        raise
    except BaseException as error:
        # also SystemExit: a formula must not end the computation of the other impacts
        raise ModelError(f"a formula raised {type(error).__name__}: {error}") from error


def describe_error(key: str, error: ModelError) -> tuple[str, str]:
    """Identify an error of a law by a key, and describe it in a line: location, type, text and a hint."""
    cause = error.__cause__
    if cause is None:
        return key, safe_text(f"model {key}: {str(error).removeprefix(f'{key}: ')}", 1000)
    locations = [
        f"{Path(frame.f_code.co_filename).name}:{line}: "
        for frame, line in traceback.walk_tb(cause.__traceback__)
        if not any(Path(frame.f_code.co_filename).is_relative_to(folder) for folder in LIBRARIES)
    ]
    location, kind = locations[-1] if locations else "", type(cause).__name__
    is_branch = isinstance(cause, ValueError) and "truth value of an array" in str(cause)
    hint = "; formulas work on arrays: use np.where instead of if" if is_branch else ""
    return f"{location}{key}: {kind}", safe_text(
        f"{location}model {key}: {kind}: {str(cause).rstrip('.')}{hint}", 1000
    )


def _read_only(value: Array | float) -> Array | float:
    if not isinstance(value, np.ndarray):
        return value
    view = value.view()
    view.setflags(write=False)
    return view


def _real(value: object) -> Array:
    """Convert the value to an array of float64; text, dates and complex numbers are refused."""
    array = np.asarray(value)
    if array.dtype == float:
        return array
    if array.dtype.kind == "O":
        # float() refuses None, which NumPy would convert to NaN
        return np.array([float(element) for element in array.flat]).reshape(array.shape)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"it returned {array.dtype}, expected real numbers")
    return array.astype(float)
