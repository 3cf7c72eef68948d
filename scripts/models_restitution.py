"""The restitution that each model delivers, over e or over the closing speed, for docs/models.md."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

import impact
from impact.array_types import Array
from impact.contact.dimensionless import delivered
from impact.contact.impacts import own_unit_exponents, stiffness
from impact.contact.materials import effective_mass, hertz_stiffness, sphere_radius
from impact.contact.model import ForceModel
from impact.contact.models import catalogue

GRID = np.arange(1, 201) / 200
SPEEDS = np.logspace(-2, 1, 25)
# the balls of Table 1 of Gharib and Hurmuzlu (2012)
BALLS = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "aluminium"}
MATERIAL = {"E": 56e9, "nu": 0.3, "rho": 2712.0, "yield_strength": 1e8}
# the dimensionless value of parameters without a default, at 1 m/s
DAMPING = 0.3
# with that value the balls would stick at every speed
ADHESIVE_PARAMETERS = {"jkr-1971": {"gamma": 1200.0}, "liggghts-edinburgh": {"gamma": 3e4, "k2": 2.0}}
# smaller differences are rounding or solver errors, and must not change a printed digit
ROUNDING = 1e-9
BOUNDS = (0.01, 0.05)


@dataclass(frozen=True)
class RestitutionCurve:
    """The restitution that a model delivers.

    Parameters
    ----------
    over : the abscissa, requested restitution GRID or closing speed SPEEDS
    e_out : delivered restitution at each abscissa
    params : parameters of the model with which it was integrated, in SI; empty for a closed form
    """

    over: Literal["e", "v0"]
    e_out: Array
    params: dict[str, float]


def distinct_models() -> list[ForceModel]:
    """The catalogue without models that were published again under another name."""
    return [model for model in catalogue().values() if not model.same_as]


def depends_on_e(model: ForceModel) -> bool:
    """Whether e is an input of a model, or no other quantity changes its restitution."""
    others = {"yield_strength1", "yield_strength2", "Y_min", *(parameter.name for parameter in model.parameters)}
    return "e" in model.quantities or model.quantities.isdisjoint(others)


@cache
def restitution_curves() -> dict[str, RestitutionCurve]:
    """The curve of every distinct model by key: its closed form if there is one, otherwise integrated."""
    models = distinct_models()
    exact = {model.key: closed_form_restitution(model, GRID) for model in models if depends_on_e(model)}
    curves = {key: RestitutionCurve("e", e_out, {}) for key, e_out in exact.items() if e_out is not None}
    others = [model for model in models if model.key not in curves]
    params = {model.key: curve_params(model) for model in others}
    over_e = integrated_restitution([model for model in others if depends_on_e(model)], params, e=GRID)
    over_v0 = integrated_restitution([model for model in others if not depends_on_e(model)], params, v1=SPEEDS)
    curves |= {key: RestitutionCurve("e", e_out, params[key]) for key, e_out in over_e.items()}
    return curves | {key: RestitutionCurve("v0", e_out, params[key]) for key, e_out in over_v0.items()}


def closed_form_restitution(model: ForceModel, e: Array | Sequence[float]) -> Array | None:
    """The delivered restitution, None without a closed form; some formulas divide by zero at e = 0."""
    with np.errstate(all="ignore"):
        return delivered(model, np.asarray(e, dtype=float))


def integrated_restitution(
    models: Iterable[ForceModel], params: dict[str, dict[str, float]], **axes: Array
) -> dict[str, Array]:
    """The restitution of models by key, integrated for the balls of Table 1 over axes of a sweep."""
    keys = [model.key for model in models]
    if not keys:
        return {}
    config = {
        "models": keys,
        "sweep": {**BALLS, **{name: values.tolist() for name, values in axes.items()}},
        "materials": {"aluminium": MATERIAL},
        "model": {key: params[key] for key in keys},
    }
    with warnings.catch_warnings():
        # at 10 m/s some balls are flattened
        warnings.simplefilter("ignore", impact.ImpactWarning)
        result = impact.sweep(config)
    return {key: result["e_out"].sel(model=key).values.ravel() for key in keys}


def curve_params(model: ForceModel) -> dict[str, float]:
    """Parameters of a model for its curve, in SI, and K if the model sets its exponent."""
    n = model.exponent or 1.5
    mass, speed = np.array([BALLS["m1"]], dtype=float), np.array([BALLS["v1"]], dtype=float)
    E, nu, rho, _ = (np.array([value]) for value in MATERIAL.values())
    radius = sphere_radius(mass, rho)
    m = effective_mass(mass, mass)
    K = stiffness(np.array([n]), hertz_stiffness(E, nu, E, nu, radius, radius), m, speed)
    units = {"m": m, "length": (m * speed * speed / K) ** (1 / (n + 1)), "v0": speed}
    params = {} if model.exponent is None else {"K": float(K[0])}
    defaults = {parameter.name: parameter.default for parameter in model.parameters}
    known = {"n": n, **{name: default for name, default in defaults.items() if default is not None}}
    for parameter in model.parameters:
        exponents = own_unit_exponents(parameter.unit, known)
        unit = np.prod([units[name] ** exponent for name, exponent in exponents.items()])
        # depths are the peak indentation of the elastic impact
        value = (0.5 * (n + 1)) ** (1 / (n + 1)) if parameter.unit == "m" else DAMPING
        clipped = float(np.clip(max(parameter.least, 0.0) + value * unit, parameter.least, parameter.most))
        params[parameter.name] = clipped if parameter.default is None else parameter.default
    return params | ADHESIVE_PARAMETERS.get(model.key, {})


def error(model: ForceModel) -> Array:
    """|e_out − e| over the grid."""
    return np.asarray(np.abs(restitution_curves()[model.key].e_out - GRID))
