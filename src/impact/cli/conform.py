"""The command `conform`: does an engine deliver what is asked of it?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import show
from . import exits, options
from .completion import complete_engine


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
        show(impact.conform_engines(program), as_json=as_json)
        return exits.EXIT_OK
    board = impact.conform(
        engines or (),
        adapter=adapter or (),
        suite=suite,
        only=only or (),
        tol=dict(tol or ()) or None,
        timeout=timeout,
        program=program,
        output=output,
        overwrite=overwrite,
    )
    with exits.ignore_broken_pipe():
        show(board, as_json=as_json)
    exits.print_written(output)
    return exits.EXIT_OK if board.passed else exits.EXIT_NOT_EQUAL
