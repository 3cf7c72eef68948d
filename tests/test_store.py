"""A stored result is complete and reads back unchanged; a failed write or a refused file damages nothing."""

from __future__ import annotations

import errno
import functools
import itertools
import json
import os
import re
import shutil
import stat
import subprocess
import sys
import tomllib
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.atomic import atomic_write, write_file
from impact.engine.executors import choose_executor
from impact.engine.run import Run as SweepRun
from impact.errors import ResultError, StoreError, UnfinishedError, UsageError
from impact.results.seal import write_seal
from impact.results.sweep import read_plan, sweep_into
from impact.results.xarray_backend import open_result

from .conftest import ROOT, Run, full_disk
from .fork_server import ForkServer


def test_what_was_saved_is_loaded(stored: Path, figure6: xr.Dataset) -> None:
    loaded = impact.load(stored)
    xr.testing.assert_identical(loaded, figure6)
    assert [p.name for p in stored.parent.iterdir()] == [stored.name]


def test_a_sweep_of_every_kind_of_axis_comes_back(wide: xr.Dataset, tmp_path: Path) -> None:
    impact.save(wide, tmp_path / "wide.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "wide.h5"), wide)


def slow(value: object) -> Any:
    """A parameter of a test that only `make test-faults` runs."""
    return pytest.param(value, marks=pytest.mark.slow)


FACTORED = ["output.layout=factored"]
OPTIONS: dict[str, dict[str, object]] = {
    "plain": {}, "float32": {"dtype": "float32"}, "gzip": {"compression": "gzip"}, "chunks": {"chunks": {"e": 20}},
    "all": {"dtype": "float32", "compression": "gzip", "chunks": {"e": 33}},
}  # fmt: skip
QUICK_OPTIONS = ("all",)


@pytest.fixture(scope="module")
def factored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result of configs/figure6.toml in the factored layout."""
    path = tmp_path_factory.mktemp("factored") / "figure6.h5"
    sweep_into(path, read_plan(ROOT / "configs" / "figure6.toml", FACTORED))
    return path


@pytest.mark.parametrize("engine", [{}, {"engine": "impact"}])
def test_xarray_opens_both_layouts(
    stored: Path, factored: Path, figure6: xr.Dataset, engine: dict[str, Any]
) -> None:
    for path, layout in ((stored, "full"), (factored, "factored")):
        with xr.open_dataset(path, **engine) as opened:
            assert opened.encoding["layout"] == layout
            # the overrides of the config are attributes
            common = opened.assign_attrs({key: figure6.attrs[key] for key in ("config_set", "fingerprint")})
            xr.testing.assert_identical(common.compute(), figure6)
        with xr.open_dataset(path, drop_variables=["steps", "e_out"], **engine) as opened:
            assert set(figure6.variables) - set(opened.variables) == {"steps", "e_out"}


def _text(values: np.ndarray) -> list[object]:
    return [value.decode() if isinstance(value, bytes) else value for value in np.ravel(values).tolist()]


@pytest.fixture(scope="module")
def files_with_option(
    wide: xr.Dataset, figure6: xr.Dataset, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], dict[Path, xr.Dataset]]:
    """Files of two sweeps that are stored with an option, and what `impact.load` reads from them."""
    folder = tmp_path_factory.mktemp("options")

    @functools.cache
    def store(option: str) -> dict[Path, xr.Dataset]:
        output = {**OPTIONS[option]}
        if "chunks" in output:
            output["chunks"] = {"e": 2}
        results = {}
        for name, result in (("figure6", figure6), ("wide", wide)):
            path = folder / f"{option}-{name}.h5"
            config = tomllib.loads(result.attrs["config"])
            results[path] = impact.sweep(config | {"output": output, "solver": {"rtol": 1e-4}}, output=path)
        return results

    return store


@pytest.mark.parametrize("option", [name if name in QUICK_OPTIONS else slow(name) for name in OPTIONS])
@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_it_as_any_netcdf_file(
    files_with_option: Callable[[str], dict[Path, xr.Dataset]], engine: str, option: str
) -> None:
    if engine == "netcdf4":
        pytest.importorskip("netCDF4")
    for path, expected in files_with_option(option).items():
        with xr.open_dataset(path, engine=engine) as opened:
            assert dict(opened.sizes) == dict(expected.sizes)
            assert set(opened.variables) == set(expected.variables)
            assert set(opened.coords) == set(expected.coords)
            for name, variable in expected.variables.items():
                assert opened[name].dims == variable.dims, name
                if variable.dtype.kind in "fi":
                    assert opened[name].values.tobytes() == variable.values.tobytes(), name
                else:
                    assert _text(opened[name].values) == _text(variable.values), name
                assert {key: opened[name].attrs.get(key) for key in ("units", "long_name")} == {
                    key: variable.attrs.get(key) for key in ("units", "long_name")
                }
            assert opened.attrs["config"] == expected.attrs["config"]


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_reads_the_trajectory_table_of_a_factored_file_as_netcdf(factored: Path, engine: str) -> None:
    if engine == "netcdf4":
        pytest.importorskip("netCDF4")
    with xr.open_dataset(factored, engine=engine) as opened:
        assert opened["trajectory_e_out"].dims == ("trajectory",)
        assert opened["witness_index"].values.tolist() == list(range(303))
        assert list(json.loads(opened.attrs["laws"])) == _text(opened["model"].values)
        assert _text(opened["model"].values)[2] == "gharib-hurmuzlu-2012"
        assert "v1" in opened.coords


def test_h5py_reads_it(stored: Path, figure6: xr.Dataset) -> None:
    with h5py.File(stored) as file:
        assert file["e_out"][()].tobytes() == figure6["e_out"].values.tobytes()
        assert file["e_out"].attrs["units"] == b"1"
        labels = [b"".join(letters).rstrip(b"\0").decode() for letters in file["model"][()]]
        assert labels == figure6["model"].values.tolist()
        assert file["status"].dtype == np.int8
        assert file["e_out"].dims[1].keys() == ["e"]


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump (Debian: netcdf-bin) is not installed")
def test_ncdump_reads_it(stored: Path, factored: Path) -> None:
    header = subprocess.run(["ncdump", "-h", stored], capture_output=True, text=True, check=True).stdout
    assert re.search(r"model = 3 ;\s+e = 101 ;", header) or re.search(r"e = 101 ;\s+model = 3 ;", header)
    assert "double e_out(model, e) ;" in header
    assert "byte status(model, e) ;" in header
    labels = subprocess.run(["ncdump", "-v", "model,e", stored], capture_output=True, text=True, check=True).stdout
    assert '"gharib-hurmuzlu-2012"' in labels
    assert "0.5, 0.51, 0.52" in labels
    header = subprocess.run(["ncdump", "-h", factored], capture_output=True, text=True, check=True).stdout
    assert "double trajectory_e_out(trajectory) ;" in header


@pytest.mark.skipif(shutil.which("h5ls") is None, reason="h5ls (Debian: hdf5-tools) is not installed")
def test_h5ls_reads_it(stored: Path, factored: Path) -> None:
    listed = subprocess.run(["h5ls", stored], capture_output=True, text=True, check=True).stdout
    assert re.search(r"e_out +Dataset \{3, 101\}", listed)
    listed = subprocess.run(["h5ls", factored], capture_output=True, text=True, check=True).stdout
    assert re.search(r"trajectory_e_out +Dataset \{303\}", listed)


SWEEPS = """import sys
import impact

number, *names = sys.argv[1:]
for name in names:
    impact.sweep_to_file(f"{name}.toml", f"{name}-{number}.h5")
"""


@pytest.mark.slow
def test_two_processes_write_equal_bytes(tmp_path: Path) -> None:
    config = (ROOT / "configs" / "figure6.toml").read_text(encoding="utf-8")
    names = []
    for layout, option in itertools.product(("full", "factored"), OPTIONS):
        # a factored file has chunks of its own
        if layout == "full" or "chunks" not in OPTIONS[option]:
            text = f'{config}\n[solver]\nrtol = 1e-4\n[output]\nlayout = "{layout}"\n'
            for key, value in OPTIONS[option].items():
                text += f"{key} = {json.dumps(value).replace(':', ' =')}\n"
            names.append(f"{layout}-{option}")
            (tmp_path / f"{names[-1]}.toml").write_text(text, encoding="utf-8")
    assert len(names) == 8
    # the hash of a string differs in the other interpreter
    for number in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": number}
        command = [sys.executable, "-c", SWEEPS, number, *names]
        subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    contents = {name: {(tmp_path / f"{name}-{number}.h5").read_bytes() for number in "12"} for name in names}
    assert [name for name, files in contents.items() if len(files) != 1] == []
    # each option has an effect
    assert len({content for files in contents.values() for content in files}) == len(names)


# two ranges of trajectories
MANY = {
    "models": ["gharib-hurmuzlu-2012"],
    "sweep": {"e": {"linspace": [0.01, 1.0, 33_000]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9},
    "solver": {"rtol": 1e-4},
}


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["full", "factored"])
def test_threads_processes_and_an_interruption_change_no_byte(tmp_path: Path, layout: str) -> None:
    plan = read_plan(MANY | {"output": {"layout": layout}})
    sweep_into(tmp_path / "serial.h5", plan)
    sweep_into(tmp_path / "threads.h5", plan, SweepRun(choose_executor(threads=2)))
    sweep_into(tmp_path / "jobs.h5", plan, SweepRun(choose_executor(jobs=2)))
    resumed = tmp_path / "resumed.h5"
    with pytest.raises(UnfinishedError, match=r"16,500 of 33,000 trajectories are kept"):
        sweep_into(resumed, plan, SweepRun(should_stop=lambda: any(tmp_path.glob("resumed.h5.work/*.npz"))))
    assert not resumed.exists()
    # what it had is kept, whether it was read before another interruption or not
    with pytest.raises(UnfinishedError, match=r"16,500 of 33,000 trajectories are kept"):
        sweep_into(resumed, plan, SweepRun(resume=True, should_stop=lambda: True))
    sweep_into(resumed, plan, SweepRun(resume=True))
    assert len({path.read_bytes() for path in tmp_path.glob("*.h5")}) == 1
    assert len(list(tmp_path.iterdir())) == 4


def test_equal_inputs_give_equal_bytes(figure6: xr.Dataset, stored: Path, tmp_path: Path) -> None:
    impact.save(figure6, tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == stored.read_bytes()


def test_a_sweep_whose_file_cannot_be_read_back_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: object) -> None:
        raise StoreError("cannot be read")

    monkeypatch.setattr("impact.results.xarray_backend.check_readable", refuse)
    with pytest.raises(StoreError, match="cannot be read"):
        sweep_into(tmp_path / "out.h5", read_plan(ROOT / "configs" / "figure6.toml", ["sweep.e=0.5"]))
    assert not (tmp_path / "out.h5").exists()


def test_an_output_that_exists_is_kept(figure6: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "precious.h5"
    path.write_text("precious")
    with pytest.raises(UsageError, match="overwrite=True"):
        impact.save(figure6, path)
    assert path.read_text() == "precious"
    impact.save(figure6, path, overwrite=True)
    assert impact.load(path).sizes["e"] == 101


def test_an_output_that_is_no_regular_file_is_refused(figure6: xr.Dataset, tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_text("target")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(target)
    os.mkfifo(tmp_path / "fifo")
    for name in ("folder", "link", "fifo"):
        with pytest.raises(UsageError, match="not a regular file"):
            impact.save(figure6, tmp_path / name, overwrite=True)
    with pytest.raises(UsageError, match="does not exist"):
        impact.save(figure6, tmp_path / "missing" / "out.h5")
    assert target.read_text() == "target"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fifo", "folder", "link", "target"]


def test_an_output_that_another_program_writes_meanwhile_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "out.h5"
    fsync = os.fsync

    def fsync_while_another_program_writes(number: int) -> None:
        fsync(number)
        path.write_text("another program's")

    monkeypatch.setattr(os, "fsync", fsync_while_another_program_writes)
    with pytest.raises(UsageError, match="was created by another process"):
        write_file(path, b"ours", overwrite=False)
    assert path.read_text() == "another program's"
    assert [p.name for p in tmp_path.iterdir()] == ["out.h5"]


def sync_files_only(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Let the sync of a folder fail with the error of this number."""
    fsync = os.fsync

    def fsync_files_only(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", fsync_files_only)


def test_a_folder_that_cannot_be_synced_is_a_note(
    figure6: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sync_files_only(monkeypatch, errno.EINVAL)
    with pytest.warns(UserWarning, match=r"folders cannot be synced here \(Invalid argument\)"):
        impact.save(figure6, tmp_path / "out.h5")
    assert impact.load(tmp_path / "out.h5").identical(figure6)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO])
def test_an_error_after_the_rename_says_that_the_file_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    path = tmp_path / "out.csv"
    path.write_bytes(b"old")
    sync_files_only(monkeypatch, number)
    with pytest.raises(StoreError, match=r"out\.csv: written, but its name may not be on the disk: ") as caught:
        write_file(path, b"new", overwrite=True)
    assert "not written" not in str(caught.value)
    assert path.read_bytes() == b"new"
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]


