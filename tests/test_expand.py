"""Outputs expanded from the trajectory table, lazily or at once, have the same bits; any part can be written."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings, strategies as st

import impact
from impact.contact.output_formulas import check_inputs
from impact.contact.status import Status
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.inputs import build_impacts
from impact.engine.run import Run as SweepRun
from impact.errors import UsageError
from impact.results import sweep as sweep_module
from impact.results.sweep import read_plan, sweep_into
from impact.results.trajectory_table import CHECKS, checks_that_may_fail

from .conftest import Run, assert_same_array
from .problems import table1_impacts
from .test_deduplicate import DASHPOT, MATERIALS, OPTIONAL_PARAMETERS, REQUIRED_PARAMETERS, SPEED

# its stiffness depends on the exponent, the speed and the masses
STIFF = """
import impact

STIFF = impact.ForceModel(
    "stiff", "Stiff", 2026, equation="", reference="", force=lambda elastic, v, a: elastic * (1.0 + a * v),
    stiffness=lambda m, v0, n, k: k * m * v0 ** (1.0 - n), coefficients={"a": lambda e: 1.0 - e},
    parameters=(impact.Parameter("k", "1", "", default=1e4, least=0.0),),
)
"""
LAYOUTS = ("full", "factored")
SMALL = {
    "models": ["gharib-hurmuzlu-2012", "hertz"],
    "solver": {"rtol": 1e-4},
    "sweep": {"e": [0.3, 0.6], "v1": [1.0, 2.0], "m1": 1.0, "m2": 2.0, "K": 1e9},
}
MANY = SMALL | {"sweep": {"e": {"linspace": [0.3, 0.9, 300]}, "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 1e9}}
EVERYTHING = [*CENTRAL_OUTPUTS]
VALUES: dict[str, list[object]] = {
    "e": [0.0, 0.1, 0.5, 1.0], "v1": [-1.0, 0.5, 1.0, 2.0, 1e-200, 1e200], "v2": [0.0, -1.0, 1.0],
    "m1": [1.0, 2.0, float("inf")], "m2": [0.5, 1.0, float("inf")], "material": ["soft", "hard"],
    "n": [1.0, 1.5, 2.0], "R1": [0.05, float("inf")], "alpha": [0.0, 0.4, 2.0],
}  # fmt: skip
PLUGINS = {"dashpot": DASHPOT, "speed": SPEED}
STIFFNESSES = [1e9, 1e-300, [1e9, 2e9], [1e300, 1e9, 1e-300]]


@st.composite
def configs(draw: st.DrawFn) -> dict[str, object]:
    """Sweeps of any models, with walls, planes, balls that part, values out of range and zip groups."""
    driver = draw(st.sampled_from(["e", "alpha"]))
    more = draw(st.sets(st.sampled_from(["v2", "n", "R1"])))
    sweep: dict[str, Any] = {}
    for name in draw(st.permutations([driver, "v1", "m1", "m2", "material", *sorted(more)])):
        values = st.lists(st.sampled_from(VALUES[name]), min_size=2, max_size=4, unique=True)
        sweep[name] = draw(st.sampled_from(VALUES[name]) | values)
    # a zip group of two inputs
    swept = [name for name, values in sweep.items() if isinstance(values, list)]
    if len(swept) > 1 and draw(st.booleans()):
        group = draw(st.permutations(swept))[:2]
        size = min(len(VALUES[name]) for name in group)
        for name in group:
            sweep[name] = draw(st.permutations(VALUES[name]))[:size]
        sweep["zip"] = [group]
    known = [*sorted(impact.models()), *OPTIONAL_PARAMETERS]
    models = draw(st.lists(st.sampled_from(known), min_size=1, max_size=3, unique=True))
    parameters = {
        key: OPTIONAL_PARAMETERS[key] for key in models if key in OPTIONAL_PARAMETERS and draw(st.booleans())
    }
    parameters |= {key: REQUIRED_PARAMETERS[key] for key in models if key in REQUIRED_PARAMETERS}
    # K belongs to one exponent; a model with a fixed exponent needs K in its own table
    exponents = {(impact.models().get(key) or PLUGINS[key]).exponent for key in models}
    if exponents <= {None, 1.5} and sweep.get("n", 1.5) == 1.5 and draw(st.booleans()):
        sweep["K"] = draw(st.sampled_from(STIFFNESSES))
    elif exponents == {1.0} and draw(st.booleans()):
        parameters[models[0]] = {**parameters.get(models[0], {}), "K": draw(st.sampled_from(STIFFNESSES))}
    return {
        "models": models, "sweep": sweep, "materials": MATERIALS, "solver": {"rtol": 1e-4}, "model": parameters,
        "output": {"variables": EVERYTHING},
    }  # fmt: skip


def lazy_and_full(config: object) -> tuple[xr.Dataset, xr.Dataset]:
    """The same sweep, with values computed when they are indexed, and with all values in memory."""
    full = impact.sweep(config, plugins=[*PLUGINS.values()])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep_module, "MAX_LOADED_BYTES", -1)
        return impact.sweep(config, plugins=[*PLUGINS.values()]), full


def assert_constant_along_unnamed_axes(lazy: xr.Dataset, full: xr.Dataset) -> None:
    """No variable varies along an axis that its encoding "varies_along" does not name."""
    for name in EVERYTHING:
        # a variable without the axis of models belongs to the first model
        keys = full["model"].values if "model" in full[name].dims else full["model"].values[:1]
        for model, key in enumerate(keys):
            values = full[name].isel(model=model) if "model" in full[name].dims else full[name]
            for dim in {*values.dims} - {*lazy[name].encoding["varies_along"][str(key)]}:
                first = values.isel({dim: [0] * values.sizes[dim]})
                np.testing.assert_array_equal(values.transpose(*first.dims), first, f"{key}: {name} along {dim}")


@pytest.mark.slow
@settings(max_examples=10)
@given(configs(), st.data())
def test_any_part_of_a_lazy_result_has_the_bits_of_the_full_one(
    config: dict[str, object], data: st.DataObject
) -> None:
    lazy, full = lazy_and_full(config)
    part: dict[Any, Any] = {}
    for dim, size in full.sizes.items():
        indices = st.lists(st.integers(0, size - 1), max_size=5)
        part[dim] = data.draw(
            st.integers(0, size - 1) | indices | st.just(slice(None)) | st.just(slice(None, None, -1))
        )
    for name in EVERYTHING:
        assert_same_array(
            lazy[name].isel(part, missing_dims="ignore"), full[name].isel(part, missing_dims="ignore")
        )
    assert_constant_along_unnamed_axes(lazy, full)


@settings(max_examples=20)
@given(configs())
def test_a_check_that_is_skipped_never_fails(config: dict[str, object]) -> None:
    plan = read_plan(config, plugins=[*PLUGINS.values()])
    for model in plan.models:
        impacts = build_impacts(plan.inputs, model, plan.inputs.index())
        with np.errstate(all="ignore"):
            expected = check_inputs(model, impacts)
            statuses = check_inputs(model, impacts, checks_that_may_fail(plan.inputs, model))
        shape = plan.inputs.shape or (1,)
        assert np.array_equal(np.broadcast_to(statuses, shape), np.broadcast_to(expected, shape)), model.key


@pytest.mark.parametrize(
    ("checks", "status"),
    [({"v0"}, Status.NO_IMPACT), ({"length"}, Status.NO_IMPACT), ({"e"}, Status.OK), (set(), Status.OK)],
)
def test_balls_that_part_are_no_impact_if_their_speed_or_size_is_checked(checks: set[str], status: Status) -> None:
    checked = check_inputs(impact.models()["hertz"], table1_impacts(v1=-1.0), frozenset(checks))
    assert np.broadcast_to(checked, 1).tolist() == [status]


def test_only_inputs_that_may_be_invalid_are_checked() -> None:
    sweep = {"e": [0.1, 0.9], "v1": [1.0, 2.0], "m1": 1.0, "m2": [1.0, 2.0], "K": 1e9}

    def checks(**changes: object) -> frozenset[str]:
        plan = read_plan({"models": "gharib-hurmuzlu-2012", "sweep": {**sweep, **changes}})
        return checks_that_may_fail(plan.inputs, plan.models[0])

    assert checks() == frozenset()
    assert checks(v1=[-1.0, 1.0]) == {"v0"}
    assert "length" in checks(K=1e-300)
    assert "length" in checks(v1=[1e-200, 1.0])
    assert checks(v1=[-1.0, -2.0]) == CHECKS
    alpha = {name: values for name, values in sweep.items() if name != "e"}
    plan = read_plan({"models": "gharib-hurmuzlu-2012", "sweep": {**alpha, "alpha": [0.1, 0.6]}})
    assert checks_that_may_fail(plan.inputs, plan.models[0]) == {"e"}


@pytest.mark.slow
@settings(max_examples=3, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(configs())
def test_a_factored_file_holds_the_values_of_a_full_one(tmp_path: Path, config: dict[str, object]) -> None:
    plans = {layout: read_plan(config, [f'output.layout="{layout}"'], [*PLUGINS.values()]) for layout in LAYOUTS}
    surveys = {
        layout: sweep_into(tmp_path / layout, plan, SweepRun(overwrite=True)) for layout, plan in plans.items()
    }
    full, factored = (impact.load(tmp_path / layout) for layout in LAYOUTS)
    for name in EVERYTHING:
        assert_same_array(factored[name], full[name])
    # the printed summary; a factored sweep counts each distinct point once for it
    whole, distinct = surveys["full"].summary, surveys["factored"].summary
    np.testing.assert_equal((distinct.counts, distinct.worst), (whole.counts, whole.worst))
    assert distinct.points == whole.points == plans["full"].points
    # along an axis along which no status varies, only the first failed point is listed
    assert distinct.failed_at[:1] == whole.failed_at[:1]
    for status, place, index in distinct.failed_at:
        assert full["status"].values[*place, *index] == status
    assert surveys["factored"].trajectories == surveys["full"].trajectories


@pytest.mark.slow
def test_a_few_of_many_trajectories_are_read_in_any_order(tmp_path: Path) -> None:
    # the trajectories that were read last, which are kept, are those of the second law
    result = impact.sweep(MANY, output=tmp_path / "factored.h5", overrides=['output.layout="factored"'])
    with xr.open_dataset(tmp_path / "factored.h5", engine="impact") as lazy:
        assert_same_array(lazy["e_out"].isel(e=[271, 3]), result["e_out"].isel(e=[271, 3]))


def test_a_few_of_many_trajectories_of_a_result_without_a_file_are_read_in_any_order() -> None:
    lazy, full = lazy_and_full(MANY)
    assert_same_array(lazy["e_out"].isel(e=[271, 3]), full["e_out"].isel(e=[271, 3]))


def test_a_computed_output_names_the_axes_along_which_it_or_its_status_varies(tmp_path: Path) -> None:
    sweep = {"v1": [-1.0, 1.0], "m1": [1.0, 3.0], "m2": 2.0, "K": 1e9}
    impact.sweep(
        {"models": "hertz", "sweep": sweep, "output": {"layout": "factored"}}, output=tmp_path / "factored.h5"
    )
    with xr.open_dataset(tmp_path / "factored.h5", engine="impact") as lazy:
        along = {name: lazy[name].encoding["varies_along"]["hertz"] for name in ("e_out", "status", "v1_post")}
    # an elastic ball has one restitution, but none where it does not come to the other one
    assert along == {"e_out": ("v1",), "status": ("v1",), "v1_post": ("v1", "m1")}


@pytest.mark.slow
def test_a_factored_file_of_a_plugin_is_read_without_the_plugin(tmp_path: Path) -> None:
    (tmp_path / "stiff.py").write_text(STIFF, encoding="utf-8")
    sweep = {"e": [0.1, 0.5], "v1": [1.0, 2.0, 4.0], "m1": [1.0, 3.0], "m2": [1.0, float("inf")], "n": [1.0, 1.5]}
    config = {"models": ["stiff", "hertz"], "sweep": {**sweep, "material": "soft"}, "materials": MATERIALS,
              "output": {"layout": "factored", "variables": EVERYTHING}}  # fmt: skip
    plan = read_plan(config, plugins=[tmp_path / "stiff.py"])
    sweep_into(tmp_path / "factored.h5", plan)
    full = impact.sweep(config, plugins=[tmp_path / "stiff.py"])
    (tmp_path / "stiff.py").unlink()
    opened = impact.load(tmp_path / "factored.h5")
    for name in EVERYTHING:
        assert_same_array(opened[name], full[name])
    # its stiffness depends on the speed and the mass
    K = opened["stiffness"].sel(model="stiff", n=1.5, m2=float("inf"), m1=3.0, e=0.5)
    np.testing.assert_allclose(K, 1e4 * 3.0 * np.array([1.0, 2.0, 4.0]) ** -0.5, rtol=1e-12)


@pytest.mark.slow
def test_expand_writes_the_whole_result_or_a_part_of_it(cli: Run, tmp_path: Path) -> None:
    output = tmp_path / "expanded.h5"
    for layout in LAYOUTS:
        path = tmp_path / f"{layout}.h5"
        result = impact.sweep(SMALL, output=path, overrides=[f'output.layout="{layout}"'])
        assert impact.expand(path, output, overwrite=True) == 8
        expanded = impact.load(output)
        assert expanded.encoding["layout"] == "full"
        assert expanded.identical(result)
    done = cli("expand", path, "-o", output, "--sel", "v1=2.0", "--model", "hertz", "--overwrite")
    assert (done.returncode, done.stderr) == (0, f"{output}: 2 points, {output.stat().st_size:,} bytes\n")
    part = impact.load(output)
    assert part.identical(result.sel(model=["hertz"]).sel(v1=2.0))
    # programs that do not use impact read the same values
    with xr.open_dataset(output, engine="h5netcdf") as dataset:
        np.testing.assert_array_equal(dataset["v1_post"].values, part["v1_post"].values)
        assert dataset["model"].values.tolist() == ["hertz"]


def test_expand_refuses_too_many_points_unknown_labels_and_an_existing_output(cli: Run, tmp_path: Path) -> None:
    path, new, existing = (tmp_path / name for name in ("r.h5", "new.h5", "existing.h5"))
    impact.sweep(SMALL, output=path)
    existing.write_bytes(b"")
    refusals: list[tuple[Path, dict[str, Any], str]] = [
        (path, {"overwrite": True}, "is the file to be read"),
        (existing, {}, "exists; give another name"),
        (new, {"sel": {"v1": 9.0}}, "no v1 = 9.0 in this result"),
        (new, {"models": ["bilinear"]}, 'no model "bilinear" in this result'),
    ]
    for output, arguments, expected in refusals:
        with pytest.raises(UsageError, match=expected):
            impact.expand(path, output, **arguments)
    done = cli("expand", path, "-o", new, "--max-points", "7")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert "got 8 points, expected at most 7 (--max-points)" in done.stderr
    assert sorted(child.name for child in tmp_path.iterdir()) == ["existing.h5", "r.h5"]


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_a_value_that_several_points_of_a_zip_group_have_selects_all_of_them(tmp_path: Path, layout: str) -> None:
    sweep = {"e": [0.3, 0.6, 0.9], "v1": [1.0, 2.0, 1.0], "zip": [["e", "v1"]], "m1": 1.0, "m2": 1.0, "K": 1e6}
    config = {"models": ["flores-2011"], "sweep": sweep, "output": {"layout": layout}}
    impact.sweep_to_file(config, tmp_path / "r.h5")
    impact.expand(tmp_path / "r.h5", tmp_path / "part.h5", sel={"v1": 1.0})
    part = impact.load(tmp_path / "part.h5")
    assert part["e"].values.tolist() == [0.3, 0.9]
    assert part["e_out"].values.tolist() == impact.load(tmp_path / "r.h5")["e_out"].isel(e=[0, 2]).values.tolist()
    with pytest.raises(UsageError, match=r"^no v1 = 1\.0 there; v1 is 2$"):
        impact.expand(tmp_path / "r.h5", tmp_path / "other.h5", sel={"e": 0.6, "v1": 1.0})
