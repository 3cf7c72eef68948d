"""A fixed step and a phase are axes of a sweep like any other, and give what a code with that step delivers."""

from __future__ import annotations

import json
import math
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.fixed_step import MAX_STEPS_PER_CONTACT, SCHEMES
from impact.contact.status import Status
from impact.errors import ConfigError, UsageError
from impact.plots.curves import Curve, CurveData
from impact.plots.draw import get_plot_data
from impact.plots.kinds import Choice

from .conftest import ROOT, Run, assert_same_bits, new_law
from .test_plots import check_layout, names_of

# sweeps step by step: `make test-faults` runs them
pytestmark = pytest.mark.slow

LINEAR = "anagnostopoulos-1988"
BALLS = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "steel"}
# every law of a form: a spring and dashpot, with and without tension, hysteresis, unloading branches, adhesion
LAWS = ["hertz", LINEAR, "tsuji-1992-no-tension", "hunt-crossley-1975", "bilinear", "thornton-1997"]
TOML = f"""
models = ["{LINEAR}", "tsuji-1992"]
[sweep]
e = [0.3, 0.9]
v1 = [0.5, 1.0]
m1 = 1.0
m2 = 1.0
material = "steel"
steps_per_contact = [8, 20]
phase = [0.25, 0.5, 1.0]
[solver]
integrator = "kick-drift"
"""


def swept(models: str | list[str] = LINEAR, /, integrator: str = "kick-drift", **sweep: Any) -> xr.Dataset:
    """The result of a sweep of two steel balls."""
    tables = {key: sweep.pop(key) for key in ("model", "materials") if key in sweep}
    solver = {"integrator": integrator, **sweep.pop("solver", {})}
    return impact.sweep({"models": models, "solver": solver, "sweep": BALLS | sweep, **tables})


def test_table_of_a_linear_contact() -> None:
    phases = 400
    result = swept(
        e=[0.9, 0.5, 0.1],
        steps_per_contact=[10, 20, 50, 100],
        phase=[(i + 0.5) / phases for i in range(phases)],
    )
    e = result["e_out"].isel(model=0)
    mean = [[0.9000, 0.8999, 0.8999, 0.9000], [0.491, 0.4945, 0.4976, 0.4988], [0.060, 0.080, 0.092, 0.096]]
    least = [[0.894, 0.898], [0.454, 0.480], [0.037, 0.067]]
    largest = [[0.921, 0.909], [0.542, 0.519], [0.072, 0.089]]
    coarse = {"steps_per_contact": slice(2)}
    np.testing.assert_allclose(e.mean("phase").values, mean, atol=6e-4)
    np.testing.assert_allclose(e.min("phase").isel(coarse).values, least, atol=6e-4)
    np.testing.assert_allclose(e.max("phase").isel(coarse).values, largest, atol=6e-4)
    assert e.min("phase").sel(e=0.5, steps_per_contact=50) == pytest.approx(0.493, abs=6e-4)
    assert e.max("phase").sel(e=0.5, steps_per_contact=50) == pytest.approx(0.507, abs=6e-4)


@pytest.mark.parametrize("model", LAWS)
def test_a_sweep_gives_what_timestep_predicts(model: str) -> None:
    tables = ["materials.steel.yield_strength='1 GPa'"]
    # a law without an e, and without a damping that gives one, takes none
    asked = {"e": 0.6} if "e" in impact.models()[model].quantities else {}
    predicted = impact.timestep(
        model,
        at={**BALLS, **asked},
        overrides=["sweep.material='steel'", *tables],
        steps_per_contact=[12, 30],
        phases=8,
    )
    phase = [(i + 0.5) / 8 for i in range(8)]
    strength = {"steel": {"E": 210e9, "nu": 0.3, "rho": 7800, "yield_strength": "1 GPa"}}
    at_steps = swept(model, e=0.6, steps_per_contact=[12, 30], phase=phase, materials=strength)
    at_dt = swept(model, e=0.6, dt=[row.dt for row in predicted.rows][::-1], phase=phase, materials=strength)
    for result, dim in ((at_steps, "steps_per_contact"), (at_dt, "dt")):
        rows = predicted.rows if dim == "steps_per_contact" else predicted.rows[::-1]
        e = result["e_out"].isel(model=0)
        np.testing.assert_allclose(e.mean("phase"), [row.e_mean for row in rows], rtol=1e-9)
        np.testing.assert_allclose(e.min("phase"), [row.e_least for row in rows], rtol=1e-9)
        np.testing.assert_allclose(e.max("phase"), [row.e_largest for row in rows], rtol=1e-9)


