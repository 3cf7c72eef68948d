"""`impact sweep` estimates its cost, reports progress and failed points, and stores a result in any format."""

from __future__ import annotations

import json
import os
import pickle
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.engine.execute import context_of, integrate_ranges, integrate_remotely
from impact.engine.executors import SERIAL, ExecutorSpec, choose_executor
from impact.engine.run import Progress, Run as SweepRun
from impact.engine.trajectories import trajectory_ranges
from impact.errors import ConfigError, StoreError, UsageError
from impact.progress_display import line, new_bar, update
from impact.results.summary import summarize
from impact.results.sweep import read_plan, sweep_in_memory, sweep_into
from impact.results.xarray_backend import save

from .conftest import PLUGIN, ROOT, WIDE, Run
from .fork_server import ForkServer, printed_on_terminal

# several blocks, integrated in less than a second
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


# enough models for a sweep of two seconds
THREE_MODELS = 'models=["bilinear", "gharib-hurmuzlu-2012", "lankarani-nikravesh-1990"]'
# progress is shown from the start, not after a second
SHOW_PROGRESS_AT_ONCE = "from impact import progress_display\nprogress_display.FIRST_S = 0.0"


@pytest.fixture
def blocks(tmp_path: Path) -> Path:
    """The path of a config whose trajectories fill several blocks."""
    path = tmp_path / "blocks.toml"
    path.write_text(BLOCKS, encoding="utf-8")
    return path


# ---- dry run


@pytest.mark.slow
def test_a_dry_run_prints_counts_size_and_time_and_writes_nothing(cli: Run, blocks: Path) -> None:
    completed = cli("sweep", blocks, "--dry-run", cwd=blocks.parent)
    assert (completed.returncode, completed.stderr) == (0, "")
    rows = [line.split() for line in completed.stdout.splitlines()]
    assert rows[1] == ["bilinear", "80,000", "40,000", "40,000", "depends", "on", "e"]
    assert rows[2] == ["hertz", "80,000", "1", "1", "depends", "on", "no", "axis"]
    assert "160,000 points from 40,001 trajectories, " in completed.stdout
    few = "sweep.e.linspace=[0,1,100]"
    estimate = json.loads(cli("sweep", blocks, "--dry-run", "--json", "--set", few, cwd=blocks.parent).stdout)
    assert [path.name for path in blocks.parent.iterdir()] == ["blocks.toml"]
    result = impact.sweep(blocks, output=blocks.parent / "results.h5", overrides=[few])
    assert estimate["bytes"] == result.nbytes
    assert estimate["points"] == result["status"].size
    assert estimate["seconds"] > 0.0


@pytest.mark.slow
def test_a_dry_run_estimates_transferred_bytes_and_the_useful_number_of_workers(cli: Run, blocks: Path) -> None:
    # two blocks of each model
    overrides = ["solver.collapse=false", 'solver.core="numpy"', "sweep.e.linspace=[0,1,17000]"]
    words = ["sweep", blocks, "--dry-run", *(word for override in overrides for word in ("--set", override))]
    larger = [word for name in ("v1", "m1") for word in ("--set", f"sweep.{name}.linspace=[1,2,150]")]
    # long times wrap the line
    printed = " ".join(cli(*words, *larger, "--scheduler", "tcp://none:1", cwd=blocks.parent).stdout.split())
    counts = r"(about \d+:\d\d:\d\d by \d+(; | workers)){2,}"
    pattern = rf"dask workers: {counts}, the most that can be kept busy; [\d,]+ bytes are sent to them and back"
    assert re.search(f"{pattern}$", printed), printed
    # a sweep on this machine has no such line
    assert "workers" not in cli(*words, *larger, cwd=blocks.parent).stdout
    estimate = json.loads(cli(*words, "--json", cwd=blocks.parent).stdout)
    plan = read_plan(blocks, overrides)
    ranges = plan.ranges
    assert [part.size for part in ranges] == [17_000] * 4
    transferred = 0
    for part in ranges:
        columns, context = plan.columns_of(part), context_of(plan)
        transferred += len(pickle.dumps((columns, context)))
        transferred += len(pickle.dumps(integrate_remotely([plan.models[part.model].key], columns, context)))
    # the estimate measures one range only
    assert estimate["wire"] == pytest.approx(transferred, rel=0.1)
    seconds = {int(count): time for count, time in estimate["by_workers"].items()}
    assert list(seconds) == sorted(seconds)
    assert estimate["seconds"] == seconds[1] == max(seconds.values())


