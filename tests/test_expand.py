"""Outputs expanded from the trajectory table: lazy or in full, from a plan or a file, with the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import impact
from impact.api import prepare
from impact.contact.outputs import check_inputs
from impact.contact.status import Status
from impact.engine.build_impacts import build_impacts
from impact.results import sweep as sweeps_of
from impact.results.expand import CHECKS, checks_that_may_fail
from impact.results.schema import SCHEMA
from impact.results.sweep import sweep_into

from .problems import table1_impacts
from .test_deduplicate import DASHPOT, MATERIALS, OPTIONAL_PARAMETERS, REQUIRED_PARAMETERS, SPEED

# a rule of K of its own, which asks for the exponent, a speed and the masses
STIFF = """
import impact

STIFF = impact.ForceModel(
    "stiff", "Stiff", 2026, equation="", reference="", force=lambda elastic, v, a: elastic * (1.0 + a * v),
    stiffness=lambda m, v0, n, k: k * m * v0 ** (1.0 - n), coefficients={"a": lambda e: 1.0 - e},
    parameters=(impact.Parameter("k", "1", "", default=1e4, least=0.0),),
)
"""
LAYOUTS = ("full", "factored")
EVERYTHING = [variable.name for variable in SCHEMA]
VALUES: dict[str, list[object]] = {
    "e": [0.0, 0.1, 0.5, 1.0], "v1": [-1.0, 0.5, 1.0, 2.0, 1e-200, 1e200], "v2": [0.0, -1.0, 1.0],
    "m1": [1.0, 2.0, float("inf")], "m2": [0.5, 1.0, float("inf")], "material": ["soft", "hard"],
    "n": [1.0, 1.5, 2.0], "R1": [0.05, float("inf")], "alpha": [0.0, 0.4, 2.0],
}  # fmt: skip


OWN_LAWS = {"dashpot": DASHPOT, "speed": SPEED}
STIFFNESSES = [1e9, 1e-300, [1e9, 2e9], [1e300, 1e9, 1e-300]]


@st.composite
def configs(draw: st.DrawFn) -> dict[str, object]:
    """Sweeps with walls, planes, misses, sizes out of range, zip groups, and any models of the catalogue."""
    driver = draw(st.sampled_from(["e", "alpha"]))
    more = draw(st.sets(st.sampled_from(["v2", "n", "R1"])))
    sweep: dict[str, Any] = {}
    for name in draw(st.permutations([driver, "v1", "m1", "m2", "material", *sorted(more)])):
        values = st.lists(st.sampled_from(VALUES[name]), min_size=2, max_size=4, unique=True)
        sweep[name] = draw(st.sampled_from(VALUES[name]) | values)
    # an axis of several names: two of the numbers of one length
    swept = [name for name, values in sweep.items() if isinstance(values, list)]
    if len(swept) > 1 and draw(st.booleans()):
        group = draw(st.permutations(swept))[:2]
        size = min(len(VALUES[name]) for name in group)
        for name in group:
            sweep[name] = draw(st.permutations(VALUES[name]))[:size]
        sweep["zip"] = [group]
    known = [*sorted(impact.models()), *OPTIONAL_PARAMETERS]
    models = draw(st.lists(st.sampled_from(known), min_size=1, max_size=3, unique=True))
    own = {key: OPTIONAL_PARAMETERS[key] for key in models if key in OPTIONAL_PARAMETERS and draw(st.booleans())}
    own |= {key: REQUIRED_PARAMETERS[key] for key in models if key in REQUIRED_PARAMETERS}
    # one K is of one exponent; a law with an exponent of its own has a K of its own
    exponents = {(impact.models().get(key) or OWN_LAWS[key]).exponent for key in models}
    if exponents <= {None, 1.5} and sweep.get("n", 1.5) == 1.5 and draw(st.booleans()):
        sweep["K"] = draw(st.sampled_from(STIFFNESSES))
    elif exponents == {1.0} and draw(st.booleans()):
        own[models[0]] = {**own.get(models[0], {}), "K": draw(st.sampled_from(STIFFNESSES))}
    return {
        "models": models, "sweep": sweep, "materials": MATERIALS, "solver": {"rtol": 1e-4}, "model": own,
        "output": {"variables": EVERYTHING},
    }  # fmt: skip


def lazy_and_full(config: object, plugins: list[Any]) -> tuple[xr.Dataset, xr.Dataset]:
    """The same sweep, computed when it is indexed and in memory."""
    full = impact.sweep(config, plugins=plugins)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweeps_of, "MAX_LOADED_BYTES", -1)
        return impact.sweep(config, plugins=plugins), full


def same_bits(one: xr.DataArray, other: xr.DataArray) -> None:
    assert (one.dims, one.shape, one.dtype) == (other.dims, other.shape, other.dtype), one.name
    assert one.values.tobytes() == other.values.tobytes(), one.name


@settings(max_examples=8)
@given(configs(), st.data())
def test_any_part_is_that_of_the_whole_bit_for_bit(config: dict[str, object], data: st.DataObject) -> None:
    lazy, full = lazy_and_full(config, [DASHPOT, SPEED])
    part: dict[Any, Any] = {}
    for dim, size in full.sizes.items():
        places = st.lists(st.integers(0, size - 1), max_size=5)
        part[dim] = data.draw(
            st.integers(0, size - 1) | places | st.just(slice(None)) | st.just(slice(None, None, -1))
        )
    for name in EVERYTHING:
        same_bits(lazy[name].isel(part, missing_dims="ignore"), full[name].isel(part, missing_dims="ignore"))


@settings(max_examples=10)
@given(configs())
def test_nothing_varies_along_an_axis_that_is_not_named(config: dict[str, object]) -> None:
    lazy, full = lazy_and_full(config, [DASHPOT, SPEED])
    for name in EVERYTHING:
        # without the axis of models a variable is of the first one
        for model, key in enumerate(
            full["model"].values if "model" in full[name].dims else full["model"].values[:1]
        ):
            values = full[name].isel(model=model) if "model" in full[name].dims else full[name]
            for dim in {*values.dims} - {*lazy[name].encoding["varies_along"][str(key)]}:
                first = values.isel({dim: [0] * values.sizes[dim]})
                np.testing.assert_array_equal(values.transpose(*first.dims), first, f"{key}: {name} along {dim}")


@settings(max_examples=20)
@given(configs())
def test_what_is_not_checked_never_fails(config: dict[str, object]) -> None:
    plan = prepare(config, plugins=[DASHPOT, SPEED])
    for law in plan.models:
        lanes = build_impacts(plan.inputs, law, plan.inputs.index())
        with np.errstate(all="ignore"):
            expected = check_inputs(law, lanes)
            found = check_inputs(law, lanes, checks_that_may_fail(plan.inputs, law))
        shape = plan.shape or (1,)
        assert np.array_equal(np.broadcast_to(found, shape), np.broadcast_to(expected, shape)), law.key


@pytest.mark.parametrize(
    ("checks", "status"),
    [({"v0"}, Status.NO_IMPACT), ({"length"}, Status.NO_IMPACT), ({"e"}, Status.OK), (set(), Status.OK)],
)
def test_balls_that_part_have_a_status_by_their_speed_or_their_sizes(checks: set[str], status: Status) -> None:
    checked = check_inputs(impact.models()["hertz"], table1_impacts(v1=-1.0), frozenset(checks))
    assert np.broadcast_to(checked, 1).tolist() == [status]


def test_a_plain_sweep_needs_no_checks_and_one_that_may_fail_has_them() -> None:
    sweep = {"e": [0.1, 0.9], "v1": [1.0, 2.0], "m1": 1.0, "m2": [1.0, 2.0], "K": 1e9}

    def checks(**changes: object) -> frozenset[str]:
        plan = prepare({"models": "gharib-hurmuzlu-2012", "sweep": {**sweep, **changes}})
        return checks_that_may_fail(plan.inputs, plan.models[0])

    assert checks() == frozenset()
    assert checks(v1=[-1.0, 1.0]) == {"v0"}
    assert "length" in checks(K=1e-300)
    assert "length" in checks(v1=[1e-200, 1.0])
    assert checks(v1=[-1.0, -2.0]) == CHECKS
    alpha = {name: values for name, values in sweep.items() if name != "e"}
    plan = prepare({"models": "gharib-hurmuzlu-2012", "sweep": {**alpha, "alpha": [0.1, 0.6]}})
    assert checks_that_may_fail(plan.inputs, plan.models[0]) == {"e"}


@settings(max_examples=5, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(configs())
def test_a_factored_file_holds_what_a_full_one_does(tmp_path: Path, config: dict[str, object]) -> None:
    plans = {layout: prepare(config, [f'output.layout="{layout}"'], [DASHPOT, SPEED]) for layout in LAYOUTS}
    surveys = {layout: sweep_into(tmp_path / layout, plan, overwrite=True) for layout, plan in plans.items()}
    full, factored = (impact.load(tmp_path / layout) for layout in LAYOUTS)
    for name in EVERYTHING:
        same_bits(factored[name], full[name])
    # what the summary prints, for which a factored sweep counts each distinct point once
    whole, distinct = surveys["full"].summary, surveys["factored"].summary
    np.testing.assert_equal((distinct.counts, distinct.worst), (whole.counts, whole.worst))
    assert distinct.points == whole.points == plans["full"].points
    # of failed points that differ in nothing but an axis along which no status varies, the first is named
    assert distinct.failed_at[:1] == whole.failed_at[:1]
    for status, *at in distinct.failed_at:
        assert full["status"].values[at[0], *at[1]] == status
    assert surveys["factored"].trajectories == surveys["full"].trajectories


def test_a_law_of_ones_own_is_expanded_without_it(tmp_path: Path) -> None:
    (tmp_path / "stiff.py").write_text(STIFF, encoding="utf-8")
    sweep = {"e": [0.1, 0.5], "v1": [1.0, 2.0, 4.0], "m1": [1.0, 3.0], "m2": [1.0, float("inf")], "n": [1.0, 1.5]}
    config = {"models": ["stiff", "hertz"], "sweep": {**sweep, "material": "soft"}, "materials": MATERIALS,
              "output": {"layout": "factored", "variables": EVERYTHING}}  # fmt: skip
    plan = prepare(config, plugins=[tmp_path / "stiff.py"])
    sweep_into(tmp_path / "factored.h5", plan)
    whole = impact.sweep(config, plugins=[tmp_path / "stiff.py"])
    (tmp_path / "stiff.py").unlink()
    opened = impact.load(tmp_path / "factored.h5")
    for name in EVERYTHING:
        same_bits(opened[name], whole[name])
    # its rule gives K by the speed and the mass
    K = opened["stiffness"].sel(model="stiff", n=1.5, m2=float("inf"), m1=3.0, e=0.5)
    np.testing.assert_allclose(K, 1e4 * 3.0 * np.array([1.0, 2.0, 4.0]) ** -0.5, rtol=1e-12)
