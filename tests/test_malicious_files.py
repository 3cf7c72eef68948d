"""Every command refuses a malicious file: one line, no file written, no content of another file shown."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import ResultError
from impact.results.xarray_backend import open_result

from .fork_server import CompletedCommand, ForkServer
from .malicious_files import (
    CHANGES,
    CYCLES,
    FACTORED,
    HARMLESS,
    INVALID_LAW_VALUES,
    NOT_SEALED,
    PATCHES,
    SECRET,
    change_law,
    seal,
)

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
MAX_CPU_S, MAX_MEMORY_BYTES = 2.0, 500_000_000


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A valid result in the full layout, from which malicious files are made."""
    models = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
    point = {"e": [0.2, 0.6, 1.0], "v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "K": 6e9}
    path = tmp_path_factory.mktemp("small") / "small.h5"
    impact.save(impact.sweep({"title": "Small", "models": models, "sweep": point}), path)
    return path


@pytest.fixture(scope="session")
def factored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A valid result in the factored layout, in which two points share a trajectory."""
    config = {
        "title": "Small",
        "models": ["bilinear", "gharib-hurmuzlu-2012"],
        "sweep": {"alpha": [0.1, 0.2], "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "material": "a"},
        "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}},
        "output": {"layout": "factored"},
    }
    path = tmp_path_factory.mktemp("factored") / "factored.h5"
    impact.sweep_to_file(config, path)
    return path


def run_on(forked: ForkServer, path: Path, command: tuple[str, ...]) -> CompletedCommand:
    return forked(*(path.name if word == FILE else word for word in command), cwd=path.parent)


def check_refused(
    forked: ForkServer, path: Path, message: str, commands: Sequence[tuple[str, ...]] = COMMANDS
) -> None:
    """Check that commands refuse the file with this message, at little cost, and change no file."""
    before = sorted(path.parent.iterdir())
    for command in commands:
        completed = run_on(forked, path, command)
        assert not completed.timed_out, command
        assert (completed.returncode, completed.stdout) == (2, ""), (command, completed)
        (line,) = completed.stderr.splitlines()
        assert line.startswith(f"{path.name}: "), command
        assert message in line, command
        assert SECRET.decode() not in line, command
        assert completed.seconds < MAX_CPU_S, command
        assert completed.memory < MAX_MEMORY_BYTES, command
        assert sorted(path.parent.iterdir()) == before, command


@pytest.mark.slow
@pytest.mark.parametrize("name", NOT_SEALED)
def test_every_command_refuses_a_file_that_is_not_sealed(forked: ForkServer, tmp_path: Path, name: str) -> None:
    create_file, message = NOT_SEALED[name]
    create_file(tmp_path / "bad.h5")
    check_refused(forked, tmp_path / "bad.h5", message)


# layout of the file that is changed, change, and expected message
Case = tuple[str, Callable[[Path], object], str]


def _change_hdf5(change: Callable[[h5py.File], object]) -> Callable[[Path], object]:
    def change_file(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file)

    return change_file


CASES: dict[str, Case] = {
    **{name: ("small", _change_hdf5(change), message) for name, (change, message) in CHANGES.items()},
    **{name: ("small", change_file, message) for name, (change_file, message) in PATCHES.items()},
    **{name: ("factored", _change_hdf5(change), message) for name, (change, message) in FACTORED.items()},
}
# these take a second each to create
LARGE_CASES = {"100 MB of text", "100,000 links"}


CreateMalicious = Callable[[str], tuple[Path, str]]


@pytest.fixture
def create_malicious(small: Path, factored: Path, tmp_path: Path) -> CreateMalicious:
    """A function that creates the file of a case; it returns the path and the expected message."""

    def create(name: str) -> tuple[Path, str]:
        layout, change, message = CASES[name]
        path = tmp_path / "bad.h5"
        shutil.copy({"small": small, "factored": factored}[layout], path)
        change(path)
        seal(path)
        return path, message

    return create


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LARGE_CASES)) for name in CASES]
)
def test_a_sealed_file_with_a_defect_is_not_loaded(create_malicious: CreateMalicious, name: str) -> None:
    path, message = create_malicious(name)
    start = time.process_time()
    with pytest.raises(ResultError) as refused:
        impact.load(path)
    assert time.process_time() - start < MAX_CPU_S
    (line,) = str(refused.value).splitlines()
    assert line.startswith(f"{path}: ")
    assert line.count(path.name) == 1
    assert message in line
    assert SECRET.decode() not in line


@pytest.mark.parametrize(
    ("name", "commands"),
    [
        *(
            pytest.param(name, [COMMANDS[number % len(COMMANDS)]], marks=pytest.mark.slow)
            for number, name in enumerate(CASES)
        ),
        # all commands read a file by the same functions: one case of each kind, and in the long tests every case
        *((next(iter(cases)), COMMANDS) for cases in (CHANGES, PATCHES, FACTORED)),
        *(pytest.param(name, COMMANDS, marks=pytest.mark.long) for name in CASES),
    ],
)
def test_commands_refuse_a_file_with_a_defect(
    forked: ForkServer, create_malicious: CreateMalicious, name: str, commands: Sequence[tuple[str, ...]]
) -> None:
    check_refused(forked, *create_malicious(name), commands)


def test_a_message_about_witnesses_names_the_version_of_the_file_and_of_the_program(
    create_malicious: CreateMalicious, factored: Path
) -> None:
    path, _ = create_malicious("another witness")
    with h5py.File(path, "r+") as file:
        file.attrs.create("impact_version", np.bytes_(b"0.0.7"))
    seal(path)
    with pytest.raises(ResultError, match=re.escape(f"written by impact 0.0.7, this is {impact.__version__}")):
        impact.load(path)


@pytest.mark.parametrize("name", CYCLES)
def test_a_structure_that_contains_itself_is_refused_before_hdf5_follows_it(
    forked: ForkServer, small: Path, tmp_path: Path, name: str
) -> None:
    # in another process, which HDF5 would kill
    path, (change, message) = tmp_path / "bad.h5", CYCLES[name]
    shutil.copy(small, path)
    change(path)
    seal(path)
    completed = forked("info", path.name, cwd=path.parent)
    assert not completed.timed_out
    assert (completed.returncode, completed.stdout) == (2, ""), completed
    (line,) = completed.stderr.splitlines()
    assert line.startswith("bad.h5: is not a readable result (")
    assert message in line
    assert completed.seconds < MAX_CPU_S
    assert completed.memory < MAX_MEMORY_BYTES


QUICK_KEYS = ("axes",)
SLOW_KEYS = (
    "exponent",
    "parameters",
    "domain",
    "asks_for_e",
    "is_permanent",
    "trajectories",
    "is_shared",
    "stiffness_axes",
)


@pytest.mark.parametrize("key", [*QUICK_KEYS, *(pytest.param(key, marks=pytest.mark.slow) for key in SLOW_KEYS)])
def test_an_invalid_entry_of_a_law_is_refused_or_has_no_effect(factored: Path, tmp_path: Path, key: str) -> None:
    path = tmp_path / "bad.h5"
    refused = 0
    for value in INVALID_LAW_VALUES:
        shutil.copy(factored, path)
        with h5py.File(path, "r+") as file:
            change_law(file, **{key: value})
        seal(path)
        try:
            # any other exception fails this test
            with open_result(path) as opened:
                assert opened.compute()["v1_post"].shape == (2, 2, 2)
        except ResultError:
            refused += 1
    assert refused >= len(INVALID_LAW_VALUES) // 2


def test_a_chunk_of_unexpected_size_is_refused_when_it_is_read(small: Path, tmp_path: Path) -> None:
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
def test_a_defect_that_is_not_read_has_no_effect(
    forked: ForkServer, small: Path, tmp_path: Path, name: str
) -> None:
    path = tmp_path / "odd.h5"
    shutil.copy(small, path)
    HARMLESS[name](path)
    seal(path)
    assert impact.load(path).identical(impact.load(small))
    for command in COMMANDS:
        completed = run_on(forked, path, command)
        assert completed.returncode == 0, command
        assert completed.seconds < MAX_CPU_S, command
        assert completed.memory < MAX_MEMORY_BYTES, command


@pytest.mark.slow
@pytest.mark.parametrize("layout", ["small", "factored"])
def test_no_command_refuses_a_valid_file(
    forked: ForkServer, small: Path, factored: Path, tmp_path: Path, layout: str
) -> None:
    shutil.copy({"small": small, "factored": factored}[layout], tmp_path / "good.h5")
    for command in COMMANDS:
        assert run_on(forked, tmp_path / "good.h5", command).returncode == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "differences.png",
        "good.h5",
        "loop.png",
        "picture.png",
    ]


@pytest.fixture(scope="module")
def with_unknown_variables(small: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result with variables that are not part of the schema."""
    path = tmp_path_factory.mktemp("unknown") / "more.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        for name in ("twice", "thrice", "x\x1b[31m\u202e\n", "_nc4_non_coord_e_out"):
            file.copy("e_out", name)
    seal(path)
    return path


def test_unknown_variables_are_ignored_with_a_warning(small: Path, with_unknown_variables: Path) -> None:
    with pytest.warns(UserWarning, match=r"ignored .*: _nc4_non_coord_e_out, thrice, twice, x"):
        loaded = impact.load(with_unknown_variables)
    assert loaded.identical(impact.load(small))


def test_an_unknown_axis_is_named_where_it_has_coordinates(small: Path, tmp_path: Path) -> None:
    """An axis without coordinates has no values that are ignored."""
    path = tmp_path / "axes.h5"
    shutil.copy(small, path)
    with h5py.File(path, "r+") as file:
        file["with_values"] = [1.0, 2.0]
        file.create_dataset("without_values", (2,), "f8")
        for number, name in enumerate(("with_values", "without_values"), start=100):
            file[name].make_scale()
            file[name].attrs["_Netcdf4Dimid"] = number
    seal(path)
    with pytest.warns(UserWarning, match="ignored .*: with_values$"):
        assert impact.load(path).identical(impact.load(small))


QUICK_COMMANDS = (("info", FILE), ("recommend", FILE))
SLOW_COMMANDS = tuple(command for command in COMMANDS if command not in QUICK_COMMANDS)


@pytest.mark.parametrize(
    "command", [*QUICK_COMMANDS, *(pytest.param(command, marks=pytest.mark.slow) for command in SLOW_COMMANDS)]
)
def test_a_command_prints_a_single_note_about_unknown_variables(
    forked: ForkServer, with_unknown_variables: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    shutil.copy(with_unknown_variables, tmp_path)
    completed = run_on(forked, tmp_path / with_unknown_variables.name, command)
    assert completed.returncode == 0
    note = completed.stderr.splitlines()[0]
    assert note.startswith("note: more.h5: ignored variables")
    assert r"x\x1b[31m\u202e\x0a" in note
    # commands that write a picture also print its path
    assert len(completed.stderr.splitlines()) == 1 + (command[0] not in ("info", "recommend"))


@pytest.mark.slow
def test_compression_by_another_program_is_not_kept(small: Path, tmp_path: Path) -> None:
    result = impact.load(small)
    encoding = {str(name): {"zlib": True, "chunksizes": (1, 1, 1)} for name in ("v1_post", "status")}
    result.to_netcdf(tmp_path / "compressed.h5", engine="h5netcdf", encoding=encoding)
    with pytest.raises(ResultError, match="is of schema version 1, or no result of impact"):
        impact.load(tmp_path / "compressed.h5")
    with xr.open_dataset(tmp_path / "compressed.h5", engine="h5netcdf") as opened:
        impact.save(opened, tmp_path / "saved.h5")
    xr.testing.assert_identical(impact.load(tmp_path / "saved.h5"), result)
