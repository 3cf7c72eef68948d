"""The command `calibrate`: which law, with which parameters, fits my measurements?"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from . import exits
from .console import cell, console, dump, table
from .options import JobsOption, JsonOption, OverwriteOption, PluginOption, SetOption

if TYPE_CHECKING:
    import xarray as xr


def calibrate(
    config: Annotated[Path, typer.Argument(help="A TOML file with \\[data] and { fit = \\[least, most] }.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The result file. \\[default: none]")
    ] = None,
    overwrite: OverwriteOption = False,
    best: Annotated[
        Path | None,
        typer.Option("--best", metavar="FILE", help="Write the config of the best law with its parameters."),
    ] = None,
    sets: SetOption = None,
    plugins: PluginOption = None,
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Fit laws to measurements, and rank them.

    Intervals are those of 95 % by profile likelihood. A parameter that the data do not determine has none.
    """

    result = impact.calibrate(
        config,
        output=output,
        best=best,
        overwrite=overwrite,
        overrides=sets or (),
        plugins=plugins or (),
        jobs=jobs,
    )
    if as_json:
        print(dump(calibration_json(result)))
    else:
        print_fits(result)
    for path in (output, best):
        if path is not None:
            exits.print_line(f"{path}: written")


# numbers of a law in JSON
CRITERIA = ("chi2_reduced", "p_value", "excess", "aicc", "weight", "loo")


def calibration_json(result: xr.Dataset) -> dict[str, Any]:
    """A calibration as plain data, the best law first; parameters by config path."""
    from ..results.calibration import fit_status, largest_residuals

    models, paths = [], json.loads(result.attrs["fit_paths"])
    for rank, key in enumerate(map(str, result["model"].values), 1):
        law = result.sel(model=key)
        parameters = {}
        for name, path in zip(map(str, law["parameter"].values), paths, strict=True):
            of_name = law.sel(parameter=name)
            if int(of_name["identifiable"]) >= 0:
                parameters[path] = {
                    "estimate": float(of_name["estimate"]),
                    "lower": float(of_name["lower"]),
                    "upper": float(of_name["upper"]),
                    "identifiable": bool(of_name["identifiable"]),
                }
        models.append(
            {
                "model": key,
                "rank": rank,
                "status": fit_status(law),
                "parameters": parameters,
                "determined": [group for group in str(law["determined"].item()).split("; ") if group],
                **{name: float(law[name]) for name in CRITERIA},
            }
        )
    return {"models": models, "largest_residuals": [asdict(residual) for residual in largest_residuals(result)]}


def print_fits(result: xr.Dataset) -> None:
    """Print a row for each law and parameter, the best law first, and what to know besides."""
    from ..results.calibration import FIT_HEADINGS, describe_data, fit_notes, fit_rows

    out = console(sys.stdout)
    out.print(cell(describe_data(result)), soft_wrap=True)
    out.print()
    rows = table(*FIT_HEADINGS)
    rows.columns[1].justify = rows.columns[-1].justify = "left"
    for row in fit_rows(result):
        rows.add_row(*map(cell, row))
    out.print(rows)
    for note in fit_notes(result):
        out.print(cell(note), soft_wrap=True)
