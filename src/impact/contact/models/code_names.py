"""Names that simulation codes have for laws of the catalogue."""

from __future__ import annotations

from ..model import ForceModel
from .aliases import same_law
from .asymmetric import JANKOWSKI_2006
from .codes import of_code
from .contact_fits import MUTHUKUMAR_2003
from .dashpot import (
    ANAGNOSTOPOULOS_1988,
    ANAGNOSTOPOULOS_1988_NO_TENSION,
    KELVIN_VOIGT,
    KELVIN_VOIGT_NO_TENSION,
    TSUJI_1992,
    TSUJI_1992_NO_TENSION,
)
from .granular import CHRONO_SMC_HOOKE
from .hysteresis import FLORES_2011, HUNT_CROSSLEY_1975, LANKARANI_NIKRAVESH_1990
from .rate_dependent import LEE_HERRMANN_1993


def in_code(law: ForceModel, key: str, title: str, year: int, code: str) -> ForceModel:
    """A law under the name of a code, whose source was seen."""
    evidence = "formula seen in the source; no DOI"
    return of_code(same_law(law, key, title=title, year=year, reference=code, evidence=evidence), law.stiffness)


LAMMPS = "LAMMPS, pair style granular"
LIGGGHTS = "LIGGGHTS-PUBLIC, normal_model_*.h"
CHRONO = "Project Chrono, ChContactSMC.h"
OPENSEES = "OpenSees, materials of pounding by Hughes PJ"
MBDYN = "MBDyn, module-continuous-contact"

LAMMPS_HERTZ = in_code(
    TSUJI_1992, "lammps-coeff-restitution-hertz", "LAMMPS coeff_restitution, hertz", 2019, LAMMPS
)
LAMMPS_HERTZ_LIMIT = in_code(
    TSUJI_1992_NO_TENSION, "lammps-coeff-restitution-hertz-limit",
    "LAMMPS coeff_restitution, hertz, limit_damping", 2019, LAMMPS,
)  # fmt: skip
LAMMPS_HOOKE = in_code(
    ANAGNOSTOPOULOS_1988, "lammps-coeff-restitution-hooke", "LAMMPS coeff_restitution, hooke", 2019, LAMMPS
)
LAMMPS_HOOKE_LIMIT = in_code(
    ANAGNOSTOPOULOS_1988_NO_TENSION, "lammps-coeff-restitution-hooke-limit",
    "LAMMPS coeff_restitution, hooke, limit_damping", 2019, LAMMPS,
)  # fmt: skip
LAMMPS_VELOCITY = in_code(KELVIN_VOIGT, "lammps-velocity-hooke", "LAMMPS velocity, hooke", 2019, LAMMPS)
LAMMPS_VELOCITY_LIMIT = in_code(
    KELVIN_VOIGT_NO_TENSION, "lammps-velocity-hooke-limit", "LAMMPS velocity, hooke, limit_damping", 2019, LAMMPS
)
LAMMPS_MASS_VELOCITY_LIMIT = in_code(
    LEE_HERRMANN_1993, "lammps-mass-velocity-hertz-limit", "LAMMPS mass_velocity, hertz, limit_damping", 2019,
    LAMMPS,
)  # fmt: skip
LIGGGHTS_HERTZ = in_code(TSUJI_1992, "liggghts-hertz", "LIGGGHTS hertz", 2012, LIGGGHTS)
LIGGGHTS_HERTZ_LIMIT = in_code(
    TSUJI_1992_NO_TENSION, "liggghts-hertz-limit-force", "LIGGGHTS hertz, limitForce", 2012, LIGGGHTS
)
LIGGGHTS_HOOKE_LIMIT = in_code(
    CHRONO_SMC_HOOKE, "liggghts-hooke-limit-force", "LIGGGHTS hooke, limitForce", 2012, LIGGGHTS
)
YADE_EN = in_code(TSUJI_1992, "yade-en", "YADE HertzMindlin en", 2010, "YADE, HertzMindlin.cpp")
YADE_VISCOELASTIC = in_code(
    KELVIN_VOIGT, "yade-viscoelastic", "YADE viscoelastic", 2009, "YADE, Law2_ScGeom_ViscElPhys_Basic"
)
MAPLESIM_LINEAR = of_code(
    same_law(
        KELVIN_VOIGT_NO_TENSION,
        "maplesim-linear",
        title="MapleSim, linear",
        year=2015,
        reference="MapleSim, contact of the linear spring and damper",
        evidence="formula from memory, the documentation was seen; no DOI",
    )
)
MERCURYDPM_LINEAR = in_code(
    ANAGNOSTOPOULOS_1988, "mercurydpm-linear-viscoelastic", "MercuryDPM LinearViscoelastic", 2013,
    "MercuryDPM, kernel",
)  # fmt: skip
CHRONO_HERTZ = in_code(TSUJI_1992_NO_TENSION, "chrono-smc-hertz", "Chrono SMC, Hertz", 2016, CHRONO)
OPENSEES_HERTZDAMP = in_code(LANKARANI_NIKRAVESH_1990, "opensees-hertzdamp", "OpenSees Hertzdamp", 2019, OPENSEES)
OPENSEES_JANKOWSKI = in_code(
    JANKOWSKI_2006, "opensees-jankowski-impact", "OpenSees JankowskiImpact", 2019, OPENSEES
)
OPENSEES_IMPACT = in_code(MUTHUKUMAR_2003, "opensees-impact-material", "OpenSees ImpactMaterial", 2019, OPENSEES)
MBDYN_FLORES = in_code(FLORES_2011, "mbdyn-flores", "MBDyn flores", 2015, MBDYN)
MBDYN_HUNT_CROSSLEY = in_code(HUNT_CROSSLEY_1975, "mbdyn-hunt-crossley", "MBDyn hunt crossley", 2015, MBDYN)
MBDYN_LANKARANI_NIKRAVESH = in_code(
    LANKARANI_NIKRAVESH_1990, "mbdyn-lankarani-nikravesh", "MBDyn lankarani nikravesh", 2015, MBDYN
)
