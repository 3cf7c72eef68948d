"""Build the distributions, check them, install them into empty environments, and run them: `make release-check`.

    python scripts/check_release.py [--python PYTHON ...] [--tests FILE ...] [--quick]

For each interpreter the wheel is installed with the newest versions of its dependencies and with the lowest that
pyproject.toml accepts, and the sdist with the newest. In each environment `pip check` runs, Figure 6 is swept,
compared with its baseline, drawn and reported, and a test uses the pytest plug-in. The outcomes are printed as a
table; the exit code is 1 if one of them failed.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parent.parent
# what installs a version without building it; the lowest version of a small package may have no wheel for an
# interpreter that is newer than it
COMPILED = ("numpy", "scipy", "pandas", "h5py", "matplotlib", "pydantic-core", "contourpy", "pillow", "kiwisolver")
TOOLS = ("build", "twine", "uv")
TEST_TOOLS = (
    "pytest>=8.2",
    "pytest-xdist>=3.6",
    "hypothesis>=6.100",
    "jsonschema>=4.20",
    "mpmath>=1.3",
    "pyyaml>=6.0",
)
REGRESSION_TEST = """
def test_figure6(impact_regression):
    verdict = impact_regression({config!r}, {baseline!r})
    assert verdict.equal
"""


class CheckError(Exception):
    """A check failed; the message is the end of what it printed."""


def run(*words: str | Path, cwd: Path) -> str:
    """Run a program and return what it prints.

    Raises
    ------
    CheckError : it exited with another code than 0
    """
    # neither this checkout nor settings of the shell reach the environments
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(word) for word in words], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode:
        last = "\n".join((done.stdout + done.stderr).strip().splitlines()[-12:])
        raise CheckError(f"{' '.join(map(str, words))}: exit code {done.returncode}\n{last}")
    return done.stdout


def create_environment(folder: Path, python: str, *requirements: str | Path) -> Path:
    """Create a virtual environment with some packages; returns the folder of its programs."""
    run(python, "-m", "venv", folder, cwd=ROOT)
    programs = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = (programs / "python", "-m", "pip", "--quiet", "--disable-pip-version-check", "install")
    run(*pip, "--upgrade", "pip", cwd=ROOT)
    if requirements:
        run(*pip, "--only-binary", ",".join(COMPILED), *requirements, cwd=ROOT)
    return programs


def lowest_versions(uv: Path, python: str) -> list[str]:
    """The lowest versions that pyproject.toml accepts and an interpreter can install, as requirements.

    An interpreter that is newer than the lowest version of a compiled package needs a higher one: NumPy 2.0 has no
    wheel for Python 3.13.
    """
    wheels = [word for name in COMPILED for word in ("--only-binary", name)]
    options = ("--resolution", "lowest-direct", "--python", python, "--no-header", "--no-annotate", *wheels)
    return run(uv, "pip", "compile", "--quiet", "pyproject.toml", *options, cwd=ROOT).split()


def version_problems(version: str) -> list[str]:
    """Files that state another version than the package; an unreleased entry of the changelog is none."""
    patterns = {
        "CITATION.cff": r"^version: (\S+)$",
        "recipe/meta.yaml": r'^{% set version = "(.+)" %}$',
    }
    problems = []
    for name, pattern in patterns.items():
        found = re.search(pattern, (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE)
        if found is None or found[1] != version:
            problems.append(f"{name}: got version {found and found[1]}, expected {version}")
    return problems


def changelog_note(version: str) -> str:
    """A note if the newest entry of the changelog is not that of the package."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest, date = re.findall(r"^## \[([\d.]+)\] - (\S+)$", text, re.MULTILINE)[0]
    return "" if newest == version else f"note: CHANGELOG.md: newest entry {newest} ({date}), package {version}"


