"""The picture of a calibration: measured values, the curves of the best laws with their bands, and residuals."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.measurements import SIGMA
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import argument, decimals, law_name, safe_text
from ..results.calibration import calibration_title, fit_status
from ..results.schema import kind_of
from ..results.selection import chosen_laws
from .curves import CurveData, Panel, curve_of, x_axis_fields
from .data import Points
from .kinds import Choice, Kind
from .labels import NamedLaw, friction_text, model_label
from .slices import conditions_of, scalars_of
from .style import is_geometric

# laws that are drawn unless the user names them
MAX_LAWS = 5
BAND_NAME = "Band of 95 %"
# standard deviations that are shaded among the residuals
SHADED_RESIDUAL = 2.0
# height of the panel of residuals over that of the values
RESIDUAL_HEIGHT = 0.55


def calibration_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read measured values over the varied input or their number, the best laws, and their residuals."""
    if kind_of(dataset) != "calibration":
        raise UsageError("this result is no calibration: impact calibrate writes those")
    if choice.sel:
        raise UsageError(f"{argument('sel')}: does not apply to the picture of a calibration")
    keys = chosen_laws(None, dataset)
    wanted = chosen_laws(choice.models, dataset) if choice.models else keys[:MAX_LAWS]
    shown = [key for key in keys if key in wanted]
    not_drawn = tuple(f"{key}, rank {keys.index(key) + 1}" for key in keys if key not in shown)
    # a difference between the best law and others; a law alone has none
    data = dataset.load().assign(difference=dataset["aicc"] - float(dataset["aicc"][0])).sel(model=shown)
    varied = str(dataset.attrs.get("varied", ""))
    panels: list[Panel] = []
    points: list[Points] = []
    for name in dict.fromkeys(map(str, data["output"].values)):
        output_data = data.isel(point=np.flatnonzero(data["output"].values == name))
        panels += _panels(output_data, name, varied, choice)
        points += [_measured_points(output_data, name, varied or "point"), Points("", {})]
    title = safe_text(calibration_title(dataset), 140)
    conditions = conditions_of(data.drop_vars(["grid", varied], errors="ignore").isel(point=0), "grid")
    return CurveData(
        "Calibration", ": ".join(filter(None, (title, conditions))), tuple(panels), not_drawn, tuple(points)
    )


def _panels(data: xr.Dataset, name: str, varied: str, choice: Choice) -> tuple[Panel, Panel]:
    """Draw an output of some laws over the varied input, "" for none, and the residuals."""
    x = np.asarray(data[varied or "point"].values, float)
    grid = np.asarray(data["grid"].values, float) if varied else x
    curves, residuals = [], []
    for index, key in enumerate(map(str, data["model"].values)):
        law = data.isel(model=index)
        fitted = NamedLaw(", ".join(filter(None, (_law_label(law, choice), _remark(law)))), key)
        y = law["predicted"]
        band: list[xr.DataArray] = []
        if varied:
            ends = law.sel(output_name=name)
            y, *band = (ends[field] for field in ("curve", "curve_lower", "curve_upper"))
        has_band = all(np.isfinite(end).all() for end in band)
        curves.append(curve_of(fitted, grid, y, name, band=band if has_band else ()))
        residuals.append(curve_of(fitted, x, law["residual"] / _deviation(law), f"{name}_residual"))
    axis = x_axis_fields(data[varied or "point"])
    axis["x_log"] = bool(varied) and _is_logarithmic(x, grid)
    values = Panel(
        y_label="Delivered restitution" if name == "e_out" else OUTPUTS[name].short_meaning.capitalize(),
        curves=tuple(curves),
        y_unit=OUTPUTS[name].unit,
        y_name=name,
        band_name=BAND_NAME,
        **axis,
    )
    residual = Panel(
        y_label="Residual in σ",
        curves=tuple(residuals),
        bands=(SHADED_RESIDUAL,),
        y_name="residual",
        joined=False,
        height=RESIDUAL_HEIGHT,
        **axis,
    )
    # residuals have both signs
    return values.with_log_axes(choice.log), residual.with_log_axes(choice.log.strip("y"))


def _law_label(law: xr.Dataset, choice: Choice) -> str:
    """Write the name of a law, or of a pair of laws."""
    label = model_label(law, numbered=choice.equations)
    if "friction" not in law.coords:
        return label
    key = str(law["friction"].item())
    return law_name(label, friction_text(key, scalars_of(law, f"friction.{key}.")))


def _is_logarithmic(measured: Array, grid: Array) -> bool:
    """Whether the curve is, or the measured values over a decade or more are, spaced by their logarithm."""
    low, median, high = map(float, np.quantile(measured, [0.0, 0.5, 1.0]))
    # the middle value is nearer to the geometric mean of both ends than to the arithmetic one
    has_more_small = median**2 < abs(low * high) ** 0.5 * (low + high) / 2.0
    return is_geometric(grid) or (0.0 < 10.0 * low <= high and has_more_small)


def _remark(law: xr.Dataset) -> str:
    """Write how well a law fits, or why it does not."""
    status, difference = fit_status(law), float(law["difference"])
    if status not in ("ok", "at_limit"):
        return status.replace("_", " ")
    return f"ΔAICc = {decimals(difference, 1)}" if np.isfinite(difference) else ""


def _measured_points(data: xr.Dataset, name: str, x_name: str) -> Points:
    """Read the measured values; error bars that depend on the fit are those of the best law."""
    columns: dict[str, Any] = {
        x_name: data[x_name].values,
        name: data["measured"].values,
        SIGMA: _deviation(data.isel(model=0)),
    }
    return Points("measured", {key: tuple(np.asarray(values, float).tolist()) for key, values in columns.items()})


def _deviation(law: xr.Dataset) -> Array:
    """Compute the standard deviation of each point, from the noise of the calibration."""
    sigma = np.asarray(law[SIGMA].values, float)
    known = np.where(np.isfinite(sigma), sigma, 1.0)
    scale = np.sqrt(float(law["chi2_reduced"])) if law.attrs.get("noise") == "scale" else 1.0
    deviation: Array = np.hypot(known, float(law["excess"])) * scale
    return deviation


CALIBRATION = Kind(
    "calibration",
    "Measured values, the laws that fit them with their bands of 95 %, and residuals.",
    calibration_curves,
    lambda dataset, keys: Choice(),
    along=(),
    source="calibration",
)
