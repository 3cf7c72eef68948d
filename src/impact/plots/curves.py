"""Curves over one axis: the data of a picture, their tables and their drawing."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any, Literal

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from ..config.measurements import SIGMA
from ..errors import UsageError
from ..formatting import NO_BREAK, heading
from ..results.schema import numbered_unit
from .data import MEASURED, LegendEntries, PlotData, Points, stacked
from .labels import LawPart, NamedLaw, annotate_right_edge, label_axis, pretty_conditions, symbol, words_of
from .style import FAINT, SOFT, is_geometric, limits_of, model_styles, tint

# the colour of distances from zero, and its shares in those that are shaded, the widest first, and in lines
BAND_COLOUR, BAND_SHARES, BAND_LINE_SHARE = "#0072B2", (0.08, 0.2), 0.65
# height of a panel over the width of the picture: of a single panel, and of several below each other
PANEL_ASPECT, STACKED_PANEL_ASPECT = 0.56, 0.36
# the part of a model's colour in a band; and the least distance of labels, as a part of the axis
BAND_SHADE, LABEL_DISTANCE = 0.22, 0.055


@dataclass(frozen=True, kw_only=True)
class Curve(NamedLaw):
    """One curve in SI, of a model or a pair; the model of a reference is None."""

    x: tuple[float, ...]
    y: tuple[float, ...]
    end: str = ""  # text at the last point
    variable: str = ""  # name of y in a result or a time history
    case: str = ""  # value of an input that distinguishes curves of one model, such as "e = 0.5"
    least: tuple[float, ...] = ()  # a band around the curve
    largest: tuple[float, ...] = ()
    is_guide: bool = False  # a thin line with its case at its end; in the legend if it has a label
    friction: str = ""  # key of the friction law of a pair

    def rows_of_values(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Iterate over its values and the ends of its band, with a name for each end."""
        yield "", self.y
        if self.least:
            yield "least", self.least
            yield "largest", self.largest


@dataclass(frozen=True)
class Mark:
    """A named point of a curve, such as tau_c; a dashed line joins it to the axis `along`."""

    label: str
    x: float
    y: float
    along: Literal["x", "y"]


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes, with the words, the unit and the name of each."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_unit: str = "1"
    y_unit: str = "1"
    x_log: bool = False
    y_log: bool = False
    y_floor: float | None = None  # smaller values are drawn at it
    bands: tuple[float, ...] = ()  # distances from zero that are shaded, the widest first
    marks: tuple[Mark, ...] = ()
    x_name: str = ""  # in a result or a time history
    y_name: str = ""
    joined: bool = True  # whether lines join the points
    band_name: str = ""  # in the legend, of the bands around curves
    height: float = 1.0  # relative to other panels

    def with_log_axes(self, log: str) -> Panel:
        """Make the axes named in `log` logarithmic, but for one with a value <= 0, which it could not show."""
        drawn = {
            "x": [curve.x for curve in self.curves],
            "y": [values for curve in self.curves for _, values in curve.rows_of_values()],
        }
        possible = [axis for axis in log if not any(value <= 0.0 for row in drawn[axis] for value in row)]
        return replace(self, x_log=self.x_log or "x" in possible, y_log=self.y_log or "y" in possible)


