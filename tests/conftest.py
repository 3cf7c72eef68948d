"""What several test files share: real child processes, and one small stored result."""

from __future__ import annotations

import gc
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator
from contextlib import contextmanager
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
import xarray as xr
from filelock import FileLock
from hypothesis import settings

import impact
from impact import formatting
from impact.conformance.engines.liggghts import ALONE
from impact.errors import ConfigError
from impact.exporters.programs import WITHOUT_DAEMON

from .clusters import ClusterServer, start_cluster_server
from .fork_server import CompletedCommand, ForkServer, end_servers_of_scripts, start_fork_server

if TYPE_CHECKING:
    from .faults import SweepServer

# jsonschema would build dozens of grammars of internationalized addresses, for seconds; no schema here has one
sys.modules.setdefault("rfc3987_syntax", None)  # type: ignore[arg-type]

# no test is about time
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

ROOT = Path(__file__).parent.parent
Run = Callable[..., CompletedCommand | subprocess.CompletedProcess[str]]

WIDE = """
title = "Four axes"
models = ["hertz", "lankarani-nikravesh-1990", "bilinear", "ismail-stronge-2008"]
[sweep]
e = [0.2, 0.6, 1.0]
v1 = [1.0, 2.0]
v2 = -1.0
m1 = [1.0, 3.0]
m2 = [1.0, inf]
zip = [["m1", "m2"]]
material1 = "soft"
material2 = ["soft", "hard"]
[materials.soft]
E = "2 GPa"
nu = 0.4
rho = 1000
[materials.hard]
E = 210e9
nu = 0.3
rho = 7850
[model.ismail-stronge-2008]
gamma = [1.5, 4.0]
"""


# the text of a plug-in with one law, for `format(chi=...)`
PLUGIN = """\
from impact import hysteresis

MINE = hysteresis("mine-2026", title="Mine", year=2026, equation="", reference="", chi=lambda e: {chi})
"""
CHI = "(1 - e * e) / e"
# a config with several points
CONTACT = """
models = ["hertz", "gharib-hurmuzlu-2012"]
[sweep]
e = [0.1, 0.5, 0.9]
v1 = 1.0
m1 = 1.0
m2 = 2.0
K = 6e9
"""


def new_law(key: str, force: Callable[..., Any], **fields: Any) -> impact.ForceModel:
    """Return a law without a source."""
    return impact.ForceModel(key, title=key, year=2026, equation="", reference="", force=force, **fields)


def problems_of(act: Callable[..., object], *arguments: Any, **options: Any) -> list[str]:
    """Return the lines with which a function refuses a config."""
    with pytest.raises(ConfigError) as caught:
        act(*arguments, **options)
    return list(caught.value.problems)


def one_line(words: str) -> str:
    """Return the pattern of a message that has these words and is one line."""
    return rf"\A[^\n]*{re.escape(words)}[^\n]*\Z"


def assert_refused(done: CompletedCommand | subprocess.CompletedProcess[str], words: str) -> None:
    """A command ended as after an invalid input, with one line that has these words."""
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done
    assert words in done.stderr


@contextmanager
def full_disk() -> Iterator[None]:
    """Limit the size of files, which stands for a full disk."""
    import resource
    import signal

    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)


def examples_of(page: str) -> list[tuple[str, str]]:
    """Return the commands of a page of this project, which may have several lines, and what they print there."""
    found = re.findall(r"\$ impact ((?:.*\\\n)*.*)\n((?:.*\n)+?)```", (ROOT / page).read_text(encoding="utf-8"))
    return [(re.sub(r"\\\n\s*", "", command), printed) for command, printed in found]


def code_blocks(page: str, language: str) -> list[str]:
    """The code blocks of a page in a language."""
    return re.findall(rf"```{re.escape(language)}\n(.*?)```", page, re.DOTALL)


def assert_same_bits(actual: xr.Dataset, expected: xr.Dataset, names: Iterable[Hashable] = ()) -> None:
    """The data variables of the expected dataset, or some of its variables, have the same axes, types and bits."""
    for name in names or expected.data_vars:
        assert_same_array(actual[name], expected[name])


def assert_same_array(actual: xr.DataArray, expected: xr.DataArray) -> None:
    assert (actual.dims, actual.shape, actual.dtype) == (expected.dims, expected.shape, expected.dtype), (
        actual.name
    )
    assert actual.values.tobytes() == expected.values.tobytes(), actual.name


NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")


def assert_same_output(printed: str, expected: str) -> None:
    """The words of two outputs are the same; numbers may differ by one in the last digit that is printed.

    The digits from the tenth on of a number that was solved for depend on the processor.
    """
    for line, other in zip(printed.splitlines(), expected.splitlines(), strict=True):
        assert NUMBER.sub("#", line).split() == NUMBER.sub("#", other).split()
        numbers, others = (map(Decimal, NUMBER.findall(text)) for text in (line, other))
        for number, wanted in zip(numbers, others, strict=True):
            last = Decimal(1).scaleb(int(wanted.as_tuple().exponent))
            assert abs(number - wanted) <= max(last, abs(wanted) * Decimal("1e-9")), (line, other)


def default_law(code: str) -> str:
    """The first law of a code to which laws are exported."""
    from impact.exporters.registry import CODES

    return next(iter(CODES[code].laws))


