"""The examples of docs/extending.md work, user-defined laws are checked, and installed packages provide laws."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import impact
from impact.engine.plugins import installed, read_plugins
from impact.errors import ModelError

from .conftest import ROOT, Run, assert_refused, code_blocks
from .fork_server import CompletedCommand, ForkServer

PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BROKEN = """
from impact import ForceModel, Parameter
GAINS = ForceModel("gains", "", 2026, equation="", reference="", force=lambda elastic, v: elastic * (1 - 0.3 * v),
                   parameters=(Parameter("gain", "1", "not in the formula", 0.3),))
"""
PACKAGE = """
from impact import ForceModel, hysteresis
from impact.contact.models.hysteresis import FLORES_2011
open({marker!r}, "a").close()
OURS = hysteresis("ours-2026", title="Ours", year=2026, equation="χ = 1 − e", reference="", chi=lambda e: 1 - e)
STIFF = ForceModel("stiff-2026", "Stiff", 2026, equation="", reference="", force=lambda elastic: 2 * elastic)
"""
SWEEP = """models = ["ours-2026", "hertz"]
solver.rtol = 1e-4
[sweep]
e = [0.2, 0.8]
v1 = 1.0
m1 = 1.0
m2 = 1.0
K = 6e9
"""


def blocks(language: str) -> list[str]:
    return code_blocks(PAGE, language)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the files that the page says to save."""
    my_model, ramped = blocks("python")
    files = {"my_model.py": my_model, "ramped.py": ramped, "config.toml": blocks("toml")[0]}
    for name, text in files.items():
        assert f"`{name}`" in PAGE
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_the_commands_of_the_page(cli: Run, folder: Path) -> None:
    (commands,) = blocks("sh")
    for line in commands.splitlines():
        program, *words = shlex.split(line)
        assert program == "impact"
        done = cli(*words, cwd=folder)
        assert done.returncode == 0, (line, done.stderr)
    result = impact.load(folder / "results.h5")
    assert result["closed_form_error"].sel(model="mine-2026").max() < 1e-9
    assert (folder / "results.png").exists()


@pytest.mark.slow
def test_the_law_of_a_ramped_dashpot_meets_the_contract(cli: Run, folder: Path) -> None:
    done = cli("models", "--check", "ramped.py", "--json", cwd=folder)
    (report,) = json.loads(done.stdout)
    assert (done.returncode, report["holds"]) == (0, True)
    # with a ramp of no length it is the law of Kelvin and Voigt
    parameters = {"ramped-2026": {"C": 2e3, "d": 1e-9}, "kelvin-voigt-no-tension": {"C": 2e3}}
    balls = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e7, "n": 1.0}
    both = impact.sweep(
        {"models": list(parameters), "sweep": balls, "model": parameters}, plugins=[folder / "ramped.py"]
    )
    assert both["e_out"].values[0] == pytest.approx(both["e_out"].values[1], abs=1e-5)


@pytest.mark.parametrize("frictions", [(), ("liggghts-history",)], ids=["central", "oblique"])
def test_an_end_at_zero_force_just_before_zero_indentation_is_located(
    folder: Path, frictions: tuple[str, ...]
) -> None:
    # a weak dashpot that is linear near first contact: the force vanishes at an indentation of up to (C/d)^2
    (law,) = read_plugins([folder / "ramped.py"]).models
    law = replace(law, coordinate_power=6)
    table: dict[str, object] = {"v1": 1.0, "m1": 1.0, "m2": math.inf, "K": 6e7}
    config: dict[str, object] = {
        "models": [law.key],
        "sweep": table,
        "model": {law.key: {"C": {"geomspace": [1e-3, 1e4, 100]}, "d": 1e-3}},
    }
    if frictions:
        table |= {"e": 0.7, "R1": 0.05, "angle": "5 deg", "mu": 0.1}
        config |= {"frictions": list(frictions), "friction": {key: {"kt_over_kn": 0.8} for key in frictions}}
    result = impact.sweep(config, plugins=[law])
    assert set(result["friction_status" if frictions else "status"].values.flat) == {1}


def test_the_check_of_a_law_reports_each_clause(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "broken.py").write_text(BROKEN, encoding="utf-8")
    done = cli("models", "--check", "broken.py", cwd=tmp_path)
    assert done.returncode == 1
    assert re.search(r"no energy is gained +broken", done.stdout)
    assert re.search(r"momentum is conserved \(4\) +holds", done.stdout)
    assert "gains: has no oracle" in done.stderr
    assert "gains: no formula uses gain" in done.stderr


