"""A picture of where two results differ: over every axis, the largest difference in units of the tolerance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..comparison.verdict import Verdict
from ..config.input_names import InputName
from ..errors import UsageError
from ..formatting import number, safe_text, scaled_unit
from ..results.schema import SCHEMA, unit_of
from .labels import annotate_right_edge, axis_text, escape_mathtext, is_whole, number_axis, words_of
from .layout import Picture
from .style import COLOURS, MARKERS, default_size, is_geometric, styled, tint

# height of a row of panels [in]
PANEL_HEIGHT = 2.3
# smaller differences, in tolerances, are drawn at this ratio
MIN_DRAWN_RATIO = 1e-4
# letters of the name of a label of an axis
MAX_NAME_LENGTH = 34
MAX_TICKS = 24
# from this number of names on the markers are smaller
MANY_NAMES = 40
# ratio of the ends of the band above the panel for differences that have no number
NO_NUMBER_BAND = 20.0
# distance of the first and the last symbol at a name, over that of names
NAMES_SPREAD = 0.4
# letters of all names below an axis of half the width, and of those below one of the whole width
MAX_NAMES_LENGTH, MAX_WIDE_NAMES_LENGTH = 30, 80
# symbols on a line, besides those at the ends of its parts
SYMBOLS_ON_LINE = 12


@dataclass(frozen=True)
class DifferencePanel:
    """One axis: its label, its values or names, and the largest ratio at each of them, by variable."""

    label: str
    values: tuple[float, ...]
    names: tuple[str, ...]
    ratios: Mapping[str, tuple[float, ...]]
    whole: bool = False  # whether its values are numbers of measured values or of cases


@dataclass(frozen=True)
class DifferenceData:
    """The data of the picture: the headline of the verdict, a panel per axis, number of variables not shown."""

    title: str
    panels: tuple[DifferencePanel, ...]
    not_shown: int


def difference_data(verdict: Verdict) -> DifferenceData:
    """Collect the largest differences along each axis from a verdict."""
    if not verdict.worst_along:
        raise UsageError("nothing to draw: no variable was compared along an axis")
    judged = [variable for variable in verdict.variables if variable.judged != "reported"]
    wanted = verdict.differing or tuple(
        sorted((v for v in judged if v.ratio), key=lambda variable: -variable.ratio)
    )
    shown = [variable.name for variable in wanted[: len(COLOURS)]]
    along = verdict.worst_along
    axis_names = (
        [axis for name in shown for axis, worst in along.items() if name in worst] if shown else list(along)
    )
    axes = [axis for axis in dict.fromkeys(axis_names) if along[axis].sizes[axis] > 1] or axis_names[:1]
    panels = []
    for axis in axes:
        coordinate = along[axis][axis]
        input_name = InputName.parse(axis)
        is_numeric = coordinate.dtype.kind in "fiu" and bool(np.isfinite(coordinate.values).all())
        is_numeric = is_numeric and not input_name.words
        order = np.argsort(coordinate.values, kind="stable") if is_numeric else np.arange(coordinate.size)
        values = coordinate.values[order]
        # degrees for rad, no prefix for other units
        size, unit = scaled_unit(unit_of(coordinate), 1.0)
        texts = () if is_numeric else map(number, map(input_name.word, values.tolist()))
        panels.append(
            DifferencePanel(
                label=axis_text(words_of(coordinate.attrs, axis), axis, unit, {}),
                values=tuple((values / size).tolist()) if is_numeric else tuple(range(len(values))),
                names=tuple(safe_text(text, MAX_NAME_LENGTH) for text in texts),
                ratios={n: tuple(along[axis][n].values[order].tolist()) for n in shown if n in along[axis]},
                whole=is_whole(axis),
            )
        )
    return DifferenceData(verdict.headline, tuple(panels), max(0, len(wanted) - len(shown)))


def draw_differences(plot_data: DifferenceData) -> Figure:
    """Plot where two results differ: points above the line exceed the tolerance; equal values are not drawn."""
    with styled():
        rows: list[Any] = _arrange_panels(plot_data.panels)
        width, height = default_size()
        figure = Picture(width, escape_mathtext(plot_data.title))
        names = list(dict.fromkeys(name for panel in plot_data.panels for name in panel.ratios))
        # the vertical axes include the tolerance and the band for differences without a number
        ratios = [
            r for panel in plot_data.panels for row in panel.ratios.values() for r in row if 0.0 < r < np.inf
        ]
        ends = max(MIN_DRAWN_RATIO, min([0.1, *ratios]) / 2.0), 2.0 * NO_NUMBER_BAND * max([1.0, *ratios])
        entries: dict[str, Artist] = {}
        for index, axes in figure.subplot_mosaic(rows).items():
            entries = {**_draw_panel(axes, plot_data.panels[index], names, ends), **entries}
        figure.share_labels("", "Largest difference / tolerance")
        if plot_data.not_shown:
            entries[f"and {plot_data.not_shown} more"] = Line2D([], [], linestyle="")
        figure.add_legend(
            PANEL_HEIGHT * len(rows), height, [(artist, _variable_text(name)) for name, artist in entries.items()]
        )
    return figure


def _variable_text(name: str) -> str:
    r"""Write the meaning and the symbol of a variable of any kind of result, as the axes of pictures do.

    >>> _variable_text("e_out"), _variable_text("and 3 more")
    ('Restitution that the model delivers $e_\\mathrm{out}$', 'and 3 more')
    """
    known = next((variables[name] for variables in SCHEMA.values() if name in variables), None)
    return (
        axis_text(words_of({"long_name": known.meaning}, name), name, "", {}) if known else escape_mathtext(name)
    )


def _arrange_panels(panels: Sequence[DifferencePanel]) -> list[list[int]]:
    """The indices of panels in rows of two; a panel with many names, or alone in its row, takes both places."""
    rows: list[list[int]] = []
    is_wide = [sum(map(len, panel.names)) > MAX_NAMES_LENGTH for panel in panels]
    for index, wide in enumerate(is_wide):
        if not wide and rows and rows[-1][0] == rows[-1][1] and not is_wide[rows[-1][0]]:
            rows[-1][1] = index
        else:
            rows.append([index, index])
    return rows


def _draw_panel(
    axes: Axes, panel: DifferencePanel, names: list[str], ends: tuple[float, float]
) -> dict[str, Artist]:
    bottom, top = ends
    axes.axhspan(1.0, top, color=tint(0.08, "#D55E00"), linewidth=0, zorder=0.5)
    _draw_limit(axes, 1.0, "tolerance", linewidth=1.0)
    x = np.asarray(panel.values, float)
    # symbols of equal differences beside each other, where there is room between names
    spread = NAMES_SPREAD / max(1, len(names) - 1) if panel.names else 0.0
    entries: dict[str, Artist] = {}
    for index, name in enumerate(names):
        ratio = np.asarray(panel.ratios.get(name, np.full(len(x), np.nan)), float)
        shifted = x + spread * (index - 0.5 * (len(names) - 1))
        style: dict[str, Any] = {
            "color": COLOURS[index % len(COLOURS)],
            "marker": MARKERS[index % len(MARKERS)],
            "markerfacecolor": tint(0.0),
            "markersize": 2.5 if panel.names and len(x) > MANY_NAMES else 4.5,
        }
        counted = np.where(np.isfinite(ratio) & (ratio > 0.0), np.maximum(ratio, bottom), np.nan)
        # on a line of many points a few symbols, and those that have no line to one of the neighbours
        every = 1 if panel.names else max(1, len(x) // SYMBOLS_ON_LINE)
        is_gap = np.isnan(np.pad(counted, 1, constant_values=np.nan))
        marked = (np.arange(len(x)) % every == index % every) | is_gap[:-2] | is_gap[2:]
        line = {"linewidth": 0.9, "linestyle": "" if panel.names else "-", "markevery": marked.tolist()}
        (entries[name],) = axes.plot(shifted, counted, **(style | line))
        # a difference without a number, such as a NaN against a number, is drawn in a band at the top
        height = top / NO_NUMBER_BAND ** ((index + 1) / (len(names) + 1))
        axes.plot(shifted, np.where(np.isinf(ratio), height, np.nan), linestyle="", **style)
    if any(np.isinf(row).any() for row in panel.ratios.values()):
        _draw_limit(axes, top / NO_NUMBER_BAND, "above:\nno number", linewidth=0.6, linestyle=":")
    axes.set_yscale("log")
    axes.set_ylim(bottom, top)
    axes.set_xlabel(panel.label)
    if not panel.names and is_geometric(x):
        axes.set_xscale("log")
        margin = (x[-1] / x[0]) ** 0.03
        axes.set_xlim(x[0] / margin, x[-1] * margin)
    else:
        margin = NAMES_SPREAD if panel.names else 0.04 * (x[-1] - x[0]) or 0.5
        axes.set_xlim(x[0] - margin, x[-1] + margin)
    number_axis(axes.yaxis, log=True)
    if panel.names:
        _label_ticks(axes, panel, x)
    else:
        number_axis(axes.xaxis, log=is_geometric(x), whole=panel.whole)
    return entries


def _draw_limit(axes: Axes, height: float, name: str, **style: Any) -> None:
    axes.axhline(height, color=tint(1.0), **style)
    annotate_right_edge(axes, name, height, 3)


def _label_ticks(axes: Axes, panel: DifferencePanel, x: np.ndarray) -> None:
    """Write names below the points: up to MAX_TICKS all of them, else few enough not to overlap."""
    every = 1 if len(x) <= MAX_TICKS else -(-2 * len(x) // MAX_TICKS)
    names = panel.names[::every]
    # a panel with more than MAX_NAMES_LENGTH letters has a whole row; the longest name has to fit its place
    is_tilted = len(names) * max(map(len, names), default=0) > MAX_WIDE_NAMES_LENGTH
    axes.set_xticks(
        x[::every],
        names,
        parse_math=False,
        fontsize="small",
        rotation=20 if is_tilted else 0,
        rotation_mode="anchor",
        ha="right" if is_tilted else "center",
    )
