"""The dataset of a calibration: parameters of laws, how well they fit, and the measurements."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.input_names import InputName
from ..config.load import Config
from ..config.tables import DEFAULT_TITLE
from ..contact.model import ForceModel
from ..contact.variables import OUTPUTS
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..formatting import decimals, number
from ..text import safe_text
from .schema import (
    CALIBRATION,
    STUDY_COORDINATES,
    coordinate_attributes,
    plan_coordinates,
    provenance_attributes,
    template,
    udunits,
)

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
        if coordinate.dims == ("point",) and name not in STUDY_COORDINATES["calibration"]
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
    name, grid = varied
    if name:
        new["grid"] = ("grid", grid, coordinate_attributes(plan, name))
        units = " ".join(udunits(OUTPUTS[output].unit) for output in outputs)
        new["output_name"] = ("output_name", outputs, {"long_name": "measured output", "units": units})
    attributes = provenance_attributes(plan) | {
        "noise": data.noise,
        "loss": data.loss,
        "data_file": data.file,
        "varied": name,
        "fit_paths": json.dumps([InputName.parse(name).config_key for name in parameters]),
        "fit_bounds": json.dumps({name: list(ends) for name, ends in config.fits.items()}),
    }
    coords = xr.Coordinates(coordinates | new)
    return xr.Dataset(template(CALIBRATION.values(), coords.sizes, ()), coords, attributes)