@pytest.mark.parametrize(
    ("name", "code", "word"), [("SIGINT", 130, "interrupted"), ("SIGTERM", 143, "terminated")]
)
def test_a_dry_run_that_a_signal_reaches_exits_as_an_interrupted_command(
    forked: ForkServer, blocks: Path, name: str, code: int, word: str
) -> None:
    # the signal comes when the estimate reads the plug-in
    plugin = blocks.parent / "plugin.py"
    plugin.write_text(
        f"import signal\nsignal.raise_signal(signal.{name})\n" + PLUGIN.format(chi="1 - e"), encoding="utf-8"
    )
    words = ("sweep", blocks, "--plugin", plugin, "--dry-run", "--set", "sweep.e=0.5")
    done = forked(*words, cwd=blocks.parent)
    assert (done.returncode, done.stderr) == (code, f"{word}; nothing was written\n")
    assert {path.name for path in blocks.parent.iterdir()} == {"blocks.toml", "plugin.py"}


@pytest.mark.slow
def test_a_dry_run_reports_where_trajectories_are_not_deduplicated(cli: Run, blocks: Path) -> None:
    words = ("sweep", "--dry-run", "--set", 'solver.core="numpy"')
    every_point = cli(*words, blocks, "--set", "solver.collapse=false", cwd=blocks.parent).stdout
    assert "160,000 points from 160,000 trajectories" in every_point
    assert "every point is integrated (solver.collapse = false)" in every_point
    # e = 1 - alpha v0 differs between all cells; cells of a law without e share a trajectory
    pairs = BLOCKS.replace("e = { linspace = [0.0, 1.0, 40000] }", "alpha = { linspace = [0.0, 0.1, 2100] }")
    pairs = pairs.replace("v1 = 1.0", "v1 = { linspace = [1.0, 2.0, 2100] }")
    (blocks.parent / "pairs.toml").write_text(pairs, encoding="utf-8")
    printed = cli(*words, "pairs.toml", cwd=blocks.parent).stdout
    assert "4,410,000" in printed.splitlines()[1]
    assert printed.splitlines()[2].split()[:4] == ["hertz", "8,820,000", "1", "1"]
    assert "too many cells to compare all, equal points are searched for within a block" in printed


def test_a_dry_run_refuses_what_the_sweep_refuses(forked: ForkServer, blocks: Path) -> None:
    name = ("--set", 'materials={"a b"={E=[1e9, 2e9], nu=0.3, rho=2712}}', "--set", 'sweep.material="a b"')
    messages = {forked("sweep", blocks, *name, *dry, cwd=blocks.parent).stderr for dry in ((), ("--dry-run",))}
    assert messages == {"materials.a b.E: expected a material name without spaces and slashes, to be an axis\n"}


def test_too_many_points_are_refused_before_memory_or_a_file_is_used(forked: ForkServer, blocks: Path) -> None:
    grid = [f"sweep.{name}.geomspace=[1,2,10000]" for name in ("v1", "m1", "m2")]
    sets = [word for override in grid for word in ("--set", override)]
    count = "80,000,000,000,000,000"
    full = 'output.layout="full"'
    messages = {
        full: f"got {count} points (axes times models), up to 12,800,000,000 GB, expected at most 1,000,000,000 "
        'points in layout "full" (--max-points); layout = "factored" stores any number',
        "solver.collapse=false": f"got {count} trajectories to integrate, expected at most 1,000,000,000 ",
    }
    for override, message in messages.items():
        completed = forked("sweep", blocks, *sets, "--set", override, cwd=blocks.parent, limit=10.0)
        assert (completed.returncode, len(completed.stderr.splitlines())) == (2, 1)
        assert completed.stderr.startswith(f"{blocks}:")
        assert f"sweep: {message}" in completed.stderr
        assert completed.memory < 300e6
    completed = forked("sweep", blocks, "--max-points", "159999", "--set", full, cwd=blocks.parent)
    assert completed.returncode == 2
    assert "got 160,000 points" in completed.stderr
    assert [path.name for path in blocks.parent.iterdir()] == ["blocks.toml"]
    with pytest.raises(ConfigError, match="160,000 points"):
        impact.sweep(blocks, overrides=[full], max_points=79_999)


