"""The inputs of a sweep: scalars and axes, and their values at cells of the grid by index arithmetic."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..config.grid import Axis
from ..config.input_names import InputName, is_foreign
from ..contact.materials import Material

# the indices of cells along each axis of the grid, in arrays that broadcast against each other
Index = tuple[NDArray[np.intp], ...]


def dimensions(index: Index) -> int:
    """Number of dimensions of the arrays of an index; one for a plan without axes."""
    return index[0].ndim if index else 1


def index_of(cells: NDArray[np.integer], shape: Sequence[int]) -> Index:
    """Convert numbers of cells, in C order, to indices along each axis; an empty index for a plan without axes."""
    return np.unravel_index(cells, shape) if shape else ()


class Column(NamedTuple):
    """An input: the axes along which it varies, none for a scalar, and its values over them."""

    axes: tuple[int, ...]
    values: NDArray[np.generic]


@dataclass(frozen=True)
class Inputs:
    """The inputs of a sweep: scalars by config name, and the axes of its grid in config order.

    `stiffness` has K of the laws of a file that have a rule for it, by its config name, such as "kratos-linear.K".
    """

    scalars: Mapping[str, float | str]
    axes: tuple[Axis, ...]
    materials: Mapping[str, Material]
    stiffness: Mapping[str, Column] = field(default_factory=dict)

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the axes, in config order."""
        return tuple(axis.size for axis in self.axes)

    @property
    def cells(self) -> int:
        """Number of cells of the grid; cells that differ only in parameters of other models are one point."""
        return math.prod(self.shape)

    def axes_of_law(self, model: str, friction: str = "") -> tuple[int, ...]:
        """List the axes along which the points of a model or pair lie: not those of other laws' parameters."""
        return tuple(n for n, axis in enumerate(self.axes) if not is_foreign(axis.columns, model, friction))

    def points_of(self, model: str, friction: str = "") -> int:
        """Number of points of a model, or of its pair with a friction law."""
        return math.prod(self.shape[axis] for axis in self.axes_of_law(model, friction))

    def names(self) -> tuple[str, ...]:
        """List all config names that have a value, those of axes first."""
        return tuple(self._columns)

    def axes_of(self, name: str) -> tuple[int, ...]:
        """List the axes along which a name varies: none for a scalar."""
        return self._columns[name].axes if name in self._columns else ()

    def column(self, name: str, index: Index) -> NDArray[np.generic]:
        """Look up the values of a name at cells; of length 1 along the axes on which it does not vary."""
        axes, values = self._columns[name]
        at_cells = values[tuple(index[axis] for axis in axes)]
        return at_cells if axes else at_cells.reshape((1,) * dimensions(index))

    def values(self, name: str) -> NDArray[np.generic]:
        """Look up all values of a name: those of its axis, or a single one, None for a name without a value."""
        if name in self._columns:
            return self._columns[name].values
        parsed = InputName.parse(name)
        material = self.materials.get(parsed.material)
        return np.asarray(None if material is None else getattr(material, parsed.key))

    def materials_of(self, ball: str) -> frozenset[str]:
        """List the materials that a ball, "1" or "2", has in any cell."""
        return self._ball_materials[ball]

    def index(self, slices: Sequence[slice] | None = None) -> Index:
        """Index a part of the grid, one array along each axis; by default of the whole grid."""
        slices = [slice(None)] * len(self.axes) if slices is None else slices
        return np.ix_(*(np.arange(size)[cells] for size, cells in zip(self.shape, slices, strict=True)))

    @cached_property
    def _columns(self) -> dict[str, Column]:
        columns = {
            name: Column((number,), np.asarray(values))
            for number, axis in enumerate(self.axes)
            for name, values in axis.columns.items()
        }
        scalars = {name: Column((), np.asarray(value)) for name, value in self.scalars.items()}
        return {**columns, **scalars, **self.stiffness}

    @cached_property
    def _ball_materials(self) -> dict[str, frozenset[str]]:
        names = {ball: ({"material", f"material{ball}"} & {*self.names()}) for ball in "12"}
        return {
            ball: frozenset(str(value) for name in of_ball for value in np.unique(self.values(name)))
            for ball, of_ball in names.items()
        }
