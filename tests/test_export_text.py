"""Lines for codes that we do not run: in the formula of the code's own source, they give the exported law.

Each formula is written after the source that the exporter's module names, apart from the package. It reads the
numbers from the lines, and its equation of motion is integrated with scipy.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impact
from impact.exporters.export import Export
from impact.exporters.problem import prepare_export
from impact.exporters.registry import CODES

from .conftest import Run, assert_refused, default_law

# effective mass 0.75 kg and effective radius 0.03 m
V0, M1, M2, R1, R2 = 1.5, 1.0, 3.0, 0.04, 0.12
M = M1 * M2 / (M1 + M2)
R = R1 * R2 / (R1 + R2)
BALLS = {"v1": V0, "v2": 0.0, "m1": M1, "m2": M2, "R1": R1, "R2": R2}
MATERIALS = {"soft": {"E": 1e9, "nu": 0.3}, "hard": {"E": 5e9, "nu": 0.2}}
MODULUS = 1.0 / ((1.0 - 0.3**2) / 1e9 + (1.0 - 0.2**2) / 5e9)
EPSILON = float(np.finfo(float).eps)
NUMBER = r"([-+0-9.e]+)"

Force = Callable[[float, float], float]


def config(*materials: str, **values: object) -> dict[str, object]:
    """A config of the two balls that asks for e = 0.55, with materials or with a stiffness."""
    named = {f"material{i}": name for i, name in enumerate(materials, 1)}
    return {"models": "hertz", "materials": MATERIALS, "sweep": BALLS | {"e": 0.55} | named | values}


def collide(force: Force, mass: float, speed: float, scale: float) -> tuple[float, float]:
    """The restitution and the peak indentation by an equation of motion, to zero indentation.

    Parameters
    ----------
    force : of indentation and its rate, positive where it pushes
    mass, speed : effective mass and closing speed, in the units of the force
    scale : expected size of the indentation
    """

    def rate(t: float, y: Sequence[float]) -> tuple[float, float]:
        return y[1], -force(max(y[0], 0.0), y[1]) / mass

    def gap(t: float, y: Sequence[float]) -> float:
        return y[0]

    def velocity(t: float, y: Sequence[float]) -> float:
        return y[1]

    gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
    duration = 200.0 * scale / speed
    # a first step that begins inside the contact, so that the event is the end
    start = 1e-9 * scale
    done = solve_ivp(
        rate, (0.0, duration), (start, speed), "DOP853", events=(gap, velocity), rtol=1e-11, atol=1e-14 * scale,
        max_step=scale / speed / 50.0,
    )  # fmt: skip
    (end,), (peak, *_) = done.y_events
    return float(-end[1] / speed), float(peak[0])


def same_law(
    name: str,
    key: str | None,
    force_of: Callable[[Sequence[str]], Force],
    source: dict[str, object],
    at: Mapping[str, float],
    length: float = 1.0,
) -> Export:
    """Export a law, check that its lines give its restitution and its peak indentation, and return it.

    Parameters
    ----------
    name, key, source, at : see `impact.export`
    force_of : the force of the code [N] from the lines, for an indentation and a rate in its unit of length
    length : units of length of the code in 1 m
    """
    export = impact.export(name, key, source=source, at=at)
    scale = V0 * export.contact_time * length
    e, peak = collide(force_of(export.lines), M / length, V0 * length, scale)
    problem = prepare_export(CODES[name], key, export.version, source, at, ())
    assert e == pytest.approx(export.e_continuous, abs=1e-6)
    assert peak == pytest.approx(problem.law.continuous["peak_indentation"] * length, rel=1e-6)
    return export


def arguments(lines: Sequence[str], pattern: str) -> list[float]:
    """The numbers in lines that match a pattern, in which # is a number."""
    return [
        float(value)
        for match in re.finditer(pattern.replace("#", NUMBER), "\n".join(lines))
        for value in match.groups()
    ]


# ---- Chrono: ChContactSMC.cpp, ChContactMaterialSMC.cpp, ChIterativeSolverMulticoreSMC.cpp


