"""The rules that hold between the keys of a config."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..contact.formula import argument_names
from ..contact.materials import hertz_stiffness
from ..contact.model import ForceModel, with_base_quantities
from ..contact.scaling import required_quantities as quantities_of
from .quantities import Fault
from .tables import MATERIAL_QUANTITIES, SWEEP_QUANTITIES, model_quantities


@dataclass(frozen=True)
class Given:
    """What a config gives, as it was written, whether it could be read or not: other faults hide nothing.

    Parameters
    ----------
    sweep, materials, parameters : the tables [sweep], [materials] and [model]
    models : the models chosen
    selection : the key `models`
    n : the sweep's exponent; None where it is an axis, NaN where it is not known
    """

    sweep: Mapping[str, Any]
    materials: Mapping[str, Any]
    parameters: Mapping[str, Any]
    models: Sequence[ForceModel]
    selection: object
    n: float | None

    def has_own_stiffness(self, model: ForceModel) -> bool:
        """Whether [model.KEY] has a K."""
        table = self.parameters.get(model.key)
        return isinstance(table, dict) and "K" in table

    def material_of(self, ball: str) -> list[str]:
        """Names of the materials that a ball may have."""
        named = self.sweep.get("material", self.sweep.get(f"material{ball}", []))
        return [name for name in (named if isinstance(named, list) else [named]) if isinstance(name, str)]

    def without(self, ball: str, key: str) -> Iterator[str]:
        """The materials of a ball whose table lacks a key."""
        for name in self.material_of(ball):
            table = self.materials.get(name)
            if isinstance(table, dict) and key not in table:
                yield name

    def asking(self, *quantities: str) -> str:
        """The models that depend on one of the quantities, in words; empty if none does."""
        keys = [
            model.key for model in self.models if not with_base_quantities(model.quantities).isdisjoint(quantities)
        ]
        more = f" and {len(keys) - 3} more" if len(keys) > 3 else ""
        return ", ".join(keys[:3]) + more

    def or_without(self, model: ForceModel) -> str:
        """How to leave out a model that was not named, but came with others."""
        is_named = model.key == self.selection or (
            isinstance(self.selection, list) and model.key in self.selection
        )
        return "" if is_named or len(self.models) == 1 else f'; or models = [..., "!{model.key}"]'


def cross_faults(given: Given) -> Iterator[Fault]:
    """What is wrong between the keys."""
    for rule in (_velocity, _restitution, _stiffness, _materials, _yield_strengths, _masses, _radii, _parameters):
        yield from rule(given)


def _velocity(given: Given) -> Iterable[Fault]:
    if "v1" not in given.sweep:
        yield (
            ("sweep", "v1"),
            f"missing, expected {SWEEP_QUANTITIES['v1'].expected}: {SWEEP_QUANTITIES['v1'].meaning}",
        )


def _restitution(given: Given) -> Iterable[Fault]:
    if "e" in given.sweep and "alpha" in given.sweep:
        yield ("sweep", "alpha"), "given beside e, expected one of the two"
    asking = given.asking("e")
    if asking and "e" not in given.sweep and "alpha" not in given.sweep:
        yield ("sweep", "e"), f"missing, expected e or alpha (asked for by {asking}), or other models"


def _stiffness(given: Given) -> Iterable[Fault]:
    n = given.n
    if "K" not in given.sweep or (n is not None and math.isnan(n)):
        return
    groups = given.sweep.get("zip")
    together = [group for group in groups if isinstance(group, list)] if isinstance(groups, list) else []
    together.append(given.sweep.get("cases") or [])
    if n is None and not any("K" in group and "n" in group for group in together):
        yield (
            ("sweep", "K"),
            "its unit N/m^n depends on n, which is an axis; expected one K for each n, zipped with it",
        )
    for model in given.models:
        if model.exponent is not None and model.exponent != n and not given.has_own_stiffness(model):
            sweep = "an axis n" if n is None else f"n = {n:g}"
            # the sweep's n serves all laws unless another one has a different exponent
            serves = n is not None and {item.exponent for item in given.models} <= {None, model.exponent}
            remedy = f"n = {model.exponent:g} under [sweep], " if serves else ""
            yield (
                ("sweep", "K"),
                f"got a stiffness for {sweep}, but {model.key} has n = {model.exponent:g}; "
                f"expected {remedy}K under [model.{model.key}], or no K{given.or_without(model)}",
            )


def _materials(given: Given) -> Iterable[Fault]:
    single = [name for name in ("material1", "material2") if name in given.sweep]
    if "material" in given.sweep:
        for name in single:
            yield ("sweep", name), "given beside material, expected either material, or material1 and material2"
    elif len(single) == 1:
        other = "material2" if single == ["material1"] else "material1"
        yield ("sweep", other), f"missing beside {single[0]}; material is for both balls"
    elif not single:
        of_material = {"E1", "E2", "nu1", "nu2", "yield_strength1", "yield_strength2"}
        of_material |= {name for name in ("R1", "R2") if name not in given.sweep}
        asking = given.asking(*of_material)
        # a rule of the law's own may do without
        by_material = [model for model in given.models if of_material & _stiffness_arguments(model)]
        has_stiffness = given.models and all(map(given.has_own_stiffness, by_material))
        if "K" not in given.sweep and not has_stiffness:
            yield ("sweep", "material"), "missing, expected a material of [materials], or K"
        elif asking:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (asked for by {asking})"


def _yield_strengths(given: Given) -> Iterable[Fault]:
    reported: set[str] = set()
    for ball in ("1", "2"):
        asking = given.asking(f"yield_strength{ball}")
        for name in given.without(ball, "yield_strength") if asking else ():
            if name not in reported:
                reported.add(name)
                expected = MATERIAL_QUANTITIES["yield_strength"].expected
                yield (
                    ("materials", name, "yield_strength"),
                    f"missing, expected {expected} (asked for by {asking})",
                )


def _masses(given: Given) -> Iterable[Fault]:
    """A mass that is not given follows from a radius and a density."""
    for ball in ("1", "2"):
        mass, radius = f"m{ball}", f"R{ball}"
        if mass in given.sweep:
            continue
        about = f"missing, expected {SWEEP_QUANTITIES[mass].expected}: {SWEEP_QUANTITIES[mass].meaning}"
        if radius not in given.sweep:
            yield ("sweep", mass), f"{about}; or {radius} and a material with rho"
        elif not {"material", f"material{ball}"} & given.sweep.keys():
            yield ("sweep", mass), f"{about}; or a material with rho beside {radius}"
        for name in given.without(ball, "rho") if radius in given.sweep else ():
            expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {mass} under [sweep]"
            yield ("materials", name, "rho"), f"missing, expected {expected}: the mass of ball {ball} is not given"


def _radii(given: Given) -> Iterable[Fault]:
    """The materials whose density is missing though a radius is derived from it and a mass."""
    radii: dict[str, list[str]] = {}
    keys: dict[str, None] = {}
    for ball in ("1", "2"):
        radius = f"R{ball}"
        asking = [model.key for model in given.models if radius in _depends_on(model, given)]
        if asking and radius not in given.sweep and f"m{ball}" in given.sweep:
            keys |= dict.fromkeys(asking)
            for name in given.without(ball, "rho"):
                radii.setdefault(name, []).append(radius)
    for name, missing in radii.items():
        need = f"{next(iter(keys))} needs a radius" if len(keys) == 1 else f"{len(keys)} models need a radius"
        expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {' and '.join(missing)} under [sweep]"
        yield ("materials", name, "rho"), f"missing, expected {expected}: {need}"


def _parameters(given: Given) -> Iterable[Fault]:
    """Parameters without a default of the models chosen."""
    for model in given.models:
        table = given.parameters.get(model.key) or {}
        for parameter in model.parameters:
            if parameter.default is None and parameter.name not in table:
                expected = model_quantities(model)[parameter.name].expected
                about = f"missing, expected {expected}: {parameter.meaning}{given.or_without(model)}"
                yield ("model", model.key, parameter.name), about


def _stiffness_arguments(model: ForceModel) -> frozenset[str]:
    """The quantities that the stiffness of a law is derived from where no K is given."""
    return with_base_quantities(argument_names(model.stiffness or hertz_stiffness))


def _depends_on(model: ForceModel, given: Given) -> set[str]:
    """The quantities that a model needs in a sweep, those that its stiffness is derived from among them."""
    has_stiffness = "K" in given.sweep or given.has_own_stiffness(model)
    stiffness = () if has_stiffness else _stiffness_arguments(model)
    return {*with_base_quantities(quantities_of(model)), *model.domain, *stiffness}
