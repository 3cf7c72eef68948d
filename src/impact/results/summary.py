"""What a sweep wrote, the summary of a result of any size, and notes on values that are probably not intended."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..contact.materials import sphere_mass
from ..contact.status import FIRST_FAILURE, FrictionStatus, Status
from ..contact.variables import OUTPUTS
from ..display import Block, Displayed, Table, Wrapped
from ..engine.inputs import Inputs, input_at, property_at, smaller_radius_at
from ..engine.trajectories import axes_of_arrays, probe_index
from ..errors import ModelError, ResultError
from ..formatting import number, prefixed, quantity, safe_text
from .attributes import SummaryRecord
from .layouts import read_inputs
from .provenance import command_start, inputs_at, replay_command
from .schema import parts_of_laws
from .slabs import MAX_SUMMARY_POINTS, distinct_points, is_computed, slabs
from .trajectory_table import ExpandedSlab, TrajectoryTable, computed_array, expand, table_of_result

# variables of which the largest absolute value is reported, with the headings of a table
ERROR_HEADINGS = {
    "e_error": "max |e_out − e|",
    "v1_error": "max |v1 error|",
    "v2_error": "max |v2 error|",
    "closed_form_error": "max |e_out − exact|",
    "energy_residual": "max |residual|",
}
MAX_FAILED_AT = 3
# limit of small indentations, as a fraction of the smaller radius
MAX_SMALL_INDENTATION = 0.1
# limit of the angle by which the normal, which is taken as fixed, turns during the contact [rad]
MAX_TURN = 0.02
# Young's moduli outside these limits are probably in another unit: gels have 1e3 Pa, diamond has 1e12 Pa
MIN_MODULUS_PA, MAX_MODULUS_PA = 1e3, 1e13
# a mass and that of the sphere may differ by rounding of measured values
MAX_MASS_DIFFERENCE = 0.01


@dataclass
class Summary:
    """Counts and extremes of the points of a result.

    worst : the largest absolute value by error variable and key of the model; NaN if all are NaN, missing if not
        evaluated
    failed_at : the first points that failed: status, number of the model, and index along the axes
    friction_counts : numbers of points of pairs by friction status
    friction_failed_at : the first points of pairs that failed: friction status, numbers of the model and of the
        friction law, and index along the axes; a file does not hold them
    deep, deepest : number of points with a peak indentation above `MAX_SMALL_INDENTATION`, and the largest one, as
        fractions of the smaller radius; only of points with known radii
    """

    points: int = 0
    counts: dict[Status, int] = field(default_factory=dict)
    worst: dict[str, dict[str, float]] = field(default_factory=dict)
    failed_at: list[tuple[Status, tuple[int, ...], tuple[int, ...]]] = field(default_factory=list)
    max_failed_at: int = field(default=MAX_FAILED_AT, compare=False)
    not_counted: int = 0
    friction_counts: dict[FrictionStatus, int] = field(default_factory=dict)
    friction_failed_at: list[tuple[FrictionStatus, tuple[int, ...], tuple[int, ...]]] = field(
        default_factory=list, compare=False
    )
    # a file does not hold the radii: these are available after a sweep only
    deep: int = field(default=0, compare=False)
    deepest: float = field(default=0.0, compare=False)

    @property
    def failed(self) -> int:
        """Points of models without a result, or of pairs if those are more; a pair may be without a meaning."""
        failed = sum(count for status, count in self.counts.items() if status >= FIRST_FAILURE)
        return max(failed, sum(self.friction_failures.values()))

    @property
    def friction_failures(self) -> dict[FrictionStatus, int]:
        """Numbers of points of pairs that failed, by status."""
        return {
            status: count
            for status, count in self.friction_counts.items()
            if FIRST_FAILURE <= status != FrictionStatus.NOT_COMBINABLE
        }

    @property
    def by_status(self) -> dict[str, dict[str, int]]:
        """The counts by the names of the statuses, in JSON; those of pairs if there are some."""
        counts: dict[str, Mapping[Any, int]] = {"status": self.counts, "friction_status": self.friction_counts}
        return {name: counts_by_name(of) for name, of in counts.items() if of or name == "status"}

    @property
    def first_failed(self) -> list[tuple[str, Status | FrictionStatus, tuple[int, ...], tuple[int, ...]]]:
        """List the first failed points of models, else of pairs: status variable, status, law and index."""
        if not self.failed_at:
            return [("friction_status", *failure) for failure in self.friction_failed_at]
        return [("status", *failure) for failure in self.failed_at]

    def add(
        self,
        values: Mapping[str, NDArray[Any]],
        model: str,
        place: tuple[int, ...],
        start: Sequence[int],
        weight: int = 1,
    ) -> None:
        """Add points of a model from an index on, each `weight` times.

        `place` is the number of the model, or those of the model and the friction law of a pair.
        """
        if "status" in values:
            self.points += weight * values["status"].size
        tallies: Sequence[tuple[str, type[IntEnum], dict[Any, int], list[Any]]] = (
            ("status", Status, self.counts, self.failed_at),
            ("friction_status", FrictionStatus, self.friction_counts, self.friction_failed_at),
        )
        for name, statuses, counts, failed_at in (tally for tally in tallies if tally[0] in values):
            array, n_more = values[name], self.max_failed_at - len(failed_at)
            try:
                times = np.bincount(array.reshape(-1))
                for code in np.flatnonzero(times).tolist():
                    counts[statuses(code)] = counts.get(statuses(code), 0) + weight * int(times[code])
            except (TypeError, ValueError):
                hint = "select points with sel or isel; where leaves NaN"
                raise ResultError(f"{name}: got a number that is no status; {hint}") from None
            if n_more > 0 and times[FIRST_FAILURE:].any():
                failed = (array >= FIRST_FAILURE) & (array != FrictionStatus.NOT_COMBINABLE)
                for offsets in np.argwhere(failed)[:n_more].tolist():
                    index = tuple(map(operator.add, start, offsets))
                    failed_at.append((statuses(int(array[tuple(offsets)])), place, index))
        for name in (name for name in ERROR_HEADINGS if name in values):
            largest = float(np.fmax.reduce(np.abs(values[name]), axis=None, initial=np.nan))
            by_model = self.worst.setdefault(name, {})
            by_model[model] = float(np.fmax(by_model.get(model, np.nan), largest))

    def add_depths(self, indentation: NDArray[Any], radius: NDArray[Any], weight: int = 1) -> None:
        """Add peak indentations [m], each `weight` times; the radius [m] is that of the smaller ball."""
        if np.isfinite(radius).any():
            share = indentation / (radius if indentation.shape else radius.reshape(()))
            self.deep += weight * int(np.count_nonzero(share > MAX_SMALL_INDENTATION))
            self.deepest = float(np.fmax.reduce(share, axis=None, initial=self.deepest))

    def add_slab(self, table: TrajectoryTable, slab: ExpandedSlab) -> None:
        """Add the points of a slab; points that differ only by parameters of other models count once."""
        keys = table.keys(slab.number)
        axes = table.inputs.axes_of_law(*keys)
        if any(part.start > 0 for axis, part in enumerate(slab.region) if axis not in axes):
            return
        first = tuple(slice(None) if axis in axes else slice(1) for axis in range(len(slab.region)))
        counted = {name: array[first or ...] for name, array in slab.values.items()}
        self.add(counted, keys[0], slab.place, [part.start for part in slab.region])
        if "peak_indentation" in counted:
            radius = smaller_radius_at(table.inputs, table.inputs.index(slab.region))
            self.add_depths(counted["peak_indentation"], radius)


def summarize(dataset: xr.Dataset, max_failed_at: int = MAX_FAILED_AT) -> Summary:
    """Summarize a result of any size.

    Each variable is evaluated over the axes along which it varies, one model after another, and each of its points
    counts as often as it occurs. A computed variable that varies over more than MAX_SUMMARY_POINTS of a model is
    not evaluated: the error is then missing from `worst`, or the points are `not_counted`. The first distinct
    failed points in C order are recorded, at the first position along each axis on which the status is constant.
    """
    names = [name for name in ("status", *ERROR_HEADINGS) if name in dataset]
    table = table_of_result(dataset[names])
    record = None if table is None else table.summary
    # it lists all failures, or as many as required
    if record is not None and (len(record.failed_at) < MAX_FAILED_AT or max_failed_at <= MAX_FAILED_AT):
        return _stored_summary(record, dataset, names, max_failed_at)
    summary = Summary(max_failed_at=max_failed_at)
    parts = [(names, law) for law in parts_of_laws(dataset, ["model"])]
    if "friction_status" in dataset:
        parts += [(["friction_status"], law) for law in parts_of_laws(dataset, ["model", "friction"])]
    for names_of_law, (place, part) in parts:
        model = str(part["model"].item())
        for name in names_of_law:
            variable, weight = distinct_points(part, name)
            if variable.size <= MAX_SUMMARY_POINTS or not is_computed(variable):
                for slab in slabs(variable.sizes):
                    start = [slab[dim].start for dim in variable.dims]
                    summary.add({name: variable.isel(slab).values}, model, place, start, weight)
            elif name == "status":
                summary.points += weight * variable.size
                summary.not_counted += weight * variable.size
    return summary


class Extremes(NamedTuple):
    """The smallest and the largest finite value, NaN if there is none, and the number of other values."""

    smallest: float = math.nan
    largest: float = math.nan
    missing: int = 0

    def add(self, values: NDArray[Any], weight: int) -> Extremes:
        """Add more values, each of which counts as often as `weight`."""
        finite = values[np.isfinite(values)]
        smallest, largest = (finite.min(), finite.max()) if finite.size else (np.nan, np.nan)
        missing = self.missing + weight * (values.size - finite.size)
        return Extremes(float(np.fmin(self.smallest, smallest)), float(np.fmax(self.largest, largest)), missing)


def extremes_of(dataset: xr.Dataset, name: str) -> Extremes | None:
    """Find the extremes of a variable; None for a computed one that varies over too many points."""
    array = computed_array(dataset.variables[name])
    record = None if array is None else array.table.summary
    if record is not None and name in record.extremes:
        stored = record.extremes[name]
        return stored and Extremes(*stored)
    parts, is_evaluated = _distinct_parts(dataset, name)
    if not is_evaluated:
        return None
    extremes = Extremes()
    for variable, weight in parts:
        for slab in slabs(variable.sizes):
            extremes = extremes.add(variable.isel(slab).values, weight)
    return extremes


def _distinct_parts(dataset: xr.Dataset, name: str) -> tuple[list[tuple[xr.Variable, int]], bool]:
    """List the distinct points of a variable of each model with their weights; and whether they are few enough."""
    whole = dataset.variables[name]
    # selecting from few variables is fast; along which axes a variable varies depends on the model
    few = dataset[[name, *({"model"} & dataset.coords.keys())]]
    # of a pair also where its friction law was selected, and is no dimension
    dims = {*whole.dims, *(("friction",) if name in OUTPUTS and OUTPUTS[name].of_friction else ())}
    parts = [distinct_points(part, name) for _, part in parts_of_laws(few, dims)]
    # a variable that is only read may have any size
    return parts, not is_computed(whole) or sum(part.size for part, _ in parts) <= MAX_SUMMARY_POINTS


def summarize_table(dataset: xr.Dataset, table: TrajectoryTable) -> tuple[Summary, SummaryRecord]:
    """Summarize a lazy result, also for its file; variables along the same axes are evaluated together."""
    summary, extremes = Summary(), dict[str, Extremes | None]()
    axes = [axis.name for axis in table.inputs.axes]
    # by model and by the sizes of the axes along which they vary: the weight of a point, and names of variables
    groups: dict[tuple[int, tuple[int, ...]], tuple[int, list[str]]] = {}
    for name in map(str, dataset.data_vars):
        parts, is_evaluated = _distinct_parts(dataset, name)
        extremes[name] = Extremes() if is_evaluated else None
        first = len(table.laws) if "friction" in dataset[name].dims else 0
        for model, (variable, weight) in enumerate(parts, first):
            is_judged = name in ("status", "friction_status", *ERROR_HEADINGS)
            if is_evaluated or (is_judged and variable.size <= MAX_SUMMARY_POINTS):
                sizes = tuple(variable.sizes[axis] for axis in axes)
                groups.setdefault((model, sizes), (weight, []))[1].append(name)
            elif name == "status":
                summary.points += weight * variable.size
                summary.not_counted += weight * variable.size
    for (position, shape), (weight, names) in sorted(groups.items(), key=lambda item: item[0]):
        for slab in slabs(dict(enumerate(shape))):
            index = table.inputs.index(tuple(slab.values()))
            arrays = expand(table, position, index, names)
            values = {name: np.asarray(array, dataset[name].dtype) for name, array in arrays.items()}
            for name, array in values.items():
                so_far = extremes[name]
                extremes[name] = so_far and so_far.add(array, weight)
            start = [part.start for part in slab.values()]
            summary.add(values, table.keys(position)[0], table.place(position), start, weight)
    keys = [law.key for law in table.laws]
    return summary, SummaryRecord(
        status=counts_by_name(summary.counts),
        not_evaluated=summary.not_counted,
        worst=summary.worst,
        failed_at=[(status.name.lower(), keys[model], [*index]) for status, (model,), index in summary.failed_at],
        extremes=dict(extremes),
        friction_status=counts_by_name(summary.friction_counts),
    )


def _stored_summary(
    record: SummaryRecord, dataset: xr.Dataset, names: Sequence[str], max_failed_at: int
) -> Summary:
    """Restore the summary of some variables from the record in the file of a dataset."""
    keys = dataset["model"].values.tolist()
    counts = {Status[name.upper()]: count for name, count in record.status.items()}
    has_status = "status" in names
    failed_at = record.failed_at[:max_failed_at] if has_status else []
    return Summary(
        points=has_status * (sum(counts.values()) + record.not_evaluated),
        counts=counts if has_status else {},
        worst={name: record.worst[name] for name in names if name in record.worst},
        failed_at=[(Status[name.upper()], (keys.index(key),), tuple(index)) for name, key, index in failed_at],
        max_failed_at=max_failed_at,
        not_counted=has_status * record.not_evaluated,
        friction_counts={FrictionStatus[name.upper()]: count for name, count in record.friction_status.items()},
    )


def counts_text(counts: Mapping[Any, int]) -> str:
    """Write the number of points by status."""
    return ", ".join(f"{count:,} {name}" for name, count in counts_by_name(counts).items())


def counts_by_name(counts: Mapping[Any, int]) -> dict[str, int]:
    """Count by the names of the statuses, in their order."""
    return {status.name.lower(): counts[status] for status in sorted(counts)}


def result_notes(summary: Summary) -> Iterator[str]:
    """Yield a sentence for each implausible property of a sweep's outcome."""
    if summary.points and not summary.not_counted and summary.counts.keys() == {Status.NO_IMPACT}:
        yield f"none of {summary.points:,} points is an impact: v1 <= v2, the balls do not approach"
    if summary.deep:
        many = f"{summary.deep:,} of {summary.points:,} points"
        limit = f"{MAX_SMALL_INDENTATION:.0%} of the smaller radius"
        yield (
            f"peak indentation above {limit} at {many}, at most {summary.deepest:.0%}; Hertz theory assumes small "
            "indentation"
        )


