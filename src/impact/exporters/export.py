"""Write the input lines of a simulation code for a law, with what the code delivers at its time step."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsFloat

from .._version import __version__
from ..atomic import check_outputs, write_file
from ..config.files import read_number
from ..config.tables import SWEEP_QUANTITIES
from ..contact.model import ForceModel
from ..display import Block, Displayed
from ..engine.plugins import read_plugins
from ..errors import UsageError
from ..formatting import argument, decimals, number, quantity, rounded, safe_text
from ..inverse import timestep
from ..results.single_impact import ConfigSource
from .code import Collision, Parameters
from .problem import ExportProblem, prepare_export
from .registry import CODES, choose_version, find_code, installed_version
from .verification import Verification, verify_scripts

# steps per contact if no time step is given
STEPS_PER_CONTACT = 50.0
# the time step that is advised keeps every phase within this relative tolerance
ADVISED_TOL = 0.01
# a larger difference between the requested e and that of the continuous law is a warning
ASKED_TOL = 0.005
# fields of an export that its plain data begin with
EXPORT_FIELDS = ("code", "version", "model", "scheme", "e", "solved", "e_continuous", "contact_time")
# the longest line of a comment
MAX_COMMENT = 1000


@dataclass(frozen=True)
class Export(Displayed):
    """The input lines of a simulation code for a law, and what the code delivers.

    Parameters
    ----------
    model : key of the law
    scheme : name of the code's fixed-step scheme, see `impact.contact.fixed_step.SCHEMES`; None if unknown here
    e : the requested e; NaN for a law without one, unless its damping was solved for
    solved : the value of the damping parameter that gives the e of a law without one; None if none was asked for
    e_continuous, contact_time : of the continuous law [-, s]
    needed : the value of a parameter from which on every phase is within 1 % at the step, where it was asked for
        or a given step is too large; None where there is none
    at_dt : what the code delivers at its time step; its restitutions are NaN without a scheme, and where a
        collision fails
    parameters : by the code's own names, in its units and conventions
    header, lines : the comment above the lines, and the lines to paste
    script : a complete input with two balls
    warnings : what a user has to know before using the lines
    verification : what the code delivered; None if no script was run
    comment : what begins and ends a comment among the lines
    friction, beta_continuous : key of the friction law, "" without one, and the beta of the continuous laws
    """

    code: str
    version: str
    model: str
    scheme: str | None
    e: float
    solved: Mapping[str, float] | None
    e_continuous: float
    contact_time: float
    at_dt: timestep.TimestepRow
    needed: timestep.NeededParameter | None
    parameters: Parameters
    header: tuple[str, ...]
    lines: tuple[str, ...]
    script: str | None
    warnings: tuple[str, ...]
    verification: Verification | None
    comment: tuple[str, str]
    friction: str = ""
    beta_continuous: float = math.nan

    @property
    def text(self) -> str:
        """The script, or the header as a comment and the lines."""
        if self.script is not None:
            return self.script
        return "\n".join([*comment_lines(self.header, *self.comment), *self.lines]) + "\n"

    def as_dict(self) -> dict[str, Any]:
        """Return the result as plain data; numbers that do not apply are NaN."""
        row = self.at_dt
        data: dict[str, Any] = {
            **{name: getattr(self, name) for name in EXPORT_FIELDS},
            "e_at_dt": {"dt": row.dt, "mean": row.e_mean, "least": row.e_least, "largest": row.e_largest},
            "e_to_ask": row.e_to_ask,
            "for": self.needed and self.needed.as_dict(),
            "parameters": dict(self.parameters),
            "lines": list(self.lines),
            "header": list(self.header),
            "warnings": list(self.warnings),
        }
        if self.friction:
            beta = {"mean": row.beta_mean, "least": row.beta_least, "largest": row.beta_largest}
            data |= {
                "friction": self.friction,
                "beta_continuous": self.beta_continuous,
                "beta_at_dt": {"dt": row.dt, **beta},
            }
        if self.script is not None:
            data["script"] = self.script
        if self.verification is not None:
            data["verification"] = self.verification.as_dict()
        return data

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List the parameters of the code."""
        return [{"parameter": name, "value": value} for name, value in self.parameters.items()]

    def sections(self, width: int) -> Iterator[Block]:
        """What the code delivers and what was predicted; the text where no script was run."""
        if self.verification is None:
            yield from self.text.splitlines()
            return
        steps = number(self.at_dt.steps_per_contact)
        yield f"{self.code} {self.version}, {self.model}, {steps} steps per contact"
        yield ""
        yield from self.verification.sections(width)


def comment_lines(lines: Iterable[str], begin: str = "# ", end: str = "") -> list[str]:
    r"""Write lines as comments of a code: no text in a line ends its comment.

    >>> comment_lines(["a\nb"], "// "), comment_lines(["a --> b"], "<!-- ", " -->")
    (['// a\\x0ab'], ['<!-- a - -> b -->'])
    """
    shown = (safe_text(line, MAX_COMMENT) for line in lines)
    # XML has no "--" in a comment
    return [f"{begin}{re.sub('-(?=-)', '- ', line) if end else line}{end}" for line in shown]