def test_few_trajectories_are_limited_as_well() -> None:
    config = {
        "models": "tsuji-1992",
        "frictions": ["coulomb-1785", "cundall-strack-1979"],
        "sweep": {"e": [0.5, 0.9], "v1": 1.0, "u1": 0.3, "m1": 1.0, "m2": np.inf, "R1": 0.1, "K": 6e9, "mu": 0.3},
        "friction": {"cundall-strack-1979": {"kt_over_kn": 0.8}},
    }
    with pytest.raises(UsageError, match="got 6 trajectories to integrate, expected at most 5"):
        impact.sweep(config, max_points=5)
    assert impact.sweep(config, max_points=6).sizes["e"] == 2


# ---- progress


@pytest.mark.slow
def test_progress_lines_without_a_terminal(forked: ForkServer, blocks: Path) -> None:
    completed = forked("sweep", blocks, cwd=blocks.parent, code=SHOW_PROGRESS_AT_ONCE)
    lines = [line for line in completed.stderr.splitlines() if line.startswith(("trajectories ", "points "))]
    # a line per second, not per block
    assert 1 <= len(lines) <= 5
    number = r"[\d,]+"
    counts = rf"(trajectories {number} of 40,001 for 160,000 points|points {number} of 160,000)"
    assert all(re.fullmatch(rf"{counts}(, {number}/s, [\d:]+ left)?", line) for line in lines), lines
    assert "\x1b" not in completed.stderr
    quiet = forked("sweep", blocks, "--overwrite", "--quiet", cwd=blocks.parent, code=SHOW_PROGRESS_AT_ONCE)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")


@pytest.mark.slow
def test_a_progress_bar_on_a_terminal(forked: ForkServer, blocks: Path) -> None:
    completed, printed = printed_on_terminal(
        forked, "sweep", blocks, stream="stderr", cwd=blocks.parent, code=SHOW_PROGRESS_AT_ONCE
    )
    assert completed.returncode == 0, printed
    assert re.search(r"trajectories [\d,]+ of 40,001", printed)
    assert "━" in printed
    # the bar disappears at the end
    assert printed.rstrip().endswith("limit)")


@pytest.mark.slow
def test_a_sensitivity_study_shows_its_progress_unless_it_is_quiet(forked: ForkServer, tmp_path: Path) -> None:
    balls = "v1.uniform = [1, 2]\ne = 0.5\nm1 = 1\nm2 = 1\nK = 1e6\n"
    text = f'models = ["hertz", "tsuji-1992"]\ndesign.n = 2\n[sweep]\n{balls}'
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    for words, is_shown in (((), True), (("--quiet",), False)):
        done = forked("sensitivity", "c.toml", *words, cwd=tmp_path, code=SHOW_PROGRESS_AT_ONCE)
        assert done.returncode == 0
        assert ("trajectories " in done.stderr) is is_shown


def test_the_rate_of_a_resumed_sweep_counts_this_run_only_and_is_not_extrapolated_from_an_instant() -> None:
    now = 100.0
    bar = new_bar(lambda: now)

    def at(seconds: float, progress: Progress) -> str:
        nonlocal now
        now = seconds
        return line(update(bar, progress), progress.of_points)

    started = at(100.0, Progress(8_000, 10_000, 0, 50_000, 0))
    assert started == "trajectories 8,000 of 10,000 for 50,000 points"
    # a tenth of a second is too short for an estimate
    early = at(100.1, Progress(8_001, 10_000, 0, 50_000, 0))
    assert early == "trajectories 8,001 of 10,000 for 50,000 points"
    later = at(110.0, Progress(9_000, 10_000, 0, 50_000, 2))
    assert later == "trajectories 9,000 of 10,000 for 50,000 points, 100/s, 0:00:10 left, 2 failed"
    at(120.0, Progress(10_000, 10_000, 0, 50_000, 2))
    assert at(121.0, Progress(10_000, 10_000, 10_000, 50_000, 9)) == "points 10,000 of 50,000, 9 failed"


