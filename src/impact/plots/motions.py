"""Curves of an impact over time: hysteresis loops, time histories and the impulse-velocity diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..config.tables import SWEEP_QUANTITIES
from ..contact.models import catalogue
from ..errors import UsageError
from ..results.attributes import read_attribute
from ..results.schema import exponent_text, plain_unit
from ..text import safe_text
from .curves import Curve, CurveData, Mark, Panel
from .labels import REFERENCE, law_text, words_of
from .slices import described_inputs, parameter_text

if TYPE_CHECKING:
    import xarray as xr

# a permanent indentation is marked above this fraction of the largest one
MIN_MARKED_INDENTATION = 0.02
# relative tolerance within which two forces are equal
FORCE_RTOL = 1e-6


def loop(histories: Sequence[xr.Dataset], *, equations: bool = False) -> CurveData:
    """Force over indentation, Figures 3 and 5 of the paper: the area of a loop is the energy loss.

    Parameters
    ----------
    histories : time histories of one impact by several models, as `impact.run(...).history` is
    equations : name the laws with the numbers of their equations in the paper
    """
    lines = _curves_over("Force over indentation", histories, [("delta", "F", "")], equations)
    if len(histories) > 1:
        return lines
    (panel,) = lines.panels
    return replace(lines, panels=(replace(panel, marks=_loop_marks(panel.curves[0])),))


def _loop_marks(curve: Curve) -> tuple[Mark, ...]:
    """Marks at the largest indentation, at its force if it is the largest, and at the permanent indentation."""
    peak = int(np.argmax(curve.x))
    deepest, force, left = curve.x[peak], curve.y[peak], curve.x[-1]
    marks = [Mark("delta_m", deepest, force, "x")]
    if force > (1.0 - FORCE_RTOL) * max(curve.y):
        marks.append(Mark("f_m", deepest, force, "y"))
    if left > MIN_MARKED_INDENTATION * deepest:
        marks.append(Mark("delta_p", left, 0.0, "x"))
    return tuple(marks)


def history(histories: Sequence[xr.Dataset], *, equations: bool = False) -> CurveData:
    """Indentation, its rate and the force over time; see `loop`."""
    return _curves_over("Time history", histories, [("t", name, "") for name in ("delta", "v", "F")], equations)


def impulse(histories: Sequence[xr.Dataset], *, equations: bool = False) -> CurveData:
    """Velocities over the impulse, Figure 2 of the paper; see `loop`.

    All laws follow the same straight lines, (8) and (9), and differ in where they end.
    """
    pairs = [("tau", "v1", "v₁"), ("tau", "v2", "v₂")]
    lines = _curves_over("Velocities over the impulse", histories, pairs, equations)
    reference = f"{REFERENCE} (8), (9)" if equations else REFERENCE
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
    """Marks at the impulse of the approach, where the lines of the balls meet, and at that of the whole impact."""
    first = histories[0]
    tau = np.asarray(_series(first, "tau"))
    if not np.isfinite(tau).all():
        return ()
    m1 = float(_impact_inputs(first)["m1"])
    tau_c = _effective_mass(_impact_inputs(first)) * float(first["v"][0])
    marks = [Mark("tau_c", tau_c, float(first["v1"][0]) - tau_c / m1, "x")]
    if len(histories) == 1:
        marks.append(Mark("tau_f", float(tau[-1]), float(first["v2"][-1]), "x"))
    return tuple(marks)


def _reference_curve(of_model: xr.Dataset, name: str, label: str) -> list[Curve]:
    """The line of the impulse-momentum solution, from contact to the impulse τ_c (1 + e); none without an e."""
    inputs = _impact_inputs(of_model)
    e, mass = inputs.get("e"), _effective_mass(inputs)
    if not isinstance(e, float | int) or not np.isfinite(mass):
        return []
    start = float(of_model[name][0])
    total = (1.0 + float(e)) * mass * float(of_model["v"][0])
    end = start + (-1.0 if name == "v1" else 1.0) * total / float(inputs[f"m{name[1]}"])
    return [Curve(label, None, (0.0, total), (start, end), {"v1": "v₁", "v2": "v₂"}[name], name)]


def _curves_over(
    title: str, histories: Sequence[xr.Dataset], pairs: Sequence[tuple[str, str, str]], equations: bool
) -> CurveData:
    if not histories:
        raise UsageError("no motion to draw: no model has an impact at this point")
    first = histories[0]
    panels = []
    for x, y, end in pairs:
        curves = [
            Curve(
                _model_label(of_model, equations),
                str(of_model["model"].item()),
                _series(of_model, x),
                _series(of_model, y),
                end,
                y,
            )
            for of_model in histories
        ]
        (x_label, x_unit), (y_label, y_unit) = _axis_label_and_unit(first, x), _axis_label_and_unit(first, y)
        panels.append(Panel(x_label, y_label, tuple(curves), x_unit, y_unit, x_name=x, y_name=y))
    return CurveData(title, _conditions_text(histories), tuple(panels))


def _series(of_model: xr.Dataset, name: str) -> tuple[float, ...]:
    if name == "tau":
        # the impulse that reduced the closing speed to v
        return tuple(
            (_effective_mass(_impact_inputs(of_model)) * (float(of_model["v"][0]) - of_model["v"].values)).tolist()
        )
    return tuple(np.asarray(of_model[name].values, float).tolist())


def _axis_label_and_unit(of_model: xr.Dataset, name: str) -> tuple[str, str]:
    """The label and the unit of an axis."""
    if name == "tau":
        return "Impulse", "N s"
    attributes = of_model[name].attrs
    return words_of(attributes, name), safe_text(plain_unit(str(attributes.get("units", "1"))))


def _model_label(of_model: xr.Dataset, equations: bool) -> str:
    key = str(of_model["model"].item())
    model, parameters = catalogue().get(key), parameter_text(key, _impact_inputs(of_model))
    if model is None:
        return ", ".join(filter(None, (safe_text(key, 80), parameters)))
    return law_text(model.title, model.year, model.equation, parameters, numbered=equations)


def _impact_inputs(of_model: xr.Dataset) -> Mapping[str, float | str]:
    """The inputs of the impact, stored in its time history."""
    inputs: Mapping[str, float | str] = read_attribute(of_model.attrs, "inputs")
    return inputs


def _effective_mass(inputs: Mapping[str, float | str]) -> float:
    """The effective mass [kg]; NaN where it is unknown."""
    try:
        return 1.0 / (1.0 / float(inputs["m1"]) + 1.0 / float(inputs["m2"]))
    except (KeyError, ValueError, TypeError, ZeroDivisionError):
        return float("nan")


def _conditions_text(histories: Sequence[xr.Dataset]) -> str:
    """The inputs as text."""
    inputs = _impact_inputs(histories[0])
    by_model = {str(of_model["model"].item()): _impact_inputs(of_model).get("n") for of_model in histories}
    exponents = {key: n for key, n in by_model.items() if isinstance(n, float)}
    text = exponent_text(exponents) if len(exponents) == len(by_model) else None
    units = {name: SWEEP_QUANTITIES[name].unit if name in SWEEP_QUANTITIES else "1" for name in inputs}
    return described_inputs(inputs, units, text)


MOTIONS = {"loop": loop, "history": history, "impulse": impulse}
