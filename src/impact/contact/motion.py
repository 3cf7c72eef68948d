"""The motion of a contact in its own units, as a problem for the integrator.

A phase is integrated in a smooth coordinate, x = xᵣ + sᵖ with dt = p sᵖ⁻¹ dσ: near contact and separation x^(3/2)
has no third derivative, and an integrator of order five would lose its order there. With it

    ds/dσ = v,  dv/dσ = −p sᵖ⁻¹ F,  dt/dσ = p sᵖ⁻¹,  dW/dσ = p sᵖ⁻¹ F v,

where W is the work done against the force. Where the damping is strong, another coordinate may stand for v.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from ..ode.event import choose
from ..ode.problem import Array, Columns, Mask, Problem, Rates
from .creeping import creeps, may_creep
from .formula import Formula, ask, wishes
from .model import IN_FORCE, ForceModel
from .momentum import Momentum, coordinate, force_form, signed_power
from .phases import AT, Bend
from .power import integer_power, power

# scaled s beyond which a ball is taken to have passed through: no force stopped it
FAR = 1e8
# each component is judged against itself: what a strong damping leaves of the velocity is small beside v0 and
# still decides where the force vanishes; near s = 0 the motion is so smooth that its relative error is small, too
FLOOR = (1e-200, 1e-200)
# first steps for an error of 1: on approach there is no force yet, at the peak it is largest and there is no speed
FIRST_INWARD, FIRST_OUTWARD = 2.7, 0.87
# step of the difference that gives the rate of the force at the release, relative to s, at which it may vanish; a
# step may end at s = 0 itself, and s below this is taken for it
DIFFERENCE, NEAREST = 1e-7, 1e-12
# what an unloading branch is told besides, in columns that follow the law's own
BRANCH = ("peak", "force_at_peak", "residual", "recovered")
# the force of a law without damping is taken to be a power of s below this
POWER = 16.0
# of a coordinate that asks for no coefficient
NONE = np.empty(0)


@dataclass(frozen=True)
class Law:
    """A model's law at one exponent n, with the names of the columns that its formulas draw on."""

    model: ForceModel
    n: float
    names: tuple[str, ...]
    momentum: Momentum

    @classmethod
    def of(cls, model: ForceModel, n: float, strong: bool) -> Law:
        """The law of a model, which draws on what the formulas of its motion ask for.

        Where the damping is strong, the coordinate that the law declares for it stands for v.
        """
        formulas = (
            model.force, model.unloading, model.residual, model.recovered, *model.bends, *model.unloading_bends
        )  # fmt: skip
        asked = {wish for formula in formulas for wish in wishes(formula)}
        own = {*model.quantities, *model.coefficients} - {"K", "m", "v0", "n"}
        return cls(model, n, tuple(sorted(asked & own)), coordinate(model, n) if strong else Momentum())

    def call(self, formula: Formula, columns: Columns, given: dict[str, Array]) -> Array:
        """A formula's value from the columns and what else is given; K, m and v0 are 1."""
        known: dict[str, Array | float] = {"K": 1.0, "m": 1.0, "v0": 1.0, "n": self.n, **given}
        known.update(zip(self.names, columns, strict=True))
        return ask(formula, known)

    def velocity(self, y: Array, columns: Columns) -> Array:
        """v from the components."""
        return self.momentum.velocity(y, self.strength(columns))

    def strength(self, columns: Columns) -> Array:
        """The coefficient that the coordinate of the law asks for."""
        return columns[self.names.index(self.momentum.strength)] if self.momentum.strength else NONE


def approach(law: Law) -> Problem:
    """From contact to the largest indentation: v falls to zero."""
    return Problem(
        rates=_rates(law, law.model.force, ()),
        event=lambda y, k, columns: law.momentum.stop(y, k),
        lost=lambda y, k, columns: np.asarray(y[0] > FAR),
        floor=FLOOR,
        watch=True,
        first=FIRST_INWARD,
    )


