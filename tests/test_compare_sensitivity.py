"""No change of a number passes: whatever moves in a result by more than its tolerance, the verdict says so."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

import impact
from impact.contact.status import Status

from .fork_server import ForkServer

# it starts many processes or reads many files: `make test-faults` runs it
pytestmark = pytest.mark.slow

# how far each variable may be off, written again here from the text of docs/schema.md
OF_SPEED = ("v1_post", "v2_post", "v1_reference", "v2_reference", "v1_error", "v2_error")
OF_PEAK = ("peak_indentation", "permanent_indentation")
OF_ITSELF = ("peak_force", "contact_time", "stiffness", "damping_ratio")
BOUNDED = ("energy_residual", "closed_form_error")
NUMBERS = (*OF_SPEED, "e_out", "e_error", *OF_PEAK, *OF_ITSELF, "energy_loss", *BOUNDED)
FLAGS = ("status", "in_domain")
RTOL = 1e-10

THROUGH_FILES = 20  # mutations that go through stored files and the command line


@dataclass(frozen=True)
class Mutant:
    """A result in which one thing was changed: the kind of fault that it is, and the name that has to be told."""

    what: str
    result: xr.Dataset
    kind: str
    name: str


@dataclass(frozen=True, repr=False)
class Pair:
    """A mutant, and the result that it was made from."""

    original: xr.Dataset
    mutant: Mutant

    def __repr__(self) -> str:
        return f"{self.mutant.what} of {self.mutant.name}"


def _scale(result: xr.Dataset, name: str, place: tuple[int, ...]) -> float:
    """What one tolerance of a point is relative to, from its inputs and outputs alone."""
    point = result.isel(dict(zip(result[name].dims, place, strict=True)))
    v0 = abs(float(point["v1"]) - float(point["v2"]))
    if name in OF_SPEED:
        return v0
    if name == "energy_loss":
        return v0 * v0 / 2 / (1 / float(point["m1"]) + 1 / float(point["m2"]))
    if name in OF_PEAK:
        return abs(float(point["peak_indentation"]))
    return abs(float(point[name])) if name in OF_ITSELF else 1.0


def _changed(result: xr.Dataset, name: str, place: tuple[int, ...], value: float) -> xr.Dataset:
    values = result[name].values.copy()
    values[place] = value
    return result.assign({name: (result[name].dims, values, result[name].attrs)})


def _place(draw: Any, result: xr.Dataset, name: str, *, finite: bool = True) -> tuple[int, ...]:
    """A place where the variable has a number, or has none."""
    places = np.argwhere(np.isfinite(result[name].values) == finite)
    return tuple(int(one) for one in places[draw(st.integers(0, len(places) - 1))])


def _moved(draw: Any, result: xr.Dataset, tolerances: float) -> Mutant:
    """One number moved by so many tolerances of its point; a bounded one by so many beyond its bound."""
    name = draw(st.sampled_from(NUMBERS))
    place = _place(draw, result, name)
    value, sign = float(result[name].values[place]), draw(st.sampled_from((-1.0, 1.0)))
    by = tolerances * 10 * RTOL * _scale(result, name, place)
    if name in BOUNDED and tolerances > 1:
        value = sign * max(10 * RTOL, abs(value))
    if tolerances > 1:
        # where nothing is allowed, the smallest number is a difference
        by = by or math.ulp(0.0)
    return Mutant("number moved", _changed(result, name, place, value + sign * by), "values", name)


def _flag_flipped(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(FLAGS))
    place = _place(draw, result, name)
    own = int(result[name].values[place])
    other = [int(one) for one in (Status if name == "status" else (0, 1)) if one != own]
    return Mutant(f"{name} flipped", _changed(result, name, place, draw(st.sampled_from(other))), "values", name)


def _nan_moved(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(NUMBERS))
    ways = ["put"] + ["taken", "swapped"] * bool(np.isnan(result[name].values).any())
    way = draw(st.sampled_from(ways))
    number = _place(draw, result, name)
    changed = result
    if way != "put":
        nan = _place(draw, result, name, finite=False)
        value = draw(st.sampled_from([0.0, 1.0, math.inf])) if way == "taken" else result[name].values[number]
        changed = _changed(changed, name, nan, value)
    if way != "taken":
        changed = _changed(changed, name, number, math.nan)
    return Mutant(f"NaN {way}", changed, "values", name)


def _dropped(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(sorted(map(str, result.data_vars))))
    return Mutant("variable dropped", result.drop_vars(name), "missing variable", name)


def _relabelled(draw: Any, result: xr.Dataset) -> Mutant:
    """A label of an axis, or a single value, changed by a millionth; that of a model or material by a letter."""
    names = [str(name) for name in result.coords if name not in ("title", "equation", "reference", "doi", "year")]
    name = draw(st.sampled_from(names))
    one = result[name]
    place = tuple(draw(st.integers(0, size - 1)) for size in one.shape)
    values = one.values.astype(object)
    old = values[place]
    # a number that has no millionth, because it is 0 or infinite, becomes another one
    new = f"{old}x" if isinstance(old, str) else 1e-6 if not old else 1e6 if math.isinf(old) else old * (1 + 1e-6)
    values[place] = new
    given = values.astype(str if isinstance(old, str) else float)
    changed = result.assign_coords({name: (one.dims, given, one.attrs)})
    scalar = one.ndim == 0 or len(one) == 1
    axis = "m1" if name == "m2" and one.ndim else "exponent" if name == "exponent" else name
    return Mutant("label changed", changed, "physics config" if scalar else "labels", axis)


def _other_unit(draw: Any, result: xr.Dataset) -> Mutant:
    names = [str(name) for name in result.variables if "units" in result[name].attrs]
    name = draw(st.sampled_from(names))
    changed = result.copy()
    changed[name].attrs = result[name].attrs | {"units": result[name].attrs["units"] + "2"}
    return Mutant("unit changed", changed, "units", name)


def _other_material(draw: Any, result: xr.Dataset) -> Mutant:
    table = json.loads(result.attrs["materials"])
    name = draw(st.sampled_from(sorted(table)))
    field = draw(st.sampled_from(sorted(table[name])))
    old = table[name][field]
    table[name][field] = 1e6 if old is None else old * (1 + 1e-9)
    changed = result.assign_attrs(materials=json.dumps(table))
    return Mutant("property changed", changed, "physics config", f"materials.{name}.{field}")


MUTATIONS = (_flag_flipped, _nan_moved, _dropped, _relabelled, _other_unit, _other_material)


@st.composite
def mutants(draw: Any, results: tuple[xr.Dataset, ...]) -> Pair:
    """A mutant of one of the results; every second one has a number moved by 10 tolerances."""
    result = draw(st.sampled_from(results))
    if draw(st.booleans()):
        return Pair(result, _moved(draw, result, 10.0))
    return Pair(result, draw(st.sampled_from(MUTATIONS))(draw, result))


def _check_told(mutant: Mutant, told: str) -> None:
    """The first line names the kind, and the variable or input."""
    first = told.splitlines()[0]
    assert first.startswith("not equal: "), f"{mutant.what} of {mutant.name}: {told}"
    assert mutant.kind in first, f"{mutant.what} of {mutant.name}: {told}"
    assert mutant.name in first, f"{mutant.what} of {mutant.name}: {told}"


def _run(data: st.SearchStrategy[Any], examples: int, check: Any) -> None:
    """Run a check over that many new examples; a random seed each time, so that every run tries others."""

    @settings(
        max_examples=examples, deadline=None, derandomize=False, database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(data)
    def over_examples(one: Any) -> None:
        check(one)

    over_examples()


@pytest.mark.slow
def test_no_change_passes(figure6: xr.Dataset, wide: xr.Dataset) -> None:
    def check(pair: Pair) -> None:
        result, mutant = pair.original, pair.mutant
        # counted by pytest --hypothesis-show-statistics
        event(mutant.what)
        for new, baseline in ((mutant.result, result), (result, mutant.result)):
            _check_told(mutant, str(impact.compare(new, baseline)))

    _run(mutants((figure6, wide)), 200, check)


def test_half_a_tolerance_passes(figure6: xr.Dataset, wide: xr.Dataset) -> None:
    @st.composite
    def nudged(draw: Any) -> Pair:
        result = draw(st.sampled_from((figure6, wide)))
        return Pair(result, _moved(draw, result, 0.5))

    def check(pair: Pair) -> None:
        result, mutant = pair.original, pair.mutant
        for new, baseline in ((mutant.result, result), (result, mutant.result)):
            verdict = impact.compare(new, baseline)
            assert verdict.equal, verdict

    _run(nudged(), 100, check)


@pytest.mark.parametrize("name", NUMBERS)
def test_every_variable_bites_at_every_kind_of_point(wide: xr.Dataset, figure6: xr.Dataset, name: str) -> None:
    # what chance may pass over: each variable, at the first, the last and a middle point that has a number
    for result in (figure6, wide):
        places = np.argwhere(np.isfinite(result[name].values))
        for place in (tuple(map(int, places[which])) for which in (0, len(places) // 2, -1)):
            own, scale = float(result[name].values[place]), 10 * RTOL * _scale(result, name, place)
            far = max(own, 10 * RTOL) if name in BOUNDED else own
            # where nothing is allowed, the smallest number is a difference
            other = far + 10 * scale or math.ulp(0.0)
            verdict = impact.compare(_changed(result, name, place, other), result)
            assert verdict.headline == f"not equal: values ({name})"
            (found,) = verdict.differing
            assert found.different == 1
            labels = result[name].isel(dict(zip(result[name].dims, place, strict=True)))
            assert all(found.at[dim] == labels[dim].item() for dim in result[name].dims if dim in found.at)
            assert found.at.keys() >= {dim for dim in result[name].dims if "." not in dim}


@pytest.mark.slow
def test_no_change_passes_through_files(
    forked: ForkServer, figure6: xr.Dataset, wide: xr.Dataset, tmp_path: Path
) -> None:
    files = {}
    for result, name in ((figure6, "figure6.h5"), (wide, "wide.h5")):
        impact.save(result, tmp_path / name)
        files[id(result)] = tmp_path / name
        assert forked("compare", tmp_path / name, tmp_path / name).returncode == 0
    path = tmp_path / "mutant.h5"

    def check(pair: Pair) -> None:
        result, mutant = pair.original, pair.mutant
        impact.save(mutant.result, path, overwrite=True)
        for words in ((path, files[id(result)]), (files[id(result)], path)):
            done = forked("compare", *words)
            assert (done.returncode, done.stderr) == (1, ""), f"{mutant.what} of {mutant.name}: {done}"
            _check_told(mutant, done.stdout)

    _run(mutants((figure6, wide)), THROUGH_FILES, check)
