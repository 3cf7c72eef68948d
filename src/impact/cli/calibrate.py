"""The command `calibrate`: which law, with which parameters, fits my measurements?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..display import TableForm, show, write_table
from . import exits, options


def calibrate(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[data] and { fit = \\[least, most] }.")],
    output: Annotated[
        Path | None, options.output("The result file, or of its table .csv, .tex or .parquet. \\[default: none]")
    ] = None,
    overwrite: options.Overwrite = False,
    best: Annotated[
        Path | None, options.value("FILE", "Write the config of the best law with its parameters.")
    ] = None,
    model: Annotated[str | None, options.model("The law of --best, in place of the one that fits best.")] = None,
    sets: options.Set = None,
    plugins: options.Plugins = None,
    jobs: options.Jobs = 1,
    rows: options.Rows = None,
    digits: options.Digits = None,
    decimal: options.Decimal = "point",
    as_json: options.Json = False,
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
    exits.print_written(output, best)
