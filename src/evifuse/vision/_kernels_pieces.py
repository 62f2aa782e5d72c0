"""Inner loops that straighten edges and cut them into convex pieces, compiled by numba on first use.

Edges are flat: points one edge after the other, and where each edge starts.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import atan2

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def _farthest(points, low, high):
    """The point between two others farthest from the segment that joins them; its squared distance."""
    x, y = points[low, 0], points[low, 1]
    u, v = points[high, 0] - x, points[high, 1] - y
    squared = u * u + v * v
    worst, most = low, -1.0
    for i in range(low + 1, high):
        p, q = points[i, 0] - x, points[i, 1] - y
        t = (p * u + q * v) / squared if squared > 0 else 0.0
        t = min(max(t, 0.0), 1.0)
        p -= t * u
        q -= t * v
        away = p * p + q * q
        if away > most:
            worst, most = i, away
    return worst, most


@njit
def _mark_corners(points, low, high, tolerance, keep, stack):
    """Mark the points from low to before high that the polygonal line near them needs."""
    keep[low] = True
    keep[high - 1] = True
    stack[0, 0], stack[0, 1] = low, high - 1
    depth = 1
    while depth > 0:
        depth -= 1
        a, b = stack[depth, 0], stack[depth, 1]
        worst, most = _farthest(points, a, b)
        if most > tolerance * tolerance:
            keep[worst] = True
            stack[depth, 0], stack[depth, 1] = a, worst
            stack[depth + 1, 0], stack[depth + 1, 1] = worst, b
            depth += 2


@njit
def corners_of(points, offset, tolerance):
    """Corners of polygonal lines that stay near edges (Douglas and Peucker, 1973).

    ``offset`` has one entry more than there are edges, ``tolerance`` one for each. Returns the places of the
    corners in the points, and where the corners of each edge start.
    """
    keep = np.zeros(len(points), np.bool_)
    stack = np.empty((len(points) + 2, 2), np.int64)
    first = np.zeros(len(offset), np.int64)
    for k in range(len(offset) - 1):
        low, high = offset[k], offset[k + 1]
        if high > low:
            _mark_corners(points, low, high, tolerance[k], keep, stack)
        count = 0
        for i in range(low, high):
            count += keep[i]
        first[k + 1] = first[k] + count
    return np.flatnonzero(keep), first


@njit
def turns_of(points, at):
    """Turn at each corner, clockwise on the screen, and the length and the turn of all before it."""
    turn, walked, turned = np.zeros(len(at)), np.zeros(len(at)), np.zeros(len(at))
    for i in range(1, len(at)):
        u = points[at[i], 0] - points[at[i - 1], 0]
        v = points[at[i], 1] - points[at[i - 1], 1]
        walked[i] = walked[i - 1] + np.sqrt(u * u + v * v)
        turned[i] = turned[i - 1] + turn[i - 1]
        if i < len(at) - 1:
            p = points[at[i + 1], 0] - points[at[i], 0]
            q = points[at[i + 1], 1] - points[at[i], 1]
            turn[i] = atan2(u * q - v * p, u * p + v * q)
    return turn, walked, turned


@njit
def _cut(turn, low, high, bend, most, cuts):
    """Corners from low to high where an edge bends back, into ``cuts``; how many."""
    count = 1
    cuts[0] = low
    start, total, highest, lowest, at_high, at_low = low, 0.0, 0.0, 0.0, low, low
    i = low + 1
    while i < high:
        total += turn[i]
        left = highest > -lowest
        bent = total < highest - bend if left else total > lowest + bend
        bent = bent and max(highest, -lowest) > bend
        if bent or abs(turn[i]) > most:
            start = max((at_high if left else at_low) if bent else i, start + 1)
            cuts[count] = start
            count += 1
            total = 0.0
            for j in range(start + 1, i + 1):
                total += turn[j]
            highest, lowest = max(total, 0.0), min(total, 0.0)
            at_high = at_low = i
        else:
            if total > highest:
                highest, at_high = total, i + 1
            if total < lowest:
                lowest, at_low = total, i + 1
        i += 1
    cuts[count] = high
    return count + 1


@njit
def _add(found, count, at, chain, a, b, trimmed, shortest):
    """Note a piece if it is long enough; how many there are then."""
    if b > a and at[b] - at[a] + 1 >= shortest:
        found[count, 0], found[count, 1], found[count, 2], found[count, 3] = chain, a, b, trimmed
        return count + 1
    return count


@njit
def pieces_of(at, first, turn, bend, corner, most, shortest):
    """Convex pieces: edge, first and last corner, and whether it is one without its ends, for each.

    A run between two places where the edge bends back is there as a whole, in the parts between its sharp
    corners, and without its first part, its last, and both.
    """
    found = np.empty((8 * len(at) + 8, 4), np.int64)
    cuts, sharp = np.empty(len(at) + 2, np.int64), np.empty(len(at) + 2, np.int64)
    n = 0
    for k in range(len(first) - 1):
        low, high = first[k], first[k + 1] - 1
        if high <= low:
            continue
        for c in range(_cut(turn, low, high, bend, most, cuts) - 1):
            a, b = cuts[c], cuts[c + 1]
            count = 0
            for i in range(a + 1, b):
                if abs(turn[i]) > corner:
                    sharp[count] = i
                    count += 1
            n = _add(found, n, at, k, a, b, 0, shortest)
            if count > 0:
                n = _add(found, n, at, k, a, sharp[0], 0, shortest)
                for i in range(count - 1):
                    n = _add(found, n, at, k, sharp[i], sharp[i + 1], 0, shortest)
                n = _add(found, n, at, k, sharp[count - 1], b, 0, shortest)
            if count > 1:
                n = _add(found, n, at, k, sharp[0], b, 1, shortest)
                n = _add(found, n, at, k, a, sharp[count - 1], 1, shortest)
            if count > 2:
                n = _add(found, n, at, k, sharp[0], sharp[count - 1], 1, shortest)
    return found[:n]
