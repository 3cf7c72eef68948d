"""The SCHEMA of each kind of result: its variables, coordinates and attributes."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import Any

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
from ..contact.timestep import EXACT
from ..contact.variables import AXES, BY_DEFAULT, HISTORY, OUTPUTS, Variable, by_name
from ..engine.build_impacts import mass_at, restitution_at
from ..engine.plan import Index, Inputs, Plan
from ..formatting import number
from .kinds import Kind

SCHEMA_VERSION = 2
# longer lists of models with another exponent are abbreviated
MAX_EXPONENT_LETTERS = 48
# coordinates along `model` with metadata of the models
MODEL_METADATA = ("title", "year", "equation", "reference", "doi")


# the outcomes of a fit
FIT_STATUSES = {
    "ok": "the solver met its tolerance inside the bounds",
    "at_bound": "a parameter is at a bound of the search: wider bounds would fit better",
    "not_converged": "the solver did not meet its tolerance",
    "too_few_points": "there are not more points than parameters",
    "no_prediction": "the law has no result at a point",
    "at_limit": "a parameter is at an end of its allowed values, where its interval ends too",
}
_LAWS, _PARAMETERS, _MEASURED = ("model",), ("model", "parameter"), ("model", "point")
_CURVES = ("model", "output_name", "grid")
CALIBRATION = by_name(
    Variable(
        "estimate",
        _PARAMETERS,
        "SI",
        "itself + interval",
        "best value of the parameter; NaN where the law does not have it",
    ),
    Variable(
        "lower", _PARAMETERS, "SI", "itself + interval", "lower end of the interval of 95 % by profile likelihood"
    ),
    Variable(
        "upper", _PARAMETERS, "SI", "itself + interval", "upper end of the interval of 95 % by profile likelihood"
    ),
    Variable(
        "covariance",
        (*_PARAMETERS, "other_parameter"),
        "SI",
        "deviations",
        "covariance in the linear approximation",
    ),
    Variable(
        "identifiable",
        _PARAMETERS,
        "1",
        "exact",
        "1 if the data determine the parameter, -1 if it is not the law's",
        dtype="i1",
    ),
    Variable(
        "fit_status",
        _LAWS,
        "1",
        "exact",
        "outcome of the fit",
        dtype="i1",
        flags={name: number for number, name in enumerate(FIT_STATUSES)},
    ),
    Variable("chi2_reduced", _LAWS, "1", "max(1, itself)", "squared residuals in variances per degree of freedom"),
    Variable(
        "p_value", _LAWS, "1", "max(1, itself)", "probability of a larger chi2 by the noise alone", is_new=True
    ),
    Variable(
        "excess", _LAWS, "SI", "itself", "standard deviation between specimens, besides that of the measurements"
    ),
    Variable("aicc", _LAWS, "1", "max(1, itself)", "corrected information criterion of Akaike"),
    Variable("weight", _LAWS, "1", "max(1, itself)", "Akaike weight among the laws"),
    Variable(
        "loo",
        _LAWS,
        "1",
        "max(1, itself)",
        "root mean square of leave-one-out residuals in given standard deviations; in SI units without one",
    ),
    Variable("predicted", _MEASURED, "SI", "measured", "output of the law at the point"),
    Variable("residual", _MEASURED, "SI", "measured", "measured minus predicted"),
    Variable(
        "loo_residual",
        _MEASURED,
        "1",
        "max(1, itself)",
        "residual of the point in the fit without it, in its own standard deviations",
        is_new=True,
    ),
    Variable("curve", _CURVES, "SI", "measured", "output of the law over the varied input"),
    Variable("curve_lower", _CURVES, "SI", "measured", "lower end of the band of 95 % of the curve"),
    Variable("curve_upper", _CURVES, "SI", "measured", "upper end of the band of 95 % of the curve"),
)
_STUDIES, _INPUTS = ("model", AXES), ("model", AXES, "input")
SENSITIVITY = by_name(
    Variable(
        "first", _INPUTS, "1", "reported", "first-order index: share of the variance that the input explains alone"
    ),
    Variable(
        "first_lower",
        _INPUTS,
        "1",
        "reported",
        "lower end of the bootstrap interval of 95 % of the first-order index",
    ),
    Variable(
        "first_upper",
        _INPUTS,
        "1",
        "reported",
        "upper end of the bootstrap interval of 95 % of the first-order index",
    ),
    Variable("first_half", _INPUTS, "1", "reported", "first-order index from the first half of the samples"),
    Variable(
        "total",
        _INPUTS,
        "1",
        "reported",
        "total index: share of the variance that is left if only the input is unknown",
    ),
    Variable(
        "total_lower", _INPUTS, "1", "reported", "lower end of the bootstrap interval of 95 % of the total index"
    ),
    Variable(
        "total_upper", _INPUTS, "1", "reported", "upper end of the bootstrap interval of 95 % of the total index"
    ),
    Variable("total_half", _INPUTS, "1", "reported", "total index from the first half of the samples"),
    Variable("mean", _STUDIES, "output", "reported", "mean of the output"),
    Variable("sd", _STUDIES, "output", "reported", "standard deviation of the output"),
    Variable("quantiles", (*_STUDIES, "quantile"), "output", "reported", "quantiles of the output"),
    Variable(
        "failed",
        _STUDIES,
        "1",
        "reported",
        "points without a result; with any there is no mean and no index",
        dtype="i8",
    ),
)
# the variables of each kind of dataset, by name
SCHEMA: Mapping[Kind, Mapping[str, Variable]] = {
    "sweep": OUTPUTS,
    "history": HISTORY,
    "calibration": CALIBRATION,
    "sensitivity study": SENSITIVITY,
}
# coordinates of studies besides those of models and inputs, with their dimensions; the first is the study's axis
STUDY_COORDINATES: Mapping[Kind, Mapping[str, str]] = {
    "calibration": {
        "parameter": "parameter",
        "other_parameter": "other_parameter",
        "point": "point",
        "line": "point",
        "output": "point",
        "measured": "point",
        "sigma": "point",
        "specimen": "point",
        "determined": "model",
        "grid": "grid",
        "output_name": "output_name",
    },
    "sensitivity study": {"input": "input", "quantile": "quantile"},
}
CALIBRATION_TEXTS = ("parameter", "other_parameter", "output_name", "output", "determined", "specimen")

RECORDED_PACKAGES = ("numpy", "h5py", "h5netcdf", "xarray")


def scale_of(variable: Variable, read: Callable[[str], NDArray[Any]], *, has_peak: bool) -> NDArray[np.float64]:
    """The scale of the differences of an output in its own unit; its shape broadcasts to that of the points.

    Parameters
    ----------
    variable : the output
    read : returns values by name: v1, v2 [m/s], m1, m2 [kg], the variable itself, `peak_indentation` [m]; arrays
        that broadcast against each other
    has_peak : whether the result has `peak_indentation`
    """

    def number(name: str) -> NDArray[np.float64]:
        return np.asarray(read(name), float)

    match variable.scale:
        case "v0":
            return np.asarray(np.abs(number("v1") - number("v2")))
        case "m v0^2/2":
            v0 = number("v1") - number("v2")
            return np.asarray(0.5 * effective_mass(number("m1"), number("m2")) * v0 * v0)
        case "the peak" if has_peak:
            return np.asarray(np.abs(number("peak_indentation")))
        case "itself" | "the peak":
            return np.asarray(np.abs(number(variable.name)))
    return np.ones(())


def template(variables: Iterable[Variable], sizes: Mapping[Hashable, int], axes: Sequence[str]) -> dict[str, Any]:
    """The data of a dataset with placeholder values: by name, dimensions, zeros that take no memory, attributes.

    Parameters
    ----------
    variables : those with a dimension that has no size are left out
    sizes : by dimension
    axes : the dimensions in place of `AXES`
    """
    arrays = {}
    for variable in variables:
        dims = tuple(dim for part in variable.dims for dim in (axes if part == AXES else (part,)))
        if sizes.keys() >= {*dims}:
            zeros = np.broadcast_to(np.zeros((), variable.dtype), [sizes[dim] for dim in dims])
            arrays[variable.name] = (dims, zeros, attributes_of(variable))
    return arrays


def stored_variables(plan: Plan) -> tuple[Variable, ...]:
    """The variables of the result of a plan; always with the status, which explains NaNs."""
    chosen = {"status", *(plan.config.output.variables or BY_DEFAULT)}
    return tuple(
        replace(variable, dtype=plan.config.output.dtype if variable.dtype == "f8" else variable.dtype)
        for name, variable in OUTPUTS.items()
        if name in chosen
    )


def dataset_template(plan: Plan) -> xr.Dataset:
    """The dataset of a plan with placeholder values.

    It has no index: storing it needs none, and building one takes longer than everything else.
    """
    # the coordinates come first in a file
    dataset = xr.Dataset(coords=plan_coordinates(plan), attrs=provenance_attributes(plan))
    axes = [axis.name for axis in plan.config.axes]
    # in one call: xarray merges the whole dataset in each call
    return dataset.assign(template(stored_variables(plan), dataset.sizes, axes))


def plan_coordinates(plan: Plan) -> xr.Coordinates:
    """The coordinates of the dataset of a plan, without an index."""
    return xr.Coordinates(_coordinates_by_name(plan), indexes={})


def attributes_of(variable: Variable) -> dict[str, object]:
    """The attributes of a stored variable."""
    attributes: dict[str, object] = {"units": udunits(variable.unit), "long_name": variable.meaning}
    if variable.equation:
        attributes["equation"] = variable.equation
    if variable.flags:
        attributes["flag_values"] = np.array([*variable.flags.values()], np.int8)
        attributes["flag_meanings"] = " ".join(variable.flags)
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
