"""The Python interface; each command of the command line calls a function of this module."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .atomic import write_file
from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.verdict import Verdict as Verdict
from .config.library import records
from .config.load import json_schema

# a name imported "as itself" is public, see `impact.__all__`
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.plan import Plan
from .engine.plugins import read_plugins
from .errors import ImpactError as ImpactError, UsageError
from .results.single_impact import STARTER_CONFIG, Impact as Impact, run_single_impact, single_point
from .results.xarray_backend import load as load, save as save

if TYPE_CHECKING:
    pass


def run(
    source: str | Path | Mapping[str, object] | None = None,
    *,
    model: str | None = None,
    at: Mapping[str, float | str] | None = None,
    overrides: Sequence[str] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
    times: int | None = None,
) -> Impact:
    """Run one impact and record its time history.

    Parameters
    ----------
    source : a TOML file, a mapping, or a result; by default the two balls of Table 1 of the paper, at e = 0.5
    model : key of the model; by default the first one of the source
    at : values by config name, such as `{"e": 0.05}`; the default of an axis is its first value
    overrides : changes to the config, such as `"sweep.m2=2"`
    plugins : plug-in models, and paths of Python files with such models; a result that was computed with them
        needs them again, and a changed one gives a warning with both hashes
    times : number of points of the history, uniform from first contact to release; by default the steps of the
        integrator

    Raises
    ------
    ConfigError, UsageError, ModelError, ResultError : the source, a plug-in, a name or a value is invalid

    >>> import impact
    >>> shot = impact.run(model="gharib-hurmuzlu-2012", at={"e": 0.5})
    >>> round(shot.values["e_out"], 6), round(shot.e_energetic, 6)
    (0.41072, 0.41072)
    """
    if times is not None and times < 2:
        raise UsageError(f"times: got {times}, expected a whole number >= 2")
    plugin_set = read_plugins(plugins)
    config, first = single_point(source, overrides, plugin_set, model, at)
    return run_single_impact(Plan(config, plugin_set.of(config.models)), first, times)


def materials() -> dict[str, dict[str, float | str]]:
    """Common materials in SI units, which a config can name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] if known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return {name: dict(record) for name, record in records().items()}


def init(path: str | Path = "config.toml", *, overwrite: bool = False) -> None:
    """Write a commented starter config, ready to sweep.

    Raises
    ------
    UsageError : the file exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.init(f"{folder}/config.toml")
    ...     impact.estimate(f"{folder}/config.toml").points > 0
    True
    """
    write_file(Path(path), STARTER_CONFIG.read_bytes(), overwrite=overwrite)


def schema(output: str | Path | None = None, *, overwrite: bool = False) -> dict[str, Any]:
    """The JSON Schema of a config, from which editors complete and check it.

    Parameters
    ----------
    output : file to write it to as well
    overwrite : replace the output if it exists

    Raises
    ------
    UsageError : the output exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact
    >>> impact.schema()["required"]
    ['models', 'sweep']
    """
    content = json_schema()
    if output is not None:
        text = json.dumps(content, indent=2, ensure_ascii=False) + "\n"
        write_file(Path(output), text.encode(), overwrite=overwrite)
    return content
