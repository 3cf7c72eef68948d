"""How long does a command take that has little to do, against the libraries that it cannot do without?

`impact --help` beside a bare typer program, and the sweep of Figure 6 beside the import of its libraries: whole
processes, in turn, in one run; printed are medians and their ratios.

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

BARE = """
import typer
app = typer.Typer()
@app.command()
def hello(name: str = "you"):
    "Greet somebody."
app()
"""
LIBRARIES = "import xarray, h5netcdf, pydantic, typer, rich"
FIGURE6 = Path(__file__).parents[1] / "configs" / "figure6.toml"


def seconds(words: list[str]) -> float:
    """The time of a process."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, *words], check=True, capture_output=True)
    return time.perf_counter() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    repeats = parser.parse_args().repeats
    with tempfile.TemporaryDirectory() as folder:
        sweep = ["-m", "impact", "sweep", str(FIGURE6), "-o", f"{folder}/figure6.h5", "--overwrite", "-q"]
        pairs = {
            "impact --help": (["-m", "impact", "--help"], ["-c", BARE, "--help"], "a bare typer program"),
            "impact sweep configs/figure6.toml": (sweep, ["-c", LIBRARIES], "the import of its libraries"),
        }
        table = Table("command", "median [s]", "beside", "median [s]", "ratio", box=None)
        for name, (ours, theirs, beside) in pairs.items():
            for words in (ours, theirs):
                seconds(words)
            times = [(seconds(ours), seconds(theirs)) for _ in range(repeats)]
            a, b = (statistics.median(one) for one in zip(*times, strict=True))
            table.add_row(name, f"{a:.3f}", beside, f"{b:.3f}", f"{a / b:.2f}")
    Console().print(f"{repeats} times each, {os.cpu_count()} cores", table, sep="\n")


if __name__ == "__main__":
    main()
