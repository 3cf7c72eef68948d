"""The figures of a report: their kinds, axes, and the point they are drawn at."""

from __future__ import annotations

import base64
import itertools
import math
import shlex
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
import xarray as xr

from ..array_types import Array
from ..config.grid import SAMPLE
from ..config.input_names import InputName, is_input
from ..contact.model import ForceModel
from ..contact.status import FIRST_FAILURE, NO_IMPACT
from ..contact.variables import LAW_DIMS
from ..errors import ImpactError
from ..formatting import prefixed
from ..plots.data import PlotData
from ..plots.draw import draw, get_plot_data
from ..plots.kinds import STUDIES, Choice, Kind, Look, kinds_of
from ..plots.slices import numeric_axes, varying_inputs
from ..plots.style import encoded
from ..results.provenance import command_start
from ..results.ranking import MIN_ERROR_FLOOR
from ..results.schema import columns_along, numbered_unit
from ..results.selection import law_positions
from ..results.slabs import distinct_points, is_computed, slabs

# points that are searched for the first one with an answer, at which the figures are drawn
MAX_SEARCHED = 2**18
# most combinations of values of other axes at which the numbers of a figure are compared, values of an axis that
# are drawn, and further figures of a kind
MAX_COMPARED, MAX_VALUES, MAX_MORE = 48, 6, 12
# points of a figure that are compared, of all laws
MAX_COMPARED_POINTS = 2**14
# of the largest number: what is hardly visible
MAX_DIFFERENCE = 1e-3
# an index of some axes
Position: TypeAlias = Mapping[Hashable, int]


@dataclass(frozen=True)
class Figure:
    """A figure: what it shows, a caption with its point, the picture as a data URL, and the command to draw it."""

    label: str
    caption: str
    source: str
    of_friction: bool
    is_first: bool  # of its kind; others are at other values
    command: str


class FigurePlan(NamedTuple):
    """A figure to draw: its kind, what it shows, and an index for each axis that it does not draw."""

    kind: Kind
    choice: Choice
    position: Position


