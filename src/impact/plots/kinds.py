"""The kinds of picture: what each shows, its numbers, and its drawing.

The command line reads the names of the kinds at every start, so nothing here imports matplotlib before it draws.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from ..errors import UsageError, did_you_mean
from ..text import safe_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .curves import Lines
    from .data import Points
    from .maps import Grids

    Numbers: TypeAlias = Lines | Grids

KINDS = {
    "final-velocities": "velocities after the impact beside the impulse-momentum solution, Figure 6 of the paper",
    "restitution": "restitution delivered over what was asked for",
    "error": "error of the restitution, signed and absolute",
    "map": "a variable over two axes, a panel for each model",
    "validity": "over two axes, which model is closest to what was asked for, and how close",
    "loop": "force over indentation",
    "history": "indentation, its rate and the force over time",
    "impulse": "velocities over the impulse that has passed",
}
# those that follow a point through time, which --sel chooses
FOLLOWED = ("loop", "history", "impulse")
# of one column of a journal, and of two [in]
WIDTHS = {"single": 3.5, "double": 7.1}
LOGS = ("x", "y", "xy")


@dataclass(frozen=True)
class Choice:
    """What of a result is drawn; see `impact.plot`."""

    x: str | None = None
    y: str | None = None
    variable: str = "e_error"
    sel: Mapping[str, float | str] | None = None
    models: Sequence[str] | None = None
    log: str = ""
    equations: bool = False


def numbers_of(
    kind: str, dataset: xr.Dataset, choice: Choice, histories: Callable[[], Sequence[xr.Dataset]]
) -> Numbers:
    """The numbers of a picture.

    Parameters
    ----------
    kind : one of KINDS
    dataset : a result, or a time history
    choice : what of it
    histories : follows the chosen point through time by each model

    Raises
    ------
    UsageError : there is no such kind, or the result has not got what it needs
    """
    if kind not in KINDS:
        raise UsageError(f'--kind: no kind "{safe_text(kind)}"; {did_you_mean(kind, list(KINDS))}')
    from . import curves, maps
    from .motions import MOTIONS

    if kind in MOTIONS:
        return MOTIONS[kind](histories(), equations=choice.equations)
    common: dict[str, Any] = {
        "x": choice.x, "sel": choice.sel, "models": choice.models, "log": choice.log,
        "equations": choice.equations,
    }  # fmt: skip
    if kind == "map":
        return maps.field_map(dataset, variable=choice.variable, y=choice.y, **common)
    if kind == "validity":
        return maps.validity(dataset, y=choice.y, **common)
    draws = {"restitution": curves.restitution, "error": curves.error}.get(kind, curves.final_velocities)
    return draws(dataset, **common)


def draw(
    numbers: Numbers,
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
    numbers : see `numbers_of`
    width, height : of the figure, see `impact.plots.style.length`; by default the width is that of rcParams where
        the user changed it, else 7.1 in, and the height suits what is drawn
    style : see `impact.plots.style.styled`
    title : write the title and the conditions
    labels : see `impact.plots.labels.checked_labels`
    points : measured points, see `impact.plots.data.read_points`; only curves have them
    ax : draw into these axes of the user's, one for each panel

    Raises
    ------
    UsageError : an option is not right, or does not fit the picture
    """
    from . import curves, maps
    from .data import Points as Measured
    from .data import read_points
    from .labels import checked_labels, plain, pretty_conditions
    from .layout import Picture
    from .style import default_size, length, styled

    width, height = length(width, "--width"), length(height, "--height")
    chosen = checked_labels(labels or {}, numbers.names)
    measured = points if points is None or isinstance(points, Measured) else read_points(points)
    if measured is not None and not isinstance(numbers, curves.Lines):
        raise UsageError(f"{measured.source}: measured points are drawn over curves, not over a map")

    def drawn(all_axes: Sequence[Axes]) -> Any:
        if isinstance(numbers, curves.Lines):
            return curves.draw_lines(numbers, all_axes, chosen, measured)
        return maps.draw_grids(numbers, all_axes, chosen)

    heading = chosen.get("title", plain(numbers.title))
    count = len(numbers.panels) if isinstance(numbers, curves.Lines) or not numbers.closest else 2
    if ax is not None:
        all_axes = _given_axes(ax, count)
        entries = drawn(all_axes)
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
        picture = Picture(width, *((heading, pretty_conditions(numbers.conditions)) if title else ()))
        if isinstance(numbers, curves.Lines):
            all_axes = list(picture.subplots(count, sharex=count > 1, squeeze=False).ravel())
            body = count * width * (curves.HEIGHT if count == 1 else curves.HEIGHT_OF_SEVERAL) + 0.3
        else:
            all_axes, body = maps.place_panels(picture, numbers, width, count)
        picture.settle(body, height, drawn(all_axes))
    return picture


def _given_axes(ax: Axes | Sequence[Axes], count: int) -> list[Axes]:
    """The user's axes, as many as there are panels."""
    import numpy as np

    given = list(np.ravel(np.asarray(ax, object)))
    if len(given) != count:
        raise UsageError(f"ax: got {len(given)} axes, expected {count}, one for each panel")
    return given
