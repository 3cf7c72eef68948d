"""Impacts that are the same physics are integrated once, and no bit of a result shows it."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact.data.results import SCHEMA
from impact.sweeps.config import read_config
from impact.sweeps.plan import Plan

# a few values of each, so that many points are the same: in scale only, in a material only, or altogether
VALUES: dict[str, list[object]] = {
    "e": [0.0, 0.1, 0.5, 1.0], "v1": [-1.0, 0.5, 1.0, 2.0], "v2": [0.0, -1.0], "m1": [1.0, 2.0, float("inf")],
    "m2": [0.5, 1.0, float("inf")], "material": ["soft", "hard"], "n": [1.0, 1.5, 2.0], "R1": [0.05, float("inf")],
}  # fmt: skip
MATERIALS = {
    "soft": {"E": 2e9, "nu": 0.4, "rho": 1000.0, "yield_strength": 1e7},
    "hard": {"E": 2.1e11, "nu": 0.3, "rho": 7850.0, "yield_strength": 3e8},
}


@st.composite
def sweeps(draw: st.DrawFn) -> dict[str, object]:
    names = [*["e", "v1", "m1", "m2", "material"], *draw(st.sets(st.sampled_from(["v2", "n", "R1"])))]
    sweep = {
        name: draw(
            st.sampled_from(VALUES[name]) | st.lists(st.sampled_from(VALUES[name]), min_size=2, unique=True)
        )
        for name in draw(st.permutations(names))
    }
    models = draw(st.lists(st.sampled_from(sorted(impact.models())), min_size=1, max_size=3, unique=True))
    return {"models": models, "sweep": sweep, "materials": MATERIALS, "solver": {"rtol": 1e-6}}


@settings(max_examples=60)
@given(sweeps())
def test_both_give_the_same_bits(config: dict[str, object]) -> None:
    once = impact.sweep(config)
    each = impact.sweep(config, overrides=["solver.collapse=false"])
    for one in SCHEMA:
        assert once[one.name].values.tobytes() == each[one.name].values.tobytes(), one.name


def test_it_is_no_other_result() -> None:
    config = {"models": "hertz", "sweep": {"e": 0.5, "v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 6e9}}
    once, each = (Plan(read_config(config, [f"solver.collapse={word}"])) for word in ("true", "false"))
    assert (once.config.solver.collapse, each.config.solver.collapse) == (True, False)
    assert once.fingerprint == each.fingerprint
