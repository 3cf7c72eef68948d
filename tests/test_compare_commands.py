"""`impact compare`, `bless` and `rerun` print the verdict, return its exit code and never damage a baseline."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
import tomllib
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from unicodedata import category
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
import xarray as xr

import impact
from impact.atomic import atomic_write
from impact.cli.main import app
from impact.config.tables import Output
from impact.errors import ResultError, StoreError, UsageError
from impact.plots.differences import difference_data, draw_differences
from impact.results.xarray_backend import write_sealed

from .conftest import CHI, PLUGIN, ROOT, WIDE, full_disk
from .fork_server import CompletedCommand, ForkServer, abandoned_pipe, printed_on_terminal

# hundreds of commands: `make test-faults` runs them
pytestmark = pytest.mark.slow

FORMATS = ("table", "json", "junit", "markdown", "github")
KEY = "lankarani-nikravesh-1990"
WORST = f"v1_post: 2 of 303 differ, worst 160 nm/s = 160 x tolerance at model={KEY}, e=0.05"
SMALL = {
    "title": "Small",
    "models": ["hertz", KEY],
    "sweep": {"e": [0.25, 0.75], "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9},
    "solver": {"rtol": 1e-4},
    "output": {"variables": ["v1_post", "e_out"]},
}


@pytest.fixture(scope="module")
def folder(figure6: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Equal and different results, and files that are not results."""
    folder = tmp_path_factory.mktemp("regression")
    impact.save(figure6, folder / "base.h5")
    impact.save(figure6.isel(e=slice(None, None, -1)), folder / "equal.h5")
    moved = figure6.copy(deep=True)
    for e, by in ((0.05, 160e-9), (0.5, -40e-9)):
        moved["v1_post"].loc[{"model": KEY, "e": e}] += by
    impact.save(moved, folder / "different.h5")
    impact.save(moved.drop_vars("contact_time"), folder / "faulty.h5")
    impact.save(figure6.isel(e=slice(50)), folder / "low.h5")
    impact.save(figure6.isel(e=slice(50, None)), folder / "high.h5")

    history = impact.run(at={"e": 0.5}).history
    assert history is not None
    impact.save(history, folder / "history.h5")
    (folder / "text.h5").write_text("text")
    with h5py.File(folder / "foreign.h5", "w") as file:
        file["x"] = [1.0]
    for name in ("damaged", "newer"):
        shutil.copy(folder / "base.h5", folder / f"{name}.h5")
        with h5py.File(folder / f"{name}.h5", "r+") as file:
            if name == "damaged":
                file["e_out"][1, 50] += 1e-15
            else:
                file.attrs["schema_version"] = np.int64(99)
    return folder


@pytest.fixture(scope="module")
def many_axes() -> xr.Dataset:
    """A coarse result with a zip group, two materials and an axis of a parameter."""
    models = {"models": ["hertz", "ismail-stronge-2008"], "output": {"variables": ["v1_post", "e_out"]}}
    return impact.sweep(tomllib.loads(WIDE) | models | {"solver": {"rtol": 1e-4}})


UNREADABLE = ("absent", "text", "foreign", "damaged", "newer", "history")


def within(name: str) -> str:
    """The claim of JUnit about a variable."""
    return f"{name} is equal within its tolerance"


def _junit(text: str) -> tuple[int, int, dict[str, ElementTree.Element]]:
    """Failures, errors and test cases of a JUnit file, whose structure is checked."""
    root = ElementTree.fromstring(text.encode())
    assert root.tag == "testsuites"
    (suite,) = root
    assert suite.tag == "testsuite"
    assert suite.attrib["name"]
    cases = suite.findall("testcase")
    by_name = {case.attrib["name"]: case for case in cases}
    assert len(by_name) == len(cases)
    for case in cases:
        assert case.attrib["classname"]
        assert len(case) <= 1
        assert all(child.tag in ("failure", "error") and child.attrib["message"] for child in case)
    assert {child.tag for child in suite} <= {"testcase", "system-out"}
    failures, errors = (len(suite.findall(f"testcase/{tag}")) for tag in ("failure", "error"))
    for element in (root, suite):
        numbers = {name: int(element.attrib[name]) for name in ("tests", "failures", "errors", "skipped")}
        assert numbers == {"tests": len(cases), "failures": failures, "errors": errors, "skipped": 0}
    return failures, errors, by_name


def _github(text: str) -> list[tuple[str, str, str]]:
    """Level, file and message of annotations, decoded as GitHub does."""
    annotations = []
    for line in text.splitlines():
        match = re.fullmatch(r"::(error|notice) file=([^,:]*),title=([^,:]+)::(.*)", line)
        assert match is not None, line
        plain = [re.sub("%(25|0D|0A|3A|2C)", lambda m: chr(int(m[1], 16)), field) for field in match.groups()]
        for field in match.groups():
            assert not re.search("%(?!25|0D|0A|3A|2C)", field), line
        annotations.append((plain[0], plain[1], plain[3]))
    return annotations


def _table_rows(text: str) -> list[list[str]]:
    """The cells of a Markdown table."""
    rows = [re.split(r"(?<!\\)\|", line) for line in text.splitlines() if line.startswith("|")]
    assert len({len(row) for row in rows}) <= 1, rows
    return [[cell.strip() for cell in row[1:-1]] for row in rows]


def _is_clean(done: CompletedCommand) -> bool:
    """Whether no control character and no invisible character was printed."""
    return not [c for c in done.stdout + done.stderr if category(c) in ("Cc", "Cf", "Zl", "Zp") and c != "\n"]


# five formats


def test_equal_in_five_formats(forked: ForkServer, folder: Path) -> None:
    outputs = {}
    for name in FORMATS:
        done = forked("compare", "equal.h5", "base.h5", "--format", name, cwd=folder)
        assert (done.returncode, done.stderr) == (0, "")
        outputs[name] = done.stdout
    headline = "equal: 19 variables, 5,353 values, none differs"
    assert forked("compare", "equal.h5", "base.h5", cwd=folder).stdout == outputs["table"] == f"{headline}\n"
    data = json.loads(outputs["json"])
    assert (data["equal"], data["headline"], data["faults"], data["notes"]) == (True, headline, [], [])
    assert (data["new"], data["baseline"], len(data["variables"])) == ("equal.h5", "base.h5", 20)
    assert {variable["equal"] for variable in data["variables"]} == {True}
    failures, errors, cases = _junit(outputs["junit"])
    assert (failures, errors) == (0, 0)
    same = {f"both have the same {what}" for what in ("inputs", "points", "units", "variables")}
    assert same | {"both have a variable in common"} < cases.keys()
    assert {within(variable["name"]) for variable in data["variables"]} < cases.keys()
    assert outputs["markdown"].startswith(f"### ✅ impact compare: {headline}\n")
    assert _github(outputs["github"]) == [("notice", "base.h5", headline)]


