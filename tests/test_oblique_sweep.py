"""Sweeps of oblique impacts: what shares a trajectory, the same bits in any way to compute them, and balances."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import FrictionStatus, Status
from impact.engine.executors import choose_executor
from impact.engine.run import Run as SweepRun
from impact.errors import ConfigError, ImpactWarning, UnfinishedError
from impact.results.sweep import read_plan, sweep_into

from .conftest import Run, assert_same_bits

SPRING, DAMPED, SLIDING = "lammps-mindlin-rescale-force", "lammps-mindlin", "coulomb-1785"
# "lankarani-nikravesh-1994" has no dashpot of which DAMPED could take a part
CONFIG = f"""title = "Oblique"
models = ["tsuji-1992", "lankarani-nikravesh-1994"]
frictions = ["{SLIDING}", "{SPRING}", "{DAMPED}"]
[solver]
rtol = 1e-6
[sweep]
v1 = 1.0
v2 = -0.5
e = 0.8
m1 = 0.1
m2 = 0.25
R1 = 0.02
R2 = 0.03
K = 1e8
angle = ["0 deg", "20 deg", "50 deg", "80 deg"]
omega1 = ["-300 rad/s", "0 rad/s", "100 rad/s"]
omega2 = 20.0
inertia_factor2 = 0.6
mu = [0.0, 0.3]
[friction.{SPRING}]
xt = 0.0
kt_over_kn = 0.8
[friction.{DAMPED}]
xt = 0.5
kt_over_kn = 0.8
"""
LAYOUTS = ("full", "factored")
# both write the same trajectories; the layout of all values takes longer
EACH_LAYOUT = pytest.mark.parametrize("layout", [pytest.param("full", marks=pytest.mark.slow), "factored"])
BLOCKS = 8
SPRING_VALUES, DAMPED_VALUES = ("{ xt = 0.0, kt_over_kn = 0.8 }", "{ xt = 0.5, kt_over_kn = 0.8 }")


def with_layout(layout: str) -> list[str]:
    return [f'output.layout="{layout}"']


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the config, and its sweeps as full.h5 and factored.h5."""
    folder = tmp_path_factory.mktemp("oblique")
    (folder / "c.toml").write_text(CONFIG, encoding="utf-8")
    for layout in LAYOUTS:
        impact.sweep_to_file(folder / "c.toml", folder / f"{layout}.h5", overrides=with_layout(layout))
    return folder


@pytest.fixture(scope="module")
def whole(folder: Path) -> xr.Dataset:
    """The sweep of the config in one process."""
    return impact.sweep(folder / "c.toml")


def before(dataset: xr.Dataset) -> dict[str, xr.DataArray]:
    """The tangential motion before the impact."""
    zero = xr.zeros_like(dataset.u1_post).fillna(0.0)
    return {
        "u1": zero + 1.5 * np.tan(dataset.angle),
        "u2": zero,
        "omega1": zero + dataset.omega1,
        "omega2": zero + 20.0,
    }


# ---- what shares a trajectory


def trajectories(source: Mapping[str, object]) -> dict[str, int]:
    """The numbers of trajectories of the models and pairs that a sweep would integrate."""
    return {counts.model: counts.trajectories for counts in impact.estimate(source).models}


def oblique(**sweep: object) -> dict[str, object]:
    """A sweep of a contact force and two friction laws, none of which has a scale of velocity."""
    balls = {"e": 0.8, "m1": 0.1, "m2": 0.2, "R1": 0.01, "R2": 0.01, "K": 1e8}
    return {
        "models": ["tsuji-1992"],
        "frictions": [SLIDING, SPRING],
        "sweep": {**balls, **sweep},
        "friction": {SPRING: {"xt": 0.0, "kt_over_kn": 0.8}},
    }


@pytest.mark.slow
def test_a_million_points_need_a_trajectory_for_each_scaled_slip() -> None:
    source = oblique(
        v1={"linspace": [1.0, 3.0, 1000]},
        angle={"linspace": ["1 deg", "85 deg", 100]},
        mu={"linspace": [0.05, 0.5, 10]},
    )
    estimated = impact.estimate(source)
    assert estimated.points == 1_000_000
    assert trajectories(source) == {
        "tsuji-1992": 1,
        f"tsuji-1992 with {SLIDING}": 1,
        f"tsuji-1992 with {SPRING}": 1000,
    }


