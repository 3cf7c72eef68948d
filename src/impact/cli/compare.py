"""The commands that guard stored datasets: compare, bless, rerun."""

from __future__ import annotations

import math
import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import ImpactError, UsageError
from ..formatting import number
from ..text import safe_text
from . import exits
from .console import dump
from .options import MaxPoints, Plugins, Quiet, Result, Tolerances

if TYPE_CHECKING:
    from ..comparison.formats import Report
    from ..comparison.verdict import Verdict


# a narrower terminal shows the sentences only
NARROWEST = 76


class Format(StrEnum):
    """The forms of a verdict on stdout."""

    table = "table"
    json = "json"
    junit = "junit"
    markdown = "markdown"
    github = "github"


New = Annotated[Path, typer.Argument(help="The result to judge.")]
Baseline = Annotated[Path, typer.Argument(help="The result that it is judged by.")]
Subset = Annotated[
    bool, typer.Option("--subset", help="Judge what both have, and do not mind what only one of them has.")
]
Formats = Annotated[Format, typer.Option("--format", help="Form of the verdict on stdout.")]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Draw where the differences lie: .png, .svg or .pdf."),
]


def compare(
    new: New,
    baseline: Baseline,
    tol: Tolerances = None,
    subset: Subset = False,
    format: Formats = Format.table,
    plot: Plot = None,
) -> None:
    """Judge a result by a stored one: exit 0 if equal, 1 if not (the first line says in what), 2 if unreadable."""
    from .. import api
    from ..comparison import formats

    _check_plot(plot, new, baseline)
    try:
        verdict = api.compare(new, baseline, tol=dict(tol or ()) or None, subset=subset)
    except ImpactError as error:
        _print(formats.report_of_error(str(new), str(baseline), str(error)), format)
        raise
    _tell(verdict, format, plot)


def bless(
    new: New,
    baseline: Annotated[Path, typer.Argument(help="The baseline to replace, or to make.")],
    reason: Annotated[str, typer.Option("--reason", help="Why the numbers changed; kept in the baseline.")],
    tol: Tolerances = None,
    allow_failed: Annotated[
        bool, typer.Option("--allow-failed", help="Accept a result with failed points.")
    ] = False,
) -> None:
    """Show how a result differs from its baseline, then let it take the baseline's place."""
    from .. import api

    def show(verdict: Verdict) -> None:
        print_verdict(verdict)
        sys.stdout.flush()

    try:
        verdict = api.bless(
            new, baseline, reason=reason, tol=dict(tol or ()) or None, allow_failed=allow_failed, show=show
        )
    except (BrokenPipeError, SystemExit):
        raise UsageError(f"{safe_text(str(baseline))}: not replaced, nobody read the verdict to its end") from None
    word = "made" if verdict is None else "replaced"
    exits.say(f"{safe_text(str(baseline))}: {word}, with the reason")


def rerun(
    result: Result,
    plugins: Plugins = None,
    tol: Tolerances = None,
    subset: Subset = False,
    max_points: MaxPoints = 10**9,
    format: Formats = Format.table,
    plot: Plot = None,
    quiet: Quiet = False,
) -> None:
    """Repeat the sweep of a result from the file alone, and judge what comes out by what is in it."""
    with exits.signals() as should_stop:
        from .. import api
        from ..comparison import formats
        from . import summary

        _check_plot(plot, result)
        try:
            verdict = api.rerun(
                result, plugins=plugins or (), tol=dict(tol or ()) or None, subset=subset, max_points=max_points,
                execute=lambda plan: summary.execute(plan, should_stop, quiet=quiet),
            )  # fmt: skip
        except ImpactError as error:
            _print(formats.report_of_error("the rerun", str(result), str(error)), format)
            raise
    _tell(verdict, format, plot)


def _check_plot(plot: Path | None, *sources: Path) -> None:
    """Refuse a picture that cannot be stored before any work is done."""
    if plot is not None:
        from ..plots.style import check_picture
        from ..results.backend import check_output

        check_picture(plot)
        for source in sources:
            check_output(plot, overwrite=True, source=source)


def _tell(verdict: Verdict, format: Format, plot: Path | None) -> None:
    """Print a verdict, draw it, and leave by its exit code."""
    from ..comparison import formats

    with exits.readers_may_leave():
        if format is Format.table:
            print_verdict(verdict)
        else:
            _print(formats.report_of(verdict), format)
    if plot is not None and not verdict.worst_along:
        # the verdict stands without a picture
        exits.say("no picture: there is no point to draw at")
    elif plot is not None:
        from ..plots import differences, style

        style.save_figure(differences.draw_differences(differences.difference_data(verdict)), plot)
        exits.say(f"{safe_text(str(plot))}: {'drawn' if verdict.equal else 'where the differences lie'}")
    if not verdict.equal:
        raise typer.Exit(exits.NOT_EQUAL)


def _print(printed: Report, format: Format) -> None:
    """A report on stdout; as a table there is none without a verdict, the error says it all."""
    from ..comparison import formats

    match format:
        case Format.json:
            print(dump(formats.as_data(printed)))
        case Format.junit:
            print(formats.as_junit(printed))
        case Format.markdown:
            print(formats.as_markdown(printed), end="")
        case Format.github:
            print(formats.as_github(printed))


def print_verdict(verdict: Verdict) -> None:
    """The first line, what differs with the command that repeats it, and each variable that is not bit for bit."""
    from .console import cell, console, table

    out = console(sys.stdout)
    for line in (verdict.headline, *verdict.lines, *(f"note: {note}" for note in verdict.notes)):
        # as one line, however long: a command is to be copied
        out.print(line, soft_wrap=True)
    moved = [one for one in verdict.ranked if one.times]
    if moved and out.width >= NARROWEST:
        rows = table("variable", "judged", "tolerance", "differ", "worst", "x tolerance")
        rows.columns[1].justify = "left"
        for one in moved:
            tolerance = number(one.tolerance, 3)
            times = number(one.times if one.tolerance == one.tolerance else math.nan, 3)
            many = f"{one.different} of {one.points}"
            rows.add_row(cell(one.name), cell(one.judged), tolerance, many, number(one.worst, 3), times)
        out.print()
        out.print(rows)
