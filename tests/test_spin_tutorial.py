"""The table and the commands of the tutorial on a ball with spin are those of the program."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import impact

from .conftest import ROOT, Run, code_blocks

PAGE = (ROOT / "docs" / "tutorials" / "spin.md").read_text(encoding="utf-8")
CONFIG = ROOT / "docs" / "spin.toml"


def test_the_page_shows_the_config() -> None:
    (shown,) = code_blocks(PAGE, "toml")
    assert shown.strip() in CONFIG.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_table_is_what_the_program_gives() -> None:
    result = impact.sweep(CONFIG).squeeze("model").sel(angle=np.pi / 4, method="nearest")
    rows = []
    for key in result["friction"].values[:3]:
        for spin in result["omega1"].values:
            point = result.sel(friction=key, omega1=spin)
            slip = 10.0 / 2.0**0.5 + 0.033 * spin
            cells = [
                f"`{key}`",
                f"{spin:.0f} rad/s",
                f"{slip:.2f} m/s",
                f"{float(point['beta']) + 0.0:.2f}",
                f"{float(point['e_t']):.2f}",
                f"{float(point['omega1_post']):.0f} rad/s",
                f"{np.degrees(float(point['rebound_angle'])):.0f}°",
            ]
            rows.append(f"| {' | '.join(cells)} |".replace("-0.00", "0.00").replace("| -", "| −"))
    table = re.findall(r"^\| `.*", PAGE, re.MULTILINE)
    assert table == rows


@pytest.mark.slow
def test_rigid_friction_has_the_least_e_t_of_a_contact_that_sticks() -> None:
    result = impact.sweep(CONFIG).sel(friction="coulomb-1785", omega1=0.0)
    assert "1/(1 + 0.56) = 0.641" in PAGE
    assert float(result["e_t"].min()) == pytest.approx(1.0 / 1.56, abs=1e-12)
    assert "squeezed by up to 14 mm" in PAGE
    assert round(float(result["peak_indentation"].max()), 3) == 0.014


@pytest.mark.slow
def test_the_commands_of_the_page(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    for block in code_blocks(PAGE, "sh"):
        for line in block.splitlines():
            done = cli(*shlex.split(line)[1:], cwd=tmp_path)
            assert done.returncode == 0, (line, done.stderr)
    assert {"spin.h5", "bounce-spin.png", "bounce-e-t.png"} <= {path.name for path in tmp_path.iterdir()}