def test_a_write_removes_what_killed_writes_of_the_same_output_left(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    stale = [f"out.csv.{token}.part" for token in ("0123abcd", "00000000")]
    other = ["out.csv.part", "out.csv.12345.part", "out.csv.0123ABCD.part", "other.csv.0123abcd.part"]
    for name in [*stale, *other, "out.csv.11111111.part"]:
        (tmp_path / name).write_bytes(b"half")
        os.utime(tmp_path / name, (0, 0))
    # of a process that writes it now, and of one that has just begun
    (tmp_path / "out.csv.22222222.part").write_bytes(b"half")
    with (tmp_path / "out.csv.11111111.part").open("rb") as live:
        fcntl.flock(live, fcntl.LOCK_EX)
        write_file(tmp_path / "out.csv", b"whole", overwrite=False)
    rest = {*other, "out.csv", "out.csv.11111111.part", "out.csv.22222222.part"}
    assert {path.name for path in tmp_path.iterdir()} == rest


def test_a_write_leaves_the_file_that_another_process_writes(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    with atomic_write(path, overwrite=True) as sink:
        (part,) = tmp_path.iterdir()
        sink.write(b"first")
        os.utime(part, (0, 0))
        write_file(path, b"second", overwrite=True)
        assert path.read_bytes() == b"second"
    assert path.read_bytes() == b"first"


UNREADABLE = """
import ctypes
# without its capabilities root has the permissions of other users; 0x20080522 is the version of the call
ctypes.CDLL(None).capset((ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)())
"""


@pytest.mark.slow
def test_a_result_is_written_to_a_folder_without_read_permission(forked: ForkServer, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    text = (ROOT / "configs" / "figure6.toml").read_text(encoding="utf-8")
    # more than one range of trajectories needs a work folder
    (folder / "c.toml").write_text(text.replace("101", "33000"), encoding="utf-8")
    folder.chmod(0o300)
    words = ("--set", "models=['hunt-crossley-1975']", "--set", "solver.rtol=1e-4", "--quiet")
    done = forked("sweep", "c.toml", *words, cwd=folder, code=UNREADABLE)
    folder.chmod(0o700)
    assert done.returncode == 0, done.stderr
    assert done.stderr == (
        "note: folders cannot be synced here (Permission denied): a power cut may undo what was just written\n"
    )
    assert impact.load(folder / "results.h5").sizes["e"] == 33000


def test_a_write_to_a_full_disk_leaves_no_file(tmp_path: Path) -> None:
    with full_disk(), pytest.raises(StoreError, match="not written"):
        write_file(tmp_path / "out.h5", b"x" * 100_000, overwrite=False)
    assert list(tmp_path.iterdir()) == []


def test_a_result_that_does_not_fit_on_the_disk_is_not_stored(figure6: xr.Dataset, tmp_path: Path) -> None:
    with full_disk(), pytest.raises(StoreError, match="not written: File too large"):
        impact.save(figure6, tmp_path / "results.h5")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_result_of_this_version_is_refused(stored: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = [1.0]
    (tmp_path / "text.h5").write_text("text")
    (tmp_path / "empty.h5").write_bytes(b"")
    (tmp_path / "half.h5").write_bytes(stored.read_bytes()[:20_000])
    newer = tmp_path / "newer.h5"
    newer.write_bytes(stored.read_bytes().replace(b"\nschema 2\n", b"\nschema 3\n", 1))
    shutil.copy(stored, tmp_path / "inside.h5")
    with (tmp_path / "inside.h5").open("r+b") as sealed:
        with h5py.File(sealed, "r+") as file:
            file.attrs["schema_version"] = 99
        write_seal(sealed)
    for name, words in {
        "absent.h5": "does not exist", ".": "not a regular file", "other.h5": "no result of impact",
        "text.h5": "not a readable result", "empty.h5": "not a readable result",
        "half.h5": "is damaged",
        "newer.h5": "has schema version 3, this program reads 2; sweep its config again: impact sweep",
        "inside.h5": "has schema version 99, this program reads 2",
    }.items():  # fmt: skip
        with pytest.raises(ResultError, match=words):
            impact.load(tmp_path / name)


def test_a_part_of_a_result_can_be_stored(figure6: xr.Dataset, tmp_path: Path) -> None:
    part = figure6.sel(model=["gharib-hurmuzlu-2012"])[["e_out", "status"]]
    impact.save(part, tmp_path / "part.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "part.h5").drop_attrs(), part.drop_attrs())
    impact.save(impact.load(tmp_path / "part.h5"), tmp_path / "same.h5")
    assert (tmp_path / "same.h5").read_bytes() == (tmp_path / "part.h5").read_bytes()
    with pytest.raises(UsageError, match="not a result of impact"):
        impact.save(figure6.drop_attrs(), tmp_path / "bare.h5")


@pytest.mark.parametrize(("variable", "name", "value"), [
    (None, "config", b"models = []"), (None, "rtol", 1e-3), (None, "fingerprint", b"0"),
    ("v1_post", "units", b"km s-1"), ("e", "long_name", b"something else"), ("e_out", None, 1e-15),
])  # fmt: skip
def test_a_changed_number_or_attribute_is_detected(
    stored: Path, tmp_path: Path, variable: str | None, name: str | None, value: object
) -> None:
    changed = tmp_path / "changed.h5"
    shutil.copy(stored, changed)
    with h5py.File(changed, "r+") as file:
        if name is None:
            file[variable][1, 50] += value
        else:
            (file if variable is None else file[variable]).attrs[name] = np.array(value)
    with pytest.raises(ResultError, match="damaged"):
        impact.load(changed)


def test_results_are_written_on_a_file_system_without_hard_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_links(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    write_file(tmp_path / "out.h5", b"ours", overwrite=False)
    assert (tmp_path / "out.h5").read_bytes() == b"ours"
    with pytest.raises(UsageError, match="exists"):
        write_file(tmp_path / "out.h5", b"other", overwrite=False)
    assert [p.name for p in tmp_path.iterdir()] == ["out.h5"]


# commands that read a result, and their options
READERS = [["info"], ["plot", "-o", "x.png"], ["recommend"], ["rerun"]]


@pytest.mark.parametrize(
    ("schema_version", "commands"),
    [(1, READERS), (None, READERS[:1]), pytest.param(None, READERS[1:], marks=pytest.mark.slow)],
)
def test_a_file_of_version_1_is_refused_and_the_command_that_replaces_it_is_named(
    cli: Run, stored: Path, tmp_path: Path, schema_version: int | None, commands: list[list[str]]
) -> None:
    # files of version 1 had no seal before the HDF5 data
    with xr.open_dataset(stored, engine="h5netcdf") as opened:
        old = opened.drop_attrs(deep=False).load()
    if schema_version:
        old = old.assign_attrs(schema_version=schema_version, content_digest="0" * 64)
    old.to_netcdf(tmp_path / "old.h5", engine="h5netcdf")
    assert (tmp_path / "old.h5").read_bytes().startswith(b"\x89HDF\r\n\x1a\n")
    message = (
        "old.h5: is of schema version 1, or no result of impact, such as a file of to_netcdf in place of "
        "impact.save; expected version 2: sweep its config again: impact sweep CONFIG.toml -o RESULT --overwrite\n"
    )
    for command in commands:
        done = cli(command[0], "old.h5", *command[1:], cwd=tmp_path)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", message), command
    assert [path.name for path in tmp_path.iterdir()] == ["old.h5"]


@pytest.mark.slow
def test_a_time_history_is_written_by_run_and_read_again(cli: Run, tmp_path: Path) -> None:
    words = ["run", ROOT / "configs" / "figure6.toml", "--model", "gharib-hurmuzlu-2012", "--at", "e=0.5"]
    for name in ("a.h5", "b.h5"):
        done = cli(*words, "--history", name, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
    history = impact.load(tmp_path / "a.h5")
    assert history.encoding["layout"] == "full"
    assert float(history["delta"][0]) == 0.0
    assert history.attrs["e_kinetic"] == pytest.approx(0.5, abs=0.3)
    impact.save(history, tmp_path / "again.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "again.h5"), history)
    with xr.open_dataset(tmp_path / "a.h5", engine="h5netcdf") as opened:
        assert opened["F"].values.tobytes() == history["F"].values.tobytes()
    assert cli("plot", "a.h5", "-k", "loop", "-o", "loop.png", cwd=tmp_path).returncode == 0


LARGE = {
    "models": ["hertz"],
    "sweep": {"e": {"linspace": [0.0, 1.0, 1_000]}, "v1": {"linspace": [1.0, 2.0, 10_000]}, "m2": 1.0, "K": 6e9,
              "m1": {"linspace": [1.0, 2.0, 100_000]}},
}  # fmt: skip


@pytest.mark.slow
def test_values_that_exceed_the_memory_are_refused_before_they_are_computed(tmp_path: Path) -> None:
    sweep_into(tmp_path / "large.h5", read_plan(LARGE, run=SweepRun(max_points=10**13)))
    with open_result(tmp_path / "large.h5") as opened:
        assert opened["e_out"].size == 10**12
        tracemalloc.start()
        for compute in (lambda: opened["e_out"].mean(), lambda: opened.load(), lambda: opened["status"].values):
            with pytest.raises(MemoryError, match=r"1,000,000,000,000 values take .* select a part first"):
                compute()
        assert tracemalloc.get_traced_memory()[1] < 20_000_000
        tracemalloc.stop()
        assert float(opened["e_out"].isel(v1=0, m1=slice(0, 50)).mean()) == pytest.approx(1.0, abs=1e-9)


# a result that could not be stored or read is refused before integration, which the law below records in a file
SWEEP = """
models = ["mine-2026"]
[solver]
rtol = 1e-4
[sweep]
v1 = [1.0, 2.0]
m1 = 1.0
m2 = 1.0
"""
LAW = """
from pathlib import Path
import impact

def force(elastic):
    Path("integrated").touch()
    return elastic

MINE = impact.ForceModel(
    "mine-2026", "Mine", 2026, equation="", reference="", exponent=1.0, force=force,
    parameters=tuple(impact.Parameter(f"p{number}", "1", "a number", default=1.0) for number in range(40)),
)
"""


def test_the_law_writes_a_file_when_it_is_integrated(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(LAW, encoding="utf-8")
    (tmp_path / "c.toml").write_text(f"{SWEEP}K = 6e9\nn = 1.0\n", encoding="utf-8")
    assert cli("sweep", "c.toml", "--plugin", "mine.py", cwd=tmp_path).returncode == 0
    assert (tmp_path / "integrated").exists()


def _refused(cli: Run, folder: Path, config: str, output: str) -> str:
    (folder / "mine.py").write_text(LAW, encoding="utf-8")
    (folder / "c.toml").write_text(config, encoding="utf-8")
    before = sorted(path.name for path in folder.iterdir())
    done = cli("sweep", "c.toml", "-o", output, "--plugin", "mine.py", cwd=folder)
    assert (done.returncode, done.stdout) == (2, ""), done
    (line,) = done.stderr.splitlines()
    assert sorted(path.name for path in folder.iterdir()) == before
    return line


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_more_axes_than_a_file_can_have_are_refused(cli: Run, tmp_path: Path, layout: str) -> None:
    axes = "".join(f"p{number} = {[1.0, 2.0] if number < 2 else [1.0]}\n" for number in range(40))
    config = (
        f'models = ["mine-2026"]\n[sweep]\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\nK = 6e9\nn = 1.0\n'
        f'[output]\nlayout = "{layout}"\n[model.mine-2026]\n{axes}'
    )
    line = _refused(cli, tmp_path, config, "out.h5")
    assert "got 40 axes, expected at most 31" in line


@pytest.mark.slow
def test_longer_labels_than_a_file_can_have_are_refused(cli: Run, tmp_path: Path) -> None:
    # each label takes as many bytes as the longest
    names = ["x" * 400_000, *(f"y{number}" for number in range(19))]
    materials = "".join(f"[materials.{name}]\nE = 2e11\nnu = 0.3\nrho = 7800\n" for name in names)
    line = _refused(cli, tmp_path, f"{SWEEP}n = 1.0\nmaterial = {json.dumps(names)}\n{materials}", "out.h5")
    assert "labels take 8," in line
    assert "expected at most 4,000,000; use shorter names of materials" in line


@pytest.mark.parametrize("length", [242, 255, 300])
def test_longer_names_than_a_folder_can_have_are_refused(cli: Run, tmp_path: Path, length: int) -> None:
    line = _refused(cli, tmp_path, f"{SWEEP}K = 6e9\nn = 1.0\n", "r" * (length - 3) + ".h5")
    assert f"got a name of {length} bytes, expected at most " in line
    assert len(line) < 200


def test_stored_chunks_are_those_of_the_config(tmp_path: Path) -> None:
    sweep = {"e": [0.2, 0.4, 0.6], "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    config = {"models": ["hertz", "tsuji-1992"], "sweep": sweep, "output": {"chunks": {"e": 2, "v1": 50}}}
    impact.sweep_to_file(config, tmp_path / "r.h5", overrides=["output.layout=full"])
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["e_out"].chunks == (1, 2, 2)


def test_variables_name_the_scalar_coordinates_as_cf_asks(tmp_path: Path) -> None:
    sweep = {"e": [0.2, 0.4], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    impact.sweep_to_file({"models": ["hertz"], "sweep": sweep}, tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5") as file:
        assert {"v1", "m1", "m2", "K"} <= {*file["e_out"].attrs["coordinates"].decode().split()}


@pytest.mark.parametrize("name", ["zz.csv", "zz.PNG", "zz.json", "zz.toml", "zz.parquet"])
def test_a_result_with_the_name_of_another_kind_of_file_is_refused(tmp_path: Path, cli: Run, name: str) -> None:
    tables = "impact plot --data and to_dataframe make tables"
    message = f"{name}: expected the name of a result, such as zz.h5; {tables}"
    config = {"models": "hertz", "sweep": {"v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 1e6}}
    (tmp_path / "c.json").write_text(json.dumps(config), encoding="utf-8")
    impact.sweep_to_file(config, tmp_path / "r.dat")
    for words in (
        ("sweep", "c.json"),
        ("sweep", "c.json", "--shard", "1/2"),
        ("expand", "r.dat"),
        ("extend", "r.dat", "--set", "sweep.v1=[3.0]"),
    ):
        refused = cli(*words, "-o", name, cwd=tmp_path)
        assert (refused.returncode, refused.stderr) == (2, f"{message}\n")
    with pytest.raises(UsageError, match=re.escape(message)):
        impact.save(impact.load(tmp_path / "r.dat"), tmp_path / name)
    assert {path.name for path in tmp_path.iterdir()} == {"c.json", "r.dat"}


def test_a_file_that_is_truncated_while_it_is_open_has_no_values(tmp_path: Path) -> None:
    """HDF5 itself reads zeros there."""
    path = tmp_path / "results.h5"
    sweep = {"e": {"linspace": [0.1, 0.9, 2000]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e9}
    impact.sweep_to_file({"models": "exact-hysteresis", "sweep": sweep}, path)
    with open_result(path) as opened:
        assert opened["peak_force"].min() > 0.0
        os.truncate(path, path.stat().st_size // 10)
        for part in (slice(None), slice(5), np.array([3, 5])):
            with pytest.raises(ResultError, match=r"results\.h5: .*the file was truncated since it was opened"):
                _ = opened["peak_force"][0, part].values
