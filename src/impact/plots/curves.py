"""Curves over one axis of a result: velocities, restitution and its error; their data and their drawing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..errors import UsageError
from ..formatting import heading, label as number_label
from ..results.schema import plain_unit
from ..text import safe_text
from .data import MEASURED
from .labels import REFERENCE, label_axis, law_text, pretty_conditions, symbol, words_of
from .slices import NO_BREAK, conditions_of, is_ordered, parameter_text, read, scalars_of, take_line
from .style import is_geometric, model_styles

if TYPE_CHECKING:
    import xarray as xr

    from .data import Points
    from .kinds import Choice

BAND_NAME = "Least to largest over the phase"
FIGURE_6 = "Final velocities comparison"
# distances from zero that are shaded, the widest first, and their colours
BANDS = (0.05, 0.01)
BAND_COLOURS = ("#ebf3f8", "#cde2ef")
# the smallest |e_error| on a logarithmic axis: smaller ones are errors of the solver
MIN_DRAWN_ERROR = 1e-9
# height of a panel over the width of the picture: of a single panel, and of several below each other
PANEL_ASPECT, STACKED_PANEL_ASPECT = 0.56, 0.36
# the axes of a picture of fixed steps, and the message about a result without one
STEP_AXES = ("steps_per_contact", "dt")
NEEDS_STEPS = 'timestep needs an axis steps_per_contact or dt, with solver.integrator = "kick-drift"'
# values of e of a picture of fixed steps
MAX_RESTITUTIONS = 8
# the part of a model's colour in a band, on white; and the least distance of labels, as a part of the axis
BAND_SHADE, LABEL_DISTANCE = 0.22, 0.055
# from this number of laws on the legend shows keys instead of titles
MANY_LAWS = 16


@dataclass(frozen=True)
class Curve:
    """One curve.

    Parameters
    ----------
    label : its name in the legend
    model : key of the model; None for a reference
    x, y : its points, in SI
    end : text beside the last point
    variable : name of its y in a result or a time history
    case : value of an input that distinguishes curves of one model, such as "e = 0.5"
    least, largest : a band around the curve; empty for none
    is_guide : whether it is a thin line, with its case beside its end
    """

    label: str
    model: str | None
    x: tuple[float, ...]
    y: tuple[float, ...]
    end: str = ""
    variable: str = ""
    case: str = ""
    least: tuple[float, ...] = ()
    largest: tuple[float, ...] = ()
    is_guide: bool = False


@dataclass(frozen=True)
class Mark:
    """A named point of a curve, such as tau_c; a dashed line joins it to the axis `along`."""

    label: str
    x: float
    y: float
    along: Literal["x", "y"]


@dataclass(frozen=True)
class Panel:
    """Curves over one pair of axes.

    Parameters
    ----------
    x_label, y_label : meaning of each axis in words
    curves : the curves
    x_unit, y_unit : unit of each axis, in SI
    x_log, y_log : whether the axis is logarithmic
    bands : distances from zero that are shaded, the widest first
    marks : named points
    x_name, y_name : name of each axis in a result or a time history
    joined : whether lines join the points
    band_name : what the bands around curves are, for the legend
    height : relative to other panels
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
    band_name: str = ""
    height: float = 1.0