def write_program(path: Path, script: str) -> Path:
    """Write a shell script as a program, and return its path."""
    path.write_text(f"#!/bin/sh\n{script}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


@pytest.fixture(scope="session")
def forked() -> Iterator[ForkServer]:
    """Run the program hundreds of times: processes of a server that has imported what they need."""
    if not hasattr(os, "fork"):
        pytest.skip("this system has no fork")
    with start_fork_server() as run:
        yield run


def pytest_collection_finish() -> None:
    """Do not search thousands of tests for garbage, again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module", autouse=True)
def servers_of_scripts() -> Iterator[None]:
    """End processes of other codes with the file of tests that needed them: they are large."""
    yield
    end_servers_of_scripts()


@pytest.fixture(scope="session")
def sweeps(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SweepServer]:
    """Run sweeps with faults: processes of a server that makes blocks and slabs small."""
    # this module needs Linux
    from .faults import start_sweep_server

    with start_sweep_server(tmp_path_factory.mktemp("sweeps")) as server:
        yield server


@pytest.fixture(scope="session")
def clusters() -> Iterator[ClusterServer]:
    """Run clusters of dask, and sweeps: processes of a server that makes blocks small and slow."""
    if not hasattr(os, "fork"):
        pytest.skip("this system has no fork")
    pytest.importorskip("distributed")
    with start_cluster_server() as server:
        yield server


@pytest.fixture(scope="session")
def silent_programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with programs of the codes that laws are exported to, which print nothing."""
    from impact.exporters.registry import CODES

    folder = tmp_path_factory.mktemp("silent")
    for program in {code.program.name for code in CODES.values() if code.program} - {"python"}:
        write_program(folder / program, "")
    return folder


@pytest.fixture(autouse=True)
def no_installed_codes(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, silent_programs: Path
) -> None:
    """No test depends on the codes that are installed here, but for those that run them."""
    if request.node.get_closest_marker("peers") is None:
        monkeypatch.setenv("PATH", str(silent_programs), prepend=os.pathsep)
        return
    for name, value in (ALONE | WITHOUT_DAEMON).items():
        monkeypatch.setenv(name, value)
    # Open MPI removes its folder when a process ends, also from under one that another worker starts
    monkeypatch.setenv("OMPI_MCA_orte_tmpdir_base", str(silent_programs.parent))


@pytest.fixture(scope="session")
def cli(request: pytest.FixtureRequest) -> Run:
    """Run the program in a process of its own, begun anew where the interpreter reads its environment."""
    forked = request.getfixturevalue("forked") if hasattr(os, "fork") else None

    def run(
        *words: str | Path, cwd: Path = ROOT, **environment: str
    ) -> CompletedCommand | subprocess.CompletedProcess[str]:
        # the server may have been started with another path
        environment = {"PATH": os.environ["PATH"], **environment}
        if forked is not None and environment.keys() <= {"COLUMNS", "NO_COLOR", "PATH"}:
            return forked(*words, cwd=cwd, limit=120, **environment)
        return subprocess.run(
            [sys.executable, "-m", "impact", *map(str, words)],
            cwd=cwd,
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=120,
            check=False,
        )

    return run


def make_once(factory: pytest.TempPathFactory, name: str, make: Callable[[], str]) -> str:
    """Return a text that takes seconds to make, which the processes of a pool share as a file."""
    folder = factory.getbasetemp()
    path = (folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / name
    with FileLock(f"{path}.lock"):
        if not path.exists():
            path.write_text(make(), encoding="utf-8")
        return path.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def figure6() -> xr.Dataset:
    """The result of configs/figure6.toml."""
    return impact.sweep(ROOT / "configs" / "figure6.toml")


@pytest.fixture(scope="session")
def stored(figure6: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a file."""
    path = tmp_path_factory.mktemp("stored") / "figure6.h5"
    impact.save(figure6, path)
    return path


@pytest.fixture(scope="session")
def wide(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """A sweep over several axes, a zip group, a wall, two materials and a model's own parameter."""
    path = tmp_path_factory.mktemp("wide") / "wide.toml"
    path.write_text(WIDE, encoding="utf-8")
    return impact.sweep(path)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print what the codes of test_peers.py gave, and what was skipped."""
    stats = terminalreporter.stats
    properties = [
        (name, value)
        for report in (*stats.get("passed", ()), *stats.get("failed", ()))
        for name, value in report.user_properties
    ]
    peers = [value for name, value in properties if name == "peer"]
    without_peer = [item for name, value in properties if name == "without peer" for item in value.items()]
    if not peers and not without_peer:
        return
    terminalreporter.section("restitution by other codes")
    row = "{:10}  {:23}  {:37}  {:19}  {:>10}  {:>10}  {:>11}".format
    terminalreporter.line(row("code", "version", "entry", "variant", "collisions", "difference", "uncertainty"))
    for *labels, collisions, difference, uncertainty in sorted(map(tuple, peers)):
        terminalreporter.line(row(*labels, collisions, f"{difference:.1e}", f"{uncertainty:.1e}"))
    for reason in sorted({report.longrepr[2].removeprefix("Skipped: ") for report in stats.get("skipped", ())}):
        terminalreporter.line(f"skipped  {reason}")
    for key, reason in without_peer:
        terminalreporter.line(f"no peer  {key}: {reason}")


@pytest.fixture(scope="session")
def chromium() -> str:
    """The program of a real browser."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
    playwright = sorted(Path.home().glob(".cache/ms-playwright/chromium*/*/*chrome*"))
    executable = next(filter(None, map(shutil.which, [*names, *map(str, playwright)])), None)
    if executable is None:
        pytest.skip("no Chromium here: how a page looks in a browser is not tested")
    return executable


@pytest.fixture
def command_line_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages in the words of the command line, as in its process: --set, not overrides."""
    monkeypatch.setattr(formatting, "_is_command_line", True)
