"""`impact extend` integrates only what is new and gives the result of a single sweep, in both layouts."""

from __future__ import annotations

import functools
import json
import os
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
import xarray as xr

import impact
from impact.contact.status import FrictionStatus
from impact.errors import ConfigError, ImpactError, ResultError, UsageError

from .conftest import Run, assert_same_bits

BASE = """
title = "Base"
models = ["gharib-hurmuzlu-2012", "hertz"]
[solver]
rtol = 1e-4
[sweep]
e = [0.3, 0.6]
v1 = [1.0, 2.0]
m1 = 1.0
m2 = 2.0
K = 1e9
"""
ZIPPED = BASE + 'zip = [["e", "v1"]]\n'
DASHPOT = """
models = ["kelvin-voigt", "gharib-hurmuzlu-2012"]
[solver]
rtol = 1e-4
[sweep]
e = [0.3, 0.6]
v1 = 1.0
m1 = [1.0, 2.0]
m2 = 2.0
material = "soft"
zip = [["m1", "R1"]]
R1 = [0.01, 0.02]
R2 = 0.01
[model.kelvin-voigt]
C = 10.0
[materials.soft]
E = 1e9
nu = 0.3
rho = 1000
"""
BALLS = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 1e6, "n": 1.5}
MINE = {"key": "mine-2026", "title": "Mine", "year": 2026, "equation": "", "reference": ""}
FULL, FACTORED = 'output.layout="full"', 'output.layout="factored"'
BOTH_LAYOUTS = pytest.mark.parametrize("layout", [FULL, FACTORED], ids=["full", "factored"])
# a copy of the stored result of a config with overrides, as r.h5 in the folder of the test
StoredSweep = Callable[..., Path]


