"""A report is one page with the whole result, which loads nothing and escapes all text of a file."""

from __future__ import annotations

import base64
import html
import json
import math
import re
import shlex
import shutil
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import NoReturn
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.models import catalogue
from impact.errors import ImpactError, UsageError
from impact.formatting import percentage
from impact.plots.kinds import KINDS, find_kind
from impact.results.provenance import describe_point
from impact.results.ranking import recommend

from .conftest import ROOT, Run, make_once

# whole pages, some of them in a browser: `make test-faults` runs them
pytestmark = pytest.mark.slow

Browser = Callable[..., tuple[str, list[str]]]
WINDOWS = (320, 375, 1280)
# elements without an end tag in HTML
VOID = {"meta", "br", "img", "input", "link", "hr"}
PICTURE = {"svg", "g", "path", "defs", "use", "clipPath", "rect", "pattern", "image", "style"}
# elements of the metadata of a picture
METADATA = {"metadata", "RDF", "Work", "type", "format", "creator", "Agent", "title"}
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
POINT = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
# figures of a sweep over e and another axis, which is neither a calibration nor made at fixed steps
OF_A_SWEEP = ("final-velocities", "restitution", "error", "map", "validity", "loop")
FAIR = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
SCRIPT = "<script>alert(1)</script>"
CAPTIONS = {kind: find_kind(kind).caption for kind in KINDS}


