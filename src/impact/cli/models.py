"""The commands that show the catalogues: models, one law or the checks of one, materials, and cite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import impact

from ..display import Displayed, Table, dump, print_blocks, show
from ..errors import UsageError, require_known
from . import exits, options
from .completion import complete_family, complete_model

if TYPE_CHECKING:
    from ..contact.model import ForceModel
    from ..engine.law_catalogue import Frictions, Models

# units of the properties of a material in a table, and their sizes in SI
DISPLAY_UNITS = {"E": ("GPa", 1e9), "nu": ("-", 1.0), "rho": ("kg/m3", 1.0), "yield_strength": ("MPa", 1e6)}


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
        str | None, options.value("NAME", "List only the laws of this family.", complete_family)
    ] = None,
    search: Annotated[
        str | None,
        options.value(
            "WORDS", 'List the laws with these words in key, title, equation or reference: "lammps hertz".'
        ),
    ] = None,
    check: Annotated[
        Path | None,
        options.value("FILE|KEY", "Check the models of a Python file, or a model, against the contract."),
    ] = None,
    frictions: Annotated[bool, typer.Option("--frictions", help="List friction laws, not models.")] = False,
    plugins: options.Plugins = None,
    as_json: options.Json = False,
) -> None:
    """List the contact force models, or the friction laws: equations, references, domains, restitution."""
    is_law = key is not None and search is None and not (key.startswith("family:") or {*"*?["} & {*key})
    selected = {"--family": family, "--plugin": plugins}
    for name, is_set, excluded in (
        ("--frictions", frictions, selected | {"--check": check}),
        ("--check", check is not None, selected | {"--search": search}),
        (key, is_law, {"--family": family}),
    ):
        for other, value in excluded.items():
            if is_set and value is not None:
                raise UsageError(f"{name}: got it with {other}, expected one of the two")
    if check is not None:
        others = impact.models()
        if check.suffix:
            known = impact.models([check])
            checked = [model for name, model in known.items() if name not in others and key in (None, name)]
            checked = checked or [known.find(str(key))]
        elif key is not None:
            raise UsageError(f"--check: got {check} with {key}, expected one of the two")
        else:
            checked = [others.find(str(check))]
        _check_contract(checked, as_json=as_json)
        return
    shown: Displayed
    if key is not None and is_law:
        laws: Frictions | Models = impact.frictions() if frictions else impact.models(plugins or ())
        if key not in laws and key in impact.frictions():
            laws = impact.frictions()
        shown = impact.describe(laws.find(key))
    elif frictions:
        shown = impact.frictions(pattern=key or "*", search=search)
    else:
        shown = impact.models(plugins or (), pattern=key or "*", family=family, search=search)
    _show_records(shown, as_json=as_json)


def _show_records(shown: Displayed, *, as_json: bool) -> None:
    """Print a result, or the list of its records as JSON."""
    if as_json:
        print(dump(shown.records()))
    else:
        show(shown)


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


def materials(
    name: Annotated[str | None, typer.Argument(help="A material to show alone. \\[default: list them]")] = None,
    as_json: options.Json = False,
) -> None:
    """List common materials, which need no table in a config: E, nu, rho, yield strength, source."""
    catalogue = impact.materials()
    require_known([] if name is None else [name], catalogue, "no material")
    shown = catalogue if name is None else {name: catalogue[name]}
    if as_json:
        print(dump(shown))
        return
    rows = []
    for key, record in shown.items():
        values = (float(record[p]) / size if p in record else "–" for p, (_, size) in DISPLAY_UNITS.items())
        rows.append((key, *values, record["about"], record["source"]))
    headings = ("material", *(f"{key} [{unit}]" for key, (unit, _) in DISPLAY_UNITS.items()), "what", "source")
    print_blocks([Table(rows, headings, text=(0, -2, -1))])


def cite(
    laws: Annotated[
        list[str],
        typer.Argument(
            metavar="LAW...",
            autocompletion=complete_model,
            help="Keys of models and friction laws; results, of which every law is cited; impact, the program.",
        ),
    ],
    plugins: options.Plugins = None,
    as_json: options.Json = False,
) -> None:
    """Write BibTeX of laws, from their references, with the evidence for their formulas."""
    exits.write_utf8()
    _show_records(impact.cite(*laws, plugins=plugins or ()), as_json=as_json)
