"""The starter config: the two balls of Table 1 of the paper."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from ..atomic import write_file

STARTER_CONFIG = files("impact") / "config" / "starter.toml"


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
