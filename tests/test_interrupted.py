"""Who comes upon a sweep of another time or process harms nothing: leftovers, edits, signals, two at once, workers."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from .faults import (
    BLOCKS,
    CONFIG,
    RESULT,
    TEXT,
    WORK,
    Done,
    Running,
    Sweeps,
    Tally,
    digest,
    duration,
    evenly,
    kept_in,
    mounted,
    state_of,
    sweeping,
    until,
)  # fmt: skip

ALL = set(range(BLOCKS))
FLAGS = ((), ("--overwrite",), ("--resume",))
# enough to be in the midst of it when a few blocks are kept
LONG = TEXT.replace("100]", "1200]").replace("1e-4", "1e-9")
MANY = 2 * -(-1200 // 64)


@pytest.fixture(scope="module")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sweeps]:
    with sweeping(tmp_path_factory.mktemp("interrupted")) as server:
        yield server


def snapshot(folder: Path) -> dict[str, object]:
    """All that is in a folder, and when it was modified."""
    found: dict[str, object] = {}
    for path in folder.rglob("*"):
        about = path.lstat()
        content = path.read_bytes() if path.is_file() and not path.is_symlink() else None
        target = os.readlink(path) if path.is_symlink() else None
        found[str(path.relative_to(folder))] = about.st_mode, about.st_mtime_ns, content, target
    return found


def check_refused(sweeps: Sweeps, folder: Path, *words: str | int, told: str = "") -> Done:
    """Exit 2 in a line, before any work, and nothing is touched."""
    before = snapshot(folder)
    done = sweeps(*words, cwd=folder)
    assert (done.returncode, done.stdout, done.stderr.count("\n"), done.kept) == (2, "", 1, set()), done
    assert told in done.stderr, done
    assert snapshot(folder) == before
    return done


# ---- what stands in the place of the work folder, or of the result


def test_a_leftover_without_a_word_what_to_do_with_it_is_left_alone(sweeps: Sweeps) -> None:
    for words in (("create", f"{WORK}/block.part"), ("create", f"{RESULT}.part"), ("link",)):
        folder = sweeps.left(sweeps.place(*words))
        for flag in ("--resume", "--overwrite"):
            check_refused(sweeps, folder, told=flag)
    # what is not to be resumed is begun anew
    done = sweeps("--overwrite", cwd=folder)
    assert (done.returncode, done.kept, digest(folder / RESULT)) == (0, ALL, sweeps.right(folder))


def strange(work: Path) -> None:
    work.mkdir()
    (work / "thesis.txt").write_text("precious")


@pytest.mark.parametrize("make", [
    lambda work: work.write_text("precious"),
    lambda work: work.symlink_to(work.parent),
    lambda work: work.symlink_to("nowhere"),
    os.mkfifo,
    strange,
], ids=["file", "symlink", "dangling", "fifo", "strange"])  # fmt: skip
def test_what_is_no_work_folder_is_left_alone(sweeps: Sweeps, make: Callable[[Path], None]) -> None:
    folder = sweeps.folder()
    make(folder / WORK)
    for words in FLAGS:
        check_refused(sweeps, folder, *words, told=WORK)


@pytest.mark.parametrize("name", ["00000000.npz", "x.npz", "x.part", "plan.json", "lock"])
@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda path: path.symlink_to("../c.toml")],
                         ids=["folder", "fifo", "symlink"])  # fmt: skip
def test_what_is_no_block_ends_in_a_line_and_no_hang(
    sweeps: Sweeps, make: Callable[[Path], None], name: str
) -> None:
    for words in FLAGS:
        folder = sweeps.left()
        (folder / WORK / name).unlink(missing_ok=True)
        make(folder / WORK / name)
        done = sweeps(*words, cwd=folder)
        assert done.returncode in (0, 2, 4), (words, done)
        assert done.stderr.count("\n") == (done.returncode != 0), (words, done)
        assert (folder / CONFIG).read_text() == TEXT
        assert done.returncode or digest(folder / RESULT) == sweeps.right(folder)


@pytest.mark.parametrize("make", [
    Path.mkdir, os.mkfifo, lambda path: path.symlink_to("other"), lambda path: path.symlink_to(CONFIG),
    lambda path: path.write_text("precious"),
], ids=["folder", "fifo", "dangling", "symlink", "file"])  # fmt: skip
@pytest.mark.parametrize("name", [RESULT, f"{RESULT}.part"])
def test_what_is_no_result_is_left_alone(sweeps: Sweeps, make: Callable[[Path], None], name: str) -> None:
    folder = sweeps.folder()
    make(folder / name)
    for words in FLAGS:
        if not (words == ("--overwrite",) and (folder / name).is_file() and not (folder / name).is_symlink()):
            check_refused(sweeps, folder, *words, told=name)


def test_a_folder_that_cannot_be_written_to(sweeps: Sweeps, tmp_path: Path) -> None:
    folder = sweeps.folder()
    check_refused(sweeps, folder, "-o", "missing/results.h5", told="does not exist")
    with mounted(tmp_path / "fixed", "ro,size=1M"):
        for words in FLAGS:
            check_refused(sweeps, folder, "-o", str(tmp_path / "fixed" / RESULT), *words, told="cannot be written")


# ---- what was changed since


def other(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(("old", "new", "told"), [
    ("1e-4", "1e-5", "solver.rtol: 0.0001 there, 1e-05 here"),
    ("K = 1e9", "K = 2e9", "scalars.K: 1000000000.0 there, 2000000000.0 here"),
    ("100]", "101]", "axes[0].e: 100 values there, 101 values here"),
    ("0.9, 100]", "0.8, 100]", "axes[0].e[1]: "),
    ("lankarani-nikravesh-1990", "lee-wang-1983", "lankarani-nikravesh-1990"),
    ("[output]", "collapse = false\n[output]", "collapse: true there, false here"),
])  # fmt: skip
def test_another_sweep_is_not_resumed(sweeps: Sweeps, old: str, new: str, told: str) -> None:
    folder = sweeps.left()
    (folder / CONFIG).write_text(other(TEXT, (old, new)))
    check_refused(sweeps, folder, "--resume", told=told)


@pytest.mark.parametrize(("old", "new"), [("Small", "Other"), ('"v1_post", "duration"', '"e_out"')])
def test_what_changes_no_trajectory_is_resumed(sweeps: Sweeps, old: str, new: str) -> None:
    folder = sweeps.left()
    (folder / CONFIG).write_text(other(TEXT, (old, new)))
    tally = Tally(f"{old} changed to {new}", sweeps)
    tally.resumed(folder, ALL, new)
    tally.end()


def test_a_sweep_of_another_version_is_not_resumed(sweeps: Sweeps) -> None:
    folder = sweeps.left()
    plan = folder / WORK / "plan.json"
    stored = json.loads(plan.read_text())
    stored["physics"]["version"] = "0.0.1"
    plan.write_text(json.dumps(stored))
    check_refused(sweeps, folder, "--resume", told='version: "0.0.1" there, ')


@pytest.mark.parametrize(
    "change",
    [
        lambda plan: b"", lambda plan: b"{}", lambda plan: b"[]", lambda plan: b"null", lambda plan: plan[:-1],
        lambda plan: b"[" * 100_000, lambda plan: b"\xff" + plan, lambda plan: plan.replace(b"e", b"f", 1),
        lambda plan: plan.replace(b"0.1", b"1e400", 1),
    ],
)  # fmt: skip
def test_a_damaged_plan_is_not_resumed(sweeps: Sweeps, change: Callable[[bytes], bytes]) -> None:
    folder = sweeps.left()
    plan = folder / WORK / "plan.json"
    plan.write_bytes(change(plan.read_bytes()))
    check_refused(sweeps, folder, "--resume", told=WORK)


def check_flips(sweeps: Sweeps, count: int) -> None:
    tally, draw = Tally("a flipped bit in a block", sweeps), random.Random(5)
    left = sweeps.left()
    for number in evenly(sorted(ALL) * count, count):
        folder = sweeps.folder()
        shutil.copytree(left / WORK, folder / WORK)
        block = folder / WORK / f"{number:08d}.npz"
        content = bytearray(block.read_bytes())
        place = draw.randrange(len(content))
        with zipfile.ZipFile(block) as file:
            # what a member holds stands between its head and the next one's
            ends = [one.header_offset for one in file.infolist()][1:] + [file.start_dir]
            spans = [(end - one.file_size, end) for one, end in zip(file.infolist(), ends, strict=True)]
        content[place] ^= 1 << draw.randrange(8)
        block.write_bytes(content)
        done = tally.resumed(folder, ALL - {number}, place)
        assert done.kept == {number} or not any(start <= place < end for start, end in spans), (place, done)
        shutil.rmtree(folder)
    tally.end()


def test_a_flipped_bit_has_its_block_done_again(sweeps: Sweeps) -> None:
    check_flips(sweeps, 8)


@pytest.mark.faults
def test_many_flipped_bits(sweeps: Sweeps) -> None:
    check_flips(sweeps, 100)


@pytest.mark.parametrize(("change", "again"), [
    (lambda path: path.write_bytes(path.read_bytes()[:-1]), {0}),
    (lambda path: path.write_bytes(path.read_bytes()[:1000]), {0}),
    (lambda path: path.write_bytes(b""), {0}),
    (lambda path: path.replace(path.with_name("00000002.npz")), {0, 2}),
    (lambda path: path.rename(path.with_name("00000099.npz")), {0}),
    (lambda path: shutil.copy(path, path.with_name("00000003.npz")), {3}),
    (lambda path: path.unlink(), {0}),
])  # fmt: skip
def test_only_what_is_missing_is_done_again(
    sweeps: Sweeps, change: Callable[[Path], None], again: set[int]
) -> None:
    tally, folder = Tally("a block cut, moved or gone", sweeps), sweeps.left()
    change(folder / WORK / "00000000.npz")
    assert tally.resumed(folder, ALL - again, "change").kept == again
    assert not (folder / WORK).exists()
    tally.end()


# ---- two at once


def stopped(sweeps: Sweeps, folder: Path, *words: str) -> Running:
    """A sweep that stands still at an operation."""
    running = sweeps.start(cwd=folder, fault=("signalled", sweeps.place(*words), signal.SIGSTOP))
    until(lambda: running.state == "T")
    return running


@pytest.mark.parametrize("words", [
    ("write", f"{WORK}/block.part"), ("rename", f"{WORK}/block.part"), ("write", f"{RESULT}.part"), ("rmdir",),
])  # fmt: skip
def test_the_second_sweep_on_an_output_ends_at_once(sweeps: Sweeps, words: tuple[str, ...]) -> None:
    folder = sweeps.folder()
    first = stopped(sweeps, folder, *words)
    if words == ("rmdir",):
        # the result is there, and so it says
        (done,) = {sweeps(cwd=folder).returncode}
        assert done == 0
    else:
        for flags in FLAGS:
            before = snapshot(folder)
            second = sweeps(*flags, cwd=folder)
            assert (second.returncode, second.kept, second.stderr) == (
                5, set(), f"{RESULT}: is being written by another process\n",
            )  # fmt: skip
            assert snapshot(folder) == before
    os.kill(first.pid, signal.SIGCONT)
    assert first.wait().returncode == 0
    assert digest(folder / RESULT) == sweeps.right(folder)
    assert sorted(path.name for path in folder.iterdir()) == [CONFIG, RESULT]


# ---- signals

INT, TERM, KILL = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
WAYS = ((INT,), (TERM,), (INT, INT), (TERM, TERM), (INT, TERM))


def check_interrupted(done: Done, folder: Path, number: int, at: object) -> None:
    """One line that says how to go on, or that there is no need to."""
    assert done.returncode == 128 + number, (at, done)
    assert (done.stderr.count("\n"), done.stdout) == (1, ""), (at, done)
    told = f"{RESULT} was stored whole" if (folder / RESULT).exists() else f"{WORK}; --resume goes on"
    assert done.stderr.endswith(f"{told}\n"), (at, done)
    assert done.stderr.startswith("interrupted" if number == INT else "terminated"), (at, done)


def check_signals(sweeps: Sweeps, count: int | None, moments: int) -> None:
    tally = Tally("SIGINT, SIGTERM at an operation on files", sweeps)
    for turn, place in enumerate(sweeps.places(count)):
        folder, numbers = sweeps.folder(), WAYS[turn % len(WAYS)]
        done = sweeps(cwd=folder, fault=("signalled", place, *numbers))
        # of two kinds sent at one moment, the lower number arrives first
        check_interrupted(done, folder, numbers[0], (place, numbers))
        tally.resumed(folder, kept_in(folder), place)
        shutil.rmtree(folder)
    tally.end()
    tally, draw, longest = Tally("SIGINT, SIGTERM at a random moment", sweeps), random.Random(3), duration(sweeps)
    for turn in range(moments):
        folder, numbers = sweeps.folder(), WAYS[turn % len(WAYS)]
        running = sweeps.start(cwd=folder)
        running.until("begun")
        time.sleep(draw.uniform(0.0, longest))
        in_time = running.signal(*numbers)
        done = running.wait()
        if in_time:
            check_interrupted(done, folder, numbers[0], "random")
        tally.resumed(folder, kept_in(folder), "random")
        shutil.rmtree(folder)
    tally.end()


def test_signals(sweeps: Sweeps) -> None:
    check_signals(sweeps, 10, 5)


@pytest.mark.faults
def test_many_signals(sweeps: Sweeps) -> None:
    check_signals(sweeps, 100, 50)


def test_the_line_of_an_interrupted_sweep_that_overwrites_is_true(sweeps: Sweeps) -> None:
    folder = sweeps.folder()
    (folder / RESULT).write_text("an older result, of something else")
    done = sweeps("--overwrite", cwd=folder, fault=("signalled", sweeps.place("create", f"{RESULT}.part"), INT))
    assert (done.returncode, done.kept) == (130, ALL)
    # the line names the words with which it goes on
    words = [word.strip(";,") for word in done.stderr.split() if word.startswith("--")]
    again = sweeps(*words, cwd=folder)
    assert (again.returncode, again.kept) == (0, set()), (done.stderr, again)


# ---- several processes


def workers(running: Running) -> list[int]:
    until(lambda: len(running.workers()) == 2)
    return running.children()


def gone(children: list[int]) -> None:
    until(lambda: all(state_of(pid) in "ZX" for pid in children))


@pytest.mark.parametrize(("number", "group"), [(INT, False), (INT, True), (TERM, True), (KILL, False)])
def test_no_process_outlives_the_one_that_writes(sweeps: Sweeps, number: int, group: bool) -> None:
    tally, folder = Tally("a signal to processes", sweeps), sweeps.folder(LONG)
    running = sweeps.start("--jobs", 2, cwd=folder)
    children = workers(running)
    running.until("kept")
    assert running.signal(number, group=group)
    done = running.wait()
    if number == KILL:
        assert done.returncode == -KILL
    else:
        check_interrupted(done, folder, number, group)
    gone(children)
    assert len(kept_in(folder)) < MANY
    tally.resumed(folder, kept_in(folder), number, "--jobs", 2)
    tally.end()


def test_a_signal_to_processes_that_begin(sweeps: Sweeps) -> None:
    folder = sweeps.folder(LONG)
    running = sweeps.start("--jobs", 2, cwd=folder)
    children = workers(running)
    running.signal(INT, group=True)
    check_interrupted(running.wait(), folder, INT, "begin")
    gone(children)


def test_a_killed_worker_is_replaced(sweeps: Sweeps) -> None:
    folder = sweeps.folder(LONG)
    running = sweeps.start("--jobs", 2, cwd=folder)
    workers(running)
    running.until("kept")
    os.kill(running.workers()[0], KILL)
    done = running.wait()
    assert (done.returncode, done.stderr) == (0, "")
    assert sorted(one[1] for one in done.log if one[0] == "kept") == list(range(MANY))
    assert digest(folder / RESULT) == sweeps.right(folder)


# the trajectories of the largest e come last
MURDEROUS = """
import multiprocessing, os
from impact import hysteresis

