"""A flipped bit is noticed, or does not matter: never other numbers, never a crash, never a hang."""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

import impact
from impact.sweeps.settings import Output

from .forked import Forked

FILE, WHOLE = "FILE", "WHOLE"
COMMANDS = (
    ("info", FILE, "--json"),
    ("plot", FILE, "-o", "picture.png"),
    ("compare", FILE, WHOLE),
    # of the sweep this is a part: variables with NaN are left out
    ("rerun", FILE, "--subset"),
)
FLIPS, FAULTS = 40, 125  # in one test
OF_PACKED = 10  # each takes a process more


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result in which every number counts: none is NaN, whose bits are many."""
    models = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
    point = {"e": [0.2, 0.6, 0.9], "v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "K": 6e9}
    result = impact.sweep({"title": "Small", "models": models, "sweep": point})
    result = result.drop_vars([name for name, one in result.items() if np.isnan(one).any()])
    path = tmp_path_factory.mktemp("whole") / "whole.h5"
    impact.save(result, path)
    return path


@pytest.fixture(scope="session")
def packed(whole: Path) -> Path:
    """The same, packed in pieces."""
    path = whole.with_name("packed.h5")
    impact.save(impact.load(whole), path, output=Output(compression="gzip"))
    return path


def data_bytes(path: Path) -> list[int]:
    """Where the numbers and the labels of a file are."""
    spans: list[tuple[int, int]] = []
    with h5py.File(path) as file:
        for one in file.values():
            if one.chunks is None:
                spans.append((one.id.get_offset(), one.id.get_storage_size()))
            else:
                one.id.chunk_iter(lambda piece: spans.append((piece.byte_offset, piece.size)))
    return [place for start, length in spans for place in range(start, start + length)]


def places(path: Path, count: int, seed: int) -> Iterator[tuple[int, int]]:
    """Bytes and bits: one anywhere, one in the data, one beside the data, and so on."""
    draw = random.Random(seed)
    anywhere, data = range(path.stat().st_size), data_bytes(path)
    beside = sorted(set(anywhere) - set(data))
    for number in range(count):
        yield draw.choice((anywhere, data, beside)[number % 3]), draw.randrange(8)


def told(forked: Forked, path: Path, whole: Path, command: tuple[str, ...]) -> object:
    """What a command makes of a file: the reason why it is refused, or all that it gives."""
    picture = path.parent / "picture.png"
    picture.unlink(missing_ok=True)
    done = forked(*({FILE: path.name, WHOLE: whole}.get(word, word) for word in command), cwd=path.parent)
    assert not done.timed_out
    assert done.returncode in (0, 2), done
    if done.returncode == 2:
        (line,) = done.stderr.splitlines()
        assert line.startswith(f"{path.name}: ")
        assert (done.stdout, picture.exists()) == ("", False)
        return line
    if command[0] in ("compare", "rerun"):
        # the versions of packages are noted, and are no content
        return [line for line in done.stdout.splitlines() if not line.startswith("note: ")]
    if "--json" not in command:
        return done.stdout, picture.read_bytes() if picture.exists() else None
    found = json.loads(done.stdout)
    found.get("attributes", {}).pop("packages", None)
    return found


def check_flips(forked: Forked, whole: Path, folder: Path, count: int, seed: int) -> None:
    good, data = whole.read_bytes(), set(data_bytes(whole))
    path = folder / "flip.h5"
    path.write_bytes(good)
    genuine = {command: told(forked, path, whole, command) for command in COMMANDS}
    counts: Counter[str] = Counter()
    for place, bit in places(whole, count, seed):
        path.write_bytes(good[:place] + bytes([good[place] ^ (1 << bit)]) + good[place + 1 :])
        answers = {command: told(forked, path, whole, command) for command in COMMANDS}
        noticed = [isinstance(answer, str) for answer in answers.values()]
        # all commands agree whether this is a result
        assert len(set(noticed)) == 1, (place, bit, answers)
        if not noticed[0]:
            assert answers == genuine, (place, bit)
            # of what is packed some bits have no meaning, at the end of a piece
            assert place not in data or whole.name == "packed.h5", (place, bit)
        counts[f"{'data' if place in data else 'beside'}: {'noticed' if noticed[0] else 'harmless'}"] += 1
    print(f"{count} flips: {dict(sorted(counts.items()))}")
    assert counts["data: noticed"]
    assert counts["beside: noticed"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_fifty_flips(forked: Forked, whole: Path, packed: Path, tmp_path: Path, seed: int) -> None:
    check_flips(forked, packed if seed else whole, tmp_path, OF_PACKED if seed else FLIPS, seed)


@pytest.mark.faults
@pytest.mark.parametrize("seed", range(2, 10))
def test_a_thousand_flips(forked: Forked, whole: Path, packed: Path, tmp_path: Path, seed: int) -> None:
    check_flips(forked, packed if seed == 3 else whole, tmp_path, FAULTS, seed)
