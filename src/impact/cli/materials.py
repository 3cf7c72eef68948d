"""The command `materials`: common materials that need no table in a config, with their sources."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import impact

from ..errors import UsageError, did_you_mean
from .console import dump
from .options import JsonOption

DISPLAY_UNITS = {"E": "GPa", "nu": "-", "rho": "kg/m3", "yield_strength": "MPa"}
SI_PER_UNIT = {"GPa": 1e9, "MPa": 1e6}


def materials(
    name: Annotated[str | None, typer.Argument(help="A material to show alone. \\[default: list them]")] = None,
    as_json: JsonOption = False,
) -> None:
    """List common materials, which need no table in a config: E, nu, rho, yield strength, source."""

    catalogue = impact.materials()
    if name is not None and name not in catalogue:
        raise UsageError(f'no material "{name}"; {did_you_mean(name, list(catalogue))}')
    shown = catalogue if name is None else {name: catalogue[name]}
    if as_json:
        print(dump(shown))
        return
    from .console import cell, console, table

    rows = table("material", *(f"{key} [{unit}]" for key, unit in DISPLAY_UNITS.items()), "what", "source")
    for column in rows.columns[-2:]:
        column.justify = "left"
    for key, record in shown.items():
        numbers = [
            cell(float(record[field]) / SI_PER_UNIT.get(unit, 1.0)) if field in record else cell("–")
            for field, unit in DISPLAY_UNITS.items()
        ]
        rows.add_row(key, *numbers, cell(record["about"]), cell(record["source"]))
    console(sys.stdout).print(rows)
