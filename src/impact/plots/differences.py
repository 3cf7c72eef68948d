"""A picture of where two results differ: for every axis, how many tolerances, at most, at each of its labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..comparison.verdict import Judged, Verdict
from ..errors import UsageError
from ..formatting import number
from ..results.schema import plain_unit
from ..text import safe_text
from .labels import axis_text, plain, words_of
from .layout import Picture
from .style import COLOURS, MARKERS, default_size, is_geometric, styled

PANEL_HEIGHT = 2.3
# differences far below the tolerance are all the same
SMALLEST = 1e-4
LABEL_WIDE, TICKS, MANY = 34, 24, 40
# height of the band, as a ratio
BAND = 20.0
# letters of all the names under an axis of half the width
SHORT_NAMES = 30


@dataclass(frozen=True)
class Panel:
    """One axis: its label, its values or names, and by variable the largest ratio at each of them."""

    label: str
    values: tuple[float, ...]
    names: tuple[str, ...]
    ratios: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class Differences:
    """What the picture shows: the verdict's first line, a panel for each axis, and the variables not shown."""

    title: str
    panels: tuple[Panel, ...]
    not_shown: int


def differences(verdict: Verdict) -> Differences:
    """The numbers of the picture.

    Raises
    ------
    UsageError : the two have no point in common
    """
    if not verdict.worst_along:
        raise UsageError("no picture: there is no point to draw at")
    judged = [variable for variable in verdict.variables if variable.judged != "reported"]
    wanted = verdict.differing or tuple(sorted((v for v in judged if v.times), key=_nearest_first))
    shown = [variable.name for variable in wanted[: len(COLOURS)]]
    along = verdict.worst_along
    known = [axis for name in shown for axis, worst in along.items() if name in worst] if shown else list(along)
    axes = [axis for axis in dict.fromkeys(known) if along[axis].sizes[axis] > 1] or known[:1]
    panels = []
    for axis in axes:
        coordinate = along[axis][axis]
        is_numeric = coordinate.dtype.kind in "fiu" and bool(np.isfinite(coordinate.values).all())
        order = np.argsort(coordinate.values, kind="stable") if is_numeric else np.arange(coordinate.size)
        values = coordinate.values[order]
        names = () if is_numeric else tuple(safe_text(number(value), LABEL_WIDE) for value in values.tolist())
        unit = safe_text(plain_unit(str(coordinate.attrs.get("units", "1"))))
        panels.append(
            Panel(
                label=axis_text(words_of(coordinate.attrs, axis), axis, unit, {}),
                values=tuple(values.tolist()) if is_numeric else tuple(range(len(values))),
                names=names,
                ratios={n: tuple(along[axis][n].values[order].tolist()) for n in shown if n in along[axis]},
            )
        )
    return Differences(verdict.headline, tuple(panels), max(0, len(wanted) - len(shown)))


def _nearest_first(variable: Judged) -> float:
    return -variable.times


def draw_differences(numbers: Differences) -> Figure:
    """Draw where two results differ: a point above the line does; one that is equal to the bit is not drawn."""
    with styled():
        rows = _rows(numbers.panels)
        width, height = default_size()
        figure = Picture(width, plain(numbers.title))
        grid = figure.add_gridspec(len(rows), 2)
        names = list(dict.fromkeys(name for panel in numbers.panels for name in panel.ratios))
        ends = _ends(numbers.panels)
        entries: dict[str, Artist] = {}
        for row, panels in enumerate(rows):
            for column, panel in enumerate(panels):
                axes = figure.add_subplot(grid[row, :] if len(panels) == 1 else grid[row, column])
                entries = {**_draw_panel(axes, panel, names, ends), **entries}
        figure.share_labels("", "Largest |new − baseline|, in tolerances")
        if numbers.not_shown:
            entries[f"and {numbers.not_shown} more"] = Line2D([], [], linestyle="")
        figure.settle(
            PANEL_HEIGHT * len(rows), height, [(artist, plain(name)) for name, artist in entries.items()]
        )
    return figure


