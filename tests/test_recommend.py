"""`impact recommend` ranks models by how well they deliver the requested restitution, and leaves no point out."""

from __future__ import annotations

import json
import math
import re
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import FIRST_FAILURE, Status
from impact.errors import UsageError
from impact.results.ranking import Ranked

from .conftest import Run

STEEL = {"E": "210 GPa", "nu": 0.3, "rho": 7850}
BALLS = {"v1": 1.0, "m1": 1.0, "m2": [1.0, 2.0], "material": "steel"}
FAIR = ["lankarani-nikravesh-1990", "gharib-hurmuzlu-2012"]
EXACT = ["exact-hysteresis", "lankarani-nikravesh-1994", "bilinear"]


def swept(models: object, *, plugins: tuple[impact.ForceModel, ...] = (), **changes: object) -> xr.Dataset:
    """A sweep over e and m2, with changes to its inputs; None takes one out."""
    inputs = {"e": {"linspace": [0.1, 1.0, 10]}, **BALLS, **changes}
    given = {name: value for name, value in inputs.items() if value is not None}
    return impact.sweep({"models": models, "sweep": given, "materials": {"steel": STEEL}}, plugins=plugins)


def stored(tmp_path: Path, result: xr.Dataset) -> Path:
    impact.save(result, tmp_path / "results.h5")
    return tmp_path / "results.h5"


def by_hand(result: xr.Dataset, tol: float) -> dict[str, dict[str, object]]:
    """The ranking by a loop over the points, each law with the values of its own parameters that serve it best."""
    found = {}
    for key in result["model"].values.tolist():
        own = [dim for dim in result.sizes if str(dim).startswith(f"{key}.")]
        foreign = [dim for dim in result.sizes if "." in str(dim) and dim not in own]
        of_model = result.sel(model=key).isel(dict.fromkeys(foreign, 0))
        choices = [
            of_model.isel(dict(zip(own, places, strict=True)))
            for places in product(*(range(result.sizes[dim]) for dim in own))
        ]
        found[key] = min(
            (over_points(choice, tol) for choice in choices),
            key=lambda counts: (-counts["within"] / counts["points"], counts["max"]),
        )
    return found


def over_points(choice: xr.Dataset, tol: float) -> dict[str, Any]:
    """One law with one value of each of its own parameters."""
    axes = list(choice.dims)
    errors, failed, within, worst = [], 0, 0, (-1.0, {}, math.nan)
    missed_at, asked_at = set(), set()
    for places in product(*(range(choice.sizes[dim]) for dim in axes)):
        point = choice.isel(dict(zip(axes, places, strict=True)))
        e, error = float(point["e"]), abs(float(point["e_error"]))
        if math.isnan(e) or point["status"] == Status.NO_IMPACT:
            continue
        asked_at.add(e)
        within += error <= tol
        if not error <= tol:
            missed_at.add(e)
        if point["status"] >= FIRST_FAILURE:
            failed += 1
        elif not math.isnan(error):
            errors.append(error)
            if error > worst[0]:
                worst = (error, {dim: point[dim].item() for dim in axes}, float(point["e_out"]))
    return {
        "failed": failed, "within": within, "points": len(errors) + failed, "mean": np.mean(errors),
        "max": max(errors), "worst": worst, "served_at": asked_at - missed_at, "asked_at": asked_at,
    }  # fmt: skip


def refused(result: xr.Dataset, **choice: object) -> str:
    with pytest.raises(UsageError) as caught:
        impact.recommend(result, **choice)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize("tol", [1e-6, 0.02, 0.2])
def test_it_agrees_with_a_loop_over_the_points(wide: xr.Dataset, tol: float) -> None:
    for result in (wide, wide.transpose(), swept([*EXACT, *FAIR])):
        expected = by_hand(result, tol)
        ranking = impact.recommend(result, tol=tol)
        assert {one.model for one in ranking.models} == expected.keys()
        for one in ranking.models:
            loop = expected[one.model]
            assert (one.failed, one.within, one.points) == (loop["failed"], loop["within"], loop["points"])
            assert (one.mean_error, one.max_error) == (pytest.approx(loop["mean"]), loop["max"])
            served = {e for e in loop["asked_at"] if any(low <= e <= high for low, high in one.served)}
            assert served == loop["served_at"]
            # of several points with the same error the loop may find another one
            at = {name: value for name, value in one.at.items() if name in result.dims}
            others = {dim: 0 for dim in result.dims if dim not in ("model", *at)}
            there = result.sel(model=one.model, **at).isel(others)
            assert abs(float(there["e_error"])) == one.max_error
            assert one.e_out == pytest.approx(float(there["e_out"]), abs=1e-15)
        order = [(-one.within / one.points, one.max_error, one.mean_error) for one in ranking.models]
        assert order == sorted(order)


