"""Markup: HTML as text that knows it is HTML; all other text is escaped when it gets into it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape
from urllib.parse import quote
from xml.etree import ElementTree

from ..text import safe_text

# elements after which the line goes on
INLINE = frozenset({"a", "code", "span", "td", "th"})
# at most so many letters of a text are shown
LETTERS = 2000


class Markup(str):
    """Text that is HTML already."""


def tag(name: str, *inside: str, **attributes: str) -> Markup:
    """An element; what is inside it and its attributes are escaped unless they are markup.

    >>> tag("span", "a < b", class_="soft")
    '<span class="soft">a &lt; b</span>'
    """
    words = "".join(f' {key.rstrip("_").replace("_", "-")}="{escaped(one)}"' for key, one in attributes.items())
    end = "" if name in INLINE else "\n"
    return Markup(f"<{name}{words}>{''.join(map(escaped, inside))}</{name}>{end}")


def escaped(text: str) -> str:
    """The text as it stands in HTML, not too long of what is no markup."""
    return text if isinstance(text, Markup) else escape(safe_text(text, LETTERS))


def table(label: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> Markup:
    """A table whose first column names its rows; a column of numbers has a # before its heading."""
    columns = [(head.removeprefix("#"), {"class_": "number"} if head.startswith("#") else {}) for head in heads]
    lines = []
    for first, *others in rows:
        cells = [tag("td", cell, data_head=name, **look)
                 for cell, (name, look) in zip(others, columns[1:] or [("", {})], strict=True)]  # fmt: skip
        lines.append(tag("tr", tag("th", first, scope="row"), *cells))
    top = tag("thead", tag("tr", *(tag("th", name, scope="col", **look) for name, look in columns)))
    whole = tag("table", *([top] if heads else []), tag("tbody", *lines))
    # on a narrow screen each row is a card
    return tag(
        "div", whole, class_="scroll cards" if heads else "scroll", tabindex="0", role="region", aria_label=label
    )


def doi_link(doi: str) -> str:
    """A link to a publication, of what is a DOI; text of what is not."""
    if not re.fullmatch(r"10\.[0-9]{4,}/\S+", doi):
        return doi
    return tag("a", doi, href=f"https://doi.org/{quote(doi, safe='/', errors='replace')}", rel="noreferrer")


def picture(svg: bytes, name: str, label: str) -> Markup:
    """A picture as an element of a page that has others: its ids are its own, and it has no style for all.

    Parameters
    ----------
    svg : the picture
    name : what its ids begin with, which no other picture of the page has
    label : what it shows, for who cannot see it
    """
    root = ElementTree.fromstring(svg)
    for node in list(root.iter()):
        node.tag = node.tag.rpartition("}")[2]
        node[:] = [inner for inner in node if not inner.tag.endswith(("}metadata", "}style"))]
        for key in list(node.attrib):
            plain, value = key.rpartition("}")[2], node.attrib.pop(key)
            refers = {"id": "^", "href": "^#"}.get(plain, r"(?<=url\()#")
            node.attrib[plain] = re.sub(refers, f"{'' if plain == 'id' else '#'}{name}-", value)
    root.attrib = {"viewBox": root.attrib["viewBox"], "role": "img", "aria-label": label}
    return Markup(ElementTree.tostring(root, encoding="unicode"))
