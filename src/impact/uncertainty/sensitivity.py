"""Which uncertain input matters: the sensitivity of an output of every model, at each point of the other axes.

The estimators of Sobol indices are those of Saltelli and others (2010), Computer Physics Communications 181,
259-270, which `scipy.stats.sobol_indices` has too. Both are functions of means over the rows of two sample
matrices, so that a resample of the bootstrap is a product of a matrix of counts with the averaged columns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from ..array_types import Array
from ..atomic import check_outputs, check_result_name
from ..config.files import path_text
from ..config.grid import MAX_POINTS, SAMPLE, draw_columns, unit_samples
from ..config.input_names import InputName
from ..config.load import Config
from ..config.tables import power_of_two_problem
from ..contact.model import ForceModel
from ..contact.status import FrictionStatus
from ..contact.variables import OUTPUTS
from ..engine.plan import Plan
from ..engine.run import Run
from ..errors import ConfigError, UsageError, require_known, warn
from ..formatting import argument
from ..results.schema import SENSITIVITY, plan_coordinates, provenance_attributes, scale_of, template
from ..results.selection import as_keys
from ..results.sensitivity import HALF, QUANTILES
from ..results.sweep import read_plan, sweep_in_memory
from ..results.xarray_backend import save

# an output whose standard deviation is a smaller multiple of rtol and of the largest scale of errors is constant
CONSTANT_FACTOR = 10.0
# resamples of the bootstrap, and its level; with 200 the ends are so uncertain that fewer intervals hold the index
RESAMPLES, CONFIDENCE = 1000, 0.95
# numbers in a block of resamples
MAX_BLOCK = 2**22


def sensitivity(
    source: str | Path | Mapping[str, object],
    *,
    of: str = "e_out",
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
    execute: Callable[..., xr.Dataset] | None = None,
) -> xr.Dataset:
    """Find which uncertain input matters: Sobol indices of an output, its mean and quantiles, for every model.

    An output that depends on friction is studied for every pair of a model and a friction law.

    For n samples of d uncertain inputs, n (d + 2) points are computed for each model and each point of the other
    axes.

    Parameters
    ----------
    source : a TOML file, or a mapping with the same keys, with distributions and `[design]`
    of : name of the output
    output : result file to write
    overwrite : replace it if it exists
    overrides, plugins : see `sweep`
    max_points : the largest number of points
    execute : deprecated; function that runs a plan, by default it is run in this process

    Returns
    -------
    Dataset : of dimensions model, the axes of the config, and input; see docs/uncertainty.md

    Raises
    ------
    ConfigError : with one line for each problem; there is no design, or its n is not a power of two >= 2
    UsageError, StoreError : there is no such output, or the file exists or cannot be written

    The peak force of Hertz' law is proportional to K^0.4 v^1.2:

    >>> import impact
    >>> study = impact.sensitivity({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 1024},
    ... }, of="peak_force")
    >>> study["first"].values.round(2).tolist()
    [[0.56, 0.43]]
    """
    (result,) = sensitivities(**{**locals(), "of": [of]})
    return result


def sensitivities(
    source: str | Path | Mapping[str, object],
    of: str | Sequence[str],
    *,
    output: str | Path | None = None,
    overwrite: bool = False,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    max_points: int = MAX_POINTS,
    execute: Callable[..., xr.Dataset] | None = None,
) -> list[xr.Dataset]:
    """Find the `sensitivity` of several outputs, whose points are computed once.

    Parameters
    ----------
    of : names of the outputs; of one alone the result can be written
    source, output, overwrite, overrides, plugins, max_points, execute : see `sensitivity`

    Returns
    -------
    list of Dataset : one for each output, in their order, see `sensitivity`

    Raises
    ------
    ConfigError, UsageError, StoreError : see `sensitivity`

    >>> import impact
    >>> studies = impact.sensitivities({
    ...     "models": "hertz",
    ...     "sweep": {"v1": {"uniform": [0.8, 1.2]}, "m1": 1.0, "m2": 1.0, "K": {"uniform": [5e5, 1.5e6]}},
    ...     "design": {"n": 64},
    ... }, ["peak_force", "contact_time"])
    >>> [round(study["mean"].item(), 5) for study in studies]
    [187.75797, 0.00998]
    """
    names = [name for name, variable in OUTPUTS.items() if not variable.flags]
    of = as_keys(of, "of")
    require_known(of, names, f"{argument('of')}: no output")
    if output is not None and len(of) > 1:
        raise UsageError(
            f"{argument('output')}: got {len(of)} outputs ({argument('of')}), expected one for a file"
        )
    plan = read_plan(source, overrides, plugins, Run(max_points=max_points))
    for name in of if not plan.frictions else ():
        if OUTPUTS[name].of_friction:
            raise UsageError(
                f'{argument("of", name)}: got no friction law, expected frictions, such as ["coulomb-1785"]'
            )
    plan = sensitivity_plan(plan, of, max_points, str(source) if isinstance(source, str | Path) else "config")
    check_outputs([output], [source, *plugins, *plan.config.files], overwrite=overwrite)
    check_result_name(output)
    swept = (execute or sweep_in_memory)(plan)
    results = [sensitivity_of(plan, name, swept) for name in of]
    if output is not None:
        save(results[0], output, overwrite=overwrite)
    return results


def sensitivity_plan(plan: Plan, of: Sequence[str], max_points: int, name: str) -> Plan:
    """Plan all points that the indices of outputs need: n (inputs + 2) for each n of the design."""
    config = plan.config
    if config.design is None:
        example = "[design] n = 1024 and v1 = { normal = [1.0, 0.05] }"
        raise ConfigError(
            f"{name}: got no uncertain input, expected a design and distributions, such as {example}"
        )
    problem = power_of_two_problem(config.design.n, "for Sobol indices")
    if config.design.n == 1:
        problem = "got 1, expected a power of two from 2 on for Sobol indices: 2 or 4"
    if problem:
        raise ConfigError(f"{name}: design.n: {problem}")
    names = list(config.distributions)
    models = {model.key: model for model in config.models}
    u = unit_samples(config.design, 2 * len(names))
    draws = [draw_columns(config.distributions, models, half) for half in np.split(u, 2, axis=1)]
    problems = {key: text for _, of_draw in draws for key, text in of_draw.items()}
    if problems:
        paths = {key: path_text(InputName.parse(key).path) for key in problems}
        raise ConfigError(*(f"{name}: {paths[key]}: {text}" for key, text in problems.items()))
    rows = mixed_rows(*(np.column_stack([drawn[key] for key in names]) for drawn, _ in draws))
    columns = dict(zip(names, (tuple(column) for column in rows.T.tolist()), strict=True))
    axes = tuple(replace(axis, columns=columns) if axis.name == SAMPLE else axis for axis in config.axes)
    output = replace(config.output, variables=tuple(of), dtype="float64", chunks={})
    whole = replace(plan, config=replace(config, axes=axes, output=output))
    if whole.points > max_points:
        got = f"{whole.points:,} points, {len(names) + 2} for each sample"
        raise UsageError(f"{name}: got {got}, expected at most {max_points:,} ({argument('max_points')})")
    return whole


def sensitivity_of(plan: Plan, of: str, swept: xr.Dataset) -> xr.Dataset:
    """Build the dataset of the sensitivity of an output."""
    plan = replace(plan, config=replace(plan.config, output=replace(plan.config.output, variables=(of,))))
    config = plan.config
    assert config.design is not None
    inputs, n = list(config.distributions), config.design.n
    # the reference is the same for each model
    outputs = swept[of].broadcast_like(swept["model"]).transpose("model", ..., SAMPLE)
    others = [str(dim) for dim in outputs.dims if dim not in ("model", SAMPLE)]
    shape = (-1, len(inputs) + 2, n)
    values = np.asarray(outputs.values, float).reshape(shape)

    def read(name: str) -> Array:
        return np.asarray(swept[name].broadcast_like(outputs).transpose(*outputs.dims).values)

    scale = scale_of(OUTPUTS[of], read, has_peak="peak_indentation" in swept)
    statistics = _statistics(values, np.broadcast_to(scale, outputs.shape).reshape(shape), config)
    # a pair that has no meaning has not failed, nor has a law without the output
    complete = (FrictionStatus.OK, FrictionStatus.SLOW_LIMIT, FrictionStatus.NOT_COMBINABLE)
    is_lacking = np.isnan(values) & np.isin(read(OUTPUTS[of].status).reshape(shape), complete)
    statistics["failed"][is_lacking.all(axis=(1, 2))] = 0
    slow = int((read("friction_status") == FrictionStatus.SLOW_LIMIT).sum()) if OUTPUTS[of].of_friction else 0
    if slow:
        meaning = FrictionStatus.SLOW_LIMIT.meaning
        warn(f"{of} of {slow:,} of {values.size:,} points is {meaning}; see impact timestep")
    of_plan, paths = plan_coordinates(plan).variables, [InputName.parse(name).config_key for name in inputs]
    studied = {
        "input": ("input", paths, {"long_name": "uncertain input, by its path in the config"}),
        "quantile": ("quantile", list(QUANTILES), {"long_name": "probability", "units": "1"}),
    }
    coords = xr.Coordinates({name: v for name, v in of_plan.items() if SAMPLE not in v.dims} | studied)
    variables = (replace(v, unit=OUTPUTS[of].unit) if v.unit == "output" else v for v in SENSITIVITY.values())
    arrays = {
        name: (dims, statistics[name].reshape(zeros.shape).astype(zeros.dtype), attributes)
        for name, (dims, zeros, attributes) in template(variables, coords.sizes, others).items()
    }
    return xr.Dataset(arrays, coords, provenance_attributes(plan) | {"of": of})


def _statistics(values: Array, scale: Array, config: Config) -> dict[str, Array]:
    """Compute the statistics of outputs, from shape (outputs, inputs + 2, n); NaN for one with a failed sample.

    `scale` is that of errors of the integration, of the same shape.
    """
    assert config.design is not None
    outputs, blocks, n = values.shape
    failed = np.isnan(values).sum(axis=(1, 2))
    independent = values[:, :2].reshape(outputs, -1)
    mean, deviation = independent.mean(axis=1), independent.std(axis=1, ddof=1)
    resolution = CONSTANT_FACTOR * config.solver.rtol * np.abs(scale[:, :2]).max(axis=(1, 2))
    # indices are NaN for a constant output, and zero for an input that changes it by errors of the integration
    varies = deviation > resolution
    changes = np.abs(values[:, 2:] - values[:, :1]).max(axis=2) > resolution[:, None]
    values = np.concatenate([values[:, :2], np.where(changes[..., None], values[:, 2:], values[:, :1])], axis=1)
    indices = indices_of(values, config.design.seed)
    half = indices_of(np.ascontiguousarray(values[..., : n // 2])) if n > 2 else {}
    unknown = np.full((outputs, blocks - 2), np.nan)
    indices |= {name: half.get(name.removesuffix("_half"), unknown) for name in HALF}
    return {
        "failed": failed,
        "mean": mean,
        "sd": deviation,
        "quantiles": np.quantile(independent, QUANTILES, axis=1).T,
        **{name: np.where(varies[:, None], array, np.nan) for name, array in indices.items()},
    }


def mixed_rows(a: Array, b: Array) -> Array:
    """Stack A, B, and A with each column of B, shape (n, inputs) to (n (inputs + 2), inputs)."""
    mixed = [np.where(np.arange(a.shape[1]) == column, b, a) for column in range(a.shape[1])]
    return np.concatenate([a, b, *mixed])


def indices_of(values: Array, seed: int | None = None) -> dict[str, Array]:
    """Compute Sobol indices, with intervals by the percentiles of a bootstrap over the rows.

    Parameters
    ----------
    values : at the rows of `mixed_rows`, shape (outputs, inputs + 2, n)
    seed : of the bootstrap; None for no intervals

    Returns
    -------
    dict : the indices and the ends of their intervals of 95 % by the name of the variable,
        of shape (outputs, inputs); the ends are NaN without a bootstrap

    >>> a, b = np.random.default_rng(1).random((2, 4096, 2))
    >>> x, y = mixed_rows(a, b).T
    >>> indices_of((x + y).reshape(1, 4, 4096))["first"].round(1)
    array([[0.5, 0.5]])
    """
    n = values.shape[2]
    estimates = np.stack([_indices_from_means(_columns(block).mean(axis=1)) for block in values])
    resampled = np.empty((len(values), 0 if seed is None else RESAMPLES, estimates.shape[1]))
    # not the random numbers of the samples, which have the same seed
    random = np.random.default_rng(None if seed is None else [seed, 1])
    step = max(MAX_BLOCK // n, 1)
    for start in range(0, resampled.shape[1], step):
        drawn = [random.integers(0, n, n) for _ in range(start, min(start + step, RESAMPLES))]
        counts = np.stack([np.bincount(rows, minlength=n) for rows in drawn]) / n
        for block, of_block in zip(values, resampled, strict=True):
            of_block[start : start + step] = _indices_from_means(counts @ _columns(block).T)
    lower = upper = np.full_like(estimates, np.nan)
    if seed is not None:
        ends = 0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE
        # as the indices are, while an estimate may lie outside
        lower, upper = np.clip(np.quantile(resampled, ends, axis=1), 0.0, 1.0)
    return {
        f"{name}{end}": part
        for end, array in (("", estimates), ("_lower", lower), ("_upper", upper))
        for name, part in zip(("first", "total"), np.split(array, 2, axis=1), strict=True)
    }


def _columns(values: Array) -> Array:
    """Build the columns whose means give the indices of one output, shape (3 inputs + 2, n)."""
    a, b, *_ = mixed = values - values[:2].mean()
    change = mixed[2:] - a
    return np.concatenate([b * change, change, 0.5 * change**2, [0.5 * (a * a + b * b), 0.5 * (a + b)]])


def _indices_from_means(means: Array) -> Array:
    """Compute first-order and total indices, shape (..., 2 inputs); zero where the output does not vary."""
    *_, square, mean = np.moveaxis(means, -1, 0)
    first, change, total = np.split(means[..., :-2], 3, axis=-1)
    explained = np.concatenate([first - mean[..., None] * change, total], axis=-1)
    variance = (square - mean * mean)[..., None]
    indices: Array = np.divide(explained, variance, out=np.zeros_like(explained), where=variance > 0.0)
    return indices
