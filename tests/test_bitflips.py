"""Every changed bit, every truncation and every byte more is found, before the HDF5 library reads the file."""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.errors import ResultError
from impact.results.seal import USER_BLOCK_BYTES, check_seal

from .conftest import ROOT, Run

FLIPS, OF_HEADER, OF_COMMANDS = 1_000, 200, 3
LAYOUTS = ("full", "factored")
COMMANDS = (("info", "flip.h5"), ("plot", "flip.h5", "-o", "picture.png"), ("compare", "flip.h5", "good.h5"))


@pytest.fixture(scope="module", params=LAYOUTS)
def good(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, cli: Run) -> Path:
    """The result of configs/figure6.toml in a layout, as the command line writes it."""
    path = tmp_path_factory.mktemp(request.param) / "good.h5"
    layout = f"output.layout={request.param}"
    assert cli("sweep", ROOT / "configs" / "figure6.toml", "--set", layout, "-o", path).returncode == 0
    assert impact.load(path).encoding["layout"] == request.param
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("small") / "small.h5"
    point = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    impact.save(impact.sweep({"models": "hertz", "sweep": point, "output": {"variables": ["e_out"]}}), path)
    return path


def flips(size: int, count: int, seed: int) -> Iterator[tuple[int, int]]:
    """Places and bits, at random."""
    draw = random.Random(seed)
    for _ in range(count):
        yield draw.randrange(size), 1 << draw.randrange(8)


def check_flips(path: Path, content: bytes, places: Iterator[tuple[int, int]]) -> None:
    """`impact.load` refuses the file with each bit flipped, and reads it with none."""
    path.write_bytes(content)
    with path.open("r+b", buffering=0) as file:
        for place, bit in places:
            file.seek(place)
            file.write(bytes([content[place] ^ bit]))
            with pytest.raises(ResultError) as refused:
                impact.load(path)
            assert str(refused.value).startswith(f"{path}: "), (place, bit)
            # of what it holds nothing is read: the reason is the seal, or the 512 bytes that have it
            words = ("is damaged: ", "is not a readable result (it does not begin", "has schema version ")
            assert any(word in str(refused.value) for word in words), (place, bit, str(refused.value))
            file.seek(place)
            file.write(content[place : place + 1])
    impact.load(path)


def test_each_of_a_thousand_flips_is_found(good: Path, tmp_path: Path) -> None:
    content = good.read_bytes()
    check_flips(tmp_path / "flip.h5", content, flips(len(content), FLIPS, 1))


def test_each_flip_of_the_header_is_found(good: Path, tmp_path: Path) -> None:
    """In the magic line, the schema version, the digest and the padding."""
    content = good.read_bytes()
    places = [(place, 1 << place % 8) for place in range(130)]
    check_flips(tmp_path / "flip.h5", content, iter([*places, *flips(USER_BLOCK_BYTES, OF_HEADER, 2)]))


def test_the_commands_refuse_a_flipped_bit(good: Path, cli: Run, tmp_path: Path) -> None:
    content = good.read_bytes()
    (tmp_path / "good.h5").write_bytes(content)
    # in the digest, in the padding, and anywhere
    for place, bit in [(40, 1), (USER_BLOCK_BYTES - 1, 128), *flips(len(content), OF_COMMANDS, 3)]:
        (tmp_path / "flip.h5").write_bytes(content[:place] + bytes([content[place] ^ bit]) + content[place + 1 :])
        for command in COMMANDS:
            done = cli(*command, cwd=tmp_path)
            assert (done.returncode, done.stdout) == (2, ""), (place, bit, done)
            (line,) = done.stderr.splitlines()
            assert line.startswith("flip.h5: is damaged: the SHA-256 of its content")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["flip.h5", "good.h5"]


def test_every_truncation_is_found(small: Path, tmp_path: Path) -> None:
    content = small.read_bytes()
    path = tmp_path / "cut.h5"
    path.write_bytes(content)
    assert check_seal(path)
    with path.open("r+b") as file:
        for length in reversed(range(len(content))):
            file.truncate(length)
            with pytest.raises(ResultError):
                impact.load(path)


@pytest.mark.parametrize("more", [b"\0", b"x", b"\0" * 4096])
def test_what_is_appended_is_found(good: Path, tmp_path: Path, more: bytes) -> None:
    path = tmp_path / "more.h5"
    for content in (good.read_bytes() + more, more + good.read_bytes()):
        path.write_bytes(content)
        with pytest.raises(ResultError):
            impact.load(path)
