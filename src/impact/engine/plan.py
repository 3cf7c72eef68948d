"""A plan: the impacts of a config, by index arithmetic on the axes of its grid."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .._version import __version__
from ..config.input_names import InputName, is_foreign
from ..config.load import Axis, Config
from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.timestep import EXACT
from .plugins import Plugins

# values of a variable up to which layout "auto" stores a result in full; the smaller limit holds where values
# repeat along the axes of other laws
MAX_FULL_POINTS, MAX_FULL_REPEATED = 10**7, 10**6

# the indices of cells along each axis of the grid, in arrays that broadcast against each other
Index = tuple[NDArray[np.intp], ...]


def dimensions(index: Index) -> int:
    """Number of dimensions of the arrays of an index; one for a plan without axes."""
    return index[0].ndim if index else 1


@dataclass(frozen=True)
class Inputs:
    """The inputs of a sweep: scalars by config name, and the axes of its grid in config order."""

    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    materials: Mapping[str, Material]

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the axes."""
        return tuple(axis.size for axis in self.axes)

    @property
    def cells(self) -> int:
        """Number of cells of the grid; cells that differ only in parameters of other models are one point."""
        return math.prod(self.shape)

    def axes_of_model(self, key: str) -> tuple[int, ...]:
        """List the axes along which the points of a model lie: all but those of other models' parameters."""
        return tuple(number for number, axis in enumerate(self.axes) if not is_foreign(axis.columns, key))

    def points_of(self, key: str) -> int:
        """Number of points of a model."""
        return math.prod(self.shape[axis] for axis in self.axes_of_model(key))

    def names(self) -> tuple[str, ...]:
        """List all config names that have a value, those of axes first."""
        return (*(name for axis in self.axes for name in axis.columns), *self.scalars)

    def axes_of(self, name: str) -> tuple[int, ...]:
        """List the axes along which a name varies: none for a scalar."""
        return tuple(number for number, axis in enumerate(self.axes) if name in axis.columns)

    def column(self, name: str, index: Index) -> NDArray[np.generic]:
        """Look up the values of a name at cells; of length 1 along the axes on which it does not vary."""
        if name in self.scalars:
            return np.full((1,) * dimensions(index), self.scalars[name])
        (number,) = self.axes_of(name)
        return self._arrays[name][index[number]]

    def values(self, name: str) -> NDArray[np.generic]:
        """Look up all values of a name: those of its axis, or a single one, None for a name without a value."""
        if name in self._arrays:
            return self._arrays[name]
        parsed = InputName.parse(name)
        material = self.materials.get(parsed.material)
        constant = getattr(material, parsed.key) if material is not None else None
        return np.asarray(self.scalars.get(name, constant))

    def materials_of(self, ball: str) -> frozenset[str]:
        """List the materials that a ball, "1" or "2", has in any cell."""
        return self._ball_materials[ball]

    def index(self, slices: Sequence[slice] | None = None) -> Index:
        """Index a part of the grid, one array along each axis; by default of the whole grid."""
        slices = [slice(None)] * len(self.axes) if slices is None else slices
        return np.ix_(*(np.arange(size)[cells] for size, cells in zip(self.shape, slices, strict=True)))

    @cached_property
    def _arrays(self) -> dict[str, NDArray[np.generic]]:
        return {name: np.asarray(values) for axis in self.axes for name, values in axis.columns.items()}

    @cached_property
    def _ball_materials(self) -> dict[str, frozenset[str]]:
        names = {ball: ({"material", f"material{ball}"} & {*self.names()}) for ball in "12"}
        return {
            ball: frozenset(str(value) for name in of_ball for value in np.unique(self.values(name)))
            for ball, of_ball in names.items()
        }


@dataclass(frozen=True)
class Plan:
    """A config with the plug-ins that it uses, models that are not built in."""

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
        """Points of all models; the axes of parameters of other models do not count."""
        return sum(self.inputs.points_of(model.key) for model in self.models)

    @property
    def stored_points(self) -> int:
        """Values of a variable in the dataset, cells times models; they repeat along the axes of other models."""
        return self.inputs.cells * len(self.models)

    @property
    def layout(self) -> Literal["full", "factored"]:
        """The layout of the result; "auto" is full up to a limit, or if the config sets chunks."""
        output = self.config.output
        if output.layout == "auto":
            most = MAX_FULL_POINTS if self.stored_points == self.points else MAX_FULL_REPEATED
            return "full" if output.chunks or self.stored_points <= most else "factored"
        return output.layout

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 over everything that determines the result: equal fingerprints mean equal contents."""
        output = asdict(self.config.output)
        return hashlib.sha256(json.dumps([self.physics, self.config.title, output]).encode()).hexdigest()

    @cached_property
    def physics(self) -> dict[str, object]:
        """Everything that determines the trajectories, as plain data."""
        config = self.config
        return {
            "version": __version__,
            "models": [model.key for model in config.models],
            "scalars": dict(sorted(config.scalars.items())),
            "axes": [
                ({axis.name: list(axis.labels)} if axis.numbered else {})
                | {name: list(values) for name, values in axis.columns.items()}
                for axis in config.axes
            ],
            "materials": self.material_record,
            # without `collapse`, which changes no value
            "solver": {
                "rtol": config.solver.rtol,
                "max_steps": config.solver.max_steps,
                **({} if config.solver.integrator == EXACT else {"integrator": config.solver.integrator}),
            },
            "plugins": self.plugins.hashes,
        }

    @property
    def materials_used(self) -> dict[str, Material]:
        """The materials of the balls by name; properties that are axes are NaN for E and nu, otherwise None."""
        fixed: dict[str, dict[str, float]] = {}
        for name, value in self.config.scalars.items():
            if (parsed := InputName.parse(name)).material:
                fixed.setdefault(parsed.material, {})[parsed.key] = float(value)
        used = sorted(self.inputs.materials_of("1") | self.inputs.materials_of("2"))
        return {name: replace(self.config.materials[name], **fixed.get(name, {})) for name in used}

    @property
    def material_record(self) -> dict[str, dict[str, float | None]]:
        """The properties of the materials of the balls, as plain data: None for one that is an axis."""
        return {
            name: {key: None if value != value else value for key, value in asdict(material).items()}
            for name, material in self.materials_used.items()
        }
