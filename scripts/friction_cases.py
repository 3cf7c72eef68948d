"""Compare random oblique impacts of every friction law with the reference solver.

Usage: python scripts/friction_cases.py [--cases 200] [--seed 2] [LAW ...]

It writes tests/data/friction_cases.csv: by law the number of cases, the median, the 99th percentile and the
largest difference of the slip after the impact, relative to the larger of the slip before and what friction can
stop, and the number of cases in which a work, a count or the status differs. All 3,000 cases take about a quarter
of an hour.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.friction_cases import COMBINATIONS, random_batches  # noqa: E402
from tests.test_friction_random import differences  # noqa: E402

TABLE = ROOT / "tests" / "data" / "friction_cases.csv"


def row_of(key: str, count: int, seed: int) -> list[str | int]:
    """Compare the cases of a law, and print those that differ."""
    cases = [case for batch in random_batches(key, count, seed) for case in differences(batch)]
    slip = np.array([difference for difference, _, _ in cases])
    for _, description, wrong in cases:
        if wrong:
            print(f"{description}: {', '.join(wrong)}", file=sys.stderr)
    sizes = (np.median(slip), np.quantile(slip, 0.99), slip.max())
    return [key, len(cases), *(f"{size:.1e}" for size in sizes), sum(bool(wrong) for _, _, wrong in cases)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("laws", nargs="*", metavar="LAW", help="friction laws, all by default")
    parser.add_argument("--cases", type=int, default=200, help="cases of each law (default %(default)s)")
    parser.add_argument("--seed", type=int, default=2, help="seed of the random numbers (default %(default)s)")
    options = parser.parse_args()
    rows = []
    for key in options.laws or COMBINATIONS:
        rows.append(row_of(key, options.cases, options.seed))
        print(*rows[-1], flush=True)
    if options.laws:
        return
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["friction", "cases", "median", "99 percent", "largest", "different"])
        writer.writerows(rows)


if __name__ == "__main__":
    main()
