"""Extend a result by values of its axes or by models; what it holds is not integrated again."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .._version import __version__
from ..atomic import check_outputs, check_result_name
from ..config.draft import Setting, settings_of
from ..config.files import override_text
from ..config.grid import MAX_POINTS, Axis
from ..config.input_names import InputName, with_words
from ..config.load import Config
from ..config.tables import CORES
from ..contact.model import ForceModel
from ..contact.status import STATUS_OK, Status
from ..engine.executors import SERIAL, ExecutorSpec
from ..engine.inputs import Inputs
from ..engine.plan import Plan
from ..engine.plugins import Plugins, read_plugins
from ..engine.run import ProgressCallback, Run, ignore, never
from ..engine.trajectories import ReusedPart, TrajectoryRange, keys_of, model_of
from ..errors import ResultError, UsageError
from ..formatting import argument, safe_text
from .attributes import read_attribute
from .provenance import stored_config
from .schema import require_sweep
from .selection import IndexArray, match_labels
from .summary import SweepOutcome
from .sweep import find_finished, is_whole, sweep_into
from .trajectory_table import ExpandedSlab, TrajectoryTable, table_of_result
from .xarray_backend import load, open_result

# statuses that are assigned before integration
CHECKED_STATUSES = (Status.NO_IMPACT, Status.INVALID_PARAMETER, Status.OUT_OF_RANGE)


def extend(
    result: str | Path,
    overrides: Sequence[str] | Mapping[str, object],
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
    InUseError : another process changed the result that it would replace
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
    overrides: Sequence[str] | Mapping[str, object],
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    resume: bool = False,
    plugins: Sequence[ForceModel | str | Path] = (),
    backend: AbstractContextManager[ExecutorSpec] | None = None,
    max_points: int = MAX_POINTS,
    on_progress: ProgressCallback | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SweepOutcome:
    """Extend a stored result as `extend` does, and summarize it, without reading the file again.

    Parameters
    ----------
    result, overrides, output, overwrite, plugins, max_points : see `extend`
    resume : continue with the work folder of an interrupted extension; a complete one is not repeated
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
    source, target = Path(result), Path(result if output is None else output)
    run = Run(
        backend or SERIAL, resume, overwrite, max_points, on_progress or ignore, should_stop=should_stop or never
    )
    check_outputs([target], plugins, overwrite=True)
    check_result_name(output)
    plugin_set = read_plugins(plugins)
    name, changes = str(source), settings_of(overrides)
    with run.connected() as connected, open_result(source) as before:
        table = table_of_result(before)
        require_sweep(before, "extend")
        config = stored_config(before.attrs, [], plugin_set, name, max_points)
        old = Plan(config, plugin_set.of(config.models))
        version = safe_text(str(before.attrs.get("impact_version")), 40)
        if version != __version__:
            raise ResultError(
                f"{name}: was written by impact {version}, this is {__version__}; run its sweep again"
            )
        if not is_whole(before, old):
            raise UsageError(f"{name}: got a part of a result, or another order, expected the whole result")
        config = _extended_config(before, old, changes, plugin_set, name, max_points)
        if before.attrs.get("core") in CORES:
            # the existing trajectories were integrated by this core
            config = replace(config, solver=replace(config.solver, core=str(before.attrs["core"])))
        seal = str(before.encoding["seal"])
        record = {"seal": seal, "set": [setting.override for setting in changes]}
        history = json.dumps([*read_attribute(before.attrs, "extended", name), record])
        new = ExtendedPlan(
            config,
            plugin_set.of(config.models),
            old=old,
            before=before,
            table=table,
            name=name,
            extends=seal,
            history=history,
            replaces=target == source,
        )
        outcome = find_finished(target, new) if resume and not overwrite else None
        if outcome is None:
            _check_changes(old, new, name)
            new.check_count(max_points, name)
            _check_none_lost(new)
            outcome = sweep_into(target, new, connected)
    run.check_stop(f"{target} is complete")
    layout = "full" if table is None else "factored"
    return replace(outcome, integrated=sum(new.integrated.values()), extended_layout=layout)


