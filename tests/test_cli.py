"""Each command, run as a process, writes what its help says, exits with the right code and loses no data."""

from __future__ import annotations

import ast
import errno
import inspect
import io
import itertools
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import typer
import xarray as xr
from rich.cells import cell_len

import impact
from impact.cli import exits
from impact.cli.execution import execution
from impact.cli.main import COMMANDS, load_command
from impact.errors import UsageError
from impact.plots.data import read_points

from .conftest import ROOT, WIDE, Run
from .fork_server import ForkServer, abandoned_pipe, printed_on_terminal

SMALL = """models = ["hertz", "gharib-hurmuzlu-2012"]
[sweep]
e = [0.0, 0.5, 1.0]
v1 = 1.0
m1 = 1.0
m2 = [1.0, 2.0]
K = 6e9
"""


@pytest.fixture
def small(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(SMALL, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "help"])
def test_no_option_is_ignored(name: str) -> None:
    """Each parameter of a command is read in it, or by the name of a parameter of the function that it calls."""
    command = getattr(import_module(f"impact.cli.{COMMANDS[name][0]}"), name)
    (tree,) = ast.parse(inspect.getsource(command)).body
    assert isinstance(tree, ast.FunctionDef)
    nodes = [node for statement in tree.body for node in ast.walk(statement)]
    read = {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
    imported = {
        alias.asname: alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    for node in nodes:
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "options.call":
            function = ast.unparse(node.args[0]).removeprefix("impact.")
            read |= {*inspect.signature(getattr(impact, imported.get(function, function))).parameters}
    assert {*inspect.signature(command).parameters} - read == set()


def test_from_toml_to_picture(cli: Run, small: Path, tmp_path: Path) -> None:
    swept = cli("sweep", small, cwd=tmp_path)
    assert (swept.returncode, swept.stdout) == (0, "")
    assert "results.h5: 12 points from 4 trajectories (10 ok, 2 limit)" in swept.stderr
    assert impact.load(tmp_path / "results.h5").sizes == {"model": 2, "e": 3, "m2": 2}
    drawn = cli("plot", "results.h5", "--sel", "m2=2", cwd=tmp_path)
    assert (drawn.returncode, drawn.stdout) == (0, "")
    assert drawn.stderr.startswith("results.png: Impact sweep, m2 = 2 kg, v1 = 1 m/s, ")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["results.h5", "results.png", "small.toml"]


def test_the_command_and_python_give_the_same_result(cli: Run, small: Path, tmp_path: Path) -> None:
    cli("sweep", small, "-o", "out.h5", "--set", "sweep.m2=3.0", cwd=tmp_path)
    ours = impact.load(tmp_path / "out.h5")
    assert ours.attrs["config_set"] == '["sweep.m2=3.0"]'
    xr.testing.assert_identical(ours, impact.sweep(small, overrides=["sweep.m2=3.0"]))


@pytest.mark.slow
def test_a_finished_sweep_is_not_repeated_and_another_needs_overwrite(
    cli: Run, small: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results.h5"
    cli("sweep", small, cwd=tmp_path)
    before = (out.read_bytes(), out.stat().st_mtime_ns)
    again = cli("sweep", small, cwd=tmp_path)
    assert (again.returncode, again.stderr) == (0, "results.h5: already contains this sweep; nothing to do\n")
    other = cli("sweep", small, "--set", "sweep.m2=3.0", cwd=tmp_path)
    assert (other.returncode, other.stderr) == (
        2, "results.h5: exists; give another name, or overwrite it (--overwrite)\n",
    )  # fmt: skip
    assert (out.read_bytes(), out.stat().st_mtime_ns) == before
    assert cli("sweep", small, "--set", "sweep.m2=3.0", "--overwrite", cwd=tmp_path).returncode == 0
    assert float(impact.load(out)["m2"]) == 3.0


def test_a_bad_config_writes_nothing(cli: Run, small: Path, tmp_path: Path) -> None:
    small.write_text(SMALL.replace("0.5", "1.5").replace("hertz", "herz"), encoding="utf-8")
    refused = cli("sweep", "small.toml", cwd=tmp_path)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr.splitlines() == [
        'small.toml:1: models[0]: got "herz", expected a model; did you mean "hertz"?',
        "small.toml:3: sweep.e[1]: got 1.5, expected a number from 0 to 1",
    ]
    assert [p.name for p in tmp_path.iterdir()] == ["small.toml"]


@pytest.mark.parametrize("output", ["missing/out.h5", ".", "fifo", "link"])
def test_an_output_that_cannot_be_written_is_refused_before_integration(
    cli: Run, small: Path, tmp_path: Path, output: str
) -> None:
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "link").symlink_to(small)
    refused = cli("sweep", small, "-o", output, "--overwrite", cwd=tmp_path)
    assert refused.returncode == 2
    assert len(refused.stderr.splitlines()) == 1
    assert small.read_text(encoding="utf-8") == SMALL


def test_an_output_never_replaces_its_source(cli: Run, small: Path, tmp_path: Path) -> None:
    for words in (["sweep", small, "-o", small], ["run", small, "--history", small]):
        refused = cli(*words, "--overwrite", cwd=tmp_path)
        assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
        assert "is the file to be read" in refused.stderr
    assert small.read_text(encoding="utf-8") == SMALL


@pytest.mark.slow
def test_failed_points_are_printed_and_change_the_exit_code(cli: Run, small: Path, tmp_path: Path) -> None:
    text = SMALL.replace("e = [0.0, 0.5, 1.0]", "alpha = [0.1, 2.0]")
    small.write_text(text, encoding="utf-8")
    failed = cli("sweep", small, "-o", "a.h5", "--json", cwd=tmp_path)
    assert failed.returncode == 3
    summary = json.loads(failed.stdout)
    assert summary["status"] == {"ok": 6, "invalid_parameter": 2}
    assert summary["failed"] == 2
    assert summary["first_failed"][0] == {
        "status": "invalid_parameter", "at": {"model": "gharib-hurmuzlu-2012", "alpha": 2.0, "m2": 1.0},
        "replay": "impact run a.h5 --model gharib-hurmuzlu-2012 --at alpha=2.0 --at m2=1.0",
    }  # fmt: skip
    reason = "a value that arises here is out of its range, such as e = 1 - alpha v0 below 0"
    assert f"failed: model=gharib-hurmuzlu-2012, alpha=2, m2=1: {reason}" in failed.stderr
    # the same sweep is not repeated, but has the same exit code and output
    again = cli("sweep", small, "-o", "a.h5", "--json", cwd=tmp_path)
    assert (again.returncode, again.stdout) == (3, failed.stdout)
    assert "2 of 8 points failed (2 invalid_parameter)" in again.stderr
    quiet = cli("sweep", small, "-o", "c.h5", "--quiet", cwd=tmp_path)
    assert (quiet.returncode, quiet.stderr) == (3, "c.h5: 2 of 8 points failed (2 invalid_parameter)\n")
    allowed = cli("sweep", small, "-o", "b.h5", "--allow-failed", "--quiet", cwd=tmp_path)
    assert (allowed.returncode, allowed.stderr) == (0, "")


@pytest.mark.slow
def test_plot_prints_the_plotted_numbers(cli: Run, stored: Path, tmp_path: Path) -> None:
    drawn = cli("plot", stored, "-o", tmp_path / "a.svg", "--json", "--model", "gharib-hurmuzlu-2012")
    (panel,) = json.loads(drawn.stdout)["final-velocities"]["panels"]
    assert (panel["x_label"], panel["x_name"]) == ("coefficient of restitution", "e")
    assert [(c["model"], c["end"]) for c in panel["curves"]] == [
        (None, "v₁⁺"), (None, "v₂⁺"), ("gharib-hurmuzlu-2012", "v₁⁺"), ("gharib-hurmuzlu-2012", "v₂⁺"),
    ]  # fmt: skip
    # e = 0.5: by hand from the delivered restitution of PHYSICS (28), 0.410720
    assert panel["curves"][2]["y"][50] == pytest.approx(0.5 - 0.41072 / 2, abs=1e-6)


@pytest.mark.slow
def test_several_kinds_in_one_call_and_the_numbers_behind_them(cli: Run, stored: Path, tmp_path: Path) -> None:
    drawn = cli("plot", stored, "-k", "restitution", "-k", "error", "--width", "single",
                "--model", "gharib-hurmuzlu-2012", "-o", "a.svg", "--data", "a.csv", cwd=tmp_path)  # fmt: skip
    assert drawn.returncode == 0, drawn.stderr
    names = {"a-restitution.svg", "a-error.svg", "a-restitution.csv", "a-error.csv"}
    assert names <= {path.name for path in tmp_path.iterdir()}
    assert len((tmp_path / "a-restitution.csv").read_text("utf-8").splitlines()) == 1 + 101
    assert "abs_e_error gharib-hurmuzlu-2012" in (tmp_path / "a-error.csv").read_text("utf-8")
    assert [line.split(":")[0] for line in drawn.stderr.splitlines()] == ["a-restitution.svg", "a-error.svg"]


@pytest.mark.slow
def test_a_report_is_one_page(cli: Run, stored: Path, tmp_path: Path) -> None:
    # tests/test_report_page.py has the rest
    written = cli("report", stored, "-o", "page.html", cwd=tmp_path)
    assert written.returncode == 0, written.stderr
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<h1>Final velocities comparison</h1>" in page
    assert page.count("<figure>") == 4
    assert "<script" not in page


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-k", "lop"], '--kind: no kind "lop"; did you mean "loop"?'),
        (
            ["--width", "wide"],
            "--width: got wide, expected a length from 26mm to 60in, such as 84mm, 8.4cm or 3.3in, or single or "
            "double",
        ),
        (["--log", "z"], "--log: got z, expected x, y, xy"),
        (["--data", "a.txt"], "--data a.txt: expected a name that ends in .csv, .tex or .parquet"),
    ],
)
def test_invalid_options_of_plot_are_one_line_and_write_nothing(
    cli: Run, stored: Path, tmp_path: Path, words: list[str], said: str
) -> None:
    refused = cli("plot", stored, "-o", "a.png", *words, cwd=tmp_path)
    assert (refused.returncode, refused.stderr) == (2, f"{said}\n")
    assert not list(tmp_path.glob("a.*"))


