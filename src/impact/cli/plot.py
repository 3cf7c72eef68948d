"""The command `plot`: pictures of a result, of one kind or several."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import UsageError, did_you_mean
from ..plots.kinds import KINDS, LOG_AXES, WIDTHS
from ..text import safe_text
from . import exits
from .console import dump
from .options import JsonOption, ModelOption, OverwriteOption, PluginOption, SelectOption

if TYPE_CHECKING:
    from ..plots.kinds import PlotData


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
            help=f"{', '.join(KINDS)}; may be repeated. \\[default: {next(iter(KINDS))}]",
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
    log: Annotated[str | None, typer.Option("--log", help="Axes to make logarithmic: x, y or xy.")] = None,
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
    from ..plots.data import check_table, encode_table, read_points
    from ..plots.kinds import Choice, draw
    from ..plots.style import check_picture, length, save_figure
    from ..results import backend

    if log not in (None, *LOG_AXES):
        raise UsageError(f"--log: got {safe_text(str(log))}, expected {', '.join(LOG_AXES)}")
    kinds = list(dict.fromkeys(kind or ["final-velocities"]))
    for name in kinds:
        if name not in KINDS:
            raise UsageError(f'--kind: no kind "{safe_text(name)}"; {did_you_mean(name, list(KINDS))}')
    size = length(width, "--width"), length(height, "--height")
    output = output or result.with_suffix(".png")
    check_picture(output)
    if data is not None:
        check_table(data, data_form)
    files = {
        name: [_path_of_kind(path, name, len(kinds)) for path in (output, data) if path is not None]
        for name in kinds
    }
    for path in (path for paths in files.values() for path in paths):
        for source in (result, *([points] if points else [])):
            backend.check_output(path, overwrite=overwrite, source=source)
    measured = None if points is None else read_points(points)
    dataset = api.load(result)
    choice = Choice(x, y, variable, dict(sel or ()), model, log or "", equations)
    drawn: dict[str, PlotData] = {}
    faults: dict[str, str] = {}
    for name, (picture, *table) in files.items():
        try:
            plot_data = api.get_plot_data(dataset, name, choice, plugin or ())
            figure = draw(
                plot_data, *size, style=style, title=not no_title, labels=_parse_labels(label), points=measured
            )
            tables = [(path, encode_table(plot_data, path.suffix.lower(), data_form)) for path in table]
        except UsageError as error:
            faults[name] = str(error)
            continue
        save_figure(figure, picture, overwrite=overwrite, style=style)
        for path, content in tables:
            backend.write_file(path, content, overwrite=overwrite)
        drawn[name] = plot_data
        exits.print_line(_summary_line(picture, plot_data))
    if not drawn:
        raise UsageError("\n".join(dict.fromkeys(faults.values())))
    for name, fault in faults.items():
        exits.print_line(f"{name} is not drawn: {fault}")
    if as_json:
        from dataclasses import asdict

        print(dump({name: asdict(plot_data) for name, plot_data in drawn.items()}))


def _parse_labels(words: list[str] | None) -> dict[str, str]:
    """KEY=TEXT options."""
    labels: dict[str, str] = {}
    for word in words or ():
        key, equals, text = word.partition("=")
        if not (key and equals and text):
            raise UsageError(f"--label: got {safe_text(word)}, expected KEY=TEXT, such as e='Restitution $e$'")
        labels[key] = text
    return labels


def _path_of_kind(path: Path, kind: str, kinds: int) -> Path:
    """A separate file for each of several kinds."""
    return path if kinds == 1 else path.with_name(f"{path.stem}-{kind}{path.suffix}")


def _summary_line(picture: Path, plot_data: PlotData) -> str:
    conditions = plot_data.conditions.replace("\N{NO-BREAK SPACE}", " ")
    without = f"; without {', '.join(plot_data.not_drawn)}" if plot_data.not_drawn else ""
    return safe_text(f"{picture}: {plot_data.title}" + (f", {conditions}" if conditions else "") + without, 1000)
