"""The command line: each command parses, calls the function of the same name in `impact`, and prints."""

from __future__ import annotations

import gc
import re
import signal
import sys
import threading
from functools import partial
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

import impact

from .._version import __version__
from . import exits

# in the order of the help: the module of the function of the same name, a summary, and an example
COMMANDS: dict[str, tuple[str, str, str]] = {
    "sweep": ("sweep", "Run every model over a sweep.", "configs/figure6.toml -o results.h5 --set sweep.m2=2.0"),
    "merge": ("sweep", "Join the shards of a sweep.", "results.h5.*-of-16.work -o results.h5"),
    "expand": ("sweep", "Write all values of a result, or of a part.", "results.h5 -o full.h5 --sel m2=1.0"),
    "extend": ("sweep", "Add values to the axes of a result.", "results.h5 --set 'sweep.m2=[1.0, 2.0]'"),
    "plot": ("plot", "Plot a result.", "results.h5 -k restitution -k loop --sel m2=1.0 -o results.svg"),
    "recommend": (
        "report",
        "Rank models by the error of their restitution.",
        "results.h5 --tol 2% --sel m2=1.0",
    ),
    "report": ("report", "Write a report as one HTML page.", "results.h5 -o report.html"),
    "page": ("report", "Write a page with sliders for a browser.", "results.h5 -o page.html"),
    "run": ("run", "Run one impact.", "--model gharib-hurmuzlu-2012 --at e=0.05 --at m2=2.0 --history out.h5"),
    "solve": (
        "inverse",
        "Find the value that gives a rebound.",
        "--model mujoco-solref --for dampratio --target e_out=0.6",
    ),
    "timestep": ("inverse", "Show what a fixed time step delivers.", "--model tsuji-1992 --at e=0.5 --tol 1%"),
    "export": (
        "codes",
        "Write the input lines of a simulation code for a law.",
        "--to lammps --at e=0.6 --at v1=1 --verify",
    ),
    "conform": ("codes", "Judge what an engine delivers.", "pymunk -o page.html"),
    "calibrate": ("inverse", "Fit laws to measurements.", "fit.toml -o fit.h5 --best best.toml"),
    "sensitivity": (
        "sweep",
        "Find which uncertain input matters.",
        "uncertain.toml --of peak_force -o study.h5",
    ),
    "compare": ("compare", "Compare a result with a baseline.", "results.h5 baseline.h5 --plot differences.png"),
    "bless": ("compare", "Replace a baseline by a result.", 'results.h5 baseline.h5 --reason "finer tolerance"'),
    "rerun": ("compare", "Repeat the sweep of a result, and compare.", "baseline.h5"),
    "models": ("models", "Show the catalogue of models.", "gharib-hurmuzlu-2012"),
    "cite": ("models", "Write BibTeX of laws.", "tsuji-1992 lammps-mindlin"),
    "materials": ("models", "Show common materials.", "steel"),
    "info": ("info", "Show the contents of a file.", "results.h5"),
    "init": ("info", "Write a starter config.", "my_sweep.toml"),
    "schema": ("info", "Print the JSON Schema of a config.", "-o impact.schema.json"),
    "doctor": ("info", "Show the versions of what is installed.", "--json"),
    "help": ("main", "Show the help of a command.", "sweep"),
}


class Command(TyperCommand):
    """A command whose flags are shown without a type: they take no value."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _without_flag_types(super().get_params(ctx))

    def invoke(self, ctx: Any) -> Any:
        if self.name != "help":
            # imports the module of the public function
            getattr(impact, str(self.name))
        # what was imported so far is kept to the end
        gc.freeze()
        gc.enable()
        return super().invoke(ctx)


class Group(TyperGroup):
    """The program itself, which loads the module of a command when the command is used."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {name: TyperCommand(name, help=summary) for name, (_, summary, _) in COMMANDS.items()}

    def get_params(self, ctx: Any) -> list[Any]:
        return _without_flag_types(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, command, rest = super().resolve_command(ctx, args)
        return name, command and load_command(str(name)), rest


def load_command(name: str) -> Any:
    """A command with its parameters."""
    module, _, example = COMMANDS[name]
    function = show_help if name == "help" else getattr(import_module(f"{__package__}.{module}"), name)
    program = typer.Typer(add_completion=False, rich_markup_mode="rich")
    program.command(name, cls=Command, epilog=f"Example: impact {name} {example}")(function)
    command = typer.main.get_command(program)
    # only the first paragraph would be filled to the width of the terminal
    command.help = re.sub(r"(?<!\n)\n(?!\n)", " ", command.help or "")
    return command


def _without_flag_types(params: list[Any]) -> list[Any]:
    for param in params:
        if isinstance(param, TyperOption) and param.is_flag:
            param.metavar = ""
    return params


app = typer.Typer(
    name="impact",
    cls=Group,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Sweep contact force models, with friction or without, over restitution, speeds, angles, masses and "
    "materials, and compare them with the impulse-momentum solution: which model, with which damping, delivers "
    "the requested restitution, and how large is the error otherwise?",
    epilog="Start with: impact init, impact sweep config.toml, impact plot results.h5",
)


def _version(show: bool) -> None:
    if show:
        print(f"impact {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", "-V", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an internal error.")] = False,
) -> None:
    """Options that stand before the command; `main` reads --debug, this only documents it."""


def show_help(
    context: typer.Context,
    command: Annotated[
        str | None, typer.Argument(metavar="COMMAND", help="The command. \\[default: the program]")
    ] = None,
) -> None:
    """Show the help of a command."""
    program = context.parent
    assert program is not None
    if command is None:
        print(program.get_help(), end="")
        return
    group = program.command
    assert isinstance(group, TyperGroup)
    name, chosen, _ = group.resolve_command(program, [command])
    assert chosen is not None
    chosen.make_context(name, ["--help"], parent=program)


def main() -> None:
    """Entry point of the console script `impact`."""
    # imports leave no garbage, and at the end all memory is given back: a short command takes a fifth less time
    # without a search for unused objects
    gc.disable()
    # a signal that the caller ignores stays ignored; only the main thread may handle signals
    is_main = threading.current_thread() is threading.main_thread()
    if is_main and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL:
        signal.signal(signal.SIGTERM, exits.stop)
    code = exits.run_command_line(
        partial(app, standalone_mode=False, prog_name="impact"), debug="--debug" in sys.argv
    )
    gc.freeze()
    sys.exit(code)
