"""Merged shards give the file of the whole sweep; missing, unfinished and foreign shards are reported."""

from __future__ import annotations

import contextlib
import json
import re
import shlex
import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from filelock import FileLock

import impact
from impact import ImpactError
from impact.errors import UnfinishedError, UsageError

from .clusters import ClusterServer, content
from .conftest import PLUGIN, Run, assert_refused
from .fork_server import ForkServer

# one block for each law
CONFIG = """title = "In parts"
models = ["hertz", "lankarani-nikravesh-1990", "hunt-crossley-1975", "lee-wang-1983", "exact-hysteresis"]
[solver]
rtol = 1e-4
[sweep]
e = { linspace = [0.0, 1.0, 30] }
v1 = 1.0
m1 = 1.0
m2 = [1.0, 2.0]
K = 1e9
"""
BLOCKS = 5


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "c.toml").write_text(CONFIG)
    return tmp_path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file of the sweep without shards."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "c.toml").write_text(CONFIG)
    impact.sweep_to_file(folder / "c.toml", folder / "results.h5")
    return content(folder)


def run_shards(folder: Path, *shards: str, **options: Any) -> list[Path]:
    """Integrate shards in this process; return their work folders."""
    with contextlib.chdir(folder):
        return [folder / impact.sweep_shard("c.toml", shard, "results.h5", **options).folder for shard in shards]


def change_last_bits(path: Path) -> None:
    """Change the last bits of an array of a block."""
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    arrays["contact_time"] = np.nextafter(arrays["contact_time"], 1.0)
    np.savez(path, **arrays)


@pytest.mark.parametrize("count", [1, 3, pytest.param(7, marks=pytest.mark.slow)])
def test_shards_in_any_order_merge_to_the_file_of_the_whole_sweep(
    cli: Run, folder: Path, whole: bytes, count: int
) -> None:
    folders = run_shards(folder, *(f"{number}/{count}" for number in range(count, 0, -1)))
    blocks = [len(list(path.glob("*.npz"))) for path in folders]
    assert sum(blocks) == BLOCKS
    assert max(blocks) - min(blocks) <= 1
    completed = cli("merge", *folders, cwd=folder)
    assert completed.returncode == 0, completed.stderr
    assert content(folder) == whole
    # the result as JSON is for --json alone
    assert completed.stdout == ""
    assert "results.h5: 300 points from" in completed.stderr
    assert "more than one folder" not in completed.stderr
    assert all(path.is_dir() for path in folders)


