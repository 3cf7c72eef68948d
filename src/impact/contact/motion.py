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
from ..ode.events import choose
from ..ode.problem import Array, Mask, Params, Problem, Rates
from .formula import Formula, argument_names, call_by_name
from .model import FORCE_ARGUMENTS, ForceModel
from .piecewise import BREAKPOINT_TOLERANCE, Breakpoint
from .powers import integer_power, power
from .velocity_coordinates import VelocityCoordinate, coordinate, force_form, signed_power

# scaled s beyond which a ball is taken to have passed through: no force stopped it
MAX_S = 1e8
# each component is judged against itself: what a strong damping leaves of the velocity is small beside v0 and
# still decides where the force vanishes; near s = 0 the motion is so smooth that its relative error is small, too
ERROR_FLOOR = (1e-200, 1e-200)
# first steps for an error of 1: on approach there is no force yet, at the peak it is largest and there is no speed
APPROACH_STEP, RESTITUTION_STEP = 2.7, 0.87
# step of the difference that gives the rate of the force at the release, relative to s, at which it may vanish; a
# step may end at s = 0 itself, and s below this is taken for it
RELEASE_STEP, MIN_RELEASE_S = 1e-7, 1e-12
# what an unloading branch is told besides, in params that follow the law's own
UNLOADING_PARAMS = ("peak", "force_at_peak", "residual", "recovered")
# the force of a law without damping is taken to be a power of s below this
MAX_FORCE_EXPONENT = 16.0
# of a coordinate that asks for no coefficient
NO_COEFFICIENT = np.empty(0)
# a damping is critical from this of its square on, which rounding may have made smaller
CRITICAL_MARGIN = 1.0 + 1e-12
# a speed that counts as zero beside v0
ZERO_SPEED = 1e-10
# bounds B x^k of a speed that are tried: the exponents k, and B peak^(k-1) in units of v0/length; and the
# indentations, relative to the peak, at which each has to hold
BOUND_EXPONENTS = (1.0, 1.25, 1.5, 2.0)
BOUND_RATES = np.geomspace(1e-4, 1e4, 65)
BOUND_INDENTATIONS = 10.0 ** -np.linspace(0.0, 40.0, 81)
# trajectories that are checked at a time
MAX_BOUND_BATCH = 4096


@dataclass(frozen=True)
class MotionLaw:
    """A model's law at one exponent n, with the names of the params that its formulas draw on."""

    model: ForceModel
    n: float
    names: tuple[str, ...]
    coordinate: VelocityCoordinate

    @classmethod
    def of(cls, model: ForceModel, n: float, strong: bool) -> MotionLaw:
        """The law of a model, which draws on what the formulas of its motion ask for.

        Where the damping is strong, the coordinate that the law declares for it stands for v.
        """
        asked = {wish for formula in model.motion_formulas for wish in argument_names(formula)}
        own = {*model.quantities, *model.coefficients} - {"K", "m", "v0", "n"}
        return cls(model, n, tuple(sorted(asked & own)), coordinate(model, n) if strong else VelocityCoordinate())

    def call(self, formula: Formula, params: Params, given: dict[str, Array]) -> Array:
        """A formula's value from the params and what else is given; K, m and v0 are 1."""
        known: dict[str, Array | float] = {"K": 1.0, "m": 1.0, "v0": 1.0, "n": self.n, **given}
        known.update(zip(self.names, params, strict=True))
        return call_by_name(formula, known)

    def velocity(self, y: Array, params: Params) -> Array:
        """v from the components."""
        return self.coordinate.velocity(y, self.strength(params))

    def strength(self, params: Params) -> Array:
        """The coefficient that the coordinate of the law asks for."""
        return params[self.names.index(self.coordinate.strength)] if self.coordinate.strength else NO_COEFFICIENT


