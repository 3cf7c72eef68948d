"""`impact page`: a result in a browser, whose values are those of the program."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.errors import UsageError
from impact.results.xarray_backend import open_result

from .conftest import ROOT, Run
from .test_explore_in_jupyterlab import Page, open_browser

REPORTING = ROOT / "src" / "impact" / "reporting"
STEEL = {"E": 210e9, "nu": 0.3, "rho": 7850}
SOFT = {"E": 2e9, "nu": 0.4, "rho": 1100}
# a table with axes of each kind, with a wall, balls that miss each other, a law with a parameter that varies
TABLE: dict[str, Any] = {
    "title": "Table </script><b>",
    "models": ["gharib-hurmuzlu-2012", "kuwabara-kono-1987", "bilinear", "tsuji-1992"],
    "sweep": {
        "e": {"linspace": [0.05, 1.0, 11]},
        "v1": {"geomspace": [0.1, 10.0, 5]},
        "v2": [-0.5, 0.0, 2.0],
        "m2": [1.0, 3.0, math.inf],
        "m1": 1.0,
        "R1": 0.02,
        "R2": [0.02, 0.05],
        "material1": "steel",
        "material2": ["steel", "soft"],
    },
    "materials": {"steel": STEEL, "soft": SOFT},
    "model": {"kuwabara-kono-1987": {"A": [1e-6, 1e-5]}},
    "output": {"layout": "factored"},
}
OUTPUTS = ("e_out", "e_error", "v1_post", "v2_post", "v1_error", "v2_error", "peak_force", "contact_time")


@pytest.fixture(scope="module")
def table_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep as a file of its trajectory table."""
    path = tmp_path_factory.mktemp("page") / "table.h5"
    impact.sweep_to_file(TABLE, path)
    return path


@pytest.fixture(scope="module")
def results(table_file: Path) -> dict[str, xr.Dataset]:
    """The values of that file, a part of them, and the same sweep with all values."""
    table = impact.load(table_file)
    return {"table": table, "part": table.isel(v2=1, e=slice(0, 4)), "full": impact.sweep(TABLE)}


