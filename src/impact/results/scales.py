"""What a difference of a variable is judged by: its scale at each point, in the variable's own unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contact.material import effective_mass
from .schema import Variable


def scale_of(variable: Variable, columns: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
    """The scale of a variable, of a shape that broadcasts to that of the points.

    Parameters
    ----------
    variable : which
    columns : by name, v1, v2 [m/s], m1, m2 [kg], the variable itself, and `peak_indentation` if the result has it;
        arrays that broadcast against each other
    """
    v0 = np.asarray(columns["v1"], float) - np.asarray(columns["v2"], float)
    match variable.judged:
        case "scaled by v0":
            return np.asarray(np.abs(v0))
        case "scaled by m v0^2/2":
            mass = effective_mass(np.asarray(columns["m1"], float), np.asarray(columns["m2"], float))
            return np.asarray(0.5 * mass * v0 * v0)
        case "scaled by the peak" if "peak_indentation" in columns:
            return np.asarray(np.abs(columns["peak_indentation"]), float)
        case "scaled by itself" | "scaled by the peak":
            return np.asarray(np.abs(columns[variable.name]), float)
    return np.ones(())
