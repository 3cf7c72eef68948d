"""What is in a result: the one SCHEMA, and the labels, units and provenance of the dataset of a plan."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from typing import Literal

import numpy as np
import xarray as xr

from .. import __version__
from ..contact.status import Status
from ..engine.plan import Plan
from ..sweeps.rules import MATERIALS, SWEEP, own_quantities

SCHEMA_VERSION = 2
# models with another exponent are named in at most so many characters
MAX_NAMED = 48
# coordinates along `model` that are texts about it
ABOUT_A_MODEL = ("title", "year", "equation", "reference", "doi")


@dataclass(frozen=True)
class Variable:
    """One variable of a result.

    `per` says whether it depends on the model or on the axes alone; `judged` how a comparison judges it: by its
    difference over a scale, by a bound on itself, exactly, or not at all. `by_default` is False for a variable
    that is stored only where `[output] variables` names it.
    """

    name: str
    unit: str
    per: Literal["model", "axes"]
    judged: Literal["scaled by v0", "scaled by 1", "scaled by the peak", "scaled by itself",
                    "scaled by m v0^2/2", "bounded by 10 rtol", "exact", "reported"]  # fmt: skip
    meaning: str
    equation: str
    dtype: str = "f8"
    by_default: bool = True


SCHEMA = (
    Variable("v1_post", "m s-1", "model", "scaled by v0", "velocity of ball 1 after the impact",
             "v1+ = v1 - (1 + e_out)(m/m1) v0"),
    Variable("v2_post", "m s-1", "model", "scaled by v0", "velocity of ball 2 after the impact",
             "v2+ = v2 + (1 + e_out)(m/m2) v0"),
    Variable("v1_reference", "m s-1", "axes", "scaled by v0", "velocity of ball 1 by impulse and momentum",
             "v1+ = v1 - (1 + e)(m/m1) v0  (6)"),
    Variable("v2_reference", "m s-1", "axes", "scaled by v0", "velocity of ball 2 by impulse and momentum",
             "v2+ = v2 + (1 + e)(m/m2) v0  (7)"),
    Variable("v1_error", "m s-1", "model", "scaled by v0", "error of the velocity of ball 1",
             "v1_post - v1_reference"),
    Variable("v2_error", "m s-1", "model", "scaled by v0", "error of the velocity of ball 2",
             "v2_post - v2_reference"),
    Variable("e_out", "1", "model", "scaled by 1", "restitution that the model delivers",
             "(v2+ - v1+)/(v1 - v2)  (5)"),
    Variable("e_error", "1", "model", "scaled by 1", "delivered minus asked restitution", "e_out - e"),
    Variable("peak_indentation", "m", "model", "scaled by the peak", "largest indentation", "δₘ at v = 0"),
    Variable("permanent_indentation", "m", "model", "scaled by the peak", "indentation at the release",
             "δₚ at the end of the contact"),
    Variable("peak_force", "N", "model", "scaled by itself", "largest contact force", "max F over the approach"),
    Variable("contact_time", "s", "model", "scaled by itself", "contact time", "from first contact to release"),
    Variable("energy_loss", "J", "model", "scaled by m v0^2/2", "kinetic energy lost",
             "m v0²(1 - e_out²)/2"),
    Variable("stiffness", "N m-n", "model", "scaled by itself",
             "contact stiffness used; n is the coordinate exponent; where n is not 1.5 and no K is given it is "
             "F_m/delta_m^n of the Hertz peak", "K  (12)"),
    Variable("damping_ratio", "1", "model", "scaled by itself", "dimensionless damping, where the law has one",
             "χ = λ v0/K"),
    Variable("energy_residual", "1", "model", "bounded by 10 rtol", "residual of the work balance",
             "[work of the force - m v0²(1 - e_out²)/2]/(m v0²/2)"),
    Variable("closed_form_error", "1", "model", "bounded by 10 rtol",
             "distance from the closed form, where one exists", "e_out - exact e_out"),
    Variable("status", "1", "model", "exact", "how the point ended", "see flag_meanings", "i1"),
    Variable("in_domain", "1", "model", "exact", "1 where the law is said to hold",
             "1 inside every stated interval", "i1"),
    Variable("steps", "1", "model", "reported", "accepted steps of the integrator",
             "approach + restitution", "i4"),
    Variable("e_kinetic", "1", "model", "scaled by 1",
             "kinetic restitution; the impulses are the changes of the momentum, so that it is e_out",
             "τ_r/τ_c  (2)", by_default=False),
    Variable("e_energetic", "1", "model", "scaled by 1",
             "energetic restitution, from the integrated works of the two phases", "√(-W_r/W_c)  (3)",
             by_default=False),
    Variable("lambda", "N s m-(n+1)", "model", "scaled by itself",
             "damping factor, where the law has one; n is the coordinate exponent", "λ = χ K/v0  (18)",
             by_default=False),
    Variable("separation_time", "s", "model", "scaled by itself", "time until the surfaces part",
             "contact_time + remaining indentation/(e_out v0)", by_default=False),
)  # fmt: skip

PACKAGES = ("numpy", "h5py", "h5netcdf", "xarray")


def stored(plan: Plan) -> tuple[Variable, ...]:
    """The variables of the result of a plan; the status is always there: without it a NaN would have no reason."""
    chosen = {"status", *(plan.config.output.variables or (one.name for one in SCHEMA if one.by_default))}
    return tuple(replace(one, dtype=plan.config.output.dtype if one.dtype == "f8" else one.dtype)
                 for one in SCHEMA if one.name in chosen)  # fmt: skip


def outline(plan: Plan) -> xr.Dataset:
    """The dataset of a plan without its values: each variable is zero, of no memory, and not to be written to.

    It has no index yet: to be stored it needs none, and making one takes longer than all the rest.
    """
    axes = tuple(axis.name for axis in plan.config.axes)
    dataset = xr.Dataset(coords=xr.Coordinates(_coordinates(plan), indexes={}), attrs=_provenance(plan))
    for one in stored(plan):
        dims, shape = (
            (axes, plan.shape) if one.per == "axes" else (("model", *axes), (len(plan.models), *plan.shape))
        )
        dataset[one.name] = (dims, np.broadcast_to(np.zeros((), one.dtype), shape), attributes_of(one))
    return dataset


def attributes_of(variable: Variable) -> dict[str, object]:
    found: dict[str, object] = {
        "units": variable.unit, "long_name": variable.meaning, "equation": variable.equation,
    }  # fmt: skip
    if variable.name == "status":
        found["flag_values"] = np.array([int(status) for status in Status], np.int8)
        found["flag_meanings"] = " ".join(status.name.lower() for status in Status)
    if variable.name == "in_domain":
        found["flag_values"] = np.array([0, 1], np.int8)
        found["flag_meanings"] = "outside_claimed_domain within_claimed_domain"
    return found


def _coordinates(plan: Plan) -> dict[str, object]:
    models = plan.models

    def texts(field: str) -> tuple[str, list[str], dict[str, str]]:
        return "model", [str(getattr(model, field)) for model in models], {"long_name": f"{field} of the model"}

    found: dict[str, object] = {
        "model": ("model", [model.key for model in models], {"long_name": "contact force model"}),
        **{field: texts(field) for field in ("title", "equation", "reference", "doi")},
        "year": ("model", [model.year for model in models], {"long_name": "year of the model"}),
    }
    for axis in plan.config.axes:
        for name, values in axis.columns.items():
            found[name] = (axis.name, list(values), _about(plan, name))
    for name, value in plan.config.scalars.items():
        found[name] = ((), value, _about(plan, name))
    found["exponent"] = _exponent(plan)
    if "alpha" in plan.inputs.names():
        found["e"] = _restitution(plan)
    return found


def _about(plan: Plan, name: str) -> dict[str, str]:
    """Units and meaning of a coordinate."""
    key, _, own = name.rpartition(".")
    for model in plan.models:
        if model.key == key:
            quantity = own_quantities(model)[own]
            return {"units": udunits(quantity.unit), "long_name": quantity.meaning}
    if name in MATERIALS:
        return {"long_name": MATERIALS[name]}
    return {"units": udunits(SWEEP[name].unit), "long_name": SWEEP[name].meaning}


def udunits(unit: str) -> str:
    """A unit of the config in the spelling of netCDF.

    >>> udunits("m/s"), udunits("N/m^n"), udunits("kg/m^3"), udunits("1")
    ('m s-1', 'N m-n', 'kg m-3', '1')
    """
    return re.sub(r"/\s*([A-Za-z]+)(?:\^(\S+))?", lambda found: f" {found[1]}-{found[2] or 1}", unit)


def plain_unit(unit: str) -> str:
    """The other way round, as a reader writes it.

    >>> plain_unit("m s-1"), plain_unit("N m-1.5"), plain_unit("kg")
    ('m/s', 'N/m^1.5', 'kg')
    """
    return re.sub(r" ([A-Za-z]+)-(\S+)", lambda found: f"/{found[1]}" + f"^{found[2]}" * (found[2] != "1"), unit)


def exponent_text(by_model: Mapping[str, float]) -> str:
    """The exponent n of some models, where laws may have their own.

    >>> exponent_text({"hertz": 1.5, "bilinear": 1.0, "lankarani-nikravesh-1990": 1.5})
    '1.5 (1 for bilinear)'
    """
    common = Counter(by_model.values()).most_common(1)[0][0]
    others = {key: n for key, n in by_model.items() if n != common}
    text = ", ".join(f"{n:g} for {key}" for key, n in others.items())
    if len(text) > MAX_NAMED:
        text = f"{len(others)} of {len(by_model)} models have another n"
    return f"{common:g}" + (f" ({text})" if text else "")


def exponents_of(dataset: xr.Dataset) -> str | None:
    """The exponent n of the models of a result in words; None where it varies along an axis, or is not known."""
    exponent = dataset.coords.get("exponent")
    if exponent is None or not set(exponent.dims) <= {"model"}:
        return None
    keys = np.atleast_1d(dataset["model"].values).tolist()
    return exponent_text(dict(zip(map(str, keys), np.atleast_1d(exponent.values).tolist(), strict=True)))


def is_input(name: str) -> bool:
    """Whether a coordinate is an input of the sweep: not a text about a model, nor computed from inputs."""
    return name in SWEEP or name in MATERIALS or "." in name


def _exponent(plan: Plan) -> tuple[tuple[str, ...], object, dict[str, str]]:
    """The compliance exponent of each model: its own, or the sweep's, which may be an axis."""
    about = {"units": "1", "long_name": "compliance exponent n"}
    own = np.array([np.nan if model.exponent is None else model.exponent for model in plan.models])
    axes = plan.inputs.axes_of("n")
    if not axes:
        return ("model",), np.where(np.isnan(own), plan.config.scalars["n"], own), about
    axis = plan.config.axes[axes[0]]
    values = np.asarray(axis.columns["n"], float)
    return ("model", axis.name), np.where(np.isnan(own)[:, None], values, own[:, None]), about


