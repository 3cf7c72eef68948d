"""Pictures of uncertain inputs: bands of an output over an axis, and Sobol indices as bars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from ..array_types import Array
from ..config.grid import SAMPLE
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import heading
from ..results.kinds import is_sensitivity
from ..results.schema import plain_unit
from ..results.selection import model_positions, select
from ..results.sensitivity import distribution_texts
from ..text import safe_text
from .curves import Curve, CurveData, Panel, model_label
from .labels import axis_text, number_axis, pretty_conditions, symbol, words_of
from .slices import conditions_of, read, take_line
from .style import is_geometric

if TYPE_CHECKING:
    import xarray as xr

    from .kinds import Choice

# ends of the band, and points of a distribution function that are drawn
BAND, MAX_DRAWN_PROBABILITIES = (0.05, 0.95), 401
BAND_NAME = "5 to 95 % of the samples"
NEEDS_SAMPLES = "this result has no samples; sweep a config with distributions and a table [design]"
# bars of an input, and their colours
BARS = {"first": "First-order index", "total": "Total index"}
BAR_COLOURS = {"first": "#8cbfdc", "total": "#0072B2"}
BAR_HEIGHT = 0.38
# height of an input, and of what else a panel has [in]
INPUT_INCHES, PANEL_INCHES = 0.34, 0.55
MAX_PANELS = 8


def uncertainty_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """The median of an output over an axis with the band of 90 % of the samples, for each model.

    Without another axis it is the distribution function of the output.

    Parameters
    ----------
    dataset : a result with samples
    choice : which part of it, and its variable, by default e_out

    Raises
    ------
    UsageError : it has no samples, or does not contain what `choice` selects
    """
    if SAMPLE not in dataset.dims:
        raise UsageError(NEEDS_SAMPLES)
    name = choice.variable or "e_out"
    if name not in dataset.data_vars:
        raise UsageError(f'no variable "{name}" in this result')
    x = choice.x
    if x is None:
        chosen = select(dataset, choice.sel or {})
        lines = [str(key) for key, coord in chosen.coords.items() if coord.ndim == 1 and coord.dtype.kind == "f"]
        free = [key for key in lines if chosen[key].dims[0] not in (SAMPLE, "model") and chosen[key].size > 1]
        x = "e" if "e" in free else next(iter(free), None)
    elif x in dataset.coords and dataset[x].dims == (SAMPLE,):
        raise UsageError(f"--x {x}: is an uncertain input, expected another axis")
    line, x_name, not_drawn = take_line(dataset, x or SAMPLE, choice.sel, choice.models, keep=(SAMPLE,))
    line = read(line, [name])
    variable = OUTPUTS[name]
    unit = variable.unit
    meaning = "Delivered restitution" if name == "e_out" else variable.meaning.capitalize()
    curves: list[Curve] = []
    for index in range(line.sizes["model"]):
        law = line.isel(model=index)
        key, label = str(law["model"].item()), model_label(law, numbered=choice.equations)
        if x is None:
            curves.append(_distribution_curve(label, key, np.asarray(law[name].values, float), name))
        else:
            samples = np.asarray(law[name].transpose(*law[x].dims, SAMPLE).values, float)
            curves.append(_band_curve(label, key, np.asarray(law[x].values, float), samples, name))
    failed = {
        curve.model or "": int(np.isnan(np.asarray(line[name].sel(model=curve.model))).sum()) for curve in curves
    }
    not_drawn += tuple(f"{key}, where {count:,} samples have no result" for key, count in failed.items() if count)
    if x is None:
        panel = Panel(
            meaning,
            "Share of samples below",
            tuple(curves),
            x_unit=unit,
            x_name=name,
            y_name="share",
            x_log="x" in choice.log,
        )
    else:
        requested = _requested(line, x) if name == "e_out" else []
        values = np.asarray(line[x].values, float)
        panel = Panel(
            words_of(line[x].attrs, x),
            meaning,
            (*requested, *curves),
            x_unit=safe_text(plain_unit(str(line[x].attrs.get("units", "1")))),
            y_unit=unit,
            x_log=is_geometric(values) or ("x" in choice.log and bool((values > 0.0).all())),
            y_log="y" in choice.log,
            x_name=x_name,
            y_name=name,
            band_name=BAND_NAME,
        )
    title = safe_text(str(dataset.attrs.get("title", "")), 140)
    conditions = ", ".join(filter(None, (", ".join(distribution_texts(dataset)), conditions_of(line, x_name))))
    return CurveData(
        f"Uncertain inputs: {meaning[0].lower()}{meaning[1:]}",
        ": ".join(filter(None, (title, conditions))),
        (panel,),
        not_drawn,
    )


def _band_curve(label: str, key: str, x: Array, samples: Array, name: str) -> Curve:
    """The median and the band of samples of shape (x, samples); NaN where a sample has no result."""
    least, median, largest = np.quantile(samples, (BAND[0], 0.5, BAND[1]), axis=1)
    curve = Curve(label, key, tuple(x.tolist()), tuple(median.tolist()), variable=name)
    return replace(curve, least=tuple(least.tolist()), largest=tuple(largest.tolist()))


def _distribution_curve(label: str, key: str, samples: Array, name: str) -> Curve:
    """The distribution function of samples, at no more than MAX_DRAWN_PROBABILITIES of them."""
    count = min(samples.size, MAX_DRAWN_PROBABILITIES)
    share = (np.arange(count) + 0.5) / count
    drawn = np.quantile(samples, share, method="hazen")
    return Curve(label, key, tuple(drawn.tolist()), tuple(share.tolist()), variable=name)


def _requested(line: xr.Dataset, x: str) -> list[Curve]:
    """The requested restitution, where it does not depend on the sample."""
    if "e" not in line.coords or SAMPLE in line["e"].dims or not np.isfinite(line["e"].values).all():
        return []
    values = np.asarray(line[x].values, float)
    e = np.broadcast_to(np.asarray(line["e"].values, float), values.shape)
    return [Curve("Requested", None, tuple(values.tolist()), tuple(e.tolist()), variable="e")]


@dataclass(frozen=True)
class BarPanel:
    """The indices of one model: its name and key, and by index the values and the ends of their intervals."""

    label: str
    model: str
    values: Mapping[str, tuple[float, ...]]
    lower: Mapping[str, tuple[float, ...]]
    upper: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class BarData:
    """The data of a picture of Sobol indices: a panel for each model, with bars for each input."""

    title: str
    conditions: str
    inputs: tuple[str, ...]
    panels: tuple[BarPanel, ...]
    not_drawn: tuple[str, ...] = ()

    columns = ("model", "input", "index", "value", "lower", "upper")

    def rows(self) -> Iterator[tuple[str | float, ...]]:
        """One row for each bar; for the names of the columns see `columns`."""
        for panel in self.panels:
            for index in BARS:
                for numbers in zip(
                    self.inputs, panel.values[index], panel.lower[index], panel.upper[index], strict=True
                ):
                    yield (panel.model, numbers[0], index, *numbers[1:])

    def table(self) -> dict[str, Any]:
        """The inputs, and a column for each index of each model and each end of its interval."""
        columns: dict[str, Any] = {"input": self.inputs}
        for panel in self.panels:
            for index in BARS:
                for suffix, of_index in (("", panel.values), ("_lower", panel.lower), ("_upper", panel.upper)):
                    columns[heading(f"{index}{suffix}", panel.model, "1")] = of_index[index]
        return columns

    @property
    def names(self) -> set[str]:
        """The axis, inputs and models whose text a user can replace."""
        return {"index", *self.inputs, *(panel.model for panel in self.panels)}


def sensitivity_bars(dataset: xr.Dataset, choice: Choice) -> BarData:
    """The first-order and total indices of each uncertain input, with their intervals; for errors see `Choice`.

    Raises
    ------
    UsageError : the dataset is no sensitivity study, or no model depends on the inputs
    """
    if not is_sensitivity(dataset):
        raise UsageError("this result is no sensitivity study: impact sensitivity -o writes those")
    for option, value in (("--x", choice.x), ("--y", choice.y), ("--log", choice.log)):
        if value:
            raise UsageError(f"{option}: does not apply to the picture of a sensitivity study")
    if choice.models:
        dataset = dataset.isel(model=model_positions(choice.models, dataset))
    data = select(dataset, choice.sel or {}).load()
    data = data.isel({dim: 0 for dim in data["mean"].dims if dim != "model"})
    panels: list[BarPanel] = []
    not_drawn: list[str] = []
    for number in range(data.sizes["model"]):
        law = data.isel(model=number)
        key = str(law["model"].item())
        if not np.isfinite(law["total"].values).any():
            reason = "samples failed" if int(law["failed"]) else "which does not depend on the inputs"
            not_drawn.append(f"{key}, {reason}")
        elif len(panels) == MAX_PANELS:
            not_drawn.append(f"{key}, beyond {MAX_PANELS} models")
        else:

            def of(suffix: str, law: xr.Dataset = law) -> dict[str, tuple[float, ...]]:
                return {name: tuple(law[f"{name}{suffix}"].values.tolist()) for name in BARS}

            panels.append(
                BarPanel(model_label(law, numbered=choice.equations), key, of(""), of("_lower"), of("_upper"))
            )
    if not panels:
        raise UsageError(f"nothing to draw: {'; '.join(not_drawn)}")
    inputs = tuple(str(name).removeprefix("sweep.").removeprefix("model.") for name in data["input"].values)
    meaning = OUTPUTS[data.attrs["of"]].meaning
    conditions = [", ".join(distribution_texts(data)), conditions_of(data.drop_vars("quantile"))]
    return BarData(
        f"Which uncertain input matters: {meaning}",
        ", ".join(filter(None, conditions)),
        inputs,
        tuple(panels),
        tuple(not_drawn),
    )


def bars_height(plot_data: BarData) -> float:
    """The height of all panels [in]."""
    return len(plot_data.panels) * (PANEL_INCHES + INPUT_INCHES * len(plot_data.inputs)) + 0.3


def draw_bars(plot_data: BarData, all_axes: Sequence[Axes], labels: Mapping[str, str]) -> list[tuple[Artist, str]]:
    """Draw the bars of each model; returns the handles and names of the legend."""
    entries: dict[str, Artist] = {}
    positions = np.arange(len(plot_data.inputs))[::-1]
    for axes, panel in zip(all_axes, plot_data.panels, strict=True):
        for offset, (index, name) in zip((0.5, -0.5), BARS.items(), strict=True):
            values = np.asarray(panel.values[index])
            # an estimate may be outside of its interval, which ends at 0 or 1
            ends = np.maximum([values - panel.lower[index], panel.upper[index] - values], 0.0)
            bars = axes.barh(
                positions + offset * BAR_HEIGHT,
                values,
                BAR_HEIGHT,
                xerr=ends,
                color=BAR_COLOURS[index],
                error_kw={"elinewidth": 0.9, "capsize": 2.5, "capthick": 0.9},
            )
            entries.setdefault(name, bars.patches[0])
        axes.set_title(labels.get(panel.model) or pretty_conditions(panel.label), loc="left", fontsize="medium")
        inputs = [labels.get(name) or (symbol(name) if "." not in name else name) for name in plot_data.inputs]
        axes.set_yticks(positions, inputs)
        axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
        axes.axvline(0.0, color="black", linewidth=0.8)
        axes.grid(visible=False, axis="y")
        number_axis(axes.xaxis)
    all_axes[-1].set_xlabel(axis_text("Sobol index", "index", "1", labels))
    return [(artist, name) for name, artist in entries.items()]
