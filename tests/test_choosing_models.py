"""Models are chosen by name, family and pattern, and excluded by "!"; catalogue entries state their sources."""

import json
import re
from collections.abc import Mapping

import numpy as np
import pytest

import impact
from impact.config.load import Config, read_config
from impact.config.tables import expand_laws
from impact.contact.models import catalogue, find
from impact.errors import ModelError
from impact.results.single_impact import Impact

from .conftest import assert_same_bits, problems_of

BALLS = {"v1": 1.0, "v2": -0.5, "m1": 1.0, "m2": 2.0}
ALIASES = {key: model.same_as for key, model in catalogue().items() if model.same_as}
LAWS = [key for key in catalogue() if key not in ALIASES]
# parameters with which a law dissipates much of the energy, at the stiffness of `run_at`
PARAMETERS = {
    "kelvin-voigt": {"C": 5e4},
    "kelvin-voigt-no-tension": {"C": 5e4},
    "muthukumar-2003": {"d": 1e-4},
    "kuwabara-kono-1987": {"A": 3e-5},
    "lee-herrmann-1993": {"gamma": 1e4},
    "bordbar-hyppanen-2007": {"C": 4e6},
    "hertz-power-damping": {"C": 4e6, "q": 0.65},
    "yade-betan-direct": {"betan": 0.4},
}
DAMPED = [key for key in LAWS if find(key).family in ("dashpot", "rate-dependent")]
WITHOUT_TENSION = [key for key in DAMPED if find(key).release == "force"]
WITH_TENSION = [key for key in DAMPED if find(key).release == "gap"]


PARAMETERS |= {alias: PARAMETERS[key] for alias, key in ALIASES.items() if key in PARAMETERS}


def run_at(key: str, e: float = 0.4) -> Impact:
    """A collision by a law, at the law's exponent if it has a fixed one, else at 1.5."""
    parameters = {"model": {key: PARAMETERS[key]}} if key in PARAMETERS else {}
    return impact.run(
        {"models": key, "sweep": {**BALLS, "e": e, "K": 6e9, "n": find(key).exponent or 1.5}, **parameters}
    )


@pytest.mark.parametrize("key", ["anagnostopoulos-1988", "tsuji-1992"])
def test_without_tension_a_dashpot_calibrated_for_tension_rebounds_faster(key):
    e = [0.1, 0.3, 0.5, 0.7, 0.9]
    keys = [key, f"{key}-no-tension"]
    sweep = {**BALLS, "e": e, "K": 6e9, "n": find(key).exponent or 1.5}
    with_tension, without_tension = impact.sweep({"models": keys, "sweep": sweep})["e_out"].sel(model=keys).values
    assert with_tension == pytest.approx(e, abs=1e-9)
    assert [f"{e_out:.4f}" for e_out in without_tension] == ["0.2527", "0.3971", "0.5503", "0.7182", "0.9020"]


def test_without_tension_a_dashpot_of_the_same_constant_rebounds_faster():
    pulls, not_pulls = (run_at(key).values["e_out"] for key in ("kelvin-voigt", "kelvin-voigt-no-tension"))
    assert not_pulls > pulls + 0.01


@pytest.mark.parametrize("key", WITHOUT_TENSION)
def test_a_law_without_tension_ends_at_zero_force_and_never_pulls(key):
    collision = run_at(key)
    history = collision.history
    assert collision.values["e_out"] < 0.9
    assert history["F"].min() >= -1e-12 * history["F"].max()
    assert abs(history["F"].values[-1]) <= 1e-12 * history["F"].max()
    # an indentation remains there
    assert history["delta"].values[-1] > 1e-3 * collision.values["peak_indentation"]
    assert history["delta"].values[-1] == pytest.approx(collision.values["permanent_indentation"], rel=1e-9)


@pytest.mark.parametrize("key", WITH_TENSION)
def test_a_dashpot_that_releases_at_zero_gap_pulls_before_it(key):
    collision = run_at(key)
    assert collision.history["F"].min() < -0.1 * collision.history["F"].max()
    assert abs(collision.history["delta"].values[-1]) <= 1e-12 * collision.values["peak_indentation"]


def test_aliases_refer_to_laws_of_the_catalogue():
    assert len(ALIASES) >= 6
    assert set(ALIASES.values()) <= set(LAWS)