@dataclass(frozen=True)
class CurveData:
    """The data of a picture of curves.

    It has a title, conditions, panels one below the other, what is not drawn, and measured points of each panel,
    if the result has them itself.
    """

    title: str
    conditions: str
    panels: tuple[Panel, ...]
    not_drawn: tuple[str, ...] = ()
    measured: tuple[Points, ...] = ()

    columns = ("x_axis", "y_axis", "curve", "model", "x", "y")

    def rows(self) -> Iterator[tuple[str | float, ...]]:
        """The points of all curves and the measured ones, one per row, with the columns `columns`."""
        for panel, points in zip_longest(self.panels, self.measured):
            axes = (
                heading(f"{panel.x_label},", panel.x_name, panel.x_unit),
                heading(f"{panel.y_label},", panel.y_name, panel.y_unit),
            )
            for curve in panel.curves:
                name = " ".join(part for part in (curve.label, curve.end) if part)
                name = ", ".join(part for part in (name, curve.case) if part)
                for suffix, values in (("", curve.y), (", least", curve.least), (", largest", curve.largest)):
                    for x, y in zip(curve.x, values, strict=bool(values)):
                        yield (*axes, name + suffix, curve.model or "", x, y)
            if points is not None and points.columns:
                x_values = points.columns[panel.x_name].tolist()
                for column, measured in points.columns.items():
                    if column != panel.x_name:
                        name = MEASURED if column == panel.y_name else f"{MEASURED}, {column}"
                        for x, y in zip(x_values, measured.tolist(), strict=True):
                            yield (*axes, name, "", x, y)

    def table(self) -> dict[str, tuple[float, ...]]:
        """The points of all curves and the measured ones, one column per curve; curves with the same x share it.

        The names of the columns are ASCII: variable, model, and the unit in brackets.
        """
        columns: dict[str, tuple[float, ...]] = {}
        all_curves = [(panel, curve) for panel in self.panels for curve in panel.curves]
        is_shared = all(curve.x == all_curves[0][1].x for _, curve in all_curves)
        for panel, curve in all_curves:
            owner = curve.model or "reference"
            name = " ".join(part for part in (owner, curve.case.replace(" ", "")) if part)
            x_column = heading(panel.x_name, "" if is_shared else owner, panel.x_unit)
            # a law may have other points in another panel, such as its residuals
            if columns.get(x_column, curve.x) != curve.x:
                x_column = heading(panel.x_name, f"{curve.variable} {name}", panel.x_unit)
            columns[x_column] = curve.x
            for suffix, values in (("", curve.y), ("_least", curve.least), ("_largest", curve.largest)):
                if values:
                    columns[heading(f"{curve.variable}{suffix}", name, panel.y_unit)] = values
        for panel, points in zip(self.panels, self.measured, strict=False):
            for column, measured in points.columns.items():
                of = "measured" if column == panel.y_name else f"{panel.y_name} measured"
                unit = panel.x_unit if column == panel.x_name else panel.y_unit
                columns[heading(column, of, unit)] = tuple(measured.tolist())
        return columns

    @property
    def names(self) -> set[str]:
        """The axes, variables with a name beside their curves, and models whose text a user can replace."""
        all_curves = [curve for panel in self.panels for curve in panel.curves]
        return {
            *(name for panel in self.panels for name in (panel.x_name, panel.y_name)),
            *(curve.variable for curve in all_curves if curve.end),
            *(curve.model or "reference" for curve in all_curves),
        }


