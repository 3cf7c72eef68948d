"""Kills, power failures and failing disks never lose a finished block nor leave an incomplete result."""

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
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from .faults import (
    BLOCKS,
    CONFIG,
    CONFIG_TEXT,
    FACTORED_CONFIG,
    RESULT,
    WORK,
    FaultReport,
    FinishedSweep,
    Log,
    SweepServer,
    digest,
    finished_blocks,
    mount_tmpfs,
    pick_evenly,
    sweep_duration,
)

# many processes, whose states are read in /proc: `make test-faults` runs them
pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")]
MISSING_SPACE = re.compile(r"; it takes ([\d,]+) bytes more, ([\d,]+) are free; ")
# an atomic change of names, where None removes a name; and the content of a disk, where None is a folder
Change = dict[str, int | None]
State = dict[str, bytes | None]


def test_all_file_operations_of_a_sweep_are_recorded(sweeps: SweepServer) -> None:
    kinds = [entry[0] for entry in sweeps.operations]
    assert kinds.count("fsync") >= 2 * BLOCKS + 4
    assert kinds.count("rename") == BLOCKS + 1
    assert kinds.count("write") > 200
    assert [entry for entry in sweeps.operations if entry[-1] == RESULT] == [["link", f"{RESULT}.part", RESULT]]


# ---- kill -9


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (CONFIG_TEXT, 3),
        (FACTORED_CONFIG, 4),
        pytest.param(CONFIG_TEXT, 20, marks=pytest.mark.faults),
        pytest.param(FACTORED_CONFIG, 20, marks=pytest.mark.faults),
        # all of them
        pytest.param(CONFIG_TEXT, None, marks=pytest.mark.long),
        pytest.param(FACTORED_CONFIG, None, marks=pytest.mark.long),
    ],
)
def test_a_sweep_killed_at_any_file_operation_is_resumed(
    sweeps: SweepServer, text: str, count: int | None
) -> None:
    sweeps = sweeps.with_config(text)
    report = FaultReport("kill -9 at an operation on files", sweeps)
    # a kill after an operation is a kill before the next
    for operation in sweeps.choose_operations(count):
        folder = sweeps.run_killed_at(operation)
        report.resume(folder, finished_blocks(folder), (operation, sweeps.operations[operation][:2]))
        shutil.rmtree(folder)
    report.check()


@pytest.mark.parametrize(
    "count", [2, pytest.param(25, marks=pytest.mark.faults), pytest.param(60, marks=pytest.mark.long)]
)
def test_a_sweep_killed_at_a_random_time_is_resumed(sweeps: SweepServer, count: int) -> None:
    report, generator, longest = (
        FaultReport("kill -9 at a random time", sweeps),
        random.Random(9),
        sweep_duration(sweeps),
    )
    for _ in range(count):
        folder = sweeps.folder()
        running = sweeps.start(cwd=folder)
        running.wait_until("begun")
        time.sleep(generator.uniform(0.0, longest))
        os.kill(running.pid, signal.SIGKILL)
        assert running.wait().returncode in (-signal.SIGKILL, 0)
        report.resume(folder, finished_blocks(folder), "random")
        shutil.rmtree(folder)
    report.check()


def test_a_resumed_sweep_removes_all_temporary_files(sweeps: SweepServer) -> None:
    for words in (("link",), ("unlink", f"{RESULT}.part"), ("unlink", f"{WORK}/plan.json"), ("rmdir",)):
        folder = sweeps.run_killed_at(sweeps.find_operation(*words))
        assert sweeps("--resume", cwd=folder).returncode == 0
        assert sorted(path.name for path in folder.iterdir()) == [CONFIG, RESULT], words


def test_a_result_is_replaced_only_by_a_complete_result(sweeps: SweepServer) -> None:
    old = sweeps.folder()
    assert sweeps(cwd=old).returncode == 0
    text = CONFIG_TEXT.replace("1e-4", "1e-5")
    for operation in sweeps.choose_operations(
        4, first=sweeps.find_operation("fsync", f"{RESULT}.part") - 1, last=sweeps.find_operation("rmdir")
    ):
        folder = sweeps.folder(text)
        shutil.copy(old / RESULT, folder)
        assert sweeps("--overwrite", cwd=folder, fault=("send_signals", operation, signal.SIGKILL)).returncode < 0
        assert digest(folder / RESULT) in (sweeps.expected_digest(old), sweeps.expected_digest(folder))
        assert sweeps("--resume", "--overwrite", cwd=folder).returncode == 0
        assert digest(folder / RESULT) == sweeps.expected_digest(folder)


