"""Which edge segments of an outline make one fitted edge: by the sides of a polygon, or between corners."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import ANGLE_TOLERANCE_RAD, FittedEdge, FittedEdges, fit_edges
from evifuse.vision.geometry import distances_to_polygon
from evifuse.vision.link import GAP_PX, LinkList

__all__ = ["fit_sides", "split_at_corners"]


def fit_sides(
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    owner: NDArray[np.intp],
    corners: NDArray[np.float64],
) -> FittedEdges:
    """Fit the sides of hypothesised polygons.

    Every segment goes to the side nearest to its middle, if it lies within 8 % of the polygon's
    perimeter of it; along a side, segments are in order and all run the same way.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments of all outlines, px.
    owner : ndarray of intp, shape (S,)
        Polygon that stands for the outline of each segment.
    corners : ndarray of float64, shape (B, K, 2)
        Corners of each polygon in order, px; NaN for none.

    Returns
    -------
    FittedEdges
        Shape (B, K), side ``i`` from corner ``i`` to corner ``i + 1``; NaN where fewer than 15 % of the side
        are seen.
    """
    from evifuse.vision import _kernels_edges

    count, sides = corners.shape[:2]
    distance, position = distances_to_polygon(((starts + ends) / 2)[:, None], corners[owner])
    side = np.minimum(position[:, 0].astype(np.intp), sides - 1)
    x, y = np.empty((count, sides, 2)), np.empty((count, sides, 2))
    belief = np.empty((count, sides))
    _kernels_edges.fit_sides(
        starts, ends, owner, distance[:, 0], side, corners, GAP_PX, ANGLE_TOLERANCE_RAD, x, y, belief
    )
    return FittedEdges(x, y, belief)


def split_at_corners(links: LinkList) -> tuple[FittedEdge, ...]:
    """Fit edges between the corners of an outline.

    A corner is a vertex of the coarse polygon that stays within 3 % of the outline's extent (at least 2
    px): an arc is split into many short edges of little belief, a straight side stays whole.

    Parameters
    ----------
    links : LinkList
        The outline.

    Returns
    -------
    tuple of FittedEdge
        In order along the outline.
    """
    import cv2

    extent = float(np.ptp(links.points, axis=0).max())
    path = np.vstack([links.starts, links.ends[-1:]]).astype(np.float32)
    corners = cv2.approxPolyDP(path.reshape(-1, 1, 2), max(2.0, 0.03 * extent), False).reshape(-1, 2)
    is_corner = (path[:, None, :] == corners[None, :, :]).all(axis=2).any(axis=1)
    cuts = np.flatnonzero(is_corner[:-1])
    return fit_edges(links.starts, links.ends, np.unique(np.append(0, cuts))).listed()
