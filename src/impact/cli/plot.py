"""The command `plot`: pictures of a result, of one kind or several."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import dump
from ..errors import UsageError
from ..formatting import safe_text
from ..plots.kinds import KINDS, WIDTHS
from . import exits, options
from .completion import complete_axis, complete_kind, complete_output


def plot(
    result: Annotated[
        Path,
        typer.Argument(
            help="A result of `impact sweep`, `calibrate` or `sensitivity`, or a history of `impact run`."
        ),
    ],
    output: Annotated[
        Path | None,
        options.output(
            "The picture: .png, .svg, .pdf, .eps, .pgf, or .gif (animation); several kinds: one file each. "
            "\\[default: RESULT.png]"
        ),
    ] = None,
    kinds: Annotated[
        list[str] | None,
        options.value(
            "KIND",
            f"{', '.join(KINDS)}; may be repeated. \\[default: final-velocities, or the kind of the result]",
            complete_kind,
            names=["--kind", "-k"],
        ),
    ] = None,
    x: Annotated[
        str | None, options.value("AXIS", "Horizontal axis. \\[default: e, else the first axis]", complete_axis)
    ] = None,
    y: Annotated[
        str | None,
        options.value("AXIS", "Vertical axis of a map, or of validity. \\[default: the next axis]", complete_axis),
    ] = None,
    variable: Annotated[
        str | None,
        options.value(
            "NAME",
            "Variable of a map or of bands. \\[default: e_error of a map, beta of an oblique one, e_out of bands]",
            complete_output,
        ),
    ] = None,
    sel: options.Select = None,
    models: options.Models = None,
    frictions: options.Frictions = None,
    log: Annotated[str, options.value("AXES", "Logarithmic axes: x, y or xy.")] = "",
    points: Annotated[
        Path | None,
        options.value(
            "FILE", "CSV file of measured points to plot, with columns such as v1 \\[m/s], e_out and sigma."
        ),
    ] = None,
    width: Annotated[
        str | None,
        options.value(
            "LENGTH", f"A length such as 84mm, or a journal column: {', '.join(WIDTHS)}. \\[default: double]"
        ),
    ] = None,
    height: Annotated[
        str | None, options.value("LENGTH", "A length such as 60mm. \\[default: depends on the kind]")
    ] = None,
    style: Annotated[
        str | None, options.value("FILE", "Matplotlib style sheet: a file, or a name such as grayscale.")
    ] = None,
    no_title: Annotated[bool, typer.Option("--no-title", help="Omit the title and the conditions.")] = False,
    legend: Annotated[
        str | None,
        options.value(
            "NAMES",
            "Name laws in full, short or by keys; none: no legend. \\[default: full, short or keys, the "
            "first that takes at most a fifth of the height]",
        ),
    ] = None,
    label: Annotated[
        list[str] | None,
        options.value(
            "KEY=TEXT",
            "Text for an axis, the name beside a curve (both by name), a law (its key), reference or title; "
            "may be repeated.",
        ),
    ] = None,
    equations: Annotated[
        bool,
        typer.Option("--equations", help="Show the equation numbers of the paper with the names of the laws."),
    ] = False,
    data: Annotated[
        Path | None, options.value("FILE", "Write the plotted numbers: .csv, .tex or .parquet.")
    ] = None,
    data_form: Annotated[
        str, options.value("FORM", "wide: a column for each curve; long: a row for each point.")
    ] = "wide",
    rows: options.Rows = None,
    digits: options.Digits = None,
    decimal: options.Decimal = "point",
    overwrite: options.Overwrite = False,
    plugins: options.Plugins = None,
    as_json: options.Json = False,
) -> None:
    """Plot a stored result: by default the final-velocity comparison, Figure 6 of the paper.

    loop, history, impulse and animation integrate one point of the result again; --sel selects it. By default e
    has the middle of its axis, and other axes have their first value.
    Of several kinds, those that --sel leaves no axis are drawn over the whole axis, and those that do not apply
    are reported with the reason.
    """
    files = options.call(impact.plot_to_files, locals(), title=not no_title, labels=_parse_labels(label))
    for name, picture in files.pictures.items():
        plot_data = files.plot_data[name]
        conditions = plot_data.conditions.replace("\N{NO-BREAK SPACE}", " ")
        without = f"; without {', '.join(plot_data.not_drawn)}" if plot_data.not_drawn else ""
        line = f"{picture}: {plot_data.title}" + (f", {conditions}" if conditions else "") + without
        exits.print_line(safe_text(line, 1000))
    for name, reason in files.left_out.items():
        exits.print_line(f"{name} is not drawn: {reason}")
    if as_json:
        print(dump({name: asdict(data_of_kind) for name, data_of_kind in files.plot_data.items()}))


def _parse_labels(words: list[str] | None) -> dict[str, str]:
    labels: dict[str, str] = {}
    for word in words or ():
        key, equals, text = word.partition("=")
        if not (key and equals and text):
            raise UsageError(f"--label: got {word}, expected KEY=TEXT, such as e='Restitution $e$'")
        labels[key] = text
    return labels
