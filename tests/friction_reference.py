"""An independent reference for the slip under friction: one trajectory at a time, slowly, by another method.

Nothing here is shared with `impact.contact.tangential`. Normal motion, slip and spring are integrated together by
scipy's DOP853 in short steps, inside of which the margin of the friction limit is sampled; each switch is found to
rounding by integrating up to it. `kick_drift` is a second check: the time steps of a code, which know no events.

The contact's own units apply, K = m = v0 = 1; mu, m_t and g0 are not scaled away, so that the groups of the fast
solver are tested, too. The normal motion is in s with x = residual + s^4 and dt = 4 s^3 dσ, in which half and
quarter powers of x are smooth; the spring is in z with f_e = k^r z.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from impact.contact.model import ForceModel

# power of the smooth coordinate
P = 4
RTOL, ATOL = 1e-13, 1e-15
# steps between two events, of which there are a few hundred; where modes alternate there may be no end to them
MAX_STEPS = 2000
# largest step in σ, and positions inside a step at which events are sampled
MAX_STEP, SAMPLES = 0.02, np.linspace(0.0, 1.0, 8)[1:]
# a violation of the friction limit that is no rounding, relative to mu
LIMIT_TOLERANCE = 1e-12
# a state so close to x = 0 that its energy is that of the limit
TINY_S = 1e-8
# positions between samples at which a margin is looked for that is positive only shortly
NEAR_START = 10.0 ** np.arange(-9.0, 0.0)
STICK, FREE, THIRD = 0, 9, 2

Force = Callable[[float, float], float]


@dataclass(frozen=True)
class NormalLaw:
    """A normal law: the force of (x, v) on approach, and of (x, v, peak, force_at_peak) on restitution.

    `leading` are the coefficients and powers of x of the force at the first touch, where v = 1; `damping` is
    (C, q) of the form x^n + C x^q v. `residual` is a function of the peak and the force there; `breakpoints` are
    indentations at which the formula of the approach changes.
    """

    force: Force
    leading: tuple[tuple[float, float], ...]
    damping: tuple[float, float] | None = None
    release: str = "gap"
    unloading: Callable[..., float] | None = None
    residual: Callable[[float, float], float] | None = None
    breakpoints: tuple[float, ...] = ()
    unloading_breakpoints: Callable[[float, float], tuple[float, ...]] | None = None


def spring_dashpot(n: float, c: float = 0.0, q: float = 0.0, release: str = "gap") -> NormalLaw:
    """F = x^n + c x^q v."""
    if not c:
        return NormalLaw(lambda x, v: x**n, ((1.0, n),), (0.0, 0.0), release)
    return NormalLaw(lambda x, v: x**n + c * x**q * v, ((1.0, n), (c, q)), (c, q), release)


def bilinear(e: float) -> NormalLaw:
    """F = x, then (x - xp)/e^2."""
    return NormalLaw(
        lambda x, v: x,
        ((1.0, 1.0),),
        unloading=lambda x, v, peak, force: (x - peak * (1.0 - e * e)) / (e * e),
        residual=lambda peak, force: peak * (1.0 - e * e),
    )


def normal_law(model: ForceModel, n: float, values: Mapping[str, float]) -> NormalLaw:
    """The law of the catalogue at dimensionless values; its formulas are called, its motion is integrated here."""
    known: dict[str, Any] = {**values, "K": 1.0, "m": 1.0, "v0": 1.0, "n": n}

    def call(formula: Callable[..., Any], **arguments: float) -> float:
        code = formula.__code__
        names = code.co_varnames[: code.co_argcount - len(formula.__defaults__ or ())]
        pool = {**known, **arguments}
        return float(formula(*(np.float64(pool[name]) for name in names)))

    for name, formula in model.coefficients.items():
        known[name] = call(formula)
    if model.key == "hertz":
        return spring_dashpot(n)
    if model.velocity_coordinate == "force" and model.unloading is None:
        return spring_dashpot(n, known["c"], known["q"], model.release)
    if model.velocity_coordinate == "log" and model.unloading is None:
        chi = known["chi"]
        return spring_dashpot(n, chi, n, model.release)

    def force(x: float, v: float) -> float:
        return call(model.force, x=x, v=v, elastic=x**n)

    def residual(peak: float, at_peak: float) -> float:
        if model.recovered is not None:
            return peak - call(model.recovered, peak=peak, force_at_peak=at_peak)
        return call(model.residual, peak=peak, force_at_peak=at_peak) if model.residual else 0.0

    def unloading(x: float, v: float, peak: float, at_peak: float) -> float:
        left = residual(peak, at_peak)
        return call(
            model.unloading,
            x=x,
            v=v,
            elastic=x**n,
            peak=peak,
            force_at_peak=at_peak,
            residual=left,
            recovered=peak - left,
            stretch=x - left,
        )

    def unloading_breakpoints(peak: float, at_peak: float) -> tuple[float, ...]:
        left = residual(peak, at_peak)
        arguments = {"peak": peak, "force_at_peak": at_peak, "residual": left}
        return tuple(call(formula, **arguments) for formula in model.unloading_breakpoints)

    touch = 1e-10
    return NormalLaw(
        force,
        ((force(touch, 1.0) / touch**n, n),),
        release=model.release,
        unloading=unloading if model.unloading else None,
        residual=residual if model.residual or model.recovered else None,
        breakpoints=tuple(call(formula) for formula in model.breakpoints),
        unloading_breakpoints=unloading_breakpoints if model.unloading_breakpoints else None,
    )


@dataclass(frozen=True)
class Friction:
    """A friction law with its numbers in the contact's units; k = k_t x^kp, c = c_t x^q.

    `coefficient` is mu(abs g) of the kind "regularized".
    """

    kind: str
    mu: float
    m_t: float = 2.0 / 7.0
    k_t: float = 0.0
    kp: float = 0.0
    memory: tuple[float, float] = (0.0, 0.0)
    c_t: float = 0.0
    q: float = 0.0
    cap: str = "total"
    positive: bool = False
    coefficient: Callable[[float], float] | None = None


@dataclass
class Outcome:
    """Slip, works and the course of one trajectory; the works are NaN where each diverges at x = 0."""

    g: float = math.nan
    e_out: float = math.nan
    sliding_impulse: float = 0.0
    slip_work: float = 0.0
    slip_and_memory: float = 0.0
    damping_work: float = 0.0
    memory_work: float = 0.0
    elastic_left: float = 0.0
    regime: int = 0
    slip_changes: int = 0
    slow: bool = False
    modes: list[tuple[float, int]] = field(default_factory=list)


# components of the state: s, v, g, z, and the integrals of f_e g, (f - f_e) g, memory work and N
S, V, G, Z, SPRING_WORK, DAMPING_WORK, MEMORY_WORK, IMPULSE = range(8)


def directional(
    function: Callable[[float, float], float], s: float, v: float, ds: float, dv: float, ends: tuple[float, float]
) -> float:
    """Derivative of a function of (s, v) along (ds, dv) by differences of fourth order, within the ends of s."""
    h = 1e-3 * min(1.0, abs(s) / max(abs(ds), 1e-3))
    if ends[0] <= s - 2 * h * abs(ds) and s + 2 * h * abs(ds) <= ends[1]:
        one = function(s + h * ds, v + h * dv) - function(s - h * ds, v - h * dv)
        two = function(s + 2 * h * ds, v + 2 * h * dv) - function(s - 2 * h * ds, v - 2 * h * dv)
        return (8.0 * one - two) / (12.0 * h)
    h *= -1.0 if (s - ends[0] < ends[1] - s) == (ds < 0.0) else 1.0
    weights = (-25.0, 48.0, -36.0, 16.0, -3.0)
    return math.fsum(w * function(s + k * h * ds, v + k * h * dv) for k, w in enumerate(weights)) / (12.0 * h)


class Phase:
    """Approach or restitution of one trajectory: forces, rates and events in each mode."""

    def __init__(self, friction: Friction, force: Force, residual: float, r: float) -> None:
        self.friction, self.of_x, self.residual, self.r = friction, force, residual, r
        # -1 after F = 0, so that the limit is smooth on both sides of it
        self.side = 1.0
        self.counts_memory = True
        # s between breakpoints of the force, beyond which no difference quotient reaches
        self.ends = (0.0, math.inf)

    def x(self, s: float) -> float:
        return self.residual + s**P

    def force(self, s: float, v: float) -> float:
        return self.of_x(self.x(s), v)

    def limit(self, s: float, v: float) -> float:
        """mu N, continued beyond F = 0."""
        if self.side < 0.0 and self.friction.positive:
            return 0.0
        return self.friction.mu * self.side * self.force(s, v)

    def weight(self, s: float) -> float:
        """dt/dσ."""
        return P * s ** (P - 1)

    def growth(self, s: float) -> float:
        """d(ln x)/dσ over v."""
        return P / s if self.residual == 0.0 else self.weight(s) / self.x(s)

    def stiffness(self, s: float) -> float:
        return self.friction.k_t * self.x(s) ** self.friction.kp if self.friction.kp else self.friction.k_t

    def damping(self, s: float) -> float:
        return self.friction.c_t * self.x(s) ** self.friction.q if self.friction.q else self.friction.c_t

    def limit_rate(self, s: float, v: float) -> float:
        """d(mu N)/dσ."""
        return directional(self.limit, s, v, v, -self.weight(s) * self.force(s, v), self.ends)

    def steady_slip(self, sign: int, s: float, v: float) -> float:
        """The slip speed at which the spring's force grows as its limit does."""
        f = self.friction
        pull = self.limit_rate(s, v) - self.r * f.kp * self.growth(s) * v * self.limit(s, v)
        return sign * pull / (self.weight(s) * self.stiffness(s))

    def third_force(self, sign: int, s: float, v: float) -> float:
        """f in the third regime."""
        rate = directional(
            lambda s, v: self.steady_slip(sign, s, v), s, v, v, -self.weight(s) * self.force(s, v), self.ends
        )
        return -self.friction.m_t * rate / self.weight(s)

    def forces(self, y: np.ndarray, mode: int) -> tuple[float, float, float]:
        """f, f_e and the slip speed."""
        f, (s, v, g, z) = self.friction, y[:4]
        limit = self.limit(s, v)
        if f.kind == "coulomb":
            return 0.0, 0.0, g
        if f.kind == "regularized":
            return math.copysign(f.coefficient(abs(g)) * limit / f.mu, g), 0.0, g
        drag = self.damping(s) * g
        if f.kind == "dashpot":
            return math.copysign(min(abs(drag), limit), g), 0.0, g
        if mode == STICK:
            spring = self.stiffness(s) ** self.r * z if self.r else z
            return spring + drag, spring, g
        if mode == FREE:
            return 0.0, -drag if f.cap == "total" else 0.0, g
        sign = 1 if mode > 0 else -1
        if abs(mode) == THIRD:
            return self.third_force(sign, s, v), sign * limit, self.steady_slip(sign, s, v)
        return sign * limit, sign * limit - (drag if f.cap == "total" else 0.0), g

    def rates(self, y: np.ndarray, mode: int) -> list[float]:
        f, (s, v) = self.friction, y[:2]
        w, force = self.weight(s), self.force(s, v)
        friction, spring, g = self.forces(y, mode)
        loading = memory = 0.0
        if f.kind == "spring":
            if mode == STICK:
                # w k^(1 - r), which has no pole at s = 0
                loading = w * self.stiffness(s) ** (1.0 - self.r) * g if s > 0.0 else 0.0
            if f.kp and s > 0.0 and self.counts_memory:
                memory = (0.5 - self.r) * spring * spring * f.kp * self.growth(s) * v / self.stiffness(s)
        return [
            v,
            -w * force,
            0.0 if abs(mode) == THIRD else -w * friction / f.m_t,
            loading,
            w * spring * g,
            w * (friction - spring) * g,
            memory,
            w * (0.0 if self.side < 0.0 and f.positive else self.side * force),
        ]

    def trial_rate(self, y: np.ndarray, friction: float, spring: float, g: float) -> float:
        """d/dσ of what is limited, as if it stuck."""
        f, (s, v) = self.friction, y[:2]
        rate = self.weight(s) * self.stiffness(s) * g
        rate += self.r * spring * f.kp * self.growth(s) * v if f.kp else 0.0
        if f.cap == "total" and f.c_t:
            c = self.damping(s)
            rate += f.q * self.growth(s) * v * c * g - c * self.weight(s) * friction / f.m_t
        return rate

    def slip_margin(self, y: np.ndarray, sign: int) -> float:
        """Positive while a slip goes on."""
        friction, spring, g = self.forces(y, sign)
        return sign * self.trial_rate(y, friction, spring, g) - self.limit_rate(y[S], y[V])

    def stick_margin(self, y: np.ndarray) -> float:
        """Distance of the force from its limit."""
        friction, spring, _ = self.forces(y, STICK)
        return self.limit(y[S], y[V]) - abs(friction if self.friction.cap == "total" else spring)

    def third_margins(self, y: np.ndarray, sign: int) -> tuple[float, float]:
        """Both positive in the third regime; the first turns to a slip, the second to a stick."""
        s, v = y[:2]
        limit, force = self.limit(s, v), sign * self.third_force(sign, s, v)
        drag = sign * self.damping(s) * self.steady_slip(sign, s, v)
        return limit - force, force - (limit + drag)

    def energy(self, s: float, spring: float) -> float:
        k = self.stiffness(s)
        return spring * spring / (2.0 * k) if k else 0.0


