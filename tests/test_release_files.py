"""The files around a release agree with the package: recipe, citation, paper, stability and security."""

from __future__ import annotations

import importlib.util
import re
import tomllib

import pytest
import yaml

import impact
from impact.cli import exits
from impact.config import columns, files, grid, quantities
from impact.results import netcdf
from impact.results.schema import SCHEMA_VERSION

from .conftest import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def read(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_the_recipe_has_the_version_the_dependencies_and_the_programs_of_the_package() -> None:
    recipe = read("recipe/meta.yaml")
    template, settings = re.subn(r"^{% set version = .* %}$", "", recipe, flags=re.MULTILINE)
    assert settings == 1
    assert f'{{% set version = "{impact.__version__}" %}}' in recipe
    values = yaml.safe_load(
        template.replace("{{ version }}", impact.__version__).replace("{{ PYTHON }}", "python")
    )
    # conda-forge splits matplotlib, and its base has no toolkit of a desktop
    expected = {re.sub(r"^matplotlib>", "matplotlib-base>", name) for name in PROJECT["dependencies"]}
    expected.add(f"python{PROJECT['requires-python']}")
    assert {name.replace(" ", "") for name in values["requirements"]["run"]} == expected
    scripts = [f"{name} = {function}" for name, function in PROJECT["scripts"].items()]
    assert values["build"]["entry_points"] == scripts
    assert (values["about"]["summary"], values["about"]["license"]) == (PROJECT["description"], PROJECT["license"])


@pytest.mark.parametrize(
    ("name", "schema"),
    [
        (".github/workflows/ci.yml", "github-workflows"),
        ("action.yml", "github-actions"),
        ("CITATION.cff", "citation-file-format"),
    ],
)
def test_a_file_that_others_read_has_their_format(name: str, schema: str) -> None:
    # which is slow to import
    import check_jsonschema

    words = ["--builtin-schema", f"vendor.{schema}", str(ROOT / name)]
    assert check_jsonschema.main(words, standalone_mode=False) == 0


def test_the_citation_names_the_license_of_the_package() -> None:
    assert yaml.safe_load(read("CITATION.cff"))["license"] == PROJECT["license"]


def test_the_workflow_has_the_stages_of_the_local_run_and_all_interpreters() -> None:
    jobs = yaml.safe_load(read(".github/workflows/ci.yml"))["jobs"]
    lines = re.findall(
        r"^(?:stage|   ) make (?:-j\d )?(?:--output-sync=target )?(.*)$", read(".ci/run"), re.MULTILINE
    )
    # several targets at a time, or one with options
    stages = {f"make {target}" for line in lines for target in ([line] if "=" in line else line.split())}
    commands = {*jobs["stage"]["strategy"]["matrix"]["command"], jobs["check"]["steps"][-1]["run"]}
    # without make, which Windows lacks
    (test,) = re.findall(r"^test:.*\n\t\$\(BIN\)/(.*)$", read("Makefile"), re.MULTILINE)
    assert jobs["test"]["steps"][-1]["run"] == test
    # wheels that are installed ahead
    assert commands == stages - {"make test", "make peers"} | {"make release-check"}
    assert jobs["long"]["steps"][-1]["run"] == "make test-long"
    matrix = jobs["test"]["strategy"]["matrix"]
    assert {job["os"].partition("-")[0] for job in matrix["include"]} == {"windows", "macos"}
    assert f">={matrix['python'][0]}" == PROJECT["requires-python"]


def test_the_release_check_finds_another_version() -> None:
    path = ROOT / "scripts" / "check_release.py"
    spec = importlib.util.spec_from_file_location("check_release", path)
    assert spec is not None
    assert spec.loader is not None
    check_release = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(check_release)
    assert check_release.version_problems(impact.__version__) == []
    assert len(check_release.version_problems("0.0.7")) == 2
    assert "package 0.0.7" in check_release.changelog_note("0.0.7")


def test_the_paper_cites_what_its_bibliography_has_and_states_numbers_of_the_catalogue() -> None:
    paper, references = read("paper.md"), read("paper.bib")
    assert set(re.findall(r"@([a-z]+\d{4})", paper)) == set(
        re.findall(r"^@article{(\w+),", references, re.MULTILINE)
    )
    # the DOIs are those of the catalogue, which names where each was read
    documented = read("docs/models.md") + read("docs/paper.md")
    for doi in re.findall(r"doi     = {(.*)}", references):
        assert doi in documented
    counts = re.search(r"The (\d+) entries are (\d+) seen", read("docs/models.md"))
    assert counts is not None
    assert f"Of the {counts[1]} entries the formulas of {counts[2]} were read" in re.sub(r"\s+", " ", paper)
    for number in ("0.0132", "0.0181", "0.663"):
        assert number in read("docs/paper.md")
        assert number in paper
    for number in ("1,840", "11,950", "20,246"):
        assert number in read("docs/performance.md")


def test_a_config_of_the_docs_counts_the_values_of_its_file() -> None:
    count = re.match(r"# (\d+) measured restitutions of two HDPE beads", read("docs/calibrate/hdpe.toml"))
    assert count is not None
    assert int(count[1]) == len(read("docs/calibrate/hdpe.csv").split()) - 1


def test_the_page_on_stability_lists_the_exit_codes_and_the_schema_version() -> None:
    page = read("docs/stability.md")
    listed = {int(code) for row in re.findall(r"^\| ([\d, ]+) \|", page, re.MULTILINE) for code in row.split(", ")}
    assert listed == {value for name, value in vars(exits).items() if name.startswith("EXIT_")}
    assert f"now {SCHEMA_VERSION}," in page


def test_the_limits_of_the_page_on_security_are_those_of_the_code() -> None:
    page = read("SECURITY.md")
    for number in (
        netcdf.MAX_COMPRESSION_RATIO,
        netcdf.MAX_DATASETS,
        netcdf.MAX_ATTRIBUTES,
        quantities.MAX_AXIS_VALUES,
    ):
        assert f"{number:,}" in page
    assert f"{netcdf.MAX_CHUNKS_OF_FILE:,} |" in page
    assert f"| {netcdf.MAX_ATTRIBUTE_VALUES}, {netcdf.MAX_ATTRIBUTE_BYTES // 10**6} MB |" in page
    assert f"| labels | {netcdf.MAX_LABEL_BYTES // 10**6} MB |" in page
    assert f"{netcdf.ALWAYS_ALLOWED_BYTES // 2**20} MiB" in page
    assert f"| CSV table | {columns.MAX_CSV_BYTES // 10**6} MB |" in page
    assert f"| config | {files.MAX_CONFIG_BYTES // 10**6} MB, {files.MAX_DEPTH} levels" in page
    assert f"{quantities.MAX_UNIT_LENGTH} characters" in page
    assert f"10,000,000, {grid.MAX_AXES} |" in page
