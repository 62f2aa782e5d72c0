"""Which outlines belong to one object, and which of them shows it best."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["group_objects", "same_object"]

PART_AREA = 12.0
"""An outline inside another of up to so many times its area may be part of the same object (our own)."""

NESTED_AREA = 4.0
"""It is no object beside it up to so many times its area (our own, tuned)."""

SHARED = 0.7
"""Boxes that share so much of the smaller one belong to one object (our own)."""

RIM_AREA = 2.5
"""The rim of an object is at most so many times as large as what it encloses (our own)."""

RIM_SCORE = 0.3
"""A rim has at least this share of the score of what it encloses (our own, tuned)."""

ENCLOSED = 0.9
"""Share of a box that lies within one that encloses it (our own)."""


def group_objects(
    boxes: NDArray[np.float64], scores: NDArray[np.float64], prominence: NDArray[np.float64], least: float
) -> list[int]:
    """One outline per object, the one that shows it best.

    Of outlines that belong together the most prominent one is taken, or rather the largest one close around
    it that is believed: a sign has a border within its border, and a coin has a rim.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds of all outlines of the picture: x0, y0, x1, y1, px.
    scores : ndarray of float64, shape (B,)
        Belief in the best primitive of each.
    prominence : ndarray of float64, shape (B,)
        How much each stands out.
    least : float
        Outlines with a lower score are no objects.

    Returns
    -------
    list of int
        Which outlines, most prominent first.
    """
    ranked = np.flatnonzero(scores >= least)
    ranked = ranked[np.argsort(-prominence[ranked], kind="stable")]
    boxes, scores = boxes[ranked], scores[ranked]
    together = same_object(boxes, NESTED_AREA)
    rim = _encloses(boxes) & (scores >= RIM_SCORE * scores[:, None])
    size = (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    taken = np.zeros(len(ranked), np.bool_)
    chosen: list[int] = []
    for i in range(len(ranked)):
        if not taken[i]:
            rims = np.flatnonzero(rim[i] & ~taken)
            best = int(rims[size[rims].argmax()]) if len(rims) else i
            chosen.append(best)
            taken |= together[best] | together[i]
            taken[[best, i]] = True
    return ranked[chosen].tolist()


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
