"""A plan: which impacts a config asks for, and the lanes of any stretch of them, by index arithmetic."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..contact.lanes import Lanes, stiffness
from ..contact.material import Material, effective_mass, hertz_stiffness, sphere_radius
from ..contact.model import ForceModel
from ..contact.power import Array
from .config import Config
from .plugins import Plugins
from .rules import MATERIALS

# lanes of a block: enough to pay for the interpreter, few enough to stay in cache
BLOCK = 8192


@dataclass(frozen=True)
class Block:
    """A stretch of the grid's points, in C order, for one model; numbers only, so that it can be sent anywhere."""

    model: int
    start: int
    stop: int


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

    def blocks(self, size: int = BLOCK) -> Iterator[Block]:
        """All points in order, in blocks of at most `size`."""
        for model in range(len(self.models)):
            for start in range(0, self.grid, size):
                yield Block(model, start, min(start + size, self.grid))

    def names(self) -> tuple[str, ...]:
        """What the config gives a value to, scalars and axes."""
        swept = (name for axis in self.config.axes for name in axis.columns)
        return (*swept, *self.config.scalars)

    def axes_of(self, name: str) -> tuple[int, ...]:
        """The axes along which a name varies: none for a scalar."""
        return tuple(place for place, axis in enumerate(self.config.axes) if name in axis.columns)

    def column(self, name: str, start: int, stop: int) -> NDArray[np.generic]:
        """The values of a name at a stretch of the grid, shape (stop - start,)."""
        if name in self.config.scalars:
            return np.full(stop - start, self.config.scalars[name])
        (place,) = self.axes_of(name)
        inner = math.prod(self.shape[place + 1 :])
        index = np.arange(start, stop) // inner % self.shape[place]
        return np.asarray(self.config.axes[place].columns[name])[index]

    def lanes(self, model: ForceModel, start: int, stop: int) -> Lanes:
        """The impacts of a model at a stretch of the grid."""
        given = set(self.names())
        missing = np.full(stop - start, np.nan)

        def value(name: str) -> Array:
            return np.asarray(self.column(name, start, stop), float) if name in given else missing

        def of_material(ball: str, field: str) -> Array:
            name = "material" if "material" in given else f"material{ball}"
            if name not in given:
                return missing
            table = {key: getattr(material, field) for key, material in self.config.materials.items()}
            chosen, where = np.unique(self.column(name, start, stop), return_inverse=True)
            return np.array([table[str(key)] for key in chosen], dtype=float)[where]

        v1, v2, m1, m2 = (value(name) for name in ("v1", "v2", "m1", "m2"))
        E1, E2, nu1, nu2 = (of_material(ball, field) for field in ("E", "nu") for ball in "12")
        R1, R2 = (
            value(f"R{ball}") if f"R{ball}" in given else sphere_radius(mass, of_material(ball, "rho"))
            for ball, mass in (("1", m1), ("2", m2))
        )
        n = value("n") if model.exponent is None else np.full(stop - start, model.exponent)
        with np.errstate(all="ignore"):
            own_K = f"{model.key}.K"
            if own_K in given or "K" in given:
                K = value(own_K if own_K in given else "K")
            else:
                K = stiffness(n, hertz_stiffness(E1, nu1, E2, nu2, R1, R2), effective_mass(m1, m2), v1 - v2)
            e = value("e") if "e" in given else 1.0 - value("alpha") * (v1 - v2)
        own = {parameter.name: value(f"{model.key}.{parameter.name}") for parameter in model.parameters}
        return Lanes(
            e=e, v1=v1, v2=v2, m1=m1, m2=m2, K=K, n=n, R1=R1, R2=R2, E1=E1, nu1=nu1, E2=E2, nu2=nu2,
            yield_strength1=of_material("1", "yield_strength"), yield_strength2=of_material("2", "yield_strength"),
            parameters=own,
        )  # fmt: skip

    @cached_property
    def fingerprint(self) -> str:
        """SHA-256 over what determines the result: equal fingerprints, equal contents."""
        from .. import __version__

        config = self.config
        effective = {
            "version": __version__,
            "title": config.title,
            "models": [model.key for model in config.models],
            "scalars": dict(sorted(config.scalars.items())),
            "axes": [{name: list(values) for name, values in axis.columns.items()} for axis in config.axes],
            "materials": {name: asdict(material) for name, material in self.materials_used.items()},
            # not whether impacts are collapsed, which changes nothing
            "solver": {"rtol": config.solver.rtol, "max_steps": config.solver.max_steps},
            "variables": config.variables,
            "plugins": self.plugins.hashes,
        }
        return hashlib.sha256(json.dumps(effective).encode()).hexdigest()

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
