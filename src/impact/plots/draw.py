"""Draw a result, in a figure or into files: the data of a picture, its panels and its texts."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter

from ..atomic import check_outputs, write_file
from ..contact.model import ForceModel
from ..display import TableForm, check_suffix, encode_frame
from ..engine.plugins import read_plugins
from ..errors import UsageError
from ..formatting import argument
from ..results.schema import shared_exponent
from ..results.single_impact import Impact, histories
from ..results.xarray_backend import load, result_to_show
from .curves import CurveData
from .data import LegendEntries, PlotData, Points, read_points
from .kinds import DEFAULT_LEGENDS, STUDIES, Choice, Look, check_choice, default_kind, find_kind
from .labels import (
    SLOW_LIMIT,
    check_labels,
    escape_mathtext,
    legend_labels,
    parameters_of_laws,
    pretty_conditions,
    tick_with_comma,
    with_comma,
)
from .layout import LEGEND_PART, Picture
from .style import check_picture, default_size, save_figure, styled

Plugins = Sequence[ForceModel | str | Path]


def plot(
    dataset: xr.Dataset | Impact | str | Path,
    *,
    kind: str | None = None,
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
    sel: Mapping[str, object] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | pd.DataFrame | xr.Dataset | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool | None = None,
    legend: str | None = None,
    decimal: str = "point",
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    frictions: Sequence[str] | None = None,
    ax: Axes | Sequence[Axes] | None = None,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> Figure:
    """Draw a result; by default the final-velocity comparison, Figure 6 of the paper.

    Parameters
    ----------
    dataset : a result or its file, a time history, or an impact of `run`
    kind : one of `impact.plots.kinds.KINDS`; by default "final-velocities", "uncertainty" for samples of uncertain
        inputs, "loop" for an impact, or "calibration" or "sensitivity" for the result of that function
    x : the coordinate to draw over; by default e, else the first numeric axis
    y : second axis of a map, or of the kind validity; by default the next one
    variable : name of the variable that a map or a band shows; by default e_error for a map, or beta if the result
        has it, and e_out for a band
    sel : values of the other axes, such as `{"m2": 1.0}`; the default is the first value. A loop, a history
        or an impulse may be at a point that is not on the grid, and is at the middle of an axis of e by default
    models : keys of the models to show; by default all
    log : which axes are logarithmic, such as "x" or "xy"; axes with logarithmic spacing are in any case
    points : measured points over the curves: a CSV file, or a table of pandas or xarray, whose columns have names
        such as "v1 [m/s]", "e_out" and "sigma"
    width : width of the figure [in], or a length such as "84mm", a quantity of pint, "single" or "double"; by
        default that of rcParams if it was changed, else "double"
    height : height of the figure [in], or a length; by default it depends on the kind
    style : a style sheet of matplotlib, or the name of one; rcParams changed by the user are respected in any case
    title : write the title and the conditions; by default unless `ax` is set
    legend : name laws by title, year and parameters ("full"), by first author and year ("short"), or by key
        ("keys"); "none" for no legend; by default the first of these with which it takes at most a fifth of the
        height, else the shortest in a higher picture; in `ax` the first with which it is no wider than the axes,
        else the keys
    decimal : "point" or "comma", in all numbers; "locale" for that of LC_NUMERIC
    labels : texts by the name of an axis, of a variable whose name is at the end of its curve, the key of a law,
        "reference" or "title"
    equations : name the laws with the numbers of their equations in the paper
    frictions : keys of the friction laws to show; by default all
    ax : axes of an existing figure to draw into, one for each panel, in the style of that figure
    plugins : plug-in models that the result was computed with, needed to draw a loop, a history or an impulse

    Returns
    -------
    matplotlib.figure.Figure : `figure.savefig("results.png")` writes it; a notebook shows it

    Raises
    ------
    UsageError : the result does not contain what the arguments select

    >>> import impact
    >>> figure = impact.plot(impact.sweep("configs/figure6.toml"))
    >>> figure.axes[0].get_xlabel()
    'Coefficient of restitution $e$'
    """
    if isinstance(dataset, Impact):
        if dataset.history is None:
            raise UsageError(f"no motion to draw: {dataset.why_no_history}")
        dataset = dataset.history
    choice = Choice(x, y, variable, sel, models, log, equations, frictions)
    look = Look(width, height, style, ax is None if title is None else title, labels, legend, decimal)
    for name in ("width", "height", "style"):
        if ax is not None and getattr(look, name) is not None:
            raise UsageError(f"{argument(name)}: does not apply to ax, whose figure has its own")
    with result_to_show(dataset) as result:
        kind = kind or default_kind(result).name
        check_choice(choice, [find_kind(kind)])
        plot_data = get_plot_data(result, kind, choice, plugins)
    _check_shown(choice, look, [plot_data])
    return draw(plot_data, look, None if points is None else read_points(points, shared_exponent(result)), ax)


def get_plot_data(dataset: xr.Dataset, kind: str, choice: Choice, plugins: Plugins = ()) -> PlotData:
    """Get the data of a picture, see `plot`."""
    plugin_set, found = read_plugins(plugins), find_kind(kind)
    default = default_kind(dataset)
    if default.source in STUDIES and found != default:
        raise UsageError(f"this result has the kind {default.name}, not {kind}")
    if found.source == "history":
        frictions = choice.frictions
        if found.of_friction and "friction" in dataset.dims:
            frictions = frictions or dataset["friction"].values.tolist()
        motions, left_out = histories(dataset, choice.models, choice.sel or {}, plugin_set, frictions)
        plot_data = found.data(motions, choice)
        return replace(plot_data, not_drawn=(*left_out, *plot_data.not_drawn))
    return found.data(dataset, choice)


def _check_shown(choice: Choice, look: Look, pictures: Collection[PlotData]) -> None:
    """Refuse a logarithmic axis, and a label of the user, that none of some pictures has."""
    panels = [panel for picture in pictures for panel in (picture, *picture.panels)]
    for letter in choice.log:
        if not any(getattr(panel, f"{letter}_log", False) for panel in panels):
            why = "it has values <= 0, or this kind of picture has no logarithmic one"
            raise UsageError(f"{argument('log', letter)}: the axis {letter} would stay linear: {why}")
    titles = {"title"} if look.title else set()
    check_labels(look.labels or {}, titles.union(*(picture.names for picture in pictures)))


def draw(
    plot_data: PlotData,
    look: Look,
    points: Points | None = None,
    ax: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Draw a picture, in a new figure or into the user's axes; labels of names that it has not are ignored."""
    all_axes: list[Axes] = [] if ax is None else list(np.ravel(np.asarray(ax, object)))
    if ax is not None and len(all_axes) != plot_data.panel_count:
        raise UsageError(f"ax: got {len(all_axes)} axes, expected {plot_data.panel_count}, one for each panel")
    if all_axes and look.legend is None:
        look = replace(look, legend=_legend_for(all_axes[0], plot_data, look))
    labels = _labels(plot_data, look)
    if points is not None and not isinstance(plot_data, CurveData):
        raise UsageError(f"{points.source}: measured points are drawn over curves only")
    if all_axes:
        entries = _draw_panels(plot_data, all_axes, labels, points, look)
        if look.title:
            all_axes[0].set_title((with_comma if look.decimal == "comma" else str)(labels["title"]))
        if entries and look.legend != "none":
            # outside of the layout, in which it would take room from the axes
            all_axes[0].legend(*zip(*entries, strict=True), fontsize="small").set_in_layout(False)
        figure = all_axes[0].get_figure(root=True)
        assert figure is not None
        return figure
    picture = _picture_with_room(plot_data, look, points)
    with styled(look.style):
        picture.check_panels()
    return picture


