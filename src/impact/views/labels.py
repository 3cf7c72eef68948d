"""Names that stand beside their curves, where there is room."""

from __future__ import annotations

from itertools import product
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

Array = NDArray[np.float64]

# places along a curve and gaps from it [pt] that are tried for its name
PLACES, GAPS = 41, (4.0, 8.0)
SIDES = ((0, 1), (0, -1), (-1, 1), (1, -1), (1, 1), (-1, -1), (1, 0), (-1, 0))
# a name stays so far from other curves and names, and from the frame [pt]
AWAY, INSIDE = 2.5, 3.0
# it is nearer to its own curve than to another by this; farther than that from another is no better [pt]
CLEAR, FAR = 4.0, 60.0
# size of a name [pt], and the letters of its lines
SIZE, WIDE = 8.0, 28


def label_curves(figure: Figure, axes: Axes) -> bool:
    """Write each curve's name beside it, clear of all others; without room for all of them, write none.

    The name stands where it is nearest to its own curve and farthest from the others.
    """
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    scale = figure.dpi / 72.0
    frame = axes.get_window_extent(renderer).padded(-INSIDE * scale)
    lines = [line for line in axes.lines if len(np.atleast_1d(line.get_xdata())) > 0]
    paths = {line: _dense(axes, line) for line in lines}
    # names that are there already are in the way
    taken = [text.get_window_extent(renderer) for text in axes.texts]
    # many laws lie on a reference: beside it both names stand
    references = {line for line in lines if line.get_color() == "black"}
    placed: list[tuple[Line2D, tuple[float, float]]] = []
    for line in (line for line in lines if not str(line.get_label()).startswith("_")):
        text = axes.annotate(
            fill(str(line.get_label()), WIDE), (0, 0), xycoords="axes fraction", fontsize=SIZE, parse_math=False
        )
        box = text.get_window_extent(renderer)
        text.remove()
        alike = [other for other in lines if _look(other) == _look(line)]
        best: tuple[float, Bbox] | None = None
        for own in (paths[other] for other in alike):
            for place, gap, (aside, side) in product(np.linspace(0.02, 0.98, PLACES), GAPS, SIDES):
                if not len(own):
                    continue
                x, y = own[int(place * (len(own) - 1))]
                # beside a steep curve, above or below a flat one
                x += (aside * (box.width + gap * scale) - box.width) / 2
                y += (side * (box.height + 2 * gap * scale) - box.height) / 2
                spot = Bbox.from_bounds(x, y, box.width, box.height)
                if not (
                    frame.x0 <= spot.x0 and spot.x1 <= frame.x1 and frame.y0 <= spot.y0 and spot.y1 <= frame.y1
                ):
                    continue
                wide = spot.padded(AWAY * scale)
                if any(wide.overlaps(other) for other in taken) or any(
                    _through(wide, path) for path in paths.values()
                ):
                    continue
                mine = _distance(spot, own)
                others = [
                    _distance(spot, path) for other, path in paths.items()
                    if len(path) and other not in alike and not {line, other} & references
                ]  # fmt: skip
                nearest = min([*others, FAR * scale])
                # a name that is as near to another curve could be that one's
                if nearest >= mine + CLEAR * scale and (best is None or nearest - 2.0 * mine > best[0]):
                    best = nearest - 2.0 * mine, spot
        if best is None:
            return False
        taken.append(best[1])
        placed.append((line, (best[1].x0, best[1].y0)))
    for line, corner in placed:
        at = axes.transAxes.inverted().transform(corner)
        axes.text(
            at[0], at[1], fill(str(line.get_label()), WIDE), transform=axes.transAxes, fontsize=SIZE,
            parse_math=False, color=str(line.get_color()), va="bottom", ha="left",
        )  # fmt: skip
    return True


def _look(line: Line2D) -> tuple[object, ...]:
    return line.get_color(), line.get_marker(), line.get_linestyle()


def _dense(axes: Axes, line: Line2D) -> Array:
    """Points of a curve on the canvas, no farther than a few pixels apart; of shape (k, 2)."""
    points = axes.transData.transform(
        np.column_stack([np.atleast_1d(line.get_xdata()), np.atleast_1d(line.get_ydata())])
    )
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return np.asarray(points)
    steps = np.maximum(np.ceil(np.hypot(*np.diff(points, axis=0).T) / 4.0).astype(int), 1)
    counts = np.minimum(steps, 2000)
    parts = [
        np.linspace(first, last, count, endpoint=False)
        for first, last, count in zip(points[:-1], points[1:], counts, strict=True)
    ]
    return np.vstack([*parts, points[-1:]])


def _through(box: Bbox, path: Array) -> bool:
    """Whether a curve goes through a box."""
    if not len(path):
        return False
    inside = (path[:, 0] > box.x0) & (path[:, 0] < box.x1) & (path[:, 1] > box.y0) & (path[:, 1] < box.y1)
    return bool(inside.any())


def _distance(box: Bbox, path: Array) -> float:
    """How near a curve comes to a box."""
    x = np.maximum(np.maximum(box.x0 - path[:, 0], path[:, 0] - box.x1), 0.0)
    y = np.maximum(np.maximum(box.y0 - path[:, 1], path[:, 1] - box.y1), 0.0)
    return float(np.min(np.hypot(x, y)))