@pytest.fixture(scope="module")
def swept_once(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The file of a sweep, which all tests of the module copy."""
    folder = tmp_path_factory.mktemp("extend")

    @functools.cache
    def path_of(config: str, *overrides: str) -> Path:
        path = folder / f"{path_of.cache_info().misses}.toml"
        path.write_text(config, encoding="utf-8")
        impact.sweep_to_file(path, path.with_suffix(".h5"), overrides=overrides)
        return path.with_suffix(".h5")

    return path_of


@pytest.fixture
def stored_sweep(swept_once: Callable[..., Path], tmp_path: Path) -> StoredSweep:
    def copy(config: str = BASE, *overrides: str) -> Path:
        return Path(shutil.copy(swept_once(config, *overrides), tmp_path / "r.h5"))

    return copy


def single_sweep(config: str, overrides: list[str], folder: Path) -> xr.Dataset:
    """The result of a sweep of a config with overrides, in memory."""
    (folder / "single.toml").write_text(config, encoding="utf-8")
    return impact.sweep(folder / "single.toml", overrides=overrides)


def assert_same_values(extended: xr.Dataset, single: xr.Dataset) -> None:
    """All variables and coordinates have the same bits, and both are of the same sweep."""
    assert {*extended.variables} == {*single.variables}
    assert_same_bits(extended, single, single.variables)
    for name in ("fingerprint", "config", "materials"):
        assert extended.attrs[name] == single.attrs[name]


# overrides, and how many trajectories are new where the file has the trajectory table, and where it has all values
EXTENSIONS = {
    "a scalar becomes an axis": (["sweep.m2=[2.0, 3.0]"], 0, 3),
    "new values alone": (["sweep.m2=[3.0]"], 0, 3),
    "an axis that a model depends on": (["sweep.e=[0.1, 0.3, 0.6]"], 1, 2),
    "values before, between and after": (["sweep.v1=[0.5, 1.0, 1.5, 2.0, 2.5]"], 0, 3),
    "two axes": (["sweep.e=[0.3, 0.9, 0.6]", "sweep.v1=[1.0, 4.0, 2.0]"], 1, 4),
    "a model": (['models=["gharib-hurmuzlu-2012", "hunt-crossley-1975", "hertz"]'], 2, 2),
    "a model, by its key alone": (['models="hunt-crossley-1975"'], 2, 2),
}


@pytest.mark.slow
def test_trajectories_that_failed_are_not_integrated_again(cli: Run, stored_sweep: StoredSweep) -> None:
    path = stored_sweep(BASE, FACTORED, "solver.max_steps=3", "solver.rtol=1e-10")
    assert not (impact.load(path)["status"] == 1).any()
    done = cli("extend", path, "--set", "sweep.m2=[2.0, 3.0]")
    assert "\n0 of 3 trajectories were integrated for it\n" in f"\n{done.stderr}"


@pytest.mark.slow
@BOTH_LAYOUTS
@pytest.mark.parametrize("extension", EXTENSIONS)
def test_an_extended_result_equals_a_single_sweep(
    stored_sweep: StoredSweep, tmp_path: Path, layout: str, extension: str
) -> None:
    overrides, *new_trajectories = EXTENSIONS[extension]
    outcome = impact.extend_to_file(stored_sweep(BASE, layout), overrides, output=tmp_path / "larger.h5")
    assert outcome.integrated == new_trajectories[layout == FULL]
    larger = impact.load(tmp_path / "larger.h5")
    assert_same_values(larger, single_sweep(BASE, json.loads(larger.attrs["config_set"]), tmp_path))
    assert json.loads(larger.attrs["extended"])[-1]["set"] == overrides


@pytest.mark.slow
@pytest.mark.parametrize(("before", "after"), [(FULL, FACTORED), (FACTORED, FULL)], ids=["factored", "full"])
def test_an_extended_result_may_have_another_layout(
    stored_sweep: StoredSweep, tmp_path: Path, before: str, after: str
) -> None:
    larger = impact.extend(stored_sweep(BASE, before), ["sweep.e=[0.1, 0.3, 0.6]", after])
    assert f'output.layout="{larger.encoding["layout"]}"' == after
    assert_same_values(larger, single_sweep(BASE, json.loads(larger.attrs["config_set"]), tmp_path))


@pytest.mark.slow
def test_the_command_prints_how_many_trajectories_are_new(cli: Run, stored_sweep: StoredSweep) -> None:
    # hertz depends on no axis: its trajectory is in the table, and is not in a file of values
    for layout, printed in (
        (FACTORED, "1 of 4 trajectories were integrated for it\n"),
        (FULL, "2 of 4 trajectories were integrated for it; layout full holds none of them\n"),
    ):
        path = stored_sweep(BASE, layout)
        done = cli("extend", path, "--set", "sweep.e=[0.1, 0.3, 0.6]")
        assert (done.returncode, done.stdout) == (0, "")
        assert f"\n{printed}" in f"\n{done.stderr}"
        assert dict(impact.load(path).sizes) == {"model": 2, "e": 3, "v1": 2}


@pytest.mark.slow
@BOTH_LAYOUTS
def test_axes_that_vary_together_are_extended_together(
    stored_sweep: StoredSweep, tmp_path: Path, layout: str
) -> None:
    more = ["sweep.m1=[1.0, 3.0, 2.0]", "sweep.R1=[0.01, 0.03, 0.02]"]
    larger = impact.extend(stored_sweep(DASHPOT, layout), more)
    assert_same_values(larger, single_sweep(DASHPOT, [layout, *more], tmp_path))


@pytest.mark.slow
def test_a_property_of_a_material_with_a_dot_in_its_name_is_extended(
    stored_sweep: StoredSweep, tmp_path: Path
) -> None:
    config = DASHPOT.replace("soft", "steel.2").replace("[materials.steel.2]", '[materials."steel.2"]')
    larger = impact.extend(stored_sweep(config), ['materials."steel.2".E=[2e9]'])
    assert larger["materials.steel.2.E"].values.tolist() == [1e9, 2e9]
    assert_same_values(larger, single_sweep(config, json.loads(larger.attrs["config_set"]), tmp_path))


@pytest.mark.slow
def test_a_material_whose_property_was_an_axis_before_a_ball_had_it_is_added(
    stored_sweep: StoredSweep, tmp_path: Path
) -> None:
    config = DASHPOT + "[materials.hard]\nE = [2e9]\nnu = 0.3\nrho = 1000\n"
    more = ['sweep.material=["soft", "hard"]', "materials.hard.E=[2e9, 3e9]"]
    larger = impact.extend(stored_sweep(config), more)
    assert_same_values(larger, single_sweep(config, more, tmp_path))


@BOTH_LAYOUTS
def test_a_law_is_added_with_an_axis_of_its_own(stored_sweep: StoredSweep, tmp_path: Path, layout: str) -> None:
    more = ['models=["lee-herrmann-1993"]', "model.lee-herrmann-1993.gamma=[10, 20]"]
    larger = impact.extend(stored_sweep(BASE, layout), more)
    both = 'models=["gharib-hurmuzlu-2012", "hertz", "lee-herrmann-1993"]'
    assert_same_values(larger, single_sweep(BASE, [layout, both, more[1]], tmp_path))


@BOTH_LAYOUTS
def test_a_friction_law_is_added_to_the_laws_that_a_result_has(
    stored_sweep: StoredSweep, tmp_path: Path, layout: str
) -> None:
    config = f'frictions = "coulomb-1785"\n{BASE}angle = 0.5\nmu = [0.1, 0.3]\nR1 = 0.05\nR2 = 0.05\n'
    more = ['frictions=["coulomb-1785", "cundall-strack-1979"]', "friction.cundall-strack-1979.k_t=1e6"]
    larger = impact.extend(stored_sweep(config, layout), more)
    assert_same_values(larger, single_sweep(config, [layout, *more], tmp_path))


def test_values_of_a_parameter_that_is_a_word_are_added(stored_sweep: StoredSweep, tmp_path: Path) -> None:
    sliding = BASE.replace("K = 1e9", "K = 1e9\nu1 = 0.5\nmu = 0.3\nR1 = 0.1\nR2 = 0.1")
    config = sliding.replace("[solver]", 'frictions = ["coulomb-1785"]\n[solver]')
    larger = impact.extend(stored_sweep(config), ['friction.coulomb-1785.limit=["positive"]'])
    both = ['friction.coulomb-1785.limit=["abs", "positive"]']
    assert_same_values(larger, single_sweep(config, both, tmp_path))
    zipped = stored_sweep(
        config.replace("mu = 0.3", 'mu = [0.2, 0.3]\nzip = [["mu", "friction.coulomb-1785.limit"]]'), *both
    )
    less = ["sweep.mu=[0.5]", 'friction.coulomb-1785.limit=["abs"]']
    assert_refused(zipped, less, "leaves out mu=0.2, friction.coulomb-1785.limit=abs, expected all values")


@pytest.mark.parametrize("value", ["1e6", "[1e6]"])
def test_an_extension_does_not_set_a_parameter_that_a_law_did_without(
    stored_sweep: StoredSweep, value: str
) -> None:
    """The stiffness of the points of the result follows from the material."""
    overrides = [f"model.kelvin-voigt.K={value}", "sweep.e=[0.9]"]
    assert_refused(stored_sweep(DASHPOT), overrides, "changes kelvin-voigt.K, expected more values of an axis")


@pytest.mark.slow
def test_materials_are_extended_and_chosen_whatever_their_names(stored_sweep: StoredSweep, tmp_path: Path) -> None:
    hard = '[materials."a \\u007f \\"b\\""]\nE = 3e9\nnu = 0.3\nrho = 1000\n'
    config = DASHPOT + hard
    larger = impact.extend(stored_sweep(config), ['sweep.material=["a \\u007f \\"b\\""]'])
    assert larger["material"].values.tolist() == ["soft", 'a \x7f "b"']
    assert_same_values(larger, single_sweep(config, json.loads(larger.attrs["config_set"]), tmp_path))
    (tmp_path / "c.toml").write_text(config, encoding="utf-8")
    at = {"material": 'a \x7f "b"', "e": 0.6, "m1": 2.0, "R1": 0.02}
    point = impact.run(tmp_path / "c.toml", at=at).values
    assert point["contact_time"] == larger["contact_time"].sel(model="kelvin-voigt", e=0.6, m1=2.0)[1].item()


@pytest.mark.slow
def test_an_extension_replaces_the_result_and_can_be_extended_again(
    stored_sweep: StoredSweep, tmp_path: Path
) -> None:
    path = stored_sweep()
    first = impact.load(path)
    impact.extend(path, ["sweep.m2=[3.0]"])
    larger = impact.extend(path, ["sweep.m2=[4.0]"])
    assert larger["m2"].values.tolist() == [2.0, 3.0, 4.0]
    seals = [extension["seal"] for extension in json.loads(larger.attrs["extended"])]
    assert (seals[0], len(seals)) == (first.encoding["seal"], 2)
    assert impact.compare(larger.sel(m2=2.0), first, subset=True).equal
    assert impact.rerun(path).equal
    assert [child.name for child in tmp_path.iterdir()] == ["r.h5"]


def test_a_result_that_another_process_extended_meanwhile_is_not_replaced(stored_sweep: StoredSweep) -> None:
    path = stored_sweep(BASE)

    def extend_too(progress: impact.Progress) -> None:
        if impact.load(path).sizes["v1"] == 2:
            impact.extend(path, ["sweep.v1=[3.0]"])

    with pytest.raises(impact.InUseError, match=r"r\.h5: was changed while it was extended, and is not modified"):
        impact.extend_to_file(path, ["sweep.v1=[4.0]"], on_progress=extend_too)
    assert impact.load(path)["v1"].values.tolist() == [1.0, 2.0, 3.0]
    assert [other.name for other in path.parent.iterdir()] == ["r.h5"]


def test_of_extensions_at_the_same_time_none_that_succeeds_is_lost(stored_sweep: StoredSweep) -> None:
    path, kept = stored_sweep(BASE), {1.0, 2.0}

    def extend(speed: float) -> float | None:
        try:
            impact.extend_to_file(path, [f"sweep.v1=[{speed}]"])
        except impact.InUseError:
            return None
        return speed

    for round in range(4):
        with ThreadPoolExecutor() as pool:
            kept |= {*pool.map(extend, (3.0 + round + n / 4 for n in range(4)))} - {None}
        assert {*impact.load(path)["v1"].values.tolist()} == kept


def test_a_script_that_has_locked_the_folder_does_not_stop_a_command_in_it(cli: Run, tmp_path: Path) -> None:
    """As `flock FOLDER impact sweep ...` does."""
    fcntl = pytest.importorskip("fcntl")
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    cli("sweep", "configs/figure6.toml", "-o", tmp_path / "r.h5", "--set", "sweep.e=0.5")
    os.close(folder)
    assert impact.load(tmp_path / "r.h5")["e"].item() == 0.5


def test_an_extension_that_is_complete_is_not_resumed_and_no_error(cli: Run, stored_sweep: StoredSweep) -> None:
    path = stored_sweep()
    command = ("extend", path, "--set", "sweep.m2=[3.0]", "--resume")
    assert cli(*command).returncode == 0
    seal, again = impact.load(path).encoding["seal"], cli(*command)
    assert again.returncode == 0
    assert again.stderr == f"{path}: already contains this sweep; nothing to do\n"
    assert impact.load(path).encoding["seal"] == seal


def assert_refused(path: Path, overrides: list[str], expected: str) -> None:
    """An extension is refused for a reason, and its folder is not modified."""
    before, names = path.read_bytes(), sorted(path.parent.iterdir())
    with pytest.raises((UsageError, ConfigError)) as refused:
        impact.extend(path, overrides)
    assert expected in str(refused.value)
    assert path.read_bytes() == before
    assert sorted(path.parent.iterdir()) == names


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("sweep.K=2e9", "overrides changes K, expected more values of an axis"),
        ("solver.rtol=1e-6", "overrides changes solver, expected more values of an axis"),
        ("sweep.e=[0.3, 0.6]", "already has all of these"),
        ("sweep.n=1.5", "already has all of these"),
        ("sweep.m2=[]", "sweep.m2"),
        ("sweep.zip=[['e', 'v1']]", "vary together now and did not before"),
    ],
)
def test_an_extension_changes_nothing_but_values_of_axes(
    stored_sweep: StoredSweep, override: str, expected: str
) -> None:
    assert_refused(stored_sweep(), [override], expected)


@pytest.mark.parametrize("change", ["rho=2000", "nu=0.2", "yield_strength=1e8"])
def test_an_extension_does_not_change_a_material(stored_sweep: StoredSweep, change: str) -> None:
    overrides = [f"materials.soft.{change}", "sweep.m2=[2.0, 3.0]"]
    expected = f"r.h5: overrides changes materials.soft.{change.partition('=')[0]}, expected more values"
    assert_refused(stored_sweep(DASHPOT), overrides, expected)


@pytest.mark.slow
def test_an_extension_does_not_change_a_law_of_the_user(tmp_path: Path) -> None:
    laws = [impact.hysteresis(**MINE, chi=chi) for chi in (lambda e: 1 - e, lambda e: 2 - 2 * e)]
    impact.sweep_to_file({"models": "mine-2026", "sweep": BALLS}, tmp_path / "r.h5", plugins=laws[:1])
    with pytest.raises(ImpactError, match="was made with another version of the model mine-2026"):
        impact.extend(tmp_path / "r.h5", ["sweep.e=[0.5, 0.6]"], plugins=laws[1:])
    assert impact.extend(tmp_path / "r.h5", ["sweep.e=[0.5, 0.6]"], plugins=laws[:1])["e"].size == 2


@pytest.mark.parametrize("override", ['output.dtype="float32"', 'output.variables=["e_out"]'])
def test_an_extension_does_not_change_what_is_stored_of_a_point(stored_sweep: StoredSweep, override: str) -> None:
    key = override.partition("=")[0]
    overrides = ["sweep.e=[0.1, 0.3, 0.6]", override]
    assert_refused(stored_sweep(), overrides, f"r.h5: overrides changes {key}, expected more values")


@BOTH_LAYOUTS
@pytest.mark.parametrize(
    "overrides",
    [
        ["sweep.e=0.3", "sweep.v1=1.0", "sweep.zip=[]", "sweep.m2=[1.0, 2.0]"],
        ["sweep.e=[0.1, 0.2]", "sweep.v1=[3.0, 4.0]"],
    ],
)
def test_an_extension_never_drops_a_point(stored_sweep: StoredSweep, layout: str, overrides: list[str]) -> None:
    assert_refused(stored_sweep(ZIPPED, layout), overrides, "overrides leaves out e=0.3, v1=1.0")


@pytest.mark.parametrize("values", ["[0.30000000000000004, 0.9]", "[0.30000000000000004, 0.6, 0.9]"])
def test_a_value_that_differs_by_rounding_from_one_of_the_result_is_that_one(
    stored_sweep: StoredSweep, values: str
) -> None:
    path = stored_sweep()
    assert impact.extend(path, [f"sweep.e={values}"])["e"].values.tolist() == [0.3, 0.6, 0.9]


@BOTH_LAYOUTS
def test_an_extension_does_not_take_apart_what_varied_together(stored_sweep: StoredSweep, layout: str) -> None:
    assert_refused(stored_sweep(ZIPPED, layout), ["sweep.zip=[]"], "r.h5: e, v1 varied together and do not now")


def test_the_work_folder_of_another_sweep_is_not_cleared(stored_sweep: StoredSweep, tmp_path: Path) -> None:
    path, folder = stored_sweep(), tmp_path / "r.h5.work"
    folder.mkdir()
    (folder / "plan.json").write_text("{}", encoding="utf-8")
    assert_refused(path, ["sweep.m2=[3.0]"], "r.h5.work")
    assert (folder / "plan.json").read_text(encoding="utf-8") == "{}"


def test_a_refused_extension_is_one_line_and_exit_code_2(cli: Run, stored_sweep: StoredSweep) -> None:
    done = cli("extend", stored_sweep(), "--set", "sweep.K=2e9")
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert "--set changes K, expected more values of an axis" in done.stderr


def test_a_part_of_a_result_and_a_history_are_not_extended(stored_sweep: StoredSweep, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(BASE, encoding="utf-8")
    whole = impact.load(stored_sweep())
    for number, part in enumerate([whole.isel(e=[0]), whole.isel(e=[1, 0]), whole.drop_vars("peak_force")]):
        path = tmp_path / f"{number}.h5"
        impact.save(part, path)
        with pytest.raises(UsageError, match="got a part of a result, or another order, expected the whole"):
            impact.extend(path, ["sweep.m2=[3.0]"])
        # a sweep does not take it for its result either
        with pytest.raises(UsageError, match="exists"):
            impact.sweep(tmp_path / "c.toml", output=path)
    impact.save(impact.run(at={"e": 0.5}).history, tmp_path / "history.h5")
    with pytest.raises(UsageError, match="time history"):
        impact.extend(tmp_path / "history.h5", ["sweep.m2=[3.0]"])
    with pytest.raises(ResultError, match="does not exist"):
        impact.extend(tmp_path / "no.h5", ["sweep.m2=[3.0]"])


@pytest.mark.slow
@BOTH_LAYOUTS
@pytest.mark.parametrize(
    ("before", "more"),
    [
        (["sweep.v1=-1.0"], "sweep.v1=[-1.0, 1.0]"),
        (["sweep.K=1e-300", "sweep.v1=1.0"], "sweep.K=[1e-300, 1e9]"),
        (["sweep.v1=1.0", "sweep.m2=inf", "sweep.m1=inf"], "sweep.m2=[inf, 1.0]"),
    ],
    ids=["speed", "stiffness", "mass"],
)
def test_points_that_failed_beforehand_do_not_affect_new_points(
    stored_sweep: StoredSweep, tmp_path: Path, layout: str, before: list[str], more: str
) -> None:
    """A closing speed, a stiffness or a mass that is out of range is so at its own points only."""
    larger = impact.extend(stored_sweep(BASE, layout, *before), [more])
    assert_same_values(larger, single_sweep(BASE, [layout, *before, more], tmp_path))
    assert (larger["status"] == 1).any()


@pytest.mark.slow
def test_a_law_that_is_not_combinable_has_this_status_beside_points_that_failed_for_another_reason(
    tmp_path: Path,
) -> None:
    config = """
models = "bilinear"
frictions = "lammps-linear-nohistory"
sweep = {e = 0.8, v1 = 1, m1 = 1, m2 = 2, R1 = 0.01, R2 = 0.02, K = 1e-320, n = 1, angle = "30 deg", mu = 0.3}
friction.lammps-linear-nohistory.xt = [0.0, 1.0]
output.layout = "factored"
"""
    (tmp_path / "c.toml").write_text(config, encoding="utf-8")
    impact.sweep_to_file(tmp_path / "c.toml", tmp_path / "r.h5")
    # the bilinear law has no dashpot, which xt = 1 needs; the first stiffness is out of range for all
    larger = impact.extend(tmp_path / "r.h5", ["sweep.K=[1e-320, 1e9]"])["friction_status"].squeeze()
    assert larger.transpose("K", ...).values.tolist() == [
        [FrictionStatus.OUT_OF_RANGE, FrictionStatus.OUT_OF_RANGE],
        [FrictionStatus.OK, FrictionStatus.NOT_COMBINABLE],
    ]


@pytest.mark.slow
def test_equal_results_are_extended_to_equal_bytes_by_the_core_that_they_have(
    stored_sweep: StoredSweep, tmp_path: Path
) -> None:
    shutil.copy(stored_sweep(), tmp_path / "copy.h5")
    for name in ("r.h5", "copy.h5"):
        impact.extend(tmp_path / name, ["sweep.m2=[3.0]"])
    assert (tmp_path / "r.h5").read_bytes() == (tmp_path / "copy.h5").read_bytes()
    assert impact.load(tmp_path / "r.h5").attrs["core"] == "numpy"
