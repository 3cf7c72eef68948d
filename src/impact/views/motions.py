"""Pictures of impacts through time: hysteresis loops, histories, and the impulse-velocity diagram."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..contact.models import catalogue
from ..errors import UsageError
from ..results.schema import exponent_text, plain_unit
from ..sweeps.rules import SWEEP
from ..text import safe_text
from .lines import Curve, Lines, Mark, Panel
from .over import title_of

if TYPE_CHECKING:
    import xarray as xr

# an indentation that is left is marked above this part of the largest one; forces as near as this are the same
VISIBLE, SAME = 0.02, 1e-6
IMPULSE_MOMENTUM = "Impulse-momentum (8), (9)"


def loop(histories: Sequence[xr.Dataset]) -> Lines:
    """Force over indentation, Figures 3 and 5 of the paper: the area of a loop is the energy that is lost.

    Parameters
    ----------
    histories : time histories of one impact by several models, as `impact.run(...).history` is
    """
    lines = _lines("Force over indentation", histories, [("delta", "F", "")])
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


def history(histories: Sequence[xr.Dataset]) -> Lines:
    """Indentation, its rate and the force over time; see `loop`."""
    return _lines("Time history", histories, [("t", name, "") for name in ("delta", "v", "F")])


def impulse(histories: Sequence[xr.Dataset]) -> Lines:
    """Velocities over the impulse that has passed, Figure 2 of the paper; see `loop`.

    All laws move on the same straight lines, (8) and (9), and differ in where they end.
    """
    found = _lines("Velocities over the impulse", histories, [("tau", "v1", "v₁"), ("tau", "v2", "v₂")])
    panels = [
        _with_reference(panel, histories[0], name) for panel, name in zip(found.panels, ("v1", "v2"), strict=True)
    ]
    curves = tuple(curve for panel in panels for curve in panel.curves)
    marks = _of_impulse(histories)
    both = Panel(
        panels[0].x_label, "velocities of the balls, v1 and v2 [m/s]", curves, panels[0].x_unit, marks=marks
    )
    return Lines(found.title, found.conditions, (both,))


def _of_impulse(histories: Sequence[xr.Dataset]) -> tuple[Mark, ...]:
    """The impulse of the approach, where the lines of the balls meet, and that of the whole impact."""
    one = histories[0]
    tau = np.asarray(_values(one, "tau"))
    if not np.isfinite(tau).all():
        return ()
    m1 = float(_inputs(one)["m1"])
    tau_c = _mass(_inputs(one)) * float(one["v"][0])
    marks = [Mark("tau_c", tau_c, float(one["v1"][0]) - tau_c / m1, "x")]
    if len(histories) == 1:
        marks.append(Mark("tau_f", float(tau[-1]), float(one["v2"][-1]), "x"))
    return tuple(marks)


def _with_reference(panel: Panel, one: xr.Dataset, name: str) -> Panel:
    """With the line of the impulse-momentum solution, from contact to the impulse τ_c (1 + e)."""
    at = _inputs(one)
    e, mass = at.get("e"), _mass(at)
    if not isinstance(e, float | int) or not np.isfinite(mass):
        return panel
    start = float(one[name][0])
    v0 = float(one["v"][0])
    total = (1.0 + float(e)) * mass * v0
    own = float(at[f"m{name[1]}"])
    after = start + (-1.0 if name == "v1" else 1.0) * total / own
    reference = Curve(IMPULSE_MOMENTUM, None, (0.0, total), (start, after), {"v1": "v₁", "v2": "v₂"}[name])
    return replace(panel, curves=(reference, *panel.curves))


def _lines(title: str, histories: Sequence[xr.Dataset], pairs: Sequence[tuple[str, str, str]]) -> Lines:
    if not histories:
        raise UsageError("there is no motion to draw: no model has an impact here")
    panels = []
    for x, y, end in pairs:
        curves = [
            Curve(_label(one), str(one["model"].item()), _values(one, x), _values(one, y), end)
            for one in histories
        ]
        (x_label, x_unit), (y_label, y_unit) = _axis(histories[0], x), _axis(histories[0], y)
        panels.append(Panel(x_label, y_label, tuple(curves), x_unit, y_unit))
    return Lines(title, _conditions(histories), tuple(panels))


def _values(one: xr.Dataset, name: str) -> tuple[float, ...]:
    if name == "tau":
        # what it took from the closing speed
        return tuple((_mass(_inputs(one)) * (float(one["v"][0]) - one["v"].values)).tolist())
    return tuple(np.asarray(one[name].values, float).tolist())


def _axis(one: xr.Dataset, name: str) -> tuple[str, str]:
    """What an axis shows, and its unit."""
    if name == "tau":
        return "impulse that has passed, τ", "N s"
    unit = plain_unit(str(one[name].attrs.get("units", "1")))
    return safe_text(f"{one[name].attrs.get('long_name', name)}, {name}"), safe_text(unit)


def _label(one: xr.Dataset) -> str:
    key = str(one["model"].item())
    model = catalogue().get(key)
    return title_of(model.title, model.year, model.equation) if model else safe_text(key, 80)


def _inputs(one: xr.Dataset) -> Mapping[str, float | str]:
    """The inputs of the impact, which its file tells."""
    try:
        found = json.loads(str(one.attrs.get("inputs", "{}")))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _mass(at: Mapping[str, float | str]) -> float:
    """The effective mass; NaN where it is not known."""
    try:
        return 1.0 / (1.0 / float(at["m1"]) + 1.0 / float(at["m2"]))
    except (KeyError, ValueError, TypeError, ZeroDivisionError):
        return float("nan")


def _conditions(histories: Sequence[xr.Dataset]) -> str:
    """The inputs in words."""
    parts = []
    inputs = dict(_inputs(histories[0]))
    exponents = {str(one["model"].item()): _inputs(one).get("n") for one in histories}
    if all(isinstance(n, float) for n in exponents.values()):
        inputs["n"] = exponent_text(exponents)  # type: ignore[arg-type]
    for name, value in inputs.items():
        unit = SWEEP[name].unit if name in SWEEP else "1"
        unit = "" if unit == "1" or "n" in unit else f" {plain_unit(unit)}"
        parts.append(
            safe_text(f"{name} = {value:g}{unit}" if isinstance(value, float | int) else f"{name} = {value}", 60)
        )
    # each stays on its line
    return ", ".join(part.replace(" ", "\u00a0") for part in parts)


MOTIONS: dict[str, Callable[[Sequence[xr.Dataset]], Lines]] = {
    "loop": loop,
    "history": history,
    "impulse": impulse,
}
