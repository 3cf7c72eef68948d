"""`impact sweep --shard` and `impact merge`: the parts make what the sweep makes, or it is said what they lack."""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

import impact
from impact.api import prepare
from impact.results.sweep import sweep_into

from .clusters import content, sweep
from .conftest import Run
from .fork_server import ForkServer

# a block of each law
CONFIG = """title = "In parts"
models = ["hertz", "lankarani-nikravesh-1990", "hunt-crossley-1975", "lee-wang-1983", "exact-hysteresis"]
[solver]
rtol = 1e-6
[sweep]
e = { linspace = [0.0, 1.0, 30] }
v1 = 1.0
m1 = 1.0
m2 = [1.0, 2.0]
K = 1e9
"""
BLOCKS = 5
MINE = """import impact

MODEL = impact.hysteresis("mine", title="", year=2026, equation="", reference="", chi=lambda e: 1 - e)
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "c.toml").write_text(CONFIG)
    return tmp_path


def shards(cli: Run, folder: Path, *parts: str, words: tuple[str, ...] = ()) -> list[Path]:
    """Do some shards; their folders."""
    for part in parts:
        done = cli("sweep", "c.toml", "--shard", part, "--quiet", *words, cwd=folder)
        assert (done.returncode, done.stderr) == (0, "")
    return [folder / f"results.h5.{part.replace('/', '-of-')}.work" for part in parts]


def right(folder: Path) -> bytes:
    """The file of the sweep in one piece."""
    sweep_into(folder / "right.h5", prepare(folder / "c.toml"), overwrite=True)
    return (folder / "right.h5").read_bytes()


def merged(cli: Run, folder: Path, *folders: Path) -> str:
    """What it said."""
    done = cli("merge", *folders, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert content(folder) == right(folder)
    return done.stderr


@pytest.mark.parametrize("of", [1, 3, pytest.param(7, marks=pytest.mark.slow)])
def test_the_parts_in_any_order_make_the_whole(cli: Run, folder: Path, of: int) -> None:
    found = shards(cli, folder, *(f"{number}/{of}" for number in range(of, 0, -1)))
    counts = [len(list(one.glob("*.npz"))) for one in found]
    assert sum(counts) == BLOCKS
    assert max(counts) - min(counts) <= 1
    said = merged(cli, folder, *found)
    assert "results.h5: 300 points from" in said
    assert all(one.is_dir() for one in found)


def test_a_shard_says_what_it_did_and_what_comes_next(cli: Run, folder: Path) -> None:
    done = cli("sweep", "c.toml", "--shard", "2/2", "-o", "out.h5", cwd=folder)
    assert done.returncode == 0
    assert "out.h5.2-of-2.work: 2 of 5 blocks, " in done.stderr
    assert "with all 2 shards: impact merge out.h5.*-of-2.work -o out.h5" in done.stderr
    told = json.loads(cli("sweep", "c.toml", "--shard", "2/2", "-o", "out.h5", "--json", cwd=folder).stdout)
    assert told == {
        "folder": "out.h5.2-of-2.work", "shard": "2/2", "blocks": 2, "of_blocks": 5, "trajectories": 60,
        "failed": 0,
    }  # fmt: skip
    # again, there is nothing left to do
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.work/*.npz")}
    assert cli("sweep", "c.toml", "--shard", "2/2", "-o", "out.h5", cwd=folder).returncode == 0
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*.work/*.npz")} == before


def test_a_missing_shard_is_named_with_the_command_that_makes_it(cli: Run, folder: Path) -> None:
    found = shards(cli, folder, "1/3", "3/3", words=("--set", "sweep.v1=2.0"))
    done = cli("merge", *found, cwd=folder)
    assert done.returncode == 2
    command = "impact sweep c.toml -o results.h5 --set sweep.v1=2.0 --shard 2/3"
    assert done.stderr.splitlines()[-1] == f"results.h5: shard 2/3 is missing; {command} computes it"
    assert not (folder / "results.h5").exists()
    assert cli(*shlex.split(command)[1:], cwd=folder).returncode == 0
    assert cli("merge", *folder.glob("results.h5.*-of-3.work"), cwd=folder).returncode == 0
    whole = impact.sweep(folder / "c.toml", overrides=["sweep.v1=2.0"])
    assert impact.load(folder / "results.h5").identical(whole)


def test_an_unfinished_shard_is_told_from_a_missing_one(cli: Run, folder: Path) -> None:
    found = shards(cli, folder, "1/2", "2/2")
    (found[1] / "00000003.npz").write_bytes(b"half of it")
    done = cli("merge", *found, cwd=folder)
    assert done.returncode == 2
    command = "impact sweep c.toml -o results.h5 --shard 2/2"
    assert done.stderr.splitlines()[-1] == f"{found[1]}: shard 2/2 lacks 1 block; {command} finishes it"
    assert cli(*shlex.split(command)[1:], cwd=folder).returncode == 0
    merged(cli, folder, *found)


LIMITED = """import resource
resource.setrlimit(resource.RLIMIT_NOFILE, (40, 40))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="needs a limit of open files")
def test_more_shards_than_open_files_are_merged(cli: Run, forked: ForkServer, folder: Path) -> None:
    # of the 60 only five have a range, and each is a folder with a lock
    found = shards(cli, folder, "1/60", "2/60", "3/60", "4/60", "5/60")
    for number in range(6, 61):
        found.append(folder / f"results.h5.{number}-of-60.work")
        shutil.copytree(found[0], found[-1])
        told = json.loads((found[-1] / "shard.json").read_text()) | {"shard": [number, 60]}
        (found[-1] / "shard.json").write_text(json.dumps(told))
        (found[-1] / "00000000.npz").unlink()
    done = forked("merge", *reversed(found), cwd=folder, code=LIMITED)
    assert done.returncode == 0, done.stderr
    assert content(folder) == right(folder)


