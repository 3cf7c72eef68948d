"""Problems with known answers: initial value problems for the integrator, and the impact of the paper's Table 1.

Every initial value problem carries the time as its first quadrature, so that a state can be compared with the
exact solution at its own time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import mpmath as mp
import numpy as np
import pytest

from impact.contact.closed_forms.hysteresis import approach_damped_restitution
from impact.contact.impacts import Impacts, stiffness
from impact.contact.materials import effective_mass, hertz_stiffness, sphere_radius
from impact.contact.model import ForceModel
from impact.contact.models import catalogue
from impact.ode.problem import Problem


def contact_time_ratio(n: float) -> float:
    """Contact time without damping over δₘ/v₀: 2 √π Γ(1 + 1/(n+1))/Γ(1/2 + 1/(n+1))."""
    q = 1.0 / (n + 1.0)
    return 2.0 * math.sqrt(math.pi) * math.gamma(1.0 + q) / math.gamma(0.5 + q)


def damped_peak_indentation(chi, n: float):
    """Peak indentation of F = K δⁿ (1 + χ δ̇/v₀) in units of (m v₀²/K)^(1/(n+1)).

    The elastic work up to the peak, xₘ^(n+1)/(n+1), is half the square of the restitution without damping on
    restitution.
    """
    return np.power((n + 1.0) * 0.5 * np.square(approach_damped_restitution(chi)), 1.0 / (n + 1.0))


@dataclass(frozen=True)
class SolvedProblem:
    """An initial value problem of one trajectory and its exact solution.

    `exact` gives the two components at a time; `event_time` is the time of the event, `quadrature` the second
    quadrature there, `maximum` the largest value of the watched product of the components.
    """

    name: str
    problem: Problem
    initial_state: tuple[float, float]
    exact: Callable[[float], tuple[float, float]]
    event_time: float
    quadrature: float
    maximum: float

    def __str__(self) -> str:
        return self.name


def _rates(acceleration, quadrature):
    """Rates of y0' = y1, y1' = acceleration(y0, y1), time and another quadrature; y0 y1 is watched."""

    def rates(y, params, out=None):
        time_rate = np.ones_like(y[0])
        return np.array([y[1], acceleration(*y, *params), time_rate, quadrature(*y), y[0] * y[1]])

    return rates


def _ends_below(level: float):
    """The event: y1 falls below a level; a trajectory whose y0 is huge cannot reach it."""
    return {
        "event": lambda y, k, params: (y[1] - level, k[1]),
        "unreachable": lambda y, k, params: y[0] > 1e6,
        "floor": (1.0, 1.0),
        "watch": True,
    }


# y'' = −y from rest length: sin and cos over a quarter of a period
OSCILLATOR = SolvedProblem(
    "oscillator",
    Problem(_rates(lambda a, b: -a, lambda a, b: a * b), **_ends_below(0.0)),
    initial_state=(0.0, 1.0),
    exact=lambda t: (math.sin(t), math.cos(t)),
    event_time=math.pi / 2,
    quadrature=0.5,
    maximum=0.5,
)
# y'' = −2 y y': tanh and sech², until sech² = 1/2
TANH = SolvedProblem(
    "tanh",
    Problem(_rates(lambda a, b: -2.0 * a * b, lambda a, b: a), **_ends_below(0.5)),
    initial_state=(0.0, 1.0),
    exact=lambda t: (math.tanh(t), 1.0 / math.cosh(t) ** 2),
    event_time=math.atanh(math.sqrt(0.5)),
    quadrature=0.5 * math.log(2.0),
    maximum=2.0 / 27.0**0.5,
)
# y'' = −y'²: a logarithm and its derivative, until the derivative is 1/4
LOGARITHM = SolvedProblem(
    "logarithm",
    Problem(_rates(lambda a, b: -b * b, lambda a, b: b * b), **_ends_below(0.25)),
    initial_state=(0.0, 1.0),
    exact=lambda t: (math.log1p(t), 1.0 / (1.0 + t)),
    event_time=3.0,
    quadrature=0.75,
    maximum=1.0 / math.e,
)
PROBLEMS = (OSCILLATOR, TANH, LOGARITHM)

# y'' = −k y − c y' + q y'², with parameters k, c and q: a trajectory ends late (small k), never reaches the event
# (k <= 0), creeps without an end (large c), diverges (q = 1, at time 1) or has a rate that is not a number
SPRINGS = Problem(
    _rates(lambda a, b, k, c, q: -k * a - c * b + q * b * b, lambda a, b: a * b),
    **_ends_below(0.0),
)


# the laws of the catalogue, without further names of the same law
LAWS = [key for key, model in catalogue().items() if not model.same_as]


def _form(model: ForceModel) -> tuple[object, ...]:
    """What decides how a law is integrated: its branches, its release and its velocity coordinate."""
    is_permanent = model.residual is not None or model.recovered is not None
    return (model.unloading is not None, is_permanent, model.release, model.velocity_coordinate)


def _each_law() -> Iterator[object]:
    """A test parameter for each law; laws of codes and further laws of the same form are slow tests."""
    forms = set()
    for key in LAWS:
        model = catalogue()[key]
        repeated = model.family == "codes" or _form(model) in forms
        forms.add(_form(model))
        yield pytest.param(key, marks=pytest.mark.slow) if repeated else key


EACH_LAW = list(_each_law())


def table1_impacts(n: float = 1.5, **changes: object) -> Impacts:
    """Impacts of the balls of Table 1 at e = 0.5, with changes by name; values that vary are arrays.

    The balls are of 1 kg, E = 56 GPa, nu = 0.3 and 2712 kg/m3, the first at 1 m/s and the second at rest.
    `parameters` are those of the law, by name.
    """
    law_parameters = changes.pop("parameters", {})
    table_1 = {"e": 0.5, "v1": 1.0, "v2": 0.0, "m1": 1.0, "m2": 1.0, "E1": 56e9, "E2": 56e9}
    inputs = table_1 | changes
    arrays = [
        np.atleast_1d(np.array(value, float))
        for value in np.broadcast_arrays(*inputs.values(), *law_parameters.values())
    ]
    values = dict(zip(inputs, arrays, strict=False))
    parameters = dict(zip(law_parameters, arrays[len(inputs) :], strict=True))
    poisson, strength, density, exponent = (np.full_like(values["e"], value) for value in (0.3, 3e8, 2712.0, n))
    for ball in "12":
        values.setdefault(f"R{ball}", sphere_radius(values[f"m{ball}"], density))
    # of two planes, or at a speed whose square overflows, there is no stiffness
    with np.errstate(all="ignore"):
        hertz = hertz_stiffness(values["E1"], poisson, values["E2"], poisson, values["R1"], values["R2"])
        mass = effective_mass(values["m1"], values["m2"])
        values.setdefault("K", stiffness(exponent, hertz, mass, values["v1"] - values["v2"]))
    return Impacts(
        **values,
        n=exponent,
        nu1=poisson,
        nu2=poisson,
        yield_strength1=strength,
        yield_strength2=strength,
        parameters=parameters,
    )


def with_parameters(model: ForceModel, impacts: Impacts, value: object) -> Impacts:
    """The impacts with parameters of the law, each above its least by a value in the contact's own units.

    A parameter with a typical value becomes that value times `value`.
    """
    ones = np.ones(len(impacts))
    pure = {
        parameter.name: max(parameter.least, 0.0) + value * ones
        for parameter in model.parameters
        if parameter.unit == "1"
    }
    typical = {
        parameter.name: parameter.typical * value * ones
        for parameter in model.parameters
        if parameter.typical is not None
    }
    others = [
        parameter.name for parameter in model.parameters if parameter.unit != "1" and parameter.typical is None
    ]
    # exponents of the units of the others may be parameters without a unit
    unit = replace(impacts, parameters={parameter.name: ones for parameter in model.parameters} | pure)
    scaled = {name: value / unit.dimensionless(model, name) for name in others}
    return replace(impacts, parameters=pure | typical | scaled)


def hysteresis_reference(chi: float, n: float) -> tuple[float, float, float]:
    """Restitution, time and peak force of F = xⁿ (1 + χ v) with m = v₀ = 1, to 15 digits.

    With w = ln(1 + χ v)/χ the motion is dw/dt = −xⁿ, so that x^(n+1)/(n+1) = G(w₀) − G(w) with G(w) =
    (exp(χ w) − 1 − χ w)/χ², where w goes from w₀ = ln(1 + χ)/χ to the other root of G(w) = G(w₀), w₀ − 1 − e.
    """
    with mp.workdps(30):
        chi, n = mp.mpf(chi), mp.mpf(n)
        a = 1 + chi
        b = -mp.lambertw(-a * mp.exp(-a)).real
        e_out = (1 - b) / chi

        # x^(n+1)/(n+1) at a distance from either end, where exp(χ w) is a and b: no digits are lost there
        def after_start(d):
            return (-a * mp.expm1(-chi * d) - chi * d) / chi**2

        def before_end(d):
            return (chi * d - b * mp.expm1(chi * d)) / chi**2

        # dw/xⁿ with w = zⁿ⁺¹ from an end, in which the rate is smooth: half the way from each
        time, half = mp.mpf(0), ((1 + e_out) / 2) ** (1 / (n + 1))
        for work in (after_start, before_end):

            def rate(z, work=work):
                d = z ** (n + 1)
                return (n + 1) * (d / ((n + 1) * work(d))) ** (n / (n + 1))

            time += mp.quad(rate, [0, half])

        # the force xⁿ exp(χ w) is stationary where n (exp(χ w) − 1) = χ xⁿ⁺¹, and v > 0 there
        low, high = mp.mpf(0), mp.log(a) / chi
        for _ in range(100):
            d = (low + high) / 2
            early = chi**2 * (n + 1) * after_start(d) < n * (a * mp.exp(-chi * d) - 1)
            low, high = (d, high) if early else (low, d)
        force = ((n + 1) * after_start(low)) ** (n / (n + 1)) * a * mp.exp(-chi * low)
        return float(e_out), float(time), float(force)
