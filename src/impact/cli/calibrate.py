"""The command `calibrate`: which law, with which parameters, fits my measurements?"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..formatting import decimals, number
from ..text import safe_text
from . import exits
from .console import cell, console, dump, table
from .options import JsonOption, OverwriteOption, PluginOption, SetOption

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
    as_json: JsonOption = False,
) -> None:
    """Fit laws to measurements, and rank them.

    Intervals are those of 95 % by profile likelihood. A parameter that the data do not determine has none.
    """
    from .. import api

    result = api.calibrate(
        config, output=output, best=best, overwrite=overwrite, overrides=sets or (), plugins=plugins or ()
    )
    if as_json:
        print(dump(calibration_json(result)))
    else:
        _print_fits(result)
    for path in (output, best):
        if path is not None:
            exits.print_line(f"{safe_text(str(path))}: written")


def calibration_json(result: xr.Dataset) -> dict[str, Any]:
    """A calibration as plain data, the best law first; parameters by config path."""
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
                "status": _status(law),
                "parameters": parameters,
                "determined": [group for group in str(law["determined"].item()).split("; ") if group],
                **{name: float(law[name]) for name in ("chi2_reduced", "excess", "aicc", "weight", "loo")},
            }
        )
    return {"models": models}


def _status(law: xr.Dataset) -> str:
    words = str(law["fit_status"].attrs["flag_meanings"]).split()
    return words[int(law["fit_status"])]


def _print_fits(result: xr.Dataset) -> None:
    """Print a row for each law and parameter, the best law first."""
    out = console(sys.stdout)
    points, noise = result.sizes["point"], result.attrs["noise"]
    out.print(cell(f"{points} measured values, noise {noise}; the best law first"), soft_wrap=True)
    out.print()
    rows = table("law", "parameter", "estimate", "95 %", "chi2/dof", "AICc", "weight", "loo", "status")
    rows.columns[1].justify = rows.columns[8].justify = "left"
    notes = []
    for key in map(str, result["model"].values):
        law = result.sel(model=key)
        status = _status(law)
        quality = (
            number(float(law["chi2_reduced"]), 3),
            decimals(float(law["aicc"]), 1),
            decimals(float(law["weight"]), 3),
            number(float(law["loo"]), 3),
            status,
        )
        parameters = [str(name) for name in law["parameter"].values[law["identifiable"].values >= 0]]
        for position, name in enumerate(parameters or [""]):
            first = position == 0
            of_name = law.sel(parameter=name) if name else None
            rows.add_row(
                key if first else "",
                cell(name.removeprefix(f"{key}.")),
                *_estimate(of_name),
                *(quality if first else ("",) * len(quality)),
            )
        unidentified = [name for name in parameters if int(law["identifiable"].sel(parameter=name)) == 0]
        if unidentified:
            groups = str(law["determined"].item())
            short = ", ".join(name.removeprefix(f"{key}.") for name in unidentified)
            only = f"only {groups} is determined" if groups else "the data do not determine them"
            notes.append(f"{key}: {short}: {only}")
    out.print(rows)
    for note in notes:
        out.print(cell(note), soft_wrap=True)


def _estimate(of_name: xr.Dataset | None) -> tuple[str, str]:
    """An estimate and its interval as text."""
    if of_name is None:
        return "", ""
    if not int(of_name["identifiable"]):
        return number(float(of_name["estimate"]), 5), "not identified"
    lower, upper = float(of_name["lower"]), float(of_name["upper"])
    interval = "–" if lower != lower else f"{number(lower, 5)} to {number(upper, 5)}"
    return number(float(of_name["estimate"]), 5), interval
