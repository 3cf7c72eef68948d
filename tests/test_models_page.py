"""docs/models.md and its pictures are what the catalogue says today, and say what is so."""

from __future__ import annotations

import doctest
import re
import sys
import tomllib
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from impact.config.tables import expand_models
from impact.contact.models import catalogue

from .conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
import models_deviations
import models_page
import models_pictures
import models_restitution
import models_tables

PAGE = (ROOT / "docs" / "models.md").read_text(encoding="utf-8")
PICTURES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs" / "models").iterdir()}


def test_the_page_is_fresh() -> None:
    assert models_page.models_page() == PAGE, "docs/models.md is stale: run `make docs`"


def test_the_pictures_are_fresh_and_none_is_left_over() -> None:
    fresh = models_pictures.pictures()
    assert fresh.keys() == PICTURES.keys(), "docs/models/ has pictures too many or too few: run `make docs`"
    stale = [name for name, picture in fresh.items() if PICTURES[name] != picture]
    assert not stale, f"stale in docs/models/: {', '.join(stale)}; run `make docs`"


def test_every_law_has_a_place() -> None:
    assert [key for key in catalogue() if f"- `{key}`, " not in PAGE] == []
    own = [key for key, model in catalogue().items() if not model.same_as]
    assert [key for key in own if f"](models/{key}.svg)" not in PAGE] == []
    assert {model.family for model in catalogue().values()} == models_page.FAMILIES.keys()


@pytest.mark.parametrize("name", PICTURES)
def test_pictures_are_named_and_stay_in_their_frame(name: str) -> None:
    root = ElementTree.fromstring(PICTURES[name])
    svg = {"svg": "http://www.w3.org/2000/svg"}
    assert f"{root.findtext('svg:title', namespaces=svg)}.svg" == name
    (line,) = root.findall("svg:polyline", svg)
    across, down = np.array([point.split(",") for point in line.attrib["points"].split()], dtype=float).T
    near = models_pictures.MARGIN
    assert across.size > 20
    assert near <= across.min() <= across.max() == models_pictures.WIDTH - near
    assert near <= down.min() <= down.max() <= models_pictures.HEIGHT - near


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
def test_the_claims(row: str) -> None:
    assert row in PAGE


def test_the_ways_to_choose_models_work() -> None:
    choices = re.findall(r"`(models = [^`]*)`", PAGE)
    assert len(choices) == 3
    for choice in choices:
        chosen, faults = expand_models(tomllib.loads(choice)["models"], catalogue())
        assert chosen, choice
        assert not faults, choice


def test_what_the_solver_leaves_open_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = np.random.default_rng(5)

    def shaken(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values + noise.uniform(-1e-10, 1e-10, values.shape)

    exact, found = models_restitution.closed_form_restitution, models_restitution.restitution_curves()
    other = {key: replace(one, e_out=shaken(one.e_out)) for key, one in found.items()}
    monkeypatch.setattr(models_deviations, "closed_form_restitution", lambda model, e: shaken(exact(model, e)))
    for user in (models_deviations, models_page, models_pictures):
        monkeypatch.setattr(user, "restitution_curves", lambda: other)
    assert models_page.models_page() == PAGE
    assert models_pictures.pictures() == PICTURES


def test_a_law_without_a_closed_form_is_integrated() -> None:
    law = catalogue()["flores-2011"]
    e = models_restitution.GRID[::20]
    np.testing.assert_allclose(
        models_restitution.integrated_restitution([law], {law.key: {}}, e=e)[law.key],
        models_restitution.closed_form_restitution(law, e),
        atol=1e-9,
    )


def test_the_examples() -> None:
    assert all(doctest.testmod(one).failed == 0 for one in (models_page, models_tables))
