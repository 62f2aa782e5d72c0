"""Inner loops that close polygons, compiled by numba on first use and cached on disk.

Every kernel works on C-contiguous arrays whose first dimension counts the outlines. Nothing outside
`evifuse.vision.closing` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import sqrt

import numpy as np

from evifuse.vision._kernels_match import njit

LEAST_GAP = 0.04
"""A side can be hidden only in a gap of more than this share of the hull's length (our own)."""

LEAST_SINE = 0.05
"""Lines within about 3 degrees of parallel don't meet (our own)."""

MOST_EXTENT = 4.0
"""A corner further from the first one than so many lengths of the hull is none (our own)."""


@njit
def where_they_meet(centres, directions, around, polygons):
    """Corners [B, K, 2] where each of K sections meets the one before; NaN for none."""
    count = centres.shape[1]
    for b in range(len(polygons)):
        for k in range(count):
            before = (k if k > 0 else count) - 1
            polygons[b, k] = _crossing(centres[b], directions[b], before, k)
        _check(polygons[b], around[b])


@njit
def across_the_gap(starts, centres, directions, ends, around, polygons):
    """Corners [B, K + 1, 2] of polygons one side of which is hidden in the largest gap; NaN for none.

    Of two sections the ends are joined; the outer ones of three are taken to be as long as the longer one.
    """
    count = centres.shape[1]
    for b in range(len(polygons)):
        first, largest = 0, -1.0
        for k in range(count):
            after = k + 1 if k + 1 < count else 0
            gap = _apart(starts[b, after], ends[b, k])
            if gap > largest:
                first, largest = after, gap
        last = (first + count - 1) % count
        polygon, d = polygons[b], directions[b]
        for k in range(count - 1):
            polygon[k + 1] = _crossing(centres[b], d, (first + k) % count, (first + k + 1) % count)
        if not largest > LEAST_GAP * around[b]:
            polygon[:] = np.nan
        elif count == 2:
            polygon[0], polygon[2] = starts[b, first], ends[b, last]
        else:
            reach = max(_apart(polygon[1], starts[b, first]), _apart(polygon[count - 1], ends[b, last]))
            for i in range(2):
                polygon[0, i] = polygon[1, i] - reach * d[first, i]
                polygon[count, i] = polygon[count - 1, i] + reach * d[last, i]
        _check(polygon, around[b])


@njit
def _crossing(centres, directions, i, j):
    """Where lines i and j cross, as `evifuse.vision.geometry.intersection`."""
    u, v = directions[i], directions[j]
    sine = u[0] * v[1] - u[1] * v[0]
    if abs(sine) < LEAST_SINE:
        return np.array((np.nan, np.nan))
    x, y = centres[j, 0] - centres[i, 0], centres[j, 1] - centres[i, 1]
    return centres[i] + u * ((x * v[1] - y * v[0]) / sine)


@njit
def _apart(p, q):
    """Distance of two points."""
    return sqrt((p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2)


@njit
def _check(polygon, around):
    """NaN for a polygon that turns both ways or reaches far beyond what is seen."""
    count = len(polygon)
    left = right = near = True
    for k in range(count):
        p, q, r = polygon[k - 2], polygon[k - 1], polygon[k]
        turn = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0])
        left &= turn < 0.0
        right &= turn > 0.0
        near &= max(abs(r[0] - polygon[0, 0]), abs(r[1] - polygon[0, 1])) <= MOST_EXTENT * around
    if not (near and (left or right)):
        polygon[:] = np.nan
