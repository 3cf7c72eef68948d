"""The kinds of results, and the SCHEMA of each: its variables, coordinates and attributes."""

from __future__ import annotations

import json
import math
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._version import __version__
from ..array_types import Array
from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_foreign, is_input
from ..config.tables import MATERIAL_KEYS
from ..contact.fixed_step import EXACT
from ..contact.history import History
from ..contact.materials import effective_mass
from ..contact.units import names_in, with_numbers
from ..contact.variables import AXES, HISTORY, LAW_DIMS, OUTPUTS, Variable, by_name, default_variables
from ..engine.inputs import input_at
from ..engine.plan import Plan
from ..engine.trajectories import axes_of_arrays
from ..errors import UsageError
from ..formatting import number, safe_text

Kind = Literal["sweep", "history", "calibration", "sensitivity study", "board"]

# kinds of results that are neither a sweep nor a single impact, and the dimension that only each of them has
STUDIES: Mapping[Kind, str] = {"calibration": "parameter", "board": "check", "sensitivity study": "input"}

SCHEMA_VERSION = 2
# longer lists of models with another exponent are abbreviated
MAX_EXPONENT_LETTERS = 48
# coordinates along `model` with metadata of the models
MODEL_METADATA = ("title", "equation", "reference", "doi", "year")

# the outcomes of a fit
FIT_STATUSES = {
    "ok": "the solver met its tolerance inside the bounds",
    "at_bound": "a parameter is at a bound of the search: wider bounds would fit better",
    "not_converged": "the solver did not meet its tolerance",
    "too_few_points": "there are not more points than parameters",
    "no_prediction": "the law has no result at a point",
    "at_limit": "a parameter is at an end of its allowed values, where its interval ends too",
}
_PARAMETER_DIMS = ("model", "parameter")
_parameter_variable = partial(Variable, dims=_PARAMETER_DIMS, unit="SI", scale="itself + interval")
_law_variable = partial(Variable, dims=("model",), scale="max(1, itself)")
_point_variable = partial(Variable, dims=("model", "point"), unit="SI", scale="measured")
_curve_variable = partial(Variable, dims=("model", "output_name", "grid"), unit="SI", scale="measured")
CALIBRATION = by_name(
    _parameter_variable("estimate", "best value of the parameter; NaN where the law does not have it"),
    _parameter_variable("lower", "lower end of the interval of 95 % by profile likelihood"),
    _parameter_variable("upper", "upper end of the interval of 95 % by profile likelihood"),
    _parameter_variable(
        "covariance",
        "covariance in the linear approximation",
        dims=(*_PARAMETER_DIMS, "other_parameter"),
        scale="deviations",
    ),
    _parameter_variable(
        "identifiable",
        "1 if the data determine the parameter, -1 if it is not the law's",
        unit="1",
        scale="exact",
        dtype="i1",
    ),
    _law_variable(
        "fit_status",
        "outcome of the fit",
        scale="exact",
        dtype="i1",
        flags={name: i for i, name in enumerate(FIT_STATUSES)},
    ),
    _law_variable("chi2_reduced", "squared residuals in variances per degree of freedom"),
    _law_variable("p_value", "probability of a larger chi2 by the noise alone", is_new=True),
    _law_variable(
        "excess",
        "standard deviation between specimens, besides that of the measurements",
        unit="SI",
        scale="itself",
    ),
    _law_variable("aicc", "corrected information criterion of Akaike"),
    _law_variable("weight", "Akaike weight among the laws"),
    _law_variable(
        "loo", "root mean square of leave-one-out residuals in given standard deviations; in SI units without one"
    ),
    _point_variable("predicted", "output of the law at the point"),
    _point_variable("residual", "measured minus predicted"),
    _point_variable(
        "loo_residual",
        "residual of the point in the fit without it, in its own standard deviations",
        unit="1",
        scale="max(1, itself)",
        is_new=True,
    ),
    _curve_variable("curve", "output of the law over the varied input"),
    _curve_variable("curve_lower", "lower end of the band of 95 % of the curve"),
    _curve_variable("curve_upper", "upper end of the band of 95 % of the curve"),
)
_STUDY_DIMS, _INPUT_DIMS = ("model", AXES), ("model", AXES, "input")
SENSITIVITY = by_name(
    Variable("first", "first-order index: share of the variance that the input explains alone", _INPUT_DIMS),
    Variable("first_lower", "lower end of the bootstrap interval of 95 % of the first-order index", _INPUT_DIMS),
    Variable("first_upper", "upper end of the bootstrap interval of 95 % of the first-order index", _INPUT_DIMS),
    Variable("first_half", "first-order index from the first half of the samples", _INPUT_DIMS),
    Variable("total", "total index: share of the variance that is left if only the input is unknown", _INPUT_DIMS),
    Variable("total_lower", "lower end of the bootstrap interval of 95 % of the total index", _INPUT_DIMS),
    Variable("total_upper", "upper end of the bootstrap interval of 95 % of the total index", _INPUT_DIMS),
    Variable("total_half", "total index from the first half of the samples", _INPUT_DIMS),
    Variable("mean", "mean of the output", _STUDY_DIMS, "output"),
    Variable("sd", "standard deviation of the output", _STUDY_DIMS, "output"),
    Variable("quantiles", "quantiles of the output", (*_STUDY_DIMS, "quantile"), "output"),
    Variable("failed", "points without a result; with any there is no mean and no index", dtype="i8"),
)
# what became of a check
CHECK_STATUSES = {"pass": 0, "fail": 1, "not_supported": 2}
_check_variable = partial(Variable, dims=("engine", "check"), scale="exact")
BOARD = by_name(
    _check_variable("asked", "what the check asks for", scale="reported"),
    _check_variable(
        "delivered",
        "what the engine delivered; NaN where it does not support the collision",
        scale="max(1, itself)",
    ),
    _check_variable("tolerance", "tolerance of the check"),
    _check_variable("check_status", "outcome of the check", dtype="i1", flags=CHECK_STATUSES),
)
# the variables of each kind of dataset, by name
SCHEMA: Mapping[Kind, Mapping[str, Variable]] = {
    "sweep": OUTPUTS,
    "history": HISTORY,
    "calibration": CALIBRATION,
    "sensitivity study": SENSITIVITY,
    "board": BOARD,
}
# coordinates of studies besides those of models and inputs, with their dimensions
STUDY_COORDINATES: Mapping[Kind, Mapping[str, str]] = {
    "calibration": {
        **{name: name for name in ("parameter", "other_parameter", "point", "grid", "output_name")},
        **dict.fromkeys(("line", "output", "measured", "sigma", "specimen"), "point"),
        "determined": "model",
    },
    "sensitivity study": {"input": "input", "quantile": "quantile"},
    "board": {
        **dict.fromkeys(("check", "collision", "criterion"), "check"),
        **dict.fromkeys(("engine", "engine_version", "engine_kind"), "engine"),
    },
}
CALIBRATION_TEXTS = ("parameter", "other_parameter", "output_name", "output", "determined", "specimen")