@pytest.mark.parametrize("key", ALIASES)
def test_a_law_gives_the_same_bits_under_its_alias(key):
    original = ALIASES[key]
    parameters = {name: PARAMETERS[name] for name in (original, key) if name in PARAMETERS}
    result = impact.sweep(
        {
            "models": [original, key],
            "sweep": {
                **BALLS,
                "e": np.linspace(0.0, 1.0, 21).tolist(),
                "v1": [0.1, 10.0],
                "K": 6e9,
                "n": find(original).exponent or 1.3,
            },
            **({"model": parameters} if parameters else {}),
            "solver": {"rtol": 1e-4},
        }
    )
    first, second = (result.sel(model=name) for name in (original, key))
    assert np.ptp(first["v1_post"].values) > 0.5
    # the domain is what the authors of the original law claim; those of the alias are not known to claim any
    assert_same_bits(first, second, set(result.data_vars) - {"in_domain"})
    assert np.all(second["in_domain"] == 1)


def expanded_keys(choice: object) -> list[str]:
    models, problems = expand_laws(choice, catalogue())
    assert not problems
    return [model.key for model in models]


def test_an_alias_is_chosen_by_its_name_and_by_patterns_only():
    assert expanded_keys("all") == LAWS
    families = {model.family for model in catalogue().values()}
    assert sorted(key for family in families for key in expanded_keys(f"family:{family}")) == sorted(LAWS)
    for key in ALIASES:
        assert expanded_keys(key) == [key]
        assert expanded_keys(["hertz", f"{key[:-1]}?"]) == ["hertz", key]
    assert set(expanded_keys("*")) == set(catalogue())


@pytest.mark.parametrize(
    ("choice", "excluded"),
    [
        (["all", "!hertz"], {"hertz"}),
        (["all", "!family:permanent"], {key for key in LAWS if find(key).family == "permanent"}),
        (["all", "!*-no-tension"], {key for key in LAWS if key.endswith("-no-tension")}),
        (
            ["all", "!kelvin-*", "!family:rate-dependent"],
            {key for key in LAWS if key.startswith("kelvin-") or find(key).family == "rate-dependent"},
        ),
        # an exclusion does not apply to the choices after it
        (["all", "!hertz", "!bilinear", "hertz"], {"bilinear"}),
    ],
)
def test_models_after_an_exclamation_mark_are_excluded(choice, excluded):
    remaining = expanded_keys(choice)
    assert len(excluded) >= 1
    assert set(remaining) == set(LAWS) - excluded
    assert len(remaining) == len(set(remaining))


def test_exclusions_depend_on_the_order():
    assert expanded_keys(["family:elastic", "!hertz", "bilinear", "hertz"]) == ["bilinear", "hertz"]
    assert expanded_keys(["hertz", "bilinear", "!hertz"]) == ["bilinear"]
    # an alias is excluded without its law, and a law without its alias
    assert expanded_keys(["flores-2011", "ye-2009-*", "!ye-2009-hertz"]) == ["flores-2011", "ye-2009-kelvin"]
    assert expanded_keys(["flores-2011", "ye-2009-hertz", "!flores-2011"]) == ["ye-2009-hertz"]


def config_of(choice: object, inputs: Mapping[str, object] = {}, **parameters: object) -> Config:
    steel = {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8}
    tables = {"sweep": {**BALLS, "e": 0.5, "material": "steel", **inputs}, "materials": {"steel": steel}}
    return read_config({"models": choice, **tables, **({"model": parameters} if parameters else {})}, (), ())


def problems_of_choice(choice: object, inputs: Mapping[str, object] = {}) -> list[str]:
    return problems_of(config_of, choice, inputs)


NOTHING_BEFORE = "expected models to exclude from those before it"


@pytest.mark.parametrize(
    ("choice", "line"),
    [
        ("!hertz", f'models: got "!hertz", {NOTHING_BEFORE}'),
        (["!hertz", "hertz"], f'models[0]: got "!hertz", {NOTHING_BEFORE}'),
        (["hertz", "!tsuji-1992"], f'models[1]: got "!tsuji-1992", {NOTHING_BEFORE}'),
        (["hertz", "!family:permanent"], f'models[1]: got "!family:permanent", {NOTHING_BEFORE}'),
        # "all" has no aliases
        (["hertz", "bilinear", "!marhefka-*"], f'models[2]: got "!marhefka-*", {NOTHING_BEFORE}'),
        (["hertz", "!hertzz"], 'models[1]: after !: got "hertzz", expected a model; did you mean "hertz"?'),
        (["hertz", "!!hertz"], 'models[1]: after !: got "!hertz", expected a model; did you mean "hertz"?'),
        (
            ["hertz", "!family:dashpott"],
            'models[1]: after !: got "family:dashpott", expected a family of models; did you mean "dashpot"?',
        ),
        (["hertz", "!zz*"], 'models[1]: after !: got "zz*", expected a pattern that some model matches'),
        (["hertz", "!hertz"], "models: got a list, expected models that are not all left out again"),
        (["all", "!all"], "models: got a list, expected models that are not all left out again"),
    ],
)
def test_a_wrong_exclusion_is_reported(choice, line):
    assert problems_of_choice(choice) == [f"config: {line}"]


