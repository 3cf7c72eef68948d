"""The command `recommend`: the models of a result, ranked by the error of their restitution."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from .console import dump
from .options import JsonOption, ModelOption, ResultArgument, SelectOption
from .params import parse_number

if TYPE_CHECKING:
    from ..results.ranking import Ranking

# rows of the table; the rest is only counted
MAX_ROWS = 30


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
    if as_json:
        print(dump(ranking_json(ranking)))
    else:
        _print_ranking(ranking)


def ranking_json(ranking: Ranking) -> dict[str, Any]:
    """A ranking as plain data."""
    return {
        "headline": ranking.headline,
        "tol": ranking.tol,
        "best": [row.model for row in ranking.best],
        "models": [{**vars(row), "share": row.share} for row in ranking.models],
    }


def _print_ranking(ranking: Ranking) -> None:
    """Print a summary sentence and a table of the models, the best first."""
    from .console import cell, console, table

    out = console(sys.stdout)
    out.print(ranking.headline, soft_wrap=True)
    rows = table(*ranking.headings)
    for column in rows.columns[5:]:
        column.justify = "left"
    for row in ranking.models[:MAX_ROWS]:
        rows.add_row(*map(cell, row.row))
    out.print()
    out.print(rows)
    more = len(ranking.models) - MAX_ROWS
    if more > 0:
        out.print(f"and {more:,} more (--json has all)")