def test_the_worst_point_is_named_by_all_that_varies(wide: xr.Dataset) -> None:
    found = {one.model: one.at for one in impact.recommend(wide).models}
    # m1 and m2 vary together, and hertz does not depend on the parameter of another law
    assert list(found["hertz"]) == ["e", "v1", "m1", "m2", "material2"]
    assert found["hertz"]["e"] == 0.2
    assert "ismail-stronge-2008.gamma" in found["ismail-stronge-2008"]


def test_by_share_then_by_error() -> None:
    ranking = impact.recommend(swept(["hertz", *FAIR, "bilinear"]), tol=0.01)
    assert [one.model for one in ranking.models] == ["bilinear", *reversed(FAIR), "hertz"]
    assert [one.model for one in ranking.best] == ["bilinear"]
    # hertz gives e = 1 always: right at one of ten, and off by 0.9 at the worst, 0.5 in the mean of the others
    hertz = ranking.models[-1]
    assert (hertz.share, hertz.served, hertz.at["e"]) == (0.1, ((1.0, 1.0),), 0.1)
    assert (hertz.max_error, hertz.mean_error) == (pytest.approx(0.9), pytest.approx(0.45))


def test_where_it_serves_is_told_in_ranges() -> None:
    # right at e = 0.1 to 0.3, at 0.5, and from 0.8 on, but for the second mass at e = 0.9
    result = swept("bilinear")
    error = np.full(result["e_error"].shape, 0.5)
    error[0, [0, 1, 2, 4, 7, 8, 9]] = 0.0
    error[0, 8, 1] = 0.5
    spoilt = result.assign(e_error=(result["e_error"].dims, error))
    (one,) = impact.recommend(spoilt).models
    assert np.round(one.served, 12).tolist() == [[0.1, 0.3], [0.5, 0.5], [0.8, 0.8], [1.0, 1.0]]
    (one,) = impact.recommend(spoilt, sel={"m2": 1.0}).models
    assert np.round(one.served, 12).tolist() == [[0.1, 0.3], [0.5, 0.5], [0.8, 1.0]]
    (one,) = impact.recommend(spoilt, sel={"e": 0.5}).models
    assert (one.served, one.points, one.within) == (None, 2, 2)


def test_a_failed_point_counts_against() -> None:
    def chi(e: np.ndarray) -> np.ndarray:
        return np.where(e < 0.35, np.nan, 1.0)

    broken = impact.hysteresis("broken", title="", year=2026, equation="", reference="", chi=chi)
    result = swept(["hertz", "broken"], plugins=(broken,))
    ranking = impact.recommend(result, tol=2.0)
    assert [one.model for one in ranking.models] == ["hertz", "broken"]
    assert (ranking.models[1].points, ranking.models[1].failed, ranking.models[1].within) == (20, 6, 14)
    assert ranking.models[1].served == ((pytest.approx(0.4), 1.0),)
    fine = np.abs(result["e_error"].sel(model="broken").values[3:])
    assert ranking.models[1].mean_error == pytest.approx(fine.mean())
    assert ranking.models[1].max_error == fine.max()
    # where nothing but failures is left there is no error, and it is the last
    last = impact.recommend(result, tol=2.0, sel={"e": 0.1}).models[1]
    assert (last.model, last.failed, last.points, dict(last.at)) == ("broken", 2, 2, {})
    assert math.isnan(last.max_error)


def test_an_e_that_cannot_be_is_served_by_none() -> None:
    # alpha = 2 s/m asks for e = -1, which a law that is driven by e refuses, and another has no error of
    result = swept(["hertz", "exact-hysteresis"], e=None, alpha=[0.1, 2.0], m2=1.0)
    ranking = impact.recommend(result)
    assert [(one.model, one.points, one.within, one.failed) for one in ranking.models] == [
        ("exact-hysteresis", 2, 1, 1), ("hertz", 2, 0, 0),
    ]  # fmt: skip
    assert ranking.models[0].served == ((0.9, 0.9),)
    assert dict(ranking.models[1].at) == {"alpha": 0.1, "e": 0.9}


def test_balls_that_do_not_meet_are_not_judged() -> None:
    result = swept(EXACT, v1=[-1.0, 1.0], v2=0.0)
    assert {one.points for one in impact.recommend(result).models} == {20}
    assert len(impact.recommend(result).best) == 3
    assert "nothing to rank" in refused(result, sel={"v1": -1.0})


