"""The commands that compute a result from a config: sweep (also a shard or a dry run) and merge."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

import impact

from ..display import Wrapped, dump, print_blocks, show
from ..errors import UnfinishedError, UsageError
from . import exits, options
from .execution import execution, print_summary_and_exit


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: options.Output = Path("results.h5"),
    sets: options.Set = None,
    plugins: options.Plugins = None,
    overwrite: options.Overwrite = False,
    allow_failed: options.AllowFailed = False,
    resume: options.Resume = False,
    jobs: options.Jobs = 1,
    threads: options.Threads = 1,
    scheduler: Annotated[
        str | None,
        options.value(
            "ADDRESS",
            "Integrate on dask workers: tcp://host:8786, or local (127.0.0.1, ports without authentication).",
        ),
    ] = None,
    scheduler_file: Annotated[Path | None, options.value("FILE", "The same, by the scheduler's file.")] = None,
    shard: Annotated[str | None, options.value("K/N", "Only part K of N; impact merge joins the parts.")] = None,
    max_points: options.MaxPoints = 10**9,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print the number of points and trajectories, bytes and time.")
    ] = False,
    quiet: options.Quiet = False,
    as_json: options.Json = False,
) -> None:
    """Run every model over a sweep and store post-impact velocities and their errors."""
    with execution(quiet, jobs, threads, scheduler, scheduler_file) as keywords:

        def print_note(note: str) -> None:
            if not quiet:
                exits.print_line(f"note: {config}: {note}")

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
            show(expected, as_json=as_json)
            if not as_json and (scheduler or scheduler_file):
                print_blocks([Wrapped(expected.workers_line)])
            if keywords["should_stop"]():
                raise UnfinishedError("nothing was written")
            return
        inputs |= keywords
        if shard is not None:
            done = impact.sweep_shard(config, shard, output, overwrite=overwrite, **inputs)
        else:
            outcome = impact.sweep_to_file(config, output, resume=resume, overwrite=overwrite, **inputs)
    if shard is not None:
        if as_json:
            print(dump(done))
        if not quiet:
            exits.print_line(str(done))
    else:
        print_summary_and_exit(outcome, quiet=quiet, as_json=as_json, allow_failed=allow_failed)


def merge(
    folders: Annotated[list[Path], typer.Argument(help="Work folders written by `impact sweep --shard K/N`.")],
    output: options.Output = Path("results.h5"),
    plugins: options.Plugins = None,
    overwrite: options.Overwrite = False,
    allow_failed: options.AllowFailed = False,
    quiet: options.Quiet = False,
    as_json: options.Json = False,
) -> None:
    """Join the shards of a sweep into its result; the work folders are not deleted."""
    with (
        exits.catch_signals() as should_stop,
        impact.progress_bar(exits.print_line, quiet=quiet) as on_progress,
    ):
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
    print_summary_and_exit(outcome, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
