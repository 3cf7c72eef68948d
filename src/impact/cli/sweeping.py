"""The command `sweep`: from a TOML file to a result, or to what it would take."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from ..errors import UnfinishedError
from ..text import safe_text
from . import door
from .options import Json, Overwrite, Plugins, Quiet, Sets
from .who import Who
from .words import dump


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The result file.")] = Path("results.h5"),
    sets: Sets = None,
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: Annotated[bool, typer.Option("--allow-failed", help="Exit 0 even if points failed.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a sweep that was interrupted.")] = False,
    jobs: Annotated[int, typer.Option("--jobs", "-j", metavar="N", min=1, help="Processes that integrate.")] = 1,
    threads: Annotated[
        int,
        typer.Option("--threads", metavar="N", min=1, help="Threads that integrate, in place of processes."),
    ] = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(
            "--scheduler", metavar="ADDRESS", help="Dask's workers integrate: tcp://host:8786, or local."
        ),
    ] = None,
    scheduler_file: Annotated[
        Path | None, typer.Option("--scheduler-file", metavar="FILE", help="The same, by the scheduler's file.")
    ] = None,
    max_points: Annotated[
        int, typer.Option("--max-points", metavar="N", min=1, help="Refuse a sweep of more points.")
    ] = 10**9,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell how many points and trajectories, bytes and minutes.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run every model over a sweep and store post-impact velocities and their errors."""
    with door.signals() as stopping:
        from .. import api
        from ..data import store, survey, work
        from ..data.sweeping import sweep_into
        from . import progress, summary

        who = Who(jobs, threads, scheduler, scheduler_file)
        plan = api.prepare(config, sets or (), plugins or (), max_points)
        if dry_run:
            from .dry_run import tell_of

            tell_of(plan, max(jobs, threads), as_json=as_json)
            if stopping():
                raise UnfinishedError("nothing was written")
            return
        found = None if overwrite else survey.held(output, plan)
        fresh = found is None
        if found is not None:
            work.tidy(output, plan)
            if stopping():
                raise UnfinishedError(f"{safe_text(str(output))} already holds this sweep")
        else:
            for source in (config, *(plugins or ())):
                store.check_output(output, overwrite=overwrite, source=source)
            with who.team(quiet=quiet) as team, progress.progress(quiet=quiet) as tell:
                found = sweep_into(
                    output, plan, resume=resume, overwrite=overwrite, team=team, tell=tell,
                    stopping=stopping,
                )  # fmt: skip
            if stopping():
                raise UnfinishedError(f"{safe_text(str(output))} was stored whole")
    told = summary.summary(found, output)
    if not quiet:
        if fresh:
            with door.readers_may_leave(sys.stderr):
                summary.print_summary(found, told)
        else:
            door.say(f"{safe_text(str(output))}: already holds this sweep; nothing to do")
    if as_json:
        print(dump(told))
    if told["failed"] and not allow_failed:
        if quiet or not fresh:
            door.say(summary.failed_line(told), error=True)
        raise typer.Exit(door.LANES_FAILED)
