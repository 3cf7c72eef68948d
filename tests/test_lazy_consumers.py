"""Ranking, summary, info, report and pictures of 10^12 points read only the few different points."""

from __future__ import annotations

import math
import re
from typing import NoReturn

import numpy as np
import pytest
import xarray as xr

import impact
from impact.contact.status import FIRST_FAILURE, Status
from impact.errors import UsageError
from impact.plots.draw import get_plot_data
from impact.plots.kinds import KINDS, Choice, find_kind
from impact.plots.slices import MAX_DRAWN
from impact.reporting.figures import iterate_choices
from impact.results import summary
from impact.results.slabs import SLAB_POINTS, distinct_points, slabs, varying_dims
from impact.results.summary import extremes_of, summarize

from .lazy_results import Reads, computed, stretched

MODELS = ["hertz", "lankarani-nikravesh-1990", "exact-hysteresis", "broken"]
BIG = {
    "m1": np.geomspace(0.1, 10.0, 10_000),
    "m2": np.geomspace(0.2, 20.0, 10_000),
    "K": np.linspace(1e9, 1e10, 1_000),
}
WEIGHT = 10**11
FEW = {"m1": [0.1, 1.0, 2.0, 3.0], "m2": [1.0, 2.0]}
# points along e, v2 and model
SMALL_POINTS = 10 * 3 * 4


def chi(e: np.ndarray) -> np.ndarray:
    return np.where(e < 0.35, np.nan, 1.0)


BROKEN = impact.hysteresis("broken", title="Broken", year=2026, equation="", reference="", chi=chi)


@pytest.fixture(scope="module")
def small() -> xr.Dataset:
    """Points with small and large errors, failed points, and balls that do not meet."""
    inputs = {"e": {"linspace": [0.1, 1.0, 10]}, "v1": 1.0, "v2": [2.0, 0.0, 0.5], "m1": 1.0, "m2": 1.0, "K": 6e9}
    return impact.sweep({"models": MODELS, "sweep": inputs, "solver": {"rtol": 1e-4}}, plugins=[BROKEN])


@pytest.fixture(scope="module")
def big(small: xr.Dataset) -> tuple[xr.Dataset, Reads]:
    """The same result over 3 x 10^12 points of each model, with one added axis before and two after the others."""
    dataset, reads = stretched(small, BIG, order=["m1", "e", "v2", "m2", "K"])
    assert math.prod(dataset.sizes.values()) == SMALL_POINTS * WEIGHT > 10**12
    return dataset, reads


def page_without_figures(dataset: xr.Dataset) -> tuple[str, list[Choice]]:
    """A report whose figures are read and not drawn, and their points."""
    choices = []

    def read(dataset: xr.Dataset, kind: str, choice: Choice, *_: object, **__: object) -> NoReturn:
        # an error of the data would end the test
        get_plot_data(dataset, kind, choice, [BROKEN])
        choices.append(choice)
        raise UsageError("not drawn")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("impact.reporting.figures.get_plot_data", read)
        return impact.report(dataset), choices


def test_the_ranking_of_all_points_is_that_of_the_different_points(
    small: xr.Dataset, big: tuple[xr.Dataset, Reads]
) -> None:
    dataset, reads = big
    reads.clear()
    ranking, small_ranking = impact.recommend(dataset, tol=0.05), impact.recommend(small, tol=0.05)
    assert sum(reads.total.values()) <= 2 * SMALL_POINTS
    assert [ranked.model for ranked in ranking.models] == [ranked.model for ranked in small_ranking.models]
    for ranked, small_ranked in zip(ranking.models, small_ranking.models, strict=True):
        assert (ranked.points, ranked.within, ranked.failed) == tuple(
            WEIGHT * count for count in (small_ranked.points, small_ranked.within, small_ranked.failed)
        )
        assert (ranked.mean_error, ranked.max_error, ranked.e_out) == (
            small_ranked.mean_error,
            small_ranked.max_error,
            small_ranked.e_out,
        )
        assert ranked.served == small_ranked.served
        assert dict(ranked.at) == {**small_ranked.at, **{name: values[0] for name, values in BIG.items()}}
    # a selection is ranked like the result at these values
    some = impact.recommend(dataset, tol=0.05, sel={"m1": 0.1, "v2": 0.0}, models=["exact-hysteresis"])
    assert some.models[0].points == 10 * WEIGHT // 10_000


