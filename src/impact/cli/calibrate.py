"""The command `calibrate`: which law, with which parameters, fits my measurements?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import TableForm, show, write_table
from . import exits
from .completion import complete_model
from .options import (
    DecimalOption,
    DigitsOption,
    JobsOption,
    JsonOption,
    OverwriteOption,
    PluginOption,
    RowsOption,
    SetOption,
)


def calibrate(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[data] and { fit = \\[least, most] }.")],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", help="The result file, or of its table .csv, .tex or .parquet. \\[default: none]"
        ),
    ] = None,
    overwrite: OverwriteOption = False,
    best: Annotated[
        Path | None,
        typer.Option("--best", metavar="FILE", help="Write the config of the best law with its parameters."),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            metavar="KEY",
            autocompletion=complete_model,
            help="The law of --best, in place of the one that fits best.",
        ),
    ] = None,
    sets: SetOption = None,
    plugins: PluginOption = None,
    jobs: JobsOption = 1,
    rows: RowsOption = None,
    digits: DigitsOption = None,
    decimal: DecimalOption = "point",
    as_json: JsonOption = False,
) -> None:
    """Fit laws to measurements, and rank them.

    Intervals are those of 95 % by profile likelihood. A parameter that the data do not determine has none.
    """
    form = TableForm(rows, digits, decimal)
    form.check_used(output, "output")
    result = impact.calibrate(
        config,
        output=output,
        best=best,
        model=model,
        overwrite=overwrite,
        overrides=sets or (),
        plugins=plugins or (),
        jobs=jobs,
    )
    described = impact.describe(result)
    # in another form than that of the function
    if output is not None and form != TableForm():
        write_table(described, output, form, overwrite=True)
    show(described, as_json=as_json)
    for path in (output, best):
        if path is not None:
            exits.print_line(f"{path}: written")
