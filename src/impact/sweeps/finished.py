"""What became of the trajectories of a plan, block by block or those of a model together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields

import numpy as np
from numpy.typing import NDArray

from ..contact.strike import Rebound
from .trajectories import BLOCK, Trajectories

Load = Callable[[int], Rebound]


@dataclass(frozen=True)
class Finished:
    """The finished trajectories of a plan, of which no more is held than the points asked for need.

    Parameters
    ----------
    found : the trajectories
    load : the finished block of a number
    size : of a block
    """

    found: Sequence[Trajectories]
    load: Load
    size: int = BLOCK
    # what was asked for last, by model and blocks, since points are asked for in order
    _held: dict[tuple[int, tuple[int, ...]], Rebound] = field(default_factory=dict)

    def rows(self, model: int, numbers: NDArray[np.intp]) -> Rebound:
        """Those of a model of some numbers; arrays of their shape."""
        own = self.found[model]
        # where points share trajectories, any of them may be needed at any time
        blocks = (
            np.arange(-(-own.count // self.size)) if own.first is not None else np.unique(numbers // self.size)
        )
        key = (model, tuple(blocks.tolist()))
        if key not in self._held:
            passed = sum(-(-one.count // self.size) for one in self.found[:model])
            joined = _joined([self.load(passed + block) for block in key[1]])
            self._held.clear()
            self._held[key] = joined
        return self._held[key].take(
            np.searchsorted(blocks, numbers // self.size) * self.size + numbers % self.size
        )


def _joined(parts: Sequence[Rebound]) -> Rebound:
    names = [one.name for one in fields(Rebound)]
    return Rebound(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
