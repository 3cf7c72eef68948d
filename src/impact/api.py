"""The program from Python: the one place that joins the floors. The commands are thin faces on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

# a name imported "as itself" is public: `impact.__all__` hands it on
from .contact.collide import Contact, collide
from .contact.history import follow
from .contact.model import ForceModel as ForceModel
from .contact.model import Parameter as Parameter
from .contact.models import catalogue
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.status import Status
from .data.history import history_dataset
from .data.origin import config_of
from .data.results import assemble
from .data.store import load as load
from .data.store import save as save
from .errors import ImpactError as ImpactError
from .sweeps.config import read_config
from .sweeps.plan import Block, Plan
from .sweeps.point import one_point
from .sweeps.run import run as run_blocks

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


def prepare(
    source: str | Path | Mapping[str, object],
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
) -> Plan:
    """The plan of a config: a TOML file, or a mapping of the same shape."""
    source = Path(source) if isinstance(source, str) else source
    return Plan(read_config(source, overrides, plugins), tuple(plugins))


def execute(plan: Plan, progress: Callable[[int], None] | None = None) -> xr.Dataset:
    """The result of a plan; `progress` is told the number of points finished so far."""

    def finished() -> Iterator[tuple[Block, Contact]]:
        done = 0
        for block, contact in run_blocks(plan):
            yield block, contact
            done += block.stop - block.start
            if progress is not None:
                progress(done)

    return assemble(plan, finished())


def sweep(
    source: str | Path | Mapping[str, object],
    *,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
) -> xr.Dataset:
    """Run a sweep.

    Parameters
    ----------
    source : path of a TOML file, or a mapping of the same shape
    overrides : changes to it, such as `"sweep.e=0.5"`
    plugins : models of one's own, which the config may then name

    Returns
    -------
    xarray.Dataset : see docs/schema.md

    Raises
    ------
    ConfigError : with all problems of the config

    >>> import impact
    >>> result = impact.sweep({
    ...     "models": ["lankarani-nikravesh-1990"],
    ...     "sweep": {"e": [0.1, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
    ... })
    >>> result["e_out"].values.round(6).tolist()
    [[0.665265, 0.913177]]
    """
    return execute(prepare(source, overrides, plugins))


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


def run(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel] = (),
) -> Impact:
    """Run one impact and follow it through time.

    Parameters
    ----------
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper, at e = 0.5
    model : key of the model; by default the first of the source
    at : values by config name, such as `{"e": 0.05}`; an axis that is not named takes its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : models of one's own

    Raises
    ------
    ConfigError, UsageError, ResultError : the source, a name or a value is not right

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    config, first = one_point(lambda more: config_of(source, [*overrides, *more], plugins), model, at)
    plan = Plan(config, tuple(plugins))
    law = config.models[0]
    lanes = plan.lanes(law, 0, 1)
    solver = config.solver
    contact = collide(law, lanes, rtol=solver.rtol, max_steps=solver.max_steps)
    values = {field.name: getattr(contact, field.name)[0].item() for field in fields(contact)}
    going = values["status"] == Status.OK
    history = follow(law, lanes, rtol=solver.rtol, max_steps=solver.max_steps) if going else None
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


def models(plugins: Sequence[ForceModel] = ()) -> Mapping[str, ForceModel]:
    """The catalogue of contact force models, by key.

    >>> import impact
    >>> impact.models()["gharib-hurmuzlu-2012"].equation
    'F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)'
    """
    return catalogue(plugins)


def plot(
    dataset: xr.Dataset,
    *,
    x: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> Figure:
    """Draw the final-velocity comparison, Figure 6 of the paper.

    Parameters
    ----------
    dataset : a result
    x : what to draw over; by default e, else the first numeric axis
    sel : values of the other axes, such as `{"m2": 1.0}`; one that is not named shows its first value
    models : keys of the models to show; by default all

    Returns
    -------
    matplotlib.figure.Figure : `figure.savefig("results.png")` writes it

    Raises
    ------
    UsageError : the result has not got what is asked for

    >>> import impact
    >>> figure = impact.plot(impact.sweep("configs/figure6.toml"))
    >>> figure.axes[0].get_xlabel()
    'coefficient of restitution, e'
    """
    from .views.figures import draw_final_velocities, final_velocities

    return draw_final_velocities(final_velocities(dataset, x, sel, models))