def _picture_with_room(plot_data: PlotData, look: Look, points: Points | None) -> Picture:
    """Draw a picture in a new figure, with the longest names with which the legend has room if none are chosen."""
    if look.legend is not None or not plot_data.laws:
        return _new_picture(plot_data, look, points)
    shares = {}
    for legend in DEFAULT_LEGENDS:
        picture = _new_picture(plot_data, replace(look, legend=legend), points)
        if picture.legend_share <= LEGEND_PART:
            return picture
        shares[legend] = picture.legend_share
    smallest = replace(look, legend=min(shares, key=shares.__getitem__))
    return _new_picture(plot_data, smallest, points, legend_rows=True)


def _legend_for(axes: Axes, plot_data: PlotData, look: Look) -> str:
    """Choose the longest names of laws with which a legend is no wider than the user's axes, else the keys."""
    for legend in DEFAULT_LEGENDS:
        names = {**plot_data.laws, **_labels(plot_data, replace(look, legend=legend))}
        handles = [Line2D([], []) for _ in plot_data.laws]
        # not added to the axes, which may have a legend of the user
        drawn = Legend(axes, handles, [names[law] for law in plot_data.laws], fontsize="small")
        if drawn.get_window_extent().width <= axes.bbox.width:
            return legend
    return DEFAULT_LEGENDS[-1]


def _labels(plot_data: PlotData, look: Look) -> dict[str, str]:
    """The texts of names: those of the user, else the title, and of laws those of the legend."""
    of_legend = legend_labels(plot_data.laws, look.legend or "full")
    for law in of_legend:
        if plot_data.laws[law].endswith(SLOW_LIMIT):
            of_legend[law] += SLOW_LIMIT
    return {"title": escape_mathtext(plot_data.title), **of_legend, **(look.labels or {})}


