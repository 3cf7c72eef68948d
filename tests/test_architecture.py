"""docs/architecture.md names modules and functions that exist, and the steps in their order."""

from __future__ import annotations

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

from .conftest import ROOT
from .test_layers import FLOORS

PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
NAMES = sorted(set(re.findall(r"`(impact\.[\w.]+)`", PAGE)))


@pytest.mark.parametrize("name", NAMES)
def test_a_name_of_the_page_exists(name: str) -> None:
    module, _, attribute = name.rpartition(".")
    try:
        import_module(name)
    except ModuleNotFoundError:
        assert hasattr(import_module(module), attribute), name


def test_the_sixteen_types_stand_in_their_modules() -> None:
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \| `(impact\.[\w.]+)` \|", PAGE, re.MULTILINE)
    # the sixteenth is xarray's
    assert len(rows) == 15
    for types, module in rows:
        for name in re.findall(r"\w+", types):
            assert isinstance(getattr(import_module(module), name), type), name


def test_the_page_draws_the_floors_that_are_tested() -> None:
    table = PAGE.partition("## Six floors")[2].partition("## ")[0]
    rows = dict(re.findall(r"^\| (\w+) \| (.*?) \|", table, re.MULTILINE))
    assert list(rows)[1:] == list(reversed(FLOORS))
    for floor, parts in FLOORS.items():
        drawn = re.findall(r"`(\w+)`", rows[floor])
        assert drawn == [part or "impact" for part in parts if not part.startswith("_") and part != "array_types"]


@pytest.mark.slow
def test_a_value_of_e_takes_the_steps_of_the_page_in_their_order(tmp_path: Path) -> None:
    """Each function of the table is called, the first time in the order of the table, by the two commands."""
    functions = re.findall(r"^\| \d+ \| `(impact\.[\w.]+)` \|", PAGE, re.MULTILINE)
    assert len(functions) == len(re.findall(r"^\| \d+ \|", PAGE, re.MULTILINE)) > 10
    codes = {code_of(name): name for name in functions}
    calls: list[str] = []

    def note(frame: object, event: str, _: object) -> None:
        name = codes.get(frame.f_code) if event == "call" else None  # type: ignore[attr-defined]
        if name and name not in calls:
            calls.append(name)

    import impact
    from impact.results.sweep import read_plan, sweep_into

    sys.setprofile(note)
    try:
        sweep_into(tmp_path / "results.h5", read_plan(ROOT / "configs" / "figure6.toml"))
        impact.plot(impact.load(tmp_path / "results.h5"))
    finally:
        sys.setprofile(None)
    assert calls == functions


def code_of(name: str) -> object:
    """The code of a function, or of what makes a class or its values."""
    module, _, attribute = name.rpartition(".")
    value = getattr(import_module(module), attribute)
    if isinstance(value, type):
        value = value.__new__ if issubclass(value, tuple) else getattr(value, "values", value.__init__)
    return value.__code__
