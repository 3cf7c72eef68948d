"""Throughput of the integration cores, compared with a loop of scipy's solve_ivp at the same accuracy.

Ten models of the paper share the impacts, with e from 0.05 to 0.99. All impacts are distinct, deduplication is
off, and all outputs are computed. Each engine uses the largest tolerance of a list with max |e_out - exact| <=
1e-8. The engines run in turn for several rounds, because the load of a shared machine varies. The table shows the
median rates, the median ratio to the loop with its minimum and maximum, and the speedup by several threads: the
median over the rounds, and the best rate divided by the best rate of one thread.

    python scripts/bench_core.py [--impacts 2000000] [--loop 300] [--rounds 15] [--threads 2]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

import impact
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel
from impact.contact.numba.dispatch import is_installed
from impact.contact.output_formulas import collide
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.executors import choose_executor
from impact.engine.trajectories import RANGE_TRAJECTORIES, even_size

# models of the paper whose restitution depends on e only: equations (10), (19)-(23), (28), (29), (33) and (43)
PAPER_MODELS = (
    "hertz",
    "hunt-crossley-1975",
    "herbert-mcwhannell-1977",
    "lee-wang-1983",
    "lankarani-nikravesh-1990",
    "exact-hysteresis",
    "gharib-hurmuzlu-2012",
    "lankarani-nikravesh-1994",
    "gharib-hurmuzlu-2012-energetic",
    "bilinear",
)
MAX_ERROR = 1e-8
# ten per decade
TOLERANCES = tuple(float(f"{rtol:.2g}") for rtol in np.geomspace(1e-6, 1e-12, 61))


def restitutions(count: int) -> np.ndarray:
    """Distinct values of e for a number of impacts."""
    return np.linspace(0.05, 0.99, count)


def table1_impacts(e: np.ndarray, model: ForceModel) -> Impacts:
    """Impacts of the two balls of Table 1."""

    def full(value: float) -> np.ndarray:
        return np.full(e.size, value)

    unknown = full(np.nan)
    return Impacts(
        e=e,
        v1=full(1.0),
        v2=full(0.0),
        m1=full(1.0),
        m2=full(1.0),
        K=full(6.118486349e9),
        n=full(model.exponent or 1.5),
        R1=unknown,
        R2=unknown,
        E1=unknown,
        nu1=unknown,
        yield_strength1=unknown,
        E2=unknown,
        nu2=unknown,
        yield_strength2=unknown,
    )


def run_core(e: np.ndarray, rtol: float, core: str, threads: int = 1) -> tuple[float, float, int]:
    """Run a core on blocks of the same size as in a sweep, and compute all outputs.

    Parameters
    ----------
    e : restitution of each impact; the models of the paper take turns
    core : "numpy" or "numba"

    Returns
    -------
    seconds, largest error of e_out, mean number of steps per impact
    """
    blocks = []
    for k, key in enumerate(PAPER_MODELS):
        model, model_e = impact.models()[key], e[k :: len(PAPER_MODELS)]
        size = even_size(model_e.size, RANGE_TRAJECTORIES)
        starts = range(0, model_e.size, size)
        blocks += [(model, table1_impacts(model_e[start : start + size], model)) for start in starts]

    def run_block(block: tuple[ForceModel, Impacts]) -> tuple[float, int]:
        contact = collide(*block, rtol=rtol, max_steps=10_000, collapse=False, core=core)
        values = {name: contact[name] for name in CENTRAL_OUTPUTS}
        return float(np.max(np.abs(values["closed_form_error"]))), int(values["steps"].sum())

    with choose_executor(1, threads).start() as pool:
        start = time.perf_counter()
        errors, steps = zip(*pool.map(run_block, blocks), strict=True)
        seconds = time.perf_counter() - start
    return seconds, max(errors), sum(steps) // e.size


def core_tolerance(cores: Sequence[str], e: np.ndarray) -> float:
    """The largest tolerance at which all cores are accurate to MAX_ERROR."""
    return next(rtol for rtol in TOLERANCES if all(run_core(e, rtol, core)[1] <= MAX_ERROR for core in cores))


def solve_ivp_restitution(model: ForceModel, e: float, rtol: float) -> float:
    """The delivered restitution of one impact, as a user of scipy would compute it: two phases, scaled units."""
    n = model.exponent or 1.5
    chi = float(np.asarray(model.coefficients["chi"](e))) if "chi" in model.coefficients else 0.0

    def approach(_: float, y: list[float]) -> tuple[float, float]:
        x = y[0]
        return y[1], -(x**n if x > 0.0 else 0.0) * (1.0 + chi * y[1])

    def zero_velocity(_: float, y: list[float]) -> float:
        return y[1]

    zero_velocity.terminal, zero_velocity.direction = True, -1  # type: ignore[attr-defined]
    first = solve_ivp(approach, (0.0, 1e3), (0.0, 1.0), rtol=rtol, atol=rtol, events=zero_velocity)
    peak = first.y[0, -1]
    residual, stiffness = 0.0, 1.0
    if model.unloading is not None:
        residual, stiffness = peak * (1.0 - e * e), e ** (-2.0 * n)

    def restitution(_: float, y: list[float]) -> tuple[float, float]:
        x = y[0] - residual
        return y[1], -stiffness * (x**n if x > 0.0 else 0.0) * (1.0 + chi * y[1])

    def zero_indentation(_: float, y: list[float]) -> float:
        return y[0] - residual

    zero_indentation.terminal, zero_indentation.direction = True, -1  # type: ignore[attr-defined]
    second = solve_ivp(restitution, (0.0, 1e3), (peak, 0.0), rtol=rtol, atol=rtol, events=zero_indentation)
    return -second.y[1, -1]


def run_loop(e: np.ndarray, rtol: float) -> tuple[float, float]:
    """Seconds and largest error of the loop of solve_ivp."""
    models = [impact.models()[key] for key in PAPER_MODELS]
    largest, start = 0.0, time.perf_counter()
    for k, requested in enumerate(e.tolist()):
        model = models[k % len(models)]
        exact = requested
        if "chi" in model.coefficients:
            exact = float(delivered_restitution(float(np.asarray(model.coefficients["chi"](requested)))))
        elif model.key == "hertz":
            exact = 1.0
        largest = max(largest, abs(solve_ivp_restitution(model, requested, rtol) - exact))
    return time.perf_counter() - start, largest


def speedup(rates: Sequence[float], single: Sequence[float]) -> tuple[str, str]:
    """The speedup over one thread: the median over the rounds, and the best rate over the best rate."""
    ratio = median(rate / reference for rate, reference in zip(rates, single, strict=True))
    return f"{ratio:.2f}", f"{max(rates) / max(single):.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--impacts", type=int, default=2_000_000, help="impacts of the compiled core")
    parser.add_argument("--loop", type=int, default=300, help="impacts of the loop")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--threads", type=int, default=2, help="threads of the compiled core")
    args = parser.parse_args()
    cores = ["numpy", "numba"] if is_installed() else ["numpy"]
    # about a second for each core: in a shorter run the last blocks, when some threads are idle, would count
    e = {"numpy": restitutions(args.impacts // 5), "numba": restitutions(args.impacts)}
    loop_e = restitutions(args.loop)
    rtol = core_tolerance(cores, loop_e)
    loop_rtol = next(rtol for rtol in TOLERANCES if run_loop(loop_e, rtol)[1] <= MAX_ERROR)

    engines = [("numpy", 1)]
    if "numba" in cores:
        engines += [("numba", threads) for threads in sorted({1, args.threads})]
    loop_rates: list[float] = []
    rates: dict[tuple[str, int], list[float]] = {engine: [] for engine in engines}
    accuracy: dict[tuple[str, int], tuple[float, int]] = {}
    for round_number in range(args.rounds):
        seconds, loop_error = run_loop(loop_e, loop_rtol)
        loop_rates.append(args.loop / seconds)
        # alternate the order: an engine finds the caches and the memory in the state left by the engine before it
        for core, threads in engines[:: -1 if round_number % 2 else 1]:
            seconds, error, steps = run_core(e[core], rtol, core, threads)
            rates[core, threads].append(e[core].size / seconds)
            accuracy[core, threads] = error, steps

    head = ("engine", "threads", "rtol", "largest error", "steps", "impacts/s")
    table = Table(*head, "ratio", "min", "max", "speedup", "best", box=None)
    loop_row = ("solve_ivp RK45, loop", "1", f"{loop_rtol:g}", f"{loop_error:.2g}", "")
    table.add_row(*loop_row, f"{median(loop_rates):,.0f}", "1")
    for core, threads in engines:
        error, steps = accuracy[core, threads]
        if error > MAX_ERROR:
            raise SystemExit(f"{core}: got an error of {error:.2g}, expected at most {MAX_ERROR:g}")
        core_rates = rates[core, threads]
        ratios = [rate / loop_rate for rate, loop_rate in zip(core_rates, loop_rates, strict=True)]
        table.add_row(
            f"impact, {core}",
            str(threads),
            f"{rtol:g}",
            f"{error:.2g}",
            str(steps),
            f"{median(core_rates):,.0f}",
            *(f"{ratio:,.0f}" for ratio in (median(ratios), min(ratios), max(ratios))),
            *speedup(core_rates, rates[core, 1]),
        )
    sizes = f"{args.impacts:,} impacts (numpy: a fifth, loop: {args.loop}), {args.rounds} rounds"
    title = f"{len(PAPER_MODELS)} models, {sizes}, {os.cpu_count()} cores"
    Console(width=140).print(title, table, sep="\n")


if __name__ == "__main__":
    main()
