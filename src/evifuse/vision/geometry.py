"""Plane geometry of outlines: polygons, lines and distances, in pixels.

Every function takes any number of leading batch dimensions, written ``...``.
"""

from math import prod

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "area",
    "corner_angles",
    "cross",
    "distances_to_polygon",
    "fit_line",
    "following",
    "intersection",
    "length_before",
    "resample",
    "side_lengths",
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


def following(polygon: Points) -> Points:
    """The next corner of each corner.

    Parameters
    ----------
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order.

    Returns
    -------
    ndarray of float64, shape (..., K, 2)
        The same, one further; the first comes last.
    """
    return np.concatenate([polygon[..., 1:, :], polygon[..., :1, :]], axis=-2)


def area(polygon: Points) -> NDArray[np.float64]:
    """Area inside a polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order.

    Returns
    -------
    ndarray of float64, shape (...)
        Square pixels, never negative.
    """
    return np.abs(cross(polygon, following(polygon)).sum(axis=-1)) / 2


def side_lengths(polygon: Points) -> NDArray[np.float64]:
    """Lengths of the sides of a closed polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order.

    Returns
    -------
    ndarray of float64, shape (..., K)
        Pixels, from corner ``i`` to corner ``i + 1``.
    """
    along = following(polygon) - polygon
    return np.hypot(along[..., 0], along[..., 1])


def resample(polygon: Points, count: int) -> Points:
    """Points at equal steps along a closed polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order.
    count : int
        How many points to return.

    Returns
    -------
    ndarray of float64, shape (..., count, 2)
        Points on it, from the first corner on.
    """
    spans = side_lengths(polygon)
    until = np.cumsum(spans, axis=-1)
    at = until[..., -1:] * (np.arange(count) / count)
    side = (at[..., :, None] >= until[..., None, :-1]).sum(axis=-1)
    before = np.take_along_axis(until - spans, side, axis=-1)
    share = (at - before) / np.maximum(np.take_along_axis(spans, side, axis=-1), 1e-12)
    start = np.take_along_axis(polygon, side[..., None], axis=-2)
    end = np.take_along_axis(following(polygon), side[..., None], axis=-2)
    return start + share[..., None] * (end - start)


def distances_to_polygon(points: Points, polygon: Points) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distance of points from the nearest side of a closed polygon.

    Parameters
    ----------
    points : ndarray of float64, shape (..., N, 2)
        Points.
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order; side ``i`` goes from corner ``i`` to corner ``i + 1``. The leading dimensions are
        those of the points.

    Returns
    -------
    distance : ndarray of float64, shape (..., N)
        Pixels.
    position : ndarray of float64, shape (..., N)
        Where on the polygon each is nearest to: the number of the side, and the share of it that lies before.
    """
    from evifuse.vision import _kernels_match

    leading, count = points.shape[:-2], points.shape[-2]
    rows = prod(leading)
    distance, position = np.empty((rows, count)), np.empty((rows, count))
    _kernels_match.polygon_distances(
        np.ascontiguousarray(points).reshape(rows, count, 2),
        np.ascontiguousarray(polygon).reshape(rows, polygon.shape[-2], 2),
        distance,
        position,
    )
    return distance.reshape(*leading, count), position.reshape(*leading, count)


def length_before(polygon: Points, position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Share of the length of a closed polygon that lies before places on it.

    Parameters
    ----------
    polygon : ndarray of float64, shape (B, K, 2)
        Corners in order.
    position : ndarray of float64, shape (B, N)
        The number of the side, and the share of it that lies before, as from `distances_to_polygon`.

    Returns
    -------
    ndarray of float64, shape (B, N)
        In [0, 1].
    """
    from evifuse.vision import _kernels_match

    share = np.empty(position.shape)
    _kernels_match.lengths_before(np.ascontiguousarray(polygon), position, share)
    return share


def fit_line(points: Points, weights: NDArray[np.float64]) -> tuple[Points, Points]:
    """Line of least squared perpendicular distance.

    Parameters
    ----------
    points : ndarray of float64, shape (..., N, 2)
        Points.
    weights : ndarray of float64, shape (..., N)
        Weight of each, not negative.

    Returns
    -------
    centre : ndarray of float64, shape (..., 2)
        A point of the line; the origin where all weights are 0.
    direction : ndarray of float64, shape (..., 2)
        Unit vector along it.
    """
    total = np.maximum(weights.sum(axis=-1), 1e-300)
    x, y = points[..., 0], points[..., 1]
    centre = np.stack([(weights * x).sum(axis=-1) / total, (weights * y).sum(axis=-1) / total], axis=-1)
    dx, dy = x - centre[..., None, 0], y - centre[..., None, 1]
    xx, xy, yy = (weights * dx * dx), (weights * dx * dy), (weights * dy * dy)
    turn = 0.5 * np.arctan2(2 * xy.sum(axis=-1), (xx - yy).sum(axis=-1))
    return centre, np.stack([np.cos(turn), np.sin(turn)], axis=-1)


def intersection(p: Points, u: Points, q: Points, v: Points) -> Points:
    """Where two lines cross.

    Parameters
    ----------
    p, u : ndarray of float64, shape (..., 2)
        A point of the first line, and its unit direction.
    q, v : ndarray of float64, shape (..., 2)
        A point of the second line, and its unit direction.

    Returns
    -------
    ndarray of float64, shape (..., 2)
        The point; NaN for lines within about 3 degrees of parallel.
    """
    sine = cross(u, v)
    sine = np.where(np.abs(sine) < 0.05, np.nan, sine)
    return p + u * (cross(q - p, v) / sine)[..., None]


def corner_angles(polygon: Points) -> NDArray[np.float64]:
    """Interior angles of a convex polygon.

    Parameters
    ----------
    polygon : ndarray of float64, shape (..., K, 2)
        Corners in order.

    Returns
    -------
    ndarray of float64, shape (..., K)
        Radians, at each corner.
    """
    after = following(polygon) - polygon
    before = np.roll(polygon, 1, axis=-2) - polygon
    return np.arctan2(np.abs(cross(before, after)), (before * after).sum(axis=-1))
