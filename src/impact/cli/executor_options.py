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
    """The options of the command line that select an executor.

    Raises
    ------
    UsageError : more than one of them
    """

    jobs: int = 1
    threads: int = 1
    scheduler: str | None = None
    scheduler_file: Path | None = None

    def __post_init__(self) -> None:
        options = {f"--{name.replace('_', '-')}": value for name, value in vars(self).items()}
        selected = [f"{name} {safe_text(str(value))}" for name, value in options.items() if value not in (1, None)]
        if len(selected) > 1:
            raise UsageError(f"{selected[0]}: got {selected[1]} as well, expected one of the two")

    @contextmanager
    def backend(self, *, quiet: bool, should_stop: Callable[[], bool]) -> Iterator[Backend]:
        """The backend; prints the size of a cluster on stderr. `should_stop` ends an attempt to connect."""
        address = self.scheduler if self.scheduler is not None else self.scheduler_file
        if address is None:
            from ..engine.executors import choose_backend

            yield choose_backend(self.jobs, self.threads)
            return
        from ..engine.dask import cluster

        with cluster(address, should_stop) as (backend, dashboard, workers):
            if not quiet:
                waits = "" if workers else ", waits for some"
                count = f"{workers} worker{'' if workers == 1 else 's'}{waits}"
                print_line(f"{count}; dashboard: {dashboard}" if dashboard else count)
            yield backend
