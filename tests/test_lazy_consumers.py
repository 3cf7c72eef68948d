"""Ranking, tally, info, report and pictures of 10^12 points take what the few points take that differ."""

from __future__ import annotations

import math
import re
from itertools import islice
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
import xarray as xr

import impact
from impact.cli.info import print_info
from impact.contact.status import FIRST_FAILURE, Status
from impact.errors import UsageError
from impact.plots.kinds import KINDS, Choice
from impact.plots.slices import MAX_DRAWN
from impact.reporting.figures import figures_of
from impact.results.slabs import SLAB_POINTS, distinct_points, slabs, varying_dims
from impact.results.summary import extremes_of, summarize

from .lazy import Reads, computed, stretched

MODELS = ["hertz", "lankarani-nikravesh-1990", "exact-hysteresis", "broken"]
BIG = {
    "m1": np.geomspace(0.1, 10.0, 10_000),
    "m2": np.geomspace(0.2, 20.0, 10_000),
    "K": np.linspace(1e9, 1e10, 1_000),
}
WEIGHT = 10**11
FEW = {"m1": [0.1, 1.0, 2.0, 3.0], "m2": [1.0, 2.0]}
# e, v2 and the models
OWN = 10 * 3 * 4


def chi(e: np.ndarray) -> np.ndarray:
    return np.where(e < 0.35, np.nan, 1.0)


BROKEN = impact.hysteresis("broken", title="Broken", year=2026, equation="", reference="", chi=chi)


@pytest.fixture(scope="module")
def small() -> xr.Dataset:
    """Points of every kind: good and bad, failed, and of balls that do not meet."""
    inputs = {"e": {"linspace": [0.1, 1.0, 10]}, "v1": 1.0, "v2": [2.0, 0.0, 0.5], "m1": 1.0, "m2": 1.0, "K": 6e9}
    return impact.sweep({"models": MODELS, "sweep": inputs}, plugins=[BROKEN])


@pytest.fixture(scope="module")
def big(small: xr.Dataset) -> tuple[xr.Dataset, Reads]:
    """The same over 3 x 10^12 points of each model, with an axis before and two after those of the few points."""
    dataset, reads = stretched(small, BIG, order=["m1", "e", "v2", "m2", "K"])
    assert math.prod(dataset.sizes.values()) == OWN * WEIGHT > 10**12
    return dataset, reads


def test_the_ranking_of_all_points_is_that_of_the_few_that_differ(
    small: xr.Dataset, big: tuple[xr.Dataset, Reads]
) -> None:
    dataset, reads = big
    reads.clear()
    ranking, few = impact.recommend(dataset, tol=0.05), impact.recommend(small, tol=0.05)
    assert sum(reads.total.values()) <= 2 * OWN
    assert [one.model for one in ranking.models] == [one.model for one in few.models]
    for one, other in zip(ranking.models, few.models, strict=True):
        assert (one.points, one.within, one.failed) == tuple(
            WEIGHT * count for count in (other.points, other.within, other.failed)
        )
        assert (one.mean_error, one.max_error, one.e_out) == (other.mean_error, other.max_error, other.e_out)
        assert one.served == other.served
        assert dict(one.at) == {**other.at, **{name: values[0] for name, values in BIG.items()}}
    # a selection is judged like the result at these values
    some = impact.recommend(dataset, tol=0.05, sel={"m1": 0.1, "v2": 0.0}, models=["exact-hysteresis"])
    assert some.models[0].points == 10 * WEIGHT // 10_000


@pytest.mark.parametrize("order", [None, ["e", "m2", "v2", "m1"], ["v2", "m2", "m1", "e"]])
def test_a_ranking_does_not_depend_on_where_the_values_are(small: xr.Dataset, order: list[str] | None) -> None:
    added = {"e_error": ["m1"]}
    dataset, _ = stretched(small, FEW, added=added, order=order)
    from_file, _ = stretched(small, FEW, added=added, order=order, known=False)
    ranking = impact.recommend(dataset, tol=0.05)
    # each mean to the last bit
    assert ranking == impact.recommend(dataset.compute(), tol=0.05) == impact.recommend(from_file, tol=0.05)
    assert {one.at["m1"] for one in ranking.models if one.model != "lankarani-nikravesh-1990"} == {2.0}


def test_a_mean_is_exact(small: xr.Dataset) -> None:
    error = xr.zeros_like(small["e_error"]) + 1e-17
    error[0, 0, 1] = 1.0
    spoilt = small.sel(model=["hertz"]).assign(e_error=error.sel(model=["hertz"]))
    (one,) = impact.recommend(spoilt).models
    assert one.mean_error == (1.0 + 19e-17) / 20 != 1.0 / 20


