"""docs/models.md and its pictures are up to date with the catalogue, and have the known numbers."""

from __future__ import annotations

import doctest
import re
import sys
import tomllib
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import impact
from impact.config.tables import expand_laws
from impact.contact.frictions import frictions
from impact.contact.models import catalogue

from .conftest import ROOT, code_blocks

sys.path.insert(0, str(ROOT / "scripts"))
import law_pages
import law_properties
import models_deviations
import models_page
import models_pictures
import models_restitution
import models_tables

PAGE = (ROOT / "docs" / "models.md").read_text(encoding="utf-8")
PICTURES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "models").iterdir()}


@pytest.mark.slow
def test_the_pictures_are_up_to_date() -> None:
    pictures = models_pictures.pictures()
    changed = [name for name, picture in pictures.items() if PICTURES[name] != picture]
    assert not changed, f"out of date in docs/models/: {', '.join(changed)}; run `make docs`"


def test_rows_and_pictures_of_laws_with_a_closed_form_are_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    models = [model for model in models_restitution.distinct_models() if models_restitution.depends_on_e(model)]
    exact = {
        model.key: models_restitution.closed_form_restitution(model, models_restitution.GRID) for model in models
    }
    curves = {
        key: models_restitution.RestitutionCurve("e", e_out, {})
        for key, e_out in exact.items()
        if e_out is not None
    }
    assert len(curves) > 30
    for module in (models_restitution, models_page, models_pictures):
        monkeypatch.setattr(module, "restitution_curves", lambda: curves)
    # those with a closed form of e alone do not depend on the speed
    monkeypatch.setattr(models_page, "speed_dependent", frozenset)
    for key in curves:
        model = catalogue()[key]
        row = " | ".join(models_page.row(model))
        assert f"| {row} |" in PAGE, f"{key} in docs/models.md is out of date: run `make docs`"
        assert models_pictures.picture(model) == PICTURES[f"{key}.svg"], (
            f"{key}.svg is out of date: run `make docs`"
        )


def test_the_source_and_the_parameters_of_every_law_are_up_to_date() -> None:
    cells = {
        key: (models_page.source_cell(model), models_page.parameters_cell(model))
        for key, model in catalogue().items()
    }
    rows = {row.partition('"')[2].partition('"')[0]: row for row in PAGE.splitlines() if row.startswith("| <a id")}
    assert rows.keys() == catalogue().keys()
    assert [key for key, texts in cells.items() if not all(f"| {text} |" in rows[key] for text in texts)] == []


def test_every_law_is_listed_and_has_a_picture() -> None:
    keys = [model.key for model in models_restitution.distinct_models()]
    assert [key for key in keys if f"](models/{key}.svg)" not in PAGE] == []
    assert {f"{key}.svg" for key in keys} == PICTURES.keys()
    assert {model.family for model in catalogue().values()} == models_page.FAMILIES.keys()


@pytest.mark.parametrize("name", PICTURES)
def test_a_picture_has_its_name_as_title_and_its_curve_within_the_frame(name: str) -> None:
    root = ElementTree.fromstring(PICTURES[name])
    svg = {"svg": "http://www.w3.org/2000/svg"}
    assert f"{root.findtext('svg:title', namespaces=svg)}.svg" == name
    (line,) = root.findall("svg:polyline", svg)
    x, y = np.array([point.split(",") for point in line.attrib["points"].split()], dtype=float).T
    margin = models_pictures.MARGIN
    assert x.size > 20
    assert margin <= x.min() <= x.max() == models_pictures.WIDTH - margin
    assert margin <= y.min() <= y.max() <= models_pictures.HEIGHT - margin


@pytest.mark.parametrize(
    "row",
    [
        "| `hunt-crossley-1975` | 0.4877 |",
        "| `lankarani-nikravesh-1990` | 0.6630 |",
        "| `lankarani-nikravesh-1990` | 0.9 ≤ e ≤ 1 (Gharib and Hurmuzlu 2012) | 0.0132 at 0.9 |",
        "| `gharib-hurmuzlu-2012` | 0.5936 |",
        "| `thornton-cummins-cleary-2013` | 0.9846 |",
        "| `lee-wang-1983` | 0.500 | 0.9524 |",
        "| `safaeifar-farshidianfar-2020` | 0.833 | 0.9152 |",
        "| `anagnostopoulos-1988-no-tension` | 0.2527 | 0.5503 | 0.9020 |",
        "| `tsuji-1992-no-tension` | 0.2527 | 0.5503 | 0.9020 |",
    ],
)
def test_the_page_has_the_known_numbers(row: str) -> None:
    assert row in PAGE


