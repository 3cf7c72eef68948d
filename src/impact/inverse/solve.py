"""Solve for an input of a law: the value of a parameter, of K, or the e to ask for, that gives a target.

Chebyshev polynomials replace the output between powers of ten of the input, see `impact.contact.interpolant`.
Their extrema are roots of the derivatives, so that between neighbouring nodes and extrema is one root or none.
Each root is corrected by integration. Where no polynomial is accurate, the output is scanned at logarithmically
spaced values. So are outputs with friction and of schemes with a fixed step; interior extrema of their scan are
refined by the method of Chandrupatla (1998), Computer Methods in Applied Mechanics and Engineering 152, 211-217.
Brackets of roots are refined by that of Chandrupatla (1997), Advances in Engineering Software 28, 145-149; both
are those of `scipy.optimize.elementwise`. Over a range of conditions the largest distance from the target is
minimized instead, by Brent's bounded search.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeAlias

import numpy as np
import xarray as xr
from scipy.optimize import elementwise, minimize_scalar

from ..array_types import AnyArray, Array, Indices, Mask
from ..config.files import to_plain_data
from ..config.input_names import InputName
from ..config.load import Config
from ..contact.fixed_step import EXACT
from ..contact.friction import FrictionLaw, Pair
from ..contact.frictions import find_friction
from ..contact.interpolant import NODE_MAX_STEPS, Interpolant
from ..contact.model import ForceModel, Parameter
from ..contact.models import find
from ..contact.status import FrictionStatus, Status
from ..contact.units import names_in, with_numbers
from ..contact.variables import OUTPUTS
from ..display import Block, Displayed
from ..engine.inputs import build_impacts
from ..engine.plan import Plan
from ..engine.plugins import read_plugins
from ..errors import UsageError, did_you_mean, require_known, warn
from ..formatting import argument, law_name, number, prefixed, quantity, safe_text
from ..results.ranking import only_target, target_value
from ..results.single_impact import PointSource, ignores_e, input_name, joint_inputs, open_source, single_point
from .prepared import outputs_at, trial_inputs

# values that are tried before roots are refined: powers of ten times the contact's own unit of the parameter
SCAN_DECADES, SCAN_PER_DECADE = 8, 16
# polynomials are tried on the intervals between these powers of ten, each divided so many times
MAX_DIVISIONS = 7
# values that are tried between two finite bounds
SCAN_BETWEEN_BOUNDS = 201
# the scan is coarse, and gives up integrations that take more steps
SCAN_RTOL, SCAN_MAX_STEPS = 1e-7, 400
# values of the scan that are this near to the target are integrated again
SCAN_TOLERANCE = 1e-3
# a value of the scan is a root within this multiple of the tolerance of the integration
TARGET_TOLERANCE = 10.0
# a smaller difference between neighbours of the scan does not count as an extremum
SCAN_NOISE = 1e-6
# values that differ by less are one end of the range, which has six digits
RANGE_TOLERANCE = 1e-7
# an extremum is refined until the output differs by less, relative to itself; absolute for a restitution
EXTREMUM_TOLERANCE = 1e-10
# most of the distance of an extremum from the nearest value of the scan, relative to the larger difference of that
# value from its neighbours: a parabola has 1/8
OVERSHOOT = 2.0
# values that give the target this near to each other, relative to themselves, are one root
ONE_ROOT = 1e-5
# relative step of the slope at a root, and the largest one of its correction
SLOPE_STEP = 1e-6
# a refined root is a jump of the output if it is farther from the target
REFINED_TOLERANCE = 1e-7

SolveStatus: TypeAlias = Literal["ok", "at_bound", "several_roots", "no_root"]


@dataclass(frozen=True)
class Root:
    """A value that gives the target, the restitution and the target variable there; over a range, their means."""

    value: float
    e_out: float
    output: float


@dataclass(frozen=True)
class SolveResult(Displayed):
    """The values of an input with which a law gives a target.

    Parameters
    ----------
    name : the input: a parameter of the law or of the friction law, "K", "e" or "mu"
    target : value by variable
    status : "at_bound" where the only root is the least or largest allowed value
    roots : in ascending order; over a range of inputs, the best value
    attainable : the least and the largest value of the target over the scan and its refined extrema, or over a
        range of inputs at the best value, to six digits
    over : the conditions of a range of inputs, each with its e_out and the target variable; None without a range
    """

    model: str
    name: str
    unit: str
    target: Mapping[str, float]
    status: SolveStatus
    roots: tuple[Root, ...]
    attainable: tuple[float, float]
    over: tuple[Mapping[str, float | str], ...] | None
    friction: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Convert to plain data; without a friction law there is no such field."""
        fields = {name: value for name, value in asdict(self).items() if name != "friction" or value}
        fields["roots"] = self._root_records()
        return {"for" if name == "name" else name: value for name, value in fields.items()}

    def records(self) -> Sequence[Mapping[str, Any]]:
        """List the conditions of a range of inputs; without one the roots."""
        return self.over if self.over is not None else self._root_records()

    def _root_records(self) -> tuple[dict[str, float], ...]:
        (variable,) = self.target
        return tuple({"value": root.value, "e_out": root.e_out, variable: root.output} for root in self.roots)

    def sections(self, width: int) -> Iterator[Block]:
        """Write a line for each root, or the range that can be attained."""
        ((variable, value),) = self.target.items()
        unit = OUTPUTS[variable].unit if variable in OUTPUTS else "1"
        # an exponent n has a value for each law; ends of a range have six digits in rad, which are five in degrees
        digits = 5 if unit == "rad" else 6
        written = partial(prefixed, unit="1" if names_in(unit) else unit, digits=digits)
        target = f"{variable} = {written(value)}"
        for root in self.roots:
            # a minimum has half the digits of a root
            line = f"{self.name} = {quantity(root.value, self.unit, 10 if self.over is None else 6)}"
            if self.over is None:
                at_bound = ", its bound" if self.status == "at_bound" else ""
                e_out = f", e_out = {number(root.e_out)}" if variable != "e_out" else ""
                yield f"{line}{at_bound}: {target}{e_out}"
            else:
                name = next(iter(self.over[0]))
                ends = (
                    f"{written(condition[variable])} at {name} = {safe_text(number(condition[name]), 60)}"
                    for condition in (self.over[0], self.over[-1])
                )
                yield f"{line}: {variable} from {' to '.join(ends)}"
        if not self.roots:
            smallest, largest = map(written, self.attainable)
            attained = f"{variable} is from {smallest} to {largest}"
            yield f"{law_name(self.model, self.friction)}: no value of {self.name} gives {target}; {attained}"


