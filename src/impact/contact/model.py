"""A contact force model as data: its source, and its formulas as pure functions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NotRequired, TypedDict

from ..errors import ModelError, did_you_mean
from .evidence import Evidence
from .formula_calls import Formula, argument_names
from .units import dimension

# arguments of formulas besides the law's own parameters and coefficients, and their units
QUANTITIES = {
    "e": "1",
    "n": "1",
    "K": "N/m^n",
    "m": "kg",
    "v0": "m/s",
    "R1": "m",
    "R2": "m",
    "E1": "Pa",
    "E2": "Pa",
    "nu1": "1",
    "nu2": "1",
    "yield_strength1": "Pa",
    "yield_strength2": "Pa",
    "R_eff": "m",
    "E_eff": "Pa",
    "Y_min": "Pa",
}
# the quantities that others are computed from
BASE_QUANTITIES = {
    "R_eff": ("R1", "R2"),
    "E_eff": ("E1", "nu1", "E2", "nu2"),
    "Y_min": ("yield_strength1", "yield_strength2"),
}
NOT_VERIFIED = Evidence("not verified")
# further inputs that a domain may bound
DOMAIN_INPUTS = ("v1", "v2", "m1", "m2", "length")
# arguments of a force, see `ForceModel`, and the further ones of its unloading branch that stay the same in it
FORCE_ARGUMENTS = ("x", "v", "elastic")
UNLOADING_ARGUMENTS = ("peak", "force_at_peak", "residual", "recovered")
# coefficients that a velocity coordinate needs; the first measures the strength of the damping
COORDINATE_COEFFICIENTS = {"v": (), "log": ("chi",), "force": ("c", "q")}


def with_base_quantities(names: Iterable[str]) -> frozenset[str]:
    """Extend the names by those of the quantities that they are computed from.

    >>> sorted(with_base_quantities(["R_eff", "e"]))
    ['R1', 'R2', 'R_eff', 'e']
    """
    names = frozenset(names)
    return names.union(*(BASE_QUANTITIES.get(name, ()) for name in names))


@dataclass(frozen=True)
class Parameter:
    """A parameter that the user sets for a model, besides the restitution.

    `unit` is an SI unit, whose exponents may contain n ("N/m^n") and dimensionless parameters; `least` and `most`
    are the closed interval of its values; `default` is None where the user has to set it, unless it is `optional`;
    `typical` is a value in that unit for checks, where the contact's own units are no measure of it. A parameter
    with `choices` is one of these words; its values, and its default, are their positions. `is_damping` marks the
    parameter that sets the restitution of a law without an e.

    >>> Parameter("c", "N s/m", "damping constant", default=100.0, least=0.0).unit
    'N s/m'
    """

    name: str
    unit: str
    meaning: str
    default: float | None = None
    least: float = float("-inf")
    most: float = float("inf")
    typical: float | None = None
    optional: bool = False
    choices: tuple[str, ...] = ()
    is_damping: bool = False


@dataclass(frozen=True)
class StoredLaw:
    """A law as stored in a file: everything that outputs depend on besides the trajectory, without formulas."""

    key: str
    exponent: float | None
    parameters: tuple[Parameter, ...]
    domain: Mapping[str, tuple[float, float]]
    quantities: frozenset[str]
    is_permanent: bool
    stiffness: Formula | None = None


class About(TypedDict):
    """The fields of a `ForceModel` that describe a law, besides the formulas of its motion."""

    title: str
    year: int
    equation: str
    reference: str
    doi: NotRequired[str]
    evidence: NotRequired[Evidence]
    domain: NotRequired[Mapping[str, tuple[float, float]]]
    domain_source: NotRequired[str]
    parameters: NotRequired[tuple[Parameter, ...]]
    exponent: NotRequired[float]
    stiffness: NotRequired[Formula]
    family: NotRequired[str]


@dataclass(frozen=True, repr=False)
class ForceModel:
    """A contact force model, with formulas in the notation of its source.

    The names of a formula's arguments decide what it is called with: `x` (indentation), `v` (its rate),
    `elastic` (K δⁿ), the quantities of the contact (`K, n, m, v0, e, R1, R2, E1, E2, nu1, nu2,
    yield_strength1, yield_strength2`, and of both balls together `R_eff` = 1/(1/R1 + 1/R2), `E_eff` =
    1/((1 − nu1²)/E1 + (1 − nu2²)/E2), `Y_min` = min(yield_strength1, yield_strength2)), the
    model's own parameters and coefficients; `unloading` also for
    `peak`, `force_at_peak`, `residual`, `recovered` and `stretch`, x above the residual. All are in the
    contact's own units, in which K = m = v0 = 1, as arrays of one shape, (n,), or as numbers where they are the
    same for all impacts; parameters are converted by their unit, so that the formula does not change. A formula
    works on arrays: use `np.where`, not `if`.

    Parameters
    ----------
    key : kebab-case name, unique in the catalogue
    title : the authors, or the name of the law in its code
    year : with which the law is named
    reference : sources of the law, separated by semicolons
    doi : of the first source
    equation : the law in one line of Unicode
    evidence : where the formula and the DOI were read or derived, or that they were not verified
    domain : closed intervals in which the law is reported to hold, by the name of an input or derived quantity
    domain_source : the source of the domain
    force : contact force of the whole contact, or of the approach phase where `unloading` is given
    unloading : contact force of the restitution phase
    residual : permanent indentation, from `peak`, `force_at_peak` and the quantities of the contact
    recovered : recovered part of the peak indentation, instead of `residual` where it may be a small part
    breakpoints, unloading_breakpoints : indentations at which the formula of `force`, or of `unloading`, changes;
        NaN for none. No step crosses them. Their arguments are quantities, parameters and coefficients, those of
        the latter also `peak`, `force_at_peak` and `residual`. A formula with the argument `x`, `v` or `elastic`
        returns no indentation, but a function of the motion that changes its sign at the breakpoint
    coefficients : formulas evaluated once per impact, by name; each may use those before it.
        `chi` is the dimensionless damping χ = λ v₀/K
    parameters : parameters that the user sets in `[model.KEY]`
    oracle : exact delivered restitution, where a closed form exists
    stiffness : K in SI from the quantities of the contact and the parameters, used where the user sets no K;
        None is equation (12)
    release : where the contact ends: at zero indentation ("gap"), or already at zero force ("force")
    coordinate_power : p of the smooth coordinate δ = δᵣ + sᵖ: 2 for half-integer powers, 4 for quarters
    velocity_coordinate : "log" where `force` is K δⁿ (1 + χ δ̇/v₀) exactly, so that large χ can be integrated
        without stiffness; "force" where it is K δⁿ + c δ^q δ̇ exactly, with coefficients c, and q of n alone,
        which keeps the digits of the force at its zero
    exponent : n, where the law fixes it; None is the n of the sweep
    family : group of the catalogue
    same_as : key of the law that this one is another name for, or ""

    Raises
    ------
    ModelError : a formula has an unknown argument, a unit cannot be parsed, or a field is malformed

    A linear spring and dashpot with a damping constant that the user sets, whose contact ends at zero force:

    >>> import impact
    >>> dashpot = ForceModel(
    ...     key="dashpot", title="Spring and dashpot", year=2026, equation="F = K δ + c δ̇", reference="",
    ...     force=lambda K, x, v, c: K * x + c * v, release="force", exponent=1.0,
    ...     parameters=(Parameter("c", "N s/m", "damping constant", default=100.0, least=0.0),),
    ... )
    >>> result = impact.sweep({
    ...     "models": "dashpot",
    ...     "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0},
    ...     "model": {"dashpot": {"c": [0.0, 100.0]}},
    ... }, plugins=[dashpot])
    >>> result["e_out"].values.round(6).tolist()
    [[1.0, 0.808424]]
    """

    key: str
    title: str
    year: int
    equation: str
    reference: str
    force: Formula
    doi: str = ""
    evidence: Evidence = NOT_VERIFIED
    domain: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    domain_source: str = ""
    unloading: Formula | None = None
    residual: Formula | None = None
    recovered: Formula | None = None
    breakpoints: tuple[Formula, ...] = ()
    unloading_breakpoints: tuple[Formula, ...] = ()
    coefficients: Mapping[str, Formula] = field(default_factory=dict)
    parameters: tuple[Parameter, ...] = ()
    oracle: Formula | None = None
    stiffness: Formula | None = None
    release: Literal["gap", "force"] = "gap"
    coordinate_power: int = 2
    velocity_coordinate: Literal["v", "log", "force"] = "v"
    exponent: float | None = None
    family: str = "other"
    same_as: str = ""

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", self.key):
            raise ModelError(f'model key "{self.key}": expected kebab-case, such as "hunt-crossley-1975"')
        if self.residual is not None and self.recovered is not None:
            raise ModelError(f"model {self.key}: recovered: set together with residual, expected one of the two")
        if self.unloading_breakpoints and self.unloading is None:
            raise ModelError(f"model {self.key}: unloading_breakpoints: set without unloading, expected both")
        self._check_fields()
        self._check_velocity_coordinate()
        inputs = {*QUANTITIES, *(parameter.name for parameter in self.parameters)}
        names = set(inputs)
        for name, formula in self.coefficients.items():
            self._check_arguments(f"coefficient {name}", names, formula)
            names.add(name)
        approach = {*names, *FORCE_ARGUMENTS}
        restitution = {*approach, *UNLOADING_ARGUMENTS}
        self._check_arguments("force", approach, self.force)
        self._check_arguments("unloading", {*restitution, "stretch"}, self.unloading)
        for role in ("residual", "recovered"):
            self._check_arguments(role, {*names, "peak", "force_at_peak"}, getattr(self, role))
        self._check_arguments("breakpoint", approach, *self.breakpoints)
        self._check_arguments("unloading breakpoint", restitution, *self.unloading_breakpoints)
        self._check_arguments("oracle", names, self.oracle)
        self._check_arguments("stiffness", inputs - {"K", "e"}, self.stiffness)

    def _check_velocity_coordinate(self) -> None:
        required = COORDINATE_COEFFICIENTS[self.velocity_coordinate]
        has_arguments = {"elastic", *required[:1]} <= set(argument_names(self.force)) and not self.breakpoints
        if required and not (has_arguments and self.coefficients.keys() >= set(required)):
            raise ModelError(
                f'model {self.key}: velocity_coordinate "{self.velocity_coordinate}": expected a coefficient '
                f"{' and a coefficient '.join(required)}, a force of elastic and {required[0]}, and no breakpoints"
            )
        if "q" in required:
            self._check_arguments("coefficient q", {"n"}, self.coefficients["q"])

    def _check_fields(self) -> None:
        are_parameters = isinstance(self.parameters, tuple) and all(
            isinstance(p, Parameter) for p in self.parameters
        )
        allowed = {
            "evidence": (
                isinstance(self.evidence, Evidence),
                'an impact.Evidence, such as Evidence("derived", "our report, equation (3)")',
            ),
            "release": (self.release in ("gap", "force"), '"gap" or "force"'),
            "velocity_coordinate": (self.velocity_coordinate in COORDINATE_COEFFICIENTS, '"v", "log" or "force"'),
            "coordinate_power": (self.coordinate_power in (2, 4, 6, 8), "2, 4, 6 or 8"),
            "exponent": (self.exponent is None or 1.0 <= self.exponent <= 10.0, "None, or a number from 1 to 10"),
            "parameters": (are_parameters, "a tuple of Parameter"),
        }
        for name, (is_valid, expected) in allowed.items():
            if not is_valid:
                raise ModelError(f"model {self.key}: {name}: got {getattr(self, name)!r}, expected {expected}")
        reserved_names = {*QUANTITIES, *DOMAIN_INPUTS, *FORCE_ARGUMENTS, *UNLOADING_ARGUMENTS, "stretch", "status"}
        parameter_names = [parameter.name for parameter in self.parameters]
        for name in (*parameter_names, *self.coefficients):
            if name in reserved_names:
                raise ModelError(f'model {self.key}: "{name}" is the name of a quantity, expected another name')
            if not name.isidentifier():
                raise ModelError(f'model {self.key}: got the name "{name}", expected letters, digits and "_"')
            if parameter_names.count(name) > 1:
                raise ModelError(f'model {self.key}: parameters: got "{name}" twice, expected it once')
        dimensionless = [parameter.name for parameter in self.parameters if parameter.unit == "1"]
        for parameter in self.parameters:
            dimension(parameter.unit, {"n": 1.5, **dict.fromkeys(dimensionless, 1.0)})
            default = parameter.least if parameter.default is None else parameter.default
            if not parameter.least <= default <= parameter.most:
                raise ModelError(
                    f"model {self.key}: parameter {parameter.name}: got the default {default:g}, "
                    f"expected a number from {parameter.least:g} to {parameter.most:g}"
                )
        domain_names = {*QUANTITIES, *DOMAIN_INPUTS, *({"chi"} & self.coefficients.keys()), *parameter_names}
        for name, ends in self.domain.items():
            if name not in domain_names:
                raise ModelError(
                    f'model {self.key}: domain of "{name}"; {did_you_mean(name, sorted(domain_names))}'
                )
            if len(ends) != 2 or not ends[0] <= ends[1]:
                raise ModelError(f"model {self.key}: domain of {name}: got {ends!r}, expected (least, most)")

    def __repr__(self) -> str:
        return f"<ForceModel {self.key}: {self.equation}>"

    def _check_arguments(self, role: str, names: set[str], *formulas: Formula | None) -> None:
        for name in (name for formula in formulas for name in argument_names(formula)):
            if name not in names:
                raise ModelError(
                    f'model {self.key}: its {role} asks for "{name}"; {did_you_mean(name, sorted(names))}'
                )

    @property
    def motion_formulas(self) -> tuple[Formula | None, ...]:
        """The formulas that the equations of motion call."""
        branches = (self.force, self.unloading, self.residual, self.recovered)
        return (*branches, *self.breakpoints, *self.unloading_breakpoints)

    @property
    def quantities(self) -> frozenset[str]:
        """The names of the quantities and parameters that the law's motion depends on."""
        names = QUANTITIES.keys() | {parameter.name for parameter in self.parameters}
        formulas = (*self.motion_formulas, *self.coefficients.values())
        return frozenset(name for formula in formulas for name in argument_names(formula) if name in names)

    @property
    def damping(self) -> str:
        """The name of the parameter that sets the restitution of a law without an e; "" without one."""
        return next((parameter.name for parameter in self.parameters if parameter.is_damping), "")

    def unit_of(self, name: str) -> str:
        """Find the unit of a quantity or parameter."""
        units = {parameter.name: parameter.unit for parameter in self.parameters}
        return units.get(name) or QUANTITIES[name]

    @property
    def is_permanent(self) -> bool:
        """Whether an indentation may stay where the force ends."""
        return self.residual is not None or self.recovered is not None

    @property
    def domain_text(self) -> str:
        """The domain in words, with its source.

        >>> from impact.contact.models import catalogue
        >>> catalogue()["lankarani-nikravesh-1990"].domain_text
        '0.9 ≤ e ≤ 1 (Gharib and Hurmuzlu 2012)'
        >>> catalogue()["hertz"].domain_text
        'e = 1 (by definition)'
        """
        text = ", ".join(
            f"{low:g} ≤ {name} ≤ {high:g}" if low < high else f"{name} = {low:g}"
            for name, (low, high) in self.domain.items()
        )
        return f"{text} ({self.domain_source})" if text and self.domain_source else text


# what the outputs of a collision depend on, besides its trajectory
Law = ForceModel | StoredLaw
