"""Pictures of a result. A figure is made in two steps: the numbers that it shows, and their drawing."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..contact.models import catalogue
from ..data.results import plain_unit
from ..errors import UsageError
from ..text import safe_text
from .look import COLOURS, MARKERS, STYLE, axis_label, is_geometric
from .slices import take_slice

if TYPE_CHECKING:
    import xarray as xr

# a legend has two columns where its labels are at most this long, and the figure grows by a line of this height
# for every row of it
SHORT_LABEL, LEGEND_ROW = 46, 0.19
# characters of a line
TITLE_WIDE, CONDITIONS_WIDE = 66, 104


@dataclass(frozen=True)
class Curve:
    """One curve: its label, the model's key (None for the reference), the ball, and a value per x."""

    label: str
    model: str | None
    ball: int
    values: tuple[float, ...]


@dataclass(frozen=True)
class FinalVelocities:
    """The numbers of a final-velocity comparison: what is drawn over what, where, and the curves."""

    title: str
    x: str
    x_label: str
    x_is_geometric: bool
    x_values: tuple[float, ...]
    unit: str
    conditions: str
    slice: Mapping[str, float | str]
    not_drawn: tuple[float, ...]
    curves: tuple[Curve, ...]


def final_velocities(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> FinalVelocities:
    """The numbers of Figure 6: post-impact velocities of every model and of the impulse-momentum solution.

    Parameters
    ----------
    dataset : a result
    x, sel, models : see `impact.views.slices.take_slice`

    Raises
    ------
    UsageError : the result has not got what is asked for
    """
    wanted = ("v1_post", "v2_post", "v1_reference", "v2_reference")
    missing = [name for name in wanted if name not in dataset]
    if "model" not in dataset.dims:
        raise UsageError("this is a time history; the comparison is drawn from the result of a sweep")
    if missing:
        raise UsageError(f"this result has no {', '.join(missing)}; sweep without [output] variables, or add them")
    line = take_slice(dataset, x, sel, models)
    # a wall, or a plane, has no place on an axis
    along = line.dataset[line.x].values
    order = np.argsort(along, kind="stable")
    data = line.dataset.isel({line.dataset[line.x].dims[0]: order[np.isfinite(along[order])]})
    if not data[line.x].size:
        raise UsageError(f"{safe_text(line.x)} has no finite value to draw over")

    def curve(label: str, model: str | None, ball: int, values: xr.DataArray) -> Curve:
        return Curve(label, model, ball, tuple(np.broadcast_to(values.values, data[line.x].shape).tolist()))

    curves = [curve("Impulse-momentum (6), (7)", None, ball, data[f"v{ball}_reference"]) for ball in (1, 2)]
    for key in data["model"].values:
        one = data.sel(model=key)
        curves += [curve(_label(one), str(key), ball, one[f"v{ball}_post"]) for ball in (1, 2)]
    # without a restitution to refer to there is no reference
    curves = [one for one in curves if one.model is not None or np.isfinite(one.values).any()]
    return FinalVelocities(
        title=safe_text(str(dataset.attrs.get("title", "")), 140),
        x=line.x,
        x_label=axis_label(data[line.x]),
        x_is_geometric=is_geometric(data[line.x].values),
        x_values=tuple(data[line.x].values.tolist()),
        unit="m/s",
        conditions=_conditions(data, line.x),
        slice=line.fixed,
        not_drawn=tuple(v for v in line.dataset[line.x].values.tolist() if not np.isfinite(v)),
        curves=tuple(curves),
    )


def _label(one: xr.Dataset) -> str:
    """Title, year and equation number of a model."""
    number = re.search(r"\(\d+\)(?:-\(\d+\))?$", str(one["equation"].values))
    name = f"{one['title'].values} ({one['year'].values})"
    return safe_text(f"{name}, {number[0]}" if number else name, 80)


def _conditions(data: xr.Dataset, x: str) -> str:
    """The values of everything that is not drawn over."""
    parts = []
    for name, coordinate in data.coords.items():
        model, _, own = str(name).rpartition(".")
        of_a_model_not_shown = own != name and model not in data["model"].values
        if coordinate.ndim == 0 and name not in ("model", x) and not of_a_model_not_shown:
            value = coordinate.values.item()
            unit = plain_unit(str(coordinate.attrs.get("units", "1")))
            text = f"{value:g}" if isinstance(value, float) else str(value)
            parts.append(safe_text(f"{name} = {text}" + (f" {unit}" if unit != "1" else ""), 60))
    return ", ".join(parts)


def draw_final_velocities(numbers: FinalVelocities) -> Figure:
    """Draw a final-velocity comparison."""
    with matplotlib.rc_context(fname=str(STYLE)):
        labels = [curve.label for curve in numbers.curves if curve.ball == 1]
        columns = 2 if max(map(len, labels)) <= SHORT_LABEL else 1
        width, height = matplotlib.rcParams["figure.figsize"]
        figure = Figure((width, height + LEGEND_ROW * -(-len(labels) // columns)), layout="constrained")
        axes = figure.add_subplot()
        order = [*catalogue(), *(c.model for c in numbers.curves if c.model)]
        x = np.asarray(numbers.x_values)
        for curve in numbers.curves:
            look = _look(curve, order, len(x))
            first = curve.ball == 1
            axes.plot(x, curve.values, label=curve.label if first else "_", **look)
        _name_the_balls(axes, numbers, x)
        if numbers.x_is_geometric:
            axes.set_xscale("log")
        axes.set_xlabel(numbers.x_label, parse_math=False)
        axes.set_ylabel(f"velocity after the impact [{numbers.unit}]")
        axes.margins(x=0.02)
        conditions = fill(numbers.conditions, CONDITIONS_WIDE, break_on_hyphens=False)
        title = fill(numbers.title or "Final velocities comparison", TITLE_WIDE)
        axes.set_title(title, parse_math=False, pad=9 + 10 * (conditions.count("\n") + 1))
        axes.annotate(
            conditions, (0, 1), (0, 4), xycoords="axes fraction", textcoords="offset points",
            fontsize=7.5, color="#555555", parse_math=False, va="bottom",
        )  # fmt: skip
        legend = figure.legend(loc="outside lower center", ncols=columns)
        for text in legend.get_texts():
            text.set_parse_math(False)
    return figure


def _look(curve: Curve, order: list[str], points: int) -> dict[str, Any]:
    """Colour and marker of a curve: a model's own, wherever it is drawn; the reference is a plain line."""
    if curve.model is None:
        # a single point has no line: a disc that shows around the models' markers
        disc = {"marker": "o", "markersize": 10} if points == 1 else {}
        return {"color": "black", "linewidth": 2.2, "zorder": 1.5, **disc}
    place = order.index(curve.model)
    every = max(1, points // 12)
    return {
        "color": COLOURS[place % len(COLOURS)],
        "marker": MARKERS[place % len(MARKERS)],
        # the markers of different models stand at different points, so that equal curves show both
        "markevery": (place * every // len(MARKERS) % every if every > 1 else 0, every),
        "markerfacecolor": "white",
        "linewidth": 1.1,
    }


def _name_the_balls(axes: Axes, numbers: FinalVelocities, x: np.ndarray) -> None:
    """v₁⁺ and v₂⁺ beside the last points of their curves: the reference's, or else the first model's."""
    ends = {}
    for curve in reversed(numbers.curves):
        drawn = np.flatnonzero(np.isfinite(curve.values))
        if drawn.size:
            ends[curve.ball] = (x[drawn[-1]], curve.values[drawn[-1]])
    low, high = axes.get_ylim()
    close = len(ends) == 2 and abs(ends[1][1] - ends[2][1]) < 0.06 * (high - low)
    for ball, name in ((1, "v₁⁺"), (2, "v₂⁺")):
        if ball in ends:
            # where both end together, one name stands below the point and the other above
            aside = (
                6,
                (-8 if (ends[ball][1], ball) == min((e[1], b) for b, e in ends.items()) else 8) if close else 0,
            )
            axes.annotate(name, ends[ball], aside, textcoords="offset points", va="center", fontsize=11,
                          annotation_clip=False)  # fmt: skip
