"""Repeat the computation of a result, and compare the new values with it."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import SupportsFloat

import xarray as xr

from ..config.grid import MAX_POINTS
from ..contact.model import ForceModel
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..formatting import law_keys
from ..results.provenance import command_start, config_of_part, stored_config, unknown_plugins
from ..results.schema import kind_of, require_sweep
from ..results.sweep import sweep_in_memory
from ..results.xarray_backend import load
from .compare import Tolerances, compare
from .verdict import Verdict


def rerun(
    result: str | Path,
    *,
    plugins: Sequence[ForceModel | str | Path] = (),
    tol: SupportsFloat | str | Tolerances | None = None,
    subset: bool = False,
    max_points: int = MAX_POINTS,
    execute: Callable[..., xr.Dataset] | None = None,
) -> Verdict:
    """Repeat the sweep or the calibration of a result from its file alone, and compare the new values with it.

    Of a sweep, only the points in the file are repeated, even if its config has more; of a calibration its laws.

    Parameters
    ----------
    result : the file
    plugins : the plug-in models that it was computed with; notes of the verdict name models
        whose code has changed, and models that no file defines
    tol, subset : see `compare`
    max_points : the largest number of points
    execute : deprecated; function that runs a plan, by default it is run in this process

    Returns
    -------
    Verdict : see `compare`

    Raises
    ------
    ResultError : the file is not a readable result
    UsageError : it is a time history, or a plug-in is missing or a different one
    ConfigError : this version does not have a model of the result, or cannot read its config

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.save(impact.sweep("configs/figure6.toml"), f"{folder}/stored.h5")
    ...     print(impact.rerun(f"{folder}/stored.h5"))
    equal: 19 variables, 5,353 values, none differs
    """
    stored, name = load(result), str(result)
    plugin_set = read_plugins(plugins)
    # laws by key, because "all" may include new ones; a calibration has pairs, MODEL with FRICTION, along `model`
    keys = [law_keys(key) for key in stored["model"].values.tolist()] if "model" in stored.dims else [[]]
    laws = zip(("models", "frictions"), map(dict.fromkeys, zip(*keys, strict=True)), strict=False)
    changes = [f"{key}={json.dumps(list(table))}" for key, table in laws]
    changes += [f"solver.{key}={stored.attrs.get(key)}" for key in ("rtol", "max_steps")]
    if kind_of(stored) == "calibration":
        # its modules import scipy.optimize, which is slow to import
        from ..inverse.calibrate import calibrate_config

        config = stored_config(
            stored.attrs, changes, plugin_set, name, allow_changed_plugins=True, purpose="calibrate"
        )
        unknown = unknown_plugins(stored.attrs, plugin_set, name)
        # the file may have a part of the laws, and of the curves
        verdict = compare(calibrate_config(config, plugin_set.of(config.models)), stored, tol=tol, subset=True)
        return replace(verdict, new="the rerun", baseline=name, notes=(*verdict.notes, *unknown))
    require_sweep(stored, "rerun")
    if "friction" in stored.coords:
        changes.append(f"frictions={json.dumps(stored['friction'].values.ravel().tolist())}")
    # any core gives the same result
    changes.append('solver.core="auto"')
    config = stored_config(stored.attrs, changes, plugin_set, name, max_points, allow_changed_plugins=True)
    unknown = unknown_plugins(stored.attrs, plugin_set, name)
    whole = Plan(config, plugin_set.of(config.models))
    plan = replace(whole, config=config_of_part(config, stored))
    plan.check_count(max_points, name)
    verdict = compare((execute or sweep_in_memory)(plan), stored, tol=tol, subset=subset)
    if plan.points < whole.points:
        part = f"repeated {plan.points:,} of {whole.points:,} points of the config: the file holds no others"
        verdict = replace(verdict, notes=(part, *verdict.notes))
    files = [word for path in plugins if isinstance(path, str | Path) for word in ("--plugin", str(path))]
    command = ("impact", "run", name, *files) if command_start(name, stored) else ()
    return replace(verdict, new="the rerun", baseline=name, repeats=command, notes=(*verdict.notes, *unknown))
