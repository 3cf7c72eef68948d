"""Rank the models of a result, or its pairs with friction laws, by how closely they deliver a wanted output."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, SupportsFloat, overload

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..array_types import Mask
from ..config.files import read_number
from ..config.input_names import InputName, with_words
from ..config.quantities import Quantity
from ..config.tables import TOLERANCE
from ..contact.status import FIRST_FAILURE, FrictionStatus, Status
from ..contact.units import names_in, with_numbers
from ..contact.variables import OUTPUTS
from ..display import Block, Displayed, Table, html_of
from ..errors import UsageError, did_you_mean, warn
from ..formatting import argument, law_name, percentage, prefixed, safe_text
from .provenance import describe_point
from .schema import columns_along, parts_of_laws, plain_unit, require_axes, require_sweep
from .selection import as_keys, require_outputs, select, select_laws
from .slabs import Slab, distinct_points, is_computed, read_slab, slabs, varying_dims
from .xarray_backend import result_of

# lazy results with more points are not ranked; this many take some minutes
MAX_RANKED_POINTS = 2**30
# combinations of the values of a law's own parameters
MAX_PARAMETER_COMBINATIONS = 2**24
# accepted |e_out - e|
DEFAULT_TOL = 0.01
# errors that differ by less are equal; smaller ones are errors of the integrator, which are up to about rtol
MIN_ERROR_FLOOR = 1e-9
# outputs that may be a target: numbers of the order of 1
TARGETS = tuple(name for name, variable in OUTPUTS.items() if variable.scale == "1" and variable.per_model)
# rows of the text; the rest is only counted
MAX_ROWS = 30
# ranges of e that a table lists, and models that a sentence names
MAX_RANGES, MAX_NAMED = 8, 3


@dataclass(frozen=True)
class Criterion:
    """What laws are ranked by: the distance of an output from a target; without one, of e_out from the asked e.

    `along` is the input whose ranges are listed in which all points are within the tolerance.
    """

    output: str = "e_out"
    target: float | None = None
    along: str = "e"

    @property
    def names(self) -> tuple[str, str]:
        """The variable whose values are judged, and the status that explains its NaNs."""
        name = "e_error" if self.target is None else self.output
        return name, OUTPUTS[name].status

    @property
    def text(self) -> str:
        return "e" if self.target is None else f"{self.output} = {self.shown(self.target)}"

    def shown(self, value: float, digits: int = 6) -> str:
        """Write a value of the output, or an error of it."""
        return prefixed(value, OUTPUTS[self.output].unit, digits)


BY_ERROR = Criterion()


@dataclass(frozen=True)
class Ranked:
    """How well one model, or its pair with a friction law, delivers the target, with the best own parameters.

    parameters : the best values by path in the config, such as "model.bilinear.K"; empty if none is an axis
    points : number of points with a target and an impact
    within, failed : number of those with |e_out - e|, or the distance of `output` from its target, within the
        tolerance, and of those that failed
    mean_error, max_error : of that distance over the points that did not fail; NaN if all failed. The mean is
        exact, rounded once: it depends neither on the order of the points nor on slabs
    at, e_out : the swept inputs by config name, and e, at the point with the largest error, empty if all failed,
        and the value of `output` there
    served : the ranges of e, or with a target of the angle if there is one, in which all points are within the
        tolerance; None unless it varies along one axis
    crossings : pairs of neighbouring values of that input, neither of which is in `served`, between which the
        output crosses its target; empty if it also varies along other axes, or values of the input repeat
    friction : key of the friction law; "" for a model alone
    criterion : the output that is ranked, and the input that `served` has ranges of
    units : those of the parameters and of `at`, by path, where they are known
    """

    model: str
    parameters: Mapping[str, float | str]
    points: int
    within: int
    failed: int
    mean_error: float
    max_error: float
    at: Mapping[str, float | str]
    e_out: float
    served: tuple[tuple[float, float], ...] | None
    crossings: tuple[tuple[float, float], ...] = ()
    friction: str = ""
    criterion: Criterion = BY_ERROR
    units: Mapping[str, str] = field(default_factory=dict, repr=False, compare=False)

    @property
    def name(self) -> str:
        """The model, its friction law, and the parameters that were chosen."""
        chosen = (
            f"{path.rpartition('.')[2]} = {prefixed(value, self.units.get(path, '1'), 6)}"
            for path, value in with_words(self.parameters).items()
        )
        return law_name(self.model, ", ".join(filter(None, [self.friction, *chosen])))

    @property
    def record(self) -> dict[str, Any]:
        """The fields as plain data, with words, without those of friction and of a target that do not apply."""
        left_out, output = ("criterion", "friction", "units"), self.criterion.output
        record = {name: value for name, value in vars(self).items() if name not in left_out}
        record |= {inputs: with_words(record[inputs]) for inputs in ("parameters", "at")}
        record = {output if name == "e_out" else name: value for name, value in record.items()}
        return record | {"share": self.share} | ({"friction": self.friction} if self.friction else {})

    @property
    def share(self) -> float:
        """The part of the points within the tolerance, from 0 to 1."""
        return self.within / self.points if self.points else 0.0

    @property
    def serves_everywhere(self) -> bool:
        return 0 < self.points == self.within

    @property
    def row(self) -> tuple[str, ...]:
        """The model in a table under `Ranking.headings`.

        >>> Ranked("hertz", {}, 10, 1, 0, 0.45, 0.9, {"e": 0.1}, 1.0, ((1.0, 1.0),)).row
        ('hertz', '10.0%', '0.9', '0.45', '0', 'e=0.1: e_out 1', '1')
        >>> Ranked("exact-hysteresis", {}, 9, 9, 0, 2e-12, 5e-11, {"e": 0.1}, 0.1, ((0.1, 0.9),)).row
        ('exact-hysteresis', '100%', '<1e-9', '<1e-9', '0', '–', '0.1 to 0.9')
        >>> Ranked("hertz", {}, 10, 1, 0, 0.45, 0.9, {"e": 1 / 9}, 1.0, ((8 / 9, 1.0),)).row[-2:]
        ('e=0.111111: e_out 1', '0.888889 to 1')
        """
        shown, output = self.criterion.shown, self.criterion.output
        # the digits of an error of the integrator mean nothing
        errors = (
            "<1e-9" if 0.0 < error < MIN_ERROR_FLOOR else shown(error, 3)
            for error in (self.max_error, self.mean_error)
        )
        has_worst = self.at and self.max_error > MIN_ERROR_FLOOR
        worst = f"{describe_point(self.at, 6, self.units)}: {output} {shown(self.e_out, 4)}" if has_worst else "–"
        return (self.name, percentage(self.share), *errors, f"{self.failed:,}", worst, self._served_text)

    @property
    def _served_text(self) -> str:
        """The first ranges that it serves, and where it crosses the target."""
        if self.served is None:
            return "–"
        unit = InputName.parse(self.criterion.along).unit
        ranges = []
        for ends in sorted((*self.served, *self.crossings)):
            shown = [prefixed(end, unit, 6) for end in dict.fromkeys(ends)]
            ranges.append("between " + " and ".join(shown) if ends in self.crossings else " to ".join(shown))
        more = f" and {len(ranges) - MAX_RANGES:,} more" if len(ranges) > MAX_RANGES else ""
        return ", ".join(ranges[:MAX_RANGES]) + more or "nowhere"


@dataclass(frozen=True)
class Ranking(Displayed, Sequence[Ranked]):
    """The models or pairs of a result, ordered by their share of points within the tolerance, then by errors.

    Errors below `floor`, see `error_floor`, are equal; equal models are in the order of the result.
    """

    tol: float
    models: tuple[Ranked, ...]
    criterion: Criterion = BY_ERROR
    floor: float = MIN_ERROR_FLOOR

    @overload
    def __getitem__(self, index: int) -> Ranked: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Ranked, ...]: ...

    def __getitem__(self, index: int | slice) -> Ranked | tuple[Ranked, ...]:
        return self.models[index]

    def __len__(self) -> int:
        return len(self.models)

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of a table of `Ranked.row`; the first and the last two columns are text, the others numbers."""
        tol = self.criterion.shown(self.tol)
        return (
            "pair" if self.models[0].friction else "model",
            f"points within {tol}",
            "max error",
            "mean error",
            "failed",
            "worst point",
            f"{self.criterion.along} within {tol}",
        )

    @property
    def best(self) -> tuple[Ranked, ...]:
        """The models that are within the tolerance at all points."""
        return tuple(ranked for ranked in self.models if ranked.serves_everywhere)

    @property
    def headline(self) -> str:
        """The result in a sentence."""
        first = self.models[0]
        tol, points = self.criterion.shown(self.tol), f"{first.points:,} points"
        alone = "the only point" if first.points == 1 else ""
        if self.best:
            verb = "give" if len(self.best) > 1 else "gives"
            return f"{_listed(self.best)} {verb} {self.criterion.text} within {tol} at {alone or f'all {points}'}"
        nothing = f"no {'pair' if first.friction else 'model'} gives {self.criterion.text} within {tol}"
        if first.within:
            best = _rank_key(first, self.floor)
            nearest = [ranked for ranked in self.models if _rank_key(ranked, self.floor) == best]
            verb, share = "are" if len(nearest) > 1 else "is", percentage(first.share)
            return f"{nothing} everywhere; {_listed(nearest)} {verb} nearest: {share} of {points}"
        return f"{nothing} at {alone or f'any of {points}'}"

    def as_dict(self) -> dict[str, Any]:
        """The ranking as plain data."""
        target = {} if self.criterion.target is None else {self.criterion.output: self.criterion.target}
        return {
            "headline": self.headline,
            "tol": self.tol,
            **({"target": target} if target else {}),
            "best": [law_name(row.model, row.friction) for row in self.best],
            "models": self.records(),
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The models, the best first."""
        return [row.record for row in self.models]

    def sections(self, width: int) -> Iterator[Block]:
        """The headline and a table of the first models."""
        yield self.headline
        yield ""
        yield self._table(self.models[:MAX_ROWS])
        more = len(self.models) - MAX_ROWS
        if more > 0:
            yield f"and {more:,} more (--json has all)"

    def _table(self, models: Sequence[Ranked]) -> Table:
        return Table([model.row for model in models], self.headings, text=(0, 5, 6))

    def _repr_html_(self) -> str:
        return html_of([self.headline, self._table(self.models)])


def error_floor(dataset: xr.Dataset) -> float:
    """The difference of restitutions below which they are equal: two errors of the integrator.

    >>> error_floor(xr.Dataset(attrs={"rtol": 1e-10})), error_floor(xr.Dataset(attrs={"rtol": 1e-4}))
    (1e-09, 0.0002)
    """
    return max(MIN_ERROR_FLOOR, 2.0 * float(dataset.attrs.get("rtol", 0.0)))


def recommend(
    dataset: xr.Dataset | str | Path,
    *,
    tol: SupportsFloat | str = DEFAULT_TOL,
    sel: Mapping[str, object] | None = None,
    models: str | Sequence[str] | None = None,
    target: Mapping[str, object] | None = None,
    frictions: Sequence[str] | None = None,
) -> Ranking:
    """Rank the models of a result by the error of their restitution, over all points of the sweep.

    The criterion is |e_out - e| at all points with a target e and an impact; with a target, the distance of that
    output from it, by which pairs of a model and a friction law are ranked if it depends on friction. A point that
    failed, or whose target e is below 0 (1 - alpha v0 < 0), counts as not within the tolerance. The values of a
    law's own parameters are chosen: the law is ranked over all other axes, with the values that give the largest
    share of points within the tolerance, and among those the smallest error. The result may be of any size: points
    that differ only along axes on which nothing varies are evaluated once, and counted as often as they occur.

    Parameters
    ----------
    dataset : a result, or its file
    tol : largest accepted |e_out - e|, or distance from the target, which may have its unit
    sel : values of axes, such as `{"m2": 1.0}`; by default all values of an axis are ranked
    models : keys of the models to rank; by default all
    target : the value of one output, such as `{"beta": 0.4}`; by default e_out is compared with the e asked for
    frictions : keys of the friction laws to rank, for a target that depends on friction; by default all

    Returns
    -------
    Ranking : the models or pairs, the best first; `ranking.best` are those within the tolerance at all points

    Raises
    ------
    UsageError : the result has no requested e, or lacks what the arguments select, or has too many points; tol is
        not a positive finite number; the target is not one number of an output of the order of 1

    >>> import impact
    >>> result = impact.sweep("configs/figure6.toml")
    >>> print(impact.recommend(result, models=["gharib-hurmuzlu-2012"]).headline)
    no model gives e within 0.01 everywhere; gharib-hurmuzlu-2012 is nearest: 25.7% of 101 points
    """
    dataset = result_of(dataset)
    require_sweep(dataset, "recommend")
    require_axes(dataset)
    criterion = BY_ERROR
    if target is not None:
        name, value = only_target(target)
        if name not in TARGETS:
            expected = f"an output of the order of 1; {did_you_mean(name, TARGETS)}"
            raise UsageError(f'{argument("target")}: got "{name}", expected {expected}')
        criterion = Criterion(name, target_value(name, value), "angle" if "angle" in dataset.variables else "e")
    tolerance = replace(TOLERANCE, unit=OUTPUTS[criterion.output].unit, meaning="largest accepted difference")
    tol = read_number(tol, tolerance, argument("tol"))
    if as_keys(frictions, "frictions") and not OUTPUTS[criterion.names[0]].of_friction:
        origin, of = argument("frictions"), argument("target")
        raise UsageError(f"{origin}: expected a {of} that depends on friction, such as beta=0.4")
    return rank_laws(dataset, tol, criterion, sel, models, frictions)


def only_target(target: Mapping[str, object]) -> tuple[str, object]:
    """Return the name and the value of a target of one output."""
    items = list(target.items())
    if len(items) != 1:
        example = argument("target", {"e_out": 0.6})
        raise UsageError(f"{argument('target')}: got {len(items)} targets, expected one, such as {example}")
    return items[0]


def target_value(name: str, value: object) -> float:
    """Read the target of an output, a number that may have a unit."""
    output = OUTPUTS[name]
    # of an angle to the normal
    most = 0.5 * math.pi if output.unit == "rad" else math.inf
    return read_number(value, Quantity(output.unit, output.meaning, -most, most), argument("target", key=name))


def rank_laws(
    dataset: xr.Dataset,
    tol: float,
    criterion: Criterion = BY_ERROR,
    sel: Mapping[str, object] | None = None,
    models: Sequence[str] | None = None,
    frictions: Sequence[str] | None = None,
    max_points: int = MAX_RANKED_POINTS,
) -> Ranking:
    """Rank the laws of a result; refuse one that lacks a target, or has too many points to rank or none."""
    _check_rankable(dataset, criterion)
    selected = select_laws(select(dataset[list(criterion.names)], sel or {}), models, frictions)
    parts = [part for _, part in parts_of_laws(selected, selected.dims, first=0)]
    evaluated = [
        _reduce_dims(part, criterion)[0] for part in parts if is_computed(part.variables[criterion.names[0]])
    ]
    points = sum(math.prod(part.sizes.values()) for part in evaluated)
    if points > max_points:
        raise UsageError(
            f"got {points:,} different points to rank, expected at most {max_points:,}; select values of axes"
        )
    ranked = [_rank_law(part, tol, criterion) for part in parts]
    if not any(law.points for law in ranked):
        wanted = "a requested e" if criterion.target is None else f"a value of {criterion.output}"
        raise UsageError(f"nothing to rank: no point has both {wanted} and an impact")
    floor = error_floor(dataset)
    ranked.sort(key=lambda law: _rank_key(law, floor))
    return Ranking(tol, tuple(ranked), criterion, floor)


def _check_rankable(dataset: xr.Dataset, criterion: Criterion) -> None:
    """Refuse a dataset by which laws cannot be ranked."""
    if "t" in dataset.dims:
        raise UsageError("got a time history, expected the result of a sweep")
    if "model" not in dataset.dims:
        raise UsageError("model is not an axis of this result; select models as a list, sel(model=[...])")
    name = criterion.names[0]
    if name not in dataset and OUTPUTS[name].of_friction and "friction" not in dataset.dims:
        raise UsageError(f"this result has no {name}: its sweep has no frictions")
    require_outputs(dataset, criterion.names)
    if criterion.target is not None:
        return
    e = distinct_points(dataset, "e")[0] if "e" in dataset.coords else xr.Variable((), np.nan)
    if all(np.isnan(e.isel(slab).values).all() for slab in slabs(e.sizes)):
        raise UsageError("this sweep has no requested e, which the ranking needs; add e or alpha")
    dims = set(dataset["e_error"].dims)
    if "model" not in dims or dims != set(dataset["status"].dims) or not dims.issuperset(dataset["e"].dims):
        raise UsageError("e_error, status and e of this result do not lie along the axes of a sweep")


def _rank_key(ranked: Ranked, floor: float) -> tuple[float, ...]:
    # a model that failed everywhere has no errors; those below the floor are equal
    errors = (0.0 if error < floor else error for error in (ranked.max_error, ranked.mean_error))
    return (-ranked.share, *(math.inf if math.isnan(error) else error for error in errors))


def _listed(models: Sequence[Ranked]) -> str:
    """Name the first models in a sentence, and count the others."""
    names = [safe_text(ranked.name, 120) for ranked in models[:MAX_NAMED]]
    others = len(models) - MAX_NAMED
    names += [f"{others} other{'s' * (others > 1)}"] if others > 0 else []
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def _keys(law_data: xr.Dataset) -> tuple[str, str]:
    """The keys of the model and of the friction law of a part; "" for a model alone."""
    return str(law_data["model"].item()), str(law_data["friction"].item()) if "friction" in law_data.coords else ""


def _is_along_one(law_data: xr.Dataset, name: str) -> bool:
    """Whether an input varies along one axis."""
    return name in law_data.variables and law_data.variables[name].ndim == 1


def _reduce_dims(law_data: xr.Dataset, criterion: Criterion, *more: Hashable) -> tuple[xr.Dataset, int]:
    """Keep the axes along which ranked variables or e vary, and `more`; return also the weight of each point."""
    varying = {*more, *(dim for name in criterion.names for dim in varying_dims(law_data, name))}
    if _is_along_one(law_data, criterion.along):
        varying |= {*law_data.variables[criterion.along].dims}
    elif criterion.target is None:
        varying |= {*varying_dims(law_data, "e")}
    ranked = law_data[list(criterion.names)]
    fixed = [dim for dim in ranked.sizes if dim not in varying]
    return ranked.isel(dict.fromkeys(fixed, 0)), math.prod(ranked.sizes[dim] for dim in fixed)


@dataclass(frozen=True)
class _JudgedSlab:
    """Points of a slab: the output, its side of the target (-1, 0 or 1) and its distance from it, and which points
    count, failed, have a distance and are within tol."""

    slab: Slab
    output: NDArray[Any]
    side: NDArray[np.float64]
    distance: NDArray[np.float64]
    judged: Mask
    failed: Mask
    evaluable: Mask
    within: Mask


def _judged_slabs(
    evaluated: xr.Dataset, sizes: Mapping[Hashable, int], tol: float, criterion: Criterion
) -> Iterator[_JudgedSlab]:
    """Judge all points, slab by slab, with the dimensions in the order of `sizes`."""
    for slab in slabs(sizes):
        values, status = (read_slab(evaluated, name, slab) for name in criterion.names)
        values = np.asarray(values, float)
        if criterion.target is None:
            target = read_slab(evaluated, "e", slab)
            output, error, has_target = target + values, values, ~np.isnan(target)
        else:
            # an answer without this output, such as beta without a slip, has no target
            output, error = values, values - criterion.target
            is_slow = status == FrictionStatus.SLOW_LIMIT
            has_target = ~(np.isnan(values) & ((status == FrictionStatus.OK) | is_slow))
            if is_slow.any():
                laws, meaning = law_name(*_keys(evaluated)), FrictionStatus.SLOW_LIMIT.meaning
                warn(f"{laws}: {criterion.output} is {meaning}; see impact timestep")
        distance = np.abs(error)
        judged = has_target & (status != Status.NO_IMPACT)
        failed = judged & (status >= FIRST_FAILURE)
        evaluable = judged & ~failed & ~np.isnan(distance)
        within = evaluable & (distance <= tol)
        yield _JudgedSlab(slab, output, np.sign(error), distance, judged, failed, evaluable, within)


def _best_parameters(
    law_data: xr.Dataset, parameter_dims: Sequence[Hashable], tol: float, criterion: Criterion
) -> dict[Hashable, int]:
    """Find the index on each axis of a law's own parameters at which it ranks best over all other axes."""
    evaluated, _ = _reduce_dims(law_data, criterion, *parameter_dims)
    shape = tuple(evaluated.sizes[dim] for dim in parameter_dims)
    if math.prod(shape) > MAX_PARAMETER_COMBINATIONS:
        law = law_name(*_keys(law_data))
        raise UsageError(
            f"got {math.prod(shape):,} combinations of parameters of {law}, expected at "
            f"most {MAX_PARAMETER_COMBINATIONS:,}; select values of them"
        )
    dims = evaluated.variables[criterion.names[0]].dims
    other_dims = (dim for dim in dims if dim not in parameter_dims)
    sizes = {dim: evaluated.sizes[dim] for dim in (*parameter_dims, *other_dims)}
    points, within, errors = np.zeros(shape, int), np.zeros(shape, int), np.full(shape, np.nan)
    others = tuple(range(len(parameter_dims), len(sizes)))
    for part in _judged_slabs(evaluated, sizes, tol, criterion):
        parameter_slab = tuple(part.slab[dim] for dim in parameter_dims)
        points[parameter_slab] += part.judged.sum(axis=others)
        within[parameter_slab] += part.within.sum(axis=others)
        largest = np.fmax.reduce(np.where(part.evaluable, part.distance, np.nan), axis=others, initial=np.nan)
        errors[parameter_slab] = np.fmax(errors[parameter_slab], largest)
    share = within / np.maximum(points, 1)
    best = np.lexsort((np.where(np.isnan(errors), np.inf, errors).reshape(-1), -share.reshape(-1)))[0]
    return dict(zip(parameter_dims, map(int, np.unravel_index(best, shape)), strict=True))


def _varies_parameters(law_data: xr.Dataset, dim: Hashable) -> bool:
    """Check whether only parameters of the law, and perhaps of others, vary along a dimension."""
    names = [InputName.parse(name) for name in columns_along(law_data, dim)]
    return all(map(_is_parameter, names)) and any(name.applies_to(*_keys(law_data)) for name in names)


def _is_parameter(name: InputName) -> bool:
    return name.table in ("model", "friction")


def _rank_law(law_data: xr.Dataset, tol: float, criterion: Criterion) -> Ranked:
    """Rank a model or a pair by the judged variable, its status and the target."""
    variable, along = criterion.names[0], criterion.along
    parameter_dims = [dim for dim in law_data.variables[variable].dims if _varies_parameters(law_data, dim)]
    best = _best_parameters(law_data, parameter_dims, tol, criterion) if parameter_dims else {}
    chosen = _swept_inputs(law_data, best)
    law_data = law_data.isel(best)
    axes = law_data.variables[variable].dims
    evaluated, weight = _reduce_dims(law_data, criterion)
    sizes = {dim: evaluated.sizes[dim] for dim in evaluated.variables[variable].dims}
    along_one = _is_along_one(law_data, along)
    served_input = evaluated.variables[along] if along_one else xr.Variable((), 0.0)
    # for each value of an input along one axis: how many points count, and how many are within tol
    judged, within = np.zeros(served_input.shape, int), np.zeros(served_input.shape, int)
    # and where there is one, on which side of the target it is
    side = np.full(served_input.shape, np.nan)
    others = tuple(axis for axis, dim in enumerate(sizes) if dim not in served_input.dims)
    evaluable_points = failed_points = 0
    total, max_error, e_out = Fraction(), math.nan, math.nan
    worst: dict[Hashable, int] | None = None
    for part in _judged_slabs(evaluated, sizes, tol, criterion):
        slab, distance, evaluable = part.slab, part.distance, part.evaluable
        positions = tuple(slab[dim] for dim in served_input.dims)
        judged[positions] += part.judged.sum(axis=others)
        within[positions] += part.within.sum(axis=others)
        if along_one and not others:
            side[positions] = np.where(evaluable, part.side, np.nan)
        evaluable_points += weight * int(evaluable.sum())
        failed_points += weight * int(part.failed.sum())
        if evaluable.any():
            total += weight * _exact_sum(distance[evaluable & np.isfinite(distance)].tolist())
            index = np.unravel_index(int(np.argmax(np.where(evaluable, distance, -1.0))), distance.shape)
            if worst is None or distance[index] > max_error:
                max_error = float(distance[index])
                e_out = float(part.output[index])
                worst = {dim: slab[dim].start + int(position) for dim, position in zip(sizes, index, strict=True)}
    at: dict[str, float | str] = {}
    mean_error = math.nan
    if worst is not None:
        # an infinite error comes from a file that was not written by a sweep
        mean_error = max_error if math.isinf(max_error) else float(total / evaluable_points)
        at = _swept_inputs(law_data, {dim: worst.get(dim, 0) for dim in axes}) | chosen
        if criterion.target is None:
            e = evaluated.variables["e"]
            at["e"] = float(e.isel({dim: worst[dim] for dim in e.dims}).values.item())
    parameters = {
        name.config_key: chosen[str(name)] for name in map(InputName.parse, chosen) if _is_parameter(name)
    }
    exponent = law_data.variables.get("exponent")
    numbers = {"n": float(exponent.values)} if exponent is not None and exponent.ndim == 0 else {}
    model, friction = _keys(law_data)
    units: dict[str, str] = {}
    for name in {**chosen, **at}:
        unit = plain_unit(str(law_data.variables[name].attrs.get("units", "1")))
        if names_in(unit) <= numbers.keys():
            # what a user or a file has as a unit may be none; a K that the law replaces is that of another n
            has_number = names_in(unit) and not (name == "K" and f"{model}.K" in law_data.variables)
            units[InputName.parse(name).config_key] = with_numbers(unit, numbers) if has_number else unit
    served = _served_ranges(served_input.values, judged > 0, within < judged) if along_one else None
    crossings = _crossings(served_input.values, side, within > 0) if along_one else ()
    return Ranked(
        model,
        parameters,
        weight * int(judged.sum()),
        weight * int(within.sum()),
        failed_points,
        mean_error,
        max_error,
        at,
        e_out,
        served,
        crossings,
        friction,
        criterion,
        units,
    )


def _exact_sum(values: Sequence[float]) -> Fraction:
    """Sum finite numbers exactly, so that the sum of all slabs does not depend on the slabs.

    >>> _exact_sum([1e16, 1.0, 1e-16]) == Fraction(1e16) + 1 + Fraction(1e-16)
    True
    """
    parts: list[float] = []
    while remainder := math.fsum([*values, *(-part for part in parts)]):
        parts.append(remainder)
    return sum(map(Fraction, parts), Fraction())


def _swept_inputs(law_data: xr.Dataset, positions: Mapping[Hashable, int]) -> dict[str, float | str]:
    """List the swept inputs at a position along each axis, without the parameters of other laws."""
    variables = law_data.variables
    return {
        name: variables[name].values[position].item()
        for dim, position in positions.items()
        for name in dict.fromkeys([str(dim), *columns_along(law_data, dim)])
        if InputName.parse(name).applies_to(*_keys(law_data))
    }


def _served_ranges(e: NDArray[Any], requested: Mask, missed: Mask) -> tuple[tuple[float, float], ...]:
    """Find the ranges of neighbouring values of e at which every point that counts is within the tolerance."""
    # sorted, each value once: several combinations of alpha and speeds may give the same e
    values, value_index = np.unique(e[requested], return_inverse=True)
    served = np.bincount(value_index, missed[requested], values.size) == 0
    edges = np.diff(np.concatenate(([0], served, [0])))
    return tuple(zip(values[edges[:-1] == 1].tolist(), values[edges[1:] == -1].tolist(), strict=True))


def _crossings(values: NDArray[Any], side: NDArray[np.float64], within: Mask) -> tuple[tuple[float, float], ...]:
    """Find the neighbouring values, neither within the tolerance, between which the side of the target changes."""
    order = np.argsort(values)
    values, side, within = values[order], side[order], within[order]
    # values repeat where other inputs vary along the same axis: no curve goes through their points
    if (values[:-1] == values[1:]).any():
        return ()
    crosses = (side[:-1] * side[1:] < 0.0) & ~within[:-1] & ~within[1:]
    return tuple(zip(values[:-1][crosses].tolist(), values[1:][crosses].tolist(), strict=True))
