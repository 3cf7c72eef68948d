"""`impact sweep` tells what it will take, how far it is and what came out, and stores it as it was asked to."""

from __future__ import annotations

import json
import os
import pickle
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.api import execute, prepare
from impact.cli.progress import line, new_bar, update
from impact.engine.execute import context_of, integrate_ranges, integrate_remotely
from impact.engine.executors import SERIAL, Backend, choose_backend
from impact.engine.progress import Progress
from impact.engine.trajectories import columns_of, trajectory_maps, trajectory_ranges
from impact.errors import ConfigError, StoreError, UsageError
from impact.results.summary import summarize
from impact.results.sweep import find_finished, sweep_into

from .conftest import ROOT, WIDE, Run
from .fork_server import ForkServer, printed_on_terminal

# more than one block, and done in a second
BLOCKS = """models = ["bilinear", "hertz"]
[sweep]
e = { linspace = [0.0, 1.0, 40000] }
v1 = 1.0
m1 = [1.0, 2.0]
m2 = 1.0
material = "a"
[materials.a]
E = 56e9
nu = 0.3
rho = 2712
[solver]
rtol = 1e-4
"""


# of which a sweep takes two seconds
THREE = 'models=["bilinear", "gharib-hurmuzlu-2012", "lankarani-nikravesh-1990"]'
# progress is shown from the beginning, not after a second
AT_ONCE = "from impact.cli import progress\nprogress.FIRST_S = 0.0"
MINE = """import impact
MINE = impact.hysteresis("mine", title="", year=2026, equation="", reference="", chi=lambda e: 1 - e)
"""


@pytest.fixture
def blocks(tmp_path: Path) -> Path:
    path = tmp_path / "blocks.toml"
    path.write_text(BLOCKS, encoding="utf-8")
    return path


# ---- what it will take


def test_a_dry_run_tells_what_a_sweep_takes_and_writes_nothing(cli: Run, blocks: Path) -> None:
    told = cli("sweep", blocks, "--dry-run", cwd=blocks.parent)
    assert (told.returncode, told.stderr) == (0, "")
    lines = [line.split() for line in told.stdout.splitlines()]
    assert lines[1] == ["bilinear", "80,000", "40,000", "40,000", "depends", "on", "e"]
    assert lines[2] == ["hertz", "80,000", "1", "1", "depends", "on", "no", "axis"]
    assert "160,000 points from 40,001 trajectories, " in told.stdout
    assert [one.name for one in blocks.parent.iterdir()] == ["blocks.toml"]
    found = json.loads(cli("sweep", blocks, "--dry-run", "--json", cwd=blocks.parent).stdout)
    cli("sweep", blocks, "--quiet", cwd=blocks.parent)
    result = impact.load(blocks.parent / "results.h5")
    assert found["bytes"] == result.nbytes
    assert found["points"] == result["status"].size
    assert found["seconds"] > 0.0


def test_a_dry_run_tells_what_goes_over_the_wire_and_how_many_workers_are_of_use(cli: Run, blocks: Path) -> None:
    words = ("sweep", blocks, "--dry-run", "--set", "solver.collapse=false", "--set", 'solver.core="numpy"')
    larger = [word for name in ("v1", "m1") for word in ("--set", f"sweep.{name}.linspace=[1,2,100]")]
    line = cli(*words, *larger, cwd=blocks.parent).stdout.splitlines()[-1]
    counts = r"(about \d+:\d\d:\d\d by \d+(, | workers)){2,}"
    assert re.fullmatch(rf"on a cluster: [\d,]+ bytes over the wire; {counts}; more are of no use", line), line
    # of a short sweep nothing is printed about a cluster
    assert "cluster" not in cli(*words, cwd=blocks.parent).stdout
    found = json.loads(cli(*words, "--json", cwd=blocks.parent).stdout)
    plan = prepare(blocks, ["solver.collapse=false", 'solver.core="numpy"'])
    maps = trajectory_maps(plan)
    sent = 0
    for part in trajectory_ranges(maps):
        columns, context = columns_of(plan, maps, part), context_of(plan)
        sent += len(pickle.dumps((columns, context)))
        sent += len(pickle.dumps(integrate_remotely(plan.models[part.model].key, columns, context)))
    # one range is weighed for all
    assert found["wire"] == pytest.approx(sent, rel=0.1)
    seconds = {int(count): time for count, time in found["by_workers"].items()}
    assert list(seconds) == sorted(seconds)
    assert found["seconds"] == seconds[1] == max(seconds.values())


