"""A picture of curves: the numbers that it shows, and their drawing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, MaxNLocator, NullFormatter

from .labels import label_curves
from .look import STYLE, look_of

# at most so many names stand beside their curves; more are in a legend
DIRECT = 6
# of a panel: height over width, and inches that its labels need; a legend's row; characters an inch holds
HIGH, LABELS, LEGEND_ROW, TITLE, SMALL, LETTERS = 0.62, 0.35, 0.18, 9.6, 15.0, 14.0


@dataclass(frozen=True)
class Curve:
    """One curve; its name, the model's key (None for a reference), its points, and a name beside the last one."""

    label: str
    model: str | None
    x: tuple[float, ...]
    y: tuple[float, ...]
    end: str = ""


@dataclass(frozen=True)
class Mark:
    """A point of a curve with a name, such as tau_c, which stands at the foot of its line to the axis `along`."""

    label: str
    x: float
    y: float
    along: Literal["x", "y"]


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes; the numbers along an axis show its unit with a prefix, where it is given.

    `bands` are distances from zero that are shaded, the widest first; `marks` are points with names.
    """

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_unit: str = ""
    y_unit: str = ""
    x_log: bool = False
    y_log: bool = False
    bands: tuple[float, ...] = ()
    marks: tuple[Mark, ...] = ()


@dataclass(frozen=True)
class Lines:
    """The numbers of a picture: panels one below the other, what they are of, and what is not drawn."""

    title: str
    conditions: str
    panels: tuple[Panel, ...]
    not_drawn: tuple[str, ...] = ()

    columns = ("x_axis", "y_axis", "curve", "model", "x", "y")

    def rows(self) -> Iterator[tuple[str | float, ...]]:
        """The numbers behind the picture, one point a row."""
        for panel in self.panels:
            names = [
                f"{label} [{unit}]" if unit else label
                for label, unit in ((panel.x_label, panel.x_unit), (panel.y_label, panel.y_unit))
            ]
            for curve in panel.curves:
                name = " ".join(part for part in (curve.label, curve.end) if part)
                for x, y in zip(curve.x, curve.y, strict=True):
                    yield (*names, name, curve.model or "", x, y)


def draw_lines(numbers: Lines, width: float) -> Figure:
    """Draw curves.

    Parameters
    ----------
    numbers : what is drawn
    width : of the figure [in]
    """
    with matplotlib.rc_context(fname=str(STYLE)):
        names = list(dict.fromkeys(curve.label for panel in numbers.panels for curve in panel.curves))
        conditions = fill(numbers.conditions, int(SMALL * (width - 0.7)), break_on_hyphens=False)
        title = fill(numbers.title, int(TITLE * width))
        above = 0.17 * (title.count("\n") + 1) + 0.13 * (conditions.count("\n") + 1)
        height = len(numbers.panels) * (HIGH if len(numbers.panels) == 1 else 0.42) * width + LABELS + above
        figure = Figure((width, height), layout="constrained")
        all_axes = np.atleast_1d(figure.subplots(len(numbers.panels), sharex=len(numbers.panels) > 1))
        places = {model: None for panel in numbers.panels for model in (curve.model for curve in panel.curves)}
        tall = (height - LABELS - above) / len(numbers.panels)
        for axes, panel in zip(all_axes, numbers.panels, strict=True):
            _draw(axes, panel, list(places), int(tall * LETTERS))
        for axes in all_axes[:-1]:
            axes.set_xlabel("")
        all_axes[0].set_title(title, parse_math=False, pad=6 + 9.5 * (conditions.count("\n") + 1))
        small = all_axes[0].annotate(
            conditions, (0, 1), (0, 4), xycoords="axes fraction", textcoords="offset points",
            fontsize=7.5, color="#555555", parse_math=False, va="bottom",
        )  # fmt: skip
        # the title above leaves room for it
        small.set_in_layout(False)
        if len(names) > DIRECT or not label_curves(figure, all_axes[0]):
            _legend(figure, width)
    return figure


def _draw(axes: Axes, panel: Panel, models: Sequence[str | None], letters: int) -> None:
    for place, band in enumerate(panel.bands):
        if panel.y_log:
            axes.axhline(band, color="#0072B2", alpha=0.6, linewidth=0.8, zorder=0.5)
            axes.annotate(
                f"{band:g}", (1, band), (-2, 1), xycoords=("axes fraction", "data"), textcoords="offset points",
                ha="right", va="bottom", fontsize=7, color="#0072B2",
            )  # fmt: skip
        else:
            axes.axhspan(-band, band, color="#0072B2", alpha=0.06 + 0.05 * place, linewidth=0, zorder=0.5)
    if panel.x_log:
        axes.set_xscale("log")
    if panel.y_log:
        axes.set_yscale("log")
    seen: set[str] = set()
    for curve in panel.curves:
        look: dict[str, Any] = look_of(curve.model, models, len(curve.x))
        axes.plot(curve.x, curve.y, label="_" if curve.label in seen else curve.label, **look)
        seen.add(curve.label)
    axes.set_xlabel(panel.x_label, parse_math=False)
    axes.set_ylabel(fill(panel.y_label, max(letters, 12)), parse_math=False)
    if panel.x_log:
        # a short axis would name the numbers between the powers of ten, one over the other
        axes.xaxis.set_minor_formatter(NullFormatter())
    for axis, unit, is_log in ((axes.xaxis, panel.x_unit, panel.x_log), (axes.yaxis, panel.y_unit, panel.y_log)):
        if unit and not is_log:
            axis.set_major_formatter(EngFormatter(unit))
            axis.set_major_locator(MaxNLocator(5))
    # the names of marks need room at the ends of the axes
    axes.margins(x=0.06 if panel.marks else 0.02, y=0.12 if panel.marks else None)
    for mark in panel.marks:
        _mark(axes, mark)
    _name_ends(axes, panel.curves)


def _mark(axes: Axes, mark: Mark) -> None:
    """A point, a dashed line from it to its axis, and its name at the foot of the line."""
    low = axes.get_xlim()[0] if mark.along == "y" else axes.get_ylim()[0]
    foot = (mark.x, low) if mark.along == "x" else (low, mark.y)
    dashes: dict[str, Any] = {"color": "#777777", "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1.2}
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot((mark.x, foot[0]), (mark.y, foot[1]), label="_", **dashes)
    axes.plot([mark.x], [mark.y], "o", color="black", markersize=3.5, label="_", zorder=3)
    axes.set(xlim=limits[0], ylim=limits[1])
    letter = mark.label.replace("delta", r"\delta").replace("tau", r"\tau")
    axes.annotate(f"${letter}$", foot, (4, 3), textcoords="offset points", fontsize=10.5, va="bottom", ha="left")


def _name_ends(axes: Axes, curves: Sequence[Curve]) -> None:
    """Names beside the last points: where several end together, one stands below and the other above."""
    ends: dict[str, tuple[float, float]] = {}
    for curve in curves:
        drawn = np.flatnonzero(np.isfinite(curve.y))
        if curve.end and drawn.size:
            ends.setdefault(curve.end, (curve.x[drawn[-1]], curve.y[drawn[-1]]))
    low, high = axes.get_ylim()
    points = sorted((point[1], name) for name, point in ends.items())
    for place, (y, name) in enumerate(points):
        near = [other for other, _ in points if abs(other - y) < 0.06 * (high - low)]
        aside = (-8 if place == 0 else 8) if len(near) > 1 else 0
        axes.annotate(name, ends[name], (6, aside), textcoords="offset points", va="center", fontsize=10.5,
                      annotation_clip=False)  # fmt: skip


def _legend(figure: Figure, width: float) -> None:
    """A legend below, with as many columns as its names leave room for."""
    handles = {line.get_label(): line for axes in reversed(figure.axes) for line in axes.lines}
    named = {str(label): line for label, line in handles.items() if not str(label).startswith("_")}
    order = dict.fromkeys(str(line.get_label()) for axes in figure.axes for line in axes.lines)
    names = [name for name in order if name in named]
    shown = [fill(name, int(LETTERS * width) - 8) for name in names]
    columns = max(
        1, min(4, int(width / (0.5 + max(len(row) for name in shown for row in name.split("\n")) / LETTERS)))
    )
    rows = -(-sum(name.count("\n") + 1 for name in shown) // columns)
    figure.set_figheight(figure.get_figheight() + LEGEND_ROW * rows)
    legend = figure.legend([named[name] for name in names], shown, loc="outside lower center", ncols=columns)
    for text in legend.get_texts():
        text.set_parse_math(False)
