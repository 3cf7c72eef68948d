"""Pictures of friction: restitution, spin and impulse over the angle, rebound over slip, friction over slip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from ..contact.models import catalogue
from ..contact.status import FIRST_FAILURE, FrictionStatus
from ..contact.variables import OUTPUTS
from ..errors import UsageError
from ..formatting import argument, number
from ..results.selection import select
from .curves import Curve, CurveData, Panel, curve_of, law_curves
from .kinds import Choice, Kind
from .labels import LawPart, NamedLaw, mark_slow_limit, split_by_law
from .motions import choose_point, curves_over, motion
from .restitution import complete
from .slices import Line, choose_line, read_line

# pairs that are drawn where no friction law is chosen: more curves cannot be told apart
MAX_PAIRS = 8
# a picture of slips ends at this multiple of the largest one that is stopped or reversed
SHOWN_PSI = 1.5
# what beta means at some values
BETA_GUIDES = ((-1.0, "smooth"), (0.0, "sticks"), (1.0, "reverses"))
ROTATION = ("omega1", "omega2", "inertia_factor1", "inertia_factor2")
SPINS = ("omega1_post", "omega2_post")


def beta_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the tangential restitution of the contact points of every pair, over the angle or the first axis."""
    line, pairs = _pairs_along(dataset, choice, "beta")
    guides = [_guide(line.coordinate, value, text) for value, text in BETA_GUIDES]
    panel = _panel(line, pairs, "beta", "Tangential restitution of the contact", guides)
    return complete(line, "Tangential restitution of the contact", [panel], choice)


def e_t_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the tangential restitution of the centres, with that of rigid balls that stick; see `beta_curves`."""
    line, pairs = _pairs_along(dataset, choice, "e_t")
    guides = [_guide(line.coordinate, e_t, "sticks") for e_t in _sticking_e_t(line.data)]
    panel = _panel(line, pairs, "e_t", "Tangential restitution of the centres", guides)
    return complete(line, "Tangential restitution of the centres", [panel], choice)


def impulse_ratio_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the ratio of the tangential and the normal impulse, and mu, its limit; see `beta_curves`."""
    line, pairs = _pairs_along(dataset, choice, "impulse_ratio")
    panel = _panel(line, pairs, "impulse_ratio", "Tangential over normal impulse")
    values = np.array([curve.y for curve in panel.curves])
    mu = line.data["mu"].values
    signs = [(sign, text) for sign, text in ((1.0, "μ"), (-1.0, "−μ")) if np.nanmax(sign * values) > 0.0]
    guides = [_guide(line.coordinate, sign * mu, text) for sign, text in signs]
    return complete(line, "Impulse ratio", [replace(panel, curves=(*guides, *panel.curves))], choice)


