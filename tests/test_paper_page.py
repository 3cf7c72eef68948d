"""docs/paper.md covers every equation once, names what exists, and its numbers are what the program computes."""

from __future__ import annotations

import re

import numpy as np
import pytest

import impact
from impact.config.tables import SWEEP_QUANTITIES
from impact.results.schema import HISTORY_VARIABLES, SCHEMA
from impact.results.single_impact import DERIVED_QUANTITIES

from .conftest import ROOT, Run

PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
TABLE_1 = {"v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": 1.0, "material": "table1"}
MATERIALS = {
    "table1": {"E": 56e9, "nu": 0.3, "rho": 2712},
    "rubber": {"E": "5 MPa", "nu": 0.49, "rho": 1100},
}
# the law of each claim, by its equation
LAWS = {
    "(22)": "lankarani-nikravesh-1990",
    "(28)": "gharib-hurmuzlu-2012",
    "(19)": "hunt-crossley-1975",
    "(29)-(32)": "lankarani-nikravesh-1994",
    "(33)-(42)": "gharib-hurmuzlu-2012-energetic",
    "(43)": "bilinear",
    "(23)": "exact-hysteresis",
}


def rows(section: str) -> list[list[str]]:
    """The cells of the first table of a section, without its head."""
    text = PAGE.split(f"\n## {section}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_every_equation_is_there_once() -> None:
    numbers: list[int] = []
    for equation, *_ in rows("Equations"):
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", equation):
            numbers += range(int(first), int(last or first) + 1)
    assert numbers == list(range(1, 44))


def test_what_the_page_names_exists() -> None:
    known = (
        {one.name for one in SCHEMA}
        | {name for name, *_ in (*DERIVED_QUANTITIES, *HISTORY_VARIABLES)}
        | SWEEP_QUANTITIES.keys()
    )
    known |= impact.models().keys() | {"e_kinematic"}
    for section in ("Equations", "Table 1"):
        for row in rows(section):
            for name in re.findall(r"`([^`]+)`", " ".join(row)):
                assert name.startswith("impact ") or name in known, name


def test_table_1(cli: Run) -> None:
    values = dict(rows("Table 1"))
    shot = impact.run(model="hertz")
    for about, value in values.items():
        name = re.findall("`(.*)`", about)[0]
        digits = len(value.split("e")[0].replace(".", "").lstrip("0"))
        number = {**shot.values, **shot.derived}[name]
        assert float(f"{number:.{digits - 1}e}") == float(value), name


@pytest.mark.parametrize("claim", rows("Claims"), ids=lambda claim: claim[0])
def test_a_claim(claim: list[str]) -> None:
    words, interval, printed = claim
    low, high = map(float, interval.split(" to "))
    sweep = {"e": {"linspace": [low, high, 101]}, **TABLE_1}
    result = impact.sweep({"models": LAWS[words.split()[0]], "sweep": sweep, "materials": MATERIALS})
    largest = np.abs(result["e_error"]).max().item()
    if float(printed) < 1e-9:
        assert largest < float(printed) < 100 * largest
    else:
        # rounded up
        assert float(printed) - 1e-4 < largest < float(printed)


def test_restitution_is_independent_of_masses_speeds_and_materials() -> None:
    (impacts, bound) = re.findall(r"Over (\d+) impacts .*? less than ([\d.e-]+)\.", PAGE, re.DOTALL)[0]
    family = [key for equation, key in LAWS.items() if equation in ("(19)", "(22)", "(23)", "(28)")]
    result = impact.sweep(
        {
            "models": [*family, "herbert-mcwhannell-1977", "lee-wang-1983"],
            "sweep": {
                "e": [0.1, 0.5, 0.9], "v1": [0.01, 1.0, 100.0], "v2": [-1.0, 0.0], "m1": 1.0,
                "m2": [0.01, 1.0, np.inf], "n": [1.0, 1.5, 2.0], "material": list(MATERIALS),
            },
            "materials": MATERIALS,
            "solver": {"collapse": False},
        }
    )["e_out"]  # fmt: skip
    assert result.size == int(impacts)
    varied = [dim for dim in result.dims if dim not in ("model", "e")]
    spread = (result.max(varied) - result.min(varied)).max().item()
    assert spread < float(bound) < 100 * spread


def test_the_limits() -> None:
    found = re.findall(r"\((\d+)\) delivers (\d\.\d+)", PAGE)
    assert found == [("22", "0.663"), ("28", "0.594")]
    for (equation, value), e in zip(found, (0.0, 1.0), strict=True):
        shot = impact.run(model=LAWS[f"({equation})"], at={"e": e})
        assert f"{shot.values['e_out']:.3f}" == value


def test_pictures_are_there_and_small() -> None:
    for figure in ("2", "3", "5a", "5b", "5c"):
        assert f"(paper/figure{figure}.svg)" in PAGE
        assert (ROOT / "docs" / "paper" / f"figure{figure}.svg").stat().st_size < 62_000
        assert f"(../configs/figure{figure}.toml)" in PAGE
