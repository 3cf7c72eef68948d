"""The command `sensitivity`: which uncertain input matters?"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import impact

from ..display import dump, show
from . import exits
from .completion import complete_output
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

        results = impact.sensitivities(
            config,
            outputs,
            output=output,
            overwrite=overwrite,
            overrides=sets or (),
            plugins=plugins or (),
            max_points=max_points,
            execute=run_plan,
        )
    descriptions = [impact.describe(result) for result in results]
    if as_json:
        studies = [study for description in descriptions for study in description.as_dict()["studies"]]
        print(dump(studies[0] if len(studies) == 1 else studies))
    else:
        for position, description in enumerate(descriptions):
            if position:
                print()
            show(description)
    if output is not None:
        exits.print_line(f"{output}: written")
    if any(int(result["failed"].sum()) for result in results) and not allow_failed:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
