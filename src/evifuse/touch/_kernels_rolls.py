"""Inner loops over the samples of a roll, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch` calls them. They give what their NumPy twins in the tests give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

from evifuse.touch._kernels_health import median, quantile, select

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def solve(system, target, least):
    """Put the inverse of a positive definite system (n, n) in its place, and solutions in targets (n, m).

    By Gauss-Jordan steps on the diagonal; False if a pivot is not larger than the least.
    """
    n, m = target.shape
    for k in range(n):
        pivot = system[k, k]
        if not pivot > least:
            return False
        system[k, k] = 1.0
        for j in range(n):
            system[k, j] /= pivot
        for j in range(m):
            target[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = system[i, k]
                system[i, k] = 0.0
                for j in range(n):
                    system[i, j] -= factor * system[k, j]
                for j in range(m):
                    target[i, j] -= factor * target[k, j]
    return True


@njit
def in_frame(position, normal, roll, origin, frame):
    """Positions and normals (M, 3) of a roll's samples in a frame (3, 3) whose axes are its columns."""
    count = roll.shape[0]
    place, facing = np.empty((count, 3)), np.empty((count, 3))
    for m in range(count):
        t = roll[m]
        x, y, z = position[t, 0] - origin[0], position[t, 1] - origin[1], position[t, 2] - origin[2]
        for k in range(3):
            place[m, k] = x * frame[0, k] + y * frame[1, k] + z * frame[2, k]
            facing[m, k] = (
                normal[t, 0] * frame[0, k] + normal[t, 1] * frame[1, k] + normal[t, 2] * frame[2, k]
            )
    return place, facing


@njit
def heading_of(place):
    """Principal axis of a path (M, 2 or 3) in the plane of its first two columns, the way that it went."""
    count = place.shape[0]
    mx = my = 0.0
    for m in range(count):
        mx, my = mx + place[m, 0], my + place[m, 1]
    mx, my = mx / count, my / count
    xx = xy = yy = 0.0
    for m in range(count):
        x, y = place[m, 0] - mx, place[m, 1] - my
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    c, s = np.cos(angle), np.sin(angle)
    if c * (place[-1, 0] - place[0, 0]) + s * (place[-1, 1] - place[0, 1]) < 0:
        c, s = -c, -s
    return c, s


@njit
def roll_blocks(place, facing, psi, roll, c, s, step, most):
    """Means (B, 6) over equal steps along the heading (c, s), and weights (B,) of at most 1.

    Columns: place along, across and up, tilt of the normal along and across, joint angle.
    """
    count = roll.shape[0]
    rows = np.empty((count, 6))
    low, high = np.inf, -np.inf
    for m in range(count):
        x, y = place[m, 0], place[m, 1]
        rows[m, 0], rows[m, 1], rows[m, 2] = x * c + y * s, y * c - x * s, place[m, 2]
        sine = np.sqrt(facing[m, 0] ** 2 + facing[m, 1] ** 2)
        scale = np.arctan2(sine, facing[m, 2]) / sine if sine > 1e-9 else 1.0
        p, q = facing[m, 0] * scale, facing[m, 1] * scale
        rows[m, 3], rows[m, 4], rows[m, 5] = p * c + q * s, q * c - p * s, psi[roll[m]]
        low, high = min(low, rows[m, 0]), max(high, rows[m, 0])
    extent = max(high - low, 1e-15)
    pieces = int(min(max(np.rint(extent / step), 4.0), most))
    sums, size = np.zeros((pieces, 6)), np.zeros(pieces)
    for m in range(count):
        label = min(int((rows[m, 0] - low) * (pieces / extent)), pieces - 1)
        size[label] += 1.0
        for k in range(6):
            sums[label, k] += rows[m, k]
    kept = 0
    for b in range(pieces):
        if size[b] > 0:
            size[kept] = size[b]
            for k in range(6):
                sums[kept, k] = sums[b, k] / size[b]
            kept += 1
    middle = median(size[:kept].copy(), kept)
    return sums[:kept], np.sqrt(np.minimum(size[:kept] / middle, 1.0))


