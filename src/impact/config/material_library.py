"""The library of common materials, which need no table in a config, with the source of each number."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from .tables import MATERIAL_QUANTITIES


@cache
def library() -> Mapping[str, Mapping[str, float | str]]:
    """List the materials as tables of a config, without sources."""
    return {
        name: {key: value for key, value in record.items() if key in MATERIAL_QUANTITIES}
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
