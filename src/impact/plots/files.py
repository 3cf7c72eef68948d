"""Draw a stored result into files: a picture of each kind, and the numbers behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from ..atomic import check_outputs, write_file
from ..contact.model import ForceModel
from ..display import TableForm, check_suffix, encode_frame
from ..errors import UsageError
from ..formatting import argument
from ..results.xarray_backend import load
from .data import PlotData, read_points
from .draw import check_log, draw, get_plot_data, label_keys
from .kinds import Choice, Look, check_choice, default_kind, find_kind
from .labels import check_labels
from .style import check_picture, save_figure

Plugins = Sequence[ForceModel | str | Path]


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
    data : file for the numbers behind the picture: .csv, .tex or .parquet
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
    # the decimal separator is that of the picture too
    replace(table_form, decimal="point").check_used(table, "data")
    if table is not None:
        check_suffix(table, "data")
        if data_form not in ("wide", "long"):
            raise UsageError(f"{argument('data_form')}: got {data_form}, expected wide or long")
    # the default kind depends on the result, which is read after the paths are checked
    targets = [_with_kind(path, kind, kinds) for path in (output, table) if path for kind in kinds or [""]]
    check_outputs(targets, [result, points], overwrite=overwrite)
    measured = None if points is None else read_points(points)
    dataset = load(result)
    kinds = kinds or [default_kind(dataset).name]
    check_choice(choice, [find_kind(kind) for kind in kinds])
    if output.suffix.lower() == ".gif" and set(kinds) != {"animation"}:
        raise UsageError(f"{output}: a .gif is an animation, expected {argument('kind', 'animation')}")
    plot_data, left_out = _read_kinds(kinds, dataset, choice, plugins)
    check_log(log, plot_data.values())
    if plot_data:
        check_labels(look.labels or {}, set().union(*(label_keys(shown, look) for shown in plot_data.values())))
    pictures: dict[str, Path] = {}
    for kind, shown in plot_data.items():
        keys = label_keys(shown, look)
        own_look = replace(look, labels={key: text for key, text in (labels or {}).items() if key in keys})
        try:
            figure = draw(shown, own_look, measured)
            if table:
                frame = shown.long_table() if data_form == "long" else shown.wide_table()
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
