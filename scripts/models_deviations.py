"""Section "Known deviations" of docs/models.md, with numbers that are computed here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from impact.contact.model import ForceModel
from impact.contact.models import catalogue
from models_restitution import (
    BOUNDS,
    GRID,
    ROUNDING,
    closed_form_restitution,
    distinct_models,
    error,
    restitution_curves,
)
from models_tables import largest, number, table


def deviations() -> str:
    """All paragraphs of the section."""
    candidates = [model for model in distinct_models() if "e" in model.quantities]
    models = [model for model in candidates if closed_form_restitution(model, GRID) is not None]
    paragraphs = (
        lower_limits(models),
        errors_in_domain(),
        loss_at_one(models),
        slopes(models),
        without_tension(models),
        codes(models),
        square_root(),
    )
    return "\n\n".join(paragraphs)


def e_out_at(model: ForceModel, e: float) -> float:
    """The delivered restitution of a model that has a closed form."""
    e_out = closed_form_restitution(model, [e])
    assert e_out is not None, model.key
    return float(e_out[0])


def model_table(head: Sequence[str], rows: Iterable[tuple[ForceModel, Sequence[str]]]) -> str:
    """A table with a row of cells for each model."""
    return table(("law", *head), ((f"`{model.key}`", *cells) for model, cells in rows))


def lower_limits(models: Sequence[ForceModel]) -> str:
    """Models whose restitution has a lower limit."""
    rows = [(model, [number(e_out_at(model, 0.0))]) for model in models if e_out_at(model, 0.0) > ROUNDING]
    return f"""\
**Lower limit of e_out.** The damping of these laws is finite at e = 0, so that e_out is never below

{model_table(["e_out at e = 0"], rows)}"""


def errors_in_domain() -> str:
    """Models with errors in their stated domain."""
    rows = []
    for model in distinct_models():
        low, high = model.domain.get("e", (np.inf, np.inf))
        inside = (low - ROUNDING < GRID) & (high + ROUNDING > GRID)
        over_e = restitution_curves()[model.key].over == "e"
        if over_e and error(model)[inside].max(initial=0.0) > BOUNDS[0] - ROUNDING:
            rows.append((model, [model.domain_text, largest(error(model)[inside], GRID[inside])]))
    return f"""\
**Errors in the stated domain.** The error of these laws in their stated domain is {BOUNDS[0]:g} or more:

{model_table(["stated domain", "largest error there"], rows)}"""


def loss_at_one(models: Sequence[ForceModel]) -> str:
    """Models with an energy loss at e = 1."""
    rows = [(model, [number(e_out_at(model, 1.0))]) for model in models if e_out_at(model, 1.0) < 1 - ROUNDING]
    return f"""\
**Energy loss at e = 1.** For a requested elastic impact these laws deliver

{model_table(["e_out at e = 1"], rows)}"""


def slope_at_one(model: ForceModel) -> float:
    """de_out/de at e = 1, by a one-sided difference of second order."""
    h = 1e-3
    return (3 * e_out_at(model, 1.0) - 4 * e_out_at(model, 1.0 - h) + e_out_at(model, 1.0 - 2 * h)) / (2 * h)


def slopes(models: Sequence[ForceModel]) -> str:
    """Models that are wrong to first order in 1 − e."""
    near = 1 - 1e-3

    def smooth(model: ForceModel) -> bool:
        # some codes replace a formula that is wrong at e = 1, or just below, by no damping
        return e_out_at(model, 1.0) > 1 - ROUNDING and abs(e_out_at(model, near) - near) < 5e-3

    slope = {model.key: slope_at_one(model) for model in models if smooth(model)}
    wrong = [model for model in models if abs(slope.get(model.key, 1.0) - 1) > BOUNDS[0]]
    rows = [(model, [number(slope[model.key], 3), number(e_out_at(model, 0.9))]) for model in wrong]
    return f"""\
**Wrong slope at e = 1.** For small losses to be correct, de_out/de must be 1 at e = 1. If it is smaller, the loss
is smaller than requested (half of it for 0.5); if it is larger, the loss is larger.

{model_table(["de_out/de at e = 1", "e_out at e = 0.9"], rows)}"""


def without_tension(models: Sequence[ForceModel]) -> str:
    """Models whose damping ratio is that of another end of the contact."""
    with_tension = {f"{model.key}-no-tension" for model in models}
    examples = (0.1, 0.5, 0.9)
    rows = [
        (model, [number(e_out_at(model, e)) for e in examples]) for model in models if model.key in with_tension
    ]
    return f"""\
**Damping for a different end of contact.** ζ = −ln e/√(π² + ln² e) delivers e if the contact ends at zero
indentation. Codes that use it without tension deliver more; `exact-dashpot-no-tension` has the correct ζ for
that end.

{model_table([f"e_out at e = {e:g}" for e in examples], rows)}"""


def codes(models: Sequence[ForceModel]) -> str:
    """Codes that deliver a different restitution from the requested one."""
    examples = (0.1, 0.5, 0.9)
    wrong = [model for model in models if model.family == "codes" and np.abs(error(model)).max() > BOUNDS[0]]
    rows = [(model, [model.title, *(number(e_out_at(model, e)) for e in examples)]) for model in wrong]
    return f"""\
**Codes that deliver a different e.** At small time steps e_out differs from e by {BOUNDS[0]:g} or more somewhere:

{model_table(["code", *(f"e_out at e = {e:g}" for e in examples)], rows)}"""


def square_root() -> str:
    """A model that delivers √e."""
    model = catalogue()["kelvin-voigt-hysteretic"]
    assert np.abs(restitution_curves()[model.key].e_out - np.sqrt(GRID)).max() < ROUNDING
    return f"""\
**Square root.** `{model.key}` unloads with e K δ. This recovers the fraction e of the work, and so delivers √e,
{number(e_out_at(model, 0.5))} at e = 0.5; with e² in place of e it would deliver e."""
