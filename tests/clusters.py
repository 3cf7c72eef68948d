"""A dask cluster on this machine: a scheduler and workers, each a process started by a command."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from .fork_server import TIMEOUT_S, wait_until

CONFIG = """title = "On a cluster"
models = ["hertz", "lankarani-nikravesh-1990"]
[solver]
collapse = false
core = "numpy"
rtol = 1e-8
[output]
variables = ["v1_post", "contact_time", "status"]
[sweep]
e = { linspace = [0.01, 0.99, 200000] }
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 1e9
"""
BLOCK_COUNT = 14
DASK_COMMAND = (sys.executable, "-m", "dask")
SINGLE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass
class DaskCluster:
    """A scheduler and workers; `folder` is their working directory, which differs from that of sweeps."""

    folder: Path
    children: dict[str, subprocess.Popen[str]] = field(default_factory=dict)

    @property
    def file(self) -> Path:
        return self.folder / "scheduler.json"

    @property
    def address(self) -> str:
        return str(json.loads(self.file.read_text())["address"])

    def start(self, name: str, *words: str, **environment: str) -> None:
        with (self.folder / f"{name}.log").open("w") as log:
            self.children[name] = subprocess.Popen(
                [*DASK_COMMAND, *words],
                cwd=self.folder,
                env={**os.environ, **SINGLE_THREAD, **environment},
                text=True,
                stdout=log,
                stderr=log,
            )

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
            wait_until(lambda: "Registered to" in (self.folder / f"{name}.log").read_text())

    def kill(self, *names: str) -> None:
        """Kill processes by their names."""
        for name in names:
            self.children[name].send_signal(signal.SIGKILL)
            self.children[name].wait()


@contextmanager
def start_cluster(folder: Path, *workers: str, **environment: str) -> Iterator[DaskCluster]:
    """Start a scheduler with this environment, and workers; they end with the context."""
    folder.mkdir(parents=True)
    cluster = DaskCluster(folder)
    try:
        cluster.scheduler(**environment)
        for name in workers:
            cluster.worker(name)
        yield cluster
    finally:
        cluster.kill(*(name for name, child in cluster.children.items() if child.poll() is None))


@dataclass
class RunningSweep:
    """A sweep on the command line, in a folder with its config."""

    folder: Path
    process: subprocess.Popen[str]

    def kept(self) -> set[str]:
        """The files of its finished blocks."""
        return {path.name for path in self.folder.glob("*.work/*.npz")}

    def wait_for_blocks(self, count: int) -> None:
        wait_until(lambda: len(self.kept()) >= count or self.process.poll() is not None)
        assert self.process.poll() is None, self.process.communicate()

    def wait(self, code: int = 0) -> str:
        """Wait for the end, check the exit status and return stderr."""
        _, printed = self.process.communicate(timeout=TIMEOUT_S)
        assert self.process.returncode == code, printed
        return printed

    @property
    def content(self) -> bytes:
        return content(self.folder)


def start_sweep(folder: Path, *words: str | Path, config: str = CONFIG) -> RunningSweep:
    """Start a sweep in a separate process group."""
    folder.mkdir(exist_ok=True)
    (folder / "c.toml").write_text(config)
    process = subprocess.Popen(
        [sys.executable, "-m", "impact", "sweep", "c.toml", *map(str, words)],
        cwd=folder,
        env={**os.environ, **SINGLE_THREAD},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    return RunningSweep(folder, process)


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
