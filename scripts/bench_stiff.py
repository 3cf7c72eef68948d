"""How many steps does a law take whose damping grows without bound as e goes to 0, and how exact is it there?

Two laws of the paper at e = 1e-1 to 1e-6, at the default tolerance; beside the steps the distance of the delivered
restitution from its closed form, and of the contact time and the peak force from a quadrature of 30 digits.

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

from impact.config.load import DEFAULT_RTOL
from impact.contact.models import find
from impact.contact.outputs import collide

MODELS = ("gharib-hurmuzlu-2012", "exact-hysteresis")


def main() -> None:
    e = np.logspace(-1, -6, 6)
    table = Table("model", "e", "χ", "steps", "of those at 0.1", "|e_out/exact − 1|", "time, relative",
                  "peak force, relative", box=None)  # fmt: skip
    for key in MODELS:
        batch = table1_impacts(e=e)
        contact = collide(find(key), batch, rtol=DEFAULT_RTOL, max_steps=10_000)
        unit = batch.length / batch.v0
        for place, asked in enumerate(e):
            chi = contact["damping_ratio"][place]
            exact, exact_time, exact_force = hysteresis_reference(chi, 1.5)
            time = contact["contact_time"][place] / unit[place]
            force = contact["peak_force"][place] * batch.length[place] / (batch.m[place] * batch.v0[place] ** 2)
            table.add_row(
                key, f"{asked:.0e}", f"{chi:.3g}", str(contact["steps"][place]),
                f"{contact['steps'][place] / contact['steps'][0]:.2f}",
                f"{abs(contact['e_out'][place] / exact - 1):.1e}",
                f"{abs(time / exact_time - 1):.1e}", f"{abs(force / exact_force - 1):.1e}",
            )  # fmt: skip
    Console(width=130).print(f"rtol {DEFAULT_RTOL:g}", table, sep="\n")


if __name__ == "__main__":
    main()
