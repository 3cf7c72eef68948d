"""No completed work is ever lost, and what looks like a result is whole: kills, power cuts and disks that fail."""

from __future__ import annotations

import errno
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from .faults import (
    BLOCKS,
    CONFIG,
    FACTORED,
    RESULT,
    TEXT,
    WORK,
    Done,
    Log,
    Sweeps,
    Tally,
    digest,
    duration,
    evenly,
    kept_in,
    mounted,
    sweeping,
)  # fmt: skip

# processes and their open files are looked up in /proc
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
ROOM = re.compile(r"; it takes ([\d,]+) bytes more, ([\d,]+) are free; ")
# changes of names in one stroke, and what stands on a disk; None is a name that goes, and a folder
Change = dict[str, int | None]
State = dict[str, bytes | None]


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sweeps]:
    with sweeping(tmp_path_factory.mktemp("faults")) as server:
        yield server


def test_the_faults_meet_all_that_a_sweep_does_with_files(sweeps: Sweeps) -> None:
    kinds = [one[0] for one in sweeps.operations]
    assert kinds.count("fsync") >= 2 * BLOCKS + 4
    assert kinds.count("rename") == BLOCKS + 1
    assert kinds.count("write") > 200
    assert [one for one in sweeps.operations if one[-1] == RESULT] == [["link", f"{RESULT}.part", RESULT]]


# ---- kill -9


def check_kills(sweeps: Sweeps, count: int | None) -> None:
    tally = Tally("kill -9 at an operation on files", sweeps)
    # right after an operation is right before the next
    for place in sweeps.places(count):
        folder = sweeps.left(place)
        tally.resumed(folder, kept_in(folder), (place, sweeps.operations[place][:2]))
        shutil.rmtree(folder)
    tally.end()


@pytest.mark.parametrize(("text", "count"), [(TEXT, 10), (FACTORED, 4)])
def test_killed_at_an_operation(sweeps: Sweeps, text: str, count: int) -> None:
    check_kills(sweeps.of(text), count)


@pytest.mark.faults
@pytest.mark.parametrize("text", [TEXT, FACTORED])
def test_killed_at_every_operation(sweeps: Sweeps, text: str) -> None:
    check_kills(sweeps.of(text), None)


def check_random_kills(sweeps: Sweeps, count: int) -> None:
    tally, draw, longest = Tally("kill -9 at a random moment", sweeps), random.Random(9), duration(sweeps)
    for _ in range(count):
        folder = sweeps.folder()
        running = sweeps.start(cwd=folder)
        running.until("begun")
        time.sleep(draw.uniform(0.0, longest))
        os.kill(running.pid, signal.SIGKILL)
        assert running.wait().returncode in (-signal.SIGKILL, 0)
        tally.resumed(folder, kept_in(folder), "random")
        shutil.rmtree(folder)
    tally.end()


def test_killed_at_a_random_moment(sweeps: Sweeps) -> None:
    check_random_kills(sweeps, 3)


@pytest.mark.faults
def test_killed_at_many_random_moments(sweeps: Sweeps) -> None:
    check_random_kills(sweeps, 60)


def test_a_resumed_sweep_leaves_nothing_behind(sweeps: Sweeps) -> None:
    for words in (("link",), ("unlink", f"{RESULT}.part"), ("unlink", f"{WORK}/plan.json"), ("rmdir",)):
        folder = sweeps.left(sweeps.place(*words))
        assert sweeps("--resume", cwd=folder).returncode == 0
        assert sorted(path.name for path in folder.iterdir()) == [CONFIG, RESULT], words


def test_a_result_that_is_to_be_replaced_stays_until_the_other_is_whole(sweeps: Sweeps) -> None:
    old = sweeps.folder()
    assert sweeps(cwd=old).returncode == 0
    text = TEXT.replace("1e-4", "1e-5")
    for place in sweeps.places(4, first=sweeps.place("fsync", f"{RESULT}.part") - 1, last=sweeps.place("rmdir")):
        folder = sweeps.folder(text)
        shutil.copy(old / RESULT, folder)
        assert sweeps("--overwrite", cwd=folder, fault=("signalled", place, signal.SIGKILL)).returncode < 0
        assert digest(folder / RESULT) in (sweeps.right(old), sweeps.right(folder))
        assert sweeps("--resume", "--overwrite", cwd=folder).returncode == 0
        assert digest(folder / RESULT) == sweeps.right(folder)


