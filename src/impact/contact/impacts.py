"""The impacts of a batch: the inputs of a law in SI, and the contact's own units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property

import numpy as np

from ..array_types import Array, Indices, Int8Array, Mask
from .closed_forms.hysteresis import peak_indentation
from .materials import effective_compliance, effective_mass, effective_radius
from .model import ForceModel, Law
from .powers import powers, replace_where
from .status import Status
from .units import dimension

# checks of an impact before it is integrated, see `check_inputs`
CHECKS = frozenset({"e", "v0", "length"})


@dataclass(frozen=True)
class Impacts:
    """A batch of impacts; every field is an array of shape (n,).

    The fields of impacts on a grid may have several axes and broadcast against each other: a field that does not
    vary along an axis has length one there, so that nothing is computed twice.

    Parameters
    ----------
    e : required restitution [-]; NaN for none
    v1, v2 : velocities before the impact [m/s]
    m1, m2 : masses [kg]; infinity is a wall
    R1, R2 : radii [m]; infinity is a plane; NaN where unknown
    K : contact stiffness [N/m^n]
    n : compliance exponent [-]
    E1, nu1, yield_strength1, E2, nu2, yield_strength2 : materials [Pa, -, Pa]; NaN where unknown
    parameters : the law's own parameters by name, in the units it declares
    """

    e: Array
    v1: Array
    v2: Array
    m1: Array
    m2: Array
    K: Array
    n: Array
    R1: Array
    R2: Array
    E1: Array
    nu1: Array
    yield_strength1: Array
    E2: Array
    nu2: Array
    yield_strength2: Array
    parameters: Mapping[str, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.e)

    def __getitem__(self, chosen: Mask | Indices) -> Impacts:
        return self.changed(lambda name, array: array[chosen])

    def changed(self, change: Callable[[str, Array], Array]) -> Impacts:
        """Replace each input and parameter by a function of its name and its values."""
        arrays = {name: change(name, getattr(self, name)) for name in INPUTS}
        return Impacts(**arrays, parameters={name: change(name, array) for name, array in self.parameters.items()})

    @classmethod
    def joined(cls, batches: Sequence[Impacts]) -> Impacts:
        """Make one batch of several by the same law."""
        return batches[0].changed(lambda name, _: np.concatenate([batch.quantity(name) for batch in batches]))

    def broadcast(self, shape: tuple[int, ...] | None = None) -> Impacts:
        """Give every field a shape, by default that of all of them."""
        shape = self.shape if shape is None else shape
        return self.changed(lambda name, array: np.broadcast_to(array, shape))

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """The shape to which all fields broadcast."""
        shapes = {getattr(self, name).shape for name in INPUTS}
        return np.broadcast_shapes(*shapes.union(array.shape for array in self.parameters.values()))

    @cached_property
    def v0(self) -> Array:
        """Closing speed v1 - v2 [m/s]."""
        return self.v1 - self.v2

    @cached_property
    def m(self) -> Array:
        """Effective mass [kg], equation (17)."""
        return effective_mass(self.m1, self.m2)

    @cached_property
    def R_eff(self) -> Array:
        """Effective radius [m], 1/(1/R1 + 1/R2); NaN where a radius is unknown."""
        return effective_radius(self.R1, self.R2)

    @cached_property
    def E_eff(self) -> Array:
        """Effective modulus [Pa], 1/((1 - nu1^2)/E1 + (1 - nu2^2)/E2); NaN where a material is unknown."""
        return 1.0 / effective_compliance(self.E1, self.nu1, self.E2, self.nu2)

    @cached_property
    def Y_min(self) -> Array:
        """Yield strength [Pa] of the softer ball; NaN where one is unknown."""
        return np.minimum(self.yield_strength1, self.yield_strength2)

    @cached_property
    def length(self) -> Array:
        """The contact's unit of length [m], (m v0^2/K)^(1/(n+1)); its unit of mass is m."""
        return powers(self.m * self.v0 / self.K * self.v0, 1.0 / (self.n + 1.0))

    @cached_property
    def time(self) -> Array:
        """The contact's unit of time [s], length/v0."""
        return self.length / self.v0

    @cached_property
    def energy(self) -> Array:
        """The contact's unit of energy [J], m v0^2, twice the energy of the relative motion."""
        return self.m * self.v0 * self.v0

    def quantity(self, name: str) -> Array:
        """Return a quantity of the contact or a parameter of the law, in SI."""
        return np.asarray(self.parameters[name] if name in self.parameters else getattr(self, name))

    def dimensionless(self, model: ForceModel, name: str) -> Array:
        """Compute a quantity or parameter in the contact's own units, in which K = m = v0 = 1."""
        return self.in_own_units(self.quantity(name), model.unit_of(name))

    def in_own_units(self, value: Array, unit: str) -> Array:
        """Convert a value from a unit, such as "N/m^n", to the contact's own units."""
        for own_unit, exponent in own_unit_exponents(unit, {"n": self.n, **self.parameters}).items():
            if np.any(exponent):
                value = value / powers(getattr(self, own_unit), np.asarray(exponent))
        # adding zero turns -0.0 into 0.0, which is the same physics
        return value + 0.0


