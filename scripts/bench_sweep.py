"""What does a sweep cost over what writing its result costs, and how much memory does it take?

A sweep e x v1 x m1 x m2 x material of two models, as a user runs it, in a process of its own from the command to
its end; beside it a script that has the same arrays in memory, writes them with h5py, takes their SHA-256 and has
them synced to the disk, of which that alone is timed. Both write into one folder, in turn; printed is the ratio.

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
FOUR = '[output]\nvariables = ["v1_post", "v2_post", "e_out", "status"]\n'
# the lengths of e, v1, m1 and m2 by the number of points: of two models and two materials
GRIDS = {1e6: (50, 20, 25, 10), 1e7: (100, 50, 25, 20), 1e8: (100, 100, 50, 50)}

# what is timed beside: nothing but storing
WRITER = """
import hashlib, os, sys, time
import h5py
with h5py.File(sys.argv[1]) as file:
    arrays = {name: one[()] for name, one in file.items()}
begun = time.perf_counter()
with h5py.File(sys.argv[2], "w") as file:
    for name, values in arrays.items():
        file[name] = values
        if values.dtype.kind in "fi":
            hashlib.sha256(values)
descriptor = os.open(sys.argv[2], os.O_RDONLY)
os.fsync(descriptor)
print(time.perf_counter() - begun)
"""


def sweep(folder: Path, points: float, more: str = "") -> tuple[float, int]:
    """Seconds and largest memory [bytes] of `impact sweep`."""
    config = folder / "sweep.toml"
    lengths = dict(zip(("e", "v1", "m1", "m2"), GRIDS[points], strict=True))
    config.write_text(CONFIG.format(**lengths) + more, encoding="utf-8")
    words = [
        sys.executable,
        "-m",
        "impact",
        "sweep",
        str(config),
        "-o",
        str(folder / "sweep.h5"),
        "--overwrite",
        "-q",
    ]
    begun = time.perf_counter()
    process = os.posix_spawn(sys.executable, words, os.environ)
    _, status, usage = os.wait4(process, 0)
    if status:
        raise SystemExit(f"the sweep ended with {os.waitstatus_to_exitcode(status)}")
    return time.perf_counter() - begun, usage.ru_maxrss * 1024


def written(folder: Path) -> float:
    """Seconds of writing the same arrays."""
    words = [sys.executable, "-c", WRITER, str(folder / "sweep.h5"), str(folder / "beside.h5")]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    (folder / "beside.h5").unlink()
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path(), help="on the disk to be written to")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--points", type=float, default=1e7, choices=GRIDS)
    parser.add_argument("--memory", type=float, nargs="*", default=list(GRIDS), choices=GRIDS)
    asked = parser.parse_args()
    out = Console()
    with tempfile.TemporaryDirectory(dir=asked.folder) as name:
        folder = Path(name)
        for title, more in (("all variables", ""), ("four variables", FOUR)):
            pairs = [(sweep(folder, asked.points, more)[0], written(folder)) for _ in range(asked.repeats)]
            table = Table("", "seconds", "median", "ratio", box=None)
            ours, theirs = (statistics.median(one) for one in zip(*pairs, strict=True))
            for label, place, ratio in (("written with h5py", 1, 1.0), ("impact sweep", 0, ours / theirs)):
                each = ", ".join(f"{pair[place]:.2f}" for pair in pairs)
                table.add_row(label, each, f"{(theirs, ours)[place == 0]:.2f}", f"{ratio:.2f}")
            size = (folder / "sweep.h5").stat().st_size
            out.print(
                f"{asked.points:,.0f} points, {title}, {size:,} bytes, {os.cpu_count()} cores", table, sep="\n"
            )
        memory = Table("points", "seconds", "peak memory [MB]", "over the first", box=None)
        first = 0
        for points in asked.memory:
            seconds, peak = sweep(folder, points, FOUR)
            first = first or peak
            memory.add_row(f"{points:,.0f}", f"{seconds:.1f}", f"{peak / 1e6:.1f}", f"{peak / first:.3f}")
        if asked.memory:
            out.print("peak memory, four variables", memory, sep="\n")


if __name__ == "__main__":
    main()
