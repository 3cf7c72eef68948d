"""The table of variables: the outputs of a collision, its time history, and all that is known about each.

Files, docs, configs, comparison and pictures follow from an entry. `impact.results.schema.SCHEMA` adds the
variables of calibrations and sensitivity studies; `impact.contact.output_formulas.FORMULAS` computes the outputs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from .status import FrictionStatus, Status

# stands for the swept axes among the dimensions of a variable
AXES = "axes"
# dimensions of laws, which not every variable has
LAW_DIMS = ("model", "friction")
Scale = Literal[
    "v0",
    "1",
    "the peak",
    "itself",
    "m v0^2/2",
    # of oblique impacts: v0 + |g0|, (v0 + |g0|)/R, m (v0^2 + g0^2)/2
    "the slip",
    "the spin",
    "m (v0^2 + g0^2)/2",
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
    dims : its dimensions, with `AXES` in place of the swept axes
    unit : SI unit in the spelling of configs; "SI" if it depends on the parameter or the output, and "output" for
        the unit of the output that a study is about
    scale : how `compare` judges a difference: relative to this scale at the baseline's point, by a bound of its
        own value, exactly, or not at all
    dtype : of the stored values; "f8" may be stored in single precision
    symbol : its mathtext; "" if the name is a symbol, or there is none
    measured : the interval of measured values; "" if it cannot be measured
    may_be_nan : NaN is a value at status OK, since the law lacks the quantity or the sweep has no e
    flags : the meanings of its integers by their values
    on_request : stored only if `[output] variables` lists it
    is_new : version 1.0 did not store it
    """

    name: str
    meaning: str
    dims: tuple[str, ...] = ("model", AXES)
    unit: str = "1"
    scale: Scale = "reported"
    equation: str = ""
    dtype: str = "f8"
    symbol: str = ""
    measured: Literal["", "any", "positive", "fraction"] = ""
    may_be_nan: bool = False
    flags: Mapping[str, int] = field(default_factory=dict)
    on_request: bool = False
    is_new: bool = False

    @property
    def short_meaning(self) -> str:
        """Its meaning up to a semicolon, after which are remarks on its values."""
        return self.meaning.partition(";")[0]

    @property
    def per_model(self) -> bool:
        """Whether it depends on the model, or on the axes only."""
        return "model" in self.dims

    @property
    def of_friction(self) -> bool:
        """Whether it depends on the friction law; a result without frictions lacks it."""
        return "friction" in self.dims

    @property
    def status(self) -> str:
        """The variable that explains where it is NaN."""
        return "friction_status" if self.of_friction else "status"

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


_POINTS, _PAIRS, _TIMES = ("model", AXES), ("model", "friction", AXES), ("t",)

