"""The pytest plug-in, the GitHub Action and the pre-commit hook run as their users run them."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
import venv
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import yaml

import impact

from .conftest import CONTACT, ROOT

TESTS = """
import pytest
import impact

SWEEP = {"e": [0.5], "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 6e9}

def test_config(impact_regression):
    impact_regression("../contact.toml", "../baselines/contact.h5")

def test_config_with_overrides(impact_regression):
    impact_regression("../contact.toml", "../baselines/contact.h5", overrides=["sweep.K=6.1e9"])

def test_tolerance(impact_regression):
    result = impact.sweep("contact.toml")
    result["v1_post"] += 1e-5
    impact_regression(result, "../baselines/contact.h5", tol={"v1_post": 1e-4, "v1_error": 1e-4})

@pytest.mark.parametrize("law", ["hertz", "exact-hysteresis"])
def test_mapping(impact_regression, law):
    impact_regression({"models": [law], "sweep": SWEEP})

def test_invalid_config(impact_regression):
    impact_regression({"models": ["hetrz"], "sweep": SWEEP})

def test_overrides_of_a_result(impact_regression):
    impact_regression("../baselines/contact.h5", overrides=["sweep.e=0.5"])
"""
# two runs of pytest in one process, which imports the package once
TWO_RUNS = """
import os
import pytest
options = ["-q", "-p", "no:cacheprovider", "-W", "error"]
select = "(test_config or test_mapping) and not overrides"
blessed = pytest.main([*options, "-k", select, "--impact-bless", "a reason"])
print("SECOND RUN", flush=True)
os.unlink("tests/baselines/test_contact-test_mapping_exact-hysteresis-36eb58d3.h5")
checked = pytest.main([*options, "-k", "not of_a_result and not tolerance"])
raise SystemExit(10 * blessed + checked)
"""
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
(HOOK,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
Completed = subprocess.CompletedProcess[str]


def run(words: list[str | Path], folder: Path, **environment: str) -> Completed:
    """Run a program with this version of the package and the program `impact` on its path."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    shell = {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT / "src"), **environment}
    return subprocess.run(
        words, cwd=folder, env=shell, capture_output=True, text=True, encoding="utf-8", check=False, timeout=120
    )


@pytest.fixture(scope="session")
def entry_points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the entry points of pyproject.toml, as an installation has them."""
    folder = tmp_path_factory.mktemp("site")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    metadata = folder / "impact_sweep-0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: impact-sweep\nVersion: 0\n", encoding="utf-8")
    lines = [f"{name} = {target}\n" for name, target in project["entry-points"]["pytest11"].items()]
    (metadata / "entry_points.txt").write_text("[pytest11]\n" + "".join(lines), encoding="utf-8")
    return folder


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project with a config and tests."""
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_contact.py").write_text(TESTS, encoding="utf-8")
    return tmp_path


def run_pytest(project: Path, entry_points: Path, *options: str) -> Completed:
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-W", "error", *options]
    python_path = os.pathsep.join([str(ROOT / "src"), str(entry_points)])
    return run(words, project, PYTHONPATH=python_path, COLUMNS="200")


@pytest.mark.slow
def test_the_fixture_compares_with_baselines_and_writes_them(project: Path, entry_points: Path) -> None:
    python_path = os.pathsep.join([str(ROOT / "src"), str(entry_points)])
    done = run([sys.executable, "-c", TWO_RUNS], project, PYTHONPATH=python_path, COLUMNS="200")
    assert done.returncode == 1, done.stdout
    written, _, checked = done.stdout.partition("SECOND RUN\n")
    baseline = project / "baselines" / "contact.h5"
    names = [
        "test_contact-test_mapping_exact-hysteresis-36eb58d3.h5",
        "test_contact-test_mapping_hertz-41773356.h5",
    ]
    paths = [baseline, *(project / "tests" / "baselines" / name for name in names)]
    assert re.findall(r"^written: (.*)$", written, re.MULTILINE) == [str(paths[i]) for i in (0, 2, 1)]
    assert b"a reason" in baseline.read_bytes()
    assert [path.exists() for path in paths] == [True, False, True]
    failed = set(re.findall(r"FAILED \S+::(\S+)", checked))
    assert failed == {
        "test_config_with_overrides",
        "test_mapping[exact-hysteresis]",
        "test_invalid_config",
    }
    for text in (
        "not equal: physics config (K)",
        "new.h5 --model gharib-hurmuzlu-2012 --at",
        f"{names[0]}: no baseline",
        "to accept the new result: pytest 'tests/test_contact.py::test_mapping[exact-hysteresis]' --impact-bless",
        'models[0]: got "hetrz", expected a model; did you mean "hertz"?',
    ):
        assert text in checked, checked
    # the failures are short: no line of the package itself
    assert "src/impact" not in checked


SAME_NAMES = """
import pytest

def check(impact_regression, e):
    sweep = {"e": [e], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    impact_regression({"models": ["tsuji-1992"], "sweep": sweep, "solver": {"rtol": 1e-4}})

def test_x(impact_regression):
    check(impact_regression, 0.2)

class TestA:
    def test_x(self, impact_regression):
        check(impact_regression, 0.3)

    def test_own(self, impact_regression):
        check(impact_regression, 0.5)

NAMES = ["a/b", "a_b", "A_B"]

@pytest.mark.parametrize("name", NAMES)
def test_p(impact_regression, name):
    check(impact_regression, 0.6 + 0.1 * NAMES.index(name))

def test_LONG(impact_regression):
    check(impact_regression, 0.9)
""".replace("LONG", 240 * "q")
OLD_AND_NEW_NAMES = """
import os
import pytest
options = ["-q", "-p", "no:cacheprovider", "-W", "error", "tests/test_same.py"]
codes = [pytest.main([*options, "--impact-bless", "a reason"])]
os.chdir("tests/baselines")
names = sorted(os.listdir())
for name in names:
    if "TestA-test_own" in name:
        os.rename(name, "test_same-test_own.h5")
    elif "TestA-test_x" in name:
        os.unlink(name)
    elif "test_p_a_b" in name:
        os.rename(name, "test_same-test_p_a_b.h5")
os.chdir("../..")
print("WITH OLD NAMES", flush=True)
codes.append(pytest.main([*options, "-k", "not qqq"]))
options[-1] += "::TestA::test_own"
codes.append(pytest.main(options))
print(names, list(map(int, codes)))
"""


@pytest.mark.slow
def test_every_test_has_a_baseline_of_its_own(project: Path, entry_points: Path) -> None:
    (project / "tests" / "test_same.py").write_text(SAME_NAMES, encoding="utf-8")
    python_path = os.pathsep.join([str(ROOT / "src"), str(entry_points)])
    done = run([sys.executable, "-c", OLD_AND_NEW_NAMES], project, PYTHONPATH=python_path, COLUMNS="200")
    assert not done.returncode, done.stdout + done.stderr
    names, codes = re.findall(r"(\[[^\]]*\])", done.stdout.splitlines()[-1])
    assert codes == "[0, 1, 1]", done.stdout
    # also where upper and lower case are the same
    assert len({name.lower() for name in names.split(", ")}) == 7
    assert "'test_same-test_x.h5'" in names
    old_names = done.stdout.partition("WITH OLD NAMES\n")[2]
    folder = project / "tests" / "baselines"
    # only one test can have the first; the others may be those of several tests
    assert re.search(
        rf"old name, to be renamed: mv {folder}/test_same-test_own.h5 {folder}/\S*-TestA-\S*h5", old_names
    )
    assert old_names.count("old name, to be renamed") == 1
    assert re.search(r"^3 failed, 3 passed", old_names, re.MULTILINE)
    for name in ("test_x", "test_p_a_b", "test_own"):
        assert f"/test_same-{name}.h5 may be that of another test" in old_names


def test_a_baseline_that_this_run_wrote_is_not_replaced_by_that_of_another_result(
    project: Path, entry_points: Path
) -> None:
    code = """
def test_speeds(impact_regression):
    for v1 in (1.0, 1.0, 2.0):
        impact_regression({"models": ["hertz"], "sweep": {"e": 0.5, "v1": v1, "m1": 1.0, "m2": 1.0, "K": 1e6}})
"""
    (project / "tests" / "test_speeds.py").write_text(code, encoding="utf-8")
    done = run_pytest(project, entry_points, "tests/test_speeds.py", "--impact-bless=first")
    assert done.returncode == 1
    assert (
        "test_speeds-test_speeds.h5: was written from another result in this run; name a baseline" in done.stdout
    )


def test_a_baseline_that_another_worker_wrote_is_not_replaced(project: Path, entry_points: Path) -> None:
    code = """
import pytest

@pytest.mark.parametrize("v1", [1.0, 1.0, 2.0, 2.0])
def test_speed(impact_regression, v1):
    config = {"models": ["hertz"], "sweep": {"e": 0.5, "v1": v1, "m1": 1.0, "m2": 1.0, "K": 1e6}}
    impact_regression(config, "shared.h5")
"""
    (project / "tests" / "test_speed.py").write_text(code, encoding="utf-8")
    done = run_pytest(project, entry_points, "tests/test_speed.py", "-n", "2", "--impact-bless=first")
    # those of the speed that came first
    assert re.search(r"^2 failed, 2 passed", done.stdout, re.MULTILINE), done.stdout
    assert "shared.h5: was written from another result in this run" in done.stdout


@pytest.mark.slow
def test_the_command_of_a_failure_runs_where_pytest_ran(project: Path, entry_points: Path) -> None:
    (project / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    folder = project / "tests"
    failed = run_pytest(folder, entry_points, "-k", "mapping and hertz")
    command = shlex.split(failed.stdout.partition("to accept the new result: pytest ")[2].partition("\n")[0])
    assert command[0] == "test_contact.py::test_mapping[hertz]"
    (folder / "baselines").touch()
    refused = run_pytest(folder, entry_points, *command)
    assert f"File exists: '{folder / 'baselines'}'" in refused.stdout
    # one line, not a traceback through the package
    assert "pytest_plugin.py" not in refused.stdout
    (folder / "baselines").unlink()
    assert run_pytest(folder, entry_points, *command).returncode == 0


@pytest.mark.slow
def test_a_baseline_is_rewritten_only_if_it_differs(project: Path, entry_points: Path) -> None:
    baseline = project / "baselines" / "contact.h5"
    select = ("-k", "test_config and not overrides")
    assert run_pytest(project, entry_points, *select, "--impact-bless=first").returncode == 0
    before = baseline.read_bytes()
    assert run_pytest(project, entry_points, *select, "--impact-bless=second").returncode == 0
    assert baseline.read_bytes() == before
    assert run_pytest(project, entry_points, "-k", "tolerance").returncode == 0
    # workers of pytest-xdist bring what they wrote to the summary
    options = ("-n", "1", "-k", "config_with_overrides", "--impact-bless=third")
    replaced = run_pytest(project, entry_points, *options)
    assert replaced.returncode == 0, replaced.stdout
    assert "written: " in replaced.stdout
    assert b"third" in baseline.read_bytes()
    refused = run_pytest(project, entry_points, "-k", "of_a_result")
    assert "TypeError: got overrides or plugins and a result, expected them with a config" in refused.stdout
    baseline.write_bytes(b"no result")
    refused = run_pytest(project, entry_points, *select, "--impact-bless=fourth")
    assert refused.returncode == 1
    assert "it is not modified, remove it to create a new baseline" in refused.stdout
    assert baseline.read_bytes() == b"no result"


BOARD = """
import impact

def test_board(impact_regression):
    # a ball that rebounds elastically from the wall, whatever e is
    answer = lambda asked: {**asked, "v1": -asked["v1"]}
    impact_regression(impact.conform(adapter=answer, only="normal-e50-slow-wall"))
"""


@pytest.mark.slow
def test_a_board_has_a_baseline(project: Path, entry_points: Path) -> None:
    test, baseline = project / "tests" / "test_engine.py", project / "tests/baselines/test_engine-test_board.h5"
    test.write_text(BOARD, encoding="utf-8")
    # a tolerance that later runs refuse
    named = BOARD.replace('slow-wall")', 'slow-wall"), tol={"delivered": 1e-3}')
    test.write_text(named, encoding="utf-8")
    refused = run_pytest(project, entry_points, str(test), "--impact-bless=first")
    assert 'tol["delivered"]: got a tolerance for one variable, expected one for all' in refused.stdout
    assert not baseline.exists()
    test.write_text(BOARD, encoding="utf-8")
    assert run_pytest(project, entry_points, str(test), "--impact-bless=first").returncode == 0
    before = baseline.read_bytes()
    assert b"first" in before
    assert run_pytest(project, entry_points, str(test), "--impact-bless=second").returncode == 0
    assert baseline.read_bytes() == before
    test.write_text(BOARD.replace('-asked["v1"]', '-0.5 * asked["v1"]'), encoding="utf-8")
    differs = run_pytest(project, entry_points, str(test))
    assert differs.returncode == 1
    assert "not equal" in differs.stdout
    # one message, not that of another on the way
    baseline.write_bytes(b"no result")
    refused = run_pytest(project, entry_points, str(test), "--impact-bless=third")
    assert refused.returncode == 1
    assert "another exception" not in refused.stdout
    assert baseline.read_bytes() == b"no result"


@pytest.mark.slow
@pytest.mark.parametrize("reason", ["", "tests/test_contact.py::test_config"])
def test_the_option_needs_a_reason(project: Path, entry_points: Path, reason: str) -> None:
    done = run_pytest(project, entry_points, "--impact-bless", reason)
    assert done.returncode == pytest.ExitCode.USAGE_ERROR
    assert f'--impact-bless: got "{reason}", expected the reason for the change' in done.stderr


def test_the_plug_in_does_not_import_numpy_when_pytest_starts(tmp_path: Path) -> None:
    code = "import sys, impact.pytest_plugin; assert not {'numpy', 'xarray'} & sys.modules.keys()"
    assert run([sys.executable, "-c", code], tmp_path).returncode == 0


def action_steps(inputs: Mapping[str, str]) -> list[tuple[str, str, dict[str, str]]]:
    """The shell steps of the action for given inputs: name, script, environment."""
    values = {f"inputs.{name}": spec.get("default", "") for name, spec in ACTION["inputs"].items()}
    values |= {f"inputs.{name}": value for name, value in inputs.items()}
    values["github.action_path"] = str(ROOT)
    steps = []
    for step in ACTION["runs"]["steps"]:
        condition = re.fullmatch(r"(inputs\.\S+) != ''", step.get("if", ""))
        assert condition or "if" not in step
        if "run" in step and not (condition and not values[condition[1]]):
            environment = {
                name: re.sub(r"\$\{\{ (\S+) \}\}", lambda match: values[match[1]], text)
                for name, text in step["env"].items()
            }
            assert step["shell"] == "bash"
            steps.append((step["name"], step["run"], environment))
    return steps


def run_action(folder: Path, inputs: Mapping[str, str], **environment: str) -> Completed:
    """Run the shell steps of the action until one fails, as GitHub does."""
    for name, script, variables in action_steps(inputs):
        # pip would take this project for installed
        path = {"PYTHONPATH": ""} if name == "Install impact" else {}
        # the command line that GitHub documents for `shell: bash`
        words: list[str | Path] = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
        done = run(words, folder, **variables, **{"GITHUB_STEP_SUMMARY": "", **environment, **path})
        if done.returncode:
            break
    return done


def test_no_script_of_the_action_contains_an_input() -> None:
    for step in ACTION["runs"]["steps"]:
        assert "${{" not in step.get("run", "")


@pytest.mark.slow
def test_the_action_installs_and_compares(tmp_path: Path) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    for name, overrides in (("new.h5", ["sweep.K=6.1e9"]), ("baseline.h5", [])):
        impact.save(impact.sweep(tmp_path / "contact.toml", overrides=overrides), tmp_path / name)
    # a `python` that only writes what it is called with stands for the installation
    tools = tmp_path / "tools"
    tools.mkdir()
    arguments = tmp_path / "arguments"
    (tools / "python").write_text(f'#!/bin/sh\necho "$@" >> {shlex.quote(str(arguments))}\n', encoding="utf-8")
    (tools / "python").chmod(0o755)
    path = os.pathsep.join([str(tools), str(Path(sys.executable).parent), os.environ["PATH"]])
    inputs = {"result": "new.h5", "baseline": "baseline.h5", "plot": "", "tolerances": "1e-8 v1_post=1e-6"}
    failed = run_action(tmp_path, inputs, PATH=path)
    assert arguments.read_text(encoding="utf-8").split()[-1] == str(ROOT)
    assert failed.returncode == 1
    start = "::error file=baseline.h5,title=impact compare::not equal: physics config (K)"
    assert failed.stdout.startswith(start)


@pytest.mark.slow
def test_the_action_executes_no_module_of_the_checkout(tmp_path: Path) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    imported = tmp_path / "imported"
    for name in ("pip", "impact", "typer", "numpy"):
        (tmp_path / f"{name}.py").write_text(f"open({str(imported)!r}, 'w')\n", encoding="utf-8")
    run([sys.executable, "-m", "pip"], tmp_path)
    assert imported.exists()
    imported.unlink()
    # pip finds no package and fails; the other steps do not need it
    impact.save(impact.sweep(tmp_path / "contact.toml"), tmp_path / "baseline.h5")
    inputs = {"config": "contact.toml", "baseline": "baseline.h5", "plot": "", "version": "0"}
    (name, script, variables), *others = action_steps(inputs)
    assert name == "Install impact"
    assert run(["bash", "-c", script], tmp_path, PYTHONPATH="", PIP_NO_INDEX="1", **variables).returncode == 1
    for _, script, variables in others:
        done = run(["bash", "-c", script], tmp_path, GITHUB_STEP_SUMMARY="", **variables)
        assert done.returncode == 0, done.stderr
    assert not imported.exists()


@pytest.mark.parametrize("baseline", ["impact-new.h5", "./impact-new.h5"])
def test_the_action_does_not_replace_the_baseline(tmp_path: Path, baseline: str) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "impact-new.h5").write_bytes(b"stored")
    _, (name, script, variables), _ = action_steps({"config": "contact.toml", "baseline": baseline})
    done = run(["bash", "-c", script], tmp_path, **variables)
    assert (name, done.returncode) == ("Sweep", 2)
    assert "result and baseline are the same file" in done.stdout
    assert (tmp_path / "impact-new.h5").read_bytes() == b"stored"


@pytest.mark.slow
def test_the_action_sweeps_and_reports_a_difference(tmp_path: Path) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    index, environment = tmp_path / "index", tmp_path / "venv"
    build: list[str | Path] = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", index]
    subprocess.run(build, cwd=ROOT, capture_output=True, check=True)
    venv.create(environment, with_pip=True)
    settings = {
        "PATH": os.pathsep.join([str(environment / "bin"), os.environ["PATH"]]),
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(index),
        "PIP_NO_DEPS": "1",
        # the dependencies are those of this interpreter
        "PYTHONPATH": str(Path(np.__file__).parent.parent),
    }
    (wheel,) = index.glob("*.whl")
    version = wheel.name.split("-")[1]
    plugin = tmp_path / "my model.py"
    plugin.write_text(
        "import impact\nMINE = impact.hysteresis('mine', title='Mine', year=2026, equation='F', "
        "reference='none', chi=lambda e: (1 - e**2) / e)\n",
        encoding="utf-8",
    )
    (tmp_path / "contact.toml").write_text(CONTACT.replace('"hertz"', '"mine"'), encoding="utf-8")
    inputs = {"config": "contact.toml", "baseline": "no.h5", "version": version, "plugins": "my model.py\n"}
    missing = run_action(tmp_path, inputs, **settings)
    assert missing.returncode == 2, missing.stderr
    assert missing.stdout == "::error file=no.h5,title=impact compare::no.h5: does not exist\n"
    inputs = {"result": "impact-new.h5", "baseline": "impact-new.h5", "version": version, "tolerances": "e_out=5%"}
    same = run_action(tmp_path, inputs, **settings)
    assert same.returncode == 0, same.stderr
    assert (tmp_path / ACTION["inputs"]["plot"]["default"]).exists()

    # a difference is also in the summary of the job
    impact.save(
        impact.sweep(tmp_path / "contact.toml", plugins=[plugin], overrides=["sweep.e=0.7"]), tmp_path / "b.h5"
    )
    settings["GITHUB_STEP_SUMMARY"] = str(tmp_path / "summary.md")
    assert run_action(tmp_path, inputs, **settings).returncode == 0
    assert not (tmp_path / "summary.md").exists()
    assert run_action(tmp_path, {**inputs, "baseline": "b.h5"}, **settings).returncode == 1
    assert "nothing in common (e)" in (tmp_path / "summary.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_hook_reports_every_invalid_config(tmp_path: Path) -> None:
    assert HOOK["id"] == "impact-check"
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "with space.toml").write_text(CONTACT.replace("hertz", "hetrz"), encoding="utf-8")
    entry = shlex.split(HOOK["entry"])
    good = run([*entry, "contact.toml"], tmp_path)
    assert (good.returncode, good.stdout, good.stderr) == (0, "", "")
    bad = run([*entry, "with space.toml"], tmp_path)
    assert bad.returncode == 2
    assert bad.stderr == 'with space.toml:2: models[0]: got "hetrz", expected a model; did you mean "hertz"?\n'
    assert {path.name for path in tmp_path.iterdir()} == {"contact.toml", "with space.toml"}


@pytest.mark.slow
def test_the_hook_fails_if_any_file_is_invalid(tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "bad.toml").write_text(CONTACT.replace("hertz", "hetrz"), encoding="utf-8")
    done = run([*shlex.split(HOOK["entry"]), "bad.toml", "good.toml", "bad.toml"], tmp_path)
    assert done.returncode == 2
    assert done.stderr.count("bad.toml:2:") == len(done.stderr.splitlines()) == 2
