"""Which outlines belong to one object, and which of them shows it best."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["group_objects"]

OUTER = 0.85
"""Of nested outlines the outer one stands for the object with this share of its belief (our own)."""

LARGER = 1.3
"""An outline is the outer one if its box has so many times the area (our own)."""

NESTED_AREA = 12.0
"""An outline inside another of up to so many times its area is part of the same object (our own)."""

SHARED = 0.7
"""Boxes that share so much of the smaller one belong to one object (our own)."""


def group_objects(boxes: NDArray[np.float64], scores: NDArray[np.float64], least: float) -> list[int]:
    """One outline per object, the one that shows it best.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds of all outlines of the picture: x0, y0, x1, y1, px.
    scores : ndarray of float64, shape (B,)
        Belief in the best primitive of each.
    least : float
        Outlines with a lower score are no objects.

    Returns
    -------
    list of int
        Which outlines, most believed first.
    """
    ranked = np.flatnonzero(scores >= least)
    ranked = ranked[np.argsort(-scores[ranked], kind="stable")]
    same_object = _same_object(boxes[ranked])
    size = (boxes[ranked, 2:] - boxes[ranked, :2]).prod(axis=1).tolist()
    score = scores[ranked].tolist()
    chosen: list[int] = []
    for i in range(len(ranked)):
        same = [k for k in chosen if same_object[i, k]]
        if not same:
            chosen.append(i)
        elif size[i] > LARGER * max(size[k] for k in same) and score[i] >= OUTER * score[same[0]]:
            chosen[chosen.index(same[0])] = i
            chosen = [k for k in chosen if k == i or k not in same]
    return [int(ranked[i]) for i in sorted(chosen)]


def _same_object(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether one box lies mostly in the other, without being tiny beside it; for every pair."""
    low, high = boxes[:, :2], boxes[:, 2:]
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    overlap = np.clip(shared, 0, None).prod(axis=2)
    size = (high - low).prod(axis=1)
    smaller, larger = np.minimum(size[:, None], size), np.maximum(size[:, None], size)
    return (overlap > SHARED * smaller) & (larger < NESTED_AREA * smaller)
