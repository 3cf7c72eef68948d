"""How a command integrates: its executor, its progress on stderr, signals that stop it, and its summary."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import impact

from ..display import dump, show
from ..errors import UsageError
from . import exits

if TYPE_CHECKING:
    import xarray as xr

    from ..engine.executors import ExecutorSpec
    from ..engine.plan import Plan
    from ..results.outcome import SweepOutcome


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

        return cluster(address, self.should_stop, (lambda note: None) if self.quiet else exits.print_line)

    @contextmanager
    def keywords(self) -> Iterator[dict[str, Any]]:
        """Show the progress while public functions that take these keywords run."""
        backend = self._executor()
        with impact.progress_bar(exits.print_line, quiet=self.quiet) as on_progress:
            yield {"backend": backend, "on_progress": on_progress, "should_stop": self.should_stop}

    def execute(self, plan: Plan) -> xr.Dataset:
        """Run a plan in memory."""
        from ..engine.run import Run
        from ..results.sweep import sweep_in_memory

        with self.keywords() as keywords:
            return sweep_in_memory(plan, Run(keywords.pop("backend"), **keywords))


def print_summary_and_exit(outcome: SweepOutcome, *, quiet: bool, as_json: bool, allow_failed: bool) -> None:
    """Print the summary of a result as the options ask for it, and exit with 3 if points failed."""
    if not quiet:
        if outcome.is_new:
            with exits.ignore_broken_pipe(sys.stderr):
                show(outcome, stream=sys.stderr)
        else:
            exits.print_line(f"{outcome.output}: already contains this sweep; nothing to do")
    if as_json:
        print(dump(outcome))
    if outcome.summary.failed and not allow_failed:
        if quiet or not outcome.is_new:
            exits.print_line(outcome.failed_line, error=True)
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
