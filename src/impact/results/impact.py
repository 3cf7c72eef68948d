"""One impact by one model, followed through time."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from ..contact.force_expressions import returning, stiffer
from ..contact.history import History, follow
from ..contact.impacts import Impacts
from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.outputs import collide
from ..contact.status import Status
from ..engine.build_impacts import build_impacts
from ..engine.plan import Plan
from .history import history_dataset

# name, unit, meaning of what follows from the inputs and the motion of one impact
DERIVED = (
    ("m1", "kg", "mass of ball 1"),
    ("m2", "kg", "mass of ball 2"),
    ("R1", "m", "radius of ball 1"),
    ("R2", "m", "radius of ball 2"),
    ("m", "kg", "effective mass (17)"),
    ("K_r", "N m-n", "unloading stiffness (42)"),
    ("tau_c", "N s", "impulse of the approach"),
    ("tau_r", "N s", "impulse of the restitution"),
    ("W_c", "J", "work of the approach (38)"),
    ("W_r", "J", "work of the restitution (39)"),
    ("rebound_speed_bound", "m s-1", "K/lambda, bound of the rebound speed (26)"),
)


@dataclass(frozen=True)
class Impact:
    """One impact by one model.

    Parameters
    ----------
    model : the model
    point : the inputs by their config names; a name in `first` is an axis of the source at its first value
    values : the outputs under the names of the result file, in SI
    materials : those of the balls, by name
    derived : the quantities of DERIVED by name, in SI; NaN where one does not apply
    exponent : compliance exponent n of the law
    damping : damping factor lambda = chi K/v0 [N s/m^(n+1)], NaN where the law has none
    e_kinematic, e_kinetic, e_energetic : restitution from velocities, impulses and works, equations (1) to (3);
        the last two by quadrature of the force over the history, 0 where the balls stay together
    history : the time history as a dataset over t, or None where there is no motion to follow
    """

    model: ForceModel
    point: Mapping[str, float | str]
    first: tuple[str, ...]
    values: Mapping[str, float]
    materials: Mapping[str, Material]
    derived: Mapping[str, float]
    exponent: float
    closing_speed: float
    damping: float
    e_kinematic: float
    e_kinetic: float
    e_energetic: float
    history: xr.Dataset | None

    @property
    def status(self) -> Status:
        return Status(int(self.values["status"]))


def impact_of(plan: Plan, first: tuple[str, ...], times: int | None = None) -> Impact:
    """The only impact of a plan; `first` are axes of its source that are at their first value.

    `times` is how many points in time its history has, see `impact.contact.history.follow`.
    """
    config = plan.config
    law = config.models[0]
    impacts = build_impacts(plan.inputs, law, ())
    solver = config.solver
    errors: dict[str, str] = {}
    collision = collide(law, impacts, rtol=solver.rtol, max_steps=solver.max_steps, errors=errors)
    values = {name: array[0].item() for name, array in collision.items()}
    for error in errors.values():
        warnings.warn(error, stacklevel=2)
    going = values["status"] == Status.OK
    history = follow(law, impacts, rtol=solver.rtol, max_steps=solver.max_steps, times=times) if going else None
    v0 = impacts.v0[0].item()
    # a law may have an n of its own, in place of the one given
    point = {**config.scalars, "n": impacts.n[0].item()}
    if "alpha" in config.scalars:
        point["e"] = impacts.e[0].item()
    without_history = 0.0 if values["status"] == Status.LIMIT else math.nan
    return Impact(
        model=law,
        point=point,
        first=first,
        values=values,
        materials=plan.materials_used,
        derived=_derived(law, impacts, values, history),
        exponent=impacts.n[0].item(),
        closing_speed=v0,
        damping=values["lambda"],
        e_kinematic=(values["v2_post"] - values["v1_post"]) / v0 if v0 > 0.0 else float("nan"),
        e_kinetic=history.e_kinetic if history else without_history,
        e_energetic=history.e_energetic if history else without_history,
        history=history_dataset(history, law.key, point) if history else None,
    )


def _derived(
    law: ForceModel, impacts: Impacts, values: Mapping[str, float], history: History | None
) -> dict[str, float]:
    """The quantities of DERIVED."""
    found = {name: getattr(impacts, name)[0].item() for name in ("m1", "m2", "R1", "R2", "m")}
    if law.unloading in (returning, stiffer) and values["status"] in (Status.OK, Status.LIMIT):
        recovered = values["peak_indentation"] - values["permanent_indentation"]
        found["K_r"] = values["peak_force"] / recovered ** impacts.n[0].item() if recovered else math.inf
    if history is not None:
        found |= {name: getattr(history, name) for name in ("tau_c", "tau_r", "W_c", "W_r")}
    elif values["status"] == Status.LIMIT:
        # all that the balls bring is taken from them, and nothing given back
        found["tau_c"], found["W_c"] = (impacts.m * impacts.v0)[0].item(), 0.5 * impacts.energy[0].item()
        found["tau_r"] = found["W_r"] = 0.0
    if "chi" in law.coefficients and law.unloading is None:
        chi, v0 = values["damping_ratio"], impacts.v0[0].item()
        # the damping of a limit is infinite
        chi = math.inf if values["status"] == Status.LIMIT else chi
        found["rebound_speed_bound"] = v0 / chi if chi else math.inf
    return {name: found.get(name, math.nan) for name, _, _ in DERIVED}
