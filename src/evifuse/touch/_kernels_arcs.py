"""Inner loops over the pieces of rolls that cross a rounding, compiled by numba and cached on disk.

Nothing outside `evifuse.touch.rounding` calls them. They give what their NumPy twins in the tests give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

from evifuse.touch._kernels_health import median, quantile
from evifuse.touch._kernels_rolls import heading_of, in_frame, solve

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def piece_means(place, normal, most):
    """Means (B, 3) of places and normals (M, 3) over equal pieces, and how steady the third place is."""
    samples = place.shape[0]
    count = min(most, samples // 3)
    means, facing = np.zeros((count, 3)), np.zeros((count, 3))
    for b in range(count):
        start = b * samples // count
        stop = (b + 1) * samples // count if b + 1 < count else samples
        for m in range(start, stop):
            for k in range(3):
                means[b, k] += place[m, k]
                facing[b, k] += normal[m, k]
        for k in range(3):
            means[b, k] /= stop - start
            facing[b, k] /= stop - start
    second = np.empty(samples - 2)
    for m in range(samples - 2):
        second[m] = abs(place[m + 2, 2] - 2 * place[m + 1, 2] + place[m, 2])
    steady = median(second, samples - 2) / (0.6745 * np.sqrt(6.0)) / np.sqrt(samples / count)
    return means, facing, steady


@njit
def spread_of(directions):
    """Smallest angle that holds all directions (R,), being lines, radians."""
    ordered = directions % np.pi
    for r in range(1, ordered.shape[0]):  # there are few: np.sort takes longer to compile
        for k in range(r, 0, -1):
            if ordered[k] < ordered[k - 1]:
                ordered[k], ordered[k - 1] = ordered[k - 1], ordered[k]
    widest = ordered[0] + np.pi - ordered[-1]
    for r in range(1, ordered.shape[0]):
        widest = max(widest, ordered[r] - ordered[r - 1])
    return np.pi - widest


@njit
def bend_of(places):
    """Second derivatives xx, xy, yy of the height over a plane, by least squares over places (B, 3)."""
    scale = 1e-12
    for b in range(places.shape[0]):
        scale = max(scale, abs(places[b, 0]), abs(places[b, 1]))
    system, target, row = np.zeros((6, 6)), np.zeros((6, 1)), np.empty(6)
    for b in range(places.shape[0]):
        x, y = places[b, 0] / scale, places[b, 1] / scale
        row[0], row[1], row[2], row[3], row[4], row[5] = 1.0, x, y, x * x, x * y, y * y
        for i in range(6):
            target[i, 0] += row[i] * places[b, 2]
            for j in range(6):
                system[i, j] += row[i] * row[j]
    for i in range(6):
        system[i, i] += 1e-9 * places.shape[0]
    solve(system, target, 0.0)
    return 2 * target[3, 0], target[4, 0], 2 * target[5, 0]


@njit
def turn_of(place, normal, bend, bent):
    """Direction in which a normal turns, its angle (B,) in that plane, and a doubt (below 0: none)."""
    count = place.shape[0]
    c, s = heading_of(normal)
    doubt = -1.0
    if bent:
        x, y = place[-1, 0] - place[0, 0], place[-1, 1] - place[0, 1]
        p, q = bend[0] * x + bend[1] * y, bend[1] * x + bend[2] * y
        length = max(np.sqrt(p * p + q * q), 1e-15)
        p, q = p / length, q / length
        doubt = np.arccos(min(abs(c * p + s * q), 1.0))
        c, s = p, q
    if c * (normal[-1, 0] - normal[0, 0]) + s * (normal[-1, 1] - normal[0, 1]) < 0:
        c, s = -c, -s
    angle = np.empty(count)
    for b in range(count):
        angle[b] = np.arctan2(normal[b, 0] * c + normal[b, 1] * s, normal[b, 2])
        if b:
            angle[b] -= 2 * np.pi * np.rint((angle[b] - angle[b - 1]) / (2 * np.pi))
    return c, s, angle, doubt


@njit
def arc_sums(x, z, turn, height, aside):
    """Running sums (B + 1, 4, 4) of the squared equations of a circle through a way, and of its normals."""
    count = x.shape[0]
    sums, row = np.zeros((count + 1, 4, 4)), np.empty((2, 4))
    for b in range(count):
        sine, cosine = np.sin(turn[b]), np.cos(turn[b])
        row[0, 0], row[0, 1], row[0, 2] = x[b] / height, z[b] / height, 0.5 / height
        row[0, 3] = (x[b] * x[b] + z[b] * z[b]) / (2 * height)
        row[1, 0], row[1, 1], row[1, 2] = cosine / aside, -sine / aside, 0.0
        row[1, 3] = (x[b] * cosine - z[b] * sine) / aside
        for i in range(4):
            for j in range(4):
                sums[b + 1, i, j] = sums[b, i, j] + row[0, i] * row[0, j] + row[1, i] * row[1, j]
    return sums


@njit
def arc_between(sums, first, last, system, target):
    """Radius of the arc through pieces first to last, and its standard error; two arrays to work in."""
    trace = 0.0
    for i in range(3):
        target[i, 0] = sums[last + 1, i, 3] - sums[first, i, 3]
        for j in range(3):
            system[i, j] = sums[last + 1, i, j] - sums[first, i, j]
        trace += system[i, i]
    left = sums[last + 1, 3, 3] - sums[first, 3, 3]
    p, q, r = target[0, 0], target[1, 0], target[2, 0]
    for i in range(3):
        system[i, i] += 1e-12 * trace
    solve(system, target, 0.0)
    x, z, rest = target[0, 0], target[1, 0], target[2, 0]
    misfit = max((left - x * p - z * q - rest * r) / (2 * (last - first + 1) - 3), 1.0)
    radius = np.sqrt(max(rest + x * x + z * z, 1e-12))
    a, b, c = x / radius, z / radius, 0.5 / radius
    variance = a * a * system[0, 0] + b * b * system[1, 1] + c * c * system[2, 2]
    variance += 2 * (a * b * system[0, 1] + a * c * system[0, 2] + b * c * system[1, 2])
    return radius, np.sqrt(variance) * misfit


@njit
def rounding_of(place, normal, steady, bend, bent, radius, least_turn, fewest, limits, found):
    """An inner edge and the arc that is known best, of one roll: rows of `site_roundings`."""
    floor, stick, leaning, wide, still = limits
    count = place.shape[0]
    c, s, turn, doubt = turn_of(place, normal, bend, bent)
    height = np.sqrt(steady * steady + floor * floor)
    x, z, aside = np.empty(count), np.empty(count), np.empty(count)
    for b in range(count):
        x[b], z[b] = (place[b, 0] * c + place[b, 1] * s) / radius, place[b, 2] / radius
        aside[b] = (place[b, 1] * c - place[b, 0] * s) / radius
    furthest, smallest = 0.0, np.inf
    for first in range(count):
        for last in range(first + 1, count):
            total = turn[last] - turn[first]
            if total >= least_turn:
                chord = np.hypot(x[last] - x[first], z[last] - z[first])
                if chord + 2 * height / radius <= still * total and total > furthest:
                    furthest = total
                    found[0, 0], found[0, 2], found[0, 3] = chord * radius, total, 1.0
                if last - first >= fewest - 1 and x[last] > x[first]:
                    smallest = min(smallest, chord / (2 * np.sin(min(total, 3.0) / 2)))
    found[0, 1] = found[1, 1] = np.arctan2(s, c) % np.pi
    if smallest > wide:
        return
    second = np.empty(count - 2)
    for b in range(count - 2):
        second[b] = abs(turn[b + 2] - 2 * turn[b + 1] + turn[b])
    angle = np.hypot(quantile(second, count - 2, 0.75) / (1.15 * np.sqrt(6.0)), stick)
    sums = arc_sums(x, z, turn, height / radius, angle)
    system, target, best = np.empty((3, 3)), np.empty((3, 1)), np.inf
    for first in range(count):
        for last in range(first + fewest - 1, count):
            total = turn[last] - turn[first]
            if total >= least_turn and x[last] > x[first]:
                reach, error = arc_between(sums, first, last, system, target)
                lean = angle / total if doubt < 0 else max(doubt, leaning)
                error = np.hypot(error, (aside[last] - aside[first]) * lean / total)
                if error < best:
                    best = error
                    found[1, 0], found[1, 2], found[1, 3] = radius * (reach - 1), total, 1.0
                    found[1, 4] = radius * error


@njit
def site_roundings(
    position, normal, samples, starts, origin, frame, radius, least_turn, most, fewest, narrowest, limits
):
    """What each roll of a site crosses: an inner edge, and the arc that is known best (R, 2, 5).

    Columns: radius (inner edge: way of the centre), direction across, turn, 1 where there is one, standard
    error. ``starts`` (R + 1,) says where the samples of each roll begin.
    """
    rolls = len(starts) - 1
    places, normals = np.empty((rolls * most, 3)), np.empty((rolls * most, 3))
    size, steady, ways = np.zeros(rolls, np.int64), np.empty(rolls), np.empty(rolls)
    count = 0
    for r in range(rolls):
        place, facing = in_frame(position, normal, samples[starts[r] : starts[r + 1]], origin, frame)
        means, turned, steady[r] = piece_means(place, facing, most)
        size[r] = means.shape[0]
        places[count : count + size[r]], normals[count : count + size[r]] = means, turned
        ways[r] = np.arctan2(means[-1, 1] - means[0, 1], means[-1, 0] - means[0, 0])
        count += size[r]
    bent = rolls > 0 and not spread_of(ways) < narrowest
    bend = bend_of(places[:count]) if bent else (0.0, 0.0, 0.0)
    found = np.zeros((rolls, 2, 5))
    count = 0
    for r in range(rolls):
        rows = slice(count, count + size[r])
        rounding_of(
            places[rows], normals[rows], steady[r], bend, bent, radius, least_turn, fewest, limits, found[r]
        )
        count += size[r]
    return found
