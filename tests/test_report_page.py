"""A report is one page with all of a result, which needs nothing from elsewhere and takes words as text."""

from __future__ import annotations

import base64
import html
import json
import math
import re
import shutil
import subprocess
import time
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
from impact import api
from impact.contact.models import catalogue
from impact.errors import UsageError
from impact.reporting.figures import FIGURES
from impact.reporting.page import page
from impact.results.ranking import ranking
from impact.results.replay_command import describe_point

from .conftest import ROOT, Run

# whole pages, most of them in a browser: `make test-faults` runs them
pytestmark = pytest.mark.slow

Browser = Callable[..., tuple[str, list[str]]]
WINDOWS = (320, 375, 1280)
# elements without an end in HTML
VOID = {"meta", "br", "img", "input", "link", "hr"}
PICTURE = {"svg", "g", "path", "defs", "use", "clipPath", "rect", "pattern", "image", "style"}
# of the metadata of a picture
ABOUT = {"metadata", "RDF", "Work", "type", "format", "creator", "Agent", "title"}
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"
POINT = {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
FAIR = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
EVIL = "<script>alert(1)</script>"


class Seen(HTMLParser):
    """What a reader of HTML sees: elements with their attributes, and the text of those that are open."""

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
        raise AssertionError(f"<{tag}/> is no HTML")

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
    return page(dataset, lambda kind, choice: api.get_plot_data(dataset, kind, choice, plugins))


def table(text: str, label: str) -> list[list[str]]:
    """The cells of a table by its label, without its headings."""
    (found,) = re.findall(rf'aria-label="{label}">\s*<table>.*?<tbody>(.*?)</tbody>', text, re.DOTALL)
    rows = re.findall(r"<tr>(.*?)</tr>", found, re.DOTALL)
    return [[html.unescape(cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)] for row in rows]


def figures(text: str) -> list[str]:
    """What the figures of a page are said to show."""
    return re.findall(r'<figure>\s*<img src="[^"]*" alt="([^"]*)">', text)


def pictures(text: str) -> list[ElementTree.Element]:
    """The pictures of a page."""
    found = re.findall(r'<img src="data:image/svg\+xml;base64,([^"]*)"', text)
    return [ElementTree.fromstring(base64.b64decode(one)) for one in found]


def swept(models: object, plugins: Sequence[impact.ForceModel] = (), **changes: object) -> xr.Dataset:
    """A sweep of one point, with changes to its inputs; None takes one out."""
    given = {name: value for name, value in {**POINT, **changes}.items() if value is not None}
    return impact.sweep({"title": "Small", "models": models, "sweep": given}, plugins=plugins)


@pytest.fixture(scope="session")
def many() -> xr.Dataset:
    """A result of all laws that are built in."""
    return impact.load(ROOT / "tests" / "data" / "every_model.h5")


@pytest.fixture(scope="session")
def pages(figure6: xr.Dataset, wide: xr.Dataset, many: xr.Dataset) -> dict[str, str]:
    return {"figure 6": build(figure6), "wide": build(wide), "many": build(many)}


def test_every_page_is_well_formed_and_has_its_sections_in_order(pages: dict[str, str]) -> None:
    wanted = ["What was swept", "The answer", "Figures", "Failed points", "How it was computed", "The models",
              "The config"]  # fmt: skip
    for text in pages.values():
        seen = Seen(text)
        assert re.findall("<h2>(.*?)</h2>", text) == wanted
        assert seen.elements[0] == ("html", {"lang": "en"})
        assert [attributes for name, attributes in seen.elements if name == "meta"] == [
            {"charset": "utf-8"},
            {"http-equiv": "Content-Security-Policy", "content": POLICY},
            {"name": "viewport", "content": "width=device-width, initial-scale=1"},
        ]
        assert POLICY.startswith("default-src 'none'; style-src 'unsafe-inline'; img-src data:;")


def test_it_needs_nothing_from_elsewhere(pages: dict[str, str]) -> None:
    for text in pages.values():
        for name, attributes in Seen(text).elements:
            assert name not in {"script", "link", "iframe", "object", "embed", "base", "form", "foreignobject"}
            assert not [key for key in attributes if key.startswith("on")]
            assert attributes.get("src", "data:").startswith("data:")
            assert ("href" in attributes) == (name == "a")
            assert attributes.get("href", "https://doi.org/10.").startswith("https://doi.org/10.")
        for way in ("url(", "@import", "@font-face"):
            assert way not in text
        links = re.findall(r'<a href="https://doi\.org/', text)
        assert len(re.findall("https?:", text)) == len(links) > 0


def test_a_picture_of_it_refers_to_itself_only(pages: dict[str, str]) -> None:
    for text in pages.values():
        assert len(pictures(text)) == len(figures(text)) > 3
        for picture in pictures(text):
            ids = {element.get("id") for element in picture.iter()}
            for element in picture.iter():
                assert element.tag.rpartition("}")[2] in PICTURE | ABOUT
                for name, value in element.attrib.items():
                    refers = re.findall(r"url\((.*?)\)", value) + [value] * name.endswith("href")
                    assert all(one.startswith("data:image/png") or one.removeprefix("#") in ids for one in refers)


def test_all_models_and_axes_are_named(pages: dict[str, str], wide: xr.Dataset, many: xr.Dataset) -> None:
    for name, result in (("wide", wide), ("many", many)):
        words = Seen(pages[name]).text()
        for about in ("model", "title", "equation", "reference"):
            for text in result[about].values:
                # a browser shows one space for several
                assert " ".join(str(text).split()) in " ".join(words.split()), text
        dois = {str(doi) for doi in result["doi"].values if str(doi)}
        links = [unquote(link) for link in re.findall(r'href="https://doi\.org/([^"]+)"', pages[name])]
        assert set(links) == dois
    rows = {row[0]: row[1:] for row in table(pages["wide"], "What was swept")}
    assert rows == {
        "e": ["coefficient of restitution", "–", "0.2", "1", "3", "even, by 0.4"],
        "v1": ["velocity of ball 1 before the impact", "m/s", "1", "2", "2", "1, 2"],
        "m1": ["mass of ball 1", "kg", "1", "3", "2", "1, 3"],
        "m2": ["mass of ball 2", "kg", "1", "inf", "2", "varies with m1: 1, inf"],
        "material2": ["material of ball 2", "–", "–", "–", "2", "soft, hard"],
        "ismail-stronge-2008.gamma": ["plastic loss factor γ", "–", "1.5", "4", "2", "1.5, 4"],
    }
    single = {row[0]: row[1] for row in table(pages["wide"], "Single values")}
    assert single["v2"] == "-1 m/s"
    assert single["soft"] == "E = 2e+09 Pa, nu = 0.4, rho = 1000 kg/m^3"


def test_the_answer_is_that_of_the_ranking(pages: dict[str, str], wide: xr.Dataset, many: xr.Dataset) -> None:
    for name, result in (("wide", wide), ("many", many)):
        ranked = ranking(result)
        assert ranked.headline in Seen(pages[name]).text().replace("No model", "no model")
        rows = table(pages[name], "Models, the best first")
        assert [row[0] for row in rows] == [one.name for one in ranked.models]
        for (_, share, most, mean, failed, worst, serves), one in zip(rows, ranked.models, strict=True):
            assert (share, failed) == (one.percent, f"{one.failed:,}")
            assert float(mean) == pytest.approx(one.mean_error, rel=5e-3)
            assert float(most) == pytest.approx(one.max_error, rel=5e-3)
            assert worst == f"{describe_point(one.at)}: e_out {one.e_out:.4g}"
            ends = [float(number) for number in re.findall(r"[\d.]+", serves)]
            assert ends == [end for least, most in one.served or () for end in dict.fromkeys((least, most))]


def test_of_many_models_the_figures_show_the_best(pages: dict[str, str], many: xr.Dataset) -> None:
    best = [one.model for one in ranking(many).models[:8]]
    assert f"The figures show 8 of the {many.sizes['model']} models: {', '.join(best)}." in pages["many"]
    assert "The figures show" not in pages["wide"] + pages["figure 6"]
    assert figures(pages["many"]) == list(FIGURES.values())


def test_many_models_are_no_large_page_and_the_same_each_time(pages: dict[str, str], many: xr.Dataset) -> None:
    assert many.sizes["model"] >= 60
    before = time.process_time()
    assert build(many) == pages["many"]
    assert time.process_time() - before < 30.0
    assert len(pages["many"].encode()) < 3_000_000


def test_figures_are_of_the_axes_that_there_are(pages: dict[str, str], wide: xr.Dataset) -> None:
    lines = [FIGURES[kind] for kind in ("final-velocities", "restitution", "error")]
    assert figures(pages["figure 6"]) == [*lines, FIGURES["loop"]]
    assert figures(pages["wide"]) == list(FIGURES.values())
    # the middle of e, without the parameter of one of the models
    (caption,) = re.findall(f"{FIGURES['loop']}(.*?)</figcaption>", pages["wide"])
    assert "e\xa0=\xa00.6" in caption
    one = build(wide.isel(e=[1], v1=[0], m1=[0]))
    assert figures(one) == [*lines, FIGURES["loop"]]


def test_figures_are_where_the_balls_meet() -> None:
    text = build(swept(FAIR, e=[0.2, 0.9], v1=[-1.0, 0.0, 2.0]))
    assert figures(text) == list(FIGURES.values())
    captions = re.findall("<figcaption>(.*?)</figcaption>", text)
    assert [("v1\xa0=\xa02\xa0m/s" in caption) for caption in captions] == [True, True, True, False, False, True]


def test_a_sweep_without_e_says_so() -> None:
    free = impact.sweep({
        "models": ["kelvin-voigt"], "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0},
        "model": {"kelvin-voigt": {"C": [10.0, 20.0, 40.0]}},
    })  # fmt: skip
    text = build(free)
    assert "The models are not ranked: this sweep has no requested e" in text
    assert (
        "The figure error is left out: this result has no error of the restitution, which needs a requested e"
        in text
    )
    assert figures(text) == [FIGURES[kind] for kind in ("final-velocities", "restitution", "loop")]
    assert "kelvin-voigt.C\xa0=\xa020" in text


@pytest.mark.parametrize("models", [FAIR, FAIR[:1]])
def test_a_single_point_is_a_page(models: list[str]) -> None:
    text = build(swept(models))
    assert "Nothing was varied but the model." in text
    assert f"solution: {len(models)} point{'s' * (len(models) > 1)}.</p>" in text
    assert [row[0] for row in table(text, "Single values")] == ["e", "v1", "m1", "m2", "K", "v2", "n"]
    assert figures(build(swept(models, e=[0.5]))) == figures(text)


def test_failed_points_are_listed() -> None:
    failures = impact.load(ROOT / "tests" / "data" / "failures.h5")
    text = build(failures)
    Seen(text)
    rows = table(text, "Failed points")
    failed = int((failures["status"] >= 10).sum())
    assert len(rows) == 20
    assert f"and {failed - 20} more" in text
    for key, where, why in rows:
        at = dict(part.split("\xa0=\xa0") for part in where.split(", "))
        point = failures.sel(model=key, **{name: float(value.split("\xa0")[0]) for name, value in at.items()})
        assert at.keys() == {"e", "v1", "m1", "m2"}
        assert why == impact.contact.status.Status(int(point["status"])).meaning
    few = table(build(failures.isel(model=[1], v1=[1], e=[1])), "Failed points")
    assert len(few) == int((failures["status"].isel(model=1, v1=1, e=1) >= 10).sum())


def test_no_failed_point_is_said_so(pages: dict[str, str]) -> None:
    assert "<p>No point failed.</p>" in pages["figure 6"]


def test_what_the_file_tells_of_its_making_is_there(stored: Path) -> None:
    result = impact.load(stored)
    rows = dict(table(build(result), "How it was computed"))
    assert rows["program"] == f"impact {impact.__version__}"
    assert rows["solver"] == "rtol 1e-10, max_steps 10000"
    assert rows["fingerprint"] == result.attrs["fingerprint"]
    assert rows["seal"] == result.encoding["seal"]
    result.encoding["seal"] = "5ea1"
    assert dict(table(build(result), "How it was computed"))["seal"] == "5ea1"
    assert f"numpy {np.__version__}" in rows["packages"]


def test_the_config_is_there_to_the_letter(pages: dict[str, str], figure6: xr.Dataset) -> None:
    assert Seen(pages["figure 6"]).text("pre") == figure6.attrs["config"]
    changed = impact.sweep(ROOT / "configs" / "figure6.toml", overrides=["sweep.e=[0.5]", 'title="<b>"'])
    seen = Seen(build(changed))
    assert seen.text("code") == '--set sweep.e=[0.5]--set title="<b>"'
    assert "b" not in {name for name, _ in seen.elements}


def test_evidence_is_that_of_the_law_in_the_file(pages: dict[str, str], figure6: xr.Dataset) -> None:
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


MINE = """from impact import ForceModel
MINE = ForceModel(key="mine", title="Mine", year=2026, equation="F = K δ", reference="",
                  force=lambda K, x: K * x, exponent=1.0)
"""


def test_a_plug_in_wants_its_file_again_for_the_loop_only(tmp_path: Path) -> None:
    (tmp_path / "my.py").write_text(MINE, encoding="utf-8")
    result = impact.sweep(
        {"models": ["mine", "hertz"], "sweep": {**POINT, "e": [0.5, 1.0]}, "model": {"mine": {"K": 1e6}}},
        plugins=[tmp_path / "my.py"],
    )
    text = build(result)
    assert dict(table(text, "How it was computed"))["plug-in mine"].startswith("file my.py, sha256 ")
    assert "The figure loop is left out: the result: made with mine of my.py" in text
    assert FIGURES["loop"] not in text
    assert FIGURES["loop"] in build(result, [tmp_path / "my.py"])


def test_what_is_not_stored_leaves_a_figure_out() -> None:
    config = {"models": FAIR, "sweep": {**POINT, "e": [0.1, 0.5]}, "output": {"variables": ["e_out"]}}
    text = build(impact.sweep(config))
    assert figures(text) == [FIGURES["restitution"], FIGURES["loop"]]
    assert "The figure final-velocities is left out: this result has no v1_post" in text


def test_a_part_of_a_result_is_a_page_too(wide: xr.Dataset) -> None:
    bare = build(wide.drop_vars(["status", "in_domain"]))
    assert "The models are not ranked: this result has no status" in bare
    assert "The result does not contain the status of the points." in bare
    assert figures(bare) == figures(build(wide.transpose()))


def test_a_time_history_is_refused() -> None:
    shot = impact.run(model="hertz").history
    assert shot is not None
    with pytest.raises(UsageError, match="this is a time history"):
        build(shot)


def hostile(evil: Callable[[str], str]) -> xr.Dataset:
    """A result all of whose words are made by a function of what they are."""
    balls = {"e": [0.2, 0.5, 1.0], "v1": [-1.0, 1.0], "m1": [1.0, math.inf], "m2": math.inf}
    steel = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
    result = impact.sweep({
        "models": FAIR, "sweep": {**balls, "R1": 0.1, "R2": 0.1, "material": [evil("a"), evil("b")]},
        "materials": {evil("a"): steel, evil("b"): steel},
    })  # fmt: skip
    for one in (result["e"], result["v1"], result["material"], result["e_error"]):
        one.attrs.update(units=evil("unit"), long_name=evil("name"))
    names = {about: ("model", [evil(f"{about} 1"), evil(f"{about} 2")])
             for about in ("model", "title", "equation", "reference")}  # fmt: skip
    dois = [f"10.1234/{evil('doi').replace(' ', '')}", f"javascript:alert(1)//10.1234/{evil('x')}"]
    plugins = {evil("key"): {"file": evil("file"), "sha256": evil("hash")}}
    return result.assign_coords(**names, doi=("model", dois)).assign_attrs(
        title=evil("title"), config=f"= {evil('config')}\n{evil('more')}", config_set=json.dumps([evil("set")]),
        fingerprint=evil("fingerprint"), packages=json.dumps({evil("numpy"): evil("2")}), reason=evil("why"),
        plugins=json.dumps(plugins), impact_version=evil("version"),
    )  # fmt: skip


EVILS = (
    EVIL,
    "</pre></style></title><img src=x onerror=alert(1)>",
    '" onload="alert(1)" \' onclick=\'alert(1)',
    "--><script src=//evil.example></script><!--",
    "]]></svg><style>*{display:none}</style>&lt;b&gt;&#60;i&#62;",
)


def check_taken_as_text(make: Callable[[Callable[[str], str]], str], evil: str) -> None:
    """A page made with evil words has the elements of one made with harmless ones."""
    elements = []
    for words in (lambda what: f"{what} {evil}", lambda what: f"{what} harmless"):
        seen = Seen(make(words))
        elements.append([(name, attributes.keys()) for name, attributes in seen.elements])
        (link,) = [attributes["href"] for name, attributes in seen.elements if name == "a"]
        assert re.fullmatch(r"https://doi\.org/10\.1234/[\w.~%/-]+", link)
    assert elements[0] == elements[1]


@pytest.mark.parametrize("evil", EVILS)
def test_words_of_a_file_never_become_elements(evil: str) -> None:
    def make(words: Callable[[str], str]) -> str:
        def refused(kind: str, choice: object) -> NoReturn:
            raise UsageError(words(kind))

        return page(hostile(words), refused)

    check_taken_as_text(make, evil)


def test_words_of_a_file_never_become_elements_of_a_picture(tmp_path: Path) -> None:
    def make(words: Callable[[str], str]) -> str:
        impact.save(hostile(words), tmp_path / "result.h5", overwrite=True)
        text = build(impact.load(tmp_path / "result.h5"))
        drawn = pictures(text)
        assert len(drawn) == 5
        for picture in drawn:
            assert {element.tag.rpartition("}")[2] for element in picture.iter()} <= PICTURE | ABOUT
            assert not [name for element in picture.iter() for name in element.attrib if name.startswith("on")]
        return text

    check_taken_as_text(make, EVILS[-1])


def test_words_of_a_file_are_shown_as_they_are() -> None:
    seen = Seen(build(hostile(lambda what: f"{what} {EVIL}")))
    assert seen.text("h1") == seen.text("title").strip() == f"title {EVIL}"
    assert seen.text("pre") == f"= config {EVIL}\nmore {EVIL}"
    for what in ("model 1", "title 2", "equation 1", "reference 2", "unit", "a", "fingerprint", "hash", "set"):
        assert f"{what} {EVIL}" in seen.text("main"), what


def test_what_is_not_seen_is_shown_as_its_escape() -> None:
    text = build(hostile(lambda what: f"{what} \x1b[31m\u202e\u200b"))
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f\u202e\u200b]", text)
    assert "<h1>title \\x1b[31m\\u202e\\u200b</h1>" in text


