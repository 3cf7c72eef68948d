"""The kinds of picture: their names, what a user may choose of one, and the record that describes it.

The command line reads the names at every start, so the module of a kind, which loads matplotlib, is imported when
the kind is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..display import resolve_decimal
from ..errors import UsageError, require_known
from ..formatting import argument

if TYPE_CHECKING:
    import xarray as xr

    from .data import PlotData

# the kinds of each module
MODULES = {
    "restitution": ("final-velocities", "restitution", "error", "timestep"),
    "maps": ("map", "validity"),
    "motions": ("loop", "history", "impulse", "animation"),
    "oblique": ("beta", "e-t", "impulse-ratio", "spin", "psi", "friction-loop"),
    "studies": ("calibration", "uncertainty", "sensitivity"),
}
KINDS = {kind: module for module, kinds in MODULES.items() for kind in kinds}
# sources, see `source_of`, that have a picture of their own and no other
STUDIES = ("calibration", "sensitivity study")
# width of one and of two columns of a journal [in]
WIDTHS = {"single": 3.5, "double": 7.1}
LOG_AXES = ("x", "y", "xy")
# how a legend names laws: by title, year and parameters, by title and year, or by key; "none" for no legend
LEGENDS = ("full", "short", "keys", "none")
# the first of them whose legend has room is used where the user chooses none
DEFAULT_LEGENDS = ("full", "short", "keys")
# limits of the width and height of a picture
MIN_SIZE_INCHES, MAX_SIZE_INCHES = 1.0, 60.0
METERS_PER_INCH = 0.0254


@dataclass(frozen=True)
class Choice:
    """Which part of a result is drawn; see `impact.plot`."""

    x: str | None = None
    y: str | None = None
    variable: str | None = None
    sel: Mapping[str, object] | None = None
    models: Sequence[str] | None = None
    log: str = ""
    equations: bool = False
    frictions: Sequence[str] | None = None

    def __post_init__(self) -> None:
        # imported here: every command reads the kinds
        from ..results.selection import as_keys

        for name in ("models", "frictions"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, as_keys(getattr(self, name), name))
        if self.log not in ("", *LOG_AXES):
            raise UsageError(f"{argument('log')}: got {self.log}, expected {', '.join(LOG_AXES)}")


@dataclass(frozen=True)
class Look:
    """How a picture looks; see `impact.plot`."""

    width: float | str | None = None
    height: float | str | None = None
    style: str | Path | None = None
    title: bool = True
    labels: Mapping[str, str] | None = None
    legend: str | None = None
    decimal: str = "point"

    def __post_init__(self) -> None:
        _ = self.size
        if self.legend not in (None, *LEGENDS):
            raise UsageError(f"{argument('legend')}: got {self.legend}, expected {', '.join(LEGENDS)}")
        object.__setattr__(self, "decimal", resolve_decimal(self.decimal))

    @property
    def size(self) -> tuple[float | None, float | None]:
        """Width and height [in]; None for the default."""
        return length(self.width, argument("width")), length(self.height, argument("height"))


@dataclass(frozen=True)
class Kind:
    """A kind of picture: a constant of its module, with the name of the kind in capitals."""

    caption: str  # a sentence for reports and the gallery
    # from a result, or, of the source "history", from the time histories of one impact
    data: Callable[[Any, Choice], PlotData]
    # what a report shows of a result, for some keys of models; None if the kind does not apply
    default: Callable[[xr.Dataset, Sequence[str]], Choice | None]
    along: tuple[str, ...] = ("x",)  # inputs that it draws along; "x" and "y" are those of the choice
    source: str = "sweep"  # what it shows, see `source_of`; the first kind in KINDS of a source is its default
    in_report: bool = True
    of_friction: bool = False  # it shows pairs of a model and a friction law
    name: str = ""  # entered by `find_kind`

    def inputs_along(self, x: str | None, y: str | None) -> tuple[str, ...]:
        """List the inputs that it draws along; others have a value.

        >>> [find_kind(name).inputs_along("e", "m2") for name in ("loop", "error", "map")]
        [(), ('e',), ('e', 'm2')]
        """
        inputs = ({"x": x, "y": y}.get(name, name) for name in self.along)
        return tuple(name for name in inputs if name is not None)


def length(size: str | float | None, origin: str) -> float | None:
    """Convert a number of inches, a length with its unit, or the name of a journal's width to inches.

    >>> round(length("84mm", "width"), 4), length("single", "width"), length(7.1, "width")
    (3.3071, 3.5, 7.1)
    """
    from ..config.files import to_plain_value
    from ..config.quantities import Quantity

    plain = to_plain_value(size)
    if plain is None:
        return None
    if isinstance(plain, str) and plain in WIDTHS:
        return WIDTHS[plain]
    inches = Quantity("m", "").read_or_nan(plain) / METERS_PER_INCH if isinstance(plain, str) else plain
    if not isinstance(inches, float | int) or not MIN_SIZE_INCHES <= inches <= MAX_SIZE_INCHES:
        expected = f"a length from 26mm to {MAX_SIZE_INCHES:g}in, such as 84mm, 8.4cm or 3.3in"
        names = f", or {' or '.join(WIDTHS)}" if origin.endswith("width") else ""
        raise UsageError(f"{origin}: got {plain}, expected {expected}{names}")
    return float(inches)


def check_choice(choice: Choice, kinds: Sequence[Kind]) -> None:
    """Refuse an axis or a variable that none of some kinds of picture shows."""
    shows: dict[str, Callable[[Kind], bool]] = {
        "x": lambda kind: bool(kind.along),
        "y": lambda kind: "y" in kind.along,
        "variable": lambda kind: kind.name in ("map", "uncertainty"),
    }
    for name, shows_it in shows.items():
        if getattr(choice, name) is not None and not any(map(shows_it, kinds)):
            drawn = " and ".join(kind.name for kind in kinds)
            others = ", ".join(kind.name for kind in map(find_kind, KINDS) if shows_it(kind))
            # a study has no other picture
            expected = "" if any(kind.source in STUDIES for kind in kinds) else f", expected a kind among {others}"
            raise UsageError(f"{argument(name)}: does not apply to {drawn}{expected}")


def find_kind(name: str) -> Kind:
    """Find a kind of picture; an unknown one is a UsageError that suggests the nearest."""
    require_known([name], KINDS, f"{argument('kind')}: no kind")
    module = import_module(f".{KINDS[name]}", __package__)
    kind: Kind = getattr(module, name.upper().replace("-", "_"))
    return replace(kind, name=name)


def source_of(dataset: xr.Dataset) -> str:
    """Find what a dataset holds: its kind, see `impact.results.schema`, or "samples" of uncertain inputs."""
    from ..config.grid import SAMPLE
    from ..results.schema import kind_of

    source = kind_of(dataset)
    return "samples" if source == "sweep" and SAMPLE in dataset.dims else source


def default_kind(dataset: xr.Dataset) -> Kind:
    """Find the kind of picture that shows what a dataset is for."""
    source = source_of(dataset)
    if source == "board":
        raise UsageError("plot: this is a board, which has no picture; impact report writes its page")
    return next(kind for kind in map(find_kind, KINDS) if kind.source == source)


def kinds_of(dataset: xr.Dataset) -> list[Kind]:
    """List the kinds of picture that may show a dataset."""
    source = source_of(dataset)
    sources = (source,) if source in STUDIES else ("sweep", "history", source)
    return [kind for kind in map(find_kind, KINDS) if kind.source in sources]
