"""A contact force model as data: what a paper says of it, and its formulas as pure functions."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NotRequired, Protocol, TypedDict

from ..errors import ModelError, did_you_mean
from .evidence import Evidence
from .formula import Formula, argument_names
from .units import dimension

# what a law may ask for by name, besides its own parameters and coefficients, and the unit of each
QUANTITIES = {
    "e": "1", "n": "1", "K": "N/m^n", "m": "kg", "v0": "m/s", "R1": "m", "R2": "m", "E1": "Pa", "E2": "Pa",
    "nu1": "1", "nu2": "1", "yield_strength1": "Pa", "yield_strength2": "Pa",
    "R_eff": "m", "E_eff": "Pa", "Y_min": "Pa",
}  # fmt: skip
# the quantities that others are computed from
BASE_QUANTITIES = {
    "R_eff": ("R1", "R2"),
    "E_eff": ("E1", "nu1", "E2", "nu2"),
    "Y_min": ("yield_strength1", "yield_strength2"),
}
NOT_VERIFIED = Evidence("not verified")
# what else a domain may bound
DOMAIN_INPUTS = ("v1", "v2", "m1", "m2", "length")
FORCE_ARGUMENTS = {"x": "indentation", "v": "indentation rate", "elastic": "K δⁿ"}
UNLOADING_ARGUMENTS = {
    "peak": "peak indentation",
    "force_at_peak": "force there",
    "residual": "permanent indentation",
    "recovered": "peak indentation above the permanent one",
}
STRETCH_ARGUMENTS = {"stretch": "indentation above the permanent one"}
# coefficients that a coordinate of the velocity asks for; the first is the strength of the damping
COORDINATE_COEFFICIENTS = {"v": (), "log": ("chi",), "force": ("c", "q")}


def with_base_quantities(names: Iterable[str]) -> frozenset[str]:
    """Some names, and those of the quantities that they are computed from.

    >>> sorted(with_base_quantities(["R_eff", "e"]))
    ['R1', 'R2', 'R_eff', 'e']
    """
    names = frozenset(names)
    return names.union(*(BASE_QUANTITIES.get(name, ()) for name in names))


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model that the restitution does not set.

    `unit` is an SI unit, whose exponents may contain n ("N/m^n") and dimensionless parameters; `least` and `most`
    are the closed interval of its values; `default` is None where the user has to give it; `typical` is a value
    in that unit for checks, where the contact's own units are no measure of it.

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


class Law(Protocol):
    """What the outputs of a collision depend on besides its trajectory: all of a law but its formulas.

    A `ForceModel` is one; a result keeps one of each model, so that it can be read without the formulas.
    """

    @property
    def key(self) -> str: ...
    @property
    def exponent(self) -> float | None: ...
    @property
    def parameters(self) -> tuple[Parameter, ...]: ...
    @property
    def domain(self) -> Mapping[str, tuple[float, float]]: ...
    @property
    def quantities(self) -> frozenset[str]: ...
    @property
    def is_permanent(self) -> bool: ...
    @property
    def stiffness(self) -> Formula | None: ...


class About(TypedDict):
    """What is said of a law besides its formulas; see `ForceModel`."""

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


@dataclass(frozen=True, repr=False)
class ForceModel:
    """A contact force model, written as its paper writes it.

    Every formula asks by the names of its arguments for what it needs: `x` (indentation), `v` (its rate),
    `elastic` (K δⁿ), the quantities of the contact (`K, n, m, v0, e, R1, R2, E1, E2, nu1, nu2,
    yield_strength1, yield_strength2`, and of both balls together `R_eff` = 1/(1/R1 + 1/R2), `E_eff` =
    1/((1 − nu1²)/E1 + (1 − nu2²)/E2), `Y_min` = min(yield_strength1, yield_strength2)), the
    model's own parameters and coefficients; `unloading` also for
    `peak`, `force_at_peak`, `residual`, `recovered` and `stretch`, x above the residual. All arrive in the
    contact's own units, in which K = m = v0 = 1, as arrays of one shape, (n,), or as numbers where they are the
    same for all; parameters are converted by their unit, so that the formula does not change. A formula works on
    arrays: `np.where`, not `if`.

    Parameters
    ----------
    key : kebab-case name, unique in the catalogue
    title, year, reference, doi : where the law comes from
    equation : the law in one line of Unicode
    evidence : where the formula and the DOI were read, derived, or that they were not verified
    domain : closed intervals by the name of an input or derived quantity, where the law is said to hold
    domain_source : who says so
    force : contact force of the whole contact, or of the approach phase where `unloading` is given
    unloading : contact force of the restitution phase
    residual : permanent indentation, from `peak`, `force_at_peak` and the quantities of the contact
    recovered : what of the peak indentation is recovered, in place of `residual` where it may be a small part
    breakpoints, unloading_breakpoints : indentations at which `force`, or `unloading`, has another formula, NaN
        for none; no step goes across. They ask for what is known beforehand, the latter for `peak`,
        `force_at_peak` and `residual` too. One that asks for `x`, `v` or `elastic` changes its sign there
    coefficients : formulas evaluated once per impact, by name; a later one may ask for an earlier one.
        `chi` is the dimensionless damping χ = λ v₀/K
    parameters : what the user gives in `[model.KEY]`
    oracle : exact delivered restitution, where a closed form exists
    stiffness : K in SI from the quantities of the contact and the parameters, where it is not given and not (12)
    release : the contact ends at zero indentation ("gap"), or already at zero force ("force")
    coordinate_power : p of the smooth coordinate δ = δᵣ + sᵖ: 2 for half-integer powers, 4 for quarters
    velocity_coordinate : "log" where `force` is K δⁿ (1 + χ δ̇/v₀) exactly, so that large χ can be integrated
        without stiffness; "force" where it is K δⁿ + c δ^q δ̇ exactly, with coefficients c, and q of n alone,
        which keeps the digits of the force at its zero
    exponent : n, where the law fixes it; None takes the sweep's
    family : the group it is listed under
    same_as : the key of the law that this is another name of, if it is

    Raises
    ------
    ModelError : a formula asks for something that is not there, a unit cannot be read, a field is malformed

    A linear spring and dashpot, whose damping constant the user gives, and which ends when the force does:

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
            raise ModelError(f'model key "{self.key}": wants kebab-case, such as "hunt-crossley-1975"')
        if self.residual is not None and self.recovered is not None:
            raise ModelError(f"model {self.key}: recovered: given beside residual, wants one of the two")
        if self.unloading_breakpoints and self.unloading is None:
            raise ModelError(f"model {self.key}: unloading_breakpoints: wants an unloading")
        self._check_fields()
        self._check_velocity_coordinate()
        once = {*QUANTITIES, *(parameter.name for parameter in self.parameters)}
        for name, formula in self.coefficients.items():
            self._check_arguments(f"coefficient {name}", formula, once)
            once.add(name)
        self._check_arguments("force", self.force, {*once, *FORCE_ARGUMENTS})
        self._check_arguments(
            "unloading", self.unloading, {*once, *FORCE_ARGUMENTS, *UNLOADING_ARGUMENTS, *STRETCH_ARGUMENTS}
        )
        for role in ("residual", "recovered"):
            self._check_arguments(role, getattr(self, role), {*once, "peak", "force_at_peak"})
        for formula in self.breakpoints:
            self._check_arguments("breakpoint", formula, {*once, *FORCE_ARGUMENTS})
        for formula in self.unloading_breakpoints:
            self._check_arguments("unloading breakpoint", formula, {*once, *FORCE_ARGUMENTS, *UNLOADING_ARGUMENTS})
        self._check_arguments("oracle", self.oracle, once)
        self._check_arguments(
            "stiffness", self.stiffness, {*QUANTITIES, *(one.name for one in self.parameters)} - {"K", "e"}
        )

    def _check_velocity_coordinate(self) -> None:
        wanted = COORDINATE_COEFFICIENTS[self.velocity_coordinate]
        is_of_form = {"elastic", *wanted[:1]} <= set(argument_names(self.force)) and not self.breakpoints
        if wanted and not (is_of_form and self.coefficients.keys() >= set(wanted)):
            raise ModelError(
                f'model {self.key}: velocity_coordinate "{self.velocity_coordinate}" wants a coefficient '
                f"{' and one '.join(wanted)}, a force of elastic and {wanted[0]}, and no breakpoints"
            )

    def _check_fields(self) -> None:
        own = isinstance(self.parameters, tuple) and all(isinstance(one, Parameter) for one in self.parameters)
        known = isinstance(self.evidence, Evidence)
        allowed = {
            "evidence": (known, 'an impact.Evidence, such as Evidence("derived", "our report, equation (3)")'),
            "release": (self.release in ("gap", "force"), '"gap" or "force"'),
            "velocity_coordinate": (self.velocity_coordinate in COORDINATE_COEFFICIENTS, '"v", "log" or "force"'),
            "coordinate_power": (self.coordinate_power in (2, 4, 6, 8), "2, 4, 6 or 8"),
            "exponent": (self.exponent is None or 1.0 <= self.exponent <= 10.0, "None, or a number from 1 to 10"),
            "parameters": (own, "a tuple of Parameter"),
        }
        for name, (right, wants) in allowed.items():
            if not right:
                raise ModelError(f"model {self.key}: {name}: got {getattr(self, name)!r}, wants {wants}")
        taken = {*QUANTITIES, *DOMAIN_INPUTS, *FORCE_ARGUMENTS, *UNLOADING_ARGUMENTS, *STRETCH_ARGUMENTS}
        for name in (*(parameter.name for parameter in self.parameters), *self.coefficients):
            if name in taken:
                raise ModelError(f'model {self.key}: "{name}" is the name of a quantity, wants another')
        pure = [parameter.name for parameter in self.parameters if parameter.unit == "1"]
        for parameter in self.parameters:
            dimension(parameter.unit, {"n": 1.5, **dict.fromkeys(pure, 1.0)})
        bounded = {
            *QUANTITIES,
            *DOMAIN_INPUTS,
            *({"chi"} & self.coefficients.keys()),
            *(one.name for one in self.parameters),
        }
        for name, ends in self.domain.items():
            if name not in bounded:
                raise ModelError(f'model {self.key}: domain of "{name}"; {did_you_mean(name, sorted(bounded))}')
            if len(ends) != 2 or not ends[0] <= ends[1]:
                raise ModelError(f"model {self.key}: domain of {name}: got {ends!r}, wants (least, most)")

    def __repr__(self) -> str:
        return f"<ForceModel {self.key}>"

    def _check_arguments(self, role: str, formula: Formula | None, known: set[str]) -> None:
        for wish in argument_names(formula):
            if wish not in known:
                raise ModelError(
                    f'model {self.key}: its {role} asks for "{wish}"; {did_you_mean(wish, sorted(known))}'
                )

    @property
    def motion_formulas(self) -> tuple[Formula | None, ...]:
        """The formulas that the equations of motion call."""
        branches = (self.force, self.unloading, self.residual, self.recovered)
        return (*branches, *self.breakpoints, *self.unloading_breakpoints)

    @property
    def quantities(self) -> frozenset[str]:
        """The names of the quantities and parameters that the law's motion depends on."""
        own = {parameter.name for parameter in self.parameters}
        formulas = (*self.motion_formulas, *self.coefficients.values())
        return frozenset(w for formula in formulas for w in argument_names(formula) if w in QUANTITIES or w in own)

    def unit_of(self, name: str) -> str:
        """The unit of a quantity or parameter."""
        return next((one.unit for one in self.parameters if one.name == name), None) or QUANTITIES[name]

    @property
    def is_permanent(self) -> bool:
        """Whether an indentation may stay where the force ends."""
        return self.residual is not None or self.recovered is not None

    @property
    def domain_text(self) -> str:
        """The domain in words, and who says so.

        >>> from impact.contact.models import catalogue
        >>> catalogue()["lankarani-nikravesh-1990"].domain_text
        '0.9 ≤ e ≤ 1 (Gharib and Hurmuzlu 2012)'
        """
        text = ", ".join(f"{low:g} ≤ {name} ≤ {high:g}" for name, (low, high) in self.domain.items())
        return f"{text} ({self.domain_source})" if text and self.domain_source else text