@njit
def powers_of(x, scale, order, weight):
    """Weighted powers (B, order + 1) of x over its scale."""
    out = np.empty((x.shape[0], order + 1))
    for b in range(x.shape[0]):
        value, step = weight[b], x[b] / scale
        for k in range(order + 1):
            out[b, k] = value
            value *= step
    return out


@njit
def normal_equations(rows, values):
    """Products rows' rows (n, n) and rows' values (n, m) of rows (B, n) and values (B, m)."""
    count, n, m = rows.shape[0], rows.shape[1], values.shape[1]
    system, target = np.zeros((n, n)), np.zeros((n, m))
    for b in range(count):
        for i in range(n):
            for j in range(n):
                system[i, j] += rows[b, i] * rows[b, j]
            for k in range(m):
                target[i, k] += rows[b, i] * values[b, k]
    return system, target


@njit
def arc_length(path, weight, nodes, shares):
    """Arc length (B,) of a path (B, 3), 0 next to the origin, and the path's slope dy/dx there."""
    count = path.shape[0]
    x = path[:, 0].copy()
    scale = np.abs(x).max()
    order = min(3, count - 1)
    powers = powers_of(x, scale, order, weight)
    system, fitted = normal_equations(powers, path[:, 1:] * weight.reshape(-1, 1))
    solve(system, fitted, 1e-14)
    start = min(max(0.0, x.min()), x.max())
    arc = np.zeros(count)
    for b in range(count):
        for g in range(nodes.shape[0]):
            at = (start + (x[b] - start) * (0.5 * (nodes[g] + 1))) / scale
            p = q = 0.0
            for k in range(order, 0, -1):
                p, q = p * at + k * fitted[k, 0] / scale, q * at + k * fitted[k, 1] / scale
            arc[b] += np.sqrt(1 + p * p + q * q) * 0.5 * shares[g]
        arc[b] *= x[b] - start
    lateral = 0.0
    for k in range(order, 0, -1):
        lateral = lateral * (start / scale) + k * fitted[k, 0] / scale
    return arc, lateral


@njit
def rates_of(arc, values, weight):
    """Derivatives (C,) of the values (B, C) at arc 0, and their standard errors.

    A line, unless a quadratic or a cubic is better by the Bayesian information criterion: curvature that
    changes along the roll then doesn't pull the value at the site.
    """
    count, columns = values.shape
    scale = np.abs(arc).max()
    best = np.full(columns, np.inf)
    rate, error = np.zeros(columns), np.zeros(columns)
    weighted = values * weight.reshape(-1, 1)
    for order in range(1, min(3, count - 2) + 1):
        powers = powers_of(arc, scale, order, weight)
        system, solution = normal_equations(powers, weighted)
        if not solve(system, solution, 1e-14):
            break
        for k in range(columns):
            squares = 1e-20 * count
            for b in range(count):
                left = weighted[b, k]
                for i in range(order + 1):
                    left -= powers[b, i] * solution[i, k]
                squares += left * left
            score = count * np.log(squares / count) + (order + 1) * np.log(count)
            if score < best[k] - 2:
                best[k] = score
                rate[k] = solution[1, k] / scale
                error[k] = np.sqrt(squares / (count - order - 1) * system[1, 1]) / scale
    return rate, error


@njit
def roll_rates(position, normal, psi, roll, origin, frame, step, most, nodes, shares):
    """How fast the normal tilts along and across a roll and the joint turns (3,), and the errors (3,).

    Also the heading (2,) of the roll in the frame, and its slope against that at the origin.
    """
    place, facing = in_frame(position, normal, roll, origin, frame)
    c, s = heading_of(place)
    rows, weight = roll_blocks(place, facing, psi, roll, c, s, step, most)
    arc, slope = arc_length(rows[:, :3].copy(), weight, nodes, shares)
    rate, error = rates_of(arc, rows[:, 3:].copy(), weight)
    return rate, error, c, s, slope


@njit
def mean_of(values, samples):
    """Mean (3,) of the rows (T, 3) of some samples."""
    total = np.zeros(3)
    for t in samples:
        total[0] += values[t, 0]
        total[1] += values[t, 1]
        total[2] += values[t, 2]
    return total / samples.shape[0]


