"""What the keys of a config mean, and the rules that hold between them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase

from ..contact.formula import wishes
from ..contact.material import hertz_stiffness
from ..contact.model import ForceModel, Parameter
from ..contact.models import built_in
from ..contact.values import asked as quantities_of
from .ranges import MAX_FAULTS
from .values import MAX_UNIT, Fault, Problem, Quantity, nearest, refuse

DEFAULTS = {"v2": 0.0, "n": 1.5}

SWEEP = {
    "e": Quantity("1", "coefficient of restitution", least=0, most=1),
    "alpha": Quantity("s/m", "slope of e = 1 - alpha v0", least=0),
    "v1": Quantity("m/s", "velocity of ball 1 before the impact"),
    "v2": Quantity("m/s", "velocity of ball 2 before the impact"),
    "m1": Quantity("kg", "mass of ball 1", least=0, above=True, infinite=True),
    "m2": Quantity("kg", "mass of ball 2", least=0, above=True, infinite=True),
    "R1": Quantity("m", "radius of ball 1", least=0, above=True, infinite=True),
    "R2": Quantity("m", "radius of ball 2", least=0, above=True, infinite=True),
    "K": Quantity("N/m^n", "stiffness of the contact, F = K x^n", least=0, above=True),
    "n": Quantity("1", "compliance exponent", least=1, most=10),
}
MATERIALS = {
    "material": "material of both balls",
    "material1": "material of ball 1",
    "material2": "material of ball 2",
}
MATERIAL = {
    "E": Quantity("Pa", "Young's modulus", least=0, above=True),
    "nu": Quantity("1", "Poisson's ratio", least=-1, most=0.5, above=True),
    "rho": Quantity("kg/m^3", "density", least=0, above=True),
    "yield_strength": Quantity("Pa", "yield strength", least=0, above=True),
}
REQUIRED = ("v1", "m1", "m2", "E", "nu")

# what else a key might be called
WORDS = {
    "restitution": "e", "cor": "e", "mass1": "m1", "mass2": "m2", "speed1": "v1", "speed2": "v2",
    "velocity1": "v1", "velocity2": "v2", "radius1": "R1", "radius2": "R2", "stiffness": "K", "exponent": "n",
    "youngs_modulus": "E", "poisson": "nu", "poissons_ratio": "nu", "density": "rho",
}  # fmt: skip


OWN_K = Quantity("N/m^n", "stiffness of this law, in place of the sweep's", least=0, above=True)


def of_parameter(parameter: Parameter) -> Quantity:
    """What a model's parameter has to be."""
    return Quantity(parameter.unit, parameter.meaning, parameter.least, parameter.most)


def own_quantities(model: ForceModel) -> dict[str, Quantity]:
    """What [model.KEY] may hold: the parameters, and K of a law that has an exponent of its own."""
    stiffness = {} if model.exponent is None else {"K": OWN_K}
    return stiffness | {one.name: of_parameter(one) for one in model.parameters}


def expand_models(asked: object, catalogue: Mapping[str, ForceModel]) -> tuple[list[ForceModel], list[Fault]]:
    """The models of a key, "all", "family:NAME", a glob or a list of those, less those after "!"; and faults."""
    if not isinstance(asked, str | list) or not asked:
        return [], list(refuse(asked, 'a model, or a list of models; "all" are all').faults)
    found: dict[str, ForceModel] = {}
    faults: list[Fault] = []
    for place, word in enumerate([asked] if isinstance(asked, str) else asked):
        try:
            if isinstance(word, str) and word.startswith("!"):
                _leave_out(found, word, catalogue)
            else:
                found |= _models(word, catalogue)
        except Problem as problem:
            faults += problem.faults if isinstance(asked, str) else problem.under(place)
            if len(faults) >= MAX_FAULTS:
                break
    if not found and not faults:
        faults = list(refuse(asked, "models that are not all left out again").faults)
    return list(found.values()), faults