def test_a_shard_reports_its_blocks_and_the_merge_command_and_is_not_integrated_twice(
    cli: Run, folder: Path
) -> None:
    words = ("sweep", "c.toml", "--shard", "2/2", "-o", "out.h5")
    completed = cli(*words, cwd=folder)
    assert completed.returncode == 0
    assert "out.h5.2-of-2.work: 2 of 5 blocks, " in completed.stderr
    assert "with all 2 shards: impact merge out.h5.*-of-2.work -o out.h5" in completed.stderr
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.work/*.npz")}
    repeated = cli(*words, "--json", cwd=folder)
    assert json.loads(repeated.stdout) == {
        "folder": "out.h5.2-of-2.work",
        "shard": "2/2",
        "blocks": 2,
        "of_blocks": 5,
        "trajectories": 60,
        "failed": 0,
    }
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*.work/*.npz")} == before


def test_a_request_to_stop_that_comes_late_ends_a_complete_shard_and_a_merge(folder: Path) -> None:
    shard, output, seen = folder / "results.h5.1-of-1.work", folder / "results.h5", [False]
    with pytest.raises(UnfinishedError, match=rf"{re.escape(shard.name)} is complete"):
        run_shards(
            folder,
            "1/1",
            overrides=['models="hertz"', "sweep.e=1.0"],
            on_progress=lambda progress: seen.append(progress.trajectories == progress.of_trajectories),
            should_stop=lambda: seen[-1],
        )
    with pytest.raises(UnfinishedError):
        impact.merge([shard], output, should_stop=lambda: seen[-1])
    assert not output.exists()
    assert impact.merge([shard], output).summary.points == 2


def test_a_folder_of_unfinished_work_in_place_of_a_result_says_how_to_go_on(cli: Run, folder: Path) -> None:
    (shard,) = run_shards(folder, "1/2", overrides=['models="hertz"', "sweep.e=1.0"])
    shutil.copytree(shard, folder / "whole.h5.work")
    resumed = "which impact sweep continues with --resume"
    for name, message in {
        shard.name: "is a part of a sweep, which impact merge joins with the others",
        "whole.h5.work": f"is the unfinished work of whole.h5, {resumed}",
        "whole.h5": f"does not exist; whole.h5.work has its unfinished work, {resumed}",
        "other.h5": "does not exist",
    }.items():
        done = cli("info", name, cwd=folder)
        assert (done.returncode, done.stderr) == (2, f"{name}: {message}\n")


@pytest.mark.slow
def test_a_missing_shard_is_reported_with_the_command_that_integrates_it(cli: Run, folder: Path) -> None:
    folders = run_shards(folder, "1/3", "3/3", overrides=["sweep.v1=2.0"])
    completed = cli("merge", *folders, cwd=folder)
    assert completed.returncode == 2
    command = "impact sweep c.toml -o results.h5 --set sweep.v1=2.0 --shard 2/3"
    assert completed.stderr.splitlines()[-1] == f"results.h5: shard 2/3 is missing; {command} computes it"
    assert not (folder / "results.h5").exists()
    assert cli(*shlex.split(command)[1:], cwd=folder).returncode == 0
    impact.merge(list(folder.glob("results.h5.*-of-3.work")), folder / "results.h5")
    expected = impact.sweep(folder / "c.toml", overrides=["sweep.v1=2.0"])
    assert impact.load(folder / "results.h5").identical(expected)


@pytest.mark.slow
def test_an_unfinished_shard_is_reported_with_the_command_that_finishes_it(
    cli: Run, folder: Path, whole: bytes
) -> None:
    folders = run_shards(folder, "1/2", "2/2")
    (folders[1] / "00000003.npz").write_bytes(b"half of it")
    completed = cli("merge", *folders, cwd=folder)
    assert completed.returncode == 2
    command = "impact sweep c.toml -o results.h5 --shard 2/2"
    assert completed.stderr.splitlines()[-1] == f"{folders[1]}: shard 2/2 lacks 1 block; {command} finishes it"
    assert cli(*shlex.split(command)[1:], cwd=folder).returncode == 0
    impact.merge(folders, folder / "results.h5")
    assert content(folder) == whole


FEW_OPEN_FILES = """import resource
resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of open files")
def test_more_shards_than_the_limit_of_open_files_are_merged(
    forked: ForkServer, folder: Path, whole: bytes
) -> None:
    # only five of the 60 shards have a block, and each is a folder with a lock
    folders = run_shards(folder, *(f"{number}/60" for number in range(1, 6)))
    for number in range(6, 61):
        folders.append(folder / f"results.h5.{number}-of-60.work")
        shutil.copytree(folders[0], folders[-1])
        record = json.loads((folders[-1] / "shard.json").read_text()) | {"shard": [number, 60]}
        (folders[-1] / "shard.json").write_text(json.dumps(record))
        (folders[-1] / "00000000.npz").unlink()
    completed = forked("merge", *reversed(folders), cwd=folder, code=FEW_OPEN_FILES)
    assert completed.returncode == 0, completed.stderr
    assert content(folder) == whole


@pytest.mark.slow
def test_five_missing_shards_are_listed_and_more_are_counted(cli: Run, folder: Path) -> None:
    more = '"gharib-hurmuzlu-2012", "herbert-mcwhannell-1977", "lankarani-nikravesh-1994"]'
    (folder / "c.toml").write_text(CONFIG.replace('hysteresis"]', f'hysteresis", {more}'))
    completed = cli("merge", *run_shards(folder, "9/9"), cwd=folder)
    lines = completed.stderr.splitlines()
    assert [line.split(":")[1].split(";")[0] for line in lines[:-1]] == [
        f" shard {number}/9 is missing" for number in range(1, 6)
    ]
    assert lines[-1] == "and 3 more shards"


def test_a_folder_of_another_sweep_or_of_no_shard_is_refused(cli: Run, folder: Path) -> None:
    first = run_shards(folder, "1/2")
    (folder / "c.toml").write_text(CONFIG.replace("v1 = 1.0", "v1 = 2.0"))
    (second,) = run_shards(folder, "2/2")

    def refused(*folders: str | Path) -> str:
        with pytest.raises(ImpactError) as error:
            impact.merge([*first, *folders], folder / "results.h5")
        return str(error.value)

    completed = cli("merge", *first, second, cwd=folder)
    assert completed.returncode == 2
    assert f"{second}: belongs to another sweep: scalars.v1: 2.0 there, 1.0 here; " in completed.stderr
    shutil.rmtree(second)
    (folder / "c.toml").write_text(CONFIG.replace("In parts", "Else"))
    run_shards(folder, "2/2")
    assert f"{second}: its title or output differs from that of {first[0]}; expected" in refused(second)
    for path in (folder / "c.toml", folder / "nowhere.work"):
        message = f"{path}: is not a shard; expected a work folder of impact sweep --shard K/N"
        assert message in refused(path)
    (second / "plan.json").write_text("[")
    assert "its plan.json cannot be read" in refused(second)


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"shard": [1, 0]}', '{"shard": [true, "x"], "command": 1}', "[" * 9000]
)
def test_an_invalid_shard_record_is_refused(cli: Run, folder: Path, text: str) -> None:
    (shard,) = run_shards(folder, "1/1")
    (shard / "shard.json").write_text(text)
    message = "is not a shard; expected a work folder of impact sweep --shard K/N"
    assert_refused(cli("merge", shard, cwd=folder), message)


@pytest.mark.slow
def test_repeated_blocks_are_counted_and_differing_ones_are_refused(cli: Run, folder: Path, whole: bytes) -> None:
    folders = run_shards(folder, "1/2", "2/2", "1/3")
    completed = cli("merge", *folders, folders[0], cwd=folder)
    assert "2 blocks were in more than one folder, with the same bits" in completed.stderr
    assert content(folder) == whole
    path = folders[2] / "00000000.npz"
    change_last_bits(path)
    message = f"{path}: differs from {folders[0] / path.name}; expected both to be computed on the same type of "
    assert_refused(cli("merge", *folders, "--overwrite", cwd=folder), f"{message}processor")


def test_a_shard_that_another_process_writes_is_not_merged(cli: Run, folder: Path) -> None:
    folders = run_shards(folder, "1/2", "2/2")
    with FileLock(folders[1] / "lock"):
        completed = cli("merge", *folders, cwd=folder)
        assert completed.returncode == 5
        assert "results.h5.2-of-2: is being written by another process" in completed.stderr
        assert cli("sweep", "c.toml", "--shard", "2/2", cwd=folder).returncode == 5


@pytest.mark.slow
def test_a_merge_needs_the_plug_in_of_the_shards(cli: Run, folder: Path) -> None:
    (folder / "mine.py").write_text(PLUGIN.format(chi="1 - e"))
    (folder / "c.toml").write_text(CONFIG.replace('"hertz"', '"mine-2026"'))
    folders = run_shards(folder, "1/2", "2/2", plugins=["mine.py"])
    message = "made with mine-2026 of mine.py; give it again with --plugin FILE"
    assert_refused(cli("merge", *folders, cwd=folder), message)
    assert cli("merge", *folders, "--plugin", "mine.py", cwd=folder).returncode == 0


def test_a_shard_of_another_sweep_is_not_continued_but_can_be_overwritten(cli: Run, folder: Path) -> None:
    run_shards(folder, "1/2")
    words = ("sweep", "c.toml", "--shard", "1/2", "--set", "sweep.v1=2.0", "--quiet")
    message = "results.h5.1-of-2.work: belongs to another sweep: scalars.v1: 1.0 there, 2.0 here"
    assert_refused(cli(*words, cwd=folder), message)
    completed = cli(*words, "--overwrite", cwd=folder)
    assert (completed.returncode, completed.stderr) == (0, "")


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("", ".: is not a regular file"),
        ("..", "..: is not a regular file"),
        ("no/r.h5", "the folder no does not exist"),
    ],
)
def test_a_result_of_shards_that_no_merge_could_write_is_refused(folder: Path, output: str, message: str) -> None:
    with contextlib.chdir(folder), pytest.raises(UsageError, match=re.escape(message)):
        impact.sweep_shard("c.toml", "1/2", output)
    assert not [*folder.parent.glob("*.work")]


@pytest.mark.slow
@pytest.mark.parametrize("text", ["3", "0/4", "5/4", "1/0", "-1/2", "1/2/3", "a/b", ""])
def test_an_invalid_number_of_a_shard_is_refused(cli: Run, folder: Path, text: str) -> None:
    expected = "expected K/N with K from 1 to N, such as 3/16"
    with pytest.raises(UsageError, match=re.escape(f'shard="{text}": {expected}')):
        run_shards(folder, text)
    assert_refused(cli("sweep", "c.toml", f"--shard={text}", cwd=folder), f"--shard {text}: {expected}")


@pytest.mark.slow
def test_a_shard_counts_failed_points_and_a_merge_with_failed_points_exits_with_3(cli: Run, folder: Path) -> None:
    few_steps = ("--set", "solver.max_steps=1")
    completed = cli("sweep", "c.toml", "--shard", "1/2", *few_steps, cwd=folder)
    assert completed.returncode == 0
    # a trajectory of the elastic law and thirty of each other; a plastic limit takes no step
    assert ": 3 of 5 blocks, 61 trajectories, 60 failed; " in completed.stderr
    run_shards(folder, "2/2", overrides=few_steps[1:])
    folders = sorted(folder.glob("*.work"))
    completed = cli("merge", *folders, "--json", cwd=folder)
    assert completed.returncode == 3
    assert json.loads(completed.stdout)["status"]["max_steps"] > 0
    assert cli("merge", *folders, "--overwrite", "--allow-failed", cwd=folder).returncode == 0


def test_a_merge_with_failed_points_exits_with_3(cli: Run, folder: Path) -> None:
    folders = run_shards(folder, "1/1", overrides=["solver.max_steps=1", "sweep.e=0.5", 'models="hertz"'])
    assert cli("merge", *folders, cwd=folder).returncode == 3


@pytest.mark.slow
def test_killed_shards_are_continued_and_merge_to_the_whole(clusters: ClusterServer, tmp_path: Path) -> None:
    clusters.start_sweep(tmp_path / "whole").wait()
    kept: dict[Path, int] = {}
    for number, count in ((1, 1), (1, 4), (2, 9)):
        running = clusters.start_sweep(tmp_path / "shards", "--shard", f"{number}/2")
        running.wait_for_blocks(count)
        running.kill()
        kept = {path: path.stat().st_mtime_ns for path in running.folder.glob("*.work/*.npz")}
    for number in (1, 2):
        clusters.start_sweep(tmp_path / "shards", "--shard", f"{number}/2").wait()
    assert all(path.stat().st_mtime_ns == modified for path, modified in kept.items())
    folders = list((tmp_path / "shards").glob("*.work"))
    assert clusters.start("merge", *folders, cwd=tmp_path / "shards").wait().returncode == 0
    assert content(tmp_path / "shards") == content(tmp_path / "whole")
