"""docs/paper.md lists every equation once, every name in it exists, and its numbers are those of the program."""

from __future__ import annotations

import re

import numpy as np
import pytest

import impact
from impact.config.tables import SWEEP_QUANTITIES
from impact.contact.variables import HISTORY, OUTPUTS
from impact.results.single_impact import DERIVED_QUANTITIES

from .conftest import ROOT

PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
TABLE_1 = {"v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": 1.0, "material": "table1"}
MATERIALS = {
    "table1": {"E": 56e9, "nu": 0.3, "rho": 2712},
    "rubber": {"E": "5 MPa", "nu": 0.49, "rho": 1100},
}
# the laws of the claims, by equation
LAWS = {
    "(22)": "lankarani-nikravesh-1990",
    "(28)": "gharib-hurmuzlu-2012",
    "(19)": "hunt-crossley-1975",
    "(29)-(32)": "lankarani-nikravesh-1994",
    "(33)-(42)": "gharib-hurmuzlu-2012-energetic",
    "(43)": "bilinear",
    "(23)": "exact-hysteresis",
}


def table_rows(section: str) -> list[list[str]]:
    """The cells of the first table of a section, without its head."""
    text = PAGE.split(f"\n## {section}\n")[1].split("\n## ")[0]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_every_equation_is_listed_once() -> None:
    numbers: list[int] = []
    for equation, *_ in table_rows("Equations"):
        for first, last in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", equation):
            numbers += range(int(first), int(last or first) + 1)
    assert numbers == list(range(1, 44))


def test_the_names_on_the_page_exist() -> None:
    known = OUTPUTS.keys() | HISTORY.keys() | SWEEP_QUANTITIES.keys() | {name for name, *_ in DERIVED_QUANTITIES}
    known |= impact.models().keys() | {"e_kinematic"}
    for section in ("Equations", "Table 1"):
        for row in table_rows(section):
            for name in re.findall(r"`([^`]+)`", " ".join(row)):
                assert name.startswith("impact ") or name in known, name


def test_table_1() -> None:
    values = dict(table_rows("Table 1"))
    collision = impact.run(model="hertz")
    for description, value in values.items():
        name = re.findall("`(.*)`", description)[0]
        digits = len(value.split("e")[0].replace(".", "").lstrip("0"))
        number = {**collision.values, **collision.derived}[name]
        assert float(f"{number:.{digits - 1}e}") == float(value), name


@pytest.mark.parametrize("claim", table_rows("Claims"), ids=lambda claim: claim[0])
def test_the_largest_error_of_a_claim_is_the_printed_number(claim: list[str]) -> None:
    claim_text, interval, printed = claim
    low, high = map(float, interval.split(" to "))
    sweep = {"e": {"linspace": [low, high, 101]}, **TABLE_1}
    result = impact.sweep({"models": LAWS[claim_text.split()[0]], "sweep": sweep, "materials": MATERIALS})
    max_error = np.abs(result["e_error"]).max().item()
    if float(printed) < 1e-9:
        assert max_error < float(printed) < 100 * max_error
    else:
        assert f"{max_error:.4f}" == printed


@pytest.mark.slow
def test_restitution_is_independent_of_masses_speeds_and_materials() -> None:
    (count, bound) = re.findall(r"Over (\d+) impacts .*? less than ([\d.e-]+)\.", PAGE, re.DOTALL)[0]
    family = [key for equation, key in LAWS.items() if equation in ("(19)", "(22)", "(23)", "(28)")]
    result = impact.sweep(
        {
            "models": [*family, "herbert-mcwhannell-1977", "lee-wang-1983"],
            "sweep": {
                "e": [0.1, 0.5, 0.9],
                "v1": [0.01, 1.0, 100.0],
                "v2": [-1.0, 0.0],
                "m1": 1.0,
                "m2": [0.01, 1.0, np.inf],
                "n": [1.0, 1.5, 2.0],
                "material": list(MATERIALS),
            },
            "materials": MATERIALS,
            "solver": {"collapse": False},
        }
    )["e_out"]
    assert result.size == int(count)
    varied = [dim for dim in result.dims if dim not in ("model", "e")]
    spread = (result.max(varied) - result.min(varied)).max().item()
    assert spread < float(bound) < 100 * spread


def test_restitutions_at_the_limits_are_the_printed_numbers() -> None:
    limits = re.findall(r"\((\d+)\) delivers an e_out of (\d\.\d+)", PAGE)
    assert limits == [("22", "0.663"), ("28", "0.594")]
    for (equation, value), e in zip(limits, (0.0, 1.0), strict=True):
        collision = impact.run(model=LAWS[f"({equation})"], at={"e": e})
        assert f"{collision.values['e_out']:.3f}" == value


def test_pictures_exist_and_are_small() -> None:
    for figure in ("2", "3", "5a", "5b", "5c"):
        assert f"(paper/figure{figure}.svg)" in PAGE
        assert (ROOT / "docs" / "paper" / f"figure{figure}.svg").stat().st_size < 62_000
        assert f"(../configs/figure{figure}.toml)" in PAGE
