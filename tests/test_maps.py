"""A map over two axes shows the values of the plane that it names, or the closest model at each point."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.text import Text

import impact
from impact.errors import UsageError
from impact.formatting import percentage
from impact.plots import maps
from impact.plots.draw import draw
from impact.plots.kinds import Choice, Look
from impact.plots.maps import CONTOURS, NO_VALUE, SEVERAL, MapData, edges_of
from impact.plots.style import save_figure

from .conftest import one_line
from .test_plots import check_layout, texts_of

MODELS = ["flores-2011", "lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
MORE = [
    *MODELS,
    "hertz",
    "hunt-crossley-1975",
    "herbert-mcwhannell-1977",
    "lee-wang-1983",
    "gonthier-2004",
    "zhiying-qishao-2006",
    "hu-guo-2015",
    "carvalho-martins-2019",
    "lankarani-nikravesh-1994",
    "zhang-2020",
]


@pytest.fixture(scope="module")
def over_speed() -> xr.Dataset:
    """Over alpha and v1, where e = 1 - alpha v1 falls below 0 in a corner: those points have no number."""
    sweep = {
        "alpha": {"linspace": [0.3, 0.02, 9]},
        "v1": {"linspace": [0.5, 6.0, 7]},
        "m1": 1.0,
        "m2": [1.0, 4.0],
        "K": 6e9,
    }
    return impact.sweep({"title": "Speed", "models": MODELS, "sweep": sweep, "solver": {"rtol": 1e-4}})


@pytest.fixture(scope="module")
def many() -> xr.Dataset:
    """Thirteen models over e, a geometric v1 and two masses."""
    sweep = {
        "e": {"linspace": [0.1, 1.0, 6]},
        "v1": {"geomspace": [0.1, 10.0, 5]},
        "m1": 1.0,
        "m2": [1.0, 4.0],
        "K": 6e9,
    }
    return impact.sweep({"title": "Thirteen", "models": MORE, "sweep": sweep, "solver": {"rtol": 1e-4}})


def expected(dataset: xr.Dataset, map_data: MapData, model: str, **fixed: object) -> np.ndarray:
    """A field by y and x, looked up point by point."""
    field = dataset[map_data.variable].sel(model=model, **fixed)
    rows = [[field.sel({map_data.x: x, map_data.y: y}) for x in map_data.x_values] for y in map_data.y_values]
    return np.array(rows, float)


def field_map(dataset: xr.Dataset, **choice: object) -> MapData:
    """The data of a map."""
    return maps.field_map(dataset, Choice(**choice))  # type: ignore[arg-type]


def validity(dataset: xr.Dataset, **choice: object) -> MapData:
    """The data of a map of the closest model."""
    return maps.validity_map(dataset, Choice(**choice))  # type: ignore[arg-type]


def conditions_of(map_data: MapData) -> str:
    """The conditions of a map, with plain spaces."""
    return map_data.conditions.replace("\xa0", " ")


def panels_of(figure: Figure, map_data: MapData) -> list[Axes]:
    """The axes of the panels, without the colour bar, which comes last."""
    return figure.axes[: 2 if map_data.closest else len(map_data.panels)]


def centres(map_data: MapData) -> np.ndarray:
    return np.array([(x, y) for y in map_data.y_values for x in map_data.x_values])


def covered(patch: PathPatch, map_data: MapData) -> np.ndarray:
    """Whether the centre of each cell is inside a patch, by y and x."""
    inside = [patch.get_path().contains_point(point) for point in centres(map_data)]
    return np.array(inside).reshape(len(map_data.y_values), -1)


def test_map_data_are_the_values_of_the_dataset(over_speed: xr.Dataset) -> None:
    map_data = field_map(over_speed, sel={"m2": 4.0}, models=MODELS[::-1])
    assert (map_data.x, map_data.y, map_data.variable) == ("alpha", "v1", "e_error")
    assert map_data.x_values == tuple(sorted(over_speed["alpha"].values))
    assert [panel.model for panel in map_data.panels] == MODELS[::-1]
    assert [panel.label for panel in map_data.panels][1] == "Lankarani and Nikravesh (1990)"
    for panel in map_data.panels:
        np.testing.assert_array_equal(panel.values, expected(over_speed, map_data, str(panel.model), m2=4.0))
    assert "m2 = 4 kg" in conditions_of(map_data)
    assert "alpha" not in conditions_of(map_data)
    assert "m2 = 1 kg" in conditions_of(field_map(over_speed))


def test_axes_and_variable_are_chosen(many: xr.Dataset) -> None:
    assert (field_map(many).x, field_map(many).y) == ("e", "v1")
    assert (field_map(many, y="e").x, field_map(many, y="e").y) == ("v1", "e")
    assert (field_map(many, x="m2").x, field_map(many, x="m2").y) == ("m2", "e")
    assert (field_map(many, sel={"e": 1.0}).x, field_map(many, sel={"e": 1.0}).y) == ("v1", "m2")
    force = field_map(many, variable="peak_force", x="v1", y="m2", models=["hertz"])
    np.testing.assert_array_equal(force.panels[0].values, expected(many, force, "hertz", e=0.1))
    assert not force.signed
    assert force.labels == (
        "velocity of ball 1 before the impact",
        "mass of ball 2",
        "Largest contact force",
    )
    assert force.units == ("m/s", "kg", "N")
    (reference,) = field_map(many, variable="v1_reference").panels
    assert reference.model is None
    np.testing.assert_array_equal(reference.values, many["v1_reference"].isel(m2=0).transpose("v1", "e"))


def test_the_table_holds_every_point(over_speed: xr.Dataset) -> None:
    map_data = validity(over_speed)
    table = map_data.long_table()
    assert list(table) == ["model", "alpha", "v1", "e_error", "closest", "abs_e_error"]
    assert len(table) == 3 * 9 * 7
    for model, alpha, v1, error, closest, distance in table[::5].itertuples(index=False):
        at = over_speed["e_error"].sel(alpha=alpha, v1=v1, m2=1.0)
        np.testing.assert_equal(error, at.sel(model=model).item())
        smallest = np.abs(at).min().item()
        np.testing.assert_equal(distance, smallest if closest else np.nan)
        assert closest in ("", SEVERAL) or abs(at.sel(model=closest).item()) == smallest
    plain = field_map(over_speed, models=MODELS[:1])
    assert list(plain.long_table()) == ["model", "alpha", "v1", "e_error"]


def test_the_closest_model_is_the_one_with_the_smallest_error(over_speed: xr.Dataset) -> None:
    map_data = validity(over_speed)
    error = np.abs(np.stack([expected(over_speed, map_data, model, m2=1.0) for model in MODELS]))
    seen = set()
    for j, row in enumerate(map_data.closest):
        for i, key in enumerate(row):
            here = dict(zip(MODELS, error[:, j, i], strict=True))
            seen.add(key)
            if key is None:
                assert np.isnan(list(here.values())).all()
                assert np.isnan(map_data.distance[j][i])
            else:
                least = map_data.distance[j][i]
                assert least == min(here.values())
                # the errors of an integrator at rtol 1e-4 are up to 1e-4
                equal = [model for model, distance in here.items() if distance <= least + 2e-4]
                assert key == (equal[0] if len(equal) == 1 else SEVERAL)
    assert seen >= {None, "flores-2011", "gharib-hurmuzlu-2012"}
    keys = [key for row in map_data.closest for key in row]
    assert map_data.shares == {key: keys.count(key) / 63 for key in (*MODELS, SEVERAL, None) if key in keys}
    assert sum(map_data.shares.values()) == pytest.approx(1.0)


def test_models_with_equal_errors_are_several_and_missing_values_never_win(many: xr.Dataset) -> None:
    changed = many.isel(model=slice(0, 3)).copy(deep=True).assign_attrs(rtol=1e-10)
    changed["e_error"][0] = 0.02
    changed["e_error"][1] = -0.02 + 5e-10
    changed["e_error"][2] = np.nan
    assert set(validity(changed).shares) == {SEVERAL}
    # such a difference is one of the integrator only if that is less accurate
    changed["e_error"][1] = -0.02 + 5e-9
    assert set(validity(changed).shares) == {MODELS[1]}
    assert set(validity(changed.assign_attrs(rtol=1e-8)).shares) == {SEVERAL}
    changed["e_error"][2, 0] = 0.0
    changed["e_error"][:, 1] = np.nan
    map_data = validity(changed)
    assert map_data.shares == pytest.approx({MODELS[1]: 4 / 6, MODELS[2]: 1 / 6, None: 1 / 6})
    draw(map_data, Look(7.1))


def test_where_laws_are_exact_none_of_them_is_the_closest() -> None:
    # at e = 1 both laws are exact, and the last digit of the integrator is no reason to prefer one
    sweep = {"e": {"linspace": [0.1, 1.0, 10]}, "v1": [0.1, 1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    map_data = validity(impact.sweep({"models": ["hertz", "lankarani-nikravesh-1990"], "sweep": sweep}))
    assert map_data.shares == {"lankarani-nikravesh-1990": 0.9, SEVERAL: 0.1}
    assert [row[-1] for row in map_data.closest] == [SEVERAL, SEVERAL]
    figure = draw(map_data, Look(7.1))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "10.0%  several models, equally close" in texts
    # a border would be drawn around each row of cells
    patches = panels_of(figure, map_data)[0].patches
    assert [(type(patch), patch.get_linewidth()) for patch in patches] == [(PathPatch, 0.0)] * 2


def test_errors_of_the_solver_have_the_colour_of_no_error() -> None:
    sweep = {"e": [0.5, 0.7], "v1": [0.1, 1.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    figure = impact.plot(impact.sweep({"models": ["tsuji-1992"], "sweep": sweep}), kind="map")
    mesh = next(part for part in figure.axes[0].collections if isinstance(part, QuadMesh))
    assert mesh.get_clim() == (-1e-9, 1e-9)


def test_a_constant_has_one_colour_and_one_height_whatever_its_last_digits() -> None:
    sweep = {"e": 0.8, "v1": [0.1, 1.0, 2.0], "m1": 1.0, "m2": [1.0, 2.0, 3.0], "K": 6e9}
    result = impact.sweep({"models": ["tsuji-1992"], "sweep": sweep})
    assert 0.0 < abs(result["e_error"]).max() < 1e-9
    picture = impact.plot(result, kind="map", variable="e_out").axes[0]
    (mesh,) = (part for part in picture.collections if isinstance(part, QuadMesh))
    for limits in (mesh.get_clim(), impact.plot(result, kind="restitution").axes[0].get_ylim()):
        assert limits == pytest.approx((0.76, 0.84))


def test_edges_lie_half_way_between_values() -> None:
    assert edges_of([1.0, 2.0, 6.0], log=False).tolist() == [0.5, 1.5, 4.0, 8.0]
    assert edges_of([1.0, 4.0, 64.0], log=True) == pytest.approx([0.5, 2.0, 16.0, 256.0])


def test_the_drawn_mesh_has_the_values_and_edges_of_the_map_data(many: xr.Dataset, over_speed: xr.Dataset) -> None:
    for dataset in (many, over_speed):
        map_data = field_map(dataset, models=MODELS)
        figure = draw(map_data, Look(7.1))
        for axes, panel in zip(panels_of(figure, map_data), map_data.panels, strict=True):
            (mesh,) = [artist for artist in axes.collections if isinstance(artist, QuadMesh)]
            drawn = np.ma.filled(np.ma.asarray(mesh.get_array()), np.nan)
            np.testing.assert_array_equal(drawn.reshape(np.shape(panel.values)), panel.values)
            corners = mesh.get_coordinates()
            np.testing.assert_array_equal(corners[0, :, 0], edges_of(map_data.x_values, map_data.x_log))
            np.testing.assert_array_equal(corners[:, 0, 1], edges_of(map_data.y_values, map_data.y_log))
            assert axes.get_title("left").replace("\n", " ") == panel.label
            # all panels share a scale, which is white at 0
            low, high = mesh.get_clim()
            assert -low == high == np.nanmax(np.abs([other.values for other in map_data.panels]))
            scales = (axes.get_xscale(), axes.get_yscale())
            assert scales == ("linear", "log" if dataset is many else "linear")
    assert draw(field_map(over_speed, log="xy"), Look(7.1)).axes[0].get_xscale() == "log"


def test_contour_lines_lie_where_the_error_has_their_value(many: xr.Dataset) -> None:
    map_data = field_map(many, models=["lankarani-nikravesh-1990"])
    figure = draw(map_data, Look(7.1))
    lines = [artist for artist in figure.axes[0].collections if not isinstance(artist, QuadMesh)]
    (contours,) = lines
    error = map_data.panels[0].values[0]
    levels = [level for level in (-0.05, -0.01, 0.01, 0.05) if min(error) < level < max(error)]
    assert levels == [0.01, 0.05]
    for level, path in zip(levels, contours.get_paths(), strict=True):
        at = np.interp(level, error[::-1], map_data.x_values[::-1])
        assert path.vertices[:, 0] == pytest.approx(at)
        # from one end of the panel to the other
        assert sorted(path.vertices[[0, -1], 1]) == pytest.approx(edges_of(map_data.y_values, log=True)[[0, -1]])
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == [rf"$e_\mathrm{{out}}-e$ = ±{level:g}" for level in CONTOURS]
    # only an error has contour lines
    assert not draw(field_map(many, variable="e_out", models=MODELS), Look(7.1)).legends


def test_points_without_a_value_are_hatched_and_in_the_legend(over_speed: xr.Dataset) -> None:
    changed = over_speed.copy(deep=True)
    changed["e_error"][1] = np.nan
    map_data = field_map(changed)
    figure = draw(map_data, Look(7.1))
    for axes, panel in zip(panels_of(figure, map_data), map_data.panels, strict=True):
        (patch,) = [artist for artist in axes.patches if isinstance(artist, PathPatch)]
        assert patch.get_hatch()
        np.testing.assert_array_equal(covered(patch, map_data), np.isnan(panel.values))
    assert [text.get_text() for text in figure.legends[0].get_texts()].count(NO_VALUE) == 1
    whole = draw(field_map(over_speed, sel={"alpha": 0.02}, x="v1"), Look(7.1))
    assert NO_VALUE not in [text.get_text() for text in whole.legends[0].get_texts()]
    assert not whole.axes[0].patches


def test_the_patch_of_a_model_covers_the_points_where_it_is_closest(over_speed: xr.Dataset) -> None:
    map_data = validity(over_speed)
    figure = draw(map_data, Look(7.1))
    left, right = panels_of(figure, map_data)
    patches = [artist for artist in left.patches if isinstance(artist, PathPatch)]
    looks = {(patch.get_facecolor(), patch.get_hatch()) for patch in patches}
    assert len(looks) == len(patches) == len(map_data.shares)
    for key, patch in zip(map_data.shares, patches, strict=True):
        np.testing.assert_array_equal(covered(patch, map_data), np.array(map_data.closest, object) == key)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    for text, (key, share) in zip(texts, map_data.shares.items(), strict=False):
        assert text.startswith(percentage(share))
        assert (NO_VALUE in text) == (key is None)
    (mesh,) = [artist for artist in right.collections if isinstance(artist, QuadMesh)]
    drawn = np.ma.filled(np.ma.asarray(mesh.get_array()), np.nan).reshape(np.shape(map_data.distance))
    np.testing.assert_array_equal(drawn, np.maximum(map_data.distance, 1e-9))
    (hatched,) = right.patches
    np.testing.assert_array_equal(covered(hatched, map_data), np.isnan(map_data.distance))


def test_values_are_sorted_and_those_not_drawn_are_reported() -> None:
    sweep = {"e": [0.9, 0.1, 0.5], "m2": [4.0, np.inf, 1.0], "m1": 1.0, "v1": [1.0], "K": 6e9}
    map_data = field_map(impact.sweep({"models": "flores-2011", "sweep": sweep}))
    assert (map_data.x_values, map_data.y_values) == ((0.1, 0.5, 0.9), (1.0, 4.0))
    assert map_data.not_drawn == ("m2 = inf",)
    # a single value is not an axis
    assert "v1 = 1 m/s" in conditions_of(map_data)


def test_models_beyond_the_largest_number_of_panels_are_reported(many: xr.Dataset) -> None:
    map_data = field_map(many)
    assert [panel.model for panel in map_data.panels] == MORE[:12]
    assert map_data.left_out == ("zhang-2020",)
    assert map_data.conditions.endswith("; the first 12 of 13 models")
    assert len(draw(map_data, Look(7.1)).axes) == 13
    # the closest model is chosen among all models
    assert len(validity(many).panels) == 13
    assert not validity(many).left_out


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"variable": "e_eror"}, 'no variable "e_eror" in this result; did you mean "e_error"?'),
        ({"variable": "\x1b[31m"}, r'no variable "\x1b[31m" in this result; known: closed_form_error'),
        ({"x": "v3"}, 'cannot draw over "v3"'),
        ({"x": "e"}, "cannot draw over e, which varies over alpha, v1; select one with sel"),
        ({"x": "v1", "y": "v1"}, "map needs two axes; v1 and v1 vary together"),
        ({"sel": {"v1": 6.0, "m2": 1.0}, "y": "e", "x": "alpha"}, "map needs two axes; alpha and e vary together"),
        ({"sel": {"m3": 1.0}}, 'no axis "m3" in this result'),
        (
            {"sel": {"v1": 0.5, "m2": 1.0}},
            "map needs two axes; this result has e alone left beside the selected values; sweep a second, or",
        ),
        ({"models": ["herz"]}, 'no model "herz" in this result'),
    ],
)
def test_a_wrong_choice_is_an_error_of_one_line(
    over_speed: xr.Dataset, choice: dict[str, object], words: str
) -> None:
    with pytest.raises(UsageError, match=one_line(words)):
        field_map(over_speed, **choice)  # type: ignore[arg-type]


def test_a_result_that_cannot_be_drawn_is_an_error_of_one_line(figure6: xr.Dataset, many: xr.Dataset) -> None:
    def refused(dataset: xr.Dataset, kind: str = "map", **choice: str) -> str:
        with pytest.raises(UsageError) as caught:
            field_map(dataset, **choice) if kind == "map" else validity(dataset)
        return str(caught.value)

    alone = 'needs two axes; this result has e alone; sweep a second, or use kind="restitution"'
    assert refused(figure6) == f"map {alone}"
    assert refused(figure6, "validity") == f"validity {alone}"
    assert refused(figure6.isel(e=0)).startswith("map needs two axes; this result has none")
    assert refused(impact.run(at={"e": 0.5}).history).startswith("this is a time history")
    narrow = many.isel(v1=[0])
    assert refused(narrow, y="v1") == "map needs different values along each axis; v1 has 1 that can be drawn"
    twice = many.assign_coords(v1=[1.0, 1.0, 2.0, 3.0, 4.0])
    assert refused(twice, y="v1") == "map needs different values along each axis; v1 has a value twice"
    assert (
        refused(many.assign_coords(v1=np.arange(5.0)), y="v1", log="y")
        == 'log="y": v1 got values <= 0, expected values > 0'
    )
    assert refused(many.drop_vars("e_error"), "validity").startswith('no variable "e_error" in this result')
    empty = many.assign(e_error=many["e_error"] * np.nan, kind=("model", ["a"] * 13))
    assert refused(empty, "validity") == "cannot draw e_error over e and v1: it has no value there"
    assert (
        refused(empty, variable="kind")
        == "cannot draw kind over e and v1: it does not have a number at each point"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count", "width"),
    [
        ("map", 1, 7.1),
        ("map", 3, 3.3),
        ("validity", 7, 3.3),
        ("swapped", 12, 3.3),
        ("map", 1, 3.3),
        ("map", 3, 7.1),
        ("force", 7, 3.3),
        ("force", 7, 7.1),
        ("swapped", 12, 7.1),
        ("validity", 7, 7.1),
    ],
)
def test_texts_do_not_overlap(many: xr.Dataset, kind: str, count: int, width: float) -> None:
    models = MORE[:count]
    map_data = {
        "map": lambda: field_map(many, models=models, log="xy" if count == 3 else ""),
        "validity": lambda: validity(many, models=models),
        "force": lambda: field_map(many, variable="peak_force", models=models, x="v1", y="m2"),
        "swapped": lambda: field_map(many, variable="energy_residual", models=models, x="m2", y="e"),
    }[kind]()
    figure = draw(map_data, Look(width))
    assert figure.get_size_inches()[0] == width
    check_layout(figure)


@pytest.mark.slow
def test_text_from_a_file_is_text(over_speed: xr.Dataset, tmp_path: Path) -> None:
    changed = over_speed.assign_attrs(title="$\\frac{1}{0}$ \x1b[31m \u202e " + "W" * 90)
    changed["title"] = ("model", ["$\\frac{1}{0}$", "_" + "W" * 70, "[red] $x^{$"])
    changed["v1"].attrs["long_name"] = "$\\frac{1}{0}$ " + "long " * 30
    changed["e_error"].attrs["long_name"] = "_{$ " * 20
    for map_data, width in ((field_map(changed), 7.1), (validity(changed), 3.5)):
        assert "\x1b" not in map_data.title
        figure = draw(map_data, Look(width))
        check_layout(figure)
        # a dollar is escaped where mathtext is read
        shown = ["".join(text.get_text().split()) for text in texts_of(figure)]
        assert any(r"\$\frac{1}{0}\$(2011)" in text for text in shown)
        assert any(r"\$\frac{1}{0}\$\x1b[31m\u202eWWW" in text for text in shown)
    save_figure(figure, tmp_path / "odd.svg")


@pytest.mark.slow
def test_ticks_are_labelled_with_their_values(many: xr.Dataset) -> None:
    raised = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")
    for map_data in (field_map(many, models=MODELS[:1]), validity(many, models=MODELS)):
        figure = draw(map_data, Look(7.1))
        figure.draw_without_rendering()
        for axis in (figure.axes[0].xaxis, figure.axes[0].yaxis):
            low, high = axis.get_view_interval()
            ticks = zip(axis.get_ticklocs(), axis.get_ticklabels(), strict=True)
            seen = [(value, text.get_text().translate(raised)) for value, text in ticks if low <= value <= high]
            assert [float(name) for _, name in seen] == pytest.approx([value for value, _ in seen])
            # 0.1 to 1 over a panel of two inches has more than its ends
            assert len(seen) > 3
        assert [name for _, name in seen] == ["0.1", "0.3", "1", "3", "10"]


def test_only_the_last_row_and_the_first_column_have_tick_labels(many: xr.Dataset) -> None:
    figure = draw(field_map(many, models=MORE[:7]), Look(7.1))

    def is_named(axis: Axis) -> bool:
        return any(tick.label1.get_visible() for tick in axis.get_major_ticks())

    named = [(is_named(axes.xaxis), is_named(axes.yaxis)) for axes in figure.axes[:7]]
    assert named == [(False, True), *[(False, False)] * 2, (True, False), (True, True), *[(True, False)] * 2]


def test_a_cell_of_a_vector_map_has_an_edge_of_its_colour(over_speed: xr.Dataset, tmp_path: Path) -> None:
    """Without an edge, or with one thinner than a pixel, viewers show seams between cells."""
    impact.plot(over_speed, kind="map", models=MODELS[:1]).savefig(tmp_path / "map.svg")
    mesh = (tmp_path / "map.svg").read_text(encoding="utf-8").split('<g id="QuadMesh_1">')[1].split("</g>")[0]
    styles = [style.split('"')[0] for style in mesh.split('style="')[1:]]
    coloured = [dict(word.split(": ") for word in style.split("; ")) for style in styles if "fill: #" in style]
    assert len(coloured) == int(over_speed["e_error"].isel(model=0, m2=0).notnull().sum())
    assert all(words.get("stroke") == words["fill"] for words in coloured)
    assert all(float(words.get("stroke-width", 1.0)) >= 1.0 for words in coloured)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["svg", "pdf"])
def test_a_map_of_many_points_is_stored_as_an_image(many: xr.Dataset, tmp_path: Path, form: str) -> None:
    plane = many[["e_error"]].isel(model=[0], m2=0)
    fine = plane.interp(e=np.linspace(0.1, 1.0, 210), v1=np.linspace(0.1, 10.0, 100))
    fine["e_error"][:, :20] = np.nan
    for get_map_data in (field_map, validity):
        save_figure(draw(get_map_data(fine), Look(3.5)), tmp_path / f"large.{form}")
        assert (tmp_path / f"large.{form}").stat().st_size < 400_000


@pytest.mark.slow
@pytest.mark.parametrize("legend", ["full", "short", "keys"])
def test_names_above_panels_have_two_lines_within_them_and_letters_of_one_size(legend: str) -> None:
    sweep = {"v1": [1.0, 2.0], "e": [0.5, 0.9], "m1": 1.0, "m2": 1.0, "K": 6e9}
    keys = ["lammps-coeff-restitution-hertz", "lankarani-nikravesh-1990", "hertz"]
    figure = impact.plot(impact.sweep({"models": keys, "sweep": sweep}), kind="map", width="84mm", legend=legend)
    figure.draw_without_rendering()
    names = [axes.get_children() for axes in figure.axes[:3]]
    shown = [text for each in names for text in each if isinstance(text, Text) and text.get_text()]
    assert len(shown) == 3
    assert len({text.get_fontsize() for text in shown}) == 1
    for axes, text in zip(figure.axes, shown, strict=False):
        assert text.get_text().count("\n") <= 1
        assert text.get_window_extent().width <= axes.get_window_extent().width + 1.0


@pytest.mark.parametrize("kind", ["map", "validity"])
def test_every_number_of_a_map_has_a_decimal_comma(kind: str) -> None:
    """Those of the colour bar and of the names of panels, too."""
    sweep = {"e": [0.25, 0.5, 0.75], "v1": [0.5, 1.5], "R1": 0.05, "R2": 0.05, "material": "steel"}
    result = impact.sweep({"models": ["thornton-1997", "hunt-crossley-1975"], "sweep": sweep})
    figure = impact.plot(result, kind=kind, decimal="comma", width=10.0)
    figure.draw_without_rendering()
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert any("0,2" in text for text in texts)
    assert not [text for text in texts if re.search(r"\d\.\d", text)]


@pytest.mark.parametrize("decimal", ["point", "comma"])
def test_short_names_of_narrow_panels_have_the_parameters(decimal: str) -> None:
    sweep = {"e": [0.25, 0.5], "v1": [0.5, 1.5], "R1": 0.05, "R2": 0.05, "material": "steel"}
    law = {"kuwabara-kono-at-speed": {"ve": 1.5}}
    result = impact.sweep({"models": ["kuwabara-kono-at-speed", "lammps-tsuji"], "sweep": sweep, "model": law})
    figure = impact.plot(result, kind="map", width="84mm", decimal=decimal)
    figure.draw_without_rendering()
    names = [" ".join(text.get_text() for text in axes.findobj(Text)) for axes in figure.axes[:2]]
    assert "kuwabara-kono" in names[0]
    expected = "= 1.5 m/s" if decimal == "point" else "= 1,5 m/s"
    assert expected in re.sub(r"\s", " ", names[0])
    assert "= " not in names[1]
