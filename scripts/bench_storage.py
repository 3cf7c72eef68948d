"""Time and memory to store a sweep in full, compared with a plain write of the same number of bytes.

One model over two axes that it does not depend on, so that nearly all of the time is spent in storing points. The
table shows seconds and peak memory of a plain h5py write, slab by slab, with SHA-256 and fsync; of `impact sweep`
in layout full; and, with `--against`, of the same by another source tree. They run in turn; the best of the
repeats counts. Then the same sweep in layout factored, the sizes of both files, and the time to read one slice of
each.

    python scripts/bench_storage.py [--points 1e7] [--repeat 3] [--against OTHER/src]
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np
from rich.console import Console
from rich.table import Table

import impact

VARIABLES = ("v1_post", "v2_post", "e_out", "peak_indentation")
SLAB = 2**17
CONFIG = """
title = "storage"
models = ["lankarani-nikravesh-1990"]
[sweep]
e = {{ linspace = [0.05, 1.0, 100] }}
v1 = {{ linspace = [0.1, 10.0, {speeds}] }}
m1 = {{ geomspace = [0.01, 10.0, 100] }}
m2 = 1.0
K = 1e9
[output]
variables = {variables}
"""


def write_plain(path: Path, points: int) -> None:
    """Write as many bytes as the sweep, with the same checksum and fsync."""
    values = np.random.default_rng(0).random(SLAB)
    with h5py.File(path, "w") as file:
        for name in VARIABLES:
            dataset = file.create_dataset(name, (points,), "f8")
            for start in range(0, points, SLAB):
                dataset[start : start + SLAB] = values[: points - start]
        status = file.create_dataset("status", (points,), "i1")
        for start in range(0, points, SLAB):
            status[start : start + SLAB] = np.ones(min(SLAB, points - start), "i1")
    with path.open("rb") as stream:
        hashlib.file_digest(stream, "sha256")
        os.fsync(stream.fileno())


def run_python(arguments: list[str], source: Path | None = None) -> tuple[float, float]:
    """Seconds and peak memory [MB] of a Python process; `source` is the src folder of another version."""
    environment = {**os.environ, **({"PYTHONPATH": str(source)} if source else {})}
    start = time.perf_counter()
    child = subprocess.Popen([sys.executable, *arguments], env=environment)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"{' '.join(arguments)}: exit {child.returncode}")
    return time.perf_counter() - start, usage.ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=float, default=1e7)
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--against", type=Path, help="the src folder of another version")
    parser.add_argument("--plain", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    points = int(options.points)
    if options.plain:
        write_plain(options.plain, points)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        config = folder / "config.toml"
        config.write_text(CONFIG.format(speeds=points // 10_000, variables=list(VARIABLES)).replace("'", '"'))
        full, factored, other = folder / "full.h5", folder / "factored.h5", folder / "other.h5"
        sweep = ["-m", "impact", "sweep", str(config), "--quiet", "--overwrite", "-o"]
        commands: dict[str, tuple[list[str], Path | None]] = {
            "plain h5py write, SHA-256, fsync": (
                [__file__, "--points", str(points), "--plain", str(folder / "plain.h5")],
                None,
            ),
            "impact sweep, layout full": ([*sweep, str(full), "--set", 'output.layout="full"'], None),
        }
        if options.against:
            commands["the same, other version"] = ([*sweep, str(other)], options.against)
        best: dict[str, tuple[float, float]] = {}
        for _ in range(options.repeat):
            for label, (arguments, source) in commands.items():
                cost = run_python(arguments, source)
                best[label] = min(best.get(label, cost), cost)
        best["impact sweep, layout factored"] = run_python(
            [*sweep, str(factored), "--set", 'output.layout="factored"']
        )
        first = next(iter(best.values()))[0]
        rows = Table(
            "", "seconds", "ratio", "peak memory (MB)", title=f"{points:,} points, {len(VARIABLES)} variables"
        )
        for label, (seconds, memory) in best.items():
            rows.add_row(label, f"{seconds:.2f}", f"{seconds / first:.2f}", f"{memory:.0f}")
        out = Console()
        out.print(rows)
        for path in (full, factored):
            start = time.perf_counter()
            result = impact.load(path)
            opened = time.perf_counter()
            result["v1_post"].isel(v1=0, m1=0).load()
            slice_ms = 1e3 * (time.perf_counter() - opened)
            size = f"{path.stem}: {path.stat().st_size:,} bytes"
            out.print(f"{size}, opened in {opened - start:.2f} s, a slice over e read in {slice_ms:.1f} ms")
            result.close()
    out.print(f"peak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0:.0f} MB")


if __name__ == "__main__":
    main()