def test_where_a_model_varies_along_a_long_axis_all_of_it_is_ranked(small: xr.Dataset) -> None:
    dataset, reads = stretched(small, BIG, added={"e_error": ["m1"]})
    ranking = impact.recommend(dataset, tol=0.05)
    assert reads.largest["e_error"] <= SLAB_POINTS
    few = impact.recommend(stretched(small, FEW, added={"e_error": ["m1"]})[0], tol=0.05)
    for one, other in zip(ranking.models, few.models, strict=True):
        assert (one.model, one.share, one.max_error) == (other.model, other.share, other.max_error)
        assert (one.mean_error, one.served) == (other.mean_error, other.served)
        assert one.at["m1"] == (BIG["m1"][5_000] if other.at["m1"] == 2.0 else BIG["m1"][0])
    with pytest.raises(UsageError, match="different points to rank, expected at most 1,073,741,824; select"):
        impact.recommend(stretched(small, BIG, added={"e_error": ["m1", "m2"]})[0])


def test_a_file_without_the_axes_of_its_variables_is_read_slab_by_slab(small: xr.Dataset) -> None:
    axes = {"m1": np.geomspace(0.1, 1.0, 300), "m2": np.geomspace(0.1, 1.0, 20)}
    dataset, reads = stretched(small, axes, known=False)
    points = math.prod(dataset.sizes.values())
    computed, _ = stretched(small, axes)
    assert impact.recommend(dataset) == impact.recommend(computed)
    assert reads.total == {"e_error": points, "status": points}
    tally, few = summarize(dataset), summarize(computed)
    assert (tally.points, tally.counts, tally.worst) == (few.points, few.counts, few.worst)
    assert reads.total["v1_error"] == points
    assert max(reads.largest.values()) <= SLAB_POINTS


def test_the_tally_of_all_points_is_that_of_the_few_that_differ(
    small: xr.Dataset, big: tuple[xr.Dataset, Reads]
) -> None:
    dataset, reads = big
    reads.clear()
    tally, few = summarize(dataset), summarize(small)
    assert max(reads.total.values()) <= OWN
    assert (tally.points, tally.not_counted) == (OWN * WEIGHT, 0)
    assert tally.counts == {status: WEIGHT * count for status, count in few.counts.items()}
    assert {Status.NO_IMPACT, Status.OK} < tally.counts.keys()
    assert tally.failed == WEIGHT * few.failed > 0
    np.testing.assert_equal(tally.worst, few.worst)
    assert tally.failed_at == [(status, model, (0, *places, 0, 0)) for status, model, places in few.failed_at]
    # those are the first: before them no point failed, along axes on which the status varies
    status, model, places = tally.failed_at[0]
    assert dataset["status"][(model, *places)].item() == status >= FIRST_FAILURE


def test_what_is_too_much_to_evaluate_is_missing(small: xr.Dataset, capsys: pytest.CaptureFixture[str]) -> None:
    many, axes = ["m1", "m2"], ["model,", "e,", "v2,", "m1,", "m2,", "K"]
    # the figures of the report are over e and v2
    order = ["e", "v2", *BIG]
    dataset, reads = stretched(small, BIG, added={"e_error": many, "status": many}, order=order)
    tally = summarize(dataset)
    assert (tally.points, tally.not_counted, tally.counts) == (OWN * WEIGHT, OWN * WEIGHT, {})
    assert "e_error" not in tally.worst
    np.testing.assert_equal(tally.worst["v1_error"], summarize(small).worst["v1_error"])
    assert extremes_of(dataset, "e_error") is None
    print_info(dataset, Path("big.h5"))
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split() == ["e_error", "1", *axes, "–", "–", "–"] for line in lines)
    assert any(re.match("not evaluated +the status of 12,000,000,000,000 points", line) for line in lines)
    page = impact.report(dataset, plugins=[BROKEN])
    assert "The models are not ranked: got 12,000,000,000 different points to rank" in page
    assert "The status of 12,000,000,000,000 points was not evaluated." in page
    assert "No point failed" not in page
    # v2 = 2 m/s is no impact; the figures are at a point that a coarse grid finds
    assert "v2\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}0" in page
    assert "is left out" not in page
    assert reads.total["status"] < 2**23
    assert summarize(stretched(small, {"m1": BIG["m1"]}, added={"status": ["m1"]})[0], max_points=10).not_counted


