"""The command line: each command parses, calls the function of the same name in `impact.api`, and prints."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from .. import __version__
from ..errors import UsageError
from ..text import safe_text
from . import advice, catalogue, door, enlarging, pictures, regression, reporting, shards, sweeping
from .options import Json, Overwrite, Plugins, Sets
from .words import dump, pairs, whole_number

app = typer.Typer(
    name="impact",
    no_args_is_help=True,
    add_completion=False,
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
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an internal error.")] = False,
) -> None:
    """Options that stand before the command; `main` reads --debug, this only documents it."""


app.command(epilog="Example: impact sweep configs/figure6.toml -o results.h5 --set sweep.m2=2.0")(sweeping.sweep)
app.command(epilog="Example: impact merge results.h5.*-of-16.work -o results.h5")(shards.merge)

app.command(epilog="Example: impact expand results.h5 -o full.h5 --sel m2=1.0")(enlarging.expand)
app.command(epilog="Example: impact extend results.h5 --set 'sweep.m2=[1.0, 2.0]'")(enlarging.extend)


app.command(epilog="Example: impact plot results.h5 -k restitution -k loop --sel m2=1.0 -o results.svg")(
    pictures.plot
)
app.command(epilog="Example: impact recommend results.h5 --tol 0.02 --sel m2=1.0")(advice.recommend)
app.command(epilog="Example: impact report results.h5 -o report.html")(reporting.report)


@app.command(epilog="Example: impact run --model gharib-hurmuzlu-2012 --at e=0.05 --at m2=2.0 --history out.h5")
def run(
    source: Annotated[
        Path | None, typer.Argument(help="A TOML file or a result. \\[default: Table 1 of the paper]")
    ] = None,
    model: Annotated[
        str | None,
        typer.Option("--model", metavar="KEY", help="The model. \\[default: the first of the source]"),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="NAME=VALUE", help="Value of an input, such as e=0.05; may be repeated."),
    ] = None,
    sets: Sets = None,
    plugins: Plugins = None,
    history: Annotated[
        Path | None, typer.Option("--history", metavar="FILE", help="Keep the time history in this file.")
    ] = None,
    times: Annotated[
        int | None,
        typer.Option(
            "--times",
            metavar="N",
            parser=whole_number,
            help="Points in time of the history, uniform from contact to release. \\[default: the integrator's]",
        ),
    ] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Run one impact: what goes in, what comes out, and how far it can be trusted."""
    from .. import api
    from ..contact.status import FIRST_FAILURE
    from ..results import backend
    from . import tables

    if times is not None and history is None:
        raise UsageError(f"--times {times}: expected --history FILE beside it")
    if history is not None:
        for one in (source, *(plugins or ())):
            backend.check_output(history, overwrite=overwrite, source=one)
    impact = api.run(
        source, model=model, at=pairs("--at", at), overrides=sets or (), plugins=plugins or (), times=times
    )
    if as_json:
        print(dump(tables.run_json(impact)))
    else:
        tables.print_run(impact)
    if impact.status >= FIRST_FAILURE:
        raise typer.Exit(door.LANES_FAILED)
    if history is not None:
        if impact.history is None:
            raise UsageError(f"no history to keep: {impact.status.meaning}")
        api.save(impact.history, history, overwrite=overwrite)
        door.say(f"{safe_text(str(history))}: {impact.history.sizes['t']} points in time")


app.command(epilog="Example: impact compare results.h5 baseline.h5 --plot differences.png")(regression.compare)
app.command(epilog='Example: impact bless results.h5 baseline.h5 --reason "finer tolerance"')(regression.bless)
app.command(epilog="Example: impact rerun baseline.h5")(regression.rerun)


app.command(epilog="Example: impact models gharib-hurmuzlu-2012")(catalogue.models)


@app.command(epilog="Example: impact info results.h5")
def info(
    file: Annotated[Path, typer.Argument(help="A result or a time history.")],
    as_json: Json = False,
) -> None:
    """What is in a file: axes, variables, worst errors, and where it came from."""
    from .. import api
    from . import tables

    dataset = api.load(file)
    if as_json:
        print(dump(tables.info_json(dataset)))
    else:
        tables.print_info(dataset, file)


@app.command(epilog="Example: impact init my_sweep.toml")
def init(
    path: Annotated[Path, typer.Argument(help="The file to write.")] = Path("config.toml"),
    overwrite: Overwrite = False,
) -> None:
    """Write a commented starter config, ready to sweep."""
    from ..results import backend
    from ..results import provenance as origin

    backend.write_whole(path, origin.STARTER.read_bytes(), overwrite=overwrite)
    door.say(f"{safe_text(str(path))}: written; next: impact sweep {safe_text(str(path))}")


@app.command(epilog="Example: impact schema -o impact.schema.json")
def schema(
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The file. \\[default: stdout]")] = None,
    overwrite: Overwrite = False,
) -> None:
    """The JSON Schema of the config, from which editors complete and check it."""
    from ..results import backend
    from ..sweeps.config import json_schema

    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        print(text, end="")
    else:
        backend.write_whole(output, text.encode(), overwrite=overwrite)
        door.say(f"{safe_text(str(output))}: written")


def main() -> None:
    """Entry point of the console script `impact`."""
    sys.exit(door.enter(partial(app, standalone_mode=False, prog_name="impact"), debug="--debug" in sys.argv))
