"""Pictures of friction show the values of the result, a curve or a panel for each pair, and angles in degrees."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import impact
from impact.contact.frictions import find_friction
from impact.errors import UsageError
from impact.plots.curves import Curve, CurveData
from impact.plots.draw import draw, get_plot_data
from impact.plots.kinds import KINDS, Choice, Look, find_kind
from impact.plots.labels import model_label
from impact.plots.maps import MapData
from impact.plots.oblique import MAX_PAIRS

from .conftest import Run
from .test_plots import check_layout, conditions_of, names_of

COULOMB, MINDLIN, FORCE, CONSTANT = FRICTIONS = (
    "coulomb-1785",
    "lammps-mindlin-rescale",
    "lammps-mindlin-force",
    "cundall-strack-1979",
)
TSUJI, HOOKE = MODELS = ("tsuji-1992", "lammps-coeff-restitution-hooke")
BALLS: dict[str, Any] = {
    "speed": 3.9,
    "angle": {"linspace": ["1 deg", "85 deg", 13]},
    "e": 0.9,
    "mu": [0.1, 0.3],
    "R1": 2.5e-3,
    "R2": 5e-3,
    "m1": 1e-3,
    "m2": 2e-3,
    "material1": "glass",
    "material2": "glass",
}
CONFIG: dict[str, Any] = {
    "title": "Beads",
    "models": list(MODELS),
    "frictions": list(FRICTIONS),
    "sweep": BALLS,
    "materials": {"glass": {"E": 7e10, "nu": 0.25}},
    "friction": {MINDLIN: {"xt": 0.0}, FORCE: {"xt": 0.0, "limit": "positive"}, CONSTANT: {"k_t": 1e6}},
    "solver": {"rtol": 1e-8},
}
# the kinds over the angle, and the variable that each shows
SHOWN = {"beta": "beta", "e-t": "e_t", "impulse-ratio": "impulse_ratio", "spin": "omega1_post"}


def sweep(**changes: Any) -> xr.Dataset:
    """The result of CONFIG with other tables."""
    return impact.sweep({**CONFIG, **changes})


@pytest.fixture(scope="module")
def beads() -> xr.Dataset:
    """Two models and four friction laws over angle and mu; one model has no stiffness that grows."""
    return sweep()


@pytest.fixture(scope="module")
def central() -> xr.Dataset:
    """A result without friction."""
    return impact.sweep({"models": ["hertz"], "sweep": {"v1": [1.0, 2.0], "m1": 1.0, "m2": 1.0, "K": 1e9}})


def curves_of(dataset: xr.Dataset, kind: str, **choice: Any) -> CurveData:
    data = get_plot_data(dataset, kind, Choice(**choice))
    assert isinstance(data, CurveData)
    return data


def of_pairs(data: CurveData, variable: str = "") -> list[Curve]:
    """The curves of pairs, not the guides."""
    (panel,) = data.panels
    return [curve for curve in panel.curves if curve.friction and variable in ("", curve.variable)]


def test_the_limit_of_small_steps_is_named_beside_the_law_that_reaches_it_slowly() -> None:
    laws = ["coulomb-1785", "lammps-mindlin"]
    result = sweep(models=TSUJI, frictions=laws, friction={"lammps-mindlin": {"kt_over_kn": 0.8}})
    for kind in SHOWN:
        labels = {curve.friction: curve.label for curve in curves_of(result, kind).panels[0].curves}
        assert labels["lammps-mindlin"].endswith(", limit of small steps")
        assert "limit" not in labels["coulomb-1785"]
    # with short names, too
    for legend in ("full", "short", "keys"):
        names = impact.plot(result, kind="beta", legend=legend).legends[0].get_texts()
        assert ["limit" in name.get_text() for name in names] == [False, True]
    assert re.findall('"label":"LAMMPS ([a-z]*)[^"]*, limit of small steps"', impact.page(result)) == ["mindlin"]
    with pytest.warns(
        UserWarning, match=f"^{TSUJI} with lammps-mindlin: beta is the limit of small steps"
    ) as warned:
        impact.recommend(result, target={"beta": 0.1})
    assert len(warned) == 1


@pytest.mark.parametrize("kind", SHOWN)
def test_a_curve_of_a_pair_has_the_values_of_the_result(beads: xr.Dataset, kind: str) -> None:
    curves = of_pairs(curves_of(beads, kind, sel={"mu": 0.3}), SHOWN[kind])
    # 8 G* a grows with the indentation, and the stiffness of the linear model does not
    assert [curve.law for curve in curves] == [
        *(f"{TSUJI} with {friction}" for friction in FRICTIONS),
        f"{HOOKE} with {COULOMB}",
        f"{HOOKE} with {CONSTANT}",
    ]
    for curve in curves:
        stored = beads[SHOWN[kind]].sel(model=curve.model, friction=curve.friction, mu=0.3)
        assert curve.y == tuple(stored.values.tolist())
        assert curve.x == tuple(beads["angle"].values.tolist())


@pytest.mark.parametrize("kind", ["beta", "spin"])
def test_negative_values_are_not_left_out_on_a_logarithmic_axis(beads: xr.Dataset, kind: str) -> None:
    with pytest.raises(UsageError, match=r'^log="y": the axis y would stay linear: it has values <= 0'):
        impact.plot(beads, kind=kind, log="xy")


def test_a_guide_is_named_at_its_end_on_a_logarithmic_axis(beads: xr.Dataset) -> None:
    choice = {"sel": {"mu": 0.3}, "models": [TSUJI], "frictions": [COULOMB]}
    (axes,) = impact.plot(beads, kind="impulse-ratio", log="y", **choice).axes
    (name,) = (text for text in axes.texts if text.get_text() == "μ")
    (_, drawn), (_, expected) = name.xy, axes.transAxes.inverted().transform(axes.transData.transform((0.1, 0.3)))
    assert drawn == pytest.approx(expected)


def test_a_pair_that_cannot_be_combined_is_named_with_the_reason(beads: xr.Dataset) -> None:
    data = curves_of(beads, "beta")
    reason = "the contact force lacks what the friction law needs"
    assert data.not_drawn == tuple(
        f"{model} with {friction}: {reason}" for model, friction in ((HOOKE, MINDLIN), (HOOKE, FORCE))
    )
    with pytest.raises(UsageError, match=f"^no pair has a value of e_t here: {HOOKE} with {FORCE}: {reason}$"):
        curves_of(beads, "e-t", models=[HOOKE], frictions=[FORCE])


def test_a_pair_that_fails_at_some_points_is_drawn_at_the_others() -> None:
    balls = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "R1": 0.05, "R2": 0.05, "K": 1e6, "angle": 0.5}
    law = {"frictions": "drake-regularized", "friction": {"drake-regularized": {"v_s": 0.01, "mu_d": 0.2}}}
    result = impact.sweep({"models": "hertz", **law, "sweep": {**balls, "mu": [0.1, 0.3, 0.4]}})
    (curve,) = of_pairs(curves_of(result, "beta"))
    assert np.isfinite(curve.y).tolist() == [False, True, True]


def test_a_pair_that_cannot_be_combined_has_no_curve_of_the_spin_at_a_wall() -> None:
    balls = BALLS | {"angle": [0.5, 1.0], "mu": 0.1, "R2": math.inf, "m2": math.inf}
    data = curves_of(sweep(frictions=[COULOMB, FORCE], sweep=balls, friction={}), "spin")
    reason = "the contact force lacks what the friction law needs"
    assert data.not_drawn == (f"{HOOKE} with {FORCE}: {reason}",)
    assert len(of_pairs(data)) == 3


@pytest.mark.slow
def test_the_guides_are_where_physics_has_them(beads: xr.Dataset) -> None:
    def guides(kind: str, dataset: xr.Dataset = beads, **choice: Any) -> dict[str, float]:
        (panel,) = curves_of(dataset, kind, **choice).panels
        found = {curve.case: set(curve.y) for curve in panel.curves if curve.is_guide}
        return {case: values.pop() for case, values in found.items() if len(values) == 1}

    assert guides("beta") == {"smooth": -1.0, "sticks": 0.0, "reverses": 1.0}
    assert guides("impulse-ratio", sel={"mu": 0.3}) == {"μ": 0.3}
    # rigid solid spheres that stick have the friction of Coulomb's law at small angles
    (sticks,) = guides("e-t").values()
    assert sticks == pytest.approx(5.0 / 7.0)
    rigid = beads["e_t"].sel(model=TSUJI, friction=COULOMB, mu=0.3)[0]
    assert float(rigid) == pytest.approx(sticks)
    # a spin before the impact, or balls of two inertia factors, have no such number
    one_law = {"models": [TSUJI], "frictions": [COULOMB], "friction": {}}
    for more in ({"omega1": 10.0}, {"inertia_factor2": 2.0 / 3.0}):
        assert guides("e-t", sweep(**one_law, sweep=BALLS | more)) == {}
    hollow = sweep(**one_law, sweep=BALLS | {"inertia_factor1": 2.0 / 3.0, "inertia_factor2": 2.0 / 3.0})
    assert guides("e-t", hollow) == {"sticks": pytest.approx(0.6)}
    assert float(hollow["e_t"].sel(model=TSUJI, friction=COULOMB, mu=0.3)[0]) == pytest.approx(0.6)
    # over mu the limit is a line
    (panel,) = curves_of(beads, "impulse-ratio", x="mu").panels
    assert panel.curves[0].y == panel.curves[0].x == (0.1, 0.3)
    turned = sweep(**one_law, sweep=BALLS | {"omega1": -5000.0})
    assert guides("impulse-ratio", turned, sel={"mu": 0.3})["−μ"] == -0.3


def test_labels_name_what_differs(beads: xr.Dataset) -> None:
    labels = {
        curve.law: curve.label.replace("\N{NO-BREAK SPACE}", " ") for curve in of_pairs(curves_of(beads, "beta"))
    }
    title = model_label(beads.isel(model=0, mu=0, angle=0))
    assert labels[f"{TSUJI} with {COULOMB}"] == f"{title} with Coulomb"
    assert labels[f"{TSUJI} with {FORCE}"] == f"{title} with LAMMPS mindlin/force, xt = 0, limit = positive"
    # a single model is named once, in the conditions, and parameters at their defaults are not
    alone = curves_of(beads, "beta", models=[HOOKE], frictions=[CONSTANT, COULOMB])
    shown = [curve.label.replace("\N{NO-BREAK SPACE}", " ") for curve in of_pairs(alone)]
    assert shown == ["Cundall and Strack, k_t = 1 MN/m", "Coulomb"]
    hooke = model_label(beads.isel(model=1, mu=0, angle=0))
    assert conditions_of(alone).startswith(f"Beads: {hooke}, ".replace("\N{NO-BREAK SPACE}", " "))
    assert hooke not in curves_of(beads, "beta").conditions
    keys = draw(alone, Look(legend="keys"))
    assert names_of(keys) == [CONSTANT, COULOMB]
    assert keys.texts[1].get_text().replace("\N{NO-BREAK SPACE}", " ").endswith(f"$k_t$ = 1 MN/m of {CONSTANT}")
    assert "angle" not in conditions_of(alone)
    assert "mu = 0.1" in conditions_of(alone)
    assert "angle = 1°" in conditions_of(curves_of(beads, "beta", x="mu"))


def test_the_spin_of_an_axis_that_is_not_drawn_is_named_although_it_is_zero() -> None:
    laws = CONFIG | {"models": [TSUJI], "frictions": [COULOMB], "friction": {}}
    sweep = BALLS | {"angle": ["10 deg", "40 deg"], "omega2": 0.0}
    spinning = impact.sweep(laws | {"sweep": sweep | {"omega1": [0.0, 100.0]}})
    at_zero = Choice(sel={"omega1": 0})
    for kind, choice in (("beta", Choice()), ("map", Choice(x="mu", y="angle")), ("spin", at_zero)):
        conditions = get_plot_data(spinning, kind, choice).conditions
        assert "omega1 = 0 rad/s" in conditions.replace("\N{NO-BREAK SPACE}", " ")
        assert "omega2" not in conditions
    assert "omega" not in conditions_of(curves_of(spinning, "beta", x="omega1"))


def test_the_spins_of_both_balls_are_drawn_where_both_turn(beads: xr.Dataset) -> None:
    both = curves_of(beads, "spin", models=[TSUJI], frictions=[COULOMB])
    assert [(curve.variable, curve.end) for curve in of_pairs(both)] == [
        ("omega1_post", "ω₁⁺"),
        ("omega2_post", "ω₂⁺"),
    ]
    # also where their spins are constant
    single = curves_of(beads.isel(angle=[6]), "spin", models=[TSUJI], frictions=[COULOMB], x="angle")
    assert [curve.y for curve in of_pairs(single)] == [curve.y[6:7] for curve in of_pairs(both)]
    wall = BALLS | {"m2": math.inf, "R2": math.inf}
    result = sweep(models=[TSUJI], frictions=[COULOMB], friction={}, sweep=wall)
    one = curves_of(result, "spin")
    assert curves_of(result.drop_vars("omega2_post"), "spin") == one
    assert [(curve.variable, curve.end) for curve in of_pairs(one)] == [("omega1_post", "")]
    unknown = {name: value for name, value in BALLS.items() if name not in ("R1", "R2", "material1", "material2")}
    without_radius = sweep(
        models=[TSUJI], frictions=[COULOMB], friction={}, materials={}, sweep=unknown | {"K": 1e9}
    )
    with pytest.raises(UsageError, match="no pair has a value of omega1_post or omega2_post here"):
        curves_of(without_radius, "spin")


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHOWN)
@pytest.mark.parametrize("width", ["84mm", "double"])
def test_angles_are_in_degrees_and_texts_do_not_overlap(beads: xr.Dataset, kind: str, width: str) -> None:
    figure = draw(curves_of(beads, kind), Look(width=width))
    check_layout(figure)
    (axes,) = figure.axes
    assert axes.get_xlabel().replace("\n", " ").endswith("(°)")
    low, high = axes.get_xlim()
    ticks = [float(tick) for tick in axes.get_xticks() if low <= tick <= high]
    assert np.degrees(ticks) == pytest.approx([0, 15, 30, 45, 60, 75], abs=1e-9)
    assert [axes.xaxis.get_major_formatter()(tick) for tick in ticks] == ["0", "15", "30", "45", "60", "75"]
    # guides are not in the legend
    assert len(names_of(figure)) == 6


def test_a_restitution_that_depends_on_the_cone_of_friction_names_it() -> None:
    """The normal motion of MuJoCo's cone depends on its friction."""
    cone = "friction.mujoco-elliptic.b_t"
    result = impact.sweep(
        {
            "models": "mujoco-solref",
            "frictions": "mujoco-elliptic",
            "sweep": {"m1": 0.045, "R1": 0.0213, "m2": math.inf, "R2": math.inf, "mu": [0.1, 0.2, 0.4]}
            | {"speed": 3.0, "angle": "30 deg", "e": 0.6, "dt": 1e-3, "phase": 0.5, "omega1": -100.0},
            "friction": {"mujoco-elliptic": {"b_t": [100.0, 1000.0]}},
            "solver": {"integrator": "mujoco-cone"},
        }
    )
    for kind in ("restitution", "error"):
        for b_t in (100, 1000):
            assert f", b_t = {b_t} 1/s, m1 = " in conditions_of(curves_of(result, kind, x="mu", sel={cone: b_t}))
    plane = get_plot_data(result, "map", Choice(variable="e_out"))
    assert isinstance(plane, MapData)
    assert "elliptic cone" in plane.conditions


