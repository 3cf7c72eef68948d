"""Laws are chosen by name, family and pattern, left out by "!", and say where they are from and where they end."""

import json
import re

import numpy as np
import pytest

import impact
from impact.api import Impact
from impact.config.load import Config, read_config
from impact.config.tables import expand_models
from impact.contact.models import built_in, catalogue, find
from impact.errors import ConfigError, ModelError

BALLS = {"v1": 1.0, "v2": -0.5, "m1": 1.0, "m2": 2.0}
NAMES = {key: model.same_as for key, model in catalogue().items() if model.same_as}
LAWS = [key for key in catalogue() if key not in NAMES]
# parameters of which a law takes much of the energy, at the stiffness of `shot`
PARAMETERS = {
    "kelvin-voigt": {"C": 5e4}, "kelvin-voigt-no-tension": {"C": 5e4},
    "muthukumar-2003": {"d": 1e-4},
    "kuwabara-kono-1987": {"A": 3e-5}, "lee-herrmann-1993": {"gamma": 1e4}, "bordbar-hyppanen-2007": {"C": 4e6},
    "hertz-power-damping": {"C": 4e6, "q": 0.65}, "yade-betan-direct": {"betan": 0.4},
}  # fmt: skip
DAMPED = [key for key in LAWS if find(key).family in ("dashpot", "rate-dependent")]
WITHOUT_TENSION = [key for key in DAMPED if find(key).release == "force"]
WITH_TENSION = [key for key in DAMPED if find(key).release == "gap"]


PARAMETERS |= {name: PARAMETERS[law] for name, law in NAMES.items() if law in PARAMETERS}


def shot(key: str, e: float = 0.4) -> Impact:
    """One impact of a law, at its own exponent where it has one."""
    own = {"model": {key: PARAMETERS[key]}} if key in PARAMETERS else {}
    return impact.run({"models": key, "sweep": {**BALLS, "e": e, "K": 6e9, "n": find(key).exponent or 1.5}, **own})


@pytest.mark.parametrize("key", ["anagnostopoulos-1988", "tsuji-1992"])
@pytest.mark.parametrize(
    ("e", "e_out"), [(0.1, "0.2527"), (0.3, "0.3971"), (0.5, "0.5503"), (0.7, "0.7182"), (0.9, "0.9020")]
)
def test_without_tension_more_is_given_back(key, e, e_out):
    assert shot(key, e).values["e_out"] == pytest.approx(e, abs=1e-9)
    assert f"{shot(f'{key}-no-tension', e).values['e_out']:.4f}" == e_out


def test_without_tension_more_is_given_back_by_the_same_dashpot():
    pulls, not_pulls = (shot(key).values["e_out"] for key in ("kelvin-voigt", "kelvin-voigt-no-tension"))
    assert not_pulls > pulls + 0.01


@pytest.mark.parametrize("key", WITHOUT_TENSION)
def test_a_law_without_tension_ends_where_its_force_does_and_never_pulls(key):
    one = shot(key)
    history = one.history
    assert one.values["e_out"] < 0.9
    assert history["F"].min() >= -1e-12 * history["F"].max()
    assert abs(history["F"].values[-1]) <= 1e-12 * history["F"].max()
    # the balls still touch there: what is left of the indentation is not forced out
    assert history["delta"].values[-1] > 1e-3 * one.values["peak_indentation"]
    assert history["delta"].values[-1] == pytest.approx(one.values["permanent_indentation"], rel=1e-9)


@pytest.mark.parametrize("key", WITH_TENSION)
def test_a_dashpot_to_the_end_of_the_gap_pulls_before_it(key):
    one = shot(key)
    assert one.history["F"].min() < -0.1 * one.history["F"].max()
    assert abs(one.history["delta"].values[-1]) <= 1e-12 * one.values["peak_indentation"]


def test_names_of_a_law_are_those_of_a_law_that_is_there():
    assert len(NAMES) >= 6
    assert set(NAMES.values()) <= set(LAWS)


@pytest.mark.parametrize("key", NAMES)
def test_a_law_is_the_same_to_the_bit_under_either_name(key):
    law = NAMES[key]
    own = {name: PARAMETERS[name] for name in (law, key) if name in PARAMETERS}
    result = impact.sweep(
        {
            "models": [law, key],
            "sweep": {
                **BALLS, "e": np.linspace(0.0, 1.0, 21).tolist(), "v1": [0.1, 10.0], "K": 6e9,
                "n": find(law).exponent or 1.3,
            },
            **({"model": own} if own else {}),
        }
    )  # fmt: skip
    one, other = (result.sel(model=name) for name in (law, key))
    assert np.ptp(one["v1_post"].values) > 0.5
    # the domain is what the authors of the first name claim; those of the other are not known to claim any
    for name in set(result.data_vars) - {"in_domain"}:
        assert one[name].values.tobytes() == other[name].values.tobytes(), name
    assert np.all(other["in_domain"] == 1)


