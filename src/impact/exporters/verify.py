"""Run an exported script in its code, and compare the restitution with what is predicted."""

from __future__ import annotations

import contextlib
import math
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..array_types import Array
from ..errors import UsageError
from ..formatting import number, quantity
from ..text import safe_text
from .code import Code, run_program
from .problem import ExportProblem

# phases (i + 1/2)/4 at which a script is run
PHASES = 4
TIMEOUT_S = 300
# uncertainties of an extrapolation below this are rounding
FLOOR = 1e-7


@dataclass(frozen=True)
class Verification:
    """What a code delivers, beside what is predicted.

    Parameters
    ----------
    program : that ran the scripts
    dt : time steps [s], one for each row
    phases : phases of a step, one for each row; NaN for an extrapolation to dt = 0 of the mean over the phases
    measured, predicted : the restitution by the code and by this program; one that is no number differs
    uncertainty : the largest difference that is no disagreement
    """

    program: str
    dt: tuple[float, ...]
    phases: tuple[float, ...]
    measured: tuple[float, ...]
    predicted: tuple[float, ...]
    uncertainty: float

    @property
    def difference(self) -> float:
        """The largest difference between measured and predicted; NaN if one of them is no number."""
        with np.errstate(invalid="ignore"):
            return float(np.abs(np.subtract(self.measured, self.predicted)).max())

    @property
    def agrees(self) -> bool:
        return self.difference <= self.uncertainty

    @property
    def not_numbers(self) -> str:
        """The first row whose measured or predicted restitution is no number, in words; "" for none."""
        rows = zip(self.dt, self.phases, self.measured, self.predicted, strict=True)
        for dt, phase, measured, predicted in rows:
            if not (math.isfinite(measured) and math.isfinite(predicted)):
                where = f"at the phase {number(phase)} of dt = {quantity(dt, 's')}"
                return f"{where} e_out is {measured}, predicted {number(predicted)}"
        return ""


def installed_version(code: Code) -> str | None:
    """The version of a code that is installed here; None also for a program that reports no release."""
    program = code.find_program(None) if code.program else None
    with contextlib.suppress(UsageError):
        return None if program is None else _version_of(code, program)
    return None


def _version_of(code: Code, program: str) -> str | None:
    """The version that a program reports, in the form in which versions are compared."""
    text = code.version_of(program)
    return None if text is None else code.release(text, f"version of {safe_text(program)}")


def choose_version(
    code: Code, program: str | None, version: str | None, *, verify: bool
) -> tuple[str | None, str]:
    """The program that runs scripts, None if there is none, and the version that lines are written for.

    Parameters
    ----------
    code : the code
    program, version : as the user gives them
    verify : whether scripts are to be run

    Raises
    ------
    UsageError : scripts are to be run, and the code is not installed or has another version
    """
    if version is not None:
        version = code.release(version, "--code-version")
        if not verify:
            return None, version
    if not code.program and (verify or program is not None):
        raise UsageError(f"--verify: no script for {code.title}: {code.tested}")
    found = code.find_program(program) if code.program else None
    installed = None if found is None else _version_of(code, found)
    if installed is None and (verify or program is not None):
        name = "" if program is None else f'"{safe_text(program)}": '
        raise UsageError(f"{name}no {code.title} there; {code.install}, or --program FILE")
    if verify and version is not None and version != installed:
        raise UsageError(f"--code-version: got {version}, but {installed} is what --verify runs")
    return found, version or installed or code.newest


def run_script(code: Code, program: str, script: str) -> float:
    """The restitution that a script prints, run in an empty folder.

    Raises
    ------
    UsageError : it fails, or prints no restitution last
    """
    with tempfile.TemporaryDirectory(prefix="impact-export-") as folder:
        file = f"two_balls{code.suffix}"
        Path(folder, file).write_text(script, encoding="utf-8")
        try:
            done = run_program(code.command(program, file), folder, TIMEOUT_S)
        except (OSError, subprocess.SubprocessError) as error:
            raise UsageError(f"--verify: {code.title}: {safe_text(str(error), 300)}") from None
    e_out = _restitution((done.stdout.strip().splitlines() or [""])[-1])
    if done.returncode or e_out is None:
        lines = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()
        error_lines = [line for line in lines if "error" in line.lower()] or lines[-1:]
        raise UsageError(
            f"--verify: {code.title} ended with exit code {done.returncode}: {safe_text(error_lines[0], 300)}"
        )
    return e_out


def _restitution(line: str) -> float | None:
    """The restitution that a line says, also nan or inf; None if it says none."""
    match = re.fullmatch(r"e_out = (\S+)", line)
    try:
        return float(match[1]) if match else None
    except ValueError:
        return None


def verify(problem: ExportProblem, program: str, dt: float) -> Verification:
    """Run scripts at several phases and compare them with the map of the code's scheme.

    Without a scheme, they are run at dt, dt/2 and dt/4, the mean over the phases is extrapolated to a step of
    zero, and compared with the continuous law. The uncertainty is then the difference of the extrapolations from
    dt and dt/2, and from dt/2 and dt/4, and half the spread over the phases at dt/4. Where a script measures no
    number, nothing is extrapolated.

    Raises
    ------
    UsageError : a script fails
    """
    code = problem.code
    phases = (np.arange(PHASES) + 0.5) / PHASES
    steps = np.array([dt] if code.scheme is not None else [dt, dt / 2, dt / 4])
    measured = np.array(
        [[_measure(problem, program, dt, phase) for phase in phases.tolist()] for dt in steps.tolist()]
    )
    if code.scheme is None and np.isfinite(measured).all():
        value, uncertainty = extrapolate(measured)
        return Verification(
            program=program,
            dt=(0.0,),
            phases=(float("nan"),),
            measured=(value,),
            predicted=(problem.e_continuous,),
            uncertainty=max(uncertainty, FLOOR, code.uncertainty_of(problem.model.key)),
        )
    predicted = (
        np.full(measured.shape, problem.e_continuous)
        if code.scheme is None
        else problem.law.with_phases(PHASES).restitution(steps)
    )
    return Verification(
        program=program,
        dt=tuple(np.repeat(steps, PHASES).tolist()),
        phases=tuple(np.tile(phases, steps.size).tolist()),
        measured=tuple(measured.ravel().tolist()),
        predicted=tuple(predicted.ravel().tolist()),
        uncertainty=code.uncertainty_of(problem.model.key),
    )


def extrapolate(restitutions: Array, order: int = 1) -> tuple[float, float]:
    """The restitution at a step of zero and its uncertainty, from runs at h, h/2 and h/4.

    Parameters
    ----------
    restitutions : by step and phase, shape (3, phases)
    order : of the error of the mean over the phases in the step
    """
    coarse, middle, fine = restitutions.mean(axis=1)
    ratio = 2**order
    first, second = (ratio * middle - coarse) / (ratio - 1), (ratio * fine - middle) / (ratio - 1)
    return float(second), float(abs(second - first) + np.ptp(restitutions[2]) / 2)


def _measure(problem: ExportProblem, program: str, dt: float, phase: float) -> float:
    code = problem.code
    assert code.script is not None
    collision = problem.collision(dt, phase)
    return run_script(code, program, code.script(collision, code.parameters(collision)))