def test_the_examples_of_choosing_models_are_valid() -> None:
    choices = re.findall(r"`(models = [^`]*)`", PAGE)
    assert len(choices) == 3
    for choice in choices:
        models, problems = expand_laws(tomllib.loads(choice)["models"], catalogue())
        assert models, choice
        assert not problems, choice


@pytest.mark.slow
def test_errors_of_the_solver_change_no_digit_of_the_page_and_no_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)

    def with_noise(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values + rng.uniform(-1e-10, 1e-10, values.shape)

    exact, curves = models_restitution.closed_form_restitution, models_restitution.restitution_curves()
    noisy_curves = {key: replace(curve, e_out=with_noise(curve.e_out)) for key, curve in curves.items()}
    monkeypatch.setattr(models_deviations, "closed_form_restitution", lambda model, e: with_noise(exact(model, e)))
    for module in (models_deviations, models_page, models_pictures):
        monkeypatch.setattr(module, "restitution_curves", lambda: noisy_curves)
    assert models_page.models_page() == PAGE
    assert models_pictures.pictures() == PICTURES


def test_the_integrated_restitution_agrees_with_the_closed_form() -> None:
    law = catalogue()["flores-2011"]
    e = models_restitution.GRID[::20]
    np.testing.assert_allclose(
        models_restitution.integrated_restitution([law], {law.key: {}}, e=e)[law.key],
        models_restitution.closed_form_restitution(law, e),
        atol=1e-9,
    )


def test_the_examples_of_docstrings() -> None:
    assert all(doctest.testmod(module).failed == 0 for module in (models_page, models_tables))


@pytest.mark.slow
def test_what_the_catalogue_is_filtered_by_follows_from_the_laws() -> None:
    adhesive = {model.key for model in models_restitution.distinct_models() if law_properties.is_adhesive(model)}
    assert adhesive == {"luding-2008", "jkr-1971", "liggghts-edinburgh"}
    # of the laws that other names are used for, under each of them
    codes = [
        {(code.name, key) for code, _, key in law_properties.names_in_codes(catalogue()[name])}
        for name in ("flores-2011", "opensees-hertzdamp")
    ]
    assert codes == [{("opensees", "opensees-hertzdamp")}] * 2


@pytest.mark.slow
def test_the_restitution_depends_on_the_speed_where_a_parameter_has_a_scale() -> None:
    dependent = law_properties.speed_dependent()
    laws = catalogue()
    # a linear dashpot with a constant in SI does not, one with a spring of Hertz does
    assert {"lammps-velocity-hertz", "kuwabara-kono-1987", "jkr-1971", "thornton-1997"} <= dependent
    assert not {"lammps-mass-velocity-hooke", "kelvin-voigt", "flores-2011", "bilinear"} & dependent
    plastic = {key for key, law in laws.items() if law.family in ("elastic-plastic", "adhesive")}
    assert plastic <= dependent | {key for key in plastic if laws[key].same_as}


def test_the_closed_form_of_a_law_is_a_formula_or_a_function() -> None:
    exact, approach = (law_pages.closed_form(catalogue()[key].oracle) for key in ("flores-2011", "kelvin-voigt"))
    assert exact.startswith("`e_out = delivered_restitution(chi)`<br>`delivered_restitution`: ")
    assert approach.startswith("`e_out = ")


@pytest.mark.slow
def test_the_example_of_every_page_of_a_law_runs() -> None:
    pages = law_pages.law_pages()
    assert pages.keys() == {f"models/{key}" for key in catalogue()} | {f"frictions/{key}" for key in frictions()}
    for path, page in pages.items():
        key = path.partition("/")[2]
        assert page.count(f"{{{key},\n") == 1, key
        (example,) = code_blocks(page, "toml")
        result = impact.sweep(tomllib.loads(example))
        laws = {*result["model"].values.flat, *(result["friction"].values.flat if "friction" in result else ())}
        assert key in laws
        outputs = [result[name].values for name in ("e_out", "beta") if name in result]
        assert all(np.isfinite(values).all() for values in outputs), key
