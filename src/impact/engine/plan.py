"""A plan: which impacts a config asks for, and the lanes of any part of them, by index arithmetic."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..contact.material import Material
from ..contact.model import ForceModel
from ..sweeps.config import Config
from ..sweeps.rules import MATERIALS
from .plugins import Plugins

# the places along each axis of some cells of the grid, in arrays that broadcast against each other
Index = tuple[NDArray[np.intp], ...]


def dimensions(index: Index) -> int:
    """How many axes the arrays of an index have; those of a plan without axes have one."""
    return index[0].ndim if index else 1


@dataclass(frozen=True)
class Plan:
    """The grid of a config: the product of its axes, for every model.

    Parameters
    ----------
    config : the config
    plugins : models that are not built in
    """

    config: Config
    plugins: Plugins = field(default_factory=Plugins)

    @property
    def models(self) -> tuple[ForceModel, ...]:
        return self.config.models

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the axes, in config order."""
        return tuple(axis.size for axis in self.config.axes)

    @property
    def grid(self) -> int:
        """Cells of the grid; a point is a cell of one model."""
        return math.prod(self.shape)

    @property
    def points(self) -> int:
        return self.grid * len(self.models)

    def names(self) -> tuple[str, ...]:
        """What the config gives a value to, scalars and axes."""
        swept = (name for axis in self.config.axes for name in axis.columns)
        return (*swept, *self.config.scalars)

    def axes_of(self, name: str) -> tuple[int, ...]:
        """The axes along which a name varies: none for a scalar."""
        return tuple(place for place, axis in enumerate(self.config.axes) if name in axis.columns)

    def column(self, name: str, index: Index) -> NDArray[np.generic]:
        """The values of a name at some cells; of length one along the axes on which it does not vary."""
        if name in self.config.scalars:
            return np.full((1,) * dimensions(index), self.config.scalars[name])
        (place,) = self.axes_of(name)
        return self._columns[name][index[place]]

    def values(self, name: str) -> NDArray[np.generic]:
        """All values of a name: along its axis, or one."""
        return self._columns.get(name, np.asarray(self.config.scalars.get(name)))

    @cached_property
    def _columns(self) -> dict[str, NDArray[np.generic]]:
        return {name: np.asarray(values) for axis in self.config.axes for name, values in axis.columns.items()}

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 over what determines the result: equal fingerprints, equal contents."""
        output = asdict(self.config.output)
        return hashlib.sha256(json.dumps([self.physics, self.config.title, output]).encode()).hexdigest()

    @cached_property
    def physics(self) -> dict[str, object]:
        """What determines the trajectories, as plain data."""
        from .. import __version__

        config = self.config
        return {
            "version": __version__,
            "models": [model.key for model in config.models],
            "scalars": dict(sorted(config.scalars.items())),
            "axes": [{name: list(values) for name, values in axis.columns.items()} for axis in config.axes],
            "materials": {name: asdict(material) for name, material in self.materials_used.items()},
            # not whether impacts are collapsed, which changes nothing
            "solver": {"rtol": config.solver.rtol, "max_steps": config.solver.max_steps},
            "plugins": self.plugins.hashes,
        }

    @property
    def materials_used(self) -> dict[str, Material]:
        """The materials that some ball has, by name."""
        used: set[str] = set()
        for name in MATERIALS:
            if name in self.config.scalars:
                used.add(str(self.config.scalars[name]))
            for place in self.axes_of(name):
                used.update(str(one) for one in self.config.axes[place].columns[name])
        return {name: self.config.materials[name] for name in sorted(used)}
