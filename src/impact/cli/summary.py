"""What a sweep prints on stderr when it is done: what came out, what failed, and what repeats it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from rich.table import Table

from ..contact.status import FIRST_FAILURE, Status
from ..formatting import label, number
from ..text import safe_text
from . import exits
from .console import cell, console, dump, table
from .progress import progress

if TYPE_CHECKING:
    import xarray as xr

    from ..engine.plan import Plan
    from ..results.summary import Summary, SweepOutcome


def execute(plan: Plan, should_stop: Callable[[], bool], *, quiet: bool) -> xr.Dataset:
    """The result of a plan in memory, with progress; a signal ends it."""
    from .. import api

    with progress(quiet=quiet) as report:
        return api.execute(plan, on_progress=report, should_stop=should_stop)


def summary(outcome: SweepOutcome, output: Path) -> dict[str, Any]:
    """Points, counts per status, and the first failed points with their coordinates and the command for each."""
    from ..results.replay_command import command_start, inputs_of_model, replay_command
    from ..results.summary import counts_by_name

    dataset, totals = outcome.dataset, outcome.summary
    command = command_start(str(output), dataset)
    failures = []
    for status, model, places in totals.failed_at:
        point = dataset["status"].isel(dict(zip(dataset["status"].dims, (model, *places), strict=True)))
        at = inputs_of_model({str(dim): point[dim].values.item() for dim in dataset["status"].dims})
        again = replay_command(command, at) if command else None
        failures.append({"status": status.name.lower(), "at": at, "replay": again})
    return {
        "output": str(output), "points": totals.points, "models": dataset.sizes["model"],
        "trajectories": outcome.trajectories, "status": counts_by_name(totals.counts), "failed": totals.failed,
        "first_failed": failures, "layout": dataset.encoding.get("layout"), "seal": dataset.encoding.get("seal"),
    }  # fmt: skip


def conclude(
    outcome: SweepOutcome, output: Path, *, fresh: bool, quiet: bool, as_json: bool, allow_failed: bool
) -> None:
    """Print what came out of a sweep, and end with the exit code that it has.

    Parameters
    ----------
    outcome : the result
    output : its file
    fresh : whether it was stored just now
    quiet, as_json, allow_failed : as the options of those names
    """
    from ..results.plausibility import result_notes

    fields = summary(outcome, output)
    if not quiet:
        if fresh:
            with exits.readers_may_leave(sys.stderr):
                print_summary(outcome, fields)
            for note in result_notes(outcome.summary):
                exits.say(f"note: {note}")
        else:
            exits.say(f"{safe_text(str(output))}: already holds this sweep; nothing to do")
    if as_json:
        print(dump(fields))
    if fields["failed"] and not allow_failed:
        if quiet or not fresh:
            exits.say(failed_line(fields), error=True)
        raise typer.Exit(exits.LANES_FAILED)


def failed_line(found: Mapping[str, Any]) -> str:
    """How many points failed, and why."""
    reasons = (f"{n:,} {name}" for name, n in found["status"].items() if Status[name.upper()] >= FIRST_FAILURE)
    counts = f"{found['failed']:,} of {found['points']:,} points failed ({', '.join(reasons)})"
    return f"{safe_text(found['output'])}: {counts}"


def print_summary(outcome: SweepOutcome, found: Mapping[str, Any]) -> None:
    """What came out of a sweep, on stderr."""
    out = console(sys.stderr)
    if outcome.summary.worst:
        out.print(worst_errors(outcome.dataset, outcome.summary))
    counts = ", ".join(f"{count:,} {name}" for name, count in found["status"].items())
    distinct = f" from {found['trajectories']:,} trajectories" if found["trajectories"] is not None else ""
    out.print(cell(f"{found['output']}: {found['points']:,} points{distinct} ({counts})"))
    for one in found["first_failed"]:
        where = ", ".join(f"{name}={label(value)}" for name, value in one["at"].items())
        out.print(cell(f"failed: {where}: {Status[one['status'].upper()].meaning}"))
        if one["replay"]:
            # as one line, however long: a command is to be copied
            out.print(cell(f"  {one['replay']}"), soft_wrap=True)
    more = found["failed"] - len(found["first_failed"])
    if more > 0:
        out.print(cell(f"and {more:,} more"))


def worst_errors(dataset: xr.Dataset, totals: Summary) -> Table:
    """The largest errors per model, as far as the result has them."""
    columns = {
        "e_error": "max |e_out − e|", "v1_error": "max |v1 error|", "v2_error": "max |v2 error|",
        "closed_form_error": "max |e_out − exact|", "energy_residual": "max |residual|",
    }  # fmt: skip
    held = [name for name in columns if name in totals.worst]
    rows = table("model", *(columns[name] for name in held))
    for model, key in enumerate(dataset["model"].values):
        largest = (totals.worst[name].get(model, float("nan")) for name in held)
        rows.add_row(cell(key), *(number(value, 3) for value in largest))
    return rows