def chosen(asked: object) -> list[str]:
    models, faults = expand_models(asked, catalogue())
    assert not faults
    return [model.key for model in models]


def test_a_second_name_is_chosen_by_itself_and_by_a_pattern_only():
    assert chosen("all") == LAWS
    families = {model.family for model in catalogue().values()}
    assert sorted(key for family in families for key in chosen(f"family:{family}")) == sorted(LAWS)
    for key in NAMES:
        assert chosen(key) == [key]
        assert chosen(["hertz", f"{key[:-1]}?"]) == ["hertz", key]
    assert set(chosen("*")) == set(catalogue())


@pytest.mark.parametrize(
    ("asked", "out"),
    [
        (["all", "!hertz"], {"hertz"}),
        (["all", "!family:permanent"], {key for key in LAWS if find(key).family == "permanent"}),
        (["all", "!*-no-tension"], {key for key in LAWS if key.endswith("-no-tension")}),
        (
            ["all", "!kelvin-*", "!family:rate-dependent"],
            {key for key in LAWS if key.startswith("kelvin-") or find(key).family == "rate-dependent"},
        ),
        # what is after an exclusion is not left out by it
        (["all", "!hertz", "!bilinear", "hertz"], {"bilinear"}),
    ],
)
def test_what_is_after_an_exclamation_mark_is_left_out(asked, out):
    left = chosen(asked)
    assert len(out) >= 1
    assert set(left) == set(LAWS) - out
    assert len(left) == len(set(left))


def test_order_counts_when_laws_are_left_out():
    assert chosen(["family:elastic", "!hertz", "bilinear", "hertz"]) == ["bilinear", "hertz"]
    assert chosen(["hertz", "bilinear", "!hertz"]) == ["bilinear"]
    # a second name goes without its law, and a law without its second name
    assert chosen(["flores-2011", "ye-2009-*", "!ye-2009-hertz"]) == ["flores-2011", "ye-2009-kelvin"]
    assert chosen(["flores-2011", "ye-2009-hertz", "!flores-2011"]) == ["ye-2009-hertz"]


def config_of(asked: object, **own: object) -> Config:
    steel = {"E": 210e9, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8}
    tables = {"sweep": {**BALLS, "e": 0.5, "material": "steel"}, "materials": {"steel": steel}}
    return read_config({"models": asked, **tables, **({"model": own} if own else {})}, (), ())


def problems(asked: object) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        config_of(asked)
    return list(caught.value.problems)


NOTHING_BEFORE = "expected models to leave out of those before it"


