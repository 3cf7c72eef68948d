"""Notes on values that are valid but probably not intended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from ..contact.materials import sphere_mass
from ..engine.inputs import Inputs, input_at, property_at, smaller_radius_at
from ..engine.trajectories import axes_of_arrays, probe_index
from ..errors import ModelError, ResultError
from ..formatting import number, prefixed, quantity, safe_text
from .layouts import read_inputs
from .schema import parts_of_laws
from .slabs import MAX_SUMMARY_POINTS, is_computed, over_varying_dims, slabs
from .summary import MAX_SMALL_INDENTATION, Summary

# Young's moduli outside these limits are probably in another unit: gels have 1e3 Pa, diamond has 1e12 Pa
MIN_MODULUS_PA, MAX_MODULUS_PA = 1e3, 1e13
# a mass and that of the sphere may differ by rounding of measured values
MAX_MASS_DIFFERENCE = 0.01


def input_notes(inputs: Inputs) -> Iterator[str]:
    """Yield a sentence for each material or ball with an implausible Young's modulus or mass.

    >>> from impact.contact.materials import Material
    >>> materials = {"steel": Material(E=210.0, nu=0.3), "glass": Material(E=6e10, nu=0.2, rho=2500.0)}
    >>> scalars = {"material1": "steel", "material2": "glass", "m2": 1.0, "R2": 0.02}
    >>> for note in input_notes(Inputs(scalars, (), materials)):
    ...     print(note)
    materials.steel.E: got 210 Pa; did you mean 210 GPa?
    m2: got 1 kg, but a sphere of R2 = 0.02 m and 2500 kg/m^3 has 0.08378 kg; without m2 the mass follows
    """
    columns = {name: values for axis in inputs.axes for name, values in axis.columns.items()}
    for name, material in inputs.materials.items():
        for modulus in columns.get(f"materials.{name}.E", [material.E]):
            if isinstance(modulus, float) and (modulus < MIN_MODULUS_PA or modulus > MAX_MODULUS_PA):
                too_small = modulus < MIN_MODULUS_PA
                hint = f"did you mean {number(modulus)} GPa?" if too_small else "no material is as stiff"
                yield f"materials.{safe_text(name)}.E: got {number(modulus)} Pa; {hint}"
                break
    for ball in "12":
        if {f"m{ball}", f"R{ball}"} <= {*inputs.names()}:
            yield from _mass_notes(inputs, ball)


def _mass_notes(inputs: Inputs, ball: str) -> Iterator[str]:
    """Say that the mass of a ball is not that of a sphere of its radius and density, where all three are given."""
    index = probe_index(inputs)
    mass, radius = (input_at(inputs, f"{name}{ball}", index) for name in "mR")
    stated, R, density = np.broadcast_arrays(mass, radius, property_at(inputs, ball, "rho", index))
    expected = sphere_mass(R, density)
    # an infinite mass is a ball that is held; without a density that of a sphere is NaN, and contradicts none
    with np.errstate(invalid="ignore"):
        differs = np.isfinite(stated) & np.isfinite(R) & (np.abs(stated / expected - 1.0) > MAX_MASS_DIFFERENCE)
    if differs.any():
        first = int(np.argmax(differs))
        size, rho = quantity(R.flat[first], "m", 4), quantity(density.flat[first], "kg/m^3", 4)
        yield (
            f"m{ball}: got {quantity(stated.flat[first], 'kg', 4)}, but a sphere of R{ball} = {size} and {rho} "
            f"has {quantity(expected.flat[first], 'kg', 4)}; without m{ball} the mass follows"
        )


def depth_notes(indentation: float, R1: float, R2: float) -> Iterator[str]:
    """Yield a sentence if a peak indentation is large beside the smaller radius [m]; a radius may be unknown, NaN.

    >>> list(depth_notes(2e-3, 0.01, float("inf")))
    ['peak indentation of 2 mm is 20% of the smaller radius; Hertz theory assumes small indentation']
    >>> list(depth_notes(2e-3, float("nan"), float("nan")))
    []
    """
    share = indentation / float(np.fmin(R1, R2))
    if share > MAX_SMALL_INDENTATION:
        depth = f"peak indentation of {prefixed(indentation, 'm', 3)} is {share:.0%} of the smaller radius"
        yield f"{depth}; Hertz theory assumes small indentation"


def with_depths(summary: Summary, dataset: xr.Dataset) -> Summary:
    """Add `deep` and `deepest` of a dataset to its summary, but for models of more computed points than it has."""
    inputs, summary = inputs_of(dataset), replace(summary)
    if inputs is None or "peak_indentation" not in dataset:
        return summary
    try:
        varied = axes_of_arrays([smaller_radius_at(inputs, probe_index(inputs))])
    except (ModelError, KeyError):
        # a part of a result, or one that was changed, may lack what the radii follow from
        return summary
    radius_dims = [axis.name for number, axis in enumerate(inputs.axes) if number in varied]
    for _, part in parts_of_laws(dataset, ["model"]):
        points, weight = over_varying_dims(part, ["peak_indentation"], *radius_dims)
        dims = [axis.name for axis in inputs.axes if axis.name in points.dims]
        depth = points.variables["peak_indentation"].transpose(*dims)
        if depth.size > MAX_SUMMARY_POINTS and is_computed(depth):
            continue
        for slab in slabs(depth.sizes):
            radius = smaller_radius_at(inputs, inputs.index([slab.get(a.name, slice(1)) for a in inputs.axes]))
            absent = tuple(number for number, axis in enumerate(inputs.axes) if axis.name not in dims)
            radius = radius.squeeze(absent) if inputs.axes else radius
            summary.add_depths(depth.isel(slab).values, radius, weight)
    return summary


def inputs_of(dataset: xr.Dataset) -> Inputs | None:
    """Read the inputs of a sweep from its result; None if it lacks some, as a part or a changed one may."""
    try:
        inputs = read_inputs(dataset, [str(dim) for dim in dataset.sizes if dim != "model"])
    except (ResultError, KeyError):
        return None
    is_complete = all(inputs.materials_of(ball) <= inputs.materials.keys() for ball in "12")
    return inputs if is_complete else None
