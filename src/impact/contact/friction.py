"""A friction law as data, and its pair with a contact force model.

A friction law is combined with any contact force model that has what it needs. The tangential problem of the
pair, in the contact's own units, has the slip G = (m_t/m) g/(mu v0) and a stiffness k' = (k/k_unit)(m/m_t) per
power of x; a damping likewise.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..array_types import Array, Int8Array, Mask
from ..errors import ModelError
from ..formatting import law_name, number
from . import fixed_step
from .closed_forms.dashpot import gap_damping
from .dimensionless import LawValues, dimensionless_values, with_coefficients, with_units
from .evidence import Evidence
from .force_expressions import spring
from .formula_calls import Formula, argument_names, call_by_name
from .impacts import Impacts
from .materials import effective_shear_modulus
from .model import COORDINATE_COEFFICIENTS, NOT_VERIFIED, ForceModel, Parameter
from .powers import distinct_values, replace_where
from .rigid import ObliqueImpacts
from .slip_motion import FrictionKind, TangentialForm
from .status import FrictionStatus

# how the stiffness of the tangential spring is chosen, where the user sets no kt_over_kn: a constant k_t;
# Mindlin's 8 G* a, or k_t sqrt(x); as LIGGGHTS does, 8 G* a for n = 3/2 and K for n = 1; as Kratos does, 4 G*/E*
# times that of the contact; k_t times the radius of the contact in metres
StiffnessRule = Literal["", "constant", "mindlin", "liggghts", "kratos", "classic"]
# how the damping is chosen: xt times that of the contact force; as LIGGGHTS does; as YADE does, by betas; as
# Kratos does, by the damping ratio of the contact force; c_t; as MuJoCo does, b_t and the impedance
DampingRule = Literal["", "xt", "liggghts", "betas", "kratos", "c_t", "cone"]
HERTZ = 1.5
# the exponents n of contact forces with which kt_over_kn, or 8 G* a, gives a tangential stiffness
EXPONENTS = {"constant": (1.0,), "mindlin": (HERTZ,), "liggghts": (1.0, HERTZ)}
# the parameters that set the stiffness of the tangential spring
STIFFNESS_PARAMETERS = ("k_t", "kt_over_kn")


@dataclass(frozen=True, repr=False)
class FrictionLaw:
    """A friction law, which is combined with any contact force model; mu is an input, as e is.

    Parameters
    ----------
    key : kebab-case name, unique in the catalogue
    title : the authors, or the name of the law in its code
    year : with which the law is named
    reference : sources of the law, separated by semicolons
    doi : of the first source
    equation : the law in one line of Unicode
    kind : "coulomb", f = mu N; "spring", a spring and a dashpot limited by mu N; "dashpot", limited by mu N;
        "regularized", f = mu(g) N; or "cone", a dashpot limited by mu N, where N grows with what exceeds the limit
    evidence : where the law and the DOI were read or derived, or that they were not verified
    parameters : parameters that the user sets in `[friction.KEY]`
    same_as : key of the law that this one is another name for, or ""
    stiffness, damping : how the stiffness of the spring, and the damping, are chosen; "" for none
    memory, cap, coefficient : see `impact.contact.slip_motion.TangentialForm`
    scheme : the only scheme that it is of, see `impact.contact.fixed_step.SCHEMES`; "" for a continuous law

    Raises
    ------
    ModelError : the key is not kebab-case
    """

    key: str
    title: str
    year: int
    equation: str
    reference: str
    kind: FrictionKind
    doi: str = ""
    evidence: Evidence = NOT_VERIFIED
    parameters: tuple[Parameter, ...] = ()
    same_as: str = ""
    stiffness: StiffnessRule = ""
    damping: DampingRule = ""
    memory: tuple[float, float] = (0.0, 0.0)
    cap: Literal["total", "spring", "both"] = "total"
    coefficient: Formula | None = None
    scheme: str = ""

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", self.key):
            raise ModelError(f'friction key "{self.key}": expected kebab-case, such as "coulomb-1785"')

    def __repr__(self) -> str:
        return f"<FrictionLaw {self.key}: {self.equation}>"

    @property
    def may_use_e(self) -> bool:
        """Whether its damping may depend on the restitution e."""
        return self.damping in ("liggghts", "betas")

    @property
    def default_limit(self) -> str:
        """The word that `limit` has where the user sets none; "" for a law without one."""
        limits = (parameter for parameter in self.parameters if parameter.name == "limit")
        return next((limit.choices[int(limit.default or 0.0)] for limit in limits), "")


@dataclass(frozen=True)
class Pair:
    """A contact force model with a friction law."""

    model: ForceModel
    friction: FrictionLaw

    @property
    def key(self) -> str:
        """Its name in messages, such as "hertz with coulomb-1785"."""
        return law_name(self.model.key, self.friction.key)

    def form(self, n: float) -> TangentialForm:
        """Find the form of its tangential problems at an exponent n."""
        law, damping_power = self.friction, 0.0
        powers = {"mindlin": 0.5, "classic": 0.5, "liggghts": n - 1.0, "kratos": n - 1.0}
        stiffness_power = powers.get(law.stiffness, 0.0)
        if law.damping == "betas" or (law.damping == "liggghts" and n == HERTZ):
            damping_power = 0.5 * stiffness_power
        elif law.damping in ("xt", "liggghts", "kratos"):
            damping_power = dashpot_power(self.model, n) or 0.0
        return TangentialForm(law.kind, stiffness_power, damping_power, law.memory, law.cap, law.coefficient)


def dashpot_power(model: ForceModel, n: float) -> float | None:
    """Find q of a law that declares the form K x^n + C x^q v for the whole contact; None for others.

    C is the first of the coefficients of its velocity coordinate: the hysteresis laws K x^n (1 + chi v/v0) have
    q = n and C = chi K/v0. An elastic law has none, and no damping.

    >>> from impact.contact.models import find
    >>> dashpot_power(find("tsuji-1992"), 1.5), dashpot_power(find("bilinear"), 1.0)
    (0.25, None)
    """
    if model.unloading is not None:
        return None
    if model.velocity_coordinate == "force":
        return float(call_by_name(model.coefficients["q"], {"n": n}))
    if model.velocity_coordinate == "log":
        return n
    return 0.0 if model.force is spring else None


def friction_values(pair: Pair, oblique: ObliqueImpacts) -> dict[str, Array]:
    """Compute the values of the tangential problems of a pair, by the names of `impact.contact.tangential`.

    Returns
    -------
    dict : arrays that broadcast to the shape of the impacts, of length one along axes on which they do not depend.
        The kind "coulomb" has no `SLIP`: one trajectory of it is that of every slip
    """
    law, impacts, mu = pair.friction, oblique.impacts, oblique.mu
    values = {} if law.kind == "cone" else {fixed_step.LIMIT_POSITIVE: _value(law, oblique, "limit")}
    if law.kind == "coulomb":
        return values
    values |= _spring_values(pair, oblique)
    with np.errstate(all="ignore"):
        values[fixed_step.SLIP] = np.abs(oblique.G0)
        if law.kind == "cone":
            values[fixed_step.COUPLING] = np.square(mu) * _cone_compliance(law, oblique)
        if law.stiffness == "classic":
            values[fixed_step.RADIUS] = np.sqrt(impacts.R_eff * impacts.length)
        if law.kind == "regularized":
            dynamic = _parameter(law, oblique, "mu_d")
            speed = _value(law, oblique, next(p.name for p in law.parameters if p.unit == "m/s"))
            values[fixed_step.SLIP_SCALE] = mu / oblique.mass_ratio * (impacts.v0 / speed)
            values[f"{fixed_step.PREFIX}ratio"] = _ones(impacts) if dynamic is None else dynamic / mu
            if "viscous" in argument_names(law.coefficient):
                values[f"{fixed_step.PREFIX}viscous"] = _value(law, oblique, "mu_v") * speed / mu
    return values


def check_friction(pair: Pair, oblique: ObliqueImpacts) -> Int8Array:
    """Check what a pair and the inputs of friction need; the normal motion is checked by `check_inputs`.

    Returns the status before integration, of a shape that broadcasts to that of the impacts: NOT_COMBINABLE for
    the reasons of `friction_problems`, INVALID_PARAMETER for a dynamic friction above the static one, a viscous
    one without it, and an e outside [0, 1] from which a damping is computed, OUT_OF_RANGE where a stiffness or a
    damping is NaN; an infinite one may be that of a limit of the normal motion, and is judged after that. It is
    OUT_OF_RANGE, too, where the slip is not finite, as that of a plane with a spin.
    """
    status = np.full((1,) * max(1, len(oblique.impacts.shape)), FrictionStatus.OK, np.int8)
    status = replace_where(status, ~np.isfinite(oblique.slip), np.int8(FrictionStatus.OUT_OF_RANGE))
    for value in _spring_values(pair, oblique).values():
        status = replace_where(status, ~(value >= 0.0), np.int8(FrictionStatus.OUT_OF_RANGE))
    law, impacts, mu = pair.friction, oblique.impacts, oblique.mu
    invalid = [_value(law, oblique, "mu_d") > mu, (mu == 0.0) & (_value(law, oblique, "mu_v") > 0.0)]
    names = [name for name, values in oblique.parameters.items() if not np.isnan(values).all()]
    if "e" in required_inputs(law, names, distinct_values(impacts.n).tolist()):
        is_off = law.damping == "liggghts" and _value(law, oblique, "tangential_damping") == 0.0
        invalid.append(~((impacts.e >= 0.0) & (impacts.e <= 1.0)) & ~np.asarray(is_off))
    for mask in invalid:
        status = replace_where(status, mask, np.int8(FrictionStatus.INVALID_PARAMETER))
    for mask, _ in _problems(pair, oblique):
        status = replace_where(status, mask, np.int8(FrictionStatus.NOT_COMBINABLE))
    return status


def friction_problems(pair: Pair, oblique: ObliqueImpacts) -> list[str]:
    """List why impacts of a pair have the status NOT_COMBINABLE, a line each, without the name of the pair."""
    return [reason for mask, reason in _problems(pair, oblique) if np.any(mask)]


def parameter_problem(
    law: FrictionLaw, given: Collection[str], *, n: float | None = None, has_stiffness: bool = False
) -> str:
    """Name what is wrong with the choice of the tangential stiffness, or return "".

    Parameters
    ----------
    given : the names of the parameters that the user sets
    n : the exponent of the contact force, if it is known
    has_stiffness : whether K is set, and not computed from the materials
    """
    chosen = [name for name in STIFFNESS_PARAMETERS if name in given]
    names = [name for name in STIFFNESS_PARAMETERS if any(p.name == name for p in law.parameters)]
    if len(chosen) == 2:
        return "k_t: set together with kt_over_kn, expected one of the two"
    if chosen or not names:
        # a law without a choice takes a part of the stiffness of the contact, or none
        return ""
    if law.stiffness in ("constant", "classic"):
        expected = "[N/m], such as 1e6; or kt_over_kn" if len(names) > 1 else "[N/m^2], such as 1e6"
        return f"k_t: missing, expected a stiffness {expected}"
    # other pairs have no 8 G* a, which the sweep notes
    takes_materials = n == HERTZ if law.stiffness == "mindlin" else n != 1.0
    if has_stiffness and takes_materials:
        return f"{names[0]}: missing, expected {' or '.join(names)}: K is set, so that 8 G* a may not belong to it"
    return ""


def required_inputs(law: FrictionLaw, given: Collection[str], exponents: Collection[float]) -> frozenset[str]:
    """Find which of the inputs e, E1, nu1, E2 and nu2 a law needs, besides those of the contact force.

    `given` are the names of the parameters that the user sets, `exponents` those of the contact forces.
    """
    is_hertz = law.stiffness == "mindlin" or (law.stiffness == "liggghts" and HERTZ in exponents)
    is_of_materials = is_hertz or law.stiffness == "kratos"
    has_stiffness = any(name in given for name in STIFFNESS_PARAMETERS)
    of_materials = ("E1", "nu1", "E2", "nu2") if is_of_materials and not has_stiffness else ()
    is_of_e = "betas" not in given if law.damping == "betas" else law.damping == "liggghts" and is_hertz
    return frozenset((*of_materials, *(("e",) if is_of_e else ())))


# ---- the values


def _ones(impacts: Impacts) -> Array:
    """1, of length one along all axes of the impacts."""
    return np.ones((1,) * max(1, len(impacts.shape)))


def _parameter(law: FrictionLaw, oblique: ObliqueImpacts, name: str) -> Array | None:
    """Find the values of a parameter, or its default; None where the law lacks it, or the user does not set it."""
    values = oblique.parameters.get(name)
    if values is not None and not np.isnan(values).all():
        return np.asarray(values)
    default = next((parameter.default for parameter in law.parameters if parameter.name == name), None)
    return None if default is None else _ones(oblique.impacts) * default


def _value(law: FrictionLaw, oblique: ObliqueImpacts, name: str) -> Array:
    """Return the values of a parameter, NaN where there are none."""
    values = _parameter(law, oblique, name)
    return _ones(oblique.impacts) * np.nan if values is None else values


def _spring_values(pair: Pair, oblique: ObliqueImpacts) -> dict[str, Array]:
    """Compute the stiffness and the damping that a law has, over the mass ratio, in the contact's own units."""
    law, values = pair.friction, {}
    with np.errstate(all="ignore"):
        if law.stiffness and law.kind == "spring":
            values[fixed_step.TANGENTIAL_STIFFNESS] = _stiffness(pair, oblique) / oblique.mass_ratio
        if law.damping:
            values[fixed_step.TANGENTIAL_DAMPING] = _damping(pair, oblique) / oblique.mass_ratio
    return values


