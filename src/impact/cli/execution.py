"""How a command integrates: its executor, its progress on stderr, signals that stop it, and its summary."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
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
    from ..results.summary import SweepOutcome


@contextmanager
def execution(
    quiet: bool, jobs: int = 1, threads: int = 1, scheduler: str | None = None, scheduler_file: Path | None = None
) -> Iterator[dict[str, Any]]:
    """Catch signals, and show the progress, while public functions that take these keywords integrate."""
    options = {"--jobs": jobs, "--threads": threads, "--scheduler": scheduler, "--scheduler-file": scheduler_file}
    selected = [f"{name} {value}" for name, value in options.items() if value not in (1, None)]
    if len(selected) > 1:
        raise UsageError(f"{selected[0]}: got {selected[1]} as well, expected one of the two")
    progress_bar = impact.progress_bar(exits.print_line, quiet=quiet)
    with exits.catch_signals() as should_stop, progress_bar as on_progress:
        backend: AbstractContextManager[ExecutorSpec]
        address = scheduler if scheduler is not None else scheduler_file
        if address is None:
            from ..engine.executors import choose_executor

            backend = choose_executor(jobs, threads)
        else:
            from ..engine.dask import cluster

            # the size of the cluster is printed when it is entered
            backend = cluster(address, should_stop, (lambda note: None) if quiet else exits.print_line)
        yield {"backend": backend, "on_progress": on_progress, "should_stop": should_stop}


def run_in_memory(plan: Plan, *, backend: AbstractContextManager[ExecutorSpec], **callbacks: Any) -> xr.Dataset:
    """Run a plan in memory, with the keywords of `execution`."""
    from ..engine.run import Run
    from ..results.sweep import sweep_in_memory

    return sweep_in_memory(plan, Run(backend, **callbacks))


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
