"""Inner loops of fitted edges, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.vision.fit` and `evifuse.vision.sides` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import asin, sqrt

import numpy as np

from evifuse.vision._kernels_match import main_axis, njit

REACH = 0.08
"""A segment belongs to a side if its middle lies within this share of its length (our own)."""

LEAST_SEEN = 0.15
"""A side of which a smaller share is seen is missing (our own)."""


@njit
def fit_runs(starts, ends, first, gap, tolerance, x, y, belief):
    """Fitted edges [G] of runs of segments [S] in order; ``first`` [G + 1] says where each run starts."""
    order = np.arange(len(starts))
    for g in range(len(belief)):
        belief[g] = _fit_run(starts, ends, order[first[g] : first[g + 1]], gap, tolerance, x[g], y[g])


@njit
def fit_sides(starts, ends, owner, distance, side, polygons, gap, tolerance, x, y, belief):
    """Fitted edges [B, K] of the sides of polygons, from segments [S] and the sides they are nearest to."""
    sides = polygons.shape[1]
    ways, spans = np.empty((len(polygons), sides, 2)), np.empty((len(polygons), sides))
    for b in range(len(polygons)):
        for k in range(sides):
            after = k + 1 if k + 1 < sides else 0
            u, v = polygons[b, after, 0] - polygons[b, k, 0], polygons[b, after, 1] - polygons[b, k, 1]
            spans[b, k] = sqrt(u * u + v * v)
            ways[b, k, 0], ways[b, k, 1] = u / max(spans[b, k], 1e-9), v / max(spans[b, k], 1e-9)
    starts, ends, along = starts.copy(), ends.copy(), np.empty(len(owner))
    seen, until = np.zeros((len(polygons), sides)), np.zeros(len(polygons) * sides + 1, np.int64)
    close = np.zeros(len(owner), np.bool_)
    for i in range(len(owner)):
        b, k = owner[i], side[i]
        close[i] = distance[i] <= REACH * spans[b].sum()
        if close[i]:
            u, v = ways[b, k]
            run = (ends[i, 0] - starts[i, 0]) * u + (ends[i, 1] - starts[i, 1]) * v
            if run < 0:
                for axis in range(2):
                    starts[i, axis], ends[i, axis] = ends[i, axis], starts[i, axis]
            along[i] = (starts[i, 0] + ends[i, 0]) * u + (starts[i, 1] + ends[i, 1]) * v
            seen[b, k] += abs(run)
            until[b * sides + k + 1] += 1
    until = np.cumsum(until)
    order, count = np.empty(until[-1], np.int64), np.zeros(len(polygons) * sides, np.int64)
    for i in range(len(owner)):
        if close[i]:
            group = owner[i] * sides + side[i]
            j = until[group] + count[group]
            while j > until[group] and along[order[j - 1]] > along[i]:
                order[j] = order[j - 1]
                j -= 1
            order[j] = i
            count[group] += 1
    for b in range(len(polygons)):
        for k in range(sides):
            mine = order[until[b * sides + k] : until[b * sides + k + 1]]
            x[b, k, :], y[b, k, :], belief[b, k] = np.nan, np.nan, np.nan
            if seen[b, k] > LEAST_SEEN * spans[b, k]:
                belief[b, k] = _fit_run(starts, ends, mine, gap, tolerance, x[b, k], y[b, k])


@njit
def _fit_run(starts, ends, run, gap, tolerance, x, y):
    """Belief in one fitted edge (section 3.1), and its end points into x and y."""
    total = weight = mx = my = 0.0
    pieces = len(run)
    for n in range(len(run)):
        i = run[n]
        length = _apart(ends[i, 0], ends[i, 1], starts[i, 0], starts[i, 1])
        total += length
        length = max(length, 1e-9)
        weight += 2 * length
        mx += length * (starts[i, 0] + ends[i, 0])
        my += length * (starts[i, 1] + ends[i, 1])
        if n > 0:
            link = _apart(starts[i, 0], starts[i, 1], ends[run[n - 1], 0], ends[run[n - 1], 1])
            if link > gap:
                total += link
                pieces += 1
    mx /= weight
    my /= weight
    xx = xy = yy = 0.0
    for i in run:
        length = max(_apart(ends[i, 0], ends[i, 1], starts[i, 0], starts[i, 1]), 1e-9)
        for p in (starts[i], ends[i]):
            xx += length * (p[0] - mx) ** 2
            xy += length * (p[0] - mx) * (p[1] - my)
            yy += length * (p[1] - my) ** 2
    u, v = main_axis(xx, xy, yy)
    first, last = starts[run[0]], ends[run[-1]]
    t, s = (first[0] - mx) * u + (first[1] - my) * v, (last[0] - mx) * u + (last[1] - my) * v
    x[0], x[1] = mx + t * u, my + t * v
    y[0], y[1] = mx + s * u, my + s * v
    span = abs(s - t)
    if not (total > 0.0 and span > 0.0):
        return 0.0
    angles = np.empty(len(run))
    for n in range(len(run)):
        i = run[n]
        across = abs((ends[i, 0] - starts[i, 0]) * v - (ends[i, 1] - starts[i, 1]) * u)
        length = _apart(ends[i, 0], ends[i, 1], starts[i, 0], starts[i, 1])
        angles[n] = asin(min(across / max(length, 1e-12), 1.0))
    smallest = angles.min()
    near = np.count_nonzero(angles <= smallest + tolerance)
    return min(1.0, span / total) * (1 - np.sin(smallest)) * near / pieces


@njit
def _apart(x, y, u, v):
    """Distance of two points."""
    return sqrt((x - u) ** 2 + (y - v) ** 2)
