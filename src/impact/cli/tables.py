"""What the commands print on stdout: one impact, what is in a file."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

from ..contact.units import with_numbers
from ..sweeps.rules import MATERIAL, SWEEP, own_quantities
from .console import cell, console, shown, table
from .summary import worst_errors

if TYPE_CHECKING:
    import xarray as xr

    from ..api import Impact


# how a result is stored, where it was read from a file
STORED = ("layout", "seal")


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
        "materials": {name: asdict(material) for name, material in impact.materials.items()},
        "derived": dict(impact.derived), "damping": impact.damping, "e_kinematic": impact.e_kinematic,
        "e_kinetic": impact.e_kinetic, "e_energetic": impact.e_energetic,
    }  # fmt: skip


def print_run(impact: Impact) -> None:
    """One impact: inputs, outputs, the three restitutions, and how far they can be trusted."""
    from ..results.impact import DERIVED
    from ..results.schema import SCHEMA, plain_unit

    rows: dict[str, Any] = {"model": impact.model.key, "equation": impact.model.equation}
    for name, value in impact.point.items():
        note = "  (first value of its axis)" if name in impact.first else ""
        rows[name] = _quantity(value, _unit_at(impact, _unit_of(impact, name))) + note
    for name, material in impact.materials.items():
        known = {field: value for field, value in asdict(material).items() if value is not None}
        about = (f"{field} = {_quantity(value, MATERIAL[field].unit)}" for field, value in known.items())
        rows[f"[materials.{name}]"] = ", ".join(about)
    for name, unit, meaning in DERIVED:
        if impact.derived[name] == impact.derived[name] and name not in impact.point:
            rows[name] = f"{_quantity(impact.derived[name], _unit_at(impact, plain_unit(unit)))}  {meaning}"
    rows["status"] = f"{impact.status.name.lower()}: {impact.status.meaning}"
    for one in SCHEMA:
        if one.dtype == "f8" and one.name not in ("e_kinetic", "e_energetic"):
            rows[one.name] = _quantity(impact.values[one.name], _unit_at(impact, plain_unit(one.unit)))
    rows["e_kinematic"] = _quantity(impact.e_kinematic, "1", 12) + "  (1), from the velocities"
    rows["e_kinetic"] = _quantity(impact.e_kinetic, "1", 12) + "  (2), tau_r/tau_c"
    rows["e_energetic"] = _quantity(impact.e_energetic, "1", 12) + "  (3), the root of -W_r/W_c"
    rows["in the stated domain"] = "yes" if impact.values["in_domain"] else f"no: {impact.model.domain_text}"
    rows["steps"] = impact.values["steps"]
    print_rows(rows)


def _unit_of(impact: Impact, name: str) -> str:
    """The unit of an input, which may be a parameter of the model."""
    key, _, parameter = name.rpartition(".")
    known = own_quantities(impact.model) if key == impact.model.key else SWEEP
    return known[parameter].unit if parameter in known else "1"


def _unit_at(impact: Impact, unit: str) -> str:
    """A unit with the values of n and of the parameters that its exponents have."""
    own = {name.rpartition(".")[2]: value for name, value in impact.point.items() if isinstance(value, float)}
    return with_numbers(unit, {**own, "n": impact.exponent})


def _quantity(value: Any, unit: str, digits: int = 10) -> str:
    if not isinstance(value, float):
        return str(value)
    if value != value:
        return "–"
    return f"{value:.{digits}g}" + ("" if unit == "1" else f" {unit}")


def info_json(dataset: xr.Dataset) -> dict[str, Any]:
    """What is in a file as plain data; its layout and its seal are null where they are not known."""
    return {
        "points": math.prod(dataset.sizes.values()),
        **{name: dataset.encoding.get(name) for name in STORED},
        "dimensions": {str(name): size for name, size in dataset.sizes.items()},
        "coordinates": [str(name) for name in dataset.coords],
        "variables": {str(n): {"units": v.attrs.get("units"), "dims": list(v.dims)} for n, v in dataset.items()},
        "attributes": {
            str(n): v if isinstance(v, str) else np.asarray(v).tolist() for n, v in dataset.attrs.items()
        },
    }


def print_info(dataset: xr.Dataset, path: Path) -> None:
    """What is in a file, of any size; "–" where more would have to be evaluated than a summary is worth."""
    from ..results.schema import exponents_of, plain_unit
    from ..results.summary import counted, extremes_of, tally_of

    attributes = dataset.attrs
    tally = tally_of(dataset) if "model" in dataset.dims else None
    sizes = " × ".join(f"{name} {size}" for name, size in dataset.sizes.items())
    rows: dict[str, Any] = {"file": path, "title": attributes.get("title", ""), "dimensions": sizes}
    rows["points"] = f"{math.prod(dataset.sizes.values()):,}"
    rows |= {name: dataset.encoding[name] for name in STORED if dataset.encoding.get(name) is not None}
    for name, coordinate in dataset.coords.items():
        if name in ("title", "equation", "reference", "doi", "year"):
            continue
        text = _values_text(dataset, str(name))
        if name == "n" and coordinate.ndim == 0:
            text = exponents_of(dataset) or text
        unit = plain_unit(str(coordinate.attrs.get("units", "1")))
        rows[str(name)] = text + ("" if unit == "1" else f" [{unit}]")
    for name in (
        "rtol", "materials", "impact_version", "schema_version", "fingerprint", "plugins", "tolerances",
        "reason",
    ):  # fmt: skip
        if attributes.get(name, "{}") != "{}":
            rows[name] = attributes[name]
    if json.loads(attributes.get("config_set", "[]")):
        rows["config_set"] = attributes["config_set"]
    if tally and tally.counts:
        rows["status"] = ", ".join(f"{count:,} {name}" for name, count in counted(tally.counts).items())
    if tally and tally.not_counted:
        rows["not evaluated"] = f"the status of {tally.not_counted:,} points"
    print_rows(rows)
    out = console(sys.stdout)
    out.print()
    listed = table("variable", "unit", "dimensions", "smallest", "largest", "missing")
    for name, variable in dataset.items():
        extremes = extremes_of(dataset, str(name))
        ends = [f"{end:.6g}" if end == end else "–" for end in extremes[:2]] if extremes else ["–", "–"]
        listed.add_row(
            cell(name), cell(variable.attrs.get("units", "")), cell(", ".join(map(str, variable.dims))), *ends,
            f"{extremes.missing:,}" if extremes else "–",
        )  # fmt: skip
    out.print(listed)
    if tally and tally.worst:
        out.print()
        out.print(worst_errors(dataset, tally))


def _values_text(dataset: xr.Dataset, name: str) -> str:
    """The values of a coordinate: few of them one by one, of many the ends and how many there are."""
    from ..results.slabs import is_large
    from ..results.summary import extremes_of

    coordinate = dataset[name]
    if is_large(coordinate.variable):
        extremes = extremes_of(dataset, name)
        ends = f"{extremes.smallest:g} … {extremes.largest:g}, " if extremes else ""
        return f"{ends}{coordinate.size} values"
    values = coordinate.values.reshape(-1)
    distinct = list(dict.fromkeys(values.tolist()))
    if values.dtype.kind == "f" and len(distinct) > 4:
        return f"{values.min():g} … {values.max():g}, {values.size} values"
    return ", ".join(shown(value) for value in distinct)
