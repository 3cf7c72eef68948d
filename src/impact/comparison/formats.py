"""A verdict as JSON, JUnit XML, Markdown or GitHub annotations."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

from ..formatting import number, safe_text
from .verdict import Difference, VariableComparison, Verdict, by_kind

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
    tests = {
        claim: [fault.text for fault in outcome.faults if fault.kind == kind] for kind, claim in CLAIMS.items()
    }
    for variable in outcome.ranked:
        lines = [] if variable.is_equal else [variable.text, outcome.replay(variable)]
        tests[f"{variable.name} is equal within its tolerance"] = [line for line in lines if line]
    is_error = isinstance(outcome, NoVerdict)
    if is_error:
        tests = {"both are readable": []}
    numbers = {
        "tests": len(tests),
        "failures": sum(map(bool, tests.values())),
        "errors": int(is_error),
        "skipped": 0,
    }
    counts = {name: str(number) for name, number in numbers.items()}
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
        lines += [*(f"- {_escape_markdown(fault.text)}" for fault in by_kind(outcome.faults)), ""]
    if outcome.differing:
        lines += [
            "| variable | differ | worst | × tolerance | at | new | baseline |",
            "|---|--:|--:|--:|---|--:|--:|",
        ]
        for variable in outcome.differing:
            numbers = f"{number(variable.worst, 3)} | {number(variable.ratio, 3)}"
            values = f"{number(variable.new, 12)} | {number(variable.baseline, 12)}"
            counts, point = f"{variable.different} of {variable.points}", _escape_markdown(variable.location)
            lines.append(f"| `{variable.name}` | {counts} | {numbers} | {point} | {values} |")
        commands = dict.fromkeys(filter(None, map(outcome.replay, outcome.differing)))
        # a fence of four backticks, since a name may contain three
        lines += ["", "````sh", *commands, "````", ""] if commands else [""]
    lines += [f"- note: {_escape_markdown(note)}" for note in outcome.notes]
    return "\n".join(lines).rstrip() + "\n"


def as_github(outcome: Verdict) -> str:
    """Write a workflow command of GitHub Actions: an annotation on the baseline, with the worst differences."""
    failures = [(fault.text, "") for fault in by_kind(outcome.faults)]
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
