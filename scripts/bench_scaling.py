"""Scaling of a sweep over processes and dask workers, and the number of workers that one driver can supply.

A sweep of two models, all impacts distinct and without deduplication, is written to a file by one process, two
processes, one dask worker and two dask workers. Scheduler and workers are started from the command line on this
machine. The table shows trajectories per second, from the plan to the complete file, and the ratio to one process.
For dask it also shows the CPU time of driver and scheduler per range, minus their CPU time when idle, and the
bytes sent per trajectory, as counted by the loopback interface. The number of workers that can be kept busy is the
time that a worker needs for a range, divided by the larger of these two CPU times. The files are written to
TMPDIR; use a folder in memory to exclude the disk, which is synchronized once per range.

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

from impact.engine.dask import cluster
from impact.engine.execute import context_of, integrate_columns, integrate_remotely
from impact.engine.executors import RANGES_IN_FLIGHT, ExecutorSpec, choose_executor
from impact.engine.plan import Plan
from impact.engine.run import Progress, Run
from impact.engine.trajectories import (
    RANGE_TRAJECTORIES,
    Columns,
)
from impact.results.sweep import read_plan, sweep_into

IDLE_TIME_S = 5.0
MODELS = ("lankarani-nikravesh-1990", "gharib-hurmuzlu-2012")


def table1_plan(points: int, core: str) -> Plan:
    """A plan of distinct impacts of the two balls of Table 1."""
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6.118486349e9}
    config = {
        "models": list(MODELS),
        "solver": {"collapse": False, "core": core},
        "sweep": {"e": {"linspace": [0.05, 0.99, points // len(MODELS)]}, **sweep},
    }
    return read_plan(config)


@contextmanager
def dask_processes(folder: Path, workers: int) -> Iterator[tuple[Path, psutil.Process]]:
    """Start a scheduler and workers; yields the scheduler file and the process of the scheduler."""
    file, children = folder / f"scheduler{workers}.json", []

    def start(*arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments, "--scheduler-file", str(file), "--no-dashboard"]
        child = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
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
    """Wall time and CPU times of driver and scheduler [s], and bytes sent over the loopback interface."""

    wall: float
    driver: float
    scheduler: float
    bytes_sent: int

    @classmethod
    def now(cls, scheduler: psutil.Process | None) -> Cost:
        """The counters at this moment."""
        cpu = scheduler.cpu_times() if scheduler is not None else None
        sent = psutil.net_io_counters(pernic=True)["lo"].bytes_sent
        return cls(time.perf_counter(), time.process_time(), cpu.user + cpu.system if cpu else 0.0, sent)

    def since(self, start: Cost) -> Cost:
        """The difference from earlier counters."""
        return Cost(*(getattr(self, name) - getattr(start, name) for name in vars(self)))


def best_cost(plan: Plan, executor: ExecutorSpec, scheduler: psutil.Process | None = None) -> tuple[float, Cost]:
    """Seconds of a whole sweep, and the cost of its integration; the fastest of three runs."""
    return min((sweep_cost(plan, executor, scheduler) for _ in range(3)), key=lambda timing: timing[0])


def sweep_cost(plan: Plan, executor: ExecutorSpec, scheduler: psutil.Process | None) -> tuple[float, Cost]:
    """Seconds of a whole sweep, and the cost of its integration."""
    start, integration = Cost.now(scheduler), []

    def on_progress(progress: Progress) -> None:
        if progress.trajectories in (0, progress.of_trajectories) and not progress.points:
            integration.append(Cost.now(scheduler))

    with tempfile.TemporaryDirectory() as folder:
        sweep_into(Path(folder) / "results.h5", plan, Run(executor, on_progress=on_progress))
    return Cost.now(scheduler).since(start).wall, integration[-1].since(integration[0])


def dask_cost(plan: Plan, key: str, columns: Columns, workers: int) -> tuple[float, Cost]:
    """The same with dask workers that have loaded their libraries; the cost without that of idle processes."""
    with (
        tempfile.TemporaryDirectory() as folder,
        dask_processes(Path(folder), workers) as (file, scheduler),
        cluster(file) as spec,
    ):
        while spec.capacity() < RANGES_IN_FLIGHT * workers:
            time.sleep(0.1)
        with spec.start() as executor:
            context = context_of(plan)
            wait([executor.submit(integrate_remotely, key, columns, context) for _ in range(4 * workers)])
        start = Cost.now(scheduler)
        time.sleep(IDLE_TIME_S)
        idle = Cost.now(scheduler).since(start)
        seconds, cost = best_cost(plan, spec, scheduler)
        share = cost.wall / idle.wall
        driver, scheduling = cost.driver - share * idle.driver, cost.scheduler - share * idle.scheduler
        return seconds, Cost(cost.wall, driver, scheduling, cost.bytes_sent)


def range_time(plan: Plan, key: str, columns: Columns) -> float:
    """CPU seconds of one range, without the compilation in a first run."""
    (model,) = (model for model in plan.models if model.key == key)
    for _ in range(2):
        start = time.process_time()
        integrate_columns(model, columns, plan.solver)
        seconds = time.process_time() - start
    return seconds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=500_000)
    parser.add_argument("--core", default="numpy", choices=["numpy", "numba"])
    args = parser.parse_args()
    if args.points <= RANGE_TRAJECTORIES:
        parser.error(f"--points: got {args.points:,}, expected more than {RANGE_TRAJECTORIES:,}")
    plan = table1_plan(args.points, args.core)
    ranges = plan.ranges
    middle = ranges[len(ranges) // 2]
    key, columns = plan.models[middle.model].key, plan.columns_of(middle)
    worker_time = range_time(plan, key, columns)
    print(f"{plan.points:,} points, {len(ranges)} ranges, {args.core}, {os.cpu_count()} cores")
    table = Table("", "trajectories/s", "ratio", "driver", "scheduler", "bytes", box=None)
    single, _ = best_cost(plan, choose_executor(1))
    for name, seconds in (("1 process", single), ("2 processes", best_cost(plan, choose_executor(2))[0])):
        table.add_row(name, f"{plan.points / seconds:,.0f}", f"{single / seconds:.2f}")
    for workers in (1, 2):
        seconds, cost = dask_cost(plan, key, columns, workers)
        driver, scheduler = cost.driver / len(ranges), cost.scheduler / len(ranges)
        table.add_row(
            f"{workers} dask worker{'s' if workers > 1 else ''}",
            f"{plan.points / seconds:,.0f}",
            f"{single / seconds:.2f}",
            f"{1e3 * driver:.1f} ms",
            f"{1e3 * scheduler:.1f} ms",
            f"{cost.bytes_sent / plan.points:.0f}",
        )
    Console(width=120).print(table)
    supplied = worker_time / max(driver, scheduler)
    print(f"a worker needs {1e3 * worker_time:.0f} ms for a range; one driver can supply {supplied:.0f} workers")


if __name__ == "__main__":
    main()