def _stiffness(pair: Pair, oblique: ObliqueImpacts) -> Array:
    """Compute k of the spring force k x^kp per displacement, in the contact's own units."""
    law, impacts, n = pair.friction, oblique.impacts, oblique.impacts.n
    ratio = _parameter(law, oblique, "kt_over_kn")
    if ratio is not None:
        # k_n is n K x^(n-1)
        return ratio * n
    if law.stiffness == "constant":
        return _in_own_units(_value(law, oblique, "k_t"), "N/m", 1.0, impacts)
    if law.stiffness == "classic":
        return impacts.in_own_units(_value(law, oblique, "k_t") * np.sqrt(impacts.R_eff), "N/m^1.5")
    if _parameter(law, oblique, "k_t") is not None:
        return _in_own_units(_value(law, oblique, "k_t"), "N/m^1.5", HERTZ, impacts)
    G_eff = effective_shear_modulus(impacts.E1, impacts.nu1, impacts.E2, impacts.nu2)
    if law.stiffness == "kratos":
        return 4.0 * G_eff / impacts.E_eff * n
    # K is 4/3 E* sqrt(R*), unless the contact force has a rule of its own
    own_rule = pair.model.stiffness is not None
    mindlin = 8.0 * G_eff * np.sqrt(impacts.R_eff) / impacts.K if own_rule else 6.0 * G_eff / impacts.E_eff
    if law.stiffness == "mindlin" or (n == HERTZ).all():
        return mindlin
    linear = np.where(_value(law, oblique, "tangential_reduce") > 0.0, 2.0 / 7.0, 1.0)
    return linear if (n == 1.0).all() else np.where(n == HERTZ, mindlin, linear)