def test_sel_and_models_narrow() -> None:
    result = swept([*EXACT, *FAIR])
    whole = impact.recommend(result)
    narrow = impact.recommend(result, sel={"e": 1.0}, models=["gharib-hurmuzlu-2012", "bilinear"])
    assert {one.points for one in whole.models} == {20}
    assert [(one.model, one.points) for one in narrow.models] == [("bilinear", 2), ("gharib-hurmuzlu-2012", 2)]
    assert narrow.models[1].mean_error == narrow.models[1].max_error > 0.4
    assert narrow == impact.recommend(
        result.sel(e=1.0, model=["gharib-hurmuzlu-2012", "bilinear"]),
    )


def test_a_single_impact_is_judged() -> None:
    ranking = impact.recommend(swept(EXACT, e=0.5, m2=1.0))
    assert ranking.headline == f"{ranking.models[0].model} and 2 more give e within 0.01 at the only point"
    assert dict(ranking.models[0].at) == {"e": 0.5}
    assert ranking.models[0].served is None


def test_the_headline_in_the_three_cases(cli: Run, tmp_path: Path) -> None:
    path = stored(tmp_path, swept([*FAIR, *EXACT]))

    def told(*words: str) -> str:
        done = cli("recommend", path, *words)
        # it is advice, not a check
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()[0]

    best = impact.recommend(impact.load(path)).best
    assert {one.model for one in best} == set(EXACT)
    assert told() == f"{best[0].model} and 2 more give e within 0.01 at all 20 points"
    assert told("--model", "bilinear") == "bilinear gives e within 0.01 at all 20 points"
    fair = [word for key in FAIR for word in ("--model", key)]
    assert told(*fair, "--tol", "0.05") == (
        "no model gives e within 0.05 everywhere; gharib-hurmuzlu-2012 is nearest: 40.0% of 20 points"
    )
    assert told(*fair, "--sel", "e=0.5") == "no model gives e within 0.01 at any of 2 points"


def test_nearly_all_is_not_all() -> None:
    def percent(within: int) -> str:
        return Ranked("hertz", {}, 100_000, within, 0, 0.0, 0.0, {}, 0.0, None).percent

    assert [percent(n) for n in (0, 1, 50_000, 99_999, 100_000)] == ["0%", "<0.1%", "50.0%", ">99.9%", "100%"]


def test_the_table_and_the_json_say_the_same(cli: Run, tmp_path: Path) -> None:
    path = stored(tmp_path, swept([*FAIR, *EXACT]))
    words = ["recommend", path, "--tol", "0.05", "--sel", "m2=2"]
    found = json.loads(cli(*words, "--json").stdout)
    lines = cli(*words).stdout.splitlines()
    assert lines[0] == found["headline"]
    assert lines[2].split("  ")[0] == "model"
    assert [line.split()[0] for line in lines[3:]] == [one["model"] for one in found["models"]]
    assert sorted(found["best"]) == sorted(EXACT)
    worst = found["models"][-1]
    assert worst == {
        "model": "lankarani-nikravesh-1990", "parameters": {},
        "points": 10, "within": 3, "share": 0.3, "failed": 0,
        "mean_error": pytest.approx(0.226, abs=1e-3), "max_error": pytest.approx(0.565265, abs=1e-6),
        "at": {"e": 0.1}, "e_out": pytest.approx(0.665265, abs=1e-6), "served": [[pytest.approx(0.8), 1.0]],
    }  # fmt: skip
    assert re.search(r" 30\.0% +0\.565 .* 0  e=0\.1: e_out 0\.6653 +0\.8 to 1 *$", lines[-1])
    # a range of one value is that value
    assert cli("recommend", path, "--tol", "1e-9", "--model", FAIR[0]).stdout.split()[-1] == "1"


def test_what_is_not_a_number_is_null(cli: Run, tmp_path: Path) -> None:
    result = swept("exact-hysteresis", e=None, alpha=[2.0, 3.0], m2=[1.0, math.inf])
    done = cli("recommend", stored(tmp_path, result), "--json")
    (one,) = json.loads(done.stdout)["models"]
    assert (one["failed"], one["share"], one["max_error"], one["e_out"], one["at"]) == (4, 0.0, None, None, {})
    lines = cli("recommend", tmp_path / "results.h5").stdout.splitlines()
    assert lines[0] == "no model gives e within 0.01 at any of 4 points"
    assert lines[-1].split() == ["exact-hysteresis", "0%", "–", "–", "4", "–", "nowhere"]


