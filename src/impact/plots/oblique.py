"""Pictures of friction: restitution, spin and impulse over the angle, rebound over slip, friction over slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..contact.status import FIRST_FAILURE, FrictionStatus
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..results.selection import select
from ..results.trajectory_table import lazy_dataset, table_of_result
from .curves import Curve, CurveData, Panel, curve_of
from .kinds import Choice, Kind
from .labels import LawPart, split_by_law
from .motions import choose_point, curves_over
from .restitution import complete, read_line
from .slices import Line, numeric_axes

if TYPE_CHECKING:
    import xarray as xr

NEEDS_FRICTION = "this result has no friction; sweep a config with frictions = [...]"
# pairs that are drawn where no friction law is chosen: more curves cannot be told apart
MAX_PAIRS = 8
# what beta means at some values
BETA_GUIDES = ((-1.0, "smooth"), (0.0, "sticks"), (1.0, "reverses"))
SPINS = ("omega1_post", "omega2_post")


def beta_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the tangential restitution of the contact points of every pair, over the angle or the first axis."""
    line, pairs = _pairs_along(dataset, choice, "beta")
    guides = [_guide(line, value, text) for value, text in BETA_GUIDES]
    panel = _panel(line, pairs, "beta", "Tangential restitution of the contact", guides)
    return complete(dataset, line, "Tangential restitution", [panel], choice)


def e_t_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the tangential restitution of the centres, with that of rigid balls that stick; see `beta_curves`."""
    line, pairs = _pairs_along(dataset, choice, "e_t")
    sticking = _sticking_e_t(line)
    guides = [_guide(line, sticking, "rigid, sticks")] if np.isfinite(sticking) else []
    panel = _panel(line, pairs, "e_t", "Tangential restitution of the centres", guides)
    return complete(dataset, line, "Tangential restitution of the centres", [panel], choice)


def impulse_ratio_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the ratio of the tangential and the normal impulse, and mu, its limit; see `beta_curves`."""
    line, pairs = _pairs_along(dataset, choice, "impulse_ratio")
    panel = _panel(line, pairs, "impulse_ratio", "Tangential over normal impulse")
    values = np.array([curve.y for curve in panel.curves])
    mu = line.data["mu"].values
    signs = [(sign, text) for sign, text in ((1.0, "μ"), (-1.0, "−μ")) if np.nanmax(sign * values) > 0.0]
    guides = [_guide(line, sign * mu, text) for sign, text in signs]
    return complete(dataset, line, "Impulse ratio", [replace(panel, curves=(*guides, *panel.curves))], choice)


def spin_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the spins after the impact of the balls that turn; see `beta_curves`."""
    line, pairs = _pairs_along(dataset, choice, *SPINS)
    turning = [
        name for name in SPINS if any(np.ptp(pair.data[name].values[np.isfinite(pair.data[name])]) for pair in pairs)
    ]
    ends = {name: f"ω{'₁₂'[SPINS.index(name)]}⁺" for name in SPINS} if len(turning) > 1 else {}
    panels = [
        _panel(line, pairs, name, "Spin after the impact", end=ends.get(name, "")) for name in turning or SPINS[:1]
    ]
    curves = tuple(curve for panel in panels for curve in panel.curves)
    return complete(
        dataset, line, "Spin after the impact", [replace(panels[0], curves=curves, y_name="omega_post")], choice
    )


def psi_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the slip after over the slip before the impact, in the units of Maw, Barber and Fawcett (1976)."""
    line, pairs = _pairs_along(_with_psi(dataset), choice, "psi1", "psi2")
    curves = []
    for pair in pairs:
        before, after = (pair.data[name].values for name in ("psi1", "psi2"))
        order = np.argsort(before, kind="stable")[: int(np.isfinite(before).sum())]
        curve = curve_of(pair.label, pair.model, before[order], after[order], "psi2")
        curves.append(replace(curve, friction=pair.friction))
    ends = np.array([(min(curve.x), max(curve.x)) for curve in curves])
    along = (float(ends[:, 0].min()), float(ends[:, 1].max()))
    guides = [replace(curve_of("", None, along, y, "psi2"), case=text, is_guide=True)
              for y, text in ((along, "smooth"), ((0.0, 0.0), "sticks"))]
    panel = Panel("", "Slip after the impact", (*guides, *curves), y_name="psi2")
    plot_data = complete(dataset, line, "Slip after the impact over slip before it", [panel], choice)
    x_axis = {"x_name": "psi1", "x_label": "Slip before the impact", "x_unit": "1", "x_log": "x" in choice.log}
    return replace(plot_data, panels=tuple(replace(panel, **x_axis) for panel in plot_data.panels))


