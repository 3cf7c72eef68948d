"""The command `report`: a result as one page of HTML."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import UsageError
from ..text import safe_text
from . import exits
from .options import Overwrite, Plugins

ENDINGS = (".html", ".htm")


def report(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The page: .html. \\[default: RESULT.html]")
    ] = None,
    overwrite: Overwrite = False,
    plugin: Plugins = None,
) -> None:
    """Write a report: one page of HTML with what was swept, the answer, figures, failed points and the config.

    It is one file, opens without a network, and has nothing that runs.
    """
    from .. import api
    from ..results import backend

    output = output or result.with_suffix(ENDINGS[0])
    shown = safe_text(str(output))
    if output.suffix.lower() not in ENDINGS:
        raise UsageError(f"{shown}: wants a name that ends in {ENDINGS[0]}")
    for source in (result, *(plugin or ())):
        backend.check_output(output, overwrite=overwrite, source=source)
    page = api.report(api.load(result), plugins=plugin or ())
    content = page.encode()
    backend.write_file(output, content, overwrite=overwrite)
    figures = page.count("<figure>")
    exits.say(f"{shown}: {figures} figure{'' if figures == 1 else 's'}, {len(content) / 1000:,.0f} kB")
