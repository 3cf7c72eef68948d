"""The command `timestep`: which restitution does a code deliver at a fixed time step?"""

from __future__ import annotations

from typing import Annotated

import typer

import impact

from ..display import TableForm, check_table_output, show, write_table
from . import exits, options
from .completion import complete_scheme


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
            "Find the number of steps per contact with which every phase is within this relative tolerance, "
            "such as 0.01 or 1%.",
        ),
    ] = None,
    parameter: options.Parameter = None,
    scheme: Annotated[
        str | None,
        options.value(
            "NAME",
            "How a step is computed: kick-drift, drake-tamsi (also LAGGED and SIMILAR), drake-sap "
            "(where --for takes relaxation_time too) or pybullet. "
            "\\[default: drake-tamsi for laws of Drake, else kick-drift]",
            complete_scheme,
        ),
    ] = None,
    friction: options.FrictionKey = None,
    sets: options.Set = None,
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
    result = impact.timestep(
        model,
        source=source,
        at=dict(at or ()),
        steps_per_contact=steps_per_contact or (),
        dt=dt or (),
        phases=phases,
        tol=tol,
        parameter=parameter,
        scheme=scheme,
        friction=friction,
        overrides=sets or (),
        plugins=plugins or (),
    )
    for warning in result.warnings:
        exits.print_line(f"warning: {warning}")
    if output is not None:
        write_table(result, output, form, overwrite=overwrite)
    show(result, as_json=as_json)
    exits.print_written(output)
    if any(row.failed for row in result.rows):
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
