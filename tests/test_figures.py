"""A figure shows the numbers of the slice it names, and has the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

import impact
from impact.errors import UsageError
from impact.views.figures import FinalVelocities, draw_final_velocities, final_velocities
from impact.views.look import save_figure


def test_figure_6_is_the_stored_numbers(figure6: xr.Dataset) -> None:
    numbers = final_velocities(figure6)
    assert numbers.x == "e"
    assert numbers.x_values == tuple(figure6["e"].values)
    labels = [curve.label for curve in numbers.curves if curve.ball == 1]
    assert labels == [
        "Impulse-momentum (6), (7)",
        "Lankarani and Nikravesh, permanent indentation (1994), (29)-(32)",
        "Lankarani and Nikravesh (1990), (22)",
        "Gharib and Hurmuzlu (2012), (28)",
    ]
    for curve in numbers.curves:
        expected = (0.5 - figure6["e"] / 2) if curve.ball == 1 else (0.5 + figure6["e"] / 2)
        if curve.model is not None:
            expected = figure6[f"v{curve.ball}_post"].sel(model=curve.model)
        assert curve.values == pytest.approx(expected.values, abs=1e-15)


def test_what_is_drawn_is_what_is_numbered(figure6: xr.Dataset) -> None:
    numbers = final_velocities(figure6)
    axes = impact.plot(figure6).axes[0]
    assert len(axes.lines) == len(numbers.curves) == 8
    for line, curve in zip(axes.lines, numbers.curves, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), numbers.x_values)
        np.testing.assert_array_equal(line.get_ydata(), curve.values)
    assert axes.get_ylabel() == "velocity after the impact [m/s]"
    models = {curve.model for curve in numbers.curves if curve.model}
    looks = {(line.get_color(), line.get_marker()) for line in axes.lines}
    assert len(looks) == len(models) + 1


def test_a_model_looks_the_same_in_every_figure(figure6: xr.Dataset) -> None:
    def look(**choice: object) -> tuple[object, object]:
        line = next(x for x in impact.plot(figure6, **choice).axes[0].lines if "2012" in str(x.get_label()))
        return line.get_color(), line.get_marker()

    assert look() == look(models=["gharib-hurmuzlu-2012"])


def test_the_legend_covers_nothing(figure6: xr.Dataset) -> None:
    figure = impact.plot(figure6)
    FigureCanvasAgg(figure).draw()
    (legend,) = figure.legends
    assert not legend.get_window_extent().overlaps(figure.axes[0].get_window_extent())
    inside = figure.bbox.padded(1)
    for artist in (legend, figure.axes[0].xaxis.label, figure.axes[0].title, *figure.axes[0].texts):
        box = artist.get_window_extent()
        assert inside.x0 <= box.x0, artist
        assert box.x1 <= inside.x1, artist


def test_the_slice_is_chosen_and_named(wide: xr.Dataset) -> None:
    first = final_velocities(wide)
    assert dict(first.slice) == {"v1": 1.0, "m1": 1.0, "material2": "soft", "ismail-stronge-2008.gamma": 1.5}
    other = final_velocities(wide, sel={"v1": 2.0, "material2": "hard", "m2": np.inf}, models=["hertz"])
    assert other.slice["v1"] == 2.0
    assert other.slice["m1"] == 3.0
    assert "v1 = 2 m/s" in other.conditions
    assert "material2 = hard" in other.conditions
    expected = wide["v1_post"].sel(model="hertz", v1=2.0, material2="hard", m1=3.0)
    values = next(c for c in other.curves if c.model == "hertz" and c.ball == 1).values
    assert values == tuple(expected.isel({"ismail-stronge-2008.gamma": 0}).values)


def test_values_that_vary_together_have_to_agree(wide: xr.Dataset) -> None:
    both = final_velocities(wide, sel={"m1": 3.0, "m2": np.inf})
    assert both.slice["m1"] == 3.0
    with pytest.raises(UsageError, match=r"no m2 = 1\.0 in this result"):
        final_velocities(wide, sel={"m1": 3.0, "m2": 1.0})


def test_points_are_drawn_in_order_and_geometric_axes_in_logarithms() -> None:
    def drawn(values: list[float]) -> FinalVelocities:
        sweep = {"e": 0.5, "v1": values, "m1": 1.0, "m2": 1.0, "K": 1e9}
        return final_velocities(impact.sweep({"models": "hertz", "sweep": sweep}))

    unsorted = drawn([5.0, 2.0, 3.3])
    assert unsorted.x_values == (2.0, 3.3, 5.0)
    assert unsorted.curves[1].values == pytest.approx((1.5, 2.475, 3.75))
    assert not unsorted.x_is_geometric
    geometric = drawn([1000.0, 10.0, 0.1])
    assert geometric.x_is_geometric
    assert draw_final_velocities(geometric).axes[0].get_xscale() == "log"


def test_over_another_axis(wide: xr.Dataset) -> None:
    numbers = final_velocities(wide, x="v1", sel={"e": 0.6})
    assert numbers.x_values == (1.0, 2.0)
    assert numbers.x_label == "velocity of ball 1 before the impact, v1 [m/s]"
    walls = final_velocities(wide, x="m2")
    assert walls.x_values == (1.0,)
    assert walls.not_drawn == (np.inf,)


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
    save_figure(draw_final_velocities(numbers), tmp_path / "odd.png")
    assert (tmp_path / "odd.png").stat().st_size > 10_000


def test_one_point_and_no_reference(tmp_path: Path) -> None:
    result = impact.sweep({"models": "hertz", "sweep": {"v1": [1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}})
    numbers = final_velocities(result)
    assert [curve.model for curve in numbers.curves] == ["hertz", "hertz"]
    save_figure(draw_final_velocities(numbers), tmp_path / "one.png")
