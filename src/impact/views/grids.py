"""The drawing of pictures over two axes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from textwrap import wrap
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from .look import COLOURS, STYLE
from .planes import SMALLEST, Grids

Array = NDArray[np.float64]

# more cells than these are stored as an image
LARGE = 2_000
# errors that have a contour line, and its dashes
CONTOURS: dict[float, Any] = {0.01: ":", 0.05: "-"}
# their number shares no factor with that of the colours: together they make 56 looks
HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oo", "||||")
FAILED: dict[str, Any] = {"facecolor": "#ebebeb", "edgecolor": "#b4b4b4", "hatch": "/////", "linewidth": 0}
NO_VALUE = "failed or not defined"
# inches: a panel of a map and one of the closest model are so wide at least, all of them so high, one so high at
# most; about what stands beside them; between two; the colour bar; a tick with what parts it from its name; a line
NARROW, NARROW_CLOSEST, LOW, HIGH, BESIDE = 1.7, 3.0, 2.0, 3.2, 1.35
BETWEEN, BAR, TICK, LINE, GAP = 0.2, 0.12, 0.1, 0.12, 0.07
# points: the title, labels of the axes, all else
TITLE, LABEL, SMALL = 9.0, 8.0, 7.0
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def edges_of(values: Sequence[float], log: bool) -> Array:
    """The edges of cells, half way between their values, of shape (values + 1,).

    >>> edges_of([0.0, 1.0, 3.0], log=False).tolist(), edges_of([1.0, 100.0], log=True).round(9).tolist()
    ([-0.5, 0.5, 2.0, 4.0], [0.1, 10.0, 1000.0])
    """
    at = np.log(values) if log else np.asarray(values, float)
    middle = (at[1:] + at[:-1]) / 2.0
    edges = np.concatenate(([2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]))
    return np.asarray(np.exp(edges) if log else edges)


def draw_grids(numbers: Grids, width: float) -> Figure:
    """Draw panels over two axes.

    Parameters
    ----------
    numbers : what is drawn
    width : of the figure [in]
    """
    with matplotlib.rc_context({"hatch.linewidth": 0.5, "axes.grid": False}, fname=str(STYLE)):
        titles = ["Closest model", "Its |e_error|"] if numbers.closest else [one.label for one in numbers.panels]
        figure = Figure((width, width))
        figure.set_layout_engine("none")
        axes = [figure.add_axes((0.0, 0.0, 1.0, 1.0)) for _ in titles]
        x, y = edges_of(numbers.x_values, numbers.x_log), edges_of(numbers.y_values, numbers.y_log)
        draw = _draw_closest if numbers.closest else _draw_fields
        mesh, entries = draw(numbers, axes, x, y)
        for one in axes:
            one.set(xscale="log" if numbers.x_log else "linear", yscale="log" if numbers.y_log else "linear")
            one.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
            one.minorticks_off()
        _arrange(figure, numbers, axes, titles, x[[0, -1]], y[[0, -1]], mesh, entries)
    return figure


def _draw_fields(numbers: Grids, axes: Sequence[Axes], x: Array, y: Array) -> tuple[QuadMesh, list[Artist]]:
    """The panels of a map; returns what the colour bar is of, and what the legend holds."""
    values = np.ma.masked_invalid([panel.values for panel in numbers.panels])
    low, top = float(values.min()), float(values.max())
    if numbers.signed:
        low, top = -max(abs(low), abs(top)), max(abs(low), abs(top))
    norm = Normalize(low, top) if low < top else Normalize(low - 0.5, low + 0.5)
    return _draw_values(numbers, axes, x, y, values, norm, "RdBu_r" if numbers.signed else "viridis")


def _draw_closest(numbers: Grids, axes: Sequence[Axes], x: Array, y: Array) -> tuple[QuadMesh, list[Artist]]:
    """The two panels of the closest model; returns the same."""
    labels = {panel.model: panel.label for panel in numbers.panels}
    closest = np.array(numbers.closest, object)
    entries: list[Artist] = []
    for place, (key, share) in enumerate(numbers.shares.items()):
        look = {"facecolor": COLOURS[place % len(COLOURS)], "hatch": HATCHES[place % len(HATCHES)],
                "edgecolor": "white", "linewidth": 0} if key else FAILED  # fmt: skip
        axes[0].add_patch(_cells(x, y, closest == key, look))
        percent = f"{share:.1f} %" if share >= 0.1 else "< 0.1 %"
        entries.append(Patch(**look, label=f"{percent}  {labels[key] if key else NO_VALUE}"))
    shown = np.ma.maximum(np.ma.masked_invalid(numbers.distance), SMALLEST)
    norm = LogNorm(shown.min(), max(shown.max(), 10.0 * shown.min()))
    mesh, rest = _draw_values(numbers, axes[1:], x, y, shown[None], norm, "viridis")
    return mesh, entries + [entry for entry in rest if entry.get_label() != NO_VALUE]


def _draw_values(
    numbers: Grids, axes: Sequence[Axes], x: Array, y: Array, values: Any, norm: Normalize, colours: str
) -> tuple[QuadMesh, list[Artist]]:
    """Values, of shape (axes, y, x), as colours with contour lines; returns the same."""
    name = "|e_error| = " if numbers.closest else "e_error = ±"
    entries: dict[float, Artist] = {}
    for one, field in zip(axes, values, strict=True):
        mesh = one.pcolormesh(x, y, field, norm=norm, cmap=colours, rasterized=values.size > LARGE)
        if field.mask.any():
            one.add_patch(_cells(x, y, np.ma.getmaskarray(field), FAILED))
            entries[0.0] = Patch(**FAILED, label=NO_VALUE)
        levels = [sign * level for level in CONTOURS for sign in (-1, 1)] if numbers.variable == "e_error" else []
        inside = sorted(level for level in levels if field.min() < level < field.max())
        if inside:
            # as far as the cells go, and seen on dark and on light
            wider = np.ma.masked_invalid(np.pad(field.filled(np.nan), 1, mode="edge"))
            across, up = [x[0], *numbers.x_values, x[-1]], [y[0], *numbers.y_values, y[-1]]
            drawn = one.contour(across, up, wider, inside, colors="black", linewidths=0.8,
                                linestyles=[CONTOURS[abs(level)] for level in inside])  # fmt: skip
            drawn.set_path_effects([withStroke(linewidth=1.8, foreground="white")])
        for level in map(abs, inside):
            entries[level] = Line2D([], [], color="black", linewidth=0.8, linestyle=CONTOURS[level],
                                    label=f"{name}{level:g}")  # fmt: skip
    return mesh, [entries[level] for level in sorted(entries)]


def _cells(x: Array, y: Array, mask: NDArray[np.bool_], look: dict[str, Any]) -> PathPatch:
    """The cells of a mask by y and x as one patch; neighbours in a row are one rectangle."""
    found = []
    for row, line in enumerate(mask):
        ends = x[np.flatnonzero(np.diff(np.concatenate(([False], line, [False]))))]
        for left, right in ends.reshape(-1, 2):
            corners = [(left, y[row]), (right, y[row]), (right, y[row + 1]), (left, y[row + 1]), (left, y[row])]
            found.append(Path(corners, closed=True))
    path = Path.make_compound_path(*found)
    return PathPatch(path, antialiased=False, rasterized=mask.size > LARGE, **look)


def _arrange(
    figure: Figure, numbers: Grids, axes: Sequence[Axes], titles: Sequence[str], x: Array, y: Array,
    mesh: QuadMesh, entries: Sequence[Artist],
) -> None:  # fmt: skip
    """Give everything its place, by the lengths of the texts, so that none covers another; all in inches.

    A layout of matplotlib's is not the same to the last digit each time, which would be in the file.
    """

    def write(words: str, points: float, room: float, va: str = "bottom", **look: Any) -> Text:
        lines = _wrapped(words, room, points, look.get("weight", "normal"))
        return figure.text(0.0, 0.0, lines, fontsize=points, parse_math=False, va=va, **look)

    def size(artist: Text | Legend) -> Array:
        return np.asarray(artist.get_window_extent().size) / figure.dpi

    width = figure.get_figwidth()
    rows = -(-len(axes) // max(1, int(width / (NARROW_CLOSEST if numbers.closest else NARROW))))
    columns = -(-len(axes) // rows)
    high = min(max(0.85 * (width - BESIDE) / columns, LOW / rows), HIGH)

    # from left to right: label and ticks of y, the panels, the bar with its ticks and label
    y_ticks, y_names = _ticks(y, numbers.y_log, high, upright=True)
    y_label = write(numbers.labels[1], LABEL, rows * high, rotation=90, va="center")
    # the bar stands beside the panels that it is of
    long = high if numbers.closest else rows * high
    bar_ticks, bar_names = _ticks(np.array(mesh.get_clim()), bool(numbers.closest), long, upright=True)
    bar_label = write("" if numbers.closest else numbers.labels[2], LABEL, long, rotation=90, va="center")
    left = GAP + size(y_label)[0] + GAP + _longest(y_names) + TICK
    right = BETWEEN / 2.0 + BAR + TICK + _longest(bar_names) + GAP + size(bar_label)[0] + GAP
    wide = (width - left - right + BETWEEN) / columns - BETWEEN
    x_ticks, x_names = _ticks(x, numbers.x_log, wide)

    # from below: legend, label and ticks of x, the panels with their titles, conditions, title
    below = GAP
    if entries:
        for entry in entries:
            entry.set_label(_wrapped(str(entry.get_label()), width - 0.8, SMALL))
        lines = [line for entry in entries for line in str(entry.get_label()).split("\n")]
        legend = figure.legend(
            handles=entries, ncols=max(1, int(width / (_longest(lines) + 0.6))), fontsize=SMALL, borderpad=0.0,
            loc="lower center", bbox_to_anchor=(width / 2.0, below), bbox_transform=figure.dpi_scale_trans,
        )  # fmt: skip
        for text in legend.get_texts():
            text.set_parse_math(False)
        below += size(legend)[1] + GAP
    x_label = write(numbers.labels[0], LABEL, width - 2.0 * GAP, ha="center")
    bottom = below + size(x_label)[1] + GAP + LINE + TICK
    heads = [one.set_title(_wrapped(title, wide, SMALL, "bold"), fontsize=SMALL, parse_math=False, pad=3.0)
             for one, title in zip(axes, titles, strict=True)]  # fmt: skip
    # each row has the room that its own titles need
    rooms = [max(size(head)[1] for head in heads[row * columns :][:columns]) + GAP for row in range(rows)]
    floors = [bottom + sum(rooms[row + 1 :]) + (rows - 1 - row) * (high + TICK) for row in range(rows)]
    body = floors[0] + high - bottom
    conditions = write(numbers.conditions, SMALL, width - 2.0 * GAP, color="#555555")
    title = write(numbers.title, TITLE, width - 2.0 * GAP, weight="bold")
    above = bottom + body + rooms[0] + GAP
    top = above + size(conditions)[1] + GAP + size(title)[1] + GAP

    def place(one: Axes, x: float, y: float, wide: float, high: float) -> None:
        one.set_position((x / width, y / top, wide / width, high / top))
        one.tick_params(labelsize=SMALL)

    figure.set_size_inches(width, top)
    for number, one in enumerate(axes):
        row, column = divmod(number, columns)
        place(one, left + column * (wide + BETWEEN), floors[row], wide, high)
        one.set_xticks(x_ticks, x_names if number + columns >= len(axes) else [""] * len(x_ticks))
        one.set_yticks(y_ticks, y_names if column == 0 else [""] * len(y_ticks))
    more = "min" if numbers.closest and np.nanmin(numbers.distance) < SMALLEST else "neither"
    bar = figure.colorbar(mesh, cax=figure.add_axes((0.0, 0.0, 1.0, 1.0)), extend=more)
    bar.set_ticks(bar_ticks, labels=bar_names)
    bar.minorticks_off()
    place(bar.ax, width - right + BETWEEN / 2.0, bottom, BAR, high if numbers.closest else body)
    middle = (left + width - right) / 2.0
    for text, (at, up) in (
        (x_label, (middle, below)), (y_label, (GAP, bottom + body / 2.0)), (conditions, (GAP, above)),
        (bar_label, (width - GAP - size(bar_label)[0], bottom + body / 2.0)),
        (title, (GAP, above + size(conditions)[1] + GAP)),
    ):  # fmt: skip
        text.set_position((at / width, up / top))


def _ticks(edges: Array, log: bool, inches: float, upright: bool = False) -> tuple[list[float], list[str]]:
    """As many ticks as there is room for, and their names; logarithmic ones are powers of ten, 3 between few."""
    low, high = edges
    even = (MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]) for most in (8, 6, 5, 4, 3, 2, 1))
    tries = [np.asarray(locator.tick_values(low, high)) for locator in even]
    if log:
        powers = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high) + 1.0)
        tries = [np.outer(powers, (1.0, 3.0)).ravel(), *(powers[::every] for every in (1, 2, 3, 5)), *tries]
    for ticks in tries:
        # an end may differ in its last digits from a power of ten
        ticks = ticks[(low * (1.0 - 1e-9) <= ticks) & (ticks <= high)]
        names = [_named(tick) for tick in ticks]
        whole, at = (np.log(high / low), np.log(ticks)) if log else (high - low, ticks)
        # beside a panel the next begins again
        after = at[:0] if upright else at[:1] + whole * (1.0 + BETWEEN / inches)
        free = np.diff([*at, *after]) * inches / whole
        if 1 < len(ticks) < 10 and free.min() > (2.0 * LINE if upright else _longest(names) + GAP):
            break
    return ticks.tolist(), names


def _named(value: float) -> str:
    """A number as short as it can be.

    >>> [_named(value) for value in (0.25, -3.0, -1e-9, 2.5e10)]
    ['0.25', '−3', '−10⁻⁹', '2.5·10¹⁰']
    """
    digits, _, power = f"{value:g}".partition("e")
    name = f"{digits}·10{str(int(power)).translate(RAISED)}" if power else digits
    return re.sub(r"^(-?)1·", r"\1", name).replace("-", "−")


def _wrapped(text: str, inches: float, size: float, weight: str = "normal") -> str:
    """The text in lines that are no longer than so many inches."""
    # no line holds more letters than if all were narrow
    for letters in range(min(len(text), int(288.0 * inches / size)), 0, -1):
        lines = wrap(text, letters, break_on_hyphens=False)
        if all(_length(line, size, weight) <= inches for line in lines):
            return "\n".join(lines)
    return text


def _longest(lines: Sequence[str]) -> float:
    return max((_length(line, SMALL) for line in lines), default=0.0)


def _length(line: str, size: float, weight: str = "normal") -> float:
    """How long a line is in its font [in]."""
    font = FontProperties(size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(line, font, False)[0]) / 72.0
