"""Curves of an impact over time: hysteresis loops, time histories and the impulse-velocity diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from ..config.input_names import InputName
from ..contact.models import catalogue
from ..formatting import law_name, safe_text
from ..results.attributes import read_attribute
from ..results.schema import exponent_text
from .curves import Curve, CurveData, Mark, Panel, curve_of
from .kinds import Choice, Kind
from .labels import REFERENCE, LawPart, NamedLaw, friction_text, law_text, words_of
from .slices import Inputs, choose_line, described_inputs, parameter_text, unit_of

# a permanent indentation is marked above this fraction of the largest one
MIN_MARKED_INDENTATION = 0.02
# relative tolerance within which two forces are equal
FORCE_RTOL = 1e-6


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
        # a single model is not named beside every friction law
        names = [] if is_single else [_model_label(history, choice.equations)]
        friction = str(history["friction"].item()) if of_friction else ""
        if friction:
            names.append(friction_text(friction, _with_units(history)))
        laws.append(LawPart(law_name(*names), str(history["model"].item()), friction, data=history))
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
    return described_inputs(_with_units(histories[0]), text)


def _with_units(history: xr.Dataset) -> Inputs:
    return {name: (value, InputName.parse(name).unit) for name, value in impact_inputs(history).items()}


def choose_point(dataset: xr.Dataset, keys: Sequence[str]) -> Choice | None:
    """Choose the axis at whose middle a motion is drawn; None for results at fixed steps, which have no motion."""
    # only results at fixed steps name their integrator
    return None if "integrator" in dataset.attrs else choose_line(dataset, keys)


# a kind of picture of one impact
motion = partial(Kind, default=choose_point, along=(), source="history")
LOOP = motion("loop", "Force over indentation at one point: the area of a loop is the energy loss.", loop_curves)
HISTORY = motion("history", "Indentation, its rate and the force over time.", history_curves, in_report=False)
IMPULSE = motion("impulse", "Velocities over the impulse at one point.", impulse_curves, in_report=False)
