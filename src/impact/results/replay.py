"""The command that runs a point of a result again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import TypeVar

import xarray as xr

from ..text import safe_text
from .attributes import json_table

T = TypeVar("T")


def repeats(path: str, dataset: xr.Dataset) -> tuple[str, ...]:
    """How a command begins that runs a point of a result again; empty for a dataset that is in no file.

    So it is where a model was given as a value: no command can give it again.

    >>> repeats("new.h5", xr.Dataset(attrs={"plugins": '{"mine": {"file": "my.py", "sha256": ""}}'}))
    ('impact', 'run', 'new.h5', '--plugin', 'my.py')
    """
    files = [one.get("file") for one in json_table(dataset, "plugins").values() if not one.get("package")]
    if not path or None in files:
        return ()
    return ("impact", "run", path, *(word for file in dict.fromkeys(files) for word in ("--plugin", str(file))))


def own(at: Mapping[str, T]) -> dict[str, T]:
    """The inputs of a point without the parameters of other models than its own.

    >>> own({"model": "mine", "e": 0.5, "mine.c": 2.0, "other.c": 3.0})
    {'model': 'mine', 'e': 0.5, 'mine.c': 2.0}
    """
    return {name: one for name, one in at.items() if name.rpartition(".")[0] in ("", at.get("model"))}


def described(at: Mapping[str, float | str]) -> str:
    """The inputs of a point in a message, without the digits that rounding left.

    >>> described({"model": "hertz", "e": 0.1 + 0.2})
    'model=hertz, e=0.3'
    """
    return ", ".join(
        f"{safe_text(name)}={value:.12g}" if isinstance(value, float) else f"{name}={safe_text(str(value), 60)}"
        for name, value in at.items()
    )


def replay(begin: Sequence[str], at: Mapping[str, object]) -> str:
    """The whole command: how it begins, and the model and the inputs of the point.

    >>> replay(("impact", "run", "new.h5"), {"model": "hertz", "e": 0.5, "material": "soft steel"})
    "impact run new.h5 --model hertz --at e=0.5 --at 'material=soft steel'"
    """
    words = list(begin)
    for name, value in at.items():
        given = repr(value) if isinstance(value, float) else str(value)
        words += ["--model", given] if name == "model" else ["--at", f"{name}={given}"]
    return safe_text(shlex.join(words), 2000)