def content_of(text: str) -> dict[str, Any]:
    """The data of a page."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    content: dict[str, Any] = json.loads(found[1])
    return content


@pytest.mark.slow
def test_a_page_has_no_law_no_network_and_texts_that_do_not_end_its_script(
    table_file: Path, results: dict[str, xr.Dataset]
) -> None:
    text = impact.page(table_file)
    content = content_of(text)
    assert content["title"] == "Table </script><b>"
    assert text.count("</script>") == 2
    assert "default-src 'none'" in text
    # a style sheet knows no entities of HTML
    assert "&" not in text.partition("<style>")[2].partition("</style>")[0]
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text)
    # trajectories, not points: e and the ratio of A to the contact time vary
    assert len(content["laws"][0]["columns"]["e_out"]["base64"]) < 200
    assert results["table"]["e_out"].size > 10_000
    assert len(text) < 100_000


def test_errors_of_a_result_of_32_bits_are_those_that_it_stores() -> None:
    sweep = {"e": np.linspace(0.1, 0.9, 5), "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    result = impact.sweep({"models": "exact-hysteresis", "sweep": sweep, "output": {"dtype": "float32"}})
    column = content_of(impact.page(result))["laws"][0]["columns"]["e_out"]
    e_out = np.frombuffer(base64.b64decode(column["base64"]), column["type"])
    np.testing.assert_allclose(e_out - sweep["e"], result["e_error"].values[0], atol=1e-15)
    np.testing.assert_allclose(e_out, result["e_out"].values[0], rtol=1e-7)


def test_a_title_of_several_lines_is_one_comment_of_the_csv() -> None:
    sweep = {"e": [0.5, 0.6], "m1": 1.0, "m2": 1.0, "K": 1e9, "v1": 1.0}
    result = impact.sweep({"title": "Drops\nof a ball", "models": "hertz", "sweep": sweep})
    assert content_of(impact.page(result))["title"] == "Drops of a ball"


def test_a_page_of_arrays_of_dask_is_that_of_their_values() -> None:
    pytest.importorskip("dask")
    result = impact.load(ROOT / "tests" / "data" / "figure6.h5")
    assert impact.page(result.chunk()) == impact.page(result)


def test_the_script_and_the_template_are_short() -> None:
    lines = [
        len((REPORTING / name).read_text(encoding="utf-8").splitlines()) for name in ("page.js", "page.html.j2")
    ]
    assert sum(lines) < 400


@pytest.mark.slow
def test_a_dataset_of_the_user_stays_open(results: dict[str, xr.Dataset], tmp_path: Path) -> None:
    impact.save(results["part"], tmp_path / "part.h5")
    # what `impact.load` returns of a large file
    with open_result(tmp_path / "part.h5") as dataset:
        impact.page(dataset)
        assert dataset["energy_loss"].equals(results["part"]["energy_loss"])


def test_the_conditions_are_those_of_the_laws_that_are_shown(
    table_file: Path, results: dict[str, xr.Dataset]
) -> None:
    for result in (table_file, results["full"]):
        assert "(1\N{NO-BREAK SPACE}for\N{NO-BREAK SPACE}bilinear)" in impact.page(result)
        assert "bilinear" not in impact.page(result, models=["tsuji-1992"])


def test_inputs_that_vary_together_are_named_beside_their_slider() -> None:
    sweep = {"e": [0.5, 0.6], "m1": [1.0, 2.0], "m2": [1.0, math.inf], "zip": [["m1", "m2"]], "K": 1e9, "v1": 1.0}
    _, axis = content_of(impact.page(impact.sweep({"models": "hertz", "sweep": sweep})))["axes"]
    assert axis["texts"] == ["1 kg, m2 = 1 kg", "2 kg, m2 = ∞"]


@pytest.mark.parametrize(("viscosity", "label"), [("1 us", ", A = 1 µs"), (["1 us", "2 us"], "")])
def test_laws_and_sliders_have_values_with_prefixes(viscosity: object, label: str) -> None:
    config = {
        "models": ["hertz", "kuwabara-kono-1987"],
        "model": {"kuwabara-kono-1987": {"A": viscosity}},
        "sweep": {"e": 0.5, "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 1e9},
    }
    content = content_of(impact.page(impact.sweep(config)))
    labels = [law["label"].replace("\xa0", " ") for law in content["laws"]]
    assert labels == ["Hertz (1882)", f"Kuwabara and Kono (1987){label}"]
    assert [axis["texts"] for axis in content["axes"][1:]] == ([] if label else [["1 µs", "2 µs"]])


@pytest.mark.slow
def test_the_command_writes_a_page(results: dict[str, xr.Dataset], cli: Run, tmp_path: Path) -> None:
    impact.save(results["part"], tmp_path / "part.h5")
    done = cli("page", "part.h5", "--model", "bilinear", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"part\.html: \d+ kB\n", done.stderr)
    text = (tmp_path / "part.html").read_text(encoding="utf-8")
    assert [law["key"] for law in content_of(text)["laws"]] == ["bilinear"]
    again = cli("page", "part.h5", cwd=tmp_path)
    assert (again.returncode, "part.html" in again.stderr) == (2, True)


def test_what_a_page_cannot_show_is_refused_in_one_line(results: dict[str, xr.Dataset], tmp_path: Path) -> None:
    large = {**TABLE, "models": "hertz", "output": {}}
    large["sweep"] = {
        "e": 0.5,
        "v1": {"linspace": [1, 2, 700]},
        "m2": {"linspace": [1, 2, 700]},
        "m1": 1.0,
        "K": 1e9,
    }
    cases = {
        "over an axis; impact report takes other results, but no time history": impact.run().history,
        "take more than 10 MB; take a part first, by models or impact expand": impact.sweep(large),
        'no model "hertz" in this result': results["table"],
    }
    for problem, dataset in cases.items():
        models = ["hertz"] if "no model" in problem else None
        with pytest.raises(UsageError, match=re.escape(problem)):
            impact.page(dataset, models=models)
    with pytest.raises(UsageError, match=r"page\.txt: expected a name that ends in \.html"):
        impact.page(results["table"], output=tmp_path / "page.txt")


@pytest.fixture(scope="module")
def browser(chromium: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A page of a browser."""
    with open_browser(chromium, tmp_path_factory.mktemp("profile")) as page:
        page.call("Page.enable")
        yield page


def show(browser: Page, result: xr.Dataset | Path, path: Path) -> None:
    """Open the page of a result."""
    impact.page(result, output=path, overwrite=True)
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=path.as_uri())
    browser.wait_for("document.readyState == 'complete' && document.querySelectorAll('#values tr').length > 0")


