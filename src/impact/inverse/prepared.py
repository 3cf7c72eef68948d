"""Prepared problems: the outputs of a law as a function of its inputs, without config or file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from ..arguments import name_wrong_types
from ..array_types import AnyArray, Array
from ..config.files import read_number, to_plain_data
from ..config.grid import Axis
from ..config.input_names import InputName
from ..config.load import Config
from ..config.quantities import Quantity
from ..config.tables import MATERIAL_QUANTITIES, law_quantities
from ..contact.fixed_step import EXACT
from ..contact.friction import FrictionLaw, Pair, parameter_problem
from ..contact.interpolant import InterpolatedCollisions
from ..contact.model import ForceModel
from ..contact.output_formulas import Outputs, collide
from ..contact.simulate import ComputeCollisions
from ..contact.variables import CENTRAL_OUTPUTS, OUTPUTS
from ..engine.inputs import Inputs, build_impacts, build_oblique, fixed_steps_at
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..engine.trajectories import PlanLaw, model_of
from ..errors import UsageError, require_known, warn
from ..results.selection import as_keys
from ..results.single_impact import open_source, single_point

# inputs that a config may leave to others: masses and radii follow from each other, K from materials
DERIVED = ("m1", "m2", "R1", "R2", "K")


def interpolated(config: Config, law: PlanLaw, outputs: Sequence[str]) -> InterpolatedCollisions | None:
    """Interpolate the collisions of a law; None with friction, which has kinks."""
    if isinstance(law, Pair):
        return None
    solver = config.solver
    return InterpolatedCollisions(law, outputs, rtol=solver.rtol, max_steps=solver.max_steps, core=solver.core)


def trial_inputs(config: Config, columns: Mapping[str, AnyArray]) -> Inputs:
    """Replace inputs of a config by columns of one length, along the axis of the cells; no column is one cell."""
    size = len(next(iter(columns.values()))) if columns else 1
    scalars = {name: value for name, value in config.scalars.items() if name not in columns}
    # an axis has tuples; arrays are as good for looking up values, and faster
    values: dict[str, Any] = {**columns, "trial": np.arange(size)}
    return Inputs(scalars, (Axis(values, numbered="trial"),), config.materials)


def outputs_at(
    config: Config,
    law: PlanLaw,
    columns: Mapping[str, AnyArray],
    names: Sequence[str],
    compute: ComputeCollisions | None = None,
) -> Outputs:
    """Compute outputs of a law at arrays of inputs by config name, all of one length; others are of a config.

    An output is of that length; NaN where the law has no result. `compute` is that of
    `impact.contact.simulate.simulate`. A warning states each distinct error of the law.
    """
    inputs, model = trial_inputs(config, columns), model_of(law)
    index = inputs.index()
    impacts = build_impacts(inputs, model, index).broadcast()
    steps = fixed_steps_at(inputs, impacts, index)
    errors: dict[str, str] = {}
    outputs = collide(
        law,
        impacts,
        fixed_step={name: np.broadcast_to(values, impacts.n.shape) for name, values in steps.items()},
        errors=errors,
        names=names,
        oblique=build_oblique(inputs, impacts, index, law.friction) if isinstance(law, Pair) else None,
        compute=compute,
        **asdict(config.solver),
    )
    warn(*errors.values())
    return {name: np.broadcast_to(values, inputs.shape) for name, values in outputs.items()}


@dataclass(frozen=True)
class PreparedProblem:
    """The outputs of a law as a function of its inputs; call it with values or arrays of those that change.

    A call takes inputs by config name, numbers or arrays that broadcast against each other, bare or with units;
    a parameter of the law needs no key of it. The others are those of the config, also of what varies together
    there, as in a zip group. It returns a dict of `outputs` and of their statuses: floats, or arrays of the shape
    of the inputs; NaN where the law has no result.

    Parameters
    ----------
    config : of a single impact
    law : the model, or its pair with a friction law
    outputs : names of outputs, such as "e_out"
    """

    config: Config
    law: ForceModel | Pair
    outputs: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<PreparedProblem {self.law.key}>"

    @name_wrong_types
    def __call__(self, values: Mapping[str, Any] | pd.DataFrame | None = None, /, **more: Any) -> dict[str, Any]:
        """Compute the outputs; `values` takes names that are no Python words, such as "materials.steel.E"."""
        read: dict[str, Array] = {}
        # a DataFrame has no truth value
        for name, value in {**({} if values is None else values), **more}.items():
            full_name, column = self._read(name, value)
            if full_name in read:
                raise UsageError(f"{name}: got {full_name} twice, expected it once")
            read[full_name] = column
        if problem := self._stiffness_problem(read):
            raise UsageError(problem)
        try:
            shape = np.broadcast_shapes(*(column.shape for column in read.values()))
        except ValueError:
            shapes = ", ".join(f"{name} {column.shape}" for name, column in read.items())
            raise UsageError(f"got the shapes {shapes}, expected shapes that broadcast") from None
        columns = {name: np.broadcast_to(column, shape).ravel() for name, column in read.items()}
        statuses = (OUTPUTS[name].status for name in self.outputs)
        names = [*dict.fromkeys((*self.outputs, "status", *statuses))]
        collisions = outputs_at(self.config, self.law, columns, names, self._collisions)
        arrays = {name: collisions[name].reshape(shape) for name in names}
        return {name: array.copy() if shape else array.item() for name, array in arrays.items()}

    def _stiffness_problem(self, read: Mapping[str, Array]) -> str:
        """Name what a config with these inputs would have wrong in the tangential stiffness, or return ""."""
        if not isinstance(self.law, Pair):
            return ""
        names = [InputName.parse(name) for name in (*self.config.scalars, *read)]
        of_friction = {name.key for name in names if name.friction}
        n = self.law.model.exponent or (None if "n" in read else float(self.config.scalars["n"]))
        has_stiffness = any(name.key == "K" for name in names)
        return parameter_problem(self.law.friction, of_friction, n=n, has_stiffness=has_stiffness)

    @cached_property
    def _collisions(self) -> InterpolatedCollisions | None:
        """What polynomials replace, from one call to the next."""
        return interpolated(self.config, self.law, self.outputs)

    @cached_property
    def _quantities(self) -> dict[str, tuple[str, Quantity]]:
        """The inputs that a call may have: their names in the config and what they may be, by name."""
        scalars, model = self.config.scalars, model_of(self.law)
        pair = {"friction": self.law.friction} if isinstance(self.law, Pair) else {}
        laws: dict[str, ForceModel | FrictionLaw] = {"model": model, **pair}
        of_laws = [InputName(table, law.key, key) for table, law in laws.items() for key in law_quantities(law)]
        materials = (f"materials.{name}.{key}" for name in self.config.materials for key in MATERIAL_QUANTITIES)
        # what the config has, and what replaces what the law derives from it
        names = (*scalars, *DERIVED, *(() if "alpha" in scalars else ("e",)), *materials)
        inputs = {
            str(name): name.quantity({model.key: model}) for name in (*map(InputName.parse, names), *of_laws)
        }
        known = {name: (name, quantity) for name, quantity in inputs.items() if quantity is not None}
        if model.exponent is not None:
            known.pop("n", None)
        short = {name.key: known[str(name)] for name in of_laws if name.key != "K" or str(name) in scalars}
        return {**known, **short}

    def _read(self, name: str, value: Any) -> tuple[str, Array]:
        """Read the values of an input, with its name in the config."""
        parsed, known = str(InputName.parse(name)), self._quantities
        require_known([] if parsed in known else [name], known, "no input", " of this law")
        full_name, quantity = known[parsed]
        plain, _ = to_plain_data(value)
        try:
            array = np.asarray(plain)
            if array.dtype.kind in "iuf" and quantity.allows(array.min()) and quantity.allows(array.max()):
                return full_name, array.astype(float)
        except ValueError:
            # no value at all, or lists of several lengths
            pass
        items = np.array(plain, object)
        if not items.size:
            raise UsageError(f"{name}: got no value, expected one or more")
        numbers = [read_number(item, quantity, name) for item in items.ravel().tolist()]
        return full_name, np.reshape(numbers, items.shape)


def prepare(
    source: str | Path | Mapping[str, object] | xr.Dataset | None = None,
    *,
    model: str | None = None,
    friction: str | None = None,
    at: Mapping[str, object] | None = None,
    outputs: str | Sequence[str] | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> PreparedProblem:
    """Prepare the outputs of a law as a function of its inputs, for a fit, a sampler or an optimiser.

    Where the motion of the law depends on one dimensionless number, Chebyshev polynomials that agree with the
    integration to 1e-10 replace it from the second call on; elsewhere each call integrates.

    Parameters
    ----------
    source, model, friction, at, overrides, plugins : see `impact.run`
    outputs : names of the outputs to compute; by default all of the law

    Returns
    -------
    PreparedProblem : call it with inputs by name; it returns outputs in SI by name, floats or arrays

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is invalid

    >>> import impact
    >>> problem = impact.prepare(model="gharib-hurmuzlu-2012")
    >>> round(problem(e=0.5)["e_out"], 6), problem(e=[0.25, 0.5])["e_out"].round(6).tolist()
    (0.41072, [0.241279, 0.41072])
    """
    plugin_set = read_plugins(plugins)
    config, _ = single_point(open_source(source, overrides, plugin_set), model, at, friction=friction)
    if config.solver.integrator != EXACT:
        raise UsageError(f'prepare: got the integrator "{config.solver.integrator}", expected "{EXACT}"')
    plan = Plan(config, plugin_set.of(config.models))
    plan.pair_notes("frictions")
    law = plan.laws[-1]
    known = [*CENTRAL_OUTPUTS] if isinstance(law, ForceModel) else [*OUTPUTS]
    known = [name for name in known if OUTPUTS[name].dtype == "f8" and OUTPUTS[name].per_model]
    names = known if outputs is None else as_keys(outputs, "outputs")
    require_known(names, known, "outputs: no output", " of this law")
    return PreparedProblem(replace(config, axes=()), law, tuple(names))
