"""Plots of the configs of Figures 2, 3 and 5 of the paper mark the points that the paper names."""

from __future__ import annotations

import functools
import math
import shutil
import subprocess
from pathlib import Path

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import impact
from impact.plots.curves import CurveData, Panel
from impact.plots.draw import draw, get_plot_data
from impact.plots.kinds import Choice, Look
from impact.plots.labels import symbol

from .conftest import ROOT, Run

# Table 1: peak indentation [m] and force [N] of Hertz
PEAK, FORCE = 1.008542975e-4, 6197.0587
# peak indentation of a linear spring of stiffness FORCE/PEAK [m]
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


@functools.cache
def figure_data(figure: str) -> CurveData:
    """The data of a figure of the paper."""
    result = impact.sweep(ROOT / "configs" / f"figure{figure}.toml")
    data = get_plot_data(result, "impulse" if figure == "2" else "loop", Choice())
    assert isinstance(data, CurveData)
    return data


def only_panel(data: CurveData) -> Panel:
    (panel,) = data.panels
    return panel


@pytest.mark.parametrize("figure", MARKS)
def test_a_figure_marks_the_points_of_the_paper(figure: str) -> None:
    marks = {mark.label: (mark.x, mark.y) for mark in only_panel(figure_data(figure)).marks}
    assert marks.keys() == MARKS[figure].keys()
    for name, point in MARKS[figure].items():
        assert marks[name] == pytest.approx(point, rel=1e-7, abs=1e-12), name


@pytest.mark.slow
@pytest.mark.parametrize("figure", MARKS)
@pytest.mark.parametrize("width", [3.5, 7.1])
def test_labels_of_marks_overlap_no_text_and_no_curve(figure: str, width: float) -> None:
    drawn_figure = draw(figure_data(figure), Look(width))
    FigureCanvasAgg(drawn_figure).draw()
    (axes,) = drawn_figure.axes
    names = [text for text in axes.texts if text.get_text() in {symbol(mark) for mark in MARKS[figure]}]
    assert len(names) == len(MARKS[figure])
    boxes = [text.get_window_extent() for text in axes.texts]
    for index, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:index])
    for text in names:
        box = text.get_window_extent()
        assert drawn_figure.bbox.x0 <= box.x0 < box.x1 <= drawn_figure.bbox.x1, text
        for line in (line for line in axes.lines if len(line.get_xydata()) > 2):
            points = axes.transData.transform(line.get_xydata())
            assert not any(box.contains(*point) for point in points), (text, line)


def test_a_plot_of_several_laws_marks_only_the_impulse_common_to_all() -> None:
    config = ROOT / "configs" / "figure6.toml"
    result = impact.sweep(config, overrides=["sweep.e=0.5", "solver.rtol=1e-4"])
    for kind, labels in (("loop", []), ("impulse", ["tau_c"])):
        data = get_plot_data(result, kind, Choice())
        assert [mark.label for mark in only_panel(data).marks] == labels  # type: ignore[arg-type]


def test_a_plot_of_a_damped_law_marks_its_peak_indentation_but_no_peak_force() -> None:
    collision = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.2})
    data = get_plot_data(collision.history, "loop", Choice())  # type: ignore[arg-type]
    assert [mark.label for mark in only_panel(data).marks] == ["delta_m"]  # type: ignore[arg-type]


def test_plots_show_the_exponent_of_each_law() -> None:
    for figure, n in (("5b", "1.5"), ("5c", "1")):
        assert figure_data(figure).conditions.replace("\N{NO-BREAK SPACE}", " ").endswith(f"n = {n}")
    sweep = {"e": [0.2, 0.5], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": "a"}
    config = {"sweep": sweep, "materials": {"a": {"E": 56e9, "nu": 0.3, "rho": 2712}}}
    both = impact.sweep({"models": ["hertz", "bilinear"], **config, "solver": {"rtol": 1e-4}})
    for kind in ("final-velocities", "loop"):
        for models, n in (([], "1.5 (1 for bilinear)"), (["hertz"], "1.5"), (["bilinear"], "1")):
            conditions = get_plot_data(both, kind, Choice(models=models or None)).conditions
            assert f"n = {n}," in f"{conditions},".replace("\N{NO-BREAK SPACE}", " "), (kind, models)


@pytest.mark.slow
def test_info_and_the_report_show_the_exponent_of_the_law(cli: Run, tmp_path: Path) -> None:
    config = ROOT / "configs" / "figure5c.toml"
    impact.save(impact.sweep(config, overrides=["solver.rtol=1e-4"]), tmp_path / "bilinear.h5")
    lines = [line.split() for line in cli("info", "bilinear.h5", cwd=tmp_path).stdout.splitlines()]
    assert ["n", "1"] in lines
    page = impact.report(impact.load(tmp_path / "bilinear.h5"))
    assert '<th scope="row">n</th>\n<td data-head="value">1</td>' in page


@pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")
def test_make_figures_runs_the_commands_of_every_figure() -> None:
    process = subprocess.run(
        ["make", "-n", "figures", "RESULTS=results"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for figure in (*MARKS, "6"):
        assert f"impact sweep configs/figure{figure}.toml -o results/figure{figure}.h5" in process.stdout
        kind = {"2": "--kind impulse ", "6": ""}.get(figure, "--kind loop ")
        assert (
            f"impact plot results/figure{figure}.h5 {kind}--equations -o results/figure{figure}.png --overwrite"
            in process.stdout
        )
