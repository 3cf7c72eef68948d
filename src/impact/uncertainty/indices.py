"""Sobol indices of a function from its values at the rows of two sample matrices, with bootstrap intervals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap, sobol_indices

from ..array_types import Array

# resamples of the bootstrap, and its level
RESAMPLES, CONFIDENCE = 200, 0.95


@dataclass(frozen=True)
class Indices:
    """First-order and total indices of several outputs, each of shape (outputs, inputs).

    The ends of their intervals of 95 % are NaN where no bootstrap was asked for.
    """

    first: Array
    total: Array
    first_lower: Array
    first_upper: Array
    total_lower: Array
    total_upper: Array


def mixed_rows(a: Array, b: Array) -> Array:
    """The rows at which a function has to be known: those of A, of B, and of A with each column of B.

    Parameters
    ----------
    a, b : independent samples of the inputs, shape (n, inputs)

    Returns
    -------
    array of shape (n (inputs + 2), inputs)
    """
    mixed = [np.where(np.arange(a.shape[1]) == column, b, a) for column in range(a.shape[1])]
    return np.concatenate([a, b, *mixed])


def indices_of(values: Array, seed: int | None = None) -> Indices:
    """Sobol indices by the estimators of Saltelli and others (2010), as scipy.stats has them.

    Parameters
    ----------
    values : at the rows of `mixed_rows`, shape (outputs, inputs + 2, n), where n is a power of two
    seed : of the bootstrap; None for no intervals

    >>> a, b = np.random.default_rng(1).random((2, 4096, 2))
    >>> x, y = mixed_rows(a, b).T
    >>> indices_of((x + y).reshape(1, 4, 4096)).first.round(1)
    array([[0.5, 0.5]])
    """
    outputs, blocks, n = values.shape

    def estimate(rows: NDArray[np.integer[Any]]) -> Array:
        """First-order and total indices from some of the n rows, shape (2, outputs, inputs)."""
        chosen = values[..., rows]
        of_blocks: dict[Literal["f_A", "f_B", "f_AB"], Array] = {
            "f_A": chosen[:, 0],
            "f_B": chosen[:, 1],
            "f_AB": chosen[:, 2:].transpose(1, 0, 2),
        }
        result = sobol_indices(func=of_blocks, n=n)
        pair = np.stack([result.first_order, result.total_order])
        return np.asarray(pair.reshape(2, outputs, blocks - 2))

    first, total = estimate(np.arange(n))
    lower = upper = np.full((2, *first.shape), np.nan)
    if seed is not None:
        random = np.random.default_rng(seed)
        interval = bootstrap(
            (np.arange(n),),
            estimate,
            method="percentile",
            n_resamples=RESAMPLES,
            confidence_level=CONFIDENCE,
            rng=random,
            batch=1,
        ).confidence_interval
        lower, upper = (np.asarray(end).reshape(lower.shape) for end in (interval.low, interval.high))
    return Indices(first, total, lower[0], upper[0], lower[1], upper[1])