def velocity_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Figure 6 of the paper: post-impact velocities of every model and of the impulse-momentum solution.

    Parameters
    ----------
    dataset : a result
    choice : which part of it; an x whose values are spaced evenly in their logarithm has a logarithmic axis

    Raises
    ------
    UsageError : the result does not contain what `choice` selects
    """
    line = _take_line(dataset, choice, "v1_post", "v2_post", "v1_reference", "v2_reference")
    reference = f"{REFERENCE} (6), (7)" if choice.equations else REFERENCE
    references = [
        _curve(reference, None, line, line.data[f"v{ball}_reference"], f"v{ball}_post", end)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    curves = [
        _curve(label, key, line, of_model[f"v{ball}_post"], f"v{ball}_post", end)
        for label, key, of_model in _split_by_model(line, choice)
        for ball, end in ((1, "v₁⁺"), (2, "v₂⁺"))
    ]
    all_curves = (*_without_empty(references), *curves)
    panel = Panel("", "Velocity after the impact", all_curves, y_unit="m/s", y_name="v_post")
    return _curve_data(dataset, line, FIGURE_6, [panel], choice)


def restitution_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """The delivered restitution of every model beside the requested one; see `velocity_curves`."""
    line = _take_line(dataset, choice, "e_out")
    requested = [_curve("Requested", None, line, line.data["e"], "e")] if "e" in line.data.coords else []
    curves = [
        _curve(label, key, line, of_model["e_out"], "e_out")
        for label, key, of_model in _split_by_model(line, choice)
    ]
    panel = Panel("", "Delivered restitution", (*_without_empty(requested), *curves), y_name="e_out")
    return _curve_data(dataset, line, "Delivered restitution", [panel], choice)


def error_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """The error of every model's restitution, signed and absolute; see `velocity_curves`."""
    line = _take_line(dataset, choice, "e_error")
    errors = [(label, key, of_model["e_error"].values) for label, key, of_model in _split_by_model(line, choice)]
    if not any(np.isfinite(values).any() for _, _, values in errors):
        raise UsageError("this result has no error of the restitution, which needs a requested e; sweep e")
    signed = [_curve(label, key, line, values, "e_error") for label, key, values in errors]
    absolute = [
        _curve(label, key, line, np.maximum(np.abs(values), MIN_DRAWN_ERROR), "abs_e_error")
        for label, key, values in errors
    ]
    panels = [
        Panel("", "Error", tuple(signed), bands=BANDS, y_name="e_error"),
        Panel("", "Absolute error", tuple(absolute), y_log=True, bands=BANDS, y_name="abs_e_error"),
    ]
    return _curve_data(dataset, line, "Error of the restitution", panels, choice)


def timestep_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """The restitution at fixed steps over the step: its mean over the phase, the least and the largest.

    There is a curve for each model and each requested e. For the parameters and errors see `velocity_curves`; by
    default x is the number of steps per contact, or the step.
    """
    if "phase" not in dataset.coords:
        raise UsageError(f"this result is of the continuous law; {NEEDS_STEPS}")
    along = [name for name in STEP_AXES if name in dataset.coords and dataset[name].ndim == 1]
    if choice.x is None and not along:
        raise UsageError(f"this result has a single step; {NEEDS_STEPS}")
    line = _take_line(dataset, replace(choice, x=choice.x or along[0]), "e_out", keep=("phase", "e"))
    (x_dim,) = line.data[line.x].dims
    phase_dims = [dim for dim in line.data["phase"].dims if dim != x_dim]
    e_dims = [dim for dim in (line.data["e"].dims if "e" in line.data.coords else ()) if dim not in phase_dims]
    over_e = [dim for dim in e_dims if dim != x_dim]
    count = line.data.sizes[over_e[0]] if over_e else 1
    if count > MAX_RESTITUTIONS:
        raise UsageError(
            f"got {count} values of e, expected at most {MAX_RESTITUTIONS} to draw; use --sel e=VALUE"
        )
    references: list[Curve] = []
    curves: list[Curve] = []
    for label, key, of_model in _split_by_model(line, choice):
        of_cases = [of_model.isel({over_e[0]: number}) for number in range(count)] if over_e else [of_model]
        delivered = [of_case["e_out"].transpose(x_dim, *phase_dims).values for of_case in of_cases]
        delivered = [np.asarray(values, float).reshape(len(values), -1) for values in delivered]
        # a law that does not depend on e has one curve
        differ = any(not np.array_equal(delivered[0], values, equal_nan=True) for values in delivered)
        for of_case, values in zip(of_cases, delivered, strict=True):
            case = f"e = {number_label(of_case['e'].item())}" if over_e else ""
            curve = _curve(label, key, line, values.mean(axis=1), "e_out")
            if values.shape[1] > 1:
                least, largest = (tuple(edge.tolist()) for edge in (values.min(axis=1), values.max(axis=1)))
                curve = replace(curve, least=least, largest=largest)
            if differ or not curves or curves[-1].model != key:
                curves.append(replace(curve, case=case if differ else ""))
            if "e" in of_case.coords and len(references) < count:
                at_end = f"e = {number_label(of_case['e'].item())}" if of_case["e"].ndim == 0 else ""
                guide = _curve("Requested", None, line, of_case["e"], "e")
                references.append(replace(guide, case=at_end, is_guide=True))
    shown = (*_without_empty(references), *curves)
    panel = Panel("", "Delivered restitution", shown, y_name="e_out", band_name=BAND_NAME)
    title = f"Restitution at fixed steps, {safe_text(str(dataset.attrs.get('integrator', '')), 40)}"
    plot_data = _curve_data(dataset, line, title, [panel], choice)
    panels = (replace(panel, x_log=panel.x_log or line.x in STEP_AXES) for panel in plot_data.panels)
    return replace(plot_data, panels=tuple(panels))


