"""Run time of short commands, compared with the start of the libraries that they need.

`impact --help` is compared with a minimal typer program, and the sweep of Figure 6, its pictures and
`impact info` with the import of their libraries: a process that imports each module of another package that the
command imports, and does nothing else. The same sweep is timed with each core, and with the compiled core before
and after its code is cached. All times are of whole processes; the pairs run in turn. The tables show medians and
their ratios.

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
from ratios import record

TYPER_PROGRAM = """
import typer
app = typer.Typer()
@app.command()
def hello(name: str = "you"):
    "Greet somebody."
app()
"""
# prints the modules that a command of impact imports, without its own
IMPORTED = """
import atexit, sys
atexit.register(lambda: print(*(name for name in sys.modules if not name.startswith(("impact", "__")))))
from impact.cli.main import main
main()
"""
FIGURE6 = Path(__file__).parents[1] / "configs" / "figure6.toml"


def run_time(arguments: list[str], **environment: str) -> float:
    """Seconds of a Python process with these arguments; its modules are compiled before, as in an installation."""
    environment = {**os.environ, **environment}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    start = time.perf_counter()
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True, env=environment)
    return time.perf_counter() - start


def import_of_libraries(command: list[str]) -> list[str]:
    """Arguments of a Python process that imports what a command of impact imports, without its own modules."""
    probe = [sys.executable, "-c", IMPORTED, *command]
    output = subprocess.run(probe, check=True, capture_output=True, text=True).stdout
    modules = output.splitlines()[-1].split()
    return ["-c", f"from importlib import import_module\nfor name in {modules!r}:\n    import_module(name)"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as folder:
        result = f"{folder}/figure6.h5"
        sweep = ["sweep", str(FIGURE6), "-o", result, "--overwrite", "-q"]
        run_time(["-m", "impact", *sweep])
        commands = {"sweep configs/figure6.toml": sweep, "info": ["info", result]}
        for kind in ("final-velocities", "error", "loop", "history"):
            picture = f"{folder}/{kind}.png"
            commands[f"plot --kind {kind}"] = ["plot", result, "-k", kind, "-o", picture, "--overwrite"]
        minimal = ["-c", TYPER_PROGRAM, "--help"]
        pairs = {"--help": (["-m", "impact", "--help"], minimal, "minimal typer program")}
        for name, arguments in commands.items():
            pairs[name] = (["-m", "impact", *arguments], import_of_libraries(arguments), "import of its libraries")
        table = Table("command", "median (s)", "compared with", "median (s)", "ratio", box=None)
        for name, (command, reference, reference_name) in pairs.items():
            for arguments in (command, reference):
                run_time(arguments)
            times = [(run_time(command), run_time(reference)) for _ in range(repeats)]
            record(f"seconds of impact {name} per {reference_name}", [mine / other for mine, other in times])
            ours, theirs = (statistics.median(seconds) for seconds in zip(*times, strict=True))
            table.add_row(f"impact {name}", f"{ours:.3f}", reference_name, f"{theirs:.3f}", f"{ours / theirs:.2f}")

        cores = Table("core of the sweep", "median (s)", box=None)

        def add_core(name: str, core: str, count: int, **environment: str) -> None:
            command = ["-m", "impact", *sweep, "--set", f'solver.core="{core}"']
            times = [run_time(command, **environment) for _ in range(count)]
            cores.add_row(name, f"{statistics.median(times):.2f}")

        add_core("numpy", "numpy", repeats)
        if is_installed():
            add_core("numba, compiled in the run", "numba", 1, NUMBA_CACHE_DIR=folder)
            add_core("numba, cached", "numba", repeats, NUMBA_CACHE_DIR=folder)
    Console().print(f"{repeats} repeats, {os.cpu_count()} cores", table, cores, sep="\n")


if __name__ == "__main__":
    main()
