"""Throughput of the compiled core, compared with the arithmetic limit of the machine.

The limit is the rate of a loop of multiply-adds. The core's rate is its impacts per second times its steps per
impact times the floating-point operations of a step. Both run on one thread and on several. The same core in
independent processes shows the speedup that the machine allows. All run in turn for several rounds; the table
shows medians, the speedup over one thread in the median round, and that of the best rates.

    python scripts/bench_limit.py [--impacts 2000000] [--rounds 15] [--jobs 2]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from numba import njit
from rich.console import Console
from rich.table import Table

from bench_core import core_tolerance, restitutions, run_core, speedup

LENGTH, REPEATS, TASKS = 192, 1_000_000, 16

# counts the floating-point operations of one step, with the kernel as plain Python
COUNT_OPERATIONS = """
from impact.contact.numba.dispatch import END_AT_PEAK, EQ_DAMPED, Form
from impact.contact.numba.expressions import rk_step
class Counted(float):
    total = 0
def counted(name):
    def operation(self, other):
        Counted.total += 1
        return Counted(getattr(float, name)(self, other))
    return operation
for name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv"):
    setattr(Counted, f"__{name}__", counted(f"__{name}__"))
rk_step(Form(EQ_DAMPED, END_AT_PEAK, 2, 3), *map(Counted, (0.5, 0.5, 0.5, 0.1, 0.1, 0.01, 1.0)))
print(Counted.total)
"""


def operations_per_step() -> int:
    """Additions, multiplications and divisions of a step."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    command = [sys.executable, "-c", COUNT_OPERATIONS]
    return int(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)


@njit(fastmath={"contract"}, nogil=True)
def multiply_add(x: np.ndarray, repeats: int) -> None:
    for _ in range(repeats):
        for j in range(LENGTH):
            x[j] = x[j] * 0.999 + 0.001


def multiply_add_rate(threads: int) -> float:
    """Floating-point operations per second of the loop of multiply-adds, all threads together."""
    with ThreadPoolExecutor(threads) as pool:
        start = time.perf_counter()
        list(pool.map(lambda _: multiply_add(np.ones(LENGTH), REPEATS), range(TASKS)))
        return TASKS * 2 * LENGTH * REPEATS / (time.perf_counter() - start)


def core_rate(e: np.ndarray, rtol: float) -> float:
    """Impacts per second of the compiled core on one thread."""
    return e.size / run_core(e, rtol, "numba")[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--impacts", type=int, default=2_000_000)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--jobs", type=int, default=2, help="number of threads, and of processes")
    args = parser.parse_args()
    e, warm_up_e = restitutions(args.impacts), restitutions(300)
    rtol = core_tolerance(["numba"], warm_up_e)
    multiply_add(np.ones(LENGTH), 1)
    counts = sorted({1, args.jobs})
    core_rates: dict[int, list[float]] = {threads: [] for threads in counts}
    limits: dict[int, list[float]] = {threads: [] for threads in counts}
    process_rates: list[float] = []
    with ProcessPoolExecutor(args.jobs, get_context("spawn")) as processes:
        # enough calls for every process to load its libraries
        list(processes.map(core_rate, [warm_up_e] * args.jobs * 8, [rtol] * args.jobs * 8))
        for _ in range(args.rounds):
            for threads in counts:
                seconds, _, steps = run_core(e, rtol, "numba", threads)
                core_rates[threads].append(e.size / seconds)
                limits[threads].append(multiply_add_rate(threads))
            process_rates.append(sum(processes.map(core_rate, [e] * args.jobs, [rtol] * args.jobs)))

    operations = steps * operations_per_step()
    table = Table("program", "threads", "impacts/s", "GFLOP/s", "of the limit", "speedup", "best", box=None)
    for threads in counts:
        rate = median(core_rates[threads])
        flops = f"{rate * operations / 1e9:,.0f}"
        share = f"{100 * rate * operations / median(limits[threads]):.0f} %"
        gain = speedup(core_rates[threads], core_rates[1])
        table.add_row("impact, numba", str(threads), f"{rate:,.0f}", flops, share, *gain)
    rate = median(process_rates)
    flops = f"{rate * operations / 1e9:,.0f}"
    gain = speedup(process_rates, core_rates[1])
    table.add_row(f"impact, numba, {args.jobs} processes", "1 each", f"{rate:,.0f}", flops, "", *gain)
    for threads in counts:
        flops = f"{median(limits[threads]) / 1e9:,.0f}"
        table.add_row("multiply-adds", str(threads), "", flops, "100 %", *speedup(limits[threads], limits[1]))
    title = f"{args.impacts:,} impacts, {args.rounds} rounds, rtol {rtol:g}, {os.cpu_count()} cores"
    Console(width=120).print(title, table, sep="\n")


if __name__ == "__main__":
    main()
