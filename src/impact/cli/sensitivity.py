"""The command `sensitivity`: which uncertain input matters?"""

from __future__ import annotations

import warnings
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import dump, show
from . import exits, options
from .completion import complete_output
from .execution import execution, run_in_memory


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
    sets: options.Set = None,
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
    outputs = list(dict.fromkeys(of or ["e_out"]))
    with execution(quiet, jobs, threads) as keywords, warnings.catch_warnings():
        if quiet:
            warnings.simplefilter("ignore", impact.ImpactWarning)
        from ..uncertainty.sensitivity import sensitivities

        results = sensitivities(
            config,
            outputs,
            output=output,
            overwrite=overwrite,
            overrides=sets or (),
            plugins=plugins or (),
            max_points=max_points,
            execute=partial(run_in_memory, **keywords),
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
    exits.print_written(output)
    if any(int(result["failed"].sum()) for result in results) and not allow_failed:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
