"""What the formulas of a law ask for once per impact, in the contact's own units, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import ModelError
from . import motion
from .lanes import Lanes
from .model import ForceModel, ask, wishes
from .power import Array

# numbers that are the same for all impacts, and arrays of shape (n,)
Values = dict[str, Array | float]


def own_values(model: ForceModel, lanes: Lanes, n: float) -> Values:
    """The quantities, parameters and coefficients of a law; K, m, v0 and n are numbers.

    Parameters
    ----------
    model : the law
    lanes : the impacts
    n : their compliance exponent
    """
    names = sorted({*model.quantities, "K", "m", "v0", "n"})
    return with_coefficients(model, {name: lanes.own_units(model, name, n) for name in names}, len(lanes))


def with_coefficients(model: ForceModel, given: Mapping[str, Array | float], count: int) -> Values:
    """The values given and the coefficients that follow from them, each of shape (count,)."""
    values = dict(given)
    for name, formula in model.coefficients.items():
        # adding zero turns -0.0 into 0.0, which is the same physics
        values[name] = np.broadcast_to(_of_each(ask(formula, values), count), count) + 0.0
    return values


def exact_restitution(model: ForceModel, values: Values, count: int) -> Array:
    """The delivered restitution by the law's closed form, NaN where it has none; shape (count,)."""
    exact = np.full(count, np.nan)
    if model.oracle is not None:
        exact[:] = _of_each(ask(model.oracle, values), count)
    return exact


def _of_each(value: Array, count: int) -> Array:
    """The value, if it is one for all impacts or one for each."""
    if value.shape not in ((), (count,)):
        raise ModelError(f"a formula returned the shape {value.shape}, wants ({count},)")
    return value


def chi_of(values: Values, count: int) -> Array:
    """The damping ratio of a law that has one, else NaN; shape (count,)."""
    return np.array(np.broadcast_to(values.get("chi", np.nan), count))


def takes_log(model: ForceModel, chi: Array) -> NDArray[np.bool_]:
    """Which impacts are integrated in the log coordinate: by their own damping ratio, never by their company."""
    return np.full(chi.shape, model.momentum == "log") & (chi > motion.LOG_ABOVE)


def delivered(model: ForceModel, e: Array) -> Array | None:
    """The exact delivered restitution for e, shape (n,); None where it is not known, or depends on more."""
    formulas = (model.oracle, *model.coefficients.values())
    known = {"e", "K", "m", "v0", "n", *model.coefficients}
    if model.oracle is None or any(wish not in known for formula in formulas for wish in wishes(formula)):
        return None
    given: dict[str, Array | float] = {"e": e, "K": 1.0, "m": 1.0, "v0": 1.0, "n": model.exponent or 1.5}
    return exact_restitution(model, with_coefficients(model, given, len(e)), len(e))
