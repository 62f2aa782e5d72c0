"""Which link lists belong to one object."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives import PRIMITIVES, Hypothesis, Outline

__all__ = ["Candidate", "candidate_of", "group_objects"]

OUTER = 0.85
"""Of nested outlines the outer one stands for the object with this share of its belief (our own)."""

RESOLUTION_PX = 20.0
"""An outline so wide, in pixels of the picture, keeps half of its belief (our own)."""

PIXEL_GRID_PX = 0.5
"""Deviation that says nothing when straight and curved hypotheses are compared, px (our own)."""

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

    @cached_property
    def box(self) -> NDArray[np.float64]:
        """Bounds of the best hypothesis and the outline together: x0, y0, x1, y1, px."""
        best = max(self.hypotheses, key=lambda h: h.belief).shape
        return np.concatenate([best.min(axis=0), best.max(axis=0)])


def candidate_of(outline: Outline, scale: float) -> Candidate:
    """Everything an outline might show.

    To the belief that each primitive gives, two factors are applied that no primitive can know alone
    (our own). *Rivalry*: where a polygon follows the outline more closely than the arc does, the arc
    loses the squared ratio of their deviations, and the other way round. *Resolution*: ``1 - exp(-width
    / 8 px)``.

    Parameters
    ----------
    outline : Outline
        What is seen, in working pixels.
    scale : float
        Working pixels per pixel of the picture.

    Returns
    -------
    Candidate
        Its hypotheses are ordered, most believed first.
    """
    proposals = [h for h in (propose(outline) for propose in PRIMITIVES.values()) if h is not None]
    resolution = outline.width / (outline.width + scale * RESOLUTION_PX)
    triangle = max((_trust(h) for h in proposals if h.kind == "triangle"), default=0.0)
    weighed: list[Hypothesis] = []
    for h in proposals:
        rivals = [other.deviation for other in proposals if other.curved != h.curved]
        rivalry = 1.0
        if rivals:
            rivalry = min(1.0, (min(rivals) + PIXEL_GRID_PX) / (h.deviation + PIXEL_GRID_PX)) ** 2
        simplicity = 1 - triangle if h.kind in ("rectangle", "square") else 1.0
        factors = {"rivalry": rivalry, "simplicity": simplicity, "resolution": resolution}
        belief = h.belief * rivalry * simplicity * resolution
        weighed.append(replace(h, belief=belief, terms={**h.terms, **factors}))
    weighed.sort(key=lambda h: -h.belief)
    return Candidate(outline, tuple(weighed), weighed[0].belief if weighed else 0.0)


def _trust(h: Hypothesis) -> float:
    """Share of the outline that a hypothesis accounts for, and how closely."""
    return h.terms["fit"] * h.terms["explained"] * h.terms["coverage"]


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
        same = [other for other in chosen if _same_object(candidate.box, other.box)]
        if not same:
            chosen.append(candidate)
        elif (
            _size(candidate) > 1.3 * max(_size(c) for c in same) and candidate.score >= OUTER * same[0].score
        ):
            chosen[chosen.index(same[0])] = candidate
            chosen = [c for c in chosen if c is candidate or c not in same]
    return sorted(chosen, key=lambda c: -c.score)


def _size(candidate: Candidate) -> float:
    """Area of the box, square px."""
    return float((candidate.box[2:] - candidate.box[:2]).prod())


def _same_object(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Whether one box lies mostly in the other, without being tiny beside it."""
    overlap = float(np.clip(np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]), 0, None).prod())
    sizes = sorted([float((a[2:] - a[:2]).prod()), float((b[2:] - b[:2]).prod())])
    return overlap > 0.7 * sizes[0] and sizes[1] < NESTED_AREA * sizes[0]
