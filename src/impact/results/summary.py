"""What came out of a sweep in few numbers, taken part after part: counts, worst errors, first failures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.status import FIRST_FAILURE, Status
from .assembly import Part

# the errors of which the largest is told
ERRORS = ("e_error", "v1_error", "v2_error", "closed_form_error", "energy_residual")
FAILED_TOLD = 3
# of the smaller radius, above which an indentation is not small
MAX_INDENTATION = 0.1


@dataclass
class Tally:
    """What came out.

    Parameters
    ----------
    points : how many
    counts : points by status
    worst : the largest absolute value by error, then by the place of the model; NaN where there is none
    failed_at : the first points that failed: status, place of the model, and places on the axes
    deep, deepest : how many points have a peak indentation above `MAX_INDENTATION`, and the largest one, in units
        of the smaller radius; of parts whose radii are known
    """

    points: int = 0
    counts: dict[Status, int] = field(default_factory=dict)
    worst: dict[str, dict[int, float]] = field(default_factory=dict)
    failed_at: list[tuple[Status, int, tuple[int, ...]]] = field(default_factory=list)
    # a file does not hold the radii, so that these are known after a sweep only
    deep: int = field(default=0, compare=False)
    deepest: float = field(default=0.0, compare=False)

    @property
    def failed(self) -> int:
        return sum(count for status, count in self.counts.items() if status >= FIRST_FAILURE)

    def add(self, part: Part) -> Tally:
        """Count the points of a part."""
        box = part.box
        if "status" in part.values:
            self._count(part.values["status"], box.model, [one.start for one in box.where])
        for name in ERRORS:
            if name in part.values:
                self._judge(name, box.model, part.values[name])
        if part.radius is not None and "peak_indentation" in part.values:
            self._measure(part.values["peak_indentation"], part.radius)
        return self

    def _measure(self, indentation: NDArray[Any], radius: NDArray[Any]) -> None:
        if np.isfinite(radius).any():
            share = indentation / (radius if indentation.shape else radius.reshape(()))
            self.deep += int(np.count_nonzero(share > MAX_INDENTATION))
            self.deepest = float(np.fmax.reduce(share, axis=None, initial=self.deepest))

    def _count(self, status: NDArray[np.int8], model: int, start: Sequence[int]) -> None:
        self.points += status.size
        times = np.bincount(status.reshape(-1))
        for number in np.flatnonzero(times).tolist():
            one = Status(number)
            self.counts[one] = self.counts.get(one, 0) + int(times[number])
        if times[FIRST_FAILURE:].any() and len(self.failed_at) < FAILED_TOLD:
            for at in np.argwhere(status >= FIRST_FAILURE)[: FAILED_TOLD - len(self.failed_at)].tolist():
                places = tuple(first + own for first, own in zip(start, at, strict=True))
                self.failed_at.append((Status(int(status[tuple(at)])), model, places))

    def _judge(self, name: str, model: int, values: NDArray[Any]) -> None:
        largest = float(np.fmax.reduce(np.abs(values), axis=None, initial=np.nan))
        own = self.worst.setdefault(name, {})
        own[model] = float(np.fmax(own.get(model, np.nan), largest))


def tally_of(dataset: xr.Dataset) -> Tally:
    """What came out, of a result in memory."""
    tally = Tally()
    for model in range(dataset.sizes["model"]):
        one = dataset.isel(model=model)
        if "status" in one:
            tally._count(one["status"].values, model, [0] * one["status"].ndim)
        for name in ERRORS:
            if name in one:
                tally._judge(name, model, one[name].values)
    return tally


@dataclass(frozen=True)
class Survey:
    """A result that may be too large to hold: what it is, and what came out.

    Parameters
    ----------
    outline : the dataset with its coordinates and attributes; the values of its variables do not count
    tally : of its points
    trajectories : how many were integrated, where that is known
    """

    outline: xr.Dataset
    tally: Tally
    trajectories: int | None = None


def counted(counts: Mapping[Status, int]) -> dict[str, int]:
    """Counts by the names of the statuses, in their order."""
    return {status.name.lower(): counts[status] for status in sorted(counts)}