def _leave_out(found: dict[str, ForceModel], word: str, catalogue: Mapping[str, ForceModel]) -> None:
    """Take the models of "!..." out of those found before it."""
    try:
        out = _models(word[1:], catalogue)
    except Problem as problem:
        raise Problem(*((path, f"after !: {said}") for path, said in problem.faults)) from None
    if found.keys().isdisjoint(out):
        raise refuse(word, "models to leave out of those before it")
    for key in out:
        found.pop(key, None)


def _models(word: object, catalogue: Mapping[str, ForceModel]) -> dict[str, ForceModel]:
    if not isinstance(word, str):
        raise refuse(word, "the name of a model")
    # a law is not run twice because it has two names
    laws = {key: model for key, model in catalogue.items() if not model.same_as}
    if word == "all":
        return {key: model for key, model in laws.items() if key in built_in()}
    if word.startswith("family:"):
        family = word.removeprefix("family:")
        members = {key: model for key, model in laws.items() if model.family == family}
        families = sorted({model.family for model in laws.values()})
        if not members:
            raise refuse(word, f"a family of models; {nearest(family, families)}")
        return members
    if any(letter in word for letter in "*?["):
        matching = {key: model for key, model in catalogue.items() if fnmatchcase(key, word[:MAX_UNIT])}
        if not matching:
            raise refuse(word, "a pattern that some model matches")
        return matching
    if word not in catalogue:
        raise refuse(word, f"a model; {nearest(word, list(catalogue))}")
    return {word: catalogue[word]}


def cross_faults(data: Mapping[str, object], models: Sequence[ForceModel], n: float | None) -> Iterable[Fault]:
    """What is wrong between the keys, judged by which of them are given, so that other faults hide nothing.

    Parameters
    ----------
    data : the config as it was read
    models : the models chosen
    n : the sweep's exponent; None where it is an axis, NaN where it is not known
    """
    given = data.get("sweep")
    if isinstance(given, dict):
        yield from _restitution(given, models)
        yield from _stiffness(given, _table(data.get("model")), models, n, data.get("models"))
        yield from _materials(given, _table(data.get("model")), models)
        yield from _yield_strengths(given, data.get("materials"), models)
        yield from _densities(given, _table(data.get("model")), data.get("materials"), models)
    own, asked = _table(data.get("model")), data.get("models")
    for model in models:
        table = _table(own.get(model.key))
        for parameter in model.parameters:
            if parameter.default is None and parameter.name not in table:
                about = f"missing, wants {of_parameter(parameter).wants}: {parameter.meaning}"
                yield ("model", model.key, parameter.name), about + _or_without(model, models, asked)


def _or_without(model: ForceModel, models: Sequence[ForceModel], asked: object) -> str:
    """How to leave out a model that was not named, but came with others."""
    named = model.key == asked or (isinstance(asked, list) and model.key in asked)
    return "" if named or len(models) == 1 else f'; or models = [..., "!{model.key}"]'


def _table(value: object) -> Mapping[str, object]:
    return value if isinstance(value, dict) else {}


def _asking(models: Sequence[ForceModel], *quantities: str) -> str:
    """The models that depend on one of the quantities, in words; empty if none does."""
    keys = [model.key for model in models if not model.quantities.isdisjoint(quantities)]
    more = f" and {len(keys) - 3} more" if len(keys) > 3 else ""
    return ", ".join(keys[:3]) + more


def _restitution(given: Mapping[str, object], models: Sequence[ForceModel]) -> Iterable[Fault]:
    if "e" in given and "alpha" in given:
        yield ("sweep", "alpha"), "given beside e, wants one of the two"
    asking = _asking(models, "e")
    if asking and "e" not in given and "alpha" not in given:
        yield ("sweep", "e"), f"missing, wants e or alpha (asked for by {asking}), or other models"


