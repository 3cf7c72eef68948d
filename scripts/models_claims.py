"""Section "Known deviations" of docs/models.md, with numbers that are computed here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from impact.contact.model import ForceModel
from impact.contact.models import catalogue
from models_measured import (
    BOUNDS,
    GRID,
    ROUNDING,
    delivers,
    error,
    largest,
    laws,
    measured,
    number,
    table,
)


def claims() -> str:
    """All sections of the known deviations."""
    known = [law for law in laws() if "e" in law.quantities and delivers(law, GRID) is not None]
    ends = (floors(known), claimed(), at_one(known), slopes(known), without_tension(known))
    parts = (*ends, of_codes(known), hysteretic())
    return "\n\n".join(parts)


def at(law: ForceModel, e: float) -> float:
    """The delivered restitution of a law that has a closed form."""
    found = delivers(law, [e])
    assert found is not None, law.key
    return float(found[0])


def law_table(head: Sequence[str], rows: Iterable[tuple[ForceModel, str]]) -> str:
    """A table of laws; what is said of one is in cells apart by |."""
    return table(("law", *head), ((f"`{law.key}`", *text.split("|")) for law, text in rows))


def floors(known: Sequence[ForceModel]) -> str:
    """Laws with a lower limit of the restitution."""
    rows = [(law, number(at(law, 0.0))) for law in known if at(law, 0.0) > ROUNDING]
    return f"""\
**Lower limit of e_out.** The damping of these laws is finite at e = 0, so that e_out is never below

{law_table(["e_out at e = 0"], rows)}"""


def claimed() -> str:
    """Laws with errors in their stated domain."""
    rows = []
    for law in laws():
        low, high = law.domain.get("e", (np.inf, np.inf))
        inside = (low - ROUNDING < GRID) & (high + ROUNDING > GRID)
        if measured()[law.key].over == "e" and error(law)[inside].max(initial=0.0) > BOUNDS[0] - ROUNDING:
            rows.append((law, f"{law.domain_text}|{largest(error(law)[inside], GRID[inside])}"))
    return f"""\
**Errors in the stated domain.** The error of these laws in their stated domain is {BOUNDS[0]:g} or more:

{law_table(["stated domain", "largest error there"], rows)}"""


def at_one(known: Sequence[ForceModel]) -> str:
    """Laws with an energy loss at e = 1."""
    rows = [(law, number(at(law, 1.0))) for law in known if at(law, 1.0) < 1 - ROUNDING]
    return f"""\
**Energy loss at e = 1.** For a requested elastic impact these laws deliver

{law_table(["e_out at e = 1"], rows)}"""


def slope_at_one(law: ForceModel) -> float:
    """de_out/de at e = 1, of second order in the distance."""
    h = 1e-3
    return (3 * at(law, 1.0) - 4 * at(law, 1.0 - h) + at(law, 1.0 - 2 * h)) / (2 * h)


def slopes(known: Sequence[ForceModel]) -> str:
    """Laws that are wrong to first order in 1 − e."""
    near = 1 - 1e-3
    # some codes have no damping at e = 1, or just below, in the place of a formula that is wrong there
    smooth = [law for law in known if at(law, 1.0) > 1 - ROUNDING and abs(at(law, near) - near) < 5e-3]
    whole = {law.key: slope_at_one(law) for law in smooth}
    off = [law for law in known if abs(whole.get(law.key, 1.0) - 1) > BOUNDS[0]]
    rows = [(law, f"{number(whole[law.key], 3)}|{number(at(law, 0.9))}") for law in off]
    return f"""\
**Wrong slope at e = 1.** For small losses to be correct, de_out/de must be 1 at e = 1. If it is smaller, the loss
is smaller than requested (half of it for 0.5); if it is larger, the loss is larger.

{law_table(["de_out/de at e = 1", "e_out at e = 0.9"], rows)}"""


def without_tension(known: Sequence[ForceModel]) -> str:
    """Laws whose damping is meant for another end of the contact."""
    with_tension = {f"{law.key}-no-tension" for law in known}
    asked = (0.1, 0.5, 0.9)
    rows = [(law, "|".join(number(at(law, e)) for e in asked)) for law in known if law.key in with_tension]
    return f"""\
**Damping for a different end of contact.** ζ = −ln e/√(π² + ln² e) delivers e if the contact ends at zero
indentation. Codes that use it without tension deliver more; `exact-dashpot-no-tension` has the correct ζ for
that end.

{law_table([f"e_out at e = {e:g}" for e in asked], rows)}"""


def of_codes(known: Sequence[ForceModel]) -> str:
    """Codes that deliver another restitution than they are asked for."""
    asked = (0.1, 0.5, 0.9)
    codes = [law for law in known if law.family == "codes" and np.abs(error(law)).max() > BOUNDS[0]]
    rows = [(law, "|".join([law.title, *(number(at(law, e)) for e in asked)])) for law in codes]
    return f"""\
**Codes that deliver a different e.** At small time steps e_out differs from e by {BOUNDS[0]:g} or more somewhere:

{law_table(["code", *(f"e_out at e = {e:g}" for e in asked)], rows)}"""


def hysteretic() -> str:
    """A law that delivers √e."""
    law = catalogue()["kelvin-voigt-hysteretic"]
    assert np.abs(measured()[law.key].e_out - np.sqrt(GRID)).max() < ROUNDING
    return f"""\
**Square root.** `{law.key}` unloads with e K δ. This recovers the fraction e of the work, and so delivers √e,
{number(at(law, 0.5))} at e = 0.5; with e² in place of e it would deliver e."""
