"""The scripts of docs/cluster.md run unchanged, with replacements for what this machine lacks.

The test sets the environment variables with which SLURM numbers jobs. `ssh` starts a shell on this host instead of
another. Jobs of a queue are local processes, with the class that dask-jobqueue has for tests. There are fewer jobs
than on the page: each begins an interpreter.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import impact

from .clusters import CONFIG, TIMEOUT_S
from .conftest import ROOT

pytestmark = pytest.mark.slow
PAGE = (ROOT / "docs" / "cluster.md").read_text(encoding="utf-8")
SSH = """#!/bin/sh
[ "$1" = -n ] && shift
shift
exec sh -c "$*"
"""


def script(name: str) -> str:
    """The script of this name on the page."""
    match = re.search(rf"`{re.escape(name)}`[^`]*:\n\n```\w+\n(.*?)```", PAGE, re.DOTALL)
    assert match, name
    return match[1]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a config, and with a virtual environment of the name that the scripts use."""
    (tmp_path / "config.toml").write_text(CONFIG.replace("3500", "40000"))
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    bin_folder = Path(sys.executable).parent
    (tmp_path / "venv" / "bin" / "activate").write_text(f'PATH="{bin_folder}:$PATH"\nexport PATH\n')
    return tmp_path


def run(folder: Path, *words: str, **environment: str) -> str:
    completed = subprocess.run(
        words,
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=2 * TIMEOUT_S,
        check=False,
    )
    assert completed.returncode == 0, completed.stdout + completed.stderr
    return completed.stdout + completed.stderr


def has_expected_result(folder: Path) -> bool:
    return bool(impact.load(folder / "results.h5").identical(impact.sweep(folder / "config.toml")))


def test_a_job_array_of_shards_gives_the_expected_result(folder: Path) -> None:
    for name in ("shards.sh", "merge.sh"):
        (folder / name).write_text(script(name))
    assert "#SBATCH --array=1-16\n" in script("shards.sh")
    # one more than there are blocks
    for number in range(5, 0, -1):
        variables = {"SLURM_ARRAY_TASK_ID": str(number), "SLURM_ARRAY_TASK_COUNT": "5"}
        run(folder, "bash", "shards.sh", SLURM_SUBMIT_DIR=str(folder), **variables)
    blocks = [len(list((folder / f"results.h5.{number}-of-5.work").glob("*.npz"))) for number in range(1, 6)]
    assert sorted(blocks) == [0, 1, 1, 1, 1]
    run(folder, "bash", "merge.sh", SLURM_SUBMIT_DIR=str(folder))
    assert has_expected_result(folder)
    assert not list(folder.glob("*.work"))


def test_workers_started_by_ssh_give_the_expected_result(folder: Path) -> None:
    (folder / "hosts.txt").write_text("one\ntwo\n")
    (folder / "by_ssh.sh").write_text(script("by_ssh.sh"))
    (folder / "bin").mkdir()
    (folder / "bin" / "ssh").write_text(SSH)
    (folder / "bin" / "ssh").chmod(0o755)
    printed = run(folder, "bash", "by_ssh.sh", PATH=f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}")
    # workers may join the sweep later, on a busy machine the first one, too
    assert re.search(r"^(\d+ workers?|0 workers, waits for some); dashboard: ", printed, re.MULTILINE)
    assert has_expected_result(folder)


def test_workers_of_a_queue_give_the_expected_result(folder: Path) -> None:
    pytest.importorskip("dask_jobqueue")
    text = script("by_queue.py")
    for there, here in (
        ("from dask_jobqueue import SLURMCluster", "from dask_jobqueue.local import LocalCluster as SLURMCluster"),
        ("scale(jobs=16)", "scale(jobs=2)"),
    ):
        assert there in text
        text = text.replace(there, here)
    (folder / "by_queue.py").write_text(text)
    bin_folder = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    run(folder, sys.executable, "by_queue.py", PATH=bin_folder)
    assert has_expected_result(folder)