@dataclass(frozen=True)
class CurveData(PlotData):
    """The data of a picture of curves: panels below each other, and measured points that the result has."""

    title: str
    conditions: str
    panels: tuple[Panel, ...]
    not_drawn: tuple[str, ...] = ()
    measured: tuple[Points, ...] = ()

    @property
    def names(self) -> set[str]:
        """The axes, variables with a name at the end of their curves, and models whose text a user can replace."""
        all_curves = [curve for panel in self.panels for curve in panel.curves]
        return {
            *(name for panel in self.panels for name in (panel.x_name, panel.y_name)),
            *(curve.variable for curve in all_curves if curve.end),
            *(["reference"] if any(not curve.law for curve in all_curves) else []),
            *self.laws,
        }

    @property
    def laws(self) -> dict[str, str]:
        return {curve.law: curve.label for panel in self.panels for curve in panel.curves if curve.law}

    def long_table(self) -> pd.DataFrame:
        """Make a row for each point of a curve, and for each measured point."""
        parts: list[dict[str, Any]] = []
        for panel, points in zip_longest(self.panels, self.measured):
            axes = {
                "x_axis": heading(f"{panel.x_label},", panel.x_name, panel.x_unit),
                "y_axis": heading(f"{panel.y_label},", panel.y_name, panel.y_unit),
            }
            for curve in panel.curves:
                label = " ".join(filter(None, (curve.label, curve.end)))
                for end, values in curve.rows_of_values():
                    name = ", ".join(filter(None, (label, curve.case, end)))
                    parts.append({**axes, "curve": name, **curve.columns, "x": curve.x, "y": values})
            for column, values in (points.columns if points else {}).items():
                if column != panel.x_name:
                    name = MEASURED if column == panel.y_name else f"{MEASURED}, {column}"
                    x = points.columns[panel.x_name]
                    parts.append({**axes, "curve": name, **NamedLaw("").columns, "x": x, "y": values})
        return stacked(parts)

    def wide_table(self) -> pd.DataFrame:
        """Make a column for each curve and for measured points; curves with the same x share it."""
        columns: dict[str, Sequence[float]] = {}
        all_curves = [(panel, curve) for panel in self.panels for curve in panel.curves]
        is_shared = all(curve.x == all_curves[0][1].x for _, curve in all_curves)
        for panel, curve in all_curves:
            owner = curve.law or "reference"
            name = " ".join(filter(None, (owner, curve.case.replace(" ", ""))))
            x_column = heading(panel.x_name, "" if is_shared else owner, panel.x_unit)
            # a law may have other points in another panel, such as its residuals
            if columns.get(x_column, curve.x) != curve.x:
                x_column = heading(panel.x_name, f"{curve.variable} {name}", panel.x_unit)
            columns[x_column] = curve.x
            for end, values in curve.rows_of_values():
                variable = "_".join(filter(None, (curve.variable, end)))
                columns[heading(variable, name, panel.y_unit)] = values
        for panel, points in zip(self.panels, self.measured, strict=False):
            for column, values in points.columns.items():
                owner = "measured" if column == panel.y_name else f"{panel.y_name} measured"
                columns[heading(column, owner, panel.x_unit if column == panel.x_name else panel.y_unit)] = values
        return pd.DataFrame({name: pd.Series(values) for name, values in columns.items()})

    def place_panels(self, figure: Figure, width: float) -> tuple[list[Axes], float]:
        heights = [panel.height for panel in self.panels]
        count = self.panel_count
        all_axes = figure.subplots(count, sharex=count > 1, squeeze=False, height_ratios=heights)
        aspect = PANEL_ASPECT if count == 1 else STACKED_PANEL_ASPECT
        return list(all_axes.ravel()), sum(heights) * width * aspect + 0.3

    def draw(self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None) -> LegendEntries:
        styles = model_styles([curve.law for panel in self.panels for curve in panel.curves if curve.law])
        entries: dict[str, Artist] = {}
        band: dict[str, Artist] = {}
        for axes, panel, stored in zip_longest(all_axes, self.panels, self.measured):
            _draw_bands(axes, panel)
            axes.set(xscale="log" if panel.x_log else "linear", yscale="log" if panel.y_log else "linear")
            for curve in panel.curves:
                name = labels.get(curve.law or "reference") or pretty_conditions(curve.label)
                y = curve.y if panel.y_floor is None else np.maximum(curve.y, panel.y_floor)
                (line,) = axes.plot(curve.x, y, label=f"_{name}", **_line_style(curve, panel, styles))
                if name:
                    entries.setdefault(name, line)
                if curve.least:
                    band[panel.band_name] = _draw_band(axes, curve, line)
            for measured in (points, stored):
                entries |= _draw_points(axes, panel, measured) if measured and measured.columns else {}
            # the names of marks need room at the ends of the axes
            axes.margins(x=0.06 if panel.marks else 0.02, y=0.12 if panel.marks else None)
            axes.autoscale_view()
            if not panel.y_log:
                axes.set_ylim(limits_of(*axes.get_ylim()))
            _label_bands(axes, panel)
            _label_floor(axes, panel)
            label_axis(axes.xaxis, panel.x_label, panel.x_name, panel.x_unit, labels, log=panel.x_log)
            label_axis(axes.yaxis, panel.y_label, panel.y_name, panel.y_unit, labels, log=panel.y_log)
            if axes is not all_axes[-1]:
                axes.set_xlabel("")
            for mark in panel.marks:
                _draw_mark(axes, mark)
            _label_curve_ends(axes, panel.curves, labels)
            _label_guides(axes, [curve for curve in panel.curves if curve.is_guide and curve.case])
        return [(artist, name) for name, artist in (entries | band).items()]


