"""The motion of a contact in its own units, as a problem for the integrator.

A phase is integrated in a smooth coordinate, x = xᵣ + sᵖ with dt = p sᵖ⁻¹ dσ: near contact and separation x^(3/2)
has no third derivative, and an integrator of order five would lose its order there. With it

    ds/dσ = v,  dv/dσ = −p sᵖ⁻¹ F,  dt/dσ = p sᵖ⁻¹,  dW/dσ = p sᵖ⁻¹ F v,

where W is the work done against the force. Where the damping is strong, another coordinate may stand for v.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ModelError
from ..ode.problem import Array, Columns, Mask, Problem, Rates
from .formula import Formula, ask, wishes
from .model import ForceModel
from .momentum import Momentum, coordinate, signed_power
from .power import integer_power, power

# scaled s beyond which a ball is taken to have passed through: no force stopped it
FAR = 1e8
# each component is judged against itself: what a strong damping leaves of the velocity is small beside v0 and
# still decides where the force vanishes; near s = 0 the motion is so smooth that its relative error is small, too
FLOOR = (1e-200, 1e-200)
# step of the difference that gives the rate of the force at the release, relative to s, at which it may vanish
DIFFERENCE = 1e-7
# what an unloading branch is told besides, in columns that follow the law's own
BRANCH = ("peak", "force_at_peak", "residual")
# the force of a law without damping is taken to be a power of s below this
POWER = 16.0
# of a coordinate that asks for no coefficient
NONE = np.empty(0)
Event = Callable[[Array, Array, Columns], tuple[Array, Array]]


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
        formulas = (model.force, model.unloading, model.residual, *model.bends, *model.unloading_bends)
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


def approach(law: Law, bend: int = 0) -> Problem:
    """From contact to the largest indentation: v falls to zero; or to a bend of the force."""

    def stop_event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        return law.momentum.stop(y, k)

    return Problem(
        rates=_rates(law, law.model.force, None),
        event=_or_bend(stop_event, bend),
        lost=lambda y, k: np.asarray(y[0] > FAR),
        floor=FLOOR,
        watch=True,
    )


def restitution(law: Law, bend: int = 0) -> Problem:
    """From the largest indentation to the release: s, or the force, falls to zero; or to a bend of the force.

    Where the law has an unloading branch, columns of the peak, the force there and the residual indentation
    follow the law's own.
    """
    branch = law.model.unloading
    rates = _rates(law, branch or law.model.force, branch and BRANCH)

    def force_event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        s, force = y[0], k[4]
        small = DIFFERENCE * np.minimum(np.abs(s), 1.0)
        slope = (rates(y + small * k[:2], columns)[4] - force) / small
        # without damping the force vanishes with the indentation, as a power of s, and only touches zero: s then
        # tells the end. A force that vanishes before does so in a small part of the time that s still needs
        sooner = POWER * force * np.abs(k[0]) < s * np.abs(slope)
        by_force = np.where(s > 0.0, sooner, force < s)
        return np.where(by_force, force, s), np.where(by_force, slope, k[0])

    def gap_event(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        return y[0], k[0]

    def turned_back(y: Array, k: Array) -> Mask:
        return np.asarray(k[0] >= 0.0)

    event = force_event if law.model.release == "force" else gap_event
    return Problem(rates=rates, event=_or_bend(event, bend), lost=turned_back, floor=FLOOR)


def _or_bend(event: Event, bend: int) -> Event:
    """The event, or a bend at the s of the last column, whichever is sooner; `bend` is the direction of s."""
    if not bend:
        return event

    def sooner(y: Array, k: Array, columns: Columns) -> tuple[Array, Array]:
        g, dg = event(y, k, columns)
        left, rate = bend * (columns[-1] - y[0]), -bend * k[0]
        by_bend = (left < 0.0) | ((g > 0.0) & (left * dg > g * rate))
        return np.where(by_bend, left, g), np.where(by_bend, rate, dg)

    return sooner


def bends(law: Law, columns: Columns, n: int, residual: Array | None = None) -> list[Array]:
    """The s at which the force of a phase has a bend, in the order in which they are met; NaN is none.

    Parameters
    ----------
    law : the law
    columns : of the phase, each of shape (n,)
    residual : permanent indentation, of the restitution phase; None on approach
    """
    model, own = law.model, len(law.names)
    formulas = model.bends
    if residual is not None:
        # where one force is for both phases, its bends are met again on the way back
        formulas = model.bends[::-1] if model.unloading is None else model.unloading_bends
    given = dict(zip(BRANCH, columns[own:], strict=False))
    found = []
    for formula in formulas:
        x = np.broadcast_to(law.call(formula, columns[:own], given), n) - (0.0 if residual is None else residual)
        found.append(power(np.where(x > 0.0, x, np.nan), 1.0 / model.smooth))
    return found


def of_restitution(law: Law) -> Law:
    """The law of the restitution phase: a branch of its own is not of the form that a coordinate is for."""
    return law if law.model.unloading is None else replace(law, momentum=Momentum())


def start_of_approach(law: Law, columns: Columns, n: int) -> Array:
    """s = 0, v = 1."""
    s = np.zeros(n)
    return np.array([s, law.momentum.of(s, np.ones(n), law.strength(columns))])


def start_of_restitution(law: Law, columns: Columns, peak: Array, residual: Array) -> Array:
    """s at the peak above the residual indentation, v = 0."""
    s = power(peak - residual, 1.0 / law.model.smooth)
    return np.array([s, law.momentum.of(s, np.zeros(s.size), law.strength(columns))])


def indentation(law: Law, s: Array) -> Array:
    """x above the residual indentation."""
    return integer_power(s, law.model.smooth)


def force_at_peak(law: Law, s: Array, columns: Columns) -> Array:
    """The force of the approach where it ends."""
    return np.asarray(_rates(law, law.model.force, None)(np.array([s, np.zeros(s.size)]), columns)[4])


def turn(law: Law, columns: Columns, peak: Array, at_peak: Array) -> tuple[Array, Columns]:
    """The residual indentation, and the columns of the restitution phase."""
    model = law.model
    residual = np.zeros_like(peak)
    if model.residual is not None:
        given = {"peak": peak, "force_at_peak": at_peak}
        own = law.call(model.residual, columns, given)
        if own.shape not in ((), peak.shape):
            raise ModelError(f"{model.key}: the residual has the shape {own.shape}, wants {peak.shape}")
        residual = residual + own
    return residual, columns if model.unloading is None else (*columns, peak, at_peak, residual)


def _rates(law: Law, formula: Formula, extra: tuple[str, ...] | None) -> Rates:
    p = law.model.smooth
    stretch, elastic = "x" in wishes(formula), "elastic" in wishes(formula)
    own = len(law.names)

    def rates(y: Array, columns: Columns, out: Array | None = None) -> Array:
        s, v = y[0], law.velocity(y, columns)
        given = {"v": v}
        if extra:
            given.update(zip(extra, columns[own:], strict=False))
            x = given["x"] = integer_power(s, p) + given["residual"]
            if elastic:
                given["elastic"] = power(x, law.n)
        else:
            if stretch:
                given["x"] = integer_power(s, p)
            if elastic:
                given["elastic"] = signed_power(s, p * law.n)
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
