"""What a sweep tells on stderr while it runs: a bar on a terminal, else a line now and then."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.progress import BarColumn, TextColumn
from rich.progress import Progress as Bar

from .console import console
from .door import say

if TYPE_CHECKING:
    from ..engine.progress import Progress

# seconds after which something is told, and between two lines where there is no terminal
PATIENCE, PAUSE = 1.0, 10.0


@dataclass
class Pace:
    """How fast a phase goes; a phase that is resumed has done some of its work before."""

    phase: str = ""
    begun: float = 0.0
    before: int = 0

    def told(self, at: Progress, now: float) -> tuple[int, int, str]:
        """Done, of all, and a line that says so with the rate, the time left and what failed."""
        integrating = at.trajectories < at.of_trajectories or not at.points
        phase = "trajectories" if integrating else "points"
        done, total = (at.trajectories, at.of_trajectories) if integrating else (at.points, at.of_points)
        if phase != self.phase:
            self.phase, self.begun, self.before = phase, now, done if integrating else 0
        line = f"{phase} {done:,} of {total:,}" + (f" for {at.of_points:,} points" if integrating else "")
        passed = now - self.begun
        if passed > 0.0 and done > self.before:
            rate = (done - self.before) / passed
            line += f", {rate:,.0f}/s, {clock((total - done) / rate)} left"
        return done, total, line + (f", {at.failed:,} failed" if at.failed else "")


def clock(seconds: float) -> str:
    """A time as one reads it.

    >>> clock(7), clock(754), clock(7500)
    ('0:07', '12:34', '2:05:00')
    """
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


@contextmanager
def progress(*, quiet: bool) -> Iterator[Callable[[Progress], None]]:
    """A function to tell how far a sweep is."""
    if quiet:
        yield lambda at: None
        return
    pace, begun = Pace(), time.monotonic()
    last = begun + PATIENCE - PAUSE

    def line(at: Progress) -> None:
        nonlocal last
        now = time.monotonic()
        _, _, text = pace.told(at, now)
        if now - last >= PAUSE:
            last = now
            say(text)

    if not sys.stderr.isatty():
        yield line
        return
    bar = Bar(BarColumn(), TextColumn("{task.description}"), console=console(sys.stderr), transient=True)
    task = bar.add_task("", total=None)

    def draw(at: Progress) -> None:
        now = time.monotonic()
        done, total, text = pace.told(at, now)
        if not bar.live.is_started and now - begun > PATIENCE:
            bar.start()
        bar.update(task, completed=done, total=total, description=text)

    try:
        yield draw
    finally:
        bar.stop()
