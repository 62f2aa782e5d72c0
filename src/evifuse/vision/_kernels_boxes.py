"""Inner loops over boxes, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.vision` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import numpy as np

from evifuse.vision._kernels_match import njit


@njit
def connected(low, high, near, group):
    """Number the groups [C] of boxes that are linked by gaps below a share of the larger extent; how many."""
    count = len(low)
    extent = np.empty(count)
    for i in range(count):
        extent[i] = max(high[i, 0] - low[i, 0], high[i, 1] - low[i, 1])
    waiting = np.empty(count, np.int64)
    group[:] = -1
    found = 0
    for first in range(count):
        if group[first] >= 0:
            continue
        group[first] = found
        waiting[0], last = first, 1
        while last > 0:
            last -= 1
            i = waiting[last]
            for j in range(count):
                if group[j] < 0:
                    apart = max(low[i, 0] - high[j, 0], low[j, 0] - high[i, 0])
                    apart = max(apart, low[i, 1] - high[j, 1], low[j, 1] - high[i, 1])
                    if apart <= near * max(extent[i], extent[j]):
                        group[j] = found
                        waiting[last] = j
                        last += 1
        found += 1
    return found


@njit
def mostly_inside(boxes, shared, most, together):
    """Whether of two boxes one has a share in the other and is not so many times smaller [B, B]."""
    count = len(boxes)
    for i in range(count):
        x0, y0, x1, y1 = boxes[i]
        own = (x1 - x0) * (y1 - y0)
        for j in range(count):
            size = (boxes[j, 2] - boxes[j, 0]) * (boxes[j, 3] - boxes[j, 1])
            smaller, larger = min(own, size), max(own, size)
            wide = min(x1, boxes[j, 2]) - max(x0, boxes[j, 0])
            high = min(y1, boxes[j, 3]) - max(y0, boxes[j, 1])
            overlap = max(wide, 0.0) * max(high, 0.0)
            known = own + size == own + size
            together[i, j] = known and overlap > shared * smaller and larger < most * smaller
