"""Inject faults into sweeps: the command line in real processes, in which a system call is interrupted or fails.

Their server makes blocks and slabs small; a child installs its fault before it executes the command line.
"""

from __future__ import annotations

import errno
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
from typing import Any

from .fork_server import TIMEOUT_S, ForkServer, serve, start_fork_server, wait_until

# small, for many blocks and slabs in a short time
BLOCK_TRAJECTORIES, SLAB_POINTS = 64, 128
CONFIG, RESULT, WORK = "c.toml", "results.h5", "results.h5.work"
CONFIG_TEXT = """title = "Small"
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
# the same sweep, stored as a trajectory table
FACTORED_CONFIG = CONFIG_TEXT.replace("[output]", '[output]\nlayout = "factored"')
BLOCKS = 3  # one for the first model, which does not depend on e, and two for the second
Log = list[list[Any]]


# ---- in the process that sweeps


def tap(visit: Callable[..., Any]) -> None:
    """Call `visit(do, kind, path, ...)` instead of each system call that changes a folder; `do()` performs it.

    Paths are relative to the working directory. For a write `visit` also gets the offset and the bytes, and
    `do(part)` writes a part of them.
    """
    from impact.atomic import Sink

    def relative_path(path: Any) -> str:
        absolute = os.readlink(f"/proc/self/fd/{path}") if isinstance(path, int) else os.path.abspath(path)
        return os.path.relpath(absolute)

    def wrap(name: str, is_selected: Callable[..., bool]) -> None:
        real = getattr(os, name)
        kind = {"open": "create", "replace": "rename"}.get(name, name)

        def wrapper(*args: Any, **options: Any) -> Any:
            if not is_selected(*args) or relative_path(args[0]).startswith(".."):
                return real(*args, **options)
            paths = [relative_path(path) for path in args[: 2 if kind in ("link", "rename") else 1]]
            return visit(lambda: real(*args, **options), kind, *paths)

        setattr(os, name, wrapper)

    for name in ("fsync", "link", "rename", "replace", "unlink", "mkdir", "rmdir"):
        wrap(name, lambda *args: True)
    wrap("open", lambda path, flags=0, *args: bool(flags & os.O_CREAT))

    class RecordedFileIO(io.FileIO):
        def __init__(self, path: Any, mode: str) -> None:
            visit(lambda: io.FileIO.__init__(self, path, mode), "create", relative_path(path))

        def write(self, content: Any, /) -> int:
            content_bytes = bytes(content)
            do = lambda part=content_bytes: io.FileIO.write(self, part)  # noqa: E731
            return int(visit(do, "write", relative_path(self.fileno()), self.tell(), content_bytes))

        def truncate(self, size: int | None = None, /) -> int:
            size = self.tell() if size is None else size
            path = relative_path(self.fileno())
            return int(visit(lambda: io.FileIO.truncate(self, size), "truncate", path, size))

    Sink.__bases__ = (RecordedFileIO,)


def send_signals(log_fd: int, operation: int | list[str], *numbers: int) -> None:
    """Send signals to this process right before an operation: its number, or the start of its log entry."""
    count = itertools.count()

    def visit(do: Callable[[], Any], *what: Any) -> Any:
        nonlocal operation
        if operation in (next(count), [*what[:2]]):
            operation = -1
            for number in numbers:
                os.kill(os.getpid(), number)
        return do()

    tap(visit)


def fail_disk(log_fd: int, operation: int, number: int) -> None:
    """Let the disk be full from an operation on, which writes half of its bytes; or let one operation fail."""
    count = itertools.count()

    def visit(do: Callable[..., Any], kind: str, *what: Any) -> Any:
        at = next(count)
        if number == errno.ENOSPC and at >= operation and kind in ("write", "create", "mkdir"):
            if at == operation and kind == "write" and len(what[2]) > 1:
                return do(what[2][: len(what[2]) // 2])
            raise OSError(number, os.strerror(number))
        if number != errno.ENOSPC and at == operation:
            raise OSError(number, os.strerror(number))
        return do()

    tap(visit)


def record_operations(log_fd: int, synced: bool = True) -> None:
    """Log all operations; without `synced`, fsync does nothing."""

    def visit(do: Callable[[], Any], kind: str, *what: Any) -> Any:
        if kind == "fsync" and not synced:
            return None
        try:
            returned = do()
        except OSError:
            _log(log_fd, "none")
            raise
        _log(log_fd, kind, *(value.hex() if isinstance(value, bytes) else value for value in what))
        return returned

    tap(visit)


def limit_file_size(log_fd: int, size: int) -> None:
    """Limit the size of files [bytes] by a resource limit."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def _log(log_fd: int, *words: Any) -> None:
    os.write(log_fd, json.dumps(words).encode() + b"\n")