def test_different_in_five_formats(forked: ForkServer, folder: Path) -> None:
    outputs = {}
    for name in FORMATS:
        done = forked("compare", "faulty.h5", "base.h5", "--format", name, cwd=folder)
        assert (done.returncode, done.stderr) == (1, "")
        outputs[name] = done.stdout
    headline = "not equal: missing variable (contact_time), values (v1_post)"
    missing = "contact_time is in BASELINE only"
    replay = f"impact run faulty.h5 --model {KEY} --at e=0.05"
    lines = outputs["table"].splitlines()
    assert lines[:4] == [headline, f"missing variable: {missing}", WORST, f"  {replay}"]
    assert re.search(r"v1_post +scaled by v0 +1e-09 +2 of 303 +160 nm/s +160", outputs["table"])

    data = json.loads(outputs["json"])
    assert (data["equal"], data["headline"]) == (False, headline)
    assert data["faults"] == [{"kind": "missing variable", "text": missing}]
    first, *others = data["variables"]
    assert (first["name"], first["text"], first["replay"]) == ("v1_post", WORST, replay)
    assert (first["different"], first["points"], first["at"]) == (2, 303, {"model": KEY, "e": 0.05})
    assert first["times"] == pytest.approx(160)
    assert {variable["equal"] for variable in others} == {True}
    assert {variable["replay"] for variable in others} == {""}

    failures, errors, cases = _junit(outputs["junit"])
    assert (failures, errors) == (2, 0)
    assert cases[within("v1_post")][0].attrib["message"] == WORST
    assert cases[within("v1_post")][0].text == f"{WORST}\n{replay}"
    assert cases["both have the same variables"][0].attrib["message"] == missing
    assert headline in ElementTree.fromstring(outputs["junit"].encode()).findtext("testsuite/system-out", "")

    assert outputs["markdown"].startswith(
        "### ❌ impact compare: not equal: missing variable (contact\\_time), values (v1"
    )
    assert _table_rows(outputs["markdown"])[0][:2] == ["variable", "differ"]
    assert _table_rows(outputs["markdown"])[2][:2] == ["`v1_post`", "2 of 303"]
    assert f"````sh\n{replay}\n````\n" in outputs["markdown"]
    assert _github(outputs["github"]) == [("error", "base.h5", f"{headline}\n{missing}\n{WORST}\n{replay}")]


def test_github_gets_one_annotation_with_the_worst_three(
    forked: ForkServer, figure6: xr.Dataset, folder: Path, tmp_path: Path
) -> None:
    moved = figure6.copy(deep=True)
    for number, name in enumerate(("v1_post", "v2_post", "e_out", "energy_loss", "contact_time"), 1):
        moved[name].loc[{"model": KEY, "e": 0.5}] *= 1 + 1e-7 * number
    impact.save(moved, tmp_path / "moved.h5")
    done = forked("compare", tmp_path / "moved.h5", "base.h5", "--format", "github", cwd=folder)
    assert done.returncode == 1
    ((level, file, text),) = _github(done.stdout)
    assert (level, file) == ("error", "base.h5")
    headline, *lines = text.split("\n")
    assert headline.startswith("not equal: values (")
    named = [line.split(":")[0] for line in lines if " differ, worst " in line]
    # as the table ranks them
    table = forked("compare", tmp_path / "moved.h5", "base.h5", cwd=folder).stdout.splitlines()
    assert named == [line.split(":")[0] for line in table if " differ, worst " in line][:3]
    # all of them are at one point, whose command is there once
    assert [line for line in lines if line.startswith("impact run ")] == [
        f"impact run {tmp_path}/moved.h5 --model {KEY} --at e=0.5"
    ]
    assert "and 2 more" in lines


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("name", UNREADABLE)
def test_an_unreadable_file_is_reported_in_every_format(
    forked: ForkServer, folder: Path, name: str, format: str
) -> None:
    # as NEW in the first, third and fifth format, else as BASELINE
    pair = (f"{name}.h5", "base.h5") if FORMATS.index(format) % 2 == 0 else ("base.h5", f"{name}.h5")
    done = forked("compare", *pair, "--format", format, cwd=folder)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"{name}.h5: ")
    match format:
        case "table":
            assert done.stdout == ""
        case "json":
            data = json.loads(done.stdout)
            assert (data["equal"], data["headline"], data["variables"]) == (None, line, [])
        case "junit":
            failures, errors, cases = _junit(done.stdout)
            assert (failures, errors) == (0, 1)
            assert [case[0].attrib["message"] for case in cases.values()] == [line]
        case "markdown":
            assert done.stdout.startswith("### ⚠️ impact compare: ")
        case "github":
            assert _github(done.stdout) == [("error", pair[1], line)]


def test_a_usage_error_is_one_line_and_exit_code_2(forked: ForkServer, folder: Path) -> None:
    prefix = "impact compare: Invalid value for '--tol': "
    for words, message in (
        (["--tol", "e_oot=1"], '--tol e_oot: not a variable of a result; did you mean "e_out"?'),
        (["--tol", "much"], prefix + 'got "much", expected VALUE or NAME=VALUE, such as 1e-8, 5% or v1_post'),
        (["--tol", "nan"], prefix + 'got "nan", expected'),
        (["--tol", "e_out=x"], prefix + 'got "e_out=x"'),
        (["--tol", "=1e-6"], prefix + 'got "=1e-6", expected VALUE or NAME=VALUE'),
        (["--tol", "-1"], "--tol -1.0: expected a number >= 0"),
        (["--tol", "status=1"], "--tol status: has no tolerance"),
        (["--tol", "1", "--tol", "2"], prefix + "got all twice, expected each name once"),
    ):
        done = forked("compare", "different.h5", "base.h5", *words, cwd=folder)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(message)
        assert len(done.stderr.splitlines()) == 1
    assert forked("compare", "different.h5", "base.h5", "--format", "yaml", cwd=folder).returncode == 2
    assert forked("compare", "different.h5", cwd=folder).returncode == 2