@pytest.mark.slow
@pytest.mark.parametrize("config", ["configs/oblique.toml", "docs/spin.toml"])
def test_conditions_of_84_mm_have_three_lines(config: str) -> None:
    result = impact.sweep(config, overrides=['sweep.angle={ linspace = ["20 deg", "85 deg", 3] }'])
    shown = impact.plot(result, kind="beta", width="84mm")
    _, conditions = shown.texts
    shown.canvas.draw()
    assert conditions.get_text().count("\n") == 2
    # no input without a value, and ball 2 is named as a wall by its mass
    assert "–" not in conditions.get_text()
    assert {"$m_2$", "∞"} <= set(re.split(r"[\s,=]+", conditions.get_text()))


@pytest.mark.slow
def test_more_conditions_have_smaller_letters_and_at_most_three_lines(beads: xr.Dataset) -> None:
    plot_data = curves_of(beads, "beta")
    figures = [
        draw(replace(plot_data, conditions=", ".join(["e = 0.5"] * count)), Look(width="84mm", legend="full"))
        for count in (1, 23, 60)
    ]
    one, many, most = (figure.texts[1] for figure in figures)
    assert most.get_fontsize() == many.get_fontsize() < one.get_fontsize()
    assert many.get_text().split().count("e") == 23
    assert most.get_text().count("\n") == 2
    shown = most.get_text().split().count("e")
    assert most.get_text().replace("\n", " ").endswith(f"e = 0.5, and {60 - shown} more")
    # a wider figure has room for all
    figures[2].set_size_inches(12.0, 3.0)
    figures[2].canvas.draw()
    assert most.get_text().split().count("e") == 60


