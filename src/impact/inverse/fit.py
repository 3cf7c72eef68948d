"""Least-squares fits: parameters, profile-likelihood intervals, information criteria, identifiability.

The errors of measurements are normal. With noise "excess" those of one specimen share a deviation: a linear mixed
model, whose covariance is V = diag(sigma^2) + tau^2 Z Z^T, where Z has a column of ones and zeros for each
specimen. Laws are compared by the largest likelihood of the parameters and tau. Estimates and intervals have tau
from the restricted likelihood, since the largest likelihood underestimates it, and quantiles of Student's t with
Satterthwaite's degrees of freedom. The solver is the trust region reflective method of
`scipy.optimize.least_squares` (Branch, Coleman and Li 1999, SIAM Journal on Scientific Computing 21, 1-23),
started at the best points of a Sobol sequence in the bounds. The formulas are derived here; tests compare them
with closed forms of linear regression and with simulations.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from scipy.optimize import brentq, least_squares
from scipy.stats import chi2, qmc, t

from ..array_types import Array, Indices, Mask
from ..config.tables import Loss, Noise
from .batched_solvers import Evaluate, VectorFunction, run_together

FitStatus: TypeAlias = Literal["ok", "at_bound", "not_converged", "too_few_points", "no_prediction", "at_limit"]

T = TypeVar("T")

# points of a Sobol sequence in the bounds that are tried first, and how many of them are starts
N_SCAN, N_STARTS = 128, 4
# an interval of bounds with a larger ratio is searched on a logarithmic scale
LOG_RATIO = 100.0
MAX_EVALUATIONS = 200
# of a fit, and of the fits with a fixed parameter or without a point, which need fewer digits
SOLVER_TOLERANCE, COARSE_TOLERANCE = 1e-13, 1e-7
# step of the finite differences of a fit, and that of fourth order of the final Jacobian, in units of the bounds
STEP, FINAL_STEP = 1e-5, 1e-3
# a residual where a model has no result, in standard deviations
NO_PREDICTION = 1e6
# a parameter this near to a bound, in units of the bounds, is at it
AT_BOUND = 1e-7
# a direction of the parameters that changes the prediction less than this share of the strongest is not identified
RANK_RTOL = 1e-5
# nor is one that changes it by less than this share of the prediction itself: what is left are rounding errors
ROUNDING_RTOL = 1e-9
# share of a parameter in such a direction from which on it is not identified
PARTICIPATION_TOL = 1e-3
CONFIDENCE = 0.95
# a fit that leaves a smaller share of a point free passes through it, and the point has no residual without it
LEVERAGE_LEFT = 1e-9
# bracketing steps of an end of a profile interval, and its relative accuracy
MAX_BRACKETS, PROFILE_XTOL = 30, 1e-6
# iterations of the excess deviation and of the parameters with it, and when they end
MAX_EXCESS_ITERATIONS, EXCESS_TOLERANCE, COARSE_EXCESS_TOLERANCE = 50, 1e-10, 1e-6
# excess variances that are tried first, in units of the largest deviation of a specimen squared
SCANNED_EXCESS = np.concatenate([[0.0], np.geomspace(1e-8, 10.0, 64)])


@dataclass(frozen=True)
class Bounds:
    """Bounds of parameters, shape (p,), and their scale u in [0, 1]: logarithmic if positive and far apart."""

    lower: Array
    upper: Array
    # shape (2, p): whether each bound is an end of the allowed values, not only of the search
    is_limit: Mask | None = None

    @cached_property
    def is_log(self) -> Mask:
        positive = self.lower > 0.0
        ratio = np.divide(self.upper, self.lower, out=np.ones_like(self.upper), where=positive)
        return positive & (ratio > LOG_RATIO)

    def values(self, u: Array) -> Array:
        """Convert rows u to parameters, shape (..., p)."""
        lower, upper = (np.where(self.is_log, bound, 1.0) for bound in (self.lower, self.upper))
        between = self.lower + u * (self.upper - self.lower)
        # a bound is met exactly
        between = np.where(u == 1.0, self.upper, between)
        return np.where(self.is_log, np.clip(lower * (upper / lower) ** u, lower, upper), between)

    def slope(self, u: Array) -> Array:
        """Differentiate each parameter by its u, shape (p,)."""
        lower, upper = np.where(self.is_log, self.lower, 1.0), np.where(self.is_log, self.upper, np.e)
        return np.where(self.is_log, self.values(u) * np.log(upper / lower), self.upper - self.lower)


@dataclass(frozen=True)
class DataPoints:
    """Measured values with their standard deviations, each of shape (n,)."""

    values: Array
    sigma: Array
    noise: Noise
    # numbers from 0, shape (n,); None if each point has its own specimen
    specimens: Indices | None = None
    loss: Loss = "linear"

    def specimen_sums(self, values: Array) -> Array:
        """Sum over the points of each specimen, shape (..., n) to (..., specimens)."""
        if self.specimens is None:
            return values
        sums = np.zeros((*values.shape[:-1], int(self.specimens.max()) + 1))
        np.add.at(sums.T, self.specimens, values.T)
        return sums

    def at_points(self, values: Array) -> Array:
        """Spread values of specimens to their points, shape (..., specimens) to (..., n)."""
        return values if self.specimens is None else values[..., self.specimens]

    @cached_property
    def precision(self) -> Array:
        """Sum 1/sigma^2 over the points of each specimen, shape (specimens,)."""
        return self.specimen_sums(self.sigma**-2.0)

    def whiten(self, scaled: Array, excess: float) -> Array:
        """Compute independent residuals with a variance of 1: V^(-1/2) r, shape (..., n), from r/sigma."""
        if excess == 0.0:
            return scaled
        p = self.precision
        shrink = 1.0 / np.sqrt(1.0 + excess**2 * p)
        if self.specimens is None:
            return scaled * shrink
        # what the points of a specimen share gets smaller
        shared = self.specimen_sums(scaled / self.sigma) / np.where(p > 0.0, p, 1.0)
        return scaled - self.at_points((1.0 - shrink) * shared) / self.sigma


@dataclass(frozen=True)
class Estimate:
    """The best parameters in a fit."""

    u: Array
    objective: float
    excess: float
    converged: bool


@dataclass(frozen=True)
class Fit:
    """The fit of a model with p parameters to n measurements.

    Parameters
    ----------
    status : "at_limit" at an end of the allowed values of a parameter, "at_bound" at one of the search alone
    estimate : parameters, shape (p,)
    lower, upper : ends of the intervals of 95 % by profile likelihood, shape (p,); NaN where a parameter is not
        identified; a bound where the interval reaches it
    covariance : of the parameters in the linear approximation, shape (p, p)
    identifiable : whether the measurements determine each parameter, shape (p,)
    unidentified : directions in the logarithms of the parameters (in units of the bounds for those that may be
        negative or zero) that do not change the prediction, shape (k, p)
    predicted, residual : at the points; the residual is measured minus predicted, shape (n,)
    jacobian : derivatives of the predictions by the parameters, shape (n, p)
    other_predicted, other_half_width : the other values that the final function predicts, and the half-widths of
        their intervals of 95 %, without the noise, shape (k,)
    chi2_reduced : with noise "scale" the variance of the points in units of the given variances
    p_value : probability of a larger chi2; NaN where the noise is estimated from the residuals, and for
        another loss than "linear"
    aicc : corrected information criterion of Akaike; NaN with too few points
    loo : root mean square of the residuals of each point in the fit without it, in its given standard deviations
    loo_residual : those residuals in their own standard deviations, in the linear approximation, shape (n,)
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
    other_predicted: Array
    other_half_width: Array
    chi2_reduced: float
    p_value: float
    excess: float
    aicc: float
    loo: float
    loo_residual: Array


