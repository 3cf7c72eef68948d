"""The commands that store more of a result: expand and extend."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import UnfinishedError, UsageError
from ..text import safe_text
from . import door
from .options import AllowFailed, Jobs, Json, MaxPoints, Overwrite, Plugins, Quiet, Threads
from .who import Who
from .words import pairs


def expand(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`, of either layout.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")],
    sel: Annotated[
        list[str] | None,
        typer.Option("--sel", metavar="NAME=VALUE", help="Value of an axis; may be repeated. \\[default: all]"),
    ] = None,
    model: Annotated[
        list[str] | None, typer.Option("--model", metavar="KEY", help="A model to keep; may be repeated.")
    ] = None,
    overwrite: Overwrite = False,
    max_points: MaxPoints = 10**9,
) -> None:
    """Write a result, or a part of it, with all of its values: for programs that read netCDF and not impact."""
    with door.signals() as stopping:
        from .. import api
        from ..results import backend
        from ..results.select import places_of, select

        backend.check_output(output, overwrite=overwrite, source=result)
        dataset = select(backend.open_result(result), pairs("--sel", sel))
        if "model" not in dataset.dims:
            raise UsageError(f"{safe_text(str(result))}: is a time history, expected a result of a sweep")
        if model:
            dataset = dataset.isel(model=places_of(model, dataset))
        points = 1
        for size in dataset.sizes.values():
            points *= size
        if points > max_points:
            raise UsageError(
                f"{safe_text(str(result))}: got {points:,} points, expected at most {max_points:,} "
                "(--max-points); select a part, such as --sel e=0.5"
            )
        api.save(dataset, output, overwrite=overwrite, should_stop=stopping)
    door.say(f"{safe_text(str(output))}: {points:,} points, {output.stat().st_size:,} bytes")


def extend(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`, of either layout.")],
    sets: Annotated[
        list[str],
        typer.Option(
            "--set",
            metavar="PATH=VALUE",
            help="More values of an axis, such as sweep.m2=[1.0, 2.0], or more models; may be repeated. "
            "Values that the result has stay.",
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The larger result. \\[default: the result itself]")
    ] = None,
    plugins: Plugins = None,
    overwrite: Overwrite = False,
    allow_failed: AllowFailed = False,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an extension that was interrupted.")] = False,
    jobs: Jobs = 1,
    threads: Threads = 1,
    max_points: MaxPoints = 10**9,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Add values to the axes of a result: only what is new is integrated, and it equals the sweep done at once."""
    with door.signals() as stopping:
        from ..engine.plugins import read_plugins
        from ..results import extend as extending
        from . import progress, summary

        target = output or result
        who = Who(jobs, threads, None, None)
        with who.team(quiet=quiet, should_stop=stopping) as team, progress.progress(quiet=quiet) as tell:
            survey, integrated = extending.extend(
                result, target, sets, read_plugins(plugins or ()), resume=resume, overwrite=overwrite,
                max_points=max_points, team=team, tell=tell, should_stop=stopping,
            )  # fmt: skip
        if stopping():
            raise UnfinishedError(f"{safe_text(str(target))} was stored whole")
    if not quiet:
        door.say(f"{integrated:,} of {survey.trajectories:,} trajectories were integrated for it")
    summary.conclude(survey, target, fresh=True, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
