"""The public names of the package and the modules that define them, each imported on first use."""

from ._version import __version__ as __version__
from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.rerun import rerun as rerun
from .comparison.verdict import Verdict as Verdict
from .config.library import init as init, materials as materials
from .config.tables import schema as schema
from .conformance.conform import conform as conform
from .conformance.registry import Engines as Engines, conform_engines as conform_engines
from .contact.checks import ContractResult as ContractResult, check_model as check_model
from .contact.evidence import Evidence as Evidence
from .contact.friction import FrictionLaw as FrictionLaw
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.law_catalogue import (
    FrictionDescription as FrictionDescription,
    Frictions as Frictions,
    ModelDescription as ModelDescription,
    Models as Models,
    frictions as frictions,
    models as models,
)
from .engine.run import Progress as Progress
from .errors import (
    ConfigError as ConfigError,
    ImpactError as ImpactError,
    ImpactWarning as ImpactWarning,
    InUseError as InUseError,
    MissingFileError as MissingFileError,
    ModelError as ModelError,
    ResultError as ResultError,
    StoreError as StoreError,
    UnfinishedError as UnfinishedError,
    UsageError as UsageError,
)
from .exporters.environment import Environment as Environment, doctor as doctor
from .exporters.export import Export as Export, export as export, export_codes as export_codes
from .inverse.calibrate import calibrate as calibrate
from .inverse.prepared import PreparedProblem as PreparedProblem, prepare as prepare
from .inverse.solve import SolveResult as SolveResult, solve as solve
from .inverse.timestep import TimestepResult as TimestepResult, timestep as timestep
from .plots.draw import PlotFiles as PlotFiles, plot as plot, plot_to_files as plot_to_files
from .plots.explore import explore as explore
from .progress_display import progress_bar as progress_bar
from .reporting.page import page as page
from .reporting.report import report as report
from .results.board import Board as Board
from .results.calibration import Fits as Fits
from .results.citations import Citations as Citations, cite as cite
from .results.estimate import Estimate as Estimate, estimate as estimate
from .results.extend import extend as extend, extend_to_file as extend_to_file
from .results.info import Info as Info, describe as describe, info as info
from .results.ranking import Ranking as Ranking, recommend as recommend
from .results.sensitivity import Studies as Studies
from .results.shards import ShardProgress as ShardProgress, merge as merge, sweep_shard as sweep_shard
from .results.single_impact import Impact as Impact, run as run
from .results.summary import SweepOutcome as SweepOutcome
from .results.sweep import sweep as sweep, sweep_to_file as sweep_to_file
from .results.xarray_backend import expand as expand, load as load, save as save
from .uncertainty.sensitivity import sensitivities as sensitivities, sensitivity as sensitivity
