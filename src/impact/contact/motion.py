"""The right-hand side: the motion of a contact in its own units, as a problem for the integrator.

A phase is integrated in a smooth coordinate, x = xᵣ + sᵖ with dt = p sᵖ⁻¹ dσ: near contact and separation x^(3/2)
has no third derivative, and an integrator of order five would lose its order there. With it

    ds/dσ = v,  dv/dσ = −p sᵖ⁻¹ F,  dt/dσ = p sᵖ⁻¹,  dW/dσ = p sᵖ⁻¹ F v,

where W is the work done against the force. Where the damping is strong, another coordinate may replace v, see
`velocity_coordinates`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from ..array_types import Array, Mask
from ..errors import ModelError
from ..ode.events import choose
from ..ode.problem import Params, Problem
from .formula_calls import Formula, argument_names, call_by_name
from .model import FORCE_ARGUMENTS, UNLOADING_ARGUMENTS, ForceModel
from .piecewise import BREAKPOINT_TOLERANCE, Breakpoint
from .powers import integer_power, power
from .velocity_coordinates import VelocityCoordinate, coordinate, force_form, signed_power

# scaled s beyond which no force has stopped the balls: the approach cannot end any more
MAX_S = 1e8
# the error of a component is relative to the component itself: what a strong damping leaves of the velocity is
# small compared with v0, but still decides where the force vanishes; near s = 0 the motion is so smooth that its
# relative error is small, too
ERROR_FLOOR = (1e-200, 1e-200)
# steps whose error is of the order of 1, from which the first step is chosen: on approach there is no force yet,
# at the peak it is largest and the speed is zero
APPROACH_STEP, RESTITUTION_STEP = 2.7, 0.87
# step of the difference quotient for the rate of the force at the release, relative to s; a step may end at s = 0
# itself, so that s is taken to be at least the second number
RELEASE_STEP, MIN_RELEASE_S = 1e-7, 1e-12
# the force of a law without damping is assumed to vanish as a power of s with a smaller exponent
MAX_FORCE_EXPONENT = 16.0
# strength of a coordinate without a coefficient
NO_COEFFICIENT = np.empty(0)
# a breakpoint above the end of the phase by less than this part of its indentation is at that end
BREAKPOINT_ROUNDING = 1e-14
# factor on the square of a damping that is compared with its critical value: rounding may have made it smaller
CRITICAL_MARGIN = 1.0 + 1e-12
# a speed relative to v0 that counts as zero
ZERO_SPEED = 1e-10
# bounds B x^k of a speed that are tried: the exponents k, and B peak^(k-1) in units of v0/length; and the
# indentations, relative to the peak, at which each has to hold
BOUND_EXPONENTS = (1.0, 1.25, 1.5, 2.0)
BOUND_RATES = np.geomspace(1e-4, 1e4, 65)
BOUND_INDENTATIONS = 10.0 ** -np.linspace(0.0, 40.0, 81)
# rows of rates that are written to
Rows = Array | Sequence[Any]
# (rows to write, components, params)
WriteRates = Callable[[Rows, Array, Params], None]
# (components, params) -> force
Force = Callable[[Array, Params], Array]
# trajectories checked together in `never_separates`
MAX_BOUND_BATCH = 4096


@dataclass(frozen=True)
class MotionLaw:
    """A model at one exponent n, with the names of the params that the formulas of its motion use."""

    model: ForceModel
    n: float
    names: tuple[str, ...]
    coordinate: VelocityCoordinate

    @classmethod
    def of(cls, model: ForceModel, n: float, strong: bool) -> MotionLaw:
        """Make the law at an exponent n; if `strong`, with the coordinate that it declares for strong damping."""
        arguments = {name for formula in model.motion_formulas for name in argument_names(formula)}
        param_names = {*model.quantities, *model.coefficients} - {"K", "m", "v0", "n"}
        names = tuple(sorted(arguments & param_names))
        return cls(model, n, names, coordinate(model, n) if strong else VelocityCoordinate())

    def call(self, formula: Formula, params: Params, arguments: dict[str, Array]) -> Array:
        """Compute the value of a formula from the params and further arguments by name; K, m and v0 are 1."""
        values: dict[str, Array | float] = {"K": 1.0, "m": 1.0, "v0": 1.0, "n": self.n, **arguments}
        values.update(zip(self.names, params, strict=True))
        return call_by_name(formula, values)

    def velocity(self, y: Array, params: Params) -> Array:
        """v, shape (n,), from the components y, shape (2, n)."""
        return self.coordinate.velocity(y, self.strength(params))

    def strength(self, params: Params) -> Array:
        """Compute the coefficient that measures the damping for the coordinate of the law, shape (n,) or empty."""
        return params[self.names.index(self.coordinate.strength)] if self.coordinate.strength else NO_COEFFICIENT


def approach_problem(law: MotionLaw) -> Problem:
    """Pose the approach: from contact to the largest indentation, where v falls to zero."""
    return Problem(
        rates=partial(_rates, rates_writer(law)),
        event=lambda y, k, params: law.coordinate.stop(y, k),
        unreachable=lambda y, k, params: np.asarray(y[0] > MAX_S),
        floor=ERROR_FLOOR,
        watch=True,
        step_at_unit_error=APPROACH_STEP,
    )


def restitution_problem(law: MotionLaw) -> Problem:
    """Pose the restitution phase, from the largest indentation until s or the force falls to zero."""
    force_at = force_of(law, unloads=True)

    def force_event(y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        s, force = y[0], k[-1]
        small = RELEASE_STEP * np.clip(np.abs(s), MIN_RELEASE_S, 1.0)
        slope = (force_at(y + small * k[:2], params) - force) / small
        return release_event(s, k[0], force, slope)

    def overdamped(y: Array, k: Array, params: Params) -> Mask:
        c, x = params[law.names.index("c")], integer_power(y[0], law.model.coordinate_power)
        return is_overdamped(x, -k[0], c, law.n, force_form(law.model, law.n).drag / law.model.coordinate_power)

    ends_at_gap, may_turn_back = law.model.release == "gap", not may_be_overdamped(law.model)
    return Problem(
        rates=partial(_rates, rates_writer(law, unloads=True)),
        event=(lambda y, k, params: (y[0], k[0])) if ends_at_gap else force_event,
        unreachable=(lambda y, k, params: np.asarray(k[0] >= 0.0)) if may_turn_back else overdamped,
        floor=ERROR_FLOOR,
        step_at_unit_error=RESTITUTION_STEP,
    )


def release_event(s: Array, rate: Array, force: Array, slope: Array) -> tuple[Array, Array]:
    """Choose the one of s and the force that falls to zero first, and its rate; for arrays and for numbers."""
    # without damping the force vanishes with the indentation, as a power of s, without a change of sign: the
    # end is then where s is zero. A force that vanishes earlier does so in a small part of the time to s = 0
    earlier = MAX_FORCE_EXPONENT * force * np.abs(rate) < s * np.abs(slope)
    by_force = (earlier & (s > 0.0)) | ((force < s) & (s <= 0.0))
    return choose(by_force, force, s), choose(by_force, slope, rate)


def breakpoints(
    law: MotionLaw, params: Params, start: Array, residual: Array | None = None
) -> tuple[Params, list[Breakpoint]]:
    """Extend the params of a phase, each of shape (n,), by those of its breakpoints; returns also the breakpoints.

    `start` are components of shape (2, n); `residual` is the permanent indentation, shape (n,), None on approach.
    """
    model, n_law_params = law.model, len(law.names)
    extra = UNLOADING_ARGUMENTS if residual is not None and model.unloading is not None else ()
    # where both phases have the same force, its breakpoints are crossed again on restitution
    formulas = model.unloading_breakpoints if extra else model.breakpoints
    unloading_values = dict(zip(extra, params[n_law_params:], strict=False))
    phase_breakpoints: list[Breakpoint] = []
    for formula in formulas:
        if not set(FORCE_ARGUMENTS).isdisjoint(argument_names(formula)):
            phase_breakpoints.append(partial(_value_of_motion, law, formula, extra))
            continue
        x = np.broadcast_to(law.call(formula, params[:n_law_params], unloading_values), start.shape[1])
        # one at the residual indentation, where s = 0, is known up to rounding
        above = x - (0.0 if residual is None else residual)
        s = power(np.where(above > BREAKPOINT_ROUNDING * x, above, np.nan), 1.0 / model.coordinate_power)
        phase_breakpoints.append(_breakpoint_at_column(len(params)))
        # a breakpoint at the start of the phase is not crossed
        params = (*params, np.where(np.abs(s - start[0]) > BREAKPOINT_TOLERANCE * s, s, np.nan))
    return params, phase_breakpoints


def _breakpoint_at_column(column: int) -> Breakpoint:
    """Make the breakpoint at the values of s that are a column of the params."""
    return lambda y, params: np.asarray(params[column] - y[0])


def restitution_law(law: MotionLaw) -> MotionLaw:
    """Make the law of the restitution phase, in v with an unloading branch: coordinates are for `force`."""
    return law if law.model.unloading is None else replace(law, coordinate=VelocityCoordinate())


def components_at(law: MotionLaw, params: Params, s: Array, v: Array | float) -> Array:
    """Compute the components, shape (2, n), at s of shape (n,) and a velocity, that all may have."""
    y = np.empty((2, s.size))
    y[0] = s
    y[1] = law.coordinate.of(s, v, law.strength(params))
    return y


def indentation(law: MotionLaw, s: Array) -> Array:
    """Compute the indentation above the residual one, from s; shape (n,)."""
    return integer_power(s, law.model.coordinate_power)


def unloading_arguments(law: MotionLaw, s: Array, params: Params) -> tuple[Array, Array, Array, Array]:
    """Compute UNLOADING_ARGUMENTS: those of the end of the approach, at s of shape (n,) and v = 0."""
    model, peak, at_rest = law.model, indentation(law, s), components_at(law, params, s, 0.0)
    force = np.broadcast_to(_value_of_motion(law, model.force, (), at_rest, params), s.shape)
    residual, formula = np.zeros_like(peak), model.residual or model.recovered
    if formula is not None:
        value = law.call(formula, params, {"peak": peak, "force_at_peak": force})
        if value.shape not in ((), peak.shape):
            raise ModelError(f"{model.key}: the residual has shape {value.shape}, expected {peak.shape}")
        residual = residual + value
    recovered = peak - residual
    if model.recovered is not None:
        residual, recovered = recovered, residual
    return peak, force, residual, recovered


def _value_of_motion(law: MotionLaw, formula: Formula, extra: tuple[str, ...], y: Array, params: Params) -> Array:
    """Compute the value of a formula at components and params."""
    arguments = _formula_arguments(law, {*argument_names(formula)}, extra, y, params)
    return law.call(formula, params[: len(law.names)], arguments)


def _formula_arguments(
    law: MotionLaw, names: set[str], extra: tuple[str, ...], y: Array, params: Params
) -> dict[str, Array]:
    """Compute the arguments of a formula that change in the motion: v, and what `names` has of x and K δⁿ."""
    p, s = law.model.coordinate_power, y[0]
    arguments = {"v": law.velocity(y, params)}
    if extra:
        arguments.update(zip(extra, params[len(law.names) :], strict=False))
        stretch = arguments["stretch"] = integer_power(s, p)
        x = arguments["x"] = stretch + arguments["residual"]
        if "elastic" in names:
            arguments["elastic"] = power(x, law.n)
    else:
        if "x" in names:
            arguments["x"] = integer_power(s, p)
        if "elastic" in names:
            arguments["elastic"] = signed_power(s, p * law.n)
    return arguments


def _rates(write: WriteRates, y: Array, params: Params, out: Array | None = None) -> Array:
    """Compute the rates of a phase, see `Problem`, by a function of `rates_writer`."""
    out = np.empty((5, y.shape[1])) if out is None else out
    write(out, y, params)
    return out


def rates_writer(law: MotionLaw, *, unloads: bool = False) -> WriteRates:
    """Make the function that writes the rates of a phase to rows: those of s, v or its substitute, t, W, and F.

    The last rows may be missing, and that of W may be None.
    """
    p, evaluate = law.model.coordinate_power, _formula_of_motion(law, unloads)
    # as an array: NumPy converts a number on every call
    power_factor = np.array(float(p))

    def write(rows: Rows, y: Array, params: Params) -> None:
        v, elastic, force = evaluate(y, params)
        n_rows, strength = len(rows), law.strength(params)
        weight = np.multiply(integer_power(y[0], p - 1), power_factor, rows[2] if n_rows > 2 else None)
        np.copyto(rows[0], v)
        second = np.multiply(weight, force, rows[1])
        if n_rows > 3 and rows[3] is not None:
            np.multiply(second, v, rows[3])
        force = law.coordinate.force(y, force, strength)
        if n_rows > 4:
            np.copyto(rows[4], force)
        law.coordinate.rate(second, y, v, weight, force, weight if elastic is None else elastic, strength)

    return write


def force_of(law: MotionLaw, *, unloads: bool = False) -> Force:
    """Make the function of components and params that computes the force of a phase alone."""
    evaluate = _formula_of_motion(law, unloads)
    return lambda y, params: law.coordinate.force(y, evaluate(y, params)[2], law.strength(params))


def _formula_of_motion(
    law: MotionLaw, unloads: bool
) -> Callable[[Array, Params], tuple[Array, Array | None, Array]]:
    """Make the function of components and params that computes v, K δⁿ if the formula uses it, and F."""
    branch = law.model.unloading if unloads else None
    formula, extra = branch or law.model.force, UNLOADING_ARGUMENTS if branch else ()
    names, n_law_params = {*argument_names(formula)}, len(law.names)

    def evaluate(y: Array, params: Params) -> tuple[Array, Array | None, Array]:
        arguments = _formula_arguments(law, names, extra, y, params)
        force = law.call(formula, params[:n_law_params], arguments)
        if force.shape != y[0].shape and force.shape != ():
            raise ModelError(f"{law.model.key}: the force has shape {force.shape}, expected {y[0].shape}")
        return arguments["v"], arguments.get("elastic"), force

    return evaluate


# ---- damping so strong that the balls separate at zero speed, or never


def may_be_overdamped(model: ForceModel) -> bool:
    """Return whether the damping of a law, pulling until zero indentation, may leave no rebound speed."""
    return model.velocity_coordinate == "force" and model.release == "gap" and model.unloading is None


def is_overdamped(x: Array, speed: Array, c: Array, n: float, q: float) -> Mask:
    """Find which balls are certain to separate at zero speed, where F = xⁿ + c x^q v; shape (n,).

    Once speed ≤ b(x) = c x^(q+1)/(2(q + 1)) it stays so where x^(n−2q−1) ≤ c²/(4(q + 1)), for it changes at the
    rate xⁿ − c x^q speed. With n ≥ 2q + 1 that holds for ever, and x stays above zero. Otherwise it holds down to
    the x* for which the two sides are equal; below x* the energy limits speed² ≤ b(x*)² + 2 x*^(n+1)/(n + 1).
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
    """Bound, over x^(q+1), of the speed of balls that separate at zero speed, n = 2q + 1; -inf where none do."""
    return np.where(CRITICAL_MARGIN * c * c >= 4.0 * (q + 1.0), c / (2.0 * (q + 1.0)), -np.inf)