def test_a_dry_run_says_where_equal_values_are_not_looked_for(cli: Run, blocks: Path) -> None:
    each = cli("sweep", blocks, "--dry-run", "--set", "solver.collapse=false", cwd=blocks.parent)
    assert "160,000 points from 160,000 trajectories" in each.stdout
    assert "every point is integrated (solver.collapse = false)" in each.stdout
    # e = 1 - alpha v0 has a cell for each pair, in which a law without e does not share
    pairs = BLOCKS.replace("e = { linspace = [0.0, 1.0, 40000] }", "alpha = { linspace = [0.0, 0.1, 2100] }")
    pairs = pairs.replace("v1 = 1.0", "v1 = { linspace = [1.0, 2.0, 2100] }")
    (blocks.parent / "pairs.toml").write_text(pairs, encoding="utf-8")
    told = cli("sweep", "pairs.toml", "--dry-run", cwd=blocks.parent)
    assert "4,410,000" in told.stdout.splitlines()[1]
    assert told.stdout.splitlines()[2].split()[:4] == ["hertz", "8,820,000", "1", "1"]
    assert "too many cells to compare, equal ones are found within a block" in told.stdout


def test_too_many_points_are_refused_before_there_is_anything(forked: ForkServer, blocks: Path) -> None:
    grid = [f"sweep.{name}.geomspace=[1,2,10000]" for name in ("v1", "m1", "m2")]
    sets = [word for one in grid for word in ("--set", one)]
    count = "80,000,000,000,000,000"
    for change, message in (
        ('output.layout="full"', f"got {count} points (axes times models), up to 12,800,000,000 GB, expected at "
         'most 1,000,000,000 points in layout "full" (--max-points); layout = "factored" stores any number'),
        ("solver.collapse=false", f"got {count} trajectories to integrate, expected at most 1,000,000,000 "),
    ):  # fmt: skip
        done = forked("sweep", blocks, *sets, "--set", change, cwd=blocks.parent, limit=10.0)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
        assert f"sweep: {message}" in done.stderr
        assert done.memory < 300e6
    full = 'output.layout="full"'
    fewer = forked("sweep", blocks, "--max-points", "159999", "--set", full, cwd=blocks.parent)
    assert fewer.returncode == 2
    assert "got 160,000 points" in fewer.stderr
    assert [one.name for one in blocks.parent.iterdir()] == ["blocks.toml"]
    with pytest.raises(ConfigError, match="160,000 points"):
        impact.sweep(blocks, overrides=[full], max_points=79_999)


# ---- how far it is


def test_a_line_now_and_then_where_there_is_no_terminal(forked: ForkServer, blocks: Path) -> None:
    # one line after a second, and not one for each block
    done = forked("sweep", blocks, cwd=blocks.parent, code=AT_ONCE)
    lines = [line for line in done.stderr.splitlines() if line.startswith(("trajectories ", "points "))]
    assert 1 <= len(lines) <= 5
    number = r"[\d,]+"
    whole = rf"(trajectories {number} of 40,001 for 160,000 points|points {number} of 160,000)"
    assert all(re.fullmatch(rf"{whole}(, {number}/s, [\d:]+ left)?", line) for line in lines), lines
    assert "\x1b" not in done.stderr
    silent = forked("sweep", blocks, "--overwrite", "--quiet", cwd=blocks.parent, code=AT_ONCE)
    assert (silent.returncode, silent.stdout, silent.stderr) == (0, "", "")


def test_a_bar_on_a_terminal(forked: ForkServer, blocks: Path) -> None:
    done, printed = printed_on_terminal(forked, "sweep", blocks, stream="stderr", cwd=blocks.parent, code=AT_ONCE)
    assert done.returncode == 0, printed
    assert re.search(r"trajectories [\d,]+ of 40,001", printed)
    assert "━" in printed
    # it goes when it is done
    assert printed.rstrip().endswith("limit)")


