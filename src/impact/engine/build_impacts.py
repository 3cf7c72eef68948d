"""The impacts of a plan: what goes into a law at some cells of the grid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..contact.formula import ask, wishes
from ..contact.lanes import Lanes
from ..contact.lanes import stiffness as hertz_or_secant
from ..contact.material import effective_mass, hertz_stiffness, sphere_radius
from ..contact.model import Law
from ..contact.power import Array
from ..errors import ModelError
from .plan import Index, Inputs, dimensions

# K of a law at some cells of the grid [N/m^n]
Stiffness = Callable[[Index], Array]


def build_impacts(inputs: Inputs, model: Law, index: Index, stiffness: Stiffness | None = None) -> Lanes:
    """The impacts of a model at some cells of the grid; what does not vary along an axis has length one there.

    Parameters
    ----------
    inputs : of the sweep
    model : the law, or what is known of it
    index : the cells
    stiffness : K at some cells [N/m^n], where the law has a rule for it; by default its formula
    """
    given = set(inputs.names())
    missing = np.full((1,) * dimensions(index), np.nan)

    def value(name: str) -> Array:
        return np.asarray(inputs.column(name, index), float) if name in given else missing

    def of_material(ball: str, field: str) -> Array:
        name = "material" if "material" in given else f"material{ball}"
        if name not in given:
            return missing
        table = {key: getattr(material, field) for key, material in inputs.materials.items()}
        chosen, where = np.unique(inputs.column(name, index), return_inverse=True)
        return np.array([table[str(key)] for key in chosen], dtype=float)[where]

    v1, v2, m1, m2 = (value(name) for name in ("v1", "v2", "m1", "m2"))
    E1, E2, nu1, nu2 = (of_material(ball, field) for field in ("E", "nu") for ball in "12")
    R1, R2 = (
        value(f"R{ball}") if f"R{ball}" in given else sphere_radius(mass, of_material(ball, "rho"))
        for ball, mass in (("1", m1), ("2", m2))
    )
    n = value("n") if model.exponent is None else np.full_like(missing, model.exponent)
    with np.errstate(all="ignore"):
        own_K = f"{model.key}.K"
        if own_K in given or "K" in given:
            K = value(own_K if own_K in given else "K")
        elif stiffness is not None:
            K = stiffness(index)
        else:
            K = hertz_or_secant(n, hertz_stiffness(E1, nu1, E2, nu2, R1, R2), effective_mass(m1, m2), v1 - v2)
        e = value("e") if "e" in given else 1.0 - value("alpha") * (v1 - v2)
    own = {parameter.name: value(f"{model.key}.{parameter.name}") for parameter in model.parameters}
    lanes = Lanes(
        e=e, v1=v1, v2=v2, m1=m1, m2=m2, K=K, n=n, R1=R1, R2=R2, E1=E1, nu1=nu1, E2=E2, nu2=nu2,
        yield_strength1=of_material("1", "yield_strength"), yield_strength2=of_material("2", "yield_strength"),
        parameters=own,
    )  # fmt: skip
    if not has_stiffness_rule(inputs, model) or stiffness is not None:
        return lanes
    assert model.stiffness is not None
    with np.errstate(all="ignore"):
        known = {name: lanes.quantity(name) for name in wishes(model.stiffness)}
        shape = np.broadcast_shapes(missing.shape, *(values.shape for values in known.values()))
        # a formula is promised arrays of one shape (n,)
        flat = {name: np.broadcast_to(values, shape).reshape(-1) for name, values in known.items()}
        K = ask(model.stiffness, flat)
    if K.shape not in ((), (math.prod(shape),)):
        raise ModelError(f"{model.key}: stiffness returned the shape {K.shape}, expected ({math.prod(shape)},)")
    return replace(lanes, K=np.broadcast_to(K, math.prod(shape)).reshape(shape))


def has_stiffness_rule(inputs: Inputs, model: Law) -> bool:
    """Whether K comes from a formula of the law's own: it has one, and no K is given."""
    return model.stiffness is not None and {"K", f"{model.key}.K"}.isdisjoint(inputs.names())


def exponents(inputs: Inputs, model: Law) -> tuple[float, ...]:
    """The compliance exponents that a model is asked at."""
    if model.exponent is not None:
        return (model.exponent,)
    return tuple(np.unique(np.asarray(inputs.values("n"), float)).tolist())
