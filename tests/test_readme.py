"""The examples of the README run, and numbers in the docs match the code."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from .conftest import ROOT, Run, code_blocks

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return code_blocks(README, language)


def test_the_readme_opens_with_the_installation_the_picture_and_two_commands() -> None:
    assert README.index("pip install .") < README.index("docs/figure6.png") < README.index("make figure")
    install, quick_start = (block.splitlines() for block in blocks("sh")[:2])
    assert "pip install ." in install
    assert quick_start == ["make figure", "make test"]
    for target in ("help", "figure", "test", "check"):
        assert re.search(rf"^{target}:.*##", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)


@pytest.mark.slow
def test_the_toml_and_the_commands_of_daily_use(cli: Run, tmp_path: Path) -> None:
    (toml,) = blocks("toml")
    (tmp_path / "config.toml").write_text(toml, encoding="utf-8")
    commands = [line for block in blocks("sh")[2:] for line in block.splitlines() if line]
    assert len(commands) == 22
    for folder in ("configs", "docs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    (tmp_path / "measured.csv").write_text("e, e_out, sigma\n0.5, 0.45, 0.02\n", encoding="utf-8")
    for line in commands:
        program, *words = shlex.split(line)
        assert program == "impact"
        done = cli(*words, cwd=tmp_path)
        assert done.returncode == 0, (line, done.stderr)
    written = {"results.h5", "results.png", "baseline.h5", "differences.png", "figure-map.svg", "report.html"}
    written |= {"oblique.h5", "oblique-spin.svg"}
    assert written <= {path.name for path in tmp_path.iterdir()}


@pytest.mark.slow
def test_the_python(tmp_path: Path) -> None:
    (tmp_path / "configs").symlink_to(ROOT / "configs")
    # each block alone, in one process, which imports the package once
    code = "".join(f"exec({block!r}, {{}})\n" for block in blocks("python"))
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_numbers_and_the_config_of_the_page_on_sweeps_match_the_code() -> None:
    from impact.config.grid import MAX_POINTS
    from impact.config.load import parse_config
    from impact.config.quantities import MAX_AXIS_VALUES
    from impact.engine.trajectories import MAX_CELLS, RANGE_TRAJECTORIES
    from impact.results.netcdf import CHUNK_VALUES
    from impact.results.sweep import NO_CHECKPOINT_POINTS

    page = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
    for number in (NO_CHECKPOINT_POINTS, CHUNK_VALUES, MAX_AXIS_VALUES, RANGE_TRAJECTORIES, MAX_CELLS):
        assert f"{number:,}" in page
    assert MAX_POINTS == 10**9
    (toml,) = code_blocks(page, "toml")
    output = parse_config((ROOT / "configs" / "figure6.toml").read_text(encoding="utf-8") + toml).output
    assert (output.dtype, output.compression, output.layout) == ("float32", "gzip", "full")
    assert output.chunks == {"e": 50}


def test_relative_links_lead_to_existing_files() -> None:
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
            # pages that the site alone has; its build finds those that are missing
            if not target.startswith("reference/") or page.parent == ROOT:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_the_readme_counts_the_codes_the_laws_and_the_speed_of_the_program() -> None:
    import impact
    from impact.exporters.registry import CODES

    text = " ".join(README.split())
    assert len(CODES) == 17
    assert "the laws of seventeen codes" in text
    (count,) = re.findall(r"a catalogue of more than (\d+) entries", text)
    assert int(count) < len(impact.models()) <= int(count) + 10
    # measured, on these pages
    (stated,) = re.findall(
        r"more than ([\d,]+) times as many .*? core, and more than ([\d,]+) times compiled", text
    )
    page = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    for core, least in zip(("numpy", "numba"), stated, strict=True):
        (ratio,) = re.findall(rf'^\| `core = "{core}"` \| 1 \|.* ([\d,]+) \|$', page, re.MULTILINE)
        assert 1.0 < int(ratio.replace(",", "")) / int(least.replace(",", "")) < 2.0
    assert "3 x 10^12 points of three models take seconds and a file of 0.7 MB" in text
    page = (ROOT / "docs" / "storage.md").read_text(encoding="utf-8")
    assert "large.h5: 3,001,500,000,000 points" in page
    assert "writes a file of 0.7 MB" in page


def test_the_citation_file_has_the_version_of_the_package() -> None:
    import impact

    assert f"version: {impact.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["README.md", "docs/physics.md"])
def test_the_laws_with_adhesion_are_named(page: str) -> None:
    import impact

    laws = [model for model in impact.models().values() if any("adhesi" in p.meaning for p in model.parameters)]
    (scope,) = re.findall(r"Adhesion is [^.]*\.", (ROOT / page).read_text(encoding="utf-8"))
    assert sorted(re.findall(r"`(\w+-\w+)`", scope)) == sorted(model.key for model in laws)
