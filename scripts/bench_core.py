"""Throughput of the integration cores, compared with a loop of scipy's solve_ivp at the same accuracy.

Ten models of the paper share the impacts, with e from 0.05 to 0.99. All impacts are distinct, deduplication is
off, and all outputs are computed. Each engine uses the largest tolerance of a list with max |e_out - exact| <=
1e-8. The engines run in turn for several rounds, because the load of a shared machine varies. The table shows the
median rates, the median ratio to the loop with its minimum and maximum, and the speedup by several threads: the
median over the rounds, and the best rate divided by the best rate of one thread.

The same for oblique impacts by pairs of a contact force and a friction law, all distinct: the rate of tangential
trajectories next to that of the normal ones of the same impacts, and to a loop of solve_ivp with events. Each
engine has 99 % of beta within 1e-8 of a solution at rtol 1e-12. Then the trajectories, seconds and bytes of sweeps
of angle, friction, spin and speed.

    python scripts/bench_core.py [--impacts 2000000] [--loop 300] [--rounds 15] [--threads 2] [--oblique-only]
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

import impact
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.dimensionless import with_coefficients, with_units
from impact.contact.friction import Pair
from impact.contact.frictions import find_friction
from impact.contact.impacts import Impacts
from impact.contact.model import ForceModel
from impact.contact.numba.dispatch import is_installed
from impact.contact.output_formulas import collide
from impact.contact.simulate import simulate
from impact.contact.tangential import (
    LIMIT_POSITIVE,
    SLIP,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
    simulate_friction,
)
from impact.contact.variables import CENTRAL_OUTPUTS
from impact.engine.executors import choose_executor
from impact.engine.trajectories import RANGE_TRAJECTORIES, even_size
from ratios import record

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


# ---- oblique impacts


@dataclass(frozen=True)
class ObliquePair:
    """A contact force F = x^n + C x^q v with a tangential spring without dashpot, in the contact's own units."""

    model: str
    friction: str
    stiffness: float

    @property
    def laws(self) -> Pair:
        return Pair(impact.models()[self.model], find_friction(self.friction))


# kappa' of glass on glass for solid spheres: (3/2)(1 - nu)/(1 - nu/2) 7/2 with nu = 0.22, and k_t/k_n = 2/7
OBLIQUE_PAIRS = (
    ObliquePair("tsuji-1992", "lammps-mindlin-rescale-force", 4.6),
    ObliquePair("lammps-coeff-restitution-hooke", "lammps-linear-history", 1.0),
)
# 99 % of the impacts are as accurate: of a spring whose slip ends nearly where it begins, the end is sensitive
ACCURATE_SHARE, REFERENCE_RTOL = 0.99, 1e-12


def oblique_values(pair: ObliquePair, count: int) -> dict[str, np.ndarray]:
    """The values of impacts, all with another e, and with scaled slips from sticking to sliding in mixed order."""
    model = pair.laws.model
    one = np.ones(count)
    values = {
        "e": np.linspace(0.5, 0.99, count),
        "n": (model.exponent or 1.5) * one,
        "K": one,
        "m": one,
        "v0": one,
    }
    return values | {
        # the golden ratio spreads them evenly
        SLIP: 0.1 + 5.9 * np.modf(np.arange(count) * 0.6180339887498949)[0],
        TANGENTIAL_STIFFNESS: pair.stiffness * one,
        TANGENTIAL_DAMPING: 0.0 * one,
        LIMIT_POSITIVE: 0.0 * one,
    }


def run_oblique(
    pair: ObliquePair, values: Mapping[str, np.ndarray], rtol: float
) -> tuple[float, float, np.ndarray]:
    """Seconds of the normal and of the tangential trajectories of impacts, in blocks as in a sweep, and beta."""
    count = values["e"].size
    size = even_size(count, RANGE_TRAJECTORIES)
    normal, tangential, beta = 0.0, 0.0, np.empty(count)
    options = {"rtol": rtol, "max_steps": 10_000, "collapse": False, "core": "numpy"}
    for start in range(0, count, size):
        block = {name: array[start : start + size] for name, array in values.items()}
        status = np.ones(block["e"].size, np.int8)
        begun = time.perf_counter()
        simulate(pair.laws.model, block["n"], block, status, **options)
        between = time.perf_counter()
        result = simulate_friction(pair.laws, block["n"], block, status, **options)
        normal, tangential = normal + between - begun, tangential + time.perf_counter() - between
        beta[start : start + size] = -result.slip / block[SLIP]
    return normal, tangential, beta


def terminal(event: Callable[[float, Sequence[float]], float]) -> Callable[[float, Sequence[float]], float]:
    """Make a falling event that ends a call of solve_ivp."""
    event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    return event


