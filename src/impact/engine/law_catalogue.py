"""The catalogues of laws and of friction laws, or parts of them, as tables; one law in full."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from ..contact.catalogue import Law, look_up
from ..contact.dimensionless import delivered
from ..contact.evidence import count_states
from ..contact.friction import FrictionLaw
from ..contact.frictions import frictions as friction_catalogue
from ..contact.model import ForceModel, Parameter
from ..contact.models import catalogue
from ..contact.numba.dispatch import serves
from ..display import Block, Displayed, Styled, Table, Wrapped, html_of
from ..errors import UsageError, did_you_mean, require_known
from ..formatting import argument, decimals, number, with_year
from .plugins import read_plugins

# requested e of which a table of the catalogue shows the delivered restitution
E_VALUES = (0.1, 0.3, 0.5, 0.7, 0.9)
# characters that a column of the catalogue takes, with the space before it: of a value of e, and of the others
E_WIDTH, WIDTHS = 8, {"equation": 32, "core": 7, "stated domain": 26}
# exponents for which the compiled core is reported
COMPILED_AT = (1.0, 1.5, 2.0, 2.5, 3.0)
# characters of a text about one model, which may be a plug-in
MAX_TEXT = 2000
# what the fields of a friction law mean
STIFFNESS = {
    "constant": "k_t or kt_over_kn",
    "mindlin": "8 G* a of the materials, k_t or kt_over_kn",
    "liggghts": "8 G* a of the materials (n = 3/2), K (n = 1) or kt_over_kn",
    "kratos": "4 G*/E* of the materials times that of the contact force",
    "classic": "k_t a",
}
MEMORY = {
    (0.0, 0.0): "the force",
    (1.0, 1.0): "the displacement",
    (0.0, 1.0): "the force, rescaled on unloading",
    (1.0, 2.0): "the displacement, rescaled on unloading",
}
CAPS = {
    "total": "spring and dashpot together",
    "spring": "the spring alone, without a dashpot where it slips",
    "both": "the spring, and spring and dashpot together",
}


@dataclass(frozen=True)
class ModelDescription(Displayed):
    """One law: its declaration, the restitution that it delivers, and what integrates it."""

    model: ForceModel

    def as_dict(self) -> dict[str, Any]:
        """The declaration as plain data."""
        return {
            **law_record(self.model, "family", "domain_source", "exponent", "release"),
            "domain": {name: list(ends) for name, ends in self.model.domain.items()},
            "delivered_restitution": self.delivered,
            "integrated_by": self.cores,
        }

    @property
    def delivered(self) -> dict[str, float]:
        """The exact restitution by the requested e; empty if it is not known or depends on parameters."""
        values = delivered(self.model, np.array(E_VALUES))
        return {} if values is None else {number(e): out for e, out in zip(E_VALUES, values.tolist(), strict=True)}

    @property
    def cores(self) -> str:
        """The core that integrates the law if numba is installed."""
        exponent = self.model.exponent
        exponents = COMPILED_AT if exponent is None else (exponent,)
        approach, restitution = ([n for n in exponents if serves(self.model, n)[phase]] for phase in (0, 1))
        phases = [name for name, served in (("approach", approach), ("restitution", restitution)) if served]
        if not phases:
            return "numpy"
        condition = f", where n is {', '.join(map(number, approach))}" if exponent is None else ""
        only = f" on {phases[0]}, numpy else" if len(phases) == 1 else ""
        return f"numba{only}{condition}"

    def sections(self, width: int) -> Iterator[Block]:
        """The declaration, one property per line."""
        model = self.model
        gap = "the permanent indentation" if model.is_permanent else "zero indentation"
        rows = {
            "stated domain": model.domain_text or "not stated",
            "exponent": "the sweep's n" if model.exponent is None else f"n = {number(model.exponent)}, its own",
            "ends at": gap if model.release == "gap" else f"zero force, at {gap} at the latest",
            "integrated by": self.cores,
        }
        rows |= parameter_rows(f"[model.{model.key}]", model.parameters)
        rows["delivers"] = ", ".join(f"{decimals(out)} for e = {e}" for e, out in self.delivered.items())
        yield _description(model, rows)


@dataclass(frozen=True)
class FrictionDescription(Displayed):
    """One friction law: its declaration."""

    law: FrictionLaw

    def as_dict(self) -> dict[str, Any]:
        """The declaration as plain data."""
        return law_record(self.law, "kind", "memory", "cap", *(["scheme"] if self.law.scheme else []))

    def sections(self, width: int) -> Iterator[Block]:
        """The declaration, one property per line."""
        law, is_spring = self.law, self.law.kind == "spring"
        rows = {
            "only in": f'solver.integrator = "{law.scheme}"' if law.scheme else "",
            "stiffness": STIFFNESS.get(law.stiffness, ""),
            "keeps": MEMORY[law.memory] if is_spring else "",
            "limited": CAPS[law.cap] if is_spring else "",
            **parameter_rows(f"[friction.{law.key}]", law.parameters),
        }
        yield _description(law, rows)


def _description(law: ForceModel | FrictionLaw, more: Mapping[str, str]) -> Table:
    """Tabulate a law, one property per line, without empty ones: what all laws have, and more."""
    noun, group = ("model", "family") if isinstance(law, ForceModel) else ("friction law", "kind")
    rows = {
        noun: law.key,
        "same law as": law.same_as,
        "title": with_year(law.title, law.year),
        **{name: getattr(law, name) for name in (group, "equation", "reference", "doi")},
        "evidence": str(law.evidence),
        **more,
    }
    return Table([row for row in rows.items() if row[1]], max_cell=MAX_TEXT)


def law_record(law: ForceModel | FrictionLaw, *more_fields: str) -> dict[str, Any]:
    """Convert the declaration of a law to plain data; rare fields of a parameter are left out where empty."""
    names = ("key", "title", "year", "equation", "reference", "doi", "same_as", *more_fields)
    rare = ("optional", "choices", "is_damping")
    return {
        **{name: getattr(law, name) for name in names},
        "evidence": vars(law.evidence),
        "parameters": [
            {name: value for name, value in vars(parameter).items() if value or name not in rare}
            for parameter in law.parameters
        ],
    }


def parameter_rows(table: str, parameters: Sequence[Parameter]) -> dict[str, str]:
    """Describe the parameters of a table of a config, a line each; the table is named once."""
    rows = {}
    for index, parameter in enumerate(parameters):
        default, choices = parameter.default, [f'"{word}"' for word in parameter.choices]
        status = "optional" if parameter.optional else "required"
        if default is not None:
            status = f"default {choices[int(default)] if choices else number(default)}"
        unit = "" if parameter.unit == "1" else f" [{parameter.unit}]"
        limits = " or ".join(choices) or f"from {number(parameter.least)} to {number(parameter.most)}"
        rows[" " * index or table] = f"{parameter.name}{unit}: {parameter.meaning}; {limits}, {status}"
    return rows


class Laws(dict[str, Law], Displayed):
    """Laws by key, which a notebook shows as a table."""

    _noun: str
    _describe: Callable[[Law], Displayed]

    def __repr__(self) -> str:
        return f"{len(self)} {self._noun}s: {', '.join(self)}"

    def find(self, key: str) -> Law:
        """Look up a law.

        Raises
        ------
        ModelError : none has this key; the message names the nearest one
        """
        return look_up(self, key, self._noun)

    def as_dict(self) -> dict[str, Any]:
        """The declarations by key."""
        return {key: self._describe(law).as_dict() for key, law in self.items()}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """The declarations."""
        return list(self.as_dict().values())

    @property
    def _evidence_line(self) -> Wrapped:
        """How many formulas are verified, and how."""
        entries = "this entry" if len(self) == 1 else f"these {len(self)} entries"
        counts = count_states(law.evidence for law in self.values())
        return Wrapped(f"Evidence for the formulas of {entries}: {counts}.")


class Models(Laws[ForceModel]):
    """Models by key, which a notebook shows as a table."""

    _noun, _describe = "model", ModelDescription

    def sections(self, width: int) -> Iterator[Block]:
        """One row for each model, by family, with the columns that fit the terminal, and what they mean."""
        width_left = width - max(map(len, self))
        columns = _catalogue_columns(max(width_left, E_WIDTH))
        rows: list[Sequence[object]] = []
        for family, members in groupby(self.values(), lambda model: model.family):
            rows.append([Styled(f"family:{family}", "dim")])
            cells = ((model.key, _catalogue_cells(model)) for model in members)
            rows += [[key, *(of_model.get(name, "–") for name in columns)] for key, of_model in cells]
        numbers = [position for position, name in enumerate(columns, 1) if name not in WIDTHS]
        yield Table(
            rows,
            ("model", *columns),
            text={*range(len(columns) + 1)}.difference(numbers),
            # on the narrowest terminal the keys are folded, so that one value stays
            no_wrap=(*([0] if width_left >= E_WIDTH else []), *numbers),
            max_cell=MAX_TEXT,
        )
        if numbers:
            yield ""
            yield Wrapped("The columns e=... show the delivered restitution for each requested e.")
        if "core" in columns:
            yield Wrapped(
                "The column core shows what integrates a law, or a phase of it, if numba is installed "
                '(extra "fast").'
            )
        yield Wrapped(
            "A model with [parameters] depends on them; `impact models KEY` describes one model in full."
        )
        yield self._evidence_line

    def _repr_html_(self) -> str:
        rows = [
            (key, model.family, model.equation, ", ".join(p.name for p in model.parameters), model.domain_text)
            for key, model in self.items()
        ]
        return html_of([Table(rows, ("model", "family", "equation", "parameters", "stated domain"))])


class Frictions(Laws[FrictionLaw]):
    """Friction laws by key, which a notebook shows as a table."""

    _noun, _describe = "friction law", FrictionDescription

    def sections(self, width: int) -> Iterator[Block]:
        """One row for each friction law, and how to read the table."""
        rows = [
            (key, law.kind, law.equation, ", ".join(parameter.name for parameter in law.parameters))
            for key, law in self.items()
        ]
        yield Table(rows, ("friction law", "kind", "equation", "parameters"), text=(0, 1, 2, 3), max_cell=MAX_TEXT)
        yield ""
        yield Wrapped(
            "f is the friction, F the contact force, g the slip speed. A friction law is combined with any "
            "contact force; `impact models KEY --frictions` describes one in full."
        )
        yield self._evidence_line


def _catalogue_columns(width_left: int) -> list[str]:
    """Choose the columns that a table of the catalogue shows next to the keys: values of e, and others.

    >>> _catalogue_columns(3), _catalogue_columns(20), _catalogue_columns(48)
    ([], ['e=0.1', 'e=0.9'], ['e=0.1', 'e=0.3', 'e=0.5', 'e=0.7', 'e=0.9', 'core'])
    """
    count = min(len(E_VALUES), width_left // E_WIDTH)
    few: dict[int, tuple[float, ...]] = {0: (), 1: (0.5,), 2: (0.1, 0.9), 3: (0.1, 0.5, 0.9)}
    columns = [f"e={number(e)}" for e in few.get(count, E_VALUES[: count - 1] + E_VALUES[-1:])]
    width_left -= E_WIDTH * len(columns)
    for name, width in WIDTHS.items():
        if width_left >= width:
            columns.append(name)
            width_left -= width
    return columns


def _catalogue_cells(model: ForceModel) -> dict[str, str]:
    """Write what is known of a model in a table of the catalogue, by column."""
    description = ModelDescription(model)
    delivered_e = {f"e={e}": decimals(out) for e, out in description.delivered.items()}
    if model.same_as:
        return delivered_e | {"equation": f"same law as {model.same_as}", "core": "", "stated domain": ""}
    parameters = ", ".join(parameter.name for parameter in model.parameters)
    equation = model.equation + (f"  [{parameters}]" if parameters else "")
    texts = {"equation": equation, "core": description.cores.split()[0].rstrip(",")}
    return delivered_e | texts | ({"stated domain": model.domain_text} if model.domain_text else {})


def models(
    plugins: Sequence[ForceModel | str | Path] = (),
    *,
    pattern: str = "*",
    family: str | None = None,
    search: str | None = None,
) -> Models:
    """The catalogue of contact force models, by key, or a part of it.

    Parameters
    ----------
    plugins : plug-in models, and paths of Python files with such models, which come last
    pattern : pattern of the keys, such as "lammps-*", or a family as in a config, such as "family:hysteresis"
    family : name of the family; by default all families
    search : words that all have to occur in the key, title, year, equation, reference or DOI, in any case

    Returns
    -------
    Models : a mapping of keys to laws (`ForceModel`); `print` shows a table

    Raises
    ------
    UsageError : no model matches the pattern or the words, or there is no such family
    ModelError : a plug-in cannot be read or is invalid

    >>> import impact
    >>> impact.models()["gharib-hurmuzlu-2012"].equation
    'F = K δⁿ (1 + χ δ̇/v₀),  χ = 1/e  (28)'
    >>> list(impact.models(pattern="lankarani-*"))
    ['lankarani-nikravesh-1990', 'lankarani-nikravesh-1994']
    """
    all_models = catalogue(read_plugins(plugins).models)
    families = sorted({model.family for model in all_models.values()})
    if pattern.startswith("family:"):
        if family is not None:
            raise UsageError(f"{argument('family')}: got the pattern {pattern} as well, expected one of the two")
        pattern, family = "*", pattern.removeprefix("family:")
    require_known([] if family is None else [family], families, f"{argument('family')}: no family")
    candidates = {key: model for key, model in all_models.items() if family in (None, model.family)}
    return Models(matching_laws(candidates, "model", pattern, search))


def frictions(*, pattern: str = "*", search: str | None = None) -> Frictions:
    """The catalogue of friction laws, by key, or a part of it.

    Parameters
    ----------
    pattern : pattern of the keys, such as "lammps-*"
    search : words that all have to occur in the key, title, year, equation, reference or DOI, in any case

    Returns
    -------
    Frictions : a mapping of keys to laws (`FrictionLaw`); `print` shows a table

    Raises
    ------
    UsageError : no friction law matches the pattern or the words

    >>> import impact
    >>> impact.frictions()["coulomb-1785"].equation
    'f = μ N sgn g until g = 0, then 0'
    >>> list(impact.frictions(pattern="yade-*"))
    ['yade-cundall-strack', 'yade-mindlin', 'yade-viscoelastic']
    """
    return Frictions(matching_laws(friction_catalogue(), "friction law", pattern, search))


def matching_laws(laws: Mapping[str, Law], noun: str, pattern: str, search: str | None) -> dict[str, Law]:
    """Select the laws whose keys match a pattern, and whose description has all words of a search.

    Raises
    ------
    UsageError : no law matches; the message calls one by the noun
    """
    matching = {key: law for key, law in laws.items() if fnmatchcase(key, pattern)}
    if not matching:
        raise UsageError(f'no {noun} matches "{pattern}"; {did_you_mean(pattern.strip("*?"), list(laws))}')
    if search is not None:
        for word in search.casefold().split():
            matching = {key: law for key, law in matching.items() if word in _search_text(law)}
        if not matching:
            raise UsageError(
                f'{argument("search")}: no {noun} has "{search[:60]}" in its title, equation or reference'
            )
    return matching


def _search_text(law: ForceModel | FrictionLaw) -> str:
    """Join what a search looks at."""
    group = law.family if isinstance(law, ForceModel) else law.kind
    return " ".join((law.key, group, law.title, str(law.year), law.equation, law.reference, law.doi)).casefold()
