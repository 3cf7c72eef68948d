"""How far a sweep is, and what is said of it where it ends before it is whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..contact.simulate import CollisionResult
from ..contact.status import FIRST_FAILURE
from ..errors import StoreError, UnfinishedError, UsageError
from ..text import safe_text
from .trajectories import TrajectoryRange


@dataclass(frozen=True)
class Progress:
    """How far a sweep is: trajectories integrated, and points stored, of all; and how many of either failed."""

    trajectories: int
    of_trajectories: int
    points: int
    of_points: int
    failed: int


ProgressCallback = Callable[[Progress], None]


@dataclass
class ProgressCounter:
    """Counts what is finished, and tells it."""

    at: Progress
    on_progress: ProgressCallback

    @classmethod
    def begin(cls, trajectories: int, points: int, on_progress: ProgressCallback) -> ProgressCounter:
        return cls(Progress(0, trajectories, 0, points, 0), on_progress)

    @property
    def is_full(self) -> bool:
        """Whether all trajectories are integrated."""
        return self.at.trajectories == self.at.of_trajectories

    def count(self, part: TrajectoryRange, rebound: CollisionResult) -> None:
        """One more block is finished."""
        failed = int(np.count_nonzero(rebound.status >= FIRST_FAILURE))
        self.at = replace(self.at, trajectories=self.at.trajectories + part.size, failed=self.at.failed + failed)

    def report(self) -> None:
        self.on_progress(self.at)


@contextmanager
def report_kept_blocks(
    folder: Path, counter: ProgressCounter, again: str, more: Callable[[Exception], list[str]]
) -> Iterator[None]:
    """Have an error say what is kept nevertheless.

    Parameters
    ----------
    folder : where
    counter : how much
    again : what goes on with it
    more : what else there is to say of an error
    """
    try:
        yield
    except (StoreError, UnfinishedError, UsageError, MemoryError) as error:
        of = f"{counter.at.trajectories:,} of {counter.at.of_trajectories:,} trajectories"
        left = f"{of} are kept in {safe_text(str(folder))}; {again} goes on"
        is_memory = isinstance(error, MemoryError)
        lines = ["out of memory" if is_memory else "", str(error), *more(error), left]
        raise (StoreError if is_memory else type(error))("; ".join(filter(None, lines))) from error