def _restitution(plan: Plan) -> tuple[tuple[str, ...], object, dict[str, str]]:
    """e = 1 - alpha (v1 - v2), equation (24), over the axes that it depends on."""
    config = plan.config
    places = sorted({place for name in ("alpha", "v1", "v2") for place in plan.inputs.axes_of(name)})

    def column(name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        if name in config.scalars:
            return np.asarray(config.scalars[name], float)
        (own,) = plan.inputs.axes_of(name)
        values = np.asarray(config.axes[own].columns[name], float)
        return values.reshape([-1 if place == own else 1 for place in places])

    e = 1.0 - column("alpha") * (column("v1") - column("v2"))
    about = {"units": "1", "long_name": "restitution asked for", "equation": "e = 1 - alpha (v1 - v2)  (24)"}
    return tuple(config.axes[place].name for place in places), e, about


def _provenance(plan: Plan) -> dict[str, object]:
    config = plan.config
    return {
        "title": config.title,
        "schema_version": SCHEMA_VERSION,
        "config": config.text,
        "config_set": json.dumps(list(config.overrides)),
        "fingerprint": plan.fingerprint,
        "rtol": config.solver.rtol,
        "max_steps": config.solver.max_steps,
        "core": config.solver.core,
        "impact_version": __version__,
        "packages": json.dumps({name: version(name) for name in PACKAGES}),
        "plugins": json.dumps(plan.plugins.record),
        "materials": json.dumps({name: asdict(material) for name, material in plan.materials_used.items()}),
    }