def _new_picture(plot_data: PlotData, look: Look, points: Points | None, *, legend_rows: bool = False) -> Picture:
    """Draw a picture in a new figure, with the names of its legend in columns or one after the other in rows."""
    with styled(look.style):
        (width, height), (default_width, default_height) = look.size, default_size()
        width, height = width or default_width, height or default_height
        names = _labels(plot_data, look)
        # names with parameters are those of the legend alone
        parameters = parameters_of_laws(plot_data.laws, names) if look.legend not in (None, "full") else ""
        conditions = ", ".join(filter(None, (pretty_conditions(plot_data.conditions), parameters)))
        texts = (names["title"], conditions) if look.title else ()
        picture = Picture(width, *(map(with_comma, texts) if look.decimal == "comma" else texts))
        picture.has_legend_rows = legend_rows
        all_axes, panels_height = plot_data.place_panels(picture, width)
        entries = _draw_panels(plot_data, all_axes, names, points, look)
        picture.panels = all_axes
        picture.add_legend(panels_height, height, [] if look.legend == "none" else entries)
    return picture


def _draw_panels(
    plot_data: PlotData, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None, look: Look
) -> LegendEntries:
    """Draw the panels, with the decimal separator of the look; returns handles and names of the legend."""
    if look.decimal == "point":
        return plot_data.draw(all_axes, labels, points)
    figure = all_axes[0].figure
    before = list(figure.axes)
    # texts of the figure of a user keep their points
    texts = {text: text.get_text() for text in figure.findobj(Text)}
    entries = plot_data.draw(all_axes, labels, points)
    # names of panels, and units with an exponent, as well
    for text in figure.findobj(Text):
        if text.get_text() != texts.get(text):
            text.set_text(with_comma(text.get_text()))
    colour_bars = [axes for axes in figure.axes if axes not in before]
    for axes in (*all_axes, *colour_bars):
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(partial(tick_with_comma, axis.get_major_formatter())))
    if isinstance(figure, Picture):
        figure.short_names = {text: [*map(with_comma, names)] for text, names in figure.short_names.items()}
    return [(artist, with_comma(name)) for artist, name in entries]


class PlotFiles(NamedTuple):
    """Pictures in files and their data, by kind, and the reason why a kind was left out."""

    pictures: dict[str, Path]
    plot_data: dict[str, PlotData]
    left_out: dict[str, str]


