"""The running trajectories of an integration, and the memory of their steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Indices, Int8Array, Mask
from .problem import Margins, Params, Problem, Solution, Termination

RUNNING, EVENT_REACHED = int(Termination.RUNNING), int(Termination.EVENT_REACHED)
# stages after the first that need the rates of all integrated rows; the second has no weight in the solution
N_WEIGHTED_STAGES = 4


@dataclass(frozen=True)
class PeakCandidate:
    """Components where the watched quantity was largest at the end of a step, and the adjacent steps."""

    y: Array
    behind: Array
    ahead: Array

    def put(self, positions: Indices, y: Array, behind: Array, ahead: Array | float) -> None:
        """Replace the candidates at the given positions."""
        put_columns(self.y, positions, y)
        self.behind[positions], self.ahead[positions] = behind, ahead


@dataclass
class Workspace:
    """Memory for a step: the rates of the stages after the first, rows at its end, a sum."""

    stages: list[Array]
    y_end: Array
    part: Array

    @classmethod
    def of(cls, problem: Problem, n: int) -> Workspace:
        """Allocate for n trajectories, in one block of memory."""
        components, integrated = problem.n_components, problem.n_integrated
        stage_rows = (components, *(integrated,) * N_WEIGHTED_STAGES, integrated + 1)
        rows = (*stage_rows, integrated, max(components, len(problem.floor)))
        *stages, y_end, part = np.split(np.empty((sum(rows), n)), np.cumsum(rows)[:-1])
        return cls(stages, y_end, part)

    def narrow(self, n: int) -> Workspace:
        """Use the same memory for fewer trajectories."""
        arrays = (*self.stages, self.y_end, self.part)
        *stages, y_end, part = (rows.reshape(-1)[: len(rows) * n].reshape(len(rows), n) for rows in arrays)
        return Workspace(stages, y_end, part)


def put_columns(rows: Array, positions: Indices, values: Array) -> None:
    """Replace columns of the rows; row by row, which is many times faster than by both indices."""
    for row, new in zip(rows, values, strict=True):
        row[positions] = new


@dataclass
class State:
    """The running trajectories, in arrays that are compacted together; the last axis is the trajectory.

    `h` is the length of the next step, `h_last` that of the previous one. `best` is the largest watched value at
    the end of a step from which it fell or at which the trajectory ended; `peak`, for all trajectories, is where.
    `margins` are those of a switch at the start of the step, no rows without one; `h_free` is the length of the
    next step before a margin shortened it.
    """

    index: Indices
    params: Params
    y: Array
    k: Array
    h: Array
    h_last: Array
    halvings: Int8Array
    steps: NDArray[np.int32]
    termination: Int8Array
    best: Array
    peak: PeakCandidate
    workspace: Workspace
    margins: Margins
    h_free: Array

    @classmethod
    def begin(cls, problem: Problem, start: Array, params: Params, workspace: Workspace, h: float) -> State:
        """Set all trajectories to their start; missing rows of the start are zero."""
        n = start.shape[1]
        y = np.zeros((problem.n_integrated, n))
        y[: len(start)] = start
        start = start[: problem.n_components]
        k = problem.rates(start, params)
        margins: Margins = np.zeros((0, n)), np.zeros((0, n))
        if problem.switch is not None:
            # the modes are written to the columns
            params = tuple(column.copy() for column in params)
            margins = problem.switch.margins(y, k, params)
        return cls(
            margins=margins,
            h_free=np.zeros(n),
            index=np.arange(n),
            params=params,
            y=y,
            k=k,
            h=np.full(n, h),
            h_last=np.zeros(n),
            halvings=np.zeros(n, np.int8),
            steps=np.zeros(n, np.int32),
            termination=np.full(n, RUNNING, np.int8),
            best=np.full(n, -np.inf),
            peak=PeakCandidate(start.copy(), behind=np.zeros(n), ahead=np.zeros(n)),
            workspace=workspace,
        )

    def put(self, solution: Solution) -> None:
        """Write the trajectories that have ended to the solution."""
        ended = np.flatnonzero(self.termination != RUNNING)
        index, termination = self.index[ended], self.termination[ended]
        reached = termination == EVENT_REACHED
        for row, values in zip(solution.state, self.y, strict=True):
            row[index] = np.where(reached, values[ended], np.nan)
        solution.maximum[index] = np.where(reached, self.best[ended], np.nan)
        solution.steps[index], solution.termination[index] = self.steps[ended], termination

    def compacted(self) -> State:
        """Keep the running trajectories."""
        running = np.flatnonzero(self.termination == RUNNING)
        rows: dict[str, Any] = {
            name: row.take(running, -1) for name, row in vars(self).items() if isinstance(row, np.ndarray)
        }
        for name in ("params", "margins"):
            rows[name] = tuple(row.take(running, -1) for row in getattr(self, name))
        return replace(self, **rows, workspace=self.workspace.narrow(running.size))


@dataclass(frozen=True)
class TrialStep:
    """A trial step of all trajectories: rows and rates at its end, whether it is accurate, the next length."""

    y: Array
    k: Array
    is_accurate: Mask
    h_next: Array