def _log_progress(log_fd: int) -> None:
    """Log the start and the end of the sweep, and each block that is stored."""
    from impact.engine import checkpoint
    from impact.results import sweep

    sweep_into, store = sweep.sweep_into, checkpoint.WorkFolder.store

    def logged_sweep(*args: Any, **options: Any) -> Any:
        _log(log_fd, "begun")
        try:
            return sweep_into(*args, **options)
        finally:
            _log(log_fd, "ended")

    def logged_store(folder: Any, part: Any, collisions: Any) -> None:
        store(folder, part, collisions)
        _log(log_fd, "kept", part.number)

    sweep.sweep_into, checkpoint.WorkFolder.store = logged_sweep, logged_store  # type: ignore[method-assign]


# ---- the server


def _warm_up() -> None:
    """Make blocks and slabs small before other modules import their sizes, and import the modules of a sweep."""
    from impact.engine import trajectories

    trajectories.RANGE_TRAJECTORIES = BLOCK_TRAJECTORIES
    trajectories.trajectory_ranges.__defaults__ = (BLOCK_TRAJECTORIES,)
    from impact.results import layouts, slabs

    slabs.slabs.__defaults__, layouts.SLAB_ROWS = (SLAB_POINTS,), BLOCK_TRAJECTORIES
    import impact.cli.sweep

    with tempfile.TemporaryDirectory() as folder:
        config, result = Path(folder, CONFIG), Path(folder, RESULT)
        for text in (CONFIG_TEXT, FACTORED_CONFIG, CONFIG_TEXT):
            config.write_text(text)
            impact.cli.sweep.sweep(config, result, quiet=True, overwrite=True)


def begin(log: str, fault: Sequence[Any]) -> None:
    """In the child: install the fault, in a separate process group."""
    os.setpgid(0, 0)
    log_fd = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    _log_progress(log_fd)
    if fault:
        faults = (send_signals, fail_disk, record_operations, limit_file_size)
        {install.__name__: install for install in faults}[fault[0]](log_fd, *fault[1:])


# ---- the client


@dataclass(frozen=True)
class FinishedSweep:
    """Result of a command line, and the log of its operations; a negative returncode is a signal."""

    returncode: int
    stdout: str
    stderr: str
    log: Log

    @property
    def kept(self) -> set[int]:
        """The blocks that were integrated and stored."""
        return {entry[1] for entry in self.log if entry[0] == "kept"}