def test_a_second_name_of_a_result_is_not_overwritten(sweeps: SweepServer) -> None:
    # killed between the link and the removal of the temporary name: both names are the same file
    folder = sweeps.run_killed_at(sweeps.find_operation("unlink", f"{RESULT}.part"))
    expected_digest = sweeps.expected_digest(folder)
    assert digest(folder / RESULT) == expected_digest
    (folder / CONFIG).write_text(CONFIG_TEXT.replace("1e-4", "1e-5"))
    at = ["write", f"{RESULT}.part"]
    assert sweeps("--overwrite", cwd=folder, fault=("send_signals", at, signal.SIGKILL)).returncode < 0
    assert digest(folder / RESULT) in (expected_digest, sweeps.expected_digest(folder))


# ---- power failures


@dataclass
class Disk:
    """What a disk may contain after a power failure: everything that was synced, and any part of the rest.

    A file is identified by a number, a folder by 0. `names` are the synced names, `changes` their later changes
    and `seen` the names that a program sees; `contents` are the synced contents, `writes` the later writes.
    """

    names: dict[str, int] = field(default_factory=dict)
    changes: list[Change] = field(default_factory=list)
    seen: dict[str, int] = field(default_factory=dict)
    contents: dict[int, bytes] = field(default_factory=dict)
    writes: dict[int, list[tuple[int, bytes | None]]] = field(default_factory=dict)

    @classmethod
    def of(cls, folder: Path) -> Disk:
        """A disk with a work folder that is synced."""
        disk = cls({WORK: 0})
        for number, path in enumerate((folder / WORK).iterdir(), 1):
            disk.names[f"{WORK}/{path.name}"], disk.contents[number] = number, path.read_bytes()
        disk.seen = disk.names
        return disk

    def apply(self, kind: str, path: str, *more: Any) -> None:
        """Apply an operation."""
        number = self.seen.get(path, 0)
        if kind == "fsync" and not number:
            synced = [entry for entry in self.changes if parent_folder(next(iter(entry))) == path]
            self.names = apply_changes(self.names, synced)
            self.changes = [entry for entry in self.changes if entry not in synced]
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
            self.seen = apply_changes(self.seen, [change])
            self.changes.append(change)

    def content(self, number: int, count: int, blank: bool = False) -> bytes:
        """The synced content of a file with some later writes; if `blank`, only their space is allocated."""
        content_bytes = bytearray(self.contents[number])
        for offset, content in self.writes.get(number, [])[:count]:
            end = offset + len(content or b"")
            content_bytes.extend(bytes(max(0, end - len(content_bytes))))
            content_bytes[offset : None if content is None else end] = (
                bytes(end - offset) if blank else content or b""
            )
        return bytes(content_bytes)

    def states(self, generator: random.Random) -> Iterator[State]:
        """Possible contents: any of the changes of names, and any part of the writes."""
        some = [entry for entry in self.changes if generator.random() < 0.5]
        for changes in (self.changes, [], self.changes[-1:], self.changes[1:], some):
            names = apply_changes(self.names, changes)
            for part in ("all", "none", "half", "blank", "some"):
                state: State = {}
                # without its folder a file does not exist
                for path, number in names.items():
                    if parent_folder(path) == "." or parent_folder(path) in names:
                        most = len(self.writes.get(number, ()))
                        count = {"none": 0, "half": most // 2, "some": generator.randint(0, most)}.get(part, most)
                        state[path] = self.content(number, count, part == "blank") if number else None
                yield state


def parent_folder(path: str) -> str:
    return os.path.dirname(path) or "."


def apply_changes(names: dict[str, int], changes: list[Change]) -> dict[str, int]:
    for change in changes:
        names = {path: number for path, number in (names | change).items() if number is not None}
    return names


def states_after_cuts(disk: Disk, log: Log, cuts: list[int]) -> Iterator[tuple[State, set[int], str]]:
    """Distinct possible contents after power failures at entries of a log, and the blocks kept by then."""
    generator, kept, known = random.Random(1), set(), set()
    for at, (kind, *what) in enumerate(log):
        if kind == "kept":
            kept.add(what[0])
        elif kind not in ("begun", "ended", "none"):
            disk.apply(kind, *what)
        for state in disk.states(generator) if at in cuts else ():
            key = hash((*sorted((path, content or b"") for path, content in state.items()), *kept))
            if key not in known:
                known.add(key)
                yield state, set(kept), f"after {at}, {kind} {what[:1]}"


def create_folder(sweeps: SweepServer, state: State, text: str = "") -> Path:
    """Create a folder with this content."""
    folder = sweeps.folder(text)
    for path, content in sorted(state.items()):
        if content is None:
            (folder / path).mkdir()
        else:
            (folder / path).write_bytes(content)
    return folder


# when the result or a block gets its name, at the end, and at any operation
@pytest.mark.parametrize(
    ("text", "kinds", "writes"),
    [
        (CONFIG_TEXT, {"link"}, 0),
        (CONFIG_TEXT, {"rename", "rmdir"}, 0),
        (FACTORED_CONFIG, {"link"}, 0),
        pytest.param(CONFIG_TEXT, None, 10, marks=pytest.mark.faults),
        pytest.param(CONFIG_TEXT, None, 60, marks=pytest.mark.long),
    ],
)
def test_a_sweep_is_resumed_after_a_power_failure_at_any_operation(
    sweeps: SweepServer, text: str, kinds: set[str] | None, writes: int
) -> None:
    sweeps = sweeps.with_config(text)
    kinds = kinds or ({entry[0] for entry in sweeps.operations} | {"kept"}) - {"write"}
    report = FaultReport("power failure", sweeps)
    log = sweeps(cwd=sweeps.folder(), fault=("record_operations",)).log
    cuts = [at for at, entry in enumerate(log) if entry[0] in kinds]
    cuts += pick_evenly([at for at, entry in enumerate(log) if entry[0] == "write"], writes)
    for state, kept, at in states_after_cuts(Disk(), log, cuts):
        folder = create_folder(sweeps, state)
        report.resume(folder, kept, at)
        shutil.rmtree(folder)
    report.check()


def test_without_fsync_a_power_failure_leaves_an_incomplete_result_and_loses_blocks(sweeps: SweepServer) -> None:
    report = FaultReport("power failure without fsync", sweeps)
    log = sweeps(cwd=sweeps.folder(), fault=("record_operations", False)).log
    cuts = [
        [entry[0] for entry in log].index("link"),
        max(at for at, entry in enumerate(log) if entry[0] == "kept"),
    ]
    for state, kept, at in states_after_cuts(Disk(), log, cuts):
        if RESULT in state or len(state) > BLOCKS + 1:
            report.resume(create_folder(sweeps, state), kept, at)
        if report.lost and report.wrong:
            return
    pytest.fail("no block was lost, or no result was incomplete")


def test_a_power_failure_while_another_sweep_replaces_the_work_folder(sweeps: SweepServer) -> None:
    # the work folder of a sweep, which another sweep overwrites
    old, text = sweeps.copy_finished(), CONFIG_TEXT.replace("1e-4", "1e-5")
    before = Disk.of(old)
    (old / CONFIG).write_text(text)
    log = sweeps("--overwrite", cwd=old, fault=("record_operations",)).log
    last = [entry[0] for entry in log].index("write")
    for state, _, at in states_after_cuts(before, log, list(range(last + 5))):
        folder = create_folder(sweeps, state, text)
        completed = sweeps("--resume", cwd=folder)
        # until the new plan is written, the folder belongs to the other sweep
        assert completed.returncode == 0 or "belongs to another sweep" in completed.stderr, (at, completed)
        if completed.returncode == 0:
            assert digest(folder / RESULT) == sweeps.expected_digest(folder), (at, completed)
        shutil.rmtree(folder)


# ---- full and failing disks


def check_storage_error(completed: FinishedSweep, folder: Path) -> set[int]:
    """Check that a storage error prints one line with the flag to continue, and that finished blocks are kept."""
    assert completed.returncode == 4, completed
    assert (completed.stderr.count("\n"), completed.stdout) == (1, "")
    assert completed.stderr.endswith("; --resume continues\n"), completed
    assert not (folder / RESULT).exists()
    assert completed.kept <= finished_blocks(folder)
    return finished_blocks(folder)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (CONFIG_TEXT, 2),
        (FACTORED_CONFIG, 3),
        pytest.param(CONFIG_TEXT, 15, marks=pytest.mark.faults),
        pytest.param(FACTORED_CONFIG, 15, marks=pytest.mark.faults),
        pytest.param(CONFIG_TEXT, 120, marks=pytest.mark.long),
        pytest.param(FACTORED_CONFIG, 60, marks=pytest.mark.long),
    ],
)
def test_a_sweep_is_resumed_after_a_disk_error_at_any_operation(
    sweeps: SweepServer, text: str, count: int
) -> None:
    sweeps = sweeps.with_config(text)
    first, last = sweeps.find_operation("create", f"{WORK}/block.part"), sweeps.find_operation("link")
    for number, name in ((errno.ENOSPC, "full disk"), (errno.EIO, "input/output error")):
        report = FaultReport(f"{name} at an operation on files", sweeps)
        for operation in sweeps.choose_operations(count, first, last):
            if number == errno.ENOSPC and sweeps.operations[operation][0] not in ("write", "create"):
                continue
            folder = sweeps.folder()
            completed = sweeps(cwd=folder, fault=("fail_disk", operation, number))
            kept = check_storage_error(completed, folder)
            assert number != errno.ENOSPC or MISSING_SPACE.search(completed.stderr)
            report.resume(folder, kept, operation)
            shutil.rmtree(folder)
        report.check()


