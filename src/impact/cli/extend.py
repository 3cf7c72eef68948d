"""The commands that write a changed result: expand and extend."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import impact

from . import exits, options
from .execution import execution, print_summary_and_exit


def expand(
    result: options.Result,
    output: Annotated[Path, options.output("The file to write.")],
    sel: options.Select = None,
    model: options.Models = None,
    overwrite: options.Overwrite = False,
    max_points: options.MaxPoints = 10**9,
) -> None:
    """Write all values of a result, or of a part of it, as netCDF for programs that do not use impact."""
    with exits.catch_signals() as should_stop:
        points = impact.expand(
            result,
            output,
            sel=dict(sel or ()),
            models=model,
            overwrite=overwrite,
            max_points=max_points,
            should_stop=should_stop,
        )
    exits.print_line(f"{output}: {points:,} points, {output.stat().st_size:,} bytes")


def extend(
    result: options.Result,
    sets: Annotated[
        list[str],
        options.value(
            "PATH=VALUE",
            "More values of an axis, such as sweep.m2=[1.0, 2.0], or more models; may be repeated. "
            "Existing values are kept.",
            names=["--set"],
        ),
    ],
    output: Annotated[Path | None, options.output("The larger result. \\[default: the result itself]")] = None,
    plugins: options.Plugins = None,
    overwrite: options.Overwrite = False,
    allow_failed: options.AllowFailed = False,
    resume: options.Resume = False,
    jobs: options.Jobs = 1,
    threads: options.Threads = 1,
    max_points: options.MaxPoints = 10**9,
    quiet: options.Quiet = False,
    as_json: options.Json = False,
) -> None:
    """Add values to the axes of a result; only what it does not hold is integrated."""
    with execution(quiet, jobs, threads) as keywords:
        outcome = impact.extend_to_file(
            result,
            sets,
            output=output,
            resume=resume,
            overwrite=overwrite,
            plugins=plugins or (),
            max_points=max_points,
            **keywords,
        )
    if not quiet:
        reason = "; layout full holds none of them" if outcome.extended_layout == "full" else ""
        count = f"{outcome.integrated:,} of {outcome.trajectories:,} trajectories were integrated for it"
        exits.print_line(count + reason)
    print_summary_and_exit(outcome, quiet=quiet, as_json=as_json, allow_failed=allow_failed)
