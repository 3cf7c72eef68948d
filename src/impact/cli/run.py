"""The command `run`: one impact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

import impact

from ..atomic import check_outputs, write_file
from ..display import check_suffix, show
from ..errors import UsageError
from . import exits, options

# files of a time history: netCDF-4, which is HDF5, and a table
HISTORY_SUFFIXES = (".h5", ".hdf5", ".nc", ".csv")


def run(
    source: options.Source = None,
    model: Annotated[str | None, options.model("The model. \\[default: the first of the source]")] = None,
    friction: options.FrictionKey = None,
    at: options.At = None,
    overrides: options.Set = None,
    plugins: options.Plugins = None,
    history: Annotated[
        Path | None, options.value("FILE", "Write the time history: .h5, .hdf5, .nc or .csv.")
    ] = None,
    times: Annotated[
        int | None,
        options.whole_number("Number of uniform times of the history. \\[default: steps of the integrator]"),
    ] = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
) -> None:
    """Run one impact: inputs, outputs and estimated errors."""
    from ..plots.data import encode_history

    if times is not None and history is None:
        raise UsageError(f"--times {times}: expected --history FILE as well")
    if history is not None:
        check_outputs([history], (source, *(plugins or ())), overwrite=overwrite)
        check_suffix(history, "history", HISTORY_SUFFIXES)
    result = options.call(impact.run, locals())
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
