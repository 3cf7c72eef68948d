"""Conditions between the keys of a config."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

from ..contact.dimensionless import required_quantities
from ..contact.fixed_step import EXACT, SCHEMES, has_scheme, law_problem
from ..contact.formula_calls import argument_names
from ..contact.friction import parameter_problem, required_inputs
from ..contact.materials import hertz_stiffness
from ..contact.model import ForceModel, with_base_quantities
from .draft import Draft, listed_names
from .files import as_table
from .quantities import ConfigProblem, Quantity, as_text
from .tables import FIXED_STEP_INPUTS, MATERIAL_QUANTITIES, OBLIQUE_INPUTS, SWEEP_QUANTITIES, law_quantities


def _sets_stiffness(draft: Draft, model: ForceModel) -> bool:
    """Whether [model.KEY] has a K."""
    return "K" in as_table(draft.table("model").get(model.key))


def has_other_stiffness(draft: Draft, model: ForceModel) -> bool:
    """Whether K of [sweep] has another unit than that of a model, because the model has its own exponent."""
    return model.exponent not in (None, draft.exponent) and not _sets_stiffness(draft, model)


def materials_of(draft: Draft, ball: str) -> list[str]:
    """List the names of the materials that a ball, "1" or "2", may have."""
    sweep = draft.table("sweep")
    return listed_names(sweep.get("material", sweep.get(f"material{ball}")))


def _materials_without(draft: Draft, ball: str, key: str) -> Iterator[str]:
    """List the materials of a ball whose tables lack a key."""
    for name in materials_of(draft, ball):
        table = draft.table("materials").get(name)
        if isinstance(table, dict) and key not in table:
            yield name


def _models_using(draft: Draft, *quantities: str) -> str:
    """Name the models that depend on any of the quantities; empty if none does."""
    keys = [m.key for m in draft.models if not with_base_quantities(m.quantities).isdisjoint(quantities)]
    more = f" and {len(keys) - 3} more" if len(keys) > 3 else ""
    return ", ".join(keys[:3]) + more


def _exclusion_hint(draft: Draft, model: ForceModel) -> str:
    """Describe how to exclude a model that "all", a family or a pattern selected; empty for a named model."""
    is_named = model.key in listed_names(draft.data.get("models"))
    return "" if is_named or len(draft.models) == 1 else f'; or models = [..., "!{model.key}"]'


def check_rules(draft: Draft) -> Draft:
    """Add the problems of all rules."""
    if not isinstance(draft.data.get("sweep"), dict):
        return draft
    for rule in RULES:
        draft = draft.with_problems(tuple(rule(draft)))
    if "cases" in draft.table("sweep") or ("data" in draft.data and draft.measurements is None):
        # cases and measurements that cannot be read may contain the inputs that seem to be missing
        problems = tuple(problem for problem in draft.problems if not problem[1].startswith("missing"))
        return replace(draft, problems=problems)
    return draft


def _missing(quantity: Quantity) -> str:
    return f"missing, expected {quantity.expected}: {quantity.meaning}"


def _velocity_problems(draft: Draft) -> Iterable[ConfigProblem]:
    if {"v1", "speed"}.isdisjoint(draft.table("sweep")):
        yield ("sweep", "v1"), _missing(SWEEP_QUANTITIES["v1"])


def _restitution_problems(draft: Draft) -> Iterable[ConfigProblem]:
    sweep = draft.table("sweep")
    if "e" in sweep and "alpha" in sweep:
        yield ("sweep", "alpha"), "set together with e, expected one of the two"
    users = _models_using(draft, "e")
    if users and "e" not in sweep and "alpha" not in sweep:
        yield ("sweep", "e"), f"missing, expected e or alpha (used by {users}), or other models"


def _stiffness_problems(draft: Draft) -> Iterable[ConfigProblem]:
    sweep, n = draft.table("sweep"), draft.exponent
    if "K" not in sweep or (n is not None and math.isnan(n)):
        return
    groups = sweep.get("zip")
    together = [group for group in groups if isinstance(group, list)] if isinstance(groups, list) else []
    together.append(sweep.get("cases") or [])
    value = sweep.get("n")
    is_axis = isinstance(value, list) or (isinstance(value, dict) and "fit" not in value)
    if is_axis and not any("K" in group and "n" in group for group in together):
        yield (
            ("sweep", "K"),
            "its unit N/m^n depends on n, which is an axis; expected one K for each n, zipped with it",
        )
    for model in draft.models:
        if has_other_stiffness(draft, model):
            exponent = "an axis n" if n is None else f"n = {n:g}"
            # setting n of the sweep helps unless two models have different fixed exponents
            serves = n is not None and {other.exponent for other in draft.models} <= {None, model.exponent}
            remedy = f"n = {model.exponent:g} under [sweep], " if serves else ""
            yield (
                ("sweep", "K"),
                f"got a stiffness for {exponent}, but {model.key} has n = {model.exponent:g}; "
                f"expected {remedy}K under [model.{model.key}], or no K{_exclusion_hint(draft, model)}",
            )


def _material_problems(draft: Draft) -> Iterable[ConfigProblem]:
    sweep = draft.table("sweep")
    single = [name for name in ("material1", "material2") if name in sweep]
    if "material" in sweep:
        message = "set together with material, expected either material, or material1 and material2"
        yield from ((("sweep", name), message) for name in single)
    elif len(single) == 1:
        other = "material2" if single == ["material1"] else "material1"
        yield ("sweep", other), f"missing, expected both, as {single[0]} is set; or material for both balls"
    elif not single:
        of_material = {"E1", "E2", "nu1", "nu2", "yield_strength1", "yield_strength2"}
        of_material |= {name for name in ("R1", "R2") if name not in sweep}
        users = _models_using(draft, *of_material)
        # the stiffness of some models needs no material
        by_material = [model for model in draft.models if of_material & _stiffness_arguments(model)]
        has_stiffness = draft.models and all(_sets_stiffness(draft, model) for model in by_material)
        if "K" not in sweep and not has_stiffness:
            yield ("sweep", "material"), "missing, expected a material of [materials], or K"
        elif users:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (used by {users})"


def _yield_strength_problems(draft: Draft) -> Iterable[ConfigProblem]:
    reported: set[str] = set()
    for ball in ("1", "2"):
        users = _models_using(draft, f"yield_strength{ball}")
        for name in _materials_without(draft, ball, "yield_strength") if users else ():
            if name not in reported:
                reported.add(name)
                expected = MATERIAL_QUANTITIES["yield_strength"].expected
                yield ("materials", name, "yield_strength"), f"missing, expected {expected} (used by {users})"


def _mass_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a missing mass can be derived from a radius and a density."""
    sweep = draft.table("sweep")
    for ball in ("1", "2"):
        mass, radius = f"m{ball}", f"R{ball}"
        if mass in sweep:
            continue
        if radius not in sweep or not {"material", f"material{ball}"} & sweep.keys():
            yield ("sweep", mass), f"{_missing(SWEEP_QUANTITIES[mass])}; or {radius} and a material with rho"
        for name in _materials_without(draft, ball, "rho") if radius in sweep else ():
            expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {mass} under [sweep]"
            yield ("materials", name, "rho"), f"missing, expected {expected}: the mass of ball {ball} is not set"