def test_the_rate_of_what_was_resumed_is_that_of_this_run_and_is_not_guessed() -> None:
    now = 100.0
    bar = new_bar(lambda: now)

    def at(seconds: float, progress: Progress) -> str:
        nonlocal now
        now = seconds
        return line(update(bar, progress), progress.of_points)

    started = at(100.0, Progress(8_000, 10_000, 0, 50_000, 0))
    assert started == "trajectories 8,000 of 10,000 for 50,000 points"
    # what a tenth of a second says of the rest is worth nothing
    early = at(100.1, Progress(8_001, 10_000, 0, 50_000, 0))
    assert early == "trajectories 8,001 of 10,000 for 50,000 points"
    later = at(110.0, Progress(9_000, 10_000, 0, 50_000, 2))
    assert later == "trajectories 9,000 of 10,000 for 50,000 points, 100/s, 0:00:10 left, 2 failed"
    at(120.0, Progress(10_000, 10_000, 0, 50_000, 2))
    assert at(121.0, Progress(10_000, 10_000, 10_000, 50_000, 9)) == "points 10,000 of 50,000, 9 failed"


# ---- what came out


def test_a_failed_point_comes_with_the_command_that_repeats_it(cli: Run, tmp_path: Path) -> None:
    text = WIDE.replace("e = [0.2, 0.6, 1.0]", "alpha = [0.1, 0.3, 0.5]").replace('"bilinear", ', "")
    (tmp_path / "wide.toml").write_text(text, encoding="utf-8")
    done = cli("sweep", "wide.toml", "--json", cwd=tmp_path)
    assert done.returncode == 3
    found = json.loads(done.stdout)
    first = found["first_failed"][0]
    assert first["at"]["model"] == "lankarani-nikravesh-1990"
    words = shlex.split(first["replay"])
    again = cli(*words[1:], "--json", cwd=tmp_path)
    assert again.returncode == 3
    assert json.loads(again.stdout)["outputs"]["status"] == first["status"]
    assert f"  {first['replay']}" in done.stderr
    assert found["trajectories"] == 1 + len(np.unique(impact.load(tmp_path / "results.h5")["e"]).tolist()) + 2


def test_what_is_held_is_counted_in_parts_as_in_memory(blocks: Path) -> None:
    plan = prepare(blocks)
    output = blocks.parent / "results.h5"
    swept = sweep_into(output, plan)
    found = find_finished(output, plan)
    assert found is not None
    assert found.summary == swept.summary == summarize(impact.load(output))
    assert found.trajectories == swept.trajectories == 40_001
    assert find_finished(output, prepare(blocks, ["sweep.v1=2"])) is None
    with output.open("r+b") as file:
        file.seek(-1_000, os.SEEK_END)
        byte = file.read(1)
        file.seek(-1_000, os.SEEK_END)
        file.write(bytes([byte[0] ^ 1]))
    assert find_finished(output, plan) is None


# ---- several processes


def test_several_processes_give_the_same_content(blocks: Path) -> None:
    one = impact.sweep(blocks)
    assert impact.sweep(blocks, jobs=2).identical(one)
    paths = [blocks.parent / f"{name}.h5" for name in ("one", "two")]
    for path, backend in zip(paths, (SERIAL, choose_backend(jobs=2)), strict=True):
        sweep_into(path, prepare(blocks), backend=backend)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_plug_in_goes_to_every_process_and_a_python_value_cannot(blocks: Path, cli: Run) -> None:
    (blocks.parent / "mine.py").write_text(MINE, encoding="utf-8")
    words = ["sweep", blocks, "--plugin", "mine.py", "--set", "models=['mine']", "--quiet"]
    assert cli(*words, "--jobs", 2, "-o", "two.h5", cwd=blocks.parent).returncode == 0
    assert cli(*words, "-o", "one.h5", cwd=blocks.parent).returncode == 0
    one, two = (impact.load(blocks.parent / f"{name}.h5") for name in ("one", "two"))
    assert one.identical(two)
    mine = impact.hysteresis("mine", title="", year=2026, equation="", reference="", chi=lambda e: 1 - e)
    with pytest.raises(UsageError, match="mine is given as a Python value"):
        impact.sweep(blocks, overrides=["models=['mine']"], plugins=[mine], jobs=2)


def test_a_plug_in_that_is_changed_while_the_sweep_runs_is_what_it_was(blocks: Path) -> None:
    path = blocks.parent / "mine.py"
    path.write_text(MINE, encoding="utf-8")
    plan = prepare(blocks, ["models=['mine']"], [path])
    path.write_text("raise SystemExit", encoding="utf-8")
    assert execute(plan, choose_backend(jobs=2)).identical(execute(plan))


