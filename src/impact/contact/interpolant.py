"""Interpolate what is smooth in one variable, such as the outcome of a law in its dimensionless group.

A function is replaced by Chebyshev polynomials on intervals, in the logarithm of the variable. An interval is
accurate if its last coefficients vanish and if the polynomial agrees with the function between the nodes. One that
is not, by a kink, a jump or a failure, is divided; what is left after a few divisions is evaluated by the function
itself.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from ..array_types import Array, Indices, Mask
from ..errors import ModelError
from ..ode.problem import Params
from .model import ForceModel
from .motion import MotionLaw
from .records import CollisionResult
from .simulate import distinct_problems, integrate_collisions

DEGREE = 32
NODES = chebyshev.chebpts2(DEGREE + 1)
# positions between nodes where a polynomial is compared with the function
CHECKS = np.cos(np.pi * (np.array([31, 26, 20, 16, 11, 5, 0]) + 0.5) / DEGREE)
TO_COEFFICIENTS = np.linalg.inv(chebyshev.chebvander(NODES, DEGREE))
AT_CHECKS = chebyshev.chebvander(CHECKS, DEGREE)
# the last coefficients of an accurate polynomial, and its difference from the function; the outcomes of collisions
# change by up to 1e-10 where the number of steps of the integration changes
LAST_COEFFICIENTS, COEFFICIENT_TOLERANCE, CHECK_TOLERANCE = 3, 5e-11, 1e-10
# an interval is divided into so many parts, and that of a group so many times
PARTS, MAX_DIVISIONS = 8, 2
# divided intervals from which on a function counts as noise, which no polynomial fits
MAX_INTERVALS = 250
# real parts of a pair of roots this near to each other are a double root; coefficients that are left out are noise
REAL_ROOT, NOISE = 1e-6, 1e-13
# the intervals of a dimensionless group; other values are integrated
GROUP_EDGES = np.concatenate([[0.0], 10.0 ** np.arange(-4, 9)])
# the columns of a collision that are interpolated, and their sizes where their values are smaller
FLOORS = {
    **dict.fromkeys(("e_out", "approach_work", "restitution_work"), 1.0),
    **dict.fromkeys(("peak", "permanent", "force", "contact_time"), 0.0),
    "status": 1.0,
}
# the columns that outputs need; others need all
COLUMNS_OF = {
    **dict.fromkeys(("e_out", "v1_post", "v2_post", "energy_loss"), ("e_out",)),
    "peak_indentation": ("e_out", "peak"),
    "permanent_indentation": ("e_out", "permanent"),
    "peak_force": ("e_out", "force"),
    "contact_time": ("e_out", "contact_time"),
}
# steps of an integration at a node, which may be far from all values that are asked for
NODE_RTOL, NODE_MAX_STEPS = 1e-10, 400


def from_unit(t: Array, lower: Array | float, upper: Array | float) -> Array:
    """Convert t from -1 to 1 to values between bounds: logarithmic for bounds of one sign."""
    is_log = np.asarray(lower) * upper > 0.0
    ratio = np.divide(upper, lower, out=np.ones_like(t * lower), where=is_log)
    with np.errstate(over="ignore"):
        x = np.where(is_log, lower * ratio ** (0.5 * (1.0 + t)), lower + 0.5 * (1.0 + t) * (upper - lower))
    ends = np.where(t == -1.0, lower, np.where(t == 1.0, upper, x))
    return np.clip(ends, lower, upper)


def to_unit(x: Array, lower: Array | float, upper: Array | float) -> Array:
    """Convert values between bounds to t from -1 to 1; the inverse of `from_unit`."""
    is_log = np.asarray(lower) * upper > 0.0
    first, second = (
        np.log(np.divide(value, lower, out=np.full(np.shape(x), np.e), where=is_log)) for value in (x, upper)
    )
    share = np.where(is_log, first / second, (x - lower) / np.subtract(upper, lower))
    return np.clip(2.0 * share - 1.0, -1.0, 1.0)


def motion_key(model: ForceModel) -> object:
    """Collect what the motion of a law follows from: laws of the same key share it, if it has only one param."""
    if len(MotionLaw.of(model, model.exponent or 1.5, False).names) != 1:
        return model.key
    drag = model.coefficients.get("q") if model.velocity_coordinate == "force" else None
    declared = (model.exponent, model.release, model.coordinate_power, model.velocity_coordinate)
    return (*model.motion_formulas, drag, *declared)


@dataclass(frozen=True)
class Interval:
    """A polynomial between bounds, with the function at its nodes.

    Parameters
    ----------
    divisions : how many times the interval that it is a part of was divided
    values : of the function at the nodes, shape (DEGREE + 1, columns); None before the function was called
    coefficients : of the polynomials, of the shape of the values; None if they are not accurate
    """

    lower: float
    upper: float
    divisions: int = 0
    values: Array | None = None
    coefficients: Array | None = None

    @property
    def nodes(self) -> Array:
        """The values of the variable at the nodes, ascending, and between them; shape (DEGREE + 1 + checks,)."""
        return from_unit(np.concatenate([NODES, CHECKS]), self.lower, self.upper)

    def __call__(self, x: Array) -> Array:
        """Compute the polynomials between the bounds, shape (k, columns); NaN if they are not accurate."""
        if self.coefficients is None:
            return np.full(x.shape, np.nan)[:, None]
        return np.asarray(chebyshev.chebval(to_unit(x, self.lower, self.upper), self.coefficients).T)

    def tried(self, values: Array, floors: Array) -> Interval:
        """Interpolate the values of the function at all nodes."""
        at_nodes, between = np.split(values, [DEGREE + 1])
        if not np.isfinite(values).all():
            return replace(self, values=at_nodes)
        coefficients = TO_COEFFICIENTS @ at_nodes
        scale = np.maximum(np.abs(at_nodes).max(axis=0), floors)
        last, error = np.abs(coefficients[-LAST_COEFFICIENTS:]), np.abs(AT_CHECKS @ coefficients - between)
        is_accurate = (last <= COEFFICIENT_TOLERANCE * scale).all() & (error <= CHECK_TOLERANCE * scale).all()
        return replace(self, values=at_nodes, coefficients=coefficients if is_accurate else None)

    def parts(self) -> list[Interval]:
        """Divide the interval, geometrically beside zero."""
        share = np.linspace(-1.0, 1.0, PARTS + 1)
        edges = from_unit(share, self.lower, self.upper)
        decades = 10.0 ** -np.arange(PARTS, dtype=float)
        if self.lower == 0.0:
            edges = np.append(0.0, self.upper * decades[::-1])
        elif self.upper == 0.0:
            edges = np.append(self.lower * decades, 0.0)
        edges = np.unique(edges)
        return [Interval(lower, upper, self.divisions + 1) for lower, upper in pairwise(edges.tolist())]


class Interpolant:
    """A function of one variable, shape (k,) to (k, columns), by polynomials where these are accurate.

    An interval is tried when a value in it is asked for, and divided where it is not accurate.

    Parameters
    ----------
    function : NaN where it has no value
    edges : of the intervals, ascending
    floors : the size of each column, where its values are smaller
    max_divisions : how often an interval is divided
    is_needed : whether an interval with some values at its nodes, of the shape of `Interval.values`, is divided;
        by default all are

    >>> sine = Interpolant(lambda x: np.sin(x)[:, None], [0.0, 1.0, 2.0], np.ones(1))
    >>> abs(sine(np.array([0.3, 1.7]))[:, 0] - np.sin([0.3, 1.7])).max() < 1e-14
    np.True_
    """

    def __init__(
        self,
        function: Callable[[Array], Array],
        edges: Array | Sequence[float],
        floors: Array,
        max_divisions: int = MAX_DIVISIONS,
        is_needed: Callable[[Array], bool] | None = None,
    ) -> None:
        self.function, self.floors, self.max_divisions, self.is_needed = function, floors, max_divisions, is_needed
        bounds = np.asarray(edges, float).tolist()
        self.intervals = [Interval(lower, upper) for lower, upper in pairwise(bounds)]

    def __call__(self, x: Array) -> Array:
        """Compute the values, shape (k, columns); NaN where no polynomial is accurate.

        They do not depend on what was asked for before: the intervals of x are divided as often as it takes.
        """
        # another thread may replace those of the function
        intervals, is_divided = self.intervals, True
        while is_divided:
            edges = [intervals[0].lower, *(interval.upper for interval in intervals)]
            # of the interval of each value; -1 outside
            number = np.where((x >= edges[0]) & (x <= edges[-1]), np.searchsorted(edges[1:-1], x), -1)
            intervals, is_divided = self._refined(intervals, np.unique(number[number >= 0]))
        values: Array = np.full((x.size, self.floors.size), np.nan)
        for chosen in np.unique(number[number >= 0]).tolist():
            inside = number == chosen
            values[inside] = intervals[chosen](x[inside])
        return values

    def resolve(self) -> None:
        """Divide all intervals until each is accurate or divided enough."""
        while self._refined(self.intervals, np.arange(len(self.intervals)))[1]:
            if len(self.intervals) > MAX_INTERVALS:
                self.max_divisions = 0

    def samples(self) -> tuple[Array, Array]:
        """List the nodes and extrema of a resolved function of one column, ascending, with its values.

        Between neighbours in accurate intervals it is monotonic: their extrema are roots of the derivatives, which
        are eigenvalues of companion matrices. A value that fails is left out.
        """
        x, values = [], []
        for interval in self.intervals:
            assert interval.values is not None
            x.append(interval.nodes[: DEGREE + 1])
            values.append(interval.values[:, 0])
            if interval.coefficients is not None:
                coefficients = interval.coefficients[:, 0]
                kept = chebyshev.chebtrim(coefficients, NOISE * np.abs(coefficients).max())
                roots = chebyshev.chebroots(chebyshev.chebder(kept)) if kept.size > 2 else np.zeros(0)
                t = roots.real[(np.abs(roots.imag) < REAL_ROOT) & (np.abs(roots.real) < 1.0)]
                x.append(from_unit(t, interval.lower, interval.upper))
                values.append(np.asarray(chebyshev.chebval(t, coefficients), float))
        all_x, first = np.unique(np.concatenate(x), return_index=True)
        all_values = np.concatenate(values)[first]
        is_finite = np.isfinite(all_values)
        return all_x[is_finite], all_values[is_finite]

    def _refined(self, old: list[Interval], numbers: Indices) -> tuple[list[Interval], bool]:
        """Try intervals that are untried, and divide those that are not accurate; also whether any was."""
        intervals = old.copy()
        untried = [number for number in numbers.tolist() if intervals[number].values is None]
        if untried:
            values = self.function(np.concatenate([intervals[number].nodes for number in untried]))
            for number, block in zip(untried, np.split(values, len(untried)), strict=True):
                intervals[number] = intervals[number].tried(block, self.floors)
        divided = {number for number in numbers.tolist() if self._is_divided(intervals[number])}
        if untried or divided:
            parts = [i.parts() if number in divided else [i] for number, i in enumerate(intervals)]
            self.intervals = intervals = [interval for part in parts for interval in part]
        return intervals, bool(divided)

    def _is_divided(self, interval: Interval) -> bool:
        """Whether an interval is not accurate, but its parts may be, and are needed."""
        values = interval.values
        if values is None or interval.coefficients is not None or interval.divisions >= self.max_divisions:
            return False
        is_finite = np.isfinite(values)
        # what fails in most of it, or near its ends, is not worth many divisions
        is_worth = is_finite.all() or (is_finite.mean() > 0.5 and interval.divisions < MAX_DIVISIONS)
        return bool(is_worth) and (self.is_needed is None or self.is_needed(values))


class InterpolatedCollisions:
    """Collisions of a law for `simulate`, by polynomials where its motion depends on one number that varies.

    The other numbers are those of the first call. What differs from them is integrated.

    Parameters
    ----------
    outputs : names of the outputs that are needed; the columns of others are NaN
    rtol, max_steps, core : see `integrate_collisions`
    """

    # the exponent and the params of the first call, shape (params, 1); as the group, set once by whichever thread
    first: tuple[float, Array] | None = None
    # the number of the param that varies, and what it determines; what follows where none varies
    group: tuple[int, Interpolant] | None = None
    constant: CollisionResult | None = None

    def __init__(
        self, model: ForceModel, outputs: Sequence[str], *, rtol: float, max_steps: int, core: str
    ) -> None:
        needed = {"status"}.union(*(COLUMNS_OF.get(name, FLOORS) for name in outputs))
        self.columns = tuple(column for column in FLOORS if column in needed)
        self.model = model
        self.settings: dict[str, Any] = {"rtol": rtol, "max_steps": max_steps, "core": core}

    def __call__(
        self, law: MotionLaw, params: Params, n: int, *, never_separates: Mask | bool = False
    ) -> CollisionResult:
        """Compute n collisions with params of shape (n,); see `integrate_collisions`."""
        table = np.stack([np.broadcast_to(column, n) for column in params]) if params else np.zeros((0, n))
        first = self.first or vars(self).setdefault("first", (law.n, table[:, :1]))
        differs = table != first[1]
        varying = np.flatnonzero(differs.any(axis=1))
        group = self.group
        if group is None and (varying.size == 1 or len(params) == 1):
            floors = np.array([FLOORS[column] for column in self.columns])
            number = int(varying[0]) if varying.size else 0
            group = vars(self).setdefault("group", (number, Interpolant(self._outcomes, GROUP_EDGES, floors)))
        if group is not None:
            differs[group[0]] = False
        # where balls stay together is not known to what polynomials replace
        direct = differs.any(axis=0) | (law.n != first[0]) | never_separates
        collisions = CollisionResult.blank(n)
        same = ~direct
        if group is not None:
            outcomes = group[1](table[group[0], same])
            for name, column in zip(self.columns, outcomes.T, strict=True):
                with np.errstate(invalid="ignore"):
                    getattr(collisions, name)[same] = np.rint(column) if name == "status" else column
            direct[same] = np.isnan(outcomes).any(axis=1)
        elif same.any():
            if self.constant is None:
                self.constant = self._integrate(first[1], law.n, **self.settings)
            collisions.put(same, self.constant)
        if direct.any():
            never = np.broadcast_to(never_separates, n)[direct]
            collisions.put(direct, self._integrate(table[:, direct], law.n, never, **self.settings))
        return collisions

    def _outcomes(self, x: Array) -> Array:
        """Compute the columns at values of the group, shape (k,) to (k, columns); NaN where the law raises."""
        assert self.first is not None
        assert self.group is not None
        n, base = self.first
        table = np.repeat(base, x.size, axis=1)
        table[self.group[0]] = x
        rtol, max_steps = min(self.settings["rtol"], NODE_RTOL), min(self.settings["max_steps"], NODE_MAX_STEPS)
        try:
            collisions = self._integrate(table, n, **{**self.settings, "rtol": rtol, "max_steps": max_steps})
        except ModelError:
            if x.size == 1:
                return np.full((1, len(self.columns)), np.nan)
            return np.concatenate([self._outcomes(half) for half in np.array_split(x, 2)])
        return np.stack([getattr(collisions, name) for name in self.columns], axis=1).astype(float)

    def _integrate(self, table: Array, n: float, never: Mask | None = None, **settings: Any) -> CollisionResult:
        """Integrate collisions with params of shape (params, k), those with strong damping in their coordinate."""
        count = table.shape[1]
        never = np.zeros(count, bool) if never is None else never
        if count == 1:
            # together with a copy, as in a sweep: an `if` of a law raises no error for an array of length 1
            return self._integrate(table.repeat(2, 1), n, never.repeat(2), **settings).take(np.array([0]))
        law_values = dict(zip(MotionLaw.of(self.model, n, False).names, table, strict=True))
        collisions = CollisionResult.blank(count)
        for problems in distinct_problems(self.model, n, law_values, np.ones(count, bool), collapse=False):
            never_separates = never[problems.rows]
            integrated = integrate_collisions(
                problems.law, problems.params, never_separates.size, never_separates=never_separates, **settings
            )
            collisions.put(problems.rows, integrated)
        return collisions
