"""How a sweep is run and stored: what a config says besides the physics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

DTYPES = ("float64", "float32")
COMPRESSIONS = ("none", "gzip")
LAYOUTS = ("auto", "full", "factored")
CORES = ("auto", "numpy", "numba")
DEFAULT_RTOL = 1e-10


@dataclass(frozen=True)
class Solver:
    """How impacts are integrated.

    Parameters
    ----------
    rtol : relative tolerance
    max_steps : steps that one impact may take
    collapse : integrate impacts that are the same in the contact's own units once; changes no bit
    core : "numpy"; "numba", which compiles what it can; or "auto", whichever is sooner done
    """

    rtol: float = DEFAULT_RTOL
    max_steps: int = 10_000
    collapse: bool = True
    core: str = "auto"


@dataclass(frozen=True)
class Output:
    """What of a result is stored, and how.

    Parameters
    ----------
    variables : of the result, or None for all
    dtype : of its floating-point numbers, "float64" or "float32"; coordinates are float64
    compression : "none" or "gzip"
    chunks : the lengths along the axes, by name, of the chunks in which it is stored; empty for one piece
    layout : "full", all values; "factored", the trajectories, from which they are computed when they are read; or
        "auto", in full up to 10^7 points
    """

    variables: tuple[str, ...] | None = None
    dtype: str = "float64"
    compression: str = "none"
    chunks: Mapping[str, int] = field(default_factory=dict)
    layout: Literal["auto", "full", "factored"] = "auto"
