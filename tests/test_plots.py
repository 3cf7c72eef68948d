"""A plot shows the values of the slice that it names, fits any size, and has the same bytes in every process."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

import impact
from impact.errors import UsageError
from impact.plots.curves import CurveData, Panel
from impact.plots.draw import draw, get_plot_data
from impact.plots.kinds import KINDS, WIDTHS, Choice, Look, check_choice, find_kind
from impact.plots.style import save_figure
from impact.results.single_impact import Impact

from .conftest import ROOT, Run, one_line
from .fork_server import ForkServer

OTHER_RESULTS = ("timestep", "calibration", "uncertainty", "sensitivity")
MOTION_KINDS = [kind for kind in KINDS if find_kind(kind).source == "history" and not find_kind(kind).of_friction]
# those of the result of an ordinary sweep
CURVES = [
    kind for kind in KINDS if kind not in ("map", "validity", *OTHER_RESULTS) and not find_kind(kind).of_friction
]


def selection_of(kind: str) -> dict[str, float]:
    """What to select from a result over e: the motion of one impact, or nothing."""
    return {"e": 0.5} if kind in MOTION_KINDS else {}


def get_curve_data(dataset: xr.Dataset, kind: str = "final-velocities", **choice: object) -> CurveData:
    """The data of a plot of curves."""
    curve_data = get_plot_data(dataset, kind, Choice(**choice))  # type: ignore[arg-type]
    assert isinstance(curve_data, CurveData)
    return curve_data


def single_panel(curve_data: CurveData) -> Panel:
    """The panel of a plot that has a single panel."""
    (panel,) = curve_data.panels
    return panel


def conditions_of(curve_data: CurveData) -> str:
    """The conditions of a plot, with plain spaces."""
    return curve_data.conditions.replace("\N{NO-BREAK SPACE}", " ")


def names_of(figure: Figure) -> list[str]:
    """The names of a legend, of which each row may be one; line breaks are replaced by spaces."""
    return [text.get_text().replace("\n", " ") for legend in figure.legends for text in legend.get_texts()]


def legend_share(figure: Figure) -> float:
    """The part of the height of a figure that its legend takes."""
    figure.draw_without_rendering()
    boxes = [legend.get_window_extent() for legend in figure.legends]
    return float((max(box.y1 for box in boxes) - min(box.y0 for box in boxes)) / figure.bbox.height)


def texts_of(figure: Figure) -> list[Text]:
    """All visible texts, without labels of ticks beyond the ends of an axis."""
    texts = [*figure.texts, *(text for legend in figure.legends for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [text for text in axes.get_children() if isinstance(text, Text)]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                texts += [tick.label1, tick.label2] if low <= tick.get_loc() <= high else []
            texts += [axis.label, axis.get_offset_text()]
    return [text for text in texts if text.get_visible() and text.get_text().strip()]


def check_layout(figure: Figure) -> None:
    """No text over another, over a panel's edge or over the edge of the figure; the legend below all panels."""
    figure.draw_without_rendering()
    boxes = [(text, text.get_window_extent()) for text in texts_of(figure)]
    inside = figure.bbox.padded(1)
    within = {text for axes in figure.axes for text in axes.texts}
    for text, box in boxes:
        assert inside.x0 <= box.x0 < box.x1 <= inside.x1, text
        assert inside.y0 <= box.y0 < box.y1 <= inside.y1, text
        for axes in figure.axes:
            assert text in within or not box.padded(-1.5).overlaps(axes.get_window_extent()), (text, axes)
    for (text, box), (other, beside) in combinations(boxes, 2):
        assert not box.padded(-1.0).overlaps(beside.padded(-1.0)), (text, other)
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert not any(box.overlaps(axes.get_window_extent()) for axes in figure.axes)
    assert not figure.legends or legend_share(figure) < 0.55


@pytest.fixture(scope="module")
def coarse() -> xr.Dataset:
    """The result of configs/figure6.toml at 21 values of e and a tolerance at which histories are fast."""
    overrides = ["sweep.e.linspace=[0, 1, 21]", "solver.rtol=1e-4"]
    return impact.sweep(ROOT / "configs" / "figure6.toml", overrides=overrides)


