"""Every root that a direct scan of 20,000 values brackets is found by `impact solve`, and no other."""

from __future__ import annotations

import numpy as np
import pytest

import impact

# a law, its parameter, and the values among which one is drawn, for the balls of Table 1 of the paper
LAWS = {
    "kuwabara-kono-1987": ("A", 1e-6, 1e-3),
    "kelvin-voigt": ("C", 1e1, 1e5),
    "kelvin-voigt-no-tension": ("C", 1e1, 1e5),
    "lee-herrmann-1993": ("gamma", 1e1, 1e5),
    "simbody-hunt-crossley": ("c", 1e-2, 3.0),
    "mujoco-solref": ("dampratio", 1e-2, 1.0),
    "yade-betan-direct": ("betan", 1e-2, 1.0),
    "muthukumar-2003": ("d", 1e-5, 1e-3),
}
OUTPUTS = ("e_out", "contact_time", "peak_force")
SCANNED, DECADES, ROUNDING = 20_000, 2.0, 1e-9


@pytest.mark.long
@pytest.mark.parametrize("case", range(200))
def test_the_roots_are_those_of_a_scan(case: int) -> None:
    rng = np.random.default_rng(case)
    key = str(rng.choice(list(LAWS)))
    name, least, most = LAWS[key]
    output = str(rng.choice(OUTPUTS))
    value = float(np.exp(rng.uniform(np.log(least), np.log(most))))
    at = {"v1": float(rng.uniform(0.2, 3.0)), **({"e": 0.5} if key == "muthukumar-2003" else {})}
    target = float(impact.run(model=key, at={**at, name: value}).values[output])
    (parameter,) = (parameter for parameter in impact.models()[key].parameters if parameter.name == name)
    ends = (max(value / 10**DECADES, parameter.least), min(value * 10**DECADES, parameter.most))
    config = {
        "models": key,
        "sweep": {**at, "m1": 1.0, "m2": 1.0, "material": "table1"},
        "materials": {"table1": {"E": "56 GPa", "nu": 0.3, "rho": 2712}},
        "model": {key: {name: {"geomspace": [*ends, SCANNED]}}},
        "output": {"variables": [output]},
    }
    scan = impact.sweep(config)
    distance = scan[output].values.squeeze() - target
    values = scan[f"{key}.{name}"].values
    # where a whole interval gives the target, rounding crosses it
    is_larger = np.maximum(np.abs(distance[:-1]), np.abs(distance[1:])) > ROUNDING * abs(target)
    crossed = np.flatnonzero((np.sign(distance[:-1]) * np.sign(distance[1:]) < 0) & is_larger)
    roots = np.array([root.value for root in impact.solve(key, name, {output: target}, at=at).roots])
    inside = roots[(roots > ends[0]) & (roots < ends[1])]
    # a value that touches the target, or lies at the end of an interval that gives it, is crossed by no scan
    for index in crossed:
        bracketed = (inside >= values[index] * (1 - 1e-6)) & (inside <= values[index + 1] * (1 + 1e-6))
        assert bracketed.any(), (key, output, target, values[index], roots)
    for root in inside:
        index = min(int(np.searchsorted(values, root)), SCANNED - 1)
        near = np.abs(distance[max(index - 1, 0) : index + 1])
        # where an output falls to zero, values that are as good as zero are roots
        assert near.min() <= 1e-3 * abs(target) + 1e-8, (key, output, target, root)