@dataclass(frozen=True)
class FitProblem:
    """A model with parameters in bounds, and the measurements."""

    # predicts from rows of parameters, shape (k, p) to (k, n)
    function: VectorFunction
    bounds: Bounds
    data: DataPoints
    # for the final predictions and their derivatives, which may predict more values than are measured, after
    # these; None for the same
    final_function: VectorFunction | None = None

    @property
    def count(self) -> int:
        """Count the parameters."""
        return self.bounds.lower.size

    @property
    def is_determined(self) -> bool:
        """Whether there are more points than parameters, of the noise too."""
        return self.data.values.size > self.count + (self.data.noise != "given")

    def predict(self, evaluate: Evaluate, u: Array) -> Array:
        """Predict the measurements from rows u, shape (k, p) to (k, n)."""
        return evaluate(self.function, self.bounds.values(u))

    def scale(self, predicted: Array) -> Array:
        """Subtract the measurements from predictions, in given standard deviations, shape (..., n)."""
        difference = (predicted - self.data.values) / self.data.sigma
        return np.where(np.isfinite(difference), difference, NO_PREDICTION)

    def residuals(self, evaluate: Evaluate, u: Array, excess: float = 0.0) -> Array:
        """Compute the independent residuals of rows u in standard deviations, shape (k, n)."""
        return self.data.whiten(self.scale(self.predict(evaluate, u)), excess)

    def residuals_and_slopes(
        self, evaluate: Evaluate, u: Array, free: Indices, excess: float
    ) -> tuple[Array, Array]:
        """Compute the residuals, shape (n,), and their derivatives by the free ones of u, shape (n, len(free)).

        They are evaluated together, since a solver asks for both at every u.
        """
        low, high = np.maximum(u[free] - STEP, 0.0), np.minimum(u[free] + STEP, 1.0)
        rows = np.tile(u, (2 * free.size + 1, 1))
        rows[np.arange(free.size), free], rows[free.size + np.arange(free.size), free] = low, high
        *others, residuals = self.residuals(evaluate, rows, excess)
        below, above = np.split(np.array(others), 2)
        return residuals, (above - below).T / (high - low)


