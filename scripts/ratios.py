"""Ratios of speeds, which benchmarks measure round by round, and the history of their runs.

    python scripts/ratios.py [--history results/bench.json] [--table results/bench.md] COMMAND ...

runs each COMMAND, such as "scripts/bench_core.py --rounds 5", collects the ratios that it records, and adds them
to the history. The table shows them next to those of the last run on the same machine: a ratio changed where the
ranges of the rounds of both runs do not overlap.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata, util
from pathlib import Path
from statistics import median
from typing import Any

# of the file to which scripts append, one JSON object per line
FILE_VARIABLE = "IMPACT_RATIOS"
LIBRARIES = ("impact-sweep", "numpy", "scipy", "numba", "xarray", "h5netcdf")

# medians, least and largest of the rounds by name
Ratios = Mapping[str, Sequence[float]]


def record(name: str, rounds: Sequence[float]) -> None:
    """Record the ratios of all rounds, if this script runs for the history."""
    if path := os.environ.get(FILE_VARIABLE):
        with Path(path).open("a", encoding="utf-8") as file:
            print(json.dumps({name: [median(rounds), min(rounds), max(rounds)]}), file=file)


def machine() -> dict[str, object]:
    """Describe what ratios depend on: runs of different machines are not compared."""
    return {
        "node": platform.node(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
    }


def run_scripts(commands: Sequence[str]) -> Ratios:
    """Run scripts, whose output is shown, and return the ratios that they record."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "ratios")
        for command in commands:
            environment = {**os.environ, FILE_VARIABLE: str(path)}
            subprocess.run([sys.executable, *shlex.split(command)], env=environment, check=True)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {name: ratio for line in lines for name, ratio in json.loads(line).items()}


def table(ratios: Ratios, before: Ratios) -> str:
    """Write a Markdown table of ratios, next to those of an earlier run."""
    rows = ["| ratio | median | least | largest | last run | |", "|---|---|---|---|---|---|"]
    for name, (middle, least, largest) in ratios.items():
        last, change = "", ""
        if name in before:
            last_middle, last_least, last_largest = before[name]
            last = f"{last_middle:.4g}"
            if least > last_largest or largest < last_least:
                change = f"{middle / last_middle - 1.0:+.0%}"
        rows.append(f"| {name} | {middle:.4g} | {least:.4g} | {largest:.4g} | {last} | {change} |")
    return "\n".join(rows) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commands", nargs="+", metavar="COMMAND")
    parser.add_argument("--history", type=Path, default=Path("results/bench.json"))
    parser.add_argument("--table", type=Path, default=Path("results/bench.md"))
    args = parser.parse_args()
    history: list[dict[str, Any]] = []
    if args.history.exists():
        history = json.loads(args.history.read_text(encoding="utf-8"))
    this = machine()
    before = next((run for run in reversed(history) if run["machine"] == this), None)
    run = {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": this,
        "versions": {
            name: metadata.version(name) for name in LIBRARIES if name != "numba" or util.find_spec(name)
        },
        "ratios": run_scripts(args.commands),
    }
    shown = table(run["ratios"], before["ratios"] if before else {})
    for path, text in ((args.history, json.dumps([*history, run], indent=1)), (args.table, shown)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    print(shown, f"compared with {before['date']}" if before else "no earlier run on this machine", sep="\n")


if __name__ == "__main__":
    main()
