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
    # what was asked for last, by model and blocks, since points are asked for in order
    _held: dict[tuple[int, tuple[int, ...]], Rebound] = field(default_factory=dict)

    def rows(self, model: int, numbers: NDArray[np.intp]) -> Rebound:
        """Those of a model of some numbers; arrays of their shape."""
        own = self.found[model]
        size = even(own.count, self.size)
        block = numbers // size
        # where points share trajectories, any of them may be needed at any time
        blocks = np.unique(block) if own.first is None else np.arange(-(-own.count // size))
        key = (model, tuple(blocks.tolist()))
        if key not in self._held:
            passed = sum(-(-one.count // self.size) for one in self.found[:model])
            # what was held goes before what takes its place is made
            self._held.clear()
            joined = Rebound.blank(blocks.size * size)
            for place, one in enumerate(key[1]):
                part = self.load(passed + one)
                joined.put(np.arange(part.status.size) + place * size, part)
            self._held[key] = joined
        return self._held[key].take(np.searchsorted(blocks, block) * size + numbers % size)
