"""What became of the trajectories of a plan, block by block or those of a model together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..contact.strike import Rebound
from .trajectories import BLOCK, Trajectories, even

Load = Callable[[int], Rebound]


@dataclass(frozen=True)
class Finished:
    """The finished trajectories of a plan, of which no more is held than the points asked for need.

    Parameters
    ----------
    found : the trajectories
    load : the finished block of a number
    size : of a block, at most
    """

    found: Sequence[Trajectories]
    load: Load
    size: int = BLOCK
    # those of the model that was asked for last, where its points share them
    _shared: dict[int, Rebound] = field(default_factory=dict)

    def rows(self, model: int, numbers: NDArray[np.intp]) -> Rebound:
        """Those of a model of some numbers; arrays of their shape."""
        own = self.found[model]
        if own.first is None:
            return self._some(model, numbers.reshape(-1)).take(np.arange(numbers.size).reshape(numbers.shape))
        # any of them may be needed at any time
        if model not in self._shared:
            self._shared.clear()
            self._shared[model] = self._some(model, np.arange(own.count))
        return self._shared[model].take(numbers)

    def _some(self, model: int, numbers: NDArray[np.intp]) -> Rebound:
        """Some trajectories, from one block after the other; no more than these are held."""
        size = even(self.found[model].count, self.size)
        passed = sum(-(-one.count // self.size) for one in self.found[:model])
        some, block = Rebound.blank(numbers.size), numbers // size
        for one in np.unique(block).tolist():
            where = np.flatnonzero(block == one)
            some.put(where, self.load(passed + one).take(numbers[where] - one * size))
        return some
