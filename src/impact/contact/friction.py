"""A friction law as data, and its pair with a contact force model."""

from __future__ import annotations

from dataclasses import dataclass

from .evidence import Evidence
from .model import NOT_VERIFIED, ForceModel, Parameter
from .tangential import FrictionKind, TangentialForm


@dataclass(frozen=True, repr=False)
class FrictionLaw:
    """A friction law, which is combined with any contact force model; mu is an input, as e is."""

    key: str
    title: str
    year: int
    equation: str
    reference: str
    kind: FrictionKind
    doi: str = ""
    evidence: Evidence = NOT_VERIFIED
    parameters: tuple[Parameter, ...] = ()
    same_as: str = ""

    def __repr__(self) -> str:
        return f"<FrictionLaw {self.key}>"


@dataclass(frozen=True)
class Pair:
    """A contact force model with a friction law."""

    model: ForceModel
    friction: FrictionLaw

    @property
    def key(self) -> str:
        """Its name in messages, such as "hertz with coulomb-1785"."""
        return f"{self.model.key} with {self.friction.key}"

    def form(self, n: float) -> TangentialForm:
        """Find the form of its tangential problems at an exponent n."""
        return TangentialForm(self.friction.kind)
