"""`impact.compare` finds two results equal exactly if they are, and otherwise names each difference."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.comparison.verdict import Verdict, as_markdown
from impact.contact.variables import CENTRAL_OUTPUTS, OUTPUTS, default_variables
from impact.errors import ResultError, UsageError
from impact.results.selection import match_labels

from .conftest import ROOT
from .fork_server import ForkServer

BY_DEFAULT = default_variables(of_friction=False)
GEOMETRIC = {
    "models": ["hertz", "lankarani-nikravesh-1990"],
    "sweep": {"e": [0.5, 1.0], "v1": {"geomspace": [0.1, 10.0, 7]}, "m1": 1.0, "m2": 1.0, "K": 6e9},
    "solver": {"rtol": 1e-4},
}
# v0 = 3 m/s, m = 0.75 kg, m v0^2/2 = 3.375 J
BY_HAND = {
    "models": ["hertz"],
    "sweep": {"e": [0.5, 1.0], "v1": 2.0, "v2": -1.0, "m1": 1.0, "m2": 3.0, "K": 6e9},
    "output": {"variables": [*CENTRAL_OUTPUTS]},
    "solver": {"rtol": 1e-4},
}
GAMMA = "ismail-stronge-2008.gamma"


@pytest.fixture(scope="module")
def geometric() -> xr.Dataset:
    return impact.sweep(GEOMETRIC)


@pytest.fixture(scope="module")
def two_points() -> xr.Dataset:
    """A result of two points with all variables."""
    result = impact.sweep(BY_HAND)
    result["in_domain"][:] = 1
    return result


@pytest.fixture
def by_hand(two_points: xr.Dataset) -> xr.Dataset:
    """A copy of it, whose values the test sets."""
    return two_points.copy(deep=True)


def _with(dataset: xr.Dataset, name: str, value: float, **at: int) -> xr.Dataset:
    """A copy with a different value at one position."""
    copy = dataset.copy(deep=True)
    copy[name][at or dict.fromkeys(copy[name].dims, 0)] = value
    return copy


def _relabelled(dataset: xr.Dataset, name: str, values: Any) -> xr.Dataset:
    """A copy with other values of a coordinate."""
    coordinate = dataset[name]
    values = np.asarray(values, coordinate.dtype).reshape(coordinate.shape)
    return dataset.assign_coords({name: (coordinate.dims, values, coordinate.attrs)})


def _around(dataset: xr.Dataset, name: str) -> xr.Dataset:
    """One variable, its scale, what the scale might affect, and the status."""
    return dataset[[*dict.fromkeys((name, "peak_indentation", "permanent_indentation", "status"))]]


def _faults(verdict: Verdict) -> list[tuple[str, str]]:
    assert not verdict.equal, verdict
    assert str(verdict).startswith(verdict.headline)
    return [(fault.kind, fault.name) for fault in verdict.faults]


# equal results


def test_a_result_is_equal_to_itself(figure6: xr.Dataset, wide: xr.Dataset, stored: Path) -> None:
    for result in (figure6, wide):
        verdict = impact.compare(result, result)
        assert verdict.equal, verdict
        assert verdict.headline.endswith("none differs")
        assert (verdict.faults, verdict.notes, verdict.lines) == ((), (), ())
        assert tuple(judged.name for judged in verdict.variables) == BY_DEFAULT
    assert impact.compare(stored, str(stored)).equal
    assert impact.compare(figure6, stored).equal


@pytest.mark.parametrize("axis", ["model", "e", "v1", "m1", "material2", GAMMA])
def test_the_order_of_labels_does_not_matter(wide: xr.Dataset, axis: str) -> None:
    backwards = wide.isel({axis: slice(None, None, -1)})
    assert any((backwards[name].values != wide[name].values).any() for name in ("v1_post", "contact_time"))
    for new, baseline in ((backwards, wide), (wide, backwards)):
        verdict = impact.compare(new, baseline)
        assert verdict.equal, verdict
        assert verdict.headline.endswith("none differs")


def test_equal_labels_have_their_positions_in_both_results_in_the_order_of_the_baseline() -> None:
    # a rotation: its positions are not those of its inverse
    new, baseline = np.array(["c", "a", "b", "x"]), np.array(["b", "y", "c", "a"])
    of_new, of_baseline = match_labels([new], [baseline])
    assert (of_new.tolist(), of_baseline.tolist()) == ([2, 0, 1], [0, 2, 3])
    # a number is no text
    for pair in (([1.0, 2.0], ["soft", "hard"]), (["soft", "hard"], [1.0, 2.0])):
        none = match_labels(*([np.array(labels)] for labels in pair))
        assert [positions.tolist() for positions in none] == [[], []]


def test_the_order_of_dimensions_does_not_matter(wide: xr.Dataset) -> None:
    turned = wide.transpose(*reversed(list(wide.dims)))
    turned["e_out"] = turned["e_out"].transpose("m1", "model", ...)
    for new, baseline in ((turned, wide), (wide, turned)):
        assert impact.compare(new, baseline).equal
    # each value is compared with the value at the same labels: a different one is found at its labels
    position = {"model": 2, "e": 1, "v1": 0, "m1": 1, "material2": 1, GAMMA: 0}
    moved = _with(wide, "e_out", 0.123, **position)
    difference = next(iter(impact.compare(turned, moved).differing))
    labels = {"model": "bilinear", "e": 0.6, "v1": 1.0, "m1": 3.0, "m2": math.inf, "material2": "hard"}
    assert difference.at == labels
    assert (difference.different, difference.baseline) == (1, 0.123)


def test_labels_may_differ_by_rounding_only(geometric: xr.Dataset) -> None:
    values = geometric["v1"].values
    rounded = _relabelled(geometric, "v1", values * (1 + 2.3e-16))
    assert (rounded["v1"].values != values).any()
    assert impact.compare(rounded, geometric).equal
    assert impact.compare(geometric, rounded).equal
    other = _relabelled(geometric, "v1", np.r_[values[0] * (1 + 1e-9), values[1:]])
    for new, baseline in ((other, geometric), (geometric, other)):
        verdict = impact.compare(new, baseline)
        assert _faults(verdict) == [("labels", "v1")]
        assert verdict.headline == "not equal: labels (v1)"
        assert "1 of 7 in NEW only" in str(verdict)
        assert "1 of 7 in BASELINE only" in str(verdict)
    far = _relabelled(geometric, "v1", 2 * values[-1] + values)
    assert _faults(impact.compare(far, geometric)) == [("nothing in common", "v1")]


def test_labels_that_differ_by_rounding_within_a_file_are_distinct() -> None:
    near = math.nextafter(1.0, 2.0)
    two = impact.sweep(
        GEOMETRIC
        | {"models": "lankarani-nikravesh-1990", "sweep": GEOMETRIC["sweep"] | {"e": 0.5, "v1": [1.0, near]}}
    )
    assert impact.compare(two, two).equal
    moved = _with(two, "e_out", 0.7, model=0, v1=1)
    (difference,) = impact.compare(moved, two).differing
    assert (difference.at["v1"], difference.different) == (near, 1)
    swapped = two.isel(v1=[1, 0])
    assert impact.compare(swapped, two).equal
    assert impact.compare(moved.isel(v1=[1, 0]), two).differing[0].at["v1"] == near
    assert _faults(impact.compare(two.isel(v1=[1]), two)) == [("labels", "v1")]


def test_a_zip_group_is_matched_by_all_its_columns(wide: xr.Dataset) -> None:
    other = _relabelled(wide, "m2", [1.0, 7.0])
    verdict = impact.compare(other, wide)
    assert _faults(verdict) == [("labels", "m1")]
    assert "1 of 2 in NEW only: 3 with m2=7; 1 of 2 in BASELINE only: 3 with m2=inf" in str(verdict)
    assert {variable.points for variable in verdict.variables} == {3 * 2 * 1 * 2 * 2, 4 * 3 * 2 * 1 * 2 * 2}
    crossed = _relabelled(wide, "m2", [math.inf, 1.0])
    assert _faults(impact.compare(crossed, wide)) == [("nothing in common", "m1")]
    # a zip group against single values: the common point is compared
    unzipped = wide.isel(m1=[0]).drop_vars("m2").assign_coords(m2=((), 1.0, wide["m2"].attrs))
    assert _faults(impact.compare(unzipped, wide)) == [("labels", "m1")]
    assert impact.compare(unzipped, wide, subset=True).equal


@pytest.mark.slow
def test_an_axis_of_length_one_equals_a_single_value(wide: xr.Dataset) -> None:
    for name, index in (("v1", 1), ("material2", 0), ("m1", 1), ("e", 2), ("model", 3)):
        axis, single = wide.isel({name: [index]}), wide.isel({name: index})
        for new, baseline in ((axis, single), (single, axis)):
            verdict = impact.compare(new, baseline)
            assert verdict.equal, verdict
        # without subset, labels of only one result are a difference
        verdict = impact.compare(single, wide)
        assert _faults(verdict) == [("labels", name)]
        assert {variable.different for variable in verdict.variables} == {0}
        assert impact.compare(single, wide, subset=True).equal
        verdict = impact.compare(single, wide.isel({name: [index - 1]}))
        assert ("nothing in common", name) in _faults(verdict)


def test_a_single_selected_model_is_still_a_label(figure6: xr.Dataset) -> None:
    single_models = [figure6.isel(model=index) for index in range(3)]
    assert impact.compare(single_models[1], single_models[1]).equal
    assert impact.compare(single_models[1], figure6, subset=True).equal
    same = single_models[1].assign_coords(model=single_models[2]["model"])
    assert _faults(impact.compare(same, single_models[1])) == [("nothing in common", "model")]
    # its NaNs are judged by its status
    verdict = impact.compare(_with(single_models[0], "status", 10, e=5), single_models[0])
    assert verdict.differing[0].name == "status"
    assert "damping_ratio" in [variable.name for variable in verdict.differing]
    assert verdict.differing[0].at == {"model": "lankarani-nikravesh-1994", "e": 0.05}


# kinds of differences


def test_a_different_scalar_input_is_a_difference_of_the_physics_config(figure6: xr.Dataset) -> None:
    for name, value, message in (
        ("v1", 1.5, "v1 is 1.5, in BASELINE 1"),
        ("m2", math.inf, "m2 is inf, in BASELINE 1"),
        ("v2", 1e-9, "v2 is 1e-09, in BASELINE 0"),
        ("n", 1.5 + 1e-9, "n is 1.500000001, in BASELINE 1.5"),
    ):
        verdict = impact.compare(_relabelled(figure6, name, value), figure6)
        assert ("physics config", name) in _faults(verdict)
        assert verdict.headline.startswith(f"not equal: physics config ({name})")
        assert f"\nphysics config: {message}\n" in f"{verdict}\n"
    other = figure6.assign_coords(material=((), "steel", figure6["material"].attrs))
    assert _faults(impact.compare(other, figure6)) == [("physics config", "material")]
    rounded = _relabelled(figure6, "m1", math.nextafter(1.0, 2.0))
    assert impact.compare(rounded, figure6).equal


def test_a_different_material_property_is_a_difference_of_the_physics_config(wide: xr.Dataset) -> None:
    table = json.loads(wide.attrs["materials"])
    for field, value in (("E", 2.1e9), ("nu", 0.41), ("rho", 1001.0), ("yield_strength", 3e8)):
        changed = table | {"soft": table["soft"] | {field: value}}
        verdict = impact.compare(wide.assign_attrs(materials=json.dumps(changed)), wide)
        assert _faults(verdict) == [("physics config", f"materials.soft.{field}")]
        before = table["soft"][field]
        shown = before if before is None else f"{before:.12g}"
        assert f"materials.soft.{field} is {value:.12g}, in BASELINE {shown}" in str(verdict)
    # a material that no label uses does not matter
    more = wide.assign_attrs(materials=json.dumps(table | {"unused": table["soft"]}))
    assert impact.compare(more, wide).equal


def test_an_input_on_one_side_only_is_a_difference(figure6: xr.Dataset) -> None:
    with_radius = figure6.assign_coords(R1=((), 0.05, {"units": "m"}))
    for new, baseline, side in ((with_radius, figure6, "NEW"), (figure6, with_radius, "BASELINE")):
        verdict = impact.compare(new, baseline)
        assert _faults(verdict) == [("physics config", "R1")]
        assert f"R1 is given in {side} only" in str(verdict)
        assert not impact.compare(new, baseline, subset=True).equal


def test_an_e_computed_from_alpha_does_not_match_an_axis_e(by_hand: xr.Dataset) -> None:
    sweep = {name: value for name, value in BY_HAND["sweep"].items() if name != "e"}
    alpha = impact.sweep(BY_HAND | {"sweep": sweep | {"alpha": [0.5 / 3.0, 0.0]}})
    np.testing.assert_allclose(alpha["e"], by_hand["e"], rtol=1e-15)
    for new, baseline in ((alpha, by_hand), (by_hand, alpha)):
        verdict = impact.compare(new, baseline)
        assert ("nothing in common", "e") in _faults(verdict)
        assert ("physics config", "alpha") in _faults(verdict)
    other = alpha.assign_coords(e=("alpha", [0.5, 0.9], alpha["e"].attrs))
    assert _faults(impact.compare(other, alpha)) == [("labels", "e")]


def test_different_units_are_a_difference(figure6: xr.Dataset) -> None:
    for name in ("peak_force", "e", "m2", "status"):
        other = figure6.copy(deep=True)
        other[name].attrs["units"] = "kN"
        for new, baseline in ((other, figure6), (figure6, other)):
            verdict = impact.compare(new, baseline)
            assert _faults(verdict) == [("units", name)]
            assert verdict.headline == f"not equal: units ({name})"
    bare = figure6.copy(deep=True)
    del bare["e_out"].attrs["units"]
    assert "e_out is in None, in BASELINE in 1" in str(impact.compare(bare, figure6))


@pytest.mark.parametrize("name", BY_DEFAULT)
def test_a_missing_variable_is_a_difference_and_with_subset_a_note(figure6: xr.Dataset, name: str) -> None:
    both = figure6[["status", name] if name != "status" else ["status", "e_out"]]
    without = both.drop_vars(name)
    for new, baseline, side in ((without, both, "BASELINE"), (both, without, "NEW")):
        verdict = impact.compare(new, baseline)
        assert _faults(verdict) == [("missing variable", name)]
        assert verdict.headline == f"not equal: missing variable ({name})"
        assert f"{name} is in {side} only" in str(verdict)
        verdict = impact.compare(new, baseline, subset=True)
        assert verdict.equal
        assert verdict.notes == (f"{name} is in {side} only",)


def test_a_variable_outside_the_schema_is_noted_and_not_judged(figure6: xr.Dataset) -> None:
    more = figure6.assign(twice=("k", [1.0, 2.0])).assign_coords(note=("e", np.arange(101.0)))
    verdict = impact.compare(more, figure6)
    assert verdict.equal
    assert verdict.notes == ("not judged: note, twice",)
    moved = _with(more, "e_out", 0.123, model=1, e=5)
    assert impact.compare(moved, more).differing[0].at == {"model": "lankarani-nikravesh-1990", "e": 0.05}


def test_results_without_common_labels_or_variables_are_not_equal(
    figure6: xr.Dataset, wide: xr.Dataset, geometric: xr.Dataset
) -> None:
    for new, baseline in (
        (figure6.isel(e=slice(50)), figure6.isel(e=slice(50, None))),
        (figure6, wide),
        (geometric.isel(v1=slice(3)), figure6),
        (figure6.sel(model=["gharib-hurmuzlu-2012"]), geometric),
    ):
        for subset in (False, True):
            for verdict in (
                impact.compare(new, baseline, subset=subset),
                impact.compare(baseline, new, subset=subset),
            ):
                assert ("nothing in common") in {kind for kind, _ in _faults(verdict)}
                assert verdict.headline.startswith("not equal: nothing in common (")
                assert verdict.variables == ()
    coordinates_only = figure6.drop_vars(list(figure6.data_vars))
    assert _faults(impact.compare(coordinates_only, coordinates_only)) == [("nothing in common", "")]
    assert _faults(impact.compare(figure6[["e_out"]], figure6[["contact_time"]], subset=True)) == [
        ("nothing in common", "")
    ]


# the common part of two results


def test_subset_judges_the_common_points(figure6: xr.Dataset) -> None:
    new, baseline = figure6.isel(e=slice(0, 60), model=[0, 1]), figure6.isel(e=slice(40, None), model=[2, 1])
    assert _faults(impact.compare(new, baseline)) == [("labels", "model"), ("labels", "e")]
    verdict = impact.compare(new, baseline, subset=True)
    assert verdict.equal, verdict
    assert {variable.points for variable in verdict.variables} == {20}
    inside, outside = (_with(new, "e_out", 0.123, model=1, e=index) for index in (50, 10))
    assert impact.compare(outside, baseline, subset=True).equal
    verdict = impact.compare(inside, baseline, subset=True)
    assert verdict.headline == "not equal: values (e_out)"
    assert verdict.differing[0].at == {"model": "lankarani-nikravesh-1990", "e": 0.5}


def test_with_subset_a_single_value_is_matched_with_a_label_of_an_axis(wide: xr.Dataset) -> None:
    single = wide.isel(v1=1, material2=0)
    assert single["v1"].ndim == 0
    for new, baseline in ((single, wide), (wide, single)):
        verdict = impact.compare(new, baseline, subset=True)
        assert verdict.equal, verdict
        assert verdict.variables[0].points == wide["v1_post"].size / 4
    moved = _with(single, "v1_post", 9.0)
    (difference,) = impact.compare(moved, wide, subset=True).differing
    assert (difference.at["v1"], difference.at["material2"]) == (2.0, "soft")
    # a value that is not on the axis leaves no common point
    elsewhere = _relabelled(single, "v1", 7.0)
    assert ("nothing in common", "v1") in _faults(impact.compare(elsewhere, wide, subset=True))
    assert ("nothing in common", "v1") in _faults(impact.compare(elsewhere, single, subset=True))


def test_with_subset_a_parameter_axis_of_a_model_outside_the_subset_is_ignored(wide: xr.Dataset) -> None:
    other = wide.sel(model=["bilinear", "hertz"]).isel({GAMMA: 0}).drop_vars(GAMMA)
    for new, baseline in ((other, wide), (wide, other)):
        assert _faults(impact.compare(new, baseline)) == [("labels", "model")]
        verdict = impact.compare(new, baseline, subset=True)
        assert verdict.equal, verdict
        assert verdict.variables[0].points == 2 * 3 * 2 * 2 * 2
    # a part of a result keeps the parameters of the models that it lacks
    for part in (wide.sel(model=["bilinear", "hertz"]), wide.sel(model=["hertz"]).isel({GAMMA: 0})):
        for new, baseline in ((part, wide), (wide, part)):
            verdict = impact.compare(new, baseline, subset=True)
            assert verdict.equal, verdict
    moved = _with(other, "e_out", 9.0)
    assert impact.compare(moved, wide, subset=True).headline == "not equal: values (e_out)"
    both = wide.drop_vars(GAMMA).isel({GAMMA: 0})
    assert ("physics config", GAMMA) in _faults(impact.compare(both, wide.isel({GAMMA: 0}), subset=True))


def test_an_axis_that_a_model_outside_the_subset_shares_is_compared_at_all_points() -> None:
    law, mass = {"kelvin-voigt": {"C": [1.0, 2.0, 3.0]}}, {"m1": [1.0, 2.0, 3.0]}
    sweep = {"e": 0.5, "v1": 1.0, "m2": 2.0, "R1": 0.1, "R2": 0.1, "material": "steel"} | mass
    zipped = sweep | {"zip": [["model.kelvin-voigt.C", "m1"]]}
    both = impact.sweep({"models": ["kelvin-voigt", "hunt-crossley-1975"], "sweep": zipped, "model": law})
    alone = impact.sweep({"models": "hunt-crossley-1975", "sweep": sweep})
    for other in (alone, both.sel(model=["hunt-crossley-1975"])):
        for new, baseline in ((other, both), (both, other)):
            verdict = impact.compare(new, baseline, subset=True)
            assert verdict.equal, verdict
            assert verdict.variables[0].points == 3
        changed = _with(other, "e_out", 9.0, **{str(dim): -1 for dim in other["e_out"].dims})
        (difference,) = impact.compare(changed, both, subset=True).differing
        assert difference.at["m1"] == 3.0


# values and their tolerances, computed by hand

SCALES = {
    "v1_post": 3.0, "v2_post": 3.0, "v1_reference": 3.0, "v2_reference": 3.0, "v1_error": 3.0, "v2_error": 3.0,
    "e_out": 1.0, "e_error": 1.0, "peak_indentation": 0.004, "permanent_indentation": 0.004,
    "peak_force": 500.0, "contact_time": 2e-4, "energy_loss": 3.375, "stiffness": 6e9, "damping_ratio": 0.75,
    "energy_residual": 1.0, "closed_form_error": 1.0, "e_kinetic": 1.0, "e_energetic": 1.0, "lambda": 4.5e9,
    "separation_time": 2e-4,
}  # fmt: skip
# variables whose scale is their value
RELATIVE = {"peak_indentation", "peak_force", "contact_time", "stiffness", "damping_ratio", "lambda"}
RELATIVE |= {"separation_time"}


def test_the_scales_of_this_file_cover_every_variable_with_a_tolerance() -> None:
    assert {name for name in CENTRAL_OUTPUTS if OUTPUTS[name].has_tolerance} == SCALES.keys()


@pytest.mark.parametrize("name", SCALES)
def test_just_below_the_tolerance_is_equal_and_just_above_is_not(by_hand: xr.Dataset, name: str) -> None:
    tol, scale = 1e-4, SCALES[name]
    by_hand = _around(by_hand, name)
    by_hand["peak_indentation"][:] = 0.004
    bounded = name in ("energy_residual", "closed_form_error")
    value = scale if name in RELATIVE else 0.0 if bounded else 0.25
    by_hand[name][..., 0] = value
    # the second point has another scale, which must not matter
    by_hand[name][..., 1] = 1e3 * value
    position = {"e": 0} if by_hand[name].ndim == 1 else {"model": 0, "e": 0}
    for sign in (1, -1):
        below, above = (
            _with(by_hand, name, value + sign * part * tol * scale, **position) for part in (0.999, 1.001)
        )
        equal, different = impact.compare(below, by_hand, tol=tol), impact.compare(above, by_hand, tol=tol)
        assert equal.equal, equal
        assert f"largest difference 1 x tolerance: {name} at " in equal.headline
        (difference,) = different.differing
        assert (difference.name, difference.tolerance, difference.at["e"]) == (name, tol, 0.5)
        assert (difference.different, difference.points) == (1, by_hand[name].size)
        assert difference.ratio == difference.times == pytest.approx(1.001, rel=1e-6)
        assert difference.worst == pytest.approx(1.001 * tol * scale, rel=1e-6)
        assert different.headline == f"not equal: values ({name})"
        # at tolerance 0 the next number is a difference
        tiny = _with(by_hand, name, np.nextafter(value, math.inf), **position)
        assert impact.compare(tiny, by_hand, tol=0.0).headline == f"not equal: values ({name})"
    assert impact.compare(by_hand, by_hand, tol=0.0).equal
    assert "where none is allowed" in str(impact.compare(tiny, by_hand, tol=0.0))


def test_each_point_has_its_scale() -> None:
    fast = impact.sweep(
        {
            "models": "hertz",
            "solver": {"rtol": 1e-4},
            "sweep": BY_HAND["sweep"] | {"v1": [0.0, 9.0], "e": 1.0, "m2": [1.0, 3.0]},
        }
    )
    tol = 1e-6
    for index, speed, mass in ((0, 1.0, 0.5), (1, 10.0, 0.75)):
        for name, scale in (("v1_post", speed), ("energy_loss", mass * speed**2 / 2)):
            position = {"model": 0, "v1": index, "m2": index}
            value = float(fast[name][position])
            for part, equal in ((0.999, True), (1.001, False)):
                changed = _with(fast, name, value + part * tol * scale, **position)
                assert impact.compare(changed, fast, tol=tol).equal == equal


def test_the_scales_of_spins_and_of_friction_have_the_approach_with_the_slip() -> None:
    radii = {"R1": 0.03, "R2": 0.04}
    inputs = {"v1": 2.0, "v2": -1.0, "u1": 4.0, "m1": 1.0, "m2": 3.0, "K": 1e6, "mu": 0.3} | radii
    swept = impact.sweep({"models": "hertz", "frictions": "coulomb-1785", "sweep": inputs})
    scales = {f"omega{ball}_post": (3.0 + 4.0) / R for ball, R in enumerate(radii.values(), 1)}
    # m (v0^2 + g0^2)/2 with m = m1 m2/(m1 + m2)
    scales["friction_loss"] = 0.75 * (3.0**2 + 4.0**2) / 2.0
    for name, scale in scales.items():
        for part, equal in ((0.999, True), (1.001, False)):
            changed = _with(swept, name, swept[name].item() + part * 1e-6 * scale)
            assert impact.compare(changed, swept, tol=1e-6).equal == equal


def test_impacts_without_slip_have_no_tangential_restitution_and_are_equal() -> None:
    inputs = {"v1": 2.0, "u1": 0.0, "m1": 1.0, "m2": 3.0, "R1": 0.03, "R2": 0.04, "K": 1e6, "mu": 0.3}
    frictions = ["coulomb-1785", "cundall-strack-1979"]
    output = {"variables": list(OUTPUTS)}
    table = {"cundall-strack-1979": {"k_t": 3e3}}
    swept = impact.sweep(
        {"models": "hertz", "frictions": frictions, "sweep": inputs, "friction": table, "output": output}
    )
    assert np.isnan(swept["beta"].values).all()
    assert (swept["friction_status"].values == 1).all()
    assert impact.compare(swept, swept, tol=0.0).equal
    # what has no value in both is not a second difference beside that of the statuses
    slow = swept.assign(friction_status=xr.full_like(swept["friction_status"], 4))
    verdict = impact.compare(slow, swept)
    assert verdict.headline == "not equal: values (friction_status)"
    assert verdict.differing[0].text.endswith(": slow_limit, baseline ok")
    slides = swept.assign(contact_regime=xr.full_like(swept["contact_regime"], 2))
    verdict = impact.compare(slides, swept)
    assert verdict.differing[0].text.endswith(": slides_throughout, baseline sticks_throughout")
    assert as_markdown(verdict).count("| slides_throughout | sticks_throughout |") == 1


def test_statuses_of_calibrations_and_boards_are_named() -> None:
    fits = impact.calibrate(ROOT / "docs" / "calibrate" / "drops.toml", overrides={"models": ["kelvin-voigt"]})
    board = impact.load(ROOT / "docs" / "conform" / "board.h5").isel(check=slice(3))
    for result, name, end in (
        (fits, "fit_status", "not_converged, baseline ok"),
        (board, "check_status", "not_supported, baseline pass"),
    ):
        baseline = result.assign({name: xr.zeros_like(result[name])})
        changed = result.assign({name: xr.full_like(result[name], 2)})
        (difference,) = impact.compare(changed, baseline).differing
        assert difference.text.endswith(f": {end}")


def test_a_friction_law_of_one_result_is_no_difference_of_the_laws_in_both() -> None:
    inputs = {"v1": 2.0, "u1": 1.0, "m1": 1.0, "m2": 3.0, "K": 1e6, "mu": 0.3}
    both = {"models": "hertz", "frictions": ["coulomb-1785", "cundall-strack-1979"], "sweep": inputs}
    more = impact.sweep({**both, "friction": {"cundall-strack-1979": {"k_t": 3e3}}})
    fewer = impact.sweep({**both, "frictions": "coulomb-1785"})
    assert impact.compare(more, fewer, subset=True).equal
    assert impact.compare(more, fewer).headline == "not equal: labels (friction)"


def test_residuals_are_judged_by_their_bound(by_hand: xr.Dataset) -> None:
    for name in ("energy_residual", "closed_form_error"):
        # both below the bound, on either side of zero
        a, b = _with(by_hand, name, 0.9e-6), _with(by_hand, name, -0.9e-6)
        assert impact.compare(a, b, tol=1e-6).equal
        assert impact.compare(b, a, tol=1e-6).equal
        # one residual above the bound is a difference, two close ones are not
        above = _with(by_hand, name, -1.1e-6)
        assert not impact.compare(a, above, tol=1e-6).equal
        assert not impact.compare(above, a, tol=1e-6).equal
        assert impact.compare(_with(by_hand, name, -1.5e-6), above, tol=1e-6).equal
        assert not impact.compare(_with(by_hand, name, -2.2e-6), above, tol=1e-6).equal


def test_flags_are_compared_exactly_and_steps_are_reported_only(by_hand: xr.Dataset) -> None:
    flipped = _with(by_hand, "in_domain", 0)
    verdict = impact.compare(flipped, by_hand, tol=1e6)
    assert verdict.headline == "not equal: values (in_domain)"
    assert verdict.lines == (
        "in_domain: 1 of 2 differ, the first at model=hertz, e=0.5: outside_claimed_domain, "
        "baseline within_claimed_domain",
    )
    flipped["in_domain"][0, 1] = 0
    assert flipped["in_domain"].values.tolist() == [[0, 0]]
    assert "in_domain: 2 of 2 differ, the first at model=hertz, e=0.5" in str(impact.compare(flipped, by_hand))
    more = _with(by_hand, "steps", 10_000)
    verdict = impact.compare(more, by_hand)
    assert verdict.equal
    (steps,) = (variable for variable in verdict.variables if variable.name == "steps")
    assert (steps.different, steps.is_equal, steps.at) == (1, True, {"model": "hertz", "e": 0.5})
    assert "steps: 1 of 2 differ, by 9" in steps.text
    assert steps.text.endswith("at model=hertz, e=0.5 (not judged)")


def test_of_several_different_flags_the_first_is_named(figure6: xr.Dataset) -> None:
    two = _with(_with(figure6, "status", 2, model=1, e=5), "status", 16, model=1, e=7)
    verdict = impact.compare(two, figure6)
    assert verdict.headline.startswith("not equal: values (status")
    assert verdict.lines[0] == (
        "status: 2 of 303 differ, the first at model=lankarani-nikravesh-1990, e=0.05: no_impact, baseline ok"
    )


@pytest.mark.parametrize("name", SCALES)
def test_infinity_equals_only_itself(by_hand: xr.Dataset, name: str) -> None:
    infinite, finite, negative = (
        _with(_around(by_hand, name), name, value) for value in (math.inf, 1.0, -math.inf)
    )
    assert impact.compare(infinite, infinite).equal
    for new, baseline in ((infinite, finite), (finite, infinite), (infinite, negative), (negative, infinite)):
        verdict = impact.compare(new, baseline, tol=1e300)
        assert name in [variable.name for variable in verdict.differing]


def test_an_infinite_scale_allows_no_difference(by_hand: xr.Dataset) -> None:
    walls = _relabelled(_relabelled(by_hand, "m1", math.inf), "m2", math.inf)
    walls["energy_loss"][:] = 1.0
    verdict = impact.compare(_with(walls, "energy_loss", 2.0), walls)
    assert verdict.headline == "not equal: values (energy_loss)"
    infinite = _with(by_hand, "peak_indentation", math.inf)
    assert not impact.compare(_with(infinite, "permanent_indentation", 0.1), infinite).equal


def test_a_nan_in_one_result_is_a_difference(figure6: xr.Dataset) -> None:
    for name in SCALES.keys() & BY_DEFAULT:
        position = {"e": 50} if figure6[name].ndim == 1 else {"model": 1, "e": 50}
        absent = _with(figure6, name, math.nan, **position)
        for new, baseline in ((absent, figure6), (figure6, absent)):
            verdict = impact.compare(new, baseline, tol=1e300)
            (difference,) = verdict.differing
            assert (difference.name, difference.different, difference.at["e"]) == (name, 1, 0.5)
            assert difference.ratio == math.inf
    sentence = (
        "damping_ratio: 1 of 303 differ, the worst at model=lankarani-nikravesh-1990, e=0.5: NaN, baseline 0.5625"
    )
    absent = _with(figure6, "damping_ratio", math.nan, model=1, e=50)
    assert sentence in str(impact.compare(absent, figure6))
    # a NaN is worse than any number
    both = _with(absent, "damping_ratio", 1e9, model=1, e=20)
    (difference,) = impact.compare(both, figure6).differing
    assert (difference.different, difference.at["e"]) == (2, 0.5)


def test_nans_in_both_results_are_equal_if_the_statuses_are(figure6: xr.Dataset) -> None:
    def failed(status: int) -> xr.Dataset:
        result = _with(figure6, "status", status, model=1, e=50)
        for name in SCALES.keys() & BY_DEFAULT:
            if result[name].ndim == 2:
                result[name][1, 50] = math.nan
        return result

    assert impact.compare(failed(10), failed(10)).equal
    verdict = impact.compare(failed(10), failed(11))
    names = [variable.name for variable in verdict.differing]
    assert names[0] == "status"
    assert set(names) == {"status", *(name for name in SCALES.keys() & BY_DEFAULT if figure6[name].ndim == 2)}
    assert "NaN, baseline NaN, which their statuses do not explain" in str(verdict)
    assert "status: 1 of 303 differ, the first at model=lankarani-nikravesh-1990, e=0.5: " in str(verdict)
    assert "not_separated, baseline max_steps" in str(verdict)
    # a quantity that a law lacks is NaN at status ok
    assert np.isnan(figure6["damping_ratio"].sel(model="lankarani-nikravesh-1994")).any()
    assert (figure6["status"].sel(model="lankarani-nikravesh-1994", e=0.5) == 1).all()


def test_points_that_were_left_out_of_both_results_are_equal(figure6: xr.Dataset) -> None:
    """`where` leaves NaN in every variable, also in the status."""
    part = figure6.where(figure6["e"] > 0.5)
    assert impact.compare(part, part).equal
    verdict = impact.compare(part, figure6)
    assert "status" in {variable.name for variable in verdict.differing}


# tolerances


def test_the_tolerance_is_that_of_the_caller_else_of_the_baseline_else_10_rtol(figure6: xr.Dataset) -> None:
    def tolerance(name: str, tol: Any = None, **attributes: Any) -> float:
        verdict = impact.compare(figure6, figure6.assign_attrs(attributes), tol=tol)
        return next(variable.tolerance for variable in verdict.variables if variable.name == name)

    kept = json.dumps({"all": 1e-5, "v1_post": 1e-4})
    assert figure6.attrs["rtol"] == 1e-10
    assert tolerance("e_out") == 10 * 1e-10
    assert tolerance("e_out", rtol=1e-7) == 10 * 1e-7
    # the attributes of NEW do not matter
    new = figure6.assign_attrs(rtol=1e-3, tolerances=kept)
    assert {variable.tolerance for variable in impact.compare(new, figure6).variables[:5]} == {10 * 1e-10}
    assert tolerance("e_out", tolerances=kept) == 1e-5
    assert tolerance("v1_post", tolerances=kept) == 1e-4
    assert tolerance("v2_post", tolerances=json.dumps({"v1_post": 1e-4})) == 10 * 1e-10
    assert tolerance("e_out", {"e_out": 1e-3}, tolerances=kept) == 1e-3
    assert tolerance("v2_post", {"e_out": 1e-3}, tolerances=kept) == 1e-5
    assert tolerance("v1_post", {"e_out": 1e-3}, tolerances=kept) == 1e-4
    assert tolerance("v1_post", {"v1_post": 1e-3}, tolerances=kept) == 1e-3
    # a tolerance for all variables replaces all tolerances of the baseline
    assert tolerance("v1_post", 1e-2, tolerances=kept) == 1e-2
    assert tolerance("v1_post", {"all": 1e-2, "e_out": 1e-3}, tolerances=kept) == 1e-2
    assert tolerance("e_out", {"all": 1e-2, "e_out": 1e-3}, tolerances=kept) == 1e-3
    assert math.isnan(tolerance("status", 1e-2))


@pytest.mark.parametrize(
    ("tol", "message"),
    [
        (-1.0, "tol=-1.0: expected a number >= 0"),
        (math.nan, "tol=nan: expected a number >= 0"),
        (math.inf, "tol=inf: expected a number >= 0"),
        (True, "tol=True: expected a number >= 0"),
        ("1 kg", 'tol="1 kg": expected a number >= 0'),
        ({"e_out": "-1%"}, 'tol={"e_out": -0.01}: expected a number'),
        ({"e_out": -1e-8}, 'tol={"e_out": -1e-08}: expected a number'),
        ({"e_out": None}, 'tol={"e_out": None}: expected'),
        ({"e_oot": 1e-8}, 'tol["e_oot"]: not a variable of a result; did you mean "e_out"?'),
        ({"status": 1e-8}, 'tol["status"]: has no tolerance, it is judged exactly'),
        ({"steps": 1}, 'tol["steps"]: has no tolerance, it is not judged'),
        ({"\x1b[31m": 1e-8}, r'tol["\x1b[31m"]: not a variable of a result; known: '),
        ({3: 1e-8}, 'tol["3"]: not a variable'),
    ],
)
def test_an_invalid_tolerance_is_one_line(figure6: xr.Dataset, tol: Any, message: str) -> None:
    with pytest.raises(UsageError) as raised:
        impact.compare(figure6, figure6, tol=tol)
    assert str(raised.value).startswith(message)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    "attributes",
    [
        {"tolerances": "no JSON"},
        {"tolerances": "[1]"},
        {"tolerances": "null"},
        {"tolerances": '{"all": -1}'},
        {"tolerances": '{"all": NaN}'},
        {"tolerances": '{"e_oot": 1}'},
        {"tolerances": "[" * 100_000},
        {"tolerances": '{"all": 1' + "0" * 400 + "}"},
        {"rtol": "abc"},
        {"rtol": math.nan},
        {"rtol": 0.0},
        {"rtol": math.inf},
        {"rtol": np.array([1e-10, 1e-10])},
        {"materials": "[" * 100_000},
        {"materials": "[3]"},
        {"materials": '{"table1": 3}'},
    ],
    ids=range(16),
)
def test_an_invalid_attribute_is_named_in_one_line(figure6: xr.Dataset, attributes: dict[str, Any]) -> None:
    with pytest.raises(ResultError, match=r"^(the )?attribute \w+:? [^\n]*$"):
        impact.compare(figure6, figure6.assign_attrs(attributes))


def test_attributes_that_may_explain_a_difference_are_notes(figure6: xr.Dataset) -> None:
    other = figure6.assign_attrs(rtol=1e-9, impact_version="0.0.1", max_steps=np.array([1, 2]))
    other["equation"] = other["equation"].astype(object)
    other["equation"][1] = "F = K\x1b[31m"
    verdict = impact.compare(other, figure6)
    assert verdict.equal
    for note in (
        "rtol is 1e-09, in BASELINE 1e-10",
        "impact_version is 0.0.1, in BASELINE ",
        "max_steps is [1 2], in ",
        r"the equation of lankarani-nikravesh-1990 reads F = K\x1b[31m, in BASELINE F = K",
    ):
        assert f"\nnote: {note}" in str(verdict)


def test_a_dataset_that_is_not_a_result_is_refused(figure6: xr.Dataset) -> None:
    history = impact.run(at={"e": 0.5}).history
    assert history is not None
    for dataset, words in (
        (history, "is a time history"),
        (figure6.drop_attrs(), "is not a result"),
        (figure6.drop_vars("m1"), "has no coordinate m1"),
        (figure6.drop_vars("model"), "has no coordinate model"),
        (figure6.assign(e_out=figure6["e_out"].astype(str)), "e_out: got <U32, expected numbers"),
        (figure6.assign_coords(v1=((), "fast")), "v1: got <U4, expected numbers"),
        (figure6.assign(e_out=("model", [0.1, 0.2, 0.3])), "e_out does not vary along all axes"),
        (figure6.assign_attrs(schema_version=1), "is not a result"),
        (figure6.assign_attrs(schema_version=np.array([2, 2])), "is not a result"),
    ):
        with pytest.raises(UsageError, match=f"^NEW: {words}"):
            impact.compare(dataset, figure6)
        with pytest.raises(UsageError, match=f"^BASELINE: {words}"):
            impact.compare(figure6, dataset)


# the text of a verdict


def test_a_line_has_the_counts_and_the_worst_point(figure6: xr.Dataset) -> None:
    moved = figure6.copy(deep=True)
    key = "lankarani-nikravesh-1990"
    # tolerance 1e-9 x v0 = 1 m/s
    for e, by in ((0.05, 160e-9), (0.5, -40e-9), (0.9, 2e-9), (0.96, 0.5e-9)):
        moved["v1_post"].loc[{"model": key, "e": e}] += by
    verdict = impact.compare(moved, figure6)
    assert verdict.headline == "not equal: values (v1_post)"
    assert verdict.lines == (f"v1_post: 3 of 303 differ, worst 160 nm/s = 160 x tolerance at model={key}, e=0.05",)
    assert str(verdict) == f"{verdict.headline}\n{verdict.lines[0]}"
    (difference,) = verdict.differing
    assert difference.new == float(moved["v1_post"].sel(model=key, e=0.05))
    assert difference.baseline == float(figure6["v1_post"].sel(model=key, e=0.05))
    along_e, along_model = (verdict.worst_along[axis]["v1_post"] for axis in ("e", "model"))
    assert along_e.sel(e=[0.05, 0.5, 0.9, 0.96]).values == pytest.approx([160, 40, 2, 0.5], rel=1e-5)
    assert float(along_e.sum()) == pytest.approx(202.5, rel=1e-5)
    assert float(along_model.sel(model=key)) == float(along_model.sum()) == float(along_e.max())
    # the variable with the largest difference comes first
    moved["contact_time"].loc[{"model": key, "e": 0.3}] *= 2
    assert [variable.name for variable in impact.compare(moved, figure6).differing] == ["contact_time", "v1_post"]


def test_the_first_line_has_every_kind_of_difference_and_a_few_names(figure6: xr.Dataset) -> None:
    other = figure6.isel(e=slice(1, None)).drop_vars(["steps", "energy_residual"])
    other = _relabelled(other, "m1", 2.0) * 1.01
    other.attrs = figure6.attrs
    for name in other.variables:
        other[name].attrs = figure6[name].attrs
    other["e_error"].attrs["units"] = "%"
    headline = impact.compare(
        other.assign(status=figure6["status"], in_domain=figure6["in_domain"]), figure6
    ).headline
    assert headline.startswith("not equal: physics config (m1), labels (e), units (e_error), missing variable (")
    assert "missing variable (energy_residual, steps), values (" in headline
    assert headline.endswith(" more)")


def test_names_from_files_are_escaped_in_every_line(figure6: xr.Dataset) -> None:
    malicious = "a\x1b[31m\u202e\n[red]"
    table = json.dumps({malicious: {"E": 1.0, "nu": "\x1b"}})
    new = figure6.assign_attrs(materials=table).rename({"material": f"{malicious}.x"})
    other = figure6.assign_attrs(materials=json.dumps({malicious: {"E": 2.0, "nu": 0.3}}))
    for verdict in (impact.compare(new, other), impact.compare(other, new, subset=True)):
        assert not set("\x1b\u202e") & set(str(verdict))
        assert len(str(verdict).splitlines()) == 1 + len(verdict.faults) + len(verdict.notes)
        assert r"a\x1b[31m\u202e\x0a[red]" in str(verdict)


# the command that repeats the worst point

REPLAYED = {
    "zip": """