def chi(e):
    if multiprocessing.parent_process() and (e > 0.85).any():
        os.kill(os.getpid(), 9)
    return 1.0 - e

MINE = hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=chi)
"""


@pytest.mark.faults
def test_workers_that_are_killed_again_and_again(sweeps: Sweeps) -> None:
    text = other(LONG, ('"gharib-hurmuzlu-2012", "lankarani-nikravesh-1990"', '"mine-2026"'), ("1e-9", "1e-4"))
    folder = sweeps.folder(text)
    (folder / "mine.py").write_text(MURDEROUS)
    done = sweeps("--jobs", 2, "--plugin", "mine.py", cwd=folder)
    assert (done.returncode, done.stderr.count("\n")) == (4, 1), done
    assert "processes were killed 4 times" in done.stderr
    assert done.stderr.endswith("; --resume goes on\n")
    assert done.kept
    assert done.kept == kept_in(folder)
    again = sweeps("--resume", "--plugin", "mine.py", cwd=folder)
    assert (again.returncode, again.kept & done.kept) == (0, set())


def test_interrupted_twice_and_by_other_processes_it_is_one_digest(sweeps: Sweeps) -> None:
    folder = sweeps.folder(LONG)
    logs = []
    for words, count in (((), 2), (("--resume",), 3), (("--resume", "--jobs", 2), MANY)):
        running = sweeps.start(*words, cwd=folder)
        until(lambda at=running, most=count: len(at.log()) > most or at.state in "ZX")
        running.signal(TERM)
        logs.append(running.wait().log)
    kept = [one[1] for log in logs for one in log if one[0] == "kept"]
    assert sorted(kept) == list(range(MANY))
    assert digest(folder / RESULT) == sweeps.right(folder)
