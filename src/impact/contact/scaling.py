"""What the formulas of a law ask for once per impact, in the contact's own units, and what follows from it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..errors import ModelError
from .formula import argument_names, call_by_name
from .impacts import Impacts
from .model import QUANTITIES, ForceModel
from .powers import Array
from .units import names_in

# numbers that are the same for all impacts, and arrays of shape (n,)
LawValues = dict[str, Array | float]


def required_quantities(model: ForceModel) -> list[str]:
    """The quantities and parameters that a law, its closed form or a unit asks for in its own units; but n."""
    own = {parameter.name for parameter in model.parameters}
    exact = {wish for wish in argument_names(model.oracle) if wish in QUANTITIES or wish in own}
    names = {*model.quantities, *exact}
    exponents = (names_in(model.unit_of(name)) for name in names)
    return sorted(names.union(*exponents) - {"K", "m", "v0", "n"})


def exponent_names(model: ForceModel) -> frozenset[str]:
    """The names that the exponents of the units of a law's values are made of, such as n of N/m^n.

    >>> from impact.contact.models import find
    >>> sorted(exponent_names(find("hertz")))
    []
    """
    return frozenset(name for value in required_quantities(model) for name in names_in(model.unit_of(value)))


def dimensionless_values(model: ForceModel, impacts: Impacts) -> dict[str, Array]:
    """What a law asks for of impacts, in the contact's own units; of the impacts' shapes."""
    return {name: impacts.dimensionless(model, name) for name in required_quantities(model)}


def with_units(given: Mapping[str, Array], n: float) -> LawValues:
    """The values of impacts that share n, and those that are the same for all: K, m and v0 are 1."""
    return {**given, "K": 1.0, "m": 1.0, "v0": 1.0, "n": n}


def with_coefficients(model: ForceModel, given: Mapping[str, Array | float], count: int) -> LawValues:
    """The values given and the coefficients that follow from them, each of shape (count,)."""
    values = dict(given)
    for name, formula in model.coefficients.items():
        # adding zero turns -0.0 into 0.0, which is the same physics
        values[name] = np.broadcast_to(_checked_shape(call_by_name(formula, values), count), count) + 0.0
    return values


def exact_restitution(model: ForceModel, values: LawValues, count: int) -> Array:
    """The delivered restitution by the law's closed form, NaN where it has none; shape (count,)."""
    exact = np.full(count, np.nan)
    if model.oracle is not None:
        exact[:] = _checked_shape(call_by_name(model.oracle, values), count)
    return exact


def _checked_shape(value: Array, count: int) -> Array:
    """The value, if it is one for all impacts or one for each."""
    if value.shape not in ((), (count,)):
        raise ModelError(f"a formula returned the shape {value.shape}, wants ({count},)")
    return value


def chi_of(values: LawValues, count: int) -> Array:
    """The damping ratio of a law that has one, else NaN; shape (count,)."""
    return np.array(np.broadcast_to(values.get("chi", np.nan), count))


def delivered(model: ForceModel, e: Array) -> Array | None:
    """The exact delivered restitution for e, shape (n,); None where it is not known, or depends on more."""
    formulas = (model.oracle, *model.coefficients.values())
    known = {"e", "K", "m", "v0", "n", *model.coefficients}
    if model.oracle is None or any(wish not in known for formula in formulas for wish in argument_names(formula)):
        return None
    given: dict[str, Array | float] = {"e": e, "K": 1.0, "m": 1.0, "v0": 1.0, "n": model.exponent or 1.5}
    return exact_restitution(model, with_coefficients(model, given, len(e)), len(e))
