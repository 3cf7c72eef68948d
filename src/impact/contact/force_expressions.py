"""Expressions of forces that many laws share, in NumPy and compiled."""

from __future__ import annotations

from ..array_types import Array
from .powers import power


def spring(elastic: Array) -> Array:
    """K δⁿ alone."""
    return elastic


def damped(elastic: Array, v: Array, v0: float, chi: Array) -> Array:
    """K δⁿ (1 + χ δ̇/v₀), equation (18)."""
    return elastic * (1 + chi * v / v0)


def dragged(elastic: Array, power_of_x: Array, v: Array, c: Array) -> Array:
    """K δⁿ + c δ^q δ̇."""
    return elastic + c * power_of_x * v


def unload_with_stiffness(stretch: Array, n: float, Kr: Array) -> Array:
    """Kᵣ δⁿ above the permanent indentation."""
    return Kr * power(stretch, n)


def unload_to_residual(stretch: Array, recovered: Array, n: float, force_at_peak: Array) -> Array:
    """Fₘ ((δ − δₚ)/(δₘ − δₚ))ⁿ."""
    return force_at_peak * power(stretch / recovered, n)


# unloading branches that are a constant times the n-th power of the stretch, the recovered indentation
POWER_LAWS = (spring, unload_with_stiffness, unload_to_residual)
