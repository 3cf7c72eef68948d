"""The command `solve`: which value of a parameter gives the rebound I want?"""

from __future__ import annotations

from typing import Annotated

import impact

from ..display import show
from . import options
from .completion import complete_input, complete_unknown


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
    sets: options.Set = None,
    plugins: options.Plugins = None,
    as_json: options.Json = False,
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
