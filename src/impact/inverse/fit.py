"""Least-squares fits: parameters, profile-likelihood intervals, information criteria, identifiability."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares
from scipy.stats import chi2, qmc, t

from ..array_types import Array, Mask
from .batch import Evaluate, VectorFunction, run_together

Noise: TypeAlias = Literal["given", "scale", "excess"]
FitStatus: TypeAlias = Literal["ok", "at_bound", "not_converged", "too_few_points", "no_prediction"]

T = TypeVar("T")

# points of a Sobol sequence in the bounds that are tried first, and how many of them are starts
TRIED, STARTS = 128, 4
# an interval of bounds with a larger ratio is searched on a logarithmic scale
LOG_RATIO = 100.0
MAX_EVALUATIONS = 200
# of a fit, and of the fits with a fixed parameter or without a point, which need fewer digits
SOLVER_TOLERANCE, COARSE_TOLERANCE = 1e-13, 1e-7
# step of the finite differences of a fit, and that of fourth order of the final Jacobian, in units of the bounds
STEP, FINAL_STEP = 1e-5, 1e-3
# a residual where a model has no result, in standard deviations
NO_PREDICTION = 1e6
# a parameter this near to a bound, in units of the bounds, stands at it
AT_BOUND = 1e-7
# a direction of the parameters that changes the prediction less than this share of the strongest is not identified
SINGULAR = 1e-5
# share of a parameter in such a direction from which on it is not identified
INVOLVED = 1e-3
CONFIDENCE = 0.95
# bracketing steps of an end of a profile interval, and its relative accuracy
MAX_BRACKETS, PROFILE_XTOL = 30, 1e-6
# iterations of the excess variance
MAX_EXCESS_ITERATIONS = 50


@dataclass(frozen=True)
class Bounds:
    """Least and largest values of parameters, shape (p,), and the scale of each between them.

    The solver works with u in [0, 1]: linear between the bounds, or logarithmic where they are positive and far
    apart.
    """

    least: Array
    most: Array

    @property
    def is_log(self) -> Mask:
        positive = self.least > 0.0
        ratio = np.divide(self.most, self.least, out=np.ones_like(self.most), where=positive)
        return positive & (ratio > LOG_RATIO)

    def values(self, u: Array) -> Array:
        """Parameters of rows u, shape (..., p)."""
        least, most = np.where(self.is_log, self.least, 1.0), np.where(self.is_log, self.most, 1.0)
        between = self.least + u * (self.most - self.least)
        # a bound is met exactly
        between = np.where(u == 1.0, self.most, between)
        return np.where(self.is_log, np.clip(least * (most / least) ** u, least, most), between)

    def units(self, values: Array) -> Array:
        """The u of parameters, shape (..., p)."""
        least, most = np.where(self.is_log, self.least, 1.0), np.where(self.is_log, self.most, np.e)
        positive = np.where(self.is_log, values, 1.0)
        log_u = np.log(positive / least) / np.log(most / least)
        return np.where(self.is_log, log_u, (values - self.least) / (self.most - self.least))

    def slope(self, u: Array) -> Array:
        """Derivative of each parameter by its u, shape (p,)."""
        least, most = np.where(self.is_log, self.least, 1.0), np.where(self.is_log, self.most, np.e)
        return np.where(self.is_log, self.values(u) * np.log(most / least), self.most - self.least)


@dataclass(frozen=True)
class DataPoints:
    """Measured values with their standard deviations, each of shape (n,)."""

    values: Array
    sigma: Array
    noise: Noise

    def without(self, point: int) -> DataPoints:
        """The measurements without one: its standard deviation is infinite."""
        sigma = self.sigma.copy()
        sigma[point] = np.inf
        return replace(self, sigma=sigma)


@dataclass(frozen=True)
class Estimate:
    """The best parameters in a fit.

    Parameters
    ----------
    u : in units of the bounds, shape (p,)
    chi2 : sum of squared residuals over the variances
    excess : standard deviation between specimens, added to those of the measurements
    converged : whether the solver met its tolerance
    """

    u: Array
    chi2: float
    excess: float
    converged: bool


@dataclass(frozen=True)
class Fit:
    """A fit of a model to measurements.

    Parameters
    ----------
    status : "ok", "at_bound", "not_converged", "too_few_points", or "no_prediction" where the model has no result
        at a point
    estimate : parameters, shape (p,)
    lower, upper : ends of the intervals of 95 % by profile likelihood, shape (p,); NaN where a parameter is not
        identified; a bound where the interval reaches it
    covariance : of the parameters, shape (p, p), in the linear approximation
    identifiable : whether the measurements determine each parameter, shape (p,)
    unidentified : directions in the logarithms of the parameters (in units of the bounds for those that may be
        negative or zero) that do not change the prediction, shape (k, p)
    predicted, residual : at the points; the residual is measured minus predicted, shape (n,)
    jacobian : derivatives of the predictions by the parameters, shape (n, p)
    chi2_reduced : chi2 over the degrees of freedom; with noise "scale" the variance of the points in units of the
        given variances
    excess : see `Estimate`
    aicc : corrected information criterion of Akaike; NaN with too few points
    loo : root mean square of the residuals of each point in the fit without it, in standard deviations
    """

    status: FitStatus
    estimate: Array
    lower: Array
    upper: Array
    covariance: Array
    identifiable: Mask
    unidentified: Array
    predicted: Array
    residual: Array
    jacobian: Array
    chi2_reduced: float
    excess: float
    aicc: float
    loo: float


@dataclass(frozen=True)
class Problem:
    """A model, the bounds of its parameters and the measurements.

    `key` names the function of `impact.inverse.batch.run_together` that predicts, from rows of parameters of shape
    (k, p), values of shape (k, n).
    """

    key: str
    bounds: Bounds
    data: DataPoints

    @property
    def count(self) -> int:
        """Number of parameters."""
        return self.bounds.least.size

    @property
    def is_determined(self) -> bool:
        """Whether there are more points than parameters, of the noise too."""
        return self.data.values.size > self.count + (self.data.noise != "given")

    def predict(self, evaluate: Evaluate, u: Array) -> Array:
        """Predictions of rows u, shape (k, p) to (k, n)."""
        return evaluate(self.key, self.bounds.values(u))

    def residuals(self, evaluate: Evaluate, u: Array, sigma: Array) -> Array:
        """Residuals of rows u in standard deviations, shape (k, n)."""
        difference = (self.predict(evaluate, u) - self.data.values) / sigma
        return np.where(np.isfinite(difference), difference, NO_PREDICTION)

    def slopes(self, evaluate: Evaluate, u: Array, free: NDArray[np.intp], sigma: Array) -> Array:
        """Derivatives of the residuals by the free ones of u, shape (n, len(free)), in one evaluation."""
        low, high = np.maximum(u[free] - STEP, 0.0), np.minimum(u[free] + STEP, 1.0)
        rows = np.tile(u, (2 * free.size, 1))
        rows[np.arange(free.size), free], rows[free.size + np.arange(free.size), free] = low, high
        below, above = np.split(self.residuals(evaluate, rows, sigma), 2)
        slopes: Array = (above - below).T / (high - low)
        return slopes


def scan(problem: Problem, evaluate: Evaluate) -> Array:
    """The u that are starts of a fit: the best of a Sobol sequence, shape (STARTS, p)."""
    if not problem.count:
        return np.zeros((1, 0))
    # the sequence begins at 0; half a cell away from it, no bound is tried
    u = qmc.Sobol(problem.count, scramble=False).random(TRIED) + 0.5 / TRIED
    cost = (problem.residuals(evaluate, u, problem.data.sigma) ** 2).sum(axis=1)
    best: Array = u[np.argsort(cost, kind="stable")[:STARTS]]
    return best


def minimize(
    problem: Problem,
    evaluate: Evaluate,
    start: Array,
    *,
    fixed: int | None = None,
    excess: float | None = None,
    tolerance: float = SOLVER_TOLERANCE,
) -> Estimate:
    """The local minimum of chi2 from a start.

    Parameters
    ----------
    problem, evaluate : the problem, and the function of `run_together`
    start : u, shape (p,)
    fixed : a parameter that stays at its start; None for none
    excess : standard deviation between specimens; None to find it, if the noise asks for it
    tolerance : of the solver, relative
    """
    if problem.data.noise == "excess" and excess is None:
        return _minimize_with_excess(problem, evaluate, start)
    sigma = np.hypot(problem.data.sigma, excess or 0.0)
    free = np.array([number for number in range(problem.count) if number != fixed], np.intp)

    def full(part: Array) -> Array:
        u = start.copy()
        u[free] = part
        return u

    def residuals(part: Array) -> Array:
        (values,) = problem.residuals(evaluate, full(part)[None, :], sigma)
        return np.asarray(values)

    if not free.size:
        return Estimate(start, float(np.sum(residuals(start[free]) ** 2)), excess or 0.0, True)

    def slopes(part: Array) -> Array:
        return problem.slopes(evaluate, full(part), free, sigma)

    result = least_squares(
        residuals,
        start[free],
        jac=slopes,
        bounds=(0.0, 1.0),
        xtol=tolerance,
        ftol=tolerance,
        gtol=tolerance,
        max_nfev=MAX_EVALUATIONS,
    )
    return Estimate(full(result.x), 2.0 * float(result.cost), excess or 0.0, bool(result.success))


def _minimize_with_excess(problem: Problem, evaluate: Evaluate, start: Array) -> Estimate:
    """The minimum with the excess variance that makes chi2 the degrees of freedom (Paule and Mandel)."""
    freedom = problem.data.values.size - problem.count
    best = minimize(problem, evaluate, start, excess=0.0)
    if best.chi2 <= freedom:
        return best

    def excess_of(estimate: Estimate) -> float:
        squares = problem.residuals(evaluate, estimate.u[None, :], np.ones(1))[0] ** 2

        def surplus(variance: float) -> float:
            return float((squares / (problem.data.sigma**2 + variance)).sum()) - freedom

        return math.sqrt(brentq(surplus, 0.0, float(squares.sum()), xtol=1e-300, rtol=1e-14))

    for _ in range(MAX_EXCESS_ITERATIONS):
        excess = excess_of(best)
        before, best = best, minimize(problem, evaluate, best.u, excess=excess)
        if abs(best.excess - before.excess) <= 1e-10 * best.excess:
            return best
    return replace(best, converged=False)


def profile_end(
    problem: Problem, evaluate: Evaluate, best: Estimate, parameter: int, direction: int, rise: float, width: float
) -> float:
    """The u of a parameter at which the least chi2 over the others has risen by `rise`; at most a bound, 0 or 1.

    Parameters
    ----------
    problem, evaluate : see `minimize`
    best : the minimum
    parameter, direction : which parameter, and -1 for the lower and 1 for the upper end
    rise : of chi2
    width : expected distance from the minimum, in u
    """
    bound = 0.0 if direction < 0 else 1.0
    centre = float(best.u[parameter])
    others = best.u

    def surplus(value: float) -> float:
        nonlocal others
        start = others.copy()
        start[parameter] = value
        estimate = minimize(
            problem, evaluate, start, fixed=parameter, excess=best.excess, tolerance=COARSE_TOLERANCE
        )
        others = estimate.u
        return estimate.chi2 - best.chi2 - rise

    inner, outer = centre, centre
    for number in range(MAX_BRACKETS):
        outer = centre + direction * width * 1.5**number
        is_bound = (outer - bound) * direction >= 0.0
        outer = bound if is_bound else outer
        if surplus(outer) > 0.0:
            return float(brentq(surplus, inner, outer, xtol=PROFILE_XTOL * width, rtol=1e-12))
        if is_bound:
            return bound
        inner = outer
    return bound


def final_jacobian(problem: Problem, evaluate: Evaluate, u: Array) -> tuple[Array, Array]:
    """The predictions, shape (n,), and their derivatives by u, shape (n, p), of fourth order inside the bounds."""
    count = problem.count
    steps = np.minimum(FINAL_STEP, 0.5 * np.minimum(u, 1.0 - u))
    inside = steps > 1e-2 * FINAL_STEP
    # beside a bound one-sided differences of second order
    side = np.where(u < 0.5, FINAL_STEP, -FINAL_STEP)
    offsets = np.where(
        inside[:, None],
        steps[:, None] * np.array([-2.0, -1.0, 1.0, 2.0]),
        side[:, None] * np.array([0.0, 1.0, 2.0, 0.0]),
    )
    weights = np.where(
        inside[:, None],
        np.array([1.0, -8.0, 8.0, -1.0]) / 12.0 / np.where(inside, steps, 1.0)[:, None],
        np.array([-1.5, 2.0, -0.5, 0.0]) / side[:, None],
    )
    rows = np.tile(u, (4 * count + 1, 1))
    for parameter in range(count):
        rows[4 * parameter : 4 * parameter + 4, parameter] += offsets[parameter]
    predicted = problem.predict(evaluate, np.clip(rows, 0.0, 1.0))
    jacobian = np.einsum("pk,pkn->np", weights, predicted[:-1].reshape(count, 4, predicted.shape[1]))
    return predicted[-1], jacobian


def log_slopes(problem: Problem, u: Array) -> Array:
    """Derivative of each u by the logarithm of its parameter, or by itself where the parameter may be zero."""
    values = problem.bounds.values(u)
    positive = problem.bounds.least > 0.0
    slope: Array = np.where(positive, values / problem.bounds.slope(u), 1.0)
    return slope


def find_unidentified(jacobian: Array) -> Array:
    """Directions that change no prediction, shape (k, p), from derivatives in units of sigma, shape (n, p)."""
    if not jacobian.shape[1]:
        return np.zeros((0, 0))
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=True)
    sizes = np.concatenate([sizes, np.zeros(jacobian.shape[1] - sizes.size)])
    largest = sizes.max(initial=0.0)
    unidentified: Array = directions[sizes <= SINGULAR * largest] if largest > 0.0 else directions
    return unidentified


def information(problem: Problem, best: Estimate) -> float:
    """AICc, of the likelihood with normal errors; NaN with too few points."""
    data = problem.data
    n, parameters = data.values.size, problem.count + (data.noise != "given")
    if n - parameters - 1 <= 0:
        return math.nan
    variance = data.sigma**2 + best.excess**2
    # with a scale, that of the largest likelihood
    misfit = n * math.log(max(best.chi2, 1e-300) / n) + n if data.noise == "scale" else best.chi2
    twice = misfit + float(np.log(2.0 * np.pi * variance).sum())
    return 2.0 * parameters + twice + 2.0 * parameters * (parameters + 1) / (n - parameters - 1)


def variance_scale(problem: Problem, best: Estimate) -> float:
    """The factor of all variances, which noise "scale" finds from the misfit."""
    freedom = problem.data.values.size - problem.count
    return best.chi2 / freedom if problem.data.noise == "scale" else 1.0


def squared_quantile(problem: Problem) -> float:
    """The square of the distance of an end of an interval of 95 % in standard deviations."""
    if problem.data.noise == "given":
        return float(chi2.ppf(CONFIDENCE, 1))
    return float(t.ppf(0.5 + CONFIDENCE / 2, problem.data.values.size - problem.count)) ** 2


def best_of(estimates: Sequence[Estimate]) -> Estimate:
    """The estimate with the least chi2; of equal ones, one that converged."""
    least = min(estimate.chi2 for estimate in estimates)
    near = [estimate for estimate in estimates if estimate.chi2 <= least * (1.0 + 1e-9) + 1e-12]
    return min(near, key=lambda estimate: not estimate.converged)


@dataclass(frozen=True)
class _Minimum:
    """A minimum, with the predictions and their derivatives there."""

    problem: Problem
    best: Estimate
    predicted: Array
    jacobian: Array

    @property
    def sigma(self) -> Array:
        return np.hypot(self.problem.data.sigma, self.best.excess)

    @cached_property
    def unidentified(self) -> Array:
        """See `Fit`."""
        return find_unidentified(self._weighted * log_slopes(self.problem, self.best.u))

    @property
    def identifiable(self) -> Mask:
        identifiable: Mask = ~np.any(np.abs(self.unidentified) > INVOLVED, axis=0)
        return identifiable

    @cached_property
    def covariance(self) -> Array:
        """Covariance of u, shape (p, p); NaN for parameters without one."""
        covariance = np.full((self.problem.count,) * 2, np.nan)
        if self.problem.is_determined:
            where = np.ix_(self.identifiable, self.identifiable)
            inverse = np.linalg.pinv(self._weighted.T @ self._weighted, rcond=SINGULAR**2, hermitian=True)
            covariance[where] = (variance_scale(self.problem, self.best) * inverse)[where]
        return covariance

    @property
    def _weighted(self) -> Array:
        """The derivatives in standard deviations."""
        return np.where(np.isfinite(self.jacobian), self.jacobian, 0.0) / self.sigma[:, None]

    def end_tasks(self) -> list[Callable[[Evaluate], tuple[int, int, float]]]:
        """Find both ends of the interval of each parameter that has a variance."""
        tasks: list[Callable[[Evaluate], tuple[int, int, float]]] = []
        for parameter in np.flatnonzero(np.diag(self.covariance) > 0.0).tolist():
            quantile = squared_quantile(self.problem)
            width = math.sqrt(quantile * self.covariance[parameter, parameter])
            rise = quantile * variance_scale(self.problem, self.best)
            tasks += [
                partial(_end, self.problem, self.best, parameter, direction, rise, width) for direction in (-1, 1)
            ]
        return tasks

    def leave_one_out_tasks(self) -> list[Callable[[Evaluate], float]]:
        """Predict each point by the fit without it."""
        points = self.problem.data.values.size if self.problem.is_determined else 0
        return [partial(_prediction_without, self.problem, self.best, point) for point in range(points)]

    def result(self, ends: Iterable[tuple[int, int, float]], predictions: Sequence[float]) -> Fit:
        """The fit, from the results of both kinds of tasks."""
        problem, best = self.problem, self.best
        lower, upper = np.full(problem.count, np.nan), np.full(problem.count, np.nan)
        for parameter, direction, u in ends:
            (lower if direction < 0 else upper)[parameter] = u
        slope = problem.bounds.slope(best.u)
        freedom = problem.data.values.size - problem.count
        left_out = (
            (problem.data.values - np.array(predictions)) / self.sigma if predictions else np.array([np.nan])
        )
        return Fit(
            status=self._status(),
            estimate=problem.bounds.values(best.u),
            lower=problem.bounds.values(lower),
            upper=problem.bounds.values(upper),
            covariance=self.covariance * np.outer(slope, slope),
            identifiable=self.identifiable,
            unidentified=self.unidentified,
            predicted=self.predicted,
            residual=problem.data.values - self.predicted,
            jacobian=self.jacobian / slope,
            chi2_reduced=best.chi2 / freedom if freedom > 0 else math.nan,
            excess=best.excess,
            aicc=information(problem, best),
            loo=float(np.sqrt(np.mean(left_out**2))),
        )

    def _status(self) -> FitStatus:
        if not np.isfinite(self.predicted).all():
            return "no_prediction"
        if not self.problem.is_determined:
            return "too_few_points"
        if not self.best.converged:
            return "not_converged"
        at_bound = (np.minimum(self.best.u, 1.0 - self.best.u) <= AT_BOUND) & self.identifiable
        return "at_bound" if at_bound.any() else "ok"


def fit_all(
    problems: Sequence[Problem], functions: Mapping[str, VectorFunction], *, leave_one_out: bool = True
) -> list[Fit]:
    """The fits of problems; the starts, intervals and leave-one-out fits of all of them run at the same time.

    A fit does not depend on the other problems.

    Parameters
    ----------
    problems : the problems
    functions : predictions by the keys of the problems, see `Problem`
    leave_one_out : whether to repeat each fit without each point; otherwise `loo` is NaN
    """
    starts = run_together(functions, [partial(scan, problem) for problem in problems])
    minima = _run_each(
        functions,
        [
            [partial(_minimize, problem, start) for start in of_problem]
            for problem, of_problem in zip(problems, starts, strict=True)
        ],
    )
    best = [best_of(estimates) for estimates in minima]
    pairs = list(zip(problems, best, strict=True))
    jacobians = run_together(functions, [partial(_final_jacobian, *pair) for pair in pairs])
    found = [_Minimum(*pair, *jacobian) for pair, jacobian in zip(pairs, jacobians, strict=True)]
    ends = _run_each(functions, [minimum.end_tasks() for minimum in found])
    left_out = _run_each(functions, [minimum.leave_one_out_tasks() if leave_one_out else [] for minimum in found])
    return [minimum.result(*parts) for minimum, parts in zip(found, zip(ends, left_out, strict=True), strict=True)]


def _run_each(
    functions: Mapping[str, VectorFunction], groups: Sequence[Sequence[Callable[[Evaluate], T]]]
) -> list[list[T]]:
    """The results of groups of tasks, which all run together."""
    results = iter(run_together(functions, [task for group in groups for task in group]))
    return [[next(results) for _ in group] for group in groups]


# tasks of `run_together`, whose last argument is its function


def _minimize(problem: Problem, start: Array, evaluate: Evaluate) -> Estimate:
    return minimize(problem, evaluate, start)


def _final_jacobian(problem: Problem, best: Estimate, evaluate: Evaluate) -> tuple[Array, Array]:
    return final_jacobian(problem, evaluate, best.u)


def _end(
    problem: Problem, best: Estimate, parameter: int, direction: int, rise: float, width: float, evaluate: Evaluate
) -> tuple[int, int, float]:
    return parameter, direction, profile_end(problem, evaluate, best, parameter, direction, rise, width)


def _prediction_without(problem: Problem, best: Estimate, point: int, evaluate: Evaluate) -> float:
    """The prediction of a point by the fit without it."""
    part = replace(problem, data=problem.data.without(point))
    estimate = minimize(part, evaluate, best.u, excess=best.excess, tolerance=COARSE_TOLERANCE)
    return float(problem.predict(evaluate, estimate.u[None, :])[0, point])
