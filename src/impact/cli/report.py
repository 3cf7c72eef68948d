"""The commands that judge or show a whole result: recommend, report and page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
    models: options.Models = None,
    frictions: options.Frictions = None,
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
    ranking = options.call(impact.recommend, locals(), dataset=impact.load(result))
    if output is not None:
        write_table(ranking, output, form, overwrite=overwrite)
    show(ranking, as_json=as_json)
    exits.print_written(output)


def report(
    result: Annotated[
        Path,
        typer.Argument(help="A result of `impact sweep`, `calibrate`, `sensitivity` or `conform`."),
    ],
    output: options.Page = None,
    overwrite: options.Overwrite = False,
    plugins: options.Plugins = None,
    models: options.Models = None,
    sections: Annotated[
        list[str] | None,
        options.value(
            "NAME",
            "Only this section, such as figures, answer, friction or models; may be repeated.",
            names=["--section"],
        ),
    ] = None,
) -> None:
    """Write a report: one HTML page with the swept inputs, the ranking, figures, failed points and the config.

    The page is a single file. It needs no network and runs no scripts.
    """
    output = output or result.with_suffix(".html")
    page = options.call(impact.report, locals(), dataset=result)
    figures = page.count("<figure")
    size = f"{len(page.encode()) / 1000:,.0f} kB"
    exits.print_line(f"{output}: {figures} figure{'' if figures == 1 else 's'}, {size}")


def page(
    result: options.Result,
    output: options.Page = None,
    overwrite: options.Overwrite = False,
    models: options.Models = None,
) -> None:
    """Write a page that draws a result over any axis, with a slider for each other axis and a choice of models.

    The page is a single file for any browser. It needs neither Python nor a network, and has the numbers as CSV.
    """
    output = output or result.with_suffix(".html")
    text = options.call(impact.page, locals(), dataset=result)
    exits.print_line(f"{output}: {len(text.encode()) / 1000:,.0f} kB")