@pytest.mark.slow
def test_any_executor_integrates(blocks: Path) -> None:
    one = impact.sweep(blocks)
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2, get_context("spawn")) as processes:
        for executor in (threads, processes):
            assert impact.sweep(blocks, executor=executor).identical(one)
        # it is not shut down
        assert threads.submit(len, "abc").result() == 3
    with pytest.raises(UsageError, match="got jobs = 2 and an executor, expected one of them"):
        impact.sweep(blocks, jobs=2, executor=threads)


def test_no_more_blocks_are_given_than_there_is_room_for(blocks: Path) -> None:
    waiting, most = set[Future[object]](), 0

    class Counting(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            nonlocal most
            future = super().submit(fn, *args, **kwargs)
            waiting.add(future)
            most = max(most, len(waiting))
            return future

    plan = prepare(blocks, ["models=['bilinear']", "sweep.m1=1.0", "sweep.e.linspace=[0,1,3000]"])
    maps = trajectory_maps(plan)
    todo = list(trajectory_ranges(maps, 25))
    with Counting(2) as executor:
        backend = Backend(lambda: nullcontext(executor), lambda: 5, shares_memory=True)
        for _ in integrate_ranges(plan, maps, todo, backend=backend):
            waiting -= {future for future in waiting if future.done()}
    assert len(todo) > 100
    assert most == 5


def test_an_executor_that_stays_broken_is_told() -> None:
    class Broken(Executor):
        def submit(self, fn: object, /, *args: object, **kwargs: object) -> Future[object]:  # type: ignore[override]
            raise BrokenExecutor

    with pytest.raises(StoreError, match="killed 4 times"):
        impact.sweep(ROOT / "configs" / "figure6.toml", executor=Broken())


def _changed(**arrays: Any) -> Callable[[Any], Any]:
    return lambda done: (
        replace(done[0], **{name: change(getattr(done[0], name)) for name, change in arrays.items()}),
        done[1],
    )


ODD_BLOCKS = {
    "e_out: got float64 of shape (300,)": _changed(e_out=lambda values: values[:-1]),
    "peak: got float64 of shape (301, 1)": _changed(peak=lambda values: values[:, None]),
    "approach_work: got float32 of shape (301,)": _changed(approach_work=lambda values: values.astype(np.float32)),
    "steps: got list": _changed(steps=lambda values: values.tolist()),
    "status: got 77, expected one of": _changed(status=lambda values: np.full_like(values, 77)),
    "got NoneType, expected CollisionResult": lambda done: None,
    "got list, expected a dict of errors": lambda done: (done[0], []),
}


@pytest.mark.parametrize("message", ODD_BLOCKS)
def test_what_an_executor_returns_is_checked(message: str) -> None:
    class Odd(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            return super().submit(lambda: ODD_BLOCKS[message](fn(*args, **kwargs)))

    point = {"e": {"linspace": [0.1, 1.0, 301]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    with Odd(1) as executor, pytest.raises(StoreError, match=re.escape(message)):
        impact.sweep({"models": "gharib-hurmuzlu-2012", "sweep": point}, executor=executor)


@pytest.mark.slow
def test_nobody_who_listens_is_no_reason_to_stop(blocks: Path) -> None:
    words = f"'{sys.executable}' -m impact sweep blocks.toml --set '{THREE}' --set solver.rtol=1e-10"
    command = f"{words} 2>&1 >/dev/null | head -c 1 >/dev/null; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", command], cwd=blocks.parent, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert impact.load(blocks.parent / "results.h5").sizes["model"] == 3


# ---- how it is stored

STORED = {
    "as it is": ([], None, "f8"),
    "in fewer digits": (["output.dtype='float32'"], None, "f4"),
    "packed": (["output.compression='gzip'"], (1, 3, 2, 2, 2, 2), "f8"),
    "in chunks": (["output.chunks={e=2, m1=1}"], (1, 2, 2, 1, 2, 2), "f8"),
    "packed in chunks": (["output.compression='gzip'", "output.chunks.v1=1"], (1, 3, 1, 2, 2, 2), "f8"),
}


@pytest.mark.parametrize("name", STORED)
def test_stored_as_it_was_asked_to(wide: xr.Dataset, tmp_path: Path, name: str) -> None:
    overrides, chunks, dtype = STORED[name]
    (tmp_path / "wide.toml").write_text(WIDE, encoding="utf-8")
    plan = prepare(tmp_path / "wide.toml", overrides)
    swept = sweep_into(tmp_path / "wide.h5", plan)
    with h5py.File(tmp_path / "wide.h5") as file:
        stored = file["v1_post"]
        packed = "output.compression='gzip'" in overrides
        assert (stored.chunks, stored.dtype) == (chunks, dtype)
        assert stored.compression == ("gzip" if packed else None)
        assert (stored.id.get_storage_size() < stored.nbytes) == packed
        by_h5py = stored[()]
    loaded = impact.load(tmp_path / "wide.h5")
    # the result in memory makes the same file
    impact.save(
        impact.sweep(tmp_path / "wide.toml", overrides=overrides), tmp_path / "saved.h5", output=plan.config.output
    )
    assert (tmp_path / "saved.h5").read_bytes() == (tmp_path / "wide.h5").read_bytes()
    assert loaded.identical(impact.sweep(tmp_path / "wide.toml", overrides=overrides))
    assert loaded["v1_post"].values.tobytes() == by_h5py.tobytes()
    with xr.open_dataset(tmp_path / "wide.h5", engine="h5netcdf") as opened:
        assert opened.load().drop_encoding().equals(loaded)
    assert loaded["status"].dtype == np.int8
    assert loaded["e"].dtype == np.float64
    # how it is stored is no difference to what it is
    assert impact.compare(loaded, wide).equal
    assert find_finished(tmp_path / "wide.h5", plan).summary == swept.summary


def test_what_half_the_digits_lose_is_no_difference_and_more_is(wide: xr.Dataset) -> None:
    short = wide.copy()
    for name, one in wide.data_vars.items():
        if one.dtype == np.float64:
            short[name] = one.astype(np.float32).assign_attrs(one.attrs)
    assert impact.compare(short, wide).equal
    assert impact.compare(wide, short).equal
    moved = short.copy(deep=True)
    moved["v1_post"][0, 1, 1, 1, 0, 0] *= np.float32(1.0 + 4e-7)
    assert not impact.compare(moved, wide).equal


REFUSED = {
    "dtype": ("float16", 'output.dtype: got "float16", expected one of float64, float32'),
    "compression": ("zip", 'output.compression: got "zip", expected one of none, gzip'),
    "chunks": (3, "output.chunks: got 3, expected a table of lengths by axis, such as { e = 50 }"),
    "chunks.e": (0, "output.chunks.e: got 0, expected a whole number from 1 to 10,000,000"),
    "chunks.m2": (2, "output.chunks.m2: no axis of this sweep; known: e, m1"),
    "chunks.m1": (1, None),
}


@pytest.mark.parametrize("key", REFUSED)
def test_how_it_cannot_be_stored(blocks: Path, key: str) -> None:
    value, message = REFUSED[key]
    override = f"output.{key}={json.dumps(value)}"
    if message is None:
        assert prepare(blocks, [override]).config.output.chunks == {"m1": 1}
        return
    with pytest.raises(ConfigError) as refused:
        prepare(blocks, [override])
    (line,) = refused.value.problems
    assert line.endswith(message)


def test_chunks_that_are_too_many_or_too_large(blocks: Path) -> None:
    with pytest.raises(ConfigError, match=r"got 1,600,000 chunks of 2 points, expected at most 100,000 of"):
        prepare(blocks, ["output.chunks.e=1"])
    with pytest.raises(ConfigError, match=r"got 80 chunks of 10,000,000 points"):
        prepare(blocks, ["output.chunks.m1=1", "sweep.v1={linspace=[1,2,250]}"])


def test_what_packs_very_well_is_read_again(tmp_path: Path) -> None:
    config = {
        "models": ["hertz"], "output": {"variables": ["e_out", "status"], "compression": "gzip"},
        "sweep": {"v1": {"linspace": [1, 2, 4_000]}, "m1": {"linspace": [1, 2, 2_500]}, "m2": 1, "K": 1e9},
    }  # fmt: skip
    swept = sweep_into(tmp_path / "flat.h5", prepare(config))
    assert (tmp_path / "flat.h5").stat().st_size < swept.dataset.nbytes / 300
    with impact.load(tmp_path / "flat.h5") as loaded:
        assert loaded["e_out"].min() == loaded["e_out"].max() > 0.999
