"""Random oblique impacts by every friction law, for the reference solver and for `simulate_friction`.

The numbers of a friction law are computed here in SI, from the sources, and then brought into the contact's own
units: what `friction_values` computes is tested, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from impact.contact.dimensionless import dimensionless_values
from impact.contact.friction import Pair, check_friction, friction_values
from impact.contact.frictions import find_friction
from impact.contact.impacts import Impacts, check_inputs
from impact.contact.models import find
from impact.contact.rigid import ObliqueImpacts
from impact.contact.status import FrictionStatus
from impact.contact.tangential import TangentialResult, simulate_friction

from .friction_reference import Friction, Outcome, normal_law, solve

HOOKE = (
    "lammps-coeff-restitution-hooke",
    "anagnostopoulos-1988-no-tension",
    "kelvin-voigt",
    "gharib-hurmuzlu-2012",
)
# laws without the form x^n + C x^q v, with an unloading branch
UNLOADING = ("bilinear", "luding-2008", "pant-wijeyewickrema-2012", "kelvin-voigt-hysteretic")
HERTZIAN = (
    "hertz",
    "tsuji-1992",
    "lammps-coeff-restitution-hertz-limit",
    "hunt-crossley-1975",
    "kuwabara-kono-1987",
    "lee-herrmann-1993",
)
# laws with a permanent indentation, above which s is on restitution
PERMANENT = ("lankarani-nikravesh-1994",)
LAMMPS_MEMORY = {
    "lammps-mindlin": (1.0, 1.0),
    "lammps-mindlin-force": (0.0, 0.0),
    "lammps-mindlin-rescale": (1.0, 2.0),
    "lammps-mindlin-rescale-force": (0.0, 1.0),
}
# the models that each law is combined with
COMBINATIONS = {
    "coulomb-1785": (*HOOKE, *UNLOADING, *HERTZIAN),
    "cundall-strack-1979": (*HOOKE, *UNLOADING, *HERTZIAN),
    "yade-cundall-strack": (*HOOKE, *UNLOADING, *HERTZIAN),
    "lammps-linear-history": (*HOOKE, *HERTZIAN),
    **dict.fromkeys(LAMMPS_MEMORY, (*HERTZIAN, *PERMANENT)),
    "lammps-linear-nohistory": (*HOOKE, *HERTZIAN),
    "liggghts-history": (*HOOKE, *HERTZIAN),
    "liggghts-no-history": (*HOOKE, *HERTZIAN),
    "yade-mindlin": (*HERTZIAN, *PERMANENT),
    "yade-viscoelastic": (*HOOKE, *UNLOADING, *HERTZIAN),
    "drake-regularized": (*HOOKE, *HERTZIAN),
    "simbody-hunt-crossley": (*HOOKE, *UNLOADING, *HERTZIAN),
}
WITH_STIFFNESS = ("cundall-strack-1979", "yade-cundall-strack", "lammps-linear-history", "yade-viscoelastic")
# parameters of the models, by name: least and largest value, of the logarithm; in the contact's own units
MODEL_PARAMETERS = {
    "kelvin-voigt": {"C": (-2.0, 0.0)},
    "kuwabara-kono-1987": {"A": (-2.0, -0.3)},
    "lee-herrmann-1993": {"gamma": (-2.0, 0.0)},
    "luding-2008": {"k2": (0.1, 1.0), "phi": (-2.0, -0.5)},
}


@dataclass(frozen=True)
class Batch:
    """Random impacts by one pair; with the numbers that the reference solver needs, by impact."""

    pair: Pair
    n: float
    oblique: ObliqueImpacts
    friction: list[Friction]
    g0: list[float]

    def values(self) -> dict[str, np.ndarray]:
        count = len(self.g0)
        values = dimensionless_values(self.pair.model, self.oblique.impacts)
        values.update(friction_values(self.pair, self.oblique))
        return {name: np.array(np.broadcast_to(value, count)) for name, value in values.items()}

    def simulate(self, rtol: float) -> TangentialResult:
        impacts = self.oblique.impacts
        status = np.array(np.broadcast_to(check_inputs(self.pair.model, impacts), len(self.g0)))
        of_friction = np.broadcast_to(check_friction(self.pair, self.oblique), len(self.g0))
        status = np.where(of_friction != FrictionStatus.OK, of_friction, status).astype(np.int8)
        return simulate_friction(self.pair, impacts.n, self.values(), status, rtol=rtol, max_steps=1_000)

    def reference(self, row: int) -> Outcome:
        """The trajectory of an impact by the reference solver."""
        values = dimensionless_values(self.pair.model, self.oblique.impacts)
        normal = normal_law(self.pair.model, self.n, {name: float(value[row]) for name, value in values.items()})
        return solve(normal, self.friction[row], self.g0[row])

    def describe(self, row: int) -> str:
        """The case in a line that a person can type in again."""
        friction, e = self.friction[row], float(self.oblique.impacts.e[row])
        values = dimensionless_values(self.pair.model, self.oblique.impacts)
        of_model = {name: float(value[row]) for name, value in values.items()}
        return f"{self.pair.key}: n={self.n} e={e!r} {of_model} g0={self.g0[row]!r} {friction}"


def random_batches(key: str, count: int, seed: int) -> Iterator[Batch]:
    """About `count` random impacts by a friction law, some by each of several contact force models."""
    models = COMBINATIONS[key]
    for number, model_key in enumerate(models):
        random = np.random.default_rng([seed, number, *key.encode()])
        model = find(model_key)
        n = model.exponent or (1.0 if model_key in HOOKE else 1.5)
        yield random_batch(key, model_key, n, -(-count // len(models)), random)


def random_batch(key: str, model_key: str, n: float, count: int, random: np.random.Generator) -> Batch:
    pair = Pair(find(model_key), find_friction(key))

    def log_uniform(low: float, high: float) -> np.ndarray:
        return 10.0 ** random.uniform(low, high, count)

    # e = 1 now and then, and a wall, a plane or a ball that does not turn
    e = np.where(random.random(count) < 0.15, 1.0, random.uniform(0.15, 1.0, count))
    m1, m2, r1, r2 = log_uniform(-2, 0), log_uniform(-2, 0), log_uniform(-3, -1), log_uniform(-3, -1)
    is_wall = random.random(count) < 0.3
    m2, r2 = np.where(is_wall, np.inf, m2), np.where(is_wall, np.inf, r2)
    q1, q2 = random.choice([0.4, 2.0 / 3.0, 0.5, np.inf], count), random.choice([0.4, 2.0 / 3.0, 0.25], count)
    young, poisson = log_uniform(7, 11), random.uniform(0.0, 0.49, (2, count))
    young2 = log_uniform(7, 11)
    v0, mu = log_uniform(-1, 1), log_uniform(-1.3, 0.0)
    m = np.where(is_wall, m1, m1 * m2 / np.where(is_wall, 1.0, m1 + m2))
    r_eff = 1.0 / (1.0 / r1 + 1.0 / r2)
    e_eff = 1.0 / ((1.0 - poisson[0] ** 2) / young + (1.0 - poisson[1] ** 2) / young2)
    stiffness = 4.0 / 3.0 * e_eff * np.sqrt(r_eff) if n == 1.5 else log_uniform(3, 7)
    length = (m * v0**2 / stiffness) ** (1.0 / (n + 1.0))

    # g0/v0 from 0.05 to 5 times that which friction of mu can stop
    turn = 1.0 + 1.0 / q1, np.where(is_wall, 1.0, 1.0 + 1.0 / q2)
    m_t = 1.0 / (turn[0] / m1 + turn[1] / m2)
    slip = log_uniform(-1.3, 0.5) * 2.0 * mu * m / m_t * v0 * random.choice([-1.0, 1.0], count)
    omega1, u2 = random.normal(0.0, 1.0, count) * v0 / r1, random.normal(0.0, 1.0, count) * v0
    omega2 = np.where(is_wall, 0.0, random.normal(0.0, 1.0, count) * v0 / r2)
    rim2 = np.where(is_wall, 0.0, np.where(is_wall, 1.0, r2) * omega2)
    u1 = slip + u2 - r1 * omega1 - rim2

    limit = random.integers(0, 2, count).astype(float)
    parameters: dict[str, np.ndarray] = {"limit": limit}
    in_own_units, law_parameters = friction_numbers(key, model_key, n, random, count, e=e, mu=mu)
    parameters.update(law_parameters)
    if "k_t" in parameters:
        # N/m
        parameters["k_t"] = in_own_units["k_t"] * stiffness * length ** (n - 1.0)
    if "c_t" in parameters:
        parameters["c_t"] = in_own_units["c_t"] * m * v0 / length
    if "mu_v" in parameters:
        parameters["mu_v"] = in_own_units["mu_v"] / v0
    for name in ("v_s", "v_t"):
        if name in parameters:
            parameters[name] = in_own_units[name] * v0

    # parameters of the contact force, from the contact's own units
    scale = {"C": m * v0 / length, "A": length / v0, "gamma": v0 / length, "k2": 1.0, "phi": length / r_eff}
    of_model = {
        name: log_uniform(*ends) * scale[name] * np.ones(count)
        for name, ends in MODEL_PARAMETERS.get(model_key, {}).items()
    }
    if model_key == "luding-2008":
        of_model["kc"] = np.zeros(count)
    impacts = Impacts(
        e=e, v1=v0, v2=np.zeros(count), m1=m1, m2=m2, R1=r1, R2=r2, K=stiffness, n=np.full(count, n),
        E1=young, E2=young2, nu1=poisson[0], nu2=poisson[1],
        yield_strength1=np.full(count, 1e8), yield_strength2=np.full(count, 1e8), parameters=of_model,
    )  # fmt: skip
    oblique = ObliqueImpacts(impacts, u1, u2, omega1, omega2, q1, q2, mu, parameters=parameters)
    g_eff = 1.0 / sum(
        2.0 * (1.0 + nu) * (2.0 - nu) / modulus
        for nu, modulus in ((poisson[0], young), (poisson[1], young2))
    )  # fmt: skip
    rows = []
    for row in range(count):
        chosen = {name: float(value[row]) for name, value in {**in_own_units, **law_parameters}.items()}
        if "mu_v" in chosen:
            chosen["mu_v"] = float(in_own_units["mu_v"][row])
        # 8 G* a, per sqrt(x), in the contact's own units
        mindlin = float(8.0 * g_eff[row] * math.sqrt(r_eff[row]) / stiffness[row])
        normal = normal_law(pair.model, n, at_row(pair, impacts, row))
        rows.append(
            reference_friction(
                key, n, chosen, float(e[row]), float(mu[row]), float(m_t[row] / m[row]), mindlin, normal.damping
            )
        )
    friction = [
        Friction(**{**numbers, "positive": bool(positive)}) for numbers, positive in zip(rows, limit, strict=True)
    ]
    return Batch(pair, n, oblique, friction, [float(abs(g)) for g in slip / v0])


def at_row(pair: Pair, impacts: Impacts, row: int) -> dict[str, float]:
    values = dimensionless_values(pair.model, impacts)
    return {name: float(value[row]) for name, value in values.items()}


def friction_numbers(
    key: str, model_key: str, n: float, random: np.random.Generator, count: int, *, e: np.ndarray, mu: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Random parameters of a friction law: those in the contact's own units, and all that it is given."""
    own: dict[str, np.ndarray] = {}
    given: dict[str, np.ndarray] = {}
    ratio = 10.0 ** random.uniform(-0.7, 0.7, count)
    if key in WITH_STIFFNESS:
        if n == 1.0 and random.random() < 0.5:
            given["kt_over_kn"] = ratio
        else:
            own["k_t"] = given["k_t"] = ratio
    elif (key in LAMMPS_MEMORY or key in ("yade-mindlin", "liggghts-history")) and (
        # 8 G* a is of an elastic contact
        random.random() < 0.4 or model_key in PERMANENT
    ):
        given["kt_over_kn"] = ratio
    if key.startswith("lammps"):
        given["xt"] = random.choice([0.0, 0.5, 1.0, 2.0], count) * random.uniform(0.5, 1.0, count)
        # of a dashpot that the contact force does not have
        given["xt"] *= model_key not in PERMANENT
    if key == "yade-mindlin":
        if random.random() < 0.5:
            given["betas"] = random.uniform(0.0, 0.5, count)
    elif key == "yade-viscoelastic":
        own["c_t"] = given["c_t"] = 10.0 ** random.uniform(-2.0, 0.5, count)
    elif key.startswith("liggghts"):
        given["tangential_damping"] = random.integers(0, 2, count).astype(float)
        if key == "liggghts-history":
            given["tangential_reduce"] = random.integers(0, 2, count).astype(float)
    elif key == "drake-regularized":
        own["v_s"] = given["v_s"] = 10.0 ** random.uniform(-2.0, 0.0, count)
        given["mu_d"] = mu * random.uniform(0.5, 1.0, count)
    elif key == "simbody-hunt-crossley":
        own["v_t"] = given["v_t"] = 10.0 ** random.uniform(-2.0, 0.0, count)
        given["mu_d"] = mu * random.uniform(0.5, 1.0, count)
        own["mu_v"] = given["mu_v"] = random.uniform(0.0, 0.3, count)
    return own, given


