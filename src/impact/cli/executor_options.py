"""The options that choose an executor: this process, others, threads, or the workers of a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import UsageError
from ..text import safe_text
from .exits import print_line

if TYPE_CHECKING:
    from ..engine.executors import Backend


@dataclass(frozen=True)
class ExecutorOptions:
    """What was asked for.

    Raises
    ------
    UsageError : more than one of them
    """

    jobs: int = 1
    threads: int = 1
    scheduler: str | None = None
    scheduler_file: Path | None = None

    def __post_init__(self) -> None:
        given = {f"--{name.replace('_', '-')}": value for name, value in vars(self).items()}
        asked = [f"{name} {safe_text(str(value))}" for name, value in given.items() if value not in (1, None)]
        if len(asked) > 1:
            raise UsageError(f"{asked[0]}: given beside {asked[1]}, expected one of the two")

    @contextmanager
    def backend(self, *, quiet: bool, should_stop: Callable[[], bool]) -> Iterator[Backend]:
        """Those who integrate; prints the cluster to stderr, and `should_stop` gives up a connection to it."""
        place = self.scheduler if self.scheduler is not None else self.scheduler_file
        if place is None:
            from ..engine.executors import choose_backend

            yield choose_backend(self.jobs, self.threads)
            return
        from ..engine.dask import cluster

        with cluster(place, should_stop) as (backend, dashboard, workers):
            if not quiet:
                waits = "" if workers else ", waits for some"
                count = f"{workers} worker{'' if workers == 1 else 's'}{waits}"
                print_line(f"{count}; dashboard: {dashboard}" if dashboard else count)
            yield backend