@pytest.mark.parametrize("scheme", [scheme for scheme in SCHEMES if scheme != "mujoco-cone"])
def test_small_steps_give_every_variable_of_the_continuous_law(scheme: str) -> None:
    law = {"kick-drift": LINEAR, "drake-tamsi": "exact-hysteresis"}.get(scheme, f"{LINEAR}-no-tension")
    exact = swept(law, "exact", e=0.6, K=1e6, n=1.0)
    fine = swept(law, scheme, e=0.6, K=1e6, n=1.0, steps_per_contact=5000)
    # the contact of a clamped force goes on without force, after the end of the law
    names = ["e_out", "v1_post", "peak_indentation", "peak_force", "energy_loss"]
    for name in names if scheme in ("drake-sap", "pybullet") else (*names, "contact_time"):
        assert fine[name].item() == pytest.approx(exact[name].item(), rel=3e-3), name
    for name in ("stiffness", "damping_ratio", "in_domain", "v1_reference"):
        np.testing.assert_array_equal(fine[name].values, exact[name].values)
    # the schemes of Drake and PyBullet lose energy in proportion to the step
    assert abs(fine["energy_residual"].item()) < (1e-3 if scheme == "kick-drift" else 2e-3)


def test_the_energy_residual_of_a_dashpot_has_the_works_from_the_first_touch_to_the_last() -> None:
    """By the trapezoidal rule over the ends of the steps, of a force that does not vanish at either end."""
    C, dt, phase = 0.4, 0.2, 0.3
    balls = {"m1": 1.0, "m2": math.inf, "K": 1.0, "n": 1.0, "v1": 1.0}
    law = {"models": "kelvin-voigt", "model": {"kelvin-voigt": {"C": C}}, "solver": {"integrator": "kick-drift"}}
    result = impact.sweep({**law, "sweep": {**balls, "dt": dt, "phase": phase}})
    x, u, path = phase * dt, 1.0, [(0.0, C)]
    while x > 0.0:
        path.append((x, x + C * u))
        u -= dt * path[-1][1]
        x += dt * u
    path.append((0.0, C * u))
    positions, forces = zip(*path, strict=True)
    expected = u * u - 1.0 + 2.0 * np.trapezoid(forces, positions)
    assert result["energy_residual"].item() == pytest.approx(expected, abs=1e-12)


def test_the_energy_residual_of_a_linear_spring_is_the_energy_that_the_scheme_adds() -> None:
    result = swept(e=1.0, steps_per_contact=[5, 10, 37], phase=[0.2, 0.5, 0.9, 1.0])
    np.testing.assert_allclose(result["energy_residual"], result["e_out"] ** 2 - 1.0, atol=1e-13)
    assert abs(result["energy_residual"]).max() > 1e-3
    # the error of the scheme, not that of the integration
    np.testing.assert_allclose(result["closed_form_error"], result["e_out"] - 1.0, atol=1e-13)


def test_contact_time_is_a_whole_number_of_steps() -> None:
    result = swept("tsuji-1992", e=0.5, dt=["2 us", "5 us"], phase=[0.5, 1.0])
    np.testing.assert_allclose(result["contact_time"], result["steps"] * result["dt"], rtol=1e-12)


