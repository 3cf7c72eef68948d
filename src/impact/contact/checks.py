"""The contract: conditions of physics and of this package for every contact force model, also for plug-ins."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..array_types import Array
from ..display import Block, Displayed, Styled, Table
from ..errors import ModelError, warn
from ..formatting import number
from .dimensionless import LawValues, dimensionless_values, required_quantities, with_coefficients, with_units
from .formula_calls import Formula, argument_names, call_by_name
from .impacts import Impacts, stiffness
from .materials import effective_mass, hertz_stiffness, sphere_radius
from .model import ForceModel
from .output_formulas import Outputs, collide
from .status import FIRST_FAILURE, Status
from .variables import CENTRAL_OUTPUTS

CONTRACT_RTOL, CONTRACT_MAX_STEPS = 1e-10, 10_000
# largest error of an identity by rounding, relative to its largest term
ROUNDING_ERROR = 1e-12
CLOSED_FORM = "agrees with its closed form"
# names without the number of the ball
PROPERTIES_OF_A_BALL = ("m", "R", "E", "nu", "yield_strength")


@dataclass(frozen=True)
class ClauseResult:
    """One clause of the contract: its text, the largest deviation of the model, and the bound on it."""

    clause: str
    worst: float
    bound: float = 10 * CONTRACT_RTOL

    @property
    def holds(self) -> bool:
        return self.worst <= self.bound


def sample(model: ForceModel) -> Impacts:
    """Make forty dissimilar impacts: walls, heavy and light, slow and fast, soft and hard, e from 0.05 to 1."""
    count = 40
    index = np.arange(float(count))
    v1, v2 = np.power(10.0, index % 7 - 3.0), -0.3 * np.power(10.0, index % 5 - 3.0)
    m1 = np.power(10.0, index % 9 - 4.0)
    m2 = np.where(index % 6 == 5, np.inf, np.power(10.0, index % 4 - 2.0))
    rho, strength, n = (np.full(count, value) for value in (2712.0, 3e8, model.exponent or 1.5))
    elastic = {
        "E1": np.where(index % 2 == 0, 56e9, 210e9),
        "nu1": np.full(count, 0.3),
        "E2": np.where(index % 3 == 0, 2e6, 70e9),
        "nu2": np.full(count, 0.49),
        "R1": sphere_radius(m1, rho),
        "R2": sphere_radius(m2, rho),
    }
    K = stiffness(n, hertz_stiffness(**elastic), effective_mass(m1, m2), v1 - v2)
    balls = {"v1": v1, "v2": v2, "m1": m1, "m2": m2, "yield_strength1": strength, "yield_strength2": strength}
    ones = {parameter.name: np.ones(count) for parameter in model.parameters}
    impacts = Impacts(e=np.linspace(0.05, 1.0, count), n=n, K=K, parameters=ones, **balls, **elastic)
    values = {}
    for p in model.parameters:
        if p.default is not None:
            values[p.name] = np.full(count, p.default)
            continue
        # from its least value upwards, by the size that is 1 in the contact's own units
        size = 1.0 / impacts.dimensionless(model, p.name) if p.typical is None else p.typical
        least = p.least if math.isfinite(p.least) else min(0.0, p.most)
        values[p.name] = np.minimum(least + np.linspace(0.0, 4.0, count) * size, p.most)
    return replace(impacts, parameters=values)


class ContractResult(list[ClauseResult], Displayed):
    """The result of each clause of the contract for one model."""

    HEADINGS = ("model", "clause", "", "worst", "bound")

    def __init__(self, model: ForceModel, results: Iterable[ClauseResult]) -> None:
        super().__init__(results)
        self.model = model

    @property
    def holds(self) -> bool:
        return all(result.holds for result in self)

    def as_dict(self) -> dict[str, Any]:
        """Return the clauses as plain data."""
        return {"model": self.model.key, "holds": self.holds, "clauses": self.records()}

    def records(self) -> Sequence[Mapping[str, Any]]:
        names = ("clause", "holds", "worst", "bound")
        return [{name: getattr(result, name) for name in names} for result in self]

    def rows(self) -> list[tuple[str | Styled, ...]]:
        """Write a row for each clause, under HEADINGS; the model is named once."""
        return [
            (
                "" if index else self.model.key,
                result.clause,
                Styled("holds", "green") if result.holds else Styled("broken", "red"),
                number(result.worst, 2),
                number(result.bound, 2),
            )
            for index, result in enumerate(self)
        ]

    def sections(self, width: int) -> Iterator[Block]:
        """A row for each clause, and what was not checked."""
        yield Table(self.rows(), self.HEADINGS, text=(0, 1))
        yield from self.notes()

    def notes(self) -> list[str]:
        """List what was not checked, and parameters that change nothing."""
        model = self.model
        used = {*model.quantities, *argument_names(model.oracle), *argument_names(model.stiffness)}
        notes = [f"{model.key}: no formula uses {p.name}" for p in model.parameters if p.name not in used]
        if all(result.clause != CLOSED_FORM for result in self):
            notes.append(f"{model.key}: has no oracle, so that its restitution was compared with no closed form")
        return notes


def check_model(model: ForceModel) -> ContractResult:
    """Check a model, such as a plug-in, against every clause of the contract, with forty dissimilar impacts.

    Returns
    -------
    list of ClauseResult : the clause, the largest deviation, its bound, and whether the clause holds

    Warns
    -----
    UserWarning : a formula raised an error, with its file, line and text

    >>> import impact
    >>> all(result.holds for result in impact.check_model(impact.models()["bilinear"]))
    True
    """
    return ContractResult(model, _check_clauses(model))


def _check_clauses(model: ForceModel) -> Iterator[ClauseResult]:
    """Check every clause of the contract with the forty impacts of `sample`."""
    reported: set[str] = set()

    def collided(*batches: Impacts, rtol: float = CONTRACT_RTOL) -> list[Outputs]:
        """Collide batches of the same size together: a step of many takes no longer than one of few."""
        errors: dict[str, str] = {}
        joined = Impacts.joined(batches)
        values = collide(model, joined, rtol=rtol, max_steps=CONTRACT_MAX_STEPS, errors=errors)
        warn(*(errors[error] for error in errors.keys() - reported))
        reported.update(errors)
        # an output that is the same for all impacts has length one
        columns = {name: np.broadcast_to(column, joined.shape) for name, column in values.items()}
        parts = {name: np.split(column, len(batches)) for name, column in columns.items()}
        return [{name: part[number] for name, part in parts.items()} for number in range(len(batches))]

    impacts = sample(model)
    others = {name + a: getattr(impacts, name + b) for name in PROPERTIES_OF_A_BALL for a, b in ("12", "21")}
    swapped = replace(impacts, v1=-impacts.v2, v2=-impacts.v1, **others)
    base, exchanged, elastic = collided(impacts, swapped, replace(impacts, e=np.ones(len(impacts))))
    ended = base["status"] < FIRST_FAILURE
    yield ClauseResult("every impact ends", float(np.count_nonzero(~ended)), 0)

    def worst(values: Array) -> float:
        return float(np.max(np.abs(values[ended]), initial=0.0))

    # a wall takes momentum without moving, and is covered by equation (5)
    ball = np.isfinite(impacts.m2)
    m1, m2 = impacts.m1[ball], impacts.m2[ball]
    momenta_before, momenta_after = (
        (m1 * ball_1[ball], m2 * ball_2[ball])
        for ball_1, ball_2 in ((impacts.v1, impacts.v2), (base["v1_post"], base["v2_post"]))
    )
    size = np.abs(momenta_before[0]) + np.abs(momenta_before[1])
    lost = np.abs(momenta_before[0] + momenta_before[1] - momenta_after[0] - momenta_after[1]) / size
    yield ClauseResult("momentum is conserved (4)", float(np.max(lost)), ROUNDING_ERROR)
    rebound = (base["v2_post"] - base["v1_post"]) / impacts.v0 - base["e_out"]
    scale = 1.0 + (np.abs(impacts.v1) + np.abs(impacts.v2)) / impacts.v0
    yield ClauseResult("velocities part by e_out v0 (5)", worst(rebound / scale), ROUNDING_ERROR)
    yield ClauseResult("no energy is gained", float(np.max(base["e_out"][ended], initial=0.0) - 1.0))
    yield ClauseResult("work balances energy", worst(base["energy_residual"]))
    if model.oracle is not None:
        yield ClauseResult(CLOSED_FORM, worst(base["closed_form_error"]))

    yield ClauseResult("a change of units changes nothing", worst(_deviation_in_si(model, impacts)))
    swap = worst((exchanged["v1_post"] + base["v2_post"]) / impacts.v0)
    yield ClauseResult("swapped balls swap velocities", swap, ROUNDING_ERROR)
    # the parameters of a law may damp it to its limit at any e
    odd = elastic["status"] != Status.OK if "e" in model.quantities else elastic["status"] >= FIRST_FAILURE
    yield ClauseResult("at e = 1 the status is OK", float(np.count_nonzero(odd)), 0)
    (tight,) = collided(impacts, rtol=CONTRACT_RTOL / 100)
    yield ClauseResult("a tighter tolerance moves nothing", worst(tight["e_out"] - base["e_out"]))
    differ = 0
    for index in range(0, len(impacts), 7):
        (alone,) = collided(impacts[np.array([index])])
        differ += any(base[name][[index]].tobytes() != alone[name].tobytes() for name in CENTRAL_OUTPUTS)
    yield ClauseResult("an impact alone has the bits that it has in a batch", float(differ), 0)


def _deviation_in_si(model: ForceModel, impacts: Impacts) -> Array:
    """Compute by how much the forces in SI differ from those in the contact's own units, relative to K L^n.

    They agree unless a parameter has another unit than it declares, or a number in a formula has a unit.
    """
    x, v = np.linspace(0.1, 1.0, len(impacts)), np.linspace(0.9, 0.1, len(impacts))
    n, length = float(impacts.n[0]), impacts.length
    in_si = {name: impacts.quantity(name) for name in (*required_quantities(model), "K", "m", "v0")}
    in_contact_units = with_units(dimensionless_values(model, impacts), n)
    try:
        with np.errstate(all="ignore"):
            forces = _forces(model, {**in_si, "n": n}, x * length, v * impacts.v0) / (impacts.K * length**n)
            expected = _forces(model, in_contact_units, x, v)
            differences = np.abs(forces - expected) / (1.0 + np.abs(expected))
    except ModelError:
        # the collisions have reported it
        return np.full(len(impacts), np.inf)
    return np.asarray(np.where(np.isnan(forces) & np.isnan(expected), 0.0, differences).max(axis=0))


def _forces(model: ForceModel, values: LawValues, x: Array, v: Array) -> Array:
    """Compute the forces of both phases at indentations and rates of shape (n,), in any units; shape (2, n)."""
    count = x.size
    values = with_coefficients(model, values, count)

    def force(formula: Formula, x: Array, v: Array, **more: Array) -> Array:
        state = {"x": x, "v": v, "elastic": values["K"] * x ** values["n"], **more}
        return np.broadcast_to(call_by_name(formula, {**values, **state}), count)

    peak = 2.0 * x
    at_peak = {"peak": peak, "force_at_peak": force(model.force, peak, np.zeros(count))}
    residual, recovered = np.zeros(count), peak
    if model.residual is not None:
        residual = force(model.residual, x, v, **at_peak)
        recovered = peak - residual
    elif model.recovered is not None:
        recovered = force(model.recovered, x, v, **at_peak)
        residual = peak - recovered
    stretch = 0.5 * recovered
    branch = {**at_peak, "residual": residual, "recovered": recovered, "stretch": stretch}
    unloading = force(model.unloading or model.force, residual + stretch, -v, **branch)
    return np.array([force(model.force, x, v), unloading])
