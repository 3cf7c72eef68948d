"""The command `recommend`: which model gives the restitution asked for, and how wrong the others are."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Json
from .words import dump, number, pairs

if TYPE_CHECKING:
    from ..results.ranking import Ranked, Ranking

# of a longer ranking the table shows the beginning
ROWS = 30


def recommend(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`.")],
    tol: Annotated[
        float,
        typer.Option(
            "--tol", metavar="VALUE", parser=number, help="What the restitution may be off by, |e_out − e|."
        ),
    ] = 0.01,
    sel: Annotated[
        list[str] | None,
        typer.Option("--sel", metavar="NAME=VALUE", help="Value of an axis; may be repeated. \\[default: all]"),
    ] = None,
    model: Annotated[
        list[str] | None, typer.Option("--model", metavar="KEY", help="A model to rank; may be repeated.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Which model gives the restitution asked for over the swept range, and how wrong is it where it does not?"""
    from .. import api

    ranking = api.recommend(api.load(result), tol=tol, sel=pairs("--sel", sel), models=model)
    if as_json:
        print(dump(ranking_json(ranking)))
    else:
        _print_ranking(ranking)


def ranking_json(ranking: Ranking) -> dict[str, Any]:
    """A ranking as plain data."""
    return {
        "headline": ranking.headline, "tol": ranking.tol, "best": [one.model for one in ranking.best],
        "models": [{**vars(one), "share": one.share} for one in ranking.models],
    }  # fmt: skip


def _print_ranking(ranking: Ranking) -> None:
    """The answer in a sentence, and the models, a line each, the best first."""
    from .console import cell, console, table

    out = console(sys.stdout)
    out.print(ranking.headline, soft_wrap=True)
    rows = table(
        "model", f"within {ranking.tol:g}", "max error", "mean error", "failed", "worst point", "e served"
    )
    for column in rows.columns[5:]:
        column.justify = "left"
    for one in ranking.models[:ROWS]:
        errors = (f"{error:.3g}" if error == error else "–" for error in (one.max_error, one.mean_error))
        texts = cell(_worst(one)), cell(_served(one))
        rows.add_row(cell(one.model), one.percent, *errors, f"{one.failed:,}", *texts)
    out.print()
    out.print(rows)
    more = len(ranking.models) - ROWS
    if more > 0:
        out.print(f"and {more:,} more (--json has all)")


def _worst(one: Ranked) -> str:
    """Where a model is worst, and what it delivers there."""
    from .console import shown

    at = ", ".join(f"{name}={shown(value)}" for name, value in one.at.items())
    return f"{at}: e_out {one.e_out:.4g}" if at else "–"


def _served(one: Ranked) -> str:
    """The ranges of e that a model serves."""
    from .console import shown

    if one.served is None:
        return "–"
    ranges = (shown(least) + (f" to {shown(most)}" if most > least else "") for least, most in one.served)
    return ", ".join(ranges) or "nowhere"
