"""Extending integrates only what is new and gives what the sweep at once gives; expanding writes any part."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import ResultError, UsageError

from .conftest import Run

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


def sweep(cli: Run, config: Path, output: Path, *changes: str) -> xr.Dataset:
    words = [word for change in changes for word in ("--set", change)]
    assert cli("sweep", config, "-o", output, "--overwrite", "-q", "--allow-failed", *words).returncode == 0
    return impact.load(output)


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """All variables and coordinates have the same bits."""
    assert {*one.variables} == {*other.variables}
    for name in other.variables:
        a, b = one.variables[name], other.variables[name]
        assert a.dims == b.dims, name
        assert a.values.tobytes() == b.values.tobytes(), name
    for name in ("fingerprint", "config", "materials"):
        assert one.attrs[name] == other.attrs[name]


# changes, how many of the trajectories are new where the table is stored, and where all values are
CASES = {
    "a scalar becomes an axis": (("sweep.m2=[2.0, 3.0]",), 0, 3),
    "new values alone": (("sweep.m2=[3.0]",), 0, 3),
    "an axis that a law depends on": (("sweep.e=[0.1, 0.3, 0.6]",), 1, 2),
    "values before, between and after": (("sweep.v1=[0.5, 1.0, 1.5, 2.0, 2.5]",), 0, 3),
    "two axes": (("sweep.e=[0.3, 0.9, 0.6]", "sweep.v1=[1.0, 4.0, 2.0]"), 1, 4),
    "a model": (('models=["gharib-hurmuzlu-2012", "hunt-crossley-1975", "hertz"]',), 2, 2),
    "a model, by its key alone": (('models="hunt-crossley-1975"',), 2, 2),
}


@pytest.mark.parametrize("layout", ["full", "factored"])
@pytest.mark.parametrize("changes", CASES)
def test_an_extended_result_is_that_of_the_sweep_at_once(cli, tmp_path, layout, changes):
    overrides, *counts = CASES[changes]
    config = tmp_path / "base.toml"
    config.write_text(BASE)
    sweep(cli, config, tmp_path / "r.h5", f'output.layout="{layout}"')
    words = [word for change in overrides for word in ("--set", change)]
    done = cli("extend", tmp_path / "r.h5", "-o", tmp_path / "larger.h5", *words)
    assert done.returncode == 0, done.stderr
    new = counts[layout == "full"]
    assert f"{new} of " in done.stderr.splitlines()[0] or f"\n{new} of " in done.stderr
    larger = impact.load(tmp_path / "larger.h5")
    stored = [f"{text}" for text in json.loads(larger.attrs["config_set"])]
    same(larger, sweep(cli, config, tmp_path / "at_once.h5", *stored))
    assert json.loads(larger.attrs["extended"])[-1]["set"] == list(overrides)


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_axes_that_vary_together_are_extended_together(cli, tmp_path, layout):
    config = tmp_path / "zip.toml"
    config.write_text(DASHPOT)
    more = ("sweep.m1=[1.0, 3.0, 2.0]", "sweep.R1=[0.01, 0.03, 0.02]")
    sweep(cli, config, tmp_path / "r.h5", f'output.layout="{layout}"')
    larger = impact.extend(tmp_path / "r.h5", more)
    same(larger, sweep(cli, config, tmp_path / "at_once.h5", f'output.layout="{layout}"', *more))


def test_an_extension_replaces_the_result_and_can_be_extended_again(cli, tmp_path):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE)
    first = sweep(cli, config, path)
    impact.extend(path, ["sweep.m2=[3.0]"])
    larger = impact.extend(path, ["sweep.m2=[4.0]"])
    assert larger["m2"].values.tolist() == [2.0, 3.0, 4.0]
    seals = [one["seal"] for one in json.loads(larger.attrs["extended"])]
    assert (seals[0], len(seals)) == (first.encoding["seal"], 2)
    assert impact.compare(larger.sel(m2=2.0), first, subset=True).equal
    assert impact.rerun(path).equal
    assert sorted(one.name for one in tmp_path.iterdir()) == ["base.toml", "r.h5"]


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("sweep.K=2e9", "--set changes K, expected more values of an axis"),
        ("solver.rtol=1e-6", "--set changes solver, expected more values of an axis"),
        ("sweep.e=[0.3, 0.6]", "already has all of these"),
        ("sweep.n=1.5", "already has all of these"),
        ("sweep.m2=[]", "sweep.m2"),
        ("sweep.zip=[['e', 'v1']]", "vary together now and did not before"),
    ],
)
def test_a_change_of_something_else_is_refused_and_nothing_is_touched(cli, tmp_path, override, expected):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE)
    sweep(cli, config, path)
    before = path.read_bytes()
    done = cli("extend", path, "--set", override)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
    assert expected in done.stderr
    assert path.read_bytes() == before
    assert sorted(one.name for one in tmp_path.iterdir()) == ["base.toml", "r.h5"]


def test_a_part_of_a_result_and_a_history_are_not_extended(cli, tmp_path):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE)
    impact.save(sweep(cli, config, path).isel(e=[0]), tmp_path / "part.h5")
    with pytest.raises(UsageError, match="got a part of the result of its config, expected the whole"):
        impact.extend(tmp_path / "part.h5", ["sweep.m2=[3.0]"])
    impact.save(impact.run(at={"e": 0.5}).history, tmp_path / "history.h5")
    with pytest.raises(UsageError, match="time history"):
        impact.extend(tmp_path / "history.h5", ["sweep.m2=[3.0]"])
    with pytest.raises(ResultError, match="does not exist"):
        impact.extend(tmp_path / "no.h5", ["sweep.m2=[3.0]"])


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_expand_writes_the_whole_or_a_part_with_all_values(cli, tmp_path, layout):
    config, path, full = tmp_path / "base.toml", tmp_path / "r.h5", tmp_path / "full.h5"
    config.write_text(BASE)
    result = sweep(cli, config, path, f'output.layout="{layout}"')
    assert cli("expand", path, "-o", full).returncode == 0
    expanded = impact.load(full)
    assert expanded.encoding["layout"] == "full"
    assert expanded.identical(result)
    words = ["--sel", "v1=2.0", "--model", "hertz", "--overwrite"]
    done = cli("expand", path, "-o", full, *words)
    assert (done.returncode, done.stderr) == (0, f"{full}: 2 points, {full.stat().st_size:,} bytes\n")
    part = impact.load(full)
    assert part.identical(result.sel(model=["hertz"]).sel(v1=2.0))
    # as a program reads it that does not know impact
    with xr.open_dataset(full, engine="h5netcdf") as plain:
        np.testing.assert_array_equal(plain["v1_post"].values, part["v1_post"].values)
        assert plain["model"].values.tolist() == ["hertz"]


def test_expand_refuses_what_is_too_much_or_in_the_way(cli, tmp_path):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE)
    sweep(cli, config, path)
    for words, expected in (
        (["-o", tmp_path / "x.h5", "--max-points", "7"], "got 8 points, expected at most 7 (--max-points)"),
        (["-o", path, "--overwrite"], "is the file to be read"),
        (["-o", tmp_path / "base.toml"], "exists; give another name"),
        (["-o", tmp_path / "x.h5", "--sel", "v1=9"], "no v1 = 9.0 in this result"),
        (["-o", tmp_path / "x.h5", "--model", "bilinear"], 'no model "bilinear" in this result'),
    ):
        done = cli("expand", path, *words)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
        assert expected in done.stderr
    assert sorted(os.listdir(tmp_path)) == ["base.toml", "r.h5"]


@pytest.mark.parametrize("layout", ["full", "factored"])
@pytest.mark.parametrize(
    ("first", "more"),
    [
        (("sweep.v1=-1.0",), ("sweep.v1=[-1.0, 1.0]",)),
        (("sweep.K=1e-300", "sweep.v1=1.0"), ("sweep.K=[1e-300, 1e9]",)),
        (("sweep.v1=1.0", "sweep.m2=inf", "sweep.m1=inf"), ("sweep.m2=[inf, 1.0]",)),
    ],
)
def test_points_that_failed_beforehand_do_not_spoil_new_ones(cli, tmp_path, layout, first, more):
    """A closing speed, a stiffness or a mass that is out of range is so at its own points only."""
    config = tmp_path / "base.toml"
    config.write_text(BASE)
    first = (f'output.layout="{layout}"', *first)
    sweep(cli, config, tmp_path / "r.h5", *first)
    larger = impact.extend(tmp_path / "r.h5", more)
    same(larger, sweep(cli, config, tmp_path / "at_once.h5", *first, *more))
    assert (larger["status"] == 1).any()


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_what_the_result_has_is_never_dropped(cli, tmp_path, layout):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE + 'zip = [["e", "v1"]]\n')
    sweep(cli, config, path, f'output.layout="{layout}"')
    before = path.read_bytes()
    for changes, expected in (
        (["sweep.e=0.3", "sweep.v1=1.0", "sweep.zip=[]", "sweep.m2=[1.0, 2.0]"], "--set leaves out e=0.3, v1=1.0"),
        (["sweep.e=[0.1, 0.2]", "sweep.v1=[3.0, 4.0]"], "--set leaves out e=0.3, v1=1.0"),
    ):
        done = cli("extend", path, *(word for change in changes for word in ("--set", change)))
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1), done.stderr
        assert expected in done.stderr
        assert path.read_bytes() == before


def test_the_work_folder_of_another_sweep_is_not_cleared(cli, tmp_path):
    config, path = tmp_path / "base.toml", tmp_path / "r.h5"
    config.write_text(BASE)
    sweep(cli, config, path)
    folder = tmp_path / "r.h5.work"
    folder.mkdir()
    (folder / "plan.json").write_text("{}")
    done = cli("extend", path, "--set", "sweep.m2=[3.0]")
    assert done.returncode == 2
    assert "r.h5.work" in done.stderr
    assert (folder / "plan.json").read_text() == "{}"


def test_an_extended_result_keeps_its_core_and_its_seal_is_that_of_equal_input(cli, tmp_path):
    config = tmp_path / "base.toml"
    config.write_text(BASE)
    sweep(cli, config, tmp_path / "a.h5")
    (tmp_path / "b.h5").write_bytes((tmp_path / "a.h5").read_bytes())
    for name in ("a.h5", "b.h5"):
        impact.extend(tmp_path / name, ["sweep.m2=[3.0]"])
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    assert impact.load(tmp_path / "a.h5").attrs["core"] == "numpy"
