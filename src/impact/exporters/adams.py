"""Adams, contact force IMPACT."""

from __future__ import annotations

from ..formatting import number
from .code import Code, Collision, Lines, Parameters

MM_PER_M = 1000.0


def parameters(c: Collision) -> dict[str, float | str]:
    """Stiffness, exponent, damping and penetration in mm, N, s and kg."""
    return {
        "stiffness": c["K"] / MM_PER_M ** c["n"],
        "exponent": c["n"],
        "damping": c["c"] / MM_PER_M,
        "dmax": c["d"] * MM_PER_M,
    }


def lines(collision: Collision, parameters: Parameters) -> Lines:
    stiffness, exponent, damping, dmax = (repr(value) for value in parameters.values())
    yield "contact modify &"
    yield "   contact_name = CONTACT_1 &"
    yield f"   stiffness = {stiffness} &"
    yield f"   damping = {damping} &"
    yield f"   exponent = {exponent} &"
    yield f"   dmax = {dmax}"
    yield f"! as a function: IMPACT(x, dx/dt, x1, {stiffness}, {exponent}, {damping}, {dmax})"


def notes(collision: Collision) -> Lines:
    n = number(collision["n"])
    yield f"in mm, N, s, kg (MMKS); in other units the stiffness is another number, K/1000^{n} for K in N/m^{n}"
    yield "IMPACT: max(0, stiffness (x1 - x)^exponent - STEP(x, x1 - dmax, damping, x1, 0) dx/dt)"
    yield "the statement CONTACT has the same parameters: STIFFNESS, EXPONENT, DAMPING, DMAX"
    yield "two materials: there is no mixing; the values are those of the pair"
    yield "the force is never negative; no speed switches the restitution off"
    yield "the damping grows until a penetration of dmax: a rebound from less than that is damped less"
    yield "the defaults 1e5 N/mm, 2.2, 10 N s/mm are meant for steel parts of about 1 kg"
    yield "restitution_coefficient is of another normal force, POISSON"
    yield "the integrator chooses its steps: limit them to a small share of the contact time"


CODE = Code(
    title="Adams, IMPACT",
    laws={"adams-impact": "IMPACT"},
    newest="MD R2",
    tested="not run by us; read in the help of Adams/Solver MD R2 (IMPACT, CONTACT), Adams/View (contact modify)",
    comment=("! ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
)