@pytest.mark.parametrize("order", [None, ["e", "m2", "v2", "m1"], ["v2", "m2", "m1", "e"]])
def test_a_ranking_does_not_depend_on_the_order_of_axes(small: xr.Dataset, order: list[str] | None) -> None:
    added = {"e_error": ["m1"]}
    dataset, _ = stretched(small, FEW, added=added, order=order)
    from_file, _ = stretched(small, FEW, added=added, order=order, known=False)
    ranking = impact.recommend(dataset, tol=0.05)
    # the means are equal to the last bit
    assert ranking == impact.recommend(dataset.compute(), tol=0.05) == impact.recommend(from_file, tol=0.05)
    assert {ranked.at["m1"] for ranked in ranking.models if ranked.model != "lankarani-nikravesh-1990"} == {2.0}


def test_a_mean_is_exact(small: xr.Dataset) -> None:
    error = xr.zeros_like(small["e_error"]) + 1e-17
    error[0, 0, 1] = 1.0
    spoilt = small.sel(model=["hertz"]).assign(e_error=error.sel(model=["hertz"]))
    (ranked,) = impact.recommend(spoilt).models
    assert ranked.mean_error == (1.0 + 19e-17) / 20 != 1.0 / 20


def test_all_values_of_a_long_axis_are_ranked_if_a_model_varies_along_it(small: xr.Dataset) -> None:
    dataset, reads = stretched(small, BIG, added={"e_error": ["m1"]})
    ranking = impact.recommend(dataset, tol=0.05)
    assert reads.largest["e_error"] <= SLAB_POINTS
    few = impact.recommend(stretched(small, FEW, added={"e_error": ["m1"]})[0], tol=0.05)
    for ranked, other in zip(ranking.models, few.models, strict=True):
        assert (ranked.model, ranked.share, ranked.max_error) == (other.model, other.share, other.max_error)
        assert (ranked.mean_error, ranked.served) == (other.mean_error, other.served)
        assert ranked.at["m1"] == (BIG["m1"][5_000] if other.at["m1"] == 2.0 else BIG["m1"][0])
    with pytest.raises(UsageError, match="different points to rank, expected at most 1,073,741,824; select"):
        impact.recommend(stretched(small, BIG, added={"e_error": ["m1", "m2"]})[0])


def test_a_result_without_known_axes_is_read_slab_by_slab(small: xr.Dataset) -> None:
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


def test_the_summary_of_all_points_is_that_of_the_different_points(
    small: xr.Dataset, big: tuple[xr.Dataset, Reads]
) -> None:
    dataset, reads = big
    reads.clear()
    tally, few = summarize(dataset), summarize(small)
    assert max(reads.total.values()) <= SMALL_POINTS
    assert (tally.points, tally.not_counted) == (SMALL_POINTS * WEIGHT, 0)
    assert tally.counts == {status: WEIGHT * count for status, count in few.counts.items()}
    assert {Status.NO_IMPACT, Status.OK} < tally.counts.keys()
    assert tally.failed == WEIGHT * few.failed > 0
    np.testing.assert_equal(tally.worst, few.worst)
    assert tally.failed_at == [(status, law, (0, *index, 0, 0)) for status, law, index in few.failed_at]
    # these are the first failed points along the axes along which the status varies
    status, law, index = tally.failed_at[0]
    assert dataset["status"][(*law, *index)].item() == status >= FIRST_FAILURE


