"""A second sweep, a leftover work folder or a signal never damages a result."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import time
import zipfile
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

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
    RunningSweep,
    SweepServer,
    digest,
    finished_blocks,
    mount_tmpfs,
    pick_evenly,
    process_state,
    sweep_duration,
    wait_until,
)

# many processes, whose states are read in /proc: `make test-faults` runs them
pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")]
ALL_BLOCKS = set(range(BLOCKS))
FLAGS = ((), ("--overwrite",), ("--resume",))
# long enough to be interrupted between blocks; and slow enough to be interrupted within them
LONG_CONFIG = CONFIG_TEXT.replace("100]", "640]")
SLOW_CONFIG = LONG_CONFIG.replace("1e-4", "1e-10")
LONG_BLOCKS = 11


def snapshot(folder: Path) -> dict[str, object]:
    """The modes, modification times and contents of all files in a folder."""
    files: dict[str, object] = {}
    for path in folder.rglob("*"):
        about = path.lstat()
        content = path.read_bytes() if path.is_file() and not path.is_symlink() else None
        target = os.readlink(path) if path.is_symlink() else None
        files[str(path.relative_to(folder))] = about.st_mode, about.st_mtime_ns, content, target
    return files


def check_refused(sweeps: SweepServer, folder: Path, *words: str | int, message: str = "") -> FinishedSweep:
    """Check that a sweep exits with 2 and one line before it integrates, and changes no file."""
    before = snapshot(folder)
    completed = sweeps(*words, cwd=folder)
    assert (completed.returncode, completed.stdout, completed.stderr.count("\n"), completed.kept) == (
        2,
        "",
        1,
        set(),
    ), completed
    assert message in completed.stderr, completed
    assert snapshot(folder) == before
    return completed


# ---- a path in the way of the work folder or of the result


def test_a_leftover_work_folder_is_not_changed_without_a_flag(sweeps: SweepServer) -> None:
    folder = sweeps.run_killed_at(sweeps.find_operation("create", f"{WORK}/block.part"))
    for flag in ("--resume", "--overwrite"):
        check_refused(sweeps, folder, message=flag)
    # --overwrite starts the sweep again
    folder = sweeps.copy_finished()
    completed = sweeps("--overwrite", cwd=folder)
    assert (completed.returncode, completed.kept, digest(folder / RESULT)) == (
        0,
        ALL_BLOCKS,
        sweeps.expected_digest(folder),
    )


def is_folder(path: Path) -> None:
    path.mkdir()


def is_fifo(path: Path) -> None:
    os.mkfifo(path)


def is_link(path: Path) -> None:
    path.symlink_to(path.parents[path.parent.name == WORK] / CONFIG)


def is_text(path: Path) -> None:
    path.write_text("precious")


def is_link_to_a_folder(path: Path) -> None:
    path.symlink_to(path.parent)


def is_link_to_nothing(path: Path) -> None:
    path.symlink_to("nowhere")


@pytest.mark.parametrize("make", [is_fifo, is_link, is_link_to_a_folder, is_link_to_nothing, is_text])
def test_a_path_that_is_not_a_work_folder_is_not_changed(
    sweeps: SweepServer, make: Callable[[Path], None]
) -> None:
    folder = sweeps.folder()
    make(folder / WORK)
    for words in FLAGS:
        check_refused(sweeps, folder, *words, message=WORK)


def test_a_folder_with_other_files_is_not_changed(sweeps: SweepServer) -> None:
    folder = sweeps.folder()
    (folder / WORK).mkdir()
    (folder / WORK / "thesis.txt").write_text("precious")
    for words in FLAGS:
        check_refused(sweeps, folder, *words, message=WORK)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (is_folder, "lock"),
        (is_folder, "plan.json"),
        (is_folder, "x.part"),
        (is_fifo, "plan.json"),
        (is_fifo, "00000000.npz"),
        (is_link, "00000000.npz"),
        (is_link, "lock"),
    ],
)
def test_an_unexpected_file_in_a_work_folder_is_replaced_or_reported_in_one_line(
    sweeps: SweepServer, make: Callable[[Path], None], name: str
) -> None:
    for words in FLAGS[1:]:
        folder = sweeps.copy_finished()
        (folder / WORK / name).unlink(missing_ok=True)
        make(folder / WORK / name)
        completed = sweeps(*words, cwd=folder, limit=20.0)
        assert completed.returncode in (0, 2, 4), (words, completed)
        assert completed.stderr.count("\n") == (completed.returncode != 0), (words, completed)
        assert (folder / CONFIG).read_bytes() == CONFIG_TEXT.encode()
        assert completed.returncode or digest(folder / RESULT) == sweeps.expected_digest(folder)


@pytest.mark.parametrize("make", [is_folder, is_fifo, is_link, is_link_to_nothing, is_text])
def test_a_path_that_is_not_a_result_is_not_changed(sweeps: SweepServer, make: Callable[[Path], None]) -> None:
    folder = sweeps.folder()
    make(folder / RESULT)
    for words in FLAGS:
        if make != is_text or words != ("--overwrite",):
            check_refused(sweeps, folder, *words, message=RESULT)


@pytest.mark.parametrize("make", [is_folder, is_fifo, is_link])
def test_an_unexpected_temporary_file_is_replaced_or_reported(
    sweeps: SweepServer, make: Callable[[Path], None]
) -> None:
    folder = sweeps.folder()
    make(folder / f"{RESULT}.part")
    completed = sweeps(cwd=folder, limit=20.0)
    assert (folder / CONFIG).read_bytes() == CONFIG_TEXT.encode()
    assert completed.returncode in (0, 2, 4), completed
    assert completed.returncode or digest(folder / RESULT) == sweeps.expected_digest(folder)


def test_a_folder_without_write_permission_is_reported(sweeps: SweepServer, tmp_path: Path) -> None:
    folder, fixed = sweeps.folder(), tmp_path / "fixed"
    check_refused(sweeps, folder, "-o", "missing/results.h5", message="does not exist")
    fixed.mkdir(mode=0o500)
    # the mode does not restrict root
    with mount_tmpfs(fixed, "ro,size=1M") if os.geteuid() == 0 else nullcontext():
        for words in FLAGS:
            check_refused(sweeps, folder, "-o", str(fixed / RESULT), *words, message="cannot be written")


# ---- changes since the interruption


def change_text(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1e-4", "1e-5", "solver.rtol: 0.0001 there, 1e-05 here"),
        ("K = 1e9", "K = 2e9", "scalars.K: 1000000000.0 there, 2000000000.0 here"),
        ("100]", "101]", "axes[0].e: 100 values there, 101 values here"),
        ("0.9, 100]", "0.8, 100]", "axes[0].e[1]: "),
        ("lankarani-nikravesh-1990", "lee-wang-1983", "lankarani-nikravesh-1990"),
        ("[output]", "collapse = false\n[output]", "collapse: true there, false here"),
    ],
)
def test_a_sweep_with_another_config_is_not_resumed(sweeps: SweepServer, old: str, new: str, message: str) -> None:
    folder = sweeps.copy_finished(change_text(CONFIG_TEXT, (old, new)))
    check_refused(sweeps, folder, "--resume", message=message)


@pytest.mark.parametrize(("old", "new"), [("Small", "Other"), ('"v1_post", "contact_time"', '"e_out"')])
def test_a_change_that_affects_no_trajectory_is_resumed(sweeps: SweepServer, old: str, new: str) -> None:
    folder = sweeps.copy_finished(change_text(CONFIG_TEXT, (old, new)))
    report = FaultReport(f"{old} changed to {new}", sweeps)
    report.resume(folder, ALL_BLOCKS, new)
    report.check()


def test_a_sweep_of_another_version_is_not_resumed(sweeps: SweepServer) -> None:
    folder = sweeps.copy_finished()
    plan = folder / WORK / "plan.json"
    stored = json.loads(plan.read_text())
    stored["physics"]["version"] = "0.0.1"
    plan.write_text(json.dumps(stored))
    check_refused(sweeps, folder, "--resume", message='version: "0.0.1" there, ')


@pytest.mark.parametrize(
    "change",
    [
        lambda plan: b"",
        lambda plan: b"{}",
        lambda plan: b"[]",
        lambda plan: b"null",
        lambda plan: plan[:-1],
        lambda plan: b"[" * 100_000,
        lambda plan: b"\xff" + plan,
        lambda plan: plan.replace(b"e", b"f", 1),
        lambda plan: plan.replace(b"0.1", b"1e400", 1),
    ],
)
def test_a_damaged_plan_is_not_resumed(sweeps: SweepServer, change: Callable[[bytes], bytes]) -> None:
    folder = sweeps.copy_finished()
    plan = folder / WORK / "plan.json"
    plan.write_bytes(change(plan.read_bytes()))
    check_refused(sweeps, folder, "--resume", message=WORK)


@pytest.mark.parametrize(
    "count", [3, pytest.param(30, marks=pytest.mark.faults), pytest.param(80, marks=pytest.mark.long)]
)
def test_a_block_with_a_flipped_bit_is_integrated_again(sweeps: SweepServer, count: int) -> None:
    report, generator = FaultReport("a flipped bit in a block", sweeps), random.Random(5)
    for number in pick_evenly(sorted(ALL_BLOCKS) * count, count):
        folder = sweeps.copy_finished()
        block = folder / WORK / f"{number:08d}.npz"
        content = bytearray(block.read_bytes())
        position = generator.randrange(len(content))
        with zipfile.ZipFile(block) as file:
            # the content of a member ends at the header of the next
            ends = [*(member.header_offset for member in file.infolist()), file.start_dir][1:]
            spans = [(end - member.file_size, end) for member, end in zip(file.infolist(), ends, strict=True)]
        content[position] ^= 1 << generator.randrange(8)
        block.write_bytes(content)
        completed = report.resume(folder, ALL_BLOCKS - {number}, position)
        assert completed.kept == {number} or not any(start <= position < end for start, end in spans), (
            position,
            completed,
        )
        shutil.rmtree(folder)
    report.check()


@pytest.mark.parametrize(
    ("change", "lost_blocks"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:-1]), {1}),
        (lambda path: path.write_bytes(path.read_bytes()[:1000]), {1}),
        (lambda path: path.write_bytes(b""), {1}),
        (lambda path: path.replace(path.with_name("00000002.npz")), {1, 2}),
        (lambda path: path.rename(path.with_name("00000099.npz")), {1}),
        (lambda path: shutil.copy(path, path.with_name("00000002.npz")), {2}),
        (lambda path: path.unlink(), {1}),
    ],
)
def test_only_lost_blocks_are_integrated_again(
    sweeps: SweepServer, change: Callable[[Path], None], lost_blocks: set[int]
) -> None:
    report, folder = FaultReport("a block truncated, renamed or missing", sweeps), sweeps.copy_finished()
    change(folder / WORK / "00000001.npz")
    assert report.resume(folder, ALL_BLOCKS - lost_blocks, "change").kept == lost_blocks
    assert not (folder / WORK).exists()
    report.check()


# ---- two sweeps at the same time


def start_stopped(
    sweeps: SweepServer, folder: Path, operation: int | list[str], *words: str | int
) -> RunningSweep:
    """Start a sweep that is stopped at an operation."""
    running = sweeps.start(*words, cwd=folder, fault=("send_signals", operation, signal.SIGSTOP))
    wait_until(lambda: running.state in "TZX")
    return running


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (CONFIG_TEXT, ("write", f"{WORK}/block.part")),
        (CONFIG_TEXT, ("write", f"{RESULT}.part")),
        (CONFIG_TEXT, ("rename", f"{WORK}/block.part")),
        (FACTORED_CONFIG, ("write", f"{RESULT}.part")),
    ],
)
def test_the_second_sweep_on_an_output_ends_at_once(
    sweeps: SweepServer, text: str, words: tuple[str, ...]
) -> None:
    sweeps = sweeps.with_config(text)
    folder = sweeps.folder()
    first = start_stopped(sweeps, folder, sweeps.find_operation(*words))
    before = snapshot(folder)
    for flags in FLAGS:
        second = sweeps(*flags, cwd=folder)
        assert (second.returncode, second.kept) == (5, set())
        assert second.stderr == f"{RESULT}: is being written by another process\n"
        assert snapshot(folder) == before
    os.kill(first.pid, signal.SIGCONT)
    assert first.wait().returncode == 0
    assert digest(folder / RESULT) == sweeps.expected_digest(folder)
    assert sorted(path.name for path in folder.iterdir()) == [CONFIG, RESULT]


# ---- signals

INT, TERM, KILL = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
SIGNALS = ((INT,), (TERM,), (INT, INT), (TERM, TERM), (INT, TERM))


def check_interrupted(completed: FinishedSweep, folder: Path, number: int, at: object) -> None:
    """Check that one line reports how to continue, or that the result was stored."""
    assert completed.returncode == 128 + number, (at, completed)
    assert (completed.stderr.count("\n"), completed.stdout) == (1, ""), (at, completed)
    message = f"{RESULT} is complete" if (folder / RESULT).exists() else f"{WORK}; --resume continues"
    assert completed.stderr.endswith(f"{message}\n"), (at, completed)
    assert completed.stderr.startswith("interrupted" if number == INT else "terminated"), (at, completed)


@pytest.mark.parametrize(
    ("text", "count", "moments"),
    [
        (CONFIG_TEXT, 3, 1),
        (FACTORED_CONFIG, 3, 1),
        pytest.param(CONFIG_TEXT, 10, 8, marks=pytest.mark.faults),
        pytest.param(FACTORED_CONFIG, 10, 8, marks=pytest.mark.faults),
        pytest.param(CONFIG_TEXT, 60, 40, marks=pytest.mark.long),
        pytest.param(FACTORED_CONFIG, 20, 40, marks=pytest.mark.long),
    ],
)
def test_an_interrupted_sweep_prints_one_line_and_is_resumed(
    sweeps: SweepServer, text: str, count: int, moments: int
) -> None:
    sweeps = sweeps.with_config(text)
    report = FaultReport("SIGINT, SIGTERM at an operation on files", sweeps)
    for turn, operation in enumerate(sweeps.choose_operations(count)):
        folder, numbers = sweeps.folder(), SIGNALS[turn % len(SIGNALS)]
        completed = sweeps(cwd=folder, fault=("send_signals", operation, *numbers))
        # of two signals sent together, the one with the lower number arrives first
        check_interrupted(completed, folder, numbers[0], (operation, numbers))
        report.resume(folder, finished_blocks(folder), operation)
        shutil.rmtree(folder)
    report.check()
    report, generator, longest = (
        FaultReport("SIGINT, SIGTERM at a random time", sweeps),
        random.Random(3),
        sweep_duration(sweeps),
    )
    for turn in range(moments):
        folder, numbers = sweeps.folder(), SIGNALS[turn % len(SIGNALS)]
        running = sweeps.start(cwd=folder)
        running.wait_until("begun")
        time.sleep(generator.uniform(0.0, longest))
        in_time = running.signal(*numbers)
        completed = running.wait()
        if in_time:
            check_interrupted(completed, folder, numbers[0], "random")
        report.resume(folder, finished_blocks(folder), "random")
        shutil.rmtree(folder)
    report.check()


def test_an_interrupted_small_sweep_writes_nothing(sweeps: SweepServer) -> None:
    folder = sweeps.folder(CONFIG_TEXT.replace("100]", "10]"))
    completed = sweeps(cwd=folder, fault=("send_signals", 0, INT))
    assert (completed.returncode, completed.stderr) == (130, "interrupted; nothing was written\n")
    assert [path.name for path in folder.iterdir()] == [CONFIG]


def test_the_flags_that_an_interrupted_overwriting_sweep_prints_continue_it(sweeps: SweepServer) -> None:
    folder = sweeps.folder()
    (folder / RESULT).write_text("an older result, of something else")
    completed = sweeps(
        "--overwrite", cwd=folder, fault=("send_signals", sweeps.find_operation("create", f"{RESULT}.part"), INT)
    )
    assert (completed.returncode, completed.kept) == (130, ALL_BLOCKS)
    # the line names the flags
    words = [word.strip(";,") for word in completed.stderr.split() if word.startswith("--")]
    resumed = sweeps(*words, cwd=folder)
    assert (resumed.returncode, resumed.kept) == (0, set()), (completed.stderr, resumed)


# ---- several processes


@pytest.mark.parametrize(
    ("number", "group", "count"),
    [
        (KILL, False, 1),
        *(
            pytest.param(number, group, count, marks=pytest.mark.faults)
            for number, group in ((INT, False), (INT, True), (TERM, False), (TERM, True), (KILL, False))
            for count in (0, 2)
        ),
    ],
)
def test_no_process_outlives_the_writing_process_after_any_signal(
    sweeps: SweepServer, number: int, group: bool, count: int
) -> None:
    report, folder = FaultReport("a signal to processes", sweeps), sweeps.folder(LONG_CONFIG)
    # stopped before a block gets its name
    running = start_stopped(sweeps, folder, sweeps.block_renames[count], "--jobs", 2)
    children = running.children()
    assert len(running.workers()) == 2
    assert running.signal(number, group=group)
    completed = running.wait()
    if number == KILL:
        assert completed.returncode == -KILL
    else:
        check_interrupted(completed, folder, number, (group, count))
    # the lock is released when the writing process ends
    report.resume(folder, finished_blocks(folder), (number, group, count))
    wait_until(lambda: all(process_state(pid) in "ZX" for pid in children))
    report.check()


def test_an_interrupt_while_processes_start_prints_one_line(sweeps: SweepServer) -> None:
    # a terminal sends the signal to all processes
    folder = sweeps.folder(LONG_CONFIG)
    running = sweeps.start("--jobs", 2, cwd=folder)
    wait_until(lambda: len(running.workers()) == 2)
    time.sleep(0.1)
    in_time = running.signal(INT, group=True)
    completed = running.wait()
    assert in_time is (completed.returncode != 0)
    if in_time:
        check_interrupted(completed, folder, INT, "begin")


@pytest.mark.parametrize(
    "moments",
    [
        (0,),
        pytest.param((1, 1, 2, 2, 3), marks=pytest.mark.faults),
    ],
)
def test_a_sweep_interrupted_twice_whose_process_is_killed_gives_the_same_file(
    sweeps: SweepServer, moments: tuple[int, ...]
) -> None:
    report = FaultReport("one of several processes killed", sweeps)
    for count in moments:
        # twice interrupted before
        folder = sweeps.folder(SLOW_CONFIG)
        before = []
        for words, operation in (((), sweeps.block_renames[1]), (("--resume",), ["rename", f"{WORK}/block.part"])):
            running = start_stopped(sweeps, folder, operation, *words)
            running.signal(TERM)
            before.append(running.wait())
        # a running block is finished, and no other is started
        assert [len(sweep.kept) for sweep in before] == [2, 1]
        third = sweeps.start("--resume", "--jobs", 2, cwd=folder)
        wait_until(
            lambda at=third, most=count: (len(at.workers()) == 2 and len(at.log()) > most) or at.state in "ZX"
        )
        for pid in third.workers()[:1]:
            os.kill(pid, KILL)
        completed = third.wait()
        assert (completed.returncode, completed.stderr) == (0, "")
        # every block is integrated exactly once
        kept = [entry[1] for sweep in (*before, completed) for entry in sweep.log if entry[0] == "kept"]
        report.trials += 1
        report.lost += [str(kept)] if sorted(kept) != list(range(LONG_BLOCKS)) else []
        report.wrong += [completed.stderr] if digest(folder / RESULT) != sweeps.expected_digest(folder) else []
    report.check()


# the trajectories of the largest e come last
KILLING_PLUGIN = """
import multiprocessing, os
from impact import hysteresis

def chi(e):
    if multiprocessing.parent_process() and (e > 0.85).any():
        os.kill(os.getpid(), 9)
    return 1.0 - e

MINE = hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=chi)
"""


@pytest.mark.faults
def test_a_block_that_kills_every_process_is_reported(sweeps: SweepServer) -> None:
    text = change_text(LONG_CONFIG, ('"hertz", "lankarani-nikravesh-1990"', '"mine-2026"'))
    folder = sweeps.folder(text)
    (folder / "mine.py").write_text(KILLING_PLUGIN)
    completed = sweeps("--jobs", 2, "--plugin", "mine.py", cwd=folder)
    assert (completed.returncode, completed.stderr.count("\n")) == (4, 1), completed
    assert "processes were killed 4 times" in completed.stderr
    assert completed.stderr.endswith("; --resume continues\n")
    assert completed.kept
    assert completed.kept == finished_blocks(folder)
    resumed = sweeps("--resume", "--plugin", "mine.py", cwd=folder)
    assert (resumed.returncode, resumed.kept & completed.kept) == (0, set())
