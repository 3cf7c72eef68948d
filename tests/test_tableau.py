"""The tableau is the Dormand-Prince 5(4) pair with an interpolant of order four, in exact fractions."""

from fractions import Fraction
from functools import cache
from math import prod

import pytest

from impact.ode.rk45 import ERROR_WEIGHTS, STAGE_WEIGHTS
from impact.ode.tableau import DENSE_WEIGHTS, A, B, C, E, P

STAGES = range(7)
EMBEDDED = tuple(b - e for b, e in zip(B, E, strict=True))


@cache
def forests(size: int, largest: int) -> tuple[tuple, ...]:
    """All multisets of rooted trees with `size` vertices together and at most `largest` each."""
    if size == 0:
        return ((),)
    multisets = set()
    for first in range(1, min(size, largest) + 1):
        for tree in trees(first):
            multisets |= {tuple(sorted((tree, *rest))) for rest in forests(size - first, first)}
    return tuple(sorted(multisets))


@cache
def trees(order: int) -> tuple[tuple, ...]:
    """The rooted trees with this many vertices; a tree is the sorted tuple of its children."""
    return forests(order - 1, order - 1)


def order_of(tree: tuple) -> int:
    return 1 + sum(map(order_of, tree))


def density(tree: tuple) -> int:
    return order_of(tree) * prod(map(density, tree))


@cache
def weight(tree: tuple) -> tuple[Fraction, ...]:
    """The elementary weight of a tree at each stage."""
    below = [[sum(a * w for a, w in zip(row, weight(child), strict=False)) for row in A] for child in tree]
    return tuple(prod((branch[i] for branch in below), start=Fraction(1)) for i in STAGES)


def residual(weights: tuple[Fraction, ...], tree: tuple) -> Fraction:
    """By how much weights violate the order condition of a tree."""
    return sum(b * w for b, w in zip(weights, weight(tree), strict=True)) - Fraction(1, density(tree))


UP_TO_5 = [tree for order in range(1, 6) for tree in trees(order)]
UP_TO_4 = [tree for tree in UP_TO_5 if order_of(tree) <= 4]


def test_there_are_17_trees_up_to_order_5():
    assert [len(trees(order)) for order in range(1, 6)] == [1, 1, 2, 4, 9]


def test_rows_sum_to_their_nodes():
    assert tuple(sum(row, Fraction(0)) for row in A) == C


def test_stages_are_explicit():
    assert [len(row) for row in A] == list(STAGES)


@pytest.mark.parametrize("tree", UP_TO_5, ids=str)
def test_solution_fulfils_the_condition_of_order_5(tree):
    assert residual(B, tree) == 0


def test_solution_is_not_of_order_6():
    assert any(residual(B, tree) for tree in trees(6))


@pytest.mark.parametrize("tree", UP_TO_4, ids=str)
def test_embedded_solution_fulfils_the_condition_of_order_4(tree):
    assert residual(EMBEDDED, tree) == 0


def test_embedded_solution_is_not_of_order_5():
    assert any(residual(EMBEDDED, tree) for tree in trees(5))


def test_last_stage_is_the_first_of_the_next_step():
    assert (*A[6], 0) == B
    assert C[6] == 1


def test_interpolant_ends_at_the_solution():
    assert tuple(map(sum, P)) == B


@pytest.mark.parametrize("tree", UP_TO_4, ids=str)
def test_interpolant_fulfils_the_condition_of_order_4_at_every_fraction(tree):
    # Σᵢ Σⱼ P[i][j] θ^(j+1) wᵢ = θ^order/density, power by power
    powers = [sum(P[i][j] * weight(tree)[i] for i in STAGES) for j in range(4)]
    assert powers == [Fraction(1, density(tree)) if j + 1 == order_of(tree) else 0 for j in range(4)]


def test_interpolant_has_the_rates_of_both_ends():
    # its derivative at θ = 0 is the first stage, at θ = 1 the last
    assert [row[0] for row in P] == [1, 0, 0, 0, 0, 0, 0]
    assert [sum((j + 1) * p for j, p in enumerate(row)) for row in P] == [0, 0, 0, 0, 0, 0, 1]


def test_floats_are_the_fractions_with_the_zeros_left_out():
    for row, nested in zip((*A[1:], E), (*STAGE_WEIGHTS, ERROR_WEIGHTS), strict=True):
        stages = [stage for stage, _ in nested]
        assert stages == [i for i, a in enumerate(row) if a != 0]
        # each weight is relative to the next: from the last backwards they are products
        product = 1.0
        for stage, ratio in reversed(nested):
            product *= float(ratio)
            assert product == pytest.approx(float(row[stage]), rel=1e-14)
    assert DENSE_WEIGHTS.tolist() == [[float(p) for p in row] for row in P]