# outputs of a collision, in the order of a file
OUTPUTS = by_name(
    Variable("v1_post", "velocity of ball 1 after the impact", _POINTS, "m/s", "v0",
             "v1+ = v1 - (1 + e_out)(m/m1) v0", symbol="v_1^+", measured="any"),
    Variable("v2_post", "velocity of ball 2 after the impact", _POINTS, "m/s", "v0",
             "v2+ = v2 + (1 + e_out)(m/m2) v0", symbol="v_2^+", measured="any"),
    Variable("v1_reference", "velocity of ball 1 by impulse and momentum", (AXES,), "m/s", "v0",
             "v1+ = v1 - (1 + e)(m/m1) v0  (6)", symbol="v_1^+"),
    Variable("v2_reference", "velocity of ball 2 by impulse and momentum", (AXES,), "m/s", "v0",
             "v2+ = v2 + (1 + e)(m/m2) v0  (7)", symbol="v_2^+"),
    Variable("v1_error", "error of the velocity of ball 1", _POINTS, "m/s", "v0",
             "v1_post - v1_reference", may_be_nan=True),
    Variable("v2_error", "error of the velocity of ball 2", _POINTS, "m/s", "v0",
             "v2_post - v2_reference", may_be_nan=True),
    Variable("e_out", "restitution that the model delivers", _POINTS, "1", "1",
             "(v2+ - v1+)/(v1 - v2)  (5)", symbol=r"e_\mathrm{out}", measured="fraction"),
    Variable("e_error", "delivered minus requested restitution", _POINTS, "1", "1",
             "e_out - e", symbol=r"e_\mathrm{out}-e", may_be_nan=True),
    Variable("peak_indentation", "largest indentation", _POINTS, "m", "the peak",
             "δₘ at v = 0", symbol=r"\delta_m", measured="positive"),
    Variable("permanent_indentation", "indentation at the release", _POINTS, "m", "the peak",
             "δₚ at the end of the contact", symbol=r"\delta_p", measured="any"),
    Variable("peak_force", "largest contact force", _POINTS, "N", "itself",
             "max F over the approach", symbol="f_m", measured="positive"),
    Variable("contact_time", "contact time", _POINTS, "s", "itself",
             "from first contact to release", measured="positive"),
    Variable("energy_loss", "kinetic energy lost", _POINTS, "J", "m v0^2/2",
             "m v0²(1 - e_out²)/2", measured="any"),
    Variable("stiffness",
             "contact stiffness used; n is the coordinate exponent; without K and with n other than 1.5 it is "
             "F_m/delta_m^n at the Hertz peak",
             _POINTS, "N/m^n", "itself", "K  (12)", symbol="K"),
    Variable("damping_ratio", "dimensionless damping, where the law has one", _POINTS, "1", "itself",
             "χ = λ v0/K", symbol=r"\chi", may_be_nan=True),
    Variable("energy_residual", "residual of the work balance", _POINTS, "1", "bounded by 10 rtol",
             "[work of the force - m v0²(1 - e_out²)/2]/(m v0²/2)"),
    Variable("closed_form_error", "distance from the closed form, where one exists", _POINTS, "1",
             "bounded by 10 rtol", "e_out - exact e_out", may_be_nan=True),
    Variable("status", "outcome of the point", _POINTS, "1", "exact",
             "see flag_meanings", dtype="i1", flags={status.name.lower(): int(status) for status in Status}),
    Variable("in_domain", "1 if the inputs are in the stated domain of the law", _POINTS, "1", "exact",
             "1 inside every stated interval", dtype="i1",
             flags={"outside_claimed_domain": 0, "within_claimed_domain": 1}),
    Variable("steps", "accepted steps of the integrator", _POINTS, "1", "reported",
             "approach + restitution", dtype="i4"),
    Variable("e_kinetic", "kinetic restitution; the impulses are the changes of the momentum, so that it is e_out",
             _POINTS, "1", "1", "τ_r/τ_c  (2)",
             symbol=r"e_\mathrm{kinetic}", measured="fraction", on_request=True),
    Variable("e_energetic",
             "energetic restitution, from the integrated works of the two phases; a root, so that its error is "
             "about sqrt(rtol) at small e",
             _POINTS, "1", "1", "√(-W_r/W_c)  (3)",
             symbol=r"e_\mathrm{energetic}", measured="fraction", on_request=True),
    Variable("lambda", "damping factor, where the law has one; n is the coordinate exponent",
             _POINTS, "N s/m^(n+1)", "itself", "λ = χ K/v0  (18)", may_be_nan=True, on_request=True),
    Variable("separation_time", "time until the surfaces separate", _POINTS, "s", "itself",
             "contact_time + remaining indentation/(e_out v0)", measured="positive", on_request=True),
    Variable("u1_post", "tangential velocity of ball 1 after the impact", _PAIRS, "m/s", "the slip",
             "u1+ = u1 - P/m1", symbol="u_1^+", measured="any"),
    Variable("u2_post", "tangential velocity of ball 2 after the impact", _PAIRS, "m/s", "the slip",
             "u2+ = u2 + P/m2", symbol="u_2^+", measured="any"),
    Variable("omega1_post", "spin of ball 1 after the impact", _PAIRS, "rad/s", "the spin",
             "omega1+ = omega1 - R1 P/I1", symbol=r"\omega_1^+", measured="any", may_be_nan=True),
    Variable("omega2_post", "spin of ball 2 after the impact", _PAIRS, "rad/s", "the spin",
             "omega2+ = omega2 - R2 P/I2", symbol=r"\omega_2^+", measured="any", may_be_nan=True),
    Variable("slip_post", "slip speed of the contact points after the impact", _PAIRS, "m/s", "the slip",
             "g1 = g0 - P/m_t", symbol="g_1", measured="any"),
    Variable("beta", "tangential restitution of the contact points; -1 without friction, 0 sticks, 1 reverses",
             _PAIRS, "1", "1", "-g1/g0", symbol=r"\beta", measured="any", may_be_nan=True),
    Variable("e_t", "tangential restitution of the centres", _PAIRS, "1", "1",
             "(u1+ - u2+)/(u1 - u2)", symbol="e_t", measured="any", may_be_nan=True),
    Variable("rebound_angle", "angle of the rebound from the normal", _PAIRS, "rad", "1",
             "atan2(u1+ - u2+, e_out v0)", symbol=r"\theta^+", measured="any"),
    Variable("impulse_ratio", "tangential over normal impulse", _PAIRS, "1", "1",
             "P/((1 + e_out) m v0)", symbol="P/P_n", measured="any"),
    Variable("friction_loss", "energy lost to the tangential motion; negative where a law makes energy", _PAIRS,
             "J", "m (v0^2 + g0^2)/2", "m_t (g0² - g1²)/2", measured="any"),
    Variable("contact_regime", "whether the contact sticks, slides or does both", _PAIRS, "1", "exact",
             "see flag_meanings", dtype="i1",
             flags={"not_defined": 0, "sticks_throughout": 1, "slides_throughout": 2, "sticks_and_slides": 3}),
    Variable("friction_residual", "residual of the tangential work balance", _PAIRS, "1", "bounded by 10 rtol",
             "(friction_loss - works)/(m_t g0²/2)", may_be_nan=True),
    Variable("beta_error", "distance of beta from the closed form, where one exists", _PAIRS, "1",
             "bounded by 10 rtol", "beta - exact beta", may_be_nan=True),
    Variable("friction_status", "outcome of the tangential motion", _PAIRS, "1", "exact", "see flag_meanings",
             dtype="i1", flags={status.name.lower(): int(status) for status in FrictionStatus}),
    Variable("slip_work", "work of friction while sliding", _PAIRS, "J", "m (v0^2 + g0^2)/2",
             may_be_nan=True, on_request=True),
    Variable("tangential_damping_work", "work of the tangential dashpot", _PAIRS, "J", "m (v0^2 + g0^2)/2",
             may_be_nan=True, on_request=True),
    Variable("memory_work", "energy that the spring loses as the contact changes; negative where it gains", _PAIRS,
             "J", "m (v0^2 + g0^2)/2", "∫ (1/2 - r) f_e² k'/k² dt", may_be_nan=True, on_request=True),
    Variable("elastic_left", "energy in the tangential spring at the release, which is lost", _PAIRS, "J",
             "m (v0^2 + g0^2)/2", "f_e²/(2 k)", may_be_nan=True, on_request=True),
    Variable("psi1", "slip before the impact in units of Maw, Barber and Fawcett", _PAIRS, "1", "1",
             "(kappa/mu) g0/v0", symbol=r"\psi_1", may_be_nan=True, on_request=True),
    Variable("psi2", "slip after the impact in units of Maw, Barber and Fawcett", _PAIRS, "1", "1",
             "(kappa/mu) g1/v0", symbol=r"\psi_2", may_be_nan=True, on_request=True),
    Variable("slip_changes", "changes between sticking and sliding", _PAIRS, "1", "exact",
             dtype="i4", on_request=True),
)  # fmt: skip


