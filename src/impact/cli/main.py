"""The command line: each command parses, calls the function of the same name in `impact.api`, and prints."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

from .. import __version__
from . import compare, config, exits, extend, info, materials, models, plot, recommend, report, run, sweep


class Command(TyperCommand):
    """A command whose flags are shown without a type: they take no value."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _without_flag_types(super().get_params(ctx))


class Group(TyperGroup):
    """The program itself, with the same flags."""

    def get_params(self, ctx: Any) -> list[Any]:
        return _without_flag_types(super().get_params(ctx))


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
    help="Which contact force model, with which damping, gives the rebound you asked for, and how wrong is it "
    "where it does not? Sweeps models over restitution, speeds, masses and materials against the "
    "impulse-momentum solution.",
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


# in the order of the help; each with an example
COMMANDS: tuple[tuple[Callable[..., None], str], ...] = (
    (sweep.sweep, "impact sweep configs/figure6.toml -o results.h5 --set sweep.m2=2.0"),
    (sweep.merge, "impact merge results.h5.*-of-16.work -o results.h5"),
    (extend.expand, "impact expand results.h5 -o full.h5 --sel m2=1.0"),
    (extend.extend, "impact extend results.h5 --set 'sweep.m2=[1.0, 2.0]'"),
    (plot.plot, "impact plot results.h5 -k restitution -k loop --sel m2=1.0 -o results.svg"),
    (recommend.recommend, "impact recommend results.h5 --tol 2% --sel m2=1.0"),
    (report.report, "impact report results.h5 -o report.html"),
    (run.run, "impact run --model gharib-hurmuzlu-2012 --at e=0.05 --at m2=2.0 --history out.h5"),
    (compare.compare, "impact compare results.h5 baseline.h5 --plot differences.png"),
    (compare.bless, 'impact bless results.h5 baseline.h5 --reason "finer tolerance"'),
    (compare.rerun, "impact rerun baseline.h5"),
    (models.models, "impact models gharib-hurmuzlu-2012"),
    (materials.materials, "impact materials steel"),
    (info.info, "impact info results.h5"),
    (config.init, "impact init my_sweep.toml"),
    (config.schema, "impact schema -o impact.schema.json"),
    (show_help, "impact help sweep"),
)
for function, example in COMMANDS:
    name = "help" if function is show_help else function.__name__
    app.command(name, cls=Command, epilog=f"Example: {example}")(function)


def main() -> None:
    """Entry point of the console script `impact`."""
    sys.exit(exits.enter(partial(app, standalone_mode=False, prog_name="impact"), debug="--debug" in sys.argv))
