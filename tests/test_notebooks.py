"""The notebooks of the documentation run, and give the outputs that they show."""

from __future__ import annotations

import re
import sys
from base64 import b64encode
from pathlib import Path

import nbformat
import pytest
import xarray as xr
from matplotlib.colors import same_color
from nbformat.v4 import new_code_cell, new_notebook, new_output

import impact
from impact.plots.layout import Picture

from .conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
from notebooks import NOTEBOOKS, as_stored, executed, texts

PATHS = sorted(NOTEBOOKS.glob("*.ipynb"))


def test_there_is_a_notebook_for_each_question_and_each_has_its_pictures() -> None:
    assert [path.stem for path in PATHS] == [
        "calibrate",
        "figure6",
        "prepare",
        "spin",
        "teaching",
        "uncertainty",
        "which-law",
    ]
    for path in PATHS:
        shown = texts(nbformat.read(path, as_version=4))
        assert ["picture"] in shown, path.name
        assert path.stat().st_size < 500_000, path.name


def test_a_cell_has_the_text_of_its_picture_for_screen_readers() -> None:
    figure = Picture(1.0, "Loop")
    png, metadata = figure._repr_png_()
    data = {"image/png": b64encode(png).decode()}
    output = new_output("display_data", data, metadata={"image/png": metadata})
    (cell,) = as_stored(new_notebook(cells=[new_code_cell(outputs=[output])])).cells
    assert cell.metadata == {"mystnb": {"image": {"alt": "Loop"}}}


def test_a_notebook_calls_the_controls_and_shows_a_picture_of_them() -> None:
    sources = [cell.source for cell in nbformat.read(NOTEBOOKS / "teaching.ipynb", as_version=4).cells]
    (call,) = (
        number for number, source in enumerate(sources) if "impact.explore(" in source and "![" not in source
    )
    picture = re.fullmatch(r"!\[.+\]\((.+)\)", sources[call + 1])
    assert picture
    assert (NOTEBOOKS / picture[1]).is_file()


def test_the_notebook_of_figure_6_describes_the_lines_of_its_picture(figure6: xr.Dataset) -> None:
    text = (NOTEBOOKS / "figure6.ipynb").read_text(encoding="utf-8")
    assert (
        "thick solid lines are the solution by impulse and momentum; a line with markers is that of a law" in text
    )
    (axes,) = impact.plot(figure6).axes
    for line in axes.lines:
        is_reference = line.get_label() == "_Impulse-momentum"
        is_black = same_color(line.get_color(), "black")
        assert (is_black, line.get_linestyle() == "-") == (is_reference, is_reference)
        assert (line.get_marker() == "None") == is_reference
        assert is_reference == (line.get_linewidth() == max(line.get_linewidth() for line in axes.lines))


@pytest.mark.slow
@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_a_notebook_gives_what_it_shows(path: Path) -> None:
    if path.stem == "prepare":
        for library in ("lmfit", "emcee"):
            pytest.importorskip(library, reason="the notebook shows lmfit and emcee")
    assert texts(executed(path)) == texts(nbformat.read(path, as_version=4))
