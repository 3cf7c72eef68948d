"""What the commands print on stdout: one impact, what is in a file."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from .console import cell, console, shown, table
from .summary import worst_errors

if TYPE_CHECKING:
    import xarray as xr

    from ..api import Impact


def print_rows(rows: Mapping[str, Any]) -> None:
    """Names and what they are, a line each."""
    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows.items():
        table.add_row(cell(name), cell(value))
    console(sys.stdout).print(table)


def run_json(impact: Impact) -> dict[str, Any]:
    """One impact as plain data."""
    return {
        "model": impact.model.key, "inputs": dict(impact.point), "first_value_of": list(impact.first),
        "exponent": impact.exponent, "closing_speed": impact.closing_speed,
        "outputs": {**impact.values, "status": impact.status.name.lower()},
        "damping": impact.damping, "e_kinematic": impact.e_kinematic, "e_kinetic": impact.e_kinetic,
        "e_energetic": impact.e_energetic,
    }  # fmt: skip


def print_run(impact: Impact) -> None:
    """One impact: inputs, outputs, the three restitutions, and how far they can be trusted."""
    from ..data.results import SCHEMA
    from ..sweeps.rules import SWEEP, own_quantities

    n = f"{impact.exponent:g}"
    rows: dict[str, Any] = {"model": impact.model.key, "equation": impact.model.equation}
    own = {f"{impact.model.key}.{name}": one for name, one in own_quantities(impact.model).items()}
    for name, value in impact.point.items():
        unit = own[name].unit if name in own else SWEEP[name].unit if name in SWEEP else "1"
        note = "  (first value of its axis)" if name in impact.first else ""
        # the sweep's K is of the sweep's n, a law's parameters are of its own
        exponent = impact.exponent if name in own else impact.point["n"]
        rows[name] = _quantity(value, re.sub(r"\bn\b", f"{exponent:g}", unit).removesuffix("^1")) + note
    rows["status"] = f"{impact.status.name.lower()}: {impact.status.meaning}"
    for one in SCHEMA:
        if one.dtype == "f8" and one.name != "damping_ratio":
            rows[one.name] = _quantity(impact.values[one.name], one.unit.replace("m-n", f"m-{n}"))
    rows["chi = lambda v0/K"] = _quantity(impact.values["damping_ratio"], "1")
    rows["lambda"] = _quantity(impact.damping, f"N s/m^{impact.exponent + 1:g}")
    rows["e kinematic (1)"] = _quantity(impact.e_kinematic, "1", 12) + "  from the velocities"
    rows["e kinetic (2)"] = _quantity(impact.e_kinetic, "1", 12) + "  from the impulses of the two phases"
    rows["e energetic (3)"] = _quantity(impact.e_energetic, "1", 12) + "  from their works"
    rows["in the claimed domain"] = "yes" if impact.values["in_domain"] else f"no: {impact.model.domain_text}"
    rows["steps"] = impact.values["steps"]
    print_rows(rows)


def _quantity(value: Any, unit: str, digits: int = 10) -> str:
    from ..data.results import plain_unit

    if not isinstance(value, float):
        return str(value)
    if value != value:
        return "–"
    return f"{value:.{digits}g}" + ("" if unit == "1" else f" {plain_unit(unit)}")


def info_json(dataset: xr.Dataset) -> dict[str, Any]:
    """What is in a file as plain data."""
    return {
        "dimensions": {str(name): size for name, size in dataset.sizes.items()},
        "coordinates": [str(name) for name in dataset.coords],
        "variables": {str(n): {"units": v.attrs.get("units"), "dims": list(v.dims)} for n, v in dataset.items()},
        "attributes": {
            str(n): v if isinstance(v, str) else np.asarray(v).tolist() for n, v in dataset.attrs.items()
        },
    }


def print_info(dataset: xr.Dataset, path: Path) -> None:
    """What is in a file."""
    from ..data.results import plain_unit
    from ..data.tally import counted, tally_of

    attributes = dataset.attrs
    tally = tally_of(dataset) if "model" in dataset.dims else None
    sizes = " × ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    rows: dict[str, Any] = {"file": path, "title": attributes.get("title", ""), "dimensions": sizes}
    for name, coordinate in dataset.coords.items():
        if name in ("title", "equation", "reference", "doi", "year"):
            continue
        values = coordinate.values.reshape(-1)
        distinct = list(dict.fromkeys(values.tolist()))
        if values.dtype.kind == "f" and len(distinct) > 4:
            text = f"{values.min():g} … {values.max():g}, {values.size} values"
        else:
            text = ", ".join(shown(one) for one in distinct)
        unit = plain_unit(str(coordinate.attrs.get("units", "1")))
        rows[str(name)] = text + ("" if unit == "1" else f" [{unit}]")
    for name in (
        "rtol", "materials", "impact_version", "schema_version", "fingerprint", "content_digest", "plugins",
        "tolerances", "reason",
    ):  # fmt: skip
        if attributes.get(name, "{}") != "{}":
            rows[name] = attributes[name]
    if json.loads(attributes.get("config_set", "[]")):
        rows["config_set"] = attributes["config_set"]
    if tally and tally.counts:
        rows["status"] = ", ".join(f"{count:,} {name}" for name, count in counted(tally.counts).items())
    print_rows(rows)
    out = console(sys.stdout)
    out.print()
    listed = table("variable", "unit", "dimensions", "smallest", "largest", "missing")
    for name, variable in dataset.items():
        values = variable.values
        finite = values[np.isfinite(values)]
        ends = (f"{finite.min():.6g}", f"{finite.max():.6g}") if finite.size else ("–", "–")
        listed.add_row(
            cell(name), cell(variable.attrs.get("units", "")), cell(", ".join(map(str, variable.dims))), *ends,
            str(values.size - finite.size),
        )  # fmt: skip
    out.print(listed)
    if tally and tally.worst:
        out.print()
        out.print(worst_errors(dataset, tally))
