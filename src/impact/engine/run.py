"""How a sweep runs: its executor, what it may replace, how it reports its progress and when it stops."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..config.grid import MAX_POINTS
from ..contact.records import Record
from ..contact.status import FIRST_FAILURE, FrictionStatus
from ..errors import StoreError, UnfinishedError, UsageError, warn
from .executors import SERIAL, ExecutorSpec
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


def ignore(message: object) -> None:
    """Do nothing: the default of `on_progress`."""


def never() -> bool:
    """Return False: the default of `should_stop`."""
    return False


@dataclass(frozen=True)
class Run:
    """How a sweep runs, whatever it computes.

    Parameters
    ----------
    executor : what integrates; entered when it is needed
    resume : continue with the work folder of an interrupted sweep
    overwrite : replace the output, and a work folder that is not resumed
    max_points : the largest number of points, of all models together
    on_progress : called from time to time with the progress
    on_note : called with a sentence about each implausible value; by default an `ImpactWarning`
    should_stop : returns whether to stop; ranges of trajectories that are running are finished and kept
    """

    executor: AbstractContextManager[ExecutorSpec] = SERIAL
    resume: bool = False
    overwrite: bool = False
    max_points: int = MAX_POINTS
    on_progress: ProgressCallback = ignore
    on_note: Callable[[str], None] = warn
    should_stop: Callable[[], bool] = never

    @contextmanager
    def connected(self) -> Iterator[Run]:
        """Connect to the workers of the executor, if it has some."""
        with self.executor as executor:
            yield replace(self, executor=executor)

    def check_stop(self, message: str = "") -> None:
        """Raise an `UnfinishedError` with this message if the sweep shall stop."""
        if self.should_stop():
            raise UnfinishedError(message)


DEFAULT_RUN = Run()


class ProgressCounter:
    """Counts finished trajectories of some ranges, and passes the progress to the callback of a run."""

    def __init__(self, ranges: Sequence[TrajectoryRange], points: int, run: Run) -> None:
        self.progress, self.run = Progress(0, sum(part.size for part in ranges), 0, points, 0), run

    def count(self, trajectory_range: TrajectoryRange, collisions: Record) -> None:
        """Add a finished range."""
        # a pair without a meaning did not fail
        is_failure = (collisions.status >= FIRST_FAILURE) & (collisions.status != FrictionStatus.NOT_COMBINABLE)
        self.add(trajectory_range.size, int(np.count_nonzero(is_failure)))

    def add(self, finished: int, failed: int = 0) -> None:
        """Add to the numbers of finished and failed trajectories."""
        progress = self.progress
        self.progress = replace(
            progress, trajectories=progress.trajectories + finished, failed=progress.failed + failed
        )

    def report(self) -> None:
        self.run.on_progress(self.progress)


@contextmanager
def report_kept_ranges(
    folder: Path, counter: ProgressCounter, command: str, details: Callable[[Exception], list[str]]
) -> Iterator[None]:
    """Add to an error how many finished trajectories the folder has, and the option or command that continues."""
    try:
        yield
    except (StoreError, UnfinishedError, UsageError, MemoryError) as error:
        share = f"{counter.progress.trajectories:,} of {counter.progress.of_trajectories:,} trajectories"
        kept = f"{share} are kept in {folder}; {command} continues"
        is_memory = isinstance(error, MemoryError)
        lines = ["out of memory" if is_memory else "", str(error), *details(error), kept]
        raise (StoreError if is_memory else type(error))("; ".join(filter(None, lines))) from error
