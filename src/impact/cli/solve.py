"""The command `solve`: which value of a parameter gives the rebound I want?"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..formatting import number, quantity
from .completion import complete_input, complete_target, complete_unknown
from .console import cell, console, dump
from .options import AtOption, JsonOption, ModelKeyOption, PluginOption, SetOption, SourceArgument
from .params import (
    InputRange,
    Target,
    parse_range,
    parse_target,
)

if TYPE_CHECKING:
    from ..inverse.solve import SolveResult


def solve(
    model: ModelKeyOption,
    name: Annotated[
        str,
        typer.Option(
            "--for",
            metavar="PARAMETER",
            autocompletion=complete_unknown,
            help="What to solve for: a parameter of the model, e to ask for, or K.",
        ),
    ],
    target: Annotated[
        Target,
        typer.Option(
            "--target",
            metavar="NAME=VALUE",
            parser=parse_target,
            autocompletion=complete_target,
            help="The wanted output, such as e_out=0.6.",
        ),
    ],
    source: SourceArgument = None,
    at: AtOption = None,
    over: Annotated[
        InputRange | None,
        typer.Option(
            "--over",
            metavar="NAME=FIRST:LAST:COUNT",
            autocompletion=complete_input,
            parser=parse_range,
            help="Find the value that serves best over a range of an input, such as v1=0.1:3:30.",
        ),
    ] = None,
    sets: SetOption = None,
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the value of a parameter, of K, or of the e to ask for, that gives a wanted output.

    All values that give the target are printed, or the range that can be attained.

    With --over it is one value: that with the least largest distance from the target over the range.
    """

    result = impact.solve(
        model,
        name,
        dict([target]),
        source=source,
        at=dict(at or ()),
        over=dict([over]) if over else None,
        overrides=sets or (),
        plugins=plugins or (),
    )
    if as_json:
        print(dump(solve_json(result)))
    else:
        _print_roots(result)


def solve_json(result: SolveResult) -> dict[str, Any]:
    """The result as plain data."""
    return {
        "model": result.model,
        "for": result.name,
        "unit": result.unit,
        "target": dict(result.target),
        "status": result.status,
        "roots": [{"value": root.value, "e_out": root.e_out} for root in result.roots],
        "attainable": result.attainable,
        "over": None if result.over is None else [dict(condition) for condition in result.over],
    }


def _print_roots(result: SolveResult) -> None:
    """One line for each root, or the range that can be attained."""
    out = console(sys.stdout)
    ((variable, wanted),) = result.target.items()
    target = f"{variable} = {number(wanted)}"
    for root in result.roots:
        # a minimum has half the digits of a root
        line = f"{result.name} = {quantity(root.value, result.unit, 10 if result.over is None else 6)}"
        if result.over is None:
            at_bound = ", its bound" if result.status == "at_bound" else ""
            line += f"{at_bound}: {target}" + (f", e_out = {number(root.e_out)}" if variable != "e_out" else "")
        else:
            first, last = result.over[0], result.over[-1]
            name = next(iter(first))
            line += (
                f": {variable} from {number(first[variable])} at {name} = {number(first[name])} "
                f"to {number(last[variable])} at {name} = {number(last[name])}"
            )
        out.print(cell(line), soft_wrap=True)
    if not result.roots:
        least, largest = map(number, result.attainable)
        text = f"{result.model}: no value of {result.name} gives {target}; {variable} is from {least} to {largest}"
        out.print(cell(text), soft_wrap=True)