def _extended_config(
    before: xr.Dataset, old: Plan, changes: Sequence[Setting], plugins: Plugins, source: str, max_points: int
) -> Config:
    """Read the config with the changes, and all values and models of the result."""
    config = stored_config(before.attrs, changes, plugins, source, max_points)
    added = []
    for axis in config.axes:
        name = axis.name
        old_values = np.atleast_1d(old.inputs.values(name))
        new_values = np.asarray(next(iter(axis.columns.values())))
        # a property of a material that no ball had is NaN, a parameter of a law that is added None
        is_new = old_values[0] is None or old_values[0] != old_values[0]
        if len(axis.columns) > 1 or axis.numbered or is_new or np.isin(old_values, new_values).all():
            continue
        # a value that differs by rounding from one of the result is that one
        in_both, _ = match_labels([new_values], [old_values])
        parsed, values = InputName.parse(name), [*old_values.tolist(), *np.delete(new_values, in_both).tolist()]
        added.append(override_text(parsed.path, list(map(parsed.word, values))))
    for table, laws, now in (
        ("models", old.models, config.models),
        ("frictions", old.frictions, config.frictions),
    ):
        if any(law not in now for law in laws):
            keys = [*(law.key for law in laws), *(law.key for law in now if law not in laws)]
            added.append(override_text((table,), keys))
    if added:
        config = stored_config(before.attrs, [*changes, *added], plugins, source, max_points)
    return config


def _check_changes(old: Plan, new: Plan, name: str) -> None:
    """Refuse changes of anything but values of axes and models."""
    free = ("models", "frictions", "axes", "scalars", "materials", "plugins")
    changed = [key for key, value in old.physics.items() if key not in free and value != new.physics[key]]
    used, swept = new.material_record, new.inputs.names()
    changed += [
        f"materials.{key}.{field}"
        for key, properties in old.material_record.items()
        for field, value in properties.items()
        if key in used and used[key][field] != value and f"materials.{key}.{field}" not in swept
    ]
    before, after = vars(old.config.output), vars(new.config.output)
    # copied values have the variables and the precision of the result
    changed += [f"output.{key}" for key in ("variables", "dtype") if before[key] != after[key]]
    changed += [key for key in old.inputs.names() if key not in new.inputs.names()]
    # a material, or a law, that is added has inputs that the result does not have
    owners = {"", *(model.key for model in old.models), *(law.key for law in old.frictions)}
    gained = [InputName.parse(key) for key in swept if key not in old.inputs.names()]
    changed += [str(gain) for gain in gained if gain.owner in owners and not gain.material]
    scalars, new_scalars = old.inputs.scalars, new.inputs.scalars
    changed += [key for key in scalars if key in new_scalars and scalars[key] != new_scalars[key]]
    if changed:
        raise UsageError(
            f"{name}: {argument('overrides')} changes {', '.join(changed)}, expected more values of an "
            f"axis, such as {argument('overrides', ['sweep.m2=[1.0, 2.0]'])}, or more models"
        )
    if old.laws == new.laws and old.config.axes == new.config.axes:
        raise UsageError(f"{name}: already has all of these; expected more values of an axis, or more models")


class _AxisPositions(NamedTuple):
    """The old axis that an axis corresponds to, if any, and the old positions of its values; -1 is new."""

    axis: int | None
    positions: IndexArray


def _check_none_lost(plan: ExtendedPlan) -> None:
    """Refuse a plan that lacks a value of the old one, or takes apart what varied together."""
    for number, axis in enumerate(plan.old.config.axes):
        kept = [new_axis.positions.tolist() for new_axis in plan.positions if new_axis.axis == number]
        if len(kept) > 1:
            shown = ", ".join(axis.columns)
            raise UsageError(f"{plan.name}: {shown} varied together and do not now; sweep the new config")
        lost = {*range(axis.size)}.difference(*kept)
        if lost:
            row = with_words({column: values[min(lost)] for column, values in axis.columns.items()})
            values = ", ".join(f"{column}={safe_text(str(value), 40)}" for column, value in row.items())
            raise UsageError(
                f"{plan.name}: {argument('overrides')} leaves out {values}, expected all values that the result "
                "has, and more; columns that vary together are given together"
            )


