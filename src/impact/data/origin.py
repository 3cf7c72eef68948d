"""Where a config comes from: a TOML file, a mapping, the starter, or the sweep that a result came from."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

from ..contact.model import ForceModel
from ..errors import UsageError
from ..sweeps.config import Config, parse_config, read_config
from ..text import safe_text
from .store import load

STARTER = files("impact") / "sweeps" / "starter.toml"
HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


def config_of(
    source: str | Path | Mapping[str, object] | None, overrides: Sequence[str], plugins: Sequence[ForceModel]
) -> Config:
    """The config of a TOML file, a mapping, the starter, or of the sweep that a result came from."""
    if source is None:
        overrides = ["sweep.e=0.5", *overrides]
        return parse_config(STARTER.read_text(encoding="utf-8"), overrides, plugins, name="starter")
    if isinstance(source, Mapping):
        return read_config(source, overrides, plugins)
    path = Path(source)
    if path.is_file():
        with path.open("rb") as file:
            if file.read(len(HDF5_MAGIC)) == HDF5_MAGIC:
                attributes = load(path).attrs
                if "config" not in attributes:
                    raise UsageError(f"{safe_text(str(path))}: holds no config; it is a time history")
                own = set(json.loads(attributes["plugins"])) - {model.key for model in plugins}
                if own:
                    names = safe_text(", ".join(sorted(own)))
                    raise UsageError(
                        f"{safe_text(str(path))}: made with a model of one's own: {names}; run it from "
                        "Python, impact.run(..., plugins=[...])"
                    )
                stored = json.loads(attributes["config_set"])
                return parse_config(attributes["config"], [*stored, *overrides], plugins, name=str(path))
    return read_config(path, overrides, plugins)
