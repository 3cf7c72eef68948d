"""Options and arguments that several commands have, each declared once, and kinds of options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from . import completion, parsing
from .parsing import NamedValue


def value(
    metavar: str, help: str, complete: Callable[..., list[str]] | None = None, *, names: Sequence[str] = ()
) -> Any:
    """Declare an option with a value; its name is that of its parameter, unless it has others."""
    return typer.Option(*names, metavar=metavar, autocompletion=complete, help=help)


def output(help: str, metavar: str | None = None) -> Any:
    """Declare the option for the file to write."""
    return typer.Option("-o", "--output", metavar=metavar, help=help)


def whole_number(help: str, *names: str) -> Any:
    """Declare an option whose value is a whole number of at least 1."""
    return typer.Option(*names, metavar="N", parser=parsing.parse_whole_number, help=help)


def number(metavar: str, help: str) -> Any:
    """Declare an option whose value is a number, which may be in percent."""
    return typer.Option(metavar=metavar, parser=parsing.parse_number, help=help)


def pairs(complete: Callable[..., list[str]], help: str) -> Any:
    """Declare an option that is repeated for several names."""
    return typer.Option(
        metavar="NAME=VALUE",
        autocompletion=complete,
        parser=parsing.parse_setting,
        callback=parsing.reject_duplicates,
        help=help,
    )


def tolerance(metavar: str, help: str) -> Any:
    """Declare an option for a tolerance of all, or of one by its name."""
    return typer.Option(
        metavar=metavar, parser=parsing.parse_tolerance, callback=parsing.reject_duplicates, help=help
    )


def target(help: str) -> Any:
    """Declare the option for the wanted output."""
    return typer.Option(
        metavar="NAME=VALUE", parser=parsing.parse_target, autocompletion=completion.complete_target, help=help
    )


def model(help: str) -> Any:
    """Declare an option for the key of a model."""
    return value("KEY", help, completion.complete_model)


def friction(help: str) -> Any:
    """Declare an option for the key of a friction law."""
    return value("KEY", help, completion.complete_friction)


Result = Annotated[Path, typer.Argument(help="A result of `impact sweep`.")]
Source = Annotated[
    Path | None, typer.Argument(help="A TOML file, a result or a calibration. \\[default: Table 1 of the paper]")
]
At = Annotated[
    list[NamedValue] | None,
    pairs(completion.complete_input, "Value of an input, such as e=0.05; may be repeated."),
]
ModelKey = Annotated[str, model("The model.")]
Parameter = Annotated[
    str | None,
    value(
        "PARAMETER",
        "Find the value of this parameter of the law, of K or of materials.NAME.E, from which on every phase "
        "is within the tolerance at the given --dt.",
        names=["--for"],
    ),
]
FrictionKey = Annotated[
    str | None, friction("The friction law. \\[default: the first of the source, if it has any]")
]
Output = Annotated[Path, output("The result file.")]
Page = Annotated[Path | None, output("The page: .html. \\[default: RESULT.html]")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace the output if it exists.")]
Rows = Annotated[int | None, whole_number("Write at most N rows of a table, evenly spread. \\[default: all]")]
Digits = Annotated[int | None, whole_number("Significant digits of a table. \\[default: all, in .tex 6]")]
Decimal = Annotated[str, value("NAME", "point, comma (semicolons separate columns) or locale.")]
Table = Annotated[Path | None, output("Write the table: .csv, .tex or .parquet.", "FILE")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
AllowFailed = Annotated[bool, typer.Option("--allow-failed", help="Exit 0 even if points failed.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue an interrupted sweep.")]
Set = Annotated[
    list[str] | None,
    value(
        "PATH=VALUE",
        "Change the config, such as sweep.m2=2.0; may be repeated.",
        completion.complete_setting,
        names=["--set"],
    ),
]
Plugins = Annotated[
    list[Path] | None,
    value("FILE", "Python file with user-defined models; may be repeated.", names=["--plugin"]),
]
Select = Annotated[
    list[NamedValue] | None,
    pairs(completion.complete_selection, "Value of an axis, such as m2=1.0; may be repeated."),
]
Models = Annotated[list[str] | None, model("Only this model; may be repeated.")]
Frictions = Annotated[list[str] | None, friction("Only this friction law; may be repeated.")]
Jobs = Annotated[int, whole_number("Number of processes.", "--jobs", "-j")]
Threads = Annotated[int, whole_number("Number of threads, instead of processes.")]
MaxPoints = Annotated[int, whole_number("Largest number of points in layout full, of trajectories otherwise.")]
Tolerance = Annotated[
    list[NamedValue] | None,
    tolerance(
        "[NAME=]VALUE",
        "Tolerance relative to the scale of a point, such as 1e-8 or 5%, for all variables or for one; may "
        "be repeated. \\[default: the baseline's, else 10 times its solver's rtol]",
    ),
]
