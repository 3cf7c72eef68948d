"""Closed forms of the impact of two balls, against which the numerical results are checked."""

from __future__ import annotations

from .adhesive import edinburgh_adhesion as edinburgh_adhesion
from .adhesive import edinburgh_restitution as edinburgh_restitution
from .adhesive import jkr_restitution as jkr_restitution
from .adhesive import jkr_root as jkr_root
from .dashpot import approach_damping as approach_damping
from .dashpot import approach_restitution as approach_restitution
from .dashpot import force_damping as force_damping
from .dashpot import force_restitution as force_restitution
from .dashpot import gap_damping as gap_damping
from .dashpot import gap_restitution as gap_restitution
from .dashpot import limited_restitution as limited_restitution
from .elastic import contact_time_ratio as contact_time_ratio
from .elastic import peak_indentation as peak_indentation
from .hysteresis import approach_damped_restitution as approach_damped_restitution
from .hysteresis import damped_peak_indentation as damped_peak_indentation
from .hysteresis import delivered_restitution as delivered_restitution
from .hysteresis import exact_damping_ratio as exact_damping_ratio
from .plastic import luding_restitution as luding_restitution
from .plastic import muthukumar_restitution as muthukumar_restitution
from .plastic import thornton_restitution as thornton_restitution
from .viscoelastic import pade_damping as pade_damping
from .viscoelastic import pade_restitution as pade_restitution
