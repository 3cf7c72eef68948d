"""Options and arguments that several commands have, each declared once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .completion import complete_friction, complete_input, complete_model, complete_selection, complete_setting
from .parsing import (
    Setting,
    Tolerance,
    parse_setting,
    parse_tolerance,
    parse_whole_number,
    reject_duplicates,
)

ResultArgument = Annotated[Path, typer.Argument(help="A result of `impact sweep`.")]
SourceArgument = Annotated[
    Path | None, typer.Argument(help="A TOML file, a result or a calibration. \\[default: Table 1 of the paper]")
]
AtOption = Annotated[
    list[Setting] | None,
    typer.Option(
        "--at",
        metavar="NAME=VALUE",
        autocompletion=complete_input,
        parser=parse_setting,
        callback=reject_duplicates,
        help="Value of an input, such as e=0.05; may be repeated.",
    ),
]
ModelKeyOption = Annotated[
    str, typer.Option("--model", metavar="KEY", autocompletion=complete_model, help="The model.")
]
ParameterOption = Annotated[
    str | None,
    typer.Option(
        "--for",
        metavar="PARAMETER",
        help="Find the value of this parameter of the law, of K or of materials.NAME.E, from which on every phase "
        "is within the tolerance at the given --dt.",
    ),
]
FrictionKeyOption = Annotated[
    str | None,
    typer.Option(
        "--friction",
        metavar="KEY",
        autocompletion=complete_friction,
        help="The friction law. \\[default: the first of the source, if it has any]",
    ),
]
OutputOption = Annotated[Path, typer.Option("-o", "--output", help="The result file.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace the output if it exists.")]
RowsOption = Annotated[
    int | None,
    typer.Option(
        "--rows",
        metavar="N",
        parser=parse_whole_number,
        help="Write at most N rows of a table, evenly spread. \\[default: all]",
    ),
]
DigitsOption = Annotated[
    int | None,
    typer.Option(
        "--digits",
        metavar="N",
        parser=parse_whole_number,
        help="Significant digits of a table. \\[default: all, in .tex 6]",
    ),
]
DecimalOption = Annotated[
    str,
    typer.Option("--decimal", metavar="NAME", help="point, comma (semicolons separate columns) or locale."),
]
TableOption = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Write the table: .csv, .tex or .parquet."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
AllowFailedOption = Annotated[bool, typer.Option("--allow-failed", help="Exit 0 even if points failed.")]
ResumeOption = Annotated[bool, typer.Option("--resume", help="Continue an interrupted sweep.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        autocompletion=complete_setting,
        help="Change the config, such as sweep.m2=2.0; may be repeated.",
    ),
]
PluginOption = Annotated[
    list[Path] | None,
    typer.Option("--plugin", metavar="FILE", help="Python file with user-defined models; may be repeated."),
]
SelectOption = Annotated[
    list[Setting] | None,
    typer.Option(
        "--sel",
        metavar="NAME=VALUE",
        autocompletion=complete_selection,
        parser=parse_setting,
        callback=reject_duplicates,
        help="Value of an axis, such as m2=1.0; may be repeated.",
    ),
]
ModelOption = Annotated[
    list[str] | None,
    typer.Option(
        "--model", metavar="KEY", autocompletion=complete_model, help="Only this model; may be repeated."
    ),
]
FrictionOption = Annotated[
    list[str] | None,
    typer.Option(
        "--friction",
        metavar="KEY",
        autocompletion=complete_friction,
        help="Only this friction law; may be repeated.",
    ),
]
JobsOption = Annotated[
    int, typer.Option("--jobs", "-j", metavar="N", parser=parse_whole_number, help="Number of processes.")
]
ThreadsOption = Annotated[
    int,
    typer.Option(
        "--threads", metavar="N", parser=parse_whole_number, help="Number of threads, instead of processes."
    ),
]
MaxPointsOption = Annotated[
    int,
    typer.Option(
        "--max-points",
        metavar="N",
        parser=parse_whole_number,
        help="Largest number of points in layout full, of trajectories otherwise.",
    ),
]
ToleranceOption = Annotated[
    list[Tolerance] | None,
    typer.Option(
        "--tol",
        metavar="[NAME=]VALUE",
        parser=parse_tolerance,
        callback=reject_duplicates,
        help="Tolerance relative to the scale of a point, such as 1e-8 or 5%, for all variables or for one; may "
        "be repeated. \\[default: the baseline's, else 10 times its solver's rtol]",
    ),
]
