"""Convex pieces of edges: what is left when an edge is cut wherever it bends back."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain
from evifuse.vision.geometry import cross, following
from evifuse.vision.link import straightened

__all__ = ["Pieces", "convex_pieces"]

BEND_BACK_RAD = float(np.deg2rad(30.0))
"""An edge that bends back by more than this has left the convex outline it was following (our own)."""

CORNER_RAD = float(np.deg2rad(40.0))
"""An edge that turns by more than this at one point may leave the outline there (our own)."""

CORNER_PX = 1.5
"""How far an edge may lie from the polygonal line whose turns are looked at, px (our own)."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of edges that never bend back, run so that they turn clockwise on the screen.

    Parameters
    ----------
    points : tuple of Chain
        Edge points of each piece in order, px.
    chain : ndarray of intp, shape (P,)
        Which edge each is a part of.
    whole : ndarray of bool, shape (P,)
        Whether it is all of that edge.
    span : ndarray of intp, shape (P, 2)
        From which corner of that edge to which it runs.
    trimmed : ndarray of bool, shape (P,)
        Whether it is another piece without one or both of its ends.
    first, last : ndarray of float64, shape (P, 2)
        Unit directions at its start and end.
    turn : ndarray of float64, shape (P,)
        How much it turns, radians; negative only for one that was reversed.
    length : ndarray of float64, shape (P,)
        Length along it, without the steps of the pixel grid, px.
    chain_length : ndarray of float64, shape (C,)
        The same of each edge.
    """

    points: tuple[Chain, ...]
    chain: NDArray[np.intp]
    whole: NDArray[np.bool_]
    span: NDArray[np.intp]
    trimmed: NDArray[np.bool_]
    first: NDArray[np.float64]
    last: NDArray[np.float64]
    turn: NDArray[np.float64]
    length: NDArray[np.float64]
    chain_length: NDArray[np.float64]

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
        return Pieces(
            tuple(self.points[i] for i in which.tolist()),
            self.chain[which],
            self.whole[which],
            self.span[which],
            self.trimmed[which],
            self.first[which],
            self.last[which],
            self.turn[which],
            self.length[which],
            self.chain_length,
        )

    def with_reversed(self, which: NDArray[np.intp]) -> "Pieces":
        """The pieces, and after them some of them run the other way.

        Parameters
        ----------
        which : ndarray of intp, shape (Q,)
            Places of those.

        Returns
        -------
        Pieces
            P + Q pieces.
        """
        return Pieces(
            self.points + tuple(self.points[i][::-1] for i in which.tolist()),
            np.append(self.chain, self.chain[which]),
            np.append(self.whole, self.whole[which]),
            np.concatenate([self.span, self.span[which]]),
            np.append(self.trimmed, self.trimmed[which]),
            np.concatenate([self.first, -self.last[which]]),
            np.concatenate([self.last, -self.first[which]]),
            np.append(self.turn, -self.turn[which]),
            np.append(self.length, self.length[which]),
            self.chain_length,
        )


def convex_pieces(chains: Sequence[Chain], shortest: int) -> Pieces:
    """Cut chains where they bend back.

    Parameters
    ----------
    chains : sequence of Chain
        At least one; edge points in order, px.
    shortest : int
        Pieces with fewer points are dropped.

    Returns
    -------
    Pieces
        Each turns one way only, within 30 degrees; a piece with sharp corners is there as a whole and in
        parts.
    """
    lines = [straightened(c, CORNER_PX) for c in chains]
    counts = np.array([len(line) for line in lines], np.intp)
    corners = np.concatenate(lines)
    offset = np.concatenate([[0], np.cumsum(counts)])
    at = _positions(chains, corners, counts)
    along = following(corners) - corners
    turns = np.arctan2(cross(along[:-1], along[1:]), (along[:-1] * along[1:]).sum(axis=1))
    walked = np.concatenate([[0.0], np.cumsum(np.hypot(along[:, 0], along[:, 1]))])
    turned = np.concatenate([[0.0], np.cumsum(turns)])
    spans: list[tuple[int, int, int, bool]] = []
    for k, (low, high) in enumerate(pairwise(offset.tolist())):
        if high - low < 2:
            continue
        bends = turns[low : high - 2].tolist()
        parts = [part for run in _cuts(bends) for part in _sides(bends, *run)]
        spans += [(k, low + a, low + b, t) for a, b, t in parts if at[low + b] - at[low + a] + 1 >= shortest]
    chain, a, b, trimmed = np.array(spans, np.intp).reshape(-1, 4).T
    u, v = along[a], along[b - 1]
    turn = turned[b - 1] - turned[a]
    back = turn < 0
    points = [chains[k][at[i] : at[j] + 1] for k, i, j, _ in spans]
    u, v = u / np.hypot(u[:, :1], u[:, 1:]), v / np.hypot(v[:, :1], v[:, 1:])
    return Pieces(
        tuple(p[::-1] if r else p for p, r in zip(points, back.tolist(), strict=True)),
        chain,
        whole=(a == offset[chain]) & (b == offset[chain + 1] - 1),
        span=np.stack([a, b], axis=1),
        trimmed=trimmed > 0,
        first=np.where(back[:, None], -v, u),
        last=np.where(back[:, None], -u, v),
        turn=np.abs(turn),
        length=walked[b] - walked[a],
        chain_length=walked[offset[1:] - 1] - walked[offset[:-1]],
    )


def _positions(
    chains: Sequence[Chain], corners: NDArray[np.float64], counts: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Index in its chain of each corner."""
    sizes = np.array([len(c) for c in chains], np.intp)
    points = np.concatenate(chains)
    code = _code(points, np.repeat(np.arange(len(chains)), sizes))
    order = np.argsort(code, kind="stable")
    owner = np.repeat(np.arange(len(chains)), counts)
    found = order[np.searchsorted(code[order], _code(corners, owner))] - (np.cumsum(sizes) - sizes)[owner]
    ends = np.cumsum(counts) - 1
    found[ends] = sizes - 1
    start = found + owner * (sizes.max() + 1)
    return np.maximum.accumulate(start) - (start - found)