RAISING = """\
from impact import ForceModel

def force(elastic, v):
    return elastic * (1 + strength * v)

def branch(elastic, v):
    return elastic if v > 0 else 0 * elastic

RAISING = ForceModel("raising", "Raising", 2026, "F", "", force=force)
BRANCHING = ForceModel("branching", "Branching", 2026, "F", "", force=branch)
"""
REASONS = [
    "raising.py:4: model raising: NameError: name 'strength' is not defined",
    "raising.py:7: model branching: ValueError: The truth value of an array with more than one element is "
    "ambiguous. Use a.any() or a.all(); formulas work on arrays: use np.where instead of if",
]


@pytest.mark.slow
def test_the_check_of_a_law_that_raises_gives_the_line_and_the_text(cli: Run, tmp_path: Path) -> None:
    path = tmp_path / "raising.py"
    path.write_text(RAISING, encoding="utf-8")
    models = impact.models(plugins=[path])
    for key, reason in zip(("raising", "branching"), REASONS, strict=True):
        with pytest.warns(UserWarning, match=r"^raising\.py:") as caught:
            findings = impact.check_model(models[key])
        assert [str(warning.message) for warning in caught] == [reason]
        assert not all(finding.holds for finding in findings)
    done = cli("models", "--check", "raising.py", cwd=tmp_path)
    assert done.returncode == 1
    # names are aligned left
    assert re.match(r"model +clause .*\nraising +every impact ends ", done.stdout)
    assert [line for line in done.stderr.splitlines() if line.startswith("note: ")] == [
        f"note: {reason}" for reason in REASONS
    ]


def test_a_check_of_a_file_with_a_key_checks_that_model_alone(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "raising.py").write_text(RAISING, encoding="utf-8")
    done = cli("models", "branching", "--check", "raising.py", "--json", cwd=tmp_path)
    assert [report["model"] for report in json.loads(done.stdout)] == ["branching"]
    done = cli("models", "brnching", "--check", "raising.py", cwd=tmp_path)
    assert_refused(done, 'no model "brnching"; did you mean "branching"?')


def test_an_unknown_argument_of_a_formula_is_an_error_when_the_file_is_loaded(cli: Run, tmp_path: Path) -> None:
    (tmp_path / "misspelt.py").write_text(
        BROKEN.replace("lambda elastic, v:", "lambda elastc, v:"), encoding="utf-8"
    )
    for words in (["models", "--check", "misspelt.py"], ["models", "--plugin", "misspelt.py"]):
        done = cli(*words, cwd=tmp_path)
        assert done.returncode == 2
        assert 'misspelt.py:3: model gains: its force asks for "elastc"; did you mean "elastic"?' in done.stderr
        assert "Traceback" not in done.stderr


def test_models_lists_a_family(cli: Run) -> None:
    keys = [model["key"] for model in json.loads(cli("models", "--family", "elastic-plastic", "--json").stdout)]
    assert keys == [key for key, model in impact.models().items() if model.family == "elastic-plastic"]
    listed = cli("models", "--family", "elastic-plastic").stdout
    assert "thornton-1997" in listed
    assert "hertz " not in listed
    wrong = cli("models", "--family", "elastik")
    assert (wrong.returncode, wrong.stderr) == (2, '--family: no family "elastik"; did you mean "elastic"?\n')


# ---- installed packages


def install(folder: Path, text: str, value: str = "our_package.laws") -> Path:
    """A package as pip installs it, in a folder `site`; its import creates a file `imported`."""
    site = folder / "site"
    (site / "our_package").mkdir(parents=True)
    (site / "our_package" / "__init__.py").touch()
    (site / "our_package" / "laws.py").write_text(text.format(marker=str(folder / "imported")), encoding="utf-8")
    metadata = site / "our_package-1.2.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: our-package\nVersion: 1.2\n", encoding="utf-8"
    )
    (metadata / "entry_points.txt").write_text(f"[impact.models]\nour-laws = {value}\n", encoding="utf-8")
    return site


@pytest.fixture
def with_package(forked: ForkServer) -> Callable[..., CompletedCommand]:
    """Run a command line with a folder of installed packages, which its worker processes see, too."""

    def run(*words: str, site: Path, cwd: Path = ROOT) -> CompletedCommand:
        code = f"import sys; sys.path.insert(0, {str(site)!r})\n"
        code += "from impact.engine.plugins import installed; installed.cache_clear()"
        return forked(*words, cwd=cwd, code=code, limit=120.0, PYTHONPATH=os.pathsep.join([str(site), *sys.path]))

    return run


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--check", "hertzz"], 'no model "hertzz"; did you mean "hertz"?'),
        (["flores-2011", "--check", "hertz"], "--check: got hertz with flores-2011, expected one of the two"),
    ],
)
def test_a_check_of_a_law_of_the_catalogue_names_one(cli: Run, words: list[str], message: str) -> None:
    done = cli("models", *words)
    assert (done.returncode, done.stderr.strip()) == (2, message)


