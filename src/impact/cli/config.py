"""The commands that help to write a config: init and schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

import impact

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
        print(json.dumps(json_schema, indent=2, ensure_ascii=False))
    else:
        exits.print_written(output)
