"""The command `run`: one impact."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import UsageError
from ..formatting import quantity
from ..text import safe_text
from . import exits
from .console import dump, print_rows
from .options import AtOption, JsonOption, OverwriteOption, PluginOption, SetOption, SourceArgument
from .params import complete_model, parse_whole_number

if TYPE_CHECKING:
    from ..api import Impact


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
        Path | None, typer.Option("--history", metavar="FILE", help="Write the time history to this file.")
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
    from .. import api
    from ..contact.status import FIRST_FAILURE
    from ..results import backend

    if times is not None and history is None:
        raise UsageError(f"--times {times}: expected --history FILE as well")
    if history is not None:
        for path in (source, *(plugins or ())):
            backend.check_output(history, overwrite=overwrite, source=path)
    impact = api.run(
        source, model=model, at=dict(at or ()), overrides=sets or (), plugins=plugins or (), times=times
    )
    if as_json:
        print(dump(run_json(impact)))
    else:
        print_run(impact)
    if impact.status >= FIRST_FAILURE:
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
    if history is not None:
        if impact.history is None:
            raise UsageError(f"no history to store: {impact.why_no_history}")
        api.save(impact.history, history, overwrite=overwrite)
        exits.print_line(f"{safe_text(str(history))}: {impact.history.sizes['t']} points in time")


def run_json(impact: Impact) -> dict[str, Any]:
    """One impact as plain data."""
    return {
        "model": impact.model.key,
        "inputs": dict(impact.point),
        "first_value_of": list(impact.first),
        "integrator": impact.integrator,
        "exponent": impact.exponent,
        "closing_speed": impact.closing_speed,
        "outputs": {**impact.values, "status": impact.status.name.lower()},
        "materials": {name: asdict(material) for name, material in impact.materials.items()},
        "derived": dict(impact.derived),
        "damping": impact.damping,
        "e_kinematic": impact.e_kinematic,
        "e_kinetic": impact.e_kinetic,
        "e_energetic": impact.e_energetic,
    }


def print_run(impact: Impact) -> None:
    """Print one impact: inputs, outputs, the three restitutions and estimated errors."""
    from ..config.tables import MATERIAL_QUANTITIES
    from ..contact.timestep import EXACT
    from ..results.schema import SCHEMA, plain_unit
    from ..results.single_impact import DERIVED_QUANTITIES

    rows: dict[str, Any] = {"model": impact.model.key, "equation": impact.model.equation}
    for name, value in impact.point.items():
        note = "  (first value of its axis)" if name in impact.first else ""
        rows[name] = quantity(value, _unit_at(impact, _unit_of(impact, name)), 10) + note
    for name, material in impact.materials.items():
        properties = {field: value for field, value in asdict(material).items() if value is not None}
        about = (
            f"{field} = {quantity(value, MATERIAL_QUANTITIES[field].unit, 10)}"
            for field, value in properties.items()
        )
        rows[f"[materials.{name}]"] = ", ".join(about)
    for name, unit, meaning in DERIVED_QUANTITIES:
        if impact.derived[name] == impact.derived[name] and name not in impact.point:
            rows[name] = f"{quantity(impact.derived[name], _unit_at(impact, plain_unit(unit)), 10)}  {meaning}"
    rows["status"] = f"{impact.status.name.lower()}: {impact.status.meaning}"
    for variable in SCHEMA:
        if variable.dtype == "f8" and variable.name not in ("e_kinetic", "e_energetic"):
            unit = _unit_at(impact, plain_unit(variable.unit))
            rows[variable.name] = quantity(impact.values[variable.name], unit, 10)
    rows["e_kinematic"] = quantity(impact.e_kinematic, "1", 12) + "  (1), from the velocities"
    rows["e_kinetic"] = quantity(impact.e_kinetic, "1", 12) + "  (2), tau_r/tau_c"
    rows["e_energetic"] = quantity(impact.e_energetic, "1", 12) + "  (3), the root of -W_r/W_c"
    rows["in the stated domain"] = "yes" if impact.values["in_domain"] else f"no: {impact.model.domain_text}"
    rows["steps"] = impact.values["steps"]
    if impact.integrator != EXACT:
        rows["integrator"] = impact.integrator
    print_rows(rows)


def _unit_of(impact: Impact, name: str) -> str:
    """The unit of an input, which may be a parameter of the model, or a property of a material."""
    from ..config.tables import MATERIAL_QUANTITIES, SWEEP_QUANTITIES, model_quantities

    key, _, parameter = name.rpartition(".")
    quantities = (
        model_quantities(impact.model)
        if key == impact.model.key
        else MATERIAL_QUANTITIES
        if key
        else SWEEP_QUANTITIES
    )
    return quantities[parameter].unit if parameter in quantities else "1"


def _unit_at(impact: Impact, unit: str) -> str:
    """A unit with the values of n and of the parameters that its exponents have."""
    from ..contact.units import with_numbers

    values = {name.rpartition(".")[2]: value for name, value in impact.point.items() if isinstance(value, float)}
    return with_numbers(unit, {**values, "n": impact.exponent})
