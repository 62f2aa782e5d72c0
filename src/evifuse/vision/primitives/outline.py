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
    around : ndarray of float64, shape (B,)
        Length of the convex hull, px.
    inside : ndarray of float64, shape (B,)
        Area of the hull, square px.
    extent : ndarray of float64, shape (B,)
        Width or height of the hull, the larger one, px.
    """

    links: tuple[LinkList, ...]
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    owner: NDArray[np.intp]
    points: NDArray[np.float64]
    around: NDArray[np.float64]
    inside: NDArray[np.float64]
    extent: NDArray[np.float64]

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
    from evifuse.vision import _kernels_outline

    sizes = np.array([len(link.points) for link in links])
    begin = (np.cumsum(sizes) - sizes).tolist()
    first = np.zeros(sizes.sum(), np.bool_)
    first[np.concatenate([b + link.first for b, link in zip(begin, links, strict=True)])] = True
    points = np.empty((len(links), POINTS, 2))
    around, inside, extent = (np.empty(len(links)) for _ in range(3))
    path = np.concatenate([link.points for link in links])
    _kernels_outline.prepare(path, sizes, first, points, around, inside, extent)
    return Outlines(
        links=tuple(links),
        starts=np.concatenate([link.starts for link in links]),
        ends=np.concatenate([link.ends for link in links]),
        owner=np.repeat(np.arange(len(links)), [len(link.starts) for link in links]),
        points=points,
        around=around,
        inside=inside,
        extent=extent,
    )
