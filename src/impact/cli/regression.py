"""The commands that guard stored datasets: compare, bless, rerun."""

from __future__ import annotations

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import ImpactError, UsageError
from ..text import safe_text
from . import door
from .options import MaxPoints, Plugins, Quiet
from .words import dump, tolerances

if TYPE_CHECKING:
    from ..comparison.verdict import Verdict
    from ..views.report import Report


# a narrower terminal shows the sentences only
NARROWEST = 76


class Format(StrEnum):
    """How a verdict is told."""

    table = "table"
    json = "json"
    junit = "junit"
    markdown = "markdown"
    github = "github"


New = Annotated[Path, typer.Argument(help="The result to judge.")]
Baseline = Annotated[Path, typer.Argument(help="The result that it is judged by.")]
Tol = Annotated[
    list[str] | None,
    typer.Option(
        "--tol", metavar="[NAME=]VALUE",
        help="Tolerance relative to the scale of a point, for all variables or for one; may be repeated. "
        "\\[default: the baseline's, else 10 times its solver's rtol]",
    ),
]  # fmt: skip
Subset = Annotated[
    bool, typer.Option("--subset", help="Judge what both have, and do not mind what only one of them has.")
]
Formats = Annotated[Format, typer.Option("--format", help="How to tell the verdict, on stdout.")]
Plot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Draw where the differences lie: .png, .svg or .pdf."),
]


def compare(
    new: New,
    baseline: Baseline,
    tol: Tol = None,
    subset: Subset = False,
    format: Formats = Format.table,
    plot: Plot = None,
) -> None:
    """Judge a result by a stored one: exit 0 if equal, 1 if not (the first line says in what), 2 if unreadable."""
    from .. import api
    from ..views import report

    _check_plot(plot, new, baseline)
    try:
        verdict = api.compare(new, baseline, tol=tolerances(tol), subset=subset)
    except ImpactError as error:
        _print(report.report_of_error(str(new), str(baseline), str(error)), format)
        raise
    _tell(verdict, format, plot)


def bless(
    new: New,
    baseline: Annotated[Path, typer.Argument(help="The baseline to replace, or to make.")],
    reason: Annotated[str, typer.Option("--reason", help="Why the numbers changed; kept in the baseline.")],
    tol: Tol = None,
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
            new, baseline, reason=reason, tol=tolerances(tol), allow_failed=allow_failed, show=show
        )
    except (BrokenPipeError, SystemExit):
        raise UsageError(f"{safe_text(str(baseline))}: not replaced, nobody read the verdict to its end") from None
    word = "made" if verdict is None else "replaced"
    door.say(f"{safe_text(str(baseline))}: {word}, with the reason")


def rerun(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep`.")],
    plugins: Plugins = None,
    tol: Tol = None,
    subset: Subset = False,
    max_points: MaxPoints = 10**9,
    format: Formats = Format.table,
    plot: Plot = None,
    quiet: Quiet = False,
) -> None:
    """Repeat the sweep of a result from the file alone, and judge what comes out by what is in it."""
    with door.signals() as stopping:
        from .. import api
        from ..views import report
        from . import summary

        _check_plot(plot, result)
        try:
            verdict = api.rerun(
                result, plugins=plugins or (), tol=tolerances(tol), subset=subset, max_points=max_points,
                execute=lambda plan: summary.execute(plan, stopping, quiet=quiet),
            )  # fmt: skip
        except ImpactError as error:
            _print(report.report_of_error("the rerun", str(result), str(error)), format)
            raise
    _tell(verdict, format, plot)


def _check_plot(plot: Path | None, *sources: Path) -> None:
    """Refuse a picture that cannot be stored before any work is done."""
    if plot is not None:
        from ..results.backend import check_output
        from ..views.look import check_picture

        check_picture(plot)
        for source in sources:
            check_output(plot, overwrite=True, source=source)


def _tell(verdict: Verdict, format: Format, plot: Path | None) -> None:
    """Print a verdict, draw it, and leave by its exit code."""
    from ..views import report

    with door.readers_may_leave():
        if format is Format.table:
            print_verdict(verdict)
        else:
            _print(report.report_of(verdict), format)
    if plot is not None and not verdict.worst_along:
        # the verdict stands without a picture
        door.say("no picture: there is no point to draw at")
    elif plot is not None:
        from ..views import differences, look

        look.save_figure(differences.draw_differences(differences.differences(verdict)), plot)
        door.say(f"{safe_text(str(plot))}: {'drawn' if verdict.equal else 'where the differences lie'}")
    if not verdict.equal:
        raise typer.Exit(door.NOT_EQUAL)


def _print(told: Report, format: Format) -> None:
    """A report on stdout; as a table there is none without a verdict, the error says it all."""
    from ..views import report

    match format:
        case Format.json:
            print(dump(report.as_data(told)))
        case Format.junit:
            print(report.as_junit(told))
        case Format.markdown:
            print(report.as_markdown(told), end="")
        case Format.github:
            print(report.as_github(told))


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
            tolerance = f"{one.tolerance:.3g}" if one.tolerance == one.tolerance else "–"
            times = f"{one.times:.3g}" if one.tolerance == one.tolerance else "–"
            many = f"{one.different} of {one.points}"
            rows.add_row(cell(one.name), cell(one.judged), tolerance, many, f"{one.worst:.3g}", times)
        out.print()
        out.print(rows)
