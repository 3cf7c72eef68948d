"""Throughput of a sweep in one process, in several processes and in several threads.

All impacts are distinct and deduplication is off. The time is from the plan to the dataset in memory, including
the start of the processes. The table shows impacts per second, with the speedup over one process in parentheses.
`bench_scaling.py` measures processes and dask workers that write a file.

    python scripts/bench_parallel.py [--impacts 1000000 4000000] [--jobs 2]
"""

from __future__ import annotations

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

from rich.console import Console
from rich.table import Table

from bench_core import PAPER_MODELS
from impact.contact.numba.dispatch import is_installed
from impact.engine.executors import choose_executor
from impact.engine.run import Run
from impact.results.sweep import read_plan, sweep_in_memory
from ratios import record


def sweep_rate(impacts: int, rtol: float, core: str, jobs: int, threads: int) -> float:
    """Impacts per second of a sweep, from its plan to its dataset in memory."""
    sweep = {
        "e": {"linspace": [0.05, 0.99, impacts // len(PAPER_MODELS)]},
        "v1": 1.0,
        "m1": 1.0,
        "m2": 1.0,
        "material": "table1",
    }
    config = {
        "models": list(PAPER_MODELS),
        "sweep": sweep,
        "materials": {"table1": {"E": 56e9, "nu": 0.3, "rho": 2712.0}},
        "solver": {"rtol": rtol, "collapse": False, "core": core},
    }
    plan = read_plan(config)
    start = time.perf_counter()
    sweep_in_memory(plan, Run(choose_executor(jobs, threads)))
    return plan.points / (time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    # a process takes most of a second to start, which counts in a small sweep
    parser.add_argument("--impacts", type=int, nargs="+", default=[1_000_000, 4_000_000])
    parser.add_argument("--jobs", type=int, default=2, help="number of processes, and of threads")
    # both cores are accurate to 1e-8 at this tolerance, see bench_core.py
    parser.add_argument("--rtol", type=float, default=1e-7, help="tolerance of the solver")
    args = parser.parse_args()
    for core in ("numpy", "numba") if is_installed() else ("numpy",):
        jobs, threads = f"--jobs {args.jobs}", f"--threads {args.jobs}"
        table = Table(f"impacts in a sweep ({core})", "1 process (impacts/s)", jobs, threads, box=None)
        for impacts in args.impacts:
            settings = ((1, 1), (args.jobs, 1), (1, args.jobs))
            single, *rates = (sweep_rate(impacts, args.rtol, core, *setting) for setting in settings)
            for setting, rate in zip((jobs, threads), rates, strict=True):
                record(f"{impacts:,} impacts, {core}, {setting} per process", [rate / single])
            table.add_row(
                f"{impacts:,}", f"{single:,.0f}", *(f"{rate:,.0f} ({rate / single:.2f})" for rate in rates)
            )
        Console(width=140).print(table)


if __name__ == "__main__":
    main()