def choose(browser: Page, control: str, value: object) -> None:
    """Set a control, as a user does."""
    browser.evaluate(
        f"(c => {{ c.value = {json.dumps(str(value))}; c.dispatchEvent(new Event('input', {{bubbles: true}}));"
        f" c.dispatchEvent(new Event('change', {{bubbles: true}})); }})(document.getElementById('{control}'))"
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["table", "part", "full"])
def test_values_at_points_of_the_grid_are_those_of_the_program(
    table_file: Path, results: dict[str, xr.Dataset], browser: Page, tmp_path: Path, name: str
) -> None:
    dataset = results[name]
    show(browser, table_file if name == "table" else dataset, tmp_path / "page.html")
    axes = [axis["name"] for axis in content_of((tmp_path / "page.html").read_text(encoding="utf-8"))["axes"]]
    generator = np.random.default_rng(1)
    at = np.stack([generator.integers(dataset.sizes[axis], size=200) for axis in axes], axis=1)
    laws = generator.integers(dataset.sizes["model"], size=200)
    for output in OUTPUTS:
        expression = (
            f"{json.dumps(at.tolist())}.map((cell, number) => "
            f"String(value('{output}', laws[{json.dumps(laws.tolist())}[number]], cell)))"
        )
        theirs = np.array([float(text.replace("Infinity", "inf")) for text in browser.evaluate(expression)])
        places = {axis: xr.DataArray(at[:, number], dims="cell") for number, axis in enumerate(axes)}
        ours = (
            dataset[output]
            .isel({**places, "model": xr.DataArray(laws, dims="cell")}, missing_dims="ignore")
            .values
        )
        assert np.isfinite(ours).sum() > 50
        # rounding of a difference of velocities up to 13 m/s
        atol = 0.0 if output in ("peak_force", "contact_time") else 1e-14
        np.testing.assert_allclose(theirs, ours, rtol=2e-14, atol=atol, err_msg=output)


@pytest.mark.slow
def test_balls_that_miss_each_other_have_an_answer_and_two_walls_have_none(browser: Page, tmp_path: Path) -> None:
    """Also where e = 1 - alpha v0 is above 1, and where the trajectory of a cell has an answer."""
    sweep = {"alpha": 0.2, "v1": [-1.0, 1.0], "m1": [1.0, math.inf], "m2": [2.0, math.inf], "K": 1e9}
    config = {"models": "gharib-hurmuzlu-2012", "sweep": sweep, "output": {"layout": "factored"}}
    impact.sweep_to_file(config, tmp_path / "table.h5")
    result = impact.load(tmp_path / "table.h5")
    assert np.bincount(result["status"].values.ravel())[[1, 2, 15]].tolist() == [3, 4, 1]
    show(browser, tmp_path / "table.h5", tmp_path / "page.html")
    cells = list(np.ndindex(2, 2, 2))
    for output in OUTPUTS:
        expression = f"{json.dumps(cells)}.map(cell => String(value('{output}', laws[0], cell)))"
        theirs = np.array([float(text) for text in browser.evaluate(expression)])
        ours = result[output].transpose("model", "v1", "m1", "m2").values.ravel()
        np.testing.assert_allclose(theirs, ours, rtol=2e-14, atol=1e-14, err_msg=output)


OF_PAIRS = ("beta", "e_t", "rebound_angle", "impulse_ratio", "u1_post", "u2_post", "omega1_post", "omega2_post")
OBLIQUE: dict[str, Any] = {
    "models": ["tsuji-1992", "hertz"],
    "frictions": ["coulomb-1785", "lammps-mindlin"],
    "sweep": {
        "e": 0.7,
        "speed": 1.5,
        "angle": ["5 deg", "40 deg", "80 deg"],
        "mu": [0.1, 0.4],
        "omega1": ["0 rad/s", "30 rad/s"],
        "m1": 0.1,
        "R1": 0.02,
        "m2": [0.1, math.inf],
        "K": 1e8,
    },
    "friction": {"lammps-mindlin": {"kt_over_kn": 0.8, "xt": 0.5}},
}


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_pairs_of_a_page_have_the_values_of_the_result(layout: str, tmp_path: Path) -> None:
    impact.sweep_to_file({**OBLIQUE, "output": {"layout": layout}}, tmp_path / "oblique.h5")
    result = impact.load(tmp_path / "oblique.h5")
    content = content_of(impact.page(tmp_path / "oblique.h5"))
    axes = [axis["name"] for axis in content["axes"]]
    pairs = [law for law in content["laws"] if law["is_pair"]]
    names = [f"{model} with {friction}" for model in OBLIQUE["models"] for friction in OBLIQUE["frictions"]]
    assert [law["key"] for law in pairs] == names
    assert [law["key"] for law in content["laws"] if not law["is_pair"]] == OBLIQUE["models"]
    assert [output["name"] for output in content["outputs"] if output["of_friction"]] == [*OF_PAIRS]
    for pair in pairs:
        model, friction = pair["key"].split(" with ")
        for name, column in pair["columns"].items():
            expected = result[name].sel(model=model, friction=friction).transpose(*axes, missing_dims="ignore")
            assert [axes[number] for number in column["axes"]] == [*expected.dims]
            values = np.frombuffer(base64.b64decode(column["base64"]), column["type"])
            unit = np.degrees(1.0) if name == "rebound_angle" else 1.0
            np.testing.assert_allclose(values, expected.values.ravel() * unit, rtol=1e-15, err_msg=name)