def test_variables_with_too_many_different_points_are_not_evaluated(
    small: xr.Dataset, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    many, axes = ["m1", "m2"], ["model,", "e,", "v2,", "m1,", "m2,", "K"]
    # the figures of the report are over e and v2
    order = ["e", "v2", *BIG]
    dataset, reads = stretched(small, BIG, added={"e_error": many, "status": many}, order=order)
    tally = summarize(dataset)
    assert (tally.points, tally.not_counted, tally.counts) == (SMALL_POINTS * WEIGHT, SMALL_POINTS * WEIGHT, {})
    assert "e_error" not in tally.worst
    np.testing.assert_equal(tally.worst["v1_error"], summarize(small).worst["v1_error"])
    assert extremes_of(dataset, "e_error") is None
    print(impact.info(dataset))
    lines = capsys.readouterr().out.splitlines()
    assert any(line.split() == ["e_error", "1", *axes, "–", "–", "–"] for line in lines)
    assert any(re.match("not evaluated +the status of 12,000,000,000,000 points", line) for line in lines)
    text, choices = page_without_figures(dataset)
    assert "The models are not ranked: got 12,000,000,000 different points to rank" in text
    assert "The status of 12,000,000,000,000 points was not evaluated." in text
    assert "No point failed" not in text
    # v2 = 2 m/s is no impact; the figures are at a point of a coarse grid
    assert {choice.sel["v2"] for choice in choices if "v2" in choice.sel} == {0.0}
    assert reads.total["status"] < 2**23
    monkeypatch.setattr(summary, "MAX_SUMMARY_POINTS", 10)
    assert summarize(stretched(small, {"m1": BIG["m1"]}, added={"status": ["m1"]})[0]).not_counted


def test_info_reads_only_the_different_points(
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
    print(impact.info(sealed))
    rows = dict(re.findall(r"^(\S+) {2,}(\S.*?) *$", capsys.readouterr().out, re.MULTILINE))
    assert (rows["points"], rows["layout"], rows["seal"]) == ("12,000,000,000,000", "factored", "5ea1")
    assert rows["m1"] == "0.1 … 10, 10000 values [kg]"
    assert "content_digest" not in rows
    assert max(reads.total.values()) <= 4 * SMALL_POINTS
    described = impact.info(sealed)
    assert described["points"] == SMALL_POINTS * WEIGHT
    assert (described["layout"], described["seal"]) == ("factored", "5ea1")
    assert described["variables"]["e_out"]["largest"] == float(small["e_out"].max())
    in_memory = impact.info(small)
    assert (in_memory["layout"], in_memory["seal"]) == (None, None)


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_report_reads_only_the_different_points(small: xr.Dataset, drawn: bool) -> None:
    dataset, reads = stretched(small, BIG, order=["K", "e", "v2", "m1", "m2"])
    dataset.encoding["seal"] = "5ea1"
    text, choices = (impact.report(dataset, plugins=[BROKEN]), []) if drawn else page_without_figures(dataset)
    assert "12,000,000,000,000 points" in text
    assert "600,000,000,000 invalid_parameter: " in text
    assert text.count('<th scope="row">broken</th>\n<td data-head="where">K') == 6
    assert "and 599,999,999,994 more" in text
    assert ">5ea1<" in text
    # the map and the picture of validity are over e and the next axis
    assert max(reads.largest.values()) <= 4 * 10 * 1_000
    # v2 = 2 m/s is no impact, so that the figures are at the next value
    if drawn:
        assert "is left out" not in text
        assert "v2\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}0" in text
    else:
        assert len(choices) == len(list(iterate_choices(dataset, MODELS)))
        assert {choice.sel["v2"] for choice in choices if "v2" in choice.sel} == {0.0}


def test_the_figures_of_a_report_are_at_a_point_that_did_not_fail(big: tuple[xr.Dataset, Reads]) -> None:
    dataset, reads = big

    def status(model: np.ndarray, m1: np.ndarray, *others: np.ndarray) -> np.ndarray:
        return np.where(m1 < 7_000, int(Status.NOT_FINITE), int(Status.OK))

    sizes = {str(dim): dataset.sizes[dim] for dim in dataset["status"].dims}
    about = {"dtype": np.dtype(np.int8), "attrs": dataset["status"].attrs}
    # along m1 alone all points are read; along m1 and m2 those of a coarse grid
    for along, last in ((["m1"], 7_000), (["m1", "m2"], 7_100)):
        varies_along = dict.fromkeys(MODELS, along)
        late = dataset.assign(status=computed("status", sizes, status, reads, varies_along=varies_along, **about))
        _, choice, _ = next(iterate_choices(late, MODELS))
        assert choice.x == "e"
        assert BIG["m1"][7_000] <= choice.sel["m1"] <= BIG["m1"][last]


@pytest.mark.slow
def test_a_lazy_e_over_many_axes_is_read_only_at_the_different_points(
    small: xr.Dataset, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset, reads = stretched(small, BIG, order=["m1", "e", "v2", "m2", "K"])

    def e(m1: np.ndarray, alpha: np.ndarray, v2: np.ndarray) -> np.ndarray:
        return small["e"].values[alpha]

    sizes = {"m1": 10_000, "alpha": 10, "v2": 3}
    attrs = {"equation": "e = 1 - alpha (v1 - v2)  (24)", "units": "1"}
    lazy_e = computed(
        "e", sizes, e, reads, dtype=np.dtype(float), attrs=attrs, varies_along=dict.fromkeys(MODELS, ("alpha",))
    )
    dataset = dataset.rename(e="alpha").assign_coords(alpha=np.linspace(0.9, 0.0, 10), e=lazy_e)
    for variable in dataset.data_vars.values():
        variable.encoding["varies_along"] = dict.fromkeys(MODELS, ("alpha", "v2"))
    by_model = {ranked.model: ranked for ranked in impact.recommend(dataset, tol=0.05).models}
    assert max(reads.total.values()) <= 2 * SMALL_POINTS
    for few in impact.recommend(small, tol=0.05).models:
        same = by_model[few.model]
        assert (same.points, same.mean_error, same.e_out) == (WEIGHT * few.points, few.mean_error, few.e_out)
        assert (same.at["e"], same.served) == (few.at["e"], None)
    print(impact.info(dataset))
    assert re.search(r"^e +0\.1 … 1, 300000 values", capsys.readouterr().out, re.MULTILINE)
    text, _ = page_without_figures(dataset)
    assert "varies with m1 and alpha and v2: e = 1 - alpha (v1 - v2)  (24)" in text
    assert max(reads.largest.values()) <= 4 * 10 * 10_000


def test_coordinates_may_be_lazy(figure6: xr.Dataset, capsys: pytest.CaptureFixture[str]) -> None:
    lazy = figure6.assign_coords(
        v1=computed(
            "v1",
            {},
            lambda: figure6["v1"].values,
            Reads(),
            dtype=np.dtype(float),
            varies_along=None,
            attrs=figure6["v1"].attrs,
        )
    )
    print(impact.info(figure6))
    expected = capsys.readouterr().out
    print(impact.info(lazy))
    assert sorted(capsys.readouterr().out.splitlines()) == sorted(expected.splitlines())


# kinds of picture that an ordinary sweep does not have
OTHER_RESULTS = ("timestep", "calibration", "uncertainty", "sensitivity")


@pytest.mark.parametrize(
    "kind", [kind for kind in KINDS if kind not in OTHER_RESULTS and not find_kind(kind).of_friction]
)
def test_a_picture_reads_only_what_it_draws(small: xr.Dataset, big: tuple[xr.Dataset, Reads], kind: str) -> None:
    dataset, reads = big
    reads.clear()
    sel = {"v2": 0.0, **({"e": 0.5} if kind in ("loop", "history", "impulse", "animation") else {})}
    plane = kind in ("map", "validity")
    choice = Choice(sel=sel, models=MODELS[:3], x="e", y="K" if plane else None)
    numbers = get_plot_data(dataset, kind, choice, [BROKEN])
    expected = 0 if "e" in sel else 3 * 10 * (1_000 if plane else 1)
    assert max(reads.total.values(), default=0) == expected
    assert len(numbers.long_table())
    if not plane:
        assert numbers.long_table().equals(get_plot_data(small, kind, choice, [BROKEN]).long_table())
        return
    error = small["e_error"].sel(model="lankarani-nikravesh-1990", v2=0.0).values
    assert numbers.panels[1].values[7] == tuple(error.tolist())


def test_a_map_reads_no_omitted_model(small: xr.Dataset) -> None:
    many = small.isel(model=[0] * 42).assign_coords(model=[f"model-{number}" for number in range(42)])
    dataset, reads = stretched(many, BIG)
    numbers = get_plot_data(dataset, "map", Choice(x="e", y="v2"))
    assert (len(numbers.panels), len(numbers.left_out)) == (12, 30)
    assert reads.total == {"e_error": 12 * 10 * 3}


def test_a_plane_that_cannot_be_drawn_is_refused_before_it_is_read(big: tuple[xr.Dataset, Reads]) -> None:
    dataset, reads = big
    reads.clear()
    for kind in ("map", "validity"):
        with pytest.raises(UsageError, match=f"got 400,000,000 numbers to draw, expected at most {MAX_DRAWN:,}"):
            impact.plot(dataset, kind=kind, x="m1", y="m2")
    assert not reads.total


def test_the_axes_along_which_a_variable_varies_depend_on_the_model(small: xr.Dataset) -> None:
    dataset, _ = stretched(small, FEW)
    dataset["e_out"].variable.encoding["varies_along"]["hertz"] = ()
    assert varying_dims(dataset.sel(model="hertz"), "e_out") == ()
    assert varying_dims(dataset.sel(model=["hertz"]), "e_out") == ("model",)
    assert varying_dims(dataset, "e_out") == ("model", "e", "v2")
    variable, weight = distinct_points(dataset.sel(model="hertz"), "e_out")
    assert (variable.shape, weight) == ((1, 1, 1, 1), 4 * 2 * 10 * 3)
    # nothing is known of a renamed model, and values in memory vary along all axes
    renamed = dataset.sel(model=["hertz"]).assign_coords(model=["mine"])
    for unknown in (renamed, dataset.compute()):
        assert varying_dims(unknown, "e_out") == ("model", "m1", "m2", "e", "v2")


def test_slabs_have_every_point_once_and_in_order() -> None:
    for shape in ((), (3,), (2, 3, 4), (5, 1, 7), (0,), (3, 0), (0, 3)):
        places = np.arange(math.prod(shape)).reshape(shape)
        for points in (1, 2, 5, 12, 100):
            parts = [places[tuple(where.values())] for where in slabs(dict(enumerate(shape)), points)]
            assert np.concatenate([part.ravel() for part in parts] or [[]]).tolist() == places.ravel().tolist()
            assert max((part.size for part in parts), default=0) <= points
