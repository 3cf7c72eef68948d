"""The commands that compare stored results: compare, bless, rerun."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import impact

from ..atomic import check_outputs
from ..display import dump, show
from ..errors import ImpactError, UsageError
from . import exits, options
from .execution import execution, run_in_memory

if TYPE_CHECKING:
    from ..comparison.verdict import Verdict


# the formats of a verdict on stdout
Format = Literal["table", "json", "junit", "markdown", "github"]
NewArgument = Annotated[Path, typer.Argument(help="The new result.")]
SubsetOption = Annotated[
    bool, typer.Option("--subset", help="Compare only the variables and points that both results have.")
]
FormatOption = Annotated[Format, typer.Option("--format", help="Format of the verdict on stdout.")]
PlotOption = Annotated[Path | None, options.value("FILE", "Draw where the results differ: .png, .svg or .pdf.")]


def compare(
    new: NewArgument,
    baseline: Annotated[Path, typer.Argument(help="The result to compare with.")],
    tol: options.Tolerance = None,
    subset: SubsetOption = False,
    format: FormatOption = "table",
    plot: PlotOption = None,
) -> None:
    """Compare a result with a baseline: exit 0 if equal, 1 if not (the first line says why), 2 on an error."""
    arguments = locals()
    _report_verdict(lambda: options.call(impact.compare, arguments), str(new), str(baseline), format, plot)


def bless(
    new: NewArgument,
    baseline: Annotated[Path, typer.Argument(help="The baseline to replace or create.")],
    reason: Annotated[str, typer.Option("--reason", help="Why the numbers changed; stored in the baseline.")],
    tol: options.Tolerance = None,
    allow_failed: Annotated[
        bool, typer.Option("--allow-failed", help="Accept a result with failed points.")
    ] = False,
) -> None:
    """Show how a result differs from its baseline, then replace the baseline by it."""

    def show_verdict(verdict: Verdict) -> None:
        show(verdict)
        sys.stdout.flush()

    from ..comparison.bless import bless as replace_baseline

    try:
        verdict = options.call(replace_baseline, locals(), show=show_verdict)
    except (BrokenPipeError, SystemExit):
        raise UsageError(
            f"{baseline}: not replaced, the output was closed before the end of the verdict"
        ) from None
    word = "made" if verdict is None else "replaced"
    exits.print_line(f"{baseline}: {word}, with the reason")


def rerun(
    result: Annotated[Path, typer.Argument(help="A result of `impact sweep` or `impact calibrate`.")],
    plugins: options.Plugins = None,
    tol: options.Tolerance = None,
    subset: SubsetOption = False,
    max_points: options.MaxPoints = 10**9,
    format: FormatOption = "table",
    plot: PlotOption = None,
    quiet: options.Quiet = False,
) -> None:
    """Repeat a sweep or a calibration from its result alone, and compare the new values with the stored ones."""
    arguments = locals()

    def repeat_sweep() -> Verdict:
        from ..comparison.rerun import rerun as repeat

        with execution(quiet) as keywords:
            return options.call(repeat, arguments, execute=partial(run_in_memory, **keywords))

    _report_verdict(repeat_sweep, "the rerun", str(result), format, plot)


def _report_verdict(
    judge: Callable[[], Verdict], new: str, baseline: str, format: Format, plot: Path | None
) -> None:
    """Print a verdict, or the error that prevented it, draw the verdict, and exit with its code."""
    from ..comparison.verdict import NoVerdict

    if plot is not None:
        from ..plots.style import check_picture

        check_picture(plot)
        check_outputs([plot], [new, baseline], overwrite=True)
    try:
        verdict = judge()
    except ImpactError as error:
        _print_outcome(NoVerdict(new, baseline, error=str(error)), format)
        raise
    with exits.ignore_broken_pipe():
        _print_outcome(verdict, format)
    if plot is not None and not verdict.worst_along:
        # a missing picture does not change the verdict
        exits.print_line("nothing to draw: no variable was compared along an axis")
    elif plot is not None:
        from ..plots import differences, style

        style.save_figure(differences.draw_differences(differences.difference_data(verdict)), plot)
        exits.print_line(f"{plot}: {'drawn' if verdict.equal else 'where the differences lie'}")
    if not verdict.equal:
        raise typer.Exit(exits.EXIT_NOT_EQUAL)


def _print_outcome(outcome: Verdict, format: Format) -> None:
    """Print a verdict or an error on stdout; an error has no table, its message is on stderr."""
    from ..comparison import verdict

    if format != "table":
        exits.write_utf8()
    match format:
        case "table" if not isinstance(outcome, verdict.NoVerdict):
            show(outcome)
        case "json":
            print(dump(outcome.as_dict()))
        case "junit":
            print(verdict.as_junit(outcome))
        case "markdown":
            print(verdict.as_markdown(outcome), end="")
        case "github":
            print(verdict.as_github(outcome))
