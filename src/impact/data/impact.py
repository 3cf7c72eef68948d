"""One impact by one model, followed through time."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from ..contact.collide import OUTPUTS, collide
from ..contact.history import follow
from ..contact.model import ForceModel
from ..contact.status import Status
from ..sweeps.impacts import lanes_of
from ..sweeps.plan import Plan
from .history import history_dataset


@dataclass(frozen=True)
class Impact:
    """One impact by one model.

    Parameters
    ----------
    model : the model
    point : the inputs by their config names; a name in `first` is an axis of the source at its first value
    values : the outputs under the names of the result file, in SI
    damping : damping factor lambda = chi K/v0 [N s/m^(n+1)], NaN where the law has none
    e_kinematic, e_kinetic, e_energetic : restitution from velocities, impulses and works, equations (1) to (3);
        the last two are NaN without history
    history : the time history as a dataset over t, or None where there is no motion to follow
    """

    model: ForceModel
    point: Mapping[str, float | str]
    first: tuple[str, ...]
    values: Mapping[str, float]
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
    lanes = lanes_of(plan, law, ())
    solver = config.solver
    errors: dict[str, str] = {}
    contact = collide(law, lanes, rtol=solver.rtol, max_steps=solver.max_steps, errors=errors)
    values = {name: getattr(contact, name)[0].item() for name in OUTPUTS}
    for error in errors.values():
        warnings.warn(error, stacklevel=2)
    going = values["status"] == Status.OK
    history = follow(law, lanes, rtol=solver.rtol, max_steps=solver.max_steps, times=times) if going else None
    v0 = lanes.v0[0].item()
    point = {**config.scalars, **({"e": lanes.e[0].item()} if "alpha" in config.scalars else {})}
    return Impact(
        model=law,
        point=point,
        first=first,
        values=values,
        exponent=lanes.n[0].item(),
        closing_speed=v0,
        damping=values["damping_ratio"] * values["stiffness"] / v0 if v0 else float("nan"),
        e_kinematic=(values["v2_post"] - values["v1_post"]) / v0 if v0 > 0.0 else float("nan"),
        e_kinetic=history.e_kinetic if history else float("nan"),
        e_energetic=history.e_energetic if history else float("nan"),
        history=history_dataset(history, law.key, point) if history else None,
    )