@dataclass(frozen=True)
class _Line:
    """A line through a result: its variables in memory, the coordinate `x`, and values that are not drawn."""

    data: xr.Dataset
    x: str
    not_drawn: tuple[str, ...]


def _take_line(dataset: xr.Dataset, choice: Choice, *names: str, keep: Sequence[str] = ()) -> _Line:
    """The line of a result that is drawn, with some variables in memory; `keep` as in `take_line`."""
    line, x, not_drawn = take_line(dataset, choice.x, choice.sel, choice.models, keep)
    missing = [name for name in names if name not in dataset]
    if missing:
        raise UsageError(f"this result has no {', '.join(missing)}; sweep without [output] variables, or add them")
    return _Line(read(line, names), x, not_drawn)


def _split_by_model(line: _Line, choice: Choice) -> Iterator[tuple[str, str, xr.Dataset]]:
    """Label, key and part of each model of a line."""
    for index in range(line.data.sizes["model"]):
        of_model = line.data.isel(model=index)
        yield model_label(of_model, numbered=choice.equations), str(of_model["model"].item()), of_model


def model_label(of_model: xr.Dataset, *, numbered: bool = False) -> str:
    """The title of a model of a result, with the values of its parameters."""
    title, year, equation = (of_model[name].item() for name in ("title", "year", "equation"))
    parameters = parameter_text(str(of_model["model"].item()), scalars_of(of_model))
    return law_text(str(title), int(year), str(equation), parameters, numbered=numbered)


def _curve(
    label: str,
    model: str | None,
    line: _Line,
    values: xr.DataArray | NDArray[np.float64],
    variable: str,
    end: str = "",
) -> Curve:
    x = np.asarray(line.data[line.x].values, float)
    y = np.broadcast_to(np.asarray(values, float), x.shape)
    return Curve(label, model, tuple(x.tolist()), tuple(y.tolist()), end, variable)


def _without_empty(curves: list[Curve]) -> list[Curve]:
    """The curves that have a finite value: without a requested restitution a reference has none."""
    return [curve for curve in curves if np.isfinite(curve.y).any()]


def _curve_data(
    dataset: xr.Dataset, line: _Line, title: str, panels: Sequence[Panel], choice: Choice
) -> CurveData:
    """The data of a picture: panels with the x axis of their line, the title and the conditions."""
    data, x = line.data, line.x
    heading = safe_text(str(dataset.attrs.get("title", "")), 140)
    conditions = conditions_of(data, x)
    if heading and title != FIGURE_6:
        heading, conditions = title, ": ".join(filter(None, (heading, conditions)))
    values = data[x].values
    x_axis: dict[str, Any] = {
        "x_name": x,
        "x_label": words_of(data[x].attrs, x),
        "x_unit": safe_text(plain_unit(str(data[x].attrs.get("units", "1")))),
        "x_log": is_geometric(values) or ("x" in choice.log and bool(np.all(values > 0.0))),
        "joined": is_ordered(dataset, x),
    }
    panels = [replace(panel, y_log=panel.y_log or "y" in choice.log, **x_axis) for panel in panels]
    empty = {c.model: None for panel in panels for c in panel.curves if c.model and not np.isfinite(c.y).any()}
    without_value = tuple(f"{key}, which has no point here" for key in empty)
    return CurveData(heading or title, conditions, tuple(panels), (*line.not_drawn, *without_value))


