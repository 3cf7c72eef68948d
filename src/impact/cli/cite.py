"""The command `cite`: BibTeX of laws."""

from __future__ import annotations

from typing import Annotated

import typer

import impact

from ..display import dump, show
from .completion import complete_model
from .options import JsonOption, PluginOption


def cite(
    laws: Annotated[
        list[str],
        typer.Argument(
            metavar="LAW...",
            autocompletion=complete_model,
            help="Keys of models and friction laws, or results, of which every law is cited.",
        ),
    ],
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write BibTeX of laws, from their references, with the evidence for their formulas."""
    citations = impact.cite(*laws, plugins=plugins or ())
    if as_json:
        print(dump(citations.as_list()))
    else:
        show(citations)