def export(
    to: str,
    model: str | None = None,
    *,
    source: ConfigSource = None,
    at: Mapping[str, object] | None = None,
    dt: SupportsFloat | str | None = None,
    parameter: str | None = None,
    friction: str | None = None,
    code_version: str | None = None,
    script: bool = False,
    verify: bool = False,
    program: str | None = None,
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> Export:
    """Write the input lines of a simulation code for a law, and what the code delivers at its time step.

    Parameters
    ----------
    to : name of the code, see `export_codes`
    model : a law that the code has, by its key; by default the first one of the source, or without a source the
        first one of `export_codes`, that the release of the code has. The laws of a calibration, with their fitted
        parameters, begin with the best one
    source, overrides, plugins : see `solve`; a law of `plugins` may be beside those of the code in the source
    at : values of inputs by config name; an e for a law that takes none is reached by its damping parameter
    dt : time step [s], or a text such as "2 us"; by default the contact time of the continuous law over 50
    parameter : see `timestep`; by default what sets the time scale of the law, where a given `dt` is too large
        for every phase to be within 1 %
    friction : key of a friction law of an oblique impact that the code has; by default the first one of the source
    code_version : release of the code, letters, digits, spaces and `._+()-`; by default that of the program, or
        else the newest known one
    script : write a complete input with two balls that prints the e that it measures
    verify : run such inputs at four phases, and compare their e with the prediction
    program : what runs scripts, such as the file of lmp, or of a Python with the code's package; by default found
    output : file to write the lines or the script to
    overwrite : replace the output if it exists

    Returns
    -------
    Export : parameters, lines, script and what the code delivers; `text` is what is written to `output`

    Raises
    ------
    UsageError : the code or the law is unknown, no damping gives the e, the code is not installed, cannot run such
        a collision, has no scripts, or its script fails, or the output exists
    ConfigError : see `sweep`

    What LAMMPS takes for a restitution of 0.6:

    >>> import impact
    >>> law, at = "lammps-coeff-restitution-hooke", {"e": 0.6, "K": 1e6}
    >>> export = impact.export("lammps", law, at=at, code_version="22Jul2025")
    >>> export.lines[1]
    'pair_coeff      * * hooke 1000000.0 0.6 damping coeff_restitution tangential linear_nohistory 0.0 0.0'
    >>> round(export.at_dt.e_mean, 4)
    0.5985
    """
    # before a program is run
    check_outputs([output], [source, *plugins], overwrite=overwrite)
    code = find_code(to)
    program_path, version = choose_version(code, program, code_version, verify=verify)
    problem = prepare_export(code, model, version, source, at or {}, overrides, friction, read_plugins(plugins))
    check_outputs([output], [source, *plugins, *problem.law.config.files], overwrite=overwrite)
    if script and not code.template:
        raise UsageError(f"{argument('script')}: there is none for {code.title}: {code.tested}")
    contact_time = problem.law.contact_time
    given = [] if dt is None else [read_number(dt, SWEEP_QUANTITIES["dt"], argument("dt"))]
    (dt,) = timestep.time_steps(contact_time, [] if given else [STEPS_PER_CONTACT], given)
    collision = problem.collision(dt, 0.5)
    parameters = code.parameters(collision)
    # NaN without a scheme
    at_dt = timestep.TimestepRow(dt, contact_time / dt, math.nan, math.nan, math.nan, math.nan)
    if code.scheme is not None:
        (at_dt,) = timestep.timestep_rows(problem.law, [dt])
    advised = None
    # with friction that changes e, no step delivers the e that is asked for
    if code.scheme is not None and problem.law.target_e > 0.0 and not problem.law.is_coupled:
        advised = timestep.needed_steps(problem.law, ADVISED_TOL)
    if parameter is not None and code.scheme is None:
        raise UsageError(f"{argument('parameter')}: what {code.title} delivers at a time step is not predicted")
    needed, name = None, parameter
    if parameter is None and given and advised is not None and advised.dt < dt:
        name = timestep.time_parameter(problem.law.config, problem.model)
    # where nobody asked for it, a law whose time scale has no such parameter is exported without
    with nullcontext() if parameter is not None else suppress(UsageError):
        if name is not None:
            needed = timestep.needed_parameter(problem.law, name, dt, ADVISED_TOL, advised)
    needed_text = str(needed or (timestep.missing_parameter(parameter, ADVISED_TOL) if parameter else ""))
    header = tuple(_header(problem, collision, at_dt, advised, needed_text))
    result = Export(
        code=code.name,
        version=problem.version,
        model=problem.model.key,
        scheme=code.scheme and problem.law.scheme,
        e=problem.law.wanted_e,
        solved=problem.law.solved,
        e_continuous=problem.e_continuous,
        contact_time=contact_time,
        friction=collision.friction,
        beta_continuous=problem.law.continuous.get("beta", math.nan),
        at_dt=at_dt,
        needed=needed,
        parameters=parameters,
        header=header,
        lines=tuple(code.lines(collision, parameters)),
        script="\n".join([*comment_lines(header), code.script(collision, parameters)]) if script else None,
        warnings=tuple(_warnings(problem, collision, at_dt)),
        verification=verify_scripts(problem, program_path, dt) if verify and program_path else None,
        comment=code.comment,
    )
    if output is not None:
        write_file(Path(output), result.text.encode(), overwrite=overwrite)
    return result


def export_codes() -> list[dict[str, Any]]:
    """The codes to which laws are exported, each with its laws, by key of the catalogue.

    Returns
    -------
    list : for each code a dict of its name "code", "title", the "installed" and the "newest" known version,
        the "scheme" of its time step, what was "tested", and what it calls each of its "laws"

    >>> import impact
    >>> (mujoco,) = (code for code in impact.export_codes() if code["code"] == "mujoco")
    >>> mujoco["laws"]["mujoco-solref"]
    'solref, standard format'
    """
    return [
        {
            "code": code.name,
            "title": code.title,
            "installed": installed_version(code),
            "newest": code.newest,
            "scheme": code.scheme,
            "tested": code.tested,
            "laws": dict(code.laws),
        }
        for code in CODES.values()
    ]


def _warnings(problem: ExportProblem, collision: Collision, row: timestep.TimestepRow) -> Iterator[str]:
    """List what a user has to know before using the lines."""
    yield from problem.code.warnings(collision)
    yield from filter(None, (problem.other_law, problem.better_fit))
    if abs(problem.e_continuous - problem.law.target_e) > ASKED_TOL:
        key, requested = problem.model.key, number(problem.law.target_e)
        yield (
            f"{key} delivers {number(problem.e_continuous)} where e = {requested} is asked for; impact solve "
            f"--model {key} --for e --target e_out={requested} finds the e to enter"
        )
    if problem.left_out:
        laws = ", ".join(problem.left_out)
        yield f"{laws}: {problem.code.title} has no such friction law, the lines have no friction"
    yield from row.warnings(problem.law.phases)


def _header(
    problem: ExportProblem,
    collision: Collision,
    row: timestep.TimestepRow,
    advised: timestep.NeededSteps | None,
    needed: str,
) -> Iterator[str]:
    """Write what a comment above the lines says."""
    code, law = problem.code, problem.law
    yield f"{code.title}, {problem.version}; written by impact {__version__}"
    yield f"law: {problem.model.key}, {problem.model.equation}"
    yield from problem.notes
    if problem.has_wall:
        radius = collision["R_eff"]
        known = "" if math.isnan(radius) else f", R* = {quantity(radius, 'm')}"
        moving = "; in a script it is at rest, and ball 1 has v1 - v2" if collision["v2"] else ""
        yield f"ball 2 is a plane wall: m = m1{known}{moving}"
    for name, value in (problem.law.solved or {}).items():
        yield f"{name} = {value!r} gives the e that is wanted"
    asked = f"e = {number(law.e)} is asked for; " if law.has_e else ""
    delivered, contact_time = number(problem.e_continuous), quantity(law.contact_time, "s")
    yield f"{asked}the continuous law delivers {delivered} in a contact time of {contact_time}"
    steps = f"dt = {quantity(row.dt, 's')}, {number(row.steps_per_contact)} steps per contact"
    if law.rayleigh_time == law.rayleigh_time:
        steps += f", {number(row.dt / law.rayleigh_time, 3)} of the Rayleigh time"
    if code.scheme is None:
        yield f"{steps}: what the code's scheme delivers there is not predicted"
    else:
        spread = f"{decimals(row.e_least)} to {decimals(row.e_largest)} by the phase in the step"
        delivered = row.failure(law.phases) if row.failed else f"mean e {decimals(row.e_mean)}, {spread}"
        yield f"{steps}: {delivered} ({law.scheme})"
        if law.friction and not row.failed:
            spread = f"{decimals(row.beta_least)} to {decimals(row.beta_largest)}"
            # without slip there is no beta
            has_slip = row.beta_mean == row.beta_mean
            delivered = f"mean beta {decimals(row.beta_mean)}, {spread}" if has_slip else "no beta without slip"
            yield f"friction: {law.friction}, {delivered}"
        if row.e_to_ask == row.e_to_ask:
            yield f"a mean of {number(problem.law.target_e)} at this dt: enter e = {decimals(row.e_to_ask)}"
        if advised is not None:
            within = f"within {number(100.0 * ADVISED_TOL)} % of {number(problem.law.target_e)}"
            dt = quantity(rounded(advised.dt, 3, up=False), "s", 3)
            yield f"recommended: dt <= {dt} keeps e {within} whatever the phase"
            yield from timestep.packing_notes(advised.dt, law.rayleigh_time)
        if needed:
            yield needed
    yield from code.notes(collision)
    yield code.tested
