"""The tutorials and the README print what their commands print, and the index of the site has every page."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from .conftest import ROOT, Run, assert_same_output, code_blocks, examples_of

DOCS = ROOT / "docs"
PAGES = [
    *(str(page.relative_to(ROOT)) for page in sorted((DOCS / "tutorials").glob("*.md"))),
    "README.md",
    "docs/calibrate.md",
    "docs/uncertainty.md",
]


@pytest.mark.parametrize(
    ("command", "printed"),
    [
        pytest.param(*example, id=f"{page}: {example[0]}", marks=() if "uncertainty" in page else pytest.mark.slow)
        for page in PAGES
        for example in examples_of(page)
    ],
)
def test_a_page_prints_what_its_commands_print(cli: Run, tmp_path: Path, command: str, printed: str) -> None:
    """Numbers may differ in the last digit that is printed; errors of the solver are below 1e-9."""
    # an output that is not named is written into the folder
    for path in ("docs", "configs"):
        (tmp_path / path).symlink_to(ROOT / path)
    done = cli(*shlex.split(command), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert_same_output(done.stdout, printed)


@pytest.mark.slow
def test_the_commands_of_a_figure_for_a_paper(cli: Run, tmp_path: Path) -> None:
    text = (DOCS / "tutorials" / "paper.md").read_text(encoding="utf-8")
    (config,) = code_blocks(text, "toml")
    (tmp_path / "contact.toml").write_text(config, encoding="utf-8")
    for block in code_blocks(text, "sh"):
        for line in block.splitlines():
            done = cli(*shlex.split(line)[1:], cwd=tmp_path)
            assert done.returncode == 0, (line, done.stderr)
    assert {path.name for path in tmp_path.iterdir()} >= {"contact.h5", "restitution.pdf", "restitution.csv"}


def test_the_index_of_the_site_has_every_page() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = {line for block in code_blocks(index, "{toctree}") for line in block.splitlines()}
    files = (*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb"))
    pages = {page.relative_to(DOCS).with_suffix("").as_posix() for page in files} - {"index"}
    generated = {page for page in pages if page.startswith("reference/")}
    assert pages - generated <= listed
    assert {page for page in listed if page and not page.startswith((":", "reference/"))} <= pages
