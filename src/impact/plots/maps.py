"""Maps over two axes: a variable of each model, or the model closest to e; their data and their drawing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke

from ..array_types import Array, Mask
from ..errors import UsageError, did_you_mean
from ..formatting import argument, heading, percentage, safe_text
from ..results.ranking import error_floor
from ..results.schema import numbered_unit
from .data import LegendEntries, PlotData, Points, stacked
from .kinds import Choice, Kind
from .labels import (
    REFERENCE,
    NamedLaw,
    label_axis,
    legend_labels,
    number_axis,
    parameters_in,
    pretty_conditions,
    split_by_law,
    symbol,
    with_model,
    words_of,
)
from .layout import Picture
from .slices import choose_plane, conditions_of, not_a_sweep, read, take_plane
from .style import is_geometric, limits_of, model_styles, tint

# a value at each y and x
Plane = tuple[tuple[float, ...], ...]
MAX_PANELS = 12
# the smallest error that has a colour: smaller ones are errors of the solver
MIN_DRAWN_DISTANCE = 1e-9
# a map of more cells is stored as an image
MAX_VECTOR_CELLS = 2_000
# errors that have a contour line, and its dashes
CONTOURS: dict[float, Any] = {0.01: ":", 0.05: "-"}
NO_VALUE = "failed or not defined"
# where several models are closest, in place of a key, which has no space
SEVERAL = "several models"
# least width of a panel of a map, and of one of the closest model [in]
MIN_PANEL_WIDTH, MIN_CLOSEST_PANEL_WIDTH = 1.6, 3.0
# width of what is next to the panels: labels and colour bar [in]
MARGIN_WIDTH = 1.35
# height of a panel with its title [in]
MIN_ROW_HEIGHT, MAX_ROW_HEIGHT = 1.7, 3.2


@dataclass(frozen=True, kw_only=True)
class Field(NamedLaw):
    """One panel, whose label is its title: a value at each y and x."""

    values: Plane
    friction: str = ""


@dataclass(frozen=True)
class MapData(PlotData):
    """The data of a map, or of the closest model, in SI: panels over the same two axes."""

    title: str
    conditions: str
    variable: str
    x: str
    y: str
    labels: tuple[str, str, str]  # of x, y and the variable
    units: tuple[str, str, str]
    x_values: tuple[float, ...]
    y_values: tuple[float, ...]
    x_log: bool
    y_log: bool
    signed: bool  # whether the variable has values of both signs
    panels: tuple[Field, ...]
    not_drawn: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()  # keys of the models without a panel
    # keys of the models with the smallest |e_error|, or SEVERAL
    closest: tuple[tuple[str | None, ...], ...] = ()
    distance: Plane = ()  # that |e_error|

    @property
    def panel_count(self) -> int:
        return 2 if self.closest else len(self.panels)

    @property
    def shares(self) -> dict[str | None, float]:
        """The fraction of cells where each model, or SEVERAL, is closest, in order; None: where none is."""
        count = Counter(key for row in self.closest for key in row)
        keys = (*(panel.model for panel in self.panels), SEVERAL, None)
        return {key: count[key] / count.total() for key in keys if count[key]}

    @property
    def names(self) -> set[str]:
        """The axes, variable and models whose text a user can replace."""
        variable = () if self.closest else (self.variable,)
        return {self.x, self.y, *variable, *(panel.law or "reference" for panel in self.panels)}

    @cached_property
    def edges(self) -> tuple[Array, Array]:
        """The edges of the cells along x and along y."""
        return edges_of(self.x_values, self.x_log), edges_of(self.y_values, self.y_log)

    def long_table(self) -> pd.DataFrame:
        """Make a row for each point of each model; x varies more slowly than y."""
        points: dict[str, Any] = {
            self.x: np.repeat(self.x_values, len(self.y_values)),
            self.y: np.tile(self.y_values, len(self.x_values)),
        }
        closest: dict[str, Any] = {}
        if self.closest:
            closest["closest"] = [key or "" for key in np.transpose(np.array(self.closest, object)).ravel()]
            closest["abs_e_error"] = np.transpose(self.distance).ravel()
        return stacked(
            {**panel.columns, **points, self.variable: np.transpose(panel.values).ravel(), **closest}
            for panel in self.panels
        )

    def wide_table(self) -> pd.DataFrame:
        """Make a row for each point, with a column for each model or pair."""
        x_unit, y_unit, unit = self.units
        points = self.long_table().iloc[: len(self.x_values) * len(self.y_values)]
        columns = {heading(self.x, unit=x_unit): points[self.x], heading(self.y, unit=y_unit): points[self.y]}
        for panel in self.panels:
            columns[heading(self.variable, panel.law, unit)] = np.transpose(panel.values).ravel()
        return pd.DataFrame(columns | {name: points[name] for name in ("closest", "abs_e_error") if self.closest})

    def place_panels(self, figure: Figure, width: float) -> tuple[list[Axes], float]:
        """Place panels in rows; only the left and lower axes have tick labels."""
        count = self.panel_count
        rows = -(-count // max(1, int(width / (MIN_CLOSEST_PANEL_WIDTH if self.closest else MIN_PANEL_WIDTH))))
        # the rows have nearly equal numbers of panels
        columns = -(-count // rows)
        grid = figure.subplots(rows, columns, squeeze=False)
        for index, axes in enumerate(grid.ravel()):
            axes.tick_params(labelleft=index % columns == 0, labelbottom=index + columns >= count)
            if index >= count:
                axes.remove()
        height = min(max(0.9 * (width - MARGIN_WIDTH) / columns, MIN_ROW_HEIGHT), MAX_ROW_HEIGHT)
        return list(grid.ravel()[:count]), rows * (height + 0.25) + 0.3

    def draw(self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None) -> LegendEntries:
        x, y = self.edges
        mesh, entries = self._draw_closest(all_axes, labels) if self.closest else self._draw_fields(all_axes)
        names = {panel.law or "reference": pretty_conditions(panel.label) for panel in self.panels}
        chosen = [labels.get(key, name) for key, name in names.items()]
        titles = ["Closest model", "Its absolute error"] if self.closest else chosen
        short, plain = legend_labels(names, "short"), legend_labels(names, "keys")
        shorter = {}
        for (key, name), panel in zip(names.items(), self.panels, strict=True):
            parameters = [*map(pretty_conditions, parameters_in(panel.label))]
            shorter[name] = [", ".join([text, *parameters]) for text in (short[key], plain[key])]
        figure = all_axes[0].figure
        for axes, title in zip(all_axes, titles, strict=True):
            heading_text = axes.set_title(title)
            if isinstance(figure, Picture) and title in shorter:
                figure.short_names[heading_text] = shorter[title]
            axes.grid(False)
            axes.set(xscale="log" if self.x_log else "linear", yscale="log" if self.y_log else "linear")
            axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
            label_axis(axes.xaxis, self.labels[0], self.x, self.units[0], labels, self.x_log, self.x_values)
            label_axis(axes.yaxis, self.labels[1], self.y, self.units[1], labels, self.y_log, self.y_values)
        if len(all_axes) > 1 and isinstance(figure, Picture):
            figure.share_labels(all_axes[0].get_xlabel(), all_axes[0].get_ylabel())
            for axes in all_axes:
                axes.set(xlabel="", ylabel="")
        bar_axes = all_axes[-1:] if self.closest else list(all_axes)
        grid = all_axes[0].get_gridspec()
        rows = grid.nrows if grid is not None and not self.closest else 1
        more = "min" if self.closest and np.nanmin(self.distance) < MIN_DRAWN_DISTANCE else "neither"
        bar = all_axes[0].figure.colorbar(mesh, ax=bar_axes, extend=more, pad=0.02, aspect=25 * rows)
        if self.closest:
            number_axis(bar.ax.yaxis, log=True)
        else:
            label_axis(bar.ax.yaxis, self.labels[2], self.variable, self.units[2], labels, log=False)
        return entries

    def _draw_fields(self, axes: Sequence[Axes]) -> tuple[QuadMesh, LegendEntries]:
        """Draw the panels of a map; returns what the colour bar shows, and handles and names of the legend."""
        values = np.ma.masked_invalid([panel.values for panel in self.panels])
        low, top = float(values.min()), float(values.max())
        if self.signed:
            least = MIN_DRAWN_DISTANCE if self.variable == "e_error" else 0.0
            top = max(abs(low), abs(top), least)
            low = -top
        norm = Normalize(*limits_of(low, top))
        return self._draw_values(axes, values, norm, "RdBu_r" if self.signed else "viridis")

    def _draw_closest(self, axes: Sequence[Axes], labels: Mapping[str, str]) -> tuple[QuadMesh, LegendEntries]:
        """Draw the two panels of the closest model; returns the mesh of the colour bar and the legend entries."""
        names = {
            panel.model: labels.get(panel.model or "", pretty_conditions(panel.label)) for panel in self.panels
        }
        styles = model_styles([panel.model for panel in self.panels if panel.model in self.shares and panel.model])
        closest = np.array(self.closest, object)
        entries: LegendEntries = []
        for key, share in self.shares.items():
            tied = {"facecolor": tint(0.26), "linewidth": 0}
            style, name = (tied, f"{SEVERAL}, equally close") if key else (_failed(), NO_VALUE)
            if key in styles:
                look, name = styles[key], names[key]
                style = {
                    "facecolor": look["color"],
                    "hatch": look["hatch"],
                    "edgecolor": tint(0.0),
                    "linewidth": 0,
                }
            axes[0].add_patch(self._merged_cells(closest == key, style))
            entries.append((Patch(**style), f"{percentage(share)}  {name}"))
        shown = np.ma.maximum(np.ma.masked_invalid(self.distance), MIN_DRAWN_DISTANCE)
        norm = LogNorm(shown.min(), max(shown.max(), 10.0 * shown.min()))
        mesh, rest = self._draw_values(axes[1:], shown[None], norm, "viridis")
        return mesh, entries + [(artist, name) for artist, name in rest if name != NO_VALUE]

    def _draw_values(
        self, axes: Sequence[Axes], values: Any, norm: Normalize, colours: str
    ) -> tuple[QuadMesh, LegendEntries]:
        """Draw values, of shape (axes, y, x), as colours with contour lines; returns as `_draw_closest`."""
        name = symbol("abs_e_error" if self.closest else "e_error") + (" = " if self.closest else " = ±")
        entries: dict[float, tuple[Artist, str]] = {}
        for panel_axes, field in zip(axes, values, strict=True):
            # edges in the colour of their cell cover the seams that viewers of vector pictures show between cells
            edges: dict[str, Any] = {"edgecolors": "face", "linewidth": 1.0}
            if values.size > MAX_VECTOR_CELLS:
                edges = {"rasterized": True}
            mesh = panel_axes.pcolormesh(*self.edges, field, norm=norm, cmap=colours, **edges)
            if field.mask.any():
                panel_axes.add_patch(self._merged_cells(np.ma.getmaskarray(field), _failed()))
                entries[0.0] = Patch(**_failed()), NO_VALUE
            levels = [sign * level for level in CONTOURS for sign in (-1, 1)] if self.variable == "e_error" else []
            inside = sorted(level for level in levels if field.min() < level < field.max())
            if inside:
                # contours that reach the edges of the cells, with an outline visible on dark and on light colours
                wider = np.ma.masked_invalid(np.pad(field.filled(np.nan), 1, mode="edge"))
                x, y = self.edges
                across, up = [x[0], *self.x_values, x[-1]], [y[0], *self.y_values, y[-1]]
                drawn = panel_axes.contour(
                    across,
                    up,
                    wider,
                    inside,
                    colors=[tint(1.0)],
                    linewidths=0.8,
                    linestyles=[CONTOURS[abs(level)] for level in inside],
                )
                drawn.set_path_effects([withStroke(linewidth=1.8, foreground=tint(0.0))])
            for level in map(abs, inside):
                line = Line2D([], [], color=tint(1.0), linewidth=0.8, linestyle=CONTOURS[level])
                entries[level] = line, f"{name}{level:g}"
        return mesh, [entries[level] for level in sorted(entries)]

    def _merged_cells(self, mask: Mask, style: dict[str, Any]) -> PathPatch:
        """Join the cells in a mask, of shape (y, x), into a patch; neighbours in a row are one rectangle."""
        (x, y), rectangles = self.edges, []
        for low, high, row in zip(y[:-1], y[1:], mask, strict=True):
            ends = x[np.flatnonzero(np.diff(np.concatenate(([False], row, [False]))))]
            for left, right in ends.reshape(-1, 2):
                corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
                rectangles.append(Path(corners, closed=True))
        path = Path.make_compound_path(*rectangles)
        return PathPatch(path, antialiased=False, rasterized=mask.size > MAX_VECTOR_CELLS, **style)


def field_map(dataset: xr.Dataset, choice: Choice) -> MapData:
    """Read a variable over two axes, for at most MAX_PANELS models or pairs."""
    default = "beta" if "beta" in dataset.data_vars else "e_error"
    plot_data = _map_data("map", dataset, choice.variable or default, choice, MAX_PANELS)
    if not plot_data.left_out:
        return plot_data
    laws = "pairs" if plot_data.panels[0].friction else "models"
    count = f"the first {MAX_PANELS} of {MAX_PANELS + len(plot_data.left_out)} {laws}"
    return replace(plot_data, conditions="; ".join(filter(None, (plot_data.conditions, count))))


def validity_map(dataset: xr.Dataset, choice: Choice) -> MapData:
    """Find the model with the smallest |e_error| over two axes, or that several are equal, and that error."""
    plot_data = _map_data("validity", dataset, "e_error", choice)
    error = np.abs([panel.values for panel in plot_data.panels])
    error[np.isnan(error)] = np.inf
    distance = error.min(axis=0)
    closest = np.array([panel.model for panel in plot_data.panels], object)[error.argmin(axis=0)]
    closest[np.count_nonzero(error <= distance + error_floor(dataset), axis=0) > 1] = SEVERAL
    no_value = np.isinf(distance)
    closest[no_value], distance[no_value] = None, np.nan
    return replace(plot_data, closest=_nested_tuples(closest), distance=_nested_tuples(distance))


def _nested_tuples(values: np.ndarray) -> tuple[Any, ...]:
    return tuple(map(tuple, values.tolist()))


def _map_data(
    kind: str, dataset: xr.Dataset, variable: str, choice: Choice, max_panels: int | None = None
) -> MapData:
    """Read the panels of a kind of map, of at most `max_panels` models or pairs."""
    if "model" not in dataset.dims:
        raise not_a_sweep()
    if variable not in dataset.data_vars:
        hint = did_you_mean(variable, [str(name) for name in dataset.data_vars])
        raise UsageError(f'no variable "{variable}" in this result; {hint}')
    outer = [dim for dim in ("model", "friction") if dim in dataset[variable].dims]
    data, x, y, not_drawn = take_plane(dataset, kind, choice, outer)
    field, plane = data[variable], (*data[y].dims, *data[x].dims)
    laws = list(split_by_law(data, numbered=choice.equations)) if "model" in field.dims else []
    if laws:
        field = field.isel(model=slice(max_panels))
    what = safe_text(f"{variable} over {x} and {y}")
    if field.dtype.kind not in "iuf" or not set(plane) <= set(field.dims):
        raise UsageError(f"cannot draw {what}: it does not have a number at each point")
    # of shape (models or pairs, y, x); the reference has no models
    in_memory = read(field.to_dataset(name=variable), [variable])[variable]
    values = np.asarray(in_memory.transpose(*outer, *plane).values, float)
    values = values.reshape(-1, *values.shape[-2:])[:max_panels]
    finite = values[np.isfinite(values)]
    if not finite.size:
        raise UsageError(f"cannot draw {what}: it has no value there")
    for letter, name in (("x", x), ("y", y)):
        if letter in choice.log and data[name].values[0] <= 0.0:
            raise UsageError(f"{argument('log', letter)}: {name} got values <= 0, expected values > 0")
    reference = f"{REFERENCE} (6), (7)" if choice.equations else REFERENCE
    shown: Sequence[NamedLaw] = laws[:max_panels] or [NamedLaw(reference)]
    heading_text = safe_text(str(dataset.attrs.get("title", "")), 140)
    x_label, y_label, label = (words_of(data[name].attrs, name) for name in (x, y, variable))
    x_unit, y_unit, unit = (numbered_unit(data, name) for name in (x, y, variable))
    label = "Error" if variable == "e_error" else label[:1].upper() + label[1:]
    title = safe_text(f"{label if kind == 'map' else 'Closest model'} over {x} and {y}")
    return MapData(
        f"{title}: {heading_text}" if heading_text else title,
        with_model(conditions_of(data, x, y), data, numbered=choice.equations),
        variable=variable,
        x=x,
        y=y,
        labels=(x_label, y_label, label),
        units=(x_unit, y_unit, unit),
        x_values=tuple(data[x].values.tolist()),
        y_values=tuple(data[y].values.tolist()),
        x_log="x" in choice.log or is_geometric(data[x].values),
        y_log="y" in choice.log or is_geometric(data[y].values),
        # errors, and what has values of both signs, not by rounding alone
        signed=variable.endswith(("_error", "energy_residual")) or bool(-finite.min() > 1e-3 * finite.max() > 0.0),
        panels=tuple(
            Field(law.label, law.model, values=_nested_tuples(part), friction=law.friction)
            for law, part in zip(shown, values, strict=True)
        ),
        not_drawn=not_drawn,
        left_out=tuple(law.law for law in laws[len(shown) :]),
    )


def edges_of(values: Sequence[float], log: bool) -> Array:
    """Compute the edges of cells, half way between their values, of shape (values + 1,).

    None is below 0 where all values are above it.

    >>> edges_of([0.0, 1.0, 3.0], log=False).tolist(), edges_of([1.0, 100.0], log=True).round(9).tolist()
    ([-0.5, 0.5, 2.0, 4.0], [0.1, 10.0, 1000.0])
    >>> edges_of([1.0, 10.0], log=False).tolist()
    [0.0, 5.5, 14.5]
    """
    centres = np.log(values) if log else np.asarray(values, float)
    middle = (centres[1:] + centres[:-1]) / 2.0
    edges = np.concatenate(([2.0 * centres[0] - middle[0]], middle, [2.0 * centres[-1] - middle[-1]]))
    if log:
        return np.asarray(np.exp(edges))
    return np.maximum(edges, 0.0) if centres[0] > 0.0 else edges


def _failed() -> dict[str, Any]:
    """The style of cells without a value."""
    return {"facecolor": tint(0.08), "edgecolor": tint(0.3), "hatch": "/////", "linewidth": 0}


_over_plane = partial(Kind, default=choose_plane, along=("x", "y"))
MAP = _over_plane(
    "Error of the restitution, or beta of oblique impacts, over two axes; a panel for each model or pair.",
    field_map,
)
VALIDITY = _over_plane(
    "Model with the smallest error, or several with equal errors, and that error.", validity_map
)