@pytest.mark.parametrize(
    ("how", "step"),
    [
        ({"jobs": 2}, {"dt": ["2 us", "5 us"]}),
        ({"threads": 2}, {"steps_per_contact": [9.0, 30.0]}),
        ({"overrides": ["solver.collapse=false"]}, {"steps_per_contact": [9.0, 30.0]}),
        ({"overrides": ["solver.collapse=false"]}, {"dt": ["2 us", "5 us"]}),
    ],
)
def test_the_bits_are_the_same_with_processes_threads_and_without_collapse(
    step: dict[str, list[Any]], how: dict[str, Any]
) -> None:
    sweep = BALLS | {"e": [0.3, 0.8], "phase": [0.2, 0.5, 1.0]} | step
    config = {"models": LAWS[:4], "solver": {"integrator": "kick-drift"}, "sweep": sweep}
    assert_same_bits(impact.sweep(config, **how), impact.sweep(config))


def test_only_distinct_problems_are_integrated(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "c.toml").write_text(TOML, encoding="utf-8")
    counts = json.loads(cli("sweep", "c.toml", "-o", "r.h5", "--json", "--quiet", cwd=tmp_path).stdout)
    # neither law depends on the speed, since the step is a part of the contact time
    assert (counts["points"], counts["trajectories"]) == (48, 24)
    dry = cli("sweep", "c.toml", "--dry-run", cwd=tmp_path)
    assert "e, steps_per_contact, phase" in dry.stdout