def test_a_long_ranking_is_cut_in_the_table_only(cli: Run, tmp_path: Path) -> None:
    result = swept("hertz", m2=1.0, e=[0.5, 1.0])
    many = result.isel(model=[0] * 42).assign_coords(model=[f"model-{number}" for number in range(42)])
    path = stored(tmp_path, many)
    lines = cli("recommend", path).stdout.splitlines()
    assert sum(line.startswith("model-") for line in lines) == 30
    assert lines[-1] == "and 12 more (--json has all)"
    assert len(json.loads(cli("recommend", path, "--json").stdout)["models"]) == 42


def test_strings_of_a_file_do_not_reach_the_terminal(cli: Run, tmp_path: Path) -> None:
    name = "\x1b[31mP\x07\u202e[red]"
    sweep = {"e": [0.5, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": [name, "steel"]}
    result = impact.sweep({"models": "hertz", "sweep": sweep, "materials": {name: STEEL, "steel": STEEL}})
    path = stored(tmp_path, result.assign_coords(model=[name]))
    commands = ([], ["--json"], ["--tol", "1"], ["--model", "z"], ["--sel", "z=1"], ["--sel", "material=z"])
    for words in commands:
        done = cli("recommend", path, *words)
        assert "Traceback" not in done.stderr
        assert not re.search("[\x1b\x07\u202e]", done.stdout + done.stderr), words
    # it is told all the same, as text
    assert r"\x1b[31mP\x07\u202e[red]" in cli("recommend", path, "--tol", "1").stdout
    assert r"material=\x1b[31mP\x07\u202e[red]" in cli("recommend", path).stdout


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"tol": 0.0}, "tol: got 0, expected a positive finite number"),
        ({"tol": math.nan}, "tol: got nan"),
        ({"tol": math.inf}, "tol: got inf"),
        ({"sel": {"m3": 1.0}}, 'no axis "m3" in this result; known: e, m2'),
        ({"sel": {"m2": 7.0}}, "no m2 = 7.0 in this result; m2 is 1, 2"),
        ({"models": ["herz"]}, 'no model "herz" in this result; did you mean "hertz"?'),
    ],
)
def test_what_is_not_there_is_named(choice: dict[str, object], words: str) -> None:
    assert refused(swept("hertz"), **choice).startswith(words)


def test_what_cannot_be_ranked_is_refused() -> None:
    assert "has no requested e" in refused(swept("hertz", e=None))
    assert "has no requested e" in refused(swept("hertz").assign_coords(e=("e", np.full(10, np.nan))))
    history = impact.run(model="hertz").history
    assert history is not None
    assert "got a time history" in refused(history)
    assert "model is not an axis" in refused(swept("hertz").sel(model="hertz"))
    both = swept("hertz").drop_vars(["e_error", "status"])
    assert refused(both) == ("this result has no e_error, status; sweep without [output] variables, or add them")
    odd = swept("hertz")
    odd["status"] = odd["status"].isel(m2=0, drop=True)
    assert "do not lie along the axes" in refused(odd)
    foreign = swept("hertz", e=[0.5, 1.0]).isel(e=0, drop=True).drop_vars("v2").assign_coords(e=("v2", [0.1, 0.2]))
    assert "do not lie along the axes" in refused(foreign)


def test_the_command_refuses_in_one_line(cli: Run, tmp_path: Path) -> None:
    path = stored(tmp_path, swept("hertz", e=None))
    for words, line in (
        ([path], "this sweep has no requested e, which the ranking needs; add e or alpha\n"),
        ([path, "--tol", "-1"], "tol: got -1, expected a positive finite number\n"),
        (
            [path, "--sel", "m2"],
            "impact recommend: Invalid value for '--sel': got \"m2\", expected NAME=VALUE, such as m2=1.0; "
            "see impact recommend -h\n",
        ),
        (["absent.h5"], "absent.h5: does not exist\n"),
    ):
        done = cli("recommend", *words)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", line)


@pytest.mark.slow
def test_help_has_an_example_and_narrow_terminals_do(cli: Run, tmp_path: Path) -> None:
    assert "Example: impact recommend results.h5" in cli("recommend", "--help").stdout
    path = stored(tmp_path, swept(EXACT))
    for environment in ({"COLUMNS": "20"}, {"PYTHONIOENCODING": "ascii"}, {"NO_COLOR": "1", "LC_ALL": "C"}):
        done = cli("recommend", path, **environment)
        assert (done.returncode, done.stderr) == (0, ""), environment
