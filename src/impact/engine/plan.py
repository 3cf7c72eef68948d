"""A plan: a config with its plug-ins, and the trajectories to integrate for it."""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from .._version import __version__
from ..config.input_names import InputName
from ..config.load import Config
from ..config.tables import Solver
from ..contact.fixed_step import EXACT
from ..contact.friction import FrictionLaw, Pair, check_friction, friction_problems
from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.numba.dispatch import is_installed, serves
from ..contact.status import FrictionStatus
from ..errors import ConfigError, UsageError
from ..formatting import argument
from .inputs import Inputs, build_impacts, build_oblique
from .plugins import Plugins
from .trajectories import (
    MAX_CELLS,
    Columns,
    PlanLaw,
    ReusedPart,
    TrajectoryMap,
    TrajectoryRange,
    build_map,
    columns_at,
    law_axes,
    probe_index,
    trajectory_ranges,
)

# values of a variable up to which layout "auto" stores a result in full; the smaller limit holds where values
# repeat along the axes of other laws
MAX_FULL_POINTS, MAX_FULL_REPEATED = 10**7, 10**6
# trajectories of compiled force laws above which numba is faster, including the time to load it
NUMBA_MIN_TRAJECTORIES = 200_000


@dataclass(frozen=True)
class Plan:
    """A config with the plug-ins that it uses, models that are not built in."""

    config: Config
    plugins: Plugins = field(default_factory=Plugins)
    # of an extended result: the seal of the old one, the attribute `extended`, and whether the new one replaces it
    extends: str = field(default="", kw_only=True)
    history: str = field(default="", kw_only=True)
    replaces: bool = field(default=False, kw_only=True)

    @property
    def models(self) -> tuple[ForceModel, ...]:
        return self.config.models

    @property
    def frictions(self) -> tuple[FrictionLaw, ...]:
        return self.config.frictions

    @cached_property
    def laws(self) -> tuple[PlanLaw, ...]:
        """What trajectories are of: the models, then the pairs of each model with each friction law."""
        return (*self.models, *(Pair(model, friction) for model in self.models for friction in self.frictions))

    @cached_property
    def inputs(self) -> Inputs:
        return Inputs(self.config.scalars, self.config.axes, self.config.materials)

    @cached_property
    def maps(self) -> tuple[TrajectoryMap, ...]:
        """The distinct trajectories of each law."""
        collapse = self.config.solver.collapse
        return tuple(build_map(self.inputs, number, law, collapse) for number, law in enumerate(self.laws))

    @cached_property
    def ranges(self) -> tuple[TrajectoryRange, ...]:
        """The ranges in which the trajectories are integrated."""
        return tuple(trajectory_ranges(self.maps))

    @property
    def trajectories(self) -> int:
        """Number of distinct trajectories of all laws."""
        return sum(trajectory_map.count for trajectory_map in self.maps)

    @cached_property
    def solver(self) -> Solver:
        """The settings of the solver, with "numba" or "numpy" for `core = "auto"`.

        >>> from impact.results.sweep import read_plan
        >>> read_plan("configs/figure6.toml").solver.core
        'numpy'
        """
        solver = self.config.solver
        if solver.core != "auto":
            return solver
        count = sum(trajectory_map.count for trajectory_map in self.maps if self._is_compiled(trajectory_map))
        return replace(solver, core="numba" if is_installed() and count >= NUMBA_MIN_TRAJECTORIES else "numpy")

    def _is_compiled(self, trajectory_map: TrajectoryMap) -> bool:
        """Whether the compiled core integrates a phase of a model, for all of its exponents."""
        law = self.laws[trajectory_map.model]
        # at a given step the continuous law is only integrated where balls do not separate
        if "dt" in self.inputs.names() or isinstance(law, Pair):
            return False
        exponents = np.unique(np.asarray(self.inputs.values("n") if law.exponent is None else law.exponent, float))
        return all(any(serves(law, n)) for n in exponents.tolist())

    def columns_of(self, trajectory_range: TrajectoryRange) -> Columns:
        """Build the dimensionless problems of the trajectories of a range, arrays of its size."""
        trajectory_map = self.maps[trajectory_range.model]
        rows = trajectory_range.rows
        cells = rows if trajectory_map.first is None else trajectory_map.first[rows]
        index_along = trajectory_map.index_along(cells)
        # the other axes are at their first value
        index = tuple(index_along.get(axis, np.zeros(1, np.intp)) for axis in range(len(self.inputs.axes)))
        columns = columns_at(self.inputs, self.laws[trajectory_range.model], trajectory_map.axes, index)
        return {name: np.broadcast_to(values, cells.shape).copy() for name, values in columns.items()}

    def reused(self, trajectory_range: TrajectoryRange) -> ReusedPart:
        """Find the trajectories of a range that are not integrated; see `impact.results.extend.ExtendedPlan`."""
        return np.zeros(trajectory_range.size, bool), trajectory_range.record.blank(0)

    def fill(self, slab: Any) -> None:
        """Replace the values of a slab that are not computed, none here."""

    def check_count(self, most: int, name: str) -> None:
        """Refuse too many trajectories before any array is allocated; `name` is that of the config."""
        if self.points * (1 + len(self.frictions)) <= most:
            return
        axes = (law_axes(self.inputs, law, self.config.solver.collapse) for law in self.laws)
        # with fewer cells, equal ones are found, and the number of trajectories is not known yet
        cells = [math.prod(self.inputs.shape[axis] for axis in of_law) for of_law in axes]
        total = sum(count for count in cells if count > MAX_CELLS)
        if total > most or (total := self.trajectories) > most:
            raise UsageError(
                f"{name}: sweep: got {total:,} trajectories to integrate, expected at most {most:,} "
                f"({argument('max_points')})"
            )

    def pair_notes(self, name: str) -> list[str]:
        """Note each pair that has no meaning at some points; refuse a plan whose pairs have none at all.

        `name` is that of the friction laws in a message.
        """
        problems, combinable = [], not self.frictions
        for law in self.laws[len(self.models) :]:
            assert isinstance(law, Pair)
            parameters = [f"friction.{law.friction.key}.{parameter.name}" for parameter in law.friction.parameters]
            # a force that pulls from the start for some values of its parameters
            if law.model.family == "adhesive":
                parameters += [f"{law.model.key}.{parameter.name}" for parameter in law.model.parameters]
            index = probe_index(self.inputs, {"n", *parameters})
            impacts = build_impacts(self.inputs, law.model, index)
            oblique = build_oblique(self.inputs, impacts, index, law.friction)
            with np.errstate(all="ignore"):
                combinable |= bool((check_friction(law, oblique) != FrictionStatus.NOT_COMBINABLE).any())
                problems += [f"{law.key}: {reason}" for reason in friction_problems(law, oblique)]
        if not combinable:
            raise ConfigError(*(f"{name}: {problem}" for problem in problems))
        return [f"{problem}; these points are NaN" for problem in problems]

    @property
    def sizes(self) -> dict[str, int]:
        """Sizes of the dimensions of the result."""
        laws = {"model": len(self.models), **({"friction": len(self.frictions)} if self.frictions else {})}
        return laws | {axis.name: axis.size for axis in self.config.axes}

    @property
    def points(self) -> int:
        """Points of all models; the axes of parameters of other models and of friction laws do not count."""
        return sum(self.inputs.points_of(model.key) for model in self.models)

    @property
    def stored_points(self) -> int:
        """Values of a variable in the dataset, cells times laws; some repeat along the axes of other laws."""
        return self.inputs.cells * len(self.models) * max(1, len(self.frictions))

    @property
    def layout(self) -> Literal["full", "factored"]:
        """The layout of the result; "auto" is full up to a limit, or if the config sets chunks."""
        output = self.config.output
        most = MAX_FULL_POINTS if self.stored_points == self.points else MAX_FULL_REPEATED
        is_small = output.layout == "auto" and self.stored_points <= most
        return "full" if output.is_full or is_small else "factored"

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
            **({"frictions": [friction.key for friction in config.frictions]} if config.frictions else {}),
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
        used = sorted(frozenset().union(*self.inputs.materials_of.values()))
        return {name: replace(self.config.materials[name], **fixed.get(name, {})) for name in used}

    @property
    def material_record(self) -> dict[str, dict[str, float | None]]:
        """The properties of the materials of the balls, as plain data: None for one that is an axis."""
        return {
            name: {key: None if value != value else value for key, value in asdict(material).items()}
            for name, material in self.materials_used.items()
        }