def test_info_evaluates_the_few_points_that_differ(
    small: xr.Dataset, big: tuple[xr.Dataset, Reads], capsys: pytest.CaptureFixture[str]
) -> None:
    dataset, reads = big
    reads.clear()
    for name, variable in small.data_vars.items():
        extremes = extremes_of(dataset, str(name))
        assert extremes is not None
        missing = int(np.isnan(variable).sum()) * WEIGHT
        np.testing.assert_equal(extremes, (float(variable.min()), float(variable.max()), missing))
    sealed = dataset.copy()
    sealed.encoding |= {"layout": "factored", "seal": "5ea1"}
    print_info(sealed, Path("big.h5"))
    rows = dict(re.findall(r"^(\S+) {2,}(\S.*?) *$", capsys.readouterr().out, re.MULTILINE))
    assert (rows["points"], rows["layout"], rows["seal"]) == ("12,000,000,000,000", "factored", "5ea1")
    assert rows["m1"] == "0.1 … 10, 10000 values [kg]"
    assert "content_digest" not in rows
    assert max(reads.total.values()) <= 4 * OWN
    described = impact.info(sealed)
    assert (described["points"], described["layout"], described["seal"]) == (OWN * WEIGHT, "factored", "5ea1")
    assert described["variables"]["e_out"]["largest"] == float(small["e_out"].max())
    in_memory = impact.info(small)
    assert (in_memory["layout"], in_memory["seal"]) == (None, None)


def test_a_report_reads_the_few_points_that_differ(small: xr.Dataset) -> None:
    dataset, reads = stretched(small, BIG, order=["K", "e", "v2", "m1", "m2"])
    dataset.encoding["seal"] = "5ea1"
    page = impact.report(dataset, plugins=[BROKEN])
    assert "12,000,000,000,000 points" in page
    assert "600,000,000,000 invalid_parameter: " in page
    assert page.count('<th scope="row">broken</th>\n<td data-head="where">K') == 6
    assert "and 599,999,999,994 more" in page
    assert ">5ea1<" in page
    assert "is left out" not in page
    # the map and the picture of validity are over e and the next axis
    assert max(reads.largest.values()) <= 4 * 10 * 1_000
    # v2 = 2 m/s is no impact, so that the figures are at the next one
    assert "v2\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}0" in page


def test_the_figures_of_a_report_are_at_a_point_with_an_answer(big: tuple[xr.Dataset, Reads]) -> None:
    dataset, reads = big

    def status(model: np.ndarray, m1: np.ndarray, *others: np.ndarray) -> np.ndarray:
        return np.where(m1 < 7_000, int(Status.NOT_FINITE), int(Status.OK))

    sizes = {str(dim): dataset.sizes[dim] for dim in dataset["status"].dims}
    about = {"dtype": np.dtype(np.int8), "attrs": dataset["status"].attrs}
    chosen: list[Choice] = []

    def refuse(kind: str, choice: Choice) -> NoReturn:
        chosen.append(choice)
        raise UsageError("not drawn")

    # along m1 alone each point is looked at; along m2 too, those of a coarse grid
    for along, last in ((["m1"], 7_000), (["m1", "m2"], 7_100)):
        varies_along = dict.fromkeys(MODELS, along)
        late = dataset.assign(status=computed("status", sizes, status, reads, varies_along=varies_along, **about))
        chosen.clear()
        figures_of(late, MODELS, refuse)
        assert chosen[0].x == "e"
        assert BIG["m1"][7_000] <= chosen[0].sel["m1"] <= BIG["m1"][last]


