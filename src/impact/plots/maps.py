"""Pictures over two axes: a variable of each model, and which model is closest to e; and their drawing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from ..errors import UsageError, did_you_mean
from ..formatting import heading, percentage
from ..results.schema import plain_unit
from ..text import safe_text
from .curves import label_of
from .labels import REFERENCE, label_axis, number_axis, pretty_conditions, symbol, words_of
from .layout import Picture
from .slices import NO_SWEEP, Selection, conditions_of, read, take_plane
from .style import is_geometric, looks_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Rows = tuple[tuple[float, ...], ...]
# at most so many panels are drawn
PANELS = 12
# errors this close are equal; one below the second is the solver's, and has no place on a logarithmic scale
TIE, SMALLEST = 1e-9, 1e-9
# more cells than these are stored as an image
LARGE = 2_000
# errors that have a contour line, and its dashes
CONTOURS: dict[float, Any] = {0.01: ":", 0.05: "-"}
FAILED: dict[str, Any] = {"facecolor": "#ebebeb", "edgecolor": "#b4b4b4", "hatch": "/////", "linewidth": 0}
NO_VALUE = "failed or not defined"
# inches: a panel of a map and one of the closest model are so wide at least; what stands beside the panels; the
# height of a panel with its title
NARROW, NARROW_CLOSEST, BESIDE, LOW, HIGH = 1.6, 3.0, 1.35, 1.7, 3.2


@dataclass(frozen=True)
class Field:
    """One panel: its title, the model's key (None for the reference), and a value by y and x."""

    label: str
    model: str | None
    values: Rows


@dataclass(frozen=True)
class Grids:
    """The numbers of a picture: panels over the same two axes, and what is not drawn.

    `labels` and `units` are those of x, y and the variable; `left_out` the models without a panel. `closest` has
    by y and x the key of the model with the smallest |e_error|, `distance` that number; a map has neither.
    """

    title: str
    conditions: str
    variable: str
    x: str
    y: str
    labels: tuple[str, str, str]
    units: tuple[str, str, str]
    x_values: tuple[float, ...]
    y_values: tuple[float, ...]
    x_log: bool
    y_log: bool
    signed: bool
    panels: tuple[Field, ...]
    not_drawn: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    closest: tuple[tuple[str | None, ...], ...] = ()
    distance: Rows = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of what `rows` gives."""
        return ("model", self.x, self.y, self.variable, *(("closest", "abs_e_error") if self.closest else ()))

    @property
    def shares(self) -> dict[str | None, float]:
        """The part of all cells where each model is closest, in the result's order; None is where none is."""
        count = Counter(key for row in self.closest for key in row)
        keys = (*(panel.model for panel in self.panels), None)
        return {key: count[key] / count.total() for key in keys if count[key]}

    @property
    def names(self) -> set[str]:
        """What a label can be given to."""
        return {self.x, self.y, self.variable, *(panel.model for panel in self.panels if panel.model)}

    def table(self) -> dict[str, Sequence[object]]:
        """The numbers behind the picture by name, a column for each model; x runs slowest."""
        x_unit, y_unit, unit = self.units
        columns: dict[str, Sequence[object]] = {
            heading(self.x, unit=x_unit): np.repeat(self.x_values, len(self.y_values)).tolist(),
            heading(self.y, unit=y_unit): np.tile(self.y_values, len(self.x_values)).tolist(),
        }
        for panel in self.panels:
            columns[heading(self.variable, panel.model or "", unit)] = np.transpose(panel.values).ravel().tolist()
        if self.closest:
            columns["closest"] = [key or "" for key in np.transpose(np.array(self.closest, object)).ravel()]
            columns["abs_e_error"] = np.transpose(self.distance).ravel().tolist()
        return columns

    def rows(self) -> Iterator[tuple[str | float, ...]]:
        """The numbers behind the picture, one point a row."""
        for panel in self.panels:
            for i, x in enumerate(self.x_values):
                for j, y in enumerate(self.y_values):
                    best = (self.closest[j][i] or "", self.distance[j][i]) if self.closest else ()
                    yield (panel.model or "", x, y, panel.values[j][i], *best)


