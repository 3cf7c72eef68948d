"""Deduplicate: which impacts are the same dimensionless problem, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray


def deduplicate(
    columns: Sequence[NDArray[Any]], shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The distinct rows of some columns.

    Parameters
    ----------
    columns : arrays that broadcast to `shape`; two rows are the same where all columns are equal. NaN equals NaN,
        and zero has one sign
    shape : of all rows together

    Returns
    -------
    first : the flat place of the first row of each kind, shape (kinds,)
    kind : for each row the number of its kind, shape (rows,)

    >>> first, kind = deduplicate([np.array([[1.0], [2.0]]), np.array([[5.0, 5.0, 7.0]])], (2, 3))
    >>> first.tolist(), kind.tolist()
    ([0, 2, 3, 5], [0, 0, 1, 2, 2, 3])
    """
    # a column that does not vary along an axis has length one there, and is sorted without it
    keys: NDArray[Any] = columns[0] if columns else np.zeros((1,) * len(shape), np.intp)
    for values in columns[1:]:
        keys = _ranks(keys) * values.size + _ranks(values)
    _, first, kind = np.unique(np.broadcast_to(keys, shape), return_index=True, return_inverse=True)
    return first, kind.reshape(-1)


def _ranks(values: NDArray[Any]) -> NDArray[np.intp]:
    """A number for each value, the same where the values are."""
    return np.unique(values, return_inverse=True)[1].reshape(values.shape)