RECORDED_PACKAGES = ("numpy", "h5py", "h5netcdf", "xarray")


# the accuracy of outputs relative to their scale, and the default tolerance of comparisons, over the solver's rtol
DEFAULT_RTOL_FACTOR = 10.0


def kind_of(dataset: xr.Dataset) -> Kind:
    """Find the kind of a dataset by its dimensions."""
    if "t" in dataset.dims:
        return "history"
    return next((kind for kind, dim in STUDIES.items() if dim in dataset.dims), "sweep")


def require_result(dataset: xr.Dataset) -> None:
    """Raise a UsageError for a dataset of another program, which has no laws, and for one without values."""
    if kind_of(dataset) == "sweep" and "model" not in dataset.coords:
        raise UsageError("this dataset is not a result of impact: it has no coordinate model")
    if empty := [str(dim) for dim, size in dataset.sizes.items() if not size]:
        raise UsageError(f"this result has no values along {', '.join(empty)}")


def require_sweep(dataset: xr.Dataset, command: str) -> None:
    """Raise a UsageError where a command takes the result of a sweep, and got that of another command."""
    kind = kind_of(dataset)
    if kind in STUDIES:
        raise UsageError(f"{command}: this is a {kind}, expected the result of a sweep")


def require_axes(dataset: xr.Dataset) -> None:
    """Raise a UsageError for an axis that no sweep has, such as that of `stack`, whose labels are tuples."""
    for dim in {dim: None for name in OUTPUTS if name in dataset for dim in dataset[name].dims}:
        is_known = dim in LAW_DIMS or is_input(dim) or is_case(str(dim))
        if not is_known or dim not in dataset.coords or hasattr(dataset.indexes.get(dim), "levels"):
            axis, undo = safe_text(str(dim)), "unstack it, select it or rename it to its input"
            raise UsageError(f"{axis}: expected an axis of a sweep, with numbers or names; {undo}")


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

    scale: NDArray[np.float64] | float = 1.0
    match variable.scale:
        case "v0":
            scale = np.abs(number("v1") - number("v2"))
        case "m v0^2/2":
            v0 = number("v1") - number("v2")
            scale = 0.5 * effective_mass(number("m1"), number("m2")) * v0 * v0
        case "the slip":
            scale = np.abs(number("v1") - number("v2")) + _slip_before(number)
        case "the spin":
            speed = np.abs(number("v1") - number("v2")) + _slip_before(number)
            scale = speed / number(f"R{variable.name[len('omega')]}")
        case "m (v0^2 + g0^2)/2":
            v0, slip = number("v1") - number("v2"), _slip_before(number)
            scale = 0.5 * effective_mass(number("m1"), number("m2")) * (v0 * v0 + slip * slip)
        case "itself" | "the peak":
            is_peak = has_peak and variable.scale == "the peak"
            scale = np.abs(number("peak_indentation" if is_peak else variable.name))
    return np.asarray(scale)


