"""An impact as an animation: both balls, the force over time, and the loop of force over indentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from .curves import CurveData
from .data import Points
from .kinds import Choice
from .labels import label_axis
from .layout import Picture
from .motions import curves_over, impact_inputs, motion
from .style import tint

if TYPE_CHECKING:
    import xarray as xr

# free flight before and after the contact, over the contact time
FRAMES, FREE_FLIGHT = 80, 0.3
# drawn radius of the smaller ball over the largest displacement; ratios of radii: that looks plane, of the window
RADIUS, PLANE, WINDOW = 0.6, 50.0, 2.0
# the curves are beside each other only where each has room for its numbers [in]
MIN_WIDTH_OF_ROW = 5.0
COLOURS = ("#0072B2", "#D55E00")


@dataclass(frozen=True)
class AnimationData(CurveData):
    """Displacement and force over time, and force over indentation, of one impact.

    The displacements are drawn as balls that move, and are larger than in proportion to them.
    """

    radii: tuple[float, ...] = ()  # of the drawn balls [m], which have equal densities

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
        (scene, *curve_axes), (surfaces, *curve_panels) = all_axes, self.panels
        entries, lines = list[tuple[Artist, str]](), list[Line2D]()
        for axes, panel in zip(curve_axes, curve_panels, strict=True):
            entries = CurveData(self.title, self.conditions, (panel,)).draw([axes], labels, points)
            line = axes.lines[-1]
            axes.plot(*line.get_data(), color=tint(0.22), linewidth=0.8, zorder=1.0, label="_")
            # the only marker is at the end that moves
            line.set(linestyle="-", marker="o", markevery=[-1], markerfacecolor=line.get_color())
            lines.append(line)
        balls = [Circle((0.0, 0.0), r, fc=(c, 0.5), ec=c) for r, c in zip(self.radii, COLOURS, strict=True)]
        for ball in balls:
            scene.add_patch(ball)
        sizes = np.minimum(self.radii, WINDOW * min(self.radii))
        low, high = min(surfaces.curves[0].y) - 2.1 * sizes[0], max(surfaces.curves[1].y) + 2.1 * sizes[1]
        scene.set(xlim=(low, high), ylim=(-1.05 * max(sizes), 1.05 * max(sizes)), yticks=[], aspect="equal")
        scene.spines["left"].set_visible(False)
        label_axis(scene.xaxis, surfaces.y_label, "x", "m", max(-low, high), labels, log=False)
        # a method, so that a figure can be pickled
        show_frame = partial(self.show_frame, balls, lines)
        show_frame(FRAMES - 1)
        if isinstance(scene.figure, Picture):
            scene.figure.show_frame, scene.figure.frame_count = show_frame, FRAMES
        return entries

    def show_frame(self, balls: Sequence[Circle], lines: Sequence[Line2D], index: int) -> None:
        """Move the balls and the ends of the curves to a frame."""
        surfaces, *curve_panels = self.panels
        for ball, surface, side in zip(balls, surfaces.curves, (-1.0, 1.0), strict=True):
            ball.center = surface.y[index] + side * ball.radius, 0.0
        count = max(1, int(np.searchsorted(curve_panels[0].curves[0].x, surfaces.curves[0].x[index], "right")))
        for panel, line in zip(curve_panels, lines, strict=True):
            line.set_data(panel.curves[0].x[:count], panel.curves[0].y[:count])


def animation_data(histories: Sequence[xr.Dataset], choice: Choice) -> AnimationData:
    """Follow one impact in uniform frames, from before the contact until after it; other laws are left out."""
    curves = curves_over("Impact", histories[:1], [("t", "F", ""), ("delta", "F", "")], choice)
    force, history = curves.panels[0], histories[0]
    t = history["t"].values
    frames = np.linspace(-FREE_FLIGHT, 1.0 + FREE_FLIGHT, FRAMES) * t[-1]
    # velocities are constant outside the contact
    before, after = np.minimum(frames, 0.0), np.maximum(frames - t[-1], 0.0)
    surfaces = []
    for ball in ("1", "2"):
        x, v = history[f"x{ball}"].values, history[f"v{ball}"].values
        path = np.interp(frames, t, x) + before * v[0] + after * v[-1]
        surfaces.append(
            replace(force.curves[0], variable="x", case=f"ball {ball}", x=tuple(frames), y=tuple(path))
        )
    scene = replace(force, y_label="displacement", y_name="x", y_unit="m", curves=tuple(surfaces))
    masses = np.array([impact_inputs(history)["m1"], impact_inputs(history)["m2"]], float)
    radii = np.minimum(np.cbrt(masses / masses.min()), PLANE) * RADIUS * np.abs([c.y for c in surfaces]).max()
    left_out = ("the other laws: an animation shows one impact",) if len(histories) > 1 else ()
    return AnimationData(curves.title, curves.conditions, (scene, *curves.panels), left_out, radii=tuple(radii))


ANIMATION = motion(
    "animation", "Both balls of an impact, force over time and loop.", animation_data, in_report=False
)