def curve_of(
    law: NamedLaw, x: ArrayLike, y: ArrayLike, variable: str, end: str = "", band: Sequence[ArrayLike] = ()
) -> Curve:
    """Make a curve of arrays of the shape of x, or of one y everywhere; a band is two arrays."""
    arrays = (np.broadcast_to(np.asarray(array, float), np.shape(x)) for array in (x, y, *band))
    points: dict[str, Any] = {
        name: tuple(array.tolist()) for name, array in zip(("x", "y", "least", "largest"), arrays, strict=False)
    }
    return Curve(law.label, law.model, end=end, variable=variable, friction=law.friction, **points)


def law_curves(laws: Iterable[LawPart], x: ArrayLike, ends: Mapping[str, str]) -> list[Curve]:
    """Make the curves of every law over x, of variables with the texts at their ends."""
    return [curve_of(law, x, law.data[name], name, end) for law in laws for name, end in ends.items()]


def x_axis_fields(dataset: xr.Dataset, name: str) -> dict[str, Any]:
    """Describe the horizontal axis of a panel along a coordinate."""
    return {
        "x_name": name,
        "x_label": words_of(dataset[name].attrs, name),
        "x_unit": numbered_unit(dataset, name),
        "x_log": is_geometric(dataset[name].values),
    }


def _draw_points(axes: Axes, panel: Panel, points: Points) -> dict[str, Artist]:
    """Draw measured points over the curves of a panel, with error bars where there is a sigma."""
    variables = list(dict.fromkeys(curve.variable for curve in panel.curves if curve.model))
    shown = [name for name in variables if name in points.columns]
    if panel.x_name not in points.columns or not shown:
        needs = f"{panel.x_name} and {' or '.join(variables)}"
        has = ", ".join(points.columns)
        raise UsageError(f"{points.source}: the picture shows {needs}, and the points have {has}")
    if SIGMA in points.columns and len(shown) > 1:
        raise UsageError(f"{points.source}: {SIGMA} of which, {' or '.join(shown)}? expected one of them")
    is_log = {panel.x_name: panel.x_log, **dict.fromkeys(shown, panel.y_log)}
    for name in (name for name, log in is_log.items() if log):
        if any(value <= 0.0 for value in points.columns[name]):
            raise UsageError(f"{points.source}: {name} has values <= 0, which a logarithmic axis cannot show")
    artists: dict[str, Artist] = {}
    for index, name in enumerate(shown):
        bars = axes.errorbar(
            points.columns[panel.x_name],
            points.columns[name],
            points.columns.get(f"{SIGMA}_{name}", points.columns.get(SIGMA)),
            color=tint(1.0),
            zorder=3,
            marker="o",
            markersize=4.0,
            linestyle="none",
            elinewidth=0.9,
            capsize=2.0,
            markerfacecolor=tint(1.0 if index == 0 else 0.0),
        )
        artists[MEASURED if len(shown) == 1 else f"{MEASURED} {name}"] = bars[0]
    return artists


