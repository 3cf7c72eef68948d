"""Records of trajectories: arrays by name with one entry per trajectory, joined, taken and stored alike.

Impacts that are the same dimensionless problem, bit for bit, share a trajectory.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import AnyArray, Array, Indices, Int8Array, Mask
from .status import Status, StatusWithMeaning

# positions of trajectories; a slice for all of them, so that nothing is copied
Positions = Indices | slice
# columns of integers; the others are floating-point numbers
INTEGERS = {"steps": np.int32, "slip_changes": np.int32, "status": np.int8, "regime": np.int8}


def positions(mask: Mask) -> Positions:
    """Find the positions at which the mask is True."""
    return slice(None) if mask.all() else np.flatnonzero(mask)


@dataclass(frozen=True)
class Record:
    """The base of results that have one entry per trajectory: every field is an array of shape (n,)."""

    if TYPE_CHECKING:
        # every record has it, among its own fields
        status: Int8Array
    # what the status may be
    statuses: ClassVar[type[StatusWithMeaning]]

    @classmethod
    def columns(cls) -> tuple[str, ...]:
        return tuple(field.name for field in fields(cls))

    @classmethod
    def blank(cls, n: int) -> Self:
        """n trajectories without values, with status OK and no steps."""
        arrays: dict[str, Any] = {
            name: np.zeros(n, INTEGERS[name]) if name in INTEGERS else np.full(n, np.nan) for name in cls.columns()
        }
        arrays["status"][:] = Status.OK
        return cls(**arrays)

    @classmethod
    def row_bytes(cls) -> int:
        """Bytes of one trajectory."""
        return sum(array.nbytes for array in vars(cls.blank(1)).values())

    def misfit(self, n: int) -> str:
        """Describe the first column that is not an array of n trajectories, of its type; "" if all are."""
        for name, column in vars(self.blank(n)).items():
            got, expected = (
                f"{a.dtype} of shape {a.shape}" if isinstance(a, np.ndarray) else type(a).__name__
                for a in (getattr(self, name), column)
            )
            if got != expected:
                return f"{name}: got {got}, expected {expected}"
        return ""

    def put(self, rows: Positions | Mask, part: Self) -> None:
        for name in self.columns():
            getattr(self, name)[rows] = getattr(part, name)

    @classmethod
    def joined(cls, n: int, status: Int8Array | int, parts: Sequence[tuple[Positions, Self]]) -> Self:
        """n trajectories, composed of parts at their positions; those in no part have only a status."""
        if parts and isinstance(parts[0][0], slice):
            return parts[0][1]
        result = cls.blank(n)
        result.status[:] = status
        for rows, part in parts:
            result.put(rows, part)
        return result

    def take(self, rows: Positions) -> Self:
        """Select the trajectories at some positions."""
        return type(self)(**{name: getattr(self, name)[rows] for name in self.columns()})


@dataclass(frozen=True)
class CollisionResult(Record):
    """The collisions of impacts by a law, in the contact's own units; arrays of shape (n,).

    `approach_work` and `restitution_work` are twice the works done against the force in the two phases, 1 and
    -e_out^2 up to the solver's error; `chi` is the law's damping ratio and `exact` its restitution in closed form,
    NaN for a law without them.
    """

    statuses = Status

    e_out: Array
    peak: Array
    permanent: Array
    force: Array
    contact_time: Array
    approach_work: Array
    restitution_work: Array
    steps: NDArray[np.int32]
    status: Int8Array
    chi: Array
    exact: Array


def deduplicate(columns: Sequence[AnyArray], shape: tuple[int, ...]) -> tuple[Indices, Indices]:
    """Find the distinct rows of a table, whose columns broadcast to a shape; NaN equals NaN, and -0.0 equals 0.0.

    Returns the flat index of the first of each group of equal rows, shape (groups,), and the number of the group
    of each row, shape (rows,).

    >>> first, group = deduplicate([np.array([[1.0], [2.0]]), np.array([[5.0, 5.0, 7.0]])], (2, 3))
    >>> first.tolist(), group.tolist()
    ([0, 2, 3, 5], [0, 0, 1, 2, 2, 3])
    """
    # columns are combined before they are broadcast, so that an axis along which they do not vary costs nothing
    keys: AnyArray = columns[0] if columns else np.zeros((1,) * len(shape), np.intp)
    for values in columns[1:]:
        keys = _ranks(keys) * values.size + _ranks(values)
    _, first, group = np.unique(np.broadcast_to(keys, shape), return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _ranks(values: AnyArray) -> Indices:
    """Compute the rank of each value among the distinct ones; equal values have equal ranks."""
    return np.unique(values, return_inverse=True)[1].reshape(values.shape)