@pytest.mark.slow
def test_many_missing_ones_are_counted(cli: Run, folder: Path) -> None:
    more = '"gharib-hurmuzlu-2012", "herbert-mcwhannell-1977", "lankarani-nikravesh-1994"]'
    (folder / "c.toml").write_text(CONFIG.replace('hysteresis"]', f'hysteresis", {more}'))
    done = cli("merge", *shards(cli, folder, "9/9"), cwd=folder)
    lines = done.stderr.splitlines()
    assert [line.split(":")[1].split(";")[0] for line in lines[:-1]] == [
        f" shard {number}/9 is missing" for number in range(1, 6)
    ]
    assert lines[-1] == "and 3 more shards"


def test_foreign_ones_are_told(cli: Run, folder: Path) -> None:
    own = shards(cli, folder, "1/2")
    (folder / "c.toml").write_text(CONFIG.replace("v1 = 1.0", "v1 = 2.0"))
    other = shards(cli, folder, "2/2")
    done = cli("merge", *own, *other, cwd=folder)
    assert done.returncode == 2
    assert f"{other[0]}: belongs to another sweep: scalars.v1: 2.0 there, 1.0 here; " in done.stderr
    shutil.rmtree(other[0])
    (folder / "c.toml").write_text(CONFIG.replace("In parts", "Else"))
    shards(cli, folder, "2/2")
    done = cli("merge", *own, *other, cwd=folder)
    assert f"{other[0]}: its title or output differs from that of {own[0]}; expected" in done.stderr
    for name, said in (("c.toml", "is not a shard"), ("nowhere.work", "is not a shard")):
        done = cli("merge", *own, name, cwd=folder)
        assert done.returncode == 2
        assert f"{name}: {said}; expected a work folder of impact sweep --shard K/N" in done.stderr
    (other[0] / "plan.json").write_text("[")
    assert "its plan.json cannot be read" in cli("merge", *own, *other, cwd=folder).stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"shard": [1, 0]}', '{"shard": [true, "x"], "command": 1}', "[" * 9000]
)
def test_what_a_folder_says_may_be_anything(cli: Run, folder: Path, text: str) -> None:
    (found,) = shards(cli, folder, "1/1")
    (found / "shard.json").write_text(text)
    done = cli("merge", found, cwd=folder)
    assert done.returncode == 2
    assert "is not a shard; expected a work folder of impact sweep --shard K/N" in done.stderr


def test_blocks_in_two_shards_have_to_be_equal(cli: Run, folder: Path) -> None:
    whole, part = shards(cli, folder, "1/1", "1/5")
    assert "in more than one folder, with the same bits" in merged(cli, folder, whole, part)
    (path,) = part.glob("0*.npz")
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    np.savez(path, **{**arrays, "contact_time": np.nextafter(arrays["contact_time"], 1.0)})
    done = cli("merge", whole, part, "--overwrite", cwd=folder)
    assert done.returncode == 2
    assert f"{path}: differs from {whole / path.name}; expected both" in done.stderr