def draw_curves(
    plot_data: CurveData, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None
) -> list[tuple[Artist, str]]:
    """Draw curves, and measured points over them.

    Parameters
    ----------
    plot_data : the curves
    all_axes : axes of each panel
    labels : texts that replace those of axes, variables and laws, by name
    points : measured points

    Returns
    -------
    handles and names of the legend
    """
    models = dict.fromkeys(curve.model for panel in plot_data.panels for curve in panel.curves if curve.model)
    styles = model_styles([model for model in models if model])
    entries: dict[str, Artist] = {}
    band: dict[str, Artist] = {}
    stored = {panel: own for panel, own in zip(plot_data.panels, plot_data.measured, strict=False) if own.columns}
    for axes, panel in zip(all_axes, plot_data.panels, strict=True):
        _draw_bands(axes, panel)
        axes.set(xscale="log" if panel.x_log else "linear", yscale="log" if panel.y_log else "linear")
        for curve in panel.curves:
            chosen_name = labels.get(curve.model or "reference")
            default_name = curve.model if curve.model and len(styles) >= MANY_LAWS else curve.label
            name = chosen_name or pretty_conditions(default_name)
            (line,) = axes.plot(curve.x, curve.y, label=f"_{name}", **_line_style(curve, panel, styles))
            entries.setdefault(name, line)
            if curve.least:
                band[panel.band_name] = _draw_band(axes, curve, line)
        entries |= points.draw(axes, panel) if points else {}
        entries |= stored[panel].draw(axes, panel) if panel in stored else {}
        # the names of marks need room at the ends of the axes
        axes.margins(x=0.06 if panel.marks else 0.02, y=0.12 if panel.marks else None)
        axes.autoscale_view()
        _label_bands(axes, panel)
        _label_axes(axes, panel, labels, last=axes is all_axes[-1] or len(all_axes) == 1)
        for mark in panel.marks:
            _draw_mark(axes, mark)
        _label_curve_ends(axes, panel.curves, labels)
        _label_guides(axes, [curve for curve in panel.curves if curve.is_guide and curve.case])
    return [(artist, name) for name, artist in (entries | band).items()]