def test_run_prints_an_impact_and_stores_its_history(cli: Run, tmp_path: Path) -> None:
    done = cli("run", "--model", "gharib-hurmuzlu-2012", "--at", "e=0.05", "--at", "m2=inf",
               "--history", "out.h5", "--json", cwd=tmp_path)  # fmt: skip
    assert done.returncode == 0, done.stderr
    printed = json.loads(done.stdout)
    assert printed["outputs"]["status"] == "ok"
    assert printed["outputs"]["damping_ratio"] == 20.0
    assert printed["damping"] == pytest.approx(20.0 * printed["outputs"]["stiffness"])
    restitutions = [printed[name] for name in ("e_kinematic", "e_kinetic", "e_energetic")]
    assert max(restitutions) - min(restitutions) < 1e-9
    history = impact.load(tmp_path / "out.h5")
    assert list(history.data_vars) == ["delta", "v", "F", "x1", "x2", "v1", "v2"]
    assert float(history["t"][-1]) == pytest.approx(printed["outputs"]["contact_time"], rel=1e-12)
    assert float(history["v1"][-1]) == pytest.approx(printed["outputs"]["v1_post"], abs=1e-9)
    assert np.all(np.diff(history["t"].values) > 0.0)
    assert float(history["delta"].sel(t=1e-5, method="nearest")) > 0.0
    again = cli("run", "--history", "out.h5", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (
        2,
        "out.h5: exists; give another name, or overwrite it (--overwrite)\n",
    )


def test_a_history_at_uniform_times(cli: Run, tmp_path: Path) -> None:
    words = ["run", "--model", "kelvin-voigt", "--set", "model.kelvin-voigt.C=2000", "--set", "sweep.n=1"]
    done = cli(*words, "--times", "200", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "--times 200: expected --history FILE as well\n")
    done = cli(*words, "--history", "h.h5", "--times", "1", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "--times: got 1, expected a whole number >= 2\n")
    done = cli(*words, "--at", "K=1e8", "--history", "h.h5", "--times", "200", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "h.h5: 200 points in time\n")
    # parameters of the law have their units
    assert re.search(r"^kelvin-voigt.C +2 kN s/m  ", done.stdout, re.MULTILINE)
    assert re.search(r"^K +100 MN/m  ", done.stdout, re.MULTILINE)
    history = impact.load(tmp_path / "h.h5")
    t = history["t"].values
    np.testing.assert_allclose(np.diff(t), t[-1] / 199, rtol=1e-12)
    # the damped oscillation in closed form: m x'' + C x' + K x = 0, x(0) = 0, x'(0) = v0
    rate, m = 2000 / (2 * 0.5), 0.5
    omega = np.sqrt(1e8 / m - rate**2)
    assert t[-1] == pytest.approx(np.pi / omega, rel=1e-9)
    exact = np.exp(-rate * t) * np.sin(omega * t) / omega
    np.testing.assert_allclose(history["delta"], exact, rtol=0, atol=1e-8 * exact.max())


@pytest.mark.slow
def test_run_repeats_a_point_of_a_result(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "wide.toml").write_text(WIDE, encoding="utf-8")
    cli("sweep", "wide.toml", "--set", "sweep.v2=-2.0", "--set", "solver.rtol=1e-4", cwd=tmp_path)
    stored = impact.load(tmp_path / "results.h5")
    words = ["run", "results.h5", "--model", "bilinear", "--at", "e=0.6", "--at", "m2=inf", "--json"]
    printed = json.loads(cli(*words, cwd=tmp_path).stdout)
    cell = stored.sel(model="bilinear", e=0.6, m1=3.0).isel(
        {"v1": 0, "material2": 0, "ismail-stronge-2008.gamma": 0}
    )
    assert printed["outputs"]["v1_post"] == float(cell["v1_post"])
    assert printed["inputs"]["m1"] == 3.0
    assert printed["inputs"]["v2"] == -2.0
    assert printed["first_value_of"] == ["v1", "material2"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["run", "--at", "e=1.4"], "--at e=1.4: sweep.e: got 1.4, expected a number from 0 to 1"),
        (["run", "--at", "mass=1"], 'no input "mass" here; known: e, m1, m2, material, n, v1, v2'),
        (
            ["run", "--at", "e"],
            "impact run: Invalid value for '--at': got \"e\", expected NAME=VALUE, such as m2=1.0; see ",
        ),
        (
            ["run", "--at", "e=1", "--at", "e=0"],
            "impact run: Invalid value for '--at': got e twice, expected each name once; see impact run -h",
        ),
        (["run", "absent.toml"], "absent.toml: cannot be read: No such file or directory"),
        (["models", "herz"], 'no model "herz"; did you mean "hertz"?'),
        (["run", "--model", "coulomb-1785"], 'no model "coulomb-1785"; it is a friction law'),
        (["run", "--model", "hertz", "--friction", "bilinear"], 'no friction law "bilinear"; it is a model'),
        (["info", "absent.h5"], "absent.h5: does not exist"),
        (["info", "pyproject.toml"], "pyproject.toml: is a TOML file, not a result"),
        (["plot", "absent.h5"], "absent.h5: does not exist"),
        (["plot", "absent.h5", "--label", "e=Asked"], "absent.h5: does not exist"),
        (["plot", "absent.h5", "--label", "e="], "--label: got e=, expected KEY=TEXT, such as "),
        (["plot", "absent.h5", "--label", "=e"], "--label: got =e, expected KEY=TEXT, such as "),
        (["init", "README.md"], "README.md: exists; give another name, or overwrite it (--overwrite)"),
        (["swep"], "impact: No such command 'swep'. Did you mean 'sweep'?; see impact -h"),
        (["sweep"], "impact sweep: Missing argument 'config'; see impact sweep -h"),
        (["sweep", "--job", "2"], "impact sweep: No such option: --job"),
        (["sweep", "a.toml", "b.toml"], "impact sweep: Got unexpected extra argument(s) (b.toml); "),
        (
            ["sweep", "a.toml", "--max-points", "1e6.5"],
            "impact sweep: Invalid value for '--max-points': "
            'got "1e6.5", expected a whole number of at least 1, such as 8 or 1e9; ',
        ),
        (
            ["sweep", "a.toml", "-j", "0"],
            "impact sweep: Invalid value for '--jobs' / '-j': got \"0\", expected a whole number of at least 1",
        ),
        (
            ["timestep", "--model", "hertz", "--tol", "x"],
            "impact timestep: Invalid value for '--tol': got \"x\", expected a number, such as 0.02 or 2%; ",
        ),
    ],
)
def test_an_invalid_command_line_is_one_line(cli: Run, words: list[str], line: str) -> None:
    refused = cli(*words)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert refused.stderr.startswith(line)
    assert len(refused.stderr.splitlines()) == 1


