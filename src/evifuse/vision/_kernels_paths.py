"""Inner loops that join pieces of edges across gaps, compiled by numba on first use and cached on disk."""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import atan2

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")

MOST_NODES = 9
"""A path joins at most so many pieces."""

ONCE_ROUND = 6.6
"""A path that has turned by more than this is not followed further, radians."""

TOO_FAR_ROUND = 7.2
"""A piece that would make a path turn by more than this does not belong to it, radians."""


@njit
def _angle(u, v, p, q):
    """Signed angle from (u, v) to (p, q), clockwise on the screen, radians."""
    return atan2(u * q - v * p, u * p + v * q)


@njit
def _link(i, j, start, end, first, last, span, size):
    """What it costs to go from the end of piece i to the start of piece j; infinite where it can't be."""
    if span[i, 0] < span[j, 1] and span[j, 0] < span[i, 1]:
        return np.inf
    turn = _angle(last[i, 0], last[i, 1], first[j, 0], first[j, 1])
    if turn <= -0.35 or turn >= 2.5:
        return np.inf
    u, v = start[j, 0] - end[i, 0], start[j, 1] - end[i, 1]
    apart = np.sqrt(u * u + v * v)
    if apart > 4:
        out = _angle(last[i, 0], last[i, 1], u, v)
        back = _angle(u, v, first[j, 0], first[j, 1])
        if out <= -0.4 or out >= 2.4 or back <= -0.4 or back >= 2.4:
            return np.inf
    return (apart + 1) / min(size[i], size[j]) + 0.05 * abs(turn)


@njit
def _offer(i, j, cost, after, price_after, before, price_before):
    """Keep the link if it is one of the two cheapest from i, or the cheapest to j."""
    if cost < price_after[i, 0]:
        price_after[i, 1], after[i, 1] = price_after[i, 0], after[i, 0]
        price_after[i, 0], after[i, 0] = cost, j
    elif cost < price_after[i, 1]:
        price_after[i, 1], after[i, 1] = cost, j
    if cost < price_before[j]:
        price_before[j], before[j] = cost, i


@njit
def _near(centre, reach, points, order, x, found):
    """Which points lie within reach of a centre, into ``found``; how many. ``x`` is sorted by ``order``."""
    count = 0
    k = np.searchsorted(x, centre[0] - reach)
    while k < len(x) and x[k] <= centre[0] + reach:
        j = order[k]
        u, v = points[j, 0] - centre[0], points[j, 1] - centre[1]
        if u * u + v * v <= reach * reach:
            found[count] = j
            count += 1
        k += 1
    return count


@njit
def cheapest_links(start, end, first, last, span, size, gap, least):
    """The two cheapest links from the end of each piece, and the cheapest one to its start; -1 for none.

    A link is at most the share ``gap`` of the shorter of the two pieces, plus ``least``.
    """
    n = len(size)
    after, price_after = np.full((n, 2), -1, np.int64), np.full((n, 2), np.inf)
    before, price_before = np.full(n, -1, np.int64), np.full(n, np.inf)
    by_start, by_end = np.argsort(start[:, 0]), np.argsort(end[:, 0])
    x_start, x_end = start[by_start, 0], end[by_end, 0]
    found = np.empty(n, np.int64)
    for s in range(n):
        reach = least + gap * size[s]
        for k in range(_near(end[s], reach, start, by_start, x_start, found)):
            j = found[k]
            if size[j] >= size[s]:
                cost = _link(s, j, start, end, first, last, span, size)
                if cost < np.inf:
                    _offer(s, j, cost, after, price_after, before, price_before)
        for k in range(_near(start[s], reach, end, by_end, x_end, found)):
            i = found[k]
            if size[i] > size[s]:
                cost = _link(i, s, start, end, first, last, span, size)
                if cost < np.inf:
                    _offer(i, s, cost, after, price_after, before, price_before)
    return after, before


@njit
def _clashes(k, path, count, span):
    """Whether a piece shares a part of an edge with one that is in the path."""
    clash = False
    for i in range(count):
        clash |= span[k, 0] < span[path[i], 1] and span[path[i], 0] < span[k, 1]
    return clash


@njit
def _follow(path, turn, first, last, span, after, before):
    """Prolong a path of two, forwards and then backwards, until it closes, ends or is once round.

    Returns how many pieces it has, and how much it turns.
    """
    count = 2
    i, j = path[0], path[1]
    total = turn[i] + turn[j] + _angle(last[i, 0], last[i, 1], first[j, 0], first[j, 1])
    for forwards in (True, False):
        while total < ONCE_ROUND and count < MOST_NODES:
            k = after[path[count - 1], 0] if forwards else before[path[0]]
            if k < 0:
                break
            if k == (path[0] if forwards else path[count - 1]):
                return count, total
            if _clashes(k, path, count, span):
                break
            i, j = (path[count - 1], k) if forwards else (k, path[0])
            step = turn[k] + _angle(last[i, 0], last[i, 1], first[j, 0], first[j, 1])
            if total + step > TOO_FAR_ROUND:
                break
            total += step
            if not forwards:
                for m in range(count, 0, -1):
                    path[m] = path[m - 1]
            path[count if forwards else 0] = k
            count += 1
    return count, total


@njit
def _mixed(k):
    """A number's digits mixed, so that sums of a few hardly ever agree."""
    z = np.uint64(k + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit
def paths_of(start, end, first, last, span, size, turn, after, before, least, gap, near):
    """Paths along links that turn by more than ``least``, each set of pieces once.

    Returns the pieces of each, flat; where those of each start; and whether its last leads to its first.
    """
    most = 2 * len(size)
    nodes, count = np.empty((most, MOST_NODES), np.int64), np.zeros(most, np.int64)
    keys = np.empty(most, np.uint64)
    n = 0
    for i in range(len(size)):
        for c in range(2):
            if after[i, c] < 0:
                continue
            nodes[n, 0], nodes[n, 1] = i, after[i, c]
            count[n], total = _follow(nodes[n], turn, first, last, span, after, before)
            if total > least:
                key = np.uint64(0)
                for m in range(count[n]):
                    key += _mixed(nodes[n, m])
                keys[n] = key
                n += 1
    order = np.argsort(keys[:n], kind="mergesort")
    flat, offset = np.empty(n * MOST_NODES, np.int64), np.zeros(n + 1, np.int64)
    closed = np.zeros(n, np.bool_)
    kept = 0
    for k in range(n):
        m = order[k]
        if k > 0 and keys[m] == keys[order[k - 1]]:
            continue
        flat[offset[kept] : offset[kept] + count[m]] = nodes[m, : count[m]]
        offset[kept + 1] = offset[kept] + count[m]
        i, j = nodes[m, count[m] - 1], nodes[m, 0]
        u, v = start[j, 0] - end[i, 0], start[j, 1] - end[i, 1]
        reach = near + gap * min(size[i], size[j])
        if u * u + v * v <= reach * reach:
            closed[kept] = _link(i, j, start, end, first, last, span, size) < np.inf
        kept += 1
    return flat[: offset[kept]], offset[: kept + 1], closed[:kept]
