"""Conditions between the keys of a config."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..contact.formula import argument_names
from ..contact.materials import hertz_stiffness
from ..contact.model import ForceModel, with_base_quantities
from ..contact.scaling import required_quantities
from ..contact.timestep import EXACT, SCHEMES, has_scheme, law_problem
from .files import as_table
from .quantities import ConfigProblem
from .tables import FIXED_STEP_INPUTS, MATERIAL_QUANTITIES, SWEEP_QUANTITIES, model_quantities


def listed_names(value: object) -> list[str]:
    """The names in a name or a list of names."""
    return [name for name in (value if isinstance(value, list) else [value]) if isinstance(name, str)]


@dataclass(frozen=True)
class RawConfig:
    """The data of a config before validation, so that rules also apply beside invalid values.

    Parameters
    ----------
    sweep, materials, parameters : the tables [sweep], [materials] and [model]
    models : the selected models
    selection : the value of the key `models`
    n : the exponent of the sweep; None where it varies, NaN where it is unknown
    integrator : of [solver], which may be invalid
    """

    sweep: Mapping[str, Any]
    materials: Mapping[str, Any]
    parameters: Mapping[str, Any]
    models: Sequence[ForceModel]
    selection: object
    n: float | None
    integrator: object

    @property
    def names(self) -> list[str]:
        """The config names of all inputs, whether or not their values are valid."""
        names = [name for name in self.sweep if name not in ("zip", "cases")]
        names += [f"materials.{key}.{name}" for key, table in self.materials.items() for name in as_table(table)]
        return names + [f"{key}.{name}" for key, table in self.parameters.items() for name in as_table(table)]

    def sets_stiffness(self, model: ForceModel) -> bool:
        """Whether [model.KEY] has a K."""
        table = self.parameters.get(model.key)
        return isinstance(table, dict) and "K" in table

    def materials_of(self, ball: str) -> list[str]:
        """Names of the materials that a ball, "1" or "2", may have."""
        return listed_names(self.sweep.get("material", self.sweep.get(f"material{ball}")))

    def materials_without(self, ball: str, key: str) -> Iterator[str]:
        """The materials of a ball whose tables lack a key."""
        for name in self.materials_of(ball):
            table = self.materials.get(name)
            if isinstance(table, dict) and key not in table:
                yield name

    def models_using(self, *quantities: str) -> str:
        """The keys of models that depend on any of the quantities, as text; empty if none does."""
        keys = [
            model.key for model in self.models if not with_base_quantities(model.quantities).isdisjoint(quantities)
        ]
        more = f" and {len(keys) - 3} more" if len(keys) > 3 else ""
        return ", ".join(keys[:3]) + more

    def exclusion_hint(self, model: ForceModel) -> str:
        """How to exclude a model that was selected by "all", a family or a pattern; empty for a named model."""
        is_named = model.key == self.selection or (
            isinstance(self.selection, list) and model.key in self.selection
        )
        return "" if is_named or len(self.models) == 1 else f'; or models = [..., "!{model.key}"]'


def rule_problems(raw: RawConfig) -> Iterator[ConfigProblem]:
    """The problems of all rules."""
    yield from _velocity_problems(raw)
    yield from _restitution_problems(raw)
    yield from _stiffness_problems(raw)
    yield from _material_problems(raw)
    yield from _yield_strength_problems(raw)
    yield from _mass_problems(raw)
    yield from _radius_problems(raw)
    yield from _parameter_problems(raw)
    yield from _fixed_step_problems(raw)


def _velocity_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    if "v1" not in raw.sweep:
        yield (
            ("sweep", "v1"),
            f"missing, expected {SWEEP_QUANTITIES['v1'].expected}: {SWEEP_QUANTITIES['v1'].meaning}",
        )


def _restitution_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    if "e" in raw.sweep and "alpha" in raw.sweep:
        yield ("sweep", "alpha"), "set together with e, expected one of the two"
    users = raw.models_using("e")
    if users and "e" not in raw.sweep and "alpha" not in raw.sweep:
        yield ("sweep", "e"), f"missing, expected e or alpha (used by {users}), or other models"


def _stiffness_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    n = raw.n
    if "K" not in raw.sweep or (n is not None and math.isnan(n)):
        return
    groups = raw.sweep.get("zip")
    together = [group for group in groups if isinstance(group, list)] if isinstance(groups, list) else []
    together.append(raw.sweep.get("cases") or [])
    value = raw.sweep.get("n")
    is_axis = isinstance(value, list) or (isinstance(value, dict) and "fit" not in value)
    if is_axis and not any("K" in group and "n" in group for group in together):
        yield (
            ("sweep", "K"),
            "its unit N/m^n depends on n, which is an axis; expected one K for each n, zipped with it",
        )
    for model in raw.models:
        if model.exponent is not None and model.exponent != n and not raw.sets_stiffness(model):
            sweep = "an axis n" if n is None else f"n = {n:g}"
            # setting n of the sweep helps unless two models have different fixed exponents
            serves = n is not None and {other.exponent for other in raw.models} <= {None, model.exponent}
            remedy = f"n = {model.exponent:g} under [sweep], " if serves else ""
            yield (
                ("sweep", "K"),
                f"got a stiffness for {sweep}, but {model.key} has n = {model.exponent:g}; "
                f"expected {remedy}K under [model.{model.key}], or no K{raw.exclusion_hint(model)}",
            )


def _material_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    single = [name for name in ("material1", "material2") if name in raw.sweep]
    if "material" in raw.sweep:
        for name in single:
            yield (
                ("sweep", name),
                "set together with material, expected either material, or material1 and material2",
            )
    elif len(single) == 1:
        other = "material2" if single == ["material1"] else "material1"
        yield ("sweep", other), f"missing, expected both, as {single[0]} is set; or material for both balls"
    elif not single:
        of_material = {"E1", "E2", "nu1", "nu2", "yield_strength1", "yield_strength2"}
        of_material |= {name for name in ("R1", "R2") if name not in raw.sweep}
        users = raw.models_using(*of_material)
        # the stiffness of some models needs no material
        by_material = [model for model in raw.models if of_material & _stiffness_arguments(model)]
        has_stiffness = raw.models and all(map(raw.sets_stiffness, by_material))
        if "K" not in raw.sweep and not has_stiffness:
            yield ("sweep", "material"), "missing, expected a material of [materials], or K"
        elif users:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (used by {users})"


def _yield_strength_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    reported: set[str] = set()
    for ball in ("1", "2"):
        users = raw.models_using(f"yield_strength{ball}")
        for name in raw.materials_without(ball, "yield_strength") if users else ():
            if name not in reported:
                reported.add(name)
                expected = MATERIAL_QUANTITIES["yield_strength"].expected
                yield (
                    ("materials", name, "yield_strength"),
                    f"missing, expected {expected} (used by {users})",
                )


def _mass_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    """A mass that is missing is derived from a radius and a density."""
    for ball in ("1", "2"):
        mass, radius = f"m{ball}", f"R{ball}"
        if mass in raw.sweep:
            continue
        about = f"missing, expected {SWEEP_QUANTITIES[mass].expected}: {SWEEP_QUANTITIES[mass].meaning}"
        if radius not in raw.sweep or not {"material", f"material{ball}"} & raw.sweep.keys():
            yield ("sweep", mass), f"{about}; or {radius} and a material with rho"
        for name in raw.materials_without(ball, "rho") if radius in raw.sweep else ():
            expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {mass} under [sweep]"
            yield ("materials", name, "rho"), f"missing, expected {expected}: the mass of ball {ball} is not set"


def _radius_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    """A radius that is missing is derived from a mass and a density."""
    radii: dict[str, list[str]] = {}
    keys: dict[str, None] = {}
    for ball in ("1", "2"):
        radius = f"R{ball}"
        users = [model.key for model in raw.models if radius in _depends_on(model, raw)]
        if users and radius not in raw.sweep and f"m{ball}" in raw.sweep:
            keys |= dict.fromkeys(users)
            for name in raw.materials_without(ball, "rho"):
                radii.setdefault(name, []).append(radius)
    for name, missing in radii.items():
        need = f"{next(iter(keys))} needs a radius" if len(keys) == 1 else f"{len(keys)} models need a radius"
        expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {' and '.join(missing)} under [sweep]"
        yield ("materials", name, "rho"), f"missing, expected {expected}: {need}"


def _parameter_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    """Parameters of the selected models that have no default."""
    for model in raw.models:
        table = raw.parameters.get(model.key) or {}
        for parameter in model.parameters:
            if parameter.default is None and parameter.name not in table:
                expected = model_quantities(model)[parameter.name].expected
                about = f"missing, expected {expected}: {parameter.meaning}{raw.exclusion_hint(model)}"
                yield ("model", model.key, parameter.name), about


def _fixed_step_problems(raw: RawConfig) -> Iterable[ConfigProblem]:
    """A scheme has one fixed step, given in either of two ways; the continuous law has none."""
    if raw.integrator == EXACT:
        for name in FIXED_STEP_INPUTS:
            if name in raw.sweep:
                expected = f'solver.integrator = "{next(iter(SCHEMES))}" as well'
                yield (
                    ("sweep", name),
                    f'set with solver.integrator = "{EXACT}", which has no fixed step, expected {expected}',
                )
    elif isinstance(raw.integrator, str) and raw.integrator in SCHEMES:
        for model in raw.models:
            n = model.exponent or raw.n
            # an exponent that is an axis has values that the scheme does not take
            if not has_scheme(model, math.nan if n is None else n, raw.integrator):
                yield ("solver", "integrator"), law_problem(model, raw.integrator)
                break
        given = [name for name in ("steps_per_contact", "dt") if name in raw.sweep]
        if len(given) == 2:
            yield ("sweep", "dt"), "set together with steps_per_contact, expected one of the two"
        elif not given:
            quantity = SWEEP_QUANTITIES["steps_per_contact"]
            about = f"missing, expected {quantity.expected}: {quantity.meaning}; or dt"
            yield ("sweep", "steps_per_contact"), about


def _stiffness_arguments(model: ForceModel) -> frozenset[str]:
    """The quantities from which the stiffness of a model is derived if the config has no K."""
    return with_base_quantities(argument_names(model.stiffness or hertz_stiffness))


def _depends_on(model: ForceModel, raw: RawConfig) -> set[str]:
    """The quantities that a model needs in a sweep, including those of its stiffness."""
    has_stiffness = "K" in raw.sweep or raw.sets_stiffness(model)
    stiffness = () if has_stiffness else _stiffness_arguments(model)
    return {*with_base_quantities(required_quantities(model)), *model.domain, *stiffness}
