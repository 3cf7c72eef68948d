"""Every law of the catalogue meets every clause of the contract; a law that violates a clause is reported."""

import itertools

import numpy as np
import pytest

from impact.contact.checks import check_model
from impact.contact.closed_forms.hysteresis import delivered_restitution
from impact.contact.model import ForceModel, Parameter
from impact.contact.models import catalogue
from impact.contact.models.hysteresis import hysteresis

from .problems import EACH_LAW

CLAUSES = (
    "every impact ends",
    "momentum is conserved (4)",
    "velocities part by e_out v0 (5)",
    "no energy is gained",
    "work balances energy",
    "agrees with its closed form",
    "a change of units changes nothing",
    "swapped balls swap velocities",
    "at e = 1 the status is OK",
    "a tighter tolerance moves nothing",
    "an impact alone has the bits that it has in a batch",
)


@pytest.mark.parametrize("key", EACH_LAW)
def test_every_law_meets_every_clause(key):
    findings = check_model(catalogue()[key])
    assert [finding.clause for finding in findings if not finding.holds] == [], findings
    # a law without a closed form has no clause about it
    absent = {"agrees with its closed form"} if catalogue()[key].oracle is None else set()
    assert {finding.clause for finding in findings} == set(CLAUSES) - absent


def wrong_law(force, **fields) -> ForceModel:
    return ForceModel("wrong", "Wrong", 2026, equation="", reference="", force=force, **fields)


def drifting_law() -> ForceModel:
    """Hertz's law with a damping that grows by 1e-9 with each evaluation."""
    evaluations = itertools.count()
    return wrong_law(lambda elastic, v: elastic * (1.0 + 1e-9 * next(evaluations) * v))


WRONG_LAWS = {
    "a force that never releases the balls": (
        wrong_law(lambda elastic, v: elastic * (v > 0.0)),
        "every impact ends",
    ),
    "a force that raises": (wrong_law(lambda elastic: elastic[10**6]), "every impact ends"),
    "a force that is NaN": (wrong_law(lambda elastic, e: elastic + np.nan * e), "every impact ends"),
    "a force that adds energy": (wrong_law(lambda elastic, v: elastic * (1.0 - 0.01 * v)), "no energy is gained"),
    "a closed form wrong by 1e-6": (
        wrong_law(
            lambda elastic, v, chi: elastic * (1.0 + chi * v),
            coefficients={"chi": lambda e: 1.0 - e},
            oracle=lambda chi: delivered_restitution(chi) + 1e-6,
        ),
        "agrees with its closed form",
    ),
    "a damping that is not the one of its closed form": (
        wrong_law(
            lambda elastic, v, chi: elastic * (1.0 + (chi + 1e-6) * v),
            coefficients={"chi": lambda e: 1.0 - e},
            oracle=lambda chi: delivered_restitution(chi),
        ),
        "agrees with its closed form",
    ),
    "the log coordinate for another law": (
        wrong_law(
            lambda elastic, v, chi: elastic * (1.0 + chi * v * v),
            coefficients={"chi": lambda e: 8.0 - e},
            velocity_coordinate="log",
        ),
        "work balances energy",
    ),
    "the force coordinate for another law": (
        wrong_law(
            lambda elastic, x, v, c: elastic + c * x * v,
            coefficients={"c": lambda e: 4.0 - e, "q": lambda: 0.5},
            velocity_coordinate="force",
            release="force",
        ),
        "work balances energy",
    ),
    "a force that differs when the balls are swapped": (
        wrong_law(
            lambda elastic, v, share: elastic * (1.0 + share * v),
            coefficients={"share": lambda R1, R2: 1.0 / (1.0 + R1 / R2)},
        ),
        "swapped balls swap velocities",
    ),
    "an infinite damping at e = 1": (
        hysteresis("wrong", title="", year=2026, equation="", reference="", chi=lambda e: np.divide(e, 1.0 - e)),
        "at e = 1 the status is OK",
    ),
    "a force that drifts": (drifting_law(), "a tighter tolerance moves nothing"),
    "a number that has a unit": (
        wrong_law(lambda elastic, x: elastic + 1e3 * x),
        "a change of units changes nothing",
    ),
    "a number that has a unit, on unloading": (
        wrong_law(
            lambda elastic: elastic,
            unloading=lambda elastic, stretch: elastic * np.minimum(stretch / 1e-3, 1.0),
            residual=lambda peak: 0.1 * peak,
        ),
        "a change of units changes nothing",
    ),
    "a parameter that has another unit": (
        wrong_law(
            lambda elastic, v, c: elastic + c * v,
            release="force",
            parameters=(Parameter("c", "N/m", "damping constant", least=0.0),),
        ),
        "a change of units changes nothing",
    ),
    "a force that depends on other impacts": (
        wrong_law(lambda elastic, x, v, e: elastic * (1.0 + (1.0 - e) * v + 1e-12 * x.max())),
        "an impact alone has the bits that it has in a batch",
    ),
    "a coefficient that depends on other impacts": (
        wrong_law(
            lambda elastic, v, chi: elastic * (1.0 + chi * v),
            coefficients={"chi": lambda e: 1.0 - e + 1e-12 * np.mean(e)},
        ),
        "an impact alone has the bits that it has in a batch",
    ),
    "a coefficient of one impact that depends on others": (
        wrong_law(
            lambda elastic, v, chi: elastic * (1.0 + chi * v),
            coefficients={"chi": lambda e: 1.0 - e + np.where(e == 0.05, 1e-12 * np.mean(e), 0.0)},
        ),
        "an impact alone has the bits that it has in a batch",
    ),
}


# a force that raises is reported with its line
@pytest.mark.slow
@pytest.mark.filterwarnings(r"ignore:test_contract\.py.* IndexError:UserWarning")
@pytest.mark.parametrize(("model", "clause"), WRONG_LAWS.values(), ids=WRONG_LAWS)
def test_a_law_that_violates_a_clause_is_reported(model, clause):
    # the clauses after this one are not checked
    assert any(finding.clause == clause and not finding.holds for finding in check_model(model))
