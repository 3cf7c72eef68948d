"""The command `sweep`: from a TOML file to a result, or to what it would take."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import UnfinishedError, UsageError
from ..text import safe_text
from . import door
from .options import AllowFailed, Jobs, Json, MaxPoints, Output, Overwrite, Plugins, Quiet, Sets, Threads
from .who import Who


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: Output = Path("results.h5"),
    sets: Sets = None,
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: AllowFailed = False,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with a sweep that was interrupted.")] = False,
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
        bool, typer.Option("--dry-run", help="Only tell how many points and trajectories, bytes and minutes.")
    ] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Run every model over a sweep and store post-impact velocities and their errors."""
    with door.signals() as stopping:
        from .. import api
        from ..engine import checkpoint
        from ..results import backend
        from ..results.plausibility import material_notes
        from ..results.sweep import finished, sweep_into
        from . import progress, summary

        who = Who(jobs, threads, scheduler, scheduler_file)
        plan = api.prepare(config, sets or (), plugins or (), max_points)
        if not quiet:
            for note in material_notes({name: vars(one) for name, one in plan.materials_used.items()}):
                door.say(f"note: {safe_text(str(config))}: {note}")
        if shard is not None:
            from .shards import do

            if dry_run:
                raise UsageError(f"--shard {safe_text(shard)}: given beside --dry-run, which tells of the whole")
            changes = [word for one in sets or () for word in ("--set", one)]
            own = [word for one in plugins or () for word in ("--plugin", str(one))]
            command = ["impact", "sweep", str(config), "-o", str(output), *changes, *own]
            do(
                plan,
                shard,
                command,
                output,
                who,
                overwrite=overwrite,
                quiet=quiet,
                as_json=as_json,
                should_stop=stopping,
            )
            return
        if dry_run:
            from .dry_run import tell_of

            tell_of(plan, max(jobs, threads), as_json=as_json)
            if stopping():
                raise UnfinishedError("nothing was written")
            return
        found = None if overwrite else finished(output, plan)
        fresh = found is None
        if found is not None:
            checkpoint.tidy(output, plan)
            if stopping():
                raise UnfinishedError(f"{safe_text(str(output))} already holds this sweep")
        else:
            for source in (config, *(plugins or ())):
                backend.check_output(output, overwrite=overwrite, source=source)
            with who.team(quiet=quiet, should_stop=stopping) as team, progress.progress(quiet=quiet) as tell:
                found = sweep_into(
                    output, plan, resume=resume, overwrite=overwrite, team=team, tell=tell,
                    should_stop=stopping,
                )  # fmt: skip
            if stopping():
                raise UnfinishedError(f"{safe_text(str(output))} was stored whole")
    summary.conclude(found, output, fresh=fresh, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
