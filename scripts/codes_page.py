"""docs/codes.md: the codes that laws are exported to, beside each other, from the declarations of exporters."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence

import impact
from impact.contact.fixed_step import SCHEMES
from impact.errors import UsageError
from impact.exporters.code import Code
from impact.exporters.problem import ExportProblem, prepare_export
from impact.exporters.registry import CODES, has_law
from impact.inverse.timestep import timestep_rows
from models_tables import cell, table

PAGE = """\
# Codes compared

<!-- written by `make docs` from the declarations in `impact.exporters` -->

Which law each of {count} simulation codes has, how it steps, and what is easily overlooked. Every number is
computed by this program for the impact of Table 1 of the paper, at 1 m/s. `impact export --to CODE` writes the
lines to paste ([export](export.md)), `impact timestep` gives other steps ([time steps](timestep.md)).

The default law is the first in the table of a code. *e at 0.6* is what the continuous law delivers if 0.6 is
entered, or with the damping that gives 0.6. *At {steps:g} steps* is the mean over the phase and the range, with
{steps:g} steps in a contact. A code that was *run* was compared with the predictions of this program
([codes that were run](timestep.md#codes-that-were-run)); of the others the source or the manual was *read*.

{overview}

*{unknown}*: the restitution at a time step is not predicted here. The step maps:

{schemes}

In the tables below, *0.1 m/s* is the restitution of the same lines at a tenth of the speed. The remarks are those
that `impact export` writes above the lines; one that begins with entries, or with "some laws", is not of all laws.
{sections}
"""
E, SLOW, STEPS = 0.6, 0.1, 20.0
UNKNOWN = "no map"
# inputs of the laws that have no default for them
INPUTS: Mapping[str, Mapping[str, float]] = {
    "adams-impact": {"d": 1e-4},
    "liggghts-edinburgh": {"k2": 2.0, "gamma": 0.0},
    "chrono-smc-flores": {"vc": 1.0},
    "mujoco-solref-direct": {"k": 1e5},
    "opensees-impact-material": {"d": 1e-4},
    "simbody-hunt-crossley-mixed": {"c1": 0.5, "c2": 0.5},
    "simscape-contact": {"w": 1e-5},
}


def codes_page() -> str:
    """docs/codes.md as text."""
    headings = ("code", "release", "default law", "step map", "e at 0.6", f"at {STEPS:g} steps", "evidence")
    laws = [(code, list(_laws(code))) for code in CODES.values()]
    return PAGE.format(
        count=len(CODES),
        steps=STEPS,
        unknown=UNKNOWN,
        overview=table(headings, [_overview(code, problems[0]) for code, problems in laws]),
        schemes="\n".join(f"- `{name}`: {cell(text)}" for name, text in SCHEMES.items()),
        sections="\n".join("\n".join(_section(code, problems)) for code, problems in laws),
    )


def _laws(code: Code) -> Iterator[ExportProblem]:
    """Each law of the newest release of a code; other laws are those of older ones."""
    for key in code.laws:
        if has_law(code, key, code.newest):
            inputs = INPUTS.get(key, {})
            try:
                yield prepare_export(code, key, code.newest, None, {**inputs, "e": E}, ())
            except UsageError:
                # nothing sets its restitution
                yield prepare_export(code, key, code.newest, None, inputs, ())


def _sets_e(problem: ExportProblem) -> bool:
    return problem.law.has_e or problem.law.solved is not None


def _overview(code: Code, problem: ExportProblem) -> list[str]:
    at_steps = "–"
    if code.scheme:
        (row,) = timestep_rows(problem.law, [problem.law.contact_time / STEPS])
        at_steps = f"{row.e_mean:.3f}, {row.e_least:.3f} to {row.e_largest:.3f}"
    law = [f"`{problem.model.key}`", code.scheme or UNKNOWN, f"{problem.e_continuous:.3f}", at_steps]
    return [f"[{cell(code.title)}](#{code.name})", cell(code.newest), *law, "run" if code.template else "read"]


def _section(code: Code, problems: Sequence[ExportProblem]) -> Iterator[str]:
    yield f"\n## {code.name}\n"
    yield f"{cell(code.title)}: {cell(code.tested)}.\n"
    rows, notes = [], defaultdict[str, list[str]](list)
    for problem in problems:
        numbers = ["–", "–"]
        if _sets_e(problem):
            key, solved = problem.model.key, problem.law.solved
            # the stiffness of the lines: without it that of a linear spring would follow from the speed
            stiffness = {"K": problem.law.continuous["stiffness"], "n": problem.law.impact.n.item()}
            at = {**INPUTS.get(key, {}), **({"e": E} if solved is None else solved), **stiffness, "v1": SLOW}
            slow = impact.run(model=key, at=at).values["e_out"]
            numbers = [f"{e:.3f}" for e in (problem.e_continuous, slow)]
        rows.append([cell(code.laws[problem.model.key]), f"`{problem.model.key}`", *numbers])
        for note in code.notes(problem.collision(problem.law.contact_time / STEPS, 0.5)):
            notes[note].append(f"`{problem.model.key}`")
    yield table(("in the code", "entry", "e at 0.6", "0.1 m/s"), rows)
    yield ""
    for note, laws in notes.items():
        whose = "" if len(laws) == len(problems) else f"{', '.join(laws)}: " if len(laws) < 5 else "some laws: "
        yield f"- {whose}{cell(note)}"