def test_the_command_writes_the_page(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "results.h5"
    shutil.copy(stored, result)
    done = cli("report", "results.h5", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "")
    written = tmp_path / "results.html"
    size = f"{written.stat().st_size / 1000:,.0f} kB"
    assert done.stderr == f"results.html: 4 figures, {size}\n"
    assert written.read_text(encoding="utf-8") == build(impact.load(stored))
    # a second time it is replaced only where that is asked for
    written.write_text("a note", encoding="utf-8")
    again = cli("report", "results.h5", cwd=tmp_path)
    assert (again.returncode, written.read_text("utf-8")) == (2, "a note")
    assert again.stderr == "results.html: exists; give another name, or overwrite it (--overwrite)\n"
    assert cli("report", "results.h5", "--overwrite", cwd=tmp_path).stderr == done.stderr


def test_the_command_replaces_nothing_that_is_no_page(cli: Run, stored: Path, tmp_path: Path) -> None:
    result = tmp_path / "results.html"
    shutil.copy(stored, result)
    for words, told in (
        (("report", "results.html"), "is the file to be read"),
        (("report", stored, "-o", "results.h5"), "expected a name that ends in .html"),
        (("report", stored, "-o", "no/page.html"), "the folder no does not exist"),
        (("report", "none.h5"), "does not exist"),
    ):
        done = cli(*words, cwd=tmp_path)
        (line,) = done.stderr.splitlines()
        assert (done.returncode, told in line) == (2, True), line
    assert result.read_bytes() == stored.read_bytes()
    assert list(tmp_path.iterdir()) == [result]


# what a page is like in a window of a width; the page is in a frame, since it runs nothing itself
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
  const words = all.filter(one => [...one.childNodes].some(part => part.nodeType === 3 && part.data.trim()));
  const contrasts = words.map(one => {
    const ends = [light(getComputedStyle(one).color), light(behind(one))].sort((a, b) => b - a);
    return (ends[0] + 0.05) / (ends[1] + 0.05);
  });
  return {
    window: frame.clientWidth, page: root.scrollWidth,
    beyond: all.filter(one => one.getBoundingClientRect().right > root.clientWidth + 0.5).map(one => one.tagName),
    scrolling: [...inner.querySelectorAll(".scroll")].filter(one => one.scrollWidth > one.clientWidth).length,
    smallest: Math.min(...words.map(one => parseFloat(getComputedStyle(one).fontSize))),
    contrast: Math.min(...contrasts), paper: getComputedStyle(inner.body).backgroundColor,
    broken: [...inner.images].filter(one => !one.naturalWidth).length,
    figures: [...inner.images].map(one => one.getBoundingClientRect().width),
  };
}
addEventListener("load", () => {
  const found = [...document.querySelectorAll("iframe")].map(measure);
  document.body.replaceChildren();
  document.body.textContent = JSON.stringify(found);
});
"""


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Browser:
    """Open a page in a real browser: its elements once it is loaded, and what came on its console."""
    names = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
    playwright = sorted(Path.home().glob(".cache/ms-playwright/chromium*/*/*chrome*"))
    found = next(filter(None, map(shutil.which, [*names, *map(str, playwright)])), None)
    if found is None:
        pytest.skip("no Chromium here: how the page looks in a browser is not tested")

    def show(text: str, *words: str) -> tuple[str, list[str]]:
        folder = tmp_path_factory.mktemp("browser")
        (folder / "page.html").write_text(text, encoding="utf-8")
        done = subprocess.run(
            [found, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--dump-dom",
             "--hide-scrollbars",
             "--enable-logging=stderr", "--virtual-time-budget=20000", f"--user-data-dir={folder}/profile", *words,
             (folder / "page.html").as_uri()],
            capture_output=True, text=True, encoding="utf-8", timeout=120, check=True,
        )  # fmt: skip
        return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]

    return show


def framed(texts: Sequence[str], widths: Sequence[int]) -> str:
    """A page that measures others in windows of some widths."""
    frames = [f'<iframe srcdoc="{html.escape(text)}" style="border: 0; width: {width}px; height: 900px"></iframe>'
              for text in texts for width in widths]  # fmt: skip
    return f"<!DOCTYPE html><meta charset=utf-8><script>{MEASURE}</script><body>{''.join(frames)}"


def measured(dumped: str) -> Iterator[dict[str, object]]:
    """What MEASURE found."""
    yield from json.loads(html.unescape(dumped.partition("<body>")[2].partition("</body>")[0]))


@pytest.mark.parametrize(("scheme", "is_dark"), [("0", True), ("1", False)])
def test_it_fits_a_phone_and_a_desktop(
    browser: Browser, pages: dict[str, str], wide: xr.Dataset, scheme: str, is_dark: bool
) -> None:
    long = "w" * 500
    words = dict.fromkeys(("title", "config", "fingerprint", "reason", "impact_version"), long)
    about = {name: ("model", [long] * wide.sizes["model"]) for name in ("reference", "equation", "doi")}
    failures = build(impact.load(ROOT / "tests" / "data" / "failures.h5"))
    texts = [*pages.values(), failures, build(wide.assign_attrs(words).assign_coords(about))]
    shown, _ = browser(framed(texts, WINDOWS), f"--blink-settings=preferredColorScheme={scheme}")
    found = list(measured(shown))
    assert [one["window"] for one in found] == len(texts) * list(WINDOWS)
    for one in found:
        is_phone = one["window"] < 400
        assert one["page"] == one["window"]
        assert not is_phone or (one["beyond"], one["scrolling"]) == ([], 0)
        assert one["smallest"] >= 14.0
        assert one["broken"] == 0
        assert one["contrast"] >= 4.5
        assert (one["paper"] != "rgb(255, 255, 255)") == is_dark
        # one figure beside the other where there is room
        assert min(one["figures"]) > 280
        assert max(one["figures"]) < (375 if is_phone else 500)


def test_nothing_is_complained_of(browser: Browser, pages: dict[str, str]) -> None:
    for text in (pages["wide"], build(hostile(lambda what: f"{what} {EVIL}"))):
        shown, console = browser(text)
        assert console == []
        assert shown.count("<figure>") == text.count("<figure>")


def test_even_what_got_into_the_page_would_not_run(browser: Browser, pages: dict[str, str]) -> None:
    evil = "<script>document.title = 'ran'</script><img src=x onerror=\"document.title = 'ran'\">"
    evil += '<img src="http://localhost:9/x.png"><style>@import "http://localhost:9/x.css";</style>'
    shown, console = browser(pages["figure 6"].replace("<main>", f"<main>{evil}"))
    assert "<title>Final velocities comparison</title>" in shown
    refused = " ".join(console)
    assert all(f"'{rule}" in refused or rule in refused for rule in ("default-src", "img-src", "style-src")), (
        console
    )
    # without the policy it does
    policy = f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    shown, _ = browser(pages["figure 6"].replace(policy, "").replace("<main>", f"<main>{evil}"))
    assert "<title>ran</title>" in shown
