"""Sweeps on dask workers give the same file, whichever processes are killed, join or lose their connection."""

from __future__ import annotations

import os
import re
import shutil
import signal
import urllib.request
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

import impact
from impact.engine.execute import context_of, integrate_remotely
from impact.results.sweep import read_plan

from .clusters import (
    BLOCK_COUNT,
    CONFIG,
    ClusterServer,
    DaskCluster,
    content,
    processes_of_group,
    start_new_sweep,
    wait_until,
)
from .conftest import ROOT

pytestmark = pytest.mark.slow
PLUGIN = """import os
import impact

def force(elastic, v):
    DOES
    return elastic * (1 + 0.3 * v)

MODEL = impact.ForceModel("mine", "Mine", 2026, "F = K δⁿ (1 + 0.3 δ̇)", "", force=force)
"""
PLUGIN_CONFIG = CONFIG.replace('models = ["hertz", "lankarani-nikravesh-1990"]', 'models = ["mine"]')


@pytest.fixture(scope="module")
def expected(clusters: ClusterServer, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of the sweep in a single process."""
    running = clusters.start_sweep(tmp_path_factory.mktemp("one") / "sweep")
    running.wait()
    return running.content


def resume_sweep(clusters: ClusterServer, folder: Path, *words: str) -> bytes:
    """Resume a sweep and return its file."""
    resumed = clusters.start_sweep(folder, "--resume", *words)
    resumed.wait()
    return resumed.content


@pytest.fixture
def cluster(clusters: ClusterServer, tmp_path: Path) -> Iterator[DaskCluster]:
    with clusters.start_cluster(tmp_path / "cluster", "a", "b") as cluster:
        yield cluster


def test_a_scheduler_by_address_or_file_and_a_local_cluster_give_the_same_file(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    ways = {"address": ("--scheduler", cluster.address), "file": ("--scheduler-file", cluster.file)}
    for name, words in {**ways, "local": ("--scheduler", "local")}.items():
        # the local one by a new interpreter, with larger blocks
        start_sweep = partial(start_new_sweep, config=CONFIG) if name == "local" else clusters.start_sweep
        running = start_sweep(tmp_path / name, *words)
        printed = running.wait()
        assert running.content == expected
        match = re.search(r"^\d+ workers?; dashboard: (http://127.0.0.1:\d+/status)$", printed, re.MULTILINE)
        assert match, printed
        if name != "local":
            with urllib.request.urlopen(match[1]) as page:
                assert b"Dask" in page.read()
        assert "trajectories" in printed
        assert sorted(path.name for path in running.folder.iterdir()) == ["c.toml", "results.h5"]


@pytest.mark.parametrize("count", [4, *(pytest.param(count, marks=pytest.mark.long) for count in (1, 8))])
def test_a_killed_worker_changes_nothing(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes, count: int
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(count)
    cluster.kill("a")
    running.wait()
    assert running.content == expected


@pytest.mark.parametrize("count", [7, pytest.param(1, marks=pytest.mark.long)])
def test_new_workers_continue_after_all_were_killed(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes, count: int
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(count)
    cluster.kill("a", "b")
    assert not running.process.has_ended
    cluster.worker("c")
    running.wait()
    assert running.content == expected


@pytest.mark.parametrize("count", [1, pytest.param(7, marks=pytest.mark.long)])
def test_a_sweep_is_resumed_without_its_killed_scheduler(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes, count: int
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(count)
    cluster.kill("scheduler")
    printed = running.wait(4)
    assert re.search(
        rf"{cluster.address}: the connection to the scheduler was lost; "
        r"[\d,]+ of 7,000 trajectories are kept in",
        printed,
    ), printed
    assert "--resume continues" in printed
    assert "Traceback" not in printed
    kept = {path: path.stat().st_mtime_ns for path in running.folder.glob("*.work/*.npz")}
    assert count <= len(kept) < BLOCK_COUNT
    resumed = clusters.start_sweep(tmp_path / "sweep", "--resume")
    resumed.wait_for_blocks(len(kept) + 1)
    assert all(path.stat().st_mtime_ns == then for path, then in kept.items() if path.exists())
    resumed.wait()
    assert resumed.content == expected


def other_version(folder: Path) -> dict[str, str]:
    """The environment of a process that imports another version of the package."""
    shutil.copytree(ROOT / "src" / "impact", folder / "impact", ignore=shutil.ignore_patterns("__pycache__"))
    module = folder / "impact" / "_version.py"
    text = module.read_text(encoding="utf-8")
    changed = text.replace(f'__version__ = "{impact.__version__}"', '__version__ = "0.0.1"')
    assert changed != text
    module.write_text(changed, encoding="utf-8")
    return {"PYTHONPATH": str(folder)}


def test_a_worker_of_another_version_is_refused(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    cluster.worker("old", **other_version(tmp_path / "other"))
    printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address).wait(2)
    assert f"has impact 0.0.1, this is {impact.__version__}; expected the same" in printed
    assert "tcp://127.0.0.1" in printed
    cluster.kill("old")
    assert resume_sweep(clusters, tmp_path / "sweep", "--scheduler", cluster.address) == expected


def test_a_worker_of_another_version_that_joins_later_is_refused(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(1)
    # no other worker is left that could finish the sweep
    cluster.kill("a", "b")
    cluster.worker("old", ready=False, **other_version(tmp_path / "other"))
    printed = running.wait(2)
    assert re.search(
        rf"has impact 0\.0\.1, this is {re.escape(impact.__version__)}; expected the same; \d", printed
    ), printed
    assert "--resume continues" in printed
    cluster.kill("old")
    cluster.worker("c")
    assert resume_sweep(clusters, tmp_path / "sweep", "--scheduler", cluster.address) == expected


def test_a_worker_without_the_package_is_refused(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path
) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "impact.py").write_text("raise ImportError('none here')")
    cluster.worker("bare", PYTHONPATH=str(tmp_path / "other"))
    printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address).wait(2)
    assert re.search("^tcp://127.0.0.1:.*: has no impact: none here; expected impact", printed, re.MULTILINE), (
        printed
    )


def test_a_scheduler_without_the_package_is_refused(clusters: ClusterServer, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "impact.py").write_text("raise ImportError('none here')")
    with clusters.start_cluster(tmp_path / "cluster", PYTHONPATH=str(tmp_path / "other")) as cluster:
        printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address).wait(2)
    assert printed == f"the scheduler: has no impact: none here; expected impact {impact.__version__}\n"


def test_workers_do_not_need_the_file_of_a_plug_in(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path
) -> None:
    text = PLUGIN.replace("DOES", "pass")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(text, encoding="utf-8")
    clusters.start_sweep(tmp_path / "one", "--plugin", "mine.py", config=PLUGIN_CONFIG).wait()
    running = clusters.start_sweep(
        tmp_path / "two", "--plugin", "mine.py", "--scheduler", cluster.address, config=PLUGIN_CONFIG
    )
    running.wait_for_blocks(1)
    (tmp_path / "two" / "mine.py").unlink()
    running.wait()
    assert running.content == content(tmp_path / "one")


def test_a_block_integrated_twice_gives_the_same_bits(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    from distributed import Client

    (tmp_path / "c.toml").write_text(CONFIG)
    plan = read_plan(tmp_path / "c.toml")
    part = plan.ranges[0]
    block = ([plan.models[part.model].key], plan.columns_of(part), context_of(plan))
    with Client(cluster.address, set_as_default=False) as client:
        returned = [
            client.submit(integrate_remotely, *block, workers=[name], pure=False).result() for name in "ab"
        ]
    local, _ = integrate_remotely(*block)
    for name, values in vars(local).items():
        assert all(getattr(collisions, name).tobytes() == values.tobytes() for collisions, _ in returned), name
    # a block of a killed worker is integrated by another, and blocks that a killed driver did not store again
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(3)
    running.kill()
    cluster.kill("a")
    assert resume_sweep(clusters, tmp_path / "sweep", "--scheduler", cluster.address) == expected


@pytest.mark.parametrize("location", ["remote", "local"])
def test_a_block_that_kills_its_worker_is_integrated_by_another(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, location: str
) -> None:
    mark = tmp_path / "died"
    elsewhere = 'multiprocessing.parent_process() is not None or os.path.basename(os.getcwd()) == "cluster"'
    # two workers may be here at the same time
    dies = f"""if {elsewhere}:
        with contextlib.suppress(FileExistsError):
            open({str(mark)!r}, "x").close()
            os.kill(os.getpid(), 9)"""
    text = PLUGIN.replace("import os", "import contextlib, multiprocessing, os").replace("DOES", dies)
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(text, encoding="utf-8")
    clusters.start_sweep(tmp_path / "one", "--plugin", "mine.py", config=PLUGIN_CONFIG).wait()
    address = cluster.address if location == "remote" else "local"
    running = clusters.start_sweep(
        tmp_path / "two", "--plugin", "mine.py", "--scheduler", address, config=PLUGIN_CONFIG
    )
    running.wait()
    assert mark.exists()
    assert running.content == content(tmp_path / "one")


def test_an_interrupted_sweep_is_resumed(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(2)
    running.process.send_signal(signal.SIGINT)
    printed = running.wait(130)
    assert "--resume continues" in printed
    assert resume_sweep(clusters, tmp_path / "sweep", "--scheduler", cluster.address) == expected


def test_an_interrupted_sweep_without_workers_ends(
    clusters: ClusterServer, cluster: DaskCluster, tmp_path: Path, expected: bytes
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", cluster.address)
    running.wait_for_blocks(2)
    cluster.kill("a", "b")
    running.process.send_signal(signal.SIGINT)
    assert "--resume continues" in running.wait(130)
    assert resume_sweep(clusters, tmp_path / "sweep") == expected


def test_a_block_that_kills_every_worker_is_reported(clusters: ClusterServer, tmp_path: Path) -> None:
    # not in the process of the sweep
    dies = "if multiprocessing.parent_process() is not None and elastic.size > 100: os.kill(os.getpid(), 9)"
    (tmp_path / "mine.py").write_text(
        PLUGIN.replace("import os", "import multiprocessing, os").replace("DOES", dies)
    )
    printed = clusters.start_sweep(
        tmp_path, "--plugin", "mine.py", "--scheduler", "local", config=PLUGIN_CONFIG
    ).wait(4)
    assert printed.splitlines()[-1].startswith(
        "processes were killed 4 times at the same trajectories: too little memory"
    )
    assert "--resume continues" in printed


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_local_cluster_ends_with_the_sweep(
    clusters: ClusterServer, tmp_path: Path, expected: bytes, number: int
) -> None:
    running = clusters.start_sweep(tmp_path / "sweep", "--scheduler", "local")
    running.wait_for_blocks(2)
    group = running.process.pid
    if number == signal.SIGINT:
        # a terminal sends the signal to all processes
        os.killpg(group, number)
        printed = running.wait(130)
        assert printed.splitlines()[-1].endswith(
            "of 7,000 trajectories are kept in results.h5.work; --resume continues"
        )
        assert "Traceback" not in printed
    else:
        running.kill()
    wait_until(lambda: not processes_of_group(group))
    assert resume_sweep(clusters, tmp_path / "sweep") == expected


def test_an_unreachable_scheduler_is_reported(clusters: ClusterServer, tmp_path: Path) -> None:
    printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", "tcp://127.0.0.1:1").wait(2)
    assert "tcp://127.0.0.1:1: " in printed
    assert "expected the address of a scheduler of dask, such as tcp://host:8786" in printed
    assert "Traceback" not in printed
    assert not (tmp_path / "sweep" / "results.h5.work").exists()
    printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", "localhorst").wait(2)
    assert (
        printed == "localhorst: expected the address of a scheduler of dask, such as tcp://host:8786; or local\n"
    )
    printed = clusters.start_sweep(tmp_path / "sweep", "--scheduler", "local", "--jobs", "2").wait(2)
    assert "--jobs 2: got --scheduler local as well, expected one of the two" in printed
