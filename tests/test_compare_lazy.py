"""A lazy result of any size is compared slab by slab, with the verdict of the same result in memory."""

from __future__ import annotations

import math
import tracemalloc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
import xarray as xr
from xarray.backends.common import BackendArray
from xarray.core import indexing

import impact
from impact.comparison.verdict import Verdict
from impact.errors import UsageError
from impact.plots.differences import difference_data
from impact.results.schema import SCHEMA_VERSION
from impact.results.slabs import SLAB_POINTS, VARIES_ALONG, is_lazy

ATTRIBUTES = {"schema_version": SCHEMA_VERSION, "rtol": 1e-10}
Compute = Callable[..., Any]


@dataclass
class Reads:
    """The number of values read, in total and in the largest read."""

    total: int = 0
    largest: int = 0


@dataclass(eq=False)
class Computed(BackendArray):
    """Values that are computed from the indices along the axes when they are read."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    compute: Compute
    reads: Reads = field(default_factory=Reads)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key: tuple[Any, ...]) -> Any:
        # an integer removes its axis after the values are computed
        indices = [np.atleast_1d(np.arange(size)[part]) for part, size in zip(key, self.shape, strict=True)]
        values = np.asarray(self.compute(*np.ix_(*indices)), self.dtype)
        values = np.broadcast_to(values, tuple(map(len, indices)))
        self.reads.total += values.size
        self.reads.largest = max(self.reads.largest, values.size)
        return values[tuple(0 if isinstance(part, int | np.integer) else slice(None) for part in key)]


def lazy(
    dims: tuple[str, ...],
    shape: tuple[int, ...],
    compute: Compute,
    dtype: str = "f8",
    reads: Reads | None = None,
    varies_along: Mapping[str, tuple[str, ...]] | None = None,
) -> xr.Variable:
    """A lazy variable; `compute` takes the indices along the axes as arrays that broadcast."""
    array = Computed(shape, np.dtype(dtype), compute, reads or Reads())
    encoding = {VARIES_ALONG: varies_along} if varies_along is not None else {}
    return xr.Variable(dims, indexing.LazilyIndexedArray(array), {}, encoding)


def as_lazy(result: xr.Dataset, reads: Reads, *, names_axes: bool) -> xr.Dataset:
    """A lazy copy of a result, with or without the axes along which its variables vary."""

    def lazy_copy(name: str) -> xr.Variable:
        variable = result.variables[name]
        along = None
        if names_axes:
            keys = np.ravel(result["model"].values).tolist()
            has_model = "model" in variable.dims
            along = {key: _varies(variable.isel(model=n) if has_model else variable) for n, key in enumerate(keys)}
        values = variable.values
        lazy_variable = lazy(
            variable.dims, variable.shape, lambda *indices: values[indices], values.dtype, reads, along
        )
        lazy_variable.attrs = variable.attrs
        return lazy_variable

    changed = result.assign({name: lazy_copy(name) for name in result.data_vars})
    assert all(is_lazy(changed.variables[name]) for name in result.data_vars)
    return changed


def _varies(variable: xr.Variable) -> tuple[str, ...]:
    first = {dim: variable.isel({dim: slice(0, 1)}).values for dim in variable.dims}
    return tuple(
        dim
        for dim in variable.dims
        if not np.array_equal(variable.values, np.broadcast_to(first[dim], variable.shape), equal_nan=True)
    )


def grid(
    sizes: Mapping[str, int],
    formulas: Mapping[str, Compute],
    reads: Reads | None = None,
    varies_along: Mapping[str, Mapping[str, tuple[str, ...]]] | None = None,
) -> xr.Dataset:
    """A lazy result of three models over e, v1, m1 and m2, computed from the indices along the axes."""
    coords = {
        "model": ["a", "b", "c"],
        "e": np.linspace(0.0, 1.0, sizes["e"]),
        "v1": np.linspace(1.0, 2.0, sizes["v1"]),
        "m1": np.linspace(1.0, 3.0, sizes["m1"]),
        "m2": np.linspace(1.0, 5.0, sizes["m2"]),
        "v2": 0.0,
    }
    dims = ("model", "e", "v1", "m1", "m2")
    shape = (3, *(sizes[dim] for dim in dims[1:]))
    dtypes = {"status": "i1", "in_domain": "i1", "steps": "i4"}
    variables = {
        name: lazy(dims, shape, formula, dtypes.get(name, "f8"), reads, (varies_along or {}).get(name))
        for name, formula in formulas.items()
    }
    return xr.Dataset(variables, coords, ATTRIBUTES)


def assert_same(a: Verdict, b: Verdict) -> None:
    """Assert that two verdicts are equal to the last digit."""
    assert (str(a), repr(a)) == (str(b), repr(b))
    assert list(a.worst_along) == list(b.worst_along)
    for axis, worst in a.worst_along.items():
        xr.testing.assert_identical(worst, b.worst_along[axis])


def mutants(result: xr.Dataset) -> list[xr.Dataset]:
    """Copies with different kinds of differences."""
    random = np.random.default_rng(5)
    changed = []
    for _ in range(7):
        copy = result.copy(deep=True)
        for name in random.choice(list(result.data_vars), 4, replace=False).tolist():
            values = copy[name].values
            kind = random.integers(4)
            if kind == 0:
                values[...] = values + 1
            elif kind == 1:
                values[..., -1] = 0 if values.dtype.kind == "i" else np.nan
            elif kind == 2:
                values.reshape(-1)[random.integers(values.size)] += 1
            elif values.dtype.kind == "f":
                values *= 1 + 1e-9
                values[0] = np.nan
        changed.append(copy)
    return changed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("names_axes", "numbers"), [(False, range(3)), (False, range(3, 7)), (True, range(3)), (True, range(3, 7))]
)
def test_a_lazy_result_has_the_verdict_of_one_in_memory(
    wide: xr.Dataset, names_axes: bool, numbers: Sequence[int]
) -> None:
    parts = [
        {},
        {"e": slice(None, None, -1)},
        {"e": [2, 0]},
        {"model": [1, 3]},
        {"v1": 1},
        {"model": 3},
        {"m1": 0, "material2": [1]},
    ]
    changed = mutants(wide)
    for number in numbers:
        new, part = changed[number], parts[number]
        reads = Reads()
        lazy_new, lazy_baseline = (as_lazy(result, reads, names_axes=names_axes) for result in (new, wide))
        subset = bool(number % 2)
        expected = impact.compare(new.isel(part), wide, subset=subset)
        assert_same(impact.compare(lazy_new.isel(part), lazy_baseline, subset=subset), expected)
        assert_same(impact.compare(lazy_new.isel(part), wide, subset=subset), expected)
        expected = impact.compare(wide, new.isel(part), subset=subset)
        assert_same(impact.compare(lazy_baseline, lazy_new.isel(part), subset=subset), expected)
        assert reads.total, number


def test_two_results_with_differences_in_several_slabs() -> None:
    sizes = {"e": 5, "v1": 60, "m1": 20, "m2": 40}
    positions = (2, 3, 30, 7, 11), (0, 4, 59, 19, 39), (2, 4, 0, 0, 0)

    def moved(by: float) -> Compute:
        def compute(*where: Any) -> Any:
            value = 0.5 + 0.0 * sum(where)
            for position in positions:
                is_here = math.prod(w == p for w, p in zip(where, position, strict=True))
                value = np.where(is_here, value + by, value)
            return value

        return compute

    new, baseline = (grid(sizes, {"e_out": moved(by)}) for by in (1e-6, 0.0))
    assert new["e_out"].size > 5 * SLAB_POINTS
    verdict = impact.compare(new, baseline)
    assert_same(verdict, impact.compare(new.compute(), baseline.compute()))
    # a file is read chunk by chunk, in a different order
    baseline["e_out"].encoding["chunksizes"] = (1, 2, 30, 20, 5)
    assert_same(verdict, impact.compare(new, baseline))
    (judged,) = verdict.variables
    assert (judged.points, judged.different) == (new["e_out"].size, 3)
    # the first of equal differences is named
    assert (judged.at["model"], judged.at["e"], judged.at["m2"]) == ("a", 1.0, 5.0)
    along = verdict.worst_along["m1"]["e_out"].values
    assert np.flatnonzero(along).tolist() == [0, 7, 19]
    assert difference_data(verdict).panels[0].ratios["e_out"] == pytest.approx((1000.0, 0.0, 1000.0))


def test_no_more_than_a_slab_is_read_at_once() -> None:
    sizes = {"e": 25, "v1": 40, "m1": 30, "m2": 40}
    reads = Reads()
    formulas: dict[str, Compute] = {
        "v1_post": lambda *where: 1.0 + sum(where),
        "e_out": lambda *where: 2.0 + sum(where),
        "permanent_indentation": lambda *where: 3.0 + sum(where),
        "status": lambda *where: 1 + 0 * sum(where),
    }
    new, baseline = (grid(sizes, formulas, reads) for _ in range(2))
    points = new["e_out"].size
    assert points > 3_000_000
    tracemalloc.start()
    verdict = impact.compare(new, baseline.isel(e=slice(None, None, -1)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert verdict.equal, verdict
    assert [variable.points for variable in verdict.variables] == 4 * [points]
    assert reads.largest <= SLAB_POINTS
    assert reads.total == 2 * 4 * points
    # the eight arrays have 200 MB
    assert peak < 30e6


def test_aligning_two_results_reads_no_value(wide: xr.Dataset) -> None:
    reads = Reads()
    result = as_lazy(wide, reads, names_axes=False)
    other = as_lazy(wide.assign_coords(e=wide["e"] + 1.5), reads, names_axes=False)
    for subset in (False, True):
        assert "nothing in common" in impact.compare(result, other, subset=subset).headline
        assert "nothing in common" in impact.compare(other.isel(v1=0), result, subset=subset).headline
    with pytest.raises(UsageError, match="has no coordinate m1"):
        impact.compare(result.drop_vars("m1"), result)
    assert reads.total == 0


# results of 3 x 10^12 points

LARGE = dict.fromkeys(("e", "v1", "m1", "m2"), 1000)
EVERY = ("e", "v1", "m1", "m2")


def _large(reads: Reads, e_out: Compute, **formulas: Compute) -> xr.Dataset:
    """Final velocities of a restitution that depends on e only, and a constant stiffness."""

    def v1_post(model: Any, e: Any, v1: Any, m1: Any, m2: Any) -> Any:
        mass1, mass2 = 1.0 + 2.0 * m1 / 999, 1.0 + 4.0 * m2 / 999
        speed = 1.0 + v1 / 999
        return speed - (1.0 + e_out(model, e)) * mass2 / (mass1 + mass2) * speed

    along = {"v1_post": EVERY, "e_out": ("e",), "stiffness": (), "status": ("e",), "in_domain": EVERY}
    return grid(
        LARGE,
        {
            "v1_post": v1_post,
            "e_out": lambda model, e, *others: e_out(model, e),
            "stiffness": lambda model, *others: 1e9 + model,
            "status": lambda *where: 1,
            **formulas,
        },
        reads,
        {name: dict.fromkeys("abc", dims) for name, dims in along.items()},
    )


def test_points_of_the_same_trajectory_are_read_once_and_all_counted() -> None:
    reads = Reads()
    baseline = _large(reads, lambda model, e: e / 999)
    moved = _large(reads, lambda model, e: e / 999 + 1e-6 * ((model == 1) & (e == 500)))
    assert baseline["v1_post"].size == 3 * 10**12
    same_twice = impact.compare(baseline, baseline)
    assert same_twice.equal, same_twice
    assert same_twice.headline == "equal: 4 variables, 12,000,000,000,000 values, none differs"
    verdict = impact.compare(moved, baseline)
    assert verdict.headline == "not equal: values (e_out, v1_post)"
    by_name = {variable.name: variable for variable in verdict.variables}
    for name, times in (("e_out", 1000.0), ("v1_post", 500.0)):
        assert (by_name[name].points, by_name[name].different) == (3 * 10**12, 10**9)
        assert by_name[name].ratio == pytest.approx(times)
        assert by_name[name].at == {"model": "b", "e": 500 / 999, "v1": 1.0, "m1": 1.0, "m2": 1.0}
    assert by_name["stiffness"].points == 3 * 10**12
    assert by_name["status"].different == 0
    assert reads.total < 10**5
    # in the picture: a peak along e, and a constant along the axes that were not read
    panels = difference_data(verdict).panels
    assert [panel.label.split()[0].lower() for panel in panels] == ["model", *EVERY]
    assert np.flatnonzero(panels[1].ratios["e_out"]).tolist() == [500]
    assert set(panels[4].ratios["v1_post"]) == {by_name["v1_post"].ratio}


def test_a_constant_value_is_judged_with_the_status_of_every_point() -> None:
    def result(failed: int) -> xr.Dataset:
        return _large(
            Reads(),
            lambda model, e: e / 999,
            stiffness=lambda *where: np.nan,
            status=lambda model, e, *others: np.where(e < failed, 10, 1),
        )

    # NaN is correct at the failed points only
    by_name = {variable.name: variable for variable in impact.compare(result(400), result(400)).variables}
    assert by_name["stiffness"].different == 3 * 600 * 10**9
    assert by_name["stiffness"].at["e"] == pytest.approx(400 / 999)
    assert by_name["status"].different == 0
    assert impact.compare(result(1000), result(1000)).differing == ()


def test_a_constant_value_is_judged_at_every_scale() -> None:
    baseline = _large(Reads(), lambda model, e: 0.5, v1_post=lambda *where: 1.0)
    moved = _large(Reads(), lambda model, e: 0.5, v1_post=lambda *where: 1.0 + 1.5e-9)
    for dataset in (baseline, moved):
        dataset["v1_post"].encoding[VARIES_ALONG] = dict.fromkeys("abc", ())
    (difference,) = impact.compare(moved, baseline).differing
    # tolerance 1e-9 x v0, and v0 is from 1 to 2 m/s in 1000 steps
    assert (difference.name, difference.different, difference.at["v1"]) == ("v1_post", 3 * 500 * 10**9, 1.0)


def test_a_part_of_a_large_result_is_compared_with_the_same_part_of_the_whole() -> None:
    baseline = _large(Reads(), lambda model, e: e / 999)
    moved = _large(Reads(), lambda model, e: e / 999 + 1e-6 * (model == 2))
    part = moved.isel(m2=7, v1=[3, 999], model=[2, 0])
    verdict = impact.compare(part, baseline, subset=True)
    (e_out,) = (variable for variable in verdict.variables if variable.name == "e_out")
    assert (e_out.points, e_out.different) == (2 * 1000 * 2 * 1000, 1000 * 2 * 1000)
    assert e_out.at["model"] == "c"


def test_too_many_different_points_are_refused_before_any_is_read() -> None:
    reads = Reads()
    flags = _large(reads, lambda model, e: e / 999, in_domain=lambda *where: 1)
    with pytest.raises(UsageError) as refused:
        impact.compare(flags, flags)
    assert str(refused.value) == (
        "in_domain: got 3,000,000,000,000 points to compare, expected at most 10,000,000,000; "
        "select a part of the results"
    )
    # a result without the axes along which its variable varies
    unknown = grid(LARGE, {"e_out": lambda *where: 0.5}, reads)
    with pytest.raises(UsageError, match=r"^e_out: got 3,000,000,000,000 points"):
        impact.compare(unknown, unknown)
    assert reads.total == 0
    assert impact.compare(*2 * (flags.isel(v1=[0], m1=slice(9), m2=slice(9)),)).equal


def test_a_very_long_axis_is_summarized_in_groups() -> None:
    size = 100_000
    long = grid({"e": size, "v1": 1, "m1": 1, "m2": 1}, {"e_out": lambda model, e, *others: e * 1.0})
    moved = grid(
        {"e": size, "v1": 1, "m1": 1, "m2": 1},
        {"e_out": lambda model, e, *others: e + 1e-6 * ((e == 65_537) | (e == size - 1))},
    )
    verdict = impact.compare(moved, long)
    worst = verdict.worst_along["e"]["e_out"]
    assert worst.size <= 2**14
    values = worst["e"].values[worst.values > 1.0]
    group = -(-size // 2**14)
    expected = [65_537 // group * group, (size - 1) // group * group]
    assert values == pytest.approx(np.array(expected) / (size - 1))
    assert verdict.variables[0].different == 6
