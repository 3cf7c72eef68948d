"""Sweeps and dask clusters on this machine: a driver, a scheduler and workers, each a process.

They are forks of a server that makes blocks small, and lets each take a while, in which processes can be killed. A
process with other environment variables is a new interpreter, with blocks of the usual size.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .fork_server import TIMEOUT_S, CompletedCommand, ForkServer, serve, start_fork_server, wait_until

CONFIG = """title = "On a cluster"
models = ["hertz", "lankarani-nikravesh-1990"]
[solver]
collapse = false
core = "numpy"
rtol = 1e-8
[output]
variables = ["v1_post", "contact_time", "status"]
[sweep]
e = { linspace = [0.01, 0.99, 3500] }
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 1e9
"""
BLOCK_TRAJECTORIES, BLOCK_COUNT = 512, 14
BLOCK_S = 0.1  # how much longer a block takes
# the sweep in as many blocks of the usual size
LARGE_CONFIG = CONFIG.replace("3500", "200000")
SINGLE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
# a separate process group; threads are waited for at the end, as an interpreter does
BEGIN = "import atexit, os, threading\nos.setsid()\natexit.register(threading._shutdown)\n"
DASK = "import sys\nfrom dask.__main__ import main\nsys.argv = ['dask', *%r]\nmain()\n"


# ---- the server


def slow_down() -> None:
    """Let each block take longer in this process, without CPU time."""
    from impact.engine import execute

    integrate = execute.integrate_columns

    def integrate_slowly(*arguments: Any) -> Any:
        time.sleep(BLOCK_S)
        return integrate(*arguments)

    execute.integrate_columns = integrate_slowly


def _warm_up() -> None:
    """Make blocks small before other modules import their size, and import what a sweep and a cluster need."""
    from impact.engine import trajectories

    trajectories.RANGE_TRAJECTORIES = BLOCK_TRAJECTORIES
    trajectories.trajectory_ranges.__defaults__ = (BLOCK_TRAJECTORIES,)
    import impact.cli.sweep

    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder, "c.toml")
        config.write_text(CONFIG)
        impact.cli.sweep.sweep(config, Path(folder, "results.h5"), quiet=True)
    import distributed.cli.dask_scheduler
    import distributed.cli.dask_worker
    import distributed.dashboard.scheduler  # noqa: F401

    from impact.engine import dask

    slow_down()
    # the processes of a local cluster are new interpreters
    dask.WORKER_PRELOAD += "; from tests.clusters import slow_down; slow_down()"


# ---- the client


@dataclass(frozen=True)
class ForkedProcess:
    """A process of the server; its process id stays reserved until `wait`."""

    forked: ForkServer
    pid: int

    @property
    def has_ended(self) -> bool:
        try:
            return Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        except OSError:
            # a system without /proc
            return False

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def wait(self) -> CompletedCommand:
        completed = self.forked.wait(self.pid, TIMEOUT_S)
        assert not completed.timed_out, ("the process hangs", completed)
        return completed


@dataclass(frozen=True)
class NewProcess:
    """The same for a new interpreter."""

    process: subprocess.Popen[str]

    @property
    def pid(self) -> int:
        return self.process.pid

    @property
    def has_ended(self) -> bool:
        return self.process.poll() is not None

    def send_signal(self, number: int) -> None:
        self.process.send_signal(number)

    def wait(self) -> CompletedCommand:
        printed = self.process.communicate(timeout=TIMEOUT_S)
        return CompletedCommand(self.process.returncode, 0.0, 0, False, *(text or "" for text in printed))


def start_new(folder: Path, module: str, *words: str, log: Path | None = None, **environment: str) -> NewProcess:
    """Start a module in a new interpreter, in a separate process group."""
    with log.open("w") if log else contextlib.nullcontext(subprocess.PIPE) as stream:
        process = subprocess.Popen(
            [sys.executable, "-m", module, *words],
            cwd=folder,
            env={**os.environ, **SINGLE_THREAD, **environment},
            text=True,
            stdout=stream,
            stderr=stream,
            start_new_session=True,
        )
    return NewProcess(process)


@dataclass
class DaskCluster:
    """A scheduler and workers; `folder` is their working directory, which differs from that of sweeps."""

    forked: ForkServer
    folder: Path
    children: dict[str, ForkedProcess | NewProcess] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        return self.folder / "scheduler.json"

    @property
    def address(self) -> str:
        return str(json.loads(self.file.read_text())["address"])

    def log(self, name: str) -> Path:
        return self.folder / f"{name}.log"

    def start(self, name: str, *words: str, **environment: str) -> None:
        self.log(name).touch()
        if environment:
            self.children[name] = start_new(self.folder, "dask", *words, log=self.log(name), **environment)
            return
        log, code = str(self.log(name)), BEGIN + DASK % (words,)
        pid = self.forked.start(cwd=self.folder, code=code, stdout=log, stderr=log)
        self.children[name] = ForkedProcess(self.forked, pid)

    def scheduler(self, **environment: str) -> None:
        self.start(
            "scheduler",
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--dashboard-address",
            "127.0.0.1:0",
            "--scheduler-file",
            str(self.file),
            **environment,
        )
        wait_until(lambda: self.file.is_file() and self.file.stat().st_size > 0)

    def worker(self, name: str, *, ready: bool = True, **environment: str) -> None:
        self.start(
            name,
            "worker",
            "--scheduler-file",
            str(self.file),
            "--name",
            name,
            "--nthreads",
            "1",
            "--no-nanny",
            "--no-dashboard",
            "--local-directory",
            str(self.folder),
            **environment,
        )
        if ready:
            self.wait_for_workers(name)

    def wait_for_workers(self, *names: str) -> None:
        wait_until(lambda: all("Registered to" in self.log(name).read_text() for name in names))

    def kill(self, *names: str) -> None:
        """Kill processes by their names."""
        for name in names:
            child = self.children.pop(name)
            child.send_signal(signal.SIGKILL)
            child.wait()


@dataclass
class RunningSweep:
    """A sweep on the command line, in a folder with its config."""

    folder: Path
    process: ForkedProcess | NewProcess

    def kept(self) -> set[str]:
        """The files of its finished blocks."""
        return {path.name for path in self.folder.glob("*.work/*.npz")}

    def wait_for_blocks(self, count: int) -> None:
        wait_until(lambda: len(self.kept()) >= count or self.process.has_ended)
        assert not self.process.has_ended, self.process.wait()

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def wait(self, code: int = 0) -> str:
        """Wait for the end, check the exit status and return stderr."""
        completed = self.process.wait()
        assert completed.returncode == code, completed.stderr
        return completed.stderr

    @property
    def content(self) -> bytes:
        return content(self.folder)


@dataclass(frozen=True)
class ClusterServer:
    """The client of a server."""

    forked: ForkServer

    @contextmanager
    def start_cluster(self, folder: Path, *workers: str, **environment: str) -> Iterator[DaskCluster]:
        """Start a scheduler with this environment, and workers; they end with the context."""
        folder.mkdir(parents=True)
        cluster = DaskCluster(self.forked, folder)
        try:
            cluster.scheduler(**environment)
            for name in workers:
                cluster.worker(name, ready=False)
            cluster.wait_for_workers(*workers)
            yield cluster
        finally:
            cluster.kill(*cluster.children)

    def start_sweep(self, folder: Path, *words: str | Path, config: str = CONFIG) -> RunningSweep:
        """Start a sweep in a separate process group."""
        folder.mkdir(exist_ok=True)
        (folder / "c.toml").write_text(config)
        return RunningSweep(folder, self.start("sweep", "c.toml", *words, cwd=folder))

    def start(self, *words: str | Path, cwd: Path) -> ForkedProcess:
        """Start a command line in a separate process group."""
        return ForkedProcess(self.forked, self.forked.start(*words, cwd=cwd, code=BEGIN))


def start_new_sweep(folder: Path, *words: str | Path, config: str = LARGE_CONFIG) -> RunningSweep:
    """Start a sweep in a new interpreter."""
    folder.mkdir(exist_ok=True)
    (folder / "c.toml").write_text(config)
    return RunningSweep(folder, start_new(folder, "impact", "sweep", "c.toml", *map(str, words)))


@contextmanager
def start_cluster_server() -> Iterator[ClusterServer]:
    """Start a server; it ends with the context."""
    with start_fork_server(sys.executable, "-m", "tests.clusters") as forked:
        yield ClusterServer(forked)


def content(folder: Path) -> bytes:
    """The bytes of the result in a folder."""
    return (folder / "results.h5").read_bytes()


def processes_of_group(group: int) -> list[int]:
    """The running processes of a group."""
    pids = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, process_group = path.read_text().rpartition(")")[2].split()[:3]
            pids += [int(path.parent.name)] if process_group == str(group) and state != "Z" else []
    return pids


if __name__ == "__main__":
    serve(_warm_up)