def never_separates(force_at: Force, params: Params, peak: Array, coordinate_power: int) -> Mask:
    """Find which balls at rest at their peak never separate, by any law whose contact ends at zero indentation.

    If F(x, -B x^k) <= -k B^2 x^(2k-1) for all x = s^p from 0 to the peak, with some B and some k >= 1, the speed
    w of the rebound cannot grow beyond B x^k: at w = B x^k it falls faster than that bound does. Then
    dx/dt >= -B x^k, and x stays above zero for ever. Where no such bound is found, the answer is False. `peak`
    is above the permanent indentation, and has the shape of each of the params, (n,).
    """
    if peak.size > MAX_BOUND_BATCH:
        halves = (slice(0, peak.size // 2), slice(peak.size // 2, None))
        batches = [(tuple(column[half] for column in params), peak[half]) for half in halves]
        return np.concatenate([never_separates(force_at, *batch, coordinate_power) for batch in batches])
    never = np.zeros(peak.size, bool)
    x = (peak[:, None] * BOUND_INDENTATIONS).reshape(-1)
    s = power(x, 1.0 / coordinate_power)
    repeated_params = tuple(np.repeat(column, BOUND_INDENTATIONS.size) for column in params)
    for k in BOUND_EXPONENTS:
        for rate in BOUND_RATES:
            bound = np.repeat(rate * power(peak, 1.0 - k), BOUND_INDENTATIONS.size)
            try:
                force = force_at(np.array([s, -bound * power(x, k)]), repeated_params)
            except ModelError:
                # a formula may be undefined in such a state
                return never
            falls = k * bound * bound * power(x, 2.0 * k - 1.0)
            holds = force + falls <= (CRITICAL_MARGIN - 1.0) * falls
            never |= holds.reshape(peak.size, -1).all(axis=1)
        if never.all():
            break
    return never
