"""The summary that a sweep prints: counts, largest errors, failed points and the commands that repeat them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table

from ..contact.status import FIRST_FAILURE, Status
from ..formatting import label, number
from . import exits
from .console import cell, console, dump, table

if TYPE_CHECKING:
    from ..results.summary import SweepOutcome


def summary_json(outcome: SweepOutcome, output: Path) -> dict[str, Any]:
    """Points, counts per status, and the first failed points with their coordinates and the command for each."""
    from ..results.replay_command import command_start, inputs_of_model, replay_command
    from ..results.summary import counts_by_name

    dataset, totals = outcome.dataset, outcome.summary
    command = command_start(str(output), dataset)
    failures = []
    for status, model, index in totals.failed_at:
        point = dataset["status"].isel(dict(zip(dataset["status"].dims, (model, *index), strict=True)))
        at = inputs_of_model({str(dim): point[dim].values.item() for dim in dataset["status"].dims})
        command_of_point = replay_command(command, at) if command else None
        failures.append({"status": status.name.lower(), "at": at, "replay": command_of_point})
    return {
        "output": str(output),
        "points": totals.points,
        "models": dataset.sizes["model"],
        "trajectories": outcome.trajectories,
        "status": counts_by_name(totals.counts),
        "failed": totals.failed,
        "first_failed": failures,
        "layout": dataset.encoding.get("layout"),
        "seal": dataset.encoding.get("seal"),
    }


def conclude(outcome: SweepOutcome, output: Path, *, quiet: bool, as_json: bool, allow_failed: bool) -> None:
    """Print the summary of a sweep, and exit with its code.

    Parameters
    ----------
    outcome : the result
    output : its file
    quiet, as_json, allow_failed : as the options of those names
    """
    from ..results.plausibility import result_notes

    fields = summary_json(outcome, output)
    if not quiet:
        if outcome.is_new:
            with exits.ignore_broken_pipe(sys.stderr):
                print_summary(outcome, fields)
            for note in result_notes(outcome.summary):
                exits.print_line(f"note: {note}")
        else:
            exits.print_line(f"{output}: already contains this sweep; nothing to do")
    if as_json:
        print(dump(fields))
    if fields["failed"] and not allow_failed:
        if quiet or not outcome.is_new:
            exits.print_line(failed_line(fields), error=True)
        raise typer.Exit(exits.EXIT_POINTS_FAILED)


def failed_line(fields: Mapping[str, Any]) -> str:
    """One line with the number of failed points by status."""
    reasons = (f"{n:,} {name}" for name, n in fields["status"].items() if Status[name.upper()] >= FIRST_FAILURE)
    counts = f"{fields['failed']:,} of {fields['points']:,} points failed ({', '.join(reasons)})"
    return f"{fields['output']}: {counts}"


def print_summary(outcome: SweepOutcome, fields: Mapping[str, Any]) -> None:
    """Print the summary of a sweep on stderr."""
    from ..results.summary import worst_by_model

    out = console(sys.stderr)
    if outcome.summary.worst:
        out.print(worst_errors(worst_by_model(outcome.summary, outcome.dataset)))
    counts = ", ".join(f"{count:,} {name}" for name, count in fields["status"].items())
    distinct = f" from {fields['trajectories']:,} trajectories" if fields["trajectories"] is not None else ""
    out.print(cell(f"{fields['output']}: {fields['points']:,} points{distinct} ({counts})"))
    for failure in fields["first_failed"]:
        where = ", ".join(f"{name}={label(value)}" for name, value in failure["at"].items())
        out.print(cell(f"failed: {where}: {Status[failure['status'].upper()].meaning}"))
        if failure["replay"]:
            # no wrapping, so that commands can be copied
            out.print(cell(f"  {failure['replay']}"), soft_wrap=True)
    more = fields["failed"] - len(fields["first_failed"])
    if more > 0:
        out.print(cell(f"and {more:,} more"))


def worst_errors(worst: Mapping[str, Mapping[str, float]]) -> Table:
    """A table of the largest errors, by variable and model."""
    headings = {
        "e_error": "max |e_out − e|",
        "v1_error": "max |v1 error|",
        "v2_error": "max |v2 error|",
        "closed_form_error": "max |e_out − exact|",
        "energy_residual": "max |residual|",
    }
    shown = [name for name in headings if name in worst]
    rows = table("model", *(headings[name] for name in shown))
    for model in dict.fromkeys(model for name in shown for model in worst[name]):
        rows.add_row(cell(model), *(number(worst[name].get(model, float("nan")), 3) for name in shown))
    return rows
