"""The command `timestep`: which restitution does a code deliver at a fixed time step?"""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..formatting import decimals, number, quantity
from . import exits
from .completion import complete_scheme
from .console import cell, console, dump, table
from .options import AtOption, JsonOption, ModelKeyOption, PluginOption, SetOption, SourceArgument
from .params import parse_number, parse_whole_number

if TYPE_CHECKING:
    from ..inverse.timestep import TimestepResult


def timestep(
    model: ModelKeyOption,
    source: SourceArgument = None,
    at: AtOption = None,
    steps_per_contact: Annotated[
        list[float] | None,
        typer.Option(
            "--steps-per-contact",
            metavar="N",
            parser=parse_number,
            help="Contact time of the continuous law over the time step; may be repeated. "
            "\\[default: 10, 20, 50, 100]",
        ),
    ] = None,
    dt: Annotated[
        list[float] | None,
        typer.Option("--dt", metavar="SECONDS", parser=parse_number, help="A time step \\[s]; may be repeated."),
    ] = None,
    phases: Annotated[
        int,
        typer.Option(
            "--phases",
            metavar="N",
            parser=parse_whole_number,
            help="Phases at which the contact begins.",
        ),
    ] = 400,
    tol: Annotated[
        float | None,
        typer.Option(
            "--tol",
            metavar="VALUE",
            parser=parse_number,
            help="Find the number of steps per contact with which every phase is within this relative tolerance, "
            "such as 0.01 or 1%.",
        ),
    ] = None,
    scheme: Annotated[
        str | None,
        typer.Option(
            "--scheme",
            metavar="NAME",
            help="How a step is computed: kick-drift, drake-tamsi (also LAGGED and SIMILAR) or drake-sap. "
            "\\[default: drake-tamsi for laws of Drake, else kick-drift]",
            autocompletion=complete_scheme,
        ),
    ] = None,
    sets: SetOption = None,
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Show which restitution a code delivers at a fixed time step, and which e to ask it for.

    The restitution depends on the phase, the part of a step in which the contact begins.

    The table has its mean, least and largest value over all phases.

    If a phase fails, its step has none of them, and the exit code is 3.
    """

    result = impact.timestep(
        model,
        source=source,
        at=dict(at or ()),
        steps_per_contact=steps_per_contact or (),
        dt=dt or (),
        phases=phases,
        tol=tol,
        scheme=scheme,
        overrides=sets or (),
        plugins=plugins or (),
    )
    if as_json:
        print(dump(timestep_json(result)))
    else:
        _print_table(result, phases, tol)
    if any(row.failed for row in result.rows):
        raise typer.Exit(exits.EXIT_POINTS_FAILED)


def timestep_json(result: TimestepResult) -> dict[str, Any]:
    """The result as plain data; numbers that do not apply are null."""
    return {
        "model": result.model,
        "scheme": result.scheme,
        "e": result.e,
        "e_continuous": result.e_continuous,
        "contact_time": result.contact_time,
        "rows": [asdict(row) for row in result.rows],
        "needed": None if result.needed is None else asdict(result.needed),
    }


def _print_table(result: TimestepResult, phases: int, tol: float | None) -> None:
    """Print the continuous law, a line for each step, the steps that fail, and the number of steps needed."""
    from ..contact.status import Status

    out = console(sys.stdout)
    asked = "" if result.e != result.e else f"e = {number(result.e)}, "
    contact = quantity(result.contact_time, "s")
    out.print(
        cell(f"{result.model}: {asked}e_out = {number(result.e_continuous)} in a contact time of {contact}"),
        soft_wrap=True,
    )
    out.print(cell(f"scheme: {result.scheme}"), soft_wrap=True)
    out.print()
    rows = table("steps per contact", "dt [s]", "e mean", "e least", "e largest", "e to ask")
    rows.columns[0].justify = "right"
    for row in result.rows:
        mean, *others = map(decimals, (row.e_mean, row.e_least, row.e_largest, row.e_to_ask))
        shown = row.status if row.failed else mean
        rows.add_row(number(row.steps_per_contact), number(row.dt), shown, *others)
    out.print(rows)
    failures = [row for row in result.rows if row.failed]
    if failures:
        out.print()
    for row in failures:
        count = f"{row.failed} of {phases} phases fail at {number(row.steps_per_contact)} steps per contact"
        out.print(cell(f"{count}; {Status[row.status.upper()].meaning}"), soft_wrap=True)
    if tol is not None:
        out.print()
        if result.needed is None:
            line = f"no number of steps per contact keeps every phase within {number(100 * tol)} %"
        else:
            steps, dt = result.needed.steps_per_contact, quantity(result.needed.dt, "s")
            line = f"within {number(100 * tol)} % at every phase: {steps} steps per contact, dt <= {dt}"
        out.print(cell(line), soft_wrap=True)