@pytest.mark.slow
def test_friction_laws_are_selected_as_models_are(
    beads: xr.Dataset, central: xr.Dataset, cli: Run, tmp_path: Path
) -> None:
    impact.save(beads, tmp_path / "beads.h5")
    impact.save(central, tmp_path / "central.h5")
    words = ["-k", "beta", "--friction", MINDLIN, "--friction", COULOMB, "--model", TSUJI]
    table = ["--data", "a.csv", "--data-form", "long"]
    done = cli("plot", "beads.h5", *words, "-o", "a.svg", *table, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = pd.read_csv(tmp_path / "a.csv", keep_default_na=False)
    assert rows.columns.tolist() == ["x_axis", "y_axis", "curve", "model", "friction", "x", "y"]
    assert rows["friction"].unique().tolist() == ["", MINDLIN, COULOMB]
    refused = {
        (
            "beads.h5",
            "--friction",
            "coulomb",
        ): 'no friction law "coulomb" in this result; did you mean "coulomb-1785"?',
        ("central.h5", "--friction", COULOMB): f'no friction law "{COULOMB}" in this result, which has none; '
        "sweep a config with frictions",
        ("central.h5", "-k", "beta"): "this result has no friction; sweep a config with frictions = [...]",
        ("beads.h5", "-k", "psi"): "this result has no psi1, psi2; list them in [output] variables",
        ("beads.h5", "-k", "beta", "--sel", "angle=9 deg"): "no angle = 9 deg in this result; the nearest are "
        "8° and 15°",
        ("beads.h5", "-k", "beta", "--sel", "angle=45"): '--sel angle=45.0: got 45 rad; did you mean "45 deg"?',
    }
    for options, message in refused.items():
        failed = cli("plot", *options, "-o", "b.svg", cwd=tmp_path)
        assert (failed.returncode, failed.stderr) == (2, f"{message}\n")


def test_a_value_is_selected_with_its_unit(beads: xr.Dataset) -> None:
    chosen = curves_of(beads, "beta", sel={"angle": "43 deg"})
    assert "angle = 43°" in conditions_of(chosen)
    (panel,) = chosen.panels
    assert panel.x_name == "mu"


@pytest.mark.slow
def test_more_pairs_than_can_be_told_apart_are_drawn_on_request(beads: xr.Dataset) -> None:
    models = ["hertz", "tsuji-1992", "gonthier-2004", "flores-2011", "hunt-crossley-1975"]
    many = sweep(models=models, frictions=[COULOMB, MINDLIN], friction={MINDLIN: {"xt": 0.0}})
    some = curves_of(many, "beta")
    assert len(of_pairs(some)) == MAX_PAIRS
    assert some.not_drawn == ("2 more pairs; choose some with models and frictions",)
    assert len(of_pairs(curves_of(many, "beta", frictions=[COULOMB, MINDLIN]))) == 10


@pytest.mark.slow
def test_pairs_of_two_codes_are_the_first_that_are_left_out() -> None:
    models = ["lammps-tsuji", "liggghts-hertz", "yade-en"]
    frictions = ["lammps-mindlin", "liggghts-history", "yade-mindlin", COULOMB]
    data = curves_of(sweep(models=models, frictions=frictions, friction={}), "beta")
    drawn = [curve.law for curve in of_pairs(data)]
    pairs = zip(models, frictions, strict=False)
    assert drawn[:6] == [f"{model} with {key}" for model, friction in pairs for key in (friction, COULOMB)]
    assert drawn[6:] == ["lammps-tsuji with liggghts-history", "lammps-tsuji with yade-mindlin"]


@pytest.mark.slow
def test_slips_are_those_of_maw_barber_and_fawcett() -> None:
    names = ["beta", "psi1", "psi2"]
    slips = sweep(
        models=["hertz"],
        frictions=[COULOMB, MINDLIN],
        friction={MINDLIN: {"xt": 0.0}},
        output={"variables": names},
    )
    data = curves_of(slips, "psi", sel={"mu": 0.1})
    (curve,) = of_pairs(data)
    before, after = np.array(curve.x), np.array(curve.y)
    stored = slips.sel(model="hertz", friction=MINDLIN, mu=0.1)
    assert curve.x == tuple(stored["psi1"].values[: before.size].tolist())
    assert -after / before == pytest.approx(stored["beta"].values[: before.size])
    # the rest slides throughout, along a line
    assert before[-1] <= 1.5 * before[after <= 0.0][-1] < stored["psi1"].values[before.size]
    (reason, beyond) = data.not_drawn
    assert reason == f"hertz with {COULOMB}: not defined"
    assert beyond.startswith("slips beyond psi1 = ")
    (panel,) = data.panels
    assert (panel.x_name, panel.y_name) == ("psi1", "psi2")
    (logarithmic,) = curves_of(slips, "psi", sel={"mu": 0.1}, log="xy").panels
    assert (logarithmic.x_log, logarithmic.y_log) == (True, False)
    check_layout(draw(data, Look(width="84mm")))


def test_the_equations_of_models_are_named_beside_friction_laws() -> None:
    two = sweep(models=["hertz", TSUJI], frictions=[COULOMB], friction={})
    for kind in ("friction-loop", "beta"):
        labels = [curve.label for curve in of_pairs(curves_of(two, kind, equations=True))]
        assert labels[0] == "Hertz (1882), (10) with Coulomb", kind


@pytest.mark.slow
def test_the_area_of_a_friction_loop_is_the_energy_lost(beads: xr.Dataset, cli: Run, tmp_path: Path) -> None:
    two = [COULOMB, FORCE]
    data = curves_of(beads, "friction-loop", sel={"angle": "15 deg", "mu": 0.3}, frictions=two)
    (panel,) = data.panels
    assert (panel.x_name, panel.y_name, panel.x_unit, panel.y_unit) == ("xi", "f", "m", "N")
    # a pair that cannot be combined has no motion
    pairs = of_pairs(curves_of(beads, "beta", frictions=two))
    assert [curve.law for curve in panel.curves] == [curve.law for curve in pairs]
    assert len(pairs) == 3
    for curve in panel.curves:
        lost = beads["friction_loss"].sel(model=curve.model, friction=curve.friction, mu=0.3).isel(angle=2)
        assert np.trapezoid(curve.y, curve.x) == pytest.approx(float(lost), rel=1e-3)
    one = curves_of(beads, "friction-loop", models=[TSUJI], frictions=[FORCE, COULOMB])
    shown = [curve.label.replace("\N{NO-BREAK SPACE}", " ") for curve in of_pairs(one)]
    assert shown == ["LAMMPS mindlin/force, xt = 0, limit = positive", "Coulomb"]
    assert conditions_of(one).startswith(model_label(beads.isel(model=0, mu=0, angle=0)))
    check_layout(draw(one, Look(width="84mm")))
    # a time history is drawn as it is, if it has friction
    impact.save(beads, tmp_path / "beads.h5")
    for friction, name in ((["--friction", FORCE], "oblique.h5"), ([], "central.h5")):
        source = ["beads.h5"] if friction else []
        assert cli("run", *source, *friction, "--history", name, cwd=tmp_path).returncode == 0
    done = cli("plot", "oblique.h5", "-k", "friction-loop", "-o", "a.svg", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    impact.save(impact.sweep(models="hertz", e=0.5), tmp_path / "sweep.h5")
    message = "this impact has no friction; run or sweep a config with frictions = [...]\n"
    for name in ("central.h5", "sweep.h5"):
        failed = cli("plot", name, "-k", "friction-loop", "-o", "b.svg", cwd=tmp_path)
        assert (failed.returncode, failed.stderr) == (2, message)


def test_other_pictures_do_not_depend_on_friction(beads: xr.Dataset) -> None:
    for kind, variable in (("final-velocities", "v1_post"), ("restitution", "e_out"), ("error", "e_error")):
        curve = next(c for c in curves_of(beads, kind).panels[0].curves if c.model and c.variable == variable)
        assert curve.y == tuple(beads[variable].isel(model=0, mu=0).values.tolist())
        assert curve.friction == ""
        assert "friction" not in curves_of(beads, kind).long_table()
    loop = curves_of(beads, "loop", sel={"angle": "43 deg"}, models=[TSUJI])
    assert max(loop.panels[0].curves[0].y) == pytest.approx(
        float(beads["peak_force"].isel(model=0, mu=0, angle=6)), rel=1e-3
    )
    plane = get_plot_data(beads, "map", Choice(variable="e_out"))
    assert isinstance(plane, MapData)
    assert [panel.law for panel in plane.panels] == list(MODELS)


@pytest.mark.slow
def test_a_map_of_friction_has_a_panel_for_each_pair(beads: xr.Dataset) -> None:
    plane = get_plot_data(beads, "map", Choice(models=[TSUJI], frictions=[COULOMB, MINDLIN]))
    assert isinstance(plane, MapData)
    assert (plane.x, plane.y, plane.variable) == ("angle", "mu", "beta")
    # the panels name the friction laws alone
    assert conditions_of(plane).startswith("Tsuji, Tanaka and Ishida (1992), speed = 3.9 m/s")
    for panel, key in zip(plane.panels, (COULOMB, MINDLIN), strict=True):
        assert panel.law == f"{TSUJI} with {key}"
        stored = beads["beta"].sel(model=TSUJI, friction=key).transpose("mu", "angle").values
        assert np.array_equal(panel.values, stored)
    assert plane.panels[0].label == "Coulomb"
    assert plane.title == "Tangential restitution of the contact points over angle and mu: Beads"
    wide = ["angle [rad]", "mu", f"beta {TSUJI} with {COULOMB}", f"beta {TSUJI} with {MINDLIN}"]
    assert list(plane.wide_table()) == wide
    long = plane.long_table()
    assert long["friction"].unique().tolist() == [COULOMB, MINDLIN]
    row = long[(long["friction"] == MINDLIN) & (long["mu"] == 0.3)].iloc[4]
    assert row["beta"] == beads["beta"].sel(model=TSUJI, friction=MINDLIN, mu=0.3)[4]
    check_layout(draw(plane, Look(width="84mm")))


def test_measured_points_are_drawn_over_pairs(beads: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("angle [deg], e_t\n30, 0.7\n45, 0.8\n", encoding="utf-8")
    figure = impact.plot(beads, kind="e-t", points=tmp_path / "points.csv", models=[TSUJI])
    assert names_of(figure)[-1] == "Measured"


def test_a_label_replaces_that_of_a_pair(beads: xr.Dataset) -> None:
    key = f"{TSUJI} with {COULOMB}"
    figure = impact.plot(beads, kind="beta", models=[TSUJI], frictions=[COULOMB], labels={key: "Rigid"})
    assert names_of(figure) == ["Rigid"]


def test_bands_of_uncertain_friction_are_of_pairs() -> None:
    dataset = sweep(
        models=[TSUJI],
        frictions=[COULOMB, MINDLIN],
        friction={MINDLIN: {"xt": 0.0}},
        sweep=BALLS | {"mu": {"uniform": [0.1, 0.3]}},
        design={"n": 16, "seed": 1},
    )
    curves = of_pairs(curves_of(dataset, "uncertainty", variable="beta"))
    assert [curve.friction for curve in curves] == [COULOMB, MINDLIN]
    for curve in curves:
        median = dataset["beta"].sel(model=TSUJI, friction=curve.friction).median("sample")
        assert curve.y == pytest.approx(median.values)


@pytest.mark.slow
def test_a_report_has_a_section_on_friction(beads: xr.Dataset, central: xr.Dataset) -> None:
    text = impact.report(beads)
    section = text.partition(">Friction</h2>")[2].partition("</section>")[0]
    captions = [find_kind(kind).caption for kind in (*SHOWN, "friction-loop")]
    # each kind once, and some of them again at other values of the axes that it does not draw over
    for caption in captions:
        assert caption in section
    assert text.count("<figure") > section.count("<figure") >= len(captions)
    for key in FRICTIONS:
        assert find_friction(key).title in section
    combined = int((beads["friction_status"] < 10).sum())
    assert f'class="number">{combined}</td>' in section
    assert "the contact force lacks what the friction law needs" in section
    assert "over angle, mu, compared with" in text
    assert ">Friction</h2>" not in impact.report(central)


def test_a_notebook_offers_the_kinds_of_friction_where_there_is_friction(
    beads: xr.Dataset, central: xr.Dataset
) -> None:
    explore = pytest.importorskip("impact.plots.explore")
    assert {*SHOWN} <= {*explore.kinds_to_offer(beads)}
    assert not any(find_kind(kind).of_friction for kind in explore.kinds_to_offer(central))
    assert explore.axes_of(beads) == ["angle", "mu"]


def test_kinds_of_friction_are_those_of_their_module() -> None:
    assert [kind for kind in KINDS if find_kind(kind).of_friction] == [
        kind for kind, module in KINDS.items() if module == "oblique"
    ]
