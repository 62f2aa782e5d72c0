"""Convex pieces of edges, and link lists that join them across gaps into one outline."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain
from evifuse.vision.geometry import cross

__all__ = ["Piece", "convex_pieces", "joined_paths"]

BEND_BACK_RAD = float(np.deg2rad(30.0))
"""An edge that bends back by more than this has left the convex outline it was following (our own)."""

CORNER_RAD = float(np.deg2rad(40.0))
"""An edge that turns by more than this at one point may leave the outline there (our own)."""

STRAIGHT_RAD = float(np.deg2rad(25.0))
"""A piece that turns less than this may have the object on either side (our own)."""

GAP = 0.35
"""A link edge is at most this share of the shorter of the two pieces it joins, plus 3 px (our own)."""

LEAST_TURN_RAD = float(np.deg2rad(150.0))
"""A joined outline turns at least this much (our own)."""

MOST_PIECES = 1400
"""The longest pieces are joined; the time grows with the square of their number."""


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of an edge that never bends back, run so that it turns clockwise on the screen.

    Parameters
    ----------
    points : Chain
        Edge points in order, px.
    first, last : ndarray of float64, shape (2,)
        Unit directions at its start and end.
    turn : float
        How much it turns, radians; not negative but for noise.
    """

    points: Chain
    first: NDArray[np.float64]
    last: NDArray[np.float64]
    turn: float

    def reversed(self) -> "Piece":
        """The same piece run the other way."""
        return Piece(self.points[::-1], -self.last, -self.first, -self.turn)


def convex_pieces(chain: Chain, shortest: int) -> list[Piece]:
    """Cut a chain where it bends back.

    Parameters
    ----------
    chain : Chain
        Edge points in order, px.
    shortest : int
        Pieces with fewer points are dropped.

    Returns
    -------
    list of Piece
        Each turns one way only, within 30 degrees.
    """
    import cv2

    corners = cv2.approxPolyDP(chain.astype(np.float32).reshape(-1, 1, 2), 1.5, False)
    corners = corners.reshape(-1, 2).astype(np.float64)
    along = np.diff(corners, axis=0)
    if len(along) == 0:
        return []
    turns = np.arctan2(cross(along[:-1], along[1:]), (along[:-1] * along[1:]).sum(axis=1))
    at = _positions(chain, corners)
    pieces: list[Piece] = []
    for a, b in (part for run in _cuts(turns) for part in _sides(turns, *run)):
        if at[b] - at[a] + 1 < shortest:
            continue
        u, v = along[a], along[b - 1]
        turn = float(turns[a : b - 1].sum())
        piece = Piece(chain[at[a] : at[b] + 1], u / np.hypot(*u), v / np.hypot(*v), turn)
        pieces.append(piece if turn >= 0 else piece.reversed())
    return pieces


def _sides(turns: NDArray[np.float64], a: int, b: int) -> list[tuple[int, int]]:
    """The run and, if it has sharp corners, the parts between them: it may leave the outline at a corner."""
    sharp = a + 1 + np.flatnonzero(np.abs(turns[a : b - 1]) > CORNER_RAD)
    if len(sharp) == 0:
        return [(a, b)]
    return [(a, b), *pairwise([a, *sharp.tolist(), b])]


def _positions(chain: Chain, corners: NDArray[np.float64]) -> NDArray[np.intp]:
    """Index in the chain of each corner."""
    code = chain[:, 0] * 1e5 + chain[:, 1]
    order = np.argsort(code, kind="stable")
    wanted = corners[:, 0] * 1e5 + corners[:, 1]
    found = order[np.searchsorted(code[order], wanted)]
    found[-1] = len(chain) - 1
    return np.maximum.accumulate(found)


