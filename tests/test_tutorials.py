"""The tutorials and the README print what their commands print, and the index of the site has every page."""

from __future__ import annotations

import math
import re
import shlex
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as t_distribution

from impact.config.load import read_config

from .conftest import ROOT, Run, assert_same_output, code_blocks, examples_of
from .test_peers import PYTHON

DOCS = ROOT / "docs"
PAGES = [
    *(str(page.relative_to(ROOT)) for page in sorted((DOCS / "tutorials").glob("*.md"))),
    "README.md",
    "docs/calibrate.md",
    "docs/uncertainty.md",
    "docs/start.md",
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "printed"),
    [pytest.param(*example, id=f"{page}: {example[0]}") for page in PAGES for example in examples_of(page)],
)
def test_a_page_prints_what_its_commands_print(cli: Run, tmp_path: Path, command: str, printed: str) -> None:
    """Numbers may differ in the last digit that is printed; errors of the solver are below 1e-9."""
    # an output that is not named is written into the folder
    for path in ("docs", "configs"):
        (tmp_path / path).symlink_to(ROOT / path)
    done = cli(*shlex.split(command), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert_same_output(done.stdout, printed)


@pytest.mark.slow
def test_the_commands_of_a_figure_for_a_paper(cli: Run, tmp_path: Path) -> None:
    text = (DOCS / "tutorials" / "paper.md").read_text(encoding="utf-8")
    (config,) = code_blocks(text, "toml")
    (tmp_path / "contact.toml").write_text(config, encoding="utf-8")
    for block in code_blocks(text, "sh"):
        for line in block.splitlines():
            done = cli(*shlex.split(line)[1:], cwd=tmp_path)
            assert done.returncode == 0, (line, done.stderr)
    assert {path.name for path in tmp_path.iterdir()} >= {"contact.h5", "restitution.pdf", "restitution.csv"}


@pytest.mark.slow
def test_the_band_of_an_impact_with_a_fitted_law(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "docs").symlink_to(DOCS)
    (block,) = code_blocks((DOCS / "calibrate.md").read_text(encoding="utf-8"), "sh")
    texts = []
    for line in block.splitlines():
        done = cli(*shlex.split(line)[1:], cwd=tmp_path)
        assert done.returncode == 0, (line, done.stderr)
        texts.append(done.stdout)
    _, highest, lowest, study = texts
    ends = [float(re.search(r"e_out +(\S+)", text)[1]) for text in (highest, lowest)]
    mean, deviation = map(float, re.search(r"mean (\S+), sd (\S+),", study).groups())
    np.testing.assert_allclose(ends, [mean + 1.96 * deviation, mean - 1.96 * deviation], atol=5e-4)


def test_the_table_of_the_laboratory_is_read_as_its_page_says() -> None:
    text = (DOCS / "tutorials" / "laboratory.md").read_text(encoding="utf-8")
    table, config = (
        (DOCS / "calibrate" / f"balls.{ending}").read_text(encoding="utf-8") for ending in ("csv", "toml")
    )
    (excerpt,), (data,) = code_blocks(text, "text"), code_blocks(text, "toml")
    assert {*excerpt.splitlines()} - {"..."} <= {*table.splitlines()}
    assert data in config
    read = read_config(DOCS / "calibrate" / "balls.toml", purpose="calibrate")
    assert read.data is not None
    assert {ball: read.data.specimens.count(ball) for ball in "ABC"} == {"A": 4, "B": 3, "C": 4}
    assert len(read.notes) == 2


def export_of_the_laboratory(cli: Run, folder: Path) -> Path:
    """Run the commands of the page up to the script for LAMMPS."""
    assert cli("calibrate", DOCS / "calibrate" / "balls.toml", "-o", "fit.h5", cwd=folder).returncode == 0
    (commands,) = code_blocks((DOCS / "tutorials" / "laboratory.md").read_text(encoding="utf-8"), "sh")
    _, *words = shlex.split(commands.splitlines()[0])
    done = cli(*words, "--code-version", "22Jul2025", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "drop.lmp"


def interval_of_the_laboratory() -> tuple[float, float]:
    """The interval of 95 % of the mean of the restitutions from 20 cm, by Student's t."""
    rows = [row.split(";") for row in (DOCS / "calibrate" / "balls.csv").read_text("utf-8").splitlines()]
    heights = [float(row[2].replace(",", ".")) for row in rows if row[1:2] == ["20"]]
    e = np.sqrt(np.array(heights) / 20.0)
    half = t_distribution.ppf(0.975, e.size - 1) * e.std(ddof=1) / math.sqrt(e.size)
    return e.mean() - half, e.mean() + half


@pytest.mark.slow
def test_the_script_of_the_laboratory_predicts_the_measured_mean_within_its_interval(
    cli: Run, tmp_path: Path
) -> None:
    script = export_of_the_laboratory(cli, tmp_path).read_text(encoding="utf-8")
    low, high = interval_of_the_laboratory()
    (mean,) = re.findall(r"mean e ([0-9.]+)", script)
    assert low < float(mean) < high


@pytest.mark.peers
def test_lammps_measures_the_mean_of_the_laboratory_within_its_interval(cli: Run, tmp_path: Path) -> None:
    program = Path(PYTHON).with_name("lmp")
    if not program.exists():
        pytest.skip(f"{program} is not installed")
    script = export_of_the_laboratory(cli, tmp_path)
    words = [str(program), "-in", script.name]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True)
    low, high = interval_of_the_laboratory()
    measured = float(done.stdout.split("e_out = ")[-1].split()[0])
    page = (DOCS / "tutorials" / "laboratory.md").read_text(encoding="utf-8")
    printed = float(re.findall(r"prints `e_out = ([0-9.]+)`", page)[0])
    assert measured == pytest.approx(printed, abs=1e-6)
    assert low < measured < high


def test_the_index_of_the_site_has_every_page() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = {line for block in code_blocks(index, "{toctree}") for line in block.splitlines()}
    files = (*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb"))
    # types.md is a part of the page reference/python
    pages = {page.relative_to(DOCS).with_suffix("").as_posix() for page in files} - {"index", "types"}
    generated = {page for page in pages if page.startswith("reference/")}
    assert pages - generated <= listed
    assert {page for page in listed if page and not page.startswith((":", "reference/"))} <= pages
