"""Pictures of impacts through time: hysteresis loops, histories, and the impulse-velocity diagram."""

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
from .curves import Curve, Lines, Mark, Panel
from .labels import REFERENCE, law_text, words_of
from .slices import described_inputs, own_conditions

if TYPE_CHECKING:
    import xarray as xr

# an indentation that is left is marked above this part of the largest one; forces as near as this are the same
VISIBLE, SAME = 0.02, 1e-6


def loop(histories: Sequence[xr.Dataset], *, equations: bool = False) -> Lines:
    """Force over indentation, Figures 3 and 5 of the paper: the area of a loop is the energy that is lost.

    Parameters
    ----------
    histories : time histories of one impact by several models, as `impact.run(...).history` is
    equations : name the laws with the numbers of their equations in the paper
    """
    lines = _lines("Force over indentation", histories, [("delta", "F", "")], equations)
    if len(histories) > 1:
        return lines
    (panel,) = lines.panels
    return replace(lines, panels=(replace(panel, marks=_of_loop(panel.curves[0])),))


def _of_loop(curve: Curve) -> tuple[Mark, ...]:
    """The largest indentation, the force there if no other is larger, and the indentation that is left."""
    peak = int(np.argmax(curve.x))
    deepest, force, left = curve.x[peak], curve.y[peak], curve.x[-1]
    marks = [Mark("delta_m", deepest, force, "x")]
    if force > (1.0 - SAME) * max(curve.y):
        marks.append(Mark("f_m", deepest, force, "y"))
    if left > VISIBLE * deepest:
        marks.append(Mark("delta_p", left, 0.0, "x"))
    return tuple(marks)


def history(histories: Sequence[xr.Dataset], *, equations: bool = False) -> Lines:
    """Indentation, its rate and the force over time; see `loop`."""
    return _lines("Time history", histories, [("t", name, "") for name in ("delta", "v", "F")], equations)


def impulse(histories: Sequence[xr.Dataset], *, equations: bool = False) -> Lines:
    """Velocities over the impulse, Figure 2 of the paper; see `loop`.

    All laws move on the same straight lines, (8) and (9), and differ in where they end.
    """
    pairs = [("tau", "v1", "v₁"), ("tau", "v2", "v₂")]
    lines = _lines("Velocities over the impulse", histories, pairs, equations)
    reference = f"{REFERENCE} (8), (9)" if equations else REFERENCE
    curves = tuple(
        curve
        for panel, name in zip(lines.panels, ("v1", "v2"), strict=True)
        for curve in (*_reference(histories[0], name, reference), *panel.curves)
    )
    both = replace(lines.panels[0], y_label="Velocity", y_name="v_i", curves=curves, marks=_of_impulse(histories))
    return replace(lines, panels=(both,))


def _of_impulse(histories: Sequence[xr.Dataset]) -> tuple[Mark, ...]:
    """The impulse of the approach, where the lines of the balls meet, and that of the whole impact."""
    first = histories[0]
    tau = np.asarray(_values(first, "tau"))
    if not np.isfinite(tau).all():
        return ()
    m1 = float(_inputs(first)["m1"])
    tau_c = _mass(_inputs(first)) * float(first["v"][0])
    marks = [Mark("tau_c", tau_c, float(first["v1"][0]) - tau_c / m1, "x")]
    if len(histories) == 1:
        marks.append(Mark("tau_f", float(tau[-1]), float(first["v2"][-1]), "x"))
    return tuple(marks)


def _reference(of_model: xr.Dataset, name: str, label: str) -> list[Curve]:
    """The line of the impulse-momentum solution, from contact to the impulse τ_c (1 + e); none without an e."""
    at = _inputs(of_model)
    e, mass = at.get("e"), _mass(at)
    if not isinstance(e, float | int) or not np.isfinite(mass):
        return []
    start = float(of_model[name][0])
    total = (1.0 + float(e)) * mass * float(of_model["v"][0])
    after = start + (-1.0 if name == "v1" else 1.0) * total / float(at[f"m{name[1]}"])
    return [Curve(label, None, (0.0, total), (start, after), {"v1": "v₁", "v2": "v₂"}[name], name)]


def _lines(
    title: str, histories: Sequence[xr.Dataset], pairs: Sequence[tuple[str, str, str]], equations: bool
) -> Lines:
    if not histories:
        raise UsageError("there is no motion to draw: no model has an impact here")
    first = histories[0]
    panels = []
    for x, y, end in pairs:
        curves = [
            Curve(_label(of_model, equations), str(of_model["model"].item()), _values(of_model, x),
                  _values(of_model, y), end, y)
            for of_model in histories
        ]  # fmt: skip
        (x_label, x_unit), (y_label, y_unit) = _axis(first, x), _axis(first, y)
        panels.append(Panel(x_label, y_label, tuple(curves), x_unit, y_unit, x_name=x, y_name=y))
    return Lines(title, _conditions(histories), tuple(panels))


def _values(of_model: xr.Dataset, name: str) -> tuple[float, ...]:
    if name == "tau":
        # what it took from the closing speed
        return tuple((_mass(_inputs(of_model)) * (float(of_model["v"][0]) - of_model["v"].values)).tolist())
    return tuple(np.asarray(of_model[name].values, float).tolist())


def _axis(of_model: xr.Dataset, name: str) -> tuple[str, str]:
    """What an axis shows, and its unit."""
    if name == "tau":
        return "Impulse", "N s"
    attributes = of_model[name].attrs
    return words_of(attributes, name), safe_text(plain_unit(str(attributes.get("units", "1"))))


def _label(of_model: xr.Dataset, equations: bool) -> str:
    key = str(of_model["model"].item())
    model, own = catalogue().get(key), own_conditions(key, _inputs(of_model))
    if model is None:
        return ", ".join(filter(None, (safe_text(key, 80), own)))
    return law_text(model.title, model.year, model.equation, own, numbered=equations)


def _inputs(of_model: xr.Dataset) -> Mapping[str, float | str]:
    """The inputs of the impact, which its file has."""
    inputs: Mapping[str, float | str] = read_attribute(of_model.attrs, "inputs")
    return inputs


def _mass(at: Mapping[str, float | str]) -> float:
    """The effective mass; NaN where it is not known."""
    try:
        return 1.0 / (1.0 / float(at["m1"]) + 1.0 / float(at["m2"]))
    except (KeyError, ValueError, TypeError, ZeroDivisionError):
        return float("nan")


def _conditions(histories: Sequence[xr.Dataset]) -> str:
    """The inputs in words."""
    inputs = _inputs(histories[0])
    by_model = {str(of_model["model"].item()): _inputs(of_model).get("n") for of_model in histories}
    exponents = {key: n for key, n in by_model.items() if isinstance(n, float)}
    text = exponent_text(exponents) if len(exponents) == len(by_model) else None
    units = {name: SWEEP_QUANTITIES[name].unit if name in SWEEP_QUANTITIES else "1" for name in inputs}
    return described_inputs(inputs, units, text)


MOTIONS = {"loop": loop, "history": history, "impulse": impulse}