def solve(
    model: str,
    name: str,
    target: Mapping[str, object],
    *,
    friction: str | None = None,
    source: str | Path | Mapping[str, object] | xr.Dataset | None = None,
    at: Mapping[str, object] | None = None,
    over: Mapping[str, object] | None = None,
    overrides: Sequence[str] | Mapping[str, object] = (),
    plugins: Sequence[ForceModel | str | Path] = (),
) -> SolveResult:
    """Find the value of an input of a law that gives a target: which coefficient gives the rebound I want?

    Parameters
    ----------
    model : key of the law
    name : what to solve for: a parameter of the law or of the friction law, the restitution "e" to ask it for, the
        stiffness "K", or the coefficient of friction "mu"
    target : the value of one output, such as `{"e_out": 0.6}`, or with a friction law `{"beta": 0.4}`
    friction : key of the friction law; by default the first one of the source, if it has any
    source : a TOML file, a mapping, a result, or a calibration; by default the two balls of Table 1 of the paper
    at : values of the other inputs by config name, such as `{"v1": 1.0}`
    over : values of one input, such as `{"v1": {"linspace": [0.1, 3, 30]}}`, for which one value is found, with
        the smallest largest distance from the target
    overrides, plugins : see `sweep`

    Returns
    -------
    SolveResult : the status, the roots with the e_out of each, the range of the target that was found, and the
        outputs over the range of inputs

    Raises
    ------
    UsageError : the law has no such parameter, or the target is not an output
    ConfigError, ModelError : see `sweep`

    The law of Gharib and Hurmuzlu delivers less than it is asked for, and never 0.6:

    >>> import impact
    >>> round(impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.5}).roots[0].value, 6)
    0.697958
    >>> print(impact.solve("gharib-hurmuzlu-2012", "e", {"e_out": 0.6}))
    gharib-hurmuzlu-2012: no value of e gives e_out = 0.6; e_out is from 0 to 0.593624
    """
    if over is not None and len(over) != 1:
        raise UsageError(f"{argument('over')}: got {len(over)} inputs, expected one")
    plugin_set = read_plugins(plugins)
    law = find(model, plugin_set.models)
    point_source = open_source(source, overrides, plugin_set)
    friction_law = (
        find_friction(friction) if friction is not None else next(iter(point_source.draft(model).frictions), None)
    )
    unknown = unknown_of(law, name, friction_law)
    at = dict(at or {})
    for key in [*at]:
        if {config_name(law, unknown), unknown.name} & {key, str(input_name(key, law, friction_law))}:
            warn(f"{argument('at', key=key)}: {name} is solved for, and this value changes nothing")
            del at[key]
    inputs = {**placeholder(law, unknown, point_source), **at}
    config, _ = single_point(point_source, model, inputs, over, friction=friction)
    if "e" in at and ignores_e(config):
        warn(f"{argument('at', key='e')}: e is not an input of {law.key}, and changes nothing")
    for over_name, values in (over or {}).items():
        if not isinstance(to_plain_data(values)[0], list | dict):
            raise UsageError(f"{argument('over', key=over_name)}: got one value, expected a list or a range")
    if over and not config.axes:
        raise UsageError(f"{argument('over')}: {next(iter(over))} does not count if {unknown.name} is solved for")
    names = [name for name, variable in OUTPUTS.items() if variable.dtype == "f8" and variable.per_model]
    variable, value = only_target(target)
    require_known([variable], names, f"{argument('target')}: no output")
    if OUTPUTS[variable].of_friction and not config.frictions:
        expected = argument("friction", "KEY")
        raise UsageError(f"{argument('target', key=variable)}: got no friction law, expected {expected}")
    Plan(config).pair_notes("frictions")
    problem, wanted = SolveProblem(config, unknown, variable), target_value(variable, value)
    return _best_over_axis(problem, wanted) if config.axes else _all_roots(problem, wanted)