@pytest.fixture(scope="module")
def coarse_file(coarse: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of `coarse`."""
    path = tmp_path_factory.mktemp("coarse") / "coarse.h5"
    impact.save(coarse, path)
    return path


@pytest.fixture(scope="module")
def plot_data_by_kind(coarse: xr.Dataset) -> dict[str, CurveData]:
    """The data of a plot of each kind of curves."""
    return {kind: get_curve_data(coarse, kind, sel=selection_of(kind)) for kind in CURVES}


@pytest.fixture(scope="module")
def many() -> xr.Dataset:
    """All models that need nothing but a stiffness and a restitution, over e."""
    sweep = {"e": {"linspace": [0.1, 1.0, 4]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    keys = [
        key
        for key, model in impact.models().items()
        if not model.same_as
        and model.exponent in (None, 1.5)
        and not any(parameter.default is None for parameter in model.parameters)
        and model.quantities <= {"e", "v0", "m", "K", "n", "m1", "m2", "lambda_"}
    ]
    assert len(keys) > 25
    return impact.sweep({"models": keys, "sweep": sweep, "solver": {"rtol": 1e-4}})


def test_figure_6_shows_the_stored_values(figure6: xr.Dataset) -> None:
    panel = single_panel(get_curve_data(figure6, equations=True))
    assert (panel.x_label, panel.x_name) == ("coefficient of restitution", "e")
    labels = [curve.label for curve in panel.curves if curve.end == "v₁⁺"]
    assert labels == [
        "Impulse-momentum (6), (7)",
        "Lankarani and Nikravesh, permanent indentation (1994), (29)-(32)",
        "Lankarani and Nikravesh (1990), (22)",
        "Gharib and Hurmuzlu (2012), (28)",
    ]
    for curve in panel.curves:
        ball = 1 if curve.end == "v₁⁺" else 2
        expected = (0.5 - figure6["e"] / 2) if ball == 1 else (0.5 + figure6["e"] / 2)
        if curve.model is not None:
            expected = figure6[f"v{ball}_post"].sel(model=curve.model)
        assert curve.x == tuple(figure6["e"].values)
        assert curve.y == pytest.approx(expected.values, abs=1e-15)


def test_numbers_of_equations_are_of_the_paper_only(plot_data_by_kind: dict[str, CurveData]) -> None:
    for curve_data in plot_data_by_kind.values():
        labels = [curve.label for panel in curve_data.panels for curve in panel.curves]
        assert labels
        assert not [label for label in labels if "(2" in label.replace("(20", "") or "(6)" in label]


def test_the_lines_are_the_curves_of_the_plot_data(figure6: xr.Dataset) -> None:
    panel = single_panel(get_curve_data(figure6))
    axes = impact.plot(figure6).axes[0]
    assert len(axes.lines) == len(panel.curves) == 8
    for line, curve in zip(axes.lines, panel.curves, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), curve.x)
        np.testing.assert_array_equal(line.get_ydata(), curve.y)
    assert axes.get_ylabel() == "Velocity after the impact $v_i^+$\xa0(m/s)"


def test_restitution_and_its_error_are_the_stored_values(figure6: xr.Dataset) -> None:
    asked, *delivered = single_panel(get_curve_data(figure6, "restitution")).curves
    assert (asked.model, asked.x, asked.y) == (None, asked.y, asked.x)
    signed, absolute = get_curve_data(figure6, "error").panels
    for key, out, off, size in zip(
        figure6["model"].values, delivered, signed.curves, absolute.curves, strict=True
    ):
        assert out.model == off.model == size.model == key
        np.testing.assert_array_equal(out.y, figure6["e_out"].sel(model=key))
        np.testing.assert_array_equal(off.y, figure6["e_error"].sel(model=key))
        np.testing.assert_array_equal(size.y, np.abs(off.y))
    assert absolute.y_log
    # smaller errors are errors of the solver, and are drawn at the end of the logarithmic axis
    assert min(min(size.y) for size in absolute.curves) < 1e-9
    drawn = draw(get_curve_data(figure6, "error"), Look()).axes[1].lines
    assert min(np.min(np.asarray(line.get_ydata(), float)) for line in drawn) == 1e-9
    assert (signed.bands, absolute.bands) == ((0.05, 0.01), (0.05, 0.01))


def test_an_error_needs_a_restitution_asked_for() -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9}})
    with pytest.raises(UsageError, match="needs a requested e"):
        get_curve_data(result, "error")
    assert [curve.model for curve in single_panel(get_curve_data(result, "restitution")).curves] == ["hertz"]
    # where the balls do not approach, e is asked for
    sweep = {"e": [0.5, 1.0], "v1": [-1.0, 1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    missed = impact.sweep({"models": "hertz", "sweep": sweep})
    with pytest.raises(UsageError, match=r"no model has a restitution here; choose other values \(sel\)"):
        get_curve_data(missed, "error")
    assert get_curve_data(missed, "error", sel={"v1": 1.0}).panels


@pytest.fixture(scope="module")
def single_impacts() -> dict[str, Impact]:
    """The impacts of two models at e = 0.5, with the tolerance of `coarse`."""
    keys = ["gharib-hurmuzlu-2012", "lankarani-nikravesh-1990"]
    return {key: impact.run(model=key, at={"e": 0.5}, overrides=["solver.rtol=1e-4"]) for key in keys}


@pytest.mark.parametrize("kind", MOTION_KINDS)
def test_a_motion_is_that_of_a_single_impact(
    plot_data_by_kind: dict[str, CurveData], single_impacts: dict[str, Impact], kind: str
) -> None:
    curve_data = plot_data_by_kind[kind]
    assert "e = 0.5" in conditions_of(curve_data)
    for panel in curve_data.panels:
        # an animation shows the first law
        drawn = {curve.model for curve in panel.curves}
        assert len(drawn) == 1 if kind == "animation" else single_impacts.keys() <= drawn
        for curve in panel.curves:
            if curve.model not in single_impacts:
                continue
            single = single_impacts[curve.model]
            history = single.history
            assert history is not None
            if panel.y_name == "x":
                # the displacements of an animation are at its frames, before and after the contact too
                inside = (np.asarray(curve.x) >= 0.0) & (curve.x <= history["t"].values[-1])
                expected = np.interp(curve.x, history["t"], history[f"x{curve.case[-1]}"])
                np.testing.assert_array_equal(np.asarray(curve.y)[inside], expected[inside])
                continue
            assert len(curve.x) == history.sizes["t"]
            if kind == "loop":
                np.testing.assert_array_equal(curve.x, history["delta"])
                np.testing.assert_array_equal(curve.y, history["F"])
            elif kind in ("history", "animation"):
                np.testing.assert_array_equal(curve.x, history["t"])
            else:
                # the last impulse is that of both phases, m v0 (1 + e_out)
                assert curve.x[-1] == pytest.approx(0.5 * (1.0 + single.values["e_out"]), rel=1e-9)


def test_a_history_file_is_drawn_as_it_is(tmp_path: Path) -> None:
    history = impact.run(model="hunt-crossley-1975", at={"e": 0.5}).history
    assert history is not None
    impact.save(history, tmp_path / "history.h5")
    stored = impact.load(tmp_path / "history.h5")
    (curve,) = single_panel(get_curve_data(stored, "loop")).curves
    np.testing.assert_array_equal(curve.y, history["F"])
    with pytest.raises(UsageError, match="time history"):
        get_curve_data(stored, "restitution")


def test_the_impulse_diagram_ends_where_impulse_and_momentum_say(figure6: xr.Dataset) -> None:
    curve_data = get_curve_data(figure6, "impulse", sel={"e": 0.25}, models=["lankarani-nikravesh-1994"])
    ends = {(curve.model, curve.variable): (curve.x[-1], curve.y[-1]) for curve in single_panel(curve_data).curves}
    # two equal balls of 1 kg, one at rest: tau = m v0 (1 + e) = 0.625 N s
    assert ends[None, "v1"] == pytest.approx((0.625, 0.375))
    assert ends[None, "v2"] == pytest.approx((0.625, 0.625))
    for ball in ("v1", "v2"):
        assert ends["lankarani-nikravesh-1994", ball] == pytest.approx(ends[None, ball], abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "choice", "words"),
    [
        ("lop", {}, 'no kind "lop"; did you mean "loop"?'),
        (
            "loop",
            {"models": ["gharib-hurmuzlu-2012"], "sel": {"e": 0.0}},
            "no motion to draw at e = 0.0: closed-form limit",
        ),
        ("loop", {"sel": {"e": 0.0}, "models": ["gharib-hurmuzlu-2012"]}, "; choose another point on e (sel)"),
        ("loop", {"sel": {"e": 0.5}, "models": ["herz"]}, 'no model "herz" in this result'),
        ("loop", {"sel": {"m3": 0.5}}, 'no input "m3" here'),
    ],
)
def test_a_motion_that_cannot_be_drawn_is_an_error_of_one_line(
    coarse: xr.Dataset, kind: str, choice: dict[str, object], words: str
) -> None:
    with pytest.raises(UsageError, match=one_line(words)):
        get_curve_data(coarse, kind, **choice)


def test_a_motion_is_at_the_middle_of_e_and_names_laws_without_one(coarse: xr.Dataset) -> None:
    middle = get_curve_data(coarse, "loop")
    assert "e = 0.5" in conditions_of(middle)
    assert (len(single_panel(middle).curves), middle.not_drawn) == (3, ())
    at_zero = get_curve_data(coarse, "loop", sel={"e": 0.0})
    assert [curve.model for curve in single_panel(at_zero).curves] == ["lankarani-nikravesh-1990"]
    assert [text.partition(",")[0] for text in at_zero.not_drawn] == [
        f"{key} (closed-form limit" for key in ("lankarani-nikravesh-1994", "gharib-hurmuzlu-2012")
    ]


def test_an_axis_label_has_one_prefix_of_its_unit(coarse: xr.Dataset) -> None:
    axes = impact.plot(coarse, kind="loop", sel={"e": 0.5}).axes[0]
    assert axes.get_xlabel() == r"Indentation $\delta$" + "\xa0(µm)"
    assert axes.get_ylabel() == "Contact force $F$\xa0(kN)"
    # the plotted data are in SI, so that a user can add curves
    assert 5e-5 < max(max(line.get_xdata()) for line in axes.lines) < 2e-4
    axes.figure.draw_without_rendering()
    ticks = [text.get_text() for text in axes.get_xticklabels()]
    assert {"0", "20", "100"} <= set(ticks)


def test_a_stiffness_at_an_axis_has_the_number_of_its_exponent() -> None:
    laws = {"models": ["hertz", "kelvin-voigt"], "model": {"kelvin-voigt": {"C": 10.0, "K": [1e5, 2e5]}}}
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "e": 0.5, "K": [1e6, 1e8]}
    result = impact.sweep({**laws, "sweep": sweep, "output": {"variables": ["e_error", "e_out", "stiffness"]}})
    for x, unit in (("K", "MN/m$^{1.5}$"), ("kelvin-voigt.K", "kN/m")):
        drawn = result.isel({"K" if x != "K" else "kelvin-voigt.K": 0})
        assert impact.plot(drawn, kind="error", x=x).axes[-1].get_xlabel().endswith(f"({unit})")
    of_stiffness = {"kind": "map", "variable": "stiffness", "x": "K", "y": "kelvin-voigt.K"}
    *_, bar = impact.plot(result, models=["hertz"], **of_stiffness).axes
    assert bar.get_ylabel().endswith("(MN/m$^{1.5}$)")
    # the laws have different exponents
    *_, bar = impact.plot(result, **of_stiffness).axes
    assert bar.get_ylabel().endswith("(MN/m^n)")


def test_numbers_of_a_narrow_axis_are_those_of_its_ticks() -> None:
    """Nearly elastic impacts have restitutions that differ in the sixth digit."""
    result = impact.sweep(models=["hunt-crossley-1975"], e=[0.99999, 0.999993], v1=[1000.001, 1000.002, 1000.003])
    for name in ("e", "v1"):
        axes = impact.plot(result, kind="restitution", x=name).axes[0]
        axes.figure.draw_without_rendering()
        for axis, size in ((axes.xaxis, 1e3 if name == "v1" else 1.0), (axes.yaxis, 1.0)):
            numbers = [float(label.get_text()) * size for label in axis.get_ticklabels()]
            assert numbers == pytest.approx(axis.get_majorticklocs(), rel=1e-11)


def test_a_stiffness_is_stated_with_the_unit_of_the_laws_that_use_it() -> None:
    """A linear law with a K in its table comes first, beside a K of the sweep in N/m^1.5."""
    settings = {"model.kelvin-voigt": {"K": 1e5, "C": 1.0}}
    result = impact.sweep(models=["kelvin-voigt", "hertz"], K=2e6, m1=1.0, m2=1.0, overrides=settings)
    loop, alone = (
        get_curve_data(result, "loop", **law).conditions.replace("\N{NO-BREAK SPACE}", " ")
        for law in ({}, {"models": ["kelvin-voigt"]})
    )
    assert "K = 2 MN/m^1.5" in loop
    assert "K = " not in alone


# a width of 3.5 in is hardly more than 84 mm
@pytest.mark.slow
@pytest.mark.parametrize("width", ["84mm", 7.1, "single"], ids=str)
@pytest.mark.parametrize("kind", CURVES)
def test_texts_do_not_overlap(plot_data_by_kind: dict[str, CurveData], kind: str, width: float | str) -> None:
    figure = draw(plot_data_by_kind[kind], Look(width))
    expected = {"84mm": 84 / 25.4, "single": 3.5, 7.1: 7.1}[width]
    assert figure.get_figwidth() == pytest.approx(expected)
    check_layout(figure)


@pytest.mark.parametrize(
    ("smallest", "largest", "height"), [(1e-9, 1.0, 2.5), (1e-9, 30.0, 5.0), (0.02, 1.0, 2.5)]
)
def test_labels_of_bands_are_apart_and_inside_their_panel(
    plot_data_by_kind: dict[str, CurveData], smallest: float, largest: float, height: float
) -> None:
    data = replace(plot_data_by_kind["error"], title="", conditions="")
    absolute = data.panels[1]
    curve = replace(absolute.curves[0], x=(0.0, 1.0), y=(smallest, largest))
    figure = draw(replace(data, panels=(data.panels[0], replace(absolute, curves=(curve,)))), Look(3.5, height))
    figure.draw_without_rendering()
    axes = figure.axes[1]
    wide, narrow = (text.get_window_extent() for text in axes.texts)
    assert [text.get_text() for text in axes.texts] == ["0.05", "0.01"]
    assert wide.y0 > narrow.y1
    panel = axes.get_window_extent()
    assert panel.y0 <= narrow.y0 < wide.y1 <= panel.y1
    # beside the axes, where no curve is
    assert min(wide.x0, narrow.x0) > panel.x1


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("count", [1, 12, 27])
def test_a_legend_leaves_room_for_the_panel(many: xr.Dataset, count: int, width: str) -> None:
    figure = impact.plot(many, kind="restitution", models=many["model"].values[:count].tolist(), width=width)
    check_layout(figure)
    assert figure.axes[0].get_window_extent().height > 0.3 * figure.bbox.height
    keys = many["model"].values[:count].tolist()
    assert len(names_of(figure)) == count + 1
    assert legend_share(figure) <= 0.2
    if (count, width) == (27, "single"):
        # in rows, in the order of the result
        assert names_of(figure)[1:] == keys


@pytest.mark.slow
def test_a_legend_without_room_names_the_number_of_missing_entries(many: xr.Dataset) -> None:
    figure = impact.plot(many, kind="restitution", width="single", height=3.5)
    check_layout(figure)
    *names, more = names_of(figure)
    assert more == f"and {many.sizes['model'] + 1 - len(names)} more"
    assert legend_share(figure) <= 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("count", "name"), [(3, "Hunt and Crossley (1975)"), (8, "hunt-crossley-1975")])
def test_a_legend_takes_at_most_a_fifth_of_the_height_unless_names_are_chosen(
    many: xr.Dataset, count: int, name: str
) -> None:
    options = {"kind": "restitution", "models": many["model"].values[:count].tolist()}
    figure = impact.plot(many, width="84mm", **options)
    assert legend_share(figure) <= 0.2
    assert names_of(figure)[2] == name
    full = impact.plot(many, width="84mm", legend="full", **options)
    assert names_of(full)[2] == "Hunt and Crossley (1975)"
    assert (legend_share(full) > 0.2) == (count == 8)
    # where full names have room, they are the default
    assert names_of(impact.plot(many, **options))[2] == "Hunt and Crossley (1975)"


@pytest.mark.slow
@pytest.mark.parametrize("size", [(3.0, 3.5), (10.0, 8.0), (4.0, 6.0)])
def test_a_figure_can_be_resized(plot_data_by_kind: dict[str, CurveData], size: tuple[float, float]) -> None:
    for kind in ("restitution", "history" if size[1] > 4.0 else "loop"):
        figure = draw(plot_data_by_kind[kind], Look())
        figure.set_size_inches(*size)
        check_layout(figure)


@pytest.mark.slow
def test_models_of_a_plot_differ_in_colour_and_marker(many: xr.Dataset) -> None:
    def looks(models: list[str]) -> list[tuple[object, ...]]:
        lines = impact.plot(many, kind="restitution", models=models).axes[0].lines
        return [(line.get_color(), line.get_marker(), line.get_linestyle()) for line in lines]

    keys = many["model"].values.tolist()
    everything = looks(keys)
    assert len({(color, marker) for color, marker, _ in everything}) == len(keys) + 1
    for few in (keys[0::9][:3], keys[:5], keys[-7:], keys[::4][:7]):
        assert len({color for color, _, _ in looks(few)}) == len(few) + 1, few
        assert len({marker for _, marker, _ in looks(few)}) == len(few) + 1, few


def test_a_model_keeps_its_look_where_it_is_free(coarse: xr.Dataset) -> None:
    def look(**choice: object) -> tuple[object, object]:
        lines = impact.plot(coarse, **choice).axes[0].lines  # type: ignore[arg-type]
        line = next(line for line in lines if "2012" in str(line.get_label()))
        return line.get_color(), line.get_marker()

    assert look() == look(models=["gharib-hurmuzlu-2012"])


def test_a_variable_or_an_axis_that_no_picture_shows_is_refused(coarse: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match="variable: does not apply to final-velocities, expected a kind among map, uncertainty"
    ):
        impact.plot(coarse, variable="peak_force")
    with pytest.raises(UsageError, match="y: does not apply to loop, expected a kind among map, validity"):
        impact.plot(coarse, kind="loop", y="e")
    with pytest.raises(UsageError, match="x: does not apply to history, expected a kind among final-velocities, "):
        impact.plot(coarse, kind="history", x="e")
    with pytest.raises(UsageError, match=r"x: does not apply to calibration$"):
        check_choice(Choice(x="v1"), [find_kind("calibration")])
    impact.save(coarse, file := tmp_path / "coarse.h5")
    with pytest.raises(UsageError, match="variable: does not apply to error and loop"):
        impact.plot_to_files(file, kinds=["error", "loop"], variable="peak_force")


@pytest.mark.slow
def test_a_logarithmic_axis_that_no_picture_has_is_refused(coarse: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError, match=r'^log="x": the axis x would stay linear: it has values <= 0, or this kind'
    ):
        impact.plot(coarse, kind="loop", log="x")
    with pytest.raises(UsageError, match=r'^log="y": the axis y'):
        impact.plot(coarse, kind="history", log="y")
    impact.save(coarse, file := tmp_path / "coarse.h5")
    drawn = impact.plot_to_files(file, kinds=["error", "loop"], log="y")
    assert list(drawn.pictures) == ["error", "loop"]


def test_no_value_is_lost_on_a_logarithmic_axis(coarse: xr.Dataset) -> None:
    # the restitution at e = 0
    with pytest.raises(UsageError, match=r'^log="y": the axis y would stay linear: it has values <= 0'):
        impact.plot(coarse, kind="restitution", log="y")
    above = coarse.isel(e=slice(1, None))
    assert impact.plot(above, kind="restitution", log="y").axes[0].get_yscale() == "log"
    # errors have both signs, their absolute values a floor
    assert [axes.get_yscale() for axes in impact.plot(coarse, kind="error", log="y").axes] == ["linear", "log"]
    points = pd.DataFrame({"e": [0.5, 0.6], "e_out": [0.0, 0.5]})
    assert impact.plot(above, kind="restitution", points=points).axes[0].get_yscale() == "linear"
    with pytest.raises(UsageError, match=r"^points: e_out has values <= 0, which a logarithmic axis cannot show$"):
        impact.plot(above, kind="restitution", log="y", points=points)


def test_no_law_is_not_every_law(coarse: xr.Dataset) -> None:
    for act in (impact.plot, impact.recommend):
        with pytest.raises(UsageError, match=r"^models: got an empty list, expected one name or more$"):
            act(coarse, models=[])


def test_the_slice_is_chosen_and_named(wide: xr.Dataset) -> None:
    assert "v1 = 1 m/s, m1 = m2 = 1 kg" in conditions_of(get_curve_data(wide))
    other = get_curve_data(wide, sel={"v1": 2.0, "material2": "hard", "m2": np.inf}, models=["hertz"])
    for part in ("v1 = 2 m/s", "m1 = 3 kg", "material2 = hard"):
        assert part in conditions_of(other)
    expected = wide["v1_post"].sel(model="hertz", v1=2.0, material2="hard", m1=3.0)
    values = next(c for c in single_panel(other).curves if c.model == "hertz" and c.end == "v₁⁺").y
    assert values == tuple(expected.isel({"ismail-stronge-2008.gamma": 0}).values)


def test_parameters_of_a_model_are_named_beside_its_title_only(wide: xr.Dataset) -> None:
    for kind in ("restitution", "loop"):
        keys = ["bilinear", "ismail-stronge-2008"]
        curve_data = get_curve_data(wide, kind, sel={"ismail-stronge-2008.gamma": 4.0}, models=keys)
        assert "gamma" not in curve_data.conditions
        labels = {curve.model: curve.label.replace("\xa0", " ") for curve in single_panel(curve_data).curves}
        assert labels.pop("ismail-stronge-2008").endswith("(2008), gamma = 4")
        assert "bilinear" in labels
        assert not any("gamma" in label for label in labels.values())
        assert any(r"$\gamma$" in name for name in names_of(draw(curve_data, Look())))


def test_values_that_vary_together_have_to_agree(wide: xr.Dataset) -> None:
    assert "m1 = 3 kg" in conditions_of(get_curve_data(wide, sel={"m1": 3.0, "m2": np.inf}))
    with pytest.raises(UsageError, match=r"no m2 = 1\.0 there; m2 is inf"):
        get_curve_data(wide, sel={"m1": 3.0, "m2": 1.0})


def test_points_are_drawn_in_order_and_geometric_axes_in_logarithms() -> None:
    def drawn(values: list[float], log: str = "") -> Panel:
        sweep = {"e": 0.5, "v1": values, "m1": 1.0, "m2": 1.0, "K": 1e9}
        return single_panel(get_curve_data(impact.sweep({"models": "hertz", "sweep": sweep}), log=log))

    unsorted = drawn([5.0, 2.0, 3.3])
    assert unsorted.curves[0].x == (2.0, 3.3, 5.0)
    assert unsorted.curves[0].y == pytest.approx((0.5, 0.825, 1.25))
    assert unsorted.joined
    assert not unsorted.x_log
    assert drawn([5.0, 2.0, 3.3], "xy").x_log
    assert drawn([5.0, 2.0, 3.3], "xy").y_log
    assert drawn([1000.0, 10.0, 0.1]).x_log


@pytest.mark.parametrize(
    ("v1", "joined"), [([1.0, 2.0, 3.0], True), ([3.0, 2.0, 1.0], True), ([1.0, 3.0, 2.0], False)]
)
def test_points_without_an_order_are_not_joined(v1: list[float], joined: bool) -> None:
    sweep = {"e": [0.2, 0.5, 0.8], "v1": v1, "zip": [["e", "v1"]], "m1": 1.0, "m2": 1.0, "K": 6e9}
    result = impact.sweep({"models": "lankarani-nikravesh-1990", "sweep": sweep})
    lines = impact.plot(result, kind="restitution", x="v1").axes[0].lines
    assert all((line.get_linestyle() != "None") == joined for line in lines)
    assert all(line.get_marker() not in ("None", None) for line in lines if not joined)


def test_a_band_of_points_without_an_order_is_a_bar_at_each() -> None:
    sweep = {"e": [0.2, 0.5, 0.8], "v1": [1.0, 3.0, 2.0], "zip": [["e", "v1"]], "m1": 1.0, "m2": 1.0}
    law = {"kuwabara-kono-1987": {"A": 1e-5}}
    uncertain = {**sweep, "K": {"uniform": [1e6, 2e6]}}
    result = impact.sweep({"models": "kuwabara-kono-1987", "sweep": uncertain, "design": {"n": 64}, "model": law})
    axes = impact.plot(result, kind="uncertainty", x="v1").axes[0]
    assert all(line.get_linestyle() == "None" for line in axes.lines)
    (bars,) = axes.collections
    assert [bar[0, 0] for bar in bars.get_segments()] == [1.0, 2.0, 3.0]


def test_cases_are_numbered_and_not_joined() -> None:
    sweep = {"e": [0.2, 0.5, 0.8], "v1": [1.0, 2.0, 3.0], "zip": [["e", "v1"]], "m1": 1.0, "m2": 1.0, "K": 6e9}
    result = impact.sweep({"models": "lankarani-nikravesh-1990", "sweep": sweep}).reset_index("e")
    cases = result.swap_dims(e="case").assign_coords(case=[0, 1, 2], e=("case", [0.5, 0.2, 0.5]))
    assert single_panel(get_curve_data(cases, "restitution")).x_name == "e"
    for x in ("e", "case"):
        figure = impact.plot(cases, kind="restitution", x=x)
        assert {line.get_linestyle() for line in figure.axes[0].lines} == {"None"}
        check_layout(figure)


def test_a_restitution_that_varies_along_two_axes_is_drawn_over_where_one_is_selected() -> None:
    sweep = {"alpha": [0.2, 0.3], "v1": [0.5, 1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    result = impact.sweep({"models": "lankarani-nikravesh-1990", "sweep": sweep})
    for sel, e in (({"alpha": 0.2}, (0.8, 0.9)), ({"v1": 0.5}, (0.85, 0.9))):
        panel = single_panel(get_curve_data(result, "restitution", sel=sel))
        assert panel.x_name == "e"
        assert panel.joined
        assert panel.curves[0].x == pytest.approx(e)
        assert panel.curves[-1].y == pytest.approx(np.sort(result["e_out"].sel(sel).values.ravel()))


def test_another_axis_can_be_drawn_over(wide: xr.Dataset) -> None:
    panel = single_panel(get_curve_data(wide, x="v1", sel={"e": 0.6}))
    assert panel.curves[0].x == (1.0, 2.0)
    assert (panel.x_label, panel.x_unit) == ("velocity of ball 1 before the impact", "m/s")
    walls = get_curve_data(wide, x="m2")
    assert single_panel(walls).curves[0].x == (1.0,)
    assert walls.not_drawn == ("m2 = inf",)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"sel": {"m3": 1.0}}, 'no axis "m3" in this result; known: e, ismail'),
        ({"sel": {"v1": 7.0}}, "no v1 = 7.0 in this result; v1 is 1, 2"),
        ({"sel": {"material2": "wood"}}, "no material2 = wood in this result; material2 is soft, hard"),
        ({"x": "material2"}, 'cannot draw over "material2"'),
        ({"models": ["herz"]}, 'no model "herz" in this result; did you mean "hertz"?'),
    ],
)
def test_an_unknown_name_or_value_is_an_error_with_the_known_ones(
    wide: xr.Dataset, choice: dict[str, object], words: str
) -> None:
    with pytest.raises(UsageError, match=re.escape(words)):
        get_curve_data(wide, **choice)


# PDF and EPS embed fonts, which takes seconds
@pytest.mark.slow
@pytest.mark.parametrize("form", ["png", "svg", "pdf", "eps"])
def test_plots_are_files_of_their_format(coarse: xr.Dataset, tmp_path: Path, form: str) -> None:
    figure = impact.plot(coarse, kind="restitution", width="single")
    save_figure(figure, tmp_path / f"plot.{form}")
    magic = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF", "eps": b"%!PS"}[form]
    assert (tmp_path / f"plot.{form}").read_bytes().startswith(magic)
    # the method of matplotlib works as well
    figure.savefig(tmp_path / f"by_matplotlib.{form}")
    assert (tmp_path / f"by_matplotlib.{form}").read_bytes().startswith(magic)


@pytest.mark.slow
def test_threads_that_draw_at_the_same_time_make_the_pictures_of_a_single_one(figure6: xr.Dataset) -> None:
    # matplotlib's parser of formulas is shared by all threads
    def draw_and_save(kind: str) -> bytes:
        buffer = io.BytesIO()
        impact.plot(figure6, kind=kind).savefig(buffer)
        return buffer.getvalue()

    kinds = ["final-velocities", "restitution"] * 2
    alone = [draw_and_save(kind) for kind in kinds]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        with ThreadPoolExecutor(len(kinds)) as threads:
            assert list(threads.map(draw_and_save, kinds)) == alone
    finally:
        sys.setswitchinterval(interval)


@pytest.mark.slow
def test_the_same_bytes_in_every_process(stored: Path, tmp_path: Path) -> None:
    sweep = {"e": [0.1, 0.5, 1.0], "v1": {"geomspace": [0.1, 10.0, 5]}, "m1": 1.0, "m2": 1.0, "K": 6e9}
    plane = impact.sweep({"models": ["hertz", "flores-2011", "lankarani-nikravesh-1990"], "sweep": sweep})
    impact.save(plane, tmp_path / "plane.h5")
    code = (
        "import sys, hashlib, impact\nfrom impact.plots.style import encoded\n"
        "for path, kinds in ((sys.argv[1], ('error', 'history')), (sys.argv[2], ('map', 'validity'))):\n"
        "    result = impact.load(path)\n"
        "    for kind in kinds:\n"
        "        for form in ('svg', 'eps') if kind == 'error' else ('png',):\n"
        "            at = {'e': 0.5} if kind == 'history' else None\n"
        "            figure = impact.plot(result, kind=kind, sel=at, width='84mm')\n"
        "            print(kind, form, hashlib.sha256(encoded(figure, form)).hexdigest())\n"
    )
    words = [sys.executable, "-c", code, str(stored), str(tmp_path / "plane.h5")]
    printed = {subprocess.run(words, capture_output=True, text=True, check=True).stdout for _ in range(2)}
    assert len(printed) == 1
    assert len(printed.pop().splitlines()) == 5


def test_a_file_of_another_format_is_not_written(
    coarse: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(UsageError, match=r"\.png, \.svg, \.pdf, \.eps, \.pgf or \.gif"):
        save_figure(impact.plot(coarse), tmp_path / "results.h5")
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(UsageError, match=r"pgf needs xelatex of LaTeX, which is not installed"):
        save_figure(impact.plot(coarse), tmp_path / "results.pgf")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("xelatex") is None, reason="no xelatex")
def test_a_pgf_file_is_a_picture_that_latex_typesets(coarse: xr.Dataset, tmp_path: Path) -> None:
    save_figure(impact.plot(coarse, width="84mm"), tmp_path / "results.pgf")
    document = r"\documentclass{article}\usepackage{pgf}\def\mathdefault#1{#1}\begin{document}\input{results.pgf}"
    (tmp_path / "paper.tex").write_text(document + r"\end{document}", encoding="utf-8")
    words = ["xelatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, "Output written on paper.pdf (1 page" in done.stdout) == (0, True), done.stdout[-500:]


@pytest.mark.slow
def test_text_from_a_file_is_text(coarse: xr.Dataset, tmp_path: Path) -> None:
    odd = coarse.assign_attrs(title="$\\frac{1$ \x1b[31m \u202e $x$ " + "W" * 90)
    odd["title"] = ("model", ["$x^{$", "a_b$ $\\oops$", "[red]" + "W" * 60])
    curve_data = get_curve_data(odd)
    assert "\x1b" not in curve_data.title
    for width in WIDTHS.values():
        figure = impact.plot(odd, width=width)
        check_layout(figure)
        assert any("a_b\\$ \\$\\oops\\$" in name for name in names_of(figure))
        save_figure(figure, tmp_path / "odd.png")


def test_a_single_point_without_a_reference_is_drawn(tmp_path: Path) -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"v1": [1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}})
    assert [curve.model for curve in single_panel(get_curve_data(result)).curves] == ["hertz", "hertz"]
    save_figure(impact.plot(result), tmp_path / "one.png")


# options of the user


def test_a_grid_is_faint_on_the_background_of_the_user(coarse: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "dark.mplstyle").write_text("axes.facecolor: black\ntext.color: white\n", encoding="utf-8")
    for style, colour in ((None, "#e6e6e6"), (tmp_path / "dark.mplstyle", "#1a1a1a"), ("ggplot", "#ffffff")):
        (line, *_) = impact.plot(coarse, kind="restitution", style=style).axes[0].get_xgridlines()
        assert matplotlib.colors.to_hex(line.get_color()) == colour


def test_the_legend_has_the_size_that_the_user_gives_other_texts(coarse: xr.Dataset) -> None:
    with matplotlib.rc_context({"font.size": 20.0}):
        figure = impact.plot(coarse.isel(model=[0]), kind="restitution")
    tick = figure.axes[0].get_xticklabels()[0]
    assert figure.legends[0].get_texts()[0].get_fontsize() == tick.get_fontsize() > 16.0


@pytest.mark.slow
def test_the_style_of_the_user_is_respected(coarse: xr.Dataset, tmp_path: Path) -> None:
    assert impact.plot(coarse).axes[0].xaxis.label.get_fontsize() == 9.0
    with matplotlib.rc_context({"font.size": 13.0, "axes.grid": True, "figure.figsize": (5.0, 4.0)}):
        figure = impact.plot(coarse)
        assert figure.axes[0].xaxis.label.get_fontsize() == 13.0
        assert tuple(figure.get_size_inches()) == (5.0, 4.0)
        assert impact.plot(coarse, width="single").get_figwidth() == 3.5
    sheet = tmp_path / "mine.mplstyle"
    sheet.write_text("font.size: 7\naxes.facecolor: cccccc\n", encoding="utf-8")
    figure = impact.plot(coarse, style=sheet)
    assert figure.axes[0].xaxis.label.get_fontsize() == 7.0
    assert matplotlib.colors.to_hex(figure.axes[0].get_facecolor()) == "#cccccc"
    assert impact.plot(coarse, style="grayscale").axes
    with pytest.raises(UsageError, match=r"style=\"none\.mplstyle\": no such file"):
        impact.plot(coarse, style="none.mplstyle")
    (tmp_path / "c.toml").write_text("models = ['hertz']\n", encoding="utf-8")
    with pytest.raises(UsageError, match="contains no setting of matplotlib"):
        impact.plot(coarse, style=tmp_path / "c.toml")
    sheet.write_bytes(b"font.size: \xff\n")
    with pytest.raises(UsageError, match="cannot be read"):
        impact.plot(coarse, style=sheet)


@pytest.mark.parametrize("kind", ["final-velocities", "error", "impulse", "animation"])
def test_every_line_and_text_follows_the_colours_of_a_style(coarse: xr.Dataset, kind: str) -> None:
    """On black nothing is black, and what was white is: the inside of markers."""
    figure = impact.plot(coarse, kind=kind, sel=selection_of(kind), style="dark_background")
    figure.set_size_inches(8.0, 8.0)
    lines = [line for axes in figure.axes for line in (*axes.lines, *axes.get_xgridlines())]
    for artist in (*lines, *figure.findobj(Text)):
        assert max(to_rgb(artist.get_color())) >= 0.099, artist
    for line in (line for axes in figure.axes for line in axes.lines if line.get_marker() not in ("None", "o")):
        assert to_rgb(line.get_markerfacecolor()) == (0.0, 0.0, 0.0)
    assert max(to_rgb(figure.axes[-1].get_xgridlines()[0].get_color())) == pytest.approx(0.1)


def test_labels_of_low_panels_have_two_lines_and_letters_of_one_size(coarse: xr.Dataset) -> None:
    figure = impact.plot(coarse, kind="history", sel={"e": 0.5}, width="84mm")
    figure.draw_without_rendering()
    labels = [axes.yaxis.label for axes in figure.axes]
    assert all(label.get_text().count("\n") <= 1 for label in labels)
    assert len({label.get_fontsize() for label in labels}) == 1


def test_a_floor_of_errors_is_named_where_smaller_ones_are_drawn_at_it(coarse: xr.Dataset) -> None:
    def floors(result: xr.Dataset) -> list[str]:
        return [
            text.get_text() for text in impact.plot(result, kind="error").axes[1].texts if "≤" in text.get_text()
        ]

    assert float(np.abs(coarse["e_error"]).min()) < 1e-9
    assert floors(coarse) == ["≤ $10^{-9}$"]
    assert floors(coarse.assign(e_error=coarse["e_error"] + 0.01)) == []


@pytest.mark.slow
def test_labels_titles_and_sizes_are_chosen(coarse: xr.Dataset) -> None:
    labels = {"e": "Restitution $e$", "gharib-hurmuzlu-2012": "G & H", "reference": "Exact", "title": "Mine"}
    figure = impact.plot(coarse, labels=labels, width="84mm", height="60mm")
    assert figure.get_size_inches() * 25.4 == pytest.approx((84.0, 60.0))
    assert figure.axes[0].get_xlabel() == "Restitution $e$"
    assert {"G & H", "Exact"} <= set(names_of(figure))
    assert figure.texts[0].get_text() == "Mine"
    bare = impact.plot(coarse, title=False)
    assert bare.texts == []
    assert bare.get_figheight() < impact.plot(coarse).get_figheight()
    loop = impact.plot(coarse, kind="loop", sel={"e": 0.5}, labels={"delta": "Overlap"})
    assert loop.axes[0].get_xlabel() == "Overlap (µm)"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"width": "wide"},
            "width: got wide, expected a length from 26mm to 60in, such as 84mm, 8.4cm or 3.3in, or",
        ),
        ({"width": "84"}, "width: got 84, expected a length"),
        ({"width": 0.01}, "width: got 0.01, expected a length"),
        ({"height": "single in"}, "height: got single in, expected a length"),
        ({"labels": {"E": "Young"}}, 'nothing in the picture is called "E"; known: e, gharib'),
        ({"labels": {"e": "$x^{$"}}, 'labels={"e": "$x^{$"}: is not valid mathtext'),
    ],
)
def test_a_wrong_option_is_an_error_of_one_line(
    coarse: xr.Dataset, options: dict[str, object], words: str
) -> None:
    with pytest.raises(UsageError, match=one_line(words)):
        impact.plot(coarse, **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_height_without_room_for_panels_names_the_least_height(coarse: xr.Dataset) -> None:
    with pytest.raises(UsageError, match=r"height: got 60mm, expected at least \d+mm at this width") as error:
        impact.plot(coarse, kind="history", sel={"e": 0.5}, width="84mm", height="60mm")
    (least,) = re.findall(r"least (\d+mm)", str(error.value))
    figure = impact.plot(coarse, kind="history", sel={"e": 0.5}, width="84mm", height=least)
    heights = [axes.get_position().height * float(least[:-2]) for axes in figure.axes]
    assert all(12.0 <= height < 14.0 for height in heights)


def test_a_height_with_no_room_for_the_texts_is_refused_with_the_least_one(coarse: xr.Dataset) -> None:
    with pytest.raises(UsageError, match=r"height: got 26mm, expected at least \d+mm at this width"):
        impact.plot(coarse, width="26mm", height="26mm")


def test_a_plot_is_drawn_into_axes_of_the_user(coarse: xr.Dataset) -> None:
    figure = Figure((8.0, 4.0))
    axes = figure.subplots(1, 2)
    assert impact.plot(coarse, kind="restitution", ax=axes[0]) is figure
    assert (len(axes[0].lines), len(axes[1].lines)) == (4, 0)
    assert axes[0].get_legend().get_texts()[0].get_text() == "Requested"
    impact.plot(coarse, kind="error", ax=axes)
    assert isinstance(axes[1], Axes)
    with pytest.raises(UsageError, match="ax: got 1 axes, expected 3"):
        impact.plot(coarse, kind="history", sel={"e": 0.5}, ax=axes[0])
    looks: dict[str, Any] = {"width": "single", "height": 3.0, "style": "ggplot"}
    for name, value in looks.items():
        with pytest.raises(UsageError, match=f"^{name}: does not apply to ax, whose figure has its own$"):
            impact.plot(coarse, kind="error", ax=axes, **{name: value})


@pytest.mark.parametrize(
    ("legend", "name"),
    [
        ("full", "Flores, Machado, Silva and Martins (2011)"),
        ("short", "Flores et al. (2011)"),
        ("keys", "flores-2011"),
    ],
)
def test_a_legend_names_laws_as_asked_for_in_own_and_in_foreign_axes(legend: str, name: str) -> None:
    result = impact.sweep(models=["flores-2011", "hunt-crossley-1975"], e=[0.5, 0.9])
    axes = Figure((4.0, 4.0)).subplots()
    impact.plot(result, kind="restitution", ax=axes, legend=legend)
    own = impact.plot(result, kind="restitution", legend=legend, labels={"hunt-crossley-1975": "mine"})
    for shown in (axes.get_legend(), own.legends[0]):
        assert name in [text.get_text().replace("\n", " ") for text in shown.get_texts()]
    # a label that the user gives comes first
    assert "mine" in [text.get_text() for text in own.legends[0].get_texts()]


@pytest.mark.parametrize(
    ("legend", "end"),
    [
        ("full", ""),
        ("short", ", A = 10 µs of Kuwabara and Kono (1987)"),
        ("keys", ", A = 10 µs of kuwabara-kono-1987"),
    ],
)
def test_parameters_of_laws_are_in_the_conditions_if_the_legend_lacks_them(legend: str, end: str) -> None:
    """Two pictures of the same law with other parameters can be told apart."""
    options = {"model.kuwabara-kono-1987.A": 1e-5}
    result = impact.sweep(models=["hertz", "kuwabara-kono-1987"], v1=[1.0, 2.0], overrides=options)
    text = impact.plot(result, kind="restitution", legend=legend).texts[1].get_text()
    for old, new in (("\N{NO-BREAK SPACE}", " "), ("$", ""), ("\n", " ")):
        text = text.replace(old, new)
    assert text.endswith(end)
    assert ("A = " in text) == bool(end)


def test_a_legend_in_foreign_axes_fits_them_and_takes_no_room() -> None:
    result = impact.sweep(models=["flores-2011", "hunt-crossley-1975"], e=[0.5, 0.9])
    figure = Figure((6.6, 2.6), layout="constrained")
    first, second = figure.subplots(1, 2)
    impact.plot(result, kind="restitution", ax=first)
    impact.plot(result, kind="restitution", ax=second, legend="none")
    figure.canvas.draw()
    assert "Flores et al. (2011)" in [text.get_text() for text in first.get_legend().get_texts()]
    assert first.get_legend().get_window_extent().width <= first.bbox.width == pytest.approx(second.bbox.width)
    wide = Figure((9.0, 4.0)).subplots()
    impact.plot(result, kind="restitution", ax=wide)
    assert "Flores, Machado, Silva and Martins (2011)" in [
        text.get_text() for text in wide.get_legend().get_texts()
    ]


def test_a_picture_without_entries_keeps_the_legend_of_foreign_axes() -> None:
    result = impact.sweep(models="flores-2011", e=[0.5, 0.9], v1=[1.0, 2.0])
    axes = Figure((6.6, 4.0)).subplots()
    axes.plot([], [], label="mine")
    legend = axes.legend()
    impact.plot(result, kind="map", variable="e_out", ax=axes)
    assert axes.get_legend() is legend


def test_a_picture_without_legend_and_foreign_axes_without_title(coarse: xr.Dataset) -> None:
    axes = Figure((4.0, 4.0)).subplots(1, 2)
    impact.plot(coarse, kind="restitution", ax=axes[0], legend="none")
    impact.plot(coarse, kind="restitution", ax=axes[1], title=True)
    assert (axes[0].get_legend(), axes[0].get_title()) == (None, "")
    assert axes[1].get_title() == "Delivered restitution"
    assert impact.plot(coarse, legend="none").legends == []
    with pytest.raises(UsageError, match="legend: got key, expected full, short, keys, none"):
        impact.plot(coarse, legend="key")


def test_a_notebook_shows_the_picture(coarse: xr.Dataset) -> None:
    figure = impact.plot(coarse, width="single")
    png, metadata = figure._repr_png_()  # type: ignore[attr-defined]
    assert png.startswith(b"\x89PNG")
    # what a screen reader reads
    assert metadata["alt"].endswith("Velocity after the impact v_i^+ (m/s) over Coefficient of restitution e")
    assert not re.search(r"[$\\{}]", metadata["alt"])


# measured points


POINTS = "v1 [mm/s], e_out, sigma\n500, 0.9, 0.05\n\n1000, 0.8, 0.1\n"


@pytest.fixture(scope="module")
def speeds() -> xr.Dataset:
    sweep = {"v1": [0.5, 1.0, 2.0], "e": 0.6, "m1": 1.0, "m2": 1.0, "K": 6e9}
    return impact.sweep({"models": "flores-2011", "sweep": sweep})


def test_measured_points_are_drawn_over_the_curves(speeds: xr.Dataset, tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(POINTS, encoding="utf-8")
    frame = pd.DataFrame({"v1 [mm/s]": [500.0, 1000.0], "e_out": [0.9, 0.8], "sigma": [0.05, 0.1]})
    dataset = xr.Dataset(
        {"e_out": ("v1", [0.9, 0.8]), "sigma": ("v1", [0.05, 0.1])},
        {"v1": ("v1", [500.0, 1000.0], {"units": "mm/s"})},
    )
    for points in (path, str(path), frame, dataset):
        figure = impact.plot(speeds, kind="restitution", points=points)
        (bars,) = figure.axes[0].containers
        assert bars[0].get_xydata().tolist() == [[0.5, 0.9], [1.0, 0.8]]
        low, high = bars[2][0].get_segments()[0][:, 1]
        assert (low, high) == pytest.approx((0.85, 0.95))
        assert names_of(figure)[-1] == "Measured"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("v_1, e_out\n1, 2\n", 'data.csv:1: v_1: no such input or variable; did you mean "v1"'),
        ("v1, v1\n1, 2\n", 'data.csv:1: got "v1" twice'),
        ("v1 [kg], e_out\n1, 2\n", "data.csv:1: v1: got [kg], expected a unit of m/s"),
        ("v1, e_out\n1, 0.2\n2, high\n", 'data.csv:3: e_out: got "high", expected a'),
        ("m1, e_out\n1, 0.2\n", "data.csv: the picture shows v1 and e_out, and the points have m1, e_out"),
        ("v1, e_out\n", "data.csv: got one line, expected a line of names"),
    ],
)
def test_wrong_points_are_an_error_of_one_line(
    speeds: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("data.csv").write_text(text, encoding="utf-8")
    with pytest.raises(impact.ImpactError, match=one_line(words)):
        impact.plot(speeds, kind="restitution", points="data.csv")


# the command


def test_the_title_of_axes_of_a_user_has_decimal_commas(speeds: xr.Dataset) -> None:
    """As the title of a picture of its own has; it is that of the user."""
    for decimal, title in (("comma", "tempered at 2,5 K"), ("point", "tempered at 2.5 K")):
        axes = Figure().subplots()
        look: dict[str, Any] = {"kind": "restitution", "title": True, "decimal": decimal}
        impact.plot(speeds, ax=axes, labels={"title": "tempered at 2.5 K"}, **look)
        assert axes.get_title() == title


def test_the_unit_at_an_axis_has_decimal_commas() -> None:
    models = ["hertz", "hunt-crossley-1975"]
    result = impact.sweep(models=models, m1=1.0, m2=1.0, v1=1.0, v2=0.0, e=[0.5, 1.0], K=[1e6, 2e6], n=1.5)
    for decimal, unit in (("comma", "$^{1{,}5}$"), ("point", "$^{1.5}$")):
        (axes,) = impact.plot(result, kind="final-velocities", x="K", decimal=decimal).axes
        assert unit in axes.get_xlabel()
        # the panels of a map share their labels
        *_, label = impact.plot(result, kind="map", decimal=decimal).texts
        assert unit in label.get_text()


@pytest.mark.slow
def test_the_table_of_a_plot_has_a_column_for_each_curve(cli: Run, coarse_file: Path, tmp_path: Path) -> None:
    words = ("plot", coarse_file, "--model", "gharib-hurmuzlu-2012", "--model", "lankarani-nikravesh-1990")
    cli(*words, "-o", "a.svg", "--data", "a.csv", cwd=tmp_path)
    frame = pd.read_csv(tmp_path / "a.csv")
    assert list(frame) == [
        "e",
        "v1_post reference [m/s]",
        "v2_post reference [m/s]",
        "v1_post gharib-hurmuzlu-2012 [m/s]",
        "v2_post gharib-hurmuzlu-2012 [m/s]",
        "v1_post lankarani-nikravesh-1990 [m/s]",
        "v2_post lankarani-nikravesh-1990 [m/s]",
    ]
    exact = impact.load(coarse_file).sel(model="gharib-hurmuzlu-2012")
    np.testing.assert_array_equal(frame["v1_post gharib-hurmuzlu-2012 [m/s]"], exact["v1_post"])
    cli(*words, "-o", "b.svg", "--data", "b.csv", "--data-form", "long", "-k", "restitution", cwd=tmp_path)
    head, *rows = csv.reader((tmp_path / "b.csv").read_text("utf-8").splitlines())
    assert head == ["x_axis", "y_axis", "curve", "model", "x", "y"]
    points = [(float(x), float(y)) for *_, model, x, y in rows if model == "gharib-hurmuzlu-2012"]
    assert points == list(zip(exact["e"].values.tolist(), exact["e_out"].values.tolist(), strict=True))
    cli(*words, "-o", "c.svg", "--data", "c.csv", "-k", "loop", "--sel", "e=0.5", cwd=tmp_path)
    loops = pd.read_csv(tmp_path / "c.csv")
    assert list(loops) == [
        f"{name} {key} [{unit}]" for key in words[3::2] for name, unit in (("delta", "m"), ("F", "N"))
    ]
    assert loops.notna().all(axis=None) == (len({loops[name].count() for name in loops}) == 1)


@pytest.mark.slow
def test_a_table_is_latex_by_its_ending_and_parquet_needs_pyarrow(
    forked: ForkServer, coarse_file: Path, tmp_path: Path
) -> None:
    done = forked("plot", coarse_file, "-o", "a.svg", "--data", "a.tex", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "a.tex").read_text("utf-8")
    assert r"\begin{tabular}" in text
    assert r"{v1\_post reference [\unit{m/s}]}" in text
    words = ("plot", coarse_file, "-o", "b.svg", "--data", "b.parquet")
    refused = forked(*words, cwd=tmp_path, code="import sys; sys.modules['pyarrow'] = None")
    assert refused.returncode == 2
    assert refused.stderr == (
        '.parquet needs pyarrow, which is not installed: pip install "impact-sweep[parquet]"\n'
    )
    assert not (tmp_path / "b.svg").exists()


def test_a_parquet_table_equals_the_csv_table(forked: ForkServer, coarse_file: Path, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    for name in ("a.csv", "b.parquet"):
        assert forked("plot", coarse_file, "-o", f"{name}.svg", "--data", name, cwd=tmp_path).returncode == 0
    columns, rows = pd.read_csv(tmp_path / "a.csv"), pd.read_parquet(tmp_path / "b.parquet")
    assert list(rows.columns) == list(columns.columns)
    np.testing.assert_array_equal(rows.to_numpy(), columns.to_numpy())


@pytest.mark.slow
def test_an_existing_plot_is_replaced_on_request_only(cli: Run, coarse_file: Path, tmp_path: Path) -> None:
    (tmp_path / "a.svg").write_text("mine")
    (tmp_path / "a.csv").write_text("mine")
    for words in (["-o", "a.svg"], ["-o", "b.svg", "--data", "a.csv"], ["-o", "a.svg", "-k", "loop"]):
        refused = cli("plot", coarse_file, *words, cwd=tmp_path)
        assert refused.returncode == 2
        assert refused.stderr.endswith("exists; give another name, or overwrite it (--overwrite)\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.svg"]
    assert cli("plot", coarse_file, "-o", "a.svg", "--data", "a.csv", "--overwrite", cwd=tmp_path).returncode == 0
    assert (tmp_path / "a.svg").read_text("utf-8").startswith("<?xml")
    assert (tmp_path / "a.csv").read_text("utf-8").startswith("e,")


@pytest.mark.slow
def test_kinds_that_do_not_apply_are_reported_and_others_drawn(
    cli: Run, coarse_file: Path, tmp_path: Path
) -> None:
    drawn = cli("plot", coarse_file, "-k", "map", "-k", "restitution", "-o", "a.svg", cwd=tmp_path)
    assert drawn.returncode == 0
    first, second = drawn.stderr.splitlines()
    assert first.startswith("a-restitution.svg: ")
    assert second.startswith("map is not drawn: map needs two axes")
    none = cli("plot", coarse_file, "-k", "map", "-k", "validity", "-o", "c.svg", cwd=tmp_path)
    assert (none.returncode, len(none.stderr.splitlines())) == (2, 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a-restitution.svg"]


def test_a_picture_without_a_second_axis_names_the_first_beside_one_at_a_value(
    coarse_file: Path, tmp_path: Path
) -> None:
    kinds = ("loop", "validity")
    files = impact.plot_to_files(coarse_file, tmp_path / "a.svg", kinds=kinds, sel={"e": 0.5})
    assert files.left_out["validity"].startswith(
        "validity needs two axes; this result has e alone; sweep a second"
    )
    with pytest.raises(UsageError, match="has none left beside the selected values"):
        get_plot_data(impact.load(coarse_file), "validity", Choice(sel={"e": 0.5}))


@pytest.mark.slow
def test_a_value_for_one_picture_leaves_the_axes_of_others(
    cli: Run, coarse: xr.Dataset, coarse_file: Path, wide: xr.Dataset, tmp_path: Path
) -> None:
    words = ["-k", "error", "-k", "loop", "-k", "final-velocities", "--sel", "e=0.5"]
    drawn = cli("plot", coarse_file, *words, "-o", "a.svg", "--json", cwd=tmp_path)
    assert (drawn.returncode, sorted(path.name for path in tmp_path.iterdir())) == (
        0,
        ["a-error.svg", "a-final-velocities.svg", "a-loop.svg"],
    )
    first, second, third = drawn.stderr.splitlines()
    assert first.endswith("; without --sel e=0.5, a point on its axis")
    assert "e = 0.5" in second
    assert third.endswith("; without --sel e=0.5, a point on its axis")
    # the picture is that of the call without a selection
    (panel,) = json.loads(drawn.stdout)["final-velocities"]["panels"]
    assert panel["curves"][0]["x"] == coarse["e"].values.tolist()
    # a selection that leaves a picture an axis applies to it too
    impact.save(wide, tmp_path / "wide.h5")
    kinds = ("loop", "restitution", "map")
    files = impact.plot_to_files(tmp_path / "wide.h5", kinds=kinds, sel={"e": 0.6, "v1": 2.0})
    assert files.plot_data["restitution"].panels[0].x_name == "m1"  # type: ignore[union-attr]
    assert files.plot_data["restitution"].not_drawn == ()
    # a value for a curve leaves a map its axes
    impact.save(wide.isel({"m1": 0, "material2": 0, "ismail-stronge-2008.gamma": 0}), tmp_path / "plane.h5")
    files = impact.plot_to_files(tmp_path / "plane.h5", kinds=("map", "restitution"), sel={"v1": 2.0})
    assert [plot_data.not_drawn for plot_data in files.plot_data.values()] == [
        ('sel={"v1": 2.0}, a point on its axis',),
        (),
    ]
    # a selection for no picture is an error
    alone = cli("plot", coarse_file, "-k", "error", "-k", "restitution", "--sel", "e=0.5", cwd=tmp_path)
    assert alone.returncode == 2
    assert alone.stderr.startswith("this result has no numeric axis left to draw over")


@pytest.mark.slow
def test_a_label_is_drawn_in_one_of_the_pictures_or_refused(
    cli: Run, coarse: xr.Dataset, coarse_file: Path, tmp_path: Path
) -> None:
    labels = {"v1_post": "ball A", "v2_post": "ball B", "v_post": "Speed"}
    (axes,) = impact.plot(coarse, labels=labels).axes
    assert axes.get_ylabel() == "Speed (m/s)"
    assert {"ball A", "ball B"} <= {text.get_text() for text in axes.texts}
    known = "known: e, gharib-hurmuzlu-2012, lankarani-nikravesh-1990, lankarani-nikravesh-1994, reference, title"
    for key in ("v", "e_out", "v1", "hertz", "m1", "delta"):
        with pytest.raises(UsageError) as caught:
            impact.plot(coarse, labels={key: "X"})
        words = f'labels: nothing in the picture is called "{key}"; {known}, v1_post, v2_post, v_post'
        assert str(caught.value) == words
        refused = cli("plot", coarse_file, "--label", f"{key}=X", "-o", "a.svg", cwd=tmp_path)
        assert (refused.returncode, refused.stderr) == (2, f"--label{words.removeprefix('labels')}\n")
    with pytest.raises(UsageError, match="nothing in the picture is called"):
        impact.plot(coarse, title=False, labels={"title": "X"})
    # each label is that of one of two pictures
    labels = ["--label", "e_error=Signed", "--label", "e_out=Delivered"]
    drawn = cli("plot", coarse_file, "-k", "error", "-k", "restitution", *labels, "-o", "b.svg", cwd=tmp_path)
    assert (drawn.returncode, len(drawn.stderr.splitlines())) == (0, 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b-error.svg", "b-restitution.svg"]


@pytest.mark.slow
def test_the_command_draws_what_python_draws(cli: Run, coarse_file: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.mplstyle").write_text("font.size: 8\n", encoding="utf-8")
    (tmp_path / "data.csv").write_text("e, e_out\n0.5, 0.5\n", encoding="utf-8")
    options = "-k restitution --width 84mm --height 7cm --no-title --style mine.mplstyle --label e=Asked"
    words = [*options.split(), "--points", "data.csv", "--equations", "-o", "a.svg"]
    done = cli("plot", coarse_file, *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    style = tmp_path / "mine.mplstyle"
    figure = impact.plot(
        impact.load(coarse_file),
        kind="restitution",
        width="84mm",
        height="7cm",
        title=False,
        style=style,
        labels={"e": "Asked"},
        points=tmp_path / "data.csv",
        equations=True,
    )
    save_figure(figure, tmp_path / "b.svg", style=style)
    digests = {hashlib.sha256((tmp_path / f"{name}.svg").read_bytes()).hexdigest() for name in "ab"}
    assert len(digests) == 1


@pytest.mark.parametrize("name", KINDS)
def test_a_kind_is_a_constant_of_its_module(name: str) -> None:
    kind = find_kind(name)
    assert kind.name == name
    assert kind.caption.endswith(".")


def test_the_help_of_plot_names_every_kind_and_loads_no_matplotlib() -> None:
    code = (
        "import sys\nfrom impact.cli.main import app\ntry:\n    app(['plot', '--help'])\nfinally:\n"
        "    assert not {'matplotlib', 'pandas'} & sys.modules.keys()\n"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    words = "".join(letter if letter.isalpha() or letter == "-" else " " for letter in shown).split()
    assert set(KINDS) <= set(words)


def test_the_scripts_that_draw_the_docs_compile() -> None:
    for name in ("gallery.py", "make_docs.py", "models_pictures.py"):
        compile((ROOT / "scripts" / name).read_text(encoding="utf-8"), name, "exec")
