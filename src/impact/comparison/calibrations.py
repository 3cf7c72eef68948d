"""Compare two calibrations: the same measurements, laws and bounds, and equal estimates and criteria."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.input_names import is_input
from ..errors import UsageError
from ..results.attributes import read_attribute
from ..results.calibration import fit_status
from ..results.schema import CALIBRATION
from ..text import safe_text
from .tolerances import ALL_VARIABLES, Tolerances
from .verdict import Fault, Judged, Verdict

# ten times the relative accuracy of the ends of profile intervals
DEFAULT_TOLERANCE = 1e-5
# coordinates along the measured values, which have to be equal
DATA_COORDINATES = ("output", "measured", "sigma")


def compare_calibrations(
    new: xr.Dataset,
    baseline: xr.Dataset,
    names: tuple[str, str],
    tol: float | Tolerances | None = None,
    *,
    subset: bool = False,
) -> Verdict:
    """Compare two calibrations law by law; their order does not matter.

    A value that the data do not determine is not judged. The scale of each variable is that of
    `impact.results.schema.CALIBRATION`.

    Parameters
    ----------
    new, baseline : calibrations
    names : of their files
    tol : one tolerance, relative to the scale; by default 1e-5
    subset : compare the laws that both have

    Raises
    ------
    UsageError : a tolerance for one variable, or one that is no number >= 0
    """
    tolerance = _tolerance(tol)
    faults = [*_data_faults(new, baseline)]
    keys = [list(map(str, dataset["model"].values)) for dataset in (new, baseline)]
    common = [key for key in keys[1] if key in keys[0]]
    for here, there, side in ((keys[0], keys[1], "NEW"), (keys[1], keys[0], "BASELINE")):
        only = [key for key in here if key not in there]
        if only and not subset:
            faults.append(Fault("labels", "model", f"model: in {side} only: {safe_text(', '.join(only), 400)}"))
    if not common:
        faults.append(Fault("nothing in common", "", "the two have no law in common"))
    judged: tuple[Judged, ...] = ()
    if common and not any(fault.kind == "labels" and fault.name != "model" for fault in faults):
        sides = new.sel(model=common), baseline.sel(model=common)
        judged = tuple(_judge(name, *sides, tolerance) for name in CALIBRATION if name in new and name in baseline)
    return Verdict(names[0], names[1], tuple(faults), judged, tuple(_notes(new, baseline, common)))


def _tolerance(tol: float | Tolerances | None) -> float:
    """The tolerance for all variables."""
    requested = tol if isinstance(tol, Mapping) else {} if tol is None else {ALL_VARIABLES: tol}
    for name, value in requested.items():
        if name != ALL_VARIABLES:
            text = "got a tolerance for one variable, expected one for all, such as --tol 1e-5"
            raise UsageError(f"--tol {name}: {text}")
        if not 0.0 <= value < math.inf:
            raise UsageError(f"--tol {value}: expected a number >= 0, such as --tol 1e-5")
    return float(requested.get(ALL_VARIABLES, DEFAULT_TOLERANCE))


def _data_faults(new: xr.Dataset, baseline: xr.Dataset) -> list[Fault]:
    """Differences between the measurements, the parameters, their bounds and the noise."""
    faults = []
    bounds = [read_attribute(dataset.attrs, "fit_bounds") for dataset in (new, baseline)]
    if list(bounds[0]) != list(bounds[1]):
        got, expected = (safe_text(", ".join(table), 400) for table in bounds)
        faults.append(Fault("labels", "parameter", f"parameter: {got}, in BASELINE {expected}"))
    else:
        for name in bounds[0]:
            if bounds[0][name] != bounds[1][name]:
                text = f"bounds of {name}: {bounds[0][name]}, in BASELINE {bounds[1][name]}"
                faults.append(Fault("physics config", name, safe_text(text)))
    # version 1.0 had no other loss
    for key, default in (("noise", None), ("loss", "linear")):
        a, b = (dataset.attrs.get(key, default) for dataset in (new, baseline))
        if a != b:
            faults.append(Fault("physics config", key, safe_text(f"{key} is {a}, in BASELINE {b}")))
    of_points = [
        {str(name): v for name, v in dataset.coords.items() if v.dims == ("point",)} for dataset in (new, baseline)
    ]
    inputs = [name for name in of_points[1] if name not in ("point", "line", *DATA_COORDINATES)]
    for name in (*DATA_COORDINATES, *inputs):
        first, second = (np.asarray(c[name].values) if name in c else np.array([]) for c in of_points)
        if not np.array_equal(first, second, equal_nan=first.dtype.kind == second.dtype.kind == "f"):
            faults.append(Fault("labels", name, f"{name}: the measured points differ"))
    for name in baseline.coords.keys() & new.coords.keys():
        a, b = new.coords[name], baseline.coords[name]
        if is_input(name) and a.ndim == b.ndim == 0 and a.item() != b.item():
            text = f"{name} is {a.item()}, in BASELINE {b.item()}"
            faults.append(Fault("physics config", str(name), safe_text(text)))
    return faults


def _judge(name: str, new: xr.Dataset, baseline: xr.Dataset, tolerance: float) -> Judged:
    """The comparison of one variable of the same laws."""
    variable = CALIBRATION[name]
    a, b = (np.asarray(dataset[name].values, float) for dataset in (new, baseline))
    is_exact = variable.scale == "exact"
    scale = np.broadcast_to(np.zeros(1) if is_exact else _scale(name, baseline), b.shape)
    # the value of a parameter that the data do not determine is arbitrary
    is_judged = np.isfinite(scale)
    with np.errstate(invalid="ignore"):
        difference = np.abs(a - b)
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    difference = np.where(same, 0.0, np.where(np.isnan(difference), np.inf, difference))
    allowed = tolerance * scale
    times = np.divide(difference, allowed, out=np.where(difference > 0.0, np.inf, 0.0), where=allowed > 0.0)
    times = np.where(is_judged, times, 0.0)
    index = np.unravel_index(int(times.argmax()), times.shape)
    at: dict[str, float | str] = {}
    if times.any():
        at = {
            dim: _label(baseline, dim, int(position)) for dim, position in zip(variable.dims, index, strict=True)
        }
    return Judged(
        name=name,
        judged="exact" if is_exact else f"scaled by {variable.scale}",
        tolerance=math.nan if is_exact else tolerance,
        points=int(is_judged.sum()),
        different=int((times > 1.0).sum()),
        worst=abs(float(a[index] - b[index])) if times.any() else 0.0,
        times=float(times[index]),
        at=at,
        new=float(a[index]),
        baseline=float(b[index]),
    )


def _label(dataset: xr.Dataset, dim: str, position: int) -> Any:
    label = dataset[dim].values[position] if dim in dataset.coords else position
    return str(label) if isinstance(label, str) else float(label)


def _scale(name: str, baseline: xr.Dataset) -> Array:
    """The scale of each value of a variable, NaN where it is not judged."""
    variable = CALIBRATION[name]
    values = np.abs(np.asarray(baseline[name].values, float))
    identified = baseline["identifiable"].values == 1
    match variable.scale:
        case "itself + interval":
            width = np.asarray((baseline["upper"] - baseline["lower"]).values, float)
            estimate = np.abs(np.asarray(baseline["estimate"].values, float))
            scale = np.where(identified, estimate + np.nan_to_num(width), np.nan)
        case "deviations":
            deviation = np.sqrt(np.diagonal(np.asarray(baseline[name].values, float), axis1=-2, axis2=-1))
            scale = deviation[..., :, None] * deviation[..., None, :]
        case "measured":
            measured = np.abs(np.asarray(baseline["measured"].values, float))
            outputs = baseline["output"].values
            largest = {output: measured[outputs == output].max() for output in dict.fromkeys(outputs)}
            along = outputs if "point" in variable.dims else baseline["output_name"].values
            shape = (1, -1) if "point" in variable.dims else (1, -1, 1)
            scale = np.array([largest[output] for output in along]).reshape(shape)
        case "max(1, itself)":
            scale = np.where(values > 1.0, values, 1.0)
        case _:
            scale = values
    return np.asarray(scale)


def _notes(new: xr.Dataset, baseline: xr.Dataset, common: list[str]) -> list[str]:
    """Differences that do not affect equality: versions, ranks and what a fit came to."""
    notes = []
    for name in ("rtol", "impact_version"):
        a, b = (dataset.attrs.get(name) for dataset in (new, baseline))
        if a != b:
            notes.append(safe_text(f"{name} is {a}, in BASELINE {b}", 400))
    for key in common:
        a, b = (fit_status(dataset.sel(model=key)) for dataset in (new, baseline))
        if a != b:
            notes.append(f"the fit of {key} is {a}, in BASELINE {b}")
    return notes
