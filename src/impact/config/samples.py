"""Samples of uncertain inputs: what [design] draws from the distributions of a config."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..array_types import Array
from ..contact.model import ForceModel
from .input_names import InputName, paths_with
from .quantities import DISTRIBUTION_FORMS, ConfigProblem, Distribution, as_text
from .tables import Design

# samples of a unit interval stay this far from its ends, half the resolution of a Sobol sequence, so that no value
# of a normal distribution is infinite
LEAST_UNIT = 2.0**-31


def design_problems(data: Mapping[str, Any]) -> Iterator[ConfigProblem]:
    """Check that distributions have a [design], and that a [design] has distributions."""
    paths = paths_with(data, DISTRIBUTION_FORMS)
    if paths and "design" not in data:
        yield paths[0], "got a distribution, expected a table [design] as well, such as n = 1024"
    if not paths and "design" in data:
        expected = "at least one, such as v1 = { normal = [1.0, 0.05] }"
        yield ("design",), f"got a design without an uncertain input, expected {expected}"


def unit_samples(design: Design, dimensions: int) -> Array:
    """Draw samples of the unit cube, shape (n, dimensions)."""
    # imported here: scipy.stats is slow to import
    from scipy.stats import qmc

    random = np.random.default_rng(design.seed)
    engines = {"sobol": qmc.Sobol, "lhs": qmc.LatinHypercube, "halton": qmc.Halton}
    if design.method in engines:
        samples: Array = engines[design.method](dimensions, rng=random).random(design.n)
    else:
        samples = random.random((design.n, dimensions))
    return np.clip(samples, LEAST_UNIT, 1.0 - LEAST_UNIT)


def draw(kind: str, numbers: Sequence[float], u: Array) -> Array:
    """Evaluate the inverse of the cumulative function of a distribution at probabilities u.

    >>> draw("triangular", (0.0, 1.0, 2.0), np.array([0.125, 0.5, 0.875])).tolist()
    [0.5, 1.0, 1.5]
    >>> draw("empirical", (3.0, 1.0), np.array([0.2, 0.7])).tolist()
    [1.0, 3.0]
    """
    from scipy import stats

    with np.errstate(all="ignore"):
        match kind, numbers:
            case "uniform", [least, most]:
                drawn = stats.uniform(least, most - least).ppf(u)
            case "normal", [mean, deviation]:
                drawn = stats.norm(mean, deviation).ppf(u)
            case "lognormal", [median, ratio]:
                drawn = stats.lognorm(math.log(ratio), scale=median).ppf(u)
            case "triangular", [least, mode, most]:
                width = most - least
                drawn = stats.triang((mode - least) / width, least, width).ppf(u)
            case _:
                drawn = np.quantile(numbers, u, method="inverted_cdf")
    # -0.0 becomes 0.0
    return np.asarray(drawn) + 0.0


def draw_columns(
    distributions: Mapping[str, Distribution], models: Mapping[str, ForceModel], u: Array
) -> tuple[dict[str, Array], dict[str, str]]:
    """Draw the values of each input, and list those that its quantity does not allow; both by config name.

    The samples of the unit cube have the shape (n, inputs).
    """
    columns: dict[str, Array] = {}
    problems: dict[str, str] = {}
    for (name, distribution), probabilities in zip(distributions.items(), u.T, strict=True):
        columns[name] = drawn = draw(distribution.kind, distribution.numbers, probabilities)
        quantity = InputName.parse(name).quantity(models)
        assert quantity is not None
        refused = drawn[~(quantity.contains(drawn) & np.isfinite(drawn))]
        if refused.size:
            got = f"{refused.size:,} of {drawn.size:,} samples such as {as_text(float(refused[0]))}"
            problems[name] = f"got {got}, expected a distribution whose values are each {quantity.expected}"
    return columns, problems