def test_a_page_of_a_selected_friction_law_has_its_pairs(tmp_path: Path) -> None:
    result = impact.sweep(OBLIQUE)
    impact.save(result.sel(friction="lammps-mindlin"), tmp_path / "mindlin.h5")
    content = content_of(impact.page(tmp_path / "mindlin.h5"))
    pairs = [law for law in content["laws"] if law["is_pair"]]
    assert [pair["key"] for pair in pairs] == [f"{model} with lammps-mindlin" for model in OBLIQUE["models"]]
    list_page = content_of(impact.page(result.sel(friction=["lammps-mindlin"])))
    assert [pair["columns"] for pair in pairs] == [law["columns"] for law in list_page["laws"] if law["is_pair"]]


def test_a_friction_law_without_its_name_has_no_pairs() -> None:
    result = impact.sweep(OBLIQUE).isel(friction=0, drop=True)
    content = content_of(impact.page(result))
    assert [law["key"] for law in content["laws"]] == OBLIQUE["models"]
    assert [output["name"] for output in content["outputs"]] == [*OUTPUTS]
    assert "tsuji-1992" in impact.report(result, sections=["answer"])


def test_a_result_without_outputs_of_friction_has_a_page_of_its_models() -> None:
    result = impact.sweep({**OBLIQUE, "output": {"variables": ["e_out"]}})
    content = content_of(impact.page(result))
    assert [law["key"] for law in content["laws"]] == OBLIQUE["models"]
    assert [output["name"] for output in content["outputs"]] == ["e_out"]


@pytest.mark.parametrize("layout", ["full", "factored"])
def test_a_page_of_a_result_without_outputs_of_its_models_is_refused(layout: str, tmp_path: Path) -> None:
    impact.sweep_to_file({**OBLIQUE, "output": {"layout": layout, "variables": ["beta"]}}, tmp_path / "beta.h5")
    with pytest.raises(UsageError, match="e_out is not in this result"):
        impact.page(tmp_path / "beta.h5")


@pytest.mark.slow
def test_pairs_are_drawn_where_friction_has_a_meaning(browser: Page, tmp_path: Path) -> None:
    result = impact.sweep(OBLIQUE)
    show(browser, result, tmp_path / "page.html")
    visible = "laws.filter(law => !byId(`law-${law.key}`).parentNode.hidden).map(law => law.key)"
    assert browser.evaluate(visible) == OBLIQUE["models"]
    browser.evaluate("document.getElementById('law-hertz').click()")
    choose(browser, "variable", "beta")
    assert [key.split(" with ")[1] for key in browser.evaluate(visible)] == 2 * OBLIQUE["frictions"]
    # there is no reference, and a model that is left out has its pairs
    assert len(browser.evaluate("curves()")) == 4
    choose(browser, "variable", "rebound_angle")
    part = result["rebound_angle"].isel(mu=0, omega1=0, m2=0).sel(model="hertz", friction="lammps-mindlin")
    columns = [line.split(",") for line in browser.evaluate("csv()").splitlines() if not line.startswith("#")]
    number = columns[0].index('"rebound_angle of hertz with lammps-mindlin [°]"')
    degrees = [float(row[number]) for row in columns[1:]]
    np.testing.assert_allclose(degrees, np.degrees(part.values), rtol=1e-15)
    # as in pictures, without a prefix
    assert browser.evaluate("scale('rad/s', 2000)") == [1, "rad/s"]
    choose(browser, "variable", "e_out")
    assert browser.evaluate(visible) == OBLIQUE["models"]
    assert len(browser.evaluate("curves()")) == 2