def unknown_of(
    model: ForceModel, name: str, friction: FrictionLaw | None = None, origin: str = "name"
) -> Parameter:
    """Describe the input to solve for as a parameter with its unit and bounds.

    A parameter of the friction law has its config name, `friction.KEY.NAME`, of which NAME is enough. `origin` is
    the argument that names it.

    >>> from impact.contact.models import find
    >>> from impact.contact.frictions import find_friction
    >>> unknown_of(find("hunt-crossley-1975"), "e").most
    1.0
    >>> unknown_of(find("hertz"), "kt_over_kn", find_friction("lammps-mindlin")).name
    'friction.lammps-mindlin.kt_over_kn'
    """
    unknowns = {parameter.name: parameter for parameter in model.parameters}
    unknowns["K"] = Parameter("K", "N/m^n", "stiffness", least=0.0)
    if friction is not None:
        unknowns["mu"] = Parameter("mu", "1", "coefficient of friction", default=0.3, least=0.0)
        for parameter in friction.parameters:
            if not parameter.choices:
                full = replace(parameter, name=f"friction.{friction.key}.{parameter.name}")
                unknowns |= {full.name: full, **({} if parameter.name in unknowns else {parameter.name: full})}
    if "e" in model.quantities or (friction is not None and friction.may_use_e):
        unknowns["e"] = Parameter("e", "1", "restitution to enter", default=0.5, least=0.0, most=1.0)
    if name not in unknowns:
        laws = law_name(model.key, friction.key if friction else "")
        needs_friction = friction is None and (name == "mu" or InputName.parse(name).friction)
        hint = f"expected {argument('friction', 'KEY')}" if needs_friction else did_you_mean(name, list(unknowns))
        raise UsageError(f'{argument(origin)}: {laws} has no parameter "{name}"; {hint}')
    return unknowns[name]


def config_name(model: ForceModel, unknown: Parameter) -> str:
    """Write the config name of the unknown."""
    name = unknown.name
    is_shared = name in ("e", "mu") or (name == "K" and model.exponent is None)
    return name if is_shared or name.startswith("friction.") else f"{model.key}.{name}"


