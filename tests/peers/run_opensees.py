"""Two masses on a line in OpenSees, between them an element of zero length with a material of pounding."""

from __future__ import annotations

from importlib.metadata import version

import openseespy.opensees as ops
from runner import serve


def collide(
    material: str, before_gap: list[float], after_gap: list[float], m1: float, m2: float, R1: float, R2: float,
    v1: float, v2: float, gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for tag, mass in ((1, m1), (2, m2)):
        ops.node(tag, 0.0)
        ops.mass(tag, mass)
    # compression is negative, the gap too
    ops.uniaxialMaterial(material, 1, *before_gap, -gap, *after_gap)
    ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)
    # only now, for the element subtracts the velocities that its nodes have when it is made
    ops.setNodeVel(1, 1, v1, "-commit")
    ops.setNodeVel(2, 1, v2, "-commit")
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-13 * (v1 - v2) * step * count, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    if ops.analyze(count, step):
        raise RuntimeError(f"{material}: no convergence")
    return ops.nodeVel(1, 1), ops.nodeVel(2, 1)


serve(version("openseespy"), collide)
