"""The data of a picture and a time history as a table, and measured points from a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias

import pandas as pd
import xarray as xr

from ..config.columns import columns_of_table, complete_rows, near_miss, read_csv
from ..config.measurements import MEASURED_OUTPUTS, SIGMA, SPECIMEN, derive_impacts, percent_problem
from ..config.quantities import Quantity
from ..config.tables import LABORATORY, STANDARD_GRAVITY, SWEEP_QUANTITIES
from ..contact.variables import HISTORY, OUTPUTS
from ..display import encode_frame
from ..errors import ConfigError, warn
from ..formatting import heading
from ..results.schema import plain_unit

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# handles and names of a legend
LegendEntries: TypeAlias = "list[tuple[Artist, str]]"
MEASURED = "Measured"


class PlotData(Protocol):
    """The data of a picture: a frozen dataclass that makes its tables and draws itself."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    title: str
    conditions: str
    panels: tuple[Any, ...]
    not_drawn: tuple[str, ...]  # what is left out, and why

    @property
    def panel_count(self) -> int:
        return len(self.panels)

    @property
    def names(self) -> set[str]:
        """The names whose text a user can replace: axes, variables and models."""

    @property
    def laws(self) -> dict[str, str]:
        """The names of the models and pairs with their parameters, by key."""
        return {panel.law: panel.label for panel in self.panels if panel.law}

    def long_table(self) -> pd.DataFrame:
        """Make a tidy table: a row for each point."""

    def wide_table(self) -> pd.DataFrame:
        """Make a table with a column for each curve, whose names are ASCII and have the unit."""

    def place_panels(self, figure: Figure, width: float) -> tuple[list[Axes], float]:
        """Add the axes of all panels to a figure; also returns the height of all panels [in]."""

    def draw(self, all_axes: Sequence[Axes], labels: Mapping[str, str], points: Points | None) -> LegendEntries:
        """Draw the panels, with labels that replace those of names; returns handles and names of the legend."""


def stacked(parts: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Make one table of the columns of parts, without that of friction laws where there are none."""
    table = pd.concat(map(pd.DataFrame, parts), ignore_index=True)
    return table if (table["friction"] != "").any() else table.drop(columns="friction")


def encode_history(history: xr.Dataset) -> bytes:
    """Write a time history as a CSV table with units and all digits, which `read_points` reads again."""
    frame = history.drop_vars(["model", "friction"], errors="ignore").to_dataframe().reset_index()
    units = {name: plain_unit(str(history[name].attrs["units"])) for name in frame.columns}
    return encode_frame(frame.rename(columns=lambda name: heading(name, unit=units[name])), ".csv")


@dataclass(frozen=True)
class Points:
    """Measured points: columns in SI, by the names of inputs, variables and sigma, and where they come from."""

    source: str
    columns: Mapping[str, tuple[float, ...]]


def read_points(
    points: str | Path | Mapping[str, Sequence[object]] | pd.DataFrame | xr.Dataset, n: float | None = None
) -> Points:
    """Read measured points of a CSV file, a mapping of lists, or a table of pandas or xarray.

    The names of the columns are those of inputs and variables, with their units in brackets: "v1 [mm/s]". Without
    a unit a column is in SI. `sigma` is the standard deviation of the variable in the column before it, by default
    in its unit, `sigma_NAME` that of a variable. The unit of K is that for the exponent n of the result. Heights
    and times of flight are taken as in [data]. Warnings name other columns, and count the rows in which a value is
    missing, which are left out.
    """
    quantities = _column_quantities()
    if isinstance(points, str | Path):
        columns = read_csv(Path(points), quantities.__contains__)
    else:
        columns = columns_of_table(points, "points")
    size = len(next(iter(columns.cells.values()), ()))
    for name, cells in columns.cells.items():
        if len(cells) != size:
            message = f"got {len(cells)} values, expected {size}, as in the first column"
            raise ConfigError(columns.problem(message, name))
    used = [name for name in columns.cells if name in quantities]
    unused = [name for name in columns.cells if name not in quantities and name != SPECIMEN]
    problems = [
        columns.problem(f'no such input or variable; did you mean "{meant}"?', name)
        for name in unused
        if (meant := near_miss(name, quantities))
    ]
    if not used:
        problems.append(columns.problem("got no known column, expected such as v1 [m/s] or e_out"))
    rows, count, gaps = complete_rows(columns, used)
    problems += [columns.problem(message, name, row) for name, row, message in gaps]
    if problems:
        raise ConfigError(*problems)
    warn(*columns.notes(count, unused))
    columns, values, variable = columns.take(rows), {}, ""
    for name in used:
        quantity, unit = quantities[name], ""
        if name.startswith(SIGMA):
            # it has the unit of the variable whose deviations they are
            measured = name.removeprefix(f"{SIGMA}_") if name != SIGMA else variable
            unit = columns.units.get(measured, "")
            quantity = replace(quantity, unit=quantities[measured].unit) if measured else quantity
        has_unit, measured_as = columns.units[name] or unit, MEASURED_OUTPUTS.get(name)
        problem = None if has_unit else percent_problem(columns.cells[name], measured_as, name)
        numbers, wrong = ([], [problem]) if problem else columns.read(name, quantity, n, unit)
        if wrong:
            raise columns.error(wrong)
        values[name] = tuple(map(float, numbers))
        variable = name
    if not LABORATORY.keys().isdisjoint(values):
        specimens = list(map(str, columns.cells.get(SPECIMEN, [""] * len(rows))))
        derived, kept = derive_impacts(values, rows, specimens, STANDARD_GRAVITY)
        others = {name: [column[i] for i in kept] for name, column in values.items() if name not in LABORATORY}
        values = {name: tuple(column) for name, column in (derived | others).items()}
    return Points(columns.source, values)


def _column_quantities() -> dict[str, Quantity]:
    """Define the columns that points may have."""
    outputs = {
        name: Quantity(variable.unit, variable.meaning)
        for name, variable in (OUTPUTS | HISTORY).items()
        if variable.dtype == "f8"
    }
    inputs = {name: Quantity(rule.unit, rule.meaning) for name, rule in SWEEP_QUANTITIES.items()}
    inputs |= {"t": Quantity("s", "time"), "tau": Quantity("N s", "impulse")}
    laboratory = {name: quantity for name, (quantity, _) in LABORATORY.items()}
    sigma = Quantity("1", "standard deviation", least=0.0)
    deviations = {f"{SIGMA}_{name}": replace(sigma, unit=q.unit) for name, q in (outputs | laboratory).items()}
    return {**outputs, **inputs, SIGMA: sigma, **laboratory, **deviations}
