"""What a notebook shows of the objects that the functions return, and its controls."""

from __future__ import annotations

import asyncio
import io
import re
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib import image

import impact
from impact import progress_display
from impact.engine.plugins import Plugins
from impact.errors import UsageError
from impact.plots.explore import COMPUTING, DELAY_S, DPI, WIDTH_INCHES, integrate_at
from impact.results.provenance import stored_config

from .conftest import ROOT, Run

SHOT = {"models": "hunt-crossley-1975", "sweep": {"e": 0.6, "v1": 1.0, "m1": 1.0, "m2": 2.0, "K": 1e6}}


def cells(html: str) -> list[list[str]]:
    """The texts of the cells of a table, row by row."""
    return [re.findall("<t[dh][^>]*>(.*?)</t[dh]>", row) for row in re.findall("<tr>(.*?)</tr>", html)]


def test_an_impact_has_the_rows_of_the_command_line(cli: Run) -> None:
    rows = cells(impact.run(model="hertz", at={"e": 0.5})._repr_html_())
    shown = {row[0]: row[1] for row in rows if len(row) == 3}
    printed = cli("run", "--model", "hertz", "--at", "e=0.5").stdout
    assert "e_energetic" in shown
    for name, text in shown.items():
        line = next(line for line in printed.splitlines() if line.startswith(f"{name} "))
        assert text in line


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


