"""The catalogue of the documentation site in a real browser: filter, sort, open a law, copy its example."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import impact
from impact.contact.frictions import frictions
from impact.contact.models import catalogue
from impact.exporters.registry import CODES

from .conftest import ROOT
from .test_explore_in_jupyterlab import Page, open_browser

# builds pages of the site: `make test-faults` runs it
pytestmark = pytest.mark.slow

SITE_VENV = Path(os.environ.get("SITE_VENV", ROOT / ".venv-site"))
# all pages but these are left out
PAGES = ("models.md", "frictions.md", "export.md", "reference/models/*", "reference/frictions/*")
WIDTHS = {"phone": 400, "laptop": 1280}
KEYS = "[...document.querySelectorAll('.catalogue tbody tr:not([hidden]) a[id]')].map(anchor => anchor.id)"
# choose in the list or type in the field of a label
SET = """
((label, value) => {
  const labels = [...document.querySelectorAll('.catalogue-controls label')];
  const control = labels.find(one => one.textContent.startsWith(label)).querySelector('select, input');
  control.value = value;
  control.dispatchEvent(new Event('input', {bubbles: true}));
})
"""
HEAD = "[...document.querySelectorAll('.catalogue th button')].find(button => button.textContent == '%s')"
# the widths of the window and the page, and the cells of a law that reach beyond the window
LAYOUT = """
(key => {
  const cells = [...document.getElementById(key).closest('tr').cells];
  const boxes = cells.map(cell => cell.getBoundingClientRect());
  return {
    page: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    cells: cells.length,
    outside: boxes.filter(box => box.left < 0 || box.right > document.documentElement.clientWidth).length,
    height: Math.max(...boxes.map(box => box.bottom)) - Math.min(...boxes.map(box => box.top)),
  };
})
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages of the catalogue and of the laws, as the site has them: of a site built before, or built here."""
    if "BUILT_SITE" in os.environ:
        return ROOT / os.environ["BUILT_SITE"]
    builder = SITE_VENV / "bin" / "sphinx-build"
    if not builder.exists():
        pytest.skip(f"no {builder}: `make site` makes it; how the catalogue acts in a browser is not tested")
    folder = tmp_path_factory.mktemp("site")
    # the build writes its generated pages beside its sources
    for name in ("docs", "scripts", "src", "configs", "CHANGELOG.md", "SECURITY.md"):
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("reference", "notebooks"))
        else:
            shutil.copy(ROOT / name, folder)
    # links to pages that are left out are no concern here
    quiet = "-D", "suppress_warnings=misc.highlighting_failure,myst.xref_missing,toc"
    subprocess.run(
        [
            builder,
            "-q",
            "-b",
            "html",
            *quiet,
            "-D",
            f"include_patterns=index.md,{','.join(PAGES)}",
            "docs",
            "html",
        ],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder / "src")},
        capture_output=True,
        check=True,
        timeout=600,
    )
    return folder / "html"


@pytest.fixture(scope="module")
def page(chromium: str, site: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A page of a browser."""
    with open_browser(chromium, tmp_path_factory.mktemp("profile")) as page:
        # a page without the focus has no clipboard
        page.call("Emulation.setFocusEmulationEnabled", enabled=True)
        page.call("Browser.grantPermissions", permissions=["clipboardReadWrite"])
        yield page


def go_to(page: Page, path: Path, anchor: str = "") -> None:
    page.call("Page.navigate", url="about:blank")
    open_page(page, path.as_uri() + anchor)


def open_page(page: Page, address: str) -> None:
    # an evaluation during a navigation would fail, as after a click
    page.call("Page.navigate", url=address)
    page.wait_for("document.readyState == 'complete' && location.protocol == 'file:'")


@pytest.fixture
def table(page: Page, site: Path) -> Page:
    """The catalogue, at the width of a laptop."""
    page.resize(WIDTHS["laptop"], 900)
    go_to(page, site / "models.html")
    return page


def choose(page: Page, label: str, value: str) -> list[str]:
    """Choose in a list or type in the field; return the keys of the laws that are shown."""
    page.evaluate(f"{SET}({json.dumps(label)}, {json.dumps(value)})")
    keys: list[str] = page.evaluate(KEYS)
    return keys


def test_every_law_has_a_row(table: Page, site: Path) -> None:
    assert table.evaluate(KEYS) == list(catalogue())
    go_to(table, site / "frictions.html")
    assert table.evaluate(KEYS) == list(frictions())