def _in_own_units(k_t: Array, unit: str, n: float, impacts: Impacts) -> Array:
    """Convert k_t, of the unit of K for an exponent n; in units of K where that is the exponent of the force."""
    is_of_force = impacts.n == n
    if is_of_force.all():
        return k_t / impacts.K
    return np.where(is_of_force, k_t / impacts.K, impacts.in_own_units(k_t, unit))


def _damping(pair: Pair, oblique: ObliqueImpacts) -> Array:
    """Compute c of the damping force c x^q g, in the contact's own units."""
    law, impacts = pair.friction, oblique.impacts
    match law.damping:
        case "c_t":
            return impacts.in_own_units(_value(law, oblique, "c_t"), "N s/m")
        case "xt":
            return _product(_value(law, oblique, "xt"), _normal_damping(pair.model, impacts))
        case "betas":
            betas = _parameter(law, oblique, "betas")
            beta = gap_damping(impacts.e) if betas is None else betas
            return 2.0 * beta * np.sqrt(_stiffness(pair, oblique))
        case "kratos":
            return _normal_damping(pair.model, impacts) * np.sqrt(_stiffness(pair, oblique) / impacts.n)
        case "cone":
            b_t = _parameter(law, oblique, "b_t")
            b = _force_at_first_contact(pair.model, impacts) if b_t is None else impacts.in_own_units(b_t, "1/s")
            return b / _cone_compliance(law, oblique)
    is_on, is_hertz = _value(law, oblique, "tangential_damping"), impacts.n == HERTZ
    if not is_hertz.any():
        return _product(is_on, _normal_damping(pair.model, impacts))
    c = 2.0 * np.sqrt(5.0 / 6.0) * gap_damping(impacts.e) * np.sqrt(_stiffness(pair, oblique))
    if not is_hertz.all():
        c = np.where(is_hertz, c, _normal_damping(pair.model, impacts))
    return _product(is_on, c)


