"""`impact cite`: BibTeX of laws and of results."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import impact

from .conftest import ROOT, Run

ENTRY = re.compile(r"@(article|misc)\{([\w.-]+),\n((?:  [a-z]+ = \{.*\},\n)+)\}")


def test_the_bibtex_of_the_catalogue_has_each_law_once_and_balanced_braces() -> None:
    laws = [*impact.models(), *impact.frictions()]
    text = "\n\n".join(citation.bibtex for citation in impact.cite(*laws))
    entries = ENTRY.findall(text)
    assert "\n\n".join(f"@{kind}{{{key},\n{fields}}}" for kind, key, fields in entries) == text
    keys = [key for _, key, _ in entries]
    assert len(set(keys)) == len(keys)
    assert set(laws) <= set(keys)
    for _, key, fields in entries:
        shown = re.sub(r"\\[{}&%$#_]|\$[^$]+\$", "", fields)
        assert shown.count("{") == shown.count("}"), key
        assert not re.search(r"[&%$#_]", shown), key
        # the authors are not a part of another field
        assert "and others (" not in fields.partition("annote")[0], key


def test_bibtex_has_no_character_that_pdflatex_refuses() -> None:
    text = str(impact.cite(*impact.models(), *impact.frictions()))
    assert not re.findall(r"[^\n -~À-ž]", text)
    assert r"the damping exponents m$_2$ = 1" in text
    assert r"whose $\alpha$ has 2 in the place of $\surd$5" in text


def test_the_evidence_is_in_a_field_that_styles_do_not_print() -> None:
    text = str(impact.cite("hertz"))
    assert "  annote = {formula seen in Gharib" in text
    assert "  note" not in text


def test_a_doi_stands_in_the_entry_of_its_paper() -> None:
    (goldsmith,) = impact.cite("kelvin-voigt")
    first, second = goldsmith.bibtex.split("\n\n")
    assert "Cundall" in first
    assert "geot.1979" in first
    assert "doi" not in second


def test_a_law_of_a_code_has_the_year_the_place_and_the_address_of_the_version_that_was_read() -> None:
    text = str(impact.cite("lammps-mindlin"))
    assert "  howpublished = {lammps/lammps, src/GRANULAR/gran\\_sub\\_mod\\_tangential.cpp @079d233c" in text
    assert "  year = {2026},\n  url = {https://github.com/lammps/lammps},\n" in text
    # a remark after the reference is no work to cite
    assert "mbdyn-flores-2" not in str(impact.cite("mbdyn-flores"))
    assert "no damping at a speed of contact" in str(impact.cite("mbdyn-flores"))


def test_the_program_is_cited_as_in_its_citation_file() -> None:
    (program,) = impact.cite("impact")
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    for field in ("title", "  - name", "version"):
        value = re.search(rf'^{field}: "?(.+?)"?$', text, re.MULTILINE)
        assert value, field
        assert value[1] in program.bibtex


@pytest.mark.slow
def test_a_result_cites_all_of_its_laws(tmp_path: Path, cli: Run) -> None:
    config = {
        "models": ["tsuji-1992", "hertz"],
        "frictions": ["coulomb-1785"],
        "sweep": {"e": 0.5, "v1": 1.0, "angle": "30 deg", "mu": 0.1, "m1": 1.0, "m2": 1.0, "K": 1e6, "R1": 0.01},
    }
    result = impact.sweep(config)
    impact.save(result, tmp_path / "r.h5")
    done = cli("cite", str(tmp_path / "r.h5"), "jkr-1971", "--json")
    cited = json.loads(done.stdout)
    assert [citation["model"] for citation in cited] == ["tsuji-1992", "hertz", "coulomb-1785", "jkr-1971"]
    assert cited[0]["evidence"]["state"] == "seen"
    assert cited[:3] == impact.cite(result).as_list() == list(impact.cite(result).as_dict().values())
    assert impact.cite(result).as_dict()["hertz"]["evidence"]["state"] == "seen"


def test_a_result_asks_for_the_file_of_a_law_of_the_user(tmp_path: Path, cli: Run) -> None:
    fields = 'title="Mine", year=2026, equation="", reference="a report", chi=lambda e: 1 - e'
    law = f'from impact import hysteresis\nMINE = hysteresis("mine", {fields})\n'
    (tmp_path / "law.py").write_text(law, encoding="utf-8")
    config = {"models": ["mine"], "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6}}
    impact.save(impact.sweep(config, plugins=[tmp_path / "law.py"]), tmp_path / "r.h5")
    done = cli("cite", "r.h5", cwd=tmp_path)
    expected = "r.h5: made with mine of law.py; give it again with --plugin FILE\n"
    assert (done.returncode, done.stderr) == (2, expected)
    assert "@misc{mine," in cli("cite", "r.h5", "--plugin", "law.py", cwd=tmp_path).stdout


def test_an_unknown_law_is_named(cli: Run) -> None:
    done = cli("cite", "hertx")
    assert done.returncode == 2
    assert done.stderr == 'no law "hertx"; did you mean "hertz"?\n'
    with pytest.raises(impact.ImpactError, match="got none"):
        impact.cite()
