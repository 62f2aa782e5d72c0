"""Fitted edges: one straight line for many edge segments, with the belief of section 3.1."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import distances_to_polygon, fit_line
from evifuse.vision.link import GAP_PX, LinkList

__all__ = ["ANGLE_TOLERANCE_RAD", "FittedEdge", "edge_belief", "fit_edge", "fit_sides", "split_at_corners"]

ANGLE_TOLERANCE_RAD = float(np.deg2rad(10.0))
"""Segments whose angle to the fitted line is so near to the smallest such angle count in n* (our own)."""


@dataclass(frozen=True)
class FittedEdge:
    """A straight line that stands for a run of edge segments.

    Parameters
    ----------
    start, end : ndarray of float64, shape (2,)
        End points x and y, px.
    belief : float
        Belief in it, in [0, 1] (section 3.1); the balance is on the frame.
    """

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    belief: float

    @property
    def length(self) -> float:
        """Distance of the end points, px."""
        return float(np.hypot(*(self.end - self.start)))


def edge_belief(
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> float:
    """Belief in a fitted edge (section 3.1).

    ``b = |x - y| / L * (1 - sin phi) * n* / n_T``: L is the total length of segments and link edges, phi the
    smallest acute angle between a segment and the fitted line, n* the number of segments within 10
    degrees of that angle (the tolerance is our own) and n_T the number of segments and link edges.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments in order, px.
    x, y : ndarray of float64, shape (2,)
        End points of the fitted edge, px.

    Returns
    -------
    float
        In [0, 1].

    Examples
    --------
    >>> whole = np.array([[0.0, 0.0]]), np.array([[10.0, 0.0]])
    >>> edge_belief(*whole, np.array([0.0, 0.0]), np.array([10.0, 0.0]))
    1.0
    """
    along = ends - starts
    lengths = np.hypot(along[:, 0], along[:, 1])
    gaps = np.hypot(*(starts[1:] - ends[:-1]).T)
    gaps = gaps[gaps > GAP_PX]
    total = lengths.sum() + gaps.sum()
    edge = y - x
    span = float(np.hypot(edge[0], edge[1]))
    if total <= 0 or span <= 0:
        return 0.0
    sine = np.abs(along[:, 0] * edge[1] - along[:, 1] * edge[0]) / np.maximum(lengths * span, 1e-12)
    angles = np.arcsin(np.clip(sine, 0.0, 1.0))
    smallest = float(angles.min())
    near = int((angles <= smallest + ANGLE_TOLERANCE_RAD).sum())
    share = min(1.0, span / total)
    return float(share * (1 - np.sin(smallest)) * near / (len(starts) + len(gaps)))


def fit_edge(starts: NDArray[np.float64], ends: NDArray[np.float64]) -> FittedEdge:
    """Fit one edge to segments in order.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments in order, px.

    Returns
    -------
    FittedEdge
        On the line of least squared distance, from the projection of the first point to that of the last.
    """
    lengths = np.hypot(*(ends - starts).T)
    both = np.vstack([starts, ends])
    centre, direction = fit_line(both, np.maximum(np.tile(lengths, 2), 1e-9))
    x = centre + direction * float((starts[0] - centre) @ direction)
    y = centre + direction * float((ends[-1] - centre) @ direction)
    return FittedEdge(x, y, edge_belief(starts, ends, x, y))


def fit_sides(links: LinkList, corners: NDArray[np.float64]) -> tuple[FittedEdge | None, ...]:
    """Fit the sides of a hypothesised polygon.

    Every segment goes to the side nearest to its middle, if it lies within 8 % of the polygon's
    perimeter of it; along a side, segments are in order and all run the same way.

    Parameters
    ----------
    links : LinkList
        The outline.
    corners : ndarray of float64, shape (K, 2)
        Corners of the polygon in order, px.

    Returns
    -------
    tuple of FittedEdge or None
        One per side, from corner ``i`` to corner ``i + 1``; None where fewer than 15 % of the side are
        seen.
    """
    middles = (links.starts + links.ends) / 2
    distance, side = distances_to_polygon(middles, corners)
    around = np.roll(corners, -1, axis=0) - corners
    spans = np.hypot(around[:, 0], around[:, 1])
    close = distance <= 0.08 * spans.sum()
    fitted: list[FittedEdge | None] = []
    for i, span in enumerate(spans):
        mine = close & (side == i)
        direction = around[i] / max(span, 1e-9)
        s, e = links.starts[mine], links.ends[mine]
        backwards = (e - s) @ direction < 0
        s, e = np.where(backwards[:, None], e, s), np.where(backwards[:, None], s, e)
        order = np.argsort(((s + e) / 2) @ direction, kind="stable")
        s, e = s[order], e[order]
        seen = float(((e - s) @ direction).sum()) if len(s) else 0.0
        fitted.append(fit_edge(s, e) if seen > max(0.15 * span, 0.0) else None)
    return tuple(fitted)


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
    bounds = np.unique(np.concatenate([[0], cuts, [len(links.starts)]]))
    return tuple(fit_edge(links.starts[a:b], links.ends[a:b]) for a, b in pairwise(bounds))