@dataclass(frozen=True)
class Drawing:
    """A result, or some of its models, whose figures are drawn."""

    dataset: xr.Dataset
    keys: Sequence[str]
    plugins: Sequence[ForceModel | str | Path]
    name: str  # of its file
    model_count: int  # of the result in the file

    def figures(self) -> tuple[list[Figure], list[str]]:
        """Draw all figures; also returns a sentence for each that is left out."""
        figures, left_out = list[Figure](), list[str]()
        plans = list(iterate_choices(self.dataset, self.keys))
        # numbered as they stand on the page: those of friction have a section of their own
        for of_friction in (False, True):
            more_figures: list[tuple[FigurePlan, str, PlotData | None]] = []
            for plan in (plan for plan in plans if plan.kind.of_friction == of_friction):
                kind, choice, position = plan
                number = len(figures) + 1
                try:
                    plot_data = get_plot_data(self.dataset, kind.name, choice, self.plugins)
                    comparison, more = _compare_values(self, plan, plot_data)
                    conditions = _condition_sentences(self.dataset, position, self.keys)
                    sentences = [kind.caption, *conditions, *comparison]
                    sentences += [f"Not drawn: {'; '.join(plot_data.not_drawn)}."] if plot_data.not_drawn else []
                    figures.append(self.figure(number, plan, " ".join(sentences), plot_data, is_first=True))
                    for index, data in more:
                        caption = f"As Figure {number}, at {_changes_text(self.dataset, index)}."
                        more_figures.append((_plan_at(self.dataset, plan, index), caption, data))
                except ImpactError as error:
                    left_out.append(f"The figure {kind.name} is left out: {'; '.join(error.problems)}")
            for plan, caption, known in more_figures:
                # it may have no values there
                with suppress(ImpactError):
                    plot_data = known or get_plot_data(self.dataset, plan.kind.name, plan.choice, self.plugins)
                    figures.append(self.figure(len(figures) + 1, plan, caption, plot_data))
        return figures, left_out

    def figure(
        self, number: int, plan: FigurePlan, caption: str, plot_data: PlotData, *, is_first: bool = False
    ) -> Figure:
        """Draw a figure; title and conditions are in the caption, and the legend beside the first of a kind.

        It is narrow, so that its text is legible on a phone.
        """
        kind = plan.kind
        # the legend of the closest model depends on the values
        legend = None if is_first or "y" in kind.along else "none"
        picture = draw(plot_data, Look(width="single", title=False, legend=legend))
        # transparent, because the page may be dark
        for background in (picture.patch, *(axes.patch for axes in picture.axes)):
            background.set_visible(False)
        source = f"data:image/svg+xml;base64,{base64.b64encode(encoded(picture, 'svg')).decode()}"
        command = self.command(number, plan, legend)
        label = kind.caption if is_first else caption
        return Figure(label, f"Figure {number}. {caption}", source, kind.of_friction, is_first, command)

    def command(self, number: int, plan: FigurePlan, legend: str | None) -> str:
        """Write the command that draws a figure; empty if a model is a Python value."""
        kind, choice, _ = plan
        axes = {"x": choice.x, "y": choice.y}
        words = [f"--{name}={value}" for name, value in axes.items() if value is not None]
        words += [f"--sel={name}={value}" for name, value in (choice.sel or {}).items()]
        if choice.models and len(choice.models) < self.model_count:
            words += [f"--model={key}" for key in choice.models]
        words += ["--legend=none"] if legend == "none" else []
        words += ["--width=single", "--no-title", f"--output=figure{number}.svg"]
        start = command_start(self.name or "RESULT.h5", self.dataset, "plot")
        return shlex.join([*start, f"--kind={kind.name}", *words]) if start else ""

    def has_answer(self, position: Position) -> bool:
        """Whether a model has an answer for an impact at some values of axes."""
        if "status" not in self.dataset:
            return True
        status = self.dataset["status"].isel(model=law_positions(self.keys, self.dataset))
        values = status.isel(position, missing_dims="ignore").values
        return bool(((values < FIRST_FAILURE) & (values != NO_IMPACT)).any())


def _plan_at(dataset: xr.Dataset, plan: FigurePlan, index: Position) -> FigurePlan:
    """Return the plan of the same figure at other indices of some axes."""
    position = {**plan.position, **index}
    if plan.kind.source == "history":
        sel = _inputs_at(dataset, position)
    else:
        sel = {str(dim): dataset[dim].values[place].item() for dim, place in position.items()}
    return FigurePlan(plan.kind, replace(plan.choice, sel=sel), position)


def _compare_values(
    drawing: Drawing, plan: FigurePlan, plot_data: PlotData
) -> tuple[list[str], list[tuple[Position, PlotData | None]]]:
    """Compare the data of a figure with those at the values of all other axes, at most MAX_COMPARED combinations.

    Returns sentences, and what is drawn too: the indices of the axes that differ, and the data there, but those of
    a figure of many points.
    Motions are integrated for it: they are compared at the first and the last value of each axis alone.
    """
    sizes, position = drawing.dataset.sizes, plan.position
    dims = [dim for dim in position if sizes[dim] > 1]
    base = tuple(position[dim] for dim in dims)
    part = _compared_part(drawing, plan)
    is_whole = part is drawing.dataset
    known: dict[tuple[int, ...], PlotData | None] = {base: plot_data} if is_whole else {}

    def read(index: Position) -> PlotData | None:
        # a motion is integrated once
        place = tuple({**position, **index}[dim] for dim in dims)
        if place not in known:
            known[place] = None
            # it may have no values there
            with suppress(ImpactError):
                choice = _plan_at(drawing.dataset, plan, index).choice
                known[place] = get_plot_data(part, plan.kind.name, choice, drawing.plugins)
        return known[place]

    if plan.kind.source == "history":
        compared = [{dim: place} for dim in dims for place in (0, sizes[dim] - 1)]
    else:
        count = {dim: sizes[dim] for dim in dims}
        while math.prod(count.values()) > MAX_COMPARED:
            count[max(count, key=lambda dim: count[dim])] -= 1
        places = itertools.product(*(_spread(sizes[dim], count[dim], position[dim]) for dim in dims))
        compared = [dict(zip(dims, place, strict=True)) for place in places]
    for index in compared:
        read(index)
    tables = {place: _numbers(data) for place, data in known.items()}
    differ = []
    for axis, dim in enumerate(dims):
        pairs = ((table, tables[*at[:axis], base[axis], *at[axis + 1 :]]) for at, table in tables.items())
        if not all(_are_equal(*pair) for pair in pairs):
            differ.append(dim)
    drawn = _more_positions(drawing, plan, differ)
    sentences = _comparison_sentences(sizes, dims, differ, drawn, len(tables))
    more = [(index, read(index)) for index in drawn]
    return sentences, [(index, data if is_whole else None) for index, data in more if data is not None]