class Terminal(io.StringIO):
    """A stream to a terminal."""

    def isatty(self) -> bool:
        return True


ERRORS = (
    exits.Interrupted(signal.SIGINT, "nothing was written"),
    UsageError("no e"),
    typer.BadParameter("no e"),
    MemoryError("5 TiB"),
    OSError(errno.ENOSPC, "No space left on device"),
)


@pytest.mark.usefixtures("command_line_words")
@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_is_red_on_a_terminal_that_shows_colours_and_a_note_is_not(
    monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def printed() -> list[str]:
        terminal = Terminal()
        monkeypatch.setattr(sys, "stderr", terminal)
        assert exits.run_command_line(fail, debug=False) != 0
        return terminal.getvalue().splitlines()

    def fail() -> None:
        exits.print_line("a note")
        raise error

    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)
    monkeypatch.setenv("NO_COLOR", "1")
    note, line = printed()
    assert (note, "\x1b" in line) == ("a note", False)
    monkeypatch.delenv("NO_COLOR")
    assert printed() == [note, f"\x1b[31m{line}\x1b[0m"]


def test_a_full_standard_output_is_a_storage_error(forked: ForkServer) -> None:
    done = forked("models", stdout="/dev/full")
    assert (done.returncode, done.stderr) == (4, "cannot write: No space left on device\n")


NO_REBOUND = """models = ["mujoco-solref"]
[sweep]
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 1e6
n = 1.0
[solver]
max_steps = 2
"""


COMMANDS_AND_CODES = [
    (["compare", "missing.h5", "missing.h5"], 2),
    (["compare", "missing.h5", "missing.h5", "--format", "json"], 2),
    (["info"], 2),
    (["sweep", "c.toml", "--set", "sweep.m1=-1"], 2),
    (["sweep", "c.toml", "--set", "solver.max_steps=10000"], 0),
    (["sweep", "c.toml", "-o", "failed.h5"], 3),
]


@pytest.mark.slow
@pytest.mark.parametrize(("words", "code"), COMMANDS_AND_CODES)
def test_a_full_standard_error_does_not_change_the_exit_code(
    forked: ForkServer, tmp_path: Path, words: list[str], code: int
) -> None:
    (tmp_path / "c.toml").write_text(NO_REBOUND, encoding="utf-8")
    assert forked(*words, cwd=tmp_path, stderr="/dev/full").returncode == code
    if code == 2:
        # with --format json the output itself goes to the full stream
        done = forked(*words, cwd=tmp_path, stdout="/dev/full")
        assert done.returncode == (4 if "json" in words else code)
        assert "Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("words", "code"), COMMANDS_AND_CODES)
def test_a_full_stream_does_not_change_the_exit_code_of_an_interpreter(
    tmp_path: Path, words: list[str], code: int
) -> None:
    (tmp_path / "c.toml").write_text(NO_REBOUND, encoding="utf-8")
    command = [sys.executable, "-m", "impact", *words]
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=full, check=False)
        assert done.returncode == code
        if code == 2:
            # the output itself goes to the full stream, which fails at once or at the end
            for unbuffered in ("", "1"):
                done = subprocess.run(
                    command, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE, text=True, check=False,
                    env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
                )  # fmt: skip
                assert done.returncode == (4 if "json" in words else code)
                assert "Traceback" not in done.stderr
                assert "Exception ignored" not in done.stderr


OUT_OF_MEMORY_LAW = """
import numpy as np
from impact import ForceModel

def force(elastic, e):
    if np.any(e > 0.9):
        raise MemoryError("no room for 1 GiB")
    return elastic * e

LAW = ForceModel("lacks", title="", year=2026, equation="", reference="", force=force)
"""


