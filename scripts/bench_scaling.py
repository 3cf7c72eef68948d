"""How does a sweep scale over processes and over dask's workers, and when is the driver the bottleneck?

One sweep of two laws, all impacts distinct, nothing collapsed, goes into a file by one process, by two, by one
and by two workers of dask; scheduler and workers are started by command line on this machine. Printed are
trajectories a second from the plan to the whole file, and their ratio to one process. For dask also the
processor time of the driver and of the scheduler for a range while workers integrate, beyond what they take when
idle, and the bytes over the wire for a trajectory, as the loopback interface counts them; and from these how
many workers they keep busy: the time that a worker takes for a range over theirs. The file is assembled when all
is integrated, in its own time. The files go where TMPDIR says; in memory, the disk is left out of it, on which
each range waits once.

    TMPDIR=/dev/shm python scripts/bench_scaling.py [--points 500000] [--core numpy]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import psutil
from rich.console import Console
from rich.table import Table

from impact.api import prepare
from impact.engine.dask import cluster
from impact.engine.execute import context_of, integrate_columns, integrate_remotely, with_core
from impact.engine.executors import BLOCKS_IN_FLIGHT, Backend, choose_backend
from impact.engine.plan import Plan
from impact.engine.progress import Progress
from impact.engine.trajectories import (
    RANGE_TRAJECTORIES,
    Columns,
    columns_of,
    trajectory_maps,
    trajectory_ranges,
)
from impact.results.sweep import sweep_into

IDLE = 5.0  # s
LAWS = ("lankarani-nikravesh-1990", "gharib-hurmuzlu-2012")


def plan_of(points: int, core: str) -> Plan:
    """Impacts of the two balls of Table 1, all distinct."""
    found = prepare({
        "models": list(LAWS),
        "solver": {"collapse": False, "core": core},
        "sweep": {
            "e": {"linspace": [0.05, 0.99, points // len(LAWS)]},
            "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6.118486349e9,
        },
    })  # fmt: skip
    return with_core(found, trajectory_maps(found))


@contextmanager
def dask(folder: Path, workers: int) -> Iterator[tuple[Path, psutil.Process]]:
    """A scheduler and workers, and the scheduler's process."""
    file, children = folder / f"scheduler{workers}.json", []

    def start(*words: str) -> subprocess.Popen[bytes]:
        child = subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--scheduler-file", str(file), "--no-dashboard"], cwd=folder,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        children.append(child)
        return child

    try:
        scheduler = start("scheduler", "--host", "127.0.0.1", "--port", "0")
        while not file.is_file():
            time.sleep(0.05)
        for _ in range(workers):
            start("worker", "--nthreads", "1", "--no-nanny", "--local-directory", str(folder))
        yield file, psutil.Process(scheduler.pid)
    finally:
        for child in reversed(children):
            child.kill()
            child.wait()


@dataclass(frozen=True)
class Cost:
    """Seconds on the clock, processor seconds of driver and scheduler, and bytes sent, up to a moment."""

    clock: float
    driver: float
    scheduler: float
    wire: int

    @classmethod
    def now(cls, scheduler: psutil.Process | None) -> Cost:
        theirs = scheduler.cpu_times() if scheduler is not None else None
        sent = psutil.net_io_counters(pernic=True)["lo"].bytes_sent
        return cls(time.perf_counter(), time.process_time(), theirs.user + theirs.system if theirs else 0.0, sent)

    def since(self, then: Cost) -> Cost:
        return Cost(*(getattr(self, name) - getattr(then, name) for name in vars(self)))


def measured(plan: Plan, backend: Backend, scheduler: psutil.Process | None = None) -> tuple[float, Cost]:
    """Seconds that a sweep takes, and what its trajectories alone cost; the best of a few."""
    return min((_measured(plan, backend, scheduler) for _ in range(3)), key=lambda timing: timing[0])


def _measured(plan: Plan, backend: Backend, scheduler: psutil.Process | None) -> tuple[float, Cost]:
    begun, ends = Cost.now(scheduler), []

    def on_progress(at: Progress) -> None:
        if at.trajectories in (0, at.of_trajectories) and not at.points:
            ends.append(Cost.now(scheduler))

    with tempfile.TemporaryDirectory() as folder:
        sweep_into(Path(folder) / "results.h5", plan, backend=backend, on_progress=on_progress)
    return Cost.now(scheduler).since(begun).clock, ends[-1].since(ends[0])


def by_dask(plan: Plan, key: str, columns: Columns, workers: int) -> tuple[float, Cost]:
    """The same, by workers that have loaded what they need."""
    with (
        tempfile.TemporaryDirectory() as folder,
        dask(Path(folder), workers) as (file, scheduler),
        cluster(file) as joined,
    ):
        while joined.backend.capacity() < BLOCKS_IN_FLIGHT * workers:
            time.sleep(0.1)
        with joined.backend.executor() as executor:
            wait([executor.submit(integrate_remotely, key, columns, context_of(plan)) for _ in range(4 * workers)])
        # both do something while nothing is asked of them
        begun = Cost.now(scheduler)
        time.sleep(IDLE)
        idle = Cost.now(scheduler).since(begun)
        seconds, cost = measured(plan, joined.backend, scheduler)
        share = cost.clock / idle.clock
        return seconds, Cost(
            cost.clock, cost.driver - share * idle.driver, cost.scheduler - share * idle.scheduler, cost.wire
        )


def main() -> None:
    parse = argparse.ArgumentParser(description="How a sweep scales.")
    parse.add_argument("--points", type=int, default=500_000)
    parse.add_argument("--core", default="numpy", choices=["numpy", "numba"])
    asked = parse.parse_args()
    if asked.points <= RANGE_TRAJECTORIES:
        parse.error(f"--points: got {asked.points:,}, expected more than {RANGE_TRAJECTORIES:,}")
    plan = plan_of(asked.points, asked.core)
    maps = trajectory_maps(plan)
    ranges = list(trajectory_ranges(maps))
    middle = ranges[len(ranges) // 2]
    model, columns = plan.models[middle.model], columns_of(plan, maps, middle)
    for _ in range(2):
        begun = time.process_time()
        integrate_columns(model, columns, plan.config.solver)
        alone = time.process_time() - begun
    print(f"{plan.points:,} points, {len(ranges)} ranges, {asked.core}, {os.cpu_count()} cores")
    rows = Table("", "trajectories/s", "ratio", "driver", "scheduler", "bytes", box=None)
    one, cost = measured(plan, choose_backend(1))
    for way, (seconds, cost) in (
        ("1 process", (one, None)),
        ("2 processes", (measured(plan, choose_backend(2))[0], None)),
        ("1 worker of dask", by_dask(plan, model.key, columns, 1)),
        ("2 workers of dask", by_dask(plan, model.key, columns, 2)),
    ):
        told = [f"{plan.points / seconds:,.0f}", f"{one / seconds:.2f}"]
        if cost is not None:
            each = (cost.driver / len(ranges), cost.scheduler / len(ranges))
            told += [*(f"{1e3 * own:.1f} ms" for own in each), f"{cost.wire / plan.points:.0f}"]
        rows.add_row(way, *told)
    Console(width=120).print(rows)
    each = max(cost.driver, cost.scheduler) / len(ranges)
    print(f"a worker takes {1e3 * alone:.0f} ms for a range: {alone / each:.0f} workers keep the busier one busy")


if __name__ == "__main__":
    main()
