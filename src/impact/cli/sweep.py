"""The commands that make a result from a config: sweep, as a whole, in shards or as a dry run; and merge."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from dataclasses import asdict
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import UnfinishedError, UsageError
from ..text import safe_text
from . import exits
from .console import cell, console, dump, table
from .executor_options import ExecutorOptions
from .options import AllowFailed, Jobs, Json, MaxPoints, Output, Overwrite, Plugins, Quiet, Resume, Sets, Threads

if TYPE_CHECKING:
    from ..engine.plan import Plan
    from ..results.summary import SweepOutcome

# how equal points are found where they are not compared over the whole grid
COLLAPSE = {
    "block": "too many cells to compare, equal ones are found within a block",
    "not": "every point is integrated (solver.collapse = false)",
}


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: Output = Path("results.h5"),
    sets: Sets = None,
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: AllowFailed = False,
    resume: Resume = False,
    jobs: Jobs = 1,
    threads: Threads = 1,
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
    max_points: MaxPoints = 10**9,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print the number of points and trajectories, bytes and time.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run every model over a sweep and store post-impact velocities and their errors."""
    with exits.signals() as should_stop:
        from .. import api
        from ..results.plausibility import material_notes
        from . import summary

        executor = ExecutorOptions(jobs, threads, scheduler, scheduler_file)
        plan = api.prepare(config, sets or (), plugins or (), max_points)
        if not quiet:
            columns = {name: values for axis in plan.config.axes for name, values in axis.columns.items()}
            for note in material_notes(plan.material_record, columns):
                exits.say(f"note: {safe_text(str(config))}: {note}")
        if shard is not None:
            if dry_run:
                raise UsageError(f"--shard {safe_text(shard)}: given beside --dry-run, which is of the whole")
            words = [word for change in sets or () for word in ("--set", change)]
            words += [word for path in plugins or () for word in ("--plugin", str(path))]
            command = ["impact", "sweep", str(config), "-o", str(output), *words]
            _sweep_shard(
                plan, shard, command, output, executor, overwrite=overwrite, quiet=quiet, as_json=as_json,
                should_stop=should_stop,
            )  # fmt: skip
            return
        if dry_run:
            _print_estimate(plan, max(jobs, threads), as_json=as_json)
            if should_stop():
                raise UnfinishedError("nothing was written")
            return
        outcome, fresh = _sweep_whole(
            plan, output, (config, *(plugins or ())), executor, resume=resume, overwrite=overwrite, quiet=quiet,
            should_stop=should_stop,
        )  # fmt: skip
    summary.conclude(outcome, output, fresh=fresh, quiet=quiet, as_json=as_json, allow_failed=allow_failed)


def _sweep_whole(
    plan: Plan,
    output: Path,
    sources: tuple[Path, ...],
    executor: ExecutorOptions,
    *,
    resume: bool,
    overwrite: bool,
    quiet: bool,
    should_stop: Callable[[], bool],
) -> tuple[SweepOutcome, bool]:
    """The stored result of a plan, and whether it was written now: the file may hold it already."""
    from ..engine import checkpoint
    from ..results import backend
    from ..results.sweep import find_finished, sweep_into
    from .progress import progress

    shown = safe_text(str(output))
    outcome = None if overwrite else find_finished(output, plan)
    if outcome is not None:
        checkpoint.remove_stale_work_folder(output, plan)
        if should_stop():
            raise UnfinishedError(f"{shown} already holds this sweep")
        return outcome, False
    for source in sources:
        backend.check_output(output, overwrite=overwrite, source=source)
    with executor.backend(quiet=quiet, should_stop=should_stop) as integrators, progress(quiet=quiet) as report:
        outcome = sweep_into(
            output,
            plan,
            resume=resume,
            overwrite=overwrite,
            backend=integrators,
            on_progress=report,
            should_stop=should_stop,
        )
    if should_stop():
        raise UnfinishedError(f"{shown} was stored whole")
    return outcome, True


def _sweep_shard(
    plan: Plan,
    shard: str,
    command: list[str],
    output: Path,
    executor: ExecutorOptions,
    *,
    overwrite: bool,
    quiet: bool,
    as_json: bool,
    should_stop: Callable[[], bool],
) -> None:
    """Integrate a shard of a plan.

    Parameters
    ----------
    plan : of the whole
    shard : which, such as "3/16"
    command : words that sweep the whole into the output
    """
    from ..results.shards import Shard, sweep_shard
    from .progress import progress

    part = Shard.parse(shard)
    with executor.backend(quiet=quiet, should_stop=should_stop) as integrators, progress(quiet=quiet) as report:
        done = sweep_shard(
            output,
            plan,
            part,
            command,
            overwrite=overwrite,
            backend=integrators,
            on_progress=report,
            should_stop=should_stop,
        )
    if should_stop():
        raise UnfinishedError(f"{safe_text(str(done.folder))} has the whole shard")
    if as_json:
        print(dump({**asdict(done), "folder": str(done.folder), "shard": str(part)}))
    if not quiet:
        failed = f", {done.failed:,} failed" if done.failed else ""
        every = output.with_name(f"{shlex.quote(output.name)}.*-of-{part.of}.work")
        exits.say(
            f"{safe_text(str(done.folder))}: {done.blocks:,} of {done.of_blocks:,} blocks, {done.trajectories:,} "
            f"trajectories{failed}; with all {part.of:,} shards: impact merge {safe_text(str(every))} "
            f"-o {safe_text(shlex.quote(str(output)))}"
        )


def _print_estimate(plan: Plan, jobs: int, *, as_json: bool) -> None:
    """Points, trajectories per model and how they collapse, bytes and time, on stdout."""
    from ..results.estimate import estimate

    expected = estimate(plan, jobs)
    if as_json:
        print(dump(asdict(expected)))
        return
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
    if len(expected.by_workers) > 1:
        many = ", ".join(f"{_duration(seconds)} by {count:,}" for count, seconds in expected.by_workers.items())
        out.print(f"on a cluster: {expected.wire:,} bytes over the wire; {many} workers; more are of no use")


def _duration(seconds: float) -> str:
    """A time as one reads it.

    >>> _duration(0.2), _duration(7), _duration(7500)
    ('under a second', 'about 0:00:07', 'about 2:05:00')
    """
    return "under a second" if seconds < 1.0 else f"about {timedelta(seconds=round(seconds))}"


def merge(
    folders: Annotated[list[Path], typer.Argument(help="Work folders that `impact sweep --shard K/N` has made.")],
    output: Output = Path("results.h5"),
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: AllowFailed = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Make the result of a sweep from all of its shards; their folders stay."""
    with exits.signals() as should_stop:
        from ..engine.plugins import read_plugins
        from ..results.shards import merge as merge_shards
        from . import summary
        from .progress import progress

        with progress(quiet=quiet) as report:
            outcome, twice = merge_shards(
                folders, output, read_plugins(plugins or ()), overwrite=overwrite, on_progress=report,
                should_stop=should_stop,
            )  # fmt: skip
        if should_stop():
            raise UnfinishedError(f"{safe_text(str(output))} was stored whole")
    if twice and not quiet:
        exits.say(f"{twice:,} blocks were in more than one folder, with the same bits")
    summary.conclude(outcome, output, fresh=True, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