def test_lack_of_memory_keeps_what_is_finished_and_is_a_storage_error(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(OUT_OF_MEMORY_LAW, encoding="utf-8")
    (tmp_path / "c.toml").write_text(
        'models = ["lacks"]\n[sweep]\ne = { linspace = [0.5, 1.0, 40000] }\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\n'
        "K = 6e9\n[solver]\nrtol = 1e-4\n",
        encoding="utf-8",
    )
    done = cli("sweep", "c.toml", "--plugin", "law.py", "--quiet", cwd=tmp_path)
    assert done.returncode == 4
    assert done.stderr == (
        "out of memory; no room for 1 GiB; 20,000 of 40,000 trajectories are kept in results.h5.work; "
        "--resume continues\n"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of the size of files")
def test_no_temporary_file_is_a_storage_error() -> None:
    conform = f"exec {sys.executable} -m impact conform --adapter docs/conform/rigid.py:collide"
    done = subprocess.run(
        ["sh", "-c", f"ulimit -f 0; {conform}"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (4, "")
    assert re.fullmatch(r"cannot write: No usable temporary directory found in .*\n", done.stderr)


SHORT_OF_MEMORY = """
import resource
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 2**25,) * 2)
"""


def test_a_sweep_too_large_for_the_memory_is_a_storage_error(forked: ForkServer, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(NO_REBOUND, encoding="utf-8")
    words = ("sweep", "c.toml", "--set", "sweep.v1={ linspace = [1.0, 2.0, 10000000] }")
    done = forked(*words, cwd=tmp_path, code=SHORT_OF_MEMORY, limit=60.0)
    assert done.returncode == 4
    assert done.stderr.startswith("out of memory")
    assert len(done.stderr.splitlines()) == 1


def test_a_plug_in_that_ends_in_a_panic_is_one_line(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text("class Panic(BaseException): pass\nraise Panic('at src/lib.rs:7')\n")
    done = cli("models", "--plugin", "law.py", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "law.py:2: Panic: at src/lib.rs:7\n")


def test_the_catalogue(cli: Run) -> None:
    listed = cli("models").stdout
    for key in impact.models():
        assert key in listed
    record = json.loads(cli("models", "lankarani-nikravesh-1990", "--json").stdout)[0]
    assert record["domain"] == {"e": [0.9, 1.0]}
    assert record["delivered_restitution"]["0.5"] == pytest.approx(0.725241, abs=1e-6)
    page = cli("models", "ismail-stronge-2008").stdout
    assert "plastic loss factor" in page
    assert "seen in Gharib and Hurmuzlu (2012), equation (43)" in page
    for words in ("The columns e=... show the delivered", "The column core shows what integrates", " entries: "):
        assert words in cli("models", COLUMNS="200").stdout


def test_a_model_is_described_in_full(cli: Run) -> None:
    longest = sorted(impact.models().values(), key=lambda model: len(str(model.evidence)) + len(model.equation))
    for model in longest[-3:]:
        words = cli("models", model.key).stdout.split()
        for text in (model.equation, model.reference, str(model.evidence)):
            # a long line is broken between words
            assert " ".join(text.split()) in " ".join(words)


@pytest.mark.slow
def test_common_materials_are_listed_with_units_and_sources(cli: Run) -> None:
    headings, *rows = cli("materials").stdout.splitlines()
    assert headings.split("  ")[0] == "material"
    assert re.split(" {2,}", headings.strip())[1:] == [
        "E [GPa]", "nu [-]", "rho [kg/m3]", "yield_strength [MPa]", "what", "source"
    ]  # fmt: skip
    for name, record in impact.materials().items():
        assert any(row.startswith(f"{name} ") for row in rows)
        numbers = [record["E"] / 1e9, record["nu"], record["rho"], record.get("yield_strength", np.nan) / 1e6]
        heading, printed, *_ = cli("materials", name).stdout.splitlines()
        cells = [np.nan if word == "–" else float(word) for word in printed.split()[1:5]]
        np.testing.assert_allclose(cells, numbers, rtol=1e-5)
        assert heading.startswith("material")
    assert json.loads(cli("materials", "glass", "--json").stdout) == {"glass": impact.materials()["glass"]}
    refused = cli("materials", "glas")
    assert (refused.returncode, refused.stderr) == (2, 'no material "glas"; did you mean "glass"?\n')


def test_texts_in_the_list_of_materials_begin_below_their_headings(cli: Run) -> None:
    headings, *rows = cli("materials").stdout.splitlines()
    what, source = headings.index("what"), headings.index("source")
    for name, record in impact.materials().items():
        (row,) = (row for row in rows if row.startswith(f"{name} "))
        # a long text is broken
        assert (row[what : what + 5], row[source : source + 5]) == (record["about"][:5], record["source"][:5])


def test_info(cli: Run, stored: Path) -> None:
    page = cli("info", stored).stdout
    for words in ("model 3 × e 101", "closed_form_error", "301 ok, 2 limit", "0 … 1, 101 values"):
        assert words in page
    names = [line.split(" ")[0] for line in page.split("\n\n")[0].splitlines() if line[:1].strip()]
    assert names[:5] == ["file", "title", "dimensions", "points", "layout"]
    # how the result was made, as far as it was set
    assert {"rtol", "materials", "impact_version"} <= {*names}
    assert not {"integrator", "plugins"} & {*names}
    # texts of each model are no values of an input
    assert not {"equation", "reference", "doi", "year"} & {*names}
    assert names.count("title") == 1
    printed = json.loads(cli("info", stored, "--json").stdout)
    (title,) = (line for line in page.splitlines() if line.startswith("title"))
    assert title.split()[1:] == printed["attributes"]["title"].split()
    assert printed["dimensions"] == {"model": 3, "e": 101}
    assert printed["attributes"]["config"].startswith("#:schema")


@pytest.mark.slow
def test_the_schema_is_printed_or_written(cli: Run, tmp_path: Path) -> None:
    schema = impact.schema()
    assert json.loads(cli("schema").stdout) == schema
    written = cli("schema", "-o", "s.json", cwd=tmp_path)
    assert (written.returncode, written.stdout, written.stderr) == (0, "", "s.json: written\n")
    assert json.loads((tmp_path / "s.json").read_text(encoding="utf-8")) == schema


def test_the_schema_is_json_in_a_locale_without_the_letters_of_units(cli: Run) -> None:
    assert json.loads(cli("schema", PYTHONIOENCODING="ascii").stdout) == impact.schema()


def test_what_programs_read_is_in_utf_8_in_any_locale(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "Stöße.h5"
    result.write_bytes(stored.read_bytes())
    words = (
        ("compare", result, result, "--format", "junit"),
        ("export", "--to", "yade", "--at", "e=0.6", "--at", "v1=1"),
        ("cite", "hertz"),
    )
    for command, text in zip(words, ("Stöße.h5", "√(m S) δ̇", "Über die Berührung"), strict=True):
        assert text in cli(*command, PYTHONIOENCODING="latin-1").stdout


def test_no_switch_is_on_unless_it_is_given() -> None:
    switches = {
        (name, option.name): option.default
        for name in COMMANDS
        for option in load_command(name).params
        if getattr(option, "is_flag", False)
    }
    assert ("recommend", "overwrite") in switches
    assert {switch: default for switch, default in switches.items() if default} == {}


@pytest.mark.slow
def test_init_and_schema(cli: Run, tmp_path: Path) -> None:
    import jsonschema

    assert cli("init", cwd=tmp_path).returncode == 0
    assert cli("sweep", "config.toml", "--set", "sweep.e=0.5", cwd=tmp_path).returncode == 0
    assert cli("schema", "-o", "impact.schema.json", cwd=tmp_path).returncode == 0
    printed = json.loads(cli("schema").stdout)
    assert json.loads((tmp_path / "impact.schema.json").read_text(encoding="utf-8")) == printed
    import tomllib

    jsonschema.validate(tomllib.loads((tmp_path / "config.toml").read_text(encoding="utf-8")), printed)


@pytest.mark.parametrize(
    "command", ["sweep", "plot", "recommend", "report", "run", "models", "info", "init", "schema"]
)
def test_every_command_has_help_with_an_example(cli: Run, command: str) -> None:
    done = cli(command, "--help")
    assert done.returncode == 0
    assert f"Example: impact {command}" in done.stdout


@pytest.mark.parametrize("command", ["report", "plot", "rerun"])
def test_the_help_of_a_command_that_takes_a_calibration_says_so(cli: Run, command: str) -> None:
    arguments = cli(command, "--help").stdout.partition("Options")[0].partition("Arguments")[2]
    assert "calibrate`" in arguments


@pytest.mark.parametrize("words", [["--help"], ["sweep", "--help"], ["--version"]])
def test_help_loads_no_numpy(words: list[str]) -> None:
    code = (
        "import sys\nfrom impact.cli import main\nsys.argv = ['impact', *sys.argv[1:]]\n"
        "try:\n    main.main()\nexcept SystemExit as leaving:\n    assert not leaving.code, leaving.code\n"
        "heavy = {'numpy', 'scipy', 'xarray', 'matplotlib', 'jinja2', 'h5py', 'tomllib'} & sys.modules.keys()\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_plug_in_named_by_a_file_is_not_imported(cli: Run, small: Path, tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'marker')!r}, 'w').close()")
    for line in ('plugin = "evil.py"\n', 'plugins = ["evil"]\n'):
        small.write_text(line + SMALL, encoding="utf-8")
        assert cli("sweep", small, cwd=tmp_path).returncode == 2
    assert not (tmp_path / "marker").exists()


@pytest.mark.slow
def test_no_control_byte_reaches_the_terminal(cli: Run, tmp_path: Path) -> None:
    name = "a\x1b[31m\u202e[red][x].toml"
    title = r'"\u001b[31m \u202e [red] [/x] $\\frac{1$"'
    (tmp_path / name).write_text(f"title = {title}\n" + SMALL, encoding="utf-8")
    for words in (
        ["sweep", name],
        ["info", "results.h5"],
        ["plot", "results.h5"],
        ["sweep", name, "--set", "x=\x1b[2J"],
    ):
        done = cli(*words, cwd=tmp_path)
        assert "Traceback" not in done.stderr
        assert not re.search("[\x1b\u202e]", done.stdout + done.stderr), words
    assert (tmp_path / "results.png").exists()


@pytest.mark.slow
def test_hostile_names_in_a_file_are_escaped(cli: Run, tmp_path: Path) -> None:
    name = "\x1b[31mP\x07\u202e"
    balls = {"e": [0.5, 1.0], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": [name, "steel"]}
    materials = {key: {"E": "210 GPa", "nu": 0.3, "rho": 7850} for key in (name, "steel")}
    result = impact.sweep({"title": name, "models": "hertz", "sweep": balls, "materials": materials})
    hostile = result.assign_coords(model=[name], title=("model", [name]))
    hostile["e"].attrs["units"] = name
    impact.save(hostile, tmp_path / "bad.h5")
    commands = [["info"], ["plot"], ["plot", "--x", "z"], ["plot", "--sel", "z=1"], ["plot", "--model", "z"]]
    for command, *words in commands:
        done = cli(command, "bad.h5", *words, cwd=tmp_path)
        assert "Traceback" not in done.stderr
        assert not re.search("[\x1b\x07\u202e]", done.stdout + done.stderr), words
    done = cli("models", name)
    assert (done.returncode, "\x1b" in done.stderr) == (2, False)


@pytest.mark.slow
def test_a_history_is_a_table_or_a_result_as_its_name_says(cli: Run, tmp_path: Path) -> None:
    for name in ("h.h5", "h.csv"):
        done = cli("run", "--at", "e=0.5", "--times", "50", "--history", name, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, f"{name}: 50 points in time\n")
    history = impact.load(tmp_path / "h.h5")
    heading, *_ = (tmp_path / "h.csv").read_text(encoding="utf-8").splitlines()
    assert heading == "t [s],delta [m],v [m/s],F [N],x1 [m],x2 [m],v1 [m/s],v2 [m/s]"
    columns = read_points(tmp_path / "h.csv").columns
    assert columns.keys() == history.variables.keys() - {"model"}
    for name, values in columns.items():
        np.testing.assert_array_equal(values, history[name].values)
    assert cli("plot", "h.h5", "-k", "history", "--points", "h.csv", cwd=tmp_path).returncode == 0
    (tmp_path / "h.png").unlink()
    for name in ("h.png", "h.txt", "h"):
        refused = cli("run", "--model", "nothing", "--history", name, cwd=tmp_path)
        words = f"--history {name}: expected a name that ends in .h5, .hdf5, .nc or .csv\n"
        assert (refused.returncode, refused.stdout, refused.stderr) == (2, "", words)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["h.csv", "h.h5"]


def test_run_of_a_failed_point(cli: Run, tmp_path: Path) -> None:
    words = ["run", "--at", "m1=inf", "--at", "m2=inf", "--at", "K=1e9", "--at", "R1=1", "--at", "R2=1"]
    for more in ([], ["--history", "h.h5"]):
        done = cli(*words, *more, cwd=tmp_path)
        assert done.returncode == 3
        assert "out_of_range" in done.stdout
    assert list(tmp_path.iterdir()) == []


def test_a_picture_never_replaces_its_result(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "result.png"
    result.write_bytes(stored.read_bytes())
    refused = cli("plot", result)
    assert (refused.returncode, "is the file to be read" in refused.stderr) == (2, True)
    assert result.read_bytes() == stored.read_bytes()


def test_a_style_with_latex_that_is_not_installed_is_reported(cli: Run, stored: Path, tmp_path: Path) -> None:
    (tmp_path / "tex.mplstyle").write_text("text.usetex: True", encoding="utf-8")
    folder = str(tmp_path)
    words = ("plot", stored, "--style", "tex.mplstyle", "-o", "picture.pdf")
    done = cli(*words, cwd=tmp_path, PATH=folder, MPLCONFIGDIR=folder)
    reason = "Failed to process string with tex because latex could not be found"
    assert (done.returncode, done.stderr) == (2, f"the picture cannot be drawn with text.usetex: {reason}\n")


@pytest.mark.parametrize(
    ("setting", "problem"),
    [
        ("figure.dpi: -1", "the settings of matplotlib allow no figure: dpi must be positive"),
        ("figure.subplot.left: 2", "the settings of matplotlib allow no figure: left cannot be >= right"),
        (
            "axes.prop_cycle: cycler('color', [])",
            "the settings of matplotlib allow no figure: axes.prop_cycle has no values",
        ),
        (
            "figure.figsize: 0, 5",
            "figure.figsize: got 0.0, expected a length from 26mm to 60in, such as 84mm, 8.4cm or 3.3in",
        ),
        ("savefig.dpi: 0", "the picture cannot be drawn as .png: dpi must be positive"),
    ],
)
def test_a_setting_of_matplotlib_that_allows_no_picture_is_reported(
    cli: Run, stored: Path, tmp_path: Path, setting: str, problem: str
) -> None:
    (tmp_path / "mine.mplstyle").write_text(setting, encoding="utf-8")
    done = cli("plot", stored, "--style", "mine.mplstyle", "-o", "picture.png", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, f"{problem}\n")


def test_a_backend_that_matplotlib_does_not_have_is_reported(cli: Run, stored: Path) -> None:
    done = cli("plot", stored, MPLBACKEND="none such")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert done.stderr.startswith("matplotlib cannot be imported: ValueError: Key backend: 'none such' is not")


@pytest.mark.slow
def test_narrow_and_ascii_terminals(cli: Run, stored: Path) -> None:
    for environment in ({"COLUMNS": "20"}, {"PYTHONIOENCODING": "ascii"}, {"NO_COLOR": "1", "LC_ALL": "C"}):
        for words in (["models"], ["info", stored], ["recommend", stored], ["run", "--at", "e=0.5"]):
            done = cli(*words, **environment)
            assert (done.returncode, done.stderr) == (0, ""), (words, environment)


@pytest.mark.slow
def test_closed_streams_are_no_error(stored: Path) -> None:
    for line in ("models >&-", "models --json >&-", f"info '{stored}' 2>&-", "models | head -n 1"):
        command = f"set -o pipefail; '{sys.executable}' -m impact {line}"
        done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, ""), line


@pytest.mark.slow
def test_a_closed_pipe_is_no_error(forked: ForkServer, stored: Path, tmp_path: Path) -> None:
    with abandoned_pipe(tmp_path) as pipe:
        done = forked("plot", stored, "-o", tmp_path / "x.png", "--json", stdout=pipe)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "Broken" not in done.stderr


@pytest.mark.slow
def test_a_closed_pipe_is_no_error_of_an_interpreter(stored: Path, tmp_path: Path) -> None:
    line = f'"{sys.executable}" -m impact plot "{stored}" -o "{tmp_path}/x.svg" --json | head -c 10'
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert "Broken" not in done.stderr


LONG = """models = ["exact-hysteresis"]
[sweep]
e = { linspace = [0.01, 0.99, 300000] }
v1 = 1
m1 = 1
m2 = 1
K = 1e9
[solver]
rtol = 1e-12
"""


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_nothing_half_written(tmp_path: Path, number: signal.Signals, code: int) -> None:
    (tmp_path / "long.toml").write_text(LONG, encoding="utf-8")
    words = [sys.executable, "-m", "impact", "sweep", "long.toml"]
    child = subprocess.Popen(words, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    # the first of many blocks is finished
    while not list(tmp_path.glob("results.h5.work/*.npz")):
        assert child.poll() is None
        time.sleep(0.01)
    child.send_signal(number)
    _, stderr = child.communicate(timeout=60)
    assert child.returncode == code
    assert stderr.endswith(" of 300,000 trajectories are kept in results.h5.work; --resume continues\n")
    assert "Traceback" not in stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["long.toml", "results.h5.work"]


KILLED_WHILE_STORING = """
import os, signal
from impact import atomic as sink
whole = sink._publish

def signalled(*words, **more):
    os.kill(os.getpid(), signal.NAME)
    whole(*words, **more)

sink._publish = signalled
"""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_while_storing_is_not_lost(
    forked: ForkServer, small: Path, tmp_path: Path, name: str, code: int
) -> None:
    done = forked("sweep", small.name, cwd=tmp_path, code=KILLED_WHILE_STORING.replace("NAME", name))
    assert done.returncode == code
    assert done.stderr.endswith("; results.h5 is complete\n")
    assert impact.load(tmp_path / "results.h5").sizes["e"] == 3


def test_the_third_signal_stops_a_force_function_that_never_returns() -> None:
    with exits.catch_signals() as should_stop:
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
        assert should_stop()
        with pytest.raises(exits.Interrupted, match="stopped immediately"):
            signal.raise_signal(signal.SIGTERM)


def test_an_internal_error_is_one_line_and_a_report(forked: ForkServer, tmp_path: Path, stored: Path) -> None:
    # a function that is replaced by a failing one stands for a bug
    code = (
        "import tempfile, impact\n"
        "def broken(*a, **k): raise ZeroDivisionError('of our own')\n"
        "impact.info = broken\n"
        f"tempfile.tempdir = {str(tmp_path)!r}\n"
    )
    done = forked("info", stored, code=code)
    assert done.returncode == 70
    (line,) = done.stderr.splitlines()
    assert line.startswith("internal error: ZeroDivisionError: of our own; report: ")
    (report,) = tmp_path.iterdir()
    assert "Traceback" in report.read_text(encoding="utf-8")


def test_a_cluster_without_dask_names_the_extra(forked: ForkServer, small: Path, tmp_path: Path) -> None:
    hidden = "import sys; sys.modules['distributed'] = None"
    done = forked("sweep", small, "--scheduler", "local", cwd=tmp_path, code=hidden)
    expected = 'expected dask.distributed, which is not installed: pip install "impact-sweep[distributed]"'
    assert (done.returncode, done.stderr) == (2, f"--scheduler local: {expected}\n")


def test_executors_exclude_each_other(cli: Run, small: Path, tmp_path: Path) -> None:
    executors = ("--jobs 2", "--threads 2", "--scheduler local", "--scheduler-file s.json")
    for first, second in itertools.combinations(executors, 2):
        done = cli("sweep", small, *first.split(), *second.split(), cwd=tmp_path)
        assert (done.returncode, done.stderr) == (2, f"{first}: got {second} as well, expected one of the two\n")


@pytest.mark.parametrize(("jobs", "threads", "shares_memory"), [(1, 2, True), (2, 1, False)])
def test_threads_integrate_in_the_process_of_the_command_and_jobs_in_others(
    jobs: int, threads: int, shares_memory: bool
) -> None:
    with execution(True, jobs, threads) as keywords:
        assert keywords["backend"].shares_memory is shares_memory


def test_any_number_of_jobs_is_taken() -> None:
    with execution(True, 10**300) as keywords, keywords["backend"].start() as executor:
        assert executor is not None


def test_every_paragraph_of_help_fills_its_lines(cli: Run) -> None:
    paragraph = re.search(r"\n\s*\n( loop, history.*?)\n\s*\n", cli("plot", "--help").stdout, re.DOTALL)
    assert paragraph is not None
    *full, _ = paragraph[1].splitlines()
    width = max(map(len, map(str.strip, full)))
    assert all(len(line.strip()) > width - 20 for line in full)


def test_help_shows_the_value_of_every_option_as_one_word() -> None:
    options = [option for name in COMMANDS for option in load_command(name).params]
    assert {option.metavar for option in options if " " in (option.metavar or "")} == set()


def test_help_of_a_command_and_the_version(cli: Run) -> None:
    assert cli("help", "sweep").stdout == cli("sweep", "--help").stdout
    assert cli("help").stdout.rstrip() == cli("--help").stdout.rstrip()
    for option in ("-V", "--version"):
        done = cli(option)
        assert (done.returncode, done.stdout, done.stderr) == (0, f"impact {impact.__version__}\n", "")
    wrong = cli("help", "swep")
    assert (wrong.returncode, wrong.stderr) == (2, cli("swep").stderr)


@pytest.mark.slow
def test_flags_are_shown_without_a_type(cli: Run) -> None:
    for words in (["--help"], ["sweep", "--help"], ["models", "--help"], ["help", "bless"]):
        assert "bool" not in cli(*words).stdout


def test_models_by_words_of_their_title_or_reference(cli: Run) -> None:
    listed = json.loads(cli("models", "--search", "KUWABARA 1987", "--json").stdout)
    assert "kuwabara-kono-1987" in {model["key"] for model in listed}
    assert all("kuwabara" in json.dumps(model).casefold() for model in listed)
    assert len(listed) < 10
    none = cli("models", "--search", "no such words")
    assert (none.returncode, none.stderr.count("\n")) == (2, 1)


def test_the_list_of_laws_says_how_one_law_is_described(cli: Run) -> None:
    assert "`impact models KEY` describes one model in full." in cli("models", "tsuji-*").stdout


def test_models_by_a_pattern(cli: Run) -> None:
    keys = [record["key"] for record in json.loads(cli("models", "lammps-t*", "--json").stdout)]
    assert keys == [key for key in impact.models() if key.startswith("lammps-t")]
    # the second column is that of e = 0.1
    assert re.search(r"^lammps-tsuji +0\.0995 ", cli("models", "lammps-t*").stdout, re.MULTILINE)
    wrong = cli("models", "lamps*")
    assert (wrong.returncode, wrong.stderr[:28]) == (2, 'no model matches "lamps*"; k'[:28])
    assert cli("models", "lammps-*", "--family", "elastic").returncode == 2
    of_family = cli("models", "family:permanent", "--json").stdout
    assert of_family == cli("models", "--family", "permanent", "--json").stdout
    assert 'did you mean "permanent"?' in cli("models", "family:perm").stderr


@pytest.mark.parametrize(("width", "columns"), [(40, 1), (80, 5), (120, 5)])
def test_the_catalogue_keeps_the_restitution_on_a_narrow_terminal(
    forked: ForkServer, width: int, columns: int
) -> None:
    done, printed = printed_on_terminal(forked, "models", width=width, NO_COLOR="1")
    assert done.returncode == 0
    lines = re.sub(r"\x1b\[[\d;]*m", "", printed).splitlines()
    assert len(re.findall(r"e=0\.\d", lines[0])) == columns
    assert ("equation" in lines[0]) == (width == 120)
    assert max(map(cell_len, lines)) <= width
    # a long key may be folded, nothing else is in the way of a number
    assert re.search(r"^tsuji-1992 +0\.\d{4}", "\n".join(lines), re.MULTILINE)


@pytest.mark.parametrize("width", [60, 80])
def test_numbers_of_a_calibration_are_whole_on_a_narrow_terminal(forked: ForkServer, width: int) -> None:
    words = ("calibrate", "docs/calibrate/drops.toml", "--set", 'models=["hunt-crossley-1975"]')
    done, printed = printed_on_terminal(forked, *words, width=width, NO_COLOR="1")
    lines = re.sub(r"\x1b\[[\d;]*m", "", printed).splitlines()
    rows = [line for line in lines if line.startswith(("law ", "hunt-crossley-1975 "))]
    assert max(map(cell_len, rows)) <= width
    # a part of the table for some columns, as pandas has it
    names, values = (
        [part for line in rows[start::2] for part in re.split("  +", line.strip())] for start in (0, 1)
    )
    shown = dict(zip(names, values, strict=True))
    expected = {"law": "hunt-crossley-1975", "95 %": "0.05 to 0.050354", "AICc": "3446.2", "status": "at_bound"}
    assert {name: shown[name] for name in expected} == expected
    assert done.returncode == 0


@pytest.mark.slow
def test_a_shell_completes_models_keys_axes_and_outputs(forked: ForkServer, stored: Path) -> None:
    def completed(*words: str | Path) -> list[str]:
        index = str(len(words) - 1)
        line = {"COMP_WORDS": " ".join(map(str, words)), "COMP_CWORD": index, "_IMPACT_COMPLETE": "complete_bash"}
        done = forked(**line)
        assert done.stderr == ""
        return done.stdout.split()

    axes = [str(name) for name in impact.load(stored).dims if name != "model"]
    assert completed("impact", "plot", stored, "--x", "") == axes
    assert completed("impact", "plot", "--sel", "m2=1", stored, "--sel", "e") == ["e="]
    assert completed("impact", "plot", "no-such-file.h5", "--x", "") == []
    assert completed("impact", "plot", stored, "--kind", "f") == ["final-velocities", "friction-loop"]
    assert completed("impact", "sweep", "--set", "solver.max") == ["solver.max_steps="]
    assert completed("impact", "sweep", "--set", "sweep.m") == [
        f"sweep.m{k}=" for k in (1, 2, "u", "aterial", "aterial1", "aterial2")
    ]
    assert completed("impact", "run", "--model", "mujoco-solref", "--at", "d") == ["dt=", "dampratio="]
    assert completed("impact", "run", "--at", "d") == ["dt="]
    assert completed("impact", "solve", "--model", "mujoco-solref", "--for", "") == [
        "dampratio", "timeconst", "K", "e", "mu"
    ]  # fmt: skip
    assert completed("impact", "solve", "--target", "e_o") == ["e_out="]
    assert completed("impact", "sensitivity", "--of", "peak_f") == ["peak_force"]
    keys = [key for key in impact.models() if key.startswith("thornton")]
    assert completed("impact", "models", "thornton") == keys
    assert completed("impact", "run", "--model", "thornton") == keys
    assert completed("impact", "models", "--family", "elastic-") == ["elastic-plastic"]
    laws = [key for key in impact.frictions() if key.startswith("lammps")]
    assert len(laws) > 1
    assert completed("impact", "run", "--friction", "lammps") == laws
    assert completed("impact", "swe") == ["sweep"]


def test_ctrl_c_ends_a_command_with_one_line_that_is_red_on_a_terminal(forked: ForkServer, tmp_path: Path) -> None:
    plugin = tmp_path / "pressed.py"
    plugin.write_text("raise KeyboardInterrupt", encoding="utf-8")
    words = ("models", "--plugin", plugin)
    done, printed = printed_on_terminal(forked, *words, stream="stderr")
    assert (done.returncode, done.stdout, printed) == (130, "", "\x1b[31minterrupted\x1b[0m\r\n")
    assert forked(*words).stderr == "interrupted\n"


def test_a_tolerance_in_percent(cli: Run, stored: Path) -> None:
    percent, fraction = (cli("recommend", stored, "--tol", word, "--json").stdout for word in ("5%", "0.05"))
    assert percent == fraction
    assert json.loads(percent)["tol"] == 0.05


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (
            ("plot", "c.toml"),
            "c.toml: is a TOML file, not a result; sweep a config first: impact sweep c.toml -o RESULT.h5",
        ),
        (
            ("recommend", "c.toml"),
            "c.toml: is a TOML file, not a result; sweep a config first: impact sweep c.toml -o RESULT.h5",
        ),
        (
            ("plot", "my folder/c.toml"),
            "my folder/c.toml: is a TOML file, not a result; sweep a config first: impact sweep 'my folder/c.toml'"
            " -o RESULT.h5",
        ),
        (
            ("plot", "data.csv"),
            "data.csv: is a CSV file, not a result; impact plot RESULT.h5 --points data.csv draws its points",
        ),
        (
            ("sweep", "small.h5", "-o", "out.h5"),
            "small.h5: is a result, not a text file; impact info, plot, rerun, extend and expand read results",
        ),
        (
            ("plot", "small.h5", "--points", "small.h5"),
            "small.h5: is a result, not a text file; impact info, plot, rerun, extend and expand read results",
        ),
    ],
)
def test_a_file_of_another_kind_is_named(
    cli: Run, small: Path, stored: Path, tmp_path: Path, words: tuple[str, ...], line: str
) -> None:
    (tmp_path / "my folder").mkdir()
    shutil.copy(small, tmp_path / "my folder" / "c.toml")
    shutil.copy(small, tmp_path / "c.toml")
    shutil.copy(stored, tmp_path / "small.h5")
    (tmp_path / "data.csv").write_text("v1,e\n1,0.5\n", encoding="utf-8")
    result = cli(*words, cwd=tmp_path)
    assert (result.returncode, result.stdout, result.stderr) == (2, "", f"{line}\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("value", "nearest"),
    [
        ("0.5", "0.496 and 0.506"),
        ("-3", "0.001 and 0.011"),
        ("1e300", "0.991 and 1.001"),
        ("inf", "0.991 and 1.001"),
    ],
)
def test_a_value_that_is_not_in_a_result_is_reported_with_the_nearest(
    cli: Run, small: Path, tmp_path: Path, value: str, nearest: str
) -> None:
    speeds = [round(0.001 + 0.01 * n, 3) for n in range(101)]
    speeds = [0.496 if speed == 0.501 else 0.506 if speed == 0.511 else speed for speed in speeds]
    impact.sweep_to_file(small, tmp_path / "out.h5", overrides=[f"sweep.v1={speeds}"])
    for words in (("expand", "out.h5", "-o", "part.h5"), ("plot", "out.h5"), ("recommend", "out.h5")):
        refused = cli(*words, "--sel", f"v1={value}", cwd=tmp_path)
        message = f"no v1 = {float(value)} in this result; the nearest are {nearest}\n"
        assert (refused.returncode, refused.stdout, refused.stderr) == (2, "", message)


READ_FILES = {
    "v1.csv": "v1 [m/s]\n1.0\n1.2\n",
    "drops.csv": "v1 [m/s],e_out,sigma\n1,0.5,0.01\n2,0.5,0.01\n",
    "law.py": "from impact import hysteresis\n"
    "MINE = hysteresis('mine', title='', year=1, equation='', reference='', chi=lambda e: 1 - e)\n",
    "c.toml": 'models = "mujoco-solref"\n[sweep]\nv1 = { file = "v1.csv", column = "v1" }\n'
    "m1 = 1\nm2 = 1\nn = 1\n",
    "u.toml": 'models = "hertz"\n[design]\nn = 8\n[sweep]\nv1 = { empirical = "v1.csv" }\n'
    "m1 = { uniform = [1, 2] }\nm2 = 1\nK = 1e6\n",
    "f.toml": 'models = "anagnostopoulos-1988"\n[data]\nfile = "drops.csv"\n[sweep]\n'
    "m1 = 1\nm2 = 1\nK = 1e6\nn = 1\ne = { fit = [0.1, 1] }\n",
}  # fmt: skip


@pytest.mark.parametrize(
    ("words", "outputs"),
    [
        pytest.param("sweep c.toml --plugin law.py -o", "c.toml v1.csv law.py", marks=pytest.mark.slow),
        pytest.param("sensitivity u.toml --plugin law.py -o", "u.toml v1.csv law.py", marks=pytest.mark.slow),
        pytest.param("calibrate f.toml --plugin law.py -o", "f.toml drops.csv law.py", marks=pytest.mark.slow),
        ("calibrate f.toml --plugin law.py --best", "f.toml drops.csv law.py"),
        ("export c.toml --to mujoco -o", "c.toml v1.csv"),
    ],
)
def test_no_command_replaces_a_file_that_it_reads(
    forked: ForkServer, tmp_path: Path, words: str, outputs: str
) -> None:
    for name, content in READ_FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    for name in outputs.split():
        done = forked(*words.split(), name, "--overwrite", cwd=tmp_path)
        assert (done.returncode, done.stderr) == (2, f"{name}: is the file to be read, and is not modified\n")
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == READ_FILES


def test_two_outputs_cannot_be_one_file(forked: ForkServer, tmp_path: Path) -> None:
    for name, content in READ_FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    done = forked("calibrate", "f.toml", "-o", "x", "--best", "x", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (2, "x: is named for two outputs\n")
    assert not (tmp_path / "x").exists()
