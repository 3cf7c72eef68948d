"""The commands about other programs: export, what to type into a code, and conform, what an engine delivers."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import Table, dump, print_blocks, show
from ..errors import UsageError
from . import exits, options
from .completion import complete_code, complete_engine


def export(
    source: options.Source = None,
    to: Annotated[str | None, options.value("CODE", "The code, see --list.", complete_code)] = None,
    model: Annotated[
        str | None,
        options.model(
            "Key of a law that the code implements. "
            "\\[default: the first of the source or of --list that its release has]"
        ),
    ] = None,
    at: options.At = None,
    dt: Annotated[
        str | None,
        options.value(
            "SECONDS", 'The time step \\[s], or with a unit, such as "2 us". \\[default: contact time/50]'
        ),
    ] = None,
    parameter: options.Parameter = None,
    friction: options.FrictionKey = None,
    code_version: Annotated[
        str | None,
        options.value("VERSION", "Release of the code. \\[default: the installed one, else the newest known]"),
    ] = None,
    script: Annotated[
        bool, typer.Option("--script", help="Write a complete input with two balls that measures its e.")
    ] = False,
    verify: Annotated[
        bool, typer.Option("--verify", help="Run the script and compare its e with the predicted one.")
    ] = False,
    program: Annotated[
        str | None, options.value("FILE", "What runs scripts, such as lmp or a Python with the code's package.")
    ] = None,
    output: Annotated[Path | None, options.output("The file. \\[default: stdout]")] = None,
    overwrite: options.Overwrite = False,
    show_codes: Annotated[bool, typer.Option("--list", help="List the codes and their laws.")] = False,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    as_json: options.Json = False,
) -> int:
    """Write the input lines of a simulation code for a law, and what the code delivers at its time step.

    An e for a law that takes none is reached by its damping parameter.

    With --verify, exit 1 if the code delivers another e, exit 2 if it is not installed.
    """
    if show_codes:
        _check_alone(export, locals(), "show_codes", "as_json")
        _print_codes(as_json)
        return exits.EXIT_OK
    if to is None:
        raise UsageError("--to: expected a code; impact export --list shows them")
    result = options.call(impact.export, locals())
    for warning in result.warnings:
        exits.print_line(f"warning: {warning}")
    exits.print_written(output)
    if as_json or result.verification is not None:
        show(result, as_json=as_json)
    elif output is None:
        exits.write_utf8()
        print(result.text, end="")
    return exits.EXIT_NOT_EQUAL if result.verification and result.verification.differs else exits.EXIT_OK


def _check_alone(command: Callable[..., int], options_used: Mapping[str, object], *accepted: str) -> None:
    """Refuse options that a list of a command would ignore."""
    parameters = inspect.signature(command).parameters
    if any(options_used[name] != parameters[name].default for name in parameters.keys() - accepted):
        raise UsageError("--list: got more than this option, expected it alone")


def _print_codes(as_json: bool) -> None:
    """Print the codes, the laws of each, and what was run."""
    codes = impact.export_codes()
    if as_json:
        print(dump(codes))
        return
    for code in codes:
        installed = code["installed"] or "not installed"
        line = f"{code['code']}: {code['title']} ({installed}; {code['tested']})"
        print_blocks([line, Table(list(code["laws"].items()), ("law", "in the code"), text=(0, 1)), ""])


def conform(
    engines: Annotated[
        list[str] | None,
        typer.Argument(metavar="ENGINE", autocompletion=complete_engine, help="Engines, see --list."),
    ] = None,
    adapter: Annotated[
        list[str] | None,
        options.value(
            "WORDS", 'An adapter of an engine, FILE.py:FUNCTION or "PROGRAM ARGUMENTS"; may be repeated.'
        ),
    ] = None,
    suite: Annotated[str, options.value("NAME", "The set of collisions.")] = "conformance-1",
    only: Annotated[list[str] | None, options.value("ID", "Judge only this collision; may be repeated.")] = None,
    tol: Annotated[
        list[options.NamedValue] | None,
        options.tolerance(
            "[CHECK=]VALUE", "Tolerance of all checks or of one, such as momentum=1e-6 or 5%; may be repeated."
        ),
    ] = None,
    timeout: Annotated[float, options.number("SECONDS", "Time for an answer \\[s].")] = 60.0,
    program: Annotated[
        str | None, options.value("FILE", "A Python that has the package of the engine, or its program.")
    ] = None,
    output: Annotated[
        Path | None, options.output("A page (.html), or a board that impact compare reads (.h5).")
    ] = None,
    overwrite: options.Overwrite = False,
    show_engines: Annotated[bool, typer.Option("--list", help="List the engines.")] = False,
    as_json: options.Json = False,
) -> int:
    """Run a fixed set of impacts in an engine, and judge its answers: momentum, energy, restitution, friction.

    Exit 0 if no check failed, 1 if one did, 2 if the engine cannot be run. Several engines make one board.
    """
    if show_engines:
        _check_alone(conform, locals(), "show_engines", "as_json", "program")
        show(impact.conform_engines(program), as_json=as_json)
        return exits.EXIT_OK
    board = options.call(impact.conform, locals(), engine=engines or ())
    with exits.ignore_broken_pipe():
        show(board, as_json=as_json)
    exits.print_written(output)
    return exits.EXIT_OK if board.passed else exits.EXIT_NOT_EQUAL