class ParsedPage(HTMLParser):
    """The elements of a page with their attributes, and the text inside each element."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.texts: list[tuple[tuple[str, ...], str]] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names)
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        raise AssertionError(f"<{tag}/> is not HTML")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((tuple(self.open), data))

    def handle_comment(self, data: str) -> None:
        raise AssertionError(f"a comment: {data}")

    def text(self, inside: str = "body") -> str:
        """The text within an element."""
        return "".join(data for where, data in self.texts if inside in where)


def build(dataset: xr.Dataset, plugins: Sequence[impact.ForceModel | Path] = ()) -> str:
    return impact.report(dataset, plugins=plugins)


def table(text: str, label: str) -> list[list[str]]:
    """The cells of a table by its label, without its headings."""
    (body,) = re.findall(rf'aria-label="{label}">\s*<table>.*?<tbody>(.*?)</tbody>', text, re.DOTALL)
    rows = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
    return [[html.unescape(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)] for row in rows]


def figures(text: str) -> list[str]:
    """The descriptions of the figures of a page, one of each kind."""
    return re.findall(r'<figure>\s*<img src="[^"]*" alt="([^"]*)">', text)


def pictures(text: str) -> list[ElementTree.Element]:
    """The pictures of a page."""
    encoded = re.findall(r'<img src="data:image/svg\+xml;base64,([^"]*)"', text)
    return [ElementTree.fromstring(base64.b64decode(picture)) for picture in encoded]


def swept(models: object, plugins: Sequence[impact.ForceModel] = (), **changes: object) -> xr.Dataset:
    """A sweep of one point, with changes to its inputs; None removes an input."""
    inputs = {name: value for name, value in {**POINT, **changes}.items() if value is not None}
    return impact.sweep({"title": "Small", "models": models, "sweep": inputs}, plugins=plugins)


@pytest.fixture(scope="session")
def many() -> xr.Dataset:
    """A result of all built-in laws."""
    return impact.load(ROOT / "tests" / "data" / "every_model.h5")


@pytest.fixture(scope="session")
def pages(
    tmp_path_factory: pytest.TempPathFactory, figure6: xr.Dataset, wide: xr.Dataset, many: xr.Dataset
) -> dict[str, str]:
    datasets = {"figure 6": figure6, "wide": wide, "many": many}
    return {
        name: make_once(tmp_path_factory, f"{name}.html", lambda dataset=dataset: build(dataset))
        for name, dataset in datasets.items()
    }


def test_every_page_is_well_formed_and_has_its_sections_in_order(pages: dict[str, str]) -> None:
    sections = [
        "Swept inputs",
        "Recommended models",
        "Figures",
        "Failed points",
        "How it was computed",
        "Models",
        "Config",
        "Commands of the figures",
    ]
    for text in pages.values():
        parsed = ParsedPage(text)
        headings = re.findall('<h2 id="(.*?)">(.*?)</h2>', text)
        assert [title for _, title in headings] == sections
        # the contents have a link to each
        assert re.findall('<a href="#(.*?)">(.*?)</a>', text) == headings
        assert parsed.elements[0] == ("html", {"lang": "en"})
        assert [attributes for name, attributes in parsed.elements if name == "meta"] == [
            {"charset": "utf-8"},
            {"http-equiv": "Content-Security-Policy", "content": POLICY},
            {"name": "viewport", "content": "width=device-width, initial-scale=1"},
        ]
        assert POLICY.startswith("default-src 'none'; style-src 'unsafe-inline'; img-src data:;")


def test_models_and_sections_of_a_page_are_chosen(cli: Run, tmp_path: Path, figure6: xr.Dataset) -> None:
    impact.save(figure6, tmp_path / "r.h5")
    words = ["--model", "gharib-hurmuzlu-2012", "--section", "figures", "--section", "commands", "-o", "a.html"]
    done = cli("report", "r.h5", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert re.findall('<h2 id="(.*?)">', text) == ["figures", "commands"]
    assert re.findall('<a href="#(.*?)">', text) == ["figures", "commands"]
    assert "this page shows 1 of the 3 models of the result" in text
    # the file has the other models too
    commands = re.findall("<code>(impact plot .*?)</code>", text)
    assert commands
    assert all("--model=gharib-hurmuzlu-2012" in command for command in commands if "kind=loop" not in command)
    for wrong, message in (
        (["--section", "figurs"], '--section: no section "figurs"; did you mean "figures"?'),
        (["--section", "friction"], "--section friction: this result has no friction"),
        (["--model", "gharib-hurmuzlu-2013"], 'no model "gharib-hurmuzlu-2013" in this result; did you mean'),
    ):
        done = cli("report", "r.h5", *wrong, "-o", "b.html", cwd=tmp_path)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert message in done.stderr
    assert not (tmp_path / "b.html").exists()


def test_a_page_loads_nothing(pages: dict[str, str]) -> None:
    for text in pages.values():
        for name, attributes in ParsedPage(text).elements:
            assert name not in {"script", "link", "iframe", "object", "embed", "base", "form", "foreignobject"}
            assert not [key for key in attributes if key.startswith("on")]
            assert attributes.get("src", "data:").startswith("data:")
            assert ("href" in attributes) == (name == "a")
            assert attributes.get("href", "#").startswith(("https://doi.org/10.", "#"))
        for way in ("url(", "@import", "@font-face"):
            assert way not in text
        links = re.findall(r'<a href="https://doi\.org/', text)
        assert len(re.findall("https?:", text)) == len(links) > 0


def test_a_picture_refers_to_itself_only(pages: dict[str, str]) -> None:
    for text in pages.values():
        assert len(pictures(text)) == text.count("<figure") >= len(figures(text)) > 3
        for picture in pictures(text):
            ids = {element.get("id") for element in picture.iter()}
            for element in picture.iter():
                assert element.tag.rpartition("}")[2] in PICTURE | METADATA
                for name, value in element.attrib.items():
                    references = re.findall(r"url\((.*?)\)", value) + [value] * name.endswith("href")
                    assert all(
                        reference.startswith("data:image/png") or reference.removeprefix("#") in ids
                        for reference in references
                    )


def test_all_models_and_axes_are_named(pages: dict[str, str], wide: xr.Dataset, many: xr.Dataset) -> None:
    for name, result in (("wide", wide), ("many", many)):
        words = ParsedPage(pages[name]).text()
        for about in ("model", "title", "equation", "reference"):
            for text in result[about].values:
                # a browser shows one space for several
                assert " ".join(str(text).split()) in " ".join(words.split()), text
        dois = {str(doi) for doi in result["doi"].values if str(doi)}
        links = [unquote(link) for link in re.findall(r'href="https://doi\.org/([^"]+)"', pages[name])]
        assert set(links) == dois
    rows = {row[0]: row[1:] for row in table(pages["wide"], "Swept inputs")}
    assert rows == {
        "e": ["coefficient of restitution", "", "0.2", "1", "3", "even, by 0.4"],
        "v1": ["velocity of ball 1 before the impact", "m/s", "1", "2", "2", "1, 2"],
        "m1": ["mass of ball 1", "kg", "1", "3", "2", "1, 3"],
        "m2": ["mass of ball 2", "kg", "1", "∞", "2", "varies with m1: 1, ∞"],
        "material2": ["material of ball 2", "", "", "", "2", "soft, hard"],
        "ismail-stronge-2008.gamma": ["plastic loss factor γ", "", "1.5", "4", "2", "1.5, 4"],
    }
    single = {row[0]: row[1] for row in table(pages["wide"], "Single values")}
    assert single["v2"] == "-1 m/s"
    assert single["soft"] == "E = 2 GPa, nu = 0.4, rho = 1000 kg/m³"


def test_the_table_of_models_is_the_ranking(pages: dict[str, str], wide: xr.Dataset, many: xr.Dataset) -> None:
    for name, result in (("wide", wide), ("many", many)):
        ranked = recommend(result)
        assert ranked.headline in ParsedPage(pages[name]).text().replace("No model", "no model")
        rows = table(pages[name], "Models, the best first")
        assert [row[0] for row in rows] == [model.name for model in ranked.models]
        for (_, share, most, mean, failed, worst, serves), model in zip(rows, ranked.models, strict=True):
            assert (share, failed) == (percentage(model.share), f"{model.failed:,}")
            for shown, error in ((mean, model.mean_error), (most, model.max_error)):
                is_rounding = shown == "<1e-9"
                assert is_rounding == (0.0 < error < 1e-9)
                assert is_rounding or float(shown) == pytest.approx(error, rel=5e-3)
            has_worst = model.max_error > 1e-9
            assert worst == (f"{describe_point(model.at)}: e_out {model.e_out:.4g}" if has_worst else "–")
            ends = [float(number) for number in re.findall(r"[\d.]+", serves)]
            assert ends == [end for least, most in model.served or () for end in dict.fromkeys((least, most))]


def test_of_many_models_the_figures_show_the_best(pages: dict[str, str], many: xr.Dataset) -> None:
    best = [model.model for model in recommend(many).models[:8]]
    assert f"The figures show 8 of the {many.sizes['model']} models: {', '.join(best)}." in pages["many"]
    assert "The figures show" not in pages["wide"] + pages["figure 6"]
    assert figures(pages["many"]) == [CAPTIONS[kind] for kind in OF_A_SWEEP]


def test_a_page_of_many_models_is_small_and_reproducible(pages: dict[str, str], many: xr.Dataset) -> None:
    assert many.sizes["model"] >= 60
    before = time.process_time()
    assert build(many) == pages["many"]
    assert time.process_time() - before < 30.0
    assert len(pages["many"].encode()) < 3_000_000


def test_the_figures_depend_on_the_axes(pages: dict[str, str], wide: xr.Dataset) -> None:
    lines = [CAPTIONS[kind] for kind in ("final-velocities", "restitution", "error")]
    assert figures(pages["figure 6"]) == [*lines, CAPTIONS["loop"]]
    assert figures(pages["wide"]) == [CAPTIONS[kind] for kind in OF_A_SWEEP]
    # the middle of e, without the parameter of one of the models
    (caption,) = re.findall(f"{CAPTIONS['loop']}(.*?)</figcaption>", pages["wide"])
    assert "e\xa0=\xa00.6" in caption
    text = build(wide.isel(e=[1], v1=[0], m1=[0]))
    assert figures(text) == [*lines, CAPTIONS["loop"]]


def test_the_figures_are_at_a_speed_at_which_the_balls_meet() -> None:
    text = build(swept(FAIR, e=[0.2, 0.9], v1=[-1.0, 0.0, 2.0]))
    assert figures(text) == [CAPTIONS[kind] for kind in OF_A_SWEEP]
    captions = re.findall("<figcaption>(.*?)</figcaption>", text)
    # without an impact there is nothing to draw
    captions = [caption for caption in captions if "As Figure" not in caption or "v1" in caption]
    assert captions[0].endswith("Not drawn: 2 values of v1.")
    assert [("v1\xa0=\xa02\xa0m/s" in caption) for caption in captions] == [True, True, True, False, False, True]


def test_a_motion_is_that_of_an_impact_with_a_slip_near_the_middle_of_its_axis() -> None:
    captions = captions_of(build(swept(FAIR, e=0.5, v1=[-3.0, -2.0, -1.0, 1.0, 2.0])))
    assert any(CAPTIONS["loop"] in caption and "At v1 = 1 m/s." in caption for caption in captions)
    sweep = {"v1": 1.0, "u1": [-1.0, 0.0, 3.0], "m1": 1.0, "m2": 1.0, "R1": 0.01, "R2": 0.01, "mu": 0.3, "K": 1e7}
    friction = {"frictions": "cundall-strack-1979", "friction": {"cundall-strack-1979": {"k_t": 1e6}}}
    captions = captions_of(build(impact.sweep({"models": "hertz", "sweep": sweep, **friction})))
    assert any("slip displacement" in caption and "At u1 = -1 m/s." in caption for caption in captions)


def captions_of(text: str) -> list[str]:
    """The captions of all figures, with plain spaces."""
    found = re.findall("<figcaption>(.*?)</figcaption>", text)
    return [html.unescape(caption).replace("\xa0", " ") for caption in found]


def test_a_figure_says_which_other_axes_matter_and_shows_their_values() -> None:
    # the error of these laws depends on e alone, but for that of Kuwabara and Kono also on the speed
    inputs = {"e": [0.2, 0.5, 0.9], "v1": [0.1, 1.0], "m1": [1.0, 2.0, 3.0, 4.0, 5.0], "m2": 1.0, "K": 6e9}
    free = captions_of(build(impact.sweep({"models": FAIR, "sweep": inputs})))
    of_kind = {caption.partition(". ")[2].partition(" At")[0]: caption for caption in free}
    assert "v1 and m1 do not matter (differences below 0.1%)." in of_kind[CAPTIONS["restitution"]]
    # few combinations are all drawn, each with a command
    assert "Not drawn" not in of_kind[CAPTIONS["final-velocities"]]
    others = [caption.partition(". ")[2] for caption in free if "As Figure 1," in caption]
    masses = [f"m1 = {m} kg" for m in range(2, 6)]
    values = ["v1 = 1 m/s", *masses, *(f"v1 = 1 m/s, {mass}" for mass in masses)]
    assert others == [f"As Figure 1, at {value}." for value in values]
    assert [caption.partition(".")[0] for caption in free] == [f"Figure {n + 1}" for n in range(len(free))]
    # a motion depends on all of them, and is drawn at their ends; it is in the middle of the axis of other figures
    loops = [caption.partition(" at ")[2] for caption in free if "As Figure 6," in caption]
    assert loops == ["v1 = 1 m/s.", "m1 = 5 kg.", "e = 0.2.", "e = 0.9."]
    assert of_kind[CAPTIONS["loop"]].endswith("Not drawn: 3 values of m1 and 22 combinations of v1, m1 and e.")
    law = {"models": ["kuwabara-kono-1987"], "model": {"kuwabara-kono-1987": {"A": "1 ms"}}}
    fast = captions_of(build(impact.sweep({**law, "sweep": inputs | {"v1": {"geomspace": [0.1, 10.0, 40]}}})))
    # the last and four between it and the first of forty, which Figure 2 has
    at = [caption.partition(". ")[2] for caption in fast if "As Figure 2, at v1" in caption]
    assert at == [
        f"As Figure 2, at v1 = {speed} m/s." for speed in ("0.257191", "0.661474", "1.51178", "3.88816", "10")
    ]
    (restitution,) = [caption for caption in fast if CAPTIONS["restitution"] in caption]
    assert restitution.endswith("Not drawn: 34 values of v1 and 156 combinations of v1 and m1.")


def test_figures_of_many_points_take_little_memory(cli: Run, tmp_path: Path) -> None:
    # a map has a million points, at each of 20 speeds
    axes = {"e": {"linspace": [0.1, 1.0, 500]}, "m2": {"geomspace": [0.1, 10.0, 1000]}}
    inputs = {**axes, "v1": {"linspace": [1.0, 2.0, 20]}, "m1": 1.0, "K": 6e9}
    result = tmp_path / "result.h5"
    impact.sweep({"models": FAIR, "sweep": inputs, "output": {"layout": "factored"}}, output=result)
    done = cli("report", result, "--section=figures")
    assert done.returncode == 0, done.stderr
    captions = captions_of(result.with_suffix(".html").read_text())
    (shown,) = [caption for caption in captions if CAPTIONS["map"] in caption]
    assert shown.endswith("v1 does not matter (differences below 0.1%).")
    assert done.memory < 800_000_000


def test_numbers_have_few_digits_and_materials_of_the_library_are_no_change() -> None:
    inputs = {
        "e": {"linspace": [0.1, 0.6, 10]},
        "v1": 1.0,
        "m1": 1.0,
        "m2": math.inf,
        "R1": 0.1,
        "R2": [0.1, math.inf],
    }
    result = impact.sweep({"models": FAIR, "sweep": {**inputs, "material": "steel"}}, overrides=["sweep.v1=2.0"])
    text = impact.report(result, sections=["inputs", "answer", "config"])
    assert ["m2", "∞", "mass of ball 2"] in table(text, "Single values")
    assert [row[4:] for row in table(text, "Swept inputs") if row[0] == "R2"] == [["∞", "2", "0.1, ∞"]]
    assert not re.search(r"[0-9]\.[0-9]{8}", text.partition('id="config"')[0].partition("<main>")[2])
    assert "Of the library of materials: steel." in text
    assert re.findall("--set (.*?)<", text) == ["sweep.v1=2.0"]


def test_a_stiffness_of_a_law_has_the_unit_of_its_exponent() -> None:
    """A linear law beside Hertz' law: K of its table is in N/m, that of the sweep in N/m^1.5."""
    sweep = {"e": [0.5, 0.9], "v1": 1.0, "K": [1e6, 2e6], "m1": 1.0, "m2": 1.0}
    for stiffness in (1e5, [1e5, 2e5]):
        law = {"K": stiffness, "C": 20.0}
        result = impact.sweep(
            {"models": ["hertz", "kelvin-voigt"], "sweep": sweep, "model": {"kelvin-voigt": law}}
        )
        page = html.unescape(build(result)).replace("\N{NO-BREAK SPACE}", " ")
        axes = {row[0]: row for row in table(page, "Swept inputs")}
        assert axes["K"][2] == "MN/m^1.5"
        if stiffness == 1e5:
            assert dict(row[:2] for row in table(page, "Single values"))["kelvin-voigt.K"] == "100 kN/m"
        else:
            assert axes["kelvin-voigt.K"][2] == "kN/m"
            assert "kelvin-voigt.K = 100 kN/m." in page
        worst = {row[0].partition(" ")[0]: row[5] for row in table(page, "Models, the best first")}
        assert "K=1 MN/m^1.5" in worst["hertz"]
        # not used, and of the n of other laws
        assert "K=1 MN/m^n" in worst["kelvin-voigt"]


