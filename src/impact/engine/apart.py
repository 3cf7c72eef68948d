"""In what two records of sweeps differ, as one reads it."""

from __future__ import annotations

import json
from collections.abc import Iterator

from ..text import safe_text


def differences(there: object, here: object, path: str = "") -> Iterator[str]:
    """In what two records differ, each with its place."""
    if isinstance(there, dict) and isinstance(here, dict):
        for key in dict.fromkeys((*there, *here)):
            name = key if path in ("", "physics") else f"{path}.{key}"
            yield from differences(there.get(key), here.get(key), str(name))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for place, (one, other) in enumerate(zip(there, here, strict=True)):
            yield from differences(one, other, f"{path}[{place}]")
    elif there != here and not (there != there and here != here):
        yield f"{safe_text(path)}: {_shown(there)} there, {_shown(here)} here"


def _shown(value: object) -> str:
    text = f"{len(value)} values" if isinstance(value, list) else json.dumps(value)
    return safe_text(text, 60)
