"""The command `models`: the catalogue, one law, or the checks of a user-defined law."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import impact

from ..formatting import decimals, number
from ..text import with_year
from . import exits
from .completion import complete_family, complete_model
from .console import cell, console, dump, print_rows, table
from .options import JsonOption, PluginOption

if TYPE_CHECKING:
    from rich.text import Text

    from ..contact.checks import ClauseResult
    from ..contact.model import ForceModel, Parameter

# where a table of the catalogue shows the delivered restitution
E_VALUES = (0.1, 0.3, 0.5, 0.7, 0.9)
# characters that a column of the catalogue takes, with the space before it
E_WIDTH, EQUATION_WIDTH, DOMAIN_WIDTH, CORE_WIDTH = 8, 32, 26, 7
# exponents for which the compiled core is reported
COMPILED_AT = (1.0, 1.5, 2.0, 2.5, 3.0)
# characters of a text about one model, which may be a plug-in
MAX_TEXT = 2000


def models(
    key: Annotated[
        str | None,
        typer.Argument(
            autocompletion=complete_model,
            help='A model to describe in full, or models to list: "lammps-*", family:hysteresis. '
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
    plugins: PluginOption = None,
    as_json: JsonOption = False,
) -> None:
    """List the contact force models: equations, references, domains, delivered restitution."""
    from ..contact.models import find
    from ..engine.plugins import read_plugins

    if check is not None:
        plugin_models = [plugin.model for plugin in read_plugins([check]).items if plugin.source is not None]
        _check_contract(
            [model for model in plugin_models if key in (None, model.key)] or [find(str(key), plugin_models)],
            as_json=as_json,
        )
        return
    is_pattern = key is None or search is not None or key.startswith("family:") or bool({*"*?["} & {*key})
    if is_pattern:
        chosen = list(impact.models(plugins or (), pattern=key or "*", family=family, search=search).values())
    else:
        chosen = [find(str(key), read_plugins(plugins or ()).models)]
    if as_json:
        print(dump([model_json(model) for model in chosen]))
    elif is_pattern:
        _print_models(chosen)
    else:
        _print_model(chosen[0])


def model_json(model: ForceModel) -> dict[str, Any]:
    """A model's declaration as plain data."""
    parameters = [vars(parameter) for parameter in model.parameters]
    names = ("key", "title", "year", "family", "equation", "reference", "doi", "same_as")
    return {
        **{name: getattr(model, name) for name in names},
        "evidence": vars(model.evidence),
        "domain": {name: list(ends) for name, ends in model.domain.items()},
        "domain_source": model.domain_source,
        "parameters": parameters,
        "exponent": model.exponent,
        "release": model.release,
        "delivered_restitution": _delivered(model),
        "integrated_by": _cores(model),
    }


def _delivered(model: ForceModel) -> dict[str, float]:
    """The exact delivered restitution by the e asked for; empty where there is none."""
    import numpy as np

    from ..contact.dimensionless import delivered

    values = delivered(model, np.array(E_VALUES))
    return {} if values is None else {number(e): out for e, out in zip(E_VALUES, values.tolist(), strict=True)}


def _print_models(models: Sequence[ForceModel]) -> None:
    """Print the catalogue: one line for each model, by family, with the columns that fit the terminal."""
    from rich.text import Text

    from ..contact.evidence import count_states

    out = console(sys.stdout)
    width_left = out.width - max(len(model.key) for model in models)
    asked, others = _catalogue_columns(max(width_left, E_WIDTH))
    rows = table("model", *(f"e={number(e)}" for e in asked), *others)
    # on the narrowest terminal the keys are folded, so that one value stays
    rows.columns[0].no_wrap = width_left >= E_WIDTH
    for column in rows.columns[1 + len(asked) :]:
        column.justify = "left"
    for column in rows.columns[1 : 1 + len(asked)]:
        column.no_wrap = True
    for family, members in groupby(models, lambda model: model.family):
        rows.add_row(Text(f"family:{family}", style="dim"))
        for model in members:
            rows.add_row(model.key, *_model_cells(model, asked, others))
    out.print(rows)
    if asked:
        out.print("\nThe columns e=... show the delivered restitution for each requested e.")
    if "core" in others:
        out.print(
            'The column core shows what integrates a law, or a phase of it, if numba is installed (extra "fast").'
        )
    out.print("A model with [parameters] depends on them; `impact models KEY` describes one model in full.")
    counts = count_states(model.evidence for model in models)
    entries = "this entry" if len(models) == 1 else f"these {len(models)} entries"
    out.print(f"Evidence for the formulas of {entries}: {counts}.")