def drawn_elements(svg: bytes) -> Counter[tuple[str, ...]]:
    """What a picture draws: each element with its form, place and look."""
    about = ("d", "x", "y", "transform", "style")
    elements = ElementTree.fromstring(svg).iter()
    return Counter(
        (element.tag, *(re.sub("url.*?;", "", element.get(name, "")) for name in about)) for element in elements
    )


@pytest.mark.parametrize("name", ["wide", "oblique"])
def test_the_commands_draw_the_figures_again(cli: Run, tmp_path: Path, name: str, wide: xr.Dataset) -> None:
    path = tmp_path / "my results.h5"
    if name == "wide":
        impact.save(wide, path)
    else:
        shutil.copy(ROOT / "tests" / "data" / f"{name}.h5", path)
    text = build(impact.load(path))
    commands = [html.unescape(command) for command in re.findall("<li><code>(impact plot .*?)</code></li>", text)]
    embedded = re.findall(r'<img src="data:image/svg\+xml;base64,([^"]*)"', text)
    assert len(commands) == len(embedded) > 4
    kinds = [command.partition("--kind=")[2].split()[0] for command in commands]
    # further figures of a kind differ in their values: the first and the last of each are drawn again
    for number, (command, picture) in enumerate(zip(commands, embedded, strict=True), 1):
        if kinds[number - 1] in kinds[: number - 1] and kinds[number - 1] in kinds[number:]:
            continue
        done = cli(*shlex.split(command)[1:], cwd=tmp_path)
        assert done.returncode == 0, (command, done.stderr)
        shown = drawn_elements(base64.b64decode(picture))
        again = drawn_elements((tmp_path / f"figure{number}.svg").read_bytes())
        assert not shown - again, command
        # only the backgrounds are not on the page
        assert {style for _, d, *_, style in again - shown if d} <= {"fill: #ffffff", ""}, command


