"""What the catalogue is filtered by: properties that are computed from the declaration of a law."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np

from impact.array_types import Array
from impact.contact.checks import sample
from impact.contact.dimensionless import dimensionless_values, with_coefficients, with_units
from impact.contact.formula_calls import Formula, call_by_name
from impact.contact.friction import FrictionLaw
from impact.contact.model import ForceModel
from impact.contact.models import catalogue
from impact.contact.powers import power
from impact.exporters.code import Code
from impact.exporters.registry import CODES
from models_restitution import (
    SPEEDS,
    closed_form_restitution,
    curve_params,
    distinct_models,
    integrated_restitution,
    restitution_curves,
)

# differences of e_out that are errors of the solver
SOLVER_ERROR = 1e-6
# indentations over the peak at which a force is evaluated
INDENTATIONS = np.linspace(0.0, 1.0, 201)[1:]


def original(model: ForceModel) -> ForceModel:
    """The law that a model is another name for, or the model."""
    return catalogue()[model.same_as] if model.same_as else model


@cache
def speed_dependent() -> frozenset[str]:
    """Keys of the distinct laws whose e_out depends on the closing speed of the balls of Table 1."""
    curves = restitution_curves()
    over_speed = {key: curve.e_out for key, curve in curves.items() if curve.over == "v0"}
    # a closed form of e and n alone does not depend on it
    others = [
        model
        for model in distinct_models()
        if model.key not in over_speed and closed_form_restitution(model, [0.5]) is None
    ]
    params = {model.key: curve_params(model) for model in others}
    over_speed |= integrated_restitution(others, params, e=np.array([0.5]), v1=SPEEDS)
    return frozenset(key for key, e_out in over_speed.items() if np.ptp(e_out) > SOLVER_ERROR)


@np.errstate(all="ignore")
def is_adhesive(model: ForceModel) -> bool:
    """Whether the force of a law can pull at rest, so that it is not damping that pulls."""
    impacts = sample(model)
    # adhesion may be off by default
    is_off = [parameter.name for parameter in model.parameters if parameter.default == 0.0]
    impacts = replace(impacts, parameters={**impacts.parameters, **dict.fromkeys(is_off, np.ones(len(impacts)))})
    n = model.exponent or 1.5
    count = len(impacts)
    values = with_coefficients(model, with_units(dimensionless_values(model, impacts), n), count)
    peak = np.full(count, (0.5 * (n + 1)) ** (1 / (n + 1)))

    def call(formula: Formula, x: Array, **others: Array) -> Array:
        motion = {"x": x, "v": np.zeros(count), "elastic": power(np.maximum(x, 0.0), n)}
        return np.broadcast_to(call_by_name(formula, {**values, **motion, **others}), count)

    at_peak = {"peak": peak, "force_at_peak": call(model.force, peak)}
    residual = np.zeros(count)
    if model.residual is not None:
        residual = call(model.residual, peak, **at_peak)
    elif model.recovered is not None:
        residual = peak - call(model.recovered, peak, **at_peak)
    at_peak |= {"residual": residual, "recovered": peak - residual}
    for part in INDENTATIONS:
        x = residual + part * (peak - residual)
        force = call(model.unloading or model.force, x, stretch=x - residual, **at_peak)
        if (force < -SOLVER_ERROR * np.abs(at_peak["force_at_peak"])).any():
            return True
    return False


def names_in_codes(law: ForceModel | FrictionLaw) -> Iterator[tuple[Code, str, str]]:
    """What the codes that laws are exported to call a law, and the key under which each has it."""
    keys = [law.key]
    if isinstance(law, ForceModel):
        keys = [other.key for other in catalogue().values() if original(other) is original(law)]
    for code in CODES.values():
        names = code.frictions if isinstance(law, FrictionLaw) else code.laws
        yield from ((code, names[key], key) for key in keys if key in names)