@pytest.mark.slow
def test_sliders_laws_the_cursor_and_the_numbers_follow_the_controls(
    results: dict[str, xr.Dataset], browser: Page, tmp_path: Path
) -> None:
    dataset = results["table"]
    show(browser, dataset, tmp_path / "page.html")
    rows = "[...document.querySelectorAll('#values tr')].map(row => row.innerText.split('\\t'))"
    assert browser.evaluate(rows)[0][0] == "Impulse-momentum"
    assert len(browser.evaluate(rows)) == 5
    browser.evaluate("document.getElementById('law-bilinear').click()")
    assert len(browser.evaluate(rows)) == 4
    # the slider of the axis that is drawn is hidden, and comes back
    hidden = (
        "page.axes.filter((axis, i) => document.getElementById(`axis-${i}`).parentNode.hidden).map(a => a.name)"
    )
    assert browser.evaluate(hidden) == ["e"]
    names = browser.evaluate("page.axes.map(axis => axis.name)")
    choose(browser, "x", names.index("v1"))
    assert browser.evaluate(hidden) == ["v1"]
    choose(browser, "variable", "peak_force")
    choose(browser, f"axis-{names.index('e')}", 4)
    choose(browser, f"axis-{names.index('v2')}", 1)
    choose(browser, f"axis-{names.index('material2')}", 1)
    text = browser.evaluate("csv()")
    head = [line for line in text.splitlines() if line.startswith("#")]
    assert {"# e = 0.43", "# v2 = 0 m/s", "# material2 = soft"} <= set(head)
    numbers = np.array([line.split(",") for line in text.splitlines()[len(head) + 1 :]], float)
    part = dataset["peak_force"].isel(e=4, v2=1, m2=0, R2=0, material2=1, missing_dims="ignore")
    part = part.isel({"kuwabara-kono-1987.A": 0})
    np.testing.assert_array_equal(numbers[:, 0], dataset["v1"].values)
    np.testing.assert_allclose(numbers[:, 1], part.sel(model="gharib-hurmuzlu-2012").values, rtol=2e-14)
    # between two values of the grid
    browser.evaluate("state.cursor = 0.2; list()")
    assert "interpolated" in browser.evaluate("document.getElementById('note').textContent")
    assert browser.evaluate(rows)[0][1].startswith("≈ ")
    browser.evaluate(
        "document.getElementById('picture').dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight'}))"
    )
    assert "interpolated" not in browser.evaluate("document.getElementById('note').textContent")


# of each curve to the paper, by the definition of WCAG
@pytest.mark.slow
def test_errors_of_the_solver_make_no_curve_and_angles_are_in_degrees(browser: Page, tmp_path: Path) -> None:
    inputs = {"speed": 2.0, "angle": ["10 deg", "30 deg", "50 deg"], "e": 0.8, "mu": 0.2, "m1": 1.0, "R1": 0.1}
    result = impact.sweep(
        {"models": "tsuji-1992", "frictions": "coulomb-1785", "sweep": {**inputs, "m2": math.inf, "K": 1e6}}
    )
    assert 0.0 < abs(result["e_error"]).max() < 1e-9
    show(browser, result, tmp_path / "page.html")
    heights = browser.evaluate(
        "[...document.querySelectorAll('svg .curve')].flatMap("
        "curve => curve.getAttribute('d').match(/[0-9.]+ [0-9.]+/g).map(point => +point.split(' ')[1]))"
    )
    assert max(heights) - min(heights) < 0.1
    assert browser.evaluate("document.getElementById('note').textContent") == "at angle = 30°"


@pytest.mark.slow
def test_the_unit_of_a_horizontal_axis_has_the_prefix_that_its_slider_has(browser: Page, tmp_path: Path) -> None:
    soft = {**SOFT, "rho": [1000.0, 2000.0, 7000.0]}
    sweep = {"e": 0.5, "v1": 1.0, "m1": [0.01, 0.02, 0.05], "R1": 0.01, "R2": 0.02, "material": "soft"}
    result = impact.sweep({"models": "hertz", "sweep": sweep, "materials": {"soft": soft}})
    show(browser, result, tmp_path / "page.html")
    for number, text in enumerate(["m1 = 20 g", "rho, soft = 2000 kg/m^3"]):
        choose(browser, "x", number)
        assert browser.evaluate("document.getElementById('note').textContent") == f"at {text}"