def chrono_force(lines: Sequence[str]) -> Force:
    """Fn = kn δ − gn vn of a version of the code, from what the lines set; vn < 0 on approach."""
    text = "\n".join(lines)
    multicore = "ChSystemMulticoreSMC sys;" in text
    (model,) = re.findall(r"ChSystemSMC::(Hertz|Hooke|PlainCoulomb|Flores)", text)
    properties = re.search(r"(UseMaterialProperties\(|use_material_properties = )true", text) is not None
    young, poisson = arguments(lines, r"SetYoungModulus\(#\)"), arguments(lines, r"SetPoissonRatio\(#\)")
    # one material for both balls, or one for each
    young, poisson = (young * 2)[:2], (poisson * 2)[:2]
    inverse = sum((1.0 - nu * nu) / modulus for modulus, nu in zip(young, poisson, strict=True))
    cr = min(arguments(lines, r"SetRestitution\(#\)"), default=math.nan)
    kn_own, gn_own = arguments(lines, r"SetKn\(#\)"), arguments(lines, r"SetGn\(#\)")
    speed = ([*arguments(lines, r"SetCharacteristicImpactVelocity\(#\)"), *arguments(lines, "vel = #;")] or [1.0])[
        0
    ]
    # Bullet: the default radius; multicore: that of the shapes
    radius = R if multicore else (arguments(lines, r"SetDefaultEffectiveCurvatureRadius\(#\)") or [0.1])[0]
    loge = math.log(max(cr, EPSILON)) if properties else math.nan
    beta = loge / math.sqrt(loge * loge + math.pi**2)

    def force(delta: float, rate: float) -> float:
        vn = -rate
        if model == "Hooke" and properties:
            k = 16.0 / 15.0 * math.sqrt(radius) / inverse
            kn = k * (M * speed * speed / k) ** 0.2
            gn = math.sqrt(4.0 * M * kn / (1.0 + (math.pi / loge) ** 2))
        elif model == "Hooke":
            kn, gn = kn_own[0], M * gn_own[0]
        elif properties:
            Sn = 2.0 / inverse * math.sqrt(delta if model == "PlainCoulomb" else radius * delta)
            kn = 2.0 / 3.0 * Sn
            gn = -2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(Sn * M)
            if model == "Flores":
                gn = 8.0 * (1.0 - max(cr, 0.01)) * kn * delta / (5.0 * max(cr, 0.01) * speed)
        else:
            factor = radius * math.sqrt(delta)
            kn, gn = factor * kn_own[0], factor * M * gn_own[0]
        # with the sign of the code, where the normal points from ball 1 to ball 2
        total = kn * delta - gn * vn
        return total if multicore else max(total, 0.0)

    return force


# a law, the materials, other inputs of the config, and inputs of --at
CHRONO: tuple[tuple[str, tuple[str, ...], dict[str, float], dict[str, float]], ...] = (
    ("chrono-smc-hertz", ("soft", "hard"), {}, {}),
    ("chrono-smc-hertz", (), {"K": 1e9}, {}),
    ("chrono-smc-hooke", ("soft", "hard"), {}, {"chrono-smc-hooke.vc": 2.5}),
    ("chrono-smc-hooke", (), {"K": 1e7, "n": 1}, {}),
    ("chrono-smc-plaincoulomb", ("soft", "hard"), {}, {}),
    ("chrono-smc-plaincoulomb", (), {"K": 1e9}, {}),
    ("chrono-smc-flores", ("soft", "hard"), {}, {"chrono-smc-flores.vc": 2.0}),
    ("tsuji-1992", ("soft", "hard"), {}, {}),
    ("liggghts-hooke", ("soft", "hard"), {}, {}),
    ("liggghts-hooke", (), {"K": 1e7, "n": 1}, {}),
    ("kelvin-voigt-no-tension", (), {"K": 1e7, "n": 1}, {"e": 0.7}),
    ("kuwabara-kono-1987", (), {"K": 1e9}, {"e": 0.7}),
    ("kuwabara-kono-1987", ("soft", "hard"), {}, {"e": 0.7}),
)


@pytest.mark.slow
@pytest.mark.parametrize(("key", "materials", "inputs", "at"), CHRONO)
def test_the_lines_of_chrono_give_the_law(
    key: str, materials: Sequence[str], inputs: Mapping[str, float], at: Mapping[str, float]
) -> None:
    same_law("chrono", key, chrono_force, config(*materials, **inputs), at)


