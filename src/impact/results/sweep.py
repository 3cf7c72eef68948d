"""Run a sweep: in memory, or into a file that appears when it is complete; finished trajectories are kept."""

from __future__ import annotations

import errno
import itertools
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import xarray as xr

from ..atomic import atomic_write, check_output, check_outputs, check_result_name
from ..config.draft import Setting, reject_law_key, settings_of
from ..config.grid import MAX_POINTS
from ..config.input_names import InputName
from ..config.load import read_config
from ..contact.model import ForceModel
from ..contact.records import Record
from ..engine import checkpoint
from ..engine.execute import integrate_ranges
from ..engine.executors import SERIAL, ExecutorSpec, choose_executor
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..engine.run import DEFAULT_RUN, ProgressCallback, ProgressCounter, Run, ignore, never, report_kept_ranges
from ..engine.trajectories import RANGE_TRAJECTORIES, TrajectoryRange
from ..errors import InUseError, ResultError, StoreError, UnfinishedError, UsageError, warn
from ..formatting import argument
from .layouts import file_template, stiffness_to_store, table_values
from .netcdf import MAX_LABEL_BYTES, RegionValues, encode_text, is_text
from .schema import dataset_template, plan_coordinates, stored_variables
from .seal import has_seal
from .summary import Summary, SweepOutcome, input_notes, result_notes, summarize, summarize_table, with_depths
from .trajectory_table import TrajectoryTable, expanded_slabs, in_memory, lazy_dataset, table_of_ranges
from .validation import is_name
from .xarray_backend import MAX_LOADED_BYTES, load, open_result, write_sealed

# approximate bytes of a result besides its values
OVERHEAD_BYTES = 2**16
# smaller sweeps of one range have no checkpoint: they are repeated faster than read
NO_CHECKPOINT_POINTS = 2**20
# a factored result of more points has their summary in its file: a reader would take long to compute it
NO_SUMMARY_POINTS = 2**20


def sweep(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    models: str | Sequence[str] | None = None,
    frictions: str | Sequence[str] | None = None,
    output: str | Path | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
    threads: int = 1,
    executor: Executor | None = None,
    max_points: int = MAX_POINTS,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = False,
    **inputs: Any,
) -> xr.Dataset:
    """Run a sweep; the result is in memory, or in a file and of any size.

    Parameters
    ----------
    source : path of a TOML file, or a mapping of the same shape; by default the starter config, the two balls of
        Table 1 of the paper
    models, frictions : keys of laws, in place of those of the source
    inputs : of `[sweep]`, in place of those of the source, such as `e=[0.1, 0.9]`, `v1="50 cm/s"` or `cases=table`
        with a column for each input
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

    Warns
    -----
    ImpactWarning : an input or the result is probably not what was intended

    >>> import impact
    >>> result = impact.sweep({
    ...     "models": ["lankarani-nikravesh-1990"],
    ...     "sweep": {"e": [0.1, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
    ... })
    >>> result["e_out"].values.round(6).tolist()
    [[0.665265, 0.913177]]
    >>> impact.sweep(models="lankarani-nikravesh-1990", e=[0.1, 0.9])["e_out"].values.round(6).tolist()
    [[0.665265, 0.913177]]
    """
    laws = {key: value for key, value in (("models", models), ("frictions", frictions)) if value is not None}
    # the path of laws is the name of the argument
    changes = [Setting((key,), value, "") for key, value in laws.items()]
    changes += [Setting(("sweep", name), value, name) for name, value in inputs.items()]
    settings = settings_of(overrides)
    for setting, change in itertools.product(settings, changes):
        if setting.path[: len(change.path)] == change.path:
            raise UsageError(f"{change.path[-1]}: set together with {setting.shown}, expected one of the two")
    settings += changes
    if output is None and (resume or overwrite):
        raise UsageError("resume and overwrite: got no output, expected one as well")
    reject_law_key(source, "models")
    backend = choose_executor(jobs, threads, executor)
    bar: AbstractContextManager[ProgressCallback] = nullcontext(ignore)
    if progress:
        # imported here: rich is slow to import
        from ..progress_display import progress_bar

        bar = progress_bar()
    with bar as on_progress:
        if output is None:
            run = Run(backend, max_points=max_points, on_progress=on_progress)
            result = sweep_in_memory(read_plan(source, settings, plugins, run), run)
            summary = with_depths(summarize(result), result)
        else:
            outcome = sweep_to_file(
                source,
                output,
                overrides=settings,
                plugins=plugins,
                backend=backend,
                max_points=max_points,
                resume=resume,
                overwrite=overwrite,
                on_progress=on_progress,
            )
            result, summary = load(output), outcome.summary
    warn(*result_notes(summary))
    return result