def approach_problem(law: MotionLaw) -> Problem:
    """From contact to the largest indentation: v falls to zero."""
    return Problem(
        rates=_rates(law, law.model.force, ()),
        event=lambda y, k, params: law.coordinate.stop(y, k),
        unreachable=lambda y, k, params: np.asarray(y[0] > MAX_S),
        floor=ERROR_FLOOR,
        watch=True,
        step_at_unit_error=APPROACH_STEP,
    )


def restitution_problem(law: MotionLaw) -> Problem:
    """From the largest indentation to the release: s, or the force, falls to zero.

    Where the law has an unloading branch, params of the peak, the force there and the residual indentation
    follow the law's own.
    """
    branch = law.model.unloading
    rates = _rates(law, branch or law.model.force, UNLOADING_PARAMS if branch else ())

    def force_event(y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        s, force = y[0], k[4]
        small = RELEASE_STEP * np.clip(np.abs(s), MIN_RELEASE_S, 1.0)
        slope = (rates(y + small * k[:2], params)[4] - force) / small
        return release_event(s, k[0], force, slope)

    def gap_event(y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        return y[0], k[0]

    def turned_back(y: Array, k: Array, params: Params) -> Mask:
        return np.asarray(k[0] >= 0.0)

    def overdamped(y: Array, k: Array, params: Params) -> Mask:
        c, x = params[law.names.index("c")], integer_power(y[0], law.model.coordinate_power)
        return is_overdamped(x, -k[0], c, law.n, force_form(law.model, law.n).drag / law.model.coordinate_power)

    event = force_event if law.model.release == "force" else gap_event
    unreachable = overdamped if may_be_overdamped(law.model) else turned_back
    return Problem(
        rates=rates, event=event, unreachable=unreachable, floor=ERROR_FLOOR, step_at_unit_error=RESTITUTION_STEP
    )


def release_event(s: Array, rate: Array, force: Array, slope: Array) -> tuple[Array, Array]:
    """The sooner of s and the force to fall to zero, and its rate; for arrays and for numbers."""
    # without damping the force vanishes with the indentation, as a power of s, and only touches zero: s then
    # tells the end. A force that vanishes before does so in a small part of the time that s still needs
    sooner = MAX_FORCE_EXPONENT * force * np.abs(rate) < s * np.abs(slope)
    by_force = (sooner & (s > 0.0)) | ((force < s) & (s <= 0.0))
    return choose(by_force, force, s), choose(by_force, slope, rate)


def breakpoints(
    law: MotionLaw, params: Params, start: Array, residual: Array | None = None
) -> tuple[Params, list[Breakpoint]]:
    """The params of a phase, with those of its breakpoints, and the breakpoints of its force.

    Parameters
    ----------
    law : the law
    params : of the phase, each of shape (n,)
    start : its components at the start, shape (2, n)
    residual : permanent indentation, of the restitution phase; None on approach
    """
    model, own = law.model, len(law.names)
    extra = UNLOADING_PARAMS if residual is not None and model.unloading is not None else ()
    # where one force is for both phases, its breakpoints are met again on the way back
    formulas = model.unloading_breakpoints if extra else model.breakpoints
    given = dict(zip(extra, params[own:], strict=False))
    found: list[Breakpoint] = []
    for formula in formulas:
        if not FORCE_ARGUMENTS.keys().isdisjoint(argument_names(formula)):
            found.append(_breakpoint_of_motion(law, formula, extra))
            continue
        x = np.broadcast_to(law.call(formula, params[:own], given), start.shape[1])
        x = x - (0.0 if residual is None else residual)
        at = power(np.where(x > 0.0, x, np.nan), 1.0 / model.coordinate_power)
        found.append(_at(len(params)))
        # one at which the phase begins is none
        params = (*params, np.where(np.abs(at - start[0]) > BREAKPOINT_TOLERANCE * at, at, np.nan))
    return params, found


def _at(place: int) -> Breakpoint:
    """The breakpoint at an s of a column."""
    return lambda y, params: np.asarray(params[place] - y[0])


def _breakpoint_of_motion(law: MotionLaw, formula: Formula, extra: tuple[str, ...]) -> Breakpoint:
    """The breakpoint where a function of the motion changes its sign."""

    def breakpoint(y: Array, params: Params) -> Array:
        given = _formula_arguments(law, {*argument_names(formula)}, extra, y, params)
        return law.call(formula, params[: len(law.names)], given)

    return breakpoint


def restitution_law(law: MotionLaw) -> MotionLaw:
    """The law of the restitution phase: a branch of its own is not of the form that a coordinate is for."""
    return law if law.model.unloading is None else replace(law, coordinate=VelocityCoordinate())


def start_of_approach(law: MotionLaw, params: Params, n: int) -> Array:
    """s = 0, v = 1."""
    return _components_at(law, params, np.zeros(1), 1.0, n)


def start_of_restitution(law: MotionLaw, params: Params, recovered: Array) -> Array:
    """s at the peak above the residual indentation, v = 0."""
    return _components_at(law, params, power(recovered, 1.0 / law.model.coordinate_power), 0.0, recovered.size)


def _components_at(law: MotionLaw, params: Params, s: Array, v: float, n: int) -> Array:
    """The components, shape (2, n), at s, of shape (n,) or (1,), where all have a velocity."""
    y = np.empty((2, n))
    y[0] = s
    y[1] = law.coordinate.of(s, v, law.strength(params))
    return y


def indentation(law: MotionLaw, s: Array) -> Array:
    """x above the residual indentation."""
    return integer_power(s, law.model.coordinate_power)


def force_at_peak(law: MotionLaw, s: Array, params: Params) -> Array:
    """The force of the approach where it ends."""
    at_rest, formula = _components_at(law, params, s, 0.0, s.size), law.model.force
    force = law.call(formula, params, _formula_arguments(law, {*argument_names(formula)}, (), at_rest, params))
    return np.broadcast_to(force, s.shape)


def unloading_state(law: MotionLaw, params: Params, peak: Array, at_peak: Array) -> tuple[Array, Array, Params]:
    """The residual indentation, what of the peak is recovered, and the params of the restitution phase."""
    model, residual = law.model, np.zeros_like(peak)
    formula = model.residual or model.recovered
    if formula is not None:
        own = law.call(formula, params, {"peak": peak, "force_at_peak": at_peak})
        if own.shape not in ((), peak.shape):
            raise ModelError(f"{model.key}: the residual has the shape {own.shape}, wants {peak.shape}")
        residual = residual + own
    recovered = peak - residual
    if model.recovered is not None:
        residual, recovered = recovered, residual
    branch = () if model.unloading is None else (peak, at_peak, residual, recovered)
    return residual, recovered, (*params, *branch)


def _formula_arguments(
    law: MotionLaw, asked: set[str], extra: tuple[str, ...], y: Array, params: Params
) -> dict[str, Array]:
    """The velocity, and the indentation in the forms that a formula asks for."""
    p, s = law.model.coordinate_power, y[0]
    given = {"v": law.velocity(y, params)}
    if extra:
        given.update(zip(extra, params[len(law.names) :], strict=False))
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


def _rates(law: MotionLaw, formula: Formula, extra: tuple[str, ...]) -> Rates:
    p, own = law.model.coordinate_power, len(law.names)
    asked = {*argument_names(formula)}

    def rates(y: Array, params: Params, out: Array | None = None) -> Array:
        s, given = y[0], _formula_arguments(law, asked, extra, y, params)
        v = given["v"]
        force = law.call(formula, params[:own], given)
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
        law.coordinate.rates(out, y, weight, given.get("elastic", weight), law.strength(params))
        return out

    return rates


# ---- damping so strong that the balls part with no speed, or never


def may_be_overdamped(model: ForceModel) -> bool:
    """Whether the balls may part with no speed, by a damping that pulls until the gap closes."""
    return model.velocity_coordinate == "force" and model.release == "gap" and model.unloading is None


def is_overdamped(x: Array, speed: Array, c: Array, n: float, q: float) -> Mask:
    """Which balls are sure to part with no speed, where F = xⁿ + c x^q v.

    Once speed ≤ b(x) = c x^(q+1)/(2(q + 1)) it stays so where x^(n−2q−1) ≤ c²/(4(q + 1)), for it changes at the
    rate xⁿ − c x^q speed. With n ≥ 2q + 1 that is for ever, and x stays above zero. Else it is as far as the x*
    that makes it an equation; beyond it no more than the energy is left, speed² ≤ b(x*)² + 2 x*^(n+1)/(n + 1).
    """
    bound, rest = c / (2.0 * (q + 1.0)), c * c / (4.0 * (q + 1.0))
    order = n - 2.0 * q - 1.0
    slow = speed <= bound * power(x, q + 1.0)
    if order == 0.0:
        return np.asarray(speed <= overdamped_speed(c, n, q) * power(x, q + 1.0))
    if order > 0.0:
        return np.asarray(slow & (power(x, order) <= CRITICAL_MARGIN * rest))
    far = power(rest, 1.0 / order)
    left = np.square(bound * power(far, q + 1.0)) + 2.0 / (n + 1.0) * power(far, n + 1.0)
    return np.asarray(slow & (x >= far) & (left <= ZERO_SPEED * ZERO_SPEED))


def overdamped_speed(c: Array, n: float, q: float) -> Array:
    """What a speed of balls that part with none is below, over x^(q+1), where n = 2q + 1; -inf where none is."""
    return np.where(CRITICAL_MARGIN * c * c >= 4.0 * (q + 1.0), c / (2.0 * (q + 1.0)), -np.inf)


def never_separates(rates: Rates, params: Params, peak: Array, coordinate_power: int) -> Mask:
    """Which balls at rest at their peak never part, by any law whose contact ends at zero indentation.

    If F(x, -B x^k) <= -k B^2 x^(2k-1) for all x from 0 to the peak, with some B and some k >= 1, the speed w of
    the rebound cannot grow beyond B x^k: at w = B x^k it falls faster than that bound does. Then
    dx/dt >= -B x^k, and x stays above zero for ever. Where no such bound is found nothing is claimed.

    Parameters
    ----------
    rates : of the restitution phase in s and v
    params : what the rates need, each of shape (n,)
    peak : indentation at the start of the phase, above the permanent one, shape (n,)
    coordinate_power : p of x = s^p
    """
    never = np.zeros(peak.size, bool)
    for first in range(0, peak.size, MAX_BOUND_BATCH):
        part = slice(first, first + MAX_BOUND_BATCH)
        some = tuple(column[part] for column in params)
        never[part] = _never_separates(rates, some, peak[part], coordinate_power)
    return never


def _never_separates(rates: Rates, params: Params, peak: Array, coordinate_power: int) -> Mask:
    never = np.zeros(peak.size, bool)
    x = (peak[:, None] * BOUND_INDENTATIONS).reshape(-1)
    s = power(x, 1.0 / coordinate_power)
    repeated = tuple(np.repeat(column, BOUND_INDENTATIONS.size) for column in params)
    for k in BOUND_EXPONENTS:
        for rate in BOUND_RATES:
            bound = np.repeat(rate * power(peak, 1.0 - k), BOUND_INDENTATIONS.size)
            try:
                force = rates(np.array([s, -bound * power(x, k)]), repeated)[4]
            except ModelError:
                # a formula need not know such a state
                return never
            falls = k * bound * bound * power(x, 2.0 * k - 1.0)
            holds = force + falls <= (CRITICAL_MARGIN - 1.0) * falls
            never |= holds.reshape(peak.size, -1).all(axis=1)
        if never.all():
            break
    return never
