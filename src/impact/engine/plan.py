"""A plan: which impacts a config asks for, by index arithmetic on the axes of its grid."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..contact.material import Material
from ..contact.model import ForceModel
from ..sweeps.config import Axis, Config
from ..sweeps.rules import MATERIALS
from .plugins import Plugins

# points up to which a result is stored in full where nothing else is said
MAX_FULL_POINTS = 10**7

# the places along each axis of some cells of the grid, in arrays that broadcast against each other
Index = tuple[NDArray[np.intp], ...]


def dimensions(index: Index) -> int:
    """How many axes the arrays of an index have; those of a plan without axes have one."""
    return index[0].ndim if index else 1


@dataclass(frozen=True)
class Inputs:
    """What a sweep gives a value to: scalars, and the axes of its grid.

    Parameters
    ----------
    scalars : by config name
    axes : the dimensions of the grid in config order
    materials : by name
    """

    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    materials: Mapping[str, Material]

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the axes."""
        return tuple(axis.size for axis in self.axes)

    @property
    def cells(self) -> int:
        """Cells of the grid; a point is a cell of one model."""
        return math.prod(self.shape)

    def names(self) -> tuple[str, ...]:
        """All names that have a value, those of axes first."""
        return (*(name for axis in self.axes for name in axis.columns), *self.scalars)

    def axes_of(self, name: str) -> tuple[int, ...]:
        """The axes along which a name varies: none for a scalar."""
        return tuple(place for place, axis in enumerate(self.axes) if name in axis.columns)

    def column(self, name: str, index: Index) -> NDArray[np.generic]:
        """The values of a name at some cells; of length one along the axes on which it does not vary."""
        if name in self.scalars:
            return np.full((1,) * dimensions(index), self.scalars[name])
        (place,) = self.axes_of(name)
        return self._columns[name][index[place]]

    def values(self, name: str) -> NDArray[np.generic]:
        """All values of a name: along its axis, or one."""
        return self._columns.get(name, np.asarray(self.scalars.get(name)))

    def index(self, where: Sequence[slice] | None = None) -> Index:
        """The places of a part of the grid, one array along each axis; by default of the whole grid."""
        parts = [slice(None)] * len(self.axes) if where is None else where
        return np.ix_(*(np.arange(size)[part] for size, part in zip(self.shape, parts, strict=True)))

    @cached_property
    def _columns(self) -> dict[str, NDArray[np.generic]]:
        return {name: np.asarray(values) for axis in self.axes for name, values in axis.columns.items()}


@dataclass(frozen=True)
class Plan:
    """What is to be run: the inputs of a config, for every model.

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

    @cached_property
    def inputs(self) -> Inputs:
        return Inputs(self.config.scalars, self.config.axes, self.config.materials)

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the axes, in config order."""
        return self.inputs.shape

    @property
    def points(self) -> int:
        """Cells of the grid times models."""
        return self.inputs.cells * len(self.models)

    @property
    def layout(self) -> Literal["full", "factored"]:
        """How the result is stored: by default in full up to 10^7 points, or where chunks are asked for."""
        output = self.config.output
        if output.layout == "auto":
            return "full" if output.chunks or self.points <= MAX_FULL_POINTS else "factored"
        return output.layout

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
            for place in self.inputs.axes_of(name):
                used.update(str(one) for one in self.config.axes[place].columns[name])
        return {name: self.config.materials[name] for name in sorted(used)}
