"""Deduplicate: which impacts are the same dimensionless problem, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def deduplicate(
    columns: Sequence[NDArray[Any]], shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Find the distinct rows of a table, whose columns broadcast to a shape; NaN equals NaN, and -0.0 equals 0.0.

    Returns the flat index of the first of each group of equal rows, shape (groups,), and the number of the group
    of each row, shape (rows,).

    >>> first, group = deduplicate([np.array([[1.0], [2.0]]), np.array([[5.0, 5.0, 7.0]])], (2, 3))
    >>> first.tolist(), group.tolist()
    ([0, 2, 3, 5], [0, 0, 1, 2, 2, 3])
    """
    # columns are combined before they are broadcast, so that an axis along which they do not vary costs nothing
    keys: NDArray[Any] = columns[0] if columns else np.zeros((1,) * len(shape), np.intp)
    for values in columns[1:]:
        keys = _ranks(keys) * values.size + _ranks(values)
    _, first, group = np.unique(np.broadcast_to(keys, shape), return_index=True, return_inverse=True)
    return first, group.reshape(-1)


def _ranks(values: NDArray[Any]) -> NDArray[np.intp]:
    """Compute the rank of each value among the distinct ones; equal values have equal ranks."""
    return np.unique(values, return_inverse=True)[1].reshape(values.shape)