def plot_to_files(
    result: str | Path,
    output: str | Path | None = None,
    *,
    kinds: Sequence[str] = (),
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
    sel: Mapping[str, object] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool = True,
    legend: str | None = None,
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    frictions: Sequence[str] | None = None,
    data: str | Path | None = None,
    data_form: str = "wide",
    rows: int | None = None,
    digits: int | None = None,
    decimal: str = "point",
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> PlotFiles:
    """Draw a stored result into a file for each kind of picture.

    Kinds that the result does not have the data for are left out; it is an error if none can be drawn. Of
    several kinds, one that `sel` leaves no axis, while another is drawn, is drawn over the whole axis.

    Parameters
    ----------
    result : file of a result, or of a time history
    output : the picture, with the ending of its format; by default the result's name with .png. The name of each
        of several kinds has the kind in it
    kinds : see `impact.plots.kinds.KINDS`
    data : file for the numbers behind the picture: .csv or .parquet, or .tex, whose "wide" form has `labels` and
        angles in degrees
    data_form : "wide", a column for each curve, or "long", a row for each point
    rows, digits : of the numbers: at most so many rows, evenly spread, and significant digits; by default all
    decimal : "point" or "comma", of the picture and of the numbers, whose columns semicolons then separate, or
        "locale"
    overwrite : replace existing files
    x, y, variable, sel, models, log, points, width, height, style, title, legend, labels, equations, frictions :
        see `plot`
    plugins : see `plot`

    Returns
    -------
    PlotFiles : by kind the picture and its data, and the reason why a kind is left out

    Raises
    ------
    UsageError : no kind can be drawn, an argument is invalid, or a file exists
    ResultError : the result is not readable
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/r.h5")
    ...     [path.name for path in impact.plot_to_files(f"{folder}/r.h5").pictures.values()]
    ['r.png']
    """
    choice = Choice(x, y, variable, sel, models, log, equations, frictions)
    look = Look(width, height, style, title, labels, legend, decimal)
    table_form = TableForm(rows, digits, decimal)
    kinds = [find_kind(kind).name for kind in dict.fromkeys(kinds)]
    result = Path(result)
    output = Path(output) if output is not None else result.with_suffix(".png")
    check_picture(output)
    table = Path(data) if data is not None else None
    if data_form not in ("wide", "long"):
        raise UsageError(f"{argument('data_form')}: got {data_form}, expected wide or long")
    if data is None and data_form != "wide":
        raise UsageError(f"{argument('data_form')}: set without a table, expected {argument('data', 'FILE.csv')}")
    # the decimal separator is that of the picture too
    replace(table_form, decimal="point").check_used(table, "data")
    if table is not None:
        check_suffix(table, "data")
    # the default kind depends on the result, which is read after the paths are checked
    targets = [_with_kind(path, kind, kinds) for path in (output, table) if path for kind in kinds or [""]]
    check_outputs(targets, [result, points], overwrite=overwrite)
    dataset = load(result)
    measured = None if points is None else read_points(points, shared_exponent(dataset))
    kinds = kinds or [default_kind(dataset).name]
    check_choice(choice, [find_kind(kind) for kind in kinds])
    if output.suffix.lower() == ".gif" and set(kinds) != {"animation"}:
        raise UsageError(f"{output}: a .gif is an animation, expected {argument('kind', 'animation')}")
    plot_data, left_out = _read_kinds(kinds, dataset, choice, plugins)
    if plot_data:
        _check_shown(choice, look, plot_data.values())
    pictures: dict[str, Path] = {}
    for kind, shown in plot_data.items():
        try:
            figure = draw(shown, look, measured)
            if table:
                frame = shown.long_table() if data_form == "long" else shown.wide_table()
                if labels and table.suffix.lower() == ".tex":
                    frame.columns = [_labelled(name, labels) for name in map(str, frame.columns)]
                numbers = encode_frame(frame, table.suffix.lower(), table_form)
        except UsageError as error:
            left_out[kind] = str(error)
            continue
        pictures[kind] = _with_kind(output, kind, kinds)
        save_figure(figure, pictures[kind], overwrite=overwrite, style=style)
        if table:
            write_file(_with_kind(table, kind, kinds), numbers, overwrite=overwrite)
    if not pictures:
        raise UsageError(*dict.fromkeys(left_out.values()))
    return PlotFiles(pictures, {kind: plot_data[kind] for kind in pictures}, left_out)


def _labelled(heading: str, labels: Mapping[str, str]) -> str:
    """Put the texts of the user into a heading, see `formatting.heading`.

    >>> _labelled("v1_post hertz [m/s]", {"v1_post": "$v_1$", "hertz": "Hertz"})
    '$v_1$ Hertz [m/s]'
    """
    words, bracket, unit = heading.partition(" [")
    return " ".join(labels.get(part, part) for part in words.split(" ", 1)) + bracket + unit


def _with_kind(path: Path, kind: str, kinds: Sequence[str]) -> Path:
    """Put the kind into the name of a file if there are several kinds."""
    return path if len(kinds) < 2 else path.with_name(f"{path.stem}-{kind}{path.suffix}")


def _read_kinds(
    kinds: Sequence[str], dataset: xr.Dataset, choice: Choice, plugins: Plugins
) -> tuple[dict[str, PlotData], dict[str, str]]:
    """Read the data of several kinds, and the reasons why others cannot be drawn.

    If the selected values are for one of the pictures, such as the point of a loop, others that they leave no axis
    ignore them.
    """
    plot_data: dict[str, PlotData] = {}
    reasons: dict[str, str] = {}
    for kind in kinds:
        try:
            plot_data[kind] = get_plot_data(dataset, kind, choice, plugins)
        except UsageError as error:
            reasons[kind] = str(error)
    if plot_data and choice.sel:
        # a motion is at the selected point
        for kind in [kind for kind in reasons if find_kind(kind).source != "history"]:
            try:
                plot_data[kind] = _over_selected_axes(kind, dataset, choice, plugins)
                del reasons[kind]
            except UsageError as error:
                # what is missing on all axes, not beside the selected values
                reasons[kind] = str(error)
    return {kind: plot_data[kind] for kind in kinds if kind in plot_data}, reasons


def _over_selected_axes(kind: str, dataset: xr.Dataset, choice: Choice, plugins: Plugins) -> PlotData:
    """Read the data of a picture over axes at which a value is selected: over all their values."""
    whole = get_plot_data(dataset, kind, replace(choice, sel=None), plugins)
    drawn = {dataset[name].dims for name in whole.names if name in dataset.coords}
    sel = dict(choice.sel or {})
    ignored = [name for name in sel if name in dataset.coords and dataset[name].dims in drawn]
    remarks = tuple(f"{argument('sel', {name: sel.pop(name)})}, a point on its axis" for name in ignored)
    plot_data = get_plot_data(dataset, kind, replace(choice, sel=sel), plugins)
    return replace(plot_data, not_drawn=(*plot_data.not_drawn, *remarks))
