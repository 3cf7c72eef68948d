"""What all pictures have in common: colours, markers, sizes, the style, and how they are stored."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence, Set
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib import rc_params_from_file, rcParams, rcParamsDefault
from matplotlib.figure import Figure

from ..contact.models import catalogue
from ..errors import UsageError
from ..results.backend import write_file
from ..text import safe_text
from .kinds import WIDTHS

# Okabe and Ito's colours, without the yellow that vanishes on white; a number of markers that shares no factor
# with theirs, so that neighbours in the catalogue differ in both
COLOURS = ("#7F4F24", "#009E73", "#56B4E9", "#CC79A7", "#D55E00", "#E69F00", "#0072B2")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "p")
DASHES = ("-", (0, (6, 1.5)), (0, (3, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (1.2, 1.2)))
HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oo", "||||")
STYLE = files(__package__) / "impact.mplstyle"
# a picture has the same bytes each time: no dates in it
METADATA: dict[str, dict[str, None]] = {
    "png": {},
    "svg": dict.fromkeys(("Date", "Creator", "Format", "Type")),
    "pdf": {"CreationDate": None},
    "eps": {},
    "pgf": {},
}
# the sizes of a picture [in], and the units of a length
SMALLEST, LARGEST = 1.0, 60.0
LENGTH = re.compile(r"\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*(mm|cm|in)\s*")
INCHES = {"mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "in": 1.0}


@contextlib.contextmanager
def styled(style: str | Path | None = None) -> Iterator[None]:
    """Draw in the style of this package, where the user's own settings leave matplotlib's defaults, and a file's.

    Parameters
    ----------
    style : a file of matplotlib's rcParams, or the name of a style of matplotlib, which comes before all others

    Raises
    ------
    UsageError : it cannot be read
    """
    ours = rc_params_from_file(str(STYLE), use_default_template=False)
    unchanged = {key: value for key, value in ours.items() if rcParams[key] == rcParamsDefault[key]}
    with matplotlib.rc_context({**unchanged, **_style_of(style)}):
        yield


def _style_of(style: str | Path | None) -> Mapping[Any, Any]:
    if style is None:
        return {}
    from matplotlib import style as styles

    if str(style) in styles.library:
        return styles.library[str(style)]
    shown = safe_text(str(style))
    if not Path(style).is_file():
        raise UsageError(f"--style {shown}: no such file, and no style of matplotlib")
    try:
        return rc_params_from_file(str(style), use_default_template=False)
    except (OSError, ValueError, KeyError) as error:
        raise UsageError(f"--style {shown}: cannot be read: {safe_text(str(error))}") from None


def length(given: str | float | None, option: str) -> float | None:
    """A size of a picture in inches: a number of them, a length with its unit, or the name of a journal's width.

    Raises
    ------
    UsageError : it is none of these, or not between 1 and 60 inches

    >>> round(length("84mm", "--width"), 4), length("single", "--width"), length(7.1, "--width")
    (3.3071, 3.5, 7.1)
    """
    if given is None or given in WIDTHS:
        return None if given is None else WIDTHS[str(given)]
    parts = LENGTH.fullmatch(given) if isinstance(given, str) else None
    inches = float(parts[1]) * INCHES[parts[2]] if parts else given
    if isinstance(inches, str) or not SMALLEST <= inches <= LARGEST:
        expected = f"a length from 26mm to {LARGEST:g}in, such as 84mm, 8.4cm or 3.3in"
        names = f", or {' or '.join(WIDTHS)}" if option.endswith("width") else ""
        raise UsageError(f"{option}: got {safe_text(str(given))}, expected {expected}{names}")
    return float(inches)


def default_size() -> tuple[float, float | None]:
    """Width and height [in] where none is given: the user's own, else two columns and what suits the picture."""
    width, height = rcParams["figure.figsize"]
    if [width, height] == list(rcParamsDefault["figure.figsize"]):
        return WIDTHS["double"], None
    return width, height


def looks_of(models: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Colour, marker, dashes and hatch of each model of a picture, no two alike.

    A model prefers what its place in the catalogue gives it, so that it looks the same in most pictures; where
    that is taken it has the next that is free. One that is not built in comes after the catalogue.
    """
    places = list(dict.fromkeys([*catalogue(), *models]))
    looks: dict[str, dict[str, Any]] = {}
    used: dict[str, Counter[Any]] = {"color": Counter(), "marker": Counter(), "hatch": Counter()}
    for model in dict.fromkeys(models):
        place = places.index(model)
        color = _next_free(COLOURS, place, used["color"])
        alike = [look for look in looks.values() if look["color"] == color]
        looks[model] = {
            "color": color,
            "marker": _next_free(MARKERS, place, used["marker"], {look["marker"] for look in alike}),
            "hatch": _next_free(HATCHES, len(looks), used["hatch"], {look["hatch"] for look in alike}),
            "linestyle": DASHES[(place + len(alike)) % len(DASHES)],
        }
        for name, counter in used.items():
            counter[looks[model][name]] += 1
    return looks


def _next_free(choices: Sequence[Any], place: int, used: Counter[Any], refused: Set[Any] = frozenset()) -> Any:
    """The first choice from a place on that is used least, and not refused where that can be."""
    ordered = [choices[(place + step) % len(choices)] for step in range(len(choices))]
    return min(ordered, key=lambda choice: (choice in refused, used[choice]))


def is_geometric(values: np.ndarray) -> bool:
    """Whether sorted values are spaced evenly in their logarithm, over a decade or more."""
    if len(values) < 3 or values[0] <= 0.0 or values[-1] < 10.0 * values[0]:
        return False
    return bool(np.allclose(np.diff(np.log(values)), np.log(values[1] / values[0]), rtol=1e-6))


def check_picture(path: Path) -> str:
    """The format of a picture, by its ending.

    Raises
    ------
    UsageError : the ending is not one of METADATA, or the format needs a program that is not installed
    """
    kind, shown = path.suffix.lower().removeprefix("."), safe_text(str(path))
    if kind not in METADATA:
        *most, last = (f".{name}" for name in METADATA)
        raise UsageError(f"{shown}: expected a name that ends in {', '.join(most)} or {last}")
    latex = str(rcParams["pgf.texsystem"])
    if kind == "pgf" and shutil.which(latex) is None:
        raise UsageError(
            f"{shown}: .pgf needs {latex} of LaTeX, which is not installed; .pdf and .eps do without it"
        )
    return kind


def encoded(figure: Figure, kind: str, style: str | Path | None = None) -> bytes:
    """A figure as the bytes of a file of a format of METADATA; they are the same each time.

    Raises
    ------
    UsageError : LaTeX cannot typeset its text
    """
    buffer = io.BytesIO()
    with styled(style):
        try:
            figure.savefig(buffer, format=kind, metadata=METADATA[kind] or None)
        except RuntimeError as error:
            # of LaTeX, in the format .pgf and with the user's own text.usetex
            reason = safe_text(" ".join(str(error).split()), 300)
            raise UsageError(f"the picture cannot be drawn as .{kind}: {reason}") from None
    if kind == "eps":
        return re.sub(rb"(?m)^%%CreationDate:.*\n", b"", buffer.getvalue())
    return buffer.getvalue()


def save_figure(
    figure: Figure, path: str | Path, *, overwrite: bool = True, style: str | Path | None = None
) -> None:
    """Write a figure; the format follows the file's ending, and the bytes are the same each time.

    Raises
    ------
    UsageError : see `check_picture`, or the file cannot be written there
    StoreError : the disk is full or failed
    """
    path = Path(path)
    write_file(path, encoded(figure, check_picture(path), style), overwrite=overwrite)