def test_every_law_of_chrono_is_compared() -> None:
    assert {key for key, *_ in CHRONO} == CODES["chrono"].laws.keys()


def test_chrono_hertz_delivers_the_value_known_for_zero_force() -> None:
    """ζ = 0.2154537620 of e = 0.5 gives exp(−2ζ acos ζ/√(1 − ζ²)) = 0.5503."""
    export = impact.export("chrono", default_law("chrono"), source=config("soft", "soft", e=0.5))
    assert export.e_continuous == pytest.approx(0.5503, abs=5e-5)
    assert "delivers 0.550283 where e = 0.5 is asked for" in export.warnings[0]


def test_chrono_takes_both_materials_or_a_modulus_that_gives_the_stiffness() -> None:
    export = impact.export("chrono", default_law("chrono"), source=config("soft", "hard", e=0.5))
    two = export.parameters
    assert any(line.startswith("two materials: E* = ") for line in export.header)
    assert (two["YoungModulus"], two["PoissonRatio2"]) == (1e9, 0.2)
    assert two["EffectiveCurvatureRadius"] == pytest.approx(0.03, rel=1e-15)
    # E* = 3 K/(4 √R) and E = 2 (1 − ν²) E*
    one = impact.export("chrono", default_law("chrono"), source=config(e=0.5, K=1e9))
    assert one.parameters["YoungModulus"] == pytest.approx(2.0 * 0.91 * 0.75e9 / math.sqrt(0.03), rel=1e-14)
    says = "the modulus gives K = 1e+09 with a Poisson ratio of 0.3"
    assert [says in header for header in (export.header, one.header)] == [False, True]


@pytest.mark.parametrize("key", CODES["chrono"].laws)
def test_chrono_takes_coefficients_for_two_laws_and_properties_of_the_material_for_the_others(key: str) -> None:
    at = {"chrono-smc-flores.vc": 1.0} if key == "chrono-smc-flores" else {}
    parameters = impact.export("chrono", key, at={"e": 0.6, **at}).parameters
    has_coefficients = key in ("kelvin-voigt-no-tension", "kuwabara-kono-1987")
    assert ({"Kn", "Gn"} <= parameters.keys(), "YoungModulus" in parameters) == (
        has_coefficients,
        not has_coefficients,
    )


@pytest.mark.slow
def test_chrono_says_what_its_settings_enter_for_the_laws_that_have_them_only() -> None:
    hooke, plain = {"chrono-smc-hooke", "liggghts-hooke"}, "chrono-smc-plaincoulomb"
    about = {
        "the stiffness follows from the characteristic impact velocity": {(key, True) for key in hooke},
        "the damping is divided by characteristic_vel": {("chrono-smc-flores", True)},
        "the stiffness does not depend on the radii": {(plain, True), (plain, False)},
        # the stiffness of these has R*, and the system without Multicore takes it from the collision detection
        "with Bullet, R* is one value for all contacts": {
            ("chrono-smc-hooke", True),
            *itertools.product(("chrono-smc-hertz", "kuwabara-kono-1987"), (True, False)),
        },
    }
    named: dict[str, set[tuple[str, bool]]] = {text: set() for text in about}
    for key, materials, inputs, at in CHRONO:
        header = impact.export("chrono", key, source=config(*materials, **inputs), at=at).header
        for text in about:
            if any(line.startswith(text) for line in header):
                named[text].add((key, bool(materials)))
    assert named == about


def test_chrono_multiplies_a_given_damping_by_the_effective_mass_as_its_header_says() -> None:
    key = "kelvin-voigt-no-tension"
    linear = impact.export("chrono", key, source=config(K=1e7, n=1), at={f"{key}.C": 300.0})
    assert linear.parameters["Gn"] == pytest.approx(300.0 / M, rel=1e-14)
    assert "the system multiplies Gn by m, with m = m1 m2/(m1 + m2)" in linear.header
    key = "kuwabara-kono-1987"
    hertz = impact.export("chrono", key, source=config(K=1e9), at={f"{key}.A": 1e-5})
    # the force is K (1.5 A sqrt(delta) v) of the law
    assert hertz.parameters["Gn"] == pytest.approx(1.5 * 1e-5 * 1e9 / (R * M), rel=1e-14)
    factors = "Kn by R* sqrt(delta), Gn by R* sqrt(delta) m"
    assert f"the system multiplies {factors}, with m = m1 m2/(m1 + m2)" in hertz.header


