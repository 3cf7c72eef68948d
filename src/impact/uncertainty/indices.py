"""Sobol indices of a function from its values at the rows of two sample matrices, with bootstrap intervals.

The estimators are those of Saltelli and others (2010), Computer Physics Communications 181, 259-270, which
`scipy.stats.sobol_indices` has too. Both are functions of means over the rows, so that a resample of the bootstrap
is a product of a matrix of counts with the columns that are averaged.
"""

from __future__ import annotations

import numpy as np

from ..array_types import Array

# resamples of the bootstrap, and its level; with 200 the ends are so uncertain that fewer intervals hold the index
RESAMPLES, CONFIDENCE = 1000, 0.95
# numbers in a block of resamples
MAX_BLOCK = 2**22


def mixed_rows(a: Array, b: Array) -> Array:
    """Stack A, B, and A with each column of B, shape (n, inputs) to (n (inputs + 2), inputs)."""
    mixed = [np.where(np.arange(a.shape[1]) == column, b, a) for column in range(a.shape[1])]
    return np.concatenate([a, b, *mixed])


def indices_of(values: Array, seed: int | None = None) -> dict[str, Array]:
    """Compute Sobol indices, with intervals by the percentiles of a bootstrap over the rows.

    Parameters
    ----------
    values : at the rows of `mixed_rows`, shape (outputs, inputs + 2, n)
    seed : of the bootstrap; None for no intervals

    Returns
    -------
    dict : the indices and the ends of their intervals of 95 % by the name of the variable,
        of shape (outputs, inputs); the ends are NaN without a bootstrap

    >>> a, b = np.random.default_rng(1).random((2, 4096, 2))
    >>> x, y = mixed_rows(a, b).T
    >>> indices_of((x + y).reshape(1, 4, 4096))["first"].round(1)
    array([[0.5, 0.5]])
    """
    n = values.shape[2]
    estimates = np.stack([_indices_from_means(_columns(block).mean(axis=1)) for block in values])
    resampled = np.empty((len(values), 0 if seed is None else RESAMPLES, estimates.shape[1]))
    # not the random numbers of the samples, which have the same seed
    random = np.random.default_rng(None if seed is None else [seed, 1])
    step = max(MAX_BLOCK // n, 1)
    for start in range(0, resampled.shape[1], step):
        drawn = [random.integers(0, n, n) for _ in range(start, min(start + step, RESAMPLES))]
        counts = np.stack([np.bincount(rows, minlength=n) for rows in drawn]) / n
        for block, of_block in zip(values, resampled, strict=True):
            of_block[start : start + step] = _indices_from_means(counts @ _columns(block).T)
    lower = upper = np.full_like(estimates, np.nan)
    if seed is not None:
        ends = 0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE
        # as the indices are, while an estimate may lie outside
        lower, upper = np.clip(np.quantile(resampled, ends, axis=1), 0.0, 1.0)
    return {
        f"{name}{end}": part
        for end, array in (("", estimates), ("_lower", lower), ("_upper", upper))
        for name, part in zip(("first", "total"), np.split(array, 2, axis=1), strict=True)
    }


def _columns(values: Array) -> Array:
    """Build the columns whose means give the indices of one output, shape (3 inputs + 2, n)."""
    a, b, *_ = mixed = values - values[:2].mean()
    change = mixed[2:] - a
    return np.concatenate([b * change, change, 0.5 * change**2, [0.5 * (a * a + b * b), 0.5 * (a + b)]])


def _indices_from_means(means: Array) -> Array:
    """Compute first-order and total indices, shape (..., 2 inputs); zero where the output does not vary."""
    *_, square, mean = np.moveaxis(means, -1, 0)
    first, change, total = np.split(means[..., :-2], 3, axis=-1)
    explained = np.concatenate([first - mean[..., None] * change, total], axis=-1)
    variance = (square - mean * mean)[..., None]
    indices: Array = np.divide(explained, variance, out=np.zeros_like(explained), where=variance > 0.0)
    return indices
