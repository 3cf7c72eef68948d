"""Pictures of curves: velocities, restitution and its error over one axis of a result; how curves are drawn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from numpy.typing import NDArray

from ..errors import UsageError
from ..formatting import heading
from ..results.schema import plain_unit
from ..text import safe_text
from .labels import REFERENCE, label_axis, law_text, pretty_conditions, symbol, words_of
from .slices import Selection, conditions_of, is_ordered, own_conditions, read, scalars_of, take_line
from .style import is_geometric, looks_of

if TYPE_CHECKING:
    import xarray as xr

    from .data import Points

FIGURE_6 = "Final velocities comparison"
Array = NDArray[np.float64]
# distances from zero that are shaded, the widest first, and their colours
BANDS = (0.05, 0.01)
BAND_COLOURS = ("#ebf3f8", "#cde2ef")
# an error below this is the solver's, and has no place on a logarithmic axis
SMALLEST = 1e-9
# of a picture with one panel, and with several: height of a panel over the width
HEIGHT, HEIGHT_OF_SEVERAL = 0.56, 0.36
# from so many laws on a legend has keys in place of titles
MANY_LAWS = 16


@dataclass(frozen=True)
class Curve:
    """One curve: its name, the model's key (None for a reference), its points, and a name beside the last one.

    `variable` is what its y is, under the name of the result file or of a time history.
    """

    label: str
    model: str | None
    x: tuple[float, ...]
    y: tuple[float, ...]
    end: str = ""
    variable: str = ""


@dataclass(frozen=True)
class Mark:
    """A point of a curve with a name, such as tau_c, which stands at the foot of its line to the axis `along`."""

    label: str
    x: float
    y: float
    along: Literal["x", "y"]


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes, of which each has a label in words, a name, and a unit in SI.

    `bands` are distances from zero that are shaded, the widest first; `marks` are points with names; `joined` says
    whether lines join the points.
    """

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_unit: str = "1"
    y_unit: str = "1"
    x_log: bool = False
    y_log: bool = False
    bands: tuple[float, ...] = ()
    marks: tuple[Mark, ...] = ()
    x_name: str = ""
    y_name: str = ""
    joined: bool = True


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
            axes = (
                heading(f"{panel.x_label},", panel.x_name, panel.x_unit),
                heading(f"{panel.y_label},", panel.y_name, panel.y_unit),
            )
            for curve in panel.curves:
                name = " ".join(part for part in (curve.label, curve.end) if part)
                for x, y in zip(curve.x, curve.y, strict=True):
                    yield (*axes, name, curve.model or "", x, y)

    def table(self) -> dict[str, tuple[float, ...]]:
        """The numbers behind the picture, a column for each curve, after the x of those that share it.

        The names are ASCII: variable, model, and the unit in brackets.
        """
        columns: dict[str, tuple[float, ...]] = {}
        all_curves = [(panel, curve) for panel in self.panels for curve in panel.curves]
        is_shared = all(curve.x == all_curves[0][1].x for _, curve in all_curves)
        for panel, curve in all_curves:
            owner = curve.model or "reference"
            columns[heading(panel.x_name, "" if is_shared else owner, panel.x_unit)] = curve.x
            columns[heading(curve.variable, owner, panel.y_unit)] = curve.y
        return columns

    @property
    def names(self) -> set[str]:
        """What a label can be given to."""
        axes = {name for panel in self.panels for name in (panel.x_name, panel.y_name)}
        return axes | {curve.model for panel in self.panels for curve in panel.curves if curve.model}