def reference_friction(
    key: str, n: float, chosen: dict[str, float], e: float, mu: float, m_t: float, mindlin: float,
    damping: tuple[float, float] | None,
) -> dict[str, object]:  # fmt: skip
    """The numbers of a friction law in the contact's own units, as its source has them."""
    numbers: dict[str, object] = {"kind": "spring", "mu": mu, "m_t": m_t}
    loss = -math.log(e) / math.hypot(math.pi, math.log(e))
    ratio = chosen.get("kt_over_kn")
    if key == "coulomb-1785":
        return {**numbers, "kind": "coulomb"}
    if key in WITH_STIFFNESS:
        numbers["k_t"] = chosen["k_t"] if ratio is None else ratio * n
    elif key in LAMMPS_MEMORY or key == "yade-mindlin" or (key.startswith("liggghts") and n == 1.5):
        numbers |= {"k_t": mindlin if ratio is None else 1.5 * ratio, "kp": 0.5}
    elif key.startswith("liggghts"):
        reduced = 2.0 / 7.0 if chosen.get("tangential_reduce") else 1.0
        numbers["k_t"] = reduced if ratio is None else ratio
    numbers["memory"] = LAMMPS_MEMORY.get(key, (1.0, 1.0) if key == "liggghts-history" else (0.0, 0.0))
    if key in ("liggghts-history", "yade-mindlin", "yade-viscoelastic"):
        numbers["cap"] = "spring"
    if key.startswith("lammps"):
        c, q = damping or (0.0, 0.0)
        numbers |= {"c_t": chosen["xt"] * c, "q": q}
    elif key.startswith("liggghts") and n == 1.5:
        c = 2.0 * math.sqrt(5.0 / 6.0) * loss * math.sqrt(numbers["k_t"])
        numbers |= {"c_t": chosen["tangential_damping"] * c, "q": 0.25}
    elif key.startswith("liggghts"):
        numbers |= {"c_t": chosen["tangential_damping"] * damping[0], "q": damping[1]}
    elif key == "yade-mindlin":
        numbers |= {"c_t": 2.0 * chosen.get("betas", loss) * math.sqrt(numbers["k_t"]), "q": 0.25}
    elif key == "yade-viscoelastic":
        numbers["c_t"] = chosen["c_t"]
    if key in ("lammps-linear-nohistory", "liggghts-no-history"):
        numbers["kind"] = "dashpot"
    if key == "drake-regularized":
        numbers |= {"kind": "regularized", "coefficient": stribeck(mu, chosen["mu_d"], chosen["v_s"])}
    if key == "simbody-hunt-crossley":
        curve = simbody(mu, chosen["mu_d"], chosen["mu_v"], chosen["v_t"])
        numbers |= {"kind": "regularized", "coefficient": curve}
    return numbers


def stribeck(mu_s: float, mu_d: float, v_s: float):
    """Drake's coefficient of friction."""

    def step(t: float) -> float:
        return t**3 * (10.0 - 15.0 * t + 6.0 * t * t)

    def coefficient(g: float) -> float:
        y = g / v_s
        if y < 1.0:
            return mu_s * step(y)
        return mu_s - (mu_s - mu_d) * step((y - 1.0) / 2.0) if y < 3.0 else mu_d

    return coefficient


def simbody(mu_s: float, mu_d: float, mu_v: float, v_t: float):
    """Simbody's coefficient of friction."""

    def coefficient(g: float) -> float:
        y = g / v_t
        return min(y, 1.0) * (mu_d + 2.0 * (mu_s - mu_d) / (1.0 + y * y)) + mu_v * g

    return coefficient
