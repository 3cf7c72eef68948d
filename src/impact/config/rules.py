"""Conditions between the keys of a config."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from ..contact.dimensionless import required_quantities
from ..contact.fixed_step import EXACT, SCHEMES, friction_problem, has_scheme, law_problem
from ..contact.formula_calls import argument_names
from ..contact.friction import parameter_problem, required_inputs
from ..contact.frictions import frictions
from ..contact.materials import hertz_stiffness
from ..contact.model import ForceModel, with_base_quantities
from ..formatting import argument
from .draft import STARTER, Draft, listed_names
from .files import as_table
from .input_names import input_values
from .quantities import ConfigProblem, KeyPath, Quantity
from .tables import FIXED_STEP_INPUTS, MATERIAL_QUANTITIES, OBLIQUE_INPUTS, SWEEP_DEFAULTS, SWEEP_QUANTITIES

# laws that a message names; more that a pattern selected share one line
MAX_LAWS = 3


def has_other_stiffness(draft: Draft, model: ForceModel) -> bool:
    """Whether K of [sweep] has another unit than that of a model, because the model has its own exponent."""
    return model.exponent not in (None, draft.exponent) and f"{model.key}.K" not in draft.input_names


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


def _first(keys: Sequence[str]) -> str:
    """Name the first of some laws, and count the others."""
    more = f" and {len(keys) - MAX_LAWS} more" if len(keys) > MAX_LAWS else ""
    return ", ".join(keys[:MAX_LAWS]) + more


def _models_using(draft: Draft, *quantities: str) -> str:
    """Name the models that depend on any of the quantities; empty if none does."""
    return _first([m.key for m in draft.models if not with_base_quantities(m.quantities).isdisjoint(quantities)])


def _without_named(draft: Draft, keys: Iterable[str]) -> list[str]:
    """Keep the models that "all", a family or a pattern selected."""
    named = listed_names(draft.data.get("models"))
    return [key for key in keys if key not in named]


def _exclusion_hint(draft: Draft, model: ForceModel) -> str:
    """Describe how to exclude a model that "all", a family or a pattern selected; empty for a named model."""
    is_selected = _without_named(draft, [model.key]) and len(draft.models) > 1
    return f'; or models = [..., "!{model.key}"]' if is_selected else ""


def _models_without(draft: Draft, keys: Sequence[str]) -> str:
    """Write the models of the config without some that "all", a family or a pattern selected."""
    names = [*listed_names(draft.data.get("models")), *(f"!{key}" for key in keys)]
    return "models = [" + ", ".join(f'"{name}"' for name in names) + "]"


def _vary_together(draft: Draft, *names: str) -> bool:
    """Whether inputs of [sweep] are members of one zip group, of the cases or of the measurements."""
    columns = [str(name) for name, _ in input_values(draft.data) if name.path in draft.columns]
    groups = (*draft.zip_groups, columns, as_table(draft.table("sweep").get("cases")))
    return any({*names} <= {*group} for group in groups)


def _numbers(draft: Draft, name: str) -> Sequence[float]:
    """List the numbers of an input of [sweep]: none if it is missing, NaN for those that are not listed."""
    if draft.measurements is not None and name in draft.measurements.inputs:
        return draft.measurements.inputs[name]
    value = draft.table("sweep").get(name, [])
    return [SWEEP_QUANTITIES[name].read_or_nan(each) for each in (value if isinstance(value, list) else [value])]


def _has_finite(draft: Draft, name: str) -> bool:
    """Whether a mass or a radius is that of a sphere at any value: it then has a density."""
    return not all(map(math.isinf, _numbers(draft, name)))


def check_rules(draft: Draft) -> Draft:
    """Add the problems of all rules."""
    if not isinstance(draft.data.get("sweep"), dict):
        return draft
    draft = draft.with_problems(problem for rule in RULES for problem in rule(draft))
    if "cases" in draft.table("sweep") or ("data" in draft.data and draft.measurements is None):
        # cases and measurements that cannot be read may contain the inputs that seem to be missing
        problems = tuple(problem for problem in draft.problems if not problem[1].startswith("missing"))
        return replace(draft, problems=problems)
    return draft


def _missing(quantity: Quantity) -> str:
    return f"missing, expected {quantity.expected}: {quantity.meaning}"


def _speed_and_restitution_problems(draft: Draft) -> Iterable[ConfigProblem]:
    sweep = draft.table("sweep")
    if {"v1", "speed"}.isdisjoint(sweep):
        yield ("sweep", "v1"), _missing(SWEEP_QUANTITIES["v1"])
    if "e" in sweep and "alpha" in sweep:
        yield ("sweep", "alpha"), "set together with e, expected one of the two"
    users = _models_using(draft, "e")
    if users and "e" not in sweep and "alpha" not in sweep:
        yield ("sweep", "e"), f"missing, expected e or alpha (used by {users}), or other models"


def _stiffness_problems(draft: Draft) -> Iterable[ConfigProblem]:
    sweep, n = draft.table("sweep"), draft.exponent
    if "K" not in sweep or (n is not None and math.isnan(n)):
        return
    value = sweep.get("n")
    is_axis = isinstance(value, list) or (isinstance(value, dict) and "fit" not in value)
    if is_axis and not _vary_together(draft, "K", "n"):
        expected = "expected one K for each n, zipped with it"
        yield ("sweep", "K"), f"its unit N/m^n depends on n, which is an axis; {expected}"
    got = f"got a stiffness for {'an axis n' if n is None else f'n = {n:g}'}, but"
    # setting n of the sweep helps unless two models have different fixed exponents
    fixed = {model.exponent for model in draft.models} - {None}
    remedy = f"n = {fixed.pop():g} under [sweep], " if n is not None and len(fixed) == 1 else ""
    others = {model.key: model for model in draft.models if has_other_stiffness(draft, model)}
    if len(keys := _without_named(draft, others)) > MAX_LAWS:
        expected = f"{remedy}K under [model.KEY] of each, or no K; or {_models_without(draft, keys)}"
        yield ("sweep", "K"), f"{got} {_first(keys)} have another n; expected {expected}"
        others = {key: model for key, model in others.items() if key not in keys}
    for key, model in others.items():
        expected = f"{remedy}K under [model.{key}], or no K{_exclusion_hint(draft, model)}"
        yield ("sweep", "K"), f"{got} {key} has n = {model.exponent:g}; expected {expected}"


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
        has_stiffness = draft.models and all(_has_stiffness(draft, model) for model in by_material)
        if "K" not in sweep and not has_stiffness:
            yield ("sweep", "material"), "missing, expected a material of [materials], or K"
        elif users:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (used by {users})"


def _yield_strength_problems(draft: Draft) -> Iterable[ConfigProblem]:
    users_of: dict[str, str] = {}
    for ball in ("1", "2"):
        users = _models_using(draft, f"yield_strength{ball}")
        for name in _materials_without(draft, ball, "yield_strength") if users else ():
            users_of.setdefault(name, users)
    expected = f"missing, expected {MATERIAL_QUANTITIES['yield_strength'].expected}"
    for name, users in users_of.items():
        yield ("materials", name, "yield_strength"), f"{expected} (used by {users}), or other models"


def _mass_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a missing mass can be derived from a radius and a density."""
    sweep = draft.table("sweep")
    for ball in ("1", "2"):
        mass, radius = f"m{ball}", f"R{ball}"
        if mass in sweep:
            continue
        if radius not in sweep or not {"material", f"material{ball}"} & sweep.keys():
            yield ("sweep", mass), f"{_missing(SWEEP_QUANTITIES[mass])}; or {radius} and a material with rho"
        for name in _materials_without(draft, ball, "rho") if _has_finite(draft, radius) else ():
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
        if users and radius not in sweep and _has_finite(draft, f"m{ball}"):
            keys |= dict.fromkeys(users)
            for name in _materials_without(draft, ball, "rho"):
                radii.setdefault(name, []).append(radius)
    for name, missing in radii.items():
        need = f"{next(iter(keys))} needs a radius" if len(keys) == 1 else f"{len(keys)} models need a radius"
        expected = f"{MATERIAL_QUANTITIES['rho'].expected}, or {' and '.join(missing)} under [sweep]"
        yield ("materials", name, "rho"), f"missing, expected {expected}: {need}"


