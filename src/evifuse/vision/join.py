"""Paths that join convex pieces of edges across gaps into one outline."""

import numpy as np

from evifuse.vision.link import Runs
from evifuse.vision.pieces import Pieces

__all__ = ["joined_paths"]

STRAIGHT_RAD = float(np.deg2rad(25.0))
"""A piece that turns less than this may have the object on either side (our own)."""

GAP = 0.7
"""A link edge is at most this share of the shorter of the two pieces it joins, plus 3 px (our own)."""

GAP_IN_CLUTTER = 0.35
"""The same in a picture with many edges, where a far end is more often another object's (our own)."""

GAP_PX = 3.0
"""See `GAP`."""

LEAST_TURN_RAD = float(np.deg2rad(150.0))
"""A joined outline turns at least this much (our own)."""


def joined_paths(pieces: Pieces, cluttered: bool = False) -> tuple[Pieces, Runs]:
    """Follow pieces from end to start across gaps, always turning clockwise.

    Parameters
    ----------
    pieces : Pieces
        Convex pieces of all edges.
    cluttered : bool, optional
        Whether only ends nearer to each other are joined.

    Returns
    -------
    nodes : Pieces
        Those that are not trimmed, and after them the straight ones run the other way.
    runs : Runs
        Two or more of them each.
    """
    from evifuse.vision import _kernels_paths as kernels

    pieces = pieces.take(np.flatnonzero(~pieces.trimmed))
    pieces = pieces.and_then(pieces.take(np.flatnonzero(pieces.turn < STRAIGHT_RAD)).reversed())
    ends = pieces.start, pieces.end, pieces.first, pieces.last, pieces.span, pieces.size.astype(np.float64)
    gap = GAP_IN_CLUTTER if cluttered else GAP
    after, before = kernels.cheapest_links(*ends, gap, GAP_PX)
    nodes, offset, closed = kernels.paths_of(*ends, pieces.turn, after, before, LEAST_TURN_RAD, gap, GAP_PX)
    return pieces, Runs(nodes, offset, closed)
