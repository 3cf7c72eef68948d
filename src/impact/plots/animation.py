"""An impact as an animation: both balls, the force over time, and the loop of force over indentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from ..array_types import Array
from .curves import CurveData
from .data import Points
from .kinds import Choice, Kind
from .labels import label_axis
from .layout import Picture
from .motions import choose_point, curves_over, impact_inputs
from .style import tint

if TYPE_CHECKING:
    import xarray as xr

FRAMES = 80
# free flight before and after the contact, over the contact time
FREE_FLIGHT = 0.3
# drawn radius of the smaller ball over the largest displacement: displacements are magnified, the balls are not;
# and the largest ratio of radii, which looks like a plane
RADIUS, PLANE = 0.6, 50.0
# the panels beside each other only where each has room for its numbers [in]
MIN_WIDTH_OF_ROW = 5.0
COLOURS = ("#0072B2", "#D55E00")


@dataclass(frozen=True)
class AnimationData(CurveData):
    """Force over time and indentation of one impact, and where the surfaces of both balls are in each frame."""

    times: tuple[float, ...] = ()  # of the points of the curves [s]
    frames: tuple[float, ...] = ()  # times of the frames [s]
    surfaces: tuple[tuple[float, ...], ...] = ()  # displacement of each ball in each frame [m]
    radii: tuple[float, ...] = ()  # of the drawn balls [m]

    @property
    def panel_count(self) -> int:
        return 1 + len(self.panels)

    @property
    def names(self) -> set[str]:
        return super().names | {"x"}

    def place_panels(self, figure: Figure, width: float) -> tuple[list[Axes], float]:
        """Place the balls above both curves."""
        is_wide = width >= MIN_WIDTH_OF_ROW
        places, heights = ("AA;BC", (0.6, 1.0)) if is_wide else ("A;B;C", (0.6, 1.0, 1.0))
        all_axes = figure.subplot_mosaic(places, height_ratios=heights)
        return list(all_axes.values()), width * (0.6 if is_wide else 1.4)

    def draw(
        self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None
    ) -> list[tuple[Artist, str]]:
        """Draw the last frame; a `Picture` can show the others too."""
        scene, *curve_axes = all_axes
        entries: list[tuple[Artist, str]] = []
        lines, dots = [], []
        for axes, panel in zip(curve_axes, self.panels, strict=True):
            entries = CurveData(self.title, self.conditions, (panel,)).draw([axes], labels, None)
            (line,) = axes.lines
            axes.plot(line.get_xdata(), line.get_ydata(), color=tint(0.22), linewidth=0.8, zorder=1.0, label="_")
            lines.append(line)
            dots += axes.plot([], [], "o", color=tint(1.0), markersize=5.0, zorder=4.0, label="_")
        balls = self._draw_balls(scene, labels)
        show = partial(self.show_frame, balls=balls, lines=lines, dots=dots)
        show(len(self.frames) - 1)
        if isinstance(picture := scene.figure, Picture):
            picture.show_frame, picture.frame_count = show, len(self.frames)
        return entries

    def _draw_balls(self, scene: Axes, labels: Mapping[str, str]) -> list[Circle]:
        """Draw both balls over an axis of their displacements."""
        balls = [Circle((0.0, 0.0), r, fc=(c, 0.5), ec=c) for r, c in zip(self.radii, COLOURS, strict=True)]
        for ball in balls:
            scene.add_patch(ball)
        least = min(self.radii)
        low, high = min(self.surfaces[0]) - 2.1 * least, max(self.surfaces[1]) + 2.1 * least
        scene.set(xlim=(low, high), ylim=(-1.1 * least, 1.1 * least), yticks=[])
        scene.set_aspect("equal")
        scene.grid(visible=False)
        scene.spines["left"].set_visible(False)
        label_axis(
            scene.xaxis, "displacement of the surfaces", "x", "m", max(map(abs, (low, high))), labels, log=False
        )
        return balls

    def show_frame(
        self, index: int, *, balls: Sequence[Circle], lines: Sequence[Line2D], dots: Sequence[Line2D]
    ) -> None:
        """Move the balls, and the curves with the points at their ends, to a frame."""
        for ball, surface, side in zip(balls, self.surfaces, (-1.0, 1.0), strict=True):
            ball.center = surface[index] + side * ball.radius, 0.0
        count = max(1, int(np.searchsorted(self.times, self.frames[index], side="right")))
        for panel, line, dot in zip(self.panels, lines, dots, strict=True):
            x, y = panel.curves[0].x[:count], panel.curves[0].y[:count]
            line.set_data(x, y)
            dot.set_data(x[-1:], y[-1:])


def animation_data(histories: Sequence[xr.Dataset], choice: Choice) -> AnimationData:
    """Follow one impact in uniform frames, from before the contact until after it; other laws are left out."""
    shown, others = histories[:1], histories[1:]
    curves = curves_over("Impact", shown, [("t", "F", ""), ("delta", "F", "")], choice)
    history = shown[0]
    t = np.asarray(history["t"].values, float)
    frames = np.linspace(-FREE_FLIGHT * t[-1], (1.0 + FREE_FLIGHT) * t[-1], FRAMES)
    surfaces = [_displacement(history, ball, t, frames) for ball in ("1", "2")]
    radius = RADIUS * max(float(np.abs(surface).max()) for surface in surfaces)
    left_out = (f"{len(others)} other laws: an animation shows one impact",) if others else ()
    return AnimationData(
        curves.title,
        curves.conditions,
        curves.panels,
        not_drawn=(*curves.not_drawn, *left_out),
        times=tuple(t.tolist()),
        frames=tuple(frames.tolist()),
        surfaces=tuple(tuple(surface.tolist()) for surface in surfaces),
        radii=tuple(radius * ratio for ratio in _radius_ratios(history)),
    )


def _displacement(history: xr.Dataset, ball: str, t: Array, frames: Array) -> Array:
    """Compute the displacement of a ball at the times of frames, with constant velocities outside the contact."""
    x, v = history[f"x{ball}"].values, history[f"v{ball}"].values
    outside = np.minimum(frames - t[0], 0.0) * v[0] + np.maximum(frames - t[-1], 0.0) * v[-1]
    return np.asarray(np.interp(frames, t, x) + outside)


def _radius_ratios(history: xr.Dataset) -> tuple[float, float]:
    """Compute drawn radii of equal densities, of which the smaller is 1; an infinite mass looks like a plane."""
    inputs = impact_inputs(history)
    masses = [float(inputs.get(name, 1.0)) for name in ("m1", "m2")]
    first, second = (
        min((mass / min(masses)) ** (1.0 / 3.0), PLANE) if min(masses) < np.inf else 1.0 for mass in masses
    )
    return first, second


ANIMATION = Kind(
    "animation",
    "Both balls of one impact, its force over time and over the indentation.",
    animation_data,
    choose_point,
    along=(),
    source="history",
    in_report=False,
)
