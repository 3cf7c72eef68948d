"""The SCHEMA of a result: its variables and their comparison scales, coordinates and attributes."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._version import __version__
from ..array_types import Array
from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_foreign, is_input
from ..config.load import Config
from ..config.tables import MATERIAL_KEYS
from ..contact.materials import effective_mass
from ..contact.outputs import BY_DEFAULT, UNITS
from ..contact.status import Status
from ..contact.timestep import EXACT
from ..engine.build_impacts import mass_at, restitution_at
from ..engine.plan import Index, Inputs, Plan
from ..formatting import number

SCHEMA_VERSION = 2
# longer lists of models with another exponent are abbreviated
MAX_EXPONENT_LETTERS = 48
# coordinates along `model` with metadata of the models
MODEL_METADATA = ("title", "year", "equation", "reference", "doi")


@dataclass(frozen=True)
class SchemaVariable:
    """One variable of a result.

    `per` states whether it depends on the model or on the axes only; `judged` how a comparison judges it: by its
    difference relative to a scale, by a bound of its own value, exactly, or not at all.
    """

    name: str
    per: Literal["model", "axes"]
    judged: Literal[
        "scaled by v0",
        "scaled by 1",
        "scaled by the peak",
        "scaled by itself",
        "scaled by m v0^2/2",
        "bounded by 10 rtol",
        "exact",
        "reported",
    ]
    meaning: str
    equation: str
    dtype: str = "f8"

    @property
    def unit(self) -> str:
        """Its unit in the spelling of netCDF."""
        return udunits(UNITS[self.name])

    @property
    def by_default(self) -> bool:
        """Whether it is stored if `[output] variables` is not set."""
        return self.name in BY_DEFAULT


SCHEMA = (
    SchemaVariable("v1_post", "model", "scaled by v0", "velocity of ball 1 after the impact",
             "v1+ = v1 - (1 + e_out)(m/m1) v0"),
    SchemaVariable("v2_post", "model", "scaled by v0", "velocity of ball 2 after the impact",
             "v2+ = v2 + (1 + e_out)(m/m2) v0"),
    SchemaVariable("v1_reference", "axes", "scaled by v0", "velocity of ball 1 by impulse and momentum",
             "v1+ = v1 - (1 + e)(m/m1) v0  (6)"),
    SchemaVariable("v2_reference", "axes", "scaled by v0", "velocity of ball 2 by impulse and momentum",
             "v2+ = v2 + (1 + e)(m/m2) v0  (7)"),
    SchemaVariable("v1_error", "model", "scaled by v0", "error of the velocity of ball 1",
             "v1_post - v1_reference"),
    SchemaVariable("v2_error", "model", "scaled by v0", "error of the velocity of ball 2",
             "v2_post - v2_reference"),
    SchemaVariable("e_out", "model", "scaled by 1", "restitution that the model delivers",
             "(v2+ - v1+)/(v1 - v2)  (5)"),
    SchemaVariable("e_error", "model", "scaled by 1", "delivered minus requested restitution", "e_out - e"),
    SchemaVariable("peak_indentation", "model", "scaled by the peak", "largest indentation", "δₘ at v = 0"),
    SchemaVariable("permanent_indentation", "model", "scaled by the peak", "indentation at the release",
             "δₚ at the end of the contact"),
    SchemaVariable("peak_force", "model", "scaled by itself", "largest contact force",
             "max F over the approach"),
    SchemaVariable("contact_time", "model", "scaled by itself", "contact time",
             "from first contact to release"),
    SchemaVariable("energy_loss", "model", "scaled by m v0^2/2", "kinetic energy lost",
             "m v0²(1 - e_out²)/2"),
    SchemaVariable("stiffness", "model", "scaled by itself",
             "contact stiffness used; n is the coordinate exponent; without K and with n other than 1.5 it is "
             "F_m/delta_m^n at the Hertz peak", "K  (12)"),
    SchemaVariable("damping_ratio", "model", "scaled by itself",
             "dimensionless damping, where the law has one",
             "χ = λ v0/K"),
    SchemaVariable("energy_residual", "model", "bounded by 10 rtol", "residual of the work balance",
             "[work of the force - m v0²(1 - e_out²)/2]/(m v0²/2)"),
    SchemaVariable("closed_form_error", "model", "bounded by 10 rtol",
             "distance from the closed form, where one exists", "e_out - exact e_out"),
    SchemaVariable("status", "model", "exact", "outcome of the point", "see flag_meanings", "i1"),
    SchemaVariable("in_domain", "model", "exact", "1 if the inputs are in the stated domain of the law",
             "1 inside every stated interval", "i1"),
    SchemaVariable("steps", "model", "reported", "accepted steps of the integrator",
             "approach + restitution", "i4"),
    SchemaVariable("e_kinetic", "model", "scaled by 1",
             "kinetic restitution; the impulses are the changes of the momentum, so that it is e_out",
             "τ_r/τ_c  (2)"),
    SchemaVariable("e_energetic", "model", "scaled by 1",
             "energetic restitution, from the integrated works of the two phases", "√(-W_r/W_c)  (3)"),
    SchemaVariable("lambda", "model", "scaled by itself",
             "damping factor, where the law has one; n is the coordinate exponent", "λ = χ K/v0  (18)"),
    SchemaVariable("separation_time", "model", "scaled by itself", "time until the surfaces separate",
             "contact_time + remaining indentation/(e_out v0)"),
)  # fmt: skip

# name, unit and meaning of the variables of a time history, over the time t
HISTORY_VARIABLES = (
    ("delta", "m", "indentation"),
    ("v", "m s-1", "rate of the indentation"),
    ("F", "N", "contact force"),
    ("x1", "m", "displacement of ball 1 since first contact"),
    ("x2", "m", "displacement of ball 2 since first contact"),
    ("v1", "m s-1", "velocity of ball 1"),
    ("v2", "m s-1", "velocity of ball 2"),
)

RECORDED_PACKAGES = ("numpy", "h5py", "h5netcdf", "xarray")


def scale_of(
    variable: SchemaVariable, read: Callable[[str], NDArray[Any]], *, has_peak: bool
) -> NDArray[np.float64]:
    """The scale of a variable's differences in its own unit; its shape broadcasts to that of the points.

    Parameters
    ----------
    variable : the variable
    read : returns values by name: v1, v2 [m/s], m1, m2 [kg], the variable itself, `peak_indentation` [m]; arrays
        that broadcast against each other
    has_peak : whether the result has `peak_indentation`
    """

    def number(name: str) -> NDArray[np.float64]:
        return np.asarray(read(name), float)

    match variable.judged:
        case "scaled by v0":
            return np.asarray(np.abs(number("v1") - number("v2")))
        case "scaled by m v0^2/2":
            v0 = number("v1") - number("v2")
            return np.asarray(0.5 * effective_mass(number("m1"), number("m2")) * v0 * v0)
        case "scaled by the peak" if has_peak:
            return np.asarray(np.abs(number("peak_indentation")))
        case "scaled by itself" | "scaled by the peak":
            return np.asarray(np.abs(number(variable.name)))
    return np.ones(())


def stored_variables(plan: Plan) -> tuple[SchemaVariable, ...]:
    """The variables of the result of a plan; always with the status, which explains NaNs."""
    chosen = {"status", *(plan.config.output.variables or BY_DEFAULT)}
    return tuple(
        replace(variable, dtype=plan.config.output.dtype if variable.dtype == "f8" else variable.dtype)
        for variable in SCHEMA
        if variable.name in chosen
    )


def dataset_template(plan: Plan) -> xr.Dataset:
    """The dataset of a plan with placeholder values: read-only zeros that take no memory.

    It has no index: storing it needs none, and building one takes longer than everything else.
    """
    axes = tuple(axis.name for axis in plan.config.axes)
    variables = {}
    for variable in stored_variables(plan):
        dims, shape = (
            (axes, plan.shape) if variable.per == "axes" else (("model", *axes), (len(plan.models), *plan.shape))
        )
        zeros = np.broadcast_to(np.zeros((), variable.dtype), shape)
        variables[variable.name] = (dims, zeros, attributes_of(variable))
    # in one call: xarray merges the whole dataset in each call; the coordinates come first in a file
    return xr.Dataset(coords=plan_coordinates(plan), attrs=provenance_attributes(plan)).assign(variables)


def plan_coordinates(plan: Plan) -> xr.Coordinates:
    """The coordinates of the dataset of a plan, without an index."""
    return xr.Coordinates(_coordinates_by_name(plan), indexes={})


def attributes_of(variable: SchemaVariable) -> dict[str, object]:
    attributes: dict[str, object] = {
        "units": variable.unit,
        "long_name": variable.meaning,
        "equation": variable.equation,
    }
    if variable.name == "status":
        attributes["flag_values"] = np.array([int(status) for status in Status], np.int8)
        attributes["flag_meanings"] = " ".join(status.name.lower() for status in Status)
    if variable.name == "in_domain":
        attributes["flag_values"] = np.array([0, 1], np.int8)
        attributes["flag_meanings"] = "outside_claimed_domain within_claimed_domain"
    return attributes


def _coordinates_by_name(plan: Plan) -> dict[str, object]:
    models = plan.models

    def texts(field: str) -> tuple[str, list[str], dict[str, str]]:
        return "model", [str(getattr(model, field)) for model in models], {"long_name": f"{field} of the model"}

    coordinates: dict[str, object] = {
        "model": ("model", [model.key for model in models], {"long_name": "contact force model"}),
        **{field: texts(field) for field in ("title", "equation", "reference", "doi")},
        "year": ("model", [model.year for model in models], {"long_name": "year of the model"}),
    }
    for axis in plan.config.axes:
        if axis.numbered:
            coordinates[axis.name] = (
                axis.name,
                list(axis.labels),
                {"long_name": f"number of the {axis.name.partition('_')[0]}"},
            )
        for name, values in axis.columns.items():
            coordinates[name] = (axis.name, list(values), coordinate_attributes(plan, name))
    for name, value in plan.config.scalars.items():
        coordinates[name] = ((), value, coordinate_attributes(plan, name))
    coordinates["exponent"] = _exponent_coordinate(plan)
    if "alpha" in plan.inputs.names():
        coordinates["e"] = _restitution_coordinate(plan)
    for ball in "12":
        if f"m{ball}" not in plan.inputs.names():
            coordinates[f"m{ball}"] = _mass_coordinate(plan, ball)
    return coordinates


def coordinate_attributes(plan: Plan, name: str) -> dict[str, str]:
    """Units and meaning of a coordinate, as attributes."""
    parsed = InputName.parse(name)
    quantity = parsed.quantity({model.key: model for model in plan.models})
    if quantity is None:
        return {"long_name": MATERIAL_KEYS[name]}
    of_material = f" of {parsed.material}" if parsed.material else ""
    return {"units": udunits(quantity.unit), "long_name": f"{quantity.meaning}{of_material}"}


def udunits(unit: str) -> str:
    """A unit of the config in the spelling of netCDF.

    >>> udunits("m/s"), udunits("N/m^n"), udunits("kg/m^3"), udunits("1")
    ('m s-1', 'N m-n', 'kg m-3', '1')
    """
    return re.sub(r"/\s*([A-Za-z]+)(?:\^(\S+))?", lambda match: f" {match[1]}-{match[2] or 1}", unit)


def plain_unit(unit: str) -> str:
    """The inverse of `udunits`: a unit in the spelling of the config.

    >>> plain_unit("m s-1"), plain_unit("N m-1.5"), plain_unit("kg")
    ('m/s', 'N/m^1.5', 'kg')
    """
    return re.sub(r" ([A-Za-z]+)-(\S+)", lambda match: f"/{match[1]}" + f"^{match[2]}" * (match[2] != "1"), unit)


def exponent_text(by_model: Mapping[str, float]) -> str:
    """The exponent n of some models as text, with the models whose own exponent differs.

    >>> exponent_text({"hertz": 1.5, "bilinear": 1.0, "lankarani-nikravesh-1990": 1.5})
    '1.5 (1 for bilinear)'
    """
    common = Counter(by_model.values()).most_common(1)[0][0]
    others = {key: n for key, n in by_model.items() if n != common}
    text = ", ".join(f"{number(n)} for {key}" for key, n in others.items())
    if len(text) > MAX_EXPONENT_LETTERS:
        text = f"{len(others)} of {len(by_model)} models have another n"
    return number(common) + (f" ({text})" if text else "")


def exponents_of(dataset: xr.Dataset) -> str | None:
    """The exponent n of the models of a result as text; None if it varies along an axis or is unknown."""
    exponent = dataset.coords.get("exponent")
    if exponent is None or not set(exponent.dims) <= {"model"}:
        return None
    keys = np.atleast_1d(dataset["model"].values).tolist()
    return exponent_text(dict(zip(map(str, keys), np.atleast_1d(exponent.values).tolist(), strict=True)))


def is_case(name: str) -> bool:
    """Whether a dimension numbers its points: that of a table of cases, of a similar group, or of samples.

    >>> is_case("case"), is_case("case_2"), is_case("sample"), is_case("m1")
    (True, True, True, False)
    """
    return re.fullmatch(rf"case(_[0-9]{{1,3}})?|{SAMPLE}", name) is not None


def derived_names(coords: Mapping[Any, xr.DataArray]) -> frozenset[str]:
    """The coordinates with names of inputs that were computed: e from alpha, masses from R and rho."""
    masses = {name for name in ("m1", "m2") if name in coords and "equation" in coords[name].attrs}
    return frozenset(masses | ({"e"} if "alpha" in coords else set()))


def columns_along(dataset: xr.Dataset, dim: Hashable) -> list[str]:
    """The inputs that vary along a dimension only: the columns of its axis."""
    derived = derived_names(dataset.coords)
    along = [str(name) for name, coordinate in dataset.coords.variables.items() if coordinate.dims == (dim,)]
    return [name for name in along if is_input(name) and name not in derived]


def foreign_dims(dataset: xr.Dataset, key: str) -> list[Hashable]:
    """The dimensions along which only parameters of other models vary, so that nothing of this model does."""
    return [dim for dim in dataset.dims if is_foreign(columns_along(dataset, dim), key)]


def parts_of_models(dataset: xr.Dataset) -> Iterator[xr.Dataset]:
    """The part of each model of a result, at the first position along the parameters of other models."""
    for model, key in enumerate(dataset["model"].values):
        first = dict.fromkeys(foreign_dims(dataset, str(key)), slice(0, 1))
        yield dataset.isel({"model": model, **first})


def count_points(dataset: xr.Dataset) -> int:
    """The number of points of a result, without repetitions along parameters of other models."""
    if "model" not in dataset.dims:
        return math.prod(dataset.sizes.values())
    return sum(math.prod(part.sizes.values()) for part in parts_of_models(dataset))


def _exponent_coordinate(plan: Plan) -> tuple[tuple[str, ...], object, dict[str, str]]:
    """The compliance exponent of each model: its own, else that of the sweep, which may be an axis."""
    about = {"units": "1", "long_name": "compliance exponent n"}
    law_exponents = np.array([np.nan if model.exponent is None else model.exponent for model in plan.models])
    axes = plan.inputs.axes_of("n")
    if not axes:
        return ("model",), np.where(np.isnan(law_exponents), plan.config.scalars["n"], law_exponents), about
    axis = plan.config.axes[axes[0]]
    values = np.asarray(axis.columns["n"], float)
    return ("model", axis.name), np.where(np.isnan(law_exponents)[:, None], values, law_exponents[:, None]), about


def _restitution_coordinate(plan: Plan) -> tuple[tuple[str, ...], object, dict[str, str]]:
    about = {"units": "1", "long_name": "requested restitution", "equation": "e = 1 - alpha (v1 - v2)  (24)"}
    return *_derived_values(plan, ("alpha", "v1", "v2"), restitution_at), about


def _mass_coordinate(plan: Plan, ball: str) -> tuple[tuple[str, ...], object, dict[str, str]]:
    of_materials = [f"materials.{name}.rho" for name in plan.inputs.materials_of(ball)]
    names = (f"R{ball}", "material", f"material{ball}", *of_materials)
    about = {**coordinate_attributes(plan, f"m{ball}"), "equation": "m = (4/3) pi R^3 rho"}
    return *_derived_values(plan, names, lambda inputs, index: mass_at(inputs, ball, index)), about


def _derived_values(
    plan: Plan, names: Sequence[str], formula: Callable[[Inputs, Index], Array]
) -> tuple[tuple[str, ...], Array]:
    """Values that are computed from inputs, and their dimensions: the axes of those inputs."""
    axes = sorted({axis for name in names for axis in plan.inputs.axes_of(name)})
    where = [slice(None) if axis in axes else slice(1) for axis in range(len(plan.shape))]
    shape = [plan.shape[axis] for axis in axes]
    values = formula(plan.inputs, plan.inputs.index(where))
    return tuple(plan.config.axes[axis].name for axis in axes), values.reshape(shape)


def design_record(config: Config) -> dict[str, object]:
    """The method, number and seed of the samples of a config, and the distributions by config name."""
    assert config.design is not None
    return config.design.model_dump() | {
        "distributions": {
            name: {distribution.kind: list(distribution.parameters)}
            for name, distribution in config.distributions.items()
        }
    }


def provenance_attributes(plan: Plan) -> dict[str, object]:
    """The attributes from which a result can be repeated."""
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
        # results of the continuous law have the attributes that they had before there were schemes
        **({} if config.solver.integrator == EXACT else {"integrator": config.solver.integrator}),
        "impact_version": __version__,
        "packages": json.dumps({name: version(name) for name in RECORDED_PACKAGES}),
        "plugins": json.dumps(plan.plugins.record),
        "materials": json.dumps(plan.material_record),
        **({} if config.design is None else {"design": json.dumps(design_record(config))}),
    }