CENTRAL_OUTPUTS = tuple(name for name, variable in OUTPUTS.items() if not variable.of_friction)


def default_variables(of_friction: bool) -> tuple[str, ...]:
    """List the variables that a result has by default, with or without those of friction."""
    return tuple(name for name in (OUTPUTS if of_friction else CENTRAL_OUTPUTS) if not OUTPUTS[name].on_request)


# a time history, over the time since first contact
HISTORY = by_name(
    Variable("delta", "indentation", _TIMES, "m"),
    Variable("v", "rate of the indentation", _TIMES, "m/s", symbol=r"\dot{\delta}"),
    Variable("F", "contact force", _TIMES, "N"),
    Variable("x1", "displacement of ball 1 since first contact", _TIMES, "m"),
    Variable("x2", "displacement of ball 2 since first contact", _TIMES, "m"),
    Variable("v1", "velocity of ball 1", _TIMES, "m/s"),
    Variable("v2", "velocity of ball 2", _TIMES, "m/s"),
    Variable("slip", "slip speed of the contact points", _TIMES, "m/s", symbol="g"),
    Variable("f", "friction force on ball 2", _TIMES, "N"),
    Variable(
        "mode",
        "0 sticks; 1 or -1 slides, in the direction of friction on ball 2; 2 or -2: the spring "
        "follows its limit without sliding",
        _TIMES,
        dtype="i1",
    ),
)