def _cone_compliance(law: FrictionLaw, oblique: ObliqueImpacts) -> Array:
    """Compute the slip that an impulse of friction takes away, times the impedance d, in units of v0 and m v0."""
    impedance = _value(law, oblique, "impedance")
    return impedance / oblique.mass_ratio + (1.0 - impedance) / _value(law, oblique, "impratio")


def _force_at_first_contact(model: ForceModel, impacts: Impacts) -> Array:
    """Compute the force at first contact in the contact's own units, in which the velocity is 1."""
    values, shape = _law_values(model, impacts, float(impacts.n.flat[0]))
    force = call_by_name(model.force, {**values, "x": 0.0, "v": 1.0, "elastic": 0.0})
    return np.broadcast_to(force, int(np.prod(shape))).reshape(shape)


def _product(factor: Array, c: Array) -> Array:
    """factor c; 0 where the factor is, whatever c is."""
    return np.where(factor == 0.0, 0.0, factor * c)


def _normal_damping(model: ForceModel, impacts: Impacts) -> Array:
    """Compute C of the force K x^n + C x^q v, in the contact's own units; NaN where a law has no such force."""
    damping = _ones(impacts) * np.nan
    exponents, names = distinct_values(impacts.n), COORDINATE_COEFFICIENTS[model.velocity_coordinate]
    for n in exponents.tolist():
        if dashpot_power(model, n) is not None:
            values, shape = _law_values(model, impacts, n)
            c = np.asarray(values[names[0]]).reshape(shape) if names else 0.0 * _ones(impacts)
            damping = c if exponents.size == 1 else np.where(impacts.n == n, c, damping)
    return damping


