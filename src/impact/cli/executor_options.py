"""The options that choose an executor: this process, others, threads, or the workers of a cluster."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import UsageError
from ..text import safe_text
from .exits import print_line

if TYPE_CHECKING:
    from ..engine.executors import ExecutorSpec


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

    def choose(self, *, quiet: bool, should_stop: Callable[[], bool]) -> AbstractContextManager[ExecutorSpec]:
        """Choose the executor; the size of a cluster is printed on stderr when it is entered."""
        address = self.scheduler if self.scheduler is not None else self.scheduler_file
        if address is None:
            from ..engine.executors import choose_executor

            return choose_executor(self.jobs, self.threads)
        from ..engine.dask import cluster

        return cluster(address, should_stop, (lambda note: None) if quiet else print_line)
