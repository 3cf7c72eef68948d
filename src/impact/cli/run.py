"""The command `run`: one impact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..atomic import check_output, write_file
from ..display import show
from ..errors import UsageError
from . import exits
from .completion import complete_model
from .options import (
    AtOption,
    FrictionKeyOption,
    JsonOption,
    OverwriteOption,
    PluginOption,
    SetOption,
    SourceArgument,
)
from .parsing import parse_whole_number

# files of a time history: netCDF-4, which is HDF5, and a table
HISTORY_SUFFIXES = (".h5", ".hdf5", ".nc", ".csv")


def run(
    source: SourceArgument = None,
    model: Annotated[
        str | None,
        typer.Option(
            "--model",
            metavar="KEY",
            autocompletion=complete_model,
            help="The model. \\[default: the first of the source]",
        ),
    ] = None,
    friction: FrictionKeyOption = None,
    at: AtOption = None,
    sets: SetOption = None,
    plugins: PluginOption = None,
    history: Annotated[
        Path | None,
        typer.Option("--history", metavar="FILE", help="Write the time history: .h5, .hdf5, .nc or .csv."),
    ] = None,
    times: Annotated[
        int | None,
        typer.Option(
            "--times",
            metavar="N",
            parser=parse_whole_number,
            help="Number of uniform times of the history. \\[default: steps of the integrator]",
        ),
    ] = None,
    overwrite: OverwriteOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one impact: inputs, outputs and estimated errors."""
    from ..plots.data import encode_history

    if times is not None and history is None:
        raise UsageError(f"--times {times}: expected --history FILE as well")
    if history is not None:
        for path in (source, *(plugins or ())):
            check_output(history, overwrite=overwrite, source=path)
        if history.suffix.lower() not in HISTORY_SUFFIXES:
            *most, last = HISTORY_SUFFIXES
            expected = f"expected a name that ends in {', '.join(most)} or {last}"
            raise UsageError(f"--history {history}: {expected}")
    result = impact.run(
        source,
        model=model,
        friction=friction,
        at=dict(at or ()),
        overrides=sets or (),
        plugins=plugins or (),
        times=times,
    )
    show(result, as_json=as_json)
    if result.failed:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
    if history is not None:
        if result.history is None:
            raise UsageError(f"no history to store: {result.why_no_history}")
        if history.suffix.lower() == ".csv":
            write_file(history, encode_history(result.history), overwrite=overwrite)
        else:
            impact.save(result.history, history, overwrite=overwrite)
        exits.print_line(f"{history}: {result.history.sizes['t']} points in time")