def friction_loop_curves(histories: Sequence[xr.Dataset], choice: Choice) -> CurveData:
    """Draw friction over the slip displacement of one impact: the area under a curve is the work of friction."""
    if any("f" not in history for history in histories):
        raise UsageError("this time history has no friction; run a config with frictions = [...]")
    return curves_over(
        "Friction over slip", [_with_displacement(history) for history in histories], [("xi", "f", "")], choice
    )


def _with_displacement(history: xr.Dataset) -> xr.Dataset:
    """Add the displacement of the contact points against each other, the integral of the slip."""
    t, slip = history["t"].values, history["slip"].values
    displacement = np.concatenate(([0.0], np.cumsum(0.5 * (slip[1:] + slip[:-1]) * np.diff(t))))
    return history.assign(xi=("t", displacement, {"units": "m", "long_name": "slip displacement"}))


def _with_psi(dataset: xr.Dataset) -> xr.Dataset:
    """Add psi1 and psi2 to a result that lacks them, where it has the trajectories from which they follow."""
    lacking = [OUTPUTS[name] for name in ("psi1", "psi2") if name not in dataset]
    table = table_of_result(dataset) if lacking and "friction" in dataset.dims else None
    return dataset if table is None else dataset.assign(lazy_dataset(dataset, table, lacking).data_vars)


def _pairs_along(dataset: xr.Dataset, choice: Choice, *names: str) -> tuple[Line, list[LawPart]]:
    """Cut a line through a result; returns it with the pairs that have values of a variable there.

    The line is over the angle by default, else over the first axis of numbers. What is left out is in the line.
    """
    if "friction" not in dataset.dims:
        raise UsageError(NEEDS_FRICTION)
    line = read_line(dataset, replace(choice, x=choice.x or _first_axis(dataset, choice)), *names, keep=("friction",))
    pairs, not_drawn = [], []
    for pair in split_by_law(line.data, numbered=choice.equations):
        if any(np.isfinite(pair.data[name]).any() for name in names):
            pairs.append(pair)
        else:
            not_drawn.append(f"{pair.key}, {_reason(pair.data)}")
    if not pairs:
        raise UsageError(f"no pair has a value of {' or '.join(names)} here: {'; '.join(not_drawn[:3])}")
    if choice.frictions is None and len(pairs) > MAX_PAIRS:
        not_drawn.append(f"{len(pairs) - MAX_PAIRS} more pairs; choose some with --model and --friction")
        pairs = pairs[:MAX_PAIRS]
    return line._replace(not_drawn=(*line.not_drawn, *not_drawn)), pairs


def _first_axis(dataset: xr.Dataset, choice: Choice) -> str | None:
    """Find the angle, else the first input of several numbers that is not selected."""
    axes = numeric_axes(select(dataset, choice.sel or {}))
    return "angle" if "angle" in axes else next(iter(axes), None)


def _reason(data: xr.Dataset) -> str:
    """Say why a pair has no value."""
    statuses = np.unique(data["friction_status"]) if "friction_status" in data else ()
    failures = [FrictionStatus(int(status)).meaning for status in statuses if status >= FIRST_FAILURE]
    return "; ".join(failures) or "which has no point here"


def _panel(
    line: Line, pairs: Sequence[LawPart], name: str, y_label: str, guides: Sequence[Curve] = (), end: str = ""
) -> Panel:
    """Make a panel with a curve for each pair."""
    curves = [
        replace(
            curve_of(pair.label, pair.model, line.coordinate, pair.data[name], name, end), friction=pair.friction
        )
        for pair in pairs
    ]
    return Panel("", y_label, (*guides, *curves), y_unit=OUTPUTS[name].unit, y_name=name)


def _guide(line: Line, y: object, text: str) -> Curve:
    """Make a thin line with a text at its end; its value is a number, or one at each point."""
    return replace(curve_of("", None, line.coordinate, y, ""), case=text, is_guide=True)


def _sticking_e_t(line: Line) -> float:
    """Compute e_t of rigid balls whose contact points stick: 1 - m_t/m without a spin before; NaN with one.

    It is 5/7 for two solid spheres; only an inertia factor common to both balls, or a wall, is considered.
    """
    given = {name: line.data[name].values for name in ("omega1", "omega2", "inertia_factor1", "inertia_factor2") if name in line.data.coords}
    spins = [given.get(name, 0.0) for name in ("omega1", "omega2")]
    factors = np.unique(np.concatenate([np.ravel(value) for name, value in given.items() if "inertia" in name] or [[]]))
    return 1.0 / (1.0 + factors[0]) if len(factors) == 1 and not np.any(spins) else np.nan


def choose_pairs(dataset: xr.Dataset, keys: Sequence[str], names: Sequence[str] = ()) -> Choice | None:
    """Choose to draw the pairs of a result over the angle; None for a result without friction, or an axis."""
    if "friction" not in dataset.dims or not {*names} <= {*dataset.data_vars}:
        return None
    x = _first_axis(dataset, Choice())
    return None if x is None else Choice(x, models=keys)
