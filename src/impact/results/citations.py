"""How laws are cited: BibTeX from their references, with the evidence for their formulas."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from .._version import __version__
from ..contact.catalogue import look_up
from ..contact.friction import FrictionLaw
from ..contact.frictions import frictions
from ..contact.model import ForceModel
from ..display import LATEX_CHARACTERS, Block, Displayed
from ..engine.law_catalogue import models
from ..engine.plugins import read_plugins
from ..errors import UsageError
from ..formatting import law_keys
from .provenance import check_plugins
from .selection import chosen_laws
from .xarray_backend import load

# "Tsuji Y, Tanaka T (1992) Title. Journal 71, 239"; the title may be missing, and something may follow
AUTHOR = r"[^\W\d_][^(),;]* [A-Z]+"
PAPER = re.compile(rf"(?P<author>{AUTHOR}(?:, {AUTHOR})*(?: and others)?) \((?P<year>\d{{4}})\),? ?(?P<rest>.*)")
# the words of a journal are capitalised, those of a title are not
JOURNAL = r"(?P<journal>[A-Z][^, ]*(?: [A-Z][^, ]*)*)"
PLACE = r" (?P<volume>[\d-]+), (?P<pages>\w+)(?:, .*)?"
ARTICLES = (
    re.compile(JOURNAL + PLACE),
    re.compile(r"(?P<title>.+?)\. (?P<journal>[^,]+)" + PLACE),
    re.compile(r"(?P<title>.+?)\. (?P<howpublished>.+)"),
    re.compile(r"(?P<howpublished>.*)"),
)
# what LaTeX does not print as it is, besides letters of Greek and raised or lowered characters
SYMBOLS = LATEX_CHARACTERS | str.maketrans(
    {"µ": r"$\mu$", "√": r"$\surd$", "∞": r"$\infty$", "≤": r"$\le$", "≥": r"$\ge$", "≈": r"$\approx$"}
    | {"−": "$-$", "<": "$<$", ">": "$>$"}
)

# as CITATION.cff, which an installed package does not have
PROGRAM = f"""@misc{{impact,
  author = {{{{The impact developers}}}},
  title = {{{{impact: parameter sweeps of contact force models}}}},
  howpublished = {{version {__version__}}},
}}"""


@dataclass(frozen=True)
class Citation:
    """How a law is cited.

    Parameters
    ----------
    model : key of the model or friction law; "impact" for the program
    bibtex : an entry for each reference of the law; its DOI is that of the first
    evidence : how well the formula and the DOI are verified; empty for the program
    """

    model: str
    bibtex: str
    evidence: dict[str, str]


class Citations(tuple[Citation, ...], Displayed):
    """Citations of laws, whose text is BibTeX."""

    def as_list(self) -> list[dict[str, Any]]:
        """The JSON of the command: an object for each law."""
        return [dict(vars(citation)) for citation in self]

    def as_dict(self) -> dict[str, Any]:
        """The objects of the JSON by the keys of their laws."""
        return {citation["model"]: citation for citation in self.as_list()}

    records = as_list

    def sections(self, width: int) -> Iterator[Block]:
        """The entries."""
        yield from "\n\n".join(citation.bibtex for citation in self).splitlines()


def cite(*laws: str | Path | xr.Dataset | ForceModel | FrictionLaw, plugins: Sequence[Any] = ()) -> Citations:
    """Cite laws: BibTeX from their references, with the evidence for their formulas.

    Parameters
    ----------
    laws : keys of models and friction laws, laws, or results, of which every law is cited; "impact" is the program
    plugins : Python files with user-defined models, or their models

    Returns
    -------
    Citations : one for each law, with its BibTeX and its evidence; `print` shows BibTeX

    Raises
    ------
    ModelError : a law is not in the catalogue; the message names the nearest key
    UsageError : no law is given, or a result has a law of a file or a package that is missing

    >>> import impact
    >>> print(impact.cite("hertz"))  # doctest: +ELLIPSIS
    @article{hertz,
      author = {Hertz, H.},
      year = {1882},
      title = {{Über die Berührung fester elastischer Körper}},
      journal = {J. reine angew. Math.},
      volume = {92},
      pages = {156},
      doi = {10.1515/crll.1882.92.156},
      annote = {formula seen in Gharib and Hurmuzlu (2012), equation (10); DOI seen in ...},
    }
    """
    if not laws:
        raise UsageError("laws: got none, expected keys of laws, or results")
    known: dict[str, ForceModel | FrictionLaw] = {**models(plugins), **frictions()}
    chosen: dict[str, Citation] = {}
    for item in laws:
        if isinstance(item, ForceModel | FrictionLaw):
            cited = [item]
        elif isinstance(item, str) and item == "impact":
            chosen[item] = Citation(item, PROGRAM, {})
            continue
        elif isinstance(item, str) and not Path(item).suffix:
            cited = [look_up(known, item, "law")]
        else:
            result = item if isinstance(item, xr.Dataset) else load(item)
            names = [*chosen_laws(None, result), *chosen_laws(None, result, "friction")]
            # the laws of a calibration with friction are pairs
            keys = [key for name in names for key in law_keys(name)]
            if not known.keys() >= {*keys}:
                name = "the result" if isinstance(item, xr.Dataset) else str(item)
                check_plugins(result.attrs, read_plugins(plugins), name)
            cited = [look_up(known, key, "law") for key in keys]
        chosen |= {law.key: Citation(law.key, bibtex(law), dict(vars(law.evidence))) for law in cited}
    return Citations(chosen.values())


def bibtex(law: ForceModel | FrictionLaw) -> str:
    """Write an entry for the first reference of a law, and for each further paper; others are remarks."""
    first, *others = law.reference.split("; ")
    papers = [reference for reference in others if PAPER.fullmatch(reference)]
    remarks = [reference for reference in others if reference not in papers]
    entries = []
    for index, reference in enumerate((first, *papers), 1):
        kind, fields = _parse_reference(reference or law.title)
        if index == 1:
            if "year" not in fields and law.evidence.state == "seen":
                fields |= _version_read(law.evidence.source)
            # styles print a note, and no annote
            fields |= {"doi": law.doi, "annote": _escape("; ".join((f"formula {law.evidence}", *remarks)))}
        key = law.key if index == 1 else f"{law.key}-{index}"
        lines = (f"  {name} = {{{text}}}," for name, text in fields.items() if text)
        entries.append("\n".join((f"@{kind}{{{key},", *lines, "}")))
    return "\n\n".join(entries)


def _version_read(source: str) -> dict[str, str]:
    """Find where the code of a law was read, the year of that version, and the address of its repository.

    >>> _version_read("lammps/lammps, src/GRANULAR/gran_sub_mod.cpp @07b704ca (2026)")["url"]
    'https://github.com/lammps/lammps'
    """
    repository = re.match(r"[\w.-]+/[\w.-]+(?=[ ,])", source)
    return {
        "howpublished": _escape(source),
        "year": max(re.findall(r"\b20\d\d\b", source), default=""),
        "url": f"https://github.com/{repository[0]}" if repository else "",
    }


def _parse_reference(reference: str) -> tuple[str, dict[str, str]]:
    """Find the kind of an entry, and its fields; what is no paper is a title."""
    paper = PAPER.fullmatch(reference)
    if paper is None:
        return "misc", {"title": f"{{{_escape(reference)}}}"}
    rest = next(found for pattern in ARTICLES if (found := pattern.fullmatch(paper["rest"]))).groupdict()
    fields = {"author": _authors(paper["author"]), "year": paper["year"], **rest}
    fields = {name: _escape(text) for name, text in fields.items()}
    if "title" in fields:
        fields["title"] = f"{{{fields['title']}}}"
    return "article" if "journal" in fields else "misc", fields


def _authors(text: str) -> str:
    """Write authors as BibTeX does.

    >>> _authors("Hunt KH, Crossley FRE and others")
    'Hunt, K. H. and Crossley, F. R. E. and others'
    """
    people, *others = text.split(" and others")
    names = [name.rsplit(" ", 1) for name in people.split(", ")]
    shown = [f"{family}, {'. '.join(initials)}." for family, initials in names]
    return " and ".join([*shown, *("others" for _ in others)])


def _escape(text: str) -> str:
    r"""Write a text for LaTeX, which knows accented letters, but not letters of Greek or small digits.

    >>> print(_escape("χ of e² and v₀, 3 %"))
    $\chi$ of e$^2$ and v$_0$, 3 \%
    """
    return "".join(map(_mathematics, text.translate(SYMBOLS)))


def _mathematics(letter: str) -> str:
    """Write a letter of Greek, or a raised or lowered character, as mathematics; another one is unchanged."""
    greek = re.fullmatch(r"GREEK (CAPITAL|SMALL) LETTER (\w+)", unicodedata.name(letter, ""))
    if greek:
        name = greek[2].replace("LAMDA", "LAMBDA")
        return rf"$\{name.title() if greek[1] == 'CAPITAL' else name.lower()}$"
    sign = {"<sub>": "_", "<super>": "^"}.get(unicodedata.decomposition(letter).partition(" ")[0])
    return f"${sign}{unicodedata.normalize('NFKC', letter)}$" if sign else letter
