"""The command `solve`: which value of a parameter gives the rebound I want?"""

from __future__ import annotations

from typing import Annotated

import typer

import impact

from ..display import show
from .completion import complete_input, complete_target, complete_unknown
from .options import (
    AtOption,
    FrictionKeyOption,
    JsonOption,
    ModelKeyOption,
    PluginOption,
    SetOption,
    SourceArgument,
)
from .parsing import InputRange, Target, parse_range, parse_target


def solve(
    model: ModelKeyOption,
    name: Annotated[
        str,
        typer.Option(
            "--for",
            metavar="PARAMETER",
            autocompletion=complete_unknown,
            help="What to solve for: a parameter of the model or of the friction law, e (to enter), K, or mu.",
        ),
    ],
    target: Annotated[
        Target,
        typer.Option(
            "--target",
            metavar="NAME=VALUE",
            parser=parse_target,
            autocompletion=complete_target,
            help="The wanted output, such as e_out=0.6 or beta=0.4.",
        ),
    ],
    source: SourceArgument = None,
    friction: FrictionKeyOption = None,
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
    """Find the parameter, K, mu, or requested e that produces a target output.

    All values that give the target are printed, or the range that can be attained.

    With --over it is one value: that with the least largest distance from the target over the range.
    """
    result = impact.solve(
        model,
        name,
        dict([target]),
        friction=friction,
        source=source,
        at=dict(at or ()),
        over=dict([over]) if over else None,
        overrides=sets or (),
        plugins=plugins or (),
    )
    show(result, as_json=as_json)
