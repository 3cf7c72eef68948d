"""The version of the package, which every layer may import."""

__version__ = "1.1.0"
