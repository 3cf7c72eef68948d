"""The commands that look for a parameter, a time step or a law: solve, timestep and calibrate."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import TableForm, check_table_output, show, write_table
from . import exits, options
from .completion import complete_input, complete_scheme, complete_unknown


def solve(
    model: options.ModelKey,
    name: Annotated[
        str,
        options.value(
            "PARAMETER",
            "What to solve for: a parameter of the model or of the friction law, e (to enter), K, or mu.",
            complete_unknown,
            names=["--for"],
        ),
    ],
    target: Annotated[options.NamedValue, options.target("The wanted output, such as e_out=0.6 or beta=0.4.")],
    source: options.Source = None,
    friction: options.FrictionKey = None,
    at: options.At = None,
    over: Annotated[
        options.NamedValue | None,
        options.value(
            "NAME=FIRST:LAST:COUNT",
            "Find the value that serves best over a range of an input, such as v1=0.1:3:30.",
            complete_input,
            options.parse_range,
        ),
    ] = None,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    as_json: options.Json = False,
) -> None:
    """Find the parameter, K, mu, or requested e that produces a target output.

    All values that give the target are printed, or the range that can be attained.

    With --over it is one value: that with the least largest distance from the target over the range.
    """
    show(options.call(impact.solve, locals()), as_json=as_json)


def timestep(
    model: options.ModelKey,
    source: options.Source = None,
    at: options.At = None,
    steps_per_contact: Annotated[
        list[float] | None,
        options.number(
            "N",
            "Contact time of the continuous law over the time step; may be repeated. \\[default: 10, 20, 50, 100]",
        ),
    ] = None,
    dt: Annotated[
        list[str] | None,
        options.value("SECONDS", 'A time step \\[s], or with a unit, such as "2 us"; may be repeated.'),
    ] = None,
    phases: Annotated[int, options.whole_number("Phases at which the contact begins.")] = 400,
    tol: Annotated[
        float | None,
        options.number(
            "VALUE",
            "Find the number of steps per contact with which e is within this relative tolerance at every phase, "
            "such as 0.01 or 1%.",
        ),
    ] = None,
    parameter: options.Parameter = None,
    scheme: Annotated[
        str | None,
        options.value(
            "NAME",
            "How a step is computed: kick-drift, drake-tamsi (also LAGGED and SIMILAR), drake-sap "
            "(where --for takes relaxation_time too), pybullet, or mujoco-cone with mujoco-elliptic. "
            "\\[default: drake-tamsi for laws of Drake, else kick-drift]",
            complete_scheme,
        ),
    ] = None,
    friction: options.FrictionKey = None,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    output: options.Table = None,
    rows: options.Rows = None,
    digits: options.Digits = None,
    decimal: options.Decimal = "point",
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Show which restitution a code delivers at a fixed time step, and which e to enter.

    The restitution depends on the phase, the part of a step in which the contact begins.

    The table has its mean, least and largest value over all phases; with a friction law, of beta too.

    If a phase fails, its step has none of them, and the exit code is 3.
    """
    form = TableForm(rows, digits, decimal)
    check_table_output(output, form, overwrite=overwrite)
    result = options.call(impact.timestep, locals())
    for warning in result.warnings:
        exits.print_line(f"warning: {warning}")
    if output is not None:
        write_table(result, output, form, overwrite=overwrite)
    show(result, as_json=as_json)
    exits.print_written(output)
    if any(row.failed for row in result.rows):
        raise typer.Exit(exits.EXIT_POINTS_FAILED)


def calibrate(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[data] and { fit = \\[least, most] }.")],
    output: Annotated[
        Path | None, options.output("The result file, or of its table .csv, .tex or .parquet. \\[default: none]")
    ] = None,
    overwrite: options.Overwrite = False,
    best: Annotated[
        Path | None, options.value("FILE", "Write the config of the best law with its parameters.")
    ] = None,
    model: Annotated[str | None, options.model("The law of --best, in place of the one that fits best.")] = None,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    jobs: options.Jobs = 1,
    rows: options.Rows = None,
    digits: options.Digits = None,
    decimal: options.Decimal = "point",
    as_json: options.Json = False,
) -> None:
    """Fit laws to measurements, and rank them.

    Intervals are those of 95 % by profile likelihood. A parameter that the data do not determine has none.
    """
    form = TableForm(rows, digits, decimal)
    form.check_used(output, "output")
    described = impact.describe(options.call(impact.calibrate, locals(), source=config))
    # in another form than that of the function
    if output is not None and form != TableForm():
        write_table(described, output, form, overwrite=True)
    show(described, as_json=as_json)
    exits.print_written(output, best)
