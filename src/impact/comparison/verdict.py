"""The outcome of a comparison: whether two results are equal, what differs and where, in several formats."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import xarray as xr

from ..config.input_names import with_words
from ..contact.units import names_in
from ..contact.variables import OUTPUTS
from ..display import Block, Displayed, Table, Wrapped
from ..formatting import number, prefixed, safe_text
from ..results.provenance import describe_point, replay_command
from ..results.schema import SCHEMA

# in the order of a verdict: kinds that explain others first
DifferenceKind = Literal["nothing in common", "physics config", "labels", "units", "missing variable", "values"]
DIFFERENCE_KINDS: tuple[DifferenceKind, ...] = get_args(DifferenceKind)
VERDICT_HEADINGS = ("variable", "judged", "tolerance", "differ", "worst", "x tolerance")
MAX_NAMES = 4  # names per kind in the first line
# a narrower terminal shows no table
MIN_TABLE_WIDTH = 76
PROGRAM = "impact compare"
# what a test of JUnit claims: that there is no difference of a kind
CLAIMS: Mapping[str, str] = {
    "nothing in common": "both have a variable in common",
    "physics config": "both have the same inputs",
    "labels": "both have the same points",
    "units": "both have the same units",
    "missing variable": "both have the same variables",
}
# differences that an annotation lists
MAX_ANNOTATED = 3


@dataclass(frozen=True)
class Difference:
    """One difference between two results, other than a value: its kind, name and a sentence."""

    kind: DifferenceKind
    name: str
    text: str


@dataclass(frozen=True)
class VariableComparison:
    """One variable, compared at all common points.

    Parameters
    ----------
    judged : how it is compared, see `impact.contact.variables.Variable`
    tolerance : relative to the scale of a point; NaN if there is none (exact, reported)
    worst : |new - baseline| at the worst point, in the variable's unit
    ratio : the same over the tolerance at that point; inf if no difference is allowed, or one value is NaN
    at : the inputs of the worst point by config name, and its model; empty if all points are equal
    new, baseline : the values at the worst point
    """

    name: str
    judged: str
    tolerance: float
    points: int
    different: int
    worst: float
    ratio: float
    at: Mapping[str, float | str]
    new: float
    baseline: float

    @property
    def times(self) -> float:
        """The ratio, by its name in version 1.0."""
        return self.ratio

    @property
    def is_equal(self) -> bool:
        """Whether all values agree within the tolerance, or are not judged."""
        return self.different == 0 or self.judged == "reported"

    @property
    def location(self) -> str:
        """The coordinates of the worst point."""
        return describe_point(self.at)

    @property
    def text(self) -> str:
        """The number of points that differ, and the worst point with its coordinates."""
        if not self.different:
            return f"{self.name}: none of {self.points} differ"
        many = f"{self.name}: {self.different} of {self.points} differ"
        at = f" at {self.location}" if self.location else ""
        if self.judged == "exact" or self.worst != self.worst:
            words = (_format_outcome(self.name, value) for value in (self.new, self.baseline))
            both = self.new != self.new and self.baseline != self.baseline
            which = "first" if self.judged == "exact" else "worst"
            text = f"{many}, the {which}{at}: {', baseline '.join(words)}"
            return f"{text}, which their statuses do not explain" if both else text
        if self.judged == "reported":
            return f"{many}, by {self.worst_text(6)} at most{at} (not judged)"
        ratio = f"{number(self.ratio, 3)} x tolerance" if self.ratio < float("inf") else "where none is allowed"
        return f"{many}, worst {self.worst_text(3)} = {ratio}{at}"

    def worst_text(self, digits: int) -> str:
        """Write the largest difference with its unit."""
        unit = OUTPUTS[self.name].unit if self.name in OUTPUTS else "1"
        # an exponent n has a value for each law
        return prefixed(self.worst, "1" if names_in(unit) else unit, digits)


def _flag_name(name: str, value: float) -> str:
    """Name the value of a status or of another variable with named values, else ""."""
    flags = next((variables[name].flags for variables in SCHEMA.values() if name in variables), {})
    return next((word for word, flag in flags.items() if flag == value), "")


def _format_outcome(name: str, value: float) -> str:
    """Write a value that has no size: a status by its name."""
    return _flag_name(name, value) or ("NaN" if value != value else number(value, 10))


@dataclass(frozen=True)
class Verdict(Displayed):
    """Whether a result is equal to its baseline, and the differences.

    `str(verdict)` is the report, so that `assert verdict.equal, str(verdict)` is a test.

    Parameters
    ----------
    new, baseline : names of the files
    faults : differences other than values, by their kinds, those that explain others first
    variables : the comparisons of the common variables
    notes : differences that do not affect equality
    repeats : the first words of a command that runs one of the points again; empty if there is none
    worst_along : by axis, the largest |new - baseline| over tolerance at each of its points, for every compared
        variable that has the axis, with the labels of the baseline; neighbours on a very long axis are grouped
        under the label of the first

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml")
    >>> moved = result.assign(e_out=result["e_out"] + 2e-9)
    >>> verdict = impact.compare(moved, result)
    >>> verdict.equal, [variable.name for variable in verdict.differing]
    (False, ['e_out'])
    """

    new: str
    baseline: str
    faults: tuple[Difference, ...]
    variables: tuple[VariableComparison, ...]
    notes: tuple[str, ...] = ()
    repeats: tuple[str, ...] = ()
    worst_along: Mapping[str, xr.Dataset] = field(default_factory=dict, repr=False, compare=False)

    @property
    def equal(self) -> bool:
        """Whether nothing differs."""
        return not self.faults and not self.differing

    @property
    def differing(self) -> tuple[VariableComparison, ...]:
        """The variables whose values differ, the worst first."""
        # among equal ratios the status comes first, since it explains the NaNs of other variables
        different = (variable for variable in self.variables if not variable.is_equal)
        return tuple(sorted(different, key=lambda variable: (-variable.ratio, variable.judged != "exact")))

    @property
    def ranked(self) -> tuple[VariableComparison, ...]:
        """All variables: those whose values differ, the worst first, then the others."""
        return (*self.differing, *(variable for variable in self.variables if variable.is_equal))

    @property
    def headline(self) -> str:
        """The first line: the closest variable if equal, else the names of what differs."""
        if self.equal:
            judged = [variable for variable in self.variables if variable.judged != "reported"]
            values = sum(variable.points for variable in judged)
            count = f"equal: {len(judged)} variables, {values:,} values"
            closest = max(judged, key=lambda variable: variable.ratio, default=None)
            if closest is None or not closest.ratio:
                return f"{count}, none differs"
            at = f" at {closest.location}" if closest.location else ""
            return f"{count}, largest difference {number(closest.ratio, 2)} x tolerance: {closest.name}{at}"
        named = [(str(fault.kind), fault.name) for fault in self.faults]
        named += [("values", variable.name) for variable in self.differing]
        parts = []
        for kind in (kind for kind in DIFFERENCE_KINDS if kind in dict(named)):
            names = [*dict.fromkeys(safe_text(name, 60) for of, name in named if of == kind and name)]
            more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
            parts.append(f"{kind} ({', '.join(names[:MAX_NAMES])}{more})" if names else kind)
        return f"not equal: {', '.join(parts)}"

    @property
    def lines(self) -> tuple[str, ...]:
        """The differences, a line each; after a variable the command that runs its worst point again."""
        lines = [f"{fault.kind}: {fault.text}" for fault in self.faults]
        for variable in self.differing:
            command = f"  {self.replay(variable)}"
            # several variables are often worst at one point
            lines += [variable.text, command] if command.strip() and command not in lines else [variable.text]
        return tuple(lines)

    def rows(self) -> list[tuple[str, ...]]:
        """Write a row of text for each variable that changed, the worst first, under VERDICT_HEADINGS."""
        return [
            (
                variable.name,
                variable.judged,
                number(variable.tolerance, 3),
                f"{variable.different} of {variable.points}",
                variable.worst_text(3),
                number(variable.ratio if variable.tolerance == variable.tolerance else math.nan, 3),
            )
            for variable in self.ranked
            if variable.ratio
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return the verdict as plain data."""
        return {
            "equal": self.equal,
            "headline": self.headline,
            "new": safe_text(self.new),
            "baseline": safe_text(self.baseline),
            "faults": [{"kind": fault.kind, "text": fault.text} for fault in self.faults],
            "variables": [
                {
                    **{"times" if name == "ratio" else name: value for name, value in vars(variable).items()},
                    "at": {
                        safe_text(name): safe_text(value, 2000) if isinstance(value, str) else value
                        for name, value in with_words(variable.at).items()
                    },
                    "equal": variable.is_equal,
                    "text": variable.text,
                    "replay": "" if variable.is_equal else self.replay(variable),
                }
                for variable in self.ranked
            ],
            "notes": list(self.notes),
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List the compared variables, those that differ first."""
        return [vars(variable) for variable in self.ranked]

    def sections(self, width: int) -> Iterator[Block]:
        """The headline, the differences with the commands that repeat them, and a table of changed variables."""
        yield from str(self).split("\n")
        rows = self.rows()
        if rows and width >= MIN_TABLE_WIDTH:
            yield ""
            yield Table(rows, VERDICT_HEADINGS, text=(0, 1))
        same = [
            variable.name for variable in self.variables if not variable.ratio and variable.judged != "reported"
        ]
        if rows and same:
            yield Wrapped(f"unchanged: {', '.join(same)}")

    def replay(self, variable: VariableComparison) -> str:
        """Write the command that runs the worst point of a variable again; empty if there is none."""
        return replay_command(self.repeats, variable.at) if self.repeats and variable.at else ""

    def __str__(self) -> str:
        return "\n".join([self.headline, *self.lines, *(f"note: {note}" for note in self.notes)])


@dataclass(frozen=True)
class NoVerdict(Verdict):
    """The error that prevented a comparison, in place of its verdict."""

    faults: tuple[Difference, ...] = ()
    variables: tuple[VariableComparison, ...] = ()
    error: str = ""

    @property
    def equal(self) -> bool:
        """False: nothing was compared."""
        return False

    @property
    def headline(self) -> str:
        """The error in one line."""
        return "; ".join(self.error.splitlines())

    def as_dict(self) -> dict[str, Any]:
        """Return plain data with the fields of a verdict; `equal` is null."""
        return super().as_dict() | {"equal": None}


def as_junit(outcome: Verdict) -> str:
    """Write JUnit XML: a suite with a test for each kind of difference and variable, named by what it claims."""
    # no other format needs it
    from xml.etree import ElementTree

    tests = {
        claim: [fault.text for fault in outcome.faults if fault.kind == kind] for kind, claim in CLAIMS.items()
    }
    for variable in outcome.ranked:
        lines = [] if variable.is_equal else [variable.text, outcome.replay(variable)]
        tests[f"{variable.name} is equal within its tolerance"] = [line for line in lines if line]
    is_error = isinstance(outcome, NoVerdict)
    if is_error:
        tests = {"both are readable": []}
    failures, errors = sum(map(bool, tests.values())), int(is_error)
    counts = {"tests": f"{len(tests)}", "failures": f"{failures}", "errors": f"{errors}", "skipped": "0"}
    root = ElementTree.Element("testsuites", counts)
    title = f"{PROGRAM} {safe_text(outcome.new)} {safe_text(outcome.baseline)}"
    suite = ElementTree.SubElement(root, "testsuite", {"name": title, **counts})
    for claim, lines in tests.items():
        test = ElementTree.SubElement(suite, "testcase", {"classname": "impact.compare", "name": claim})
        if is_error:
            ElementTree.SubElement(test, "error", {"message": outcome.headline})
        elif lines:
            ElementTree.SubElement(test, "failure", {"message": lines[0]}).text = "\n".join(lines)
    output = ElementTree.SubElement(suite, "system-out")
    output.text = "\n".join([outcome.headline, *(f"note: {note}" for note in outcome.notes)])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def as_markdown(outcome: Verdict) -> str:
    """Write Markdown for a pull request or a job summary."""
    sign = "⚠️" if isinstance(outcome, NoVerdict) else "✅" if outcome.equal else "❌"
    # the letters that end a code span or a cell have no escapes
    code = str.maketrans("`|", "'¦")
    new, baseline = (safe_text(name).translate(code) for name in (outcome.new, outcome.baseline))
    lines = [f"### {sign} {PROGRAM}: {_escape_markdown(outcome.headline)}", ""]
    lines += [f"`{new}` against the baseline `{baseline}`", ""]
    if outcome.faults:
        lines += [*(f"- {_escape_markdown(fault.text)}" for fault in outcome.faults), ""]
    if outcome.differing:
        lines.append("| variable | differ | worst | × tolerance | at | new | baseline |")
        lines.append("|---|--:|--:|--:|---|--:|--:|")
        for variable in outcome.differing:
            numbers = f"{number(variable.worst, 3)} | {number(variable.ratio, 3)}"
            both = (variable.new, variable.baseline)
            values = " | ".join(_flag_name(variable.name, value) or number(value, 12) for value in both)
            counts, point = f"{variable.different} of {variable.points}", _escape_markdown(variable.location)
            lines.append(f"| `{variable.name}` | {counts} | {numbers} | {point} | {values} |")
        commands = dict.fromkeys(filter(None, map(outcome.replay, outcome.differing)))
        # a fence of four backticks, since a name may contain three
        lines += ["", "````sh", *commands, "````", ""] if commands else [""]
    lines += [f"- note: {_escape_markdown(note)}" for note in outcome.notes]
    return "\n".join(lines).rstrip() + "\n"


def as_github(outcome: Verdict) -> str:
    """Write a workflow command of GitHub Actions: an annotation on the baseline, with the worst differences."""
    failures = [(fault.text, "") for fault in outcome.faults]
    failures += [(variable.text, outcome.replay(variable)) for variable in outcome.differing]
    lines = [outcome.headline]
    for text, command in failures[:MAX_ANNOTATED]:
        lines += [text, command] if command and command not in lines else [text]
    lines += [f"and {len(failures) - MAX_ANNOTATED} more"] if len(failures) > MAX_ANNOTATED else []
    lines += [f"note: {note}" for note in outcome.notes]
    level = "notice" if outcome.equal else "error"
    file = _escape_command(safe_text(outcome.baseline), ":,")
    text = _escape_command("\n".join(lines))
    return f"::{level} file={file},title={PROGRAM}::{text}"


def _escape_command(text: str, letters: str = "") -> str:
    """Escape what ends a workflow command, and more letters in its properties."""
    return re.sub(rf"[%\r\n{letters}]", lambda match: f"%{ord(match[0]):02X}", text)


def _escape_markdown(text: str) -> str:
    """Escape text so that Markdown shows it literally."""
    return re.sub(r"([\\`*_{}\[\]<>|~#!&$@])", r"\\\1", text)
