"""The Python interface; each command of the command line calls a function of this module."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from .comparison.bless import bless as bless
from .comparison.compare import compare as compare
from .comparison.verdict import Verdict as Verdict

# a name imported "as itself" is public, see `impact.__all__`
from .contact.evidence import Evidence as Evidence
from .contact.model import ForceModel as ForceModel, Parameter as Parameter
from .contact.models import catalogue
from .contact.models.hysteresis import hysteresis as hysteresis
from .contact.powers import power as power
from .engine.plugins import read_plugins
from .errors import ImpactError as ImpactError, UsageError, did_you_mean
from .results.single_impact import Impact as Impact
from .results.xarray_backend import load as load, save as save
from .text import html_table, safe_text

if TYPE_CHECKING:
    from .contact.checks import ClauseResult


class Models(dict[str, ForceModel]):
    """Models by key, which a notebook shows as a table."""

    def __repr__(self) -> str:
        return f"{len(self)} models: {', '.join(self)}"

    def _repr_html_(self) -> str:
        rows = (
            (key, model.family, model.equation, ", ".join(p.name for p in model.parameters), model.domain_text)
            for key, model in self.items()
        )
        return html_table(("model", "family", "equation", "parameters", "stated domain"), rows)


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
        pattern, family = "*", pattern.removeprefix("family:")
    if family is not None and family not in families:
        raise UsageError(f'--family: no family "{family}"; {did_you_mean(family, families)}')
    of_family = {key: model for key, model in all_models.items() if family in (None, model.family)}
    matching = {key: model for key, model in of_family.items() if fnmatchcase(key, pattern)}
    if not matching:
        raise UsageError(f'no model matches "{pattern}"; {did_you_mean(pattern.strip("*?"), list(of_family))}')
    if search is not None:
        words = search.casefold().split()
        matching = {key: model for key, model in matching.items() if _contains(model, words)}
        if not matching:
            raise UsageError(
                f'--search: no model has "{safe_text(search, 60)}" in its title, equation or reference'
            )
    return Models(matching)


def _contains(model: ForceModel, words: Sequence[str]) -> bool:
    """Whether all words occur in what is written about a model."""
    about = (model.key, model.family, model.title, str(model.year), model.equation, model.reference, model.doi)
    text = " ".join(about).casefold()
    return all(word in text for word in words)


def check_model(model: ForceModel) -> list[ClauseResult]:
    """Check a model, such as a plug-in, against every clause of the contract, with forty dissimilar impacts.

    Returns
    -------
    list of ClauseResult : the clause, the largest deviation, its bound, and whether the clause holds

    Warns
    -----
    UserWarning : a formula raised an error, with its file, line and text

    >>> import impact
    >>> all(finding.holds for finding in impact.check_model(impact.models()["bilinear"]))
    True
    """
    # its module integrates, which a program that only imports impact does without
    from .contact.checks import check_contract

    return list(check_contract(model))
