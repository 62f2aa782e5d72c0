"""Which outlines belong to one object, and which of them shows it best."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["group_objects", "same_object"]

PART_AREA = 12.0
"""An outline inside another of up to so many times its area may be part of the same object (our own)."""

NESTED_AREA = 4.0
"""It is no object beside one that is hardly believed up to so many times its area (our own, tuned)."""

BELIEVED = 0.7
"""Beside one that is so much believed it is none however small, up to `PART_AREA` (our own, tuned)."""

LEAST_SUPPORT = 0.1
"""What is believed less to be any shape is no object, but for the most prominent ones (our own)."""

PROMINENT = 3
"""So many: a stranger among few objects is an object, in clutter it is part of the clutter (our own)."""

SHARED = 0.7
"""Boxes that share so much of the smaller one belong to one object (our own)."""

RIM_AREA = 2.5
"""The rim of an object is at most so many times as large as what it encloses (our own)."""

RIM_SCORE = 0.3
"""A rim has at least this share of the score of what it encloses (our own, tuned)."""

RIM_SUPPORT = 0.8
"""By itself it is believed to be a shape nearly as much: two that overlap are no rim (our own, tuned)."""

ENCLOSED = 0.9
"""Share of a box that lies within one that encloses it (our own)."""


def group_objects(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    support: NDArray[np.float64],
    prominence: NDArray[np.float64],
    least: float,
) -> tuple[list[int], NDArray[np.bool_]]:
    """One outline per object, the one that shows it best.

    Of outlines that belong together the most prominent one is taken, or rather the largest one close around
    it that is believed: a sign has a border within its border, and a coin has a rim.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds of all outlines of the picture: x0, y0, x1, y1, px.
    scores : ndarray of float64, shape (B,)
        Belief in the best primitive of each, if it shows any.
    support : ndarray of float64, shape (B,)
        Belief that each, by itself, shows any primitive at all.
    prominence : ndarray of float64, shape (B,)
        How much each stands out.
    least : float
        Outlines with a lower score are no objects.

    Returns
    -------
    chosen : list of int
        Which outlines, most prominent first.
    members : ndarray of bool, shape (N, B)
        Which outlines show each object: those that belong to it, and those near it that belong to none.
    """
    order = np.argsort(-prominence, kind="stable")
    ranked = order[scores[order] >= least]
    if not len(ranked):
        return [], np.zeros((0, len(order)), np.bool_)
    boxes, scores, support = boxes[ranked], scores[ranked], support[ranked]
    together = same_object(boxes, NESTED_AREA)
    near = same_object(boxes)
    rim = _encloses(boxes) & (scores >= RIM_SCORE * scores[:, None])
    rim &= support >= RIM_SUPPORT * support[:, None]
    size = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    taken = np.zeros(len(ranked), np.bool_)
    owner = np.full(len(ranked), -1)
    chosen: list[int] = []
    for i in range(len(ranked)):
        if not taken[i]:
            rims = np.flatnonzero(rim[i] & ~taken)
            best = int(rims[size[rims].argmax()]) if len(rims) else i
            chosen.append(best)
            own = together[best] | together[i]
            if support[best] >= BELIEVED:
                own |= near[best] & (support < BELIEVED)
            own[[best, i]] = True
            owner[own & ~taken] = len(chosen) - 1
            taken |= own
    kept = [n for n, k in enumerate(chosen) if n < PROMINENT or support[k] >= LEAST_SUPPORT]
    free = np.isin(owner, kept, invert=True)
    shown = np.zeros((len(kept), len(order)), np.bool_)
    for row, n in enumerate(kept):
        shown[row, ranked] = (owner == n) | (near[chosen[n]] & free)
        shown[row, ranked[chosen[n]]] = True
    return ranked[[chosen[n] for n in kept]].tolist(), shown


def _encloses(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the second of two boxes lies close around the first; for every pair."""
    overlap = _overlap(boxes)
    size = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    inside = overlap >= ENCLOSED * size[:, None]
    return inside & (size >= size[:, None]) & (size < RIM_AREA * size[:, None])


def _overlap(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area that two boxes share, square px; for every pair."""
    x0, y0, x1, y1 = boxes.T
    wide = np.minimum.outer(x1, x1) - np.maximum.outer(x0, x0)
    high = np.minimum.outer(y1, y1) - np.maximum.outer(y0, y0)
    return np.maximum(wide, 0) * np.maximum(high, 0)


def same_object(boxes: NDArray[np.float64], most: float = PART_AREA) -> NDArray[np.bool_]:
    """Whether one box lies mostly in the other, without being tiny beside it; for every pair.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds: x0, y0, x1, y1, px; NaN belongs to nothing.
    most : float, optional
        One is tiny beside the other if its area is so many times smaller.

    Returns
    -------
    ndarray of bool, shape (B, B)
        Symmetric.
    """
    from evifuse.vision import _kernels_boxes

    together = np.empty((len(boxes), len(boxes)), np.bool_)
    _kernels_boxes.mostly_inside(boxes, SHARED, most, together)
    return together
