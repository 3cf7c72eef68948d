"""A file made to do harm is refused by every command: one line, no file written, nothing of another file shown."""

from __future__ import annotations

import re
import shutil
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.api import prepare
from impact.errors import ResultError
from impact.results.sweep import sweep_into

from .forked import Done, Forked
from .malicious import CHANGES, HARMLESS, NOT_SEALED, PATCHES, SECRET, seal

# it starts many processes or reads many files: `make test-faults` runs it
pytestmark = pytest.mark.slow

FILE = "FILE"
COMMANDS = (
    ("info", FILE),
    ("info", FILE, "--json"),
    ("plot", FILE, "-o", "picture.png"),
    ("plot", FILE, "-k", "loop", "-o", "picture.png"),
    ("recommend", FILE),
    ("compare", FILE, FILE, "--plot", "differences.png"),
    ("rerun", FILE, "--plot", "differences.png"),
)
SECONDS, MEMORY = 2.0, 500_000_000


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A genuine result, from which the others are made."""
    models = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
    point = {"e": [0.2, 0.6, 1.0], "v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "K": 6e9}
    path = tmp_path_factory.mktemp("small") / "small.h5"
    impact.save(impact.sweep({"title": "Small", "models": models, "sweep": point}), path)
    return path


def tell(forked: Forked, path: Path, command: tuple[str, ...]) -> Done:
    return forked(*(path.name if word == FILE else word for word in command), cwd=path.parent)


def check_refused(forked: Forked, path: Path, words: str) -> None:
    """Every command refuses the file in these words, at little cost, and leaves the folder as it is."""
    before = sorted(path.parent.iterdir())
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert not done.timed_out, command
        assert (done.returncode, done.stdout) == (2, ""), (command, done)
        (line,) = done.stderr.splitlines()
        assert line.startswith(f"{path.name}: "), command
        assert words in line, command
        assert SECRET.decode() not in line, command
        assert done.seconds < SECONDS, command
        assert done.memory < MEMORY, command
        assert sorted(path.parent.iterdir()) == before, command


@pytest.mark.parametrize("name", NOT_SEALED)
def test_what_is_not_sealed_is_refused(forked: Forked, tmp_path: Path, name: str) -> None:
    make, words = NOT_SEALED[name]
    make(tmp_path / "bad.h5")
    check_refused(forked, tmp_path / "bad.h5", words)


@pytest.mark.parametrize("name", CHANGES)
def test_hdf5_with_one_thing_wrong_is_refused(forked: Forked, small: Path, tmp_path: Path, name: str) -> None:
    change, words = CHANGES[name]
    path = tmp_path / "bad.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        change(file)
    seal(path)
    check_refused(forked, path, words)


@pytest.mark.parametrize("name", PATCHES)
def test_hdf5_that_no_library_would_write_is_refused(
    forked: Forked, small: Path, tmp_path: Path, name: str
) -> None:
    make, words = PATCHES[name]
    path = tmp_path / "bad.h5"
    shutil.copy(small, path)
    make(path)
    seal(path)
    check_refused(forked, path, words)


@pytest.mark.parametrize("name", HARMLESS)
def test_what_is_not_read_does_no_harm(forked: Forked, small: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / "odd.h5"
    shutil.copy(small, path)
    HARMLESS[name](path)
    seal(path)
    assert impact.load(path).identical(impact.load(small))
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert (done.returncode, done.seconds < SECONDS, done.memory < MEMORY) == (0, True, True), command


def test_hdf5_that_begins_later_is_refused(forked: Forked, small: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.h5").write_bytes(bytes(512) + small.read_bytes())
    check_refused(forked, tmp_path / "bad.h5", "not an HDF5 file")


@pytest.mark.slow
def test_what_is_cut_off_is_refused(forked: Forked, small: Path, tmp_path: Path) -> None:
    whole = small.read_bytes()
    for length in (1, 8, 9, 47, 48, 95, 96, 97, *range(200, len(whole), len(whole) // 12), len(whole) - 1):
        (tmp_path / "bad.h5").write_bytes(whole[:length])
        check_refused(forked, tmp_path / "bad.h5", "is not a readable result")


def test_a_genuine_file_is_not(forked: Forked, small: Path, tmp_path: Path) -> None:
    shutil.copy(small, tmp_path / "good.h5")
    for command in COMMANDS:
        assert tell(forked, tmp_path / "good.h5", command).returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["differences.png", "good.h5", "picture.png"]


def test_what_is_unknown_is_passed_over_with_a_note(forked: Forked, small: Path, tmp_path: Path) -> None:
    path = tmp_path / "more.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        file["twice"] = np.arange(5.0)
        file["thrice"] = np.array(["a", "b"], object)
        file["x\x1b[31m\u202e\n"] = file["e_out"][()]
        file["_nc4_non_coord_e_out"] = file["e_out"][()]
        file["four"] = file["v1_reference"][()]
        file["four"].dims[0].attach_scale(file["e"])
        file["four"].dims[1].attach_scale(file["m2"])
    with pytest.warns(UserWarning, match=r"passed over .*: _nc4_non_coord_e_out, four, thrice, twice, x"):
        loaded = impact.load(path)
    assert loaded.identical(impact.load(small))
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert done.returncode == 0
        note = done.stderr.splitlines()[0]
        assert note.startswith("note: more.h5: passed over")
        assert r"x\x1b[31m\u202e\x0a" in note
        assert len(done.stderr.splitlines()) == 1 + (command[0] not in ("info", "recommend"))


def test_how_another_program_packed_it_is_not_kept(small: Path, tmp_path: Path) -> None:
    result = impact.load(small)
    packed = {str(name): {"zlib": True, "chunksizes": (1, 1, 1)} for name in ("v1_post", "status")}
    result.to_netcdf(tmp_path / "packed.h5", engine="h5netcdf", encoding=packed)
    with pytest.raises(ResultError, match="an attribute of an unusual kind"):
        impact.load(tmp_path / "packed.h5")
    with xr.open_dataset(tmp_path / "packed.h5", engine="h5netcdf") as opened:
        impact.save(opened, tmp_path / "unpacked.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "unpacked.h5"), result)


def test_a_tree_of_pieces_that_leads_back_to_itself_is_refused(forked: Forked, tmp_path: Path) -> None:
    # the library follows it until the process that does so dies
    config = {
        "models": ["bilinear"], "sweep": {"e": {"linspace": [0.0, 1.0, 400]}, "v1": 1.0, "m1": 1.0, "m2": 1.0,
        "K": 1e9, "n": 1.0}, "output": {"variables": ["v1_post", "status"], "chunks": {"e": 1}},
    }  # fmt: skip
    path = tmp_path / "bad.h5"
    sweep_into(path, prepare(config))
    assert impact.load(path).sizes["e"] == 400
    content = bytearray(path.read_bytes())
    # a node of a tree of pieces above the leaves: a key of two axes and the value's width, then its first child
    nodes = [found.start() for found in re.finditer(rb"TREE\x01[^\x00]", bytes(content))]
    assert len(nodes) == 2
    for node in nodes:
        content[node + 56 : node + 64] = struct.pack("<Q", node)
    path.write_bytes(content)
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert (done.returncode, done.stdout) == (2, ""), (command, done)
        assert "bad.h5: is not a readable result (its pieces cannot be found)" in done.stderr
