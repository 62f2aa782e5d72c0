"""Convex pieces of edges: what is left when an edge is cut wherever it bends back."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain

__all__ = ["Edges", "Pieces", "convex_pieces", "straightened_edges", "whole_edges"]

BEND_BACK_RAD = float(np.deg2rad(30.0))
"""An edge that bends back by more than this has left the convex outline it was following (our own)."""

CORNER_RAD = float(np.deg2rad(40.0))
"""An edge that turns by more than this at one point may leave the outline there (our own)."""

HAIRPIN_RAD = 2.6
"""An edge that turns by more than this at one point has come to an end and runs back (our own)."""

CORNER_PX = 1.5
"""How far an edge may lie from the polygonal line whose turns are looked at, px (our own)."""


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a picture and the polygonal lines that stay within 1.5 px of them.

    Parameters
    ----------
    points : ndarray of float64, shape (N, 2)
        Points of all edges, one edge after the other, (x, y) px.
    offset : ndarray of int64, shape (E + 1,)
        Where in the points each edge starts, and where the last one ends.
    at : ndarray of int64, shape (K,)
        Which points are corners of the lines.
    first : ndarray of int64, shape (E + 1,)
        Where in the corners each edge starts, and where the last one ends.
    turn : ndarray of float64, shape (K,)
        Turn at each corner, clockwise on the screen, radians; at the ends of an edge it means nothing.
    walked, turned : ndarray of float64, shape (K,)
        Length, px, and turn, radians, of all that lies before each corner.
    """

    points: NDArray[np.float64]
    offset: NDArray[np.int64]
    at: NDArray[np.int64]
    first: NDArray[np.int64]
    turn: NDArray[np.float64]
    walked: NDArray[np.float64]
    turned: NDArray[np.float64]

    @property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the lines, shape (K, 2), px."""
        return self.points[self.at]


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of edges that never bend back, run so that they turn clockwise on the screen.

    Parameters
    ----------
    edge : ndarray of int64, shape (P,)
        Which edge each is a part of.
    span : ndarray of int64, shape (P, 2)
        From which corner of all edges to which it lies.
    low, high : ndarray of int64, shape (P,)
        From which point of all edges to before which it lies.
    back : ndarray of bool, shape (P,)
        Whether it runs against the order of these points.
    trimmed : ndarray of bool, shape (P,)
        Whether it is another piece without one or both of its ends.
    start, end : ndarray of float64, shape (P, 2)
        Its first and its last point, px.
    first, last : ndarray of float64, shape (P, 2)
        Unit directions there.
    turn : ndarray of float64, shape (P,)
        How much it turns, radians; negative only for one that was reversed.
    length : ndarray of float64, shape (P,)
        Length along it, without the steps of the pixel grid, px.
    """

    edge: NDArray[np.int64]
    span: NDArray[np.int64]
    low: NDArray[np.int64]
    high: NDArray[np.int64]
    back: NDArray[np.bool_]
    trimmed: NDArray[np.bool_]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    first: NDArray[np.float64]
    last: NDArray[np.float64]
    turn: NDArray[np.float64]
    length: NDArray[np.float64]

    @property
    def size(self) -> NDArray[np.int64]:
        """How many points each has, shape (P,)."""
        return self.high - self.low

    def take(self, which: NDArray[np.intp]) -> "Pieces":
        """Some of the pieces.

        Parameters
        ----------
        which : ndarray of intp, shape (Q,)
            Their places.

        Returns
        -------
        Pieces
            In that order.
        """
        return Pieces(*(getattr(self, f.name)[which] for f in fields(self)))

    def and_then(self, other: "Pieces") -> "Pieces":
        """The pieces, and after them others of the same edges.

        Parameters
        ----------
        other : Pieces
            Q of them.

        Returns
        -------
        Pieces
            P + Q pieces.
        """
        return Pieces(
            *(np.concatenate([getattr(self, f.name), getattr(other, f.name)]) for f in fields(self))
        )

    def reversed(self) -> "Pieces":
        """The pieces run the other way.

        Returns
        -------
        Pieces
            In the same order.
        """
        return Pieces(
            self.edge,
            self.span,
            self.low,
            self.high,
            ~self.back,
            self.trimmed,
            self.end,
            self.start,
            -self.last,
            -self.first,
            -self.turn,
            self.length,
        )


def straightened_edges(chains: Sequence[Chain]) -> Edges:
    """Straighten edges.

    Parameters
    ----------
    chains : sequence of Chain
        At least one; edge points in order, px.

    Returns
    -------
    Edges
        With polygonal lines (Douglas and Peucker, 1973).
    """
    from evifuse.vision import _kernels_pieces as kernels

    points = np.concatenate(chains)
    offset = np.concatenate([[0], np.cumsum([len(c) for c in chains])]).astype(np.int64)
    at, first = kernels.corners_of(points, offset, np.full(len(chains), CORNER_PX))
    return Edges(points, offset, at, first, *kernels.turns_of(points, at))


def convex_pieces(edges: Edges, shortest: int) -> Pieces:
    """Cut edges where they bend back.

    Parameters
    ----------
    edges : Edges
        Edges.
    shortest : int
        Pieces with fewer points are dropped.

    Returns
    -------
    Pieces
        Each turns one way only, within 30 degrees; a piece with sharp corners is there as a whole, in the
        parts between them, and without its first part, its last, and both: at a corner the edge may leave the
        outline, to the other side of a stroke, along what hides the rest of it, or along a neighbour.
    """
    from evifuse.vision import _kernels_pieces as kernels

    found = kernels.pieces_of(
        edges.at, edges.first, edges.turn, BEND_BACK_RAD, CORNER_RAD, HAIRPIN_RAD, shortest
    )
    edge, a, b, trimmed = found.T
    return _pieces(edges, edge, a, b, trimmed > 0)


def whole_edges(edges: Edges) -> Pieces:
    """Edges as they are.

    Parameters
    ----------
    edges : Edges
        Edges.

    Returns
    -------
    Pieces
        One per edge; it may bend back.
    """
    every = np.arange(len(edges.offset) - 1)
    return _pieces(edges, every, edges.first[:-1], edges.first[1:] - 1, np.zeros(len(every), np.bool_))


def _pieces(
    edges: Edges,
    edge: NDArray[np.int64],
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    trimmed: NDArray[np.bool_],
) -> Pieces:
    """Pieces from corner to corner, turned so that they run clockwise."""
    corners = edges.corners
    after, before = np.minimum(a + 1, len(corners) - 1), np.maximum(b - 1, 0)
    turn = edges.turned[b] - edges.turned[np.minimum(a + 1, b)]
    back = turn < 0
    pieces = Pieces(
        edge=edge,
        span=np.stack([a, b], axis=1),
        low=edges.at[a],
        high=edges.at[b] + 1,
        back=np.zeros(len(edge), np.bool_),
        trimmed=trimmed,
        start=corners[a],
        end=corners[b],
        first=_unit(corners[after] - corners[a]),
        last=_unit(corners[b] - corners[before]),
        turn=turn,
        length=edges.walked[b] - edges.walked[a],
    )
    order = np.where(back)[0]
    turned = pieces.take(order).reversed()
    for f in fields(pieces):
        getattr(pieces, f.name)[order] = getattr(turned, f.name)
    return pieces


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors of length 1, shape (..., 2)."""
    return vectors / np.maximum(np.hypot(vectors[..., 0], vectors[..., 1]), 1e-12)[..., None]
