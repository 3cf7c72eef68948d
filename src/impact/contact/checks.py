"""The contract: what physics and the house ask of every contact force model, built in or a user's own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np

from .impacts import Impacts, stiffness
from .materials import effective_mass, hertz_stiffness, sphere_radius
from .model import QUANTITIES, ForceModel, Parameter
from .outputs import OUTPUTS, Outputs, collide
from .powers import Array
from .status import FIRST_FAILURE, Status
from .units import dimension

CONTRACT_RTOL, CONTRACT_MAX_STEPS = 1e-10, 10_000
# what rounding leaves of an identity, relative to its largest term
ROUNDING_ERROR = 1e-12


@dataclass(frozen=True)
class Finding:
    """One clause: what it says, how far off the model is at its worst, and how far it may be."""

    clause: str
    worst: float
    bound: float

    @property
    def holds(self) -> bool:
        return self.worst <= self.bound


def sample(model: ForceModel) -> Impacts:
    """Forty dissimilar impacts: a wall, heavy and light balls, slow and fast, soft and hard, e from 0.05 to 1."""
    count = 40
    turn = np.arange(float(count))
    e = np.linspace(0.05, 1.0, count)
    v1, v2 = np.power(10.0, turn % 7 - 3.0), -0.3 * np.power(10.0, turn % 5 - 3.0)
    m1 = np.power(10.0, turn % 9 - 4.0)
    m2 = np.where(turn % 6 == 5, np.inf, np.power(10.0, turn % 4 - 2.0))
    E1, E2 = np.where(turn % 2 == 0, 56e9, 210e9), np.where(turn % 3 == 0, 2e6, 70e9)
    nu1, nu2, rho = np.full(count, 0.3), np.full(count, 0.49), np.full(count, 2712.0)
    R1, R2 = sphere_radius(m1, rho), sphere_radius(m2, rho)
    n = np.full(count, 1.5 if model.exponent is None else model.exponent)
    hertz = hertz_stiffness(E1, nu1, E2, nu2, R1, R2)
    strength = np.full(count, 3e8)
    impacts = Impacts(
        e=e, v1=v1, v2=v2, m1=m1, m2=m2, R1=R1, R2=R2, n=n, E1=E1, nu1=nu1, yield_strength1=strength,
        E2=E2, nu2=nu2, yield_strength2=strength, K=stiffness(n, hertz, effective_mass(m1, m2), v1 - v2),
        parameters={one.name: np.ones(count) for one in model.parameters},
    )  # fmt: skip
    return replace(
        impacts, parameters={one.name: _parameter_values(model, one, impacts) for one in model.parameters}
    )


def _parameter_values(model: ForceModel, parameter: Parameter, impacts: Impacts) -> Array:
    """Values of a parameter: its default, or from its least upwards, by a typical value or each contact's size."""
    if parameter.default is not None:
        return np.full(len(impacts), parameter.default)
    # what one of its units is in the contact's own
    size = 1.0 / impacts.dimensionless(model, parameter.name) if parameter.typical is None else parameter.typical
    least = parameter.least if math.isfinite(parameter.least) else min(0.0, parameter.most)
    return np.clip(least + np.linspace(0.0, 4.0, len(impacts)) * size, parameter.least, parameter.most)


