"""How appendix A is read: every choice that the print leaves open, by name."""

from dataclasses import dataclass
from typing import Literal

from evifuse.errors import KnowledgeError

__all__ = ["READINGS", "Reading"]


@dataclass(frozen=True)
class Reading:
    """One way of reading the formulas of appendix A.

    The defaults are the *sound* reading: every dimension lies in (0, 1], equal belief functions have
    interaction dimension 1, and neither names nor order matter. The last six fields, from ``smoothing`` on,
    are our own additions, off by default.

    Parameters
    ----------
    entropy_sign : {-1, 1}
        Sign of the entropies of A.1. The print has none (+1), which makes entropies negative and lets
        dimensions leave [0, 1].
    log_base : float or None
        Base of every logarithm; None for e. It cancels in each dimension but not in the capacity.
    similarity_offset : float
        Attributes shared by every hypothesis of a frame, added to both cardinalities of A.2, so that disjoint
        sets are a little similar. The print has 0, which divides by zero.
    divergence : {"symmetric", "printed"}
        Terms ``(b - c) log(b / c)``, never negative, or the printed ``b log(b / c)`` of A.6.
    ties : {"mean", "first"}
        Among equally similar best matches, their mean belief, or the first listed.
    pairs_within : {1, 2}
        How often a pair of focal sets counts in the focal divergence of A.2.
    pairs_between : {1, 2}
        How often a pair of prototypes counts in the internal divergence of A.7.
    members : {"inner", "within"}
        Whether an aggregate's within-set entropy sums the inner entropies of its members (as printed, and as
        A.8 needs it) or their within-set entropies.
    projection : bool
        Whether interaction dimensions above the aggregate's dimension are projected (A.8 iii and iv).
    pooling : {"sum", "mean", "max"}
        Conductivity of a class from those of its prototypes. The print sums (A.8 v), which favours classes
        with more prototypes.
    smoothing : float
        Our own, with ``projection``: over this width above the branch point the strong branch fades into the
        weak one, and over as much above it the weak branch fades into nothing, so that conductivity is
        continuous. 0 is the chapter's jump.
    sharpness : float
        Our own: each interaction dimension raised to this power, as if it passed so many equal layers in
        series.
    commitment : float or None
        Our own: evidence meets the prototypes with this much mass off the frame, and its conductivities are
        then scaled by what it really commits. Total ignorance conducts nothing. None takes evidence as it is.
    negligible : float
        Our own, with ``commitment``: focal sets with less than this share of what is committed are left out,
        because a crumb of mass that matches nothing diverges as much as a real difference.
    keep_ignorance : bool
        Our own: the normalised belief leaves on the frame what the evidence left there.

    Raises
    ------
    KnowledgeError
        If a field has a value that is not listed above.
    """

    entropy_sign: int = -1
    log_base: float | None = None
    similarity_offset: float = 0.25
    divergence: Literal["symmetric", "printed"] = "symmetric"
    ties: Literal["mean", "first"] = "mean"
    pairs_within: int = 1
    pairs_between: int = 2
    members: Literal["inner", "within"] = "inner"
    projection: bool = True
    pooling: Literal["sum", "mean", "max"] = "sum"
    smoothing: float = 0.0
    sharpness: float = 1.0
    commitment: float | None = None
    negligible: float = 0.0
    keep_ignorance: bool = False

    def __post_init__(self) -> None:
        allowed: dict[str, tuple[object, ...]] = {
            "entropy_sign": (-1, 1),
            "divergence": ("symmetric", "printed"),
            "ties": ("mean", "first"),
            "pairs_within": (1, 2),
            "pairs_between": (1, 2),
            "members": ("inner", "within"),
            "projection": (True, False),
            "pooling": ("sum", "mean", "max"),
            "keep_ignorance": (True, False),
        }
        for name, values in allowed.items():
            if getattr(self, name) not in values:
                listed = ", ".join(map(repr, values))
                raise KnowledgeError(f"reading: {name} must be one of {listed}, not {getattr(self, name)!r}")
        ranges = {
            "log_base": (self.log_base is None or self.log_base > 1, "above 1"),
            "similarity_offset": (self.similarity_offset >= 0, "0 or more"),
            "smoothing": (self.smoothing >= 0, "0 or more"),
            "sharpness": (self.sharpness > 0, "above 0"),
            "negligible": (0 <= self.negligible < 0.5, "0 or more and below 0.5"),
            "commitment": (self.commitment is None or 0 < self.commitment < 1, "between 0 and 1, or absent"),
        }
        for name, (fine, expected) in ranges.items():
            if not fine:
                raise KnowledgeError(f"reading: {name} must be {expected}, not {getattr(self, name)!r}")


READINGS = {
    "sound": Reading(),
    "printed": Reading(
        entropy_sign=1,
        similarity_offset=0.0,
        divergence="printed",
        ties="first",
        pairs_within=2,
        pairs_between=1,
    ),
    "working": Reading(
        similarity_offset=0.2,
        projection=False,
        pooling="max",
        sharpness=8.0,
        commitment=0.8,
        negligible=0.1,
        keep_ignorance=True,
    ),
}
"""By name: ``sound`` (the default), ``printed`` (to the letter), ``working`` (what the sensors use)."""
