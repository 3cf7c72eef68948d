"""Run an exported script in its code, and compare the restitution with what is predicted."""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..array_types import Array
from ..errors import UsageError
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
    measured, predicted : the restitution by the code and by this program
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
        """The largest difference between measured and predicted."""
        return max(abs(a - b) for a, b in zip(self.measured, self.predicted, strict=True))

    @property
    def agrees(self) -> bool:
        return self.difference <= self.uncertainty


def installed_version(code: Code) -> str | None:
    """The version of a code that is installed here."""
    program = code.find_program(None)
    return None if program is None else code.version_of(program)


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
        version = code.read_version(version)
        if not verify:
            return None, version
    if not code.program and (verify or program is not None):
        raise UsageError(f"--verify: no script for {code.title}: {code.tested}")
    found = code.find_program(program) if code.program else None
    installed = None if found is None else code.version_of(found)
    if installed is None and (verify or program is not None):
        name = "" if program is None else f'"{safe_text(program)}": '
        raise UsageError(f"{name}no {code.title} there; {code.install}, or --program FILE")
    if verify and version is not None and version != installed:
        raise UsageError(f"--code-version: got {safe_text(version)}, but {installed} is what --verify runs")
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
        except (OSError, subprocess.TimeoutExpired) as error:
            raise UsageError(f"--verify: {safe_text(str(error), 300)}") from None
    last = (done.stdout.strip().splitlines() or [""])[-1]
    match = re.fullmatch(r"e_out = (\S+)", last)
    if done.returncode or match is None:
        lines = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()
        error_lines = [line for line in lines if "error" in line.lower()] or lines[-1:]
        raise UsageError(
            f"--verify: {code.title} ended with exit code {done.returncode}: {safe_text(error_lines[0], 300)}"
        )
    return float(match[1])


def verify(problem: ExportProblem, program: str, dt: float) -> Verification:
    """Run scripts at several phases and compare them with the map of the code's scheme.

    Without a scheme, they are run at dt, dt/2 and dt/4, the mean over the phases is extrapolated to a step of
    zero, and compared with the continuous law. The uncertainty is then the difference of the extrapolations from
    dt and dt/2, and from dt/2 and dt/4, and half the spread over the phases at dt/4.

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
    if code.scheme is None:
        value, uncertainty = extrapolate(measured)
        return Verification(
            program=program,
            dt=(0.0,),
            phases=(float("nan"),),
            measured=(value,),
            predicted=(problem.e_continuous,),
            uncertainty=max(uncertainty, FLOOR, code.uncertainty_of(problem.model.key)),
        )
    predicted = problem.law.with_phases(PHASES).restitution(steps)
    return Verification(
        program=program,
        dt=(dt,) * PHASES,
        phases=tuple(phases.tolist()),
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
