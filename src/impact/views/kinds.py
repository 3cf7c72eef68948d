"""The kinds of picture: what each shows, its numbers, its drawing, and its numbers as a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import UsageError, did_you_mean
from ..text import safe_text
from .grids import draw_grids
from .lines import Lines, draw_lines
from .motions import MOTIONS
from .names import KINDS, WIDTHS
from .over import error, final_velocities, restitution
from .planes import Grids, field_map, validity

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

Numbers = Lines | Grids


@dataclass(frozen=True)
class Choice:
    """What of a result is drawn; see `impact.plot`."""

    x: str | None = None
    y: str | None = None
    variable: str = "e_error"
    sel: Mapping[str, float | str] | None = None
    models: Sequence[str] | None = None
    log: str = ""


def numbers_of(
    kind: str, dataset: xr.Dataset, choice: Choice, histories: Callable[[], Sequence[xr.Dataset]]
) -> Numbers:
    """The numbers of a picture.

    Parameters
    ----------
    kind : one of KINDS
    dataset : a result, or a time history
    choice : what of it
    histories : follows the chosen point through time by each model

    Raises
    ------
    UsageError : there is no such kind, or the result has not got what it wants
    """
    if kind not in KINDS:
        raise UsageError(f'--kind: no kind "{safe_text(kind)}"; {did_you_mean(kind, list(KINDS))}')
    if kind in MOTIONS:
        return MOTIONS[kind](histories())
    if kind == "map":
        return field_map(
            dataset, variable=choice.variable, x=choice.x, y=choice.y, sel=choice.sel, models=choice.models,
            log=choice.log,
        )  # fmt: skip
    if kind == "validity":
        return validity(dataset, x=choice.x, y=choice.y, sel=choice.sel, models=choice.models, log=choice.log)
    over = {"restitution": restitution, "error": error}.get(kind, final_velocities)
    return over(dataset, choice.x, choice.sel, choice.models, choice.log)


def draw(numbers: Numbers, width: float = WIDTHS["double"]) -> Figure:
    """Draw a picture, of a width [in]."""
    return draw_lines(numbers, width) if isinstance(numbers, Lines) else draw_grids(numbers, width)


def as_csv(numbers: Numbers) -> str:
    """The numbers behind a picture, a row for each point; every digit is kept."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(numbers.columns)
    writer.writerows(numbers.rows())
    return text.getvalue()
