"""The picture of a calibration: measured values, the curves of the best laws with their bands, and residuals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..array_types import Array
from ..contact.variables import OUTPUTS
from ..errors import UsageError, did_you_mean
from ..formatting import decimals
from ..results.calibration import calibration_title, fit_status
from ..results.kinds import is_calibration
from ..results.schema import plain_unit
from ..text import safe_text
from .curves import Curve, CurveData, Panel, model_label
from .data import SIGMA, Points
from .labels import words_of
from .slices import conditions_of
from .style import is_geometric

if TYPE_CHECKING:
    import xarray as xr

    from .kinds import Choice

# laws that are drawn unless the user names them
MAX_LAWS = 5
BAND_NAME = "Band of 95 %"
# standard deviations that are shaded among the residuals
SHADED_RESIDUAL = 2.0
# height of the panel of residuals over that of the values
RESIDUAL_HEIGHT = 0.55


def calibration_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Measured values over the varied input, the best laws, and their residuals in standard deviations.

    Without an input that varies alone, the values are over their number.

    Raises
    ------
    UsageError : the dataset is no calibration, an option does not apply to one, or a law is not in it
    """
    if not is_calibration(dataset):
        raise UsageError("this result is no calibration: impact calibrate writes those")
    for option, value in (("--sel", choice.sel), ("--x", choice.x), ("--y", choice.y)):
        if value:
            raise UsageError(f"{option}: does not apply to the picture of a calibration")
    keys = [str(key) for key in dataset["model"].values]
    for key in choice.models or ():
        if key not in keys:
            raise UsageError(f'no model "{key}" in this calibration; {did_you_mean(key, keys)}')
    shown = [key for key in keys if key in choice.models] if choice.models else keys[:MAX_LAWS]
    not_drawn = tuple(f"{key}, rank {keys.index(key) + 1}" for key in keys if key not in shown)
    data = dataset.load().sel(model=shown)
    best = float(dataset["aicc"][0])
    varied = str(dataset.attrs.get("varied", ""))
    panels: list[Panel] = []
    points: list[Points] = []
    for name in dict.fromkeys(map(str, data["output"].values)):
        of_output = data.isel(point=np.flatnonzero(data["output"].values == name))
        for panel, measured in _panels(of_output, name, varied, choice, best):
            panels.append(panel)
            points.append(measured)
    title = safe_text(calibration_title(dataset), 140)
    conditions = conditions_of(data.drop_vars(["grid", varied], errors="ignore").isel(point=0), "grid")
    return CurveData(
        "Calibration", ": ".join(filter(None, (title, conditions))), tuple(panels), not_drawn, tuple(points)
    )


def _panels(data: xr.Dataset, name: str, varied: str, choice: Choice, best: float) -> list[tuple[Panel, Points]]:
    """The panel of an output and that of its residuals, with the measured points of each.

    Parameters
    ----------
    data : the laws that are drawn, at the points of the output
    name : of the output
    varied : the input of the curves; "" for none
    choice : see `calibration_curves`
    best : AICc of the best law
    """
    x_name = varied or "point"
    x, measured = (np.asarray(data[key].values, float) for key in (x_name, "measured"))
    sigma = np.asarray(data[SIGMA].values, float)
    grid = np.asarray(data["grid"].values, float) if varied else x
    output = OUTPUTS[name]
    curves, residuals = [], []
    for index, key in enumerate(map(str, data["model"].values)):
        law = data.isel(model=index)
        status = fit_status(law)
        # a difference between the best law and others; a law alone has none
        difference = float(law["aicc"]) - best
        remark = status.replace("_", " ")
        if status in ("ok", "at_limit"):
            remark = f"ΔAICc = {decimals(difference, 1)}" if np.isfinite(difference) else ""
        label = ", ".join(filter(None, (model_label(law, numbered=choice.equations), remark)))
        if varied:
            of_law = law.sel(output_name=name)
            y, least, largest = (of_law[key].values.tolist() for key in ("curve", "curve_lower", "curve_upper"))
        else:
            y, least, largest = law["predicted"].values.tolist(), [], []
        has_band = bool(np.isfinite(least).all()) and bool(least)
        curves.append(
            Curve(
                label, key, tuple(grid.tolist()), tuple(y), variable=name,
                least=tuple(least) if has_band else (), largest=tuple(largest) if has_band else (),
            )
        )  # fmt: skip
        deviation = _deviation(law, sigma)
        scaled = (law["residual"].values / deviation).tolist()
        residuals.append(Curve(label, key, tuple(x.tolist()), tuple(scaled), variable=f"{name}_residual"))
    axis: dict[str, Any] = {
        "x_name": x_name,
        "x_label": words_of(data[x_name].attrs, x_name),
        "x_unit": safe_text(plain_unit(str(data[x_name].attrs.get("units", "1")))),
        "x_log": is_geometric(grid) if varied and not choice.log else "x" in choice.log and bool((x > 0.0).all()),
    }
    values = Panel(
        y_label="Delivered restitution" if name == "e_out" else output.meaning.capitalize(),
        curves=tuple(curves),
        y_unit=output.unit,
        y_name=name,
        y_log="y" in choice.log,
        band_name=BAND_NAME,
        **axis,
    )
    rest = Panel(
        y_label="Residual in σ", curves=tuple(residuals), bands=(SHADED_RESIDUAL,),
        y_name="residual", joined=False, height=RESIDUAL_HEIGHT, **axis,
    )  # fmt: skip
    # the error bars are those of the best law: with some noise they depend on the fit
    columns = {x_name: x, name: measured, SIGMA: _deviation(data.isel(model=0), sigma)}
    return [(values, Points("measured", columns)), (rest, Points("", {}))]


def _deviation(law: xr.Dataset, sigma: Array) -> Array:
    """The standard deviation of each point, as the noise of the calibration has it."""
    known = np.where(np.isfinite(sigma), sigma, 1.0)
    scale = np.sqrt(float(law["chi2_reduced"])) if law.attrs.get("noise") == "scale" else 1.0
    deviation: Array = np.hypot(known, float(law["excess"])) * scale
    return deviation