@pytest.mark.slow
def test_a_page_goes_from_case_to_case_and_names_their_inputs(browser: Page, tmp_path: Path) -> None:
    cases = tmp_path / "cases.csv"
    cases.write_text("v1,e\n1.0,0.5\n2.0,0.7\n0.5,0.9\n", encoding="utf-8")
    sweep = {"cases": str(cases), "m1": 1.0, "m2": 1.0, "K": 1e6}
    show(browser, impact.sweep({"models": "tsuji-1992", "sweep": sweep}), tmp_path / "page.html")
    browser.evaluate(
        "(c => point({clientX: c.left + picture.left + 0.35 * (picture.right - picture.left)}))"
        "(byId('picture').getBoundingClientRect())"
    )
    note = browser.evaluate("byId('note').textContent")
    assert note == "at case = 1, v1 = 2 m/s, e = 0.7"
    assert '"1, v1 = 2 m/s, e = 0.7",' in browser.evaluate("csv()")
    texts = browser.evaluate("[...document.querySelectorAll('svg text')].map(text => text.textContent)")
    assert {"0", "1", "2"} <= {*texts}
    # a name may have a comma
    glass = {"E": 70e9, "nu": 0.2, "rho": 2500.0}
    sweep = {
        "material1": ["glass, hard", "glass, soft"],
        "material2": "glass, hard",
        "R1": 0.01,
        "R2": 0.01,
        "v1": 1.0,
    }
    materials = {"glass, hard": glass, "glass, soft": {**glass, "E": 10e9}}
    named = impact.sweep({"models": "tsuji-1992", "sweep": {**sweep, "e": 0.8}, "materials": materials})
    show(browser, named, tmp_path / "page.html")
    texts = browser.evaluate("[...document.querySelectorAll('svg text')].map(text => text.textContent)")
    assert {*materials} <= {*texts}


@pytest.mark.slow
def test_the_name_of_an_output_stands_beside_numbers_of_many_digits(browser: Page, tmp_path: Path) -> None:
    sweep = {"e": 0.8, "v1": [1.0, 2.0, 3.0], "m1": 1.0, "m2": 1.0, "K": 1e9}
    show(browser, impact.sweep({"models": "lammps-tsuji", "sweep": sweep}), tmp_path / "page.html")
    texts = "[...document.querySelectorAll('svg text')]"
    numbers = f"{texts}.filter(text => text.getAttribute('text-anchor') === 'end')"
    assert "0.7996" in browser.evaluate(f"{numbers}.map(text => text.textContent)")
    left = browser.evaluate(f"Math.min(...{numbers}.map(text => text.getBoundingClientRect().left))")
    name = browser.evaluate(f"{texts}.find(text => text.getAttribute('transform')).getBoundingClientRect().right")
    assert name < left


CONTRASTS = """
(() => {
  const context = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  const luminance = colour => {
    context.fillStyle = colour;
    context.fillRect(0, 0, 1, 1);
    const [r, g, b] = [...context.getImageData(0, 0, 1, 1).data].map(
      level => level / 255 <= 0.04045 ? level / 255 / 12.92 : ((level / 255 + 0.055) / 1.055) ** 2.4
    );
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const paper = luminance(getComputedStyle(document.body).backgroundColor);
  return [...document.querySelectorAll('svg .curve')].map(curve => {
    const [low, high] = [luminance(getComputedStyle(curve).stroke), paper].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  });
})()
"""


@pytest.mark.slow
@pytest.mark.parametrize("width", [400, 1280, 1600])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_page_fits_its_window(
    results: dict[str, xr.Dataset], browser: Page, tmp_path: Path, width: int, scheme: str
) -> None:
    browser.resize(width, 900)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    show(browser, results["table"], tmp_path / "page.html")
    for output in ("e_out", "contact_time"):
        choose(browser, "variable", output)
        page = browser.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
        assert page <= 0
        outside = browser.evaluate(
            "(picture => [...document.querySelectorAll('svg text')].map(text => text.getBoundingClientRect())"
            ".filter(box => box.left < picture.left - 1 || box.right > picture.right + 1).length)"
            "(document.getElementById('picture').getBoundingClientRect())"
        )
        assert outside == 0
    colours = "(style => [style.color, style.backgroundColor])(getComputedStyle(document.body))"
    ink, paper = (sum(map(int, re.findall(r"\d+", colour))) for colour in browser.evaluate(colours))
    assert (ink < paper) == (scheme == "light")
    # curves are legible on either paper, as parts of pictures have to be
    contrasts = browser.evaluate(CONTRASTS)
    assert min(contrasts) >= (3.0 if scheme == "dark" else 2.0)
    browser.screenshot(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 10_000
