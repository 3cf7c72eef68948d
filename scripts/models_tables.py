"""Numbers, intervals and tables of docs/models.md as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from impact.array_types import Array
from models_restitution import GRID, ROUNDING


def number(value: float, digits: int = 4) -> str:
    """A number in fixed notation. Ties are rounded up, so that the last bits do not change the page."""
    return f"{value + ROUNDING:.{digits}f}"


def within(errors: Array, bound: float) -> str:
    """Where errors are below a bound, as intervals of the grid."""
    inside = errors < bound - ROUNDING
    edges = np.flatnonzero(np.diff(inside, prepend=False, append=False)).tolist()
    runs = zip(GRID[edges[::2]], GRID[[end - 1 for end in edges[1::2]]], strict=True)
    return ", ".join(map(interval, runs)) or "nowhere"


def interval(ends: tuple[float, float]) -> str:
    """An interval of the grid as text.

    >>> interval((0.005, 0.3)), interval((0.2, 0.3)), interval((0.9, 1.0)), interval((0.005, 1.0))
    ('≤ 0.3', '0.2 to 0.3', '≥ 0.9', 'all')
    """
    first, last = ends[0] == GRID[0], ends[1] == GRID[-1]
    if first or last:
        return "all" if first and last else f"≤ {ends[1]:g}" if first else f"≥ {ends[0]:g}"
    return f"{ends[0]:g} to {ends[1]:g}"


def largest(errors: Array, e: Array = GRID) -> str:
    """The largest error, and the e at which it occurs."""
    k = int(np.argmax(np.round(errors, 10)))
    return f"{number(errors[k])} at {e[k]:g}" if errors[k] > ROUNDING else "none"


def short(value: float) -> str:
    """A number of any magnitude with three digits."""
    return f"{float(f'{value:.3g}'):g}".replace("e-0", "e-")


def cell(text: str) -> str:
    """Text in a cell of a Markdown table."""
    return "".join("\\" + character if character in "|*_<\\" else character for character in text)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def formula(text: str) -> str:
    """A formula in a cell, with line breaks only after commas and at double spaces."""
    return ", ".join(
        " ".join(part.replace(" ", "\N{NO-BREAK SPACE}") for part in piece.split("  "))
        for piece in cell(text).replace(",  ", ", ").split(", ")
    )
