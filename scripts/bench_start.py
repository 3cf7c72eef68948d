"""Run time of short commands, compared with the start of the libraries that they need.

`impact --help` is compared with a minimal typer program, and the sweep of Figure 6, its pictures and
`impact info` with the import of their libraries. The same sweep is timed with each core, and with the compiled
core before and after its code is cached. All times are of whole processes; the pairs run in turn. The tables show
medians and their ratios.

    python scripts/bench_start.py [--repeats 15]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from impact.contact.numba.dispatch import is_installed

TYPER_PROGRAM = """
import typer
app = typer.Typer()
@app.command()
def hello(name: str = "you"):
    "Greet somebody."
app()
"""
LIBRARIES = "import xarray, h5netcdf, pydantic, typer, rich"
DRAWING = f"{LIBRARIES}, matplotlib.figure"
FIGURE6 = Path(__file__).parents[1] / "configs" / "figure6.toml"


def run_time(arguments: list[str], **environment: str) -> float:
    """Seconds of a Python process with these arguments; its modules are compiled before, as in an installation."""
    environment = {**os.environ, **environment}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as folder:
        result = f"{folder}/figure6.h5"
        sweep = ["-m", "impact", "sweep", str(FIGURE6), "-o", result, "--overwrite", "-q"]
        run_time(sweep)
        pairs = {
            "impact --help": (
                ["-m", "impact", "--help"],
                ["-c", TYPER_PROGRAM, "--help"],
                "minimal typer program",
            ),
            "impact sweep configs/figure6.toml": (sweep, ["-c", LIBRARIES], "import of its libraries"),
            "impact info": (["-m", "impact", "info", result], ["-c", LIBRARIES], "import of its libraries"),
        }
        for kind in ("final-velocities", "error", "loop", "history"):
            plot = ["-m", "impact", "plot", result, "--kind", kind, "-o", f"{folder}/{kind}.png", "--overwrite"]
            pairs[f"impact plot --kind {kind}"] = (plot, ["-c", DRAWING], "import of its libraries")
        table = Table("command", "median (s)", "compared with", "median (s)", "ratio", box=None)
        for name, (command, reference, reference_name) in pairs.items():
            for arguments in (command, reference):
                run_time(arguments)
            times = [(run_time(command), run_time(reference)) for _ in range(repeats)]
            ours, theirs = (statistics.median(seconds) for seconds in zip(*times, strict=True))
            table.add_row(name, f"{ours:.3f}", reference_name, f"{theirs:.3f}", f"{ours / theirs:.2f}")

        cores = Table("core of the sweep", "median (s)", box=None)

        def add_core(name: str, core: str, count: int, **environment: str) -> None:
            command = [*sweep, "--set", f'solver.core="{core}"']
            times = [run_time(command, **environment) for _ in range(count)]
            cores.add_row(name, f"{statistics.median(times):.2f}")

        add_core("numpy", "numpy", repeats)
        if is_installed():
            add_core("numba, compiled in the run", "numba", 1, NUMBA_CACHE_DIR=folder)
            add_core("numba, cached", "numba", repeats, NUMBA_CACHE_DIR=folder)
    Console().print(f"{repeats} repeats, {os.cpu_count()} cores", table, cores, sep="\n")


if __name__ == "__main__":
    main()
