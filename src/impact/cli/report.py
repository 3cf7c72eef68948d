"""The command `report`: a result as one page of HTML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from . import exits
from .options import ModelOption, OverwriteOption, PluginOption


def report(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The page: .html. \\[default: RESULT.html]")
    ] = None,
    overwrite: OverwriteOption = False,
    plugin: PluginOption = None,
    model: ModelOption = None,
    section: Annotated[
        list[str] | None,
        typer.Option(
            "--section",
            metavar="NAME",
            help="Only this section, such as figures, answer, friction or models; may be repeated.",
        ),
    ] = None,
) -> None:
    """Write a report: one HTML page with the swept inputs, the ranking, figures, failed points and the config.

    The page is a single file. It needs no network and runs no scripts.
    """

    output = output or result.with_suffix(".html")
    page = impact.report(
        result, output=output, overwrite=overwrite, plugins=plugin or (), models=model, sections=section
    )
    figures = page.count("<figure")
    size = f"{len(page.encode()) / 1000:,.0f} kB"
    exits.print_line(f"{output}: {figures} figure{'' if figures == 1 else 's'}, {size}")
