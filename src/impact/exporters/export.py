"""Write a law as a code takes it, with what the code delivers at its time step."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass

from .._version import __version__
from ..config.input_names import InputName
from ..contact.status import Status
from ..errors import UsageError
from ..formatting import decimals, number, quantity
from ..inverse.timestep import TimestepRow, needed_steps, time_steps, timestep_rows
from ..text import safe_text
from .code import Collision, Parameters
from .problem import ExportProblem
from .verify import Verification, verify

# steps per contact if no time step is given
STEPS_PER_CONTACT = 50.0
# the time step that is advised keeps every phase within this relative tolerance
ADVISED_TOL = 0.01
# a continuous law that delivers another e than it is asked for, by more than this, is warned about
ASKED_TOL = 0.005
# the longest line of a comment
MAX_COMMENT = 1000


@dataclass(frozen=True)
class Export:
    """A law as a code takes it.

    Parameters
    ----------
    code, version : the code and its release
    model : key of the law
    scheme : name of the code's fixed-step scheme, see `impact.contact.timestep.SCHEMES`; None if unknown here
    e : the e that is asked for; NaN for a law without one
    e_continuous, contact_time : of the continuous law [-, s]
    at_dt : what the code delivers at its time step; its restitutions are NaN without a scheme, and where a
        collision fails
    parameters : by the code's own names, in its units and conventions
    header : what a comment above the lines says
    lines : to paste
    script : a complete input with two balls
    warnings : what a user has to know before using the lines
    verification : what the code delivered; None if no script was run
    comment : what begins and ends a comment among the lines
    """

    code: str
    version: str
    model: str
    scheme: str | None
    e: float
    e_continuous: float
    contact_time: float
    at_dt: TimestepRow
    parameters: Parameters
    header: tuple[str, ...]
    lines: tuple[str, ...]
    script: str | None
    warnings: tuple[str, ...]
    verification: Verification | None
    comment: tuple[str, str]

    @property
    def text(self) -> str:
        """The script, or the header as a comment and the lines."""
        if self.script is not None:
            return self.script
        return "\n".join([*comment_lines(self.header, *self.comment), *self.lines]) + "\n"


def comment_lines(lines: Iterable[str], begin: str = "# ", end: str = "") -> list[str]:
    r"""Lines as comments of a code: no text in a line ends its comment.

    >>> comment_lines(["a\nb"], "// "), comment_lines(["a --> b"], "<!-- ", " -->")
    (['// a\\x0ab'], ['<!-- a - -> b -->'])
    """
    shown = (safe_text(line, MAX_COMMENT) for line in lines)
    # XML has no "--" in a comment
    return [f"{begin}{re.sub('-(?=-)', '- ', line) if end else line}{end}" for line in shown]


def write_export(problem: ExportProblem, dt: float | None, program: str | None, *, with_script: bool) -> Export:
    """The lines and the script of a law at a time step [s]; by default contact time/50.

    Parameters
    ----------
    problem : the law, the impact and the code
    dt : time step [s]
    program : runs scripts, which are compared with the prediction; None to run none
    with_script : whether to write a script

    Raises
    ------
    UsageError : the code cannot run such a collision, has no scripts, or a script fails
    """
    code, contact_time = problem.code, problem.law.contact_time
    if (with_script or program is not None) and code.script is None:
        raise UsageError(f"--script: there is none for {code.title}: {code.tested}")
    (dt,) = time_steps(contact_time, [STEPS_PER_CONTACT] if dt is None else [], [] if dt is None else [dt])
    collision = problem.collision(dt, 0.5)
    parameters = code.parameters(collision)
    at_dt = _row(problem, dt)
    warnings = list(code.warnings(collision))
    if abs(problem.e_continuous - problem.wanted) > ASKED_TOL:
        key, wanted = problem.model.key, number(problem.wanted)
        warnings.append(
            f"{key} delivers {number(problem.e_continuous)} where e = {wanted} is asked for; impact solve "
            f"--model {key} --for e --target e_out={wanted} finds the e to ask for"
        )
    if at_dt.failed:
        warnings.append(f"dt = {quantity(dt, 's')}: {_failure(problem, at_dt)}")
    header = _header(problem, collision, at_dt)
    script = None
    if with_script and code.script is not None:
        script = "\n".join([*comment_lines(header), code.script(collision, parameters)])
    return Export(
        code=code.name,
        version=problem.version,
        model=problem.model.key,
        scheme=code.scheme,
        e=problem.law.e,
        e_continuous=problem.e_continuous,
        contact_time=contact_time,
        at_dt=at_dt,
        parameters=parameters,
        header=tuple(header),
        lines=tuple(code.lines(collision, parameters)),
        script=script,
        warnings=tuple(warnings),
        verification=None if program is None else verify(problem, program, dt),
        comment=code.comment,
    )


def _row(problem: ExportProblem, dt: float) -> TimestepRow:
    """What the code delivers at a time step [s]; NaN without a scheme."""
    if problem.code.scheme is None:
        nan = math.nan
        return TimestepRow(dt, problem.law.contact_time / dt, nan, nan, nan, nan)
    (row,) = timestep_rows(problem.law, [dt])
    return row


def _failure(problem: ExportProblem, row: TimestepRow) -> str:
    """Why the code delivers no restitution at a time step, in words."""
    status = row.status.replace("_", " ")
    return f"{status} at {row.failed} of {problem.law.phases} phases, {Status[row.status.upper()].meaning}"


def _header(problem: ExportProblem, collision: Collision, row: TimestepRow) -> list[str]:
    """What a comment above the lines says."""
    code, law = problem.code, problem.law
    header = [
        f"{code.title}, {problem.version}; written by impact {__version__}",
        f"law: {problem.model.key}, {problem.model.equation}",
    ]
    if problem.missing:
        header.append(f"release {problem.version} lacks the default law of {code.newest}, {problem.missing}")
    if problem.first:
        header.append(f"first value of each axis of the source: {', '.join(problem.first)}")
    if problem.solved:
        name = InputName.parse(problem.solved).key
        header.append(f"{name} = {collision[name]!r} gives the e that is wanted")
    asked = f"e = {number(law.e)} is asked for; " if law.has_e else ""
    contact_time = quantity(law.contact_time, "s")
    header.append(
        f"{asked}the continuous law delivers {number(problem.e_continuous)} in a contact time of {contact_time}"
    )
    steps = f"dt = {quantity(row.dt, 's')}, {number(row.steps_per_contact)} steps per contact"
    if code.scheme is None:
        header.append(f"{steps}: what the code's scheme delivers there is not predicted")
    else:
        spread = f"{decimals(row.e_least)} to {decimals(row.e_largest)} by the phase in the step"
        delivered = _failure(problem, row) if row.failed else f"mean e {decimals(row.e_mean)}, {spread}"
        header.append(f"{steps}: {delivered} ({code.scheme})")
        if row.e_to_ask == row.e_to_ask:
            header.append(f"a mean of {number(problem.wanted)} at this dt: ask for e = {decimals(row.e_to_ask)}")
        # where the continuous law delivers another e, no step does what is advised
        reachable = abs(problem.e_continuous - problem.wanted) < ADVISED_TOL * problem.wanted
        needed = needed_steps(law, ADVISED_TOL, problem.e_continuous) if reachable else None
        if needed is not None:
            within = f"within {number(100.0 * ADVISED_TOL)} % of {number(problem.wanted)}"
            header.append(f"advised: dt <= {quantity(needed.dt, 's', 3)}, where every phase is {within}")
    return [*header, *code.notes(collision), code.tested]