def test_lists_and_words_choose_laws_together(table: Page) -> None:
    laws = catalogue().values()
    assert choose(table, "family", "dashpot") == [law.key for law in laws if law.family == "dashpot"]
    takes_e = [law.key for law in laws if law.family == "dashpot" and "e" in law.quantities]
    assert choose(table, "takes e", "yes") == takes_e != []
    table.evaluate("document.querySelector('.catalogue-controls [type=reset]').click()")
    table.wait_for(f"{KEYS}.length == {len(laws)}")
    disputed = [law.key for law in laws if law.evidence.state == "disputed"]
    assert choose(table, "evidence", "disputed") == disputed != []
    assert table.evaluate("document.querySelector('.catalogue output').value") == f"{len(disputed)} of {len(laws)}"
    choose(table, "evidence", "")
    assert set(choose(table, "in codes", "lammps")) >= set(CODES["lammps"].laws)
    choose(table, "in codes", "")
    assert choose(table, "adhesive", "yes") == ["luding-2008", "jkr-1971", "liggghts-edinburgh"]
    choose(table, "adhesive", "no")
    assert choose(table, "search", "Kuwabara viscoelastic nothing") == []
    assert choose(table, "search", "viscoelastic  KUWABARA") == ["kuwabara-kono-1987", "kuwabara-kono-at-speed"]
    assert choose(table, "depends on speed", "no") == []


def test_a_click_on_a_heading_sorts_and_another_reverses(table: Page) -> None:
    table.evaluate(f"{HEAD % 'law'}.click()")
    assert table.evaluate(KEYS) == sorted(catalogue())
    table.evaluate(f"{HEAD % 'law'}.click()")
    assert table.evaluate(KEYS) == sorted(catalogue(), reverse=True)
    choose(table, "sorted by", "largest error")
    column = "[...document.querySelectorAll('.catalogue td[data-label=\"largest error\"]')]"
    errors = table.evaluate(f"{column}.map(cell => parseFloat(cell.innerText)).filter(x => !isNaN(x))")
    assert errors == sorted(errors)
    assert errors[0] == 0.0
    assert table.evaluate(f"{column}.at(-1).innerText").startswith("–")
    families = choose(table, "sorted by", "as published")
    assert families == list(catalogue())


def is_in_upper_half(key: str) -> str:
    """Whether the row of a law begins in the upper half of the window, which has 900 px."""
    top = f"document.getElementById('{key}').getBoundingClientRect().top"
    return f"{top} >= 0 && {top} < 450"


@pytest.mark.parametrize("width", WIDTHS)
def test_a_link_shows_the_row_of_a_law_as_a_whole(page: Page, site: Path, width: str) -> None:
    page.resize(WIDTHS[width], 900)
    go_to(page, site / "models.html", "#luding-2008")
    page.wait_for("scrollY > 1000")
    layout = page.settled(f"{LAYOUT}('luding-2008')")
    assert layout["cells"] == 10
    assert (layout["page"], layout["outside"]) == (0, 0)
    assert layout["height"] < 900
    page.wait_for(is_in_upper_half("luding-2008"))
    assert page.settled(is_in_upper_half("luding-2008"))
    # also where the table does not show it
    choose(page, "family", "dashpot")
    page.evaluate("location.hash = '#jkr-1971'")
    page.wait_for(f"{KEYS}.includes('jkr-1971')")
    page.wait_for(is_in_upper_half("jkr-1971"))
    assert page.settled(is_in_upper_half("jkr-1971"))


def test_the_columns_of_a_laptop_have_room_for_their_words(table: Page) -> None:
    cells = "[...document.querySelectorAll('.catalogue td:last-child')]"
    assert table.settled(f"Math.min(...{cells}.map(cell => cell.clientWidth))") >= 125
    # the median of the rows is not much higher than the curve of a law and its names
    rows = "[...document.querySelectorAll('.catalogue tbody tr')].map(row => row.offsetHeight)"
    heights = sorted(table.evaluate(rows))
    assert heights[len(heights) // 2] < 225
    # names are not broken within a word
    families = "[...document.querySelectorAll('.catalogue td[data-label=\"family\"] a')]"
    assert table.evaluate(f"Math.max(...{families}.map(link => link.getClientRects().length))") <= 2


def test_a_law_opens_and_its_example_is_copied_and_runs(table: Page) -> None:
    # a law with a parameter without a default
    link = "document.getElementById('kuwabara-kono-1987').closest('tr').querySelector('a code').closest('a')"
    open_page(table, table.evaluate(f"{link}.href"))
    table.wait_for("document.querySelector('h1')?.textContent.startsWith('kuwabara-kono-1987')")
    assert table.evaluate("!!document.querySelector('svg.curve polyline')")
    assert "@article{kuwabara-kono-1987" in table.evaluate(
        "document.querySelector('.highlight-bibtex').textContent"
    )
    button = "document.querySelector('.highlight-toml .copybtn')"
    table.wait_for(f"!!{button}")
    table.call("Runtime.evaluate", expression=f"{button}.click()", userGesture=True)
    config = tomllib.loads(table.wait_for("navigator.clipboard.readText()"))
    assert config["models"] == ["kuwabara-kono-1987"]
    result = impact.sweep(config)
    assert 0.0 < float(result["e_out"].min()) < float(result["e_out"].max()) < 1.0
    back = "[...document.querySelectorAll('article a')].find(link => link.textContent.includes('catalogue'))"
    open_page(table, table.evaluate(f"{back}.href"))
    table.wait_for("location.hash == '#kuwabara-kono-1987' && scrollY > 1000")