def sweep_to_file(
    source: str | Path | Mapping[str, object] | None,
    output: str | Path,
    *,
    overrides: Sequence[str | Setting] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[ExecutorSpec] | None = None,
    max_points: int = MAX_POINTS,
    resume: bool = False,
    overwrite: bool = False,
    on_progress: ProgressCallback | None = None,
    on_note: Callable[[str], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SweepOutcome:
    """Run a sweep into a file and summarize it, without reading the file again.

    A file that already contains this sweep is not modified.

    Parameters
    ----------
    source, overrides, plugins, max_points : see `sweep`
    output : the file
    backend : what integrates, entered when it is needed; by default this process
    resume : continue with the work folder of an interrupted sweep
    overwrite : replace the file if it exists
    on_progress : called from time to time with the progress
    on_note : called with a sentence about each implausible value; by default an `ImpactWarning`
    should_stop : returns whether to stop; finished ranges stay in the work folder

    Returns
    -------
    SweepOutcome : counts of points by status, largest errors, first failed points

    Raises
    ------
    ConfigError : with all problems of the config
    UsageError, ModelError : see `sweep`
    InUseError : another process writes the file
    StoreError : the disk is full or failed, or processes were killed; finished ranges stay in the work folder
    UnfinishedError : `should_stop` stopped it

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     outcome = impact.sweep_to_file("configs/figure6.toml", f"{folder}/results.h5")
    >>> outcome.summary.points, outcome.trajectories, outcome.is_new
    (303, 303, True)
    """
    told = on_progress or ignore, on_note or warn, should_stop or never
    run = Run(backend or SERIAL, resume, overwrite, max_points, *told)
    plan = read_plan(source, overrides, plugins, run)
    output = Path(output)
    outcome = None if overwrite else find_finished(output, plan)
    if outcome is not None:
        checkpoint.remove_stale_work_folder(output, plan)
        run.check_stop(f"{output} already contains this sweep")
        return outcome
    check_outputs([output], [source, *plugins, *plan.config.files], overwrite=overwrite)
    check_result_name(output)
    with run.connected() as connected:
        outcome = sweep_into(output, plan, connected)
    run.check_stop(f"{output} is complete")
    return outcome


def read_plan(
    source: str | Path | Mapping[str, object] | None,
    overrides: Sequence[str | Setting] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    run: Run = DEFAULT_RUN,
) -> Plan:
    """Read a config and its plug-ins, and report values that are implausible."""
    plugin_set = read_plugins(plugins)
    config = read_config(source, overrides, plugin_set.models, run.max_points)
    plan = Plan(config, plugin_set.of(config.models))
    name = str(source) if isinstance(source, str | Path) else "config"
    plan.check_count(run.max_points, name)
    has_density = source is not None or config.sets_material
    implausible = input_notes(plan.inputs, has_density=has_density)
    for note in (*config.notes, *implausible, *plan.pair_notes(f"{name}: frictions")):
        run.on_note(note)
    return plan


def sweep_in_memory(plan: Plan, run: Run = DEFAULT_RUN) -> xr.Dataset:
    """Run a plan; a small result is in memory, a large one is computed when it is indexed."""
    check_labels(plan)
    try:
        table, _ = _integrate_in_memory(plan, run)
        run.check_stop()
    except UnfinishedError:
        raise UnfinishedError("nothing was written") from None
    dataset = lazy_dataset(dataset_template(plan), table, stored_variables(plan))
    return in_memory(dataset) if dataset.nbytes <= MAX_LOADED_BYTES else dataset


def sweep_into(output: Path, plan: Plan, run: Run = DEFAULT_RUN) -> SweepOutcome:
    """Run a plan, and store its result; raises what `sweep_to_file` does."""
    may_replace = run.overwrite or plan.replaces
    check_output(output, overwrite=may_replace)
    check_storable(plan)
    few = plan.stored_points <= NO_CHECKPOINT_POINTS or plan.layout == "factored"
    folder = checkpoint.work_folder_of(output)
    # slips take longer
    most = RANGE_TRAJECTORIES // 64 if plan.frictions else RANGE_TRAJECTORIES
    if plan.trajectories <= most and few and not os.path.lexists(folder):
        # so short that it is neither stopped nor reported
        table, counter = _integrate_in_memory(plan, DEFAULT_RUN)
        try:
            return store_result(output, plan, table, counter, run)
        except UnfinishedError:
            raise UnfinishedError("nothing was written") from None

    counter = ProgressCounter(plan.ranges, plan.points, run)
    with checkpoint.open_work_folder(folder, plan, run) as work_folder:
        # another process may have stored it in the meantime
        check_output(output, overwrite=may_replace)
        # without --overwrite, an existing result would be refused
        replaces = os.path.lexists(output) and not plan.extends
        again = " ".join(argument(name, True) for name in ("resume", "overwrite")[: 1 + replaces])
        with report_kept_ranges(
            folder, counter, again, lambda error: _missing_space(error, output, plan, counter)
        ):
            complete_ranges(work_folder, plan, plan.ranges, counter)
            table = table_of_ranges(plan, partial(reload_range, work_folder))
            outcome = store_result(output, plan, table, counter, run, checkpoint.partial_file_of(output))
        checkpoint.remove_work_folder(folder)
    return outcome


def _integrate_in_memory(plan: Plan, run: Run) -> tuple[TrajectoryTable, ProgressCounter]:
    """Integrate all ranges of a plan without a work folder."""
    finished: dict[TrajectoryRange, Record] = {}
    counter = ProgressCounter(plan.ranges, plan.points, run)
    integrate(plan, plan.ranges, finished.__setitem__, counter)
    return table_of_ranges(plan, finished.__getitem__), counter


def complete_ranges(
    work_folder: checkpoint.WorkFolder, plan: Plan, ranges: Sequence[TrajectoryRange], counter: ProgressCounter
) -> None:
    """Integrate the ranges that a work folder does not have yet."""
    todo: list[TrajectoryRange] = []
    for number, trajectory_range in enumerate(ranges):
        if counter.run.should_stop():
            # those that are not read are kept as well
            counter.add(sum(part.size for part in ranges[number:] if work_folder.path(part).is_file()))
            raise UnfinishedError
        stored = work_folder.load(trajectory_range)
        if stored is None:
            todo.append(trajectory_range)
        else:
            counter.count(trajectory_range, stored)
    counter.report()
    integrate(plan, todo, work_folder.store, counter)


def integrate(
    plan: Plan,
    ranges: Sequence[TrajectoryRange],
    store: Callable[[TrajectoryRange, Record], None],
    counter: ProgressCounter,
) -> None:
    """Integrate ranges, and store and count each; an `UnfinishedError` if some are missing in the end."""
    for trajectory_range, collisions in integrate_ranges(plan, ranges, counter.run):
        store(trajectory_range, collisions)
        counter.count(trajectory_range, collisions)
        counter.report()
    if counter.progress.trajectories < counter.progress.of_trajectories:
        raise UnfinishedError


def reload_range(work_folder: checkpoint.WorkFolder, trajectory_range: TrajectoryRange) -> Record:
    """Load a finished range, or raise a `StoreError` if it is damaged."""
    collisions = work_folder.load(trajectory_range)
    if collisions is None:
        raise StoreError(f"{work_folder.path(trajectory_range)}: can no longer be read")
    return collisions


def check_storable(plan: Plan) -> None:
    """Refuse a plan whose labels are too long or whose laws cannot be factored, before integration."""
    check_labels(plan)
    for law in plan.models if plan.layout == "factored" else ():
        stiffness_to_store(plan.inputs, law)


def check_labels(plan: Plan) -> None:
    """Refuse labels that are too long, and axes of materials with names that a file cannot hold."""
    columns = [name for axis in plan.config.axes for name in axis.columns]
    odd = [name for name in columns if InputName.parse(name).material and not is_name(name)]
    if odd:
        raise UsageError(f"{odd[0]}: expected a material name without spaces and slashes, to be an axis")
    coordinates = plan_coordinates(plan).values()
    size = sum(encode_text(coordinate).size for coordinate in coordinates if is_text(coordinate))
    if size > MAX_LABEL_BYTES:
        raise UsageError(
            f"its labels take {size:,} bytes, expected at most {MAX_LABEL_BYTES:,}; use shorter names of materials"
        )


def find_finished(path: Path, plan: Plan) -> SweepOutcome | None:
    """Open and summarize a file that has the whole result of a plan; None for any other file."""
    # a model without a hash cannot be compared; pathlib would raise an error for a name that is too long
    if None in plan.plugins.hashes.values() or os.path.islink(path) or not os.path.isfile(path):
        return None
    try:
        dataset = open_result(path)
    except ResultError:
        return None
    if not is_whole(dataset, plan):
        dataset.close()
        return None
    return SweepOutcome(dataset, summarize(dataset), plan.trajectories, is_new=False, output=path)


def is_whole(dataset: xr.Dataset, plan: Plan) -> bool:
    """Whether a dataset is the result of a plan: neither a part of it, nor sorted along an axis."""
    return (
        dataset.attrs.get("fingerprint") == plan.fingerprint
        and dict(dataset.sizes) == plan.sizes
        and all(variable.name in dataset for variable in stored_variables(plan))
        and all(tuple(dataset[axis.name].values.tolist()) == axis.labels for axis in plan.config.axes)
    )


def _missing_space(error: Exception, output: Path, plan: Plan, counter: ProgressCounter) -> list[str]:
    """State the missing disk space, if the disk is full."""
    cause = error.__cause__
    if not isinstance(cause, OSError) or cause.errno not in (errno.ENOSPC, errno.EDQUOT):
        return []
    row = max(trajectory_map.record.row_bytes() for trajectory_map in plan.maps)
    result = counter.progress.of_trajectories * row if plan.layout == "factored" else dataset_template(plan).nbytes
    needed = result + OVERHEAD_BYTES + (counter.progress.of_trajectories - counter.progress.trajectories) * row
    free = shutil.disk_usage(output.parent).free
    return [f"it takes {needed:,} bytes more, {free:,} are free"]


def store_result(
    output: Path,
    plan: Plan,
    table: TrajectoryTable,
    counter: ProgressCounter,
    run: Run,
    part: Path | None = None,
) -> SweepOutcome:
    """Write the result of a trajectory table in the layout of its plan; `part` is the temporary name."""
    progress, result, summary = counter.progress, dataset_template(plan), Summary()
    if plan.history:
        result = result.assign_attrs(extended=plan.history)
    template, variables = file_template(result, plan, table), stored_variables(plan)
    if plan.layout == "factored":
        result = lazy_dataset(result, table, variables)
        summary, record = summarize_table(result, table)
        summary = with_depths(summary, result)
        if plan.stored_points > NO_SUMMARY_POINTS:
            template = template.assign_attrs(summary=record.model_dump_json(exclude_defaults=True))

    def report(points: int) -> None:
        run.on_progress(replace(progress, points=points, failed=max(summary.failed, progress.failed)))
        run.check_stop()

    def values() -> Iterator[RegionValues]:
        if plan.layout == "factored":
            for stored in table_values(table, variables):
                yield stored
                report(0)
            return
        chunks = plan.config.output.chunks
        lengths = [chunks.get(axis.name, axis.size) for axis in plan.config.axes] if chunks else []
        for slab in expanded_slabs(table, variables, lengths):
            plan.fill(slab)
            for name, array in slab.values.items():
                yield name, slab.region_in(result[name].dims), array
            summary.add_slab(table, slab)
            report(summary.points)

    def check() -> None:
        if plan.replaces and not has_seal(output, plan.extends):
            raise InUseError(f"{output}: was changed while it was extended, and is not modified; extend it again")

    with atomic_write(output, overwrite=run.overwrite or plan.replaces, part=part, check=check) as sink:
        seal = write_sealed(sink, output, template, values(), plan.config.output)
    result.encoding = {"source": str(output), "seal": seal, "layout": plan.layout}
    return SweepOutcome(result, summary, progress.of_trajectories, output=output)
