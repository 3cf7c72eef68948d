"""Parameter sweeps of contact force models for the impact of two balls, checked against closed forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .api import (
        bless,
        calibrate,
        check_model,
        compare,
        estimate,
        expand,
        explore,
        export,
        export_codes,
        extend,
        extend_to_file,
        info,
        init,
        load,
        materials,
        merge,
        models,
        plot,
        plot_to_files,
        recommend,
        report,
        rerun,
        run,
        save,
        schema,
        sensitivity,
        solve,
        sweep,
        sweep_shard,
        sweep_to_file,
        timestep,
    )
    from .comparison.verdict import Verdict
    from .contact.evidence import Evidence
    from .contact.model import ForceModel, Parameter
    from .contact.models.hysteresis import hysteresis
    from .contact.powers import power
    from .errors import ImpactError
    from .progress_display import progress_bar

__all__ = [
    "Evidence",
    "ForceModel",
    "ImpactError",
    "Parameter",
    "Verdict",
    "bless",
    "calibrate",
    "check_model",
    "compare",
    "estimate",
    "expand",
    "explore",
    "export",
    "export_codes",
    "extend",
    "extend_to_file",
    "hysteresis",
    "info",
    "init",
    "load",
    "materials",
    "merge",
    "models",
    "plot",
    "plot_to_files",
    "power",
    "progress_bar",
    "recommend",
    "report",
    "rerun",
    "run",
    "save",
    "schema",
    "sensitivity",
    "solve",
    "sweep",
    "sweep_shard",
    "sweep_to_file",
    "timestep",
]


def __getattr__(name: str) -> Any:
    # loads the submodules on first use: `import impact` and `impact --help` need neither numpy nor more
    if name == "progress_bar":
        # rich is not needed otherwise
        from .progress_display import progress_bar

        return progress_bar
    if name in __all__:
        from . import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
