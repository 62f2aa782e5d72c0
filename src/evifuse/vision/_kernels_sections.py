"""Inner loops of the straight sections of outlines, compiled by numba on first use and cached on disk.

Every kernel works on C-contiguous arrays whose first dimension counts the outlines. Nothing outside
`evifuse.vision.sections` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import ceil, sqrt

import numpy as np

from evifuse.vision._kernels_match import largest_but, main_axis, njit

LEAST_TRIMMED = 6
"""A section of so many points is fitted without its first and its last (our own)."""

KEPT = 0.9
"""A line is fitted to this share of its points, the nearest ones (our own)."""


@njit
def divide(points, price, cells, bounds, cost):
    """Bounds [B, K, K, 2] of the best 1 to K sections, in points; what they cost [B, K], square px."""
    count, most = cost.shape
    per_cell = points.shape[1] // cells
    lines = np.empty((cells, cells))
    least, before = np.empty(cells), np.empty(cells + 1)
    start, end = np.zeros((most, cells + 1), np.int32), np.zeros((most, cells + 1), np.int32)
    for b in range(count):
        _costs_of_lines(points[b], cells, per_cell, lines)
        left_out = price[b] * per_cell
        for i in range(cells + 1):
            before[i] = left_out * i
        for k in range(most):
            _one_more(before, lines, left_out, least, start[k], end[k])
            cost[b, k] = before[cells]
            at = cells
            for section in range(k, -1, -1):
                bounds[b, k, section, 1] = end[section, at] * per_cell
                at = start[section, end[section, at]]
                bounds[b, k, section, 0] = at * per_cell


@njit
def _costs_of_lines(points, cells, per_cell, lines):
    """Squared distances of the points of cells i to j from their best line, for j > i; [cells, cells]."""
    n = points.shape[0]
    mx = my = 0.0
    for i in range(n):
        mx += points[i, 0]
        my += points[i, 1]
    mx /= n
    my /= n
    sums = np.zeros((5, cells + 1))
    for c in range(cells):
        x = y = xx = xy = yy = 0.0
        for i in range(c * per_cell, (c + 1) * per_cell):
            u, v = points[i, 0] - mx, points[i, 1] - my
            x += u
            y += v
            xx += u * u
            xy += u * v
            yy += v * v
        sums[0, c + 1] = sums[0, c] + x
        sums[1, c + 1] = sums[1, c] + y
        sums[2, c + 1] = sums[2, c] + xx
        sums[3, c + 1] = sums[3, c] + xy
        sums[4, c + 1] = sums[4, c] + yy
    sx, sy, sxx, sxy, syy = sums[0], sums[1], sums[2], sums[3], sums[4]
    for i in range(cells):
        for j in range(i + 1, cells):
            share = 1.0 / (per_cell * (j - i + 1))
            x, y = sx[j + 1] - sx[i], sy[j + 1] - sy[i]
            xx = sxx[j + 1] - sxx[i] - x * x * share
            xy = sxy[j + 1] - sxy[i] - x * y * share
            yy = syy[j + 1] - syy[i] - y * y * share
            lines[i, j] = max(0.0, 0.5 * (xx + yy - sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy)))


@njit
def _one_more(cost, lines, left_out, least, start, end):
    """Least cost [cells + 1] of the first n cells with one section more; where that starts and ends."""
    cells = least.shape[0]
    least[:] = np.inf
    start[:] = 0
    for i in range(cells - 1):
        row, so_far, begin = lines[i, i + 1 :], least[i + 1 :], start[i + 2 :]
        for j in range(cells - 1 - i):  # no branch: several at once
            total = cost[i] + row[j]
            better = total < so_far[j]
            so_far[j] = total if better else so_far[j]
            begin[j] = i if better else begin[j]
    best = np.inf
    at = 0
    cost[0] = np.inf
    end[0] = 0
    for j in range(cells):
        ending = least[j] - left_out * (j + 1)
        if ending <= best:
            best = ending
            at = j + 1
        end[j + 1] = at
        cost[j + 1] = best + left_out * (j + 1)


@njit
def fit_sections(points, bounds, starts, ends, centres, directions):
    """Lines through the points from the first to before the second bound of each section [B, K, 2].

    The points next to a bound, which may lie on the round of a corner, and then the farthest tenth are
    left out.
    """
    n = points.shape[1]
    xs, ys, away, farthest = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for b in range(bounds.shape[0]):
        for i in range(n):
            xs[i], ys[i] = points[b, i, 0], points[b, i, 1]
        for k in range(bounds.shape[1]):
            low, high = bounds[b, k, 0], bounds[b, k, 1]
            first, last = min(low, n - 1), max(high - 1, 0)
            if high - low >= LEAST_TRIMMED:
                low += 1
                high -= 1
            away[low:high] = 0.0
            x, y, u, v = _line(xs, ys, away, low, high, 0.0)
            for i in range(low, high):
                away[i] = abs((xs[i] - x) * v - (ys[i] - y) * u)
            left_out = (high - low) - max(ceil(KEPT * (high - low)), 1)
            x, y, u, v = _line(xs, ys, away, low, high, largest_but(away[low:high], farthest[: left_out + 1]))
            if (xs[last] - xs[first]) * u + (ys[last] - ys[first]) * v < 0.0:
                u, v = -u, -v
            t = (xs[first] - x) * u + (ys[first] - y) * v
            s = (xs[last] - x) * u + (ys[last] - y) * v
            centres[b, k, 0], centres[b, k, 1] = x, y
            directions[b, k, 0], directions[b, k, 1] = u, v
            starts[b, k, 0], starts[b, k, 1] = x + t * u, y + t * v
            ends[b, k, 0], ends[b, k, 1] = x + s * u, y + s * v


@njit
def _line(xs, ys, away, low, high, limit):
    """Centre and direction of the line through those points that are no further away than a limit."""
    mx = my = count = 0.0
    for i in range(low, high):
        weight = 1.0 if away[i] <= limit else 0.0
        mx += weight * xs[i]
        my += weight * ys[i]
        count += weight
    mx /= max(count, 1.0)
    my /= max(count, 1.0)
    xx = xy = yy = 0.0
    for i in range(low, high):
        weight = 1.0 if away[i] <= limit else 0.0
        dx, dy = xs[i] - mx, ys[i] - my
        xx += weight * dx * dx
        xy += weight * dx * dy
        yy += weight * dy * dy
    u, v = main_axis(xx, xy, yy)
    return mx, my, u, v