@dataclass(frozen=True)
class SweepOutcome(Displayed):
    """The result of a sweep, which may be larger than memory, and its summary.

    Parameters
    ----------
    dataset : its coordinates and attributes; the values of its variables may be placeholders
    summary : of its points
    trajectories : number of different trajectories; None if unknown
    is_new : whether the file was written now; False if it held this sweep already
    integrated : how many trajectories were integrated now; None if not counted
    repeated_blocks : number of blocks that several shards have
    extended_layout : layout of the result that was extended; only "factored" stores trajectories to reuse
    output : the file
    """

    dataset: xr.Dataset
    summary: Summary
    trajectories: int | None = None
    is_new: bool = True
    integrated: int | None = None
    repeated_blocks: int = 0
    extended_layout: str | None = None
    output: Path | None = None

    def as_dict(self) -> dict[str, Any]:
        """Points, counts by status, and the first failed points with the command that repeats each."""
        return {
            "output": str(self.output),
            "points": self.summary.points,
            "models": self.dataset.sizes["model"],
            "trajectories": self.trajectories,
            **self.summary.by_status,
            "failed": self.summary.failed,
            "first_failed": self.records(),
            "layout": self.dataset.encoding.get("layout"),
            "seal": self.dataset.encoding.get("seal"),
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The first failed points of models, else of pairs."""
        command = command_start(str(self.output), self.dataset)
        records = []
        for name, status, place, index in self.summary.first_failed:
            at = inputs_at(self.dataset[name], (*place, *index))
            replay = replay_command(command, at) if command else None
            records.append({"status": status.name.lower(), "at": at, "replay": replay})
        return records

    def sections(self, width: int) -> Iterator[Block]:
        """The largest errors, the counts, the first failed points and what is implausible."""
        summary = self.summary
        if summary.worst:
            yield error_table(summary.worst)
        distinct = "" if self.trajectories is None else f" from {self.trajectories:,} trajectories"
        yield Wrapped(f"{self.output}: {summary.points:,} points{distinct} ({counts_text(summary.counts)})")
        if summary.friction_counts:
            yield Wrapped(f"with each friction law: {counts_text(summary.friction_counts)}")
            if FrictionStatus.SLOW_LIMIT in summary.friction_counts:
                yield Wrapped(f"slow_limit: {FrictionStatus.SLOW_LIMIT.meaning}; see impact timestep")
        failures = self.records()
        for failure, (_, status, _, _) in zip(failures, summary.first_failed, strict=True):
            inputs = ", ".join(f"{name}={number(value, None)}" for name, value in failure["at"].items())
            yield Wrapped(f"failed: {inputs}: {status.meaning}")
            if failure["replay"]:
                yield f"  {failure['replay']}"
        more = summary.failed - len(failures)
        if more > 0:
            yield f"and {more:,} more"
        yield from (f"note: {note}" for note in result_notes(summary))

    @property
    def failed_line(self) -> str:
        """The number of failed points by status."""
        counts, failed = self.summary.counts, self.summary.failed
        failures = {
            s: count for s, count in counts.items() if s >= FIRST_FAILURE
        } or self.summary.friction_failures
        return f"{self.output}: {failed:,} of {self.summary.points:,} points failed ({counts_text(failures)})"


def error_table(worst: Mapping[str, Mapping[str, float]]) -> Table:
    """Tabulate the largest errors by variable and model."""
    names = [name for name in ERROR_HEADINGS if name in worst]
    models = dict.fromkeys(model for name in names for model in worst[name])
    rows = [[model, *(number(worst[name].get(model, float("nan")), 3) for name in names)] for model in models]
    return Table(rows, ("model", *(ERROR_HEADINGS[name] for name in names)))


def input_notes(inputs: Inputs, *, has_density: bool = True) -> Iterator[str]:
    """Yield a sentence for each material or ball with an implausible Young's modulus or mass.

    Without `has_density` the density is that of the starter config, which contradicts no mass.

    >>> from impact.contact.materials import Material
    >>> materials = {"steel": Material(E=210.0, nu=0.3), "glass": Material(E=6e10, nu=0.2, rho=2500.0)}
    >>> scalars = {"material1": "steel", "material2": "glass", "m2": 1.0, "R2": 0.02}
    >>> for note in input_notes(Inputs(scalars, (), materials)):
    ...     print(note)
    materials.steel.E: got 210 Pa; did you mean 210 GPa?
    m2: got 1 kg, but a sphere of R2 = 0.02 m and 2500 kg/m^3 has 0.08378 kg; without m2 the mass follows
    """
    columns = {name: values for axis in inputs.axes for name, values in axis.columns.items()}
    for name, material in inputs.materials.items():
        for modulus in columns.get(f"materials.{name}.E", [material.E]):
            if isinstance(modulus, float) and (modulus < MIN_MODULUS_PA or modulus > MAX_MODULUS_PA):
                too_small = modulus < MIN_MODULUS_PA
                hint = f"did you mean {number(modulus)} GPa?" if too_small else "no material is as stiff"
                yield f"materials.{safe_text(name)}.E: got {number(modulus)} Pa; {hint}"
                break
    for ball in "12" if has_density else "":
        if {f"m{ball}", f"R{ball}"} <= {*inputs.names()}:
            yield from _mass_notes(inputs, ball)


def _mass_notes(inputs: Inputs, ball: str) -> Iterator[str]:
    """Say that the mass of a ball is not that of a sphere of its radius and density, where all three are given."""
    # masses and radii that vary together may agree at the first two values
    together = [f"m{ball}"] if inputs.axes_of(f"m{ball}") == inputs.axes_of(f"R{ball}") else []
    index = probe_index(inputs, together)
    mass, radius = (input_at(inputs, f"{name}{ball}", index) for name in "mR")
    stated, R, density = np.broadcast_arrays(mass, radius, property_at(inputs, ball, "rho", index))
    expected = sphere_mass(R, density)
    # an infinite mass is a ball that is held; without a density that of a sphere is NaN, and contradicts none
    with np.errstate(invalid="ignore"):
        differs = np.isfinite(stated) & np.isfinite(R) & (np.abs(stated / expected - 1.0) > MAX_MASS_DIFFERENCE)
    if differs.any():
        first = int(np.argmax(differs))
        size, rho = quantity(R.flat[first], "m", 4), quantity(density.flat[first], "kg/m^3", 4)
        yield (
            f"m{ball}: got {quantity(stated.flat[first], 'kg', 4)}, but a sphere of R{ball} = {size} and {rho} "
            f"has {quantity(expected.flat[first], 'kg', 4)}; without m{ball} the mass follows"
        )


def depth_notes(indentation: float, R1: float, R2: float) -> Iterator[str]:
    """Yield a sentence if a peak indentation is large beside the smaller radius [m]; a radius may be unknown, NaN.

    >>> list(depth_notes(2e-3, 0.01, float("inf")))
    ['peak indentation of 2 mm is 20% of the smaller radius; Hertz theory assumes small indentation']
    >>> list(depth_notes(2e-3, float("nan"), float("nan")))
    []
    """
    share = indentation / float(np.fmin(R1, R2))
    if share > MAX_SMALL_INDENTATION:
        depth = f"peak indentation of {prefixed(indentation, 'm', 3)} is {share:.0%} of the smaller radius"
        yield f"{depth}; Hertz theory assumes small indentation"


def turn_notes(tangential: float, contact_time: float, R1: float, R2: float) -> Iterator[str]:
    """Yield a sentence if the normal turns, by the tangential velocity of the centres, while the balls touch.

    >>> list(turn_notes(1.0, 2e-4, 1e-3, 1e-3))
    ['the normal turns by 0.1 rad while the balls touch, and is taken as fixed: errors of about 10% of the speed']
    >>> list(turn_notes(1.0, 2e-4, 1e-3, float("inf")))
    []
    """
    angle = abs(tangential) * contact_time / (R1 + R2)
    if angle > MAX_TURN:
        turn = f"the normal turns by {number(angle, 2)} rad while the balls touch, and is taken as fixed"
        yield f"{turn}: errors of about {angle:.0%} of the speed"


def with_depths(summary: Summary, dataset: xr.Dataset) -> Summary:
    """Add `deep` and `deepest` of a dataset to its summary, but for models of more computed points than it has."""
    inputs, summary = inputs_of(dataset), replace(summary)
    if inputs is None or "peak_indentation" not in dataset:
        return summary
    try:
        varied = axes_of_arrays([smaller_radius_at(inputs, probe_index(inputs))])
    except (ModelError, KeyError):
        # a part of a result, or one that was changed, may lack what the radii follow from
        return summary
    radius_dims = [axis.name for number, axis in enumerate(inputs.axes) if number in varied]
    for _, part in parts_of_laws(dataset, ["model"]):
        depth, weight = distinct_points(part, "peak_indentation", *radius_dims)
        dims = [axis.name for axis in inputs.axes if axis.name in depth.dims]
        depth = depth.transpose(*dims)
        if depth.size > MAX_SUMMARY_POINTS and is_computed(depth):
            continue
        for slab in slabs(depth.sizes):
            radius = smaller_radius_at(inputs, inputs.index([slab.get(a.name, slice(1)) for a in inputs.axes]))
            absent = tuple(number for number, axis in enumerate(inputs.axes) if axis.name not in dims)
            summary.add_depths(depth.isel(slab).values, radius.squeeze(absent), weight)
    return summary


def inputs_of(dataset: xr.Dataset) -> Inputs | None:
    """Read the inputs of a sweep from its result; None if it lacks some, as a part or a changed one may."""
    try:
        inputs = read_inputs(dataset, [str(dim) for dim in dataset.sizes if dim != "model"])
    except (ResultError, KeyError):
        return None
    is_complete = all(names <= inputs.materials.keys() for names in inputs.materials_of.values())
    return inputs if is_complete else None
