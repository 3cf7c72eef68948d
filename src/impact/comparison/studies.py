"""Align two studies: calibrations law by law, boards of `impact conform` engine by engine and check by check."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.input_names import is_input
from ..formatting import safe_text
from ..results.attributes import read_attribute
from ..results.calibration import fit_status
from ..results.schema import BOARD, CALIBRATION
from .align import MAX_NAMED_LABELS, Alignment
from .verdict import Difference

# coordinates along the measured values, which have to be equal
DATA_COORDINATES = ("output", "measured", "sigma")


def align_calibrations(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two calibrations by their laws, whose order does not matter."""
    faults = _data_faults(new, baseline)
    is_same_data = all(fault.kind != "labels" for fault in faults)
    common = common_labels(new, baseline, "model")
    for study, side in ((new, "NEW"), (baseline, "BASELINE")):
        only = ", ".join(key for key in map(str, study["model"].values) if key not in common)
        if only and not subset:
            faults.append(Difference("labels", "model", f"model: in {side} only: {safe_text(only, 400)}"))
    if not common:
        faults.append(Difference("nothing in common", "", "the two have no law in common"))
    new, baseline = new.sel(model=common), baseline.sel(model=common)
    names = [name for name in CALIBRATION if name in new and name in baseline] if common and is_same_data else []
    scales = {name: _scale(name, baseline) for name in names}
    return _align(new, baseline, scales, faults)


def align_boards(new: xr.Dataset, baseline: xr.Dataset, *, subset: bool) -> Alignment:
    """Align two boards by the labels of engines and checks, whose order does not matter."""
    faults = []
    suites = [dataset.attrs["suite"] for dataset in (new, baseline)]
    if suites[0] != suites[1]:
        text = safe_text(f"suite is {suites[0]}, in BASELINE {suites[1]}")
        faults.append(Difference("physics config", "suite", text))
    common = {dim: common_labels(new, baseline, dim) for dim in ("engine", "check")}
    for dim in common:
        for study, side in ((new, "NEW"), (baseline, "BASELINE")):
            only = [label for label in map(str, study[dim].values) if label not in common[dim]]
            if only and not subset:
                named = ", ".join(only[:MAX_NAMED_LABELS]) + (", ..." if len(only) > MAX_NAMED_LABELS else "")
                text = f"{dim}: {len(only)} of {study.sizes[dim]} in {side} only: {named}"
                faults.append(Difference("labels", dim, safe_text(text, 400)))
        if not common[dim]:
            faults.append(Difference("nothing in common", dim, f"the two have no {dim} in common"))
    names = list(BOARD) if all(common.values()) and suites[0] == suites[1] else []
    new, baseline = (dataset.sel(common) for dataset in (new, baseline))
    # all numbers are dimensionless; what is not supported in one of them differs by its status
    scales = {name: np.maximum(1.0, np.abs(np.nan_to_num(baseline[name].values.astype(float)))) for name in names}
    return _align(new, baseline, scales, faults)


