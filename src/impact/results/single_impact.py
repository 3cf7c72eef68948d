"""One impact by one model, and perhaps a friction law: its config, its outputs and its time history."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ..arguments import require_counts
from ..config.columns import without_replaced_inputs
from ..config.draft import Draft, Overrides, Setting, open_config, open_text, reject_law_key, settings_of
from ..config.files import as_table, override_text, to_plain_value
from ..config.grid import Axis
from ..config.input_names import SWEEP_INPUTS, InputName, input_values, paths_with, with_words
from ..config.library import library
from ..config.load import Config, build, inline_files
from ..config.quantities import DISTRIBUTION_FORMS
from ..config.rules import has_other_stiffness
from ..config.tables import (
    DEFAULT_RTOL,
    MATERIAL_KEYS,
    MATERIAL_QUANTITIES,
    SWEEP_DEFAULTS,
    expand_laws,
    law_quantities,
)
from ..contact.dimensionless import dimensionless_values, with_coefficients, with_units
from ..contact.fixed_step import EXACT
from ..contact.force_expressions import unload_to_residual, unload_with_stiffness
from ..contact.friction import FrictionLaw, Pair
from ..contact.frictions import find_friction
from ..contact.history import History, history_of
from ..contact.impacts import Impacts
from ..contact.materials import Material
from ..contact.model import ForceModel, with_base_quantities
from ..contact.models import find
from ..contact.output_formulas import collide
from ..contact.simulate import Phases
from ..contact.status import FIRST_FAILURE, FrictionStatus, Status
from ..contact.tangential import RecordedSlip
from ..contact.units import with_numbers
from ..contact.variables import CENTRAL_OUTPUTS, LAW_DIMS, OUTPUTS
from ..display import Block, Displayed, Styled, Table
from ..engine.inputs import build_impacts, build_oblique, fixed_steps_at
from ..engine.plan import Plan
from ..engine.plugins import Plugins, read_plugins
from ..errors import ConfigError, UsageError, did_you_mean, warn
from ..formatting import argument, law_keys, law_name, number, prefixed, safe_text
from .calibration import fitted_config, position_of_law
from .provenance import changed_plugins, stored_config, stored_draft, unknown_plugins
from .schema import DEFAULT_RTOL_FACTOR, history_dataset, is_case, kind_of, require_sweep, scale_of
from .seal import is_result
from .selection import chosen_laws
from .summary import depth_notes, input_notes, turn_notes
from .xarray_backend import open_result, result_of

ConfigSource = str | Path | Mapping[str, object] | xr.Dataset | None
# name, unit and meaning of the quantities that are derived from the inputs of one impact, and from its motion
INPUT_QUANTITIES = (
    ("m1", "kg", "mass of ball 1"),
    ("m2", "kg", "mass of ball 2"),
    ("R1", "m", "radius of ball 1"),
    ("R2", "m", "radius of ball 2"),
    ("m", "kg", "effective mass (17)"),
)
MOTION_QUANTITIES = (
    ("K_r", "N/m^n", "unloading stiffness (42)"),
    ("tau_c", "N s", "impulse of the approach"),
    ("tau_r", "N s", "impulse of the restitution"),
    ("W_c", "J", "work of the approach (38)"),
    ("W_r", "J", "work of the restitution (39)"),
    ("rebound_speed_bound", "m/s", "K/lambda, bound of the rebound speed (26)"),
)
DERIVED_QUANTITIES = (*INPUT_QUANTITIES, *MOTION_QUANTITIES)
# derived from the inputs of an oblique impact
OBLIQUE_QUANTITIES = (
    ("v1", "m/s", "velocity of ball 1 along the normal before the impact"),
    ("u1", "m/s", "tangential velocity of ball 1 before the impact"),
    ("slip", "m/s", "slip speed of the contact points before the impact"),
    ("m_t", "kg", "effective tangential mass"),
)


# digits that are printed; those of --json are all there are
INPUT_DIGITS, OUTPUT_DIGITS, CHECK_DIGITS = 6, 4, 12


@dataclass(frozen=True)
class Impact(Displayed):
    """One impact by one model, and perhaps a friction law.

    Parameters
    ----------
    model : the model
    point : the inputs by their config names
    first : names of axes of the source that are at their first value
    values : the outputs under the names of the result file, in SI
    materials : those of the balls, by name
    derived : the quantities of DERIVED_QUANTITIES, and of oblique impacts OBLIQUE_QUANTITIES, by name, in SI; NaN
        for those that do not apply
    integrator : "exact", or the scheme with a fixed step, which gives no history
    exponent : compliance exponent n of the law
    closing_speed : v0 = v1 - v2 [m/s]
    damping : damping factor lambda = chi K/v0 [N s/m^(n+1)], NaN if the law has none
    e_kinematic, e_kinetic, e_energetic : restitution from velocities, impulses and works, equations (1) to (3);
        the last two by quadrature of the force over the history; without a history those of the outputs, which
        are 0 if the balls stay together
    history : the time history as a dataset over t, or None if the motion cannot be integrated
    friction : the friction law; None for a central impact
    rtol : relative tolerance of the integration
    """

    model: ForceModel
    point: Mapping[str, float | str]
    first: tuple[str, ...]
    values: Mapping[str, float]
    materials: Mapping[str, Material]
    derived: Mapping[str, float]
    integrator: str
    exponent: float
    closing_speed: float
    damping: float
    e_kinematic: float
    e_kinetic: float
    e_energetic: float
    history: xr.Dataset | None
    friction: FrictionLaw | None = None
    rtol: float = DEFAULT_RTOL

    @property
    def status(self) -> Status:
        return Status(int(self.values["status"]))

    @property
    def friction_status(self) -> FrictionStatus:
        """Outcome of the tangential motion; that of the normal motion without a friction law."""
        return FrictionStatus(int(self.values.get("friction_status", self.status)))

    @property
    def failed(self) -> bool:
        return self.friction_status >= FIRST_FAILURE

    @property
    def why_no_history(self) -> str:
        """Why there is no time history, for a message."""
        if self.integrator != EXACT:
            return no_motion(self.integrator)
        return self.status.meaning if self.status != Status.OK else self.friction_status.meaning

    def groups(self) -> dict[str, list[tuple[str, str, str]]]:
        """What `impact run` prints under each heading: names, values with a suitable prefix, and meanings."""
        friction = self.friction
        inputs = [("model", self.model.key, self.model.equation)]
        if friction:
            inputs.append(("friction", friction.key, friction.equation))
        materials = {
            f"materials.{material}.{name}": value
            for material, properties in self.materials.items()
            for name, value in asdict(properties).items()
            if value is not None
        }
        # a property that varies is an input of the point as well
        for name, value in {**self.point, **materials}.items():
            rule = InputName.parse(name).quantity({self.model.key: self.model})
            unit, meaning = ("1", "") if rule is None else (self._with_numbers(rule.unit), rule.meaning)
            if name == "K" and rule and f"{self.model.key}.K" in self.point:
                # not used; its n is that of other laws
                unit = rule.unit
            note = "first value of its axis" if name in self.first else ""
            inputs.append((name, prefixed(value, unit, INPUT_DIGITS), "; ".join(filter(None, (meaning, note)))))
        inputs += self._derived_rows((*INPUT_QUANTITIES, *OBLIQUE_QUANTITIES), INPUT_DIGITS)
        outputs = [("status", self.status.name.lower(), self.status.meaning)]
        if friction:
            regime = OUTPUTS["contact_regime"]
            outputs += [
                ("friction_status", self.friction_status.name.lower(), self.friction_status.meaning),
                ("contact_regime", _flag("contact_regime", self.values).replace("_", " "), regime.meaning),
            ]
        checks = [
            ("e_kinematic", number(self.e_kinematic, CHECK_DIGITS), "(1), from the velocities"),
            ("e_kinetic", number(self.e_kinetic, CHECK_DIGITS), "(2), tau_r/tau_c"),
            ("e_energetic", number(self.e_energetic, CHECK_DIGITS), "(3), the root of -W_r/W_c"),
        ]
        numbers = {**self.derived, **self.point, **self.values}
        for name, variable in OUTPUTS.items():
            value = self.values.get(name, math.nan)
            is_left_out = variable.dtype != "f8" or (variable.may_be_nan and value != value)
            if name not in self.values or is_left_out or name in ("e_kinetic", "e_energetic"):
                continue
            meaning = variable.short_meaning
            if variable.scale == "bounded by 10 rtol":
                checks.append((name, number(value, OUTPUT_DIGITS), meaning))
            else:
                # a number without a unit is often compared with an input
                digits = INPUT_DIGITS if variable.unit == "1" else OUTPUT_DIGITS
                scale = scale_of(variable, lambda name: np.asarray(numbers[name]), has_peak=True)
                # what `compare` would by default take for 0
                value = 0.0 if abs(value) <= DEFAULT_RTOL_FACTOR * self.rtol * scale else value
                outputs.append((name, prefixed(value, self._with_numbers(variable.unit), digits), meaning))
        outputs += self._derived_rows(MOTION_QUANTITIES, OUTPUT_DIGITS)
        in_domain = "yes" if self.values["in_domain"] else "no"
        domain = ": ".join(filter(None, ("in the stated domain of the law", self.model.domain_text)))
        checks.append(("in_domain", in_domain, domain))
        checks.append(("steps", number(self.values["steps"]), OUTPUTS["steps"].meaning))
        if self.integrator != EXACT:
            checks.append(("integrator", self.integrator, "scheme with a fixed step"))
        return {"Inputs": inputs, "Outputs": outputs, "Checks": checks}

    def rows(self) -> dict[str, str]:
        """The lines of all groups, by name."""
        groups = self.groups().values()
        return {name: "  ".join(filter(None, words)) for group in groups for name, *words in group}

    def _derived_rows(self, quantities: Iterable[tuple[str, str, str]], digits: int) -> list[tuple[str, str, str]]:
        """Write the derived quantities that apply and are not inputs."""
        return [
            (name, prefixed(self.derived[name], self._with_numbers(unit), digits), meaning)
            for name, unit, meaning in quantities
            if not math.isnan(self.derived.get(name, math.nan)) and name not in self.point
        ]

    def as_dict(self) -> dict[str, Any]:
        """The impact as plain data."""
        words = {"status": self.status.name.lower()}
        if self.friction:
            words |= {name: _flag(name, self.values) for name in ("friction_status", "contact_regime")}
        return {
            "model": self.model.key,
            **({"friction": self.friction.key} if self.friction else {}),
            "inputs": dict(self.point),
            "first_value_of": list(self.first),
            **{name: getattr(self, name) for name in ("integrator", "exponent", "closing_speed")},
            "outputs": {**self.values, **words},
            "materials": {name: asdict(material) for name, material in self.materials.items()},
            "derived": dict(self.derived),
            **{name: getattr(self, name) for name in ("damping", "e_kinematic", "e_kinetic", "e_energetic")},
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """One row: the model, the inputs and the outputs."""
        data = self.as_dict()
        keys = {name: data[name] for name in LAW_DIMS if name in data}
        return [{**keys, **data["inputs"], **data["outputs"]}]

    def sections(self, width: int) -> Iterable[Block]:
        """The inputs, outputs and checks, one per line."""
        rows: list[tuple[object, ...]] = []
        # one table, so that the columns of the groups are aligned
        for heading, group in self.groups().items():
            rows += [*([("",)] if rows else []), (Styled(heading, "bold"),), *group]
        return [Table(rows, no_wrap=(0, 1))]

    def _with_numbers(self, unit: str) -> str:
        """A unit with the values of n and of the parameters that its exponents have."""
        values = {
            InputName.parse(name).key: value for name, value in self.point.items() if isinstance(value, float)
        }
        return with_numbers(unit, {**values, "n": self.exponent})


def _flag(name: str, values: Mapping[str, float]) -> str:
    """Find the word for the value of a variable with flags."""
    return next(word for word, value in OUTPUTS[name].flags.items() if value == int(values[name]))


def run(
    source: str | Path | Mapping[str, object] | xr.Dataset | None = None,
    *,
    model: str | None = None,
    friction: str | None = None,
    at: Mapping[str, object] | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    times: int | None = None,
) -> Impact:
    """Run one impact and record its time history.

    Parameters
    ----------
    source : a TOML file, a mapping, a result, or a calibration; by default the two balls of Table 1 of the paper,
        at e = 0.5
    model : key of the model; by default the first one of the source
    friction : key of the friction law; by default the first one of the source, if it has any
    at : values by config name, such as `{"e": 0.05}`; the default of an axis is its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : plug-in models, and paths of Python files with such models; a result that was computed with them
        needs them again, and a changed one gives a warning with both hashes
    times : number of points of the history, uniform from first contact to release; by default the steps of the
        integrator

    Returns
    -------
    Impact : `values` has the outputs of docs/schema.md, one number each, in SI, `history` the motion as a dataset
        over the time t [s], or None where there is none; a failed impact is a `status`, not an error

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is invalid

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    require_counts(2, times=times)
    plugin_set = read_plugins(plugins)
    opened = open_source(source, overrides, plugin_set)
    config, first = single_point(opened, model, at, friction=friction)
    # an integer of another library would be taken for a time
    samples = None if times is None else int(times)
    impact = run_single_impact(Plan(config, plugin_set.of(config.models)), first, samples)
    if "e" not in first and (opened.has_own_e or "e" in (at or {})):
        warn_of_ignored_e(config, impact.values["e_out"])
    radii = impact.derived["R1"], impact.derived["R2"]
    warn(*depth_notes(impact.values["peak_indentation"], *radii))
    if impact.friction:
        tangential = impact.derived["u1"] - float(impact.point["u2"])
        warn(*turn_notes(tangential, impact.values["contact_time"], *radii))
    return impact


