"""LIGGGHTS as both runners use it: one process runs every collision, with `clear` between them.

A process needs a tenth of a second to start, a collision a few milliseconds.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

from runner import serve_all

PROGRAM = "liggghts"


def serve_scripts(
    script: Callable[..., str], answer: Callable[[dict[str, list[float]]], tuple[float, ...]]
) -> None:
    """Run the script of every collision, which dumps numbers by the id of an atom to the file `velocities`.

    Parameters
    ----------
    script
        Returns the lines of a collision; it gets what `runner.serve` names.
    answer
        Returns the velocities after the contact, from the last numbers of each atom.
    """

    def collide_all(collisions: list[dict[str, object]]) -> list[tuple[float, ...]]:
        Path("dumps").mkdir(exist_ok=True)
        scripts = [
            script(**collision).replace(" velocities ", f" dumps/{index} ")
            for index, collision in enumerate(collisions)
        ]
        process = subprocess.run(
            [PROGRAM, "-log", "none"],
            input="\nclear\n".join(scripts),
            capture_output=True,
            text=True,
            check=False,
        )
        if process.returncode or "ERROR" in process.stdout:
            raise RuntimeError(process.stdout[-2000:] + process.stderr)
        return [answer(last_numbers(Path("dumps", str(index)))) for index in range(len(collisions))]

    words = subprocess.run([PROGRAM, "-help"], capture_output=True, text=True, check=False).stdout
    serve_all(re.search(r"LIGGGHTS-PUBLIC ([\d.]+)", words)[1], collide_all)  # type: ignore[index]


def last_numbers(dump: Path) -> dict[str, list[float]]:
    """The numbers of each atom in the last state of a dump."""
    rows = dump.read_text(encoding="utf-8").rpartition("ITEM: ATOMS")[2].splitlines()[1:]
    return {atom: [*map(float, numbers)] for atom, *numbers in map(str.split, rows)}