def test_a_page_of_a_sweep_without_e_explains_what_is_missing() -> None:
    free = impact.sweep(
        {
            "models": ["kelvin-voigt"],
            "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0},
            "model": {"kelvin-voigt": {"C": [10.0, 20.0, 40.0]}},
        }
    )
    text = build(free)
    assert "The models are not ranked: this sweep has no requested e" in text
    assert (
        "The figure error is left out: this result has no error of the restitution, which needs a requested e"
        in text
    )
    assert figures(text) == [CAPTIONS[kind] for kind in ("final-velocities", "restitution", "loop")]
    assert "kelvin-voigt.C\xa0=\xa020" in text


@pytest.mark.parametrize("models", [FAIR, FAIR[:1]])
def test_a_single_point_has_a_page(models: list[str]) -> None:
    text = build(swept(models))
    assert "Nothing was varied but the model." in text
    assert f"solution: {len(models)} point{'s' * (len(models) > 1)}.</p>" in text
    assert [row[0] for row in table(text, "Single values")] == ["e", "v1", "m1", "m2", "K", "v2", "n"]
    assert figures(build(swept(models, e=[0.5]))) == figures(text)


def test_failed_points_are_listed() -> None:
    failures = impact.load(ROOT / "tests" / "data" / "failures.h5")
    text = build(failures)
    ParsedPage(text)
    rows = table(text, "Failed points")
    failed = int((failures["status"] >= 10).sum())
    assert len(rows) == 20
    assert f"and {failed - 20} more" in text
    for key, where, why in rows:
        at = dict(part.split("\xa0=\xa0") for part in where.split(", "))
        point = failures.sel(
            model=key, **{name: float(value.split("\xa0")[0].replace("∞", "inf")) for name, value in at.items()}
        )
        assert at.keys() == {"e", "v1", "m1", "m2"}
        assert why == impact.contact.status.Status(int(point["status"])).meaning
    few = table(build(failures.isel(model=[1], v1=[1], e=[1])), "Failed points")
    assert len(few) == int((failures["status"].isel(model=1, v1=1, e=1) >= 10).sum())