def ignores_e(config: Config) -> bool:
    """Whether the law of a config has another damping than e; an elastic law has none to find."""
    law = config.models[0]
    is_used = "e" in with_base_quantities(law.quantities) or any(law.may_use_e for law in config.frictions)
    return bool(law.damping) and not is_used


def warn_of_ignored_e(config: Config, e_out: float) -> None:
    """Warn if the law of a config without axes has another damping than e, and delivers another restitution."""
    law, e = config.models[0], config.scalars.get("e", math.nan)
    if not ignores_e(config) or not isinstance(e, float):
        return
    if e != e or e_out != e_out or number(e_out) == number(e):
        return
    # the parameter depends on masses, speeds and the material, which a config may set
    way = f"impact solve --model {law.key} --for {law.damping} --target e_out={number(e)}"
    way += ", with the same inputs, finds the parameter"
    warn(f"e = {number(e)} is not an input of {law.key}, which delivers {number(e_out)}; {way}")


def no_motion(integrator: str) -> str:
    """Explain why a scheme with a fixed step has no time history."""
    return f'integrator = "{safe_text(integrator, 40)}" has no history, expected solver.integrator = "{EXACT}"'


def run_single_impact(plan: Plan, first: tuple[str, ...], times: int | None = None) -> Impact:
    """Integrate the only impact of a plan without axes; `first` names axes of its source at their first value."""
    plan.pair_notes("frictions")
    config, model, law = plan.config, plan.models[0], plan.laws[-1]
    impacts = build_impacts(plan.inputs, model, ())
    oblique = build_oblique(plan.inputs, impacts, (), law.friction) if isinstance(law, Pair) else None
    # what is recorded is not compiled
    solver = replace(config.solver, core="numpy")
    errors: dict[str, str] = {}
    recorded: list[Phases] = []
    recorded_slip: list[RecordedSlip] = []
    collision = collide(
        law,
        impacts,
        fixed_step=fixed_steps_at(plan.inputs, impacts, ()),
        errors=errors,
        names=OUTPUTS if oblique else CENTRAL_OUTPUTS,
        oblique=oblique,
        # a history is that of the continuous law
        recorded=recorded if solver.integrator == EXACT else None,
        recorded_slip=recorded_slip,
        **asdict(solver),
    )
    values = {name: array[0].item() for name, array in collision.items()}
    warn(*errors.values())
    history = None
    has_slip = values.get("friction_status", FrictionStatus.OK) < FIRST_FAILURE
    if values["status"] == Status.OK and recorded and has_slip:
        history = history_of(recorded[0], impacts, times, oblique, recorded_slip)
    v0 = impacts.v0[0].item()
    # a law may have its own n, which replaces that of the config
    point = with_words({**config.scalars, "n": impacts.n[0].item()})
    if "alpha" in config.scalars:
        point["e"] = impacts.e[0].item()
    derived = _derived_quantities(model, impacts, values, history)
    if oblique:
        tangential = {name: getattr(oblique, name).item() for name in ("u1", "slip", "m_t")}
        derived |= {"v1": impacts.v1.item(), **tangential}
    return Impact(
        model=model,
        point=point,
        first=first,
        values=values,
        materials=plan.materials_used,
        derived=derived,
        integrator=solver.integrator,
        exponent=impacts.n[0].item(),
        closing_speed=v0,
        damping=values["lambda"],
        e_kinematic=(values["v2_post"] - values["v1_post"]) / v0 if v0 > 0.0 else float("nan"),
        e_kinetic=history.e_kinetic if history else values["e_kinetic"],
        e_energetic=history.e_energetic if history else values["e_energetic"],
        history=history_dataset(history, plan, point) if history else None,
        friction=config.frictions[0] if config.frictions else None,
        rtol=solver.rtol,
    )


