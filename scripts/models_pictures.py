"""Of docs/models.md: a small picture of each law, the restitution that it delivers."""

from __future__ import annotations

import numpy as np

from impact.contact.model import ForceModel
from impact.plots.style import COLOURS
from models_measured import GRID, SPEEDS, laws, measured

# the picture of a curve, in px: its size, and the margin around the frame
WIDTH, HEIGHT, MARGIN = 120, 80, 4
# readable on white and on black
GREY, BY_E_COLOUR, BY_SPEED_COLOUR = "#808080", COLOURS[6], COLOURS[4]


def place(x: float, y: float) -> str:
    """A point of the unit square on the picture; rounded away from ties, which last bits would decide."""
    across, down = MARGIN + x * (WIDTH - 2 * MARGIN), HEIGHT - MARGIN - y * (HEIGHT - 2 * MARGIN)
    return f"{across + 1e-6:.1f},{down + 1e-6:.1f}"


def curve(model: ForceModel) -> str:
    """The picture of what a law delivers, as SVG."""
    found = measured()[model.key]
    if found.over == "e":
        # every fifth value is enough, and the first
        x, y, colour = GRID, found.e_out, BY_E_COLOUR
        shown = [0, *range(4, len(GRID), 5)]
    else:
        x, y, colour = np.linspace(0.0, 1.0, len(SPEEDS)), found.e_out, BY_SPEED_COLOUR
        shown = list(range(len(SPEEDS)))
    points = " ".join(place(x[k], y[k]) for k in shown)
    low, high = model.domain.get("e", (0.0, 1.0))
    corners = " ".join(place(*corner) for corner in ((low, 0), (low, 1), (high, 1), (high, 0)))
    domain = f'<polygon points="{corners}" fill="{GREY}" fill-opacity="0.25"/>\n' if 0 < high - low < 1 else ""
    diagonal = f'<path d="M{place(0, 0)} L{place(1, 1)}" stroke="{GREY}" stroke-dasharray="3 3"/>\n'
    wide, high_ = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}" role="img">\n'
        f"<title>{model.key}</title>\n"
        f"{domain}"
        f'<rect x="{MARGIN}" y="{MARGIN}" width="{wide}" height="{high_}" fill="none" stroke="{GREY}"/>\n'
        f"{diagonal if found.over == 'e' else ''}"
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>\n'
        "</svg>\n"
    )


def curves() -> dict[str, str]:
    """The pictures as SVG, by the name of their file."""
    return {f"{model.key}.svg": curve(model) for model in laws()}
