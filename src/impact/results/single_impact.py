"""One impact by one model: its config, from a file or a point of a result, its outputs and its time history."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import xarray as xr

from .._version import __version__
from ..config.draft import Setting, open_config
from ..config.files import override_text
from ..config.grid import Axis
from ..config.input_names import InputName, is_input
from ..config.load import Config, parse_config, read_config
from ..config.tables import MATERIAL_QUANTITIES, SWEEP_QUANTITIES, expand_models
from ..contact.force_expressions import returning, stiffer
from ..contact.history import History, follow
from ..contact.impacts import Impacts
from ..contact.materials import Material
from ..contact.model import ForceModel
from ..contact.models import find
from ..contact.outputs import collide
from ..contact.status import Status
from ..contact.timestep import EXACT
from ..contact.units import with_numbers
from ..contact.variables import HISTORY, OUTPUTS
from ..display import Block, Displayed, Table
from ..engine.build_impacts import build_impacts, fixed_steps_at
from ..engine.plan import Plan
from ..engine.plugins import Plugins
from ..errors import ConfigError, UsageError, did_you_mean
from ..formatting import number, quantity
from ..text import safe_text
from .kinds import require_sweep
from .provenance import changed_plugins, check_plugins, stored_config, unknown_plugins
from .schema import SCHEMA_VERSION, attributes_of, is_case, plain_unit
from .seal import is_result
from .xarray_backend import open_result

STARTER_CONFIG = files("impact") / "config" / "starter.toml"

ConfigSource = str | Path | Mapping[str, object] | xr.Dataset | None
# returns the config with some overrides
ReadConfig = Callable[[Sequence[str]], Config]
# name, unit and meaning of the quantities that are derived from the inputs and the history of one impact
DERIVED_QUANTITIES = (
    ("m1", "kg", "mass of ball 1"),
    ("m2", "kg", "mass of ball 2"),
    ("R1", "m", "radius of ball 1"),
    ("R2", "m", "radius of ball 2"),
    ("m", "kg", "effective mass (17)"),
    ("K_r", "N m-n", "unloading stiffness (42)"),
    ("tau_c", "N s", "impulse of the approach"),
    ("tau_r", "N s", "impulse of the restitution"),
    ("W_c", "J", "work of the approach (38)"),
    ("W_r", "J", "work of the restitution (39)"),
    ("rebound_speed_bound", "m s-1", "K/lambda, bound of the rebound speed (26)"),
)


@dataclass(frozen=True)
class Impact(Displayed):
    """One impact by one model.

    Parameters
    ----------
    model : the model
    point : the inputs by their config names
    first : names of axes of the source that are at their first value
    values : the outputs under the names of the result file, in SI
    materials : those of the balls, by name
    derived : the quantities of DERIVED_QUANTITIES by name, in SI; NaN for those that do not apply
    integrator : "exact", or the scheme with a fixed step, which gives no history
    exponent : compliance exponent n of the law
    closing_speed : v0 = v1 - v2 [m/s]
    damping : damping factor lambda = chi K/v0 [N s/m^(n+1)], NaN if the law has none
    e_kinematic, e_kinetic, e_energetic : restitution from velocities, impulses and works, equations (1) to (3);
        the last two by quadrature of the force over the history; without a history those of the outputs, which
        are 0 if the balls stay together
    history : the time history as a dataset over t, or None if the motion cannot be integrated
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

    @property
    def status(self) -> Status:
        return Status(int(self.values["status"]))

    @property
    def why_no_history(self) -> str:
        """Why there is no time history, for a message."""
        return self.status.meaning if self.integrator == EXACT else no_motion(self.integrator)

    def rows(self) -> dict[str, str]:
        """What `impact run` prints: the inputs, outputs, the three restitutions and estimated errors, by name."""
        rows = {"model": self.model.key, "equation": self.model.equation}
        for name, value in self.point.items():
            note = "  (first value of its axis)" if name in self.first else ""
            rows[name] = quantity(value, self._unit_of(name), 10) + note
        for name, material in self.materials.items():
            properties = {field: value for field, value in asdict(material).items() if value is not None}
            about = (
                f"{field} = {quantity(value, MATERIAL_QUANTITIES[field].unit, 10)}"
                for field, value in properties.items()
            )
            rows[f"[materials.{name}]"] = ", ".join(about)
        for name, unit, meaning in DERIVED_QUANTITIES:
            if self.derived[name] == self.derived[name] and name not in self.point:
                rows[name] = f"{quantity(self.derived[name], self._with_numbers(plain_unit(unit)), 10)}  {meaning}"
        rows["status"] = f"{self.status.name.lower()}: {self.status.meaning}"
        for name, variable in OUTPUTS.items():
            if variable.dtype == "f8" and name not in ("e_kinetic", "e_energetic"):
                rows[name] = quantity(self.values[name], self._with_numbers(variable.unit), 10)
        rows["e_kinematic"] = quantity(self.e_kinematic, "1", 12) + "  (1), from the velocities"
        rows["e_kinetic"] = quantity(self.e_kinetic, "1", 12) + "  (2), tau_r/tau_c"
        rows["e_energetic"] = quantity(self.e_energetic, "1", 12) + "  (3), the root of -W_r/W_c"
        rows["in the stated domain"] = "yes" if self.values["in_domain"] else f"no: {self.model.domain_text}"
        rows["steps"] = number(self.values["steps"])
        if self.integrator != EXACT:
            rows["integrator"] = self.integrator
        return rows

    def as_dict(self) -> dict[str, Any]:
        """The impact as plain data."""
        return {
            "model": self.model.key,
            "inputs": dict(self.point),
            "first_value_of": list(self.first),
            "integrator": self.integrator,
            "exponent": self.exponent,
            "closing_speed": self.closing_speed,
            "outputs": {**self.values, "status": self.status.name.lower()},
            "materials": {name: asdict(material) for name, material in self.materials.items()},
            "derived": dict(self.derived),
            "damping": self.damping,
            "e_kinematic": self.e_kinematic,
            "e_kinetic": self.e_kinetic,
            "e_energetic": self.e_energetic,
        }

    def records(self) -> Sequence[Mapping[str, Any]]:
        """One row: the model, the inputs and the outputs."""
        data = self.as_dict()
        return [{"model": data["model"], **data["inputs"], **data["outputs"]}]

    def sections(self, width: int) -> Iterable[Block]:
        """The inputs, outputs, the three restitutions and estimated errors, one per line."""
        return [Table(list(self.rows().items()))]

    def _unit_of(self, name: str) -> str:
        """The unit of an input, which may be a parameter of the model, or a property of a material."""
        try:
            quantity = InputName.parse(name).quantity({self.model.key: self.model})
        except KeyError:
            quantity = None
        return self._with_numbers("1" if quantity is None else quantity.unit)

    def _with_numbers(self, unit: str) -> str:
        """A unit with the values of n and of the parameters that its exponents have."""
        values = {
            InputName.parse(name).key: value for name, value in self.point.items() if isinstance(value, float)
        }
        return with_numbers(unit, {**values, "n": self.exponent})