def contract(model: ForceModel) -> Iterator[Finding]:
    """Every clause, one after the other.

    Parameters
    ----------
    model : the law; its numbers are those of forty impacts at rtol 1e-10

    >>> from impact.contact.models import find
    >>> all(finding.holds for finding in contract(find("bilinear")))
    True
    """
    impacts = sample(model)
    base = _collide(model, impacts)
    ended = base["status"] < FIRST_FAILURE
    yield Finding("every impact ends", float(np.count_nonzero(~ended)), 0)

    def worst(values: Array) -> float:
        return float(np.max(np.abs(values[ended]), initial=0.0))

    # a wall takes up momentum without moving; equation (5) covers it
    ball = np.isfinite(impacts.m2)
    m1, m2 = impacts.m1[ball], impacts.m2[ball]
    before, after = (
        (m1 * first[ball], m2 * second[ball])
        for first, second in ((impacts.v1, impacts.v2), (base["v1_post"], base["v2_post"]))
    )
    size = np.abs(before[0]) + np.abs(before[1])
    lost = np.abs(before[0] + before[1] - after[0] - after[1]) / size
    yield Finding("momentum is conserved (4)", float(np.max(lost)), ROUNDING_ERROR)
    rebound = (base["v2_post"] - base["v1_post"]) / impacts.v0 - base["e_out"]
    scale = 1.0 + (np.abs(impacts.v1) + np.abs(impacts.v2)) / impacts.v0
    yield Finding("velocities part by e_out v0 (5)", worst(rebound / scale), ROUNDING_ERROR)
    yield Finding(
        "no energy is gained", float(np.max(base["e_out"][ended], initial=0.0) - 1.0), 10 * CONTRACT_RTOL
    )
    yield Finding("work balances energy", worst(base["energy_residual"]), 10 * CONTRACT_RTOL)
    if model.oracle is not None:
        yield Finding("agrees with its closed form", worst(base["closed_form_error"]), 10 * CONTRACT_RTOL)

    other = _collide(model, in_other_units(model, impacts))
    yield Finding("a change of units changes nothing", worst(other["e_out"] - base["e_out"]), 10 * CONTRACT_RTOL)
    swapped = replace(
        impacts, v1=-impacts.v2, v2=-impacts.v1, m1=impacts.m2, m2=impacts.m1, R1=impacts.R2, R2=impacts.R1,
        E1=impacts.E2, E2=impacts.E1, nu1=impacts.nu2, nu2=impacts.nu1, yield_strength1=impacts.yield_strength2,
        yield_strength2=impacts.yield_strength1,
    )  # fmt: skip
    other = _collide(model, swapped)
    yield Finding(
        "swapped balls swap velocities", worst((other["v1_post"] + base["v2_post"]) / impacts.v0), ROUNDING_ERROR
    )
    elastic = _collide(model, replace(impacts, e=np.ones(len(impacts))))
    # parameters of its own may damp a law to its limit, whatever e is
    odd = elastic["status"] != Status.OK if "e" in model.quantities else elastic["status"] >= FIRST_FAILURE
    yield Finding("at e = 1 it is ordinary", float(np.count_nonzero(odd)), 0)
    tight = _collide(model, impacts, CONTRACT_RTOL / 100)
    yield Finding("a tighter tolerance moves nothing", worst(tight["e_out"] - base["e_out"]), 10 * CONTRACT_RTOL)
    yield Finding("a lane alone equals the lane in a crowd", float(_alone_differs(model, impacts, base)), 0)


def _collide(model: ForceModel, impacts: Impacts, rtol: float = CONTRACT_RTOL) -> Outputs:
    return collide(model, impacts, rtol=rtol, max_steps=CONTRACT_MAX_STEPS)


def in_other_units(model: ForceModel, impacts: Impacts) -> Impacts:
    """The same impacts with grams, feet and minutes as units."""
    units = {one.name: one.unit for one in model.parameters} | QUANTITIES
    units |= {"v1": "m/s", "v2": "m/s", "m1": "kg", "m2": "kg"}
    given = {"n": impacts.n, **impacts.parameters}

    def changed(name: str, value: Array) -> Array:
        mass, length, time = dimension(units[name], given)
        return np.asarray(value * 1e3**mass * (1 / 0.3048) ** length * (1 / 60.0) ** time)

    plain = {f.name: changed(f.name, getattr(impacts, f.name)) for f in fields(impacts) if f.name != "parameters"}
    return Impacts(**plain, parameters={name: changed(name, value) for name, value in impacts.parameters.items()})


def _alone_differs(model: ForceModel, impacts: Impacts, base: Outputs) -> int:
    """How many impacts have other bits when they are integrated alone."""
    differ = 0
    for place in range(0, len(impacts), 7):
        alone = _collide(model, impacts[np.array([place])])
        # an output that is the same for all impacts has length one
        differ += any(
            np.broadcast_to(base[name], impacts.shape)[[place]].tobytes() != alone[name].tobytes()
            for name in OUTPUTS
        )
    return differ
