"""Two mass points in EXUDYN, in contact by ObjectContactSphereSphere."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import exudyn
import exudyn.itemInterface as items
from runner import serve


def collide(
    solver: str, contact: dict[str, Any], m1: float, m2: float, R1: float, R2: float, v1: float, v2: float,
    gap: float, step: float, count: int,
) -> tuple[float, float]:  # fmt: skip
    # the system lives as long as its container
    container = exudyn.SystemContainer()
    mbs = container.AddSystem()
    nodes, markers = [], []
    for mass, x, speed in ((m1, -R1 - gap, v1), (m2, R2, v2)):
        nodes.append(mbs.AddNode(items.NodePoint(referenceCoordinates=[x, 0, 0], initialVelocities=[speed, 0, 0])))
        body = mbs.AddObject(items.MassPoint(mass=mass, nodeNumber=nodes[-1]))
        markers.append(mbs.AddMarker(items.MarkerBodyPosition(bodyNumber=body)))
    data = mbs.AddNode(items.NodeGenericData(initialCoordinates=[gap, 0, 0, 0], numberOfDataCoordinates=4))
    mbs.AddObject(
        items.ObjectContactSphereSphere(markerNumbers=markers, nodeNumber=data, spheresRadii=[R1, R2], **contact)
    )
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.minimumStepSize = 1e-6 * step
    settings.timeIntegration.numberOfSteps = count
    settings.timeIntegration.endTime = count * step
    mbs.SolveDynamic(settings, solverType=getattr(exudyn.DynamicSolverType, solver))
    first, second = (mbs.GetNodeOutput(node, exudyn.OutputVariableType.Velocity)[0] for node in nodes)
    return float(first), float(second)


serve(version("exudyn"), collide)