def scan(problem: FitProblem, evaluate: Evaluate) -> Array:
    """Find the starts u of a fit: the best of a Sobol sequence, shape (N_STARTS, p)."""
    if not problem.count:
        return np.zeros((1, 0))
    # the sequence begins at 0; half a cell away from it, no bound is tried
    u = qmc.Sobol(problem.count, scramble=False).random(N_SCAN) + 0.5 / N_SCAN
    cost = (problem.residuals(evaluate, u) ** 2).sum(axis=1)
    # of points as good as each other, such as those beyond which a parameter changes nothing, the first
    order = np.argsort(cost, kind="stable")
    is_other = np.diff(cost[order], prepend=-np.inf) > 1e-9 * cost[order]
    return np.asarray(u[order[is_other | (cost[order] == 0.0)][:N_STARTS]])


def minimize(
    problem: FitProblem,
    start: Array,
    evaluate: Evaluate,
    *,
    fixed: int | None = None,
    excess: float | None = None,
    taken: Array | None = None,
    tolerance: float = SOLVER_TOLERANCE,
) -> Estimate:
    """Find the local minimum of the objective from a start u, at which the parameter `fixed` stays."""
    if problem.data.noise == "excess" and excess is None:
        # over the parameters and the excess deviation in turn: their information is independent
        accuracy = COARSE_EXCESS_TOLERANCE if tolerance >= COARSE_TOLERANCE else EXCESS_TOLERANCE
        best = Estimate(start, math.inf, -1.0, False)
        for _ in range(MAX_EXCESS_ITERATIONS):
            (scaled,) = problem.residuals(evaluate, best.u[None, :])
            likelihood = ExcessLikelihood(problem.data, scaled, taken)
            excess = likelihood.best()
            if abs(excess - best.excess) <= accuracy * excess:
                return replace(best, objective=likelihood.objective(best.excess**2))
            best = minimize(problem, best.u, evaluate, fixed=fixed, excess=excess, tolerance=tolerance)
        return replace(best, objective=likelihood.objective(best.excess**2), converged=False)
    excess = excess or 0.0
    free = np.array([number for number in range(problem.count) if number != fixed], np.intp)

    def full(free_u: Array) -> Array:
        u = start.copy()
        u[free] = free_u
        return u

    if not free.size:
        (values,) = problem.residuals(evaluate, start[None, :], excess)
        loss, *_ = LOSS_DERIVATIVES[problem.data.loss](values)
        return Estimate(start, float(loss.sum()), excess, True)

    @lru_cache(maxsize=1)
    def both(free_u: bytes) -> tuple[Array, Array]:
        return problem.residuals_and_slopes(evaluate, full(np.frombuffer(free_u)), free, excess)

    def one_of_both(number: int, free_u: Array) -> Array:
        # the solver scales in place what it gets
        return both(free_u.tobytes())[number].copy()

    result = least_squares(
        partial(one_of_both, 0),
        # at a bound the first trust region would be as small as the distance from it, and end the search
        np.clip(start[free], FINAL_STEP, 1.0 - FINAL_STEP),
        jac=partial(one_of_both, 1),
        bounds=(0.0, 1.0),
        xtol=tolerance,
        ftol=tolerance,
        # unlike the others it is not relative, and residuals may be small
        gtol=SOLVER_TOLERANCE,
        loss=problem.data.loss,
        max_nfev=MAX_EVALUATIONS,
    )
    # the solver stays inside the bounds, and a parameter at a bound is on it
    nearest = np.round(result.x)
    free_u = np.where(np.abs(result.x - nearest) <= AT_BOUND, nearest, result.x)
    return Estimate(full(free_u), 2.0 * float(result.cost), excess, bool(result.success))


