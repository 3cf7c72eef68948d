"""The command `sensitivity`: which uncertain input matters?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..text import safe_text
from . import exits
from .completion import complete_output
from .console import cell, console, dump, table
from .options import (
    AllowFailedOption,
    JobsOption,
    JsonOption,
    MaxPointsOption,
    OverwriteOption,
    PluginOption,
    QuietOption,
    SetOption,
    ThreadsOption,
)

if TYPE_CHECKING:
    import xarray as xr

    from ..engine.plan import Plan


def sensitivity(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[design] and distributions.")],
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="OUTPUT",
            autocompletion=complete_output,
            help="The output, such as peak_force; may be repeated. \\[default: e_out]",
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The result file. \\[default: none]")
    ] = None,
    overwrite: OverwriteOption = False,
    sets: SetOption = None,
    plugins: PluginOption = None,
    jobs: JobsOption = 1,
    threads: ThreadsOption = 1,
    max_points: MaxPointsOption = 10**9,
    allow_failed: AllowFailedOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find which uncertain input matters: Sobol indices of an output, its mean and quantiles.

    Intervals are those of 95 % by bootstrap. For d uncertain inputs, n (d + 2) points are computed.

    Of several outputs each has its own tables, and --json is a list.
    """
    outputs = list(dict.fromkeys(of or ["e_out"]))
    with exits.catch_signals() as should_stop:
        from ..engine.executors import choose_executor
        from ..progress_display import progress_bar

        executor = choose_executor(jobs, threads)

        def run_plan(plan: Plan) -> xr.Dataset:
            with progress_bar(exits.print_line, quiet=quiet) as on_progress:
                from ..engine.run import Run
                from ..results.sweep import sweep_in_memory

                return sweep_in_memory(plan, Run(executor, on_progress=on_progress, should_stop=should_stop))

        from ..api import sensitivities

        results = sensitivities(
            config,
            of=outputs,
            output=output,
            overwrite=overwrite,
            overrides=sets or (),
            plugins=plugins or (),
            max_points=max_points,
            execute=run_plan,
        )
    if as_json:
        studies = [study for result in results for study in studies_json(result)]
        print(dump(studies[0] if len(studies) == 1 else studies))
    else:
        for position, result in enumerate(results):
            if position:
                print()
            print_studies(result)
    if output is not None:
        exits.print_line(f"{safe_text(str(output))}: written")
    if any(int(result["failed"].sum()) for result in results) and not allow_failed:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)


def studies_json(result: xr.Dataset) -> list[dict[str, Any]]:
    """The study of each model at each point of the other axes as plain data."""
    from ..results.attributes import read_attribute
    from ..results.sensitivity import HALF, iterate_studies

    design = read_attribute(result.attrs, "design")
    studies = []
    for point, study in iterate_studies(result):
        ends = [f"{name}{end}" for name in ("first", "total") for end in ("", "_lower", "_upper")]
        studies.append(
            {
                "model": point.pop("model"),
                "at": point,
                "of": result.attrs["of"],
                **{name: design[name] for name in ("n", "method", "seed")},
                "failed": int(study["failed"]),
                "mean": float(study["mean"]),
                "sd": float(study["sd"]),
                "quantiles": {
                    f"{probability:g}": float(value)
                    for probability, value in zip(study["quantile"].values, study["quantiles"].values, strict=True)
                },
                "indices": [
                    {"input": str(row["input"].item())} | {name: float(row[name]) for name in (*ends, *HALF)}
                    for row in (study.isel(input=position) for position in range(study.sizes["input"]))
                ],
            }
        )
    return studies


def print_studies(result: xr.Dataset) -> None:
    """Print a table of indices for each model and each point of the other axes."""
    from ..results.replay_command import describe_point
    from ..results.sensitivity import INDEX_HEADINGS, describe_design, describe_study, index_rows, iterate_studies

    out = console(sys.stdout)
    out.print(cell(describe_design(result)), soft_wrap=True)
    for point, study in iterate_studies(result):
        out.print()
        out.print(cell(describe_point(point)), soft_wrap=True)
        out.print(cell(describe_study(study)), soft_wrap=True)
        if study["total"].notnull().any():
            rows = table(*INDEX_HEADINGS)
            for row in index_rows(study):
                rows.add_row(*map(cell, row))
            out.print(rows)
