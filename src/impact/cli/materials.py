"""The command `materials`: common materials that need no table in a config, with their sources."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Annotated

import typer

import impact

from ..display import Table, dump, print_blocks
from ..errors import UsageError, did_you_mean
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
    rows = [
        (key, *map(partial(_display_value, record), DISPLAY_UNITS), record["about"], record["source"])
        for key, record in shown.items()
    ]
    headings = ("material", *(f"{key} [{unit}]" for key, unit in DISPLAY_UNITS.items()), "what", "source")
    print_blocks([Table(rows, headings, text=(0, -2, -1))])


def _display_value(record: Mapping[str, float | str], name: str) -> float | str:
    """Convert a property to its unit in the table."""
    return float(record[name]) / SI_PER_UNIT.get(DISPLAY_UNITS[name], 1.0) if name in record else "–"