# ---- failed points and finished files


@pytest.mark.slow
def test_a_failed_point_is_reported_with_the_command_that_repeats_it(cli: Run, tmp_path: Path) -> None:
    text = WIDE.replace("e = [0.2, 0.6, 1.0]", "alpha = [0.1, 0.3, 0.5]").replace('"bilinear", ', "")
    (tmp_path / "wide.toml").write_text(f"{text}[solver]\nrtol = 1e-4\n", encoding="utf-8")
    completed = cli("sweep", "wide.toml", "--json", cwd=tmp_path)
    assert completed.returncode == 3
    summary = json.loads(completed.stdout)
    failed = summary["first_failed"][0]
    assert failed["at"]["model"] == "lankarani-nikravesh-1990"
    replay = cli(*shlex.split(failed["replay"])[1:], "--json", cwd=tmp_path)
    assert replay.returncode == 3
    assert json.loads(replay.stdout)["outputs"]["status"] == failed["status"]
    assert f"  {failed['replay']}" in completed.stderr
    values_of_e = np.unique(impact.load(tmp_path / "results.h5")["e"])
    assert summary["trajectories"] == 1 + values_of_e.size + 2


def test_a_repeated_sweep_names_the_same_failed_points(cli: Run, tmp_path: Path) -> None:
    # the three masses of ball 2 share a trajectory that fails
    text = """models = "tsuji-1992"
sweep = { e = [0.1, 0.6], v1 = 1.0, m1 = 1.0, m2 = [1.0, 2.0, 3.0], K = 1e6 }
solver = { max_steps = 46, rtol = 1e-8 }
output.layout = "factored"
"""
    (tmp_path / "c.toml").write_text(text, encoding="utf-8")
    first, again = (json.loads(cli("sweep", "c.toml", "--json", cwd=tmp_path).stdout) for _ in range(2))
    assert first == again
    assert first["failed"] == 3
    assert [failure["at"]["e"] for failure in first["first_failed"]] == [0.1]


@pytest.mark.slow
def test_only_the_undamaged_result_of_the_same_sweep_is_recognized_as_finished(blocks: Path) -> None:
    output = blocks.parent / "results.h5"
    swept = impact.sweep_to_file(blocks, output)
    finished = impact.sweep_to_file(blocks, output)
    assert (swept.is_new, finished.is_new) == (True, False)
    # a sweep counts its points slab by slab
    assert finished.summary == swept.summary == summarize(impact.load(output))
    assert finished.trajectories == swept.trajectories == 40_001
    with pytest.raises(UsageError, match="exists"):
        impact.sweep_to_file(blocks, output, overrides=["sweep.v1=2"])
    with output.open("r+b") as file:
        file.seek(-1_000, os.SEEK_END)
        byte = file.read(1)
        file.seek(-1_000, os.SEEK_END)
        file.write(bytes([byte[0] ^ 1]))
    with pytest.raises(UsageError, match="exists"):
        impact.sweep_to_file(blocks, output)


# ---- processes and other executors


@pytest.mark.slow
def test_two_processes_with_a_plug_in_write_the_same_bytes_as_one(blocks: Path) -> None:
    plugin = blocks.parent / "plugin.py"
    plugin.write_text(PLUGIN.format(chi="1 - e"), encoding="utf-8")
    overrides = ["models=['mine-2026', 'bilinear']", "output.variables=['e_out', 'contact_time', 'status']"]
    plan = read_plan(blocks, overrides, [plugin])
    # every process uses the source that was read at the start
    plugin.write_text("raise SystemExit", encoding="utf-8")
    paths = [blocks.parent / name for name in ("serial.h5", "parallel.h5")]
    for path, executor in zip(paths, (SERIAL, choose_executor(jobs=2)), strict=True):
        sweep_into(path, plan, SweepRun(executor))
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert impact.load(paths[1]).identical(sweep_in_memory(plan))