def _catalogue_columns(width_left: int) -> tuple[tuple[float, ...], tuple[str, ...]]:
    """The values of e, and the other columns, that a table of the catalogue shows beside the keys.

    >>> _catalogue_columns(3), _catalogue_columns(20), _catalogue_columns(43)
    (((), ()), ((0.1, 0.9), ()), ((0.1, 0.3, 0.5, 0.7, 0.9), ()))
    """
    count = min(len(E_VALUES), width_left // E_WIDTH)
    asked = {0: (), 1: (0.5,), 2: (0.1, 0.9), 3: (0.1, 0.5, 0.9)}.get(count, E_VALUES[: count - 1] + E_VALUES[-1:])
    width_left -= E_WIDTH * len(asked)
    others = []
    for name, width in (("equation", EQUATION_WIDTH), ("core", CORE_WIDTH), ("stated domain", DOMAIN_WIDTH)):
        if width_left >= width:
            others.append(name)
            width_left -= width
    return asked, tuple(others)


def _model_cells(model: ForceModel, asked: Sequence[float], others: Sequence[str]) -> Iterator[Text | str]:
    """The cells of a model in a table of the catalogue."""
    from rich.text import Text

    delivered = _delivered(model)
    for e in asked:
        yield decimals(delivered[number(e)]) if delivered else "–"
    parameters = ", ".join(parameter.name for parameter in model.parameters)
    texts = {
        "equation": model.equation + (f"  [{parameters}]" if parameters else ""),
        "core": _cores(model).split()[0].rstrip(","),
        "stated domain": model.domain_text or "–",
    }
    if model.same_as:
        texts = {"equation": f"same law as {model.same_as}", "core": "", "stated domain": ""}
    for name in others:
        yield Text(texts[name])


def _print_model(model: ForceModel) -> None:
    """Print a model in full."""
    rows = {
        "model": model.key,
        "same law as": model.same_as,
        "title": with_year(model.title, model.year),
        "family": model.family,
        "equation": model.equation,
        "reference": model.reference,
        "doi": model.doi,
        "evidence": str(model.evidence),
        "stated domain": model.domain_text or "not stated",
        "exponent": "the sweep's n" if model.exponent is None else f"n = {number(model.exponent)}, its own",
        "ends at": _release(model),
        "integrated by": _cores(model),
    }
    for index, parameter in enumerate(model.parameters):
        # the table is named once
        rows[" " * index if index else f"[model.{model.key}]"] = _parameter(parameter)
    delivered = _delivered(model)
    if delivered:
        rows["delivers"] = ", ".join(f"{decimals(out)} for e = {e}" for e, out in delivered.items())
    print_rows({name: text for name, text in rows.items() if text}, MAX_TEXT)


def _parameter(parameter: Parameter) -> str:
    default = "required" if parameter.default is None else f"default {number(parameter.default)}"
    unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
    limits = f"from {number(parameter.least)} to {number(parameter.most)}"
    return f"{parameter.name}{unit}: {parameter.meaning}; {limits}, {default}"


def _release(model: ForceModel) -> str:
    gap = "the permanent indentation" if model.is_permanent else "zero indentation"
    return gap if model.release == "gap" else f"zero force, at {gap} at the latest"


def _cores(model: ForceModel) -> str:
    """The core that integrates a law if numba is installed."""
    from ..contact.numba.dispatch import serves

    tried = [model.exponent] if model.exponent is not None else COMPILED_AT
    approach, restitution = ([n for n in tried if serves(model, n)[phase]] for phase in (0, 1))
    phases = [name for name, served in (("approach", approach), ("restitution", restitution)) if served]
    if not phases:
        return "numpy"
    where = "" if model.exponent is not None else f", where n is {', '.join(map(number, approach))}"
    only = f" on {phases[0]}, numpy else" if len(phases) == 1 else ""
    return f"numba{only}{where}"


def _check_contract(models: Sequence[ForceModel], *, as_json: bool) -> None:
    """Print the outcome of every clause of the contract; exit 1 if one fails."""
    from rich.text import Text

    findings_by_model = [(model, impact.check_model(model)) for model in models]
    broken = [finding for _, findings in findings_by_model for finding in findings if not finding.holds]
    if as_json:
        print(
            dump(
                [
                    {
                        "model": model.key,
                        "holds": all(finding.holds for finding in findings),
                        "clauses": list(_clauses(findings)),
                    }
                    for model, findings in findings_by_model
                ]
            )
        )
    else:
        rows = table("model", "clause", "", "worst", "bound")
        rows.columns[1].justify = "left"
        for model, findings in findings_by_model:
            for index, finding in enumerate(findings):
                mark = Text("holds", style="green") if finding.holds else Text("broken", style="red")
                key = cell("" if index else model.key)
                rows.add_row(key, finding.clause, mark, number(finding.worst, 2), number(finding.bound, 2))
        console(sys.stdout).print(rows)
        for model, findings in findings_by_model:
            if not any(finding.clause == CLOSED_FORM for finding in findings):
                exits.print_line(
                    f"{model.key}: has no oracle, so that its restitution was compared with no closed form"
                )
    if broken:
        raise typer.Exit(exits.EXIT_NOT_EQUAL)


CLOSED_FORM = "agrees with its closed form"


def _clauses(findings: Sequence[ClauseResult]) -> Iterator[dict[str, Any]]:
    for finding in findings:
        yield {"clause": finding.clause, "holds": finding.holds, "worst": finding.worst, "bound": finding.bound}
