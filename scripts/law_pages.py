"""The pages of the single laws on the documentation site, from their declarations."""

from __future__ import annotations

import ast
import inspect
import json
import math
import re
from collections.abc import Mapping
from functools import cache
from itertools import takewhile
from pathlib import Path
from types import FunctionType
from typing import Any

import impact
from frictions_page import E_IMPACT, MU, column_parameters, partner
from impact.contact.formula_calls import Formula
from impact.contact.friction import FrictionLaw
from impact.contact.frictions import frictions
from impact.contact.model import ForceModel, Parameter
from impact.contact.models import catalogue
from impact.display import Table
from impact.formatting import with_year
from law_properties import is_adhesive, names_in_codes, original, speed_dependent
from models_page import restitution_over_speed, validity_lines, yes
from models_pictures import labelled_picture
from models_restitution import BALLS, MATERIAL, curve_params, restitution_curves
from models_tables import cell, short, table

PAGE = """\
---
orphan: true
---
<!-- Generated from the declaration of the law; do not edit. -->

# {key}

{title}. <a href="../../{page}.html#{key}">The row of {key} in the catalogue</a>

{curve}<div class="law">

{properties}

</div>

## Parameters

<div class="law">

{parameters}

</div>

## In codes

<div class="law">

{codes}

</div>

## Example

{example}

## BibTeX

```bibtex
{bibtex}
```
"""
WIDTH = 100
# of the laws of schemes: steps per contact, and a tangential stiffness per radius of the contact [N/m^2]
STEPS, CLASSIC_STIFFNESS = 50.0, 1e9


def law_pages() -> dict[str, str]:
    """The pages of all laws as text, by the name of the catalogue and the key: a code's name may be in both."""
    laws = {"models": catalogue(), "frictions": frictions()}
    return {f"{name}/{key}": law_page(law) for name, of_kind in laws.items() for key, law in of_kind.items()}


def law_page(law: ForceModel | FrictionLaw) -> str:
    """The page of a law as text."""
    is_model = isinstance(law, ForceModel)
    return PAGE.format(
        key=law.key,
        title=cell(with_year(law.title, law.year)),
        page="models" if is_model else "frictions",
        curve=curve(original(law)) if isinstance(law, ForceModel) else "",
        properties=table(("property", "value"), properties(law)),
        parameters=parameter_table(law),
        codes=codes_table(law),
        example=example(law),
        bibtex="\n\n".join(citation.bibtex for citation in impact.cite(law)),
    )


def curve(model: ForceModel) -> str:
    """The restitution curve of a model, and what it was computed for."""
    shown = restitution_curves()[model.key]
    values = ", ".join(f"{name} = {short(value)}" for name, value in shown.params.items())
    notes = [f"Integrated for the balls of the example, with {cell(values)} in SI."] if values else []
    notes += ["The dashed line is e_out = e."] if shown.over == "e" else ["The speed is on a logarithmic scale."]
    notes += ["The stated domain is shaded."] if "e" in model.domain else []
    return f"{labelled_picture(model)}\n{' '.join(notes)}\n\n"


def properties(law: ForceModel | FrictionLaw) -> list[list[str]]:
    """The rows of a description, without parameters, and the computed properties."""
    (declared,) = (block for block in impact.describe(law).sections(WIDTH) if isinstance(block, Table))
    rows = {str(name): cell(str(text)) for name, text in declared.rows if str(name).strip()[:1] not in ("", "[")}
    # the heading has them
    for name in ("model", "friction law", "title"):
        rows.pop(name, None)
    if "same law as" in rows:
        rows["same law as"] = f"[`{law.same_as}`]({law.same_as}.md)"
    if law.doi:
        rows["doi"] = f"[{cell(law.doi)}](https://doi.org/{law.doi})"
    if isinstance(law, ForceModel):
        model = original(law)
        is_over_e = restitution_curves()[model.key].over == "e"
        rows |= {
            "takes e": yes("e" in model.quantities),
            "depends on speed": yes(model.key in speed_dependent()),
            "adhesive": yes(is_adhesive(model)),
            "largest error": "<br>".join(validity_lines(model)) if is_over_e else "",
            "restitution": "" if is_over_e else restitution_over_speed(model),
            "closed form": closed_form(model.oracle),
        }
    return [[name, text] for name, text in rows.items() if text]


def closed_form(oracle: Formula | None) -> str:
    """The formula of the delivered restitution, and what the functions say that it calls."""
    if oracle is None:
        return "none: e_out is integrated"
    assert isinstance(oracle, FunctionType)
    code = oracle.__code__
    sources = (
        ast.unparse(node.body)
        for node in ast.walk(parsed(code.co_filename))
        if isinstance(node, ast.Lambda)
        and (node.lineno, len(node.args.args)) == (code.co_firstlineno, code.co_argcount)
    )
    names = code.co_names if code.co_name == "<lambda>" else (code.co_name,)
    # a function with a name says itself what it is
    source = next(sources, f"{code.co_name}({', '.join(code.co_varnames[: code.co_argcount])})")
    functions = (oracle.__globals__.get(name) for name in names)
    meanings = (
        f"`{function.__name__}`: {cell(prose(function))}"
        for function in functions
        if isinstance(function, FunctionType) and "closed_forms" in function.__module__
    )
    return "<br>".join([f"`e_out = {source}`", *meanings])