def test_a_result_is_no_part_of_the_next(sweeps: Sweeps) -> None:
    # killed between the link and the unlink of the other name
    folder = sweeps.left(sweeps.place("unlink", f"{RESULT}.part"))
    right = sweeps.right(folder)
    assert digest(folder / RESULT) == right
    (folder / CONFIG).write_text(TEXT.replace("1e-4", "1e-5"))
    at = ["write", f"{RESULT}.part"]
    assert sweeps("--overwrite", cwd=folder, fault=("signalled", at, signal.SIGKILL)).returncode < 0
    assert digest(folder / RESULT) in (right, sweeps.right(folder))


# ---- power cuts


@dataclass
class Disk:
    """What a disk may hold after a power cut: what was synced for certain, and of the rest any part.

    A file is a number, a folder is 0. Of the names there are those that were synced, their changes since, and all
    as a program sees them; of the contents what was synced, and the writes since.
    """

    names: dict[str, int] = field(default_factory=dict)
    changes: list[Change] = field(default_factory=list)
    seen: dict[str, int] = field(default_factory=dict)
    contents: dict[int, bytes] = field(default_factory=dict)
    writes: dict[int, list[tuple[int, bytes | None]]] = field(default_factory=dict)

    @classmethod
    def of(cls, folder: Path) -> Disk:
        """A work folder that was synced long ago."""
        disk = cls({WORK: 0})
        for number, path in enumerate((folder / WORK).iterdir(), 1):
            disk.names[f"{WORK}/{path.name}"], disk.contents[number] = number, path.read_bytes()
        disk.seen = disk.names
        return disk

    def play(self, kind: str, path: str, *more: Any) -> None:
        """What an operation does."""
        number = self.seen.get(path, 0)
        if kind == "fsync" and not number:
            here = [one for one in self.changes if parent(next(iter(one))) == path]
            self.names = changed(self.names, here)
            self.changes = [one for one in self.changes if one not in here]
        elif kind == "fsync":
            self.contents[number] = self.content(number, len(self.writes.get(number, ())))
            self.writes[number] = []
        elif kind == "write":
            self.writes.setdefault(number, []).append((more[0], bytes.fromhex(more[1])))
        elif kind == "truncate" or (kind == "create" and number):
            self.writes.setdefault(number, []).append((more[0] if more else 0, None))
        else:
            if kind == "create":
                number = len(self.contents) + 1
                self.contents[number] = b""
            gone: Change = {path: None} if kind in ("rename", "unlink", "rmdir") else {}
            change = gone | ({more[0]: number} if more else {} if gone else {path: number})
            self.seen = changed(self.seen, [change])
            self.changes.append(change)

    def content(self, number: int, count: int, blank: bool = False) -> bytes:
        """A file as it was synced with so many of the later writes; or with no more than the room for them."""
        held = bytearray(self.contents[number])
        for offset, content in self.writes.get(number, [])[:count]:
            end = offset + len(content or b"")
            held.extend(bytes(max(0, end - len(held))))
            held[offset : None if content is None else end] = bytes(end - offset) if blank else content or b""
        return bytes(held)

    def states(self, draw: random.Random) -> Iterator[State]:
        """What may be there: any of the changes of names, and any part of the writes."""
        some = [one for one in self.changes if draw.random() < 0.5]
        for changes in (self.changes, [], self.changes[-1:], self.changes[1:], some):
            names = changed(self.names, changes)
            for part in ("all", "none", "half", "blank", "some"):
                state: State = {}
                # what stands in a folder that is not there is not there
                for path, number in names.items():
                    if parent(path) == "." or parent(path) in names:
                        most = len(self.writes.get(number, ()))
                        count = {"none": 0, "half": most // 2, "some": draw.randint(0, most)}.get(part, most)
                        state[path] = self.content(number, count, part == "blank") if number else None
                yield state


def parent(path: str) -> str:
    return os.path.dirname(path) or "."


def changed(names: dict[str, int], changes: list[Change]) -> dict[str, int]:
    for change in changes:
        names = {path: number for path, number in (names | change).items() if number is not None}
    return names


def after_cuts(disk: Disk, log: Log, cuts: list[int]) -> Iterator[tuple[State, set[int], str]]:
    """What may be on a disk after a cut at some places of a log, each once, and the blocks kept by then."""
    draw, kept, known = random.Random(1), set(), set()
    for at, (kind, *what) in enumerate(log):
        if kind == "kept":
            kept.add(what[0])
        elif kind not in ("begun", "ended", "none"):
            disk.play(kind, *what)
        for state in disk.states(draw) if at in cuts else ():
            key = hash((*sorted((path, content or b"") for path, content in state.items()), *kept))
            if key not in known:
                known.add(key)
                yield state, set(kept), f"after {at}, {kind} {what[:1]}"


def laid_out(sweeps: Sweeps, state: State, text: str = "") -> Path:
    """A folder in such a state."""
    folder = sweeps.folder(text)
    for path, content in sorted(state.items()):
        if content is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(content)
    return folder


def check_power_cuts(sweeps: Sweeps, kinds: set[str], writes: int) -> None:
    tally = Tally("power cut", sweeps)
    log = sweeps(cwd=sweeps.folder(), fault=("recorded",)).log
    cuts = [at for at, one in enumerate(log) if one[0] in kinds]
    cuts += evenly([at for at, one in enumerate(log) if one[0] == "write"], writes)
    for state, kept, at in after_cuts(Disk(), log, cuts):
        folder = laid_out(sweeps, state)
        tally.resumed(folder, kept, at)
        shutil.rmtree(folder)
    tally.end()


@pytest.mark.parametrize(("text", "kinds"), [(TEXT, {"link", "rename", "rmdir"}), (FACTORED, {"link"})])
def test_power_cuts(sweeps: Sweeps, text: str, kinds: set[str]) -> None:
    # where a name appears, and when all is done
    check_power_cuts(sweeps.of(text), kinds, 0)


@pytest.mark.faults
def test_many_power_cuts(sweeps: Sweeps) -> None:
    kinds = {one[0] for one in sweeps.operations} | {"kept"}
    check_power_cuts(sweeps, kinds - {"write"}, 60)


def test_without_fsync_a_power_cut_shows_half_a_result_and_loses_blocks(sweeps: Sweeps) -> None:
    tally = Tally("power cut without fsync", sweeps)
    log = sweeps(cwd=sweeps.folder(), fault=("recorded", False)).log
    cuts = [[one[0] for one in log].index("link"), max(at for at, one in enumerate(log) if one[0] == "kept")]
    for state, kept, at in after_cuts(Disk(), log, cuts):
        if RESULT in state or len(state) > BLOCKS + 1:
            tally.resumed(laid_out(sweeps, state), kept, at)
        if tally.lost and tally.wrong:
            return
    pytest.fail("neither lost nor half")


def test_a_power_cut_while_another_sweep_begins_anew(sweeps: Sweeps) -> None:
    # what is left of a sweep, and another that throws it away
    old, text = sweeps.copied(), TEXT.replace("1e-4", "1e-5")
    before = Disk.of(old)
    (old / CONFIG).write_text(text)
    log = sweeps("--overwrite", cwd=old, fault=("recorded",)).log
    last = [one[0] for one in log].index("write")
    for state, _, at in after_cuts(before, log, list(range(last + 5))):
        folder = laid_out(sweeps, state, text)
        done = sweeps("--resume", cwd=folder)
        # before the new plan is there, it is the other sweep's folder
        assert done.returncode == 0 or "belongs to another sweep" in done.stderr, (at, done)
        if done.returncode == 0:
            assert digest(folder / RESULT) == sweeps.right(folder), (at, done)
        shutil.rmtree(folder)


# ---- disks that are full or fail


def check_kept(done: Done, folder: Path) -> set[int]:
    """A storage error is one line that says how to go on, and what was finished stands there."""
    assert done.returncode == 4, done
    assert (done.stderr.count("\n"), done.stdout) == (1, "")
    assert done.stderr.endswith("; --resume continues\n"), done
    assert not (folder / RESULT).exists()
    assert done.kept <= kept_in(folder)
    return kept_in(folder)


def check_failures(sweeps: Sweeps, count: int | None) -> None:
    first, last = sweeps.place("create", f"{WORK}/block.part"), sweeps.place("link")
    for number, name in ((errno.ENOSPC, "full disk"), (errno.EIO, "input/output error")):
        tally = Tally(f"{name} at an operation on files", sweeps)
        for place in sweeps.places(count, first, last):
            if number == errno.ENOSPC and sweeps.operations[place][0] not in ("write", "create"):
                continue
            folder = sweeps.folder()
            done = sweeps(cwd=folder, fault=("failing", place, number))
            kept = check_kept(done, folder)
            assert number != errno.ENOSPC or ROOM.search(done.stderr)
            tally.resumed(folder, kept, place)
            shutil.rmtree(folder)
        tally.end()


@pytest.mark.parametrize(("text", "count"), [(TEXT, 5), (FACTORED, 3)])
def test_a_disk_that_fails(sweeps: Sweeps, text: str, count: int) -> None:
    check_failures(sweeps.of(text), count)


@pytest.mark.faults
@pytest.mark.parametrize(("text", "count"), [(TEXT, 120), (FACTORED, 40)])
def test_a_disk_that_fails_at_any_operation(sweeps: Sweeps, text: str, count: int) -> None:
    check_failures(sweeps.of(text), count)


def test_a_disk_that_fails_before_the_first_block_says_how_to_go_on(sweeps: Sweeps) -> None:
    for place in (sweeps.place("create", f"{WORK}/lock"), sweeps.place("write")):
        for number in (errno.ENOSPC, errno.EIO):
            folder = sweeps.folder()
            done = sweeps(cwd=folder, fault=("failing", place, number))
            assert not sweeps(cwd=folder).returncode or "--resume" in done.stderr, done


def test_a_disk_that_fails_when_the_result_is_there(sweeps: Sweeps) -> None:
    for place in range(sweeps.place("unlink", f"{RESULT}.part"), len(sweeps.operations), 2):
        folder = sweeps.folder()
        done = sweeps(cwd=folder, fault=("failing", place, errno.EIO))
        assert digest(folder / RESULT) == sweeps.right(folder)
        assert done.returncode in (0, 4), (place, sweeps.operations[place], done)


@pytest.mark.parametrize("size", [4_000, 8_000, 20_000])
def test_files_of_a_limited_size(sweeps: Sweeps, size: int) -> None:
    tally, folder = Tally(f"files of no more than {size} bytes", sweeps), sweeps.folder()
    kept = check_kept(sweeps(cwd=folder, fault=("limited", size)), folder)
    tally.resumed(folder, kept, size)
    tally.end()


def check_full_disks(sweeps: Sweeps, folder: Path, sizes: Iterable[int]) -> None:
    tally = Tally("a file system that is full", sweeps)
    for size in sizes:
        with mounted(folder, f"size={size}k"):
            (folder / CONFIG).write_text(TEXT)
            done = sweeps(cwd=folder)
            kept = check_kept(done, folder)
            found = ROOM.search(done.stderr)
            assert found, done
            wanted, free = (int(one.replace(",", "")) for one in found.groups())
            assert wanted > free, (size, done.stderr)
            subprocess.run(["mount", "-o", "remount,size=1M", folder], check=True)
            tally.resumed(folder, kept, size)
    tally.end()


def test_a_full_file_system(sweeps: Sweeps, tmp_path: Path) -> None:
    check_full_disks(sweeps, tmp_path / "small", (8, 24, 44))


def test_a_file_system_that_is_full_at_the_end(sweeps: Sweeps, tmp_path: Path) -> None:
    check_full_disks(sweeps, tmp_path / "small", (52,))
