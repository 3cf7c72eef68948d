"""How well the formula and the DOI of a law are verified: seen at a source, derived, disputed, or not verified."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

from ..errors import ModelError

EvidenceState = Literal["seen", "derived", "disputed", "not verified"]
EVIDENCE_STATES: tuple[EvidenceState, ...] = get_args(EvidenceState)


@dataclass(frozen=True)
class Evidence:
    """How well the formula of a law, and its DOI, are verified.

    Parameters
    ----------
    state : "seen", "derived", "disputed" or "not verified"
    source : where the formula was read (repository, path and commit or date; a page; a paper and its equation),
        where it is derived, or both sides of a dispute; may be empty only in the state "not verified"
    doi : where the DOI of the law was read; empty for a law without DOI
    note : anything else that a user has to know, such as what the source does not contain

    Raises
    ------
    ModelError : unknown state, or missing source

    >>> print(Evidence("seen", "Gharib and Hurmuzlu (2012), equation (19)", note="for e > 0.95"))
    seen in Gharib and Hurmuzlu (2012), equation (19); for e > 0.95
    """

    state: EvidenceState
    source: str = ""
    doi: str = ""
    note: str = ""

    def __post_init__(self) -> None:
        if self.state not in EVIDENCE_STATES:
            raise ModelError(f"evidence: got state {self.state!r}, expected one of {', '.join(EVIDENCE_STATES)}")
        if self.state != "not verified" and not self.source:
            raise ModelError(f'evidence: state "{self.state}" without a source, expected a source')

    def __str__(self) -> str:
        source = f" in {self.source}" if self.state == "seen" else f": {self.source}" if self.source else ""
        doi = f"; DOI seen in {self.doi}" if self.doi else ""
        return self.state + source + doi + (f"; {self.note}" if self.note else "")


# evidence in each state
seen, derived, disputed, not_verified = (partial(Evidence, state) for state in EVIDENCE_STATES)


def count_states(evidence: Iterable[Evidence]) -> str:
    """Count the laws in each state, as text.

    >>> count_states([Evidence("derived", "here"), Evidence("seen", "there"), Evidence("seen", "there")])
    '2 seen, 1 derived'
    """
    states = [law_evidence.state for law_evidence in evidence]
    return ", ".join(f"{states.count(state)} {state}" for state in EVIDENCE_STATES if state in states)
