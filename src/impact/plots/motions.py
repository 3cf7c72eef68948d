"""Curves of an impact over time: hysteresis loops, time histories, the impulse-velocity diagram, an animation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from ..config.input_names import InputName
from ..contact.models import catalogue
from ..formatting import law_name, safe_text
from ..results.attributes import read_attribute
from ..results.schema import exponent_text, unit_of
from .curves import Curve, CurveData, Mark, Panel, curve_of
from .data import LegendEntries, Points
from .kinds import Choice, Kind
from .labels import REFERENCE, LawPart, NamedLaw, friction_text, label_axis, law_text, words_of
from .layout import Picture
from .slices import Inputs, choose_line, described_inputs, parameter_text
from .style import tint

# a permanent indentation is marked above this fraction of the largest one
MIN_MARKED_INDENTATION = 0.02
# relative tolerance within which two forces are equal
FORCE_RTOL = 1e-6
# free flight before and after the contact, over the contact time
FRAMES, FREE_FLIGHT = 80, 0.3
# drawn radius of the smaller ball over the largest displacement; ratios of radii: that looks plane, of the window
RADIUS, PLANE, WINDOW = 0.6, 50.0, 2.0
# the curves are beside each other only where each has room for its numbers [in]
MIN_WIDTH_OF_ROW = 5.0
COLOURS = ("#0072B2", "#D55E00")


def loop_curves(histories: Sequence[xr.Dataset], choice: Choice) -> CurveData:
    """Draw force over indentation, Figures 3 and 5 of the paper: the area of a loop is the energy loss."""
    lines = curves_over("Force over indentation", histories, [("delta", "F", "")], choice)
    if len(histories) > 1:
        return lines
    (panel,) = lines.panels
    return replace(lines, panels=(replace(panel, marks=_loop_marks(panel.curves[0])),))


def _loop_marks(curve: Curve) -> tuple[Mark, ...]:
    """Mark the largest indentation, its force if it is the largest, and the permanent indentation."""
    peak = int(np.argmax(curve.x))
    deepest, force, left = curve.x[peak], curve.y[peak], curve.x[-1]
    marks = [Mark("delta_m", deepest, force, "x")]
    if force > (1.0 - FORCE_RTOL) * max(curve.y):
        marks.append(Mark("f_m", deepest, force, "y"))
    if left > MIN_MARKED_INDENTATION * deepest:
        marks.append(Mark("delta_p", left, 0.0, "x"))
    return tuple(marks)


def history_curves(histories: Sequence[xr.Dataset], choice: Choice) -> CurveData:
    """Draw indentation, its rate and the force over time; see `loop_curves`."""
    return curves_over("Time history", histories, [("t", name, "") for name in ("delta", "v", "F")], choice)


def impulse_curves(histories: Sequence[xr.Dataset], choice: Choice) -> CurveData:
    """Draw velocities over the impulse, Figure 2: laws differ in where they end on the lines (8) and (9)."""
    histories = [_with_impulse(history) for history in histories]
    pairs = [("tau", "v1", "v₁"), ("tau", "v2", "v₂")]
    lines = curves_over("Velocities over the impulse", histories, pairs, choice)
    reference = f"{REFERENCE} (8), (9)" if choice.equations else REFERENCE
    curves = tuple(
        curve
        for panel, name in zip(lines.panels, ("v1", "v2"), strict=True)
        for curve in (*_reference_curve(histories[0], name, reference), *panel.curves)
    )
    both = replace(
        lines.panels[0], y_label="Velocity", y_name="v_i", curves=curves, marks=_impulse_marks(histories)
    )
    return replace(lines, panels=(both,))


def _impulse_marks(histories: Sequence[xr.Dataset]) -> tuple[Mark, ...]:
    """Mark the impulse of the approach, where the lines of the balls meet, and that of the whole impact."""
    first = histories[0]
    tau = first["tau"].values
    if not np.isfinite(tau).all():
        return ()
    m1 = float(impact_inputs(first)["m1"])
    tau_c = _effective_mass(impact_inputs(first)) * float(first["v"][0])
    marks = [Mark("tau_c", tau_c, float(first["v1"][0]) - tau_c / m1, "x")]
    if len(histories) == 1:
        marks.append(Mark("tau_f", float(tau[-1]), float(first["v2"][-1]), "x"))
    return tuple(marks)


def _reference_curve(history: xr.Dataset, name: str, label: str) -> list[Curve]:
    """Draw the impulse-momentum solution, from contact to the impulse τ_c (1 + e); nothing without an e."""
    inputs = impact_inputs(history)
    e, mass = inputs.get("e"), _effective_mass(inputs)
    if not isinstance(e, float | int) or not np.isfinite(mass):
        return []
    start = float(history[name][0])
    total = (1.0 + float(e)) * mass * float(history["v"][0])
    end = start + (-1.0 if name == "v1" else 1.0) * total / float(inputs[f"m{name[1]}"])
    return [curve_of(NamedLaw(label), (0.0, total), (start, end), name, {"v1": "v₁", "v2": "v₂"}[name])]


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

    def draw(self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None) -> LegendEntries:
        """Draw the last frame; a `Picture` can show the others too."""
        (scene, *curve_axes), (surfaces, *curve_panels) = all_axes, self.panels
        lines = list[Line2D]()
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
        label_axis(scene.xaxis, surfaces.y_label, "x", "m", labels, log=False)
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


def curves_over(
    title: str,
    histories: Sequence[xr.Dataset],
    pairs: Sequence[tuple[str, str, str]],
    choice: Choice,
    *,
    of_friction: bool = False,
) -> CurveData:
    """Draw a panel for each pair of names, whose third text is written at the end of its curves.

    Curves of friction are named by the friction law too.
    """
    first = histories[0]
    is_single = of_friction and len({str(history["model"].item()) for history in histories}) == 1
    laws = []
    for history in histories:
        friction = str(history["friction"].item()) if of_friction else ""
        # a single model is not named beside every friction law
        model = "" if is_single else _model_label(history, choice.equations)
        label = law_name(model, friction_text(friction, _with_units(history)))
        laws.append(LawPart(label, str(history["model"].item()), data=history, friction=friction))
    panels = []
    for x, y, end in pairs:
        curves = tuple(curve_of(law, law.data[x].values, law.data[y].values, y, end) for law in laws)
        x_label, y_label = (words_of(first[name].attrs, name) for name in (x, y))
        x_unit, y_unit = (unit_of(first[name]) for name in (x, y))
        panels.append(Panel(x_label, y_label, curves, x_unit, y_unit, x_name=x, y_name=y))
    model = _model_label(first, choice.equations) if is_single else ""
    conditions = ", ".join(filter(None, (model, _conditions_text(histories))))
    return CurveData(title, conditions, tuple(panels))


def _with_impulse(history: xr.Dataset) -> xr.Dataset:
    """Add the impulse that has reduced the closing speed to v."""
    v = np.asarray(history["v"].values, float)
    impulse = _effective_mass(impact_inputs(history)) * (v[0] - v)
    return history.assign(tau=("t", impulse, {"units": "N s", "long_name": "Impulse"}))


def _model_label(history: xr.Dataset, numbered: bool) -> str:
    """Write the name of a law, which may be a plug-in that is not installed."""
    key = str(history["model"].item())
    model, parameters = catalogue().get(key), parameter_text(key, _with_units(history))
    if model is None:
        return ", ".join(filter(None, (safe_text(key, 80), parameters)))
    return law_text(model.title, model.year, model.equation, parameters, numbered=numbered)


def impact_inputs(history: xr.Dataset) -> Mapping[str, float | str]:
    """Read the inputs of the impact, stored in its time history."""
    inputs: Mapping[str, float | str] = read_attribute(history.attrs, "inputs")
    return inputs


def _effective_mass(inputs: Mapping[str, float | str]) -> float:
    """Compute the effective mass [kg]; NaN where it is unknown."""
    try:
        return 1.0 / (1.0 / float(inputs["m1"]) + 1.0 / float(inputs["m2"]))
    except (KeyError, ValueError, TypeError, ZeroDivisionError):
        return float("nan")


def _conditions_text(histories: Sequence[xr.Dataset]) -> str:
    by_model = {str(history["model"].item()): impact_inputs(history).get("n") for history in histories}
    exponents = {key: n for key, n in by_model.items() if isinstance(n, float)}
    text = exponent_text(exponents) if len(exponents) == len(by_model) else None
    # a law with a K of its own does not use that of the sweep, whose unit follows from n
    users = [history for history in histories if f"{history['model'].item()}.K" not in impact_inputs(history)]
    inputs = _with_units((users or histories)[0])
    return described_inputs({name: each for name, each in inputs.items() if users or name != "K"}, text)


def _with_units(history: xr.Dataset) -> Inputs:
    return {name: (value, InputName.parse(name).unit) for name, value in impact_inputs(history).items()}


def choose_point(dataset: xr.Dataset, keys: Sequence[str]) -> Choice | None:
    """Choose the axis at whose middle a motion is drawn; None for results at fixed steps, which have no motion."""
    # only results at fixed steps name their integrator
    return None if "integrator" in dataset.attrs else choose_line(dataset, keys)


# a kind of picture of one impact
motion = partial(Kind, default=choose_point, along=(), source="history")
LOOP = motion("Force over indentation at one point: the area of a loop is the energy loss.", loop_curves)
HISTORY = motion("Indentation, its rate and the force over time.", history_curves, in_report=False)
IMPULSE = motion("Velocities over the impulse at one point.", impulse_curves, in_report=False)
ANIMATION = motion("Both balls of an impact, force over time and loop.", animation_data, in_report=False)