def check_environment(programs: Path, folder: Path, version: str, tests: Sequence[str]) -> str:
    """Run what was installed; returns the versions of the main packages."""
    folder.mkdir()
    impact, python = programs / "impact", programs / "python"
    config, baseline = ROOT / "configs" / "figure6.toml", ROOT / "tests" / "data" / "figure6.h5"
    run(python, "-m", "pip", "--disable-pip-version-check", "check", cwd=folder)
    printed = run(impact, "--version", cwd=folder).strip()
    if printed != f"impact {version}":
        raise CheckError(f"impact --version: got {printed}, expected impact {version}")
    run(impact, "sweep", config, "--output", "results.h5", "--quiet", cwd=folder)
    run(impact, "compare", "results.h5", baseline, cwd=folder)
    run(impact, "plot", "results.h5", "--output", "results.png", cwd=folder)
    run(impact, "report", "results.h5", "--output", "report.html", cwd=folder)
    text = REGRESSION_TEST.format(config=str(config), baseline=str(baseline))
    (folder / "test_regression.py").write_text(text, encoding="utf-8")
    run(python, "-m", "pytest", "-W", "error", "-q", "test_regression.py", cwd=folder)
    if tests:
        # the tests treat warnings as errors; an old package is deprecated by newer ones that it is used with
        run(python, "-m", "pytest", "-n", "0", "-q", "-W", "ignore::DeprecationWarning", *tests, cwd=ROOT)
    code = "from importlib.metadata import version as v; print(v('numpy'), v('scipy'), v('h5py'), v('xarray'))"
    return run(python, "-c", code, cwd=folder).strip()


def main() -> int:
    """Run all checks and print a table; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--python", action="append", help="an interpreter; may be repeated (default: this one)")
    parser.add_argument("--tests", nargs="*", default=(), help="test files to run in each environment of a wheel")
    parser.add_argument("--quick", action="store_true", help="only the wheel with the newest dependencies")
    parser.add_argument("--dist", type=Path, help="copy the built files into this folder")
    options = parser.parse_args()
    is_failed = False
    with tempfile.TemporaryDirectory(prefix="impact-release-") as scratch:
        folder = Path(scratch)
        dist = folder / "dist"
        tools = create_environment(folder / "tools", sys.executable, *TOOLS)
        run(tools / "python", "-m", "build", "--outdir", dist, ROOT, cwd=folder)
        (wheel,), (sdist,) = (sorted(dist.glob(pattern)) for pattern in ("*.whl", "*.tar.gz"))
        print(run(tools / "python", "-m", "twine", "check", "--strict", wheel, sdist, cwd=folder).strip())
        if options.dist is not None:
            shutil.copytree(dist, options.dist, dirs_exist_ok=True)
        version = wheel.name.split("-")[1]
        for problem in version_problems(version):
            is_failed = True
            print(problem)
        print(changelog_note(version) or f"CHANGELOG.md: has {version}")
        test_tools = TEST_TOOLS if options.tests else TEST_TOOLS[:1]
        kinds: list[tuple[str, Path, Sequence[str]]] = [("wheel, newest", wheel, options.tests)]
        if not options.quick:
            kinds += [("wheel, lowest", wheel, options.tests), ("sdist, newest", sdist, ())]
        print(f"{'python':12}  {'installed':13}  outcome  numpy scipy h5py xarray")
        for number, python in enumerate(options.python or [sys.executable]):
            name = run(python, "-c", "import platform; print(platform.python_version())", cwd=folder).strip()
            for kind, file, tests in kinds:
                place = folder / f"{number}-{kind.replace(', ', '-')}"
                try:
                    pins = lowest_versions(tools / "uv", python) if kind.endswith("lowest") else []
                    programs = create_environment(place, python, file, *pins, *test_tools)
                    outcome = f"ok       {check_environment(programs, place / 'run', version, tests)}"
                except CheckError as error:
                    is_failed = True
                    outcome = f"failed   {error}"
                print(f"{name:12}  {kind:13}  {outcome}", flush=True)
    return int(is_failed)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except CheckError as error:
        sys.exit(str(error))
