"""The command `page`: a result to look at in a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from . import exits
from .options import ModelOption, OverwriteOption


def page(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The page: .html. \\[default: RESULT.html]")
    ] = None,
    overwrite: OverwriteOption = False,
    model: ModelOption = None,
) -> None:
    """Write a page that draws a result over any axis, with a slider for each other axis and a choice of models.

    The page is a single file for any browser. It needs neither Python nor a network, and has the numbers as CSV.
    """
    output = output or result.with_suffix(".html")
    text = impact.page(result, output=output, overwrite=overwrite, models=model)
    exits.print_line(f"{output}: {len(text.encode()) / 1000:,.0f} kB")
