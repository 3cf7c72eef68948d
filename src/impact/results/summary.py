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
from .kinds import is_calibration, is_sensitivity
from .schema import count_points, parts_of_models
from .slabs import MAX_SUMMARY_POINTS, distinct_points, is_computed, slabs

# variables of which the largest absolute value is reported
ERROR_VARIABLES = ("e_error", "v1_error", "v2_error", "closed_form_error", "energy_residual")
MAX_FAILED_AT = 3
# limit of small indentations, as a fraction of the smaller radius
MAX_SMALL_INDENTATION = 0.1


@dataclass
class Summary:
    """Counts and extremes of the points of a result.

    Parameters
    ----------
    points : number of points
    counts : number of points by status
    worst : the largest absolute value by error variable and number of the model; NaN if all are NaN, missing if
        not evaluated
    failed_at : the first points that failed: status, number of the model, and index along the axes
    max_failed_at : how many of these are recorded
    not_counted : number of points whose status was not evaluated
    deep, deepest : number of points with a peak indentation above `MAX_SMALL_INDENTATION`, and the largest one, as
        fractions of the smaller radius; only of points with known radii
    """

    points: int = 0
    counts: dict[Status, int] = field(default_factory=dict)
    worst: dict[str, dict[int, float]] = field(default_factory=dict)
    failed_at: list[tuple[Status, int, tuple[int, ...]]] = field(default_factory=list)
    max_failed_at: int = field(default=MAX_FAILED_AT, compare=False)
    not_counted: int = 0
    # a file does not hold the radii: these are available after a sweep only
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
        """Add some points of one model.

        Parameters
        ----------
        values : by variable, all of one shape; without a status only the errors are evaluated
        model : number of the model
        start : index of the first point along each axis
        radius : of the smaller ball [m], NaN if unknown; its shape broadcasts to that of the values
        weight : number of points of the result that each of these represents
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
                index = tuple(first + offset for first, offset in zip(start, at, strict=True))
                self.failed_at.append((Status(int(status[tuple(at)])), model, index))

    def _judge(self, name: str, model: int, values: NDArray[Any]) -> None:
        largest = float(np.fmax.reduce(np.abs(values), axis=None, initial=np.nan))
        by_model = self.worst.setdefault(name, {})
        by_model[model] = float(np.fmax(by_model.get(model, np.nan), largest))


def summarize(
    dataset: xr.Dataset, max_failed_at: int = MAX_FAILED_AT, max_points: float = MAX_SUMMARY_POINTS
) -> Summary:
    """Summarize a result of any size.

    Each variable is evaluated over the axes along which it varies, one model after another, and each of its points
    counts as often as it occurs. A computed variable that varies over more than `max_points` points is not
    evaluated: the error is then missing from `worst`, or the points are `not_counted`. Variables that are stored
    in a file are always read.

    Parameters
    ----------
    dataset : a result
    max_failed_at : how many failed points are recorded: the first distinct ones in C order, at the first position
        along each axis on which the status does not vary
    max_points : limit for a computed variable of one model
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
    """The smallest and the largest finite value, NaN if there is none, and the number of other values."""

    smallest: float
    largest: float
    missing: int


def extremes_of(dataset: xr.Dataset, name: str) -> Extremes | None:
    """The extremes of a variable of a result of any size, over the axes along which it varies.

    None for a computed variable that varies over more than `MAX_SUMMARY_POINTS` points of all models together.
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
    """The result of a sweep, which may be larger than memory, and its summary.

    Parameters
    ----------
    dataset : its coordinates and attributes; the values of its variables may be placeholders
    summary : of its points
    trajectories : number of different trajectories; None if unknown
    is_new : whether the file was written now; False if it held this sweep already
    integrated : how many trajectories were integrated now; None if not counted
    repeated_blocks : number of blocks that several shards have
    extended_layout : layout of the result that was extended; only "factored" stores trajectories to reuse
    """

    dataset: xr.Dataset
    summary: Summary
    trajectories: int | None = None
    is_new: bool = True
    integrated: int | None = None
    repeated_blocks: int = 0
    extended_layout: str | None = None


def describe(dataset: xr.Dataset) -> dict[str, Any]:
    """The contents of a result or a time history, as plain data; see `impact.info`."""
    summary = summarize(dataset) if "model" in dataset.dims else Summary()
    variables: dict[str, Any] = {}
    for name, variable in dataset.items():
        extremes = extremes_of(dataset, str(name))
        variables[str(name)] = {
            "units": variable.attrs.get("units"),
            "dims": list(variable.dims),
            **(extremes._asdict() if extremes else dict.fromkeys(Extremes._fields)),
        }
    return {
        "points": _count_points(dataset),
        # of a result in memory neither is known
        **{name: dataset.encoding.get(name) for name in ("layout", "seal")},
        "dimensions": {str(name): size for name, size in dataset.sizes.items()},
        "coordinates": [str(name) for name in dataset.coords],
        "variables": variables,
        "status": counts_by_name(summary.counts),
        "not_evaluated": summary.not_counted,
        "worst": worst_by_model(summary, dataset),
        "attributes": {
            str(name): value if isinstance(value, str) else np.asarray(value).tolist()
            for name, value in dataset.attrs.items()
        },
    }


def _count_points(dataset: xr.Dataset) -> int:
    """The points of a sweep, the measured values of a calibration, or the studies of a sensitivity study."""
    if is_calibration(dataset):
        return dataset.sizes["point"]
    return int(dataset["mean"].size) if is_sensitivity(dataset) else count_points(dataset)


def worst_by_model(summary: Summary, dataset: xr.Dataset) -> dict[str, dict[str, float]]:
    """The largest absolute errors by variable and key of the model."""
    keys = dataset["model"].values.tolist() if summary.worst else []
    return {
        name: {keys[model]: largest for model, largest in by_model.items()}
        for name, by_model in summary.worst.items()
    }


def counts_by_name(counts: Mapping[Status, int]) -> dict[str, int]:
    """Counts by the names of the statuses, in their order."""
    return {status.name.lower(): counts[status] for status in sorted(counts)}
