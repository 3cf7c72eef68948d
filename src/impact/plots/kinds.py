"""The kinds of picture: what each shows, its data, and its drawing.

The command line reads the names of the kinds at every start, so this module imports matplotlib only to draw.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..errors import UsageError, did_you_mean
from ..text import safe_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .curves import CurveData
    from .data import Points
    from .maps import MapData
    from .uncertainty import BarData

    PlotData: TypeAlias = CurveData | MapData | BarData

KINDS = {
    "final-velocities": "velocities after the impact and the impulse-momentum solution, Figure 6 of the paper",
    "restitution": "delivered over requested restitution",
    "error": "error of the restitution, signed and absolute",
    "timestep": "restitution at fixed steps: mean, least and largest over the phase",
    "map": "a variable over two axes, a panel for each model",
    "validity": "model with the smallest error over two axes, and that error",
    "loop": "force over indentation",
    "history": "indentation, its rate and the force over time",
    "impulse": "velocities over the impulse",
    "calibration": "measured values, the laws that fit them with their bands, and residuals",
    "uncertainty": "an output of uncertain inputs over an axis: median, and 5 to 95 % of the samples",
    "sensitivity": "which uncertain input matters: first-order and total Sobol indices",
}
# kinds that show the motion at one point, which --sel selects
MOTION_KINDS = ("loop", "history", "impulse")
# kinds over two axes
MAP_KINDS = ("map", "validity")
# results of these kinds have no other picture
STUDY_KINDS = ("calibration", "sensitivity")
# width of one and of two columns of a journal [in]
WIDTHS = {"single": 3.5, "double": 7.1}
LOG_AXES = ("x", "y", "xy")


@dataclass(frozen=True)
class Choice:
    """Which part of a result is drawn; see `impact.plot`.

    Raises
    ------
    UsageError : `log` names no axes
    """

    x: str | None = None
    y: str | None = None
    variable: str | None = None
    sel: Mapping[str, float | str] | None = None
    models: Sequence[str] | None = None
    log: str = ""
    equations: bool = False

    def __post_init__(self) -> None:
        if self.log not in ("", *LOG_AXES):
            raise UsageError(f"--log: got {safe_text(self.log)}, expected {', '.join(LOG_AXES)}")


def check_kind(kind: str) -> None:
    """Raise a UsageError, which names the nearest kind, if there is no such kind of picture."""
    if kind not in KINDS:
        raise UsageError(f'--kind: no kind "{safe_text(kind)}"; {did_you_mean(kind, list(KINDS))}')


def default_kind(dataset: xr.Dataset) -> str:
    """The kind of picture that shows what a dataset is for."""
    from ..config.grid import SAMPLE
    from ..results.kinds import is_calibration, is_sensitivity

    if "t" in dataset.dims:
        return "loop"
    if is_calibration(dataset):
        return "calibration"
    if is_sensitivity(dataset):
        return "sensitivity"
    return "uncertainty" if SAMPLE in dataset.dims else "final-velocities"


def plot_data_of(
    kind: str, dataset: xr.Dataset, choice: Choice, histories: Callable[[], Sequence[xr.Dataset]]
) -> PlotData:
    """The data of a picture.

    Parameters
    ----------
    kind : one of KINDS
    dataset : a result, or a time history
    choice : which part of it
    histories : integrates the chosen point again with each model, and returns the time histories

    Raises
    ------
    UsageError : there is no such kind, or the result does not contain what it needs
    """
    check_kind(kind)
    from . import calibrations, curves, maps, uncertainty
    from .motions import MOTIONS

    default = default_kind(dataset)
    if default in STUDY_KINDS and kind != default:
        raise UsageError(f"this result has the kind {default}, not {kind}")
    if kind in MOTIONS:
        return MOTIONS[kind](histories(), equations=choice.equations)
    functions: dict[str, Callable[[xr.Dataset, Choice], PlotData]] = {
        "final-velocities": curves.velocity_curves,
        "restitution": curves.restitution_curves,
        "error": curves.error_curves,
        "timestep": curves.timestep_curves,
        "map": maps.field_map,
        "validity": maps.validity_map,
        "calibration": calibrations.calibration_curves,
        "uncertainty": uncertainty.uncertainty_curves,
        "sensitivity": uncertainty.sensitivity_bars,
    }
    return functions[kind](dataset, choice)


def data_of_kinds(
    kinds: Sequence[str], dataset: xr.Dataset, choice: Choice, histories: Callable[[], Sequence[xr.Dataset]]
) -> tuple[dict[str, PlotData], dict[str, str]]:
    """The data of several pictures by kind, and the reasons why other kinds cannot be drawn.

    Where the selected values are for one of the pictures, such as the point of a loop, others that they leave no
    axis ignore them. For the parameters see `plot_data_of`.
    """
    data: dict[str, PlotData] = {}
    reasons: dict[str, str] = {}
    for kind in kinds:
        try:
            data[kind] = plot_data_of(kind, dataset, choice, histories)
        except UsageError as error:
            reasons[kind] = str(error)
    if data and choice.sel:
        for kind in reasons.keys() - {*MOTION_KINDS}:
            with suppress(UsageError):
                data[kind] = _over_selected_axes(kind, dataset, choice)
    return (
        {kind: data[kind] for kind in kinds if kind in data},
        {kind: reason for kind, reason in reasons.items() if kind not in data},
    )


def _over_selected_axes(kind: str, dataset: xr.Dataset, choice: Choice) -> PlotData:
    """The data of a picture over axes at which a value is selected: over all their values.

    Raises
    ------
    UsageError : see `plot_data_of`
    """
    whole = plot_data_of(kind, dataset, replace(choice, sel=None), list)
    drawn = {dataset[name].dims for name in whole.names if name in dataset.coords}
    sel = dict(choice.sel or {})
    ignored = [name for name in sel if name in dataset.coords and dataset[name].dims in drawn]
    remarks = tuple(f"--sel {name}={sel.pop(name)}, a point on its axis" for name in ignored)
    plot_data = plot_data_of(kind, dataset, replace(choice, sel=sel), list)
    return replace(plot_data, not_drawn=(*plot_data.not_drawn, *remarks))


def label_keys(pictures: Iterable[PlotData], *, title: bool) -> set[str]:
    """The names in some pictures whose text a user can replace."""
    return {*({"title"} if title else ()), *(name for plot_data in pictures for name in plot_data.names)}


def draw(
    plot_data: PlotData,
    width: float | str | None = None,
    height: float | str | None = None,
    *,
    style: str | Path | None = None,
    title: bool = True,
    labels: Mapping[str, str] | None = None,
    points: str | Path | pd.DataFrame | xr.Dataset | Points | None = None,
    ax: Axes | Sequence[Axes] | None = None,
) -> Figure:
    """Draw a picture.

    Parameters
    ----------
    plot_data : see `plot_data_of`
    width, height : of the figure, see `impact.plots.style.length`; by default the width is that of rcParams where
        the user changed it, else 7.1 in, and the height suits what is drawn
    style : see `impact.plots.style.styled`
    title : write the title and the conditions
    labels : see `impact.plots.labels.check_labels`
    points : measured points, see `impact.plots.data.read_points`; only curves have them
    ax : the user's axes to draw into, one for each panel

    Raises
    ------
    UsageError : an option is invalid, or does not apply to the picture
    """
    from . import curves, maps, uncertainty
    from .data import Points as Measured, read_points
    from .labels import check_labels, escape_mathtext, pretty_conditions
    from .layout import Picture
    from .style import default_size, length, styled

    width, height = length(width, "--width"), length(height, "--height")
    chosen = labels or {}
    check_labels(chosen, label_keys([plot_data], title=title))
    measured = points if points is None or isinstance(points, Measured) else read_points(points)
    if measured is not None and not isinstance(plot_data, curves.CurveData):
        raise UsageError(f"{measured.source}: measured points are drawn over curves only")

    def draw_panels(all_axes: Sequence[Axes]) -> Any:
        if isinstance(plot_data, curves.CurveData):
            return curves.draw_curves(plot_data, all_axes, chosen, measured)
        if isinstance(plot_data, uncertainty.BarData):
            return uncertainty.draw_bars(plot_data, all_axes, chosen)
        return maps.draw_maps(plot_data, all_axes, chosen)

    heading = chosen.get("title", escape_mathtext(plot_data.title))
    count = 2 if isinstance(plot_data, maps.MapData) and plot_data.closest else len(plot_data.panels)
    if ax is not None:
        all_axes = _check_axes(ax, count)
        entries = draw_panels(all_axes)
        if title:
            all_axes[0].set_title(heading)
        if entries:
            all_axes[0].legend(*zip(*entries, strict=True), fontsize="small")
        figure = all_axes[0].get_figure(root=True)
        assert figure is not None
        return figure
    with styled(style):
        default_width, default_height = default_size()
        width, height = width or default_width, height or default_height
        picture = Picture(width, *((heading, pretty_conditions(plot_data.conditions)) if title else ()))
        if isinstance(plot_data, curves.CurveData):
            heights = [panel.height for panel in plot_data.panels]
            all_axes = list(
                picture.subplots(count, sharex=count > 1, squeeze=False, height_ratios=heights).ravel()
            )
            aspect = curves.PANEL_ASPECT if count == 1 else curves.STACKED_PANEL_ASPECT
            body = sum(heights) * width * aspect + 0.3
        elif isinstance(plot_data, uncertainty.BarData):
            all_axes = list(picture.subplots(count, sharex=True, squeeze=False).ravel())
            body = uncertainty.bars_height(plot_data)
        else:
            all_axes, body = maps.place_panels(picture, plot_data, width, count)
        picture.add_legend(body, height, draw_panels(all_axes))
    return picture


def _check_axes(ax: Axes | Sequence[Axes], count: int) -> list[Axes]:
    """The user's axes as a list, one for each panel."""
    import numpy as np

    all_axes = list(np.ravel(np.asarray(ax, object)))
    if len(all_axes) != count:
        raise UsageError(f"ax: got {len(all_axes)} axes, expected {count}, one for each panel")
    return all_axes
