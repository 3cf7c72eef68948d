"""The interface of an exporter: a collision in SI, and a code as data, with functions that write its lines."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from ..contact.model import ForceModel
from ..errors import UsageError
from ..formatting import number
from .programs import Program

Parameters = Mapping[str, float | str]
# what is written for a collision
Lines = Iterable[str]
# moment of inertia of a ball over m R^2, in scripts
SOLID = 0.4
# largest difference of e between a code and the map of its scheme
ROUNDING = 1e-9
# of scripts in Python, before e_out: prints from u1, u2, omega1 and omega2
PRINT_BETA = """\
print("beta =", -(u1 + {R1} * omega1 - u2 + {rim2} * omega2) / {slip})
print("omega1 =", omega1)
print("omega2 =", omega2)
"""


def keyword_arguments(values: Parameters) -> str:
    """Write the keyword arguments of a call in Python, with all digits."""
    return ", ".join(f"{name}={value!r}" for name, value in values.items())


@dataclass(frozen=True)
class Collision:
    """A collision of two balls, or of a ball and a plane wall, on a line, as a code simulates it; all in SI.

    Parameters
    ----------
    model : the law, the catalogue's entry of the code
    values : by name: v1, v2, m1, m2, R1, R2, e, K, n, E1, nu1, E2, nu2, yield_strength1, yield_strength2, the
        effective m, R_eff, E_eff and the closing speed v0, and the law's own parameters; NaN for unknown ones
    materials : names of the materials of both balls; "" where none is given
    has_user_stiffness : K is set in the config, and does not follow from the materials
    has_wall : ball 2 is a plane wall: its mass is infinite, and the config gives it no finite radius
    friction : key of the friction law, whose parameters, mu, u1, u2, omega1 and omega2 are among the values; or ""
    gap : between the surfaces at the start, so that the contact begins at the requested phase of a step
    steps : number of steps until the contact is over
    """

    model: ForceModel
    version: str
    values: Mapping[str, float]
    materials: tuple[str, str]
    has_user_stiffness: bool
    has_wall: bool
    dt: float
    gap: float
    steps: int
    friction: str = ""

    def __getitem__(self, name: str) -> float:
        return self.values[name]

    @property
    def has_materials(self) -> bool:
        """Whether the stiffness follows from the materials of both balls."""
        return not self.has_user_stiffness and all(self.materials)

    def require_materials(self, reason: str) -> None:
        """Refuse a stiffness that does not follow from the materials."""
        if not self.has_materials:
            raise UsageError(f"{reason}: expected a material, not K")

    @property
    def has_one_material(self) -> bool:
        return self.materials[0] == self.materials[1]

    @property
    def effective_radius(self) -> float:
        """R* [m], of the radii that are taken where the law needs none."""
        curvature = 1.0 / self["R1"] + 1.0 / self["R2"]
        if curvature == 0.0:
            raise UsageError("R1 and R2: got inf, expected one finite radius")
        return 1.0 / curvature

    @property
    def largest_radius(self) -> float:
        """The larger radius [m] of the balls, near which coordinates are rounded; a wall is at the origin."""
        radii = [self["R1"]] if self.has_wall else [self["R1"], self["R2"]]
        return max(filter(math.isfinite, radii))

    def script_values(self) -> dict[str, str]:
        """Write the values of a script as text with all digits, in SI; ball 1 is on the left.

        The surfaces meet at the origin. `reach` is the distance from there that no part of a ball leaves, `skin`
        the distance within which neighbours are searched for. A wall is at rest: v1 is relative to it.
        """
        for name in ("m1", "R1") if self.has_wall else ("m1", "m2", "R1", "R2"):
            if not math.isfinite(self[name]):
                expected = "m2 = inf for a wall" if name == "m1" else "a finite value, or m2 = R2 = inf for a wall"
                raise UsageError(f"a script: {name}: got {number(self[name])}, expected {expected}")
        v1, v2 = (self["v0"], 0.0) if self.has_wall else (self["v1"], self["v2"])
        rim2 = 0.0 if self.has_wall else self["R2"]
        values = {
            "x1": -self["R1"] - self.gap,
            "x2": self["R2"],
            "y1": 0.0,
            "y2": 0.0,
            **dict.fromkeys(("u1", "u2", "omega1", "omega2"), 0),
            "d1": 2.0 * self["R1"],
            "d2": 2.0 * self["R2"],
            "solid": SOLID,
            "dt": self.dt,
            "steps": self.steps,
            "gap": self.gap,
            "reach": 2.0 * (self["R1"] + rim2 + self.gap + 2.0 * (abs(v1) + abs(v2)) * self.steps * self.dt),
            "skin": 0.1 * min(self["R1"], self["R2"]),
            "v1": v1,
            "v2": v2,
        }
        values |= {name: self[name] for name in ("R1", "R2", "m1", "m2", "v0")}
        if self.friction:
            for ball in ("1",) if self.has_wall else ("1", "2"):
                if self[f"inertia_factor{ball}"] != SOLID:
                    found = f"inertia_factor{ball}: got {number(self[f'inertia_factor{ball}'])}"
                    raise UsageError(f"a script: {found}, expected {SOLID}: balls of scripts are solid")
            u1, u2 = (self["u1"] - self["u2"], 0.0) if self.has_wall else (self["u1"], self["u2"])
            slip = u1 + self["R1"] * self["omega1"] - u2 + rim2 * self["omega2"]
            if slip == 0.0:
                raise UsageError("a script: there is no slip before the impact, and so no beta")
            values |= {"u1": u1, "u2": u2, "rim2": rim2, "slip": slip}
            values["reach"] += 4.0 * (abs(u1) + abs(u2)) * (self.steps * self.dt + self.gap / self["v0"])
            # so that the normal is along x at the first touch
            values |= {"y1": -u1 * self.gap / self["v0"], "y2": -u2 * self.gap / self["v0"]}
            values |= {name: self[name] for name in ("omega1", "omega2")}
        return {name: repr(value) for name, value in values.items()}


@dataclass(frozen=True)
class Code:
    """A code that simulates contacts, and how a law is written for it.

    Parameters
    ----------
    name, title : on the command line, that of its module, which the registry enters; and in words
    laws : what the code calls each of its laws, by key of the catalogue; the first is the default
    newest : the newest release whose laws were seen, taken where the code is not installed
    tested : what was run, or what was read instead
    parameters : in the units and conventions of the code, by the code's own names
    scheme : see `impact.contact.fixed_step.SCHEMES`; None if its restitution at a time step is not predicted
    uncertainty : largest difference of e between the code and the map of its scheme, by law; ROUNDING for others
    resolution : spacing of its numbers near 1
    law_for_version : the entry of the catalogue that holds in a version, from the key of another one and the
        version; raises a UsageError where the version has none
    read_version : converts a version as the user or the program writes it to the form in which versions are
        compared; raises a UsageError for any other text, see `impact.exporters.registry.read_release`
    comment : what begins and ends a comment among the lines
    notes : remarks on a law: mixing of two materials, thresholds, clamps, versions
    warnings : what a user has to know before using the lines
    template : of jinja2, a complete input that prints `e_out = VALUE` last, and before it, if `has_friction`,
        `beta = VALUE` and both spins; see `script`; "" if none was ever run
    frictions : what the code calls each of its friction laws, by key of the catalogue
    has_friction : whether the code has a friction law with a law, from the keys of the law and the friction law
    shortens_arms : whether friction acts at less than the radius from the centre, by a part of the indentation
    wall_inputs : the inputs that a wall acts with where they differ from those of a plane of infinite mass, by
        config name, from the key of the law, the version and the values of `Collision`
    suffix, program : of the file of a script, and what runs it; None without one
    """

    title: str
    laws: Mapping[str, str]
    newest: str
    tested: str
    parameters: Callable[[Collision], dict[str, float | str]]
    lines: Callable[[Collision, Parameters], Lines]
    scheme: str | None = None
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    resolution: float = 2.0**-52
    law_for_version: Callable[[str, str], str] = lambda key, version: key
    read_version: Callable[[str], str] = lambda text: text
    comment: tuple[str, str] = ("# ", "")
    notes: Callable[[Collision], Lines] = lambda collision: ()
    warnings: Callable[[Collision], Lines] = lambda collision: ()
    template: str = ""
    frictions: Mapping[str, str] = field(default_factory=dict)
    has_friction: Callable[[str, str], bool] = lambda key, friction: True
    shortens_arms: bool = False
    wall_inputs: Callable[[str, str, Mapping[str, float]], Mapping[str, float]] = lambda key, version, values: {}
    name: str = ""
    suffix: str = ".py"
    program: Program | None = None

    def script(self, collision: Collision, parameters: Parameters) -> str:
        """Fill the template with the lines, the parameters, `Collision.script_values`, and what follows.

        has_wall, has_friction : whether ball 2 is a wall, and whether the impact is oblique
        material2 : the material of ball 2 in the lines, "material1" where they make only that one
        balls : for each ball, not for a wall, its number and values without the number in their names
        tuples : writes a tuple in Python with the named values of each ball
        each : writes, in Python, values of both balls by a loop; or of ball 1, and the value of the wall
        print_beta : of scripts in Python, "" without friction
        """
        # only scripts need it
        from jinja2 import Environment, StrictUndefined

        lines = list(self.lines(collision, parameters))
        material2 = "material2" if any(line.startswith("material2 = ") for line in lines) else "material1"
        values = {"material1": "material1", "material2": material2, **collision.script_values()}
        balls = [
            {"number": ball, **{name[:-1]: text for name, text in values.items() if name.endswith(ball)}}
            for ball in (("1",) if collision.has_wall else ("1", "2"))
        ]

        def tuples(*names: str) -> str:
            items = [", ".join(ball[name] for name in names) for ball in balls]
            if len(names) > 1:
                items = [f"({item})" for item in items]
            return f"({items[0]},)" if collision.has_wall else f"({', '.join(items)})"

        def each(expression: str, loop: str, of_wall: str) -> str:
            return f"{expression}, {of_wall}" if collision.has_wall else f"({expression} for {loop})"

        environment = Environment(
            undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
        )
        return environment.from_string(self.template).render(
            {**parameters, **values, "lines": "\n".join(lines)},
            balls=balls,
            has_wall=collision.has_wall,
            has_friction=bool(collision.friction),
            tuples=tuples,
            each=each,
            print_beta=PRINT_BETA.format(**values) if collision.friction else "",
        )
