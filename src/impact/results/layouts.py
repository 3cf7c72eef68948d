"""The layouts of a file: full, with all values, and factored, with trajectories that values are computed from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import xarray as xr

from ..engine.plan import Plan
from . import factored
from .netcdf import RegionValues, stored_array
from .schema import stored_variables
from .summary import Summary, add_slab, summarize_table, summary_record
from .trajectory_table import ExpandedSlab, TrajectoryTable, expanded_slabs, lazy_dataset
from .validation import FACTORED_ATTRIBUTES, TABLE_VARIABLES, is_quantity

# a factored result of more points has their summary in its file: a reader would take long to compute it
NO_SUMMARY_POINTS = 2**20

# replaces some values of a slab
FillSlab = Callable[[ExpandedSlab], None]
# called with the numbers of stored and of failed points
OnSlab = Callable[[int, int], None]


class Contents(NamedTuple):
    """A result and what its file holds; the summary of a full one is complete when its values are written."""

    result: xr.Dataset
    template: xr.Dataset
    values: Iterator[RegionValues]
    summary: Summary


class FullLayout:
    """A file of all values of all points."""

    def check(self, plan: Plan) -> None:
        """Raise a UsageError for a plan whose result cannot be stored, before integration."""

    def template(self, result: xr.Dataset, plan: Plan, table: TrajectoryTable) -> xr.Dataset:
        """Build the dataset of the file, with placeholder values, from that of the result."""
        return result

    def contents(
        self, result: xr.Dataset, plan: Plan, table: TrajectoryTable, on_slab: OnSlab, fill: FillSlab | None
    ) -> Contents:
        """Compute what the file holds, from the trajectory table and the values that `fill` replaces."""
        summary, chunks = Summary(), plan.config.output.chunks
        lengths = [chunks.get(axis.name, axis.size) for axis in plan.config.axes] if chunks else []

        def values() -> Iterator[RegionValues]:
            for slab in expanded_slabs(table, stored_variables(plan), lengths):
                if fill:
                    fill(slab)
                for name, array in slab.values.items():
                    yield name, slab.region_in(result[name].dims), array
                add_slab(summary, table, slab)
                on_slab(summary.points, summary.failed)

        return Contents(result, result, values(), summary)

    def read(self, variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> xr.Dataset:
        """Make a dataset of the variables and attributes of a file; a ResultError if they do not fit together.

        Its values are read or computed when they are indexed.
        """
        coordinates = _load_coordinates(variables)
        values = {name: variable for name, variable in variables.items() if name not in coordinates}
        return xr.Dataset(values, coordinates, attributes)


class FactoredLayout:
    """A file of a trajectory table, and of some points in full by which it is checked; see `FullLayout`."""

    def check(self, plan: Plan) -> None:
        for law in plan.models:
            factored.stiffness_to_store(plan.inputs, law)

    def template(self, result: xr.Dataset, plan: Plan, table: TrajectoryTable) -> xr.Dataset:
        return factored.table_template(result, table, stored_variables(plan))

    def contents(
        self, result: xr.Dataset, plan: Plan, table: TrajectoryTable, on_slab: OnSlab, fill: FillSlab | None
    ) -> Contents:
        variables, summary = stored_variables(plan), Summary()
        template = self.template(result, plan, table)
        result = lazy_dataset(result, table, variables)
        if plan.stored_points > NO_SUMMARY_POINTS:
            summary, extremes = summarize_table(result, table)
            record = summary_record(summary, extremes, result)
            template = template.assign_attrs(summary=record.model_dump_json(exclude_defaults=True))
        else:
            for slab in expanded_slabs(table, variables):
                add_slab(summary, table, slab)

        def values() -> Iterator[RegionValues]:
            for stored in factored.table_values(table, variables):
                yield stored
                on_slab(0, summary.failed)

        return Contents(result, template, values(), summary)

    def read(self, variables: Mapping[str, xr.Variable], attributes: Mapping[str, object]) -> xr.Dataset:
        stored = {name: variable for name, variable in variables.items() if name in TABLE_VARIABLES}
        witnesses = {name: variable.load() for name, variable in stored.items() if name.startswith("witness_")}
        dataset = xr.Dataset(witnesses, _load_coordinates(variables), attributes)
        # without xarray's indexing, which takes longer than to read a few values
        arrays = {name: stored_array(variable) for name, variable in stored.items() if name not in witnesses}
        sizes = {name: array.shape[0] for name, array in arrays.items()}
        table = factored.stored_table(dataset, sizes, lambda name, positions: arrays[name].read((positions,)))
        quantities = factored.witness_variables(dataset)
        factored.check_witnesses(table, quantities, dataset)
        template = dataset.drop_vars(witnesses).drop_attrs(deep=False)
        described = {name: value for name, value in attributes.items() if name not in FACTORED_ATTRIBUTES}
        return lazy_dataset(template.assign_attrs(described), table, quantities)


def _load_coordinates(variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
    """Load the coordinates of a file."""
    return {
        name: variable.load()
        for name, variable in variables.items()
        if name not in TABLE_VARIABLES and not is_quantity(name, tuple(map(str, variable.dims)))
    }


LAYOUTS: Mapping[str, FullLayout | FactoredLayout] = {"full": FullLayout(), "factored": FactoredLayout()}
