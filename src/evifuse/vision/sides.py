"""Which edge segments of an outline make one fitted edge: by the sides of a polygon, or between corners."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdge, FittedEdges, fit_edges
from evifuse.vision.geometry import distances_to_polygon, following, side_lengths
from evifuse.vision.link import LinkList

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
    count, sides = corners.shape[:2]
    there = ~np.isnan(corners[:, 0, 0])[owner]
    starts, ends, owner = starts[there], ends[there], owner[there]
    distance, position = distances_to_polygon(((starts + ends) / 2)[:, None], corners[owner])
    side = np.minimum(position[:, 0].astype(np.intp), sides - 1)
    around = following(corners) - corners
    spans = side_lengths(corners)
    group = owner * sides + side
    direction = (around / np.maximum(spans, 1e-9)[..., None]).reshape(-1, 2)[group]
    backwards = ((ends - starts) * direction).sum(axis=1)[:, None] < 0
    s, e = np.where(backwards, ends, starts), np.where(backwards, starts, ends)
    close = distance[:, 0] <= 0.08 * spans.sum(axis=1)[owner]
    run = np.where(close, ((e - s) * direction).sum(axis=1), 0.0)
    seen = np.bincount(group, run, minlength=count * sides)
    present = seen > 0.15 * spans.ravel()
    mine = np.flatnonzero(close & present[group])
    mine = mine[np.lexsort((((s + e) * direction).sum(axis=1)[mine], group[mine]))]
    found, first = np.unique(group[mine], return_index=True)
    edges = fit_edges(s[mine], e[mine], first)
    fitted = FittedEdges(*(np.full((count * sides, *v), np.nan) for v in ((2,), (2,), ())))
    fitted.starts[found], fitted.ends[found], fitted.beliefs[found] = edges.starts, edges.ends, edges.beliefs
    shape = (count, sides)
    return FittedEdges(
        fitted.starts.reshape(*shape, 2), fitted.ends.reshape(*shape, 2), fitted.beliefs.reshape(shape)
    )


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