@pytest.mark.slow
def test_jobs_on_the_command_line_and_in_python_change_no_value(blocks: Path, cli: Run) -> None:
    plugin = blocks.parent / "plugin.py"
    plugin.write_text(PLUGIN.format(chi="1 - e"), encoding="utf-8")
    words = ["sweep", blocks, "--plugin", plugin, "--set", "models=['mine-2026']", "--quiet"]
    assert cli(*words, "--jobs", 2, "-o", "parallel.h5", cwd=blocks.parent).returncode == 0
    assert cli(*words, "-o", "serial.h5", cwd=blocks.parent).returncode == 0
    serial, parallel = (impact.load(blocks.parent / f"{name}.h5") for name in ("serial", "parallel"))
    assert serial.identical(parallel)
    assert impact.sweep(blocks, jobs=2).identical(impact.sweep(blocks))


def test_a_plug_in_given_as_a_python_value_cannot_be_sent_to_processes(blocks: Path) -> None:
    model = impact.hysteresis("mine", title="", year=2026, equation="", reference="", chi=lambda e: 1 - e)
    with pytest.raises(UsageError, match="mine is given as a Python value"):
        impact.sweep(blocks, overrides=["models=['mine']"], plugins=[model], jobs=2)


@pytest.mark.slow
def test_any_executor_integrates(blocks: Path) -> None:
    serial = impact.sweep(blocks)
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(2, get_context("spawn")) as processes:
        for executor in (threads, processes):
            assert impact.sweep(blocks, executor=executor).identical(serial)
        # it is not shut down
        assert threads.submit(len, "abc").result() == 3
    with pytest.raises(UsageError, match="got jobs = 2 and an executor, expected one of them"):
        impact.sweep(blocks, jobs=2, executor=threads)


