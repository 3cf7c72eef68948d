"""Parameter sweeps of contact force models for the impact of two balls, checked against closed forms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._version import __version__ as __version__

if TYPE_CHECKING:
    from .api import (
        bless,
        compare,
        extend,
        load,
        materials,
        models,
        plot,
        recommend,
        report,
        rerun,
        run,
        save,
        sweep,
    )
    from .comparison.verdict import Verdict
    from .contact.evidence import Evidence
    from .contact.model import ForceModel, Parameter
    from .contact.models.hysteresis import hysteresis
    from .contact.powers import power
    from .errors import ImpactError

__all__ = [
    "Evidence",
    "ForceModel",
    "ImpactError",
    "Parameter",
    "Verdict",
    "bless",
    "compare",
    "extend",
    "hysteresis",
    "load",
    "materials",
    "models",
    "plot",
    "power",
    "recommend",
    "report",
    "rerun",
    "run",
    "save",
    "sweep",
]


def __getattr__(name: str) -> Any:
    # the floors below load numpy and more, which `import impact` and `impact --help` do without
    if name in __all__:
        from . import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
