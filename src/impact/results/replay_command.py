"""The command that runs one point of a result again."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

import xarray as xr

from ..config.input_names import InputName
from ..contact.units import names_in
from ..formatting import prefixed, safe_text
from .attributes import read_attribute

InputValue = TypeVar("InputValue")


def command_start(path: str, dataset: xr.Dataset, act: str = "run") -> tuple[str, ...]:
    """Start the command that runs a point of a result again, or plots it; empty for a dataset without a file.

    Also empty if a model is a Python value, which no command line can name.

    >>> command_start("new.h5", xr.Dataset(attrs={"plugins": '{"mine": {"file": "my.py", "sha256": ""}}'}))
    ('impact', 'run', 'new.h5', '--plugin', 'my.py')
    """
    files = [record.file for record in read_attribute(dataset.attrs, "plugins").values() if not record.package]
    if not path or None in files:
        return ()
    return ("impact", act, path, *(word for file in dict.fromkeys(files) for word in ("--plugin", str(file))))


def inputs_of_model(at: Mapping[str, InputValue]) -> dict[str, InputValue]:
    """Leave out the parameters of other models and friction laws.

    >>> inputs_of_model({"model": "mine", "e": 0.5, "mine.c": 2.0, "other.c": 3.0, "materials.steel.E": 2e11})
    {'model': 'mine', 'e': 0.5, 'mine.c': 2.0, 'materials.steel.E': 200000000000.0}
    """
    keys = [str(at.get(dim, "")) for dim in ("model", "friction")]
    return {name: value for name, value in at.items() if InputName.parse(name).applies_to(*keys)}


def inputs_at(values: xr.DataArray, position: Iterable[int]) -> dict[str, Any]:
    """Look up the inputs of a point of a variable, with its laws and without the parameters of others."""
    point = values.isel(dict(zip(values.dims, position, strict=True)))
    return inputs_of_model({str(dim): point[dim].values.item() for dim in values.dims})


def describe_point(at: Mapping[str, float | str], digits: int = 12) -> str:
    """List the inputs of a point for a message, with their units and words.

    >>> describe_point({"model": "hertz", "e": 0.1 + 0.2, "v1": 0.005, "friction.coulomb-1785.limit": 1.0})
    'model=hertz, e=0.3, v1=5 mm/s, friction.coulomb-1785.limit=positive'
    """
    texts = []
    for text, value in at.items():
        name = InputName.parse(text)
        # an exponent n has a value for each law
        unit = "1" if names_in(name.unit) else name.unit
        texts.append(f"{safe_text(text)}={safe_text(prefixed(name.word(value), unit, digits), 60)}")
    return ", ".join(texts)


def replay_command(start: Sequence[str], at: Mapping[str, object]) -> str:
    """Complete the command by the model, the friction law and the inputs of the point.

    >>> replay_command(("impact", "run", "new.h5"), {"model": "hertz", "case": 3})
    'impact run new.h5 --model hertz --at case=3'
    >>> replay_command(("impact", "run", "new.h5"), {"model": "hertz", "e": 0.5, "material": "soft steel"})
    "impact run new.h5 --model hertz --at e=0.5 --at 'material=soft steel'"
    """
    command = list(start)
    for name, value in at.items():
        text = repr(value) if isinstance(value, float) else str(value)
        command += [f"--{name}", text] if name in ("model", "friction") else ["--at", f"{name}={text}"]
    return safe_text(shlex.join(command), 2000)
