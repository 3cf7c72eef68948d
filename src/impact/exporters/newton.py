"""Newton, SolverSemiImplicit."""

from __future__ import annotations

import math

from ..formatting import number
from .code import Code, Collision, Lines, Parameters, keyword_arguments
from .programs import python_package

# of single precision
RESOLUTION = 2.0**-23
# the normal is along x, the tangent along y, so that spins are about z
TEMPLATE = """\
import newton
import warp as wp

wp.set_device("cpu")
{{ lines }}
# the masses are those of the bodies
contact.density = 0
builder = newton.ModelBuilder(gravity=(0, 0, 0))
{% if has_friction %}
for m, R, x, y in {{ tuples("m", "R", "x", "y") }}:
{% else %}
for m, R, x in {{ tuples("m", "R", "x") }}:
{% endif %}
    moment = {{ solid }} * m * R**2
    inertia = wp.mat33(moment, 0, 0, 0, moment, 0, 0, 0, moment)
{% set y = "y" if has_friction else "0" %}
    body = builder.add_body(xform=wp.transform((x, {{ y }}, 0), wp.quat_identity()), mass=m, inertia=inertia)
    builder.add_shape_sphere(body, radius=R, cfg=contact)
{% if has_wall %}
builder.add_shape_plane((-1.0, 0.0, 0.0, 0.0), width=0, length=0, cfg=contact)
{% endif %}
model = builder.finalize()
solver = newton.solvers.SolverSemiImplicit(model)
state, following, control = model.state(), model.state(), model.control()
{% set second = "" if has_wall else ", (" ~ [v2, u2, 0, 0, 0, omega2] | join(", ") ~ ")" %}
state.body_qd.assign([({{ v1 }}, {{ u1 }}, 0, 0, 0, {{ omega1 }}){{ second }}])
pipeline = newton.CollisionPipeline(model)
contacts = pipeline.contacts()
for _ in range({{ steps }}):
    state.clear_forces()
    pipeline.collide(state, contacts)
    solver.step(state, following, control, contacts, dt)
    state, following = following, state
{% if has_friction and has_wall %}
(v1, u1, *_, omega1), v2, u2, omega2 = state.body_qd.numpy()[0].tolist(), {{ v2 }}, {{ u2 }}, 0.0
{% elif has_friction %}
(v1, u1, *_, omega1), (v2, u2, *_, omega2) = state.body_qd.numpy().tolist()
{% elif has_wall %}
v1, v2 = float(state.body_qd.numpy()[0, 0]), {{ v2 }}
{% else %}
v1, v2 = (float(speed[0]) for speed in state.body_qd.numpy())
{% endif %}
{{ print_beta }}print("e_out =", (v2 - v1) / {{ v0 }})
"""


def parameters(c: Collision) -> dict[str, float | str]:
    """Write the attributes of ShapeConfig, the same for both shapes."""
    normal = {"ke": c["K"], "kd": c["kd"]}
    if not c.friction:
        return {**normal}
    # a plane does not turn
    turns = {ball: 1.0 / c[f"inertia_factor{ball}"] if math.isfinite(c[f"R{ball}"]) else 0.0 for ball in "12"}
    slip_per_impulse = sum((1.0 + turns[ball]) / c[f"m{ball}"] for ball in "12")
    # the friction kf g, if it is within mu N, stops the slip in one step
    return {**normal, "kf": 1.0 / (slip_per_impulse * c.dt), "mu": c["mu"]}


def lines(collision: Collision, parameters: Parameters) -> Lines:
    values, smooth = keyword_arguments(parameters), "" if collision.friction else ", mu=0"
    return [f"contact = newton.ModelBuilder.ShapeConfig({values}{smooth})", f"dt = {collision.dt!r}"]


def notes(c: Collision) -> Lines:
    # the spacing of coordinates near a radius, over the peak indentation of the undamped spring
    share = RESOLUTION * c.largest_radius / (c["v0"] * math.sqrt(c["m"] / c["K"]))
    yield "in SI, the same for both shapes: ke and kd of a contact are the means, not those of springs in series"
    yield (
        "kd acts on approach only; the restitution depends on kd/(2 sqrt(ke m)), thus on the masses, not on speed"
    )
    yield "unset, ke is 2500 N/m, kd 100 N s/m and mu 1; a margin above 0 begins the contact earlier"
    yield "restitution is ignored here; SolverXPBD has it with enable_restitution=True, which is not its default"
    yield "SolverFeatherstone has the same contact force; other solvers make other forces of ke and kd"
    yield f"single precision: the indentation is resolved to {number(share, 2)} of its peak, and e about as well"
    if c.friction:
        yield "friction is min(kf g, mu N) with the slip g; with kf = m_t/dt, m_t 2/7 of the effective mass,"
        yield "it is Coulomb's: at 40 degrees, mu = 0.3, 12 steps a 27th of it left 0.65 of the slip, 1.8 times"
        yield "it reversed 0.014 of it; it depends on dt and the masses; unset, kf is 1000 N s/m"
    else:
        yield "no friction: replace mu by yours"


CODE = Code(
    title="Newton, SolverSemiImplicit",
    laws={"newton-semi-implicit": "ke and kd of ShapeConfig"},
    newest="1.8.0",
    tested="scripts were run in Newton 1.8.0 on a CPU; warp.sim has the same force and was not run",
    scheme="kick-drift",
    # single precision, of a ball up to 800 times as large as its indentation
    uncertainty={"newton-semi-implicit": 1e-3},
    resolution=RESOLUTION,
    parameters=parameters,
    lines=lines,
    notes=notes,
    template=TEMPLATE,
    frictions={"coulomb-1785": "kf and mu of ShapeConfig"},
    shortens_arms=True,
    program=python_package("newton"),
)