def placeholder(model: ForceModel, unknown: Parameter, source: PointSource) -> dict[str, float]:
    """Give the unknown a valid value by its config name, so that the config needs none.

    Where it varies together with others the config has values, and another one would select none of them.
    """
    name = config_name(model, unknown)
    if unknown.name == "K" or name in joint_inputs(source.draft(model.key)):
        return {}
    value = next((v for v in (unknown.default, unknown.typical) if v is not None), 1.0)
    return {name: min(max(value, unknown.least), unknown.most)}


def solve_damping(config: Config, e: float) -> Config:
    """Set the damping parameter of a law without an e to the value that gives an e."""
    law = config.models[0]
    unknown = unknown_of(law, law.damping)
    # the e of the continuous law, which friction does not change
    problem = SolveProblem(replace(config, frictions=()), unknown, "e_out")
    size, wanted = problem.natural_size(), target_value("e_out", e)
    # the least of several values is wanted, and impacts under weak damping take fewer steps
    inner = [size] if unknown.least < size < unknown.most else []
    for least, most in pairwise([unknown.least, *inner, unknown.most]):
        part = replace(problem, unknown=replace(unknown, least=least, most=most))
        roots, _ = _roots_and_values(part, wanted, with_range=False)
        if roots:
            return replace(config, scalars={**config.scalars, config_name(law, unknown): roots[0]})
    lower, upper = map(number, _all_roots(problem, e).attainable)
    asked = argument("at", number(e), key="e")
    raise UsageError(f"{asked}: {law.key} delivers {lower} to {upper} at any {law.damping}")


