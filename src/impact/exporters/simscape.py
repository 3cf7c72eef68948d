"""Simscape Multibody, block Spatial Contact Force."""

from __future__ import annotations

import math

from ..formatting import number, quantity
from .code import Code, Collision, Lines, Parameters

# of the peak indentation of the undamped spring: a wider transition region is warned about
WIDE_TRANSITION = 0.1


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the parameters of the section Normal Force, in the block's default units."""
    return {
        "NormalForceType": "SmoothSpringDamper",
        "NormalStiffness": c["K"],
        "NormalDamping": c["b"],
        "NormalTransitionRegionWidth": c["w"],
    }


def lines(collision: Collision, parameters: Parameters) -> Lines:
    pairs = [f"'{name}', '{value}'" for name, value in parameters.items()]
    return ["set_param(block, ...", *(f"    {pair}, ..." for pair in pairs[:-1]), f"    {pairs[-1]});"]


def transition_share(c: Collision) -> float:
    """Compute the width of the transition region over the undamped peak indentation v₀ √(m/K) [-]."""
    return c["w"] / (c["v0"] * math.sqrt(c["m"] / c["K"]))


def notes(collision: Collision) -> Lines:
    share = number(transition_share(collision), 3)
    yield "in the default units of the block, N/m, N/(m/s) and m; block is its path in the model"
    yield "in its dialog: Stiffness, Damping and Transition Region Width, in the section Normal Force"
    yield "the documentation gives no formula for s, only that it goes from 0 to 1 and is level at both ends"
    yield "the cubic s and that the force is never negative are our assumptions"
    yield f"the width is {share} of the peak indentation of the undamped spring; the less, the less s matters"
    yield "two materials: there is no mixing; the values are those of the pair"
    yield "no speed switches the restitution off"
    yield "a variable-step solver chooses its steps: limit them to a small share of the contact time"
    yield "the block exists since R2019b"


def warnings(collision: Collision) -> Lines:
    share = transition_share(collision)
    if share > WIDE_TRANSITION:
        yield (
            f"Transition Region Width = {quantity(collision['w'], 'm')} is {number(share, 3)} of the peak "
            "indentation of the undamped spring: the restitution depends on s of the block, whose "
            "formula is not documented"
        )


CODE = Code(
    title="Simscape Multibody, Spatial Contact Force",
    laws={"simscape-contact": "Smooth Spring-Damper"},
    newest="R2019b",
    tested="not run by us; read in the MathWorks page of the block; names of parameters of public scripts",
    comment=("% ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
    warnings=warnings,
)
