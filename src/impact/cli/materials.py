"""The command `materials`: the materials that need no table in a config, and where their numbers are from."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from ..errors import UsageError, did_you_mean
from ..text import safe_text
from .console import dump
from .options import JsonOption

UNITS = {"E": "GPa", "nu": "-", "rho": "kg/m3", "yield_strength": "MPa"}
SCALES = {"GPa": 1e9, "MPa": 1e6}


def materials(
    name: Annotated[str | None, typer.Argument(help="A material to show alone. \\[default: list them]")] = None,
    as_json: JsonOption = False,
) -> None:
    """Common materials that a config may name without a table: E, nu, rho, yield strength, source."""
    from .. import api

    known = api.materials()
    if name is not None and name not in known:
        raise UsageError(f'no material "{safe_text(name)}"; {did_you_mean(name, list(known))}')
    shown = known if name is None else {name: known[name]}
    if as_json:
        print(dump(shown))
        return
    from .console import cell, console, table

    rows = table("material", *(f"{key} [{unit}]" for key, unit in UNITS.items()), "what", "source")
    for column in rows.columns[-2:]:
        column.justify = "left"
    for key, record in shown.items():
        numbers = [
            cell(float(record[field]) / SCALES.get(unit, 1.0)) if field in record else cell("–")
            for field, unit in UNITS.items()
        ]
        rows.add_row(key, *numbers, cell(record["about"]), cell(record["source"]))
    console(sys.stdout).print(rows)
