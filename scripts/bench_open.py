"""Time to open large results, compared with a plain SHA-256 of the same file.

Sweeps a law into factored files in a temporary folder: 100, 4 million and 10^7 distinct trajectories, which many
points share. For each file the table shows the CPU time of a SHA-256, of `impact info`, of `impact.load` and of
`impact expand --sel` with a value that the file does not have, and its ratio to the limit: twice the SHA-256 plus
the same command on the smallest file. They run in turn; the best of the repeats counts, and a command ends after
`--limit` seconds. With `--against`, the commands of another source tree run in the same rounds on the same files.

    python scripts/bench_open.py [--repeat 3] [--limit 60] [--against OTHER/src]
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.console import Console
from rich.table import Table

# values of v1, of the parameter A and of e: each v1 and A is a trajectory, which all values of e share
SIZES = {"small": (10, 10, 20), "4 million": (2_000, 2_000, 20), "10 million": (1_000, 10_000, 300)}
CONFIG = """
title = "open"
models = ["kuwabara-kono-1987"]
[sweep]
e = {{ linspace = [0.01, 1.0, {e}] }}
v1 = {{ linspace = [0.001, 10.0, {v1}] }}
m1 = 1.0
m2 = 1.0
K = 1e9
[model.kuwabara-kono-1987]
A = {{ geomspace = [1e-7, 1e-4, {A}] }}
[output]
layout = "factored"
"""
SHA256 = "import hashlib, sys; hashlib.file_digest(open(sys.argv[1], 'rb'), 'sha256')"
LOAD = "import impact, sys; impact.load(sys.argv[1])"


def cpu_seconds(
    arguments: list[str], source: Path | None = None, expected: int = 0, limit: float = math.inf
) -> float:
    """CPU time of a Python process, infinity above a limit; `source` is the src folder of another version."""
    environment = {**os.environ, **({"PYTHONPATH": str(source)} if source else {})}
    # the shell's `ulimit` counts whole seconds
    shell = ["sh", "-c", f'ulimit -t {limit if limit < math.inf else "unlimited"}; exec "$@"', "sh"]
    child = subprocess.Popen(
        [*shell, sys.executable, *arguments],
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
        return math.inf
    if child.returncode != expected:
        raise SystemExit(f"{' '.join(arguments)}: exit {child.returncode}")
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--limit", type=int, default=60, help="CPU seconds after which a command is ended")
    parser.add_argument("--against", type=Path, help="the src folder of another version")
    options = parser.parse_args()
    versions: dict[str, Path | None] = {"": None}
    if options.against:
        versions[", other version"] = options.against
    best: dict[tuple[str, str], float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = {}
        for label, (v1, A, e) in SIZES.items():
            config, paths[label] = folder / "config.toml", folder / f"{label.split()[0]}.h5"
            config.write_text(CONFIG.format(v1=v1, A=A, e=e))
            cpu_seconds(["-m", "impact", "sweep", str(config), "-q", "-o", str(paths[label])])
        for _ in range(options.repeat):
            for label, path in paths.items():
                runs: dict[str, tuple[list[str], Path | None, int]] = {
                    "SHA-256": (["-c", SHA256, str(path)], None, 0)
                }
                for version, source in versions.items():
                    expand = ["expand", str(path), "-o", str(folder / "part.h5"), "--sel", "v1=0.98765"]
                    runs |= {
                        f"impact info{version}": (["-m", "impact", "info", str(path)], source, 0),
                        f"impact.load{version}": (["-c", LOAD, str(path)], source, 0),
                        f"expand --sel{version}": (["-m", "impact", *expand], source, 2),
                    }
                for what, (arguments, source, expected) in runs.items():
                    seconds = cpu_seconds(arguments, source, expected, options.limit)
                    best[label, what] = min(best.get((label, what), seconds), seconds)
        sizes = {label: path.stat().st_size for label, path in paths.items()}
    small, *others = SIZES
    rows = Table("CPU seconds", *(f"{label}\n{sizes[label]:,} bytes" for label in SIZES), "ratios to the limit")
    for what in dict.fromkeys(what for _, what in best):
        ratios = [best[label, what] / (2.0 * best[label, "SHA-256"] + best[small, what]) for label in others]
        shown = "" if what == "SHA-256" else ", ".join(f"{ratio:.2f}" for ratio in ratios)
        seconds = (best[label, what] for label in SIZES)
        rows.add_row(what, *(f"{s:.2f}" if s < math.inf else f"> {options.limit}" for s in seconds), shown)
    Console(width=115).print(rows)


if __name__ == "__main__":
    main()
