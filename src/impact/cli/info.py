"""The commands that show what is there: info, the contents of a file, and doctor, what is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import show
from . import options


def info(
    file: Annotated[Path, typer.Argument(help="A result or a time history.")],
    as_json: options.Json = False,
) -> None:
    """Show the axes, variables, largest errors and provenance of a file."""
    show(impact.info(file), as_json=as_json)


def doctor(as_json: options.Json = False) -> None:
    """Show the versions of impact, its packages, the compiled core and the simulation codes."""
    show(impact.doctor(), as_json=as_json)
