"""`impact.compare` detects every change of a number beyond its tolerance, a label, a unit or an attribute."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, event, given, settings, strategies as st

import impact
from impact.contact.status import Status

from .fork_server import ForkServer

# hundreds of random changes: `make test-faults` runs them
pytestmark = pytest.mark.slow

# the scale of each variable, repeated here from docs/schema.md
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
    """A result with one change, the kind of the difference, and the name that the verdict must contain."""

    change: str
    result: xr.Dataset
    kind: str
    name: str


@dataclass(frozen=True, repr=False)
class Pair:
    """A mutant and the original result."""

    original: xr.Dataset
    mutant: Mutant

    def __repr__(self) -> str:
        return f"{self.mutant.change} of {self.mutant.name}"


def _scale(result: xr.Dataset, name: str, position: tuple[int, ...]) -> float:
    """The scale of a tolerance at a point, computed from its inputs and outputs."""
    point = result.isel(dict(zip(result[name].dims, position, strict=True)))
    v0 = abs(float(point["v1"]) - float(point["v2"]))
    if name in OF_SPEED:
        return v0
    if name == "energy_loss":
        return v0 * v0 / 2 / (1 / float(point["m1"]) + 1 / float(point["m2"]))
    if name in OF_PEAK:
        return abs(float(point["peak_indentation"]))
    return abs(float(point[name])) if name in OF_ITSELF else 1.0


def _changed(result: xr.Dataset, name: str, position: tuple[int, ...], value: float) -> xr.Dataset:
    values = result[name].values.copy()
    values[position] = value
    return result.assign({name: (result[name].dims, values, result[name].attrs)})


def _draw_position(draw: Any, result: xr.Dataset, name: str, *, finite: bool = True) -> tuple[int, ...]:
    """Draw a position at which the variable is finite, or is not."""
    positions = np.argwhere(np.isfinite(result[name].values) == finite)
    return tuple(int(index) for index in positions[draw(st.integers(0, len(positions) - 1))])


def _moved(draw: Any, result: xr.Dataset, tolerances: float) -> Mutant:
    """One number changed by this many tolerances of its point; a residual by this many beyond its bound."""
    name = draw(st.sampled_from(NUMBERS))
    position = _draw_position(draw, result, name)
    value, sign = float(result[name].values[position]), draw(st.sampled_from((-1.0, 1.0)))
    by = tolerances * 10 * RTOL * _scale(result, name, position)
    if name in BOUNDED and tolerances > 1:
        value = sign * max(10 * RTOL, abs(value))
    if tolerances > 1:
        # at scale 0 the smallest number is a difference
        by = by or math.ulp(0.0)
    return Mutant("number moved", _changed(result, name, position, value + sign * by), "values", name)


def _flag_flipped(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(FLAGS))
    position = _draw_position(draw, result, name)
    value = int(result[name].values[position])
    other = [int(flag) for flag in (Status if name == "status" else (0, 1)) if flag != value]
    return Mutant(
        f"{name} flipped", _changed(result, name, position, draw(st.sampled_from(other))), "values", name
    )


def _nan_moved(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(NUMBERS))
    ways = ["put"] + ["taken", "swapped"] * bool(np.isnan(result[name].values).any())
    way = draw(st.sampled_from(ways))
    number = _draw_position(draw, result, name)
    changed = result
    if way != "put":
        nan = _draw_position(draw, result, name, finite=False)
        value = draw(st.sampled_from([0.0, 1.0, math.inf])) if way == "taken" else result[name].values[number]
        changed = _changed(changed, name, nan, value)
    if way != "taken":
        changed = _changed(changed, name, number, math.nan)
    return Mutant(f"NaN {way}", changed, "values", name)


def _dropped(draw: Any, result: xr.Dataset) -> Mutant:
    name = draw(st.sampled_from(sorted(map(str, result.data_vars))))
    return Mutant("variable dropped", result.drop_vars(name), "missing variable", name)


def _relabelled(draw: Any, result: xr.Dataset) -> Mutant:
    """A label of an axis or a single value, changed by a millionth; a model or a material by a letter."""
    names = [str(name) for name in result.coords if name not in ("title", "equation", "reference", "doi", "year")]
    name = draw(st.sampled_from(names))
    coordinate = result[name]
    position = tuple(draw(st.integers(0, size - 1)) for size in coordinate.shape)
    values = coordinate.values.astype(object)
    old = values[position]
    # 0 and infinity are replaced by another number
    new = f"{old}x" if isinstance(old, str) else 1e-6 if not old else 1e6 if math.isinf(old) else old * (1 + 1e-6)
    values[position] = new
    labels = values.astype(str if isinstance(old, str) else float)
    changed = result.assign_coords({name: (coordinate.dims, labels, coordinate.attrs)})
    scalar = coordinate.ndim == 0 or len(coordinate) == 1
    axis = "m1" if name == "m2" and coordinate.ndim else "exponent" if name == "exponent" else name
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
    """A mutant of one of the results; in half of them a number is changed by 10 tolerances."""
    result = draw(st.sampled_from(results))
    if draw(st.booleans()):
        return Pair(result, _moved(draw, result, 10.0))
    return Pair(result, draw(st.sampled_from(MUTATIONS))(draw, result))


def _check_message(mutant: Mutant, printed: str) -> None:
    """Check that the first line has the kind of the difference, and the variable or input."""
    first = printed.splitlines()[0]
    assert first.startswith("not equal: "), f"{mutant.change} of {mutant.name}: {printed}"
    assert mutant.kind in first, f"{mutant.change} of {mutant.name}: {printed}"
    assert mutant.name in first, f"{mutant.change} of {mutant.name}: {printed}"


def _run(data: st.SearchStrategy[Any], examples: int, check: Any) -> None:
    """Run a check over this many examples, with a new random seed in each run."""

    @settings(
        max_examples=examples,
        deadline=None,
        derandomize=False,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(data)
    def over_examples(pair: Any) -> None:
        check(pair)

    over_examples()


def test_every_change_is_detected(figure6: xr.Dataset, wide: xr.Dataset) -> None:
    def check(pair: Pair) -> None:
        result, mutant = pair.original, pair.mutant
        # counted by pytest --hypothesis-show-statistics
        event(mutant.change)
        for new, baseline in ((mutant.result, result), (result, mutant.result)):
            _check_message(mutant, str(impact.compare(new, baseline)))

    _run(mutants((figure6, wide)), 200, check)


def test_a_change_by_half_a_tolerance_is_equal(figure6: xr.Dataset, wide: xr.Dataset) -> None:
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
def test_a_change_of_each_variable_is_detected_at_the_first_the_last_and_a_middle_point(
    wide: xr.Dataset, figure6: xr.Dataset, name: str
) -> None:
    # random positions may miss these
    for result in (figure6, wide):
        positions = np.argwhere(np.isfinite(result[name].values))
        for position in (tuple(map(int, positions[index])) for index in (0, len(positions) // 2, -1)):
            value, scale = float(result[name].values[position]), 10 * RTOL * _scale(result, name, position)
            far = max(value, 10 * RTOL) if name in BOUNDED else value
            # at scale 0 the smallest number is a difference
            other = far + 10 * scale or math.ulp(0.0)
            verdict = impact.compare(_changed(result, name, position, other), result)
            assert verdict.headline == f"not equal: values ({name})"
            (difference,) = verdict.differing
            assert difference.different == 1
            labels = result[name].isel(dict(zip(result[name].dims, position, strict=True)))
            assert all(
                difference.at[dim] == labels[dim].item() for dim in result[name].dims if dim in difference.at
            )
            assert difference.at.keys() >= {dim for dim in result[name].dims if "." not in dim}


def test_every_change_is_detected_in_files(
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
            assert (done.returncode, done.stderr) == (1, ""), f"{mutant.change} of {mutant.name}: {done}"
            _check_message(mutant, done.stdout)

    _run(mutants((figure6, wide)), THROUGH_FILES, check)