@pytest.mark.slow
def test_an_executor_gets_no_more_blocks_than_its_capacity(blocks: Path) -> None:
    unfinished, largest = set[Future[object]](), 0

    class CountingExecutor(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            nonlocal largest
            future = super().submit(fn, *args, **kwargs)
            unfinished.add(future)
            largest = max(largest, len(unfinished))
            return future

    plan = read_plan(blocks, ["models=['bilinear']", "sweep.m1=1.0", "sweep.e.linspace=[0,1,1001]"])
    todo = list(trajectory_ranges(plan.maps, 10))
    with CountingExecutor(2) as executor:
        spec = ExecutorSpec(lambda: nullcontext(executor), lambda: 5, shares_memory=True)
        for _ in integrate_ranges(plan, todo, SweepRun(spec)):
            unfinished -= {future for future in unfinished if future.done()}
    assert len(todo) > 100
    assert largest == 5


def test_an_executor_that_stays_broken_is_reported() -> None:
    class BrokenExecutorStub(Executor):
        def submit(self, fn: object, /, *args: object, **kwargs: object) -> Future[object]:  # type: ignore[override]
            raise BrokenExecutor

    with pytest.raises(StoreError, match="killed 4 times"):
        impact.sweep(ROOT / "configs" / "figure6.toml", executor=BrokenExecutorStub())


def change_arrays(**changes: Any) -> Callable[[Any], Any]:
    """A function that changes some arrays of a returned block."""
    return lambda block: (
        replace(block[0], **{name: change(getattr(block[0], name)) for name, change in changes.items()}),
        block[1],
    )


INVALID_BLOCKS = {
    "e_out: got float64 of shape (300,)": change_arrays(e_out=lambda values: values[:-1]),
    "peak: got float64 of shape (301, 1)": change_arrays(peak=lambda values: values[:, None]),
    "approach_work: got float32 of shape (301,)": change_arrays(
        approach_work=lambda values: values.astype(np.float32)
    ),
    "steps: got list": change_arrays(steps=lambda values: values.tolist()),
    "status: got 77, expected one of": change_arrays(status=lambda values: np.full_like(values, 77)),
    "got NoneType, expected CollisionResult": lambda block: None,
    "got list, expected a dict of errors": lambda block: (block[0], []),
}


@pytest.mark.parametrize("message", INVALID_BLOCKS)
def test_a_block_that_an_executor_returns_is_validated(message: str) -> None:
    class ChangingExecutor(ThreadPoolExecutor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            return super().submit(lambda: INVALID_BLOCKS[message](fn(*args, **kwargs)))

    point = {"e": {"linspace": [0.1, 1.0, 301]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    config = {"models": "gharib-hurmuzlu-2012", "sweep": point, "solver": {"rtol": 1e-4}}
    with ChangingExecutor(1) as executor, pytest.raises(StoreError, match=re.escape(message)):
        impact.sweep(config, executor=executor)


@pytest.mark.slow
def test_a_closed_pipe_does_not_stop_a_sweep(blocks: Path) -> None:
    words = f"'{sys.executable}' -m impact sweep blocks.toml --set '{THREE_MODELS}' --set solver.rtol=1e-10"
    command = f"{words} 2>&1 >/dev/null | head -c 1 >/dev/null; exit ${{PIPESTATUS[0]}}"
    completed = subprocess.run(
        ["bash", "-c", command], cwd=blocks.parent, capture_output=True, text=True, check=False
    )
    assert (completed.returncode, completed.stderr) == (0, "")
    assert impact.load(blocks.parent / "results.h5").sizes["model"] == 3


# ---- storage format

# overrides, chunks and type of v1_post
FORMATS = {
    "default": ([], None, "f8"),
    "float32": (["output.dtype='float32'"], None, "f4"),
    "compressed": (["output.compression='gzip'"], (1, 3, 2, 2, 2, 2), "f8"),
    "chunked": (["output.chunks={e=2, m1=1}"], (1, 2, 2, 1, 2, 2), "f8"),
    "compressed and chunked": (["output.compression='gzip'", "output.chunks.v1=1"], (1, 3, 1, 2, 2, 2), "f8"),
}


@pytest.fixture(scope="module")
def four_axes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, xr.Dataset]:
    """A config with four axes, a zip group and a parameter of a model, and its result."""
    path = tmp_path_factory.mktemp("four_axes") / "wide.toml"
    path.write_text(WIDE.replace('"lankarani-nikravesh-1990", "bilinear", ', ""), encoding="utf-8")
    return path, impact.sweep(path)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name != "default")) for name in FORMATS],
)
def test_a_result_is_stored_in_the_format_of_its_config(
    four_axes: tuple[Path, xr.Dataset], tmp_path: Path, name: str
) -> None:
    overrides, chunks, dtype = FORMATS[name]
    config, reference = four_axes
    outcome = impact.sweep_to_file(config, tmp_path / "wide.h5", overrides=overrides)
    with h5py.File(tmp_path / "wide.h5") as file:
        stored = file["v1_post"]
        is_compressed = "output.compression='gzip'" in overrides
        assert (stored.chunks, stored.dtype) == (chunks, dtype)
        assert stored.compression == ("gzip" if is_compressed else None)
        assert (stored.id.get_storage_size() < stored.nbytes) == is_compressed
        read_by_h5py = stored[()]
    loaded = impact.load(tmp_path / "wide.h5")
    # a sweep in memory, saved afterwards, gives the same file
    in_memory = impact.sweep(config, overrides=overrides)
    save(in_memory, tmp_path / "saved.h5", output=read_plan(config, overrides).config.output)
    assert (tmp_path / "saved.h5").read_bytes() == (tmp_path / "wide.h5").read_bytes()
    assert loaded.identical(in_memory)
    assert loaded["v1_post"].values.tobytes() == read_by_h5py.tobytes()
    with xr.open_dataset(tmp_path / "wide.h5", engine="h5netcdf") as opened:
        assert opened.load().drop_encoding().equals(loaded)
    assert loaded["status"].dtype == np.int8
    assert loaded["e"].dtype == np.float64
    # the format does not count as a difference
    assert impact.compare(loaded, reference).equal
    assert impact.sweep_to_file(config, tmp_path / "wide.h5", overrides=overrides).summary == outcome.summary


