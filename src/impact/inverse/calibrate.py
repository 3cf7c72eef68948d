"""Calibrate laws with measurements: which laws fit, with which parameters, and what the data cannot determine."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from ..arguments import require_counts
from ..array_types import Array, Int8Array
from ..atomic import check_outputs, check_result_name, write_file
from ..config.files import override_text
from ..config.input_names import InputName
from ..config.load import Config, parse_config, read_config
from ..config.measurements import fitted_parameters
from ..config.quantities import Quantity, middle_of
from ..contact.dimensionless import exponent_names
from ..contact.friction import Pair
from ..contact.interpolant import InterpolatedCollisions, motion_key
from ..contact.model import ForceModel
from ..contact.simulate import ComputeCollisions
from ..contact.units import dimension
from ..display import TABLE_SUFFIXES, TableForm, write_table
from ..engine.execute import WorkerContext, context_of, models_of_context
from ..engine.executors import choose_executor
from ..engine.plan import Plan
from ..engine.plugins import Plugins, read_plugins
from ..engine.trajectories import PlanLaw, model_of
from ..errors import ConfigError, UsageError, warn
from ..formatting import argument, law_keys
from ..results.calibration import Fits, calibration_template, fitted_config, position_of_law
from ..results.schema import FIT_STATUSES
from ..results.summary import input_notes
from ..results.xarray_backend import save
from .batched_solvers import VectorFunction
from .fit import Bounds, DataPoints, Fit, FitProblem, fit_all
from .prepared import interpolated, outputs_at
from .solve import SolveProblem, unknown_of

# points of the curve of each law over an input
CURVE_POINTS = 101
# the curve is spaced logarithmically if the largest value of the input is larger by this factor
LOG_CURVE_RATIO = 30.0
# ratio of a bound of a natural range to the size of a parameter in the contact's own units
NATURAL_RATIO = 1e4
# variables of a calibration that are fields of a fit
FIT_VARIABLES = ("chi2_reduced", "p_value", "excess", "aicc", "loo", "predicted", "residual", "loo_residual")
# denominators of the exponents of a group of parameters
MAX_DENOMINATOR = 12


def laws_to_fit(config: Config) -> dict[str, PlanLaw]:
    """List the candidates by key: the models, or with friction laws their pairs, MODEL with FRICTION."""
    laws = Plan(config).laws
    return {law.key: law for law in (laws[len(config.models) :] if config.frictions else laws)}


def parameters_of(config: Config, law: PlanLaw) -> tuple[str, ...]:
    """List the config names of the fitted parameters of a law."""
    model, friction = model_of(law), law.friction if isinstance(law, Pair) else None
    return fitted_parameters(config.fits, model, friction, config.scalars)


def calibrate(
    source: str | Path | Mapping[str, object],
    *,
    output: str | Path | None = None,
    best: str | Path | None = None,
    model: str | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    jobs: int = 1,
) -> xr.Dataset:
    """Fit laws to measurements: which law fits, with which parameters, and what the data cannot determine.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with `[data]` and values `{ fit = [least, most] }`
    output : result file to write, or file of its table: .csv, .tex or .parquet
    best : TOML file to write, with the config of the best law and its parameters, for `sweep` and `export`
    model : key of the law whose config is written there, in place of the best one
    overwrite : replace files that exist
    overrides, plugins : see `sweep`
    jobs : number of processes; the result has the same bits for any number

    Returns
    -------
    Dataset : of dimensions model, parameter and point, the best law first; see docs/calibrate.md

    Raises
    ------
    ConfigError : with one line for each problem
    UsageError, StoreError : a file exists or cannot be written

    The restitution that a linear spring and dashpot was asked for, from three measurements of it:

    >>> import impact
    >>> fit = impact.calibrate({
    ...     "models": "anagnostopoulos-1988",
    ...     "sweep": {"v1": 1.0, "m1": 1.0, "m2": 1.0, "K": 1e6, "n": 1.0, "e": {"fit": [0.1, 1.0]}},
    ...     "data": {"columns": {"e_out": [0.49, 0.5, 0.51], "sigma": [0.01, 0.01, 0.01]}},
    ... })
    >>> round(fit["estimate"].item(), 6), round(fit["chi2_reduced"].item(), 6)
    (0.5, 1.0)
    """
    require_counts(jobs=jobs)
    plugin_set = read_plugins(plugins)
    config = read_config(source, overrides, plugin_set.models, purpose="calibrate")
    check_outputs([output, best], [source, *plugins, *config.files], overwrite=overwrite)
    is_table = output is not None and Path(output).suffix.lower() in TABLE_SUFFIXES
    if output is not None and not is_table:
        check_result_name(output)
    if model is not None:
        if best is None:
            best_file = argument("best", "FILE")
            raise UsageError(f"{argument('model')}: set without {best_file}, which is written for that law")
        position_of_law(list(laws_to_fit(config)), model, argument("model"))
    name = str(source) if isinstance(source, str | Path) else "config"
    plan = Plan(config)
    known = {key: value for key, value in config.scalars.items() if key not in config.fits}
    implausible = input_notes(replace(plan.inputs, scalars=known))
    warn(*config.notes, *implausible, *plan.pair_notes(f"{name}: frictions"))
    taken = {parameter for law in laws_to_fit(config).values() for parameter in parameters_of(config, law)}
    unused = [InputName.parse(parameter).config_key for parameter in config.fits if parameter not in taken]
    warn(*(f"{name}: {path}: no law takes it, and it is not fitted" for path in unused))
    result = calibrate_config(config, plugin_set.of(config.models), jobs)
    if output is not None and is_table:
        write_table(Fits(result), Path(output), TableForm(), overwrite=overwrite)
    elif output is not None:
        save(result, output, overwrite=overwrite)
    if best is not None:
        position = (
            0 if model is None else position_of_law(result["model"].values.tolist(), model, argument("model"))
        )
        text = fitted_config(config, result.isel(model=position))
        write_file(Path(best), text.encode(), overwrite=overwrite)
    return result


def calibrate_config(config: Config, plugins: Plugins, jobs: int = 1) -> xr.Dataset:
    """Fit the laws of a config to its measurements; see `calibrate`."""
    natural = natural_bounds(config)
    config = replace(config, fits={**config.fits, **natural})
    keys = list(laws_to_fit(config))
    if jobs > 1 and len(keys) > 1:
        context = context_of(Plan(config, plugins))
        with choose_executor(jobs).start() as executor:
            bounds = [override_text(InputName.parse(name).path, {"fit": list(natural[name])}) for name in natural]
            overrides = (*config.overrides, *bounds)
            fit = partial(_fit_remotely, text=config.text, overrides=overrides, context=context)
            laws = dict(zip(keys, executor.map(fit, keys), strict=True))
    else:
        laws = fit_laws(config)
    return _calibration_dataset(config, plugins, laws)


def natural_bounds(config: Config) -> dict[str, tuple[float, float]]:
    """Find the bounds of parameters with `fit = true`: decades about the size of which `solve` tries values."""
    bounds: dict[str, tuple[float, float]] = {}
    scalars = dict(config.scalars)
    names = [name for name, (least, _) in config.fits.items() if math.isnan(least)]
    # that of the stiffness gives the sizes of others
    for name in sorted(names, key=lambda name: (not name.endswith("K"), names.index(name))):
        parsed = InputName.parse(name)
        model = next((model for model in config.models if model.key == parsed.model), config.models[0])
        # of a K neither its own placeholder nor the K of other laws
        is_K = parsed.key == "K"
        others = {key: value for key, value in scalars.items() if not is_K or InputName.parse(key).key != "K"}
        one = replace(config, models=(model,), scalars=others, axes=())
        friction = next((law for law in config.frictions if parsed.friction in ("", law.key)), None)
        unknown = unknown_of(model, name if parsed.friction else parsed.key, friction)
        size = SolveProblem(one, unknown, "e_out").natural_size(math.nan if is_K else 1.0)
        if math.isnan(size):
            expected = "expected fit = [least, most]: without a material it has no natural range"
            raise ConfigError(f"{parsed.config_key}: got fit = true, {expected}")
        quantity = _quantity(config, name)
        bounds[name] = (max(size / NATURAL_RATIO, quantity.least), min(size * NATURAL_RATIO, quantity.most))
        scalars[name] = middle_of(*bounds[name])
    return bounds


def prediction(
    config: Config,
    law: PlanLaw,
    names: Sequence[str],
    inputs: Mapping[str, Sequence[float]],
    points: int,
    compute: ComputeCollisions | None = None,
) -> VectorFunction:
    """Build the function from parameters, shape (k, len(names)), to outputs of a law, shape (k, outputs inputs).

    The outputs at the first `points` inputs, those of the measurements, come first, all of one output before the
    next one; then those at the other inputs. NaN where the law has no result. `compute` is that of
    `impact.contact.simulate.simulate`.
    """
    assert config.data is not None
    outputs = tuple(config.data.outputs)
    count = max(map(len, inputs.values()), default=points)

    def predict(rows: Array) -> Array:
        columns = {name: np.tile(values, len(rows)) for name, values in inputs.items()}
        columns |= {name: np.repeat(values, count) for name, values in zip(names, rows.T, strict=True)}
        collisions = outputs_at(config, law, columns, outputs, compute)
        # without any column there is one collision
        size = len(rows) * count
        values = np.stack([np.broadcast_to(collisions[name], size).reshape(-1, count) for name in outputs], axis=1)
        return np.hstack([part.reshape(len(rows), -1) for part in np.split(values, [points], axis=2)])

    return predict


def _fit_remotely(key: str, text: str, overrides: Sequence[str], context: WorkerContext) -> Fit:
    """Fit the law of a key, in any process, with a config given by its text and overrides."""
    models = models_of_context(context)
    plugins = [models[name] for name, _ in context.hashes]
    law = dict(zip(("models", "frictions"), law_keys(key), strict=False))
    selection = [override_text((name,), [law_key]) for name, law_key in law.items()]
    return fit_laws(parse_config(text, [*overrides, *selection], plugins, "", purpose="calibrate"))[key]


def fit_laws(config: Config) -> dict[str, Fit]:
    """Fit all laws of a config, evaluated together in this process."""
    assert config.data is not None
    data = config.data
    values = np.concatenate([*data.outputs.values()])
    sigma = np.concatenate([data.sigma.get(name, np.ones(len(column))) for name, column in data.outputs.items()])
    specimens = np.unique(data.specimens, return_inverse=True)[1] if data.specimens else None
    # without standard deviations nothing but the values says what is small
    size = float(np.sqrt(np.mean((values / sigma) ** 2))) or 1.0 if data.noise == "scale" else 1.0
    points = DataPoints(values, size * sigma, data.noise, specimens, data.loss)
    laws = laws_to_fit(config)
    problems: list[FitProblem] = []
    shared: dict[object, InterpolatedCollisions] = {}
    varied, grid = varied_input(data.inputs)
    with_curve = {
        name: [*column, *(grid.tolist() if name == varied else [column[0]] * grid.size)]
        for name, column in data.inputs.items()
    }
    for law in laws.values():
        names = parameters_of(config, law)
        compute = interpolated(config, law, tuple(data.outputs))
        if compute is not None:
            compute = shared.setdefault(motion_key(model_of(law)), compute)
        function = prediction(config, law, names, data.inputs, len(data.lines), compute)
        integrated = prediction(config, law, names, with_curve, len(data.lines))
        problems.append(FitProblem(function, _bounds(config, names), points, integrated))
    return {
        key: replace(fit, chi2_reduced=size**2 * fit.chi2_reduced, loo=size * fit.loo)
        for key, fit in zip(laws, fit_all(problems), strict=True)
    }


def _bounds(config: Config, names: Sequence[str]) -> Bounds:
    """Read the bounds of parameters; ends of the allowed values are limits of the physics."""
    lower, upper = np.array([config.fits[name] for name in names]).reshape(-1, 2).T
    quantities = [_quantity(config, name) for name in names]
    ends = [[quantity.least for quantity in quantities], [quantity.most for quantity in quantities]]
    return Bounds(lower, upper, np.array([lower, upper]) == np.array(ends))


def varied_input(inputs: Mapping[str, Sequence[float]]) -> tuple[str, Array]:
    """Find the only input that varies among the points, and the values of its curve; "" for several or none."""
    varying = {name: np.asarray(column) for name, column in inputs.items() if len(set(column)) > 1}
    if len(varying) != 1:
        return "", np.array([])
    ((name, column),) = varying.items()
    lower, upper = float(column.min()), float(column.max())
    space = np.geomspace if lower > 0.0 and upper / lower > LOG_CURVE_RATIO else np.linspace
    return name, space(lower, upper, CURVE_POINTS)


def determined_groups(config: Config, model: ForceModel, names: Sequence[str], fit: Fit) -> list[str]:
    """Write what the data determine of the other parameters as products of powers, dimensionless by m and v0."""
    involved = [name for name, is_identifiable in zip(names, fit.identifiable, strict=True) if not is_identifiable]
    if not involved or any(config.fits[name][0] <= 0.0 for name in involved):
        return []
    # the directions that the data do determine, in reduced echelon form from the last parameter on
    _, sizes, rows = np.linalg.svd(fit.unidentified[:, ~fit.identifiable])
    complement = rows[np.count_nonzero(sizes > 0.5) :]
    units = [_quantity(config, name).unit for name in involved]
    groups = []
    for row in _reduced(complement[:, ::-1])[:, ::-1].tolist():
        powers = {InputName.parse(name).key: _fraction(power) for name, power in zip(involved, row, strict=True)}
        groups.append(_product(_completion(list(powers.values()), units, config, model) | powers))
    return groups


def _quantity(config: Config, name: str) -> Quantity:
    quantity = InputName.parse(name).quantity({model.key: model for model in config.models})
    assert quantity is not None
    return quantity


def _completion(
    powers: Sequence[Fraction], units: Sequence[str], config: Config, model: ForceModel
) -> dict[str, Fraction]:
    """Find the powers of m and v0 that make a product of powers dimensionless; empty if none do."""
    dimensions = set()
    for exponents in _exponents(config, model):
        of_units = [dimension(unit, exponents) for unit in units]
        fractions = np.vectorize(_fraction, otypes=[object])(of_units)
        dimensions.add(tuple(np.array(powers, object) @ fractions))
    mass, length, time = dimensions.pop()
    if dimensions or length != -time:
        return {}
    return {name: power for name, power in (("m", -mass), ("v0", time)) if power}


def _exponents(config: Config, model: ForceModel) -> Iterator[dict[str, float]]:
    """List values of n and of parameters in exponents of units; units linear in them need two values of each."""
    assert config.data is not None
    ends: dict[str, Collection[float]] = {}
    for name in exponent_names(model) | {"n"}:
        key = name if name == "n" else f"{model.key}.{name}"
        measured = config.data.inputs.get(key)
        if name == "n" and model.exponent:
            ends[name] = [model.exponent]
        elif key in config.fits:
            ends[name] = [1.0, 2.0]
        else:
            ends[name] = {min(measured), max(measured)} if measured else [float(config.scalars[key])]
    for values in itertools.product(*ends.values()):
        yield dict(zip(ends, values, strict=True))


def _fraction(power: float) -> Fraction:
    return Fraction(float(power)).limit_denominator(MAX_DENOMINATOR)


def _reduced(rows: Array) -> Array:
    """Bring independent rows to reduced row echelon form.

    >>> _reduced(np.array([[0.0, 2.0, 4.0], [0.0, 1.0, 3.0]])).round(12).tolist()
    [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    ranks = [np.linalg.matrix_rank(rows[:, :end], tol=1e-6) for end in range(rows.shape[1] + 1)]
    pivots = np.flatnonzero(np.diff(ranks))
    return np.asarray(np.linalg.solve(rows[:, pivots], rows), float)


def _product(powers: Mapping[str, Fraction]) -> str:
    """Write a product of powers.

    >>> _product({"m": Fraction(-1, 2), "C": Fraction(1), "K": Fraction(-1, 2)})
    'C/sqrt(m K)'
    """
    above, below = ([(name, abs(p)) for name, p in powers.items() if p * sign > 0] for sign in (1, -1))
    denominator = _factors(below)
    return (_factors(above) or "1") + (f"/{denominator}" if denominator else "")


def _factors(powers: Sequence[tuple[str, Fraction]]) -> str:
    roots = [name for name, power in powers if power == Fraction(1, 2)]
    words = [
        name if power == 1 else f"{name}^{power if power.denominator == 1 else f'({power})'}"
        for name, power in powers
        if name not in roots
    ]
    if roots:
        words.append(f"sqrt({' '.join(roots)})")
    text = " ".join(words)
    return f"({text})" if len(words) > 1 else text


def _calibration_dataset(config: Config, plugins: Plugins, fits: Mapping[str, Fit]) -> xr.Dataset:
    """Store the fits of laws, the best law first: by AICc, those without one last, by chi2."""
    assert config.data is not None
    candidates = laws_to_fit(config)

    # a law at a bound is ranked by what it reaches there: a wider search can only improve it. Laws that fit
    # equally well are in the order of the config
    def rank(key: str) -> tuple[float, float]:
        fit = fits[key]
        if not math.isnan(fit.aicc):
            return round(fit.aicc, 6), 0.0
        return math.inf, math.inf if math.isnan(fit.chi2_reduced) else fit.chi2_reduced

    keys = sorted(fits, key=rank)
    laws, ranked = [candidates[key] for key in keys], [fits[key] for key in keys]
    parameters, groups = list(config.fits), []
    varied = varied_input(config.data.inputs)
    dataset = calibration_template(config, laws, plugins, varied)
    shape = (len(keys), len(parameters))
    arrays = {name: np.full(shape, np.nan) for name in ("estimate", "lower", "upper")}
    covariance = np.full((*shape, len(parameters)), np.nan)
    identifiable = np.full(shape, -1, np.int8)
    for row, (law, fit) in enumerate(zip(laws, ranked, strict=True)):
        names = parameters_of(config, law)
        columns = [parameters.index(name) for name in names]
        for name, array in arrays.items():
            array[row, columns] = getattr(fit, name)
        covariance[row][np.ix_(columns, columns)] = fit.covariance
        identifiable[row, columns] = fit.identifiable
        groups.append("; ".join(determined_groups(config, model_of(law), names, fit)))
    weights = akaike_weights({key: fit.aicc for key, fit in fits.items()})
    values: dict[str, Array | Int8Array] = {
        **arrays,
        "covariance": covariance,
        "identifiable": identifiable,
        "fit_status": np.array([list(FIT_STATUSES).index(fit.status) for fit in ranked], np.int8),
        "weight": np.array([weights[key] for key in keys]),
        **{name: np.array([getattr(fit, name) for fit in ranked]) for name in FIT_VARIABLES},
    }
    if varied[0]:
        # each output over the varied input, with the ends of its band of 95 % without the noise
        parts = [[fit.other_predicted for fit in ranked], [fit.other_half_width for fit in ranked]]
        curve, half = (np.reshape(part, dataset["curve"].shape) for part in parts)
        values |= {"curve": curve, "curve_lower": curve - half, "curve_upper": curve + half}
    variables = {name: dataset.variables[name].copy(data=array) for name, array in values.items()}
    return dataset.assign(variables).assign_coords(determined=("model", groups))


def akaike_weights(aicc: Mapping[str, float]) -> dict[str, float]:
    """Weigh laws by their AICc; 0 for those without one, NaN if none has one.

    >>> akaike_weights({"hertz": 3.0, "tsuji-1992": 3.0, "bilinear": math.nan})
    {'hertz': 0.5, 'tsuji-1992': 0.5, 'bilinear': 0.0}
    >>> akaike_weights({"hertz": math.nan})
    {'hertz': nan}

    Weights depend on differences alone, also where the AICc are those of thousands of points:

    >>> akaike_weights({"hertz": -3000.0, "tsuji-1992": -3000.0, "bilinear": 3000.0})
    {'hertz': 0.5, 'tsuji-1992': 0.5, 'bilinear': 0.0}
    """
    smallest = min((value for value in aicc.values() if not math.isnan(value)), default=0.0)
    likelihood = {key: np.exp(-0.5 * np.nan_to_num(value - smallest, nan=np.inf)) for key, value in aicc.items()}
    total = sum(likelihood.values())
    return {key: float(value / total) if total else math.nan for key, value in likelihood.items()}
