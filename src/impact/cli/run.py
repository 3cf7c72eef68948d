"""The command `run`: one impact."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..atomic import check_output, write_file
from ..errors import UsageError
from . import exits
from .completion import complete_model
from .console import dump, print_rows
from .options import AtOption, JsonOption, OverwriteOption, PluginOption, SetOption, SourceArgument
from .params import parse_whole_number

if TYPE_CHECKING:
    from ..results.single_impact import Impact

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
    from ..contact.status import FIRST_FAILURE
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
        source, model=model, at=dict(at or ()), overrides=sets or (), plugins=plugins or (), times=times
    )
    if as_json:
        print(dump(run_json(result)))
    else:
        print_rows(result.rows())
    if result.status >= FIRST_FAILURE:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
    if history is not None:
        if result.history is None:
            raise UsageError(f"no history to store: {result.why_no_history}")
        if history.suffix.lower() == ".csv":
            write_file(history, encode_history(result.history), overwrite=overwrite)
        else:
            impact.save(result.history, history, overwrite=overwrite)
        exits.print_line(f"{history}: {result.history.sizes['t']} points in time")


def run_json(result: Impact) -> dict[str, Any]:
    """One impact as plain data."""
    return {
        "model": result.model.key,
        "inputs": dict(result.point),
        "first_value_of": list(result.first),
        "integrator": result.integrator,
        "exponent": result.exponent,
        "closing_speed": result.closing_speed,
        "outputs": {**result.values, "status": result.status.name.lower()},
        "materials": {name: asdict(material) for name, material in result.materials.items()},
        "derived": dict(result.derived),
        "damping": result.damping,
        "e_kinematic": result.e_kinematic,
        "e_kinetic": result.e_kinetic,
        "e_energetic": result.e_energetic,
    }