def _parameter_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that parameters without a default are set; of many laws that a name selected in one line."""
    missing = [*draft.missing_parameters]
    of_models = {name.model: name.key for name in missing if name.model}
    if len(selected := _without_named(draft, of_models)) > MAX_LAWS:
        laws = _first([f"{key} ({of_models[key]})" for key in selected])
        expected = f"it under [model.KEY] of each; or {_models_without(draft, selected)}"
        yield ("models",), f"a parameter is missing, of {laws}; expected {expected}"
        missing = [name for name in missing if name.model not in selected]
    for name in missing:
        quantity, model = name.quantity(draft.known_models), draft.known_models.get(name.model)
        assert quantity is not None
        yield name.path, _missing(quantity) + ("" if model is None else _exclusion_hint(draft, model))


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
        expected = 'frictions as well, such as frictions = ["coulomb-1785"]'
        # an impact without a config has only arguments
        expected = argument("friction", "KEY") if draft.name == STARTER else expected
        inputs = [("sweep", name) for name in OBLIQUE_INPUTS if name in sweep]
        parameters = [("friction", key) for key in draft.table("friction")]
        yield from ((path, f"set without a friction law, expected {expected}") for path in (*inputs, *parameters))
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
    if isinstance(integrator, str) and integrator in SCHEMES:
        path: KeyPath = ("solver", "integrator")
    elif integrator == EXACT and not draft.has_own_scheme:
        path = ("frictions",)
    else:
        return
    problems = (friction_problem(law.key, law.kind, integrator, law.scheme) for law in draft.frictions)
    yield from ((path, problem) for problem in problems if problem)


def _spin_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check that a ball with a spin has a radius, and is neither a wall nor a plane."""
    sweep = draft.table("sweep")
    for ball in ("1", "2"):
        spin, mass, radius = (f"{name}{ball}" for name in ("omega", "m", "R"))
        spins = _numbers(draft, spin)
        if not any(spins):
            continue
        bodies = [body for name, body in ((mass, "wall"), (radius, "plane")) if _is_turning(draft, spin, name)]
        if bodies:
            message = f"got the spin of a {bodies[0]}, which does not turn, expected none"
            yield ("sweep", spin), message
            continue
        has_material = bool({"material", f"material{ball}"} & sweep.keys()) and mass in sweep
        without_density = list(_materials_without(draft, ball, "rho")) if has_material else []
        if radius not in sweep and (not has_material or without_density):
            message = f"{_missing(SWEEP_QUANTITIES[radius])}, which its spin needs; or a material with rho"
            yield ("sweep", radius), message


