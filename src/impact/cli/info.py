"""The commands around a sweep: init and schema help to write a config, info and doctor show what is there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import show
from . import exits, options


def init(
    path: Annotated[Path, typer.Argument(help="The file to write.")] = Path("config.toml"),
    overwrite: options.Overwrite = False,
) -> None:
    """Write a commented starter config, ready to sweep."""
    impact.init(path, overwrite=overwrite)
    exits.print_line(f"{path}: written; next: impact sweep {path}")


def schema(
    output: Annotated[Path | None, options.output("The file. \\[default: stdout]")] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Print the JSON Schema of a config, for completion and validation in editors."""
    json_schema = impact.schema(output, overwrite=overwrite)
    if output is None:
        print(json.dumps(json_schema, indent=2))
    exits.print_written(output)


def info(
    file: Annotated[Path, typer.Argument(help="A result of any command, or a history of `impact run`.")],
    as_json: options.Json = False,
) -> None:
    """Show the axes, variables, largest errors and provenance of a file."""
    show(impact.info(file), as_json=as_json)


def doctor(as_json: options.Json = False) -> None:
    """Show the versions of impact, its packages, the compiled core and the simulation codes."""
    show(impact.doctor(), as_json=as_json)
