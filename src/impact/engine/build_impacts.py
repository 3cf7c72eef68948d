"""The impacts of a plan: what stands at a place of the grid as what goes into a law, and what that comes from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..contact.formula import ask, wishes
from ..contact.lanes import Lanes, stiffness
from ..contact.material import effective_mass, hertz_stiffness, sphere_radius
from ..contact.model import QUANTITIES, ForceModel
from ..contact.power import Array
from .plan import Index, Plan, dimensions


def lanes_of(plan: Plan, model: ForceModel, index: Index) -> Lanes:
    """The impacts of a model at some cells of the grid; what does not vary along an axis has length one there."""
    given = set(plan.names())
    missing = np.full((1,) * dimensions(index), np.nan)

    def value(name: str) -> Array:
        return np.asarray(plan.column(name, index), float) if name in given else missing

    def of_material(ball: str, field: str) -> Array:
        name = "material" if "material" in given else f"material{ball}"
        if name not in given:
            return missing
        table = {key: getattr(material, field) for key, material in plan.config.materials.items()}
        chosen, where = np.unique(plan.column(name, index), return_inverse=True)
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
        else:
            K = stiffness(n, hertz_stiffness(E1, nu1, E2, nu2, R1, R2), effective_mass(m1, m2), v1 - v2)
        e = value("e") if "e" in given else 1.0 - value("alpha") * (v1 - v2)
    own = {parameter.name: value(f"{model.key}.{parameter.name}") for parameter in model.parameters}
    lanes = Lanes(
        e=e, v1=v1, v2=v2, m1=m1, m2=m2, K=K, n=n, R1=R1, R2=R2, E1=E1, nu1=nu1, E2=E2, nu2=nu2,
        yield_strength1=of_material("1", "yield_strength"), yield_strength2=of_material("2", "yield_strength"),
        parameters=own,
    )  # fmt: skip
    if model.stiffness is None or own_K in given or "K" in given:
        return lanes
    with np.errstate(all="ignore"):
        known = {name: lanes.quantity(name) for name in wishes(model.stiffness)}
        return replace(lanes, K=ask(model.stiffness, known))


def origins(plan: Plan, model: ForceModel, quantity: str) -> set[str]:
    """The names of the config that a quantity or parameter of an impact comes from."""
    given = set(plan.names())
    own_K = f"{model.key}.K"

    def material(ball: str) -> set[str]:
        return {"material", f"material{ball}"} & given

    match quantity:
        case "e":
            return {"e"} if "e" in given else {"alpha", "v1", "v2"}
        case "v0":
            return {"v1", "v2"}
        case "m":
            return {"m1", "m2"}
        case "n":
            return {"n"} if model.exponent is None else set()
        case "R1" | "R2":
            ball = quantity[1]
            return {quantity} if quantity in given else {f"m{ball}", *material(ball)}
        case "K" if own_K in given or "K" in given:
            return {own_K if own_K in given else "K"}
        case "K" if model.stiffness is not None:
            return {name for part in wishes(model.stiffness) for name in origins(plan, model, part)}
        case "K":
            secant = ("n", "m", "v0") if exponents(plan, model) != (1.5,) else ()
            parts = ("R1", "R2", *secant)
            return material("1") | material("2") | {n for part in parts for n in origins(plan, model, part)}
        case "length":
            return {name for part in ("m", "v0", "K", "n") for name in origins(plan, model, part)}
    if quantity in QUANTITIES:
        return material(quantity[-1])
    return {f"{model.key}.{quantity}"}


def exponents(plan: Plan, model: ForceModel) -> tuple[float, ...]:
    """The compliance exponents that a model is asked at."""
    if model.exponent is not None:
        return (model.exponent,)
    return tuple(np.unique(np.asarray(plan.values("n"), float)).tolist())
