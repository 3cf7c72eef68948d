"""Parameter sweeps of contact force models for the impact of two balls, checked against closed forms."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .api import (
        check_model as check_model,
        estimate as estimate,
        explore as explore,
        export as export,
        export_codes as export_codes,
        extend as extend,
        extend_to_file as extend_to_file,
        init as init,
        materials as materials,
        merge as merge,
        models as models,
        plot as plot,
        plot_to_files as plot_to_files,
        report as report,
        rerun as rerun,
        run as run,
        schema as schema,
        sensitivity as sensitivity,
        sweep as sweep,
        sweep_shard as sweep_shard,
        sweep_to_file as sweep_to_file,
    )
    from .comparison.bless import bless as bless
    from .comparison.compare import compare as compare
    from .comparison.verdict import Verdict as Verdict
    from .contact.evidence import Evidence as Evidence
    from .contact.model import ForceModel as ForceModel, Parameter as Parameter
    from .contact.models.hysteresis import hysteresis as hysteresis
    from .contact.powers import power as power
    from .errors import ImpactError as ImpactError
    from .inverse.calibrate import calibrate as calibrate
    from .inverse.solve import solve as solve
    from .inverse.timestep import timestep as timestep
    from .progress_display import progress_bar as progress_bar
    from .results.describe import describe as describe
    from .results.info import info as info
    from .results.ranking import recommend as recommend
    from .results.xarray_backend import expand as expand, load as load, save as save

# the module of each public name, which is imported on first use: `import impact` and `impact --help` need no numpy
_MODULES = {
    "Evidence": "contact.evidence",
    "ForceModel": "contact.model",
    "ImpactError": "errors",
    "Parameter": "contact.model",
    "Verdict": "comparison.verdict",
    "bless": "comparison.bless",
    "calibrate": "inverse.calibrate",
    "check_model": "api",
    "compare": "comparison.compare",
    "describe": "results.describe",
    "estimate": "api",
    "expand": "results.xarray_backend",
    "explore": "api",
    "export": "api",
    "export_codes": "api",
    "extend": "api",
    "extend_to_file": "api",
    "hysteresis": "contact.models.hysteresis",
    "info": "results.info",
    "init": "api",
    "load": "results.xarray_backend",
    "materials": "api",
    "merge": "api",
    "models": "api",
    "plot": "api",
    "plot_to_files": "api",
    "power": "contact.powers",
    "progress_bar": "progress_display",
    "recommend": "results.ranking",
    "report": "api",
    "rerun": "api",
    "run": "api",
    "save": "results.xarray_backend",
    "schema": "api",
    "sensitivity": "api",
    "solve": "inverse.solve",
    "sweep": "api",
    "sweep_shard": "api",
    "sweep_to_file": "api",
    "timestep": "inverse.timestep",
}
__all__ = list(_MODULES)

if not TYPE_CHECKING:

    def __getattr__(name: str) -> Any:
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(f".{_MODULES[name]}", __name__), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
