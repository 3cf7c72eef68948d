"""Who comes upon a sweep of another time or process harms nothing: leftovers, edits, signals, workers."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import sys
import time
import zipfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from .faults import (
    BLOCKS,
    CONFIG,
    FACTORED,
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

# processes and their open files are looked up in /proc
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
ALL = set(range(BLOCKS))
FLAGS = ((), ("--overwrite",), ("--resume",))
# enough to be in the midst of it when a few blocks are kept; and slow enough to be seen at it
LONG = TEXT.replace("100]", "640]")
SLOW = LONG.replace("1e-4", "1e-10")
MANY = 11


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
    folder = sweeps.left(sweeps.place("create", f"{WORK}/block.part"))
    for flag in ("--resume", "--overwrite"):
        check_refused(sweeps, folder, told=flag)
    # what is not to be resumed is begun anew
    folder = sweeps.copied()
    done = sweeps("--overwrite", cwd=folder)
    assert (done.returncode, done.kept, digest(folder / RESULT)) == (0, ALL, sweeps.right(folder))


def is_folder(path: Path) -> None:
    path.mkdir()


def is_fifo(path: Path) -> None:
    os.mkfifo(path)


def is_link(path: Path) -> None:
    path.symlink_to(path.parents[path.parent.name == WORK] / CONFIG)


def is_other(path: Path) -> None:
    path.write_text("precious")


def is_link_to_a_folder(path: Path) -> None:
    path.symlink_to(path.parent)


def is_link_to_nothing(path: Path) -> None:
    path.symlink_to("nowhere")


@pytest.mark.parametrize("make", [is_fifo, is_link, is_link_to_a_folder, is_link_to_nothing, is_other])
def test_what_is_no_work_folder_is_left_alone(sweeps: Sweeps, make: Callable[[Path], None]) -> None:
    folder = sweeps.folder()
    make(folder / WORK)
    for words in FLAGS:
        check_refused(sweeps, folder, *words, told=WORK)


def test_a_folder_of_something_else_is_left_alone(sweeps: Sweeps) -> None:
    folder = sweeps.folder()
    (folder / WORK).mkdir()
    (folder / WORK / "thesis.txt").write_text("precious")
    for words in FLAGS:
        check_refused(sweeps, folder, *words, told=WORK)


@pytest.mark.parametrize(("make", "name"), [
    (is_folder, "lock"), (is_folder, "plan.json"), (is_folder, "x.part"), (is_fifo, "plan.json"),
    (is_fifo, "00000000.npz"), (is_link, "00000000.npz"), (is_link, "lock"),
])  # fmt: skip
def test_what_is_odd_in_a_work_folder_ends_in_a_line_and_no_hang(
    sweeps: Sweeps, make: Callable[[Path], None], name: str
) -> None:
    for words in FLAGS[1:]:
        folder = sweeps.copied()
        (folder / WORK / name).unlink(missing_ok=True)
        make(folder / WORK / name)
        done = sweeps(*words, cwd=folder, limit=20.0)
        assert done.returncode in (0, 2, 4), (words, done)
        assert done.stderr.count("\n") == (done.returncode != 0), (words, done)
        assert (folder / CONFIG).read_bytes() == TEXT.encode()
        assert done.returncode or digest(folder / RESULT) == sweeps.right(folder)


@pytest.mark.parametrize("make", [is_folder, is_fifo, is_link, is_link_to_nothing, is_other])
def test_what_is_no_result_is_left_alone(sweeps: Sweeps, make: Callable[[Path], None]) -> None:
    folder = sweeps.folder()
    make(folder / RESULT)
    for words in FLAGS:
        if make != is_other or words != ("--overwrite",):
            check_refused(sweeps, folder, *words, told=RESULT)


@pytest.mark.parametrize("make", [is_folder, is_fifo, is_link])
def test_what_has_the_name_of_a_result_that_is_assembled(sweeps: Sweeps, make: Callable[[Path], None]) -> None:
    folder = sweeps.folder()
    make(folder / f"{RESULT}.part")
    done = sweeps(cwd=folder, limit=20.0)
    assert (folder / CONFIG).read_bytes() == TEXT.encode()
    assert done.returncode in (0, 2, 4), done
    assert done.returncode or digest(folder / RESULT) == sweeps.right(folder)


def test_a_folder_that_cannot_be_written_to(sweeps: Sweeps, tmp_path: Path) -> None:
    folder, fixed = sweeps.folder(), tmp_path / "fixed"
    check_refused(sweeps, folder, "-o", "missing/results.h5", told="does not exist")
    fixed.mkdir(mode=0o500)
    # root is not kept from it by the mode
    with mounted(fixed, "ro,size=1M") if os.geteuid() == 0 else nullcontext():
        for words in FLAGS:
            check_refused(sweeps, folder, "-o", str(fixed / RESULT), *words, told="cannot be written")


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
    folder = sweeps.copied(other(TEXT, (old, new)))
    check_refused(sweeps, folder, "--resume", told=told)


@pytest.mark.parametrize(("old", "new"), [("Small", "Other"), ('"v1_post", "contact_time"', '"e_out"')])
def test_what_changes_no_trajectory_is_resumed(sweeps: Sweeps, old: str, new: str) -> None:
    folder = sweeps.copied(other(TEXT, (old, new)))
    tally = Tally(f"{old} changed to {new}", sweeps)
    tally.resumed(folder, ALL, new)
    tally.end()


def test_a_sweep_of_another_version_is_not_resumed(sweeps: Sweeps) -> None:
    folder = sweeps.copied()
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
    folder = sweeps.copied()
    plan = folder / WORK / "plan.json"
    plan.write_bytes(change(plan.read_bytes()))
    check_refused(sweeps, folder, "--resume", told=WORK)


def check_flips(sweeps: Sweeps, count: int) -> None:
    tally, draw = Tally("a flipped bit in a block", sweeps), random.Random(5)
    for number in evenly(sorted(ALL) * count, count):
        folder = sweeps.copied()
        block = folder / WORK / f"{number:08d}.npz"
        content = bytearray(block.read_bytes())
        place = draw.randrange(len(content))
        with zipfile.ZipFile(block) as file:
            # what a member holds stands between its head and the next one's
            ends = [*(one.header_offset for one in file.infolist()), file.start_dir][1:]
            spans = [(end - one.file_size, end) for one, end in zip(file.infolist(), ends, strict=True)]
        content[place] ^= 1 << draw.randrange(8)
        block.write_bytes(content)
        done = tally.resumed(folder, ALL - {number}, place)
        assert done.kept == {number} or not any(start <= place < end for start, end in spans), (place, done)
        shutil.rmtree(folder)
    tally.end()


def test_a_flipped_bit_has_its_block_done_again(sweeps: Sweeps) -> None:
    check_flips(sweeps, 5)


@pytest.mark.faults
def test_many_flipped_bits(sweeps: Sweeps) -> None:
    check_flips(sweeps, 80)


@pytest.mark.parametrize(("change", "again"), [
    (lambda path: path.write_bytes(path.read_bytes()[:-1]), {1}),
    (lambda path: path.write_bytes(path.read_bytes()[:1000]), {1}),
    (lambda path: path.write_bytes(b""), {1}),
    (lambda path: path.replace(path.with_name("00000002.npz")), {1, 2}),
    (lambda path: path.rename(path.with_name("00000099.npz")), {1}),
    (lambda path: shutil.copy(path, path.with_name("00000002.npz")), {2}),
    (lambda path: path.unlink(), {1}),
])  # fmt: skip
def test_only_what_is_missing_is_done_again(
    sweeps: Sweeps, change: Callable[[Path], None], again: set[int]
) -> None:
    tally, folder = Tally("a block cut, moved or gone", sweeps), sweeps.copied()
    change(folder / WORK / "00000001.npz")
    assert tally.resumed(folder, ALL - again, "change").kept == again
    assert not (folder / WORK).exists()
    tally.end()


# ---- two at once


def stopped(sweeps: Sweeps, folder: Path, place: int | list[str], *words: str | int) -> Running:
    """A sweep that stands still at an operation."""
    running = sweeps.start(*words, cwd=folder, fault=("signalled", place, signal.SIGSTOP))
    until(lambda: running.state in "TZX")
    return running


@pytest.mark.parametrize(("text", "words"), [
    (TEXT, ("write", f"{WORK}/block.part")), (TEXT, ("rename", f"{WORK}/block.part")),
    (TEXT, ("write", f"{RESULT}.part")), (FACTORED, ("write", f"{RESULT}.part")),
])  # fmt: skip
def test_the_second_sweep_on_an_output_ends_at_once(sweeps: Sweeps, text: str, words: tuple[str, ...]) -> None:
    sweeps = sweeps.of(text)
    folder = sweeps.folder()
    first = stopped(sweeps, folder, sweeps.place(*words))
    before = snapshot(folder)
    for flags in FLAGS:
        second = sweeps(*flags, cwd=folder)
        assert (second.returncode, second.kept) == (5, set())
        assert second.stderr == f"{RESULT}: is being written by another process\n"
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
    told = f"{RESULT} is complete" if (folder / RESULT).exists() else f"{WORK}; --resume continues"
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


@pytest.mark.parametrize(("text", "count"), [(TEXT, 5), (FACTORED, 3)])
def test_signals(sweeps: Sweeps, text: str, count: int) -> None:
    check_signals(sweeps.of(text), count, 1)


@pytest.mark.faults
@pytest.mark.parametrize(("text", "count"), [(TEXT, 60), (FACTORED, 20)])
def test_many_signals(sweeps: Sweeps, text: str, count: int) -> None:
    check_signals(sweeps.of(text), count, 40)


def test_a_small_sweep_that_is_interrupted_says_what_became_of_it(sweeps: Sweeps) -> None:
    folder = sweeps.folder(TEXT.replace("100]", "10]"))
    done = sweeps(cwd=folder, fault=("signalled", 0, INT))
    assert (done.returncode, done.stderr) == (130, "interrupted; nothing was written\n")
    assert [path.name for path in folder.iterdir()] == [CONFIG]


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


def check_workers(sweeps: Sweeps, ways: Iterable[tuple[int, bool, int]]) -> None:
    tally = Tally("a signal to processes", sweeps)
    for number, group, count in ways:
        folder = sweeps.folder(LONG)
        # it stands still before a block gets its name
        running = stopped(sweeps, folder, sweeps.renames[count], "--jobs", 2)
        children = running.children()
        assert len(running.workers()) == 2
        assert running.signal(number, group=group)
        done = running.wait()
        if number == KILL:
            assert done.returncode == -KILL
        else:
            check_interrupted(done, folder, number, (group, count))
        # the lock goes with the one that writes
        tally.resumed(folder, kept_in(folder), (number, group, count))
        until(lambda those=children: all(state_of(pid) in "ZX" for pid in those))
        shutil.rmtree(folder)
    tally.end()


def test_no_process_outlives_the_one_that_writes(sweeps: Sweeps) -> None:
    check_workers(sweeps, [(INT, False, 1), (KILL, False, 2)])


@pytest.mark.faults
def test_many_signals_to_processes(sweeps: Sweeps) -> None:
    ways = [(INT, False), (INT, True), (TERM, False), (TERM, True), (KILL, False)]
    check_workers(sweeps, [(*way, count) for way in ways for count in (0, 2)])


def test_an_interrupt_while_processes_begin_is_one_line(sweeps: Sweeps) -> None:
    # a terminal sends it to all of them
    folder = sweeps.folder(LONG)
    running = sweeps.start("--jobs", 2, cwd=folder)
    until(lambda: len(running.workers()) == 2)
    time.sleep(0.1)
    in_time = running.signal(INT, group=True)
    done = running.wait()
    assert in_time is (done.returncode != 0)
    if in_time:
        check_interrupted(done, folder, INT, "begin")


def check_killed(sweeps: Sweeps, moments: Iterable[int]) -> None:
    tally = Tally("a process of several killed", sweeps)
    for count in moments:
        # twice interrupted before
        folder = sweeps.folder(SLOW)
        before = []
        for words, place in (((), sweeps.renames[1]), (("--resume",), ["rename", f"{WORK}/block.part"])):
            running = stopped(sweeps, folder, place, *words)
            running.signal(TERM)
            before.append(running.wait())
        # what was begun is finished, and no more is begun
        assert [len(one.kept) for one in before] == [2, 1]
        third = sweeps.start("--resume", "--jobs", 2, cwd=folder)
        until(lambda at=third, most=count: (len(at.workers()) == 2 and len(at.log()) > most) or at.state in "ZX")
        for pid in third.workers()[:1]:
            os.kill(pid, KILL)
        done = third.wait()
        assert (done.returncode, done.stderr) == (0, "")
        # each block once, by whomever
        kept = [one[1] for part in (*before, done) for one in part.log if one[0] == "kept"]
        tally.trials += 1
        tally.lost += [str(kept)] if sorted(kept) != list(range(MANY)) else []
        tally.wrong += [done.stderr] if digest(folder / RESULT) != sweeps.right(folder) else []
    tally.end()


def test_interrupted_twice_and_a_process_killed_it_is_one_digest(sweeps: Sweeps) -> None:
    check_killed(sweeps, [0])


@pytest.mark.faults
def test_processes_killed_at_many_moments(sweeps: Sweeps) -> None:
    check_killed(sweeps, [1, 1, 2, 2, 3])


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
    text = other(LONG, ('"hertz", "lankarani-nikravesh-1990"', '"mine-2026"'))
    folder = sweeps.folder(text)
    (folder / "mine.py").write_text(MURDEROUS)
    done = sweeps("--jobs", 2, "--plugin", "mine.py", cwd=folder)
    assert (done.returncode, done.stderr.count("\n")) == (4, 1), done
    assert "processes were killed 4 times" in done.stderr
    assert done.stderr.endswith("; --resume continues\n")
    assert done.kept
    assert done.kept == kept_in(folder)
    again = sweeps("--resume", "--plugin", "mine.py", cwd=folder)
    assert (again.returncode, again.kept & done.kept) == (0, set())
