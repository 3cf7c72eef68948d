"""Sweeps that meet a fault: the command line in real processes, in which a call of the system kills or fails.

A server imports what a sweep needs once, makes ranges and slabs small, and forks. Its standard input has a request
a line, what to start or whom to wait for; its standard output a reply a line, a process id or how the process
ended.
"""

from __future__ import annotations

import errno
import gc
import hashlib
import io
import itertools
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

from .fork_server import POLL_INTERVAL_S, ROOT, run_command

RANGE, SLAB = 64, 128  # trajectories of a range, and points of a slab: many of each in little time
CONFIG, RESULT, WORK = "c.toml", "results.h5", "results.h5.work"
TEXT = """title = "Small"
models = ["hertz", "lankarani-nikravesh-1990"]
[solver]
rtol = 1e-4
[output]
variables = ["v1_post", "contact_time"]
[sweep]
e = { linspace = [0.1, 0.9, 100] }
v1 = 1.0
m1 = 1.0
m2 = [1.0, 2.0]
K = 1e9
"""
# the same, with the trajectory table in the file
FACTORED = TEXT.replace("[output]", '[output]\nlayout = "factored"')
BLOCKS = 3  # one of the first model, to which e is nothing, and two of the second
PATIENCE = 60.0  # s after which what should have happened is not waited for any more
Log = list[list[Any]]


# ---- in the process that sweeps


def tap(visit: Callable[..., Any]) -> None:
    """Have `visit(do, kind, path, ...)` in the place of each call that changes a folder; `do()` does it.

    The paths are relative to the folder that we are in. What is written is given as its place and its bytes, and
    `do(part)` writes a part of it.
    """

    def own(path: Any) -> str:
        found = os.readlink(f"/proc/self/fd/{path}") if isinstance(path, int) else os.path.abspath(path)
        return os.path.relpath(found)

    def tapped(name: str, wanted: Callable[..., bool]) -> None:
        real = getattr(os, name)
        kind = {"open": "create", "replace": "rename"}.get(name, name)

        def instead(*words: Any, **more: Any) -> Any:
            if not wanted(*words) or own(words[0]).startswith(".."):
                return real(*words, **more)
            paths = [own(one) for one in words[: 2 if kind in ("link", "rename") else 1]]
            return visit(lambda: real(*words, **more), kind, *paths)

        setattr(os, name, instead)

    for name in ("fsync", "link", "rename", "replace", "unlink", "mkdir", "rmdir"):
        tapped(name, lambda *words: True)
    tapped("open", lambda path, flags=0, *words: bool(flags & os.O_CREAT))

    class Tapped(io.FileIO):
        def __init__(self, path: Any, mode: str) -> None:
            visit(lambda: io_file.__init__(self, path, mode), "create", own(path))

        def write(self, content: Any, /) -> int:
            held = bytes(content)
            do = lambda part=held: io_file.write(self, part)  # noqa: E731
            return int(visit(do, "write", own(self.fileno()), self.tell(), held))

        def truncate(self, size: int | None = None, /) -> int:
            size = self.tell() if size is None else size
            return int(visit(lambda: io_file.truncate(self, size), "truncate", own(self.fileno()), size))

    io_file = io.FileIO
    io.FileIO = Tapped  # type: ignore[misc]


def signalled(note: int, place: int | list[str], *numbers: int) -> None:
    """Signals to itself right before an operation, of a number or the first that begins so."""
    count = itertools.count()

    def visit(do: Callable[[], Any], *what: Any) -> Any:
        nonlocal place
        if place in (next(count), [*what[:2]]):
            place = -1
            for number in numbers:
                os.kill(os.getpid(), number)
        return do()

    tap(visit)