def test_an_empty_exclusion_is_reported_with_the_known_models():
    (line,) = problems_of_choice(["hertz", "!"])
    assert line.startswith('config: models[1]: after !: got "", expected a model; known: ')


def test_missing_parameters_of_many_laws_of_all_are_one_line_with_their_exclusion():
    without_default = [key for key in LAWS if any(parameter.default is None for parameter in find(key).parameters)]
    (line,) = problems_of_choice("all")
    first = "kelvin-voigt (C), kelvin-voigt-no-tension (C), kuwabara-kono-1987 (A)"
    more = len(without_default) - 3
    assert line.startswith(f"config: models: a parameter is missing, of {first} and {more} more; ")
    # the list that the message has works, and so does setting what is missing
    remaining = config_of(json.loads(line.rpartition("models = ")[2])).models
    assert [model.key for model in remaining] == [key for key in LAWS if key not in without_default]
    parameters = {
        key: {
            parameter.name: min(max(1.0, parameter.least), parameter.most)
            for parameter in find(key).parameters
            if parameter.default is None
        }
        for key in without_default
    }
    assert [model.key for model in config_of("all", **parameters).models] == LAWS


def test_a_missing_parameter_of_a_law_of_a_pattern_is_reported_with_the_exclusion_of_the_law():
    missing = "missing, expected a number >= 0 s: dissipative constant of the material"
    line = f'config: model.kuwabara-kono-1987.A: {missing}; or models = [..., "!kuwabara-kono-1987"]'
    assert problems_of_choice(["hertz", "kuwabara-kono-1*"]) == [line]


def test_a_stiffness_that_many_laws_of_a_family_do_not_take_is_one_line():
    choice = ["family:hysteresis", "family:dashpot", "!kelvin-voigt*"]
    (line,) = problems_of_choice(choice, {"K": 1e9})
    keys = "ye-2009-kelvin, anagnostopoulos-1988, anagnostopoulos-1988-no-tension"
    assert line.startswith(f"config: sweep.K: got a stiffness for n = 1.5, but {keys} and 1 more have another n; ")
    remaining = config_of(json.loads(line.rpartition("models = ")[2]), {"K": 1e9}).models
    assert {model.exponent for model in remaining} == {None, 1.5}


@pytest.mark.parametrize("choice", ["kelvin-voigt", ["hertz", "kelvin-voigt"]])
def test_a_missing_parameter_of_a_law_chosen_by_name_is_reported_without_the_exclusion(choice):
    missing = "missing, expected a number >= 0 N s/m: damping constant of the dashpot"
    assert problems_of_choice(choice) == [f"config: model.kelvin-voigt.C: {missing}"]


def test_a_parameter_under_sweep_is_an_unknown_key_and_still_missing():
    unknown, missing = problems_of_choice("kelvin-voigt", {"kelvin-voigt.C": 10.0})
    assert unknown.startswith('config: sweep."kelvin-voigt.C": unknown key')
    assert missing.startswith("config: model.kelvin-voigt.C: missing")


@pytest.mark.parametrize("key", sorted(catalogue()))
def test_a_law_states_its_equation_reference_and_year(key):
    law = find(key)
    assert re.search(r"\bF = ", law.equation)
    assert law.title
    assert law.reference
    # the year is that of the reference and of the key, unless the law was derived or is from a code
    assert law.evidence.state == "derived" or law.family == "codes" or str(law.year) in law.reference
    assert {int(year) for year in re.findall(r"(?:19|20)\d\d", key)} <= {law.year}
    # a title states when a code got the law, or a later state of the code
    assert all(law.year <= int(year) for year in re.findall(r"\b(?:19|20)\d\d\b", law.title))
    for parameter in law.parameters:
        assert parameter.meaning
    # a stiffness of its own is part of the equation
    assert law.stiffness is None or "K = " in law.equation or "K" not in law.equation


def printed_polynomial(text: str) -> list[float]:
    """Coefficients of a polynomial of an equation, from the highest power."""
    terms = re.findall(r"([−+]?) *(\d+\.?\d*)(?: [ew][²³⁴⁵⁶⁷⁸⁹]?)?", text)
    return [float(number) * (-1 if sign == "−" else 1) for sign, number in reversed(terms)]


def test_a_polynomial_of_an_equation_is_that_of_the_law() -> None:
    e = 0.6
    p = {
        key: np.polyval(printed_polynomial(re.split(r"p\(e\) = |, to δ", find(key).equation)[1]), e)
        for key in ("lammps-tsuji-hooke-without-root", "thornton-cummins-cleary-2013")
    }
    zeta = p["lammps-tsuji-hooke-without-root"] / 2
    delivered = np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2))
    assert run_at("lammps-tsuji-hooke-without-root", e).values["e_out"] == pytest.approx(delivered, abs=1e-9)
    beta = np.sqrt(1 / (1 - (1 + e) ** 2 * np.exp(e * p["thornton-cummins-cleary-2013"])) - 1)
    zeta = 2 * np.sqrt(1.5) * beta / np.sqrt(5)
    delivered = np.exp(-2 * zeta * np.arccos(zeta) / np.sqrt(1 - zeta**2))
    assert run_at("thornton-cummins-cleary-2013", e).values["e_out"] == pytest.approx(delivered, abs=1e-9)


