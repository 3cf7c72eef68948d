"""The inputs of a sweep: scalars and axes, their values at cells of the grid, and the impacts of a law there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..array_types import Array, Indices
from ..config.grid import Axis
from ..config.input_names import InputName, is_foreign
from ..contact.formula_calls import argument_names, call_by_name
from ..contact.friction import FrictionLaw
from ..contact.impacts import Impacts, stiffness as hertz_or_secant
from ..contact.materials import Material, hertz_stiffness, rayleigh_time, sphere_mass, sphere_radius
from ..contact.model import Law
from ..contact.rigid import ObliqueImpacts
from ..contact.simulate import PHASE, STEP, STEPS_PER_CONTACT
from ..errors import ModelError

# the indices of cells along each axis of the grid, in arrays that broadcast against each other
Index = tuple[Indices, ...]


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
    def materials_of(self) -> dict[str, frozenset[str]]:
        """The materials that a ball, "1" or "2", has in any cell."""
        names = {ball: ({"material", f"material{ball}"} & {*self.names()}) for ball in "12"}
        return {
            ball: frozenset(str(value) for name in of_ball for value in np.unique(self.values(name)))
            for ball, of_ball in names.items()
        }


def build_impacts(inputs: Inputs, model: Law, index: Index) -> Impacts:
    """Build the impacts of a model, or of what a file stores of it, at cells of a sweep.

    Arrays have length 1 along axes on which they do not vary.
    """
    names = set(inputs.names())
    missing = np.full((1,) * dimensions(index), np.nan)
    value = partial(input_at, inputs, index=index)
    balls = {f"{name}{ball}": value(f"{name}{ball}") for name in "vmR" for ball in "12"}
    properties = ("E", "nu", "yield_strength")
    materials = {f"{key}{ball}": property_at(inputs, ball, key, index) for key in properties for ball in "12"}
    n = value("n") if model.exponent is None else np.full_like(missing, model.exponent)
    parameters = {parameter.name: value(f"{model.key}.{parameter.name}") for parameter in model.parameters}
    with np.errstate(all="ignore"):
        impacts = Impacts(e=value("e"), K=missing, n=n, parameters=parameters, **balls, **materials)
        for name in (f"{model.key}.K", "K"):
            if name in names:
                return replace(impacts, K=value(name))
        if model.stiffness is None:
            hertz = hertz_stiffness(impacts.E1, impacts.nu1, impacts.E2, impacts.nu2, impacts.R1, impacts.R2)
            return replace(impacts, K=hertz_or_secant(n, hertz, impacts.m, impacts.v0))
        arguments = {name: impacts.quantity(name) for name in argument_names(model.stiffness)}
        shape = np.broadcast_shapes(missing.shape, *(values.shape for values in arguments.values()))
        # formulas receive arrays of one shape (n,)
        flat_arguments = {name: np.broadcast_to(values, shape).reshape(-1) for name, values in arguments.items()}
        K = call_by_name(model.stiffness, flat_arguments)
    if K.shape not in ((), (math.prod(shape),)):
        raise ModelError(f"{model.key}: stiffness returned the shape {K.shape}, expected ({math.prod(shape)},)")
    return replace(impacts, K=np.broadcast_to(K, math.prod(shape)).reshape(shape))


def build_oblique(
    inputs: Inputs, impacts: Impacts, index: Index, friction: FrictionLaw | None = None
) -> ObliqueImpacts:
    """Build the tangential inputs of impacts at cells, with the parameters of a friction law."""
    value = partial(input_at, inputs, index=index)
    u1, u2, tangent = value("u1"), value("u2"), None
    if "angle" in inputs.names():
        tangent = np.tan(value("angle"))
        u2 = u2 if "u2" in inputs.names() else np.zeros_like(tangent)
        u1 = u2 + impacts.v0 * tangent
    names = {} if friction is None else {p.name: f"friction.{friction.key}.{p.name}" for p in friction.parameters}
    return ObliqueImpacts(
        impacts=impacts,
        u1=u1,
        u2=u2,
        **{name: value(name) for name in ("omega1", "omega2", "inertia_factor1", "inertia_factor2", "mu")},
        tangent=tangent,
        parameters={name: value(full_name) for name, full_name in names.items()},
    )


def fixed_steps_at(inputs: Inputs, impacts: Impacts, index: Index) -> dict[str, Array]:
    """Compute the fixed step and the phase at cells, by the names of `simulate`; empty without a scheme."""
    names = inputs.names()
    if "phase" not in names:
        return {}
    phase = {PHASE: input_at(inputs, "phase", index)}
    if "dt" not in names:
        return {STEPS_PER_CONTACT: input_at(inputs, "steps_per_contact", index), **phase}
    with np.errstate(all="ignore"):
        return {STEP: input_at(inputs, "dt", index) / impacts.time, **phase}


def input_at(inputs: Inputs, name: str, index: Index) -> Array:
    """Look up the numbers of an input at cells; one without values follows from others, or is NaN.

    With a speed, v1 = v2 + speed cos(angle) [m/s]. A mass [kg] or a radius [m] is that of a sphere of the other
    one and the density of its material. With alpha, e = 1 - alpha (v1 - v2), equation (24).

    Raises
    ------
    ModelError : the config has neither the mass nor a radius and density to derive it from
    """
    names, ball = inputs.names(), name[-1]
    value = partial(input_at, inputs, index=index)
    if name == "v1" and "speed" in names:
        return value("v2") + value("speed") * (np.cos(value("angle")) if "angle" in names else 1.0)
    if name in names:
        return np.asarray(inputs.column(name, index), float)
    if name == "e":
        return 1.0 - value("alpha") * (value("v1") - value("v2"))
    if name in ("R1", "R2"):
        return sphere_radius(value(f"m{ball}"), property_at(inputs, ball, "rho", index))
    unknown = np.full((1,) * dimensions(index), np.nan)
    if name not in ("m1", "m2"):
        return unknown
    radius = value(f"R{ball}") if f"R{ball}" in names else unknown
    mass = sphere_mass(radius, property_at(inputs, ball, "rho", index))
    if np.isnan(mass).any():
        raise ModelError(f"{name}: missing, expected {name}, or R{ball} and the density rho of its material")
    return mass


def property_at(inputs: Inputs, ball: str, key: str, index: Index) -> Array:
    """Look up a property of a ball's material at cells, such as E [Pa]; NaN where it is unknown."""
    names = inputs.names()
    name = "material" if "material" in names else f"material{ball}"
    if name not in names:
        return np.full((1,) * dimensions(index), np.nan)
    material_of_cell = inputs.column(name, index)
    materials, material_index = np.unique(material_of_cell, return_inverse=True)
    table = np.array([getattr(inputs.materials[str(material)], key) for material in materials], dtype=float)
    values = table[material_index].reshape(material_of_cell.shape)
    for material in sorted(inputs.materials_of[ball]):
        column = f"materials.{material}.{key}"
        # also where no cell has the material: the shape shows along which axes the property of the ball varies
        if column in names:
            values = np.where(material_of_cell == material, input_at(inputs, column, index), values)
    return values


def smaller_radius_at(inputs: Inputs, index: Index) -> Array:
    """Compute the radius of the smaller ball at cells [m]; NaN where it is unknown."""
    return np.fmin(input_at(inputs, "R1", index), input_at(inputs, "R2", index))


def rayleigh_time_at(inputs: Inputs, index: Index) -> Array:
    """Compute the smaller Rayleigh time of the two balls at cells [s]; NaN where none is known."""
    times = []
    for ball in "12":
        mass, radius = (input_at(inputs, f"{name}{ball}", index) for name in "mR")
        with np.errstate(invalid="ignore"):
            density = mass / sphere_mass(radius, np.ones(1))
        E, nu = (property_at(inputs, ball, key, index) for key in ("E", "nu"))
        times.append(rayleigh_time(radius, density, E, nu))
    return np.fmin(*times)


def has_stiffness_rule(inputs: Inputs, model: Law) -> bool:
    """Whether K is computed by a formula of the law: it has one, and the config has no K."""
    return model.stiffness is not None and {"K", f"{model.key}.K"}.isdisjoint(inputs.names())
