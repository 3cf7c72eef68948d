"""Parameter sweeps of contact force models for the impact of two balls, checked against closed forms.

The public names by purpose; `help(impact.NAME)` shows more of each.

Run sweeps and single impacts: sweep, sweep_to_file, estimate, run, prepare, extend, extend_to_file, sweep_shard,
merge, progress_bar

>>> import impact
>>> result = impact.sweep(models=["hertz", "flores-2011"], e=[0.5, 0.9])
>>> result["e_out"].sel(model="flores-2011").round(4).values.tolist()
[0.4704, 0.8939]

See results and choose a law: recommend, plot, plot_to_files, explore, report, page,
describe, info

>>> impact.recommend(result, tol=0.1)[0].model
'flores-2011'

Find inputs: solve, calibrate, sensitivity, sensitivities

>>> round(impact.solve("mujoco-solref", "dampratio", {"e_out": 0.6}).roots[0].value, 6)
0.180858

Simulation codes and their time steps: timestep, export, export_codes, conform, conform_engines

>>> impact.export("mujoco", "mujoco-solref", at={"e": 0.6}, dt="2 ms").lines[0]
'<option timestep="0.002" integrator="Euler"/>'

Store results and guard them: save, load, expand, compare, bless, rerun

>>> impact.compare(result, result).equal
True

Laws and what they need: models, frictions, materials, cite, check_model, hysteresis, power, init, schema, doctor

>>> impact.models()["flores-2011"].family
'hysteresis'

Classes of laws: ForceModel, FrictionLaw, Parameter, Evidence

Classes of results: Impact, PreparedProblem, Ranking, SolveResult, TimestepResult, Export, Estimate, Verdict,
Models, Frictions, Citations, Environment, Board, Engines

Errors and warnings: ImpactError, ConfigError, ModelError, ResultError, StoreError, UsageError, ImpactWarning
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .comparison.bless import bless as bless
    from .comparison.compare import compare as compare
    from .comparison.rerun import rerun as rerun
    from .comparison.verdict import Verdict as Verdict
    from .config.material_library import materials as materials
    from .config.starter import init as init
    from .config.tables import schema as schema
    from .conformance.conform import conform as conform
    from .conformance.registry import Engines as Engines, conform_engines as conform_engines
    from .contact.checks import check_model as check_model
    from .contact.evidence import Evidence as Evidence
    from .contact.friction import FrictionLaw as FrictionLaw
    from .contact.model import ForceModel as ForceModel, Parameter as Parameter
    from .contact.models.hysteresis import hysteresis as hysteresis
    from .contact.powers import power as power
    from .engine.friction_catalogue import Frictions as Frictions, frictions as frictions
    from .engine.model_catalogue import Models as Models, models as models
    from .errors import (
        ConfigError as ConfigError,
        ImpactError as ImpactError,
        ImpactWarning as ImpactWarning,
        ModelError as ModelError,
        ResultError as ResultError,
        StoreError as StoreError,
        UsageError as UsageError,
    )
    from .exporters.environment import Environment as Environment, doctor as doctor
    from .exporters.export import Export as Export, export as export, export_codes as export_codes
    from .inverse.calibrate import calibrate as calibrate
    from .inverse.prepared import PreparedProblem as PreparedProblem, prepare as prepare
    from .inverse.solve import SolveResult as SolveResult, solve as solve
    from .inverse.timestep import TimestepResult as TimestepResult, timestep as timestep
    from .plots.draw import plot as plot
    from .plots.explore import explore as explore
    from .plots.files import plot_to_files as plot_to_files
    from .progress_display import progress_bar as progress_bar
    from .reporting.page import page as page
    from .reporting.report import report as report
    from .results.board import Board as Board
    from .results.citations import Citations as Citations, cite as cite
    from .results.describe import describe as describe
    from .results.estimate import Estimate as Estimate, estimate as estimate
    from .results.extend import extend as extend, extend_to_file as extend_to_file
    from .results.info import info as info
    from .results.ranking import Ranking as Ranking, recommend as recommend
    from .results.shards import merge as merge, sweep_shard as sweep_shard
    from .results.single_impact import Impact as Impact, run as run
    from .results.sweep import sweep as sweep, sweep_to_file as sweep_to_file
    from .results.xarray_backend import expand as expand, load as load, save as save
    from .uncertainty.sensitivity import sensitivities as sensitivities, sensitivity as sensitivity

# the public names of each module, which is imported on first use, so that `impact --help` needs no numpy
_NAMES = {
    "comparison.bless": "bless",
    "comparison.compare": "compare",
    "comparison.rerun": "rerun",
    "comparison.verdict": "Verdict",
    "config.material_library": "materials",
    "config.starter": "init",
    "config.tables": "schema",
    "conformance.conform": "conform",
    "conformance.registry": "Engines conform_engines",
    "contact.checks": "check_model",
    "contact.evidence": "Evidence",
    "contact.friction": "FrictionLaw",
    "contact.model": "ForceModel Parameter",
    "contact.models.hysteresis": "hysteresis",
    "contact.powers": "power",
    "engine.friction_catalogue": "Frictions frictions",
    "engine.model_catalogue": "Models models",
    "errors": "ConfigError ImpactError ImpactWarning ModelError ResultError StoreError UsageError",
    "exporters.environment": "Environment doctor",
    "exporters.export": "Export export export_codes",
    "inverse.calibrate": "calibrate",
    "inverse.prepared": "PreparedProblem prepare",
    "inverse.solve": "SolveResult solve",
    "inverse.timestep": "TimestepResult timestep",
    "plots.draw": "plot",
    "plots.explore": "explore",
    "plots.files": "plot_to_files",
    "progress_display": "progress_bar",
    "reporting.page": "page",
    "reporting.report": "report",
    "results.board": "Board",
    "results.citations": "Citations cite",
    "results.describe": "describe",
    "results.estimate": "Estimate estimate",
    "results.extend": "extend extend_to_file",
    "results.info": "info",
    "results.ranking": "Ranking recommend",
    "results.shards": "merge sweep_shard",
    "results.single_impact": "Impact run",
    "results.sweep": "sweep sweep_to_file",
    "results.xarray_backend": "expand load save",
    "uncertainty.sensitivity": "sensitivities sensitivity",
}
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}
__all__ = sorted(_MODULES)

if not TYPE_CHECKING:
    # the same function each time, which can be pickled
    @cache
    def __getattr__(name: str) -> Any:
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        member = getattr(import_module(f".{_MODULES[name]}", __name__), name)
        return import_module(".arguments", __name__).prepare_for_users(member)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
