"""What a sweep tells on stderr: its progress, what came out, and what failed."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from ..contact.status import FIRST_FAILURE, Status
from ..text import safe_text
from .console import cell, console, shown, table

if TYPE_CHECKING:
    import xarray as xr

    from ..sweeps.plan import Plan

# progress is shown when a sweep takes longer than this many seconds
PATIENCE = 1.0
FAILED_SHOWN = 3


@contextmanager
def progress(points: int, *, quiet: bool) -> Iterator[Callable[[int], None]]:
    """A function to tell the number of finished points; a bar appears on a terminal after a second."""
    if quiet or not sys.stderr.isatty():
        yield lambda done: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    bar = Progress(*columns, console=console(sys.stderr), transient=True)
    task = bar.add_task(f"{points:,} points", total=points)
    begun = time.monotonic()

    def tell(done: int) -> None:
        if not bar.live.is_started and time.monotonic() - begun > PATIENCE:
            bar.start()
        bar.update(task, completed=done)

    try:
        yield tell
    finally:
        bar.stop()


def execute(plan: Plan, check: Callable[[str], None], *, quiet: bool) -> xr.Dataset:
    """The result of a plan, with progress; between blocks a signal ends it."""
    from .. import api

    with progress(plan.points, quiet=quiet) as tell:

        def step(done: int) -> None:
            check("nothing was written")
            tell(done)

        dataset = api.execute(plan, step)
    check("nothing was written")
    return dataset


def summary(dataset: xr.Dataset, output: Path) -> dict[str, Any]:
    """Points, counts per status, and the first failed points with their coordinates."""
    counts: dict[str, int] = {}
    failures: list[dict[str, Any]] = []
    failed = 0
    if "status" in dataset:
        status = dataset["status"]
        numbers, times = np.unique(status.values, return_counts=True)
        counts = {Status(int(n)).name.lower(): int(t) for n, t in zip(numbers, times, strict=True)}
        places = np.flatnonzero(status.values.reshape(-1) >= FIRST_FAILURE)
        failed = int(places.size)
        for place in places[:FAILED_SHOWN]:
            index = np.unravel_index(place, status.shape)
            point = status.isel(dict(zip(status.dims, index, strict=True)))
            where = {str(dim): point[dim].values.item() for dim in status.dims}
            failures.append({"status": Status(int(point)).name.lower(), "at": where})
    points = int(np.prod(list(dataset.sizes.values())))
    return {
        "output": str(output), "points": points, "models": dataset.sizes["model"], "status": counts,
        "failed": failed, "first_failed": failures, "content_digest": dataset.attrs["content_digest"],
    }  # fmt: skip


def failed_line(found: Mapping[str, Any]) -> str:
    """How many points failed, and why."""
    reasons = (f"{n} {name}" for name, n in found["status"].items() if Status[name.upper()] >= FIRST_FAILURE)
    counts = f"{found['failed']} of {found['points']} points failed ({', '.join(reasons)})"
    return f"{safe_text(found['output'])}: {counts}"


def print_summary(dataset: xr.Dataset, found: Mapping[str, Any]) -> None:
    """What came out of a sweep, on stderr."""
    out = console(sys.stderr)
    out.print(worst_errors(dataset))
    counts = ", ".join(f"{count} {name}" for name, count in found["status"].items())
    out.print(cell(f"{found['output']}: {found['points']} points ({counts})"))
    for one in found["first_failed"]:
        where = ", ".join(f"{name}={shown(value)}" for name, value in one["at"].items())
        out.print(cell(f"failed: {where}: {Status[one['status'].upper()].meaning}"))
    more = found["failed"] - len(found["first_failed"])
    if more > 0:
        out.print(cell(f"and {more} more"))


def worst_errors(dataset: xr.Dataset) -> Table:
    """The largest errors per model, as far as the result has them."""
    columns = {
        "e_error": "max |e_out − e|", "v1_error": "max |v1 error|", "v2_error": "max |v2 error|",
        "oracle_error": "max |e_out − exact|", "residual": "max |residual|",
    }  # fmt: skip
    held = [name for name in columns if name in dataset]
    rows = table("model", *(columns[name] for name in held))
    for key in dataset["model"].values:
        one = dataset.sel(model=key)
        largest = (np.abs(one[name].values) for name in held)
        cells = [f"{np.nanmax(v):.3g}" if np.isfinite(v).any() else "–" for v in largest]
        rows.add_row(cell(key), *cells)
    return rows
