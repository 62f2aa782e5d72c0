"""Outlines prepared for primitives, all outlines of a picture at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.link import LinkList

__all__ = ["POINTS", "Outlines", "outlines_of"]

POINTS = 64
"""So many points stand for an outline (our own)."""

RESIDUAL_PER_SIZE = 0.02
"""Deviation from a primitive that halves the trust in it, as a share of the outline's width (our own)."""

RESIDUAL_PX = 0.7
"""Deviation that the pixel grid causes, px (our own)."""


@dataclass(frozen=True, eq=False)
class Outlines:
    """Link lists prepared for primitives; the first dimension counts them.

    Parameters
    ----------
    links : tuple of LinkList
        Edge segments in order, of each outline.
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments of all outlines, one outline after the other, px.
    owner : ndarray of intp, shape (S,)
        Outline of each segment.
    points : ndarray of float64, shape (B, 64, 2)
        Points at equal steps on what is seen of each outline, px: links across gaps are no evidence. They
        start from the point farthest from the middle of the hull, where a polygon has a corner.
    hull : ndarray of float64, shape (B, K, 2)
        Convex hull of each, px; the last corner is repeated.
    corners : ndarray of intp, shape (B,)
        How many corners each hull has.
    around : ndarray of float64, shape (B,)
        Length of the hull, px.
    inside : ndarray of float64, shape (B,)
        Area of the hull, square px.
    """

    links: tuple[LinkList, ...]
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    owner: NDArray[np.intp]
    points: NDArray[np.float64]
    hull: NDArray[np.float64]
    corners: NDArray[np.intp]
    around: NDArray[np.float64]
    inside: NDArray[np.float64]

    @property
    def width(self) -> NDArray[np.float64]:
        """Four times area over length of the hull, px, shape (B,).

        The side of a square, the diameter of a circle, twice the short side of a long rectangle.
        """
        return 4 * self.inside / self.around

    @property
    def tolerance(self) -> NDArray[np.float64]:
        """Deviation from a primitive that costs it 40 % of its belief, px, shape (B,)."""
        return RESIDUAL_PER_SIZE * self.width + RESIDUAL_PX


def outlines_of(links: Sequence[LinkList]) -> Outlines:
    """Prepare link lists.

    Parameters
    ----------
    links : sequence of LinkList
        At least one; each encloses an area.

    Returns
    -------
    Outlines
        In the same order.
    """
    import cv2

    hulls: list[NDArray[np.float64]] = []
    inside = np.empty(len(links))
    around = np.empty(len(links))
    middle = np.empty((len(links), 2))
    for i, link in enumerate(links):
        hull = cv2.convexHull(link.points.astype(np.float32)[:, None])
        inside[i], around[i] = cv2.contourArea(hull), cv2.arcLength(hull, True)
        hulls.append(cv2.approxPolyDP(hull, max(0.5, 0.005 * around[i]), True)[:, 0].astype(np.float64))
        moments = cv2.moments(hull)
        middle[i] = moments["m10"], moments["m01"]
        middle[i] /= max(moments["m00"], 1e-9)
    corners = np.array([len(h) for h in hulls], np.intp)
    place = np.minimum(np.arange(corners.max()), corners[:, None] - 1)
    place += (np.cumsum(corners) - corners)[:, None]
    return Outlines(
        links=tuple(links),
        starts=np.concatenate([link.starts for link in links]),
        ends=np.concatenate([link.ends for link in links]),
        owner=np.repeat(np.arange(len(links)), [len(link.starts) for link in links]),
        points=_at_equal_steps(links, middle),
        hull=np.concatenate(hulls)[place],
        corners=corners,
        around=around,
        inside=inside,
    )


def _at_equal_steps(links: Sequence[LinkList], middle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points at equal steps along each outline, from the one farthest from its middle on.

    All outlines lie on one long path; gaps between their edges have no length.
    """
    path = np.concatenate([link.points for link in links])
    sizes = np.array([len(link.points) for link in links])
    begin = np.cumsum(sizes) - sizes
    first = np.concatenate([b + link.first for b, link in zip(begin.tolist(), links, strict=True)])
    step = np.hypot(*np.diff(path, axis=0, append=path[:1]).T)
    step[first - 1] = 0.0
    owner = np.repeat(np.arange(len(links)), sizes)
    away = ((path - middle[owner]) ** 2).sum(axis=1)
    away[first] = -1.0  # a corner has an edge before it
    farthest = begin + np.array([away[b : b + n].argmax() for b, n in zip(begin, sizes, strict=True)])
    along = np.append(0.0, np.cumsum(step))
    length = along[begin + sizes] - along[begin]
    share = (np.arange(POINTS) + 0.5) / POINTS
    ahead = (along[farthest] - along[begin])[:, None] + share * length[:, None]
    at = along[begin][:, None] + ahead % np.maximum(length, 1e-9)[:, None]
    place = np.searchsorted(along, at.ravel(), side="right") - 1
    place = np.minimum(place, len(path) - 1)
    after = np.minimum(place + 1, len(path) - 1)
    rest = ((at.ravel() - along[place]) / np.maximum(step[place], 1e-9))[:, None]
    return (path[place] + np.clip(rest, 0, 1) * (path[after] - path[place])).reshape(len(links), POINTS, 2)