def solve_ivp_beta(laws: Pair, values: Mapping[str, float], damping: float, rtol: float) -> float:
    """The tangential restitution of one impact, as a user of scipy would compute it: parts between events."""
    n, form = values["n"], laws.form(values["n"])
    kp, q = form.stiffness_power, (n - 1.0) / 2.0
    kappa, G0 = values[TANGENTIAL_STIFFNESS], values[SLIP]
    # direction of the slip, 0 while the contact sticks; sign of the normal force; whether it unloads
    mode, side, unloads = 0, 1.0, 0

    def normal(y: Sequence[float]) -> tuple[float, float]:
        """F and its rate."""
        x, v = max(y[0], 1e-300), y[1]
        force = x**n + damping * x**q * v
        return force, n * x ** (n - 1.0) * v + damping * (q * x ** (q - 1.0) * v * v - x**q * force)

    def friction(y: Sequence[float]) -> tuple[float, float]:
        """The friction force, and the rate that it has, or would have, while the contact sticks."""
        x, r = max(y[0], 1e-300), form.memory[unloads]
        force = mode * side * normal(y)[0] if mode else y[3] * x ** (r * kp)
        return force, kappa * x**kp * y[2] + r * kp * y[1] / x * force

    def motion(_: float, y: Sequence[float]) -> tuple[float, float, float, float]:
        stretch = 0.0 if mode else kappa * max(y[0], 0.0) ** (kp * (1.0 - form.memory[unloads])) * y[2]
        return y[1], -normal(y)[0], -friction(y)[0], stretch

    limit = terminal(lambda _, y: side * normal(y)[0] - abs(friction(y)[0]))
    stick = terminal(lambda _, y: mode * friction(y)[1] - side * normal(y)[1])
    peak, parting = terminal(lambda _, y: y[1]), terminal(lambda _, y: y[0])
    tension = terminal(lambda _, y: normal(y)[0])
    y = [0.0, 1.0, G0, 0.0]
    while True:
        end = [parting, *([tension] if side > 0.0 else [])] if unloads else [peak]
        events = [stick if mode else limit, *end]
        part = solve_ivp(motion, (0.0, 1e3), y, "DOP853", rtol=rtol, atol=rtol, events=events)
        y, ended = part.y[:, -1].tolist(), next(k for k, times in enumerate(part.t_events) if times.size)
        force = friction(y)[0]
        if events[ended] is parting:
            return -y[2] / G0
        if events[ended] is limit:
            mode = 1 if force > 0.0 else -1
        elif events[ended] is stick:
            mode, y[3] = 0, force / y[0] ** (form.memory[unloads] * kp)
        elif events[ended] is peak:
            unloads, y[3] = 1, y[3] * y[0] ** (kp * (form.memory[0] - form.memory[1]))
        else:
            # neither a limit nor a force: friction slips on if it would grow faster than the limit
            side, mode, y[3] = -1.0, 0, 0.0
            rate = friction(y)[1]
            mode = int(np.sign(rate)) if abs(rate) > -normal(y)[1] else 0


def loop_oblique(pair: ObliquePair, values: Mapping[str, np.ndarray], rtol: float) -> tuple[float, np.ndarray]:
    """Seconds of the loop of solve_ivp with events over impacts, and beta."""
    laws, count = pair.laws, values["e"].size
    damping = np.asarray(with_coefficients(laws.model, with_units(values, values["n"][0]), count)["c"]).tolist()
    rows = [
        dict(zip(values, row, strict=True)) for row in zip(*map(np.ndarray.tolist, values.values()), strict=True)
    ]
    start = time.perf_counter()
    beta = [solve_ivp_beta(laws, row, c, rtol) for row, c in zip(rows, damping, strict=True)]
    return time.perf_counter() - start, np.array(beta)


def oblique_error(beta: np.ndarray, exact: np.ndarray) -> float:
    """The error that the accurate share of the impacts does not exceed."""
    return float(np.quantile(np.abs(beta - exact), ACCURATE_SHARE))


def oblique_tolerance(solve: Callable[[float], np.ndarray], exact: np.ndarray) -> tuple[float, float]:
    """The largest tolerance at which a solver of beta is accurate, and its error."""
    for rtol in TOLERANCES:
        error = oblique_error(solve(rtol), exact)
        if error <= MAX_ERROR:
            return rtol, error
    raise SystemExit(f"got an error of {error:.2g} at {rtol:g}, expected at most {MAX_ERROR:g}")