def _stiffness(
    given: Mapping[str, object],
    own: Mapping[str, object],
    models: Sequence[ForceModel],
    n: float | None,
    asked: object,
) -> Iterable[Fault]:
    if "K" not in given or (n is not None and math.isnan(n)):
        return
    groups = given.get("zip")
    together = [group for group in groups if isinstance(group, list)] if isinstance(groups, list) else []
    if n is None and not any("K" in group and "n" in group for group in together):
        yield (
            ("sweep", "K"),
            "its unit N/m^n depends on n, which is an axis; wants one K for each n, zipped with it",
        )
    for model in models:
        if model.exponent is not None and model.exponent != n and "K" not in _table(own.get(model.key)):
            sweep = "an axis n" if n is None else f"n = {n:g}"
            # the sweep's n serves all laws unless another one has a different exponent
            serves = n is not None and {one.exponent for one in models} <= {None, model.exponent}
            remedy = f"n = {model.exponent:g} under [sweep], " if serves else ""
            yield (
                ("sweep", "K"),
                f"got a stiffness for {sweep}, but {model.key} has n = {model.exponent:g}; "
                f"expected {remedy}K under [model.{model.key}], or no K{_or_without(model, models, asked)}",
            )


def _materials(
    given: Mapping[str, object], own: Mapping[str, object], models: Sequence[ForceModel]
) -> Iterable[Fault]:
    single = [name for name in ("material1", "material2") if name in given]
    if "material" in given:
        for name in single:
            yield ("sweep", name), "given beside material, wants either material, or material1 and material2"
    elif len(single) == 1:
        other = "material2" if single == ["material1"] else "material1"
        yield ("sweep", other), f"missing beside {single[0]}; material is for both balls"
    elif not single:
        of_material = {"E1", "E2", "nu1", "nu2", "yield_strength1", "yield_strength2"}
        of_material |= {name for name in ("R1", "R2") if name not in given}
        asking = _asking(models, *of_material)
        # a rule of the law's own may do without
        by_material = [model for model in models if of_material & {*wishes(model.stiffness or hertz_stiffness)}]
        if "K" not in given and not (models and all("K" in _table(own.get(one.key)) for one in by_material)):
            yield ("sweep", "material"), "missing, wants a material of [materials], or K"
        elif asking:
            yield ("sweep", "material"), f"missing, wants a material of [materials] (asked for by {asking})"


def _yield_strengths(
    given: Mapping[str, object], materials: object, models: Sequence[ForceModel]
) -> Iterable[Fault]:
    reported: set[str] = set()
    for ball in ("1", "2"):
        asking = _asking(models, f"yield_strength{ball}")
        for name in _without(given, materials, ball, "yield_strength") if asking else ():
            if name not in reported:
                reported.add(name)
                wants = MATERIAL["yield_strength"].wants
                yield ("materials", name, "yield_strength"), f"missing, wants {wants} (asked for by {asking})"


def _densities(
    given: Mapping[str, object], own: Mapping[str, object], materials: object, models: Sequence[ForceModel]
) -> Iterable[Fault]:
    """The materials whose density is missing though a radius is derived from it and a mass."""
    radii: dict[str, list[str]] = {}
    keys: dict[str, None] = {}
    for ball in ("1", "2"):
        radius = f"R{ball}"
        asking = [model.key for model in models if radius in _depends_on(model, given, own)]
        if asking and radius not in given:
            keys |= dict.fromkeys(asking)
            for name in _without(given, materials, ball, "rho"):
                radii.setdefault(name, []).append(radius)
    for name, missing in radii.items():
        need = f"{next(iter(keys))} needs a radius" if len(keys) == 1 else f"{len(keys)} models need a radius"
        expected = f"a number > 0 {MATERIAL['rho'].unit}, or {' and '.join(missing)} under [sweep]"
        yield ("materials", name, "rho"), f"missing, expected {expected}: {need}"


def _depends_on(model: ForceModel, given: Mapping[str, object], own: Mapping[str, object]) -> set[str]:
    """The quantities that a model needs in a sweep, those that its stiffness is derived from among them."""
    has_stiffness = "K" in given or "K" in _table(own.get(model.key))
    derived = () if has_stiffness else wishes(model.stiffness or hertz_stiffness)
    return {*quantities_of(model), *model.domain, *derived}


def _without(given: Mapping[str, object], materials: object, ball: str, key: str) -> Iterable[str]:
    """The materials of a ball whose table lacks a key."""
    named = given.get("material", given.get(f"material{ball}", []))
    for name in named if isinstance(named, list) else [named]:
        table = _table(materials).get(name) if isinstance(name, str) else None
        if isinstance(table, dict) and key not in table:
            yield str(name)
