"""Run an exported script in its code, and compare the restitution with what is predicted."""

from __future__ import annotations

import math
import re
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..array_types import Array
from ..display import Block, Displayed, Table
from ..errors import UsageError
from ..formatting import argument, decimals, number, quantity
from .code import ROUNDING, Code
from .problem import ExportProblem
from .programs import run_program

# phases (i + 1/2)/4 at which a script is run
PHASES = 4
TIMEOUT_S = 300
# times the spacing of coordinates over the indentation: tolerance on e of slow impacts of large or hard balls
SPACINGS = 10.0
# uncertainties of an extrapolation below this are rounding
FLOOR = 1e-7
# times the indentation over R*: tolerance on beta where codes turn the normal, or shorten the arms of the force
TURNING = 4.0
# beside a larger uncertainty of e or beta even a wrong script may look right: nothing is shown
MAX_UNCERTAINTY = 0.05


@dataclass(frozen=True)
class Verification(Displayed):
    """What a code delivers, next to what is predicted.

    Parameters
    ----------
    dt : time steps [s], one for each row
    phases : phases of a step, one for each row; NaN for an extrapolation to dt = 0 of the mean over the phases
    measured, predicted : the restitution by the code and by this program; one that is not a number differs
    uncertainty : tolerance on the restitution
    beta_measured, beta_predicted : the tangential restitution likewise; empty without friction
    beta_uncertainty : tolerance on it
    beta_turning : up to where a difference of it may be the friction that changes with the turn of the normal
    reason : where most of the uncertainty comes from, and what makes it smaller
    """

    program: str
    dt: tuple[float, ...]
    phases: tuple[float, ...]
    measured: tuple[float, ...]
    predicted: tuple[float, ...]
    uncertainty: float
    beta_measured: tuple[float, ...] = ()
    beta_predicted: tuple[float, ...] = ()
    beta_uncertainty: float = 0.0
    beta_turning: float = 0.0
    reason: str = ""

    def as_dict(self) -> dict[str, Any]:
        return {
            "program": self.program,
            "agrees": self.agrees,
            "differs": self.differs,
            "uncertainty": self.uncertainty,
            "rows": self.records(),
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List a row for each time step and phase."""
        columns = {"dt": self.dt, "phase": self.phases, "measured": self.measured, "predicted": self.predicted}
        if self.beta_measured:
            columns |= {"beta_measured": self.beta_measured, "beta_predicted": self.beta_predicted}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def sections(self, width: int) -> Iterator[Block]:
        """A row for each time step and phase, and whether the code agrees."""
        rows = [
            (dt, phase, decimals(measured, 12), decimals(predicted, 12), number(measured - predicted, 2))
            for dt, phase, measured, predicted, *_ in (row.values() for row in self.records())
        ]
        yield Table(rows, ("dt [s]", "phase", "measured", "predicted", "difference"), text=(0,))
        yield ""
        word = "DIFFERS" if self.differs else "agrees" if self.agrees else "UNDECIDED"
        largest = self.not_numbers or f"largest difference {number(self.difference, 2)}"
        beta = ""
        if self.beta_measured:
            beta = f"; of beta {number(self.beta_difference, 2)}, uncertainty {number(self.beta_uncertainty, 2)}"
        yield f"{word}: {largest}, uncertainty {number(self.uncertainty, 2)}{beta}"
        if not (self.differs or self.agrees):
            limit = f"an uncertainty above {MAX_UNCERTAINTY}"
            if self.beta_difference > self.beta_uncertainty:
                limit = f"a difference of beta up to {number(self.beta_turning, 2)}"
            yield f"{limit} shows nothing: {self.reason}"

    @property
    def difference(self) -> float:
        """The largest difference between measured and predicted; NaN if one of them is not a number."""
        with np.errstate(invalid="ignore"):
            return float(np.abs(np.subtract(self.measured, self.predicted)).max())

    @property
    def beta_difference(self) -> float:
        """The largest difference of the tangential restitution; 0 without friction."""
        with np.errstate(invalid="ignore"):
            return float(np.abs(np.subtract(self.beta_measured, self.beta_predicted)).max(initial=0.0))

    @property
    def differs(self) -> bool:
        """Whether a difference is larger than its uncertainty and than what a turn explains, or no number."""
        beta_limit = max(self.beta_uncertainty, self.beta_turning)
        return not (self.difference <= self.uncertainty and self.beta_difference <= beta_limit)

    @property
    def agrees(self) -> bool:
        """Whether no difference is larger than its uncertainty, and both uncertainties are at most 0.05."""
        is_within = not self.differs and self.beta_difference <= self.beta_uncertainty
        return is_within and max(self.uncertainty, self.beta_uncertainty) <= MAX_UNCERTAINTY

    @property
    def not_numbers(self) -> str:
        """The first row whose measured or predicted restitution is not a number, in words; "" for none."""
        rows = zip(self.dt, self.phases, self.measured, self.predicted, strict=True)
        for dt, phase, measured, predicted in rows:
            if not (math.isfinite(measured) and math.isfinite(predicted)):
                position = f"at the phase {number(phase)} of dt = {quantity(dt, 's')}"
                return f"{position} e_out is {measured}, predicted {number(predicted)}"
        return ""


def run_script(code: Code, program: str, script: str) -> dict[str, float]:
    """Run a script in an empty folder, and return the numbers that it prints by name; the last one is e_out."""
    origin = f"{argument('verify')}: {code.title}"
    with tempfile.TemporaryDirectory(prefix="impact-export-") as folder:
        file = f"two_balls{code.suffix}"
        Path(folder, file).write_text(script, encoding="utf-8")
        try:
            assert code.program is not None
            done = run_program(code.program.command(program, file), folder, TIMEOUT_S)
        except (OSError, subprocess.SubprocessError) as error:
            raise UsageError(f"{origin}: {error}") from None
    printed = done.stdout.strip().splitlines() or [""]
    if done.returncode or "e_out" not in _number_in(printed[-1]):
        lines = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()
        error_lines = [line for line in lines if "error" in line.lower()] or lines[-1:]
        raise UsageError(f"{origin} ended with exit code {done.returncode}: {error_lines[0]}")
    return {name: value for line in printed for name, value in _number_in(line).items()}


def _number_in(line: str) -> dict[str, float]:
    """Read a number with its name in a line, also nan or inf; empty if it has none."""
    match = re.fullmatch(r"(e_out|beta|omega1|omega2) = (\S+)", line)
    try:
        return {match[1]: float(match[2])} if match else {}
    except ValueError:
        return {}


def verify_scripts(problem: ExportProblem, program: str, dt: float, n_phases: int = PHASES) -> Verification:
    """Run scripts at `n_phases` phases of a step and compare them with the map of the code's scheme.

    Without a scheme, they are run at dt, dt/2 and dt/4, the mean over the phases is extrapolated to a step of
    zero, and compared with the continuous law, with the uncertainty of `extrapolate`. Where a script measures no
    number, nothing is extrapolated.
    """
    problem = replace(problem, law=replace(problem.law, phases=n_phases))
    code, phases = problem.code, (np.arange(n_phases) + 0.5) / n_phases
    share = problem.collision(dt, 0.5).largest_radius / problem.law.continuous["peak_indentation"]
    tolerance = max(code.uncertainty.get(problem.model.key, ROUNDING), SPACINGS * code.resolution * share)
    steps = np.array([dt] if code.scheme is not None else [dt, dt / 2, dt / 4])
    reason = "the indentation is small beside the spacing of coordinates; try a faster impact or softer balls"
    runs = []
    for dt in steps.tolist():
        collisions = [problem.collision(dt, phase) for phase in phases.tolist()]
        runs.append([run_script(code, program, code.script(c, code.parameters(c))) for c in collisions])
    measured = np.array([[run["e_out"] for run in row] for row in runs])
    predicted = np.full(measured.shape, problem.e_continuous)
    dt_of_row, phase_of_row = np.repeat(steps, n_phases), np.tile(phases, steps.size)
    if code.scheme is not None:
        (predicted,) = problem.law.outputs(steps, "e_out")
    elif np.isfinite(measured).all():
        value, uncertainty = extrapolate(measured)
        dt_of_row, phase_of_row, measured, predicted = np.array([[0.0], [np.nan], [value], predicted[0, :1]])
        if uncertainty > tolerance:
            reason = "the restitution depends on the step; try a smaller dt"
        tolerance = max(uncertainty, FLOOR, tolerance)
    verification = Verification(
        program=program,
        dt=tuple(dt_of_row.tolist()),
        phases=tuple(phase_of_row.tolist()),
        measured=tuple(measured.ravel().tolist()),
        predicted=tuple(predicted.ravel().tolist()),
        uncertainty=tolerance,
        reason=reason,
    )
    return verification if problem.law.oblique is None else _with_friction(verification, problem, steps, runs)


def _with_friction(
    verification: Verification, problem: ExportProblem, steps: Array, runs: list[list[dict[str, float]]]
) -> Verification:
    """Add the tangential restitution.

    The normal of two balls turns, and some codes shorten the arm of friction: both change velocities by a part of
    the speed before the impact, of the order of the indentation over R* and of the angle of the turn. The turn
    also changes the normal impulse, and with it that of friction which slides.
    """
    oblique = problem.law.oblique
    assert oblique is not None
    (predicted,) = problem.law.outputs(steps, "beta")
    exact, impact = verification.uncertainty, problem.law.impact
    v0, slip = float(impact.v0[0]), float(oblique.slip.item())
    tangential = float((oblique.u1 - oblique.u2).item())
    speed = math.hypot(v0, tangential)
    # a law that needs no radius may have none in its impact
    collision = problem.collision(float(steps[0]), 0.5)
    beta_turning = 0.0
    turning = TURNING * problem.law.continuous["peak_indentation"] / collision.effective_radius
    if not problem.has_wall:
        # at a grazing impact the centres move far along the tangent while the balls touch
        turn_of_speed = problem.law.contact_time / (collision["R1"] + collision["R2"])
        turning = max(turning, abs(tangential) * turn_of_speed)
        # a spin may drive them
        mass_ratio, mu = float(oblique.mass_ratio.item()), float(oblique.mu.item())
        fastest = max(abs(tangential), float(np.abs(tangential - mass_ratio * slip * (1.0 + predicted)).max()))
        turn = fastest * turn_of_speed * (1.0 + mu / mass_ratio)
        beta_turning = turn * max(1.0, math.hypot(v0, fastest) / abs(slip))
    is_turning = problem.code.shortens_arms or not problem.has_wall
    reason = verification.reason
    if exact <= MAX_UNCERTAINTY:
        reason = "the indentation shortens the arms of friction; try stiffer balls"
        if not problem.has_wall:
            advice = "try a plane wall, stiffer balls or a smaller angle"
            reason = f"the normal of two balls turns while they touch; {advice}"
    return replace(
        verification,
        uncertainty=exact if problem.has_wall and not problem.law.is_coupled else max(exact, turning * speed / v0),
        beta_measured=tuple(run.get("beta", math.nan) for row in runs for run in row),
        beta_predicted=tuple(predicted.ravel().tolist()),
        beta_uncertainty=max(exact, turning * max(1.0, speed / abs(slip))) if is_turning else exact,
        beta_turning=beta_turning,
        reason=reason,
    )


def extrapolate(restitutions: Array) -> tuple[float, float]:
    """Extrapolate to a step of zero, with the uncertainty, from runs at h, h/2 and h/4, of shape (3, phases).

    The mean over the phases is extrapolated as if its error were of first order. If the error is of order p at h/2
    and h/4, that of the extrapolation is (2^p - 2)/(2^p - 1) of the last correction, less than all of it for any
    p > 0.6; if it has parts of first and second order, it is a third of the difference of the two extrapolations.
    The uncertainty is the larger one, and half the spread over the phases at h/4.

    A code of second order, whose restitution is 0.5 at a step of zero:

    >>> value, uncertainty = extrapolate(np.array([[0.516], [0.504], [0.501]]))
    >>> round(value, 6), round(uncertainty, 6)
    (0.498, 0.006)
    """
    coarse, middle, fine = restitutions.mean(axis=1)
    first, second = 2.0 * middle - coarse, 2.0 * fine - middle
    uncertainty = max(abs(fine - middle), abs(second - first)) + np.ptp(restitutions[2]) / 2.0
    return float(second), float(uncertainty)
