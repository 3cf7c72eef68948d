"""The workflow of docs/ci.md runs without changes, with the package installed from a wheel."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import pytest
import yaml

from .conftest import CONTACT, ROOT, Run, code_blocks

# these tests create environments and build the package
pytestmark = pytest.mark.slow

PAGE = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
Shell = dict[str, str]


def block(language: str, position: int = 0) -> str:
    """The block of a language at a position of the page."""
    return code_blocks(PAGE, language)[position]


@pytest.fixture(scope="module")
def steps() -> list[dict[str, str]]:
    workflow = yaml.safe_load(block("yaml"))
    return list(workflow["jobs"]["regression"]["steps"])


@pytest.fixture(scope="module")
def shell(tmp_path_factory: pytest.TempPathFactory) -> Shell:
    """The environment of a runner: a new virtual environment, and an index that has a wheel of this project."""
    folder = tmp_path_factory.mktemp("runner")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder / "index")]
    subprocess.run(build, cwd=ROOT, capture_output=True, check=True)
    venv.create(folder / "venv", with_pip=True)
    return {
        **os.environ,
        "PATH": f"{folder / 'venv' / 'bin'}{os.pathsep}{os.environ['PATH']}",
        "PIP_NO_INDEX": "1",
        "PIP_FIND_LINKS": str(folder / "index"),
        "PIP_NO_DEPS": "1",
        "GITHUB_STEP_SUMMARY": str(folder / "summary.md"),
    }


def run(command: str, shell: Shell, folder: Path) -> subprocess.CompletedProcess[str]:
    if not command.startswith("pip"):
        # the dependencies are installed here: a path that has them, but not the editable project
        shell = {**shell, "PYTHONPATH": str(Path(np.__file__).parent.parent)}
    words = ["bash", "-e", "-c", command]
    return subprocess.run(words, cwd=folder, env=shell, capture_output=True, text=True, check=False, timeout=120)


def test_the_workflow_runs_and_reports_a_difference(
    shell: Shell, steps: list[dict[str, str]], tmp_path: Path
) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "baselines").mkdir()
    always = [step["run"] for step in steps if "run" in step and "if" not in step]
    assert [command.split()[0] for command in always] == ["pip", "impact", "impact"]
    (first,) = [line for line in block("sh").splitlines() if " bless " in line]
    for command in (*always[:2], first):
        done = run(command, shell, tmp_path)
        assert done.returncode == 0, (command, done.stderr)
    where = run("command -v impact && python -c 'import impact; print(impact.__file__)'", shell, tmp_path).stdout
    assert where.count(shell["PATH"].split(os.pathsep)[0].removesuffix("bin")) == 2, where
    assert run(always[2], shell, tmp_path).returncode == 0

    # changed values: the job fails with their location, and the steps on failure write their files
    (tmp_path / "contact.toml").write_text(CONTACT.replace("6e9", "6.1e9"), encoding="utf-8")
    assert run(f"{always[1]} --overwrite", shell, tmp_path).returncode == 0
    failed = run(always[2], shell, tmp_path)
    assert failed.returncode == 1
    assert failed.stdout.startswith(
        "::error file=baselines/contact.h5,title=impact compare::not equal: physics config (K)"
    )
    (on_failure,) = [step["run"] for step in steps if step.get("if") == "failure()" and "run" in step]
    run(on_failure, shell, tmp_path)
    assert "not equal" in Path(shell["GITHUB_STEP_SUMMARY"]).read_text(encoding="utf-8")
    (kept,) = [step["with"]["path"] for step in steps if "upload" in step.get("uses", "")]
    assert all((tmp_path / name).is_file() for name in str(kept).split())


def test_the_commands_run_in_an_empty_folder(tmp_path: Path) -> None:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-c", block("sh")], cwd=tmp_path, env={**os.environ, "PATH": path}, check=False
    )
    assert done.returncode == 0
    assert (tmp_path / "baselines" / "contact.h5").exists()


def test_the_pytest_example_passes_and_fails(tmp_path: Path, cli: Run) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "baselines").mkdir()
    assert cli("sweep", "contact.toml", "-o", "baselines/contact.h5", "-q", cwd=tmp_path).returncode == 0
    (tmp_path / "test_contact.py").write_text(block("python"), encoding="utf-8")
    pytest_run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_contact.py"]
    assert subprocess.run(pytest_run, cwd=tmp_path, capture_output=True, check=False).returncode == 0
    (tmp_path / "contact.toml").write_text(CONTACT.replace("e = [0.1", "e = [0.2"), encoding="utf-8")
    failed = subprocess.run(pytest_run, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert failed.returncode == 1
    assert "not equal: labels (e)" in failed.stdout
    assert "e: 1 of 3 in NEW only: 0.2; 1 of 3 in BASELINE only: 0.1" in failed.stdout


def test_the_example_of_the_pytest_plug_in_passes_and_fails(tmp_path: Path) -> None:
    (tmp_path / "contact.toml").write_text(CONTACT, encoding="utf-8")
    (tmp_path / "test_contact.py").write_text(block("python", 1), encoding="utf-8")
    # without the entry point of an installation, and without the summary, which repeats messages where CI is set
    options = ["-p", "no:impact", "-p", "impact.pytest_plugin", "-p", "no:cacheprovider", "-rN"]
    bless, check = ([sys.executable, "-m", *shlex.split(line), *options] for line in block("sh", 1).splitlines())
    for words in (bless, check):
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout
    baselines = {path.name for path in (tmp_path / "baselines").iterdir()}
    assert baselines == {"contact.h5", "test_contact-test_result.h5"}
    (tmp_path / "contact.toml").write_text(CONTACT.replace("6e9", "6.1e9"), encoding="utf-8")
    failed = subprocess.run(check, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "2 failed" in failed.stdout
    assert failed.stdout.count("physics config: K is 6100000000, in BASELINE 6000000000") == 2


def test_the_examples_of_the_action_and_the_hook_use_what_exists() -> None:
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    used = next(
        step["with"]
        for step in yaml.safe_load(block("yaml", 1))["jobs"]["regression"]["steps"]
        if "impact@" in step["uses"]
    )
    required = {name for name, spec in action["inputs"].items() if spec.get("required")}
    assert required <= used.keys() <= action["inputs"].keys()
    rows = dict(re.findall(r"^\| `([\w-]+)` \| .* \| (.+) \|$", PAGE, re.MULTILINE))
    assert rows.keys() == action["inputs"].keys()
    for name, spec in action["inputs"].items():
        assert not spec.get("default") or rows[name] == f"`{spec['default']}`"
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    (repository,) = yaml.safe_load(block("yaml", 2))["repos"]
    assert [entry["id"] for entry in repository["hooks"]] == [hook["id"]]


def test_the_readme_shows_the_same_steps(steps: list[dict[str, str]]) -> None:
    shown = re.findall(r"- run: (.*)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert shown == [step["run"] for step in steps if "run" in step and "if" not in step]
