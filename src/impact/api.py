"""The Python interface; each command of the command line calls a function of this module."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from .atomic import check_outputs, write_file
from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.tolerances import Tolerances
from .comparison.verdict import Verdict as Verdict
from .config.grid import MAX_POINTS
from .config.library import records
from .config.load import json_schema, read_config

# a name imported "as itself" is public, see `impact.__all__`
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models import catalogue, find
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.checkpoint import remove_stale_work_folder
from .engine.execute import never_stop
from .engine.executors import SERIAL, Backend, choose_backend
from .engine.plan import Plan
from .engine.plugins import Plugins, read_plugins
from .engine.progress import Progress, ProgressCallback
from .engine.trajectories import check_count
from .errors import ImpactError as ImpactError, UnfinishedError, UsageError, did_you_mean
from .results.extend import extend as extend_result
from .results.kinds import is_calibration, require_sweep
from .results.plausibility import material_notes
from .results.provenance import config_of_part, stored_config
from .results.replay_command import command_start
from .results.shards import Shard, ShardProgress, merge as merge_shards, sweep_shard as write_shard
from .results.single_impact import (
    STARTER_CONFIG,
    Impact as Impact,
    histories,
    open_source,
    run_single_impact,
    single_point,
)
from .results.summary import SweepOutcome
from .results.sweep import find_finished, sweep_in_memory, sweep_into
from .results.xarray_backend import load as load, save as save
from .text import html_table, safe_text

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from ipywidgets import VBox
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from .contact.checks import Finding
    from .exporters.export import Export
    from .inverse.solve import SolveResult
    from .inverse.timestep import TimestepResult
    from .plots.kinds import Choice, PlotData
    from .results.estimate import Estimate


class PlotFiles(NamedTuple):
    """Pictures in files and their data, by kind, and the reason why a kind was left out."""

    pictures: dict[str, Path]
    plot_data: dict[str, PlotData]
    left_out: dict[str, str]


def ignore_progress(progress: Progress) -> None:
    """Default of `on_progress`."""


def ignore_note(note: str) -> None:
    """Default of `on_note`."""


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
    plugin_set = read_plugins(plugins)
    config = read_config(source, overrides, plugin_set.models, max_points)
    plan = Plan(config, plugin_set.of(config.models))
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
    output: str | Path | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
    threads: int = 1,
    executor: Executor | None = None,
    max_points: int = MAX_POINTS,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
) -> xr.Dataset:
    """Run a sweep; the result is in memory, or in a file and of any size.

    Parameters
    ----------
    source : path of a TOML file, or a mapping of the same shape
    output : file to write; by default the result stays in memory
    overrides : changes to the config, such as `"sweep.e=0.5"`
    plugins : plug-in models, which the config may name, and paths of Python files with such models, which are
        executed
    jobs : number of processes that integrate; with more than one a script needs the usual
        `if __name__ == "__main__":`
    threads : number of threads that integrate, instead of processes; they run in parallel if the core is compiled
    executor : an executor of the interface of `concurrent.futures` that integrates instead, such as dask's
        `client.get_executor(pure=False)` or that of mpi4py; it is not shut down
    max_points : the largest number of points, of all models together
    resume : continue an interrupted sweep into `output`
    overwrite : replace `output` if it exists
    progress : show a bar if it takes more than a second, in a terminal or, with ipywidgets, in a notebook; else
        print a line every ten seconds

    Returns
    -------
    xarray.Dataset : see docs/schema.md; of a large file the values are read when they are indexed

    Raises
    ------
    ConfigError : with all problems of the config
    UsageError, ModelError : a plug-in cannot be read or is invalid; more than one of jobs, threads and executor;
        `output` exists
    StoreError : the disk is full or failed; or processes were killed repeatedly

    >>> import impact
    >>> result = impact.sweep({
    ...     "models": ["lankarani-nikravesh-1990"],
    ...     "sweep": {"e": [0.1, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
    ... })
    >>> result["e_out"].values.round(6).tolist()
    [[0.665265, 0.913177]]
    """
    if output is None:
        if resume or overwrite:
            raise UsageError("resume and overwrite: got no output, expected one as well")
        plan, backend = prepare(source, overrides, plugins, max_points), choose_backend(jobs, threads, executor)
        with _progress(shown=progress) as on_progress:
            return execute(plan, backend, on_progress)
    with _progress(shown=progress) as on_progress:
        sweep_to_file(
            source,
            output,
            overrides=overrides,
            plugins=plugins,
            backend=nullcontext(choose_backend(jobs, threads, executor)),
            max_points=max_points,
            resume=resume,
            overwrite=overwrite,
            on_progress=on_progress,
        )
    return load(output)


def _progress(*, shown: bool) -> AbstractContextManager[ProgressCallback]:
    """The progress bar, or nothing; rich is imported for a bar only."""
    if not shown:
        return nullcontext(ignore_progress)
    from .progress_display import progress_bar

    return progress_bar()


def sweep_to_file(
    source: str | Path | Mapping[str, object],
    output: str | Path,
    *,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[Backend] | None = None,
    max_points: int = MAX_POINTS,
    resume: bool = False,
    overwrite: bool = False,
    on_progress: ProgressCallback = ignore_progress,
    on_note: Callable[[str], None] = ignore_note,
    should_stop: Callable[[], bool] = never_stop,
) -> SweepOutcome:
    """Run a sweep into a file and summarize it, without reading the file again.

    A file that already contains this sweep is not modified.

    Parameters
    ----------
    source, overrides, plugins, max_points : see `sweep`
    output : the file
    backend : context manager of the backend, entered when it is needed; by default this process
    resume : continue with the work folder of an interrupted sweep
    overwrite : replace the file if it exists
    on_progress : called from time to time with the progress
    on_note : called with a sentence about each implausible value
    should_stop : returns whether to stop; finished blocks stay in the work folder

    Returns
    -------
    SweepOutcome : counts of points by status, largest errors, first failed points

    Raises
    ------
    ConfigError : with all problems of the config
    UsageError, ModelError : see `sweep`
    InUseError : another process writes the file
    StoreError : the disk is full or failed, or processes were killed; finished blocks stay in the work folder
    UnfinishedError : `should_stop` stopped it

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = impact.sweep_to_file("configs/figure6.toml", f"{folder}/results.h5")
    >>> outcome.summary.points, outcome.trajectories, outcome.is_new
    (303, 303, True)
    """
    plan = _prepare_with_notes(source, overrides, plugins, max_points, on_note)
    output = Path(output)
    shown = safe_text(str(output))
    outcome = None if overwrite else find_finished(output, plan)
    if outcome is not None:
        remove_stale_work_folder(output, plan)
        if should_stop():
            raise UnfinishedError(f"{shown} already contains this sweep")
        return replace(outcome, is_new=False)
    check_outputs([output], [source, *plugins, *plan.config.files], overwrite=overwrite)
    with backend or nullcontext(SERIAL) as integrator:
        outcome = sweep_into(
            output,
            plan,
            resume=resume,
            overwrite=overwrite,
            backend=integrator,
            on_progress=on_progress,
            should_stop=should_stop,
        )
    if should_stop():
        raise UnfinishedError(f"{shown} is complete")
    return outcome


def sweep_shard(
    source: str | Path | Mapping[str, object],
    shard: str,
    output: str | Path,
    *,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[Backend] | None = None,
    max_points: int = MAX_POINTS,
    overwrite: bool = False,
    on_progress: ProgressCallback = ignore_progress,
    on_note: Callable[[str], None] = ignore_note,
    should_stop: Callable[[], bool] = never_stop,
) -> ShardProgress:
    """Integrate one shard of a sweep into its work folder; `merge` joins the folders of all shards.

    Parameters
    ----------
    shard : "K/N", the part K of N, such as "3/16"
    output : file of the whole result; the work folder is next to it
    overwrite : start the shard again
    source, overrides, plugins, max_points, backend, on_progress, on_note, should_stop : see `sweep_to_file`

    Returns
    -------
    ShardProgress : the work folder, and its finished part

    Raises
    ------
    ConfigError, UsageError, ModelError, InUseError, StoreError, UnfinishedError : see `sweep_to_file`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.sweep_shard("configs/figure6.toml", "1/1", f"{folder}/results.h5").trajectories
    303
    """
    plan = _prepare_with_notes(source, overrides, plugins, max_points, on_note)
    part = Shard.parse(shard)
    # the command of the whole sweep: `merge` reports it for a missing shard
    config = str(source) if isinstance(source, str | Path) else "CONFIG.toml"
    command = ["impact", "sweep", config, "-o", str(output)]
    command += [word for change in overrides for word in ("--set", change)]
    command += [word for path in plugins if isinstance(path, str | Path) for word in ("--plugin", str(path))]
    with backend or nullcontext(SERIAL) as integrator:
        done = write_shard(
            Path(output),
            plan,
            part,
            command,
            overwrite=overwrite,
            backend=integrator,
            on_progress=on_progress,
            should_stop=should_stop,
        )
    if should_stop():
        raise UnfinishedError(f"{safe_text(str(done.folder))} is complete")
    return done


def merge(
    folders: Sequence[str | Path],
    output: str | Path,
    *,
    plugins: Sequence[ForceModel | str | Path] = (),
    overwrite: bool = False,
    on_progress: ProgressCallback = ignore_progress,
    should_stop: Callable[[], bool] = never_stop,
) -> SweepOutcome:
    """Join the shards of a sweep into a file, and summarize it; the work folders are kept.

    Parameters
    ----------
    folders : the work folders of all shards, in any order
    output : the file
    plugins : the plug-in models that the shards were integrated with
    overwrite : replace the file if it exists
    on_progress, should_stop : see `sweep_to_file`

    Returns
    -------
    SweepOutcome : counts of points by status, largest errors, first failed points

    Raises
    ------
    UsageError : a folder is not a shard, or of another sweep; or shards are missing or unfinished
    ResultError : a block is in two folders, and they differ
    InUseError, StoreError, UnfinishedError : see `sweep_to_file`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     output = f"{folder}/results.h5"
    ...     shards = [impact.sweep_shard("configs/figure6.toml", f"{k}/2", output) for k in (1, 2)]
    ...     impact.merge([shard.folder for shard in shards], output).summary.points
    303
    """
    check_outputs([output], plugins, overwrite=overwrite)
    outcome, repeated = merge_shards(
        [Path(folder) for folder in folders],
        Path(output),
        read_plugins(plugins),
        overwrite=overwrite,
        on_progress=on_progress,
        should_stop=should_stop,
    )
    if should_stop():
        raise UnfinishedError(f"{safe_text(str(output))} is complete")
    return replace(outcome, repeated_blocks=repeated)


def estimate(
    source: str | Path | Mapping[str, object],
    *,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
    max_points: int = MAX_POINTS,
    on_note: Callable[[str], None] = ignore_note,
) -> Estimate:
    """Count the points and trajectories of a sweep, and estimate its size and time; nothing is written.

    Parameters
    ----------
    source, overrides, plugins, max_points : see `sweep`
    jobs : number of processes or threads that integrate
    on_note : called with a sentence about each implausible value

    Raises
    ------
    ConfigError, UsageError, ModelError : see `sweep`

    >>> import impact
    >>> impact.estimate("configs/figure6.toml").points
    303
    """
    plan = _prepare_with_notes(source, overrides, plugins, max_points, on_note)
    # it integrates a range, which a program that only imports impact does without
    from .results.estimate import estimate as estimate_plan

    return estimate_plan(plan, jobs)


def _prepare_with_notes(
    source: str | Path | Mapping[str, object],
    overrides: Sequence[str],
    plugins: Sequence[ForceModel | str | Path],
    max_points: int,
    on_note: Callable[[str], None],
) -> Plan:
    """The plan of a config; calls `on_note` for each material whose modulus is implausible."""
    plan = prepare(source, overrides, plugins, max_points)
    columns = {name: values for axis in plan.config.axes for name, values in axis.columns.items()}
    for note in material_notes(plan.material_record, columns):
        on_note(note)
    return plan


def run(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    times: int | None = None,
) -> Impact:
    """Run one impact and record its time history.

    Parameters
    ----------
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper, at e = 0.5
    model : key of the model; by default the first one of the source
    at : values by config name, such as `{"e": 0.05}`; the default of an axis is its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : plug-in models, and paths of Python files with such models; a result that was computed with them
        needs them again, and a changed one gives a warning with both hashes
    times : number of points of the history, uniform from first contact to release; by default the steps of the
        integrator

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is invalid

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    if times is not None and times < 2:
        raise UsageError(f"times: got {times}, expected a whole number >= 2")
    plugin_set = read_plugins(plugins)
    config, first = single_point(open_source(source, overrides, plugin_set), model, at)
    return run_single_impact(Plan(config, plugin_set.of(config.models)), first, times)


def solve(
    model: str,
    name: str,
    target: Mapping[str, float],
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    over: Mapping[str, object] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> SolveResult:
    """Find the value of an input of a law that gives a wanted output: which coefficient gives the rebound I want?

    Parameters
    ----------
    model : key of the law
    name : what to solve for: a parameter of the law, the restitution "e" to ask it for, or the stiffness "K"
    target : the wanted value of one output, such as `{"e_out": 0.6}`
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper
    at : values of the other inputs by config name, such as `{"v1": 1.0}`
    over : values of one input, such as `{"v1": {"linspace": [0.1, 3, 30]}}`, for which one value is found, with
        the least largest distance from the target
    overrides, plugins : see `sweep`

    Returns
    -------
    SolveResult : the status, the roots with the e_out of each, the range of the target that was found, and the
        outputs over the range of inputs

    Raises
    ------
    UsageError : the law has no such parameter, or the target is no output
    ConfigError, ModelError : see `sweep`

    The law of Gharib and Hurmuzlu delivers less than it is asked for, and never 0.6:

    >>> import impact
    >>> round(impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.5}).roots[0].value, 6)
    0.697958
    >>> impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.6}).status
    'no_root'
    """
    # its module imports scipy.optimize, which other functions do without
    from .inverse.solve import placeholder, solve_input, unknown_of

    if over is not None and len(over) != 1:
        raise UsageError(f"--over: got {len(over)} inputs, expected one")
    plugin_set = read_plugins(plugins)
    law = find(model, plugin_set.models)
    unknown = unknown_of(law, name)
    values = {**placeholder(law, unknown), **(at or {})}
    config, _ = single_point(open_source(source, overrides, plugin_set), model, values, over)
    return solve_input(config, plugin_set.of(config.models), unknown, target)


def timestep(
    model: str,
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    steps_per_contact: Sequence[float] = (),
    dt: Sequence[float] = (),
    phases: int = 400,
    tol: float | None = None,
    scheme: str | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> TimestepResult:
    """What a code with a fixed time step delivers: mean, least and largest restitution over the phase.

    The phase is the part of a step in which the contact begins: a code sees an overlap at its first step after it.
    The scheme "kick-drift" is that of LAMMPS, LIGGGHTS, YADE and MuJoCo, "drake-tamsi" and "drake-sap" are those
    of Drake's discrete solvers; `impact.contact.timestep.SCHEMES` has what they do in a step.

    Parameters
    ----------
    model : key of the law
    source, at, overrides, plugins : see `solve`
    steps_per_contact : contact times of the continuous law over dt; by default 10, 20, 50 and 100
    dt : further time steps [s]
    phases : number of phases, (i + 1/2)/phases
    tol : relative tolerance for which the smallest number of steps per contact is found
    scheme : its name; by default "drake-tamsi" for the laws of Drake, "kick-drift" for all others

    Returns
    -------
    TimestepResult : a row for each step, those of `steps_per_contact` first, and the number of steps needed; a row
        at which the collision fails at some phase has a status and no restitution

    Raises
    ------
    UsageError : a step is not positive, the scheme does not take the law, or the law has no rebound at these
        inputs
    ConfigError, ModelError : see `sweep`

    A linear spring and dashpot that is asked for 0.5, with twenty steps per contact:

    >>> import impact
    >>> (row,) = impact.timestep("anagnostopoulos-1988", at={"e": 0.5}, steps_per_contact=[20]).rows
    >>> round(row.e_mean, 4), round(row.e_least, 3), round(row.e_largest, 3), round(row.e_to_ask, 4)
    (0.4945, 0.48, 0.519, 0.5054)
    """
    # its module imports scipy.optimize, which other functions do without
    from .inverse.timestep import timestep_study

    config, _ = single_point(open_source(source, overrides, read_plugins(plugins)), model, at)
    return timestep_study(
        config, steps_per_contact=steps_per_contact, dt=dt, phases=phases, tol=tol, scheme=scheme
    )


def calibrate(
    source: str | Path | Mapping[str, object],
    *,
    output: str | Path | None = None,
    best: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
) -> xr.Dataset:
    """Fit laws to measurements: which law fits, with which parameters, and what the data cannot determine.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with `[data]` and values `{ fit = [least, most] }`
    output : result file to write
    best : TOML file to write, with the config of the best law and its parameters, for `sweep` and `export`
    overwrite : replace files that exist
    overrides, plugins : see `sweep`
    jobs : number of processes; the result has the same bits for any number

    Returns
    -------
    Dataset : of dimensions model, parameter and point, the best law first; see docs/calibrate.md

    Raises
    ------
    ConfigError : with one line for each problem
    UsageError, StoreError : a file exists or cannot be written

    The restitution that a linear spring and dashpot was asked for, from three measurements of it:

    >>> import impact
    >>> fit = impact.calibrate({
    ...     "models": "anagnostopoulos-1988",
    ...     "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    ...     "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
    ... })
    >>> round(fit["estimate"].item(), 6), round(fit["chi2_reduced"].item(), 6)
    (0.5, 1.0)
    """
    # its modules import scipy.optimize, which other functions do without
    from .inverse.calibrate import best_config, calibrate_config, calibration_dataset

    plugin_set = read_plugins(plugins)
    read = Path(source) if isinstance(source, str) else source
    config = read_config(read, overrides, plugin_set.models, purpose="calibrate")
    check_outputs([output, best], [source, *plugins, *config.files], overwrite=overwrite)
    of_config = plugin_set.of(config.models)
    calibration = calibrate_config(config, of_config, jobs)
    result = calibration_dataset(calibration, of_config)
    if output is not None:
        save(result, output, overwrite=overwrite)
    if best is not None:
        write_file(Path(best), best_config(calibration).encode(), overwrite=overwrite)
    return result


def sensitivity(
    source: str | Path | Mapping[str, object],
    *,
    of: str = "e_out",
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
    execute: Callable[[Plan], xr.Dataset] = execute,
) -> xr.Dataset:
    """Which uncertain input matters: Sobol indices of an output, its mean and quantiles, for every model.

    For n samples of d uncertain inputs, n (d + 2) points are computed for each model and each point of the other
    axes.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with distributions and `[design]`
    of : name of the output
    output : result file to write
    overwrite : replace it if it exists
    overrides, plugins : see `sweep`
    max_points : the largest number of points
    execute : function that runs a plan; by default it is run in this process

    Returns
    -------
    Dataset : of dimensions model, the axes of the config, and input; see docs/uncertainty.md

    Raises
    ------
    ConfigError : with one line for each problem; there is no design, or its n is no power of two from 2 on
    UsageError, StoreError : there is no such output, or the file exists or cannot be written

    The peak force of Hertz' law is proportional to K^0.4 v^1.2:

    >>> import impact
    >>> study = impact.sensitivity({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 1024},
    ... }, of="peak_force")
    >>> study["first"].values.round(2).tolist()
    [[0.56, 0.43]]
    """
    (result,) = sensitivities(
        source,
        of=[of],
        output=output,
        overwrite=overwrite,
        overrides=overrides,
        plugins=plugins,
        max_points=max_points,
        execute=execute,
    )
    return result


def sensitivities(
    source: str | Path | Mapping[str, object],
    *,
    of: Sequence[str],
    output: str | Path | None,
    overwrite: bool,
    overrides: Sequence[str],
    plugins: Sequence[ForceModel | str | Path],
    max_points: int,
    execute: Callable[[Plan], xr.Dataset],
) -> list[xr.Dataset]:
    """The `sensitivity` of several outputs, whose points are computed once; one of them may be written."""
    # its modules import scipy.stats, which other functions do without
    from .uncertainty.sensitivity import check_output_name, sensitivity_of, sensitivity_plan

    for name in of:
        check_output_name(name)
    if output is not None and len(of) > 1:
        raise UsageError(f"--output: got {len(of)} outputs (--of), expected one for a file")
    name = safe_text(str(source)) if isinstance(source, str | Path) else "config"
    plan = sensitivity_plan(prepare(source, overrides, plugins, max_points), of, max_points, name)
    check_outputs([output], [source, *plugins, *plan.config.files], overwrite=overwrite)
    swept = execute(plan)
    results = [sensitivity_of(plan, of_study, swept) for of_study in of]
    if output is not None:
        save(results[0], output, overwrite=overwrite)
    return results


def export(
    to: str,
    model: str | None = None,
    *,
    source: str | Path | Mapping[str, object] | None = None,
    at: Mapping[str, float | str] | None = None,
    dt: float | None = None,
    code_version: str | None = None,
    script: bool = False,
    verify: bool = False,
    program: str | None = None,
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] = (),
) -> Export:
    """Write a law as a code takes it, with the restitution that the code delivers at its time step.

    Parameters
    ----------
    to : name of the code, see `export_codes`
    model : a law that the code has, by its key; by default the first one of the source, or without a source the
        first one of `export_codes`, that the release of the code has
    source, overrides : see `solve`
    at : values of inputs by config name; an e for a law that takes none is reached by its damping parameter
    dt : time step [s]; by default the contact time of the continuous law over 50
    code_version : release of the code, letters, digits, spaces and `._+()-`; by default that of the program, or
        else the newest known one
    script : write a complete input with two balls that prints the e that it measures
    verify : run such inputs at four phases, and compare their e with the prediction
    program : what runs scripts, such as the file of lmp, or of a Python with the code's package; by default found
    output : file to write the lines or the script to
    overwrite : replace the output if it exists

    Returns
    -------
    Export : parameters, lines, script and what the code delivers; `text` is what is written to `output`

    Raises
    ------
    UsageError : the code or the law is unknown, no damping gives the e, the code is not installed, or the output
        exists
    ConfigError : see `sweep`

    What LAMMPS takes for a restitution of 0.6:

    >>> import impact
    >>> law, at = "lammps-coeff-restitution-hooke", {"e": 0.6, "K": 1e6}
    >>> export = impact.export("lammps", law, at=at, code_version="22Jul2025")
    >>> export.lines[1]
    'pair_coeff      * * hooke 1000000.0 0.6 damping coeff_restitution tangential linear_nohistory 0.0 0.0'
    >>> round(export.at_dt.e_mean, 4)
    0.5985
    """
    # its modules import scipy.optimize, which other functions do without
    from .exporters.codes import find_code
    from .exporters.export import write_export
    from .exporters.problem import prepare_export
    from .exporters.verify import choose_version

    # before a program is run
    check_outputs([output], [source], overwrite=overwrite)
    code = find_code(to)
    found, version = choose_version(code, program, code_version, verify=verify)
    problem = prepare_export(code, model, version, source, at or {}, overrides)
    check_outputs([output], [source, *problem.config.files], overwrite=overwrite)
    result = write_export(problem, dt, found if verify else None, with_script=script)
    if output is not None:
        write_file(Path(output), result.text.encode(), overwrite=overwrite)
    return result


def export_codes() -> list[dict[str, Any]]:
    """The codes to which laws are exported, each with its laws, by key of the catalogue.

    Returns
    -------
    list : for each code a dict of its name "code", "title", the "installed" and the "newest" known version,
        the "scheme" of its time step, what was "tested", and what it calls each of its "laws"

    >>> import impact
    >>> (mujoco,) = (code for code in impact.export_codes() if code["code"] == "mujoco")
    >>> mujoco["laws"]["mujoco-solref"]
    'solref, standard format'
    """
    from .exporters.codes import CODES
    from .exporters.verify import installed_version

    return [
        {
            "code": code.name,
            "title": code.title,
            "installed": installed_version(code),
            "newest": code.newest,
            "scheme": code.scheme,
            "tested": code.tested,
            "laws": dict(code.laws),
        }
        for code in CODES.values()
    ]


def extend(
    result: str | Path,
    overrides: Sequence[str],
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
) -> xr.Dataset:
    """Add values to the axes of a stored result, or models to it, and integrate only what it does not hold.

    A result of layout "factored" holds trajectories, which new points may share; one of layout "full" has
    values alone, and all trajectories of the new points are integrated.

    Parameters
    ----------
    result : the file
    overrides : changes to its config, such as `"sweep.m2=[1.0, 2.0]"`; existing values are kept
    output : file of the larger result; by default it replaces the smaller one
    overwrite : replace the output if it exists
    plugins : plug-in models, among them those that the result was computed with
    max_points : the largest number of points, of all models together

    Returns
    -------
    xarray.Dataset : the larger result, equal to that of a single sweep in all variables and coordinates

    Raises
    ------
    ResultError : the file is not a readable result, or was written by another version of this program
    UsageError : the overrides change more than values of axes and models
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/r.h5")
    ...     impact.extend(f"{folder}/r.h5", ["sweep.m2=[1.0, 2.0]"]).sizes["m2"]
    2
    """
    target = result if output is None else output
    extend_to_file(result, overrides, output=target, overwrite=overwrite, plugins=plugins, max_points=max_points)
    return load(target)


def extend_to_file(
    result: str | Path,
    overrides: Sequence[str],
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    resume: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[Backend] | None = None,
    max_points: int = MAX_POINTS,
    on_progress: ProgressCallback = ignore_progress,
    should_stop: Callable[[], bool] = never_stop,
) -> SweepOutcome:
    """Extend a stored result as `extend` does, and summarize it, without reading the file again.

    Parameters
    ----------
    result, overrides, output, overwrite, plugins, max_points : see `extend`
    resume : continue with the work folder of an interrupted extension
    backend, on_progress, should_stop : see `sweep_to_file`

    Returns
    -------
    SweepOutcome : counts of points by status, largest errors, first failed points; `integrated` counts the
        trajectories that were integrated

    Raises
    ------
    ResultError, UsageError, StoreError : see `extend`
    InUseError, UnfinishedError : see `sweep_to_file`

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = impact.sweep_to_file("configs/figure6.toml", f"{folder}/r.h5")
    ...     impact.extend_to_file(f"{folder}/r.h5", ["sweep.e=[0.123]"]).integrated
    3
    """
    target = Path(result if output is None else output)
    check_outputs([target], plugins, overwrite=True)
    with backend or nullcontext(SERIAL) as integrator:
        outcome = extend_result(
            Path(result),
            target,
            overrides,
            read_plugins(plugins),
            resume=resume,
            overwrite=overwrite,
            max_points=max_points,
            backend=integrator,
            on_progress=on_progress,
            should_stop=should_stop,
        )
    if should_stop():
        raise UnfinishedError(f"{safe_text(str(target))} is complete")
    return outcome


def rerun(
    result: str | Path,
    *,
    plugins: Sequence[ForceModel | str | Path] = (),
    tol: float | Tolerances | None = None,
    subset: bool = False,
    max_points: int = MAX_POINTS,
    execute: Callable[[Plan], xr.Dataset] = execute,
) -> Verdict:
    """Repeat the sweep or the calibration of a result from its file alone, and compare the new values with it.

    Of a sweep, only the points in the file are repeated, even if its config has more.

    Parameters
    ----------
    result : the file
    plugins : the plug-in models that it was computed with; a note of the verdict names a changed one
    tol, subset : see `compare`
    max_points : the largest number of points
    execute : function that runs a plan; by default it is run in this process

    Raises
    ------
    ResultError : the file is not a readable result
    UsageError : it is a time history, or a plug-in is missing or a different one
    ConfigError : this version does not have a model of the result, or cannot read its config

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/stored.h5")
    ...     print(impact.rerun(f"{folder}/stored.h5"))
    equal: 19 variables, 5,353 values, none differs
    """
    stored = load(result)
    plugin_set = read_plugins(plugins)
    if is_calibration(stored):
        new = _repeat_calibration(stored, plugin_set, str(result))
        return replace(compare(new, stored, tol=tol, subset=subset), new="the rerun", baseline=str(result))
    require_sweep(stored, "rerun")
    # models by key, because "all" may include new models; the tolerances that were used
    keys = stored["model"].values.tolist() if "model" in stored.dims else []
    solver = (f"solver.{name}={stored.attrs.get(name)}" for name in ("rtol", "max_steps"))
    # any core gives the same result
    changes = [f"models={json.dumps(keys)}", *solver, 'solver.core="auto"']
    config = stored_config(stored.attrs, changes, plugin_set, str(result), max_points, allow_changed_plugins=True)
    whole = Plan(config, plugin_set.of(config.models))
    plan = replace(whole, config=config_of_part(config, stored))
    check_count(plan, max_points, str(result))
    verdict = compare(execute(plan), stored, tol=tol, subset=subset)
    if plan.points < whole.points:
        part = f"repeated {plan.points:,} of {whole.points:,} points of the config: the file holds no others"
        verdict = replace(verdict, notes=(part, *verdict.notes))
    files = [word for path in plugins if isinstance(path, str | Path) for word in ("--plugin", str(path))]
    command = ("impact", "run", str(result), *files) if command_start(str(result), stored) else ()
    return replace(verdict, new="the rerun", baseline=str(result), repeats=command)


def _repeat_calibration(stored: xr.Dataset, plugins: Plugins, name: str) -> xr.Dataset:
    """The calibration of a stored config with the models and the tolerances of the result."""
    # its modules import scipy.optimize, which other functions do without
    from .inverse.calibrate import calibrate_config, calibration_dataset

    changes = [f"models={json.dumps(stored['model'].values.tolist())}"]
    changes += [f"solver.{key}={stored.attrs.get(key)}" for key in ("rtol", "max_steps")]
    config = stored_config(stored.attrs, changes, plugins, name, allow_changed_plugins=True, purpose="calibrate")
    of_config = plugins.of(config.models)
    return calibration_dataset(calibrate_config(config, of_config), of_config)


class Models(dict[str, ForceModel]):
    """Models by key, which a notebook shows as a table."""

    def __repr__(self) -> str:
        return f"{len(self)} models: {', '.join(self)}"

    def _repr_html_(self) -> str:
        rows = (
            (key, model.family, model.equation, ", ".join(p.name for p in model.parameters), model.domain_text)
            for key, model in self.items()
        )
        return html_table(("model", "family", "equation", "parameters", "stated domain"), rows)


def models(
    plugins: Sequence[ForceModel | str | Path] = (),
    *,
    pattern: str = "*",
    family: str | None = None,
    search: str | None = None,
) -> Models:
    """The catalogue of contact force models, by key, or a part of it.

    Parameters
    ----------
    plugins : plug-in models, and paths of Python files with such models, which come last
    pattern : pattern of the keys, such as "lammps-*", or a family as in a config, such as "family:hysteresis"
    family : name of the family; by default all families
    search : words that all have to occur in the key, title, year, equation, reference or DOI, in any case

    Raises
    ------
    UsageError : no model matches the pattern or the words, or there is no such family
    ModelError : a plug-in cannot be read or is invalid

    >>> import impact
    >>> impact.models()["gharib-hurmuzlu-2012"].equation
    'F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)'
    >>> list(impact.models(pattern="lankarani-*"))
    ['lankarani-nikravesh-1990', 'lankarani-nikravesh-1994']
    """
    all_models = catalogue(read_plugins(plugins).models)
    families = sorted({model.family for model in all_models.values()})
    if pattern.startswith("family:"):
        pattern, family = "*", pattern.removeprefix("family:")
    if family is not None and family not in families:
        raise UsageError(f'--family: no family "{safe_text(family)}"; {did_you_mean(family, families)}')
    of_family = {key: model for key, model in all_models.items() if family in (None, model.family)}
    matching = {key: model for key, model in of_family.items() if fnmatchcase(key, pattern)}
    if not matching:
        raise UsageError(
            f'no model matches "{safe_text(pattern)}"; {did_you_mean(pattern.strip("*?"), list(of_family))}'
        )
    if search is not None:
        words = search.casefold().split()
        matching = {key: model for key, model in matching.items() if _contains(model, words)}
        if not matching:
            raise UsageError(
                f'--search: no model has "{safe_text(search, 60)}" in its title, equation or reference'
            )
    return Models(matching)


def _contains(model: ForceModel, words: Sequence[str]) -> bool:
    """Whether all words occur in what is written about a model."""
    about = (model.key, model.family, model.title, str(model.year), model.equation, model.reference, model.doi)
    text = " ".join(about).casefold()
    return all(word in text for word in words)


def check_model(model: ForceModel) -> list[Finding]:
    """Check a model, such as a plug-in, against every clause of the contract, with forty dissimilar impacts.

    Returns
    -------
    list of Finding : the clause, the largest deviation, its bound, and whether the clause holds

    Warns
    -----
    UserWarning : a formula raised an error, with its file, line and text

    >>> import impact
    >>> all(finding.holds for finding in impact.check_model(impact.models()["bilinear"]))
    True
    """
    # its module integrates, which a program that only imports impact does without
    from .contact.checks import contract

    return list(contract(model))


def plot(
    dataset: xr.Dataset | Impact,
    *,
    kind: str | None = None,
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
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
    dataset : a result, a time history, or an impact of `run`
    kind : one of `impact.plots.kinds.KINDS`; by default "final-velocities", "uncertainty" for samples of uncertain
        inputs, "loop" for an impact, or "calibration" or "sensitivity" for the result of that function
    x : the coordinate to draw over; by default e, else the first numeric axis
    y : second axis of a map, or of the kind validity; by default the next one
    variable : name of the variable that a map or a band shows; by default e_error for a map, e_out for a band
    sel : values of the other axes, such as `{"m2": 1.0}`; the default is the first value. A loop, a history
        or an impulse may be at a point that is not on the grid
    models : keys of the models to show; by default all
    log : which axes are logarithmic, such as "x" or "xy"; axes with logarithmic spacing are in any case
    points : measured points over the curves: a CSV file, or a table of pandas or xarray, whose columns have names
        such as "v1 [m/s]", "e_out" and "sigma"
    width : width of the figure [in], or a length such as "84mm", "single" or "double"; by default that of rcParams
        if it was changed, else "double"
    height : height of the figure [in], or a length; by default it depends on the kind
    style : a style sheet of matplotlib, or the name of one; rcParams changed by the user are respected in any case
    title : write the title and the conditions
    labels : texts by the name of an axis, of a variable whose name is beside its curve, the key of a law,
        "reference" or "title"
    equations : name the laws with the numbers of their equations in the paper
    ax : axes of an existing figure to draw into, one for each panel, in the style of that figure
    plugins : plug-in models that the result was computed with, needed to draw a loop, a history or an impulse

    Returns
    -------
    matplotlib.figure.Figure : `figure.savefig("results.png")` writes it; a notebook shows it

    Raises
    ------
    UsageError : the result does not contain what the arguments select

    >>> import impact
    >>> figure = impact.plot(impact.sweep("configs/figure6.toml"))
    >>> figure.axes[0].get_xlabel()
    'Coefficient of restitution $e$'
    """
    from .plots.kinds import Choice, default_kind, draw

    if isinstance(dataset, Impact):
        if dataset.history is None:
            raise UsageError(f"no motion to draw: {dataset.why_no_history}")
        dataset = dataset.history
    choice = Choice(x, y, variable, sel, models, log, equations)
    plot_data = get_plot_data(dataset, kind or default_kind(dataset), choice, plugins)
    return draw(plot_data, width, height, style=style, title=title, labels=labels, points=points, ax=ax)


def explore(dataset: xr.Dataset, *, plugins: Sequence[ForceModel | str | Path] = ()) -> VBox:
    """Show a result with controls in a notebook: the kind of picture, the models, and a slider for each axis.

    Parameters
    ----------
    dataset : a result
    plugins : see `plot`

    Returns
    -------
    ipywidgets.VBox : a notebook shows it as the value of a cell; needs the extra `notebook`

    Raises
    ------
    UsageError : it is no result with models, or ipywidgets is not installed

    >>> import impact
    >>> controls = impact.explore(impact.sweep("configs/figure6.toml"))
    """
    from .plots.explore import explore as show_controls

    return show_controls(dataset, partial(plot, dataset, plugins=plugins))


def plot_to_files(
    result: str | Path,
    output: str | Path | None = None,
    *,
    kinds: Sequence[str] = (),
    x: str | None = None,
    y: str | None = None,
    variable: str | None = None,
    sel: Mapping[str, float | str] | None = None,
    models: Sequence[str] | None = None,
    log: str = "",
    points: str | Path | None = None,
    width: float | str | None = None,
    height: float | str | None = None,
    style: str | Path | None = None,
    title: bool = True,
    labels: Mapping[str, str] | None = None,
    equations: bool = False,
    data: str | Path | None = None,
    data_form: str = "wide",
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> PlotFiles:
    """Draw a stored result into a file for each kind of picture.

    Kinds that the result does not have the data for are left out; it is an error if none can be drawn. Of
    several kinds, one that `sel` leaves no axis, while another is drawn, is drawn over the whole axis.

    Parameters
    ----------
    result : file of a result, or of a time history
    output : the picture, with the ending of its format; by default the result's name with .png. The name of each
        of several kinds has the kind in it
    kinds : see `impact.plots.kinds.KINDS`
    data : file for the numbers behind the picture: .csv, .tex or .parquet
    data_form : "wide", a column for each curve, or "long", a row for each point
    overwrite : replace existing files
    x, y, variable, sel, models, log, points, width, height, style, title, labels, equations, plugins : see `plot`

    Returns
    -------
    PlotFiles : by kind the picture and its data, and the reason why a kind is left out

    Raises
    ------
    UsageError : no kind can be drawn, an argument is invalid, or a file exists
    ResultError : the result is not readable
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/r.h5")
    ...     [path.name for path in impact.plot_to_files(f"{folder}/r.h5").pictures.values()]
    ['r.png']
    """
    from .plots.data import check_table, encode_table, read_points
    from .plots.kinds import Choice, check_kind, data_of_kinds, default_kind, draw, label_keys
    from .plots.labels import check_labels
    from .plots.style import check_picture, length, save_figure

    choice = Choice(x, y, variable, sel, models, log, equations)
    kinds = list(dict.fromkeys(kinds))
    for kind in kinds:
        check_kind(kind)
    size = length(width, "--width"), length(height, "--height")
    result = Path(result)
    output = Path(output) if output is not None else result.with_suffix(".png")
    check_picture(output)
    if data is not None:
        check_table(Path(data), data_form)

    def path_of(kind: str, path: str | Path) -> Path:
        path = Path(path)
        return path if len(kinds) < 2 else path.with_name(f"{path.stem}-{kind}{path.suffix}")

    # the default depends on the result, which is read after the paths are checked
    pictures = {kind: path_of(kind, output) for kind in kinds or [""]}
    tables = {kind: path_of(kind, data) for kind in pictures} if data is not None else {}
    check_outputs([*pictures.values(), *tables.values()], [result, points], overwrite=overwrite)
    measured = None if points is None else read_points(points)
    dataset = load(result)
    if not kinds:
        kinds = [default_kind(dataset)]
        pictures = dict.fromkeys(kinds, pictures[""])
        tables = dict.fromkeys(kinds, tables[""]) if tables else {}
    of_kinds, left_out = data_of_kinds(kinds, dataset, choice, _histories_of(dataset, choice, plugins))
    if of_kinds:
        check_labels(labels or {}, label_keys(of_kinds.values(), title=title))
    drawn: dict[str, PlotData] = {}
    for kind, plot_data in of_kinds.items():
        keys = label_keys([plot_data], title=title)
        of_picture = {key: text for key, text in (labels or {}).items() if key in keys}
        try:
            figure = draw(plot_data, *size, style=style, title=title, labels=of_picture, points=measured)
            table = encode_table(plot_data, tables[kind].suffix.lower(), data_form) if tables else b""
        except UsageError as error:
            left_out[kind] = str(error)
            continue
        save_figure(figure, pictures[kind], overwrite=overwrite, style=style)
        if tables:
            write_file(tables[kind], table, overwrite=overwrite)
        drawn[kind] = plot_data
    if not drawn:
        raise UsageError(*dict.fromkeys(left_out.values()))
    return PlotFiles({kind: pictures[kind] for kind in drawn}, drawn, left_out)


def get_plot_data(
    dataset: xr.Dataset, kind: str, choice: Choice, plugins: Sequence[ForceModel | str | Path] = ()
) -> PlotData:
    """The data of a picture; see `plot`."""
    from .plots.kinds import plot_data_of

    return plot_data_of(kind, dataset, choice, _histories_of(dataset, choice, plugins))


def _histories_of(
    dataset: xr.Dataset, choice: Choice, plugins: Sequence[ForceModel | str | Path]
) -> Callable[[], list[xr.Dataset]]:
    """A function that integrates the chosen point of a result again."""
    plugin_set = read_plugins(plugins)
    return lambda: histories(dataset, choice.models, choice.sel or {}, plugin_set)


def materials() -> dict[str, dict[str, float | str]]:
    """Common materials in SI units, which a config can name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] if known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return {name: dict(record) for name, record in records().items()}


def report(
    dataset: xr.Dataset | str | Path,
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
) -> str:
    """A result as one page of HTML, which needs no network and runs no scripts.

    Parameters
    ----------
    dataset : a result, or the file of one
    output : file to write the page to as well, whose name ends in .html
    overwrite : replace the output if it exists
    plugins : plug-in models that the result was computed with; without them the figures of a motion are left out

    Raises
    ------
    UsageError, ResultError : it is a time history, or its attributes are not those of a result; the output exists,
        or has another ending

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml", overrides=["models=hertz", "sweep.e=[0.5, 1.0]"])
    >>> "<h1>Final velocities comparison</h1>" in impact.report(result)
    True
    """
    from .reporting.page import page

    if output is not None:
        output = Path(output)
        if output.suffix.lower() not in (".html", ".htm"):
            raise UsageError(f"{safe_text(str(output))}: expected a name that ends in .html")
        check_outputs([output], [dataset, *plugins], overwrite=overwrite)
    result = load(dataset) if isinstance(dataset, str | Path) else dataset
    text = page(result, lambda kind, choice: get_plot_data(result, kind, choice, plugins))
    if output is not None:
        write_file(output, text.encode(), overwrite=overwrite)
    return text


def init(path: str | Path = "config.toml", *, overwrite: bool = False) -> None:
    """Write a commented starter config, ready to sweep.

    Raises
    ------
    UsageError : the file exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.init(f"{folder}/config.toml")
    ...     impact.estimate(f"{folder}/config.toml").points > 0
    True
    """
    write_file(Path(path), STARTER_CONFIG.read_bytes(), overwrite=overwrite)


def schema(output: str | Path | None = None, *, overwrite: bool = False) -> dict[str, Any]:
    """The JSON Schema of a config, from which editors complete and check it.

    Parameters
    ----------
    output : file to write it to as well
    overwrite : replace the output if it exists

    Raises
    ------
    UsageError : the output exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact
    >>> impact.schema()["required"]
    ['models', 'sweep']
    """
    content = json_schema()
    if output is not None:
        text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return content