def _axis_positions(axis: Axis, old: Inputs, name: str) -> _AxisPositions:
    """Find the positions that the values of an axis have in the old result."""
    axes = {axis_number for column in axis.columns for axis_number in old.axes_of(column)}
    if len(axes) > 1:
        shown = ", ".join(map(str, axis.columns))
        raise UsageError(f"{name}: {shown} vary together now and did not before; sweep the new config")
    numbered = {old.axes[axis_number].numbered for axis_number in axes}
    if numbered - {axis.numbered}:
        raise UsageError(f"{name}: the points of {axis.name} had other labels; sweep the new config")
    columns = [np.atleast_1d(old.values(column)).tolist() for column in axis.columns]
    size = max(map(len, columns))
    before = [*zip(*(values * size if len(values) == 1 else values for values in columns), strict=True)]
    rows = [*zip(*axis.columns.values(), strict=True)]
    if axes and axis.numbered:
        # a case keeps its number: the cases of the result come first, unchanged
        changed = [number for number, row in enumerate(before) if rows[number : number + 1] != [row]]
        if changed:
            raise UsageError(
                f"{name}: {argument('overrides')} changes {axis.name} {changed[0]}, expected the cases that the "
                "result has, in their order, and more after them"
            )
        positions = [number if number < size else -1 for number in range(axis.size)]
    else:
        old_position = {row: number for number, row in enumerate(before)}
        positions = [old_position.get(row, -1) for row in rows]
    return _AxisPositions(next(iter(axes), None), np.array(positions, np.intp))