def _radius_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a missing radius can be derived from a mass and a density."""
    sweep = draft.table("sweep")
    radii: dict[str, list[str]] = {}
    keys: dict[str, None] = {}
    for ball in ("1", "2"):
        radius = f"R{ball}"
        users = [model.key for model in draft.models if radius in _depends_on(model, draft)]
        if users and radius not in sweep and f"m{ball}" in sweep:
            keys |= dict.fromkeys(users)
            for name in _materials_without(draft, ball, "rho"):
                radii.setdefault(name, []).append(radius)
    for name, missing in radii.items():
        need = f"{next(iter(keys))} needs a radius" if len(keys) == 1 else f"{len(keys)} models need a radius"
        expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {' and '.join(missing)} under [sweep]"
        yield ("materials", name, "rho"), f"missing, expected {expected}: {need}"


def _parameter_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that parameters without a default are set."""
    for model in draft.models:
        table = as_table(draft.table("model").get(model.key))
        for parameter in model.parameters:
            if parameter.default is None and parameter.name not in table:
                message = _missing(law_quantities(model)[parameter.name])
                yield ("model", model.key, parameter.name), message + _exclusion_hint(draft, model)


def _fixed_step_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a scheme has one fixed step, given in either of two ways, and the continuous law none."""
    sweep, integrator = draft.table("sweep"), draft.table("solver").get("integrator", EXACT)
    if integrator == EXACT:
        message = f'set with solver.integrator = "{EXACT}", which has no fixed step'
        message += f', expected solver.integrator = "{next(iter(SCHEMES))}" as well'
        yield from ((("sweep", name), message) for name in FIXED_STEP_INPUTS if name in sweep)
    elif isinstance(integrator, str) and integrator in SCHEMES:
        for model in draft.models:
            n = model.exponent or draft.exponent
            # an exponent that is an axis has values that the scheme does not take
            if not has_scheme(model, math.nan if n is None else n, integrator):
                yield ("solver", "integrator"), law_problem(model, integrator)
                break
        given = [name for name in ("steps_per_contact", "dt") if name in sweep]
        if len(given) == 2:
            yield ("sweep", "dt"), "set together with steps_per_contact, expected one of the two"
        elif not given:
            name = "steps_per_contact"
            yield ("sweep", name), f"{_missing(SWEEP_QUANTITIES[name])}; or dt"


def _oblique_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that inputs of oblique impacts have friction laws, and these their inputs."""
    sweep = draft.table("sweep")
    if "frictions" not in draft.data:
        expected = 'expected frictions as well, such as frictions = ["coulomb-1785"]'
        yield from (
            (("sweep", name), f"set without a friction law, {expected}")
            for name in OBLIQUE_INPUTS
            if name in sweep
        )
        yield from (
            (("friction", key), f"set without a friction law, {expected}") for key in draft.table("friction")
        )
        return
    if "mu" not in sweep:
        yield ("sweep", "mu"), _missing(SWEEP_QUANTITIES["mu"])
    if "speed" in sweep and "angle" not in sweep:
        yield ("sweep", "angle"), f"{_missing(SWEEP_QUANTITIES['angle'])}; or v1 and u1 in place of speed"
    for name, others in (("angle", ("u1",)), ("speed", ("v1", "u1", "u2"))):
        for other in others if name in sweep else ():
            if other in sweep and not (other == "u1" and {"angle", "speed"} <= sweep.keys() and name == "speed"):
                yield ("sweep", other), f"set together with {name}, expected one of the two"
    integrator = draft.table("solver").get("integrator", EXACT)
    if integrator != EXACT:
        message = f'got {as_text(integrator)}, expected "{EXACT}" with frictions, which have no fixed step'
        yield ("solver", "integrator"), message


