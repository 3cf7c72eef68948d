"""A law and an impact, as a version of a code simulates them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..config.draft import Overrides, Setting
from ..config.load import Config
from ..config.tables import SWEEP_QUANTITIES
from ..contact.friction import Pair
from ..contact.frictions import find_friction
from ..contact.impacts import INPUTS, Impacts
from ..contact.model import ForceModel
from ..contact.models import find, original_key
from ..engine.inputs import build_impacts
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..errors import UsageError, did_you_mean
from ..formatting import argument, law_keys, number, quantity
from ..inverse.timestep import FixedStepLaw, first_values_line, law_at_point
from ..results.calibration import position_of_law, unidentified_notes
from ..results.single_impact import Calibration, ConfigSource, PointSource, open_source
from .code import Code, Collision
from .registry import first_law, has_law, law_of_code

# phases over which the mean, the least and the largest restitution are taken
PHASES = 400
# steps before the contact, and contact times that a script runs at least
STEPS_BEFORE, CONTACTS_RUN = 3, 2.5
# a ball whose radius is not known and does not matter is larger than its peak indentation by this factor
RADIUS_PER_PEAK = 100.0
# the tangential inputs of a collision
OBLIQUE_VALUES = ("u1", "u2", "omega1", "omega2", "mu", "inertia_factor1", "inertia_factor2")


@dataclass(frozen=True)
class ExportProblem:
    """A law and an impact that are written for a version of a code.

    Parameters
    ----------
    law : the law, the impact and the contact time of the continuous law
    notes : where the law and its values come from: a release, a calibration, Table 1 of the paper, first values
    better_fit : a remark on the law of a calibration that fits best, where it is none of the code; else ""
    left_out : friction laws of the source, where the code has none of them
    other_law : a remark on a law that another one is written for; else ""
    """

    code: Code
    version: str
    law: FixedStepLaw
    notes: tuple[str, ...]
    better_fit: str
    left_out: tuple[str, ...]
    other_law: str

    @property
    def model(self) -> ForceModel:
        return self.law.model

    @property
    def has_wall(self) -> bool:
        """Whether ball 2 is a plane wall."""
        return self.law.replaced is not None

    @property
    def e_continuous(self) -> float:
        return self.law.continuous["e_out"]

    def collision(self, dt: float, phase: float) -> Collision:
        """Make the collision whose contact begins at a phase of a step dt [s]."""
        values = input_values(self.law.impact)
        for name in ("R1", "R2"):
            if math.isnan(values[name]):
                is_wall = name == "R2" and self.has_wall
                values[name] = math.inf if is_wall else RADIUS_PER_PEAK * self.law.continuous["peak_indentation"]
        oblique = self.law.oblique
        if oblique is not None:
            values |= {name: float(getattr(oblique, name).item()) for name in OBLIQUE_VALUES}
            values |= {name: float(value.item()) for name, value in oblique.parameters.items()}
        names = self.law.config.scalars
        duration = CONTACTS_RUN * self.law.contact_time
        if self.code.scheme is not None:
            # contacts with hardly any rebound may take longer at a step
            (times,) = self.law.outputs(np.array([dt]), "contact_time")
            duration = float(np.fmax.reduce(times + dt, axis=None, initial=duration))
        material1, material2 = (
            str(names.get(f"material{ball}", names.get("material", ""))) for ball in ("1", "2")
        )
        return Collision(
            model=self.model,
            version=self.version,
            values=values,
            materials=(material1, material2),
            has_user_stiffness="K" in names or f"{self.model.key}.K" in names,
            has_wall=self.has_wall,
            dt=dt,
            gap=(STEPS_BEFORE - phase) * dt * values["v0"],
            friction=self.law.friction,
            steps=STEPS_BEFORE + math.ceil(duration / dt),
        )


def input_values(impact: Impacts) -> dict[str, float]:
    """Return all inputs and derived quantities of one impact, by name, in SI."""
    names = [*INPUTS, "m", "R_eff", "E_eff", "v0", *impact.parameters]
    return {name: float(impact.quantity(name)[0]) for name in names}


def wall_inputs(config: Config, code: Code, version: str) -> Mapping[str, float] | None:
    """Find the inputs that a plane wall acts with in a code; None if ball 2 is no such wall."""
    values = input_values(build_impacts(Plan(config).inputs, config.models[0], ()))
    if math.isfinite(values["m2"]) or math.isfinite(values["R2"]):
        return None
    return code.wall_inputs(config.models[0].key, version, values)


def prepare_export(
    code: Code,
    model: str | None,
    version: str,
    source: ConfigSource,
    at: Mapping[str, object],
    overrides: Overrides,
    friction: str | None = None,
    plugins: Plugins | None = None,
) -> ExportProblem:
    """Choose the law, and reduce the source to one impact; the damping of a law without e is solved for."""
    opened = open_source(source, overrides, plugins or Plugins(()))
    point_source = replace(opened, config_draft=replace(opened.config_draft, has_own_scheme=True))
    notes = []
    if model is not None:
        key = law_of_code(code, model, version)
    elif models := point_source.models:
        key = first_law(code, models, version, is_fitted=point_source.calibration is not None)
    else:
        key, newest = (first_law(code, tuple(code.laws), release) for release in (version, code.newest))
        if key != newest:
            notes.append(f"release {version} lacks the default law of {code.newest}, {newest}")
    point_source = _with_parameters(point_source, key, code, version)
    chosen, left_out = _choose_friction(code, point_source, key, friction)
    scheme = (find_friction(chosen).scheme if chosen else "") or code.scheme
    fixed = law_at_point(
        point_source,
        find(key),
        at,
        PHASES,
        scheme,
        chosen,
        of_friction=chosen is not None,
        replacing=lambda config: wall_inputs(config, code, version),
    )
    if isinstance(fixed.law, Pair) and fixed.oblique is not None:
        # that of `coulomb-1785` is taken of any code
        law = fixed.law.friction
        for limit in (parameter for parameter in law.parameters if parameter.name == "limit"):
            if law.kind != "coulomb" and fixed.oblique.parameters["limit"].item() != limit.default:
                raise UsageError(f"friction.{law.key}.limit: {code.title} has only {law.default_limit}")
    better_fit = ""
    if calibration := point_source.calibration:
        better_fit, fit_notes = _fit_notes(code, version, key, calibration)
        notes += [better_fit, *fit_notes] if better_fit else fit_notes
    if point_source.is_starter and (defaults := _defaults(point_source, at, fixed.config)):
        notes.append(f"defaults of Table 1 of the paper: {', '.join(defaults)}")
    if fixed.first:
        notes.append(first_values_line(fixed.first))
    asked = [model] if model is not None else point_source.models
    named = next((name for name in asked if has_law(code, key, version, name)), key)
    # a code's own name is that of an option, whose law depends on the release
    is_other = named not in code.laws and original_key(named) != original_key(key)
    instead = f"{code.title} {version} has no {named}: {key} is written; see impact models {key}"
    return ExportProblem(code, version, fixed, tuple(notes), better_fit, left_out, instead if is_other else "")


def _with_parameters(source: PointSource, key: str, code: Code, version: str) -> PointSource:
    """Give a law the parameters that the source has for it under another name, or for that of another release."""
    draft = source.config_draft
    tables = draft.table("model")
    same = original_key(key)
    others = [name for name in tables if original_key(name) == same or has_law(code, key, version, name)]
    # a calibration renames the laws that were fitted
    if source.calibration is not None or key in others or not others:
        return source
    name = next((name for name in source.models if name in others), others[0])
    draft = draft.with_settings([Setting(("model", key), tables[name], f"model.{name}")])
    labels = {label.replace(f"{name}.", f"{key}."): value for label, value in source.labels.items()}
    return replace(source, config_draft=draft, labels=labels)


def _choose_friction(
    code: Code, source: PointSource, model: str, friction: str | None
) -> tuple[str | None, tuple[str, ...]]:
    """Choose the friction law that is asked for, or the first of the source that a code has; else list those."""
    known = [law for law in code.frictions if code.has_friction(model, law)]
    if friction is not None and friction not in known:
        problem = f'{argument("friction")}: {code.title} has no "{friction}"'
        if friction in code.frictions:
            others = ", ".join(law for law in code.laws if code.has_friction(law, friction))
            raise UsageError(f"{problem} with {model}, but with {others}")
        if not code.frictions:
            raise UsageError(f"{problem}; no friction is written for it: none of it was run")
        raise UsageError(f"{problem}; {did_you_mean(friction, known or list(code.frictions))}")
    keys = [law.key for law in source.draft(model).frictions]
    chosen = friction or next((key for key in keys if key in known), None)
    return chosen, () if chosen else tuple(keys)


def _defaults(source: PointSource, at: Mapping[str, object], config: Config) -> tuple[str, ...]:
    """List the values of Table 1 of the paper that enter, since neither the user nor a config gives them."""
    given = {str(path[1]) for path in source.config_draft.origins if len(path) > 1} | at.keys()
    has_stiffness = any(name.split(".")[-1] == "K" for name in config.scalars)
    material = () if has_stiffness else ("material", "material1", "material2")
    names = [name for name in ("v1", "m1", "m2", *material) if name in config.scalars.keys() - given]
    units = {name: SWEEP_QUANTITIES[name].unit for name in ("v1", "m1", "m2")}
    return tuple(f"{name} = {quantity(config.scalars[name], units.get(name, ''))}" for name in names)


def _fit_notes(code: Code, version: str, key: str, calibration: Calibration) -> tuple[str, tuple[str, ...]]:
    """Name the law that fits best if the code lacks it, and list how well a law fits and which others it has."""
    laws = calibration.laws
    chosen = position_of_law(laws, key, calibration.name)
    weights = calibration.dataset["weight"].values.tolist()
    # too few points have no AICc and no weights
    has_weights = not any(map(math.isnan, weights))
    named = [
        f"{law}, weight {number(weight, 3)}" if has_weights else law
        for law, weight in zip(laws, weights, strict=True)
    ]
    is_in_code = [has_law(code, law_keys(law)[0], version) for law in laws]
    notes = [f"{calibration.name}: {named[chosen]}, law {chosen + 1} of {len(laws)}{' by AICc' * has_weights}"]
    others = [name for position, name in enumerate(named) if is_in_code[position] and position != chosen]
    if others:
        notes.append(f"{argument('model', 'KEY')} exports another law that was fitted: {'; '.join(others)}")
    notes += unidentified_notes(calibration.dataset.isel(model=[chosen]))
    better_fit = "" if is_in_code[0] else f"the law that fits best, {named[0]}, is none of {code.title}"
    return better_fit, tuple(notes)