def test_tolerances_from_the_command_line(forked: ForkServer, folder: Path) -> None:
    for words, code in (
        (["--tol", "1.7e-7"], 0),
        (["--tol", "1.5e-7"], 1),
        (["--tol", "v1_post=1.7e-7"], 0),
        (["--tol", "v2_post=1.7e-7"], 1),
        (["--tol", "1.7e-5%"], 0),
        (["--tol", "v1_post=1.5e-5%"], 1),
        (["--tol", "1", "--tol", "v1_post=1.5e-7"], 1),
        (["--tol", "0"], 1),
    ):
        paths = [str(folder / name) for name in ("different.h5", "base.h5")]
        assert (app(["compare", *paths, *words], standalone_mode=False) or 0) == code, words
    assert impact.compare(folder / "equal.h5", folder / "base.h5", tol=0.0).equal
    done = forked("compare", "different.h5", "base.h5", "--tol", "1.7e-7", cwd=folder)
    assert done.stdout.startswith(
        "equal: 19 variables, 5,353 values, largest difference 0.94 x tolerance: v1_post at"
    )


def test_subset_and_nothing_in_common(forked: ForkServer, folder: Path) -> None:
    done = forked("compare", "low.h5", "base.h5", cwd=folder)
    assert (done.returncode, done.stdout.splitlines()[0]) == (1, "not equal: labels (e)")
    assert forked("compare", "low.h5", "base.h5", "--subset", cwd=folder).returncode == 0
    for words in ([], ["--subset"]):
        done = forked("compare", "low.h5", "high.h5", *words, "--plot", folder / "none.png", cwd=folder)
        assert (done.returncode, done.stdout.splitlines()[0]) == (1, "not equal: nothing in common (e)")
        assert done.stderr == "nothing to draw: no variable was compared along an axis\n"
        assert not (folder / "none.png").exists()


MALICIOUS = "\x1b[31m\u202e\u200b[red]|`a`` ````$\\frac{1$\x07<b>&\"'%0A::,=\nx\x9b"


