"""The scripts of docs/examples run, and are clean under `mypy --strict`, as a user would check them."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest

from .conftest import ROOT

EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
# pandas has types if pandas-stubs is installed; those of clusters and notebooks are many, and no script meets
# them
CONFIG = """\
[mypy]
strict = true
[mypy-lmfit.*,joblib.*,pandas.*]
ignore_missing_imports = true
[mypy-dask.*,distributed.*,ipywidgets.*,ipykernel.*]
ignore_missing_imports = true
follow_imports = skip
"""
MISSPELT = """\
import numpy as np
import impact
at: dict[str, float] = {"e": 0.5}
both: dict[str, object] = {"e": 0.5, "v1": "1 m/s"}
impact.run(model="tsuji-1992", at=at, overrides=both)
impact.solve("hertz", "K", {"peak_force": np.float32(5)}, at=both, overrides=at)
impact.timestep("tsuji-1992", at=at, dt=np.array([1e-5]), steps_per_contact=range(9, 11), tol=np.float32(0.1))
impact.sweeep("x")
"""


def run_python(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env={**os.environ, "MYPY_CACHE_DIR": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path: Path, tmp_path: Path) -> None:
    for library in ("lmfit", "joblib"):
        pytest.importorskip(library, reason="the examples use lmfit and joblib")
    done = run_python("-W", "error", str(path), folder=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    # the drop tests were made with the first law, at A = 30 us
    assert "kuwabara-kono-1987 2.97e-05" in done.stdout


@pytest.mark.slow
def test_scripts_of_users_are_type_checked_and_misspelt_names_are_found(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="it checks the types")
    # the types of the libraries, if the types of this project were checked before
    with suppress(FileNotFoundError):
        shutil.copytree(ROOT / ".mypy_cache", tmp_path, dirs_exist_ok=True)
    (tmp_path / "mypy.ini").write_text(CONFIG)
    (tmp_path / "misspelt.py").write_text(MISSPELT)
    done = run_python("-m", "mypy", *map(str, EXAMPLES), "misspelt.py", folder=tmp_path)
    assert [line for line in done.stdout.splitlines() if "error:" in line] == [
        'misspelt.py:8: error: Module has no attribute "sweeep"; maybe "sweep"?  [attr-defined]'
    ], done.stdout + done.stderr