@pytest.mark.slow
def test_slips_of_both_directions_and_by_any_input_share_a_trajectory() -> None:
    # slips by spin, in units of R1 times 40 rad/s, over mu: 0, 1, 2, 4 and 0, 1/2, 1, 2
    source = oblique(v1=1.0, omega1=[-40.0, 0.0, 40.0, 80.0, -160.0], omega2=0.0, mu=[0.25, 0.5])
    assert trajectories(source)[f"tsuji-1992 with {SPRING}"] == len({0.0, 0.5, 1.0, 2.0, 4.0})
    # all impacts without friction are one
    source = oblique(v1=1.0, omega1=[-40.0, 40.0, 80.0], mu=[0.0, 0.5])
    assert trajectories(source)[f"tsuji-1992 with {SPRING}"] == len({np.inf, 1.0, 2.0})


@pytest.mark.slow
def test_angle_mu_and_spin_over_one_speed_need_one_normal_trajectory() -> None:
    angles, mu, spins = 17, 5, 3
    axes = {
        "angle": {"linspace": ["1 deg", "85 deg", angles]},
        "mu": {"linspace": [0.05, 0.5, mu]},
        "omega1": {"linspace": [0.0, 200.0, spins]},
    }
    assert trajectories(oblique(v1=1.0, **axes)) == {
        "tsuji-1992": 1,
        f"tsuji-1992 with {SLIDING}": 1,
        f"tsuji-1992 with {SPRING}": angles * mu * spins,
    }


@pytest.mark.slow
def test_a_law_that_depends_on_the_speed_has_a_trajectory_for_each_angle_of_a_resultant() -> None:
    source = oblique(speed=2.0, angle={"linspace": ["10 deg", "60 deg", 6]}, mu=[0.1, 0.2, 0.3])
    source |= {"models": ["kuwabara-kono-1987"], "model": {"kuwabara-kono-1987": {"A": 1e-6}}}
    assert trajectories(source) == {
        "kuwabara-kono-1987": 6,
        f"kuwabara-kono-1987 with {SLIDING}": 6,
        f"kuwabara-kono-1987 with {SPRING}": 6 * 3,
    }


# the first two impacts have a wall, the third a second ball
WALLS = {"m1": 0.1, "m2": [np.inf, np.inf, 0.2], "K": [1e8, 2e8, 3e8], "zip": [["m2", "K"]]}


@pytest.mark.parametrize(
    "axes",
    [
        {"R2": [0.01, 0.02, np.inf]},
        {"cases": {"inertia_factor2": [0.4, 0.4, 0.6]}},
        {"R2": np.inf, **WALLS},
        {"inertia_factor2": 0.6, **WALLS},
    ],
    ids=["a plane", "a shell", "a plane after walls", "a shell after walls"],
)
def test_masses_that_matter_for_some_balls_alone_have_trajectories_of_their_own(axes: dict[str, object]) -> None:
    # where both balls have one factor of inertia, m_t/m is 2/7 for all masses
    source = oblique(v1=1.0, u1=0.5, mu=0.3, **{"m1": [0.1, 0.2, 0.5], **axes})
    each = impact.sweep(source, overrides={"solver.collapse": False})
    assert np.nanmax(np.abs(each.friction_residual)) < 1e-8
    assert_same_bits(impact.sweep(source), each)
    factored = {"output.layout": "factored", "output.variables": ["beta"]}
    assert_same_bits(impact.sweep(source, overrides=factored), each[["beta"]])


# ---- the same bits, in any way


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_both_layouts_have_the_bits_of_the_sweep(folder: Path, whole: xr.Dataset, layout: str) -> None:
    assert_same_bits(impact.load(folder / f"{layout}.h5"), whole)


@pytest.mark.slow
@EACH_LAYOUT
def test_merged_shards_have_the_bytes_of_the_whole_sweep(folder: Path, layout: str, tmp_path: Path) -> None:
    output = tmp_path / "results.h5"
    shards = [
        impact.sweep_shard(folder / "c.toml", f"{number}/3", output, overrides=with_layout(layout))
        for number in (3, 1, 2)
    ]
    assert sum(shard.blocks for shard in shards) == BLOCKS
    impact.merge([shard.folder for shard in shards], output)
    assert output.read_bytes() == (folder / f"{layout}.h5").read_bytes()