@pytest.mark.slow
def test_the_laws_of_an_installed_package_are_in_the_catalogue(
    cli: Run, with_package: Callable[..., CompletedCommand], tmp_path: Path
) -> None:
    site = install(tmp_path, PACKAGE)
    (tmp_path / "config.toml").write_text(SWEEP, encoding="utf-8")
    listed = json.loads(with_package("models", "--json", site=site).stdout)
    # a law that the package imports is not one of its laws
    assert [model["key"] for model in listed if model["key"] not in impact.models()] == ["ours-2026", "stiff-2026"]
    checked = with_package("models", "--check", "ours-2026", "--json", site=site)
    assert (checked.returncode, json.loads(checked.stdout)[0]["model"]) == (0, "ours-2026"), checked.stderr

    done = with_package("sweep", "config.toml", "--jobs", "2", cwd=tmp_path, site=site)
    assert done.returncode == 0, done.stderr
    record = json.loads(impact.load(tmp_path / "results.h5").attrs["plugins"])
    assert {key: (entry["file"], entry["package"]) for key, entry in record.items()} == {
        "ours-2026": (None, "our-package 1.2")
    }
    again = with_package("rerun", "results.h5", cwd=tmp_path, site=site)
    assert (again.returncode, again.stdout[:6]) == (0, "equal:")
    without = cli("rerun", "results.h5", cwd=tmp_path)
    assert without.returncode == 2
    assert "made with ours-2026 of our-package 1.2; give it again with the package installed" in without.stderr


def test_all_selects_built_in_laws_only(
    cli: Run, with_package: Callable[..., CompletedCommand], tmp_path: Path
) -> None:
    site = install(tmp_path, PACKAGE)
    text = SWEEP.replace(
        '["ours-2026", "hertz"]',
        '["all", "!*voigt*", "!family:rate-dependent", "!family:elastic-plastic", "!family:adhesive", '
        '"!family:codes"]',
    )
    steel = '[materials.steel]\nE = "210 GPa"\nnu = 0.3\nrho = 7850\n'
    (tmp_path / "all.toml").write_text(text.replace("K = 6e9", 'material = "steel"') + steel, encoding="utf-8")
    words = ("sweep", "all.toml", "--dry-run", "--json")
    runs = (cli(*words, cwd=tmp_path), with_package(*words, cwd=tmp_path, site=site))
    keys = [[model["model"] for model in json.loads(done.stdout)["models"]] for done in runs]
    assert len(keys[0]) > 25
    assert keys[0] == keys[1]


def test_no_data_file_causes_the_import_of_a_package(
    with_package: Callable[..., CompletedCommand], tmp_path: Path
) -> None:
    # a package without metadata is not installed
    site = install(tmp_path, PACKAGE)
    for path in (site / "our_package-1.2.dist-info").iterdir():
        path.unlink()
    (tmp_path / "config.toml").write_text(SWEEP.replace('"hertz"', '"our_package.laws"'), encoding="utf-8")
    done = with_package("sweep", "config.toml", cwd=tmp_path, site=site)
    assert (done.returncode, (tmp_path / "imported").exists()) == (2, False)


@pytest.mark.parametrize(
    ("text", "value", "message"),
    [
        (
            "1 / 0",
            "our_package.laws",
            "ZeroDivisionError: division by zero; repair the package or uninstall it",
        ),
        ("", "our_package.laws", "contains no model, expected a ForceModel or a module of them"),
        ("", "our_package.laws:GONE", "AttributeError"),
        ("raise SystemExit", "our_package.laws", "SystemExit"),
    ],
)
def test_an_error_in_a_package_is_reported_with_its_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str, value: str, message: str
) -> None:
    monkeypatch.syspath_prepend(install(tmp_path, text, value))
    for name in ("our_package", "our_package.laws"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    installed.cache_clear()
    try:
        with pytest.raises(ModelError, match=re.escape(message)) as raised:
            read_plugins([])
    finally:
        installed.cache_clear()
    assert str(raised.value).startswith(f"our-package 1.2: entry point our-laws = {value}: ")
    assert len(str(raised.value).splitlines()) == 1
