"""Tolerances of a comparison: those passed by the caller, else the baseline's, else a multiple of its rtol."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np

from ..config.files import read_number
from ..config.quantities import Quantity
from ..contact.variables import OUTPUTS
from ..errors import ResultError, UsageError, did_you_mean
from ..formatting import argument
from ..results.attributes import read_attribute
from ..results.schema import DEFAULT_RTOL_FACTOR

Tolerances = Mapping[str, float | str]

# name of the tolerance for variables that have none of their own
ALL_VARIABLES = "all"
# ten times the relative accuracy of the ends of profile intervals
CALIBRATION_TOLERANCE = 1e-5
TOLERANCE_VARIABLES = [name for name, variable in OUTPUTS.items() if variable.has_tolerance]


def effective_tolerances(tol: float | str | Tolerances | None, attributes: Mapping[str, Any]) -> dict[str, float]:
    """Find the tolerances by variable, "all" for the others: the caller's, else the baseline's, else its solver's.

    >>> effective_tolerances({"e_out": 1e-6}, {"rtol": 1e-10, "tolerances": '{"all": 1e-8}'})
    {'all': 1e-08, 'e_out': 1e-06}
    >>> effective_tolerances("1%", {"rtol": 1e-10})
    {'all': 0.01}
    >>> effective_tolerances(1e-7, {"rtol": 1e-10, "tolerances": '{"v1_post": 1e-8}'})
    {'all': 1e-07}
    >>> effective_tolerances(None, {"rtol": 1e-10})
    {'all': 1e-09}
    """
    requested = _by_variable(tol)
    _check_tolerances(requested)
    if ALL_VARIABLES in requested:
        return requested
    rtol = attributes["rtol"]
    if not _is_number(rtol) or not 0.0 < rtol <= 1.0:
        raise ResultError("the attribute rtol of the baseline is invalid")
    try:
        stored = read_attribute(attributes, "tolerances")
        _check_tolerances(stored)
    except (ResultError, UsageError):
        raise ResultError("the attribute tolerances of the baseline is invalid") from None
    return {ALL_VARIABLES: DEFAULT_RTOL_FACTOR * float(rtol), **stored, **requested}


def calibration_tolerances(tol: float | str | Tolerances | None) -> dict[str, float]:
    """Choose the tolerance of all variables of a calibration or a board, relative to their scales."""
    requested = _by_variable(tol)
    for name, value in requested.items():
        if name != ALL_VARIABLES:
            expected = "expected one for all, such as 1e-5"
            raise UsageError(f"{argument('tol', key=name)}: got a tolerance for one variable, {expected}")
        if not _is_number(value) or not 0.0 <= value < math.inf:
            raise UsageError(f"{argument('tol', value)}: expected a number >= 0, such as 1e-5")
    return {ALL_VARIABLES: CALIBRATION_TOLERANCE} | requested


def _by_variable(tol: float | str | Tolerances | None) -> dict[str, float]:
    """Convert what a caller passed to tolerances by name."""
    by_name = dict(tol or {}) if isinstance(tol, Mapping) or tol is None else {ALL_VARIABLES: tol}
    return {name: _as_number(value) for name, value in by_name.items()}


def _as_number(value: Any) -> Any:
    """Convert a text, which may be in percent, or a value of another library; what is no number is unchanged."""
    try:
        return read_number(value, Quantity("1", ""), "tol")
    except UsageError:
        return value


def _check_tolerances(tolerances: Mapping[str, Any]) -> None:
    """Refuse names without a tolerance, and values that are not a number >= 0."""
    for name, value in tolerances.items():
        if name != ALL_VARIABLES and name not in TOLERANCE_VARIABLES:
            has_none = {
                "exact": "has no tolerance, it is judged exactly;",
                "reported": "has no tolerance, it is not judged;",
            }
            how = has_none[OUTPUTS[name].scale] if name in OUTPUTS else "not a variable of a result;"
            raise UsageError(
                f"{argument('tol', key=str(name))}: {how} {did_you_mean(str(name), TOLERANCE_VARIABLES)}"
            )
        if not _is_number(value) or not 0.0 <= value <= sys.float_info.max:
            shown = value if name == ALL_VARIABLES else {name: value}
            raise UsageError(f"{argument('tol', shown)}: expected a number >= 0, such as 1e-8")


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)
