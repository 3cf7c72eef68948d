"""Inputs and outputs of the integrator: a problem of many trajectories, its steps and its solution."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Mask
from .tableau import DENSE_WEIGHTS

Params = tuple[Array, ...]
Event = Callable[[Array, Array, Params], tuple[Array, Array]]

# rows of a state: two components and two quadratures; rates have one row more, the watched quantity
N_COMPONENTS, N_INTEGRATED, WATCHED_ROW = 2, 4, 4


class Termination(IntEnum):
    """How a trajectory ended."""

    RUNNING = 0
    EVENT_REACHED = 1
    EVENT_UNREACHABLE = 2
    MAX_STEPS = 3
    STEP_UNDERFLOW = 4
    NOT_FINITE = 5


class Rates(Protocol):
    """See `Problem`."""

    def __call__(self, y: Array, params: Params, out: Array | None = None, /) -> Array: ...


@dataclass(frozen=True)
class Problem:
    """An initial value problem with an event, for many trajectories.

    Parameters
    ----------
    rates : (y, params, out=None) -> rates of the two components and the two quadratures, and the watched
        quantity, of shape (5, n), at components y of shape (2, n); they may be written into `out`, which may lack
        the last rows
    event : (y, k, params) -> (g, dg): a function that is positive until the trajectory ends, and its rate along
        the trajectory, at components y where the rates are k
    unreachable : (y, k, params) -> mask of the trajectories that can no longer reach the event
    floor : the local error of each component is judged against rtol max(|y|, floor)
    watch : locate the maximum of the watched quantity
    step_at_unit_error : length of a step whose error is of the order of 1, from which the first step is chosen
    """

    rates: Rates
    event: Event
    unreachable: Callable[[Array, Array, Params], Mask]
    floor: tuple[float, float]
    watch: bool = False
    step_at_unit_error: float = 1.0


@dataclass(frozen=True)
class Step:
    """An accepted step, for the interpolant: start (4, n), length (n,), stages (7, 4, n), end as a fraction."""

    start: Array
    length: Array
    stages: Array
    end: Array

    @classmethod
    def of(cls, start: Array, length: Array, stages: list[Array], end: Array) -> Step:
        """Copy a step; missing rows of a stage are zero, since they have no weight."""
        rows = np.zeros((len(stages), *start.shape))
        for target, stage in zip(rows, stages, strict=True):
            target[: len(stage)] = stage[:N_INTEGRATED]
        return cls(start.copy(), length, rows, end)

    def at(self, theta: float | Array) -> Array:
        """Interpolate the integrated rows (4, n) at a fraction of the step, with order four."""
        total = np.zeros_like(self.start)
        for weights, stage in zip(DENSE_WEIGHTS, self.stages, strict=True):
            factor = theta * (weights[0] + theta * (weights[1] + theta * (weights[2] + theta * weights[3])))
            total += factor * stage
        return np.asarray(self.start + self.length * total)


@dataclass(frozen=True)
class Solution:
    """The end of each trajectory: state (4, n), maximum of the watched quantity, accepted steps, termination."""

    state: Array
    maximum: Array
    steps: NDArray[np.int32]
    termination: NDArray[np.int8]
    recorded: tuple[Step, ...] = ()

    @classmethod
    def empty(cls, n: int) -> Solution:
        """Arrays for n trajectories, to be filled."""
        return cls(np.empty((N_INTEGRATED, n)), np.empty(n), np.empty(n, np.int32), np.empty(n, np.int8))

    @classmethod
    def blank(cls, n: int) -> Solution:
        """n trajectories without values: NaN, no steps, RUNNING."""
        unknown = np.full((N_INTEGRATED, n), np.nan)
        return cls(unknown, np.full(n, np.nan), np.zeros(n, np.int32), np.zeros(n, np.int8))