def inputs_of_scale(variable: Variable) -> set[str]:
    """Name the values that the scale of an output is computed from.

    >>> sorted(inputs_of_scale(OUTPUTS["v1_post"])), inputs_of_scale(OUTPUTS["peak_indentation"])
    (['v1', 'v2'], {'peak_indentation'})
    """
    names = defaultdict[str, NDArray[np.float64]](lambda: np.ones(()))
    scale_of(variable, names.__getitem__, has_peak=True)
    return {*names}


def _slip_before(read: Callable[[str], NDArray[np.float64]]) -> NDArray[np.float64]:
    """The size of the slip before oblique impacts [m/s], from those of their inputs that a result has."""

    def given(name: str) -> NDArray[np.float64] | float:
        try:
            return read(name)
        except KeyError:
            return 0.0

    spins = (given(f"omega{ball}") for ball in "12")
    spinning = sum(
        read(f"R{ball}") * spin if np.any(spin) else 0.0 for ball, spin in zip("12", spins, strict=True)
    )
    along = given("u1") - given("u2") + (read("v1") - read("v2")) * np.tan(given("angle"))
    return np.asarray(np.abs(along + spinning))


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
    """Choose the variables of the result of a plan; always with the statuses, which explain NaNs."""
    has_friction = bool(plan.frictions)
    chosen = {"status", *(plan.config.output.variables or default_variables(has_friction))}
    chosen |= {"friction_status"} if has_friction else set()
    return tuple(
        replace(variable, dtype=plan.config.output.dtype if variable.dtype == "f8" else variable.dtype)
        for name, variable in OUTPUTS.items()
        if name in chosen
    )


def dataset_template(plan: Plan) -> xr.Dataset:
    """Build the dataset of a plan with placeholder values.

    It has no index: storing it needs none, and building one takes longer than everything else.
    """
    # the coordinates come first in a file
    # the core that the sweep chooses for its trajectories; a calibration or a study runs many sweeps
    attributes = provenance_attributes(plan) | {"core": plan.solver.core}
    dataset = xr.Dataset(coords=plan_coordinates(plan), attrs=attributes)
    axes = [axis.name for axis in plan.config.axes]
    # in one call: xarray merges the whole dataset in each call
    return dataset.assign(template(stored_variables(plan), dataset.sizes, axes))


def history_dataset(history: History, plan: Plan, point: Mapping[str, float | str]) -> xr.Dataset:
    """Build the dataset of a time history over t, with the inputs and masses of the impact as an attribute."""
    masses = {name: input_at(plan.inputs, name, plan.inputs.index()).item() for name in ("m1", "m2")}
    laws = {"model": plan.models[0].key, **({"friction": plan.frictions[0].key} if plan.frictions else {})}
    arrays = {name: getattr(history, name) for name in HISTORY}
    dataset = xr.Dataset(
        {name: ("t", a, attributes_of(HISTORY[name])) for name, a in arrays.items() if a is not None},
        coords={"t": ("t", history.t, {"units": "s", "long_name": "time since first contact"}), **laws},
    )
    dataset.attrs = {
        "title": f"Time history of one impact, {' with '.join(laws.values())}",
        "schema_version": SCHEMA_VERSION,
        "impact_version": __version__,
        "inputs": json.dumps({**point, **masses}),
        "e_kinetic": history.e_kinetic,
        "e_energetic": history.e_energetic,
    }
    return dataset