@dataclass(frozen=True)
class RunningSweep:
    """A command line that has been started; its process id stays reserved until `wait`."""

    forked: ForkServer
    pid: int
    log_file: Path

    def log(self) -> Log:
        exists = self.log_file.exists()
        return [json.loads(line) for line in self.log_file.read_text().splitlines()] if exists else []

    def wait_until(self, *words: Any) -> None:
        """Wait until the log has an entry that starts with these words, or the process has ended."""
        wait_until(lambda: any(entry[: len(words)] == list(words) for entry in self.log()) or self.state in "ZX")

    @property
    def state(self) -> str:
        return process_state(self.pid)

    def signal(self, *numbers: int, group: bool = False) -> bool:
        """Send signals to the process or its group, unless the sweep has ended; return whether they were sent."""
        os.kill(self.pid, signal.SIGSTOP)
        wait_until(lambda: self.state in "TZX")
        in_time = self.state == "T" and ["ended"] not in self.log()
        for number in numbers if in_time else ():
            (os.killpg if group else os.kill)(self.pid, number)
        os.kill(self.pid, signal.SIGCONT)
        return in_time

    def children(self) -> list[int]:
        """The processes that it started."""
        pids = (int(path.name) for path in Path("/proc").glob("[0-9]*"))
        return [pid for pid in pids if parent_process(pid) == self.pid]

    def workers(self) -> list[int]:
        """The child processes that integrate."""
        return [pid for pid in self.children() if "spawn_main" in _of_process(pid, "cmdline")]

    def wait(self, limit: float = TIMEOUT_S) -> FinishedSweep:
        """Wait for the end; fail after the time limit [s]."""
        ended = self.forked.wait(self.pid, limit)
        assert not ended.timed_out, ("the process hangs", ended)
        return FinishedSweep(ended.returncode, ended.stdout, ended.stderr, self.log())


def _of_process(pid: int, name: str) -> str:
    """The content of a file in /proc/PID; empty if the process does not exist."""
    try:
        return Path(f"/proc/{pid}/{name}").read_text()
    except OSError:
        return ""


def process_state(pid: int) -> str:
    """The state of a process in /proc: T is stopped, Z has ended; X if it does not exist."""
    return (_of_process(pid, "stat").rpartition(")")[2].split() or ["X"])[0]


def parent_process(pid: int) -> int:
    return int((_of_process(pid, "stat").rpartition(")")[2].split() or ["X", "0"])[1])