def field_map(
    dataset: xr.Dataset, *, variable: str = "e_error", x: str | None = None, y: str | None = None,
    sel: Selection = None, models: Sequence[str] | None = None, log: str = "", equations: bool = False,
) -> Grids:  # fmt: skip
    """A variable over two axes, for each model.

    Parameters
    ----------
    dataset : a result
    variable : its name
    x, y : the axes; by default e, else the first numeric axis, and the next one
    sel : values of other axes, by name; an axis that is not named shows its first value
    models : keys of the models to show; by default all, of which the first 12 are drawn
    log : axes that are logarithmic, of "x" and "y"; one that is spaced so is in any case
    equations : name the laws with the numbers of their equations in the paper

    Raises
    ------
    UsageError : the result has not got what is asked for, or not two axes
    """
    numbers = _numbers("map", dataset, variable, x, y, sel, models, log, equations, PANELS)
    if not numbers.left_out:
        return numbers
    count = f"the first {PANELS} of {PANELS + len(numbers.left_out)} models"
    return replace(numbers, conditions="; ".join(filter(None, (numbers.conditions, count))))


def validity(
    dataset: xr.Dataset, *, x: str | None = None, y: str | None = None, sel: Selection = None,
    models: Sequence[str] | None = None, log: str = "", equations: bool = False,
) -> Grids:  # fmt: skip
    """Over two axes, which model has the smallest |e_error|, and how small it is; see `field_map`.

    Of models that are equally close (to 1e-9) it is the first in the result.
    """
    numbers = _numbers("validity", dataset, "e_error", x, y, sel, models, log, equations)
    error = np.abs([panel.values for panel in numbers.panels])
    error[np.isnan(error)] = np.inf
    # the first place where it is so
    place = np.argmax(error <= error.min(axis=0) + TIE, axis=0)
    closest = np.array([panel.model for panel in numbers.panels], object)[place]
    distance = np.take_along_axis(error, place[None], axis=0)[0]
    unknown = np.isinf(distance)
    closest[unknown], distance[unknown] = None, np.nan
    return replace(numbers, closest=_rows(closest), distance=_rows(distance))


def _rows(values: NDArray[Any]) -> tuple[Any, ...]:
    return tuple(map(tuple, values.tolist()))


def _numbers(
    kind: str, dataset: xr.Dataset, variable: str, x: str | None, y: str | None,
    sel: Selection, models: Sequence[str] | None, log: str, equations: bool, most: int | None = None,
) -> Grids:  # fmt: skip
    """The panels of the models, at most so many; of the others nothing is read."""
    if "model" not in dataset.dims:
        raise UsageError(NO_SWEEP)
    if variable not in dataset.data_vars:
        known = did_you_mean(variable, [str(name) for name in dataset.data_vars])
        raise UsageError(f'no variable "{safe_text(variable)}" in this result; {known}')
    data, x, y, not_drawn = take_plane(dataset, kind, x, y, sel, models)
    field, plane = data[variable], (*data[y].dims, *data[x].dims)
    left_out: tuple[str, ...] = ()
    if "model" in field.dims:
        left_out = tuple(map(str, field["model"].values[most:].tolist())) if most is not None else ()
        field = field.isel(model=slice(most))
    what = safe_text(f"{variable} over {x} and {y}")
    if field.dtype.kind not in "iuf" or not set(plane) <= set(field.dims):
        raise UsageError(f"no picture of {what}: it is not a number at each point")
    # of shape (models, y, x); the reference has no models
    in_memory = read(field.to_dataset(name=variable), [variable])[variable]
    values = np.asarray(in_memory.transpose(..., *plane).values, float)
    values = values.reshape(-1, *values.shape[-2:])
    finite = values[np.isfinite(values)]
    if not finite.size:
        raise UsageError(f"no picture of {what}: it has no value there")
    for letter, name in (("x", x), ("y", y)):
        if letter in log and data[name].values[0] <= 0.0:
            raise UsageError(f"--log {letter}: {safe_text(name)} has values that are not above 0")
    names: list[tuple[str, str | None]] = [(f"{REFERENCE} (6), (7)" if equations else REFERENCE, None)]
    if "model" in field.dims:
        by_model = (data.isel(model=place) for place in range(field.sizes["model"]))
        names = [(label_of(part, numbered=equations), str(part["model"].item())) for part in by_model]

    own = safe_text(str(dataset.attrs.get("title", "")), 140)
    x_label, y_label, label = (words_of(data[name].attrs, name) for name in (x, y, variable))
    x_unit, y_unit, unit = (
        safe_text(plain_unit(str(data[name].attrs.get("units", "1")))) for name in (x, y, variable)
    )
    label = "Error" if variable == "e_error" else label[:1].upper() + label[1:]
    title = safe_text(f"{label if kind == 'map' else 'Closest model'} over {x} and {y}")
    return Grids(
        f"{title}: {own}" if own else title, conditions_of(data, x, y), variable, x, y,
        labels=(x_label, y_label, label),
        units=(x_unit, y_unit, unit),
        x_values=tuple(data[x].values.tolist()),
        y_values=tuple(data[y].values.tolist()),
        x_log="x" in log or is_geometric(data[x].values),
        y_log="y" in log or is_geometric(data[y].values),
        # errors, and what has values of both signs, not by rounding alone
        signed=variable.endswith(("_error", "energy_residual")) or bool(-finite.min() > 1e-3 * finite.max() > 0.0),
        panels=tuple(Field(*name, _rows(part)) for name, part in zip(names, values, strict=True)),
        not_drawn=not_drawn,
        left_out=left_out,
    )  # fmt: skip