def _is_turning(draft: Draft, spin: str, size: str) -> bool:
    """Whether a ball has a spin where its mass or its radius is infinite."""
    spins, sizes = _numbers(draft, spin), _numbers(draft, size)
    if len(spins) == len(sizes) and _vary_together(draft, spin, size):
        return any(omega and math.isinf(value) for omega, value in zip(spins, sizes, strict=True))
    return any(map(math.isinf, sizes))


def _friction_problems(draft: Draft) -> Iterable[ConfigProblem]:
    """Check the parameters of friction laws, and the inputs that they need."""
    sweep = draft.table("sweep")
    exponents = {n for model in draft.models for n in _exponents(draft, model)}
    has_material = "material" in sweep or {"material1", "material2"} <= sweep.keys()
    for law in draft.frictions:
        given = as_table(draft.table("friction").get(law.key)).keys()
        problems = (
            parameter_problem(law, given, n=n, has_stiffness=_has_stiffness(draft, model))
            for model in draft.models
            for n in _exponents(draft, model)
        )
        if problem := next(filter(None, problems), ""):
            name, _, message = problem.partition(": ")
            yield ("friction", law.key, name), message
        needed = required_inputs(law, given, exponents)
        if "e" in needed and {"e", "alpha"}.isdisjoint(sweep):
            yield ("sweep", "e"), f"missing, expected e or alpha (used by {law.key}), or other frictions"
        if "E1" in needed and not has_material and not problem:
            yield ("sweep", "material"), f"missing, expected a material of [materials] (used by {law.key})"
    selected = {law.key for law in draft.frictions}
    # a setting that selects other friction laws does not have to remove the tables of the config
    others = [] if not selected or ("frictions",) in draft.origins else draft.table("friction").keys() - selected
    for key in sorted(others & frictions().keys()):
        yield ("friction", key), "set for a friction law that is not among frictions, expected it there as well"


def _exponents(draft: Draft, model: ForceModel) -> Sequence[float]:
    """List the exponents n of a model, NaN for those that are not listed."""
    if model.exponent is not None:
        return (model.exponent,)
    return _numbers(draft, "n") or (SWEEP_DEFAULTS["n"],)


def _has_stiffness(draft: Draft, model: ForceModel) -> bool:
    """Whether the config has the K of a model."""
    return not {"K", f"{model.key}.K"}.isdisjoint(draft.input_names)


def _stiffness_arguments(model: ForceModel) -> frozenset[str]:
    """List the quantities from which the stiffness of a model is derived if the config has no K."""
    return with_base_quantities(argument_names(model.stiffness or hertz_stiffness))


def _depends_on(model: ForceModel, draft: Draft) -> set[str]:
    """List the quantities that a model needs in a sweep, including those of its stiffness."""
    stiffness = () if _has_stiffness(draft, model) else _stiffness_arguments(model)
    return {*with_base_quantities(required_quantities(model)), *model.domain, *stiffness}


RULES = (
    _speed_and_restitution_problems,
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