def no_motion(integrator: str) -> str:
    """The reason why a scheme with a fixed step has no time history."""
    return f'integrator = "{safe_text(integrator, 40)}" has no history, expected solver.integrator = "{EXACT}"'


def run_single_impact(plan: Plan, first: tuple[str, ...], times: int | None = None) -> Impact:
    """Integrate the only impact of a plan.

    Parameters
    ----------
    plan : without axes
    first : names of axes of the source that are at their first value
    times : number of points in time of the history, see `impact.contact.history.follow`
    """
    config = plan.config
    law = config.models[0]
    impacts = build_impacts(plan.inputs, law, ())
    solver = config.solver
    errors: dict[str, str] = {}
    collision = collide(
        law,
        impacts,
        rtol=solver.rtol,
        max_steps=solver.max_steps,
        integrator=solver.integrator,
        fixed_step=fixed_steps_at(plan.inputs, impacts, ()),
        errors=errors,
    )
    values = {name: array[0].item() for name, array in collision.items()}
    for error in errors.values():
        warnings.warn(error, stacklevel=2)
    # a history is that of the continuous law
    going = values["status"] == Status.OK and solver.integrator == EXACT
    history = follow(law, impacts, rtol=solver.rtol, max_steps=solver.max_steps, times=times) if going else None
    v0 = impacts.v0[0].item()
    # a law may have its own n, which replaces that of the config
    point = {**config.scalars, "n": impacts.n[0].item()}
    if "alpha" in config.scalars:
        point["e"] = impacts.e[0].item()
    return Impact(
        model=law,
        point=point,
        first=first,
        values=values,
        materials=plan.materials_used,
        derived=_derived_quantities(law, impacts, values, history),
        integrator=solver.integrator,
        exponent=impacts.n[0].item(),
        closing_speed=v0,
        damping=values["lambda"],
        e_kinematic=(values["v2_post"] - values["v1_post"]) / v0 if v0 > 0.0 else float("nan"),
        e_kinetic=history.e_kinetic if history else values["e_kinetic"],
        e_energetic=history.e_energetic if history else values["e_energetic"],
        history=history_dataset(history, law.key, point) if history else None,
    )