def start_mode(normal: NormalLaw, f: Friction, g0: float) -> tuple[int, bool]:
    """The mode at x = 0, by the leading powers of x; and whether it is the slow limit."""
    r = f.memory[0]
    stick = [(f.k_t * g0 / (f.kp * (1.0 - r) + 1.0), f.kp + 1.0)]
    if f.cap == "total":
        stick.append((f.c_t * g0, f.q))
    limit = [(f.mu * coefficient, power) for coefficient, power in normal.leading]
    if lowest(limit + [(-a, p) for a, p in stick]) >= 0.0:
        return STICK, False
    c = f.c_t if f.cap == "total" else 0.0
    strength, exponent = normal.damping or (0.0, 0.0)

    def goes_on(sign: int) -> bool:
        terms = [(sign * f.k_t * g0, f.kp + 1.0), (sign * c * g0 * (f.q - r * f.kp), f.q)]
        for a, p in limit:
            terms.append((a * (r * f.kp - p), p))
            # of c g' and of the change of v in the limit
            terms.append((-c * a / f.m_t, f.q + p + 1.0))
            terms.append((strength * a, exponent + p + 1.0))
        return lowest(terms) >= 0.0

    if goes_on(1):
        return 1, False
    if c and f.q < r * f.kp:
        return (-1 if goes_on(-1) else 1), True
    return STICK, False


