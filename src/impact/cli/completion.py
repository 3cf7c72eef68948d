"""Shell completion of the values of options: model keys, config keys, inputs, axes and outputs.

Each function lists all words, of which typer shows those that begin with what was typed. A completion must not
fail: where nothing is known, such as the axes of a file that does not exist, it is empty.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module

import typer

import impact


def complete_model() -> list[str]:
    """The keys of models, of those in installed packages too."""
    return list(impact.models())


def complete_friction() -> list[str]:
    return list(impact.frictions())


def complete_key_of(module: str, table: str, suffix: str = "") -> Callable[[], list[str]]:
    """Make the completion of the keys of a table with a suffix; its module is imported when one is completed."""
    return lambda: [f"{key}{suffix}" for key in getattr(import_module(f"impact.{module}"), table)]


complete_family = complete_key_of("contact.models", "FAMILIES")
complete_engine = complete_key_of("conformance.registry", "ENGINES")
complete_code = complete_key_of("exporters.registry", "CODES")
complete_scheme = complete_key_of("contact.fixed_step", "SCHEMES")
complete_kind = complete_key_of("plots.kinds", "KINDS")
complete_output = complete_key_of("contact.variables", "OUTPUTS")
complete_target = complete_key_of("contact.variables", "OUTPUTS", "=")


def complete_input(context: typer.Context) -> list[str]:
    """`NAME=` of the inputs, and of the parameters of the model of --model."""
    from ..config.input_names import SWEEP_INPUTS

    return [f"{name}=" for name in (*SWEEP_INPUTS, *_parameters(context))]


def complete_unknown(context: typer.Context) -> list[str]:
    """What `impact solve` solves for: the parameters of the model and of the friction law, K, e and mu."""
    return [*_parameters(context), "K", "e", "mu"]


def complete_axis(context: typer.Context) -> list[str]:
    """The axes of the result that the command line names."""
    from ..errors import ImpactError

    # an option without its value yet leaves the arguments unparsed
    for path in filter(None, (context.params.get("result"), *context.args)):
        with suppress(OSError, ImpactError):
            return [str(name) for name in impact.load(path).dims if name not in ("model", "friction")]
    return []


def complete_selection(context: typer.Context) -> list[str]:
    """`NAME=` of the axes of the result that the command line names."""
    return [f"{name}=" for name in complete_axis(context)]


def complete_setting() -> list[str]:
    """`TABLE.KEY=` of the keys of a config."""
    from ..config.tables import KEYS_BY_TABLE

    keys = ["title", "models", "frictions"]
    keys += [f"{table}.{key}" for table, names in KEYS_BY_TABLE.items() for key in names]
    return [*(f"{key}=" for key in keys), "materials.", "model.", "friction."]


def _parameters(context: typer.Context) -> list[str]:
    model = impact.models().get(context.params.get("model") or "")
    return sorted(parameter.name for parameter in model.parameters) if model else []
