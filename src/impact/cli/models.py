"""The command `models`: the catalogues, one law, or the checks of a user-defined law."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import impact

from ..display import Table, dump, print_blocks, show
from ..errors import UsageError
from . import exits
from .completion import complete_family, complete_model
from .options import JsonOption, PluginOption

if TYPE_CHECKING:
    from ..contact.model import ForceModel
    from ..engine.friction_catalogue import Frictions
    from ..engine.model_catalogue import Models


def models(
    key: Annotated[
        str | None,
        typer.Argument(
            autocompletion=complete_model,
            help='A model or friction law to describe in full, or models to list: "lammps-*", family:hysteresis. '
            "\\[default: list all]",
        ),
    ] = None,
    family: Annotated[
        str | None,
        typer.Option(
            "--family", metavar="NAME", autocompletion=complete_family, help="List only the laws of this family."
        ),
    ] = None,
    search: Annotated[
        str | None,
        typer.Option(
            "--search",
            metavar="WORDS",
            help='List the laws with these words in key, title, equation or reference: "lammps hertz".',
        ),
    ] = None,
    check: Annotated[
        Path | None,
        typer.Option("--check", metavar="FILE", help="Check the models of a Python file against the contract."),
    ] = None,
    frictions: Annotated[bool, typer.Option("--frictions", help="List friction laws, not models.")] = False,
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the contact force models, or the friction laws: equations, references, domains, restitution."""
    if frictions and (family or check):
        raise UsageError(
            f"--frictions: got it with {'--family' if family else '--check'}, expected one of the two"
        )
    if check is not None:
        with_file, others = impact.models([check]), impact.models()
        of_file = [model for name, model in with_file.items() if name not in others and key in (None, name)]
        _check_contract(of_file or [with_file.find(str(key))], as_json=as_json)
        return
    if key is not None and search is None and not (key.startswith("family:") or {*"*?["} & {*key}):
        laws: Frictions | Models = impact.frictions() if frictions else impact.models(plugins or ())
        if key not in laws and key in impact.frictions():
            laws = impact.frictions()
        description = impact.describe(laws.find(key))
        if as_json:
            print(dump([description]))
        else:
            show(description)
        return
    pattern = key or "*"
    if frictions:
        chosen: Frictions | Models = impact.frictions(pattern=pattern, search=search)
    else:
        chosen = impact.models(plugins or (), pattern=pattern, family=family, search=search)
    if as_json:
        print(dump(chosen.records()))
    else:
        show(chosen)


def _check_contract(models: Sequence[ForceModel], *, as_json: bool) -> None:
    """Print the result of every clause of the contract; exit 1 if one does not hold."""
    results = [impact.check_model(model) for model in models]
    if as_json:
        print(dump(results))
    else:
        print_blocks(
            [Table([row for result in results for row in result.rows()], results[0].HEADINGS, text=(0, 1))]
        )
        for note in (note for result in results for note in result.notes()):
            exits.print_line(note)
    if not all(result.holds for result in results):
        raise typer.Exit(exits.EXIT_NOT_EQUAL)
