"""The commands that help to write a config: init and schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from ..text import safe_text
from . import exits
from .options import Overwrite


def init(
    path: Annotated[Path, typer.Argument(help="The file to write.")] = Path("config.toml"),
    overwrite: Overwrite = False,
) -> None:
    """Write a commented starter config, ready to sweep."""
    from ..results import backend
    from ..results.single_impact import STARTER_CONFIG

    backend.write_file(path, STARTER_CONFIG.read_bytes(), overwrite=overwrite)
    exits.say(f"{safe_text(str(path))}: written; next: impact sweep {safe_text(str(path))}")


def schema(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The file. \\[default: stdout]")] = None,
    overwrite: Overwrite = False,
) -> None:
    """The JSON Schema of the config, from which editors complete and check it."""
    from ..config.load import json_schema
    from ..results import backend

    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
    else:
        backend.write_file(output, text.encode(), overwrite=overwrite)
        exits.say(f"{safe_text(str(output))}: written")
