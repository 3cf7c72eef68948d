"""Summarize a result of any size: counts by status, largest errors, first failures, extremes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, Status
from .schema import parts_of_models
from .slabs import MAX_SUMMARY_POINTS, distinct_points, is_computed, slabs

# the errors of which the largest is told
ERROR_VARIABLES = ("e_error", "v1_error", "v2_error", "closed_form_error", "energy_residual")
MAX_FAILED_AT = 3
# of the smaller radius, above which an indentation is not small
MAX_SMALL_INDENTATION = 0.1


@dataclass
class Summary:
    """What came out.

    Parameters
    ----------
    points : how many
    counts : points by status
    worst : the largest absolute value by error, then by the place of the model; NaN where there is none, and
        missing where it was not evaluated
    failed_at : the first points that failed: status, place of the model, and places on the axes
    max_failed_at : how many of these are kept
    not_counted : how many points have a status that was not evaluated
    deep, deepest : how many points have a peak indentation above `MAX_SMALL_INDENTATION`, and the largest one, in
        units of the smaller radius; of points whose radii are known
    """

    points: int = 0
    counts: dict[Status, int] = field(default_factory=dict)
    worst: dict[str, dict[int, float]] = field(default_factory=dict)
    failed_at: list[tuple[Status, int, tuple[int, ...]]] = field(default_factory=list)
    max_failed_at: int = field(default=MAX_FAILED_AT, compare=False)
    not_counted: int = 0
    # a file does not hold the radii, so that these are known after a sweep only
    deep: int = field(default=0, compare=False)
    deepest: float = field(default=0.0, compare=False)

    @property
    def failed(self) -> int:
        return sum(count for status, count in self.counts.items() if status >= FIRST_FAILURE)

    def add(
        self,
        values: Mapping[str, NDArray[Any]],
        model: int,
        start: Sequence[int],
        radius: NDArray[Any] | None = None,
        weight: int = 1,
    ) -> Summary:
        """Count some points of one model.

        Parameters
        ----------
        values : by variable, all of one shape; without a status nothing is counted but the errors
        model : place of the model
        start : place of the first point along each axis
        radius : of the smaller ball [m], NaN where it is not known; its shape broadcasts to that of the values
        weight : how many points of the result each of these stands for
        """
        if "status" in values:
            self._count(values["status"], model, start, weight)
        for name in ERROR_VARIABLES:
            if name in values:
                self._judge(name, model, values[name])
        if radius is not None and "peak_indentation" in values:
            self._measure(values["peak_indentation"], radius, weight)
        return self

    def _measure(self, indentation: NDArray[Any], radius: NDArray[Any], weight: int) -> None:
        if np.isfinite(radius).any():
            share = indentation / (radius if indentation.shape else radius.reshape(()))
            self.deep += weight * int(np.count_nonzero(share > MAX_SMALL_INDENTATION))
            self.deepest = float(np.fmax.reduce(share, axis=None, initial=self.deepest))

    def _count(self, status: NDArray[np.int8], model: int, start: Sequence[int], weight: int) -> None:
        self.points += weight * status.size
        times = np.bincount(status.reshape(-1))
        for number in np.flatnonzero(times).tolist():
            status_code = Status(number)
            self.counts[status_code] = self.counts.get(status_code, 0) + weight * int(times[number])
        if times[FIRST_FAILURE:].any() and len(self.failed_at) < self.max_failed_at:
            for at in np.argwhere(status >= FIRST_FAILURE)[: self.max_failed_at - len(self.failed_at)].tolist():
                places = tuple(first + offset for first, offset in zip(start, at, strict=True))
                self.failed_at.append((Status(int(status[tuple(at)])), model, places))

    def _judge(self, name: str, model: int, values: NDArray[Any]) -> None:
        largest = float(np.fmax.reduce(np.abs(values), axis=None, initial=np.nan))
        by_model = self.worst.setdefault(name, {})
        by_model[model] = float(np.fmax(by_model.get(model, np.nan), largest))


def summarize(
    dataset: xr.Dataset, max_failed_at: int = MAX_FAILED_AT, max_points: float = MAX_SUMMARY_POINTS
) -> Summary:
    """What came out, of a result of any size.

    Each variable is evaluated over the axes along which it varies, one model after another, and each of its points
    counts as often as it occurs. One that is computed and varies over more than `max_points` points is not
    evaluated: a worst error is then missing, and of a status the points are `not_counted`. What is read from a
    file is read in any case.

    Parameters
    ----------
    dataset : a result
    max_failed_at : how many of the first failed points are kept: in C order, those that differ, at the first place
        along each axis on which the status does not vary
    max_points : of a variable that is computed, for one model
    """
    summary = Summary(max_failed_at=max_failed_at)
    names = [name for name in ("status", *ERROR_VARIABLES) if name in dataset]
    for model, of_model in enumerate(parts_of_models(dataset)):
        for name in names:
            variable, weight = distinct_points(of_model, name)
            if variable.size <= max_points or not is_computed(variable):
                for where in slabs(variable.sizes):
                    start = [where[dim].start for dim in variable.dims]
                    summary.add({name: variable.isel(where).values}, model, start, weight=weight)
            elif name == "status":
                summary.points += weight * variable.size
                summary.not_counted += weight * variable.size
    return summary


class Extremes(NamedTuple):
    """The smallest and the largest finite value, NaN where there is none, and how many are not finite."""

    smallest: float
    largest: float
    missing: int


def extremes_of(dataset: xr.Dataset, name: str) -> Extremes | None:
    """The extremes of a variable of a result of any size, over the axes along which it varies.

    None of one that is computed, and varies over more than `MAX_SUMMARY_POINTS` points of all models together.
    """
    of_models = parts_of_models(dataset) if "model" in dataset.variables[name].dims else (dataset,)
    parts = [distinct_points(part, name) for part in of_models]
    evaluations = sum(variable.size for variable, _ in parts)
    if evaluations > MAX_SUMMARY_POINTS and is_computed(dataset.variables[name]):
        return None
    smallest, largest, missing = math.nan, math.nan, 0
    for variable, weight in parts:
        for where in slabs(variable.sizes):
            values = variable.isel(where).values
            finite = values[np.isfinite(values)]
            missing += weight * (values.size - finite.size)
            if finite.size:
                smallest = float(np.fmin(smallest, finite.min()))
                largest = float(np.fmax(largest, finite.max()))
    return Extremes(smallest, largest, missing)


@dataclass(frozen=True)
class SweepOutcome:
    """A result that may be too large to hold: what it is, and what came out.

    Parameters
    ----------
    dataset : its coordinates and attributes; the values of its variables may be placeholders
    summary : of its points
    trajectories : how many were integrated, where that is known
    """

    dataset: xr.Dataset
    summary: Summary
    trajectories: int | None = None


def counts_by_name(counts: Mapping[Status, int]) -> dict[str, int]:
    """Counts by the names of the statuses, in their order."""
    return {status.name.lower(): counts[status] for status in sorted(counts)}