@dataclass(frozen=True)
class SolveProblem:
    """The target variable as a function of the unknown, under each condition, a position on the axis if any."""

    config: Config
    unknown: Parameter
    variable: str

    @property
    def model(self) -> ForceModel:
        return self.config.models[0]

    @property
    def name(self) -> str:
        return config_name(self.model, self.unknown)

    @property
    def friction(self) -> str:
        """The key of the friction law; "" without one."""
        return self.config.frictions[0].key if self.config.frictions else ""

    @property
    def is_of_order_one(self) -> bool:
        """Whether differences of the target count as they are, as those of a restitution do."""
        return OUTPUTS[self.variable].scale == "1"

    @property
    def n_conditions(self) -> int:
        return math.prod(axis.size for axis in self.config.axes)

    def columns(self, values: Array) -> dict[str, AnyArray]:
        """Pair each value with the inputs of every condition."""
        columns: dict[str, AnyArray] = {self.name: np.repeat(values, self.n_conditions)}
        for axis in self.config.axes:
            columns |= {name: np.tile(column, values.size) for name, column in axis.columns.items()}
        return columns

    def evaluate(self, values: Array, *, is_scan: bool = False) -> dict[str, AnyArray]:
        """Compute the target variable, its status and e_out at k values; NaN where the integration fails.

        The arrays are of shape (k,), or over an axis of shape (k, conditions).
        """
        config, solver = self.config, self.config.solver
        # the number of steps of a fixed-step scheme is given by its step
        if is_scan and solver.integrator == EXACT:
            solver = replace(solver, rtol=max(solver.rtol, SCAN_RTOL), max_steps=SCAN_MAX_STEPS)
            config = replace(config, solver=solver)
        law = Pair(self.model, config.frictions[0]) if config.frictions else self.model
        names = dict.fromkeys((self.variable, OUTPUTS[self.variable].status, "e_out"))
        outputs = outputs_at(config, law, self.columns(values), list(names))
        shape = (values.size, *(axis.size for axis in self.config.axes))
        return {name: array.reshape(shape).copy() for name, array in outputs.items()}

    def scan(self, values: Array, target: float, known: Array, *, with_range: bool = True) -> AnyArray:
        """Compute the target variable at the values of a scan; `known` are values of it elsewhere."""
        outputs = self.evaluate(values, is_scan=True)[self.variable]
        failed = np.isnan(outputs).reshape(values.size, -1).any(axis=1)
        # at each condition
        computed = [np.append(known, column) for column in outputs.reshape(values.size, -1)[~failed].T]
        is_beyond = not all(each.size and each.min() <= target <= each.max() for each in computed)
        if with_range and failed.any() and is_beyond and (self.variable != "e_out" or 0.0 <= target <= 1.0):
            # the scan stops at SCAN_MAX_STEPS: impacts of more steps may attain the target
            outputs[failed] = self.evaluate(values[failed])[self.variable]
        return outputs

    def answers(self, values: Array) -> dict[str, AnyArray]:
        """Compute the same where the target is reached; warn if no code with a fixed step delivers it."""
        outputs, variable = self.evaluate(values), OUTPUTS[self.variable]
        if variable.of_friction and (outputs[variable.status] == FrictionStatus.SLOW_LIMIT).any():
            laws = law_name(self.model.key, self.friction)
            warn(f"{laws}: {self.variable} is {FrictionStatus.SLOW_LIMIT.meaning}; see impact timestep")
        return outputs

    def raise_failure(self) -> NoReturn:
        """Raise a UsageError with the most frequent status of the integrations of the scan that fail."""
        outputs = self.evaluate(self.scan_values(), is_scan=True)
        variable = OUTPUTS[self.variable]
        statuses = outputs[variable.status][np.isnan(outputs[self.variable])]
        status = (FrictionStatus if variable.of_friction else Status)(int(np.bincount(statuses).argmax()))
        # of balls whose contact points do not slip before the impact beta is 0/0
        is_undefined = status == Status.OK
        reason = f"{variable.equation or 'it'} has no value at these inputs" if is_undefined else status.meaning
        laws = law_name(self.model.key, self.friction)
        raise UsageError(f"{laws}: no {self.variable} at any value of {self.unknown.name}: {reason}")

    def scan_values(self, per_decade: int = SCAN_PER_DECADE, between_bounds: int = SCAN_BETWEEN_BOUNDS) -> Array:
        """List the allowed values that are tried first, in ascending order."""
        lower, upper = self.unknown.least, self.unknown.most
        decades = np.arange(-SCAN_DECADES * per_decade, SCAN_DECADES * per_decade + 1) / per_decade
        sizes = self.natural_size() * 10.0**decades
        values = [sizes, np.array([bound for bound in (0.0, lower, upper) if math.isfinite(bound)])]
        if lower < 0.0:
            values.append(-sizes)
        if math.isfinite(lower) and math.isfinite(upper):
            values.append(np.linspace(lower, upper, between_bounds))
        all_values: Array = np.unique(np.concatenate(values))
        # with a stiffness of zero there is no contact
        is_allowed = (all_values > 0.0) | (self.unknown.name != "K")
        return all_values[is_allowed & (all_values >= lower) & (all_values <= upper)]

    @property
    def is_smooth(self) -> bool:
        """Whether polynomials are tried; friction has kinks, and schemes where the number of steps changes."""
        return not self.config.frictions and self.config.solver.integrator == EXACT

    def interpolant(self, target: float | None = None, *, with_range: bool = False) -> Interpolant:
        """Interpolate the target variable between the powers of ten of the scan, under each condition.

        With a target, of one condition, no interval is divided whose values are far from it, such as those at
        damping at which balls stick; with the range also those are that may have an end of it.
        """
        scan = self.scan_values(per_decade=1, between_bounds=2)
        solver = self.config.solver
        solver = replace(solver, max_steps=min(solver.max_steps, NODE_MAX_STEPS))
        limited = replace(self, config=replace(self.config, solver=solver))
        smallest, largest = math.inf, -math.inf

        def function(x: Array) -> Array:
            nonlocal smallest, largest
            values = np.asarray(limited.evaluate(x)[self.variable], float).reshape(x.size, -1)
            smallest = float(np.fmin.reduce(values, None, initial=smallest))
            largest = float(np.fmax.reduce(values, None, initial=largest))
            return values

        def is_needed(values: Array) -> bool:
            if target is None:
                return True
            # the range of its values doubled bounds the function; no restitution is negative
            lower, upper = float(np.nanmin(values)), float(np.nanmax(values))
            beyond = 0.5 * (upper - lower)
            lower, upper = max(lower - beyond, 0.0 if self.variable == "e_out" else -math.inf), upper + beyond
            is_extreme = lower < smallest - self.digits(smallest) or upper > largest + self.digits(largest)
            # where integrations fail the range is that of the scan
            return lower <= target <= upper or (with_range and is_extreme and bool(np.isfinite(values).all()))

        floors = np.full(self.n_conditions, float(self.is_of_order_one))
        return Interpolant(function, scan, floors, MAX_DIVISIONS, is_needed)

    def digits(self, value: float) -> float:
        """How far values of the variable are from each other that count as equal."""
        return RANGE_TOLERANCE * (1.0 if self.is_of_order_one else abs(value))

    def unit(self) -> str:
        """Write the SI unit of the unknown, with numbers for the names in its exponents."""
        numbers = {InputName.parse(name).key: v for name, v in self.config.scalars.items() if isinstance(v, float)}
        exponent = {} if self.model.exponent is None else {"n": self.model.exponent}
        return with_numbers(self.unknown.unit, {**numbers, **exponent})

    def natural_size(self, otherwise: float = 1.0) -> float:
        """Find the size of the unknown: 1 in the contact's own units, or its typical value if it is no damping.

        `otherwise` stands for a size that does not follow from the inputs, as that of K without a material.
        """
        if self.unknown.typical and not self.unknown.is_damping:
            return abs(self.unknown.typical)
        if self.unknown.name in ("e", "mu"):
            return 1.0
        # without a stiffness in the config that of the materials, else of the radii, is the scale
        columns = self.columns(np.ones(1))
        if self.unknown.name == "K":
            del columns[self.name]
        inputs = trial_inputs(self.config, columns)
        impacts = build_impacts(inputs, self.model, inputs.index())
        # a derived quantity may be zero or infinite
        with np.errstate(all="ignore"):
            if self.unknown.name == "K":
                size = impacts.K[0]
            elif self.unknown.name.startswith("friction."):
                size = 1.0 / impacts.in_own_units(np.ones(1), self.unknown.unit)[0]
            else:
                size = 1.0 / impacts.dimensionless(self.model, self.unknown.name)[0]
        return float(size) if 0.0 < size < math.inf else otherwise

    def result(self, target: float, status: SolveStatus, roots: Iterable[Root], values: Array) -> SolveResult:
        """Make the result of roots, with the range of some values of the variable."""
        return SolveResult(
            model=self.model.key,
            name=self.unknown.name,
            unit=self.unit(),
            target={self.variable: target},
            status=status,
            roots=tuple(roots),
            # to the digits of the scan
            attainable=(float(f"{np.nanmin(values):.6g}"), float(f"{np.nanmax(values):.6g}")),
            over=None,
            friction=self.friction,
        )


