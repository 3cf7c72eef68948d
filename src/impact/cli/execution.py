"""How a command integrates: its executor, its progress on stderr, and signals that stop it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import impact

from ..errors import UsageError
from .exits import print_line

if TYPE_CHECKING:
    import xarray as xr

    from ..engine.executors import ExecutorSpec
    from ..engine.plan import Plan


@dataclass(frozen=True)
class Execution:
    """How a command integrates, by its options; `should_stop` returns whether a signal came."""

    should_stop: Callable[[], bool]
    quiet: bool
    jobs: int = 1
    threads: int = 1
    scheduler: str | None = None
    scheduler_file: Path | None = None

    def __post_init__(self) -> None:
        options = ("jobs", "threads", "scheduler", "scheduler_file")
        values = {f"--{name.replace('_', '-')}": getattr(self, name) for name in options}
        selected = [f"{name} {value}" for name, value in values.items() if value not in (1, None)]
        if len(selected) > 1:
            raise UsageError(f"{selected[0]}: got {selected[1]} as well, expected one of the two")

    def _executor(self) -> AbstractContextManager[ExecutorSpec]:
        """Choose the executor; the size of a cluster is printed on stderr when it is entered."""
        address = self.scheduler if self.scheduler is not None else self.scheduler_file
        if address is None:
            from ..engine.executors import choose_executor

            return choose_executor(self.jobs, self.threads)
        from ..engine.dask import cluster

        return cluster(address, self.should_stop, (lambda note: None) if self.quiet else print_line)

    @contextmanager
    def keywords(self) -> Iterator[dict[str, Any]]:
        """Show the progress while public functions that take these keywords run."""
        backend = self._executor()
        with impact.progress_bar(print_line, quiet=self.quiet) as on_progress:
            yield {"backend": backend, "on_progress": on_progress, "should_stop": self.should_stop}

    def execute(self, plan: Plan) -> xr.Dataset:
        """Run a plan in memory."""
        from ..engine.run import Run
        from ..results.sweep import sweep_in_memory

        with self.keywords() as keywords:
            return sweep_in_memory(plan, Run(keywords.pop("backend"), **keywords))