def failing(note: int, place: int, number: int) -> None:
    """From the operation of a number on the disk is full, and takes half of what is written; or one call fails."""
    count = itertools.count()

    def visit(do: Callable[..., Any], kind: str, *what: Any) -> Any:
        at = next(count)
        if number == errno.ENOSPC and at >= place and kind in ("write", "create", "mkdir"):
            if at == place and kind == "write" and len(what[2]) > 1:
                return do(what[2][: len(what[2]) // 2])
            raise OSError(number, os.strerror(number))
        if number != errno.ENOSPC and at == place:
            raise OSError(number, os.strerror(number))
        return do()

    tap(visit)


def recorded(note: int, synced: bool = True) -> None:
    """Keep a log of what is done; without fsync, if so wanted."""

    def visit(do: Callable[[], Any], kind: str, *what: Any) -> Any:
        if kind == "fsync" and not synced:
            return None
        try:
            done = do()
        except OSError:
            _tell(note, "none")
            raise
        _tell(note, kind, *(one.hex() if isinstance(one, bytes) else one for one in what))
        return done

    tap(visit)


def limited(note: int, size: int) -> None:
    """Files of no more than so many bytes, by a limit of the system."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def _tell(note: int, *words: Any) -> None:
    os.write(note, json.dumps(words).encode() + b"\n")


def _watched(note: int) -> None:
    """Tell when the sweep begins and ends, and each block that is kept."""
    from impact.engine import checkpoint as work
    from impact.results import sweep as sweeping

    sweep_into, store = sweeping.sweep_into, work.WorkFolder.store

    def noted_sweep(*words: Any, **more: Any) -> Any:
        _tell(note, "begun")
        try:
            return sweep_into(*words, **more)
        finally:
            _tell(note, "ended")

    def noted_store(folder: Any, part: Any, collisions: Any) -> None:
        store(folder, part, collisions)
        _tell(note, "kept", part.number)

    sweeping.sweep_into, work.WorkFolder.store = noted_sweep, noted_store  # type: ignore[method-assign]


# ---- the server


def serve() -> None:
    """Answer requests until there are no more."""
    _warm_up()
    # what is there to stay is not looked through again in each child
    gc.freeze()
    for line in sys.stdin:
        request = json.loads(line)
        reply = _start(**request["start"]) if "start" in request else _wait(**request["wait"])
        print(json.dumps(reply), flush=True)


def _warm_up() -> None:
    """Make ranges and slabs small before anything takes their sizes, and import what a sweep imports."""
    from impact.engine import trajectories

    trajectories.RANGE_TRAJECTORIES, trajectories.trajectory_ranges.__defaults__ = RANGE, (RANGE,)
    from impact.results import factored, slabs

    slabs.slabs.__defaults__, factored.SLAB_ROWS = (SLAB,), RANGE
    import impact.cli.sweep

    with tempfile.TemporaryDirectory() as folder:
        config, result = Path(folder, CONFIG), Path(folder, RESULT)
        for text in (TEXT, FACTORED, TEXT):
            config.write_text(text)
            impact.cli.sweep.sweep(config, result, quiet=True, overwrite=True)


def _start(argv: list[str], cwd: str, told: str, fault: list[Any]) -> int:
    child = os.fork()
    if child == 0:
        _become(argv, cwd, told, fault)
    return child


def _become(argv: list[str], cwd: str, told: str, fault: list[Any]) -> NoReturn:
    """In the child: have the fault, and become the command, in a group of its own."""
    os.setpgid(0, 0)
    note = os.open(f"{told}.log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    _watched(note)
    if fault:
        {one.__name__: one for one in (signalled, failing, recorded, limited)}[fault[0]](note, *fault[1:])
    with open(f"{told}.out", "wb") as out, open(f"{told}.err", "wb") as err:
        run_command(argv, cwd, "", out.fileno(), err.fileno())


def _wait(pid: int, limit: float) -> int | None:
    """How a child ended; None if it takes too long, and is killed."""
    begun = time.monotonic()
    while True:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() - begun > limit:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return None
        time.sleep(POLL_INTERVAL_S)


# ---- the client's side


@dataclass(frozen=True)
class Done:
    """How a command line ended: a negative returncode is a signal; what it said, and the log of what it did."""

    returncode: int
    stdout: str
    stderr: str
    log: Log

    @property
    def kept(self) -> set[int]:
        """The blocks that were integrated and kept."""
        return {one[1] for one in self.log if one[0] == "kept"}


@dataclass(frozen=True)
class Running:
    """A command line that has been started; its id is not another's before it was waited for."""

    sweeps: Sweeps
    pid: int
    told: Path

    def log(self) -> Log:
        path = self.told.with_suffix(".log")
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def until(self, *words: Any) -> None:
        """Wait until the log has a line that begins so."""
        until(lambda: any(one[: len(words)] == list(words) for one in self.log()) or self.state in "ZX")

    @property
    def state(self) -> str:
        return state_of(self.pid)

    def signal(self, *numbers: int, group: bool = False) -> bool:
        """Send signals, to it or to its group; not if the sweep has ended; give whether they were."""
        os.kill(self.pid, signal.SIGSTOP)
        until(lambda: self.state in "TZX")
        in_time = self.state == "T" and ["ended"] not in self.log()
        for number in numbers if in_time else ():
            (os.killpg if group else os.kill)(self.pid, number)
        os.kill(self.pid, signal.SIGCONT)
        return in_time

    def children(self) -> list[int]:
        """The processes that it started."""
        found = (int(path.name) for path in Path("/proc").glob("[0-9]*"))
        return [pid for pid in found if parent_of(pid) == self.pid]

    def workers(self) -> list[int]:
        """Those of them that integrate."""
        return [pid for pid in self.children() if "spawn_main" in _of_process(pid, "cmdline")]

    def wait(self, limit: float = PATIENCE) -> Done:
        """How it ended; it is a mistake if that takes so long [s]."""
        code = self.sweeps.ask({"wait": {"pid": self.pid, "limit": limit}})
        texts = [self.told.with_suffix(end).read_text() for end in (".out", ".err")]
        assert code is not None, ("it hangs", *texts)
        return Done(code, *texts, self.log())


def until(condition: Callable[[], bool]) -> None:
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < PATIENCE
        time.sleep(POLL_INTERVAL_S)


def _of_process(pid: int, name: str) -> str:
    """What the system tells of a process; nothing if it is gone."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text()
    except OSError:
        return ""


def state_of(pid: int) -> str:
    """The state of a process as the system has it: T is stopped, Z has ended, X is not there."""
    return (_of_process(pid, "stat").rpartition(")")[2].split() or ["X"])[0]


def parent_of(pid: int) -> int:
    return int((_of_process(pid, "stat").rpartition(")")[2].split() or ["X", "0"])[1])


@dataclass(frozen=True)
class Sweeps:
    """A server, and a folder for what its processes tell; `sweeps(...)` runs a command line to its end."""

    server: subprocess.Popen[str]
    told: Path
    text: str = TEXT
    count: Iterator[int] = field(default_factory=itertools.count)
    digests: dict[str, str] = field(default_factory=dict)

    def ask(self, request: object) -> int | None:
        assert self.server.stdin is not None
        assert self.server.stdout is not None
        print(json.dumps(request), file=self.server.stdin, flush=True)
        reply: int | None = json.loads(self.server.stdout.readline())
        return reply

    def start(self, *words: str | Path | int, cwd: Path, fault: Sequence[Any] = ()) -> Running:
        """Start `impact sweep c.toml -o results.h5` with more words, in a folder that has the config."""
        told = self.told / str(next(self.count))
        argv = ["sweep", CONFIG, "-o", RESULT, "--quiet", *map(str, words)]
        start = {"argv": argv, "cwd": str(cwd), "told": str(told), "fault": [*fault]}
        pid = self.ask({"start": start})
        assert pid is not None
        return Running(self, pid, told)

    def __call__(
        self, *words: str | Path | int, cwd: Path, fault: Sequence[Any] = (), limit: float = PATIENCE
    ) -> Done:
        return self.start(*words, cwd=cwd, fault=fault).wait(limit)

    def of(self, text: str) -> Sweeps:
        """The same server, of another config."""
        return replace(self, text=text)

    def folder(self, text: str = "") -> Path:
        """A new folder with a config."""
        path = self.told / f"folder{next(self.count)}"
        path.mkdir()
        (path / CONFIG).write_text(text or self.text)
        return path

    def right(self, folder: Path) -> str:
        """The SHA-256 of the file of the sweep of a folder, run here in one piece."""
        from impact.api import prepare
        from impact.results.sweep import sweep_into

        text = (folder / CONFIG).read_text()
        if text not in self.digests:
            with tempfile.TemporaryDirectory() as whole:
                sweep_into(Path(whole, RESULT), prepare(folder / CONFIG))
                self.digests[text] = digest(Path(whole, RESULT))
        return self.digests[text]

    @cached_property
    def operations(self) -> Log:
        """What an undisturbed sweep does with files, in order."""
        log = self(cwd=self.folder(), fault=("recorded",)).log
        return [one for one in log if one[0] not in ("begun", "kept", "ended")]

    def place(self, *words: str) -> int:
        """The first of these operations that begins so."""
        return next(at for at, one in enumerate(self.operations) if one[: len(words)] == [*words])

    @property
    def renames(self) -> list[int]:
        """Where the blocks get their names."""
        return [at for at, one in enumerate(self.operations) if one[:2] == ["rename", f"{WORK}/block.part"]]

    def places(self, count: int | None, first: int = 0, last: int | None = None) -> list[int]:
        """So many of the operations from one to before another, half of them writes; all if no number is given."""
        every = range(first, last or len(self.operations))
        if count is None:
            return list(every)
        writes = [at for at in every if self.operations[at][0] == "write"]
        return sorted((*evenly(writes, count // 2), *evenly(sorted({*every} - {*writes}), count - count // 2)))

    def left(self, place: int) -> Path:
        """A folder with what a sweep leaves that is killed at an operation."""
        folder = self.folder()
        killed = self(cwd=folder, fault=("signalled", place, signal.SIGKILL))
        assert killed.returncode == -signal.SIGKILL
        return folder

    @cached_property
    def finished(self) -> Path:
        """What is left by one that had finished all blocks."""
        return self.left(self.place("create", f"{RESULT}.part"))

    def copied(self, text: str = "") -> Path:
        """A copy of that, with this config."""
        folder = self.folder(text)
        shutil.copytree(self.finished / WORK, folder / WORK)
        return folder


@dataclass
class Tally:
    """What became of a fault: trials in which something finished was lost, or something wrong came out."""

    fault: str
    sweeps: Sweeps
    trials: int = 0
    lost: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)

    def resumed(self, folder: Path, kept: set[int], at: object, *words: str | int) -> Done:
        """Resume what a fault has left; the blocks that are kept are not to be done again."""
        self.trials += 1
        right = self.sweeps.right(folder)
        if os.path.lexists(folder / RESULT) and digest(folder / RESULT) != right:
            self.wrong.append(f"{at}: half a result")
        done = self.sweeps("--resume", *words, cwd=folder)
        if done.returncode != 0 or done.kept & kept:
            self.lost.append(f"{at}: {done}, had kept {kept}")
        if digest(folder / RESULT) != right:
            self.wrong.append(f"{at}: {done}, {digest(folder / RESULT)}")
        return done

    def end(self) -> None:
        print(f"{self.fault} | {self.trials} | {len(self.lost)} | {len(self.wrong)}")
        assert self.trials
        assert not self.wrong, "\n".join(self.wrong)
        assert not self.lost, "\n".join(self.lost)


def digest(path: Path) -> str:
    """The SHA-256 of all bytes of a file, or that it is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "is no file"


def kept_in(folder: Path) -> set[int]:
    """The blocks that stand in a work folder."""
    return {int(path.stem) for path in (folder / WORK).glob("*.npz")}


def duration(sweeps: Sweeps) -> float:
    """How long a sweep takes from its begin [s]."""
    running = sweeps.start(cwd=sweeps.folder())
    running.until("begun")
    begun = time.monotonic()
    running.wait()
    return time.monotonic() - begun


def evenly(items: Sequence[Any], count: int) -> list[Any]:
    """So many of them, the first and the last among them."""
    steps = max(min(count, len(items)) - 1, 1)
    return [items[at * (len(items) - 1) // steps] for at in range(min(count, len(items)))]


@contextmanager
def mounted(folder: Path, options: str) -> Iterator[None]:
    """A small file system of its own in a folder."""
    # the processes that integrate load this module, and have no need of it
    import pytest

    folder.mkdir(exist_ok=True)
    words = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(words, capture_output=True, check=False).returncode != 0:
        pytest.skip("may not mount a file system")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def sweeping(told: Path) -> Iterator[Sweeps]:
    """A server for as long as it is needed."""
    alone = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    command = [sys.executable, "-m", "tests.faults"]
    with subprocess.Popen(
        command, cwd=ROOT, env={**os.environ, **alone}, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as server:
        try:
            yield Sweeps(server, told)
        finally:
            assert server.stdin is not None
            server.stdin.close()


if __name__ == "__main__":
    serve()
