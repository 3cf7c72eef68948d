"""The command `plot`: pictures of a result, of one kind or several."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import UsageError
from ..plots.kinds import KINDS, WIDTHS
from ..text import safe_text
from . import exits
from .console import dump
from .options import JsonOption, ModelOption, OverwriteOption, PluginOption, SelectOption

if TYPE_CHECKING:
    from ..plots.kinds import PlotData

DEFAULT_KINDS = ("final-velocities",)


def plot(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`, or a history of `impact run`.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="The picture: .png, .svg, .pdf, .eps or .pgf; of several kinds each has its kind in its name. "
            "\\[default: RESULT.png]",
        ),
    ] = None,
    kind: Annotated[
        list[str] | None,
        typer.Option(
            "--kind",
            "-k",
            metavar="KIND",
            help=f"{', '.join(KINDS)}; may be repeated. \\[default: {DEFAULT_KINDS[0]}]",
        ),
    ] = None,
    x: Annotated[
        str | None, typer.Option("--x", help="What to draw over. \\[default: e, else the first axis]")
    ] = None,
    y: Annotated[
        str | None, typer.Option("--y", help="Second axis of a map, or of validity. \\[default: the next axis]")
    ] = None,
    variable: Annotated[str, typer.Option("--variable", help="What a map shows.")] = "e_error",
    sel: SelectOption = None,
    model: ModelOption = None,
    log: Annotated[str, typer.Option("--log", metavar="AXES", help="Axes to make logarithmic: x, y or xy.")] = "",
    points: Annotated[
        Path | None,
        typer.Option(
            "--points",
            metavar="FILE",
            help="Measured points over the curves: CSV with columns such as v1 \\[m/s], e_out and sigma.",
        ),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(
            "--width",
            metavar="LENGTH",
            help=f"A length such as 84mm, or that of a journal's column: {', '.join(WIDTHS)}. \\[default: double]",
        ),
    ] = None,
    height: Annotated[
        str | None,
        typer.Option("--height", metavar="LENGTH", help="A length such as 60mm. \\[default: what suits the kind]"),
    ] = None,
    style: Annotated[
        str | None,
        typer.Option(
            "--style", metavar="FILE", help="Style sheet of matplotlib, or the name of one, such as grayscale."
        ),
    ] = None,
    no_title: Annotated[bool, typer.Option("--no-title", help="Leave out the title and the conditions.")] = False,
    label: Annotated[
        list[str] | None,
        typer.Option(
            "--label",
            metavar="KEY=TEXT",
            help="Text for an axis (its name), a law (its key), reference or title; may be repeated.",
        ),
    ] = None,
    equations: Annotated[
        bool, typer.Option("--equations", help="Name the laws with the numbers of their equations in the paper.")
    ] = False,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", metavar="FILE", help="Write the numbers behind the picture: .csv, .tex or .parquet."
        ),
    ] = None,
    data_form: Annotated[
        str,
        typer.Option(
            "--data-form", metavar="FORM", help="wide: a column for each curve; long: a row for each point."
        ),
    ] = "wide",
    overwrite: OverwriteOption = False,
    plugin: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a stored result: by default the final-velocity comparison, Figure 6 of the paper.

    loop, history and impulse follow a point of the result through time again; --sel chooses it.
    Of several kinds those that apply are drawn, and the others are named with the reason.
    """
    from .. import api

    files = api.plot_to_files(
        result,
        output,
        kinds=kind or DEFAULT_KINDS,
        x=x,
        y=y,
        variable=variable,
        sel=dict(sel or ()),
        models=model,
        log=log,
        points=points,
        width=width,
        height=height,
        style=style,
        title=not no_title,
        labels=_parse_labels(label),
        equations=equations,
        data=data,
        data_form=data_form,
        overwrite=overwrite,
        plugins=plugin or (),
    )
    for name, picture in files.pictures.items():
        exits.print_line(_summary_line(picture, files.plot_data[name]))
    for name, reason in files.left_out.items():
        exits.print_line(f"{name} is not drawn: {reason}")
    if as_json:
        print(dump({name: asdict(plot_data) for name, plot_data in files.plot_data.items()}))


def _parse_labels(options: list[str] | None) -> dict[str, str]:
    """KEY=TEXT options."""
    labels: dict[str, str] = {}
    for option in options or ():
        key, equals, text = option.partition("=")
        if not (key and equals and text):
            raise UsageError(f"--label: got {safe_text(option)}, expected KEY=TEXT, such as e='Restitution $e$'")
        labels[key] = text
    return labels


def _summary_line(picture: Path, plot_data: PlotData) -> str:
    conditions = plot_data.conditions.replace("\N{NO-BREAK SPACE}", " ")
    without = f"; without {', '.join(plot_data.not_drawn)}" if plot_data.not_drawn else ""
    return safe_text(f"{picture}: {plot_data.title}" + (f", {conditions}" if conditions else "") + without, 1000)