def _law_values(model: ForceModel, impacts: Impacts, n: float) -> tuple[LawValues, tuple[int, ...]]:
    """Compute the quantities and coefficients of a law, in one dimension, and the shape that they have."""
    values = dimensionless_values(model, impacts)
    shape = np.broadcast_shapes(_ones(impacts).shape, *(value.shape for value in values.values()))
    flat = {name: np.broadcast_to(value, shape).reshape(-1) for name, value in values.items()}
    count = int(np.prod(shape))
    return with_coefficients(model, with_units(flat, n), count), shape


# ---- what a pair lacks


def _problems(pair: Pair, oblique: ObliqueImpacts) -> Iterator[tuple[Mask, str]]:
    """Find where a pair is not combinable, and why."""
    law, model, n = pair.friction, pair.model, oblique.impacts.n
    if model.family == "adhesive":
        is_allowed = (law.kind == "coulomb") & (_value(law, oblique, "limit") > 0.0)
        expected = 'expected coulomb-1785, limit = "positive"'
        # an error of the force is reported by the integration
        with suppress(ModelError):
            pulls = _force_at_first_contact(model, oblique.impacts) < 0.0
            yield pulls & ~is_allowed, f"the contact force pulls from the start: {expected}"
    exponents = EXPONENTS.get(law.stiffness, ())
    is_other, numbers = ~np.isin(n, exponents), " or ".join(map(number, exponents))
    if _parameter(law, oblique, "kt_over_kn") is not None:
        yield is_other, f"kt_over_kn needs a contact force of n = {numbers}"
    elif law.stiffness in ("mindlin", "liggghts") and _parameter(law, oblique, "k_t") is None:
        advice = "; set k_t" if law.stiffness == "mindlin" else ""
        yield is_other, f"8 G* a needs a contact force of n = {numbers}{advice}"
        if model.unloading is not None or model.is_permanent:
            needed = "a contact force without permanent indentation and without unloading branch"
            yield n == HERTZ, f"8 G* a needs {needed}"
    if law.damping in _FACTORS_OF_DAMPING:
        name, off = _FACTORS_OF_DAMPING[law.damping]
        factor = _value(law, oblique, name) if name else _ones(oblique.impacts)
        others = [exponent for exponent in distinct_values(n).tolist() if dashpot_power(model, exponent) is None]
        is_needed = (factor != 0.0) & (law.damping != "liggghts" or n != HERTZ)
        yield np.isin(n, others) & is_needed, f"the contact force has no dashpot C x^q v for the damping{off}"


# of rules that take the damping of the contact force: the parameter that is a factor of it, and how to do without
_FACTORS_OF_DAMPING = {
    "xt": ("xt", "; set xt = 0"),
    "liggghts": ("tangential_damping", '; set tangential_damping = "off"'),
    "kratos": ("", ""),
}