def test_the_fraction_in_the_equation_of_kuwabara_and_kono_at_a_speed_is_that_of_the_law() -> None:
    above, below = re.search(r"P\(w\) = \((.*)\)/\((.*)\)", find("kuwabara-kono-at-speed").equation).groups()
    roots = np.roots(np.polysub(printed_polynomial(above), 0.6 * np.array(printed_polynomial(below))))
    w = roots[(abs(roots.imag) < 1e-12) & (roots.real > 0)].real.item()
    # at v_e = 1 m/s
    A = 2 / 3 * w**2 * (6e9 / (2 / 3)) ** -0.4
    config = {
        "models": "kuwabara-kono-1987",
        "sweep": {**BALLS, "K": 6e9},
        "model": {"kuwabara-kono-1987": {"A": A}},
    }
    e_out = run_at("kuwabara-kono-at-speed", 0.6).values["e_out"]
    assert impact.run(config).values["e_out"] == pytest.approx(e_out, abs=1e-9)


# a source that can be looked up: a file and its commit, a paper and its equation, a named page, or this repository
SOURCE_LOCATION = re.compile(
    r"@[0-9a-f]{6,}|commit [0-9a-f]{6,}|/\S+\.(cpp|m|cc)\b|equations? \(\d+\)|\bhelp\b|\bwiki\b|arXiv:|docs/|src/"
    r"|the form itself"
)


@pytest.mark.parametrize("key", sorted(catalogue()))
def test_evidence_names_where_the_law_and_its_doi_were_read(key):
    law = find(key)
    if law.evidence.state != "not verified":
        assert SOURCE_LOCATION.search(law.evidence.source), law.evidence
    assert law.doi == "" or re.fullmatch(r"10\.\d{4,}/\S+", law.doi)
    assert bool(law.doi) <= bool(law.evidence.doi), f"{law.doi} without its source"
    assert "memory" not in str(law.evidence)
    # who states the domain
    assert bool(law.domain) == bool(law.domain_source)


@pytest.mark.parametrize(
    ("key", "default"), [("lammps-tsuji-without-root", 1.5), ("lammps-tsuji-hooke-without-root", 1.0)]
)
def test_a_law_delivers_the_restitution_that_its_evidence_states(key, default):
    values = re.findall(r"(\d\.\d+) with (hertz|hooke)", find(key).evidence.note)
    stated = {spring: float(value) for value, spring in values}["hertz" if default == 1.5 else "hooke"]
    assert run_at(key, 0.5).values["e_out"] == pytest.approx(stated, abs=5e-4)


@pytest.mark.parametrize("state", ["seen", "derived", "disputed"])
def test_a_state_without_a_source_is_refused(state):
    with pytest.raises(ModelError, match="without a source"):
        impact.Evidence(state)
    with pytest.raises(ModelError, match="got state 'remembered'"):
        impact.Evidence("remembered", "somewhere")


def test_evidence_as_text_is_refused_with_the_expected_form():
    with pytest.raises(ModelError, match=r"evidence: got 'from a book', expected an impact\.Evidence"):
        impact.ForceModel("mine", "Mine", 2026, "F = 0", "", lambda elastic: elastic, evidence="from a book")


def test_laws_of_codes_name_a_version_except_products_without_versions():
    codes = [law for law in catalogue().values() if law.family == "codes"]
    undated = {law.key for law in codes if not re.search(r"\b(19|20)\d\d|\d\.\d|R20", law.title)}
    # the documentation of these products names no version
    assert undated == {
        "adams-impact",
        "recurdyn",
        "recurdyn-exponents",
        "maplesim-linear",
        "maplesim-linear-limited",
    }


@pytest.mark.slow
def test_the_commands_print_states_of_evidence_and_their_counts(cli):
    listing = cli("models").stdout
    counts = {
        state: int(count) for count, state in re.findall(r"(\d+) (seen|derived|disputed|not verified)", listing)
    }
    assert sum(counts.values()) == len(catalogue())
    evidence = json.loads(cli("models", "hu-guo-2015", "--json").stdout)[0]["evidence"]
    assert evidence["state"] == "disputed"
    assert "3(1 − e)/(4e)" in evidence["source"]
    assert "disputed: " in cli("models", "hu-guo-2015").stdout
