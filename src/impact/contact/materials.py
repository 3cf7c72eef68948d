"""The material of a ball, and the elastic contact of two of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Array


@dataclass(frozen=True)
class Material:
    """An isotropic material: Young's modulus [Pa], Poisson's ratio [-], density [kg/m3], yield strength [Pa]."""

    E: float
    nu: float
    rho: float | None = None
    yield_strength: float | None = None


def sphere_radius(mass: Array, density: Array) -> Array:
    """Radius [m] of a solid sphere from its mass [kg] and density [kg/m3]; an infinite mass is a plane.

    >>> sphere_radius(np.array([1.0, np.inf]), np.array([2712.0, np.nan])).round(10).tolist()
    [0.0444843486, inf]
    """
    return np.where(np.isinf(mass), np.inf, np.cbrt(mass * (3.0 / (4.0 * np.pi)) / density))


def sphere_mass(radius: Array, density: Array) -> Array:
    """Mass [kg] of a solid sphere from its radius [m] and density [kg/m3]; that of a plane is infinite.

    >>> sphere_mass(np.array([0.1, np.inf]), np.array([7850.0, np.nan])).round(3).tolist()
    [32.882, inf]
    """
    return np.where(np.isinf(radius), np.inf, (4.0 / 3.0) * np.pi * radius**3 * density)


def rayleigh_time(radius: Array, density: Array, E: Array, nu: Array) -> Array:
    """Time [s] that a Rayleigh wave takes around half a sphere, with which granular codes compare a time step.

    pi R sqrt(rho/G) / (0.1631 nu + 0.8766), with the shear modulus G, as the documentation of LIGGGHTS
    has it under `fix check/timestep/gran`.

    >>> glass = [np.array([value]) for value in (2.5e-3, 2500.0, 60e9, 0.25)]
    >>> print(rayleigh_time(*glass) * 1e6)
    [2.76316847]
    """
    return np.asarray(np.pi * radius * np.sqrt(2.0 * (1.0 + nu) * density / E) / (0.1631 * nu + 0.8766))


def effective_radius(R1: Array, R2: Array) -> Array:
    """Effective radius R [m] of two spheres, equation (12), as 1/(1/R1 + 1/R2); an infinite radius is a plane.

    >>> print(effective_radius(np.array([0.1, 0.1]), np.array([0.1, np.inf])))
    [0.05 0.1 ]
    """
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / (1.0 / R1 + 1.0 / R2))


def effective_compliance(E1: Array, nu1: Array, E2: Array, nu2: Array) -> Array:
    """k1 + k2 [1/Pa] of equation (13), without its π: (1 - nu1^2)/E1 + (1 - nu2^2)/E2."""
    return (1.0 - nu1 * nu1) / E1 + (1.0 - nu2 * nu2) / E2


def effective_shear_modulus(E1: Array, nu1: Array, E2: Array, nu2: Array) -> Array:
    """G* [Pa] of Mindlin's tangential stiffness 8 G* a: 1/((2 - nu1)/G1 + (2 - nu2)/G2), G = E/(2(1 + nu)).

    >>> print(effective_shear_modulus(np.array(2.6), np.array(0.3), np.array(2.6), np.array(0.3)).round(12))
    0.294117647059
    """
    compliance1, compliance2 = (2.0 * (2.0 - nu) * (1.0 + nu) / E for E, nu in ((E1, nu1), (E2, nu2)))
    return np.asarray(1.0 / (compliance1 + compliance2))


def hertz_stiffness(E1: Array, nu1: Array, E2: Array, nu2: Array, R1: Array, R2: Array) -> Array:
    """Compute K [N/m^1.5] of the contact of two spheres: Gharib and Hurmuzlu (2012), equations (12), (13).

    K = (4/3)/(k1 + k2) sqrt(R), k_j = (1 - nu_j^2)/E_j, with R = 1/(1/R1 + 1/R2), so that an infinite
    radius is a plane. Two planes have an infinite K. E in Pa, R in m.
    """
    compliance = effective_compliance(E1, nu1, E2, nu2)
    return np.asarray((4.0 / 3.0) / compliance * np.sqrt(effective_radius(R1, R2)))


def effective_mass(m1: Array, m2: Array) -> Array:
    """Effective mass m [kg] of two bodies, equation (17), as 1/(1/m1 + 1/m2); an infinite mass is a wall.

    >>> effective_mass(np.array([1.0, 1.0]), np.array([1.0, np.inf]))
    array([0.5, 1. ])
    """
    with np.errstate(divide="ignore", over="ignore"):
        return 1.0 / (1.0 / m1 + 1.0 / m2)
