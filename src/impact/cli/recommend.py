"""The command `recommend`: the models of a result, ranked by the error of their restitution."""

from __future__ import annotations

from typing import Annotated

import impact

from ..display import TableForm, check_table_output, show, write_table
from . import exits, options


def recommend(
    result: options.Result,
    tol: Annotated[
        str,
        options.value(
            "VALUE", "Largest accepted |e_out − e|, or distance from the target, such as 0.02, 2% or 1deg."
        ),
    ] = "0.01",
    target: Annotated[
        options.NamedValue | None,
        options.target("The wanted output, such as beta=0.4. \\[default: e_out, compared with e]"),
    ] = None,
    sel: options.Select = None,
    model: options.Models = None,
    friction: options.Frictions = None,
    output: options.Table = None,
    rows: options.Rows = None,
    digits: options.Digits = None,
    decimal: options.Decimal = "point",
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Rank the models of a result by the error of their restitution over the swept range.

    With --target, rank them, or their pairs with friction laws, by the distance of an output from it.
    """
    form = TableForm(rows, digits, decimal)
    check_table_output(output, form, overwrite=overwrite)
    ranking = impact.recommend(
        impact.load(result),
        tol=tol,
        sel=dict(sel or ()),
        models=model,
        target=dict([target]) if target else None,
        frictions=friction,
    )
    if output is not None:
        write_table(ranking, output, form, overwrite=overwrite)
    show(ranking, as_json=as_json)
    exits.print_written(output)
