"""Sweeps by the workers of a scheduler of dask: the same file, whatever becomes of the processes."""

from __future__ import annotations

import os
import re
import shutil
import signal
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.api import prepare
from impact.engine.execute import context_of, integrate_remotely, with_core
from impact.engine.trajectories import columns_of, trajectory_maps, trajectory_ranges

from .clusters import BLOCKS, CONFIG, Dask, content, dask, in_group, sweep, until
from .conftest import ROOT

pytestmark = pytest.mark.slow
MINE = """import os
import impact

def force(elastic, v):
    DOES
    return elastic * (1 + 0.3 * v)

MODEL = impact.ForceModel("mine", "Mine", 2026, "F = K δⁿ (1 + 0.3 δ̇)", "", force=force)
"""
OWN = CONFIG.replace('models = ["hertz", "lankarani-nikravesh-1990"]', 'models = ["mine"]')


@pytest.fixture(scope="module")
def right(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of the sweep in one process."""
    one = sweep(tmp_path_factory.mktemp("one") / "sweep")
    one.ends()
    return one.content


def resumed(folder: Path, *words: str) -> bytes:
    """The file of a sweep that was gone on with."""
    again = sweep(folder, "--resume", *words)
    again.ends()
    return again.content


@pytest.fixture
def two(tmp_path: Path) -> Iterator[Dask]:
    with dask(tmp_path / "cluster", "a", "b") as found:
        yield found


def test_the_same_content_by_address_file_and_local(two: Dask, tmp_path: Path, right: bytes) -> None:
    ways = {"address": ("--scheduler", two.address), "file": ("--scheduler-file", two.file)}
    for name, words in {**ways, "local": ("--scheduler", "local")}.items():
        one = sweep(tmp_path / name, *words)
        said = one.ends()
        assert one.content == right
        found = re.search(r"^\d+ workers?; dashboard: (http://127.0.0.1:\d+/status)$", said, re.MULTILINE)
        assert found, said
        if name != "local":
            with urllib.request.urlopen(found[1]) as page:
                assert b"Dask" in page.read()
        assert "trajectories" in said
        assert sorted(path.name for path in one.folder.iterdir()) == ["c.toml", "results.h5"]


@pytest.mark.parametrize("moment", [1, 4, 8])
def test_a_worker_killed_in_the_middle(two: Dask, tmp_path: Path, right: bytes, moment: int) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(moment)
    two.kill("a")
    one.ends()
    assert one.content == right


@pytest.mark.parametrize("moment", [1, 7])
def test_all_workers_killed_and_new_ones_join(two: Dask, tmp_path: Path, right: bytes, moment: int) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(moment)
    two.kill("a", "b")
    assert one.process.poll() is None
    two.worker("c")
    one.ends()
    assert one.content == right


@pytest.mark.parametrize("moment", [1, 7])
def test_the_scheduler_gone(two: Dask, tmp_path: Path, right: bytes, moment: int) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(moment)
    two.kill("scheduler")
    said = one.ends(4)
    assert re.search(
        rf"{two.address}: the connection to the scheduler was lost; [\d,]+ of 400,000 trajectories are kept in",
        said,
    ), said
    assert "--resume continues" in said
    assert "Traceback" not in said
    kept = {path: path.stat().st_mtime_ns for path in one.folder.glob("*.work/*.npz")}
    assert moment <= len(kept) < BLOCKS
    again = sweep(tmp_path / "sweep", "--resume")
    again.until_kept(len(kept) + 1)
    assert all(path.stat().st_mtime_ns == then for path, then in kept.items() if path.exists())
    again.ends()
    assert again.content == right


def other_version(folder: Path) -> dict[str, str]:
    """The environment of a process that finds another version of the package."""
    shutil.copytree(ROOT / "src" / "impact", folder / "impact", ignore=shutil.ignore_patterns("__pycache__"))
    module = folder / "impact" / "_version.py"
    text = module.read_text(encoding="utf-8")
    changed = text.replace(f'__version__ = "{impact.__version__}"', '__version__ = "0.0.1"')
    assert changed != text
    module.write_text(changed, encoding="utf-8")
    return {"PYTHONPATH": str(folder)}


def test_a_worker_of_another_version_is_refused(two: Dask, tmp_path: Path, right: bytes) -> None:
    two.worker("old", **other_version(tmp_path / "other"))
    said = sweep(tmp_path / "sweep", "--scheduler", two.address).ends(2)
    assert f"has impact 0.0.1, this is {impact.__version__}; expected the same" in said
    assert "tcp://127.0.0.1" in said
    two.kill("old")
    assert resumed(tmp_path / "sweep", "--scheduler", two.address) == right


def test_a_worker_of_another_version_that_joins_later_is_refused(two: Dask, tmp_path: Path, right: bytes) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(1)
    # nobody else is there to finish before it has begun
    two.kill("a", "b")
    two.worker("old", ready=False, **other_version(tmp_path / "other"))
    said = one.ends(2)
    assert re.search(
        rf"has impact 0\.0\.1, this is {re.escape(impact.__version__)}; expected the same; \d", said
    ), said
    assert "--resume continues" in said
    two.kill("old")
    two.worker("c")
    assert resumed(tmp_path / "sweep", "--scheduler", two.address) == right


def test_a_worker_without_the_package_is_refused(two: Dask, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "impact.py").write_text("raise ImportError('none here')")
    two.worker("bare", PYTHONPATH=str(tmp_path / "other"))
    said = sweep(tmp_path / "sweep", "--scheduler", two.address).ends(2)
    assert re.search("^tcp://127.0.0.1:.*: has no impact: none here; expected impact", said, re.MULTILINE), said


def test_a_scheduler_without_the_package_is_refused(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "impact.py").write_text("raise ImportError('none here')")
    with dask(tmp_path / "cluster", PYTHONPATH=str(tmp_path / "other")) as found:
        said = sweep(tmp_path / "sweep", "--scheduler", found.address).ends(2)
    assert said == f"the scheduler: has no impact: none here; expected impact {impact.__version__}\n"


def test_a_plug_in_whose_file_the_workers_have_not(two: Dask, tmp_path: Path) -> None:
    text = MINE.replace("DOES", "pass")
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(text, encoding="utf-8")
    sweep(tmp_path / "one", "--plugin", "mine.py", config=OWN).ends()
    one = sweep(tmp_path / "two", "--plugin", "mine.py", "--scheduler", two.address, config=OWN)
    one.until_kept(1)
    (tmp_path / "two" / "mine.py").unlink()
    one.ends()
    assert one.content == content(tmp_path / "one")


def test_a_block_executed_twice(two: Dask, tmp_path: Path, right: bytes) -> None:
    from distributed import Client

    (tmp_path / "c.toml").write_text(CONFIG)
    plan = prepare(tmp_path / "c.toml")
    maps = trajectory_maps(plan)
    plan = with_core(plan, maps)
    part = next(trajectory_ranges(maps))
    block = (plan.models[part.model].key, columns_of(plan, maps, part), context_of(plan))
    with Client(two.address, set_as_default=False) as client:
        done = [client.submit(integrate_remotely, *block, workers=[name], pure=False).result() for name in "ab"]
    here, _ = integrate_remotely(*block)
    for name, values in vars(here).items():
        assert all(getattr(one, name).tobytes() == values.tobytes() for one, _ in done), name
    # one that died of a block takes nothing with it: another executes what it had begun, and the driver killed
    # between a block and its file has it executed again
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(3)
    one.process.kill()
    one.process.communicate()
    two.kill("a")
    assert resumed(tmp_path / "sweep", "--scheduler", two.address) == right


@pytest.mark.parametrize("place", ["there", "local"])
def test_a_block_that_kills_its_worker_once(two: Dask, tmp_path: Path, place: str) -> None:
    mark = tmp_path / "died"
    elsewhere = 'multiprocessing.parent_process() is not None or os.path.basename(os.getcwd()) == "cluster"'
    dies = f"""if ({elsewhere}) and not os.path.exists({str(mark)!r}):
        open({str(mark)!r}, "w").close()
        os.kill(os.getpid(), 9)"""
    text = MINE.replace("import os", "import multiprocessing, os").replace("DOES", dies)
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.py").write_text(text, encoding="utf-8")
    sweep(tmp_path / "one", "--plugin", "mine.py", config=OWN).ends()
    address = two.address if place == "there" else "local"
    one = sweep(tmp_path / "two", "--plugin", "mine.py", "--scheduler", address, config=OWN)
    one.ends()
    assert mark.exists()
    assert one.content == content(tmp_path / "one")


def test_interrupted_it_is_resumed(two: Dask, tmp_path: Path, right: bytes) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(2)
    one.process.send_signal(signal.SIGINT)
    said = one.ends(130)
    assert "--resume continues" in said
    assert resumed(tmp_path / "sweep", "--scheduler", two.address) == right


def test_interrupted_when_nobody_is_left_it_ends(two: Dask, tmp_path: Path, right: bytes) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", two.address)
    one.until_kept(2)
    two.kill("a", "b")
    one.process.send_signal(signal.SIGINT)
    assert "--resume continues" in one.ends(130)
    assert resumed(tmp_path / "sweep") == right


def test_a_block_that_kills_every_worker_is_given_up(tmp_path: Path) -> None:
    # not where the sweep was begun
    dies = "if multiprocessing.parent_process() is not None and elastic.size > 100: os.kill(os.getpid(), 9)"
    (tmp_path / "mine.py").write_text(
        MINE.replace("import os", "import multiprocessing, os").replace("DOES", dies)
    )
    said = sweep(tmp_path, "--plugin", "mine.py", "--scheduler", "local", config=OWN).ends(4)
    assert said.splitlines()[-1].startswith(
        "processes were killed 4 times at the same trajectories: too little memory"
    )
    assert "--resume continues" in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_cluster_of_its_own_ends_with_the_sweep(tmp_path: Path, right: bytes, number: int) -> None:
    one = sweep(tmp_path / "sweep", "--scheduler", "local")
    one.until_kept(2)
    group = one.process.pid
    if number == signal.SIGINT:
        # as a terminal does, to all of them
        os.killpg(group, number)
        said = one.ends(130)
        assert said.splitlines()[-1].endswith(
            "of 400,000 trajectories are kept in results.h5.work; --resume continues"
        )
        assert "Traceback" not in said
    else:
        one.process.kill()
        one.process.communicate()
    until(lambda: not in_group(group))
    assert resumed(tmp_path / "sweep") == right


def test_nobody_answers(tmp_path: Path) -> None:
    said = sweep(tmp_path / "sweep", "--scheduler", "tcp://127.0.0.1:1").ends(2)
    assert "tcp://127.0.0.1:1: " in said
    assert "expected the address of a scheduler of dask, such as tcp://host:8786" in said
    assert "Traceback" not in said
    assert not (tmp_path / "sweep" / "results.h5.work").exists()
    said = sweep(tmp_path / "sweep", "--scheduler", "localhorst").ends(2)
    assert said == "localhorst: expected the address of a scheduler of dask, such as tcp://host:8786; or local\n"
    said = sweep(tmp_path / "sweep", "--scheduler", "local", "--jobs", "2").ends(2)
    assert "--jobs 2: got --scheduler local as well, expected one of the two" in said
