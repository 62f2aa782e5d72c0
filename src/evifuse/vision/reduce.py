"""Convex polygons with few corners around ones with many, for all outlines at once."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import cross

__all__ = ["reduce_polygons"]

Indices = NDArray[np.intp]


def reduce_polygons(
    corners: NDArray[np.float64], counts: NDArray[np.intp], wanted: tuple[int, ...]
) -> dict[int, NDArray[np.float64]]:
    """Reduce convex polygons to few corners.

    The side whose removal adds the least area goes first; its neighbours are prolonged until they meet.
    So a rounded, cut or hidden corner is completed rather than cut off (our own).

    Parameters
    ----------
    corners : ndarray of float64, shape (B, K, 2)
        Corners of each polygon in order; what follows its last corner is ignored.
    counts : ndarray of intp, shape (B,)
        How many corners each has.
    wanted : tuple of int
        How many to keep; one reduction passes through all of them.

    Returns
    -------
    dict of int to ndarray of float64, shape (B, wanted, 2)
        NaN for a polygon whose sides can't be removed any more because their neighbours do not meet, or
        that never had so many.
    """
    polygon, left = corners.copy(), counts.copy()
    place = np.arange(polygon.shape[1])
    after = np.where(place + 1 < counts[:, None], place + 1, 0)
    before = np.where(place > 0, place - 1, counts[:, None] - 1)
    every = np.repeat(np.arange(len(polygon)), polygon.shape[1])
    cost, _ = _removal(polygon, every, np.tile(place, len(polygon)), before, after)
    cost = np.where(place < counts[:, None], cost.reshape(after.shape), np.inf)
    head = np.zeros(len(polygon), np.intp)
    reduced: dict[int, NDArray[np.float64]] = {}
    for target in sorted(wanted, reverse=True):
        while True:
            rows = np.flatnonzero((left > target) & np.isfinite(cost.min(axis=1)))
            if len(rows) == 0:
                break
            side = cost[rows].argmin(axis=1)
            _, polygon[rows, side] = _removal(polygon, rows, side, before, after)
            gone = after[rows, side]
            after[rows, side] = after[rows, gone]
            before[rows, after[rows, gone]] = side
            cost[rows, gone] = np.inf
            left[rows] -= 1
            head[rows] = side
            previous = before[rows, side]
            both = _removal(polygon, np.tile(rows, 2), np.append(side, previous), before, after)[0]
            cost[rows, side], cost[rows, previous] = both[: len(rows)], both[len(rows) :]
        reduced[target] = _gather(polygon, after, head, target)
        reduced[target][left != target] = np.nan
    return reduced


def _removal(
    polygon: NDArray[np.float64], rows: Indices, side: Indices, before: Indices, after: Indices
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Area that the removal of a side adds, infinite if its neighbours do not meet, and where they meet."""
    end = after[rows, side]
    a, b = polygon[rows, side], polygon[rows, end]
    u, v, base = a - polygon[rows, before[rows, side]], b - polygon[rows, after[rows, end]], b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        t, s = cross(base, v) / cross(u, v), cross(base, u) / cross(u, v)
    meets = np.isfinite(t) & np.isfinite(s) & (t >= 0) & (s >= 0)
    t = np.where(meets, t, 0.0)
    return np.where(meets, np.abs(t * cross(base, u)) / 2, np.inf), a + t[:, None] * u


def _gather(polygon: NDArray[np.float64], after: Indices, head: Indices, count: int) -> NDArray[np.float64]:
    """The corners that are left, in order, from one of them on."""
    every, at = np.arange(len(polygon)), head
    found = np.empty((len(polygon), count, 2))
    for k in range(count):
        found[:, k] = polygon[every, at]
        at = after[every, at]
    return found
