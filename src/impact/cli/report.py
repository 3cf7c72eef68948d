"""The commands that write a result as one page of HTML: report and page."""

from __future__ import annotations

from typing import Annotated

import impact

from . import exits, options


def report(
    result: options.Result,
    output: options.Page = None,
    overwrite: options.Overwrite = False,
    plugin: options.Plugins = None,
    model: options.Models = None,
    section: Annotated[
        list[str] | None,
        options.value("NAME", "Only this section, such as figures, answer, friction or models; may be repeated."),
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


def page(
    result: options.Result,
    output: options.Page = None,
    overwrite: options.Overwrite = False,
    model: options.Models = None,
) -> None:
    """Write a page that draws a result over any axis, with a slider for each other axis and a choice of models.

    The page is a single file for any browser. It needs neither Python nor a network, and has the numbers as CSV.
    """
    output = output or result.with_suffix(".html")
    text = impact.page(result, output=output, overwrite=overwrite, models=model)
    exits.print_line(f"{output}: {len(text.encode()) / 1000:,.0f} kB")
