"""Hypothesised polygons: few corners for an outline, refined on its points."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import (
    angle_between,
    area,
    distances_to_polygon,
    fit_line,
    intersection,
    reduce_polygon,
)
from evifuse.vision.primitives.base import Outline

__all__ = ["corner_angles", "polygon_for"]

MOST_ADDED = {3: 1.55, 4: 1.45}
"""A polygon with so many corners that encloses more than this times the hull is no hypothesis (our own): a
circle needs 1.65 for a triangle and 1.27 for a quadrilateral, a square 2.0 for a triangle."""


def polygon_for(outline: Outline, corners: int) -> NDArray[np.float64] | None:
    """Convex polygon that stands for an outline.

    It starts as the hull reduced to few sides; then each side is fitted to the points next to it, twice,
    the farthest tenth left out, and the corners move to where the sides meet.

    Parameters
    ----------
    outline : Outline
        What is seen.
    corners : int
        How many corners.

    Returns
    -------
    ndarray of float64, shape (corners, 2), or None
        Corners in order, px; None if there is no such polygon.
    """
    polygon = reduce_polygon(outline.hull, corners)
    if polygon is None or area(polygon) > MOST_ADDED[corners] * area(outline.hull):
        return None
    for _ in range(2):
        refined = _refined(outline, polygon)
        if refined is None:
            break
        polygon = refined
    return polygon


def _refined(outline: Outline, polygon: NDArray[np.float64]) -> NDArray[np.float64] | None:
    distance, side = distances_to_polygon(outline.points, polygon)
    lines: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
    for i, corner in enumerate(polygon):
        along = polygon[(i + 1) % len(polygon)] - corner
        span = float(np.hypot(along[0], along[1]))
        direction = along / max(span, 1e-9)
        mine = side == i
        t = (outline.points[mine] - corner) @ direction / max(span, 1e-9)
        inner = np.flatnonzero(mine)[(t > 0.08) & (t < 0.92)]
        inner = inner[distance[inner] <= 4 * outline.tolerance]
        if len(inner) >= 4:
            keep = inner[np.argsort(distance[inner])][: max(4, int(np.ceil(0.9 * len(inner))))]
            lines.append(fit_line(outline.points[keep]))
        else:
            lines.append((corner, direction))
    moved: list[NDArray[np.float64]] = []
    for i, corner in enumerate(polygon):
        meeting = intersection(*lines[i - 1], *lines[i])
        if meeting is None or np.hypot(*(meeting - corner)) > 0.25 * outline.width + 3:
            meeting = corner
        moved.append(meeting)
    return np.array(moved)


def corner_angles(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Interior angles of a convex polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (K, 2)
        Corners in order.

    Returns
    -------
    ndarray of float64, shape (K,)
        Radians, at each corner.
    """
    before = np.roll(polygon, 1, axis=0) - polygon
    after = np.roll(polygon, -1, axis=0) - polygon
    return np.array([angle_between(u, v) for u, v in zip(before, after, strict=True)])