def _line_style(curve: Curve, panel: Panel, styles: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Choose the line style of a curve: a reference is a plain line, points without an order have no line."""
    points = len(curve.x)
    scattered: dict[str, Any] = {} if panel.joined else {"linestyle": "none"}
    if curve.is_guide:
        return {"color": tint(SOFT), "linewidth": 0.7, "linestyle": (0, (5, 2)), "zorder": 1.4, **scattered}
    if curve.model is None:
        # without a line it is a disc, larger than the markers of the models
        disc = {"marker": "o", "markersize": 9.0, "alpha": None} if points == 1 or scattered else {}
        return {"color": tint(0.25 if disc else 1.0), "linewidth": 2.0, "zorder": 1.5, **disc, **scattered}
    style = {key: value for key, value in styles[curve.law].items() if key != "hatch"}
    # the markers of different models are at different points, so that equal curves show both
    every = 1 if scattered else max(1, points // 12)
    start = list(styles).index(curve.law) * every // max(1, len(styles)) % every
    return {**style, "markevery": (start, every), "markerfacecolor": tint(0.0), **scattered}


def _draw_band(axes: Axes, curve: Curve, line: Line2D) -> Artist:
    """Draw the band of a curve, opaque for formats without transparency; returns its symbol in a legend.

    Points without an order have bars.
    """
    colour = str(line.get_color())
    if line.get_linestyle() == "None":
        axes.vlines(curve.x, curve.least, curve.largest, color=colour, linewidth=0.9, zorder=1.3)
        return Line2D([], [], color=tint(FAINT), linewidth=0.9)
    shade = tint(BAND_SHADE, colour)
    axes.fill_between(curve.x, curve.least, curve.largest, color=shade, linewidth=0.0, zorder=0.8)
    # the edges are above the bands of other curves
    for edge in (curve.least, curve.largest):
        axes.plot(curve.x, edge, color=colour, linewidth=0.5, label="_", zorder=1.3)
    return Patch(facecolor=tint(2 / 15), edgecolor=tint(FAINT), linewidth=0.5)


def _label_guides(axes: Axes, guides: Sequence[Curve]) -> None:
    """Write the cases of guides at their ends, without overlap."""
    to_axes = axes.transScale + axes.transLimits
    lowest = -math.inf
    for guide in sorted(guides, key=lambda curve: curve.y[-1]):
        _, height = to_axes.transform((guide.x[-1], guide.y[-1])).tolist()
        lowest = max(height, lowest + LABEL_DISTANCE)
        text = pretty_conditions(guide.case.replace(" ", NO_BREAK))
        annotate_right_edge(axes, text, lowest, 4, xycoords="axes fraction", fontsize="small")


def _draw_bands(axes: Axes, panel: Panel) -> None:
    """Shade the distances from zero, or draw lines at them on a logarithmic axis."""
    for band, share in zip(panel.bands, BAND_SHARES, strict=False):
        if panel.y_log:
            # above the line of the grid, which may be at the same value
            axes.axhline(band, color=tint(BAND_LINE_SHARE, BAND_COLOUR), linewidth=0.8, zorder=0.6)
        else:
            axes.axhspan(-band, band, color=tint(share, BAND_COLOUR), linewidth=0, zorder=0.5)
            axes.axhline(0.0, color=tint(FAINT), linewidth=0.7, zorder=0.6)


def _label_bands(axes: Axes, panel: Panel) -> None:
    """Write the values of bands at the ends of their lines, beside a logarithmic axis."""
    low, high = axes.get_ylim()
    # narrower bands have their label below the line, except near the lower end, where only the space above is left
    for band in panel.bands if panel.y_log else ():
        is_below = band != panel.bands[0] and band > (low * high) ** 0.5
        alignment = "top" if is_below else "bottom"
        annotate_right_edge(axes, f"{band:g}", band, 3, -1 if is_below else 1, va=alignment, color=BAND_COLOUR)


def _label_floor(axes: Axes, panel: Panel) -> None:
    """Write beside the axis that values at the floor are that or less."""
    floor = panel.y_floor
    if floor is not None and any(y < floor for curve in panel.curves for y in curve.y):
        annotate_right_edge(axes, f"≤ $10^{{{math.log10(floor):.0f}}}$", floor, 3)


def _draw_mark(axes: Axes, mark: Mark) -> None:
    """Draw a point, a dashed line from it to its axis, and its name at the foot of the line."""
    low = axes.get_xlim()[0] if mark.along == "y" else axes.get_ylim()[0]
    foot = (mark.x, low) if mark.along == "x" else (low, mark.y)
    dashes: dict[str, Any] = {"color": tint(FAINT), "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1.2}
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot((mark.x, foot[0]), (mark.y, foot[1]), label="_", **dashes)
    axes.plot([mark.x], [mark.y], "o", color=tint(1.0), markersize=3.5, label="_", zorder=3)
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.annotate(
        symbol(mark.label), foot, (4, 3), textcoords="offset points", fontsize="large", va="bottom", ha="left"
    )


def _label_curve_ends(axes: Axes, curves: Sequence[Curve], labels: Mapping[str, str]) -> None:
    """Write names at the last points; of several ends together one is below and the others above."""
    ends: dict[str, tuple[float, float]] = {}
    for curve in curves:
        drawn = np.flatnonzero(np.isfinite(curve.y))
        if curve.end and drawn.size:
            end = curve.x[drawn[-1]], curve.y[drawn[-1]]
            # beside the longest curve, so that no other one is below the name
            ends[curve.variable] = max(ends.get(curve.variable, end), end, key=lambda point: point[0])
    low, high = axes.get_ylim()
    ordered = sorted((point[1], name) for name, point in ends.items())
    for rank, (y, name) in enumerate(ordered):
        near = [other for other, _ in ordered if abs(other - y) < 0.1 * (high - low)]
        aside = (-8 if rank == 0 else 8) if len(near) > 1 else 0
        axes.annotate(
            labels.get(name, symbol(name)),
            ends[name],
            (6, aside),
            textcoords="offset points",
            va="center",
            fontsize="large",
            annotation_clip=False,
        )
