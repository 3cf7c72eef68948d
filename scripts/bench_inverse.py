"""Time of fits and solves after the imports, next to that of another source tree.

Fits one law with one parameter to twelve points, and twenty laws to fifty points; solves for two parameters.
Prints the CPU seconds of each, and with `--against` those of the other tree in the same run. Then times calls of a
prepared problem next to `impact.run` and a loop of solve_ivp, and a call with an array next to a sweep.

    python scripts/bench_inverse.py [--against OTHER/src]
"""

from __future__ import annotations

import argparse
import math
import os
import subprocess
import sys
import time
from typing import Any

import numpy as np

import impact
from bench_core import solve_ivp_restitution
from ratios import record

# laws that take an e, and two with a parameter of their own
LAWS = [
    "hunt-crossley-1975",
    "herbert-mcwhannell-1977",
    "lee-wang-1983",
    "lankarani-nikravesh-1990",
    "gonthier-2004",
    "zhiying-qishao-2006",
    "flores-2011",
    "gharib-hurmuzlu-2012",
    "hu-guo-2015",
    "anagnostopoulos-1988",
    "anagnostopoulos-1988-no-tension",
    "tsuji-1992",
    "tsuji-1992-no-tension",
    "jankowski-2006",
    "lankarani-nikravesh-1994",
    "bilinear",
    "exact-approach-dashpot",
    "simbody-hunt-crossley",
    "kelvin-voigt",
    "kuwabara-kono-1987",
]
FITS = {
    "kuwabara-kono-1987": {"A": {"fit": [1e-8, 1e-3]}},
    "kelvin-voigt": {"C": {"fit": [0.01, 1000.0]}},
    "simbody-hunt-crossley": {"c": {"fit": [0.001, 10.0]}},
}


def config(laws: list[str], points: int) -> dict[str, Any]:
    """Build a calibration of drops of a ball on a plate, whose restitution falls with the speed."""
    speeds = np.geomspace(0.1, 3.0, points)
    noise = 0.01 * np.random.default_rng(1).standard_normal(points)
    fit_e = {"e": {"fit": [0.05, 1.0]}} if len(laws) > 1 else {}
    return {
        "models": laws,
        "sweep": {
            "m1": 2.7e-3,
            "R1": 0.02,
            "m2": math.inf,
            "R2": math.inf,
            "material1": "a",
            "material2": "b",
            **fit_e,
        },
        "materials": {"a": {"E": 2e9, "nu": 0.4}, "b": {"E": 2e11, "nu": 0.3}},
        "model": {key: fit for key, fit in FITS.items() if key in laws},
        "data": {
            "columns": {
                "v1": speeds.tolist(),
                "e_out": (0.9 - 0.05 * np.log10(10.0 * speeds) + noise).tolist(),
                "sigma": [0.01] * points,
            }
        },
    }


def measure() -> None:
    """Print the CPU seconds of each case, after one run for the imports and the compilation."""
    one, twenty = config(LAWS[-1:], 12), config(LAWS, 50)
    compiled = {**twenty, "solver": {"core": "numba"}}
    impact.calibrate(one)
    impact.calibrate(compiled)
    cases = {
        "1 law, 1 parameter, 12 points": lambda: impact.calibrate(one),
        "20 laws, 50 points": lambda: impact.calibrate(twenty),
        "20 laws, 50 points, numba": lambda: impact.calibrate(compiled),
        "solve for a damping ratio": lambda: impact.solve("mujoco-solref", "dampratio", {"e_out": 0.6}),
        "solve beside a fold": lambda: impact.solve(
            "muthukumar-2003", "d", {"e_out": 0.64}, at={"e": 0.5, "v1": 1.0}
        ),
    }
    for name, run in cases.items():
        start = time.process_time()
        run()
        print(f"{name:32}{time.process_time() - start:8.2f} s")


def measure_calls(calls: int = 200, size: int = 1_000_000) -> None:
    """Print milliseconds of one impact by each means, and seconds of many at once, for a law that depends on e."""
    law = impact.models()["gharib-hurmuzlu-2012"]
    problem = impact.prepare(model=law.key, outputs="e_out")
    ways = {
        "prepared problem": lambda e: problem(e=e)["e_out"],
        "impact.run": lambda e: impact.run(model=law.key, at={"e": e}).values["e_out"],
        "solve_ivp, rtol 1e-10": lambda e: solve_ivp_restitution(law, e, 1e-10),
    }
    values = np.linspace(0.3, 0.9, calls).tolist()
    expected = problem(e=values)["e_out"]
    each = {}
    for name, way in ways.items():
        start = time.perf_counter()
        difference = np.abs(np.array([way(e) for e in values]) - expected).max()
        each[name] = 1e3 * (time.perf_counter() - start) / calls
        print(f"{name:32}{each[name]:8.2f} ms an impact, e_out within {difference:.1e} of the array's")
    for name in list(ways)[1:]:
        record(f"time of {name} per prepared problem", [each[name] / each["prepared problem"]])
    many = np.linspace(0.01, 1.0, size)
    sweep = {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e9, "e": many}
    config = {"models": law.key, "sweep": sweep, "output": {"variables": ["e_out"]}}
    for name, run in {"prepared": lambda: problem(e=many), "sweep": lambda: impact.sweep(config).load()}.items():
        start = time.perf_counter()
        run()
        print(f"{name}, {size:,} impacts{time.perf_counter() - start:16.2f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", help="source tree of another version")
    arguments = parser.parse_args()
    print(impact.__file__, flush=True)
    measure()
    measure_calls()
    if arguments.against:
        environment = {**os.environ, "PYTHONPATH": arguments.against}
        subprocess.run([sys.executable, __file__], env=environment, check=True)
