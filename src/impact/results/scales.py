"""What a difference of a variable is judged by: its scale at each point, in the variable's own unit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.materials import effective_mass
from .schema import Variable


def scale_of(variable: Variable, read: Callable[[str], NDArray[Any]], *, has_peak: bool) -> NDArray[np.float64]:
    """The scale of a variable, of a shape that broadcasts to that of the points.

    Parameters
    ----------
    variable : which
    read : gives values by name: v1, v2 [m/s], m1, m2 [kg], the variable itself, `peak_indentation` [m]; arrays
        that broadcast against each other
    has_peak : whether the result has `peak_indentation`
    """

    def number(name: str) -> NDArray[np.float64]:
        return np.asarray(read(name), float)

    match variable.judged:
        case "scaled by v0":
            return np.asarray(np.abs(number("v1") - number("v2")))
        case "scaled by m v0^2/2":
            v0 = number("v1") - number("v2")
            return np.asarray(0.5 * effective_mass(number("m1"), number("m2")) * v0 * v0)
        case "scaled by the peak" if has_peak:
            return np.asarray(np.abs(number("peak_indentation")))
        case "scaled by itself" | "scaled by the peak":
            return np.asarray(np.abs(number(variable.name)))
    return np.ones(())
