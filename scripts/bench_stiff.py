"""Steps and accuracy of strongly damped models, whose damping ratio grows without bound as e approaches 0.

Two models of the paper at e = 1e-1 to 1e-6, at the default tolerance: the number of steps, the distance of the
delivered restitution from its closed form, and the distances of contact time and peak force from a quadrature with
30 digits.

    python scripts/bench_stiff.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.problems import hysteresis_reference, table1_impacts

from impact.config.tables import DEFAULT_RTOL
from impact.contact.models import find
from impact.contact.output_formulas import collide

MODELS = ("gharib-hurmuzlu-2012", "exact-hysteresis")
HEAD = (
    "model",
    "e",
    "χ",
    "steps",
    "steps/steps(0.1)",
    "|e_out/exact − 1|",
    "time, relative",
    "peak force, relative",
)


def main() -> None:
    e = np.logspace(-1, -6, 6)
    table = Table(*HEAD, box=None)
    for key in MODELS:
        batch = table1_impacts(e=e)
        contact = collide(find(key), batch, rtol=DEFAULT_RTOL, max_steps=10_000)
        time = contact["contact_time"] * batch.v0 / batch.length
        force = contact["peak_force"] * batch.length / (batch.m * batch.v0**2)
        steps, chi = contact["steps"], contact["damping_ratio"]
        for k in range(e.size):
            exact, exact_time, exact_force = hysteresis_reference(chi[k], 1.5)
            table.add_row(
                key,
                f"{e[k]:.0e}",
                f"{chi[k]:.3g}",
                str(steps[k]),
                f"{steps[k] / steps[0]:.2f}",
                f"{abs(contact['e_out'][k] / exact - 1):.1e}",
                f"{abs(time[k] / exact_time - 1):.1e}",
                f"{abs(force[k] / exact_force - 1):.1e}",
            )
    Console(width=130).print(f"rtol {DEFAULT_RTOL:g}", table, sep="\n")


if __name__ == "__main__":
    main()
