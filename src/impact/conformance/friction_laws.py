"""The tangential restitution of the friction law that an adapter names, for the check `friction`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..results.sweep import sweep
from .suite import Question


def betas_of_law(
    questions: Sequence[Question], law: str, model: str, parameters: Mapping[str, float | str]
) -> dict[str, float]:
    """Compute beta = -g1/g0 of a friction law of the catalogue with a contact force, by the id of the collision.

    Raises
    ------
    ConfigError : a parameter is none of the law, or the law is not combinable with the contact force
    """
    inputs = [_inputs(question) for question in questions]
    cases = {name: [values[name] for values in inputs] for name in inputs[0]}
    result = sweep(
        {
            "models": model,
            "frictions": law,
            "sweep": {"cases": cases, "n": 1.0},
            "friction": {law: dict(parameters)},
        }
    )
    return dict(zip((str(question["id"]) for question in questions), result["beta"].values.ravel(), strict=True))


def _inputs(question: Question) -> dict[str, float]:
    """Write a collision as the inputs of a config.

    The stiffness is that of a linear spring with the contact time of the collision, K = m (pi^2 + ln^2 e)/t^2;
    beta depends on it only if a parameter of the law has a unit.
    """
    names = ("v1", "v2", "u1", "u2", "omega1", "omega2", "e", "mu", "contact_time")
    values = {name: float(question[name] or 0.0) for name in names}
    for ball in "12":
        mass, radius = (float(question[f"{name}{ball}"] or math.inf) for name in ("m", "R"))
        inertia = question[f"inertia{ball}"]
        factor = 0.4 if inertia is None else float(inertia) / (mass * radius**2)
        values |= {f"m{ball}": mass, f"R{ball}": radius, f"inertia_factor{ball}": factor}
    frequency = math.hypot(math.pi, math.log(values["e"])) / values.pop("contact_time")
    return values | {"K": frequency**2 / (1.0 / values["m1"] + 1.0 / values["m2"])}
