"""The table of variables: the outputs of a collision, its time history, and all that is known about each.

Files, docs, configs, comparison and pictures follow from an entry. `impact.results.schema.SCHEMA` adds the
variables of calibrations and sensitivity studies; `impact.contact.outputs.FORMULAS` computes the outputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from .status import Status

# stands for the swept axes among the dimensions of a variable
AXES = "axes"
Scale = Literal[
    "v0",
    "1",
    "the peak",
    "itself",
    "m v0^2/2",
    "bounded by 10 rtol",
    "exact",
    "reported",
    # of a calibration: the value and its interval, the standard deviations of two parameters, the value or 1 if
    # that is larger, the largest measured value of the output
    "itself + interval",
    "deviations",
    "max(1, itself)",
    "measured",
]


@dataclass(frozen=True)
class Variable:
    """A variable of a result.

    Parameters
    ----------
    name : in files, configs and tables
    dims : its dimensions, with `AXES` in place of the swept axes
    unit : SI unit in the spelling of configs; "SI" if it depends on the parameter or the output, and "output" for
        the unit of the output that a study is about
    scale : how `compare` judges a difference: relative to this scale at the baseline's point, by a bound of its
        own value, exactly, or not at all
    meaning, equation : texts for readers
    dtype : of the stored values; "f8" may be stored in single precision
    symbol : its mathtext; "" if the name is a symbol, or there is none
    measured : the interval of measured values; "" if it cannot be measured
    may_be_nan : NaN is a value at status OK, since the law lacks the quantity or the sweep has no e
    flags : the meanings of its integers by their values
    on_request : stored only if `[output] variables` lists it
    is_new : version 1.0 did not store it
    """

    name: str
    dims: tuple[str, ...]
    unit: str
    scale: Scale
    meaning: str
    equation: str = ""
    dtype: str = "f8"
    symbol: str = ""
    measured: Literal["", "any", "positive", "fraction"] = ""
    may_be_nan: bool = False
    flags: Mapping[str, int] = field(default_factory=dict)
    on_request: bool = False
    is_new: bool = False

    @property
    def per_model(self) -> bool:
        """Whether it depends on the model, or on the axes only."""
        return "model" in self.dims

    @property
    def has_tolerance(self) -> bool:
        """Whether its values may differ within a tolerance and are judged."""
        return self.scale not in ("exact", "reported")

    @property
    def judged(self) -> str:
        """How `compare` judges it, in words."""
        words = ("bounded by 10 rtol", "exact", "reported")
        return self.scale if self.scale in words else f"scaled by {self.scale}"


def by_name(*variables: Variable) -> dict[str, Variable]:
    """Index variables by their names, in their order."""
    return {variable.name: variable for variable in variables}


_POINTS, _TIMES = ("model", AXES), ("t",)

# outputs of a collision, in the order of a file
OUTPUTS = by_name(
    Variable("v1_post", _POINTS, "m/s", "v0", "velocity of ball 1 after the impact",
             "v1+ = v1 - (1 + e_out)(m/m1) v0", symbol="v_1^+", measured="any"),
    Variable("v2_post", _POINTS, "m/s", "v0", "velocity of ball 2 after the impact",
             "v2+ = v2 + (1 + e_out)(m/m2) v0", symbol="v_2^+", measured="any"),
    Variable("v1_reference", (AXES,), "m/s", "v0", "velocity of ball 1 by impulse and momentum",
             "v1+ = v1 - (1 + e)(m/m1) v0  (6)", symbol="v_1^+"),
    Variable("v2_reference", (AXES,), "m/s", "v0", "velocity of ball 2 by impulse and momentum",
             "v2+ = v2 + (1 + e)(m/m2) v0  (7)", symbol="v_2^+"),
    Variable("v1_error", _POINTS, "m/s", "v0", "error of the velocity of ball 1",
             "v1_post - v1_reference", may_be_nan=True),
    Variable("v2_error", _POINTS, "m/s", "v0", "error of the velocity of ball 2",
             "v2_post - v2_reference", may_be_nan=True),
    Variable("e_out", _POINTS, "1", "1", "restitution that the model delivers",
             "(v2+ - v1+)/(v1 - v2)  (5)", symbol=r"e_\mathrm{out}", measured="fraction"),
    Variable("e_error", _POINTS, "1", "1", "delivered minus requested restitution",
             "e_out - e", symbol=r"e_\mathrm{out}-e", may_be_nan=True),
    Variable("peak_indentation", _POINTS, "m", "the peak", "largest indentation",
             "δₘ at v = 0", symbol=r"\delta_m", measured="positive"),
    Variable("permanent_indentation", _POINTS, "m", "the peak", "indentation at the release",
             "δₚ at the end of the contact", symbol=r"\delta_p", measured="any"),
    Variable("peak_force", _POINTS, "N", "itself", "largest contact force",
             "max F over the approach", symbol="f_m", measured="positive"),
    Variable("contact_time", _POINTS, "s", "itself", "contact time",
             "from first contact to release", measured="positive"),
    Variable("energy_loss", _POINTS, "J", "m v0^2/2", "kinetic energy lost",
             "m v0²(1 - e_out²)/2", measured="any"),
    Variable("stiffness", _POINTS, "N/m^n", "itself",
             "contact stiffness used; n is the coordinate exponent; without K and with n other than 1.5 it is "
             "F_m/delta_m^n at the Hertz peak",
             "K  (12)", symbol="K"),
    Variable("damping_ratio", _POINTS, "1", "itself", "dimensionless damping, where the law has one",
             "χ = λ v0/K", symbol=r"\chi", may_be_nan=True),
    Variable("energy_residual", _POINTS, "1", "bounded by 10 rtol", "residual of the work balance",
             "[work of the force - m v0²(1 - e_out²)/2]/(m v0²/2)"),
    Variable("closed_form_error", _POINTS, "1", "bounded by 10 rtol",
             "distance from the closed form, where one exists",
             "e_out - exact e_out", may_be_nan=True),
    Variable("status", _POINTS, "1", "exact", "outcome of the point",
             "see flag_meanings", "i1", flags={status.name.lower(): int(status) for status in Status}),
    Variable("in_domain", _POINTS, "1", "exact", "1 if the inputs are in the stated domain of the law",
             "1 inside every stated interval", "i1",
             flags={"outside_claimed_domain": 0, "within_claimed_domain": 1}),
    Variable("steps", _POINTS, "1", "reported", "accepted steps of the integrator",
             "approach + restitution", "i4"),
    Variable("e_kinetic", _POINTS, "1", "1",
             "kinetic restitution; the impulses are the changes of the momentum, so that it is e_out",
             "τ_r/τ_c  (2)", symbol=r"e_\mathrm{kinetic}", measured="fraction", on_request=True),
    Variable("e_energetic", _POINTS, "1", "1",
             "energetic restitution, from the integrated works of the two phases",
             "√(-W_r/W_c)  (3)", symbol=r"e_\mathrm{energetic}", measured="fraction", on_request=True),
    Variable("lambda", _POINTS, "N s/m^(n+1)", "itself",
             "damping factor, where the law has one; n is the coordinate exponent",
             "λ = χ K/v0  (18)", may_be_nan=True, on_request=True),
    Variable("separation_time", _POINTS, "s", "itself", "time until the surfaces separate",
             "contact_time + remaining indentation/(e_out v0)", measured="positive", on_request=True),
)  # fmt: skip
BY_DEFAULT = tuple(name for name, variable in OUTPUTS.items() if not variable.on_request)

# a time history, over the time since first contact
HISTORY = by_name(
    Variable("delta", _TIMES, "m", "reported", "indentation"),
    Variable("v", _TIMES, "m/s", "reported", "rate of the indentation", symbol=r"\dot{\delta}"),
    Variable("F", _TIMES, "N", "reported", "contact force"),
    Variable("x1", _TIMES, "m", "reported", "displacement of ball 1 since first contact"),
    Variable("x2", _TIMES, "m", "reported", "displacement of ball 2 since first contact"),
    Variable("v1", _TIMES, "m/s", "reported", "velocity of ball 1"),
    Variable("v2", _TIMES, "m/s", "reported", "velocity of ball 2"),
)