def test_failed_points_of_pairs_are_listed() -> None:
    sweep = {"v1": 1.0, "u1": 0.5, "m1": 1.0, "m2": 1.0, "R1": 0.01, "R2": 0.01, "K": 1e8, "mu": [0.1, 0.3]}
    law = "simbody-hunt-crossley"
    config = {"models": "hertz", "frictions": [law], "sweep": sweep, "friction": {law: {"mu_d": 0.2}}}
    text = build(impact.sweep(config))
    meaning = impact.contact.status.FrictionStatus.INVALID_PARAMETER.meaning
    assert table(text, "Failed points") == [[f"hertz with {law}", "mu\xa0=\xa00.1", meaning]]
    (heads,) = re.findall(r'aria-label="Failed points">\s*<table>\s*<thead>(.*?)</thead>', text, re.DOTALL)
    assert re.findall(r"<th[^>]*>(.*?)</th>", heads) == ["law", "where", "why"]
    assert "more</p>" not in text


def test_a_page_without_failed_points_states_it(pages: dict[str, str]) -> None:
    assert "<p>No point failed.</p>" in pages["figure 6"]


def test_the_provenance_of_the_file_is_on_the_page(stored: Path) -> None:
    result = impact.load(stored)
    rows = dict(table(build(result), "How it was computed"))
    assert rows["program"] == f"impact {impact.__version__}"
    assert rows["solver"] == "rtol 1e-10, max_steps 10000"
    assert rows["fingerprint"] == result.attrs["fingerprint"]
    assert rows["seal"] == result.encoding["seal"]
    result.encoding["seal"] = "5ea1"
    assert dict(table(build(result), "How it was computed"))["seal"] == "5ea1"
    assert f"numpy {np.__version__}" in rows["packages"]


def test_the_config_is_on_the_page_unchanged(pages: dict[str, str], figure6: xr.Dataset) -> None:
    assert ParsedPage(pages["figure 6"]).text("pre") == figure6.attrs["config"]
    changed = impact.sweep(ROOT / "configs" / "figure6.toml", overrides=["sweep.e=[0.5]", 'title="<b>"'])
    parsed = ParsedPage(build(changed))
    assert parsed.text("code").startswith('--set sweep.e=[0.5]--set title="<b>"')
    assert "b" not in {name for name, _ in parsed.elements}


def test_the_evidence_is_that_of_the_law_in_the_file(pages: dict[str, str], figure6: xr.Dataset) -> None:
    rows = {key: (state, source) for key, state, source in table(pages["figure 6"], "Evidence")}
    for key, (state, source) in rows.items():
        known = catalogue()[key].evidence
        assert state == known.state
        assert all(text in source for text in (known.source, known.doi, known.note))
    assert set(rows) == set(figure6["model"].values.tolist())
    # another law of the same name, of another version
    other = build(figure6.isel(model=[2]).assign_coords(equation=("model", ["F = 0"])))
    assert 'aria-label="Evidence"' not in other
    assert "Said to hold" not in other


