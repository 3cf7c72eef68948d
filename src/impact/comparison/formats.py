"""A verdict as JSON, JUnit XML, Markdown or GitHub annotations."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from ..formatting import number
from ..text import safe_text
from .verdict import DIFFERENCE_KINDS, VariableComparison, Verdict

PROGRAM = "impact compare"
# what a test of JUnit claims: that there is no fault of a kind
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
class ReportCase:
    """One test of a report: a variable or a kind of fault; `texts` describe its failures."""

    name: str
    texts: tuple[str, ...] = ()
    replay: str = ""


@dataclass(frozen=True)
class Report:
    """The data of all formats: a verdict, or the error that prevented one (`equal` is None)."""

    new: str
    baseline: str
    equal: bool | None
    headline: str
    cases: tuple[ReportCase, ...] = ()
    notes: tuple[str, ...] = ()
    variables: tuple[VariableComparison, ...] = ()


def report_of(verdict: Verdict) -> Report:
    """The report of a verdict: a case for each kind of fault, and for each variable, the worst first."""
    faults = (
        ReportCase(kind, tuple(fault.text for fault in verdict.faults if fault.kind == kind))
        for kind in DIFFERENCE_KINDS
        if kind != "values"
    )
    values = (
        ReportCase(variable.name)
        if variable.is_equal
        else ReportCase(variable.name, (variable.text,), verdict.replay(variable))
        for variable in verdict.ranked
    )
    return Report(
        safe_text(verdict.new),
        safe_text(verdict.baseline),
        verdict.equal,
        verdict.headline,
        (*faults, *values),
        verdict.notes,
        verdict.ranked,
    )


def report_of_error(new: str, baseline: str, error: str) -> Report:
    """The report of an error that prevented the comparison."""
    return Report(safe_text(new), safe_text(baseline), None, "; ".join(error.splitlines()))


def as_data(report: Report) -> dict[str, Any]:
    """The report as a dict for JSON; `equal` is null if there is no verdict."""
    return {
        "equal": report.equal,
        "headline": report.headline,
        "new": report.new,
        "baseline": report.baseline,
        "faults": [
            {"kind": case.name, "text": text}
            for case in report.cases
            if case.name in DIFFERENCE_KINDS
            for text in case.texts
        ],
        "variables": [
            {
                **{"times" if name == "ratio" else name: value for name, value in vars(variable).items()},
                "at": _safe_inputs(variable.at),
                "equal": variable.is_equal,
                "text": variable.text,
                "replay": next((case.replay for case in report.cases if case.name == variable.name), ""),
            }
            for variable in report.variables
        ],
        "notes": list(report.notes),
    }


def _safe_inputs(at: Mapping[str, float | str]) -> dict[str, float | str]:
    return {safe_text(name): safe_text(v, 2000) if isinstance(v, str) else v for name, v in at.items()}


def as_junit(report: Report) -> str:
    """JUnit XML: a suite with a test for each kind of fault and each variable, named by what it claims."""
    failed = [case for case in report.cases if case.texts]
    cases = report.cases or (ReportCase("both are readable"),)
    numbers = {"tests": len(cases), "failures": len(failed), "errors": int(report.equal is None), "skipped": 0}
    counts = {name: str(number) for name, number in numbers.items()}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(
        root, "testsuite", {"name": f"{PROGRAM} {report.new} {report.baseline}", **counts}
    )
    for case in cases:
        test = ElementTree.SubElement(suite, "testcase", {"classname": "impact.compare", "name": _claim(case)})
        if report.equal is None:
            ElementTree.SubElement(test, "error", {"message": report.headline})
        elif case.texts:
            body = "\n".join([*case.texts, *([case.replay] if case.replay else [])])
            ElementTree.SubElement(test, "failure", {"message": case.texts[0]}).text = body
    output = ElementTree.SubElement(suite, "system-out")
    output.text = "\n".join([report.headline, *(f"note: {note}" for note in report.notes)])
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True)


def _claim(case: ReportCase) -> str:
    """What a test claims, in words."""
    if case.name == "both are readable":
        return case.name
    return CLAIMS.get(case.name, f"{case.name} is equal within its tolerance")


def as_markdown(report: Report) -> str:
    """Markdown for a pull request or a job summary."""
    sign = {True: "✅", False: "❌", None: "⚠️"}[report.equal]
    lines = [f"### {sign} {PROGRAM}: {_escape_markdown(report.headline)}", ""]
    lines += [f"`{_escape_code(report.new)}` against the baseline `{_escape_code(report.baseline)}`", ""]
    fault_lines = [
        f"- {_escape_markdown(text)}"
        for case in report.cases
        if case.name in DIFFERENCE_KINDS
        for text in case.texts
    ]
    lines += [*fault_lines, ""] if fault_lines else []
    differing = [variable for variable in report.variables if not variable.is_equal]
    if differing:
        lines += [
            "| variable | differ | worst | × tolerance | at | new | baseline |",
            "|---|--:|--:|--:|---|--:|--:|",
        ]
        for variable in differing:
            numbers = f"{number(variable.worst, 3)} | {number(variable.ratio, 3)}"
            values = f"{number(variable.new, 12)} | {number(variable.baseline, 12)}"
            counts, point = f"{variable.different} of {variable.points}", _escape_markdown(variable.location)
            lines.append(f"| `{variable.name}` | {counts} | {numbers} | {point} | {values} |")
        repeats = dict.fromkeys(case.replay for case in report.cases if case.replay)
        # a fence of four backticks, since a name may contain three
        lines += ["", "````sh", *repeats, "````", ""] if repeats else [""]
    lines += [f"- note: {_escape_markdown(note)}" for note in report.notes]
    return "\n".join(lines).rstrip() + "\n"


def as_github(report: Report) -> str:
    """A workflow command of GitHub Actions: one annotation on the baseline, with the worst of what differs."""
    differing = [case for case in report.cases if case.texts]
    worst = [(text, case.replay) for case in differing for text in case.texts]
    lines = [report.headline]
    for text, replay in worst[:MAX_ANNOTATED]:
        lines += [text, replay] if replay and replay not in lines else [text]
    lines += [f"and {len(worst) - MAX_ANNOTATED} more"] if len(worst) > MAX_ANNOTATED else []
    lines += [f"note: {note}" for note in report.notes]
    return _annotation("notice" if report.equal else "error", report.baseline, "\n".join(lines))


def _annotation(level: str, file: str, text: str) -> str:
    where = "".join(GITHUB_ESCAPES.get(letter, letter) for letter in file)
    message = "".join(letter if letter in ":," else GITHUB_ESCAPES.get(letter, letter) for letter in text)
    return f"::{level} file={where},title={PROGRAM}::{message}"


# characters that a workflow command must escape; the last two in its properties only
GITHUB_ESCAPES: Mapping[str, str] = {"%": "%25", "\r": "%0D", "\n": "%0A", ":": "%3A", ",": "%2C"}


def _escape_markdown(text: str) -> str:
    """Text that Markdown shows literally."""
    return re.sub(r"([\\`*_{}\[\]<>|~#!&$@])", r"\\\1", text)


def _escape_code(text: str) -> str:
    """Text for code spans, which have no escapes."""
    return text.replace("`", "'").replace("|", "¦")