def test_chrono_says_in_which_of_its_systems_a_contact_pulls() -> None:
    pulls, pushes = "the force may become attractive before separation", "the force is never negative"
    for key, text in (("tsuji-1992", pulls), ("chrono-smc-hertz", pushes)):
        header = impact.export("chrono", key, source=config("soft", "hard")).header
        assert [line.startswith(text) for line in header if line.startswith((pulls, pushes))] == [True], key


def test_the_header_lists_the_defaults_of_table_1_that_enter() -> None:
    header = impact.export("chrono", "chrono-smc-hertz", at={"e": 0.5, "K": 1e9, "m1": 3.0}).header
    assert "defaults of Table 1 of the paper: v1 = 1 m/s, m2 = 1 kg" in header
    given = {"e": 0.5, "K": 1e9, "m1": 3.0, "m2": 1.0, "v1": 1.0}
    header = impact.export("chrono", "chrono-smc-hertz", at=given).header
    assert not any("Table 1" in line for line in header)


@pytest.mark.slow
def test_the_header_says_which_damping_was_solved_for() -> None:
    export = impact.export("chrono", "kelvin-voigt-no-tension", at={"e": 0.6})
    assert export.solved is not None
    assert f"C = {export.solved['C']!r} gives the e that is wanted" in export.header


@pytest.mark.slow
def test_the_header_says_what_the_step_delivers_and_recommends_no_longer_one_than_needed() -> None:
    balls = {"K": 1e8, "m1": 0.1, "m2": 0.1, "R1": 0.01, "R2": 0.01, "v1": 1.0, "e": 0.8}
    source = {
        "models": ["tsuji-1992"],
        "frictions": ["lammps-mindlin"],
        "sweep": balls | {"angle": "60 deg", "mu": 0.1},
        "friction": {"lammps-mindlin": {"kt_over_kn": 0.8}},
    }
    export = impact.export("lammps", source=source, dt=5e-6, code_version="22Jul2025")
    at_dt = export.as_dict()["beta_at_dt"]
    delivered = f"mean beta {at_dt['mean']:.4f}, {at_dt['least']:.4f} to {at_dt['largest']:.4f}"
    assert f"friction: lammps-mindlin, {delivered}" in export.header
    needed = impact.timestep("tsuji-1992", source={"sweep": balls}, tol=0.01, steps_per_contact=10).needed
    assert needed is not None
    (line,) = (line for line in export.header if line.startswith("recommended"))
    recommended = float(line.split()[3])
    assert 0.99 * needed.dt < recommended <= needed.dt


def test_a_step_that_is_too_large_needs_a_softer_material_and_no_other_characteristic_speed() -> None:
    export = impact.export("liggghts", "liggghts-hooke", at={"e": 0.7, "v1": 1.0}, dt=1.2e-5)
    assert export.needed is not None
    assert export.needed.parameter == "materials.table1.E"


def test_the_classes_of_chrono_have_the_names_of_the_release() -> None:
    new = "\n".join(impact.export("chrono", code_version="9.0.0").lines)
    old = "\n".join(impact.export("chrono", code_version="8.0.0").lines)
    assert "<ChContactMaterialSMC>" in new
    assert "\nChCollisionInfo::" in new
    assert "<ChMaterialSurfaceSMC>" in old
    assert "\ncollision::ChCollisionInfo::" in old


def test_a_wall_of_chrono_gets_a_mass_that_does_not_change_the_effective_one() -> None:
    export = impact.export(
        "chrono", default_law("chrono"), source=config("soft", "hard", e=0.5), at={"m2": math.inf}
    )
    (mass,) = arguments(export.lines, r"wall->SetMass\(#\)")
    assert mass * M1 / (mass + M1) == pytest.approx(M1, rel=2e-9)
    # the header says so to whoever writes another wall
    two_balls = impact.export("chrono", default_law("chrono"), source=config("soft", "hard", e=0.5))
    about_mass = ["mass of a fixed body" in "".join(each.header) for each in (export, two_balls)]
    assert about_mass == [True, False]


