"""The kinds of picture: what each shows, its data, and its drawing.

The command line reads the names of the kinds at every start, so this module imports matplotlib only to draw.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from ..errors import UsageError, did_you_mean

if TYPE_CHECKING:
    import xarray as xr

    from .curves import CurveData
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
# limits of the width and height of a picture
MIN_SIZE_INCHES, MAX_SIZE_INCHES = 1.0, 60.0
LENGTH_PATTERN = re.compile(r"\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*(mm|cm|in)\s*")
INCHES_PER_UNIT = {"mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "in": 1.0}


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
            raise UsageError(f"--log: got {self.log}, expected {', '.join(LOG_AXES)}")


@dataclass(frozen=True)
class Look:
    """How a picture looks; see `impact.plot`.

    Raises
    ------
    UsageError : a length is invalid
    """

    width: float | str | None = None
    height: float | str | None = None
    style: str | Path | None = None
    title: bool = True
    labels: Mapping[str, str] | None = None

    def __post_init__(self) -> None:
        _ = self.size

    @property
    def size(self) -> tuple[float | None, float | None]:
        """Width and height [in]; None for the default."""
        return length(self.width, "--width"), length(self.height, "--height")


def length(size: str | float | None, option: str) -> float | None:
    """A size of a picture in inches: a number of them, a length with its unit, or the name of a journal's width.

    Raises
    ------
    UsageError : it is none of these, or not between 1 and 60 inches

    >>> round(length("84mm", "--width"), 4), length("single", "--width"), length(7.1, "--width")
    (3.3071, 3.5, 7.1)
    """
    if size is None or size in WIDTHS:
        return None if size is None else WIDTHS[str(size)]
    parts = LENGTH_PATTERN.fullmatch(size) if isinstance(size, str) else None
    inches = float(parts[1]) * INCHES_PER_UNIT[parts[2]] if parts else size
    if isinstance(inches, str) or not MIN_SIZE_INCHES <= inches <= MAX_SIZE_INCHES:
        expected = f"a length from 26mm to {MAX_SIZE_INCHES:g}in, such as 84mm, 8.4cm or 3.3in"
        names = f", or {' or '.join(WIDTHS)}" if option.endswith("width") else ""
        raise UsageError(f"{option}: got {size}, expected {expected}{names}")
    return float(inches)


def check_kind(kind: str) -> None:
    """Raise a UsageError, which names the nearest kind, if there is no such kind of picture."""
    if kind not in KINDS:
        raise UsageError(f'--kind: no kind "{kind}"; {did_you_mean(kind, list(KINDS))}')


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
