"""How many impacts a second does the core integrate, against a loop of scipy's solve_ivp at matched accuracy?

Every model of the paper that e drives, mixed; e from 0.05 to 0.99, all impacts distinct, nothing collapsed, all
outputs computed. Both sides have to deliver max |e_out - exact| <= 1e-8: the tolerance of each is the loosest of
a list that does. They run in turn for some rounds, since a machine that is shared is now faster, now slower.
Printed is the middle one of the rounds' ratios, with the least and the most: of the NumPy core and, where numba is
installed, of the compiled one, on one thread and on several; how many times one thread's rate several have, in
the middle round and of the fastest of either; and
what part of the rate at which the arithmetic of the accepted steps would go as a loop of multiply-adds. That loop,
and processes that each do the same by themselves, tell what several threads could gain on the machine. Then sweeps
by one process, by several and by threads, from the plan to the dataset, with their start; and what the start of a
command takes with each core, compiled anew and from what is kept.

    python scripts/bench_core.py [--impacts 2000000] [--loop 300] [--rounds 15] [--jobs 2]
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

import impact
from impact.api import execute, prepare
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel
from impact.contact.numba.dispatch import is_installed
from impact.contact.outputs import OUTPUTS, collide
from impact.engine.executors import choose_backend
from impact.engine.trajectories import RANGE_TRAJECTORIES, even_size

# those of the paper whose restitution is e's alone: (10), (19)-(23), (28), (29), (33) and (43)
PAPER = (
    "hertz", "hunt-crossley-1975", "herbert-mcwhannell-1977", "lee-wang-1983", "lankarani-nikravesh-1990",
    "exact-hysteresis", "gharib-hurmuzlu-2012", "lankarani-nikravesh-1994", "gharib-hurmuzlu-2012-energetic",
    "bilinear",
)  # fmt: skip
FIGURE6 = Path(__file__).parents[1] / "configs" / "figure6.toml"
ACCURACY = 1e-8
# ten to a decade
TOLERANCES = tuple(float(f"{one:.2g}") for one in np.geomspace(1e-6, 1e-12, 61))


def table1(e: np.ndarray, model: ForceModel) -> Impacts:
    """Impacts of the two balls of Table 1."""

    def all_of(value: float) -> np.ndarray:
        return np.full(e.size, value)

    unknown = all_of(np.nan)
    n = model.exponent or 1.5
    return Impacts(
        e=e, v1=all_of(1.0), v2=all_of(0.0), m1=all_of(1.0), m2=all_of(1.0), K=all_of(6.118486349e9), n=all_of(n),
        R1=unknown, R2=unknown, E1=unknown, nu1=unknown, yield_strength1=unknown, E2=unknown, nu2=unknown,
        yield_strength2=unknown,
    )  # fmt: skip


def core(
    models: list[ForceModel], e: np.ndarray, rtol: float, by: str, threads: int = 1
) -> tuple[float, float, int]:
    """Seconds, worst error and mean steps of a core, in blocks as a sweep runs them, with all outputs."""
    blocks = []
    for place, model in enumerate(models):
        mine = e[place :: len(models)]
        size = even_size(mine.size, RANGE_TRAJECTORIES)
        blocks += [(model, table1(mine[first : first + size], model)) for first in range(0, mine.size, size)]

    def outputs(block: tuple[ForceModel, Impacts]) -> tuple[float, int]:
        contact = collide(*block, rtol=rtol, max_steps=10_000, collapse=False, core=by)
        values = {name: contact[name] for name in OUTPUTS}
        return float(np.max(np.abs(values["closed_form_error"]))), int(values["steps"].sum())

    with choose_backend(1, threads).executor() as pool:
        begun = time.perf_counter()
        found = list(pool.map(outputs, blocks))
        seconds = time.perf_counter() - begun
    return seconds, max(worst for worst, _ in found), sum(steps for _, steps in found) // e.size


# the operations of one step, counted where the kernel is plain Python
COUNT = """
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


def multiply_adds() -> Callable[[int], float]:
    """What measures how many operations a second a loop of multiply-adds does, on so many threads at once."""
    from numba import njit

    @njit(fastmath={"contract"}, nogil=True)
    def multiply_and_add(x: np.ndarray, times: int) -> None:
        for _ in range(times):
            for j in range(192):
                x[j] = x[j] * 0.999 + 0.001

    multiply_and_add(np.ones(192), 1)

    def rate(threads: int) -> float:
        with ThreadPoolExecutor(threads) as pool:
            begun = time.perf_counter()
            list(pool.map(lambda _: multiply_and_add(np.ones(192), 1_000_000), range(16)))
            return 16 * 2 * 192 * 1_000_000 / (time.perf_counter() - begun)

    return rate


def by_itself(e: np.ndarray, rtol: float) -> float:
    """Impacts a second of the compiled core, in a process of its own."""
    return e.size / core([impact.models()[key] for key in PAPER], e, rtol, "numba")[0]