@dataclass(frozen=True)
class SweepServer:
    """The client of a server, and a folder for logs and outputs; `sweeps(...)` runs a command line to its end."""

    forked: ForkServer
    base: Path
    text: str = CONFIG_TEXT
    count: Iterator[int] = field(default_factory=itertools.count)
    digests: dict[str, str] = field(default_factory=dict)

    def start(self, *words: str | Path | int, cwd: Path, fault: Sequence[Any] = ()) -> RunningSweep:
        """Start `impact sweep c.toml -o results.h5` with more words, in a folder with the config."""
        log = self.base / f"{next(self.count)}.log"
        code = (
            f"import json\nfrom tests.faults import begin\nbegin(*json.loads({json.dumps([str(log), fault])!r}))"
        )
        pid = self.forked.start("sweep", CONFIG, "-o", RESULT, "--quiet", *words, cwd=cwd, code=code)
        return RunningSweep(self.forked, pid, log)

    def __call__(
        self, *words: str | Path | int, cwd: Path, fault: Sequence[Any] = (), limit: float = TIMEOUT_S
    ) -> FinishedSweep:
        return self.start(*words, cwd=cwd, fault=fault).wait(limit)

    def with_config(self, text: str) -> SweepServer:
        """The same server with another config."""
        return replace(self, text=text)

    def folder(self, text: str = "") -> Path:
        """A new folder with a config."""
        path = self.base / f"folder{next(self.count)}"
        path.mkdir()
        (path / CONFIG).write_text(text or self.text)
        return path

    def expected_digest(self, folder: Path) -> str:
        """The SHA-256 of the result of a folder's config, computed in this process without a fault."""
        from impact.results.sweep import read_plan, sweep_into

        text = (folder / CONFIG).read_text()
        if text not in self.digests:
            with tempfile.TemporaryDirectory() as whole:
                sweep_into(Path(whole, RESULT), read_plan(folder / CONFIG))
                self.digests[text] = digest(Path(whole, RESULT))
        return self.digests[text]

    @cached_property
    def operations(self) -> Log:
        """The operations of a sweep without a fault, in order."""
        log = self(cwd=self.folder(), fault=("record_operations",)).log
        return [entry for entry in log if entry[0] not in ("begun", "kept", "ended")]

    def find_operation(self, *words: str) -> int:
        """The number of the first of these operations that starts with these words."""
        return next(at for at, entry in enumerate(self.operations) if entry[: len(words)] == [*words])

    @property
    def block_renames(self) -> list[int]:
        """The operations that give the blocks their names."""
        return [at for at, entry in enumerate(self.operations) if entry[:2] == ["rename", f"{WORK}/block.part"]]

    def choose_operations(self, count: int | None, first: int = 0, last: int | None = None) -> list[int]:
        """Some operations from `first` to before `last`, half of them writes; without a count all of them."""
        numbers = range(first, last or len(self.operations))
        if count is None:
            return list(numbers)
        writes = [at for at in numbers if self.operations[at][0] == "write"]
        others = sorted({*numbers} - {*writes})
        return sorted((*pick_evenly(writes, count // 2), *pick_evenly(others, count - count // 2)))

    def run_killed_at(self, operation: int) -> Path:
        """A folder that a sweep killed at an operation leaves."""
        folder = self.folder()
        killed = self(cwd=folder, fault=("send_signals", operation, signal.SIGKILL))
        assert killed.returncode == -signal.SIGKILL, killed
        return folder

    @cached_property
    def finished(self) -> Path:
        """A folder that a sweep leaves that is killed after its last block."""
        return self.run_killed_at(self.find_operation("create", f"{RESULT}.part"))

    def copy_finished(self, text: str = "") -> Path:
        """A copy of `finished` with this config."""
        folder = self.folder(text)
        shutil.copytree(self.finished / WORK, folder / WORK)
        return folder


@dataclass
class FaultReport:
    """The trials of a fault, and those that lost a finished block or gave a wrong result."""

    fault: str
    sweeps: SweepServer
    trials: int = 0
    lost: list[str] = field(default_factory=list)
    wrong: list[str] = field(default_factory=list)

    def resume(self, folder: Path, kept: set[int], at: object, *words: str | int) -> FinishedSweep:
        """Resume the sweep after a fault; blocks that were kept must not be integrated again."""
        self.trials += 1
        expected = self.sweeps.expected_digest(folder)
        if os.path.lexists(folder / RESULT) and digest(folder / RESULT) != expected:
            self.wrong.append(f"{at}: incomplete result")
        completed = self.sweeps("--resume", *words, cwd=folder)
        if completed.returncode != 0 or completed.kept & kept:
            self.lost.append(f"{at}: {completed}, had kept {kept}")
        if digest(folder / RESULT) != expected:
            self.wrong.append(f"{at}: {completed}, {digest(folder / RESULT)}")
        return completed

    def check(self) -> None:
        print(f"{self.fault} | {self.trials} | {len(self.lost)} | {len(self.wrong)}")
        assert self.trials
        assert not self.wrong, "\n".join(self.wrong)
        assert not self.lost, "\n".join(self.lost)


def digest(path: Path) -> str:
    """The SHA-256 of a file; "no file" if there is none."""
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "no file"


def finished_blocks(folder: Path) -> set[int]:
    """The blocks in a work folder."""
    return {int(path.stem) for path in (folder / WORK).glob("*.npz")}


def sweep_duration(sweeps: SweepServer) -> float:
    """The time that a sweep takes [s]."""
    running = sweeps.start(cwd=sweeps.folder())
    running.wait_until("begun")
    start_time = time.monotonic()
    running.wait()
    return time.monotonic() - start_time


def pick_evenly(items: Sequence[Any], count: int) -> list[Any]:
    """Evenly spaced items, including the first and the last."""
    steps = max(min(count, len(items)) - 1, 1)
    return [items[at * (len(items) - 1) // steps] for at in range(min(count, len(items)))]


@contextmanager
def mount_tmpfs(folder: Path, options: str) -> Iterator[None]:
    """Mount a small file system in a folder; skip the test if that is not permitted."""
    # processes that integrate import this module, and do not need pytest
    import pytest

    folder.mkdir(exist_ok=True)
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode != 0:
        pytest.skip("needs permission to mount a file system")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def start_sweep_server(base: Path) -> Iterator[SweepServer]:
    """Start a server; it ends with the context."""
    with start_fork_server(sys.executable, "-m", "tests.faults") as forked:
        yield SweepServer(forked, base)


if __name__ == "__main__":
    serve(_warm_up)