def _cuts(turns: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Runs of segments, as (first corner, last corner), between the places where a chain bends back."""
    runs: list[tuple[int, int]] = []
    start, total, highest, lowest, at_high, at_low = 0, 0.0, 0.0, 0.0, 0, 0
    for i, turn in enumerate(turns.tolist()):
        total += turn
        bent = total < highest - BEND_BACK_RAD if highest > -lowest else total > lowest + BEND_BACK_RAD
        if (bent and max(highest, -lowest) > BEND_BACK_RAD) or abs(turn) > 2.6:
            cut = (at_high if highest > -lowest else at_low) if bent else i
            cut = max(cut + 1, start + 1)
            runs.append((start, cut))
            start, total = cut, float(turns[cut : i + 1].sum())
            highest, lowest, at_high, at_low = max(total, 0.0), min(total, 0.0), i, i
            continue
        if total > highest:
            highest, at_high = total, i + 1
        if total < lowest:
            lowest, at_low = total, i + 1
    runs.append((start, len(turns) + 1))
    return runs


def joined_paths(pieces: list[Piece]) -> list[tuple[tuple[Chain, ...], bool]]:
    """Follow pieces from end to start across gaps, always turning clockwise.

    Parameters
    ----------
    pieces : list of Piece
        Convex pieces of all edges.

    Returns
    -------
    list of (tuple of Chain, bool)
        Chains of two or more pieces in order, and whether the last meets the first.
    """
    pieces = sorted(pieces, key=lambda p: -len(p.points))[:MOST_PIECES]
    nodes = pieces + [p.reversed() for p in pieces if abs(p.turn) < STRAIGHT_RAD]
    twin = np.concatenate(
        [np.arange(len(pieces)), [i for i, p in enumerate(pieces) if abs(p.turn) < STRAIGHT_RAD]]
    )
    if len(nodes) < 2:
        return []
    cost, bend = _links(nodes, twin.astype(np.intp))
    paths: dict[frozenset[int], tuple[tuple[Chain, ...], bool]] = {}
    best = np.argpartition(cost, 1, axis=1)[:, :2]
    best = np.take_along_axis(best, np.take_along_axis(cost, best, axis=1).argsort(axis=1), axis=1)
    before = cost.argmin(axis=0)
    for i in range(len(nodes)):
        for j in best[i]:
            if not np.isfinite(cost[i, j]):
                continue
            path, closed = _follow(i, int(j), nodes, twin, cost, bend, best[:, 0], before)
            turn = sum(nodes[k].turn for k in path) + sum(bend[a, b] for a, b in pairwise(path))
            if len(path) > 1 and turn > LEAST_TURN_RAD:
                paths.setdefault(frozenset(path), (tuple(nodes[k].points for k in path), closed))
    return list(paths.values())


def _links(nodes: list[Piece], twin: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cost and turn of the link edge from the end of each piece to the start of each; infinite if none."""
    starts, ends = np.array([p.points[0] for p in nodes]), np.array([p.points[-1] for p in nodes])
    first, last = np.array([p.first for p in nodes]), np.array([p.last for p in nodes])
    lengths = np.array([len(p.points) for p in nodes], dtype=np.float64)
    shorter = np.minimum(lengths[:, None], lengths[None])
    apart = np.hypot(starts[None, :, 0] - ends[:, None, 0], starts[None, :, 1] - ends[:, None, 1])
    i, j = np.nonzero((apart <= 3 + GAP * shorter) & (twin[:, None] != twin[None]))
    turn, gap, near = _angle(last[i], first[j]), starts[j] - ends[i], apart[i, j] <= 4
    out, back = _angle(last[i], gap), _angle(gap, first[j])
    keep = (turn > -0.35) & (turn < 2.5)
    keep &= near | ((out > -0.4) & (out < 2.4) & (back > -0.4) & (back < 2.4))
    i, j, turn = i[keep], j[keep], turn[keep]
    cost, bend = np.full(apart.shape, np.inf), np.zeros(apart.shape)
    cost[i, j] = (apart[i, j] + 1) / shorter[i, j] + 0.05 * np.abs(turn)
    bend[i, j] = turn
    return cost, bend


def _angle(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed angle from u to v, clockwise on the screen, radians."""
    return np.arctan2(cross(u, v), (u * v).sum(axis=-1))


def _follow(
    i: int,
    j: int,
    nodes: list[Piece],
    twin: NDArray[np.intp],
    cost: NDArray[np.float64],
    bend: NDArray[np.float64],
    after: NDArray[np.intp],
    before: NDArray[np.intp],
) -> tuple[list[int], bool]:
    """Path through i and j, forwards and then backwards, until it closes, ends or has turned once round."""
    path, used = [i, j], {int(twin[i]), int(twin[j])}
    turn = nodes[i].turn + nodes[j].turn + float(bend[i, j])
    for forwards in (True, False):
        while turn < 6.6 and len(path) < 9:
            k = int(after[path[-1]] if forwards else before[path[0]])
            link = cost[path[-1], k] if forwards else cost[k, path[0]]
            if not np.isfinite(link):
                break
            if k == (path[0] if forwards else path[-1]):
                return path, True
            if int(twin[k]) in used:
                break
            step = nodes[k].turn + float(bend[path[-1], k] if forwards else bend[k, path[0]])
            if turn + step > 7.2:
                break
            turn += step
            used.add(int(twin[k]))
            path = [*path, k] if forwards else [k, *path]
    return path, bool(np.isfinite(cost[path[-1], path[0]]))
