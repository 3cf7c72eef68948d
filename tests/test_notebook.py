"""What a notebook shows of the objects that the functions return."""

from __future__ import annotations

import re

import pytest

import impact
from impact.errors import UsageError

from .conftest import ROOT, Run

SHOT = {"models": "hunt-crossley-1975", "sweep": {"e": 0.6, "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 1e6}}


def cells(html: str) -> list[list[str]]:
    """The texts of the cells of a table, row by row."""
    return [re.findall("<t[dh][^>]*>(.*?)</t[dh]>", row) for row in re.findall("<tr>(.*?)</tr>", html)]


def test_an_impact_has_the_rows_of_the_command_line(cli: Run) -> None:
    shown = dict(cells(impact.run(model="hertz", at={"e": 0.5})._repr_html_()))
    printed = cli("run", "--model", "hertz", "--at", "e=0.5").stdout
    assert "e_energetic" in shown
    for name, text in shown.items():
        line = next(line for line in printed.splitlines() if line.startswith(f"{name} "))
        assert text.split()[0] in line


def test_a_ranking_has_its_headline_and_a_row_for_each_model() -> None:
    ranking = impact.recommend(impact.sweep(ROOT / "configs" / "figure6.toml"))
    html = ranking._repr_html_()
    assert ranking.headline in html
    headings, *rows = cells(html)
    assert headings == list(ranking.headings)
    assert [row[0] for row in rows] == [model.name for model in ranking.models]


def test_a_verdict_has_its_headline_and_the_variables_that_changed() -> None:
    result = impact.sweep(SHOT)
    moved = result.assign(e_out=result["e_out"] + 1e-3)
    html = impact.compare(moved, result)._repr_html_()
    assert "not equal: values (e_out)" in html
    assert [row[0] for row in cells(html)[1:]] == ["e_out"]
    assert "equal: 19 variables" in impact.compare(result, result)._repr_html_()


def test_the_catalogue_is_a_table_and_a_short_text() -> None:
    models = impact.models(pattern="lankarani-*")
    assert [row[0] for row in cells(models._repr_html_())[1:]] == list(models)
    assert repr(models) == "2 models: lankarani-nikravesh-1990, lankarani-nikravesh-1994"


def test_texts_are_escaped() -> None:
    result = impact.sweep(SHOT)
    attributed = result.assign_attrs(impact_version="<script>alert(1)</script>")
    html = impact.compare(attributed, result)._repr_html_()
    assert "&lt;script&gt;" in html
    assert "<script>" not in html


def test_an_impact_is_drawn_as_its_loop_or_over_time() -> None:
    shot = impact.run(SHOT)
    (axes,) = impact.plot(shot).axes
    assert shot.history is not None
    assert axes.lines[0].get_xdata().size == shot.history.sizes["t"]
    assert len(impact.plot(shot, kind="history").axes) > 1
    apart = impact.run(SHOT, at={"v1": -1.0})
    with pytest.raises(UsageError, match="no motion to draw: "):
        impact.plot(apart)
