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
SweepOutcome, Progress, ShardProgress, PlotFiles, Info, Fits, Studies, Board, Engines, Models, ModelDescription,
Frictions,
FrictionDescription, ContractResult, Citations, Environment

Errors and warnings: ImpactError, ConfigError, ModelError, ResultError, StoreError, UsageError, InUseError,
UnfinishedError, MissingFileError, ImpactWarning
"""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

from ._version import __version__ as __version__

# the stub lists the public names for type checkers; each is imported on first use, so that `impact --help` needs
# no numpy
_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
_MODULES = {
    alias.name: f".{statement.module}"
    for statement in _STUB.body
    if isinstance(statement, ast.ImportFrom)
    for alias in statement.names
}
__all__ = sorted(_MODULES.keys() - {"__version__"})


# the same function for all threads and each time, which can be pickled
_used: dict[str, Any] = {}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in _used:
        member = getattr(import_module(_MODULES[name], __name__), name)
        _used.setdefault(name, import_module(".arguments", __name__).prepare_for_users(member))
    return _used[name]


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