def test_flores_at_another_speed_than_its_characteristic_one_is_warned_about() -> None:
    key = "chrono-smc-flores"
    same = impact.export("chrono", key, source=config("soft", "hard", e=0.9), at={f"{key}.vc": V0})
    other = impact.export("chrono", key, source=config("soft", "hard", e=0.9), at={f"{key}.vc": 2.0 * V0})
    assert not any("characteristic_vel" in warning for warning in same.warnings)
    assert any("characteristic_vel = 3 m/s" in warning for warning in other.warnings)


# ---- MercuryDPM: NormalForceSpecies and NormalForceInteractions


def mercurydpm_force(lines: Sequence[str]) -> Force:
    species = lines[0].removesuffix(" species;")
    loge_term = lambda loge: loge / math.sqrt(math.pi**2 + loge * loge)  # noqa: E731
    if species == "LinearViscoelasticSpecies":
        k, eps, mass = arguments(lines, r"setStiffnessAndRestitutionCoefficient\(#, #, #\)")
        dissipation = -math.sqrt(2.0 * mass * k) * loge_term(math.log(eps))
        return lambda overlap, rate: k * overlap + dissipation * rate
    if species == "HertzianViscoelasticSpecies":
        modulus, rest = arguments(lines, r"setEffectiveElasticModulusAndRestitutionCoefficient\(#, #\)")
        factor = math.sqrt(5.0) * abs(loge_term(math.log(rest)))

        def hertz(overlap: float, rate: float) -> float:
            stiffness = 4.0 / 3.0 * modulus * math.sqrt(R * overlap)
            return stiffness * overlap + factor * math.sqrt(M * stiffness) * rate

        return hertz
    assert species == "HertzianBSHPViscoelasticSpecies"
    (modulus,) = arguments(lines, r"setEffectiveElasticModulus\(#\)")
    (dissipation,) = arguments(lines, r"setDissipation\(#\)")

    def bshp(overlap: float, rate: float) -> float:
        stiffness = 4.0 / 3.0 * modulus * math.sqrt(R * overlap)
        return max(0.0, stiffness * overlap + 1.5 * dissipation * stiffness * rate)

    return bshp


MERCURYDPM: tuple[tuple[str, tuple[str, ...], dict[str, float], dict[str, float]], ...] = (
    ("mercurydpm-linear-viscoelastic", (), {"K": 1e7, "n": 1}, {}),
    ("tsuji-1992", ("soft", "hard"), {}, {}),
    ("tsuji-1992", (), {"K": 1e9}, {}),
    ("kuwabara-kono-1987", ("soft", "hard"), {}, {"e": 0.7}),
)


@pytest.mark.slow
@pytest.mark.parametrize(("key", "materials", "inputs", "at"), MERCURYDPM)
def test_the_lines_of_mercurydpm_give_the_law(
    key: str, materials: Sequence[str], inputs: Mapping[str, float], at: Mapping[str, float]
) -> None:
    export = same_law("mercurydpm", key, mercurydpm_force, config(*materials, **inputs), at)
    assert export.e_continuous == pytest.approx(at.get("e", 0.55), abs=1e-8)


def test_every_law_of_mercurydpm_is_compared() -> None:
    assert {key for key, *_ in MERCURYDPM} == CODES["mercurydpm"].laws.keys()


def test_mercurydpm_gets_twice_the_effective_mass_and_the_modulus_of_the_pair() -> None:
    linear = impact.export("mercurydpm", default_law("mercurydpm"), source=config(e=0.5, K=1e7, n=1)).parameters
    assert linear == {"stiffness": 1e7, "restitution": 0.5, "mass": 1.5}
    hertz = impact.export("mercurydpm", "tsuji-1992", source=config("soft", "hard", e=0.5)).parameters
    assert hertz == {"effectiveElasticModulus": pytest.approx(MODULUS, rel=1e-13), "restitution": 0.5}


@pytest.mark.parametrize(("law", "pulls"), [("tsuji-1992", True), ("kuwabara-kono-1987", False)])
def test_the_export_to_mercurydpm_says_whether_the_force_pulls(law: str, pulls: bool) -> None:
    header = impact.export("mercurydpm", law, source=config("soft", "hard"), at={"e": 0.7}).header
    assert any("the force pulls before the contact ends" in line for line in header) is pulls
    assert any("the force is never negative" in line for line in header) is not pulls


