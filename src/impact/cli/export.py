"""The command `export`: what do I type into my code, and what will it deliver?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..errors import UsageError
from ..formatting import decimals, number
from . import exits
from .completion import complete_code, complete_model
from .console import cell, console, dump, table
from .options import AtOption, JsonOption, OverwriteOption, SetOption, SourceArgument
from .params import parse_number

if TYPE_CHECKING:
    from ..exporters.export import Export
    from ..exporters.verification import Verification


def export(
    source: SourceArgument = None,
    to: Annotated[
        str | None,
        typer.Option("--to", metavar="CODE", autocompletion=complete_code, help="The code, see --list."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            metavar="KEY",
            autocompletion=complete_model,
            help="A law that the code has. \\[default: the first of the source or of --list that its release has]",
        ),
    ] = None,
    at: AtOption = None,
    dt: Annotated[
        float | None,
        typer.Option(
            "--dt",
            metavar="SECONDS",
            parser=parse_number,
            help="The time step \\[s]. \\[default: contact time/50]",
        ),
    ] = None,
    code_version: Annotated[
        str | None,
        typer.Option(
            "--code-version",
            metavar="VERSION",
            help="Release of the code. \\[default: the installed one, else the newest known]",
        ),
    ] = None,
    script: Annotated[
        bool, typer.Option("--script", help="Write a complete input with two balls that measures its e.")
    ] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Run the script and compare its e with the predicted one.")
    ] = False,
    program: Annotated[
        str | None,
        typer.Option(
            "--program", metavar="FILE", help="What runs scripts, such as lmp or a Python with the code's package."
        ),
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The file. \\[default: stdout]")] = None,
    overwrite: OverwriteOption = False,
    show_codes: Annotated[bool, typer.Option("--list", help="List the codes and their laws.")] = False,
    sets: SetOption = None,
    as_json: JsonOption = False,
) -> int:
    """Write a law as a code takes it, with the restitution that the code delivers at its time step.

    An e for a law that takes none is reached by its damping parameter.

    With --verify, exit 1 if the code delivers another e, exit 2 if it is not installed.
    """

    if show_codes:
        _print_codes(as_json)
        return exits.EXIT_OK
    if to is None:
        raise UsageError("--to: expected a code; impact export --list shows them")
    result = impact.export(
        to,
        model,
        source=source,
        at=dict(at or ()),
        dt=dt,
        code_version=code_version,
        program=program,
        script=script,
        verify=verify,
        output=output,
        overwrite=overwrite,
        overrides=sets or (),
    )
    for warning in result.warnings:
        exits.print_line(f"warning: {warning}")
    if output is not None:
        exits.print_line(f"{output}: written")
    if as_json:
        print(dump(export_json(result)))
    elif result.verification is not None:
        _print_verification(result, result.verification)
    elif output is None:
        print(result.text, end="")
    return exits.EXIT_OK if result.verification is None or result.verification.agrees else exits.EXIT_NOT_EQUAL


def export_json(result: Export) -> dict[str, Any]:
    """The result as plain data; numbers that do not apply are null."""
    row = result.at_dt
    data: dict[str, Any] = {
        "code": result.code,
        "version": result.version,
        "model": result.model,
        "scheme": result.scheme,
        "e": result.e,
        "e_continuous": result.e_continuous,
        "contact_time": result.contact_time,
        "e_at_dt": {"dt": row.dt, "mean": row.e_mean, "least": row.e_least, "largest": row.e_largest},
        "e_to_ask": row.e_to_ask,
        "parameters": dict(result.parameters),
        "lines": list(result.lines),
        "header": list(result.header),
        "warnings": list(result.warnings),
    }
    if result.script is not None:
        data["script"] = result.script
    verification = result.verification
    if verification is not None:
        data["verification"] = {
            "program": verification.program,
            "agrees": verification.agrees,
            "uncertainty": verification.uncertainty,
            "rows": [
                {"dt": dt, "phase": phase, "measured": measured, "predicted": predicted}
                for dt, phase, measured, predicted in zip(
                    verification.dt,
                    verification.phases,
                    verification.measured,
                    verification.predicted,
                    strict=True,
                )
            ],
        }
    return data


def _print_verification(result: Export, verification: Verification) -> None:
    """Print what the code delivers beside what is predicted."""
    out = console(sys.stdout)
    steps = number(result.at_dt.steps_per_contact)
    out.print(cell(f"{result.code} {result.version}, {result.model}, {steps} steps per contact"), soft_wrap=True)
    out.print()
    rows = table("dt [s]", "phase", "measured", "predicted", "difference")
    for dt, phase, measured, predicted in zip(
        verification.dt, verification.phases, verification.measured, verification.predicted, strict=True
    ):
        rows.add_row(
            number(dt),
            number(phase),
            decimals(measured, 12),
            decimals(predicted, 12),
            number(measured - predicted, 2),
        )
    out.print(rows)
    out.print()
    word = "agrees" if verification.agrees else "DIFFERS"
    largest = f"largest difference {number(verification.difference, 2)}"
    line = f"{word}: {verification.not_numbers or largest}, uncertainty {number(verification.uncertainty, 2)}"
    out.print(cell(line), soft_wrap=True)


def _print_codes(as_json: bool) -> None:
    """Print the codes, the laws of each, and what was run."""

    codes = impact.export_codes()
    if as_json:
        print(dump(codes))
        return
    out = console(sys.stdout)
    for code in codes:
        installed = code["installed"] or "not installed"
        out.print(cell(f"{code['code']}: {code['title']} ({installed}; {code['tested']})"), soft_wrap=True)
        rows = table("law", "in the code")
        rows.columns[1].justify = "left"
        for key, name in code["laws"].items():
            rows.add_row(key, name)
        out.print(rows)
        out.print()
