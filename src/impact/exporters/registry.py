"""The list of the codes that laws are exported to."""

from __future__ import annotations

from ..errors import UsageError, did_you_mean
from ..formatting import argument
from . import (
    adams,
    chrono,
    drake,
    exudyn,
    kratos,
    lammps,
    liggghts,
    mercurydpm,
    modelica,
    mujoco,
    newton,
    opensees,
    physx,
    pybullet,
    simbody,
    simscape,
    yade,
)
from .code import Code

CODES: dict[str, Code] = {
    code.name: code
    for code in (
        lammps.CODE,
        liggghts.CODE,
        yade.CODE,
        mujoco.CODE,
        drake.CODE,
        kratos.CODE,
        opensees.CODE,
        simbody.CODE,
        pybullet.CODE,
        exudyn.CODE,
        newton.CODE,
        # text only
        chrono.CODE,
        mercurydpm.CODE,
        modelica.CODE,
        adams.CODE,
        simscape.CODE,
        physx.CODE,
    )
}


def find_code(name: str) -> Code:
    """Find a code by its name."""
    if name not in CODES:
        raise UsageError(f'{argument("to")}: no code "{name}"; {did_you_mean(name, list(CODES))}')
    return CODES[name]