def _derived_quantities(
    law: ForceModel, impacts: Impacts, values: Mapping[str, float], history: History | None
) -> dict[str, float]:
    """Compute DERIVED_QUANTITIES."""
    quantities = {name: getattr(impacts, name)[0].item() for name, *_ in INPUT_QUANTITIES}
    has_rebound = values["status"] in (Status.OK, Status.LIMIT)
    n = impacts.n[0].item()
    if has_rebound and law.unloading is unload_with_stiffness:
        # the force may jump at the peak
        with np.errstate(all="ignore"):
            of_law = with_coefficients(law, with_units(dimensionless_values(law, impacts), n), 1)
            quantities["K_r"] = (of_law["Kr"] * impacts.K).item()
    elif has_rebound and law.unloading is unload_to_residual:
        recovered = values["peak_indentation"] - values["permanent_indentation"]
        quantities["K_r"] = values["peak_force"] / recovered**n if recovered else math.inf
    if history is not None:
        quantities |= {name: getattr(history, name) for name in ("tau_c", "tau_r", "W_c", "W_r")}
    elif values["status"] == Status.LIMIT:
        # the approach takes all kinetic energy, and the restitution returns none
        quantities["tau_c"], quantities["W_c"] = (impacts.m * impacts.v0)[0].item(), 0.5 * impacts.energy[0].item()
        quantities["tau_r"] = quantities["W_r"] = 0.0
    if "chi" in law.coefficients and law.unloading is None:
        chi, v0 = values["damping_ratio"], impacts.v0[0].item()
        # the limit has infinite damping
        chi = math.inf if values["status"] == Status.LIMIT else chi
        quantities["rebound_speed_bound"] = v0 / chi if chi else math.inf
    return {name: quantities.get(name, math.nan) for name, _, _ in DERIVED_QUANTITIES}


