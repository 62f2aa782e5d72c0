"""Inner loops that measure outlines and write them down, compiled by numba on first use."""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import numba
import numpy as np

from evifuse.vision._kernels_pieces import corners_of

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def _sorted_by_x(x, y, n):
    """Sort the first n points by x, and by y where x is the same; few, and nearly in order."""
    for i in range(1, n):
        p, q = x[i], y[i]
        j = i - 1
        while j >= 0 and (x[j] > p or (x[j] == p and y[j] > q)):
            x[j + 1], y[j + 1] = x[j], y[j]
            j -= 1
        x[j + 1], y[j + 1] = p, q


@njit
def _hull(x, y, n, hx, hy):
    """Convex hull of n points sorted by x (Andrew, 1979), into hx and hy; how many corners."""
    k = 0
    for sweep in range(2):
        base = k if sweep else 1
        for m in range(n - 1 if sweep else n):
            i = n - 2 - m if sweep else m
            while k > base and (hx[k - 1] - hx[k - 2]) * (y[i] - hy[k - 2]) <= (hy[k - 1] - hy[k - 2]) * (
                x[i] - hx[k - 2]
            ):
                k -= 1
            hx[k], hy[k] = x[i], y[i]
            k += 1
    return max(k - 1, 1)


@njit
def measured(corners, span, nodes, offset):
    """Length of the hull, area inside it, and bounds (x0, y0, x1, y1) of paths of pieces."""
    n = len(offset) - 1
    around, inside, box = np.zeros(n), np.zeros(n), np.zeros((n, 4))
    most = 1
    for p in range(n):
        count = 0
        for m in range(offset[p], offset[p + 1]):
            count += span[nodes[m], 1] - span[nodes[m], 0] + 1
        most = max(most, count)
    x, y = np.empty(most), np.empty(most)
    hx, hy = np.empty(2 * most + 2), np.empty(2 * most + 2)
    for p in range(n):
        count = 0
        for m in range(offset[p], offset[p + 1]):
            for i in range(span[nodes[m], 0], span[nodes[m], 1] + 1):
                x[count], y[count] = corners[i, 0], corners[i, 1]
                count += 1
        _sorted_by_x(x, y, count)
        box[p, 0], box[p, 2] = x[0], x[count - 1]
        box[p, 1], box[p, 3] = y[:count].min(), y[:count].max()
        k = _hull(x, y, count, hx, hy)
        twice = 0.0
        for i in range(k):
            j = i + 1 if i + 1 < k else 0
            around[p] += np.hypot(hx[j] - hx[i], hy[j] - hy[i])
            twice += (hx[i] - hx[0]) * (hy[j] - hy[0]) - (hx[j] - hx[0]) * (hy[i] - hy[0])
        inside[p] = abs(twice) / 2
    return around, inside, box


@njit
def without_twins(box, share, least, twins, most):
    """Which bounds, in order, don't nearly equal those of so many before them; at most so many."""
    kept = np.empty(min(most, len(box)), np.int64)
    n = 0
    for i in range(len(box)):
        if n == most:
            break
        tolerance = least + share * max(box[i, 2] - box[i, 0], box[i, 3] - box[i, 1])
        same = 0
        for k in range(n):
            j = kept[k]
            apart = 0.0
            for c in range(4):
                apart = max(apart, abs(box[i, c] - box[j, c]))
            same += apart < tolerance
            if same == twins:
                break
        if same < twins:
            kept[n] = i
            n += 1
    return kept[:n]


@njit
def written_down(points, low, high, back, nodes, offset, least, share):
    """Points of paths of pieces, one path after the other, and the segments that stand for them.

    Returns the points; where each piece starts in them; the corners of each piece, as places in the points;
    where the corners of each piece start. A segment stays within ``least`` px of its points, or the share
    ``share`` of the extent of the path.
    """
    total = 0
    for m in nodes:
        total += high[m] - low[m]
    flat = np.empty((total, 2))
    first = np.zeros(len(nodes) + 1, np.int64)
    tolerance = np.empty(len(nodes))
    for p in range(len(offset) - 1):
        left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
        for m in range(offset[p], offset[p + 1]):
            k = nodes[m]
            size = high[k] - low[k]
            first[m + 1] = first[m] + size
            for i in range(size):
                j = high[k] - 1 - i if back[k] else low[k] + i
                x, y = points[j, 0], points[j, 1]
                flat[first[m] + i, 0], flat[first[m] + i, 1] = x, y
                left, right = min(left, x), max(right, x)
                top, bottom = min(top, y), max(bottom, y)
        for m in range(offset[p], offset[p + 1]):
            tolerance[m] = max(least, share * max(right - left, bottom - top))
    at, corner_first = corners_of(flat, first, tolerance)
    return flat, first, at, corner_first


@njit
def farthest_by_sector(offset, sectors):
    """The farthest point from the origin in each of so many equal directions, those without one left out."""
    best, most = np.full(sectors + 1, -1, np.int64), np.full(sectors + 1, -1.0)
    for i in range(len(offset)):
        x, y = offset[i, 0], offset[i, 1]
        k = int((np.arctan2(y, x) / (2 * np.pi) + 0.5) * sectors)
        if x * x + y * y > most[k]:
            best[k], most[k] = i, x * x + y * y
    return best[best >= 0]
