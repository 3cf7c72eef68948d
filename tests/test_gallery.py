"""docs/gallery.md has a plot of every kind, and the plotted values are those that its commands give now."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from impact.plots.kinds import KINDS

from .conftest import ROOT, Run

sys.path.insert(0, str(ROOT / "scripts"))
import gallery

FOLDER = ROOT / "docs" / "gallery"
NUMBERS = FOLDER / "numbers.json"


def test_the_page_has_every_kind() -> None:
    assert [entry.kind for entry in gallery.ENTRIES] == list(KINDS)
    assert {path.name for path in FOLDER.iterdir()} == {
        NUMBERS.name,
        "speeds.toml",
        *(entry.picture for entry in gallery.ENTRIES),
    }


# one test, so that the results are made once
@pytest.mark.slow
def test_the_values_of_the_plots_are_fresh(cli: Run, tmp_path: Path) -> None:
    gallery.write_results(tmp_path, cli)
    stored = json.loads(NUMBERS.read_text(encoding="utf-8"))
    for entry in gallery.ENTRIES:
        data = f"{entry.kind}.csv"
        done = cli(*entry.command[1:], "--data", data, "--data-form", "long", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        now = gallery.summary(tmp_path / data)
        assert now.keys() == stored[entry.kind].keys()
        for name, column in stored[entry.kind].items():
            fresh = column if isinstance(column[0], str) else pytest.approx(column, rel=1e-6, abs=1e-9)
            assert now[name] == fresh, f"{entry.kind}, {name}: run `make docs`"


def test_a_changed_value_or_order_changes_the_summary(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    summaries = []
    for values in (("1.0", "2.0", "3.0"), ("1.0", "2.0", "3.001"), ("2.0", "1.0", "3.0")):
        rows = [f"{name},{value}" for name, value in zip("aab", values, strict=True)]
        table.write_text("\n".join(["curve,x", *rows]), encoding="utf-8")
        summaries.append(gallery.summary(table))
    assert all(summary != summaries[0] for summary in summaries[1:])