def _code(points: NDArray[np.float64], owner: NDArray[np.intp]) -> NDArray[np.int64]:
    """One number per point and chain."""
    whole = points.astype(np.int64)
    return (owner * 65536 + whole[:, 0]) * 65536 + whole[:, 1]


def _sides(turns: list[float], a: int, b: int) -> list[tuple[int, int, bool]]:
    """The run and, if it has sharp corners, the parts between them, and the run without its ends (True).

    It may leave the outline at a corner: to the other side of a stroke, along what hides the rest of it, or
    along a neighbour.
    """
    sharp = [i + 1 for i in range(a, b - 1) if abs(turns[i]) > CORNER_RAD]
    if not sharp:
        return [(a, b, False)]
    parts = [(a, b, False), *((i, j, False) for i, j in pairwise([a, *sharp, b]))]
    if len(sharp) > 1:
        parts += [(sharp[0], b, True), (a, sharp[-1], True)]
    if len(sharp) > 2:
        parts.append((sharp[0], sharp[-1], True))
    return parts


def _cuts(turns: list[float]) -> list[tuple[int, int]]:
    """Runs of segments, as (first corner, last corner), between the places where a chain bends back."""
    runs: list[tuple[int, int]] = []
    start, total, highest, lowest, at_high, at_low = 0, 0.0, 0.0, 0.0, 0, 0
    for i, turn in enumerate(turns):
        total += turn
        bent = total < highest - BEND_BACK_RAD if highest > -lowest else total > lowest + BEND_BACK_RAD
        if (bent and max(highest, -lowest) > BEND_BACK_RAD) or abs(turn) > 2.6:
            cut = (at_high if highest > -lowest else at_low) if bent else i
            cut = max(cut + 1, start + 1)
            runs.append((start, cut))
            start, total = cut, sum(turns[cut : i + 1])
            highest, lowest, at_high, at_low = max(total, 0.0), min(total, 0.0), i, i
            continue
        if total > highest:
            highest, at_high = total, i + 1
        if total < lowest:
            lowest, at_low = total, i + 1
    runs.append((start, len(turns) + 1))
    return runs
