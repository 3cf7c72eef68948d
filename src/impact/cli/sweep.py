"""The commands that write a result: sweep (also a shard or a dry run), merge, expand, extend and sensitivity."""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import Wrapped, dump, print_blocks, show
from ..errors import UnfinishedError, UsageError
from . import exits, options
from .completion import complete_output
from .execution import execution, print_summary_and_exit, run_in_memory


def sweep(
    config: Annotated[Path, typer.Argument(help="The sweep, a TOML file; `impact init` writes one.")],
    output: options.Output = Path("results.h5"),
    overrides: options.Set = None,
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

        keywords["on_note"] = print_note
        if dry_run:
            if shard is not None:
                raise UsageError(f"--shard {shard}: got --dry-run as well, which estimates the whole sweep")
            expected = options.call(
                impact.estimate, locals(), source=config, jobs=max(jobs, threads), on_note=print_note
            )
            show(expected, as_json=as_json)
            if not as_json and (scheduler or scheduler_file):
                print_blocks([Wrapped(expected.workers_line)])
            if keywords["should_stop"]():
                raise UnfinishedError("nothing was written")
            return
        if shard is not None:
            done = options.call(impact.sweep_shard, locals(), source=config, **keywords)
        else:
            outcome = options.call(impact.sweep_to_file, locals(), source=config, **keywords)
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
    with execution(quiet) as keywords:
        # nothing is integrated
        del keywords["backend"]
        outcome = options.call(impact.merge, locals(), **keywords)
    if outcome.repeated_blocks and not quiet:
        exits.print_line(f"{outcome.repeated_blocks:,} blocks were in more than one folder, with the same bits")
    print_summary_and_exit(outcome, quiet=quiet, as_json=as_json, allow_failed=allow_failed)


def expand(
    result: options.Result,
    output: Annotated[Path, options.output("The file to write.")],
    sel: options.Select = None,
    models: options.Models = None,
    overwrite: options.Overwrite = False,
    max_points: options.MaxPoints = 10**9,
) -> None:
    """Write all values of a result, or of a part of it, as netCDF for programs that do not use impact."""
    with exits.catch_signals() as should_stop:
        points = options.call(impact.expand, locals(), should_stop=should_stop)
    exits.print_line(f"{output}: {points:,} points, {output.stat().st_size:,} bytes")


def extend(
    result: options.Result,
    overrides: Annotated[
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
        outcome = options.call(impact.extend_to_file, locals(), **keywords)
    if outcome.is_new and not quiet:
        reason = "; layout full holds none of them" if outcome.extended_layout == "full" else ""
        count = f"{outcome.integrated:,} of {outcome.trajectories:,} trajectories were integrated for it"
        exits.print_line(count + reason)
    print_summary_and_exit(outcome, quiet=quiet, as_json=as_json, allow_failed=allow_failed)


def sensitivity(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[design] and distributions.")],
    of: Annotated[
        list[str] | None,
        options.value(
            "OUTPUT", "The output, such as peak_force; may be repeated. \\[default: e_out]", complete_output
        ),
    ] = None,
    output: Annotated[Path | None, options.output("The result file. \\[default: none]")] = None,
    overwrite: options.Overwrite = False,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    jobs: options.Jobs = 1,
    threads: options.Threads = 1,
    max_points: options.MaxPoints = 10**9,
    allow_failed: options.AllowFailed = False,
    quiet: options.Quiet = False,
    as_json: options.Json = False,
) -> None:
    """Find which uncertain input matters: Sobol indices of an output, its mean and quantiles.

    Intervals are those of 95 % by bootstrap. For d uncertain inputs, n (d + 2) points are computed.

    Of several outputs each has its own tables, and --json is a list.
    """
    with execution(quiet, jobs, threads) as keywords, warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore", impact.ImpactWarning)
        from ..uncertainty.sensitivity import sensitivities

        outputs, execute = dict.fromkeys(of or ["e_out"]), partial(run_in_memory, **keywords)
        results = options.call(sensitivities, locals(), source=config, of=[*outputs], execute=execute)
    descriptions = [impact.describe(result) for result in results]
    if as_json:
        studies = [study for description in descriptions for study in description.as_dict()["studies"]]
        print(dump(studies[0] if len(studies) == 1 else studies))
    else:
        for position, description in enumerate(descriptions):
            if position:
                print()
            show(description)
    exits.print_written(output)
    if any(int(result["failed"].sum()) for result in results) and not allow_failed:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