def _derived_quantities(
    law: ForceModel, impacts: Impacts, values: Mapping[str, float], history: History | None
) -> dict[str, float]:
    """The values of DERIVED_QUANTITIES."""
    quantities = {name: getattr(impacts, name)[0].item() for name in ("m1", "m2", "R1", "R2", "m")}
    if law.unloading in (returning, stiffer) and values["status"] in (Status.OK, Status.LIMIT):
        recovered = values["peak_indentation"] - values["permanent_indentation"]
        quantities["K_r"] = values["peak_force"] / recovered ** impacts.n[0].item() if recovered else math.inf
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


def history_dataset(history: History, model: str, point: Mapping[str, float | str]) -> xr.Dataset:
    """The time history of one impact, over the time t since first contact.

    Parameters
    ----------
    history : the history
    model : key of the model
    point : the inputs of the impact by their config names, stored in the attribute `inputs`
    """
    dataset = xr.Dataset(
        {name: ("t", getattr(history, name), attributes_of(variable)) for name, variable in HISTORY.items()},
        coords={"t": ("t", history.t, {"units": "s", "long_name": "time since first contact"}), "model": model},
    )
    dataset.attrs = {
        "title": f"Time history of one impact, {model}",
        "schema_version": SCHEMA_VERSION,
        "impact_version": __version__,
        "inputs": json.dumps(dict(point)),
        "e_kinetic": history.e_kinetic,
        "e_energetic": history.e_energetic,
    }
    return dataset


def histories(
    dataset: xr.Dataset,
    models: Sequence[str] | None,
    at: Mapping[str, float | str],
    plugins: Plugins,
) -> list[xr.Dataset]:
    """Time histories of one point by several models; a dataset that is a time history is returned as it is.

    Parameters
    ----------
    dataset : a result, or a time history
    models : keys; by default all
    at : values of axes, which need not be on the grid; other axes take their first value. A parameter of one model
        is ignored by the others
    plugins : models that are not built in

    Raises
    ------
    UsageError : a model or an axis is not in the result, or no model has a history at this point
    """
    if "t" in dataset.dims:
        return [dataset]
    keys = [str(key) for key in dataset["model"].values.ravel()]
    for key in models or ():
        if key not in keys:
            raise UsageError(f'no model "{safe_text(key)}" in this result; {did_you_mean(key, keys)}')
    integrator = str(dataset.attrs.get("integrator", EXACT))
    if integrator != EXACT:
        raise UsageError(f"no motion to draw in this result: {no_motion(integrator)}")
    check_plugins(dataset.attrs, plugins, "the result")
    for changed in changed_plugins(dataset.attrs, plugins, "the result"):
        # a changed law has another motion than the result
        raise UsageError(changed)
    followed: list[xr.Dataset] = []
    ends: dict[str, str] = {}
    first: dict[str, float | str] = {}
    for key in dict.fromkeys(models or keys):
        others = {str(name) for name in dataset.coords if not InputName.parse(name).applies_to(key)}
        of_model = {name: value for name, value in at.items() if name not in others}
        config, names = single_point(dataset, (), plugins, key, of_model)
        impact = run_single_impact(Plan(config, plugins.of(config.models)), names)
        first |= {name: impact.point[name] for name in names}
        if impact.history is None:
            ends[key] = impact.status.meaning
        else:
            followed.append(impact.history)
    if not followed:
        where = ", ".join(f"{name} = {value}" for name, value in {**first, **at}.items())
        reason = next(iter(ends.values()))
        raise UsageError(f"no motion to draw at {safe_text(where)}: {reason}; choose a point, such as --sel e=0.5")
    return followed


