"""Run a sweep into a file: finished trajectories are kept, and the file appears when it is complete."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..atomic import atomic_write, check_output
from ..config.input_names import InputName
from ..contact.impacts import Impacts
from ..contact.simulate import TABLE_COLUMNS, CollisionResult
from ..engine.checkpoint import WorkFolder, open_work_folder, partial_file_of, remove_work_folder, work_folder_of
from ..engine.execute import FindReused, integrate_ranges, never_stop, with_core
from ..engine.executors import SERIAL, Backend
from ..engine.plan import Plan
from ..engine.progress import ProgressCallback, ProgressCounter, report_kept_blocks
from ..engine.trajectories import (
    RANGE_TRAJECTORIES,
    TrajectoryMap,
    TrajectoryRange,
    even_size,
    trajectory_maps,
    trajectory_ranges,
)
from ..errors import ResultError, StoreError, UnfinishedError, UsageError
from ..text import safe_text
from .factored import check_factored, factored_template, table_values
from .netcdf import MAX_LABEL_BYTES, encode_text, is_text
from .schema import SchemaVariable, dataset_template, plan_coordinates, stored_variables
from .summary import Summary, SweepOutcome, summarize, summarize_table, summary_record
from .trajectory_table import TrajectoryTable, expanded_slabs, in_memory, lazy_dataset, table_of
from .validation import is_name
from .xarray_backend import MAX_LOADED_BYTES, check_readable, open_result, write_sealed

# approximate bytes of a result besides its values
OVERHEAD_BYTES = 2**16
# smaller sweeps of one range have no checkpoint: they are repeated faster than read
NO_CHECKPOINT_POINTS = 2**20

SlabValues = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Extension:
    """What a sweep takes over from an old result, see `impact.results.extend`.

    Parameters
    ----------
    seal : of the old result
    note : JSON text for the attribute `extended` of the new result
    find_reused : returns the trajectories of a range that are not integrated again
    fill : copies old values into a slab: `fill(model, region, values)`; None if all values are computed from
        trajectories
    """

    seal: str
    note: str
    find_reused: FindReused
    fill: Callable[[int, tuple[slice, ...], SlabValues], None] | None = None


def sweep_into(
    output: Path,
    plan: Plan,
    *,
    resume: bool = False,
    overwrite: bool = False,
    in_place: bool = False,
    backend: Backend = SERIAL,
    on_progress: ProgressCallback = lambda progress: None,
    should_stop: Callable[[], bool] = never_stop,
    extension: Extension | None = None,
) -> SweepOutcome:
    """Run a plan, and store its result.

    Parameters
    ----------
    output : the file
    plan : what to run
    resume : continue with the work folder that an interrupted sweep left
    overwrite : replace the file if it exists, and a work folder if it is not to be resumed
    in_place : replace the file, but not a work folder
    backend : processes, threads or workers that integrate
    on_progress : called with the progress from time to time
    should_stop : the sweep stops if it returns True; ranges that are running are finished and kept
    extension : values and trajectories of an old result

    Raises
    ------
    UsageError : the output or the work folder exists and must not be replaced
    InUseError : another process writes the output
    StoreError : the disk is full or failed, or processes were killed; finished ranges are kept
    UnfinishedError : the sweep was stopped; finished ranges are kept
    """
    check_output(output, overwrite=overwrite or in_place)
    check_storable(plan)
    maps = trajectory_maps(plan)
    plan = with_core(plan, maps)
    ranges = list(trajectory_ranges(maps))
    total = sum(trajectory_map.count for trajectory_map in maps)
    counter = ProgressCounter.start(total, plan.points, on_progress)
    find_reused = extension.find_reused if extension else lambda part: None
    few = plan.stored_points <= NO_CHECKPOINT_POINTS or plan.layout == "factored"
    if total <= RANGE_TRAJECTORIES and few and not os.path.lexists(work_folder_of(output)):
        finished = {}
        for part, rebound in integrate_ranges(plan, maps, ranges, find_reused=find_reused):
            finished[part.number] = rebound
            counter.count(part, rebound)
        table = table_of(plan, maps, range_reader(maps, finished.__getitem__))
        try:
            return store_result(output, plan, table, None, overwrite or in_place, counter, should_stop, extension)
        except UnfinishedError:
            raise UnfinishedError("nothing was written") from None

    folder = work_folder_of(output)
    with open_work_folder(
        folder, plan, resume=resume, overwrite=overwrite, extends=extension.seal if extension else ""
    ) as work_folder:
        # another process may have stored it in the meantime
        check_output(output, overwrite=overwrite or in_place)
        # without --overwrite, an existing result would be refused
        again = "--resume --overwrite" if os.path.lexists(output) and not extension else "--resume"
        with report_kept_blocks(
            folder, counter, again, lambda error: _missing_space(error, output, plan, counter)
        ):
            complete_ranges(work_folder, plan, maps, ranges, counter, backend, should_stop, find_reused)
            table = table_of(
                plan, maps, range_reader(maps, lambda number: reload_range(work_folder, ranges[number]))
            )
            outcome = store_result(
                output,
                plan,
                table,
                partial_file_of(output),
                overwrite or in_place,
                counter,
                should_stop,
                extension,
            )
        remove_work_folder(folder)
    return outcome


def complete_ranges(
    work_folder: WorkFolder,
    plan: Plan,
    maps: Sequence[TrajectoryMap],
    ranges: Sequence[TrajectoryRange],
    counter: ProgressCounter,
    backend: Backend,
    should_stop: Callable[[], bool],
    find_reused: FindReused = lambda part: None,
) -> None:
    """Integrate the ranges that a work folder does not have yet.

    Raises
    ------
    StoreError, UsageError : see `sweep_into`
    UnfinishedError : the sweep was stopped
    """
    todo: list[TrajectoryRange] = []
    for part in ranges:
        before = None if should_stop() else work_folder.load(part)
        if before is None:
            todo.append(part)
        else:
            counter.count(part, before)
    counter.report()
    for part, rebound in integrate_ranges(
        plan, maps, todo, backend=backend, should_stop=should_stop, find_reused=find_reused
    ):
        work_folder.store(part, rebound)
        counter.count(part, rebound)
        counter.report()
    if not counter.is_full:
        raise UnfinishedError


def sweep_in_memory(
    plan: Plan, *, backend: Backend = SERIAL, on_progress: ProgressCallback, should_stop: Callable[[], bool]
) -> xr.Dataset:
    """Run a plan; a small result is in memory, a large one is computed when it is indexed.

    For the parameters see `sweep_into`.

    Raises
    ------
    UnfinishedError : the sweep was stopped; nothing is kept
    """
    check_labels(plan)
    maps = trajectory_maps(plan)
    plan = with_core(plan, maps)
    counter = ProgressCounter.start(sum(trajectory_map.count for trajectory_map in maps), plan.points, on_progress)
    finished: dict[int, CollisionResult] = {}
    for part, rebound in integrate_ranges(
        plan, maps, trajectory_ranges(maps), backend=backend, should_stop=should_stop
    ):
        finished[part.number] = rebound
        counter.count(part, rebound)
        counter.report()
    if not counter.is_full or should_stop():
        raise UnfinishedError("nothing was written")
    table, variables = table_of(plan, maps, range_reader(maps, finished.__getitem__)), stored_variables(plan)
    dataset = lazy_dataset(dataset_template(plan), table, variables)
    return in_memory(dataset, table, variables) if dataset.nbytes <= MAX_LOADED_BYTES else dataset


def range_reader(
    maps: Sequence[TrajectoryMap], load: Callable[[int], CollisionResult]
) -> Callable[[int, int, int], CollisionResult]:
    """The `read` function of `TrajectoryRows` for finished ranges; `load` returns a range by its number."""
    first_range = np.cumsum([0, *(-(-trajectory_map.count // RANGE_TRAJECTORIES) for trajectory_map in maps)])

    def read(model: int, start: int, stop: int) -> CollisionResult:
        return load(int(first_range[model]) + start // even_size(maps[model].count, RANGE_TRAJECTORIES))

    return read


def reload_range(work_folder: WorkFolder, part: TrajectoryRange) -> CollisionResult:
    """Load a finished range.

    Raises
    ------
    StoreError : it is damaged
    """
    rebound = work_folder.load(part)
    if rebound is None:
        raise StoreError(f"{safe_text(str(work_folder.path(part.number)))}: can no longer be read")
    return rebound


def check_storable(plan: Plan) -> None:
    """Refuse a plan whose result could not be stored, before integration.

    Raises
    ------
    UsageError : its labels are too long, or a law cannot be factored
    """
    check_labels(plan)
    if plan.layout == "factored":
        check_factored(plan.inputs, plan.models)


def check_labels(plan: Plan) -> None:
    """Refuse a plan whose labels could not be read again, before integration.

    Raises
    ------
    UsageError : they are too long, or a material with an axis has a name that a file cannot hold
    """
    columns = [name for axis in plan.config.axes for name in axis.columns]
    odd = [name for name in columns if InputName.parse(name).material and not is_name(name)]
    if odd:
        raise UsageError(
            f"{safe_text(odd[0])}: expected a material name without spaces and slashes, to be an axis"
        )
    coordinates = plan_coordinates(plan).values()
    size = sum(encode_text(coordinate).size for coordinate in coordinates if is_text(coordinate))
    if size > MAX_LABEL_BYTES:
        raise UsageError(
            f"its labels take {size:,} bytes, expected at most {MAX_LABEL_BYTES:,}; use shorter names of materials"
        )


def find_finished(path: Path, plan: Plan) -> SweepOutcome | None:
    """The result in a file, if it is the whole result of a plan; else None."""
    # a model without a hash cannot be compared; pathlib would raise an error for a name that is too long
    if None in plan.plugins.hashes.values() or os.path.islink(path) or not os.path.isfile(path):
        return None
    try:
        dataset = open_result(path)
    except ResultError:
        return None
    if dataset.attrs.get("fingerprint") != plan.fingerprint:
        dataset.close()
        return None
    axes = dict(zip((axis.name for axis in plan.config.axes), plan.shape, strict=True))
    if dict(dataset.sizes) != {"model": len(plan.models), **axes}:
        dataset.close()
        return None
    trajectories = sum(trajectory_map.count for trajectory_map in trajectory_maps(plan))
    return SweepOutcome(dataset, summarize(dataset), trajectories)


def _missing_space(error: Exception, output: Path, plan: Plan, counter: ProgressCounter) -> list[str]:
    """A sentence with the missing disk space, if the disk is full."""
    cause = error.__cause__
    if not isinstance(cause, OSError) or cause.errno not in (errno.ENOSPC, errno.EDQUOT):
        return []
    row = sum(getattr(CollisionResult.blank(1), name).nbytes for name in TABLE_COLUMNS)
    result = counter.progress.of_trajectories * row if plan.layout == "factored" else dataset_template(plan).nbytes
    needed = result + OVERHEAD_BYTES + (counter.progress.of_trajectories - counter.progress.trajectories) * row
    free = shutil.disk_usage(output.parent).free
    return [f"it takes {needed:,} bytes more, {free:,} are free"]


def store_result(
    output: Path,
    plan: Plan,
    table: TrajectoryTable,
    part: Path | None,
    overwrite: bool,
    counter: ProgressCounter,
    should_stop: Callable[[], bool],
    extension: Extension | None = None,
) -> SweepOutcome:
    """Write the result of a trajectory table in the layout of its plan."""
    at, variables, summary = counter.progress, stored_variables(plan), Summary()
    whole = dataset_template(plan)
    if extension:
        whole = whole.assign_attrs(extended=extension.note)

    def check(points: int) -> None:
        counter.on_progress(replace(at, points=points, failed=max(summary.failed, at.failed)))
        if should_stop():
            raise UnfinishedError

    def full() -> Iterator[tuple[str, tuple[int | slice, ...], NDArray[Any]]]:
        chunks = plan.config.output.chunks
        lengths = [chunks.get(axis.name, axis.size) for axis in plan.config.axes] if chunks else []
        for model, where, impacts, values in expanded_slabs(table, variables, lengths):
            if extension and extension.fill:
                extension.fill(model, where, values)
            for name, array in values.items():
                yield name, (model, *where) if "model" in whole[name].dims else where, array
            axes = plan.inputs.axes_of_model(table.laws[model].key)
            _add_slab(summary, axes, model, where, impacts, values)
            check(summary.points)

    def factored() -> Iterator[tuple[str, tuple[slice], NDArray[Any]]]:
        for name, where, array in table_values(table, variables):
            yield name, (where,), array
            check(0)

    is_full = plan.layout == "full"
    template = whole if is_full else factored_template(whole, table, variables)
    if not is_full:
        whole = lazy_dataset(whole, table, variables)
        if plan.stored_points <= NO_CHECKPOINT_POINTS:
            summary = _summarize_points(table, variables)
        else:
            # stored, since a reader would take long to compute it
            summary, extremes = summarize_table(whole, table)
            record = summary_record(summary, extremes, whole)
            template = template.assign_attrs(summary=record.model_dump_json())
    with atomic_write(output, overwrite=overwrite, part=part) as sink:
        seal = write_sealed(sink, template, full() if is_full else factored(), plan.config.output)
        check_readable(sink, output)
    whole.encoding = {"source": str(output), "seal": seal, "layout": plan.layout}
    return SweepOutcome(whole, summary, at.of_trajectories)


def _summarize_points(table: TrajectoryTable, variables: Sequence[SchemaVariable]) -> Summary:
    """Summarize a trajectory table point by point; unlike `summarize` this has the radii."""
    summary = Summary()
    for model, where, impacts, values in expanded_slabs(table, variables):
        axes = table.inputs.axes_of_model(table.laws[model].key)
        _add_slab(summary, axes, model, where, impacts, values)
    return summary


def _add_slab(
    summary: Summary,
    axes: Collection[int],
    model: int,
    where: tuple[slice, ...],
    impacts: Impacts,
    values: SlabValues,
) -> None:
    """Add the points of a slab; points that differ only by parameters of other models count once."""
    if any(part.start > 0 for axis, part in enumerate(where) if axis not in axes):
        return
    first = tuple(slice(None) if axis in axes else slice(1) for axis in range(len(where)))
    counted = {name: array[first or ...] for name, array in values.items()}
    radius = np.fmin(impacts.R1, impacts.R2)
    summary.add(counted, model, [part.start for part in where], radius)