def gained(several: list[float], one: list[float]) -> tuple[str, str]:
    """How many times one thread's rate several have: the middle of the rounds, and the fastest by the fastest."""
    middle = median(more / alone for more, alone in zip(several, one, strict=True))
    return f"{middle:.2f}", f"{max(several) / max(one):.2f}"


def operations() -> int:
    """Additions, multiplications and divisions of a step."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    told = subprocess.run(
        [sys.executable, "-c", COUNT], env=environment, capture_output=True, text=True, check=True
    )
    return int(told.stdout)


def starts() -> Table:
    """What a sweep of a few impacts takes from the command line, the middle one of five."""
    table = Table("the start of a sweep", "seconds", box=None)
    command = [sys.executable, "-m", "impact", "sweep", str(FIGURE6), "--quiet", "--overwrite", "-o"]

    def seconds(folder: str, by: str, times: int, **environment: str) -> float:
        taken = []
        for _ in range(times):
            begun = time.perf_counter()
            subprocess.run([*command, f"{folder}/out.h5", "--set", f'solver.core="{by}"'], check=True,
                           env={**os.environ, **environment})  # fmt: skip
            taken.append(time.perf_counter() - begun)
        return sorted(taken)[times // 2]

    with tempfile.TemporaryDirectory() as folder:
        table.add_row("numpy", f"{seconds(folder, 'numpy', 5):.2f}")
        table.add_row("numba, compiled anew", f"{seconds(folder, 'numba', 1, NUMBA_CACHE_DIR=folder):.2f}")
        table.add_row("numba, kept", f"{seconds(folder, 'numba', 5, NUMBA_CACHE_DIR=folder):.2f}")
    return table


def one_by_solve_ivp(model: ForceModel, e: float, rtol: float) -> float:
    """The delivered restitution of one impact as one writes it by hand: x, v in scaled units, two phases."""
    n = model.exponent or 1.5
    chi = float(np.asarray(model.coefficients["chi"](e))) if "chi" in model.coefficients else 0.0

    def inward(_: float, y: list[float]) -> tuple[float, float]:
        x = y[0]
        return y[1], -(x**n if x > 0.0 else 0.0) * (1.0 + chi * y[1])

    def stopped(_: float, y: list[float]) -> float:
        return y[1]

    stopped.terminal, stopped.direction = True, -1  # type: ignore[attr-defined]
    first = solve_ivp(inward, (0.0, 1e3), (0.0, 1.0), rtol=rtol, atol=rtol, events=stopped)
    peak = first.y[0, -1]
    residual, stiffness = 0.0, 1.0
    if model.unloading is not None:
        residual, stiffness = peak * (1.0 - e * e), e ** (-2.0 * n)

    def outward(_: float, y: list[float]) -> tuple[float, float]:
        x = y[0] - residual
        return y[1], -stiffness * (x**n if x > 0.0 else 0.0) * (1.0 + chi * y[1])

    def parted(_: float, y: list[float]) -> float:
        return y[0] - residual

    parted.terminal, parted.direction = True, -1  # type: ignore[attr-defined]
    last = solve_ivp(outward, (0.0, 1e3), (peak, 0.0), rtol=rtol, atol=rtol, events=parted)
    return -last.y[1, -1]


def loop(models: list[ForceModel], e: np.ndarray, rtol: float) -> tuple[float, float]:
    """Seconds and worst error of the loop."""
    worst, begun = 0.0, time.perf_counter()
    for place, one in enumerate(e.tolist()):
        model = models[place % len(models)]
        out = one_by_solve_ivp(model, one, rtol)
        exact = one
        if "chi" in model.coefficients:
            exact = float(delivered_restitution(float(np.asarray(model.coefficients["chi"](one)))))
        elif model.key == "hertz":
            exact = 1.0
        worst = max(worst, abs(out - exact))
    return time.perf_counter() - begun, worst


def sweep(models: list[ForceModel], impacts: int, rtol: float, by: str, jobs: int, threads: int) -> float:
    """Impacts a second of a sweep, from its plan to its dataset in memory."""
    plan = prepare(
        {
            "models": [model.key for model in models],
            "sweep": {"e": {"linspace": [0.05, 0.99, impacts // len(models)]}, "v1": 1.0, "m1": 1.0, "m2": 1.0,
                      "material": "table1"},
            "materials": {"table1": {"E": 56e9, "nu": 0.3, "rho": 2712.0}},
            "solver": {"rtol": rtol, "collapse": False, "core": by},
        }
    )  # fmt: skip
    begun = time.perf_counter()
    execute(plan, choose_backend(jobs, threads))
    return plan.points / (time.perf_counter() - begun)


def side_by_side(asked: argparse.Namespace, models: list[ForceModel], cores: list[str]) -> float:
    """Run the engines in turn, and print what they do at matched accuracy. Returns the tolerance of the cores."""
    # a second for either: with fewer the last blocks, at which not all threads are, would count
    impacts = {
        "numpy": np.linspace(0.05, 0.99, asked.impacts // 5),
        "numba": np.linspace(0.05, 0.99, asked.impacts),
    }
    few = np.linspace(0.05, 0.99, asked.loop)

    rtol = next(r for r in TOLERANCES if all(core(models, few, r, by)[1] <= ACCURACY for by in cores))
    loop_rtol = next(r for r in TOLERANCES if loop(models, few, r)[1] <= ACCURACY)
    rows = [("numpy", 1), *((("numba", threads) for threads in sorted({1, asked.jobs})) if len(cores) > 1 else ())]
    loops, engines = [], {row: [] for row in rows}
    arithmetic = multiply_adds() if "numba" in cores else None
    flops: dict[int, list[float]] = {1: [], asked.jobs: []}
    # processes that share no interpreter tell what the machine itself lets several threads gain
    processes, apart = ProcessPoolExecutor(asked.jobs, get_context("spawn")), []
    if arithmetic:
        list(processes.map(by_itself, [few] * asked.jobs * 8, [rtol] * asked.jobs * 8))
    for turn in range(asked.rounds):
        loops.append(loop(models, few, loop_rtol))
        # forth and back: what comes after another finds its caches and its memory
        for row in rows[:: -1 if turn % 2 else 1]:
            e = impacts[row[0]]
            seconds, worst, steps = core(models, e, rtol, *row)
            engines[row].append((e.size / seconds, worst, steps))
        if arithmetic:
            for threads, found in flops.items():
                found.append(arithmetic(threads))
            apart.append(sum(processes.map(by_itself, [impacts["numba"]] * asked.jobs, [rtol] * asked.jobs)))
    base = [asked.loop / seconds for seconds, _ in loops]
    table = Table(
        "engine", "threads", "rtol", "worst error", "steps", "impacts/s", "ratio", "least", "most",
        "of one thread", "at best", "of the limit", box=None,
    )  # fmt: skip
    worst = f"{loops[0][1]:.2g}"
    table.add_row("solve_ivp RK45, loop", "1", f"{loop_rtol:g}", worst, "", f"{median(base):,.0f}", "1")
    each = operations() if arithmetic else 0
    for (by, threads), found in engines.items():
        _, worst, steps = found[0]
        if worst > ACCURACY:
            raise SystemExit(f"the core is off by {worst:.2g}, expected at most {ACCURACY:g}")
        rates = [rate for rate, _, _ in found]
        ratios = [rate / one for rate, one in zip(rates, base, strict=True)]
        gain = gained(rates, [rate for rate, _, _ in engines[by, 1]])
        share = f"{100 * median(rates) * steps * each / median(flops[threads]):.0f} %" if by == "numba" else ""
        table.add_row(
            f"impact, {by}", str(threads), f"{rtol:g}", f"{worst:.2g}", str(steps), f"{median(rates):,.0f}",
            *(f"{one:,.0f}" for one in (median(ratios), min(ratios), max(ratios))), *gain, share,
        )  # fmt: skip
    processes.shutdown()
    if arithmetic:
        gain = gained(apart, [rate for rate, _, _ in engines["numba", 1]])
        name = f"the same, {asked.jobs} processes"
        table.add_row(name, "1 each", "", "", "", f"{median(apart):,.0f}", "", "", "", *gain)
    for threads, found in flops.items() if arithmetic else ():
        rate = f"{median(found) / 1e9:,.0f} GFLOP/s"
        table.add_row("multiply-adds", str(threads), "", "", "", rate, "", "", "", *gained(found, flops[1]))
    sizes = f"{asked.impacts:,} impacts (numpy: a fifth, loop: {asked.loop}), {asked.rounds} rounds"
    about = f"{len(models)} models, {sizes}, {os.cpu_count()} cores"
    Console(width=140).print(about, table, sep="\n")
    return rtol


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--impacts", type=int, default=2_000_000, help="of the compiled core")
    parser.add_argument("--loop", type=int, default=300, help="impacts of the loop")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--jobs", type=int, default=2, help="processes of the sweep")
    asked = parser.parse_args()
    models = [impact.models()[key] for key in PAPER]
    cores = ["numpy", "numba"] if is_installed() else ["numpy"]
    rtol = side_by_side(asked, models, cores)
    # processes take most of a second to begin, whatever they are to do
    for by in cores:
        table = Table(
            f"a sweep ({by}) of", "1 [impacts/s]", f"--jobs {asked.jobs}", f"--threads {asked.jobs}", box=None
        )
        for impacts in (1_000_000, 4_000_000):
            ways = ((1, 1), (asked.jobs, 1), (1, asked.jobs))
            one, *more = (sweep(models, impacts, rtol, by, jobs, threads) for jobs, threads in ways)
            table.add_row(f"{impacts:,}", f"{one:,.0f}", *(f"{rate:,.0f} ({rate / one:.2f})" for rate in more))
        Console(width=140).print(table)
    if len(cores) > 1:
        Console().print(starts())


if __name__ == "__main__":
    main()