class ExcessLikelihood:
    """The likelihood of residuals over sigma, shape (n,), as a function of the excess variance.

    It is the restricted one if `taken` are the orthonormal directions that the parameters take up, shape (n, r).
    """

    def __init__(self, data: DataPoints, scaled: Array, taken: Array | None = None) -> None:
        self.data, self.scaled = data, scaled
        self.taken = np.zeros((0, scaled.size)) if taken is None else taken.T
        self.deviation, self.taken_sums = (data.specimen_sums(z / data.sigma) for z in (scaled, self.taken))

    def objective(self, variance: float) -> float:
        """Compute minus twice the log likelihood, without the part that sigma alone determines."""
        white = self.data.whiten(self.scaled, math.sqrt(variance))
        growth = 1.0 + variance * self.data.precision
        sign, determinant = np.linalg.slogdet(self._left(variance))
        return float(white @ white + np.log(growth).sum() + determinant) if sign > 0.0 else math.inf

    def slope(self, variance: float) -> float:
        """Differentiate the objective by the variance."""
        growth = 1.0 + variance * self.data.precision
        change = np.linalg.pinv(self._left(variance)) @ (self.taken_sums / growth**2) @ self.taken_sums.T
        return float((self.data.precision / growth - (self.deviation / growth) ** 2).sum() - np.trace(change))

    def _left(self, variance: float) -> Array:
        """Compute Q^T V^(-1) Q in units of the given variances, where Q are the directions taken."""
        white = self.data.whiten(self.taken, math.sqrt(variance))
        return white @ white.T

    def best(self) -> float:
        """Find the standard deviation between specimens of the largest likelihood."""
        largest = (self.deviation / np.where(self.data.precision > 0.0, self.data.precision, 1.0)) ** 2
        tried = SCANNED_EXCESS * largest.max()
        number = int(np.argmin([self.objective(variance) for variance in tried]))
        low, high = tried[max(number - 1, 0)], tried[min(number + 1, tried.size - 1)]
        if not self.slope(low) < 0.0 < self.slope(high):
            return math.sqrt(tried[number])
        return math.sqrt(brentq(self.slope, low, high, xtol=1e-300, rtol=1e-14))


def _huber(z: Array) -> tuple[Array, Array, Array]:
    size = np.abs(z)
    return np.where(size <= 1.0, z**2, 2.0 * size - 1.0), np.clip(z, -1.0, 1.0), np.where(size <= 1.0, 1.0, 0.0)


# the loss of residuals, half its derivative, and half its second derivative
LOSS_DERIVATIVES: Mapping[str, Callable[[Array], tuple[Array, Array, Array]]] = {
    "linear": lambda z: (z**2, z, np.ones_like(z)),
    "huber": _huber,
    "cauchy": lambda z: (np.log1p(z**2), z / (1.0 + z**2), (1.0 - z**2) / (1.0 + z**2) ** 2),
}


