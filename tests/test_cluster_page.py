"""The scripts of docs/cluster.md run as they stand, with something for what a cluster has and this machine lacks.

SLURM tells a job its number by the environment, and so does the test. `ssh` begins a shell on another host: here
it is one on this. Jobs of a queue are processes of this machine, by the class that dask-jobqueue has for that.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import impact

from .clusters import CONFIG, PATIENCE
from .conftest import ROOT

pytestmark = pytest.mark.slow
PAGE = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
SSH = """#!/bin/sh
[ "$1" = -n ] && shift
shift
exec sh -c "$*"
"""


def script(name: str) -> str:
    """The script that the page has under a name."""
    found = re.search(rf"`{re.escape(name)}`[^`]*:\n\n```\w+\n(.*?)```", PAGE, re.DOTALL)
    assert found, name
    return found[1]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a sweep, and with this environment under the name that the scripts have for one."""
    (tmp_path / "config.toml").write_text(CONFIG.replace("200000", "40000"))
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    here = Path(sys.executable).parent
    (tmp_path / "venv" / "bin" / "activate").write_text(f'PATH="{here}:$PATH"\nexport PATH\n')
    return tmp_path


def run(folder: Path, *words: str, **environment: str) -> str:
    done = subprocess.run(
        words, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=2 * PATIENCE,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def is_right(folder: Path) -> bool:
    return bool(impact.load(folder / "results.h5").identical(impact.sweep(folder / "config.toml")))


def test_a_job_array(folder: Path) -> None:
    for name in ("shards.sh", "merge.sh"):
        (folder / name).write_text(script(name))
    assert "#SBATCH --array=1-16\n" in script("shards.sh")
    for number in range(16, 0, -1):
        told = {"SLURM_ARRAY_TASK_ID": str(number), "SLURM_ARRAY_TASK_COUNT": "16"}
        run(folder, "bash", "shards.sh", SLURM_SUBMIT_DIR=str(folder), **told)
    run(folder, "bash", "merge.sh", SLURM_SUBMIT_DIR=str(folder))
    assert is_right(folder)
    assert not list(folder.glob("*.work"))


def test_by_hand_over_ssh(folder: Path) -> None:
    (folder / "hosts.txt").write_text("one\ntwo\n")
    (folder / "by_ssh.sh").write_text(script("by_ssh.sh"))
    (folder / "bin").mkdir()
    (folder / "bin" / "ssh").write_text(SSH)
    (folder / "bin" / "ssh").chmod(0o755)
    said = run(folder, "bash", "by_ssh.sh", PATH=f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}")
    assert "workers" in said
    assert is_right(folder)


def test_by_a_queue(folder: Path) -> None:
    pytest.importorskip("dask_jobqueue")
    text = script("by_queue.py").replace("import SLURMCluster", "import LocalCluster as SLURMCluster")
    (folder / "by_queue.py").write_text(
        text.replace("from dask_jobqueue import", "from dask_jobqueue.local import")
    )
    here = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run(folder, sys.executable, "by_queue.py", PATH=here)
    assert is_right(folder)