models = ["hertz", "bilinear"]
[sweep]
e = [0.25, 0.75]
v1 = { geomspace = [0.1, 10.0, 4] }
v2 = [-1.0, 0.0]
m1 = [1.0, 3.0]
m2 = [2.0, inf]
zip = [["m1", "m2"]]
material1 = "my soft; rubber's"
material2 = ["a \\"hard\\" = $HOME", "b"]
[materials."my soft; rubber's"]
E = 2e9
nu = 0.4
rho = 1000
[materials."a \\"hard\\" = $HOME"]
E = 210e9
nu = 0.3
rho = 7850
[materials.b]
E = 100e9
nu = 0.3
rho = 7850
""",
    "alpha": """
models = ["gharib-hurmuzlu-2012", "hertz"]
[sweep]
alpha = [0.05, 0.1]
v1 = [1.0, 2.0]
m1 = 1.0
m2 = [1.0, inf]
K = 6e9
""",
    "parameter": """
models = ["hertz", "ismail-stronge-2008"]
[sweep]
e = [0.2, 0.6]
v1 = 1.0
m1 = 1.0
m2 = 1.0
material = "steel"
[materials.steel]
E = 210e9
nu = 0.3
rho = 7850
[model.ismail-stronge-2008]
gamma = [1.5, 4.0]
""",
}


@pytest.mark.parametrize(
    "config", ["alpha", *(pytest.param(name, marks=pytest.mark.slow) for name in REPLAYED if name != "alpha")]
)
def test_the_printed_command_repeats_the_worst_point(forked: ForkServer, tmp_path: Path, config: str) -> None:
    (tmp_path / "a config.toml").write_text(REPLAYED[config], encoding="utf-8")
    result = impact.sweep(tmp_path / "a config.toml", overrides=["solver.rtol=1e-4"])
    impact.save(result, tmp_path / "base line.h5")
    random = np.random.default_rng(1)
    changed, positions = result.copy(deep=True), {}
    for name in ("v1_post", "v1_reference", "contact_time"):
        position = np.unravel_index(random.integers(result[name].size), result[name].shape)
        if name == "contact_time":
            # the last position: `impact run` selects the first by default
            position = [size - 1 for size in result[name].shape]
        positions[name] = dict(zip(result[name].dims, map(int, position), strict=True))
        changed[name][positions[name]] = 2 * result[name][positions[name]] + 1
    impact.save(changed, tmp_path / "a new.h5")
    verdict = impact.compare(tmp_path / "a new.h5", tmp_path / "base line.h5")
    assert {difference.name for difference in verdict.differing} == positions.keys()
    for difference in verdict.differing:
        point = result[difference.name][positions[difference.name]]
        command = verdict.replay(difference)
        assert f"  {command}" in verdict.lines
        words = shlex.split(command)
        assert words[:3] == ["impact", "run", str(tmp_path / "a new.h5")]
        completed = forked(*words[1:], "--json")
        assert (completed.returncode, completed.stderr) == (0, ""), command
        printed = json.loads(completed.stdout)
        if difference.name in printed["outputs"]:
            assert printed["outputs"][difference.name] == point.item()
        for name in point.coords:
            # a law with a fixed n runs at that n
            expected = point["exponent" if name == "n" and "exponent" in point.coords else name].item()
            if name in printed.get("inputs", {}) and "." not in str(name):
                assert printed["inputs"][name] == ("inf" if expected == math.inf else expected), name
        if "model" in point.coords:
            assert printed["model"] == difference.at["model"]


@pytest.mark.slow
def test_the_printed_command_has_the_labels_of_the_new_file(tmp_path: Path, forked: ForkServer) -> None:
    # `impact run` looks up zipped values, so that those of the baseline would not be found
    config = {
        "models": "lankarani-nikravesh-1990",
        "solver": {"rtol": 1e-4},
        "sweep": BY_HAND["sweep"]
        | {"m1": {"geomspace": [0.1, 1, 4]}, "m2": [1.0, 2.0, 3.0, 4.0], "zip": [["m1", "m2"]]},
    }
    result = impact.sweep(config)
    rounded = _relabelled(result, "m1", np.nextafter(result["m1"].values, 9.0))
    impact.save(_with(result, "e_out", 0.1, model=0, e=1, m1=2), tmp_path / "new.h5")
    impact.save(rounded, tmp_path / "baseline.h5")
    verdict = impact.compare(tmp_path / "new.h5", tmp_path / "baseline.h5")
    (difference,) = verdict.differing
    assert forked(*shlex.split(verdict.replay(difference))[1:]).returncode == 0


def test_without_a_file_there_is_no_command(figure6: xr.Dataset, stored: Path) -> None:
    moved = _with(figure6, "e_out", 0.1, model=1, e=5)
    assert len(impact.compare(moved, figure6).lines) == 1
    lines = impact.compare(moved, stored).lines
    assert lines[1] == f"  impact run {stored} --model lankarani-nikravesh-1990 --at e=0.05"
    # a point that several variables share has one command
    moved["e_error"][1, 5] = 0.5
    assert len(impact.compare(moved, stored).lines) == 3


def test_two_points_with_the_same_labels_are_refused(figure6: xr.Dataset) -> None:
    twice = xr.concat([figure6, figure6.isel(e=[1])], "e", data_vars="minimal")
    for pair in ((twice, figure6), (figure6, twice), (twice, twice)):
        with pytest.raises(UsageError, match="two points with the same labels"):
            impact.compare(*pair, subset=True)


def test_an_input_along_two_axes_is_compared(wide: xr.Dataset) -> None:
    def with_mass(mass: float) -> xr.Dataset:
        table = np.full((wide.sizes["e"], wide.sizes["v1"]), 2.0)
        table[1, 1] = mass
        return wide.assign_coords(R1=(("e", "v1"), table))

    assert impact.compare(with_mass(2.0), with_mass(2.0)).equal
    assert _faults(impact.compare(with_mass(7.0), with_mass(2.0))) == [("labels", "R1")]


def test_an_e_computed_from_alpha_is_compared_with_the_rounding_of_its_formula() -> None:
    # e = 1 - alpha v0 is small if the product is near 1, and its rounding error is that of 1
    sweep = {"alpha": 0.1, "v1": [1.0, 9.9999], "m1": 1.0, "m2": 2.0, "K": 6e9}
    result = impact.sweep({"models": "hertz", "sweep": sweep})
    near = impact.sweep({"models": "hertz", "sweep": sweep | {"v1": [1.0, np.nextafter(9.9999, 10.0)]}})
    assert impact.compare(near, result).equal


def test_integer_labels_equal_floating_point_labels(wide: xr.Dataset) -> None:
    assert impact.compare(wide.assign_coords(v1=("v1", [1, 2], wide["v1"].attrs)), wide).equal


def test_nans_at_points_with_status_ok_are_not_equal(figure6: xr.Dataset) -> None:
    missing = figure6.assign(v1_post=figure6["v1_post"] * np.nan)
    verdict = impact.compare(missing, missing)
    assert [variable.name for variable in verdict.differing] == ["v1_post"]
    assert verdict.differing[0].different == int((figure6["status"] == 1).sum())


def test_the_lines_are_in_the_order_of_the_headline(figure6: xr.Dataset) -> None:
    other = figure6.assign_coords(e=figure6["e"] + 5.0, v1=2.0)
    other["e_out"].attrs["units"] = "%"
    verdict = impact.compare(other, figure6)
    kinds = list(dict.fromkeys(line.split(":")[0] for line in verdict.lines))
    assert kinds == ["nothing in common", "physics config", "units"]
    assert verdict.headline.index(kinds[0]) < verdict.headline.index(kinds[1]) < verdict.headline.index(kinds[2])


def test_a_point_of_a_zip_group_is_matched_with_a_point_of_an_axis() -> None:
    sweep = {"e": 0.5, "v1": 1.0, "m1": [1.0, 3.0], "K": 6e9}
    zipped = impact.sweep({"models": "hertz", "sweep": sweep | {"m2": [1.0, 7.0], "zip": [["m1", "m2"]]}})
    plain = impact.sweep({"models": "hertz", "sweep": sweep | {"m2": 1.0}})
    for pair in ((zipped, plain), (plain, zipped)):
        assert _faults(impact.compare(*pair)) == [("labels", "m1")]
        verdict = impact.compare(*pair, subset=True)
        assert verdict.equal
        assert {variable.points for variable in verdict.variables} == {1}


def test_the_line_of_a_single_point_has_no_coordinates() -> None:
    point = impact.sweep({"models": "hertz", "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}})
    moved = point.assign(v1_reference=point["v1_reference"] + 1.0)
    assert "v1_reference: 1 of 1 differ, worst 1 m/s = 1e+09 x tolerance\n" in f"{impact.compare(moved, point)}\n"


@pytest.mark.slow
def test_the_printed_command_of_a_part_of_a_result_has_the_values_of_that_part(
    forked: ForkServer, figure6: xr.Dataset, wide: xr.Dataset, tmp_path: Path
) -> None:
    for whole, position, inputs in (
        (figure6, {"e": 5}, {"e": 0.05}),
        (wide, {"m1": 1, "v1": 1}, {"m1": 3.0, "m2": "inf", "v1": 2.0}),
    ):
        part = whole.isel(position)
        impact.save(part.assign(e_out=part["e_out"] + 1.0), tmp_path / "part.h5", overwrite=True)
        verdict = impact.compare(tmp_path / "part.h5", part)
        command = shlex.split(verdict.replay(verdict.differing[0]))
        printed = json.loads(forked(*command[1:], "--json").stdout)
        assert inputs.items() <= printed["inputs"].items()
