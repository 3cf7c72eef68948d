"""Elastic contact: equation (10), the limit of the other laws without damping."""

from __future__ import annotations

from ..evidence import Evidence
from ..force_expressions import spring
from ..model import ForceModel
from .cited_sources import DEMLAB_VISCOELASTIC, GHARIB_HURMUZLU

HERTZ = ForceModel(
    key="hertz",
    title="Hertz",
    year=1882,
    equation="F = K δⁿ  (10)",
    reference="Hertz H (1882) Über die Berührung fester elastischer Körper. J. reine angew. Math. 92, 156",
    domain_source="by definition",
    doi="10.1515/crll.1882.92.156",
    evidence=Evidence(
        "seen",
        f"{GHARIB_HURMUZLU}, equation (10)",
        doi=DEMLAB_VISCOELASTIC,
    ),
    force=spring,
    domain={"e": (1.0, 1.0)},
    oracle=lambda: 1.0,
    family="elastic",
)
