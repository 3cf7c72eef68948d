"""Friction laws are data with a source; a pair has the values of its code, or says what it lacks."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.contact.dimensionless import dimensionless_values
from impact.contact.friction import (
    FrictionLaw,
    Pair,
    check_friction,
    dashpot_power,
    friction_problems,
    friction_values,
    parameter_problem,
    required_inputs,
)
from impact.contact.frictions import find_friction, frictions
from impact.contact.impacts import Impacts
from impact.contact.materials import hertz_stiffness
from impact.contact.model import COORDINATE_COEFFICIENTS
from impact.contact.models import catalogue, find
from impact.contact.rigid import ObliqueImpacts
from impact.contact.status import FrictionStatus
from impact.contact.tangential import (
    LIMIT_POSITIVE,
    SLIP,
    SLIP_SCALE,
    TANGENTIAL_DAMPING,
    TANGENTIAL_STIFFNESS,
)
from impact.contact.units import dimension
from impact.errors import ModelError, UsageError

from . import friction_reference as reference
from .conftest import Run

# m/m_t of solid spheres
SOLID = 3.5
E, NU, R, M, V0, RESTITUTION = 2.1e11, 0.3, 0.01, 0.03, 1.7, 0.7
B = -math.log(RESTITUTION) / math.hypot(math.pi, math.log(RESTITUTION))
KEYS = {
    "coulomb": ["coulomb-1785"],
    "spring": [
        "cundall-strack-1979", "yade-cundall-strack", "yade-mindlin", "liggghts-history", "yade-viscoelastic",
        "kratos-viscous-coulomb", "lammps-linear-history", "lammps-mindlin", "lammps-mindlin-force",
        "lammps-mindlin-rescale", "lammps-mindlin-rescale-force", "lammps-classic-2025",
    ],
    "dashpot": ["liggghts-no-history", "lammps-linear-nohistory"],
    "regularized": ["simbody-hunt-crossley", "drake-regularized"],
    "cone": ["mujoco-elliptic"],
}  # fmt: skip
MEMORY = {
    "lammps-mindlin": (1, 1),
    "lammps-classic-2025": (1, 1),
    "lammps-mindlin-force": (0, 0),
    "lammps-mindlin-rescale": (1, 2),
    "lammps-mindlin-rescale-force": (0, 1),
    "liggghts-history": (1, 1),
    "yade-mindlin": (0, 0),
    "kratos-viscous-coulomb": (0, 1),
}


def impacts_of(n: object = 1.5, **changes: object) -> Impacts:
    """Make one impact of two like steel balls, with K by Hertz, or 1e6 for another exponent."""
    arrays = dict.fromkeys(("yield_strength1", "yield_strength2"), np.array([np.nan]))
    numbers: dict[str, object] = {"e": RESTITUTION, "v1": V0, "v2": 0.0, "n": n}
    for ball in "12":
        numbers |= {f"m{ball}": M, f"R{ball}": R, f"E{ball}": E, f"nu{ball}": NU}
    arrays |= {name: np.atleast_1d(value) for name, value in numbers.items()}
    arrays |= {name: np.asarray(value, float) for name, value in changes.items() if name != "parameters"}
    if "K" not in arrays:
        hertz = hertz_stiffness(*(arrays[name] for name in ("E1", "nu1", "E2", "nu2", "R1", "R2")))
        arrays["K"] = np.where(arrays["n"] == 1.5, hertz, 1e6)
    return Impacts(**arrays, parameters=changes.get("parameters", {}))  # type: ignore[arg-type]


def oblique_of(impacts: Impacts, **changes: object) -> ObliqueImpacts:
    """Make the tangential inputs of solid balls, of which ball 1 has a tangential velocity."""
    zero = np.array([0.0])
    inputs = {
        "u1": np.array([0.8]), "u2": zero, "omega1": zero, "omega2": zero,
        "inertia_factor1": np.array([0.4]), "inertia_factor2": np.array([0.4]), "mu": np.array([0.3]),
    }  # fmt: skip
    parameters = {name: np.asarray(value, float) for name, value in changes.pop("parameters", {}).items()}  # type: ignore[attr-defined]
    inputs |= {name: np.asarray(value, float) for name, value in changes.items()}
    return ObliqueImpacts(impacts, **inputs, parameters=parameters)


def values_of(friction: str, model: str = "hertz", n: float = 1.5, **parameters: float) -> dict[str, float]:
    """Compute the values of a pair for one impact."""
    oblique = oblique_of(impacts_of(n), parameters={name: [value] for name, value in parameters.items()})
    return {
        name: value.item()
        for name, value in friction_values(Pair(find(model), find_friction(friction)), oblique).items()
    }


# ---- the catalogue


def test_the_catalogue_has_the_laws_of_each_kind() -> None:
    assert {kind: [key for key, law in frictions().items() if law.kind == kind] for kind in KEYS} == KEYS
    assert {key: law.memory for key, law in frictions().items() if any(law.memory) or key in MEMORY} == MEMORY
    capped = {"liggghts-history", "yade-mindlin", "yade-viscoelastic"}
    assert {key for key, law in frictions().items() if law.cap == "spring"} == capped
    assert {key for key, law in frictions().items() if law.cap == "both"} == {"kratos-viscous-coulomb"}
    positive = {
        "drake-regularized",
        "simbody-hunt-crossley",
        "kratos-viscous-coulomb",
        *(key for key in frictions() if key.startswith("yade-")),
    }
    assert {key for key, law in frictions().items() if law.default_limit == "positive"} == positive


@pytest.mark.parametrize("law", frictions().values(), ids=frictions())
def test_a_friction_law_has_a_source_and_whole_parameters(law: FrictionLaw) -> None:
    assert law.evidence.state in ("seen", "not verified")
    assert law.evidence.state == "not verified" or "@" in law.evidence.source
    assert bool(law.doi) == bool(law.evidence.doi)
    for parameter in law.parameters:
        dimension(parameter.unit, {})
        assert parameter.meaning
        assert parameter.default is None or parameter.least <= parameter.default <= parameter.most
        assert (parameter.default is None) == parameter.optional
        assert not parameter.choices or parameter.most == len(parameter.choices) - 1


@pytest.mark.parametrize(("key", "name"), [("drake-regularized", "mu_d"), ("yade-mindlin", "betas")])
def test_the_description_of_a_law_says_what_a_parameter_is_if_unset(cli: Run, key: str, name: str) -> None:
    described = " ".join(cli("models", key, "--frictions").stdout.split())
    assert re.search(rf" {name}: [^;]*; unset, (μ|−ln e/√\(π² \+ ln² e\));", described)


@pytest.mark.parametrize(("model", "n"), [("anagnostopoulos-1988", 1.0), ("tsuji-1992", 1.5)])
def test_kratos_takes_a_part_of_the_stiffness_and_the_damping_ratio_of_its_contact_force(
    model: str, n: float
) -> None:
    values, part = values_of("kratos-viscous-coulomb", model, n), 2.0 * (1.0 - NU) / (2.0 - NU)
    of_contact = values_of("lammps-linear-nohistory", model, n)[TANGENTIAL_DAMPING]
    assert values[TANGENTIAL_STIFFNESS] == pytest.approx(part * n * SOLID, rel=1e-12)
    assert values[TANGENTIAL_DAMPING] == pytest.approx(math.sqrt(part) * of_contact, rel=1e-12)


def test_kratos_has_its_part_of_a_stiffness_that_is_set() -> None:
    """The law has no parameter for the tangential stiffness."""
    at = {
        "K": 1e7,
        "e": 0.7,
        "mu": 0.3,
        "angle": "40 deg",
        "v1": 1.0,
        "m1": 1.0,
        "m2": 1.0,
        "R1": 0.05,
        "R2": 0.05,
    }
    rows = impact.timestep("kratos-linear", friction="kratos-viscous-coulomb", at=at, steps_per_contact=[12]).rows
    assert rows[0].beta_mean == pytest.approx(0.2664, abs=1e-4)


def test_unknown_and_malformed_keys_are_refused() -> None:
    with pytest.raises(ModelError, match='no friction law "coulomb"; did you mean "coulomb-1785"'):
        find_friction("coulomb")
    with pytest.raises(ModelError, match="kebab-case"):
        replace(find_friction("coulomb-1785"), key="My law")


def test_the_catalogue_is_listed_and_a_law_is_described(cli: Run) -> None:
    assert list(impact.frictions()) == list(frictions())
    assert list(impact.frictions(search="yade adhesion")) == ["yade-mindlin"]
    with pytest.raises(UsageError, match='no friction law matches "x\\*"'):
        impact.frictions(pattern="x*")
    listing = cli("models", "--frictions").stdout
    assert all(key in listing for key in frictions())
    (record,) = json.loads(cli("models", "lammps-mindlin", "--json").stdout)
    assert record["memory"] == [1.0, 1.0]
    assert record["parameters"][-1]["choices"] == ["abs", "positive"]
    # the name of a contact force and of a friction law
    assert "F = K" in cli("models", "simbody-hunt-crossley").stdout
    card = " ".join(cli("models", "simbody-hunt-crossley", "--frictions").stdout.split())
    assert "[friction.simbody-hunt-crossley]" in card
    assert 'default "positive"' in card
    for words, message in (
        ("--frictions --family elastic", "--frictions: got it with --family"),
        ("--frictions --plugin absent.py", "--frictions: got it with --plugin"),
        ("--check absent.py --search hertz", "--check: got it with --search"),
        ("hertz --family dashpot", "hertz: got it with --family"),
        ("family:elastic --family dashpot", "--family: got the pattern family:elastic as well"),
    ):
        refused = cli("models", *words.split())
        assert (refused.returncode, refused.stderr) == (2, f"{message}, expected one of the two\n")


# ---- values by hand


def test_mindlins_stiffness_is_that_of_the_formula() -> None:
    G, R_eff = E / (2 * (1 + NU)), R / 2
    G_eff = G / (2 * (2 - NU))
    k_t = 8 * G_eff * math.sqrt(R_eff)
    K = impacts_of().K.item()
    for key in ("lammps-mindlin", "yade-mindlin", "liggghts-history"):
        assert values_of(key)[TANGENTIAL_STIFFNESS] == pytest.approx(SOLID * k_t / K, rel=1e-14)
    # (3/2) kappa, which is 2(1 - nu)/(2 - nu) for like balls
    assert k_t / K == pytest.approx(1.5 * 2 * (1 - NU) / (2 - NU), rel=1e-14)
    # the code's own K has no radius
    own = find("chrono-smc-plaincoulomb")
    oblique = oblique_of(impacts_of(K=[4e9]))
    values = friction_values(Pair(own, find_friction("lammps-mindlin-force")), oblique)
    assert values[TANGENTIAL_STIFFNESS].item() == pytest.approx(SOLID * k_t / 4e9, rel=1e-14)


def test_materials_of_unlike_balls_are_combined() -> None:
    impacts = impacts_of(E2=[7e10], nu2=[0.2], R2=[np.inf], m2=[np.inf])
    G1, G2 = E / (2 * (1 + NU)), 7e10 / (2 * 1.2)
    k_t = 8 / ((2 - NU) / G1 + 1.8 / G2) * math.sqrt(R)
    values = friction_values(Pair(find("hertz"), find_friction("lammps-mindlin")), oblique_of(impacts))
    assert values[TANGENTIAL_STIFFNESS].item() == pytest.approx(SOLID * k_t / impacts.K.item(), rel=1e-14)


@pytest.mark.parametrize(
    ("friction", "n", "unit"),
    [("cundall-strack-1979", 1.0, 1.0), ("lammps-mindlin", 1.5, 1.5), ("liggghts-history", 1.5, 1.5)],
)
def test_a_stiffness_relative_to_the_normal_one(friction: str, n: float, unit: float) -> None:
    assert values_of(friction, n=n, kt_over_kn=0.859)[TANGENTIAL_STIFFNESS] == pytest.approx(SOLID * 0.859 * unit)


@pytest.mark.parametrize(("friction", "power"), [("cundall-strack-1979", 0.0), ("lammps-mindlin", 0.5)])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.5])
def test_a_stiffness_in_si(friction: str, power: float, n: float) -> None:
    k_t, impacts = 4e5, impacts_of(n)
    m, K = M / 2, impacts.K.item()
    length = (m * V0**2 / K) ** (1 / (n + 1))
    expected = SOLID * k_t * length ** (2 + power) / (m * V0**2)
    assert values_of(friction, n=n, k_t=k_t)[TANGENTIAL_STIFFNESS] == pytest.approx(expected, rel=1e-13)
    assert Pair(find("hertz"), find_friction(friction)).form(n).stiffness_power == power


def test_liggghts_takes_the_stiffness_and_the_damping_of_its_contact_force() -> None:
    pair = Pair(find("liggghts-hertz"), find_friction("liggghts-history"))
    k = values_of("liggghts-history", "liggghts-hertz")[TANGENTIAL_STIFFNESS] / SOLID
    c = 2 * math.sqrt(5 / 6) * B * math.sqrt(k)
    for friction in ("liggghts-history", "liggghts-no-history"):
        assert values_of(friction, "liggghts-hertz")[TANGENTIAL_DAMPING] == pytest.approx(SOLID * c, rel=1e-14)
    assert (pair.form(1.5).stiffness_power, pair.form(1.5).damping_power) == (0.5, 0.25)
    linear = Pair(find("liggghts-hooke"), pair.friction)
    assert (linear.form(1.0).stiffness_power, linear.form(1.0).damping_power) == (0.0, 0.0)
    values = values_of("liggghts-history", "liggghts-hooke", 1.0)
    assert values[TANGENTIAL_STIFFNESS] == SOLID
    assert values[TANGENTIAL_DAMPING] == pytest.approx(SOLID * 2 * B, rel=1e-14)
    off = values_of("liggghts-history", "liggghts-hooke", 1.0, tangential_damping=0, tangential_reduce=1)
    assert (off[TANGENTIAL_STIFFNESS], off[TANGENTIAL_DAMPING]) == (1.0, 0.0)


def test_liggghts_reduction_for_linear_contacts_adds_no_values_to_those_of_hertz() -> None:
    oblique = oblique_of(impacts_of(), parameters={"tangential_reduce": [0.0, 1.0]})
    values = friction_values(Pair(find("liggghts-hertz"), find_friction("liggghts-history")), oblique)
    assert values[TANGENTIAL_STIFFNESS].size == 1
    assert values[TANGENTIAL_STIFFNESS].item() == values_of("liggghts-history")[TANGENTIAL_STIFFNESS]


def test_yades_damping_is_a_ratio_of_the_critical_one() -> None:
    k = values_of("yade-mindlin")[TANGENTIAL_STIFFNESS] / SOLID
    assert values_of("yade-mindlin")[TANGENTIAL_DAMPING] == pytest.approx(SOLID * 2 * B * math.sqrt(k), rel=1e-14)
    given = values_of("yade-mindlin", betas=0.2, kt_over_kn=0.5)
    assert given[TANGENTIAL_DAMPING] == pytest.approx(SOLID * 0.4 * math.sqrt(0.75), rel=1e-14)
    assert given[LIMIT_POSITIVE] == 1.0
    viscous = values_of("yade-viscoelastic", n=1.0, k_t=1e5, c_t=3.0)
    assert viscous[TANGENTIAL_DAMPING] == pytest.approx(SOLID * 3.0 / math.sqrt(M / 2 * 1e6), rel=1e-14)


@pytest.mark.parametrize(
    ("model", "n", "power", "c"),
    [
        ("lammps-coeff-restitution-hertz", 1.5, 0.25, math.sqrt(5) * B),
        ("lammps-coeff-restitution-hooke", 1.0, 0.0, 2 * B),
        ("lankarani-nikravesh-1990", 1.5, 1.5, 0.75 * (1 - RESTITUTION**2)),
        ("hertz", 1.5, 0.0, 0.0),
    ],
)
def test_lammps_takes_a_multiple_of_the_damping_of_the_contact_force(
    model: str, n: float, power: float, c: float
) -> None:
    for friction in ("lammps-linear-history", "lammps-linear-nohistory", "lammps-mindlin-rescale"):
        assert Pair(find(model), find_friction(friction)).form(n).damping_power == power
        values = values_of(friction, model, n, xt=0.6, **({} if "no" in friction else {"k_t": 1e5}))
        assert values[TANGENTIAL_DAMPING] == pytest.approx(SOLID * 0.6 * c, rel=1e-14)


def test_the_dashpot_of_a_law_is_found_where_it_is_declared() -> None:
    powers = {key: dashpot_power(law, law.exponent or 1.5) for key, law in catalogue().items()}
    without = {key for key, power in powers.items() if power is None}
    assert {"bilinear", "jkr-1971", "adams-impact", "jankowski-2006", "hertz-power-damping"} <= without
    assert len(without) < 30
    for key, power in powers.items():
        law = catalogue()[key]
        coefficients = COORDINATE_COEFFICIENTS[law.velocity_coordinate]
        if power is not None and coefficients:
            n = law.exponent or 1.5
            names = {"elastic": 1.3**n, "v": 0.3, "x": 1.3, "n": n, "v0": 1.0, "K": 1.0, coefficients[0]: 0.7}
            arguments = {name: np.asarray(names[name]) for name in _arguments(law) if name in names}
            assert law.force(**arguments) == pytest.approx(1.3**n + 0.7 * 1.3**power * 0.3), key


def _arguments(law: impact.ForceModel) -> tuple[str, ...]:
    from impact.contact.formula_calls import argument_names

    return argument_names(law.force)


def test_regularized_coefficients_are_those_of_the_codes() -> None:
    drake, simbody = (find_friction(key).coefficient for key in ("drake-regularized", "simbody-hunt-crossley"))
    assert drake is not None
    assert simbody is not None
    y = np.array([0.0, 0.5, 1.0, 2.0, 3.0, 9.0])
    assert np.asarray(drake(y, 0.6)).tolist() == pytest.approx([0, 0.5, 1, 0.8, 0.6, 0.6])
    assert np.asarray(simbody(y, 0.6, 0.1)).tolist() == pytest.approx(
        [0, 0.5 * (0.6 + 0.8 / 1.25) + 0.05, 1.1, 0.6 + 0.16 + 0.2, 0.6 + 0.08 + 0.3, 0.6 + 0.8 / 82 + 0.9]
    )
    values = values_of("simbody-hunt-crossley", v_t=0.02, mu_d=0.15, mu_v=0.5)
    assert values["friction.ratio"] == 0.5
    assert values["friction.viscous"] == pytest.approx(0.5 * 0.02 / 0.3)
    # y is g/v_t
    assert values[SLIP] * values[SLIP_SCALE] == pytest.approx(0.8 / 0.02)
    assert values_of("drake-regularized")["friction.ratio"] == 1.0


# ---- sharing of trajectories


def test_values_vary_only_along_the_axes_that_matter() -> None:
    column = np.array([[1.0], [2.0]])
    impacts = impacts_of(m1=column * M, m2=column * M, R1=[[R]], R2=[[R]], n=[[1.5]])
    oblique = oblique_of(impacts, u1=np.linspace(0.1, 1.0, 3)[None, :], mu=[[0.3]], omega1=[[5.0, 0.0, 1.0]])
    assert list(friction_values(Pair(find("hertz"), find_friction("coulomb-1785")), oblique)) == [LIMIT_POSITIVE]
    for key in ("lammps-mindlin", "liggghts-history", "yade-mindlin"):
        values = friction_values(Pair(find("liggghts-hertz"), find_friction(key)), oblique)
        assert values.pop(SLIP).shape == (1, 3)
        assert {name: value.size for name, value in values.items()} == dict.fromkeys(values, 1), key
    assert check_friction(Pair(find("hertz"), find_friction("lammps-mindlin")), oblique).shape == (1, 1)


def test_the_mass_ratio_has_the_same_bits_for_all_masses() -> None:
    masses = np.geomspace(1e-9, 1e9, 1001)
    for other in (masses[::-1], np.full(1001, np.inf)):
        oblique = oblique_of(impacts_of(m1=masses, m2=other, R1=[R]), inertia_factor2=[0.4])
        assert (oblique.mass_ratio == 1 / SOLID).all()
    against_wall = oblique_of(impacts_of(m1=masses, m2=[np.inf]), inertia_factor1=[2 / 3], inertia_factor2=[0.4])
    assert (against_wall.mass_ratio == 1 / 2.5).all()
    wall_first = oblique_of(impacts_of(m1=[np.inf], m2=masses), inertia_factor1=[0.4], inertia_factor2=[2 / 3])
    assert (wall_first.mass_ratio == 1 / 2.5).all()


# ---- what cannot be combined

DASHPOT = "the contact force has no dashpot C x^q v for the damping; set "
BRANCH = "8 G* a needs a contact force without permanent indentation and without unloading branch"


@pytest.mark.parametrize(
    ("model", "friction", "n", "parameters", "reason"),
    [
        ("bilinear", "lammps-linear-history", 1.0, {"k_t": 1e5}, f"{DASHPOT}xt = 0"),
        ("bilinear", "lammps-linear-history", 1.0, {"k_t": 1e5, "xt": 0.0}, ""),
        ("bilinear", "liggghts-history", 1.0, {}, f'{DASHPOT}tangential_damping = "off"'),
        ("bilinear", "liggghts-history", 1.0, {"tangential_damping": 0.0}, ""),
        # that of n = 3/2 follows from the stiffness, and not from the contact force
        ("lankarani-nikravesh-1994", "liggghts-history", 1.5, {"kt_over_kn": 0.3}, ""),
        ("lankarani-nikravesh-1994", "yade-mindlin", 1.5, {}, BRANCH),
        ("lankarani-nikravesh-1994", "yade-mindlin", 1.5, {"k_t": 1e5}, ""),
        ("hertz", "lammps-mindlin", 1.0, {}, "8 G* a needs a contact force of n = 1.5; set k_t"),
        ("hertz", "lammps-mindlin", 1.0, {"k_t": 1e5}, ""),
        ("hertz", "liggghts-history", 2.5, {}, "8 G* a needs a contact force of n = 1 or 1.5"),
        ("hertz", "lammps-mindlin", 1.0, {"kt_over_kn": 1.0}, "kt_over_kn needs a contact force of n = 1.5"),
        ("hertz", "cundall-strack-1979", 1.5, {"kt_over_kn": 1.0}, "kt_over_kn needs a contact force of n = 1"),
        ("hertz", "cundall-strack-1979", 1.5, {"k_t": 1e5}, ""),
        ("adams-impact", "coulomb-1785", 1.5, {}, ""),
    ],
)
def test_a_pair_lacks_what_its_friction_law_needs(
    model: str, friction: str, n: float, parameters: dict[str, float], reason: str
) -> None:
    oblique = oblique_of(impacts_of(n), parameters={name: [value] for name, value in parameters.items()})
    pair = Pair(find(model), find_friction(friction))
    assert friction_problems(pair, oblique) == ([reason] if reason else [])
    expected = FrictionStatus.NOT_COMBINABLE if reason else FrictionStatus.OK
    assert check_friction(pair, oblique).tolist() == [expected]


def test_liggghts_needs_a_restitution_only_where_its_tangential_damping_is_on() -> None:
    impacts = impacts_of(e=[np.nan, np.nan, RESTITUTION])
    oblique = oblique_of(impacts, parameters={"tangential_damping": [0.0, 1.0, 1.0]})
    statuses = check_friction(Pair(find("hertz"), find_friction("liggghts-history")), oblique).tolist()
    assert statuses == [FrictionStatus.OK, FrictionStatus.INVALID_PARAMETER, FrictionStatus.OK]


def test_adhesion_is_combined_with_the_friction_of_a_pressing_force() -> None:
    impacts = impacts_of(parameters={"gamma": np.array([0.0, 5.0])})
    for key, limit, expected in (
        ("coulomb-1785", 1.0, [1, 1]), ("coulomb-1785", 0.0, [1, 18]), ("lammps-mindlin", 1.0, [18, 18]),
    ):  # fmt: skip
        oblique = oblique_of(impacts, parameters={"limit": [limit], "xt": [0.0]})
        pair = Pair(find("jkr-1971"), find_friction(key))
        assert np.broadcast_to(check_friction(pair, oblique), 2).tolist() == expected, key
    assert 'limit = "positive"' in friction_problems(pair, oblique)[0]


def test_only_the_points_that_lack_something_have_the_status() -> None:
    oblique = oblique_of(impacts_of(1.0), parameters={"xt": [0.0, 0.5], "k_t": [1e5]})
    pair = Pair(find("bilinear"), find_friction("lammps-linear-history"))
    assert check_friction(pair, oblique).tolist() == [FrictionStatus.OK, FrictionStatus.NOT_COMBINABLE]
    mixed = oblique_of(impacts_of(n=[1.0, 1.5, 2.0]))
    pair = Pair(find("feng-2026"), find_friction("liggghts-history"))
    assert check_friction(pair, mixed).tolist() == [1, 1, 18]
    values = friction_values(pair, mixed)
    assert values[TANGENTIAL_DAMPING][0] == pytest.approx(SOLID * 2 * B)
    assert values[TANGENTIAL_DAMPING][1] == values_of("liggghts-history", "tsuji-1992")[TANGENTIAL_DAMPING]


def test_values_out_of_range_have_a_status() -> None:
    def status(friction: str, impacts: Impacts, **changes: object) -> int:
        return int(
            check_friction(Pair(find("hertz"), find_friction(friction)), oblique_of(impacts, **changes)).item()
        )

    above = {"mu_d": [0.4]}
    assert status("drake-regularized", impacts_of(), parameters=above) == FrictionStatus.INVALID_PARAMETER
    assert status("drake-regularized", impacts_of(), parameters={"mu_d": [0.3]}) == FrictionStatus.OK
    viscous = {"mu_v": [0.1]}
    assert status("simbody-hunt-crossley", impacts_of(), mu=[0.0], parameters=viscous) == 14
    assert status("yade-mindlin", impacts_of(e=[1.5])) == FrictionStatus.INVALID_PARAMETER
    assert status("yade-mindlin", impacts_of(e=[1.5]), parameters={"betas": [0.1]}) == FrictionStatus.OK
    assert status("lammps-mindlin", impacts_of(E1=[np.nan], K=[1.0])) == FrictionStatus.OUT_OF_RANGE
    # nothing is formed with mu = 0 that could fail
    assert all(
        status(key, impacts_of(), mu=[0.0], parameters={"k_t": [1e5]}) == 1
        for key in frictions()
        if "no-history" not in key
    )


def test_the_choice_of_a_stiffness_is_checked() -> None:
    linear, mindlin, liggghts = map(find_friction, ("cundall-strack-1979", "lammps-mindlin", "liggghts-history"))
    assert parameter_problem(linear, ["k_t"]) == ""
    assert parameter_problem(linear, []).startswith("k_t: missing, expected a stiffness [N/m]")
    both = ["k_t", "kt_over_kn"]
    assert parameter_problem(mindlin, both) == "k_t: set together with kt_over_kn, expected one of the two"
    assert parameter_problem(mindlin, [], n=1.5) == ""
    assert "K is set" in parameter_problem(mindlin, [], n=1.5, has_stiffness=True)
    assert parameter_problem(liggghts, [], n=1.5, has_stiffness=True).startswith("kt_over_kn: missing")
    assert parameter_problem(liggghts, [], n=1.0, has_stiffness=True) == ""
    assert parameter_problem(find_friction("coulomb-1785"), [], has_stiffness=True) == ""
    materials = {"E1", "nu1", "E2", "nu2"}
    assert required_inputs(mindlin, [], [1.5]) == materials
    assert required_inputs(mindlin, ["k_t"], [1.5]) == set()
    assert required_inputs(liggghts, [], [1.0]) == set()
    assert required_inputs(liggghts, [], [1.5]) == {*materials, "e"}
    assert required_inputs(find_friction("yade-mindlin"), ["betas"], [1.5]) == materials


# ---- rigid balls

COUNT = 200


def random_impacts() -> tuple[Impacts, dict[str, np.ndarray]]:
    """Make unlike balls with tangential velocities and spins; every seventh impact is against a wall."""
    rng = np.random.default_rng(39)
    m1, m2, R1, R2 = np.exp(rng.normal(size=(4, COUNT)))
    wall = np.arange(COUNT) % 7 == 0
    R2 = np.where(wall, np.inf, R2)
    m2 = np.where(wall, np.inf, m2)
    impacts = impacts_of(m1=m1, m2=m2, R1=R1, R2=R2, v1=1 + rng.random(COUNT), K=[1e6])
    motion = dict(zip(("u1", "u2", "omega1", "omega2"), rng.normal(size=(4, COUNT)), strict=True))
    motion["omega2"] = np.where(wall, 0.0, motion["omega2"])
    motion["u2"] = np.where(wall, 0.0, motion["u2"])
    motion |= {f"inertia_factor{ball}": 0.3 + 0.6 * rng.random(COUNT) for ball in "12"}
    return impacts, motion


def after(oblique: ObliqueImpacts, beta: float) -> dict[str, np.ndarray]:
    """Compute the motion after an impact with slip -beta g0."""
    P = oblique.m_t * oblique.slip * (1 + beta)
    masses = oblique.impacts.m1, oblique.impacts.m2
    return {
        "u1": oblique.u1 - P / masses[0], "u2": oblique.u2 + P / masses[1],
        "omega1": oblique.spin_after("1", P), "omega2": oblique.spin_after("2", P),
    }  # fmt: skip


def test_momentum_and_angular_momentum_are_kept_and_the_slip_is_met() -> None:
    impacts, motion = random_impacts()
    oblique = oblique_of(impacts, **motion)
    moved = after(oblique, 0.4)
    slip = replace(oblique, **moved).slip
    assert np.abs(slip + 0.4 * oblique.slip).max() < 1e-13 * np.abs(oblique.slip).max()
    balls = np.isfinite(impacts.m2)
    mass = {ball: np.where(balls, getattr(impacts, f"m{ball}"), 1.0) for ball in "12"}
    change = {ball: (moved[f"u{ball}"] - motion[f"u{ball}"]) for ball in "12"}
    momenta = np.array([mass[ball] * motion[f"u{ball}"] for ball in "12"])
    balance = mass["1"] * change["1"] + mass["2"] * change["2"]
    assert np.abs(balance / np.abs(momenta).max(axis=0))[balls].max() < 1e-14
    # about the contact point, of each ball by itself: I d(omega) = R m du, and -R m du of ball 2
    for ball, sign in (("1", 1.0), ("2", -1.0)):
        radius = np.where(balls, getattr(impacts, f"R{ball}"), 1.0)
        inertia = motion[f"inertia_factor{ball}"] * mass[ball] * radius**2
        spin = inertia * (moved[f"omega{ball}"] - motion[f"omega{ball}"])
        orbit = sign * radius * mass[ball] * change[ball]
        terms = (inertia * motion[f"omega{ball}"], radius * mass[ball] * motion[f"u{ball}"], spin)
        largest = np.max(np.abs(terms), axis=0)
        assert (np.abs(spin - orbit)[balls] / largest[balls]).max() < 1e-14


def test_mirror_image_exchange_of_balls_moving_frame_and_another_spin_of_the_same_slip() -> None:
    impacts, motion = random_impacts()
    oblique = oblique_of(impacts, **motion)
    moved = after(oblique, 0.4)
    size = max(np.abs(value).max() for value in moved.values())
    mirrored = after(replace(oblique, **{name: -motion[name] for name in moved}), 0.4)
    assert all((mirrored[name] == -moved[name]).all() for name in moved)
    # seen from the other side, the tangent and ball 1 change
    swap = {"1": "2", "2": "1"}
    fields = {
        f"{name}{ball}": getattr(impacts, f"{name}{swap[ball]}") for name in ("m", "R", "E", "nu") for ball in "12"
    }
    others = {
        f"{name}{ball}": motion[f"{name}{swap[ball]}"] for name in ("omega", "inertia_factor") for ball in "12"
    }
    others |= {f"u{ball}": -motion[f"u{swap[ball]}"] for ball in "12"}
    exchanged = after(oblique_of(replace(impacts, **fields), **others), 0.4)
    for ball in "12":
        assert np.abs(exchanged[f"u{ball}"] + moved[f"u{swap[ball]}"]).max() < 1e-14 * size
        assert np.abs(exchanged[f"omega{ball}"] - moved[f"omega{swap[ball]}"]).max() < 1e-14 * size
    shifted = after(replace(oblique, u1=oblique.u1 + 3.0, u2=oblique.u2 + 3.0), 0.4)
    balls = np.isfinite(impacts.m2)
    for ball in "12":
        assert np.abs(shifted[f"u{ball}"] - 3.0 - moved[f"u{ball}"])[balls].max() < 1e-13 * size
    # the spin of ball 1 grows, its velocity falls
    spun = replace(oblique, omega1=oblique.omega1 + 2.0, u1=oblique.u1 - 2.0 * impacts.R1)
    assert np.abs(spun.G0 - oblique.G0).max() < 1e-13 * np.abs(oblique.G0).max()
    assert np.abs(after(spun, 0.4)["omega1"] - 2.0 - moved["omega1"]).max() < 1e-13 * size


def test_a_wall_a_plane_an_unknown_radius_and_an_infinite_inertia() -> None:
    P = np.array([0.01])
    wall = oblique_of(impacts_of(m2=[np.inf], R2=[np.nan]))
    assert wall.m_t.item() == pytest.approx(M / SOLID, rel=1e-15)
    assert wall.spin_after("2", P).item() == 0.0
    assert wall.spin_after("1", P).item() == pytest.approx(-0.01 / (0.4 * M * R))
    plane = oblique_of(impacts_of(m2=[2 * M], R2=[np.inf]))
    assert plane.m_t.item() == pytest.approx(1 / (SOLID / M + 1 / (2 * M)))
    assert plane.spin_after("2", P).item() == 0.0
    unknown = oblique_of(impacts_of(R1=[np.nan]))
    assert unknown.slip.item() == 0.8
    assert np.isnan(unknown.spin_after("1", P)).all()
    fixed = oblique_of(impacts_of(R1=[np.nan]), inertia_factor1=[np.inf], inertia_factor2=[np.inf])
    assert fixed.mass_ratio.item() == 1.0
    assert fixed.spin_after("1", P).item() == 0.0


# ---- the values and forms, integrated by the independent solver

ZETA = 0.1128084507
HERTZ_KAPPA = 2 * (1 - NU) / (2 - NU)
LINEAR_GAP = ("anagnostopoulos-1988", 1.0, 0.7)


@pytest.mark.parametrize(
    ("model", "friction", "parameters", "g0", "beta"),
    [
        (("hertz", 1.0, 1.0), "cundall-strack-1979", {"k_t": 0.8}, 1.0, 0.4769459935),
        (LINEAR_GAP, "cundall-strack-1979", {"kt_over_kn": 2 / 7}, 1.0, 0.6169228848),
        (LINEAR_GAP, "lammps-linear-history", {"k_t": 2 / 7}, 0.2, 0.3349560103),
        (LINEAR_GAP, "liggghts-history", {"tangential_reduce": 1}, 0.2, 0.2843498352),
        (LINEAR_GAP, "yade-viscoelastic", {"k_t": 2 / 7, "c_t": 2 * ZETA}, 0.2, 0.349907081229),
        (LINEAR_GAP, "lammps-linear-nohistory", {}, 0.2, -0.0837190762),
        (("bilinear", 1.0, 0.7), "cundall-strack-1979", {"k_t": 2 / 7}, 1.0, 0.7250747576),
        (("hertz", 1.5, 1.0), "lammps-mindlin", {"kt_over_kn": HERTZ_KAPPA}, 0.6, 0.1381289427),
        (("hertz", 1.5, 1.0), "lammps-mindlin-force", {"kt_over_kn": HERTZ_KAPPA}, 0.6, 0.0878103927),
        (("hertz", 1.5, 1.0), "lammps-mindlin-rescale", {"kt_over_kn": HERTZ_KAPPA}, 0.6, 0.1460639875),
        (("hertz", 1.5, 1.0), "lammps-mindlin-rescale-force", {"k_t": 1.5 * HERTZ_KAPPA}, 0.6, 0.0954038379),
        (("hertz", 1.0, 1.0), "drake-regularized", {"v_s": 0.01}, 0.5, -0.0003627776),
    ],
)
def test_a_pair_reaches_the_reference_numbers(
    model: tuple[str, float, float], friction: str, parameters: dict[str, float], g0: float, beta: float
) -> None:
    key, n, e = model
    impacts = impacts_of(n, K=[1.0], v1=[1.0], e=[e], m1=[1.0], m2=[np.inf], R2=[np.inf])
    oblique = oblique_of(impacts, u1=[g0], parameters={name: [value] for name, value in parameters.items()})
    pair = Pair(find(key), find_friction(friction))
    assert check_friction(pair, oblique).tolist() == [FrictionStatus.OK]
    values = {name: value.item() for name, value in friction_values(pair, oblique).items()}
    form, coefficient = pair.form(n), pair.friction.coefficient
    # G' = -phi is the motion of a mass 1 under a friction of mu 1
    law = reference.Friction(
        form.kind,
        mu=1.0,
        m_t=1.0,
        k_t=values.get(TANGENTIAL_STIFFNESS, 0.0),
        kp=form.stiffness_power,
        memory=form.memory,
        c_t=values.get(TANGENTIAL_DAMPING, 0.0),
        q=form.damping_power,
        cap=form.cap,
        positive=values[LIMIT_POSITIVE] > 0,
        coefficient=None
        if coefficient is None
        else lambda G: float(np.asarray(coefficient(values[SLIP_SCALE] * G, values["friction.ratio"]))),
    )
    of_law = {name: value.item() for name, value in dimensionless_values(pair.model, impacts).items()}
    is_elastic = key == "hertz"
    normal = reference.spring_dashpot(n) if is_elastic else reference.normal_law(pair.model, n, of_law)
    outcome = reference.solve(normal, law, values[SLIP])
    assert reference.beta(outcome, values[SLIP]) == pytest.approx(beta, abs=2e-9)


@pytest.mark.parametrize("key", frictions())
def test_the_description_of_a_law_with_a_stiffness_says_what_it_is(key: str) -> None:
    lines = str(impact.describe(find_friction(key))).splitlines()
    assert any(line.startswith("stiffness  ") for line in lines) == bool(find_friction(key).stiffness)
