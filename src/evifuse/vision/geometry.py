"""Plane geometry of outlines: polygons, lines and distances, in pixels."""

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "angle_between",
    "area",
    "cross",
    "distances_to_polygon",
    "fit_line",
    "intersection",
    "perimeter",
    "reduce_polygon",
    "resample",
]

Points = NDArray[np.float64]


def cross(a: Points, b: Points) -> NDArray[np.float64]:
    """Third component of the cross product of plane vectors.

    Parameters
    ----------
    a, b : ndarray of float64, shape (..., 2)
        Vectors.

    Returns
    -------
    ndarray of float64, shape (...)
        Positive where ``b`` lies clockwise of ``a`` on the screen (y down).
    """
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def area(polygon: Points) -> float:
    """Area inside a polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (K, 2)
        Corners in order.

    Returns
    -------
    float
        Square pixels, never negative.
    """
    return abs(float(cross(polygon, np.concatenate([polygon[1:], polygon[:1]])).sum())) / 2


def perimeter(polygon: Points) -> float:
    """Length of a closed polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (K, 2)
        Corners in order.

    Returns
    -------
    float
        Pixels.
    """
    return float(np.sqrt(((np.concatenate([polygon[1:], polygon[:1]]) - polygon) ** 2).sum(axis=1)).sum())


def resample(points: Points, count: int, closed: bool) -> Points:
    """Points at equal steps along a path.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Path.
    count : int
        How many points to return.
    closed : bool
        Whether the path returns to its start.

    Returns
    -------
    ndarray of float64, shape (count, 2)
        Points on the path.
    """
    path = np.vstack([points, points[:1]]) if closed else points
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    at = np.linspace(0.0, along[-1], count, endpoint=not closed)
    return np.column_stack([np.interp(at, along, path[:, 0]), np.interp(at, along, path[:, 1])])


def distances_to_polygon(points: Points, polygon: Points) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Distance of points to the nearest side of a polygon.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Points.
    polygon : ndarray of float64, shape (K, 2)
        Corners in order; side ``i`` goes from corner ``i`` to corner ``i + 1``.

    Returns
    -------
    distance : ndarray of float64, shape (N,)
        Pixels.
    side : ndarray of intp, shape (N,)
        Which side is nearest.
    """
    along = np.concatenate([polygon[1:], polygon[:1]]) - polygon
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    offset = points[:, None, :] - polygon[None, :, :]
    t = np.clip((offset * along).sum(axis=2) / square, 0.0, 1.0)
    rest = offset - t[..., None] * along
    squared = (rest**2).sum(axis=2)
    side = squared.argmin(axis=1)
    return np.sqrt(squared[np.arange(len(points)), side]), side


def fit_line(points: Points, weights: NDArray[np.float64] | None = None) -> tuple[Points, Points]:
    """Line of least squared perpendicular distance.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Points, at least 2.
    weights : ndarray of float64, shape (N,), optional
        Weight of each; equal without it.

    Returns
    -------
    centre : ndarray of float64, shape (2,)
        A point of the line.
    direction : ndarray of float64, shape (2,)
        Unit vector along it.
    """
    w = np.ones(len(points)) if weights is None else weights
    centre = w @ points / w.sum()
    d = points - centre
    xx, xy, yy = w @ d[:, 0] ** 2, w @ (d[:, 0] * d[:, 1]), w @ d[:, 1] ** 2
    turn = 0.5 * np.arctan2(2 * xy, xx - yy)
    return centre, np.array([np.cos(turn), np.sin(turn)])


def intersection(p: Points, u: Points, q: Points, v: Points) -> Points | None:
    """Where two lines cross.

    Parameters
    ----------
    p, q : ndarray of float64, shape (2,)
        A point of each line.
    u, v : ndarray of float64, shape (2,)
        Their unit directions.

    Returns
    -------
    ndarray of float64, shape (2,), or None
        The point; None for lines within about 3 degrees of parallel.
    """
    sine = float(cross(u, v))
    if abs(sine) < 0.05:
        return None
    return p + u * (float(cross(q - p, v)) / sine)


def angle_between(u: Points, v: Points) -> float:
    """Angle between two vectors.

    Parameters
    ----------
    u, v : ndarray of float64, shape (2,)
        Vectors.

    Returns
    -------
    float
        Radians, in [0, pi].
    """
    return float(np.arctan2(abs(cross(u, v)), u @ v))


def reduce_polygon(hull: Points, corners: int) -> Points | None:
    """Convex polygon with few corners around one with many.

    The side whose removal adds the least area goes first; its neighbours are prolonged until they meet.
    So a rounded, cut or hidden corner is completed rather than cut off.

    Parameters
    ----------
    hull : ndarray of float64, shape (K, 2)
        Corners of a convex polygon, in order.
    corners : int
        How many to keep.

    Returns
    -------
    ndarray of float64, shape (corners, 2), or None
        Polygon; None if sides can't be removed any more because their neighbours do not meet.
    """
    polygon = hull
    if area(polygon) < 1e-6:
        return None
    while len(polygon) > corners:
        before = np.concatenate([polygon[-1:], polygon[:-1]])
        after = np.concatenate([polygon[1:], polygon[:1]])
        beyond = np.concatenate([polygon[2:], polygon[:2]])
        u, v, base = polygon - before, after - beyond, after - polygon
        with np.errstate(divide="ignore", invalid="ignore"):
            t = cross(base, v) / cross(u, v)
            s = cross(base, u) / cross(u, v)
        meets = np.isfinite(t) & np.isfinite(s) & (t >= 0) & (s >= 0)
        apex = polygon + np.where(meets, t, 0.0)[:, None] * u
        added = np.where(meets, np.abs(cross(base, apex - polygon)) / 2, np.inf)
        best = int(added.argmin())
        if not np.isfinite(added[best]):
            return None
        polygon = polygon.copy()
        polygon[best] = apex[best]
        polygon = np.delete(polygon, (best + 1) % len(polygon), axis=0)
    return polygon if len(polygon) == corners else None
