"""What the laws of the catalogue deliver, for docs/models.md, and how its numbers and tables are written."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

import impact
from impact.array_types import Array
from impact.contact.impacts import dimensionless_exponents, stiffness
from impact.contact.materials import effective_mass, hertz_stiffness, sphere_radius
from impact.contact.model import ForceModel
from impact.contact.models import catalogue
from impact.contact.scaling import delivered

GRID = np.arange(1, 201) / 200
SPEEDS = np.logspace(-2, 1, 25)
# the balls of Table 1 of Gharib and Hurmuzlu (2012), and what a law's own parameter is to them at 1 m/s
BALLS = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "aluminium"}
MATERIAL = {"E": 56e9, "nu": 0.3, "rho": 2712.0, "yield_strength": 1e8}
DAMPING = 0.3
# of adhesive laws such a value would hold the balls at every speed
SHOWN = {"jkr-1971": {"gamma": 1200.0}, "liggghts-edinburgh": {"gamma": 3e4, "k2": 2.0}}
# what is smaller is rounding or the solver's error, and turns no digit that is shown
ROUNDING = 1e-9
BOUNDS = (0.01, 0.05)


@dataclass(frozen=True)
class Measured:
    """What a law delivers: `e_out` over the restitution asked for, or over the closing speed at `settings`."""

    over: Literal["e", "v0"]
    e_out: Array
    settings: dict[str, float]


def laws() -> list[ForceModel]:
    """The catalogue, each law once."""
    return [model for model in catalogue().values() if not model.same_as]


def driven(model: ForceModel) -> bool:
    """Whether a law is driven by e; so is one that nothing else drives."""
    others = {"yield_strength1", "yield_strength2", "Y_min", *(one.name for one in model.parameters)}
    return "e" in model.quantities or model.quantities.isdisjoint(others)


@cache
def measured() -> dict[str, Measured]:
    """What every law delivers, by its key."""
    exact = {model.key: delivers(model, GRID) for model in laws() if driven(model)}
    found = {key: Measured("e", e_out, {}) for key, e_out in exact.items() if e_out is not None}
    rest = [model for model in laws() if model.key not in found]
    settings = {model.key: own_settings(model) for model in rest}
    over_e = swept([model for model in rest if driven(model)], settings, e=GRID)
    over_v0 = swept([model for model in rest if not driven(model)], settings, v1=SPEEDS)
    found |= {key: Measured("e", e_out, settings[key]) for key, e_out in over_e.items()}
    return found | {key: Measured("v0", e_out, settings[key]) for key, e_out in over_v0.items()}


def delivers(model: ForceModel, e: Array | Sequence[float]) -> Array | None:
    """See `delivered`; at e = 0 some formulas divide by zero, and mean it."""
    with np.errstate(all="ignore"):
        return delivered(model, np.asarray(e, dtype=float))


def swept(models: Iterable[ForceModel], own: dict[str, dict[str, float]], **axes: Array) -> dict[str, Array]:
    """The restitution of laws by key, integrated for the balls of Table 1 over axes of a sweep."""
    keys = [model.key for model in models]
    if not keys:
        return {}
    lists = {name: value.tolist() for name, value in axes.items()}
    config = {
        "models": keys, "sweep": {**BALLS, **lists}, "materials": {"aluminium": MATERIAL},
        "model": {key: own[key] for key in keys},
    }  # fmt: skip
    result = impact.sweep(config)
    return {key: result["e_out"].sel(model=key).values.ravel() for key in keys}


def own_settings(model: ForceModel) -> dict[str, float]:
    """The values of a law's own parameters for its curve, in SI, and of K where its exponent is its own."""
    n = model.exponent or 1.5
    mass, speed = np.array([BALLS["m1"]], dtype=float), np.array([BALLS["v1"]], dtype=float)
    E, nu, rho, _ = (np.array([value]) for value in MATERIAL.values())
    radius = sphere_radius(mass, rho)
    m = effective_mass(mass, mass)
    K = stiffness(np.array([n]), hertz_stiffness(E, nu, E, nu, radius, radius), m, speed)
    units = {"m": m, "length": (m * speed * speed / K) ** (1 / (n + 1)), "v0": speed}
    found = {} if model.exponent is None else {"K": float(K[0])}
    exponents = {"n": n, **{one.name: one.default for one in model.parameters if one.default is not None}}
    for one in model.parameters:
        size = np.prod(
            [units[u] ** exponent for u, exponent in dimensionless_exponents(model, one.name, exponents).items()]
        )
        # a depth is that of the elastic peak
        own = (0.5 * (n + 1)) ** (1 / (n + 1)) if one.unit == "m" else DAMPING
        free = float(np.clip(max(one.least, 0.0) + own * size, one.least, one.most))
        found[one.name] = free if one.default is None else one.default
    found |= SHOWN.get(model.key, {})
    return found


def number(value: float, digits: int = 4) -> str:
    """A number for the page; what lies between two of them goes up on every machine."""
    return f"{value + ROUNDING:.{digits}f}"


def error(model: ForceModel) -> Array:
    """|e_out − e| over the grid."""
    return np.asarray(np.abs(measured()[model.key].e_out - GRID))


def within(errors: Array, bound: float) -> str:
    """Where errors are below a bound, as intervals of the grid; those at the bound are not."""
    inside = errors < bound - ROUNDING
    edges = np.flatnonzero(np.diff(inside, prepend=False, append=False)).tolist()
    runs = zip(GRID[edges[::2]], GRID[[end - 1 for end in edges[1::2]]], strict=True)
    return ", ".join(map(interval, runs)) or "nowhere"


def interval(ends: tuple[float, float]) -> str:
    """An interval of the grid in words.

    >>> interval((0.005, 0.3)), interval((0.2, 0.3)), interval((0.9, 1.0)), interval((0.005, 1.0))
    ('≤ 0.3', '0.2 to 0.3', '≥ 0.9', 'all')
    """
    first, last = ends[0] == GRID[0], ends[1] == GRID[-1]
    if first or last:
        return "all" if first and last else f"≤ {ends[1]:g}" if first else f"≥ {ends[0]:g}"
    return f"{ends[0]:g} to {ends[1]:g}"


def largest(errors: Array, e: Array = GRID) -> str:
    """The largest of some errors, and where."""
    place = int(np.argmax(np.round(errors, 10)))
    return f"{number(errors[place])} at {e[place]:g}" if errors[place] > ROUNDING else "none"


def short(value: float) -> str:
    """A number of any size in three digits."""
    return f"{float(f'{value:.3g}'):g}".replace("e-0", "e-")


def cell(text: str) -> str:
    """Text in a cell of a Markdown table."""
    return "".join("\\" + letter if letter in "|*_<\\" else letter for letter in text)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def formula(text: str) -> str:
    """A formula in a cell: its line is broken behind a comma and where it has two spaces, nowhere else."""
    return ", ".join(
        " ".join(part.replace(" ", "\N{NO-BREAK SPACE}") for part in piece.split("  "))
        for piece in cell(text).replace(",  ", ", ").split(", ")
    )
