"""What comes with the program: a starter config, and common materials, which need no table in a config."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path

from ..atomic import write_file

# the two balls of Table 1 of the paper
STARTER_CONFIG = files("impact") / "config" / "starter.toml"


@cache
def library() -> Mapping[str, Mapping[str, float | str]]:
    """List the materials as tables of a config, without sources."""
    return {
        name: {key: value for key, value in record.items() if key not in ("about", "source")}
        for name, record in materials().items()
    }


def materials() -> dict[str, dict[str, float | str]]:
    """List common materials in SI units, which a config can name without a table [materials.NAME].

    Returns
    -------
    By name: E [Pa], nu, rho [kg/m3], yield_strength [Pa] if known, about, source

    >>> materials()["glass"]["E"]
    72000000000.0
    """
    return tomllib.loads((files("impact") / "config" / "materials.toml").read_text(encoding="utf-8"))


def init(path: str | Path = "config.toml", *, overwrite: bool = False) -> None:
    """Write a commented starter config, ready to sweep.

    Raises
    ------
    UsageError : the file exists, or cannot be written there
    StoreError : the disk is full or failed

    >>> import impact, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     impact.init(f"{folder}/config.toml")
    ...     impact.estimate(f"{folder}/config.toml").points > 0
    True
    """
    write_file(Path(path), STARTER_CONFIG.read_bytes(), overwrite=overwrite)
