"""Common to all pictures: colours, markers, sizes, style sheet, and writing files."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib import rc_params_from_file, rcParams, rcParamsDefault
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure

from ..atomic import PICTURE_SUFFIXES, write_file
from ..contact.frictions import frictions
from ..contact.models import catalogue
from ..errors import UsageError
from ..formatting import argument, law_keys
from .kinds import WIDTHS, length

# the colours of Okabe and Ito without yellow, which is invisible on white; the number of markers is coprime to
# that of the colours, so that neighbours in the catalogue differ in both
COLOURS = ("#7F4F24", "#009E73", "#56B4E9", "#CC79A7", "#D55E00", "#E69F00", "#0072B2")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "p")
DASHES = ("-", (0, (6, 1.5)), (0, (3, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (1.2, 1.2)))
HATCHES = ("", "////", "....", "\\\\\\\\", "xxxx", "----", "oo", "||||")
# without dates in the metadata a picture has the same bytes each time
METADATA = {"svg": dict.fromkeys(("Date", "Creator", "Format", "Type")), "pdf": {"CreationDate": None}}
FRAMES_PER_SECOND = 20
# values are equal that differ by less, relative to the largest
FLAT = 1e-6
# share of the colour of texts in what is less important
SOFT, FAINT = 2 / 3, 8 / 15
# all threads share matplotlib's settings and its parser of formulas: one draws at a time
DRAWING = threading.RLock()


@contextlib.contextmanager
def styled(style: str | Path | None = None) -> Iterator[None]:
    """Draw with the style sheet of this package; settings that the user changed, and `style`, override it."""
    ours = rc_params_from_file(str(files(__package__) / "impact.mplstyle"), use_default_template=False)
    with DRAWING:
        unchanged = {key: value for key, value in ours.items() if rcParams[key] == rcParamsDefault[key]}
        with matplotlib.rc_context({**unchanged, **_style_of(style)}):
            # the grid is faint where no style sets its colour; dark_background gives it that of texts
            unset = rcParamsDefault["grid.color"], rcParams["text.color"]
            if to_rgb(rcParams["grid.color"]) in map(to_rgb, unset):
                rcParams["grid.color"] = tint(0.1)
            try:
                if not rcParams["axes.prop_cycle"]:
                    raise ValueError("axes.prop_cycle has no values")
                # a small figure, whatever the size and the format of pictures
                Figure(figsize=(1.0, 1.0)).savefig(io.BytesIO(), format="raw", dpi="figure")
            except ValueError as error:
                raise UsageError(f"the settings of matplotlib allow no figure: {error}") from None
            try:
                yield
            except RuntimeError as error:
                # LaTeX measures texts, too
                if not rcParams["text.usetex"]:
                    raise
                reason = " ".join(str(error).split())
                raise UsageError(f"the picture cannot be drawn with text.usetex: {reason}") from None


def _style_of(style: str | Path | None) -> Mapping[Any, Any]:
    if style is None:
        return {}
    from matplotlib import style as styles

    if str(style) in styles.library:
        return styles.library[str(style)]
    if not os.path.isfile(Path(style)):
        raise UsageError(f"{argument('style', style)}: no such file, and no style of matplotlib")
    try:
        settings = rc_params_from_file(str(style), use_default_template=False)
    except (OSError, ValueError, KeyError) as error:
        raise UsageError(f"{argument('style', style)}: cannot be read: {error}") from None
    if not settings:
        raise UsageError(f"{argument('style', style)}: contains no setting of matplotlib")
    return settings


def tint(share: float, colour: str | None = None) -> tuple[float, float, float]:
    """Mix a colour, by default that of texts, with the background of the axes of the present style.

    >>> tint(1.0), tint(0.0), tint(0.5, "red")
    ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (1.0, 0.5, 0.5))
    """
    # behind a transparent background is paper
    *background, alpha = to_rgba(rcParams["axes.facecolor"])
    paper = 1.0 - alpha * (1.0 - np.array(background))
    red, green, blue = (
        (1.0 - share) * paper + share * np.array(to_rgb(colour or rcParams["text.color"]))
    ).tolist()
    return red, green, blue


def default_size() -> tuple[float, float | None]:
    """Default width and height [in]: those of rcParams if the user changed them, else two columns and None."""
    width, height = rcParams["figure.figsize"]
    if [width, height] == list(rcParamsDefault["figure.figsize"]):
        return WIDTHS["double"], None
    for side in (width, height):
        # the limits are those of the options
        length(side, "figure.figsize")
    return width, height


def model_styles(models: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Choose colour, marker, dashes and hatch of each model, or pair, of a picture; no two are alike.

    The style of a model follows from its index in the catalogue, so that it is the same in most pictures; if
    another model of the picture has that style already, the next free one is used. Plug-ins follow the catalogue.
    """
    keys = list(dict.fromkeys([*catalogue(), *(law_keys(name)[0] for name in models)]))
    friction_index = {key: index for index, key in enumerate(frictions())}
    styles: dict[str, dict[str, Any]] = {}

    def next_free(name: str, choices: Sequence[Any], start: int, alike: Sequence[Mapping[str, Any]] = ()) -> Any:
        """Choose the least used, the first from index `start` on; one of `alike` only if there is no other."""
        ordered = [*choices[start % len(choices) :], *choices[: start % len(choices)]]
        used, refused = Counter(style[name] for style in styles.values()), {style[name] for style in alike}
        return min(ordered, key=lambda choice: (choice in refused, used[choice]))

    for model in dict.fromkeys(models):
        key, *friction = law_keys(model)
        index = keys.index(key) + sum(friction_index.get(name, 0) for name in friction)
        color = next_free("color", COLOURS, index)
        alike = [style for style in styles.values() if style["color"] == color]
        styles[model] = {
            "color": color,
            "marker": next_free("marker", MARKERS, index, alike),
            "hatch": next_free("hatch", HATCHES, len(styles), alike),
            "linestyle": DASHES[(index + len(alike)) % len(DASHES)],
        }
    return styles