@cache
def parsed(path: str) -> ast.Module:
    """The syntax tree of a module."""
    return ast.parse(Path(path).read_text(encoding="utf-8"))


def prose(function: FunctionType) -> str:
    """The paragraphs of a docstring before its sections and examples."""
    paragraphs = (inspect.getdoc(function) or "").split("\n\n")
    is_prose = takewhile(lambda text: not re.match(r">>>|\w+\n---", text), paragraphs)
    return " ".join(" ".join(is_prose).split())


def parameter_table(law: ForceModel | FrictionLaw) -> str:
    """The parameters of a law with units, limits and defaults."""
    kind = "model" if isinstance(law, ForceModel) else "friction"
    if not law.parameters:
        return "It has none besides the inputs of every collision."
    rows = ([f"`{p.name}`", p.unit, cell(p.meaning), allowed(p), default(p)] for p in law.parameters)
    return f"Set in `[{kind}.{law.key}]`.\n\n" + table(("name", "unit", "meaning", "values", "default"), rows)


def allowed(parameter: Parameter) -> str:
    """The values that a parameter may have."""
    if parameter.choices:
        return " or ".join(f'`"{word}"`' for word in parameter.choices)
    return f"{parameter.least:g} to {parameter.most:g}"


def default(parameter: Parameter) -> str:
    """What a parameter is where it is not set."""
    if parameter.default is None:
        return "optional" if parameter.optional else "required"
    return f'`"{parameter.choices[int(parameter.default)]}"`' if parameter.choices else f"{parameter.default:g}"


def codes_table(law: ForceModel | FrictionLaw) -> str:
    """What codes call a law, and the command that writes it for them."""
    option = "model" if isinstance(law, ForceModel) else "friction"
    rows = [
        [cell(code.title), cell(name), f"`impact export --to {code.name} --{option} {key}`"]
        for code, name, key in names_in_codes(law)
    ]
    head = ("code", "its name there", "written by")
    return table(head, rows) if rows else "None of the codes that [impact export](../../export.md) writes has it."


def example(law: ForceModel | FrictionLaw) -> str:
    """A config with the law, with what its curve was computed for, and the commands that take it."""
    is_model = isinstance(law, ForceModel)
    config = model_example(law) if isinstance(law, ForceModel) else friction_example(law)
    axis = next(name for name, value in config["sweep"].items() if isinstance(value, dict))
    commands = ["impact sweep law.toml -o law.h5"]
    # a single impact has no step
    if "solver" not in config:
        commands.insert(0, "impact run law.toml" + ("" if is_model else " --at angle=45deg"))
    return f"""\
A sweep over {axis}, `law.toml`:

```toml
{toml(config)}
```

```sh
{chr(10).join(commands)}
```"""


def model_example(model: ForceModel) -> dict[str, Any]:
    """The balls of the curve, over e or over the speed."""
    law = original(model)
    params = curve_params(law)
    required = {p.name: float(short(params[p.name])) for p in model.parameters if p.default is None}
    takes_e = "e" in law.quantities
    axis = {"e": {"linspace": [0.1, 1.0, 19]}} if takes_e else {"v1": {"geomspace": [0.1, 10.0, 21]}}
    config = {"models": [model.key], "sweep": {**BALLS, **axis}, "materials": {"aluminium": MATERIAL}}
    return config | ({"model": {model.key: required}} if required else {})


def friction_example(law: FrictionLaw) -> dict[str, Any]:
    """The ball and the wall of the columns, over the angle of incidence."""
    angles = {"linspace": ["5 deg", "85 deg", 17]}
    sweep = {**BALLS, "m2": math.inf, "e": E_IMPACT, "mu": MU, "angle": angles}
    config: dict[str, Any] = {"models": [partner(law)], "frictions": [law.key], "sweep": sweep}
    config["materials"] = {"aluminium": MATERIAL}
    parameters = column_parameters(law)
    if law.stiffness == "classic":
        parameters["k_t"] = CLASSIC_STIFFNESS
    if law.scheme:
        sweep["steps_per_contact"] = STEPS
        config["solver"] = {"integrator": law.scheme}
    return config | ({"friction": {law.key: parameters}} if parameters else {})


def toml(config: Mapping[str, Any]) -> str:
    """Write a config with tables of one or two levels as TOML."""
    lines = [f"{name} = {toml_value(value)}" for name, value in config.items() if not isinstance(value, Mapping)]
    tables = {name: config[name] for name in ("sweep", "solver") if name in config}
    for name in ("materials", "model", "friction"):
        tables |= {f"{name}.{key}": values for key, values in config.get(name, {}).items()}
    for name, values in tables.items():
        lines += ["", f"[{name}]", *(f"{key} = {toml_value(value)}" for key, value in values.items())]
    return "\n".join(lines)


def toml_value(value: Any) -> str:
    """Write a value as TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{name} = {toml_value(part)}" for name, part in value.items()) + " }"
    return f"{value:g}" if isinstance(value, float) else json.dumps(value)
