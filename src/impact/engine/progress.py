"""Progress of a sweep, and the message about its finished blocks if it ends early."""

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
    """Progress of a sweep: integrated trajectories and stored points, their totals, and the number that failed."""

    trajectories: int
    of_trajectories: int
    points: int
    of_points: int
    failed: int


ProgressCallback = Callable[[Progress], None]


@dataclass
class ProgressCounter:
    """Counts finished trajectories, and passes the progress to a callback."""

    progress: Progress
    on_progress: ProgressCallback

    @classmethod
    def start(cls, trajectories: int, points: int, on_progress: ProgressCallback) -> ProgressCounter:
        return cls(Progress(0, trajectories, 0, points, 0), on_progress)

    @property
    def is_full(self) -> bool:
        """Whether all trajectories are integrated."""
        return self.progress.trajectories == self.progress.of_trajectories

    def count(self, part: TrajectoryRange, collisions: CollisionResult) -> None:
        """Add a finished block."""
        failed = int(np.count_nonzero(collisions.status >= FIRST_FAILURE))
        self.progress = replace(
            self.progress,
            trajectories=self.progress.trajectories + part.size,
            failed=self.progress.failed + failed,
        )

    def report(self) -> None:
        self.on_progress(self.progress)


@contextmanager
def report_kept_blocks(
    folder: Path, counter: ProgressCounter, command: str, details: Callable[[Exception], list[str]]
) -> Iterator[None]:
    """Add to the message of an error how many finished trajectories the work folder contains.

    Parameters
    ----------
    folder : the work folder
    counter : counts the finished trajectories
    command : option or command that continues the sweep
    details : returns further sentences about an error
    """
    try:
        yield
    except (StoreError, UnfinishedError, UsageError, MemoryError) as error:
        share = f"{counter.progress.trajectories:,} of {counter.progress.of_trajectories:,} trajectories"
        kept_blocks = f"{share} are kept in {safe_text(str(folder))}; {command} continues"
        is_memory = isinstance(error, MemoryError)
        lines = ["out of memory" if is_memory else "", str(error), *details(error), kept_blocks]
        raise (StoreError if is_memory else type(error))("; ".join(filter(None, lines))) from error