def single_point(
    source: ConfigSource,
    overrides: Sequence[str],
    plugins: Plugins,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    over: Mapping[str, object] | None = None,
) -> tuple[Config, tuple[str, ...]]:
    """The config of a single impact, or of impacts over one input.

    Parameters
    ----------
    source : path of a TOML file or of a result, a mapping with the keys of a TOML file, a result, or None for the
        starter config at e = 0.5; a part of a result fixes the values at which it was selected
    overrides : changes to its config
    plugins : models that are not built in; a warning is issued for one that has changed since the result was made
    model : key of the model; by default the config's first
    at : values by config name, which need not be on the grid, except for inputs that vary together, in a zip group
        or in numbered cases; a case is chosen by the name of its dimension and its number
    over : values of an input, as in a config, that stay an axis

    Returns
    -------
    (Config, names) : a config without axes, but for those of `over`, and the names of the other axes that are not
        in `at` and took their first value

    Raises
    ------
    ConfigError, UsageError : a name is not an input of the config, or a value is not allowed
    ResultError : the config of a result cannot be read
    """
    read, parted = _config_reader(source, overrides, plugins)
    # each override, and the option that messages name instead
    option_names = {} if model is None else {override_text(("models",), [model]): f"--model {model}"}
    for name, values in (over or {}).items():
        option_names[override_text(InputName.parse(name).path, values)] = f"--over {name}"
    values = dict(at or {})

    def with_values() -> dict[str, str]:
        """The overrides, and those of all values of `at`."""
        by_override = {override_text(InputName.parse(k).path, v): f"--at {k}={v}" for k, v in values.items()}
        return {**option_names, **by_override}

    fixed_exponent = model is not None and find(model, plugins.models).exponent is not None
    if "K" in values and fixed_exponent and not _is_valid(read, with_values()):
        # K in [sweep] belongs to another exponent
        values[f"{model}.K"] = values.pop("K")
    try:
        config = _read_with_option_names(read, option_names)
    except ConfigError:
        for name in values:
            if not is_input(name) and not is_case(name):
                raise UsageError(
                    f'no input "{safe_text(name)}" here; {did_you_mean(name, list(SWEEP_QUANTITIES))}'
                ) from None
        # an input that the config lacks may be among the values of `at`
        option_names = with_values()
        config = _read_with_option_names(read, option_names)
    columns = [_selectable_columns(axis) for axis in config.axes]
    varied = {name for names in columns for name in names}
    if {"e", "alpha"} <= values.keys():
        raise UsageError("--at alpha: got alpha and e, expected one of the two")
    at = {**{name: value for name, value in parted.items() if name in varied}, **values}
    together = {name for names in columns if len(names) > 1 for name in names}
    inputs = [*(name for names in columns for name in names), *config.scalars]
    for name, value in at.items():
        if name not in inputs and name not in SWEEP_QUANTITIES and name != f"{config.models[0].key}.K":
            raise UsageError(f'no input "{safe_text(name)}" here; {did_you_mean(name, inputs)}')
        if name not in together:
            option_names[override_text(InputName.parse(name).path, value)] = f"--at {name}={value}"
    config = _read_with_option_names(read, option_names)

    scalars = dict(config.scalars)
    first: list[str] = []
    kept = tuple(axis for axis in config.axes if over and not over.keys().isdisjoint(axis.columns))
    for axis in (axis for axis in config.axes if axis not in kept):
        scalars |= {name: values[_position_on_axis(axis, at)] for name, values in axis.columns.items()}
        if axis.size > 1 and not any(name in at for name in _selectable_columns(axis)):
            first += axis.columns
    return replace(config, axes=kept, scalars=scalars, models=config.models[:1]), tuple(first)