def final_jacobian(problem: FitProblem, evaluate: Evaluate, u: Array) -> tuple[Array, Array]:
    """Predict by the final function, shape (n,), with derivatives by u, shape (n, p), of fourth order inside."""
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
    function = problem.final_function or problem.function
    predicted = evaluate(function, problem.bounds.values(np.clip(rows, 0.0, 1.0)))
    jacobian = np.einsum("pk,pkn->np", weights, predicted[:-1].reshape(count, 4, predicted.shape[1]))
    return predicted[-1], jacobian


def degrees_of_freedom(variance: Array, deviation: Array) -> Array:
    """Estimate Satterthwaite's degrees of freedom of variances with these standard deviations, at least 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        freedom = np.where(deviation > 0.0, 2.0 * (variance / deviation) ** 2, np.inf)
    return np.maximum(freedom, 1.0)


def t_quantile(freedom: Array) -> Array:
    """Find the distance of an end of an interval of 95 % from the estimate, in standard deviations."""
    return np.asarray(t.ppf(0.5 + CONFIDENCE / 2, freedom))


def best_of(estimates: Sequence[Estimate]) -> Estimate:
    """Choose the estimate with the least objective; of equal ones, one that converged."""
    least = min(estimate.objective for estimate in estimates)
    near = [estimate for estimate in estimates if estimate.objective <= least + 1e-9 * abs(least) + 1e-12]
    return min(near, key=lambda estimate: not estimate.converged)


@dataclass(frozen=True)
class _Minimum:
    """A minimum of the objective, and the statistics of the fit there."""

    problem: FitProblem
    # of the largest likelihood; with noise "excess" the minimum is that of the restricted one
    objective: float
    best: Estimate
    # the measurements and the other values that the final function predicts, and their derivatives by u
    all_predicted: Array
    all_slopes: Array

    @property
    def predicted(self) -> Array:
        """Predict the measurements, shape (n,)."""
        return self.all_predicted[: self.problem.data.values.size]

    @cached_property
    def scaled_jacobian(self) -> Array:
        """Scale the derivatives of the measurements to given standard deviations, shape (n, p)."""
        slopes = self.all_slopes[: self.problem.data.values.size]
        return np.where(np.isfinite(slopes), slopes, 0.0) / self.problem.data.sigma[:, None]

    @cached_property
    def scaled_residual(self) -> Array:
        """Subtract the measurements, in given standard deviations, shape (n,)."""
        return self.problem.scale(self.predicted)

    @cached_property
    def white_jacobian(self) -> Array:
        """Differentiate the independent residuals, shape (n, p)."""
        return self.problem.data.whiten(self.scaled_jacobian.T, self.best.excess).T

    @cached_property
    def white_residual(self) -> Array:
        """Compute the independent residuals, shape (n,)."""
        return self.problem.data.whiten(self.scaled_residual, self.best.excess)

    @cached_property
    def unidentified(self) -> Array:
        bounds, u = self.problem.bounds, self.best.u
        # by the logarithm of each parameter, or by itself where it may be zero
        slope = np.where(bounds.lower > 0.0, bounds.values(u) / bounds.slope(u), 1.0)
        _, sizes, directions = np.linalg.svd(self.white_jacobian * slope, full_matrices=True)
        sizes = np.concatenate([sizes, np.zeros(slope.size - sizes.size)])
        rounding = ROUNDING_RTOL * np.linalg.norm(np.nan_to_num(self.predicted / self.problem.data.sigma))
        return np.asarray(directions[sizes <= max(RANK_RTOL * sizes.max(initial=0.0), rounding)])

    @property
    def identifiable(self) -> Mask:
        return np.asarray(~np.any(np.abs(self.unidentified) > PARTICIPATION_TOL, axis=0))

    @property
    def n_determined(self) -> int:
        """Count the independent combinations of parameters that the measurements determine."""
        return self.problem.count - len(self.unidentified)

    @property
    def freedom(self) -> int:
        return self.problem.data.values.size - self.n_determined

    @cached_property
    def variance_factors(self) -> tuple[float, float]:
        """Estimate the factors of the covariance and of the rise of the objective from the residuals."""
        data = self.problem.data
        if data.noise == "scale":
            return (self.best.objective / max(self.freedom, 1),) * 2
        if data.loss == "linear":
            return 1.0, 1.0
        # an M-estimate: means of the squared first and of the second derivative of the loss
        _, slope, curvature = LOSS_DERIVATIVES[data.loss](self.white_residual)
        squares, mean = float(slope @ slope) / max(self.freedom, 1), float(curvature.mean())
        return (squares / mean**2, squares / mean) if mean > 0.0 else (math.nan, math.nan)

    @property
    def aicc(self) -> float:
        """Compute the AICc of the largest likelihood with normal errors, or of a loss; NaN with too few points."""
        data, misfit = self.problem.data, self.objective
        n, parameters = data.values.size, self.n_determined + (data.noise != "given")
        if not self.problem.is_determined or n - parameters - 1 <= 0:
            return math.nan
        if data.noise == "scale":
            # that of the largest likelihood
            misfit = n * math.log(max(misfit, 1e-300) / n) + n
        twice = misfit + float(np.log(2.0 * np.pi * data.sigma**2).sum())
        return 2.0 * parameters + twice + 2.0 * parameters * (parameters + 1) / (n - parameters - 1)

    @cached_property
    def inverse(self) -> Array:
        """Invert J^T V^(-1) J without the directions that are not identified, shape (p, p)."""
        information = self.white_jacobian.T @ self.white_jacobian
        return np.asarray(np.linalg.pinv(information, rcond=RANK_RTOL**2, hermitian=True), float)

    @cached_property
    def covariance(self) -> Array:
        """Estimate the covariance of u, shape (p, p); NaN for parameters without one."""
        covariance = np.full((self.problem.count,) * 2, np.nan)
        if self.problem.is_determined:
            block = np.ix_(self.identifiable, self.identifiable)
            covariance[block] = (self.variance_factors[0] * self.inverse)[block]
        return covariance

    @cached_property
    def covariance_deviation(self) -> Array:
        """Estimate the standard deviation of the covariance of u, shape (p, p)."""
        data = self.problem.data
        if data.noise == "scale" or data.loss != "linear":
            return self.covariance * math.sqrt(2.0 / max(self.freedom, 1))
        if data.noise == "given":
            return np.zeros_like(self.covariance)
        # J^T V^(-1) Z, and the diagonal of Z^T V^(-1) Z
        growth = 1.0 + self.best.excess**2 * data.precision
        cross = data.specimen_sums(self.scaled_jacobian.T / data.sigma) / growth
        diagonal = data.precision / growth
        product, leverage = cross @ cross.T @ self.inverse, np.einsum("pg,pq,qg->g", cross, self.inverse, cross)
        # half of this is the information of the restricted likelihood about the variance between specimens
        information = float((diagonal**2 - 2.0 * diagonal * leverage).sum() + np.trace(product @ product))
        return np.asarray(self.inverse @ product * math.sqrt(2.0 / max(information, 1e-300)))

    @cached_property
    def taken(self) -> Array | None:
        if self.problem.data.noise != "excess":
            return None
        left, sizes, _ = np.linalg.svd(self.scaled_jacobian, full_matrices=False)
        return np.asarray(left[:, sizes > RANK_RTOL * sizes.max(initial=0.0)])

    def end_tasks(self) -> list[Callable[[Evaluate], float]]:
        """Find both ends of the interval of each parameter that has a variance."""
        tasks: list[Callable[[Evaluate], float]] = []
        variances = np.diag(self.covariance)
        freedom = degrees_of_freedom(variances, np.diag(self.covariance_deviation))
        quantiles, best = t_quantile(freedom), self.best
        rises = quantiles**2 * self.variance_factors[1]
        if self.taken is not None:
            likelihood = ExcessLikelihood(self.problem.data, self.scaled_residual, self.taken)
            best = replace(best, objective=likelihood.objective(best.excess**2))
            # minus twice a likelihood that is profiled over a variance, at a quantile of Student's t
            finite = np.isfinite(freedom)
            rises[finite] = freedom[finite] * np.log1p(rises[finite] / freedom[finite])
        for parameter in np.flatnonzero(variances > 0.0).tolist():
            width = float(quantiles[parameter] * math.sqrt(variances[parameter]))
            end = partial(self._end, best, parameter, float(rises[parameter]), width)
            tasks += [partial(end, direction) for direction in (-1, 1)]
        return tasks

    def _end(
        self, best: Estimate, parameter: int, rise: float, width: float, direction: int, evaluate: Evaluate
    ) -> float:
        """Find the u, about `width` from the best, where the least objective over the others is `rise` higher."""
        bound = 0.0 if direction < 0 else 1.0
        inner = centre = float(best.u[parameter])
        # a root finder needs a function: a search from another start may end elsewhere
        known = {centre: (-rise, best.u)}
        search = partial(minimize, self.problem, fixed=parameter, taken=self.taken, tolerance=COARSE_TOLERANCE)

        def surplus(value: float) -> float:
            if value not in known:
                start = known[min(known, key=lambda other: abs(other - value))][1].copy()
                start[parameter] = value
                estimate = search(start, evaluate=evaluate)
                known[value] = estimate.objective - best.objective - rise, estimate.u
            return known[value][0]

        for number in range(MAX_BRACKETS):
            outer = min(max(centre + direction * width * 1.5**number, 0.0), 1.0)
            if surplus(outer) > 0.0:
                return float(brentq(surplus, inner, outer, xtol=PROFILE_XTOL * min(width, 1.0), rtol=1e-12))
            if outer == bound:
                break
            inner = outer
        return bound

    @cached_property
    def loo_residual(self) -> Array:
        """See `Fit`: (V^(-1) r)_i over the root of P_ii; P = V^(-1) - V^(-1) J C J^T V^(-1) with the inverse C."""
        data, excess = self.problem.data, self.best.excess
        precision = excess**2 / (1.0 + excess**2 * data.precision)
        leverage = data.whiten(self.white_jacobian.T, excess)
        left = 1.0 - data.at_points(precision) / data.sigma**2
        left = left - np.einsum("pn,pq,qn->n", leverage, self.inverse, leverage)
        with np.errstate(divide="ignore", invalid="ignore"):
            residual = -data.whiten(self.white_residual, excess) / np.sqrt(left)
            if data.noise == "scale":
                # the scale of the fit without the point
                residual = residual / math.sqrt(self.variance_factors[0])
                residual = residual * np.sqrt((self.freedom - 1.0) / (self.freedom - residual**2))
        return np.where(left > LEVERAGE_LEFT, residual, np.nan)

    def leave_one_out_tasks(self) -> list[Callable[[Evaluate], float]]:
        """Predict each point by the fit without it."""
        points = self.problem.data.values.size if self.problem.is_determined else 0
        return [partial(_prediction_without, self.problem, self.best, point) for point in range(points)]

    def result(self, ends: Sequence[float], predictions: Sequence[float]) -> Fit:
        """Collect the fit, with the results of both kinds of tasks."""
        problem, best = self.problem, self.best
        lower, upper = intervals = np.full((2, problem.count), np.nan)
        intervals[:, np.diag(self.covariance) > 0.0] = np.reshape(ends, (-1, 2)).T
        slope = problem.bounds.slope(best.u)
        data, squares = problem.data, float(self.white_residual @ self.white_residual)
        covariance, deviation = (
            matrix * np.outer(slope, slope) for matrix in (self.covariance, self.covariance_deviation)
        )
        jacobian, other_slopes = np.split(self.all_slopes / slope, [data.values.size])
        half_width = np.full(len(other_slopes), np.nan)
        if np.isfinite(covariance).all() and problem.is_determined:
            variance, spread = (
                np.maximum(np.einsum("kp,pq,kq->k", other_slopes, matrix, other_slopes), 0.0)
                for matrix in (covariance, deviation)
            )
            half_width = t_quantile(degrees_of_freedom(variance, spread)) * np.sqrt(variance)
        # a robust loss allows residuals that the noise alone does not give
        has_p = problem.is_determined and data.noise == "given" and data.loss == "linear"
        left_out = (data.values - np.array(predictions)) / data.sigma if predictions else np.array([np.nan])
        return Fit(
            status=self._status(),
            estimate=problem.bounds.values(best.u),
            lower=problem.bounds.values(lower),
            upper=problem.bounds.values(upper),
            covariance=covariance,
            identifiable=self.identifiable,
            unidentified=self.unidentified,
            predicted=self.predicted,
            residual=data.values - self.predicted,
            jacobian=jacobian,
            other_predicted=self.all_predicted[data.values.size :],
            other_half_width=half_width,
            chi2_reduced=squares / self.freedom if data.values.size > problem.count else math.nan,
            p_value=float(chi2.sf(squares, self.freedom)) if has_p else math.nan,
            excess=best.excess,
            aicc=self.aicc,
            loo=float(np.sqrt(np.mean(left_out**2))),
            loo_residual=self.loo_residual if problem.is_determined else np.full(data.values.size, np.nan),
        )

    def _status(self) -> FitStatus:
        if not np.isfinite(self.predicted).all():
            return "no_prediction"
        if not self.problem.is_determined:
            return "too_few_points"
        if not self.best.converged:
            return "not_converged"
        at_bound = (np.stack([self.best.u, 1.0 - self.best.u]) <= AT_BOUND) & self.identifiable
        if not at_bound.any():
            return "ok"
        is_limit = self.problem.bounds.is_limit
        return "at_bound" if is_limit is None or (at_bound & ~is_limit).any() else "at_limit"


def fit_all(problems: Sequence[FitProblem], *, leave_one_out: bool = True) -> list[Fit]:
    """Fit problems at the same time; a fit does not depend on the other problems."""
    starts = run_together([partial(scan, problem) for problem in problems])
    with_starts = zip(problems, starts, strict=True)
    minima = _run_each([[partial(minimize, problem, start) for start in some] for problem, some in with_starts])
    pairs = zip(problems, map(best_of, minima), strict=True)
    fits = run_together([partial(_minimum, *pair) for pair in pairs])
    ends = _run_each([minimum.end_tasks() for minimum in fits])
    left_out = _run_each([minimum.leave_one_out_tasks() if leave_one_out else [] for minimum in fits])
    return [minimum.result(*parts) for minimum, parts in zip(fits, zip(ends, left_out, strict=True), strict=True)]


def _run_each(groups: Sequence[Sequence[Callable[[Evaluate], T]]]) -> list[list[T]]:
    """Run groups of tasks, all at the same time."""
    results = iter(run_together([task for group in groups for task in group]))
    return [[next(results) for _ in group] for group in groups]


def _minimum(problem: FitProblem, best: Estimate, evaluate: Evaluate) -> _Minimum:
    """Evaluate the minimum of a problem, from that of the likelihood."""
    minimum = _Minimum(problem, best.objective, best, *final_jacobian(problem, evaluate, best.u))
    for parameter in np.flatnonzero(~minimum.identifiable):
        # all starts may be beyond the value from which on it changes nothing
        rows = np.tile(best.u, (N_SCAN + 1, 1))
        rows[1:, parameter] = (np.arange(N_SCAN) + 0.5) / N_SCAN
        cost = (problem.residuals(evaluate, rows) ** 2).sum(axis=1)
        if cost.min() < (1.0 - 1e-9) * cost[0]:
            best = best_of([best, minimize(problem, rows[cost.argmin()], evaluate)])
    if best is not minimum.best:
        minimum = _Minimum(problem, best.objective, best, *final_jacobian(problem, evaluate, best.u))
    if minimum.taken is None:
        return minimum
    restricted = minimize(problem, best.u, evaluate, taken=minimum.taken)
    return _Minimum(problem, best.objective, restricted, *final_jacobian(problem, evaluate, restricted.u))


def _prediction_without(problem: FitProblem, best: Estimate, point: int, evaluate: Evaluate) -> float:
    """Predict a point by the fit without it: its standard deviation is infinite."""
    sigma = problem.data.sigma.copy()
    sigma[point] = np.inf
    others = replace(problem, data=replace(problem.data, sigma=sigma))
    estimate = minimize(others, best.u, evaluate, excess=best.excess, tolerance=COARSE_TOLERANCE)
    return float(problem.predict(evaluate, estimate.u[None, :])[0, point])
