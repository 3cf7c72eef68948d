"""Inputs and outputs of the integrator: a problem of many trajectories, its steps and its solution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Indices, Int8Array, Mask
from .tableau import DENSE_WEIGHTS

Params = tuple[Array, ...]
Event = Callable[[Array, Array, Params], tuple[Array, Array]]

# margins and their rates, shape (margins, n) each
Margins = tuple[Array, Array]


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


class Switch(Protocol):
    """Changes of the formulas within an integration: the mode of a trajectory is part of its params.

    A step ends near enough to the change that an error of its time is negligible, also where the rates jump.
    """

    def margins(self, y: Array, k: Array, params: Params, /) -> Margins:
        """Compute functions that are positive as long as a mode lasts, and their rates, NaN if expensive."""
        ...

    def rates_of_margins(self, y: Array, k: Array, params: Params, /) -> Array:
        """Compute the rates of the margins that `margins` leaves out; NaN where that is not possible."""
        ...

    def change(self, which: Indices, y: Array, k: Array, params: Params, /) -> tuple[Array, Params]:
        """Change the modes of trajectories, by the number of the margin that vanished: new rows and params."""
        ...


@dataclass(frozen=True)
class Problem:
    """An initial value problem with an event, for many trajectories.

    Parameters
    ----------
    rates : (y, params, out=None) -> rates of the components and the quadratures, and the watched quantity, of
        shape (components + quadratures + 1, n), at components y of shape (components, n); they may be written into
        `out`, which may lack the last rows
    event : (y, k, params) -> (g, dg): a function that is positive until the trajectory ends, and its rate along
        the trajectory, at components y where the rates are k
    unreachable : (y, k, params) -> mask of the trajectories that can no longer reach the event
    floor : the local error of each component is judged against rtol max(|y|, floor), and so are those of the
        quadratures that have a floor, too
    watch : locate the maximum of the watched quantity
    step_at_unit_error : length of a step whose error is of the order of 1, from which the first step is chosen
    n_components, n_quadratures : numbers of components and quadratures
    switch : changes of the formulas within the integration
    """

    rates: Rates
    event: Event
    unreachable: Callable[[Array, Array, Params], Mask]
    floor: tuple[float, ...]
    watch: bool = False
    step_at_unit_error: float = 1.0
    n_components: int = 2
    n_quadratures: int = 2
    switch: Switch | None = None

    @property
    def n_integrated(self) -> int:
        """Number of rows of a state: components and quadratures; it is also the row of the watched quantity."""
        return self.n_components + self.n_quadratures


@dataclass(frozen=True)
class Step:
    """An accepted step, to interpolate: start (rows, n), length (n,), stages (7, rows, n), end as a fraction.

    `params` are those with which its rates were computed; a switch may change them from step to step.
    """

    start: Array
    length: Array
    stages: Array
    end: Array
    params: Params = ()

    @classmethod
    def of(cls, start: Array, length: Array, stages: list[Array], params: Params) -> Step:
        """Copy a step of the first trajectory; missing rows of a stage are zero, since they have no weight."""
        rows = np.zeros((len(stages), len(start), 1))
        for target, stage in zip(rows, stages, strict=True):
            target[: len(stage)] = stage[: len(start), :1]
        params = tuple(column[:1].copy() for column in params)
        return cls(start[:, :1].copy(), length[:1], rows, np.ones(1), params)

    @classmethod
    def each(cls, steps: Sequence[Step], numbers: Indices) -> Step:
        """Choose steps of a single trajectory by their numbers (n,), to interpolate them at once."""
        start, length, stages, end = (
            np.concatenate([getattr(step, name) for step in steps], axis=-1)[..., numbers]
            for name in ("start", "length", "stages", "end")
        )
        columns = zip(*(step.params for step in steps), strict=True)
        return cls(start, length, stages, end, tuple(np.concatenate(column)[numbers] for column in columns))

    def at(self, theta: float | Array) -> Array:
        """Interpolate the integrated rows (rows, n) at a fraction of the step, with order four."""
        total = np.zeros_like(self.start)
        for weights, stage in zip(DENSE_WEIGHTS, self.stages, strict=True):
            factor = theta * (weights[0] + theta * (weights[1] + theta * (weights[2] + theta * weights[3])))
            total += factor * stage
        return np.asarray(self.start + self.length * total)


@dataclass(frozen=True)
class Solution:
    """The end of each trajectory: state (rows, n), largest watched quantity, accepted steps, termination."""

    state: Array
    maximum: Array
    steps: NDArray[np.int32]
    termination: Int8Array
    recorded: tuple[Step, ...] = ()

    @classmethod
    def blank(cls, n: int, rows: int = 4) -> Solution:
        """n trajectories without values: NaN, no steps, RUNNING."""
        unknown = np.full((rows, n), np.nan)
        return cls(unknown, np.full(n, np.nan), np.zeros(n, np.int32), np.zeros(n, np.int8))
