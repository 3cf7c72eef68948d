"""Laws of OpenSees for the pounding of buildings and bridges, under the names of its materials."""

from __future__ import annotations

from .aliases import in_code
from .asymmetric import JANKOWSKI_2006
from .cited_sources import IMPACT_MATERIAL, OPENSEES_HERTZDAMP, OPENSEES_JANKOWSKI
from .finite_element_fits import MUTHUKUMAR_2003
from .hysteresis import FLORES_2011

OPENSEES_HERTZDAMP_MATERIAL = in_code(
    FLORES_2011,
    "opensees-hertzdamp",
    "OpenSees Hertzdamp, as its documentation recommends (since 2020)",
    2019,
    "OpenSees, SRC/material/uniaxial/Hertzdamp.cpp by PJ Hughes, whose input xiNorm is χ; recommended is "
    "8(1 − e)/(5e)",
    "OpenSees/OpenSees, SRC/material/uniaxial/Hertzdamp.cpp @2890cb36f (2026), the force; "
    f"{OPENSEES_HERTZDAMP}, the χ it recommends",
)

OPENSEES_JANKOWSKI_IMPACT = in_code(
    JANKOWSKI_2006,
    "opensees-jankowski-impact",
    "OpenSees JankowskiImpact, as its documentation recommends (since 2020)",
    2019,
    "OpenSees, SRC/material/uniaxial/JankowskiImpact.cpp by PJ Hughes, whose input is ξ",
    "OpenSees/OpenSees, SRC/material/uniaxial/JankowskiImpact.cpp @2890cb36f (2026), the force; "
    f"{OPENSEES_JANKOWSKI}, the ξ it recommends",
)

OPENSEES_IMPACT_MATERIAL = in_code(
    MUTHUKUMAR_2003,
    "opensees-impact-material",
    "OpenSees ImpactMaterial, with K₁, K₂ and δ_y of its documentation (since 2008)",
    2008,
    "OpenSees, SRC/material/uniaxial/ImpactMaterial.cpp by M Dryden, whose inputs are K₁, K₂ and δ_y",
    "OpenSees/OpenSees, SRC/material/uniaxial/ImpactMaterial.cpp @2890cb36f (2026), the force; "
    f"{IMPACT_MATERIAL}, its inputs",
)
