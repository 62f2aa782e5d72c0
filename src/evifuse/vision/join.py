"""Paths that join convex pieces of edges across gaps into one outline."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import cross
from evifuse.vision.pieces import Pieces

__all__ = ["JoinedPath", "joined_paths"]

STRAIGHT_RAD = float(np.deg2rad(25.0))
"""A piece that turns less than this may have the object on either side (our own)."""

GAP = 0.35
"""A link edge is at most this share of the shorter of the two pieces it joins, plus 3 px (our own)."""

LEAST_TURN_RAD = float(np.deg2rad(150.0))
"""A joined outline turns at least this much (our own)."""

MOST_PIECES = 1400
"""So many pieces, the longest ones, are joined (our own)."""


@dataclass(frozen=True, eq=False)
class JoinedPath:
    """Pieces that follow each other along one outline.

    Parameters
    ----------
    nodes : tuple of int
        Places of the pieces in order, in the list that comes with the path.
    closed : bool
        Whether the last meets the first.
    """

    nodes: tuple[int, ...]
    closed: bool


@dataclass(frozen=True, eq=False)
class _Links:
    """Link edges between pieces: their turn by (from, to), and the cheapest ones at every piece."""

    turn: dict[tuple[int, int], float]
    after: list[list[int]]
    before: list[int]


def joined_paths(pieces: Pieces) -> tuple[Pieces, list[JoinedPath]]:
    """Follow pieces from end to start across gaps, always turning clockwise.

    Parameters
    ----------
    pieces : Pieces
        Convex pieces of all edges.

    Returns
    -------
    nodes : Pieces
        The longest pieces, and after them the straight ones run the other way.
    paths : list of JoinedPath
        Paths of two or more of them.
    """
    pieces = pieces.take(np.flatnonzero(~pieces.trimmed))
    sizes = np.array([len(p) for p in pieces.points])
    pieces = pieces.take(np.argsort(-sizes, kind="stable")[:MOST_PIECES])
    nodes = pieces.with_reversed(np.flatnonzero(pieces.turn < STRAIGHT_RAD))
    links = _links(nodes)
    turns, spans = nodes.turn.tolist(), list(map(tuple, nodes.span.tolist()))
    paths: dict[frozenset[int], JoinedPath] = {}
    for i, nexts in enumerate(links.after):
        for j in nexts:
            path, closed = _follow(i, j, turns, spans, links)
            turn = sum(turns[k] for k in path) + sum(links.turn[link] for link in pairwise(path))
            if turn > LEAST_TURN_RAD:
                paths.setdefault(frozenset(path), JoinedPath(tuple(path), closed))
    return nodes, list(paths.values())


def _links(nodes: Pieces) -> _Links:
    """Every link edge from the end of a piece to the start of another that turns clockwise there."""
    starts = np.array([p[0] for p in nodes.points]).reshape(-1, 2)
    ends = np.array([p[-1] for p in nodes.points]).reshape(-1, 2)
    sizes = np.array([len(p) for p in nodes.points], np.float64)
    i, j = _near(starts, ends, sizes)
    span = nodes.span
    disjoint = (span[i, 1] <= span[j, 0]) | (span[j, 1] <= span[i, 0])
    i, j = i[disjoint], j[disjoint]
    gap = starts[j] - ends[i]
    apart = np.hypot(gap[:, 0], gap[:, 1])
    turn = _angle(nodes.last[i], nodes.first[j])
    out, back = _angle(nodes.last[i], gap), _angle(gap, nodes.first[j])
    keep = (turn > -0.35) & (turn < 2.5)
    keep &= (apart <= 4) | ((out > -0.4) & (out < 2.4) & (back > -0.4) & (back < 2.4))
    i, j, turn = i[keep], j[keep], turn[keep]
    cost = (apart[keep] + 1) / np.minimum(sizes[i], sizes[j]) + 0.05 * np.abs(turn)
    order = np.argsort(cost, kind="stable")
    after: list[list[int]] = [[] for _ in sizes]
    before = [-1] * len(sizes)
    for a, b in zip(i[order].tolist(), j[order].tolist(), strict=True):
        if len(after[a]) < 2:
            after[a].append(b)
        if before[b] < 0:
            before[b] = a
    return _Links(
        dict(zip(zip(i.tolist(), j.tolist(), strict=True), turn.tolist(), strict=True)), after, before
    )


def _near(
    starts: NDArray[np.float64], ends: NDArray[np.float64], sizes: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs (i, j) where piece j starts near the end of piece i, for the reach of the shorter of both."""
    reach = 3 + GAP * sizes
    froms, tos = [np.empty(0, np.intp)], [np.empty(0, np.intp)]
    octave = np.log2(np.maximum(sizes, 1)).astype(np.intp)
    for o in np.unique(octave):
        short, others = np.flatnonzero(octave == o), np.flatnonzero(octave >= o)
        i, j = _in_reach(ends[short], starts[others], reach[short])
        keep = sizes[short[i]] <= sizes[others[j]]
        froms.append(short[i[keep]])
        tos.append(others[j[keep]])
        j, i = _in_reach(starts[short], ends[others], reach[short])
        keep = sizes[short[j]] < sizes[others[i]]
        froms.append(others[i[keep]])
        tos.append(short[j[keep]])
    return np.concatenate(froms), np.concatenate(tos)


def _in_reach(
    centres: NDArray[np.float64], points: NDArray[np.float64], reach: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """For every centre, the points within its reach; found along x first."""
    order = np.argsort(points[:, 0], kind="stable")
    x = points[order, 0]
    low = np.searchsorted(x, centres[:, 0] - reach)
    count = np.searchsorted(x, centres[:, 0] + reach, side="right") - low
    centre = np.repeat(np.arange(len(centres)), count)
    place = np.arange(len(centre)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(low, count)
    point = order[place]
    keep = np.abs(points[point, 1] - centres[centre, 1]) <= reach[centre]
    centre, point = centre[keep], point[keep]
    keep = ((points[point] - centres[centre]) ** 2).sum(axis=1) <= reach[centre] ** 2
    return centre[keep], point[keep]


def _angle(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Signed angle from u to v, clockwise on the screen, radians."""
    return np.arctan2(cross(u, v), (u * v).sum(axis=-1))


def _follow(
    i: int, j: int, turns: list[float], spans: list[tuple[int, int]], links: _Links
) -> tuple[list[int], bool]:
    """Path through i and j, forwards and then backwards, until it closes, ends or has turned once round."""
    path, used = [i, j], [spans[i], spans[j]]
    turn = turns[i] + turns[j] + links.turn[i, j]
    for forwards in (True, False):
        while turn < 6.6 and len(path) < 9:
            nexts = links.after[path[-1]][:1] if forwards else [links.before[path[0]]]
            if not nexts or nexts[0] < 0:
                break
            k = nexts[0]
            if k == (path[0] if forwards else path[-1]):
                return path, True
            start, end = spans[k]
            if any(start < e and s < end for s, e in used):
                break
            step = turns[k] + links.turn[(path[-1], k) if forwards else (k, path[0])]
            if turn + step > 7.2:
                break
            turn += step
            used.append(spans[k])
            path = [*path, k] if forwards else [k, *path]
    return path, (path[-1], path[0]) in links.turn
