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
        Points at equal steps on each outline, link edges included, px.
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
    for i, link in enumerate(links):
        hull = cv2.convexHull(link.points.astype(np.float32)[:, None])
        inside[i], around[i] = cv2.contourArea(hull), cv2.arcLength(hull, True)
        hulls.append(cv2.approxPolyDP(hull, max(0.5, 0.005 * around[i]), True)[:, 0].astype(np.float64))
    corners = np.array([len(h) for h in hulls], np.intp)
    place = np.minimum(np.arange(corners.max()), corners[:, None] - 1)
    place += (np.cumsum(corners) - corners)[:, None]
    return Outlines(
        links=tuple(links),
        starts=np.concatenate([link.starts for link in links]),
        ends=np.concatenate([link.ends for link in links]),
        owner=np.repeat(np.arange(len(links)), [len(link.starts) for link in links]),
        points=_at_equal_steps(links),
        hull=np.concatenate(hulls)[place],
        corners=corners,
        around=around,
        inside=inside,
    )


def _at_equal_steps(links: Sequence[LinkList]) -> NDArray[np.float64]:
    """Points at equal steps along each outline; all outlines lie on one long path, 1 px apart."""
    paths = [p for link in links for p in ((link.points, link.points[:1]) if link.closed else (link.points,))]
    sizes = np.array([len(link.points) + link.closed for link in links])
    path = np.concatenate(paths)
    last = np.cumsum(sizes) - 1
    step = np.hypot(*np.diff(path, axis=0).T)
    step[last[:-1]] = 1.0
    along = np.append(0.0, np.cumsum(step))
    begin = along[last - sizes + 1]
    closed = np.array([link.closed for link in links])
    share = np.arange(POINTS) / np.where(closed, POINTS, POINTS - 1)[:, None]
    at = begin[:, None] + share * (along[last] - begin)[:, None]
    return np.stack([np.interp(at, along, path[:, i]) for i in (0, 1)], axis=-1)