def test_rounding_to_float32_is_within_tolerance_and_a_larger_change_is_not(
    four_axes: tuple[Path, xr.Dataset],
) -> None:
    _, reference = four_axes
    rounded = reference.copy()
    for name, values in reference.data_vars.items():
        if values.dtype == np.float64:
            rounded[name] = values.astype(np.float32).assign_attrs(values.attrs)
    assert impact.compare(rounded, reference).equal
    assert impact.compare(reference, rounded).equal
    changed = rounded.copy(deep=True)
    changed["v1_post"][0, 1, 1, 1, 0, 0] *= np.float32(1.0 + 4e-7)
    assert not impact.compare(changed, reference).equal


OUTPUT_VALUES = {
    "dtype": ("float16", 'output.dtype: got "float16", expected one of float64, float32'),
    "compression": ("zip", 'output.compression: got "zip", expected one of none, gzip'),
    "chunks": (3, "output.chunks: got 3, expected a table of lengths by axis, such as { e = 50 }"),
    "chunks.e": (0, "output.chunks.e: got 0, expected a whole number from 1 to 10,000,000"),
    "chunks.m2": (2, "output.chunks.m2: no axis of this sweep; known: e, m1"),
    "chunks.m1": (1, None),
}


@pytest.mark.parametrize("key", OUTPUT_VALUES)
def test_an_invalid_storage_format_is_refused(blocks: Path, key: str) -> None:
    value, message = OUTPUT_VALUES[key]
    override = f"output.{key}={json.dumps(value)}"
    if message is None:
        assert read_plan(blocks, [override]).config.output.chunks == {"m1": 1}
        return
    with pytest.raises(ConfigError) as refused:
        read_plan(blocks, [override])
    (line,) = refused.value.problems
    assert line.endswith(message)


def test_too_many_and_too_large_chunks_are_refused(blocks: Path) -> None:
    with pytest.raises(ConfigError, match=r"got 1,600,000 chunks of 2 points, expected at most 100,000 of"):
        read_plan(blocks, ["output.chunks.e=1"])
    with pytest.raises(ConfigError, match=r"got 80 chunks of 10,000,000 points"):
        read_plan(blocks, ["output.chunks.m1=1", "sweep.v1={linspace=[1,2,250]}"])


@pytest.mark.slow
def test_a_file_with_a_high_compression_ratio_can_be_read(tmp_path: Path) -> None:
    config = {
        "models": ["hertz"],
        "output": {"variables": ["e_out", "status"], "compression": "gzip", "layout": "full"},
        "sweep": {"v1": {"linspace": [1, 2, 4_000]}, "m1": {"linspace": [1, 2, 1_000]}, "m2": 1, "K": 1e9},
    }
    outcome = impact.sweep_to_file(config, tmp_path / "flat.h5")
    assert (tmp_path / "flat.h5").stat().st_size < outcome.dataset.nbytes / 300
    with impact.load(tmp_path / "flat.h5") as loaded:
        assert loaded["e_out"].min() == loaded["e_out"].max() > 0.999


@pytest.mark.slow
def test_an_executor_is_entered_only_if_there_is_something_to_integrate(tmp_path: Path) -> None:
    @contextmanager
    def refuse() -> Iterator[ExecutorSpec]:
        raise AssertionError("entered")
        yield SERIAL

    path, config = tmp_path / "r.h5", ROOT / "configs" / "figure6.toml"
    with pytest.raises(ConfigError):
        impact.sweep_to_file(config, path, overrides=["sweep.e=2.0"], backend=refuse())
    impact.sweep(config, output=path)
    assert not impact.sweep_to_file(config, path, backend=refuse()).is_new
    with pytest.raises(AssertionError, match="entered"):
        impact.sweep_to_file(config, path, overwrite=True, backend=refuse())
