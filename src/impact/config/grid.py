"""The grid of a config: its axes, the groups that are zipped, and the samples that [design] draws."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from ..array_types import Array
from ..contact.model import ForceModel
from ..contact.variables import default_variables
from ..errors import did_you_mean
from ..formatting import argument
from .draft import Draft
from .input_names import InputName, input_values, paths_with
from .quantities import DISTRIBUTION_FORMS, MAX_PROBLEMS, ConfigProblem, Distribution, Range, Values, as_text
from .tables import Design

# default limit of the points of all models together
MAX_POINTS = 10**9
# limit of the points of a factored result, which are not stored one by one: they must fit in 64-bit indices
MAX_COUNTED_POINTS = 2**62
# name of the dimension of the samples of uncertain inputs
SAMPLE = "sample"
# samples of a unit interval stay this far from its ends, half the resolution of a Sobol sequence, so that no value
# of a normal distribution is infinite
LEAST_UNIT = 2.0**-31
# HDF5 arrays have at most 32 dimensions, and the models take one, friction laws another
MAX_AXES = 31
# chunks of a result and points of a chunk: a reader opens every chunk, and holds a whole one in memory
MAX_STORED_CHUNKS, MAX_CHUNK_POINTS = 100_000, 2**22

AxisValues = tuple[float, ...] | tuple[str, ...]


@dataclass(frozen=True)
class Axis:
    """One dimension of the grid: the columns of a zip group or of a table of cases, or one column.

    >>> Axis({"m1": (1.0, 2.0), "m2": (2.0, 4.0)}).name
    'm1'
    >>> Axis({"v1": (1.0, 1.0)}, numbered="case").labels
    (0, 1)
    """

    columns: Mapping[str, AxisValues]  # by config name, all of one length
    # the name of a dimension whose points are numbered from 0 since no column labels them: that of a table of
    # cases, of samples, or of a group with repeated values; empty where the first column labels the points
    numbered: str = ""
    numbers: tuple[int, ...] = ()  # of its points, for a part of such a dimension

    @property
    def name(self) -> str:
        """Name of the dimension."""
        return self.numbered or next(iter(self.columns))

    @property
    def size(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def labels(self) -> tuple[float, ...] | tuple[str, ...]:
        """Labels of its points: the values of the first column, or numbers."""
        return (self.numbers or tuple(range(self.size))) if self.numbered else self.columns[self.name]


def build_grid(
    draft: Draft, values: Values, groups: Sequence[Sequence[str]], samples: Sequence[str], max_points: int | None
) -> tuple[tuple[Axis, ...], list[ConfigProblem]]:
    """Build the axes of valid values by config name, and list problems.

    `groups` and `samples` name those that vary together.

    Without `max_points`, where not every point is stored, the number of trajectories is limited later.
    """
    cases = [str(name) for name, _ in input_values(draft.data) if name.path in draft.columns]
    sizes = {name: value.size for name, value in values.items() if isinstance(value, Range)}
    sizes |= {name: len(value) for name, value in values.items() if isinstance(value, tuple)}
    # also properties of a material, and parameters of laws that are not selected: these are no inputs of the grid
    written = {str(name): value for name, value in input_values(draft.data)}
    fixed = [name for name, value in written.items() if not isinstance(value, list | dict)]
    refused = dict.fromkeys(fixed, "which is a scalar, expected an axis: a list or a range")
    refused |= dict.fromkeys(cases, "a column of cases; those vary together already")
    refused |= dict.fromkeys(samples, "an uncertain input; those vary together already")
    member_of, problems = _zip_groups(groups, sizes, refused, draft.input_names)
    # parameters of laws, and properties of materials, that are not selected have no values here
    member_of = {name: [other for other in group if other in values] for name, group in member_of.items()}
    for numbered in (cases, samples):
        columns_of = [name for name in values if name in numbered]
        member_of |= dict.fromkeys(columns_of, columns_of)
    axis_names = [name for name, value in values.items() if not isinstance(value, float | str)]
    # a group takes the position of its first member
    leaders = [name for name in axis_names if member_of.get(name, (name,))[0] == name]
    laws = len(draft.models) * max(1, len(draft.frictions))
    points = math.prod(sizes.get(name, 1) for name in leaders) * laws
    most_axes = MAX_AXES - bool(draft.frictions)
    if len(leaders) > most_axes:
        problems.append((("sweep",), f"got {len(leaders)} axes, expected at most {most_axes}"))
    limit = MAX_COUNTED_POINTS if max_points is None else max_points
    if points > limit:
        times = "models and friction laws" if draft.frictions else "models"
        number_of_bytes = 8 * len(default_variables(bool(draft.frictions))) * points
        size = f"{points:,} points (axes times {times}), up to {number_of_bytes / 1e9:,.0f} GB"
        option = argument("max_points")
        hint = "" if max_points is None else f' in layout "full" ({option}); layout = "factored" stores any number'
        problems.append((("sweep",), f"got {size}, expected at most {limit:,} points{hint}"))
    columns: dict[str, AxisValues] = {}
    for name in axis_names:
        value, quantity = values[name], InputName.parse(name).quantity(draft.known_models)
        if isinstance(value, tuple):
            columns[name] = value
            if name not in member_of:
                problems += _repetition_problems(name, value, quantity.words if quantity else ())
        elif isinstance(value, Range) and points <= limit:
            assert quantity is not None
            try:
                columns[name] = value.values(quantity)
            except ValidationError as error:
                problems += [
                    ((*InputName.parse(name).path, *detail["loc"]), detail["msg"]) for detail in error.errors()
                ]
    # a group member with an invalid value has no column; that problem is reported by the validation
    groups = [member_of.get(name, (name,)) for name in leaders]
    is_complete = not problems and all(name in columns for group in groups for name in group)
    dimension_of = dict.fromkeys(cases, "case") | dict.fromkeys(samples, SAMPLE)
    return _build_axes(groups, columns, dimension_of) if is_complete else (), problems


def _build_axes(
    groups: Sequence[Sequence[str]], columns: Mapping[str, AxisValues], dimension_of: Mapping[str, str]
) -> tuple[Axis, ...]:
    """Build the axes of groups of columns; the first column without repeated values names the axis."""
    axes: list[Axis] = []
    # the points of cases, and of a group without such a column, are numbered: "case", then "case_2" and so on
    numbered = int("case" in dimension_of.values())
    for group in groups:
        naming = [name for name in group if len(set(columns[name])) == len(columns[name])]
        dimension = dimension_of.get(group[0], "")
        if not dimension and not naming:
            numbered += 1
            dimension = "case" if numbered == 1 else f"case_{numbered}"
        names = group if dimension else (naming[0], *(name for name in group if name != naming[0]))
        axes.append(Axis({name: columns[name] for name in names}, dimension))
    return tuple(axes)


def chunk_problems(
    chunks: Mapping[str, int], axes: Sequence[Axis], n_models: int, n_variables: int
) -> Iterator[ConfigProblem]:
    """Check the lengths of chunks along axes: for unknown axes, and for too many or too large chunks."""
    sizes, path = {axis.name: axis.size for axis in axes}, ("output", "chunks")
    unknown = [name for name in chunks if name not in sizes]
    yield from (((*path, name), f"no axis of this sweep; {did_you_mean(name, list(sizes))}") for name in unknown)
    if unknown or not chunks:
        return
    size = math.prod(min(chunks.get(name, length), length) for name, length in sizes.items())
    count = math.prod(-(-length // chunks.get(name, length)) for name, length in sizes.items())
    count *= n_models * n_variables
    if size > MAX_CHUNK_POINTS or count > MAX_STORED_CHUNKS:
        expected = f"expected at most {MAX_STORED_CHUNKS:,} of at most {MAX_CHUNK_POINTS:,}"
        yield path, f"got {count:,} chunks of {size:,} points, {expected}"


def _zip_groups(
    groups: Sequence[Sequence[str]], sizes: Mapping[str, int], refused: Mapping[str, str], known: Sequence[str]
) -> tuple[dict[str, Sequence[str]], list[ConfigProblem]]:
    """Find the group of each zipped name; `sizes` has the axes, and `refused` what is wrong with other names."""
    member_of: dict[str, Sequence[str]] = {}
    problems: list[ConfigProblem] = []
    for group_index, group in enumerate(groups[:MAX_PROBLEMS]):
        lengths: dict[str, int] = {}
        names = [str(InputName.parse(name)) for name in group[:MAX_PROBLEMS]]
        for member_index, name in enumerate(names):
            path = ("sweep", "zip", group_index, member_index)
            if name not in known:
                axes = [key for key in known if key in sizes]
                suggestion = did_you_mean(name, axes or list(known))
                problems.append((path, f"got {as_text(name)}, expected an axis; {suggestion}"))
            elif name in member_of:
                problems.append((path, f"got {as_text(name)} twice, expected each name once"))
            elif name in refused:
                problems.append((path, f"got {as_text(name)}, {refused[name]}"))
            elif name in sizes:
                lengths[name] = sizes[name]
            member_of.setdefault(name, names)
        if len(set(lengths.values())) > 1:
            of_each = ", ".join(f"{name} of {size}" for name, size in lengths.items())
            problems.append((("sweep", "zip", group_index), f"got {of_each} values, expected axes of one length"))
    return member_of, problems


def _repetition_problems(name: str, values: AxisValues, words: Sequence[str]) -> list[ConfigProblem]:
    """Report the first value of a list that occurs twice."""
    seen: set[object] = set()
    for index, value in enumerate(values):
        if value in seen:
            word = words[int(value)] if words and isinstance(value, float) else value
            return [((*InputName.parse(name).path, index), f"got {as_text(word)} twice, expected each value once")]
        seen.add(value)
    return []


def design_problems(data: Mapping[str, Any]) -> Iterator[ConfigProblem]:
    """Check that distributions have a [design], and that a [design] has distributions."""
    paths = paths_with(data, DISTRIBUTION_FORMS)
    if paths and "design" not in data:
        yield paths[0], "got a distribution, expected a table [design] as well, such as n = 1024"
    if not paths and "design" in data:
        expected = "at least one, such as v1 = { normal = [1.0, 0.05] }"
        yield ("design",), f"got a design without an uncertain input, expected {expected}"


def unit_samples(design: Design, dimensions: int) -> Array:
    """Draw samples of the unit cube, shape (n, dimensions)."""
    # imported here: scipy.stats is slow to import
    from scipy.stats import qmc

    random = np.random.default_rng(design.seed)
    engines = {"sobol": qmc.Sobol, "lhs": qmc.LatinHypercube, "halton": qmc.Halton}
    if design.method in engines:
        samples: Array = engines[design.method](dimensions, rng=random).random(design.n)
    else:
        samples = random.random((design.n, dimensions))
    return np.clip(samples, LEAST_UNIT, 1.0 - LEAST_UNIT)


def draw(kind: str, numbers: Sequence[float], u: Array) -> Array:
    """Evaluate the inverse of the cumulative function of a distribution at probabilities u.

    >>> draw("triangular", (0.0, 1.0, 2.0), np.array([0.125, 0.5, 0.875])).tolist()
    [0.5, 1.0, 1.5]
    >>> draw("empirical", (3.0, 1.0), np.array([0.2, 0.7])).tolist()
    [1.0, 3.0]
    """
    from scipy import stats

    with np.errstate(all="ignore"):
        match kind, numbers:
            case "uniform", [least, most]:
                drawn = stats.uniform(least, most - least).ppf(u)
            case "normal", [mean, deviation]:
                drawn = stats.norm(mean, deviation).ppf(u)
            case "lognormal", [median, ratio]:
                drawn = stats.lognorm(math.log(ratio), scale=median).ppf(u)
            case "triangular", [least, mode, most]:
                width = most - least
                drawn = stats.triang((mode - least) / width, least, width).ppf(u)
            case _:
                drawn = np.quantile(numbers, u, method="inverted_cdf")
    # -0.0 becomes 0.0
    return np.asarray(drawn) + 0.0


def draw_columns(
    distributions: Mapping[str, Distribution], models: Mapping[str, ForceModel], u: Array
) -> tuple[dict[str, Array], dict[str, str]]:
    """Draw the values of each input, and list those that its quantity does not allow; both by config name.

    The samples of the unit cube have the shape (n, inputs).
    """
    columns: dict[str, Array] = {}
    problems: dict[str, str] = {}
    for (name, distribution), probabilities in zip(distributions.items(), u.T, strict=True):
        columns[name] = drawn = draw(distribution.kind, distribution.numbers, probabilities)
        quantity = InputName.parse(name).quantity(models)
        assert quantity is not None
        refused = drawn[~(quantity.contains(drawn) & np.isfinite(drawn))]
        if refused.size:
            got = f"{refused.size:,} of {drawn.size:,} samples such as {as_text(float(refused[0]))}"
            problems[name] = f"got {got}, expected a distribution whose values are each {quantity.expected}"
    return columns, problems