def test_a_disk_error_before_the_first_block_leaves_no_trace_or_prints_how_to_continue(
    sweeps: SweepServer,
) -> None:
    for operation in (sweeps.find_operation("create", f"{WORK}/lock"), sweeps.find_operation("write")):
        for number in (errno.ENOSPC, errno.EIO):
            folder = sweeps.folder()
            completed = sweeps(cwd=folder, fault=("fail_disk", operation, number))
            assert not sweeps(cwd=folder).returncode or "--resume" in completed.stderr, completed


def test_a_disk_error_after_the_result_is_stored_does_not_damage_it(sweeps: SweepServer) -> None:
    for operation in range(sweeps.find_operation("unlink", f"{RESULT}.part"), len(sweeps.operations), 2):
        folder = sweeps.folder()
        completed = sweeps(cwd=folder, fault=("fail_disk", operation, errno.EIO))
        assert digest(folder / RESULT) == sweeps.expected_digest(folder)
        assert completed.returncode in (0, 4), (operation, sweeps.operations[operation], completed)


@pytest.mark.parametrize("size", [4_000, 8_000, 20_000])
def test_a_sweep_is_resumed_after_the_limit_of_file_sizes_was_reached(sweeps: SweepServer, size: int) -> None:
    report, folder = FaultReport(f"file size limit of {size} bytes", sweeps), sweeps.folder()
    kept = check_storage_error(sweeps(cwd=folder, fault=("limit_file_size", size)), folder)
    report.resume(folder, kept, size)
    report.check()


# the last size is that of a file system that is full when the result is assembled
@pytest.mark.parametrize("size", [8, 24, 44, 52])
def test_a_full_file_system_is_reported_with_the_missing_space(
    sweeps: SweepServer, tmp_path: Path, size: int
) -> None:
    report, folder = FaultReport("full file system", sweeps), tmp_path / "small"
    with mount_tmpfs(folder, f"size={size}k"):
        (folder / CONFIG).write_text(CONFIG_TEXT)
        completed = sweeps(cwd=folder)
        kept = check_storage_error(completed, folder)
        match = MISSING_SPACE.search(completed.stderr)
        assert match, completed
        needed, free = (int(size_text.replace(",", "")) for size_text in match.groups())
        assert needed > free, (size, completed.stderr)
        subprocess.run(["mount", "-o", "remount,size=1M", folder], check=True)
        report.resume(folder, kept, size)
    report.check()