def restitution(law: Law) -> Problem:
    """From the largest indentation to the release: s, or the force, falls to zero.

    Where the law has an unloading branch, columns of the peak, the force there and the residual indentation
    follow the law's own.
    """
    branch = law.model.unloading
    rates = _rates(law, branch or law.model.force, BRANCH if branch else ())

    def force_event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        s, force = y[0], k[4]
        small = DIFFERENCE * np.clip(np.abs(s), NEAREST, 1.0)
        slope = (rates(y + small * k[:2], columns)[4] - force) / small
        return release(s, k[0], force, slope)

    def gap_event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        return y[0], k[0]

    def turned_back(y: Array, k: Array, columns: Columns) -> Mask:
        return np.asarray(k[0] >= 0.0)

    def creeping(y: Array, k: Array, columns: Columns) -> Mask:
        c, x = columns[law.names.index("c")], integer_power(y[0], law.model.smooth)
        return creeps(x, -k[0], c, law.n, force_form(law.model, law.n).drag / law.model.smooth)

    event = force_event if law.model.release == "force" else gap_event
    lost = creeping if may_creep(law.model) else turned_back
    return Problem(rates=rates, event=event, lost=lost, floor=FLOOR, first=FIRST_OUTWARD)


def release(s: Array, rate: Array, force: Array, slope: Array) -> tuple[Array, Array]:
    """The sooner of s and the force to fall to zero, and its rate; for arrays and for numbers."""
    # without damping the force vanishes with the indentation, as a power of s, and only touches zero: s then
    # tells the end. A force that vanishes before does so in a small part of the time that s still needs
    sooner = POWER * force * np.abs(rate) < s * np.abs(slope)
    by_force = (sooner & (s > 0.0)) | ((force < s) & (s <= 0.0))
    return choose(by_force, force, s), choose(by_force, slope, rate)


def bends(law: Law, columns: Columns, start: Array, residual: Array | None = None) -> tuple[Columns, list[Bend]]:
    """The columns of a phase, with those of its bends, and the bends of its force.

    Parameters
    ----------
    law : the law
    columns : of the phase, each of shape (n,)
    start : its components at the start, shape (2, n)
    residual : permanent indentation, of the restitution phase; None on approach
    """
    model, own = law.model, len(law.names)
    extra = BRANCH if residual is not None and model.unloading is not None else ()
    # where one force is for both phases, its bends are met again on the way back
    formulas = model.unloading_bends if extra else model.bends
    given = dict(zip(extra, columns[own:], strict=False))
    found: list[Bend] = []
    for formula in formulas:
        if not IN_FORCE.keys().isdisjoint(wishes(formula)):
            found.append(_of_motion(law, formula, extra))
            continue
        x = np.broadcast_to(law.call(formula, columns[:own], given), start.shape[1])
        x = x - (0.0 if residual is None else residual)
        at = power(np.where(x > 0.0, x, np.nan), 1.0 / model.smooth)
        found.append(_at(len(columns)))
        # one at which the phase begins is none
        columns = (*columns, np.where(np.abs(at - start[0]) > AT * at, at, np.nan))
    return columns, found


def _at(place: int) -> Bend:
    """The bend at an s of a column."""
    return lambda y, columns: np.asarray(columns[place] - y[0])


def _of_motion(law: Law, formula: Formula, extra: tuple[str, ...]) -> Bend:
    """The bend where a function of the motion changes its sign."""

    def bend(y: Array, columns: Columns) -> Array:
        given = _given(law, {*wishes(formula)}, extra, y, columns)
        return law.call(formula, columns[: len(law.names)], given)

    return bend


def of_restitution(law: Law) -> Law:
    """The law of the restitution phase: a branch of its own is not of the form that a coordinate is for."""
    return law if law.model.unloading is None else replace(law, momentum=Momentum())


