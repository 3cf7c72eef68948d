"""The progress of a sweep: a bar on a terminal and in a notebook, else a line on stderr every ten seconds."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress as Bar, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

if TYPE_CHECKING:
    from .engine.run import Progress

# seconds after which something is printed, between two lines where there is no terminal, and from the beginning of
# a phase until the remaining time can be estimated
FIRST_S, INTERVAL_S, SETTLING_S = 1.0, 10.0, 5.0
# seconds over which the rate is taken: a block may take minutes
RATE_PERIOD_S = 3600.0


class RemainingColumn(TimeRemainingColumn):
    """The time left, once it is known."""

    def render(self, task: Task) -> Text:
        return super().render(task) if remaining(task) is not None else Text()


def remaining(task: Task) -> float | None:
    """Seconds that the rest of a phase takes; None as long as its rate is not known well enough."""
    is_settled = task.elapsed is not None and task.elapsed >= SETTLING_S
    return task.time_remaining if is_settled else None


def update(bar: Bar, at: Progress) -> Task:
    """Update a bar to the progress of a sweep, whose tasks are the trajectories and then the points."""
    integrating = at.trajectories < at.of_trajectories or not at.points
    phase = "trajectories" if integrating else "points"
    done, total = (at.trajectories, at.of_trajectories) if integrating else (at.points, at.of_points)
    if not bar.tasks or bar.tasks[-1].description != phase:
        for task in bar.tasks:
            bar.update(task.id, visible=False)
        bar.add_task(phase, total=total, failed="")
    task = bar.tasks[-1]
    bar.update(task.id, completed=done, failed=f"{at.failed:,} failed" if at.failed else "")
    return task


def line(task: Task, points: int) -> str:
    """A phase in words: how much is done, the rate, the time left, and what failed.

    Parameters
    ----------
    task : of a bar, see `update`
    points : of the whole sweep
    """
    text = f"{task.description} {task.completed:,.0f} of {task.total:,.0f}"
    if task.description == "trajectories":
        text += f" for {points:,} points"
    seconds = remaining(task)
    if seconds is not None:
        text += f", {task.speed:,.0f}/s, {timedelta(seconds=round(seconds))} left"
    return text + (f", {task.fields['failed']}" if task.fields["failed"] else "")


def new_bar(get_time: Callable[[], float] | None = None) -> Bar:
    """A bar on stderr or in a notebook, not yet shown; `get_time` is the clock, in seconds."""
    console = Console(file=sys.stderr, markup=False, highlight=False, emoji=False)
    # in a notebook rich shows a bar with ipywidgets
    is_shown = sys.stderr.isatty() or (console.is_jupyter and find_spec("ipywidgets") is not None)
    return Bar(
        TextColumn("{task.description} {task.completed:,.0f} of {task.total:,.0f}"),
        BarColumn(),
        RemainingColumn(),
        TextColumn("{task.fields[failed]}"),
        console=console,
        transient=True,
        get_time=get_time,
        speed_estimate_period=RATE_PERIOD_S,
        disable=not is_shown,
    )


@contextmanager
def progress_bar(
    write: Callable[[str], None] | None = None, *, quiet: bool = False
) -> Iterator[Callable[[Progress], None]]:
    """A function that reports the progress of a sweep, to be passed as `on_progress`.

    Parameters
    ----------
    write : prints a line where there is no bar; by default to stderr
    quiet : report nothing

    Returns
    -------
    context manager : of the function, which takes a `Progress`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder, impact.progress_bar() as on_progress:
    ...     outcome = impact.sweep_to_file("configs/figure6.toml", f"{folder}/r.h5", on_progress=on_progress)
    """
    if quiet:
        yield lambda at: None
        return
    bar = new_bar()
    begun = bar.get_time()
    last = begun + FIRST_S - INTERVAL_S
    show = write or partial(print, file=sys.stderr, flush=True)

    def report(at: Progress) -> None:
        nonlocal last
        now = bar.get_time()
        task = update(bar, at)
        if not bar.disable:
            if not bar.live.is_started and now - begun > FIRST_S:
                bar.start()
        elif now - last >= INTERVAL_S and not task.finished:
            last = now
            show(line(task, at.of_points))

    try:
        yield report
    finally:
        bar.stop()
