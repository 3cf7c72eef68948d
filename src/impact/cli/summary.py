"""The end of a command that writes a result: its summary on stderr, its JSON, and its exit code."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import typer

from ..display import dump, show
from . import exits

if TYPE_CHECKING:
    from ..results.outcome import SweepOutcome


def print_summary_and_exit(outcome: SweepOutcome, *, quiet: bool, as_json: bool, allow_failed: bool) -> None:
    """Print the summary of a result as the options ask for it, and exit with 3 if points failed."""
    if not quiet:
        if outcome.is_new:
            with exits.ignore_broken_pipe(sys.stderr):
                show(outcome, stream=sys.stderr)
        else:
            exits.print_line(f"{outcome.output}: already contains this sweep; nothing to do")
    if as_json:
        print(dump(outcome))
    if outcome.summary.failed and not allow_failed:
        if quiet or not outcome.is_new:
            exits.print_line(outcome.failed_line, error=True)
        raise typer.Exit(exits.EXIT_POINTS_FAILED)
