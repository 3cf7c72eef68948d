"""The commands that store more of a result: expand and extend."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import UnfinishedError, UsageError
from ..text import safe_text
from . import exits
from .executor_options import ExecutorOptions
from .options import (
    AllowFailed,
    Jobs,
    Json,
    MaxPoints,
    Models,
    Overwrite,
    Plugins,
    Quiet,
    Result,
    Resume,
    Sel,
    Threads,
)  # fmt: skip


def expand(
    result: Result,
    output: Annotated[Path, typer.Option("-o", "--output", help="The file to write.")],
    sel: Sel = None,
    model: Models = None,
    overwrite: Overwrite = False,
    max_points: MaxPoints = 10**9,
) -> None:
    """Write a result, or a part of it, with all of its values: for programs that read netCDF and not impact."""
    with exits.signals() as should_stop:
        from .. import api
        from ..results import backend
        from ..results.selection import model_positions, select

        backend.check_output(output, overwrite=overwrite, source=result)
        dataset = select(backend.open_result(result), dict(sel or ()))
        if "model" not in dataset.dims:
            raise UsageError(f"{safe_text(str(result))}: is a time history, expected a result of a sweep")
        if model:
            dataset = dataset.isel(model=model_positions(model, dataset))
        points = 1
        for size in dataset.sizes.values():
            points *= size
        if points > max_points:
            raise UsageError(
                f"{safe_text(str(result))}: got {points:,} points, expected at most {max_points:,} "
                "(--max-points); select a part, such as --sel e=0.5"
            )
        api.save(dataset, output, overwrite=overwrite, should_stop=should_stop)
    exits.say(f"{safe_text(str(output))}: {points:,} points, {output.stat().st_size:,} bytes")


def extend(
    result: Result,
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
    resume: Resume = False,
    jobs: Jobs = 1,
    threads: Threads = 1,
    max_points: MaxPoints = 10**9,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Add values to the axes of a result: only what is new is integrated, and it equals the sweep done at once."""
    with exits.signals() as should_stop:
        from ..engine.plugins import read_plugins
        from ..results import extend as extending
        from . import progress, summary

        target = output or result
        options = ExecutorOptions(jobs, threads)
        with (
            options.backend(quiet=quiet, should_stop=should_stop) as backend,
            progress.progress(quiet=quiet) as report,
        ):
            outcome, integrated = extending.extend(
                result, target, sets, read_plugins(plugins or ()), resume=resume, overwrite=overwrite,
                max_points=max_points, backend=backend, on_progress=report, should_stop=should_stop,
            )  # fmt: skip
        if should_stop():
            raise UnfinishedError(f"{safe_text(str(target))} was stored whole")
    if not quiet:
        exits.say(f"{integrated:,} of {outcome.trajectories:,} trajectories were integrated for it")
    summary.conclude(outcome, target, fresh=True, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
