"""What all pictures have in common: colours, markers, style, the words on an axis, and how they are stored."""

from __future__ import annotations

import io
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ..contact.models import catalogue
from ..errors import UsageError
from ..results.backend import write_whole
from ..results.schema import plain_unit
from ..text import safe_text

if TYPE_CHECKING:
    import xarray as xr

# Okabe and Ito's colours, without the yellow that vanishes on white; a number of markers that shares no factor
# with theirs, so that neighbours in the catalogue differ in both
COLOURS = ("#7F4F24", "#009E73", "#56B4E9", "#CC79A7", "#D55E00", "#E69F00", "#0072B2")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "p")
DASHES = ("-", (0, (6, 1.5)), (0, (3, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (1.2, 1.2)))
STYLE = files(__package__) / "impact.mplstyle"
# a picture has the same bytes each time: no dates in it
METADATA: dict[str, dict[str, None]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def look_of(model: str | None, models: Sequence[str | None], points: int) -> dict[str, Any]:
    """How a curve of a model looks, wherever it is drawn; a reference is a plain line.

    Parameters
    ----------
    model : its key; None for a reference
    models : those of the picture; one that is not built in comes after the catalogue
    points : of the curve
    """
    if model is None:
        # a single point has no line: a disc that shows around the models' markers
        disc = {"marker": "o", "markersize": 10} if points == 1 else {}
        return {"color": "black", "linewidth": 2.0, "zorder": 1.5, **disc}
    place = list(dict.fromkeys([*catalogue(), *(one for one in models if one)])).index(model)
    every = max(1, points // 12)
    return {
        "color": COLOURS[place % len(COLOURS)],
        "linestyle": DASHES[place % len(DASHES)],
        "marker": MARKERS[place % len(MARKERS)],
        # the markers of different models stand at different points, so that equal curves show both
        "markevery": (place * every // len(MARKERS) % every if every > 1 else 0, every),
        "markerfacecolor": "white",
        "linewidth": 1.1,
    }


def is_geometric(values: np.ndarray) -> bool:
    """Whether sorted values are spaced evenly in their logarithm, over a decade or more."""
    if len(values) < 3 or values[0] <= 0.0 or values[-1] < 10.0 * values[0]:
        return False
    return bool(np.allclose(np.diff(np.log(values)), np.log(values[1] / values[0]), rtol=1e-6))


def axis_label(coordinate: xr.DataArray) -> str:
    """What an axis shows: meaning, name and unit of a coordinate."""
    meaning, unit = (str(coordinate.attrs.get(name, "")) for name in ("long_name", "units"))
    unit = plain_unit(unit)
    return safe_text(
        f"{meaning or coordinate.name}, {coordinate.name}" + (f" [{unit}]" if unit not in ("", "1") else "")
    )


def check_picture(path: Path) -> str:
    """The format of a picture, by its ending.

    Raises
    ------
    UsageError : the ending is not .png, .svg or .pdf
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in METADATA:
        raise UsageError(f"{safe_text(str(path))}: wants a name that ends in .png, .svg or .pdf")
    return kind


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure; the format follows the file's ending, and the bytes are the same each time.

    Raises
    ------
    UsageError : see `check_picture`, or the file cannot be written there
    StoreError : the disk is full or failed
    """
    path = Path(path)
    kind = check_picture(path)
    buffer = io.BytesIO()
    with matplotlib.rc_context(fname=str(STYLE)):
        figure.savefig(buffer, format=kind, metadata=METADATA[kind])
    write_whole(path, buffer.getbuffer(), overwrite=True)
