"""The list of the codes that laws are exported to."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module

from ..errors import UsageError, did_you_mean
from ..formatting import argument
from .code import Code

# the modules of the codes, in their order
MODULES = (
    # scripts were run
    "lammps liggghts yade mujoco drake kratos opensees simbody pybullet exudyn newton "
    # text only
    "chrono mercurydpm modelica adams simscape physx"
)
CODES: dict[str, Code] = {
    name: replace(import_module(f".{name}", __package__).CODE, name=name) for name in MODULES.split()
}


def find_code(name: str) -> Code:
    """Find a code by its key; the error for a word of its title names the key."""
    if name not in CODES:
        key = next((key for key, code in CODES.items() if name.lower() in code.title.lower().split()), name)
        raise UsageError(f'{argument("to")}: no code "{name}"; {did_you_mean(key, list(CODES))}')
    return CODES[name]
