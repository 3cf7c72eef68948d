"""The dataset of a calibration: parameters of laws, how well they fit, and the measurements."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.input_names import InputName
from ..config.load import Config
from ..config.tables import DEFAULT_TITLE
from ..contact.model import ForceModel
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..formatting import decimals, number
from ..text import safe_text
from .schema import SCHEMA, coordinate_attributes, plan_coordinates, provenance_attributes

# what became of a fit; its number is its position
FIT_STATUSES = {
    "ok": "the solver met its tolerance inside the bounds",
    "at_bound": "a parameter is at a bound of the search: wider bounds would fit better",
    "not_converged": "the solver did not meet its tolerance",
    "too_few_points": "there are not more points than parameters",
    "no_prediction": "the law has no result at a point",
    "at_limit": "a parameter is at an end of its allowed values, where its interval ends too",
}


@dataclass(frozen=True)
class CalibrationVariable:
    """A variable of a calibration: its dimensions, unit and meaning, and how two of its values are compared.

    A difference is judged in units of `scale`: the value and its interval; the standard deviations of two
    parameters; the value; the value, or 1 if that is larger; or the largest measured value of the output.
    Version 1.0 did not store the variables with `is_new`.
    """

    dims: tuple[str, ...]
    unit: str
    meaning: str
    scale: Literal["exact", "itself + interval", "deviations", "itself", "max(1, itself)", "measured"]
    is_new: bool = False


_OF_PARAMETER = ("model", "parameter")
_OF_CURVE = ("model", "output_name", "grid")
CALIBRATION_VARIABLES = {
    "estimate": CalibrationVariable(
        _OF_PARAMETER, "SI", "best value of the parameter; NaN where the law does not have it", "itself + interval"
    ),
    "lower": CalibrationVariable(
        _OF_PARAMETER, "SI", "lower end of the interval of 95 % by profile likelihood", "itself + interval"
    ),
    "upper": CalibrationVariable(
        _OF_PARAMETER, "SI", "upper end of the interval of 95 % by profile likelihood", "itself + interval"
    ),
    "covariance": CalibrationVariable(
        (*_OF_PARAMETER, "other_parameter"), "SI", "covariance in the linear approximation", "deviations"
    ),
    "identifiable": CalibrationVariable(
        _OF_PARAMETER, "1", "1 if the data determine the parameter, -1 if it is not the law's", "exact"
    ),
    "fit_status": CalibrationVariable(("model",), "1", "outcome of the fit", "exact"),
    "chi2_reduced": CalibrationVariable(
        ("model",), "1", "squared residuals in variances per degree of freedom", "max(1, itself)"
    ),
    "p_value": CalibrationVariable(
        ("model",), "1", "probability of a larger chi2 by the noise alone", "max(1, itself)", is_new=True
    ),
    "excess": CalibrationVariable(
        ("model",), "SI", "standard deviation between specimens, besides that of the measurements", "itself"
    ),
    "aicc": CalibrationVariable(("model",), "1", "corrected information criterion of Akaike", "max(1, itself)"),
    "weight": CalibrationVariable(("model",), "1", "Akaike weight among the laws", "max(1, itself)"),
    "loo": CalibrationVariable(
        ("model",),
        "1",
        "root mean square of leave-one-out residuals in given standard deviations; in SI units without one",
        "max(1, itself)",
    ),
    "predicted": CalibrationVariable(("model", "point"), "SI", "output of the law at the point", "measured"),
    "residual": CalibrationVariable(("model", "point"), "SI", "measured minus predicted", "measured"),
    "loo_residual": CalibrationVariable(
        ("model", "point"),
        "1",
        "residual of the point in the fit without it, in its own standard deviations",
        "max(1, itself)",
        is_new=True,
    ),
    "curve": CalibrationVariable(_OF_CURVE, "SI", "output of the law over the varied input", "measured"),
    "curve_lower": CalibrationVariable(_OF_CURVE, "SI", "lower end of the band of 95 % of the curve", "measured"),
    "curve_upper": CalibrationVariable(_OF_CURVE, "SI", "upper end of the band of 95 % of the curve", "measured"),
}
# coordinates besides those of models and inputs; those that are text
CALIBRATION_TEXTS = frozenset({"parameter", "other_parameter", "output_name", "output", "determined", "specimen"})
CALIBRATION_COORDINATES = CALIBRATION_TEXTS | {"point", "grid", "measured", "sigma", "line"}


# probability of chi2 below which a law is called rejected
REJECTED_P = 1e-3
# residuals that are named
NAMED_RESIDUALS = 3
FIT_HEADINGS = ("law", "parameter", "estimate", "95 %", "chi2/dof", "p", "AICc", "weight", "loo", "status")


def fit_status(law: xr.Dataset) -> str:
    """The outcome of the fit of one law, one of FIT_STATUSES."""
    return str(law["fit_status"].attrs["flag_meanings"]).split()[int(law["fit_status"])]


def fit_rows(dataset: xr.Dataset) -> list[tuple[str, ...]]:
    """A row of text for each parameter of each law, the best law first, under FIT_HEADINGS."""
    rows: list[tuple[str, ...]] = []
    for key in map(str, dataset["model"].values):
        law = dataset.sel(model=key)
        quality = (
            number(float(law["chi2_reduced"]), 3),
            number(float(law["p_value"]), 2) if "p_value" in law and np.isfinite(law["p_value"]) else "–",
            decimals(float(law["aicc"]), 1),
            decimals(float(law["weight"]), 3),
            number(float(law["loo"]), 3),
            fit_status(law),
        )
        names = [str(name) for name in law["parameter"].values[law["identifiable"].values >= 0]]
        for position, name in enumerate(names or [""]):
            estimate = _estimate_text(law.sel(parameter=name)) if name else ("", "")
            rest = quality if position == 0 else ("",) * len(quality)
            rows.append((key if position == 0 else "", name.removeprefix(f"{key}."), *estimate, *rest))
    return rows


def _estimate_text(of_name: xr.Dataset) -> tuple[str, str]:
    """An estimate and its interval."""
    estimate = number(float(of_name["estimate"]), 5)
    if not int(of_name["identifiable"]):
        return estimate, "not identified"
    lower, upper = float(of_name["lower"]), float(of_name["upper"])
    return estimate, "–" if lower != lower else f"{number(lower, 5)} to {number(upper, 5)}"


def unidentified_notes(dataset: xr.Dataset) -> list[str]:
    """What the data do not determine, in words, one line for each law that they do not determine."""
    notes = []
    for key in map(str, dataset["model"].values):
        law = dataset.sel(model=key)
        names = [str(name) for name in law["parameter"].values[law["identifiable"].values == 0]]
        if names:
            groups = str(law["determined"].item())
            short = ", ".join(name.removeprefix(f"{key}.") for name in names)
            only = f"only {groups} is determined" if groups else "the data do not determine them"
            notes.append(f"{key}: {short}: {only}")
    return notes


def fit_notes(dataset: xr.Dataset) -> list[str]:
    """What a reader has to know besides the table, in words: one line for each."""
    best = dataset.isel(model=0)
    notes = [*_noise_notes(dataset)]
    if (
        "p_value" in best
        and float(best["p_value"]) < REJECTED_P
        and dataset.attrs.get("loss", "linear") == "linear"
    ):
        notes.append(
            f"the best law is rejected (p < {REJECTED_P:g}): try other laws, "
            'noise = "excess" with a column specimen where specimens differ, or loss = "huber" against outliers'
        )
    if residuals := largest_residuals(dataset):
        parts = [f"{residual.place} ({decimals(residual.standardized, 1)})" for residual in residuals]
        notes.append(
            f"largest residuals of {best['model'].item()}, each in the fit without the point and in its standard "
            f"deviations: {', '.join(parts)}"
        )
    return notes + unidentified_notes(dataset)


def _noise_notes(dataset: xr.Dataset) -> Iterator[str]:
    """What the noise "excess" without specimens means."""
    if dataset.attrs["noise"] != "excess" or "specimen" in dataset.coords:
        return
    yield "without a column specimen, each measured value has an excess deviation of its own"
    inputs = [
        np.asarray(coordinate.values)
        for name, coordinate in dataset.coords.items()
        if coordinate.dims == ("point",) and name not in CALIBRATION_COORDINATES
    ]
    rows = list(zip(*inputs, strict=True)) or [()] * dataset.sizes["point"]
    repeated = sum(rows.count(row) > 1 for row in rows)
    if repeated:
        yield (
            f"{repeated} of {len(rows)} points repeat the inputs of another: name their specimens in a column "
            "specimen if they share a deviation, as the intervals are too short otherwise"
        )


@dataclass(frozen=True)
class Residual:
    """The residual of a measured value in the fit without it, in its own standard deviations, and where it is."""

    place: str
    output: str
    measured: float
    standardized: float


def largest_residuals(dataset: xr.Dataset) -> list[Residual]:
    """The largest residuals of the best law in the fits without the point, the largest first."""
    if "loo_residual" not in dataset:
        return []
    best = dataset.isel(model=0)
    residuals = np.nan_to_num(np.asarray(best["loo_residual"].values, float))
    largest = np.argsort(-np.abs(residuals), kind="stable")[:NAMED_RESIDUALS]
    file = safe_text(str(dataset.attrs["data_file"]))
    several = len({*map(str, best["output"].values)}) > 1
    return [
        Residual(
            (f"{file}:{int(point['line'])}" if file else f"value {int(point['line'])}")
            + (f" {point['output'].item()}" if several else ""),
            str(point["output"].item()),
            float(point["measured"]),
            float(point["loo_residual"]),
        )
        for point in (best.isel(point=number) for number in largest.tolist())
        if np.isfinite(point["loo_residual"])
    ]


def calibration_title(dataset: xr.Dataset) -> str:
    """The title of the config; "" for its default, which is that of a sweep."""
    title = str(dataset.attrs.get("title", ""))
    return "" if title == DEFAULT_TITLE else title


def describe_data(dataset: xr.Dataset) -> str:
    """What the laws were fitted to, in a sentence without a full stop."""
    laws, points = dataset.sizes["model"], dataset.sizes["point"]
    plural = "" if laws == 1 else "s"
    return f"{laws} law{plural}, {points} measured values, noise {dataset.attrs['noise']}; the best law first"


def calibration_template(
    config: Config, models: Sequence[ForceModel], plugins: Plugins, varied: tuple[str, Array]
) -> xr.Dataset:
    """The dataset of a calibration with NaN in place of its results.

    Parameters
    ----------
    config : with the measurements
    models : the laws, in the order of the dataset
    plugins : the models that are not built in
    varied : the input of the curves and its values; "" for none
    """
    data = config.data
    assert data is not None
    plan = Plan(replace(config, models=tuple(models)), plugins)
    fitted, parameters = set(config.fits), list(config.fits)
    coordinates = {
        name: coordinate
        for name, coordinate in plan_coordinates(plan).variables.items()
        if name not in fitted and name not in data.inputs
    }
    outputs = list(data.outputs)
    rows = len(data.lines)
    units = {variable.name: variable.unit for variable in SCHEMA}
    new: dict[str, object] = {
        "parameter": ("parameter", parameters, {"long_name": "fitted parameter, by its config name"}),
        "other_parameter": ("other_parameter", parameters, {"long_name": "fitted parameter, by its config name"}),
        "point": ("point", np.arange(1, rows * len(outputs) + 1), {"long_name": "number of the measured value"}),
        "line": ("point", np.tile(data.lines, len(outputs)), {"long_name": "line of the file"}),
        "output": ("point", np.repeat(outputs, rows), {"long_name": "measured output"}),
        "measured": ("point", np.concatenate([*data.outputs.values()]), {"long_name": "measured value"}),
        "sigma": (
            "point",
            np.concatenate([data.sigma.get(name, np.full(rows, np.nan)) for name in outputs]),
            {"long_name": "standard deviation of the measured value"},
        ),
    }
    if data.specimens:
        new["specimen"] = ("point", list(data.specimens), {"long_name": "specimen of the measured value"})
    for name, column in data.inputs.items():
        new[name] = ("point", np.tile(column, len(outputs)), coordinate_attributes(plan, name))
    sizes = {"model": len(models), "parameter": len(parameters), "other_parameter": len(parameters)}
    sizes |= {"point": rows * len(outputs), "output_name": len(outputs)}
    name, grid = varied
    if name:
        sizes["grid"] = grid.size
        new["grid"] = ("grid", grid, coordinate_attributes(plan, name))
        new["output_name"] = (
            "output_name", outputs, {"long_name": "measured output", "units": " ".join(units[o] for o in outputs)},
        )  # fmt: skip
    variables = {}
    for variable, of_variable in CALIBRATION_VARIABLES.items():
        if set(of_variable.dims) <= sizes.keys() and (name or "grid" not in of_variable.dims):
            about: dict[str, object] = {"units": of_variable.unit, "long_name": of_variable.meaning}
            dtype = np.int8 if variable in ("identifiable", "fit_status") else float
            if variable == "fit_status":
                about |= {
                    "flag_values": np.arange(len(FIT_STATUSES), dtype=np.int8),
                    "flag_meanings": " ".join(FIT_STATUSES),
                }
            variables[variable] = (
                of_variable.dims,
                np.zeros([sizes[dim] for dim in of_variable.dims], dtype),
                about,
            )
    attributes = provenance_attributes(plan) | {
        "noise": data.noise,
        "loss": data.loss,
        "data_file": data.file,
        "varied": name,
        "fit_paths": json.dumps([InputName.parse(name).config_key for name in parameters]),
        "fit_bounds": json.dumps({name: list(ends) for name, ends in config.fits.items()}),
    }
    return xr.Dataset(variables, {**coordinates, **new}, attributes)
