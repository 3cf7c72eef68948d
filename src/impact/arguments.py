"""What users see of public names: errors that name an argument of a wrong type, and signatures."""

from __future__ import annotations

import inspect
import numbers
import operator
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from itertools import starmap
from types import FunctionType, UnionType
from typing import Any, ParamSpec, TypeVar, get_args, get_origin

from .errors import ImpactError, UsageError
from .formatting import argument, type_of

P = ParamSpec("P")
T = TypeVar("T")

# a number of another library is one as well
ABSTRACT: Mapping[object, type] = {float: numbers.Real, int: numbers.Integral, Any: object}

# keywords of public functions for objects that are not public
DEPRECATED = {
    "bless": "show",
    "rerun": "execute",
    "sensitivity": "execute",
    "sensitivities": "execute",
    "save": "output",
}


def name_wrong_types(function: Callable[P, T]) -> Callable[P, T]:
    """Wrap a public function: an unexpected error becomes a UsageError if an argument is not of its type.

    Types are only compared after an error, so that whatever works is taken. A deprecated keyword is a warning, but
    not for this package, which calls the function itself.
    """
    deprecated = DEPRECATED.get(function.__name__)

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> T:
        if deprecated in kwargs:
            text = f"{function.__name__}: {deprecated} is deprecated and will be removed in version 2"
            warnings.warn(text, DeprecationWarning, stacklevel=2)
        try:
            return function(*args, **kwargs)
        except Exception as error:
            if not isinstance(error, ImpactError) and (problem := type_problem(function, args, kwargs)):
                raise UsageError(problem) from error
            raise

    call.__module__ = __package__
    return call


def prepare_for_users(member: Any) -> Any:
    """Make a public name of what a module defines: a function names arguments of wrong types."""
    if isinstance(member, type) and is_dataclass(member) and "__init__" in vars(member):
        _show_defaults(member)
    # formulas of laws call `power`, also with symbols
    if not isinstance(member, FunctionType) or member.__name__ == "power":
        return member
    return name_wrong_types(member)


def _show_defaults(kind: type[Any]) -> None:
    """Let `help` show the defaults of a dataclass, such as {}, in place of `<factory>`."""
    defaults = {
        field.name: field.default_factory() for field in fields(kind) if field.default_factory is not MISSING
    }
    signature = inspect.signature(vars(kind)["__init__"])
    parameters = [
        each.replace(default=defaults.get(each.name, each.default)) for each in signature.parameters.values()
    ]
    vars(kind)["__init__"].__signature__ = signature.replace(parameters=parameters)


def require_counts(least: int = 1, /, **counts: int | None) -> None:
    """Refuse numbers of processes, threads or others that are too small; one that is not whole is a TypeError."""
    for name, count in counts.items():
        if count is not None and operator.index(count) < least:
            raise UsageError(f"{argument(name)}: got {operator.index(count)}, expected a whole number >= {least}")


def type_problem(function: Callable[..., object], args: Any, kwargs: Any) -> str:
    """Describe the first argument that is not of its annotated type; empty if there is none.

    >>> from impact.results.ranking import recommend
    >>> type_problem(recommend, ["r.h5"], {"target": 0.6})
    'target: got a float, expected Mapping[str, object] | None'
    >>> type_problem(recommend, ["r.h5"], {"models": ["hertz", 1]})
    'models: got a list with an int, expected str | Sequence[str] | None'
    """
    signature = inspect.signature(function)
    try:
        bound = signature.bind(*args, **kwargs)
    except TypeError:
        # Python names an argument that is missing or unknown
        return ""
    for name, value in bound.arguments.items():
        parameter = signature.parameters[name]
        for item in value if parameter.kind is parameter.VAR_POSITIONAL else [value]:
            # self has no annotation
            if parameter.annotation is not parameter.empty and (
                wrong := _wrong_type(item, eval(parameter.annotation, function.__globals__))
            ):
                return f"{name}: got {wrong}, expected {parameter.annotation}"
    return ""


def _wrong_type(value: Any, annotation: Any) -> str:
    """Name the type of a value that is not of an annotation, with that of its first wrong element; else empty."""
    wrong = type_of(value)
    for alternative in get_args(annotation) if isinstance(annotation, UnionType) else [annotation]:
        kind = get_origin(alternative) or alternative
        # a type such as ArrayLike is for type checkers
        if not isinstance(kind, type) or isinstance(value, ABSTRACT.get(kind, kind)):
            columns = [value, value.values()] if kind is Mapping else [value] if kind is Sequence else []
            # other types have arguments, too
            pairs = zip(columns, get_args(alternative), strict=False)
            elements = ((each, of) for column, of in pairs for each in column)
            element = next(filter(None, starmap(_wrong_type, elements)), "")
            if not element:
                return ""
            wrong = f"{type_of(value)} with {element}"
    return wrong
