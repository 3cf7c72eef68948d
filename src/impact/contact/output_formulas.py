"""Compute the outputs of collisions, in SI, that `impact.contact.variables.OUTPUTS` lists."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Unpack

import numpy as np

from ..array_types import AnyArray, Array, Int8Array, Mask
from .dimensionless import dimensionless_values
from .fixed_step import MUJOCO_CONE
from .formula_calls import argument_names
from .friction import Pair, check_friction, friction_values
from .impacts import Impacts, check_inputs
from .model import ForceModel, Law
from .powers import replace_where
from .records import CollisionResult
from .rigid import ObliqueImpacts, velocities_after
from .simulate import ComputeCollisions, Phases, Settings, simulate
from .slip_motion import SLIDES, STICKS
from .status import FIRST_FAILURE, LIMIT, NO_IMPACT, STATUS_OK
from .tangential import RecordedSlip, TangentialResult, simulate_friction
from .variables import CENTRAL_OUTPUTS

Outputs = dict[str, AnyArray]
# the tangential inputs of impacts, their tangential motion, and the kind of the friction law
Friction = tuple[ObliqueImpacts, TangentialResult, str]
InSI = Callable[[Array, Array], Array]


def outputs(
    law: Law,
    impacts: Impacts,
    result: CollisionResult,
    names: Iterable[str],
    checked: Int8Array | None = None,
    friction: Friction | None = None,
) -> Outputs:
    """Compute outputs of collisions by name; only what they need is computed.

    The result is in the contact's own units. The arrays, in SI, have shapes that broadcast to that of the impacts;
    an impact that failed has NaN. `checked` is the status by `check_inputs`, if it is already computed; `friction`
    is needed for the outputs of friction.
    """
    computed: dict[str, Any] = {"law": law, "impacts": impacts, "result": result}
    if checked is not None:
        computed["checked"] = checked
    if friction is not None:
        oblique, tangential, kind = friction
        computed |= {"friction": friction, "oblique": oblique, "tangential": tangential, "kind": kind}

    with np.errstate(all="ignore"):
        values = {name: _compute(name, computed) for name in names}
    # which of two NaN an operation passes on, with its sign, depends on the position of an element in its array
    if friction is None:
        return values
    return {
        name: replace_where(a, np.isnan(a), np.nan) if a.dtype.kind == "f" else a for name, a in values.items()
    }


def _compute(name: str, computed: dict[str, Any]) -> Any:
    """Compute an output or intermediate value by name, and add it and what it needs to `computed`."""
    if name not in computed:
        formula = FORMULAS[name]
        computed[name] = formula(*(_compute(needed, computed) for needed in argument_names(formula)))
    return computed[name]


def collide(
    law: ForceModel | Pair,
    impacts: Impacts,
    *,
    fixed_step: Mapping[str, Array] | None = None,
    errors: dict[str, str] | None = None,
    names: Iterable[str] = CENTRAL_OUTPUTS,
    oblique: ObliqueImpacts | None = None,
    compute: ComputeCollisions | None = None,
    recorded: list[Phases] | None = None,
    recorded_slip: list[RecordedSlip] | None = None,
    **settings: Unpack[Settings],
) -> Outputs:
    """Simulate impacts by a law: their `outputs`; one that fails has NaN and a status, and affects no other.

    Parameters
    ----------
    rtol : local error of a step of the integrator, relative
    max_steps : attempted steps per phase after which an impact fails
    collapse : integrate impacts that are equal in the contact's own units once; changes no bit of the results
    core : "numpy", or "numba" for the laws that it compiles; the results agree within the tolerance
    integrator : "exact", the continuous law with error control, or one of `impact.contact.fixed_step.SCHEMES`
    fixed_step : the phase and the step of a scheme by name, see `impact.contact.simulate.simulate`, of shape (n,)
    errors : receives a line for each distinct error of the law, see `impact.contact.formula_calls.describe_error`
    compute, recorded : see `impact.contact.simulate.simulate`
    recorded_slip : see `impact.contact.tangential.simulate_friction`
    oblique : the tangential inputs of the impacts, for outputs of a pair of laws; without it friction is left out
    """
    model = law.model if isinstance(law, Pair) else law
    with np.errstate(all="ignore"):
        values, checked = dimensionless_values(model, impacts), check_inputs(model, impacts)
        of_friction = friction_values(law, oblique) if isinstance(law, Pair) and oblique is not None else {}
    values |= fixed_step or {}
    columns = values | of_friction
    normal = columns if settings.get("integrator") == MUJOCO_CONE else values
    result = simulate(
        model, impacts.n, normal, checked, errors=errors, compute=compute, recorded=recorded, **settings
    )
    if oblique is None or not isinstance(law, Pair):
        return outputs(model, impacts, result, names, checked)
    with np.errstate(all="ignore"):
        status = np.where(checked == STATUS_OK, check_friction(law, oblique), checked).astype(np.int8)
    n, status, *arrays = np.broadcast_arrays(impacts.n, status, *columns.values())
    columns = dict(zip(columns, arrays, strict=True))
    tangential = simulate_friction(law, n, columns, status, errors=errors, recorded=recorded_slip, **settings)
    return outputs(model, impacts, result, names, checked, (oblique, tangential, law.friction.kind))


# ---- outputs; the arguments of each function are names of FORMULAS


def _energetic(result: CollisionResult, undefined: Mask) -> Array:
    """sqrt(-W_r/W_c), equation (3), from the integrated works; 0 where the balls stay together."""
    e = np.sqrt(np.maximum(-result.restitution_work, 0.0) / result.approach_work)
    return replace_where(replace_where(e, result.status == LIMIT, 0.0), undefined, np.nan)


def _in_domain(law: Law, impacts: Impacts, damping_ratio: Array) -> Int8Array:
    inside = np.ones((1,) * max(1, len(impacts.shape)), bool)
    for name, (low, high) in law.domain.items():
        value = damping_ratio if name == "chi" else impacts.quantity(name)
        # NaN, such as an e that is not required, is outside
        inside = inside & (value >= low) & (value <= high)
    return inside.astype(np.int8)


def _separation_time(
    law: Law, impacts: Impacts, result: CollisionResult, contact_time: Array, in_si: InSI
) -> Array:
    """Time until the surfaces separate: after the contact they move at e_out v0. NaN if they never separate."""
    if law.is_permanent:
        # a permanent indentation stays in the surfaces, which separate at the release
        return contact_time
    remaining_time = np.where(result.permanent > 0.0, result.permanent / result.e_out, 0.0)
    return in_si(result.contact_time + np.where(np.isinf(remaining_time), np.nan, remaining_time), impacts.time)


# ---- outputs of friction; G is the slip in units of mu v0 m/m_t, positive before the impact


def _share(friction: Friction, friction_status: Array, missed: Mask, name: str) -> Array:
    """G1/G0 from the "slip" of the tangential motion, or from the "exact" one.

    It is 1 where nothing changes the slip, NaN where it is not known or G0 is 0.
    """
    oblique, tangential, kind = friction
    size, after = np.abs(oblique.G0), getattr(tangential, name)
    unknown = (friction_status >= FIRST_FAILURE) | (oblique.slip == 0.0)
    if kind == "coulomb":
        # its exact value is that of the impulse
        impulse = after if name == "exact" else tangential.sliding_impulse
        after = np.maximum(size - impulse, 0.0)
    else:
        unknown = unknown | (friction_status == LIMIT)
    share = replace_where(after / size, oblique.mu == 0.0, 1.0)
    return replace_where(replace_where(share, unknown, np.nan), missed, 1.0)


def _contact_regime(friction: Friction, friction_status: Int8Array, missed: Mask, without_slip: Mask) -> Int8Array:
    """Whether the contact sticks (1), slides (2) or does both (3); 0 where that is not defined."""
    oblique, tangential, kind = friction
    regime = tangential.regime
    if kind == "coulomb":
        impulse = tangential.sliding_impulse
        regime = np.where(np.abs(oblique.G0) >= impulse, SLIDES, STICKS | SLIDES) * ~np.isnan(impulse)
    regime = replace_where(regime, oblique.mu == 0.0, SLIDES)
    regime = replace_where(regime, without_slip, STICKS)
    return np.where((friction_status >= FIRST_FAILURE) | missed, np.int8(0), regime).astype(np.int8)


def _friction_residual(friction: Friction, slip_share: Array, has_works: Mask) -> Array:
    """What the works leave of the loss, relative to the tangential energy before the impact."""
    oblique, tangential, kind = friction
    if kind == "coulomb":
        return np.where(has_works, 0.0, np.nan)
    works = tangential.slip_work + tangential.damping_work + tangential.memory_work + tangential.elastic_left
    loss = 1.0 - slip_share * slip_share
    return np.where(has_works, loss - 2.0 * works / np.square(oblique.G0), np.nan)


def _work(friction: Friction, friction_loss: Array, has_works: Mask, name: str) -> Array:
    """A work in SI, from that in units of mu^2 (m v0)^2/m_t."""
    oblique, tangential, kind = friction
    # 0 where nothing acts, NaN where the slip is not known
    without = 0.0 * friction_loss
    if kind == "coulomb":
        return friction_loss if name == "slip_work" else without
    unit = np.square(oblique.mu * oblique.impacts.m * oblique.impacts.v0) / oblique.m_t
    return np.where(has_works, getattr(tangential, name) * unit, without)


# formulas by the names of their values; their arguments are names of this dict, or law, impacts and result, and of
# those of friction also friction as a whole, oblique, tangential and kind
FORMULAS: dict[str, Callable[..., Any]] = {
    "checked": lambda law, impacts: check_inputs(law, impacts),
    "not_integrated": lambda checked: checked != STATUS_OK,
    "missed": lambda checked: checked == NO_IMPACT,
    "failed": lambda status: status >= FIRST_FAILURE,
    # impacts without a result
    "undefined": lambda missed, failed: missed | failed,
    # NaN where the required restitution is not within [0, 1]
    "asked_e": lambda impacts: replace_where(impacts.e, ~((impacts.e >= 0.0) & (impacts.e <= 1.0)), np.nan),
    # converts (values, unit) to SI: NaN where the impact failed, 0 where the balls miss each other
    "in_si": lambda failed, missed: (
        lambda value, unit: replace_where(replace_where(value * unit, failed, np.nan), missed, 0.0)
    ),
    "velocities": lambda impacts, e_out: velocities_after(impacts, e_out),
    "references": lambda impacts, asked_e: velocities_after(impacts, asked_e),
    "v1_post": lambda velocities: velocities[0],
    "v2_post": lambda velocities: velocities[1],
    "v1_reference": lambda references: references[0],
    "v2_reference": lambda references: references[1],
    "v1_error": lambda v1_post, v1_reference: v1_post - v1_reference,
    "v2_error": lambda v2_post, v2_reference: v2_post - v2_reference,
    "e_out": lambda result, undefined: replace_where(result.e_out, undefined, np.nan),
    "e_error": lambda e_out, asked_e: e_out - asked_e,
    "peak_indentation": lambda result, impacts, in_si: in_si(result.peak, impacts.length),
    "permanent_indentation": lambda result, impacts, in_si: in_si(result.permanent, impacts.length),
    "peak_force": lambda result, impacts, in_si: in_si(result.force, impacts.energy / impacts.length),
    "contact_time": lambda result, impacts, in_si: in_si(result.contact_time, impacts.time),
    "energy_loss": lambda result, impacts, in_si: in_si(1.0 - result.e_out * result.e_out, 0.5 * impacts.energy),
    "stiffness": lambda impacts, failed: replace_where(impacts.K, failed, np.nan),
    "damping_ratio": lambda result, not_integrated: replace_where(
        replace_where(result.chi, not_integrated, np.nan), np.isinf(result.chi), np.nan
    ),
    "energy_residual": lambda result, undefined: replace_where(
        result.approach_work + result.restitution_work - (1.0 - result.e_out * result.e_out), undefined, np.nan
    ),
    "closed_form_error": lambda e_out, result: e_out - result.exact,
    "status": lambda result, not_integrated, checked: replace_where(result.status, not_integrated, checked),
    "in_domain": _in_domain,
    "steps": lambda result, not_integrated: replace_where(result.steps, not_integrated, np.int32(0)),
    # tau_r/tau_c, equation (2): the phases change the momentum by m v0 and by e_out m v0
    "e_kinetic": lambda e_out: e_out,
    "e_energetic": _energetic,
    # lambda = chi K/v0 [N s/m^(n+1)]
    "lambda": lambda damping_ratio, stiffness, impacts: damping_ratio * stiffness / impacts.v0,
    "separation_time": _separation_time,
    # of friction
    # that of the normal motion where the tangential motion has none of its own
    "friction_status": lambda tangential, status, not_integrated: replace_where(
        replace_where(tangential.status, tangential.status == STATUS_OK, status), not_integrated, status
    ),
    "slip_share": partial(_share, name="slip"),
    "exact_share": partial(_share, name="exact"),
    # impacts that have an answer and no slip before it
    "without_slip": lambda oblique, friction_status: (oblique.slip == 0.0) & (friction_status < FIRST_FAILURE),
    # P [N s]
    "impulse": lambda oblique, slip_share, without_slip, missed: replace_where(
        oblique.m_t * oblique.slip * (1.0 - slip_share), without_slip | missed, 0.0
    ),
    # impacts with a slip, friction and a complete tangential motion
    "has_works": lambda slip_share, oblique, missed: np.isfinite(slip_share) & (oblique.mu > 0.0) & ~missed,
    "u1_post": lambda oblique, impulse: oblique.u1 - impulse / oblique.impacts.m1,
    "u2_post": lambda oblique, impulse: oblique.u2 + impulse / oblique.impacts.m2,
    "omega1_post": lambda oblique, impulse: oblique.spin_after("1", impulse),
    "omega2_post": lambda oblique, impulse: oblique.spin_after("2", impulse),
    "slip_post": lambda oblique, impulse: oblique.slip - impulse / oblique.m_t,
    # 0 rather than -0 where the contact sticks
    "beta": lambda slip_share, missed: replace_where(0.0 - slip_share, missed, np.nan),
    "e_t": lambda oblique, u1_post, u2_post: np.where(
        oblique.u1 == oblique.u2, np.nan, (u1_post - u2_post) / (oblique.u1 - oblique.u2)
    ),
    "rebound_angle": lambda u1_post, u2_post, e_out, impacts: np.arctan2(u1_post - u2_post, e_out * impacts.v0),
    "impulse_ratio": lambda impulse, e_out, impacts: impulse / ((1.0 + e_out) * impacts.m * impacts.v0),
    # m_t of two walls is infinite
    "friction_loss": lambda oblique, slip_post, missed: replace_where(
        0.5 * oblique.m_t * (oblique.slip**2 - slip_post**2), missed, 0.0
    ),
    "contact_regime": _contact_regime,
    "friction_residual": _friction_residual,
    "beta_error": lambda beta, exact_share: beta + exact_share,
    "slip_work": partial(_work, name="slip_work"),
    "tangential_damping_work": partial(_work, name="damping_work"),
    "memory_work": partial(_work, name="memory_work"),
    "elastic_left": partial(_work, name="elastic_left"),
    "psi1": lambda tangential, oblique, has_works: np.where(has_works, tangential.stiffness * oblique.G0, np.nan),
    "psi2": lambda psi1, slip_share: psi1 * slip_share,
    "slip_changes": lambda tangential, kind, contact_regime: (
        (contact_regime == STICKS | SLIDES).astype(np.int32)
        if kind == "coulomb"
        else np.where(contact_regime == 0, np.int32(0), tangential.slip_changes)
    ),
}
