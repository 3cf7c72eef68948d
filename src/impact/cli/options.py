"""Options and arguments that several commands have, each declared once; kinds of options, and their parsers."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import typer

from ..formatting import safe_text
from . import completion

ResultT = TypeVar("ResultT")


class NamedValue(NamedTuple):
    """A word NAME=VALUE; a tolerance of all has the name "all"."""

    name: str
    value: Any


def call(function: Callable[..., ResultT], options: Mapping[str, Any], **arguments: Any) -> ResultT:
    """Call a function with those options of a command that it has a parameter for, and with further arguments.

    An option without a value keeps the default of the function. Words NAME=VALUE become a mapping.

    >>> def solve(model, at, sel="none"):
    ...     return model, at, sel
    >>> call(solve, {"at": [NamedValue("e", 0.5)], "sel": None, "as_json": True}, model="hertz")
    ('hertz', {'e': 0.5}, 'none')
    """
    for name in inspect.signature(function).parameters:
        if name in arguments or options.get(name) is None:
            continue
        match options[name]:
            case NamedValue() as word:
                arguments[name] = dict([word])
            case [NamedValue(), *_] as words:
                arguments[name] = dict(words)
            case other:
                arguments[name] = other
    return function(**arguments)


def parse_setting(word: str, example: str = "m2=1.0") -> NamedValue:
    """Parse NAME=VALUE; a value that reads as a number is one.

    >>> parse_setting("m2=1e3"), parse_setting("material=steel")
    (NamedValue(name='m2', value=1000.0), NamedValue(name='material', value='steel'))
    """
    name, _, value = word.partition("=")
    if not name or not value:
        raise invalid_value(word, f"NAME=VALUE, such as {example}")
    try:
        return NamedValue(name, float(value))
    except ValueError:
        return NamedValue(name, value)


def parse_range(word: str) -> NamedValue:
    """Parse NAME=FIRST:LAST:COUNT, evenly spaced values, or NAME=VALUES with a TOML list or range.

    >>> parse_range("v1=0.1:3:30")
    NamedValue(name='v1', value={'linspace': [0.1, 3, 30]})
    >>> parse_range("v1={geomspace = [0.1, 3, 30]}").value, parse_range("m2=[1.0, 2.0]").value
    ({'geomspace': [0.1, 3, 30]}, [1.0, 2.0])
    """
    from ..config.files import read_value

    name, _, text = word.partition("=")
    parts = text.split(":")
    values = read_value(text if len(parts) != 3 else f"{{linspace = [{', '.join(parts)}]}}")
    if not name or not isinstance(values, list | dict):
        raise invalid_value(word, "NAME=FIRST:LAST:COUNT, such as v1=0.1:3:30, or NAME=[VALUE, ...]")
    return NamedValue(name, values)


def parse_tolerance(word: str) -> NamedValue:
    """Parse VALUE or NAME=VALUE, where VALUE may be in percent.

    >>> parse_tolerance("1e-8"), parse_tolerance("v1_post=5%")
    (NamedValue(name='all', value=1e-08), NamedValue(name='v1_post', value=0.05))
    """
    name, equals, value = word.rpartition("=")
    read = _float_or_nan(value)
    if math.isnan(read) or (equals and not name):
        raise invalid_value(word, "VALUE or NAME=VALUE, such as 1e-8, 5% or v1_post=1e-6")
    return NamedValue(name or "all", read)


def reject_duplicates(settings: list[NamedValue] | None) -> list[NamedValue] | None:
    """Raise an error if a name occurs twice among the values of a repeated option."""
    names = [name for name, _ in settings or ()]
    for name in names:
        if names.count(name) > 1:
            raise typer.BadParameter(f"got {name} twice, expected each name once")
    return settings


def parse_whole_number(word: str | int) -> int:
    """Parse a whole number of at least 1; a default, which is a number, too.

    >>> parse_whole_number("8"), parse_whole_number("1e9")
    (8, 1000000000)
    """
    read = _float_or_nan(str(word))
    if not (read >= 1.0 and read.is_integer()):
        raise invalid_value(word, "a whole number of at least 1, such as 8 or 1e9")
    return int(read)


def parse_number(word: str | float) -> float:
    """Parse a number, which may be in percent; a default, which is one, too.

    >>> parse_number("0.02"), parse_number("5%")
    (0.02, 0.05)
    """
    read = _float_or_nan(str(word))
    if math.isnan(read):
        raise invalid_value(word, "a number, such as 0.02 or 2%")
    return read


def invalid_value(word: object, expected: str) -> typer.BadParameter:
    """The error of an invalid word."""
    return typer.BadParameter(f'got "{safe_text(str(word))}", expected {expected}')


def _float_or_nan(word: str) -> float:
    """A number, which may be in percent; NaN where a word is none."""
    try:
        return float(word.removesuffix("%")) / (100.0 if word.endswith("%") else 1.0)
    except ValueError:
        return math.nan


def value(
    metavar: str,
    help: str,
    complete: Callable[..., list[str]] | None = None,
    parser: Callable[[Any], Any] | None = None,
    names: Sequence[str] = (),
    callback: Callable[..., Any] | None = None,
) -> Any:
    """Declare an option with a value; its name is that of its parameter, unless it has others."""
    return typer.Option(
        *names, metavar=metavar, autocompletion=complete, parser=parser, callback=callback, help=help
    )


def output(help: str, metavar: str | None = None) -> Any:
    """Declare the option for the file to write."""
    return typer.Option("-o", "--output", metavar=metavar, help=help)


def whole_number(help: str, names: Sequence[str] = ()) -> Any:
    """Declare an option whose value is a whole number of at least 1."""
    return value("N", help, parser=parse_whole_number, names=names)


def number(metavar: str, help: str) -> Any:
    """Declare an option whose value is a number, which may be in percent."""
    return value(metavar, help, parser=parse_number)


def pairs(complete: Callable[..., list[str]], help: str) -> Any:
    """Declare an option that is repeated for several names."""
    return value("NAME=VALUE", help, complete, parse_setting, callback=reject_duplicates)


def tolerance(metavar: str, help: str) -> Any:
    """Declare an option for a tolerance of all, or of one by its name."""
    return value(metavar, help, parser=parse_tolerance, callback=reject_duplicates)


def target(help: str) -> Any:
    """Declare the option for the wanted output; its value may be a number with a unit, which the command reads."""
    return value("NAME=VALUE", help, completion.complete_target, lambda word: parse_setting(word, "e_out=0.6"))


def model(help: str, names: Sequence[str] = ()) -> Any:
    """Declare an option for the key of a model."""
    return value("KEY", help, completion.complete_model, names=names)


def friction(help: str, names: Sequence[str] = ()) -> Any:
    """Declare an option for the key of a friction law."""
    return value("KEY", help, completion.complete_friction, names=names)


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
Models = Annotated[list[str] | None, model("Only this model; may be repeated.", ["--model"])]
Frictions = Annotated[list[str] | None, friction("Only this friction law; may be repeated.", ["--friction"])]
Jobs = Annotated[int, whole_number("Number of processes.", names=["--jobs", "-j"])]
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
