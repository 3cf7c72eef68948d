"""A file that looks like a result is a whole result, and nothing that was there is lost."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import ResultError, StoreError, UsageError
from impact.results.store import write_whole

from .conftest import ROOT


def test_what_was_saved_is_loaded(stored: Path, figure6: xr.Dataset) -> None:
    loaded = impact.load(stored)
    xr.testing.assert_identical(loaded, figure6)
    assert [p.name for p in stored.parent.iterdir()] == [stored.name]


def test_a_sweep_of_every_kind_of_axis_comes_back(wide: xr.Dataset, tmp_path: Path) -> None:
    impact.save(wide, tmp_path / "wide.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "wide.h5"), wide)


def test_xarray_and_h5py_read_it(stored: Path, figure6: xr.Dataset) -> None:
    with xr.open_dataset(stored, engine="h5netcdf") as opened:
        assert opened["e_out"].values.tobytes() == figure6["e_out"].values.tobytes()
        assert opened["status"].attrs["flag_meanings"].startswith("ok no_impact limit")
    with h5py.File(stored) as file:
        assert file["e_out"].shape == (3, 101)
        assert file["e_out"].attrs["units"] == b"1"
        assert [key.decode() for key in file["model"][:]] == figure6["model"].values.tolist()
        assert file["status"].dtype == np.int8
        assert file["e_out"].dims[1].keys() == ["e"]


@pytest.mark.skipif(shutil.which("ncdump") is None, reason="ncdump (Debian: netcdf-bin) is not installed")
def test_ncdump_reads_it(stored: Path) -> None:
    header = subprocess.run(["ncdump", "-h", stored], capture_output=True, text=True, check=True).stdout
    assert re.search(r"model = 3 ;\s+e = 101 ;", header) or re.search(r"e = 101 ;\s+model = 3 ;", header)
    assert "double e_out(model, e) ;" in header
    assert "byte status(model, e) ;" in header


def test_equal_inputs_give_equal_bytes(figure6: xr.Dataset, stored: Path, tmp_path: Path) -> None:
    impact.save(figure6, tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == stored.read_bytes()


def test_an_output_that_exists_is_kept(figure6: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "precious.h5"
    path.write_text("precious")
    with pytest.raises(UsageError, match="--overwrite"):
        impact.save(figure6, path)
    assert path.read_text() == "precious"
    impact.save(figure6, path, overwrite=True)
    assert impact.load(path).sizes["e"] == 101


def test_what_is_no_regular_file_is_left_alone(figure6: xr.Dataset, tmp_path: Path) -> None:
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


def test_a_file_that_appears_meanwhile_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "out.h5"
    fsync = os.fsync

    def somebody_else_writes(number: int) -> None:
        fsync(number)
        path.write_text("somebody else's")

    monkeypatch.setattr(os, "fsync", somebody_else_writes)
    with pytest.raises(UsageError, match="appeared"):
        write_whole(path, b"ours", overwrite=False)
    assert path.read_text() == "somebody else's"
    assert [p.name for p in tmp_path.iterdir()] == ["out.h5"]


def test_a_folder_that_cannot_be_synced_is_a_note(
    figure6: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fsync = os.fsync

    def of_files(number: int) -> None:
        if stat.S_ISDIR(os.fstat(number).st_mode):
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        fsync(number)

    monkeypatch.setattr(os, "fsync", of_files)
    with pytest.warns(UserWarning, match=r"folders cannot be synced here \(Invalid argument\)"):
        impact.save(figure6, tmp_path / "out.h5")
    assert impact.load(tmp_path / "out.h5").identical(figure6)


UNREADABLE = """
import ctypes, sys
# without its capabilities root may open no more than others; 0x20080522 is the version of the call
ctypes.CDLL(None).capset((ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)())
from impact.cli.main import main
sys.argv = ["impact", "sweep", "c.toml", "--quiet"]
main()
"""


def test_a_folder_that_may_be_written_to_and_not_read_holds_the_result(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    text = (ROOT / "configs" / "figure6.toml").read_text(encoding="utf-8")
    # so many points are integrated beside a work folder
    (folder / "c.toml").write_text(text.replace("101", "40000"), encoding="utf-8")
    folder.chmod(0o300)
    done = subprocess.run([sys.executable, "-c", UNREADABLE], cwd=folder, capture_output=True, text=True)
    folder.chmod(0o700)
    assert done.returncode == 0, done.stderr
    assert done.stderr == (
        "note: folders cannot be synced here (Permission denied): a power cut may undo what was just written\n"
    )
    assert impact.load(folder / "results.h5").sizes["e"] == 40000


def test_a_disk_that_fails_leaves_nothing_behind(tmp_path: Path) -> None:
    # a limit of the system on the size of files stands for the full disk
    import resource
    import signal

    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(StoreError, match="not written"):
            write_whole(tmp_path / "out.h5", b"x" * 100_000, overwrite=False)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_result_is_refused(stored: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    with h5py.File(other, "w") as file:
        file["x"] = [1.0]
    (tmp_path / "text.h5").write_text("text")
    (tmp_path / "empty.h5").write_bytes(b"")
    (tmp_path / "half.h5").write_bytes(stored.read_bytes()[:20_000])
    newer = tmp_path / "newer.h5"
    shutil.copy(stored, newer)
    with h5py.File(newer, "r+") as file:
        file.attrs["schema_version"] = 99
    for name, words in {
        "absent.h5": "does not exist", ".": "not a regular file", "other.h5": "not a result of impact",
        "text.h5": "not a readable result", "empty.h5": "not a readable result",
        "half.h5": "not a readable result",
        "newer.h5": "schema version 99",
    }.items():  # fmt: skip
        with pytest.raises(ResultError, match=words):
            impact.load(tmp_path / name)


def test_a_changed_number_is_noticed(stored: Path, tmp_path: Path) -> None:
    changed = tmp_path / "changed.h5"
    shutil.copy(stored, changed)
    with h5py.File(changed, "r+") as file:
        file["e_out"][1, 50] += 1e-15
    with pytest.raises(ResultError, match="damaged"):
        impact.load(changed)


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
    ("v1_post", "units", b"km s-1"), ("e", "long_name", b"something else"),
])  # fmt: skip
def test_a_changed_attribute_is_noticed(
    stored: Path, tmp_path: Path, variable: str | None, name: str, value: object
) -> None:
    changed = tmp_path / "changed.h5"
    shutil.copy(stored, changed)
    with h5py.File(changed, "r+") as file:
        (file if variable is None else file[variable]).attrs[name] = np.array(value)
    with pytest.raises(ResultError, match="damaged"):
        impact.load(changed)


def test_without_hard_links(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # some file systems have none; the machine's own has
    def no_links(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", no_links)
    write_whole(tmp_path / "out.h5", b"ours", overwrite=False)
    assert (tmp_path / "out.h5").read_bytes() == b"ours"
    with pytest.raises(UsageError, match="exists"):
        write_whole(tmp_path / "out.h5", b"other", overwrite=False)
    assert [p.name for p in tmp_path.iterdir()] == ["out.h5"]
