"""A file made to do harm is refused by every command: one line, no file written, nothing of another file shown."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.api import prepare
from impact.errors import ResultError
from impact.results.backend import open_result
from impact.results.sweep import sweep_into

from .fork_server import CompletedCommand, ForkServer
from .malicious_files import CHANGES, FACTORED, HARMLESS, JUNK, NOT_SEALED, PATCHES, SECRET, change_law, seal

FILE = "FILE"
COMMANDS = (
    ("info", FILE),
    ("info", FILE, "--json"),
    ("plot", FILE, "-o", "picture.png"),
    ("plot", FILE, "-k", "loop", "-o", "loop.png"),
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


@pytest.fixture(scope="session")
def factored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same of the other layout, in which two points share a trajectory."""
    config = {
        "title": "Small", "models": ["bilinear", "gharib-hurmuzlu-2012"],
        "sweep": {"alpha": [0.1, 0.2], "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "material": "a"},
        "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}}, "output": {"layout": "factored"},
    }  # fmt: skip
    path = tmp_path_factory.mktemp("factored") / "factored.h5"
    sweep_into(path, prepare(config))
    return path


def tell(forked: ForkServer, path: Path, command: tuple[str, ...]) -> CompletedCommand:
    return forked(*(path.name if word == FILE else word for word in command), cwd=path.parent)


def check_refused(forked: ForkServer, path: Path, words: str) -> None:
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


@pytest.mark.slow
@pytest.mark.parametrize("name", NOT_SEALED)
def test_what_is_not_sealed_is_refused(forked: ForkServer, tmp_path: Path, name: str) -> None:
    make, words = NOT_SEALED[name]
    make(tmp_path / "bad.h5")
    check_refused(forked, tmp_path / "bad.h5", words)


# a change of one layout: the file that is changed, the change, and the words that refuse it
Case = tuple[str, Callable[[Path], object], str]


def _changed(change: Callable[[h5py.File], object]) -> Callable[[Path], object]:
    def change_file(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file)

    return change_file


CASES: dict[str, Case] = {
    **{name: ("small", _changed(change), words) for name, (change, words) in CHANGES.items()},
    **{name: ("small", make, words) for name, (make, words) in PATCHES.items()},
    **{name: ("factored", _changed(change), words) for name, (change, words) in FACTORED.items()},
}


@pytest.fixture
def make_bad(small: Path, factored: Path, tmp_path: Path) -> Callable[[str], tuple[Path, str]]:
    def make_bad(name: str) -> tuple[Path, str]:
        layout, change, words = CASES[name]
        path = tmp_path / "bad.h5"
        shutil.copy({"small": small, "factored": factored}[layout], path)
        change(path)
        seal(path)
        return path, words

    return make_bad


@pytest.mark.parametrize("name", CASES)
def test_a_sealed_file_with_one_thing_wrong_is_no_result(
    make_bad: Callable[[str], tuple[Path, str]], name: str
) -> None:
    path, words = make_bad(name)
    begun = time.process_time()
    with pytest.raises(ResultError) as refused:
        impact.load(path)
    assert time.process_time() - begun < SECONDS
    (line,) = str(refused.value).splitlines()
    assert line.startswith(f"{path}: ")
    assert line.count(path.name) == 1
    assert words in line
    assert SECRET.decode() not in line


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_every_command_refuses_it(
    forked: ForkServer, make_bad: Callable[[str], tuple[Path, str]], name: str
) -> None:
    check_refused(forked, *make_bad(name))


@pytest.mark.parametrize("name", ["10 MB of labels", "zip bomb in a chunk", "e_out as i4", "another witness"])
def test_a_command_refuses_it(forked: ForkServer, make_bad: Callable[[str], tuple[Path, str]], name: str) -> None:
    path, words = make_bad(name)
    done = forked("info", path.name, cwd=path.parent)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert (done.seconds < SECONDS, done.memory < MEMORY) == (True, True)


def test_of_other_witnesses_both_versions_are_named(
    make_bad: Callable[[str], tuple[Path, str]], factored: Path
) -> None:
    path, _ = make_bad("another witness")
    with h5py.File(path, "r+") as file:
        file.attrs.create("impact_version", np.bytes_(b"0.0.7"))
    seal(path)
    with pytest.raises(ResultError, match=re.escape(f"made by impact 0.0.7, this is {impact.__version__}")):
        impact.load(path)


@pytest.mark.parametrize("key", ["exponent", "parameters", "domain", "asks_for_e", "is_permanent",
                                 "axes", "trajectories", "is_shared", "stiffness_axes"])  # fmt: skip
def test_what_a_law_cannot_be_is_refused_or_changes_no_command(factored: Path, tmp_path: Path, key: str) -> None:
    path = tmp_path / "bad.h5"
    refused = 0
    for value in JUNK:
        shutil.copy(factored, path)
        with h5py.File(path, "r+") as file:
            change_law(file, **{key: value})
        seal(path)
        try:
            # what is opened is read as well; anything else that is raised fails this test
            with open_result(path) as opened:
                assert opened.compute()["v1_post"].shape == (2, 2, 2)
        except ResultError:
            refused += 1
    assert refused >= len(JUNK) // 2


def test_a_chunk_of_another_size_is_found_when_it_is_read(small: Path, tmp_path: Path) -> None:
    path = tmp_path / "bad.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        CHANGES["short chunk"][0](file)
    seal(path)
    with open_result(path) as opened:
        assert np.isfinite(opened["v1_post"][1].values).all()
        with pytest.raises(ResultError, match=re.escape(f"{path}: is not a readable result (v1_post: a chunk")):
            opened["v1_post"][0].values  # noqa: B018


@pytest.mark.slow
@pytest.mark.parametrize("name", HARMLESS)
def test_what_is_not_read_does_no_harm(forked: ForkServer, small: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / "odd.h5"
    shutil.copy(small, path)
    HARMLESS[name](path)
    seal(path)
    assert impact.load(path).identical(impact.load(small))
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert (done.returncode, done.seconds < SECONDS, done.memory < MEMORY) == (0, True, True), command


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["small", "factored"])
def test_a_genuine_file_is_not(
    forked: ForkServer, small: Path, factored: Path, tmp_path: Path, layout: str
) -> None:
    shutil.copy({"small": small, "factored": factored}[layout], tmp_path / "good.h5")
    for command in COMMANDS:
        assert tell(forked, tmp_path / "good.h5", command).returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "differences.png",
        "good.h5",
        "loop.png",
        "picture.png",
    ]