def test_an_e_that_varies_over_many_axes_is_evaluated_like_the_rest(
    small: xr.Dataset, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset, reads = stretched(small, BIG, order=["m1", "e", "v2", "m2", "K"])

    def e(m1: np.ndarray, alpha: np.ndarray, v2: np.ndarray) -> np.ndarray:
        return small["e"].values[alpha]

    sizes = {"m1": 10_000, "alpha": 10, "v2": 3}
    attrs = {"equation": "e = 1 - alpha (v1 - v2)  (24)", "units": "1"}
    asked = computed(
        "e", sizes, e, reads, dtype=np.dtype(float), attrs=attrs, varies_along=dict.fromkeys(MODELS, ("alpha",))
    )
    dataset = dataset.rename(e="alpha").assign_coords(alpha=np.linspace(0.9, 0.0, 10), e=asked)
    for variable in dataset.data_vars.values():
        variable.encoding["varies_along"] = dict.fromkeys(MODELS, ("alpha", "v2"))
    ranked = {one.model: one for one in impact.recommend(dataset, tol=0.05).models}
    assert max(reads.total.values()) <= 2 * OWN
    for few in impact.recommend(small, tol=0.05).models:
        same = ranked[few.model]
        assert (same.points, same.mean_error, same.e_out) == (WEIGHT * few.points, few.mean_error, few.e_out)
        assert (same.at["e"], same.served) == (few.at["e"], None)
    print_info(dataset, Path("big.h5"))
    assert re.search(r"^e +0\.1 … 1, 300000 values", capsys.readouterr().out, re.MULTILINE)
    page = impact.report(dataset, plugins=[BROKEN])
    assert "varies with m1 and alpha and v2: e = 1 - alpha (v1 - v2)  (24)" in page
    assert max(reads.largest.values()) <= 4 * 10 * 10_000


def test_coordinates_of_a_file_need_not_be_in_memory(
    figure6: xr.Dataset, capsys: pytest.CaptureFixture[str]
) -> None:
    lazy = figure6.assign_coords(
        v1=computed("v1", {}, lambda: figure6["v1"].values, Reads(), dtype=np.dtype(float),
                    varies_along=None, attrs=figure6["v1"].attrs)
    )  # fmt: skip
    print_info(figure6, Path("f.h5"))
    expected = capsys.readouterr().out
    print_info(lazy, Path("f.h5"))
    assert sorted(capsys.readouterr().out.splitlines()) == sorted(expected.splitlines())


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_picture_reads_what_it_draws(small: xr.Dataset, big: tuple[xr.Dataset, Reads], kind: str) -> None:
    dataset, reads = big
    reads.clear()
    sel = {"v2": 0.0, **({"e": 0.5} if kind in ("loop", "history", "impulse") else {})}
    plane = kind in ("map", "validity")
    choice = Choice(sel=sel, models=MODELS[:3], x="e", y="K" if plane else None)
    numbers = impact.api.get_plot_data(dataset, kind, choice, [BROKEN])
    expected = 0 if "e" in sel else 3 * 10 * (1_000 if plane else 1)
    assert max(reads.total.values(), default=0) == expected
    assert list(islice(numbers.rows(), 3))
    if not plane:
        assert list(numbers.rows()) == list(impact.api.get_plot_data(small, kind, choice, [BROKEN]).rows())
        return
    error = small["e_error"].sel(model="lankarani-nikravesh-1990", v2=0.0).values
    assert numbers.panels[1].values[7] == tuple(error.tolist())


def test_a_map_reads_no_model_that_it_leaves_out(small: xr.Dataset) -> None:
    many = small.isel(model=[0] * 42).assign_coords(model=[f"model-{number}" for number in range(42)])
    dataset, reads = stretched(many, BIG)
    numbers = impact.api.get_plot_data(dataset, "map", Choice(x="e", y="v2"))
    assert (len(numbers.panels), len(numbers.left_out)) == (12, 30)
    assert reads.total == {"e_error": 12 * 10 * 3}


def test_a_plane_that_cannot_be_drawn_is_refused_before_it_is_read(big: tuple[xr.Dataset, Reads]) -> None:
    dataset, reads = big
    reads.clear()
    for kind in ("map", "validity"):
        with pytest.raises(UsageError, match=f"got 400,000,000 numbers to draw, expected at most {MAX_DRAWN:,}"):
            impact.plot(dataset, kind=kind, x="m1", y="m2")
    assert not reads.total


def test_along_which_axes_a_variable_varies_is_asked_of_each_model(small: xr.Dataset) -> None:
    dataset, _ = stretched(small, FEW)
    dataset["e_out"].variable.encoding["varies_along"]["hertz"] = ()
    assert varying_dims(dataset.sel(model="hertz"), "e_out") == ()
    assert varying_dims(dataset.sel(model=["hertz"]), "e_out") == ("model",)
    assert varying_dims(dataset, "e_out") == ("model", "e", "v2")
    variable, weight = distinct_points(dataset.sel(model="hertz"), "e_out")
    assert (variable.shape, weight) == ((1, 1, 1, 1), 4 * 2 * 10 * 3)
    # of a model by another name nothing is known, and what is in memory varies along all axes
    renamed = dataset.sel(model=["hertz"]).assign_coords(model=["mine"])
    for unknown in (renamed, dataset.compute()):
        assert varying_dims(unknown, "e_out") == ("model", "m1", "m2", "e", "v2")


def test_slabs_are_all_points_once_and_in_order() -> None:
    for shape in ((), (3,), (2, 3, 4), (5, 1, 7), (0,), (3, 0), (0, 3)):
        places = np.arange(math.prod(shape)).reshape(shape)
        for points in (1, 2, 5, 12, 100):
            parts = [places[tuple(where.values())] for where in slabs(dict(enumerate(shape)), points)]
            assert np.concatenate([part.ravel() for part in parts] or [[]]).tolist() == places.ravel().tolist()
            assert max((part.size for part in parts), default=0) <= points
