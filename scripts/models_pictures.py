"""The small pictures of docs/models.md: the restitution that each model delivers."""

from __future__ import annotations

import numpy as np

from impact.contact.model import ForceModel
from impact.plots.style import COLOURS
from models_restitution import GRID, SPEEDS, distinct_models, restitution_curves

# size of a picture and margin around its frame, in px
WIDTH, HEIGHT, MARGIN = 120, 80, 4
# readable on white and on black
GREY, BY_E_COLOUR, BY_SPEED_COLOUR = "#808080", COLOURS[6], COLOURS[4]


def svg_point(x: float, y: float) -> str:
    """Coordinates in the picture of a point of the unit square.

    The offset avoids ties, whose rounding would depend on the last bits.
    """
    across, down = MARGIN + x * (WIDTH - 2 * MARGIN), HEIGHT - MARGIN - y * (HEIGHT - 2 * MARGIN)
    return f"{across + 1e-6:.1f},{down + 1e-6:.1f}"


def picture(model: ForceModel) -> str:
    """The restitution curve of a model as SVG."""
    curve = restitution_curves()[model.key]
    if curve.over == "e":
        # the first value, and every fifth
        x, colour, indices = GRID, BY_E_COLOUR, [0, *range(4, len(GRID), 5)]
    else:
        x, colour, indices = np.linspace(0.0, 1.0, len(SPEEDS)), BY_SPEED_COLOUR, list(range(len(SPEEDS)))
    points = " ".join(svg_point(x[k], curve.e_out[k]) for k in indices)
    low, high = model.domain.get("e", (0.0, 1.0))
    corners = " ".join(svg_point(*corner) for corner in ((low, 0), (low, 1), (high, 1), (high, 0)))
    domain = f'<polygon points="{corners}" fill="{GREY}" fill-opacity="0.25"/>\n' if 0 < high - low < 1 else ""
    line = f"M{svg_point(0, 0)} L{svg_point(1, 1)}"
    diagonal = f'<path d="{line}" stroke="{GREY}" stroke-dasharray="3 3"/>\n' if curve.over == "e" else ""
    frame_width, frame_height = WIDTH - 2 * MARGIN, HEIGHT - 2 * MARGIN
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}" role="img">\n'
        f"<title>{model.key}</title>\n"
        f"{domain}"
        f'<rect x="{MARGIN}" y="{MARGIN}" width="{frame_width}" height="{frame_height}" '
        f'fill="none" stroke="{GREY}"/>\n'
        f"{diagonal}"
        f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>\n'
        "</svg>\n"
    )


def labelled_picture(model: ForceModel) -> str:
    """The picture of a model with labels at its axes, as an element of a page."""
    x, low, high = ("e", "0", "1") if restitution_curves()[model.key].over == "e" else ("v₀ [m/s]", "0.01", "10")
    (left, bottom), (right, top) = (svg_point(*corner).split(",") for corner in ((0, 0), (1, 1)))
    middle, below = WIDTH / 2, HEIGHT + 4
    labels = "\n".join(
        f'<text x="{across}" y="{down}" text-anchor="{anchor}">{text}</text>'
        for across, down, anchor, text in (
            *((left, below, "start", low), (middle, below, "middle", x), (right, below, "end", high)),
            *((0, bottom, "end", "0"), (0, HEIGHT / 2, "end", "e_out"), (0, float(top) + 4, "end", "1")),
        )
    )
    curve = picture(model).partition("\n")[2]
    return f'<svg class="curve" viewBox="-20 0 {WIDTH + 24} {HEIGHT + 8}" role="img">\n{labels}\n{curve}'


def pictures() -> dict[str, str]:
    """All pictures as SVG, by file name."""
    return {f"{model.key}.svg": picture(model) for model in distinct_models()}
