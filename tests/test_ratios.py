"""The history of benchmarks collects the ratios of scripts, and finds those that changed on the same machine."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from .conftest import ROOT

SCRIPTS = ROOT / "scripts"
# records a ratio of each round, which are its arguments
SCRIPT = f"""
import sys
sys.path.insert(0, {str(SCRIPTS)!r})
from ratios import record
record("fast per slow", [float(word) for word in sys.argv[1:]])
"""


def bench(folder: Path, rounds: str) -> str:
    """Run a script with these rounds for the history in a folder, and return the row of its ratio."""
    (folder / "bench_it.py").write_text(SCRIPT, encoding="utf-8")
    words = ["--history", "bench.json", "--table", "bench.md", f"bench_it.py {rounds}"]
    subprocess.run([sys.executable, SCRIPTS / "ratios.py", *words], cwd=folder, capture_output=True, check=True)
    *_, row = (folder / "bench.md").read_text(encoding="utf-8").splitlines()
    return row


def test_a_ratio_is_compared_with_the_last_run_on_the_same_machine(tmp_path: Path) -> None:
    assert bench(tmp_path, "3 1 2") == "| fast per slow | 2 | 1 | 3 |  |  |"
    # the ranges overlap
    assert bench(tmp_path, "2 3 4") == "| fast per slow | 3 | 2 | 4 | 2 |  |"
    assert bench(tmp_path, "6 6 6") == "| fast per slow | 6 | 6 | 6 | 3 | +100% |"
    history = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    assert [run["ratios"]["fast per slow"][0] for run in history] == [2.0, 3.0, 6.0]


def test_runs_of_other_machines_are_not_compared(tmp_path: Path) -> None:
    bench(tmp_path, "1")
    (run,) = json.loads((tmp_path / "bench.json").read_text(encoding="utf-8"))
    run["machine"]["cores"] += 1
    (tmp_path / "bench.json").write_text(json.dumps([run]), encoding="utf-8")
    assert bench(tmp_path, "9") == "| fast per slow | 9 | 9 | 9 |  |  |"
