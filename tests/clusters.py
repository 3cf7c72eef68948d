"""A cluster of dask on this machine: a scheduler and workers, each a process started by command line."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

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
BLOCKS = 14
PATIENCE = 60.0  # s after which what should have happened is not waited for any more
DASK = (sys.executable, "-m", "dask")
ALONE = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass
class Dask:
    """A scheduler, and workers that come and go; `folder` is where they run, which is not where sweeps do."""

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
                [*DASK, *words], cwd=self.folder, env={**os.environ, **ALONE, **environment}, text=True,
                stdout=log, stderr=log,
            )  # fmt: skip

    def scheduler(self, **environment: str) -> None:
        self.start(
            "scheduler", "scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0",
            "--scheduler-file", str(self.file), **environment,
        )  # fmt: skip
        until(lambda: self.file.is_file() and self.file.stat().st_size > 0)

    def worker(self, name: str, *, ready: bool = True, **environment: str) -> None:
        self.start(
            name, "worker", "--scheduler-file", str(self.file), "--name", name, "--nthreads", "1", "--no-nanny",
            "--no-dashboard", "--local-directory", str(self.folder), **environment,
        )  # fmt: skip
        if ready:
            until(lambda: "Registered to" in (self.folder / f"{name}.log").read_text())

    def kill(self, *names: str) -> None:
        """End them at once, each by its own id."""
        for name in names:
            self.children[name].send_signal(signal.SIGKILL)
            self.children[name].wait()


@contextmanager
def dask(folder: Path, *workers: str, **environment: str) -> Iterator[Dask]:
    """A scheduler with this environment, and workers."""
    folder.mkdir(parents=True)
    found = Dask(folder)
    try:
        found.scheduler(**environment)
        for name in workers:
            found.worker(name)
        yield found
    finally:
        found.kill(*(name for name, child in found.children.items() if child.poll() is None))


@dataclass
class Sweep:
    """A sweep on the command line, in a folder with its config."""

    folder: Path
    process: subprocess.Popen[str]

    def kept(self) -> set[str]:
        """Its blocks that are kept."""
        return {one.name for one in self.folder.glob("*.work/*.npz")}

    def until_kept(self, count: int) -> None:
        until(lambda: len(self.kept()) >= count or self.process.poll() is not None)
        assert self.process.poll() is None, self.process.communicate()

    def ends(self, code: int = 0) -> str:
        """What it said, when it has ended with this code."""
        _, said = self.process.communicate(timeout=PATIENCE)
        assert self.process.returncode == code, said
        return said

    @property
    def content(self) -> bytes:
        return content(self.folder)


def sweep(folder: Path, *words: str | Path, config: str = CONFIG) -> Sweep:
    """Begin one, in a group of processes of its own."""
    folder.mkdir(exist_ok=True)
    (folder / "c.toml").write_text(config)
    process = subprocess.Popen(
        [sys.executable, "-m", "impact", "sweep", "c.toml", *map(str, words)], cwd=folder,
        env={**os.environ, **ALONE}, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        start_new_session=True,
    )  # fmt: skip
    return Sweep(folder, process)


def content(folder: Path) -> bytes:
    """The bytes of its result."""
    return (folder / "results.h5").read_bytes()


def until(condition: Callable[[], bool]) -> None:
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < PATIENCE
        time.sleep(0.02)


def in_group(group: int) -> list[int]:
    """The processes of a group that run."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, own = path.read_text().rpartition(")")[2].split()[:3]
            found += [int(path.parent.name)] if own == str(group) and state != "Z" else []
    return found
