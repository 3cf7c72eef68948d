"""Pictures of studies: a calibration with residuals; of uncertain inputs a band of an output, or Sobol indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..array_types import Array
from ..config.grid import SAMPLE
from ..config.measurements import SIGMA
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import argument, decimals, heading, safe_text
from ..results.calibration import calibration_title, fit_status
from ..results.schema import kind_of
from ..results.selection import chosen_laws, select, select_laws
from ..results.sensitivity import distribution_texts
from .curves import Curve, CurveData, Panel, curve_of, x_axis_fields
from .data import LegendEntries, PlotData, Points, stacked
from .kinds import Choice, Kind
from .labels import (
    NamedLaw,
    axis_text,
    mark_slow_limit,
    number_axis,
    pretty_conditions,
    split_by_law,
    symbol,
    with_model,
    words_of,
)
from .restitution import complete, requested_curve
from .slices import choose_line, conditions_of, read_line
from .style import is_geometric, tint

# laws that are drawn unless the user names them
MAX_LAWS = 5
# standard deviations that are shaded among the residuals
SHADED_RESIDUAL = 2.0
# height of the panel of residuals over that of the values
RESIDUAL_HEIGHT = 0.55
# bars of an input: name and colour
BARS = {"first": ("First-order index", "#8cbfdc"), "total": ("Total index", "#0072B2")}
BAR_HEIGHT = 0.38
# height of an input, and of what else a panel has [in]
INPUT_INCHES, PANEL_INCHES = 0.34, 0.55
MAX_PANELS = 8
# of uncertain inputs: ends of the band, and points of a distribution function that are drawn
BAND, MAX_DRAWN_PROBABILITIES = (0.05, 0.95), 401


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
    along = [name for name, each in data.coords.items() if each.dims == ("point",)]
    differing = [name for name in along if len({*data[name].values.tolist()}) > 1]
    conditions = conditions_of(data.drop_vars(differing).isel(point=0), "grid")
    return CurveData(
        "Calibration", ": ".join(filter(None, (title, conditions))), tuple(panels), not_drawn, tuple(points)
    )


def _panels(data: xr.Dataset, name: str, varied: str, choice: Choice) -> tuple[Panel, Panel]:
    """Draw an output of some laws over the varied input, "" for none, and the residuals."""
    x = np.asarray(data[varied or "point"].values, float)
    grid = np.asarray(data["grid"].values, float) if varied else x
    curves, residuals = [], []
    for part in split_by_law(data, numbered=choice.equations):
        law = part.data
        fitted = NamedLaw(", ".join(filter(None, (part.label, _remark(law)))), part.model)
        y = law["predicted"]
        band: list[xr.DataArray] = []
        if varied:
            ends = law.sel(output_name=name)
            y, *band = (ends[field] for field in ("curve", "curve_lower", "curve_upper"))
        has_band = all(np.isfinite(end).all() for end in band)
        curves.append(curve_of(fitted, grid, y, name, band=band if has_band else ()))
        residuals.append(curve_of(fitted, x, law["residual"] / _deviation(law), f"{name}_residual"))
    axis = x_axis_fields(data, varied or "point")
    axis["x_log"] = bool(varied) and _is_logarithmic(x, grid)
    values = Panel(
        y_label="Delivered restitution" if name == "e_out" else OUTPUTS[name].short_meaning.capitalize(),
        curves=tuple(curves),
        y_unit=OUTPUTS[name].unit,
        y_name=name,
        band_name="Band of 95 %",
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
    columns = {x_name: data[x_name], name: data["measured"], SIGMA: _deviation(data.isel(model=0))}
    return Points("measured", {key: tuple(np.asarray(values, float).tolist()) for key, values in columns.items()})


def _deviation(law: xr.Dataset) -> Array:
    """Compute the standard deviation of each point, from the noise of the calibration."""
    sigma = np.asarray(law[SIGMA].values, float)
    known = np.where(np.isfinite(sigma), sigma, 1.0)
    scale = np.sqrt(float(law["chi2_reduced"])) if law.attrs.get("noise") == "scale" else 1.0
    deviation: Array = np.hypot(known, float(law["excess"])) * scale
    return deviation


@dataclass(frozen=True, kw_only=True)
class BarPanel(NamedLaw):
    """The indices of one model or pair: by index the values and the ends of their intervals."""

    friction: str
    values: Mapping[str, tuple[float, ...]]
    lower: Mapping[str, tuple[float, ...]]
    upper: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class BarData(PlotData):
    """The data of a picture of Sobol indices: a panel for each model or pair, with bars for each input."""

    title: str
    conditions: str
    inputs: tuple[str, ...]
    panels: tuple[BarPanel, ...]
    not_drawn: tuple[str, ...] = ()

    @property
    def names(self) -> set[str]:
        """The axis, inputs and models whose text a user can replace."""
        return {"index", *self.inputs, *self.laws}

    def long_table(self) -> pd.DataFrame:
        """Make a row for each bar."""
        return stacked(
            {
                **panel.columns,
                "input": self.inputs,
                "index": index,
                "value": panel.values[index],
                "lower": panel.lower[index],
                "upper": panel.upper[index],
            }
            for panel in self.panels
            for index in BARS
        )

    def wide_table(self) -> pd.DataFrame:
        """Make a row for each input, with columns for each index of each model and the ends of its interval."""
        columns: dict[str, tuple[str | float, ...]] = {"input": self.inputs}
        for panel in self.panels:
            for index in BARS:
                for end, of_index in (("", panel.values), ("_lower", panel.lower), ("_upper", panel.upper)):
                    columns[heading(f"{index}{end}", panel.law)] = of_index[index]
        return pd.DataFrame(columns)

    def place_panels(self, figure: Figure, width: float) -> tuple[list[Axes], float]:
        all_axes = figure.subplots(self.panel_count, sharex=True, squeeze=False)
        return list(all_axes.ravel()), self.panel_count * (PANEL_INCHES + INPUT_INCHES * len(self.inputs)) + 0.3

    def draw(self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None) -> LegendEntries:
        entries: dict[str, Artist] = {}
        positions = np.arange(len(self.inputs))[::-1]
        for axes, panel in zip(all_axes, self.panels, strict=True):
            for offset, (index, (name, colour)) in zip((0.5, -0.5), BARS.items(), strict=True):
                lower, upper = np.asarray(panel.lower[index]), np.asarray(panel.upper[index])
                heights = positions + offset * BAR_HEIGHT
                bars = axes.barh(heights, panel.values[index], BAR_HEIGHT, color=colour)
                # an estimate may be outside of its interval, which ends at 0 or 1
                axes.errorbar(
                    (lower + upper) / 2.0,
                    heights,
                    xerr=(upper - lower) / 2.0,
                    fmt="none",
                    ecolor=tint(1.0),
                    elinewidth=0.9,
                    capsize=2.5,
                    capthick=0.9,
                )
                entries.setdefault(name, bars.patches[0])
            axes.set_title(labels.get(panel.law) or pretty_conditions(panel.label), loc="left", fontsize="medium")
            inputs = [labels.get(name) or (symbol(name) if "." not in name else name) for name in self.inputs]
            axes.set_yticks(positions, inputs)
            axes.axvline(0.0, color=tint(1.0), linewidth=0.8)
            axes.grid(visible=False, axis="y")
            number_axis(axes.xaxis)
        # the panels share their limits, which no longer follow further bars once they are set
        all_axes[0].set_xlim(left=min(0.0, all_axes[0].get_xlim()[0]))
        all_axes[-1].set_xlabel(axis_text("Sobol index", "index", "1", labels))
        return [(artist, name) for name, artist in entries.items()]


def sensitivity_bars(dataset: xr.Dataset, choice: Choice) -> BarData:
    """Read the first-order and total indices of each uncertain input, with their intervals."""
    if kind_of(dataset) != "sensitivity study":
        raise UsageError("this result is no sensitivity study: impact sensitivity -o writes those")
    data = select(select_laws(dataset, choice.models, choice.frictions), choice.sel or {}).load()
    laws = {"model", "friction"} & {*data["mean"].dims}
    data = data.isel({dim: 0 for dim in data.dims if dim not in (*laws, "input", "quantile")})
    panels: list[BarPanel] = []
    not_drawn: list[str] = []
    for law in split_by_law(data, numbered=choice.equations):
        if not np.isfinite(law.data["total"].values).any():
            reason = "which does not depend on the inputs"
            if int(law.data["failed"]):
                reason = "samples failed"
            elif np.isnan(law.data["mean"]):
                reason = "which has none"
            not_drawn.append(f"{law.law}, {reason}")
        elif len(panels) == MAX_PANELS:
            not_drawn.append(f"{law.law}, beyond {MAX_PANELS} laws")
        else:
            ends = {"values": "", "lower": "_lower", "upper": "_upper"}
            indices = {
                field: {name: tuple(law.data[f"{name}{end}"].values.ravel().tolist()) for name in BARS}
                for field, end in ends.items()
            }
            panels.append(BarPanel(law.label, law.model, friction=law.friction, **indices))
    if not panels:
        raise UsageError(f"nothing to draw: {'; '.join(not_drawn)}")
    inputs = tuple(str(name).removeprefix("sweep.").removeprefix("model.") for name in np.ravel(data["input"]))
    meaning = OUTPUTS[data.attrs["of"]].short_meaning
    conditions = *distribution_texts(data), conditions_of(data.drop_vars("quantile"))
    return BarData(
        f"Which uncertain input matters: {meaning}",
        with_model(", ".join(filter(None, conditions)), data, numbered=choice.equations),
        inputs,
        tuple(panels),
        tuple(not_drawn),
    )


def uncertainty_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Compute an output's median and band over an axis, or, without one, its distribution function."""
    if SAMPLE not in dataset.dims:
        raise UsageError("this result has no samples; sweep a config with distributions and a table [design]")
    name = choice.variable or "e_out"
    if name not in dataset.data_vars:
        raise UsageError(f'no variable "{name}" in this result')
    x = choice.x or choose_axis(select(dataset, choice.sel or {})).x
    if x in dataset.coords and dataset[x].dims == (SAMPLE,):
        raise UsageError(f"{argument('x', x)}: is an uncertain input, expected another axis")
    keep = (SAMPLE, "friction") if "friction" in dataset[name].dims else (SAMPLE,)
    line = read_line(dataset, replace(choice, x=x or SAMPLE), name, keep=keep)
    not_drawn, unit = line.not_drawn, OUTPUTS[name].unit
    meaning = "Delivered restitution" if name == "e_out" else words_of(line.data[name].attrs, name).capitalize()
    curves: list[Curve] = []
    for law in map(mark_slow_limit, split_by_law(line.data, numbered=choice.equations)):
        samples = np.asarray(law.data[name].transpose(..., SAMPLE).values, float)
        if x is None:
            # the distribution function
            count = min(samples.size, MAX_DRAWN_PROBABILITIES)
            share = (np.arange(count) + 0.5) / count
            quantiles = np.quantile(samples, share, method="hazen")
            curves.append(curve_of(law, quantiles, share, "share"))
        else:
            # NaN where a sample has no result
            least, median, largest = np.quantile(samples, (BAND[0], 0.5, BAND[1]), axis=-1)
            curves.append(curve_of(law, law.data[x], median, name, band=(least, largest)))
        failed = int(np.isnan(samples).sum())
        not_drawn += (f"{law.law}, where {failed:,} samples have no result",) if failed else ()
    if not any(np.isfinite([curve.x, curve.y]).all(axis=0).any() for curve in curves):
        raise UsageError(f"nothing to draw: {'; '.join(not_drawn)}")
    x_axis: dict[str, Any] = {}
    if x is None:
        panel = Panel("", "Share of samples below", tuple(curves), y_name="share")
        x_axis = {"x_name": name, "x_label": meaning, "x_unit": unit, "x_log": False, "joined": True}
    else:
        # the requested restitution, unless it depends on the sample
        e = line.data.coords["e"] if name == "e_out" and "e" in line.data.coords else None
        has_e = e is not None and SAMPLE not in e.dims and np.isfinite(e.values).all()
        requested = requested_curve(line.data, line.coordinate) if has_e else []
        band_name = "5 to 95 % of the samples"
        panel = Panel("", meaning, (*requested, *curves), y_unit=unit, y_name=name, band_name=band_name)
    title = f"Uncertain inputs: {meaning[0].lower()}{meaning[1:]}"
    line = line._replace(not_drawn=not_drawn)
    return complete(line, title, [panel], choice, distribution_texts(dataset), **x_axis)


def choose_axis(dataset: xr.Dataset, keys: Sequence[str] | None = None) -> Choice:
    """Choose to draw over e, else over the first axis of several numbers, which an uncertain input is not."""
    return choose_line(
        dataset.drop_vars([name for name, each in dataset.coords.items() if SAMPLE in each.dims]), keys
    )


CALIBRATION = Kind(
    "Measured values, the laws that fit them with their bands of 95 %, and residuals.",
    calibration_curves,
    lambda dataset, keys: Choice(),
    along=(),
    source="calibration",
)
SENSITIVITY = Kind(
    "First-order and total Sobol indices of the uncertain inputs, with intervals of 95 %.",
    sensitivity_bars,
    lambda dataset, keys: Choice(models=keys),
    along=(),
    source="sensitivity study",
)
UNCERTAINTY = Kind(
    "Delivered restitution, or another output: median, and 5 to 95 % of the samples of uncertain inputs.",
    uncertainty_curves,
    choose_axis,
    along=("x", SAMPLE),
    source="samples",
)