# names of the inputs of an impact that do not belong to one law
INPUTS = tuple(field.name for field in fields(Impacts) if field.name != "parameters")


def own_unit_exponents(unit: str, exponent_values: Mapping[str, Array | float]) -> dict[str, Array | float]:
    """Compute the exponents of m, length and v0 in the contact's own unit of what has a unit in SI.

    >>> own_unit_exponents("Pa", {})
    {'m': 1.0, 'length': -3.0, 'v0': 2.0}
    """
    mass, length, time = dimension(unit, exponent_values)
    return {"m": mass + 0.0, "length": length + time + 0.0, "v0": 0.0 - time}


def stiffness(n: Array, hertz: Array, m: Array, v0: Array) -> Array:
    """Compute the default K [N/m^n]: Hertz's for n = 3/2, else K = F_m/delta_m^n at the peak by Hertz; shape (n,).

    For n = 1 that is the secant stiffness. It depends on the closing speed `v0` [m/s] and is NaN where that is not
    positive. `hertz` is the stiffness of equation (12) [N/m^1.5], `m` the effective mass [kg].
    """
    if (n == 1.5).all():
        return hertz
    peak = peak_indentation(m, np.where(v0 > 0.0, v0, np.nan), hertz, 1.5)
    return np.where(n == 1.5, hertz, hertz * powers(peak, np.asarray(1.5)) / powers(peak, n))


def check_inputs(model: Law, impacts: Impacts, checks: frozenset[str] = CHECKS) -> Int8Array:
    """Check "e" (the restitution), "v0" (the closing speed) or "length" (the derived m, K, length, energy, time).

    Returns the status before integration, of a shape that broadcasts to that of the impacts.
    """
    status, least = np.asarray(Status.OK, np.int8), np.nextafter(0.0, 1.0)
    # values, their bounds, and the status where they are not within these; the last one counts
    bounds: list[tuple[Array, float, float, Status]] = []
    if "length" in checks:
        sizes = [impacts.m, impacts.K, impacts.length, impacts.energy, impacts.time]
        bounds += [(size, least, np.finfo(float).max, Status.OUT_OF_RANGE) for size in sizes]
    if "e" in checks and "e" in model.quantities:
        bounds.append((impacts.e, 0.0, 1.0, Status.INVALID_PARAMETER))
    if "v0" in checks or "length" in checks:
        bounds.append((impacts.v0, least, np.inf, Status.NO_IMPACT))
    for values, lower, upper, otherwise in bounds:
        status = replace_where(status, ~((values >= lower) & (values <= upper)), np.int8(otherwise))
    return status.astype(np.int8)
