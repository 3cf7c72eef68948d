"""What `impact sweep --dry-run` tells."""

from __future__ import annotations

import sys
from dataclasses import asdict

from ..engine.plan import Plan
from ..results.estimate import estimate
from .console import cell, console, table
from .progress import clock
from .words import dump

HOW = {
    "block": "too many cells to compare, equal ones are found within a block",
    "not": "every point is integrated (solver.collapse = false)",
}


def tell_of(plan: Plan, jobs: int, *, as_json: bool) -> None:
    """Points, trajectories per model and how they collapse, bytes and time, on stdout."""
    found = estimate(plan, jobs)
    if as_json:
        print(dump(asdict(found)))
        return
    out = console(sys.stdout)
    rows = table("model", "points", "cells", "trajectories", "how the points collapse")
    rows.columns[-1].justify = "left"
    for one in found.models:
        along = f"depends on {', '.join(one.axes)}" if one.axes else "depends on no axis"
        how = along if one.within == "plan" else f"{along}; {HOW[one.within]}"
        rows.add_row(cell(one.model), f"{one.points:,}", f"{one.cells:,}", f"{one.trajectories:,}", cell(how))
    out.print(rows)
    size = f"{found.bytes:,} bytes (and {found.kept:,} while it runs)"
    counts = f"{found.points:,} points from {found.trajectories:,} trajectories"
    time = f"about {clock(found.seconds)} by {found.core} and what the disk takes"
    out.print(f"{counts}, {size}, {time}; nothing was written")
    if len(found.by_workers) > 1:
        many = ", ".join(f"{clock(seconds)} by {count:,}" for count, seconds in found.by_workers.items())
        out.print(f"on a cluster: {found.wire:,} bytes over the wire; about {many} workers; more are of no use")
