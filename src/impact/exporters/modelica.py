"""Modelica Standard Library, component ElastoGap."""

from __future__ import annotations

from ..contact.models.multibody_codes import MODELICA_ELASTOGAP
from ..formatting import number
from .code import Code, Collision, Lines, Parameters


def parameters(collision: Collision) -> dict[str, float | str]:
    """Write the modifiers of the component."""
    return {"c": collision["K"], "d": collision["d"], "n": collision["n"], "s_rel0": 0.0}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    modifiers = ", ".join(f"{name} = {value!r}" for name, value in parameters.items())
    return [f"Modelica.Mechanics.Translational.Components.ElastoGap contact({modifiers});"]


def notes(collision: Collision) -> Lines:
    yield f"in SI; c is the force at a compression of 1 m, here in N/m^{number(collision['n'])}"
    yield "since 4.1.0 the spring force is f_ref*|s_rel/s_ref|^n; its defaults s_ref = 1, f_ref = c*s_ref keep c"
    yield "two materials: there is no mixing; c and d are those of the pair"
    yield "the force is never negative: the damper force is at most as large as the spring force"
    yield "no speed switches the restitution off"
    yield "contact begins at flange_b.s - flange_a.s < s_rel0; both masses are components of their own"
    yield "s_nominal, by default 1e-4 m, scales s_rel: set it near the peak indentation"


CODE = Code(
    title="Modelica Standard Library, ElastoGap",
    laws={"modelica-elastogap": "ElastoGap"},
    newest="4.1.0",
    tested=f"not run by us; read in {MODELICA_ELASTOGAP.evidence.source}",
    comment=("// ", ""),
    parameters=parameters,
    lines=lines,
    notes=notes,
)