def test_every_note_of_the_sweep_is_on_the_page() -> None:
    config = {
        "models": ["hertz", "kelvin-voigt"],
        "frictions": ["coulomb-1785", "lammps-mindlin"],
        "sweep": {"e": 0.5, "angle": ["10 deg", "40 deg"], "speed": 30.0, "mu": 0.3, "m1": 1.0, "R1": 0.02},
        "model": {"kelvin-voigt": {"C": 10.0}},
        "materials": {"soft": {"E": 2e6, "nu": 0.3, "rho": 1000.0}},
    }
    config["sweep"] |= {"m2": 1.0, "R2": 0.02, "material": "soft"}
    with pytest.warns(impact.ImpactWarning) as caught:
        result = impact.sweep(config)
    shown = " ".join(ParsedPage(build(result)).text().split())
    notes = [str(note.message).removeprefix("config: ") for note in caught]
    for words in ("kelvin-voigt with lammps-mindlin", "m1: got 1 kg", "peak indentation above 10%"):
        assert any(note.startswith(words) for note in notes), notes
    for note in notes:
        assert f"Note: {note}" in shown


MINE = """from impact import ForceModel
MINE = ForceModel(key="mine", title="Mine", year=2026, equation="F = K δ", reference="",
                  force=lambda K, x: K * x, exponent=1.0)
"""


def test_only_the_loop_needs_the_file_of_a_plug_in(tmp_path: Path) -> None:
    (tmp_path / "my.py").write_text(MINE, encoding="utf-8")
    result = impact.sweep(
        {"models": ["mine", "hertz"], "sweep": {**POINT, "e": [0.5, 1.0]}, "model": {"mine": {"K": 1e6}}},
        plugins=[tmp_path / "my.py"],
    )
    text = build(result)
    assert dict(table(text, "How it was computed"))["plug-in mine"].startswith("file my.py, sha256 ")
    assert "The figure loop is left out: the result: made with mine of my.py" in text
    assert CAPTIONS["loop"] not in text
    assert CAPTIONS["loop"] in build(result, [tmp_path / "my.py"])


def test_a_plug_in_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    result = swept(["hertz"])
    with pytest.raises(ImpactError, match=r"absent\.py: cannot be read"):
        build(result, [tmp_path / "absent.py"])


def test_a_figure_without_stored_values_is_left_out() -> None:
    config = {"models": FAIR, "sweep": {**POINT, "e": [0.1, 0.5]}, "output": {"variables": ["e_out"]}}
    text = build(impact.sweep(config))
    assert figures(text) == [CAPTIONS["restitution"], CAPTIONS["loop"]]
    assert "The figure final-velocities is left out: this result has no v1_post" in text


def test_a_result_without_status_or_in_another_order_has_a_page(pages: dict[str, str], wide: xr.Dataset) -> None:
    bare = build(wide.drop_vars(["status", "in_domain"]).transpose())
    assert "The models are not ranked: this result has no status" in bare
    assert "The result does not contain the status of the points." in bare
    assert figures(bare) == figures(pages["wide"])


def test_a_time_history_is_refused() -> None:
    shot = impact.run(model="hertz").history
    assert shot is not None
    with pytest.raises(UsageError, match="got a time history"):
        build(shot)


def malicious_result(text_of: Callable[[str], str]) -> xr.Dataset:
    """A result with all texts from a function of their name."""
    balls = {"e": [0.2, 0.5, 1.0], "v1": [-1.0, 1.0], "m1": [1.0, math.inf], "m2": math.inf}
    steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    result = impact.sweep(
        {
            "models": FAIR,
            "sweep": {**balls, "R1": 0.1, "R2": 0.1, "material": [text_of("a"), text_of("b")]},
            "materials": {text_of("a"): steel, text_of("b"): steel},
        }
    )
    for variable in (result["e"], result["v1"], result["material"], result["e_error"]):
        variable.attrs.update(units=text_of("unit"), long_name=text_of("name"))
    names = {
        about: ("model", [text_of(f"{about} 1"), text_of(f"{about} 2")])
        for about in ("model", "title", "equation", "reference")
    }
    dois = [f"10.1234/{text_of('doi').replace(' ', '')}", f"javascript:alert(1)//10.1234/{text_of('x')}"]
    plugins = {text_of("key"): {"file": text_of("file"), "sha256": text_of("hash")}}
    return result.assign_coords(**names, doi=("model", dois)).assign_attrs(
        title=text_of("title"),
        config=f"= {text_of('config')}\n{text_of('more')}",
        config_set=json.dumps([text_of("set")]),
        fingerprint=text_of("fingerprint"),
        packages=json.dumps({text_of("numpy"): text_of("2")}),
        reason=text_of("why"),
        plugins=json.dumps(plugins),
        impact_version=text_of("version"),
    )


MALICIOUS = (
    SCRIPT,
    "</pre></style></title><img src=x onerror=alert(1)>",
    '" onload="alert(1)" \' onclick=\'alert(1)',
    "--><script src=//malicious.example></script><!--",
    "]]></svg><style>*{display:none}</style>&lt;b&gt;&#60;i&#62;",
)


def check_escaped(make: Callable[[Callable[[str], str]], str], malicious: str) -> None:
    """Check that a page with malicious texts has the elements of a page with harmless texts."""
    elements = []
    for words in (lambda what: f"{what} {malicious}", lambda what: f"{what} harmless"):
        parsed = ParsedPage(make(words))
        elements.append([(name, attributes.keys()) for name, attributes in parsed.elements])
        hrefs = [attributes["href"] for name, attributes in parsed.elements if name == "a"]
        (link,) = [href for href in hrefs if not href.startswith("#")]
        assert re.fullmatch(r"https://doi\.org/10\.1234/[\w.~%/-]+", link)
    assert elements[0] == elements[1]