def start_of_approach(law: Law, columns: Columns, n: int) -> Array:
    """s = 0, v = 1."""
    return _components(law, columns, np.zeros(1), 1.0, n)


def start_of_restitution(law: Law, columns: Columns, recovered: Array) -> Array:
    """s at the peak above the residual indentation, v = 0."""
    return _components(law, columns, power(recovered, 1.0 / law.model.smooth), 0.0, recovered.size)


def _components(law: Law, columns: Columns, s: Array, v: float, n: int) -> Array:
    """The components, shape (2, n), at s, of shape (n,) or (1,), where all have a velocity."""
    y = np.empty((2, n))
    y[0] = s
    y[1] = law.momentum.of(s, v, law.strength(columns))
    return y


def indentation(law: Law, s: Array) -> Array:
    """x above the residual indentation."""
    return integer_power(s, law.model.smooth)


def force_at_peak(law: Law, s: Array, columns: Columns) -> Array:
    """The force of the approach where it ends."""
    at_rest, formula = _components(law, columns, s, 0.0, s.size), law.model.force
    force = law.call(formula, columns, _given(law, {*wishes(formula)}, (), at_rest, columns))
    return np.broadcast_to(force, s.shape)


def turn(law: Law, columns: Columns, peak: Array, at_peak: Array) -> tuple[Array, Array, Columns]:
    """The residual indentation, what of the peak is recovered, and the columns of the restitution phase."""
    model, residual = law.model, np.zeros_like(peak)
    formula = model.residual or model.recovered
    if formula is not None:
        own = law.call(formula, columns, {"peak": peak, "force_at_peak": at_peak})
        if own.shape not in ((), peak.shape):
            raise ModelError(f"{model.key}: the residual has the shape {own.shape}, wants {peak.shape}")
        residual = residual + own
    recovered = peak - residual
    if model.recovered is not None:
        residual, recovered = recovered, residual
    branch = () if model.unloading is None else (peak, at_peak, residual, recovered)
    return residual, recovered, (*columns, *branch)


def _given(law: Law, asked: set[str], extra: tuple[str, ...], y: Array, columns: Columns) -> dict[str, Array]:
    """What a formula may ask of the motion: the velocity, and the indentation in the forms that are asked for."""
    p, s = law.model.smooth, y[0]
    given = {"v": law.velocity(y, columns)}
    if extra:
        given.update(zip(extra, columns[len(law.names) :], strict=False))
        stretch = given["stretch"] = integer_power(s, p)
        x = given["x"] = stretch + given["residual"]
        if "elastic" in asked:
            given["elastic"] = power(x, law.n)
    else:
        if "x" in asked:
            given["x"] = integer_power(s, p)
        if "elastic" in asked:
            given["elastic"] = signed_power(s, p * law.n)
    return given


def _rates(law: Law, formula: Formula, extra: tuple[str, ...]) -> Rates:
    p, own = law.model.smooth, len(law.names)
    asked = {*wishes(formula)}

    def rates(y: Array, columns: Columns, out: Array | None = None) -> Array:
        s, given = y[0], _given(law, asked, extra, y, columns)
        v = given["v"]
        force = law.call(formula, columns[:own], given)
        if force.shape != s.shape and force.shape != ():
            raise ModelError(f"{law.model.key}: the force has the shape {force.shape}, wants {s.shape}")

        # a caller that gives room for fewer rows wants no more; the rows are those of the rates and the force
        out = np.empty((5, s.size)) if out is None else out
        wanted = len(out)
        weight = np.multiply(integer_power(s, p - 1), p, out[2] if wanted > 2 else None)
        out[0], second = v, out[1]
        np.multiply(weight, force, second)
        if wanted > 3:
            np.multiply(second, v, out[3])
        if wanted > 4:
            out[4] = force
        law.momentum.rates(out, y, weight, given.get("elastic", weight), law.strength(columns))
        return out

    return rates
