"""Escape text from files so that it is safe to print."""

from __future__ import annotations

from unicodedata import category

# control, format (bidi marks, zero-width), lone surrogate, private, unassigned, line and paragraph separator
UNSAFE = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})

NO_BREAK = "\N{NO-BREAK SPACE}"


def with_year(title: str, year: int | str) -> str:
    """Add the year to the title of a model, unless the title ends with versions in brackets.

    >>> with_year("Hertz", 1882), with_year("Modia3D (v0.4.0 to v0.5.2, 2019 to 2021)", 2019)
    ('Hertz (1882)', 'Modia3D (v0.4.0 to v0.5.2, 2019 to 2021)')
    """
    return title if title.endswith(")") else f"{title} ({year})"


def safe_text(text: str, limit: int = 200) -> str:
    r"""Escape control and invisible characters of a text, and cut it to at most `limit` characters.

    >>> safe_text("steel\x1b[31m")
    'steel\\x1b[31m'
    >>> safe_text("a\u202eb"), safe_text("abcdef", limit=4)
    ('a\\u202eb', 'abc…')
    """
    # an escape is never shorter than its character: characters beyond the limit are not needed
    shown = escape_controls(text[: limit + 1])
    return shown if len(shown) <= limit else shown[: limit - 1] + "…"


def escape_controls(text: str) -> str:
    r"""Escape control and invisible characters; a second time changes nothing.

    >>> escape_controls("steel\n"), escape_controls(escape_controls("steel\n"))
    ('steel\\x0a', 'steel\\x0a')
    """
    return "".join(_escaped(letter) if category(letter) in UNSAFE else letter for letter in text)


def _escaped(letter: str) -> str:
    code = ord(letter)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
