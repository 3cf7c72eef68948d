"""Flipped bits, truncations and appended bytes are detected before the HDF5 library reads a file."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.errors import ResultError
from impact.results.seal import USER_BLOCK_BYTES, check_seal

from .conftest import ROOT, Run

FLIPS, HEADER_FLIPS, COMMAND_FLIPS = 1_000, 200, 1
LAYOUTS = ("full", "factored")
COMMANDS = (("info", "flip.h5"), ("plot", "flip.h5", "-o", "picture.png"), ("compare", "flip.h5", "good.h5"))


@pytest.fixture(scope="module", params=LAYOUTS)
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small result in each layout."""
    path = tmp_path_factory.mktemp(request.param) / "good.h5"
    overrides = [f"output.layout={request.param}", "sweep.e.linspace=[0, 1, 21]", "solver.rtol=1e-4"]
    impact.sweep_to_file(ROOT / "configs" / "figure6.toml", path, overrides=overrides)
    assert impact.load(path).encoding["layout"] == request.param
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("small") / "small.h5"
    point = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    impact.save(impact.sweep({"models": "hertz", "sweep": point, "output": {"variables": ["e_out"]}}), path)
    return path


def flips(size: int, count: int, seed: int) -> Iterator[tuple[int, int]]:
    """Random positions and bits of a file."""
    draw = random.Random(seed)
    for _ in range(count):
        yield draw.randrange(size), 1 << draw.randrange(8)


def check_flips(path: Path, content: bytes, positions: Iterator[tuple[int, int]]) -> None:
    """`impact.load` refuses the file with each bit flipped, and reads it with none."""
    path.write_bytes(content)
    with path.open("r+b", buffering=0) as file:
        for position, bit in positions:
            file.seek(position)
            file.write(bytes([content[position] ^ bit]))
            with pytest.raises(ResultError) as refused:
                impact.load(path)
            assert str(refused.value).startswith(f"{path}: "), (position, bit)
            # the reason is the seal or the header with the seal: nothing of the content was parsed
            words = ("is damaged: ", "is not a readable result (it does not begin", "has schema version ")
            assert any(word in str(refused.value) for word in words), (position, bit, str(refused.value))
            file.seek(position)
            file.write(content[position : position + 1])
    impact.load(path)


@pytest.mark.slow
def test_each_of_many_random_flips_is_detected(good: Path, tmp_path: Path) -> None:
    content = good.read_bytes()
    check_flips(tmp_path / "flip.h5", content, flips(len(content), FLIPS, 1))


def test_each_flip_of_the_header_is_detected(good: Path, tmp_path: Path) -> None:
    """In the magic line, the schema version, the digest and the padding."""
    content = good.read_bytes()
    positions = [(position, 1 << position % 8) for position in range(130)]
    check_flips(tmp_path / "flip.h5", content, iter([*positions, *flips(USER_BLOCK_BYTES, HEADER_FLIPS, 2)]))


@pytest.mark.slow
def test_the_commands_refuse_a_flipped_bit(good: Path, cli: Run, tmp_path: Path) -> None:
    content = good.read_bytes()
    (tmp_path / "good.h5").write_bytes(content)
    # in the digest, in the padding, and at a random position
    for position, bit in [(40, 1), (USER_BLOCK_BYTES - 1, 128), *flips(len(content), COMMAND_FLIPS, 3)]:
        flipped = bytearray(content)
        flipped[position] ^= bit
        (tmp_path / "flip.h5").write_bytes(flipped)
        for command in COMMANDS:
            done = cli(*command, cwd=tmp_path)
            assert (done.returncode, done.stdout) == (2, ""), (position, bit, done)
            (line,) = done.stderr.splitlines()
            assert line.startswith("flip.h5: is damaged: the SHA-256 of its content")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flip.h5", "good.h5"]


@pytest.mark.parametrize("step", [29, pytest.param(1, marks=pytest.mark.slow)])
def test_every_truncation_is_detected(small: Path, tmp_path: Path, step: int) -> None:
    """At any length of the header and of the last bytes, and at each step between."""
    content = small.read_bytes()
    path = tmp_path / "cut.h5"
    path.write_bytes(content)
    assert check_seal(path)
    with path.open("r+b") as file:
        header, end = range(USER_BLOCK_BYTES + 10), range(len(content) - 100, len(content))
        for length in sorted({*header, *range(0, len(content), step), *end}, reverse=True):
            file.truncate(length)
            with pytest.raises(ResultError):
                impact.load(path)


@pytest.mark.parametrize("more", [b"\0", b"x", b"\0" * 4096])
def test_appended_bytes_are_detected(good: Path, tmp_path: Path, more: bytes) -> None:
    path = tmp_path / "more.h5"
    for content in (good.read_bytes() + more, more + good.read_bytes()):
        path.write_bytes(content)
        with pytest.raises(ResultError):
            impact.load(path)