def add_oblique_rates(table: Table, pair: ObliquePair, count: int, loop: int, rounds: int) -> None:
    """Measure the rates of tangential trajectories, of the normal ones and of the loop."""
    few, many = oblique_values(pair, loop), oblique_values(pair, count)
    exact = run_oblique(pair, few, REFERENCE_RTOL)[2]
    rtol, error = oblique_tolerance(lambda rtol: run_oblique(pair, few, rtol)[2], exact)
    loop_rtol, loop_error = oblique_tolerance(lambda rtol: loop_oblique(pair, few, rtol)[1], exact)
    rates: list[tuple[float, float, float]] = []
    for _ in range(rounds):
        seconds, _ = loop_oblique(pair, few, loop_rtol)
        normal, tangential, _ = run_oblique(pair, many, rtol)
        rates.append((count / normal, count / tangential, loop / seconds))
    normal_rate, tangential_rate, loop_rate = (median(column) for column in zip(*rates, strict=True))
    to_normal, to_loop = ([rate[1] / rate[other] for rate in rates] for other in (0, 2))
    name = f"{pair.model} with {pair.friction}"
    record(f"slips per normal trajectory: {name}", to_normal)
    record(f"slips per loop of solve_ivp: {name}", to_loop)
    table.add_row(name, "solve_ivp DOP853, loop", f"{loop_rtol:g}", f"{loop_error:.2g}", f"{loop_rate:,.0f}")
    table.add_row("", "impact, numpy, normal", f"{rtol:g}", "", f"{normal_rate:,.0f}")
    table.add_row(
        "",
        "impact, numpy",
        f"{rtol:g}",
        f"{error:.2g}",
        f"{tangential_rate:,.0f}",
        *(f"{ratio:.3f}" for ratio in (median(to_normal), min(to_normal), max(to_normal))),
        *(f"{ratio:,.0f}" for ratio in (median(to_loop), min(to_loop), max(to_loop))),
    )


def oblique_sweeps() -> Iterator[tuple[str, dict[str, object]]]:
    """Sweeps of oblique impacts over one normal law, by what they show."""
    springs = ("lammps-mindlin", "lammps-mindlin-force", "lammps-mindlin-rescale-force")
    balls = {"e": 0.8, "m1": 0.1, "m2": 0.1, "R1": 0.01, "R2": 0.01, "K": 1e8}
    angle = {"linspace": ["1 deg", "85 deg", 85]}
    mu = {"linspace": [0.05, 0.5, 10]}
    spins = {"omega1": {"linspace": ["0 rad/s", "400 rad/s", 5]}}

    def source(springs: Sequence[str], **axes: object) -> dict[str, object]:
        return {
            "models": ["tsuji-1992"],
            "frictions": ["coulomb-1785", *springs],
            "sweep": {**balls, **axes},
            "friction": {key: {"xt": 0.0, "kt_over_kn": 0.8} for key in springs},
        }

    yield "85 angles x 10 mu x 5 spins, 4 friction laws", source(springs, v1=1.0, angle=angle, mu=mu, **spins)
    hundred = {"linspace": ["1 deg", "85 deg", 100]}
    speeds = {"linspace": [1.0, 3.0, 1000]}
    yield "1000 speeds x 100 angles x 10 mu, 2 friction laws", source(springs[2:], v1=speeds, angle=hundred, mu=mu)


def oblique_costs() -> Table:
    """Count the points and trajectories of sweeps; measure their seconds and bytes in both layouts."""
    head = ("sweep", "points", "normal", "tangential", "full (s)", "bytes", "factored (s)", "bytes")
    table = Table(*head, box=None)
    for name, source in oblique_sweeps():
        counts = impact.estimate(source).models
        tangential = sum(law.trajectories for law in counts[1:])
        row = [name, f"{counts[0].points:,}", str(counts[0].trajectories), f"{tangential:,}"]
        with tempfile.TemporaryDirectory() as folder:
            for layout in ("full", "factored"):
                start, output = time.perf_counter(), Path(folder) / f"{layout}.h5"
                impact.sweep_to_file(source, output, overrides=[f'output.layout="{layout}"'])
                row += [f"{time.perf_counter() - start:.2f}", f"{output.stat().st_size:,}"]
        table.add_row(*row)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--impacts", type=int, default=2_000_000, help="impacts of the compiled core")
    parser.add_argument("--loop", type=int, default=300, help="impacts of the loop")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--threads", type=int, default=2, help="threads of the compiled core")
    parser.add_argument("--oblique-only", action="store_true", help="measure only the oblique impacts")
    args = parser.parse_args()
    if not args.oblique_only:
        central_rates(args)
    # whole blocks, as nearly all of a long sweep are
    blocks = max(args.impacts // (60 * RANGE_TRAJECTORIES), 1)
    count, loop, rounds = blocks * RANGE_TRAJECTORIES, max(args.loop // 3, 1), max(args.rounds // 3, 1)
    title = f"oblique: {count:,} impacts, loop: {loop}, {rounds} rounds, {os.cpu_count()} cores"
    head = ("pair", "engine", "rtol", "error of beta", "trajectories/s", "per normal", "min", "max")
    rates = Table(*head, "per loop", "min", "max", box=None)
    for pair in OBLIQUE_PAIRS:
        add_oblique_rates(rates, pair, count, loop, rounds)
    Console(width=180).print(title, rates, oblique_costs(), sep="\n\n")


def central_rates(args: argparse.Namespace) -> None:
    """Measure and print the rates of central impacts."""
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
        record(f"impacts per loop of solve_ivp: {core}, {threads} threads", ratios)
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