def test_shards_extend_and_the_factored_layout_give_the_same_file(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "c.toml").write_text(TOML, encoding="utf-8")

    def run(*words: str) -> None:
        done = cli(*words, cwd=tmp_path)
        assert done.returncode == 0, done.stderr

    run("sweep", "c.toml", "-o", "whole.h5")
    for shard in ("1/2", "2/2"):
        run("sweep", "c.toml", "-o", "merged.h5", "--shard", shard)
    run("merge", "merged.h5.1-of-2.work", "merged.h5.2-of-2.work", "-o", "merged.h5")
    assert (tmp_path / "merged.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()
    for layout in ("full", "factored"):
        words = ("--set", f'output.layout="{layout}"')
        run("sweep", "c.toml", "-o", f"part-{layout}.h5", *words, "--set", "sweep.phase=[0.25, 1.0]")
        wanted = "sweep.phase=[0.25, 0.5, 1.0]"
        run("extend", f"part-{layout}.h5", "-o", f"extended-{layout}.h5", "--set", wanted)
        run("compare", f"extended-{layout}.h5", "whole.h5", "--tol", "1e-300")
    run("expand", "extended-factored.h5", "-o", "expanded.h5")
    assert_same_bits(impact.load(tmp_path / "expanded.h5"), impact.load(tmp_path / "whole.h5"))
    run("rerun", "whole.h5")


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_a_killed_sweep_is_resumed_byte_for_byte(tmp_path: Path, cli: Run) -> None:
    phases = "sweep.phase={ arange = [0.00001, 1, 0.000015] }"
    words = ["c.toml", "--set", phases, "--set", "sweep.steps_per_contact=60", "--set", "sweep.v1=1.0"]
    (tmp_path / "c.toml").write_text(TOML, encoding="utf-8")
    command = [sys.executable, "-m", "impact", "sweep", *words, "-o", "killed.h5"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not (tmp_path / "killed.h5.work" / "00000000.npz").exists():
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
    assert not (tmp_path / "killed.h5").exists()
    resumed = cli("sweep", *words, "-o", "killed.h5", "--resume", cwd=tmp_path)
    whole = cli("sweep", *words, "-o", "whole.h5", cwd=tmp_path)
    assert (resumed.returncode, whole.returncode) == (0, 0), resumed.stderr
    assert (tmp_path / "killed.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()


def test_the_step_of_a_given_dt_depends_on_the_contact() -> None:
    result = swept(e=0.5, dt=2e-6, m1=[1.0, 4.0], K=1e9, n=1.0)
    times = result["contact_time"].values[0]
    assert times[1] / times[0] == pytest.approx(np.sqrt(0.8 / 0.5), rel=0.02)
    assert result["steps"].values[0, 0] < result["steps"].values[0, 1]


def test_steps_and_phases_may_be_zipped_be_cases_and_have_units(tmp_path: Path) -> None:
    zipped = swept(e=0.5, steps_per_contact=[10, 20], phase=[0.5, 1.0], zip=[["steps_per_contact", "phase"]])
    cases = swept(e=0.5, cases={"steps_per_contact": [10, 20], "phase": [0.5, 1.0]})
    assert zipped["e_out"].dims == ("model", "steps_per_contact")
    np.testing.assert_array_equal(zipped["e_out"].values, cases["e_out"].values)
    (tmp_path / "steps.csv").write_text("dt [us],phase [%]\n2,50\n4,100\n", encoding="utf-8")
    (tmp_path / "c.toml").write_text(
        TOML.replace("steps_per_contact = [8, 20]\nphase = [0.25, 0.5, 1.0]", 'cases = "steps.csv"'),
        encoding="utf-8",
    )
    from_file = impact.sweep(tmp_path / "c.toml")
    assert from_file["dt"].values.tolist() == [2e-6, 4e-6]
    assert from_file["phase"].values.tolist() == [0.5, 1.0]


def test_the_default_phase_is_half_a_step() -> None:
    default, half = swept(e=0.5, steps_per_contact=10), swept(e=0.5, steps_per_contact=10, phase=0.5)
    assert default["phase"] == 0.5
    assert default["e_out"].item() == half["e_out"].item()


@pytest.mark.parametrize(
    ("solver", "sweep", "message"),
    [
        (
            {},
            {"steps_per_contact": 10},
            'sweep.steps_per_contact: set with solver.integrator = "exact", which has',
        ),
        ({}, {"dt": 1e-6}, 'expected solver.integrator = "kick-drift" as well'),
        ({}, {"phase": 0.5}, 'sweep.phase: set with solver.integrator = "exact"'),
        ({"integrator": "kick-drift"}, {}, "sweep.steps_per_contact: missing, expected a number > 0"),
        ({"integrator": "kick-drift"}, {"dt": 1, "steps_per_contact": 9}, "sweep.dt: set together with steps_per"),
        (
            {"integrator": "kick-drfit"},
            {"dt": 1},
            'got "kick-drfit", expected an integrator; did you mean "kick-d',
        ),
        ({"integrator": 3}, {"dt": 1}, "solver.integrator: got 3, expected the name of an integrator"),
        ({"integrator": "kick-drift"}, {"dt": 0}, "sweep.dt: got 0, expected a number > 0 s"),
        ({"integrator": "kick-drift"}, {"dt": "1 m"}, 'sweep.dt: got "1 m", expected a unit of s, such as "1 s"'),
        (
            {"integrator": "kick-drift"},
            {"dt": 1, "phase": 0},
            "sweep.phase: got 0, expected a number > 0 and <= 1",
        ),
        ({"integrator": "kick-drift"}, {"dt": 1, "phase": [0.5, 1.1]}, "sweep.phase[1]: got 1.1, expected"),
        ({"integrator": "kick-drift"}, {"steps_per_contact": 131073}, "expected a number > 0 and <= 131072"),
        ({"integrator": "kick-drift"}, {"step_per_contact": 9}, 'did you mean "steps_per_contact"?'),
    ],
)
def test_messages(solver: dict[str, Any], sweep: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(message)):
        impact.sweep({"models": LINEAR, "solver": solver, "sweep": BALLS | {"e": 0.5} | sweep})


def test_a_message_names_the_line_of_the_file(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "c.toml").write_text(TOML.replace('integrator = "kick-drift"', ""), encoding="utf-8")
    done = cli("sweep", "c.toml", cwd=tmp_path)
    assert done.returncode == 2
    lines = [line.split(": ")[:2] for line in done.stderr.splitlines()]
    assert lines == [["c.toml:9", "sweep.steps_per_contact"], ["c.toml:10", "sweep.phase"]]


def statuses(result: xr.Dataset) -> list[Status]:
    """The statuses of a result; failed points have no values."""
    for name in ("e_out", "v1_post", "contact_time", "energy_residual", "peak_force"):
        assert np.isnan(result[name].values[result["status"].values >= Status.NOT_SEPARATED]).all()
    return [Status(status) for status in result["status"].values.ravel().tolist()]


def test_a_step_that_is_too_long_is_unstable() -> None:
    # the frequency is 1/s: a mass of 1 kg against a wall, a spring of 1 N/m
    wall = {"e": 1.0, "m2": np.inf, "K": 1.0, "n": 1.0}
    stable = swept(**wall, dt=np.linspace(0.01, np.sqrt(3.0), 60).tolist(), phase=[0.01, 0.5, 1.0])
    assert {*statuses(stable)} == {Status.OK}
    h = stable["dt"]
    assert (stable["e_out"] <= 1.0 / np.sqrt(1.0 - h * h / 4.0) + 1e-12).all()
    assert statuses(swept(**wall, dt=4.0)) == [Status.UNSTABLE]


def test_balls_that_never_separate_have_that_status() -> None:
    # ten times the critical damping, and no rebound of the continuous law
    sweep = {"m2": np.inf, "K": 1.0, "n": 1.0, "model": {"kelvin-voigt": {"C": 20.0}}}
    assert statuses(swept("kelvin-voigt", dt=0.02, **sweep)) == [Status.NOT_SEPARATED]
    assert statuses(swept("kelvin-voigt", steps_per_contact=20, **sweep)) == [Status.NOT_SEPARATED]


def test_a_contact_much_longer_than_that_of_a_spring_k_is_integrated_to_its_end() -> None:
    soft = new_law("soft", lambda K, x: 1e-5 * K * x, exponent=1.0)
    config: dict[str, Any] = {"models": "soft", "sweep": BALLS | {"K": 1.0, "n": 1.0}}
    exact = impact.sweep(config, plugins=[soft])
    config["sweep"]["dt"] = 1.0
    config["solver"] = {"integrator": "kick-drift"}
    fixed = impact.sweep(config, plugins=[soft])
    assert statuses(fixed) == [Status.OK]
    # 50 contact times of a spring of stiffness K are 111 s
    assert fixed["contact_time"].item() > 600.0
    assert fixed["contact_time"].item() == pytest.approx(exact["contact_time"].item(), abs=2.0)


def test_too_many_steps_have_that_status() -> None:
    assert statuses(swept(e=0.5, dt="1 ns")) == [Status.MAX_STEPS]
    assert statuses(swept(e=0.5, steps_per_contact=MAX_STEPS_PER_CONTACT)) == [Status.MAX_STEPS]
    assert statuses(swept(e=0.5, steps_per_contact=200, solver={"max_steps": 150})) == [Status.MAX_STEPS]


def test_other_failures_keep_their_status() -> None:
    # infinite damping at e = 0; balls that do not approach; e = 1 - alpha v0 below 0
    assert statuses(swept("flores-2011", e=0.0, dt="1 us")) == [Status.NOT_FINITE]
    assert statuses(swept(e=0.0, steps_per_contact=10)) == [Status.NOT_SEPARATED]
    assert statuses(swept(e=0.5, v1=-1.0, steps_per_contact=10)) == [Status.NO_IMPACT]
    assert statuses(swept(alpha=2.0, steps_per_contact=10)) == [Status.INVALID_PARAMETER]


def test_a_force_that_raises_fails_alone() -> None:
    def force(x: Any, v: Any, c: Any) -> Any:
        if (c > 1.5).any():
            raise ValueError("c is too large")
        return x + c * v

    parameters = (impact.Parameter("c", "1", "damping", default=0.1),)
    law = new_law("raises", force, exponent=1.0, release="force", parameters=parameters)
    config = {
        "models": "raises",
        "solver": {"integrator": "kick-drift"},
        "sweep": BALLS | {"K": 1e6, "n": 1.0, "dt": "50 us"},
        "model": {"raises": {"c": [0.1, 2.0, 0.2]}},
    }
    with pytest.warns(UserWarning, match="c is too large"):
        result = impact.sweep(config, plugins=[law])
    assert statuses(result) == [Status.OK, Status.MODEL_ERROR, Status.OK]


def test_a_single_impact_has_the_values_of_the_sweep_and_no_history(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "c.toml").write_text(TOML, encoding="utf-8")
    at = {"e": 0.9, "v1": 1.0, "steps_per_contact": 20.0, "phase": 0.25}
    single = impact.run(tmp_path / "c.toml", at=at)
    assert single.values["e_out"] == impact.sweep(tmp_path / "c.toml")["e_out"].isel(model=0).sel(at).item()
    assert single.history is None
    # the result is that of a scheme, not of the law, and says so
    assert single.rows()["integrator"].startswith("kick-drift ")
    assert "integrator" not in impact.run().rows()
    assert (single.e_kinetic, single.e_energetic) == (single.values["e_kinetic"], single.values["e_energetic"])
    done = cli("run", "c.toml", "--history", "h.h5", cwd=tmp_path)
    assert done.returncode == 2
    assert 'no history to store: integrator = "kick-drift" has no history' in done.stderr
    with pytest.raises(UsageError, match='no motion to draw in this result: integrator = "kick-drift"'):
        impact.plot(impact.sweep(tmp_path / "c.toml"), kind="loop")


def test_values_of_at_may_complete_a_config() -> None:
    fixed = ["solver.integrator='kick-drift'"]
    assert impact.run(at={"steps_per_contact": 10.0}, overrides=fixed).values["steps"] == 10
    with pytest.raises(UsageError, match='no input "step_per_contact" here; did you mean "steps_per_contact"'):
        impact.run(at={"step_per_contact": 10.0}, overrides=fixed)
    with pytest.raises(ConfigError, match=r'at\["dt"\]: sweep\.dt: set together with steps_per_contact'):
        impact.run(at={"steps_per_contact": 10.0, "dt": 1e-6}, overrides=fixed)


def test_solve_finds_the_e_to_ask_for() -> None:
    fixed = ["solver.integrator='kick-drift'"]
    asked = impact.solve(
        LINEAR, "e", {"e_out": 0.5}, at={"steps_per_contact": 20.0, "phase": 0.3}, overrides=fixed
    )
    # where e changes the number of steps, e_out jumps: there may be several
    values = [root.value for root in asked.roots]
    assert 0.5 not in values
    delivered = swept(e=values, steps_per_contact=20, phase=0.3)["e_out"].values
    np.testing.assert_allclose(delivered, 0.5, atol=1e-6)


def test_compare_notes_another_integrator_and_recommend_ranks() -> None:
    exact, fixed = swept(e=0.5, integrator="exact"), swept(e=0.5, steps_per_contact=10)
    verdict = impact.compare(fixed, exact)
    assert not verdict.equal
    assert "integrator is kick-drift, in BASELINE exact" in verdict.notes
    (ranked,) = impact.recommend(swept(e=[0.5, 0.9], steps_per_contact=[10, 50]), tol=0.05).models
    assert ranked.serves_everywhere


@pytest.fixture(scope="module")
def coarse() -> xr.Dataset:
    """Two laws at two values of e, over steps and phases."""
    return swept([LINEAR, "hertz"], e=[0.5, 0.9], steps_per_contact=[5, 10, 20, 50], phase=[0.1, 0.4, 0.7, 1.0])


def curves_of(dataset: xr.Dataset, **choice: Any) -> tuple[Curve, ...]:
    curve_data = get_plot_data(dataset, "timestep", Choice(**choice))
    assert isinstance(curve_data, CurveData)
    (panel,) = curve_data.panels
    assert panel.x_log
    return panel.curves


def test_the_picture_has_the_mean_and_the_range_over_the_phase(coarse: xr.Dataset) -> None:
    half, nine, *delivered = curves_of(coarse)
    assert [(guide.case, set(guide.y), guide.is_guide) for guide in (half, nine)] == [
        ("e = 0.5", {0.5}, True),
        ("e = 0.9", {0.9}, True),
    ]
    # hertz does not depend on e
    assert [(curve.model, curve.case) for curve in delivered] == [
        (LINEAR, "e = 0.5"),
        (LINEAR, "e = 0.9"),
        ("hertz", ""),
    ]
    for curve, e in zip(delivered, (0.5, 0.9, 0.5), strict=True):
        values = coarse["e_out"].sel(model=curve.model, e=e)
        assert curve.x == (5.0, 10.0, 20.0, 50.0)
        np.testing.assert_allclose(curve.y, values.mean("phase"), rtol=1e-14)
        np.testing.assert_array_equal(curve.least, values.min("phase"))
        np.testing.assert_array_equal(curve.largest, values.max("phase"))


def test_the_picture_over_dt_at_one_phase_has_no_band() -> None:
    guide, curve = curves_of(swept(e=0.5, dt=["5 us", "2 us"]))
    assert (guide.case, curve.x, curve.least) == ("e = 0.5", (2e-6, 5e-6), ())


@pytest.mark.parametrize("width", ["single", "double"])
def test_the_texts_of_the_picture_do_not_overlap(coarse: xr.Dataset, width: str) -> None:
    figure = impact.plot(coarse, kind="timestep", width=width)
    check_layout(figure)
    names = ["Requested", "Anagnostopoulos (1988)", "Hertz (1882)", "Least to largest over the phase"]
    assert names_of(figure) == names
    near = impact.plot(swept(e=[0.5, 0.51, 0.52], steps_per_contact=[5, 20]), kind="timestep", width=width)
    check_layout(near)


def test_the_numbers_of_the_picture_have_the_range(coarse: xr.Dataset, tmp_path: Path, cli: Run) -> None:
    impact.save(coarse, tmp_path / "r.h5")
    done = cli("plot", "r.h5", "--kind", "timestep", "--data", "wide.csv", "-o", "r.svg", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    head, first, *_ = (tmp_path / "wide.csv").read_text(encoding="utf-8").splitlines()
    assert head.split(",")[3:6] == [f"e_out{part} {LINEAR} e=0.5" for part in ("", "_least", "_largest")]
    assert float(first.split(",")[4]) == coarse["e_out"].sel(model=LINEAR, e=0.5, steps_per_contact=5).min()
    assert len(get_plot_data(coarse, "timestep", Choice()).long_table()) == 4 * (2 + 3 * 3)


@pytest.mark.parametrize(
    ("sweep", "message"),
    [
        (
            {"integrator": "exact"},
            "this result is of the continuous law; timestep needs an axis steps_per_contact",
        ),
        ({"dt": 1e-6}, "this result has a single step; timestep needs an axis steps_per_contact or dt"),
        ({"dt": [1e-6, 2e-6], "e": np.linspace(0.1, 0.9, 9).tolist()}, "got 9 values of e, expected at most 8"),
    ],
)
def test_a_result_without_the_axis_is_refused_in_one_line(sweep: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        impact.plot(swept(**{"e": 0.5} | sweep), kind="timestep")


def test_a_report_has_the_picture_and_no_loop(coarse: xr.Dataset) -> None:
    page = impact.report(coarse)
    assert "Restitution at fixed steps: mean, least and largest over the phase." in page
    assert "left out" not in page
    assert "Force over indentation" not in page


def test_the_page_shows_the_jump_over_the_phase() -> None:
    result = impact.sweep(
        ROOT / "docs" / "timestep.toml", overrides=["sweep.e=0.5", "sweep.steps_per_contact=[10.0, 20.0]"]
    )
    ten = result.isel(model=0).sel(steps_per_contact=10.0)
    assert (float(ten["e_out"].min()), float(ten["e_out"].max())) == pytest.approx((0.454, 0.542), abs=5e-4)
    late = ten["phase"].values > 0.59
    assert set(ten["steps"].values[late].tolist()) == {9}
    assert set(ten["steps"].values[~late].tolist()) == {10}
    page = (ROOT / "docs" / "timestep.md").read_text(encoding="utf-8")
    for picture in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page):
        assert (ROOT / "docs" / picture).is_file()


def test_the_attributes_of_the_continuous_law_are_unchanged() -> None:
    stored = impact.load(ROOT / "tests" / "data" / "figure6.h5")
    now = impact.sweep(ROOT / "configs" / "figure6.toml")
    assert now.attrs.keys() == stored.attrs.keys() - {"reason", "tolerances"}
    assert set(now.coords) == set(stored.coords)
    assert swept(e=0.5, dt=1e-6).attrs["integrator"] == "kick-drift"
