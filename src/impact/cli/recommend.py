"""The command `recommend`: the models of a result, ranked by the error of their restitution."""

from __future__ import annotations

from typing import Annotated

import typer

import impact

from ..display import show
from .options import JsonOption, ModelOption, ResultArgument, SelectOption
from .parsing import parse_number


def recommend(
    result: ResultArgument,
    tol: Annotated[
        float,
        typer.Option(
            "--tol", metavar="VALUE", parser=parse_number, help="Largest accepted |e_out − e|, such as 0.02 or 2%."
        ),
    ] = 0.01,
    sel: SelectOption = None,
    model: ModelOption = None,
    as_json: JsonOption = False,
) -> None:
    """Rank the models of a result by the error of their restitution over the swept range."""

    ranking = impact.recommend(impact.load(result), tol=tol, sel=dict(sel or ()), models=model)
    show(ranking, as_json=as_json)
