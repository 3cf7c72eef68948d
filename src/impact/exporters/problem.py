"""A law and an impact, as a version of a code simulates them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..config.load import Config
from ..contact.impacts import INPUTS, Impacts
from ..contact.model import ForceModel
from ..contact.models import find
from ..engine.build_impacts import build_impacts
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..errors import UsageError
from ..formatting import number
from ..inverse.solve import placeholder, solve_input, unknown_of
from ..inverse.timestep import FixedStepLaw, fixed_step_law
from ..results.calibration import position_of_law, unidentified_notes
from ..results.single_impact import Calibration, ConfigSource, open_source, single_point
from .code import Code, Collision
from .releases import first_law, has_law, law_of_code

# phases over which the mean, the least and the largest restitution are taken
PHASES = 400
# steps before the contact, and contact times that a script runs
STEPS_BEFORE, CONTACTS_RUN = 3, 2.5
# a ball whose radius is not known and does not matter is larger than its peak indentation by this factor
RADIUS_PER_PEAK = 100.0


@dataclass(frozen=True)
class ExportProblem:
    """A law and an impact that are written for a version of a code.

    Parameters
    ----------
    law : the law, the impact and the contact time of the continuous law
    e_continuous, peak_indentation : [-] and [m], of the continuous law
    solved_parameter : what was solved for, with the requested e; "" for none
    defaulted_axes : names of axes of the source that are at their first value
    has_wall : ball 2 is a plane wall
    fit_notes : of a calibration, the rank of the law and its weight, and other laws that were fitted
    better_fit : the law of a calibration that fits best, where it is none of the code; else ""
    missing_law : the default law of the newest release, where this one lacks it and none was requested; else ""
    """

    code: Code
    version: str
    law: FixedStepLaw
    e_continuous: float
    peak_indentation: float
    config: Config
    solved_parameter: str
    defaulted_axes: tuple[str, ...]
    has_wall: bool
    fit_notes: tuple[str, ...]
    better_fit: str
    missing_law: str

    @property
    def model(self) -> ForceModel:
        return self.law.model

    @property
    def requested_e(self) -> float:
        """The e that was requested, or that of the continuous law where none can be."""
        return self.law.e if self.law.has_e else self.e_continuous

    def collision(self, dt: float, phase: float) -> Collision:
        """Make the collision whose contact begins at a phase of a step dt [s]."""
        values = input_values(self.law.impact)
        for name in ("R1", "R2"):
            if math.isnan(values[name]):
                is_wall = name == "R2" and self.has_wall
                values[name] = math.inf if is_wall else RADIUS_PER_PEAK * self.peak_indentation
        names = self.config.scalars
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
            steps=STEPS_BEFORE + math.ceil(CONTACTS_RUN * self.law.contact_time / dt),
        )


def input_values(impact: Impacts) -> dict[str, float]:
    """Return all inputs and derived quantities of one impact, by name, in SI."""
    names = [*INPUTS, "m", "R_eff", "E_eff", "v0", *impact.parameters]
    return {name: float(impact.quantity(name)[0]) for name in names}


def with_wall(config: Config, code: Code, version: str) -> tuple[Config, bool]:
    """Set the inputs that a plane wall acts with in a code, and return whether ball 2 is such a wall."""
    values = input_values(build_impacts(Plan(config).inputs, config.models[0], ()))
    if math.isfinite(values["m2"]) or math.isfinite(values["R2"]):
        return config, False
    inputs = code.wall_inputs(config.models[0].key, version, values)
    return replace(config, scalars={**config.scalars, **inputs}), True


def prepare_export(
    code: Code,
    model: str | None,
    version: str,
    source: ConfigSource,
    at: Mapping[str, float | str],
    overrides: Sequence[str],
) -> ExportProblem:
    """Choose the law, and reduce the source to one impact; the damping of a law without e is solved for."""
    plugins, missing = Plugins(()), ""
    point_source = open_source(source, overrides, plugins)
    if model is not None:
        key = law_of_code(code, model, version)
    elif models := point_source.models:
        key = first_law(code, models, version, is_fitted=point_source.calibration is not None)
    else:
        key, newest = (first_law(code, tuple(code.laws), release) for release in (version, code.newest))
        missing = "" if key == newest else newest
    law = find(key)
    at, solved = dict(at), ""
    if "e" in at and "e" not in law.quantities:
        solved = code.damping.get(key, "")
        if not solved:
            raise UsageError(f"--at e: {key} has no e, and no parameter that sets it")
        name, unknown = f"{key}.{solved}", unknown_of(law, solved)
        if name in at:
            raise UsageError(f"--at: got e and {name}, expected one of the two")
        config, defaulted_axes = single_point(point_source, key, {**at, **placeholder(law, unknown)})
        config, has_wall = with_wall(config, code, version)
        requested_e = float(config.scalars["e"])
        result = solve_input(config, plugins, unknown, {"e_out": requested_e})
        if not result.roots:
            lower, upper = map(number, result.attainable)
            raise UsageError(f"--at e={number(requested_e)}: {key} delivers {lower} to {upper} at any {solved}")
        config = replace(config, scalars={**config.scalars, name: result.roots[0].value})
    else:
        config, defaulted_axes = single_point(point_source, key, at)
        config, has_wall = with_wall(config, code, version)
    fixed, collision = fixed_step_law(config, PHASES, code.scheme)
    calibration = point_source.calibration
    better_fit, fit_notes = _fit_notes(code, version, key, calibration) if calibration else ("", ())
    return ExportProblem(
        code=code,
        version=version,
        law=fixed,
        e_continuous=collision["e_out"],
        peak_indentation=collision["peak_indentation"],
        config=config,
        solved_parameter=solved,
        defaulted_axes=defaulted_axes,
        has_wall=has_wall,
        fit_notes=fit_notes,
        better_fit=better_fit,
        missing_law=missing,
    )


def _fit_notes(code: Code, version: str, key: str, calibration: Calibration) -> tuple[str, tuple[str, ...]]:
    """Name the law that fits best if the code lacks it, and list how well a law fits and which others it has."""
    laws = calibration.laws
    chosen = position_of_law(laws, key, calibration.name)
    weights = calibration.dataset["weight"].values.tolist()
    named = [f"{law}, weight {number(weight, 3)}" for law, weight in zip(laws, weights, strict=True)]
    is_in_code = [has_law(code, law.split(" with ")[0], version) for law in laws]
    notes = [f"{calibration.name}: {named[chosen]}, law {chosen + 1} of {len(laws)} by AICc"]
    others = [name for position, name in enumerate(named) if is_in_code[position] and position != chosen]
    if others:
        notes.append(f"--model exports another law that was fitted: {'; '.join(others)}")
    notes += unidentified_notes(calibration.dataset.isel(model=[chosen]))
    return "" if is_in_code[0] else named[0], tuple(notes)
