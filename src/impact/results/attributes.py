"""JSON attributes of a result, validated when they are read, since the file may come from anywhere."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, NonNegativeInt, TypeAdapter, ValidationError

from ..contact.slip_motion import FrictionKind
from ..errors import ResultError

# JSON has null for NaN
NullableFloat = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]


class PluginRecord(BaseModel):
    """What a result records about a model that is not built in; see `impact.engine.plugins.Plugin.record`."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    file: str | None
    sha256: str | None
    package: str | None = None


class SummaryRecord(BaseModel):
    """The summary of all points that a large factored file contains; numbers that are NaN are null.

    worst : the largest absolute value of each error, by key of the model
    failed_at : the first points that failed: name of the status, key of the model, index along the axes
    extremes : the smallest and the largest value of each variable, and the number of points without a value; null
        if not evaluated
    """

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    status: dict[str, NonNegativeInt]
    not_evaluated: NonNegativeInt
    worst: dict[str, dict[str, NullableFloat]]
    failed_at: list[tuple[str, str, list[NonNegativeInt]]]
    extremes: dict[str, tuple[NullableFloat, NullableFloat, NonNegativeInt] | None]
    friction_status: dict[str, NonNegativeInt] = {}


@dataclass(frozen=True)
class LawRecord:
    """What a factored file records about a law: all that its outputs depend on besides its trajectories."""

    exponent: float | None
    parameters: list[str]
    domain: dict[str, tuple[float, float]]
    asks_for_e: bool
    is_permanent: bool
    axes: list[str]
    trajectories: int
    is_shared: bool
    stiffness_axes: list[str] | None


@dataclass(frozen=True)
class PairRecord:
    """What a factored file records about the trajectories of a model with a friction law."""

    axes: list[str]
    trajectories: int
    is_shared: bool


ATTRIBUTE_TYPES: Mapping[str, Any] = {
    "axes": list[str],
    "config_set": list[str],
    "design": dict[str, Any],
    "extended": list[Any],
    "fit_bounds": dict[str, list[float]],
    "fit_paths": list[str],
    "frictions": dict[str, FrictionKind],
    "inputs": dict[str, float | str],
    "laws": dict[str, LawRecord],
    "materials": dict[str, dict[str, Any]],
    "packages": dict[str, Any],
    "pairs": list[PairRecord],
    "plugins": dict[str, PluginRecord],
    "summary": SummaryRecord,
    "tolerances": dict[str, Any],
}
# builds the validator of a type once
_adapter: Callable[[Any], TypeAdapter[Any]] = cache(TypeAdapter)


def read_attribute(attributes: Mapping[Any, Any], name: str, source: str = "", *, required: bool = False) -> Any:
    """Read a JSON attribute, empty if it is missing and not required.

    Raise a ResultError that names the source if it is required and missing, or is not JSON of its type.

    >>> read_attribute({"config_set": '["sweep.m2=2.0"]'}, "config_set")
    ['sweep.m2=2.0']
    >>> read_attribute({"plugins": '{"mine": 3}'}, "plugins", "r.h5")
    Traceback (most recent call last):
    impact.errors.ResultError: r.h5: attribute plugins: not JSON of the expected type
    """
    kind = ATTRIBUTE_TYPES[name]
    if name not in attributes and not required:
        return [] if get_origin(kind) is list else {}
    text = attributes.get(name)
    try:
        if isinstance(text, str):
            return _adapter(kind).validate_json(text, strict=True)
    except ValidationError:
        pass
    problem = "missing" if text is None else "not JSON of the expected type"
    raise ResultError(f"{source}{': ' if source else ''}attribute {name}: {problem}")