def models_of_source(source: ConfigSource, overrides: Sequence[str], plugins: Plugins) -> tuple[str, ...]:
    """The keys of the models that a source of `single_point` selects; none where it selects no models.

    Its other values may not be valid yet: a parameter may be missing that is given or solved for later.

    Raises
    ------
    ConfigError : it cannot be read, or selects what is no model
    """
    read, _ = _config_reader(source, overrides, plugins)
    if (isinstance(source, str | Path) and is_result(Path(source))) or isinstance(source, xr.Dataset):
        return tuple(model.key for model in read(()).models)
    # the models of the starter config are no selection
    draft = open_config(Path(source) if isinstance(source, str) else source or {}, plugins.models)
    draft = draft.with_settings(map(Setting.parse, overrides))
    if "models" not in draft.data:
        return ()
    _, problems = expand_models(draft.data["models"], draft.known_models)
    return tuple(model.key for model in (read(()).models if problems else draft.models))


def _config_reader(
    source: ConfigSource, overrides: Sequence[str], plugins: Plugins
) -> tuple[ReadConfig, dict[str, float | str]]:
    """A function that reads the config of a source, and the scalar coordinates of a part of a result."""
    if source is None:
        text = STARTER_CONFIG.read_text(encoding="utf-8")
        first = ["sweep.e=0.5", *overrides]
        return lambda more: parse_config(text, [*first, *more], plugins.models, name="starter"), {}
    if isinstance(source, str | Path) and is_result(Path(source)):
        with open_result(source) as stored:
            return _stored_config_reader(stored, overrides, plugins, str(source))
    if isinstance(source, xr.Dataset):
        return _stored_config_reader(source, overrides, plugins, "the result")
    path_or_table = Path(source) if isinstance(source, str) else source
    return lambda more: read_config(path_or_table, [*overrides, *more], plugins.models), {}


def _stored_config_reader(
    dataset: xr.Dataset, overrides: Sequence[str], plugins: Plugins, name: str
) -> tuple[ReadConfig, dict[str, float | str]]:
    require_sweep(dataset, name)
    attributes = dict(dataset.attrs)
    single = {str(key): label.values.item() for key, label in dataset.coords.items() if label.ndim == 0}
    if "config" in attributes:
        check_plugins(attributes, plugins, name)
        for note in (*changed_plugins(attributes, plugins, name), *unknown_plugins(attributes, plugins, name)):
            warnings.warn(note, stacklevel=4)

    def read(more: Sequence[str]) -> Config:
        return stored_config(attributes, [*overrides, *more], plugins, name, allow_changed_plugins=True)

    return read, {key: value for key, value in single.items() if key != "model"}


def _selectable_columns(axis: Axis) -> dict[str, Sequence[float | str]]:
    """The values that can select a point of an axis: its columns, and the number of a case."""
    return {**({axis.numbered: axis.labels} if axis.numbered else {}), **axis.columns}


def _position_on_axis(axis: Axis, at: Mapping[str, float | str]) -> int:
    """The position on an axis at which its columns have the values of `at`."""
    columns = _selectable_columns(axis)
    for position in range(axis.size):
        if all(columns[name][position] == value for name, value in at.items() if name in columns):
            return position
    requested = ", ".join(f"{name} = {value}" for name, value in at.items() if name in columns)
    raise UsageError(f"{safe_text(requested)}: not on the zipped axis {axis.name}; these values vary together")


def _is_valid(read: ReadConfig, option_names: Mapping[str, str]) -> bool:
    """Whether a config can be read with some overrides."""
    try:
        read(list(option_names))
    except ConfigError:
        return False
    return True


def _read_with_option_names(read: ReadConfig, option_names: Mapping[str, str]) -> Config:
    """Read a config; messages about its overrides name the options of the user instead."""
    try:
        return read(list(option_names))
    except ConfigError as error:
        names = {f"--set {override}:": f"{name}:" for override, name in option_names.items()}
        raise ConfigError(*(_with_option_name(line, names) for line in error.problems)) from None


def _with_option_name(line: str, names: Mapping[str, str]) -> str:
    """A line of a message with the override at its start replaced by the option."""
    return next((safe_text(new) + line[len(old) :] for old, new in names.items() if line.startswith(old)), line)