def spin_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the spins after the impact of the balls that turn; see `beta_curves`."""
    # the spin of a wall need not be stored
    spins = [name for name in SPINS if name in dataset] or SPINS
    line, pairs = _pairs_along(dataset, choice, *spins)
    turning = [n for n in spins if any(np.nan_to_num(pair.data[n].values).any() for pair in pairs)] or spins[:1]
    ends = dict(zip(SPINS, ("ω₁⁺", "ω₂⁺"), strict=True)) if len(turning) > 1 else {}
    curves = [c for name in turning for c in law_curves(pairs, line.coordinate, {name: ends.get(name, "")})]
    y_name = "omega_post" if ends else turning[0]
    panel = Panel("", "Spin after the impact", tuple(curves), y_unit=OUTPUTS[turning[0]].unit, y_name=y_name)
    return complete(line, "Spin after the impact", [panel], choice)


def psi_curves(dataset: xr.Dataset, choice: Choice) -> CurveData:
    """Read the slip after over the slip before the impact, in the units of Maw, Barber and Fawcett (1976)."""
    line, pairs = _pairs_along(dataset, choice, "psi1", "psi2")
    slips = [tuple(np.asarray(pair.data[name].values, float) for name in ("psi1", "psi2")) for pair in pairs]
    # far beyond the slips that are stopped or reversed the curves are lines, which would hide the rest
    stopped = [np.abs(before[before * after <= 0.0]).max(initial=0.0) for before, after in slips]
    most = SHOWN_PSI * max(stopped) or np.inf
    curves = []
    for pair, (before, after) in zip(pairs, slips, strict=True):
        order = np.argsort(before, kind="stable")
        order = order[np.abs(before[order]) <= most]
        curves.append(curve_of(pair, before[order], after[order], "psi2"))
    if any((np.abs(before) > most).any() for before, _ in slips):
        beyond = f"slips beyond psi1 = {number(float(most), 3)}, {SHOWN_PSI} times the largest that is stopped"
        line = line._replace(not_drawn=(*line.not_drawn, beyond))
    shown = [end for curve in curves for end in curve.x]
    along = np.array([min(shown), max(shown)])
    guides = [_guide(along, along, "smooth"), _guide(along, 0.0, "sticks")]
    panel = Panel("", "Slip after the impact", (*guides, *curves), y_name="psi2")
    x_axis: dict[str, Any] = {"x_name": "psi1", "x_label": "Slip before the impact", "x_unit": "1", "x_log": False}
    return complete(line, "Slip after over slip before the impact", [panel], choice, **x_axis)


def friction_loop_curves(histories: Sequence[xr.Dataset], choice: Choice) -> CurveData:
    """Draw friction over the slip displacement of one impact: the area under a curve is the work of friction."""
    if any("f" not in history for history in histories):
        raise UsageError("this impact has no friction; run or sweep a config with frictions = [...]")
    moved = []
    for history in histories:
        # the displacement of the contact points against each other is the integral of the slip
        t, slip = history["t"].values, history["slip"].values
        displacement = np.concatenate(([0.0], np.cumsum(0.5 * (slip[1:] + slip[:-1]) * np.diff(t))))
        moved.append(history.assign(xi=("t", displacement, {"units": "m", "long_name": "slip displacement"})))
    return curves_over("Friction over slip", moved, [("xi", "f", "")], choice, of_friction=True)


def _pairs_along(dataset: xr.Dataset, choice: Choice, *names: str) -> tuple[Line, list[LawPart]]:
    """Cut a line through a result; returns it with the pairs that have values of a variable there.

    The line is over the angle by default, else over the first axis of numbers. What is left out is in the line.
    """
    if "friction" not in dataset.dims:
        raise UsageError("this result has no friction; sweep a config with frictions = [...]")
    x = choice.x or choose_line(select(dataset, choice.sel or {}), None, "angle").x
    line = read_line(dataset, replace(choice, x=x), *names, keep=("friction",))
    pairs, not_drawn = [], []
    # of the variables that are looked at alone: a part is made for each of hundreds of pairs
    needed = [name for name in (*names, "friction_status") if name in line.data]
    for pair in split_by_law(line.data[needed], numbered=choice.equations):
        statuses = np.unique(pair.data["friction_status"]) if "friction_status" in pair.data else np.zeros(0)
        # the spin of a wall is a number whatever becomes of the ball
        has_failed = statuses.size > 0 and (statuses >= FIRST_FAILURE).all()
        if not has_failed and any(np.isfinite(pair.data.variables[name].values).any() for name in names):
            pairs.append(mark_slow_limit(pair))
        else:
            failures = [FrictionStatus(int(status)).meaning for status in statuses if status >= FIRST_FAILURE]
            not_drawn.append(f"{pair.law}: {'; '.join(failures) or 'not defined'}")
    if not pairs:
        raise UsageError(f"no pair has a value of {' or '.join(names)} here: {not_drawn[0]}")
    if choice.frictions is None and len(pairs) > MAX_PAIRS:
        choice_of_pairs = f"{argument('models')} and {argument('frictions')}"
        not_drawn.append(f"{len(pairs) - MAX_PAIRS} more pairs; choose some with {choice_of_pairs}")
        # the law of a code is seldom used with the friction of another
        pairs = sorted(pairs, key=_is_of_two_codes)[:MAX_PAIRS]
    return line._replace(not_drawn=(*line.not_drawn, *not_drawn)), pairs


def _is_of_two_codes(pair: LawPart) -> bool:
    """Whether a model of a code stands beside the friction law of another, by the first words of the keys."""
    codes = {key.partition("-")[0] for key, law in catalogue().items() if law.family == "codes"}
    words = {key.partition("-")[0] for key in (pair.model or "", pair.friction)}
    return len(words) == 2 and words <= codes


def _panel(line: Line, pairs: Sequence[LawPart], name: str, y_label: str, guides: Sequence[Curve] = ()) -> Panel:
    curves = law_curves(pairs, line.coordinate, {name: ""})
    return Panel("", y_label, (*guides, *curves), y_unit=OUTPUTS[name].unit, y_name=name)


def _guide(x: ArrayLike, y: ArrayLike, text: str) -> Curve:
    """Make a thin line with a text at its end; y is a number, or one at each x."""
    return replace(curve_of(NamedLaw(""), x, y, ""), case=text, is_guide=True)


def _sticking_e_t(data: xr.Dataset) -> list[float]:
    """Compute e_t = 1/(1 + q) of rigid balls whose contact points stick, 5/7 for solid spheres; else nothing.

    It holds without spins before the impact, for an inertia factor q that the balls, or a ball and a wall, have.
    """
    inputs = {name: data[name].values.ravel() for name in ROTATION if name in data.coords}
    spins, factors = (
        np.concatenate([np.zeros(0), *(values for name, values in inputs.items() if name.startswith(kind))])
        for kind in ("omega", "inertia")
    )
    has_one = not spins.any() and np.unique(factors).size == 1
    return [1.0 / (1.0 + float(factors[0]))] if has_one else []


def choose_pairs(dataset: xr.Dataset, keys: Sequence[str], needed: str) -> Choice | None:
    """Choose to draw the pairs of a result over the angle; None without friction, an axis or a needed variable."""
    choice = choose_line(dataset, keys, "angle") if "friction" in dataset.dims and needed in dataset else None
    return choice if choice and choice.x else None


def choose_loop(dataset: xr.Dataset, keys: Sequence[str]) -> Choice | None:
    """Choose the point of a motion with friction, of at most MAX_PAIRS; None for a result without friction."""
    choice = choose_point(dataset, keys) if "friction" in dataset.dims else None
    few = keys[: max(1, MAX_PAIRS // dataset.sizes["friction"])] if choice else keys
    return choice and replace(choice, x=choose_line(dataset, keys, "angle").x, models=few)


def _of_pairs(caption: str, data: Callable[[xr.Dataset, Choice], CurveData], needed: str) -> Kind:
    return Kind(caption, data, partial(choose_pairs, needed=needed), of_friction=True)


BETA = _of_pairs("Tangential restitution of the contact points of each pair.", beta_curves, "beta")
E_T = _of_pairs("Tangential restitution of the centres, as it is measured.", e_t_curves, "e_t")
IMPULSE_RATIO = _of_pairs(
    "Tangential over normal impulse, and the coefficient of friction.", impulse_ratio_curves, "impulse_ratio"
)
SPIN = _of_pairs("Spins of the balls after the impact.", spin_curves, "omega1_post")
PSI = _of_pairs("Slip after over slip before the impact, as Maw, Barber and Fawcett draw it.", psi_curves, "psi1")
FRICTION_LOOP = motion(
    "Friction over the slip displacement of one impact: the area is the energy lost.",
    friction_loop_curves,
    default=choose_loop,
    of_friction=True,
)