TWO_AXES: dict[str, Any] = {
    "models": ["hertz", "hunt-crossley-1975"],
    "sweep": {"e": [0.2, 0.5, 0.8], "v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "K": 1e6},
}


def controls_of(box: Any) -> tuple[dict[str, Any], Any, Any]:
    """The controls of `impact.explore` by their names, the picture and the message."""
    (columns,) = box.children
    controls, shown = columns.children
    message, picture = shown.children
    # without units and laws
    named = {re.split(r"[, ]", control.description)[0]: control for control in controls.children}
    return {name: control for name, control in named.items() if name}, picture, message


def controls_text(box: Any) -> str:
    """The notes below the controls."""
    return str(box.children[0].children[0].children[-1].value)


def pixels(png: bytes) -> Any:
    return image.imread(io.BytesIO(png))


def drawn(*words: Any, **choice: Any) -> Any:
    """The picture that `impact.plot` draws, of the size of those of `impact.explore`."""
    png = io.BytesIO()
    impact.plot(*words, width=WIDTH_INCHES, **choice).savefig(png, dpi=DPI)
    return pixels(png.getvalue())


@pytest.mark.slow
def test_controls_draw_what_they_select() -> None:
    result = impact.sweep(TWO_AXES)
    controls, picture, message = controls_of(impact.explore(result))
    assert list(controls) == ["kind", "models", "x", "y", "e", "m2"]
    assert controls["kind"].value == "final-velocities"
    assert bytes(picture.value).startswith(b"\x89PNG")
    # an axis that is drawn has no value to select, and a picture over one axis has no second one
    assert [name for name, control in controls.items() if control.disabled] == ["y", "e"]
    seen = {bytes(picture.value)}
    changes = [("m2", 2.0), ("x", "m2"), ("kind", "loop"), ("e", 0.8), ("models", ("hertz",))]
    for name, value in (*changes, ("kind", "error"), ("x", "e")):
        controls[name].value = value
        assert message.value == "", name
        assert bytes(picture.value) not in seen, name
        seen.add(bytes(picture.value))
    expected = drawn(result, kind="error", x="e", sel={"m2": 2.0}, models=["hertz"])
    assert np.array_equal(pixels(picture.value), expected)
    controls["kind"].value = "map"
    assert [name for name, control in controls.items() if control.disabled] == ["e", "m2"]


@pytest.mark.slow
def test_controls_explain_what_cannot_be_drawn() -> None:
    controls, picture, message = controls_of(impact.explore(impact.sweep(TWO_AXES)))
    before = bytes(picture.value)
    controls["kind"].value = "map"
    controls["x"].value = controls["y"].value
    assert "needs two axes" in message.value
    controls["kind"].value = "restitution"
    assert (message.value, bytes(picture.value) == before) == ("", False)


ALONG_E = {"e": [0.2, 0.5, 0.8], "v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "K": 1e6}
MATERIALS = {"material1": ["steel", "aluminium"], "material2": "steel"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("config", "name", "value"),
    [
        ({"sweep": ALONG_E}, "m2", 1.25),
        ({"sweep": {**ALONG_E, "v1": {"geomspace": [0.01, 10.0, 4]}}}, "v1", 0.0234),
        ({"sweep": {name: value for name, value in {**ALONG_E, **MATERIALS}.items() if name != "K"}}, "m2", 1.25),
        ({"sweep": ALONG_E, "model": {"tsuji-1992": {"K": [1e5, 1e6]}}}, "tsuji-1992.K", 345678.0),
    ],
)
def test_a_number_off_the_grid_gives_what_a_run_gives(config: dict[str, Any], name: str, value: float) -> None:
    config["models"] = ["hertz", "hunt-crossley-1975", "tsuji-1992"]
    result = impact.sweep(config)
    controls, picture, message = controls_of(impact.explore(result, kind="restitution"))
    controls[name.rpartition(".")[2]].value = value
    assert message.value == f"{name} = {value:.6g}: between values of the grid, integrated again"
    controls["models"].value = ["hertz"]
    assert message.value.startswith(name)
    controls["models"].value = config["models"]
    stored = stored_config(result.attrs, (), Plugins(), "result")
    again = integrate_at(result, stored, {name: value}, Plugins())
    assert np.array_equal(pixels(picture.value), drawn(again, kind="restitution"))
    for model in config["models"]:
        at = {name: value} if name in ALONG_E or name.startswith(model) else {}
        shot = impact.run(config, model=model, at={**at, "e": 0.5})
        first = {dim: 0 for dim in again.sizes if dim not in ("model", "e", name)}
        e_out = again["e_out"].isel(first).sel({"model": model, "e": 0.5, name: value}).item()
        assert e_out == pytest.approx(shot.values["e_out"], rel=1e-12)


@pytest.mark.slow
def test_controls_begin_with_what_is_given(tmp_path: Path) -> None:
    result = impact.sweep(TWO_AXES)
    impact.save(result, tmp_path / "r.h5")
    shown = impact.explore(tmp_path / "r.h5", kind="error", sel={"m2": "1500 g"}, models=["hertz"])
    controls, _, _ = controls_of(shown)
    assert [controls[name].value for name in ("kind", "m2", "models")] == ["error", 1.5, ("hertz",)]
    # of any library, as the selection of a picture
    for mass in (np.array(1.5), xr.DataArray(1.5), Fraction(3, 2)):
        assert controls_of(impact.explore(result, sel={"m2": mass}))[0]["m2"].value == 1.5
    for choice, expected in (
        ({"kind": "eror"}, 'kind: no kind "eror" of this result; did you mean "error"'),
        ({"sel": {"m1": 1.0}}, 'sel: no axis "m1" to select along; known: e, m2'),
        ({"sel": {"m2": 3.0}}, "no m2 = 3.0 in this result; m2 is 1, 2"),
        ({"models": ["herz"]}, 'no model "herz" in this result; did you mean "hertz"'),
    ):
        with pytest.raises(UsageError, match=re.escape(expected)):
            impact.explore(result, **choice)


@pytest.mark.slow
def test_inputs_that_vary_together_keep_to_the_grid() -> None:
    sweep = {**ALONG_E, "m1": [1.0, 2.0], "m2": [1.0, 3.0], "zip": [["m1", "m2"]], "v1": [1.0, 2.0]}
    box = impact.explore(impact.sweep({"models": ["hertz", "hunt-crossley-1975"], "sweep": sweep}))
    controls, picture, message = controls_of(box)
    assert [text for text, _ in controls["m1"].options] == ["1 kg", "2 kg"]
    assert "m1 keeps to the grid: m1, m2 vary together." in controls_text(box)
    before = bytes(picture.value)
    controls["m1"].value = 2.0
    controls["v1"].value = 1.5
    assert message.value.startswith("v1 = 1.5: ")
    assert bytes(picture.value) != before
    walls = impact.sweep({**TWO_AXES, "sweep": {**TWO_AXES["sweep"], "m2": [1.0, float("inf")]}})
    assert "m2 keeps to the grid: it has an infinite value." in controls_text(impact.explore(walls))
    result = impact.sweep(TWO_AXES)
    both = xr.concat([result, walls.isel(m2=[1])], "m2", coords="minimal", compat="override", join="outer")
    assert "e keeps to the grid: the axes of the result are not those" in controls_text(impact.explore(both))
    unnamed = impact.sweep(TWO_AXES)
    del unnamed.attrs["config"]
    assert "e keeps to the grid: the result: contains no config" in controls_text(impact.explore(unnamed))


@pytest.mark.slow
def test_changes_that_arrive_together_are_drawn_once() -> None:
    async def change_all() -> None:
        for value in (1.25, 1.5, 1.75):
            controls["m2"].value = value
            assert message.value == COMPUTING
            await asyncio.sleep(0.01)
        await asyncio.sleep(10.0 * DELAY_S)

    controls, picture, message = controls_of(impact.explore(impact.sweep(TWO_AXES)))
    pictures: list[bytes] = []
    picture.observe(lambda change: pictures.append(change["new"]), names="value")
    asyncio.run(change_all())
    assert len(pictures) == 1
    assert message.value.startswith("m2 = 1.75: ")


UNCERTAIN = {
    "models": ["hertz", "tsuji-1992"],
    "design": {"n": 16},
    "sweep": {"e": 0.5, "v1": {"normal": [1.0, 0.05]}, "m1": 1.0, "m2": [1.0, 2.0], "K": 1e6},
}


DROPS = ROOT / "docs" / "calibrate" / "drops.toml"
COARSE = ['models="anagnostopoulos-1988"', "solver.rtol=1e-4"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("dataset", "kind", "axes"),
    [
        (lambda: impact.sweep(UNCERTAIN), "uncertainty", ["m2"]),
        (lambda: impact.sweep(UNCERTAIN, overrides=["sweep.m2=1.0"]), "uncertainty", []),
        (lambda: impact.sensitivity(UNCERTAIN, of="peak_force"), "sensitivity", []),
        (lambda: impact.calibrate(DROPS, overrides=COARSE), "calibration", []),
    ],
)
def test_a_study_begins_with_its_own_picture(
    dataset: Callable[[], xr.Dataset], kind: str, axes: list[str]
) -> None:
    controls, picture, message = controls_of(impact.explore(dataset()))
    assert (controls["kind"].value, message.value) == (kind, "")
    assert bytes(picture.value).startswith(b"\x89PNG")
    assert list(controls) == ["kind", "models", "x", "y", *axes]


@pytest.mark.slow
def test_a_result_over_words_alone_has_controls() -> None:
    glass, steel = {"E": 7e10, "nu": 0.25, "rho": 2500.0}, {"E": 2.1e11, "nu": 0.3, "rho": 7850.0}
    inputs = {"v1": 1.0, "material1": ["glass", "steel"], "material2": "steel", "R1": 0.01, "R2": 0.01}
    result = impact.sweep({"models": ["hertz"], "sweep": inputs, "materials": {"glass": glass, "steel": steel}})
    controls, picture, message = controls_of(impact.explore(result, kind="loop"))
    assert message.value == ""
    assert controls["x"].value == "material1"
    first = picture.value
    controls["material1"].value = "steel"
    assert picture.value != first
    controls["kind"].value = "final-velocities"
    assert message.value.startswith("cannot draw over")


def test_a_history_has_no_controls() -> None:
    history = impact.run(SHOT).history
    with pytest.raises(UsageError, match=r"impact\.plot draws a time history"):
        impact.explore(history)


@pytest.mark.slow
def test_a_sweep_shows_its_progress_on_request(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress_display, "FIRST_S", 0.0)
    config = {
        **TWO_AXES,
        "sweep": {**TWO_AXES["sweep"], "K": {"linspace": [1e6, 2e6, 3000]}},
        "solver": {"collapse": False},
    }
    impact.sweep(config, progress=True)
    assert re.search(r"^trajectories [\d,]+ of 36,000 for 36,000 points", capfd.readouterr().err, re.MULTILINE)
    impact.sweep(config)
    assert capfd.readouterr().err == ""


def test_controls_name_the_extra_that_they_need(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(UsageError, match=r"needs ipywidgets; pip install \"impact-sweep\[notebook\]\""):
        impact.explore(impact.sweep(SHOT))
