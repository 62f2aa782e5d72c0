"""Inner loops that prepare outlines, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.vision.primitives.outline` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import sqrt

import numpy as np

from evifuse.vision._kernels_match import njit


@njit
def prepare(path, sizes, first, points, around, inside, extent):
    """Points at equal steps of each outline [B, N, 2], and length, area and larger side of each hull [B].

    The path holds the points of all outlines; ``first`` says where an edge starts.
    """
    begin = 0
    for b in range(len(sizes)):
        end = begin + sizes[b]
        mine, starts = path[begin:end], first[begin:end]
        hull = _hull(mine)
        around[b], inside[b], x, y = _measures(hull)
        extent[b] = max(np.ptp(hull[:, 0]), np.ptp(hull[:, 1]))
        _at_equal_steps(mine, starts, x, y, points[b])
        begin = end


@njit
def _hull(points):
    """Corners of the convex hull, in order (Andrew, 1979)."""
    order = _from_left(points)
    hull = np.empty((2 * len(points) + 2, 2))
    middle = _chain(points, order, hull, 0, -1.0)
    return hull[: _chain(points, order[::-1], hull, middle, 1.0)]


@njit
def _from_left(points):
    """Places of points in the order of x: by whole pixels first, then those of one pixel."""
    low = np.floor(points[:, 0].min())
    until = np.zeros(int(points[:, 0].max() - low) + 2, np.int64)
    for p in range(len(points)):
        until[int(points[p, 0] - low) + 1] += 1
    until = np.cumsum(until)
    order = np.empty(len(points), np.int64)
    for p in range(len(points)):
        column = int(points[p, 0] - low)
        order[until[column]] = p
        until[column] += 1
    for i in range(1, len(points)):
        p, j = order[i], i
        while j > 0 and points[order[j - 1], 0] > points[p, 0]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = p
    return order


@njit
def _chain(points, order, hull, at, side):
    """The upper (-1) or lower (1) side of a hull on the screen, into it from a place on; the next place."""
    base, i = at, 0
    while i < len(order):
        x, y = points[order[i], 0], points[order[i], 1]
        i += 1
        while i < len(order) and points[order[i], 0] == x:  # of points above each other the outer one
            y = max(side * y, side * points[order[i], 1]) * side
            i += 1
        while at - base > 1 and _turn(hull[at - 2], hull[at - 1], x, y) <= 0.0:
            at -= 1
        hull[at, 0], hull[at, 1] = x, y
        at += 1
    return at


@njit
def _turn(p, q, x, y):
    """Which way a path turns at its second point."""
    return (q[0] - p[0]) * (y - q[1]) - (q[1] - p[1]) * (x - q[0])


@njit
def _measures(polygon):
    """Length, area and centroid of a convex polygon."""
    n = len(polygon)
    length = double = mx = my = 0.0
    ox, oy = polygon[0]
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        u, v = polygon[j, 0] - polygon[i, 0], polygon[j, 1] - polygon[i, 1]
        length += sqrt(u * u + v * v)
        x, y = polygon[i, 0] - ox, polygon[i, 1] - oy
        twice = x * v - y * u
        double += twice
        mx += twice * (2 * x + u)
        my += twice * (2 * y + v)
    if double == 0.0:
        return length, 0.0, ox, oy
    return length, abs(double) / 2, ox + mx / (3 * double), oy + my / (3 * double)


@njit
def _at_equal_steps(path, first, x, y, points):
    """Points at equal steps along edges, from the one farthest from (x, y) on; gaps have no length."""
    n = len(path)
    along = np.empty(n)
    along[0] = 0.0
    farthest, most = 0, -1.0
    for i in range(1, n):
        u, v = path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1]
        along[i] = along[i - 1] + (0.0 if first[i] else sqrt(u * u + v * v))
        u, v = path[i, 0] - x, path[i, 1] - y
        if not first[i] and u * u + v * v > most:  # a corner has an edge before it
            farthest, most = i, u * u + v * v
    length = along[n - 1]
    place, wrapped = farthest, False
    for k in range(len(points)):
        at = along[farthest] + (k + 0.5) / len(points) * length
        if at >= length:
            at -= length
            if not wrapped:
                place, wrapped = 0, True
        while place + 1 < n and along[place + 1] <= at:
            place += 1
        after = min(place + 1, n - 1)
        share = min((at - along[place]) / max(along[after] - along[place], 1e-9), 1.0)
        points[k, 0] = path[place, 0] + share * (path[after, 0] - path[place, 0])
        points[k, 1] = path[place, 1] + share * (path[after, 1] - path[place, 1])
