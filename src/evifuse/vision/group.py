"""Which link lists belong to one object."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives import Hypothesis, Outline

__all__ = ["Candidate", "group_objects"]

NESTED_AREA = 12.0
"""An outline inside another of up to so many times its area is part of the same object (our own)."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An outline with what it might show.

    Parameters
    ----------
    outline : Outline
        What is seen.
    hypotheses : tuple of Hypothesis
        One per primitive at most.
    score : float
        Belief in the best of them, in [0, 1].
    """

    outline: Outline
    hypotheses: tuple[Hypothesis, ...]
    score: float

    @property
    def box(self) -> NDArray[np.float64]:
        """Bounds of the best hypothesis and the outline together: x0, y0, x1, y1, px."""
        best = max(self.hypotheses, key=lambda h: h.belief).shape
        return np.concatenate([best.min(axis=0), best.max(axis=0)])


def group_objects(candidates: list[Candidate], least: float) -> list[Candidate]:
    """One candidate per object, the one that shows it best.

    Parameters
    ----------
    candidates : list of Candidate
        All outlines of the picture.
    least : float
        Candidates with a lower score are no objects.

    Returns
    -------
    list of Candidate
        Most believed first.
    """
    chosen: list[Candidate] = []
    for candidate in sorted((c for c in candidates if c.score >= least), key=lambda c: -c.score):
        if not any(_same_object(candidate.box, other.box) for other in chosen):
            chosen.append(candidate)
    return chosen


def _same_object(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether one box lies mostly in the other, without being tiny beside it."""
    overlap = float(np.clip(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0, None).prod())
    sizes = sorted([float((a[2:] - a[:2]).prod()), float((b[2:] - b[:2]).prod())])
    return overlap > 0.7 * sizes[0] and sizes[1] < NESTED_AREA * sizes[0]
