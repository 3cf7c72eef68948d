"""What a sweep, a merge or an extension wrote: counts by status, largest errors, first failed points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from ..contact.status import FIRST_FAILURE, FrictionStatus
from ..display import Block, Displayed, Table, Wrapped
from ..formatting import label, number
from .plausibility import result_notes
from .replay_command import command_start, inputs_at, replay_command
from .summary import ERROR_HEADINGS, Summary, counts_by_name, counts_text


@dataclass(frozen=True)
class SweepOutcome(Displayed):
    """The result of a sweep, which may be larger than memory, and its summary.

    Parameters
    ----------
    dataset : its coordinates and attributes; the values of its variables may be placeholders
    summary : of its points
    trajectories : number of different trajectories; None if unknown
    is_new : whether the file was written now; False if it held this sweep already
    integrated : how many trajectories were integrated now; None if not counted
    repeated_blocks : number of blocks that several shards have
    extended_layout : layout of the result that was extended; only "factored" stores trajectories to reuse
    output : the file
    """

    dataset: xr.Dataset
    summary: Summary
    trajectories: int | None = None
    is_new: bool = True
    integrated: int | None = None
    repeated_blocks: int = 0
    extended_layout: str | None = None
    output: Path | None = None

    def as_dict(self) -> dict[str, Any]:
        """Points, counts by status, and the first failed points with the command that repeats each."""
        return {
            "output": str(self.output),
            "points": self.summary.points,
            "models": self.dataset.sizes["model"],
            "trajectories": self.trajectories,
            "status": counts_by_name(self.summary.counts),
            **(
                {"friction_status": counts_by_name(friction)} if (friction := self.summary.friction_counts) else {}
            ),
            "failed": self.summary.failed,
            "first_failed": self.records(),
            "layout": self.dataset.encoding.get("layout"),
            "seal": self.dataset.encoding.get("seal"),
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The first failed points of models, else of pairs."""
        command = command_start(str(self.output), self.dataset)
        records = []
        for name, status, place, index in self.summary.first_failed:
            at = inputs_at(self.dataset[name], (*place, *index))
            replay = replay_command(command, at) if command else None
            records.append({"status": status.name.lower(), "at": at, "replay": replay})
        return records

    def sections(self, width: int) -> Iterator[Block]:
        """The largest errors, the counts, the first failed points and what is implausible."""
        summary = self.summary
        if summary.worst:
            yield error_table(summary.worst)
        distinct = "" if self.trajectories is None else f" from {self.trajectories:,} trajectories"
        yield Wrapped(f"{self.output}: {summary.points:,} points{distinct} ({counts_text(summary.counts)})")
        if summary.friction_counts:
            yield Wrapped(f"with each friction law: {counts_text(summary.friction_counts)}")
        failures = self.records()
        for failure in failures:
            inputs = ", ".join(f"{name}={label(value)}" for name, value in failure["at"].items())
            yield Wrapped(f"failed: {inputs}: {FrictionStatus[failure['status'].upper()].meaning}")
            if failure["replay"]:
                yield f"  {failure['replay']}"
        more = summary.failed - len(failures)
        if more > 0:
            yield f"and {more:,} more"
        yield from (f"note: {note}" for note in result_notes(summary))

    @property
    def failed_line(self) -> str:
        """The number of failed points by status."""
        counts, failed = self.summary.counts, self.summary.failed
        failures = {
            s: count for s, count in counts.items() if s >= FIRST_FAILURE
        } or self.summary.friction_failures
        return f"{self.output}: {failed:,} of {self.summary.points:,} points failed ({counts_text(failures)})"


def error_table(worst: Mapping[str, Mapping[str, float]]) -> Table:
    """Tabulate the largest errors by variable and model."""
    names = [name for name in ERROR_HEADINGS if name in worst]
    models = dict.fromkeys(model for name in names for model in worst[name])
    rows = [[model, *(number(worst[name].get(model, float("nan")), 3) for name in names)] for model in models]
    return Table(rows, ("model", *(ERROR_HEADINGS[name] for name in names)))
