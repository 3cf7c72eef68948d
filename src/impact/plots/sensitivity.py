"""The picture of a sensitivity study: Sobol indices as bars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import heading
from ..results.schema import kind_of
from ..results.selection import select, select_laws
from ..results.sensitivity import distribution_texts
from .data import LegendEntries, PlotData, Points, stacked
from .kinds import Choice, Kind
from .labels import NamedLaw, axis_text, number_axis, pretty_conditions, split_by_law, symbol, with_model
from .slices import conditions_of
from .style import tint

# bars of an input, and their colours
BARS = {"first": "First-order index", "total": "Total index"}
BAR_COLOURS = {"first": "#8cbfdc", "total": "#0072B2"}
BAR_HEIGHT = 0.38
# height of an input, and of what else a panel has [in]
INPUT_INCHES, PANEL_INCHES = 0.34, 0.55
MAX_PANELS = 8


@dataclass(frozen=True, kw_only=True)
class BarPanel(NamedLaw):
    """The indices of one model or pair: by index the values and the ends of their intervals."""

    values: Mapping[str, tuple[float, ...]]
    lower: Mapping[str, tuple[float, ...]]
    upper: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, kw_only=True)
class BarData(PlotData):
    """The data of a picture of Sobol indices: a panel for each model or pair, with bars for each input."""

    panels: tuple[BarPanel, ...]
    inputs: tuple[str, ...]

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
                    error_kw={"ecolor": tint(1.0), "elinewidth": 0.9, "capsize": 2.5, "capthick": 0.9},
                )
                entries.setdefault(name, bars.patches[0])
            axes.set_title(labels.get(panel.law) or pretty_conditions(panel.label), loc="left", fontsize="medium")
            inputs = [labels.get(name) or (symbol(name) if "." not in name else name) for name in self.inputs]
            axes.set_yticks(positions, inputs)
            axes.set_xlim(left=min(0.0, axes.get_xlim()[0]))
            axes.axvline(0.0, color=tint(1.0), linewidth=0.8)
            axes.grid(visible=False, axis="y")
            number_axis(axes.xaxis)
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
                reason = "not combinable"
            not_drawn.append(f"{law.law}, {reason}")
        elif len(panels) == MAX_PANELS:
            not_drawn.append(f"{law.law}, beyond {MAX_PANELS} laws")
        else:
            ends = {"values": "", "lower": "_lower", "upper": "_upper"}
            indices = {
                field: {name: tuple(law.data[f"{name}{end}"].values.tolist()) for name in BARS}
                for field, end in ends.items()
            }
            panels.append(BarPanel(law.label, law.model, law.friction, **indices))
    if not panels:
        raise UsageError(f"nothing to draw: {'; '.join(not_drawn)}")
    inputs = tuple(str(name).removeprefix("sweep.").removeprefix("model.") for name in data["input"].values)
    meaning = OUTPUTS[data.attrs["of"]].short_meaning
    conditions = [", ".join(distribution_texts(data)), conditions_of(data.drop_vars("quantile"))]
    return BarData(
        f"Which uncertain input matters: {meaning}",
        with_model(", ".join(filter(None, conditions)), data, numbered=choice.equations),
        tuple(not_drawn),
        panels=tuple(panels),
        inputs=inputs,
    )


SENSITIVITY = Kind(
    "sensitivity",
    "First-order and total Sobol indices of the uncertain inputs, with intervals of 95 %.",
    sensitivity_bars,
    lambda dataset, keys: Choice(models=keys),
    along=(),
    source="sensitivity study",
)
