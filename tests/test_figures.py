"""A figure shows the numbers of the slice it names, and has the same bytes each time."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.path import Path as Path2D

import impact
from impact import api
from impact.errors import UsageError
from impact.views.kinds import Choice, as_csv, draw
from impact.views.lines import Lines, Panel
from impact.views.look import save_figure
from impact.views.names import FOLLOWED, KINDS, WIDTHS
from impact.views.over import error, final_velocities, restitution


def only(numbers: Lines) -> Panel:
    """The panel of a picture that has one."""
    (panel,) = numbers.panels
    return panel


def shown(numbers: Lines) -> str:
    """The conditions, with plain spaces."""
    return numbers.conditions.replace("\N{NO-BREAK SPACE}", " ")


def test_figure_6_is_the_stored_numbers(figure6: xr.Dataset) -> None:
    panel = only(final_velocities(figure6))
    assert panel.x_label == "coefficient of restitution, e"
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


def test_what_is_drawn_is_what_is_numbered(figure6: xr.Dataset) -> None:
    panel = only(final_velocities(figure6))
    axes = impact.plot(figure6).axes[0]
    assert len(axes.lines) == len(panel.curves) == 8
    for line, curve in zip(axes.lines, panel.curves, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), curve.x)
        np.testing.assert_array_equal(line.get_ydata(), curve.y)
    assert axes.get_ylabel() == "velocity after the impact [m/s]"
    models = {curve.model for curve in panel.curves if curve.model}
    looks = {(line.get_color(), line.get_marker()) for line in axes.lines}
    assert len(looks) == len(models) + 1


def test_restitution_and_its_error_are_the_stored_numbers(figure6: xr.Dataset) -> None:
    asked, *delivered = only(restitution(figure6)).curves
    assert (asked.model, asked.x, asked.y) == (None, asked.y, asked.x)
    signed, absolute = error(figure6).panels
    for key, out, off, size in zip(
        figure6["model"].values, delivered, signed.curves, absolute.curves, strict=True
    ):
        assert out.model == off.model == size.model == key
        np.testing.assert_array_equal(out.y, figure6["e_out"].sel(model=key))
        np.testing.assert_array_equal(off.y, figure6["e_error"].sel(model=key))
        # what is smaller is the solver's error, and has no place on a logarithmic axis
        np.testing.assert_array_equal(size.y, np.maximum(np.abs(off.y), 1e-9))
    assert absolute.y_log
    assert (signed.bands, absolute.bands) == ((0.05, 0.01), (0.05, 0.01))


def test_an_error_wants_a_restitution_asked_for() -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9}})
    with pytest.raises(UsageError, match="no restitution asked for"):
        error(result)
    assert [curve.model for curve in only(restitution(result)).curves] == ["hertz"]


@pytest.mark.parametrize("kind", FOLLOWED)
def test_a_point_is_followed_through_time_again(figure6: xr.Dataset, kind: str) -> None:
    choice = Choice(sel={"e": 0.5}, models=["gharib-hurmuzlu-2012", "lankarani-nikravesh-1990"])
    numbers = api.pictured(figure6, kind, choice)
    once = {key: impact.run(model=key, at={"e": 0.5}) for key in choice.models or ()}
    assert "e = 0.5" in shown(numbers)
    for panel in numbers.panels:
        for curve in panel.curves:
            if curve.model is None:
                continue
            history = once[curve.model].history
            assert history is not None
            assert len(curve.x) == history.sizes["t"]
            if kind == "loop":
                np.testing.assert_array_equal(curve.x, history["delta"])
                np.testing.assert_array_equal(curve.y, history["F"])
            elif kind == "history":
                np.testing.assert_array_equal(curve.x, history["t"])
            else:
                # the last impulse is that of both phases, m v0 (1 + e_out)
                e_out = once[curve.model].values["e_out"]
                assert curve.x[-1] == pytest.approx(0.5 * (1.0 + e_out), rel=1e-9)


def test_a_history_file_is_drawn_as_it_is(tmp_path: Path) -> None:
    history = impact.run(model="hunt-crossley-1975", at={"e": 0.5}).history
    assert history is not None
    impact.save(history, tmp_path / "history.h5")
    stored = impact.load(tmp_path / "history.h5")
    (curve,) = only(api.pictured(stored, "loop", Choice())).curves
    np.testing.assert_array_equal(curve.y, history["F"])
    with pytest.raises(UsageError, match="time history"):
        api.pictured(stored, "restitution", Choice())


def test_the_impulse_diagram_ends_where_impulse_and_momentum_say(figure6: xr.Dataset) -> None:
    numbers = api.pictured(figure6, "impulse", Choice(sel={"e": 0.25}, models=["lankarani-nikravesh-1994"]))
    ends = {(curve.model, curve.end): (curve.x[-1], curve.y[-1]) for curve in only(numbers).curves}
    # two equal balls of 1 kg, one at rest: tau = m v0 (1 + e) = 0.625 N s
    assert ends[None, "v₁"] == pytest.approx((0.625, 0.375))
    assert ends[None, "v₂"] == pytest.approx((0.625, 0.625))
    for ball in ("v₁", "v₂"):
        assert ends["lankarani-nikravesh-1994", ball] == pytest.approx(ends[None, ball], abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "choice", "words"),
    [
        ("lop", Choice(), 'no kind "lop"; did you mean "loop"?'),
        ("loop", Choice(), "no motion to draw at e = 0.0: closed-form limit"),
        ("loop", Choice(sel={"e": 0.5}, models=["herz"]), 'no model "herz" in this result'),
        ("loop", Choice(sel={"m3": 0.5}), 'no input "m3" here'),
    ],
)
def test_what_cannot_be_followed_is_told_in_one_line(
    figure6: xr.Dataset, kind: str, choice: Choice, words: str
) -> None:
    if kind == "loop" and not choice.sel:
        choice = Choice(models=["gharib-hurmuzlu-2012"])
    with pytest.raises(UsageError) as caught:
        api.pictured(figure6, kind, choice)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_table_behind_a_picture_has_its_numbers(figure6: xr.Dataset) -> None:
    numbers = restitution(figure6, models=["gharib-hurmuzlu-2012"])
    head, *rows = csv.reader(as_csv(numbers).splitlines())
    assert head == ["x_axis", "y_axis", "curve", "model", "x", "y"]
    own = [(float(x), float(y)) for *_, model, x, y in rows if model]
    exact = figure6.sel(model="gharib-hurmuzlu-2012")
    assert own == list(zip(exact["e"].values.tolist(), exact["e_out"].values.tolist(), strict=True))


def test_names_stand_beside_few_curves_and_below_many(figure6: xr.Dataset) -> None:
    few = draw(restitution(figure6))
    assert few.legends == []
    names = {text.get_text().replace("\n", " ") for text in few.axes[0].texts}
    assert {curve.label for curve in only(restitution(figure6)).curves} <= names
    many = impact.sweep({"models": ["family:hysteresis", "!ye-2009-kelvin"],
                         "sweep": {"e": [0.1, 0.5, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}})  # fmt: skip
    (legend,) = draw(restitution(many)).legends
    assert len(legend.get_texts()) == many.sizes["model"] + 1


def test_a_name_crosses_no_curve_and_no_other_name(figure6: xr.Dataset) -> None:
    figure = draw(restitution(figure6))
    FigureCanvasAgg(figure).draw()
    axes = figure.axes[0]
    boxes = [text.get_window_extent() for text in axes.texts if text.get_fontsize() == 8.0]
    assert len(boxes) == 4
    for place, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:place])
        for line in axes.lines:
            path = axes.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()]))
            assert not Path2D(path).intersects_bbox(box, filled=False)


@pytest.mark.parametrize("width", WIDTHS.values(), ids=WIDTHS)
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("map", "validity")])
def test_nothing_is_clipped_at_either_width(figure6: xr.Dataset, kind: str, width: float) -> None:
    numbers = api.pictured(figure6, kind, Choice(sel={"e": 0.5} if kind in FOLLOWED else None))
    figure = draw(numbers, width)
    FigureCanvasAgg(figure).draw()
    assert figure.get_figwidth() == width
    inside = figure.bbox.padded(1)
    texts = [
        text for axes in figure.axes for text in (axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts)
    ]
    for text in (*texts, *(text for legend in figure.legends for text in legend.get_texts())):
        box = text.get_window_extent()
        assert inside.x0 <= box.x0, text
        assert box.x1 <= inside.x1, text
        assert inside.y0 <= box.y0, text
        assert box.y1 <= inside.y1, text


def test_a_model_looks_the_same_in_every_figure(figure6: xr.Dataset) -> None:
    def look(**choice: object) -> tuple[object, object]:
        line = next(x for x in impact.plot(figure6, **choice).axes[0].lines if "2012" in str(x.get_label()))
        return line.get_color(), line.get_marker()

    assert look() == look(models=["gharib-hurmuzlu-2012"])


def test_the_legend_covers_nothing(figure6: xr.Dataset) -> None:
    figure = impact.plot(figure6, width=3.5)
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    assert not legend.get_window_extent().overlaps(figure.axes[0].get_window_extent())
    inside = figure.bbox.padded(1)
    for artist in (legend, figure.axes[0].xaxis.label, figure.axes[0].title, *figure.axes[0].texts):
        box = artist.get_window_extent()
        assert inside.x0 <= box.x0, artist
        assert box.x1 <= inside.x1, artist


def test_the_slice_is_chosen_and_named(wide: xr.Dataset) -> None:
    assert "v1 = 1 m/s, m1 = 1 kg" in shown(final_velocities(wide))
    other = final_velocities(wide, sel={"v1": 2.0, "material2": "hard", "m2": np.inf}, models=["hertz"])
    assert "v1 = 2 m/s" in shown(other)
    assert "m1 = 3 kg" in shown(other)
    assert "material2 = hard" in shown(other)
    expected = wide["v1_post"].sel(model="hertz", v1=2.0, material2="hard", m1=3.0)
    values = next(c for c in only(other).curves if c.model == "hertz" and c.end == "v₁⁺").y
    assert values == tuple(expected.isel({"ismail-stronge-2008.gamma": 0}).values)


def test_values_that_vary_together_have_to_agree(wide: xr.Dataset) -> None:
    both = final_velocities(wide, sel={"m1": 3.0, "m2": np.inf})
    assert "m1 = 3 kg" in shown(both)
    with pytest.raises(UsageError, match=r"no m2 = 1\.0 in this result"):
        final_velocities(wide, sel={"m1": 3.0, "m2": 1.0})


def test_points_are_drawn_in_order_and_geometric_axes_in_logarithms() -> None:
    def drawn(values: list[float], log: str = "") -> Panel:
        sweep = {"e": 0.5, "v1": values, "m1": 1.0, "m2": 1.0, "K": 1e9}
        return only(final_velocities(impact.sweep({"models": "hertz", "sweep": sweep}), log=log))

    unsorted = drawn([5.0, 2.0, 3.3])
    assert unsorted.curves[0].x == (2.0, 3.3, 5.0)
    assert unsorted.curves[0].y == pytest.approx((0.5, 0.825, 1.25))
    assert not unsorted.x_log
    assert drawn([5.0, 2.0, 3.3], "xy").x_log
    assert drawn([5.0, 2.0, 3.3], "xy").y_log
    assert drawn([1000.0, 10.0, 0.1]).x_log


def test_over_another_axis(wide: xr.Dataset) -> None:
    panel = only(final_velocities(wide, x="v1", sel={"e": 0.6}))
    assert panel.curves[0].x == (1.0, 2.0)
    assert panel.x_label == "velocity of ball 1 before the impact, v1 [m/s]"
    walls = final_velocities(wide, x="m2")
    assert only(walls).curves[0].x == (1.0,)
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
def test_what_is_not_there_is_named(wide: xr.Dataset, choice: dict[str, object], words: str) -> None:
    with pytest.raises(UsageError) as caught:
        final_velocities(wide, **choice)
    assert words in str(caught.value)


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_the_same_bytes_each_time(figure6: xr.Dataset, tmp_path: Path, kind: str) -> None:
    for name in ("one", "two"):
        save_figure(impact.plot(figure6), tmp_path / f"{name}.{kind}")
    content = (tmp_path / f"one.{kind}").read_bytes()
    assert content == (tmp_path / f"two.{kind}").read_bytes()
    assert content.startswith({"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[kind])
    # saving by matplotlib's own method gives the same picture size and no error
    impact.plot(figure6).savefig(tmp_path / f"three.{kind}")


def test_no_other_ending(figure6: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"\.png, \.svg or \.pdf"):
        save_figure(impact.plot(figure6), tmp_path / "results.h5")
    assert list(tmp_path.iterdir()) == []


def test_text_from_a_file_is_text(figure6: xr.Dataset, tmp_path: Path) -> None:
    odd = figure6.assign_attrs(title="$\\frac{1$ \x1b[31m \u202e")
    odd["title"] = ("model", ["$x^{$", "a_b$", "[red]"])
    numbers = final_velocities(odd)
    assert "\x1b" not in numbers.title
    save_figure(draw(numbers), tmp_path / "odd.png")
    assert (tmp_path / "odd.png").stat().st_size > 10_000


def test_one_point_and_no_reference(tmp_path: Path) -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"v1": [1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}})
    numbers = final_velocities(result)
    assert [curve.model for curve in only(numbers).curves] == ["hertz", "hertz"]
    save_figure(draw(numbers), tmp_path / "one.png")