# ---- Modelica: ElastoGap.mo


def modelica_force(lines: Sequence[str]) -> Force:
    c, d, n, s_rel0 = arguments(lines, r"contact\(c = #, d = #, n = #, s_rel0 = #\)")

    def force(compression: float, rate: float) -> float:
        s_rel, v_rel = s_rel0 - compression, -rate
        f_c = -c * abs(s_rel - s_rel0) ** n if s_rel < s_rel0 else 0.0
        f_d = min(max(d * v_rel, f_c), -f_c)
        return -(f_c + f_d)

    return force


@pytest.mark.slow
@pytest.mark.parametrize("n", [1.0, 1.5])
def test_the_lines_of_modelica_give_the_law(n: float) -> None:
    export = same_law("modelica", default_law("modelica"), modelica_force, config(K=1e8, n=n), {"e": 0.6})
    assert export.e_continuous == pytest.approx(0.6, abs=1e-8)


def test_the_contact_of_modelica_begins_where_the_flanges_meet() -> None:
    export = impact.export("modelica", "modelica-elastogap", at={"d": 1e3})
    assert arguments(export.lines, r"s_rel0 = #") == [0.0]


# ---- Adams: IMPACT and STEP, in mm


def adams_force(lines: Sequence[str]) -> Force:
    """The force in N, of mm and mm/s."""
    names = ("stiffness", "damping", "exponent", "dmax")
    k, cmax, e, d = (arguments(lines, rf"\b{name} = #")[0] for name in names)

    def step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
        share = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
        return h0 + (h1 - h0) * share * share * (3.0 - 2.0 * share)

    def force(penetration: float, rate: float) -> float:
        # free length 0: x is the distance, and falls on approach
        x, dx = -penetration, -rate
        return max(0.0, k * (0.0 - x) ** e - step(x, 0.0 - d, cmax, 0.0, 0.0) * dx)

    return force


@pytest.mark.slow
@pytest.mark.parametrize(("n", "d"), [(1.5, 1e-5), (2.2, 1e-4)])
def test_the_lines_of_adams_give_the_law_in_millimetres(n: float, d: float) -> None:
    """The mass is then in N s²/mm."""
    source = config(K=1e8 * 1e3 ** (n - 1.5), n=n)
    export = same_law(
        "adams", default_law("adams"), adams_force, source, {"e": 0.6, "adams-impact.d": d}, length=1e3
    )
    assert export.e_continuous == pytest.approx(0.6, abs=1e-8)


def test_the_statement_and_the_function_of_adams_have_the_same_numbers() -> None:
    at = {"adams-impact.c": 2e3, "adams-impact.d": 1e-5}
    export = impact.export("adams", default_law("adams"), source=config(K=1e8), at=at)
    assert arguments(export.lines, r"IMPACT\(x, dx/dt, x1, #, #, #, #\)") == list(export.parameters.values())
    assert export.parameters["stiffness"] == pytest.approx(1e8 / 1e3**1.5, rel=1e-14)
    assert export.parameters["dmax"] == pytest.approx(0.01, rel=1e-14)


# ---- Simscape: s(d)(k d + b d'), with the cubic and the limit at zero that are ours


def simscape_force(lines: Sequence[str]) -> Force:
    k, b, w = arguments(lines, r"(?:Stiffness|Damping|RegionWidth)', '#'")

    def force(depth: float, rate: float) -> float:
        share = min(depth / w, 1.0)
        return max(0.0, share * share * (3.0 - 2.0 * share) * (k * depth + b * rate))

    return force


@pytest.mark.slow
def test_the_lines_of_simscape_give_the_law() -> None:
    at = {"e": 0.6, "simscape-contact.w": 2e-5}
    export = same_law("simscape", default_law("simscape"), simscape_force, config(K=1e7, n=1), at)
    assert export.e_continuous == pytest.approx(0.6, abs=1e-8)