def _compared_part(drawing: Drawing, plan: FigurePlan) -> xr.Dataset:
    """Leave out values of the axes of a figure until it has at most MAX_COMPARED_POINTS; a motion has few."""
    dataset, sizes = drawing.dataset, drawing.dataset.sizes
    if plan.kind.source == "history" or not plan.position:
        return dataset
    steps = {dim: 1 for dim in sizes if dim not in (*LAW_DIMS, *plan.position)}
    laws = len(drawing.keys) * sizes.get("friction", 1)
    while laws * math.prod(-(-sizes[dim] // step) for dim, step in steps.items()) > MAX_COMPARED_POINTS:
        steps[max(steps, key=lambda dim: sizes[dim] / steps[dim])] *= 2
    is_part = max(steps.values(), default=1) > 1
    return dataset.isel({dim: slice(None, None, step) for dim, step in steps.items()}) if is_part else dataset


def _comparison_sentences(
    sizes: Mapping[Hashable, int],
    dims: Sequence[Hashable],
    differ: Sequence[Hashable],
    drawn: Sequence[Position],
    compared_count: int,
) -> list[str]:
    """Describe which axes do not matter, and how many values and combinations are not drawn."""
    equal, sentences = [dim for dim in dims if dim not in differ], []
    if equal:
        combinations = math.prod(sizes[dim] for dim in dims)
        among = f" of {compared_count:,} of {combinations:,} combinations" if compared_count < combinations else ""
        verb = "do" if len(equal) > 1 else "does"
        sentences.append(f"{_and(equal)} {verb} not matter (differences{among} below {MAX_DIFFERENCE:.1%}).")
    combinations = math.prod(sizes[dim] for dim in differ) - 1 - len(drawn)
    parts = []
    for dim in differ:
        left = sizes[dim] - 1 - sum(index.keys() == {dim} for index in drawn)
        combinations -= left
        parts += [f"{left:,} value{'s' * (left > 1)} of {dim}"] if left else []
    parts += [f"{combinations:,} combination{'s' * (combinations > 1)} of {_and(differ)}"] if combinations else []
    sentences += [f"Not drawn: {_and(parts)}."] if parts else []
    return sentences


def _more_positions(drawing: Drawing, plan: FigurePlan, differ: Sequence[Hashable]) -> list[Position]:
    """Choose the indices at which a figure is drawn too: all combinations if few, else along one axis at a time.

    A motion is drawn at the ends of each axis, where it is compared. Samples are not drawn one by one.
    """
    kind, _, position = plan
    sizes, dims = drawing.dataset.sizes, [dim for dim in differ if dim != SAMPLE]
    count = 2 if kind.source == "history" else MAX_VALUES
    if kind.source != "history" and math.prod(sizes[dim] for dim in dims) - 1 <= MAX_MORE:
        places = itertools.product(*(range(sizes[dim]) for dim in dims))
        indices = [dict(zip(dims, place, strict=True)) for place in places]
    else:
        # the last value of each axis first, which differs most
        columns = [[{dim: place} for place in reversed(_spread(sizes[dim], count, position[dim]))] for dim in dims]
        indices = [index for row in itertools.zip_longest(*columns) for index in row if index is not None]
    changes = [{dim: place for dim, place in index.items() if place != position[dim]} for index in indices]
    drawn = [index for index in changes if index and drawing.has_answer({**position, **index})][:MAX_MORE]
    return sorted(drawn, key=lambda index: [len(index), *((dims.index(dim), at) for dim, at in index.items())])


def _spread(size: int, count: int, position: int) -> list[int]:
    """Choose indices of an axis: the first, the last and some between them, and a position."""
    return sorted({*np.linspace(0, size - 1, min(size, count)).round().astype(int).tolist(), position})


def _and(names: Sequence[object]) -> str:
    """Join names for a sentence."""
    words = [str(name) for name in names]
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def _numbers(plot_data: PlotData | None) -> tuple[Array, list[object]] | None:
    """Read the numbers that a picture shows, and the closest models."""
    if plot_data is None:
        return None
    table = plot_data.long_table()
    closest = list(table.get("closest", []))
    shown = table[["abs_e_error"]] if closest else table.select_dtypes("number")
    return shown.to_numpy(float), closest


def _are_equal(first: tuple[Array, list[object]] | None, second: tuple[Array, list[object]] | None) -> bool:
    """Whether no number differs by more than MAX_DIFFERENCE of the largest in its column, or than rounding."""
    if first is None or second is None:
        return first is second
    (a, words), (b, other_words) = first, second
    if a.shape != b.shape or words != other_words:
        return False
    largest = np.fmax.reduce(np.where(np.isfinite(a), np.abs(a), 0.0), axis=0, initial=0.0)
    most = np.fmax(MAX_DIFFERENCE * largest, MIN_ERROR_FLOOR)
    return np.allclose(a, b, rtol=0.0, atol=most, equal_nan=True)


def _condition_sentences(dataset: xr.Dataset, position: Position, keys: Sequence[str]) -> Iterator[str]:
    """Write the inputs that vary in the sweep and not in the figure: for all models, and for each model."""
    point, inputs = dataset.isel(position), varying_inputs(dataset)
    for key in ("", *keys):
        values = at_text(point, [name for name in inputs if InputName.parse(name).model == key])
        if values:
            yield f"{'With' if key else 'At'} {values}."


def _changes_text(dataset: xr.Dataset, index: Position) -> str:
    """Write the inputs along some axes at their indices."""
    inputs = varying_inputs(dataset)
    along = {dim: [name for name in inputs if dataset[name].dims == (dim,)] for dim in index}
    return at_text(dataset.isel(index), [name for dim in index for name in along[dim] or [str(dim)]])


def at_text(point: xr.Dataset, names: Sequence[str]) -> str:
    """Write the inputs that have a single value at a point; no line break separates a name from its value."""
    values = (f"{name} = {coordinate_text(point, name)}" for name in names if point[name].ndim == 0)
    return ", ".join(value.replace(" ", "\u00a0") for value in values)


def iterate_choices(dataset: xr.Dataset, keys: Sequence[str]) -> Iterator[FigurePlan]:
    """Choose the figures of a result; a motion comes last, at the middle of the axis of other figures."""
    axes = numeric_axes(dataset)
    for kind in sorted(kinds_of(dataset), key=lambda kind: kind.source == "history"):
        choice = kind.default(dataset, keys) if kind.in_report else None
        if choice is None:
            continue
        if kind.source in STUDIES:
            yield FigurePlan(kind, choice, {})
            continue
        is_motion = kind.source == "history"
        inputs = [choice.x] if is_motion else kind.inputs_along(choice.x, choice.y)
        dims = [axes[name].dims[0] for name in inputs if name in axes and name not in (choice.sel or {})]
        position = _first_answered_index(dataset, keys, [*dims, *({SAMPLE} & {*kind.along})])
        if is_motion and choice.x:
            position[dims[0]] = _answered_near_middle(dataset.isel(position), kind, axes[choice.x])
        choice = replace(choice, x=None if is_motion else choice.x, sel=None)
        yield _plan_at(dataset, FigurePlan(kind, choice, {}), position)


def _inputs_at(dataset: xr.Dataset, position: Position) -> dict[str, float | str]:
    """Find the inputs that select a point: the label of an axis, or all columns of an axis of cases or samples."""
    names = {dim: [str(dim)] if is_input(dim) else columns_along(dataset, dim) for dim in position}
    inputs = {name: dataset[name].values[position[dim]].item() for dim in names for name in names[dim]}
    # a missing number is not an input
    return {name: value for name, value in inputs.items() if value == value}


def _answered_near_middle(dataset: xr.Dataset, kind: Kind, axis: xr.DataArray) -> int:
    """Find the index nearest the middle of an axis at which a law has an answer, and with friction a slip."""
    order, (dim,) = np.argsort(axis.values, kind="stable"), axis.dims
    indices = order[np.argsort(np.abs(np.arange(order.size) - order.size // 2), kind="stable")]
    values = dataset.get("beta" if kind.of_friction else "status")
    if values is not None and dim in values.dims:
        answered = values.notnull() if kind.of_friction else (values < FIRST_FAILURE) & (values != NO_IMPACT)
        has_answer = answered.any(set(answered.dims) - {dim}).values[indices]
        indices = indices[has_answer] if has_answer.any() else indices
    return int(indices[0])


def _first_answered_index(
    dataset: xr.Dataset, keys: Sequence[str], drawn: Sequence[Hashable]
) -> dict[Hashable, int]:
    """Find the first impact that a model has an answer for: its index along each axis that is not drawn."""
    dims = dataset["status"].dims if "status" in dataset else dataset.dims
    axes = [dim for dim in dims if dim not in ("model", "friction", *drawn)]
    first: tuple[int, ...] | None = None
    for index in law_positions(keys, dataset) if "status" in dataset else ():
        answered = _first_answered_of_model(dataset.isel(model=index), axes)
        first = min(filter(None, (first, answered)), default=None)
        if first is not None and not any(first):
            break
    return dict(zip(axes, first or (0,) * len(axes), strict=True))


def _first_answered_of_model(model_data: xr.Dataset, axes: Sequence[Hashable]) -> tuple[int, ...] | None:
    """Find the first impact that a model has an answer for: its index along some axes; None without one.

    If the status of more than MAX_SEARCHED points would be computed, a coarser grid is searched.
    """
    status, _ = distinct_points(model_data, "status")
    ordered = [*axes, *(dim for dim in status.dims if dim not in axes)]
    steps = dict.fromkeys(ordered, 1)
    if is_computed(status):
        while math.prod(-(-status.sizes[dim] // step) for dim, step in steps.items()) > MAX_SEARCHED:
            steps[max(steps, key=lambda dim: status.sizes[dim] / steps[dim])] *= 2
    status = status.isel({dim: slice(None, None, step) for dim, step in steps.items()})
    for region in slabs({dim: status.sizes[dim] for dim in ordered}):
        part = status.isel(region)
        values = part.values.transpose([part.dims.index(dim) for dim in ordered])
        answered = (values < FIRST_FAILURE) & (values != NO_IMPACT)
        if answered.any():
            first = np.unravel_index(int(np.argmax(answered)), answered.shape)
            return tuple(
                (region[dim].start + int(index)) * steps[dim] for dim, index in zip(axes, first, strict=False)
            )
    return None


def coordinate_text(dataset: xr.Dataset, name: str) -> str:
    """Write the value of a scalar coordinate with its unit."""
    value = InputName.parse(name).word(dataset[name].values.item())
    return "∞" if value == math.inf else prefixed(value, numbered_unit(dataset, name), 6)