@dataclass(frozen=True, kw_only=True)
class ExtendedPlan(Plan):
    """The plan of the larger result: what the smaller one holds is neither integrated nor computed again.

    Parameters
    ----------
    old, before : the plan of the smaller result, and its dataset
    table : its trajectories; None if it has only the values of its points
    name : of its file, in messages
    integrated : how many trajectories of each range are not reused, by its number
    """

    old: Plan
    before: xr.Dataset
    table: TrajectoryTable | None
    name: str
    integrated: dict[int, int] = field(default_factory=dict)

    @cached_property
    def positions(self) -> tuple[_AxisPositions, ...]:
        """The positions of the values of each axis in the old result."""
        return tuple(_axis_positions(axis, self.old.inputs, self.name) for axis in self.config.axes)

    @cached_property
    def old_laws(self) -> tuple[int | None, ...]:
        """The number that each model and each pair had in the old plan, or None."""
        numbers = {keys_of(law): number for number, law in enumerate(self.old.laws)}
        return tuple(numbers.get(keys_of(law)) for law in self.laws)

    def reused(self, trajectory_range: TrajectoryRange) -> ReusedPart:
        """Find the trajectories of a range that the old result has, or that only points need which it has."""
        reused = super().reused(trajectory_range)
        law = self.old_laws[trajectory_range.model]
        if self.table is not None and law is not None:
            reused = self._from_table(trajectory_range, self.table, law)
        elif self.table is None and self.layout == "full":
            reused = self._not_needed(trajectory_range)
        self.integrated[trajectory_range.number] = int(np.count_nonzero(~reused[0]))
        return reused

    def _from_table(self, trajectory_range: TrajectoryRange, table: TrajectoryTable, law: int) -> ReusedPart:
        """Take the trajectories of a range that the old result has in its table, of a law by its number there."""
        trajectory_map, old_map = self.maps[trajectory_range.model], table.maps[law]
        is_known = np.zeros(trajectory_range.size, bool)
        old_rows = np.zeros(trajectory_range.size, np.intp)
        if {*old_map.axes} <= {self.positions[axis].axis for axis in trajectory_map.axes}:
            of_cell, is_old, along = self._old_cells(trajectory_range)
            of_cell = of_cell[is_old]
            index = [np.zeros(of_cell.shape, np.intp) for _ in self.old.config.axes]
            for axis, positions in along.items():
                old_axis = self.positions[axis].axis
                if old_axis is not None:
                    index[old_axis] = positions[is_old]
            is_known[of_cell] = True
            old_rows[of_cell] = old_map.rows(tuple(index))
        stored = table.take(law, old_rows)
        # a status that was assigned before integration may differ between the two sweeps
        status = self.columns_of(trajectory_range)["status"]
        is_known &= np.where(
            status == STATUS_OK, ~np.isin(stored.status, CHECKED_STATUSES), stored.status == status
        )
        return is_known, stored.take(np.flatnonzero(is_known))

    def _not_needed(self, trajectory_range: TrajectoryRange) -> ReusedPart:
        """Mark the trajectories of a range that only points need which the old result holds in full."""
        trajectory_map = self.maps[trajectory_range.model]
        others = (axis for number, axis in enumerate(self.positions) if number not in trajectory_map.axes)
        # a pair needs the trajectories of its model
        law = self.laws[trajectory_range.model]
        needed = zip(self.laws, self.old_laws, strict=True)
        is_new = any(number is None and law in (other, model_of(other)) for other, number in needed)
        if is_new or any((axis.positions < 0).any() for axis in others):
            return super().reused(trajectory_range)
        of_cell, is_old_cell, _ = self._old_cells(trajectory_range)
        is_old = np.ones(trajectory_range.size, bool)
        is_old[of_cell[~is_old_cell]] = False
        return is_old, trajectory_range.record.blank(int(np.count_nonzero(is_old)))

    def _old_cells(
        self, trajectory_range: TrajectoryRange
    ) -> tuple[IndexArray, NDArray[np.bool_], dict[int, IndexArray]]:
        """List for the cells of a range the trajectory in it, if the old result has it, and where along axes."""
        trajectory_map = self.maps[trajectory_range.model]
        cells, of_cell = trajectory_range.rows, trajectory_map.of_cell
        if of_cell is not None:
            cells = np.flatnonzero((of_cell >= trajectory_range.start) & (of_cell < trajectory_range.stop))
        numbers = cells if of_cell is None else of_cell[cells].astype(np.intp)
        along = {a: self.positions[a].positions[cell] for a, cell in trajectory_map.index_along(cells).items()}
        is_old = np.logical_and.reduce([np.ones(cells.shape, bool), *(where >= 0 for where in along.values())])
        return numbers - trajectory_range.start, is_old, along

    def fill(self, slab: ExpandedSlab) -> None:
        """Copy the values of an old result without trajectories into the values of a slab.

        The trajectories of all new points are integrated, also where a point of the old result had the same one.
        """
        names, before = [axis.name for axis in self.old.config.axes], self.before
        if self.table is not None or self.old_laws[slab.number] is None:
            return
        of_law = dict(zip(("model", "friction"), keys_of(self.laws[slab.number]), strict=False))
        old_positions = [axis.positions[part] for axis, part in zip(self.positions, slab.region, strict=True)]
        inside = np.ix_(*(np.flatnonzero(positions >= 0) for positions in old_positions))
        if any(positions.size == 0 for positions in inside):
            return
        # in the order of the axes of this slab
        chosen: Mapping[Any, Any] = {
            names[axis.axis]: positions[positions >= 0]
            for axis, positions in zip(self.positions, old_positions, strict=True)
            if axis.axis is not None
        }
        for name, array in slab.values.items():
            if "model" not in before[name].dims:
                continue
            old_values = before[name].sel(of_law).isel(chosen).transpose(*chosen).values
            shape = tuple(positions.size for positions in inside)
            if not array.flags.writeable:
                # a view of computed values that was not copied
                slab.values[name] = array = array.copy()
            array[inside or ...] = old_values.reshape(shape) if array.shape else old_values