def edges_of(values: Sequence[float], log: bool) -> Array:
    """The edges of cells, half way between their values, of shape (values + 1,).

    >>> edges_of([0.0, 1.0, 3.0], log=False).tolist(), edges_of([1.0, 100.0], log=True).round(9).tolist()
    ([-0.5, 0.5, 2.0, 4.0], [0.1, 10.0, 1000.0])
    """
    at = np.log(values) if log else np.asarray(values, float)
    middle = (at[1:] + at[:-1]) / 2.0
    edges = np.concatenate(([2.0 * at[0] - middle[0]], middle, [2.0 * at[-1] - middle[-1]]))
    return np.asarray(np.exp(edges) if log else edges)


def panels_per_row(numbers: Grids, width: float) -> int:
    """How many panels stand beside each other in a figure of some width [in], with as many in each row."""
    count = 2 if numbers.closest else len(numbers.panels)
    fit = max(1, int(width / (NARROW_CLOSEST if numbers.closest else NARROW)))
    return -(-count // -(-count // fit))


def height_of(numbers: Grids, width: float) -> float:
    """The height of a row of panels in a figure of some width [in]."""
    return float(min(max(0.9 * (width - BESIDE) / panels_per_row(numbers, width), LOW), HIGH))


def draw_grids(numbers: Grids, all_axes: Sequence[Axes], labels: Mapping[str, str]) -> list[tuple[Artist, str]]:
    """Draw panels over two axes.

    Parameters
    ----------
    numbers : what is drawn
    all_axes : for each panel
    labels : texts in place of those of axes and laws, by name

    Returns
    -------
    handles and names of a legend
    """
    x, y = edges_of(numbers.x_values, numbers.x_log), edges_of(numbers.y_values, numbers.y_log)
    draw = _draw_closest if numbers.closest else _draw_fields
    mesh, entries = draw(numbers, all_axes, x, y, labels)
    names = [labels.get(panel.model or "reference", pretty_conditions(panel.label)) for panel in numbers.panels]
    titles = ["Closest model", "Its absolute error"] if numbers.closest else names
    for axes, title in zip(all_axes, titles, strict=True):
        axes.set_title(title)
        axes.grid(False)
        axes.set(xscale="log" if numbers.x_log else "linear", yscale="log" if numbers.y_log else "linear")
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        for axis, place, name, values, log in (
            (axes.xaxis, 0, numbers.x, numbers.x_values, numbers.x_log),
            (axes.yaxis, 1, numbers.y, numbers.y_values, numbers.y_log),
        ):
            largest = max(map(abs, values))
            label_axis(axis, numbers.labels[place], name, numbers.units[place], largest, labels, log=log)
    if len(all_axes) > 1 and isinstance(figure := all_axes[0].figure, Picture):
        figure.share_labels(all_axes[0].get_xlabel(), all_axes[0].get_ylabel())
        for axes in all_axes:
            axes.set(xlabel="", ylabel="")
    bar_axes = all_axes[-1:] if numbers.closest else list(all_axes)
    grid = all_axes[0].get_gridspec()
    rows = grid.nrows if grid is not None and not numbers.closest else 1
    more = "min" if numbers.closest and np.nanmin(numbers.distance) < SMALLEST else "neither"
    bar = all_axes[0].figure.colorbar(mesh, ax=bar_axes, extend=more, pad=0.02, aspect=25 * rows)
    if numbers.closest:
        number_axis(bar.ax.yaxis, log=True)
    else:
        largest = max(map(abs, mesh.get_clim()))
        label_axis(bar.ax.yaxis, numbers.labels[2], numbers.variable, numbers.units[2], largest, labels, log=False)
    return entries


def _draw_fields(
    numbers: Grids, axes: Sequence[Axes], x: Array, y: Array, labels: Mapping[str, str]
) -> tuple[QuadMesh, list[tuple[Artist, str]]]:
    """The panels of a map; returns what the colour bar is of, and what the legend holds."""
    values = np.ma.masked_invalid([panel.values for panel in numbers.panels])
    low, top = float(values.min()), float(values.max())
    if numbers.signed:
        low, top = -max(abs(low), abs(top)), max(abs(low), abs(top))
    norm = Normalize(low, top) if low < top else Normalize(low - 0.5, low + 0.5)
    return _draw_values(numbers, axes, x, y, values, norm, "RdBu_r" if numbers.signed else "viridis")


def _draw_closest(
    numbers: Grids, axes: Sequence[Axes], x: Array, y: Array, labels: Mapping[str, str]
) -> tuple[QuadMesh, list[tuple[Artist, str]]]:
    """The two panels of the closest model; returns the same."""
    names = {
        panel.model: labels.get(panel.model or "", pretty_conditions(panel.label)) for panel in numbers.panels
    }
    looks = looks_of([panel.model for panel in numbers.panels if panel.model in numbers.shares and panel.model])
    closest = np.array(numbers.closest, object)
    entries: list[tuple[Artist, str]] = []
    for key, share in numbers.shares.items():
        look = FAILED
        if key:
            own = looks[key]
            look = {"facecolor": own["color"], "hatch": own["hatch"], "edgecolor": "white", "linewidth": 0}
        axes[0].add_patch(_cells(x, y, closest == key, look))
        entries.append((Patch(**look), f"{percentage(share)}  {names[key] if key else NO_VALUE}"))
    shown = np.ma.maximum(np.ma.masked_invalid(numbers.distance), SMALLEST)
    norm = LogNorm(shown.min(), max(shown.max(), 10.0 * shown.min()))
    mesh, rest = _draw_values(numbers, axes[1:], x, y, shown[None], norm, "viridis")
    return mesh, entries + [(artist, name) for artist, name in rest if name != NO_VALUE]


def _draw_values(
    numbers: Grids, axes: Sequence[Axes], x: Array, y: Array, values: Any, norm: Normalize, colours: str
) -> tuple[QuadMesh, list[tuple[Artist, str]]]:
    """Values, of shape (axes, y, x), as colours with contour lines; returns the same."""
    name = symbol("abs_e_error" if numbers.closest else "e_error") + (" = " if numbers.closest else " = ±")
    entries: dict[float, tuple[Artist, str]] = {}
    for one, field in zip(axes, values, strict=True):
        mesh = one.pcolormesh(x, y, field, norm=norm, cmap=colours, rasterized=values.size > LARGE)
        if field.mask.any():
            one.add_patch(_cells(x, y, np.ma.getmaskarray(field), FAILED))
            entries[0.0] = Patch(**FAILED), NO_VALUE
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
            line = Line2D([], [], color="black", linewidth=0.8, linestyle=CONTOURS[level])
            entries[level] = line, f"{name}{level:g}"
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


def place_panels(picture: Picture, numbers: Grids, width: float, count: int) -> tuple[list[Axes], float]:
    """Axes for all panels in rows, and the height of all rows [in]; ticks are named at the left and below only."""
    columns = panels_per_row(numbers, width)
    rows = -(-count // columns)
    grid = picture.subplots(rows, columns, squeeze=False)
    for place, axes in enumerate(grid.ravel()):
        axes.tick_params(labelleft=place % columns == 0, labelbottom=place + columns >= count)
        if place >= count:
            axes.remove()
    return list(grid.ravel()[:count]), rows * (height_of(numbers, width) + 0.25) + 0.3
