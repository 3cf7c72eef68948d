"""Options that several commands have, each with its one help text."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .words import whole_number

Json = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the output if it exists.")]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Change the config, such as sweep.m2=2.0; may be repeated."),
]
Plugins = Annotated[
    list[Path] | None,
    typer.Option("--plugin", metavar="FILE", help="Python file with models of your own; may be repeated."),
]
Jobs = Annotated[
    int, typer.Option("--jobs", "-j", metavar="N", parser=whole_number, help="Processes that integrate.")
]
Threads = Annotated[
    int,
    typer.Option(
        "--threads", metavar="N", parser=whole_number, help="Threads that integrate, in place of processes."
    ),
]
MaxPoints = Annotated[
    int,
    typer.Option(
        "--max-points",
        metavar="N",
        parser=whole_number,
        help="Refuse more: points in layout full, else trajectories.",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
Output = Annotated[Path, typer.Option("-o", "--output", help="The result file.")]
AllowFailed = Annotated[bool, typer.Option("--allow-failed", help="Exit 0 even if points failed.")]
