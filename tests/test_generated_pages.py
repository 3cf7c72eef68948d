"""The generated pages of docs are what their generators write now."""

from __future__ import annotations

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
