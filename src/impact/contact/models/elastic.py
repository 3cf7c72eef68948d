"""Elastic contact: equation (10), the undamped end of every other law."""

from __future__ import annotations

from ..forms import spring
from ..model import ForceModel

HERTZ = ForceModel(
    key="hertz",
    title="Hertz",
    year=1882,
    equation="F = K δⁿ  (10)",
    reference="Hertz H (1882) Über die Berührung fester elastischer Körper. J. reine angew. Math. 92, 156",
    doi="10.1515/crll.1882.92.156",
    evidence="formula as printed in Gharib and Hurmuzlu (2012); DOI from memory",
    force=spring,
    domain={"e": (1.0, 1.0)},
    oracle=lambda: 1.0,
    family="elastic",
)