def _all_roots(problem: SolveProblem, target: float) -> SolveResult:
    """Find all values that give the target, and the range of the output."""
    roots, values = _roots_and_values(problem, target)
    if not values.size:
        problem.raise_failure()
    names = ("e_out", problem.variable)
    outputs = problem.answers(np.array(roots)) if roots else dict.fromkeys(names, np.zeros(0))
    status: SolveStatus = "no_root" if not roots else "several_roots" if len(roots) > 1 else "ok"
    if status == "ok" and roots[0] in (problem.unknown.least, problem.unknown.most):
        status = "at_bound"
    return problem.result(target, status, map(Root, roots, *(outputs[name].tolist() for name in names)), values)


def _roots_and_values(
    problem: SolveProblem, target: float, *, with_range: bool = True
) -> tuple[list[float], Array]:
    """Find all values that give the target, ascending, and values of the output; none if all integrations fail.

    Without the range of the output no work is spent on values far from the target.
    """
    scan, interpolant = problem.scan_values(), None
    known_scan, known_values = np.zeros((2, 0))
    if problem.is_smooth:
        interpolant = problem.interpolant(target, with_range=with_range)
        interpolant.resolve()
        known_scan, known_values = interpolant.samples()
        scan = scan[np.isnan(interpolant(scan)[:, 0])]
    values = problem.scan(scan, target, known_values, with_range=with_range) if scan.size else np.zeros(0)
    # a value at which the integration fails, often for want of steps, hides no root between its neighbours
    scan, values = scan[~np.isnan(values)], values[~np.isnan(values)]
    if not scan.size + known_scan.size:
        return [], scan
    scale = 1.0 if problem.is_of_order_one else abs(target) or float(np.abs(np.append(values, known_values)).max())
    tolerance = TARGET_TOLERANCE * problem.config.solver.rtol * scale
    is_exact = np.abs(values - target) <= SCAN_TOLERANCE * scale
    if scan.size and with_range:
        is_exact[[values.argmin(), values.argmax()]] = True
    if is_exact.any():
        exact = problem.evaluate(scan[is_exact])[problem.variable]
        values[is_exact] = np.where(np.isnan(exact), values[is_exact], exact)
    if interpolant is None:
        scan, values = _with_extrema(problem, scan, values, target, tolerance)
    else:
        scan, first = np.unique(np.append(known_scan, scan), return_index=True)
        values = np.append(known_values, values)[first]
    distance = values - target
    reached = np.abs(distance) <= tolerance
    bounds = {problem.unknown.least, problem.unknown.most}
    roots, ends = _runs(reached, scan, bounds)
    between = np.flatnonzero((distance[:-1] * distance[1:] < 0.0) & ~reached[:-1] & ~reached[1:])
    left = np.concatenate([between, np.array(ends, np.intp)])
    if left.size:
        is_end = np.arange(left.size) >= between.size

        def function(x: Array, is_end: Mask) -> Array:
            of_x = _known(problem, interpolant, x)[:, 0] - target
            return np.where(is_end, np.abs(of_x) - tolerance, of_x)

        refined = elementwise.find_root(
            function,
            (scan[left], scan[left + 1]),
            args=(is_end,),
            tolerances={"xatol": 0.0, "xrtol": 4.0 * np.finfo(float).eps, "fatol": 0.0, "frtol": 0.0},
        )
        # where the output jumps across the target there is no root; an end of an interval may be a jump
        is_root = np.abs(refined.f_x) <= max(tolerance, REFINED_TOLERANCE * scale)
        inside = np.where(refined.f_bracket[0] <= 0.0, *refined.bracket)
        polished = _polished(problem, interpolant, refined.x[is_root & ~is_end], target)
        roots += polished.tolist() + inside[is_end].tolist()
    roots.sort()
    return roots, values


