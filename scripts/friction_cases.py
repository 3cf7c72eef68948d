"""Compare random oblique impacts of every friction law with the reference solver.

Usage: python scripts/friction_cases.py [--cases 232] [--seed 2] [LAW ...]

It writes tests/data/friction_cases.csv: by law and result the number of cases, the median and the largest
difference, relative to the larger of the slip before the impact and what friction can stop, or its square for
works, the number of cases that differ by more than the tolerance of the tests, and the worst case. The rows of
other laws stay, so that laws can be compared one by one. Regime, slip changes and
status are equal or not. All 3,580 cases take about ten minutes.
"""

from __future__ import annotations

import argparse
import csv
import datetime
import re
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.friction_cases import COMBINATIONS, random_batches  # noqa: E402
from tests.test_friction_random import differences  # noqa: E402

from impact import __version__  # noqa: E402

TABLE = ROOT / "tests" / "data" / "friction_cases.csv"


COLUMNS = ("friction", "result", "cases", "median", "largest", "differing", "version", "date", "worst case")


def rows_of(key: str, count: int, seed: int) -> list[list[str | int]]:
    """Compare the cases of a law, and print those that differ."""
    cases = [case for batch in random_batches(key, count, seed) for case in differences(batch)]
    for _, description, wrong in cases:
        if wrong:
            print(f"{description}: {', '.join(wrong)}", file=sys.stderr)
    results = dict.fromkeys(name for errors, _, wrong in cases for name in (*errors, *wrong))
    made = (__version__, datetime.date.today().isoformat())
    rows: list[list[str | int]] = []
    for result in results:
        known = [(errors[result], description) for errors, description, _ in cases if result in errors]
        differing = [description for _, description, wrong in cases if result in wrong]
        if known:
            largest, worst = max(known, key=lambda case: case[0])
            median = float(np.median([error for error, _ in known]))
            sizes = (len(known), f"{median:.1e}", f"{largest:.1e}")
        else:
            worst, sizes = differing[0], (len(cases), "", "")
        # a function has another address in each process
        worst = re.sub(r"<function (\w+).*?<locals>.*?>", r"\1", worst)
        rows.append([key, result, *sizes, len(differing), *made, worst])
    return rows


def write(rows: list[list[str | int]]) -> None:
    """Replace the rows of a law in the table."""
    old = list(csv.reader(TABLE.open(newline="")))[1:] if TABLE.exists() else []
    table = [[str(value) for value in row] for row in rows]
    table += [row for row in old if row[0] != table[0][0]]
    order = [*COMBINATIONS]
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(sorted(table, key=lambda row: order.index(row[0])))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("laws", nargs="*", metavar="LAW", help="friction laws, all by default")
    parser.add_argument("--cases", type=int, default=232, help="cases of each law (default %(default)s)")
    parser.add_argument("--seed", type=int, default=2, help="seed of the random numbers (default %(default)s)")
    options = parser.parse_args()
    for key in options.laws or COMBINATIONS:
        rows = rows_of(key, options.cases, options.seed)
        write(rows)
        for row in rows:
            print(*row[:6], flush=True)


if __name__ == "__main__":
    main()
