"""Inner loops of the ellipses of outlines, compiled by numba on first use and cached on disk.

Every kernel works on C-contiguous arrays whose first dimension counts the outlines. Nothing outside
`evifuse.vision.primitives.ellipses` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

from math import atan2, cos, isfinite, pi, sin, sqrt

import numpy as np

from evifuse.vision._kernels_match import largest_but, njit


@njit
def ellipse_distances(points, ellipses, corners, distance, position):
    """Distances [B, N] of points from ellipses [B, 5] to first order, and where, in sides.

    That is where the ray from the centre meets the polygon that stands for the ellipse; its number of corners
    is a multiple of 4.
    """
    quarter = corners // 4
    t = 0.5 * pi / quarter * np.arange(quarter + 1)
    x, y = np.cos(t), np.sin(t)
    for b in range(points.shape[0]):
        mx, my, along_p, along_q = ellipses[b, 0], ellipses[b, 1], 2 / ellipses[b, 2], 2 / ellipses[b, 3]
        c, s = cos(ellipses[b, 4]), sin(ellipses[b, 4])
        if not isfinite(mx + my + along_p + along_q + c):
            distance[b, :] = np.nan
            position[b, :] = 0.0
            continue
        for i in range(points.shape[1]):
            dx, dy = points[b, i, 0] - mx, points[b, i, 1] - my
            u, v = (c * dx + s * dy) * along_p, (c * dy - s * dx) * along_q
            gauge = sqrt(u * u + v * v)
            slope = sqrt((u * along_p) ** 2 + (v * along_q) ** 2) / max(gauge, 1e-9)
            distance[b, i] = abs(gauge - 1.0) / max(slope, 1e-9)
            along = _in_quarter(abs(u), abs(v), x, y)
            along = along if (u >= 0.0) == (v >= 0.0) else 2 * quarter - along
            position[b, i] = along if v >= 0.0 else 2 * quarter + along


@njit
def _in_quarter(u, v, x, y):
    """Where a ray in the first quarter meets the polygon with corners (x, y) on the unit circle, in sides."""
    low, high = 0, len(x) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if v * x[middle] >= u * y[middle]:
            low = middle
        else:
            high = middle
    before, after = v * x[low] - u * y[low], u * y[high] - v * x[high]
    return low + before / max(before + after, 1e-300)


@njit
def tangency(starts, ends, owner, ellipses, share):
    """Mean [B] over segments of 1 - sin of their angle to the tangent of an ellipse, weighted by length."""
    total = np.zeros(len(share))
    share[:] = 0.0
    for i in range(len(owner)):
        b = owner[i]
        u, v = ends[i, 0] - starts[i, 0], ends[i, 1] - starts[i, 1]
        x, y = (
            (starts[i, 0] + ends[i, 0]) / 2 - ellipses[b, 0],
            (starts[i, 1] + ends[i, 1]) / 2 - ellipses[b, 1],
        )
        c, s = cos(ellipses[b, 4]), sin(ellipses[b, 4])
        p, q = (c * x + s * y) / ellipses[b, 2] ** 2, (c * y - s * x) / ellipses[b, 3] ** 2
        length = sqrt(u * u + v * v)
        across = abs((c * u + s * v) * p + (c * v - s * u) * q)
        off = across / max(length * sqrt(p * p + q * q), 1e-12)
        share[b] += length * (1 - min(off, 1.0) if off == off else np.nan)
        total[b] += length
    for b in range(len(share)):
        share[b] /= max(total[b], 1e-12)


@njit
def corners_of(ellipses, polygons):
    """Points on ellipses [B, 5] at equal steps of the parameter, in order [B, K, 2]."""
    corners = polygons.shape[1]
    t = 2 * pi / corners * np.arange(corners)
    x, y = np.cos(t), np.sin(t)
    for b in range(ellipses.shape[0]):
        p, q = ellipses[b, 2] / 2, ellipses[b, 3] / 2
        c, s = cos(ellipses[b, 4]), sin(ellipses[b, 4])
        for k in range(corners):
            polygons[b, k, 0] = ellipses[b, 0] + c * p * x[k] - s * q * y[k]
            polygons[b, k, 1] = ellipses[b, 1] + s * p * x[k] + c * q * y[k]


@njit
def direct_ellipses(points, away, left_out, ellipses):
    """Ellipses [B, 5] of least algebraic distance (Fitzgibbon et al., 1999); NaN for none.

    Without so many of the points that are farthest away. Centre x and y, long and short axis, direction of
    the long one.
    """
    n = points.shape[1]
    x, y, farthest = np.empty(n), np.empty(n), np.empty(left_out + 1)
    for b in range(points.shape[0]):
        limit = largest_but(away[b], farthest) if left_out > 0 else np.inf
        mx = my = 0.0
        count = 0
        for i in range(n):
            if away[b, i] <= limit:
                x[count], y[count] = points[b, i, 0], points[b, i, 1]
                mx += x[count]
                my += y[count]
                count += 1
        mx /= count
        my /= count
        spread = 0.0
        for i in range(count):
            x[i] -= mx
            y[i] -= my
            spread += x[i] * x[i] + y[i] * y[i]
        spread = sqrt(spread / count)
        ellipses[b, :] = np.nan
        if spread > 0.0:
            x[:count] /= spread
            y[:count] /= spread
            _from_conic(_conic(x[:count], y[:count]), mx, my, spread, ellipses[b])


@njit
def _conic(x, y):
    """Coefficients of xx, xy, yy, x, y and 1 of the best ellipse of centred points; NaN for none.

    The conic a that minimises |D a|^2 with 4 a_xx a_yy - a_xy^2 = 1, in the reduced form of Halir and Flusser
    (1998): the eigenvector of a 3 x 3 matrix at its only eigenvalue that is not negative.
    """
    n = x.shape[0]
    xx = xy = yy = xxx = xxy = xyy = yyy = x4 = x3y = xxyy = xy3 = y4 = 0.0
    for i in range(n):
        p, q, r = x[i] * x[i], x[i] * y[i], y[i] * y[i]
        xx += p
        xy += q
        yy += r
        xxx += p * x[i]
        xxy += p * y[i]
        xyy += r * x[i]
        yyy += r * y[i]
        x4 += p * p
        x3y += p * q
        xxyy += p * r
        xy3 += q * r
        y4 += r * r
    none = (np.nan, np.nan, np.nan, np.nan, np.nan, np.nan)
    whole = xx * yy - xy * xy
    if not whole > 1e-12 * n * n:
        return none
    # what the linear terms (d, e) make of the quadratic ones: (d, e) = -T (a, b, c)
    t0, t1 = (yy * xxx - xy * xxy) / whole, (xx * xxy - xy * xxx) / whole
    t2, t3 = (yy * xxy - xy * xyy) / whole, (xx * xyy - xy * xxy) / whole
    t4, t5 = (yy * xyy - xy * yyy) / whole, (xx * yyy - xy * xyy) / whole
    m00 = x4 - (xxx * t0 + xxy * t1) - xx * xx / n
    m01 = x3y - (xxx * t2 + xxy * t3) - xx * xy / n
    m02 = xxyy - (xxx * t4 + xxy * t5) - xx * yy / n
    m11 = xxyy - (xxy * t2 + xyy * t3) - xy * xy / n
    m12 = xy3 - (xxy * t4 + xyy * t5) - xy * yy / n
    m22 = y4 - (xyy * t4 + yyy * t5) - yy * yy / n
    a, b, c = _eigenvector(m02 / 2, m12 / 2, m22 / 2, -m01, -m11, -m12, m00 / 2, m01 / 2, m02 / 2)
    if not 4 * a * c - b * b > 0.0:
        return none
    d, e = -(t0 * a + t2 * b + t4 * c), -(t1 * a + t3 * b + t5 * c)
    return a, b, c, d, e, -(xx * a + xy * b + yy * c) / n


@njit
def _eigenvector(a, b, c, d, e, f, g, h, i):
    """Eigenvector of [[a, b, c], [d, e, f], [g, h, i]] at the largest of three real eigenvalues."""
    third = (a + e + i) / 3
    minors = a * e - b * d + a * i - c * g + e * i - f * h
    det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    radius = sqrt(max(third * third - minors / 3, 0.0))
    if not radius > 0.0:
        return np.nan, np.nan, np.nan
    cosine = (third**3 - third * minors / 2 + det / 2) / radius**3
    turn = atan2(sqrt(max(1.0 - cosine * cosine, 0.0)), cosine)
    largest = third + 2 * radius * cos(turn / 3)
    a, e, i = a - largest, e - largest, i - largest
    x, y, z = b * f - c * e, c * d - a * f, a * e - b * d
    u, v, w = b * i - c * h, c * g - a * i, a * h - b * g
    if u * u + v * v + w * w > x * x + y * y + z * z:
        x, y, z = u, v, w
    u, v, w = e * i - f * h, f * g - d * i, d * h - e * g
    if u * u + v * v + w * w > x * x + y * y + z * z:
        x, y, z = u, v, w
    return x, y, z


@njit
def _from_conic(conic, mx, my, spread, ellipse):
    """Centre, axes and angle of a conic in centred and scaled coordinates, if it is an ellipse."""
    a, b, c, d, e, f = conic
    if a + c < 0.0:
        a, b, c, d, e, f = -a, -b, -c, -d, -e, -f
    whole = 4 * a * c - b * b
    if not whole > 0.0:
        return
    x, y = (b * e - 2 * c * d) / whole, (b * d - 2 * a * e) / whole
    level = -(f + (d * x + e * y) / 2)
    steep = (a + c + sqrt((a - c) * (a - c) + b * b)) / 2
    flat = whole / 4 / steep
    if not level > 0.0:
        return
    ellipse[0], ellipse[1] = mx + spread * x, my + spread * y
    ellipse[2], ellipse[3] = 2 * spread * sqrt(level / flat), 2 * spread * sqrt(level / steep)
    turn = 0.5 * atan2(b, a - c) + pi / 2
    ellipse[4] = turn if turn < pi / 2 else turn - pi
