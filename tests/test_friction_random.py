"""Random oblique impacts agree with the reference solver: slip, works, regime and slip changes of every law."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from impact.contact.frictions import frictions
from impact.contact.status import FrictionStatus
from impact.contact.tangential import TangentialResult

from .friction_cases import COMBINATIONS, Batch, random_batches
from .friction_reference import THIRD, TINY_S, Friction, Outcome, P

# of the integration, and the difference allowed from the reference, relative to the larger of G0 and Lambda
RTOL, TOLERANCE = 1e-9, 1e-7
# s in the reference at an indentation of 1e-7
SHORT_S = 1e-7 ** (1.0 / P)
WORKS = ("slip_work", "memory_work", "elastic_left", "damping_work")
# cases of each law that may differ, in a hundred
RARE = 1
# cases of each law
MANY = 200
# the differences by the name of the result, the case, and the names of the results that differ
Difference = tuple[dict[str, float], str, list[str]]


def test_every_continuous_law_has_random_cases() -> None:
    assert set(COMBINATIONS) == {key for key, law in frictions().items() if not law.scheme}


def differences(batch: Batch) -> Iterator[Difference]:
    """Compare each impact of a batch with the reference; one that it cannot solve counts as differing."""
    result = batch.simulate(RTOL)
    for row, friction in enumerate(batch.friction):
        try:
            outcome = batch.reference(row)
        except ArithmeticError as error:
            yield {}, f"{batch.describe(row)}: {error}", ["reference"]
            continue
        unit = friction.mu / friction.m_t
        scale = max(batch.g0[row] / unit, outcome.sliding_impulse)
        errors = {"sliding_impulse": abs(result.sliding_impulse[row] - outcome.sliding_impulse) / scale}
        wrong = []
        if friction.kind != "coulomb":
            errors["slip"] = abs(result.slip[row] - outcome.g / unit) / scale
            work_unit = unit * friction.mu
            errors |= {
                name: error / scale**2 for name, error in work_errors(result, row, outcome, friction, work_unit)
            }
            wrong = wrong_counts(result, row, outcome, friction)
        wrong += [name for name, error in errors.items() if not error <= TOLERANCE]
        status = FrictionStatus.SLOW_LIMIT if outcome.slow else FrictionStatus.OK
        wrong += ["status"] if result.status[row] != status else []
        yield errors, batch.describe(row), wrong


def work_errors(
    result: TangentialResult, row: int, outcome: Outcome, friction: Friction, unit: float
) -> Iterator[tuple[str, float]]:
    """Differences of the works; without a spring, or where one diverges, only those that are defined."""
    works = {name: getattr(result, name)[row] for name in WORKS}
    loss = outcome.slip_and_memory + outcome.elastic_left + outcome.damping_work
    if friction.kind == "spring":
        for name in WORKS:
            expected = getattr(outcome, name) / unit
            # where the energy of the spring has no limit at x = 0, it is a part of the slip work
            if not math.isnan(expected) and outcome.elastic_left < 1e6:
                yield name, abs(works[name] - expected)
    if outcome.elastic_left < 1e6:
        yield "loss", abs(math.fsum(works.values()) - loss / unit)


def wrong_counts(result: TangentialResult, row: int, outcome: Outcome, friction: Friction) -> list[str]:
    """Name what differs of the regime and of the slip changes.

    The third regime is neither stick nor slip, a dashpot without damping has no friction, and a mode that lasts
    for an indentation of 1e-7 at first contact or at the end may be passed over.
    """
    if any(abs(mode) == THIRD for _, mode in outcome.modes) or (friction.kind == "dashpot" and not friction.c_t):
        return []
    if any(TINY_S < s < SHORT_S for s, _ in outcome.modes):
        return []
    wrong = ["regime"] if result.regime[row] != outcome.regime else []
    return wrong + (["slip_changes"] if result.slip_changes[row] != outcome.slip_changes else [])


@pytest.mark.slow
@pytest.mark.parametrize("key", COMBINATIONS)
def test_random_cases(key: str) -> None:
    # of two models, which are others for each law
    first = 5 * list(COMBINATIONS).index(key)
    models = {COMBINATIONS[key][number % len(COMBINATIONS[key])] for number in (first, first + 2)}
    batches = [batch for batch in random_batches(key, 1, seed=1) if batch.pair.model.key in models]
    assert len(batches) == len(models)
    assert differing(batches) == []


@pytest.mark.long
@pytest.mark.parametrize("key", COMBINATIONS)
def test_many_random_cases(key: str) -> None:
    batches = list(random_batches(key, MANY, seed=2))
    assert sum(len(batch.g0) for batch in batches) >= MANY
    assert len(differing(batches)) <= MANY * RARE / 100


def differing(batches: list[Batch]) -> list[tuple[str, list[str]]]:
    """List the cases that differ from the reference, and what differs."""
    return [(name, wrong) for batch in batches for _, name, wrong in differences(batch) if wrong]