def version_notes(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[str]:
    """Name the engines whose version or kind differs."""
    for engine in common_labels(new, baseline, "engine"):
        for name in ("engine_version", "engine_kind"):
            a, b = (str(dataset[name].sel(engine=engine).item()) for dataset in (new, baseline))
            if a != b:
                word = name.removeprefix("engine_")
                yield safe_text(f"the {word} of {engine} is {a or 'unknown'}, in BASELINE {b or 'unknown'}")


def _align(
    new: xr.Dataset, baseline: xr.Dataset, scales: Mapping[str, Array], faults: Sequence[Difference]
) -> Alignment:
    """Align two studies whose points are in the same order; the variables that have a scale are compared."""
    labels = {dim: baseline.variables[dim] for dim in baseline.dims if dim in baseline.coords}
    coords = xr.Coordinates(labels, indexes={})
    a, b = (xr.Dataset({name: study.variables[name] for name in scales}, coords) for study in (new, baseline))
    dims = {name: tuple(map(str, baseline[name].dims)) for name in scales}
    return Alignment(a, b, dims, tuple(faults), scales)


def common_labels(new: xr.Dataset, baseline: xr.Dataset, dim: str) -> list[str]:
    """List the laws, engines or checks that two studies have, in the order of the baseline."""
    return [label for label in map(str, baseline[dim].values) if label in new[dim].values]


def _data_faults(new: xr.Dataset, baseline: xr.Dataset) -> list[Difference]:
    """List the differences between the measurements, the parameters, their bounds and the noise."""
    faults: list[Difference] = []

    def add(name: str, label: str, a: Any, b: Any) -> None:
        faults.append(Difference("physics config", name, safe_text(f"{label} {a}, in BASELINE {b}")))

    bounds = [read_attribute(dataset.attrs, "fit_bounds") for dataset in (new, baseline)]
    if list(bounds[0]) != list(bounds[1]):
        got, expected = (safe_text(", ".join(table), 400) for table in bounds)
        faults.append(Difference("labels", "parameter", f"parameter: {got}, in BASELINE {expected}"))
    else:
        for name in bounds[0]:
            if bounds[0][name] != bounds[1][name]:
                add(name, f"bounds of {name}:", bounds[0][name], bounds[1][name])
    # version 1.0 had no other loss
    for key, default in (("noise", None), ("loss", "linear")):
        a, b = (dataset.attrs.get(key, default) for dataset in (new, baseline))
        if a != b:
            add(key, f"{key} is", a, b)
    columns = [
        {str(name): v.values for name, v in dataset.coords.items() if v.dims == ("point",)}
        for dataset in (new, baseline)
    ]
    inputs = [name for name in columns[1] if name not in ("point", "line", *DATA_COORDINATES)]
    for name in (*DATA_COORDINATES, *inputs):
        first, second = (column.get(name, np.array([])) for column in columns)
        if not np.array_equal(first, second, equal_nan=first.dtype.kind == second.dtype.kind == "f"):
            faults.append(Difference("labels", name, f"{name}: the measured points differ"))
    for name in map(str, baseline.coords.keys() & new.coords.keys()):
        scalars = new.coords[name], baseline.coords[name]
        if is_input(name) and scalars[0].ndim == scalars[1].ndim == 0 and scalars[0].item() != scalars[1].item():
            add(name, f"{name} is", scalars[0].item(), scalars[1].item())
    return faults


def _scale(name: str, baseline: xr.Dataset) -> Array:
    """Compute the scale of each value of a variable; NaN if the data do not determine the value."""
    variable, values = CALIBRATION[name], abs(baseline[name])
    match variable.scale:
        case "exact":
            scale = xr.zeros_like(values)
        case "itself + interval":
            interval = (baseline["upper"] - baseline["lower"]).fillna(0.0)
            scale = (abs(baseline["estimate"]) + interval).where(baseline["identifiable"] == 1)
        case "deviations":
            deviation = np.sqrt(np.diagonal(values, axis1=-2, axis2=-1))
            scale = values.copy(data=deviation[..., :, None] * deviation[..., None, :])
        case "measured":
            largest = abs(baseline["measured"]).groupby("output").max()
            scale = largest.sel(output=baseline["output" if "point" in variable.dims else "output_name"])
        case "max(1, itself)":
            scale = values.where(values > 1.0, 1.0)
        case _:
            scale = values
    return np.asarray(scale.where(np.isfinite(scale)).broadcast_like(values).transpose(*values.dims), float)


def fit_notes(new: xr.Dataset, baseline: xr.Dataset) -> Iterator[str]:
    """Name the laws whose fits ended with another status."""
    for key in common_labels(new, baseline, "model"):
        a, b = (fit_status(dataset.sel(model=key)) for dataset in (new, baseline))
        if a != b:
            yield f"the fit of {key} is {a}, in BASELINE {b}"
