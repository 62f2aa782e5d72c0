"""Link lists: straight edge segments in order along an outline, with link edges across the gaps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.vision.detect import Chain

__all__ = ["LinkList", "Runs", "link_chains", "link_pieces", "outer_path", "outer_points"]

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


@dataclass(frozen=True, eq=False)
class Runs:
    """Pieces of edges that follow each other along outlines.

    Parameters
    ----------
    nodes : ndarray of int64, shape (N,)
        Places of the pieces of each outline in order, one outline after the other.
    offset : ndarray of int64, shape (M + 1,)
        Where in the nodes each outline starts, and where the last one ends.
    closed : ndarray of bool, shape (M,)
        Whether the last piece of each leads to its first.
    """

    nodes: NDArray[np.int64]
    offset: NDArray[np.int64]
    closed: NDArray[np.bool_]

    @staticmethod
    def of(sizes: ArrayLike, closed: ArrayLike) -> "Runs":
        """Runs of pieces that lie one after the other.

        Parameters
        ----------
        sizes : array_like of int, shape (M,)
            How many pieces each has.
        closed : array_like of bool, shape (M,)
            Whether the last piece of each leads to its first.

        Returns
        -------
        Runs
            The first starts with piece 0.
        """
        offset = np.append(0, np.cumsum(sizes)).astype(np.int64)
        return Runs(np.arange(offset[-1]), offset, np.asarray(closed, np.bool_))

    def and_then(self, other: "Runs", further: int) -> "Runs":
        """The runs, and after them others.

        Parameters
        ----------
        other : Runs
            Of pieces that are counted from 0.
        further : int
            By how much the places of these are to rise.

        Returns
        -------
        Runs
            Of both.
        """
        return Runs(
            np.concatenate([self.nodes, other.nodes + further]),
            np.concatenate([self.offset, other.offset[1:] + self.offset[-1]]),
            np.concatenate([self.closed, other.closed]),
        )

    def take(self, which: NDArray[np.intp]) -> "Runs":
        """Some of the runs.

        Parameters
        ----------
        which : ndarray of intp, shape (Q,)
            Their places.

        Returns
        -------
        Runs
            In that order.
        """
        sizes = np.diff(self.offset)[which]
        offset = np.append(0, np.cumsum(sizes))
        place = np.arange(offset[-1]) + np.repeat(self.offset[which] - offset[:-1], sizes)
        return Runs(self.nodes[place], offset, self.closed[which])

    def sums(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum over the pieces of each run.

        Parameters
        ----------
        values : ndarray of float64, shape (P,)
            One per piece.

        Returns
        -------
        ndarray of float64, shape (M,)
            One per run.
        """
        total = np.append(0.0, np.cumsum(values[self.nodes]))
        return total[self.offset[1:]] - total[self.offset[:-1]]


def link_chains(chains: Sequence[Chain], closed: bool) -> LinkList:
    """Link list of several chains that follow each other along one outline.

    Parameters
    ----------
    chains : sequence of Chain
        In order, each running in the direction of the outline.
    closed : bool
        Whether the last is linked to the first.

    Returns
    -------
    LinkList
        Every chain cut into straight edge segments (Douglas and Peucker, 1973).
    """
    points = np.concatenate(chains).astype(np.float64)
    high = np.cumsum([len(c) for c in chains])
    low = np.append(0, high[:-1])
    forwards = np.zeros(len(chains), np.bool_)
    return link_pieces(points, low, high, forwards, Runs.of([len(chains)], [closed]))[0]


def link_pieces(
    points: NDArray[np.float64],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    back: NDArray[np.bool_],
    runs: Runs,
) -> list[LinkList]:
    """Link lists of pieces of edges that follow each other along outlines.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Edge points, px.
    low, high : ndarray of int64, shape (P,)
        From which point to before which each piece lies.
    back : ndarray of bool, shape (P,)
        Whether it runs against the order of the points.
    runs : Runs
        Which pieces make each outline.

    Returns
    -------
    list of LinkList
        One per run, as of `link_chains`; they are parts of common arrays.
    """
    from evifuse.vision import _kernels_outlines as kernels

    flat, first, at, corner = kernels.written_down(
        points, low, high, back, runs.nodes, runs.offset, SEGMENT_TOLERANCE_PX, SEGMENT_TOLERANCE
    )
    inner = np.ones(len(at), np.bool_)
    inner[corner[1:] - 1] = False
    start = np.flatnonzero(inner)
    starts, ends = flat[at[start]], flat[at[start + 1]]
    segment = corner - np.arange(len(corner))
    found: list[LinkList] = []
    bounds = zip(runs.offset[:-1].tolist(), runs.offset[1:].tolist(), runs.closed.tolist(), strict=True)
    for i, j, closed in bounds:
        p, q, s, t = first[i], first[j], segment[i], segment[j]
        found.append(LinkList(flat[p:q], first[i:j] - p, starts[s:t], ends[s:t], closed))
    return found


def outer_path(chains: Sequence[Chain]) -> tuple[Chain, ...]:
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

    from evifuse.vision import _kernels_outlines as kernels

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
    return points[kernels.farthest_by_sector(offset, sectors)]