def limits_of(low: float, high: float) -> tuple[float, float]:
    """Choose the limits of an axis or of colours; values that differ by errors of the solver are a constant.

    >>> limits_of(0.0, 0.8), [round(end, 9) for end in limits_of(0.8, 0.8 + 2e-11)]
    ((0.0, 0.8), [0.76, 0.84])
    """
    size = max(abs(low), abs(high))
    if high - low > FLAT * size:
        return low, high
    return low - 0.05 * (size or 1.0), high + 0.05 * (size or 1.0)


def is_geometric(values: np.ndarray) -> bool:
    """Whether sorted values are spaced evenly in their logarithm, over a decade or more."""
    if len(values) < 3 or values[0] <= 0.0 or values[-1] < 10.0 * values[0]:
        return False
    return bool(np.allclose(np.diff(np.log(values)), np.log(values[1] / values[0]), rtol=1e-6))


def check_picture(path: Path) -> str:
    """Find the format of a picture from the ending of its name, and check that it can be written."""
    kind = path.suffix.lower().removeprefix(".")
    if f".{kind}" not in PICTURE_SUFFIXES:
        *most, last = PICTURE_SUFFIXES
        raise UsageError(f"{path}: expected a name that ends in {', '.join(most)} or {last}")
    latex = str(rcParams["pgf.texsystem"])
    if kind == "pgf" and shutil.which(latex) is None:
        raise UsageError(
            f"{path}: .pgf needs {latex} of LaTeX, which is not installed; .pdf and .eps do without it"
        )
    return kind


def encoded(figure: Figure, kind: str, style: str | Path | None = None) -> bytes:
    """Encode a figure in a format of PICTURE_SUFFIXES; the bytes are the same each time."""
    if kind == "gif":
        return _encoded_frames(figure, style)
    buffer = io.BytesIO()
    # some formats have no metadata, and do not accept the argument
    options: dict[str, Any] = {"metadata": METADATA[kind]} if kind in METADATA else {}
    with styled(style):
        try:
            figure.savefig(buffer, format=kind, **options)
        except (RuntimeError, ValueError) as error:
            # LaTeX runs for the format .pgf, and if the user sets text.usetex; matplotlib refuses some savefig.dpi
            reason = " ".join(str(error).split())
            raise UsageError(f"the picture cannot be drawn as .{kind}: {reason}") from None
    if kind == "eps":
        return re.sub(rb"(?m)^%%CreationDate:.*\n", b"", buffer.getvalue())
    return buffer.getvalue()


def _encoded_frames(figure: Figure, style: str | Path | None) -> bytes:
    """Encode the frames of an animation as a GIF."""
    from matplotlib.animation import PillowWriter

    # only an animation has them, see `Picture`
    show_frame, frame_count = getattr(figure, "show_frame", None), int(getattr(figure, "frame_count", 0))
    if show_frame is None:
        raise UsageError(f"a .gif is an animation, expected {argument('kind', 'animation')}")
    writer = PillowWriter(fps=FRAMES_PER_SECOND)
    # the writer needs the name of a file
    with styled(style), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frames.gif"
        # the layout of the last frame is that of all; with a layout engine, each frame would be drawn twice
        figure.canvas.draw()
        figure.set_layout_engine("none")
        with writer.saving(figure, str(path), figure.dpi):
            for index in range(frame_count):
                show_frame(index)
                writer.grab_frame()
        return path.read_bytes()


def save_figure(
    figure: Figure, path: str | Path, *, overwrite: bool = True, style: str | Path | None = None
) -> None:
    """Write a figure in the format of the file's ending; the bytes are the same each time."""
    path = Path(path)
    write_file(path, encoded(figure, check_picture(path), style), overwrite=overwrite)
