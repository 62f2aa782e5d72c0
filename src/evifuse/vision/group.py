"""Which outlines belong to one object, and which of them shows it best."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["group_objects", "same_object"]

NESTED_AREA = 12.0
"""An outline inside another of up to so many times its area is part of the same object (our own)."""

SHARED = 0.7
"""Boxes that share so much of the smaller one belong to one object (our own)."""


def group_objects(
    boxes: NDArray[np.float64], scores: NDArray[np.float64], prominence: NDArray[np.float64], least: float
) -> list[int]:
    """One outline per object, the one that shows it best.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds of all outlines of the picture: x0, y0, x1, y1, px.
    scores : ndarray of float64, shape (B,)
        Belief in the best primitive of each.
    prominence : ndarray of float64, shape (B,)
        How much each stands out; of outlines that belong together the most prominent one is taken.
    least : float
        Outlines with a lower score are no objects.

    Returns
    -------
    list of int
        Which outlines, most prominent first.
    """
    ranked = np.flatnonzero(scores >= least)
    ranked = ranked[np.argsort(-prominence[ranked], kind="stable")]
    together = same_object(boxes[ranked])
    chosen: list[int] = []
    for i in range(len(ranked)):
        if not together[i, chosen].any():
            chosen.append(i)
    return ranked[chosen].tolist()


def same_object(boxes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether one box lies mostly in the other, without being tiny beside it; for every pair.

    Parameters
    ----------
    boxes : ndarray of float64, shape (B, 4)
        Bounds: x0, y0, x1, y1, px; NaN belongs to nothing.

    Returns
    -------
    ndarray of bool, shape (B, B)
        Symmetric.
    """
    low, high = boxes[:, :2], boxes[:, 2:]
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    overlap = np.clip(shared, 0, None).prod(axis=2)
    size = (high - low).prod(axis=1)
    smaller, larger = np.minimum(size[:, None], size), np.maximum(size[:, None], size)
    return (overlap > SHARED * smaller) & (larger < NESTED_AREA * smaller)