def histories(
    dataset: xr.Dataset,
    models: Sequence[str] | None,
    at: Mapping[str, object],
    plugins: Plugins,
    frictions: Sequence[str] | None = None,
) -> tuple[list[xr.Dataset], list[str]]:
    """Integrate the histories of one point by several models; a dataset that is a time history is returned.

    Also returns the models without a history there, each with the reason. Values of `at` need not be on the grid;
    an axis of e takes its middle value, because many laws have no motion at e = 0, and other axes take their first
    value. A parameter of one model is
    ignored by the others. An unknown model or input, and a point without a history, are UsageErrors. A result with
    friction laws has the history of each model with the first friction law that it can be combined with, or those
    of all pairs with `frictions`.
    """
    if "t" in dataset.dims:
        return [dataset], []
    keys = chosen_laws(models, dataset)
    friction_keys = chosen_laws(frictions, dataset, "friction") if "friction" in dataset.coords else []
    integrator = str(dataset.attrs.get("integrator", EXACT))
    if integrator != EXACT:
        raise UsageError(f"no motion to draw in this result: {no_motion(integrator)}")
    along_e = [name for name, coordinate in dataset.coords.items() if coordinate.dims == ("e",)]
    if along_e == ["e"] and "e" not in at:
        values = np.sort(dataset["e"].values)
        at = {"e": float(values[values.size // 2]), **at}
    source = replace(open_source(dataset, (), plugins), at_name="sel")
    for changed in changed_plugins(dataset.attrs, plugins, "the result"):
        # a changed law has another motion than the result
        raise UsageError(changed)
    datasets: list[xr.Dataset] = []
    ends: dict[str, str] = {}
    first: dict[str, float | str] = {}
    refused: list[ConfigError] = []
    drawn: set[str] = set()
    for key, friction in itertools.product(keys, friction_keys or [""]):
        if not frictions and key in drawn:
            continue
        others = {str(name) for name in dataset.coords if not InputName.parse(name).applies_to(key, friction)}
        law_inputs = {name: value for name, value in at.items() if name not in others}
        try:
            config, names = single_point(source, key, law_inputs, friction=friction or None)
            impact = run_single_impact(Plan(config, plugins.of(config.models)), names)
        except ConfigError as error:
            # the model and the friction law cannot be combined
            refused.append(error)
            continue
        first |= {name: impact.point[name] for name in names}
        if impact.history is None:
            ends[key] = impact.why_no_history
        else:
            datasets.append(impact.history)
            drawn.add(key)
    if refused and not (datasets and friction_keys):
        raise refused[0]
    if not datasets:
        point = {**first, **at}
        described = ", ".join(f"{name} = {value}" for name, value in point.items())
        reason = next(iter(ends.values()))
        advice = f"; choose another point on {', '.join(point)} ({argument('sel')})" if point else ""
        raise UsageError(f"no motion to draw at {described}: {reason}{advice}")
    return datasets, [f"{key} ({reason})" for key, reason in ends.items() if key not in drawn]


@dataclass(frozen=True)
class Calibration:
    """A calibration of which the config of one law with its fitted parameters is taken, with the settings."""

    dataset: xr.Dataset
    config: Config
    overrides: tuple[Setting, ...]
    name: str

    @property
    def laws(self) -> list[str]:
        """MODEL, or MODEL with FRICTION, the best law first."""
        return [str(law) for law in self.dataset["model"].values]


@dataclass(frozen=True)
class PointSource:
    """A config of which single impacts are taken, with the settings of the user."""

    config_draft: Draft
    plugins: Plugins
    labels: Mapping[str, float | str] = field(default_factory=dict)  # at which a part of a result was selected
    is_starter: bool = False  # whose models and e are not chosen by the user, unless a setting does
    at_name: str = "at"  # the argument with the values of the point, for messages
    calibration: Calibration | None = None

    @property
    def has_own_e(self) -> bool:
        """Whether the user chose the e of the config: that of the starter config is a default."""
        chosen = (path[:2] == ("sweep", "e") for path in self.config_draft.origins)
        return any(chosen) if self.is_starter else "e" in self.config_draft.table("sweep")

    @property
    def models(self) -> tuple[str, ...]:
        """Keys of the selected models, or none; other values of the config need not be valid yet."""
        if self.calibration is not None:
            return tuple(dict.fromkeys(law_keys(law)[0] for law in self.calibration.laws))
        draft = self.config_draft
        is_chosen = ("models",) in draft.origins if self.is_starter else "models" in draft.data
        if not is_chosen:
            return ()
        _, problems = expand_laws(draft.data["models"], draft.known_models)
        return tuple(model.key for model in (build(draft).models if problems else draft.models))

    def draft(self, model: str | None = None, friction: str | None = None) -> Draft:
        """The config; of a calibration that of a fitted law, by default the best, under the name of the model."""
        if (fit := self.calibration) is None:
            return self.config_draft
        model = self.models[0] if model is None else model
        position = position_of_law(fit.laws, law_name(model, friction or ""), fit.name)
        config = fitted_config(fit.config, fit.dataset.isel(model=position))
        draft = open_text(config, fit.name, self.plugins.models)
        fitted = draft.models[0].key
        table = draft.table("model").get(fitted)
        is_renamed = table is not None and model != fitted
        renamed = [Setting(("model", model), table, argument("model", model))] if is_renamed else []
        return draft.with_settings([*renamed, *fit.overrides])


def open_source(source: ConfigSource, overrides: Overrides, plugins: Plugins) -> PointSource:
    """Open the config of a source, with overrides; None is the starter config at e = 0.5.

    A part of a result fixes the values at which it was selected. A plug-in that has changed since the result was
    made is a warning.
    """
    if isinstance(source, str | Path) and is_result(Path(source)):
        with open_result(source) as stored:
            return _open_stored(stored, overrides, plugins, str(source))
    if isinstance(source, xr.Dataset):
        return _open_stored(source, overrides, plugins, "the result")
    if source is None:
        starter = open_config(None, plugins.models).with_settings([Setting.parse("sweep.e=0.5")])
        # that setting is no input of the user
        draft = replace(starter, origins={}).with_settings(overrides)
        return PointSource(draft, plugins, is_starter=True)
    reject_law_key(source, "model", plugins.models)
    draft = open_config(source, plugins.models)
    return PointSource(draft.with_settings(overrides), plugins)


def _open_stored(dataset: xr.Dataset, overrides: Overrides, plugins: Plugins, name: str) -> PointSource:
    dataset = result_of(dataset)
    calibration, settings = None, tuple(settings_of(overrides))
    if kind_of(dataset) == "calibration":
        config = stored_config(dataset.attrs, (), plugins, name, allow_changed_plugins=True, purpose="calibrate")
        calibration = Calibration(dataset.load(), config, settings, name)
    else:
        require_sweep(dataset, name)
    draft = stored_draft(dataset.attrs, plugins, name).with_settings(settings)
    warn(*changed_plugins(dataset.attrs, plugins, name), *unknown_plugins(dataset.attrs, plugins, name))
    labels = {str(key): label.values.item() for key, label in dataset.coords.items() if label.ndim == 0}
    labels = {} if calibration else {k: value for k, value in labels.items() if k not in LAW_DIMS}
    return PointSource(draft, plugins, labels, calibration=calibration)


def single_point(
    source: PointSource,
    model: str | None = None,
    at: Mapping[str, object] | None = None,
    over: Mapping[str, object] | None = None,
    *,
    friction: str | None = None,
) -> tuple[Config, tuple[str, ...]]:
    """Reduce a config to one impact, or to impacts over one input; also name the inputs that took a first value.

    Parameters
    ----------
    source : the config
    model : key of the model; by default the config's first
    at : values by config name, in which a parameter of the law needs no key of it; they need not be on the grid.
        Inputs that vary together, in a zip group or in a table of cases, are an exception: their values, or the
        number of a case, select one of its points
    over : values of an input, as in a config, that stay an axis
    friction : key of the friction law; by default the config's first, if it has any
    """
    draft = source.draft(model, friction)
    law = None if model is None else find(model, source.plugins.models)
    friction_law = None if friction is None else find_friction(friction)
    laws = (law or next(iter(draft.models), None), friction_law or next(iter(draft.frictions), None))
    fixed = {str(input_name(name, *laws)): to_plain_value(value) for name, value in (at or {}).items()}
    for name, value in fixed.items():
        if isinstance(value, dict | list):
            raise UsageError(f"{argument(source.at_name, {name: value})}: got several values, expected one")
    if {"e", "alpha"} <= fixed.keys():
        raise UsageError(f"{argument(source.at_name, key='alpha')}: got alpha and e, expected one of the two")
    settings = [] if law is None else [Setting(("models",), [law.key], argument("model", law.key))]
    if friction_law is not None:
        settings.append(Setting(("frictions",), [friction_law.key], argument("friction", friction)))
    over = {str(input_name(name, *laws)): values for name, values in (over or {}).items()}
    settings += [
        Setting(InputName.parse(name).path, values, argument("over", key=name)) for name, values in over.items()
    ]
    is_uncertain = bool(paths_with(draft.data, DISTRIBUTION_FORMS))
    draft = draft.with_settings(settings)
    draft = _with_cases(draft)
    if source.is_starter:
        draft = without_replaced_inputs(draft, fixed)
    joint = joint_inputs(draft)
    varying = {str(name) for name, value in input_values(draft.data) if isinstance(value, list | dict)}
    labels = {name: value for name, value in source.labels.items() if name in varying | joint or is_case(name)}
    # `impact plot --sel` takes no other settings
    settable = fixed if source.at_name == "at" else {}
    # the exponent n decides whose stiffness K is
    for name, value in sorted({**labels, **fixed}.items(), key=lambda item: item[0] == "K"):
        if name in joint or is_case(name):
            continue
        parsed = InputName.parse(name)
        if not _has_input(draft, parsed):
            if name in fixed:
                raise _unknown_input(draft, name, settable)
            # a parameter of another law, which the part of a result has as well
            continue
        path, value = parsed.path, parsed.word(value)
        if name == "K" and law is not None and has_other_stiffness(draft, law):
            # K of a model with another exponent than [sweep] is that of its own table
            path = ("model", law.key, "K")
        draft = draft.with_settings([Setting(path, value, argument(source.at_name, value, key=name))])
    if is_uncertain and not paths_with(draft.data, DISTRIBUTION_FORMS):
        draft = replace(draft, data={key: value for key, value in draft.data.items() if key != "design"})
    config = build(draft)
    for name in fixed:
        if is_case(name) and name not in {axis.numbered for axis in config.axes}:
            raise _unknown_input(draft, name, settable)
    config, defaulted = _without_axes(config, {**labels, **fixed}, over)
    has_density = not source.is_starter or config.sets_material
    warn(*config.notes, *input_notes(Plan(config).inputs, has_density=has_density))
    return config, defaulted


def input_name(name: str, model: ForceModel | None, friction: FrictionLaw | None) -> InputName:
    """Read a config name, in which a parameter of the chosen law needs no key of it."""
    parsed = InputName.parse(name)
    if parsed.owner or parsed.key in SWEEP_INPUTS:
        return parsed
    for table, law in (("model", model), ("friction", friction)):
        if law is not None and parsed.key in law_quantities(law):
            return InputName(table, law.key, parsed.key)
    return parsed


def _with_cases(draft: Draft) -> Draft:
    """Read the columns of cases, if they are those of a file."""
    return inline_files(draft) if isinstance(draft.table("sweep").get("cases"), str) else draft


def joint_inputs(draft: Draft) -> set[str]:
    """Name the inputs that vary together: in zip groups and in a table of cases."""
    zipped = [name for group in draft.zip_groups for name in group]
    cases = as_table(_with_cases(draft).table("sweep").get("cases"))
    return {str(InputName.parse(name)) for name in (*zipped, *cases)}


def _has_input(draft: Draft, name: InputName) -> bool:
    """Whether an input may have a value: any of [sweep], a parameter of a selected model, a varying property."""
    if name.material:
        value = as_table(draft.table("materials").get(name.material)).get(name.key)
        return isinstance(value, list | dict)
    if name.owner:
        return any(law.key == name.owner and name.key in law_quantities(law) for law in draft.laws[name.table])
    return name.key in SWEEP_INPUTS


def _unknown_input(draft: Draft, name: str, at: Mapping[str, object]) -> UsageError:
    names = {*draft.input_names, *SWEEP_DEFAULTS, *(str(parameter) for parameter, _ in draft.parameters)}
    choices = {choice for choice in names if _has_input(draft, InputName.parse(choice))} | joint_inputs(draft)
    parsed = InputName.parse(name)
    if name in at and parsed.table in ("sweep", "materials") and parsed.key in MATERIAL_QUANTITIES:
        hint = _property_hint(draft, parsed, at, choices)
    else:
        hint = did_you_mean(name, [*choices, *SWEEP_INPUTS])
        # without a similar name, the inputs that this config has
        hint = hint if hint.startswith("did") else did_you_mean(name, sorted(choices))
    return UsageError(f'no input "{name}" here; {hint}')


def _property_hint(draft: Draft, name: InputName, at: Mapping[str, object], inputs: set[str]) -> str:
    """Say how to set a property of a material, which is an input only if it is an axis."""
    sweep = {**draft.table("sweep"), **at}
    used = [material for key, material in sweep.items() if key in MATERIAL_KEYS]
    is_single = used == used[:1] * len(used) and all(isinstance(material, str) for material in used)
    material = name.material or (str(used[0]) if used and is_single else "NAME")
    full_name = InputName("materials", material, name.key)
    if str(full_name) in inputs:
        return f'did you mean "{full_name}"?'
    hint = f"write {argument('overrides', [override_text(full_name.path, at[str(name)])])}"
    if not name.material or material in (*used, *draft.table("materials")):
        return hint
    others = "" if material in library() else "nu, rho and "
    return f"{hint} with {others}{argument('at', {'material': material})}"


def _without_axes(
    config: Config, at: Mapping[str, float | str], over: Mapping[str, object]
) -> tuple[Config, tuple[str, ...]]:
    """Reduce axes that are not in `over` to one value, and name the inputs that took the first one of theirs.

    Parameters of other laws than the first are left out.
    """
    models, frictions = config.models[:1], config.frictions[:1]
    keys = models[0].key, frictions[0].key if frictions else ""
    scalars = dict(config.scalars)
    first: list[str] = []
    kept = [axis for axis in config.axes if not over.keys().isdisjoint(axis.columns)]
    for axis in (axis for axis in config.axes if axis not in kept):
        position = _position_on_axis(axis, at)
        scalars |= {name: values[position] for name, values in axis.columns.items()}
        if axis.size > 1 and at.keys().isdisjoint({axis.name, *axis.columns}):
            first += axis.columns
    others = {name for name in scalars.keys() - at.keys() if not InputName.parse(name).applies_to(*keys)}
    scalars = {name: value for name, value in scalars.items() if name not in others}
    config = replace(config, axes=tuple(kept), scalars=scalars, models=models, frictions=frictions)
    return config, tuple(name for name in first if name not in others)


def _position_on_axis(axis: Axis, at: Mapping[str, float | str]) -> int:
    """Find the first position on an axis at which its columns, or its numbers, have the values of `at`."""
    columns: dict[str, Sequence[float | str]] = {axis.name: axis.labels, **axis.columns}
    selected = with_words({name: value for name, value in at.items() if name in columns})
    for position in range(axis.size):
        if with_words({name: columns[name][position] for name in selected}) == selected:
            return position
    requested = ", ".join(f"{name} = {value}" for name, value in selected.items())
    raise UsageError(f"{requested}: not on the zipped axis {axis.name}; these values vary together")
