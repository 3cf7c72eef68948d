"""`impact recommend` ranks models by how well they deliver the requested restitution, and leaves no point out."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
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


def swept(
    models: object, *, plugins: tuple[impact.ForceModel, ...] = (), rtol: float = 1e-4, **changes: object
) -> xr.Dataset:
    """A sweep over e and m2, with changes to its inputs; None removes an input."""
    inputs = {"e": {"linspace": [0.1, 1.0, 10]}, **BALLS, **changes}
    values = {name: value for name, value in inputs.items() if value is not None}
    config = {"models": models, "sweep": values, "materials": {"steel": STEEL}, "solver": {"rtol": rtol}}
    return impact.sweep(config, plugins=plugins)


@pytest.fixture(scope="module")
def fair_and_exact() -> xr.Dataset:
    return swept([*FAIR, *EXACT], rtol=1e-10)


@pytest.fixture(scope="module")
def hertz() -> xr.Dataset:
    return swept("hertz")


@pytest.fixture(scope="module")
def fair_and_exact_file(fair_and_exact: xr.Dataset, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return stored(tmp_path_factory.mktemp("recommend"), fair_and_exact)


def stored(tmp_path: Path, result: xr.Dataset) -> Path:
    tmp_path.mkdir(exist_ok=True)
    impact.save(result, tmp_path / "results.h5")
    return tmp_path / "results.h5"


def by_hand(result: xr.Dataset, tol: float) -> dict[str, dict[str, object]]:
    """The ranking by a loop over the points, each law with its best parameters."""
    rankings = {}
    for key in result["model"].values.tolist():
        parameters = [dim for dim in result.sizes if str(dim).startswith(f"{key}.")]
        foreign = [dim for dim in result.sizes if "." in str(dim) and dim not in parameters]
        of_model = result.sel(model=key).isel(dict.fromkeys(foreign, 0))
        choices = [
            of_model.isel(dict(zip(parameters, places, strict=True)))
            for places in product(*(range(result.sizes[dim]) for dim in parameters))
        ]
        rankings[key] = min(
            (over_points(choice, tol) for choice in choices),
            key=lambda counts: (-counts["within"] / counts["points"], counts["max"]),
        )
    return rankings


def over_points(choice: xr.Dataset, tol: float) -> dict[str, Any]:
    """The counts of a law with one value of each of its parameters."""
    choice = choice[["e_error", "e_out", "status"]]
    axes = list(choice.dims)
    errors, failed, within, worst = [], 0, 0, (-1.0, {}, math.nan)
    missed_at, requested_at = set(), set()
    for places in product(*(range(choice.sizes[dim]) for dim in axes)):
        point = choice.isel(dict(zip(axes, places, strict=True)))
        e, error = float(point["e"]), abs(float(point["e_error"]))
        if math.isnan(e) or point["status"] == Status.NO_IMPACT:
            continue
        requested_at.add(e)
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
        "failed": failed,
        "within": within,
        "points": len(errors) + failed,
        "mean": np.mean(errors),
        "max": max(errors),
        "worst": worst,
        "served_at": requested_at - missed_at,
        "asked_at": requested_at,
    }


def refused(result: xr.Dataset, **choice: object) -> str:
    with pytest.raises(UsageError) as caught:
        impact.recommend(result, **choice)
    (line,) = str(caught.value).splitlines()
    return line


@pytest.mark.parametrize("tol", [1e-6, 0.02, pytest.param(0.2, marks=pytest.mark.slow)])
def test_the_ranking_equals_that_of_a_loop_over_the_points(
    wide: xr.Dataset, fair_and_exact: xr.Dataset, tol: float
) -> None:
    rankings = {id(result): by_hand(result, tol) for result in (wide, fair_and_exact)}
    for result, expected in (
        (wide, rankings[id(wide)]),
        (wide.transpose(), rankings[id(wide)]),
        (fair_and_exact, rankings[id(fair_and_exact)]),
    ):
        ranking = impact.recommend(result, tol=tol)
        assert {ranked.model for ranked in ranking.models} == expected.keys()
        for ranked in ranking.models:
            loop = expected[ranked.model]
            assert (ranked.failed, ranked.within, ranked.points) == (
                loop["failed"],
                loop["within"],
                loop["points"],
            )
            assert (ranked.mean_error, ranked.max_error) == (pytest.approx(loop["mean"]), loop["max"])
            served = {e for e in loop["asked_at"] if any(low <= e <= high for low, high in ranked.served)}
            assert served == loop["served_at"]
            # several points may have the same largest error
            at = {name: value for name, value in ranked.at.items() if name in result.dims}
            others = {dim: 0 for dim in result.dims if dim not in ("model", *at)}
            point = result.sel(model=ranked.model, **at).isel(others)
            assert abs(float(point["e_error"])) == ranked.max_error
            assert ranked.e_out == pytest.approx(float(point["e_out"]), abs=1e-15)
        order = [
            (-ranked.within / ranked.points, ranked.max_error, ranked.mean_error) for ranked in ranking.models
        ]
        assert order == sorted(order)


def test_the_worst_point_has_a_value_of_every_axis(wide: xr.Dataset) -> None:
    worst_points = {ranked.model: ranked.at for ranked in impact.recommend(wide).models}
    # m1 and m2 vary together, and hertz does not depend on the parameter of another law
    assert list(worst_points["hertz"]) == ["e", "v1", "m1", "m2", "material2"]
    assert worst_points["hertz"]["e"] == 0.2
    assert "ismail-stronge-2008.gamma" in worst_points["ismail-stronge-2008"]


def test_a_model_is_named_with_its_best_parameters_and_their_units() -> None:
    sweep = {"e": [0.5, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}
    config = {"models": "kuwabara-kono-1987", "sweep": sweep, "model": {"kuwabara-kono-1987": {"A": [1e-6, 1e-5]}}}
    (row,) = impact.recommend(impact.sweep(config)).models
    assert row.row[0] == "kuwabara-kono-1987 with A = 10 µs"
    assert "units" not in row.record
    # a unit with the exponent of the law
    config["model"] = {"kuwabara-kono-1987": {"A": 1e-5, "K": [6e9, 7e9]}}
    (row,) = impact.recommend(impact.sweep(config)).models
    assert row.row[0] == "kuwabara-kono-1987 with K = 7 GN/m^1.5"
    assert row.row[5].startswith("e=0.5, kuwabara-kono-1987.K=7 GN/m^1.5: ")


@pytest.mark.parametrize("unit", ["m^(1+)", "m^2.5.1", "m^(2/0)"])
def test_a_text_that_is_no_unit_does_not_prevent_a_ranking(figure6: xr.Dataset, unit: str) -> None:
    foreign = figure6.assign_coords(e=figure6["e"].assign_attrs(units=unit))
    assert len(impact.recommend(foreign)) == len(impact.recommend(figure6))


def test_with_a_target_of_e_out_the_table_lists_the_e_to_ask_for(figure6: xr.Dataset) -> None:
    laws = ["lankarani-nikravesh-1994", "lankarani-nikravesh-1990"]
    ranking = impact.recommend(figure6, target={"e_out": 0.8}, models=laws, tol=0.011)
    assert ranking.headings[-1] == "e within 0.011"
    assert {ranked.model for ranked in ranking} == {*laws}
    for ranked in ranking:
        delivered = figure6["e_out"].sel(model=ranked.model).values
        served = figure6["e"].values[np.abs(delivered - 0.8) <= 0.011]
        assert ranked.served == ((served.min(), served.max()),)


def test_a_law_without_e_is_ranked_by_a_target_with_its_best_parameter() -> None:
    sweep = {"v1": [0.5, 1.0], "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0}
    parameters = {"kelvin-voigt": {"C": [100.0, 300.0, 900.0]}}
    result = impact.sweep({"models": "kelvin-voigt", "sweep": sweep, "model": parameters})
    (ranked,) = impact.recommend(result, target={"e_out": 0.6}, tol=0.1).models
    assert (ranked.parameters, ranked.points, ranked.within) == ({"model.kelvin-voigt.C": 300.0}, 2, 2)


def test_models_are_ranked_by_share_then_by_error() -> None:
    ranking = impact.recommend(swept(["hertz", *FAIR, "bilinear"], rtol=1e-10), tol=0.01)
    assert [ranked.model for ranked in ranking.models] == ["bilinear", *reversed(FAIR), "hertz"]
    assert [ranked.model for ranked in ranking.best] == ["bilinear"]
    # hertz delivers e = 1: within the tolerance at one of ten, with the largest error 0.9 and the mean 0.45
    hertz = ranking.models[-1]
    assert (hertz.share, hertz.served, hertz.at["e"]) == (0.1, ((1.0, 1.0),), 0.1)
    assert (hertz.max_error, hertz.mean_error) == (pytest.approx(0.9), pytest.approx(0.45))


def test_models_whose_errors_are_those_of_the_integrator_are_equal() -> None:
    result = swept(EXACT, rtol=1e-10)
    for order in (EXACT, EXACT[::-1]):
        ranking = impact.recommend(result, models=order)
        # in the order in which they were named, whatever the last digits
        assert [ranked.model for ranked in ranking] == order
        for ranked in ranking:
            assert 0.0 < ranked.max_error < 1e-9
            assert ranked.row[2:6] == ("<1e-9", "<1e-9", "0", "–")
    nearest = impact.recommend(result.isel(model=[0, 0]).assign_coords(model=["a", "b"]), tol=1e-13)
    assert nearest.headline.startswith("no model gives e within 1e-13 everywhere; a and b are nearest: ")


def test_the_served_values_of_e_are_ranges() -> None:
    # no error at e = 0.1 to 0.3, at 0.5, and from 0.8 on, except for the second mass at e = 0.9
    result = swept("bilinear")
    error = np.full(result["e_error"].shape, 0.5)
    error[0, [0, 1, 2, 4, 7, 8, 9]] = 0.0
    error[0, 8, 1] = 0.5
    changed = result.assign(e_error=(result["e_error"].dims, error))
    (ranked,) = impact.recommend(changed).models
    assert np.round(ranked.served, 12).tolist() == [[0.1, 0.3], [0.5, 0.5], [0.8, 0.8], [1.0, 1.0]]
    (ranked,) = impact.recommend(changed, sel={"m2": 1.0}).models
    assert np.round(ranked.served, 12).tolist() == [[0.1, 0.3], [0.5, 0.5], [0.8, 1.0]]
    (ranked,) = impact.recommend(changed, sel={"e": 0.5}).models
    assert (ranked.served, ranked.points, ranked.within) == (None, 2, 2)


def test_a_failed_point_is_not_within_the_tolerance() -> None:
    def chi(e: np.ndarray) -> np.ndarray:
        return np.where(e < 0.35, np.nan, 1.0)

    broken = impact.hysteresis("broken", title="", year=2026, equation="", reference="", chi=chi)
    result = swept(["hertz", "broken"], plugins=(broken,))
    ranking = impact.recommend(result, tol=2.0)
    assert [ranked.model for ranked in ranking.models] == ["hertz", "broken"]
    assert (ranking.models[1].points, ranking.models[1].failed, ranking.models[1].within) == (20, 6, 14)
    assert ranking.models[1].served == ((pytest.approx(0.4), 1.0),)
    errors = np.abs(result["e_error"].sel(model="broken").values[3:])
    assert ranking.models[1].mean_error == pytest.approx(errors.mean())
    assert ranking.models[1].max_error == errors.max()
    # a model with failed points only has no error, and is the last
    last = impact.recommend(result, tol=2.0, sel={"e": 0.1}).models[1]
    assert (last.model, last.failed, last.points, dict(last.at)) == ("broken", 2, 2, {})
    assert math.isnan(last.max_error)


def test_a_negative_e_is_served_by_no_model() -> None:
    # alpha = 2 s/m gives e = -1, which fails for a law that depends on e, and has no error for others
    result = swept(["hertz", "exact-hysteresis"], e=None, alpha=[0.1, 2.0], m2=1.0)
    ranking = impact.recommend(result)
    assert [(ranked.model, ranked.points, ranked.within, ranked.failed) for ranked in ranking.models] == [
        ("exact-hysteresis", 2, 1, 1),
        ("hertz", 2, 0, 0),
    ]
    assert ranking.models[0].served == ((0.9, 0.9),)
    assert dict(ranking.models[1].at) == {"alpha": 0.1, "e": 0.9}


def test_balls_that_do_not_meet_are_not_ranked() -> None:
    result = swept(EXACT, v1=[-1.0, 1.0], v2=0.0)
    assert {ranked.points for ranked in impact.recommend(result).models} == {20}
    assert len(impact.recommend(result).best) == 3
    assert "nothing to rank" in refused(result, sel={"v1": -1.0})


def test_sel_and_models_select_a_part(fair_and_exact: xr.Dataset) -> None:
    result = fair_and_exact
    whole = impact.recommend(result)
    narrow = impact.recommend(result, sel={"e": 1.0}, models=["gharib-hurmuzlu-2012", "bilinear"])
    assert {ranked.points for ranked in whole.models} == {20}
    assert [(ranked.model, ranked.points) for ranked in narrow.models] == [
        ("bilinear", 2),
        ("gharib-hurmuzlu-2012", 2),
    ]
    assert narrow.models[1].mean_error == narrow.models[1].max_error > 0.4
    assert narrow == impact.recommend(
        result.sel(e=1.0, model=["gharib-hurmuzlu-2012", "bilinear"]),
    )


def test_a_single_impact_is_ranked() -> None:
    ranking = impact.recommend(swept(EXACT, e=0.5, m2=1.0))
    names = [ranked.model for ranked in ranking.models]
    assert ranking.headline == f"{names[0]}, {names[1]} and {names[2]} give e within 0.01 at the only point"
    assert dict(ranking.models[0].at) == {"e": 0.5}
    assert ranking.models[0].served is None


@pytest.mark.slow
def test_the_headline_names_the_best_models_or_the_nearest(cli: Run, fair_and_exact_file: Path) -> None:
    path = fair_and_exact_file

    def headline(*words: str) -> str:
        done = cli("recommend", path, *words)
        # no model within the tolerance is not an error
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()[0]

    best = impact.recommend(impact.load(path)).best
    assert {ranked.model for ranked in best} == set(EXACT)
    first, second, third = (ranked.model for ranked in best)
    assert headline() == f"{first}, {second} and {third} give e within 0.01 at all 20 points"
    assert headline("--model", "bilinear") == "bilinear gives e within 0.01 at all 20 points"
    fair = [word for key in FAIR for word in ("--model", key)]
    assert headline(*fair, "--tol", "0.05") == (
        "no model gives e within 0.05 everywhere; gharib-hurmuzlu-2012 is nearest: 40.0% of 20 points"
    )
    assert headline(*fair, "--sel", "e=0.5") == "no model gives e within 0.01 at any of 2 points"


def test_a_share_near_0_or_1_is_not_rounded_to_it() -> None:
    def percent(within: int) -> str:
        return Ranked("hertz", {}, 100_000, within, 0, 0.0, 0.0, {}, 0.0, None).row[1]

    assert [percent(n) for n in (0, 1, 50_000, 99_999, 100_000)] == ["0%", "<0.1%", "50.0%", ">99.9%", "100%"]


def test_the_table_and_the_json_have_the_same_content(cli: Run, fair_and_exact_file: Path) -> None:
    path = fair_and_exact_file
    words = ["recommend", path, "--tol", "0.05", "--sel", "m2=2"]
    ranking = json.loads(cli(*words, "--json").stdout)
    lines = cli(*words).stdout.splitlines()
    assert lines[0] == ranking["headline"]
    assert lines[2].split("  ")[0] == "model"
    assert [line.split()[0] for line in lines[3:]] == [entry["model"] for entry in ranking["models"]]
    assert sorted(ranking["best"]) == sorted(EXACT)
    worst = ranking["models"][-1]
    assert worst == {
        "model": "lankarani-nikravesh-1990",
        "parameters": {},
        "points": 10,
        "within": 3,
        "share": 0.3,
        "failed": 0,
        "mean_error": pytest.approx(0.226, abs=1e-3),
        "max_error": pytest.approx(0.565265, abs=1e-6),
        "at": {"e": 0.1},
        "e_out": pytest.approx(0.665265, abs=1e-6),
        "served": [[pytest.approx(0.8), 1.0]],
        "crossings": [],
    }
    assert re.search(r" 30\.0% +0\.565 .* 0  e=0\.1: e_out 0\.6653 +0\.8 to 1 *$", lines[-1])
    # a range of one value is printed as that value
    assert cli("recommend", path, "--tol", "1e-9", "--model", FAIR[0]).stdout.split()[-1] == "1"


def test_a_target_that_is_crossed_between_values_of_the_grid_is_named() -> None:
    config = {
        "models": "hertz",
        "frictions": "coulomb-1785",
        "sweep": {
            **BALLS,
            "m2": math.inf,
            "e": 1.0,
            "R1": 0.1,
            "mu": 0.1,
            "angle": ["20 deg", "60 deg", "80 deg"],
        },
        "materials": {"steel": STEEL},
    }
    (best,) = impact.recommend(impact.sweep(config), target={"beta": -0.4})
    # a sphere on a wall that slides has beta = 3.5 mu (1 + e)/tan(angle) - 1
    angle = math.atan(3.5 * 0.1 * 2.0 / 0.6)
    ((below, above),) = best.crossings
    assert [math.degrees(below), math.degrees(above)] == pytest.approx([20.0, 60.0])
    assert below < angle < above
    assert best.row[-1] == "between 20° and 60°"
    assert not best.within


def test_no_crossing_is_between_points_of_one_value() -> None:
    """Of the points at e = 0.2 the slow one rebounds more than asked for, and the fast one less."""
    sweep = {"e": [0.2, 0.2, 0.9], "v1": [1.0, 60.0, 1.0], "zip": [["v1", "e"]], "m1": 1.0, "m2": 1.0, "K": 1e9}
    law = "kuwabara-kono-1987"
    result = impact.sweep({"models": law, "sweep": sweep, "model": {law: {"A": 4e-5}}})
    assert result["e_out"].values.ravel() == pytest.approx([0.711, 0.493, 0.711], abs=1e-3)
    (best,) = impact.recommend(result, tol=1e-3, target={"e_out": 0.6})
    assert (best.crossings, best.row[-1]) == ((), "nowhere")


def test_a_point_is_shown_in_degrees_and_words_and_selected_by_them() -> None:
    words = {"coulomb-1785": {"limit": ["abs", "positive"]}}
    of_friction = {"R1": 0.1, "R2": 0.1, "mu": 0.1, "angle": {"linspace": ["10 deg", "80 deg", 8]}}
    config = {
        "models": "hertz",
        "frictions": "coulomb-1785",
        "sweep": {**BALLS, "m2": 1.0, "v1": ["5 mm/s", "1 m/s"], "e": 0.5, **of_friction},
        "materials": {"steel": STEEL},
        "friction": words,
        "solver": {"rtol": 1e-4},
    }
    result = impact.sweep(config)
    name = "friction.coulomb-1785.limit"
    (ranked,) = impact.recommend(result, tol=0.4, target={"beta": 0.4})
    assert ranked.row[-2:] == (f"v1=5 mm/s, angle=80°, {name}=abs: beta {ranked.record['beta']:.4g}", "10° to 30°")
    assert (ranked.at[name], ranked.record["at"][name], ranked.record["parameters"]) == (0.0, "abs", {name: "abs"})
    (other,) = impact.recommend(result, tol=0.4, target={"beta": 0.4}, sel={name: "positive", "angle": "20 deg"})
    assert (other.points, dict(other.at)) == (2, {"v1": 0.005})
    assert f"{name} is abs, positive" in refused(result, sel={name: "all"})


@pytest.mark.slow
def test_a_missing_number_is_null(cli: Run, tmp_path: Path) -> None:
    result = swept("exact-hysteresis", e=None, alpha=[2.0, 3.0], m2=[1.0, math.inf])
    done = cli("recommend", stored(tmp_path, result), "--json")
    (entry,) = json.loads(done.stdout)["models"]
    assert (entry["failed"], entry["share"], entry["max_error"], entry["e_out"], entry["at"]) == (
        4,
        0.0,
        None,
        None,
        {},
    )
    lines = cli("recommend", tmp_path / "results.h5").stdout.splitlines()
    assert lines[0] == "no model gives e within 0.01 at any of 4 points"
    assert lines[-1].split() == ["exact-hysteresis", "0%", "–", "–", "4", "–", "nowhere"]


def test_the_number_of_laws_that_a_table_leaves_out_is_printed() -> None:
    ranking = impact.recommend(swept("hertz", m2=1.0, e=[0.5, 1.0]))
    for count, last in ((31, "and 1 more (--json has all)"), (30, "hertz ")):
        many = replace(ranking, models=ranking.models * count)
        assert str(many).splitlines()[-1].startswith(last)


@pytest.mark.slow
def test_a_long_ranking_is_shortened_in_the_table_only(cli: Run, tmp_path: Path) -> None:
    result = swept("hertz", m2=1.0, e=[0.5, 1.0])
    many = result.isel(model=[0] * 42).assign_coords(model=[f"model-{number}" for number in range(42)])
    path = stored(tmp_path, many)
    lines = cli("recommend", path).stdout.splitlines()
    assert sum(line.startswith("model-") for line in lines) == 30
    assert lines[-1] == "and 12 more (--json has all)"
    assert len(json.loads(cli("recommend", path, "--json").stdout)["models"]) == 42
    for count, last in ((31, "and 1 more (--json has all)"), (30, "model-29 ")):
        few = stored(tmp_path / f"{count}", many.isel(model=slice(count)))
        lines = cli("recommend", few).stdout.splitlines()
        assert sum(line.startswith("model-") for line in lines) == 30
        assert lines[-1].startswith(last)


@pytest.mark.slow
def test_strings_of_a_file_are_escaped_on_the_terminal(cli: Run, tmp_path: Path) -> None:
    name = "\x1b[31mP\x07\u202e[red]"
    sweep = {"e": [0.5, 0.9], "v1": 1.0, "m1": 1.0, "m2": 1.0, "material": [name, "steel"]}
    result = impact.sweep(
        {
            "models": "hertz",
            "sweep": sweep,
            "materials": {name: STEEL, "steel": STEEL},
            "solver": {"rtol": 1e-4},
            "output": {"variables": ["e_out", "e_error"]},
        }
    )
    path = stored(tmp_path, result.assign_coords(model=[name]))
    commands = ([], ["--json"], ["--tol", "1"], ["--model", "z"], ["--sel", "z=1"], ["--sel", "material=z"])
    for words in commands:
        done = cli("recommend", path, *words)
        assert "Traceback" not in done.stderr
        assert not re.search("[\x1b\x07\u202e]", done.stdout + done.stderr), words
    # they are printed as escaped text
    assert r"\x1b[31mP\x07\u202e[red]" in cli("recommend", path, "--tol", "1").stdout
    assert r"material=\x1b[31mP\x07\u202e[red]" in cli("recommend", path).stdout


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"tol": 0.0}, "tol: got 0.0, expected a number > 0"),
        ({"tol": math.nan}, "tol: got nan"),
        ({"tol": math.inf}, "tol: got inf"),
        ({"sel": {"m3": 1.0}}, 'no axis "m3" in this result; known: e, m2'),
        ({"sel": {"m2": 7.0}}, "no m2 = 7.0 in this result; m2 is 1, 2"),
        ({"models": ["herz"]}, 'no model "herz" in this result; did you mean "hertz"?'),
    ],
)
def test_an_invalid_argument_is_named(hertz: xr.Dataset, choice: dict[str, object], words: str) -> None:
    assert refused(hertz, **choice).startswith(words)


def test_a_result_that_cannot_be_ranked_is_refused(hertz: xr.Dataset) -> None:
    assert "has no requested e" in refused(swept("hertz", e=None))
    assert "has no requested e" in refused(hertz.assign_coords(e=("e", np.full(10, np.nan))))
    history = impact.run(model="hertz").history
    assert history is not None
    assert "got a time history" in refused(history)
    assert "got a DataArray" in refused(hertz["e_out"])
    incomplete = hertz.drop_vars(["e_error", "status"])
    assert refused(incomplete) == (
        "this result has no e_error, status; sweep without [output] variables, or add them"
    )
    assert refused(hertz, target={"e_energetic": 0.5}) == (
        "this result has no e_energetic; list them in [output] variables"
    )
    misaligned = hertz.copy()
    misaligned["status"] = misaligned["status"].isel(m2=0, drop=True)
    assert "do not lie along the axes" in refused(misaligned)
    foreign = swept("hertz", e=[0.5, 1.0]).isel(e=0, drop=True).drop_vars("v2").assign_coords(e=("v2", [0.1, 0.2]))
    assert "do not lie along the axes" in refused(foreign)


@pytest.mark.slow
def test_an_error_of_the_command_is_one_line(cli: Run, tmp_path: Path) -> None:
    path = stored(tmp_path, swept("hertz", e=None))
    for words, line in (
        ([path], "this sweep has no requested e, which the ranking needs; add e or alpha\n"),
        ([path, "--tol", "-1"], "--tol: got -1.0, expected a number > 0\n"),
        (
            [path, "--sel", "m2"],
            "impact recommend: Invalid value for '--sel': got \"m2\", expected NAME=VALUE, such as m2=1.0; "
            "see impact recommend -h\n",
        ),
        (["absent.h5"], "absent.h5: does not exist\n"),
    ):
        done = cli("recommend", *words)
        assert (done.returncode, done.stdout, done.stderr) == (2, "", line)
