"""A picture over two axes shows the numbers of the plane that it names, and the model that is closest there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

import impact
from impact.errors import UsageError
from impact.formatting import percentage
from impact.plots import maps
from impact.plots.kinds import Choice, draw
from impact.plots.maps import CONTOURS, NO_VALUE, MapData, edges_of
from impact.plots.style import save_figure

from .test_plots import check_layout, texts_of

MODELS = ["flores-2011", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
MORE = [
    *MODELS, "hertz", "hunt-crossley-1975", "herbert-mcwhannell-1977", "lee-wang-1983", "gonthier-2004",
    "zhiying-qishao-2006", "hu-guo-2015", "carvalho-martins-2019", "lankarani-nikravesh-1994", "zhang-2020",
]  # fmt: skip


@pytest.fixture(scope="module")
def bent() -> xr.Dataset:
    """Over alpha and v1, where e = 1 - alpha v1 falls below 0 in a corner: those points have no number."""
    sweep = {
        "alpha": {"linspace": [0.3, 0.02, 9]}, "v1": {"linspace": [0.5, 6.0, 7]}, "m1": 1.0, "m2": [1.0, 4.0],
        "K": 6e9,
    }  # fmt: skip
    return impact.sweep({"title": "Speed", "models": MODELS, "sweep": sweep})


@pytest.fixture(scope="module")
def many() -> xr.Dataset:
    """Thirteen models over e, a geometric v1 and two masses."""
    sweep = {
        "e": {"linspace": [0.1, 1.0, 6]}, "v1": {"geomspace": [0.1, 10.0, 5]}, "m1": 1.0, "m2": [1.0, 4.0],
        "K": 6e9,
    }  # fmt: skip
    return impact.sweep({"title": "Thirteen", "models": MORE, "sweep": sweep})


def expected(dataset: xr.Dataset, numbers: MapData, model: str, **fixed: object) -> np.ndarray:
    """A field by y and x, looked up one point after another."""
    one = dataset[numbers.variable].sel(model=model, **fixed)
    return np.array([[one.sel({numbers.x: x, numbers.y: y}).item() for x in numbers.x_values]
                     for y in numbers.y_values])  # fmt: skip


def field_map(dataset: xr.Dataset, **choice: object) -> MapData:
    """The data of a map."""
    return maps.field_map(dataset, Choice(**choice))  # type: ignore[arg-type]


def validity(dataset: xr.Dataset, **choice: object) -> MapData:
    """The data of a map of the closest model."""
    return maps.validity_map(dataset, Choice(**choice))  # type: ignore[arg-type]


def conditions_of(numbers: MapData) -> str:
    """The conditions, whose parts do not break."""
    return numbers.conditions.replace("\xa0", " ")


def panels_of(figure: Figure, numbers: MapData) -> list[Axes]:
    """The panels; what comes after them is the colour bar."""
    return figure.axes[: 2 if numbers.closest else len(numbers.panels)]


def centres(numbers: MapData) -> np.ndarray:
    return np.array([(x, y) for y in numbers.y_values for x in numbers.x_values])


def covered(patch: PathPatch, numbers: MapData) -> np.ndarray:
    """By y and x, the cells whose middle lies in a patch."""
    inside = [patch.get_path().contains_point(point) for point in centres(numbers)]
    return np.array(inside).reshape(len(numbers.y_values), -1)


def test_the_numbers_are_those_of_the_dataset(bent: xr.Dataset) -> None:
    numbers = field_map(bent, sel={"m2": 4.0}, models=MODELS[::-1])
    assert (numbers.x, numbers.y, numbers.variable) == ("alpha", "v1", "e_error")
    assert numbers.x_values == tuple(sorted(bent["alpha"].values))
    assert [panel.model for panel in numbers.panels] == MODELS[::-1]
    assert [panel.label for panel in numbers.panels][1] == "Lankarani and Nikravesh (1990)"
    for panel in numbers.panels:
        np.testing.assert_array_equal(panel.values, expected(bent, numbers, str(panel.model), m2=4.0))
    assert "m2 = 4 kg" in conditions_of(numbers)
    assert "alpha" not in conditions_of(numbers)
    assert "m2 = 1 kg" in conditions_of(field_map(bent))


def test_axes_and_variable_are_chosen(many: xr.Dataset) -> None:
    assert (field_map(many).x, field_map(many).y) == ("e", "v1")
    assert (field_map(many, y="e").x, field_map(many, y="e").y) == ("v1", "e")
    assert (field_map(many, x="m2").x, field_map(many, x="m2").y) == ("m2", "e")
    assert (field_map(many, sel={"e": 1.0}).x, field_map(many, sel={"e": 1.0}).y) == ("v1", "m2")
    force = field_map(many, variable="peak_force", x="v1", y="m2", models=["hertz"])
    np.testing.assert_array_equal(force.panels[0].values, expected(many, force, "hertz", e=0.1))
    assert not force.signed
    assert force.labels == (
        "velocity of ball 1 before the impact", "mass of ball 2", "Largest contact force",
    )  # fmt: skip
    assert force.units == ("m/s", "kg", "N")
    (reference,) = field_map(many, variable="v1_reference").panels
    assert reference.model is None
    np.testing.assert_array_equal(reference.values, many["v1_reference"].isel(m2=0).transpose("v1", "e"))


def test_the_table_holds_every_point(bent: xr.Dataset) -> None:
    numbers = validity(bent)
    assert numbers.columns == ("model", "alpha", "v1", "e_error", "closest", "abs_e_error")
    rows = list(numbers.rows())
    assert len(rows) == 3 * 9 * 7
    for model, alpha, v1, error, closest, distance in rows[::5]:
        at = bent["e_error"].sel(alpha=alpha, v1=v1, m2=1.0)
        np.testing.assert_equal(error, at.sel(model=model).item())
        np.testing.assert_equal(distance, abs(at.sel(model=closest).item()) if closest else np.nan)
    plain = field_map(bent, models=MODELS[:1])
    assert plain.columns == ("model", "alpha", "v1", "e_error")
    assert {len(row) for row in plain.rows()} == {4}


def test_the_closest_model_is_the_one_with_the_smallest_error(bent: xr.Dataset) -> None:
    numbers = validity(bent)
    error = np.abs(np.stack([expected(bent, numbers, model, m2=1.0) for model in MODELS]))
    seen = set()
    for j, row in enumerate(numbers.closest):
        for i, key in enumerate(row):
            here = dict(zip(MODELS, error[:, j, i], strict=True))
            seen.add(key)
            if key is None:
                assert np.isnan(list(here.values())).all()
                assert np.isnan(numbers.distance[j][i])
            else:
                assert here[key] == numbers.distance[j][i] == min(here.values())
    assert seen >= {None, "flores-2011", "gharib-hurmuzlu-2012"}
    keys = [key for row in numbers.closest for key in row]
    assert numbers.shares == {key: keys.count(key) / 63 for key in (*MODELS, None) if key in keys}
    assert sum(numbers.shares.values()) == pytest.approx(1.0)


def test_a_tie_goes_to_the_first_and_a_model_without_a_number_is_passed_over(many: xr.Dataset) -> None:
    odd = many.isel(model=slice(0, 3)).copy(deep=True)
    odd["e_error"][0] = 0.02
    odd["e_error"][1] = -0.02 + 5e-10
    odd["e_error"][2] = np.nan
    assert set(validity(odd).shares) == {MODELS[0]}
    odd["e_error"][1] = -0.02 + 5e-9
    assert set(validity(odd).shares) == {MODELS[1]}
    odd["e_error"][2, 0] = 0.0
    numbers = validity(odd)
    assert numbers.shares == pytest.approx({MODELS[1]: 5 / 6, MODELS[2]: 1 / 6})
    draw(numbers, 7.1)


def test_edges_lie_half_way_between_the_values() -> None:
    assert edges_of([1.0, 2.0, 6.0], log=False).tolist() == [0.5, 1.5, 4.0, 8.0]
    assert edges_of([1.0, 4.0, 64.0], log=True) == pytest.approx([0.5, 2.0, 16.0, 256.0])


def test_what_is_drawn_is_what_is_numbered(many: xr.Dataset, bent: xr.Dataset) -> None:
    for dataset in (many, bent):
        numbers = field_map(dataset, models=MODELS)
        figure = draw(numbers, 7.1)
        for axes, panel in zip(panels_of(figure, numbers), numbers.panels, strict=True):
            (mesh,) = [one for one in axes.collections if isinstance(one, QuadMesh)]
            drawn = np.ma.filled(np.ma.asarray(mesh.get_array()), np.nan)
            np.testing.assert_array_equal(drawn.reshape(np.shape(panel.values)), panel.values)
            corners = mesh.get_coordinates()
            np.testing.assert_array_equal(corners[0, :, 0], edges_of(numbers.x_values, numbers.x_log))
            np.testing.assert_array_equal(corners[:, 0, 1], edges_of(numbers.y_values, numbers.y_log))
            assert axes.get_title("left").replace("\n", " ") == panel.label
            # one scale for all, which is white at 0
            low, high = mesh.get_clim()
            assert -low == high == np.nanmax(np.abs([one.values for one in numbers.panels]))
            scales = (axes.get_xscale(), axes.get_yscale())
            assert scales == ("linear", "log" if dataset is many else "linear")
    assert draw(field_map(bent, log="xy"), 7.1).axes[0].get_xscale() == "log"


def test_contour_lines_lie_where_the_error_has_their_value(many: xr.Dataset) -> None:
    numbers = field_map(many, models=["lankarani-nikravesh-1990"])
    figure = draw(numbers, 7.1)
    lines = [one for one in figure.axes[0].collections if not isinstance(one, QuadMesh)]
    (contours,) = lines
    error = numbers.panels[0].values[0]
    levels = [level for level in (-0.05, -0.01, 0.01, 0.05) if min(error) < level < max(error)]
    assert levels == [0.01, 0.05]
    for level, path in zip(levels, contours.get_paths(), strict=True):
        at = np.interp(level, error[::-1], numbers.x_values[::-1])
        assert path.vertices[:, 0] == pytest.approx(at)
        # from one end of the panel to the other
        assert sorted(path.vertices[[0, -1], 1]) == pytest.approx(edges_of(numbers.y_values, log=True)[[0, -1]])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [rf"$e_\mathrm{{out}}-e$ = ±{level:g}" for level in CONTOURS]
    # only an error has them
    assert not draw(field_map(many, variable="e_out", models=MODELS), 7.1).legends


def test_points_without_a_number_are_hatched_and_named(bent: xr.Dataset) -> None:
    odd = bent.copy(deep=True)
    odd["e_error"][1] = np.nan
    numbers = field_map(odd)
    figure = draw(numbers, 7.1)
    for axes, panel in zip(panels_of(figure, numbers), numbers.panels, strict=True):
        (patch,) = [one for one in axes.patches if isinstance(one, PathPatch)]
        assert patch.get_hatch()
        np.testing.assert_array_equal(covered(patch, numbers), np.isnan(panel.values))
    assert [text.get_text() for text in figure.legends[0].get_texts()].count(NO_VALUE) == 1
    whole = draw(field_map(bent, sel={"alpha": 0.02}, x="v1"), 7.1)
    assert NO_VALUE not in [text.get_text() for text in whole.legends[0].get_texts()]
    assert not whole.axes[0].patches


def test_the_patches_of_the_closest_are_the_numbers(bent: xr.Dataset) -> None:
    numbers = validity(bent)
    figure = draw(numbers, 7.1)
    left, right = panels_of(figure, numbers)
    patches = [one for one in left.patches if isinstance(one, PathPatch)]
    looks = {(patch.get_facecolor(), patch.get_hatch()) for patch in patches}
    assert len(looks) == len(patches) == len(numbers.shares)
    for key, patch in zip(numbers.shares, patches, strict=True):
        np.testing.assert_array_equal(covered(patch, numbers), np.array(numbers.closest, object) == key)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    for text, (key, share) in zip(texts, numbers.shares.items(), strict=False):
        assert text.startswith(percentage(share))
        assert (NO_VALUE in text) == (key is None)
    (mesh,) = [one for one in right.collections if isinstance(one, QuadMesh)]
    drawn = np.ma.filled(np.ma.asarray(mesh.get_array()), np.nan).reshape(np.shape(numbers.distance))
    np.testing.assert_array_equal(drawn, np.maximum(numbers.distance, 1e-9))
    (hatched,) = right.patches
    np.testing.assert_array_equal(covered(hatched, numbers), np.isnan(numbers.distance))


def test_values_are_sorted_and_what_has_no_place_is_named() -> None:
    sweep = {"e": [0.9, 0.1, 0.5], "m2": [4.0, np.inf, 1.0], "m1": 1.0, "v1": [1.0], "K": 6e9}
    numbers = field_map(impact.sweep({"models": "flores-2011", "sweep": sweep}))
    assert (numbers.x_values, numbers.y_values) == ((0.1, 0.5, 0.9), (1.0, 4.0))
    assert numbers.not_drawn == ("m2 = inf",)
    # one value is no axis
    assert "v1 = 1 m/s" in conditions_of(numbers)


def test_more_models_than_panels_are_left_out_and_said(many: xr.Dataset) -> None:
    numbers = field_map(many)
    assert [panel.model for panel in numbers.panels] == MORE[:12]
    assert numbers.left_out == ("zhang-2020",)
    assert numbers.conditions.endswith("; the first 12 of 13 models")
    assert len(draw(numbers, 7.1).axes) == 13
    # all of them compete
    assert len(validity(many).panels) == 13
    assert not validity(many).left_out


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"variable": "e_eror"}, 'no variable "e_eror" in this result; did you mean "e_error"?'),
        ({"variable": "\x1b[31m"}, r'no variable "\x1b[31m" in this result; known: closed_form_error'),
        ({"x": "v3"}, 'cannot draw over "v3"'),
        ({"x": "e"}, "cannot draw over e, which varies over alpha, v1; select one with --sel"),
        ({"x": "v1", "y": "v1"}, "map needs two axes; v1 and v1 vary together"),
        ({"sel": {"v1": 6.0, "m2": 1.0}, "y": "e", "x": "alpha"}, "map needs two axes; alpha and e vary together"),
        ({"sel": {"m3": 1.0}}, 'no axis "m3" in this result'),
        ({"sel": {"v1": 0.5, "m2": 1.0}}, "map needs two axes; this result has e alone; sweep a second, or"),
        ({"models": ["herz"]}, 'no model "herz" in this result'),
    ],
)  # fmt: skip
def test_a_bad_wish_is_one_line(bent: xr.Dataset, choice: dict[str, object], words: str) -> None:
    with pytest.raises(UsageError) as caught:
        field_map(bent, **choice)  # type: ignore[arg-type]
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_bad_result_is_one_line(figure6: xr.Dataset, many: xr.Dataset) -> None:
    def refused(dataset: xr.Dataset, kind: str = "map", **choice: str) -> str:
        with pytest.raises(UsageError) as caught:
            field_map(dataset, **choice) if kind == "map" else validity(dataset)
        return str(caught.value)

    alone = "needs two axes; this result has e alone; sweep a second, or use --kind restitution"
    assert refused(figure6) == f"map {alone}"
    assert refused(figure6, "validity") == f"validity {alone}"
    assert refused(figure6.isel(e=0)).startswith("map needs two axes; this result has none")
    assert refused(impact.run(at={"e": 0.5}).history).startswith("this is a time history")
    one = many.isel(v1=[0])
    assert refused(one, y="v1") == "map needs different values along each axis; v1 has 1 that can be drawn"
    twice = many.assign_coords(v1=[1.0, 1.0, 2.0, 3.0, 4.0])
    assert refused(twice, y="v1") == "map needs different values along each axis; v1 has a value twice"
    assert (
        refused(many.assign_coords(v1=np.arange(5.0)), y="v1", log="y")
        == "--log y: v1 has values that are not above 0"
    )
    assert refused(many.drop_vars("e_error"), "validity").startswith('no variable "e_error" in this result')
    empty = many.assign(e_error=many["e_error"] * np.nan, kind=("model", ["a"] * 13))
    assert refused(empty, "validity") == "no picture of e_error over e and v1: it has no value there"
    assert refused(empty, variable="kind") == "no picture of kind over e and v1: it is not a number at each point"


@pytest.mark.parametrize("width", [7.1, 3.3])
@pytest.mark.parametrize(
    ("kind", "count"), [("map", 1), ("map", 3), ("force", 7), ("swapped", 12), ("validity", 7)]
)
def test_nothing_covers_a_text(many: xr.Dataset, kind: str, count: int, width: float) -> None:
    models = MORE[:count]
    numbers = {
        "map": lambda: field_map(many, models=models, log="xy" if count == 3 else ""),
        "validity": lambda: validity(many, models=models),
        "force": lambda: field_map(many, variable="peak_force", models=models, x="v1", y="m2"),
        "swapped": lambda: field_map(many, variable="energy_residual", models=models, x="m2", y="e"),
    }[kind]()
    figure = draw(numbers, width)
    assert figure.get_size_inches()[0] == width
    check_layout(figure)


def test_text_from_a_file_is_text(bent: xr.Dataset, tmp_path: Path) -> None:
    odd = bent.assign_attrs(title="$\\frac{1}{0}$ \x1b[31m \u202e " + "W" * 90)
    odd["title"] = ("model", ["$\\frac{1}{0}$", "_" + "W" * 70, "[red] $x^{$"])
    odd["v1"].attrs["long_name"] = "$\\frac{1}{0}$ " + "long " * 30
    odd["e_error"].attrs["long_name"] = "_{$ " * 20
    for numbers, width in ((field_map(odd), 7.1), (validity(odd), 3.5)):
        assert "\x1b" not in numbers.title
        figure = draw(numbers, width)
        check_layout(figure)
        # a dollar is escaped where mathtext is read
        shown = ["".join(text.get_text().split()) for text in texts_of(figure)]
        assert any(r"\$\frac{1}{0}\$(2011)" in text for text in shown)
        assert any(r"\$\frac{1}{0}\$\x1b[31m\u202eWWW" in text for text in shown)
    save_figure(draw(validity(odd), 3.5), tmp_path / "odd.svg")


def test_every_axis_has_ticks_named_by_their_values(many: xr.Dataset) -> None:
    raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")
    for numbers in (field_map(many, models=MODELS), validity(many, models=MODELS)):
        figure = draw(numbers, 7.1)
        FigureCanvasAgg(figure).draw()
        for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis):
            low, high = axis.get_view_interval()
            ticks = zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True)
            seen = [(value, text.get_text().translate(raised)) for value, text in ticks if low <= value <= high]
            assert [float(name) for _, name in seen] == pytest.approx([value for value, _ in seen])
            # 0.1 to 1 over a panel of two inches has more than its ends
            assert len(seen) > 3
        assert [name for _, name in seen] == ["0.1", "0.3", "1", "3", "10"]


def test_the_last_row_and_the_first_column_have_names(many: xr.Dataset) -> None:
    figure = draw(field_map(many, models=MORE[:7]), 7.1)
    FigureCanvasAgg(figure).draw()

    def is_named(axis: Axis) -> bool:
        return any(tick.label1.get_visible() for tick in axis.get_major_ticks())

    named = [(is_named(axes.xaxis), is_named(axes.yaxis)) for axes in figure.axes[:7]]
    assert named == [(False, True), *[(False, False)] * 2, (True, False), (True, True), *[(True, False)] * 2]


def test_a_large_plane_is_an_image(many: xr.Dataset, tmp_path: Path) -> None:
    fine = many.isel(model=[0], m2=0).interp(e=np.linspace(0.1, 1.0, 210), v1=np.linspace(0.1, 10.0, 100))
    fine["e_error"][:, :20] = np.nan
    for make in (field_map, validity):
        save_figure(draw(make(fine), 3.5), tmp_path / "large.svg")
        assert (tmp_path / "large.svg").stat().st_size < 400_000
        save_figure(draw(make(fine), 3.5), tmp_path / "large.pdf")
        assert (tmp_path / "large.pdf").stat().st_size < 400_000
