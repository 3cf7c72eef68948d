"""The generated pages of docs are what their generators write now."""

from __future__ import annotations

import re
import sys

import pytest

from .conftest import ROOT

sys.path.insert(0, str(ROOT / "scripts"))
from make_docs import PAGES

# these pages integrate laws without a closed form, and slips, or call all functions, which takes a while
SLOW = {"models.md", "frictions.md", "types.md", "codes.md"}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in PAGES]
)
def test_a_generated_page_is_fresh(name: str) -> None:
    assert (ROOT / "docs" / name).read_text(encoding="utf-8") == PAGES[name](), "run `make docs`"


def test_the_restitution_of_a_linear_spring_and_dashpot_in_a_code_does_not_depend_on_the_speed() -> None:
    page = (ROOT / "docs" / "codes.md").read_text(encoding="utf-8")
    laws = "kelvin-voigt.*|newton-.*|lammps-.*velocity-hooke.*"
    rows = re.findall(rf"`({laws})` \| (\S+) \| (\S+) \|$", page, re.MULTILINE)
    assert len(rows) == 10
    assert all(e == slow for _, e, slow in rows)