def _rows(panels: Sequence[Panel]) -> list[tuple[Panel, ...]]:
    """Panels in rows of two; one with many names has a row of its own."""
    rows: list[tuple[Panel, ...]] = []
    for panel in panels:
        is_wide = sum(map(len, panel.names)) > SHORT_NAMES
        if not is_wide and rows and len(rows[-1]) == 1 and sum(map(len, rows[-1][0].names)) <= SHORT_NAMES:
            rows[-1] = (*rows[-1], panel)
        else:
            rows.append((panel,))
    return rows


def _ends(panels: Sequence[Panel]) -> tuple[float, float]:
    """The ends of the vertical axis: the tolerance in sight, and room above for what has no number."""
    ratios = [r for panel in panels for row in panel.ratios.values() for r in row if 0.0 < r < np.inf]
    return max(SMALLEST, min([0.1, *ratios]) / 2.0), 2.0 * BAND * max([1.0, *ratios])


def _draw_panel(axes: Axes, panel: Panel, names: list[str], ends: tuple[float, float]) -> dict[str, Artist]:
    bottom, top = ends
    axes.axhspan(1.0, top, color="#fbf1eb", linewidth=0, zorder=0.5)
    _draw_limit(axes, 1.0, "tolerance", linewidth=1.0)
    x = np.asarray(panel.values, float)
    entries: dict[str, Artist] = {}
    for place, name in enumerate(names):
        ratio = np.asarray(panel.ratios.get(name, np.full(len(x), np.nan)), float)
        look: dict[str, Any] = {
            "color": COLOURS[place % len(COLOURS)], "marker": MARKERS[place % len(MARKERS)],
            "markerfacecolor": "white", "markersize": 4.5 if len(x) <= MANY else 2.5,
        }  # fmt: skip
        counted = np.where(np.isfinite(ratio) & (ratio > 0.0), np.maximum(ratio, bottom), np.nan)
        (entries[name],) = axes.plot(x, counted, linewidth=0.9, linestyle="" if panel.names else "-", **look)
        # what has no number of tolerances, such as a NaN against a number, stands in a band above
        height = top / BAND ** ((place + 1) / (len(names) + 1))
        axes.plot(x, np.where(np.isinf(ratio), height, np.nan), linestyle="", **look)
    if any(np.isinf(row).any() for row in panel.ratios.values()):
        _draw_limit(axes, top / BAND, "above: no number", linewidth=0.6, linestyle=":")
    axes.set_yscale("log")
    axes.set_ylim(bottom, top)
    axes.set_xlabel(panel.label)
    if not panel.names and is_geometric(x):
        axes.set_xscale("log")
        room = (x[-1] / x[0]) ** 0.03
        axes.set_xlim(x[0] / room, x[-1] * room)
    else:
        room = 0.04 * (x[-1] - x[0]) or 0.5
        axes.set_xlim(x[0] - room, x[-1] + room)
    if panel.names:
        _name_ticks(axes, panel, x)
    return entries


def _draw_limit(axes: Axes, height: float, name: str, **look: Any) -> None:
    axes.axhline(height, color="black", **look)
    axes.annotate(
        name, (1.0, height), (-2, -3), xycoords=("axes fraction", "data"), textcoords="offset points", ha="right",
        va="top", fontsize="x-small", color="#555555",
    )  # fmt: skip


def _name_ticks(axes: Axes, panel: Panel, x: np.ndarray) -> None:
    """Write names below the points, as many as there is room for."""
    every = max(1, -(-len(x) // TICKS))
    names = panel.names[::every]
    is_wide = sum(map(len, names)) > SHORT_NAMES
    axes.set_xticks(
        x[::every], names, parse_math=False, fontsize="small", rotation=20 if is_wide else 0,
        ha="right" if is_wide else "center",
    )  # fmt: skip
