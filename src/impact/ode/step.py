"""One step of the pair for many lanes, elementwise and in a fixed order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .problem import COMPONENTS, INTEGRATED, WATCHED, Array, Columns, Problem
from .tableau import ERROR_WEIGHTS, STAGE_WEIGHTS


@dataclass
class Space:
    """Room for one attempt: the later stages, the rows at its end, and sums and terms of components and rows."""

    stages: list[Array]
    new: Array
    part: Array
    term: Array
    wide: Array

    @classmethod
    def of(cls, n: int) -> Space:
        return cls(
            stages=[np.empty((WATCHED + 1, n)) for _ in STAGE_WEIGHTS[1:]],
            new=np.empty((INTEGRATED, n)),
            part=np.empty((COMPONENTS, n)),
            term=np.empty((COMPONENTS, n)),
            wide=np.empty((INTEGRATED, n)),
        )


def attempt(
    problem: Problem, y: Array, k: Array, h: Array, columns: Columns, space: Space
) -> tuple[Array, list[Array]]:
    """One step of length h from rows y whose rates are k: the rows at its end and the seven stages, in `space`."""
    stages = [k]
    part, new = space.part, space.new
    for weights, room in zip(STAGE_WEIGHTS[1:-1], space.stages[:-1], strict=True):
        _weighted(weights, stages, COMPONENTS, part, space.term)
        part *= h
        part += y[:COMPONENTS]
        stages.append(problem.rates(part, columns, room))
    _weighted(STAGE_WEIGHTS[-1], stages, INTEGRATED, new, space.wide)
    new *= h
    new += y
    stages.append(problem.rates(new[:COMPONENTS], columns, space.stages[-1]))
    return new, stages


def _weighted(
    weights: tuple[tuple[int, float], ...], stages: list[Array], rows: int, total: Array, term: Array
) -> None:
    """The weighted sum of the first rows of the stages, term by term in order, into `total`."""
    (first, weight), *rest = weights
    np.multiply(stages[first][:rows], weight, out=total)
    for stage, weight in rest:
        np.multiply(stages[stage][:rows], weight, out=term)
        total += term


def local_error(problem: Problem, stages: list[Array], y: Array, new: Array, h: Array, space: Space) -> Array:
    """The larger of the local errors of the two components, relative to max(|y|, floor); shape (n,)."""
    error, term = space.part, space.term
    _weighted(ERROR_WEIGHTS, stages, COMPONENTS, error, term)
    error *= h
    np.abs(error, out=error)
    scale = np.maximum(np.abs(y[:COMPONENTS]), np.abs(new[:COMPONENTS]), out=term)
    for row, floor in zip(scale, problem.floor, strict=True):
        np.maximum(row, floor, out=row)
    error /= scale
    return np.asarray(np.maximum(error[0], error[1]))