def attributes_of(variable: Variable) -> dict[str, object]:
    """Describe a variable by the attributes that are stored with it."""
    attributes: dict[str, object] = {"units": udunits(variable.unit), "long_name": variable.meaning}
    if variable.equation:
        attributes["equation"] = variable.equation
    if variable.flags:
        attributes["flag_values"] = np.array([*variable.flags.values()], np.int8)
        attributes["flag_meanings"] = " ".join(variable.flags)
    return attributes


def plan_coordinates(plan: Plan) -> xr.Coordinates:
    """Build the coordinates of the dataset of a plan, without an index."""
    models = plan.models
    coordinates: dict[str, object] = {
        "model": ("model", [model.key for model in models], {"long_name": "contact force model"}),
        **{
            key: ("model", [getattr(model, key) for model in models], {"long_name": f"{key} of the model"})
            for key in MODEL_METADATA
        },
    }
    if plan.frictions:
        keys = [friction.key for friction in plan.frictions]
        coordinates["friction"] = ("friction", keys, {"long_name": "friction law"})
    for axis in plan.config.axes:
        if axis.numbered:
            meaning = f"number of the {axis.name.partition('_')[0]}"
            coordinates[axis.name] = (axis.name, list(axis.labels), {"long_name": meaning})
        for name, values in axis.columns.items():
            coordinates[name] = (axis.name, list(values), coordinate_attributes(plan, name))
    for name, value in plan.config.scalars.items():
        coordinates[name] = ((), value, coordinate_attributes(plan, name))
    coordinates["exponent"] = (*_exponents(plan), {"units": "1", "long_name": "compliance exponent n"})
    names = plan.inputs.names()

    def derive(name: str, **attributes: str) -> None:
        """Add a coordinate that follows from inputs, along their axes."""
        # twice at the first value of each axis: the shape shows along which axes it varies
        twice = np.ix_(*[[0, 0]] * len(plan.inputs.axes))
        axes = sorted(axes_of_arrays([input_at(plan.inputs, name, twice)]))
        dims = tuple(plan.config.axes[axis].name for axis in axes)
        shape = [plan.inputs.shape[axis] for axis in axes]
        array = input_at(plan.inputs, name, plan.inputs.index()).reshape(shape)
        coordinates[name] = (dims, array, {**coordinate_attributes(plan, name), **attributes})

    if "alpha" in names:
        derive("e", long_name="requested restitution", equation="e = 1 - alpha (v1 - v2)  (24)")
    for ball in "12":
        if f"m{ball}" not in names:
            derive(f"m{ball}", equation="m = (4/3) pi R^3 rho")
        elif plan.frictions and f"R{ball}" not in names:
            derive(f"R{ball}", equation="m = (4/3) pi R^3 rho")
    if "speed" in names:
        derive("v1", equation="v1 = v2 + speed cos(angle)")
    return xr.Coordinates(coordinates, indexes={})


def coordinate_attributes(plan: Plan, name: str) -> dict[str, str]:
    """Describe a coordinate by its unit and meaning."""
    parsed = InputName.parse(name)
    quantity = parsed.quantity({model.key: model for model in plan.models})
    if quantity is None:
        return {"long_name": MATERIAL_KEYS[name]}
    of_material = f" of {parsed.material}" if parsed.material else ""
    if quantity.words:
        words = ", ".join(f"{position} is {word}" for position, word in enumerate(quantity.words))
        return {"units": "1", "long_name": f"{quantity.meaning}; {words}"}
    return {"units": udunits(quantity.unit), "long_name": f"{quantity.meaning}{of_material}"}


def udunits(unit: str) -> str:
    """Convert a unit of the config to the spelling of netCDF.

    >>> udunits("m/s"), udunits("N/m^n"), udunits("kg/m^3"), udunits("1")
    ('m s-1', 'N m-n', 'kg m-3', '1')
    """
    return re.sub(r"/\s*([A-Za-z]+)(?:\^(\S+))?", lambda match: f" {match[1]}-{match[2] or 1}", unit)


def plain_unit(unit: str) -> str:
    """Convert a unit to the spelling of the config, the inverse of `udunits`.

    >>> plain_unit("m s-1"), plain_unit("N m-1.5"), plain_unit("kg")
    ('m/s', 'N/m^1.5', 'kg')
    """
    return re.sub(r" ([A-Za-z]+)-(\S+)", lambda match: f"/{match[1]}" + f"^{match[2]}" * (match[2] != "1"), unit)


def unit_of(coordinate: xr.DataArray | xr.Variable) -> str:
    """Read the unit of a coordinate; "1" if it has none."""
    return safe_text(plain_unit(str(coordinate.attrs.get("units", "1"))))