@pytest.mark.slow
def test_shards_that_overlap_are_one_where_their_bits_are(cli: Run, folder: Path) -> None:
    found = shards(cli, folder, "1/2", "2/2", "1/3")
    said = merged(cli, folder, *found, found[0])
    assert "2 blocks were in more than one folder, with the same bits" in said
    path = found[2] / "00000000.npz"
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files}
    arrays["contact_time"] = np.nextafter(arrays["contact_time"], 1.0)
    np.savez(path, **arrays)
    done = cli("merge", *found, "--overwrite", cwd=folder)
    assert done.returncode == 2
    assert (
        f"{path}: differs from {found[0] / path.name}; expected both to be computed on the same type of processor"
        in done.stderr
    )


def test_a_shard_that_is_being_made_is_told(cli: Run, folder: Path) -> None:
    found = shards(cli, folder, "1/2", "2/2")
    with FileLock(found[1] / "lock"):
        done = cli("merge", *found, cwd=folder)
        assert done.returncode == 5
        assert "results.h5.2-of-2: is being written by another process" in done.stderr
        assert cli("sweep", "c.toml", "--shard", "2/2", cwd=folder).returncode == 5


@pytest.mark.slow
def test_a_model_of_ones_own_is_wanted_again(cli: Run, folder: Path) -> None:
    (folder / "mine.py").write_text(MINE)
    (folder / "c.toml").write_text(CONFIG.replace('"hertz"', '"mine"'))
    found = shards(cli, folder, "1/2", "2/2", words=("--plugin", "mine.py"))
    done = cli("merge", *found, cwd=folder)
    assert done.returncode == 2
    assert "made with mine of mine.py; give it again with --plugin FILE" in done.stderr
    assert cli("merge", *found, "--plugin", "mine.py", cwd=folder).returncode == 0


def test_another_sweep_does_not_go_on_in_its_folder(cli: Run, folder: Path) -> None:
    shards(cli, folder, "1/2")
    done = cli("sweep", "c.toml", "--shard", "1/2", "--set", "sweep.v1=2.0", cwd=folder)
    assert done.returncode == 2
    assert "results.h5.1-of-2.work: belongs to another sweep: scalars.v1: 1.0 there, 2.0 here" in done.stderr
    shards(cli, folder, "1/2", words=("--set", "sweep.v1=2.0", "--overwrite"))


@pytest.mark.parametrize("text", ["3", "0/4", "5/4", "1/0", "-1/2", "1/2/3", "a/b", ""])
def test_what_is_no_shard_is_told(cli: Run, folder: Path, text: str) -> None:
    done = cli("sweep", "c.toml", f"--shard={text}", cwd=folder)
    assert done.returncode == 2
    assert f"--shard {text}: expected K/N with K from 1 to N, such as 3/16" in done.stderr


@pytest.mark.slow
def test_failed_points_are_told_by_the_shard_and_end_the_merge_with_three(cli: Run, folder: Path) -> None:
    few = ("--set", "solver.max_steps=1")
    done = cli("sweep", "c.toml", "--shard", "1/2", *few, cwd=folder)
    assert done.returncode == 0
    # one of the elastic law and thirty of each other; a plastic limit takes no step
    assert ": 3 of 5 blocks, 61 trajectories, 60 failed; " in done.stderr
    shards(cli, folder, "2/2", words=few)
    found = sorted(folder.glob("*.work"))
    done = cli("merge", *found, "--json", cwd=folder)
    assert done.returncode == 3
    assert json.loads(done.stdout)["status"]["max_steps"] > 0
    assert cli("merge", *found, "--overwrite", "--allow-failed", cwd=folder).returncode == 0


@pytest.mark.slow
def test_shards_that_are_killed_go_on_and_make_the_whole(tmp_path: Path) -> None:
    sweep(tmp_path / "one").ends()
    kept: dict[Path, int] = {}
    for number, count in ((1, 1), (1, 4), (2, 9)):
        part = sweep(tmp_path / "two", "--shard", f"{number}/2")
        part.until_kept(count)
        part.process.kill()
        part.process.communicate()
        kept = {path: path.stat().st_mtime_ns for path in part.folder.glob("*.work/*.npz")}
    for number in (1, 2):
        sweep(tmp_path / "two", "--shard", f"{number}/2").ends()
    assert all(path.stat().st_mtime_ns == then for path, then in kept.items())
    folders = list((tmp_path / "two").glob("*.work"))
    subprocess.run([sys.executable, "-m", "impact", "merge", *folders], cwd=tmp_path / "two", check=True)
    assert content(tmp_path / "two") == content(tmp_path / "one")