def final_velocities(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Selection = None,
    models: Sequence[str] | None = None,
    log: str = "",
    *,
    equations: bool = False,
) -> Lines:
    """Figure 6 of the paper: post-impact velocities of every model and of the impulse-momentum solution.

    Parameters
    ----------
    dataset : a result
    x, sel, models : see `impact.plots.slices.take_line`
    log : axes that are logarithmic, of "x" and "y"; an x that is spaced so is in any case
    equations : name the laws with the numbers of their equations in the paper

    Raises
    ------
    UsageError : the result has not got what is asked for
    """
    data, x, not_drawn = _along(dataset, x, sel, models, "v1_post", "v2_post", "v1_reference", "v2_reference")
    reference = f"{REFERENCE} (6), (7)" if equations else REFERENCE
    references = [
        _curve(reference, None, data, x, data[f"v{ball}_reference"], f"v{ball}_post", end)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    curves = [
        _curve(label, key, data, x, of_model[f"v{ball}_post"], f"v{ball}_post", end)
        for label, key, of_model in _laws(data, equations)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    panel = Panel("", "Velocity after the impact", (*_known(references), *curves), y_unit="m/s", y_name="v_post")
    return _lines(dataset, data, x, FIGURE_6, [panel], not_drawn, log)


def restitution(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Selection = None,
    models: Sequence[str] | None = None,
    log: str = "",
    *,
    equations: bool = False,
) -> Lines:
    """The delivered restitution of every model, beside what was asked for; see `final_velocities`."""
    data, x, not_drawn = _along(dataset, x, sel, models, "e_out")
    asked = [_curve("As asked for", None, data, x, data["e"], "e")] if "e" in data.coords else []
    curves = [
        _curve(label, key, data, x, of_model["e_out"], "e_out") for label, key, of_model in _laws(data, equations)
    ]
    panel = Panel("", "Delivered restitution", (*_known(asked), *curves), y_name="e_out")
    return _lines(dataset, data, x, "Delivered restitution", [panel], not_drawn, log)


def error(
    dataset: xr.Dataset,
    x: str | None = None,
    sel: Selection = None,
    models: Sequence[str] | None = None,
    log: str = "",
    *,
    equations: bool = False,
) -> Lines:
    """What every model's restitution is off by, signed and absolute; see `final_velocities`."""
    data, x, not_drawn = _along(dataset, x, sel, models, "e_error")
    laws = [(label, key, of_model["e_error"].values) for label, key, of_model in _laws(data, equations)]
    if not any(np.isfinite(values).any() for _, _, values in laws):
        raise UsageError(
            "this result has no error of the restitution, which needs an e that is asked for; sweep e"
        )
    signed = [_curve(label, key, data, x, values, "e_error") for label, key, values in laws]
    absolute = [
        _curve(label, key, data, x, np.maximum(np.abs(values), SMALLEST), "abs_e_error")
        for label, key, values in laws
    ]
    panels = [
        Panel("", "Error", tuple(signed), bands=BANDS, y_name="e_error"),
        Panel("", "Absolute error", tuple(absolute), y_log=True, bands=BANDS, y_name="abs_e_error"),
    ]
    return _lines(dataset, data, x, "Error of the restitution", panels, not_drawn, log)


def _along(
    dataset: xr.Dataset, x: str | None, sel: Selection, models: Sequence[str] | None, *names: str
) -> tuple[xr.Dataset, str, tuple[str, ...]]:
    """The line of a result that is drawn, with its variables in memory; over what; what is not drawn."""
    line, x, not_drawn = take_line(dataset, x, sel, models)
    missing = [name for name in names if name not in dataset]
    if missing:
        raise UsageError(f"this result has no {', '.join(missing)}; sweep without [output] variables, or add them")
    return read(line, names), x, not_drawn


def _laws(data: xr.Dataset, equations: bool) -> Iterator[tuple[str, str, xr.Dataset]]:
    """The name of each model of a slice, its key, and its part."""
    for place in range(data.sizes["model"]):
        of_model = data.isel(model=place)
        key = str(of_model["model"].item())
        yield label_of(of_model, numbered=equations), key, of_model


def label_of(of_model: xr.Dataset, *, numbered: bool = False) -> str:
    """The name of a model of a result, with its own parameters."""
    title, year, equation = (of_model[name].item() for name in ("title", "year", "equation"))
    own = own_conditions(str(of_model["model"].item()), scalars_of(of_model))
    return law_text(str(title), int(year), str(equation), own, numbered=numbered)


def _curve(
    label: str,
    model: str | None,
    data: xr.Dataset,
    x: str,
    values: xr.DataArray | Array,
    variable: str,
    end: str = "",
) -> Curve:
    along = np.asarray(data[x].values, float)
    drawn = np.broadcast_to(np.asarray(values, float), along.shape)
    return Curve(label, model, tuple(along.tolist()), tuple(drawn.tolist()), end, variable)


def _known(references: list[Curve]) -> list[Curve]:
    """Without a restitution asked for there is no reference."""
    return [curve for curve in references if np.isfinite(curve.y).any()]


def _lines(
    dataset: xr.Dataset, data: xr.Dataset, x: str, title: str, panels: Sequence[Panel], not_drawn: tuple[str, ...],
    log: str,
) -> Lines:  # fmt: skip
    own, conditions = safe_text(str(dataset.attrs.get("title", "")), 140), conditions_of(data, x)
    if own and title != FIGURE_6:
        own, conditions = title, ": ".join(filter(None, (own, conditions)))
    values = data[x].values
    along: dict[str, Any] = {
        "x_name": x, "x_label": words_of(data[x].attrs, x),
        "x_unit": safe_text(plain_unit(str(data[x].attrs.get("units", "1")))),
        "x_log": is_geometric(values) or ("x" in log and bool(np.all(values > 0.0))),
        "joined": is_ordered(dataset, x),
    }  # fmt: skip
    panels = [replace(panel, y_log=panel.y_log or "y" in log, **along) for panel in panels]
    empty = {c.model: None for panel in panels for c in panel.curves if c.model and not np.isfinite(c.y).any()}
    without = tuple(f"{key}, which has no point here" for key in empty)
    return Lines(own or title, conditions, tuple(panels), (*not_drawn, *without))


def draw_lines(
    numbers: Lines, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None
) -> list[tuple[Artist, str]]:
    """Draw curves, and measured points over them.

    Parameters
    ----------
    numbers : what is drawn
    all_axes : for each panel
    labels : texts in place of those of axes and laws, by name
    points : what was measured

    Returns
    -------
    handles and names of a legend
    """
    models = dict.fromkeys(curve.model for panel in numbers.panels for curve in panel.curves if curve.model)
    looks = looks_of([model for model in models if model])
    entries: dict[str, Artist] = {}
    for axes, panel in zip(all_axes, numbers.panels, strict=True):
        _draw_bands(axes, panel)
        axes.set(xscale="log" if panel.x_log else "linear", yscale="log" if panel.y_log else "linear")
        for curve in panel.curves:
            own = labels.get(curve.model or "reference")
            short = curve.model if curve.model and len(looks) >= MANY_LAWS else curve.label
            name = own or pretty_conditions(short)
            (line,) = axes.plot(curve.x, curve.y, label=f"_{name}", **_look(curve, panel, looks))
            entries.setdefault(name, line)
        entries |= points.draw(axes, panel) if points else {}
        # the names of marks need room at the ends of the axes
        axes.margins(x=0.06 if panel.marks else 0.02, y=0.12 if panel.marks else None)
        axes.autoscale_view()
        _label_axes(axes, panel, labels, last=axes is all_axes[-1] or len(all_axes) == 1)
        for mark in panel.marks:
            _mark(axes, mark)
        _name_ends(axes, panel.curves)
    return [(artist, name) for name, artist in entries.items()]


def _look(curve: Curve, panel: Panel, looks: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """How a curve is drawn: a reference as a plain line, points without order without one."""
    points = len(curve.x)
    scattered: dict[str, Any] = {} if panel.joined else {"linestyle": "none"}
    if curve.model is None:
        # without a line it is a disc that shows around the models' markers
        disc = {"marker": "o", "markersize": 9.0, "alpha": None} if points == 1 or scattered else {}
        return {"color": "black" if not disc else "#c0c0c0", "linewidth": 2.0, "zorder": 1.5, **disc, **scattered}
    look = {key: value for key, value in looks[curve.model].items() if key != "hatch"}
    # the markers of different models stand at different points, so that equal curves show both
    every = 1 if scattered else max(1, points // 12)
    start = list(looks).index(curve.model) * every // max(1, len(looks)) % every
    return {**look, "markevery": (start, every), "markerfacecolor": "white", **scattered}


def _draw_bands(axes: Axes, panel: Panel) -> None:
    for band, colour in zip(panel.bands, BAND_COLOURS, strict=False):
        if panel.y_log:
            axes.axhline(band, color="#5a9cc5", linewidth=0.8, zorder=0.5)
            axes.annotate(
                f"{band:g}", (1, band), (-2, 1), xycoords=("axes fraction", "data"), textcoords="offset points",
                ha="right", va="bottom", fontsize="x-small", color="#0072B2",
            )  # fmt: skip
        else:
            axes.axhspan(-band, band, color=colour, linewidth=0, zorder=0.5)


def _label_axes(axes: Axes, panel: Panel, labels: Mapping[str, str], *, last: bool) -> None:
    """The labels of both axes, each with one prefix of its unit."""
    for axis, words, name, unit, limits, log in (
        (axes.xaxis, panel.x_label, panel.x_name, panel.x_unit, axes.get_xlim(), panel.x_log),
        (axes.yaxis, panel.y_label, panel.y_name, panel.y_unit, axes.get_ylim(), panel.y_log),
    ):
        label_axis(axis, words, name, unit, max(map(abs, limits)), labels, log=log)
    if not last:
        axes.set_xlabel("")


def _mark(axes: Axes, mark: Mark) -> None:
    """A point, a dashed line from it to its axis, and its name at the foot of the line."""
    low = axes.get_xlim()[0] if mark.along == "y" else axes.get_ylim()[0]
    foot = (mark.x, low) if mark.along == "x" else (low, mark.y)
    dashes: dict[str, Any] = {"color": "#777777", "linewidth": 0.8, "linestyle": (0, (4, 2)), "zorder": 1.2}
    limits = axes.get_xlim(), axes.get_ylim()
    axes.plot((mark.x, foot[0]), (mark.y, foot[1]), label="_", **dashes)
    axes.plot([mark.x], [mark.y], "o", color="black", markersize=3.5, label="_", zorder=3)
    axes.set(xlim=limits[0], ylim=limits[1])
    axes.annotate(
        symbol(mark.label), foot, (4, 3), textcoords="offset points", fontsize="large", va="bottom", ha="left"
    )


def _name_ends(axes: Axes, curves: Sequence[Curve]) -> None:
    """Names beside the last points: where several end together, one stands below and the other above."""
    ends: dict[str, tuple[float, float]] = {}
    for curve in curves:
        drawn = np.flatnonzero(np.isfinite(curve.y))
        if curve.end and drawn.size:
            ends.setdefault(curve.variable, (curve.x[drawn[-1]], curve.y[drawn[-1]]))
    low, high = axes.get_ylim()
    ordered = sorted((point[1], name) for name, point in ends.items())
    for place, (y, name) in enumerate(ordered):
        near = [other for other, _ in ordered if abs(other - y) < 0.06 * (high - low)]
        aside = (-8 if place == 0 else 8) if len(near) > 1 else 0
        axes.annotate(
            symbol(name), ends[name], (6, aside), textcoords="offset points", va="center", fontsize="large",
            annotation_clip=False,
        )  # fmt: skip
