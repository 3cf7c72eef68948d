"""The slip of a contact under friction, with its events, integrated together with the normal motion of a phase.

The components are s and v, or its substitute, of the normal motion, Gamma = G/G0, and the memory z of the spring,
whose force over G0 is phi_e = sqrt(kappa') X^r z with X = x^kp. In the smooth time of `impact.contact.motion`, in
which dt = w dsigma with w = p s^(p-1),

    dGamma/dsigma = -w phi,  dz/dsigma = sqrt(kappa') w X^(1-r) Gamma,  phi = phi_e + c' x^q Gamma

while the contact sticks, in the mode 0. In the modes -1 and 1 it slips, and phi is the limit -N or N, over G0. The
modes -2 and 2 belong to a cap of the spring alone: phi_e stays at its limit without plastic slip, which codes
reach by alternating between the others. Then phi_e and its rate determine Gamma.

A slip begins where the trial force reaches the limit, and ends where it would grow less than the limit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Indices, Int8Array, Mask
from ..ode.problem import Margins, Params, Problem
from . import motion
from .formula_calls import Formula, argument_names, call_by_name
from .piecewise import STEP_BEYOND, Breakpoint
from .powers import integer_power, power
from .velocity_coordinates import signed_power

FrictionKind = Literal["coulomb", "spring", "dashpot", "regularized", "cone"]
# what a contact has done, the bits of a contact regime; 0 where that is not defined
STICKS, SLIDES = np.int8(1), np.int8(2)

# rows of the joint state and its rates after s and v; the first four rows are components, those from time on the
# quadratures of `TangentialForm.quadratures`; the last row of rates is the normal force
SLIP_ROW, SPRING_ROW, TIME_ROW = range(2, 5)
N_COMPONENTS = 4
# those rows of the joint rates that a normal problem has; it does not use its work, the fourth
NORMAL_ROWS = [0, 1, TIME_ROW, TIME_ROW, -1]
# errors of Gamma and z are judged against 1
JOINT_FLOOR = (*motion.ERROR_FLOOR, 1.0, 1.0)
# the force of a dashpot or a spring that is not there
NO_FORCE = np.zeros(1)
# number of the margin of the sign of the normal force, after that of the mode
SIGN_MARGIN = 1
# a margin counts as positive down to this part of the largest normal force, which is of the order of 1
MARGIN_TOLERANCE = 1e-12
# a force within this part of the limit is at the limit where the formulas change
CAP_TOLERANCE = 1e-9
# errors of the growth of a trial force near the end of the contact, relative to the rate of the limit
GROWTH_TOLERANCE = 1e-6
# least s to which steps of difference quotients are relative
MIN_REACH = 1e-2
# powers of x that differ by less are the same
ORDER_TOLERANCE = 1e-6
# steps of the central difference quotients for the rate of N and the rate of the slip that it determines
RATE_OF_LIMIT_STEP, RATE_OF_SLIP_STEP = 1e-5, 1e-3
# bound on rounding errors of the normal force over K x^n, from which damping takes: four times the largest seen
FORCE_ROUNDING = 4e-15
# s at which leading powers of x are compared at first contact, and their rates; and the least s for what
# is singular at s = 0
START_S, RATE_S, LEAST_S = 1e-7, 1e-4, 1e-10
# s below which a mode does not change any more
END_S = 1e-6
# x below which the slip in the modes -2 and 2, and the growth of a trial force, are the same
END_X = 1e-7
# step of the central difference quotient there, relative to s; it sees the rate of N beside a force that jumps
RATE_STEP = 1e-2


@dataclass(frozen=True)
class TangentialForm:
    """What all tangential trajectories of a pair at one exponent n have in common.

    Parameters
    ----------
    kind : see `impact.contact.friction.FrictionLaw`
    stiffness_power, damping_power : powers of x in the tangential stiffness k x^kp and damping c x^q
    memory : r on loading and on unloading; while the contact grows or shrinks, 0 keeps the force, 1 the
        displacement
    cap : what mu N limits, the "total" force, that of the "spring" alone, or, of a fixed step, that of the spring
        and then the total, "both"
    coefficient : of kind "regularized": the coefficient of friction over mu as a formula of y, which is
        `SLIP_SCALE` abs(G), and of other values of the problem, by their names without `PREFIX`
    has_dashpot : whether any trajectory has a dashpot
    """

    kind: FrictionKind
    stiffness_power: float = 0.0
    damping_power: float = 0.0
    memory: tuple[float, float] = (0.0, 0.0)
    cap: Literal["total", "spring", "both"] = "total"
    coefficient: Formula | None = None
    has_dashpot: bool = True

    @property
    def has_modes(self) -> bool:
        """Whether the contact sticks and slips."""
        return self.kind in ("spring", "dashpot")

    @property
    def is_total(self) -> bool:
        """Whether the limit caps spring and dashpot together."""
        return self.cap == "total" and self.kind == "spring"

    @property
    def may_hold(self) -> bool:
        """Whether the modes -2 and 2 occur."""
        return self.cap != "total" and self.kind == "spring"

    @property
    def quadratures(self) -> dict[str, int]:
        """What is integrated besides the components, with the numbers of its rows.

        Time; with a spring whose stiffness varies, the work on it while sticking and its memory work at the limit;
        "work", that of the dashpot, or all work of a regularized friction. The work against the limit follows from
        impulses, see `Track.add_impulse`.
        """
        names = ["time"]
        if self.kind == "spring" and self.stiffness_power:
            names += ["stick_work", "limit_memory"]
        if self.has_dashpot or self.kind == "regularized":
            names += ["work"]
        return {name: TIME_ROW + number for number, name in enumerate(names)}

    def integral(self, name: str, y: Array) -> Array:
        """Find a quadrature among the rows of a state; zero if it vanishes."""
        row = self.quadratures.get(name)
        return np.zeros(y.shape[1]) if row is None else y[row]


class Columns(NamedTuple):
    """Params of a joint problem after those of the normal problem, shape (n,) each; modes change the first seven.

    `limit`, `spring` and `dashpot` are the factors of F, X^r z and x^q Gamma in the force, zero in other modes;
    `memory_limit` is the factor of F in phi_e for the memory work. `share` is N/F over G0: positive, and in
    tension negative or zero; `sign` is the sign of F. `root` is the root of kappa', and `compliance` the inverse
    of kappa', zero without a spring. `residual` is the permanent indentation, above which s is.
    """

    mode: Array
    share: Array
    sign: Array
    limit: Array
    memory_limit: Array
    spring: Array
    dashpot: Array
    row: Array
    root: Array
    compliance: Array
    damping: Array
    G0: Array
    is_positive: Array
    residual: Array

    def changed(self, mode: Array, sign: Array) -> Columns:
        """Make the columns of other modes and signs of the normal force."""
        share = np.where(sign > 0.0, 1.0, self.is_positive - 1.0) / self.G0
        limit = np.sign(mode) * share
        sticks = mode == 0.0
        return self._replace(
            mode=mode,
            share=share,
            sign=sign,
            limit=np.where(np.abs(mode) == 1.0, limit, 0.0),
            memory_limit=limit,
            spring=np.where(sticks, self.root, 0.0),
            dashpot=np.where(sticks, self.damping, 0.0),
        )


@dataclass(frozen=True)
class Track:
    """What is known of each trajectory besides its integrated rows, in arrays of shape (n,) that are written to.

    `force` and `energy` are phi_e and its energy at the end of the last part, `v` and `slip` are v and Gamma to
    which the impulse of N is complete: `impulse`, and `signed` in the direction of the slip. `slip_work` has the
    work against the limit, and it and `damping_work` what happens where a mode begins and ends; `stick_energy`
    is what the spring gains while sticking, `held_memory` the memory work in the modes -2 and 2. `order` is the
    leading power of x in N at first contact, and `touches` tells that the spring was at its limit at x = 0.
    `regime` has the bits STICKS and SLIDES.
    """

    mode: Array
    sign: Array
    force: Array
    energy: Array
    v: Array
    slip: Array
    impulse: Array
    signed: Array
    slip_work: Array
    damping_work: Array
    stick_energy: Array
    held_memory: Array
    order: Array
    touches: Mask
    regime: Int8Array
    changes: NDArray[np.int32]
    is_slow: Mask

    @classmethod
    def of(cls, n: int) -> Track:
        """Begin n trajectories."""
        dtypes: dict[str, Any] = {"touches": bool, "is_slow": bool, "regime": np.int8, "changes": np.int32}
        arrays: dict[str, Any] = {name: np.zeros(n, dtypes.get(name, float)) for name in cls.__annotations__}
        return cls(**{**arrays, "sign": np.ones(n), "v": np.ones(n), "slip": np.ones(n)})

    def add_impulse(self, columns: Columns, v: Array, slip: Array) -> None:
        """Complete the impulses, and the work against the limit, up to velocities v and Gamma.

        While the contact slips Gamma changes by the impulse of N: times the mean Gamma it is the work.
        """
        index = columns.row.astype(np.intp)
        change = self.v[index] - v
        impulse = np.sign(columns.share) * change
        self.impulse[index] += impulse
        self.signed[index] += np.sign(columns.mode) * impulse
        self.slip_work[index] += columns.limit * change * (0.5 * (self.slip[index] + slip))
        self.v[index], self.slip[index] = v, slip


class Local(NamedTuple):
    """The state of friction at a point of a trajectory, over G0; rates are those in smooth time.

    `spring_force` is phi_e, `trial` the force that the limit caps, `drag` is c' x^q Gamma, and `capped_drag` its
    part that the limit caps together with the spring.
    """

    N: Array
    dN: Array
    dF: Array
    spring_force: Array
    drag: Array
    capped_drag: Array
    trial: Array


@dataclass(frozen=True)
class SlipPhase:
    """The joint motion of a phase: `Problem.rates` and the `Switch` of its modes.

    Parameters
    ----------
    form : of the tangential problems
    law : of the normal motion
    normal : the normal problem of the phase
    first : number of the first of the `Columns` among the params; the arguments of `TangentialForm.coefficient`
        follow them, with y over Gamma
    unloads : whether it is the restitution phase
    track : of all trajectories
    breakpoints : of the normal force, whose sides are the last params
    """

    form: TangentialForm
    law: motion.MotionLaw
    normal: Problem
    first: int
    unloads: bool
    track: Track
    breakpoints: Sequence[Breakpoint] = ()

    @cached_property
    def _write_normal(self) -> Callable[[motion.Rows, Array, Params], None]:
        return motion.rates_writer(self.law, unloads=self.unloads)

    @cached_property
    def _force(self) -> motion.Force:
        return motion.force_of(self.law, unloads=self.unloads)

    @property
    def memory(self) -> float:
        """r in this phase."""
        return self.form.memory[self.unloads]

    @property
    def stiffness_power(self) -> float:
        """The exponent of s in X."""
        return self.law.model.coordinate_power * self.form.stiffness_power

    @property
    def drag_power(self) -> float:
        """The exponent of s in x^q."""
        return self.law.model.coordinate_power * self.form.damping_power

    @property
    def end(self) -> float:
        """The s that belongs to END_X."""
        return float(END_X ** (1.0 / self.law.model.coordinate_power))

    def whole(self, s: Array, columns: Columns) -> tuple[Array, Array | float]:
        """Compute the s of the whole indentation, of which spring and dashpot are, and its rate over that of s."""
        if not (self.unloads and self.law.model.is_permanent):
            return s, 1.0
        p = self.law.model.coordinate_power
        whole = power(integer_power(np.abs(s), p) + columns.residual, 1.0 / p)
        return whole, integer_power(s / _away_from_zero(whole), p - 1)

    def columns(self, params: Params) -> Columns:
        return Columns(*params[self.first : self.first + len(Columns._fields)])

    def problem(self) -> Problem:
        """Pose the joint problem."""
        normal = self.normal
        # a coordinate for strong damping uses the rate of time, others only those of s and v and the force
        used = NORMAL_ROWS if self.law.coordinate.strength else slice(None)
        return Problem(
            rates=self.rates,
            event=lambda y, k, params: normal.event(y[:2], k[used], params),
            unreachable=lambda y, k, params: normal.unreachable(y[:2], k[used], params),
            floor=JOINT_FLOOR,
            step_at_unit_error=normal.step_at_unit_error,
            n_components=N_COMPONENTS,
            n_quadratures=len(self.form.quadratures),
            switch=self,
        )

    def rates(self, y: Array, params: Params, out: Array | None = None) -> Array:
        """Compute the rates of the joint problem, see `Problem`."""
        form, columns, n = self.form, self.columns(params), y.shape[1]
        rows = form.quadratures
        out = np.empty((TIME_ROW + len(rows) + 1, n)) if out is None else out
        # the rates need both, also where `out` has no rows for them
        weight = out[TIME_ROW] if len(out) > TIME_ROW else np.empty(n)
        force = out[-1] if len(out) > TIME_ROW + len(rows) else np.empty(n)
        self._write_normal((out[0], out[1], weight, None, force), y[:2], params)
        v, slip = out[0], y[SLIP_ROW]
        s, growth = self.whole(y[0], columns)
        phi = slip_spring = columns.limit * force
        if form.coefficient is not None:
            names, values = argument_names(form.coefficient), params[self.first + len(columns) :]
            arguments = dict(zip(names, values, strict=False))
            arguments["y"] = arguments["y"] * np.abs(slip)
            phi = phi * (np.sign(slip) * call_by_name(form.coefficient, arguments))
        if self.form.kind == "spring":
            spring_force = self._times(columns.spring * y[SPRING_ROW], s, self.memory * self.stiffness_power)
            phi = phi + spring_force
            np.multiply(columns.spring, slip, out[SPRING_ROW])
            out[SPRING_ROW] *= self._stretch(s, growth, weight)
        else:
            out[SPRING_ROW] = 0.0
        if form.has_dashpot:
            drag = self._times(slip, s, self.drag_power)
            stick_drag = columns.dashpot * drag
            phi = phi + stick_drag
        np.multiply(weight, phi, out[SLIP_ROW])
        np.negative(out[SLIP_ROW], out[SLIP_ROW])
        if len(out) == N_COMPONENTS:
            return out
        if form.cap == "spring":
            slip_spring = columns.memory_limit * force
        if form.has_dashpot:
            # it works on while a cap of the total force slips, and takes from what the spring does
            working_drag = columns.damping * drag if form.is_total else stick_drag
            slip_spring = slip_spring - (working_drag - stick_drag)
            np.multiply(weight * slip, working_drag, out[rows["work"]])
        elif "work" in rows:
            np.multiply(weight * slip, phi, out[rows["work"]])
        if "limit_memory" in rows:
            np.multiply(weight * slip, spring_force, out[rows["stick_work"]])
            memory_work = out[rows["limit_memory"]]
            # beyond the end of the contact it does not matter
            np.divide(growth * v, signed_power(np.maximum(s, LEAST_S), self.stiffness_power + 1.0), memory_work)
            memory_work *= (0.5 - self.memory) * self.stiffness_power * columns.compliance
            memory_work *= slip_spring * slip_spring
        return out

    def _times(self, factor: Array, s: Array, exponent: float) -> Array:
        """Multiply by a power of s."""
        return factor * signed_power(s, exponent) if exponent else factor

    def _stretch(self, s: Array, growth: Array | float, weight: Array) -> Array:
        """Compute w X^(1-r)."""
        exponent = (1.0 - self.memory) * self.stiffness_power
        if exponent >= 0.0:
            return self._times(weight, s, exponent)
        p = self.law.model.coordinate_power
        return np.asarray(growth * (p * signed_power(s, p - 1.0 + exponent)))

    def _energy(self, s: Array, force: Array, columns: Columns) -> Array:
        """Compute the energy of a spring of this force, over G0^2; zero without a spring."""
        half = 0.5 * columns.compliance * force * force
        return half / signed_power(_away_from_zero(s), self.stiffness_power)

    def local(self, y: Array, k: Array, params: Params) -> Local:
        """Compute the state of friction at components y with rates k."""
        form, columns = self.form, self.columns(params)
        d_force, (s, _) = self._rate_of_force(y, k, params), self.whole(y[0], columns)
        N, drag = columns.share * k[-1], NO_FORCE
        if form.has_dashpot:
            drag = self._times(columns.damping * y[SLIP_ROW], s, self.drag_power)
        capped_drag = drag if form.is_total else NO_FORCE
        # of these two one is zero
        spring_force = self._times(columns.spring * y[SPRING_ROW], s, self.memory * self.stiffness_power)
        spring_force = spring_force + columns.memory_limit * k[-1]
        if form.has_dashpot and form.is_total:
            spring_force = spring_force - np.where(columns.mode == 0.0, 0.0, capped_drag)
        trial = drag if form.kind == "dashpot" else spring_force + capped_drag
        return Local(N, columns.share * d_force, d_force, spring_force, drag, capped_drag, trial)

    def _rate_of_force(self, y: Array, k: Array, params: Params) -> Array:
        """Compute the rate of the normal force by a difference quotient."""
        # near s = 0 a force with a part that does not vanish there loses its rate to rounding in shorter steps
        reach = np.clip(np.abs(y[0]), MIN_REACH, 1.0)
        if self.form.cap == "total":
            small = motion.RELEASE_STEP * reach
            if self.breakpoints:
                small = np.where(self._crosses(y[:2] + small * k[:2], params), -small, small)
            return np.asarray((self._force(y[:2] + small * k[:2], params) - k[-1]) / small)
        # the friction force jumps where a slip ends, which makes the time of it matter
        small = RATE_OF_LIMIT_STEP * reach
        is_end, is_start = (self._crosses(y[:2] + step * k[:2], params) for step in (small, -small))
        first, last = np.where(is_start & ~is_end, 0.0, -small), np.where(is_end, 0.0, small)
        behind, ahead = (self._force(y[:2] + step * k[:2], params) for step in (first, last))
        return np.asarray((ahead - behind) / (last - first))

    def _crosses(self, y: Array, params: Params) -> Mask:
        """Find where components are beyond a breakpoint of the normal force, at which its rate jumps."""
        crosses = np.zeros(y.shape[1], bool)
        for breakpoint, side in zip(self.breakpoints, params[-len(self.breakpoints) :], strict=False):
            crosses |= side * breakpoint(y[:2], params) < 0.0
        return crosses

    def trial_rate(self, y: Array, k: Array, columns: Columns, spring_force: Array, phi: Array) -> Array:
        """Compute the rate of the trial force if the contact sticks, at a force phi and one of the spring."""
        form, slip, weight, rate = self.form, y[SLIP_ROW], k[TIME_ROW], NO_FORCE
        s, growth = self.whole(y[0], columns)
        rate_of_s = growth * k[0]
        if self.form.kind == "spring":
            rate = self._times(columns.root * columns.root * weight * slip, s, self.stiffness_power)
            if self.memory and self.stiffness_power:
                rate = rate + self.memory * self.stiffness_power * rate_of_s / _away_from_zero(s) * spring_force
        if form.has_dashpot and (form.is_total or form.kind == "dashpot"):
            rate = rate - self._times(columns.damping * (weight * phi), s, self.drag_power)
            if self.drag_power:
                growing = self._times(columns.damping * (self.drag_power * rate_of_s), s, self.drag_power - 1.0)
                rate = rate + growing * slip
        return rate

    # ---- the switch

    def margins(self, y: Array, k: Array, params: Params) -> Margins:
        """Compute the margin of the mode and that of the sign of the normal force, see `Switch`."""
        columns, local = self.columns(params), self.local(y, k, params)
        leaves = k[0] < 0.0
        sign_margin, sign_rate = columns.sign * k[-1] + MARGIN_TOLERANCE, columns.sign * local.dF
        if self.law.model.release == "force":
            # the contact ends where the force vanishes: it does not pull
            sign_margin, sign_rate = np.where(leaves, 1.0, sign_margin), np.where(leaves, 0.0, sign_rate)
        if not self.form.has_modes:
            return sign_margin[None], sign_rate[None]
        margin, rate = self._margin_of_mode(y, k, columns, local, MARGIN_TOLERANCE)
        near_end = np.flatnonzero(leaves & (y[0] <= max(self.end, MIN_REACH)))
        if near_end.size:
            margin[near_end], rate[near_end] = self._margin_near_end(
                y.take(near_end, 1), k.take(near_end, 1), _taken(params, near_end)
            )
        if self.form.may_hold:
            held = np.flatnonzero((np.abs(columns.mode) == 2.0) & ~(leaves & (y[0] < END_S)))
            if held.size:
                direction = np.sign(columns.mode[held])
                margin[held] = self._held_margin(y.take(held, 1), _taken(params, held), direction)[0]
                rate[held] = np.nan
        # without a limit the mode does not matter, nor without a force
        free = np.flatnonzero((columns.share == 0.0) | self._without_force(columns))
        margin[free], rate[free] = 1.0, 0.0
        return np.array([margin, sign_margin]), np.array([rate, sign_rate])

    def _margin_of_mode(
        self, y: Array, k: Array, columns: Columns, local: Local, tolerance: Array | float
    ) -> tuple[Array, Array]:
        """Compute the margin of the modes -1, 0 and 1, which is negative by no more than errors, and its rate."""
        phi = NO_FORCE
        if self.form.has_dashpot:
            phi = -k[SLIP_ROW] / np.where(k[TIME_ROW] == 0.0, 1.0, k[TIME_ROW])
        rate = self.trial_rate(y, k, columns, local.spring_force, phi)
        sticks, size = columns.mode == 0.0, np.abs(local.trial)
        # where the force is zero, as after a change of its sign, it grows in the direction of its rate
        is_zero = size <= MARGIN_TOLERANCE / columns.G0
        direction = np.sign(np.where(sticks, np.where(is_zero, rate, local.trial), columns.mode))
        growth, room = direction * rate - local.dN, local.N - size
        tolerance = tolerance / columns.G0
        if self.form.kind == "dashpot":
            return np.where(sticks, room, -room) + tolerance, np.where(sticks, -growth, growth)
        return np.where(sticks, room + tolerance, growth), np.where(sticks, -growth, np.nan)

    def _margin_near_end(self, y: Array, k: Array, params: Params) -> tuple[Array, Array]:
        """Compute the same near the end of the contact, where limit and force vanish together, up to errors."""
        columns, is_end = self.columns(params), y[0] < END_S
        # growth vanishes, too, but its sign shows whether the slip has ended before
        ending = (y[0] < self.end) & (np.abs(columns.mode) == 1.0)
        if ending.any():
            y = np.array([np.where(ending, self.end, y[0]), *y[1:]])
            k = np.where(ending, self.rates(y[:N_COMPONENTS], params), k)
        local, tolerance = self.local(y, k, params), np.where(is_end, CAP_TOLERANCE, MARGIN_TOLERANCE)
        margin, rate = self._margin_of_mode(y, k, columns, local, tolerance)
        sticks = columns.mode == 0.0
        if self.form.kind != "dashpot":
            margin = np.where(sticks, margin, margin + GROWTH_TOLERANCE * np.abs(local.dN))
        # nor does the mode matter after the end of the contact
        is_free = is_end & (y[0] < np.where(sticks, -END_S, END_S))
        return np.where(is_free, 1.0, margin), np.where(is_free, 0.0, rate)

    def rates_of_margins(self, y: Array, k: Array, params: Params) -> Array:
        """Compute the rates of the margins by central difference quotients, see `Switch`."""
        small = RATE_OF_SLIP_STEP * np.clip(np.abs(y[0]), MIN_REACH, 1.0)
        y, step = y[:N_COMPONENTS], small * k[:N_COMPONENTS]
        # behind and ahead at once: there are few trajectories here, and each call has its cost
        beside = np.concatenate([y - step, y + step], axis=1)
        params = tuple(np.concatenate([column, column]) for column in params)
        behind, ahead = np.split(self.margins(beside, self.rates(beside, params), params)[0], 2, axis=1)
        # at first contact and at the release the formulas are smooth on one side only
        crosses = self._crosses(beside, params).reshape(2, -1).any(axis=0)
        return np.where((y[0] > 2.0 * small) & ~crosses, (ahead - behind) / (2.0 * small), np.nan)

    def change(self, which: Indices, y: Array, k: Array, params: Params) -> tuple[Array, Params]:
        """Change the modes and signs of trajectories where margins vanish, see `Switch`."""
        y, columns = self._released(y, params), self.columns(params)
        old = columns.mode
        self.track.add_impulse(columns, k[0], y[SLIP_ROW])
        if not self.form.has_modes:
            # the only margin is that of the sign
            return self._enter(old, -columns.sign, NO_FORCE, NO_FORCE, y, params)
        turned = which == SIGN_MARGIN
        sign = np.where(turned, -columns.sign, columns.sign)
        local, other = self.local(y, k, params), columns.changed(old, sign)
        # at a change of the sign there is neither a limit nor a force
        spring_force = np.where(turned, local.spring_force - local.trial, local.spring_force)
        # the rate of N changes its sign with the sign of the force
        dN = other.share * local.dF
        phi = np.where(turned, 0.0, np.where(old == 0.0, local.trial, np.sign(old) * local.N))
        rate = self.trial_rate(y, k, other, spring_force, phi)
        direction = np.sign(np.where(turned, rate, local.trial))
        new = self._mode_at_limit(direction * rate - dN, direction, y, other, turned)
        new = np.where(~turned & (np.abs(old) == 1.0), 0.0, new)
        # a held force that goes through zero is at the limit of both slip and stick from there
        new = np.where(turned & (np.abs(old) == 2.0) & (other.share != 0.0), 0.0, new)
        new = self._held_mode(~turned & (old != 0.0), np.abs(old) == 2.0, np.sign(old), new, y, params)
        spring_force = np.where(~turned & (old == 0.0), direction * local.N - local.capped_drag, spring_force)
        return self._enter(new, sign, local.spring_force, spring_force, y, params)

    def _without_force(self, columns: Columns) -> Mask:
        """Find trajectories without spring and dashpot."""
        return np.asarray((columns.root == 0.0) & (columns.damping == 0.0))

    def _mode_at_limit(
        self, growth: Array, direction: Array, y: Array, columns: Columns, turned: Mask | bool = False
    ) -> Array:
        """Find the modes at the limit, where the trial force grows by this more; where `turned` it is zero."""
        # without a limit the mode does not matter
        free = columns.share == 0.0
        forwards = np.where(y[SLIP_ROW] < 0.0, -1.0, 1.0)
        kept = np.where(columns.mode == 0.0, forwards, np.sign(columns.mode))
        slips = (columns.mode == 0.0) | turned if self.form.kind == "dashpot" else growth > 0.0
        new = np.where(free, kept, np.where(slips, forwards if self.form.kind == "dashpot" else direction, 0.0))
        return np.where(self._without_force(columns), 0.0, new)

    def _enter(
        self, new: Array, sign: Array, force_before: Array, force: Array, y: Array, params: Params
    ) -> tuple[Array, Params]:
        """Go on in other modes, with a force of the spring if the contact sticks; account for its energies."""
        form, track, columns = self.form, self.track, self.columns(params)
        index = columns.row.astype(np.intp)
        old, (s, _) = track.mode[index], self.whole(y[0], columns)
        before, after = self._energy(s, force_before, columns), self._energy(s, force, columns)
        was_slip, is_slip = np.abs(old) == 1.0, np.abs(new) == 1.0
        # the work of a dashpot while slipping is a part of that against the limit
        work, memory = form.integral("work", y), form.integral("limit_memory", y)
        entered = np.where(was_slip, 0.0, before + work)
        track.slip_work[index] += np.where(is_slip, entered, np.where(was_slip, -after - work, before - after))
        track.stick_energy[index] += np.where(old == 0.0, before, 0.0) - np.where(new == 0.0, after, 0.0)
        was_held, is_held = np.abs(old) == 2.0, np.abs(new) == 2.0
        begins, ends = is_held & ~was_held, was_held & ~is_held
        track.held_memory[index] += np.where(ends, memory, 0.0) - np.where(begins, memory, 0.0)
        rest = memory + 0.5 * y[SLIP_ROW] * y[SLIP_ROW]
        track.damping_work[index] += np.where(begins, rest + after, 0.0) - np.where(ends, rest + before, 0.0)
        track.mode[index], track.sign[index] = new, sign
        # the first mode is no change
        track.changes[index] += (old != new) & (track.regime[index] != 0)
        track.regime[index] |= np.where(is_held, STICKS | SLIDES, np.where(is_slip, SLIDES, STICKS))
        scale = self._times(columns.root, _away_from_zero(s), self.memory * self.stiffness_power)
        y = y.copy()
        y[SPRING_ROW] = np.where(new == 0.0, np.where(columns.root > 0.0, force / scale, 0.0), y[SPRING_ROW])
        return y, self._changed(params, new, sign)[1]

    def _changed(self, params: Params, mode: Array, sign: Array) -> tuple[Columns, Params]:
        """Make the columns, and with them the params, of other modes and signs of the normal force."""
        columns = self.columns(params).changed(mode, sign)
        return columns, (*params[: self.first], *columns, *params[self.first + len(columns) :])

    # ---- the modes -2 and 2, in which a spring at its limit determines the slip

    def _held_slip(self, y: Array, params: Params, direction: Array) -> tuple[Array, Array, Array]:
        """Compute Gamma for which the trial force of the spring grows as its limit does, its error, and N."""
        # at s = 0 the slip is 0/0; a force that vanishes there is known relative to s
        y = np.array([np.where(np.abs(y[0]) < self.end, self.end, y[0]), *y[1:]])
        k, columns = self.rates(y, params), self.columns(params)
        N, dN = columns.share * k[-1], columns.share * self._rate_of_force(y, k, params)
        (s, growth), p = self.whole(y[0], columns), self.law.model.coordinate_power
        stiffness = self._times(columns.root * columns.root * k[TIME_ROW], s, self.stiffness_power)
        fading = self.memory * self.stiffness_power * (growth * k[0]) / _away_from_zero(s) * N
        spring = np.abs(columns.share) * power(integer_power(np.abs(y[0]), p), self.law.n)
        step = RATE_OF_LIMIT_STEP * np.clip(np.abs(y[0]), MIN_REACH, 1.0)
        error = FORCE_ROUNDING * np.maximum(np.abs(N), spring) / (step * stiffness)
        return direction * (dN - fading) / stiffness, error, N

    def _held_force(self, y: Array, params: Params, direction: Array) -> tuple[Array, Array]:
        """Compute the friction force that gives the slip its rate, over G0, and its error."""
        small = RATE_OF_SLIP_STEP * np.clip(np.abs(y[0]), motion.MIN_RELEASE_S, 1.0)
        k = self.rates(y, params)
        step = small * k[:N_COMPONENTS]
        (ahead, error, _), (behind, _, _) = (
            self._held_slip(y + sign * step, params, direction) for sign in (1.0, -1.0)
        )
        duration = 2.0 * small * k[TIME_ROW]
        return (behind - ahead) / duration, error / duration

    def _held_margin(self, y: Array, params: Params, direction: Array) -> tuple[Array, Mask]:
        """Compute a margin, positive while the force is between slip and stick, and where it is nearer to slip.

        The rounding error of the force is added: near the end of the contact it exceeds the force.
        """
        columns, y = self.columns(params), y[:N_COMPONENTS]
        slip, _, N = self._held_slip(y, params, direction)
        force, error = self._held_force(y, params, direction)
        drag = self._times(columns.damping * slip, self.whole(y[0], columns)[0], self.drag_power)
        above_slip = (force - direction * N) * np.sign(drag)
        return np.minimum(above_slip, np.abs(drag) - above_slip) + error, above_slip < 0.5 * np.abs(drag)

    def _held_mode(
        self, at_limit: Mask, leaves: Mask, direction: Array, new: Array, y: Array, params: Params
    ) -> Array:
        """Replace new modes at the limit, where growth is zero, by a held mode, or by that to which it leaves."""
        if not self.form.may_hold:
            return new
        rows = np.flatnonzero(
            at_limit & (self.columns(params).damping > 0.0) & (self.columns(params).share != 0.0)
        )
        if rows.size:
            ahead = direction[rows]
            margin, is_near_slip = self._held_margin(y.take(rows, 1), _taken(params, rows), ahead)
            left = np.where(is_near_slip, ahead, 0.0)
            new = new.copy()
            new[rows] = np.where(leaves[rows], left, np.where(margin > 0.0, 2.0 * ahead, new[rows]))
        return new

    def _released(self, y: Array, params: Params) -> Array:
        """Set Gamma where a held mode determines it."""
        if not self.form.may_hold:
            return y
        held = np.flatnonzero(np.abs(self.columns(params).mode) == 2.0)
        if held.size:
            part, y = _taken(params, held), y.copy()
            direction = np.sign(self.columns(part).mode)
            y[SLIP_ROW, held] = self._held_slip(y[:N_COMPONENTS, held], part, direction)[0]
        return y

    def slip_and_force(self, y: Array, params: Params) -> tuple[Array, Array]:
        """Compute Gamma and the friction force over G0 at components y, also where a held mode determines them."""
        k, columns = self.rates(y, params), self.columns(params)
        slip, force = self._released(y, params)[SLIP_ROW], -k[SLIP_ROW] / k[TIME_ROW]
        held = np.flatnonzero(np.abs(columns.mode) == 2.0)
        if held.size:
            # between that of a slip and that of sticking; as both vanish the rate of the slip loses its digits
            limit = columns.memory_limit * k[-1]
            drag = self._times(columns.damping * slip, self.whole(y[0], columns)[0], self.drag_power)
            bounds = np.sort([limit, limit + drag], axis=0)[:, held]
            direction = np.sign(columns.mode[held])
            force[held] = np.clip(self._held_force(y.take(held, 1), _taken(params, held), direction)[0], *bounds)
        return slip, force

    # ---- the start and the end of a part

    def begin(self, start: Array, params: Params) -> tuple[Array, Params]:
        """Find the rows and params at the start of a part of the phase, where its formulas may change."""
        y = np.zeros((N_COMPONENTS + len(self.form.quadratures), start.shape[1]))
        y[: len(start)] = start
        index, track = self.columns(params).row.astype(np.intp), self.track
        is_contact = track.regime[index[0]] == 0
        # not at s = 0 itself, where the share of the spring in the limit is 0/0
        inside = self._rows_near_contact(y, params, START_S) if is_contact else y
        k = self.rates(inside[:N_COMPONENTS], params)
        is_certain = np.abs(k[-1]) > (0.0 if is_contact else MARGIN_TOLERANCE)
        sign = np.where(is_certain, np.sign(k[-1]), track.sign[index])
        columns, params = self._changed(params, track.mode[index], sign)
        if is_contact:
            twice_force = self._force(self._rows_near_contact(y, params, 2.0 * START_S)[:2], params)
            track.order[index] = np.log2(twice_force / k[-1]) / self.law.model.coordinate_power
        if not self.form.has_modes:
            mode = np.full(sign.size, 1.0 if self.form.kind == "regularized" else 0.0)
            return self._enter(mode, sign, NO_FORCE, NO_FORCE, y, params)
        local = self.local(inside, k, params)
        if is_contact:
            new, spring_force = self._at_contact(y, local, columns, params)
            return self._enter(new, sign, NO_FORCE, spring_force, inside, params)
        new, spring_force = self._at_change(y, k, local, columns, params)
        return self._enter(new, sign, track.force[index], spring_force, y, params)

    def _at_change(
        self, y: Array, k: Array, local: Local, columns: Columns, params: Params
    ) -> tuple[Array, Array]:
        """Find the modes where the formulas of the normal motion, or r, have changed, and the spring's force."""
        force_before = self.track.force[columns.row.astype(np.intp)]
        trial = local.drag if self.form.kind == "dashpot" else force_before + local.capped_drag
        at_limit = np.abs(trial) >= local.N * (1.0 - CAP_TOLERANCE) - MARGIN_TOLERANCE / columns.G0
        direction = np.where(trial < 0.0, -1.0, 1.0)
        spring_force = np.where(at_limit, direction * local.N - local.capped_drag, force_before)
        new, was_held = direction, np.abs(columns.mode) == 2.0
        if self.form.kind == "spring":
            rate = self.trial_rate(y, k, columns, spring_force, direction * local.N)
            new = self._mode_at_limit(direction * rate - local.dN, direction, y, columns)
        new = np.where(at_limit, new, 0.0)
        return self._held_mode(at_limit & was_held, ~was_held, direction, new, y, params), spring_force

    def _at_contact(self, y: Array, local: Local, columns: Columns, params: Params) -> tuple[Array, Array]:
        """Find the same at first contact, where leading powers of x decide whether the trial force is below N."""
        form, kp, index = self.form, self.form.stiffness_power, columns.row.astype(np.intp)
        spring_force = (
            columns.root**2
            * START_S ** (self.law.model.coordinate_power * (kp + 1.0))
            / (kp + 1.0 - self.memory * kp)
        )
        trial = local.drag if form.kind == "dashpot" else spring_force + local.capped_drag
        below = trial < local.N
        growth = np.ones(index.size) if form.kind == "dashpot" else self._growth_at_contact(y, params)
        if form.is_total and kp * self.memory == form.damping_power > 0.0:
            # the leading powers cancel
            growth = np.where(local.capped_drag >= local.N, columns.root**2 * columns.G0 - 1.0, growth)
        new = np.where(~below & (growth > 0.0), 1.0, 0.0)
        if form.is_total and self.memory == 1.0 and form.damping_power < kp:
            self.track.is_slow[index] = is_slow = local.drag > local.N
            new = np.where(is_slow, -1.0, new)
        self.track.touches[index] = (new != 0.0) | ~below
        return new, np.where(below, 0.0, local.N - local.capped_drag)

    def _rows_near_contact(self, y: Array, params: Params, s: float) -> Array:
        """Make rows at an indentation so small that the velocities are those at first contact."""
        near = y.copy()
        near[0], near[1] = s, self.law.coordinate.of(np.full(y.shape[1], s), 1.0, self.law.strength(params))
        return near

    def _growth_at_contact(self, y: Array, params: Params) -> Array:
        """Compute by how much the trial force at the limit grows more than the limit, near first contact."""
        near = self._rows_near_contact(y, params, RATE_S)
        columns, k = self.columns(params), self.rates(near[:N_COMPONENTS], params)
        small = RATE_STEP * RATE_S * k[:2]
        ahead, behind = (self._force(near[:2] + step, params) for step in (small, -small))
        dN: Array = columns.share * (ahead - behind) / (2.0 * RATE_STEP * RATE_S)
        local = self.local(near, k, params)
        return self.trial_rate(near, k, columns, local.N - local.capped_drag, local.N) - dN

    def finish(self, y: Array, params: Params) -> None:
        """Note the state of friction at the end of a part, from its rows; complete the rows."""
        index = self.columns(params).row.astype(np.intp)
        columns, params = self._changed(params, self.track.mode[index], self.track.sign[index])
        y[SLIP_ROW] = self._released(y, params)[SLIP_ROW]
        near = y.copy()
        near[0] = _away_from_zero(y[0])
        k = self.rates(near[:N_COMPONENTS], params)
        if self.breakpoints:
            # a force that jumps is that before the breakpoint, on whichever side of it rounding has ended
            step = STEP_BEYOND * np.minimum(near[0], 1.0) * k[:N_COMPONENTS]
            near[:N_COMPONENTS] -= np.where(self._crosses(near[:N_COMPONENTS] + step, params), step, 0.0)
            k = self.rates(near[:N_COMPONENTS], params)
        force = self.local(near, k, params).spring_force
        self.track.force[index] = force
        # an energy that grows without bound towards x = 0 counts as slip work, or as memory work while sticking
        kept = self.memory * self.form.stiffness_power
        order = np.where(columns.mode == 0.0, kept, self.track.order[index])
        is_finite = 2.0 * order > self.form.stiffness_power - ORDER_TOLERANCE
        s, _ = self.whole(near[0], columns)
        is_finite |= (np.abs(columns.mode) == 2.0) | (s > END_S)
        self.track.energy[index] = np.where(is_finite, self._energy(s, force, columns), 0.0)
        self.track.add_impulse(columns, k[0], y[SLIP_ROW])


def _taken(params: Params, rows: Indices) -> Params:
    return tuple(column.take(rows) for column in params)


def _away_from_zero(s: Array) -> Array:
    """s, or the least value for what is singular at zero."""
    return np.where(np.abs(s) < LEAST_S, LEAST_S, s)