@pytest.mark.parametrize(
    ("asked", "line"),
    [
        ("!hertz", f'models: got "!hertz", {NOTHING_BEFORE}'),
        (["!hertz", "hertz"], f'models[0]: got "!hertz", {NOTHING_BEFORE}'),
        (["hertz", "!tsuji-1992"], f'models[1]: got "!tsuji-1992", {NOTHING_BEFORE}'),
        (["hertz", "!family:permanent"], f'models[1]: got "!family:permanent", {NOTHING_BEFORE}'),
        # "all" has each law once, under its first name
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
def test_a_wrong_exclusion_is_told(asked, line):
    assert problems(asked) == [f"config: {line}"]


def test_an_exclusion_of_nothing_is_told_with_what_there_is():
    (line,) = problems(["hertz", "!"])
    assert line.startswith('config: models[1]: after !: got "", expected a model; known: ')


def test_a_law_of_all_whose_parameter_is_missing_is_told_with_the_way_to_leave_it_out():
    wanting = [key for key in LAWS if any(one.default is None for one in find(key).parameters)]
    lines = problems("all")
    assert list(dict.fromkeys(line.split(".")[1] for line in lines)) == wanting
    assert (
        "config: model.kuwabara-kono-1987.A: missing, expected a number >= 0 s: dissipative constant of the "
        'material; or models = [..., "!kuwabara-kono-1987"]'
    ) in lines
    # the advice of all lines together is right, and so is giving what is missing
    advice = [re.search(r'; or models = \[\.\.\., "(!.*)"\]$', line) for line in lines]
    left = config_of(["all", *dict.fromkeys(found[1] for found in advice if found)]).models
    assert [model.key for model in left] == [key for key in LAWS if key not in wanting]
    given = {
        key: {one.name: min(max(1.0, one.least), one.most) for one in find(key).parameters if one.default is None}
        for key in wanting
    }
    assert [model.key for model in config_of("all", **given).models] == LAWS


@pytest.mark.parametrize("asked", ["kelvin-voigt", ["hertz", "kelvin-voigt"]])
def test_a_law_that_was_named_is_not_advised_to_be_left_out(asked):
    missing = "missing, expected a number >= 0 N s/m: damping constant of the dashpot"
    assert problems(asked) == [f"config: model.kelvin-voigt.C: {missing}"]


@pytest.mark.parametrize("key", sorted(built_in()))
def test_a_law_says_where_it_is_from(key):
    law = find(key)
    assert re.search(r"\bF = ", law.equation)
    assert law.title
    assert law.reference
    # a law is of the year of its reference, and of its key, unless it was derived, or is of a code
    assert law.evidence.state == "derived" or law.family == "codes" or str(law.year) in law.reference
    assert {int(year) for year in re.findall(r"(?:19|20)\d\d", key)} <= {law.year}
    for parameter in law.parameters:
        assert parameter.meaning


# a place that can be looked up: a file and its commit, a paper and its equation, a named page, or ourselves
PLACE = re.compile(
    r"@[0-9a-f]{6,}|commit [0-9a-f]{6,}|/\S+\.(cpp|m|cc)\b|equations? \(\d+\)|\bhelp\b|\bwiki\b|arXiv:|docs/|src/"
    r"|the form itself"
)


@pytest.mark.parametrize("key", sorted(built_in()))
def test_evidence_names_a_place_and_a_doi_where_it_was_read(key):
    law = find(key)
    if law.evidence.state != "not verified":
        assert PLACE.search(law.evidence.source), law.evidence
    assert law.doi == "" or re.fullmatch(r"10\.\d{4,}/\S+", law.doi)
    assert bool(law.doi) <= bool(law.evidence.doi), f"{law.doi} without where it was read"
    assert "memory" not in str(law.evidence)
    # whose verdict a domain is
    assert bool(law.domain) == bool(law.domain_source)


@pytest.mark.parametrize(
    ("key", "default"), [("lammps-tsuji-without-root", 1.5), ("lammps-tsuji-hooke-without-root", 1.0)]
)
def test_what_evidence_says_that_a_law_delivers_it_delivers(key, default):
    words = re.findall(r"(\d\.\d+) with (hertz|hooke)", find(key).evidence.note)
    said = {spring: float(value) for value, spring in words}["hertz" if default == 1.5 else "hooke"]
    assert shot(key, 0.5).values["e_out"] == pytest.approx(said, abs=5e-4)


@pytest.mark.parametrize("state", ["seen", "derived", "disputed"])
def test_a_state_without_a_source_is_refused(state):
    with pytest.raises(ModelError, match="without a source"):
        impact.Evidence(state)
    with pytest.raises(ModelError, match="got state 'remembered'"):
        impact.Evidence("remembered", "somewhere")


def test_evidence_in_words_of_old_is_refused_with_the_right_form():
    with pytest.raises(ModelError, match=r"evidence: got 'from a book', expected an impact\.Evidence"):
        impact.ForceModel("mine", "Mine", 2026, "F = 0", "", lambda elastic: elastic, evidence="from a book")


def test_a_law_of_a_code_names_its_version_or_that_there_is_none():
    codes = [law for law in catalogue().values() if law.family == "codes"]
    undated = {law.key for law in codes if not re.search(r"\b(19|20)\d\d|\d\.\d|R20", law.title)}
    # products whose documentation has no version of these
    assert undated == {
        "adams-impact",
        "recurdyn",
        "recurdyn-exponents",
        "maplesim-linear",
        "maplesim-linear-limited",
    }


def test_the_states_of_evidence_are_counted(cli):
    shown = cli("models").stdout
    counts = {
        state: int(count) for count, state in re.findall(r"(\d+) (seen|derived|disputed|not verified)", shown)
    }
    assert sum(counts.values()) == len(catalogue())
    told = json.loads(cli("models", "hu-guo-2015", "--json").stdout)[0]["evidence"]
    assert told["state"] == "disputed"
    assert "3(1 − e)/(4e)" in told["source"]
    assert "disputed: " in cli("models", "hu-guo-2015").stdout
