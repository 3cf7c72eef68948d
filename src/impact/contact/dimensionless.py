"""Values of the quantities, parameters and coefficients of a law, in the contact's own units.

The units are the effective mass m, the closing speed v₀ and the length δ* = (m v₀²/K)^(1/(n+1)), in which
K = m = v₀ = 1; a law needs only what is left: e, n, and its parameters converted by their units.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..array_types import Array
from ..errors import ModelError
from .formula_calls import Formula, argument_names, call_by_name
from .impacts import Impacts
from .model import QUANTITIES, ForceModel
from .units import names_in

# by name: numbers that are the same for all impacts, and arrays of shape (n,)
LawValues = dict[str, Array | float]


def required_quantities(model: ForceModel) -> list[str]:
    """Find the names of the quantities and parameters that a law, its closed form or its units need, without n."""
    parameters = {parameter.name for parameter in model.parameters}
    closed_form_names = {name for name in argument_names(model.oracle) if name in QUANTITIES or name in parameters}
    names = {*model.quantities, *closed_form_names}
    exponents = (names_in(model.unit_of(name)) for name in names)
    return sorted(names.union(*exponents) - {"K", "m", "v0", "n"})


def exponent_names(model: ForceModel) -> frozenset[str]:
    """Find the names in the exponents of the units of a law's values, such as n of N/m^n.

    >>> from impact.contact.models import find
    >>> sorted(exponent_names(find("hertz")))
    []
    """
    return frozenset(name for value in required_quantities(model) for name in names_in(model.unit_of(value)))


def dimensionless_values(model: ForceModel, impacts: Impacts) -> dict[str, Array]:
    """Compute the quantities that a law needs, by name, in the contact's own units; of the impacts' shapes."""
    return {name: impacts.dimensionless(model, name) for name in required_quantities(model)}


def with_units(values: Mapping[str, Array], n: float) -> LawValues:
    """Extend the values of impacts with the same n by K, m and v0, which are 1, and by n."""
    return {**values, "K": 1.0, "m": 1.0, "v0": 1.0, "n": n}


def with_coefficients(model: ForceModel, values: Mapping[str, Array | float], count: int) -> LawValues:
    """Extend the values by the coefficients of the law, each of shape (count,)."""
    extended = dict(values)
    for name, formula in model.coefficients.items():
        # adding zero turns -0.0 into 0.0, which is the same physics
        extended[name] = _evaluated(formula, extended, count) + 0.0
    return extended


def exact_restitution(model: ForceModel, values: LawValues, count: int) -> Array:
    """Compute the delivered restitution by the law's closed form, NaN where it has none; shape (count,)."""
    return np.full(count, np.nan) if model.oracle is None else _evaluated(model.oracle, values, count).copy()


def _evaluated(formula: Formula, values: LawValues, count: int) -> Array:
    """Compute a formula, whose value is a number for all impacts or has one for each; shape (count,)."""
    value = call_by_name(formula, values)
    if value.shape not in ((), (count,)):
        raise ModelError(f"a formula returned shape {value.shape}, expected ({count},)")
    return np.broadcast_to(value, count)


def chi_of(values: LawValues, count: int) -> Array:
    """Return the damping ratio χ of a law that has one, else NaN; shape (count,)."""
    return np.array(np.broadcast_to(values.get("chi", np.nan), count))


def delivered(model: ForceModel, e: Array) -> Array | None:
    """Compute the exact delivered restitution for e, shape (n,); None without a closed form in e and n alone."""
    formulas = (model.oracle, *model.coefficients.values())
    names = {"e", "K", "m", "v0", "n", *model.coefficients}
    if model.oracle is None or any(name not in names for formula in formulas for name in argument_names(formula)):
        return None
    values: dict[str, Array | float] = {"e": e, "K": 1.0, "m": 1.0, "v0": 1.0, "n": model.exponent or 1.5}
    return exact_restitution(model, with_coefficients(model, values, len(e)), len(e))