@pytest.mark.parametrize("malicious", MALICIOUS)
def test_texts_of_a_file_never_become_elements(malicious: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def make(words: Callable[[str], str]) -> str:
        def refused(dataset: xr.Dataset, kind: str, *_: object, **__: object) -> NoReturn:
            raise UsageError(words(kind))

        monkeypatch.setattr("impact.reporting.figures.get_plot_data", refused)
        return impact.report(malicious_result(words))

    check_escaped(make, malicious)


def test_texts_of_a_file_never_become_elements_of_a_picture(tmp_path: Path) -> None:
    def make(words: Callable[[str], str]) -> str:
        impact.save(malicious_result(words), tmp_path / "result.h5", overwrite=True)
        text = build(impact.load(tmp_path / "result.h5"))
        drawn = pictures(text)
        assert len(drawn) == 5
        for picture in drawn:
            assert {element.tag.rpartition("}")[2] for element in picture.iter()} <= PICTURE | METADATA
            assert not [name for element in picture.iter() for name in element.attrib if name.startswith("on")]
        return text

    check_escaped(make, MALICIOUS[-1])


def test_texts_of_a_file_are_shown_unchanged() -> None:
    parsed = ParsedPage(build(malicious_result(lambda what: f"{what} {SCRIPT}")))
    assert parsed.text("h1") == parsed.text("title").strip() == f"title {SCRIPT}"
    assert parsed.text("pre") == f"= config {SCRIPT}\nmore {SCRIPT}"
    for what in ("model 1", "title 2", "equation 1", "reference 2", "unit", "a", "fingerprint", "hash", "set"):
        assert f"{what} {SCRIPT}" in parsed.text("main"), what


def test_invisible_characters_are_shown_as_escapes() -> None:
    text = build(malicious_result(lambda what: f"{what} \x1b[31m\u202e\u200b"))
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202e\u200b]", text)
    assert "<h1>title \\x1b[31m\\u202e\\u200b</h1>" in text


def test_the_command_writes_the_page(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "results.h5"
    shutil.copy(stored, result)
    done = cli("report", "results.h5", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "")
    written = tmp_path / "results.html"
    size = f"{written.stat().st_size / 1000:,.0f} kB"
    assert done.stderr == f"results.html: 6 figures, {size}\n"
    assert written.read_text(encoding="utf-8") == build(impact.load(result))
    # an existing page is replaced only with --overwrite
    written.write_text("a note", encoding="utf-8")
    again = cli("report", "results.h5", cwd=tmp_path)
    assert (again.returncode, written.read_text("utf-8")) == (2, "a note")
    assert again.stderr == "results.html: exists; give another name, or overwrite it (--overwrite)\n"
    assert cli("report", "results.h5", "--overwrite", cwd=tmp_path).stderr == done.stderr


def test_the_command_replaces_only_pages(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "results.html"
    shutil.copy(stored, result)
    for words, message in (
        (("report", "results.html"), "is the file to be read"),
        (("report", stored, "-o", "results.h5"), "expected a name that ends in .html"),
        (("report", stored, "-o", "no/page.html"), "the folder no does not exist"),
        (("report", "none.h5"), "does not exist"),
    ):
        done = cli(*words, cwd=tmp_path)
        (line,) = done.stderr.splitlines()
        assert (done.returncode, message in line) == (2, True), line
    assert result.read_bytes() == stored.read_bytes()
    assert list(tmp_path.iterdir()) == [result]


# measures pages in frames of some widths; the pages themselves run no scripts
MEASURE = """
function light(colour) {
  const [r, g, b] = colour.match(/[0-9.]+/g).slice(0, 3).map(c => c / 255)
    .map(c => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}
function behind(node) {
  for (; node; node = node.parentElement) {
    const colour = getComputedStyle(node).backgroundColor;
    if (colour !== "rgba(0, 0, 0, 0)") return colour;
  }
  return "rgb(255, 255, 255)";
}
function measure(frame) {
  const inner = frame.contentDocument, root = inner.documentElement;
  const all = [...inner.body.querySelectorAll("*")];
  const texts = all.filter(node => [...node.childNodes].some(part => part.nodeType === 3 && part.data.trim()));
  const contrasts = texts.map(node => {
    const ends = [light(getComputedStyle(node).color), light(behind(node))].sort((a, b) => b - a);
    return (ends[0] + 0.05) / (ends[1] + 0.05);
  });
  return {
    window: frame.clientWidth, page: root.scrollWidth,
    beyond: all.filter(node => node.getBoundingClientRect().right > root.clientWidth + 0.5)
      .map(node => node.tagName),
    scrolling: [...inner.querySelectorAll(".scroll")].filter(node => node.scrollWidth > node.clientWidth).length,
    smallest: Math.min(...texts.map(node => parseFloat(getComputedStyle(node).fontSize))),
    contrast: Math.min(...contrasts), paper: getComputedStyle(inner.body).backgroundColor,
    broken: [...inner.images].filter(node => !node.naturalWidth).length,
    figures: [...inner.images].map(node => node.getBoundingClientRect().width),
  };
}
addEventListener("load", () => {
  const measurements = [...document.querySelectorAll("iframe")].map(measure);
  document.body.replaceChildren();
  document.body.textContent = JSON.stringify(measurements);
});
"""


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory, chromium: str) -> Browser:
    """Open a page in a real browser; return its elements after loading, and the lines of the console."""

    def show(text: str, *words: str) -> tuple[str, list[str]]:
        folder = tmp_path_factory.mktemp("browser")
        (folder / "page.html").write_text(text, encoding="utf-8")
        done = subprocess.run(
            [
                chromium,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--dump-dom",
                "--hide-scrollbars",
                "--enable-logging=stderr",
                "--virtual-time-budget=20000",
                f"--user-data-dir={folder}/profile",
                *words,
                (folder / "page.html").as_uri(),
            ],
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=120,
            check=True,
        )
        return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]

    return show


