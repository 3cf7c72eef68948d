"""The layouts of a file: full, with all values, and factored, with trajectories that values are computed from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import xarray as xr

from .factored import check_witnesses, stored_table, witness_variables
from .trajectory_table import lazy_dataset
from .validation import FACTORED_ATTRIBUTES, TABLE_VARIABLES, is_quantity


class Layout(Protocol):
    """How a file holds a result."""

    name: str

    def read(self, variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> xr.Dataset:
        """Make a dataset of the variables and attributes of a file; its values are read or computed when indexed.

        Raises
        ------
        ResultError : they do not fit together
        """


class FullLayout:
    """All values of all points."""

    name = "full"

    def read(self, variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> xr.Dataset:
        coordinates = _coordinates(variables)
        values = {name: variable for name, variable in variables.items() if name not in coordinates}
        return xr.Dataset(values, coordinates, attributes)


class FactoredLayout:
    """A trajectory table, and some points in full by which it is checked."""

    name = "factored"

    def read(self, variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> xr.Dataset:
        stored = {name: variable for name, variable in variables.items() if name in TABLE_VARIABLES}
        witnesses = {name: variable.load() for name, variable in stored.items() if name.startswith("witness_")}
        dataset = xr.Dataset(witnesses, _coordinates(variables), attributes)
        sizes = {name: variable.size for name, variable in stored.items() if name not in witnesses}
        table = stored_table(dataset, sizes, lambda name, part: variables[name][part].values)
        quantities = witness_variables(dataset)
        check_witnesses(table, quantities, dataset)
        template = dataset.drop_vars(witnesses).drop_attrs(deep=False)
        described = {name: value for name, value in attributes.items() if name not in FACTORED_ATTRIBUTES}
        return lazy_dataset(template.assign_attrs(described), table, quantities)


def _coordinates(variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Load the coordinates of a file."""
    return {
        name: variable.load()
        for name, variable in variables.items()
        if name not in TABLE_VARIABLES and not is_quantity(name, tuple(map(str, variable.dims)))
    }


FULL, FACTORED = FullLayout(), FactoredLayout()


def layout_of_file(attributes: Mapping[str, object]) -> Layout:
    """Choose the layout of a file by its attributes."""
    return FACTORED if "laws" in attributes else FULL