def test_a_wide_transition_of_simscape_is_warned_about() -> None:
    """The peak indentation of the undamped spring is v0 √(m/K) = 4.108e-4 m."""
    narrow, wide = (
        impact.export(
            "simscape",
            default_law("simscape"),
            source=config(K=1e7, n=1),
            at={"simscape-contact.b": 1e3, "simscape-contact.w": w},
        )
        for w in (4.1e-5, 5e-5)
    )
    assert not narrow.warnings
    assert "0.122 of the peak indentation" in wide.warnings[0]


# ---- PhysX: computeCompliantContactCoefficients in DyContactPrepShared.h, in the limit of small steps


def physx_force(lines: Sequence[str]) -> Force:
    """The force max(0, k x + c u) that the impulse of a step comes to, of two balls of the same material."""
    ((restitution,), (damping,)) = (
        arguments(lines, rf"{call}\);") for call in (r"createMaterial\(0.0f, 0.0f, #", r"setDamping\(#")
    )
    assert restitution < 0.0
    return lambda depth, rate: max(0.0, -restitution * depth + damping * rate)


@pytest.mark.slow
def test_the_lines_of_physx_give_the_law() -> None:
    export = same_law("physx", default_law("physx"), physx_force, config(K=1e7, n=1), {"e": 0.6})
    assert export.e_continuous == pytest.approx(0.6, abs=1e-8)
    # in USD and in Isaac Lab the same
    for name in ("compliantContactStiffness = ", "compliant_contact_stiffness="):
        assert arguments(export.lines, f"{name}#") == [1e7]


# ---- all of them

TEXT_ONLY = [name for name, code in CODES.items() if not code.template]


def test_codes_without_a_script_are_marked_as_not_run() -> None:
    assert set(TEXT_ONLY) == {"chrono", "mercurydpm", "modelica", "adams", "simscape", "physx"}
    for name in TEXT_ONLY:
        assert CODES[name].tested.startswith("not run by us; ")
        assert not CODES[name].program


@pytest.mark.parametrize(
    ("name", "option"),
    [*((name, "--script") for name in TEXT_ONLY), ("chrono", "--verify"), ("chrono", "--program=python")],
)
def test_no_script_is_written_or_run_for_them(cli: Run, name: str, option: str) -> None:
    parameters = {
        "modelica": ("--at", "modelica-elastogap.d=1e3"),
        "adams": ("--at", "adams-impact.c=1e3", "--at", "adams-impact.d=1e-5"),
        "simscape": ("--at", "simscape-contact.b=1e3", "--at", "simscape-contact.w=1e-5"),
        "physx": ("--at", "kelvin-voigt-no-tension.C=1e3"),
    }
    done = cli("export", "--to", name, *parameters.get(name, ()), option)
    assert (done.returncode, done.stdout) == (2, "")
    assert "not run by us" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--code-version", "latest"), 'got "latest", expected a release, such as 9.0.1'),
        (("--code-version", "5.0.1"), "got 5.0.1, expected 6.0.0 or later: older releases were not read"),
        (("--at", "R1=inf", "--at", "R2=inf", "--at", "K=1e9"), "R1 and R2: got inf, expected one finite radius"),
    ],
)
def test_what_cannot_be_written_is_one_line(cli: Run, words: tuple[str, ...], message: str) -> None:
    assert_refused(cli("export", "--to", "chrono", *words), message)


def test_a_law_without_known_radii_gets_finite_numbers() -> None:
    """The radii that are taken for it are those of a script."""
    source = {"models": "hertz", "sweep": {"v1": V0, "v2": 0.0, "m1": M1, "m2": M2, "e": 0.5, "K": 1e9}}
    for name in ("lammps", "chrono"):
        release = CODES[name].newest
        values = impact.export(name, default_law(name), source=source, code_version=release).parameters.values()
        assert all(math.isfinite(value) for value in values if isinstance(value, float))


@pytest.mark.parametrize("model", ["kelvin-voigt", "kelvin-voigt-no-tension", "yade-viscoelastic"])
def test_a_law_that_another_one_is_written_for_is_a_warning(model: str) -> None:
    export = impact.export(to="yade", model=model, at={"C": 10.0}, dt=1e-6, code_version="2023.02a")
    line = "YADE 2023.02a has no kelvin-voigt: yade-viscoelastic is written; see impact models yade-viscoelastic"
    assert export.warnings == ((line,) if model == "kelvin-voigt" else ())