def lowest(terms: list[tuple[float, float]]) -> float:
    """The coefficient of the lowest power that does not vanish."""
    for power in sorted({round(p, 9) for _, p in terms}):
        same = [a for a, p in terms if abs(p - power) < 1e-8]
        if abs(math.fsum(same)) > 1e-13 * max(map(abs, same)):
            return math.fsum(same)
    return 0.0


class Trajectory:
    """The course of one impact, phase by phase, mode by mode."""

    def __init__(self, normal: NormalLaw, friction: Friction, g0: float) -> None:
        self.normal, self.friction = normal, friction
        self.outcome = Outcome()
        self.mode = STICK
        self.y = np.array([0.0, 1.0, g0, 0.0, 0.0, 0.0, 0.0, 0.0])
        self.phase = Phase(friction, normal.force, 0.0, friction.memory[0])
        self.is_back = False
        self.points: list[float] = []
        self.pulls = False
        self.slip_start: tuple[float, float, float] | None = None
        self.begins_at_limit = False

    # -- modes

    def energies(self, spring: float) -> tuple[float, float, float]:
        return self.phase.energy(self.y[S], spring), self.y[SPRING_WORK], self.y[MEMORY_WORK]

    def enter(self, mode: int, spring: float, counts: bool = True) -> None:
        """Go on in a mode; `spring` is f_e there."""
        if counts and mode != self.mode:
            self.outcome.slip_changes += (mode == STICK) != (self.mode == STICK)
        self.mode = mode
        self.outcome.modes.append((float(self.y[S]), mode))
        if mode == STICK:
            k = self.phase.stiffness(self.y[S])
            self.y[Z] = spring / k**self.phase.r if spring else 0.0
        elif self.slip_start is None:
            self.slip_start = self.energies(spring)

    def leave(self, spring: float) -> None:
        """End the mode; `spring` is f_e at its end."""
        if self.slip_start is not None:
            now = self.energies(spring)
            change, spring_work, memory = (b - a for a, b in zip(self.slip_start, now, strict=True))
            self.outcome.slip_work += spring_work - change - memory
            self.slip_start = None

    def jump(self, before: float, after: float) -> None:
        """f_e changes at once."""
        self.outcome.slip_work += self.phase.energy(self.y[S], before) - self.phase.energy(self.y[S], after)

    def begin(self) -> None:
        f, y = self.friction, self.y
        if f.kind != "spring":
            self.mode = 1
            return
        mode, self.outcome.slow = start_mode(self.normal, f, y[G])
        y[S] = TINY_S
        limit = self.phase.limit(TINY_S, 1.0)
        total = self.phase.damping(TINY_S) * y[G] if f.cap == "total" else 0.0
        spring = 0.0
        self.begins_at_limit = mode != STICK or total > limit * (1.0 + 1e-9)
        if self.begins_at_limit:
            spring = (mode or 1) * limit - total
        self.jump(0.0, spring)
        self.enter(mode, spring, counts=False)
        # a finite displacement at x = 0
        y[S] = 0.0

    def choose(self, spring: float, third_before: bool = False) -> None:
        """Choose the mode after a switch at x > 0, f_e being continuous; caps it at once where it has to be."""
        f, y = self.friction, self.y
        if f.kind != "spring":
            return
        if f.positive and self.pulls:
            after = -self.phase.damping(y[S]) * y[G] if f.cap == "total" else 0.0
            self.jump(spring, after)
            self.enter(FREE, after)
            return
        drag = self.phase.damping(y[S]) * y[G] if f.cap == "total" else 0.0
        limit, total = self.phase.limit(y[S], y[V]), spring + drag
        if limit - abs(total) > 1e-11 * f.mu:
            self.enter(STICK, spring)
            return
        sign = 1 if total >= 0.0 else -1
        after = sign * limit - drag
        self.jump(spring, after)
        margin = self.phase.slip_margin(y, sign)
        self.enter(sign if margin >= 0.0 else STICK, after)

    def after_zero_force(self) -> None:
        """The force has just begun to pull, with mu N = 0."""
        f, y, phase = self.friction, self.y, self.phase
        spring = -phase.damping(y[S]) * y[G] if f.cap == "total" else 0.0
        if f.positive and self.pulls:
            self.enter(FREE, spring)
            return
        rate = phase.trial_rate(y, 0.0, spring, y[G])
        if abs(rate) <= phase.limit_rate(y[S], y[V]):
            self.enter(STICK, spring)
        else:
            self.enter(1 if rate > 0.0 else -1, spring)

    # -- events of the present phase and mode; each is positive until it happens

    def events(self) -> dict[str, Callable[[np.ndarray], float]]:
        phase, f = self.phase, self.friction
        result: dict[str, Callable[[np.ndarray], float]] = {}
        if self.is_back:
            result["gap"] = lambda y: y[S]
        else:
            result["peak"] = lambda y: y[V]
        sign = -1.0 if self.pulls else 1.0
        if self.is_back or self.pulls:
            name = "release" if self.is_back and self.normal.release == "force" else "zero"
            result[name] = lambda y: sign * phase.force(y[S], y[V]) if y[S] > 0.0 else math.inf
        for number, point in enumerate(self.points):
            result[f"breakpoint {number}"] = lambda y, point=point: (
                (phase.x(y[S]) - point) * (1.0 if self.is_back else -1.0)
            )
        if f.kind == "dashpot":
            viscous = 1.0 if self.mode == STICK else -1.0
            result["kink"] = lambda y: viscous * (phase.limit(y[S], y[V]) - phase.damping(y[S]) * abs(y[G]))
        if f.kind == "spring":
            if self.mode == STICK:
                result["slip"] = phase.stick_margin
            elif abs(self.mode) == THIRD:
                result["third slip"] = lambda y: phase.third_margins(y, self.mode // 2)[0]
                result["third stick"] = lambda y: phase.third_margins(y, self.mode // 2)[1]
            elif self.mode != FREE:
                result["stick"] = lambda y: phase.slip_margin(y, self.mode)
        return result

    def run(self) -> str:
        """Integrate until the first event, and return its name."""
        events = self.events()
        scale = self.friction.mu
        armed = dict.fromkeys(events, True)
        for name in ("slip", "stick", "kink", "third slip", "third stick"):
            armed[name] = False
        if "zero" in events:
            armed["zero"] = not math.isclose(events["zero"](self.y), 0.0, abs_tol=1e-12)
        solver = DOP853(
            lambda t, y: self.phase.rates(y, self.mode), 0.0, self.y, 1e9, rtol=RTOL, atol=ATOL, max_step=MAX_STEP
        )
        for _ in range(MAX_STEPS):
            before = solver.y.copy()
            if solver.step() is not None or solver.status == "failed":
                raise ArithmeticError("step too small")
            dense = solver.dense_output()
            start, length = solver.t_old, solver.t - solver.t_old
            found = self.first_event(events, armed, dense, start, length, scale)
            if found is not None:
                name, time = found
                self.y = self.at_event(events[name], before, time - start, length, dense, start)
                return name
        raise ArithmeticError("too many steps")

    def first_event(self, events, armed, dense, start, length, scale) -> tuple[str, float] | None:
        best: tuple[str, float] | None = None
        times = [start, *(start + length * SAMPLES)]
        states = dense(np.array(times)).T
        for name, event in events.items():
            tolerance = LIMIT_TOLERANCE * scale if name in ("slip", "kink") else 0.0
            if name in ("stick", "third slip", "third stick"):
                tolerance = 1e-10 * scale
            values = [math.inf] + [event(y) if y[S] > 0.0 or name == "gap" else math.nan for y in states[1:]]
            if states[0][S] > 0.0:
                values[0] = event(states[0])
                armed[name] = armed[name] or values[0] > tolerance
            time = self.crossing(name, event, armed, dense, times, values, tolerance)
            if time is not None and (best is None or time < best[1]):
                best = name, time
        if best is not None and best[0] == "gap" and armed.get("slip"):
            # the limit vanishes at x = 0, so that a slip may begin after the last sample
            margin, end = events["slip"], best[1] - 10.0 * TINY_S / abs(dense(best[1])[V])
            before = [t for t in times if t < end]
            if end > start and margin(dense(end)) < 0.0 < margin(dense(before[-1])):
                best = "slip", brentq(lambda t: margin(dense(t)), before[-1], end, xtol=1e-16, rtol=1e-15)
        return best

    def crossing(self, name, event, armed, dense, times, values, tolerance) -> float | None:
        for i in range(1, len(times)):
            if math.isnan(values[i]):
                continue
            if not armed[name]:
                if values[i] > tolerance:
                    armed[name] = True
                elif values[i] < -tolerance:
                    near = times[i - 1] + (times[i] - times[i - 1]) * NEAR_START
                    positive = [t for t in near if event(dense(t)) > 0.0]
                    if positive:
                        return brentq(lambda t: event(dense(t)), positive[-1], times[i], xtol=1e-16, rtol=1e-15)
                    # it was never positive: it happens at once
                    return times[i - 1]
                continue
            if values[i] < 0.0:
                low, high = times[i - 1], times[i]
                if not values[i - 1] > 0.0:
                    return low
                return brentq(lambda t: event(dense(t)), low, high, xtol=1e-15, rtol=1e-15)
            if i + 1 < len(times) and values[i] <= values[i - 1] and values[i] <= values[i + 1]:
                # a dip between samples
                dip = minimize_scalar(
                    lambda t: event(dense(t)), bounds=(times[i - 1], times[i + 1]), method="bounded",
                    options={"xatol": 1e-12},
                )  # fmt: skip
                if dip.fun < -max(tolerance, 1e-14) and times[i - 1] < dip.x:
                    low = times[i - 1]
                    return brentq(lambda t: event(dense(t)), low, dip.x, xtol=1e-15, rtol=1e-15)
        return None

    def at_event(self, event, before, time, length, dense, start) -> np.ndarray:
        """The state at an event, by a step that ends there; the time is corrected by secants."""
        if time <= 1e-15:
            return before

        def state(t: float) -> np.ndarray:
            solver = DOP853(
                lambda t, y: self.phase.rates(y, self.mode), 0.0, before, t, rtol=RTOL, atol=ATOL, first_step=t
            )
            while solver.status == "running":
                solver.step()
            return solver.y.copy()

        y = state(time)
        for _ in range(3):
            value = event(y)
            h = 1e-4 * length
            slope = (event(dense(start + time)) - event(dense(start + time - h))) / h
            if not value or not slope or not math.isfinite(slope) or abs(value / slope) > 1e-6 * length:
                break
            time -= value / slope
            y = state(time)
        return y

    # -- the course

    def solve(self) -> Outcome:
        f, out = self.friction, self.outcome
        self.points = [p for p in self.normal.breakpoints if math.isfinite(p)]
        self.all_points = list(self.points)
        self.set_ends()
        self.begin()
        if f.kind == "dashpot":
            self.mode = STICK if self.phase.damping(1e-6) * abs(self.y[G]) < self.phase.limit(1e-6, 1.0) else 1
            out.modes.append((0.0, self.mode))
        for _ in range(1000):
            name = self.run()
            if abs(self.mode) == THIRD:
                # at s = 0 itself it is 0/0
                s = self.y[S] if self.phase.residual else max(self.y[S], 1e-5)
                self.y[G] = self.phase.steady_slip(self.mode // 2, s, self.y[V])
            if name in ("gap", "release"):
                return self.finish(name)
            self.switch(name)
        raise ArithmeticError("too many switches")

    def set_ends(self) -> None:
        """Bound difference quotients by the breakpoints around the present indentation."""
        phase, x = self.phase, self.phase.x(self.y[S])
        known = [(p - phase.residual) ** (1.0 / P) for p in self.all_points]
        below = [s for s in known if phase.residual + s**P < x or (s == self.y[S] and not self.is_back)]
        phase.ends = (max(below, default=0.0), min((s for s in known if s not in below), default=math.inf))

    def spring_now(self) -> float:
        if abs(self.mode) == THIRD:
            return (self.mode // 2) * self.phase.limit(self.y[S], self.y[V])
        return self.phase.forces(self.y, self.mode)[1]

    def switch(self, name: str) -> None:
        f, y = self.friction, self.y
        spring = self.spring_now()
        if name == "kink":
            self.outcome.slip_changes += 1
            self.mode = 1 - self.mode
            self.outcome.modes.append((float(y[S]), self.mode))
            return
        if f.kind == "spring":
            self.leave(spring)
        if name == "peak":
            self.turn_back()
            self.choose(spring)
        elif name.startswith("breakpoint"):
            del self.points[int(name.split()[1])]
            y[S] += math.copysign(1e-13, y[V])
            self.set_ends()
            self.choose(spring)
        elif name == "zero":
            self.pulls = not self.pulls
            self.phase.side = -self.phase.side
            if f.kind == "spring":
                self.after_zero_force()
        elif name == "slip":
            total = spring + (self.phase.damping(y[S]) * y[G] if f.cap == "total" else 0.0)
            sign = 1 if total > 0.0 else -1
            # an armed margin only falls where the trial grows faster; otherwise the sticking goes on
            self.enter(sign, sign * self.phase.limit(y[S], y[V]) - (total - spring))
        elif name == "stick":
            self.enter(self.third_or_stick(), spring)
        elif name == "third slip":
            self.enter(self.mode // 2, spring)
        elif name == "third stick":
            self.enter(STICK, spring)

    def third_or_stick(self) -> int:
        f, y, sign = self.friction, self.y, self.mode
        if f.cap == "spring" and f.c_t and sign * y[G] < 0.0 and min(self.phase.third_margins(y, sign)) > 0.0:
            return THIRD * sign
        return STICK

    def turn_back(self) -> None:
        normal, y = self.normal, self.y
        y[V] = 0.0
        peak = self.phase.x(y[S])
        at_peak = self.phase.force(y[S], 0.0)
        residual = normal.residual(peak, at_peak) if normal.residual else 0.0
        force = normal.force
        if normal.unloading is not None:

            def force(x: float, v: float) -> float:
                return normal.unloading(x, v, peak, at_peak)

        side, counts = self.phase.side, self.phase.counts_memory
        self.phase = Phase(self.friction, force, residual, self.friction.memory[1])
        self.phase.side, self.phase.counts_memory = side, counts
        self.is_back = True
        points = normal.breakpoints
        if normal.unloading is not None:
            points = normal.unloading_breakpoints(peak, at_peak) if normal.unloading_breakpoints else ()
        self.points = [p for p in points if math.isfinite(p) and residual < p < peak * (1.0 - 1e-12)]
        self.all_points = list(self.points)
        if residual:
            y[S] = (peak - residual) ** (1.0 / P)
        self.set_ends()

    def finish(self, name: str) -> Outcome:
        out, y, f = self.outcome, self.y, self.friction
        if name == "gap":
            y[S] = TINY_S if not self.phase.residual else 0.0
        out.g, out.e_out, out.sliding_impulse = float(y[G]), -float(y[V]), float(y[IMPULSE])
        if f.kind == "coulomb":
            # exact, once the sliding impulse is known
            out.g = max(out.g - f.mu * out.sliding_impulse / f.m_t, 0.0)
            return out
        out.damping_work = float(y[DAMPING_WORK])
        modes = {abs(mode) for _, mode in out.modes}
        if f.kind in ("spring", "dashpot"):
            out.regime = 3 if STICK in modes and len(modes) > 1 else 1 if STICK in modes else 2
        if f.kind == "spring":
            spring = self.spring_now()
            self.leave(spring)
            out.elastic_left, out.memory_work = self.phase.energy(y[S], spring), float(y[MEMORY_WORK])
            # in every mode f_e g is the rate of the spring's energy and of these two
            out.slip_and_memory = float(y[SPRING_WORK]) - out.elastic_left
        return out


def solve(normal: NormalLaw, friction: Friction, g0: float) -> Outcome:
    """Integrate one impact with a slip speed g0 > 0."""
    if friction.kind != "spring" or not friction.kp:
        return Trajectory(normal, friction, g0).solve()
    # where there is energy in the spring at x = 0, slip work and memory work each have a pole there
    first = Trajectory(normal, friction, g0)
    first.phase.counts_memory = False
    outcome = first.solve()
    powers = [normal.damping[1]] if normal.damping and normal.damping[0] else []
    powers += [friction.q] * bool(friction.c_t and friction.cap == "total")
    slides = [first.begins_at_limit, first.mode != STICK and normal.release == "gap"]
    if any(slides) and powers and 2.0 * min(powers) <= friction.kp:
        outcome.slip_work = outcome.memory_work = math.nan
        return outcome
    return Trajectory(normal, friction, g0).solve()


def kick_drift(normal: NormalLaw, f: Friction, g0: float, h: float, phase: float = 0.5) -> float:
    """The slip after time steps as codes take them, from x = phase h; the classic scheme, with memory and cap."""
    x, u, g, memory, old_k = phase * h, 1.0, g0, 0.0, 0.0
    peak = at_peak = residual = 0.0
    displacement, rescaled = f.memory[0] == 1.0, f.memory[1] > f.memory[0]
    while True:
        if u <= 0.0 and not peak:
            peak, at_peak = x, normal.force(x, 0.0)
            residual = normal.residual(peak, at_peak) if normal.residual else 0.0
        if x <= residual and u < 0.0:
            return g
        push = normal.unloading(x, u, peak, at_peak) if peak and normal.unloading else normal.force(x, u)
        if normal.release == "force" and push <= 0.0 and u < 0.0:
            return g
        limit = f.mu * (max(push, 0.0) if f.positive else abs(push))
        drag = f.c_t * x**f.q * g
        if f.kind == "dashpot":
            f_m = math.copysign(min(abs(drag), limit), g)
        else:
            k = f.k_t * x**f.kp
            if rescaled and old_k and k < old_k:
                memory *= k / old_k
            memory += h * g * (1.0 if displacement else k)
            spring = k * memory if displacement else memory
            f_m = spring + drag
            capped = f_m if f.cap == "total" else spring
            if abs(capped) > limit:
                f_m = math.copysign(limit, capped)
                spring = f_m - (drag if f.cap == "total" else 0.0)
                memory = spring / k if displacement else spring
            old_k = k
        u -= h * push
        g -= h * f_m / f.m_t
        x += h * u


def beta(outcome: Outcome, g0: float) -> float:
    return -outcome.g / g0
