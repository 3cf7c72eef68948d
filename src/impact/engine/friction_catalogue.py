"""The catalogue of friction laws, or a part of it, as a table; one friction law in full."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ..contact.friction import FrictionLaw
from ..contact.frictions import frictions as catalogue
from ..display import Block, Displayed, Table, Wrapped
from ..formatting import with_year
from .model_catalogue import MAX_TEXT, Laws, law_record, matching_laws, parameter_rows

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
            "friction law": law.key,
            "title": with_year(law.title, law.year),
            "kind": law.kind,
            "equation": law.equation,
            "reference": law.reference,
            "doi": law.doi,
            "evidence": str(law.evidence),
            "only in": f'solver.integrator = "{law.scheme}"' if law.scheme else "",
            "stiffness": STIFFNESS.get(law.stiffness, ""),
            "keeps": MEMORY[law.memory] if is_spring else "",
            "limited": CAPS[law.cap] if is_spring else "",
            **parameter_rows(f"[friction.{law.key}]", law.parameters),
        }
        yield Table([row for row in rows.items() if row[1]], max_cell=MAX_TEXT)


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
    return Frictions(matching_laws(catalogue(), "friction law", pattern, search))