def test_malicious_strings_are_escaped_in_every_format(forked: ForkServer, tmp_path: Path) -> None:
    steel = {"E": 2e11, "nu": 0.3, "rho": 7850}
    config = {
        "title": MALICIOUS,
        "models": ["hertz", "bilinear"],
        "materials": {MALICIOUS: steel, f"{MALICIOUS}2": steel},
        "sweep": {"e": 0.5, "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "material": [MALICIOUS, f"{MALICIOUS}2"]},
    }
    base = impact.sweep(config)
    new = base.copy(deep=True)
    new["v1_post"][1, 1, 1] += 1.0
    new["status"][1, 1, 1] = 10
    new["e_out"].attrs["units"] = MALICIOUS
    for field in ("title", "equation"):
        new[field] = ("model", [MALICIOUS, MALICIOUS], new[field].attrs)
    new["material"].attrs["long_name"] = MALICIOUS
    table = json.loads(base.attrs["materials"])
    table[MALICIOUS]["E"] = 3e11
    new.attrs |= {"materials": json.dumps(table), "impact_version": MALICIOUS}
    folder = tmp_path / "a \x1b[31m\u202e|`$\\frac{1$%,:\nb"
    folder.mkdir()
    paths = [folder / "new.h5", folder / "base.h5"]
    impact.save(new, paths[0])
    impact.save(base, paths[1])
    near = base.copy(deep=True)
    near["v1_post"][1, 1, 1] += 1e-10
    impact.save(near, folder / "near.h5")
    for format in FORMATS:
        picture = folder / f"{format}.png"
        done = forked("compare", *paths, "--format", format, "--plot", picture)
        assert done.returncode == 1, done
        assert _is_clean(done)
        assert picture.read_bytes().startswith(b"\x89PNG")
        match format:
            case "table":
                assert done.stdout.startswith("not equal: physics config (materials.")
            case "json":
                assert json.loads(done.stdout)["equal"] is False
            case "junit":
                _, _, cases = _junit(done.stdout)
                failed = {name for name, case in cases.items() if len(case)}
                values = {within(name) for name in ("status", "v1_post", "damping_ratio")}
                assert failed == {"both have the same inputs", "both have the same units"} | values
            case "markdown":
                assert len(_table_rows(done.stdout)) == 2 + 3
                fenced = done.stdout.split("````sh\n")[1].split("\n````\n")[0]
                assert {line[:11] for line in fenced.splitlines()} == {"impact run "}
            case "github":
                ((level, _, text),) = _github(done.stdout)
                assert level == "error"
                assert len(text.splitlines()) > 5
        # the first line of an equal verdict also names a point, and is the title of the picture
        done = forked("compare", folder / "near.h5", paths[1], "--format", format, "--plot", picture)
        assert done.returncode == 0, done
        assert _is_clean(done)
        done = forked("compare", paths[0], folder / "absent.h5", "--format", format)
        assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
        assert _is_clean(done)
    done = forked("rerun", paths[0])
    assert done.returncode == 1
    assert _is_clean(done)
    done = forked("bless", *paths, "--reason", MALICIOUS, "--allow-failed")
    assert done.returncode == 0
    assert _is_clean(done)
    assert impact.load(paths[1]).attrs["reason"] == MALICIOUS


# pictures


def test_a_picture_of_differences_names_variables_as_axes_do(wide: xr.Dataset) -> None:
    moved = wide.assign(v1_post=wide["v1_post"] + 1e-6, e_out=wide["e_out"] + 1e-6)
    figure = draw_differences(difference_data(impact.compare(moved, wide)))
    names = {text.get_text() for text in figure.legends[0].get_texts()}
    assert names == {
        "Velocity of ball 1 after the impact $v_1^+$",
        r"Restitution that the model delivers $e_\mathrm{out}$",
    }


def test_a_picture_of_differences_has_level_keys_and_few_symbols_on_lines(figure6: xr.Dataset) -> None:
    moved = figure6.assign(e_out=figure6["e_out"] + 1e-6, contact_time=figure6["contact_time"] * (1.0 + 1e-6))
    # a point alone, without a line
    moved["peak_force"] = figure6["peak_force"] + 1.0 * (figure6["e"] == 0.33)
    models, over_e = draw_differences(difference_data(impact.compare(moved, figure6))).axes
    assert [(label.get_text(), label.get_rotation()) for label in models.get_xticklabels()] == [
        (key, 0.0) for key in figure6["model"].values
    ]
    lines = [line for line in over_e.lines if line.get_markevery()]
    drawn = [np.asarray(line.get_markevery()) & np.isfinite(line.get_ydata()) for line in lines]
    counts = sorted(int(each.sum()) for each in drawn)
    assert counts[0] == 1
    assert all(10 <= count <= 16 for count in counts[1:])


def test_a_picture_of_differences_has_degrees_and_words() -> None:
    balls = {"m1": 1.0, "m2": 1.0, "R1": 1.0, "R2": 1.0, "K": 1e6, "v1": 1.0}
    config = {
        "models": "hertz",
        "frictions": "coulomb-1785",
        "sweep": {**balls, "mu": 0.1, "angle": [0.0, math.pi / 3]},
        "friction": {"coulomb-1785": {"limit": ["abs", "positive"]}},
    }
    result = impact.sweep(config)
    moved = result.assign(u1_post=result["u1_post"] + 1e-3)
    over_angle, over_limit = draw_differences(difference_data(impact.compare(moved, result))).axes
    assert over_angle.get_xlabel().endswith("(°)")
    np.testing.assert_allclose(over_angle.lines[1].get_xdata(), [0.0, 60.0])
    assert [label.get_text() for label in over_limit.get_xticklabels()] == ["abs", "positive"]
    (beta,) = impact.plot(result, kind="beta", x="friction.coulomb-1785.limit", sel={"angle": "60 deg"}).axes
    assert [label.get_text() for label in beta.get_xticklabels()] == ["abs", "positive"]


def test_a_stiffness_in_a_picture_of_differences_has_the_number_of_n() -> None:
    """In words that do not end in a formula; the label of the other axis of a low picture is one line."""
    balls = {"v1": 1.0, "e": 0.5, "m1": 1.0, "m2": 1.0, "n": 1.5}
    result = impact.sweep({"models": "tsuji-1992", "sweep": {"K": [1e6, 1.5e6], **balls}})
    verdict = impact.compare(result.assign(e_out=result["e_out"] + 1e-3), result)
    assert verdict.worst_along["K"].sizes == {"K": 2}
    assert result["K"].attrs["units"] == "N m-n"
    (axes,) = draw_differences(difference_data(verdict)).axes
    figure = axes.figure
    assert axes.get_xlabel() == "Stiffness of the contact $K$\xa0(N/m$^{1.5}$)"
    (label,) = [text.get_text() for text in figure.texts if "tolerance" in text.get_text()]
    assert "\n" not in label
    assert "1e+06, 1.5e+06 [N/m^1.5]" in str(impact.info(result))


def test_no_symbol_is_on_the_texts_of_limits(wide: xr.Dataset) -> None:
    moved = wide.assign(v1_post=wide["v1_post"] * 1.001, e_out=wide["e_out"] * np.nan)
    figure = draw_differences(difference_data(impact.compare(moved, wide)))
    figure.draw_without_rendering()
    for axes in figure.axes:
        assert {text.get_text().split(":")[0] for text in axes.texts} == {"tolerance", "above"}
        assert min(text.get_window_extent().x0 for text in axes.texts) > axes.bbox.x1


def test_numbers_of_cases_are_whole_ones_where_differences_are_drawn() -> None:
    sweep = {"cases": {"e": [0.2, 0.9, 0.5, 0.7]}, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6}
    result = impact.sweep({"models": ["hertz"], "sweep": sweep})
    moved = result.assign(e_out=result["e_out"] + 1e-3 * (result["case"] == 2))
    (axes,) = draw_differences(difference_data(impact.compare(moved, result))).axes
    assert axes.get_xlabel() == "Number of the case"
    assert [tick for tick in axes.get_xticks() if 0 <= tick <= 3] == [0, 1, 2, 3]


def test_numbers_of_measured_values_are_whole_ones_where_differences_are_drawn() -> None:
    data = {"columns": {"v1": [0.5, 1.0, 2.0], "e_out": [0.9, 0.85, 0.8]}}
    sweep = {"m1": 1.0, "m2": 1.0, "K": 1e6, "e": {"fit": [0.5, 1.0]}}
    fits = impact.calibrate({"models": "tsuji-1992", "sweep": sweep, "data": data})
    moved = fits.assign(residual=fits["residual"] + 0.1)
    figure = draw_differences(difference_data(impact.compare(moved, fits)))
    (axes,) = [axes for axes in figure.axes if axes.get_xlabel() == "Number of the measured value"]
    assert [tick for tick in axes.get_xticks() if 1 <= tick <= 3] == [1, 2, 3]


def test_long_keys_of_models_in_a_picture_of_differences_are_tilted() -> None:
    keys = ["lammps-coeff-restitution-hertz", "lammps-coeff-restitution-hooke", "hertz", "yade-en"]
    result = impact.sweep(models=keys, e=[0.5, 0.9])
    figure = draw_differences(difference_data(impact.compare(result.assign(e_out=result["e_out"] + 1e-3), result)))
    labels = figure.axes[0].get_xticklabels()
    assert [(label.get_text(), label.get_rotation()) for label in labels] == [(key, 20.0) for key in keys]


def test_names_of_many_checks_in_a_picture_of_differences_do_not_overlap() -> None:
    board = impact.load(ROOT / "docs" / "conform" / "board.h5")
    moved = board.assign(check_status=1 - board["check_status"].clip(0, 1))
    figure = draw_differences(difference_data(impact.compare(moved, board)))
    figure.canvas.draw()
    _, over_checks = figure.axes
    assert over_checks.get_xlabel() == "Collision and check"
    labels = over_checks.get_xticklabels()
    places = over_checks.transData.transform([(label.get_position()[0], 1.0) for label in labels])[:, 0]
    # lines of text beside each other, in pixels
    distance = np.diff(places).min() * math.sin(math.radians(labels[0].get_rotation()))
    assert distance > 1.2 * labels[0].get_fontsize() * figure.dpi / 72.0


def test_a_picture_of_the_differences_replaces_an_old_one(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "differences.svg"
    picture.write_text("old")
    paths = [str(folder / name) for name in ("different.h5", "base.h5")]
    assert app(["compare", *paths, "--plot", str(picture)], standalone_mode=False) == 1
    assert picture.read_bytes().startswith(b"<?xml")
    assert capsys.readouterr().err == f"{picture}: where the differences lie\n"


def test_every_kind_of_verdict_has_a_picture(
    forked: ForkServer, folder: Path, wide: xr.Dataset, tmp_path: Path
) -> None:
    moved = wide.copy(deep=True)
    moved["contact_time"] *= 1 + 1e-7 * np.arange(moved["contact_time"].size).reshape(moved["contact_time"].shape)
    moved["e_out"][1, 1, 1, 1, 1, 1] = np.nan
    impact.save(wide, tmp_path / "wide.h5")
    impact.save(moved, tmp_path / "moved.h5")
    point = impact.sweep(SMALL | {"models": "hertz", "sweep": SMALL["sweep"] | {"e": 0.5, "v1": 1.0}})
    impact.save(point, tmp_path / "point.h5")
    impact.save(point.assign(e_out=point["e_out"] + 1), tmp_path / "other.h5")
    magic = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}
    for number, (new, baseline, code, kind) in enumerate(
        [
            (folder / "equal.h5", folder / "base.h5", 0, "png"),
            (folder / "different.h5", folder / "base.h5", 1, "svg"),
            (tmp_path / "point.h5", tmp_path / "point.h5", 0, "pdf"),
            (tmp_path / "other.h5", tmp_path / "point.h5", 1, "png"),
            (tmp_path / "moved.h5", tmp_path / "wide.h5", 1, "pdf"),
            (tmp_path / "wide.h5", tmp_path / "wide.h5", 0, "svg"),
        ]
    ):
        picture = tmp_path / f"{number}.{kind}"
        done = forked("compare", new, baseline, "--plot", picture)
        assert done.returncode == code, done
        message = "where the differences lie" if done.returncode else "drawn"
        assert done.stderr == f"{picture}: {message}\n"
        assert picture.read_bytes().startswith(magic[kind])
    # an existing picture is replaced, and the verdict on stdout may have another format
    (tmp_path / "0.png").write_text("old")
    words = ["--format", "json", "--plot", str(tmp_path / "0.png")]
    done = forked("compare", folder / "equal.h5", folder / "base.h5", *words)
    assert (json.loads(done.stdout)["equal"], done.returncode) == (True, 0)
    assert (tmp_path / "0.png").read_bytes().startswith(magic["png"])


def test_an_invalid_path_of_a_picture_is_refused_before_any_work(
    forked: ForkServer, folder: Path, tmp_path: Path
) -> None:
    for name in ("new.png", "base.svg"):
        shutil.copy(folder / "base.h5", tmp_path / name)
    os.link(tmp_path / "new.png", tmp_path / "hard.png")
    (tmp_path / "folder.png").mkdir()
    for picture, message in (
        ("new.png", "is the file to be read"),
        ("base.svg", "is the file to be read"),
        ("hard.png", "is the file to be read"),
        ("x.jpg", "expected a name that ends in .png"),
        ("x", "expected a name that ends in .png"),
        ("folder.png", "is not a regular file"),
        ("absent/x.png", "does not exist"),
    ):
        done = forked("compare", "new.png", "base.svg", "--plot", picture, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(f"{picture}: ")
        assert message in done.stderr
    for words in (["compare", "absent.h5", "base.svg"], ["rerun", "absent.h5"]):
        done = forked(*words, "--plot", "x.jpg", cwd=tmp_path)
        assert (done.returncode, done.stderr.startswith("x.jpg: ")) == (2, True)
    done = forked("rerun", "new.png", "--plot", "new.png", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["base.svg", "folder.png", "hard.png", "new.png"]
    assert (tmp_path / "new.png").read_bytes() == (folder / "base.h5").read_bytes()
    assert (tmp_path / "base.svg").read_bytes() == (folder / "base.h5").read_bytes()


# bless


def test_bless_writes_and_replaces_a_baseline(forked: ForkServer, folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    done = forked("bless", "base.h5", baseline, "--reason", "first", "--tol", "1e-8", cwd=folder)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", f"{baseline}: made, with the reason\n")
    first = impact.load(baseline)
    assert first.attrs["reason"] == "first"
    assert json.loads(first.attrs["tolerances"]) == {"all": 1e-8}
    assert impact.compare(folder / "base.h5", baseline).equal
    # 1e-8 instead of the default, 1e-9
    assert "worst 160 nm/s = 16 x tolerance" in str(impact.compare(folder / "different.h5", baseline))

    words = ["bless", "different.h5", baseline, "--reason", "finer steps", "--tol", "v1_post=1e-5"]
    done = forked(*words, cwd=folder)
    assert (done.returncode, done.stderr) == (0, f"{baseline}: replaced, with the reason\n")
    # the verdict uses the tolerances of the command and those of the old baseline
    assert done.stdout.startswith("equal: 19 variables")
    assert re.search(r"v1_post +scaled by v0 +1e-05 +0 of 303", done.stdout)
    second = impact.load(baseline)
    assert second.attrs["reason"] == "finer steps"
    assert json.loads(second.attrs["tolerances"]) == {"all": 1e-8, "v1_post": 1e-5}
    expected = impact.load(folder / "different.h5")
    xr.testing.assert_equal(second, expected)
    added = ("reason", "tolerances")
    assert {k: v for k, v in second.attrs.items() if k not in added} == {
        k: v for k, v in expected.attrs.items() if k not in added
    }

    # the permissions of a baseline that is replaced are kept
    baseline.chmod(0o640)
    # tolerances are inherited without an option; a tolerance for all variables replaces them all
    done = forked("bless", "base.h5", baseline, "--reason", "back", cwd=folder)
    assert done.returncode == 0
    assert json.loads(impact.load(baseline).attrs["tolerances"]) == {"all": 1e-8, "v1_post": 1e-5}
    assert stat.S_IMODE(baseline.stat().st_mode) == 0o640
    done = forked("bless", "faulty.h5", baseline, "--reason", "less", "--tol", "1e-9", cwd=folder)
    assert done.returncode == 0
    assert done.stdout.startswith("not equal: missing variable (contact_time), values (v1_post)\n")
    assert json.loads(impact.load(baseline).attrs["tolerances"]) == {"all": 1e-9}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["baseline.h5"]


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives files away")
def test_bless_keeps_the_owner_of_the_baseline(forked: ForkServer, folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    shutil.copy(folder / "base.h5", baseline)
    os.chown(baseline, 4321, 1234)
    baseline.chmod(0o604)
    assert forked("bless", "different.h5", baseline, "--reason", "r", cwd=folder).returncode == 0
    now = baseline.stat()
    assert (now.st_uid, now.st_gid, stat.S_IMODE(now.st_mode)) == (4321, 1234, 0o604)


def test_bless_accepts_failed_points_only_with_allow_failed(forked: ForkServer, tmp_path: Path) -> None:
    sweep = {"alpha": [0.1, 0.6], "v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 6e9}
    impact.save(impact.sweep(SMALL | {"sweep": sweep}), tmp_path / "new.h5")
    words = ["bless", "new.h5", "base.h5", "--reason", "first"]
    done = forked(*words, cwd=tmp_path)
    at = f"model={KEY}, alpha=0.6 s/m, v1=2 m/s (invalid_parameter)"
    message = f"new.h5: 1 of 8 points failed, the first at {at}; expected none, or --allow-failed\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", message)
    assert not (tmp_path / "base.h5").exists()
    assert forked(*words, "--allow-failed", cwd=tmp_path).returncode == 0
    assert forked("compare", "new.h5", "base.h5", cwd=tmp_path).returncode == 0


def test_a_refused_bless_changes_no_file(forked: ForkServer, folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    shutil.copy(folder / "base.h5", baseline)
    for name in UNREADABLE:
        if name != "absent":
            shutil.copy(folder / f"{name}.h5", tmp_path / f"{name}.h5")
    os.link(baseline, tmp_path / "same.h5")
    (tmp_path / "link.h5").symlink_to(baseline)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    good = folder / "different.h5"
    for words, message in (
        ([good, baseline, "--reason", ""], "--reason: got an empty text"),
        ([good, baseline, "--reason", " \n"], "--reason: got an empty text"),
        ([good, baseline], "--reason"),
        ([baseline, baseline, "--reason", "r"], "is the file to be read"),
        ([tmp_path / "same.h5", baseline, "--reason", "r"], "is the file to be read"),
        ([good, tmp_path / "link.h5", "--reason", "r"], "not a regular file"),
        ([good, tmp_path, "--reason", "r"], "not a regular file"),
        ([good, tmp_path / "no" / "b.h5", "--reason", "r"], "does not exist"),
        ([good, baseline, "--reason", "r", "--tol", "status=1"], "--tol status: has no tolerance"),
        ([good, tmp_path / "fresh.h5", "--reason", "r", "--tol", "-1"], "--tol -1.0: expected a number"),
        ([tmp_path / "damaged.h5", baseline, "--reason", "r"], "damaged.h5: "),
        ([good, tmp_path / "damaged.h5", "--reason", "r"], ""),
    ):
        done = forked("bless", *words)
        assert (done.returncode, done.stdout) == (2, ""), (words, done)
        assert message in done.stderr
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before, words
    for name in UNREADABLE:
        bad = tmp_path / f"{name}.h5"
        # an absent baseline is written
        for new, old in ((bad, baseline), (bad, tmp_path / "n.h5"), *([(good, bad)] if name != "absent" else [])):
            with pytest.raises(impact.ImpactError):
                impact.bless(new, old, reason="r")
            assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before, (new, old)


def test_bless_on_a_full_disk_leaves_the_old_baseline(folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    shutil.copy(folder / "base.h5", baseline)
    for path in (baseline, tmp_path / "fresh.h5"):
        with full_disk(), pytest.raises(StoreError, match="not written"):
            impact.bless(folder / "different.h5", path, reason="r")
    assert [p.name for p in tmp_path.iterdir()] == ["baseline.h5"]
    assert baseline.read_bytes() == (folder / "base.h5").read_bytes()


def test_bless_from_python(folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    assert impact.bless(folder / "base.h5", str(baseline), reason="first") is None
    verdict = impact.bless(str(folder / "different.h5"), baseline, reason="second", tol={"v1_post": 1e-6})
    assert verdict is not None
    assert verdict.equal
    # the default is stored as a number, so that a coarser solver does not loosen the comparison
    assert json.loads(impact.load(baseline).attrs["tolerances"]) == {"all": 1e-9, "v1_post": 1e-6}
    with pytest.raises(UsageError, match="reason: got an empty text"):
        impact.bless(folder / "base.h5", baseline, reason="")


def test_bless_does_not_copy_another_result_than_it_compared(folder: Path, tmp_path: Path) -> None:
    new, baseline = tmp_path / "new.h5", tmp_path / "baseline.h5"
    for path in (new, baseline):
        shutil.copy(folder / "base.h5", path)

    def replace_new(verdict: impact.Verdict) -> None:
        shutil.copy(folder / "different.h5", new)

    changed = pytest.raises(impact.ResultError, match=r"new\.h5: was changed while it was read")
    with pytest.deprecated_call(), changed:
        impact.bless(new, baseline, reason="numbers changed", show=replace_new)
    assert baseline.read_bytes() == (folder / "base.h5").read_bytes()


def test_bless_does_not_replace_another_baseline_than_it_compared(folder: Path, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.h5"
    shutil.copy(folder / "base.h5", baseline)

    def bless_too(verdict: impact.Verdict) -> None:
        impact.bless(folder / "different.h5", baseline, reason="of another process")

    changed = pytest.raises(impact.InUseError, match=r"baseline\.h5: was changed while it was compared")
    with pytest.deprecated_call(), changed:
        impact.bless(folder / "base.h5", baseline, reason="numbers changed", show=bless_too)
    assert impact.load(baseline).attrs["reason"] == "of another process"
    assert [path.name for path in tmp_path.iterdir()] == ["baseline.h5"]


# rerun


def test_a_rerun_of_an_unchanged_result_is_equal(
    forked: ForkServer, folder: Path, many_axes: xr.Dataset, tmp_path: Path
) -> None:
    impact.save(many_axes, tmp_path / "axes.h5")
    impact.save(impact.sweep(SMALL), tmp_path / "mapping.h5")
    (tmp_path / "config.toml").write_text(
        'models = "hertz"\n[sweep]\ne = 0.5\nv1 = 1\nm1 = 1\nm2 = 1\nK = 6e9\n', encoding="utf-8"
    )
    words = ["--set", "sweep.e=[0.1,0.9]", "--set", f'models=["{KEY}"]', "--set", "solver.rtol=1e-4"]
    assert forked("sweep", "config.toml", "-o", "set.h5", *words, cwd=tmp_path).returncode == 0
    done = forked("rerun", folder / "base.h5")
    assert (done.returncode, done.stderr) == (0, ""), done
    assert done.stdout == "equal: 19 variables, 5,353 values, none differs\n"
    for name in ("axes", "mapping", "set"):
        verdict = impact.rerun(tmp_path / f"{name}.h5")
        assert verdict.equal, verdict
        assert verdict.headline.endswith("none differs")
    assert impact.load(tmp_path / "set.h5").attrs["rtol"] == 1e-4


def test_a_rerun_finds_changed_numbers(forked: ForkServer, folder: Path) -> None:
    done = forked("rerun", "different.h5", cwd=folder)
    assert done.returncode == 1
    assert done.stdout.startswith("not equal: values (v1_post)\nv1_post: 2 of 303 differ, worst 160 nm/s = 160 x ")
    replay = done.stdout.splitlines()[2]
    assert replay == f"  impact run different.h5 --model {KEY} --at e=0.05"
    assert forked(*shlex.split(replay)[1:], cwd=folder).returncode == 0
    assert impact.rerun(folder / "different.h5", tol=1.7e-7).equal
    data = json.loads(forked("rerun", "different.h5", "--format", "json", cwd=folder).stdout)
    assert (data["equal"], data["new"], data["baseline"]) == (False, "the rerun", "different.h5")
    done = forked("rerun", "damaged.h5", "--format", "json", cwd=folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert json.loads(done.stdout)["equal"] is None
    for name in UNREADABLE:
        with pytest.raises(impact.ImpactError, match=rf"{name}\.h5: [^\n]*$"):
            impact.rerun(folder / f"{name}.h5")


def test_a_rerun_uses_the_models_and_the_rtol_of_the_file(tmp_path: Path) -> None:
    config = "models = [{}]\n[sweep]\ne = [0.2, 0.8]\nv1 = 1.0\nm1 = 1.0\nm2 = 1.0\nK = 6e9\n"
    config += '[output]\nvariables = ["v1_post"]\n[solver]\nrtol = {}\n'
    (tmp_path / "two.toml").write_text(config.format(f'"{KEY}", "hertz"', "1e-6"), encoding="utf-8")
    result = impact.sweep(tmp_path / "two.toml")
    # as if the catalogue had had two models only, and the solver another default
    edited = config.format('"X"', "1e-6").replace('["X"]', '"all"').replace("[solver]\nrtol = 1e-6\n", "")
    impact.save(result.assign_attrs(config=edited), tmp_path / "all.h5")
    verdict = impact.rerun(tmp_path / "all.h5")
    assert verdict.equal, verdict
    assert verdict.headline.endswith("none differs")
    assert {variable.tolerance for variable in verdict.variables if variable.judged == "scaled by v0"} == {
        10 * 1e-6
    }
    # the rtol of the file is used: another one gives other numbers
    impact.save(result.assign_attrs(rtol=1e-10), tmp_path / "other.h5")
    assert not impact.rerun(tmp_path / "other.h5").equal
    assert impact.rerun(tmp_path / "other.h5", tol=1e-4).equal


def test_a_rerun_repeats_the_points_of_the_file(
    forked: ForkServer, figure6: xr.Dataset, many_axes: xr.Dataset, tmp_path: Path
) -> None:
    impact.save(figure6.isel(e=slice(10, 20), model=[2, 0]), tmp_path / "part.h5")
    done = forked("rerun", "part.h5", cwd=tmp_path)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert lines[0].startswith("equal: 19 variables, 360 values")
    assert lines[1] == "note: repeated 20 of 202 points of the config: the file holds no others"
    # a zip group, a parameter of a model, and selected values
    for name, part in {
        "zip": many_axes.isel(m1=[1], e=[0, 2]),
        "parameter": many_axes.isel({"ismail-stronge-2008.gamma": [1]}),
        "single": many_axes.isel(e=1, model=[1]),
    }.items():
        impact.save(part, tmp_path / f"{name}.h5")
        verdict = impact.rerun(tmp_path / f"{name}.h5")
        assert verdict.equal, str(verdict)
        assert verdict.variables[0].points == part["v1_post"].size


def test_the_memory_of_a_rerun_is_bounded_by_the_size_of_the_file(forked: ForkServer, tmp_path: Path) -> None:
    small = impact.sweep(SMALL)
    axes = {
        "e": {"linspace": [0.25, 0.75, 1_001]},
        "v1": {"linspace": [1, 2, 1_001]},
        "v2": {"linspace": [-1, 0, 441]},
    }
    for name, attrs in (
        ("config", {"config": json.dumps(SMALL | {"sweep": SMALL["sweep"] | axes})}),
        ("no_labels", {"config_set": json.dumps([f"sweep.v{i}.linspace=[0,1,15000]" for i in (1, 2)])}),
    ):
        impact.save(small.assign_attrs(attrs), tmp_path / f"{name}.h5")
        limit = "import resource\nresource.setrlimit(resource.RLIMIT_AS, (4_000_000_000,) * 2)"
        done = forked("rerun", f"{name}.h5", cwd=tmp_path, code=limit, limit=60.0)
        assert done.returncode == (0 if name == "config" else 1), done
        assert "note: repeated " in done.stdout


@pytest.fixture
def plugin(forked: ForkServer, tmp_path: Path) -> Path:
    """A plug-in, beside a result that was made with it."""
    config = 'models = ["hertz", "mine-2026"]\n[sweep]\ne = [0.2, 0.8]\nv1 = 1\nm1 = 1\nm2 = 1\nK = 6e9\n'
    config += "[solver]\nrtol = 1e-4\n"
    (tmp_path / "config.toml").write_text(config, encoding="utf-8")
    (tmp_path / "mine.py").write_text(PLUGIN.format(chi=CHI), encoding="utf-8")
    assert forked("sweep", "config.toml", "--plugin", "mine.py", cwd=tmp_path).returncode == 0
    return tmp_path / "mine.py"


def test_a_rerun_needs_the_plug_in_of_the_result(forked: ForkServer, plugin: Path, tmp_path: Path) -> None:
    done = forked("rerun", "results.h5", cwd=tmp_path)
    message = "results.h5: made with mine-2026 of mine.py; give it again with --plugin FILE\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", message)
    done = forked("rerun", "results.h5", "--plugin", "mine.py", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("none differs\n")
    with pytest.raises(UsageError, match="give it again"):
        impact.rerun(tmp_path / "results.h5")
    assert impact.rerun(tmp_path / "results.h5", plugins=[plugin]).equal


def test_a_rerun_with_a_changed_plug_in_has_a_note(forked: ForkServer, plugin: Path, tmp_path: Path) -> None:
    point = ("--model", "mine-2026", "--at", "e=0.8")
    original_hash = sha256(plugin.read_bytes()).hexdigest()
    same = plugin.read_text(encoding="utf-8") + "# the same numbers\n"
    for text, code in ((same, 0), (PLUGIN.format(chi="(1 - e) / e"), 1)):
        plugin.write_text(text, encoding="utf-8")
        done = forked("rerun", "results.h5", "--plugin", "mine.py", cwd=tmp_path)
        assert (done.returncode, done.stderr) == (code, "")
        assert "note: the code of mine-2026 changed\n" in done.stdout
        done = forked("run", "results.h5", "--plugin", "mine.py", *point, cwd=tmp_path)
        assert done.returncode == 0
        (note,) = done.stderr.splitlines()
        assert note.startswith("note: results.h5: was made with another version of mine.py")
        hashes = [original_hash, sha256(plugin.read_bytes()).hexdigest()]
        assert all(digest in note for digest in hashes)
        # a picture that would show the changed law as that of the result is refused
        done = forked(
            "plot", "results.h5", "--plugin", "mine.py", "-k", "loop", "--model", "mine-2026", cwd=tmp_path
        )
        assert (done.returncode, note.removeprefix("note: ") in done.stderr) == (2, False)


def _save_unchecked(dataset: xr.Dataset, path: Path) -> None:
    """A sealed file, which `impact.save` might refuse to write."""
    with atomic_write(path, overwrite=True) as sink:
        values = ((str(name), (), variable.values) for name, variable in dataset.data_vars.items())
        write_sealed(sink, path, dataset, values, Output())


def test_a_rerun_of_a_result_with_an_invalid_config_is_refused(forked: ForkServer, tmp_path: Path) -> None:
    result = impact.sweep(SMALL)
    for attributes in ({"config": "models = ["}, {"config": "{}"}, {"config_set": "3"}, {"rtol": "fast"}):
        _save_unchecked(result.assign_attrs(attributes), tmp_path / "bad.h5")
        with pytest.raises(impact.ImpactError):
            impact.rerun(tmp_path / "bad.h5")
    done = forked("rerun", "bad.h5", "--format", "json", cwd=tmp_path)
    assert done.returncode == 2, done
    assert json.loads(done.stdout)["equal"] is None
    assert done.stderr
    assert "Traceback" not in done.stderr
    _save_unchecked(result.assign_attrs(tolerances="{"), tmp_path / "bad.h5")
    with pytest.raises(ResultError):
        impact.rerun(tmp_path / "bad.h5")


# a law that interrupts the program if there is a file "slow"
SLOW = """\
import os, signal
from pathlib import Path
from impact import ForceModel

def force(elastic):
    if Path("slow").exists() and not Path("begun").exists():
        Path("begun").touch()
        os.kill(os.getpid(), signal.SIGINT)
    return elastic

LAW = ForceModel("slow", "Slow", 2026, "F = K δⁿ", "", force=force)
"""


def test_a_signal_ends_a_rerun(forked: ForkServer, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(SLOW)
    impact.save(impact.sweep(SMALL | {"models": ["slow"]}, plugins=[tmp_path / "mine.py"]), tmp_path / "long.h5")
    (tmp_path / "slow").touch()
    done = forked("rerun", "long.h5", "--plugin", "mine.py", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.splitlines()[-1] == "interrupted; nothing was written"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["begun", "long.h5", "mine.py", "slow"]


PARTLY_READ = [
    ("table", "different", 1),
    ("table", "equal", 0),
    ("json", "different", 1),
    *((format, "different", 1) for format in ("junit", "markdown", "github")),
]


@pytest.mark.parametrize(("format", "new", "code"), PARTLY_READ)
def test_a_closed_pipe_does_not_change_the_exit_code(
    forked: ForkServer, folder: Path, tmp_path: Path, format: str, new: str, code: int
) -> None:
    words = ("compare", f"{new}.h5", "base.h5", "--format", format)
    with abandoned_pipe(tmp_path) as pipe:
        done = forked(*words, cwd=folder, stdout=pipe)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)


@pytest.mark.parametrize(("format", "new", "code"), PARTLY_READ)
def test_a_closed_pipe_of_a_real_interpreter_does_not_change_the_exit_code(
    folder: Path, tmp_path: Path, format: str, new: str, code: int
) -> None:
    program = f"{shlex.quote(sys.executable)} -m impact compare"
    line = f"{program} {folder}/{new}.h5 {folder}/base.h5 --format {format} --plot {tmp_path}/{new}.png"
    done = subprocess.run(
        ["bash", "-c", f"({line}; echo $? > {tmp_path}/code) | true"], cwd=ROOT, capture_output=True, text=True
    )
    assert "Traceback" not in done.stderr
    assert (tmp_path / "code").read_text().strip() == str(code)
    assert (tmp_path / f"{new}.png").exists()


def test_bless_replaces_nothing_if_the_verdict_cannot_be_printed(
    forked: ForkServer, folder: Path, tmp_path: Path
) -> None:
    baseline = tmp_path / "base.h5"
    shutil.copy(folder / "base.h5", baseline)
    with abandoned_pipe(tmp_path) as pipe:
        for stdout, code in ((pipe, 2), ("/dev/full", 4)):
            done = forked("bless", folder / "different.h5", baseline, "--reason", "why", stdout=stdout)
            assert done.returncode == code
            assert baseline.read_bytes() == (folder / "base.h5").read_bytes()


def test_bless_refuses_a_reason_that_is_not_text(forked: ForkServer, folder: Path, tmp_path: Path) -> None:
    for reason in (b"caf\xe9", "a lone \ud800 surrogate"):
        with pytest.raises(UsageError, match="reason: got"):
            impact.bless(folder / "equal.h5", tmp_path / "new.h5", reason=os.fsdecode(reason))
    done = forked("bless", folder / "equal.h5", "new.h5", "--reason", os.fsdecode(b"caf\xe9"), cwd=tmp_path)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert not (tmp_path / "new.h5").exists()


def test_a_narrow_terminal_shows_sentences_and_no_table(forked: ForkServer, folder: Path) -> None:
    words = ("compare", folder / "different.h5", folder / "base.h5")
    for columns, has_table in (("40", False), ("120", True)):
        _, printed = printed_on_terminal(forked, *words, COLUMNS=columns)
        assert printed.startswith("not equal: ")
        assert ("scaled by v0" in printed) == has_table


def test_the_table_of_changes_has_units_and_names_what_is_unchanged() -> None:
    config = {"models": "gharib-hurmuzlu-2012", "sweep": {"e": [0.2, 0.5], "m1": 1.0, "m2": 1.0, "K": 6e9}}
    slow, fast = (impact.sweep({**config, "sweep": {**config["sweep"], "v1": v1}}) for v1 in (1.0, 1.5))
    lines = str.splitlines(impact.compare(fast, slow)._repr_html_().replace("</tr>", "\n").replace("<p>", "\n"))
    row = next(line for line in lines if ">peak_force<" in line)
    assert re.search(r">[\d.]+ kN<", row)
    # the restitution of this law does not depend on the speed
    assert any(line.startswith("unchanged: e_out, ") for line in lines)


def test_a_changed_plug_in_is_a_note_without_records() -> None:
    law = impact.models()["hertz"]
    config = {"models": "mine", "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}}
    results = []
    for digit in "ab":
        result = impact.sweep(config, plugins=[replace(law, key="mine")])
        result.attrs["plugins"] = json.dumps({"mine": {"file": "my.py", "sha256": digit * 64}})
        results.append(result)
    verdict = impact.compare(*results)
    assert "the code of mine changed" in verdict.notes
    assert not [note for note in verdict.notes if "sha256" in note]