def numbered_unit(dataset: xr.Dataset, name: str) -> str:
    """Read the unit of an input or a variable, with the number of n if its laws have a single exponent."""
    unit, law = unit_of(dataset[name]), InputName.parse(name).model
    n = dataset.coords.get("exponent" if law or name in dataset.data_vars else "n")
    if law and n is not None and "model" in n.dims:
        n = n.isel(model=dataset["model"].values == law)
    exponent = _only_number(n)
    return unit if exponent is None or names_in(unit) != {"n"} else with_numbers(unit, {"n": exponent})


def shared_exponent(dataset: xr.Dataset) -> float | None:
    """Read the n of the inputs that laws share, such as K; None if it varies or is unknown."""
    return _only_number(dataset.coords.get("n"))


def _only_number(values: xr.DataArray | None) -> float | None:
    numbers = np.unique([] if values is None else values)
    return float(numbers[0]) if numbers.size == 1 else None


def exponent_text(by_model: Mapping[str, float]) -> str:
    """Write the exponent n of some models, with the models whose own exponent differs.

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
    """Write the exponent n of the models of a result; None if it varies along an axis or is unknown."""
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
    """Name the coordinates that were computed: e from alpha, masses and radii from rho, v1 from speed."""
    # xarray's `get` of a name that is not there is slow
    computed = (name for name in ("m1", "m2", "R1", "R2", "v1") if name in coords)
    derived = {name for name in computed if "equation" in coords[name].attrs}
    return frozenset(derived | ({"e"} if "alpha" in coords else set()))


def columns_along(dataset: xr.Dataset, dim: Hashable) -> list[str]:
    """List the inputs that vary along a dimension only: the columns of its axis."""
    derived = derived_names(dataset.coords)
    along = [str(name) for name, coordinate in dataset.coords.variables.items() if coordinate.dims == (dim,)]
    return [name for name in along if is_input(name) and name not in derived]


def parts_of_laws(
    dataset: xr.Dataset, dims: Iterable[Hashable], first: int | slice = slice(0, 1)
) -> Iterator[tuple[tuple[int, ...], xr.Dataset]]:
    """Select each model, or each pair, of variables with some dimensions; yield also its position.

    Each is at the first position along the parameters of other laws: on axes of length one, or with `first` = 0
    without these axes. Without the dimension of models it is all.
    """
    law_dims = [dim for dim in LAW_DIMS if dim in dims and dim in dataset] if "model" in dims else []
    keys = [np.atleast_1d(dataset[dim].values).tolist() for dim in law_dims]
    columns = {dim: columns_along(dataset, dim) for dim in (dataset.dims if law_dims else ())}
    for place in np.ndindex(*map(len, keys)):
        names = [str(of_dim[position]) for of_dim, position in zip(keys, place, strict=True)]
        others = {dim: first for dim, along in columns.items() if is_foreign(along, *names)}
        # a friction law that was selected is no dimension
        at = {dim: position for dim, position in zip(law_dims, place, strict=True) if dim in dataset.dims}
        yield tuple(at.values()), dataset.isel({**at, **others})


def count_points(dataset: xr.Dataset) -> int:
    """Count the points of a result: cells for a model, without repetitions along parameters of other laws."""
    sizes = [part.sizes for _, part in parts_of_laws(dataset, {"model"} & {*dataset.dims})]
    return sum(math.prod(size for dim, size in of_model.items() if dim != "friction") for of_model in sizes)


def _exponents(plan: Plan) -> tuple[tuple[str, ...], Array]:
    """The compliance exponent of each model: its own, else that of the sweep, which may be an axis."""
    own = np.array([np.nan if model.exponent is None else model.exponent for model in plan.models])
    if not (axes := plan.inputs.axes_of("n")):
        return ("model",), np.where(np.isnan(own), plan.config.scalars["n"], own)
    axis = plan.config.axes[axes[0]]
    values = np.asarray(axis.columns["n"], float)
    return ("model", axis.name), np.where(np.isnan(own)[:, None], values, own[:, None])


def provenance_attributes(plan: Plan) -> dict[str, object]:
    """List the attributes from which a result can be repeated."""
    config = plan.config
    attributes: dict[str, object] = {
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
    }
    if config.design is not None:
        distributions = {name: {drawn.kind: drawn.numbers} for name, drawn in config.distributions.items()}
        attributes["design"] = json.dumps(config.design.model_dump() | {"distributions": distributions})
    return attributes
