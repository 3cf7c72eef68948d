"""Figures 2, 3 and 5 of the paper: one config each, with the points marked that the paper names."""

from __future__ import annotations

import math
import shutil
import subprocess

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import impact
from impact import api
from impact.plots.curves import CurveData, Panel
from impact.plots.kinds import Choice, draw
from impact.plots.labels import symbol

from .conftest import ROOT, Run

# Table 1: peak indentation [m] and force [N] of Hertz
PEAK, FORCE = 1.008542975e-4, 6197.0587
# of a linear spring of stiffness F/x of that peak
LINEAR = math.sqrt(0.5 / (FORCE / PEAK))
MARKS = {
    "2": {"tau_c": (0.5, 0.5), "tau_f": (0.75, 0.75)},
    "3": {"delta_m": (PEAK, FORCE), "f_m": (PEAK, FORCE)},
    "5a": {"delta_m": (PEAK, FORCE), "f_m": (PEAK, FORCE), "delta_p": (0.75 * PEAK, 0.0)},
    "5b": {"delta_m": (PEAK, FORCE), "f_m": (PEAK, FORCE), "delta_p": (0.75 * PEAK, 0.0)},
    "5c": {
        "delta_m": (LINEAR, FORCE / PEAK * LINEAR),
        "f_m": (LINEAR, FORCE / PEAK * LINEAR),
        "delta_p": (0.75 * LINEAR, 0.0),
    },
}


def numbers(figure: str) -> CurveData:
    """The numbers of a figure of the paper."""
    result = impact.sweep(ROOT / "configs" / f"figure{figure}.toml")
    found = api.get_plot_data(result, "impulse" if figure == "2" else "loop", Choice())
    assert isinstance(found, CurveData)
    return found


def only(lines: CurveData) -> Panel:
    (panel,) = lines.panels
    return panel


@pytest.mark.parametrize("figure", MARKS)
def test_a_figure_marks_the_points_of_the_paper(figure: str) -> None:
    marks = {mark.label: (mark.x, mark.y) for mark in only(numbers(figure)).marks}
    assert marks.keys() == MARKS[figure].keys()
    for name, point in MARKS[figure].items():
        assert marks[name] == pytest.approx(point, rel=1e-7, abs=1e-12), name


@pytest.mark.parametrize("figure", MARKS)
@pytest.mark.parametrize("width", [3.5, 7.1])
def test_names_of_marks_are_legible(figure: str, width: float) -> None:
    drawn = draw(numbers(figure), width)
    FigureCanvasAgg(drawn).draw()
    (axes,) = drawn.axes
    names = [text for text in axes.texts if text.get_text() in {symbol(mark) for mark in MARKS[figure]}]
    assert len(names) == len(MARKS[figure])
    boxes = [text.get_window_extent() for text in axes.texts]
    for place, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:place])
    for text in names:
        box = text.get_window_extent()
        assert drawn.bbox.x0 <= box.x0 < box.x1 <= drawn.bbox.x1, text
        for line in (line for line in axes.lines if len(line.get_xydata()) > 2):
            points = axes.transData.transform(line.get_xydata())
            assert not any(box.contains(*point) for point in points), (text, line)


def test_several_laws_have_no_marks_but_the_impulse_they_share(figure6: object) -> None:
    for kind, labels in (("loop", []), ("impulse", ["tau_c"])):
        lines = api.get_plot_data(figure6, kind, Choice(sel={"e": 0.5}))  # type: ignore[arg-type]
        assert [mark.label for mark in only(lines).marks] == labels  # type: ignore[arg-type]


def test_a_damped_law_marks_no_largest_force_at_its_largest_indentation() -> None:
    shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.2})
    lines = api.get_plot_data(shot.history, "loop", Choice())  # type: ignore[arg-type]
    assert [mark.label for mark in only(lines).marks] == ["delta_m"]  # type: ignore[arg-type]


def test_the_exponent_shown_is_the_laws_own(figure6: object) -> None:
    for figure, n in (("5b", "1.5"), ("5c", "1")):
        assert numbers(figure).conditions.replace("\N{NO-BREAK SPACE}", " ").endswith(f"n = {n}")
    sweep = {"e": [0.2, 0.5], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "a"}
    config = {"sweep": sweep, "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}}}
    both = impact.sweep({"models": ["hertz", "bilinear"], **config})
    for kind in ("final-velocities", "loop"):
        for models, n in (([], "1.5 (1 for bilinear)"), (["hertz"], "1.5"), (["bilinear"], "1")):
            shown = api.get_plot_data(both, kind, Choice(models=models or None)).conditions
            assert f"n = {n}," in f"{shown},".replace("\N{NO-BREAK SPACE}", " "), (kind, models)


def test_info_and_the_report_show_the_laws_own_exponent(cli: Run, tmp_path: object) -> None:
    cli("sweep", ROOT / "configs" / "figure5c.toml", "-o", "bilinear.h5", cwd=tmp_path)
    lines = [line.split() for line in cli("info", "bilinear.h5", cwd=tmp_path).stdout.splitlines()]
    assert ["n", "1"] in lines
    page = impact.report(impact.load(tmp_path / "bilinear.h5"))  # type: ignore[operator]
    assert '<th scope="row">n</th>\n<td data-head="value">1</td>' in page


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_figures_draws_all_of_them() -> None:
    done = subprocess.run(
        ["make", "-n", "figures", "RESULTS=results"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for figure in (*MARKS, "6"):
        assert f"impact sweep configs/figure{figure}.toml -o results/figure{figure}.h5" in done.stdout
        kind = {"2": "--kind impulse ", "6": ""}.get(figure, "--kind loop ")
        assert (
            f"impact plot results/figure{figure}.h5 {kind}--equations -o results/figure{figure}.png --overwrite"
            in done.stdout
        )