def _line_style(curve: Curve, panel: Panel, styles: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The line style of a curve: a reference is a plain line, points without an order have no line."""
    points = len(curve.x)
    scattered: dict[str, Any] = {} if panel.joined else {"linestyle": "none"}
    if curve.is_guide:
        return {"color": "#555555", "linewidth": 0.7, "linestyle": (0, (5, 2)), "zorder": 1.4, **scattered}
    if curve.model is None:
        # without a line it is a disc, larger than the markers of the models
        disc = {"marker": "o", "markersize": 9.0, "alpha": None} if points == 1 or scattered else {}
        return {"color": "black" if not disc else "#c0c0c0", "linewidth": 2.0, "zorder": 1.5, **disc, **scattered}
    style = {key: value for key, value in styles[curve.model].items() if key != "hatch"}
    # the markers of different models are at different points, so that equal curves show both
    every = 1 if scattered else max(1, points // 12)
    start = list(styles).index(curve.model) * every // max(1, len(styles)) % every
    return {**style, "markevery": (start, every), "markerfacecolor": "white", **scattered}


def _draw_band(axes: Axes, curve: Curve, line: Line2D) -> Artist:
    """Draw the band of a curve, opaque for formats without transparency; returns its symbol in a legend."""
    colour = to_rgb(line.get_color())
    shade = tuple(1.0 - BAND_SHADE * (1.0 - part) for part in colour)
    axes.fill_between(curve.x, curve.least, curve.largest, color=shade, linewidth=0.0, zorder=0.8)
    # the edges are above the bands of other curves
    for edge in (curve.least, curve.largest):
        axes.plot(curve.x, edge, color=colour, linewidth=0.5, label="_", zorder=1.3)
    return Patch(facecolor="#dddddd", edgecolor="#777777", linewidth=0.5)


def _label_guides(axes: Axes, guides: Sequence[Curve]) -> None:
    """Write the cases of guides beside their ends, without overlap."""
    low, high = axes.get_ylim()
    lowest = -math.inf
    for guide in sorted(guides, key=lambda curve: curve.y[-1]):
        lowest = max((guide.y[-1] - low) / (high - low), lowest + LABEL_DISTANCE)
        axes.annotate(
            pretty_conditions(guide.case.replace(" ", NO_BREAK)),
            (1.0, lowest),
            (4, 0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            fontsize="small",
            color="#555555",
            annotation_clip=False,
        )


def _draw_bands(axes: Axes, panel: Panel) -> None:
    for band, colour in zip(panel.bands, BAND_COLOURS, strict=False):
        if panel.y_log:
            # above the line of the grid, which may be at the same value
            axes.axhline(band, color="#5a9cc5", linewidth=0.8, zorder=0.6)
        else:
            axes.axhspan(-band, band, color=colour, linewidth=0, zorder=0.5)
            axes.axhline(0.0, color="#777777", linewidth=0.7, zorder=0.6)


def _label_bands(axes: Axes, panel: Panel) -> None:
    """Write the values of bands at their lines on a logarithmic axis.

    The label of the widest band is above its line. Labels of narrower bands are below theirs, where no label can
    overlap them, except near the lower end of the axis, where only the space between the lines is left.
    """
    low, high = axes.get_ylim()
    for band in panel.bands if panel.y_log else ():
        is_below = band != panel.bands[0] and band > (low * high) ** 0.5
        axes.annotate(
            f"{band:g}",
            (1, band),
            (-2, -1 if is_below else 1),
            xycoords=("axes fraction", "data"),
            textcoords="offset points",
            ha="right",
            va="top" if is_below else "bottom",
            fontsize="x-small",
            color="#0072B2",
        )


def _label_axes(axes: Axes, panel: Panel, labels: Mapping[str, str], *, last: bool) -> None:
    """Write the labels of both axes, each with one prefix of its unit."""
    for axis, meaning, name, unit, limits, log in (
        (axes.xaxis, panel.x_label, panel.x_name, panel.x_unit, axes.get_xlim(), panel.x_log),
        (axes.yaxis, panel.y_label, panel.y_name, panel.y_unit, axes.get_ylim(), panel.y_log),
    ):
        label_axis(axis, meaning, name, unit, max(map(abs, limits)), labels, log=log)
    if not last:
        axes.set_xlabel("")


def _draw_mark(axes: Axes, mark: Mark) -> None:
    """Draw a point, a dashed line from it to its axis, and its name at the foot of the line."""
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


def _label_curve_ends(axes: Axes, curves: Sequence[Curve], labels: Mapping[str, str]) -> None:
    """Write names beside the last points: where several end together, one is below and the others above."""
    ends: dict[str, tuple[float, float]] = {}
    for curve in curves:
        drawn = np.flatnonzero(np.isfinite(curve.y))
        if curve.end and drawn.size:
            ends.setdefault(curve.variable, (curve.x[drawn[-1]], curve.y[drawn[-1]]))
    low, high = axes.get_ylim()
    ordered = sorted((point[1], name) for name, point in ends.items())
    for rank, (y, name) in enumerate(ordered):
        near = [other for other, _ in ordered if abs(other - y) < 0.06 * (high - low)]
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