def test_what_is_unknown_is_passed_over_with_a_note(forked: ForkServer, small: Path, tmp_path: Path) -> None:
    path = tmp_path / "more.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        for name in ("twice", "thrice", "x\x1b[31m\u202e\n", "_nc4_non_coord_e_out"):
            file.copy("e_out", name)
    seal(path)
    with pytest.warns(UserWarning, match=r"ignored .*: _nc4_non_coord_e_out, thrice, twice, x"):
        loaded = impact.load(path)
    assert loaded.identical(impact.load(small))
    for command in COMMANDS:
        done = tell(forked, path, command)
        assert done.returncode == 0
        note = done.stderr.splitlines()[0]
        assert note.startswith("note: more.h5: ignored variables")
        assert r"x\x1b[31m\u202e\x0a" in note
        assert len(done.stderr.splitlines()) == 1 + (command[0] not in ("info", "recommend"))


def test_how_another_program_packed_it_is_not_kept(small: Path, tmp_path: Path) -> None:
    result = impact.load(small)
    packed = {str(name): {"zlib": True, "chunksizes": (1, 1, 1)} for name in ("v1_post", "status")}
    result.to_netcdf(tmp_path / "packed.h5", engine="h5netcdf", encoding=packed)
    with pytest.raises(ResultError, match="is of schema version 1, or no result of impact"):
        impact.load(tmp_path / "packed.h5")
    with xr.open_dataset(tmp_path / "packed.h5", engine="h5netcdf") as opened:
        impact.save(opened, tmp_path / "unpacked.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "unpacked.h5"), result)
