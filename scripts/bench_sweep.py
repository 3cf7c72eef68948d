"""Run time and memory of a sweep, compared with writing its result.

A sweep over e, v1, m1, m2 and material with two models runs as a command in its own process. The reference is a
script that has the same arrays in memory, writes them with h5py, computes their SHA-256 and calls fsync; only
these are timed. Both write to the same folder in turn. The first tables show seconds and their ratio, the last one
the peak memory over the number of points.

    python scripts/bench_sweep.py [--folder .] [--repeats 3] [--points 1e7] [--memory 1e6 1e7 1e8]
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

CONFIG = """
models = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
[sweep]
e = {{ linspace = [0.01, 1.0, {e}] }}
v1 = {{ linspace = [0.1, 2.0, {v1}] }}
m1 = {{ geomspace = [0.1, 10.0, {m1}] }}
m2 = {{ geomspace = [0.1, 10.0, {m2}] }}
material = ["aluminium", "steel"]
[materials.aluminium]
E = "56 GPa"
nu = 0.3
rho = 2712
[materials.steel]
E = "210 GPa"
nu = 0.3
rho = 7850
"""
FOUR_VARIABLES = '[output]\nvariables = ["v1_post", "v2_post", "e_out", "status"]\n'
# lengths of e, v1, m1 and m2 by the number of points, with two models and two materials
GRIDS = {1e6: (50, 20, 25, 10), 1e7: (100, 50, 25, 20), 1e8: (100, 100, 50, 50)}

# the reference: only the storing is timed
WRITER = """
import hashlib, os, sys, time
import h5py
with h5py.File(sys.argv[1]) as file:
    arrays = {name: variable[()] for name, variable in file.items()}
start = time.perf_counter()
with h5py.File(sys.argv[2], "w") as file:
    for name, values in arrays.items():
        file[name] = values
        if values.dtype.kind in "fi":
            hashlib.sha256(values)
descriptor = os.open(sys.argv[2], os.O_RDONLY)
os.fsync(descriptor)
print(time.perf_counter() - start)
"""


def run_sweep(folder: Path, points: float, output: str = "") -> tuple[float, int]:
    """Seconds and peak memory [bytes] of `impact sweep`; `output` is the [output] table of the config."""
    config = folder / "sweep.toml"
    lengths = dict(zip(("e", "v1", "m1", "m2"), GRIDS[points], strict=True))
    config.write_text(CONFIG.format(**lengths) + output, encoding="utf-8")
    arguments = ["-m", "impact", "sweep", str(config), "-o", str(folder / "sweep.h5"), "--overwrite", "-q"]
    start = time.perf_counter()
    process = os.posix_spawn(sys.executable, [sys.executable, *arguments], os.environ)
    _, status, usage = os.wait4(process, 0)
    if status:
        raise SystemExit(f"impact sweep: got exit code {os.waitstatus_to_exitcode(status)}, expected 0")
    return time.perf_counter() - start, usage.ru_maxrss * 1024


def write_reference(folder: Path) -> float:
    """Seconds to write the same arrays with h5py."""
    command = [sys.executable, "-c", WRITER, str(folder / "sweep.h5"), str(folder / "reference.h5")]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    (folder / "reference.h5").unlink()
    return float(output)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path(), help="a folder on the disk to write to")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--points", type=float, default=1e7, choices=GRIDS)
    parser.add_argument("--memory", type=float, nargs="*", default=list(GRIDS), choices=GRIDS)
    args = parser.parse_args()
    console = Console()
    with tempfile.TemporaryDirectory(dir=args.folder) as name:
        folder = Path(name)
        for title, output in (("all variables", ""), ("four variables", FOUR_VARIABLES)):
            pairs = [
                (run_sweep(folder, args.points, output)[0], write_reference(folder)) for _ in range(args.repeats)
            ]
            table = Table("", "seconds", "median", "ratio", box=None)
            sweep, reference = zip(*pairs, strict=True)
            for label, seconds in (("written with h5py", reference), ("impact sweep", sweep)):
                middle = statistics.median(seconds)
                ratio = middle / statistics.median(reference)
                table.add_row(label, ", ".join(f"{s:.2f}" for s in seconds), f"{middle:.2f}", f"{ratio:.2f}")
            size = (folder / "sweep.h5").stat().st_size
            summary = f"{args.points:,.0f} points, {title}, {size:,} bytes, {os.cpu_count()} cores"
            console.print(summary, table, sep="\n")
        memory = Table("points", "seconds", "peak memory (MB)", "ratio to the first", box=None)
        first = 0
        for points in args.memory:
            seconds, peak = run_sweep(folder, points, FOUR_VARIABLES)
            first = first or peak
            memory.add_row(f"{points:,.0f}", f"{seconds:.1f}", f"{peak / 1e6:.1f}", f"{peak / first:.3f}")
        if args.memory:
            console.print("peak memory, four variables", memory, sep="\n")


if __name__ == "__main__":
    main()