@pytest.mark.slow
@EACH_LAYOUT
def test_a_resumed_sweep_has_the_bytes_of_the_whole_sweep(
    folder: Path, layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # else a small sweep keeps nothing
    monkeypatch.setattr("impact.results.sweep.RANGE_TRAJECTORIES", 1)
    plan, output = read_plan(folder / "c.toml", with_layout(layout)), tmp_path / "results.h5"
    with pytest.raises(UnfinishedError, match="trajectories are kept"):
        sweep_into(output, plan, SweepRun(should_stop=lambda: any(tmp_path.glob("results.h5.work/*.npz"))))
    assert 0 < len(list(tmp_path.glob("results.h5.work/*.npz"))) < BLOCKS
    sweep_into(output, plan, SweepRun(resume=True))
    assert output.read_bytes() == (folder / f"{layout}.h5").read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS)
def test_two_processes_write_the_bytes_of_one(folder: Path, layout: str, tmp_path: Path) -> None:
    plan = read_plan(folder / "c.toml", with_layout(layout))
    sweep_into(tmp_path / "results.h5", plan, SweepRun(choose_executor(jobs=2)))
    assert (tmp_path / "results.h5").read_bytes() == (folder / f"{layout}.h5").read_bytes()


EXTENSIONS = {
    "angle": (['sweep.angle=["0 deg", "50 deg"]'], ['sweep.angle=["0 deg", "20 deg", "50 deg", "80 deg"]']),
    "mu": (["sweep.mu=[0.3]"], ["sweep.mu=[0.0, 0.3]"]),
    "model": (["models=['lankarani-nikravesh-1994']"], ["models=['tsuji-1992', 'lankarani-nikravesh-1994']"]),
    "friction": (
        [f"frictions=['{SLIDING}', '{DAMPED}']", f"friction={{ {DAMPED} = {DAMPED_VALUES} }}"],
        [f"frictions=['{SLIDING}', '{SPRING}', '{DAMPED}']", f"friction.{SPRING}={SPRING_VALUES}"],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_an_extended_result_has_the_bits_of_the_whole_sweep(
    folder: Path, whole: xr.Dataset, layout: str, extension: str, tmp_path: Path
) -> None:
    of_base, added = EXTENSIONS[extension]
    path = tmp_path / "results.h5"
    impact.sweep_to_file(folder / "c.toml", path, overrides=[*of_base, *with_layout(layout)])
    extended = impact.extend(path, added, overwrite=True)
    assert_same_bits(extended.sel(model=whole.model, friction=whole.friction), whole)


@pytest.mark.slow
def test_impacts_alone_have_the_bits_of_the_sweep(folder: Path, whole: xr.Dataset) -> None:
    overrides = ['sweep.angle="50 deg"', "sweep.omega1=100.0", "sweep.mu=0.3", f"frictions=['{SPRING}']"]
    overrides.append(f"friction={{ {SPRING} = {SPRING_VALUES} }}")
    alone = impact.sweep(folder / "c.toml", overrides=overrides)
    point = whole.sel(friction=[SPRING], mu=0.3, omega1=100.0).isel(angle=2)
    assert_same_bits(alone, point)


# ---- what is stored


def test_without_friction_nothing_changes_but_what_central_impact_changes(whole: xr.Dataset) -> None:
    smooth = whole.sel(mu=0.0)
    ok = (smooth.friction_status == FrictionStatus.OK).values
    assert ok.sum() == 5 * 12
    for name, expected in {"beta": -1.0, "friction_loss": 0.0, "impulse_ratio": 0.0}.items():
        np.testing.assert_array_equal(smooth[name].values[ok], expected, err_msg=name)
    for name, values in before(smooth).items():
        np.testing.assert_array_equal(smooth[f"{name}_post"].values[ok], values.values[ok], err_msg=name)


def test_friction_leaves_the_central_impact_as_it_is(folder: Path, whole: xr.Dataset) -> None:
    central = {"models": ["tsuji-1992", "lankarani-nikravesh-1994"], "solver": {"rtol": 1e-6}}
    sweep = {"v1": 1.0, "v2": -0.5, "e": 0.8, "m1": 0.1, "m2": 0.25, "R1": 0.02, "R2": 0.03, "K": 1e8}
    expected = impact.sweep({**central, "sweep": sweep})
    chosen = whole.isel(angle=1, omega1=2, mu=1)
    assert_same_bits(chosen, expected.drop_vars([name for name in expected.data_vars if name not in chosen]))
    assert set(expected.data_vars) <= set(chosen.data_vars)
    assert all("friction" not in whole[name].dims for name in expected.data_vars)


def test_momentum_and_angular_momentum_are_kept(whole: xr.Dataset) -> None:
    start = before(whole)
    ok = whole.friction_status.isin([FrictionStatus.OK, FrictionStatus.SLOW_LIMIT]).values
    assert ok.sum() == 5 * 24
    masses = {"u1": 0.1, "u2": 0.25}
    # about the point of contact the impulse has no moment: each ball keeps its angular momentum
    spins = {
        number: {f"u{number}": side, f"omega{number}": -q * radius}
        for number, side, q, radius in ((1, 1.0, 0.4, 0.02), (2, -1.0, 0.6, 0.03))
    }
    for terms in (masses, *spins.values()):
        change, size = 0.0, 0.0
        for name, factor in terms.items():
            after = whole[f"{name}_post"]
            change = change + factor * (after - start[name])
            size = np.fmax(size, abs(factor) * np.fmax(abs(after), abs(start[name])))
        assert (abs(change) <= 1e-14 * size).values[ok].all(), terms
    # friction does move them
    moves = abs(whole.u1_post - start["u1"]) > 1e-3
    assert moves.values[ok].sum() == 5 * 12


def test_a_sweep_says_what_a_slow_limit_is(cli: Run, tmp_path: Path) -> None:
    inputs = (
        "e=0.8",
        "speed=1",
        'angle=["10 deg", "60 deg"]',
        "mu=0.3",
        "m1=1",
        "m2=1",
        "R1=0.01",
        "R2=0.01",
        "K=1e9",
    )
    settings = ['models=["tsuji-1992"]', 'frictions=["lammps-mindlin"]', "friction.lammps-mindlin.kt_over_kn=0.8"]
    settings += [f"sweep.{setting}" for setting in inputs]
    (tmp_path / "config.toml").write_text("[sweep]\n")
    overrides = [word for setting in settings for word in ("--set", setting)]
    done = cli("sweep", "config.toml", "-o", "result.h5", *overrides, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "slow_limit: the limit of small steps, which a code with fixed steps reaches slowly" in done.stderr


@pytest.mark.slow
def test_pairs_that_cannot_be_combined_are_marked_and_named(folder: Path, whole: xr.Dataset) -> None:
    marked = whole.friction_status == FrictionStatus.NOT_COMBINABLE
    expected = ((whole.model == "lankarani-nikravesh-1994") & (whole.friction == DAMPED)).broadcast_like(marked)
    np.testing.assert_array_equal(marked, expected)
    for name in ("beta", "u1_post", "omega2_post"):
        np.testing.assert_array_equal(np.isnan(whole[name]), expected, err_msg=name)
    assert (whole.status == 1).all()
    notes: list[str] = []
    impact.sweep_to_file(folder / "c.toml", folder / "notes.h5", on_note=notes.append)
    assert len(notes) == 1
    assert f"lankarani-nikravesh-1994 with {DAMPED}" in notes[0]
    alone = [
        "models=['lankarani-nikravesh-1994']",
        f"frictions=['{DAMPED}']",
        f"friction={{ {DAMPED} = {DAMPED_VALUES} }}",
    ]
    with pytest.raises(ConfigError, match=f"lankarani-nikravesh-1994 with {DAMPED}"):
        impact.sweep(folder / "c.toml", overrides=alone)


@pytest.mark.parametrize("gamma", [[0.1, 0.2, 0.0], [0.0, 0.0, 0.1]])
def test_a_pair_that_adhesion_excludes_at_some_points_is_named_and_not_refused(gamma: list[float]) -> None:
    source = {
        "models": ["jkr-1971"],
        "frictions": [SLIDING],
        "materials": {"soft": {"E": 1e7, "nu": 0.3}},
        "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "R1": 0.1, "R2": 0.1, "material": "soft", "u1": 0.5, "mu": 0.3}
        | {"cases": {"model.jkr-1971.gamma": gamma}},
    }
    with pytest.warns(ImpactWarning, match="pulls from the start"):
        result = impact.sweep(source)
    expected = np.where(np.array(gamma) > 0.0, FrictionStatus.NOT_COMBINABLE, FrictionStatus.OK)
    np.testing.assert_array_equal(result.friction_status.values.ravel(), expected)


@pytest.mark.slow
@EACH_LAYOUT
def test_compare_reports_a_changed_restitution(cli: Run, folder: Path, layout: str, tmp_path: Path) -> None:
    same = cli("compare", folder / "full.h5", folder / f"{layout}.h5")
    assert same.returncode == 0, same.stdout
    changed = impact.load(folder / "full.h5").copy(deep=True)
    changed["beta"][{"model": 0, "friction": 1, "angle": 2, "omega1": 1, "mu": 1}] += 1e-3
    impact.save(changed, tmp_path / "changed.h5")
    done = cli("compare", tmp_path / "changed.h5", folder / f"{layout}.h5")
    assert done.returncode == 1
    assert "beta: 1 of 144 differ" in done.stdout
    assert f"model=tsuji-1992, friction={SPRING}, angle=" in done.stdout


def test_the_file_of_a_selected_friction_law_is_described(whole: xr.Dataset, tmp_path: Path) -> None:
    for name, friction in (("axis", [SPRING]), ("selected", SPRING)):
        impact.save(whole.sel(friction=friction), tmp_path / f"{name}.h5")
    of_axis, of_selected = (impact.info(tmp_path / f"{name}.h5").as_dict() for name in ("axis", "selected"))
    for key in ("points", "status", "friction_status"):
        assert of_selected[key] == of_axis[key]
    assert of_selected["variables"]["beta"]["largest"] == of_axis["variables"]["beta"]["largest"]


@pytest.mark.parametrize("friction", [SPRING, [SPRING]])
def test_a_rerun_repeats_the_friction_laws_of_the_file(
    whole: xr.Dataset, friction: str | list[str], tmp_path: Path
) -> None:
    impact.save(whole.sel(friction=friction), tmp_path / "part.h5")
    verdict = impact.rerun(tmp_path / "part.h5")
    assert verdict.equal, str(verdict)


def test_a_verdict_has_the_word_of_a_point_as_plain_data() -> None:
    source = {
        "models": ["hertz"],
        "frictions": ["coulomb-1785"],
        "sweep": {"v1": 1.0, "u1": 0.5, "mu": 0.2, "m1": 0.1, "m2": 0.2, "K": 1e8},
        "friction": {"coulomb-1785": {"limit": ["positive", "abs"]}},
    }
    new, baseline = impact.sweep(source), impact.sweep(source)
    new["beta"][{"friction.coulomb-1785.limit": 1}] += 1e-3
    (differs,) = (row for row in impact.compare(new, baseline).as_dict()["variables"] if not row["equal"])
    assert (differs["name"], differs["at"]["friction.coulomb-1785.limit"]) == ("beta", "abs")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::impact.ImpactWarning")
@pytest.mark.parametrize("extreme", [1e-170, 1e160])
def test_speeds_at_an_angle_are_checked_as_closing_speeds_are(extreme: float) -> None:
    balls = {"m1": 1.0, "m2": 1.0, "K": 1e9, "e": 0.5, "mu": 0.3}
    config = {"models": "tsuji-1992", "frictions": SLIDING, "output": {"layout": "factored"}}
    angles = [0.0, 1.5]
    swept = impact.sweep(config | {"sweep": balls | {"speed": [1.0, extreme], "angle": angles}})
    for angle, at_angle in zip(angles, swept.transpose("angle", ...).status.values, strict=True):
        speeds = (np.array([1.0, extreme]) * np.cos(angle)).tolist()
        central = impact.sweep(config | {"sweep": balls | {"v1": speeds, "u1": 0.1}})
        assert set(at_angle.ravel()) == {Status.OK, Status.OUT_OF_RANGE}
        assert at_angle.ravel().tolist() == central.status.values.ravel().tolist()