def framed(texts: Sequence[str], widths: Sequence[int]) -> str:
    """A page that measures others in windows of some widths."""
    frames = [
        f'<iframe srcdoc="{html.escape(text)}" style="border: 0; width: {width}px; height: 900px"></iframe>'
        for text in texts
        for width in widths
    ]
    return f"<!DOCTYPE html><meta charset=utf-8><script>{MEASURE}</script><body>{''.join(frames)}"


def measured(dumped: str) -> Iterator[dict[str, object]]:
    """The measurements of MEASURE."""
    yield from json.loads(html.unescape(dumped.partition("<body>")[2].partition("</body>")[0]))


@pytest.fixture(scope="session")
def wide_texts(tmp_path_factory: pytest.TempPathFactory, wide: xr.Dataset) -> str:
    """A page with words that are wider than a phone."""
    long = "w" * 500
    words = dict.fromkeys(("title", "config", "fingerprint", "reason", "impact_version"), long)
    about = {name: ("model", [long] * wide.sizes["model"]) for name in ("reference", "equation", "doi")}
    dataset = wide.assign_attrs(words).assign_coords(about)
    return make_once(tmp_path_factory, "wide texts.html", lambda: build(dataset))


@pytest.mark.parametrize(("scheme", "is_dark"), [("0", True), ("1", False)])
def test_a_page_fits_a_phone_and_a_desktop(
    browser: Browser, pages: dict[str, str], wide_texts: str, scheme: str, is_dark: bool
) -> None:
    failures = build(impact.load(ROOT / "tests" / "data" / "failures.h5"))
    texts = [*pages.values(), failures, wide_texts]
    shown, _ = browser(framed(texts, WINDOWS), f"--blink-settings=preferredColorScheme={scheme}")
    windows = list(measured(shown))
    assert [window["window"] for window in windows] == len(texts) * list(WINDOWS)
    for window in windows:
        is_phone = window["window"] < 400
        assert window["page"] == window["window"]
        assert not is_phone or (window["beyond"], window["scrolling"]) == ([], 0)
        assert window["smallest"] >= 14.0
        assert window["broken"] == 0
        assert window["contrast"] >= 4.5
        assert (window["paper"] != "rgb(255, 255, 255)") == is_dark
        # figures are side by side if the window is wide enough
        assert min(window["figures"]) > 280
        assert max(window["figures"]) < (375 if is_phone else 500)


def test_a_printed_page_is_a4(chromium: str, tmp_path: Path, pages: dict[str, str]) -> None:
    def printed(text: str) -> bytes:
        (tmp_path / "page.html").write_text(text, encoding="utf-8")
        words = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--no-pdf-header-footer",
        ]
        words += [f"--user-data-dir={tmp_path}/profile", f"--print-to-pdf={tmp_path}/page.pdf"]
        page = (tmp_path / "page.html").as_uri()
        subprocess.run([chromium, *words, page], capture_output=True, timeout=120, check=True)
        return (tmp_path / "page.pdf").read_bytes()

    document = printed(pages["wide"])
    boxes = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", document)
    sizes = {(round(float(width)), round(float(height))) for width, height in boxes}
    assert sizes == {(595, 842)}
    # the header has the title, whatever it is, and does not end the style sheet
    for title in ("Title", '"; } </style><script>alert(1)</script>'):
        text = build(impact.load(ROOT / "tests" / "data" / "figure6.h5").assign_attrs(title=title))
        assert f"<h1>{html.escape(title)}</h1>".replace("&#x27;", "&#39;").replace("&quot;", "&#34;") in text
        assert "script" not in {name for name, _ in ParsedPage(text).elements}
        (running,) = re.findall(r'@top-left { content: "(.*)"; } }', text)
        assert re.sub(r"\\([0-9a-f]{6})", lambda code: chr(int(code[1], 16)), running) == title


def test_the_browser_reports_no_error(browser: Browser, pages: dict[str, str]) -> None:
    for text in (pages["wide"], build(malicious_result(lambda what: f"{what} {SCRIPT}"))):
        shown, console = browser(text)
        assert console == []
        assert shown.count("<figure") == text.count("<figure")


def test_the_policy_blocks_scripts_and_loads(browser: Browser, pages: dict[str, str]) -> None:
    malicious = "<script>document.title = 'ran'</script><img src=x onerror=\"document.title = 'ran'\">"
    malicious += '<img src="http://localhost:9/x.png"><style>@import "http://localhost:9/x.css";</style>'
    shown, console = browser(pages["figure 6"].replace("<main>", f"<main>{malicious}"))
    assert "<title>Final velocities comparison</title>" in shown
    refused = " ".join(console)
    assert all(f"'{rule}" in refused or rule in refused for rule in ("default-src", "img-src", "style-src")), (
        console
    )
    # without the policy the script runs
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    shown, _ = browser(pages["figure 6"].replace(policy, "").replace("<main>", f"<main>{malicious}"))
    assert "<title>ran</title>" in shown
