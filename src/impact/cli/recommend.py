"""The command `recommend`: the models of a result, ranked by the error of their restitution."""

from __future__ import annotations

from typing import Annotated

import typer

import impact

from ..display import TableForm, check_table_output, show, write_table
from . import exits
from .completion import complete_target
from .options import (
    DecimalOption,
    DigitsOption,
    FrictionOption,
    JsonOption,
    ModelOption,
    OverwriteOption,
    ResultArgument,
    RowsOption,
    SelectOption,
    TableOption,
)
from .parsing import Target, parse_number, parse_target


def recommend(
    result: ResultArgument,
    tol: Annotated[
        float,
        typer.Option(
            "--tol",
            metavar="VALUE",
            parser=parse_number,
            help="Largest accepted |e_out − e|, or distance from the target, such as 0.02 or 2%.",
        ),
    ] = 0.01,
    target: Annotated[
        Target | None,
        typer.Option(
            "--target",
            metavar="NAME=VALUE",
            parser=parse_target,
            autocompletion=complete_target,
            help="The wanted output, such as beta=0.4. \\[default: e_out, compared with e]",
        ),
    ] = None,
    sel: SelectOption = None,
    model: ModelOption = None,
    friction: FrictionOption = None,
    output: TableOption = None,
    rows: RowsOption = None,
    digits: DigitsOption = None,
    decimal: DecimalOption = "point",
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
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
    if output is not None:
        exits.print_line(f"{output}: written")