@njit
def least_along(values, samples, direction):
    """Smallest component along a direction (3,) of the rows (T, 3) of some samples."""
    least = np.inf
    for t in samples:
        along = values[t, 0] * direction[0] + values[t, 1] * direction[1] + values[t, 2] * direction[2]
        least = min(least, along)
    return least


@njit
def smooth_path(position, samples, first, second, window):
    """Way (M, 2) of some samples along two axes, each the mean of up to 2 window + 1 of them."""
    count = samples.shape[0]
    total, out = np.zeros((count + 1, 2)), np.empty((count, 2))
    for m in range(count):
        x, y, z = position[samples[m]]
        total[m + 1, 0] = total[m, 0] + x * first[0] + y * first[1] + z * first[2]
        total[m + 1, 1] = total[m, 1] + x * second[0] + y * second[1] + z * second[2]
    for m in range(count):
        low, high = max(m - window, 0), min(m + window + 1, count)
        out[m, 0] = (total[high, 0] - total[low, 0]) / (high - low)
        out[m, 1] = (total[high, 1] - total[low, 1]) / (high - low)
    return out


@njit
def corner_of(path, start, stop):
    """Point where a part of a path (M, 2) leaves its chord most, or turns back; by how much; its extent."""
    ax, ay = path[start, 0], path[start, 1]
    cx, cy = path[stop - 1, 0] - ax, path[stop - 1, 1] - ay
    squared = cx * cx + cy * cy
    length = max(np.sqrt(squared), 1e-12)
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    most, furthest = -1.0, 0
    ahead, turned = -np.inf, 0
    back, reversal = -1.0, 0
    for m in range(start, stop):
        x, y = path[m, 0], path[m, 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
        along = (x - ax) * cx + (y - ay) * cy
        share = min(max(along / squared, 0.0), 1.0) if squared > 0 else 0.0
        p, q = x - ax - share * cx, y - ay - share * cy
        aside = np.sqrt(p * p + q * q)
        if aside > most:
            most, furthest = aside, m - start
        along /= length
        if along > ahead:
            ahead, turned = along, m - start
        if ahead - along > back:
            back, reversal = ahead - along, turned
    extent = np.sqrt((high_x - low_x) ** 2 + (high_y - low_y) ** 2)
    if back > most:
        return reversal, back, extent
    return furthest, most, extent


@njit
def middle_of(position, roll, share):
    """Mean (3,) of the samples nearest to half way along a roll: one of so many, earlier ones first."""
    count = roll.shape[0]
    a, b = position[roll[0]], position[roll[-1]]
    wx, wy, wz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    apart = np.empty(count)
    for m in range(count):
        x, y, z = position[roll[m]]
        apart[m] = (x - a[0]) * wx + (y - a[1]) * wy + (z - a[2]) * wz
    half = 0.5 * apart[count - 1]
    for m in range(count):
        apart[m] = abs(apart[m] - half)
    wanted = max(1, count // share)
    limit = select(apart.copy(), count, wanted - 1)
    below = 0
    for m in range(count):
        below += apart[m] < limit
    ties = wanted - below
    total = np.zeros(3)
    for m in range(count):
        if apart[m] < limit or (apart[m] == limit and ties > 0):
            ties -= apart[m] == limit
            x, y, z = position[roll[m]]
            total[0], total[1], total[2] = total[0] + x, total[1] + y, total[2] + z
    return total / wanted


@njit
def normal_near(position, normal, samples, centre, share):
    """Sum (3,) of the normals of those samples that are nearest to a centre: a share of them."""
    count = samples.shape[0]
    apart = np.empty(count)
    for m in range(count):
        x, y, z = position[samples[m]]
        apart[m] = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
    limit = quantile(apart.copy(), count, share)
    total = np.zeros(3)
    for m in range(count):
        if apart[m] <= limit:
            x, y, z = normal[samples[m]]
            total[0], total[1], total[2] = total[0] + x, total[1] + y, total[2] + z
    return total


@njit
def roll_pieces(position, normal, quaternions, pole, roll, step, fewest, most):
    """Means (B, 9) of centre, normal and turned pole over equal steps of a roll's way, and sizes (B,).

    Pieces follow each other in time. The way is smoothed first: a piece that is chosen by a noisy coordinate
    has a biased mean.
    """
    count = roll.shape[0]
    a, b = position[roll[0]], position[roll[-1]]
    wx, wy, wz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = max(np.sqrt(wx * wx + wy * wy + wz * wz), 1e-12)
    total = np.zeros(count + 1)
    for m in range(count):
        x, y, z = position[roll[m]]
        total[m + 1] = total[m] + (x * wx + y * wy + z * wz) / length
    window = max(1, count // 40)
    smooth, furthest = np.empty(count), -np.inf
    for m in range(count):
        low, high = max(m - window, 0), min(m + window + 1, count)
        furthest = max(furthest, (total[high] - total[low]) / (high - low))
        smooth[m] = furthest
    extent = max(smooth[-1] - smooth[0], 1e-12)
    pieces = int(min(max(np.rint(extent / step), fewest), most))
    sums, size = np.zeros((pieces, 9)), np.zeros(pieces)
    for m in range(count):
        t = roll[m]
        label = min(int((smooth[m] - smooth[0]) * (pieces / extent)), pieces - 1)
        size[label] += 1.0
        x, y, z, w = quaternions[t]
        p, q, r = (
            2 * (y * pole[2] - z * pole[1]),
            2 * (z * pole[0] - x * pole[2]),
            2 * (x * pole[1] - y * pole[0]),
        )
        for k in range(3):
            sums[label, k] += position[t, k]
            sums[label, 3 + k] += normal[t, k]
        sums[label, 6] += pole[0] + w * p + y * r - z * q
        sums[label, 7] += pole[1] + w * q + z * p - x * r
        sums[label, 8] += pole[2] + w * r + x * q - y * p
    kept = 0
    for piece in range(pieces):
        if size[piece] > 0:
            size[kept] = size[piece]
            for k in range(9):
                sums[kept, k] = sums[piece, k] / size[piece]
            kept += 1
    return sums[:kept], size[:kept]


@njit
def mean_touched(normal, touching, start, stop):
    """Mean (3,) of the normals of the samples with contact from start to stop."""
    total, count = np.zeros(3), 0
    for t in range(start, stop):
        if touching[t]:
            count += 1
            for k in range(3):
                total[k] += normal[t, k]
    return total / count


@njit
def off_the_arc(position, normal, touching, before, start, around, share):
    """A quantile of how far a way without contact is from the arc that the normals around it ask for.

    The way goes from sample ``before`` to sample ``start``.
    """
    count = start - before + 1
    a, chord = position[before], position[start] - position[before]
    length = np.sqrt(chord[0] ** 2 + chord[1] ** 2 + chord[2] ** 2)
    aside = np.empty(count)
    if length == 0:
        for m in range(count):
            x, y, z = position[before + m] - a
            aside[m] = np.sqrt(x * x + y * y + z * z)
        return select(aside, count, int(share * (count - 1)))
    first = mean_touched(normal, touching, max(before - around, 0), before + 1)
    second = mean_touched(normal, touching, start, min(start + around + 1, len(touching)))
    ahead, outward = chord / length, first + second
    turn = along = 0.0
    for k in range(3):
        along += outward[k] * ahead[k]
        turn += (second[k] - first[k]) * ahead[k]
    outward -= along * ahead
    outward /= max(np.sqrt(outward[0] ** 2 + outward[1] ** 2 + outward[2] ** 2), 1e-12)
    sine = min(max(0.5 * turn, -0.99), 0.99)  # of half the angle of the arc
    radius = 0.5 * length / max(abs(sine), 1e-6)
    flat, sign = radius * np.sqrt(1 - sine * sine), np.sign(sine)
    for m in range(count):
        way = position[before + m] - a
        part = (way[0] * ahead[0] + way[1] * ahead[1] + way[2] * ahead[2]) / length
        part = min(max(part, 0.0), 1.0)
        deep = sign * (np.sqrt(radius * radius - ((part - 0.5) * length) ** 2) - flat)
        squared = 0.0
        for k in range(3):
            squared += (way[k] - part * chord[k] - deep * outward[k]) ** 2
        aside[m] = np.sqrt(squared)
    return select(aside, count, int(share * (count - 1)))
