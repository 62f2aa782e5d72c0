"""Inner loops that compare outlines with primitives, compiled by numba on first use and cached on disk.

Every kernel works on C-contiguous arrays whose first dimension counts the outlines. Nothing outside
`evifuse.vision` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import exp, sqrt

import numba
import numpy as np

PARTS = 32
"""A part of a primitive, of so many, is seen if a point of the outline is nearest to it (our own)."""

NEAREST = 0.9
"""The fit counts this share of the points, the nearest ones (our own)."""

NEAR_TOLERANCES = 3.0
"""A point within so many tolerances of a primitive is explained by it (our own)."""

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def polygon_distances(points, polygons, distance, position):
    """Distances [B, N] of points from closed polygons [B, K, 2], and the nearest places, in sides."""
    sides = polygons.shape[1]
    side = np.empty((5, sides))
    x, y, u, v, scale = side[0], side[1], side[2], side[3], side[4]
    for b in range(points.shape[0]):
        whole = True
        for k in range(sides):
            after = k + 1 if k + 1 < sides else 0
            x[k], y[k] = polygons[b, k, 0], polygons[b, k, 1]
            u[k], v[k] = polygons[b, after, 0] - x[k], polygons[b, after, 1] - y[k]
            scale[k] = 1.0 / max(u[k] * u[k] + v[k] * v[k], 1e-12)
            whole &= u[k] == u[k] and v[k] == v[k]
        for i in range(points.shape[1]):
            px, py = points[b, i, 0], points[b, i, 1]
            if not (whole and px == px and py == py):
                distance[b, i], position[b, i] = np.nan, 0.0
                continue
            least, place = np.inf, 0.0
            for k in range(sides):
                dx, dy = px - x[k], py - y[k]
                t = min(max((dx * u[k] + dy * v[k]) * scale[k], 0.0), 1.0)
                dx -= t * u[k]
                dy -= t * v[k]
                squared = dx * dx + dy * dy
                if squared < least:
                    least, place = squared, k + t
            distance[b, i], position[b, i] = sqrt(least), place


@njit
def lengths_before(polygons, position, share):
    """Share [B, N] of the length of closed polygons [B, K, 2] that lies before places, in sides."""
    sides = polygons.shape[1]
    until = np.zeros(sides + 1)
    for b in range(position.shape[0]):
        for k in range(sides):
            after = k + 1 if k + 1 < sides else 0
            u, v = polygons[b, after, 0] - polygons[b, k, 0], polygons[b, after, 1] - polygons[b, k, 1]
            until[k + 1] = until[k] + sqrt(u * u + v * v)
        for i in range(position.shape[1]):
            k = min(int(position[b, i]), sides - 1)
            before = until[k] + (position[b, i] - k) * (until[k + 1] - until[k])
            share[b, i] = min(max(before / until[sides], 0.0), 1.0)


@njit
def agree(distance, position, tolerance, most_tolerances, fit, explained, coverage, opening, deviation):
    """All terms of an agreement [B], from distances and places [B, N]; NaN is infinitely far."""
    n = distance.shape[1]
    nearest = int(NEAREST * n)
    farthest = np.empty(n - nearest + 1)
    seen = np.empty(PARTS, np.bool_)
    for b in range(distance.shape[0]):
        if not distance[b, 0] < np.inf:
            fit[b] = explained[b] = coverage[b] = 0.0
            opening[b], deviation[b] = 1.0, most_tolerances * tolerance[b]
            continue
        limit = largest_but(distance[b], farthest)
        near, most = NEAR_TOLERANCES * tolerance[b], most_tolerances * tolerance[b]
        seen[:] = False
        squares = capped = 0.0
        inner = close = 0
        for i in range(n):
            away = distance[b, i]
            if away < limit:
                squares += away * away
                inner += 1
            if away <= near:
                close += 1
                seen[min(int(position[b, i] * PARTS), PARTS - 1)] = True
            capped += min(away, most) ** 2
        squares += (nearest - inner) * limit * limit
        fit[b] = exp(-0.5 * squares / nearest / tolerance[b] ** 2)
        explained[b] = close / n
        deviation[b] = sqrt(capped / n)
        coverage[b], opening[b] = _covered(seen)


@njit
def largest_but(values, largest):
    """The n-th largest value, none negative; n is the size of the scratch array."""
    largest[:] = -1.0
    last = largest.shape[0] - 1
    for value in values:
        if value > largest[last]:
            i = last
            while i > 0 and largest[i - 1] < value:
                largest[i] = largest[i - 1]
                i -= 1
            largest[i] = value
    return largest[last]


@njit
def _covered(seen):
    """Share of the parts of a closed outline that are seen, and of the longest run that is not."""
    parts = seen.shape[0]
    count = run = longest = 0
    for i in range(2 * parts):
        if seen[i % parts]:
            count += i < parts
            run = 0
        else:
            run += 1
            longest = max(longest, run)
    return count / parts, min(longest, parts) / parts


@njit
def main_axis(xx, xy, yy):
    """Unit direction of the larger moment, by half angles; along x if none is larger."""
    difference, root = xx - yy, sqrt((xx - yy) * (xx - yy) + 4.0 * xy * xy)
    if root == 0.0:
        return 1.0, 0.0
    u = sqrt(0.5 * (1.0 + abs(difference) / root))
    v = abs(xy) / (root * u)
    if difference < 0.0:
        u, v = v, u
    return u, (v if xy >= 0.0 else -v)