def _known(problem: SolveProblem, interpolant: Interpolant | None, x: Array) -> Array:
    """Compute the target variable by polynomials, and integrate where none is accurate; shape (k, conditions)."""
    known = np.full((x.size, problem.n_conditions), np.nan) if interpolant is None else interpolant(x)
    unknown = np.flatnonzero(np.isnan(known).any(axis=1))
    if unknown.size:
        known[unknown] = problem.evaluate(x[unknown])[problem.variable].reshape(unknown.size, -1)
    return known


def _polished(problem: SolveProblem, interpolant: Interpolant | None, roots: Array, target: float) -> Array:
    """Correct roots of polynomials by one step of Newton's method from the integrated value."""
    if interpolant is None or not roots.size:
        return roots
    distance = problem.evaluate(roots)[problem.variable] - target
    near = np.concatenate([roots * (1.0 - SLOPE_STEP), roots * (1.0 + SLOPE_STEP)])
    below, above = np.split(interpolant(near)[:, 0], 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = distance * 2.0 * SLOPE_STEP * roots / (above - below)
    is_small = np.abs(step) <= SLOPE_STEP * np.abs(roots)
    return np.asarray(np.clip(roots - np.where(is_small, step, 0.0), problem.unknown.least, problem.unknown.most))


def _with_extrema(
    problem: SolveProblem, scan: Array, values: Array, target: float, tolerance: float
) -> tuple[Array, Array]:
    """Add to a scan, refined, those interior extrema that may lie beyond the target or at an end of the range."""
    size = np.ones_like(values) if problem.is_of_order_one else np.abs(values)
    minima, maxima = _minima(values, size), _minima(-values, size)
    extrema, sign = np.append(minima, maxima), np.repeat([1.0, -1.0], [minima.size, maxima.size])
    rise = np.abs(values[[extrema - 1, extrema + 1]] - values[extrema]).max(axis=0)
    distances = np.abs(values[extrema] - np.array([[target], [values.min()], [values.max()]]))
    matters = (distances <= OVERSHOOT * rise).any(axis=0) & (distances[0] > tolerance)
    extrema, sign = extrema[matters], sign[matters]
    if not extrema.size:
        return scan, values
    refined = elementwise.find_minimum(
        lambda x, *signs: signs[0] * problem.evaluate(x)[problem.variable],
        (scan[extrema - 1], scan[extrema], scan[extrema + 1]),
        args=(sign,),
        tolerances={"fatol": EXTREMUM_TOLERANCE * problem.is_of_order_one, "frtol": EXTREMUM_TOLERANCE},
    )
    is_found = np.isfinite(refined.f_x)
    scan, first = np.unique(np.concatenate([refined.x[is_found], scan]), return_index=True)
    return scan, np.concatenate([(sign * refined.f_x)[is_found], values])[first]


def _minima(values: Array, size: Array) -> Indices:
    """Find the positions of the interior minima of a scan; differences small relative to `size` are noise."""
    rises = np.stack([values[:-2], values[2:]]) - values[1:-1]
    return 1 + np.flatnonzero((rises.min(axis=0) >= 0.0) & (rises.max(axis=0) > SCAN_NOISE * size[1:-1]))


def _runs(reached: Mask, scan: Array, bounds: set[float]) -> tuple[list[float], list[int]]:
    """Reduce runs of neighbouring values that reach the target to roots, and to left positions of their ends."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], reached, [False]]))).reshape(-1, 2)
    roots: list[float] = []
    ends: list[int] = []
    for first, after in edges.tolist():
        at_bound = sorted({float(scan[first]), float(scan[after - 1])} & bounds)
        # of a run at a bound the bound alone is a root
        # neighbours beside an extremum that touches the target are one root
        if at_bound or scan[after - 1] - scan[first] <= ONE_ROOT * abs(scan[first]):
            roots.append(at_bound[0] if at_bound else float(scan[(first + after - 1) // 2]))
            continue
        # the end of a scan is no root where the run begins or ends within it
        lefts = [left for left in (first - 1, after - 1) if 0 <= left < scan.size - 1]
        ends += lefts
        roots += [] if lefts else [float(scan[first]), float(scan[after - 1])]
    return roots, ends


def _best_over_axis(problem: SolveProblem, target: float) -> SolveResult:
    """Find the value for which the largest distance from the target over the axis of the config is least."""
    (axis,) = problem.config.axes
    interpolant = problem.interpolant() if problem.is_smooth else None

    def largest_distance(of_values: Array) -> Array:
        """Find the largest distance over all conditions; infinite where an integration fails."""
        distances = np.abs(of_values - target)
        return np.where(np.isnan(distances).any(axis=1), np.inf, distances.max(axis=1))

    scan = problem.scan_values()
    distances = largest_distance(problem.scan(scan, target, np.zeros(0)))
    is_finite = np.isfinite(distances)
    if not is_finite.any():
        problem.raise_failure()
    scan, distances = scan[is_finite], distances[is_finite]
    candidates = []
    # the least distance is at an end of the scan, or in one of its basins
    for position in {int(distances.argmin()), *_minima(distances, distances).tolist()}:
        neighbours = float(scan[max(position - 1, 0)]), float(scan[min(position + 1, scan.size - 1)])
        refined = minimize_scalar(
            lambda x: float(largest_distance(_known(problem, interpolant, np.array([x])))[0]),
            bounds=neighbours,
            method="bounded",
            options={"xatol": 1e-12 * max(map(abs, neighbours))},
        )
        candidates.append((float(distances[position]), float(scan[position])))
        candidates.append((float(refined.fun), float(refined.x)))
    value = min(candidates)[1]
    outputs = {name: array[0] for name, array in problem.answers(np.array([value])).items()}
    over = tuple(
        {name: column[condition] for name, column in axis.columns.items()}
        | {name: float(outputs[name][condition]) for name in dict.fromkeys((problem.variable, "e_out"))}
        for condition in range(axis.size)
    )
    status: SolveStatus = "at_bound" if value in (problem.unknown.least, problem.unknown.most) else "ok"
    root = Root(value, *(float(outputs[name].mean()) for name in ("e_out", problem.variable)))
    return replace(problem.result(target, status, (root,), outputs[problem.variable]), over=over)
