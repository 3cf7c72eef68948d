"""The command `info`: the contents of a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import show
from .options import JsonOption


def info(
    file: Annotated[Path, typer.Argument(help="A result or a time history.")],
    as_json: JsonOption = False,
) -> None:
    """Show the axes, variables, largest errors and provenance of a file."""
    show(impact.info(file), as_json=as_json)