def _spin_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a ball with a spin has a radius, and is neither a wall nor a plane."""
    sweep = draft.table("sweep")
    for ball in ("1", "2"):
        spin = sweep.get(f"omega{ball}")
        if spin is None or spin in (0, 0.0):
            continue
        bodies = ((f"m{ball}", "wall"), (f"R{ball}", "plane"))
        body = next((body for name, body in bodies if sweep.get(name) in (math.inf, "inf")), "")
        if body:
            yield ("sweep", f"omega{ball}"), f"got the spin of a {body}, which does not turn, expected none"
            continue
        has_material = bool({"material", f"material{ball}"} & sweep.keys()) and f"m{ball}" in sweep
        without_density = list(_materials_without(draft, ball, "rho")) if has_material else []
        if f"R{ball}" not in sweep and (not has_material or without_density):
            message = f"{_missing(SWEEP_QUANTITIES[f'R{ball}'])}, which its spin needs; or a material with rho"
            yield ("sweep", f"R{ball}"), message


def _friction_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check the parameters of friction laws, and the inputs that they need."""
    sweep = draft.table("sweep")
    exponents = {model.exponent or draft.exponent or math.nan for model in draft.models}
    has_stiffness = "K" in sweep or any(_sets_stiffness(draft, model) for model in draft.models)
    has_material = "material" in sweep or {"material1", "material2"} <= sweep.keys()
    for law in draft.frictions:
        given = as_table(draft.table("friction").get(law.key)).keys()
        problem = parameter_problem(law, given, n=min(exponents, default=None), has_stiffness=has_stiffness)
        if problem:
            name, _, message = problem.partition(": ")
            yield ("friction", law.key, name), message
        for parameter in law.parameters:
            if parameter.default is None and not parameter.optional and parameter.name not in given:
                yield ("friction", law.key, parameter.name), _missing(law_quantities(law)[parameter.name])
        needed = required_inputs(law, given, exponents)
        if "e" in needed and {"e", "alpha"}.isdisjoint(sweep):
            yield ("sweep", "e"), f"missing, expected e or alpha (used by {law.key}), or other frictions"
        if "E1" in needed and not has_material and not problem:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (used by {law.key})"


def _stiffness_arguments(model: ForceModel) -> frozenset[str]:
    """List the quantities from which the stiffness of a model is derived if the config has no K."""
    return with_base_quantities(argument_names(model.stiffness or hertz_stiffness))


def _depends_on(model: ForceModel, draft: Draft) -> set[str]:
    """List the quantities that a model needs in a sweep, including those of its stiffness."""
    has_stiffness = "K" in draft.table("sweep") or _sets_stiffness(draft, model)
    stiffness = () if has_stiffness else _stiffness_arguments(model)
    return {*with_base_quantities(required_quantities(model)), *model.domain, *stiffness}


RULES = (
    _velocity_problems,
    _restitution_problems,
    _stiffness_problems,
    _material_problems,
    _yield_strength_problems,
    _mass_problems,
    _radius_problems,
    _parameter_problems,
    _fixed_step_problems,
    _oblique_problems,
    _spin_problems,
    _friction_problems,
)
