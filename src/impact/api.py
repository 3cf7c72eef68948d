"""The program from Python: the one place that joins the floors. The commands are thin faces on it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.tolerances import Tolerances
from .comparison.verdict import Verdict as Verdict
from .config.grid import MAX_POINTS
from .config.library import records
from .config.load import read_config

# a name imported "as itself" is public: `impact.__all__` hands it on
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel
from .contact.model import Parameter as Parameter
from .contact.models import catalogue
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.execute import never_stop
from .engine.executors import SERIAL, Backend, choose_backend
from .engine.plan import Plan
from .engine.plugins import read_plugins
from .engine.progress import ProgressCallback
from .engine.trajectories import check_count
from .errors import ImpactError as ImpactError
from .errors import UsageError
from .results.backend import load as load
from .results.backend import save as save
from .results.extend import extend as extend_result
from .results.provenance import config_of_part, stored_config
from .results.ranking import Ranking, ranking
from .results.replay_command import command_start
from .results.single_impact import Impact as Impact
from .results.single_impact import histories, run_single_impact, single_point
from .results.sweep import sweep_in_memory

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .plots.kinds import Choice, PlotData


def prepare(
    source: str | Path | Mapping[str, object],
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
) -> Plan:
    """The plan of a config: a TOML file, or a mapping of the same shape.

    Raises
    ------
    ConfigError : with all problems of the config
    UsageError : more than `max_points` trajectories would be integrated
    """
    source = Path(source) if isinstance(source, str) else source
    own = read_plugins(plugins)
    config = read_config(source, overrides, own.models, max_points)
    plan = Plan(config, own.of(config.models))
    check_count(plan, max_points, str(source) if isinstance(source, Path) else "config")
    return plan


def execute(
    plan: Plan,
    backend: Backend = SERIAL,
    on_progress: ProgressCallback | None = None,
    should_stop: Callable[[], bool] = never_stop,
) -> xr.Dataset:
    """The result of a plan, in memory; for the parameters see `impact.results.sweep.sweep_into`."""
    return sweep_in_memory(
        plan, backend=backend, on_progress=on_progress or (lambda progress: None), should_stop=should_stop
    )


def sweep(
    source: str | Path | Mapping[str, object],
    *,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
    threads: int = 1,
    executor: Executor | None = None,
    max_points: int = MAX_POINTS,
) -> xr.Dataset:
    """Run a sweep, with its result in memory; `impact sweep` on the command line writes one of any size to a file.

    Parameters
    ----------
    source : path of a TOML file, or a mapping of the same shape
    overrides : changes to it, such as `"sweep.e=0.5"`
    plugins : models of one's own, which the config may then name, and paths of Python files that hold such;
        the files are executed
    jobs : how many processes integrate; with more than one, a program of one's own wants the usual
        `if __name__ == "__main__":`
    threads : how many threads integrate, in place of processes; they run side by side where a core is compiled
    executor : of the interface of `concurrent.futures`, that integrates in their place: dask's
        `client.get_executor(pure=False)`, or the one of mpi4py; it is not shut down
    max_points : how many points it may have, of all models together

    Returns
    -------
    xarray.Dataset : see docs/schema.md

    Raises
    ------
    ConfigError : with all problems of the config
    UsageError, ModelError : a plug-in cannot be read, or is not right; more than one of jobs, threads and executor
    StoreError : processes were killed again and again

    >>> import impact
    >>> result = impact.sweep({
    ...     "models": ["lankarani-nikravesh-1990"],
    ...     "sweep": {"e": [0.1, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
    ... })
    >>> result["e_out"].values.round(6).tolist()
    [[0.665265, 0.913177]]
    """
    return execute(prepare(source, overrides, plugins, max_points), choose_backend(jobs, threads, executor))


def run(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    times: int | None = None,
) -> Impact:
    """Run one impact and follow it through time.

    Parameters
    ----------
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper, at e = 0.5
    model : key of the model; by default the first of the source
    at : values by config name, such as `{"e": 0.05}`; an axis that is not named takes its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : models of one's own, and paths of Python files; a result made with such needs them again, and
        a changed one gives a warning with both hashes
    times : how many points in time the history has, uniform from first contact to release; by default those of the
        integrator

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is not right

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    if times is not None and times < 2:
        raise UsageError(f"times: got {times}, expected a whole number >= 2")
    own = read_plugins(plugins)
    config, first = single_point(source, overrides, own, model, at)
    return run_single_impact(Plan(config, own.of(config.models)), first, times)


def extend(
    result: str | Path,
    overrides: Sequence[str],
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
) -> xr.Dataset:
    """Add values to the axes of a stored result, or models to it, and integrate only what is new.

    Parameters
    ----------
    result : the file
    overrides : changes to its config, such as `"sweep.m2=[1.0, 2.0]"`; values that it has are kept in any case
    output : the file of the larger result; by default it takes the place of the smaller one
    overwrite : replace the output if it exists
    plugins : models of one's own, those that it was made with among them
    max_points : how many points it may have, of all models together

    Returns
    -------
    xarray.Dataset : the larger result, in all variables and coordinates that of the sweep done at once

    Raises
    ------
    ResultError : the file is not a readable result, or of another version of this program
    UsageError : what is changed is more than values of axes and models
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/r.h5")
    ...     impact.extend(f"{folder}/r.h5", ["sweep.m2=[1.0, 2.0]"]).sizes["m2"]
    2
    """
    path = Path(result)
    target = path if output is None else Path(output)
    extend_result(path, target, overrides, read_plugins(plugins), overwrite=overwrite, max_points=max_points)
    return load(target)


def rerun(
    result: str | Path,
    *,
    plugins: Sequence[ForceModel | str | Path] = (),
    tol: float | Tolerances | None = None,
    subset: bool = False,
    max_points: int = MAX_POINTS,
    execute: Callable[[Plan], xr.Dataset] = execute,
) -> Verdict:
    """Repeat the sweep of a result from its file alone, and judge what comes out by what is in it.

    Only the points that the file holds are repeated, also where its config has more.

    Parameters
    ----------
    result : the file
    plugins : the models of one's own that it was made with; a note of the verdict names one that has changed
    tol, subset : see `compare`
    max_points : refuse a config of more points
    execute : runs a plan

    Raises
    ------
    ResultError : the file is not a readable result
    UsageError : it is no result of a sweep, or a plug-in is missing or another
    ConfigError : this version has no such model, or does not read such a config

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/stored.h5")
    ...     print(impact.rerun(f"{folder}/stored.h5"))
    equal: 19 variables, 5,353 values, none differs
    """
    stored = load(result)
    own = read_plugins(plugins)
    # the models by their keys, because "all" is more models now than it was; the tolerances that took effect
    keys = stored["model"].values.tolist() if "model" in stored.dims else []
    solver = (f"solver.{name}={stored.attrs.get(name)}" for name in ("rtol", "max_steps"))
    # whichever core is here: they agree
    changes = [f"models={json.dumps(keys)}", *solver, 'solver.core="auto"']
    config = stored_config(stored.attrs, changes, own, str(result), max_points, allow_changed_plugins=True)
    whole = Plan(config, own.of(config.models))
    plan = replace(whole, config=config_of_part(config, stored))
    check_count(plan, max_points, str(result))
    verdict = compare(execute(plan), stored, tol=tol, subset=subset)
    if plan.points < whole.points:
        part = f"repeated {plan.points:,} of {whole.points:,} points of the config: the file holds no others"
        verdict = replace(verdict, notes=(part, *verdict.notes))
    files = [word for one in plugins if isinstance(one, str | Path) for word in ("--plugin", str(one))]
    again = ("impact", "run", str(result), *files) if command_start(str(result), stored) else ()
    return replace(verdict, new="the rerun", baseline=str(result), repeats=again)


def models(plugins: Sequence[ForceModel | str | Path] = ()) -> Mapping[str, ForceModel]:
    """The catalogue of contact force models, by key.

    >>> import impact
    >>> impact.models()["gharib-hurmuzlu-2012"].equation
    'F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)'
    """
    return catalogue(read_plugins(plugins).models)


def plot(
    dataset: xr.Dataset,
    *,
    kind: str = "final-velocities",
    x: str | None = None,
    y: str | None = None,
    variable: str = "e_error",
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | pd.DataFrame | xr.Dataset | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool = True,
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    ax: Axes | Sequence[Axes] | None = None,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> Figure:
    """Draw a result; by default the final-velocity comparison, Figure 6 of the paper.

    Parameters
    ----------
    dataset : a result, or a time history
    kind : one of `impact.plots.kinds.KINDS`
    x : what to draw over; by default e, else the first numeric axis
    y : second axis of a map, or of the kind validity; by default the next one
    variable : that a map shows
    sel : values of the other axes, such as `{"m2": 1.0}`; one that is not named shows its first value. A loop,
        a history or an impulse may be at a point that is not on the grid
    models : keys of the models to show; by default all
    log : which axes are logarithmic, such as "x" or "xy"; axes that are spaced so are in any case
    points : measured points over the curves: a CSV file, or a table of pandas or xarray, whose columns have names
        such as "v1 [m/s]", "e_out" and "sigma"
    width : of the figure [in], or a length such as "84mm", "single" or "double"; by default that of rcParams where
        it was changed, else "double"
    height : of the figure [in], or a length; by default what suits the kind
    style : a style sheet of matplotlib, or the name of one; the user's own rcParams are respected in any case
    title : write the title and the conditions
    labels : texts by the name of an axis, the key of a law, "reference" or "title"
    equations : name the laws with the numbers of their equations in the paper
    ax : draw into these axes of a figure of one's own, one for each panel, in that figure's style
    plugins : models of one's own, which the kinds that follow a motion need again

    Returns
    -------
    matplotlib.figure.Figure : `figure.savefig("results.png")` writes it; a notebook shows it

    Raises
    ------
    UsageError : the result has not got what is asked for

    >>> import impact
    >>> figure = impact.plot(impact.sweep("configs/figure6.toml"))
    >>> figure.axes[0].get_xlabel()
    'Coefficient of restitution $e$'
    """
    from .plots.kinds import Choice, draw

    choice = Choice(x, y, variable, sel, models, log, equations)
    plot_data = get_plot_data(dataset, kind, choice, plugins)
    return draw(plot_data, width, height, style=style, title=title, labels=labels, points=points, ax=ax)


def get_plot_data(
    dataset: xr.Dataset, kind: str, choice: Choice, plugins: Sequence[ForceModel | str | Path] = ()
) -> PlotData:
    """The data of a picture; see `plot`."""
    from .plots.kinds import plot_data_of

    own = read_plugins(plugins)
    return plot_data_of(kind, dataset, choice, lambda: histories(dataset, choice.models, choice.sel or {}, own))


def materials() -> dict[str, dict[str, float | str]]:
    """Common materials in SI units, which a config may name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] where it is known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return {name: dict(record) for name, record in records().items()}


def recommend(
    dataset: xr.Dataset,
    *,
    tol: float = 0.01,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
) -> Ranking:
    """Rank the models of a result by how well they give the restitution asked for, over all that is swept.

    Parameters
    ----------
    dataset : a result
    tol : what |e_out - e| may be
    sel : values of axes, such as `{"m2": 1.0}`; all values of the others are judged
    models : keys of the models to rank; by default all

    Returns
    -------
    Ranking : the models, the best first; `ranking.best` are those within the tolerance at all points

    Raises
    ------
    UsageError : the result asks for no e, or has not got what is asked for; tol is not a positive finite number

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml")
    >>> print(impact.recommend(result, models=["gharib-hurmuzlu-2012"]).headline)
    no model gives e within 0.01 everywhere; gharib-hurmuzlu-2012 is nearest: 25.7% of 101 points
    """
    return ranking(dataset, tol, sel, models)


def report(dataset: xr.Dataset, *, plugins: Sequence[ForceModel | str | Path] = ()) -> str:
    """A result as one page of HTML, which needs no network and runs nothing.

    Parameters
    ----------
    dataset : a result
    plugins : models of one's own that it was made with; without them the figures that follow a motion are left out

    Raises
    ------
    UsageError, ResultError : it is a time history, or its attributes are not those of a result

    >>> import impact
    >>> "<h1>Final velocities comparison</h1>" in impact.report(impact.sweep("configs/figure6.toml"))
    True
    """
    from .reporting.page import page

    return page(dataset, lambda kind, choice: get_plot_data(dataset, kind, choice, plugins))
