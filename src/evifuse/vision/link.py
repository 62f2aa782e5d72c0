"""Link lists: straight edge segments in order along an outline, with link edges across the gaps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain

__all__ = ["LinkList", "link_chains", "outer_path", "outer_points", "straightened"]

SEGMENT_TOLERANCE_PX = 1.2
"""How far edge points may lie from the straight segment that stands for them, px, at least."""

SEGMENT_TOLERANCE = 0.012
"""The same as a share of the outline's extent; the larger of both holds (our own)."""

GAP_PX = 2.0
"""Neighbouring edge points that are further apart than this have a gap between them, px."""


@dataclass(frozen=True)
class LinkList:
    """Edge segments in order, as in figure 2 of the chapter.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Edge points in order, (x, y) px.
    first : ndarray of intp, shape (C,)
        Where in the points each edge starts; what lies between two edges is a gap, however short.
    starts : ndarray of float64, shape (S, 2)
        Where each edge segment starts; segment ``i`` is linked to segment ``i + 1``.
    ends : ndarray of float64, shape (S, 2)
        Where each ends. Where an end is not the next start, a link edge closes the gap.
    closed : bool
        Whether the last segment is linked to the first.
    """

    points: NDArray[np.float64]
    first: NDArray[np.intp]
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    closed: bool


def link_chains(chains: tuple[Chain, ...], closed: bool) -> LinkList:
    """Link list of several chains that follow each other along one outline.

    Parameters
    ----------
    chains : tuple of Chain
        In order, each running in the direction of the outline.
    closed : bool
        Whether the last is linked to the first.

    Returns
    -------
    LinkList
        Every chain cut into straight edge segments (Douglas and Peucker, 1973).
    """
    points = np.concatenate(chains)
    tolerance = max(SEGMENT_TOLERANCE_PX, SEGMENT_TOLERANCE * float(np.ptp(points, axis=0).max()))
    corners = [straightened(c, tolerance) for c in chains]
    sizes = np.array([len(c) for c in chains], np.intp)
    return LinkList(
        points=points,
        first=np.cumsum(sizes) - sizes,
        starts=np.concatenate([c[:-1] for c in corners]),
        ends=np.concatenate([c[1:] for c in corners]),
        closed=closed,
    )


def outer_path(chains: tuple[Chain, ...]) -> tuple[Chain, ...]:
    """What several chains show to the outside.

    Parameters
    ----------
    chains : tuple of Chain
        Edges of one object, in any order and direction.

    Returns
    -------
    tuple of Chain
        Chains of a closed outline, clockwise on the screen; where the outline jumps, one ends.
    """
    points = outer_points(np.concatenate(chains))
    extent = float(np.ptp(points, axis=0).max())
    step = np.concatenate([points[1:], points[:1]]) - points
    jump = np.hypot(step[:, 0], step[:, 1]) > 0.12 * extent + GAP_PX
    if not jump.any():
        return (np.concatenate([points, points[:1]]),)
    first = int(np.flatnonzero(jump)[0]) + 1
    runs = np.split(np.roll(points, -first, axis=0), np.flatnonzero(np.roll(jump, -first)[:-1]) + 1)
    return tuple(r for r in runs if len(r) > 1) or (points,)


def outer_points(points: NDArray[np.float64], sectors: int = 120) -> NDArray[np.float64]:
    """The points seen from outside: in every direction from the middle, the farthest one.

    The outline of a thick open stroke runs along both its sides; this keeps the outer side. Directions are
    those of a picture in which the hull is as wide as it is long, so that a narrow outline is seen evenly.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Edge points, px.
    sectors : int, optional
        Into how many equal directions to divide the turn.

    Returns
    -------
    ndarray of float64, shape (M, 2)
        At most one point per direction, ordered by direction (clockwise on the screen).
    """
    import cv2

    moments = cv2.moments(cv2.convexHull(points.astype(np.float32)))
    if moments["m00"] < 1:
        offset = points - points.mean(axis=0)
    else:
        area = moments["m00"]
        middle = moments["m10"] / area, moments["m01"] / area
        spread = np.array([[moments["mu20"], moments["mu11"]], [moments["mu11"], moments["mu02"]]]) / area
        variance, axes = np.linalg.eigh(spread)
        narrow = np.sqrt(np.maximum(variance, 1e-3 * variance.max()))
        offset = (points - middle) @ (axes / narrow) @ axes.T
    sector = ((np.arctan2(offset[:, 1], offset[:, 0]) / (2 * np.pi) + 0.5) * sectors).astype(np.intp)
    order = np.lexsort((-(offset**2).sum(axis=1), sector))
    _, first = np.unique(sector[order], return_index=True)
    return points[order[first]]


def straightened(chain: Chain, tolerance: float) -> NDArray[np.float64]:
    """Polygonal line that stays near a chain (Douglas and Peucker, 1973).

    Parameters
    ----------
    chain : Chain
        Points in order along an edge.
    tolerance : float
        How far points may lie from it, px.

    Returns
    -------
    ndarray of float64, shape (K, 2)
        Points of the chain, the first and the last included.
    """
    import cv2

    corners = cv2.approxPolyDP(chain[:, None].astype(np.float32), tolerance, False)
    return corners[:, 0].astype(np.float64)
