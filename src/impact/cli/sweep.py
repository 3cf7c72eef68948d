"""The commands that compute a result from a config: sweep (also a shard or a dry run) and merge."""

from __future__ import annotations

import shlex
import sys
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..errors import UnfinishedError, UsageError
from . import exits
from .console import cell, console, dump, table
from .executor_options import ExecutorOptions
from .options import (
    AllowFailedOption,
    JobsOption,
    JsonOption,
    MaxPointsOption,
    OutputOption,
    OverwriteOption,
    PluginOption,
    QuietOption,
    ResumeOption,
    SetOption,
    ThreadsOption,
)

if TYPE_CHECKING:
    from ..results.estimate import Estimate
    from ..results.shards import ShardProgress

# why equal points are not searched for in the whole grid
COLLAPSE = {
    "block": "too many cells to compare all, equal points are searched for within a block",
    "not": "every point is integrated (solver.collapse = false)",
}


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: OutputOption = Path("results.h5"),
    sets: SetOption = None,
    plugins: PluginOption = None,
    overwrite: OverwriteOption = False,
    allow_failed: AllowFailedOption = False,
    resume: ResumeOption = False,
    jobs: JobsOption = 1,
    threads: ThreadsOption = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler",
            metavar="ADDRESS",
            help="Dask's workers integrate: tcp://host:8786, or local (127.0.0.1, ports without authentication).",
        ),
    ] = None,
    scheduler_file: Annotated[
        Path | None, typer.Option("--scheduler-file", metavar="FILE", help="The same, by the scheduler's file.")
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option("--shard", metavar="K/N", help="Only part K of N; impact merge joins the parts."),
    ] = None,
    max_points: MaxPointsOption = 10**9,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print the number of points and trajectories, bytes and time.")
    ] = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run every model over a sweep and store post-impact velocities and their errors."""
    with exits.catch_signals() as should_stop:
        from ..progress_display import progress_bar
        from . import summary

        def print_note(note: str) -> None:
            if not quiet:
                exits.print_line(f"note: {config}: {note}")

        executor = ExecutorOptions(jobs, threads, scheduler, scheduler_file)
        inputs: dict[str, Any] = {
            "overrides": sets or (),
            "plugins": plugins or (),
            "max_points": max_points,
            "on_note": print_note,
        }
        if dry_run:
            if shard is not None:
                raise UsageError(f"--shard {shard}: got --dry-run as well, which estimates the whole sweep")
            expected = impact.estimate(config, jobs=max(jobs, threads), **inputs)
            if as_json:
                print(dump(asdict(expected)))
            else:
                _print_estimate(expected, on_cluster=bool(scheduler or scheduler_file))
            if should_stop():
                raise UnfinishedError("nothing was written")
            return
        backend = executor.choose(quiet=quiet, should_stop=should_stop)
        with progress_bar(exits.print_line, quiet=quiet) as on_progress:
            inputs |= {"backend": backend, "on_progress": on_progress, "should_stop": should_stop}
            if shard is not None:
                done = impact.sweep_shard(config, shard, output, overwrite=overwrite, **inputs)
            else:
                outcome = impact.sweep_to_file(config, output, resume=resume, overwrite=overwrite, **inputs)
    if shard is not None:
        _print_shard(done, output, quiet=quiet, as_json=as_json)
    else:
        summary.conclude(outcome, output, quiet=quiet, as_json=as_json, allow_failed=allow_failed)


def _print_shard(done: ShardProgress, output: Path, *, quiet: bool, as_json: bool) -> None:
    """Print what a shard has finished, and the command that joins all shards."""
    if as_json:
        print(dump({**asdict(done), "folder": str(done.folder), "shard": str(done.shard)}))
    if not quiet:
        failed = f", {done.failed:,} failed" if done.failed else ""
        every = output.with_name(f"{shlex.quote(output.name)}.*-of-{done.shard.of}.work")
        exits.print_line(
            f"{done.folder}: {done.blocks:,} of {done.of_blocks:,} blocks, {done.trajectories:,} "
            f"trajectories{failed}; with all {done.shard.of:,} shards: impact merge {every} "
            f"-o {shlex.quote(str(output))}"
        )


def _print_estimate(expected: Estimate, *, on_cluster: bool) -> None:
    """Print points, trajectories per model, bytes and time of a sweep on stdout."""
    out = console(sys.stdout)
    rows = table("model", "points", "cells", "trajectories", "how the points collapse")
    rows.columns[-1].justify = "left"
    for model in expected.models:
        along = f"depends on {', '.join(model.axes)}" if model.axes else "depends on no axis"
        how = along if model.within == "plan" else f"{along}; {COLLAPSE[model.within]}"
        counts = (f"{count:,}" for count in (model.points, model.cells, model.trajectories))
        rows.add_row(cell(model.model), *counts, cell(how))
    out.print(rows)
    size = f"{expected.bytes:,} bytes (and {expected.kept:,} while it runs)"
    total = f"{expected.points:,} points from {expected.trajectories:,} trajectories"
    time = f"{_duration(expected.seconds)} by {expected.core} and what the disk takes"
    out.print(f"{total}, {size}, {time}; nothing was written")
    if on_cluster:
        *few, most = (f"{_duration(seconds)} by {count:,}" for count, seconds in expected.by_workers.items())
        times = "; ".join([*few, f"{most} workers, the most that can be kept busy"])
        out.print(f"dask workers: {times}; {expected.wire:,} bytes are sent to them and back")


def _duration(seconds: float) -> str:
    """A time in words.

    >>> _duration(0.2), _duration(7), _duration(7500)
    ('under a second', 'about 0:00:07', 'about 2:05:00')
    """
    return "under a second" if seconds < 1.0 else f"about {timedelta(seconds=round(seconds))}"


def merge(
    folders: Annotated[list[Path], typer.Argument(help="Work folders written by `impact sweep --shard K/N`.")],
    output: OutputOption = Path("results.h5"),
    plugins: PluginOption = None,
    overwrite: OverwriteOption = False,
    allow_failed: AllowFailedOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Join the shards of a sweep into its result; the work folders are not deleted."""
    with exits.catch_signals() as should_stop:
        from ..progress_display import progress_bar
        from . import summary

        with progress_bar(exits.print_line, quiet=quiet) as on_progress:
            outcome = impact.merge(
                folders,
                output,
                plugins=plugins or (),
                overwrite=overwrite,
                on_progress=on_progress,
                should_stop=should_stop,
            )
    if outcome.repeated_blocks and not quiet:
        exits.print_line(f"{outcome.repeated_blocks:,} blocks were in more than one folder, with the same bits")
    summary.conclude(outcome, output, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
