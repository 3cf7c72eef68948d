"""The sets of collisions, data in TOML, and how collisions of a set follow from others.

A collision is the mapping of the adapter protocol, see docs/conform.md. Ball 1 is on the left; v1, v2 are along
the normal from ball 1 to ball 2, u1, u2 along the tangent, omega1, omega2 about normal x tangent. All is in SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, Literal, get_args

from ..config.files import parse_document
from ..errors import require_known
from ..formatting import argument

Question = Mapping[str, float | str | None]
Relation = Literal["", "frame", "mirror", "exchange", "scale", "step"]

DEFAULT_SUITE = "conformance-1"
# in the order of the protocol
ANSWER_KEYS = ("v1", "v2", "u1", "u2", "omega1", "omega2")
BODY_KEYS = ("m1", "m2", "R1", "R2", "inertia1", "inertia2")
QUESTION_KEYS = ("id", *BODY_KEYS, *ANSWER_KEYS, "e", "mu", "contact_time", "dt")
OTHER_BALL = str.maketrans("12", "21")
RELATIONS: tuple[Relation, ...] = get_args(Relation)[1:]


@dataclass(frozen=True)
class Trial:
    """A collision of a set.

    Parameters
    ----------
    question : what an adapter gets
    base, relation, change : the collision from which it follows, how, and by how much; None without one
    """

    question: Question
    base: Trial | None = None
    relation: Relation = ""
    change: Any = None

    @property
    def id(self) -> str:
        return str(self.question["id"])

    @property
    def chain(self) -> list[Trial]:
        """The collision, that from which it follows, and so on."""
        return [self, *(self.base.chain if self.base else ())]


def suites() -> list[str]:
    """Name the sets of the package."""
    paths = files(__package__).iterdir()
    return sorted(path.name.removesuffix(".toml") for path in paths if path.name.endswith(".toml"))


@cache
def read_suite(name: str = DEFAULT_SUITE) -> Mapping[str, Trial]:
    """Read the collisions of a set, by their ids.

    >>> trials = read_suite()
    >>> trials["slide-mu10-45-equal"].question["v1"], trials["normal-e50-slow-wall"].question["m2"]
    (0.707107, None)
    >>> trials["frame-mirrored"].base.id, trials["frame-mirrored"].question["omega1"]
    ('spin-both', -20.0)
    """
    require_known([name], suites(), f"{argument('suite')}: no set")
    file = f"{name}.toml"
    document = parse_document(files(__package__).joinpath(file).read_text(encoding="utf-8"), file)
    defaults = document.pop("defaults")
    trials: dict[str, Trial] = {}
    for values in (values for group in document.values() for values in group):
        if "of" in values:
            relation = next(word for word in RELATIONS if word in values)
            base = trials[values["of"]]
            question = transform(relation, values[relation], base.question) | {"id": values["id"]}
            trials[values["id"]] = Trial(question, base, relation, values[relation])
        else:
            trials[values["id"]] = Trial(_question(defaults | values))
    return trials


def _question(values: Mapping[str, Any]) -> Question:
    """Compute the moments of inertia; a wall has no mass and no radius."""
    question = dict(values)
    for ball in "12":
        question[f"inertia{ball}"] = values[f"inertia_factor{ball}"] * values[f"m{ball}"] * values[f"R{ball}"] ** 2
    if values.get("wall"):
        question |= dict.fromkeys(("m2", "R2", "inertia2"))
    return {key: question[key] for key in QUESTION_KEYS}


def transform(relation: Relation, change: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Apply a relation to a collision, or to the velocities and spins of an answer.

    Seen from behind, with the balls exchanged, both directions are reversed, and spins keep their sign.

    >>> transform("frame", {"v": 2.0, "u": 0.0}, {"v1": 1.0, "u1": 0.5, "omega1": 3.0})
    {'v1': 3.0, 'u1': 0.5, 'omega1': 3.0}
    >>> transform("exchange", True, {"v1": 1.0, "v2": -2.0, "omega1": 3.0, "omega2": 4.0})
    {'v1': 2.0, 'v2': -1.0, 'omega1': 4.0, 'omega2': 3.0}
    >>> transform("scale", 2.0, {"m1": 1.0, "R2": None, "v1": 1.0, "omega1": 3.0})
    {'m1': 8.0, 'R2': None, 'v1': 1.0, 'omega1': 1.5}
    """
    result = dict(values)
    match relation:
        case "frame":
            result |= {key: value + change[key[0]] for key, value in values.items() if key[:-1] in ("v", "u")}
        case "mirror":
            # the sum has no negative zero
            result |= {key: 0.0 - value for key, value in values.items() if key[:-1] in ("u", "omega")}
        case "exchange":
            pairs = {key: values[key.translate(OTHER_BALL)] for key in values if key[-1] in "12"}
            result |= {key: 0.0 - value if key[:-1] in ("v", "u") else value for key, value in pairs.items()}
        case "scale":
            powers = {"m": 3, "R": 1, "inertia": 5, "omega": -1}
            factors = {f"{name}{ball}": change**power for name, power in powers.items() for ball in "12"}
            factors |= {"contact_time": change, "dt": change}
            result |= {
                key: value * factors[key] for key, value in values.items() if key in factors and value is not None
            }
        case "step":
            result |= {key: value * change for key, value in values.items() if key == "dt"}
    return result
